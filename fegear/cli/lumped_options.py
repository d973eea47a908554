"""Options of the commands of lumped models, and their checks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fegear.cli.edits import EditedSet, refuse_idle_edits
from fegear.cli.groups import option
from fegear.cli.options import (
    PlaneChoice,
    ResolutionChoice,
    refuse_idle,
    require,
    require_once,
)
from fegear.errors import InputError

if TYPE_CHECKING:
    from fegear.excitation import GivenTables, Source
    from fegear.gearset.model import GearSet
    from fegear.lumped_system import LumpedModel
    from lumped.settings import Settings
    from lumped.sweep import Direction

HARMONICS_LIMIT = 1000


class ExcitationChoice(StrEnum):
    fe = "fe"
    rectangular = "rectangular"
    trapezoid = "trapezoid"
    fourier = "fourier"


class MethodChoice(StrEnum):
    rk4 = "rk4"
    dopri5 = "dopri5"


class DirectionChoice(StrEnum):
    up = "up"
    down = "down"
    both = "both"

    @property
    def directions(self) -> tuple[Direction, ...]:
        return ("up", "down") if self.value == "both" else (self.value,)  # type: ignore[return-value]


Damping = Annotated[
    float | None,
    typer.Option(
        "--damping",
        help="Damping ratio of every vibration mode. [default: that of the gear "
        "set, else 0.04]",
    ),
]
Translations = Annotated[
    bool,
    typer.Option(
        "--translations",
        help="Let gears with bearing stiffnesses move in the plane, not rotate only.",
    ),
]
Speeds = Annotated[
    str | None,
    typer.Option(
        "--speeds",
        metavar="A:B:STEP",
        help="Mesh frequencies of the first mesh [Hz]; a number, or several with "
        "commas, as well. [default: 0.5 to 1.3 times the resonances]",
    ),
]
LoadCases = Annotated[
    list[float] | None,
    typer.Option(
        "--torque",
        help="Torque on the input gear [N\u00a0m]; may be repeated. [default: all "
        "load cases of the gear set]",
    ),
]
LoadCase = Annotated[
    float | None,
    typer.Option(
        "--torque",
        help="Torque on the input gear [N\u00a0m]. [default: middle load case of the "
        "gear set]",
    ),
]
SolvedPlane = Annotated[
    PlaneChoice | None,
    typer.Option(
        "--plane",
        help="Plane stress or plane strain of the finite elements. [default: stress]",
    ),
]
SweepDirection = Annotated[
    DirectionChoice,
    typer.Option(
        "--direction",
        help="Whether the speed rises, falls, or first rises and then falls.",
    ),
]
Tolerance = Annotated[
    float,
    typer.Option(
        "--tolerance",
        help="Relative settling tolerance: distance to the periodic motion over the "
        "range of the deflection.",
    ),
]
MaxPeriods = Annotated[
    int | None,
    typer.Option(
        "--max-periods",
        help="Periods of the first mesh after which a motion that has not settled "
        "counts as aperiodic. [default: what the damping needs, 2000 or more]",
    ),
]


@dataclass(frozen=True, kw_only=True)
class Elements:
    """Plane state and resolution of whatever finite elements are solved."""

    plane: SolvedPlane = None
    resolution: ResolutionChoice | None = option(
        "Fineness of the finite-element mesh and of the contact grid. [default: "
        "default]"
    )

    @property
    def given(self) -> dict[str, Any]:
        """By field of a source of stiffness, what was asked for."""
        asked = {"plane": self.plane, "resolution": self.resolution}
        return {name: each.value for name, each in asked.items() if each is not None}


@dataclass(frozen=True, kw_only=True)
class Train:
    """How a gear train is damped and whether its gears move on their bearings."""

    damping: Damping = None
    translations: Translations = False

    def __post_init__(self) -> None:
        if self.damping is not None:
            ok = 0.0 <= self.damping < 1.0
            require(ok, "--damping", self.damping, "allowed 0 to below 1")


@dataclass(frozen=True, kw_only=True)
class LumpedOptions:
    """A lumped model of a gear set, but for mesh tables that are given."""

    model: int = option(
        "Lumped model. 1: every tooth pair with its own stiffness and gap; 2: mean "
        "mesh stiffness, excited by the loaded static transmission error; 3: total "
        "mesh stiffness and no-load transmission error.",
        default=1,
    )
    train: Train
    excitation: ExcitationChoice | None = option(
        "Mesh stiffness over the mesh cycle. fe: tables solved by finite elements; "
        "rectangular, trapezoid, fourier: built from mean_stiffness_N_per_m, "
        "stiffness_variation and load_share of the gear set, what is missing from "
        "finite elements. [default: fe]"
    )
    ramp: float | None = option(
        "Length over which the stiffness of --excitation trapezoid rises and falls "
        "[base pitches]. [default: 0.1]"
    )
    harmonics: int | None = option(
        "Number of harmonics of the mesh frequency that --excitation fourier keeps. "
        "[default: 5]"
    )
    elements: Elements

    def __post_init__(self) -> None:
        require(self.model in (1, 2, 3), "--model", self.model, "allowed 1, 2 and 3")
        if self.kind != ExcitationChoice.trapezoid:
            refuse_idle("needs --excitation trapezoid", ramp=self.ramp)
        if self.kind != ExcitationChoice.fourier:
            refuse_idle("needs --excitation fourier", harmonics=self.harmonics)
        if self.ramp is not None:
            ok = 0.0 <= self.ramp <= 1.0
            require(ok, "--ramp", self.ramp, "allowed 0 to 1 base pitches")
        if self.harmonics is not None:
            ok = 1 <= self.harmonics <= HARMONICS_LIMIT
            limit = f"allowed 1 to {HARMONICS_LIMIT}"
            require(ok, "--harmonics", self.harmonics, limit)

    @property
    def kind(self) -> ExcitationChoice:
        return self.excitation or ExcitationChoice.fe

    def stiffness(self, gear_set: GearSet) -> Source | GivenTables:
        """Where the mesh stiffness comes from; refuses elements that nothing needs."""
        from fegear.excitation import Source

        shape: dict[str, Any] = {"ramp": self.ramp, "harmonics": self.harmonics}
        given = {name: each for name, each in shape.items() if each is not None}
        source = Source(kind=self.kind.value, **given, **self.elements.given)
        refuse_unused(self.elements, source.solves_elements(gear_set))
        return source

    def load(self, subject: EditedSet, torque: Any) -> tuple[GearSet, dict[str, Any]]:
        """The gear set as changed, and the changes, all of which the model reads.

        torque : as the option gives it
        """
        gear_set, changes = subject.load(torque=torque, damping=self.train.damping)
        figures = self.kind != ExcitationChoice.fe
        refuse_idle_edits(
            changes, translations=self.train.translations, figures=figures
        )
        return gear_set, changes

    def lumped_model(self, gear_set: GearSet) -> LumpedModel:
        from fegear.lumped_system import LumpedModel

        return LumpedModel(
            number=self.model,
            translations=self.train.translations,
            damping_ratio=self.train.damping,
            stiffness=self.stiffness(gear_set),
        )


@dataclass(frozen=True, kw_only=True)
class TabledOptions(LumpedOptions):
    """A lumped model of a gear set, or of mesh tables that are given."""

    table: list[Path] | None = option(
        "Mesh table (CSV) in place of finite elements; give one for each mesh, in "
        "order."
    )

    def __post_init__(self) -> None:
        if self.table:
            given = {"excitation": self.excitation, **self.elements.given}
            refuse_idle("--table replaces it, leave it out", **given)
        super().__post_init__()

    def stiffness(self, gear_set: GearSet) -> Source | GivenTables:
        from fegear.excitation import read_mesh_tables

        if not self.table:
            return super().stiffness(gear_set)
        try:
            return read_mesh_tables(self.table, gear_set)
        except InputError as error:
            raise InputError(f"--table: {error}") from None


def refuse_unused(elements: Elements, used: bool) -> None:
    """Refuse options of finite elements where none are solved."""
    if not used:
        reason = "the gear set gives all stiffness figures, nothing is solved"
        refuse_idle(reason, **elements.given)


@dataclass(frozen=True, kw_only=True)
class Integration:
    """Time integration of lumped models."""

    steps: int | None = option(
        "Least number of time steps per period of the fastest mesh, with --method "
        "rk4. [default: 64]"
    )
    method: MethodChoice = option(
        "Time integration. rk4: fixed steps of fourth order; dopri5: adaptive steps "
        "of fifth order that end on every change of contact.",
        default=MethodChoice.rk4,
    )
    tolerance: Tolerance = 1e-4
    max_periods: MaxPeriods = None

    @property
    def settings(self) -> Settings:
        """Numerical choices; InputError names the option."""
        from lumped.settings import Settings

        if self.method != MethodChoice.rk4:
            refuse_idle(f"{self.method} chooses its own steps", steps=self.steps)
        given = {} if self.steps is None else {"steps": self.steps}
        return settings_of(
            Settings,
            method=self.method.value,
            tolerance=self.tolerance,
            max_periods=self.max_periods,
            **given,
        )


def settings_of(kind: Any, **values: Any) -> Any:
    """Settings of either driver; their ValueError names a field, ours the option."""
    try:
        return kind(**values)
    except ValueError as error:
        name, _, rest = str(error).partition(" ")
        raise InputError(f"--{name.replace('_', '-')} {rest}") from None


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


def chosen_torques(gear_set: GearSet, given: Sequence[float]) -> tuple[float, ...]:
    """Torques on the input gear [N m]: given, or the gear set's load cases."""
    from fegear.train import input_torques

    for value in given:
        ok = value == 0.0 or 1e-6 <= value < 1e9
        allowed = "must be 0, or at least 1e-6 and below 1e9 N m, on the input gear"
        require(ok, "--torque", value, allowed)
    require_once("--torque", given)
    torques = tuple(given) or input_torques(gear_set)
    if not torques:
        raise InputError(f"--torque is missing; {gear_set.name} has no load case")
    return torques


def middle_torque(gear_set: GearSet, given: float | None) -> float:
    """The given torque on the input gear, or the middle one of the load cases."""
    torques = chosen_torques(gear_set, [] if given is None else [given])
    return torques[len(torques) // 2]
