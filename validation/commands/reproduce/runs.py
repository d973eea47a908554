"""Figures as they are computed: every part is kept, and found again by hash.

A part's directory below the store holds curves.csv with all that is drawn of it,
result.json with what it found, and inputs.json; see `validation.study.run_store`.
"""

from __future__ import annotations

import json
import math
import shlex
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import groupby
from pathlib import Path
from typing import Any

from fegear.files.contents import exact_repr
from fegear.files.kept import directory_of_inputs
from fegear.files.version import package_version
from lumped.common.csv_text import format_csv, parse_csv
from lumped.common.progress import Progress, silent
from validation.commands.reproduce.comparison import ReferenceCheck, compare
from validation.commands.reproduce.computations.kinds import COMPUTE
from validation.commands.reproduce.parts import Curve, Part, PartResult
from validation.commands.reproduce.source_figures import AnyScene, SourceFigure
from validation.study.provenance import machine
from validation.study.run_store import (
    RESULT,
    read_or_compute,
    read_texts,
    run_contents,
)
from validation.study.sources import digest_of

FORMAT = "fegear reproduce part 3"  # of the files and of their content
CURVES = "curves.csv"
COLUMNS = ("mesh", "panel", "curve", "style", "x", "y", "value")


@dataclass(frozen=True)
class PartRun:
    """A part with what it gave.

    reused : whether nothing was computed; seconds : that it took when it was
    commands : that compute the same alone, empty if none does
    no_command : why there are none
    """

    part: Part
    directory: Path
    reused: bool
    seconds: float
    machine: str
    commands: tuple[str, ...]
    no_command: str
    result: PartResult


@dataclass(frozen=True)
class FigureResult:
    """A figure with the runs of its parts."""

    figure: SourceFigure
    runs: tuple[PartRun, ...]

    @property
    def curves(self) -> tuple[Curve, ...]:
        """Curves that are shown, with the words of their parts."""
        meshes = self.figure.meshes
        return tuple(
            replace(
                curve,
                panel=_joined_texts(run.part.panel, curve.panel),
                label=_joined_texts(run.part.label, curve.label),
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
    def compared(self) -> tuple[ReferenceCheck, ...]:
        """Every reference and what its part found."""
        results = {run.part.own_name: run.result for run in self.runs}
        judged = not self.figure.is_quick
        return tuple(
            compare(reference, results, judged) for reference in self.figure.printed
        )


def _joined_texts(*texts: str) -> str:
    return ", ".join(filter(None, texts))


def run_figure(
    figure: SourceFigure,
    store: Path,
    report: Progress = silent,
) -> FigureResult:
    """Compute the parts that the store does not hold yet.

    Raises InputError for a gear set or a store that cannot be used; after
    KeyboardInterrupt the finished parts stay in the store.
    """

    def part_progress(place: int) -> Progress:
        count = len(figure.part)
        return lambda stage, done, total: report(
            f"{figure.number} ({place} of {count}): {stage}", done, total
        )

    return FigureResult(
        figure,
        tuple(
            _run_part(part, figure.scene(part), store, part_progress(place))
            for place, part in enumerate(figure.part, start=1)
        ),
    )


def inputs_of(part: Part, scene: AnyScene) -> dict[str, str]:
    """All that determines a part's result."""
    return {
        "format": FORMAT,
        "fegear version": package_version(),
        "sources": digest_of(__name__, COMPUTE[type(part)].__module__),
        "part": exact_repr(
            replace(part, name="", label="", panel="", y="", shown=True)
        ),
        **scene.inputs,
    }


def find_figure(figure: SourceFigure, store: Path) -> FigureResult | None:
    """A figure of which the store holds every part, None if one is missing."""
    scenes = [(part, figure.scene(part)) for part in figure.part]
    stored = [
        _read_run(part, scene, *_directory_and_inputs(part, scene, store), reused=True)
        for part, scene in scenes
    ]
    runs = tuple(run for run in stored if run is not None)
    return FigureResult(figure, runs) if len(runs) == len(stored) else None


def _directory_and_inputs(
    part: Part, scene: AnyScene, store: Path
) -> tuple[Path, dict[str, str]]:
    """Directory of a part, and its inputs."""
    inputs = inputs_of(part, scene)
    return directory_of_inputs(store, vars(part)["kind"], inputs), inputs


def _run_part(part: Part, scene: AnyScene, store: Path, report: Progress) -> PartRun:
    directory, inputs = _directory_and_inputs(part, scene, store)
    read = partial(_read_run, part, scene, directory, inputs)
    compute = partial(_computed_files, part, scene, inputs, report)
    return read_or_compute(directory, (CURVES,), read, compute, subject="it")


def _computed_files(
    part: Part, scene: AnyScene, inputs: Mapping[str, str], report: Progress
) -> dict[str, bytes]:
    """The files of a part by name."""
    begin = time.perf_counter()
    result = COMPUTE[type(part)](part, scene, report)
    values = {
        "seconds": time.perf_counter() - begin,
        "machine": machine(),
        "commands": [
            shlex.join(("fegear", *argv)) for argv in commands_of(part, scene)
        ],
        "found": {name: list(quantity) for name, quantity in result.values.items()},
    }
    return run_contents(inputs, {CURVES: curves_csv(result.curves)}, values)


def commands_of(part: Part, scene: AnyScene) -> list[Sequence[str]]:
    """Words after `fegear` that compute a part, empty where there are none.

    The last command computes the part; those before it make the mesh tables it reads.
    """
    argv = () if scene.no_commands else part.command(scene)
    return [*scene.table_commands(), argv] if argv else []


def _read_run(
    part: Part,
    scene: AnyScene,
    directory: Path,
    inputs: Mapping[str, str],
    reused: bool,
) -> PartRun | None:
    texts = read_texts(directory, inputs, (CURVES,))
    if texts is None:
        return None
    values: dict[str, Any] = json.loads(texts[RESULT])
    quantities = {
        name: tuple(tuple(v) if isinstance(v, list) else v for v in entries)
        for name, entries in values["found"].items()
    }
    commands = tuple(values["commands"])
    return PartRun(
        part=part,
        directory=directory,
        reused=reused,
        seconds=values["seconds"],
        machine=values["machine"],
        commands=commands,
        no_command="" if commands else scene.no_commands or part.no_command,
        result=PartResult(read_curves(texts[CURVES]), quantities),
    )


def curves_csv(curves: Sequence[Curve], columns: Sequence[str] = COLUMNS) -> str:
    """A row for every point; an empty cell parts stretches of a curve."""
    rows = (
        (c.mesh, c.panel, c.label, c.style, *point, *[math.nan] * (3 - len(point)))
        for c in curves
        for point in c.points
    )
    return format_csv(columns, rows)


def read_curves(text: str) -> tuple[Curve, ...]:
    rows = parse_csv(text, CURVES).rows.values()
    curves = []
    for start, group in groupby(rows, lambda row: tuple(row[:4])):
        mesh, panel, label, style = start
        count = 3 if style == "surface" else 2
        points = tuple(
            tuple(float(cell) if cell else math.nan for cell in row[4 : 4 + count])
            for row in group
        )
        curves.append(Curve(style, points, int(mesh), panel, label))
    return tuple(curves)
