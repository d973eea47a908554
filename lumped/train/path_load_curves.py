"""Load of every tooth pair over its penetration, from a mesh table.

A tooth pair is deflected by its own load F and by the loads of neighbouring pairs,

    ste = gap_i + x_i + sum_j C_ij F_j,

so that a table contains, at every position, a point of the load curve F_i(x_i) for each
torque. Equal pairs follow the same path one after another: load curves are functions of
the position on the path of contact. Contact stiffens with the logarithm of its load:
F / x is nearly linear over log x. In these variables load curves are interpolated, and
extrapolated beyond the table's torques.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from itertools import permutations

import numpy as np
from numpy.typing import NDArray

from lumped.common.array_types import Array
from lumped.train.excitation_tables import table_pitches
from lumped.train.table import MeshTable, pair_compliance_name, pair_names, pair_teeth

OPEN_GAP = 1e-2  # [m] beyond any deflection
N_INTERVALS = 256  # of penetration in a load curve, denser toward zero
# Multiple of the table's largest penetration up to which load curves bend
MAX_PENETRATION_RATIO = 2.0
MIN_PENETRATION = 1e-4  # part of that penetration below which points are round-off
# Part of it from which a load curve is extrapolated to larger penetrations
EXTRAPOLATE_FROM = 1e-1
MAX_CONTRADICTION = 1e-2  # part of it by which a table may contradict itself
MAX_HARDENING = 0.5  # largest extrapolated relative slope of F / x over log x
MIN_STIFFNESS_RATIO = 0.1  # least F / x toward zero, relative to the first point
MAX_SHARE_ERROR = 1e-2  # largest deviation of the sum of load shares from 1
NEEDED = "the coupled model needs"
CONTRADICTION_MESSAGE = (
    "ste_m, gap_m, load_share and compliance contradict each other: a pair must carry "
    "where it is pressed in and nowhere else"
)
FALLING_LOAD_MESSAGE = "the load of a pair must grow with its penetration"


@dataclass(frozen=True, eq=False)
class PathLoadCurves:
    """Laws of equal tooth pairs along the path of contact, at s places.

    position : (s,) base pitches past the pitch point
    gap : (s,) transmission error that closes the pair, large off the path [m]
    penetration : (j,) [m]
    load : (s, j) [N]
    compliance : (s,) penetration of the pair per load of another [m/N], by the number
        of base pitches by which the other is ahead
    """

    position: Array
    gap: Array
    penetration: Array
    load: Array
    compliance: dict[int, Array]


def path_load_curves(
    table: MeshTable, base_radius: float, without: Collection[str] = ()
) -> PathLoadCurves:
    """Laws from all torques of a table with the gears' hubs held.

    base_radius : base radius of the driver [m]
    without : parts of the coupled model, `lumped.train.coupled.COMPONENTS`, that are
        left out and that the table need not contain

    Raises ValueError if the table is incomplete or contradicts itself.
    """
    _require_equal_pairs(table)
    _require_hardening(table, without)
    rising_order = np.argsort(table.torque_Nm)
    teeth = pair_teeth(table)
    force = table.torque_Nm[rising_order] / base_radius
    share, gaps = (
        np.stack([table[name][rising_order] for name in pair_names(table, quantity)])
        for quantity in ("load_share", "gap_m")
    )  # (k, t, n)
    load = np.nan_to_num(share) * force[:, None]
    gap = np.nan_to_num(gaps, nan=OPEN_GAP).min(axis=1)
    if len(teeth) > 1 and not _has_mutual_compliance(table):
        # neighbouring pairs keep a pair open that would touch alone
        unloaded_gap = np.where(load > 0.0, 0.0, table["ste_m"][rising_order])
        gap = np.maximum(gap, unloaded_gap.max(axis=1))
    penetration = table["ste_m"][rising_order] - gap[:, None]
    compliance: dict[int, Array] = {}
    for i, j in permutations(range(len(teeth)), 2):
        both_loaded = ((load[i] > 0.0) & (load[j] > 0.0))[np.argsort(rising_order)]
        values = _mutual_compliance(table, i, j, both_loaded, "pairs" not in without)
        penetration[i] -= values * load[j]
        compliance_by_pair = np.zeros((len(teeth), values.size))
        compliance_by_pair[i] = values
        pitches_ahead = teeth[j] - teeth[i]
        compliance[pitches_ahead] = compliance.get(
            pitches_ahead, 0.0
        ) + _arrange_along_path(compliance_by_pair, teeth, 0.0)
    knots, loads = _load_curves(
        _arrange_along_path(penetration, teeth, 0.0),
        _arrange_along_path(load, teeth, 0.0),
        table,
    )
    return PathLoadCurves(
        position=min(teeth) + np.arange(loads.shape[0]) / table.position.size,
        gap=_arrange_along_path(gap, teeth, OPEN_GAP),
        penetration=knots,
        load=loads,
        compliance=compliance,
    )


def _require_equal_pairs(table: MeshTable) -> None:
    """Require a table of one base pitch with columns for pairs and hubs held."""
    if table_pitches(table) > 1:
        raise ValueError(
            f"base pitches = {table_pitches(table)}; {NEEDED} a table of teeth without "
            "pitch errors, of one base pitch"
        )
    if table.header.get("body", "").startswith("free"):
        raise ValueError(
            f"body = {table.header['body']}; {NEEDED} a table of gears held at their "
            "hubs, the inertia of their bodies it takes from the gear set"
        )
    if not table.pair_count:
        raise ValueError(f"column pair1_load_share is missing; {NEEDED} tooth pairs")
    if not np.isfinite(table["ste_m"]).all():
        raise ValueError(f"ste_m has empty cells; {NEEDED} a number in each")
    least_torque = float(table.torque_Nm.min())
    if not least_torque > 0.0:
        raise ValueError(f"torque_Nm = {least_torque:g}; {NEEDED} positive torques")
    shares = np.nansum([table[n] for n in pair_names(table, "load_share")], axis=0)
    shares_sum = float(shares.flat[np.abs(shares - 1.0).argmax()])
    if not abs(shares_sum - 1.0) <= MAX_SHARE_ERROR:
        raise ValueError(
            f"load_share of all pairs = {shares_sum:g} at some position; {NEEDED} "
            "shares that make 1"
        )


def _require_hardening(table: MeshTable, without: Collection[str]) -> None:
    if table.torque_Nm.size < 2 and "hardening" not in without:
        raise ValueError(
            f"torques = {table.torque_Nm.size}; {NEEDED} two or more to know how "
            "contact stiffens with load, else it must be without hardening"
        )


def _has_mutual_compliance(table: MeshTable) -> bool:
    return any(
        pair_compliance_name(i, j) in table.columns
        for i, j in permutations(range(table.pair_count), 2)
    )


def _mutual_compliance(
    table: MeshTable, i: int, j: int, both_loaded: NDArray[np.bool_], is_required: bool
) -> Array:
    """Mutual compliance (n,) of pairs i and j [m/N], 0 where it is unknown.

    It is the mean over all torques, since the load only shifts its position slightly.

    both_loaded : (t, n) mask of the positions where both carry load
    is_required : whether it must be known there
    """
    name = pair_compliance_name(i, j)
    if name not in table.columns:
        if both_loaded.any() and is_required:
            raise ValueError(
                f"column {name} is missing; {NEEDED} it to know how pairs deflect each "
                "other, else it must be without pairs"
            )
        return np.zeros(table.position.size)
    values = table[name]
    is_finite = np.isfinite(values)
    for t, n in np.argwhere(both_loaded & ~is_finite):
        raise ValueError(
            f"{name} is {values[t, n]:g} at {table.torque_Nm[t]:g} N m, position "
            f"{table.position[n]:g}; where both pairs carry it must be a number"
        )
    total = np.where(is_finite, values, 0.0).sum(axis=0)
    return np.asarray(total / np.maximum(is_finite.sum(axis=0), 1))


def _arrange_along_path(
    values: Array, teeth: list[int], value_off_path: float
) -> Array:
    """Reshape values (k, ..., n) of the pairs to one row (..., s) along the path."""
    least_tooth, largest_tooth = min(teeth), max(teeth)
    path = np.full((largest_tooth - least_tooth + 1, *values.shape[1:]), value_off_path)
    path[np.array(teeth) - least_tooth] = values
    return np.moveaxis(path, 0, -2).reshape(*values.shape[1:-1], -1)


def _load_curves(
    penetration: Array, load: Array, table: MeshTable
) -> tuple[Array, Array]:
    """Penetrations (j,) and loads (s, j) from points (t, s) at rising torques."""
    scale = float(penetration.max(where=load > 0.0, initial=0.0))
    _require_agreement(penetration, load, scale, table)
    is_loaded = (load > 0.0) & (penetration > MIN_PENETRATION * scale)
    points = [
        (np.log(x[mask]), f[mask] / x[mask])
        for x, f, mask in zip(penetration.T, load.T, is_loaded.T, strict=True)
    ]
    log_largest = np.array([x.max(initial=-np.inf) for x, _ in points])
    reliable_positions = np.flatnonzero(log_largest > np.log(EXTRAPOLATE_FROM * scale))
    hardening = _typical_hardening([points[s] for s in reliable_positions])
    log_scale = np.log([scale])
    for s in sorted({*range(len(points))} - {*reliable_positions}):
        # a pair that hardly carries load here is extrapolated as where it does
        nearest_points = points[
            reliable_positions[np.abs(reliable_positions - s).argmin()]
        ]
        x, k = points[s]
        if x.size and table.torque_Nm.size == 1:
            continue  # a load curve without hardening is a line through its point
        stiffness = np.append(
            k, _interpolate_stiffness(nearest_points, hardening, log_scale)
        )
        points[s] = (np.append(x, log_scale), stiffness) if x.size else nearest_points
    knots = MAX_PENETRATION_RATIO * scale * np.linspace(0.0, 1.0, N_INTERVALS + 1) ** 2
    loads = np.zeros((len(points), knots.size))
    for s, curve in enumerate(points):
        loads[s, 1:] = knots[1:] * _interpolate_stiffness(
            curve, hardening, np.log(knots[1:])
        )
    _refuse_first_bad_position(
        np.diff(loads, axis=1).min(axis=1)[None] <= 0.0, table, FALLING_LOAD_MESSAGE
    )
    return knots, loads


def _typical_hardening(points: Sequence[tuple[Array, Array]]) -> float:
    """Typical relative slope of F / x over log x at the largest loads."""
    slopes = [
        (k[-1] - k[-2]) / (x[-1] - x[-2]) / k[-1] for x, k in points if x.size > 1
    ]
    return float(np.clip(np.median(slopes), 0.0, MAX_HARDENING)) if slopes else 0.0


def _interpolate_stiffness(
    points: tuple[Array, Array], hardening: float, log_penetration: Array
) -> Array:
    """Stiffness F / x [N/m] at logarithms of penetrations (j,), from that at points.

    hardening : typical relative slope, for extrapolation beyond the ends
    """
    from scipy.interpolate import PchipInterpolator

    x, k = points
    if x.size == 1:
        x, k = np.array([x[0] - 1.0, x[0]]), k * np.array([1.0 - hardening, 1.0])
    curve = PchipInterpolator(x, k)
    slope_below, slope_above = curve(x[[0, -1]], 1)
    slope_below = np.clip(slope_below, 0.0, MAX_HARDENING * k[0])
    slope_above = np.clip(
        slope_above, 0.0, 2.0 * hardening * k[-1]
    )  # not from a trace of load alone
    clipped_penetration = np.clip(log_penetration, x[0], x[-1])
    extrapolation = np.where(log_penetration < x[0], slope_below, slope_above) * (
        log_penetration - clipped_penetration
    )
    return np.asarray(
        np.maximum(
            curve(clipped_penetration) + extrapolation, MIN_STIFFNESS_RATIO * k[0]
        )
    )


def _require_agreement(
    penetration: Array, load: Array, scale: float, table: MeshTable
) -> None:
    """Require that loads (t, s) increase with penetrations, from zero at zero."""
    carries_load = load > 0.0
    contradicts = np.where(
        carries_load,
        penetration < -MAX_CONTRADICTION * scale,
        penetration > MAX_CONTRADICTION * scale,
    )
    _refuse_first_bad_position(contradicts | (load < 0.0), table, CONTRADICTION_MESSAGE)
    is_loaded = carries_load & (penetration > MIN_PENETRATION * scale)
    is_growing = (np.diff(penetration, axis=0) > 0.0) & (np.diff(load, axis=0) > 0.0)
    _refuse_first_bad_position(
        is_loaded[:-1] & is_loaded[1:] & ~is_growing, table, FALLING_LOAD_MESSAGE
    )


def _refuse_first_bad_position(
    is_bad: NDArray[np.bool_], table: MeshTable, requirement: str
) -> None:
    """Raise ValueError at the first bad position along the path (t, s)."""
    for _, s in np.argwhere(is_bad):
        pitches_ahead, index = divmod(int(s), table.position.size)
        number = pair_teeth(table).index(pitches_ahead + min(pair_teeth(table))) + 1
        raise ValueError(
            f"pair{number} at position {table.position[index]:g}: {requirement}"
        )
