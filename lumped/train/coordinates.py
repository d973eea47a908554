"""Degrees of freedom of a train: rotations, and translations on elastic bearings.

Gears on a rigid shaft share degrees of freedom; their masses, inertias and bearings add
up.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lumped.train.train import Mesh, Train, TrainError

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Coordinates:
    """Inertias, springs and loads in n physical coordinates (rad and m).

    labels : ("pinion", "rotation"), ("pinion", "x"), ...
    indices : index of the coordinate by gear index and "rotation", "x" or "y"
    mass : (n,) [kg m2 or kg]
    load : (n,) external loads [N m or N]
    mesh_rows : (meshes, n) rows; mesh deflection is row times displacement [m]
    spring_rows : (springs, n) elongations of bearings, couplings and shafts
    spring_stiffness : (springs,) [N/m or N m/rad]
    """

    labels: tuple[tuple[str, str], ...]
    indices: Mapping[tuple[int, str], int]
    mass: Array
    load: Array
    mesh_rows: Array
    spring_rows: Array
    spring_stiffness: Array


def train_coordinates(train: Train) -> Coordinates:
    """Degrees of freedom of a train; raises TrainError if nothing can move."""
    groups = rigid_groups(train)
    indices: dict[tuple[int, str], int] = {}
    labels: list[tuple[str, str]] = []
    for members in groups:
        directions = ["rotation"]
        if any(train.gears[g].bearing_stiffness for g in members):
            _require_masses(train, members)
            directions += ["x", "y"]
        name = "+".join(train.gears[g].name for g in members)
        for kind in directions:
            indices |= {(g, kind): len(labels) for g in members}
            labels.append((name, kind))
    n = len(labels)
    mass, load = np.zeros(n), np.zeros(n)
    for (gear, kind), i in indices.items():
        part = train.gears[gear]
        mass[i] += part.inertia if kind == "rotation" else part.mass or 0.0
        load[i] += part.torque if kind == "rotation" else 0.0
    rows = np.array([_mesh_row(train, mesh, indices, n) for mesh in train.meshes])
    stiffness, elongations = _springs(train, indices, n)
    return Coordinates(tuple(labels), indices, mass, load, rows, elongations, stiffness)


def rigid_groups(train: Train) -> list[tuple[int, ...]]:
    """Groups of gears that move as one, each in the order of the gears."""
    group = list(range(len(train.gears)))
    for shaft in train.shafts:
        if shaft.stiffness is None:
            one, two = (group[gear] for gear in shaft.gears)
            group = [min(one, two) if g in (one, two) else g for g in group]
    return [
        tuple(i for i, g in enumerate(group) if g == leader)
        for leader in sorted(set(group))
    ]


def _require_masses(train: Train, members: tuple[int, ...]) -> None:
    for gear in members:
        if train.gears[gear].mass is None:
            raise TrainError(
                f"gear {train.gears[gear].name!r}: mass is needed, a gear on its "
                "shaft has a bearing_stiffness"
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
        row[indices[gear, "rotation"]] += sense * train.gears[gear].base_radius
        for axis, cosine in direction.items():
            if (gear, axis) in indices:
                row[indices[gear, axis]] += side * cosine
    return row


def _springs(
    train: Train, indices: dict[tuple[int, str], int], n: int
) -> tuple[Array, Array]:
    """Stiffness (springs,) and elongation rows (springs, n)."""
    springs: list[tuple[float, list[tuple[int, float]]]] = []
    for i, gear in enumerate(train.gears):
        for axis, stiffness in zip("xy", gear.bearing_stiffness or (), strict=False):
            springs.append((stiffness, [(indices[i, axis], 1.0)]))
        springs.append((gear.coupling_stiffness, [(indices[i, "rotation"], 1.0)]))
    for shaft in train.shafts:
        if shaft.stiffness is not None:
            one, two = (indices[gear, "rotation"] for gear in shaft.gears)
            springs.append((shaft.stiffness, [(one, 1.0), (two, -1.0)]))
    springs = [(stiffness, ends) for stiffness, ends in springs if stiffness > 0.0]
    rows = np.zeros((len(springs), n))
    for row, (_, ends) in zip(rows, springs, strict=True):
        for index, sign in ends:
            row[index] += sign
    return np.array([stiffness for stiffness, _ in springs]), rows
