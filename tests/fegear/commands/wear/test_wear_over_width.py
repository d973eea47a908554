"""Wear over profile and face width: balances, sections, and what it levels."""

from __future__ import annotations

import math

import numpy as np
import pytest
from sliced_pairs import TORQUE, problem, slope

from fegear.commands.wear.archard import StepPlan, path_points, wear_off
from fegear.commands.wear.faces import WearingFaces
from fegear.contact.solve import solve_cycle

K = 1e-18  # m2/N


def wearing(helix_angle_deg: float, depth: float) -> WearingFaces:
    contact = problem(helix_angle_deg, slope(depth))
    return WearingFaces(contact, TORQUE, K, path_points(contact.pair, 8))


@pytest.mark.parametrize("helix_angle_deg", [0.0, 18.0])
def test_wear_levels_the_load_of_misaligned_gears(helix_angle_deg):
    """K_Hbeta falls with the cycles, and both gears lose the volume of their work."""
    mesh = wearing(helix_angle_deg, 10e-6)
    factors, depth = [], mesh.unworn
    for _ in range(3):
        worn = wear_off(mesh, depth, 1e7, StepPlan(1e-6, 2))
        factors += [worn.first.distribution_factor]
        depth = worn.depth
        volume = K * worn.sliding_work
        areas = mesh.worn_areas(worn.lost) / mesh.passages[:, 0]
        assert areas == pytest.approx(volume, rel=1e-2)
    factors += [worn.last.distribution_factor]
    assert (np.diff(factors) < 0.0).all()


def test_the_volume_is_that_of_load_times_sliding():
    """Summed over slices of a contact that is solved at other positions."""
    mesh = wearing(18.0, 5e-6)
    loaded = mesh.load(mesh.unworn)
    count = 64
    cycle = solve_cycle(mesh.contact, TORQUE, np.arange(count) / count)
    face, pair = cycle.face, mesh.pair
    position = face.path_position
    inside = (position > pair.path[0]) & (position < pair.path[1])
    path = position * pair.base_pitch
    radii = pair.driver.base_radius, pair.driven.base_radius
    sliding = np.abs(path) * sum(1.0 / radius for radius in radii)  # over the path
    force = face.load[0] / math.cos(face.base_helix_angle) / face.place.size
    work = (force * sliding * inside).sum() * pair.base_pitch / count
    assert mesh.sliding_work(loaded) == pytest.approx(work, rel=0.03)
