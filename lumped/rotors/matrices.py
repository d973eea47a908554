"""From rotors to matrices: M x'' + (C + Omega G) x' + (K + Omega H - Omega^2 N) x = 0.

It is eq. 6.10 of the multi-mesh source with damping. In the frame that does not turn
the matrices of axially symmetric rotors are constant, and there is no centripetal
matrix N; see `lumped.rotors.frames` for the one that turns.
"""

from __future__ import annotations

import math
from itertools import accumulate, pairwise

import numpy as np

from lumped.common.array_types import Array
from lumped.rotors.beams import (
    AXIAL_COORDINATE,
    NODE_SIZE,
    QUARTER_TURN,
    TILT_X,
    TILT_Y,
    bending_stiffness,
    gyroscopic_matrix,
    in_both_planes,
    linear_matrices,
    rigid_arm,
    rotation_mass,
    translation_mass,
    twist_matrices,
)
from lumped.rotors.bearing_matrices import (
    bearing_damping,
    bearing_motion,
    bearing_stiffness,
    seen_through,
)
from lumped.rotors.description import (
    MIN_ELEMENT,
    POSITION_RTOL,
    Rotor,
    RotorError,
    RotorSystem,
    Section,
)
from lumped.rotors.gyroscopic import GyroscopicSystem, node_at
from lumped.rotors.housing import ROUND_OFF_RTOL, Housing, symmetric
from lumped.rotors.mesh_springs import mesh_matrix


def assemble(system: RotorSystem) -> GyroscopicSystem:
    """The matrices of rotors in the frame that does not turn.

    Raises RotorError for a shaft whose section is not axially symmetric: its stiffness
    would vary with the rotation.
    """
    for rotor in system.rotors:
        require_axial_symmetry(rotor, ", use rotating_frame")
    return assemble_any(system)


def require_axial_symmetry(rotor: Rotor, cure: str = "") -> None:
    """Raise RotorError for a shaft with a section that is not axially symmetric.

    cure : end of the message
    """
    if any(section.asymmetry for section in rotor.sections):
        raise RotorError(
            f"rotor {rotor.name!r}: a section has an asymmetry; its stiffness "
            f"varies with the rotation{cure}"
        )


def assemble_any(system: RotorSystem) -> GyroscopicSystem:
    """The matrices with planes x-z and y-z of every shaft as they are at rest."""
    nodes = tuple(
        nodes_of(rotor, _gear_positions(system, number), system.elements)
        for number, rotor in enumerate(system.rotors)
    )
    size = (NODE_SIZE + system.axial_motion) * sum(map(len, nodes))
    housing = system.housing
    held = np.zeros((0, 0)) if housing is None else symmetric(housing.stiffness)
    size += len(held)
    result = GyroscopicSystem(
        nodes,
        tuple(rotor.speed_ratio for rotor in system.rotors),
        mass=np.zeros((size, size)),
        damping=np.zeros((size, size)),
        stiffness=np.zeros((size, size)),
        gyroscopic=np.zeros((size, size)),
        circulatory=np.zeros((size, size)),
        centripetal=np.zeros((size, size)),
        shaft_stiffness=np.zeros((size, size)),
        mesh_stiffness=np.zeros((len(system.meshes), size, size)),
        housing_stiffness=held,
    )
    if housing is not None:
        _add_housing(result, housing)
    for number, rotor in enumerate(system.rotors):
        _add_shaft(result, number, rotor)
        _add_disks(result, number, rotor)
        _add_bearings(result, system, number)
        if system.axial_motion:
            _add_axial_motion(result, number, rotor)
    for number, mesh in enumerate(system.meshes):
        result.mesh_stiffness[number] = mesh_matrix(result, mesh)
        result.stiffness[:] += result.mesh_stiffness[number]
    _hold_idle_coordinates(result)
    return result


def _add_housing(result: GyroscopicSystem, housing: Housing) -> None:
    at = np.s_[result.shaft_size :, result.shaft_size :]
    result.mass[at] += symmetric(housing.mass)
    result.stiffness[at] += result.housing_stiffness
    if housing.damping is not None:
        result.damping[at] += symmetric(housing.damping)


