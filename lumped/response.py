"""The periodic response of a system at one mesh frequency."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from lumped.settings import Settings
from lumped.system import LumpedSystem

Array = NDArray[np.float64]
PERIODS = (2_000, 200_000)  # least and most, where the settings leave it open
MATTERS = 1e-3  # part of a mode's strain energy in the meshes
FEWEST_WINDOWS = 4  # that a long common period leaves of those asked for
WINDOW_PERIODS = 2_000  # of the first mesh that more of them together may take
ROWS = 65_536  # of a motion whose largest values are looked for at once
CROSSING_PARTS = 16  # of a step in which a contact changes
FIGURES = (
    "dte_rms",
    "dte_rms_spread",
    "dte_mean",
    "dte_peak",
    "force_peak",
    "contact_loss",
    "back_side",
)


class Status(StrEnum):
    PERIODIC = "periodic"
    APERIODIC = "aperiodic"
    DIVERGED = "diverged"


@dataclass(frozen=True, eq=False)
class History:
    """Motion over whole common periods, t points and m meshes.

    time : (t,) [s], from the start of a common period
    deflection : (t, m) dynamic transmission error, positive in compression [m]
    rate : (t, m) [m/s]
    force : (t, m) [N], negative on the back side
    drive_overlap, back_overlap : (t, m) of the nearest flanks, negative apart [m]
    force_before : (t, m) [N], other than the force where a stiffness jumps
    """

    time: Array
    deflection: Array
    rate: Array
    force: Array
    drive_overlap: Array
    back_overlap: Array
    force_before: Array


@dataclass(frozen=True, eq=False)
class Response:
    """What a mesh frequency leads to; figures for each of m meshes, NaN if diverged.

    frequency : of the first mesh [Hz]
    multiple : common periods after which the motion repeats, 0 if it does not
    period_multiple : (m,) the same in periods of each mesh
    settling_time : marched before the figures were taken [s]
    dte_rms : without the mean [m]; dte_mean, dte_peak (largest value) [m]
    dte_rms_spread : standard error of dte_rms of a motion that does not repeat,
        from the windows over which it was measured; 0 for one that repeats [m]
    force_peak : [N]
    contact_loss, back_side : parts of the time without contact on either side, and
        with back contact
    state : (2, n) modal displacement and velocity to go on from
    """

    frequency: float
    status: Status
    multiple: int
    period_multiple: NDArray[np.int64]
    settling_time: float
    dte_rms: Array
    dte_rms_spread: Array
    dte_mean: Array
    dte_peak: Array
    force_peak: Array
    contact_loss: Array
    back_side: Array
    state: Array


def respond(
    system: LumpedSystem,
    frequency: float,
    settings: Settings | None = None,
    state: Array | None = None,
) -> Response:
    """Settle at a frequency of the first mesh [Hz] and measure one period.

    state : (2, n) to start from, by default at rest under the external torques
    """
    return respond_with_history(system, frequency, settings, state)[0]


def respond_with_history(
    system: LumpedSystem,
    frequency: float,
    settings: Settings | None = None,
    state: Array | None = None,
) -> tuple[Response, History]:
    """As `respond`, with the motion over the period that was measured.

    A motion that does not repeat is measured over several windows of as many common
    periods of all meshes as multiples were looked for, and of one at least; the history
    is that of the last.
    """
    settings = settings or Settings()
    if not 0.0 < frequency < math.inf:
        raise ValueError(f"frequency must be positive and finite, got {frequency:g}")
    start = system.static_state if state is None else np.asarray(state, float)
    if start.shape != system.static_state.shape:
        wanted = system.static_state.shape
        raise ValueError(f"state must have shape {wanted}, got {start.shape}")
    now = np.array(start, float)
    status, multiple, periods = _settle(system, frequency, settings, now)
    length = system.common_period[0] / frequency
    if status != 0:
        return _diverged(system, frequency, periods * length, start), _no_motion(system)
    spans = multiple or max(1, settings.multiples // system.rounds)
    parts = []
    for _ in range(
        1 if multiple else windows(settings.windows, spans * system.common_period[0])
    ):
        failed, history = _record(system, frequency, settings, now, spans)
        if failed:
            return _diverged(system, frequency, periods * length, start), history
        parts.append(measures(history))
    response = Response(
        frequency=frequency,
        status=Status.PERIODIC if multiple else Status.APERIODIC,
        multiple=multiple,
        period_multiple=multiple * np.array(system.common_period),
        settling_time=periods * length,
        state=now,
        **pooled(parts),
    )
    return response, history


def windows(most: int, periods: int) -> int:
    """How many windows of so many periods measure a motion that does not repeat."""
    return min(most, max(FEWEST_WINDOWS, WINDOW_PERIODS // periods))


def steps_per_period(system: LumpedSystem, frequency: float, settings: Settings) -> int:
    """Steps of rk4 per period of the first mesh; doublings, so that few differ."""
    fastest = float(max(system.train.mesh_rates))
    highest = float(np.sqrt(system.arrays[0].max()))
    needed = max(settings.steps * fastest, highest / (frequency * settings.step_angle))
    base = settings.steps * fastest
    doublings = max(0, math.ceil(2.0 * math.log2(needed / base) - 1e-9))
    return math.ceil(base * 2.0 ** (0.5 * doublings))


def periods_to_settle(
    system: LumpedSystem, frequency: float, settings: Settings
) -> int:
    """Twice the periods in which modes that matter to the meshes decay, within limits.

    Decay is from the range of deflection down to the tolerance.
    """
    least, most = PERIODS
    energy = system.modes.mesh_energy[:, system.moving].sum(axis=0)
    slowest = float(system.arrays[1][energy > MATTERS].min(initial=math.inf)) / 2.0
    if not slowest > 0.0:
        return least
    needed = 2.0 * math.log(1.0 / settings.tolerance) * frequency / slowest
    if needed > 10.0 * most:  # decay too slow to wait for is none
        return least
    return int(min(max(needed, least), most))


def _settle(
    system: LumpedSystem, frequency: float, settings: Settings, state: Array
) -> tuple[int, int, float]:
    """(kernel status, multiple, common periods); the state is advanced in place."""
    length = system.common_period[0]
    allowed = settings.max_periods or periods_to_settle(system, frequency, settings)
    most = max(math.ceil(allowed / length), 4 * settings.multiples)
    if settings.method == "dopri5":
        from lumped.kernels import dopri5

        stopping = (settings.tolerance, most, settings.multiples)
        return dopri5.settle_dopri5(
            system.arrays,
            system.pieces,
            _rules(system, frequency, settings),
            stopping,
            (float(system.train.common_period[0]), system.rounds, system.turns),
            state,
        )
    from lumped.kernels import rk4

    h, stiffness, gap = system.samples(steps_per_period(system, frequency, settings))
    rules = (settings.tolerance, system.limit, most, settings.multiples)
    samples = (h / frequency, stiffness, gap)
    return rk4.settle_rk4(system.arrays, samples, rules, state)


def _rules(
    system: LumpedSystem, frequency: float, settings: Settings
) -> tuple[float, float, float, float]:
    return settings.step_error, system.limit, frequency, 1e-3 * system.energy_norm


def _record(
    system: LumpedSystem,
    frequency: float,
    settings: Settings,
    state: Array,
    periods: int,
) -> tuple[bool, History]:
    """(failed, motion); the state is advanced in place."""
    meshes = len(system.excitations)
    h, stiffness, gap = system.samples(steps_per_period(system, frequency, settings))
    time = np.concatenate([[0.0], np.cumsum(np.tile(h, periods))])
    out = np.full((time.size, 6, meshes), np.nan)
    if settings.method == "dopri5":
        from lumped.kernels import dopri5

        rules = _rules(system, frequency, settings)
        length = float(system.train.common_period[0])
        status, steps = 0, h.size // system.rounds
        grid = np.concatenate([[0.0], np.cumsum(h[:steps])])
        grid[-1] = length
        for number, start in enumerate(range(0, time.size - 1, steps)):
            rows = slice(start, start + steps + 1)
            status, _ = dopri5.record_dopri5(
                system.arrays,
                system.pieces_in(number % system.rounds),
                rules,
                (0.0, length),
                state,
                grid,
                out[rows],
            )
            if status:
                break
    else:
        from lumped.kernels import rk4

        samples = (h / frequency, stiffness, gap)
        status, _ = rk4.record_rk4(
            system.arrays, samples, periods, state, system.limit, out
        )
    return status != 0, History(time / frequency, *out.transpose(1, 0, 2))


def measures(history: History) -> dict[str, Array]:
    """Figures of a motion over whole periods, each of shape (m,)."""
    h = np.diff(history.time)[:, None]
    span = history.time[-1] - history.time[0]
    s, rate = history.deflection, history.rate
    mean = _integral(s, rate, h) / span
    around = s - mean
    square = _integral(around**2, 2.0 * around * rate, h) / span
    touching, back = (time / span for time in _contact_times(history, h))
    return {
        "dte_rms": np.sqrt(square),
        "dte_mean": mean,
        "dte_peak": _largest(s, rate, h),
        "force_peak": _top(history.force, history.force_before),
        "contact_loss": _clean(1.0 - touching),
        "back_side": back,
    }


def pooled(parts: Sequence[Mapping[str, Array]]) -> dict[str, Array]:
    """Figures of windows of equal length as those of all of them together.

    The spread is the standard error of the mean of the windows' RMS.
    """
    table = {name: np.array([part[name] for part in parts]) for name in parts[0]}
    mean = table["dte_mean"].mean(axis=0)
    around = table["dte_mean"] - mean
    rms = np.sqrt((table["dte_rms"] ** 2 + around**2).mean(axis=0))
    spread = np.zeros_like(rms)
    if len(parts) > 1:
        spread = table["dte_rms"].std(axis=0, ddof=1) / math.sqrt(len(parts))
    return {
        "dte_rms": rms,
        "dte_rms_spread": spread,
        "dte_mean": mean,
        "dte_peak": table["dte_peak"].max(axis=0),
        "force_peak": table["force_peak"].max(axis=0),
        "contact_loss": table["contact_loss"].mean(axis=0),
        "back_side": table["back_side"].mean(axis=0),
    }


def _clean(part: Array) -> Array:
    """Parts of the time without their round-off."""
    return np.where(part < 1e-12, 0.0, np.minimum(part, 1.0))


def _integral(value: Array, slope: Array, h: Array) -> Array:
    """Integral of cubic pieces through values and slopes (t, m)."""
    ends = 0.5 * h * (value[:-1] + value[1:])
    return (ends + h**2 / 12.0 * (slope[:-1] - slope[1:])).sum(axis=0)


def _largest(value: Array, slope: Array, h: Array) -> Array:
    """Largest value of the cubic pieces through values and slopes (t, m)."""
    x = np.linspace(0.0, 1.0, 9)[1:-1, None, None]
    largest = value.max(axis=0)
    for start in range(0, len(h), ROWS):
        ends = slice(start, start + ROWS + 1)
        v, s, step = value[ends], slope[ends], h[start : start + ROWS]
        p = v[:-1] * (1.0 + 2.0 * x) * (1.0 - x) ** 2 + v[1:] * x**2 * (3.0 - 2 * x)
        p = p + step * (s[:-1] * x * (1.0 - x) ** 2 - s[1:] * x**2 * (1.0 - x))
        largest = np.maximum(largest, p.max(axis=(0, 1)))
    return largest


def _top(force: Array, before: Array) -> Array:
    """Largest size of a force (t, m), by a parabola where it is smooth."""
    size = np.maximum(np.abs(force), np.abs(before))
    meshes = np.arange(size.shape[1])
    place = np.clip(size.argmax(axis=0), 1, size.shape[0] - 2)
    around = [place + i for i in (-1, 0, 1)]
    left, top, right = (size[rows, meshes] for rows in around)
    jump = np.max([np.abs(force - before)[rows, meshes] for rows in around], axis=0)
    bend = 2.0 * top - left - right
    inner = top + (left - right) ** 2 / (8.0 * np.where(bend > 0.0, bend, np.inf))
    smooth = (left > 0.0) & (right > 0.0) & (top >= left) & (top >= right)
    smooth &= jump <= 1e-6 * top
    return np.where(smooth, inner, size.max(axis=0))


def _contact_times(history: History, h: Array) -> tuple[Array, Array]:
    """Times (m,) in which a drive or a back flank touches, and a back flank [s].

    Overlaps bend with the deflection, whose rates are known; the gaps beside it are
    straight between samples. Where the two sides' pairs change places within a step
    both may touch: contact is either.
    """
    drive, back = (_both_ends(v) for v in (history.drive_overlap, history.back_overlap))
    h = np.broadcast_to(h, drive[0].shape)
    touching = np.where(np.maximum(drive[0], back[0]) > 0.0, h, 0.0)
    backing = np.where(back[0] > 0.0, h, 0.0)
    slope = h * np.maximum(np.abs(history.rate[:-1]), np.abs(history.rate[1:]))
    near = np.zeros(h.shape, bool)
    for start, end in (drive, back):
        near |= ((start > 0.0) != (end > 0.0)) | (
            np.minimum(np.abs(start), np.abs(end)) < slope
        )
    x = np.linspace(0.0, 1.0, CROSSING_PARTS + 1)
    bend = _bend(history, h, near, x)
    over, behind = (
        (1.0 - x) * start[near, None] + x * end[near, None]
        for start, end in (drive, back)
    )
    over, behind = over + bend, behind - bend
    touching[near] = h[near] * _part_positive(np.maximum(over, behind))
    backing[near] = h[near] * _part_positive(behind)
    return touching.sum(axis=0), backing.sum(axis=0)


def _both_ends(overlap: Array) -> tuple[Array, Array]:
    """Overlap at the start and end of every step (t - 1, m), one for the other where
    no pair is engaged; below zero where none is at both."""
    start, end = overlap[:-1], overlap[1:]
    first = np.where(np.isfinite(start), start, end)
    last = np.where(np.isfinite(end), end, start)
    return tuple(np.where(np.isfinite(v), v, -1.0) for v in (first, last))  # type: ignore[return-value]


def _bend(history: History, h: Array, steps: NDArray[np.bool_], x: Array) -> Array:
    """Deflection at parts x (p,) of some steps beside its chord (steps, p)."""
    s, rate = history.deflection, history.rate
    chord = (s[1:] - s[:-1])[steps]
    v0, v1 = ((h * v)[steps] - chord for v in (rate[:-1], rate[1:]))
    return x * (1.0 - x) * ((1.0 - x) * v0[:, None] - x * v1[:, None])


def _part_positive(values: Array) -> Array:
    """Part of each row (n, p) that is positive, straight between its entries."""
    a, b = values[:, :-1], values[:, 1:]
    crossing = (a > 0.0) != (b > 0.0)
    change = np.where(crossing, np.abs(a - b), 1.0)
    part = np.where(crossing, np.maximum(a, b) / change, (a > 0.0).astype(float))
    return part.mean(axis=1)


def _no_motion(system: LumpedSystem) -> History:
    empty = np.empty((0, len(system.excitations)))
    return History(np.empty(0), *[empty] * 6)


def _diverged(
    system: LumpedSystem, frequency: float, time: float, state: Array
) -> Response:
    meshes = len(system.excitations)
    return Response(
        frequency=frequency,
        status=Status.DIVERGED,
        multiple=0,
        period_multiple=np.zeros(meshes, np.int64),
        settling_time=time,
        state=np.array(state, float),
        **{name: np.full(meshes, np.nan) for name in FIGURES},
    )
