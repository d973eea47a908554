"""A train with its excitation, in modal coordinates and ready to be integrated."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from lumped.coupled import (
    CoupledContacts,
    LoadedState,
    Springs,
    coupled_steps,
    coupled_system,
    loaded_state,
)
from lumped.excitation import MeshExcitation, PairExcitation
from lumped.friction import base_pitch, friction_rows, side_of
from lumped.kernels.arrays import (
    PITCH,
    CoupledSteps,
    CoupledSystem,
    FrictionSamples,
    ModalSystem,
    Pieces,
    Samples,
)
from lumped.modes import Modes, natural_modes
from lumped.train import Train, TrainError
from lumped.waves import SAME, Wave

Array = NDArray[np.float64]
UNTOUCHED = 1e-20  # part of strain energy in the meshes below which a mode is left out
BALANCED = 1e-3  # of the torques on a motion that nothing holds; less is rounding
MOST_BYTES = 1e9  # of the excitation on the steps of a common period
MOTION_BYTES = 150  # of a step and mesh, while a motion is recorded and measured
CONTACT_BYTES = 32  # of a step and contact of the coupled model, recorded twice over
GAP_POINTS = 256  # per base pitch
RUNAWAY = 1e6  # times the largest velocity that statics and gaps suggest


@dataclass(frozen=True, eq=False)
class LumpedSystem:
    """A train and the excitation of each of its meshes.

    Modes that strain no mesh, rigid rotation among them, take no part in the
    motion; raises TrainError where torques do not balance on one that is free.

    contacts : of the coupled model, which then move the train; the excitations, of
        Model-1, give its modes and by them its damping
    friction : coefficients of the meshes, none if empty; see `lumped.friction`, which
        also gives the excitations that friction bends
    """

    train: Train
    excitations: tuple[MeshExcitation, ...]
    contacts: CoupledContacts | None = None
    friction: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if len(self.excitations) != len(self.train.meshes):
            raise TrainError(
                f"excitations: {len(self.excitations)} for "
                f"{len(self.train.meshes)} meshes"
            )
        self._require_friction()
        space = self.modes.coordinates
        free = self.modes.shapes[:, self.modes.frequency_Hz == 0.0]
        net = np.abs(free.T @ space.load)
        size = np.abs(free.T) @ np.abs(space.load)
        if (net > BALANCED * size).any():
            raise TrainError(
                "torques do not balance: the train would accelerate; "
                "hold a gear by a coupling_stiffness or change a torque"
            )

    def _require_friction(self) -> None:
        if not self.friction:
            return
        if len(self.friction) != len(self.train.meshes):
            raise TrainError(
                f"friction: {len(self.friction)} for {len(self.train.meshes)} meshes"
            )
        if self.contacts is not None:
            raise TrainError("friction: of models 1 to 3, not of the coupled model")
        for excitation in self.excitations:
            if any(pair.ahead is None for pair in excitation.pairs):
                raise TrainError("friction: needs tooth pairs, the excitation has none")

    @property
    def rubs(self) -> bool:
        """Whether teeth have friction."""
        return any(self.friction)

    @cached_property
    def modes(self) -> Modes:
        return natural_modes(self.train, [e.mean_stiffness for e in self.excitations])

    @cached_property
    def moving(self) -> NDArray[np.intp]:
        """Indices of the modes that take part in the motion."""
        return np.flatnonzero(self.modes.mesh_energy.sum(axis=0) > UNTOUCHED)

    @cached_property
    def arrays(self) -> ModalSystem:
        """As the kernels take it."""
        modes, kept = self.modes, self.moving
        angular = modes.angular[kept]
        pairs = [len(excitation.pairs) for excitation in self.excitations]
        return ModalSystem(
            rigidity=angular**2,
            damping=2.0 * self.train.damping_ratio * angular,
            load=modes.shapes[:, kept].T @ modes.coordinates.load,
            shapes=np.ascontiguousarray(modes.mesh_shapes[:, kept]),
            mean_stiffness=modes.mean_stiffness,
            backlash=np.array([mesh.backlash for mesh in self.train.meshes]),
            first_pair=np.concatenate([[0], np.cumsum(pairs)]),
        )

    @cached_property
    def coupled_arrays(self) -> CoupledSystem | None:
        """The coupled model as the kernels take it, None for models 1 to 3."""
        if self.contacts is None:
            return None
        known, shapes = self.arrays, self.arrays.shapes
        meshes = np.einsum("m,mi,mj->ij", known.mean_stiffness, shapes, shapes)
        train = Springs(
            stiffness=np.diag(known.rigidity) - meshes,
            damping=known.damping,
            load=known.load,
            shapes=shapes,
            rate=np.array([float(rate) for rate in self.train.mesh_rates]),
            start=self.static_state[0],
        )
        return coupled_system(self.contacts, train)

    @cached_property
    def loaded(self) -> LoadedState | None:
        """Static equilibrium of the coupled model over a mesh cycle."""
        if self.coupled_arrays is None:
            return None
        return loaded_state(self.coupled_arrays, self.static_state[0])

    @cached_property
    def resonances_Hz(self) -> Array:
        """Natural frequencies of the modes that move; under load if coupled."""
        if self.loaded is None:
            return np.asarray(self.modes.frequency_Hz[self.moving])
        return self.loaded.frequency_Hz

    @cached_property
    def static_state(self) -> Array:
        """Modal displacement at rest under the mean stiffness, zero velocity (2, n).

        No gap counts: a train without load starts with its teeth just touching.
        """
        load = self.arrays.load
        return np.stack([load / self.arrays.rigidity, np.zeros_like(load)])

    def state_from(self, other: LumpedSystem, state: Array) -> Array:
        """Modal displacements and velocities (2, n) of gears that move as another's.

        state : of the other system, which has the same gears and freedoms
        """
        moved = state @ other.modes.shapes[:, other.moving].T
        momentum = moved * self.modes.coordinates.mass
        return np.asarray(momentum @ self.modes.shapes[:, self.moving])

    @cached_property
    def static_deflection(self) -> Array:
        """Mean mesh deflections (m,) under the external torques [m]."""
        return self.arrays.shapes @ self.static_state[0]

    @cached_property
    def pieces(self) -> Pieces:
        """The excitation as adaptive steps take it."""
        waves, mesh_of = [], []
        for m, excitation in enumerate(self.excitations):
            for pair in excitation.pairs:
                waves += [pair.stiffness, pair.gap]
                mesh_of.append(m)
        sizes = [wave.breaks.size - 1 for wave in waves]
        shapes = [len(wave.shapes) for wave in waves]
        rows = np.cumsum([0] + [n * c for n, c in zip(sizes, shapes, strict=True)])[:-1]
        offsets = np.cumsum([0] + [wave.offsets.size for wave in waves])
        whole = np.repeat([self._whole[m] for m in mesh_of], 2)
        pitches = (rows, shapes, offsets[:-1], np.diff(offsets), whole, rows)
        return Pieces(
            place=np.array([(*self._places[m], 0.0) for m in mesh_of]),
            first_piece=np.concatenate([[0], np.cumsum(sizes)]),
            breaks=np.concatenate([wave.breaks for wave in waves]),
            coefficients=np.concatenate(
                [wave.coefficients.reshape(-1, 4) for wave in waves]
            ),
            stops=np.unique(np.concatenate([self.corners(), self._handovers()])),
            mesh_of=np.array(mesh_of),
            pitches=np.stack(pitches, axis=1),
            offsets=np.concatenate([wave.offsets for wave in waves]),
        )

    @cached_property
    def turns(self) -> NDArray[np.int64]:
        """Base pitches by which each function (2 p,) is further on after a round."""
        return np.repeat(np.array(self.train.common_period)[self.pieces.mesh_of], 2)

    def pieces_in(self, number: int) -> Pieces:
        """`pieces` of its own for a round of the common period, by its number."""
        pitches = self.pieces.pitches.copy()
        pitches[:, PITCH] += number * self.turns
        return self.pieces._replace(place=self.pieces.place.copy(), pitches=pitches)

    def _handovers(self) -> Array:
        """Times at which a mesh starts a cycle and pairs pass their waves on."""
        length = self.train.common_period[0]
        return np.concatenate(
            [
                (np.arange(round(length * rate)) + (-phase) % 1.0) / rate
                for phase, rate in self._places
            ]
        )

    @cached_property
    def common_period(self) -> tuple[int, ...]:
        """Shortest time after which all repeats, in periods of each mesh.

        That of the meshes, and where teeth differ of the pairs that they form.
        """
        rates = self.train.mesh_rates
        each = (e.period / r for e, r in zip(self.excitations, rates, strict=True))
        first = math.lcm(*(period.numerator for period in each))
        return tuple(int(first * rate) for rate in rates)

    @property
    def rounds(self) -> int:
        """How many times all meshes repeat until their teeth do."""
        return self.common_period[0] // self.train.common_period[0]

    @cached_property
    def energy_norm(self) -> float:
        """A moderate sum of modal velocities, from the loads and the gaps."""
        stiffness, backlash = self.arrays.mean_stiffness, self.arrays.backlash
        reach = np.abs(self.static_deflection).sum() + sum(
            largest_gap(pair) for e in self.excitations for pair in e.pairs
        )
        reach += backlash[np.isfinite(backlash)].sum()
        return math.sqrt(stiffness.max()) * max(reach, 1e-9)

    @property
    def limit(self) -> float:
        """Sum of modal velocities beyond which a run has diverged."""
        return RUNAWAY * self.energy_norm

    def samples(self, steps: int) -> Samples | FrictionSamples:
        """Steps of one common period and the excitation on them.

        steps : at least so many per period of the first mesh
        Step sizes are in periods of the first mesh. Raises TrainError where that is
        more than memory should hold.
        """
        # long ones are not kept: to make them takes a part of the time of a period
        return self._samples(steps) if self.rounds > 1 else self._kept_samples(steps)

    @lru_cache(maxsize=4)  # noqa: B019  the system is immutable and short-lived
    def coupled_steps(self, steps: int) -> CoupledSteps:
        """The same for the coupled model, but for the step sizes."""
        assert self.coupled_arrays is not None
        self._require_memory(steps)
        periods = np.array(self.train.common_period)
        halves = np.arange(2 * steps * periods[0]) / (2 * steps)
        return coupled_steps(self.coupled_arrays, halves, periods)

    @lru_cache(maxsize=16)  # noqa: B019  the system is immutable and short-lived
    def _kept_samples(self, steps: int) -> Samples | FrictionSamples:
        return self._samples(steps)

    def _samples(self, steps: int) -> Samples | FrictionSamples:
        self._require_memory(steps)
        times = self._grid(steps)
        middle = 0.5 * (times[:-1] + times[1:])
        points = ((times[:-1], 1), (middle, 1), (times[1:], -1))
        rounds = np.arange(self.rounds)[:, None]
        found = [self.excitation_at(t, side, rounds) for t, side in points]
        stiffness, gap = (np.stack(parts, axis=2) for parts in zip(*found, strict=True))
        flat = -1, 3, stiffness.shape[-1]
        steps_in_all = np.tile(np.diff(times), self.rounds)
        samples = Samples(steps_in_all, stiffness.reshape(flat), gap.reshape(flat))
        return self._with_friction(samples, times) if self.rubs else samples

    def _with_friction(self, samples: Samples, times: Array) -> FrictionSamples:
        """The same with what friction adds."""
        slide, arm = self.sliding_at(0.5 * (times[:-1] + times[1:]))
        at = np.stack([times[:-1], 0.5 * (times[:-1] + times[1:]), times[1:]], axis=1)
        slide = np.repeat(slide[:, None], 3, axis=1)
        pitch, rate = self._pair_pitch, self._pair_rate
        arm = arm[:, None] + (at - at[:, 1:2])[..., None] * (rate * pitch)
        rounds = (self.rounds, 1, 1)
        rows = friction_rows(self.train, self.modes.coordinates)
        shapes = [each @ self.modes.shapes[:, self.moving] for each in rows]
        return FrictionSamples(
            *samples, np.tile(slide, rounds), np.tile(arm, rounds), *shapes
        )

    def sliding_at(self, times: Array) -> tuple[Array, Array]:
        """Of all pairs (t, p) at times, in periods of the first mesh: coefficient of
        friction, negative in recess, and way ahead of the pitch point [m]."""
        slide, arm, column = [], [], 0
        for m, excitation in enumerate(self.excitations):
            phase, rate = self._places[m]
            cycle = phase + rate * times
            place = cycle - np.floor(cycle)
            for pair in excitation.pairs:
                ahead = pair.ahead or 0
                side = self.friction[m] * side_of(ahead)
                slide.append(np.full(times.shape, side))
                arm.append((place + ahead) * self._pair_pitch[column])
                column += 1
        return np.stack(slide, axis=-1), np.stack(arm, axis=-1)

    @property
    def _pair_pitch(self) -> Array:
        """Base pitch of every pair (p,) [m]."""
        counts = [len(excitation.pairs) for excitation in self.excitations]
        meshes = range(len(counts))
        return np.repeat([base_pitch(self.train, m) for m in meshes], counts)

    @property
    def _pair_rate(self) -> Array:
        """Mesh frequency of every pair (p,) over that of the first mesh."""
        counts = [len(excitation.pairs) for excitation in self.excitations]
        return np.repeat([float(rate) for rate in self.train.mesh_rates], counts)

    def excitation_at(
        self, times: Array, side: int = 1, rounds: NDArray[np.intp] | int = 0
    ) -> tuple[Array, Array]:
        """Stiffness [N/m] and gap [m] of all pairs (..., p) at times.

        times : in periods of the first mesh; side -1 takes the limit from below
        rounds : whole common periods of the meshes that have passed, broadcast
        """
        stiffness, gap = [], []
        for m, excitation in enumerate(self.excitations):
            phase, rate = self._places[m]
            pitch = self._whole[m] + np.asarray(rounds) * self.train.common_period[m]
            at = phase + rate * times
            for pair in excitation.pairs:
                stiffness.append(pair.stiffness(at, side, pitch))
                gap.append(pair.gap(at, side, pitch))
        # a wave that does not vary has no shape of its own
        shape = np.broadcast_shapes(times.shape, np.shape(rounds))
        k, g = (
            np.stack([np.broadcast_to(part, shape) for part in parts], axis=-1)
            for parts in (stiffness, gap)
        )
        return k, g

    def holds(self, steps: int) -> bool:
        """Whether memory should hold a common period of so many steps a period."""
        return self._bytes(steps) <= MOST_BYTES

    def _bytes(self, steps: int) -> int:
        """Of the excitation on steps, and of the motion where the period is long."""
        meshes = len(self.excitations)
        if self.contacts is None:
            length, each = self.common_period[0], 48 * self.arrays.first_pair[-1]
            each *= 2 if self.rubs else 1
            contacts = 0
        else:
            contacts, _, n = self.contacts.rows.shape
            # pitch errors come to half steps that repeat with the meshes
            length = self.train.common_period[0]
            each = 16 * contacts * (contacts + n + meshes + 1)
        found = int(each) * length * steps
        if self.rounds > 1:
            motion = MOTION_BYTES * meshes + CONTACT_BYTES * contacts
            found += motion * self.common_period[0] * steps
        return found

    def _require_memory(self, steps: int) -> None:
        if self.holds(steps):
            return
        what, teeth, ways = "excitation", "", "higher speeds or simpler tooth ratios"
        if self.rounds > 1:
            what, teeth = "motion", " and tooth pairs with pitch errors"
            ways = "pitch errors of fewer gears or that repeat sooner, higher speeds"
            ways += " or fewer steps"
        raise TrainError(
            f"{self.common_period[0]} periods of the first mesh, after which all "
            f"meshes{teeth} repeat, of {steps:.3g} steps each: "
            f"{self._bytes(steps) / 1e9:.3g} GB of {what}, more than a run should hold "
            f"in memory; allowed are {ways}"
        )

    @cached_property
    def _places(self) -> list[tuple[float, float]]:
        """(phase within a cycle, rate) of each mesh."""
        meshes, rates = self.train.meshes, self.train.mesh_rates
        return [
            (math.fmod(mesh.phase, 1.0), float(rate))
            for mesh, rate in zip(meshes, rates, strict=True)
        ]

    @cached_property
    def _whole(self) -> list[int]:
        """Base pitches by which each mesh is ahead of its place."""
        return [int(mesh.phase) for mesh in self.train.meshes]

    def _grid(self, steps: int) -> Array:
        """Times until all meshes repeat, on all corners and even between."""
        length = self.train.common_period[0]
        ends = np.concatenate([self.corners(), [float(length)]])
        starts = np.concatenate([[0.0], self.corners()])
        parts = [
            np.linspace(a, b, max(1, math.ceil((b - a) * steps - SAME)), endpoint=False)
            for a, b in zip(starts, ends, strict=True)
        ]
        return np.concatenate([*parts, [float(length)]])

    def corners(self) -> Array:
        """Times until all meshes repeat at which some excitation has a corner."""
        return self._times([{c for w in own for c in w.corners} for own in self._waves])

    def breaks(self) -> Array:
        """Times until all meshes repeat at which an excitation begins a new cubic."""
        return self._times([{x for w in own for x in w.breaks} for own in self._waves])

    @property
    def _waves(self) -> list[list[Wave]]:
        """Stiffnesses and gaps of the pairs of each mesh."""
        return [
            [wave for pair in e.pairs for wave in (pair.stiffness, pair.gap)]
            for e in self.excitations
        ]

    def _times(self, positions: Sequence[Iterable[float]]) -> Array:
        """Times, sorted, at which the meshes are at positions of their cycles."""
        length = self.train.common_period[0]
        found: set[float] = set()
        for own, (phase, rate) in zip(positions, self._places, strict=True):
            for position in own:
                first = (position - phase) % 1.0
                found |= {(first + i) / rate for i in range(round(length * rate))}
        times = np.sort([t for t in found if SAME < t < length - SAME])
        return times[np.diff(times, prepend=-1.0) > 1e3 * SAME]


def largest_gap(pair: PairExcitation) -> float:
    """Largest gap where the pair has a stiffness [m]."""
    x = np.arange(GAP_POINTS) / GAP_POINTS
    pitch = np.arange(pair.period)[:, None]
    stiff = pair.stiffness(x, pitch=pitch) > 0.0
    return float(np.abs(pair.gap(x, pitch=pitch) * stiff).max())