def _hold_idle_coordinates(result: GyroscopicSystem) -> None:
    """Hold coordinates of the housing that have neither stiffness nor mass.

    They move nothing, but would make matrices singular. Round-off is neither.
    """
    idle = result.is_housing
    for matrix in (result.stiffness, result.mass):
        largest = np.abs(matrix).max()
        idle = idle & (np.abs(matrix).max(axis=1) <= ROUND_OFF_RTOL * largest)
    for matrix in (result.stiffness, result.mass, result.damping):
        matrix[idle] = matrix[:, idle] = 0.0
    result.stiffness[idle, idle] = np.abs(result.stiffness).max()


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

    A part closer than `MIN_ELEMENT` to another one, or to an end of a section, has no
    node of its own.

    elements : least number of them
    """
    ends = [0.0, *accumulate(section.length for section in rotor.sections)]
    length = ends[-1]
    places = [*gear_positions, *(disk.position for disk in rotor.disks)]
    places += [bearing.position for bearing in rotor.bearings]
    stations = list(ends)
    for place in places:
        if min(abs(place - station) for station in stations) >= MIN_ELEMENT * length:
            stations.append(place)
    stations.sort()
    nodes = [0.0]
    for low, high in pairwise(stations):
        count = max(1, math.ceil(elements * (high - low) / length - POSITION_RTOL))
        nodes += [low + (high - low) * k / count for k in range(1, count)] + [high]
    return tuple(nodes)


def section_at(rotor: Rotor, position: float) -> Section:
    """Section of a shaft at a position [m]."""
    ends = accumulate(section.length for section in rotor.sections)
    for section, end in zip(rotor.sections, ends, strict=True):
        if position < end:
            return section
    return rotor.sections[-1]


def _add_shaft(result: GyroscopicSystem, number: int, rotor: Rotor) -> None:
    nodes, turn = result.nodes[number], np.kron(np.eye(2), QUARTER_TURN)
    first = result.index(number, 0.0, "x")
    for element, (low, high) in enumerate(pairwise(nodes)):
        place = first + NODE_SIZE * element
        at = slice(place, place + 2 * NODE_SIZE)
        section, length = section_at(rotor, 0.5 * (low + high)), high - low
        inertia = rotor.density * section.second_moment
        _, spin = twist_matrices(length)
        mass = rotor.density * section.area * translation_mass(length)
        if rotor.rotary_inertia:
            mass = mass + inertia * rotation_mass(length)
            polar = 2.0 * inertia * rotor.speed_ratio
            result.gyroscopic[at, at] += polar * gyroscopic_matrix(length)
        result.mass[at, at] += in_both_planes(mass, 1.0, 1.0) + 2.0 * inertia * spin
        stiffness = element_stiffness(rotor, section, length)
        result.shaft_stiffness[at, at] += stiffness
        result.stiffness[at, at] += stiffness
        # the rate of strain is seen from the shaft: x' - Omega J x
        result.damping[at, at] += rotor.internal_damping * stiffness
        rate = rotor.internal_damping * rotor.speed_ratio
        result.circulatory[at, at] -= rate * stiffness @ turn


def element_stiffness(
    rotor: Rotor, section: Section, length: float, shear: float = 0.0
) -> Array:
    """Stiffness (10, 10) of an element; shear : number of `bending_stiffness`."""
    rigidity = rotor.young_modulus * section.second_moment
    difference = rigidity * section.asymmetry
    torsional = 2.0 * rotor.shear_modulus * section.second_moment
    twist, _ = twist_matrices(length)
    return np.asarray(
        torsional * twist
        + in_both_planes(
            bending_stiffness(length, shear),
            rigidity + difference,
            rigidity - difference,
        )
    )


def _arm(result: GyroscopicSystem, rotor: int, position: float) -> Array:
    """Motion (5, 5) of a part by that of the node that carries it on a rigid arm."""
    nodes = result.nodes[rotor]
    return rigid_arm(position - nodes[node_at(nodes, position)])


def _add_disks(result: GyroscopicSystem, number: int, rotor: Rotor) -> None:
    for disk in rotor.disks:
        first = result.index(number, disk.position, "x")
        at, arm = slice(first, first + NODE_SIZE), _arm(result, number, disk.position)
        tilt = disk.transverse_inertia
        inertias = np.array([disk.mass, disk.mass, tilt, tilt, disk.polar_inertia])
        result.mass[at, at] += arm.T @ (inertias[:, None] * arm)
        moment = np.zeros((NODE_SIZE, NODE_SIZE))
        moment[TILT_X, TILT_Y] = disk.polar_inertia * rotor.speed_ratio
        result.gyroscopic[at, at] += moment - moment.T


def _add_bearings(result: GyroscopicSystem, system: RotorSystem, number: int) -> None:
    for index, bearing in enumerate(system.rotors[number].bearings):
        at, motion = bearing_motion(result, system, number, index)
        place = np.ix_(at, at)
        result.stiffness[place] += seen_through(motion, bearing_stiffness(bearing))
        result.damping[place] += seen_through(motion, bearing_damping(bearing))


def _add_axial_motion(result: GyroscopicSystem, number: int, rotor: Rotor) -> None:
    """Rods between nodes, and masses along the axis."""
    nodes = result.nodes[number]
    first = result.index(number, 0.0, AXIAL_COORDINATE)
    for element, (low, high) in enumerate(pairwise(nodes)):
        at = slice(first + element, first + element + 2)
        area = section_at(rotor, 0.5 * (low + high)).area
        stiffness, mass = linear_matrices(high - low)
        stiffness *= rotor.young_modulus * area
        result.mass[at, at] += rotor.density * area * mass
        result.shaft_stiffness[at, at] += stiffness
        result.stiffness[at, at] += stiffness
        result.damping[at, at] += rotor.internal_damping * stiffness
    for disk in rotor.disks:
        z = result.index(number, disk.position, AXIAL_COORDINATE)
        result.mass[z, z] += disk.mass
