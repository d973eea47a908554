"""Exact steps of the linear part, against SciPy's integrator, and their limits."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from lumped.train.propagator import LinearPart

FREQUENCY, H = 1000.0, 2e-5  # Hz, s
SQUARES = np.array([0.0, 4e7, 9e8])  # 1/s2
WAVE, DECAY, WHIRL = 3e4, 400.0, 0.05  # rad/s, 1/s, of the mesh frequency
CUBIC = np.array([[3.0, -1e4, 4e8, -2e12], [1.0, 2e4, -1e8, 5e12]])  # of time


@dataclass(frozen=True)
class Linear:
    """Three coordinates that do not whirl, and a pair that does."""

    damping: np.ndarray = field(default_factory=lambda: np.diag([200.0, 500.0, 900.0]))

    @property
    def part(self) -> LinearPart:
        turn = np.array([[1.0, 0.5, 0.1], [-0.3, 1.0, 0.2], [0.0, 0.1, 1.0]])
        matrices = [np.zeros((5, 5)) for _ in range(2)]
        matrices[0][:3, :3] = turn.T @ np.diag(SQUARES) @ turn
        matrices[1][:3, :3] = self.damping
        for matrix, value in zip(matrices, (WAVE**2, DECAY), strict=True):
            matrix[3, 3] = matrix[4, 4] = value
        contacts = SimpleNamespace(
            knots=np.array([[0.0, 1e-5]]), load_curve=np.ones((1, 1, 2, 1, 4))
        )
        system = SimpleNamespace(
            stiffness=matrices[0],
            damping=matrices[1],
            load=np.zeros(5),
            whirl=np.array([WHIRL]),
            contacts=contacts,
            rows=np.ones((1, 1, 5)),
        )
        return LinearPart(system)


def forces(time):
    """(2,) of the coordinate that is pushed, and of the other one of a pair."""
    return CUBIC @ time ** np.arange(4)


def at_nodes():
    return np.array([forces(node * H) for node in (1.0, 0.0, -1.0, -2.0)])


def test_a_step_is_exact_for_cubic_forces():
    part = Linear().part
    K, D = part.system.stiffness[:3, :3], part.system.damping[:3, :3]
    push = np.array([1.0, -2.0, 0.5])

    def slope(time, y):
        return np.concatenate([y[3:], push * forces(time)[0] - K @ y[:3] - D @ y[3:]])

    start = np.array([1e-6, -2e-6, 1e-6, 0.02, 0.01, -0.03])
    exact = solve_ivp(slope, (0.0, H), start, rtol=1e-12, atol=1e-18).y[:, -1]
    step = part.step(FREQUENCY, H)
    end, *before = at_nodes()
    inputs = np.concatenate([start, *(push * force[0] for force in before)])
    state = inputs @ step.transition + (push * end[0]) @ step.force_response
    np.testing.assert_allclose(state, exact, rtol=1e-8, atol=1e-14)


def test_travelling_modes_follow_their_gyroscopic_equations():
    """E'' + c E' + w^2 E with 2 v E' and -v^2 E from the change of frame."""
    part = Linear().part
    turn = 2.0 * np.pi * FREQUENCY * WHIRL

    def slope(time, y):
        z, dz = complex(*y[:2]), complex(*y[2:])
        one, two = forces(time)
        ddz = complex(one, -two) - (WAVE**2 - turn**2 - 1j * turn * DECAY) * z
        ddz -= (DECAY - 2j * turn) * dz
        return [dz.real, dz.imag, ddz.real, ddz.imag]

    start = complex(2e-6, -1e-6), complex(0.02, 0.05)
    y = [start[0].real, start[0].imag, start[1].real, start[1].imag]
    exact = solve_ivp(slope, (0.0, H), y, rtol=1e-12, atol=1e-18).y[:, -1]
    step = part.step(FREQUENCY, H)
    rates = step.rates[:, 0] + 1j * step.rates[:, 1]  # (2, w)
    waves = np.zeros((2, 1), complex)
    waves[0] = (start[1] - rates[1] * start[0]) / (rates[0] - rates[1])
    waves[1] = start[0] - waves[0]
    factors = step.waves[:, ::2] + 1j * step.waves[:, 1::2]  # (2, 5, w)
    waves = factors[:, 0] * waves
    for back, (one, two) in enumerate(at_nodes()):
        waves += factors[:, 1 + back] * complex(one, -two)
    assert waves.sum() == pytest.approx(complex(*exact[:2]), rel=1e-8)
    assert (rates * waves).sum() == pytest.approx(complex(*exact[2:]), rel=1e-7)


@pytest.mark.parametrize("size", [1e-5, 1e-4, 1e-3])
def test_constant_forces_lead_to_the_static_displacement(size):
    """However far a step is from resolving the motion, and steps do not grow."""
    part = Linear().part
    step = part.step(FREQUENCY, size)
    assert np.abs(np.linalg.eigvals(step.transition[:6])).max() <= 1.0 + 1e-9
    factors = step.waves[:, ::2, 0] + 1j * step.waves[:, 1::2, 0]
    assert (np.abs(factors[:, 0]) < 1.0).all()
    turn = 2.0 * np.pi * FREQUENCY * WHIRL
    static = 1.0 / (WAVE**2 - turn**2 - 1j * turn * DECAY)
    waves = factors[:, 1:].sum(axis=1) / (1.0 - factors[:, 0])
    assert waves.sum() == pytest.approx(static, rel=1e-8)


def test_a_train_without_damping_or_springs_is_carried_on():
    """Its motion grows with time: no eigenvector must be missed."""
    part = Linear(damping=np.zeros((3, 3))).part
    step = part.step(FREQUENCY, H)
    turn = np.array([[1.0, 0.5, 0.1], [-0.3, 1.0, 0.2], [0.0, 0.1, 1.0]])
    free = np.linalg.solve(turn, [1.0, 0.0, 0.0])  # strains nothing
    moved = np.concatenate([0.0 * free, free]) @ step.transition[:6]
    np.testing.assert_allclose(moved, np.concatenate([H * free, free]), rtol=1e-6)
