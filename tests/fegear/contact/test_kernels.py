"""The contact kernel's parts against independent computations."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit
from scipy.integrate import quad
from scipy.optimize import brentq, nnls

from fegear.contact.loads import patch_loads
from fegear.contact.plane.constants import kernel_inputs
from fegear.contact.plane.grid import (
    contact_grid,
    end_hat_logarithm,
    hat_logarithm,
)
from fegear.contact.plane.kernels import active_set, flanks
from fegear.contact.solve import solve_cycle
from validation.oracles import hertz


@njit
def separation(master, slave, line, crossings, s):
    return flanks.separation(master, slave, line, crossings, s)


@njit
def _solve_contact(C, nodes, torque, matrix):
    return active_set.solve_contact(C, nodes, active_set.TORQUE, torque, matrix)


def solve_contact(C, gap, closing, arm, torque, active):
    """Forces (n,) and the kernel's answer, from a contact state (n,) to start with."""
    nodes = np.zeros(gap.size, active_set.UNKNOWN).view(np.recarray)
    nodes.gap, nodes.closing, nodes.arm, nodes.in_contact = gap, closing, arm, active
    space = np.empty((gap.size, gap.size + 2))
    answer = _solve_contact(C, nodes, torque, space)
    return nodes.force.copy(), answer


@pytest.mark.parametrize("steps", [0.0, 1.0, 2.0, 7.5])
def test_hat_integrals(steps):
    def log(t):
        return np.log(abs(steps - t)) if steps != t else 0.0

    inside = [p for p in (-1.0, 0.0, 1.0, steps) if -1.0 <= p <= 1.0]
    hat = quad(lambda t: (1 - abs(t)) * log(t), -1, 1, points=inside)[0]
    assert hat_logarithm(np.array(steps)) == pytest.approx(hat, abs=1e-8)
    end = quad(lambda t: 2 * (1 + t) * np.log(abs(-steps - t) or 1.0), -1, 0)[0]
    assert end_hat_logarithm(np.array(-steps)) == pytest.approx(end, abs=1e-6)


def test_grid_interpolates_polynomials():
    grid = contact_grid(17)
    x = np.linspace(-1.0, 1.0, 17)
    for power in range(5):
        np.testing.assert_allclose(
            grid.lagrange @ grid.points**power, x**power, 1e-11, 1e-14
        )


def rotated(points, angle):
    c, s = np.cos(angle), np.sin(angle)
    return points @ np.array([[c, s], [-s, c]])  # counterclockwise


@pytest.mark.parametrize("off", [-3e-3, 0.0, 3e-3])
@pytest.mark.parametrize("beyond", [0.0, 0.2e-3])
def test_separation_is_the_distance_between_the_flanks(problem, off, beyond):
    """Both involutes drawn point by point in the frame of the line of action."""
    mesh, records, _ = kernel_inputs(problem)
    master, slave = records[0], records[1]
    nominal = mesh.pitch_point + off
    s = nominal - beyond
    crossings = nominal, mesh.line_of_action - nominal
    gap, s_slave, _ = separation(master, slave, mesh.line_of_action, crossings, s)
    rb1, rb2 = master.base_radius, slave.base_radius
    here = rotated(np.array([s, rb1]), (s - nominal) / rb1) - [0.0, rb1]
    t = s_slave + np.linspace(-2e-4, 2e-4, 40_001)
    turn = (t - (mesh.line_of_action - nominal)) / rb2
    start = np.stack([-t, np.full_like(t, -rb2)], axis=1)
    curve = np.array([mesh.line_of_action, rb2]) + np.stack(
        [
            np.cos(turn) * start[:, 0] - np.sin(turn) * start[:, 1],
            np.sin(turn) * start[:, 0] + np.cos(turn) * start[:, 1],
        ],
        axis=1,
    )
    distance = np.hypot(*(curve - here).T).min()
    assert gap == pytest.approx(distance, abs=1e-8)
    assert gap >= -1e-15


