"""The inverse return map, and manifolds of saddles beside what they part."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from lumped.rattle.machine import TURN, Machine
from lumped.rattle.manifolds import (
    Fineness,
    grazing_curve,
    grow_manifolds,
    map_points,
    saddles,
)
from lumped.rattle.orbits import find_orbits
from lumped.rattle.return_map import follow, iterate_map_points

FIGURES = {"damping": 0.65, "eccentricity": 0.1, "half_backlash": 0.6}
KINDS = {
    "impacts": {},
    "losses": {"restitution": 0.8},
    "flanks": {"stiffness": 3e3},
    "ripple": {"stiffness": 500.0, "ripple": 1.0, "ripple_order": 3},
}
MACHINE = Machine(**FIGURES)


@pytest.mark.parametrize("name", KINDS)
def test_the_inverse_takes_returns_back(name):
    machine, random = Machine(**FIGURES | KINDS[name]), np.random.default_rng(5)
    starts = np.stack([random.uniform(0, 1, 3000), random.uniform(0.3, 9, 3000)], 1)
    once = map_points(machine, starts, 1)
    clear = np.isfinite(once[:, 0]) & (once[:, 1] > 1e-6)
    assert clear.mean() > 0.9
    back = map_points(machine, once[clear], -1)
    errors = np.abs(back - starts[clear]).max(axis=1)
    # a slow meeting on the way makes round-off large
    assert np.quantile(errors, 0.98) < 1e-10
    assert errors.max() < 1e-6


@cache
def saddle():
    (orbit,) = saddles(
        [o for o in find_orbits(MACHINE, 1, (0.0, 7.0)) if o.name == "P(1,1,0)"]
    )
    return orbit


@pytest.mark.parametrize("is_stable", [True, False])
def test_manifolds_lead_to_and_from_their_saddle(is_stable):
    fineness = Fineness()
    for manifold in grow_manifolds(MACHINE, saddle(), is_stable, 2.0, fineness):
        points = manifold.curve.points
        points = points[np.isfinite(points[:, 0])]
        assert manifold.curve.length > 1.9
        ends = map_points(MACHINE, points, 12 if is_stable else -12)
        offsets = ends - np.array(saddle().departures[0])
        offsets[:, 0] -= np.round(offsets[:, 0])
        largest = np.nanmax(np.abs(offsets[np.isfinite(offsets[:, 0])]))
        assert largest < 0.02
        assert np.isfinite(offsets[:, 0]).mean() > 0.98
        steps = np.diff(points, axis=0) / [1.0, TURN * 0.65]
        steps[:, 0] -= np.round(steps[:, 0])
        assert np.quantile(np.hypot(*steps.T), 0.98) <= fineness.spacing


def test_the_stable_manifold_parts_basins():
    """Beside it departures settle to one motion on one side and to another on the
    other."""
    parted = []
    for manifold in grow_manifolds(MACHINE, saddle(), True, 1.0, Fineness()):
        points = manifold.curve.points[5:-5:7]
        along = manifold.curve.points[6:-4:7] - points
        across = np.stack([-along[:, 1], along[:, 0]], axis=1)
        across *= 1e-5 / np.hypot(*across.T)[:, None]
        near = np.isfinite(across[:, 0]) & (points[:, 1] > 0.3)
        one, two = (
            iterate_map_points(MACHINE, (points + sign * across)[near], 1499).period
            for sign in (1, -1)
        )
        parted.extend((one < 0) != (two < 0))
    assert len(parted) > 20
    assert np.mean(parted) > 0.95


def test_departures_of_the_grazing_curve_graze():
    """A hair above and below it the lower flank is met or not; before it, one return
    later."""
    for before in (0, 1):
        curve = grazing_curve(MACHINE, before, Fineness())
        points = curve.points[np.isfinite(curve.points[:, 0])]
        points = points[points[:, 1] > 0.5]
        assert len(points) > 100
        near = map_points(MACHINE, points, before)
        for time, speed in near[::10]:
            met = [
                follow(MACHINE, (time, speed + shift), 2)[0, 2] > 0
                for shift in (-1e-6, 1e-6)
            ]
            assert met[0] != met[1]
