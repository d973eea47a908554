"""Contact forces where the approach of the gears is given, as it is in motion.

All pairs together: what the pair laws of the dynamics are measured by.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fegear.contact.offset_centers import moved_lines
from fegear.contact.pairs import (
    PairTeeth,
    back_side_position,
    candidate_pairs,
    different_teeth,
    pair_gaps,
)
from fegear.contact.plane.constants import Conditions
from fegear.contact.plane.solve import solve_drive_side
from fegear.contact.problem import ContactProblem
from lumped.common.array_types import Array
from lumped.train.system import LumpedSystem


@dataclass(frozen=True)
class Instants:
    """Contact at n instants, k tooth pairs.

    teeth : (k,) base pitches by which each pair is ahead of the reference pair
    torque : (n,) on the driver that holds the approach [N m], negative on the back
        side
    slope : (n,) of torque over base radius over approach [N/m], 0 without contact
    load : (n, k) normal force of each pair [N], negative on the back side
    pressure : (n, k) largest contact pressure [Pa]
    """

    teeth: NDArray[np.int64]
    torque: Array
    slope: Array
    load: Array
    pressure: Array


def contact_at(
    problem: ContactProblem, positions: ArrayLike, approaches: ArrayLike
) -> Instants:
    """Contact at positions (n,) with the approaches (n,) given [m].

    approach : the driver's rotation times its base radius with the driven gear held,
        from where unmodified flanks touch; contact is lost between the drive side
        and minus the backlash, beyond which the back flanks touch

    Raises ContactFailure where no solution was found and ValueError for positions
    or approaches that are not finite.
    """
    position, approach = (np.array(v, float, ndmin=1) for v in (positions, approaches))
    if position.shape != approach.shape:
        raise ValueError(
            f"approaches must have shape {position.shape}, got {approach.shape}"
        )
    if not (np.isfinite(position).all() and np.isfinite(approach).all()):
        raise ValueError("positions and approaches must be finite")
    back = approach < -0.5 * problem.pair.backlash
    mirrored = np.where(back, back_side_position(problem.pair, position), position)
    depth = np.where(back, -(problem.pair.backlash + approach), approach)
    sides = [
        _one_side(problem, mirrored[here], depth[here], on_back)
        for on_back, here in enumerate((~back, back))
    ]
    return _together(back, *sides)


def integrated_deflection(
    problem: ContactProblem,
    system: LumpedSystem,
    torque: float,
    state: Array,
    steps: range,
    frequency: float,
    cycle_steps: int,
) -> list[float]:
    """Deflection of two rigid gears at steps from 0 on, by classical steps.

    Contact of all pairs is solved anew at each instant; no pair laws.

    state : deflection and its rate at the first step; steps : of the motion,
        cycle_steps in a mesh cycle
    """
    train, radius = system.train, system.train.gears[0].base_radius
    mass = 1.0 / sum(g.base_radius**2 / g.inertia for g in train.gears)
    damping = 2.0 * train.damping_ratio * np.sqrt(system.modes.mean_stiffness[0] * mass)

    def slope(x: float, state: Array) -> Array:
        force = contact_at(problem, [x], [state[0]]).torque[0] / radius
        push = torque / radius - damping * state[1] - force
        return np.array([state[1], push / mass])

    h, deflection = 1.0 / (frequency * cycle_steps), []
    for step in steps:
        x, half = step / cycle_steps, 0.5 / cycle_steps
        if step >= 0:
            deflection.append(state[0])
        one = slope(x, state)
        two = slope(x + half, state + 0.5 * h * one)
        three = slope(x + half, state + 0.5 * h * two)
        four = slope(x + 2.0 * half, state + h * three)
        state = state + h / 6.0 * (one + 2.0 * two + 2.0 * three + four)
    return deflection


def _one_side(
    problem: ContactProblem, position: Array, approach: Array, back: int
) -> Instants:
    """All instants as if on the drive side; back : 1 for those of the back flanks."""
    if not position.size:
        return Instants(np.empty(0, np.int64), *_nothing())
    whole = np.floor(position)
    teeth = candidate_pairs(problem, position - whole)
    passed = teeth - whole.astype(np.int64)[:, None]
    gaps = pair_gaps(problem, passed, back == 1)
    place, lines, offset = moved_lines(
        problem.pair,
        problem.offsets,
        position - whole,
        whole.astype(np.int64),
        back == 1,
    )
    gaps = gaps + offset[:, None]
    different = different_teeth(problem, passed, back == 1)
    if different is None:
        arguments = problem, teeth, gaps, place, approach
        rows, cells = solve_drive_side(*arguments, Conditions(lines=lines))
    else:
        solved = [
            solve_drive_side(
                *(problem, teeth, gaps[[i]], place[[i]], approach[[i]]),
                Conditions(
                    PairTeeth(different.driver[i], different.driven[i]),
                    lines[i : i + 1],
                ),
            )
            for i in range(position.size)
        ]
        rows, cells = (
            np.concatenate(parts).view(np.recarray)
            for parts in zip(*solved, strict=True)
        )
    width = problem.face_width
    mu = problem.friction * cells.sliding_sign
    arm = cells.moment_arms[..., 0] - mu * cells.moment_arms[..., 2]
    load = cells.load * width
    slope = np.where(load.any(axis=1), rows.slope * width, 0.0)
    return Instants(teeth, (load * arm).sum(axis=1), slope, load, cells.pressure)


def _nothing() -> tuple[Array, ...]:
    return np.empty(0), np.empty(0), np.empty((0, 0)), np.empty((0, 0))


def _together(back: NDArray[np.bool_], drive: Instants, coast: Instants) -> Instants:
    """Instants of both sides in their order; pairs are matched by tooth."""
    teeth = np.union1d(drive.teeth, -coast.teeth)
    torque, slope = np.zeros(back.size), np.zeros(back.size)
    load, pressure = (np.zeros((back.size, teeth.size)) for _ in range(2))
    for side, sign, part in ((~back, 1.0, drive), (back, -1.0, coast)):
        if not side.any():
            continue
        columns = np.searchsorted(teeth, (sign * part.teeth).astype(np.int64))
        where = np.ix_(side, columns)
        torque[side], slope[side] = sign * part.torque, part.slope
        load[where], pressure[where] = sign * part.load, part.pressure
    return Instants(teeth, torque, slope, load, pressure)
