"""Steppers of lumped systems: Runge-Kutta with fixed or with adaptive steps."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from lumped.common.array_types import Array
from lumped.kernels.arrays import FrictionSamples, SpaceSamples, VariedSteps
from lumped.steady.integration_settings import Method, Settings
from lumped.steady.newton_shooting import integrate_or_shoot
from lumped.steady.response import History
from lumped.steady.steady_state import (
    Diverged,
    Speed,
    Stepper,
    new_convergence,
    steady_state,
)
from lumped.train.friction_samples import scale_to_frequency
from lumped.train.system import LumpedSystem

if TYPE_CHECKING:
    from lumped.kernels.arrays import AdaptiveRules, Convergence, CoupledSteps

# Fixed steps between calls of the callback, or a common period if more
STEPS_PER_CALLBACK = 100_000
CONTACT_ROWS, FRICTION_ROWS = 2, 3  # rows recorded for each contact, or pair
# Kinds of motion besides that of teeth as springs on linear bearings at one speed
CONTACTS, FRICTION = "the coupled model", "teeth with friction"
ROLLING, RAMP = "rolling bearings", "a ramp of the speed"
SPACE, SPACE_ROWS = "motion in space", 2  # rows recorded of each mesh besides others
BEARING_VALUES = 4  # recorded of each rolling bearing: displacement and force
MAX_STEPS_PER_PERIOD = 512  # fixed; beyond it results do not depend on their number
# Steps of the coupled model shift a contact resonance by a relative amount of some 1e-3
# times the square of its phase angle per step. At RESONANCE_ANGLE_FACTOR times the root
# of the damping ratio, this is a tenth of half the bandwidth; limits of it [rad].
RESONANCE_ANGLE_FACTOR, MIN_STEP_ANGLE, MAX_STEP_ANGLE = 4.0, 0.25, 1.0
# The engagement of teeth is a kink of the excitation, whose high harmonics steps take
# for lower ones: where the eighth harmonic met a resonance, 0.65 rad per step made
# amplitudes 7 % too small, 0.3 rad 1 %. So up to MAX_STEPS_PER_PERIOD steps
# have this angle [rad].
ENGAGEMENT_STEP_ANGLE = 0.25
# Of the state, between motions on both sides of one that tell what changes become: some
# 1e4 times the round-off of adaptive steps, and its square is below their error
DIFFERENCE_STEP = 3e-5


@dataclass(frozen=True, eq=False)
class LumpedStepper:
    """Common base of steppers with fixed and adaptive steps; a state (2, n) is modal.

    Both integrate in compiled loops over the periods, see `lumped.kernels`.
    `takes` are the kinds of motion that are integrated besides that of springs.
    """

    takes: ClassVar[frozenset[str]] = frozenset()
    system: LumpedSystem

    def start(self) -> Array:
        return self.system.static_state

    def new_convergence(self, state: Array, settings: Settings) -> Convergence:
        system, cycles = self.system, self.system.common_period[0]
        convergence = new_convergence(
            *(system.deflection_rows, system.angular, settings, cycles),
            forces=system.bearing_rows,
        )
        convergence.sections[0] = self.section_of(state).reshape(2, -1)
        return convergence

    def section_of(self, state: Array) -> Array:
        """Displacements, and velocities over `angular`, of a state (2, n) as one row
        (2 n,)."""
        return np.concatenate([state[0], state[1] / self.system.angular])

    def state_of(self, section: Array) -> Array:
        """State (2, n) from displacements, and velocities over `angular` (2 n,)."""
        q, v = section.reshape(2, -1)
        return np.stack([q, v * self.system.angular])

    def change_speed(
        self,
        state: Array,
        start_frequency: float,
        end_frequency: float,
        settings: Settings,
    ) -> Array:
        """State after a change of speed, by default unchanged."""
        return state


class FixedStepper(LumpedStepper):
    """Stepper with equal steps of fourth order: classical Runge-Kutta for springs;
    for the coupled model, steps that are exact except for the contact forces."""

    takes = frozenset({CONTACTS, FRICTION, ROLLING, RAMP, SPACE})

    def kernel_arguments(self, speed: Speed) -> tuple[Any, Any]:
        """Arguments of the kernels: system arrays and the steps of a common period."""
        system, frequency = self.system, speed.frequency
        steps = steps_per_period(system, frequency, speed.settings)
        if system.coupled_arrays is not None:
            return system.coupled_arrays, self._coupled_steps(steps, frequency)
        samples = system.samples(steps)
        if isinstance(samples, FrictionSamples):
            return system.arrays, scale_to_frequency(samples, frequency)
        samples = samples._replace(h=samples.h / frequency)
        if isinstance(samples, SpaceSamples):
            forces = system.velocity_forces(frequency)
            return system.arrays, samples._replace(velocity_forces=forces)
        return system.rk4_arrays, samples

    def _at_speed(self, state: Array, speed: Speed) -> Array:
        """A copy of a state, in which rings of rolling bearings have their speed."""
        copy, rolling = np.array(state), self.system.rolling
        if rolling is not None:
            copy[1, -rolling.count :] = rolling.rates * speed.frequency
        return copy

    @lru_cache(maxsize=4)  # noqa: B019  a stepper lives as long as its run
    def _coupled_steps(self, steps: int, frequency: float) -> CoupledSteps:
        """Steps for settling and recording; their working arrays serve one thread."""
        return self.system.coupled_steps(steps, frequency)

    def advance(
        self, state: Array, speed: Speed, convergence: Convergence, max_periods: int
    ) -> tuple[Array, bool]:
        now = self._at_speed(state, speed)
        # without damping only the errors of the steps would approach anything
        if self.system.contacts is None or self.system.train.damping_ratio == 0.0:
            return now, self.settle(now, speed, convergence, max_periods)
        return integrate_or_shoot(self, now, speed, convergence, max_periods)

    def settle(
        self,
        state: Array,
        speed: Speed,
        convergence: Convergence,
        max_periods: int,
        continues: bool = False,
    ) -> bool:
        """Integrate a state in place, see `Stepper.advance`; return whether it settled.

        continues : whether a motion of the coupled model continues from where it ended
        """
        (arrays, steps), first_period = self.kernel_arguments(speed), convergence.period
        periods_per_call = max(1, STEPS_PER_CALLBACK // steps.h.size)
        while True:
            periods_left = max_periods - (convergence.period - first_period)
            if self.system.contacts is not None:
                steps.continues[0] = continues or convergence.period > first_period
            status, part, settled = self._kernels.settle_motion(
                arrays,
                steps,
                self.system.limit,
                state,
                convergence,
                min(periods_per_call, periods_left),
            )
            if status:
                raise Diverged(part)
            if settled or periods_left <= periods_per_call:
                return settled
            speed.callback(convergence.period - first_period)

    def record(
        self, state: Array, speed: Speed, periods: int, with_states: bool = False
    ) -> tuple[Array, History]:
        now = self._at_speed(state, speed)
        arrays, steps = self.kernel_arguments(speed)
        if self.system.contacts is not None:
            steps.continues[0] = 0
        return now, self.record_steps(arrays, steps, periods, now, with_states)

    def record_steps(
        self, arrays: Any, steps: Any, periods: int, state: Array, with_states: bool
    ) -> History:
        """Motion over some rounds of steps; Diverged without a bound.

        arrays, steps : see `kernel_arguments`
        state : (2, n) at the start, advanced in place
        with_states : whether the history has the states
        """
        system = self.system
        time, out = _allocate_motion(system, steps.h, periods)
        states = np.empty((time.size if with_states else 0, *state.shape))
        status, _ = self._kernels.record_motion(
            arrays, steps, periods, state, system.limit, out, states
        )
        if status:
            raise Diverged(0.0)
        history = history_of(time, out, system)
        return replace(history, states=states) if with_states else history

    def integrate_variations(
        self, state: Array, speed: Speed, sections: Array, growth: Array
    ) -> None:
        """Integrate a motion and small changes of it over common periods, in place.

        state : (2, n (1 + k)) the motion, followed by k changes
        sections, growth : see `lumped.kernels.rk4.integrate_variations`
        """
        self.system.require_linear_bearings("small changes of a motion")
        self.system.require_no_space("small changes of a motion")
        arrays, steps = self.kernel_arguments(speed)
        if self.system.contacts is None:
            n, damping = self.system.angular.size, np.diag(arrays.damping)
            steps = VariedSteps(steps.h, steps, damping, np.empty((n, n)))
        status, _ = self._kernels.integrate_variations(
            *(arrays, steps, self.system.limit, state, self.system.angular),
            *(sections, growth),
        )
        if status:
            raise Diverged(0.0)

    def monodromy(
        self, state: Array, speed: Speed, periods: int
    ) -> tuple[Array, Array]:
        """State (2, n) after common periods, and the matrix that maps small changes.

        The matrix (2 n, 2 n) refers to displacements, and velocities over `angular`.
        """
        end_state, matrix, growth = self.scaled_monodromy(state, speed, periods)
        return end_state, math.exp(growth) * matrix

    def scaled_monodromy(
        self, state: Array, speed: Speed, periods: int
    ) -> tuple[Array, Array, float]:
        """Return the state, a scaled matrix and its growth; see `monodromy`.

        The monodromy matrix is exp(growth) times the scaled one, since changes that
        decay over a long period would underflow.
        """
        n, angular = state.shape[1], self.system.angular
        unit = np.stack([np.eye(2 * n)[:, :n], np.eye(2 * n)[:, n:] * angular])
        varied = np.concatenate([state[:, None], unit], axis=1).reshape(2, -1)
        growth = np.empty(periods)
        self.integrate_variations(
            varied, speed, allocate_record(self.system, periods), growth
        )
        changes = varied.reshape(2, -1, n)[:, 1:]
        # the row of each change is a column of the matrix
        matrix = np.concatenate([changes[0], changes[1] / angular], axis=1).T
        return varied[:, :n].copy(), matrix, float(growth.sum())

    @property
    def _kernels(self) -> Any:
        if self.system.contacts is None:
            from lumped.kernels import rk4

            return rk4
        from lumped.kernels import coupled_steps as coupled

        return coupled

    def refined(
        self, frequency: float, settings: Settings, repeats: bool
    ) -> Settings | None:
        """Settings with twice the steps, as far as memory permits.

        None for a motion on rolling bearings that does not repeat, since cages do not.
        """
        if self.system.rolling is not None and not repeats:
            return None
        fastest = float(max(self.system.train.mesh_rates))
        current = steps_per_period(self.system, frequency, settings)
        current = math.ceil(current / fastest - 1e-9)
        if current >= MAX_STEPS_PER_PERIOD:
            return None
        # springs open within a step: a motion may repeat with the finest steps only
        needs_finest = not repeats and self.system.contacts is None
        steps = (
            MAX_STEPS_PER_PERIOD
            if needs_finest
            else min(2 * current, MAX_STEPS_PER_PERIOD)
        )
        finer = replace(settings, steps=steps)
        needed = steps_per_period(self.system, frequency, finer)
        return finer if self.system.fits_memory(needed) else None


class AdaptiveStepper(LumpedStepper):
    """Stepper of Dormand and Prince, order 5(4); steps end on contact changes."""

    def _rules(self, speed: Speed) -> AdaptiveRules:
        from lumped.kernels.arrays import AdaptiveRules

        velocity_scale = 1e-3 * self.system.energy_norm
        return AdaptiveRules(
            speed.settings.step_error,
            self.system.limit,
            speed.frequency,
            velocity_scale,
        )

    def advance(
        self, state: Array, speed: Speed, convergence: Convergence, max_periods: int
    ) -> tuple[Array, bool]:
        from lumped.kernels import dopri5

        system, now = self.system, np.array(state)
        status, part, settled = dopri5.settle_dopri5(
            system.arrays,
            system.excitation.pieces_in(0),
            self._rules(speed),
            (
                float(system.train.common_period[0]),
                system.repetitions,
                system.excitation.turns,
            ),
            now,
            convergence,
            max_periods,
        )
        if status:
            raise Diverged(part)
        return now, settled

    def record(
        self, state: Array, speed: Speed, periods: int, with_states: bool = False
    ) -> tuple[Array, History]:
        """Record the motion on the grid of fixed steps."""
        from lumped.kernels import dopri5

        system, now = self.system, np.array(state)
        h = system.samples(steps_per_period(system, speed.frequency, speed.settings)).h
        time, out = _allocate_motion(system, h, periods)
        states = np.empty((time.size if with_states else 0, *now.shape))
        rules, length = self._rules(speed), system.train.common_period[0]
        steps = h.size // system.repetitions
        grid = np.concatenate([[0.0], np.cumsum(h[:steps])])
        grid[-1] = length
        for number, start in enumerate(range(0, time.size - 1, steps)):
            rows = slice(start, start + steps + 1)
            status, _ = dopri5.record_dopri5(
                system.arrays,
                system.excitation.pieces_in(number % system.repetitions),
                rules,
                (0.0, float(length)),
                now,
                grid,
                (out[rows], states[rows]),
            )
            if status:
                raise Diverged(0.0)
        history = History(time / speed.frequency, *out.transpose(1, 0, 2))
        return now, replace(history, states=states) if with_states else history

    def monodromy(
        self, state: Array, speed: Speed, periods: int
    ) -> tuple[Array, Array]:
        """State (2, n) after common periods, and the matrix that maps small changes.

        The matrix (2 n, 2 n) refers to displacements, and velocities over `angular`. It
        is the product of those of each common period, from motions on both sides.
        """
        now, matrix = state, np.eye(state.size)
        step = DIFFERENCE_STEP * float(np.abs(self.system.static_state[0]).max())
        for _ in range(periods):
            section, columns = self.section_of(now), []
            for change in step * np.eye(state.size):
                above, below = (
                    self.section_of(
                        self.record(self.state_of(section + side), speed, 1)[0]
                    )
                    for side in (change, -change)
                )
                columns.append((above - below) / (2.0 * step))
            matrix = np.array(columns).T @ matrix
            now, _ = self.record(now, speed, 1)
        return now, matrix

    def refined(
        self, frequency: float, settings: Settings, repeats: bool
    ) -> Settings | None:
        """Return None: adaptive steps already meet their accuracy."""
        return None


STEPPERS: dict[Method, type[FixedStepper | AdaptiveStepper]] = {
    "rk4": FixedStepper,
    "dopri5": AdaptiveStepper,
}


def stepper_of(
    system: LumpedSystem, settings: Settings
) -> FixedStepper | AdaptiveStepper:
    """Stepper for the method of the settings; raises ValueError as `require_method`."""
    require_method(settings.method, _kinds(system))
    return STEPPERS[settings.method](system)


def require_method(method: Method, kinds: Iterable[str]) -> None:
    """Raise ValueError where the stepper of a method does not take one of the kinds."""
    for kind in kinds:
        if kind not in STEPPERS[method].takes:
            able = [name for name, one in STEPPERS.items() if kind in one.takes]
            raise ValueError(
                f"method = {method}; must be {' or '.join(able)} for {kind}"
            )


def _kinds(system: LumpedSystem) -> Iterator[str]:
    if system.contacts is not None:
        yield CONTACTS
    if system.has_friction:
        yield FRICTION
    if system.rolling is not None:
        yield ROLLING
    if system.space is not None:
        yield SPACE


def warm_up(stepper: Stepper, frequency: float, settings: Any) -> None:
    """Compile all kernels that integrate a motion, so that later runs can be timed.

    frequency : frequency of the first mesh [Hz]
    """
    short = replace(settings, max_periods=1, multiples=1, windows=1)
    steady_state(stepper, frequency, short)
    if isinstance(stepper, FixedStepper) and stepper.system.contacts is not None:
        with suppress(Diverged):
            stepper.monodromy(stepper.start(), Speed(frequency, short), 1)


def _allocate_motion(
    system: LumpedSystem, h: Array, periods: int
) -> tuple[Array, Array]:
    """Times (t,) in the unit of the steps, and an empty record (t, 6, m) or more."""
    time = np.concatenate([[0.0], np.cumsum(np.tile(h, periods))])
    return time, allocate_record(system, time.size)


def allocate_record(system: LumpedSystem, instants: int) -> Array:
    """Array (t, 6, m) to record the meshes at t instants, with more rows if contacts,
    teeth with friction or rolling bearings are recorded too."""
    extra_rows = 0
    if system.contacts is not None:
        extra_rows = CONTACT_ROWS * np.bincount(system.contacts.mesh_of).max()
    elif system.rolling is not None:
        extra_rows = math.ceil(
            BEARING_VALUES * system.rolling.count / len(system.excitations)
        )
    elif system.space is not None:
        extra_rows = SPACE_ROWS
    elif system.has_friction:
        extra_rows = FRICTION_ROWS * np.bincount(system.excitation.mesh_of).max()
    return np.full((instants, 6 + extra_rows, len(system.excitations)), np.nan)


def history_of(time: Array, out: Array, system: LumpedSystem) -> History:
    """History from rows (t, 6, m) or more at times (t,), as recorded by the kernels.

    The coupled model also has contacts. It has no independent rates of the hubs'
    deflections, since hubs follow the mean rotations and the contact forces.
    """
    history = History(time, *out[:, :6].transpose(1, 0, 2))
    if system.space is not None:
        moments, slopes_of_teeth = out[:, 6], out[:, 7]
        return replace(history, moments=moments, tilts=slopes_of_teeth)
    if system.has_friction:
        mesh_of = system.excitation.mesh_of
        return replace(history, friction=_per_contact(out, mesh_of, FRICTION_ROWS))
    if system.rolling is not None:
        size = BEARING_VALUES * system.rolling.count
        values = out[:, 6:].reshape(len(out), -1)[:, :size]
        return replace(history, bearings=values.reshape(len(out), -1, BEARING_VALUES))
    if system.contacts is None:
        return history
    rate = slopes(history.deflection, history.time[1] - history.time[0])
    contacts = _per_contact(out, system.contacts.mesh_of, CONTACT_ROWS)
    return replace(history, rate=rate, contacts=contacts)


def slopes(values: Array, step: float) -> Array:
    """Derivative (t, m) of values (t, m) at equal steps, of fourth order inside."""
    if len(values) < 3:
        return np.zeros_like(values)
    derivative = np.gradient(values, step, axis=0, edge_order=2)
    if len(values) > 4:
        outer, inner = values[4:] - values[:-4], values[3:-1] - values[1:-3]
        derivative[2:-2] = (8.0 * inner - outer) / (12.0 * step)
    return derivative


def _per_contact(out: Array, mesh_of: NDArray[np.intp], rows: int) -> Array:
    """Recorded rows (t, rows, c) of every contact or pair, from the sixth row on."""
    index = np.arange(mesh_of.size) - np.searchsorted(mesh_of, mesh_of)
    quantities = [out[:, 6 + rows * index + i, mesh_of] for i in range(rows)]
    return np.stack(quantities, axis=1)


def steps_per_period(system: LumpedSystem, frequency: float, settings: Settings) -> int:
    """Fixed steps per period of the first mesh, rounded up to few different values."""
    fastest = float(max(system.train.mesh_rates))
    highest = float(np.sqrt(system.arrays.rigidity.max()))
    base = settings.min_steps(system.contacts is not None) * fastest
    needed = max(base, highest / (frequency * settings.step_angle))
    if system.loaded is not None and settings.steps is None:
        angle = min(
            max(
                RESONANCE_ANGLE_FACTOR * math.sqrt(system.train.damping_ratio),
                MIN_STEP_ANGLE,
            ),
            MAX_STEP_ANGLE,
        )
        phase_per_period = system.highest_mesh_mode_angular / frequency
        needed = max(
            needed,
            phase_per_period / angle,
            min(phase_per_period / ENGAGEMENT_STEP_ANGLE, MAX_STEPS_PER_PERIOD),
        )
    doublings = max(0, math.ceil(2.0 * math.log2(needed / base) - 1e-9))
    return math.ceil(base * 2.0 ** (0.5 * doublings))
