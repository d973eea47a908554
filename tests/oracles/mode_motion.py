"""Motion of the coordinates of a train that repeats, from its mesh forces."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from lumped.common.array_types import Array
from lumped.steady.motion import resample
from lumped.steady.response import History
from lumped.train.system import LumpedSystem

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

OVERLAP = 16  # steps of the periods before and after that a spline takes into account
OVERSAMPLING = 4  # equal steps of a period over those of its history, at least


@dataclass(frozen=True, eq=False)
class LinearModeMotion:
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
        place = np.mod(time, self.period)
        displacement, velocity = self._splines
        return displacement(place), velocity(place)

    def deflection(self, time: Array) -> Array:
        """Transmission errors (k, m) of the history at times (k,) [m]."""
        start = self.history.time[0]
        return resample(self.history, start + np.mod(time, self.period))[0]

    @cached_property
    def _splines(self) -> tuple[CubicSpline, CubicSpline]:
        from scipy.interpolate import CubicSpline

        steps = self._equal_steps
        time = np.linspace(0.0, self.period, steps + 1)
        modes = self.system.modes
        vibrates = modes.frequency_Hz > 0.0
        natural, shapes = modes.angular[vibrates], modes.shapes[:, vibrates]
        angular = 2.0 * math.pi * np.arange(steps // 2 + 1)[:, None] / self.period
        lines = self._excess_lines(steps) @ modes.mesh_shapes[:, vibrates]
        lines[0] += shapes.T @ modes.coordinates.load
        damping = 2j * self.system.train.damping_ratio * natural * angular
        lines = lines / (natural**2 - angular**2 + damping)
        pair = []
        for values in (lines, 1j * angular * lines):
            values[-1] = 0.0  # of a line at half the sampling rate the phase is lost
            wave = steps * np.fft.irfft(values, steps, axis=0) @ shapes.T
            wave = np.concatenate([wave, wave[:1]])
            pair.append(CubicSpline(time, wave, bc_type="periodic"))
        return pair[0], pair[1]

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
