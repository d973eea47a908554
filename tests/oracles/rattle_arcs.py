"""Motion of a machine that rattles between events, dense in time, from its equation.

Solutions of x'' + delta x' + k (x - b) = load, with k = 0 in the play, by complex
exponentials. No code of the return map is used.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lumped.common.array_types import Array

TURN = 2.0 * np.pi


def motion_between(
    figures: dict[str, float],
    pressed: NDArray[np.bool_],
    side: Array,
    starts: Array,
    times: Array,
) -> tuple[Array, Array]:
    """Places and speeds (a, n) of arcs at times (a, n).

    figures : damping, eccentricity, half_backlash, stiffness (kappa), and ripple,
        ripple_order, ripple_phase where there is some
    pressed : whether an arc is on a flank (a,); side : of the bound where it starts
    starts : time and speed at the start (a, 2)
    """
    delta, beta = figures["damping"], figures["half_backlash"]
    eps = figures["eccentricity"]
    kappa = figures.get("stiffness", 0.0)
    k = np.where(pressed, 2.0 * kappa, 0.0)[:, None]
    begin, speed = starts[:, :1], starts[:, 1:]
    order = figures.get("ripple_order", 1)
    loads = (
        (TURN, -(TURN**2) * eps + 1j * TURN * delta * eps),
        (
            TURN * order,
            figures.get("ripple", 0.0) * np.exp(1j * figures.get("ripple_phase", 0.0)),
        ),
    )

    def forced(t: Array) -> tuple[Array, Array]:
        value, rate = np.zeros_like(t), np.zeros_like(t)
        for w, load in loads:
            wave = load / (k - w**2 + 1j * delta * w) * np.exp(1j * w * t)
            value += wave.real
            rate += (1j * w * wave).real
        return value, rate

    mean = 2.0 * TURN * delta
    offset = np.where(pressed, side * beta, 0.0)[:, None]
    with np.errstate(divide="ignore"):
        offset = offset + np.where(k > 0.0, mean / np.where(k > 0.0, k, 1.0), 0.0)
    drift = np.where(k > 0.0, 0.0, mean / delta)
    first, first_rate = forced(begin)
    y = side[:, None] * beta - offset - first
    w = speed - drift - first_rate
    root = np.sqrt(delta**2 / 4.0 - k + 0j)
    fast, slow = -0.5 * delta + root, -0.5 * delta - root
    one = (w - slow * y) / (fast - slow)
    two = y - one
    tau = times - begin
    free = one * np.exp(fast * tau), two * np.exp(slow * tau)
    value, rate = forced(times)
    x = offset + drift * tau + value + (free[0] + free[1]).real
    return x, drift + rate + (fast * free[0] + slow * free[1]).real


def min_clearances(
    figures: dict[str, float], arcs: Array, samples: int
) -> tuple[Array, Array]:
    """How far arcs (a, 7) stay from the bounds between their ends, and from the bound
    at their end (a,) [rad]; negative of those that pass a bound before.

    arcs : start, speed, end, speed there, side, side of the end, 1 on a flank
    """
    pressed, side, end = arcs[:, 6] > 0.0, arcs[:, 4], arcs[:, 5]
    part = (np.arange(samples) + 1.0) / samples
    times = arcs[:, :1] + part * (arcs[:, 2:3] - arcs[:, :1])
    x, _ = motion_between(figures, pressed, side, arcs[:, :2], times)
    beta = figures["half_backlash"]
    inside = x[:, :-1]
    free = beta - np.abs(inside).max(axis=1)
    flank = (side[:, None] * inside).min(axis=1) - beta
    return np.where(pressed, flank, free), np.abs(x[:, -1] - end * beta)
