"""The linearised return map beside differences, and what damping takes of areas."""

from __future__ import annotations

import math

import numpy as np
import pytest

from lumped.rattle.arcs import arcs_of, history_of, linearise_arcs
from lumped.rattle.machine import Machine
from lumped.rattle.return_map import follow

MACHINES = {
    "impacts": {},
    "losses": {"restitution": 0.8},
    "flanks": {"stiffness": 3e3},
    "ripple": {"stiffness": 500.0, "ripple": 1.0, "ripple_order": 3},
}
COUNT = 3
STEP = 1e-6


def machine_of(name):
    figures = {"damping": 0.6, "eccentricity": 0.1, "half_backlash": 0.6}
    return Machine(**figures | MACHINES[name])


def paths(machine, number=40):
    """Paths whose neighbours have the same events, so that differences tell."""
    random = np.random.default_rng(3)
    while number:
        at = np.array([random.uniform(), random.uniform(1.0, 7.0)])
        nearby = [
            follow(machine, at + shift, COUNT + 1)
            for shift in STEP * np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]])
        ]
        lower = np.array([path[:-1, 2] for path in nearby])
        if np.isfinite(nearby).all() and (lower == lower[0]).all():
            number -= 1
            yield nearby


@pytest.mark.parametrize("name", MACHINES)
def test_linearised_returns_are_differences(name):
    machine = machine_of(name)
    errors = []
    for path, *ends in paths(machine):
        exact = linearise_arcs(machine, arcs_of(machine, path))
        last = [end[-1, :2] for end in ends]
        rough = np.stack([last[0] - last[1], last[2] - last[3]], axis=1) / (2.0 * STEP)
        errors.append(np.abs(exact - rough).max() / np.abs(exact).max())
    assert np.median(errors) < 1e-8
    assert np.quantile(errors, 0.9) < 1e-5  # those near a graze bend


@pytest.mark.parametrize("name", MACHINES)
def test_areas_shrink_by_damping_and_impacts(name):
    """Their change is e^(-delta t) r^2 for each impact, and the ratio of speeds."""
    machine = machine_of(name)
    for path, *_ in paths(machine):
        determinant = np.linalg.det(linearise_arcs(machine, arcs_of(machine, path)))
        lasts = path[-1, 0] - path[0, 0]
        impacts = COUNT + path[:-1, 2].sum()
        exact = math.exp(-0.6 * lasts) * machine.restitution ** (2 * impacts)
        exact *= path[0, 1] / path[-1, 1]
        assert determinant == pytest.approx(exact, rel=1e-6)


def test_arcs_of_flanks_that_stay_together_are_none():
    machine = machine_of("impacts")
    assert arcs_of(machine, np.array([[0.1, 2.0, 0.0], [math.nan] * 3])).size == 0


@pytest.mark.parametrize("name", MACHINES)
def test_histories_obey_the_equation_of_motion(name):
    """Eq. 2.26 by differences, away from where arcs meet."""
    machine = machine_of(name)
    path = follow(machine, (0.3, 4.0), 6)
    arcs = arcs_of(machine, path)
    count = 400
    history = history_of(machine, arcs, count).reshape(len(arcs), count, 2)
    for times, places in history.transpose(0, 2, 1):
        step = times[1] - times[0]
        second = np.diff(places, 2) / step**2
        first = (places[2:] - places[:-2]) / (2.0 * step)
        t, x = times[1:-1], places[1:-1]
        turn = 2.0 * math.pi
        load = turn**2 * 0.1 * np.cos(turn * t) + turn * 0.6 * 0.1 * np.sin(turn * t)
        force = 2.0 * turn * 0.6 - load
        force += machine.ripple * np.cos(turn * machine.ripple_order * t)
        beyond = np.sign(x) * np.maximum(np.abs(x) - 0.6, 0.0)
        stiffness = 0.0 if machine.is_impact else machine.stiffness
        exact = force - 0.6 * first - 2.0 * stiffness * beyond
        assert second == pytest.approx(exact, abs=1e-3 * np.abs(exact).max() + 2e-2)
    assert history[0, 0] == pytest.approx([0.3, 0.6])
