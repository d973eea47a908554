"""A train whose contacts deflect each other: the coupled model.

Every tooth pair has its own curve of load over penetration, which stiffens as Hertzian
contact. Pairs of a mesh, and of all meshes of a gear, deflect each other through the
bodies of their gears. Coordinates are the mean rotations of the gears' masses: in these
axes the inertia of an elastic body does not move its mean, and its compliance is that
of a gear that is free to accelerate, `fegear.elasticity.inertia_relief`.

Let z be the displacement of the hubs, C the elastic compliance of the contacts with
hubs held, R their penetration per coordinate, and U and W the penetration and the work
of the inertial loads of all bodies per acceleration. Then

    q = z - P'F - W f,   f = load - K z,   q'' = f - R'F,   P = U - R W
    x + (C - U R' - R U' + R W R') F(x) = R q - P f - gap.

The torque f on the hubs of trains with shafts and couplings depends on z. Its solution
is f = S load - K1 (q + P'F), with S = (1 + K W)^-1 and K1 = S K. With B = R + P K1,

    q'' = S load - K1 q - B'F
    x + (C - U R' - R U' + R W R' - P K1 P') F(x) = B q - P S load - gap.

Without acceleration this reduces to statics: x + C F(x) = R z - gap.

Damping by a torque -D z' on the hubs is -T'D T q', where T is the rotation of the hubs
per coordinate, about the loaded state and averaged over a mesh cycle.

The lowest modes of the bodies with their hubs held are additional coordinates e of unit
mass, which are coupled to the hubs by G:

    z'' + G'e'' = f - R'F,    e'' + G z'' + c e' + w^2 e = -E'F.

Then C, U and W belong to all other modes, C - E w^-2 E' and so on, so that statics do
not depend on the modes retained. The coordinates z + G'e and e, scaled to unit mass,
replace z above. Modes with nodal diameters occur in pairs, which are described in a
frame that does not rotate with the gear, in which the contacts are at rest:
Z = E1 - i E2 is that of the gear's frame times exp(i v t), where v is the rate at which
the pattern rotates relative to the gear.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lumped.common.array_types import Array
from lumped.common.short_repr import ShortRepr
from lumped.kernels.arrays import (
    NO_CHANGES,
    NO_ROWS,
    ContactGrid,
    Contacts,
    CoupledSteps,
    CoupledSystem,
    PenetrationProblem,
    make_contiguous,
)
from lumped.train.propagator import LinearPart
from lumped.train.truncation import TruncationModel

COMPONENTS = "hardening", "pairs", "body", "meshes", "modes"
MAX_FACING_GAP = 5e-3  # m, gaps beyond which flanks do not face each other
MAX_NEWTON_ITERATIONS = 60  # iterations of Newton's method for static equilibrium
POSITION_ROUND_OFF = 1e-9  # round-off of a position in a mesh cycle
EQUILIBRIUM_RTOL = 1e-12  # error relative to the range of the contacts' tables
# Share of the hubs' inertia that body modes leave them, below which the inertia of all
# other modes is left out. That is the difference of nearly equal numbers, whose error
# makes contacts too stiff or springs that pull: vibration was off by a third, or grew
# beyond bounds. Where it was still right, leaving it out changed RMS by up to 0.2 %.
MIN_LEFT_INERTIA = 0.025
MAX_HALVINGS = 12  # of a step of this method that would overshoot
# Stiffness over the typical one that is added where there may be none, as of a planet
# that has lost contact
ADDED_STIFFNESS = 1e-9
# Added stiffness, and whether a step must not end where no contact is left, which
# curves that do not stiffen all along can lead to
REST_ATTEMPTS = (0.0, False), (ADDED_STIFFNESS, False), (0.0, True)


# fields of a ContactGrid without a row for each step
CONSTANT_ON_GRID = "periods", "first_wave", "wave_count"
MODE_FIELDS = "angular", "damping", "coupling", "whirl", "gears", "nodal_diameters"


@dataclass(frozen=True, eq=False)
class BodyModes(ShortRepr):
    """Modes of unit mass of the gears' bodies with their hubs held, b coordinates.

    Standing modes come first, then E1 of the travelling pairs, then E2.

    angular : (b,) natural frequency [rad/s]
    damping : (b,) damping of the velocity [1/s]
    coupling : (b, n) coupling G to the modal coordinates of the hubs
    mass : (b, b) identity, minus the share of hubs that are not coordinates
    rows : (c, p + 1, b) penetration of the contacts per coordinate [1/sqrt(kg)]
    whirl : (b,) v over the angular frequency of the first mesh, 0 for standing modes
    gears, nodal_diameters : (b,)
    """

    angular: Array
    damping: Array
    coupling: Array
    mass: Array
    rows: Array
    whirl: Array
    gears: NDArray[np.int64]
    nodal_diameters: NDArray[np.int64]

    @property
    def count(self) -> int:
        return self.angular.size

    def select(self, retained: NDArray[np.bool_]) -> BodyModes:
        """Return a subset of the modes by a mask (b,)."""
        values = {name: vars(self)[name][retained] for name in MODE_FIELDS}
        rows = np.ascontiguousarray(self.rows[..., retained])
        return BodyModes(
            **values, mass=self.mass[np.ix_(retained, retained)], rows=rows
        )

    @property
    def pair_whirl(self) -> Array:
        """Rates `whirl` (w,) of the pairs."""
        travelling = self.whirl[self.nodal_diameters > 0]
        return travelling[: travelling.size // 2]

    @cached_property
    def left_inertia(self) -> float:
        """Smallest share of the inertia of hubs that does not move with the modes."""
        if not self.count:
            return 1.0
        moved = self.coupling.T @ np.linalg.solve(self.mass, self.coupling)
        return float(np.linalg.eigvalsh(np.eye(len(moved)) - moved)[0])

    @cached_property
    def to_unit(self) -> Array:
        """Displacement of hubs and modes per coordinate of unit mass, square."""
        G = self.coupling
        mass = np.block([[np.eye(G.shape[1]), G.T], [G, self.mass]])
        return np.linalg.inv(np.linalg.cholesky(mass)).T


def no_body_modes(contacts: int, positions: int, modes: int) -> BodyModes:
    """Empty modes for numbers of contacts, positions p + 1 and hub coordinates."""
    none, nowhere = np.empty(0), np.empty(0, np.int64)
    return BodyModes(
        angular=none,
        damping=none,
        coupling=np.empty((0, modes)),
        mass=np.empty((0, 0)),
        rows=np.empty((contacts, positions, 0)),
        whirl=none,
        gears=nowhere,
        nodal_diameters=nowhere,
    )


@dataclass(frozen=True, eq=False)
class CoupledContacts(ShortRepr):
    """Contacts of a train: c contacts, p positions of a mesh cycle, n modes.

    contacts : contacts with the gears' hubs held, see `lumped.kernels.arrays.Contacts`
    mesh_of : (c,) mesh of each contact
    pairs : (c,) base pitches by which the tooth pair of each contact is ahead of the
        mesh's reference pair
    paths : (m, 2) start and end of the nominal path of contact, base pitches past the
        pitch point
    rows : (c, p + 1, n) R, penetration per modal coordinate [1/sqrt(kg)]
    penetration_rate : (c, p + 1) penetration per rotation of the driver times its base
        radius, with the driven gear held
    inertia_rows : (c, p + 1, n) U, penetration under the inertial loads of all bodies
        per acceleration of each coordinate, reversed [s2/sqrt(kg)]
    work : (n, n) W, work of these loads on themselves [s2]
    modes : modes of the bodies as separate coordinates; C, U and W still include them
    solved_modes : all body modes that were solved, of which `modes` are coordinates
    truncation_model : inertia of all solved body modes, and of the rest of the bodies
    retained : (b,) mask of the solved modes that are coordinates
    without : those of COMPONENTS that are left out
    """

    contacts: Contacts
    mesh_of: NDArray[np.int64]
    pairs: NDArray[np.int64]
    paths: Array
    rows: Array
    penetration_rate: Array
    inertia_rows: Array
    work: Array
    modes: BodyModes | None = None
    solved_modes: BodyModes | None = None
    truncation_model: TruncationModel | None = None
    retained: NDArray[np.bool_] | None = None
    without: tuple[str, ...] = ()

    @property
    def with_all_modes(self) -> CoupledContacts:
        """The contacts with all solved body modes as coordinates."""
        if self.solved_modes is None or self.retained is None:
            return self
        without = tuple(name for name in self.without if name != "modes")
        retained = np.ones_like(self.retained)
        return replace(
            self, modes=self.solved_modes, retained=retained, without=without
        )

    @property
    def of_equal_teeth(self) -> CoupledContacts:
        """The contacts without pitch errors."""
        errors = self.contacts.errors[:, :0]
        return replace(self, contacts=self.contacts._replace(errors=errors))

    def in_cycle(self, cycle: int) -> CoupledContacts:
        """The contacts, in all cycles of the meshes, of the teeth that meet in one."""
        contacts, count = self.contacts, self.mesh_of.size
        gap, load_curve = contacts.gap, contacts.load_curve[:count]
        if contacts.errors.size:
            gap = gap + contacts.errors[:, [cycle % contacts.errors.shape[1]]]
        if contacts.curve_rows.size:
            column = cycle % contacts.curve_rows.shape[1]
            gap = gap + contacts.gap_changes[contacts.gap_rows[:, column]]
            load_curve = contacts.load_curve[contacts.curve_rows[:, column]]
        contacts_of_cycle = contacts._replace(
            gap=gap,
            load_curve=load_curve,
            errors=contacts.errors[:, :0],
            curve_rows=NO_ROWS,
            gap_rows=NO_ROWS,
            gap_changes=NO_CHANGES,
        )
        return replace(self, contacts=contacts_of_cycle)

    def different_cycles(
        self, mesh: int
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Cycles (u,) of a mesh that differ, and which of them each (n,) is like."""
        contacts, is_of_mesh = self.contacts, self.mesh_of == mesh
        tables = contacts.errors, contacts.curve_rows, contacts.gap_rows
        mesh_tables = [table[is_of_mesh] for table in tables if table.shape[1]]
        if not mesh_tables:
            return np.zeros(1, np.int64), np.zeros(1, np.int64)
        cycles = np.arange(math.lcm(*(table.shape[1] for table in mesh_tables)))
        columns = [table[:, cycles % table.shape[1]] for table in mesh_tables]
        _, distinct_cycles, distinct_index = np.unique(
            np.concatenate(columns), axis=1, return_index=True, return_inverse=True
        )
        return distinct_cycles.astype(np.int64), distinct_index.ravel().astype(np.int64)

    @property
    def body_modes(self) -> BodyModes:
        """Body modes that are coordinates of the model."""
        if self.modes is None or not {"body", "modes"}.isdisjoint(self.without):
            return no_body_modes(*self.rows.shape)
        return self.modes


