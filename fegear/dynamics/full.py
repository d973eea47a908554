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
from dataclasses import dataclass, replace
from functools import lru_cache
from types import SimpleNamespace

import numpy as np
from numpy.typing import NDArray

from fegear.contact.pair_laws import flank_stencils
from fegear.dynamics.elastic import Rayleigh
from fegear.dynamics.kernels import full as kernel
from fegear.dynamics.model import DynamicModel, dynamic_model
from fegear.dynamics.respond import (
    DynamicsError,
    Motion,
    MotionState,
    at_rest,
    recorded,
)
from fegear.dynamics.scheme import Scheme, generalized_alpha
from fegear.dynamics.sides import ContactSide, MeshLaws, contact_sides
from fegear.elasticity.whole import Factors, WholeGear
from fegear.gearset.model import GearSet
from lumped.system import LumpedSystem

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Newmark = tuple[float, float, float, float, float]


@dataclass(frozen=True, eq=False)
class ElasticField:
    """One gear's finite elements and where its contacts are.

    number : of the gear; width : its face width [m]
    contacts : (k,) indices of the contacts on it; teeth, flanks : (k,) of each
    first, weights : (p, k), (p, k, 4) flank points at which a contact is read, and how
    kinds : 1 for inward loads alone, 2 with rootward ones
    """

    number: int
    whole: WholeGear
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
        """Fields (kinds, points, own, teeth) under unit loads on tooth 0, by flank."""
        found = {}
        shape = self.whole.own, self.whole.teeth
        for flank in np.unique(self.flanks).tolist():
            freedoms = self.whole.flanks[flank].freedoms
            fields = np.empty((self.kinds, len(freedoms), *shape))
            for kind, direction in enumerate(self.directions(flank)):
                for i, own in enumerate(freedoms):
                    load = np.zeros(shape)
                    load[own, 0] = direction[i]
                    fields[kind, i] = factors.solve(load)
            found[flank] = fields
        return found

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
        """What contacts see of a field (own,) equal for all sectors (kinds, p, k)."""
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

    def stencils(self, where: Place) -> list[tuple[int, slice, Array]]:
        """(contact's place in `contacts`, flank points, weights) at an instant."""
        found = []
        for c, contact in enumerate(self.contacts):
            place, part = where.of(int(contact))
            for grid, share in ((place, 1.0 - part), (place + 1, part)):
                if share != 0.0:
                    first = int(self.first[grid, c])
                    weights = share * self.weights[grid, c]
                    found.append((c, slice(first, first + len(weights)), weights))
        return found

    def inward_at(
        self,
        scheme: Scheme,
        step: float,
        state: Array,
        acceleration: Array,
        swing: Array,
        where: Place,
    ) -> Array:
        """Inward displacement (k,) at the contacts after a step.

        acceleration : (own, teeth) at its end, to which `swing` (own,) of all
            sectors comes
        """
        out = np.zeros(self.contacts.size)
        for c, near, weights in self.stencils(where):
            points = self.whole.flanks[self.flanks[c]]
            at = points.freedoms[near], self.teeth[c] % self.whole.teeth
            ahead, _ = scheme.predicted(step, state[:, at[0], at[1]])
            pull = acceleration[at] + swing[at[0]]
            shown = ahead + scheme.beta * step**2 * pull
            out[c] += weights @ (shown * points.inward[near]).sum(axis=1)
        return out


@dataclass(frozen=True, eq=False)
class Place:
    """Where the meshes stand in their tables: a grid point and the part beyond it.

    cycle : of each mesh
    """

    mesh_of: Indices
    cycle: Indices
    place: Indices
    part: Array

    def of(self, contact: int) -> tuple[int, float]:
        mesh = self.mesh_of[contact]
        return int(self.place[mesh]), float(self.part[mesh])

    def errors(self, table: Array) -> Array:
        """Entries (c,) of a table (c, n) that goes over the cycles."""
        if not table.shape[1]:
            return np.zeros(len(table))
        cycle = self.cycle[self.mesh_of] % table.shape[1]
        return table[np.arange(len(table)), cycle]

    def at(self, table: Array, contacts: Indices) -> Array:
        """Entries (k, ...) of a table (p, k, ...), one for each contact."""
        mesh, each = self.mesh_of[contacts], np.arange(contacts.size)
        place, part = self.place[mesh], self.part[mesh]
        low = table[place, each]
        if not part.any():
            return low
        share = part.reshape(-1, *[1] * (low.ndim - 1))
        return low + share * (table[place + 1, each] - low)


