"""Statics of the meshes of a case: of finite elements and of lumped models."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fegear.gearset.pitch_errors import pair_periods
from fegear.gearset.power_path import mesh_torques_at
from fegear.statics import solving
from fegear.statics.excitation import Excitations
from lumped.common.array_types import Array
from lumped.common.checks import require_present
from lumped.train.analytic import lowest_deflection
from lumped.train.coupled import static_transmission_error
from lumped.train.excitation import MeshExcitation
from lumped.train.friction import torque_shares
from lumped.train.system import LumpedSystem
from validation.study.metrics import CYCLE_POINTS, Statics
from validation.study.tasks import RunSpec


def mesh_statics(
    spec: RunSpec, excitations: Excitations, mesh: int, system: LumpedSystem
) -> Statics:
    """Static deflection of a mesh (from 0) under the task's torque.

    Over all base pitches until its tooth pairs repeat.
    """
    gear_set = spec.gear_set
    torque = mesh_torques_at(gear_set, spec.torque)[mesh]
    force = torque / gear_set.meshes[mesh].pair.driver.base_radius
    if spec.model is None:
        return _element_statics(spec, excitations, mesh, torque, force)
    pitches, positions = pair_periods(gear_set)[mesh], CYCLE_POINTS
    if pitches > 1:
        positions = excitations.settings.statics_of(gear_set).positions
    position = np.arange(pitches * positions) / positions
    if system.has_friction:
        frictionless = excitations.mesh_excitation(gear_set, mesh, torque, 1)
        return _friction_statics(system, frictionless, mesh, force, position)
    if system.contacts is None:
        deflection = static_deflection(system.excitations[mesh], force, position)
    else:
        position, deflection = _coupled_deflection(system, mesh, force, pitches)
    no_friction, no_single_pair = np.zeros_like(position), np.zeros(position.size, bool)
    return Statics(mesh + 1, force, position, deflection, no_friction, no_single_pair)


def _element_statics(
    spec: RunSpec, excitations: Excitations, mesh: int, torque: float, force: float
) -> Statics:
    table = frictionless = excitations.table(spec.gear_set, mesh, torque)
    if spec.friction > 0.0:
        statics = excitations.settings.statics_of(spec.gear_set)
        settings = replace(statics, friction=spec.friction)
        table = solving.mesh_statics(spec.gear_set, mesh, [torque], settings).table
    return Statics(
        mesh + 1,
        force,
        table.position,
        table["ste_m"][0],
        table["ste_m"][0] - frictionless["ste_m"][0],
        frictionless["n_pairs"][0] == 1,
    )


def _friction_statics(
    system: LumpedSystem,
    frictionless: MeshExcitation,
    mesh: int,
    force: float,
    position: Array,
) -> Statics:
    """Statics with friction of the tooth pairs, whose moments carry a part of the
    torque.

    frictionless : the excitation of the mesh without friction
    """
    ahead = [pair.ahead or 0 for pair in frictionless.pairs]
    mu = system.friction[mesh].coefficient
    shares = torque_shares(system.train, mesh, mu, ahead, position)
    deflection = static_deflection(system.excitations[mesh], force, position, shares)
    change = deflection - static_deflection(frictionless, force, position)
    stiffness = np.array([pair.stiffness(position) for pair in frictionless.pairs])
    single = np.count_nonzero(stiffness > 0.0, axis=0) == 1
    return Statics(mesh + 1, force, position, deflection, change, single)


def _coupled_deflection(
    system: LumpedSystem, mesh: int, force: float, pitches: int
) -> tuple[Array, Array]:
    """Positions (n,) over so many base pitches, and deflection of the coupled model.

    At the positions of its own tables, see `static_transmission_error`.
    """
    contacts = require_present(system.contacts, "coupled model")
    cycles = [
        static_transmission_error(contacts, mesh, force, cycle)[:-1]
        for cycle in range(pitches)
    ]
    grid = len(cycles[0])
    phase = np.arange(pitches * grid) / grid + system.train.meshes[mesh].phase
    position = np.mod(phase, float(pitches))
    order = np.argsort(position)
    return position[order], np.concatenate(cycles)[order]


def static_deflection(
    excitation: MeshExcitation,
    force: float,
    position: Array,
    shares: Array | float = 1.0,
) -> Array:
    """Deflection [m] at mesh positions (n,) under a force [N].

    shares : of the pairs' forces that hold it (p, n)
    """
    stiffness, gap = (
        np.array([getattr(pair, name)(position) for pair in excitation.pairs])
        for name in ("stiffness", "gap")
    )
    return lowest_deflection(shares * stiffness, gap, force)
