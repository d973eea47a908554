"""Noise levels beside closed forms, and chances that are those of basins."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from fegear.rattle.noise import proportion_limits
from lumped.rattle.departures import follow
from lumped.rattle.machine import Machine
from lumped.rattle.noise import measure_noise, random_departures
from lumped.rattle.periodic import simple_rattle

FIGURES = {"eccentricity": 0.1, "half_backlash": 0.6}
SPEEDS = 0.0, 7.0


@pytest.mark.parametrize("stiffness", [math.inf, 1e7])
def test_motions_are_as_loud_as_their_impacts(stiffness):
    """Without meetings of the lower flank they are at the speeds of departure; those
    of simple rattle are known in closed form."""
    machine = Machine(damping=0.575, stiffness=stiffness, **FIGURES)
    starts = random_departures(200, SPEEDS, 3)
    noise = measure_noise(machine, starts, 1499, 300)
    found = {each.name: i for i, each in enumerate(noise.attractors)}
    assert {"quiet", "P(1,1,0)", "P(1,2,0)"} <= found.keys()
    for name, count in (("P(1,1,0)", 1), ("P(1,2,0)", 2)):
        own = noise.motion == found[name]
        point = noise.attractors[found[name]].point
        speeds = follow(machine, point, count)[:, 1]
        np.testing.assert_allclose(noise.level[own], np.sum(speeds**2), rtol=1e-2)
        np.testing.assert_allclose(noise.impacts[own], count, rtol=1e-2)
    assert (noise.level[noise.motion == found["quiet"]] == 0.0).all()
    (rattle,) = [
        e for e in simple_rattle(replace(machine, stiffness=math.inf)) if e.in_phase
    ]
    simple = noise.level[noise.motion == found["P(1,1,0)"]]
    np.testing.assert_allclose(simple, rattle.velocity**2, rtol=2e-2)


def test_runs_are_made_again_by_their_seed():
    one, again, other = (random_departures(50, SPEEDS, seed) for seed in (4, 4, 5))
    np.testing.assert_array_equal(one, again)
    assert not np.array_equal(one, other)
    assert ((one >= [0.0, 0.0]) & (one <= [1.0, 7.0])).all()


def test_limits_of_a_proportion_hold_it():
    """Beside many draws."""
    random = np.random.default_rng(1)
    for chance in (0.02, 0.5):
        inside = []
        for seen in random.binomial(200, chance, 4000):
            low, high = proportion_limits(int(seen), 200)
            inside.append(low <= chance <= high)
        assert np.mean(inside) == pytest.approx(0.95, abs=0.03)
