"""Variables of the linear part of a train, and sums of products over them, compiled.

See `lumped.kernels.arrays.Propagator`.
"""

from __future__ import annotations

from lumped.common.compiled import compiled_part, inlined

FORCE_NODES = 4  # forces that a step knows


@inlined
def dot(a, b, count):
    """Sum of products in four parts, which do not wait for each other."""
    one, two, three, four = 0.0, 0.0, 0.0, 0.0
    fours = count - count % 4
    for j in range(0, fours, 4):
        one += a[j] * b[j]
        two += a[j + 1] * b[j + 1]
        three += a[j + 2] * b[j + 2]
        four += a[j + 3] * b[j + 3]
    for j in range(fours, count):
        one += a[j] * b[j]
    return (one + two) + (three + four)


@inlined
def dot_at(a, i, b, j, count):
    """Sum of products as `dot`, from entries i and j on: views cost more."""
    one, two, three, four = 0.0, 0.0, 0.0, 0.0
    fours = count - count % 4
    for k in range(0, fours, 4):
        one += a[i + k] * b[j + k]
        two += a[i + k + 1] * b[j + k + 1]
        three += a[i + k + 2] * b[j + k + 2]
        four += a[i + k + 3] * b[j + k + 3]
    for k in range(fours, count):
        one += a[i + k] * b[j + k]
    return (one + two) + (three + four)


@inlined
def multiply_row(row, first, q, a, w):
    """Penetration by displacements q (n,), row (a + 2 k,) of a contact: see
    `lumped.kernels.arrays.ContactGrid`."""
    k = (row.size - a) // 2
    penetration = dot(row, q, a)
    if k > 0:
        penetration += dot_at(row, a, q, a + first, k)
        penetration += dot_at(row, a + k, q, a + w + first, k)
    return penetration


@inlined
def add_row(row, first, factor, force, a, w):
    """Add a row (a + 2 k,) of a contact times a factor to a force (n,)."""
    k = (row.size - a) // 2
    for j in range(a):
        force[j] += factor * row[j]
    for j in range(k):
        force[a + first + j] += factor * row[a + j]
    for j in range(k):
        force[a + w + first + j] += factor * row[a + k + j]


@inlined
def add_columns(columns, x, out):
    """out + columns^T x, columns (count, size) four at a time."""
    fours = x.size - x.size % 4
    for j in range(0, fours, 4):
        a, b, c, d = x[j], x[j + 1], x[j + 2], x[j + 3]
        one, two = columns[j], columns[j + 1]
        three, four = columns[j + 2], columns[j + 3]
        for i in range(out.size):
            out[i] += (one[i] * a + two[i] * b) + (three[i] * c + four[i] * d)
    for j in range(fours, x.size):
        for i in range(out.size):
            out[i] += columns[j, i] * x[j]


@compiled_part
def set_variables(rates, q, v, state, waves):
    """State (2 a,) and waves (2, 2, w) of displacements and velocities (n,)."""
    a, w = state.size // 2, rates.shape[2]
    for i in range(a):
        state[i], state[a + i] = q[i], v[i]
    for p in range(w):
        z, dz = complex(q[a + p], -q[a + w + p]), complex(v[a + p], -v[a + w + p])
        forward = complex(rates[0, 0, p], rates[0, 1, p])
        backward = complex(rates[1, 0, p], rates[1, 1, p])
        wave = (dz - backward * z) / (forward - backward)
        waves[0, 0, p], waves[0, 1, p] = wave.real, wave.imag
        wave = z - wave
        waves[1, 0, p], waves[1, 1, p] = wave.real, wave.imag


@compiled_part
def get_variables(rates, state, waves, q, v):
    """Displacements and velocities (n,) of state (2 a,) and waves (2, 2, w)."""
    a, w = state.size // 2, rates.shape[2]
    for i in range(a):
        q[i], v[i] = state[i], state[a + i]
    for p in range(w):
        q[a + p] = waves[0, 0, p] + waves[1, 0, p]
        q[a + w + p] = -waves[0, 1, p] - waves[1, 1, p]
        v[a + p], v[a + w + p] = 0.0, 0.0
        for s in range(2):
            real, imaginary = waves[s, 0, p], waves[s, 1, p]
            v[a + p] += rates[s, 0, p] * real - rates[s, 1, p] * imaginary
            v[a + w + p] -= rates[s, 0, p] * imaginary + rates[s, 1, p] * real
