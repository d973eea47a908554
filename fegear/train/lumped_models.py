"""From a gear set to a lumped system: the one description that all solvers share."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from fegear.boundary import public
from fegear.files.errors import InputError
from fegear.gearset.faults.checks import require_no_faults
from fegear.gearset.faults.tooth_faults import FAULT_KINDS
from fegear.gearset.inertia import require_inertia_of_bodies
from fegear.gearset.lumped_train import train_of, with_efficiency
from fegear.gearset.model import GearSet
from fegear.gearset.pitch_errors import pair_periods, without_pitch_errors
from fegear.gearset.position_errors import position_gaps
from fegear.gearset.power_path import mesh_torques_at, power_path
from fegear.statics.excitation import (
    Excitations,
    ExcitationSource,
    GivenTables,
    StiffnessSource,
)
from fegear.statics.plausibility import mesh_warnings
from lumped.common.checks import require_choice, require_fields
from lumped.common.options import Range, documented, option
from lumped.steady.integration_settings import Method, Settings
from lumped.steady.losses import nominal_efficiency
from lumped.steady.truncation_check import TruncationCheck
from lumped.train.at_rest import RestReference, remove_pitch_errors
from lumped.train.coupled import COMPONENTS
from lumped.train.excitation import MeshExcitation, bending_along_path, column_at_torque
from lumped.train.friction import Sliding, ToothFriction, with_bending
from lumped.train.modes import MIN_RESONANCE_ENERGY
from lumped.train.path_load_curves import path_load_curves
from lumped.train.position_errors import with_gap
from lumped.train.rolling_supports import without_rolling_bearings
from lumped.train.system import LumpedSystem
from lumped.train.table import pair_names
from lumped.train.train import TrainError
from lumped.train.truncation import TruncationModel
from lumped.train.waves import Wave

TorqueOf = Literal["nominal", "input"]
Number = Literal[1, 2, 3, "coupled", "auto"]
DEFAULT_SPEEDS = 400  # at most, where none are given
SPRING_MODELS = (
    "Lumped model. 1: every tooth pair with its own stiffness and gap; 2: mean mesh "
    "stiffness, excited by the loaded static transmission error; 3: total mesh "
    "stiffness and no-load transmission error"
)
COUPLED_MODEL = (
    "coupled: tooth pairs that stiffen with load and deflect each other through "
    "elastic bodies with inertia"
)
AUTO_MODEL = (
    "auto: coupled, or 1 where friction, given stiffness or mesh tables need it"
)
Bearings = Literal["rolling", "linear"]
BendingRatio = float | Mapping[int, Wave]
LINEAR_ONLY = "the coupled model has linear bearings only"
NO_FRICTION = "the coupled model has no friction"
RATIO = "friction_bending_ratio"  # column of a mesh table


@documented
@dataclass(frozen=True, kw_only=True)
class LumpedModel:
    """Lumped model of a gear set's train."""

    number: Number = option(1, f"{SPRING_MODELS}; {COUPLED_MODEL}; {AUTO_MODEL}.")
    without: tuple[str, ...] = option(
        (),
        "Part of the coupled model to leave out; there may be several. hardening: "
        "contact stiffens with load; pairs: tooth pairs deflect each other; body: "
        "inertia of the elastic bodies; meshes: meshes of one gear deflect each other; "
        "modes: vibration of the bodies against their hubs. [default: none]",
    )
    translations: bool = option(
        False,
        "Let gears with bearing stiffnesses move in the plane; by default all gears "
        "only rotate.",
    )
    bearings: Bearings = option(
        "rolling",
        "Ball and roller bearings of gears that move in the plane. rolling: force of "
        "all rolling elements, whose cage rotates; linear: stiffness under load.",
    )
    damping_ratio: float | None = option(
        None,
        "Damping ratio of every vibration mode. [default: that of the gear set, else "
        "0.04]",
        Range(0.0, below=1.0),
    )
    stiffness: StiffnessSource | GivenTables = field(
        default_factory=StiffnessSource,
        metadata={"help": "Source of the mesh stiffness, or mesh tables."},
    )
    friction: float = option(
        0.0,
        "Coulomb friction coefficient of the teeth of all meshes, of model 1.",
        Range(0.0, below=1.0),
    )
    bending: float | Literal["cycle"] | None = option(
        None,
        "Friction-bending ratio: deflection of a tooth pair by a friction force over "
        "that by a normal force of the same size. [default: mean of the mesh tables]",
        Range(0.0, below=1.0),
    )
    sliding: Sliding = option(
        "nominal",
        "Sliding velocity that friction opposes. nominal: that of uniformly rotating "
        "gears; instantaneous: including the vibration, which can reverse friction "
        "near the pitch point.",
    )
    transition: float = option(
        0.0,
        "Sliding speed [m/s] over which instantaneous friction reverses smoothly, by "
        "tanh; 0: friction reverses at once.",
    )
    torque_of: TorqueOf = option(
        "nominal",
        "Meaning of the torque with friction. nominal: torque without friction; the "
        "friction loss raises the input torque and lowers the output torque in "
        "proportion to their inertias; input: mean torque of the input gear; the "
        "output torque is lowered by the efficiency of the meshes.",
    )

    def __post_init__(self) -> None:
        require_fields(self)
        if self.without and self.number != "coupled":
            raise ValueError(f"without needs the coupled model, got {self.number}")
        for name in self.without:
            require_choice("without", name, COMPONENTS)
        if len(set(self.without)) < len(self.without):
            raise ValueError(f"without must name each part once, got {self.without!r}")
        if self.friction and self.number not in (1, "auto"):
            raise ValueError(f"friction needs model 1, got {self.number}")
        if self._unmodified and self.number not in (1, "auto"):
            raise ValueError(
                f"relief_stiffness = unmodified needs model 1, got {self.number}"
            )
        self.tooth_friction(0.0)  # checks its fields

    def tooth_friction(self, bending: BendingRatio) -> ToothFriction:
        """Friction of a mesh, with its friction-bending ratio.

        Parameters
        ----------
        bending : float or mapping of int to Wave
            Deflection of a tooth pair by a friction force over that by a normal force
            of the same size, one number or a wave for each pair.

        Returns
        -------
        ToothFriction
            Coulomb friction with the coefficient of the model.
        """
        return ToothFriction(self.friction, bending, self.sliding, self.transition)

    @property
    def _unmodified(self) -> bool:
        """Whether relieved pairs have the stiffness of unmodified teeth."""
        source = self.stiffness
        return (
            isinstance(source, StiffnessSource)
            and source.relief_stiffness == "unmodified"
        )

    @property
    def springs(self) -> int:
        """The model that gives the modes and their damping."""
        if self.number == "auto":
            raise ValueError("number = auto; must be resolved for a gear set")
        return 1 if self.number == "coupled" else self.number

    @property
    def name(self) -> str:
        """The name of the model in files and on screens."""
        left_out = "".join(f", without {name}" for name in self.without)
        return f"{self.number}{left_out}"

    @property
    def excitations(self) -> ExcitationSource:
        """Source of excitations, with nothing solved yet; one serves for many
        torques.
        """
        stiffness = self.stiffness
        return (
            stiffness if isinstance(stiffness, GivenTables) else Excitations(stiffness)
        )


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
    if gear_set.carrier is not None:
        require_no_faults(gear_set, FAULT_KINDS, "motions of planetary sets")
    model, _ = resolve_model(model or LumpedModel(), gear_set)
    source = excitations or model.excitations
    contact_source = None
    if model.number == "coupled":
        if has_rolling_bearings(model, gear_set):
            raise InputError(f"{gear_set.name}: {LINEAR_ONLY}, use bearings = linear")
        contact_source = _known_contacts(gear_set, model, source)
    train = train_of(gear_set, torque, model.translations, model.damping_ratio)
    if model.bearings == "linear":
        train = without_rolling_bearings(train)
    on_meshes = mesh_torques_at(gear_set, torque)
    driven = tuple(
        source.mesh_excitation(gear_set, mesh, on_mesh, model.springs)
        for mesh, on_mesh in enumerate(on_meshes)
    )
    gaps = position_gaps(gear_set, train).tolist()
    references = tuple(
        reference and replace(reference, gap=gap)
        for reference, gap in zip(
            rest_references(gear_set, on_meshes, source, model, driven),
            gaps,
            strict=True,
        )
    )
    driven = tuple(map(with_gap, driven, gaps))
    friction: tuple[ToothFriction, ...] = ()
    try:
        if model.friction:
            ratios = bending_ratios(gear_set, on_meshes, source, model)
            friction = tuple(map(model.tooth_friction, ratios))
            driven = tuple(map(with_bending, driven, friction))
        system = LumpedSystem(train, driven, friction=friction, references=references)
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


