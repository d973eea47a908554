"""A gear set in motion as arrays for the implicit steps.

Hub freedoms are the modes of the rigid train on its mean mesh stiffness, so that
damping is that of the lumped models; the mesh stiffness itself is taken out again
and contact put in its place. Elastic freedoms are the modes of each gear with its hub
held, in a frame that turns with the gear; gyroscopic and centrifugal terms are left
out, and so is the momentum of a gear's elastic modes on its bearings. What the
modes lack of the static compliance stays in the contact laws, so that statics are
those of the finite elements whatever modes are kept.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from fegear.dynamics.sides import DRIVE, ContactSide, MeshLaws, contact_sides
from fegear.elasticity.modes import GearModes
from fegear.gearset.model import GearSet
from lumped.system import LumpedSystem

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Arrays = tuple[NDArray[Any], ...]


@dataclass(frozen=True, eq=False)
class ElasticGear:
    """Elastic modes of a gear, seen from its flanks.

    modes : of the meshed part; width : its face width [m]
    damping : (modes,) ratio of each mode
    """

    modes: GearModes
    width: float
    damping: Array


@dataclass(frozen=True, eq=False)
class DynamicModel:
    """Arrays that `reduced_kernel` describes, and the rigid train they stand on."""

    reference: LumpedSystem
    sides: tuple[ContactSide, ...]
    body: Arrays
    rows: Arrays
    train: Arrays
    contacts: Arrays

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return self.body[1].size + self.body[3].size

    @property
    def touching(self) -> int:
        """Number of contacts, tooth pairs of all meshes and sides."""
        return self.contacts[1].size

    @property
    def contact_labels(self) -> list[tuple[int, int, int]]:
        """(mesh, pair, side) of each contact."""
        return [
            (side.mesh, int(k), side.side)
            for side in self.sides
            for k in side.laws.teeth
        ]


def dynamic_model(
    gear_set: GearSet,
    reference: LumpedSystem,
    laws: Sequence[MeshLaws],
    elastic: Sequence[ElasticGear | None],
    far: Array | None = None,
) -> DynamicModel:
    """Assemble; elastic holds None for gears that are rigid but for their contact.

    reference : the lumped system at the same torque, whose mean stiffnesses give
        the modes that damping stands on
    far : (p, c, c) static compliance between contacts of different meshes [m/N]
    """
    sides = contact_sides(gear_set, laws)
    body = _body(gear_set, reference, elastic)
    rows = _rows(gear_set, reference, sides, elastic, laws[0].friction)
    return DynamicModel(
        reference=reference,
        sides=tuple(sides),
        body=body,
        rows=rows,
        train=_train(gear_set, reference),
        contacts=_contacts(sides, rows, body, far),
    )


def _moving(reference: LumpedSystem) -> Array:
    """1 for hub coordinates that something holds, 0 for rigid rotation (h,).

    Nothing loads a free rotation: the drive keeps the mean speed.
    """
    return (reference.modes.frequency_Hz > 0.0).astype(float)


def _body(
    gear_set: GearSet,
    reference: LumpedSystem,
    elastic: Sequence[ElasticGear | None],
) -> Arrays:
    modes, ratio = reference.modes, reference.train.damping_ratio
    space, angular = modes.coordinates, modes.angular
    mean = modes.mean_stiffness[:, None, None]
    meshes = modes.mesh_shapes[:, :, None] * modes.mesh_shapes[:, None, :]
    stiffness = np.diag(angular**2) - (mean * meshes).sum(axis=0)
    places = [space.places[g, "rotation"] for g in range(len(gear_set.gears))]
    parts = [_elastic_body(g, gear) for g, gear in enumerate(elastic)]
    count = 0
    for part in parts:
        part["partner"] = part["partner"] + count
        count += part["rigidity"].size
    joined = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    return (
        stiffness,
        2.0 * ratio * angular,
        _moving(reference) * (modes.shapes.T @ space.load),
        joined["rigidity"],
        joined["damping"],
        modes.shapes[places],
        joined["coupling"],
        joined["owner"],
        joined["partner"],
        joined["cosine"],
        joined["sine"] * np.array(gear_set.senses, float)[joined["owner"]],
    )


def _elastic_body(number: int, gear: ElasticGear | None) -> dict[str, NDArray[Any]]:
    """Arrays over the elastic modes of one gear; partners count within it."""
    if gear is None:
        none, nobody = np.empty(0), np.empty(0, np.int64)
        return {
            "rigidity": none,
            "damping": none,
            "coupling": none,
            "owner": nobody,
            "partner": nobody,
            "cosine": none,
            "sine": none,
        }
    modes = gear.modes
    angular = 2.0 * np.pi * modes.frequencies_Hz
    turn = 2.0 * np.pi * modes.nodal_diameters / modes.teeth
    single = (modes.nodal_diameters == 0) | (2 * modes.nodal_diameters == modes.teeth)
    # the symmetric mode of a pair comes first
    symmetric = single | _first_of_pair(single)
    step = np.where(single, 0, np.where(symmetric, 1, -1))
    return {
        "rigidity": angular**2,
        "damping": 2.0 * gear.damping * angular,
        # modes count clockwise
        "coupling": -math.sqrt(gear.width) * modes.rotation_coupling,
        "owner": np.full(angular.size, number),
        "partner": np.arange(angular.size) + step,
        "cosine": np.cos(turn),
        "sine": np.where(single, 0.0, step * np.sin(turn)),
    }


def _first_of_pair(single: NDArray[np.bool_]) -> NDArray[np.bool_]:
    first = np.zeros(single.size, bool)
    i = 0
    while i < single.size:
        first[i] = True
        i += 1 if single[i] else 2
    return first


def _train(gear_set: GearSet, reference: LumpedSystem) -> Arrays:
    train = reference.train
    gears = np.array([(mesh.driver, mesh.driven) for mesh in gear_set.meshes])
    members = range(len(gear_set.gears))
    first_mesh = [int(np.flatnonzero((gears == g).any(axis=1))[0]) for g in members]
    teeth = gear_set.gears[gear_set.meshes[0].driver].geometry.teeth
    return (
        np.array([float(rate) for rate in train.mesh_rates]),
        gears,
        np.array(first_mesh),
        np.array([float(s) for s in train.speeds]) / teeth,
        np.ascontiguousarray(_moving(reference) * reference.modes.mesh_shapes),
    )


def _rows(
    gear_set: GearSet,
    reference: LumpedSystem,
    sides: Sequence[ContactSide],
    elastic: Sequence[ElasticGear | None],
    friction: float,
) -> Arrays:
    hubs = reference.modes.shapes.shape[1]
    counts = [0 if gear is None else gear.damping.size for gear in elastic]
    starts = hubs + np.concatenate([[0], np.cumsum(counts)])
    columns = []
    for mesh in gear_set.meshes:
        gears = sorted((mesh.driver, mesh.driven))
        own = [np.arange(starts[g], starts[g + 1]) for g in gears]
        columns.append(np.concatenate([np.arange(hubs), *own]))
    wide = max(len(c) for c in columns)
    table = np.zeros((len(columns), wide), np.int64)
    for m, column in enumerate(columns):
        table[m, : len(column)] = column
    blocks = [_side_rows(reference, side, elastic, wide) for side in sides]
    closing, rootward = (np.concatenate(each) for each in zip(*blocks, strict=True))
    return (
        np.array([len(c) for c in columns]),
        table,
        np.ascontiguousarray(closing),
        np.ascontiguousarray(rootward),
        np.concatenate([np.full(side.laws.teeth.size, side.mesh) for side in sides]),
        np.array(friction),
    )


def _side_rows(
    reference: LumpedSystem,
    side: ContactSide,
    elastic: Sequence[ElasticGear | None],
    wide: int,
) -> tuple[Array, Array]:
    """Rows (k, p, wide) of a side's contacts, closing and rootward."""
    hub_rows = _hub_rows(reference, side)
    closing, rootward = (np.zeros((*hub_rows[0].shape[:2], wide)) for _ in range(2))
    at = hub_rows[0].shape[2]
    closing[..., :at], rootward[..., :at] = hub_rows
    for g in sorted(side.gears):
        gear = elastic[g]
        if gear is None:
            continue
        end = at + gear.damping.size
        for c, tooth in enumerate(side.teeth(g)):
            normal, tangential = _mode_rows(
                gear, int(tooth), side.flank, side.arcs(g)[:, c]
            )
            # inward displacement opens a contact
            closing[c, :, at:end] = -normal
            rootward[c, :, at:end] = -tangential
        at = end
    return closing, rootward


