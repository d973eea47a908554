"""Signals of sensors on a train, of a motion that repeats."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lumped.steady.motion import resample
from lumped.steady.response import History
from lumped.train.system import LumpedSystem

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

Array = NDArray[np.float64]
OVERLAP = 16  # steps of the periods before and after that a spline takes into account
PERIOD_RTOL = 1e-9  # of a time that is that of the start, by round-off
OVERSAMPLING = 4  # equal steps of a period over those of its history, at least


@dataclass(frozen=True, eq=False)
class CoordinateMotion:
    """Motion of all coordinates of a train that repeats, from its mesh forces.

    Each mode is a linear oscillator under the mesh forces of the history, so that its
    motion follows line by line from theirs. The history's own deflections, which the
    integration gives, serve as a check.

    Parameters
    ----------
    system : LumpedSystem
        Train of models 1 to 3 on linear bearings, without friction.
    history : History
        Motion over the time after which it repeats.
    """

    system: LumpedSystem
    history: History

    def __post_init__(self) -> None:
        if self.system.contacts is not None or self.system.has_friction:
            raise ValueError("system must be of models 1 to 3 without friction")
        self.system.require_linear_bearings("signals")

    @property
    def period(self) -> float:
        """Time after which the motion repeats [s]."""
        return float(self.history.time[-1] - self.history.time[0])

    def at(self, time: Array) -> tuple[Array, Array]:
        """Displacements and velocities (k, n) of all coordinates at times (k,).

        Rigid rotation of the train is not part of them.
        """
        return self.displacement(time), self.velocity(time)

    def displacement(self, time: Array) -> Array:
        """Displacements (k, n) of all coordinates at times (k,)."""
        return np.asarray(self._spline(self._mode_lines)(self._within(time)))

    def velocity(self, time: Array) -> Array:
        """Velocities (k, n) of all coordinates at times (k,)."""
        rates = 1j * self._angular * self._mode_lines
        return np.asarray(self._spline(rates)(self._within(time)))

    def deflection(self, time: Array) -> Array:
        """Transmission errors (k, m) of the history at times (k,) [m]."""
        start = self.history.time[0]
        deflection: Array = resample(self.history, start + self._within(time))[0]
        return deflection

    def _within(self, time: Array) -> Array:
        """Times (k,) within the first period, 0 where round-off is short of its end.

        The motion ends where it starts only to the tolerance of the steady state: a
        sample at the end in one period alone would look like a tooth that differs.
        """
        place: Array = np.mod(time, self.period)
        place[self.period - place < PERIOD_RTOL * self.period] = 0.0
        return place

    @property
    def _angular(self) -> Array:
        """Angular frequencies (l, 1) of the lines [rad/s]."""
        orders = np.arange(self._equal_steps // 2 + 1)[:, None]
        return np.asarray(2.0 * math.pi * orders / self.period, float)

    @cached_property
    def _mode_lines(self) -> NDArray[np.complex128]:
        """Lines (l, v) of the displacements of the modes that vibrate."""
        modes, angular = self.system.modes, self._angular
        vibrates = modes.frequency_Hz > 0.0
        natural, shapes = modes.angular[vibrates], modes.shapes[:, vibrates]
        forces = self._excess_lines(self._equal_steps)
        lines = forces @ modes.mesh_shapes[:, vibrates]
        lines[0] += shapes.T @ modes.coordinates.load
        damping = 2j * self.system.train.damping_ratio * natural * angular
        return np.asarray(lines / (natural**2 - angular**2 + damping))

    def _spline(self, lines: NDArray[np.complex128]) -> CubicSpline:
        """Coordinates (n,) over a period, from the lines of the vibrating modes."""
        from scipy.interpolate import CubicSpline

        modes, steps = self.system.modes, self._equal_steps
        shapes = modes.shapes[:, modes.frequency_Hz > 0.0]
        values = lines.copy()
        values[-1] = 0.0  # of a line at half the sampling rate the phase is lost
        wave = steps * np.fft.irfft(values, steps, axis=0) @ shapes.T
        wave = np.concatenate([wave, wave[:1]])
        time = np.linspace(0.0, self.period, steps + 1)
        return CubicSpline(time, wave, bc_type="periodic")

    @property
    def _equal_steps(self) -> int:
        """Equal steps in a period, an even number.

        They are as many in every cycle of each mesh: the small errors of sampling then
        repeat in all cycles, and do not look like teeth that differ.
        """
        needed = OVERSAMPLING * self.history.time.size
        cycles = self.system.common_period
        total = math.lcm(*cycles)
        if total > needed:  # of meshes whose frequencies have hardly a common period
            total = cycles[0]
        return 2 * total * math.ceil(0.5 * needed / total)

    def _excess_lines(self, steps: int) -> Array:
        """Lines (steps // 2 + 1, m) of forces of mean stiffnesses less mesh forces.

        Stiffnesses jump where pairs engage. The integral has no jumps, and its
        differences over equal steps are the means within them, of which the lines
        follow without the error of samples at jumps.
        """
        from scipy.interpolate import CubicSpline

        history = self.history
        time = history.time - history.time[0]
        jump = history.force_before - history.force
        jump[0] = 0.0
        level = np.cumsum(jump, axis=0)  # from every time to the next
        excess = self.system.modes.mean_stiffness * history.deflection - history.force
        smooth = CubicSpline(*_continued(time, excess - level)).antiderivative()
        duration = np.diff(time)[:, None]
        area = np.concatenate(
            [np.zeros_like(level[:1]), np.cumsum(level[:-1] * duration, axis=0)]
        )
        ends = np.linspace(0.0, time[-1], steps + 1)
        of_jumps = [np.interp(ends, time, column) for column in area.T]
        integral = smooth(ends) + np.stack(of_jumps, axis=1)
        means = np.diff(integral, axis=0) * (steps / time[-1])
        phase = 2.0 * math.pi * np.arange(steps // 2 + 1) / steps
        kernel = np.ones(phase.size, complex)
        kernel[1:] = (np.exp(1j * phase[1:]) - 1.0) / (1j * phase[1:])
        return np.fft.rfft(means, axis=0) / (steps * kernel[:, None])


def _continued(time: Array, values: Array) -> tuple[Array, Array]:
    """Times and values with those of the periods before and after near the ends.

    values : (t, m) that change by the same amount in every period
    """
    near, period, change = slice(1, 1 + OVERLAP), time[-1], values[-1] - values[0]
    last = slice(-1 - OVERLAP, -1)
    times = time[last] - period, time, time[near] + period
    parts = values[last] - change, values, values[near] + change
    return np.concatenate(times), np.concatenate(parts)


def signal_names(system: LumpedSystem) -> tuple[str, ...]:
    """Names of the signals of a train, with units at their ends."""
    train = system.train
    gears = [train.gears[number].name for number in _turning_gears(system)]
    borne = [train.gears[number].name for number in _borne_gears(system)]
    return (
        *(f"mesh{number}_dte_m" for number in range(1, 1 + len(train.meshes))),
        *(f"{name}_speed_deviation_rad_per_s" for name in gears),
        *(f"{name}_bearing_{axis}_N" for name in borne for axis in "xy"),
    )


def _turning_gears(system: LumpedSystem) -> list[int]:
    indices = system.modes.coordinates.indices
    numbers = range(len(system.train.gears))
    return [number for number in numbers if (number, "rotation") in indices]


def _borne_gears(system: LumpedSystem) -> list[int]:
    """Gears on bearings that can move."""
    indices = system.modes.coordinates.indices
    return [
        number
        for number, gear in enumerate(system.train.gears)
        if gear.bearing_stiffness is not None and (number, "x") in indices
    ]


def sensor_signals(motion: CoordinateMotion, time: Array) -> Mapping[str, Array]:
    """Signals (k,) at times (k,) by name, with units at the ends of the names.

    Transmission error of every mesh; deviation of the angular speed of every gear that
    can rotate from its nominal one, positive where the gear is faster; forces of gears
    on bearings that can move, along x and y.
    """
    system = motion.system
    train, indices = system.train, system.modes.coordinates.indices
    signals, velocity = list(motion.deflection(time).T), motion.velocity(time)
    for number in _turning_gears(system):
        deviation = velocity[:, indices[number, "rotation"]]
        signals.append(train.sense(number) * deviation)
    borne = _borne_gears(system)
    displacement = motion.displacement(time) if borne else np.empty((len(time), 0))
    for number in borne:
        gear = train.gears[number]
        center = displacement[:, [indices[number, axis] for axis in "xy"]]
        cosine, sine = (f(gear.bearing_direction) for f in (math.cos, math.sin))
        axes = np.array([[cosine, -sine], [sine, cosine]])  # columns: directions
        force = (center @ axes * np.array(gear.bearing_stiffness)) @ axes.T
        signals.extend(force.T)
    return dict(zip(signal_names(system), signals, strict=True))


def with_noise(
    signals: Mapping[str, Array], part: float, seed: int
) -> dict[str, Array]:
    """Signals with white Gaussian noise.

    part : its standard deviation over that of each signal
    seed : of the random numbers
    """
    if part == 0.0:
        return dict(signals)
    random = np.random.default_rng(seed)
    return {
        name: values + part * values.std() * random.standard_normal(values.size)
        for name, values in signals.items()
    }