@dataclass(frozen=True, eq=False)
class FullModel:
    """Hubs and contacts as in a reduced model without modes, and the gears' fields."""

    hubs: DynamicModel
    fields: tuple[ElasticField, ...]


def full_model(
    gear_set: GearSet,
    reference: LumpedSystem,
    laws: Sequence[MeshLaws],
    wholes: Sequence[WholeGear],
    damping: Sequence[Rayleigh],
    far: Array | None = None,
) -> FullModel:
    """Assemble; arguments as for `dynamic_model`, with the finite elements of gears."""
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
        own = np.ix_(*every, field.contacts, field.contacts)
        extra[own] -= static / field.width
    rigid = [None] * len(gear_set.gears)
    hubs = dynamic_model(gear_set, reference, laws, rigid, (extra[0], extra[1]))
    return FullModel(hubs, fields)


def _field(
    number: int,
    sides: Sequence[ContactSide],
    whole: WholeGear,
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
    grid = SimpleNamespace(length=points[-1], grading=whole.flank_grading)
    index, weights = flank_stencils(np.concatenate(arcs, axis=1), grid, len(points))
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
    """What a step size makes of one gear.

    mass, stiffness : their weights in the matrix that `factors` are of
    turned : (own,) field under the momentum of a unit turn; swing : its momentum
    responses : by flank, fields (kinds, points, own, teeth) under unit loads
    compliance : (kinds, p, k, k); turning : (kinds, p, k) of `turned` at the contacts
    """

    factors: Factors
    mass: float
    stiffness: float
    turned: Array
    swing: float
    responses: dict[int, Array]
    compliance: Array
    turning: Array


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
        turned=turned,
        swing=whole.teeth * float(whole.momentum @ turned),
        responses=responses,
        compliance=field.compliance(responses),
        turning=field.of_column(turned),
    )


@dataclass(frozen=True, eq=False)
class Step:
    """A step size [s]: what it makes of the hubs and of each gear."""

    size: float
    mass: float
    hub_inverse: Array
    fields: tuple[FieldStep, ...]


