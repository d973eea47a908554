"""From a gear set to a stepper of the fidelity that was asked for."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from fegear.dynamics.cross_mesh import cross_mesh_compliance
from fegear.dynamics.elastic import ElasticGear
from fegear.dynamics.gear_elasticity import (
    default_cutoff,
    elastic_damping,
    elastic_gears,
    elastic_modes_of_gears,
    truncate_modes,
)
from fegear.dynamics.memory import full_bytes, require_memory
from fegear.dynamics.mesh_load_curves import (
    all_mesh_load_curves,
    pitch_point,
    tables_of_equal_teeth,
)
from fegear.dynamics.model import DynamicModel, dynamic_model
from fegear.dynamics.sides import MeshLoadCurves
from fegear.dynamics.stepper import DynamicSettings, ImplicitStepper, ReducedStepper
from fegear.elasticity.gear_modes import GearModes, resolving_sector
from fegear.files.codes import with_code
from fegear.files.errors import InputError
from fegear.gearset.faults.checks import require_no_faults
from fegear.gearset.inertia import (
    require_inertia_beyond_springs,
    require_inertia_of_bodies,
)
from fegear.gearset.leads import require_uniform_loads
from fegear.gearset.model import GearSet
from fegear.statics.excitation import Excitations
from fegear.statics.settings import StaticsSettings
from lumped.common.array_types import Array
from lumped.common.checks import require_fields
from lumped.common.options import Range, documented, option
from lumped.common.short_repr import ShortRepr
from lumped.train.elastic_inertia import (
    Choice,
    ElasticModes,
    ExcitedMesh,
    choose,
    harmonic_amplitudes,
)
from lumped.train.system import LumpedSystem
from lumped.train.table import MeshTable

if TYPE_CHECKING:
    from fegear.dynamics.scheme import Scheme
    from fegear.elasticity.cyclic_gear import CyclicGear

Fidelity = Literal["full", "reduced", "quasistatic", "auto"]
# of speeds, over the lowest and the highest resonance of a train
SPEED_BAND_FACTORS = 0.1, 1.3
N_SPEEDS, MAX_ORDER = 25, 12  # speeds of the band, and orders that meet elastic modes
MIN_COMPLIANCE_SHARE = 1e-4  # least part of a mode in the compliance of a mesh


@documented
@dataclass(frozen=True, kw_only=True)
class FiniteElements(ShortRepr):
    """Model of the gears. Its plane and resolution are those of the mesh tables."""

    fidelity: Fidelity = option(
        "auto",
        "Degrees of freedom. full: all of the finite elements; reduced: hubs and "
        "elastic modes of the gears; quasistatic: hubs only, without elastic inertia; "
        "auto: reduced where elastic inertia matters, otherwise quasistatic.",
    )
    friction: float = option(
        0.0, "Coulomb friction coefficient.", Range(0.0, below=0.5)
    )
    elastic_damping: float = option(
        0.01,
        "Damping ratio of the first elastic modes of the gears.",
        Range(0.0, below=1.0),
    )
    cutoff_Hz: float | None = option(
        None,
        "Natural frequency [Hz] up to which elastic modes are considered. [default: 7 "
        "times the highest speed or resonance, or more]",
        Range(above=0.0, most=3e5),
    )
    tolerance: float = option(
        0.02,
        "Error of the mesh compliance that {fidelity} auto allows, relative to the RMS "
        "of the excitation.",
        Range(above=0.0, most=1.0),
    )
    mesh: float = option(
        0.5,
        "Size of the mesh of whole gears of {fidelity} full, over that of statics.",
        Range(above=0.0, most=10.0),
    )

    def __post_init__(self) -> None:
        require_fields(self)


@dataclass(frozen=True, eq=False)
class StepperChoice:
    """A stepper and why it is of its fidelity, in a sentence that begins with it.

    elastic : number of each gear's elastic modes, or freedoms where all are kept
    """

    stepper: ImplicitStepper
    fidelity: str
    reason: str
    elastic: tuple[int, ...]


def prepare(
    gear_set: GearSet,
    torque: float,
    reference: LumpedSystem,
    speeds: Sequence[float],
    elements: FiniteElements,
    settings: DynamicSettings,
    excitations: Excitations,
) -> StepperChoice:
    """A stepper at a torque on the input gear [N m] for the speeds [Hz] to be run.

    reference : the lumped system (Model-1) at that torque
    excitations : of that system, whose tables are used again; plane state, resolution
        and corner contact of its source hold for all finite elements
    """
    require_uniform_loads(gear_set, "motions by finite elements")
    _refuse_unsupported_faults(gear_set, elements.fidelity)
    if elements.fidelity != "quasistatic":
        alternative = "fidelity quasistatic has no elastic body"
        require_inertia_of_bodies(gear_set, alternative)
        require_inertia_beyond_springs(gear_set, alternative)
    tables = tables_of_equal_teeth(gear_set, torque, excitations)
    statics = replace(excitations.settings.statics, friction=elements.friction)
    load_curves = all_mesh_load_curves(gear_set, tables, statics)
    cross_mesh = cross_mesh_compliance(gear_set, load_curves, statics)
    if elements.fidelity == "full":
        highest_Hz = highest_mesh_frequency(reference, speeds)
        cyclic_gears = _assemble_cyclic_gears(
            gear_set, statics, elements.mesh, highest_Hz
        )
        require_memory(gear_set, full_bytes(gear_set, load_curves, cyclic_gears))
        damping_ratio = elements.elastic_damping
        return _choose_full_stepper(
            gear_set,
            reference,
            load_curves,
            cyclic_gears,
            cross_mesh,
            damping_ratio,
            settings.scheme,
        )
    cross_mesh_pair = (
        None if cross_mesh is None else (cross_mesh, np.zeros_like(cross_mesh))
    )
    no_modes: list[ElasticGear | None] = [None] * len(gear_set.gears)
    model_without_modes = dynamic_model(
        gear_set, reference, load_curves, no_modes, cross_mesh_pair
    )
    if elements.fidelity == "quasistatic":
        return _choose_modal_stepper(
            model_without_modes,
            settings,
            "quasistatic",
            "quasistatic: as asked for",
            [],
        )
    highest_Hz = highest_mesh_frequency(reference, speeds)
    modes = elastic_modes_of_gears(gear_set, highest_Hz, statics, elements.cutoff_Hz)
    if not any(mode_set.frequencies_Hz.size for mode_set in modes):
        if elements.cutoff_Hz is not None:
            raise InputError(
                f"cutoff_Hz = {elements.cutoff_Hz:g}; no elastic mode of the gears "
                "lies below it, allowed are more, or fidelity quasistatic"
            )
        reason = "quasistatic: no elastic mode of the gears is near these speeds"
        return _choose_modal_stepper(
            model_without_modes, settings, "quasistatic", reason, []
        )
    elastic_bodies = elastic_gears(gear_set, modes, elements.elastic_damping)
    model = dynamic_model(
        gear_set, reference, load_curves, elastic_bodies, cross_mesh_pair
    )
    fidelity_choice = _choose_fidelity(model, tables, speeds, elements)
    cutoff_remark = ""
    if elements.cutoff_Hz is not None:
        cutoff_remark = f"; modes above {elements.cutoff_Hz:g} Hz are left out of this"
    if elements.fidelity == "reduced":
        reason = with_code(
            "E18", _reason_of_reduced(fidelity_choice, modes) + cutoff_remark
        )
        return _choose_modal_stepper(model, settings, "reduced", reason, modes)
    reason = with_code("E18", fidelity_choice.sentence + cutoff_remark)
    if fidelity_choice.fidelity == "quasistatic":
        return _choose_modal_stepper(
            model_without_modes, settings, "quasistatic", reason, []
        )
    truncated_modes = [
        truncate_modes(mode_set, fidelity_choice.cutoff_Hz) for mode_set in modes
    ]
    elastic_bodies = elastic_gears(gear_set, truncated_modes, elements.elastic_damping)
    model = dynamic_model(
        gear_set, reference, load_curves, elastic_bodies, cross_mesh_pair
    )
    return _choose_modal_stepper(model, settings, "reduced", reason, truncated_modes)


def _refuse_unsupported_faults(gear_set: GearSet, fidelity: Fidelity) -> None:
    if fidelity == "full":
        # cracks change the body, of which sectors are equal
        require_no_faults(gear_set, ["cracks"], "finite elements of fidelity full")


def _choose_full_stepper(
    gear_set: GearSet,
    reference: LumpedSystem,
    load_curves: Sequence[MeshLoadCurves],
    cyclic_gears: Sequence[CyclicGear],
    cross_mesh: Array | None,
    damping_ratio: float,
    scheme: Scheme,
) -> StepperChoice:
    from fegear.dynamics.full import FullStepper, full_model

    damping = [elastic_damping(gear, damping_ratio) for gear in gear_set.gears]
    hubs, fields = full_model(
        gear_set, reference, load_curves, cyclic_gears, damping, cross_mesh
    )
    dofs = tuple(
        field.cyclic_gear.unknowns * field.cyclic_gear.teeth for field in fields
    )
    counts = " + ".join(map(str, dofs))
    reason = f"full: as asked for, {counts} elastic freedoms of the gears"
    return StepperChoice(FullStepper(hubs, scheme, fields), "full", reason, dofs)


def _choose_modal_stepper(
    model: DynamicModel,
    settings: DynamicSettings,
    fidelity: str,
    reason: str,
    modes: Sequence[GearModes],
) -> StepperChoice:
    counts = tuple(mode_set.frequencies_Hz.size for mode_set in modes)
    return StepperChoice(
        ReducedStepper(model, settings.scheme), fidelity, reason, counts
    )


def _assemble_cyclic_gears(
    gear_set: GearSet, statics: StaticsSettings, refinement: float, highest_Hz: float
) -> list[CyclicGear]:
    """For mesh frequencies up to `highest_Hz` [Hz]."""
    from fegear.elasticity.cyclic_gear import cyclic_gear

    cyclic_gears = []
    for gear in gear_set.gears:
        sector, cutoff = (
            statics.sector(gear, refinement),
            default_cutoff(gear, highest_Hz),
        )
        sector = resolving_sector(sector, gear.density, cutoff)
        cyclic_gears.append(cyclic_gear(sector, gear.density))
    return cyclic_gears


def _reason_of_reduced(choice: Choice, modes: Sequence[GearModes]) -> str:
    counts = " + ".join(str(mode_set.frequencies_Hz.size) for mode_set in modes)
    return (
        f"reduced: as asked for, with {counts} elastic modes of the gears; "
        "without, elastic inertia would change the mesh compliance by "
        f"up to {100.0 * choice.bound:.2g} % of the excitation's RMS"
    )


def _choose_fidelity(
    model: DynamicModel,
    tables: Sequence[MeshTable],
    speeds: Sequence[float],
    elements: FiniteElements,
) -> Choice:
    """Whether elastic inertia matters, judged at each mesh's pitch point.

    By the excitation of equal teeth: pitch errors add what is slower. It is judged at
    the speeds of the train's own resonances as well, so that the choice, and with it
    the motion at a speed, hardly depends on which other speeds are asked for.
    """
    jacobian = model.jacobian
    n_columns, columns, normal = jacobian.widths, jacobian.columns, jacobian.normal
    n_hub_coordinates, rigidity = model.modal.damping.size, model.modal.rigidity
    stiffness = model.reference.modes.mean_stiffness
    excited_meshes = []
    for m, table in enumerate(tables):
        pair, position_index = pitch_point(
            model.sides[0].gear_set, m, normal.shape[1] - 1
        )
        labels = model.contact_labels
        contact = next(c for c, label in enumerate(labels) if label == (m, pair, 1))
        mode_index = columns[m, n_hub_coordinates : n_columns[m]] - n_hub_coordinates
        penetration_per_mode = normal[
            contact, position_index, n_hub_coordinates : n_columns[m]
        ]
        compliance_share = stiffness[m] * penetration_per_mode**2 / rigidity[mode_index]
        frequencies = np.sqrt(rigidity[mode_index]) / (2.0 * math.pi)
        elastic_modes = ElasticModes(
            frequencies, compliance_share, elements.elastic_damping
        )
        amplitudes = harmonic_amplitudes(table["ste_m"][0])
        excited_meshes.append(
            (elastic_modes, amplitudes, float(model.kinematics.rate[m]))
        )
    checked_speeds = [*speeds, *_resonant_speeds(model.reference, excited_meshes)]
    return choose(excited_meshes, checked_speeds, elements.tolerance)


def highest_mesh_frequency(reference: LumpedSystem, speeds: Sequence[float]) -> float:
    """Mesh frequency of the first mesh [Hz] up to which elastic modes are kept.

    That of the train's own resonances at least: harmonics of low speeds excite these,
    and the motion at a speed must not depend on which others are asked for.
    """
    band = reference.speed_band(*SPEED_BAND_FACTORS)
    return max(speeds) if band is None else max(*speeds, band[1])


def _resonant_speeds(
    reference: LumpedSystem, meshes: Sequence[ExcitedMesh]
) -> list[float]:
    """Mesh frequencies of the first mesh [Hz] around a train's resonances.

    Those at which harmonics meet an elastic mode are among them.
    """
    band = reference.speed_band(*SPEED_BAND_FACTORS)
    if band is None:
        return []
    low, high = band
    orders = np.arange(1.0, MAX_ORDER + 1.0)
    speeds_by_mesh = [
        np.divide.outer(
            modes.frequencies_Hz[modes.compliance > MIN_COMPLIANCE_SHARE], rate * orders
        )
        for modes, _, rate in meshes
    ]
    speeds = np.concatenate([mesh_speeds.ravel() for mesh_speeds in speeds_by_mesh])
    speeds_in_band = np.unique(speeds[(speeds > low) & (speeds < high)])
    return [*np.geomspace(low, high, N_SPEEDS).tolist(), *speeds_in_band.tolist()]
