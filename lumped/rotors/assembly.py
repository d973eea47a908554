"""From rotors to matrices: M x'' + (C + Omega G) x' + (K + Omega H - Omega^2 N) x = 0.

It is eq. 6.10 of the multi-mesh source with damping. In the frame that does not turn
the matrices of axially symmetric rotors are constant, and there is no centripetal
matrix N; see `lumped.rotors.frames` for the one that turns.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate, pairwise

import numpy as np
from numpy.typing import NDArray

from lumped.rotors.beams import (
    NODE_COORDINATES,
    NODE_SIZE,
    QUARTER_TURN,
    bending_stiffness,
    gyroscopic_matrix,
    in_both_planes,
    rotation_mass,
    translation_mass,
    twist_matrices,
)
from lumped.rotors.description import (
    POSITION_RTOL,
    MeshSpring,
    Rotor,
    RotorError,
    RotorSystem,
    Section,
)

Array = NDArray[np.float64]
X, Y, TILT_X, TILT_Y, ROTATION = range(NODE_SIZE)


@dataclass(frozen=True, eq=False)
class GyroscopicSystem:
    """Matrices of n coordinates over the speed Omega of the system.

    nodes : positions of the nodes of every rotor [m]; five coordinates each, see
        `NODE_COORDINATES`
    speed_ratios : of every rotor over the speed of the system
    mass, damping, stiffness : M, C, K (n, n)
    gyroscopic : G (n, n), skew-symmetric
    circulatory : H (n, n), of damping that turns with a rotor
    centripetal : N (n, n), of a frame that turns
    mesh_stiffness : (meshes, n, n), part of `stiffness`
    """

    nodes: tuple[tuple[float, ...], ...]
    speed_ratios: tuple[float, ...]
    mass: Array
    damping: Array
    stiffness: Array
    gyroscopic: Array
    circulatory: Array
    centripetal: Array
    mesh_stiffness: Array

    @property
    def size(self) -> int:
        """Number of coordinates n."""
        return int(self.mass.shape[0])

    @cached_property
    def rotor_of(self) -> NDArray[np.intp]:
        """Rotor of every coordinate (n,)."""
        counts = [NODE_SIZE * len(nodes) for nodes in self.nodes]
        return np.repeat(np.arange(len(counts)), counts)

    @cached_property
    def is_rotation(self) -> NDArray[np.bool_]:
        """Whether a coordinate is a rotation about the axis (n,)."""
        return np.arange(self.size) % NODE_SIZE == ROTATION

    @cached_property
    def quarter_turn(self) -> Array:
        """Matrix J (n, n) that turns every node by a quarter, x to y."""
        return np.kron(np.eye(self.size // NODE_SIZE), QUARTER_TURN)

    @cached_property
    def is_conservative(self) -> bool:
        """Whether M, K are symmetric and nothing else but G is there."""
        others = self.damping, self.circulatory, self.centripetal
        asymmetry = self.stiffness - self.stiffness.T
        return not any(part.any() for part in (*others, asymmetry))

    def index(self, rotor: int, position: float, kind: str) -> int:
        """Index of a coordinate by rotor, position of a node [m] and kind."""
        first = NODE_SIZE * sum(len(nodes) for nodes in self.nodes[:rotor])
        node = _node_at(self.nodes[rotor], position)
        return first + NODE_SIZE * node + NODE_COORDINATES.index(kind)


def assemble(system: RotorSystem) -> GyroscopicSystem:
    """The matrices of rotors in the frame that does not turn.

    Raises RotorError for a shaft whose section is not axially symmetric: its stiffness
    would vary with the rotation.
    """
    for rotor in system.rotors:
        if any(section.asymmetry for section in rotor.sections):
            raise RotorError(
                f"rotor {rotor.name!r}: a section has an asymmetry; its stiffness "
                "varies with the rotation, use rotating_frame"
            )
    return assemble_any(system)


def assemble_any(system: RotorSystem) -> GyroscopicSystem:
    """As `assemble`, with every shaft's planes x-z and y-z as they are at rest."""
    nodes = tuple(
        nodes_of(rotor, _gear_positions(system, number), system.elements)
        for number, rotor in enumerate(system.rotors)
    )
    size = NODE_SIZE * sum(map(len, nodes))
    result = GyroscopicSystem(
        nodes,
        tuple(rotor.speed_ratio for rotor in system.rotors),
        *np.zeros((6, size, size)),
        np.zeros((len(system.meshes), size, size)),
    )
    for number, rotor in enumerate(system.rotors):
        _add_shaft(result, number, rotor)
        _add_disks(result, number, rotor)
        _add_bearings(result, number, rotor)
    for number, mesh in enumerate(system.meshes):
        result.mesh_stiffness[number] = mesh_matrix(result, mesh)
        result.stiffness[:] += result.mesh_stiffness[number]
    return result


def _gear_positions(system: RotorSystem, rotor: int) -> list[float]:
    return [
        position
        for mesh in system.meshes
        for index, position in zip(mesh.rotors, mesh.positions, strict=True)
        if index == rotor
    ]


