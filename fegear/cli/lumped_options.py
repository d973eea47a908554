"""Options of the commands of lumped models, and their checks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fegear.cli.options import (
    PlaneChoice,
    ResolutionChoice,
    refuse_idle,
    require,
    require_once,
)
from fegear.errors import InputError
from fegear.printable import printable

if TYPE_CHECKING:
    from fegear.gearset.model import GearSet
    from lumped.settings import Settings

HARMONICS_LIMIT = 1000
RAMP, HARMONICS, STEPS = 0.1, 5, 64  # where the options are not given


class ExcitationChoice(StrEnum):
    fe = "fe"
    rectangular = "rectangular"
    trapezoid = "trapezoid"
    fourier = "fourier"


class MethodChoice(StrEnum):
    rk4 = "rk4"
    dopri5 = "dopri5"


Model = Annotated[
    int,
    typer.Option(
        "--model",
        help="Lumped model. 1: every tooth pair with its own stiffness and gap; "
        "2: mean mesh stiffness, excited by the loaded static transmission error; "
        "3: total mesh stiffness and no-load transmission error.",
    ),
]
Damping = Annotated[
    float | None,
    typer.Option(
        "--damping",
        help="Damping ratio of every vibration mode. [default: that of the gear set, "
        "else 0.04]",
    ),
]
Translations = Annotated[
    bool,
    typer.Option(
        "--translations",
        help="Let gears with bearing stiffnesses move in the plane, not rotate only.",
    ),
]
Excitation = Annotated[
    ExcitationChoice | None,
    typer.Option(
        "--excitation",
        help="Mesh stiffness over the mesh cycle. fe: tables solved by finite "
        "elements; rectangular, trapezoid, fourier: built from "
        "mean_stiffness_N_per_m, stiffness_variation and load_share of the gear "
        "set, what is missing from finite elements. [default: fe]",
    ),
]
Ramp = Annotated[
    float | None,
    typer.Option(
        "--ramp",
        help="Length over which the stiffness of --excitation trapezoid rises and "
        f"falls [base pitches]. [default: {RAMP:g}]",
    ),
]
Harmonics = Annotated[
    int | None,
    typer.Option(
        "--harmonics",
        help="Number of harmonics of the mesh frequency that --excitation fourier "
        f"keeps. [default: {HARMONICS}]",
    ),
]
Tables = Annotated[
    list[Path] | None,
    typer.Option(
        "--table",
        help="Mesh table (CSV) in place of finite elements; give one for each mesh, "
        "in order.",
    ),
]
SolvedPlane = Annotated[
    PlaneChoice | None,
    typer.Option(
        "--plane",
        help="Plane stress or plane strain of the finite elements. [default: stress]",
    ),
]
SolvedResolution = Annotated[
    ResolutionChoice | None,
    typer.Option(
        "--resolution",
        help="Fineness of the finite-element mesh and of the contact grid. "
        "[default: default]",
    ),
]
Steps = Annotated[
    int | None,
    typer.Option(
        "--steps",
        help="Least number of time steps per period of the fastest mesh, with "
        f"--method rk4. [default: {STEPS}]",
    ),
]
Method = Annotated[
    MethodChoice,
    typer.Option(
        "--method",
        help="Time integration. rk4: fixed steps of fourth order; dopri5: adaptive "
        "steps of fifth order that end on every change of contact.",
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


@dataclass(frozen=True, kw_only=True)
class Physics:
    """The model that a command was asked for, checked; None is the default."""

    model: int = 1
    translations: bool = False
    damping: float | None = None
    excitation: ExcitationChoice | None = None
    ramp: float | None = None
    harmonics: int | None = None
    tables: tuple[Path, ...] = ()
    plane: PlaneChoice | None = None
    resolution: ResolutionChoice | None = None

    def __post_init__(self) -> None:
        require(self.model in (1, 2, 3), "--model", self.model, "allowed 1, 2 and 3")
        if self.damping is not None:
            ok = 0.0 <= self.damping < 1.0
            require(ok, "--damping", self.damping, "allowed 0 to below 1")
        if self.tables:
            given = {"excitation": self.excitation, **self.elements}
            refuse_idle("--table replaces it, leave it out", **given)
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
    def elements(self) -> dict[str, Any]:
        """What was asked of the finite elements, by option."""
        return {"plane": self.plane, "resolution": self.resolution}

    @property
    def kind(self) -> ExcitationChoice:
        return self.excitation or ExcitationChoice.fe

    @property
    def shape(self) -> dict[str, Any]:
        """Figures of an analytic stiffness: base pitches, number of harmonics."""
        return {
            "ramp": RAMP if self.ramp is None else self.ramp,
            "harmonics": HARMONICS if self.harmonics is None else self.harmonics,
        }

    @property
    def source(self) -> str:
        """Where the stiffness comes from, in words."""
        if self.tables:
            return printable(f"tables {', '.join(path.name for path in self.tables)}")
        return {
            "fe": "finite elements",
            "rectangular": "rectangular",
            "trapezoid": f"trapezoid, ramp {self.shape['ramp']:g} base pitches",
            "fourier": f"fourier, {self.shape['harmonics']} harmonics",
        }[self.kind]


def checked_settings(
    method: MethodChoice, steps: int | None, tolerance: float, max_periods: int | None
) -> Settings:
    """Numerical choices; InputError names the option."""
    from lumped.settings import Settings

    if method != MethodChoice.rk4:
        refuse_idle(f"{method} chooses its own steps", steps=steps)
    return settings_of(
        Settings,
        method=method.value,
        steps=STEPS if steps is None else steps,
        tolerance=tolerance,
        max_periods=max_periods,
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
