"""Motion of a train whose speed rises or falls steadily.

The rotation of the gears is prescribed: the position of every mesh in its cycle is the
integral of a frequency that is linear in time. Vibration follows the equations of
constant speed with this position. What accelerates the gears as a whole is a torque in
addition to the loads, which takes up the inertial forces of the mean acceleration, so
that the meshes carry the loads alone.

Steps are equal in the angle and end on the corners of the excitation at the times at
which the ramp reaches these angles. Within a step the angle is linear in time, which
is off by the rate of the frequency times the square of the step over 8 at most, in
cycles. The coupled model has a constant speed within a cycle of the first mesh.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lumped.common.array_types import Array
from lumped.common.checks import require_fields, require_present
from lumped.common.options import Range, option
from lumped.kernels.arrays import CoupledSystem, SpaceSamples
from lumped.steady.integration_settings import Settings
from lumped.steady.response import History
from lumped.steady.steady_state import Diverged
from lumped.steady.steppers import FixedStepper, steps_per_period
from lumped.train.system import LumpedSystem

# Fields of CoupledSteps that a cycle takes over from the one before it
WORKSPACE = "penetration", "ratio", "load", "continues", "force", "problem"
# Fields of Contacts with a column for each of the cycles after which teeth repeat
BY_CYCLE = "errors", "curve_rows", "gap_rows"
STEPS_PER_BLOCK = 4096  # of models 1 to 3, or a common period if more
FREQUENCY = Range(above=0.0, below=1e9, unit="Hz")


@dataclass(frozen=True, kw_only=True)
class SpeedRamp:
    """Frequency of the first mesh that is linear in time.

    Parameters
    ----------
    start, end : float
        Frequency of the first mesh at the start and at the end [Hz], positive.
    duration : float
        Time between them [s], positive.

    Raises
    ------
    ValueError
        If a value is not of its type or not allowed.
    """

    start: float = option(100.0, "Frequency at the start [Hz].", FREQUENCY)
    end: float = option(200.0, "Frequency at the end [Hz].", FREQUENCY)
    duration: float = option(1.0, "Duration [s].", Range(above=0.0, below=1e9))

    def __post_init__(self) -> None:
        require_fields(self)

    @property
    def rate(self) -> float:
        """Rate of the frequency [Hz/s]."""
        return (self.end - self.start) / self.duration

    @property
    def cycles(self) -> float:
        """Cycles of the first mesh from the start to the end."""
        return 0.5 * (self.start + self.end) * self.duration

    def frequency_at(self, time: Array) -> Array:
        """Frequency [Hz] at times [s]."""
        return np.asarray(self.start + self.rate * time)

    def cycles_at(self, time: Array) -> Array:
        """Cycles from the start at times [s]."""
        return np.asarray(time * (self.start + 0.5 * self.rate * time))

    def time_at(self, cycles: Array) -> Array:
        """Times [s] at cycles from the start, NaN beyond the speed 0."""
        squares = self.start**2 + 2.0 * self.rate * cycles
        root = np.sqrt(np.where(squares < 0.0, np.nan, squares))
        return np.asarray(2.0 * cycles / (self.start + root))


def ramp_motion(
    system: LumpedSystem, ramp: SpeedRamp, settings: Settings, state: Array
) -> Iterator[tuple[History, int]]:
    """Motion through a ramp, piece by piece.

    Parameters
    ----------
    system : LumpedSystem
        Train on linear bearings, without tooth friction.
    ramp : SpeedRamp
        Speed over time.
    settings : Settings
        Numerical settings; steps are fixed.
    state : (2, n) array
        State at the start of a common period, as of a steady state.

    Yields
    ------
    history : History
        Motion with states from the end of the previous piece on; the last piece goes up
        to a step beyond the ramp, or a cycle of the first mesh with the coupled model.
    steps : int
        Steps per period of the first mesh.

    Raises
    ------
    Diverged
        If the motion has no bound.
    ValueError
        If the system has tooth friction.
    TrainError
        If the system has rolling bearings, or a common period exceeds the memory.
    """
    if system.has_friction:
        raise ValueError("system must be without friction")
    system.require_linear_bearings("a ramp of the speed")
    steps = steps_per_period(system, min(ramp.start, ramp.end), settings)
    pieces = _springs if system.contacts is None else _coupled
    stepper, now, begin = FixedStepper(system), np.array(state), 0.0
    for time, arrays, piece in pieces(system, ramp, steps):
        try:
            history = stepper.record_steps(arrays, piece, 1, now, with_states=True)
        except Diverged as error:
            raise Diverged(begin) from error
        begin = float(time[-1])
        yield replace(history, time=time), steps


def _springs(
    system: LumpedSystem, ramp: SpeedRamp, steps: int
) -> Iterator[tuple[Array, Any, Any]]:
    """Times, arrays and steps of each piece of models 1 to 3."""
    samples = system.samples(steps)
    rounds = max(1, STEPS_PER_BLOCK // samples.h.size)
    edges = np.concatenate([[0.0], np.cumsum(np.tile(samples.h, rounds))])
    edges[:: samples.h.size] = system.common_period[0] * np.arange(rounds + 1)
    varying = {
        name: np.tile(getattr(samples, name), (rounds, 1, 1))
        for name in ("stiffness", "gap", "place")
        if hasattr(samples, name)
    }
    begin = 0.0
    while begin < ramp.cycles:
        count = int(np.searchsorted(edges, ramp.cycles - begin))
        count = min(max(count, 1), edges.size - 1)
        time = _times(ramp, begin + edges[: count + 1])
        excitation = {name: values[:count] for name, values in varying.items()}
        piece = samples._replace(h=np.diff(time), **excitation)
        if isinstance(piece, SpaceSamples):  # moments of the mean speed of the piece
            frequency = float(ramp.frequency_at(0.5 * (time[0] + time[-1])))
            piece = piece._replace(velocity_forces=system.velocity_forces(frequency))
        yield time, system.arrays, piece
        begin += float(edges[-1])


def _coupled(
    system: LumpedSystem, ramp: SpeedRamp, steps: int
) -> Iterator[tuple[Array, Any, Any]]:
    """Times, arrays and steps of each cycle of the first mesh of the coupled model."""
    arrays = require_present(system.coupled_arrays, "contacts")
    periods = np.array(system.train.common_period)
    workspace = dict[str, Any]()
    for number in range(math.ceil(ramp.cycles)):
        ends = _times(ramp, np.array([number, number + 1.0]))
        frequency = float(1.0 / (ends[1] - ends[0]))
        rounds, cycle = divmod(number, int(periods[0]))
        piece = system.coupled_cycle(steps, frequency, cycle)._replace(**workspace)
        piece.continues[0] = number > 0
        workspace = {name: getattr(piece, name) for name in WORKSPACE}
        time = np.linspace(ends[0], ends[1], piece.h.size + 1)
        yield time, _after_cycles(arrays, rounds * periods), piece


def _times(ramp: SpeedRamp, cycles: Array) -> Array:
    """Times [s] at cycles, the last one that of a ramp that then stands still."""
    time = ramp.time_at(cycles)
    time[-1] = np.where(np.isnan(time[-1]), ramp.duration, time[-1])
    return time


def _after_cycles(system: CoupledSystem, cycles: NDArray[np.int64]) -> CoupledSystem:
    """The coupled model with the teeth that meet after cycles (m,) of meshes."""
    contacts, of_contact = system.contacts, cycles[system.mesh_of]
    later = {}
    for name in BY_CYCLE:
        table = getattr(contacts, name)
        if table.size:
            rows = zip(table, of_contact, strict=True)
            later[name] = np.array([np.roll(row, -n) for row, n in rows])
    return system._replace(contacts=contacts._replace(**later))
