"""How contacts act on the hubs and the elastic modes."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from fegear.dynamics.arrays import ContactJacobian
from fegear.dynamics.elastic import ElasticGear
from fegear.dynamics.sides import ContactSide
from fegear.gearset.model import GearSet
from lumped.system import LumpedSystem

Array = NDArray[np.float64]


def held(reference: LumpedSystem) -> Array:
    """1 for hub coordinates that something holds, 0 for rigid rotation (h,).

    Nothing loads a free rotation: the drive keeps the mean speed.
    """
    return (reference.modes.frequency_Hz > 0.0).astype(float)


def contact_rows(
    gear_set: GearSet,
    reference: LumpedSystem,
    sides: Sequence[ContactSide],
    elastic: Sequence[ElasticGear | None],
    friction: float,
) -> ContactJacobian:
    hubs = reference.modes.shapes.shape[1]
    counts = [0 if gear is None else gear.count for gear in elastic]
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
    owner = [np.full(side.laws.teeth.size, side.mesh) for side in sides]
    return ContactJacobian(
        widths=np.array([len(c) for c in columns]),
        columns=table,
        normal=np.ascontiguousarray(closing),
        tangential=np.ascontiguousarray(rootward),
        mesh_of=np.concatenate(owner),
        friction=np.array(friction),
        linked=_linked(gear_set),
    )


def _linked(gear_set: GearSet) -> NDArray[np.bool_]:
    """Whether two meshes have a gear in common, or are the same (m, m)."""
    gears = [{mesh.driver, mesh.driven} for mesh in gear_set.meshes]
    return np.array([[bool(one & two) for two in gears] for one in gears])


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
        end = at + gear.count
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
    shapes = reference.modes.shapes * held(reference)
    return closing @ shapes, rootward @ shapes


def _push(reference: LumpedSystem, side: ContactSide) -> Array:
    """Unit vector of the driver's push on the driven gear."""
    mesh = reference.train.meshes[side.mesh]
    angle = mesh.center_line + side.sense * (0.5 * math.pi - mesh.pressure_angle)
    return np.array([math.cos(angle), math.sin(angle)])
