"""Implicit steps with all freedoms of the finite elements.

Every gear keeps its elastic displacement relative to its hub as a field over its
sectors; one factorisation of a sector serves all steps of a size. A step solves once
for the fields. Halfway, when interior freedoms are eliminated and not yet substituted
back, displacement at the contacts without new forces is a product of two columns; it
gives the forces, and their loads are added there. Load curves and hub coordinates are
those of the reduced model.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from fegear.dynamics.elastic import Rayleigh
from fegear.dynamics.elastic_fields import (
    CycleInterpolator,
    ElasticField,
    EliminatedField,
    FieldStep,
    Stencil,
    angular_momentum,
    elastic_field,
    eliminate_interior_freedoms,
    field_step,
)
from fegear.dynamics.kernels import full as kernel
from fegear.dynamics.model import DynamicModel, dynamic_model
from fegear.dynamics.sides import MeshLoadCurves, contact_sides
from fegear.dynamics.stepper import (
    DynamicsError,
    FeHistory,
    ImplicitStepper,
    MotionState,
    TimeSteps,
    empty_record,
    history_from_record,
)
from fegear.elasticity.cyclic_gear import CyclicGear
from fegear.gearset.model import GearSet
from lumped.common.array_types import Array, Indices
from lumped.steady.steady_state import Diverged
from lumped.train.system import LumpedSystem

STEPS_PER_PIECE = 64  # some take a tenth of a second


def full_model(
    gear_set: GearSet,
    reference: LumpedSystem,
    load_curves: Sequence[MeshLoadCurves],
    cyclic_gears: Sequence[CyclicGear],
    damping: Sequence[Rayleigh],
    cross_mesh_compliance: Array | None = None,
) -> tuple[DynamicModel, tuple[ElasticField, ...]]:
    """Hubs and contacts as in a reduced model without modes, and the gears' fields.

    Arguments as for `dynamic_model`, with the finite elements of the gears.
    """
    sides = contact_sides(gear_set, load_curves)
    n_load_directions = 2 if load_curves[0].friction > 0.0 else 1
    fields = tuple(
        elastic_field(
            gear_index, sides, cyclic_gear, gear.face_width, rayleigh, n_load_directions
        )
        for gear_index, (gear, cyclic_gear, rayleigh) in enumerate(
            zip(gear_set.gears, cyclic_gears, damping, strict=True)
        )
    )
    positions = len(sides[0].load_curves.gap)
    contacts = sum(side.load_curves.pair_offsets.size for side in sides)
    extra_compliance = np.zeros((2, positions, contacts, contacts))
    if cross_mesh_compliance is not None:
        extra_compliance[0] += cross_mesh_compliance
    for field in fields:
        static_compliance = field.compliance(field.cyclic_gear.factorised(0.0, 1.0))
        all_directions_and_positions = (
            np.arange(n_load_directions),
            np.arange(positions),
        )
        field_block = np.ix_(
            *all_directions_and_positions, field.contacts, field.contacts
        )
        extra_compliance[field_block] -= static_compliance / field.width
    no_elastic_bodies = [None] * len(gear_set.gears)
    hub_model = dynamic_model(
        gear_set,
        reference,
        load_curves,
        no_elastic_bodies,
        (extra_compliance[0], extra_compliance[1]),
    )
    return hub_model, fields


@dataclass(frozen=True, eq=False)
class FullStepMatrices:
    """Matrices of hubs and gears for a step size [s]."""

    size: float
    mass: float
    hub_inverse: Array
    fields: tuple[FieldStep, ...]


@dataclass(frozen=True, eq=False)
class FullStepper(ImplicitStepper):
    """Hubs and fields; a state holds (4, unknowns, teeth) of every gear."""

    fields: tuple[ElasticField, ...]

    def unloaded(self) -> MotionState:
        model = self.model
        return MotionState(
            np.zeros((4, model.size)),
            np.zeros((3, model.contact_count)),
            tuple(
                np.zeros((4, f.cyclic_gear.unknowns, f.cyclic_gear.teeth))
                for f in self.fields
            ),
        )

    def integrate(
        self, state: MotionState, steps: TimeSteps
    ) -> tuple[MotionState, FeHistory]:
        model, step_matrices = self.model, self._step_matrices(steps.size)
        frequency, cycle = steps.frequency, steps.cycle
        new_state, record = state.copy(), empty_record(self.model, steps.count)
        arrays, limit = model.arrays, model.limit
        kernel.record(arrays, new_state.motion, new_state.contact, record, 0)
        for n in range(steps.count):
            if frequency > 0.0:
                self._pass_teeth(new_state, steps.start + n, cycle)
            interpolator = self._interpolator_at(
                steps.start + n + 1 if frequency > 0.0 else 0, cycle
            )
            self._advance_step(
                new_state, step_matrices, 2.0 * math.pi * frequency, interpolator
            )
            if not np.abs(new_state.motion[1]).sum() < limit:
                raise Diverged(n / (cycle * self.system.common_period[0]))
            kernel.record(arrays, new_state.motion, new_state.contact, record, n + 1)
        return new_state, history_from_record(steps.size, record)

    def steps_per_piece(self, cycle: int) -> int:
        return STEPS_PER_PIECE

    @lru_cache(maxsize=2)  # noqa: B019  a stepper lives as long as its run
    def _step_matrices(self, size: float) -> FullStepMatrices:
        wm, wc, wk = weights = self.scheme.weights(size)
        modal = self.model.modal
        matrix = wk * modal.stiffness + np.diag(wm + wc * modal.damping)
        fields = tuple(field_step(f, weights) for f in self.fields)
        for f, s in zip(self.fields, fields, strict=True):
            hub_rotation_row = modal.rotation[f.gear_index]
            matrix -= (
                wm**2
                * f.width
                * s.rotation_momentum
                * np.outer(hub_rotation_row, hub_rotation_row)
            )
        inverse = np.asarray(np.linalg.inv(matrix), float)
        return FullStepMatrices(size, wm, inverse, fields)

    def _pass_teeth(self, state: MotionState, step_number: int, cycle: int) -> None:
        """Shift the tooth index of gears that pass a tooth."""
        kinematics = self.model.kinematics
        for f, field in zip(self.fields, state.fields, strict=True):
            rate = kinematics.rate[kinematics.first_mesh[f.gear_index]]
            cycles_before, cycles_after = np.floor(
                rate * np.array([step_number, step_number + 1]) / cycle + 1e-9
            )
            if cycles_after > cycles_before:
                sense = f.sign * int(np.sign(kinematics.speed[f.gear_index]))
                field[:] = np.roll(field, -sense, axis=2)

    def _interpolator_at(self, step_number: int, cycle: int) -> CycleInterpolator:
        """Interpolator of the tables at a step.

        cycle : steps of a cycle of the first mesh
        """
        model = self.model
        rate, contacts = model.kinematics.rate, model.contacts
        position = kernel.find_position(rate, contacts, cycle, step_number)
        return CycleInterpolator(model.jacobian.mesh_of, position)

    def _advance_step(
        self,
        state: MotionState,
        step: FullStepMatrices,
        speed: float,
        interpolator: CycleInterpolator,
    ) -> None:
        """One step; `interpolator` at its end."""
        s, h, weight_new = self.scheme, step.size, 1.0 - self.scheme.alpha_f
        modal, rotation = self.model.modal, self.model.modal.rotation
        q, v, a, contact_force = state.motion
        u_pred, v_pred = s.predicted(h, state.motion)
        rhs = modal.load - s.alpha_m * a + s.alpha_f * contact_force
        rhs -= modal.damping * (weight_new * v_pred + s.alpha_f * v)
        rhs -= modal.stiffness @ (weight_new * u_pred + s.alpha_f * q)
        newmark = s.newmark(h)
        fields = []
        for f, gear_step, field in zip(
            self.fields, step.fields, state.fields, strict=True
        ):
            hub_rotation_row = rotation[f.gear_index]
            turn = s.alpha_m * float(hub_rotation_row @ a)
            eliminated = eliminate_interior_freedoms(
                f, gear_step, field, newmark, turn, interpolator
            )
            inertial_moment = (
                s.alpha_m * angular_momentum(f, field[2])
                + step.mass * eliminated.momentum
            )
            rhs += f.width * inertial_moment * hub_rotation_row
            fields.append((f, gear_step, eliminated, field))
        free_hub_acceleration = step.hub_inverse @ rhs
        friction = self._signed_friction(state, interpolator, speed, v_pred)
        forces = self._solve_contact_forces(
            state, step, interpolator, friction, (u_pred, free_hub_acceleration), fields
        )
        rhs = weight_new * state.motion[3]
        for (f, gear_step, _, _), force in zip(fields, forces, strict=True):
            for kind, rotation_response in enumerate(gear_step.rotation_at_contacts):
                moment = force[kind] @ interpolator.interpolate(
                    rotation_response, f.contacts
                )
                rhs += weight_new * step.mass * moment * rotation[f.gear_index]
        acceleration = free_hub_acceleration + step.hub_inverse @ rhs
        state.motion[:3] = s.corrected(h, state.motion, acceleration)
        for (f, gear_step, eliminated, field), force in zip(
            fields, forces, strict=True
        ):
            hub_turn = step.mass * float(rotation[f.gear_index] @ acceleration)
            add_contact_loads(gear_step, eliminated, weight_new / f.width * force)
            gear_step.factors.substitute(eliminated.x)
            turn_field = (eliminated.turn + hub_turn) * gear_step.rotation_field
            kernel.correct(
                newmark,
                eliminated.x,
                eliminated.elastic,
                gear_step.stiffness,
                turn_field,
                field,
            )
            set_contact_load(f, eliminated.stencils, force / f.width, field[3])

    def _solve_contact_forces(
        self,
        state: MotionState,
        step: FullStepMatrices,
        interpolator: CycleInterpolator,
        friction: Array,
        motion: tuple[Array, Array],
        fields: list[FieldInStep],
    ) -> list[Array]:
        """New contact forces (2, k) on each gear, inward and toward the root [N].

        friction : (c,) signed coefficient
        motion : u_pred and accelerations of the hubs without the new forces
        fields : without them and without the hub's turn
        """
        s, h, model = self.scheme, step.size, self.model
        jacobian, contacts, mesh_of = (
            model.jacobian,
            model.contacts,
            interpolator.mesh_of,
        )
        all_contacts = np.arange(mesh_of.size)
        rows = np.stack(
            [
                interpolator.interpolate(row.swapaxes(0, 1), all_contacts)
                for row in (jacobian.normal, jacobian.tangential)
            ]
        )
        u_pred, free_hub_acceleration = motion
        free_penetration = rows[0] @ (u_pred + s.beta * h * h * free_hub_acceleration)
        free_penetration -= interpolator.interpolate(
            interpolator.position.gap.T, all_contacts
        )
        for f, gear_step, eliminated, field in fields:
            hub_turn = step.mass * float(
                model.modal.rotation[f.gear_index] @ free_hub_acceleration
            )
            free_penetration[f.contacts] -= eliminated.inward_displacement(
                f, gear_step, s.newmark(h), field, eliminated.turn + hub_turn
            )
        Q = self._step_compliance(step, interpolator, friction, rows)
        status = kernel.find_loads(
            contacts, mesh_of, Q, free_penetration, interpolator.position, state.contact
        )
        if status != kernel.CONVERGED:
            raise DynamicsError(f"contact not solved in a step of {h:g} s")
        load = state.contact[1]
        state.motion[3] = -(rows[0] + friction[:, None] * rows[1]).T @ load
        normal_and_friction = np.stack([load, friction * load])
        return [normal_and_friction[:, f.contacts] for f in self.fields]

    def _step_compliance(
        self,
        step: FullStepMatrices,
        interpolator: CycleInterpolator,
        friction: Array,
        rows: Array,
    ) -> Array:
        """Penetration (c, c) of a contact at the step's end per load on another [m/N].

        rows : (2, c, h) normal and tangential rows of the hubs
        """
        contacts, s = self.model.contacts, self.scheme
        all_contacts = np.arange(friction.size)
        compliance_factor = s.beta * step.size**2 * (1.0 - s.alpha_f)
        condensed_rows = rows.copy()
        contact_compliance = interpolator.interpolate(
            contacts.normal_compliance, all_contacts
        )
        contact_compliance += (
            interpolator.interpolate(contacts.tangential_compliance, all_contacts)
            * friction
        )
        for f, gear_step in zip(self.fields, step.fields, strict=True):
            hub_rotation_row, field_contacts = (
                self.model.modal.rotation[f.gear_index],
                f.contacts,
            )
            field_block = np.ix_(field_contacts, field_contacts)
            for kind, factor in enumerate(
                (1.0, friction[field_contacts])[: f.n_load_directions]
            ):
                rotation_response = interpolator.interpolate(
                    gear_step.rotation_at_contacts[kind], field_contacts
                )
                condensed_rows[kind, field_contacts] -= (
                    step.mass * rotation_response[:, None] * hub_rotation_row
                )
                contact_compliance[field_block] += (
                    compliance_factor
                    / f.width
                    * interpolator.interpolate(
                        gear_step.compliance[kind], field_contacts
                    )
                    * factor
                )
        force_rows = condensed_rows[0] + friction[:, None] * condensed_rows[1]
        return np.asarray(
            contact_compliance
            + compliance_factor * (condensed_rows[0] @ step.hub_inverse @ force_rows.T)
        )

    def _signed_friction(
        self,
        state: MotionState,
        interpolator: CycleInterpolator,
        speed: float,
        v_pred: Array,
    ) -> Array:
        """Coefficient of friction toward the roots of each contact (c,)."""
        friction, contacts = self.model.jacobian.friction, self.model.contacts
        if not friction > 0.0:
            return np.zeros(self.model.contact_count)
        state.contact[2] = self._find_reversed_friction(interpolator, speed, v_pred)
        sliding = interpolator.interpolate(
            contacts.sliding.T, np.arange(len(contacts.sliding))
        )
        return np.where(state.contact[2] == 1, -1.0, 1.0) * friction * sliding

    def _find_reversed_friction(
        self, interpolator: CycleInterpolator, speed: float, v_pred: Array
    ) -> Indices:
        """Whether each contact (c,) slides against its nominal direction."""
        kinematics = self.model.kinematics
        rotation = speed * kinematics.speed + self.model.modal.rotation @ v_pred
        rotation *= np.sign(kinematics.speed)
        contacts = self.model.contacts
        return np.asarray(
            kernel.find_reversed(
                contacts, rotation[kinematics.gears], interpolator.position
            )
        )


FieldInStep = tuple[ElasticField, FieldStep, EliminatedField, Array]


def add_contact_loads(
    step: FieldStep, eliminated: EliminatedField, force: Array
) -> None:
    """Add the loads of forces (2, k) per unit width to a field."""
    loaded = np.flatnonzero(force.any(axis=0))
    if loaded.size:
        teeth = np.array([eliminated.stencils[c].tooth for c in loaded])
        loaded_forces, rows = (
            force[: len(eliminated.condensed), loaded],
            eliminated.condensed[:, loaded],
        )
        loads = (loaded_forces[:, :, None] * rows).sum(axis=0)
        step.factors.add_loads(eliminated.x, loads, teeth)


def set_contact_load(
    field: ElasticField, stencils: list[Stencil], force: Array, contact_load: Array
) -> None:
    """Set the loads (unknowns, teeth) of forces (2, k) per unit width on the field."""
    contact_load[field.flank_dofs] = 0.0
    for s in stencils:
        dofs = field.cyclic_gear.flanks[s.flank].dofs[s.points]
        for kind, direction in enumerate(field.directions(s.flank)):
            share = force[kind, s.contact] * s.weights[:, None] * direction[s.points]
            contact_load[dofs, s.tooth] += share
