"""What the compiled kernels know of a machine that rattles, by name."""

from __future__ import annotations

from typing import NamedTuple

SHORT = 0.05  # turns: flights that fade away stay shorter
STEADY = 0.25  # of the time in which the contact load changes: short flights
Waves = tuple[float, float, float, float]


class Rattle(NamedTuple):
    """Relative rotation x [rad] of the gears, time in turns of the machine.

    In the play, |x| < play: x = drift t + decay at the rate of damping + forced part
    of `free`; on a flank, with a stiffness, oscillation about `offset` and the forced
    part of `pressed`. A forced part (4,) has cosine and sine of the turn and of
    `order` turns.

    stiffness : 2 kappa, infinite in the impact limit; restitution of its impacts
    swing : largest value of `pressed`
    free_jerk, pressed_jerk : largest third derivative of the forced parts
    free_snap : largest fourth one
    fading : 1 over damping; lasting : its size, the longest step of a transient
    short : turns of a flight back to its flank after which flights fade away
    growth : of a transient over a step, at most; above 1 where time runs backward
    """

    damping: float
    play: float
    stiffness: float
    restitution: float
    drift: float
    offset: float
    order: float
    free: Waves
    pressed: Waves
    swing: float
    free_jerk: float
    pressed_jerk: float
    free_snap: float
    fading: float
    lasting: float
    short: float
    growth: float
