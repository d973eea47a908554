"""Dense trains of rims on spokes against limits and against the linear train."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from oracles import linear_train as lt
from oracles.rim_train import RimTrain

INERTIA = np.array([0.0026, 0.0109, 0.1193])  # kg m2
RADII = np.array([0.045, 0.066, 0.112])  # m
IDLER = RimTrain(
    hub=0.3 * INERTIA,
    rim=0.7 * INERTIA,
    spokes=np.full(3, 1e7),
    ground=np.array([3e4, 5e4, 1e6]),
    torque=np.array([100.0, 0.0, -100.0 * RADII[2] / RADII[0]]),
    rows=np.array([[RADII[0], RADII[1], 0.0], [0.0, -RADII[1], -RADII[2]]]),
    stiffness=np.array([3e8, 3.2e8]),
)


def test_rigid_spokes_are_disks():
    rigid = replace(IDLER, spokes=IDLER.spokes * 1e6)
    disks = lt.LinearTrain(
        inertia=INERTIA,
        rows=IDLER.rows,
        stiffness=IDLER.stiffness,
        ground=np.diag(IDLER.ground),
        torque=IDLER.torque,
        damping_ratio=0.0,
    )
    turns = rigid.static_turns(np.zeros(2))
    expected = lt.static_deflection(disks)
    np.testing.assert_allclose(IDLER.rows @ turns[:3], expected, rtol=1e-5)
    squares = np.linalg.eigvals(disks.matrix / INERTIA[:, None])
    angular = np.sort(np.sqrt(squares.real))
    np.testing.assert_allclose(rigid.angular[:3], angular, rtol=1e-5)


def test_one_rim_on_a_held_hub():
    """A hub without inertia between two springs in series."""
    one = RimTrain(
        hub=np.zeros(1),
        rim=np.array([2.0]),
        spokes=np.array([6.0]),
        ground=np.array([3.0]),
        torque=np.array([1.0]),
        rows=np.array([[1.0]]),
        stiffness=np.array([5.0]),
    )
    np.testing.assert_allclose(one.angular, [math.sqrt((2.0 + 5.0) / 2.0)])


def test_slow_gaps_are_static():
    gap = np.array([1e-6, -2e-6])
    slow = IDLER.harmonic_turns(1e-3, gap, np.zeros((6, 6))).real
    still = replace(IDLER, torque=np.zeros(3)).static_turns(gap)
    np.testing.assert_allclose(slow, still, rtol=1e-9)
