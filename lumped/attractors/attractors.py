"""What a motion has settled to: Poincaré section and largest Lyapunov exponent.

The section is taken once in each common period of the meshes. The exponent is the mean
rate at which small changes of the motion grow, carried with it along the same steps. A
motion that repeats has it from the multipliers of its own period.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from lumped.branches.motions import PeriodicProblem, SpeedFamily
from lumped.branches.periodic import has_half_period
from lumped.branches.points import branch_point
from lumped.common.array_types import Array
from lumped.common.checks import check_arguments, require_fields
from lumped.common.options import Range, documented, option
from lumped.continuation.arc_length import Continuation, NoSolution, StepControl
from lumped.steady.integration_settings import Settings
from lumped.steady.response import Response, Status
from lumped.steady.steady_state import Diverged, Speed
from lumped.steady.steppers import FixedStepper, allocate_record
from lumped.train.bodies import TrainError
from lumped.train.system import LumpedSystem

# Periods of the first mesh in which a change turns to what grows most
ALIGNMENT_PERIODS = 128
PERIODS_PER_STRETCH = 1024  # periods of the first mesh between looks at the exponent
MAX_PERIODS = 4 * PERIODS_PER_STRETCH  # after which it is left as it is
WINDOWS = 16  # of which its standard error is taken
MIN_Z = 5.0  # standard errors beyond which the sign of an exponent is certain
MAX_NEUTRAL_EXPONENT = 1e-3  # per period, below which changes do not grow
MIN_DECAY_RATE = 1e-4  # per period, beyond which they shrink
# Steps per period along which multipliers of short motions are taken
FINE_STEPS = 1024
MAX_FINE_PERIODS = 64  # periods of the first mesh in the longest short motion
HARMONICS = 20  # of the first mesh, of motions that harmonic balance confirms,
MAX_HARMONICS = 200  # which take up to some 0.1 s each
RMS_RTOL = 0.02  # of the RMS, between both
CLOSING_PERIODS = 16  # times the motion's period in which it closes on those steps


class Kind(StrEnum):
    """Kind of a steady-state motion, by its exponent where it does not repeat.

    NOT_CONVERGED : changes shrink, so that it still settles or repeats after more
        periods than were looked for
    """

    PERIODIC = "periodic"
    QUASI_PERIODIC = "quasi-periodic"
    CHAOTIC = "chaotic"
    NOT_CONVERGED = "not converged"
    DIVERGED = "diverged"


@documented
@dataclass(frozen=True, kw_only=True)
class SectionSettings:
    """How attractors are looked at."""

    sections: int = option(
        100,
        "Points of the Poincaré section of an aperiodic motion, one in each common "
        "period of all meshes.",
        Range(1, 10_000),
    )

    def __post_init__(self) -> None:
        require_fields(self)


@dataclass(frozen=True, eq=False)
class Attractor:
    """Attractor of a motion with m meshes; all values are NaN where it diverged.

    Attributes
    ----------
    multiple : int
        Number of common periods after which the motion repeats, 0 if it does not.
    deflection : (k, m) array
        Dynamic transmission error at the start of successive common periods [m]; of a
        motion that repeats, all that differ.
    rate : (k, m) array
        Its rate at the same times [m/s].
    exponent : float
        Largest Lyapunov exponent, per period of the first mesh.
    stderr : float
        Standard error of the exponent; 0 where the motion repeats.
    """

    multiple: int
    deflection: Array
    rate: Array
    exponent: float
    stderr: float

    @property
    def name(self) -> str:
        """`period 2`, or the kind of a motion that does not repeat."""
        return f"period {self.multiple}" if self.multiple else str(self.kind)

    @property
    def kind(self) -> Kind:
        """Kind of the motion, by its exponent where it does not repeat."""
        if self.multiple:
            return Kind.PERIODIC
        if not math.isfinite(self.exponent):
            return Kind.DIVERGED
        is_certain = abs(self.exponent) > MIN_Z * self.stderr
        if self.exponent < 0.0:
            is_decaying = is_certain and self.exponent < -MIN_DECAY_RATE
            return Kind.NOT_CONVERGED if is_decaying else Kind.QUASI_PERIODIC
        is_growing = is_certain and self.exponent > MAX_NEUTRAL_EXPONENT
        return Kind.CHAOTIC if is_growing else Kind.QUASI_PERIODIC


@check_arguments
def find_attractor(
    system: LumpedSystem,
    response: Response,
    settings: Settings,
    sections: SectionSettings | None = None,
    callback: Callable[[int], None] = lambda done: None,
) -> Attractor:
    """The attractor on which a response ends, by fixed steps.

    Parameters
    ----------
    system : LumpedSystem
        System without friction.
    response : Response
        Steady state of the system.
    settings : Settings
        Settings of the response's steps.
    sections : SectionSettings, optional
        Number of points of the Poincaré section of an aperiodic motion.
    callback : callable, optional
        Function called with the number of common periods done; an exception that it
        raises ends the work.

    Returns
    -------
    Attractor
        Poincaré section, and largest Lyapunov exponent.

    Raises
    ------
    TrainError
        If teeth have friction.
    ValueError
        If an argument is not of its type.
    """
    sections = sections or SectionSettings()
    if system.has_friction:
        raise TrainError("friction must be 0; changes of a motion leave it out")
    if response.status == Status.DIVERGED:
        return _attractor_of_diverged(system)
    speed = Speed(response.frequency, settings)
    try:
        if response.multiple:
            return _attractor_of_repeating(system, response, speed)
        return _attractor_of_aperiodic(
            system, response, speed, sections.sections, callback
        )
    except Diverged:
        return _attractor_of_diverged(system)


def _attractor_of_diverged(system: LumpedSystem) -> Attractor:
    no_points = np.empty((0, len(system.excitations)))
    return Attractor(0, no_points, no_points, math.nan, math.nan)


@dataclass(frozen=True, eq=False)
class _TangentFlow:
    """Along which changes are carried with a motion, in common periods."""

    system: LumpedSystem
    at: Speed

    @property
    def angular(self) -> Array:
        """Angular frequencies by which velocities are scaled (n,) [rad/s]."""
        return self.system.angular

    def integrate_variations(
        self, state: Array, periods: int
    ) -> tuple[Array, Array, Array]:
        """Deflections and rates (periods, m) at the start of each, and how much changes
        grow in it as a logarithm (periods,); the state (2, n (1 + k)) moves on."""
        rows, growth = allocate_record(self.system, periods), np.empty(periods)
        FixedStepper(self.system).integrate_variations(state, self.at, rows, growth)
        return rows[:, 0], rows[:, 1], growth


def _attractor_of_repeating(
    system: LumpedSystem, response: Response, speed: Speed
) -> Attractor:
    """Attractor by harmonic balance where that confirms the motion, otherwise along
    fine steps.

    Next to a contact that is only just met, steps of the integration that it falls
    into make a motion seem to repeat later than it does, and to be unstable.
    """
    if not np.isfinite(response.state).all():
        raise Diverged(0.0)
    multiple_and_exponent = _by_harmonic_balance(system, response, speed.settings)
    if multiple_and_exponent is None:
        return _by_monodromy(system, response, speed)
    multiple, exponent = multiple_and_exponent
    state = np.concatenate([response.state, np.ones_like(response.state)], axis=1)
    deflection, rate, _ = _TangentFlow(system, speed).integrate_variations(
        state, multiple
    )
    return Attractor(multiple, deflection, rate, exponent, 0.0)


def _by_harmonic_balance(
    system: LumpedSystem, response: Response, settings: Settings
) -> tuple[int, float] | None:
    """Common periods after which a motion repeats, and its exponent; None where
    harmonic balance finds no stable motion there or takes too long, and for the coupled
    model."""
    multiple, cycles_per_period = response.multiple, system.common_period[0]
    size = float(np.abs(system.static_deflection).max())
    if (
        size == 0.0
        or system.contacts is not None
        or multiple * cycles_per_period * HARMONICS > MAX_HARMONICS
    ):
        return None
    while True:
        motions = PeriodicProblem(SpeedFamily(system), HARMONICS, multiple)
        branch: Continuation[PeriodicProblem] = Continuation(
            motions, StepControl(size=size, unit=1000.0)
        )
        balance = motions.at(response.frequency)[0]
        try:
            x = balance.of_response(response, settings)
            point = branch.at(x, response.frequency)
        except (NoSolution, ArithmeticError):
            return None
        if not has_half_period(branch, point):
            break
        multiple //= 2
    orbit = branch_point(motions, point)
    rms_error = np.abs(orbit.figures["dte_rms"] - response.dte_rms).max()
    if rms_error > RMS_RTOL * response.dte_rms.max() or not orbit.stable:
        return None
    return multiple, math.log(orbit.largest) / (multiple * cycles_per_period)


def _by_monodromy(system: LumpedSystem, response: Response, speed: Speed) -> Attractor:
    """Changes of every coordinate and velocity together are the monodromy.

    A spring that opens within a step leaves an error in it of the order of the step,
    which a motion that does not repeat averages out: this one takes finer steps.
    """
    state, periods = np.array(response.state), response.multiple
    length = periods * system.common_period[0]
    fine = fine_settings(system, speed.settings, length)
    if fine != speed.settings:
        speed = replace(speed, settings=fine)
        varied = np.concatenate([state, np.ones_like(state)], axis=1)
        _TangentFlow(system, speed).integrate_variations(
            varied, CLOSING_PERIODS * periods
        )
        state = varied[:, : state.shape[1]]
    varied = np.concatenate([state, np.ones_like(state)], axis=1)
    deflection, rate, _ = _TangentFlow(system, speed).integrate_variations(
        varied, periods
    )
    _, scaled, growth = FixedStepper(system).scaled_monodromy(state, speed, periods)
    exponent = growth + math.log(np.abs(np.linalg.eigvals(scaled)).max())
    return Attractor(response.multiple, deflection, rate, exponent / length, 0.0)


def fine_settings(system: LumpedSystem, settings: Settings, length: int) -> Settings:
    """Settings of fine steps, for springs that open within them and short motions.

    length : periods of the first mesh after which the motion repeats
    """
    contacts = system.contacts is not None
    if (
        contacts
        or length > MAX_FINE_PERIODS
        or settings.min_steps(contacts) >= FINE_STEPS
    ):
        return settings
    return replace(settings, steps=FINE_STEPS)


def _attractor_of_aperiodic(
    system: LumpedSystem,
    response: Response,
    speed: Speed,
    sections: int,
    callback: Callable[[int], None],
) -> Attractor:
    """One change, until the sign of its growth is certain or it took long enough."""
    flow, length = _TangentFlow(system, speed), system.common_period[0]
    changed = np.full((2, flow.angular.size), 1.0)  # which no mode leaves out
    changed[1] *= flow.angular
    state = np.concatenate([response.state, changed], axis=1)
    flow.integrate_variations(state, math.ceil(ALIGNMENT_PERIODS / length))
    stretch = max(sections, WINDOWS, math.ceil(PERIODS_PER_STRETCH / length))
    deflection, rate, growth = flow.integrate_variations(state, stretch)
    while True:
        windows = np.array([part.mean() for part in np.array_split(growth, WINDOWS)])
        exponent, spread = growth.mean(), windows.std(ddof=1) / math.sqrt(WINDOWS)
        certain = abs(exponent) > max(MIN_Z * spread, MAX_NEUTRAL_EXPONENT * length)
        if (
            certain
            or not math.isfinite(exponent)
            or growth.size * length >= MAX_PERIODS
        ):
            break
        callback(growth.size)
        growth = np.concatenate([growth, flow.integrate_variations(state, stretch)[2]])
    return Attractor(
        multiple=0,
        deflection=deflection[:sections].copy(),
        rate=rate[:sections].copy(),
        exponent=float(exponent / length),
        stderr=float(spread / length),
    )
