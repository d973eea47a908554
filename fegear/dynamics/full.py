"""Implicit steps with all freedoms of the finite elements.

Every gear keeps its elastic displacement relative to its hub as a field over its
sectors; one factorisation of a sector serves all steps of a size. A step solves once
for the fields without new contact forces, finds the forces from what the fields show
at the contacts, and adds the fields that those forces make, which are constants of
the gear and the step. Contact laws and hub freedoms are those of the reduced model.
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
    recorded,
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

    number : of the gear; width : its face width [m]
    contacts : (k,) indices of the contacts on it; teeth, flanks : (k,) of each
    first, weights : (p, k), (p, k, 4) flank points at which a contact is read, and how
    kinds : 1 for inward loads alone, 2 with rootward ones
    """

    number: int
    whole: CyclicGear
    width: float
    damping: Rayleigh
    contacts: Indices
    teeth: Indices
    flanks: Indices
    first: Indices
    weights: Array
    kinds: int

    def directions(self, flank: int) -> list[Array]:
        """Unit vectors (points, 2) of the loads on a flank."""
        points = self.whole.flanks[flank]
        return [points.inward, points.rootward][: self.kinds]

    def responses(self, factors: Factors) -> dict[int, Array]:
        """Fields (kinds, points, unknowns, teeth) under unit loads on tooth 0.

        They are listed by flank.
        """
        responses = {}
        shape = self.whole.unknowns, self.whole.teeth
        for flank in np.unique(self.flanks).tolist():
            freedoms = self.whole.flanks[flank].freedoms
            fields = np.empty((self.kinds, len(freedoms), *shape))
            for kind, direction in enumerate(self.directions(flank)):
                for i, freedom in enumerate(freedoms):
                    load = np.zeros(shape)
                    load[freedom, 0] = direction[i]
                    fields[kind, i] = factors.solve(load)
            responses[flank] = fields
        return responses

    def compliance(self, responses: dict[int, Array]) -> Array:
        """Inward displacement at contacts per load on contacts (kinds, p, k, k).

        Per unit width.
        """
        positions, count = self.first.shape
        total = np.zeros((self.kinds, positions, count, count))
        index = self.first[:, :, None] + np.arange(self.weights.shape[2])
        for c in range(count):
            points = self.whole.flanks[self.flanks[c]]
            for d in range(count):
                fields = responses[int(self.flanks[d])]
                apart = (self.teeth[c] - self.teeth[d]) % self.whole.teeth
                shown = fields[:, :, points.freedoms, apart]
                seen = np.einsum("njia,ia->nij", shown, points.inward)
                near = seen[:, index[:, c, :, None], index[:, d, None, :]]
                total[:, :, c, d] = np.einsum(
                    "pa,npab,pb->np", self.weights[:, c], near, self.weights[:, d]
                )
        return total

    def of_column(self, column: Array) -> Array:
        """Values at contacts (kinds, p, k) of a field (unknowns,) of equal teeth."""
        out = np.zeros((self.kinds, *self.first.shape))
        for c, flank in enumerate(self.flanks):
            shown = column[self.whole.flanks[flank].freedoms]
            for kind, direction in enumerate(self.directions(flank)):
                values = (shown * direction).sum(axis=1)
                for a in range(self.weights.shape[2]):
                    out[kind, :, c] += (
                        self.weights[:, c, a] * values[self.first[:, c] + a]
                    )
        return out

    def stencils(self, tables: CycleInterpolator) -> list[tuple[int, slice, Array]]:
        """(contact's place in `contacts`, flank points, weights) at an instant."""
        stencils = []
        for c, contact in enumerate(self.contacts):
            place, part = tables.of(int(contact))
            for grid, share in ((place, 1.0 - part), (place + 1, part)):
                if share != 0.0:
                    first = int(self.first[grid, c])
                    weights = share * self.weights[grid, c]
                    stencils.append((c, slice(first, first + len(weights)), weights))
        return stencils

    def inward_at(
        self,
        scheme: Scheme,
        step: float,
        state: Array,
        acceleration: Array,
        swing: Array,
        tables: CycleInterpolator,
    ) -> Array:
        """Inward displacement (k,) at the contacts after a step.

        acceleration : (unknowns, teeth) at its end, to which `swing` (unknowns,) of all
            sectors comes
        """
        out = np.zeros(self.contacts.size)
        for c, near, weights in self.stencils(tables):
            points = self.whole.flanks[self.flanks[c]]
            at = points.freedoms[near], self.teeth[c] % self.whole.teeth
            u_pred, _ = scheme.predicted(step, state[:, at[0], at[1]])
            pull = acceleration[at] + swing[at[0]]
            shown = u_pred + scheme.beta * step**2 * pull
            out[c] += weights @ (shown * points.inward[near]).sum(axis=1)
        return out