@dataclass(frozen=True, eq=False)
class ModalTrain:
    """Train without its meshes, in n modal coordinates of unit mass.

    stiffness : (n, n) stiffness K of shafts, couplings and bearings [1/s2]
    damping, load : (n,)
    shapes : (m, n) mesh deflection of each mode
    rate : (m,) cycles of each mesh per cycle of the first
    start : (n,) displacement near static equilibrium
    """

    stiffness: Array
    damping: Array
    load: Array
    shapes: Array
    rate: Array
    start: Array


@dataclass(frozen=True, eq=False)
class LoadedState:
    """Static equilibrium at p + 1 positions of a mesh cycle, and stiffness about it.

    deflection : (p + 1, m) deflection of the meshes [m]
    load : (p + 1, c) load of the contacts [N]
    penetration : (p + 1, c) penetration of the contacts [m]
    load_sensitivity : (p + 1, c, n) load of the contacts per coordinate
    coordinates : (p + 1, n) coordinates
    springs : (n, n) stiffness without the meshes, in modal coordinates in mean axes
    rows : (p + 1, c, n) penetration of the contacts per coordinate
    mesh_of : (c,) mesh of each contact
    """

    deflection: Array
    load: Array
    penetration: Array
    load_sensitivity: Array
    coordinates: Array
    springs: Array
    rows: Array
    mesh_of: NDArray[np.int64]

    def tangent(self, positions: slice | int) -> Array:
        """Tangent stiffness (..., m, n, n) of each mesh at positions [1/s2].

        A load that is transmitted to another mesh counts half for each.
        """
        B, S = self.rows[positions], self.load_sensitivity[positions]
        one_sided = np.stack(
            [
                np.swapaxes(B[..., mesh_contacts, :], -1, -2) @ S[..., mesh_contacts, :]
                for mesh_contacts in self._contacts_of_meshes
            ],
            axis=-3,
        )
        return np.asarray(0.5 * (one_sided + np.swapaxes(one_sided, -1, -2)))

    @cached_property
    def meshes(self) -> Array:
        """Mean tangent stiffness (m, n, n) of each mesh over the cycle [1/s2]."""
        # the end of the cycle is the start of the next
        B, S, n = self.rows[:-1], self.load_sensitivity[:-1], len(self.springs)
        one_sided = np.stack(
            [
                B[:, mesh_contacts].reshape(-1, n).T
                @ S[:, mesh_contacts].reshape(-1, n)
                for mesh_contacts in self._contacts_of_meshes
            ]
        )
        return np.asarray(one_sided + np.swapaxes(one_sided, 1, 2)) / (2.0 * len(B))

    @property
    def _contacts_of_meshes(self) -> list[NDArray[np.intp]]:
        meshes = range(self.deflection.shape[1])
        return [np.flatnonzero(self.mesh_of == m) for m in meshes]

    @property
    def frequency_Hz(self) -> Array:
        """Natural frequencies (n,) about the mean tangent stiffness [Hz]."""
        return self._modes[0]

    @property
    def shapes(self) -> Array:
        """Modes (n, n) in the modal coordinates, one per column."""
        return self._modes[1]

    @property
    def mesh_energy(self) -> Array:
        """Fraction (m, n) of each mode's strain energy in each mesh."""
        strain = (self.shapes * (self.meshes @ self.shapes)).sum(axis=1)
        squares = (2.0 * np.pi * self.frequency_Hz) ** 2
        return np.divide(strain, squares, np.zeros_like(strain), where=squares > 0.0)

    @cached_property
    def _modes(self) -> tuple[Array, Array]:
        squares, shapes = np.linalg.eigh(self.springs + self.meshes.sum(axis=0))
        return np.sqrt(np.maximum(squares, 0.0)) / (2.0 * np.pi), shapes


