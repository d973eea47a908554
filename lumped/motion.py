"""The motion at one speed in full: time history, tooth pairs, section and spectrum."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lumped.csv_text import format_csv
from lumped.respond import respond_confirmed, respond_with_history
from lumped.response import History, Response, Status
from lumped.settings import Settings
from lumped.steppers import steps_per_period
from lumped.sweep import Direction, sweep
from lumped.system import LumpedSystem

Array = NDArray[np.float64]
SECTION_PERIODS = 64  # common periods of a section where the motion does not repeat
APPROACH_STEP = 20.0  # Hz between the speeds that lead to the one that is asked for
PARTS = 16  # of a step, for the time that contact conditions last
CONDITIONS = {
    "I": "no pair touches",
    "II": "the entering pair is lost",
    "III": "all pairs touch",
    "IV": "the leaving pair is lost",
    "back": "a pair touches on its back side",
    "other": "only a pair in the middle touches, or is lost",
}


class DivergedError(ArithmeticError):
    """A run that left every bound; the message names speed and time."""

    def __init__(self, frequency: float, time: float) -> None:
        super().__init__(
            f"diverged at {frequency:g} Hz within {time:.6g} s after the start of "
            "that speed; more --steps or damping may help"
        )


@dataclass(frozen=True, eq=False)
class PairMotion:
    """Tooth pairs of one mesh, t points and p pairs from the entering one on.

    force : (t, p) [N], negative on the back side
    state : (t, p) 1 drive side, 0 no contact, -1 back side
    engaged : (t, p) whether the pair is where it could carry a force
    conditions : part of the time by key of CONDITIONS, while two pairs or more
        are engaged; empty where this never is so
    """

    force: Array
    state: NDArray[np.int64]
    engaged: NDArray[np.bool_]
    conditions: Mapping[str, float]

    @property
    def count(self) -> NDArray[np.int64]:
        """Engaged pairs (t,)."""
        return self.engaged.sum(axis=1)


@dataclass(frozen=True, eq=False)
class TimeHistory:
    """Motion over the period that was measured, m meshes and t points.

    spans : common periods in it
    section_deflection, section_rate : (k, m) at the start of every period of the
        first mesh [m], [m/s]
    spectrum_frequency : (n,) [Hz]
    spectrum : (n, m) amplitudes of the deflection [m], the mean at 0 Hz; a discrete
        Fourier transform over the whole span, resampled evenly by the cubics through
        deflections and rates, so that no window is needed and no line leaks
    """

    system: LumpedSystem
    response: Response
    spans: int
    history: History
    pairs: tuple[PairMotion, ...]
    section_deflection: Array
    section_rate: Array
    spectrum_frequency: Array
    spectrum: Array


def time_history(
    system: LumpedSystem,
    frequency: float,
    settings: Settings | None = None,
    state: Array | None = None,
    section_periods: int = SECTION_PERIODS,
) -> TimeHistory:
    """Settle at a frequency of the first mesh [Hz] and take the motion apart.

    section_periods : common periods of the section of a motion that does not repeat;
        one that repeats has the same points in every period of its own
    Raises DivergedError, which names the speed and the time.
    """
    response, history, settings = respond_confirmed(system, frequency, settings, state)
    _require_bounded(response)
    stroboscope = history
    if not response.multiple:
        longer = replace(settings, multiples=section_periods, max_periods=1, windows=1)
        later, stroboscope = respond_with_history(
            system, frequency, longer, response.state
        )
        _require_bounded(later)
    section = _section(system, frequency, stroboscope)
    return TimeHistory(
        system,
        response,
        response.multiple or settings.multiples,
        history,
        pair_motions(system, frequency, settings, history),
        *section,
        *spectrum(history),
    )


def speeds_between(start: float, end: float) -> list[float]:
    """Both frequencies [Hz] and even steps of APPROACH_STEP at most, or one."""
    count = math.ceil(abs(end - start) / APPROACH_STEP - 1e-9)
    return [float(f) for f in np.linspace(start, end, count + 1)]


def arrive(
    system: LumpedSystem, start: float, end: float, settings: Settings | None = None
) -> Array | None:
    """State (2, n) after passing from one frequency to near another [Hz].

    The branch on which a motion ends depends on where it comes from.
    """
    *speeds, _ = speeds_between(start, end)
    if not speeds:
        return None
    direction: Direction = "up" if end > start else "down"
    branch = sweep(system, speeds, direction, settings)
    _require_bounded(branch.responses[-1])
    state: Array = branch.responses[-1].state
    return state


def _require_bounded(response: Response) -> None:
    if response.status == Status.DIVERGED:
        raise DivergedError(response.frequency, response.settling_time)


def pair_motions(
    system: LumpedSystem, frequency: float, settings: Settings, history: History
) -> tuple[PairMotion, ...]:
    """Every pair's force and contact, k_p (s - g_p) and so on of `excitation`.

    The history stands on the grid of the samples, repeated.
    """
    h, stiffness, gap = system.samples(steps_per_period(system, frequency, settings))
    rows = np.arange(history.time.size) % h.size
    first = system.arrays.first_pair
    return tuple(
        _pair_motion(
            stiffness[rows][:, :, first[m] : first[m + 1]],
            gap[rows][:, :, first[m] : first[m + 1]],
            history.deflection[:, m],
            np.diff(history.time),
            mesh.backlash,
        )
        for m, mesh in enumerate(system.train.meshes)
    )


def _pair_motion(
    stiffness: Array, gap: Array, s: Array, h: Array, backlash: float
) -> PairMotion:
    """stiffness, gap : (t, 3, p) at start, middle and end of the step from there."""
    elastic = s[:, None] - gap[:, 0]
    k = stiffness[:, 0]
    state = np.where(elastic > 0.0, 1, np.where(elastic < -backlash, -1, 0))
    state = np.where(k > 0.0, state, 0)
    overlap = np.where(state == -1, elastic + backlash, elastic)
    force = np.where(state == 0, 0.0, k * overlap)
    before = s[1:, None] - gap[:-1, 2]
    # not where a pair fades in or out within a step: its gap is out of bounds there
    throughout = stiffness[:-1].min(axis=1) > 0.0
    conditions = contact_conditions(elastic[:-1], before, throughout, h, backlash)
    return PairMotion(force, state, k > 0.0, conditions)


def contact_conditions(
    start: Array, end: Array, engaged: NDArray[np.bool_], h: Array, backlash: float
) -> dict[str, float]:
    """Part of the time that each of CONDITIONS lasts, but those that never occur.

    Counted while two pairs or more are engaged, over the whole time; the first
    engaged pair is the entering one, the last the leaving one.

    start, end : (n, p) deflection minus gap at the ends of n steps [m], taken as
        straight between them
    engaged : (n, p) throughout the steps
    h : (n,) [s]
    """
    found = dict.fromkeys(CONDITIONS, 0.0)
    several = np.flatnonzero(engaged.sum(axis=1) >= 2)
    part = (np.arange(PARTS) + 0.5) / PARTS
    start, end, engaged = start[several], end[several], engaged[several]
    elastic = start[:, None] + (end - start)[:, None] * part[:, None]
    there = engaged[:, None]
    touch, back = (elastic > 0.0) & there, (elastic < -backlash) & there
    count, touching = there.sum(axis=-1), touch.sum(axis=-1)
    entering, leaving = (_at_the_end(touch, engaged, end) for end in (0, -1))
    one_lost = touching == count - 1
    kinds = {
        "back": back.any(axis=-1),
        "I": touching == 0,
        "III": touching == count,
        "II": one_lost & ~entering,
        "IV": one_lost & ~leaving,
    }
    kind = np.select(list(kinds.values()), range(len(kinds)), len(kinds))
    for i, name in enumerate([*kinds, "other"]):
        found[name] = float(((kind == i).mean(axis=1) * h[several]).sum() / h.sum())
    return {name: value for name, value in found.items() if value > 0.0}


def _at_the_end(
    touch: NDArray[np.bool_], engaged: NDArray[np.bool_], end: int
) -> NDArray[np.bool_]:
    """Whether the first (0) or last (-1) engaged pair touches (n, PARTS)."""
    pairs = engaged.shape[1]
    if end == 0:
        place = engaged.argmax(axis=1)
    else:
        place = pairs - 1 - engaged[:, ::-1].argmax(axis=1)
    return np.take_along_axis(touch, place[:, None, None], axis=2)[..., 0]


def _section(
    system: LumpedSystem, frequency: float, history: History
) -> tuple[Array, Array]:
    """Deflections and rates (k, m) at the start of each period of the first mesh."""
    periods = round((history.time[-1] - history.time[0]) * frequency)
    return resampled(history, history.time[0] + np.arange(periods) / frequency)


def resampled(history: History, time: Array) -> tuple[Array, Array]:
    """Deflections and rates (k, m) at times (k,), by the cubics through both."""
    t = history.time
    step = np.clip(np.searchsorted(t, time, "right") - 1, 0, t.size - 2)
    h = (t[step + 1] - t[step])[:, None]
    x = (time - t[step])[:, None] / h
    s0, s1 = history.deflection[step], history.deflection[step + 1]
    v0, v1 = h * history.rate[step], h * history.rate[step + 1]
    c2, c3 = 3.0 * (s1 - s0) - 2.0 * v0 - v1, 2.0 * (s0 - s1) + v0 + v1
    return (
        s0 + x * (v0 + x * (c2 + x * c3)),
        (v0 + x * (2.0 * c2 + 3.0 * x * c3)) / h,
    )


def spectrum(history: History) -> tuple[Array, Array]:
    """Frequencies (n,) [Hz] and one-sided amplitudes (n, m) [m] of the deflection."""
    span = history.time[-1] - history.time[0]
    count = 2 ** math.ceil(math.log2(history.time.size))
    time = history.time[0] + span * np.arange(count) / count
    amplitude = np.abs(np.fft.rfft(resampled(history, time)[0], axis=0)) / count
    amplitude[1:-1] *= 2.0
    return np.arange(amplitude.shape[0]) / span, amplitude


def wave_csv(motion: TimeHistory, header: Mapping[str, str] | None = None) -> str:
    """The motion as CSV text: a row per time, columns by mesh and pair from 1.

    A pair that is not engaged has no state: its cell is empty.
    """
    columns = _wave_columns(motion)
    rows = zip(*columns.values(), strict=True)
    return format_csv(columns, rows, dict(header or {}) | WAVE_LEGEND)


WAVE_LEGEND = {
    "time_s": "from the start of a common period of all meshes",
    "dte_m, force_N": "positive where the drive flanks are pressed together",
    "state": "1 drive side, 0 lost, -1 back side, empty where the pair is not in mesh",
    "pairs": "counted from the one that enters the mesh",
}


def _wave_columns(motion: TimeHistory) -> dict[str, list[Any]]:
    """Cells by column name."""
    history = motion.history
    columns = {"time_s": history.time.tolist()}
    for m, pairs in enumerate(motion.pairs):
        columns[f"mesh{m + 1}_dte_m"] = history.deflection[:, m].tolist()
        columns[f"mesh{m + 1}_force_N"] = history.force[:, m].tolist()
        for p in range(pairs.force.shape[1]):
            name = f"mesh{m + 1}_pair{p + 1}"
            columns[f"{name}_force_N"] = pairs.force[:, p].tolist()
            each = zip(pairs.state[:, p], pairs.engaged[:, p], strict=True)
            states = [int(state) if engaged else None for state, engaged in each]
            columns[f"{name}_state"] = states
    return columns
