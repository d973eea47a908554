"""Steady-state motion, independent of the integrator.

A stepper advances its state by common periods of all meshes and records them. This
driver integrates until the motion is steady, finds the period multiple, measures the
motion, repeats with finer steps if the motion is in doubt, and carries states from
speed to speed.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from lumped.common.array_types import Array
from lumped.steady.integration_settings import SteadySettings
from lumped.steady.measures import combine_windows, measure_motion
from lumped.steady.response import RESPONSE_QUANTITIES, History, Response, Status
from lumped.train.modes import MIN_FELT_ENERGY
from lumped.train.system import LumpedSystem

if TYPE_CHECKING:
    from lumped.kernels.arrays import Convergence

Callback = Callable[[float, int], None]  # (frequency [Hz], common periods passed there)
# Largest number of periods that a motion may take to settle
MAX_SETTLING_PERIODS = 200_000
MIN_COUPLED_PERIODS = 400  # least periods of the coupled model, whose slow motions leap
MIN_ROLLING_PERIODS = 200  # least periods on rolling bearings
MIN_WINDOWS = 4  # least number of windows for a long common period
WINDOW_PERIODS = 2_000  # most periods of the first mesh in more than MIN_WINDOWS
# Periods of the first mesh in a window on rolling bearings, and in all windows
ROLLING_WINDOW_PERIODS, ROLLING_PERIODS = 64, 256
# Cycles of the first mesh after which nothing repeats by chance
LONG_COMMON_PERIOD = 100
JUMP_RTOL = 0.25  # relative change of an RMS from speed to speed that may be a jump
# Relative change of the speed over which a period multiple persists
NEIGHBOUR_SPEED_RTOL = 0.02
RESPONSE_RTOL = 0.05  # relative difference below which two responses are equal


class Diverged(FloatingPointError):
    """Raised if a motion diverges.

    part : common periods passed since the last whole one
    """

    def __init__(self, periods: float) -> None:
        super().__init__("the motion diverged")
        self.part = periods


@dataclass(frozen=True)
class Speed:
    """Speed and settings at which a stepper continues.

    frequency : frequency of the first mesh [Hz]
    settings : settings of the stepper
    callback : function that may be called meanwhile with the common periods done
    """

    frequency: float
    settings: Any
    callback: Callable[[int], None] = lambda done: None

    def offset_by(self, passed: int) -> Speed:
        """Return the same speed, with periods counted after `passed` ones."""
        return replace(self, callback=lambda done: self.callback(passed + done))


class Stepper(Protocol):
    """Integrator of a gear train's motion; a state holds all it needs to continue.

    Settings hold step sizes. Methods return new states and raise Diverged.
    """

    @property
    def system(self) -> LumpedSystem:
        """Train that defines the meshes, the common period and the modes."""

    def start(self) -> Any:
        """Static equilibrium under the external torques."""

    def new_convergence(self, state: Any, settings: Any) -> Convergence:
        """Return the convergence check of a motion that starts from a state."""

    def advance(
        self, state: Any, speed: Speed, convergence: Convergence, max_periods: int
    ) -> tuple[Any, bool]:
        """Integrate one common period or more, at most `max_periods`.

        The method updates `convergence`. It also returns whether the motion has become
        periodic.
        """

    def record(self, state: Any, speed: Speed, periods: int) -> tuple[Any, History]:
        """Record the motion over common periods."""

    def change_speed(
        self, state: Any, start_frequency: float, end_frequency: float, settings: Any
    ) -> Any:
        """State at the start of a common period after a change of speed [Hz]."""

    def refined(self, frequency: float, settings: Any, repeats: bool) -> Any | None:
        """Settings of finer steps for a motion in doubt, None if there are none.

        repeats : whether the motion with those settings repeats itself
        """


def steady_state(
    stepper: Stepper,
    frequency: float,
    settings: SteadySettings,
    state: Any = None,
    previous_frequency: float | None = None,
    callback: Callback = lambda frequency, period: None,
) -> tuple[Response, Any]:
    """Settle at a frequency of the first mesh [Hz] and record the motion.

    A motion that does not repeat is measured over several windows, each of as many
    common periods as the largest multiple looked for and of one at least. The returned
    History is that of the last window, without points if the motion diverged.

    state : initial state, by default at rest under the external torques
    previous_frequency : frequency at which that state was reached [Hz]
    callback : function called during the motion; its exceptions end the run
    """
    if not 0.0 < frequency < math.inf:
        raise ValueError(f"frequency = {frequency:g}; must be positive and finite")
    system = stepper.system
    cycles_per_period = system.common_period[0]
    start_state = stepper.start() if state is None else state
    current_state, convergence = (
        start_state,
        stepper.new_convergence(start_state, settings),
    )
    try:
        if state is not None and previous_frequency is not None:
            current_state = stepper.change_speed(
                current_state, previous_frequency, frequency, settings
            )
            convergence = stepper.new_convergence(current_state, settings)
        speed = Speed(frequency, settings, partial(callback, frequency))
        current_state, multiple = _settle_motion(
            stepper, current_state, speed, convergence
        )
        periods = multiple or window_length(system, settings)
        window_periods = WINDOW_PERIODS if system.rolling is None else ROLLING_PERIODS
        windows = count_windows(
            settings.windows, periods * cycles_per_period, window_periods
        )
        n_windows = 1 if multiple else windows
        quantities: list[dict[str, Array]] = []
        for window_number in range(n_windows):
            offset_speed = speed.offset_by(convergence.period + window_number * periods)
            current_state, motion = stepper.record(current_state, offset_speed, periods)
            quantities.append(measure_motion(motion))
    except Diverged as error:
        time = (convergence.period + error.part) * cycles_per_period / frequency
        return diverged_response(system, frequency, time, start_state), empty_history(
            system
        )
    response = Response(
        frequency=frequency,
        status=Status.PERIODIC if multiple else Status.APERIODIC,
        multiple=multiple,
        period_multiple=multiple * np.array(system.common_period),
        settling_time=convergence.period * cycles_per_period / frequency,
        state=current_state,
        **combine_windows(quantities),
    )
    return response, motion


def _settle_motion(
    stepper: Stepper,
    state: Any,
    speed: Speed,
    convergence: Convergence,
) -> tuple[Any, int]:
    """State, and the common periods after which the motion repeats or 0."""
    max_periods = max_common_periods(stepper.system, speed.frequency, speed.settings)
    while convergence.period < max_periods:
        periods_left, offset_speed = (
            max_periods - convergence.period,
            speed.offset_by(convergence.period),
        )
        state, is_settled = stepper.advance(
            state, offset_speed, convergence, periods_left
        )
        speed.callback(convergence.period)
        if is_settled:
            return state, convergence.multiple
    return state, 0


def confirm_steady_state(
    stepper: Stepper,
    frequency: float,
    settings: SteadySettings,
    state: Any = None,
    previous_response: Response | None = None,
    callback: Callback = lambda frequency, period: None,
) -> tuple[Response, Any, Any]:
    """Return the result of `steady_state`, confirmed by finer steps if in doubt.

    Fixed steps move a fold by a tenth of a per cent and may turn a motion that repeats
    into one that does not. The same initial state is therefore integrated with finer
    steps, as long as the stepper has some, until two results agree, if the motion does
    not repeat, if its period multiple is not 1 and differs from that at the previous
    speed, or if the response is far from the previous one. For speeds further apart
    than NEIGHBOUR_SPEED_RTOL only the multiple counts: resonances change responses as
    much as jumps do, and in 190 such cases on the built-in gear sets finer steps
    changed one, by 2 %. A multiple that persists between speeds within
    NEIGHBOUR_SPEED_RTOL needs no finer steps: all but 2 of some 200 such motions were
    unchanged.

    Without a jump, a finer run of the coupled model continues from the end of the
    coarse one: a motion that leaves an unstable one slowly would take as long once
    more. On the built-in and 30 random gear sets all of some 60 periodic motions were
    the same either way. After a jump the run has the same initial state: which of
    several motions it reaches depends on the steps, as for the idler at 2900 Hz with a
    damping ratio of 0.01.

    previous_response : response at the previous speed, from which the state came
    Returns also the settings that the response and its history were computed with.
    """
    start_frequency = None if previous_response is None else previous_response.frequency
    solution = steady_state(
        stepper, frequency, settings, state, start_frequency, callback
    )
    while needs_refinement(solution[0], previous_response):
        coarse_response = solution[0]
        finer_settings = stepper.refined(
            frequency, settings, coarse_response.multiple > 0
        )
        if finer_settings is None:
            break
        settings = finer_settings
        if stepper.system.contacts is not None and not _is_jump(
            previous_response, coarse_response
        ):
            state, start_frequency = coarse_response.state, frequency
        solution = steady_state(
            stepper, frequency, settings, state, start_frequency, callback
        )
        if same_response(coarse_response, solution[0]):
            break
    return *solution, settings


def needs_refinement(response: Response, previous: Response | None) -> bool:
    """Whether a finer step might show another motion."""
    if response.status == Status.DIVERGED:
        return False
    if previous is None or response.multiple == 0:
        return response.multiple != 1
    is_near = abs(response.frequency / previous.frequency - 1.0) <= NEIGHBOUR_SPEED_RTOL
    keeps_multiple = response.multiple == previous.multiple and is_near
    if response.multiple != 1 and not keeps_multiple:
        return True
    return is_near and _is_jump(previous, response)


def _is_jump(previous: Response | None, response: Response) -> bool:
    return previous is not None and _relative_difference(previous, response) > JUMP_RTOL


def same_response(one: Response, two: Response) -> bool:
    """Whether two responses at one speed are the same motion."""
    return one.multiple == two.multiple and (
        one.multiple == 0 or _relative_difference(one, two) <= RESPONSE_RTOL
    )


def _relative_difference(one: Response, two: Response) -> float:
    """Largest relative difference of the RMS of a mesh; inf if one diverged."""
    larger_rms = np.maximum(one.dte_rms, two.dte_rms)
    difference = np.abs(one.dte_rms - two.dte_rms)
    relative_difference = np.divide(
        difference, larger_rms, np.zeros_like(larger_rms), where=larger_rms != 0.0
    )
    return (
        float(relative_difference.max())
        if np.isfinite(relative_difference).all()
        else np.inf
    )


def count_windows(max_windows: int, periods: int, total: int = WINDOW_PERIODS) -> int:
    """Number of windows of `periods` periods for a motion that does not repeat.

    total : most periods of more than MIN_WINDOWS windows
    """
    return min(max_windows, max(MIN_WINDOWS, total // periods))


def window_length(system: LumpedSystem, settings: SteadySettings) -> int:
    """Common periods of a window over which a motion that does not repeat is measured.

    On rolling bearings many elements pass in it.
    """
    periods = max(1, settings.multiples // system.repetitions)
    if system.rolling is None:
        return periods
    return max(periods, math.ceil(ROLLING_WINDOW_PERIODS / system.common_period[0]))


def mesh_mode_mask(system: LumpedSystem) -> NDArray[np.bool_]:
    """Mask (n,) of the modes that strain the meshes enough to matter."""
    return np.asarray(system.modes.mesh_energy.sum(axis=0) > MIN_FELT_ENERGY)


def max_common_periods(
    system: LumpedSystem, frequency: float, settings: SteadySettings
) -> int:
    """Common periods after which a motion counts as aperiodic."""
    allowed_periods = settings.max_periods or periods_to_settle(
        system, frequency, settings
    )
    return max(
        math.ceil(allowed_periods / system.common_period[0]), 4 * settings.multiples
    )


def periods_to_settle(
    system: LumpedSystem, frequency: float, settings: SteadySettings
) -> int:
    """Twice the periods in which modes that matter decay, within limits.

    The decay is from the range of deflection down to the tolerance.
    """
    least_periods = settings.min_periods
    if system.contacts is not None:
        least_periods = min(least_periods, MIN_COUPLED_PERIODS)
    elif system.rolling is not None:  # never repeats: decay alone matters
        least_periods = min(least_periods, MIN_ROLLING_PERIODS)
    # in space bearings feel every mode
    felt = mesh_mode_mask(system) if system.space is None else system.moving
    slowest_decay_rate = float(system.modes.angular[felt].min(initial=math.inf))
    slowest_decay_rate *= system.train.damping_ratio
    if not slowest_decay_rate > 0.0:
        return least_periods
    needed_periods = (
        2.0 * math.log(1.0 / settings.tolerance) * frequency / slowest_decay_rate
    )
    if needed_periods > 10.0 * MAX_SETTLING_PERIODS:  # decay this slow is ignored
        return least_periods
    return int(min(max(needed_periods, least_periods), MAX_SETTLING_PERIODS))


def diverged_response(
    system: LumpedSystem, frequency: float, time: float, state: Any
) -> Response:
    """Response of a motion that diverged after a time [s] from a state."""
    meshes = len(system.excitations)
    return Response(
        frequency=frequency,
        status=Status.DIVERGED,
        multiple=0,
        period_multiple=np.zeros(meshes, np.int64),
        settling_time=time,
        state=state,
        **{name: np.full(meshes, np.nan) for name in RESPONSE_QUANTITIES},
    )


def empty_history(system: LumpedSystem) -> History:
    empty = np.empty((0, len(system.excitations)))
    return History(np.empty(0), *[empty] * 6)


def new_convergence(
    shapes: Array,
    angular: Array,
    settings: SteadySettings,
    cycles: int = 1,
    forces: Array | None = None,
) -> Convergence:
    """Empty convergence check for coordinates (n,) with mesh deflections (m, n).

    cycles : cycles of the first mesh in a common period
    forces : of bearings (b, n), which must settle too, if any
    """
    from lumped.kernels.arrays import Convergence

    meshes = shapes.shape[0]
    if forces is not None:
        shapes = np.concatenate([shapes, forces])
    rows = shapes.shape[0]
    return Convergence(
        sections=np.zeros((2 * settings.multiples + 2, 2, angular.size)),
        shapes=shapes,
        angular=angular,
        tolerance=settings.tolerance,
        meshes=meshes,
        limits=np.zeros((2, rows)),
        error_bound=np.zeros(rows),
        scale=np.empty(rows),
        counts=np.zeros(3, np.int64),
        earlier_steps=settings.earlier_steps,
        accept_immediately=cycles >= LONG_COMMON_PERIOD,
    )
