"""Responses that do not hang on the step: finer steps where the motion is in doubt.

Fixed steps move a fold by a tenth of a per cent and may turn a motion that repeats into
one that does not. Where the period multiple is not 1, or the response is far from that
at the speed before, the same start is integrated with half the step until two agree, or
until memory would not hold the steps.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lumped.response import (
    History,
    Response,
    Status,
    respond_with_history,
    steps_per_period,
)
from lumped.settings import Settings
from lumped.system import LumpedSystem

Array = NDArray[np.float64]
FINEST = 512  # steps per period, beyond which nothing hangs on them
LEAP = 0.25  # relative change of an RMS from speed to speed that may be a jump
ALIKE = 0.05  # relative difference of two responses that are one


def respond_confirmed(
    system: LumpedSystem,
    frequency: float,
    settings: Settings | None = None,
    state: Array | None = None,
    before: Response | None = None,
) -> tuple[Response, History, Settings]:
    """As `respond_with_history`, confirmed by finer steps where it is in doubt.

    before : the response at the speed before, from which the state came
    Returns the settings as well whose steps the response and its history have.
    """
    settings = settings or Settings()
    found = respond_with_history(system, frequency, settings, state)
    while settings.method == "rk4" and settings.steps < FINEST:
        coarse = found[0]
        if not doubtful(coarse, before):
            break
        # what does not repeat may do so on the finest steps alone
        finer = 2 * settings.steps if coarse.multiple else FINEST
        fine = replace(settings, steps=min(finer, FINEST))
        if not system.holds(steps_per_period(system, frequency, fine)):
            break
        settings = fine
        found = respond_with_history(system, frequency, settings, state)
        if alike(coarse, found[0]):
            break
    return *found, settings


def doubtful(response: Response, before: Response | None) -> bool:
    """Whether a finer step might show another motion."""
    if response.status == Status.DIVERGED:
        return False
    leapt = before is not None and _apart(before, response) > LEAP
    return response.multiple != 1 or leapt


def alike(one: Response, two: Response) -> bool:
    """Whether two responses at one speed are the same motion."""
    return one.multiple == two.multiple and (
        one.multiple == 0 or _apart(one, two) <= ALIKE
    )


def _apart(one: Response, two: Response) -> float:
    """Largest relative difference of the RMS of a mesh; inf where one diverged."""
    size = np.maximum(one.dte_rms, two.dte_rms)
    difference = np.abs(one.dte_rms - two.dte_rms)
    part = np.divide(difference, size, np.zeros_like(size), where=size != 0.0)
    return float(part.max()) if np.isfinite(part).all() else np.inf
