"""What the commands of lumped models share: options, and systems of gear sets."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Protocol

import typer

from fegear.cli.options import PlaneChoice, ResolutionChoice, require
from fegear.cli.screen import complain
from fegear.errors import InputError
from fegear.output import read_text
from fegear.printable import printable

if TYPE_CHECKING:
    from fegear.excitation import Excitations
    from fegear.gearset.model import GearSet
    from lumped.excitation import MeshExcitation
    from lumped.settings import Settings
    from lumped.system import LumpedSystem
    from lumped.table import MeshTable

SPEEDS_LIMIT = 100_000
COUPLED = 0.05  # of a mode's strain energy in meshes, to count for the usual speeds
USUAL_SPEEDS = 400  # at most, where none are given
HARMONICS_LIMIT = 1000


class ExcitationChoice(StrEnum):
    fe = "fe"
    rectangular = "rectangular"
    trapezoid = "trapezoid"
    fourier = "fourier"


class MethodChoice(StrEnum):
    rk4 = "rk4"
    dopri5 = "dopri5"


SetName = Annotated[
    str, typer.Argument(metavar="SET", help="Built-in gear set or path of one.")
]
Model = Annotated[
    int,
    typer.Option(
        help="1: every tooth pair with its gap; 2: mean stiffness and loaded "
        "transmission error; 3: total stiffness and no-load error."
    ),
]
Damping = Annotated[
    float | None,
    typer.Option(
        help="Damping ratio of every mode [default: the gear set's, or 0.04]."
    ),
]
Translations = Annotated[
    bool, typer.Option("--translations", help="Gears with bearings move in the plane.")
]
Excitation = Annotated[
    ExcitationChoice,
    typer.Option(
        help="fe: tables of the finite elements; else waves from the key figures of "
        "the gear set, or of its tables where it gives none."
    ),
]
Ramp = Annotated[
    float, typer.Option(help="Base pitches over which a trapezoid enters and leaves.")
]
Harmonics = Annotated[
    int, typer.Option(help="Of the mesh frequency, kept by excitation fourier.")
]
Tables = Annotated[
    list[Path] | None,
    typer.Option(
        "--table",
        help="Mesh table (CSV) in place of the finite elements, one per mesh in order.",
    ),
]
Plane = Annotated[
    PlaneChoice | None,
    typer.Option(
        help="Plane state of the finite elements "
        f"[default: {PlaneChoice.stress.value}].",
    ),
]
Resolution = Annotated[
    ResolutionChoice | None,
    typer.Option(
        help="Of the finite elements and the contact "
        f"[default: {ResolutionChoice.default.value}]."
    ),
]
Steps = Annotated[int, typer.Option(help="Of rk4, per period of the fastest mesh.")]
Method = Annotated[
    MethodChoice,
    typer.Option(help="rk4: fixed steps; dopri5: adaptive, contact changes located."),
]
Tolerance = Annotated[
    float,
    typer.Option(help="Distance to the periodic response, over its range, to stop at."),
]
MaxPeriods = Annotated[
    int | None,
    typer.Option(
        help="Of the first mesh, before a motion counts as aperiodic "
        "[default: what the damping needs, 2000 or more]."
    ),
]


Speeds = Annotated[
    str | None,
    typer.Option(
        metavar="A:B:STEP",
        help="Mesh frequencies of the first mesh [Hz]; a number or a list with "
        "commas as well [default: 0.5 to 1.3 times the resonances].",
    ),
]
LoadCases = Annotated[
    list[float] | None,
    typer.Option(
        "--torque",
        help="On the input gear [N m]; may be repeated "
        "[default: all load cases of the gear set].",
    ),
]
LoadCase = Annotated[
    float | None,
    typer.Option(
        "--torque",
        help="On the input gear [N m] "
        "[default: the middle one of the gear set's load cases].",
    ),
]
Output = Annotated[
    Path | None, typer.Option("-o", "--output", help="Write the numbers, CSV.")
]
Plot = Annotated[Path | None, typer.Option(help="Draw a picture, PNG.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print the summary as JSON.")]


@dataclass(frozen=True, kw_only=True)
class Physics:
    """The model that a command was asked for, checked."""

    model: int
    translations: bool
    damping: float | None
    excitation: str = "fe"
    ramp: float = 0.1
    harmonics: int = 5
    tables: tuple[Path, ...] = ()
    plane: PlaneChoice | None = None
    resolution: ResolutionChoice | None = None

    def __post_init__(self) -> None:
        require(self.model in (1, 2, 3), "--model", self.model, "allowed 1, 2 and 3")
        if self.damping is not None:
            ok = 0.0 <= self.damping < 1.0
            require(ok, "--damping", self.damping, "allowed 0 to below 1")
        ok = 0.0 <= self.ramp <= 1.0
        require(ok, "--ramp", self.ramp, "allowed 0 to 1 base pitches")
        ok = 1 <= self.harmonics <= HARMONICS_LIMIT
        limit = f"allowed 1 to {HARMONICS_LIMIT}"
        require(ok, "--harmonics", self.harmonics, limit)
        if self.tables and self.excitation != ExcitationChoice.fe:
            raise InputError(
                f"--table and --excitation {self.excitation} exclude each other"
            )
        if self.tables and self.elements:
            raise InputError(
                f"--table and {self.elements} exclude each other; the tables were "
                "solved elsewhere"
            )

    @property
    def elements(self) -> str:
        """What was asked of the finite elements, as options."""
        given = {"--plane": self.plane, "--resolution": self.resolution}
        return " ".join(f"{key} {value}" for key, value in given.items() if value)

    @property
    def source(self) -> str:
        """Where the stiffness comes from, in words."""
        if self.tables:
            return printable(f"tables {', '.join(path.name for path in self.tables)}")
        extra = {
            "trapezoid": f", ramp {self.ramp:g} base pitches",
            "fourier": f", {self.harmonics} harmonics",
        }
        return {"fe": "finite elements"}.get(
            self.excitation, str(self.excitation)
        ) + extra.get(self.excitation, "")


class ExcitationSource(Protocol):
    """Excitations of meshes by their index, at a torque on their drivers [N m]."""

    def of(
        self, gear_set: GearSet, mesh: int, torque: float, model: int
    ) -> MeshExcitation: ...


@dataclass(frozen=True)
class TableExcitations:
    """Mesh tables that were read from files, one for each mesh."""

    tables: tuple[tuple[str, MeshTable], ...]

    def of(
        self, gear_set: GearSet, mesh: int, torque: float, model: int
    ) -> MeshExcitation:
        from lumped.excitation import excitation_from_table

        name, table = self.tables[mesh]
        try:
            return excitation_from_table(table, torque, model)
        except ValueError as error:
            raise InputError(f"{name}: {error}") from None


def excitations_of(physics: Physics, gear_set: GearSet) -> ExcitationSource:
    """Tables from files, or what `fegear.excitation` makes; nothing is solved yet."""
    if physics.tables:
        return TableExcitations(_read_tables(physics.tables, gear_set))
    return solved_excitations(physics)


def solved_excitations(physics: Physics) -> Excitations:
    """Of finite elements in the plane state and resolution that were asked for."""
    from fegear.excitation import Excitations, Source

    return Excitations(
        Source(
            kind=physics.excitation,  # type: ignore[arg-type]
            ramp=physics.ramp,
            harmonics=physics.harmonics,
            plane=(physics.plane or PlaneChoice.stress).value,
            resolution=(physics.resolution or ResolutionChoice.default).value,
        )
    )


def require_elements_used(physics: Physics, excitations: ExcitationSource) -> None:
    """Refuse options of finite elements where none have been solved."""
    from fegear.excitation import Excitations

    solved = isinstance(excitations, Excitations) and excitations.solved
    if physics.elements and not solved:
        raise InputError(
            f"{physics.elements}; changes nothing, the gear set gives all stiffness "
            "figures and no finite elements are solved, leave it out"
        )


def _read_tables(
    paths: Sequence[Path], gear_set: GearSet
) -> tuple[tuple[str, MeshTable], ...]:
    from lumped.table import TableError, parse_table

    meshes = len(gear_set.meshes)
    if len(paths) != meshes:
        raise InputError(
            f"--table is given {len(paths)} times; {gear_set.name} has {meshes} "
            "meshes, one table for each is needed"
        )
    found = []
    for path in paths:
        try:
            found.append((str(path), parse_table(read_text(path), str(path))))
        except TableError as error:
            raise InputError(f"--table {error}") from None
    for number, (name, table) in enumerate(found):
        _require_own_table(name, table, gear_set, number)
    return tuple(found)


def _require_own_table(
    name: str, table: MeshTable, gear_set: GearSet, mesh: int
) -> None:
    """A table that names its teeth must be of this mesh."""
    pair = gear_set.meshes[mesh].pair
    own = f"{pair.driver.teeth} / {pair.driven.teeth}"
    if table.header.get("teeth", own) != own:
        raise InputError(
            f"--table {name}: of teeth {table.header['teeth']}, but mesh {mesh + 1} of "
            f"{gear_set.name} has {own}"
        )


def build_system(
    gear_set: GearSet,
    torque: float,
    model: int,
    translations: bool,
    damping: float | None,
    excitations: ExcitationSource,
) -> LumpedSystem:
    """The lumped system at a torque on the input gear [N m]."""
    from fegear.train import mesh_torques_at, train_of
    from lumped.system import LumpedSystem
    from lumped.train import TrainError

    train = train_of(gear_set, torque, translations, damping)
    on_meshes = mesh_torques_at(gear_set, torque)
    driven = tuple(
        excitations.of(gear_set, mesh, on_meshes[mesh], model)
        for mesh in range(len(on_meshes))
    )
    try:
        return LumpedSystem(train, driven)
    except TrainError as error:
        raise InputError(f"{gear_set.name}: {error}") from None


def system_at(
    gear_set: GearSet, torque: float, physics: Physics, excitations: ExcitationSource
) -> LumpedSystem:
    """As `build_system`, with what a command was asked for."""
    return build_system(
        gear_set,
        torque,
        physics.model,
        physics.translations,
        physics.damping,
        excitations,
    )


def checked_settings(
    method: str, steps: int, tolerance: float, max_periods: int | None
) -> Settings:
    """Numerical choices; InputError names the option."""
    from lumped.settings import Settings

    try:
        return Settings(
            method=method, steps=steps, tolerance=tolerance, max_periods=max_periods
        )
    except ValueError as error:
        raise InputError(f"--{str(error).replace('_', '-')}") from None


def chosen_torques(gear_set: GearSet, given: Sequence[float]) -> tuple[float, ...]:
    """Torques on the input gear [N m]: given, or the gear set's load cases."""
    from fegear.train import input_torques

    for value in given:
        ok = 0.0 <= value < 1e9
        require(ok, "--torque", value, "must be 0 or more, on the input gear [N m]")
    torques = tuple(dict.fromkeys(given)) or input_torques(gear_set)
    if not torques:
        raise InputError(f"--torque is missing; {gear_set.name} names no load")
    return torques


