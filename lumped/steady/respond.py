"""Response of a lumped system at one mesh frequency."""

from __future__ import annotations

import numpy as np

from lumped.common.array_types import Array
from lumped.common.checks import check_arguments
from lumped.steady.integration_settings import Settings
from lumped.steady.response import History, Response
from lumped.steady.steady_state import Callback, confirm_steady_state, steady_state
from lumped.steady.steppers import stepper_of
from lumped.train.system import LumpedSystem


@check_arguments
def respond(
    system: LumpedSystem,
    frequency: float,
    settings: Settings | None = None,
    state: Array | None = None,
) -> Response:
    """Settle at a frequency of the first mesh [Hz] and measure the steady state.

    Parameters
    ----------
    system : LumpedSystem
        System to solve.
    frequency : float
        Frequency of the first mesh [Hz], positive.
    settings : Settings, optional
        Numerical settings.
    state : (2, n) array, optional
        Modal displacements and velocities at the start; at rest under the external
        torques unless given.

    Returns
    -------
    Response
        Steady state; its status tells whether the motion repeats.

    Raises
    ------
    TrainError
        If a common period exceeds the memory allowed.
    ValueError
        If an argument is not of its type or shape, the frequency is not positive or the
        method does not fit the system.
    """
    return respond_with_history(system, frequency, settings, state)[0]


@check_arguments
def respond_with_history(
    system: LumpedSystem,
    frequency: float,
    settings: Settings | None = None,
    state: Array | None = None,
) -> tuple[Response, History]:
    """Settle and measure as `respond`, and also return the motion.

    Parameters
    ----------
    system : LumpedSystem
        System to solve.
    frequency : float
        Frequency of the first mesh [Hz], positive.
    settings : Settings, optional
        Numerical settings.
    state : (2, n) array, optional
        Modal displacements and velocities at the start; at rest under the external
        torques unless given.

    Returns
    -------
    response : Response
        Steady state; its status tells whether the motion repeats.
    history : History
        Motion over the common periods that were measured last, without points if it
        diverged.

    Raises
    ------
    TrainError
        If a common period exceeds the memory allowed.
    ValueError
        If an argument is not of its type or shape, the frequency is not positive or the
        method does not fit the system.
    """
    settings = settings or Settings()
    start = _validate_state(system, state)
    return steady_state(stepper_of(system, settings), frequency, settings, start)


def respond_confirmed(
    system: LumpedSystem,
    frequency: float,
    settings: Settings | None = None,
    state: Array | None = None,
    previous_response: Response | None = None,
    callback: Callback = lambda frequency, period: None,
) -> tuple[Response, History, Settings]:
    """Return the result of `respond_with_history` after a check by finer steps, see
    `confirm_steady_state`."""
    settings = settings or Settings()
    start = _validate_state(system, state)
    stepper = stepper_of(system, settings)
    return confirm_steady_state(
        stepper, frequency, settings, start, previous_response, callback
    )


def _validate_state(system: LumpedSystem, state: Array | None) -> Array | None:
    if state is None:
        return None
    start, expected_shape = np.asarray(state, float), system.static_state.shape
    if start.shape != expected_shape:
        raise ValueError(f"shape of state = {start.shape}; must be {expected_shape}")
    return start
