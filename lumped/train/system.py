"""Train with its excitation, in modal coordinates and prepared for integration."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from lumped.common.array_types import Array
from lumped.common.checks import require_between, require_fields, require_present
from lumped.common.short_repr import ShortRepr
from lumped.kernels.arrays import (
    BearingSamples,
    ContactGrid,
    CoupledSteps,
    CoupledSystem,
    ExcitationSamples,
    FrictionSamples,
    ModalSystem,
    SpaceSamples,
)
from lumped.train.at_rest import (
    RestReference,
    StaticCheck,
    check_springs,
    compare_at_rest,
)
from lumped.train.bodies import TrainError
from lumped.train.coupled import (
    CoupledContacts,
    HubOutputs,
    LoadedState,
    ModalTrain,
    contact_grid,
    coupled_steps,
    coupled_system,
    hub_outputs,
    loaded_state,
    static_errors,
    steps_of_cycle,
)
from lumped.train.excitation import MeshExcitation
from lumped.train.friction import FrictionRows, ToothFriction, friction_rows
from lumped.train.friction_samples import with_friction
from lumped.train.modes import (
    MIN_FELT_ENERGY,
    MIN_MESH_MODE_ENERGY,
    Modes,
    natural_modes,
)
from lumped.train.propagator import LinearPart
from lumped.train.rolling_supports import (
    RollingSupports,
    bearing_rows,
    require_springs,
    rolling_supports,
)
from lumped.train.rotating_frame import RotatingFrame, rotating_frame
from lumped.train.space import MotionInSpace, angular_speed
from lumped.train.train import Train
from lumped.train.train_excitation import TrainExcitation, largest_gap

# Part of strain energy in the meshes below which a mode is omitted
MIN_MESH_STRAIN = 1e-20
MIN_BEARING_SHIFT = 1e-9  # of a mode, over the largest, that counts as motion
# Relative imbalance of torques on a free motion that is round-off
IMBALANCE_RTOL = 1e-3
COUPLED_MODEL = "coupled model"
MAX_BYTES = 1e9  # largest memory of the excitation on the steps of a common period
MOTION_BYTES = 150  # memory per step and mesh while a motion is recorded and measured
CONTACT_BYTES = 32  # memory per step and contact of the coupled model, recorded twice
# Multiple of the largest velocity expected from statics and gaps
DIVERGENCE_RATIO = 1e6


@dataclass(frozen=True, eq=False)
class LumpedSystem(ShortRepr):
    """Train and the excitation of each of its meshes.

    Modes that strain no mesh, including rigid rotation, take no part in the motion,
    unless sliding in them reverses friction or they move a gear on a rolling bearing.
    Rotations of the rings of rolling bearings are coordinates behind the modes.

    Parameters
    ----------
    train : Train
        Gears, meshes and shafts; m meshes.
    excitations : tuple of MeshExcitation
        Excitation of each mesh.
    contacts : CoupledContacts, optional
        Contacts of the coupled model, which then drive the train; the excitations, of
        Model-1, define its modes and thereby its damping.
    friction : tuple of ToothFriction, optional
        Friction of each mesh's teeth, none if empty; the excitations then include
        deflection by friction, from `lumped.train.friction.with_bending`.
    losses : float, optional
        Fraction of the torques lost to friction, by which they need not balance; from 0
        to below 1.
    references : tuple of RestReference or None, optional
        What each mesh is compared with at rest; None where nothing is known, and empty
        where that is so of all.
    space : MotionInSpace, optional
        Coordinates of gears that move in space, in place of those of the train.

    Raises
    ------
    TrainError
        If torques do not balance on a mode that is free, or the excitations or the
        friction do not fit the train.
    ValueError
        If a value is not of its type or not allowed.
    """

    train: Train
    excitations: tuple[MeshExcitation, ...]
    contacts: CoupledContacts | None = None
    friction: tuple[ToothFriction, ...] = ()
    losses: float = 0.0
    references: tuple[RestReference | None, ...] = ()
    space: MotionInSpace | None = None

    def __post_init__(self) -> None:
        require_between("losses", self.losses, 0, 1, below=True)
        require_fields(self)
        if len(self.excitations) != len(self.train.meshes):
            raise TrainError(
                f"excitations: {len(self.excitations)} for "
                f"{len(self.train.meshes)} meshes"
            )
        self._require_friction()
        require_springs(self.train)
        self._require_bearings()
        self._require_space()
        coordinates = self.modes.coordinates
        free = self.modes.shapes[:, self.modes.frequency_Hz == 0.0]
        net = np.abs(free.T @ coordinates.load)
        magnitude = np.abs(free.T) @ np.abs(coordinates.load)
        if (net > (IMBALANCE_RTOL + self.losses) * magnitude).any():
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

    def _require_bearings(self) -> None:
        """Require springs of rolling bearings, and nothing that excludes them."""
        if self.rolling is None:
            return
        if self.friction:
            raise TrainError("friction: not with rolling bearings, use linear ones")
        if self.contacts is not None:
            raise TrainError(
                "rolling bearings: of models 1 to 3, not of the coupled model, which "
                "takes linear ones"
            )

    def _require_space(self) -> None:
        """Require springs with places of gears that move in space, and nothing else."""
        if self.space is None:
            return
        if self.friction or self.contacts is not None or self.rolling is not None:
            raise TrainError(
                "motion in space: of models 1 to 3 without friction, not of the "
                "coupled model or on rolling bearings"
            )
        for excitation in self.excitations:
            if any(pair.place is None for pair in excitation.pairs):
                raise TrainError(
                    "motion in space: needs springs with a place along the axis"
                )

    def require_linear_bearings(self, purpose: str) -> None:
        """Raise TrainError if the train has rolling bearings.

        Parameters
        ----------
        purpose : str
            What needs a train without them.

        Raises
        ------
        TrainError
            If the train has rolling bearings.
        """
        if self.rolling is not None:
            raise TrainError(
                f"{purpose}: a motion on rolling bearings has no common period; "
                "linear bearings are needed"
            )

    def require_no_space(self, purpose: str) -> None:
        """Raise TrainError if gears move in space.

        Parameters
        ----------
        purpose : str
            What needs gears that do not.

        Raises
        ------
        TrainError
            If gears move in space.
        """
        if self.space is not None:
            raise TrainError(f"{purpose}: motion in space is not known, use the plane")

    @property
    def has_friction(self) -> bool:
        """Whether teeth have friction."""
        return any(tooth_friction.coefficient for tooth_friction in self.friction)

    @cached_property
    def modes(self) -> Modes:
        """Modes about the mean stiffnesses of the meshes."""
        stiffness = [e.mean_stiffness for e in self.excitations]
        coordinates = self.space.coordinates if self.space else None
        return natural_modes(self.train, stiffness, coordinates)

    @cached_property
    def moving(self) -> NDArray[np.intp]:
        """Indices of the modes that take part in the motion.

        They strain a mesh, or teeth slide in them and the sliding reverses friction.
        In space, where gyroscopic moments couple them, all that strain anything do.
        """
        if self.space is not None:
            return np.flatnonzero(self.modes.frequency_Hz > 0.0)
        taking_part = self._moves_mesh
        if any(
            tooth_friction.sliding == "instantaneous"
            for tooth_friction in self.friction
        ):
            sliding = sum(np.abs(row).max(axis=0) for row in self._friction_rows)
            by_sliding = sliding > MIN_MESH_STRAIN * np.max(sliding)
            taking_part = taking_part | (by_sliding & (self.modes.frequency_Hz > 0.0))
        for gear, part in enumerate(self.train.gears):
            if part.rolling_bearing is not None:
                moved = np.abs(bearing_rows(self.modes, gear)).max(axis=0)
                shifted = moved > MIN_BEARING_SHIFT * moved.max()
                taking_part |= shifted & (self.modes.frequency_Hz > 0.0)
        return np.flatnonzero(taking_part)

    @cached_property
    def rolling(self) -> RollingSupports | None:
        """Rolling bearings of the train, None without."""
        return rolling_supports(self.train, self.modes, self.moving)

    @cached_property
    def rk4_arrays(self) -> ModalSystem:
        """System as `lumped.kernels.rk4` takes it, with the rotations of rings."""
        return self.rolling.extended(self.arrays) if self.rolling else self.arrays

    @property
    def _moves_mesh(self) -> NDArray[np.bool_]:
        """Mask of the modes that strain a mesh."""
        return np.asarray(self.modes.mesh_energy.sum(axis=0) > MIN_MESH_STRAIN)

    @cached_property
    def _friction_rows(self) -> FrictionRows:
        """Rows of friction on all modes."""
        rows = friction_rows(self.train, self.modes.coordinates)
        return rows.on_modes(self.modes.shapes)

    @cached_property
    def arrays(self) -> ModalSystem:
        """System in the form that the kernels take."""
        modes, moving = self.modes, self.moving
        angular = modes.angular[moving]
        pairs = [len(excitation.pairs) for excitation in self.excitations]
        return ModalSystem(
            rigidity=angular**2,
            damping=2.0 * self.train.damping_ratio * angular,
            load=modes.shapes[:, moving].T @ modes.coordinates.load,
            shapes=np.ascontiguousarray(modes.mesh_shapes[:, moving]),
            mean_stiffness=modes.mean_stiffness,
            backlash=np.array([mesh.backlash for mesh in self.train.meshes]),
            first_pair=np.concatenate([[0], np.cumsum(pairs)]),
        )

    @cached_property
    def coupled_arrays(self) -> CoupledSystem | None:
        """Coupled model in the form that the kernels take, None for models 1 to 3."""
        if self.contacts is None:
            return None
        return coupled_system(self.contacts, self._modal_train)

    @cached_property
    def hub_outputs(self) -> HubOutputs:
        """Displacements of the hubs of the coupled model in the train's coordinates."""
        contacts = require_present(self.contacts, COUPLED_MODEL)
        shapes = self.modes.shapes[:, self.moving]
        return hub_outputs(contacts, self._modal_train, shapes)

    @property
    def _modal_train(self) -> ModalTrain:
        """The train without its meshes, in the modes that take part."""
        modal, shapes = self.arrays, self.arrays.shapes
        meshes = np.einsum("m,mi,mj->ij", modal.mean_stiffness, shapes, shapes)
        return ModalTrain(
            stiffness=np.diag(modal.rigidity) - meshes,
            damping=modal.damping,
            load=modal.load,
            shapes=shapes,
            rate=np.array([float(rate) for rate in self.train.mesh_rates]),
            start=modal.load / modal.rigidity,
        )

    @cached_property
    def rotating_frame(self) -> RotatingFrame | None:
        """Inertial forces of the carrier's rotation on the modes that take part.

        None where it does not rotate or nothing translates, and of models 1 to 3, which
        leave them out.
        """
        speed = self.train.carrier_angular_speed(1.0)
        translates = self.modes.coordinates.gyroscopic.any()
        if self.contacts is None or speed == 0.0 or not translates:
            return None
        return rotating_frame(self.modes, self.moving, speed)

    @cached_property
    def _linear(self) -> LinearPart:
        arrays = require_present(self.coupled_arrays, COUPLED_MODEL)
        bodies, frame = require_present(self.contacts, COUPLED_MODEL), None
        if self.rotating_frame is not None:
            standing = arrays.load.size - 2 * arrays.whirl.size
            to_unit = bodies.body_modes.to_unit[:standing, :standing]
            frame = self.rotating_frame.in_coordinates(to_unit)
        return LinearPart(arrays, frame)

    @cached_property
    def loaded(self) -> LoadedState | None:
        """Static equilibrium of the coupled model over a mesh cycle."""
        if self.coupled_arrays is None:
            return None
        start = np.zeros(self.coupled_arrays.load.size)
        start[: self.moving.size] = self.arrays.load / self.arrays.rigidity
        return loaded_state(self.coupled_arrays, start)

    @cached_property
    def static_checks(self) -> tuple[StaticCheck, ...]:
        """Transmission errors at rest beside those of `references`, where these vary.

        The coupled model's are those of each mesh alone, as in a mesh table, and of
        teeth without pitch errors.
        """
        checks = []
        for mesh, reference in enumerate(self.references):
            if reference is None:
                continue
            if self.contacts is None:
                check = check_springs(mesh, reference)
            else:
                contacts = self.contacts.of_equal_teeth
                force = reference.force
                error = static_errors(contacts, mesh, force) - reference.gap
                check = compare_at_rest(mesh, error, reference.transmission_error)
            if check is not None:
                checks.append(check)
        return tuple(checks)

    @cached_property
    def highest_mesh_mode_angular(self) -> float:
        """Highest mode about the loaded state with strain in the meshes [rad/s]."""
        loaded = require_present(self.loaded, COUPLED_MODEL)
        strained = loaded.mesh_energy.sum(axis=0) >= MIN_MESH_MODE_ENERGY
        return 2.0 * math.pi * float(loaded.frequency_Hz[strained].max(initial=0.0))

    @cached_property
    def reduction_error(self) -> float:
        """Largest relative error of natural frequencies that strain teeth, in space.

        Those of the reduced shafts are compared with those of all their coordinates.
        """
        space = require_present(self.space, "motion in space")
        frequencies = self.modes.frequency_Hz[self.moving]
        ratio = frequencies[:, None] / space.strained_Hz
        return float(np.abs(ratio - 1.0).min(axis=0).max(initial=0.0))

    @cached_property
    def resonances_Hz(self) -> Array:
        """Natural frequencies of modes that strain a mesh, under load if coupled."""
        if self.space is not None:
            strained = self.modes.mesh_energy.sum(axis=0) > MIN_FELT_ENERGY
            return np.asarray(self.modes.frequency_Hz[strained])
        if self.loaded is None:
            return np.asarray(self.modes.frequency_Hz[self._moves_mesh])
        strained = self.loaded.mesh_energy.sum(axis=0) > MIN_FELT_ENERGY
        return np.asarray(self.loaded.frequency_Hz[strained])

    def speed_band(self, low: float, high: float) -> tuple[float, float] | None:
        """Speeds around resonances that meshes excite, without body modes.

        Parameters
        ----------
        low, high : float
            Factors of the lowest and of the highest natural frequency that strains the
            meshes.

        Returns
        -------
        tuple of float or None
            Mesh frequencies of the first mesh [Hz]; None where no mode strains the
            meshes enough.
        """
        resonances = self.modes.mesh_resonances_Hz
        if not resonances.size:
            return None
        rates = [float(rate) for rate in self.train.mesh_rates]
        lowest = low * float(resonances.min()) / max(rates)
        return lowest, high * float(resonances.max()) / min(rates)

    @cached_property
    def static_state(self) -> Array:
        """Modal displacement at rest under the mean stiffness, zero velocity (2, n).

        Gaps are ignored: a train without load starts with its teeth just touching. The
        coupled model is in equilibrium with gears at rest at the start of the cycle.
        """
        if self.loaded is not None:
            return np.stack(
                [self.loaded.coordinates[0], np.zeros_like(self.loaded.coordinates[0])]
            )
        start = self.arrays.load / self.arrays.rigidity
        if self.rolling is not None:
            start = self.rolling.equilibrium(self.arrays, start)
            start = np.concatenate([start, np.zeros(self.rolling.count)])
        return np.stack([start, np.zeros_like(start)])

    @cached_property
    def angular(self) -> Array:
        """Scales (n,) of velocities: natural angular frequencies of the train with
        mean mesh stiffness, then of the body modes [rad/s]; 1 of rotations of rings."""
        hubs = np.sqrt(self.arrays.rigidity)
        if self.rolling is not None:
            return np.concatenate([hubs, np.ones(self.rolling.count)])
        if self.contacts is None:
            return hubs
        return np.concatenate([hubs, self.contacts.body_modes.angular])

    @cached_property
    def bearing_rows(self) -> Array | None:
        """Forces (3 b, n) of bearings over the modes, of gears that move in space."""
        if self.space is None:
            return None
        over_displacement, _ = self.space.bearing_forces
        of_coordinates = over_displacement.reshape(-1, self.space.count)
        return np.asarray(of_coordinates @ self.modes.shapes[:, self.moving])

    def rotation_row(self, gear: int) -> Array | None:
        """Rotation of a gear per coordinate of the train.

        Parameters
        ----------
        gear : int
            Index of the gear, from 0.

        Returns
        -------
        (N,) array or None
            Row of the rotation; None of a gear that is held.
        """
        if self.space is not None:
            return np.asarray(self.space.rotations[gear] @ self.space.basis)
        indices = self.modes.coordinates.indices
        if (gear, "rotation") not in indices:
            return None
        row = np.zeros(self.modes.coordinates.mass.size)
        row[indices[gear, "rotation"]] = 1.0
        return row

    @cached_property
    def deflection_rows(self) -> Array:
        """Magnitude (m, n) of each mesh's deflection per coordinate; body modes deflect
        the teeth in contact."""
        if self.contacts is None:
            return self.rk4_arrays.shapes
        bodies, w = self.contacts.body_modes, self.contacts.body_modes.pair_whirl.size
        squares = (bodies.rows**2).mean(axis=1)  # (c, b)
        pairs = squares[:, bodies.count - 2 * w :].reshape(len(squares), 2, w)
        # whichever tooth the pattern of a pair refers to
        squares[:, bodies.count - 2 * w :] = np.tile(pairs.sum(axis=1), 2)
        magnitudes = np.sqrt(squares)
        mesh_of, meshes = self.contacts.mesh_of, range(len(self.excitations))
        body_rows = np.array([magnitudes[mesh_of == m].max(axis=0) for m in meshes])
        return np.concatenate([self.arrays.shapes, body_rows], axis=1)

    def state_from(self, other: LumpedSystem, state: Array) -> Array:
        """Modal displacements and velocities for the motion of another system.

        Parameters
        ----------
        other : LumpedSystem
            System with the same gears and freedoms.
        state : (2, k) array
            State of the other system. Body modes continue if both systems have the same
            number of them, else start from rest.

        Returns
        -------
        (2, n) array
            State of this system.
        """
        hubs = other.moving.size
        displacements = state[:, :hubs] @ other.modes.shapes[:, other.moving].T
        momentum = displacements * self.modes.coordinates.mass
        new_state = np.array(self.static_state)
        new_state[:, : self.moving.size] = momentum @ self.modes.shapes[:, self.moving]
        if new_state.shape[1] - self.moving.size == state.shape[1] - hubs:
            new_state[:, self.moving.size :] = state[:, hubs:]
        return new_state

    @cached_property
    def static_deflection(self) -> Array:
        """Mean mesh deflections (m,) under the external torques [m]."""
        return self.arrays.shapes @ (self.arrays.load / self.arrays.rigidity)

    @cached_property
    def excitation(self) -> TrainExcitation:
        """Excitation of all meshes over the time after which they repeat."""
        return TrainExcitation(self.train, self.excitations)

    @property
    def common_period(self) -> tuple[int, ...]:
        """Shortest time after which everything repeats, in periods of each mesh."""
        return self.excitation.common_period

    @property
    def repetitions(self) -> int:
        """Number of periods of all meshes until their teeth repeat."""
        return self.excitation.repetitions

    @cached_property
    def energy_norm(self) -> float:
        """Typical sum of modal velocities, from the loads and the gaps."""
        stiffness, backlash = self.arrays.mean_stiffness, self.arrays.backlash
        deflection = np.abs(self.static_deflection).sum() + sum(
            largest_gap(pair) for e in self.excitations for pair in e.pairs
        )
        deflection += backlash[np.isfinite(backlash)].sum()
        return math.sqrt(stiffness.max()) * max(deflection, 1e-9)

    @property
    def limit(self) -> float:
        """Sum of modal velocities beyond which a run has diverged."""
        return DIVERGENCE_RATIO * self.energy_norm

    def samples(
        self, steps: int
    ) -> ExcitationSamples | FrictionSamples | BearingSamples | SpaceSamples:
        """Steps of one common period and the excitation on them.

        Step sizes are in periods of the first mesh.

        Parameters
        ----------
        steps : int
            Least number of steps per period of the first mesh.

        Returns
        -------
        ExcitationSamples, FrictionSamples, BearingSamples or SpaceSamples
            Stiffnesses and gaps of the tooth pairs at the steps.

        Raises
        ------
        TrainError
            If they exceed the memory allowed.
        """
        # long ones are not cached: computing them is fast compared with a period
        return (
            self._samples(steps) if self.repetitions > 1 else self._kept_samples(steps)
        )

    def coupled_steps(self, steps: int, frequency: float) -> CoupledSteps:
        """Steps of the coupled model at a frequency of the first mesh.

        Parameters
        ----------
        steps : int
            Least number of steps per period of the first mesh.
        frequency : float
            Frequency of the first mesh [Hz].

        Returns
        -------
        CoupledSteps
            Contacts and linear part of the model at the steps.

        Raises
        ------
        TrainError
            If they exceed the memory allowed.
        ValueError
            If the model is not the coupled one.
        """
        arrays = require_present(self.coupled_arrays, COUPLED_MODEL)
        return coupled_steps(
            *(arrays, self._linear, self.contact_grid(steps)),
            *(frequency, self.repetitions),
        )

    def coupled_cycle(self, steps: int, frequency: float, cycle: int) -> CoupledSteps:
        """Steps of the coupled model in one cycle of the first mesh at its frequency.

        Parameters
        ----------
        steps : int
            Least number of steps per period of the first mesh.
        frequency : float
            Frequency of the first mesh [Hz].
        cycle : int
            Number of the cycle in the time after which all meshes repeat, from 0.

        Returns
        -------
        CoupledSteps
            Contacts and linear part of the model at the steps.

        Raises
        ------
        TrainError
            If a common period exceeds the memory allowed.
        ValueError
            If the model is not the coupled one.
        """
        arrays = require_present(self.coupled_arrays, COUPLED_MODEL)
        grid = self.contact_grid(steps)
        return steps_of_cycle(arrays, self._linear, grid, frequency, cycle)

    @lru_cache(maxsize=4)  # noqa: B019  the system is immutable and short-lived
    def contact_grid(self, steps: int) -> ContactGrid:
        """Contacts of the coupled model at the steps, for any speed.

        Parameters
        ----------
        steps : int
            Least number of steps per period of the first mesh.

        Returns
        -------
        ContactGrid
            Contacts at the steps.

        Raises
        ------
        TrainError
            If they exceed the memory allowed.
        ValueError
            If the model is not the coupled one.
        """
        arrays = require_present(self.coupled_arrays, COUPLED_MODEL)
        self._require_memory(steps)
        return contact_grid(arrays, steps, np.array(self.train.common_period))

    @lru_cache(maxsize=16)  # noqa: B019  the system is immutable and short-lived
    def _kept_samples(
        self, steps: int
    ) -> ExcitationSamples | FrictionSamples | BearingSamples | SpaceSamples:
        return self._samples(steps)

    def _samples(
        self, steps: int
    ) -> ExcitationSamples | FrictionSamples | BearingSamples | SpaceSamples:
        self._require_memory(steps)
        times = self.excitation.grid(steps)
        samples = self.excitation.samples(times)
        if self.rolling is not None:
            return self.rolling.samples(samples)
        if self.space is not None:
            return self._in_space(samples, self.excitation.places_in_space(times))
        if not self.has_friction:
            return samples
        modal_rows = (row[:, self.moving] for row in self._friction_rows)
        rows = FrictionRows(*map(np.ascontiguousarray, modal_rows))
        return with_friction(samples, times, self.excitation, self.friction, rows)

    def _in_space(self, samples: ExcitationSamples, places: Array) -> SpaceSamples:
        """Samples of springs at places (s, 3, p), at no speed."""
        space = require_present(self.space, "motion in space")
        shapes = self.modes.shapes[:, self.moving]
        return SpaceSamples(
            *samples,
            place=places,
            tilts=np.ascontiguousarray(space.tilt_rows @ shapes),
            tilt_stiffness=space.tilt_stiffness,
            velocity_forces=self.velocity_forces(0.0),
            cross_stiffness=np.ascontiguousarray(
                shapes.T @ space.cross_stiffness @ shapes
                if space.cross_stiffness.any()
                else np.empty((0, 0))
            ),
        )

    def velocity_forces(self, frequency: float) -> Array:
        """Forces of motion in space over velocities, besides damping of the modes.

        Parameters
        ----------
        frequency : float
            Frequency of the first mesh [Hz].

        Returns
        -------
        (n, n) array
            Those of bearings and gyroscopic moments, in modal coordinates [1/s].

        Raises
        ------
        ValueError
            If gears do not move in space.
        """
        space = require_present(self.space, "motion in space")
        teeth = self.train.gears[self.train.meshes[0].driver].teeth
        matrix = space.damping + angular_speed(frequency, teeth) * space.gyroscopic
        shapes = self.modes.shapes[:, self.moving]
        return np.ascontiguousarray(shapes.T @ matrix @ shapes)

    def fits_memory(self, steps: int) -> bool:
        """Whether a common period fits in memory.

        Parameters
        ----------
        steps : int
            Number of steps per period of the first mesh.

        Returns
        -------
        bool
            True if the memory needed is at most the memory allowed.
        """
        return self._bytes(steps) <= MAX_BYTES

    def _bytes(self, steps: int) -> int:
        """Memory of the excitation on steps, and of the motion over a long period."""
        meshes = len(self.excitations)
        if self.contacts is None:
            length, per_step = self.common_period[0], 48 * self.arrays.first_pair[-1]
            per_step = 5 * per_step // 2 if self.has_friction else per_step
            contacts = 0
        else:
            contacts, _, n = self.contacts.rows.shape
            n += self.contacts.body_modes.count
            # pitch errors are added to steps that repeat with the meshes
            length = self.train.common_period[0]
            per_step = 8 * contacts * (2 * contacts + n + meshes + 1)
        size = int(per_step) * length * steps
        if self.repetitions > 1:
            motion = MOTION_BYTES * meshes + CONTACT_BYTES * contacts
            size += motion * self.common_period[0] * steps
        return size

    def _require_memory(self, steps: int) -> None:
        if self.fits_memory(steps):
            return
        quantity, teeth = "excitation", ""
        remedies = "higher speeds, fewer steps or simpler tooth ratios"
        if self.repetitions > 1:
            quantity, teeth = "motion", " and tooth pairs with pitch errors or faults"
            remedies = "pitch errors or faults of fewer gears or that repeat sooner, "
            remedies += "higher speeds or fewer steps"
        if self.contacts is not None:
            remedies += ", the coupled model without body modes, or model 1"
        raise TrainError(
            f"{self.common_period[0]} periods of the first mesh, after which all "
            f"meshes{teeth} repeat, of {steps:.3g} steps each: "
            f"{self._bytes(steps) / 1e9:.3g} GB of {quantity}, more than a run "
            f"should hold in memory; allowed are {remedies}"
        )
