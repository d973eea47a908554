"""Response at a mesh frequency: quantities, and the motion over time."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lumped.common.array_types import Array
from lumped.common.short_repr import ShortRepr

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
    """How a motion ended: periodic, aperiodic or diverged."""

    PERIODIC = "periodic"
    APERIODIC = "aperiodic"
    DIVERGED = "diverged"


@dataclass(frozen=True, eq=False)
class History(ShortRepr):
    """Motion over whole common periods, with t points and m meshes.

    Attributes
    ----------
    time : (t,) array
        Time from the start of a common period [s].
    deflection : (t, m) array
        Dynamic transmission error, positive in compression [m].
    rate : (t, m) array
        Its rate [m/s].
    force : (t, m) array
        Mesh force [N], negative on the back side.
    drive_overlap, back_overlap : (t, m) array
        Overlap of the nearest flanks, negative if they are apart [m].
    force_before : (t, m) array
        Left limit of the force [N], which differs from it where a stiffness jumps.
    contacts : (t, 2, c) array or None
        Loads [N] and penetrations [m] of the coupled model's c contacts.
    friction : (t, 3, p) array or None
        Normal force [N], sliding speed [m/s] and dissipated power [W] of p tooth pairs
        with friction, 0 where teeth are apart.
    bearings : (t, b, 4) array or None
        Displacement along x and y [m] of the rings of b rolling bearings, and the force
        of the ring on its rolling elements along x and y [N].
    moments : (t, m) array or None
        Moment of the mesh force about the middle of the mesh [N m] of gears that move
        in space, which turns the driven gear's axis toward the push.
    tilts : (t, m) array or None
        Difference of the slopes of both gears along the push [rad], of these gears.
    states : (t, 2, n) array or None
        Displacements and velocities of the n coordinates that are integrated.
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
    bearings: Array | None = field(default=None, kw_only=True)
    moments: Array | None = field(default=None, kw_only=True)
    tilts: Array | None = field(default=None, kw_only=True)
    states: Array | None = field(default=None, kw_only=True)


@dataclass(frozen=True, eq=False)
class Response(ShortRepr):
    """Response at a mesh frequency; quantities of m meshes are NaN if it diverged.

    Attributes
    ----------
    frequency : float
        Frequency of the first mesh [Hz].
    status : Status
        Whether the motion is periodic, aperiodic or diverged.
    multiple : int
        Number of common periods after which the motion repeats, 0 if it does not.
    period_multiple : (m,) array of int
        The same in periods of each mesh.
    settling_time : float
        Time integrated before the quantities were measured [s].
    dte_rms : (m,) array
        RMS of the dynamic transmission error without its mean [m].
    dte_rms_stderr : (m,) array
        Standard error of `dte_rms` of a motion that does not repeat, from the windows
        over which it was measured; 0 for one that repeats [m].
    dte_mean : (m,) array
        Mean of the dynamic transmission error [m].
    dte_peak : (m,) array
        Largest value of the dynamic transmission error [m].
    force_peak : (m,) array
        Largest mesh force [N].
    contact_loss : (m,) array
        Fraction of the time without contact on either side.
    back_side : (m,) array
        Fraction of the time with back contact.
    state : object
        State of the stepper from which to continue; in lumped models a (2, n) array
        with the modal displacement and velocity.
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
