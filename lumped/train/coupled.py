"""A train whose contacts deflect each other: the coupled model.

Every tooth pair has its own law of load over penetration, which stiffens like Hertzian
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

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lumped.kernels.arrays import (
    ContactGrid,
    Contacts,
    CoupledSteps,
    CoupledSystem,
    PenetrationProblem,
    in_row_order,
)
from lumped.train.propagator import LinearPart
from lumped.train.truncation import TruncationModel

Array = NDArray[np.float64]
COMPONENTS = "hardening", "pairs", "body", "meshes", "modes"
MAX_FACING_GAP = 5e-3  # m, gaps beyond which flanks do not face each other
MAX_ITERATIONS = 60  # iterations of Newton's method for static equilibrium
ROUNDING = 1e-9  # round-off of a position in a mesh cycle
EQUILIBRIUM_RTOL = 1e-12  # error relative to the range of the contacts' tables


OF_EACH = "angular", "damping", "coupling", "whirl", "gears", "nodal_diameters"


@dataclass(frozen=True, eq=False)
class BodyModes:
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

    def only(self, retained: NDArray[np.bool_]) -> BodyModes:
        """Return a subset of the modes by a mask (b,)."""
        values = {name: vars(self)[name][retained] for name in OF_EACH}
        rows = np.ascontiguousarray(self.rows[..., retained])
        return BodyModes(
            **values, mass=self.mass[np.ix_(retained, retained)], rows=rows
        )

    @property
    def pairs(self) -> Array:
        """Rates `whirl` (w,) of the pairs."""
        travelling = self.whirl[self.nodal_diameters > 0]
        return travelling[: travelling.size // 2]

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
class CoupledContacts:
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
    solved : all body modes that were solved, of which `modes` are coordinates
    inertia : inertia of all solved body modes, and of the rest of the bodies
    retained : (b,) mask of the solved modes that are coordinates
    without : those of INGREDIENTS that are left out
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
    solved: BodyModes | None = None
    inertia: TruncationModel | None = None
    retained: NDArray[np.bool_] | None = None
    without: tuple[str, ...] = ()

    @property
    def with_all_modes(self) -> CoupledContacts:
        """The contacts with all solved body modes as coordinates."""
        if self.solved is None or self.retained is None:
            return self
        without = tuple(name for name in self.without if name != "modes")
        retained = np.ones_like(self.retained)
        return replace(self, modes=self.solved, retained=retained, without=without)

    @property
    def of_equal_teeth(self) -> CoupledContacts:
        """The contacts without pitch errors."""
        errors = self.contacts.errors[:, :0]
        return replace(self, contacts=self.contacts._replace(errors=errors))

    @property
    def bodies(self) -> BodyModes:
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
    place : (p + 1, n) coordinates
    springs : (n, n) stiffness without the meshes, in modal coordinates in mean axes
    tangent : (p, m, n, n) tangent stiffness of each mesh [1/s2]; a load that is
        transmitted to another mesh counts half for each
    """

    deflection: Array
    load: Array
    penetration: Array
    load_sensitivity: Array
    place: Array
    springs: Array
    tangent: Array

    @property
    def meshes(self) -> Array:
        """Mean tangent stiffness (m, n, n) of each mesh over the cycle [1/s2]."""
        return np.asarray(self.tangent.mean(axis=0))

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
        strain = np.einsum("in,mij,jn->mn", self.shapes, self.meshes, self.shapes)
        squares = (2.0 * np.pi * self.frequency_Hz) ** 2
        return np.divide(strain, squares, np.zeros_like(strain), where=squares > 0.0)

    @cached_property
    def _modes(self) -> tuple[Array, Array]:
        squares, shapes = np.linalg.eigh(self.springs + self.meshes.sum(axis=0))
        return np.sqrt(np.maximum(squares, 0.0)) / (2.0 * np.pi), shapes


def coupled_system(coupled: CoupledContacts, train: ModalTrain) -> CoupledSystem:
    """System in the form that the kernels take, without the ingredients left out."""
    if "body" in coupled.without:
        nothing = np.zeros_like(coupled.inertia_rows), np.zeros_like(coupled.work)
        coupled = replace(coupled, inertia_rows=nothing[0], work=nothing[1])
    system, hubs = _in_mean_axes(*_with_bodies(coupled, train), coupled.bodies.pairs)
    start = _start(train, system)
    for name, leave_out in LEAVE_OUT.items():
        if name in coupled.without:
            # about the state of the model with the ingredients not yet left out
            loaded = loaded_state(system, start)
            system = system._replace(contacts=leave_out(system, loaded))
    return system._replace(damping=_damping(system, hubs, train, coupled.bodies))


