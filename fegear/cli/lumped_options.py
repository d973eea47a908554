"""Options of the commands of lumped models, and their checks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, TypeVar

import typer

from fegear.cli.edits import EditedSet, refuse_idle_edits
from fegear.cli.groups import option
from fegear.cli.options import (
    RATIO,
    Elements,
    allowed_torques,
    chosen,
    named_options,
    refuse_idle,
    required_torques,
)
from fegear.errors import InputError
from fegear.studies.study import Range

if TYPE_CHECKING:
    from fegear.excitation import GivenTables, Source
    from fegear.gearset.model import GearSet
    from fegear.lumped_models import LumpedModel, Number
    from lumped.maps import Axis
    from lumped.settings import Settings
    from lumped.sweep import Direction


T = TypeVar("T")
INGREDIENTS = "hardening", "pairs", "body", "meshes", "modes"  # of the coupled model
NAMED = "model", "without", "method"  # in errors of the library as the options are
NUMBERS: dict[str, Number] = {"1": 1, "2": 2, "3": 3, "coupled": "coupled"}
Kind = Literal["fe", "rectangular", "trapezoid", "fourier"]
Damping = Annotated[
    float | None,
    typer.Option(
        help="Damping ratio of every vibration mode. [default: that of the gear "
        "set, else 0.04]"
    ),
    RATIO,
]
Translations = Annotated[
    bool,
    typer.Option(
        "--translations",
        help="Let gears with bearing stiffnesses move in the plane, not rotate only.",
    ),
]
GivenTorque = Annotated[
    Literal["nominal", "input"] | None,
    typer.Option(
        help="What --torque is with friction. nominal: of gears without friction; "
        "what it takes comes to the input torque and goes from the output torque, in "
        "parts by their inertias; input: the mean torque of the input gear, and the "
        "output torque is lowered by the efficiency of the meshes. "
        "[default: nominal]"
    ),
]
LoadCases = Annotated[
    list[float] | None,
    typer.Option(
        help="Torque on the input gear [N\u00a0m]; may be repeated. [default: all "
        "load cases of the gear set]"
    ),
]
LoadCase = Annotated[
    float | None,
    typer.Option(
        help="Torque on the input gear [N\u00a0m]. [default: middle load case of the "
        "gear set]"
    ),
]


@dataclass(frozen=True, kw_only=True)
class SweptSpeeds:
    """Speeds, and the order in which they are passed."""

    speeds: str | None = option(
        "Mesh frequencies of the first mesh [Hz]; a number, or several with commas, as "
        "well. [default: 0.5 to 1.3 times the resonances]",
        metavar="A:B:STEP",
    )
    direction: Literal["up", "down", "both"] = option(
        "Whether the speed rises, falls, or first rises and then falls.",
        default="both",
    )

    @property
    def directions(self) -> tuple[Direction, ...]:
        """Of the speed, in order."""
        return ("up", "down") if self.direction == "both" else (self.direction,)

    @property
    def frequencies(self) -> list[float]:
        """Of the first mesh [Hz], none if none are given."""
        return [] if self.speeds is None else speeds_of(self.speeds)


@dataclass(frozen=True, kw_only=True)
class Settling:
    """When a motion counts as settled."""

    tolerance: float = option(
        "Relative settling tolerance: distance to the periodic motion over the range "
        "of the deflection.",
        default=1e-4,
    )
    max_periods: int | None = option(
        "Periods of the first mesh after which a motion that has not settled counts "
        "as aperiodic. [default: what the damping needs, 2000 or more]"
    )

    def settings_of(self, kind: type[T], **others: Any) -> T:
        """Settings of that kind; an InputError names the option."""
        limits = chosen(tolerance=self.tolerance, max_periods=self.max_periods)
        with named_options("steps", "tolerance", "max_periods"):
            return kind(**limits, **chosen(**others))


@dataclass(frozen=True, kw_only=True)
class Train:
    """How a gear train is damped and whether its gears move on their bearings."""

    damping: Damping = None
    translations: Translations = False


BELOW_ONE = Range(least=0.0, below=1.0)
HARMONICS = Range(least=1, most=1000)  # of Fourier waves


@dataclass(frozen=True, kw_only=True)
class LumpedOptions:
    """A lumped model of a gear set, but for mesh tables that are given."""

    model: str = option(
        "Lumped model. 1: every tooth pair with its own stiffness and gap; 2: mean "
        "mesh stiffness, excited by the loaded static transmission error; 3: total "
        "mesh stiffness and no-load transmission error.",
        default="1",
    )
    train: Train
    excitation: Kind | None = option(
        "Mesh stiffness over the mesh cycle. fe: tables solved by finite elements; "
        "rectangular, trapezoid, fourier: built from mean_stiffness_N_per_m, "
        "stiffness_variation and load_share of the gear set, what is missing from "
        "finite elements. [default: fe]"
    )
    ramp: float | None = option(
        "Length over which the stiffness of --excitation trapezoid rises and falls "
        "[base pitches]. [default: 0.1]",
        allowed=Range(least=0.0, most=1.0, unit="base pitches"),
    )
    harmonics: int | None = option(
        "Number of harmonics of the mesh frequency that --excitation fourier keeps. "
        "[default: 5]",
        allowed=HARMONICS,
    )
    elements: Elements
    models: ClassVar[tuple[str, ...]] = ("1", "2", "3")

    def __post_init__(self) -> None:
        require_one_of("--model", self.model, self.models)
        if self.excitation != "trapezoid":
            refuse_idle("needs --excitation trapezoid", ramp=self.ramp)
        if self.excitation != "fourier":
            refuse_idle("needs --excitation fourier", **self.waves)

    @property
    def waves(self) -> dict[str, int | None]:
        """How many harmonics a stiffness of Fourier waves has, by the option's name."""
        return {"harmonics": self.harmonics}

    def stiffness(self, gear_set: GearSet) -> Source | GivenTables:
        """Where the mesh stiffness comes from; refuses elements that nothing needs."""
        from fegear.excitation import Source

        (harmonics,) = self.waves.values()
        shape = chosen(kind=self.excitation, ramp=self.ramp, harmonics=harmonics)
        source = Source(**shape, **self.elements.choices)
        refuse_unused(self.elements, source.solves_elements(gear_set))
        return source

    def load(self, subject: EditedSet, torque: Any) -> tuple[GearSet, dict[str, Any]]:
        """The gear set as changed, and the changes, all of which the model reads.

        torque : as the option gives it
        """
        gear_set, changes = subject.load(torque=torque, damping=self.train.damping)
        figures = self.excitation not in (None, "fe")
        refuse_idle_edits(
            changes, translations=self.train.translations, figures=figures
        )
        return gear_set, changes

    def lumped_model(self, gear_set: GearSet) -> LumpedModel:
        from fegear.lumped_models import LumpedModel

        return LumpedModel(
            number=NUMBERS[self.model],
            translations=self.train.translations,
            damping_ratio=self.train.damping,
            stiffness=self.stiffness(gear_set),
        )


