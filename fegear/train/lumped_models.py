"""From a gear set to a lumped system: the one description that all solvers share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fegear.boundary import public
from fegear.contact.problem import OpenContact
from fegear.files.errors import InputError
from fegear.gearset.lumped_train import train_of, with_efficiency
from fegear.gearset.model import GearSet
from fegear.gearset.pitch_errors import without_pitch_errors
from fegear.gearset.position_errors import position_gaps
from fegear.gearset.power_path import mesh_torques_at, power_path
from fegear.statics.excitation import Excitations, ExcitationSource
from fegear.statics.given_tables import GivenTables
from fegear.statics.plausibility import mesh_warnings
from fegear.train.model_settings import (
    BendingRatio,
    LumpedModel,
    contact_source_of,
    resolve_model,
)
from fegear.train.requirements import BENDING_NEEDED, require_model
from lumped.steady.losses import nominal_efficiency
from lumped.train.at_rest import RestReference, remove_pitch_errors
from lumped.train.bodies import TrainError
from lumped.train.excitation import MeshExcitation
from lumped.train.excitation_tables import bending_along_path, column_at_torque
from lumped.train.friction import ToothFriction, with_bending
from lumped.train.position_errors import with_gap
from lumped.train.rolling_supports import without_rolling_bearings
from lumped.train.system import LumpedSystem
from lumped.train.table import pair_names

FRICTION_BENDING_COLUMN = "friction_bending_ratio"  # column of a mesh table


@public
def lumped_system(
    gear_set: GearSet,
    torque: float,
    model: LumpedModel | None = None,
    excitations: ExcitationSource | None = None,
    like: LumpedSystem | None = None,
) -> LumpedSystem:
    """The lumped system at a torque on the input gear [N m].

    Parameters
    ----------
    gear_set : GearSet
        Gear set of the train.
    torque : float
        Torque on the input gear [N m].
    model : LumpedModel, optional
        Lumped model and its settings.
    excitations : ExcitationSource, optional
        Source of the meshes' excitations in place of the model's own, so that solved
        tables are used again.
    like : LumpedSystem, optional
        System of the coupled model whose choice of body modes this one shares.

    Returns
    -------
    LumpedSystem
        System for `lumped.sweep`, `lumped.respond` and the closed forms.

    Raises
    ------
    InputError
        If the gear set gives no train, the train would accelerate, or the model does
        not fit the gear set.
    """
    model, _ = resolve_model(model or LumpedModel(), gear_set)
    source = excitations or model.excitations
    require_model(gear_set, model, source)
    if model.motion == "space" and isinstance(source, Excitations):
        from fegear.train.space import loaded_machine, system_in_space

        machine = loaded_machine(gear_set, torque, source.settings)
        return system_in_space(gear_set, machine, model.damping_ratio)
    contact_source = None
    if model.number == "coupled":
        contact_source = contact_source_of(gear_set, model, source)
    train = train_of(gear_set, torque, model.translations, model.damping_ratio)
    if model.bearings == "linear":
        train = without_rolling_bearings(train)
    mesh_torques = mesh_torques_at(gear_set, torque)
    mesh_excitations = tuple(
        source.mesh_excitation(gear_set, mesh, on_mesh, model.springs)
        for mesh, on_mesh in enumerate(mesh_torques)
    )
    position_error_gaps = position_gaps(gear_set, train).tolist()
    references = tuple(
        reference and replace(reference, gap=gap)
        for reference, gap in zip(
            rest_references(gear_set, mesh_torques, source, model, mesh_excitations),
            position_error_gaps,
            strict=True,
        )
    )
    mesh_excitations = tuple(map(with_gap, mesh_excitations, position_error_gaps))
    friction: tuple[ToothFriction, ...] = ()
    try:
        if model.friction:
            ratios = bending_ratios(gear_set, mesh_torques, source, model)
            friction = tuple(map(model.tooth_friction, ratios))
            mesh_excitations = tuple(map(with_bending, mesh_excitations, friction))
        system = LumpedSystem(
            train, mesh_excitations, friction=friction, references=references
        )
        if friction and model.torque_of == "input":
            system = with_losses(gear_set, system)
    except (TrainError, ValueError) as error:
        raise InputError(f"{gear_set.name}: {error}") from None
    if contact_source is None:
        return system
    from fegear.train.coupled import coupled_contacts

    require_physical(gear_set, torque, system)
    contacts = coupled_contacts(
        *(gear_set, torque, system, contact_source, model.without),
        retained=like.contacts.retained if like is not None and like.contacts else None,
    )
    return replace(system, contacts=contacts)


def rest_references(
    gear_set: GearSet,
    mesh_torques: Sequence[float],
    source: ExcitationSource,
    model: LumpedModel,
    excitations: Sequence[MeshExcitation],
) -> tuple[RestReference | None, ...]:
    """What the meshes are compared with at rest: the tables that they are made from.

    None for a mesh without load, or whose stiffness comes from no table.

    mesh_torques : torques on the drivers [N m]
    excitations : of the meshes, without friction
    """
    has_pair_stiffness = model.number not in (2, 3)
    set_without_errors = (
        without_pitch_errors(gear_set) if has_pair_stiffness else gear_set
    )
    references: list[RestReference | None] = []
    for mesh, (torque, excitation) in enumerate(
        zip(mesh_torques, excitations, strict=True)
    ):
        table = None
        if isinstance(source, GivenTables):
            table = source.tables[mesh][1]
        elif isinstance(source, Excitations) and source.settings.kind == "fe":
            try:
                table = source.table(set_without_errors, mesh, torque)
            except OpenContact:
                table = None  # gears that fly do not rest
        static_error = None
        if torque > 0.0 and table is not None and "ste_m" in table.columns:
            static_error = column_at_torque(table, "ste_m", torque)
        if static_error is None or not np.isfinite(static_error).all():
            references.append(None)
            continue
        force = torque / gear_set.meshes[mesh].pair.driver_arm
        nominal_excitation = (
            remove_pitch_errors(excitation) if has_pair_stiffness else excitation
        )
        references.append(RestReference(force, static_error, nominal_excitation))
    return tuple(references)


def with_losses(gear_set: GearSet, system: LumpedSystem) -> LumpedSystem:
    """The system with an output torque lowered by what friction takes."""
    efficiency = 1.0
    for mesh in power_path(gear_set).meshes:
        force = system.modes.mean_stiffness[mesh] * abs(system.static_deflection[mesh])
        arguments = system.excitations[mesh], system.friction[mesh], float(force)
        efficiency *= nominal_efficiency(system.train, mesh, *arguments)
    train = with_efficiency(gear_set, system.train, efficiency)
    return replace(system, train=train, losses=1.0 - efficiency)


def bending_ratios(
    gear_set: GearSet,
    mesh_torques: Sequence[float],
    source: ExcitationSource,
    model: LumpedModel,
) -> list[BendingRatio]:
    """Friction-bending ratios of the meshes: as the model gives them, else from the
    mesh tables.

    mesh_torques : torques on their drivers [N m]
    Raises InputError where the stiffness comes from no table that has them.
    """
    if isinstance(model.bending, float | int):
        return [model.bending] * len(mesh_torques)
    ratios: list[BendingRatio] = []
    for mesh, torque in enumerate(mesh_torques):
        if isinstance(source, GivenTables):
            table = source.tables[mesh][1]
        elif isinstance(source, Excitations) and source.settings.kind == "fe":
            table = source.table(gear_set, mesh, torque)
        else:
            raise InputError(BENDING_NEEDED)
        needed_columns = [FRICTION_BENDING_COLUMN]
        if model.bending == "cycle":
            needed_columns = pair_names(table, FRICTION_BENDING_COLUMN) or [
                f"pair1_{FRICTION_BENDING_COLUMN}"
            ]
        for name in needed_columns:
            if name not in table.columns:
                raise InputError(
                    f"bending is missing; mesh table {mesh + 1} has no column {name}"
                )
        if model.bending == "cycle":
            ratios.append(bending_along_path(table, torque))
        else:
            ratios.append(
                float(column_at_torque(table, FRICTION_BENDING_COLUMN, torque).mean())
            )
    return ratios


def require_physical(gear_set: GearSet, torque: float, system: LumpedSystem) -> None:
    """Raise InputError where meshes yield too much at rest for their contacts to exist.

    torque : on the input gear [N m]
    """
    rest_deflections = abs(system.static_deflection)
    load_text = f" at {torque:g} N m on the input gear"
    for warning in mesh_warnings(
        gear_set.meshes, load_text, rest_deflections, 0.0 * rest_deflections
    ):
        raise InputError(f"{gear_set.name}: {warning}")
