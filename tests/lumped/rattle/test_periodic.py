"""Constructed motions beside the return map and what the source prints of them."""

from __future__ import annotations

import numpy as np
import pytest

from lumped.rattle.departures import apart, follow
from lumped.rattle.machine import Machine
from lumped.rattle.periodic import simple_rattle, two_sided_rattle

SCALED = {"damping": 0.6, "half_backlash": 0.6}


@pytest.mark.parametrize("restitution", [1.0, 0.9, 0.7])
@pytest.mark.parametrize("turns", [1, 2])
def test_two_sided_rattle_is_a_fixed_point(restitution, turns):
    machine = Machine(
        damping=0.1, eccentricity=0.1, half_backlash=0.6, restitution=restitution
    )
    found = [each for each in two_sided_rattle(machine, turns) if each.physical]
    assert len(found) >= 2
    assert {each.in_phase for each in found} == {True, False}
    for each in found:
        start, end = follow(machine, (each.time, each.velocity), 2)
        assert end[0] - start[0] == pytest.approx(turns, abs=1e-9)
        assert apart(start, end) < 1e-8
        assert start[2] == 1


def test_constructed_motions_of_a_real_pump_are_fixed_points():
    pump = Machine(damping=3e-4, eccentricity=1e-4, half_backlash=6e-4)
    for turns in (1, 2, 3):
        for each in (*simple_rattle(pump, turns), *two_sided_rattle(pump, turns)):
            if each.physical:
                start, end = follow(pump, (each.time, each.velocity), 2)
                assert apart(start, end) < 1e-6  # what repels grows by 1e6
                assert start[2] == each.name.endswith("1)")
    physical = [e for e in two_sided_rattle(pump) if e.physical]
    assert {each.in_phase for each in physical} == {True, False}


def test_virtual_motions_are_known_as_such():
    """Constructed at dampings where the return map goes elsewhere."""
    for damping, physical in ((0.69, True), (0.691, False)):  # printed 0.6905
        machine = Machine(damping=damping, eccentricity=0.1, half_backlash=0.6)
        in_phase, _ = simple_rattle(machine)
        assert in_phase.in_phase
        assert in_phase.physical == physical
        start, end = follow(machine, (in_phase.time, in_phase.velocity), 2)
        assert (apart(start, end) < 1e-8) == physical


def test_two_sided_rattle_is_born_in_a_saddle_node():
    """Printed as seen in figure 3.11 at an eccentricity of 0.067: at 0.06875."""
    for eccentricity, count in ((0.06874, 0), (0.06876, 2)):
        machine = Machine(**SCALED, eccentricity=eccentricity)
        assert len(two_sided_rattle(machine)) == count
    one, two = two_sided_rattle(machine)
    assert np.isclose(one.velocity, two.velocity, rtol=0.01)


def test_motions_of_soft_flanks_are_not_constructed():
    soft = Machine(**SCALED, eccentricity=0.1, stiffness=1e3)
    with pytest.raises(ValueError, match="impacts without torque ripple are needed"):
        two_sided_rattle(soft)
    with pytest.raises(ValueError, match="turns must be at least 1"):
        two_sided_rattle(Machine(**SCALED, eccentricity=0.1), 0)