def nodes_of(
    rotor: Rotor, gear_positions: list[float], elements: int
) -> tuple[float, ...]:
    """Positions of nodes [m]: where parts are, with elements between of equal length.

    elements : least number of them
    """
    ends = [0.0, *accumulate(section.length for section in rotor.sections)]
    length = ends[-1]
    places = [*ends, *gear_positions]
    places += [part.position for part in (*rotor.disks, *rotor.bearings)]
    places = [min(place, length) for place in sorted(places)]
    stations = [0.0]
    for place in places:
        if place - stations[-1] > POSITION_RTOL * length:
            stations.append(place)
    nodes = [0.0]
    for low, high in pairwise(stations):
        count = max(1, math.ceil(elements * (high - low) / length - POSITION_RTOL))
        nodes += [low + (high - low) * k / count for k in range(1, count)] + [high]
    return tuple(nodes)


def _node_at(nodes: tuple[float, ...], position: float) -> int:
    return int(np.abs(np.asarray(nodes) - position).argmin())


def _section_at(rotor: Rotor, position: float) -> Section:
    ends = accumulate(section.length for section in rotor.sections)
    for section, end in zip(rotor.sections, ends, strict=True):
        if position < end:
            return section
    return rotor.sections[-1]


def _add_shaft(result: GyroscopicSystem, number: int, rotor: Rotor) -> None:
    nodes = result.nodes[number]
    first = result.index(number, 0.0, "x")
    bent = np.zeros_like(result.stiffness)
    for element, (low, high) in enumerate(pairwise(nodes)):
        place = first + NODE_SIZE * element
        at = slice(place, place + 2 * NODE_SIZE)
        section, length = _section_at(rotor, 0.5 * (low + high)), high - low
        inertia = rotor.density * section.second_moment
        rigidity = rotor.young_modulus * section.second_moment
        difference = rigidity * section.asymmetry
        twist, spin = twist_matrices(length)
        mass = rotor.density * section.area * translation_mass(length)
        if rotor.rotary_inertia:
            mass = mass + inertia * rotation_mass(length)
            polar = 2.0 * inertia * rotor.speed_ratio
            result.gyroscopic[at, at] += polar * gyroscopic_matrix(length)
        result.mass[at, at] += in_both_planes(mass, 1.0, 1.0) + 2.0 * inertia * spin
        bent[at, at] += in_both_planes(
            bending_stiffness(length), rigidity + difference, rigidity - difference
        )
        torsional = 2.0 * rotor.shear_modulus * section.second_moment
        result.stiffness[at, at] += torsional * twist
        result.damping[at, at] += rotor.internal_damping * torsional * twist
    result.stiffness[:] += bent
    # the rate of strain is seen from the shaft: x' - Omega J x
    rate = rotor.internal_damping * rotor.speed_ratio
    result.damping[:] += rotor.internal_damping * bent
    result.circulatory[:] -= rate * bent @ result.quarter_turn


def _add_disks(result: GyroscopicSystem, number: int, rotor: Rotor) -> None:
    for disk in rotor.disks:
        at = result.index(number, disk.position, "x")
        tilt = disk.transverse_inertia
        inertias = np.array([disk.mass, disk.mass, tilt, tilt, disk.polar_inertia])
        diagonal = np.arange(at, at + NODE_SIZE)
        result.mass[diagonal, diagonal] += inertias
        moment = disk.polar_inertia * rotor.speed_ratio
        result.gyroscopic[at + TILT_X, at + TILT_Y] += moment
        result.gyroscopic[at + TILT_Y, at + TILT_X] -= moment


def _add_bearings(result: GyroscopicSystem, number: int, rotor: Rotor) -> None:
    for bearing in rotor.bearings:
        at = result.index(number, bearing.position, "x")
        lateral = slice(at, at + 2)
        result.stiffness[lateral, lateral] += np.reshape(bearing.stiffness, (2, 2))
        result.damping[lateral, lateral] += np.reshape(bearing.damping, (2, 2))
        tilts = [at + TILT_X, at + TILT_Y]
        result.stiffness[tilts, tilts] += bearing.tilt_stiffness
        result.stiffness[at + ROTATION, at + ROTATION] += bearing.torsional_stiffness


def mesh_rows(result: GyroscopicSystem, mesh: MeshSpring) -> tuple[Array, Array]:
    """Deflection of a mesh per displacement, and its slope over the face width (n,).

    The deflection at a distance along the axis is that of the middle plus the slope
    times the distance; both are positive where the teeth are pressed together. A tilt
    moves a point at a distance a from the gear's centre by a times its slope.
    """
    row, slope = np.zeros((2, result.size))
    cosine, sine = mesh.direction
    for gear, side in ((0, 1.0), (1, -1.0)):
        at = result.index(mesh.rotors[gear], mesh.positions[gear], "x")
        row[[at + X, at + Y]] += side * cosine, side * sine
        slope[[at + TILT_Y, at + TILT_X]] += side * cosine, -side * sine
        # both gears' rotations close the mesh in the driver's sense
        row[at + ROTATION] += mesh.sense * mesh.base_radii[gear]
        tilts = [at + TILT_X, at + TILT_Y]
        row[tilts] += mesh.offsets[gear] * slope[tilts]
    return row, slope


def mesh_matrix(result: GyroscopicSystem, mesh: MeshSpring) -> Array:
    """Stiffness (n, n) of a mesh: k b^2 / 12 against slopes, evenly over the width."""
    row, slope = mesh_rows(result, mesh)
    tilting = mesh.width**2 / 12.0
    return mesh.stiffness * (np.outer(row, row) + tilting * np.outer(slope, slope))