def coupled_system(coupled: CoupledContacts, train: ModalTrain) -> CoupledSystem:
    """System in the form that the kernels take, without the ingredients left out."""
    coupled = _without_left_out_inertia(coupled)
    system, hubs = _system_in_mean_axes(
        *_add_body_modes(coupled, train), coupled.body_modes.pair_whirl
    )
    start = _initial_coordinates(train, system)
    for name, leave_out in LEAVE_OUT.items():
        if name in coupled.without:
            # about the state of the model with the ingredients not yet left out
            loaded = loaded_state(system, start)
            system = system._replace(contacts=leave_out(system, loaded))
    return system._replace(
        damping=_damping_matrix(system, hubs, train, coupled.body_modes)
    )


@dataclass(frozen=True, eq=False)
class HubOutputs:
    """Quantities k of the hubs of a coupled model of n coordinates and c contacts.

    They are offset + rows q + sum over the contacts of their loads times per_load.

    offset : (k,); rows : (k, n); per_load : (c, p + 1, k) [1/N]
    """

    offset: Array
    rows: Array
    per_load: Array


def hub_outputs(
    coupled: CoupledContacts, train: ModalTrain, shapes: Array
) -> HubOutputs:
    """Quantities of the hubs, as `coupled_system` has the deflections of the meshes.

    shapes : (k, n) quantities per modal coordinate of the hubs
    """
    system, _ = _system_in_mean_axes(
        *_add_body_modes(
            _without_left_out_inertia(coupled), replace(train, shapes=shapes)
        ),
        coupled.body_modes.pair_whirl,
    )
    return HubOutputs(system.offset, system.shapes, system.ahead)