def _start(train: ModalTrain, system: CoupledSystem) -> Array:
    """Coordinates (n,) near static equilibrium."""
    start = np.zeros(system.load.size)
    start[: train.start.size] = train.start
    return start


def _with_bodies(
    coupled: CoupledContacts, train: ModalTrain
) -> tuple[CoupledContacts, ModalTrain]:
    """Contacts and springs in the coordinates of hubs and body modes, of unit mass."""
    bodies, hubs = coupled.bodies, train.load.size
    E, G, squares = bodies.rows, bodies.coupling, bodies.angular**2
    size, to_unit = hubs + bodies.count, bodies.to_unit

    def joined(of_hubs: Array, of_bodies: Array) -> Array:
        return np.concatenate([of_hubs, of_bodies], axis=-1) @ to_unit

    compliance = coupled.contacts.normal_compliance - np.einsum(
        "cpb,dpb->pcd", E / squares, E
    )
    inertial = coupled.inertia_rows - np.einsum("cpb,bn->cpn", E / squares, G)
    work = np.zeros((size, size))
    work[:hubs, :hubs] = coupled.work - (G.T / squares) @ G
    stiffness = np.zeros((size, size))
    stiffness[:hubs, :hubs] = train.stiffness
    stiffness[hubs:, hubs:] = np.diag(squares)
    none = np.zeros(bodies.count)
    contacts = replace(
        coupled,
        rows=joined(coupled.rows, E),
        inertia_rows=joined(inertial, np.zeros_like(E)),
        work=to_unit.T @ work @ to_unit,
        contacts=coupled.contacts._replace(normal_compliance=compliance),
    )
    springs = replace(
        train,
        stiffness=to_unit.T @ stiffness @ to_unit,
        load=np.concatenate([train.load, none]) @ to_unit,
        shapes=joined(train.shapes, np.zeros((len(train.shapes), bodies.count))),
    )
    return contacts, springs


def contact_grid(system: CoupledSystem, steps: int, periods: Array) -> ContactGrid:
    """Contacts at the steps of some cycles of the meshes, `steps` per cycle of the
    first.

    periods : (m,) cycles of each mesh after which all repeat, except for pitch errors
    """
    grid, mesh_of = system.contacts.gap.shape[1] - 1, system.mesh_of
    cycles = system.rate * (np.arange(steps * periods[0]) / steps)[:, None]
    turn = np.floor(cycles + ROUNDING).astype(np.int64)
    at = np.maximum(cycles - turn, 0.0) * grid
    place = np.minimum((at + ROUNDING * grid).astype(np.int64), grid - 1)
    part = np.where(np.abs(at - place) < ROUNDING * grid, 0.0, at - place)

    def between(table: Array) -> Array:
        """Entries (s, c, ...) of a table (c, p + 1, ...) at the steps."""
        every, here = np.arange(len(mesh_of)), place[:, mesh_of]
        share = part[:, mesh_of].reshape(*here.shape, *[1] * (table.ndim - 2))
        return (1.0 - share) * table[every, here] + share * table[every, here + 1]

    gap = between(system.contacts.gap)
    compliance = np.swapaxes(system.contacts.normal_compliance, 0, 1)
    facing = gap < MAX_FACING_GAP
    faces = np.where(facing, np.arange(len(mesh_of)), len(mesh_of))
    faces = np.sort(faces)[:, : facing.sum(axis=1).max()]
    step_grid = ContactGrid(
        place=place,
        part=part,
        turn=turn,
        periods=np.array(periods),
        gap=gap,
        rows=between(system.rows),
        ahead=between(system.ahead),
        compliance=between(compliance),
        facing=facing,
        faces=np.where(faces < len(mesh_of), faces, -1),
    )
    return in_row_order(step_grid)


def coupled_steps(
    system: CoupledSystem,
    linear: LinearPart,
    grid: ContactGrid,
    frequency: float,
    rounds: int,
) -> CoupledSteps:
    """Steps of a common period at a frequency of the first mesh [Hz].

    rounds : number of repetitions of the grid in a common period
    """
    from lumped.kernels.coupled import add_moving

    steps = len(grid.gap) // int(grid.periods[0])
    h = 1.0 / (frequency * steps)
    propagator = linear.step(frequency, h)
    a, push = linear.standing, propagator.waves[:, 2:4].sum(axis=0)
    compliance = grid.compliance.copy()
    newest = np.ascontiguousarray(propagator.push[:, :a])
    add_moving(grid.rows, grid.facing, newest, push, compliance)
    return CoupledSteps(
        h=np.full(rounds * len(grid.gap), h),
        grid=grid,
        propagator=propagator,
        compliance=compliance,
        **_room(system),
    )