@dataclass(frozen=True, kw_only=True)
class CoupledOptions(LumpedOptions):
    """A lumped model of a gear set, the coupled one among them."""

    model: str = option(
        "Lumped model. 1: every tooth pair with its own stiffness and gap; 2: mean "
        "mesh stiffness, excited by the loaded static transmission error; 3: total "
        "mesh stiffness and no-load transmission error; coupled: tooth pairs that "
        "stiffen with load and deflect each other through elastic bodies with inertia.",
        default="1",
    )
    without: list[str] | None = option(
        "Part of --model coupled to leave out; may be repeated. hardening: contact "
        "stiffens with load; pairs: tooth pairs deflect each other; body: inertia of "
        "the elastic bodies; meshes: meshes of one gear deflect each other; modes: "
        "vibration of the bodies against their hubs. "
        "[default: none]"
    )
    models: ClassVar[tuple[str, ...]] = ("1", "2", "3", "coupled")

    def __post_init__(self) -> None:
        if self.model != "coupled":
            refuse_idle("needs --model coupled", without=self.without)
        for name in self.without or ():
            require_one_of("--without", name, INGREDIENTS)
            if (self.without or []).count(name) > 1:
                raise InputError(f"--without = {name}; is given more than once")
        super().__post_init__()

    def lumped_model(self, gear_set: GearSet) -> LumpedModel:
        model = super().lumped_model(gear_set)
        return replace(model, without=tuple(self.without or ()))


