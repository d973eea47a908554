"""Loose wheels for tests of clattering gearboxes, and their motion by scipy."""

from __future__ import annotations

import math

import numpy as np
from scipy.integrate import solve_ivp

from lumped.clatter.gearbox import Freedom, Harmonics, LooseWheel
from lumped.clatter.groups import WheelGroup

SINE = Harmonics(0.04, (0.15e-3,), (0.3,))
STILL = Harmonics(0.04, (0.0,), (0.0,))


def freedom(play: float, restitution: float, drag=0.0, damping=0.0) -> Freedom:
    return Freedom(play=play, restitution=restitution, drag=drag, damping=damping)


def spur(restitution=0.8, drag=-0.05, damping=1e-3, **keys) -> LooseWheel:
    """A wheel that rattles in the play of its teeth only."""
    turning = freedom(1e-4, restitution, drag, damping)
    defaults = {"name": "spur", "inertia": 1e-3, "mass": 1.0, "base_radius": 0.04}
    return LooseWheel(rotation=turning, **defaults | {"ratio": 0.87} | keys)


def helical(restitution=0.7, drag=-0.05, damping=1e-3, **keys) -> LooseWheel:
    """A wheel in all three plays."""
    side = 0.0 if damping == 0.0 else 0.5
    defaults = {
        "name": "helical",
        "axial": freedom(1e-4, restitution, 3.0 * drag, side),
        "radial": freedom(5e-5, restitution, 2.0 * drag, 2.0 * side),
        "helix_angle": math.radians(25.0),
    }
    return spur(restitution, drag, damping, **defaults | keys)


def impacts_by_scipy(
    group: WheelGroup, q, v, until: float
) -> list[tuple[float, int, float]]:
    """Time, play and approach speed of impacts, one play at a time; SI units."""
    masses, rows = group.masses, group.rows
    freedoms = group.freedoms
    drag = np.array([f.drag for f in freedoms])
    damping = np.array([f.damping for f in freedoms])
    sources = [
        w.ratio if n == "teeth" and w.driver is None else 0 for w, n in group.plays
    ]
    ratios, n = np.array(sources), len(q)
    turn = 2.0 * math.pi / group.excitation.period
    size, phase = group.excitation.amplitudes[0], group.excitation.phases[0]

    def rates(t, y):
        return np.concatenate([y[n:], (drag - damping * y[n:]) / masses])

    def wave(p, t, rate):
        wheel, name = group.plays[p]
        variation = wheel.variation
        if name != "teeth" or variation is None:
            return 0.0
        angle = variation.order * turn * t + variation.phase
        value = turn * variation.order * math.cos(angle) if rate else math.sin(angle)
        return variation.amplitude * value

    def gap(p, upper):
        def value(t, y):
            s = ratios[p] * size * math.sin(turn * t + phase) + rows[p] @ y[:n]
            return 1e4 * (-s if upper else s + freedoms[p].play + wave(p, t, False))

        value.terminal, value.direction = True, -1
        return value

    edges = [(p, upper) for p in range(n) for upper in (True, False)]
    impacts, t, y = [], 0.0, np.concatenate([q, v])
    while True:
        run = solve_ivp(
            *(rates, (t, until), y, "DOP853"),
            events=[gap(*e) for e in edges],
            rtol=1e-12,
            atol=1e-16,
            max_step=group.excitation.period / 400,
        )
        if run.status == 0:
            return impacts
        number = next(i for i, times in enumerate(run.t_events) if len(times))
        p, upper = edges[number]
        t, y = run.t[-1], run.y[:, -1].copy()
        speed = ratios[p] * size * turn * math.cos(turn * t + phase) + rows[p] @ y[n:]
        speed += 0.0 if upper else wave(p, t, True)
        impacts.append((t, p, abs(speed)))
        mobility = np.sum(rows[p] ** 2 / masses)
        y[n:] -= (1.0 + freedoms[p].restitution) * speed / mobility * rows[p] / masses
