"""Degrees of freedom of a train: rotations, and translations on elastic bearings.

Gears on a rigid shaft share degrees of freedom; their masses, inertias and bearings add
up.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from lumped.common.array_types import Array
from lumped.common.short_repr import ShortRepr
from lumped.train.bodies import Carrier, Gear, TrainError
from lumped.train.train import Mesh, Train

BEARING, SHAFT = SPRING_KINDS = "bearing", "shaft"  # with couplings at their ends
TILT = "tilt"  # of teeth against each other, over the face width
BALANCE_RTOL = 1e-9  # of the moment of masses about the axis of a carrier


@dataclass(frozen=True, eq=False)
class Coordinates(ShortRepr):
    """Inertias, springs and loads in n physical coordinates (rad and m).

    labels : ("pinion", "rotation"), ("pinion", "x"), ...
    indices : index of the coordinate by gear index and "rotation", "x" or "y"; a
        carrier counts as the gear after the last; held rotations are not there
    mass : (n,) [kg m2 or kg]
    load : (n,) external loads [N m or N]
    mesh_rows : (meshes, n) rows; mesh deflection is row times displacement [m]
    spring_rows : (springs, n) elongations of bearings, couplings and shafts
    spring_stiffness : (springs,) [N/m or N m/rad]
    spring_kinds : what each spring is, one of SPRING_KINDS
    gyroscopic : (n, n) skew G of the frame that rotates with the carrier; at its
        angular speed W the inertial forces are -W G v + W^2 C q
    centripetal : (n, n) symmetric C of that frame, positive semidefinite
    """

    labels: tuple[tuple[str, str], ...]
    indices: Mapping[tuple[int, str], int]
    mass: Array
    load: Array
    mesh_rows: Array
    spring_rows: Array
    spring_stiffness: Array
    spring_kinds: tuple[str, ...]
    gyroscopic: Array
    centripetal: Array


def train_coordinates(train: Train) -> Coordinates:
    """Degrees of freedom of a train; raises TrainError if nothing can move."""
    bodies = train_bodies(train)
    indices: dict[tuple[int, str], int] = {}
    labels: list[tuple[str, str]] = []
    for members in [*rigid_groups(train), *_carrier_groups(train)]:
        directions = [] if any(bodies[b].is_held for b in members) else ["rotation"]
        if any(bodies[b].bearing_stiffness for b in members):
            _require_masses(train, members)
            directions += ["x", "y"]
        name = "+".join(bodies[b].name for b in members)
        for kind in directions:
            indices |= {(b, kind): len(labels) for b in members}
            labels.append((name, kind))
    if not labels:
        raise TrainError("every gear is held; at least one must move")
    n = len(labels)
    mass, load = np.zeros(n), np.zeros(n)
    for (number, kind), i in indices.items():
        body = bodies[number]
        mass[i] += body.inertia if kind == "rotation" else body.mass or 0.0
        load[i] += body.torque if kind == "rotation" else 0.0
    for index, added in _carried_masses(train, indices).items():
        mass[index] += added
    rows = np.array([_mesh_row(train, mesh, indices, n) for mesh in train.meshes])
    stiffness, elongations, kinds = _spring_rows(train, indices, n)
    return Coordinates(
        *(tuple(labels), indices, mass, load, rows, elongations, stiffness, kinds),
        *_rotating_frame_matrices(train, indices, mass),
    )


def train_bodies(train: Train) -> tuple[Gear | Carrier, ...]:
    """The gears, then the carrier if there is one."""
    return (*train.gears, *((train.carrier,) if train.carrier else ()))


def _carrier_groups(train: Train) -> list[tuple[int, ...]]:
    return [(len(train.gears),)] if train.carrier else []


def _carried_masses(
    train: Train, indices: Mapping[tuple[int, str], int]
) -> dict[int, float]:
    """Masses of gears without bearings on the carrier, by its coordinates.

    Raises TrainError where their centre of mass is off the axis of a carrier that
    translates: its translations and its rotation would be coupled by inertia.
    """
    carrier, carrier_number = train.carrier, len(train.gears)
    if carrier is None:
        return {}
    carried_gears = [
        (train.gears[g], angle)
        for g, angle in zip(carrier.gears, carrier.angles, strict=True)
        if train.gears[g].bearing_stiffness is None
    ]
    if names_without_mass := [
        gear.name for gear, _ in carried_gears if gear.mass is None
    ]:
        raise TrainError(f"gear {names_without_mass[0]!r}: mass is needed on a carrier")
    masses = [gear.mass or 0.0 for gear, _ in carried_gears]
    total_mass = math.fsum(masses)
    unbalance = abs(
        sum(
            m * np.exp(1j * angle)
            for m, (_, angle) in zip(masses, carried_gears, strict=True)
        )
    )
    if (carrier_number, "x") in indices and unbalance > BALANCE_RTOL * total_mass:
        raise TrainError(
            f"carrier {carrier.name!r}: gears without bearings are not balanced about "
            "its axis; give each a bearing_stiffness"
        )
    added_inertia = {
        "rotation": total_mass * carrier.radius**2,
        "x": total_mass,
        "y": total_mass,
    }
    return {
        indices[carrier_number, kind]: mass
        for kind, mass in added_inertia.items()
        if (carrier_number, kind) in indices
    }


def rigid_groups(train: Train) -> list[tuple[int, ...]]:
    """Groups of gears that move as one, each in the order of the gears."""
    leaders = list(range(len(train.gears)))
    for shaft in train.shafts:
        if shaft.stiffness is None:
            leader_of_first, leader_of_second = (leaders[gear] for gear in shaft.gears)
            leaders = [
                min(leader_of_first, leader_of_second)
                if g in (leader_of_first, leader_of_second)
                else g
                for g in leaders
            ]
    return [
        tuple(i for i, g in enumerate(leaders) if g == leader)
        for leader in sorted(set(leaders))
    ]


def _require_masses(train: Train, members: tuple[int, ...]) -> None:
    bodies = train_bodies(train)
    for number in members:
        if bodies[number].mass is None:
            raise TrainError(
                f"gear {bodies[number].name!r}: mass is needed, a gear on its shaft "
                "has a bearing_stiffness"
            )


def rolling_sense(train: Train, mesh: Mesh) -> int:
    """Sense of rotation of a mesh's driver, opposite if the driver is internal.

    With the negative base radius of an internal gear, and with `line_of_centers`, all
    formulas of external gears hold.
    """
    sense = train.sense(mesh.driver)
    return sense if train.gears[mesh.driver].base_radius > 0.0 else -sense


def line_of_centers(train: Train, mesh: Mesh) -> float:
    """Direction from driver to driven gear, the opposite if one is internal [rad]."""
    return mesh.center_line + (math.pi if train.is_internal(mesh) else 0.0)


def line_of_action(train: Train, mesh: Mesh) -> tuple[float, float]:
    """Unit vector of the driver's push on the driven gear."""
    sense = rolling_sense(train, mesh)
    angle = line_of_centers(train, mesh)
    angle += sense * (0.5 * math.pi - mesh.pressure_angle)
    return math.cos(angle), math.sin(angle)


