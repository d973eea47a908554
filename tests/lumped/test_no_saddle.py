"""Trains at a frozen mesh position have no saddle, and so no homoclinic orbit.

The claims of docs/validation/chaos-of-the-idler.md: the potential of the springs under
the loads is convex, and closed orbits of an oscillator that loses contact have periods
that grow with their amplitude without a bound, so that none is infinite.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from lumped.kernels import mesh_force as kernels

# the functions that integration compiles, which Python may not call once compiled
pair_force, pair_slope = kernels.pair_force.py_func, kernels.pair_slope.py_func
CHAPTER_3 = 2.621e-3, 3.27e-3, 0.119  # kg m2
stiffnesses = st.one_of(st.just(0.0), st.floats(1e6, 1e9))  # N/m; 0 out of mesh
gaps = st.floats(-2e-5, 2e-5)  # m
backlashes = st.one_of(st.just(math.inf), st.floats(0.0, 1e-4))  # m
pairs = st.lists(st.tuples(stiffnesses, gaps), min_size=1, max_size=4)


def forces(deflections, pairs, backlash):
    """Force of all pairs of a mesh [N] at deflections [m]."""
    return np.array(
        [sum(pair_force(k, s - g, backlash) for k, g in pairs) for s in deflections]
    )


@given(pairs=pairs, backlash=backlashes, load=st.floats(0.0, 1e4))
def test_the_potential_of_a_mesh_is_convex_with_one_interval_of_equilibria(
    pairs, backlash, load
):
    """V' = F(s) - load never falls: where it is 0 is one point or one interval."""
    deflections = np.linspace(-3e-4, 3e-4, 601)
    slope = forces(deflections, pairs, backlash) - load
    rounding = 1e-9 * (np.abs(slope).max() + 1.0)
    assert (np.diff(slope) >= -rounding).all()
    signs = np.sign(np.where(np.abs(slope) <= rounding, 0.0, slope))
    assert (np.diff(signs) >= 0.0).all()


@settings(max_examples=50)
@given(seed=st.integers(0, 2**32 - 1), lost=st.floats(0.0, 3.0))
def test_no_equilibrium_of_the_idler_has_a_direction_of_negative_stiffness(
    system, idler, seed, lost
):
    """The second derivative of its potential at any position and deflection."""
    free = idler(inertias=CHAPTER_3, coupled=False, backlash=1e-4)
    built = system(free, contact_ratio=1.5)
    random = np.random.default_rng(seed)
    samples, arrays = built.samples(64), built.arrays
    k, size = random.integers(samples.h.size), np.abs(built.static_deflection).max()
    s = (1.0 - lost) * size + 2.0 * size * random.standard_normal(2)
    hessian = np.diag(arrays.rigidity)
    for m, shape in enumerate(arrays.shapes):
        span = range(arrays.first_pair[m], arrays.first_pair[m + 1])
        tangent = sum(
            pair_slope(
                samples.stiffness[k, 0, p],
                s[m] - samples.gap[k, 0, p],
                arrays.backlash[m],
            )
            for p in span
        )
        hessian += (tangent - arrays.mean_stiffness[m]) * np.outer(shape, shape)
    values = np.linalg.eigvalsh(hessian)
    assert values.min() >= -1e-9 * arrays.rigidity.max()


@pytest.mark.parametrize("amplitude", [1.0, 1.2, 2.0, 5.0])
def test_periods_of_orbits_that_lose_contact(amplitude):
    """x'' + max(x, 0) = 1: T = 2 arccos(-1/a) + 2 sqrt(a^2 - 1), from rest at 1 + a."""

    def returns(t, y):
        return y[1]

    returns.direction = -1.0  # to the largest deflection
    motion = solve_ivp(
        lambda t, y: [y[1], 1.0 - max(y[0], 0.0)],
        (0.0, 40.0),
        [1.0 + amplitude, 0.0],
        rtol=1e-11,
        atol=1e-12,
        max_step=0.05,
        events=returns,
    )
    period = next(t for t in motion.t_events[0] if t > 1.0)
    closed = 2.0 * math.acos(-1.0 / amplitude) + 2.0 * math.sqrt(amplitude**2 - 1.0)
    assert period == pytest.approx(closed, rel=1e-6)
