"""What the compiled kernels know of a machine that rattles, by name."""

from __future__ import annotations

from typing import Any, NamedTuple

from numpy.typing import NDArray


class Rattle(NamedTuple):
    """Relative rotation x [rad] of the gears, time in turns of the machine.

    In the play, |x| < play: x = drift t + decay at the rate of damping + forced part
    of `free`; on a flank, with a stiffness, oscillation about `offset` and the forced
    part of `pressed`. A forced part (4,) has cosine and sine of the turn and of
    `order` turns.

    stiffness : 2 kappa, infinite in the impact limit; restitution of its impacts
    free_bend, pressed_bend : largest second derivative of the forced parts
    free_jerk : largest third one
    """

    damping: float
    play: float
    stiffness: float
    restitution: float
    drift: float
    offset: float
    order: float
    free: NDArray[Any]
    pressed: NDArray[Any]
    free_bend: float
    pressed_bend: float
    free_jerk: float