@dataclass(frozen=True, kw_only=True)
class TabledOptions(LumpedOptions):
    """A lumped model of a gear set, or of mesh tables that are given."""

    table: list[Path] | None = option(
        "Mesh table (CSV) in place of finite elements; give one for each mesh, in "
        "order. The coupled model needs columns of tooth pairs, at two or more torques "
        "unless without hardening."
    )

    def __post_init__(self) -> None:
        if self.table:
            reason = "--table replaces it, leave it out"
            refuse_idle(reason, excitation=self.excitation, **self.elements.choices)
        super().__post_init__()

    def load(self, subject: EditedSet, torque: Any) -> tuple[GearSet, dict[str, Any]]:
        gear_set, changes = super().load(subject, torque)
        for key in changes:
            if self.table and "_relief" in key:
                raise InputError(
                    f"--set {key}; --table has the teeth with their relief"
                )
        return gear_set, changes

    def stiffness(self, gear_set: GearSet) -> Source | GivenTables:
        from fegear.excitation import read_mesh_tables

        if not self.table:
            return super().stiffness(gear_set)
        try:
            return read_mesh_tables(self.table, gear_set)
        except InputError as error:
            raise InputError(f"--table: {error}") from None


@dataclass(frozen=True, kw_only=True)
class Rubbing:
    """Sliding friction of the teeth of all meshes."""

    friction: float | None = option(
        "Coulomb friction coefficient of the teeth of all meshes, of model 1. "
        "[default: 0]",
        allowed=BELOW_ONE,
    )
    bending: float | None = option(
        "Friction-bending ratio: deflection of a tooth pair by a friction force over "
        "that by a normal force of the same size. [default: mean of the mesh tables]",
        allowed=BELOW_ONE,
    )
    varying_bending: bool = option(
        "The friction-bending ratio of each tooth pair over its way through the mesh, "
        "as the mesh tables have it, in place of its mean.",
        default=False,
    )
    no_bending: bool = option(
        "Leave the bending of teeth by friction out, a ratio of 0.",
        default=False,
    )

    def __post_init__(self) -> None:
        if self.no_bending:
            idle = "--no-bending leaves it out"
            refuse_idle(
                idle, bending=self.bending, varying_bending=self.varying_bending
            )
        if self.varying_bending:
            refuse_idle("--varying-bending replaces it", bending=self.bending)
        if not self.rubs:
            refuse_idle("needs --friction above 0", **self.of_bending)

    @property
    def rubs(self) -> bool:
        """Whether teeth have friction."""
        return bool(self.friction)

    @property
    def of_bending(self) -> dict[str, float | bool | None]:
        """Options of bending, by their names."""
        return {
            "bending": self.bending,
            "varying_bending": self.varying_bending,
            "no_bending": self.no_bending,
        }

    def of(self, model: LumpedModel) -> LumpedModel:
        """A lumped model with this friction."""
        ratio: float | Literal["cycle"] | None = self.bending
        if self.no_bending:
            ratio = 0.0
        elif self.varying_bending:
            ratio = "cycle"
        if self.friction and model.number != 1:
            raise InputError(f"--friction needs --model 1, got {model.number}")
        return replace(model, friction=self.friction or 0.0, bending=ratio)


