"""Six freedoms of a pair whose hubs are both held, beside equations written again.

Eq. 6.1 to 6.3 of the multi-mesh source: rotations th1, th2 that close the mesh, and
for each gear w along the way of the driver's flank and y along its push. Eq. 6.3 as
printed takes the sliding by the second gear's vibration off; it comes to the other, as
both rotations of u_1 + u_2 close the mesh.
"""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from lumped.steady.integration_settings import Settings
from lumped.steady.steady_state import Speed
from lumped.steady.steppers import FixedStepper
from lumped.train.analytic import StiffnessParameters, analytic_excitation
from lumped.train.bodies import Gear
from lumped.train.friction import ToothFriction, with_bending
from lumped.train.system import LumpedSystem
from lumped.train.train import Mesh, Shaft, Train

MU, RATIO, TURNS = 0.2, 0.4, 0.02
K, EPS, ALPHA, RELIEF, BACKLASH = 3e8, 0.4, 0.6, 8e-6, 1e-5
RADII, TEETH, ANGLE = (0.045, 0.065), (38, 55), 0.35
INERTIA, MASS, BEARING = (2.6e-3, 3.3e-3), (2.0, 3.0), 2e8
HUB, SHAFT, DISK = (3e4, 5e4), 2e5, 1e-3
FREQUENCY, PERIODS = 1900.0, 12
PITCH = 2.0 * math.pi * RADII[0] / TEETH[0]


def share(x):
    """Stiffness of a pair x base pitches ahead of the pitch point, over the mean."""
    if not -0.75 < x < 0.75:
        return 0.0
    if abs(x) < 0.25:
        return 1.0 - 0.5 * EPS
    part = (abs(x) - 0.25) / 0.5
    return (1.0 + 0.5 * EPS) * (ALPHA + (1.0 - 2.0 * ALPHA) * part)


class SixFreedoms:
    """th1, w1, y1, th2, w2, y2, and a disk on a shaft at the second hub."""

    def __init__(self, torque, relief, disk):
        self.torque, self.relief, self.disk = torque, relief, disk
        inertia = [INERTIA[0], MASS[0], MASS[0], INERTIA[1], MASS[1], MASS[1], DISK]
        self.mass = np.array(inertia)
        self.row = np.array([RADII[0], 0.0, 1.0, RADII[1], 0.0, -1.0, 0.0])
        springs = np.diag([HUB[0], BEARING, BEARING, 0.0, BEARING, BEARING, 0.0])
        shaft = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, -1.0])
        if disk:
            springs[6, 6] = HUB[1]
            springs += SHAFT * np.outer(shaft, shaft)
        else:
            springs[3, 3] = HUB[1]
            springs[6, 6] = 1.0  # it stays
        self.springs = springs
        self.load = np.zeros(7)
        self.load[0], self.load[3] = torque, torque * RADII[1] / RADII[0]

    def contact(self, x, side, velocity):
        """Row of friction and tanh of the sliding speed."""
        slope, nominal = (
            math.tan(ANGLE),
            FREQUENCY * PITCH * sum(1.0 / r for r in RADII),
        )
        way = side * x * PITCH
        across = (1.0, 0.0)
        if side < 0:
            across = -math.cos(2.0 * ANGLE), math.sin(2.0 * ANGLE)
        b = np.zeros(7)
        b[0], b[3] = RADII[0] * slope + way, RADII[1] * slope - way
        b[1:3], b[4:6] = across, [-part for part in across]
        return b, math.tanh((nominal * way + b @ velocity) / TURNS)

    def slope(self, time, state):
        z, velocity = state[:7], state[7:]
        load = self.load - self.springs @ z
        place = (time * FREQUENCY) % 1.0
        for x in (place - 1.0, place):
            gap = self.relief * max(0.0, (abs(x) - 0.3) / 0.45)
            elastic = self.row @ z - gap
            side = 1 if elastic > 0.0 else -1
            overlap = max(elastic, -elastic - BACKLASH, 0.0)
            b, turned = self.contact(x, side, velocity)
            normal = K * share(x) * (1.0 - side * turned * MU * RATIO) * overlap
            load = load - side * normal * self.row - MU * turned * normal * b
        return np.concatenate([velocity, load / self.mass])

    def deflections(self, times):
        """At times (t,) [s], from rest under the mean stiffness."""
        mean = self.springs + K * np.outer(self.row, self.row)
        state = np.concatenate([np.linalg.solve(mean, self.load), np.zeros(7)])
        segments, marks = [], [0.0, 0.25, 0.3, 0.7, 0.75]
        ends = [(p + m) / FREQUENCY for p in range(PERIODS) for m in marks]
        ends.append(PERIODS / FREQUENCY)
        for start, end in pairwise(ends):
            solution = solve_ivp(
                *(self.slope, (start + 1e-13, end - 1e-13), state),
                rtol=1e-9,
                atol=1e-14,
                dense_output=True,
            )
            inside = times[(times >= start) & (times < end)]
            if inside.size:
                segments.append(self.row @ solution.sol(inside)[:7])
            state = solution.y[:, -1]
        return np.concatenate(segments)


def train_of(torque, disk):
    gears = [
        Gear(
            name=name,
            teeth=teeth,
            base_radius=radius,
            inertia=inertia,
            mass=mass,
            bearing_stiffness=(BEARING, BEARING),
            coupling_stiffness=hub,
            torque=torque * radius / RADII[0],
        )
        for name, teeth, radius, inertia, mass, hub in zip(
            "ab", TEETH, RADII, INERTIA, MASS, HUB, strict=True
        )
    ]
    shafts = ()
    if disk:
        gears[1] = replace(gears[1], coupling_stiffness=0.0)
        end = Gear(
            name="disk",
            teeth=1,
            base_radius=1.0,
            inertia=DISK,
            coupling_stiffness=HUB[1],
        )
        gears.append(end)
        shafts = (Shaft(gears=(1, 2), stiffness=SHAFT),)
    mesh = Mesh(
        driver=0,
        driven=1,
        pressure_angle=ANGLE,
        center_line=0.7,
        backlash=BACKLASH,
    )
    return Train(gears=tuple(gears), meshes=(mesh,), shafts=shafts)


@pytest.mark.parametrize(
    ("torque", "relief", "disk", "sides"),
    [
        (150.0, 0.0, False, {1, 0}),
        (30.0, RELIEF, False, {1, 0, -1}),
        (15.0, RELIEF, True, {1, 0}),
    ],
)
def test_motion_is_that_of_equations_written_again(torque, relief, disk, sides):
    """With and without relief, with teeth that part and touch on their backs."""
    figures = StiffnessParameters(
        mean=K, variation=EPS, contact_ratio=1.5, load_share=ALPHA
    )
    gap = [(-0.75, relief), (-0.3, 0.0), (0.3, 0.0), (0.75, relief)]
    excitation = analytic_excitation(figures, gap=gap if relief else ())
    rub = ToothFriction(MU, RATIO, "instantaneous", TURNS)
    bent = with_bending(excitation, rub)
    system = LumpedSystem(train_of(torque, disk), (bent,), friction=(rub,))
    stepper = FixedStepper(system)
    at = Speed(FREQUENCY, Settings(steps=1024))
    _, history = stepper.record(stepper.start(), at, PERIODS)
    seen = slice(None, -1, 40)
    times, deflection = history.time[seen], history.deflection[seen, 0]
    exact = SixFreedoms(torque, relief, disk).deflections(times)
    np.testing.assert_allclose(deflection, exact, atol=3e-4 * np.abs(exact).max())
    assert set(np.sign(history.force[:, 0])) == sides