def resolve_model(
    model: LumpedModel, gear_set: GearSet, method: Method = "rk4", need: str = ""
) -> tuple[LumpedModel, str]:
    """Choose the model where its number is auto, and say why.

    It is the coupled model, which has no error at rest and the vibration of the gears'
    bodies, or model 1 where something needs that.

    Parameters
    ----------
    model : LumpedModel
        Model that is asked for.
    gear_set : GearSet
        Gear set whose train it is of.
    method : str
        Method of integration, which the coupled model has one of.
    need : str
        What else needs model 1, in words; empty where nothing does.

    Returns
    -------
    model : LumpedModel
        Model with a number that is not auto.
    reason : str
        Reason for the choice, empty where nothing was chosen.
    """
    if model.number != "auto":
        return model, ""
    reason = need or _needs_model_1(model, gear_set, method)
    if reason:
        return replace(model, number=1), f"model 1: {reason}"
    reason = "coupled model: nothing here needs model 1"
    return replace(model, number="coupled"), reason


def has_rolling_bearings(model: LumpedModel, gear_set: GearSet) -> bool:
    """Whether gears move on ball or roller bearings that are not made linear.

    Parameters
    ----------
    model : LumpedModel
        Model of the train.
    gear_set : GearSet
        Its gears.

    Returns
    -------
    bool
        True if the force of a bearing is that of its rolling elements.
    """
    rolling = any(gear.rolling_bearing for gear in gear_set.gears)
    return model.translations and model.bearings == "rolling" and rolling


