"""How contacts act on the hubs and the elastic modes."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from fegear.dynamics.elastic import ElasticGear
from fegear.dynamics.kernels.step_arrays import ContactJacobian
from fegear.dynamics.sides import ContactSide
from fegear.gearset.model import GearSet
from lumped.common.array_types import Array
from lumped.train.coordinates import center_motion, line_of_centers
from lumped.train.system import LumpedSystem


def is_supported(reference: LumpedSystem) -> Array:
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
        gear_columns = [np.arange(starts[g], starts[g + 1]) for g in gears]
        columns.append(np.concatenate([np.arange(hubs), *gear_columns]))
    max_width = max(len(c) for c in columns)
    table = np.zeros((len(columns), max_width), np.int64)
    for m, column in enumerate(columns):
        table[m, : len(column)] = column
    blocks = [_side_rows(reference, side, elastic, max_width) for side in sides]
    normal, tangential = np.concatenate(blocks, axis=1)
    mesh_indices = [
        np.full(side.load_curves.pair_offsets.size, side.mesh) for side in sides
    ]
    return ContactJacobian(
        widths=np.array([len(c) for c in columns]),
        columns=table,
        normal=np.ascontiguousarray(normal),
        tangential=np.ascontiguousarray(tangential),
        mesh_of=np.concatenate(mesh_indices),
        friction=np.array(friction),
        share_gear=_share_gear(gear_set),
    )


def _share_gear(gear_set: GearSet) -> NDArray[np.bool_]:
    """Whether two meshes have a gear in common, or are the same (m, m)."""
    gears = [{mesh.driver, mesh.driven} for mesh in gear_set.meshes]
    return np.array([[bool(one & two) for two in gears] for one in gears])


def _side_rows(
    reference: LumpedSystem,
    side: ContactSide,
    elastic: Sequence[ElasticGear | None],
    max_width: int,
) -> Array:
    """Normal and tangential rows (2, k, p, wide) of the contacts of a flank pair."""
    hub_rows = _hub_rows(reference, side)
    start = hub_rows.shape[-1]
    rows = np.zeros((*hub_rows.shape[:-1], max_width))
    rows[..., :start] = hub_rows
    for g in sorted(side.gears):
        gear = elastic[g]
        if gear is None:
            continue
        end = start + gear.count
        for c, tooth in enumerate(side.teeth(g)):
            arcs = side.arcs(g)[:, c]
            # inward displacement opens a contact
            rows[:, c, :, start:end] = -_mode_rows(gear, int(tooth), side.flank, arcs)
        start = end
    return rows


def _mode_rows(gear: ElasticGear, tooth: int, flank: int, arcs: Array) -> Array:
    """Inward and rootward displacement (2, p, modes) of a flank at arcs (p,)."""
    modes, scale = gear.modes, 1.0 / math.sqrt(gear.width)
    inside = np.clip(arcs, modes.arcs[0], modes.arcs[-1])
    flank_shapes = modes.normal_at(tooth, flank), modes.tangential_at(tooth, flank)
    # linear in the values, so that a pair of modes may be counted from any tooth
    displacement = CubicSpline(modes.arcs, np.stack(flank_shapes), axis=2)(inside)
    return scale * displacement.transpose(0, 2, 1)


def _hub_rows(reference: LumpedSystem, side: ContactSide) -> Array:
    """Normal and tangential rows (2, k, p, h) over the hub coordinates."""
    space, sense = reference.modes.coordinates, side.sense
    normal = _contact_normal(reference, side)
    tangent = sense * np.array([normal[1], -normal[0]])  # toward the driver's tip
    lever = side.load_curves.moment_arms.transpose(1, 0, 2)
    rows = np.zeros((2, *lever.shape[:2], space.mass.size))
    for column, (g, sign) in enumerate(zip(side.gears, (1.0, -1.0), strict=True)):
        if (rotation := space.indices.get((g, "rotation"))) is not None:  # not held
            rows[0, ..., rotation] += sense * lever[..., column]
            rows[1, ..., rotation] -= sense * lever[..., 2 + column]
        for axis, *components in zip("xy", normal, tangent, strict=True):
            for index, motion in center_motion(reference.train, g, axis, space.indices):
                for row, component in zip(rows, components, strict=True):
                    row[..., index] += sign * component * motion
    return rows @ (reference.modes.shapes * is_supported(reference))


def _contact_normal(reference: LumpedSystem, side: ContactSide) -> Array:
    """Unit vector of the driver's force on the driven gear."""
    mesh = reference.train.meshes[side.mesh]
    angle = line_of_centers(reference.train, mesh)
    angle += side.sense * (0.5 * math.pi - mesh.pressure_angle)
    return np.array([math.cos(angle), math.sin(angle)])
