"""Measured effect of the body modes that a coupled model leaves out.

The choice of modes is by a bound on the mesh compliance, which is none on amplitudes.
At some speeds the motion is therefore compared with that of all solved modes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from lumped.common.checks import require_fields
from lumped.steady.integration_settings import Settings
from lumped.steady.response import Response, Status
from lumped.steady.steady_state import steady_state
from lumped.steady.steppers import stepper_of
from lumped.train.system import LumpedSystem

MAX_SPEEDS = 4  # of a branch that are compared
Callback = Callable[[float, int], None]


@dataclass(frozen=True)
class TruncationCheck:
    """Largest relative change of a mesh's RMS with all solved body modes, at a speed.

    frequency : of the first mesh [Hz]
    error : infinite where the motion of all modes diverges
    """

    frequency: float
    error: float

    def __post_init__(self) -> None:
        require_fields(self, infinite=["error"])


def leaves_modes_out(system: LumpedSystem) -> bool:
    """Whether a system has fewer body modes than were solved."""
    contacts = system.contacts
    if contacts is None or contacts.solved_modes is None:
        return False
    return contacts.body_modes.count < contacts.solved_modes.count


def check_truncation(
    system: LumpedSystem,
    responses: Sequence[Response],
    settings: Settings,
    callback: Callback = lambda frequency, period: None,
) -> tuple[TruncationCheck, ...]:
    """Compare responses with those of all solved body modes, from the same states.

    Up to `MAX_SPEEDS` of those that repeat are compared, by rising speed: the one with
    the largest RMS of each mesh, and others at equal distances in the order in which
    they were passed.

    callback : as in `lumped.steady.steady_state.steady_state`
    """
    periodic = [
        response for response in responses if response.status == Status.PERIODIC
    ]
    if not periodic or not leaves_modes_out(system) or system.contacts is None:
        return ()
    full_system = replace(system, contacts=system.contacts.with_all_modes)
    stepper, checks = stepper_of(full_system, settings), []
    for response in _select_responses(periodic):
        state = full_system.state_from(system, response.state)
        full_response, _ = steady_state(
            stepper, response.frequency, settings, state, response.frequency, callback
        )
        change = np.abs(full_response.dte_rms / response.dte_rms - 1.0)
        error = (
            math.inf if full_response.status == Status.DIVERGED else float(change.max())
        )
        checks.append(TruncationCheck(response.frequency, error))
    return tuple(sorted(checks, key=lambda check: check.frequency))


def _select_responses(responses: Sequence[Response]) -> list[Response]:
    if len(responses) <= MAX_SPEEDS:
        return list(responses)
    rms = np.array([response.dte_rms for response in responses])
    indices = list(dict.fromkeys(rms.argmax(axis=0).tolist()))[:MAX_SPEEDS]
    even_indices = np.linspace(0, len(responses) - 1, MAX_SPEEDS + 2)[1:-1].round()
    for index in even_indices.astype(int).tolist():
        if len(indices) < MAX_SPEEDS and index not in indices:
            indices.append(index)
    return [responses[index] for index in indices]
