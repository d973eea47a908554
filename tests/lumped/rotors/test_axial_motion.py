"""Shafts that move along their axes, against rods in closed form."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from lumped.rotors.campbell import campbell
from lumped.rotors.critical import critical_speeds
from lumped.rotors.description import Bearing, Disk, Rotor, RotorSystem, Section
from lumped.rotors.frames import rotating_frame
from lumped.rotors.matrices import assemble
from lumped.rotors.whirl import WhirlProblem, mode_kind

YOUNG, SHEAR, DENSITY = 2.1e11, 8e10, 7800.0
LENGTH, DIAMETER = 1.0, 0.05
AREA = math.pi * DIAMETER**2 / 4.0
SPEED_OF_SOUND = math.sqrt(YOUNG / DENSITY)
RIGID = 1e17  # N/m, against E A / L = 4e8 of the rod


def bearings(axial=0.0, damping=0.0):
    return tuple(
        Bearing(
            position=z,
            stiffness=(1e8, 0.0, 0.0, 1e8),
            axial_stiffness=k,
            axial_damping=c,
        )
        for z, k, c in ((0.0, axial, damping), (LENGTH, 0.0, 0.0))
    )


def shaft(**changes):
    usual = {
        "name": "shaft",
        "sections": (Section(length=LENGTH, diameter=DIAMETER),),
        "bearings": bearings(),
        "young_modulus": YOUNG,
        "shear_modulus": SHEAR,
        "density": DENSITY,
    }
    return Rotor(**usual | changes)


def system_of(elements, rotor):
    return RotorSystem(rotors=(rotor,), elements=elements, axial_motion=True)


def axial_frequencies(elements, **changes):
    problem = WhirlProblem(assemble(system_of(elements, shaft(**changes))))
    modes = problem.solve(300.0)
    return modes.frequency[modes.axial > 0.5]


@pytest.mark.parametrize(
    ("axial", "waves"),
    [(0.0, [1.0, 2.0]), (RIGID, [0.5, 1.5])],
    ids=["free at both ends", "clamped at one end"],
)
def test_rods_converge_to_their_closed_form_with_order_two(axial, waves):
    """Frequencies of waves whose half-lengths fit, n pi c / L."""
    expected = np.array(waves) * math.pi * SPEED_OF_SOUND / LENGTH
    errors = [
        np.abs(axial_frequencies(n, bearings=bearings(axial))[:2] / expected - 1.0)
        for n in (8, 16, 32, 64)
    ]
    assert errors[-1].max() < 1.1e-3 * max(waves) ** 2
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(orders[-1], 2.0, atol=0.02)


def test_a_disk_on_a_light_rod_is_a_mass_on_springs():
    """Of the rod from its axial bearing to the disk, and that bearing in series."""
    disk = Disk(position=0.4, mass=20.0, polar_inertia=0.4, transverse_inertia=0.25)
    computed = axial_frequencies(5, bearings=bearings(3e8), disks=(disk,), density=1e-4)
    spring = 1.0 / (0.4 / (YOUNG * AREA) + 1.0 / 3e8)
    assert computed[0] == pytest.approx(math.sqrt(spring / 20.0), rel=1e-8)


def test_a_damped_axial_bearing_has_its_damping_ratio():
    disk = Disk(position=0.0, mass=20.0, polar_inertia=0.4, transverse_inertia=0.25)
    rotor = shaft(bearings=bearings(3e6, 900.0), disks=(disk,), density=1e-4)
    modes = WhirlProblem(assemble(system_of(2, rotor))).solve(0.0)
    (value,) = modes.eigenvalues[(modes.axial > 0.5) & (modes.frequency < 1e4)]
    ratio = 900.0 / (2.0 * math.sqrt(3e6 * 20.0))
    assert -value.real / abs(value) == pytest.approx(ratio, rel=1e-8)


def test_without_helical_gears_motion_along_the_axis_changes_no_other():
    """Matrices without it are the leading part, to the last bit."""
    disk = Disk(position=0.4, mass=20.0, polar_inertia=0.4, transverse_inertia=0.25)
    rotor = shaft(disks=(disk,), bearings=bearings(3e8), internal_damping=1e-6)
    space = assemble(system_of(4, rotor))
    plane = assemble(replace(system_of(4, rotor), axial_motion=False))
    n = plane.size
    assert space.size == n + len(space.nodes[0])
    for name in ("mass", "damping", "stiffness", "gyroscopic", "circulatory"):
        matrix = getattr(space, name)
        np.testing.assert_array_equal(matrix[:n, :n], getattr(plane, name))
        assert not matrix[:n, n:].any()
        assert not matrix[n:, :n].any()
    np.testing.assert_array_equal(space.is_rotation[:n], plane.is_rotation)
    np.testing.assert_array_equal(space.is_axial, np.arange(space.size) >= n)
    assert space.index(0, 0.4, "z") - n == space.index(0, 0.4, "x") // 5
    # material damping is no rotation of the frame along the axis
    assert not space.circulatory[n:].any()
    turned = rotating_frame(system_of(4, replace(rotor, internal_damping=0.0)))
    assert not turned.centripetal[n:].any()


def test_a_shaft_that_nothing_holds_along_its_axis_has_no_mode_of_frequency_zero():
    one, other = (
        WhirlProblem(assemble(system_of(4, shaft(bearings=bearings(axial)))))
        for axial in (0.0, 1e7)
    )
    assert (one.rigid_motions, other.rigid_motions) == (2, 1)  # one is the rotation
    assert one.solve(100.0).frequency.min() > 1.0
    # the other one has a mode more, the shaft on its axial bearing
    assert other.squares.size == one.squares.size + 1


def test_diagrams_and_critical_speeds_have_the_axial_part_of_the_energy():
    disk = Disk(position=0.4, mass=20.0, polar_inertia=0.4, transverse_inertia=0.25)
    rotor = shaft(disks=(disk,), bearings=bearings(2e7))
    problem = WhirlProblem(assemble(system_of(4, rotor)))
    diagram = campbell(problem, [0.0, 500.0, 1000.0, 1500.0], 5)
    ends = diagram.axial, diagram.torsion, diagram.whirl
    kinds = {
        tuple(
            mode_kind(float(whirl[row, mode]), float(torsion[row, mode]), float(part))
            for row, part in enumerate(axial[:, mode])
        )
        for axial, torsion, whirl in [ends]
        for mode in range(5)
    }
    assert ("axial",) * 4 in kinds
    axial = [one for one in critical_speeds(problem, diagram, 1.0) if one.axial > 0.5]
    (only,) = axial
    mass = 20.0 + DENSITY * AREA * LENGTH
    assert only.frequency == pytest.approx(math.sqrt(2e7 / mass), rel=0.01)


def test_the_kind_of_a_mode_has_the_largest_part_of_its_energy():
    assert mode_kind(0.9, 0.2, 0.3) == "forward"
    assert mode_kind(0.9, 0.2, 0.45) == "axial"
    assert mode_kind(0.9, 0.4, 0.35) == "torsion"
    assert mode_kind(0.0, 0.0, 1.0) == "axial"
    assert mode_kind(-0.9, 0.5) == "backward"