def middle_torque(gear_set: GearSet, given: float | None) -> float:
    """The given torque on the input gear, or the middle one of the load cases."""
    torques = chosen_torques(gear_set, [] if given is None else [given])
    return torques[len(torques) // 2]


def parsed_speeds(text: str, option: str = "--speeds") -> list[float]:
    """Speeds [Hz, or rpm] from `A:B:STEP`, single numbers and commas between."""
    speeds: list[Decimal] = []
    for part in text.split(","):
        speeds += _speed_range(part.strip(), text, option)
    return [float(speed) for speed in dict.fromkeys(speeds)]


def _speed_range(part: str, text: str, option: str) -> list[Decimal]:
    """Decimals, so that 0.1 added ten times is 1."""
    try:
        numbers = [Decimal(number) for number in part.split(":")]
    except InvalidOperation:
        numbers = []
    if len(numbers) not in (1, 3) or not all(n.is_finite() for n in numbers):
        raise InputError(
            f"{option} = {text}; allowed A:B:STEP, a number, or several with commas, "
            "such as 800:4200:20"
        )
    start, end, step = (
        numbers if len(numbers) == 3 else (*numbers, *numbers, Decimal(1))
    )
    for speed in (start, end, step):
        ok = Decimal(0) < speed < Decimal(10) ** 9
        require(
            ok, option, float(speed), "speeds and step must be above 0 and below 1e9"
        )
    count = abs(end - start) / step
    ok = count < SPEEDS_LIMIT
    require(ok, option, float(count), f"at most {SPEEDS_LIMIT} speeds are allowed")
    sign = 1 if end >= start else -1
    return [start + sign * i * step for i in range(int(count) + 1)]


def usual_speeds(system: LumpedSystem) -> list[float]:
    """From 0.5 to 1.3 times the resonances that meshes excite, in round steps.

    Those are natural frequencies of modes with a twentieth or more of their strain
    energy in the meshes, for every mesh as frequencies of the first [Hz].
    """
    modes = system.modes
    coupled = modes.frequency_Hz[modes.mesh_energy.sum(axis=0) >= COUPLED]
    if not coupled.size:
        raise InputError("--speeds is missing; no mode strains the meshes enough")
    rates = [float(rate) for rate in system.train.mesh_rates]
    low = 0.5 * float(coupled.min()) / max(rates)
    high = 1.3 * float(coupled.max()) / min(rates)
    step = _round_up((high - low) / USUAL_SPEEDS)
    first, last = max(1, math.floor(low / step)), math.ceil(high / step)
    return [float(Decimal(repr(step)) * i) for i in range(first, last + 1)]


def _round_up(value: float) -> float:
    """The next number of 1, 2 or 5 times a power of ten."""
    power = 10.0 ** math.floor(math.log10(value))
    factor = next(f for f in (1.0, 2.0, 5.0, 10.0) if f * power >= value * (1 - 1e-9))
    return float(f"{factor * power:.1g}")


def natural_lines(system: LumpedSystem) -> list[float]:
    """Natural frequencies of the modes that strain a mesh [Hz]."""
    return [float(f) for f in system.modes.frequency_Hz[system.moving]]


def file_header(
    gear_set: GearSet, physics: Physics, integration: str, damping: float
) -> dict[str, str]:
    """Entries that say how a file came about; nothing that differs between runs."""
    from importlib.metadata import PackageNotFoundError, version

    try:
        own = version("fegear")
    except PackageNotFoundError:
        own = "unknown"
    elements = (
        {}
        if physics.tables
        else {
            "plane": str(physics.plane or PlaneChoice.stress),
            "resolution": str(physics.resolution or ResolutionChoice.default),
        }
    )
    return {
        "gear set": gear_set.name,
        "fegear version": own,
        "excitation": physics.source,
        **elements,
        "damping ratio": f"{damping:g}",
        "translations": "yes" if physics.translations else "no",
        "integration": integration,
    }


def integration_in_words(settings: Settings) -> str:
    marching = f"{settings.method}, tolerance {settings.tolerance:g}"
    if settings.method == "rk4":
        marching += f", {settings.steps} steps per period or more"
    return f"{marching}, up to {most_in_words(settings.max_periods)}"


def most_in_words(max_periods: int | None) -> str:
    return "what the damping needs" if max_periods is None else f"{max_periods} periods"


@contextmanager
def one_line_failure() -> Iterator[None]:
    """A motion that diverged ends with one line and exit code 1."""
    from lumped.motion import DivergedError

    try:
        yield
    except DivergedError as error:
        complain(str(error))
        raise typer.Exit(1) from None