def _without_left_out_inertia(coupled: CoupledContacts) -> CoupledContacts:
    """The contacts, without the inertia of the bodies where that is left out."""
    if "body" not in coupled.without:
        return coupled
    zeros = np.zeros_like(coupled.inertia_rows), np.zeros_like(coupled.work)
    return replace(coupled, inertia_rows=zeros[0], work=zeros[1])


def _initial_coordinates(train: ModalTrain, system: CoupledSystem) -> Array:
    """Coordinates (n,) near static equilibrium."""
    start = np.zeros(system.load.size)
    start[: train.start.size] = train.start
    return start


def _add_body_modes(
    coupled: CoupledContacts, train: ModalTrain
) -> tuple[CoupledContacts, ModalTrain]:
    """Contacts and springs in the coordinates of hubs and body modes, of unit mass."""
    bodies, hubs = coupled.body_modes, train.load.size
    E, G, squares = bodies.rows, bodies.coupling, bodies.angular**2
    size, to_unit = hubs + bodies.count, bodies.to_unit

    a = size - 2 * bodies.pair_whirl.size

    def in_unit_coordinates(hub_rows: Array, body_rows: Array) -> Array:
        values = np.concatenate([hub_rows, body_rows], axis=-1)
        values[..., :a] = values[..., :a] @ to_unit[:a, :a]  # pairs have unit mass
        return values

    compliance = coupled.contacts.normal_compliance - _row_products(E / squares, E)
    inertia_rows = coupled.inertia_rows - (E / squares) @ G
    work = np.zeros((size, size))
    work[:hubs, :hubs] = coupled.work - (G.T / squares) @ G
    if bodies.left_inertia < MIN_LEFT_INERTIA:
        inertia_rows, work = np.zeros_like(inertia_rows), np.zeros_like(work)
    stiffness = np.zeros((size, size))
    stiffness[:hubs, :hubs] = train.stiffness
    stiffness[hubs:, hubs:] = np.diag(squares)
    no_load = np.zeros(bodies.count)
    contacts = replace(
        coupled,
        rows=in_unit_coordinates(coupled.rows, E),
        inertia_rows=in_unit_coordinates(inertia_rows, np.zeros_like(E)),
        work=to_unit.T @ work @ to_unit,
        contacts=coupled.contacts._replace(normal_compliance=compliance),
    )
    springs = replace(
        train,
        stiffness=to_unit.T @ stiffness @ to_unit,
        load=np.concatenate([train.load, no_load]) @ to_unit,
        shapes=in_unit_coordinates(
            train.shapes, np.zeros((len(train.shapes), bodies.count))
        ),
    )
    return contacts, springs


def contact_grid(system: CoupledSystem, steps: int, periods: Array) -> ContactGrid:
    """Contacts at the steps of some cycles of the meshes, `steps` per cycle of the
    first.

    periods : (m,) cycles of each mesh after which all repeat, except for pitch errors
    """
    n_cells, mesh_of = system.contacts.gap.shape[1] - 1, system.mesh_of
    cycles = system.rate * (np.arange(steps * periods[0]) / steps)[:, None]
    mesh_cycle = np.floor(cycles + POSITION_ROUND_OFF).astype(np.int64)
    table_position = np.maximum(cycles - mesh_cycle, 0.0) * n_cells
    grid_index = np.minimum(
        (table_position + POSITION_ROUND_OFF * n_cells).astype(np.int64), n_cells - 1
    )
    cell_fraction = np.where(
        np.abs(table_position - grid_index) < POSITION_ROUND_OFF * n_cells,
        0.0,
        table_position - grid_index,
    )

    def interpolate(table: Array) -> Array:
        """Entries (s, c, ...) of a table (c, p + 1, ...) at the steps."""
        contact_indices, cells = np.arange(len(mesh_of)), grid_index[:, mesh_of]
        fraction = cell_fraction[:, mesh_of].reshape(
            *cells.shape, *[1] * (table.ndim - 2)
        )
        return (1.0 - fraction) * table[contact_indices, cells] + fraction * table[
            contact_indices, cells + 1
        ]

    rows, first_wave, wave_count = _rows_by_gear(system)
    gap = interpolate(system.contacts.gap)
    compliance = np.swapaxes(system.contacts.normal_compliance, 0, 1)
    is_facing = gap < MAX_FACING_GAP
    facing_contacts = np.where(is_facing, np.arange(len(mesh_of)), len(mesh_of))
    facing_contacts = np.sort(facing_contacts)[:, : is_facing.sum(axis=1).max()]
    step_grid = ContactGrid(
        grid_index=grid_index,
        fraction=cell_fraction,
        mesh_cycle=mesh_cycle,
        periods=np.array(periods),
        gap=gap,
        rows=interpolate(rows),
        first_wave=first_wave,
        wave_count=np.array([wave_count]),
        ahead=interpolate(system.ahead),
        compliance=interpolate(compliance),
        facing=is_facing,
        facing_contacts=np.where(facing_contacts < len(mesh_of), facing_contacts, -1),
    )
    return make_contiguous(step_grid)