@dataclass(frozen=True, eq=False)
class CycleInterpolator:
    """Reads tables over the mesh cycle at the positions of the meshes of the contacts.

    mesh_of : (c,)
    """

    mesh_of: Indices
    where: Position

    def of(self, contact: int) -> tuple[int, float]:
        """The grid point and the part beyond it."""
        mesh = self.mesh_of[contact]
        return int(self.where.grid_index[mesh]), float(self.where.fraction[mesh])

    def at(self, table: Array, contacts: Indices) -> Array:
        """Entries (k, ...) of a table (p, k, ...), one for each contact."""
        mesh, column = self.mesh_of[contacts], np.arange(contacts.size)
        place, part = self.where.grid_index[mesh], self.where.fraction[mesh]
        low = table[place, column]
        if not part.any():
            return low
        share = part.reshape(-1, *[1] * (low.ndim - 1))
        return low + share * (table[place + 1, column] - low)


def full_model(
    gear_set: GearSet,
    reference: LumpedSystem,
    laws: Sequence[MeshLoadCurves],
    wholes: Sequence[CyclicGear],
    damping: Sequence[Rayleigh],
    far: Array | None = None,
) -> tuple[DynamicModel, tuple[ElasticField, ...]]:
    """Hubs and contacts as in a reduced model without modes, and the gears' fields.

    Arguments as for `dynamic_model`, with the finite elements of the gears.
    """
    sides = contact_sides(gear_set, laws)
    kinds = 2 if laws[0].friction > 0.0 else 1
    fields = tuple(
        _field(number, sides, whole, gear.face_width, rayleigh, kinds)
        for number, (gear, whole, rayleigh) in enumerate(
            zip(gear_set.gears, wholes, damping, strict=True)
        )
    )
    positions = len(sides[0].laws.gap)
    contacts = sum(side.laws.teeth.size for side in sides)
    extra = np.zeros((2, positions, contacts, contacts))
    if far is not None:
        extra[0] += far
    for field in fields:
        static = field.compliance(field.responses(field.whole.factorised(0.0, 1.0)))
        every = np.arange(kinds), np.arange(positions)
        block = np.ix_(*every, field.contacts, field.contacts)
        extra[block] -= static / field.width
    rigid = [None] * len(gear_set.gears)
    hubs = dynamic_model(gear_set, reference, laws, rigid, (extra[0], extra[1]))
    return hubs, fields


