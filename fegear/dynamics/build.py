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
    modes_of,
    truncate_modes,
)
from fegear.dynamics.memory import full_bytes, require_memory
from fegear.dynamics.mesh_load_curves import (
    all_mesh_load_curves,
    equal_tables,
    pitch_point,
)
from fegear.dynamics.model import DynamicModel, dynamic_model
from fegear.dynamics.sides import MeshLoadCurves
from fegear.dynamics.stepper import DynamicSettings, ImplicitStepper, ReducedStepper
from fegear.elasticity.gear_modes import GearModes, resolving_sector
from fegear.files.codes import with_code
from fegear.files.errors import InputError
from fegear.gearset.faults.checks import require_no_faults
from fegear.gearset.faults.tooth_faults import FAULT_KINDS
from fegear.gearset.inertia import (
    require_inertia_beyond_springs,
    require_inertia_of_bodies,
)
from fegear.gearset.model import GearSet
from fegear.statics.excitation import Excitations
from fegear.statics.settings import StaticsSettings
from lumped.common.array_types import Array
from lumped.common.checks import require_fields
from lumped.common.options import Range, documented, option
from lumped.train.elastic_inertia import (
    Choice,
    ElasticModes,
    ExcitedMesh,
    choose,
    harmonic_amplitudes,
)
from lumped.train.modes import MIN_RESONANCE_ENERGY
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
class FiniteElements:
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
    _require_known_faults(gear_set, elements.fidelity)
    if elements.fidelity != "quasistatic":
        otherwise = "fidelity quasistatic has no elastic body"
        require_inertia_of_bodies(gear_set, otherwise)
        require_inertia_beyond_springs(gear_set, otherwise)
    tables = equal_tables(gear_set, torque, excitations)
    statics = replace(excitations.source.statics, friction=elements.friction)
    load_curves = all_mesh_load_curves(gear_set, tables, statics)
    cross_mesh = cross_mesh_compliance(gear_set, load_curves, statics)
    if elements.fidelity == "full":
        highest = highest_speed(reference, speeds)
        cyclic_gears = _cyclic_gears(gear_set, statics, elements.mesh, highest)
        require_memory(gear_set, full_bytes(gear_set, load_curves, cyclic_gears))
        ratio = elements.elastic_damping
        return _prepare_full(
            gear_set,
            reference,
            load_curves,
            cyclic_gears,
            cross_mesh,
            ratio,
            settings.scheme,
        )
    cross_mesh_pair = (
        None if cross_mesh is None else (cross_mesh, np.zeros_like(cross_mesh))
    )
    no_modes: list[ElasticGear | None] = [None] * len(gear_set.gears)
    rigid = dynamic_model(gear_set, reference, load_curves, no_modes, cross_mesh_pair)
    if elements.fidelity == "quasistatic":
        return _reduced_choice(
            rigid, settings, "quasistatic", "quasistatic: as asked for", []
        )
    highest = highest_speed(reference, speeds)
    modes = modes_of(gear_set, highest, statics, elements.cutoff_Hz)
    if not any(mode_set.frequencies_Hz.size for mode_set in modes):
        if elements.cutoff_Hz is not None:
            raise InputError(
                f"cutoff_Hz = {elements.cutoff_Hz:g}; no elastic mode of the gears "
                "lies below it, allowed are more, or fidelity quasistatic"
            )
        reason = "quasistatic: no elastic mode of the gears is near these speeds"
        return _reduced_choice(rigid, settings, "quasistatic", reason, [])
    elastic = elastic_gears(gear_set, modes, elements.elastic_damping)
    model = dynamic_model(gear_set, reference, load_curves, elastic, cross_mesh_pair)
    choice = _choice(model, tables, speeds, elements)
    unseen = ""
    if elements.cutoff_Hz is not None:
        unseen = f"; modes above {elements.cutoff_Hz:g} Hz are left out of this"
    if elements.fidelity == "reduced":
        reason = with_code("E18", _reduced_reason(choice, modes) + unseen)
        return _reduced_choice(model, settings, "reduced", reason, modes)
    reason = with_code("E18", choice.sentence + unseen)
    if choice.fidelity == "quasistatic":
        return _reduced_choice(rigid, settings, "quasistatic", reason, [])
    truncated = [truncate_modes(mode_set, choice.cutoff_Hz) for mode_set in modes]
    elastic = elastic_gears(gear_set, truncated, elements.elastic_damping)
    model = dynamic_model(gear_set, reference, load_curves, elastic, cross_mesh_pair)
    return _reduced_choice(model, settings, "reduced", reason, truncated)