@dataclass(frozen=True, eq=False)
class FullStepper:
    """Marches hubs and fields; a state holds (4, own, teeth) of every gear."""

    full: FullModel
    scheme: Scheme

    @property
    def model(self) -> DynamicModel:
        return self.full.hubs

    def start(self) -> MotionState:
        """At rest under the external torques, at the start of the mesh cycle."""
        model = self.model
        empty = MotionState(
            np.zeros((4, model.size)),
            np.zeros((3, model.touching)),
            tuple(np.zeros((4, f.whole.own, f.whole.teeth)) for f in self.full.fields),
        )
        return at_rest(replace(self, scheme=generalized_alpha(0.0)), empty)

    def march(
        self,
        state: MotionState,
        frequency: float,
        step: float,
        steps: int,
        cycle: int,
        start: int = 0,
    ) -> tuple[MotionState, Motion]:
        """As `ReducedStepper.march`."""
        model, sizes = self.model, self._step(step)
        now = state.copy()
        out = np.empty((steps + 1, 5, model.train.rate.size))
        loads = np.empty((steps + 1, model.touching))
        hub = np.empty((steps + 1, 2, model.size))
        self._note(now, out[0], loads[0], hub[0])
        for n in range(steps):
            if frequency > 0.0:
                self._pass_teeth(now, start + n, cycle)
            where = self._place(start + n + 1 if frequency > 0.0 else 0, cycle)
            self._advance(now, sizes, 2.0 * math.pi * frequency, where)
            if not np.abs(now.motion[1]).sum() < model.limit:
                raise FloatingPointError(f"motion diverged after {n * step:g} s")
            self._note(now, out[n + 1], loads[n + 1], hub[n + 1])
        return now, recorded(step, out, loads, hub)

    @lru_cache(maxsize=2)  # noqa: B019  a stepper lives as long as its run
    def _step(self, size: float) -> Step:
        wm, wc, wk = weights = self.scheme.weights(size)
        body = self.model.body
        matrix = wk * body.stiffness + np.diag(wm + wc * body.damping)
        fields = tuple(field_step(f, weights) for f in self.full.fields)
        for f, s in zip(self.full.fields, fields, strict=True):
            turn = body.turning[f.number]
            matrix -= wm**2 * f.width * s.swing * np.outer(turn, turn)
        inverse = np.asarray(np.linalg.inv(matrix), float)
        return Step(size, wm, inverse, fields)

    def _pass_teeth(self, now: MotionState, before: int, cycle: int) -> None:
        """Count the teeth of those gears anew that pass one in the coming step."""
        train = self.model.train
        for f, field in zip(self.full.fields, now.fields, strict=True):
            rate = train.rate[train.first_mesh[f.number]]
            then, later = np.floor(rate * np.array([before, before + 1]) / cycle + 1e-9)
            if later > then:
                field[:] = np.roll(field, -int(np.sign(train.speed[f.number])), axis=2)

    def _place(self, number: int, cycle: int) -> Place:
        rate, mesh_of = self.model.train.rate, self.model.rows.mesh_of
        positions = self.model.contacts.gap.shape[1] - 1
        place, part = np.zeros(rate.size, np.int64), np.zeros(rate.size)
        kernel.find_places(rate, cycle, number, positions, place, part)
        cycles = np.floor(rate * number / cycle + 1e-9).astype(np.int64)
        return Place(mesh_of, cycles, place, part)

    def _advance(
        self, now: MotionState, step: Step, speed: float, where: Place
    ) -> None:
        """One step; `where` the meshes stand at its end."""
        s, h, late = self.scheme, step.size, 1.0 - self.scheme.alpha_f
        body, turning = self.model.body, self.model.body.turning
        q, v, a, push = now.motion
        ahead, faster = s.predicted(h, now.motion)
        right = body.load - s.alpha_m * a + s.alpha_f * push
        right -= body.damping * (late * faster + s.alpha_f * v)
        right -= body.stiffness @ (late * ahead + s.alpha_f * q)
        pairs = list(zip(self.full.fields, step.fields, now.fields, strict=True))
        parts = []
        for f, z, field in pairs:
            turn = turning[f.number]
            free = free_acceleration(f, z, field, s.newmark(h))
            free += (s.alpha_m * (turn @ a)) * z.turned[:, None]
            carried = s.alpha_m * momentum(f, field[2]) + step.mass * momentum(f, free)
            right += f.width * carried * turn
            parts.append(free)
        free_hub = step.hub_inverse @ right
        forces = self._touch(now, step, speed, where, (ahead, faster, free_hub), parts)
        right = late * now.motion[3]
        for (f, z, _), force in zip(pairs, forces, strict=True):
            for kind, turned in enumerate(z.turning):
                moment = force[kind] @ where.at(turned, f.contacts)
                right += late * step.mass * moment * turning[f.number]
        acceleration = free_hub + step.hub_inverse @ right
        now.motion[:3] = s.corrected(h, now.motion, acceleration)
        for (f, z, field), free, force in zip(pairs, parts, forces, strict=True):
            turn = step.mass * (turning[f.number] @ acceleration)
            free += turn * z.turned[:, None]
            add_responses(f, z, late / f.width * force, where, free)
            kernel.correct(s.newmark(h), free, field)
            set_push(f, force / f.width, where, field[3])

    def _touch(
        self,
        now: MotionState,
        step: Step,
        speed: float,
        where: Place,
        hub: tuple[Array, Array, Array],
        parts: list[Array],
    ) -> list[Array]:
        """New contact forces (2, k) on each gear, inward and rootward [N].

        hub : displacement and velocity ahead, acceleration without the new forces
        parts : accelerations of the fields without them and without the hub's turn
        """
        s, h, model = self.scheme, step.size, self.model
        ahead, faster, free_hub = hub
        soft = s.beta * h * h * (1.0 - s.alpha_f)
        turning, contacts, rows_of = model.body.turning, model.contacts, model.rows
        mesh_of = rows_of.mesh_of
        every = np.arange(mesh_of.size)
        rows = np.stack(
            [
                where.at(r.swapaxes(0, 1), every)
                for r in (rows_of.closing, rows_of.rootward)
            ]
        )
        drag = np.zeros(mesh_of.size)
        if rows_of.friction > 0.0:
            turned = self._turned(where, speed, faster)
            sliding = where.at(contacts.sliding.T, every)
            drag = np.where(turned == 1, -1.0, 1.0) * rows_of.friction * sliding
            now.touch[2] = turned
        free = rows[0] @ (ahead + s.beta * h * h * free_hub)
        free -= where.at(contacts.gap.T, every) + where.errors(contacts.errors)
        onto = rows.copy()
        Q = where.at(contacts.normal, every)
        Q += where.at(contacts.tangential, every) * drag
        for f, z, field, part in zip(
            self.full.fields, step.fields, now.fields, parts, strict=True
        ):
            turn, own = turning[f.number], f.contacts
            swing = (step.mass * (turn @ free_hub)) * z.turned
            free[own] -= f.inward_at(s, h, field, part, swing, where)
            square = np.ix_(own, own)
            for kind, factor in enumerate((1.0, drag[own])[: f.kinds]):
                seen = where.at(z.turning[kind], own)
                onto[kind, own] -= step.mass * seen[:, None] * turn
                Q[square] += soft / f.width * where.at(z.compliance[kind], own) * factor
        pushing = onto[0] + drag[:, None] * onto[1]
        Q += soft * (onto[0] @ step.hub_inverse @ pushing.T)
        status = kernel.find_loads(
            contacts,
            mesh_of,
            Q,
            free,
            where.place,
            where.part,
            now.touch,
        )
        if status != kernel.CONVERGED:
            raise DynamicsError(f"contact not solved in a step of {h:g} s")
        load = now.touch[1]
        now.motion[3] = -(rows[0] + drag[:, None] * rows[1]).T @ load
        both = np.stack([load, drag * load])
        return [both[:, f.contacts] for f in self.full.fields]

    def _turned(self, where: Place, speed: float, faster: Array) -> Indices:
        nominal, gears = self.model.train.speed, self.model.train.gears
        turn = speed * nominal + self.model.body.turning @ faster
        turned = np.zeros(self.model.touching, np.int64)
        kernel.turn_friction(
            tuple(self.model.contacts),
            (turn * np.sign(nominal))[gears],
            where.place,
            where.part,
            turned,
        )
        return turned

    def _note(self, now: MotionState, out: Array, loads: Array, hub: Array) -> None:
        _, _, train, contacts = self.model.arrays
        kernel.record(train, contacts, now.motion, now.touch, out)
        loads[:] = now.touch[1]
        hub[:] = now.motion[:2]


