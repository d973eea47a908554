"""Implicit steppers of a gear set's finite-element dynamics, for lumped's driver."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, fields, replace
from functools import lru_cache
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from fegear.dynamics.kernels.step_arrays import Clock, Record, StepMatrices
from fegear.dynamics.model import DynamicModel
from fegear.dynamics.scheme import Scheme, generalized_alpha
from fegear.files.errors import InputError
from lumped.common.array_types import Array
from lumped.common.options import Range, documented, option
from lumped.steady.integration_settings import SteadySettings
from lumped.steady.response import History
from lumped.steady.steady_state import Diverged, Speed, mesh_mode_mask, new_convergence
from lumped.train.system import LumpedSystem

if TYPE_CHECKING:
    from lumped.kernels.arrays import Convergence

REST_STEPS = 100  # to static equilibrium
# periods of the first mesh, at most, between two looks at the clock
PERIODS_PER_PIECE = 64
MAX_BYTES = 1e9  # of a recorded motion
# of the deflection, that contact solutions leave open in a period
CONTACT_ROUNDOFF = 1e-11


class DynamicsError(ArithmeticError):
    """A motion that could not be integrated."""


@documented
@dataclass(frozen=True, kw_only=True)
class DynamicSettings(SteadySettings):
    """Numerical settings of finite elements in motion."""

    min_periods: ClassVar[int] = 400
    # decay that turns from mode to mode shrinks steps over a few periods, not in each:
    # waiting for that would double the periods until a motion is settled
    earlier_steps: ClassVar[int] = 3
    steps: int = option(
        128,
        "Least number of time steps per period of the fastest mesh.",
        Range(8, 100_000),
    )
    step_angle: float = option(
        1.0,
        "Largest phase [rad] that the highest elastic mode turns in a step.",
        Range(above=0.0, most=10.0),
    )
    hub_angle: float = option(
        0.1,
        "Largest phase [rad] that the highest mode of the rigid train that strains a "
        "mesh turns in a step.",
        Range(above=0.0, most=10.0),
    )
    rho_inf: float = option(
        0.9,
        "Part of an unresolved vibration that a step leaves: spectral radius at "
        "infinite frequency of the generalised-alpha scheme.",
        Range(0.0, 1.0),
    )
    ramp_periods: int = option(
        8, "Periods of the first mesh over which the speed changes.", Range(0, 10_000)
    )

    @property
    def scheme(self) -> Scheme:
        return generalized_alpha(self.rho_inf)


@dataclass(frozen=True, eq=False)
class MotionState:
    """State of a motion at the start of a common period.

    motion : (4, n) displacement, velocity, acceleration, generalised contact force
    contact : (3, c) penetration [m], load [N] and whether friction is reversed
    fields : (4, unknowns, teeth) the same as motion of each gear's finite elements, per
        unit width, where they are integrated
    """

    motion: Array
    contact: Array
    fields: tuple[Array, ...] = ()

    def copy(self) -> MotionState:
        fields = tuple(field.copy() for field in self.fields)
        return MotionState(self.motion.copy(), self.contact.copy(), fields)


@dataclass(frozen=True, eq=False)
class FeHistory(History):
    """What was recorded over t points: meshes m, contacts c, hub coordinates h.

    pair_load : (t, c) [N]
    hub : (t, 2, h) displacement and velocity of the hub coordinates
    """

    pair_load: Array
    hub: Array


@dataclass(frozen=True)
class TimeSteps:
    """Equal steps through a common period.

    frequency : of the first mesh [Hz], 0 for gears at rest
    size : [s]; count : how many; cycle : of them in a cycle of the first mesh
    start : of them since the common period began
    """

    frequency: float
    size: float
    count: int
    cycle: int
    start: int = 0


@dataclass(frozen=True, eq=False)
class ImplicitStepper(ABC):
    """What all fidelities have in common: steps of a size through common periods."""

    model: DynamicModel
    scheme: Scheme

    @abstractmethod
    def unloaded(self) -> MotionState:
        """Nothing moves, nothing is loaded."""

    @abstractmethod
    def integrate(
        self, state: MotionState, steps: TimeSteps
    ) -> tuple[MotionState, FeHistory]:
        """Advance; raises DynamicsError where contact is not solved, and Diverged."""

    @property
    def system(self) -> LumpedSystem:
        return self.model.reference

    def start(self) -> MotionState:
        """Static equilibrium by damped time stepping, with gears at rest.

        With rho_inf = 0 long steps leave nothing of a vibration.
        """
        angular = self.system.modes.angular
        step_size = 10.0 / angular[angular > 0.0].min()
        damped = replace(self, scheme=generalized_alpha(0.0))
        steps_at_rest = TimeSteps(0.0, step_size, REST_STEPS, 1)
        equilibrium, _ = damped.integrate(self.unloaded(), steps_at_rest)
        for array in (equilibrium.motion, *equilibrium.fields):
            array[1:3] = 0.0
        return equilibrium

    def new_convergence(
        self, state: MotionState, settings: DynamicSettings
    ) -> Convergence:
        angular = self.system.modes.angular
        angular = np.where(angular > 0.0, angular, 1.0)
        shapes = self.model.kinematics.deflection
        cycles = self.system.common_period[0]
        convergence = new_convergence(shapes, angular, settings, cycles)
        displacement, velocity = state.motion[:2, : angular.size]
        convergence.sections[0] = displacement, velocity / angular
        return convergence

    def advance(
        self,
        state: MotionState,
        speed: Speed,
        convergence: Convergence,
        max_periods: int,
    ) -> tuple[MotionState, bool]:
        """Advance the motion by one common period."""
        from lumped.kernels.convergence import close_period

        state, history = self._integrate_common_period(state, speed)
        convergence.limits[:] = (
            history.deflection.min(axis=0),
            history.deflection.max(axis=0),
        )
        convergence.error_bound[:] = CONTACT_ROUNDOFF * np.abs(convergence.limits).max(
            axis=0
        )
        displacement, velocity = state.motion[:2, : convergence.angular.size]
        return state, close_period(convergence, displacement, velocity)

    def record(
        self, state: MotionState, speed: Speed, periods: int
    ) -> tuple[MotionState, FeHistory]:
        histories = []
        for period in range(periods):
            state, history = self._integrate_common_period(
                state, speed.offset_by(period)
            )
            histories.append(history)
            speed.callback(period + 1)
        return state, join_histories(histories)

    def change_speed(
        self,
        state: MotionState,
        start_frequency: float,
        end_frequency: float,
        settings: DynamicSettings,
    ) -> MotionState:
        """A period of all meshes at each of several frequencies on a smooth way.

        It ends after whole common periods, when the tooth pairs are where they began.
        """
        cycles_per_period, repetitions = (
            self.system.train.common_period[0],
            self.system.repetitions,
        )
        n_speeds = math.ceil(settings.ramp_periods / cycles_per_period)
        for speed_number in range(math.ceil(n_speeds / repetitions) * repetitions):
            fraction = (speed_number + 1.0) / (n_speeds + 1.0)
            smooth_fraction = fraction * fraction * (3.0 - 2.0 * fraction)
            frequency = (
                start_frequency + (end_frequency - start_frequency) * smooth_fraction
                if fraction < 1.0
                else end_frequency
            )
            cycle_steps = steps_per_cycle(self.model, frequency, settings)
            n_steps, start_step = (
                cycle_steps * cycles_per_period,
                speed_number % repetitions * cycles_per_period * cycle_steps,
            )
            grid = TimeSteps(
                frequency,
                1.0 / (frequency * cycle_steps),
                n_steps,
                cycle_steps,
                start_step,
            )
            state, _ = self.integrate(state, grid)
        return state

    def refined(
        self, frequency: float, settings: DynamicSettings, repeats: bool
    ) -> DynamicSettings | None:
        """Steps are those that the elastic modes need."""
        return None

    def steps_per_piece(self, cycle: int) -> int:
        """Steps between two looks at the clock, for `cycle` steps of the first mesh."""
        return PERIODS_PER_PIECE * cycle

    def _integrate_common_period(
        self, state: MotionState, speed: Speed
    ) -> tuple[MotionState, FeHistory]:
        """Integrate through a common period; watched between parts of a long one.

        Raises InputError where it is too long to be recorded.
        """
        cycle_steps = steps_per_cycle(self.model, speed.frequency, speed.settings)
        _require_memory(self.model, cycle_steps)
        grid = TimeSteps(
            speed.frequency, 1.0 / (speed.frequency * cycle_steps), 0, cycle_steps
        )
        total_steps = self.system.common_period[0] * cycle_steps
        steps_per_piece = self.steps_per_piece(cycle_steps)
        histories = []
        for first_step in range(0, total_steps, steps_per_piece):
            if first_step:
                speed.callback(0)
            piece_steps = replace(
                grid,
                count=min(steps_per_piece, total_steps - first_step),
                start=first_step,
            )
            state, history = self.integrate(state, piece_steps)
            histories.append(history)
        return state, join_histories(histories)


@dataclass(frozen=True, eq=False)
class ReducedStepper(ImplicitStepper):
    """Hubs and elastic modes, or hubs alone."""

    def unloaded(self) -> MotionState:
        model = self.model
        return MotionState(
            np.zeros((4, model.size)), np.zeros((3, model.contact_count))
        )

    def integrate(
        self, state: MotionState, steps: TimeSteps
    ) -> tuple[MotionState, FeHistory]:
        from fegear.dynamics.kernels import reduced as kernel

        model, new_state = self.model, state.copy()
        record = empty_record(model, steps.count)
        speed = 2.0 * math.pi * steps.frequency
        clock = Clock(speed, steps.cycle, steps.start, model.limit)
        status, n_steps = kernel.integrate(
            model.arrays,
            self.step(steps.size),
            clock,
            new_state.motion,
            new_state.contact,
            record,
        )
        if status == kernel.DIVERGED:
            raise Diverged(n_steps / (steps.cycle * self.system.common_period[0]))
        if status != kernel.FINISHED:
            raise DynamicsError(
                f"contact not solved at {steps.frequency:g} Hz after {n_steps} steps: "
                "the load may be more than these teeth can carry, or more steps may "
                "help"
            )
        return new_state, history_from_record(steps.size, record)

    @lru_cache(maxsize=2)  # noqa: B019  a stepper lives as long as its run
    def step(self, size: float) -> StepMatrices:
        """What a step size [s] makes of the model, for the kernels.

        The mass, damping and stiffness of the step are weighed by the scheme; the
        elastic modes, diagonal but for their coupling to the rotation of their gear,
        are eliminated from the hubs' matrix.
        """
        modal = self.model.modal
        mass, damping, stiffness = self.scheme.weights(size)
        inverse = 1.0 / (
            mass + damping * modal.elastic_damping + stiffness * modal.rigidity
        )
        modal_inertia = (mass * modal.coupling) ** 2 * inverse
        mode_rotation = modal.rotation[modal.gear_of_mode]
        matrix = stiffness * modal.stiffness + np.diag(mass + damping * modal.damping)
        matrix -= mode_rotation.T @ (modal_inertia[:, None] * mode_rotation)
        hub_inverse = np.asarray(np.linalg.inv(matrix), float)
        return StepMatrices(self.scheme.newmark(size), mass, inverse, hub_inverse)


def empty_record(model: DynamicModel, steps: int) -> Record:
    """Room for what is recorded of the meshes, pair loads and hubs over steps."""
    meshes, hubs = model.kinematics.rate.size, model.modal.damping.size
    return Record(
        np.empty((steps + 1, 5, meshes)),
        np.empty((steps + 1, model.contact_count)),
        np.empty((steps + 1, 2, hubs)),
    )


def history_from_record(step: float, record: Record) -> FeHistory:
    """What the kernels record at every step [s]."""
    dte, rate, force, drive_force, back_force = record.mesh.transpose(1, 0, 2)
    time = step * np.arange(float(len(dte)))
    meshes = dte, rate, force, drive_force, back_force, force
    return FeHistory(time, *meshes, pair_load=record.load, hub=record.hub)


def join_histories(histories: list[FeHistory]) -> FeHistory:
    """Consecutive motions as one; the end of one is the start of the next."""
    if len(histories) == 1:
        return histories[0]
    arrays = {
        name: np.concatenate(
            [getattr(history, name)[:-1] for history in histories[:-1]]
            + [getattr(histories[-1], name)]
        )
        for name in (field.name for field in fields(FeHistory))
        if getattr(histories[0], name) is not None
    }
    arrays["time"] = histories[0].time[1] * np.arange(float(len(arrays["rate"])))
    return FeHistory(**arrays)


def steps_per_cycle(
    model: DynamicModel, frequency: float, settings: DynamicSettings
) -> int:
    """Steps of a cycle of the first mesh, a multiple of the settings' number."""
    system = model.reference
    base_steps = math.ceil(settings.steps * max(system.train.mesh_rates))
    needed_steps = (
        system.modes.angular[mesh_mode_mask(system)].max() / settings.hub_angle
    )
    if model.modal.rigidity.size:
        highest_angular = math.sqrt(model.modal.rigidity.max())
        needed_steps = max(needed_steps, highest_angular / settings.step_angle)
    return base_steps * max(1, math.ceil(needed_steps / (frequency * base_steps)))


def _require_memory(model: DynamicModel, cycle_steps: int) -> None:
    """A common period with pitch errors must not be too long to be recorded.

    cycle_steps : steps of a cycle of the first mesh
    """
    n_cycles = model.reference.common_period[0]
    needed_bytes = (
        8
        * n_cycles
        * cycle_steps
        * sum(array[0].size for array in empty_record(model, 0))
    )
    if model.reference.repetitions > 1 and needed_bytes > MAX_BYTES:
        raise InputError(
            f"{n_cycles} cycles of the first mesh, after which all meshes and tooth "
            f"pairs with pitch errors or faults repeat, of {cycle_steps} steps each: "
            f"{needed_bytes / 1e9:.3g} GB of motion, more than a run should hold in "
            "memory; allowed are pitch errors or faults of fewer gears or that repeat "
            "sooner, fewer steps"
        )