def _rows_by_gear(system: CoupledSystem) -> tuple[Array, NDArray[np.int64], int]:
    """Rows (c, p + 1, a + 2 k) of a ContactGrid, the first pair of each contact, and k.

    A contact moves with the pairs of its own gears only, which are adjacent in chains.
    """
    a, w, rows = _standing_count(system), system.whirl.size, system.rows
    if w == 0:
        return rows, np.zeros(len(rows), np.int64), 0
    moves_contact = (rows[..., a:] != 0.0).any(axis=1).reshape(-1, 2, w).any(axis=1)
    first_wave = np.argmax(moves_contact, axis=1)
    end = np.where(
        moves_contact.any(axis=1),
        w - np.argmax(moves_contact[:, ::-1], axis=1),
        first_wave,
    )
    k = int((end - first_wave).max())
    first_wave = np.minimum(first_wave, w - k)
    first_pair_columns = a + first_wave[:, None] + np.arange(k)
    standing_columns = np.broadcast_to(np.arange(a), (len(rows), a))
    columns = np.concatenate(
        [standing_columns, first_pair_columns, w + first_pair_columns], axis=1
    )
    return np.take_along_axis(rows, columns[:, None], axis=2), first_wave, k


def coupled_steps(
    system: CoupledSystem,
    linear: LinearPart,
    grid: ContactGrid,
    frequency: float,
    repetitions: int,
) -> CoupledSteps:
    """Steps of a common period at a frequency of the first mesh [Hz].

    repetitions : number of repetitions of the grid in a common period
    """
    steps = len(grid.gap) // int(grid.periods[0])
    h = np.full(repetitions * len(grid.gap), 1.0 / (frequency * steps))
    return _steps_on_grid(system, linear, grid, frequency, h)