def momentum(field: ElasticField, velocity: Array) -> float:
    """About the centre, clockwise, per unit width."""
    return float(field.whole.momentum @ velocity.sum(axis=1))


def free_acceleration(
    field: ElasticField, step: FieldStep, state: Array, newmark: Newmark
) -> Array:
    """Of a field (own, teeth) under the forces of the last step and its elasticity.

    With S = m M + k K, K y = (S y - m M y) / k spares the product with K.
    """
    damping = field.damping.mass, field.damping.stiffness
    x, y = np.empty_like(state[0]), np.empty_like(state[0])
    kernel.set_balance(newmark, damping, step.mass / step.stiffness, state, x, y)
    right = field.whole.mass_times(x) + newmark[2] * state[3]
    return step.factors.solve(right) + y / step.stiffness


def add_responses(
    field: ElasticField, step: FieldStep, force: Array, where: Place, out: Array
) -> None:
    """Add the accelerations that forces (2, k) per unit width make."""
    teeth = field.whole.teeth
    for c, near, weights in field.stencils(where):
        fields = step.responses[int(field.flanks[c])]
        tooth = int(field.teeth[c]) % teeth
        for kind in range(field.kinds):
            if force[kind, c] == 0.0:
                continue
            made = np.tensordot(force[kind, c] * weights, fields[kind, near], 1)
            out[:, tooth:] += made[:, : teeth - tooth]
            out[:, :tooth] += made[:, teeth - tooth :]


def set_push(field: ElasticField, force: Array, where: Place, push: Array) -> None:
    """The forces (2, k) per unit width as loads (own, teeth) on the field."""
    push[:] = 0.0
    for c, near, weights in field.stencils(where):
        freedoms = field.whole.flanks[field.flanks[c]].freedoms[near]
        for kind, direction in enumerate(field.directions(field.flanks[c])):
            share = force[kind, c] * weights[:, None] * direction[near]
            push[freedoms, field.teeth[c] % field.whole.teeth] += share
