"""Small changes of a motion of the coupled model, carried along with it, compiled.

All k changes pass through a step together: loops run along them.
"""

from __future__ import annotations

import math

import numpy as np

from lumped.common.compiled import allocating, compiled_part, inlined
from lumped.kernels.arrays import CoupledChanges
from lumped.kernels.contact import SLOPES_ROW, load_at
from lumped.kernels.coupled_variables import (
    FORCE_NODES,
    add_columns,
    get_variables,
    set_variables,
)
from lumped.kernels.elimination import eliminate


@allocating
def new_changes(system, steps, count):
    n, w, c = system.load.size, system.whirl.size, steps.load.size
    size = 2 * (n - 2 * w)
    return CoupledChanges(
        np.zeros((size, count)),
        np.zeros((2, 2, w, count)),
        np.zeros((FORCE_NODES, n, count)),
        np.zeros((n, count)),
        np.zeros((5 * size // 2, count)),
        np.zeros((size, count)),
        np.zeros((2, 2, w, count)),
        np.zeros((c, c + count)),
    )


@compiled_part
def set_changes(steps, changes, state):
    """Take up changes, state (2, n (1 + k)) one after the other behind the motion."""
    rates, (n, count) = steps.propagator.rates, changes.q.shape
    for k in range(count):
        block = slice((k + 1) * n, (k + 2) * n)
        start_state, waves = changes.start_state[:, k], changes.start_waves[..., k]
        set_variables(rates, state[0, block], state[1, block], start_state, waves)


@compiled_part
def get_changes(steps, changes, state):
    rates, (n, count) = steps.propagator.rates, changes.q.shape
    for k in range(count):
        block = slice((k + 1) * n, (k + 2) * n)
        end_state, waves = changes.state[:, k], changes.waves[..., k]
        get_variables(rates, end_state, waves, state[0, block], state[1, block])


@inlined
def set_displacement(changes):
    a, w = changes.state.shape[0] // 2, changes.waves.shape[2]
    waves, q, state = changes.waves, changes.q, changes.state
    for i in range(a):
        for k in range(q.shape[1]):
            q[i, k] = state[i, k]
    for p in range(w):
        for k in range(q.shape[1]):
            q[a + p, k] = waves[0, 0, p, k] + waves[1, 0, p, k]
            q[a + w + p, k] = -waves[0, 1, p, k] - waves[1, 1, p, k]


@compiled_part
def advance_linear_part(steps, head, changes):
    """The linear part through a step, under the forces that are known."""
    transition, state, inputs = (
        steps.propagator.transition,
        changes.state,
        changes.inputs,
    )
    size, count = state.shape
    for i in range(size):
        for k in range(count):
            inputs[i, k] = state[i, k]
            state[i, k] = 0.0
    for back in range(1, FORCE_NODES):
        force = changes.force[(head + FORCE_NODES - back) % FORCE_NODES]
        begin = (back + 1) * (size // 2)
        for i in range(size // 2):
            for k in range(count):
                inputs[begin + i, k] = force[i, k]
    for i in range(size):
        add_columns(inputs, transition[:, i], state[i])
    for s in range(2):
        factors = steps.propagator.waves[s]
        for p in range(changes.waves.shape[2]):
            real, imaginary = changes.waves[s, 0, p], changes.waves[s, 1, p]
            multiply_wave(factors[0, p], factors[1, p], real, imaginary)
            for back in range(1, FORCE_NODES):
                force = changes.force[(head + FORCE_NODES - back) % FORCE_NODES]
                row = 2 * back + 2
                add_wave_forces(factors, row, changes, p, force, real, imaginary)


@inlined
def multiply_wave(a, b, real, imaginary):
    """A wave, in real and imaginary parts (k,), times a + i b."""
    for k in range(real.size):
        x, y = real[k], imaginary[k]
        real[k] = a * x - b * y
        imaginary[k] = a * y + b * x


@inlined
def add_wave_forces(factors, row, changes, p, force, real, imaginary):
    """Add what forces (n, k) do to wave p, by two rows of the factors."""
    i, a, b = changes.state.shape[0] // 2 + p, factors[row, p], factors[row + 1, p]
    one, two = force[i], force[i + changes.waves.shape[2]]
    for k in range(real.size):
        real[k] += a * one[k] + b * two[k]
        imaginary[k] += b * one[k] - a * two[k]


@compiled_part
def add_end_forces(steps, head, changes):
    """Add what the newest forces do in the step."""
    response, force, w = (
        steps.propagator.force_response,
        changes.force[head],
        changes.waves.shape[2],
    )
    size = changes.state.shape[0]
    for i in range(size):
        add_columns(force, response[:, i], changes.state[i])
    for s in range(2):
        factors = steps.propagator.waves[s]
        for p in range(w):
            real, imaginary = changes.waves[s, 0, p], changes.waves[s, 1, p]
            add_wave_forces(factors, 2, changes, p, force, real, imaginary)


@inlined
def set_changed_forces(steps, i, n_active, head, changes):
    """Forces of the changes at node i, about the loads that were found.

    x + Q F' x = B q for every change: Q as `find_loads` of
    `lumped.kernels.coupled_steps` left it.
    """
    problem, matrix, rows = steps.problem, changes.matrix, steps.grid.rows
    n, count = changes.q.shape
    standing, w = changes.state.shape[0] // 2, changes.waves.shape[2]
    width = (rows.shape[2] - standing) // 2
    for a in range(n_active):
        c = problem.active[a]
        _, problem.newton[SLOPES_ROW, a] = load_at(problem, c, steps.penetration[c])
    for a in range(n_active):
        for b in range(n_active):
            matrix[a, b] = problem.Q[a, b] * problem.newton[SLOPES_ROW, b]
        matrix[a, a] += 1.0
        c, rhs = problem.active[a], matrix[a, n_active : n_active + count]
        for k in range(count):
            rhs[k] = 0.0
        row, one = rows[i, c], standing + steps.grid.first_wave[c]
        add_columns(changes.q, row[:standing], rhs)
        add_columns(changes.q[one:], row[standing : standing + width], rhs)
        add_columns(changes.q[one + w :], row[standing + width :], rhs)
    eliminate(matrix, n_active, n_active + count)
    force = changes.force[head]
    for j in range(n):
        for k in range(count):
            force[j, k] = 0.0
    for a in range(n_active):
        c, slope = problem.active[a], problem.newton[SLOPES_ROW, a]
        first, penetration = steps.grid.first_wave[c], matrix[a, n_active:]
        for p in range(rows.shape[2]):
            factor = rows[i, c, p] * slope
            j = p if p < standing else p + first
            if p >= standing + width:
                j += w - width
            for k in range(count):
                force[j, k] -= factor * penetration[k]


@compiled_part
def start_changes(steps, n_active, motion, changes):
    """To the start, with the forces there."""
    state, waves = changes.state, changes.waves
    for k in range(changes.q.shape[1]):
        for i in range(state.shape[0]):
            state[i, k] = changes.start_state[i, k]
        for s in range(2):
            for p in range(waves.shape[2]):
                waves[s, 0, p, k] = changes.start_waves[s, 0, p, k]
                waves[s, 1, p, k] = changes.start_waves[s, 1, p, k]
    set_displacement(changes)
    set_changed_forces(steps, 0, n_active, motion.head[0], changes)


@compiled_part
def advance_changes(steps, i, n_active, motion, changes):
    """A step to node i of the common period, to which the motion has come."""
    head = motion.head[0]
    advance_linear_part(steps, head, changes)
    set_displacement(changes)
    set_changed_forces(steps, i, n_active, head, changes)
    add_end_forces(steps, head, changes)


@compiled_part
def normalise_perturbations(changes, state, angular):
    """Bring changes back to length 1 together; logarithm of their length before."""
    n, square = angular.size, 0.0
    for i in range(n, state.shape[1]):
        square += state[0, i] ** 2 + (state[1, i] / angular[i % n]) ** 2
    length = math.sqrt(square)
    waves = changes.waves
    for k in range(changes.q.shape[1]):
        for i in range(changes.state.shape[0]):
            changes.state[i, k] /= length
        for s in range(2):
            for p in range(waves.shape[2]):
                waves[s, 0, p, k] /= length
                waves[s, 1, p, k] /= length
        for slot in range(FORCE_NODES):
            for i in range(n):
                changes.force[slot, i, k] /= length
    return math.log(length)
