"""Settling and recording of a dynamic model at one speed after another."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from fegear.dynamics.arrays import Clock, Record, Step
from fegear.dynamics.model import DynamicModel
from fegear.dynamics.scheme import Scheme, generalized_alpha
from fegear.dynamics.settling import Settling
from fegear.errors import InputError
from lumped.response import (
    FIGURES,
    History,
    Response,
    Status,
    measures,
    pooled,
    windows,
)

Array = NDArray[np.float64]
REST_STEPS = 100  # to the deflection at rest
MATTERS = 1e-3  # part of a mode's strain energy in the meshes
PERIODS = (400, 200_000)  # least and most that a motion may take to settle
PIECE = 64  # periods of the first mesh, at most, between two looks at the clock
MOST_BYTES = 1e9  # of a recorded motion


Watch = Callable[[float, int], None]


class DynamicsError(ArithmeticError):
    """A motion that could not be marched."""


@dataclass(frozen=True, kw_only=True)
class DynamicSettings:
    """Numerical choices.

    steps : per cycle of the fastest mesh, at least
    step_angle : largest phase [rad] that the highest elastic mode turns in a step
    hub_angle : the same for the highest mode of the rigid train that strains a mesh
    remaining : part of an unresolved vibration that a step leaves
    tolerance : distance to the periodic motion at which it has settled, relative to
        each mesh's range of deflection
    max_periods : of the first mesh, after which a motion counts as aperiodic; None
        for what the damping needs
    multiples : largest period multiple that is looked for
    windows : of so many common periods each, at most, over which a motion that does
        not repeat is measured
    ramp_periods : of the first mesh, over which the speed changes
    """

    steps: int = 128
    step_angle: float = 1.0
    hub_angle: float = 0.1
    remaining: float = 0.9
    tolerance: float = 1e-4
    max_periods: int | None = None
    multiples: int = 8
    windows: int = 16
    ramp_periods: int = 8

    def __post_init__(self) -> None:
        checks = {
            "steps": (8 <= self.steps <= 100_000, "8 to 100000"),
            "step_angle": (0.0 < self.step_angle <= 10.0, "above 0 to 10"),
            "hub_angle": (0.0 < self.hub_angle <= 10.0, "above 0 to 10"),
            "remaining": (0.0 <= self.remaining <= 1.0, "0 to 1"),
            "tolerance": (1e-12 <= self.tolerance <= 0.1, "1e-12 to 0.1"),
            "max_periods": (
                self.max_periods is None or 1 <= self.max_periods <= 10**8,
                "1 to 1e8",
            ),
            "multiples": (1 <= self.multiples <= 64, "1 to 64"),
            "windows": (1 <= self.windows <= 10_000, "1 to 10000"),
            "ramp_periods": (0 <= self.ramp_periods <= 10_000, "0 to 10000"),
        }
        for name, (ok, allowed) in checks.items():
            if not ok:
                raise ValueError(f"{name} must be {allowed}, got {getattr(self, name)}")

    @property
    def scheme(self) -> Scheme:
        return generalized_alpha(self.remaining)


@dataclass(frozen=True, eq=False)
class MotionState:
    """Where a motion stands at the start of a common period.

    motion : (4, n) displacement, velocity, acceleration, generalised contact force
    contact : (3, c) penetration [m], load [N] and whether friction is reversed
    fields : (4, own, teeth) the same as motion of each gear's finite elements, per
        unit width, where they are marched
    """

    motion: Array
    contact: Array
    fields: tuple[Array, ...] = ()

    def copy(self) -> MotionState:
        fields = tuple(field.copy() for field in self.fields)
        return MotionState(self.motion.copy(), self.contact.copy(), fields)


@dataclass(frozen=True, eq=False)
class Motion:
    """What was recorded over t points: meshes m, contacts c, hub coordinates h.

    history : of the meshes, as for the lumped models
    pair_load : (t, c) [N]
    hub : (t, 2, h) displacement and velocity of the hub coordinates
    """

    history: History
    pair_load: Array
    hub: Array


class Stepper(Protocol):
    """A fidelity: marches a model's state with its own freedoms."""

    @property
    def model(self) -> DynamicModel: ...

    def start(self) -> MotionState: ...

    def march(
        self,
        state: MotionState,
        frequency: float,
        step: float,
        steps: int,
        cycle: int,
        start: int = 0,
    ) -> tuple[MotionState, Motion]: ...