def steps_of_cycle(
    system: CoupledSystem,
    linear: LinearPart,
    grid: ContactGrid,
    frequency: float,
    cycle: int,
) -> CoupledSteps:
    """Steps of one cycle of the first mesh at its frequency [Hz].

    cycle : number of the cycle in the time after which all meshes repeat
    """
    n_grid_nodes = len(grid.gap)
    steps = n_grid_nodes // int(grid.periods[0])
    nodes = cycle * steps + np.arange(steps + 1)  # with that at the end
    rows, passed_cycles = (
        nodes % n_grid_nodes,
        (nodes // n_grid_nodes)[:, None] * grid.periods,
    )
    cycle_grid = ContactGrid(
        **{
            name: getattr(grid, name)
            if name in CONSTANT_ON_GRID
            else np.ascontiguousarray(getattr(grid, name)[rows])
            for name in ContactGrid._fields
        }
    )
    cycle_grid = cycle_grid._replace(mesh_cycle=cycle_grid.mesh_cycle + passed_cycles)
    h = np.full(steps, 1.0 / (frequency * steps))
    return _steps_on_grid(system, linear, cycle_grid, frequency, h)


def _steps_on_grid(
    system: CoupledSystem,
    linear: LinearPart,
    grid: ContactGrid,
    frequency: float,
    sizes: Array,
) -> CoupledSteps:
    """Steps at the nodes of a grid; sizes : of all steps, which are equal [s]."""
    from lumped.kernels.coupled_steps import add_wave_compliance

    propagator = linear.step(frequency, float(sizes[0]))
    a, wave_response = linear.n_standing, propagator.waves[:, 2:4].sum(axis=0)
    standing_rows, standing_response = (
        grid.rows[..., :a],
        propagator.force_response[:, :a],
    )
    compliance = (
        standing_rows @ (standing_rows @ standing_response).transpose(0, 2, 1)
        + grid.compliance
    )
    add_wave_compliance(grid, wave_response, compliance)
    return CoupledSteps(
        h=sizes,
        grid=grid,
        propagator=propagator,
        compliance=compliance,
        **_allocate_workspace(system),
    )


def _allocate_workspace(system: CoupledSystem) -> dict[str, Any]:
    count = len(system.mesh_of)
    problem = PenetrationProblem(
        knots=system.contacts.knots,
        load_curve=system.contacts.load_curve,
        grid_index=np.zeros(system.rate.size, np.int64),
        fraction=np.zeros(system.rate.size),
        curve=np.arange(count),
        mesh_of=system.mesh_of,
        friction_reversed=np.zeros(count, np.int64),
        free=np.zeros(count),
        guess=np.zeros(count),
        cell=np.zeros(count, np.int64),
        active=np.empty(count, np.int64),
        Q=np.empty((count, count)),
        newton=np.empty((6, count)),
        loaded=np.empty(count, np.int64),
        matrix=np.empty((count, count + 1)),
    )
    return {
        "penetration": np.zeros(count),
        "ratio": np.zeros(count),
        "load": np.zeros(count),
        "continues": np.zeros(1, np.int64),
        "force": np.zeros((4, system.load.size)),
        "problem": problem,
    }


@dataclass(frozen=True, eq=False)
class Hubs:
    """Displacement of the hubs and of standing modes (a,), per coordinate (a, a) and
    load (c, p + 1, a).
    """

    rotation: Array
    hub_compliance: Array


def static_transmission_error(
    coupled: CoupledContacts, mesh: int, force: float, cycle: int = 0
) -> Array:
    """Driver's rotation times base radius (p + 1,) for a single mesh [m].

    As in a mesh table, the driven gear is held and other meshes carry no load.

    force : force along the line of action [N]
    cycle : number of the mesh cycle, which determines the teeth with pitch errors

    Raises ArithmeticError if no equilibrium is found.
    """
    mesh_contacts = np.flatnonzero(coupled.mesh_of == mesh)
    contacts, no_inertia_rows = (
        coupled.in_cycle(cycle).contacts,
        np.zeros((mesh_contacts.size, len(coupled.rows[0]), 1)),
    )
    single_mesh = replace(
        coupled,
        mesh_of=np.zeros(mesh_contacts.size, np.int64),
        rows=coupled.penetration_rate[mesh_contacts][:, :, None],
        inertia_rows=no_inertia_rows,
        work=np.zeros((1, 1)),
        modes=None,
        contacts=contacts._replace(
            first=np.array([0, mesh_contacts.size]),
            gap=contacts.gap[mesh_contacts],
            knots=contacts.knots[[mesh]],
            load_curve=contacts.load_curve[mesh_contacts],
            normal_compliance=contacts.normal_compliance[:, mesh_contacts][
                :, :, mesh_contacts
            ],
        ),
    )
    one = np.ones(1)
    train = ModalTrain(
        stiffness=np.zeros((1, 1)),
        damping=0.0 * one,
        load=force * one,
        shapes=np.ones((1, 1)),
        rate=one,
        start=contacts.knots[mesh, -1] * one,
    )
    return loaded_state(coupled_system(single_mesh, train), train.start).deflection[
        :, 0
    ]


def static_errors(coupled: CoupledContacts, mesh: int, force: float) -> Array:
    """Transmission error of `static_transmission_error` over all different cycles [m].

    (n p,) of n cycles, after which the teeth that meet repeat.
    """
    distinct_cycles, distinct_index = coupled.different_cycles(mesh)
    errors = [
        static_transmission_error(coupled, mesh, force, int(cycle))[:-1]
        for cycle in distinct_cycles
    ]
    return np.stack(errors)[distinct_index].ravel()


def _system_in_mean_axes(
    coupled: CoupledContacts, train: ModalTrain, whirl: Array
) -> tuple[CoupledSystem, Hubs]:
    # pairs of travelling modes deflect no hub and have no part in these loads
    a = coupled.rows.shape[2] - 2 * whirl.size
    R, U = coupled.rows[..., :a], coupled.inertia_rows[..., :a]
    W, K = coupled.work[:a, :a], train.stiffness[:a, :a]
    S = np.linalg.inv(np.eye(a) + K @ W)
    P, load = U - R @ W, S @ train.load[:a]
    hub_rotation = np.eye(a) - W @ S @ K
    hubs = Hubs(hub_rotation, P @ hub_rotation.T)
    mixed_products = _row_products(U, R)
    compliance = (
        coupled.contacts.normal_compliance
        - mixed_products
        - mixed_products.transpose(0, 2, 1)
    )
    compliance += _row_products(R @ W, R)
    compliance -= _row_products(P @ (S @ K), P)
    contacts = coupled.contacts._replace(
        normal_compliance=compliance, gap=coupled.contacts.gap + P @ load
    )
    stiffness, rows = train.stiffness.copy(), coupled.rows.copy()
    stiffness[:a, :a] = S @ K
    rows[..., :a] += P @ S @ K
    shapes = train.shapes.copy()
    shapes[:, :a] = shapes[:, :a] @ hub_rotation
    system = CoupledSystem(
        stiffness=stiffness,
        damping=np.zeros_like(stiffness),
        load=np.concatenate([load, train.load[a:]]),
        whirl=whirl,
        shapes=shapes,
        offset=train.shapes[:, :a] @ W @ load,
        rate=train.rate,
        mesh_of=coupled.mesh_of,
        rows=rows,
        ahead=hubs.hub_compliance @ train.shapes[:, :a].T,
        contacts=contacts,
    )
    return system, hubs


def _damping_matrix(
    system: CoupledSystem, hubs: Hubs, train: ModalTrain, bodies: BodyModes
) -> Array:
    """Damping matrix (n, n) of the hubs and of the body modes."""
    loaded_state_at_rest = loaded_state(system, _initial_coordinates(train, system))
    mode_damping = np.concatenate([train.damping, bodies.damping])
    # pairs retain only their own damping: they must whirl unchanged
    damping, a = np.diag(mode_damping), _standing_count(system)
    compliance = hubs.hub_compliance[:, :-1].transpose(1, 2, 0)
    rotation = (
        hubs.rotation + compliance @ loaded_state_at_rest.load_sensitivity[:-1, :, :a]
    )
    rotation = (bodies.to_unit[:a, :a] @ rotation).reshape(-1, a)
    weights = np.tile(mode_damping[:a], len(compliance))[:, None]
    damping[:a, :a] = (rotation * weights).T @ rotation / len(compliance)
    return damping


def _standing_count(system: CoupledSystem) -> int:
    """Number of coordinates before those of the pairs of travelling modes."""
    return system.load.size - 2 * system.whirl.size


def _row_products(rows: Array, other_rows: Array) -> Array:
    """Products (p, c, d) of rows (c, p, n) and (d, p, n)."""
    return np.asarray(rows.transpose(1, 0, 2) @ other_rows.transpose(1, 2, 0))


def _without_meshes(system: CoupledSystem, loaded: LoadedState) -> Contacts:
    """Contacts without deflections by contacts of other meshes."""
    compliance = system.contacts.normal_compliance.copy()
    compliance[:, system.mesh_of[:, None] != system.mesh_of] = 0.0
    return system.contacts._replace(normal_compliance=compliance)


def _without_pairs(system: CoupledSystem, loaded: LoadedState) -> Contacts:
    """Contacts whose static mutual deflections are part of their own compliance.

    They act like springs in parallel, which is exact at rest under the load.
    """
    compliance = system.contacts.normal_compliance.copy()
    is_same_mesh = system.mesh_of[:, None] == system.mesh_of
    np.fill_diagonal(is_same_mesh, False)
    mutual_deflection = np.einsum("pcd,pd->pc", compliance * is_same_mesh, loaded.load)
    carries_load = loaded.load > 0.0
    mutual_compliance = np.divide(
        mutual_deflection,
        loaded.load,
        np.zeros_like(mutual_deflection),
        where=carries_load,
    )
    compliance[:, is_same_mesh] = 0.0
    contact_indices = np.arange(system.mesh_of.size)
    compliance[:, contact_indices, contact_indices] += mutual_compliance
    # pairs that are kept apart by others at rest stay apart
    gap = system.contacts.gap + np.where(carries_load, 0.0, mutual_deflection).T
    return system.contacts._replace(normal_compliance=compliance, gap=gap)


def _without_hardening(system: CoupledSystem, loaded: LoadedState) -> Contacts:
    """Contacts with the secant stiffness at the largest load that each has at rest."""
    contacts, contact = system.contacts, _contacts_of_curves(system.contacts)
    max_penetration = np.maximum(
        loaded.penetration.max(axis=0), 1e-3 * contacts.knots[0, -1]
    )[contact]
    mesh_of = system.mesh_of[contact]
    curves = system._replace(mesh_of=mesh_of)
    load, _ = contact_loads(curves, np.tile(max_penetration, (len(loaded.load), 1)))
    load_curve = np.zeros_like(contacts.load_curve)
    secant = (load / max_penetration).T[:, :, None, None]
    load_curve[..., 1] = secant
    load_curve[..., 0] = secant * contacts.knots[mesh_of][:, None, None, :-1]
    return contacts._replace(load_curve=load_curve)


def _contacts_of_curves(contacts: Contacts) -> NDArray[np.int64]:
    """Contact of each load curve (r,)."""
    indices = np.arange(len(contacts.load_curve))
    contact = np.arange(len(contacts.curve_rows))
    indices[contacts.curve_rows] = contact[:, None]
    return indices


LEAVE_OUT = {  # in this order, in addition to the body
    "meshes": _without_meshes,
    "pairs": _without_pairs,
    "hardening": _without_hardening,
}


def loaded_state(system: CoupledSystem, start: Array) -> LoadedState:
    """Equilibrium under the constant loads, with gears at rest at each position.

    start : (n,) coordinates near the equilibrium

    Raises ArithmeticError if no equilibrium is found.
    """
    problem = _RestProblem(system, *_standing_rest_problem(system))
    a = problem.stiffness.shape[0]
    q = (start + _touching_coordinates(system, start))[:, :a]
    for added, keeps_contact in REST_ATTEMPTS:
        equilibrium = problem.solve(q, added, keeps_contact)
        if equilibrium is not None:
            return _linearise(system, *equilibrium)
    raise ArithmeticError("no static equilibrium of the contacts was found")


@dataclass(frozen=True, eq=False)
class _RestProblem:
    """Equilibrium of a contacts and standing coordinates, see `_standing_rest_problem`
    for the shapes.
    """

    system: CoupledSystem
    stiffness: Array
    rows: Array
    compliance: Array
    gap: Array

    def residual(self, x: Array, q: Array, F: Array) -> Array:
        """Errors (p + 1, c + a) of the penetrations and of the balance of loads."""
        load = self.system.load[: q.shape[1]]
        errors = [
            x + _multiply(self.compliance, F) - _multiply(self.rows, q) + self.gap,
            q @ self.stiffness + _multiply(self.rows.transpose(0, 2, 1), F) - load,
        ]
        return np.concatenate(errors, axis=1)

    def step(self, x: Array, q: Array, added: float) -> tuple[Array, Array]:
        """Newton's steps of penetrations and coordinates, to be subtracted.

        added : stiffness in all coordinates [1/s2], for those that have none
        """
        B, count = self.rows, x.shape[1]
        F, D = contact_loads(self.system, x)
        matrix = np.zeros((len(x), count + q.shape[1], count + q.shape[1]))
        matrix[:, :count, :count] = np.eye(count) + self.compliance * D[:, None, :]
        matrix[:, :count, count:] = -B
        matrix[:, count:, :count] = B.transpose(0, 2, 1) * D[:, None, :]
        matrix[:, count:, count:] = self.stiffness + added * np.eye(q.shape[1])
        step = _solve(matrix, self.residual(x, q, F))
        return step[:, :count], step[:, count:]

    def error(self, x: Array, q: Array) -> Array:
        """Largest residual (p + 1,), of penetrations and loads over typical ones."""
        errors = np.abs(self.residual(x, q, contact_loads(self.system, x)[0]))
        errors[:, : x.shape[1]] /= self.system.contacts.knots[:, -1].max()
        errors[:, x.shape[1] :] /= np.abs(self.system.load).max()
        return np.asarray(errors.max(axis=1))

    def step_lengths(
        self, x: Array, q: Array, x_step: Array, q_step: Array, keeps_contact: bool
    ) -> Array:
        """Part (p + 1, 1) of the steps by which the residual falls.

        keeps_contact : and by which a contact is left
        """
        length, error_before = np.ones((len(x), 1)), self.error(x, q)
        for _ in range(MAX_HALVINGS):
            rises = self.error(x - length * x_step, q - length * q_step) > error_before
            if keeps_contact:
                rises |= (x - length * x_step <= 0.0).all(axis=1)
            if not rises.any():
                break
            length[rises] *= 0.5
        return length

    def solve(
        self, q: Array, added: float, keeps_contact: bool
    ) -> tuple[Array, Array] | None:
        """Penetrations and coordinates at rest, None where they are not found.

        added : stiffness that steps see in addition, over the largest of the train;
            contacts that do not touch may then be anywhere
        keeps_contact : whether steps are as short as leaves some contact
        """
        x = _multiply(self.rows, q) - self.gap
        tolerance = EQUILIBRIUM_RTOL * self.system.contacts.knots[:, -1].max()
        added *= float(np.abs(self.system.load).max() / np.abs(q).max()) if added else 0
        for _ in range(MAX_NEWTON_ITERATIONS):
            try:
                x_step, q_step = self.step(x, q, added)
            except np.linalg.LinAlgError:
                return None
            touching = (x > 0.0) | (x - x_step > 0.0) | (added == 0.0)
            steps = x, q, x_step, q_step
            shortened = added or keeps_contact
            length = self.step_lengths(*steps, keeps_contact) if shortened else 1.0
            x, q = x - length * x_step, q - length * q_step
            if not (np.isfinite(x_step).all() and np.isfinite(q_step).all()):
                return None
            if (np.abs(x_step) * touching < tolerance).all():
                return x, q
        return None


def _standing_rest_problem(system: CoupledSystem) -> tuple[Array, Array, Array, Array]:
    """At rest: stiffness (a, a), rows (p + 1, c, a), compliance (p + 1, c, c), and gaps
    (p + 1, c).

    Pairs of travelling modes are springs of their own: at rest they are compliance.
    """
    a = _standing_count(system)
    B, squares = system.rows.transpose(1, 0, 2), np.diag(system.stiffness)[a:]
    pairs = B[..., a:]
    compliance = (pairs / squares) @ pairs.transpose(0, 2, 1)
    gap = system.contacts.gap.T - pairs @ (system.load[a:] / squares)
    Q = system.contacts.normal_compliance + compliance
    return system.stiffness[:a, :a], B[..., :a], Q, gap


def _touching_coordinates(system: CoupledSystem, start: Array) -> Array:
    """Coordinates (p + 1, n) at which the flanks that carry load begin to touch.

    Newton's method cannot leave a gap, where there is no stiffness.
    """
    contacts, first = system.contacts, system.contacts.first
    gaps = np.empty((contacts.gap.shape[1], len(first) - 1))
    for m, side in enumerate(np.where(system.shapes @ start < 0.0, -1.0, 1.0)):
        of_mesh = slice(first[m], first[m + 1])
        facing = contacts.gap[of_mesh][contacts.side[of_mesh] == side]
        gaps[:, m] = side * facing.min(axis=0) if len(facing) else 0.0
    # bodies need not deflect for it: use only coordinates that loads move
    is_loaded = start != 0.0 if start.any() else np.ones(start.size, bool)
    coordinates = np.zeros((len(gaps), start.size))
    coordinates[:, is_loaded] = gaps @ np.linalg.pinv(system.shapes[:, is_loaded]).T
    return coordinates


def _linearise(system: CoupledSystem, x: Array, q: Array) -> LoadedState:
    """Loaded state at penetrations (p + 1, c) and standing coordinates (p + 1, a)."""
    F, D = contact_loads(system, x)
    a, B = q.shape[1], system.rows.transpose(1, 0, 2)
    pair_forces = system.load[a:] - _multiply(B[..., a:].transpose(0, 2, 1), F)
    q = np.concatenate([q, pair_forces / np.diag(system.stiffness)[a:]], axis=1)
    Q, eye = system.contacts.normal_compliance, np.eye(len(system.mesh_of))
    load_sensitivity = np.asarray(
        np.linalg.solve(eye + D[:, :, None] * Q, D[:, :, None] * B), float
    )
    ahead = np.einsum("cpm,pc->pm", system.ahead, F)
    return LoadedState(
        deflection=system.offset + q @ system.shapes.T + ahead,
        load=F,
        penetration=x,
        load_sensitivity=load_sensitivity,
        coordinates=q,
        springs=system.stiffness,
        rows=B,
        mesh_of=system.mesh_of,
    )


def contact_loads(system: CoupledSystem, x: Array) -> tuple[Array, Array]:
    """Loads [N] and slopes [N/m] of the contacts at penetrations, all (p + 1, c)."""
    load_curve, knots = (
        system.contacts.load_curve[:, :, 0],
        system.contacts.knots[system.mesh_of],
    )
    max_penetration, cells = knots[:, -1], load_curve.shape[2]
    inside = np.clip(x, 0.0, max_penetration)
    cell = np.minimum(
        (cells * np.sqrt(inside / max_penetration)).astype(int), cells - 1
    )
    contact, position = np.arange(x.shape[1])[None, :], np.arange(len(x))[:, None]
    cell -= inside < knots[contact, cell]  # round-off of the root
    t = inside - knots[contact, cell]
    c0, c1, c2, c3 = np.moveaxis(load_curve[contact, position, cell], -1, 0)
    load = (c0 + t * (c1 + t * (c2 + t * c3))) * (x > 0.0)
    slope = (c1 + t * (2.0 * c2 + t * 3.0 * c3)) * (x > 0.0)
    return load + slope * np.maximum(x - max_penetration, 0.0), slope


def _multiply(matrices: Array, vectors: Array) -> Array:
    return np.asarray((matrices @ vectors[..., None])[..., 0])


def _solve(matrices: Array, vectors: Array) -> Array:
    return np.asarray(np.linalg.solve(matrices, vectors[..., None])[..., 0])
