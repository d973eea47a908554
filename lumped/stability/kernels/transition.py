"""State transition over a period, by powers of time, compiled.

On a piece where K is a polynomial, the Peano-Baker series is a power series of time,
and all of its terms of one power follow from those below:

    (j + 2) (j + 1) q_(j+2) = -T D (j + 1) q_(j+1) - T^2 sum_p K_p q_(j-p),

time in periods T of the first mesh. Terms are scaled by the step, and steps kept so
short that no term is much larger than the motion.
"""

from __future__ import annotations

import math

import numpy as np

from lumped.common.compiled import compiled, inlined

MAX_TERMS = 40
MAX_STATE = 1e100  # of a state, which is then made small again


@compiled
def set_transitions(steps, stiffness, damping, periods, max_angle, error, out, growth):
    """Transition matrices (f, 2 n, 2 n) of the state (q, T q') over all pieces.

    Matrices are exp(growth) `out`, since those of long periods may exceed all numbers.

    steps : (p,) lengths of the pieces; stiffness : (p, d + 1, n, n); damping : (n,)
    periods : (f,) T [s]; max_angle : of a step, at most, in radians of the highest
        frequency; error : of a step over the motion, which sets the terms of a series
    """
    pieces, count, n = stiffness.shape[:3]
    terms = np.empty((MAX_TERMS + 1, n, 2 * n))
    q, w = np.empty((n, 2 * n)), np.empty((n, 2 * n))
    shifted = np.empty((count, n, n))
    for f in range(periods.size):
        period, growth[f] = periods[f], 0.0
        for i in range(n):
            for c in range(2 * n):
                q[i, c] = 1.0 if c == i else 0.0
                w[i, c] = 1.0 if c == n + i else 0.0
        for p in range(pieces):
            rate = math.sqrt(row_sum_norm(stiffness[p], steps[p])) + damping.max()
            parts = max(1, math.ceil(rate * period * steps[p] / max_angle))
            h = steps[p] / parts
            order = terms_needed(rate * period * h, error)
            for part in range(parts):
                shift_polynomial(stiffness[p], part * h, h, shifted)
                advance(shifted, damping, period * h, order, terms, q, w, h)
                growth[f] += normalise_state(q, w)
        for i in range(n):
            for c in range(2 * n):
                out[f, i, c], out[f, n + i, c] = q[i, c], w[i, c]


@inlined
def normalise_state(q, w):
    """Logarithm of the factor by which a large state was divided."""
    norm = 0.0
    for i in range(q.shape[0]):
        for c in range(q.shape[1]):
            norm = max(norm, abs(q[i, c]), abs(w[i, c]))
    if norm < MAX_STATE:
        return 0.0
    for i in range(q.shape[0]):
        for c in range(q.shape[1]):
            q[i, c] /= norm
            w[i, c] /= norm
    return math.log(norm)


@inlined
def terms_needed(angle, error):
    """Order of a series whose next term is below an error, of a step's angle [rad]."""
    order, term = 2, 0.5 * angle * angle
    while term > error and order < MAX_TERMS:
        order += 1
        term *= angle / order
    return order + 1 if order < MAX_TERMS else order


@compiled
def row_sum_norm(coefficients, step):
    """Largest sum of a row of |K| on a piece (d + 1, n, n)."""
    norm = 0.0
    for i in range(coefficients.shape[1]):
        total, power = 0.0, 1.0
        for d in range(coefficients.shape[0]):
            for j in range(coefficients.shape[2]):
                total += abs(coefficients[d, i, j]) * power
            power *= step
        norm = max(norm, total)
    return norm


@compiled
def shift_polynomial(coefficients, start, h, shifted):
    """Coefficients (d + 1, n, n) over (t - start) / h of a polynomial in t."""
    count = coefficients.shape[0]
    for i in range(coefficients.shape[1]):
        for j in range(coefficients.shape[2]):
            for d in range(count):
                shifted[d, i, j] = coefficients[d, i, j]
            # Horner's scheme, repeated
            for d in range(count):
                for k in range(count - 2, d - 1, -1):
                    shifted[k, i, j] += start * shifted[k + 1, i, j]
            scale = 1.0
            for d in range(count):
                shifted[d, i, j] *= scale
                scale *= h


@inlined
def stiffness_term(coefficients, terms, j, i, c):
    """Term j of K q, row i and column c."""
    total = 0.0
    for d in range(min(coefficients.shape[0], j + 1)):
        for r in range(coefficients.shape[1]):
            total += coefficients[d, i, r] * terms[j - d, r, c]
    return total


@compiled
def advance(coefficients, damping, span, order, terms, q, w, h):
    """q and w = dq / d(time in periods) (n, 2 n) over a step; span : T h [s]."""
    n, columns = damping.size, terms.shape[2]
    for i in range(n):
        for c in range(columns):
            terms[0, i, c] = q[i, c]
            terms[1, i, c] = w[i, c] * h
    for j in range(order - 1):
        for i in range(n):
            for c in range(columns):
                total = span * damping[i] * (j + 1) * terms[j + 1, i, c]
                total += span * span * stiffness_term(coefficients, terms, j, i, c)
                terms[j + 2, i, c] = -total / ((j + 1.0) * (j + 2.0))
    for i in range(n):
        for c in range(columns):
            value, rate = terms[order, i, c], order * terms[order, i, c]
            for j in range(order - 1, -1, -1):
                value += terms[j, i, c]
                rate += j * terms[j, i, c]
            q[i, c], w[i, c] = value, rate / h
