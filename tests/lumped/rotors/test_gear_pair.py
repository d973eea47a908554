"""A gear pair with tilt on two shafts, beside an assembly that shares no code."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from oracles.geared_rotors import Assembly

from lumped.rotors.description import (
    Bearing,
    Disk,
    MeshSpring,
    Rotor,
    RotorSystem,
    Section,
)
from lumped.rotors.matrices import assemble
from lumped.rotors.whirl import WhirlProblem
from lumped.train.bodies import Gear
from lumped.train.coordinates import line_of_action, rolling_sense
from lumped.train.train import Mesh, Train

MATERIAL = 7850.0, 206e9, 79e9  # density, Young's and shear modulus
LENGTHS, DIAMETERS = (0.3, 0.4), (0.03, 0.045)
PLACES = (0.21, 0.12)  # of the gears: off the middle of their shafts
GEARS = ((2.0, 4e-3, 2.3e-3), (7.0, 3e-2, 1.7e-2))  # mass, polar, transverse
TEETH, RADII = (25, 50), (0.05, 0.1)
BEARINGS = ((8e7, 1.1e8), (2e8, 1.5e8))
ANGLE, STIFFNESS, WIDTH = math.radians(20.0), 4e8, 0.04


def train(center_line, internal=False):
    radii = RADII[0], (-1.0 if internal else 1.0) * RADII[1]
    gears = tuple(
        Gear(name=str(i), teeth=z, base_radius=r, inertia=1.0)
        for i, (z, r) in enumerate(zip(TEETH, radii, strict=True))
    )
    mesh = Mesh(driver=0, driven=1, pressure_angle=ANGLE, center_line=center_line)
    return Train(gears=gears, meshes=(mesh,))


def ours(center_line, elements, width=WIDTH, places=PLACES):
    gears = train(center_line)
    rotors = tuple(
        Rotor(
            name=str(i),
            sections=(Section(length=LENGTHS[i], diameter=DIAMETERS[i]),),
            disks=(
                Disk(
                    position=places[i],
                    mass=GEARS[i][0],
                    polar_inertia=GEARS[i][1],
                    transverse_inertia=GEARS[i][2],
                ),
            ),
            bearings=tuple(
                Bearing(
                    position=z, stiffness=(BEARINGS[i][0], 0.0, 0.0, BEARINGS[i][1])
                )
                for z in (0.0, LENGTHS[i])
            ),
            density=MATERIAL[0],
            young_modulus=MATERIAL[1],
            shear_modulus=MATERIAL[2],
            speed_ratio=float(gears.speeds[i]),
        )
        for i in (0, 1)
    )
    mesh = MeshSpring(
        rotors=(0, 1),
        positions=places,
        base_radii=RADII,
        direction=line_of_action(gears, gears.meshes[0]),
        sense=rolling_sense(gears, gears.meshes[0]),
        stiffness=STIFFNESS,
        width=width,
        teeth=TEETH[0],
    )
    return RotorSystem(rotors=rotors, meshes=(mesh,), elements=elements)


def theirs(nodes, center_line):
    """The other assembly with the same nodes."""
    other = Assembly([len(positions) for positions in nodes])
    for i, positions in enumerate(nodes):
        ratio = (1.0, -TEETH[0] / TEETH[1])[i]
        for node, length in enumerate(np.diff(positions)):
            other.add_slices(i, node, length, DIAMETERS[i], MATERIAL, ratio)
        place = int(np.abs(np.array(positions) - PLACES[i]).argmin())
        other.add_gear(i, place, *GEARS[i], ratio)
        for node in (0, len(positions) - 1):
            other.add_bearing(i, node, *BEARINGS[i])
    # the driver turns counter-clockwise and pushes along the tangent of its base
    # circle at the point of contact, which is the pitch point here
    along = np.array([math.cos(center_line), math.sin(center_line)])
    across = np.array([-along[1], along[0]])
    push = math.cos(ANGLE) * across + math.sin(ANGLE) * along
    pitch = [radius / math.cos(ANGLE) for radius in RADII]
    points = pitch[0] * along, -pitch[1] * along
    ends = [(i, int(np.abs(np.array(nodes[i]) - PLACES[i]).argmin())) for i in (0, 1)]
    other.add_teeth(ends, points, push, STIFFNESS, WIDTH)
    return other


@pytest.mark.parametrize("center_line", [0.0, 0.7, math.pi / 2.0, 4.0])
@pytest.mark.parametrize("speed", [0.0, 800.0, 6000.0])
def test_frequencies_are_those_of_an_assembly_from_energies(center_line, speed):
    system = assemble(ours(center_line, elements=4))
    expected = theirs(system.nodes, center_line).frequencies(speed)[:16]
    frequencies = WhirlProblem(system).solve(speed).frequency[:16]
    np.testing.assert_allclose(frequencies, expected, rtol=2e-8)


def test_spread_teeth_resist_tilting_and_a_line_of_teeth_does_not():
    """Only the frequencies of modes that tilt the gears against each other rise."""
    spread, line = (
        WhirlProblem(assemble(ours(0.7, 4, width))).solve(800.0).frequency
        for width in (WIDTH, 0.0)
    )
    assert (spread >= line * (1.0 - 1e-12)).all()
    assert (spread[:16] / line[:16]).max() > 1.01


def test_a_gear_off_the_middle_couples_translation_and_tilt():
    """In the middle of symmetric shafts a mode either tilts the gears or moves them."""

    def coupling(places):
        system = assemble(ours(math.pi / 2.0 - ANGLE, 4, WIDTH, places))
        modes = WhirlProblem(system).solve(0.0, 12)
        x = system.index(0, places[0], "x")
        moved, tilted = (
            np.abs(modes.shapes[[x + a, x + b]]).max(axis=0) / scale
            for a, b, scale in ((0, 1, 1.0), (2, 3, 10.0))
        )
        return np.minimum(moved, tilted).max() / np.maximum(moved, tilted).max()

    assert coupling((0.15, 0.2)) < 1e-6
    assert coupling(PLACES) > 1e-2


def test_an_offset_of_the_teeth_is_a_gear_that_is_as_far_away():
    """Teeth beside a rigid gear without inertia load the shaft as one beside it."""
    base = ours(0.7, 4)
    moved = replace(base.meshes[0], offsets=(0.02, -0.01), width=0.0)
    system = assemble(replace(base, meshes=(moved,)))
    x1, x2 = (system.index(i, PLACES[i], "x") for i in (0, 1))
    matrix = system.mesh_stiffness[0]
    # a displacement and a tilt that cancel at the offset do not press the teeth
    motion = np.zeros(system.size)
    motion[[x1, x1 + 3]] = -0.02, 1.0
    motion[[x2 + 1, x2 + 2]] = -0.01, 1.0
    np.testing.assert_allclose(matrix @ motion, 0.0, atol=1e-6 * STIFFNESS * 0.01)
    assert np.abs(matrix @ np.abs(motion)).max() > 1e-3 * STIFFNESS * 0.01