def _mesh_row(
    train: Train, mesh: Mesh, indices: dict[tuple[int, str], int], n: int
) -> Array:
    """Deflection per displacement, positive where the teeth are pressed together."""
    row = np.zeros(n)
    sense = rolling_sense(train, mesh)
    direction = dict(zip("xy", line_of_action(train, mesh), strict=True))
    for gear, side in ((mesh.driver, 1.0), (mesh.driven, -1.0)):
        # both gears' rotations close the mesh in the driver's sense
        if (gear, "rotation") in indices:
            row[indices[gear, "rotation"]] += sense * train.gears[gear].base_radius
        for axis, cosine in direction.items():
            for index, motion in center_motion(train, gear, axis, indices):
                row[index] += side * cosine * motion
    return row


def _rotating_frame_matrices(
    train: Train, indices: Mapping[tuple[int, str], int], mass: Array
) -> tuple[Array, Array]:
    """Matrices (n, n) `gyroscopic` and `centripetal` of `Coordinates`.

    A mass m at (x, y) has the inertial forces m (x'' - 2 W y' - W^2 x) and
    m (y'' + 2 W x' - W^2 y). Of a gear on the carrier, whose bearing also carries the
    centrifugal load m W^2 r of its centre, that load turns with the carrier: both
    together do as if its displacement were relative to a carrier that has turned, so
    that turning the whole train changes nothing.
    """
    n, carrier = mass.size, train.carrier
    gyroscopic, centripetal = np.zeros((n, n)), np.zeros((n, n))
    if carrier is None:
        return gyroscopic, centripetal
    keys_of_translations = {
        indices[key]: key for key in indices if key[1] != "rotation"
    }
    for index, (body, axis) in keys_of_translations.items():
        if axis == "x":
            y = indices[body, "y"]
            gyroscopic[index, y] = -2.0 * mass[index]
            gyroscopic[y, index] = 2.0 * mass[index]
        row = np.zeros(n)
        row[index] = 1.0
        carrier_rotation = indices.get((len(train.gears), "rotation"))
        if body in carrier.gears and carrier_rotation is not None:
            gear_position = carrier.gears.index(body)
            point_motion = dict(
                carrier_point_motion(train, carrier, gear_position, axis, indices)
            )
            row[carrier_rotation] = -point_motion[carrier_rotation]
        centripetal += mass[index] * np.outer(row, row)
    return gyroscopic, centripetal