def _field(
    number: int,
    sides: Sequence[ContactSide],
    whole: CyclicGear,
    width: float,
    damping: Rayleigh,
    kinds: int,
) -> ElasticField:
    contacts: list[int] = []
    teeth: list[int] = []
    flanks: list[int] = []
    arcs = []
    begin = 0
    for side in sides:
        end = begin + side.laws.teeth.size
        if number in side.gears:
            contacts += range(begin, end)
            teeth += side.teeth(number).tolist()
            flanks += [side.flank] * (end - begin)
            arcs.append(side.arcs(number))
        begin = end
    points = whole.flanks[0].arcs
    grid = points[-1], whole.flank_grading, len(points)
    index, weights = flank_stencils(np.concatenate(arcs, axis=1), *grid)
    return ElasticField(
        number=number,
        whole=whole,
        width=width,
        damping=damping,
        contacts=np.array(contacts),
        teeth=np.array(teeth),
        flanks=np.array(flanks),
        first=index[..., 0],
        weights=weights,
        kinds=kinds,
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
    """weights : of mass, damping and stiffness in the step's matrix."""
    whole, (wm, wc, wk) = field.whole, weights
    mass, stiffness = wm + wc * field.damping.mass, wk + wc * field.damping.stiffness
    factors = whole.factorised(mass, stiffness)
    momentum = np.repeat(whole.momentum[:, None], whole.teeth, axis=1)
    turned = factors.solve(momentum)[:, 0]
    responses = field.responses(factors)
    return FieldStep(
        factors=factors,
        mass=mass,
        stiffness=stiffness,
        rotation_field=turned,
        rotation_momentum=whole.teeth * float(whole.momentum @ turned),
        responses=responses,
        compliance=field.compliance(responses),
        rotation_at_contacts=field.of_column(turned),
    )


@dataclass(frozen=True, eq=False)
class FullStepMatrices:
    """A step size [s]: what it makes of the hubs and of each gear."""

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
            tuple(np.zeros((4, f.whole.unknowns, f.whole.teeth)) for f in self.fields),
        )

    def integrate(
        self, state: MotionState, steps: TimeSteps
    ) -> tuple[MotionState, FeHistory]:
        model, sizes = self.model, self._step(steps.size)
        frequency, cycle = steps.frequency, steps.cycle
        now, record = state.copy(), empty_record(self.model, steps.count)
        kernel.record(model.arrays, now.motion, now.contact, record, 0)
        for n in range(steps.count):
            if frequency > 0.0:
                self._pass_teeth(now, steps.start + n, cycle)
            tables = self._tables(steps.start + n + 1 if frequency > 0.0 else 0, cycle)
            self._advance(now, sizes, 2.0 * math.pi * frequency, tables)
            if not np.abs(now.motion[1]).sum() < model.limit:
                raise Diverged(n / (cycle * self.system.common_period[0]))
            kernel.record(model.arrays, now.motion, now.contact, record, n + 1)
        return now, recorded(steps.size, record)

    @lru_cache(maxsize=2)  # noqa: B019  a stepper lives as long as its run
    def _step(self, size: float) -> FullStepMatrices:
        wm, wc, wk = weights = self.scheme.weights(size)
        modal = self.model.modal
        matrix = wk * modal.stiffness + np.diag(wm + wc * modal.damping)
        fields = tuple(field_step(f, weights) for f in self.fields)
        for f, s in zip(self.fields, fields, strict=True):
            turn = modal.rotation[f.number]
            matrix -= wm**2 * f.width * s.rotation_momentum * np.outer(turn, turn)
        inverse = np.asarray(np.linalg.inv(matrix), float)
        return FullStepMatrices(size, wm, inverse, fields)

    def _pass_teeth(self, now: MotionState, before: int, cycle: int) -> None:
        """Shift the tooth index of gears that pass a tooth."""
        kinematics = self.model.kinematics
        for f, field in zip(self.fields, now.fields, strict=True):
            rate = kinematics.rate[kinematics.first_mesh[f.number]]
            then, later = np.floor(rate * np.array([before, before + 1]) / cycle + 1e-9)
            if later > then:
                field[:] = np.roll(
                    field, -int(np.sign(kinematics.speed[f.number])), axis=2
                )

    def _tables(self, number: int, cycle: int) -> CycleInterpolator:
        """At step `number`, with `cycle` steps of a cycle of the first mesh."""
        model = self.model
        rate, contacts = model.kinematics.rate, model.contacts
        where = kernel.find_position(rate, contacts, cycle, number)
        return CycleInterpolator(model.jacobian.mesh_of, where)

    def _advance(
        self,
        now: MotionState,
        step: FullStepMatrices,
        speed: float,
        tables: CycleInterpolator,
    ) -> None:
        """One step; `tables` at its end."""
        s, h, new = self.scheme, step.size, 1.0 - self.scheme.alpha_f
        modal, rotation = self.model.modal, self.model.modal.rotation
        q, v, a, push = now.motion
        u_pred, v_pred = s.predicted(h, now.motion)
        right = modal.load - s.alpha_m * a + s.alpha_f * push
        right -= modal.damping * (new * v_pred + s.alpha_f * v)
        right -= modal.stiffness @ (new * u_pred + s.alpha_f * q)
        pairs = list(zip(self.fields, step.fields, now.fields, strict=True))
        parts = []
        for f, z, field in pairs:
            turn = rotation[f.number]
            free = free_acceleration(f, z, field, s.newmark(h))
            free += (s.alpha_m * (turn @ a)) * z.rotation_field[:, None]
            carried = s.alpha_m * momentum(f, field[2]) + step.mass * momentum(f, free)
            right += f.width * carried * turn
            parts.append(free)
        free_hub = step.hub_inverse @ right
        friction = self._signed_friction(now, tables, speed, v_pred)
        motion = u_pred, free_hub
        forces = self._contact_forces(now, step, tables, friction, motion, parts)
        right = new * now.motion[3]
        for (f, z, _), force in zip(pairs, forces, strict=True):
            for kind, turned in enumerate(z.rotation_at_contacts):
                moment = force[kind] @ tables.at(turned, f.contacts)
                right += new * step.mass * moment * rotation[f.number]
        acceleration = free_hub + step.hub_inverse @ right
        now.motion[:3] = s.corrected(h, now.motion, acceleration)
        for (f, z, field), free, force in zip(pairs, parts, forces, strict=True):
            turn = step.mass * (rotation[f.number] @ acceleration)
            free += turn * z.rotation_field[:, None]
            add_responses(f, z, new / f.width * force, tables, free)
            kernel.correct(s.newmark(h), free, field)
            set_push(f, force / f.width, tables, field[3])

    def _contact_forces(
        self,
        now: MotionState,
        step: FullStepMatrices,
        tables: CycleInterpolator,
        friction: Array,
        motion: tuple[Array, Array],
        parts: list[Array],
    ) -> list[Array]:
        """New contact forces (2, k) on each gear, inward and toward the root [N].

        friction : (c,) signed coefficient
        motion : u_pred and accelerations of the hubs without the new forces
        parts : accelerations of the fields without them and without the hub's turn
        """
        s, h, model = self.scheme, step.size, self.model
        jacobian, contacts, mesh_of = model.jacobian, model.contacts, tables.mesh_of
        every = np.arange(mesh_of.size)
        rows = np.stack(
            [
                tables.at(row.swapaxes(0, 1), every)
                for row in (jacobian.normal, jacobian.tangential)
            ]
        )
        u_pred, free_hub = motion
        free = rows[0] @ (u_pred + s.beta * h * h * free_hub)
        free -= tables.at(tables.where.gap.T, every)
        for f, z, field, part in zip(
            self.fields, step.fields, now.fields, parts, strict=True
        ):
            swing = (
                step.mass
                * (model.modal.rotation[f.number] @ free_hub)
                * z.rotation_field
            )
            free[f.contacts] -= f.inward_at(s, h, field, part, swing, tables)
        Q = self._compliance(step, tables, friction, rows)
        status = kernel.find_loads(
            contacts, mesh_of, Q, free, tables.where, now.contact
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
        soft = s.beta * step.size**2 * (1.0 - s.alpha_f)
        onto = rows.copy()
        Q = tables.at(contacts.normal_compliance, every)
        Q += tables.at(contacts.tangential_compliance, every) * friction
        for f, z in zip(self.fields, step.fields, strict=True):
            turn, index = self.model.modal.rotation[f.number], f.contacts
            square = np.ix_(index, index)
            for kind, factor in enumerate((1.0, friction[index])[: f.kinds]):
                seen = tables.at(z.rotation_at_contacts[kind], index)
                onto[kind, index] -= step.mass * seen[:, None] * turn
                Q[square] += (
                    soft / f.width * tables.at(z.compliance[kind], index) * factor
                )
        pushing = onto[0] + friction[:, None] * onto[1]
        return np.asarray(Q + soft * (onto[0] @ step.hub_inverse @ pushing.T))

    def _signed_friction(
        self, now: MotionState, tables: CycleInterpolator, speed: float, v_pred: Array
    ) -> Array:
        """Coefficient of friction toward the roots of each contact (c,)."""
        friction, contacts = self.model.jacobian.friction, self.model.contacts
        if not friction > 0.0:
            return np.zeros(self.model.contact_count)
        now.contact[2] = self._reversed(tables, speed, v_pred)
        sliding = tables.at(contacts.sliding.T, np.arange(len(contacts.sliding)))
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
            kernel.find_reversed(contacts, rotation[kinematics.gears], tables.where)
        )


