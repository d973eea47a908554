"""Figures as they are computed: every part is kept, and found again by hash.

A part's directory below the store holds inputs.json, curves.csv with all that is drawn
of it, and result.json with what it found; see `validation.kept`.
"""

from __future__ import annotations

import json
import math
import shlex
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path
from typing import Any

import fegear
import validation
from fegear.errors import InputError
from fegear.output import make_directory
from fegear.statics import Progress
from fegear.store import digest
from fegear.version import package_version
from lumped.csv_text import format_csv, parse_csv
from validation.kept import (
    RESULT,
    begin_run,
    sealed,
    whole_texts,
    write_texts,
)
from validation.printed import nearest
from validation.provenance import machine
from validation.reproduce.computations.kinds import COMPUTE
from validation.reproduce.parts import Curve, Part, PartResult
from validation.reproduce.source_figures import AnyScene, Printed, SourceFigure
from validation.tasks import PACKAGES, digest_of

FORMAT = "fegear reproduce part 1"  # of the files and of what stands in them
CURVES = "curves.csv"
COLUMNS = ("mesh", "panel", "curve", "style", "x", "y", "value")
SOURCES = {
    **PACKAGES,
    fegear: (
        *PACKAGES[fegear],
        *("branches.py", "theory.py", "theory_figure.py", "waves.py"),
        *("rattle/*.py", "rattle/machines/*.toml"),
        *("dynamic_sweeps.py", "modes.py", "bifurcations.py", "parameter_maps.py"),
    ),
    validation: (
        "kept.py",
        "reproduce/parts.py",
        "reproduce/*scene.py",
        "reproduce/computations/*.py",
    ),
}


@dataclass(frozen=True)
class PartRun:
    """A part with what it gave.

    reused : whether nothing was computed; seconds : that it took when it was
    commands : that compute the same alone, none where there are none
    """

    part: Part
    directory: Path
    reused: bool
    seconds: float
    machine: str
    commands: tuple[str, ...]
    result: PartResult


@dataclass(frozen=True)
class Compared:
    """A printed value beside the computed one, NaN where there is none."""

    printed: Printed
    computed: float

    @property
    def apart(self) -> float:
        """Difference over the printed value, NaN where that is 0."""
        value = self.printed.value
        return (self.computed - value) / abs(value) if value else math.nan

    @property
    def line(self) -> str:
        """`jump down: computed 0.81, printed 0.8, 1.2 % apart: why`."""
        given = self.printed
        unit = "" if given.unit == "1" else f" {given.unit}"
        why = f": {given.why}" if given.why else ""
        if math.isnan(self.computed):
            return f"{given.quantity}: printed {given.value:g}{unit}, none found{why}"
        apart = f", {100.0 * abs(self.apart):.2g} % apart" if given.value else ""
        return (
            f"{given.quantity}: computed {self.computed:.4g}{unit}, printed "
            f"{given.value:g}{unit}{apart}{why}"
        )


@dataclass(frozen=True)
class FigureResult:
    """A figure with the runs of its parts."""

    figure: SourceFigure
    runs: tuple[PartRun, ...]

    @property
    def curves(self) -> tuple[Curve, ...]:
        """Those that are shown, with the words of their parts."""
        meshes = self.figure.meshes
        return tuple(
            replace(
                curve,
                panel=_joined(run.part.panel, curve.panel),
                label=_joined(run.part.label, curve.label),
            )
            for run in self.runs
            if run.part.shown
            for curve in run.result.curves
            if curve.mesh in (0, *meshes)
        )

    @property
    def seconds(self) -> float:
        return sum(run.seconds for run in self.runs)

    @property
    def compared(self) -> tuple[Compared, ...]:
        """Every printed value beside the nearest that its part found."""
        results = {run.part.own_name: run.result for run in self.runs}
        return tuple(
            Compared(
                each, compared_value(results[each.part].found.get(each.found, ()), each)
            )
            for each in self.figure.printed
        )


def _joined(*words: str) -> str:
    return ", ".join(filter(None, words))


