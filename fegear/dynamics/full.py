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
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from fegear.dynamics.elastic import Rayleigh
from fegear.dynamics.kernels import full as kernel
from fegear.dynamics.kernels.newmark import predict
from fegear.dynamics.kernels.step_arrays import Newmark
from fegear.dynamics.model import DynamicModel, dynamic_model
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
from fegear.elasticity.cyclic_gear import CyclicGear, Factors, sector_array
from fegear.elasticity.flank_grid import flank_stencils
from fegear.gearset.model import GearSet
from lumped.common.array_types import Array, Indices
from lumped.kernels.arrays import Position
from lumped.steady.steady_state import Diverged
from lumped.train.system import LumpedSystem

STEPS_PER_PIECE = 64  # some take a tenth of a second


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

    def responses(self, factors: Factors) -> dict[tuple[int, int], Array]:
        """Inward displacement (kinds, loads, points, teeth) under loads on tooth 0.

        It is listed by the loaded flank and the one that is read.
        """
        gear, flanks = self.cyclic_gear, np.unique(self.flanks).tolist()
        responses = {}
        for loaded in flanks:
            fields = np.stack(
                [
                    [factors.solve(load)[self.flank_dofs] for load in unit_loads]
                    for unit_loads in self.unit_loads(loaded)
                ]
            )
            for flank in flanks:
                points = gear.flanks[flank]
                rows = np.searchsorted(self.flank_dofs, points.dofs)
                responses[loaded, flank] = np.einsum(
                    "njiak,ia->njik", fields[:, :, rows], points.inward
                )
        return responses

    def unit_loads(self, flank: int) -> Iterator[Iterator[Array]]:
        """Loads (unknowns, teeth) on points of tooth 0, of each kind."""
        gear = self.cyclic_gear
        for rows in self.sector_loads(flank):
            yield (
                np.pad(row[: gear.unknowns, None], ((0, 0), (0, gear.teeth - 1)))
                for row in rows
            )

    def sector_loads(self, flank: int) -> Array:
        """Unit loads (kinds, points, unknowns + m) on points of a flank."""
        dofs = self.cyclic_gear.flanks[flank].dofs
        rows = self.cyclic_gear.mass_matrix.shape[0]
        loads = np.zeros((self.n_load_directions, len(dofs), rows))
        for kind, direction in enumerate(self.directions(flank)):
            np.put_along_axis(loads[kind], dofs, direction, axis=1)
        return loads

    @cached_property
    def flank_dofs(self) -> Indices:
        """All freedoms of flank points (n,) in increasing order."""
        flanks = np.unique(self.flanks)
        return np.unique(
            np.concatenate([self.cyclic_gear.flanks[flank].dofs for flank in flanks])
        )

    def compliance(self, factors: Factors) -> Array:
        """Inward displacement at contacts per load on contacts (kinds, p, k, k).

        Per unit width.
        """
        responses = self.responses(factors)
        positions, count = self.stencil_start.shape
        total = np.zeros((self.n_load_directions, positions, count, count))
        index = self.stencil_start[:, :, None] + np.arange(self.weights.shape[2])
        for c in range(count):
            for d in range(count):
                tooth_offset = (self.teeth[c] - self.teeth[d]) % self.cyclic_gear.teeth
                response = responses[int(self.flanks[d]), int(self.flanks[c])]
                stencil_compliance = response[
                    :, index[:, d, None, :], index[:, c, :, None], tooth_offset
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

    def stencils(self, tables: CycleInterpolator) -> list[Stencil]:
        """Where the contacts are at the current position."""
        return [
            self._stencil(c, *tables.cell_of(int(contact)))
            for c, contact in enumerate(self.contacts)
        ]

    def _stencil(self, c: int, grid_index: int, fraction: float) -> Stencil:
        flank, tooth = int(self.flanks[c]), int(self.teeth[c]) % self.cyclic_gear.teeth
        first, weights = int(self.stencil_start[grid_index, c]), self.weights[:, c]
        if fraction == 0.0:
            own = slice(first, first + weights.shape[1])
            return Stencil(c, flank, tooth, own, weights[grid_index])
        second = int(self.stencil_start[grid_index + 1, c])
        start, end = min(first, second), max(first, second) + weights.shape[1]
        joint = np.zeros(end - start)
        for begin, grid, share in (
            (first - start, grid_index, 1.0 - fraction),
            (second - start, grid_index + 1, fraction),
        ):
            joint[begin : begin + weights.shape[1]] += share * weights[grid]
        return Stencil(c, flank, tooth, slice(start, end), joint)


@dataclass(frozen=True, eq=False)
class Stencil:
    """Points of a flank at which a contact is read and loaded, and their weights.

    contact : its index among those of the gear
    """

    contact: int
    flank: int
    tooth: int
    points: slice
    weights: Array


@dataclass(frozen=True, eq=False)
class EliminatedField:
    """A field in the middle of a step, its acceleration without new contact forces.

    x : sector array that `Factors.eliminate` made; its solution is added to
    elastic : (unknowns, teeth), over the weight of the stiffness, and to
    turn : times `FieldStep.rotation_field`
    momentum : of that acceleration
    condensed : (kinds, k, unknowns + m) unit loads of the contacts
    """

    x: Array
    elastic: Array
    turn: float
    momentum: float
    stencils: list[Stencil]
    condensed: Array

    def inward_displacement(
        self,
        field: ElasticField,
        step: FieldStep,
        newmark: Newmark,
        state: Array,
        turn: float,
    ) -> Array:
        """Inward displacement (k,) at the contacts after the step, with this turn."""
        out = np.empty(field.contacts.size)
        factor = newmark.beta * newmark.h**2
        for s, row in zip(self.stencils, self.condensed[0], strict=True):
            flank_points = field.cyclic_gear.flanks[s.flank]
            dofs, inward = flank_points.dofs[s.points], flank_points.inward[s.points]
            others = (
                self.elastic[dofs, s.tooth] / step.stiffness
                + turn * step.rotation_field[dofs]
            )
            u_pred, _ = predict(newmark, *state[:3, dofs, s.tooth])
            displacement = (u_pred + factor * others) * inward
            out[s.contact] = (
                s.weights @ displacement.sum(axis=1) + factor * row @ self.x[:, s.tooth]
            )
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
        static = field.compliance(field.cyclic_gear.factorised(0.0, 1.0))
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
    condensed : by flank, unit loads (kinds, points, unknowns + m), see
        `Factors.condense`
    compliance : (kinds, p, k, k)
    rotation_at_contacts : (kinds, p, k) of `rotation_field`
    """

    factors: Factors
    mass: float
    stiffness: float
    rotation_field: Array
    rotation_momentum: float
    condensed: dict[int, Array]
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
    condensed = {}
    for flank in np.unique(field.flanks).tolist():
        loads = field.sector_loads(flank)
        rows = loads.reshape(-1, loads.shape[2]).T
        condensed[flank] = factors.condense(rows).reshape(loads.shape)
    return FieldStep(
        factors=factors,
        mass=mass,
        stiffness=stiffness,
        rotation_field=rotation_field,
        rotation_momentum=cyclic_gear.teeth
        * float(cyclic_gear.momentum @ rotation_field),
        condensed=condensed,
        compliance=field.compliance(factors),
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
        arrays, limit = model.arrays, model.limit
        kernel.record(arrays, now.motion, now.contact, record, 0)
        for n in range(steps.count):
            if frequency > 0.0:
                self._pass_teeth(now, steps.start + n, cycle)
            tables = self._tables(steps.start + n + 1 if frequency > 0.0 else 0, cycle)
            self._advance(now, step_matrices, 2.0 * math.pi * frequency, tables)
            if not np.abs(now.motion[1]).sum() < limit:
                raise Diverged(n / (cycle * self.system.common_period[0]))
            kernel.record(arrays, now.motion, now.contact, record, n + 1)
        return now, history_from_record(steps.size, record)

    def steps_per_piece(self, cycle: int) -> int:
        return STEPS_PER_PIECE

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
        newmark = s.newmark(h)
        fields = []
        for f, gear_step, field in zip(
            self.fields, step.fields, now.fields, strict=True
        ):
            row = rotation[f.gear_index]
            turn = s.alpha_m * float(row @ a)
            half = eliminate_free(f, gear_step, field, newmark, turn, tables)
            inertial_moment = (
                s.alpha_m * angular_momentum(f, field[2]) + step.mass * half.momentum
            )
            rhs += f.width * inertial_moment * row
            fields.append((f, gear_step, half, field))
        free_hub = step.hub_inverse @ rhs
        friction = self._signed_friction(now, tables, speed, v_pred)
        forces = self._contact_forces(
            now, step, tables, friction, (u_pred, free_hub), fields
        )
        rhs = weight_new * now.motion[3]
        for (f, gear_step, _, _), force in zip(fields, forces, strict=True):
            for kind, rotation_response in enumerate(gear_step.rotation_at_contacts):
                moment = force[kind] @ tables.interpolate(rotation_response, f.contacts)
                rhs += weight_new * step.mass * moment * rotation[f.gear_index]
        acceleration = free_hub + step.hub_inverse @ rhs
        now.motion[:3] = s.corrected(h, now.motion, acceleration)
        for (f, gear_step, half, field), force in zip(fields, forces, strict=True):
            hub = step.mass * float(rotation[f.gear_index] @ acceleration)
            add_contact_loads(gear_step, half, weight_new / f.width * force)
            gear_step.factors.substitute(half.x)
            turn_field = (half.turn + hub) * gear_step.rotation_field
            kernel.correct(
                newmark, half.x, half.elastic, gear_step.stiffness, turn_field, field
            )
            set_contact_load(f, half.stencils, force / f.width, field[3])

    def _contact_forces(
        self,
        now: MotionState,
        step: FullStepMatrices,
        tables: CycleInterpolator,
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
        for f, gear_step, half, field in fields:
            hub = step.mass * float(model.modal.rotation[f.gear_index] @ free_hub)
            free[f.contacts] -= half.inward_displacement(
                f, gear_step, s.newmark(h), field, half.turn + hub
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


FieldInStep = tuple[ElasticField, FieldStep, EliminatedField, Array]


def angular_momentum(field: ElasticField, velocity: Array) -> float:
    """Angular momentum about the centre, clockwise, per unit width."""
    return float((field.cyclic_gear.momentum @ velocity).sum())


def eliminate_free(
    field: ElasticField,
    step: FieldStep,
    state: Array,
    newmark: Newmark,
    turn: float,
    tables: CycleInterpolator,
) -> EliminatedField:
    """A field under the last step's forces, its elasticity and a turn.

    With S = m M + k K, K y = (S y - m M y) / k spares the product with K. S is
    symmetric, so that the momentum follows from the loads.
    """
    gear, damping = field.cyclic_gear, (field.damping.mass, field.damping.stiffness)
    x, y = sector_array(step.factors.rows, gear.teeth), np.empty_like(state[0])
    kernel.assemble_rhs(newmark, damping, step.mass / step.stiffness, state, x, y)
    rhs = gear.sector_mass_times(x)
    rhs[field.flank_dofs, : gear.teeth] += newmark.alpha_f * state[3, field.flank_dofs]
    cut = step.rotation_field[gear.n_interior :]
    momentum = (
        float((np.append(step.rotation_field, cut) @ rhs).sum())
        + angular_momentum(field, y) / step.stiffness
        + turn * step.rotation_momentum
    )
    step.factors.eliminate(rhs)
    stencils = field.stencils(tables)
    condensed = np.stack(
        [s.weights @ step.condensed[s.flank][:, s.points] for s in stencils], axis=1
    )
    return EliminatedField(rhs, y, turn, momentum, stencils, condensed)


def add_contact_loads(step: FieldStep, half: EliminatedField, force: Array) -> None:
    """Add the loads of forces (2, k) per unit width to a field."""
    loaded = np.flatnonzero(force.any(axis=0))
    if loaded.size:
        teeth = np.array([half.stencils[c].tooth for c in loaded])
        kinds, rows = force[: len(half.condensed), loaded], half.condensed[:, loaded]
        loads = (kinds[:, :, None] * rows).sum(axis=0)
        step.factors.add_loads(half.x, loads, teeth)


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