@settings(max_examples=60, deadline=None)
@given(st.integers(2, 14), st.integers(0, 10_000), st.floats(0.01, 100.0))
def test_active_set_solves_the_complementarity_problem(n, seed, torque):
    random = np.random.default_rng(seed)
    root = random.normal(size=(n, n))
    C = root @ root.T + 0.05 * np.eye(n)
    gap, h = random.uniform(0.0, 2.0, n), random.uniform(0.5, 1.5, n)
    q, answer = solve_contact(C, gap, h, h, torque, False)
    d, _, residual, status, _ = answer
    assert status == active_set.CONVERGED
    assert residual < 1e-9

    def pressures(approach):
        """min q C q / 2 + (gap - d h) q over q >= 0 as least squares."""
        L = np.linalg.cholesky(C)
        return nnls(L.T, np.linalg.solve(L, approach * h - gap), maxiter=1000)[0]

    expected = brentq(lambda x: h @ pressures(x) - torque, 0.0, 1e6)
    assert d == pytest.approx(expected, rel=1e-6)
    np.testing.assert_allclose(q, pressures(d), rtol=1e-5, atol=1e-6 * q.max())


def test_nan_ends_with_a_status():
    C = np.eye(3)
    C[1, 1] = np.nan
    _, (d, _, _, status, _) = solve_contact(C, *np.ones((3, 3)), 1.0, True)
    assert status == active_set.NOT_FINITE
    assert not np.isfinite(d)


@settings(max_examples=60, deadline=None)
@given(st.integers(2, 20), st.integers(0, 10_000), st.floats(0.0, 0.9))
def test_unsymmetric_problems_meet_all_conditions(n, seed, skewness):
    """As with friction: positive definite, but not symmetric."""
    random = np.random.default_rng(seed)
    root, skew = random.normal(size=(n, n)), random.normal(size=(n, n))
    C = root @ root.T + np.eye(n) + skewness * (skew - skew.T)
    gap, h = random.uniform(0.0, 2.0, n), random.uniform(0.9, 1.1, n)
    arms = h * random.uniform(0.95, 1.05, n)
    q, (d, *_, status, _) = solve_contact(C, gap, h, arms, 3.0, False)
    assert status == active_set.CONVERGED
    opening = gap + C @ q - d * h
    assert (q >= 0.0).all()
    assert opening.min() > -1e-9 * d
    assert np.abs(q * opening).max() < 1e-9 * d * q.max()
    assert arms @ q == pytest.approx(3.0, rel=1e-9)


def test_pressure_at_the_pitch_point_is_hertzian(problem):
    (load,) = patch_loads(problem, 100.0, 0.0)
    total = load.normal.sum()
    assert total * problem.face_width == pytest.approx(100.0 / 45.3496e-3, rel=1e-4)
    s1 = problem.pair.pitch_point
    radius = hertz.effective_radius(s1, problem.pair.line_of_action - s1)
    steel = hertz.Material(206e9, 0.3)
    modulus = hertz.effective_modulus(steel, steel, "stress")
    b = float(hertz.half_width(total, radius, modulus))
    peak = float(hertz.peak_pressure(total, radius, modulus))
    x = load.driver_arcs - (load.driver_arcs @ load.normal) / total
    inner = np.abs(x) < 0.8 * b
    expected = hertz.pressure(x[inner], b, peak)
    np.testing.assert_allclose(load.normal[inner] / load.step, expected, rtol=0.02)


def test_deflection_grows_with_load_as_hertz_says(problem):
    """Bodies and teeth are linear: what is left is the contact's logarithm."""
    torque = np.array([20.0, 100.0])
    cycle = solve_cycle(problem, torque, [0.0])
    load = cycle.mesh_force[:, 0] / problem.face_width
    softness = cycle.ste[:, 0] / load
    s1 = problem.pair.pitch_point
    rho = s1, problem.pair.line_of_action - s1
    steel = hertz.Material(206e9, 0.3)
    radius = float(hertz.effective_radius(*rho))
    depth = (np.array(5e-3), np.array(5e-3))
    closed = hertz.approach(load, radius, (steel, steel), depth, "stress") / load
    assert np.diff(softness)[0] == pytest.approx(np.diff(closed)[0], rel=5e-3)


def test_both_flanks_carry_the_same_load(problem):
    for load in patch_loads(problem, 100.0, 0.5):
        assert np.all(np.diff(load.driver_arcs) * np.diff(load.driven_arcs) < 0.0)
        spacing = abs(load.driver_arcs[1] - load.driver_arcs[0])
        assert load.step == pytest.approx(spacing, rel=2e-2)


def test_loads_need_a_positive_torque(problem):
    with pytest.raises(ValueError, match="positive"):
        patch_loads(problem, -1.0, 0.0)