def _room(system: CoupledSystem) -> dict[str, Any]:
    count = len(system.mesh_of)
    problem = PenetrationProblem(
        knots=system.contacts.knots,
        load_curve=system.contacts.load_curve,
        place=np.zeros(system.rate.size, np.int64),
        part=np.zeros(system.rate.size),
        mesh_of=system.mesh_of,
        reversed=np.zeros(count, np.int64),
        free=np.zeros(count),
        start=np.zeros(count),
        cell=np.zeros(count, np.int64),
        chosen=np.empty(count, np.int64),
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
    """Displacement of the hubs (n,), per coordinate (n, n) and load (c, p + 1, n)."""

    turn: Array
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
    of_mesh = np.flatnonzero(coupled.mesh_of == mesh)
    contacts, none = coupled.contacts, np.zeros((of_mesh.size, len(coupled.rows[0]), 1))
    gap, errors = contacts.gap[of_mesh], contacts.errors[of_mesh]
    if errors.size:
        gap = gap + errors[:, [cycle % errors.shape[1]]]
    alone = replace(
        coupled,
        mesh_of=np.zeros(of_mesh.size, np.int64),
        rows=coupled.penetration_rate[of_mesh][:, :, None],
        inertia_rows=none,
        work=np.zeros((1, 1)),
        modes=None,
        contacts=contacts._replace(
            first=np.array([0, of_mesh.size]),
            gap=gap,
            knots=contacts.knots[[mesh]],
            load_curve=contacts.load_curve[of_mesh],
            normal_compliance=contacts.normal_compliance[:, of_mesh][:, :, of_mesh],
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
    return loaded_state(coupled_system(alone, train), train.start).deflection[:, 0]


def _in_mean_axes(
    coupled: CoupledContacts, train: ModalTrain, whirl: Array
) -> tuple[CoupledSystem, Hubs]:
    R, U, W, K = coupled.rows, coupled.inertia_rows, coupled.work, train.stiffness
    S = np.linalg.inv(np.eye(len(W)) + K @ W)
    P, load = U - R @ W, S @ train.load
    turn = np.eye(len(W)) - W @ S @ K
    hubs = Hubs(turn, P @ turn.T)
    both = np.einsum("cpi,dpi->pcd", U, R)
    compliance = coupled.contacts.normal_compliance - both - both.transpose(0, 2, 1)
    compliance += np.einsum("cpi,dpi->pcd", R @ W, R)
    compliance -= np.einsum("cpi,dpi->pcd", P @ (S @ K), P)
    contacts = coupled.contacts._replace(
        normal_compliance=compliance, gap=coupled.contacts.gap + P @ load
    )
    system = CoupledSystem(
        stiffness=S @ K,
        damping=np.zeros_like(S),
        load=load,
        whirl=whirl,
        shapes=train.shapes @ turn,
        offset=train.shapes @ W @ load,
        rate=train.rate,
        mesh_of=coupled.mesh_of,
        rows=R + P @ S @ K,
        ahead=hubs.hub_compliance @ train.shapes.T,
        contacts=contacts,
    )
    return system, hubs


def _damping(
    system: CoupledSystem, hubs: Hubs, train: ModalTrain, bodies: BodyModes
) -> Array:
    """Damping matrix (n, n) of the hubs and of the body modes."""
    loaded = loaded_state(system, _start(train, system))
    turned = hubs.turn + np.einsum(
        "cpi,pcj->pij", hubs.hub_compliance, loaded.load_sensitivity
    )
    turned = bodies.to_unit @ turned[:-1]
    both = np.concatenate([train.damping, bodies.damping])
    damped = np.tensordot(turned * both[:, None], turned, ((0, 1), (0, 1)))
    damped /= len(turned)
    # pairs retain only their own damping: they must whirl unchanged
    pairs = slice(damped.shape[0] - 2 * bodies.pairs.size, None)
    damped[pairs], damped[:, pairs] = 0.0, 0.0
    damped[pairs, pairs] = np.diag(both[pairs])
    return np.asarray(damped)


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
    others = system.mesh_of[:, None] == system.mesh_of
    np.fill_diagonal(others, False)
    shared = np.einsum("pcd,pd->pc", compliance * others, loaded.load)
    carries = loaded.load > 0.0
    mutual = np.divide(shared, loaded.load, np.zeros_like(shared), where=carries)
    compliance[:, others] = 0.0
    every = np.arange(system.mesh_of.size)
    compliance[:, every, every] += mutual
    # pairs that are kept apart by others at rest stay apart
    gap = system.contacts.gap + np.where(carries, 0.0, shared).T
    return system.contacts._replace(normal_compliance=compliance, gap=gap)


def _without_hardening(system: CoupledSystem, loaded: LoadedState) -> Contacts:
    """Contacts with the secant stiffness at the largest load that each has at rest."""
    contacts = system.contacts
    top = np.maximum(loaded.penetration.max(axis=0), 1e-3 * contacts.knots[0, -1])
    load, _ = contact_loads(system, np.tile(top, (len(loaded.load), 1)))
    law = np.zeros_like(contacts.load_curve)
    secant = (load / top).T[:, :, None, None]
    law[..., 1] = secant
    law[..., 0] = secant * contacts.knots[system.mesh_of][:, None, None, :-1]
    return contacts._replace(load_curve=law)


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
    K, B = system.stiffness, system.rows.transpose(1, 0, 2)
    Q, gap = system.contacts.normal_compliance, system.contacts.gap.T
    positions, count, n = B.shape
    q, eye = start + _closing(system, start), np.eye(count)
    x = _times(B, q) - gap
    exact = EQUILIBRIUM_RTOL * system.contacts.knots[:, -1].max()
    for _ in range(MAX_ITERATIONS):
        F, D = contact_loads(system, x)
        miss = [
            x + _times(Q, F) - _times(B, q) + gap,
            q @ K + _times(B.transpose(0, 2, 1), F) - system.load,
        ]
        matrix = np.zeros((positions, count + n, count + n))
        matrix[:, :count, :count] = eye + Q * D[:, None, :]
        matrix[:, :count, count:] = -B
        matrix[:, count:, :count] = B.transpose(0, 2, 1) * D[:, None, :]
        matrix[:, count:, count:] = K
        step = _solve(matrix, np.concatenate(miss, axis=1))
        x, q = x - step[:, :count], q - step[:, count:]
        if not np.isfinite(step).all():
            break
        if (np.abs(step[:, :count]) < exact).all():
            return _linearise(system, x, q, B)
    raise ArithmeticError("no static equilibrium of the contacts was found")


def _closing(system: CoupledSystem, start: Array) -> Array:
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


def _linearise(system: CoupledSystem, x: Array, q: Array, B: Array) -> LoadedState:
    F, D = contact_loads(system, x)
    by_loads = np.einsum("cpm,pc->pm", system.ahead, F)
    Q, eye = system.contacts.normal_compliance, np.eye(len(system.mesh_of))
    pressed = np.asarray(
        np.linalg.solve(eye + D[:, :, None] * Q, D[:, :, None] * B), float
    )
    # the end of the cycle is the start of the next
    of_mesh = np.eye(system.rate.size)[system.mesh_of]  # (c, m)
    tangent = np.einsum("cm,pci,pcj->pmij", of_mesh, B[:-1], pressed[:-1])
    return LoadedState(
        deflection=system.offset + q @ system.shapes.T + by_loads,
        load=F,
        penetration=x,
        load_sensitivity=pressed,
        place=q,
        springs=system.stiffness,
        tangent=0.5 * (tangent + np.swapaxes(tangent, 2, 3)),
    )


def contact_loads(system: CoupledSystem, x: Array) -> tuple[Array, Array]:
    """Loads [N] and slopes [N/m] of the contacts at penetrations, all (p + 1, c)."""
    law, knots = (
        system.contacts.load_curve[:, :, 0],
        system.contacts.knots[system.mesh_of],
    )
    reach, cells = knots[:, -1], law.shape[2]
    inside = np.clip(x, 0.0, reach)
    cell = np.minimum((cells * np.sqrt(inside / reach)).astype(int), cells - 1)
    contact, place = np.arange(x.shape[1])[None, :], np.arange(len(x))[:, None]
    cell -= inside < knots[contact, cell]  # round-off of the root
    t = inside - knots[contact, cell]
    c0, c1, c2, c3 = np.moveaxis(law[contact, place, cell], -1, 0)
    load = (c0 + t * (c1 + t * (c2 + t * c3))) * (x > 0.0)
    slope = (c1 + t * (2.0 * c2 + t * 3.0 * c3)) * (x > 0.0)
    return load + slope * np.maximum(x - reach, 0.0), slope


def _times(matrices: Array, vectors: Array) -> Array:
    return np.asarray((matrices @ vectors[..., None])[..., 0])


def _solve(matrices: Array, vectors: Array) -> Array:
    return np.asarray(np.linalg.solve(matrices, vectors[..., None])[..., 0])