@dataclass(frozen=True, eq=False)
class ReducedStepper:
    """Hubs and elastic modes."""

    model: DynamicModel
    scheme: Scheme

    def start(self) -> MotionState:
        """At rest under the external torques, at the start of the mesh cycle."""
        empty = MotionState(
            np.zeros((4, self.model.size)), np.zeros((3, self.model.contact_count))
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
        """March `steps` steps [s] from step `start` of a common period.

        cycle : steps of a cycle of the first mesh; frequency : of that [Hz], 0 for
        gears that stand still. Raises DynamicsError where contact is not solved and
        FloatingPointError where the motion diverges.
        """
        from fegear.dynamics.kernels import reduced as kernel

        model, now = self.model, state.copy()
        record = empty_record(model, steps)
        clock = Clock(2.0 * math.pi * frequency, cycle, start, model.limit)
        status, done = kernel.integrate(
            model.arrays, self.step(step), clock, now.motion, now.contact, record
        )
        if status == kernel.DIVERGED:
            raise FloatingPointError(f"motion diverged after {done * step:g} s")
        if status != kernel.FINISHED:
            raise DynamicsError(
                f"contact not solved at {frequency:g} Hz after {done} steps: the load "
                "may be more than these teeth can carry, or more --steps may help"
            )
        return now, recorded(step, *record)

    def step(self, size: float) -> Step:
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
        carried = (mass * modal.coupling) ** 2 * inverse
        turns = modal.rotation[modal.owner]
        matrix = stiffness * modal.stiffness + np.diag(mass + damping * modal.damping)
        matrix -= turns.T @ (carried[:, None] * turns)
        hub_inverse = np.asarray(np.linalg.inv(matrix), float)
        return Step(self.scheme.newmark(size), mass, inverse, hub_inverse)


def empty_record(model: DynamicModel, steps: int) -> Record:
    """Room for what is recorded of the meshes, pair loads and hubs over steps."""
    meshes, hubs = model.kinematics.rate.size, model.modal.damping.size
    return Record(
        np.empty((steps + 1, 5, meshes)),
        np.empty((steps + 1, model.contact_count)),
        np.empty((steps + 1, 2, hubs)),
    )


def at_rest(damped: Stepper, state: MotionState) -> MotionState:
    """Static equilibrium by damped time stepping, with the gears standing still.

    damped : with rho_inf = 0, which leaves nothing of a vibration that long steps do
        not resolve
    """
    angular = damped.model.reference.modes.angular
    slow = 10.0 / angular[angular > 0.0].min()
    found, _ = damped.march(state, 0.0, slow, REST_STEPS, 1)
    for array in (found.motion, *found.fields):
        array[1:3] = 0.0
    return found


def recorded(step: float, out: Array, loads: Array, hub: Array) -> Motion:
    """From what the kernels note every step [s]: out (t, 5, m)."""
    time = step * np.arange(float(len(out)))
    dte, rate, force, drive, back = (out[:, i] for i in range(5))
    return Motion(History(time, dte, rate, force, drive, back, force), loads, hub)


def steps_per_cycle(
    model: DynamicModel, frequency: float, settings: DynamicSettings
) -> int:
    """Steps of a cycle of the first mesh, a multiple of the settings' number."""
    fastest = max(model.reference.train.mesh_rates)
    base = math.ceil(settings.steps * fastest)
    needed = model.reference.modes.angular[straining(model)].max() / settings.hub_angle
    if model.modal.rigidity.size:
        highest = math.sqrt(model.modal.rigidity.max())
        needed = max(needed, highest / settings.step_angle)
    return base * max(1, math.ceil(needed / (frequency * base)))


def straining(model: DynamicModel) -> NDArray[np.bool_]:
    """Which hub coordinates strain the meshes enough to matter (h,)."""
    return model.reference.modes.mesh_energy.sum(axis=0) > MATTERS


def respond(
    stepper: Stepper,
    frequency: float,
    settings: DynamicSettings,
    state: MotionState | None = None,
    before: float | None = None,
    watch: Watch = lambda frequency, period: None,
) -> tuple[Response, Motion, MotionState]:
    """Settle at a frequency of the first mesh [Hz] and record what repeats.

    A motion that does not repeat is measured over several windows, as the lumped ones
    are; what is recorded is the last.

    state, before : where a motion at another frequency stood; the speed changes
        smoothly from there
    watch : called after every common period with the frequency and their number, and
        within long ones; what it raises ends the run
    Raises InputError where a common period is too long to be recorded.
    """
    model = stepper.model
    length = model.reference.common_period[0]
    now = stepper.start() if state is None else state
    if state is not None and before is not None:
        now = _ramp(stepper, before, frequency, settings, now)
    cycle = steps_per_cycle(model, frequency, settings)
    _require_memory(model, cycle)
    settling = _settling(model, settings)
    hubs = model.modal.damping.size
    settling.begin(*now.motion[:2, :hubs])
    most = _allowed(model, frequency, settings) // length
    while not settling.done and settling.period < max(most, 4 * settings.multiples):
        look = partial(watch, frequency, settling.period)
        now, motion = _common_period(stepper, now, frequency, cycle, look)
        place, velocity = now.motion[:2, :hubs]
        settling.add(place, velocity, motion.history.deflection)
        watch(frequency, settling.period)
    multiple = settling.multiple if settling.done else 0
    settled_after = settling.period * length / frequency
    spans = multiple or max(1, settings.multiples // model.reference.rounds)
    figures: list[dict[str, Array]] = []
    for _ in range(1 if multiple else windows(settings.windows, spans * length)):
        parts: list[Motion] = []
        for _ in range(spans):
            done = settling.period + len(figures) * spans + len(parts)
            look = partial(watch, frequency, done)
            now, motion = _common_period(stepper, now, frequency, cycle, look)
            parts.append(motion)
            watch(frequency, done + 1)
        whole = _joined(parts, 1.0 / (frequency * cycle))
        figures.append(measures(whole.history))
    response = Response(
        frequency=frequency,
        status=Status.PERIODIC if multiple else Status.APERIODIC,
        multiple=multiple,
        period_multiple=multiple * np.array(model.reference.common_period),
        settling_time=settled_after,
        state=now.motion,
        **pooled(figures),
    )
    return response, whole, now


def _require_memory(model: DynamicModel, cycle: int) -> None:
    """A common period with pitch errors must not be too long to be recorded.

    cycle : steps of a cycle of the first mesh
    """
    length = model.reference.common_period[0]
    columns = (
        5 * model.kinematics.rate.size
        + model.contact_count
        + 2 * model.modal.damping.size
    )
    needed = 8 * length * cycle * columns
    if model.reference.rounds > 1 and needed > MOST_BYTES:
        raise InputError(
            f"{length} cycles of the first mesh, after which all meshes and tooth "
            f"pairs with pitch errors repeat, of {cycle} steps each: "
            f"{needed / 1e9:.3g} GB of motion, more than a run should hold in memory; "
            "allowed are pitch errors of fewer gears or that repeat sooner, fewer steps"
        )


def _common_period(
    stepper: Stepper,
    state: MotionState,
    frequency: float,
    cycle: int,
    look: Callable[[], None] = lambda: None,
) -> tuple[MotionState, Motion]:
    """March through a common period.

    look : called between the pieces of a long one
    """
    length = stepper.model.reference.common_period[0]
    step, piece = 1.0 / (frequency * cycle), PIECE * cycle
    if stepper.model.reference.rounds == 1:
        piece = length * cycle
    parts = []
    for start in range(0, length * cycle, piece):
        if start:
            look()
        steps = min(piece, length * cycle - start)
        state, motion = stepper.march(state, frequency, step, steps, cycle, start)
        parts.append(motion)
    return state, _joined(parts, step)


def lost(model: DynamicModel, frequency: float, state: MotionState) -> Response:
    """The response of a motion that diverged."""
    meshes = model.kinematics.rate.size
    return Response(
        frequency=frequency,
        status=Status.DIVERGED,
        multiple=0,
        period_multiple=np.zeros(meshes, np.int64),
        settling_time=math.nan,
        state=state.motion,
        **{name: np.full(meshes, np.nan) for name in FIGURES},
    )


def _settling(model: DynamicModel, settings: DynamicSettings) -> Settling:
    angular = model.reference.modes.angular
    return Settling(
        model.kinematics.deflection,
        np.where(angular > 0.0, angular, 1.0),
        settings.tolerance,
        settings.multiples,
    )


def _allowed(model: DynamicModel, frequency: float, settings: DynamicSettings) -> int:
    """Periods of the first mesh in which modes that matter decay, within limits."""
    if settings.max_periods is not None:
        return settings.max_periods
    slowest = model.modal.damping[straining(model)].min() / 2.0
    least, most = PERIODS
    if not slowest > 0.0:
        return least
    needed = 2.0 * math.log(1.0 / settings.tolerance) * frequency / slowest
    if needed > 10.0 * most:  # decay too slow to wait for is none
        return least
    return int(min(max(needed, least), most))


def _ramp(
    stepper: Stepper,
    before: float,
    after: float,
    settings: DynamicSettings,
    state: MotionState,
) -> MotionState:
    """A period of all meshes at each of several frequencies on a smooth way.

    It ends after whole common periods, when the tooth pairs stand as they did.
    """
    reference = stepper.model.reference
    length, rounds = reference.train.common_period[0], reference.rounds
    stops = math.ceil(settings.ramp_periods / length)
    for number in range(math.ceil(stops / rounds) * rounds):
        part = (number + 1.0) / (stops + 1.0)
        smooth = part * part * (3.0 - 2.0 * part)
        frequency = before + (after - before) * smooth if part < 1.0 else after
        cycle = steps_per_cycle(stepper.model, frequency, settings)
        step, start = 1.0 / (frequency * cycle), number % rounds * length * cycle
        state, _ = stepper.march(state, frequency, step, cycle * length, cycle, start)
    return state


def _joined(parts: list[Motion], step: float) -> Motion:
    """Consecutive motions as one; the end of one is the start of the next."""
    if len(parts) == 1:
        return parts[0]

    def join(values: list[Array]) -> Array:
        return np.concatenate([v[:-1] for v in values[:-1]] + [values[-1]])

    names = ("deflection", "rate", "force", "drive_overlap", "back_overlap")
    joined = {n: join([getattr(p.history, n) for p in parts]) for n in names}
    time = step * np.arange(float(len(joined["rate"])))
    history = History(time=time, force_before=joined["force"], **joined)
    return Motion(
        history, join([p.pair_load for p in parts]), join([p.hub for p in parts])
    )
