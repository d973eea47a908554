"""Signals of a motion over the turns of a gear, and indicators of their averages."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import partial
from typing import Any

import numpy as np

from lumped.common.array_types import Array
from lumped.signals.averages import TurnAverage, synchronous_average
from lumped.signals.coordinate_motion import (
    CoordinateMotion,
    coordinate_motion,
    ramp_pieces,
)
from lumped.signals.faulty_tooth import Engagement, faulty_tooth
from lumped.signals.orders import pulse_times, resample_at, times_at_angles
from lumped.signals.ring_sensor import RingSensor
from lumped.signals.sensors import signals_of_pieces, with_noise
from lumped.signals.shared_teeth import OTHER_MESH_WEIGHT, tooth_of_meshes
from lumped.steady.integration_settings import Settings
from lumped.steady.ramps import SpeedRamp
from lumped.steady.response import Response
from lumped.steady.steady_state import Speed
from lumped.steady.steppers import stepper_of, steps_per_period
from lumped.train.system import LumpedSystem

TURN_RTOL = 1e-9  # by which a turn may be short
FILTER_MARGIN = 16  # samples over which the filter against aliasing feels an end
SignalEngagements = Mapping[str, tuple[Engagement, ...]]
RATE_UNITS = "_rad_per_s", "_m_per_s"  # at the ends of names


@dataclass(frozen=True)
class TurningGear:
    """A gear by its turns.

    index, mesh : of the gear and of its first mesh, from 0
    rate : cycles of that mesh per cycle of the first mesh
    phase : of that mesh at the start; where it is whole, a tooth is at the pitch point
    orders : cycles per turn of the gear whose multiples are those of meshes
    """

    index: int
    name: str
    teeth: int
    mesh: int
    rate: Fraction
    phase: float
    orders: tuple[int, ...]

    def turn_frequency(self, mesh_frequency: float) -> float:
        """Turns per second at a frequency of the first mesh [Hz]."""
        return mesh_frequency * float(self.rate) / self.teeth

    def mesh_frequency(self, turn_frequency: float) -> float:
        """Frequency of the first mesh [Hz] at a speed [turns per second]."""
        return turn_frequency * self.teeth / float(self.rate)

    def turns(self, cycles: Any) -> Any:
        """Turns of the gear after cycles of the first mesh."""
        return cycles * float(self.rate) / self.teeth


@dataclass(frozen=True)
class Sampling:
    """How signals are sampled over the turns of a gear.

    gear : over whose turns signals are averaged
    ramp : speed over time, constant or not
    turns : of the gear, at constant speed
    samples : in a cycle of its first mesh, at the highest speed of a ramp
    pulses : per turn of a tachometer that gives the angle of the gear; 0 where it is
        that of the nominal speed
    sensor : on the ring of a planetary set, None without one
    own_rate : samples per second at constant speed, of signals without what is above
        half of it [Hz]; None where they are as many as in a turn
    """

    gear: TurningGear
    ramp: SpeedRamp
    turns: int
    samples: int
    pulses: int = 0
    sensor: RingSensor | None = None
    own_rate: float | None = None

    @property
    def points(self) -> int:
        """Samples in a turn of the gear."""
        return self.gear.teeth * self.samples

    @property
    def rate(self) -> float:
        """Samples per second, of the highest speed [Hz]."""
        return self.own_rate or self._rate_over_angle

    @property
    def _rate_over_angle(self) -> float:
        """Rate of as many samples as in a turn, at the highest speed [Hz]."""
        highest = max(self.ramp.start, self.ramp.end)
        return self.gear.turn_frequency(highest) * self.points

    @property
    def refinement(self) -> int:
        """Samples that are computed for each that is kept, against aliasing."""
        return max(1, math.ceil(self._rate_over_angle / self.rate - TURN_RTOL))

    @property
    def is_constant(self) -> bool:
        """Whether the speed is constant."""
        return self.ramp.start == self.ramp.end

    @property
    def time(self) -> Array:
        """Times (t,) of the samples [s]."""
        if self.own_rate is not None:
            seconds = self.turns / self.gear.turn_frequency(self.ramp.start)
            count = 1 + math.ceil(seconds * self.own_rate - TURN_RTOL)
        elif self.is_constant:
            count = self.turns * self.points
            if self.pulses:  # vibration may delay the last one
                count += self.samples
        else:
            count = 1 + int(self.ramp.duration * self.rate)
        return np.arange(count) / self.rate

    def over_angle(self, time: Array, values: Array, rotation: Array) -> Array:
        """Signals (k, c) at equal angles over whole turns of the gear.

        time, values : (t,) and (t, c) of the samples
        rotation : (t,) of the gear by vibration at these times [rad]
        """
        if self.own_rate is not None:
            at = self._angle(self.turns) / self.gear.turn_frequency(self.ramp.start)
            return resample_at(time, values, at)
        if self.is_constant and not self.pulses:
            return values
        turns = self.gear.turns(self.ramp.cycles_at(time))
        if self.pulses:
            turns = turns + (rotation - rotation[0]) / (2.0 * np.pi)
            pulse = pulse_times(time, turns, self.pulses)
            whole = (pulse.size - 1) // self.pulses
            if self.is_constant:
                whole = min(whole, self.turns)
            at = times_at_angles(pulse, self.pulses, self._angle(max(1, whole)))
        else:
            angle = self._angle(int(turns[-1] + TURN_RTOL))
            at = self.ramp.time_at(angle / self.gear.turns(1.0))
        return resample_at(time, values, np.clip(at, 0.0, time[-1]))

    def _angle(self, turns: int) -> Array:
        """Equal angles (k,) over some turns [turns]."""
        return np.arange(turns * self.points) / self.points


@dataclass(frozen=True, eq=False)
class SampledSignals:
    """Signals of sensors at equal steps of time, and their averages.

    time : (t,) [s]
    names : of the c signals, with their units
    values : (t, c) samples
    over_angle : (k, c) at equal angles over whole turns
    average : over these turns
    """

    time: Array
    names: tuple[str, ...]
    values: Array
    over_angle: Array
    average: TurnAverage


def sample_signals(
    system: LumpedSystem,
    response: Response,
    settings: Settings,
    sampling: Sampling,
    noise: float = 0.0,
    seed: int = 0,
) -> SampledSignals:
    """Signals of a motion that repeats, or of a ramp that begins with it.

    response : steady state at the speed, or at the start of the ramp
    settings : with which it settled
    noise : standard deviation of white noise over that of each signal; seed : of it
    Raises Diverged if the motion through a ramp has no bound.
    """
    time = sampling.time
    pieces = _pieces(system, response, settings, sampling)
    more = None
    if sampling.sensor is not None:
        more = partial(sampling.sensor.signals, ramp=sampling.ramp)
    factor, margin = sampling.refinement, 0
    if factor > 1:
        margin = FILTER_MARGIN
    samples = np.arange(-margin * factor, (time.size + margin) * factor)
    fine = samples / (factor * sampling.rate)
    computed, vibration = signals_of_pieces(pieces, fine, sampling.gear.index, more)
    inner = slice(margin, margin + time.size)
    clean = {n: every_sample(values, factor)[inner] for n, values in computed.items()}
    rotation = vibration[::factor][inner]
    signals = with_noise(clean, noise, seed)
    values = np.stack(list(signals.values()), axis=1)
    over_angle = sampling.over_angle(time, values, rotation)
    average, turns = synchronous_average(over_angle, sampling.points, sampling.points)
    average_over_turns = TurnAverage(average, turns, sampling.gear.orders)
    return SampledSignals(time, tuple(signals), values, over_angle, average_over_turns)


def every_sample(values: Array, factor: int) -> Array:
    """Each of so many samples of a signal (k,), without what is above half their rate.

    By a filter of zero phase, whose first and last values depend on the ends.
    """
    if factor == 1:
        return values
    from scipy.signal import resample_poly

    return np.asarray(resample_poly(values, 1, factor, padtype="mean"))


def _pieces(
    system: LumpedSystem, response: Response, settings: Settings, sampling: Sampling
) -> Iterable[CoordinateMotion]:
    """Motion of all coordinates, over the time after which it repeats or a ramp."""
    if not sampling.is_constant:
        return ramp_pieces(system, sampling.ramp, settings, response.state)
    frequency = sampling.ramp.start
    if not response.multiple:
        raise ValueError(f"the motion at {frequency:g} Hz must repeat")
    _, history = stepper_of(system, settings).record(
        response.state, Speed(frequency, settings), response.multiple, with_states=True
    )
    # round-off of the sum of the steps would add up over the periods
    period = response.multiple * system.common_period[0] / frequency
    history = replace(history, time=history.time * (period / history.time[-1]))
    steps = steps_per_period(system, frequency, settings)
    return [coordinate_motion(system, history, steps)]


def residual_indicators(
    average: TurnAverage, names: Sequence[str], engagements: SignalEngagements
) -> Mapping[str, Array]:
    """Indicators (c,) of the residuals of averages by name.

    names : of the signals, with their units
    engagements : of the teeth, in the mesh of the signal and others, by signals that
        tell of one tooth; `tooth` is the one that differs most while it is in contact,
        `tooth_rms` its root mean square; NaN of other signals, the tooth also where the
        residual is round-off
    """
    squares = average.residual**2
    is_rate = np.array([name.endswith(RATE_UNITS) for name in names])
    tooth, tooth_rms = np.full((2, len(names)), np.nan)
    # one call for all signals of an engagement
    for meshes in {id(e): e for e in engagements.values()}.values():
        chosen = [c for c, n in enumerate(names) if engagements.get(n) is meshes]
        residual = average.residual[:, chosen]
        if len(meshes) == 1:
            tooth[chosen], tooth_rms[chosen] = faulty_tooth(
                residual, is_rate[chosen], meshes[0]
            )
        else:
            for c in chosen:
                tooth[c], tooth_rms[c] = tooth_of_meshes(
                    average.residual[:, c], meshes, OTHER_MESH_WEIGHT
                )
    return {
        "residual_rms": np.sqrt(squares.mean(axis=0)),
        "residual_peak": average.peak,
        "residual_kurtosis": average.kurtosis,
        "tooth_rms": tooth_rms,
        "tooth": np.where(average.has_residual, tooth, np.nan),
    }
