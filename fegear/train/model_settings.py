"""Settings of a lumped model of a train, and which model a gear set can have."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

from fegear.files.errors import InputError
from fegear.gearset.inertia import require_inertia_of_bodies
from fegear.gearset.leads import require_spur
from fegear.gearset.model import GearSet
from fegear.gearset.pitch_errors import pair_periods
from fegear.statics.excitation import Excitations, ExcitationSource
from fegear.statics.excitation_settings import ExcitationSettings
from fegear.statics.given_tables import GivenTables
from lumped.common.checks import require_choice, require_fields
from lumped.common.options import Range, documented, option
from lumped.common.short_repr import ShortRepr
from lumped.steady.integration_settings import Method
from lumped.train.coupled import COMPONENTS
from lumped.train.friction import Sliding, ToothFriction
from lumped.train.path_load_curves import path_load_curves
from lumped.train.waves import Wave

TorqueOf = Literal["nominal", "input"]
Number = Literal[1, 2, 3, "coupled", "auto"]
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
GearMotion = Literal["plane", "space"]
LINEAR_ONLY = "the coupled model has linear bearings only"
NO_FRICTION = "the coupled model has no friction"
SPRINGS_IN_SPACE = "motion in space is that of springs over the face width"


@documented
@dataclass(frozen=True, kw_only=True)
class LumpedModel(ShortRepr):
    """Lumped model of a gear set's train."""

    number: Number = option("auto", f"{SPRING_MODELS}; {COUPLED_MODEL}; {AUTO_MODEL}.")
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
    motion: GearMotion = option(
        "plane",
        "Motion of gears. plane: they rotate, and move on their bearings with "
        "{translations}; space: they also tilt and move along their axes, on shafts "
        "with sections and bearings, and loads vary over the face width, of model 1.",
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
    excitation: ExcitationSettings | GivenTables = field(
        default_factory=ExcitationSettings,
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
        "that by a normal force of the same size. cycle: that of each tooth pair along "
        "its path, from the mesh tables; 0: friction bends no teeth. [default: mean of "
        "the mesh tables]",
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
        for name in self.without:
            require_choice("without", name, COMPONENTS)
        if self.without and self.number != "coupled":
            parts = ", ".join(self.without)
            named = "" if self.number == "auto" else f", not {self.number}"
            raise ValueError(
                f"without = {parts}; needs the coupled model by its name{named}"
            )
        if len(set(self.without)) < len(self.without):
            raise ValueError(f"without = {self.without!r}; must name each part once")
        if self.friction and self.number not in (1, "auto"):
            raise ValueError(
                f"friction = {self.friction:g}; needs model 1, not {self.number}"
            )
        if self.motion == "space":
            self._require_space()
        if self._unmodified and self.number not in (1, "auto"):
            raise ValueError(
                f"relief_stiffness = unmodified; needs model 1, not {self.number}"
            )
        self.tooth_friction(0.0)  # checks its fields

    def _require_space(self) -> None:
        """Raise ValueError for what motion in space has not."""
        if self.number not in (1, "auto"):
            raise ValueError(f"motion = space; needs model 1, not {self.number}")
        if self.translations:
            raise ValueError(
                "translations = True; motion = space has all of them, leave it out"
            )
        if self.friction:
            raise ValueError(
                f"friction = {self.friction:g}; must be 0 with motion = space"
            )
        if self._unmodified:
            raise ValueError(
                "relief_stiffness = unmodified; must be own with motion = space"
            )

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
        source = self.excitation
        return (
            isinstance(source, ExcitationSettings)
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
        in_space = " in space" if self.motion == "space" else ""
        return f"{self.number}{in_space}{left_out}"

    @property
    def excitations(self) -> ExcitationSource:
        """Source of excitations, with nothing solved yet; one serves for many
        torques.
        """
        chosen = self.excitation
        return chosen if isinstance(chosen, GivenTables) else Excitations(chosen)


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

    Raises
    ------
    InputError
        If the model has friction and gears are helical.
    """
    if model.friction:
        require_spur(gear_set, f"friction = {model.friction:g}")
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
    source = model.excitation
    if model.motion == "space":
        return SPRINGS_IN_SPACE
    if model.friction:
        return NO_FRICTION
    if has_rolling_bearings(model, gear_set):
        return LINEAR_ONLY
    if method != "rk4":
        return f"the coupled model has no integration by {method}"
    if isinstance(source, ExcitationSettings) and source.kind != "fe":
        return f"the coupled model has no {source.kind} stiffness"
    if (
        isinstance(source, ExcitationSettings)
        and source.relief_stiffness == "unmodified"
    ):
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
    contact_source_of(gear_set, LumpedModel(number="coupled"), source)
    for (name, table), mesh in zip(source.tables, gear_set.meshes, strict=True):
        try:
            path_load_curves(table, mesh.pair.driver_arm)
        except ValueError as error:
            raise InputError(f"{name}: {error}") from None


def contact_source_of(
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
    elif not isinstance(source, Excitations) or source.settings.kind != "fe":
        raise InputError(
            "number = coupled; its contacts come from finite elements or mesh tables, "
            "other excitations know nothing of them"
        )
    if "meshes" in model.without and not shares_a_gear(gear_set):
        raise InputError(
            f"without = meshes; no gear of {gear_set.name} is in two meshes"
        )
    return source


def shares_a_gear(gear_set: GearSet) -> bool:
    """Whether a gear is in two meshes."""
    places = [g for mesh in gear_set.meshes for g in (mesh.driver, mesh.driven)]
    return len(set(places)) < len(places)