def _mode_rows(
    gear: ElasticGear, tooth: int, flank: int, arcs: Array
) -> tuple[Array, Array]:
    """Inward and rootward displacement (p, modes) of a flank at arcs (p,)."""
    modes, scale = gear.modes, 1.0 / math.sqrt(gear.width)
    grid = modes.arcs
    inside = np.clip(arcs, grid[0], grid[-1])
    return tuple(  # type: ignore[return-value]
        scale * PchipInterpolator(grid, values, axis=1)(inside).T
        for values in (modes.normal_at(tooth, flank), modes.tangential_at(tooth, flank))
    )


def _hub_rows(reference: LumpedSystem, side: ContactSide) -> tuple[Array, Array]:
    """Rows (k, p, h) of a side's contacts over the hub coordinates."""
    space, sense = reference.modes.coordinates, side.sense
    push = _push(reference, side)
    aside = sense * np.array([push[1], -push[0]])  # from the driver's centre
    lever = side.laws.lever.transpose(1, 0, 2)
    closing, rootward = (
        np.zeros((*lever.shape[:2], space.mass.size)) for _ in range(2)
    )
    for place, (g, sign) in enumerate(zip(side.gears, (1.0, -1.0), strict=True)):
        rotation = space.places[g, "rotation"]
        closing[..., rotation] += sense * lever[..., place]
        rootward[..., rotation] -= sense * lever[..., 2 + place]
        for axis, normal, along in zip("xy", push, aside, strict=True):
            if (g, axis) in space.places:
                closing[..., space.places[g, axis]] += sign * normal
                rootward[..., space.places[g, axis]] += sign * along
    shapes = reference.modes.shapes * _moving(reference)
    return closing @ shapes, rootward @ shapes