def _needs_model_1(model: LumpedModel, gear_set: GearSet, method: Method) -> str:
    """Why a gear set cannot have the coupled model, empty if it can."""
    source = model.stiffness
    if model.friction:
        return NO_FRICTION
    if has_rolling_bearings(model, gear_set):
        return LINEAR_ONLY
    if method != "rk4":
        return f"the coupled model has no integration by {method}"
    if isinstance(source, StiffnessSource) and source.kind != "fe":
        return f"the coupled model has no {source.kind} stiffness"
    if isinstance(source, StiffnessSource) and source.relief_stiffness == "unmodified":
        return "the coupled model has no stiffness of unmodified teeth"
    try:
        require_inertia_of_bodies(gear_set, "model 1 counts none of it")
        if isinstance(source, GivenTables):
            _require_coupled_tables(gear_set, source)
    except InputError as error:
        return str(error)
    return ""


def _require_coupled_tables(gear_set: GearSet, source: GivenTables) -> None:
    """Raise InputError where mesh tables have too little for the coupled model."""
    _known_contacts(gear_set, LumpedModel(number="coupled"), source)
    for (name, table), mesh in zip(source.tables, gear_set.meshes, strict=True):
        try:
            path_load_curves(table, mesh.pair.driver_arm)
        except ValueError as error:
            raise InputError(f"{name}: {error}") from None