def compared_value(values: Sequence[float], printed: Printed) -> float:
    """A single value as it is; of several the nearest, if it is the same thing."""
    return values[0] if len(values) == 1 else nearest(values, printed.value)


def run_figure(
    figure: SourceFigure,
    store: Path,
    report: Progress = lambda what, done, total: None,
) -> FigureResult:
    """Compute the parts that the store does not hold yet.

    Raises InputError for a gear set or a store that cannot be used; after
    KeyboardInterrupt the finished parts stay in the store.
    """

    def of(place: int) -> Progress:
        count = len(figure.part)
        return lambda what, done, total: report(
            f"{figure.number} ({place} of {count}): {what}", done, total
        )

    return FigureResult(
        figure,
        tuple(
            _found_or_made(part, figure.scene(part), store, of(place))
            for place, part in enumerate(figure.part, start=1)
        ),
    )


def inputs_of(part: Part, scene: AnyScene) -> dict[str, str]:
    """All that determines a part's result."""
    return {
        "format": FORMAT,
        "fegear version": package_version(),
        "sources": digest_of(tuple(SOURCES.items())),
        "part": repr(replace(part, name="", label="", panel="", y="", shown=True)),
        **scene.inputs,
    }


def _found_or_made(
    part: Part, scene: AnyScene, store: Path, report: Progress
) -> PartRun:
    inputs = inputs_of(part, scene)
    name = f"{vars(part)['kind']}-{digest(inputs)[:16]}"
    directory = make_directory(store / name)
    found = _read(part, scene, directory, inputs, reused=True)
    if found is not None:
        return found
    begin_run(directory, inputs, (CURVES,))
    begin = time.perf_counter()
    result = COMPUTE[type(part)](part, scene, report)
    values = {
        "seconds": time.perf_counter() - begin,
        "machine": machine(),
        "commands": [
            shlex.join(("fegear", *words)) for words in commands_of(part, scene)
        ],
        "found": {name: list(found) for name, found in result.found.items()},
    }
    texts = {CURVES: curves_csv(result.curves)}
    write_texts(directory, sealed(inputs, texts, values))
    made = _read(part, scene, directory, inputs, reused=False)
    if made is None:
        raise InputError(f"{directory}: was changed while it was made; run again")
    return made


def commands_of(part: Part, scene: AnyScene) -> list[Sequence[str]]:
    """Words after `fegear` that compute a part, empty where there are none.

    The last command does, those before it make the mesh tables that it reads.
    """
    words = part.command(scene) if scene.has_commands else ()
    return [*scene.table_commands(), words] if words else []


def _read(
    part: Part,
    scene: AnyScene,
    directory: Path,
    inputs: Mapping[str, str],
    reused: bool,
) -> PartRun | None:
    texts = whole_texts(directory, inputs, (CURVES,))
    if texts is None:
        return None
    values: dict[str, Any] = json.loads(texts[RESULT])
    found = {name: tuple(each) for name, each in values["found"].items()}
    return PartRun(
        part=part,
        directory=directory,
        reused=reused,
        seconds=values["seconds"],
        machine=values["machine"],
        commands=tuple(values["commands"]),
        result=PartResult(read_curves(texts[CURVES]), found),
    )


def curves_csv(curves: Sequence[Curve]) -> str:
    """A row for every point; an empty cell parts stretches of a curve."""
    rows = (
        (c.mesh, c.panel, c.label, c.style, *point, *[math.nan] * (3 - len(point)))
        for c in curves
        for point in c.points
    )
    return format_csv(COLUMNS, rows)


def read_curves(text: str) -> tuple[Curve, ...]:
    rows = parse_csv(text, CURVES).rows.values()
    found = []
    for start, group in groupby(rows, lambda row: tuple(row[:4])):
        mesh, panel, label, style = start
        count = 3 if style == "surface" else 2
        points = tuple(
            tuple(float(cell) if cell else math.nan for cell in row[4 : 4 + count])
            for row in group
        )
        found.append(Curve(style, points, int(mesh), panel, label))
    return tuple(found)
