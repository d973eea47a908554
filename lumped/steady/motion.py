"""Motion at one speed in detail: time history, tooth pairs, section and spectrum."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from lumped.common.array_types import Array
from lumped.common.short_repr import ShortRepr
from lumped.kernels.arrays import FrictionSamples
from lumped.steady.integration_settings import Settings
from lumped.steady.losses import friction_power, transmitted_power
from lumped.steady.pair_motions import PairMotion, pair_motions
from lumped.steady.respond import respond_confirmed, respond_with_history
from lumped.steady.response import History, Response, Status
from lumped.steady.steady_state import Callback
from lumped.steady.steppers import steps_per_period
from lumped.steady.sweep import NO_OBSERVER, Direction, Observer, sweep
from lumped.train.system import LumpedSystem

SECTION_PERIODS = 64  # common periods of a section if the motion does not repeat
APPROACH_STEP = 20.0  # Hz between the speeds that lead to the requested one


class DivergedError(ArithmeticError):
    """Raised if a motion diverges; the message names the speed and the time."""

    def __init__(self, frequency: float, time: float) -> None:
        super().__init__(
            f"diverged at {frequency:g} Hz within {time:.6g} s after the start of "
            "that speed; more steps or damping may help"
        )


@dataclass(frozen=True, eq=False)
class TimeHistory(ShortRepr):
    """Motion over the measured period, with m meshes and t points.

    spans : number of common periods in it
    section_deflection, section_rate : (k, m) deflections and rates at the start of
        every period of the first mesh [m], [m/s]
    spectrum_frequency : (n,) [Hz]
    spectrum : (n, m) amplitudes of the deflection [m], the mean at 0 Hz; a discrete
        Fourier transform over the whole span, resampled evenly by the cubics through
        deflections and rates, so that no window is needed and no line leaks
    friction_power : (t, m) power that the teeth dissipate [W], 0 without friction
    transmitted_power : (2, t, m) power taken from the driver and given to the driven
        gear at nominal speeds [W], None without friction
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
    friction_power: Array
    transmitted_power: Array | None = None

    def mean_of(self, power: Array) -> Array:
        """Mean (m,) over the motion of powers (t, m)."""
        time = self.history.time
        return np.trapezoid(power, time, axis=0) / (time[-1] - time[0])


def time_history(
    system: LumpedSystem,
    frequency: float,
    settings: Settings | None = None,
    state: Array | None = None,
    section_periods: int = SECTION_PERIODS,
    callback: Callback = lambda frequency, period: None,
) -> TimeHistory:
    """Settle at a frequency of the first mesh [Hz] and analyse the motion.

    section_periods : common periods of the section of a motion that does not repeat;
        a periodic motion has the same points in each of its periods
    callback : function called while the motion settles, see `steady_state`
    Raises DivergedError, which names the speed and the time.
    """
    response, history, settings = bounded_response(
        system, frequency, settings, state, callback
    )
    section_history = history
    if not response.multiple:
        section_settings = replace(
            settings, multiples=section_periods, max_periods=1, windows=1
        )
        section_response, section_history = respond_with_history(
            system, frequency, section_settings, response.state
        )
        _require_bounded(section_response)
    section = _section(system, frequency, section_history)
    return TimeHistory(
        system,
        response,
        response.multiple or settings.multiples,
        history,
        pair_motions(system, frequency, settings, history),
        *section,
        *spectrum(history),
        friction_power(system, history),
        _transmitted_power(system, frequency, settings, history),
    )


def bounded_response(
    system: LumpedSystem,
    frequency: float,
    settings: Settings | None = None,
    state: Array | None = None,
    callback: Callback = lambda frequency, period: None,
) -> tuple[Response, History, Settings]:
    """Response, motion and settings of `respond_confirmed`.

    Raises DivergedError, which names the speed and the time.
    """
    result = respond_confirmed(system, frequency, settings, state, callback=callback)
    _require_bounded(result[0])
    return result


def _transmitted_power(
    system: LumpedSystem, frequency: float, settings: Settings, history: History
) -> Array | None:
    """See `TimeHistory.transmitted_power`."""
    samples = system.samples(steps_per_period(system, frequency, settings))
    if not isinstance(samples, FrictionSamples):
        return None
    return transmitted_power(system, history, frequency, samples)


def speeds_between(
    start: float, end: float, step: float = APPROACH_STEP
) -> list[float]:
    """Frequencies [Hz] from one to the other in even steps of at most `step` [Hz]."""
    count = math.ceil(abs(end - start) / step - 1e-9)
    return [float(f) for f in np.linspace(start, end, count + 1)]


def sweep_to_speed(
    system: LumpedSystem,
    start: float,
    end: float,
    settings: Settings | None = None,
    observer: Observer = NO_OBSERVER,
) -> Array | None:
    """State (2, n) after a passage from one frequency to near another [Hz].

    The branch on which a motion ends depends on the speed from which it comes.
    """
    *speeds, _ = speeds_between(start, end)
    if not speeds:
        return None
    direction: Direction = "up" if end > start else "down"
    branch = sweep(system, speeds, direction, settings, observer=observer)
    _require_bounded(branch.responses[-1])
    state: Array = branch.responses[-1].state
    return state


def _require_bounded(response: Response) -> None:
    if response.status == Status.DIVERGED:
        raise DivergedError(response.frequency, response.settling_time)


def _section(
    system: LumpedSystem, frequency: float, history: History
) -> tuple[Array, Array]:
    """Deflections and rates (k, m) at the start of each period of the first mesh."""
    periods = round((history.time[-1] - history.time[0]) * frequency)
    return resample(history, history.time[0] + np.arange(periods) / frequency)


def resample(history: History, time: Array) -> tuple[Array, Array]:
    """Deflections and rates (k, m) at times (k,), from the cubics through both."""
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
    amplitude = np.abs(np.fft.rfft(resample(history, time)[0], axis=0)) / count
    amplitude[1:-1] *= 2.0
    return np.arange(amplitude.shape[0]) / span, amplitude


WAVE_LEGEND = {
    "time_s": "from the start of a common period of all meshes",
    "dte_m, force_N": "positive where the drive flanks are pressed together",
    "state": "1 drive side, 0 lost, -1 back side, empty where the pair is not in mesh",
    "pairs": "counted from the one that enters the mesh",
    "springs": "over the face width of gears that move in space, from its start",
}


def wave_columns(motion: TimeHistory) -> dict[str, list[Any]]:
    """Cells of each time by column name, with meshes and pairs numbered from 1.

    A pair that is not in mesh has no state: its cell is empty.
    """
    history = motion.history
    columns = {"time_s": history.time.tolist()}
    for m, pairs in enumerate(motion.pairs):
        columns[f"mesh{m + 1}_dte_m"] = history.deflection[:, m].tolist()
        columns[f"mesh{m + 1}_force_N"] = history.force[:, m].tolist()
        if motion.system.has_friction:
            name = f"mesh{m + 1}_friction_power_W"
            columns[name] = motion.friction_power[:, m].tolist()
        part = "pair"
        if history.moments is not None:
            part = "spring"
            columns[f"mesh{m + 1}_moment_Nm"] = history.moments[:, m].tolist()
        for p in range(pairs.force.shape[1]):
            name = f"mesh{m + 1}_{part}{p + 1}"
            columns[f"{name}_force_N"] = pairs.force[:, p].tolist()
            samples = zip(pairs.state[:, p], pairs.in_mesh[:, p], strict=True)
            states = [int(state) if in_mesh else None for state, in_mesh in samples]
            columns[f"{name}_state"] = states
    return columns
