"""What body modes that the coupled model leaves out can change."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from lumped.steady.truncation_check import TruncationCheck
from lumped.train.system import LumpedSystem
from lumped.train.truncation import TruncationModel


def truncation_bound(system: LumpedSystem, speeds: Sequence[float]) -> float | None:
    """Return a bound on the error of the mesh compliance by left-out body modes.

    Relative to the excitation's RMS; None for models without bodies.

    speeds : mesh frequencies of the first mesh [Hz]
    """
    truncation = _bodies_left_out(system)
    if truncation is None:
        return None
    inertia, retained = truncation
    return inertia.largest_error(retained, (min(speeds), max(speeds)))


def flank_bound(system: LumpedSystem, speeds: Sequence[float]) -> float | None:
    """Return a bound on the error of amplitudes on the flanks of sharp resonances.

    By left-out body modes, which shift them; None for models without bodies.

    speeds : mesh frequencies of the first mesh [Hz]
    """
    truncation = _bodies_left_out(system)
    if truncation is None:
        return None
    inertia, retained = truncation
    return inertia.flank_bound(retained, (min(speeds), max(speeds)))


def _bodies_left_out(
    system: LumpedSystem,
) -> tuple[TruncationModel, NDArray[np.bool_]] | None:
    """All body modes of the coupled model, and those that it has."""
    contacts = system.contacts
    if (
        contacts is None
        or contacts.truncation_model is None
        or contacts.retained is None
    ):
        return None
    return contacts.truncation_model, contacts.retained & (
        contacts.body_modes.count > 0
    )


def truncation_error(checks: Sequence[TruncationCheck]) -> float | None:
    """Largest relative change of the RMS by body modes that are left out."""
    return max((check.error for check in checks), default=None)
