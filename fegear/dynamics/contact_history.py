"""Contact position, pressure and friction over time."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fegear.contact.pair_load_curves import NOMINAL, PairLoadCurves, ToothLoadCurves
from fegear.dynamics.model import DynamicModel
from fegear.dynamics.sides import DRIVE, ContactSide
from fegear.dynamics.stepper import FeHistory
from fegear.elasticity.root_stress import FlankLoad
from lumped.common.array_types import Array, Indices
from lumped.kernels.contact import MIN_REVERSING_SPEED

GRID_ATOL = 1e-6  # of a cell of the pair laws within which a position is on the grid


@dataclass(frozen=True, eq=False)
class ContactHistory:
    """One tooth pair on one side of a mesh, at t times.

    pair_index : of the pair in its side
    load : (t,) [N]
    friction : (t,) friction toward the roots over the load, negative toward the tips
    grid_indices, weights : (t, 2) points of the laws' grid between which it is
    number : (t,) of the pair's teeth in `DifferentTeeth`, 0 for those like the others
    """

    side: ContactSide
    pair_index: int
    load: Array
    friction: Array
    grid_indices: Indices
    weights: Array
    number: Indices

    @property
    def pair_offset(self) -> int:
        """Base pitches by which the pair is ahead of the reference pair."""
        return int(self.side.load_curves.pair_offsets[self.pair_index])

    @property
    def name(self) -> str:
        """Column name, such as mesh1_pair0."""
        kind = "pair" if self.side.flank_sign == DRIVE else "back"
        return f"mesh{self.side.mesh + 1}_{kind}{self.pair_offset}"

    def tooth(self, gear: int) -> int:
        """Its tooth of a gear, clockwise from the gear's first tooth."""
        return int(self.side.teeth(gear)[self.pair_index])

    def flank_load(self, gear: int, reference_tooth: int, rows: slice) -> FlankLoad:
        """Load on a gear at some times, seen from its tooth `reference_tooth`."""
        width = self.side.gear_set.common_width(self.side.mesh)
        normal = self.load[rows] / width
        arcs = self.side.arcs(gear)[:, self.pair_index]
        return FlankLoad(
            self.tooth(gear) - reference_tooth,
            self.side.flank,
            interpolate(arcs, self.grid_indices[rows], self.weights[rows]),
            normal,
            self.friction[rows] * normal,
        )

    @property
    def pressure(self) -> Array:
        """Largest contact pressure (t,), linear in the root of the load as Hertz's."""
        pressure = self._pressure_where(self.number == 0, self.side.load_curves)
        differences = self.side.differences
        for number, curves in enumerate(differences.curves if differences else (), 1):
            pressure += self._pressure_where(self.number == number, curves)
        return pressure

    def _pressure_where(
        self, is_chosen: NDArray[np.bool_], curves: PairLoadCurves | ToothLoadCurves
    ) -> Array:
        """Pressure (t,) at chosen times by the curves of the teeth, 0 elsewhere."""
        loads = curves.load[:, self.pair_index, NOMINAL]
        pressures = curves.pressure[:, self.pair_index]
        pressure = np.zeros(self.load.size)
        for grid_points, weight in zip(
            self.grid_indices.T, self.weights.T, strict=True
        ):
            is_touching = is_chosen & (self.load > 0.0) & (weight > 0.0)
            for p in np.unique(grid_points[is_touching]):
                is_at_point = is_touching & (grid_points == p)
                load_root = np.sqrt(self.load[is_at_point] / loads[p, -1])
                knots = np.sqrt(loads[p] / loads[p, -1])
                peak = np.interp(load_root, knots, pressures[p]) * np.maximum(
                    load_root, 1.0
                )
                pressure[is_at_point] += weight[is_at_point] * peak
        return pressure


def interpolate(values: Array, grid_indices: Indices, weights: Array) -> Array:
    """Interpolate values (p,) on the grid of the load curves over time (t,)."""
    return (values[grid_indices] * weights).sum(axis=1)


def cycle_position(rate: float, count: int, steps_per_cycle: int) -> Array:
    """Part of its cycle that a mesh has passed (count,), 0 to 1."""
    cycles = rate * np.arange(count) / steps_per_cycle
    return np.maximum(cycles - np.floor(cycles + 1e-9), 0.0)