def momentum(field: ElasticField, velocity: Array) -> float:
    """About the centre, clockwise, per unit width."""
    return float(field.whole.momentum @ velocity.sum(axis=1))


def free_acceleration(
    field: ElasticField, step: FieldStep, state: Array, newmark: Newmark
) -> Array:
    """Acceleration of a field (unknowns, teeth) under the last step's forces and its
    elasticity.

    With S = m M + k K, K y = (S y - m M y) / k spares the product with K.
    """
    damping = field.damping.mass, field.damping.stiffness
    x, y = np.empty_like(state[0]), np.empty_like(state[0])
    kernel.set_balance(newmark, damping, step.mass / step.stiffness, state, x, y)
    right = field.whole.mass_times(x) + newmark.alpha_f * state[3]
    return step.factors.solve(right) + y / step.stiffness


def add_responses(
    field: ElasticField,
    step: FieldStep,
    force: Array,
    tables: CycleInterpolator,
    out: Array,
) -> None:
    """Add the accelerations that forces (2, k) per unit width make."""
    teeth = field.whole.teeth
    for c, near, weights in field.stencils(tables):
        fields = step.responses[int(field.flanks[c])]
        tooth = int(field.teeth[c]) % teeth
        for kind in range(field.kinds):
            if force[kind, c] == 0.0:
                continue
            made = np.tensordot(force[kind, c] * weights, fields[kind, near], 1)
            out[:, tooth:] += made[:, : teeth - tooth]
            out[:, :tooth] += made[:, teeth - tooth :]


def set_push(
    field: ElasticField, force: Array, tables: CycleInterpolator, push: Array
) -> None:
    """The forces (2, k) per unit width as loads (unknowns, teeth) on the field."""
    push[:] = 0.0
    for c, near, weights in field.stencils(tables):
        freedoms = field.whole.flanks[field.flanks[c]].freedoms[near]
        for kind, direction in enumerate(field.directions(field.flanks[c])):
            share = force[kind, c] * weights[:, None] * direction[near]
            push[freedoms, field.teeth[c] % field.whole.teeth] += share
