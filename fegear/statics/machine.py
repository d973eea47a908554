"""A gear set at rest on shafts that yield, whose meshes load each other's gears.

Forces of a mesh move the gears of other meshes on the same shafts. Each mesh is solved
with the axes moved by the mean loads of all others, over its cycle, and the loads are
exchanged until they are the ones of all meshes. What is left out is how the loads of
the others wander while their teeth pass: meshes of different frequency meet in all
positions. Shafts on rolling bearings are linearised at the mean loads of each exchange,
so that the last one has the bearings' own law.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fegear.contact.problem import ContactFailure, ContactProblem
from fegear.contact.result import ContactCycle
from fegear.contact.solve import solve_cycle
from fegear.contact.width.contact import WidthContact
from fegear.contact.width.supports import MOTIONS, AxisSupports, unit_wrenches
from fegear.gearset.faults.checks import with_equal_teeth
from fegear.gearset.model import GearSet
from fegear.gearset.pitch_errors import without_pitch_errors
from fegear.gearset.power_path import mesh_torques_at
from fegear.gearset.yielding import yielding_shafts
from fegear.statics.axes import (
    YieldingAxes,
    require_thrust_on_bearings,
    yielding_axes,
)
from fegear.statics.contact_problem import contact_problem
from fegear.statics.settings import StaticsSettings
from lumped.common.array_types import Array
from lumped.common.progress import Progress, silent

# of a cycle, over which loads are exchanged; with 64 K_Hbeta changes by 4e-6
POSITIONS = 8
LOAD_RTOL = 1e-10  # change of a load over the largest, at which they agree
MAX_EXCHANGES = 60


@dataclass(frozen=True, eq=False)
class MachineAtRest:
    """Contact of all meshes at a torque on the input gear.

    torque : on the input gear [N m]
    problems : of all meshes, with what moves their axes
    cycles : contact over a cycle, None of a mesh without torque
    loads : (meshes, 2, 5) mean loads on driver and driven gear, along the push, the
        normal and the axis, and the moments that turn the axis toward both
    exchanges : how often loads were exchanged
    """

    gear_set: GearSet
    axes: YieldingAxes
    torque: float
    problems: tuple[ContactProblem, ...]
    cycles: tuple[ContactCycle | None, ...]
    loads: Array
    exchanges: int

    @cached_property
    def loads_on_gears(self) -> Array:
        """Sum of the loads (g, 5) on every gear, along x, y and z."""
        return self.axes.on_gears(self.gear_set, self.loads)

    @cached_property
    def motions(self) -> Array:
        """Motions (g, 5) of the axes in the middle of every gear [m and rad]."""
        return self.axes.motions(self.loads_on_gears)


def machine_at_rest(
    gear_set: GearSet,
    torque: float,
    settings: StaticsSettings,
    report: Progress = silent,
) -> MachineAtRest:
    """Solve all meshes at a torque on the input gear [N m].

    gear_set : on its shafts, see `fegear.gearset.yielding.on_shafts`
    """
    held, torques = yielding_axes(gear_set), mesh_torques_at(gear_set, torque)
    require_thrust_on_bearings(gear_set, torques)
    problems = [
        contact_problem(gear_set, mesh, settings, report)
        for mesh in range(len(torques))
    ]
    loads = np.zeros((len(torques), 2, MOTIONS))
    is_exchanged = any(loads_are_exchanged(gear_set, i) for i in range(len(torques)))
    places = np.arange(POSITIONS) / POSITIONS
    for exchange in range(1, MAX_EXCHANGES + 1):
        report("loads of shafts", exchange - 1, MAX_EXCHANGES)
        before = loads
        axes = held.under(gear_set, before)
        problems = [
            _supported(problem, axes.supports(gear_set, mesh, before, mesh_torque))
            if mesh_torque
            else problem
            for mesh, (problem, mesh_torque) in enumerate(
                zip(problems, torques, strict=True)
            )
        ]
        cycles = [
            solve_cycle(problem, mesh_torque, places) if mesh_torque else None
            for problem, mesh_torque in zip(problems, torques, strict=True)
        ]
        loads = np.array(
            [
                np.zeros((2, MOTIONS)) if cycle is None else mean_loads(problem, cycle)
                for problem, cycle in zip(problems, cycles, strict=True)
            ]
        )
        change = np.abs(loads - before).max(axis=(0, 1)) / _scale(loads)
        if not is_exchanged or change.max() < LOAD_RTOL:
            report("loads of shafts", MAX_EXCHANGES, MAX_EXCHANGES)
            return MachineAtRest(
                gear_set, axes, torque, tuple(problems), tuple(cycles), loads, exchange
            )
    raise ContactFailure(
        f"loads of meshes on common shafts change by {change.max():.2g} of the largest "
        f"after {MAX_EXCHANGES} exchanges at torque {torque:g} N m"
    )


def _scale(loads: Array) -> Array:
    """Largest forces and moments (5,), those without any left out of a comparison."""
    largest = np.abs(loads).max(axis=(0, 1))
    force, moment = largest[:3].max(), largest[3:].max()
    return np.array([force] * 3 + [moment or 1.0] * 2)


def _supported(problem: ContactProblem, supports: AxisSupports) -> ContactProblem:
    """The problem with its axes moved by the loads of other meshes."""
    if not isinstance(problem.solver, WidthContact):
        return problem
    return replace(problem, solver=replace(problem.solver, supports=supports))


def mean_loads(problem: ContactProblem, cycle: ContactCycle) -> Array:
    """Loads (2, 5) on driver and driven gear, mean over the positions of a cycle."""
    return np.asarray(loads_on_axes(problem, cycle).mean(axis=0))


def loads_on_axes(problem: ContactProblem, cycle: ContactCycle) -> Array:
    """Loads (n, 2, 5) on driver and driven gear at the positions of a cycle.

    At its first torque; see `fegear.contact.width.supports`.
    """
    face = cycle.face
    if isinstance(problem.solver, WidthContact):
        return face.axis_loads[0]
    # uniform over the width, in its middle
    force = (face.load[0] * face.slice_length)[..., 0, None]
    wrenches = unit_wrenches(
        (problem.pair.driver, problem.pair.driven),
        face.base_helix_angle,
        face.arc[0].reshape(-1, 2),
        (np.zeros(force.size), np.zeros(force.size)),
    )
    by_gear = [
        (force * wrench.reshape(*force.shape[:2], MOTIONS)).sum(axis=1)
        for wrench in wrenches
    ]
    return np.stack(by_gear, axis=1)


def loaded_problem(
    gear_set: GearSet,
    mesh: int,
    settings: StaticsSettings,
    torque: float,
    report: Progress = silent,
) -> ContactProblem:
    """Contact problem of a mesh whose axes other meshes move as at a torque.

    torque : on the driver of the mesh [N m], to which loads of others are proportional,
        and at which shafts on rolling bearings are linearised
    """
    _require_thrust(gear_set, mesh, torque)
    problem = contact_problem(gear_set, mesh, settings, report)
    if not loads_are_exchanged(gear_set, mesh):
        return problem
    # pairs of a mesh that differ have the loads of others that pairs alike would have
    regular = with_equal_teeth(without_pitch_errors(gear_set))
    factor = mesh_torques_at(gear_set, 1.0)[mesh]
    machine = machine_at_rest(regular, torque / factor, settings, report)
    return with_supports_of(problem, machine.problems[mesh])


def problems_at_torques(
    gear_set: GearSet,
    mesh: int,
    settings: StaticsSettings,
    torques: Array,
    report: Progress = silent,
) -> list[ContactProblem]:
    """Contact problem of a mesh at all torques on its driver (t,), or of each.

    There is one of each where loads are exchanged.
    """
    _require_thrust(gear_set, mesh, float(np.abs(torques).max(initial=0.0)))
    distinct = torques.tolist() if loads_are_exchanged(gear_set, mesh) else [0.0]
    return [
        loaded_problem(gear_set, mesh, settings, torque, report) for torque in distinct
    ]


def _require_thrust(gear_set: GearSet, mesh: int, torque: float) -> None:
    """Refuse bearings that do not take the thrust at a torque on a driver [N m]."""
    if not gear_set.meshes[mesh].on_shafts:
        return
    torques = mesh_torques_at(gear_set, 1.0)
    if torques[mesh]:
        scale = torque / torques[mesh]
        require_thrust_on_bearings(gear_set, [scale * one for one in torques])


def with_supports_of(problem: ContactProblem, other: ContactProblem) -> ContactProblem:
    """The problem with the axes of another one of the same mesh."""
    if isinstance(problem.solver, WidthContact) and isinstance(
        other.solver, WidthContact
    ):
        supports = other.solver.supports
        return replace(problem, solver=replace(problem.solver, supports=supports))
    return problem


def loads_are_exchanged(gear_set: GearSet, mesh: int) -> bool:
    """Whether axes of a mesh depend on loads of others, or on its own nonlinearly."""
    if not gear_set.meshes[mesh].on_shafts or not mesh_torques_at(gear_set, 1.0)[mesh]:
        return False
    for _, shaft in yielding_shafts(gear_set):
        loading = [
            number
            for number, spec in enumerate(gear_set.meshes)
            if set(shaft.gears).intersection(spec.gears)
        ]
        is_linear = shaft.body is None or not shaft.body.mounted_bearings
        if mesh in loading and (len(loading) > 1 or not is_linear):
            return True
    return False