def rest_references(
    gear_set: GearSet,
    on_meshes: Sequence[float],
    source: ExcitationSource,
    model: LumpedModel,
    excitations: Sequence[MeshExcitation],
) -> tuple[RestReference | None, ...]:
    """What the meshes are compared with at rest: the tables that they are made from.

    None for a mesh without load, or whose stiffness comes from no table.

    on_meshes : torques on the drivers [N m]
    excitations : of the meshes, without friction
    """
    of_pairs = model.number not in (2, 3)
    equal = without_pitch_errors(gear_set) if of_pairs else gear_set
    references: list[RestReference | None] = []
    for mesh, (torque, excitation) in enumerate(
        zip(on_meshes, excitations, strict=True)
    ):
        table = None
        if isinstance(source, GivenTables):
            table = source.tables[mesh][1]
        elif isinstance(source, Excitations) and source.source.kind == "fe":
            table = source.table(equal, mesh, torque)
        error = None
        if torque > 0.0 and table is not None and "ste_m" in table.columns:
            error = column_at_torque(table, "ste_m", torque)
        if error is None or not np.isfinite(error).all():
            references.append(None)
            continue
        force = torque / gear_set.meshes[mesh].pair.driver_arm
        nominal = remove_pitch_errors(excitation) if of_pairs else excitation
        references.append(RestReference(force, error, nominal))
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
    on_meshes: Sequence[float],
    source: ExcitationSource,
    model: LumpedModel,
) -> list[BendingRatio]:
    """Friction-bending ratios of the meshes: as the model gives them, else from the
    mesh tables.

    on_meshes : torques on their drivers [N m]
    Raises InputError where the stiffness comes from no table that has them.
    """
    if isinstance(model.bending, float | int):
        return [model.bending] * len(on_meshes)
    ratios: list[BendingRatio] = []
    for mesh, torque in enumerate(on_meshes):
        if isinstance(source, GivenTables):
            table = source.tables[mesh][1]
        elif isinstance(source, Excitations) and source.source.kind == "fe":
            table = source.table(gear_set, mesh, torque)
        else:
            raise InputError(
                "bending is missing; the friction-bending ratio comes from mesh tables "
                "by finite elements, of other excitations it must be given"
            )
        needed = [RATIO]
        if model.bending == "cycle":
            needed = pair_names(table, RATIO) or [f"pair1_{RATIO}"]
        for name in needed:
            if name not in table.columns:
                raise InputError(
                    f"bending is missing; mesh table {mesh + 1} has no column {name}"
                )
        if model.bending == "cycle":
            ratios.append(bending_along_path(table, torque))
        else:
            ratios.append(float(column_at_torque(table, RATIO, torque).mean()))
    return ratios


def _known_contacts(
    gear_set: GearSet, model: LumpedModel, source: ExcitationSource
) -> Excitations | GivenTables:
    """What gives the contacts of the coupled model; what it leaves out is there."""
    if isinstance(source, GivenTables):
        if max(pair_periods(gear_set)) > 1:
            faulty = any(gear.faults.any for gear in gear_set.gears)
            keys = "faults" if faulty else "pitch_errors_um"
            raise InputError(
                f"{keys} of {gear_set.name}; the coupled model of mesh tables "
                "is that of equal teeth, allowed are none or finite elements"
            )
    elif not isinstance(source, Excitations) or source.source.kind != "fe":
        raise InputError(
            "number = coupled; its contacts come from finite elements or mesh tables, "
            "other excitations know nothing of them"
        )
    if "meshes" in model.without and not shares_a_gear(gear_set):
        raise InputError(
            f"without = meshes; no gear of {gear_set.name} is in two meshes"
        )
    return source


def require_physical(gear_set: GearSet, torque: float, system: LumpedSystem) -> None:
    """Raise InputError where meshes yield too much at rest for their contacts to exist.

    torque : on the input gear [N m]
    """
    rest = abs(system.static_deflection)
    where = f" at {torque:g} N m on the input gear"
    for warning in mesh_warnings(gear_set.meshes, where, rest, 0.0 * rest):
        raise InputError(f"{gear_set.name}: {warning}")


