"""Static deflection of a task's meshes, by finite elements or a lumped excitation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fegear.excitation import Excitations
from fegear.gearset.pitch_errors import error_periods
from fegear.statics import solve_mesh
from fegear.train import mesh_torques_at
from lumped.analytic import lowest_deflection
from lumped.excitation import MeshExcitation
from validation.metrics import CYCLE_POINTS, Statics
from validation.tasks import Task

Array = NDArray[np.float64]


def mesh_statics(
    task: Task, excitations: Excitations, mesh: int, excitation: MeshExcitation
) -> Statics:
    """Static deflection of a mesh (from 0) under the task's torque.

    Over all base pitches until its tooth pairs repeat.
    """
    gear_set = task.gear_set
    torque = mesh_torques_at(gear_set, task.torque)[mesh]
    force = torque / gear_set.meshes[mesh].pair.driver.base_radius
    if task.model is None:
        table = free = excitations.table(gear_set, mesh, torque)
        if task.case.friction > 0.0:
            statics = excitations.source.statics_of(gear_set, mesh)
            settings = replace(statics, friction=task.case.friction)
            table = solve_mesh(gear_set, mesh, [torque], settings).table
        return Statics(
            mesh + 1,
            force,
            table.position,
            table["ste_m"][0],
            table["ste_m"][0] - free["ste_m"][0],
            free["n_pairs"][0] == 1,
        )
    pitches, each = error_periods(gear_set)[mesh], CYCLE_POINTS
    if pitches > 1:
        each = excitations.source.statics_of(gear_set, mesh).positions
    position = np.arange(pitches * each) / each
    deflection = static_deflection(excitation, force, position)
    still, none = np.zeros_like(position), np.zeros(position.size, bool)
    return Statics(mesh + 1, force, position, deflection, still, none)


def static_deflection(
    excitation: MeshExcitation, force: float, position: Array
) -> Array:
    """Deflection [m] at mesh positions (n,) under a force [N]."""
    stiffness, gap = (
        np.array([getattr(pair, name)(position) for pair in excitation.pairs])
        for name in ("stiffness", "gap")
    )
    return lowest_deflection(stiffness, gap, force)