def _require_known_faults(gear_set: GearSet, fidelity: Fidelity) -> None:
    if gear_set.carrier is not None:
        require_no_faults(gear_set, FAULT_KINDS, "motions of planetary sets")
    if fidelity == "full":
        # cracks change the body, of which sectors are equal
        require_no_faults(gear_set, ["cracks"], "finite elements of fidelity full")


def _prepare_full(
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


def _reduced_choice(
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


def _cyclic_gears(
    gear_set: GearSet, statics: StaticsSettings, refinement: float, highest: float
) -> list[CyclicGear]:
    """For mesh frequencies up to `highest` [Hz]."""
    from fegear.elasticity.cyclic_gear import cyclic_gear

    cyclic_gears = []
    for gear in gear_set.gears:
        sector, cutoff = statics.sector(gear, refinement), default_cutoff(gear, highest)
        sector = resolving_sector(sector, gear.density, cutoff)
        cyclic_gears.append(cyclic_gear(sector, gear.density))
    return cyclic_gears


def _reduced_reason(choice: Choice, modes: Sequence[GearModes]) -> str:
    counts = " + ".join(str(mode_set.frequencies_Hz.size) for mode_set in modes)
    return (
        f"reduced: as asked for, with {counts} elastic modes of the gears; "
        "without, elastic inertia would change the mesh compliance by "
        f"up to {100.0 * choice.bound:.2g} % of the excitation's RMS"
    )


def _choice(
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
    count, columns, normal = jacobian.widths, jacobian.columns, jacobian.normal
    hubs, rigidity = model.modal.damping.size, model.modal.rigidity
    stiffness = model.reference.modes.mean_stiffness
    meshes = []
    for m, table in enumerate(tables):
        pair, position_index = pitch_point(
            model.sides[0].gear_set, m, normal.shape[1] - 1
        )
        labels = model.contact_labels
        contact = next(c for c, label in enumerate(labels) if label == (m, pair, 1))
        mode_index = columns[m, hubs : count[m]] - hubs
        row = normal[contact, position_index, hubs : count[m]]
        share = stiffness[m] * row**2 / rigidity[mode_index]
        frequencies = np.sqrt(rigidity[mode_index]) / (2.0 * math.pi)
        modes = ElasticModes(frequencies, share, elements.elastic_damping)
        amplitudes = harmonic_amplitudes(table["ste_m"][0])
        meshes.append((modes, amplitudes, float(model.kinematics.rate[m])))
    judged = [*speeds, *_speeds_of_resonances(model.reference, meshes)]
    return choose(meshes, judged, elements.tolerance)


def resonance_band(reference: LumpedSystem) -> tuple[float, float] | None:
    """Mesh frequencies of the first mesh [Hz] around a train's resonances.

    From a tenth of the lowest to 1.3 times the highest natural frequency that strains
    the meshes, without body modes; None where none does.
    """
    strained = reference.modes.mesh_energy.sum(axis=0) >= MIN_RESONANCE_ENERGY
    resonances = reference.modes.frequency_Hz[strained]
    if not resonances.size:
        return None
    rates = [float(rate) for rate in reference.train.mesh_rates]
    low = SPEED_BAND_FACTORS[0] * float(resonances.min()) / max(rates)
    return low, SPEED_BAND_FACTORS[1] * float(resonances.max()) / min(rates)


def highest_speed(reference: LumpedSystem, speeds: Sequence[float]) -> float:
    """Mesh frequency of the first mesh [Hz] up to which elastic modes are kept.

    That of the train's own resonances at least: harmonics of low speeds excite these,
    and the motion at a speed must not depend on which others are asked for.
    """
    band = resonance_band(reference)
    return max(speeds) if band is None else max(*speeds, band[1])


def _speeds_of_resonances(
    reference: LumpedSystem, meshes: Sequence[ExcitedMesh]
) -> list[float]:
    """Mesh frequencies of the first mesh [Hz] around a train's resonances.

    Those at which harmonics meet an elastic mode are among them.
    """
    band = resonance_band(reference)
    if band is None:
        return []
    low, high = band
    orders = np.arange(1.0, MAX_ORDER + 1.0)
    met = [
        np.divide.outer(
            modes.frequencies_Hz[modes.compliance > MIN_COMPLIANCE_SHARE], rate * orders
        )
        for modes, _, rate in meshes
    ]
    speeds = np.concatenate([block.ravel() for block in met])
    inside = np.unique(speeds[(speeds > low) & (speeds < high)])
    return [*np.geomspace(low, high, N_SPEEDS).tolist(), *inside.tolist()]
