"""Motion of a reduced gear model by a general solver of differential equations.

The equations of `fegear.dynamics.model`, written out with dense matrices:

    M q'' + C q' + K q = f - sum_c P_c(t) F_c
    s_c + sum_d R_cd(t) F_d = A_c(t) q - g_c(t)

with the squeezes s, F_c = law of s_c at the time t, and R the static compliance that
the coordinates q do not have. All tables are linear between the positions of a mesh
cycle. No step nor any function of the solver is shared, only the arrays of a model;
friction in its nominal sense. The right-hand side is smooth between two positions,
so each such piece is integrated by itself.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import root

from lumped.common.array_types import Array

if TYPE_CHECKING:
    from fegear.dynamics.model import DynamicModel


@dataclass(frozen=True, eq=False)
class DenseModel:
    """Dense matrices over n coordinates, tables over p + 1 positions and c contacts.

    inverse_mass, damping, stiffness : (n, n); load : (n,)
    turnover : (n, n) coordinates when teeth are counted anew, from those before
    penetration_rate, force_rows : (p + 1, c, n) penetration per coordinate, generalised
        force per load
    gap : (p + 1, c) [m]; compliance : (p + 1, c, c) [m/N]
    knots : (j + 1,) [m]; load_curve : (c, p + 1, j, 4) cubics by rising power
    errors : (n, c) what comes to the gap in n successive cycles [m]
    """

    inverse_mass: Array
    damping: Array
    stiffness: Array
    load: Array
    turnover: Array
    penetration_rate: Array
    force_rows: Array
    gap: Array
    compliance: Array
    knots: Array
    load_curve: Array
    errors: Array


def equations(model: DynamicModel) -> DenseModel:
    """Written out from the packed arrays of a model with one mesh."""
    body, rows, contacts = model.modal, model.jacobian, model.contacts
    h, e = body.damping.size, body.rigidity.size
    n = h + e
    mass, K = np.eye(n), np.zeros((n, n))
    for i in range(e):
        mass[:h, h + i] = mass[h + i, :h] = (
            body.coupling[i] * body.rotation[body.gear_of_mode[i]]
        )
    K[:h, :h] = body.stiffness
    K[h:, h:] = np.diag(body.rigidity)
    turnover = np.eye(n)
    for i in range(e):
        turnover[h + i, h + i] = body.cosine[i]
        if body.partner[i] != i:
            turnover[h + i, h + body.partner[i]] = body.sine[i]
    (width,), closing, rootward = rows.widths, rows.normal, rows.tangential
    closed, drawn = (np.zeros((*closing.shape[:2], n)) for _ in range(2))
    closed[..., rows.columns[0, :width]] = closing[..., :width]
    drawn[..., rows.columns[0, :width]] = rootward[..., :width]
    drag = float(rows.friction) * contacts.sliding  # (c, p + 1)
    push = closed + drag[..., None] * drawn
    tangential = drag.T[:, None, :] * contacts.tangential_compliance
    return DenseModel(
        inverse_mass=np.asarray(np.linalg.inv(mass), float),
        damping=np.diag(np.concatenate([body.damping, body.elastic_damping])),
        stiffness=K,
        load=np.concatenate([body.load, np.zeros(e)]),
        turnover=turnover,
        penetration_rate=closed.transpose(1, 0, 2),
        force_rows=push.transpose(1, 0, 2),
        gap=contacts.gap.T,
        compliance=contacts.normal_compliance + tangential,
        knots=contacts.knots[0],
        load_curve=contacts.load_curve[:, :, 0],
        errors=contacts.errors.T if contacts.errors.size else np.zeros((1, len(drag))),
    )


def pair_loads(
    e: DenseModel, position: int, part: float, squeeze: Array
) -> tuple[Array, Array]:
    """Loads (c,) at squeezes (c,) and their slopes, `part` of the way to the next."""
    inside = np.clip(squeeze, 0.0, e.knots[-1])
    cell = np.clip(np.searchsorted(e.knots, inside, "right") - 1, 0, e.knots.size - 2)
    x = inside - e.knots[cell]
    c = np.arange(squeeze.size)
    a = (1.0 - part) * e.load_curve[c, position, cell] + part * e.load_curve[
        c, position + 1, cell
    ]
    slope = a[:, 1] + x * (2.0 * a[:, 2] + 3.0 * x * a[:, 3])
    load = a[:, 0] + x * (a[:, 1] + x * (a[:, 2] + x * a[:, 3]))
    load += slope * np.maximum(squeeze - e.knots[-1], 0.0)
    touching = squeeze > 0.0
    return np.where(touching, load, 0.0), np.where(touching, slope, 0.0)


def contact_loads(
    e: DenseModel, position: int, part: float, q: Array, cycle: int = 0
) -> Array:
    """Loads (c,) that go with the displacement q; ArithmeticError if not found."""

    def between(table: Array) -> Array:
        return np.asarray((1.0 - part) * table[position] + part * table[position + 1])

    free = (
        between(e.penetration_rate) @ q
        - between(e.gap)
        - e.errors[cycle % len(e.errors)]
    )
    if (free < 0.0).all():
        return np.zeros(free.size)
    R = between(e.compliance)

    def error(squeeze: Array) -> tuple[Array, Array]:
        load, slope = pair_loads(e, position, part, squeeze)
        return (
            (squeeze + R @ load - free) / e.knots[-1],
            (np.eye(free.size) + R * slope) / e.knots[-1],
        )

    solution = root(error, free, jac=True, method="hybr", options={"xtol": 1e-13})
    if not np.abs(error(solution.x)[0]).max() < 1e-11:
        raise ArithmeticError(f"contact not solved: {solution.message}")
    return pair_loads(e, position, part, solution.x)[0]


def march(
    e: DenseModel,
    state: Array,
    frequency: float,
    periods: int,
    checks: int = 1,
    tolerance: float = 1e-10,
) -> tuple[Array, Array]:
    """(times (t,) [s], states (t, 2, n)) from a state (2, n) at the start of a cycle.

    checks : points that are recorded of every piece between two positions
    tolerance : of the solver, relative and in units of the largest coordinate
    """
    pieces, n = e.gap.shape[0] - 1, e.load.size
    length = 1.0 / (frequency * pieces)
    place_scale, speed_scale = np.abs(state).max(axis=1)
    vibration_speed = np.sqrt(np.median(np.diag(e.stiffness))) * place_scale
    scale = np.repeat([place_scale, max(speed_scale, vibration_speed)], n)
    now, states = state.copy(), [state.copy()]

    def derivative(time: float, y: Array, position: int, cycle: int) -> Array:
        q, v = y.reshape(2, n)
        part = min(max(time / length, 0.0), 1.0)
        push = (1.0 - part) * e.force_rows[position] + part * e.force_rows[position + 1]
        force = e.load - e.damping @ v - e.stiffness @ q
        force = force - contact_loads(e, position, part, q, cycle) @ push
        return np.concatenate([v, e.inverse_mass @ force])

    for number in range(periods * pieces):
        position = number % pieces
        if number and position == 0:
            now = now @ e.turnover.T
            states[-1] = now.copy()
        segment = solve_ivp(
            derivative,
            (0.0, length),
            now.ravel(),
            method="DOP853",
            t_eval=length * np.arange(1, checks + 1) / checks,
            args=(position, number // pieces),
            rtol=tolerance,
            atol=tolerance * scale,
        )
        if not segment.success:
            raise ArithmeticError(f"motion not solved: {segment.message}")
        states += list(segment.y.T.reshape(-1, 2, n))
        now = states[-1].copy()
    times = length / checks * np.arange(len(states))
    return times, np.array(states)
