"""The pair laws of all contacts, and how contacts deflect each other, as arrays."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from fegear.dynamics.kernels.arrays import ContactJacobian, ModalMatrices
from fegear.dynamics.sides import DRIVE, ContactSide
from fegear.gearset.pitch_errors import pair_periods
from lumped.kernels.arrays import Contacts

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


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
            [_cubics(s.load_curves.penetration, _loads(s)) for s in sides]
        ),
        normal_compliance=normal,
        tangential_compliance=tangential,
        errors=_errors(sides),
    )


def _errors(sides: Sequence[ContactSide]) -> Array:
    """Gaps (c, n) of all contacts in the cycles of their meshes [m]."""
    cycles = np.arange(math.lcm(*pair_periods(sides[0].gear_set)))
    gaps = np.concatenate([side.errors(cycles) for side in sides])
    return gaps if gaps.any() else gaps[:, :0]


def _loads(side: ContactSide) -> Array:
    """Loads (p, k, 2, j) with friction as is nominal on this side, then reversed."""
    return (
        side.load_curves.load
        if side.flank_sign == DRIVE
        else side.load_curves.load[:, :, ::-1]
    )


def _cubics(penetration: Array, load: Array) -> Array:
    """Monotone cubics (k, p, 2, j, 4) of loads (p, k, 2, j + 1), by rising power."""
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
