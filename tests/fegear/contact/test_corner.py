"""Tip corners, whose force is not along the normal of their own flank."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numba import njit

import fegear
from fegear.contact.plane import runs as contact
from fegear.contact.plane.contact import PlaneContact
from fegear.contact.problem import ContactProblem
from fegear.contact.solve import solve_cycle
from fegear.elasticity.flank_grid import beyond_first, point_arc
from fegear.statics.contact_problem import contact_problem
from fegear.statics.settings import StaticsSettings

TORQUE = 150.0  # N m
CORNER = 0.25  # position at which the wheel's tip corner bears on the pinion
PAIR = {
    "name": "corner",
    "plane": "stress",
    "defaults": {
        "module_mm": 3.0,
        "face_width_mm": 18.0,
        "rack_tip_radius_mm": 1.0,
        "young_modulus_GPa": 206.8,
        "poisson_ratio": 0.3,
    },
    "gear": [
        {"name": "pinion", "teeth": 23, "profile_shift": 0.2, "hub_radius_mm": 14.0},
        {"name": "wheel", "teeth": 41, "profile_shift": -0.1, "hub_radius_mm": 32.0},
    ],
    "mesh": [{"driver": "pinion", "driven": "wheel", "center_distance_mm": 96.36}],
    "load": {"gear": "pinion", "torques_Nm": [TORQUE]},
}


def problem_at(resolution: str) -> ContactProblem:
    gears = fegear.make_gear_set(PAIR)
    return contact_problem(gears, 0, StaticsSettings(resolution=resolution))


@pytest.mark.parametrize(("resolution", "allowed"), [("default", 1e-3), ("fine", 6e-4)])
def test_corner_is_that_of_another_program(resolution, allowed):
    """CalculiX 2.20, whole gears, contact meshes of 5 um at the corner: 15.566 um.

    On 100, 20 and 10 um it is 15.457, 15.553 and 15.562 um.
    """
    cycle = solve_cycle(problem_at(resolution), [TORQUE], [CORNER])
    assert cycle.ste[0, 0] == pytest.approx(15.566e-6, rel=allowed)
    loaded = cycle.load[0, 0] > 0.0
    assert loaded.sum() == 2
    assert cycle.load_share[0, 0][loaded].min() == pytest.approx(0.277, abs=1e-3)
    turn = cycle.turn[0, 0][loaded]
    assert np.degrees(np.arcsin(np.abs(turn).max())) == pytest.approx(2.2, abs=0.1)


def test_corner_converges_with_the_nodes_of_its_patch():
    problem = problem_at("coarse")
    errors = [
        float(
            solve_cycle(
                replace(problem, solver=PlaneContact(nodes=n)), [TORQUE], [CORNER]
            ).ste[0, 0]
        )
        for n in (25, 49, 97)
    ]
    steps = np.abs(np.diff(errors)) / errors[-1]
    assert steps[0] < 3e-4
    assert steps[1] < 0.5 * steps[0]


def test_forces_turn_off_the_path_alone():
    problem = problem_at("coarse")
    position = np.arange(64) / 64
    cycle = solve_cycle(problem, [TORQUE], position)
    pair = problem.pair
    s1 = pair.pitch_point + pair.base_pitch * (position[:, None] + cycle.teeth)
    on_path = (s1 >= pair.path_start) & (s1 <= pair.path_end)
    assert (cycle.turn[0][on_path] == 0.0).all()
    loaded = ~on_path & (cycle.load[0] > 0.0)
    assert (np.abs(cycle.turn[0][loaded]).max(axis=-1) > 0.0).all()
    # a corner is on one flank
    assert (np.count_nonzero(cycle.turn[0], axis=-1) <= 1).all()


def test_a_corner_that_grazes_has_a_load():
    """However small the load is at which it begins to bear."""
    problem, (low, high) = problem_at("coarse"), (1.0, TORQUE)

    def least(torque: float) -> float:
        return float(np.sort(solve_cycle(problem, [torque], [CORNER]).load[0, 0])[-2])

    assert least(low) == 0.0
    while low < 0.5 * (low + high) < high:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if least(middle) > 0.0 else (middle, high)
    assert 0.0 < least(high) < 1e-3  # N


def test_what_only_steep_corners_need_is_solved_for_them_alone(monkeypatch):
    """Without it the answer is the same to the bound that decides."""
    calls = []
    with_rootward = contact.with_rootward

    def counting(constants, problem):
        calls.append(constants)
        return with_rootward(constants, problem)

    monkeypatch.setattr(contact, "with_rootward", counting)
    problem = problem_at("coarse")
    with_it = solve_cycle(problem, [TORQUE], [0.0, CORNER])
    assert len(calls) == 1
    solve_cycle(problem, [TORQUE], [0.0])
    assert len(calls) == 1
    monkeypatch.setattr(contact, "MAX_TURN_SQUARED", math.inf)
    without = solve_cycle(problem, [TORQUE], [0.0, CORNER])
    assert without.ste[0, 0] == with_it.ste[0, 0]
    assert 0.0 < 1.0 - without.ste[0, 1] / with_it.ste[0, 1] < 2e-4


@pytest.mark.parametrize("both_ends", [False, True])
@pytest.mark.parametrize("grading", [0.0, 6.0])
def test_distance_before_the_first_point_is_logarithmic(grading, both_ends):
    grid = 7e-3, grading, both_ends, 32
    first, second = (_point_arc(i, *grid) for i in (0, 1))
    assert _beyond_first(first, *grid) == 0.0
    assert _beyond_first(second, *grid) == 0.0
    assert _beyond_first(first**2 / second, *grid) == pytest.approx(1.0, rel=1e-9)
    assert _beyond_first(0.0, *grid) == _beyond_first(1e-2 * first, *grid) < math.inf


@njit
def _point_arc(i, length, grading, both_ends, count):
    return point_arc(i, length, grading, both_ends, count)


@njit
def _beyond_first(arc, length, grading, both_ends, count):
    return beyond_first(arc, length, grading, both_ends, count)
