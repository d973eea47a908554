"""Impacts and contact forces of all closed contacts at once, compiled.

Newton's restitution with a complementarity problem: impulses L >= 0 and relative speeds
after impact g+ + eps g- >= 0, complementary, with g+ = g- + G L and the Delassus matrix
G = N M^-1 N^T. With every contact active this is eq. (6) of the clattering source. Its
constraints are independent (each wheel has one mesh that turns it), so that G is
positive definite and the answer unique, whatever the order of the contacts. Energy does
not grow: closed contacts have g- <= 0, and what is gained, sum (1 - eps) g- L / 2, is
none.
"""

from __future__ import annotations

from lumped.common.compiled import compiled, compiled_part

ROUND_OFF = 1e-14


@compiled_part
def solve_basis(g, b, z, basis, count, rows):
    """z with (G z + b)_i = 0 of i in the basis, and z_i = 0 of the others."""
    size = 0
    for i in range(count):
        z[i] = 0.0
        size += basis[i]
    for i in range(count):
        for k in range(count):
            in_basis = basis[i] * basis[k]
            rows[i, k] = g[i, k] * in_basis
        rows[i, i] += 1.0 - basis[i]
        rows[i, count] = -b[i] * basis[i]
    for i in range(count):  # positive definite: no pivots
        for k in range(i + 1, count):
            factor = rows[k, i] / rows[i, i]
            for m in range(i + 1, count + 1):
                rows[k, m] -= factor * rows[i, m]
    for i in range(count - 1, -1, -1):
        value = rows[i, count]
        for k in range(i + 1, count):
            value -= rows[i, k] * z[k]
        z[i] = value / rows[i, i]
    return size


@compiled
def solve_lcp(g, b, z, basis, count, rows):
    """Least z >= 0 with G z + b >= 0 and z (G z + b) = 0; whether it was found.

    Principal pivoting by least index (Murty 1974), finite for positive definite G.
    g (count, count) : G; b, z (count,); basis : 1 where z is positive
    """
    if count == 1:
        basis[0] = 1 if b[0] < 0.0 else 0
        z[0] = -b[0] / g[0, 0] if b[0] < 0.0 else 0.0
        return True
    for i in range(count):
        basis[i] = 1 if b[i] < 0.0 else 0
    for _ in range(2 ** min(count, 20)):
        solve_basis(g, b, z, basis, count, rows)
        violated = -1
        for i in range(count):
            residual, scale = b[i], abs(b[i])
            for k in range(count):
                residual += g[i, k] * z[k]
                scale += abs(g[i, k] * z[k])
            if basis[i] == 1:
                residual, scale = z[i], scale / g[i, i]
            if residual < -ROUND_OFF * scale:
                violated = i
                break
        if violated < 0:
            for i in range(count):
                z[i] = max(z[i], 0.0)
            return True
        basis[violated] = 1 - basis[violated]
    return False


@compiled_part
def fill_delassus(box, work, count):
    """G of the contacts in `work`, by rows of gaps: -1 times the side of the play's."""
    n = box.drag_acceleration.size
    for i in range(count):
        for k in range(i, count):
            value = 0.0
            for c in range(n):
                value += (
                    box.rows[work.contact[i], c]
                    * box.inverse_mass[c]
                    * box.rows[work.contact[k], c]
                )
            value *= work.side[i] * work.side[k]
            work.delassus[i, k] = value
            work.delassus[k, i] = value


@compiled
def solve_impact(box, work, v, count, bounces):
    """Impulses in `work.z` and speeds after an impact; whether they were found.

    Contacts and `work.s` are those of the instant. Those that close more slowly than
    `box.resting_speed` do not bounce, and none does without `bounces`.
    """
    fill_delassus(box, work, count)
    for i in range(count):
        p = work.contact[i]
        speed = -work.side[i] * work.s[p, 1]
        if bounces:
            bounce = box.restitution[p] if speed < -box.resting_speed else 0.0
            speed = (1.0 + bounce) * min(speed, 0.0)
        work.b[i] = speed
    is_solved = solve_lcp(
        work.delassus, work.b, work.z, work.basis, count, work.eliminated
    )
    for i in range(count):
        p = work.contact[i]
        if work.z[i] > 0.0:
            for c in range(box.drag_acceleration.size):
                v[c] -= work.side[i] * box.inverse_mass[c] * box.rows[p, c] * work.z[i]
    return is_solved
