"""The pair laws of all contacts, and how contacts deflect each other, as arrays."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.interpolate import PchipInterpolator

from fegear.dynamics.kernels.step_arrays import ContactJacobian, ModalMatrices
from fegear.dynamics.sides import DRIVE, ContactSide
from fegear.gearset.pitch_errors import pair_periods
from lumped.common.array_types import Array, Indices
from lumped.common.checks import require_present
from lumped.kernels.arrays import Contacts


def assemble_contacts(
    sides: Sequence[ContactSide],
    rows: ContactJacobian,
    body: ModalMatrices,
    cross_mesh: tuple[Array, Array] | None,
    gaps: Array,
) -> Contacts:
    """Laws of all contacts.

    gaps : (m,) of the meshes from position errors of planets [m]
    cross_mesh : normal and tangential cross-mesh compliance (p, c, c) [m/N]
    """
    mesh_of = rows.mesh_of
    normal, tangential = _residual_compliance(sides, rows, body)
    if cross_mesh is not None:
        normal += cross_mesh[0]
        tangential += cross_mesh[1]
    penetrations = {side.mesh: side.load_curves.penetration for side in sides}
    arms = np.concatenate([s.load_curves.moment_arms.T[2:] for s in sides], axis=1)
    gap = np.concatenate(
        [s.load_curves.gap.T + s.backlash + s.flank_sign * gaps[s.mesh] for s in sides]
    )
    # the back flanks slide the other way
    sliding = np.concatenate(
        [s.flank_sign * s.load_curves.sliding_sign.T for s in sides]
    )
    return Contacts(
        first=np.searchsorted(mesh_of, np.arange(mesh_of[-1] + 2)),
        side=np.concatenate(
            [
                np.full(s.load_curves.pair_offsets.size, float(s.flank_sign))
                for s in sides
            ]
        ),
        gap=np.ascontiguousarray(gap),  # kernels are compiled for one layout
        sliding=np.ascontiguousarray(sliding),
        arms=np.ascontiguousarray(arms),
        knots=np.array(list(penetrations.values())),
        load_curve=np.concatenate([*_alike_curves(sides), *_different_curves(sides)]),
        normal_compliance=normal,
        tangential_compliance=tangential,
        errors=_errors(sides),
        **_differences(sides),
    )


def _errors(sides: Sequence[ContactSide]) -> Array:
    """Gaps (c, n) of all contacts in the cycles of their meshes [m]."""
    cycles = np.arange(math.lcm(*pair_periods(sides[0].gear_set)))
    gaps = np.concatenate([side.errors(cycles) for side in sides])
    return gaps if gaps.any() else gaps[:, :0]


def _alike_curves(sides: Sequence[ContactSide]) -> list[Array]:
    """Load curves (k, p, 2, j, 4) of the contacts of teeth that are alike, by side."""
    return [_cubics(side, side.load_curves.load) for side in sides]


def _different_curves(sides: Sequence[ContactSide]) -> list[Array]:
    """Load curves (k, p, 2, j, 4) of the contacts of each two teeth that differ."""
    return [
        _cubics(side, curves.load)
        for side in sides
        if side.differences is not None
        for curves in side.differences.curves
    ]


def _differences(sides: Sequence[ContactSide]) -> dict[str, Array]:
    """Which load curves and gaps contacts have in which cycles, see `Contacts`."""
    different = [side.differences for side in sides if side.differences is not None]
    if not different:
        return {}
    cycles = np.arange(math.lcm(*(teeth.cycles for teeth in different)))
    counts = [side.load_curves.pair_offsets.size for side in sides]
    curve, change = sum(counts), 1
    curve_rows, gap_rows, changes = (
        [],
        [],
        [np.zeros((1, len(sides[0].load_curves.gap)))],
    )
    for side, first, count in zip(
        sides, np.cumsum([0, *counts[:-1]]), counts, strict=True
    ):
        contact = np.arange(count)[:, None]
        if side.differences is None:
            curve_rows.append(np.broadcast_to(first + contact, (count, cycles.size)))
            gap_rows.append(np.zeros((count, cycles.size), np.int64))
            continue
        teeth = side.differences
        number = teeth.number[:, cycles % teeth.number.shape[1]]
        different_curve = curve + (number - 1) * count + contact
        row = np.where(number > 0, different_curve, first + contact)
        curve_rows.append(row)
        rows, of_cycles = _gap_changes(side, number, cycles % len(teeth.gap))
        gap_rows.append(change + of_cycles)
        changes.append(rows)
        curve, change = curve + count * len(teeth.curves), change + len(rows)
    return {
        "curve_rows": np.concatenate(curve_rows),
        "gap_rows": np.concatenate(gap_rows),
        "gap_changes": np.concatenate(changes),
    }


def _gap_changes(
    side: ContactSide, number: Indices, turn: Indices
) -> tuple[Array, Indices]:
    """Different changes (r, p) of the gaps of a side [m], and which (k, n) have which.

    number : (k, n) of the teeth in the cycles; turn : (n,) row of the centres' gaps
    """
    teeth = require_present(side.differences, "differences")
    contact = np.where(number > 0, np.arange(len(number))[:, None], 0)
    turns, numbers = len(teeth.gap), 1 + len(teeth.curves)
    code = (contact * numbers + number) * turns + turn
    codes, rows = np.unique(code, return_inverse=True)
    changes = teeth.gap[codes % turns].copy()
    of_contact, of_teeth = np.divmod(codes // turns, numbers)
    for row, (k, v) in enumerate(zip(of_contact, of_teeth, strict=True)):
        if v > 0:
            changes[row] += teeth.curves[v - 1].gap[:, k] - side.load_curves.gap[:, k]
    return changes, rows.reshape(code.shape)


def _cubics(side: ContactSide, load: Array) -> Array:
    """Monotone cubics (k, p, 2, j, 4) of loads (p, k, 2, j + 1), by rising power.

    With friction as is nominal on this side, then reversed.
    """
    penetration = side.load_curves.penetration
    load = load if side.flank_sign == DRIVE else load[:, :, ::-1]
    pieces = PchipInterpolator(penetration, load, axis=3).c  # (4, j, p, k, 2)
    return np.ascontiguousarray(pieces[::-1].transpose(3, 2, 4, 1, 0))


def _residual_compliance(
    sides: Sequence[ContactSide], rows: ContactJacobian, body: ModalMatrices
) -> tuple[Array, Array]:
    """Static compliance (p, c, c) between contacts less that of the modes [m/N].

    R = C - sum_i w_i w_i^T / omega_i^2 with the Jacobian w of mode i (MacNeal 1971).
    """
    mesh_of = rows.mesh_of
    hubs, rigidity = body.damping.size, body.rigidity
    contacts, positions = rows.normal.shape[:2]
    normal, tangential = (np.zeros((positions, contacts, contacts)) for _ in range(2))
    start = 0
    for side in sides:
        block = slice(start, start + side.load_curves.pair_offsets.size)
        normal[:, block, block] = side.load_curves.normal_compliance
        tangential[:, block, block] = side.load_curves.tangential_compliance
        start = block.stop
    for c, one in enumerate(mesh_of):
        for d, two in enumerate(mesh_of):
            receiver_columns, source_columns = _common(rows, hubs, one, two)
            modal_compliance = (
                1.0 / rigidity[rows.columns[one, receiver_columns] - hubs]
            )
            receiver = rows.normal[c][:, receiver_columns] * modal_compliance
            for out, source in ((normal, rows.normal), (tangential, rows.tangential)):
                out[:, c, d] -= (receiver * source[d][:, source_columns]).sum(axis=1)
    return normal, tangential


def _common(
    rows: ContactJacobian, hubs: int, one: int, two: int
) -> tuple[Indices, Indices]:
    """Places of the elastic coordinates that two meshes share, in the row of each."""
    count, columns = rows.widths, rows.columns
    _, columns_of_one, columns_of_two = np.intersect1d(
        columns[one, hubs : count[one]],
        columns[two, hubs : count[two]],
        return_indices=True,
    )
    return hubs + columns_of_one, hubs + columns_of_two