def contact_histories(
    model: DynamicModel, motion: FeHistory, steps_per_cycle: int
) -> list[ContactHistory]:
    """All contacts in the order of the model.

    steps_per_cycle : of the first mesh
    """
    rotation = _rotation_speeds(model, motion, steps_per_cycle)
    histories: list[ContactHistory] = []
    for side in model.sides:
        position = cycle_position(
            model.kinematics.rate[side.mesh], len(motion.pair_load), steps_per_cycle
        )
        cells = len(side.load_curves.gap) - 1
        first_points = np.minimum(
            (position * cells + GRID_ATOL).astype(np.int64), cells - 1
        )
        fraction = position * cells - first_points
        fraction = np.where(np.abs(fraction) < GRID_ATOL, 0.0, fraction)
        grid_indices = np.stack([first_points, first_points + 1], axis=1)
        numbers = _numbers_of_teeth(
            side, model.kinematics.rate[side.mesh], position, steps_per_cycle
        )
        for pair_index, number in enumerate(numbers):
            # flanks that do not face each other have no law
            is_facing = _is_facing(side, pair_index)[number[:, None], grid_indices]
            weights = np.stack([1.0 - fraction, fraction], axis=1) * is_facing
            weight_sum = weights.sum(axis=1, keepdims=True)
            weights = weights / np.where(weight_sum > 0.0, weight_sum, 1.0)
            index = len(histories)
            friction = _signed_friction(
                model, index, rotation[:, side.gears], grid_indices, weights
            )
            load = motion.pair_load[:, index] + 0.0  # no negative zeros
            interpolation = grid_indices, weights, number
            histories.append(
                ContactHistory(side, pair_index, load, friction, *interpolation)
            )
    return histories


def _numbers_of_teeth(
    side: ContactSide, rate: float, position: Array, steps_per_cycle: int
) -> Indices:
    """Numbers (k, t) of the teeth of each contact, see `DifferentTeeth`.

    position : (t,) part of the cycle of the mesh
    """
    shape = side.load_curves.pair_offsets.size, position.size
    if side.differences is None:
        return np.zeros(shape, np.int64)
    passed_cycles = rate * np.arange(position.size) / steps_per_cycle
    cycle = np.rint(passed_cycles - position).astype(np.int64)
    number = side.differences.number
    return number[:, cycle % number.shape[1]]


def _is_facing(side: ContactSide, pair_index: int) -> NDArray[np.bool_]:
    """Whether flanks of a contact face each other (v + 1, p), by their number."""
    loads = [side.load_curves.load]
    if side.differences is not None:
        loads += [curves.load for curves in side.differences.curves]
    return np.stack([load[:, pair_index, NOMINAL, -1] for load in loads]) > 0.0


def _rotation_speeds(
    model: DynamicModel, motion: FeHistory, steps_per_cycle: int
) -> Array:
    """Speed of every gear in its nominal sense (t, gears) [rad/s]."""
    nominal_speed = model.kinematics.speed
    time = motion.time
    angular = 2.0 * math.pi * (time.size - 1) / (steps_per_cycle * time[-1])
    hub_rotation = motion.hub[:, 1] @ model.modal.rotation.T
    return (angular * nominal_speed + hub_rotation) * np.sign(nominal_speed)


def _signed_friction(
    model: DynamicModel,
    index: int,
    rotation: Array,
    grid_indices: Indices,
    weights: Array,
) -> Array:
    """Friction (t,) over load, directed as by `kernels.contact.set_reversed`."""
    friction = float(model.jacobian.friction)
    if friction == 0.0:
        return np.zeros(len(rotation))
    contacts = model.contacts
    nominal_sliding, driver_arm, driven_arm = (
        interpolate(values[index], grid_indices, weights)
        for values in (contacts.sliding, *contacts.arms)
    )
    slip = rotation[:, 0] * driver_arm - rotation[:, 1] * driven_arm
    is_reversed = contacts.side[index] * slip * nominal_sliding > MIN_REVERSING_SPEED
    return friction * nominal_sliding * np.where(is_reversed, -1.0, 1.0)
