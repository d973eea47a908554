"""Excitation of a mesh from its table."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lumped.common.array_types import Array
from lumped.common.checks import check_arguments
from lumped.train.excitation import MeshExcitation, PairExcitation, with_pitch_errors
from lumped.train.table import MeshTable, pair_names, pair_teeth
from lumped.train.waves import (
    Wave,
    constant_wave,
    cut_into_pitches,
    monotone_cubics,
    wave_from_samples,
)

MODELS = (1, 2, 3)
TORQUE_RTOL = 1e-4  # of torques that are typed with five digits
FINITE_ON_PATH = "on the path of contact it must be finite"
STIFFNESS_COLUMN = "stiffness_N_per_m"
ReliefStiffness = Literal["own", "unmodified"]


@check_arguments
def excitation_from_table(
    table: MeshTable,
    torque: float,
    model: int = 1,
    stiffness_table: MeshTable | None = None,
    pitch_errors: ArrayLike = (),
    relief_stiffness: ReliefStiffness = "own",
) -> MeshExcitation:
    """Excitation of one mesh at a torque on its driver [N m].

    Columns are interpolated in torque. A table of one torque serves for all but in
    Model-2, whose transmission error is that under the torque. Tables without columns
    for pairs count as one pair in any model. All values used must be finite; the cells
    of a pair may be empty before and after its path of contact.

    Parameters
    ----------
    table : MeshTable
        Table of the mesh, with positive stiffnesses.
    torque : float
        Torque on the driver [N m].
    model : {1, 2, 3}, optional
        Model of the mesh.
    stiffness_table : MeshTable, optional
        Table of the same teeth without profile modification. Modified teeth that carry
        no load at rest may touch in motion, and their own table has no stiffness for
        that.
    pitch_errors : (p,) array_like, optional
        For Model-1, gaps of the tooth pairs [m] that a table of teeth without errors
        lacks; see `pair_errors`. In models 2 and 3 the table covers all base pitches
        until the pairs repeat.
    relief_stiffness : {'own', 'unmodified'}, optional
        For Model-1 with `stiffness_table`, the stiffness of a pair. own: that of the
        modified teeth where they carry load at rest, by which the transmission error at
        rest is that of `table`; unmodified: that of `stiffness_table` everywhere, as in
        the multi-mesh source.

    Returns
    -------
    MeshExcitation
        Stiffness and gap of each tooth pair, or of the mesh.

    Raises
    ------
    ValueError
        If the torque is outside the table, a value is not finite or a stiffness not
        positive, or the arguments do not fit each other.

    Notes
    -----
    The models are those of eq. 2.2 (Model-1), 2.10 (Model-2) and 2.11 (Model-3) of the
    multi-mesh source.
    """
    if model not in MODELS:
        raise ValueError(f"model = {model}; must be 1, 2 or 3")
    pitches = table_pitches(table)
    unmodified_table = table if stiffness_table is None else stiffness_table
    for mesh_table in (table, unmodified_table):
        _require_positive_stiffness(mesh_table)
    mesh_stiffness = column_at_torque(unmodified_table, "stiffness_N_per_m", torque)
    mean_stiffness = float(mesh_stiffness.mean())
    errors = np.asarray(pitch_errors, float)
    if model == 1 and table.pair_count:
        use_modified_stiffness = relief_stiffness == "own"
        if use_modified_stiffness and not np.array_equal(
            table.position, unmodified_table.position
        ):
            raise ValueError(
                f"stiffness_table = {unmodified_table.position.size} positions; must "
                f"have the {table.position.size} of the table"
            )
        return MeshExcitation(
            _pair_excitations(
                table, unmodified_table, torque, errors, use_modified_stiffness
            ),
            mean_stiffness,
        )
    if errors.size:
        raise ValueError(
            "pitch_errors are gaps of tooth pairs: model 1 and a table with columns "
            "for pairs are needed"
        )
    if model == 2:
        _require_torque(table, torque)
        _require_finite(table, "ste_m")
        error = column_at_torque(table, "ste_m", torque)
        gap = wave_from_samples(error - error.mean(), pitches)
        return MeshExcitation(
            (PairExcitation(constant_wave(mean_stiffness), gap),), mean_stiffness
        )
    error = np.zeros(table.position.size)
    if "nlte_m" in table.columns:
        _require_finite(table, "nlte_m")
        error = column_at_torque(table, "nlte_m", torque)
    stiffness = wave_from_samples(mesh_stiffness, table_pitches(unmodified_table))
    spring = PairExcitation(stiffness, wave_from_samples(error, pitches))
    return MeshExcitation((spring,), spring.stiffness.mean)


def column_at_torque(table: MeshTable, column: str, torque: float) -> Array:
    """Column (n,) at a torque [N m], linear between the torques of the table."""
    torques, values = table.torque_Nm, table[column]
    if torques.size == 1:
        return values[0]
    order = np.argsort(torques)
    torques, values = torques[order], values[order]
    low, high = torques[0], torques[-1]
    tolerance = 1e-9 * abs(high)
    if not low - tolerance <= torque <= high + tolerance:
        raise ValueError(
            f"torque {torque:g} N m is outside of the mesh table's "
            f"{low:g} to {high:g} N m"
        )
    upper = int(np.clip(np.searchsorted(torques, torque), 1, max(torques.size - 1, 1)))
    step = torques[upper] - torques[upper - 1]
    fraction = min(max((torque - torques[upper - 1]) / step, 0.0), 1.0)
    return (1.0 - fraction) * values[upper - 1] + fraction * values[upper]


def _require_torque(table: MeshTable, torque: float) -> None:
    """Require that a table of a single torque is of this one."""
    torques = table.torque_Nm
    if torques.size == 1 and abs(torque - torques[0]) > TORQUE_RTOL * torques[0]:
        raise ValueError(
            f"torque {torque:g} N m; the mesh table is of {torques[0]:g} N m alone; "
            "model 2 takes the transmission error under the torque, a table of this "
            "torque, or of several around it, is needed"
        )


def _require_positive_stiffness(table: MeshTable) -> None:
    values = table["stiffness_N_per_m"]
    is_bad = ~(np.isfinite(values) & (values > 0.0))
    _refuse_first_bad_cell(table, "stiffness_N_per_m", is_bad, "must be positive")


def _require_finite(table: MeshTable, column: str) -> None:
    _refuse_first_bad_cell(
        table, column, ~np.isfinite(table[column]), "must be a finite number"
    )


def _refuse_first_bad_cell(
    table: MeshTable, column: str, is_bad: NDArray[np.bool_], requirement: str
) -> None:
    """Raise ValueError with the first bad cell (t, n) of a column, if any."""
    for t, n in np.argwhere(is_bad):
        value = table[column][t, n]
        raise ValueError(
            f"{column} is {'empty' if np.isnan(value) else f'{value:g}'} at torque "
            f"{table.torque_Nm[t]:g} N m, position {table.position[n]:g}; {requirement}"
        )


def _require_whole_path(table: MeshTable) -> None:
    """Require numbers in all cells of a pair on the path of contact.

    The path runs from pair to pair, from the first positive stiffness to the last.
    """
    teeth, pitches = pair_teeth(table), table_pitches(table)
    pairs_in_order = sorted(range(len(teeth)), key=lambda i: teeth[i])
    columns = {
        quantity: [table[name] for name in pair_names(table, quantity)]
        for quantity in ("stiffness_N_per_m", "load_share", "gap_m")
    }
    positions_per_pitch = table.position.size // pitches
    loaded_masks_by_pair = []
    for i in pairs_in_order:
        carries_load = columns["stiffness_N_per_m"][i] > 0.0
        # the pair that is k ahead in base pitch n is k + 1 ahead in the next
        loaded_masks_by_pair.append(
            np.roll(
                carries_load.reshape(-1, pitches, positions_per_pitch),
                -teeth[i],
                axis=1,
            )
        )
    is_loaded = np.concatenate(loaded_masks_by_pair, axis=2)
    has_begun = np.maximum.accumulate(is_loaded, axis=2)
    is_path = has_begun & np.maximum.accumulate(is_loaded[..., ::-1], axis=2)[..., ::-1]
    for number, i in enumerate(pairs_in_order):
        k, share, gap = (values[i] for values in columns.values())
        is_on_path = np.roll(
            is_path[
                ..., number * positions_per_pitch : (number + 1) * positions_per_pitch
            ],
            teeth[i],
            axis=1,
        )
        is_needed = is_on_path.reshape(k.shape) | (share > 0.0)
        is_missing = np.isnan(k) & is_needed | (share > 0.0) & ~(k > 0.0)
        is_bad = is_missing | np.isinf(k) | (k < 0.0)
        _refuse_first_bad_cell(
            table,
            f"pair{i + 1}_stiffness_N_per_m",
            is_bad,
            f"{FINITE_ON_PATH} and positive",
        )
        is_bad = np.isnan(gap) & is_needed | np.isinf(gap)
        _refuse_first_bad_cell(table, f"pair{i + 1}_gap_m", is_bad, FINITE_ON_PATH)


def table_pitches(table: MeshTable) -> int:
    """Base pitches that a table covers in equal steps; ValueError if it does not."""
    position, size = table.position, table.position.size
    step = float(position[1] - position[0]) if size > 1 else 1.0
    positions_per_pitch = round(1.0 / step)  # positions of a base pitch
    is_even = 4 <= positions_per_pitch <= size and size % positions_per_pitch == 0
    if (
        not is_even
        or np.abs(position - np.arange(size) / positions_per_pitch).max() > 1e-6
    ):
        raise ValueError(
            "a mesh table needs 4 or more equally spaced positions from 0 to below 1, "
            "and as many in each further base pitch"
        )
    return size // positions_per_pitch


def repeat_table(table: MeshTable, position: Array) -> MeshTable:
    """Table at positions (n,) over more base pitches, after which its pairs repeat."""
    repetitions, remainder = divmod(position.size, table.position.size)
    if remainder:
        raise ValueError(
            f"{position.size} positions are no whole number of times the "
            f"{table.position.size} of the table"
        )
    columns = {
        name: np.tile(values, repetitions) for name, values in table.columns.items()
    }
    return MeshTable(table.torque_Nm, position, columns, table.header)


def _pair_excitations(
    table: MeshTable,
    unmodified_table: MeshTable,
    torque: float,
    errors: Array,
    use_modified_stiffness: bool,
) -> tuple[PairExcitation, ...]:
    """Springs of all pairs; a pair's waves continue those of the pair before it.

    use_modified_stiffness : whether pairs that carry load have the stiffness of `table`
    """
    for mesh_table in (unmodified_table, table):
        _require_whole_path(mesh_table)
    stiffness_columns = _columns_by_pair(unmodified_table, STIFFNESS_COLUMN, torque)
    gap_columns = _columns_by_pair(table, "gap_m", torque)
    if use_modified_stiffness and table is not unmodified_table:
        stiffness_columns, gap_columns = _springs_with_loads_at_rest(
            table, stiffness_columns, gap_columns, torque
        )
    pitches = table_pitches(unmodified_table)
    stiffness_columns = _bridged(stiffness_columns, pitches)
    unknown_gap = np.full(table.position.size, np.nan)
    gap_columns = {k: gap_columns.get(k, unknown_gap) for k in stiffness_columns}
    stiffness_waves = _waves_along_path(stiffness_columns, pitches, 0.0)
    gap_waves = _waves_along_path(gap_columns, table_pitches(table), None)
    return tuple(
        PairExcitation(
            stiffness_waves[k], with_pitch_errors(gap_waves[k], k, errors), k
        )
        for k in stiffness_waves
    )


def _springs_with_loads_at_rest(
    table: MeshTable,
    unmodified_stiffness: dict[int, Array],
    gap: dict[int, Array],
    torque: float,
) -> tuple[dict[int, Array], dict[int, Array]]:
    """Stiffness and gap (n,) of modified pairs that carry what they do at rest.

    A pair that carries all of the load has the stiffness of its own table; the less it
    carries, the more it has that of unmodified teeth, which it would have in motion if
    pressed together further. Loads of its neighbours keep a pair apart that carries
    little or nothing: its gap closes where its load begins.

    unmodified_stiffness : stiffness of unmodified teeth
    gap : of the modified teeth
    """
    _require_finite(table, "ste_m")
    error = column_at_torque(table, "ste_m", torque)
    modified_stiffness = _columns_by_pair(table, STIFFNESS_COLUMN, torque)
    load_shares = _columns_by_pair(table, "load_share", torque)
    zeros, unknown_gap = np.zeros(error.size), np.full(error.size, np.nan)
    stiffness, gaps = {}, {}
    for k in sorted({*modified_stiffness, *unmodified_stiffness}):
        load_share = np.nan_to_num(load_shares.get(k, zeros))
        bounded_share = np.clip(load_share, 0.0, 1.0)
        weight = bounded_share * bounded_share * (3.0 - 2.0 * bounded_share)
        stiffness_unmodified, modified_gap = (
            unmodified_stiffness.get(k, zeros),
            gap.get(k, unknown_gap),
        )
        secant_stiffness = np.where(
            load_share > 0.0, modified_stiffness.get(k, zeros), stiffness_unmodified
        )
        stiffness_unmodified = np.where(
            stiffness_unmodified > 0.0, stiffness_unmodified, secant_stiffness
        )
        stiffness[k] = secant_stiffness * weight + stiffness_unmodified * (1.0 - weight)
        load = np.where(
            load_share > 0.0, secant_stiffness * (error - modified_gap), 0.0
        )
        loaded_gap = error - load / np.where(load_share > 0.0, stiffness[k], 1.0)
        gaps[k] = np.where(
            load_share > 0.0, loaded_gap, np.maximum(modified_gap, error)
        )
    return stiffness, gaps


def bending_along_path(table: MeshTable, torque: float) -> dict[int, Wave]:
    """Friction-bending ratio of every pair along its path, by base pitches ahead.

    Where a pair carries no load, the ratio is that at the nearest loaded position.
    """
    ratio = _columns_by_pair(table, "friction_bending_ratio", torque)
    return _waves_along_path(ratio, table_pitches(table), None)


def _columns_by_pair(
    table: MeshTable, quantity: str, torque: float
) -> dict[int, Array]:
    """Column (n,) of each pair at a torque, by base pitches ahead in rising order."""
    columns = zip(pair_teeth(table), pair_names(table, quantity), strict=True)
    return {k: column_at_torque(table, name, torque) for k, name in sorted(columns)}


def _bridged(stiffness: dict[int, Array], pitches: int) -> dict[int, Array]:
    """Stiffness (n,) by pair, with one more pair where none carries between pitches.

    Beside missing teeth a pair may end at the last position of a pitch and another
    begin at the first of the next. The one that begins does so a step before.
    """
    lowest = min(stiffness)
    carries = {
        k: np.nan_to_num(v).reshape(pitches, -1) > 0 for k, v in stiffness.items()
    }
    bridges = [
        carries[k][:, -1] & np.roll(carries[k + 1][:, 0], -1)
        for k in stiffness
        if k + 1 in carries
    ]
    if pitches == 1 or np.any(bridges, axis=0).all():
        return stiffness
    size = stiffness[lowest].size
    return {lowest - 1: np.full(size, np.nan)} | stiffness


def _waves_along_path(
    columns: dict[int, Array], pitches: int, value_off_path: float | None
) -> dict[int, Wave]:
    """Waves by pair; cells without a value take `value_off_path`, or the nearest value.

    columns : (n,) of the pairs in rising order, over so many base pitches
    """
    if pitches > 1:
        columns_by_pitch = {
            k: column.reshape(pitches, -1) for k, column in columns.items()
        }
        return _waves_along_different_paths(columns_by_pitch, value_off_path)
    path, end_value = _fill_gaps(np.concatenate([*columns.values()]), value_off_path)
    size = next(iter(columns.values())).size
    x = min(columns) + np.arange(path.size + 1) / size
    coefficients = monotone_cubics(x, np.append(path, end_value))
    return cut_into_pitches(x, coefficients, (), 0.0)


def _waves_along_different_paths(
    columns: dict[int, Array], value_off_path: float | None
) -> dict[int, Wave]:
    """Waves by pair if pairs differ, from columns (c, n) over base pitches.

    The pair that is k ahead in base pitch i is k + 1 ahead in the next.
    """
    (pitches, n), count = next(iter(columns.values())).shape, len(columns)
    shapes = np.empty((count, pitches, n, 4))
    for first_pitch in range(pitches):
        pitch_indices = (first_pitch + np.arange(count)) % pitches
        values = np.concatenate(
            [v[t] for v, t in zip(columns.values(), pitch_indices, strict=True)]
        )
        path, end_value = _fill_gaps(values, value_off_path)
        pieces = monotone_cubics(
            np.arange(path.size + 1) / n, np.append(path, end_value)
        )
        shapes[np.arange(count), pitch_indices] = pieces.reshape(count, n, 4)
    breaks = np.arange(n + 1) / n
    return {k: Wave(breaks, shapes[i]) for i, k in enumerate(columns)}


def _fill_gaps(path: Array, value_off_path: float | None) -> tuple[Array, float]:
    """Path with gaps filled, and the value at its end."""
    is_missing = ~np.isfinite(path)
    if value_off_path is None and not is_missing.all():
        path = np.interp(
            np.arange(path.size), np.flatnonzero(~is_missing), path[~is_missing]
        )
        is_missing[:] = False
    path[is_missing] = value_off_path or 0.0
    return path, float(path[-1]) if value_off_path is None else value_off_path