def shares_a_gear(gear_set: GearSet) -> bool:
    """Whether a gear is in two meshes."""
    places = [g for mesh in gear_set.meshes for g in (mesh.driver, mesh.driven)]
    return len(set(places)) < len(places)


def require_method(model: LumpedModel, settings: Settings, gear_set: GearSet) -> None:
    """Adaptive steps end where springs open, of springs and teeth alone."""
    if settings.method == "rk4":
        return
    if model.number == "coupled":
        raise InputError(
            f"method = {settings.method}; the coupled model takes rk4 only"
        )
    if has_rolling_bearings(model, gear_set):
        raise InputError(f"method = {settings.method}; rolling bearings take rk4 only")


def truncation_bound(system: LumpedSystem, speeds: Sequence[float]) -> float | None:
    """Return a bound on the error of the mesh compliance by left-out body modes.

    Relative to the excitation's RMS; None for models without bodies.

    speeds : mesh frequencies of the first mesh [Hz]
    """
    truncation = _bodies_left_out(system)
    if truncation is None:
        return None
    inertia, retained = truncation
    return inertia.largest_error(retained, (min(speeds), max(speeds)))


def flank_bound(system: LumpedSystem, speeds: Sequence[float]) -> float | None:
    """Return a bound on the error of amplitudes on the flanks of sharp resonances.

    By left-out body modes, which shift them; None for models without bodies.

    speeds : mesh frequencies of the first mesh [Hz]
    """
    truncation = _bodies_left_out(system)
    if truncation is None:
        return None
    inertia, retained = truncation
    return inertia.flank_bound(retained, (min(speeds), max(speeds)))


def _bodies_left_out(
    system: LumpedSystem,
) -> tuple[TruncationModel, NDArray[np.bool_]] | None:
    """All body modes of the coupled model, and those that it has."""
    contacts = system.contacts
    if (
        contacts is None
        or contacts.truncation_model is None
        or contacts.retained is None
    ):
        return None
    return contacts.truncation_model, contacts.retained & (
        contacts.body_modes.count > 0
    )


def truncation_error(checks: Sequence[TruncationCheck]) -> float | None:
    """Largest relative change of the RMS by body modes that are left out."""
    return max((check.error for check in checks), default=None)


def default_speeds(system: LumpedSystem) -> list[float]:
    """From 0.5 to 1.3 times the resonances that meshes excite, in round steps.

    Those are natural frequencies of modes with a twentieth or more of their strain
    energy in the meshes, for every mesh as frequencies of the first [Hz].
    """
    modes = system.modes
    coupled = modes.frequency_Hz[modes.mesh_energy.sum(axis=0) >= MIN_RESONANCE_ENERGY]
    if not coupled.size:
        raise InputError("speeds are missing; no mode strains the meshes enough")
    rates = [float(rate) for rate in system.train.mesh_rates]
    low = 0.5 * float(coupled.min()) / max(rates)
    high = 1.3 * float(coupled.max()) / min(rates)
    step = _round_up((high - low) / DEFAULT_SPEEDS)
    first, last = max(1, math.floor(low / step)), math.ceil(high / step)
    return [float(Decimal(repr(step)) * i) for i in range(first, last + 1)]


def _round_up(value: float) -> float:
    """The next number of 1, 2 or 5 times a power of ten."""
    power = 10.0 ** math.floor(math.log10(value))
    factor = next(f for f in (1.0, 2.0, 5.0, 10.0) if f * power >= value * (1 - 1e-9))
    return float(f"{factor * power:.1g}")


def natural_frequencies(system: LumpedSystem) -> list[float]:
    """Natural frequencies of the modes that strain a mesh [Hz]."""
    return [float(f) for f in system.resonances_Hz]
