"""Implicit steps with all freedoms of the finite elements.

Every gear keeps its elastic displacement relative to its hub as a field over its
sectors; one factorisation of a sector serves all steps of a size. A step solves once
for the fields without new contact forces, finds the forces from what the fields show
at the contacts, and adds the fields that those forces make, which are constants of
the gear and the step. Load curves and hub coordinates are those of the reduced model.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from fegear.dynamics.elastic import Rayleigh
from fegear.dynamics.kernels import full as kernel
from fegear.dynamics.kernels.arrays import Newmark
from fegear.dynamics.model import DynamicModel, dynamic_model
from fegear.dynamics.scheme import Scheme
from fegear.dynamics.sides import ContactSide, MeshLoadCurves, contact_sides
from fegear.dynamics.stepper import (
    DynamicsError,
    FeHistory,
    ImplicitStepper,
    MotionState,
    TimeSteps,
    empty_record,
    history_from_record,
)
from fegear.elasticity.cyclic_gear import CyclicGear, Factors
from fegear.elasticity.flank_grid import flank_stencils
from fegear.gearset.model import GearSet
from lumped.kernels.arrays import Position
from lumped.steady.steady_state import Diverged
from lumped.train.system import LumpedSystem

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class ElasticField:
    """One gear's finite elements and where its contacts are.

    gear_index : of the gear; width : its face width [m]
    sign : -1 for an internal gear, whose teeth count counter-clockwise
    contacts : (k,) indices of the contacts on it; teeth, flanks : (k,) of each
    stencil_start, weights : (p, k), (p, k, 4) first flank point at which a contact is
        read, and the weights of the points
    n_load_directions : 1 for inward loads alone, 2 with rootward ones
    """

    gear_index: int
    cyclic_gear: CyclicGear
    width: float
    sign: int
    damping: Rayleigh
    contacts: Indices
    teeth: Indices
    flanks: Indices
    stencil_start: Indices
    weights: Array
    n_load_directions: int

    def directions(self, flank: int) -> list[Array]:
        """Unit vectors (points, 2) of the loads on a flank."""
        points = self.cyclic_gear.flanks[flank]
        return [points.inward, points.rootward][: self.n_load_directions]

    def responses(self, factors: Factors) -> dict[int, Array]:
        """Fields (kinds, points, unknowns, teeth) under unit loads on tooth 0.

        They are listed by flank.
        """
        responses = {}
        shape = self.cyclic_gear.unknowns, self.cyclic_gear.teeth
        for flank in np.unique(self.flanks).tolist():
            dofs = self.cyclic_gear.flanks[flank].dofs
            fields = np.empty((self.n_load_directions, len(dofs), *shape))
            for kind, direction in enumerate(self.directions(flank)):
                for i, dof in enumerate(dofs):
                    load = np.zeros(shape)
                    load[dof, 0] = direction[i]
                    fields[kind, i] = factors.solve(load)
            responses[flank] = fields
        return responses

    def compliance(self, responses: dict[int, Array]) -> Array:
        """Inward displacement at contacts per load on contacts (kinds, p, k, k).

        Per unit width.
        """
        positions, count = self.stencil_start.shape
        total = np.zeros((self.n_load_directions, positions, count, count))
        index = self.stencil_start[:, :, None] + np.arange(self.weights.shape[2])
        for c in range(count):
            points = self.cyclic_gear.flanks[self.flanks[c]]
            for d in range(count):
                fields = responses[int(self.flanks[d])]
                tooth_offset = (self.teeth[c] - self.teeth[d]) % self.cyclic_gear.teeth
                flank_displacement = fields[:, :, points.dofs, tooth_offset]
                inward_displacement = np.einsum(
                    "njia,ia->nij", flank_displacement, points.inward
                )
                stencil_compliance = inward_displacement[
                    :, index[:, c, :, None], index[:, d, None, :]
                ]
                total[:, :, c, d] = np.einsum(
                    "pa,npab,pb->np",
                    self.weights[:, c],
                    stencil_compliance,
                    self.weights[:, d],
                )
        return total

    def interpolate_cyclic_field(self, column: Array) -> Array:
        """Displacement at contacts (kinds, p, k) under a field equal on all teeth."""
        out = np.zeros((self.n_load_directions, *self.stencil_start.shape))
        for c, flank in enumerate(self.flanks):
            flank_displacement = column[self.cyclic_gear.flanks[flank].dofs]
            for kind, direction in enumerate(self.directions(flank)):
                values = (flank_displacement * direction).sum(axis=1)
                for a in range(self.weights.shape[2]):
                    out[kind, :, c] += (
                        self.weights[:, c, a] * values[self.stencil_start[:, c] + a]
                    )
        return out

    def stencils(self, tables: CycleInterpolator) -> list[tuple[int, slice, Array]]:
        """(index in `contacts`, flank points, weights) at the current position."""
        stencils = []
        for c, contact in enumerate(self.contacts):
            grid_index, fraction = tables.cell_of(int(contact))
            for grid, share in (
                (grid_index, 1.0 - fraction),
                (grid_index + 1, fraction),
            ):
                if share != 0.0:
                    first = int(self.stencil_start[grid, c])
                    weights = share * self.weights[grid, c]
                    stencils.append((c, slice(first, first + len(weights)), weights))
        return stencils

    def inward_displacement(
        self,
        scheme: Scheme,
        step: float,
        state: Array,
        acceleration: Array,
        hub_induced_acceleration: Array,
        tables: CycleInterpolator,
    ) -> Array:
        """Inward displacement (k,) at the contacts after a step.

        acceleration : (unknowns, teeth) at its end
        hub_induced_acceleration : (unknowns,) of all sectors, added to it
        """
        out = np.zeros(self.contacts.size)
        for c, stencil, weights in self.stencils(tables):
            points = self.cyclic_gear.flanks[self.flanks[c]]
            index = points.dofs[stencil], self.teeth[c] % self.cyclic_gear.teeth
            u_pred, _ = scheme.predicted(step, state[:, index[0], index[1]])
            nodal_acceleration = (
                acceleration[index] + hub_induced_acceleration[index[0]]
            )
            displacement = u_pred + scheme.beta * step**2 * nodal_acceleration
            out[c] += weights @ (displacement * points.inward[stencil]).sum(axis=1)
        return out


@dataclass(frozen=True, eq=False)
class CycleInterpolator:
    """Interpolates tables over the mesh cycle at the current mesh positions.

    mesh_of : (c,)
    """

    mesh_of: Indices
    position: Position

    def cell_of(self, contact: int) -> tuple[int, float]:
        """Table cell of a contact, and the fraction of the cell."""
        mesh = self.mesh_of[contact]
        return int(self.position.grid_index[mesh]), float(self.position.fraction[mesh])

    def interpolate(self, table: Array, contacts: Indices) -> Array:
        """Entries (k, ...) of a table (p, k, ...), one for each contact."""
        mesh, column = self.mesh_of[contacts], np.arange(contacts.size)
        grid_index, fraction = (
            self.position.grid_index[mesh],
            self.position.fraction[mesh],
        )
        low = table[grid_index, column]
        if not fraction.any():
            return low
        share = fraction.reshape(-1, *[1] * (low.ndim - 1))
        return low + share * (table[grid_index + 1, column] - low)


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
        _field(
            gear_index, sides, cyclic_gear, gear.face_width, rayleigh, n_load_directions
        )
        for gear_index, (gear, cyclic_gear, rayleigh) in enumerate(
            zip(gear_set.gears, cyclic_gears, damping, strict=True)
        )
    )
    positions = len(sides[0].load_curves.gap)
    contacts = sum(side.load_curves.pair_offsets.size for side in sides)
    extra = np.zeros((2, positions, contacts, contacts))
    if cross_mesh_compliance is not None:
        extra[0] += cross_mesh_compliance
    for field in fields:
        static = field.compliance(
            field.responses(field.cyclic_gear.factorised(0.0, 1.0))
        )
        every = np.arange(n_load_directions), np.arange(positions)
        block = np.ix_(*every, field.contacts, field.contacts)
        extra[block] -= static / field.width
    rigid = [None] * len(gear_set.gears)
    hubs = dynamic_model(gear_set, reference, load_curves, rigid, (extra[0], extra[1]))
    return hubs, fields


def _field(
    gear_index: int,
    sides: Sequence[ContactSide],
    cyclic_gear: CyclicGear,
    width: float,
    damping: Rayleigh,
    n_load_directions: int,
) -> ElasticField:
    contacts: list[int] = []
    teeth: list[int] = []
    flanks: list[int] = []
    arcs = []
    start = 0
    for side in sides:
        end = start + side.load_curves.pair_offsets.size
        if gear_index in side.gears:
            contacts += range(start, end)
            teeth += side.teeth(gear_index).tolist()
            flanks += [side.flank] * (end - start)
            arcs.append(side.arcs(gear_index))
        start = end
    all_arcs = np.concatenate(arcs, axis=1)
    index, weights = flank_stencils(all_arcs, *cyclic_gear.flank_grid)
    return ElasticField(
        gear_index=gear_index,
        cyclic_gear=cyclic_gear,
        width=width,
        sign=sides[0].gear_set.gears[gear_index].geometry.sign,
        damping=damping,
        contacts=np.array(contacts),
        teeth=np.array(teeth),
        flanks=np.array(flanks),
        stencil_start=index[..., 0],
        weights=weights,
        n_load_directions=n_load_directions,
    )


@dataclass(frozen=True, eq=False)
class FieldStep:
    """Matrices of one gear for a step size.

    mass, stiffness : their weights in the matrix that `factors` are of
    rotation_field : (unknowns,) field under the momentum of a unit turn;
        rotation_momentum : its momentum
    responses : by flank, fields (kinds, points, unknowns, teeth) under unit loads
    compliance : (kinds, p, k, k)
    rotation_at_contacts : (kinds, p, k) of `rotation_field`
    """

    factors: Factors
    mass: float
    stiffness: float
    rotation_field: Array
    rotation_momentum: float
    responses: dict[int, Array]
    compliance: Array
    rotation_at_contacts: Array


def field_step(field: ElasticField, weights: tuple[float, float, float]) -> FieldStep:
    """Factorise the matrix of a step for one gear, and solve its unit responses.

    weights : of mass, damping and stiffness in the matrix
    """
    cyclic_gear, (wm, wc, wk) = field.cyclic_gear, weights
    mass, stiffness = wm + wc * field.damping.mass, wk + wc * field.damping.stiffness
    factors = cyclic_gear.factorised(mass, stiffness)
    momentum = np.repeat(cyclic_gear.momentum[:, None], cyclic_gear.teeth, axis=1)
    rotation_field = factors.solve(momentum)[:, 0]
    responses = field.responses(factors)
    return FieldStep(
        factors=factors,
        mass=mass,
        stiffness=stiffness,
        rotation_field=rotation_field,
        rotation_momentum=cyclic_gear.teeth
        * float(cyclic_gear.momentum @ rotation_field),
        responses=responses,
        compliance=field.compliance(responses),
        rotation_at_contacts=field.interpolate_cyclic_field(rotation_field),
    )


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
        model, step_matrices = self.model, self._step(steps.size)
        frequency, cycle = steps.frequency, steps.cycle
        now, record = state.copy(), empty_record(self.model, steps.count)
        kernel.record(model.arrays, now.motion, now.contact, record, 0)
        for n in range(steps.count):
            if frequency > 0.0:
                self._pass_teeth(now, steps.start + n, cycle)
            tables = self._tables(steps.start + n + 1 if frequency > 0.0 else 0, cycle)
            self._advance(now, step_matrices, 2.0 * math.pi * frequency, tables)
            if not np.abs(now.motion[1]).sum() < model.limit:
                raise Diverged(n / (cycle * self.system.common_period[0]))
            kernel.record(model.arrays, now.motion, now.contact, record, n + 1)
        return now, history_from_record(steps.size, record)

    @lru_cache(maxsize=2)  # noqa: B019  a stepper lives as long as its run
    def _step(self, size: float) -> FullStepMatrices:
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

    def _pass_teeth(self, now: MotionState, step_number: int, cycle: int) -> None:
        """Shift the tooth index of gears that pass a tooth."""
        kinematics = self.model.kinematics
        for f, field in zip(self.fields, now.fields, strict=True):
            rate = kinematics.rate[kinematics.first_mesh[f.gear_index]]
            cycles_before, cycles_after = np.floor(
                rate * np.array([step_number, step_number + 1]) / cycle + 1e-9
            )
            if cycles_after > cycles_before:
                sense = f.sign * int(np.sign(kinematics.speed[f.gear_index]))
                field[:] = np.roll(field, -sense, axis=2)

    def _tables(self, step_number: int, cycle: int) -> CycleInterpolator:
        """Interpolator of the tables at a step.

        cycle : steps of a cycle of the first mesh
        """
        model = self.model
        rate, contacts = model.kinematics.rate, model.contacts
        position = kernel.find_position(rate, contacts, cycle, step_number)
        return CycleInterpolator(model.jacobian.mesh_of, position)

    def _advance(
        self,
        now: MotionState,
        step: FullStepMatrices,
        speed: float,
        tables: CycleInterpolator,
    ) -> None:
        """One step; `tables` at its end."""
        s, h, weight_new = self.scheme, step.size, 1.0 - self.scheme.alpha_f
        modal, rotation = self.model.modal, self.model.modal.rotation
        q, v, a, contact_force = now.motion
        u_pred, v_pred = s.predicted(h, now.motion)
        rhs = modal.load - s.alpha_m * a + s.alpha_f * contact_force
        rhs -= modal.damping * (weight_new * v_pred + s.alpha_f * v)
        rhs -= modal.stiffness @ (weight_new * u_pred + s.alpha_f * q)
        pairs = list(zip(self.fields, step.fields, now.fields, strict=True))
        free_accelerations = []
        for f, gear_step, field in pairs:
            hub_rotation_row = rotation[f.gear_index]
            free = free_acceleration(f, gear_step, field, s.newmark(h))
            free += (s.alpha_m * (hub_rotation_row @ a)) * gear_step.rotation_field[
                :, None
            ]
            inertial_moment = s.alpha_m * angular_momentum(
                f, field[2]
            ) + step.mass * angular_momentum(f, free)
            rhs += f.width * inertial_moment * hub_rotation_row
            free_accelerations.append(free)
        free_hub = step.hub_inverse @ rhs
        friction = self._signed_friction(now, tables, speed, v_pred)
        motion = u_pred, free_hub
        forces = self._contact_forces(
            now, step, tables, friction, motion, free_accelerations
        )
        rhs = weight_new * now.motion[3]
        for (f, gear_step, _), force in zip(pairs, forces, strict=True):
            for kind, rotation_response in enumerate(gear_step.rotation_at_contacts):
                moment = force[kind] @ tables.interpolate(rotation_response, f.contacts)
                rhs += weight_new * step.mass * moment * rotation[f.gear_index]
        acceleration = free_hub + step.hub_inverse @ rhs
        now.motion[:3] = s.corrected(h, now.motion, acceleration)
        for (f, gear_step, field), free, force in zip(
            pairs, free_accelerations, forces, strict=True
        ):
            hub_acceleration = step.mass * (rotation[f.gear_index] @ acceleration)
            free += hub_acceleration * gear_step.rotation_field[:, None]
            add_responses(f, gear_step, weight_new / f.width * force, tables, free)
            kernel.correct(s.newmark(h), free, field)
            set_contact_load(f, force / f.width, tables, field[3])

    def _contact_forces(
        self,
        now: MotionState,
        step: FullStepMatrices,
        tables: CycleInterpolator,
        friction: Array,
        motion: tuple[Array, Array],
        free_accelerations: list[Array],
    ) -> list[Array]:
        """New contact forces (2, k) on each gear, inward and toward the root [N].

        friction : (c,) signed coefficient
        motion : u_pred and accelerations of the hubs without the new forces
        free_accelerations : of the fields without them and without the hub's turn
        """
        s, h, model = self.scheme, step.size, self.model
        jacobian, contacts, mesh_of = model.jacobian, model.contacts, tables.mesh_of
        every = np.arange(mesh_of.size)
        rows = np.stack(
            [
                tables.interpolate(row.swapaxes(0, 1), every)
                for row in (jacobian.normal, jacobian.tangential)
            ]
        )
        u_pred, free_hub = motion
        free = rows[0] @ (u_pred + s.beta * h * h * free_hub)
        free -= tables.interpolate(tables.position.gap.T, every)
        for f, gear_step, field, field_acceleration in zip(
            self.fields, step.fields, now.fields, free_accelerations, strict=True
        ):
            hub_induced_acceleration = (
                step.mass
                * (model.modal.rotation[f.gear_index] @ free_hub)
                * gear_step.rotation_field
            )
            free[f.contacts] -= f.inward_displacement(
                s, h, field, field_acceleration, hub_induced_acceleration, tables
            )
        Q = self._compliance(step, tables, friction, rows)
        status = kernel.find_loads(
            contacts, mesh_of, Q, free, tables.position, now.contact
        )
        if status != kernel.CONVERGED:
            raise DynamicsError(f"contact not solved in a step of {h:g} s")
        load = now.contact[1]
        now.motion[3] = -(rows[0] + friction[:, None] * rows[1]).T @ load
        both = np.stack([load, friction * load])
        return [both[:, f.contacts] for f in self.fields]

    def _compliance(
        self,
        step: FullStepMatrices,
        tables: CycleInterpolator,
        friction: Array,
        rows: Array,
    ) -> Array:
        """Penetration (c, c) of a contact at the step's end per load on another [m/N].

        rows : (2, c, h) normal and tangential rows of the hubs
        """
        contacts, s = self.model.contacts, self.scheme
        every = np.arange(friction.size)
        compliance_factor = s.beta * step.size**2 * (1.0 - s.alpha_f)
        condensed_rows = rows.copy()
        contact_compliance = tables.interpolate(contacts.normal_compliance, every)
        contact_compliance += (
            tables.interpolate(contacts.tangential_compliance, every) * friction
        )
        for f, gear_step in zip(self.fields, step.fields, strict=True):
            hub_rotation_row, index = (
                self.model.modal.rotation[f.gear_index],
                f.contacts,
            )
            square = np.ix_(index, index)
            for kind, factor in enumerate(
                (1.0, friction[index])[: f.n_load_directions]
            ):
                rotation_response = tables.interpolate(
                    gear_step.rotation_at_contacts[kind], index
                )
                condensed_rows[kind, index] -= (
                    step.mass * rotation_response[:, None] * hub_rotation_row
                )
                contact_compliance[square] += (
                    compliance_factor
                    / f.width
                    * tables.interpolate(gear_step.compliance[kind], index)
                    * factor
                )
        force_rows = condensed_rows[0] + friction[:, None] * condensed_rows[1]
        return np.asarray(
            contact_compliance
            + compliance_factor * (condensed_rows[0] @ step.hub_inverse @ force_rows.T)
        )

    def _signed_friction(
        self, now: MotionState, tables: CycleInterpolator, speed: float, v_pred: Array
    ) -> Array:
        """Coefficient of friction toward the roots of each contact (c,)."""
        friction, contacts = self.model.jacobian.friction, self.model.contacts
        if not friction > 0.0:
            return np.zeros(self.model.contact_count)
        now.contact[2] = self._reversed(tables, speed, v_pred)
        sliding = tables.interpolate(
            contacts.sliding.T, np.arange(len(contacts.sliding))
        )
        return np.where(now.contact[2] == 1, -1.0, 1.0) * friction * sliding

    def _reversed(
        self, tables: CycleInterpolator, speed: float, v_pred: Array
    ) -> Indices:
        """Whether each contact (c,) slides against its nominal direction."""
        kinematics = self.model.kinematics
        rotation = speed * kinematics.speed + self.model.modal.rotation @ v_pred
        rotation *= np.sign(kinematics.speed)
        contacts = self.model.contacts
        return np.asarray(
            kernel.find_reversed(contacts, rotation[kinematics.gears], tables.position)
        )


def angular_momentum(field: ElasticField, velocity: Array) -> float:
    """Angular momentum about the centre, clockwise, per unit width."""
    return float(field.cyclic_gear.momentum @ velocity.sum(axis=1))


def free_acceleration(
    field: ElasticField, step: FieldStep, state: Array, newmark: Newmark
) -> Array:
    """Acceleration of a field (unknowns, teeth) under the last step's forces and its
    elasticity.

    With S = m M + k K, K y = (S y - m M y) / k spares the product with K.
    """
    damping = field.damping.mass, field.damping.stiffness
    x, y = np.empty_like(state[0]), np.empty_like(state[0])
    kernel.assemble_rhs(newmark, damping, step.mass / step.stiffness, state, x, y)
    rhs = field.cyclic_gear.mass_times(x) + newmark.alpha_f * state[3]
    return step.factors.solve(rhs) + y / step.stiffness


def add_responses(
    field: ElasticField,
    step: FieldStep,
    force: Array,
    tables: CycleInterpolator,
    out: Array,
) -> None:
    """Add the accelerations that forces (2, k) per unit width make."""
    teeth = field.cyclic_gear.teeth
    for c, stencil, weights in field.stencils(tables):
        fields = step.responses[int(field.flanks[c])]
        tooth = int(field.teeth[c]) % teeth
        for kind in range(field.n_load_directions):
            if force[kind, c] == 0.0:
                continue
            acceleration = np.tensordot(
                force[kind, c] * weights, fields[kind, stencil], 1
            )
            out[:, tooth:] += acceleration[:, : teeth - tooth]
            out[:, :tooth] += acceleration[:, teeth - tooth :]


def set_contact_load(
    field: ElasticField, force: Array, tables: CycleInterpolator, contact_load: Array
) -> None:
    """Set the loads (unknowns, teeth) of forces (2, k) per unit width on the field."""
    contact_load[:] = 0.0
    for c, stencil, weights in field.stencils(tables):
        dofs = field.cyclic_gear.flanks[field.flanks[c]].dofs[stencil]
        for kind, direction in enumerate(field.directions(field.flanks[c])):
            share = force[kind, c] * weights[:, None] * direction[stencil]
            contact_load[dofs, field.teeth[c] % field.cyclic_gear.teeth] += share
