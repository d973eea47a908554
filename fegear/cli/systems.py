"""From what a command was asked for to lumped systems of a gear set."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import typer

from fegear.cli.lumped_options import Physics
from fegear.cli.options import PlaneChoice, ResolutionChoice, refuse_idle
from fegear.cli.screen import complain
from fegear.errors import InputError
from fegear.output import read_text

if TYPE_CHECKING:
    from fegear.excitation import Excitations
    from fegear.gearset.model import GearSet
    from lumped.excitation import MeshExcitation
    from lumped.settings import Settings
    from lumped.system import LumpedSystem
    from lumped.table import MeshTable

COUPLED = 0.05  # of a mode's strain energy in meshes, to count for the usual speeds
USUAL_SPEEDS = 400  # at most, where none are given


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
            _require_all_pairs(gear_set, mesh, table)
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
            kind=physics.kind.value,
            plane=(physics.plane or PlaneChoice.stress).value,
            resolution=(physics.resolution or ResolutionChoice.default).value,
            **physics.shape,
        )
    )


def require_elements_used(physics: Physics, excitations: ExcitationSource) -> None:
    """Refuse options of finite elements where none have been solved."""
    from fegear.excitation import Excitations

    if not (isinstance(excitations, Excitations) and excitations.solved):
        reason = "the gear set gives all stiffness figures, nothing is solved"
        refuse_idle(reason, **physics.elements)


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


def _require_all_pairs(gear_set: GearSet, mesh: int, table: MeshTable) -> None:
    """A table stands for the teeth as they are, with their pitch errors."""
    from fegear.gearset.pitch_errors import tooth_pair_errors
    from lumped.excitation import table_pitches

    pairs, covered = tooth_pair_errors(gear_set, mesh).size, table_pitches(table)
    if pairs and covered != pairs:
        raise ValueError(
            f"base pitches = {covered}; tooth pairs of mesh {mesh + 1} repeat after "
            f"{pairs} for their pitch errors, a table over all of them is needed, or a "
            "gear set without pitch_errors_um"
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
    from fegear.version import package_version

    elements = {
        "plane": str(physics.plane or PlaneChoice.stress),
        "resolution": str(physics.resolution or ResolutionChoice.default),
    }
    return {
        "gear set": gear_set.name,
        "fegear version": package_version(),
        "excitation": physics.source,
        **({} if physics.tables else elements),
        "damping ratio": f"{damping:g}",
        "translations": "yes" if physics.translations else "no",
        "integration": integration,
        **_pitch_errors(gear_set),
    }


def _pitch_errors(gear_set: GearSet) -> dict[str, str]:
    """After how long tooth pairs repeat, where they differ."""
    from fegear.gearset.pitch_errors import error_periods

    periods = error_periods(gear_set)
    if max(periods) == 1:
        return {}
    words = ", ".join(f"{n} of mesh {m}" for m, n in enumerate(periods, start=1))
    return {"pitch errors": f"tooth pairs repeat after base pitches: {words}"}


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