def _push(reference: LumpedSystem, side: ContactSide) -> Array:
    """Unit vector of the driver's push on the driven gear."""
    mesh = reference.train.meshes[side.mesh]
    angle = mesh.center_line + side.sense * (0.5 * math.pi - mesh.pressure_angle)
    return np.array([math.cos(angle), math.sin(angle)])


def _contacts(
    sides: Sequence[ContactSide],
    rows: Arrays,
    body: Arrays,
    far: Array | None,
) -> Arrays:
    mesh_of = rows[4]
    normal, tangential = _remaining(sides, rows, body)
    if far is not None:
        normal += far
    squeezes = {side.mesh: side.laws.squeeze for side in sides}
    return (
        np.searchsorted(mesh_of, np.arange(mesh_of[-1] + 2)),
        np.concatenate([np.full(s.laws.teeth.size, float(s.side)) for s in sides]),
        np.concatenate([s.laws.gap.T + s.backlash for s in sides]),
        # the back flanks slide the other way
        np.concatenate([s.side * s.laws.sliding.T for s in sides]),
        np.concatenate([s.laws.lever.transpose(1, 0, 2)[..., 2:] for s in sides]),
        np.array(list(squeezes.values())),
        np.concatenate([_cubics(s.laws.squeeze, _loads(s)) for s in sides]),
        normal,
        tangential,
    )


def _loads(side: ContactSide) -> Array:
    """Loads (p, k, 2, j) with friction as it is nominally on this side, and turned."""
    return side.laws.load if side.side == DRIVE else side.laws.load[:, :, ::-1]


def _cubics(squeeze: Array, load: Array) -> Array:
    """Monotone cubics (k, p, 2, j, 4) of loads (p, k, 2, j + 1), by rising power."""
    pieces = PchipInterpolator(squeeze, load, axis=3).c  # (4, j, p, k, 2)
    return np.ascontiguousarray(pieces[::-1].transpose(3, 2, 4, 1, 0))


def _remaining(
    sides: Sequence[ContactSide], rows: Arrays, body: Arrays
) -> tuple[Array, Array]:
    """Static compliance (p, c, c) between contacts less that of the coordinates."""
    _, _, closing, rootward, mesh_of, _ = rows
    hubs, rigidity = body[1].size, body[3]
    contacts, positions = closing.shape[:2]
    normal, tangential = (np.zeros((positions, contacts, contacts)) for _ in range(2))
    begin = 0
    for side in sides:
        own = slice(begin, begin + side.laws.teeth.size)
        normal[:, own, own] = side.laws.normal
        tangential[:, own, own] = side.laws.tangential
        begin = own.stop
    for c, one in enumerate(mesh_of):
        for d, two in enumerate(mesh_of):
            here, there = _common(rows, hubs, one, two)
            softness = 1.0 / rigidity[rows[1][one, here] - hubs]
            seen = closing[c][:, here] * softness
            normal[:, c, d] -= (seen * closing[d][:, there]).sum(axis=1)
            tangential[:, c, d] -= (seen * rootward[d][:, there]).sum(axis=1)
    return normal, tangential


def _common(rows: Arrays, hubs: int, one: int, two: int) -> tuple[Indices, Indices]:
    """Places of the elastic coordinates that two meshes share, in the row of each."""
    count, columns = rows[:2]
    _, here, there = np.intersect1d(
        columns[one, hubs : count[one]],
        columns[two, hubs : count[two]],
        return_indices=True,
    )
    return hubs + here, hubs + there
