"""Records of a machine that rattles for the compiled kernels."""

from __future__ import annotations

from typing import NamedTuple

MAX_DECAYING_FLIGHT = 0.05  # turns: flights that fade away stay shorter
MAX_LOAD_CHANGE = 0.25  # of the time in which the contact load changes: short flights
Waves = tuple[float, float, float, float]


class Rattle(NamedTuple):
    """Relative rotation x [rad] of the gears, time in turns of the machine.

    In the play, |x| < play: x = drift t + decay at the rate of damping + forced part
    of `free`; on a flank, with a stiffness, oscillation about `offset` and the forced
    part of `pressed`. A forced part (4,) has cosine and sine of the turn and of
    `order` turns.

    stiffness : 2 kappa, infinite in the impact limit; restitution of its impacts
    max_pressed : largest value of `pressed`
    free_jerk, pressed_jerk : largest third derivative of the forced parts
    free_snap : largest fourth one
    inverse_damping : 1 over damping; max_step : its magnitude, the longest step of a
        transient
    decaying_flight : turns of a flight back to its flank after which flights decay
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
    max_pressed: float
    free_jerk: float
    pressed_jerk: float
    free_snap: float
    inverse_damping: float
    max_step: float
    decaying_flight: float
    growth: float
