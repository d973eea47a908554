"""Elastic fields of gears, and their implicit step."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fegear.dynamics.elastic import Rayleigh
from fegear.dynamics.kernels import full as kernel
from fegear.dynamics.kernels.newmark import predict
from fegear.dynamics.kernels.step_arrays import Newmark
from fegear.dynamics.sides import ContactSide
from fegear.elasticity.cyclic_gear import CyclicGear, Factors, sector_array
from fegear.elasticity.flank_grid import flank_stencils
from lumped.common.array_types import Array, Indices
from lumped.kernels.arrays import Position


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
                directed_displacement = (flank_displacement * direction).sum(axis=1)
                for a in range(self.weights.shape[2]):
                    out[kind, :, c] += (
                        self.weights[:, c, a]
                        * directed_displacement[self.stencil_start[:, c] + a]
                    )
        return out

    def stencils(self, interpolator: CycleInterpolator) -> list[Stencil]:
        """Where the contacts are at the current position."""
        return [
            self._stencil(c, *interpolator.cell_of(int(contact)))
            for c, contact in enumerate(self.contacts)
        ]

    def _stencil(self, c: int, grid_index: int, fraction: float) -> Stencil:
        flank, tooth = int(self.flanks[c]), int(self.teeth[c]) % self.cyclic_gear.teeth
        first_point, weights = (
            int(self.stencil_start[grid_index, c]),
            self.weights[:, c],
        )
        if fraction == 0.0:
            point_range = slice(first_point, first_point + weights.shape[1])
            return Stencil(c, flank, tooth, point_range, weights[grid_index])
        next_first_point = int(self.stencil_start[grid_index + 1, c])
        start, end = (
            min(first_point, next_first_point),
            max(first_point, next_first_point) + weights.shape[1],
        )
        joint_weights = np.zeros(end - start)
        for offset, grid, share in (
            (first_point - start, grid_index, 1.0 - fraction),
            (next_first_point - start, grid_index + 1, fraction),
        ):
            joint_weights[offset : offset + weights.shape[1]] += share * weights[grid]
        return Stencil(c, flank, tooth, slice(start, end), joint_weights)


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
            free_acceleration = (
                self.elastic[dofs, s.tooth] / step.stiffness
                + turn * step.rotation_field[dofs]
            )
            u_pred, _ = predict(newmark, *state[:3, dofs, s.tooth])
            displacement = (u_pred + factor * free_acceleration) * inward
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
        at_cell_start = table[grid_index, column]
        if not fraction.any():
            return at_cell_start
        share = fraction.reshape(-1, *[1] * (at_cell_start.ndim - 1))
        return at_cell_start + share * (table[grid_index + 1, column] - at_cell_start)


def elastic_field(
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


def angular_momentum(field: ElasticField, velocity: Array) -> float:
    """Angular momentum about the centre, clockwise, per unit width."""
    return float((field.cyclic_gear.momentum @ velocity).sum())


def eliminate_interior_freedoms(
    field: ElasticField,
    step: FieldStep,
    state: Array,
    newmark: Newmark,
    turn: float,
    interpolator: CycleInterpolator,
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
    cut_field = step.rotation_field[gear.n_interior :]
    momentum = (
        float((np.append(step.rotation_field, cut_field) @ rhs).sum())
        + angular_momentum(field, y) / step.stiffness
        + turn * step.rotation_momentum
    )
    step.factors.eliminate(rhs)
    stencils = field.stencils(interpolator)
    condensed = np.stack(
        [s.weights @ step.condensed[s.flank][:, s.points] for s in stencils], axis=1
    )
    return EliminatedField(rhs, y, turn, momentum, stencils, condensed)