@dataclass(frozen=True, kw_only=True)
class MovingTeeth(Rubbing):
    """Friction of teeth that vibrate, and slide by it."""

    sliding: Literal["nominal", "instantaneous"] | None = option(
        "Whose sliding friction opposes. nominal: that of gears that turn evenly; "
        "instantaneous: with the vibration, which can turn it near the pitch point. "
        "[default: nominal]"
    )
    transition_speed: float | None = option(
        "Sliding speed [m/s] about which instantaneous friction turns smoothly, by "
        "tanh. [default: 0, it turns at once]",
        allowed=Range(above=0.0, below=10.0, unit="m/s"),
    )
    torque_of: GivenTorque = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.rubs:
            given = {"sliding": self.sliding, "torque_of": self.torque_of}
            refuse_idle("needs --friction above 0", **given)
        if self.sliding != "instantaneous":
            idle = "needs --sliding instantaneous"
            refuse_idle(idle, transition_speed=self.transition_speed)

    def of(self, model: LumpedModel) -> LumpedModel:
        """A lumped model with this friction."""
        return replace(
            super().of(model),
            sliding=self.sliding or "nominal",
            transition=self.transition_speed or 0.0,
            torque_of=self.torque_of or "nominal",
        )


def require_axis_of_teeth(axis: Axis, teeth: Rubbing) -> None:
    """What varies friction or its bending is in its range and not given besides."""
    from fegear.studies.varied import BENDING, FRICTION

    why = f"--over {axis.name} replaces it, leave it out"
    if axis.name == FRICTION:
        refuse_idle(why, friction=teeth.friction)
    if axis.name == BENDING:
        refuse_idle(why, **teeth.of_bending)
        if not teeth.rubs:
            raise InputError(f"--over {BENDING}; needs --friction above 0")
    for value in axis.values:
        if axis.name in (FRICTION, BENDING) and value not in BELOW_ONE:
            raise InputError(f"--over {axis.name} = {value:g}; allowed {BELOW_ONE}")


@dataclass(frozen=True, kw_only=True)
class AnyModel(CoupledOptions, TabledOptions):
    """The coupled model, or models of mesh tables that are given."""


def require_one_of(name: str, value: str, allowed: Sequence[str]) -> None:
    if value not in allowed:
        *others, last = allowed
        raise InputError(f"{name} = {value}; allowed {', '.join(others)} and {last}")


def refuse_unused(elements: Elements, used: bool) -> None:
    """Refuse options of finite elements where none are solved."""
    if not used:
        reason = "the gear set gives all stiffness figures, nothing is solved"
        refuse_idle(reason, **elements.choices)


@dataclass(frozen=True, kw_only=True)
class Integration(Settling):
    """Time integration of lumped models."""

    steps: int | None = option(
        "Least number of time steps per period of the fastest mesh, with --method "
        "rk4. [default: 64, 80 of --model coupled]"
    )
    method: Literal["rk4", "dopri5"] = option(
        "Time integration. rk4: fixed steps of fourth order; dopri5: adaptive steps "
        "of fifth order that end on every change of contact.",
        default="rk4",
    )

    @property
    def settings(self) -> Settings:
        """Numerical choices; InputError names the option."""
        from lumped.settings import Settings

        if self.method != "rk4":
            refuse_idle(f"{self.method} chooses its own steps", steps=self.steps)
        return self.settings_of(Settings, method=self.method, steps=self.steps)


def speeds_of(text: str, option: str = "--speeds") -> list[float]:
    """Speeds [Hz, or rpm], at least one; InputError names the option."""
    from fegear.speeds import parsed_speeds

    try:
        speeds = list(parsed_speeds(text))
    except ValueError as error:
        raise InputError(f"{option} = {text}; {error}") from None
    if not speeds:
        raise InputError(f"{option} is empty; a speed is needed")
    return speeds


def chosen_torques(gear_set: GearSet, asked: Sequence[float]) -> tuple[float, ...]:
    """Torques on the input gear [N m]: as asked, or the gear set's load cases."""
    from fegear.train import input_torques

    allowed = "must be 0, or at least 1e-6 and below 1e9 N m, on the input gear"
    torques = allowed_torques(asked, allowed, zero=True) or input_torques(gear_set)
    return required_torques(torques, f"{gear_set.name} has no load case")


def middle_torque(gear_set: GearSet, asked: float | None) -> float:
    """The torque asked for on the input gear, or the middle one of the load cases."""
    torques = chosen_torques(gear_set, [] if asked is None else [asked])
    return torques[len(torques) // 2]