def center_motion(
    train: Train, gear: int, axis: str, indices: Mapping[tuple[int, str], int]
) -> list[tuple[int, float]]:
    """Coordinates that move a gear's centre along an axis, and by how much each.

    On elastic bearings the centre has coordinates of its own; otherwise it is fixed, or
    a point of the carrier.
    """
    if (gear, axis) in indices:
        return [(indices[gear, axis], 1.0)]
    carrier = train.carrier
    if carrier is None or gear not in carrier.gears:
        return []
    return carrier_point_motion(
        train, carrier, carrier.gears.index(gear), axis, indices
    )


def carrier_point_motion(
    train: Train,
    carrier: Carrier,
    place: int,
    axis: str,
    indices: Mapping[tuple[int, str], int],
) -> list[tuple[int, float]]:
    """Motion of the point of a carrier under one of its gears, as `center_motion`."""
    carrier_number, angle = len(train.gears), carrier.angles[place]
    motion_by_rotation = -math.sin(angle) if axis == "x" else math.cos(angle)
    motions = {"rotation": carrier.radius * motion_by_rotation, axis: 1.0}
    return [
        (indices[carrier_number, kind], motion)
        for kind, motion in motions.items()
        if (carrier_number, kind) in indices
    ]


def _bearing_end_motion(
    body: Gear | Carrier, number: int, axis: str, indices: Mapping[tuple[int, str], int]
) -> list[tuple[int, float]]:
    """Coordinates that stretch one of a body's two bearing springs, by how much each.

    The springs are along x and y, or in the directions of a gear's bearing.
    """
    angle = body.bearing_direction if isinstance(body, Gear) else 0.0
    if angle == 0.0:
        return [(indices[number, axis], 1.0)]
    if axis == "y":
        angle += 0.5 * math.pi
    cosines = {"x": math.cos(angle), "y": math.sin(angle)}
    return [(indices[number, along], cosine) for along, cosine in cosines.items()]


def _spring_rows(
    train: Train, indices: dict[tuple[int, str], int], n: int
) -> tuple[Array, Array, tuple[str, ...]]:
    """Stiffness (springs,), elongation rows (springs, n) and kinds (springs,)."""
    springs: list[tuple[float, list[tuple[int, float]], str]] = []
    carrier = train.carrier
    for i, body in enumerate(train_bodies(train)):
        for axis, stiffness in zip("xy", body.bearing_stiffness or (), strict=False):
            end_motions = _bearing_end_motion(body, i, axis, indices)
            if carrier and i in carrier.gears:
                gear_position = carrier.gears.index(i)
                point_motion = carrier_point_motion(
                    train, carrier, gear_position, axis, indices
                )
                end_motions += [(index, -motion) for index, motion in point_motion]
            springs.append((stiffness, end_motions, BEARING))
        if (i, "rotation") in indices:
            end_motions = [(indices[i, "rotation"], 1.0)]
            springs.append((body.coupling_stiffness, end_motions, SHAFT))
    for shaft in train.shafts:
        if shaft.stiffness is not None:
            gears_and_signs = zip(shaft.gears, (1.0, -1.0), strict=True)
            end_motions = [
                (indices[gear, "rotation"], sign)
                for gear, sign in gears_and_signs
                if (gear, "rotation") in indices
            ]
            springs.append((shaft.stiffness, end_motions, SHAFT))
    springs = [spring for spring in springs if spring[0] > 0.0]
    rows = np.zeros((len(springs), n))
    for row, (_, end_motions, _) in zip(rows, springs, strict=True):
        for index, sign in end_motions:
            row[index] += sign
    stiffnesses = np.array([stiffness for stiffness, _, _ in springs])
    return stiffnesses, rows, tuple(kind for _, _, kind in springs)
