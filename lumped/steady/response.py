"""Response at a mesh frequency: quantities, and the motion over time."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
RESPONSE_QUANTITIES = (
    "dte_rms",
    "dte_rms_stderr",
    "dte_mean",
    "dte_peak",
    "force_peak",
    "contact_loss",
    "back_side",
)


class Status(StrEnum):
    PERIODIC = "periodic"
    APERIODIC = "aperiodic"
    DIVERGED = "diverged"


@dataclass(frozen=True, eq=False)
class History:
    """Motion over whole common periods, with t points and m meshes.

    time : (t,) [s], from the start of a common period
    deflection : (t, m) dynamic transmission error, positive in compression [m]
    rate : (t, m) [m/s]
    force : (t, m) [N], negative on the back side
    drive_overlap, back_overlap : (t, m) overlap of the nearest flanks, negative if
        they are apart [m]
    force_before : (t, m) left limit of the force, which differs from it where a
        stiffness jumps [N]
    contacts : (t, 2, c) loads [N] and penetrations [m] of the coupled model's contacts
    friction : (t, 3, p) normal force [N], sliding speed [m/s] and dissipated power [W]
        of tooth pairs with friction, 0 where teeth are apart
    """

    time: Array
    deflection: Array
    rate: Array
    force: Array
    drive_overlap: Array
    back_overlap: Array
    force_before: Array
    contacts: Array | None = field(default=None, kw_only=True)
    friction: Array | None = field(default=None, kw_only=True)


@dataclass(frozen=True, eq=False)
class Response:
    """Response at a mesh frequency, with quantities (m,) of m meshes, NaN if diverged.

    frequency : frequency of the first mesh [Hz]
    multiple : common periods after which the motion repeats, 0 if it does not
    period_multiple : (m,) the same in periods of each mesh
    settling_time : time integrated before the quantities were measured [s]
    dte_rms : RMS of the dynamic transmission error without its mean [m]
    dte_mean, dte_peak : mean and largest value of the dynamic transmission error [m]
    dte_rms_stderr : standard error of dte_rms of a motion that does not repeat,
        from the windows over which it was measured; 0 for one that repeats [m]
    force_peak : largest mesh force [N]
    contact_loss, back_side : fractions of the time without contact on either side, and
        with back contact
    state : state of the stepper from which to continue; in lumped models the modal
        displacement and velocity (2, n)
    """

    frequency: float
    status: Status
    multiple: int
    period_multiple: NDArray[np.int64]
    settling_time: float
    dte_rms: Array
    dte_rms_stderr: Array
    dte_mean: Array
    dte_peak: Array
    force_peak: Array
    contact_loss: Array
    back_side: Array
    state: Any
