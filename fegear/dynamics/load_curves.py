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
        load_curve=np.concatenate(
            [*_cubics_of_alike_teeth(sides), *_cubics_of_different_teeth(sides)]
        ),
        normal_compliance=normal,
        tangential_compliance=tangential,
        errors=_pitch_error_gaps(sides),
        **_rows_of_differences(sides),
    )


def _pitch_error_gaps(sides: Sequence[ContactSide]) -> Array:
    """Gaps (c, n) of all contacts in the cycles of their meshes [m]."""
    cycles = np.arange(math.lcm(*pair_periods(sides[0].gear_set)))
    gaps = np.concatenate([side.errors(cycles) for side in sides])
    return gaps if gaps.any() else gaps[:, :0]


def _cubics_of_alike_teeth(sides: Sequence[ContactSide]) -> list[Array]:
    """Load curves (k, p, 2, j, 4) of the contacts of teeth that are alike, by side."""
    return [_load_cubics(side, side.load_curves.load) for side in sides]


def _cubics_of_different_teeth(sides: Sequence[ContactSide]) -> list[Array]:
    """Load curves (k, p, 2, j, 4) of the contacts of each two teeth that differ."""
    return [
        _load_cubics(side, curves.load)
        for side in sides
        if side.differences is not None
        for curves in side.differences.curves
    ]


def _rows_of_differences(sides: Sequence[ContactSide]) -> dict[str, Array]:
    """Which load curves and gaps contacts have in which cycles, see `Contacts`."""
    differences = [side.differences for side in sides if side.differences is not None]
    if not differences:
        return {}
    cycles = np.arange(math.lcm(*(teeth.cycles for teeth in differences)))
    counts = [side.load_curves.pair_offsets.size for side in sides]
    next_curve, next_gap_row = sum(counts), 1
    curve_rows, gap_rows, gap_changes = (
        [],
        [],
        [np.zeros((1, len(sides[0].load_curves.gap)))],
    )
    for side, first_contact, count in zip(
        sides, np.cumsum([0, *counts[:-1]]), counts, strict=True
    ):
        contact = np.arange(count)[:, None]
        if side.differences is None:
            curve_rows.append(
                np.broadcast_to(first_contact + contact, (count, cycles.size))
            )
            gap_rows.append(np.zeros((count, cycles.size), np.int64))
            continue
        teeth = side.differences
        number = teeth.number[:, cycles % teeth.number.shape[1]]
        different_curve = next_curve + (number - 1) * count + contact
        row = np.where(number > 0, different_curve, first_contact + contact)
        curve_rows.append(row)
        rows, gap_row_of_cycle = _gap_changes(side, number, cycles % len(teeth.gap))
        gap_rows.append(next_gap_row + gap_row_of_cycle)
        gap_changes.append(rows)
        next_curve, next_gap_row = (
            next_curve + count * len(teeth.curves),
            next_gap_row + len(rows),
        )
    tables = {
        "curve_rows": curve_rows,
        "gap_rows": gap_rows,
        "gap_changes": gap_changes,
    }
    # columns that were picked lie in the order of columns, for which numba would
    # compile kernels once more
    return {
        name: np.ascontiguousarray(np.concatenate(parts))
        for name, parts in tables.items()
    }


def _gap_changes(
    side: ContactSide, number: Indices, turn_row: Indices
) -> tuple[Array, Indices]:
    """Different changes (r, p) of the gaps of a side [m], and which (k, n) have which.

    number : (k, n) of the teeth in the cycles; turn_row : (n,) row of the centres' gaps
    """
    teeth = require_present(side.differences, "differences")
    contact = np.where(number > 0, np.arange(len(number))[:, None], 0)
    n_turn_rows, n_curves = len(teeth.gap), 1 + len(teeth.curves)
    combination = (contact * n_curves + number) * n_turn_rows + turn_row
    combinations, rows = np.unique(combination, return_inverse=True)
    changes = teeth.gap[combinations % n_turn_rows].copy()
    contact_of_row, curve_of_row = np.divmod(combinations // n_turn_rows, n_curves)
    for row, (k, v) in enumerate(zip(contact_of_row, curve_of_row, strict=True)):
        if v > 0:
            changes[row] += teeth.curves[v - 1].gap[:, k] - side.load_curves.gap[:, k]
    return changes, rows.reshape(combination.shape)


def _load_cubics(side: ContactSide, load: Array) -> Array:
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
    n_hub_coordinates, rigidity = body.damping.size, body.rigidity
    contacts, positions = rows.normal.shape[:2]
    normal, tangential = (np.zeros((positions, contacts, contacts)) for _ in range(2))
    start = 0
    for side in sides:
        block = slice(start, start + side.load_curves.pair_offsets.size)
        normal[:, block, block] = side.load_curves.normal_compliance
        tangential[:, block, block] = side.load_curves.tangential_compliance
        start = block.stop
    for c, mesh in enumerate(mesh_of):
        for d, other_mesh in enumerate(mesh_of):
            receiver_columns, source_columns = _shared_elastic_columns(
                rows, n_hub_coordinates, mesh, other_mesh
            )
            modal_compliance = (
                1.0 / rigidity[rows.columns[mesh, receiver_columns] - n_hub_coordinates]
            )
            receiver = rows.normal[c][:, receiver_columns] * modal_compliance
            for out, source in ((normal, rows.normal), (tangential, rows.tangential)):
                out[:, c, d] -= (receiver * source[d][:, source_columns]).sum(axis=1)
    return normal, tangential


def _shared_elastic_columns(
    rows: ContactJacobian, n_hub_coordinates: int, mesh: int, other_mesh: int
) -> tuple[Indices, Indices]:
    """Places of the elastic coordinates that two meshes share, in the row of each."""
    widths, columns = rows.widths, rows.columns
    _, in_mesh, in_other_mesh = np.intersect1d(
        columns[mesh, n_hub_coordinates : widths[mesh]],
        columns[other_mesh, n_hub_coordinates : widths[other_mesh]],
        return_indices=True,
    )
    return n_hub_coordinates + in_mesh, n_hub_coordinates + in_other_mesh
