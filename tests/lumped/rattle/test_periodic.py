"""Constructed motions beside the return map and what the source prints of them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import fsolve

from lumped.rattle.machine import Machine
from lumped.rattle.periodic_orbits import simple_rattle, two_sided_rattle
from lumped.rattle.return_map import distance, follow

SCALED = {"damping": 0.6, "half_backlash": 0.6}
TURN = 2.0 * math.pi


@pytest.mark.parametrize("restitution", [1.0, 0.9, 0.7])
@pytest.mark.parametrize("turns", [1, 2])
def test_two_sided_rattle_is_a_fixed_point(restitution, turns):
    machine = Machine(
        damping=0.1, eccentricity=0.1, half_backlash=0.6, restitution=restitution
    )
    motions = [motion for motion in two_sided_rattle(machine, turns) if motion.physical]
    assert len(motions) >= 2
    assert {motion.in_phase for motion in motions} == {True, False}
    for motion in motions:
        start, end = follow(machine, (motion.time, motion.velocity), 2)
        assert end[0] - start[0] == pytest.approx(turns, abs=1e-9)
        assert distance(start, end) < 1e-8
        assert start[2] == 1


def test_constructed_motions_of_a_real_pump_are_fixed_points():
    pump = Machine(damping=3e-4, eccentricity=1e-4, half_backlash=6e-4)
    for turns in (1, 2, 3):
        for motion in (*simple_rattle(pump, turns), *two_sided_rattle(pump, turns)):
            if motion.physical:
                start, end = follow(pump, (motion.time, motion.velocity), 2)
                assert distance(start, end) < 1e-6  # what repels grows by 1e6
                assert start[2] == motion.name.endswith("1)")
    physical = [e for e in two_sided_rattle(pump) if e.physical]
    assert {motion.in_phase for motion in physical} == {True, False}


def test_virtual_motions_are_known_as_such():
    """Constructed at dampings where the return map goes elsewhere."""
    for damping, physical in ((0.69, True), (0.691, False)):  # printed 0.6905
        machine = Machine(damping=damping, eccentricity=0.1, half_backlash=0.6)
        in_phase, _ = simple_rattle(machine)
        assert in_phase.in_phase
        assert in_phase.physical == physical
        start, end = follow(machine, (in_phase.time, in_phase.velocity), 2)
        assert (distance(start, end) < 1e-8) == physical


def test_motions_of_soft_flanks_are_not_constructed():
    soft = Machine(**SCALED, eccentricity=0.1, stiffness=1e3)
    with pytest.raises(ValueError, match="impacts without torque ripple are needed"):
        two_sided_rattle(soft)
    with pytest.raises(ValueError, match=r"turns = .*; must be at least 1"):
        two_sided_rattle(Machine(**SCALED, eccentricity=0.1), 0)


def moved(t, start, place, speed, damping, eccentricity):
    """Place and speed at t of x'' + d x' = 4 pi d - 4 pi^2 e cos 2 pi t
    - 2 pi d e sin 2 pi t, of which 4 pi t + e cos 2 pi t is a solution."""
    forced = [
        (
            2.0 * TURN * time + eccentricity * math.cos(TURN * time),
            2.0 * TURN - TURN * eccentricity * math.sin(TURN * time),
        )
        for time in (start, t)
    ]
    free_speed, fade = speed - forced[0][1], math.exp(-damping * (t - start))
    change = forced[1][0] - forced[0][0] + free_speed * (1.0 - fade) / damping
    return place + change, forced[1][1] + free_speed * fade


def test_birth_of_two_sided_rattle_by_the_arcs_alone():
    """0.0687468: where the conditions of both impacts have a singular derivative.

    Printed is 0.067, a panel of figure 3.11 in which the motion is not seen yet.
    """

    def missed(u, eccentricity):
        departs, lower, speed, there = u
        x, v = moved(lower, departs, 0.6, -speed, 0.6, eccentricity)
        y, w = moved(departs + 1.0, lower, -0.6, there, 0.6, eccentricity)
        return np.array([x + 0.6, v + there, y - 0.6, w - speed])

    def singular(z):
        u, eccentricity = z[:4], z[4]
        columns = [
            missed(u + step, eccentricity) - missed(u - step, eccentricity)
            for step in 1e-5 * np.eye(4)
        ]
        area = np.linalg.det(np.array(columns) / 2e-5)
        return np.append(missed(u, eccentricity), area)

    born = fsolve(singular, [0.76, 1.28, 4.28, 0.51, 0.07], xtol=1e-12)
    assert np.abs(singular(born)).max() < 1e-9
    assert born[4] == pytest.approx(0.0687468, abs=1e-7)
    for change, count in ((-1e-7, 0), (1e-7, 2)):
        machine = Machine(**SCALED, eccentricity=born[4] + change)
        assert len(two_sided_rattle(machine)) == count


def test_graze_of_simple_rattle_by_its_arc_alone():
    """0.690675: where the lower flank is met without speed. Printed is 0.6905, the last
    damping in steps of 0.0005 at which the motion exists."""

    def missed(z):
        departs, speed, lowest, damping = z
        x, v = moved(departs + 1.0, departs, 0.6, -speed, damping, 0.1)
        y, w = moved(lowest, departs, 0.6, -speed, damping, 0.1)
        return [x - 0.6, v - speed, y + 0.6, w]

    damping = fsolve(missed, [0.86, 4.3, 1.4, 0.7], xtol=1e-12)[3]
    assert damping == pytest.approx(0.690675, abs=1e-6)
    for change, physical in ((-1e-8, True), (1e-8, False)):
        machine = Machine(**(SCALED | {"damping": damping + change}), eccentricity=0.1)
        assert simple_rattle(machine)[0].physical == physical
