"""Figures and tables of the sources: what is computed, and what is printed.

A figure is a TOML file named after its number; they are in `figures/`.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, fields
from functools import cache
from pathlib import Path
from typing import Annotated, ClassVar, Literal

from pydantic import AfterValidator, Field

from fegear.files.errors import InputError
from fegear.files.output import read_text
from fegear.gearset.problems import nearest
from validation.commands.reproduce.computations.kinds import KINDS, AnyPart
from validation.commands.reproduce.machine_scene import MachineScene
from validation.commands.reproduce.parts import Part, Quantity, TrainOverrides
from validation.commands.reproduce.readings import required_names
from validation.commands.reproduce.references import Reference
from validation.commands.reproduce.scene import NoScene, Scene, scene_of
from validation.study.data_files import STRICT, DataFile, Flag, Text, edits_by_key

AnyScene = Scene | MachineScene | NoScene
FOLDER = Path(__file__).with_name("figures")
LEFT_OUT = FOLDER.parent / "left_out_figures.toml"
NUMBER = re.compile(r"(rattle-)?(table-)?(\d)\.(\d+)([a-z]?)")
SHORT_SOURCES = re.compile(
    r"(eccentric|clatter)-(\d+)([a-z]?)"
)  # of sources without chapters
ORDER = ("", "rattle-", "eccentric", "clatter")  # of the sources


def _require_number(text: str) -> str:
    if not (NUMBER.fullmatch(text) or SHORT_SOURCES.fullmatch(text)):
        raise ValueError(
            "must be a number such as 3.6, 3.14a, table-2.1, rattle-5.6 or clatter-7"
        )
    return text


@dataclass(frozen=True, kw_only=True)
class SourceFigure(TrainOverrides):
    """A figure or a table, of a gear set or of a machine that may rattle.

    caption : what it shows, and what the source reads from it
    notes : what was chosen where the source is silent
    meshes : that are shown, counted from 1
    relative : whether frequencies are those over the first natural frequency
    edits : of the gear set or, `table.key=VALUE`, of the machine's file
    x, y : labels of the axes where they are not those of a frequency response
    printed : references, printed as a number or not
    missing : parts of the source's figure that are not made, and why
    """

    number: Annotated[str, AfterValidator(_require_number)]
    title: Text
    caption: Text
    notes: str = ""
    missing: str = ""
    gear_set: str = ""
    machine: str = ""
    meshes: Annotated[tuple[Literal[1, 2], ...], Field(min_length=1)] = (1, 2)
    relative: Flag = False
    quantity: Quantity = "dte_rms"
    x: str = ""
    y: str = ""
    part: Annotated[
        tuple[Annotated[AnyPart, Field(discriminator="kind")], ...],
        Field(min_length=1),
    ]
    printed: tuple[Reference, ...] = ()

    is_quick: ClassVar[bool] = False

    @property
    def parts(self) -> dict[str, Part]:
        """Parts by their names."""
        return {part.own_name: part for part in self.part}

    def scene(self, part: Part) -> AnyScene:
        if part.of_equation:
            return NoScene()
        if self.machine:
            edits = edits_by_key((*self.edits, *part.edits))
            return MachineScene(name=self.machine, overrides=edits)
        return scene_of(
            part,
            self,
            set_name=self.gear_set,
            relative=self.relative,
            quantity=self.quantity,
        )


@dataclass(frozen=True, kw_only=True)
class QuickFigure(SourceFigure):
    """A figure whose parts have few points, so that no reference is compared."""

    is_quick: ClassVar = True

    @classmethod
    def of(cls, figure: SourceFigure) -> QuickFigure:
        parts = tuple(part.quick() for part in figure.part)
        return cls(**(vars(figure) | {"part": parts}))


_FILE = DataFile(SourceFigure, {"part": KINDS, "printed": Reference})


def figure_numbers() -> tuple[str, ...]:
    """Numbers of all figures, in the order of the source."""
    return tuple(sorted((path.stem for path in FOLDER.glob("*.toml")), key=_sort_key))


def _sort_key(number: str) -> tuple[int, int, int, str]:
    """Tables come before the figures of their chapter, sources one after another."""
    if short := SHORT_SOURCES.fullmatch(number):
        source, index, letter = short.groups()
        return ORDER.index(source), 0, int(index), letter
    match = NUMBER.fullmatch(number)
    if match is None:
        file = FOLDER / f"{number}.toml"
        raise InputError(f"{file}: must be named after its figure, such as 3.6.toml")
    source, table, chapter, index, letter = match.groups("")
    rank = int(index) - 1000 * bool(table)
    return ORDER.index(source), int(chapter), rank, letter


@cache
def load_figure(number: str, quick: bool = False) -> SourceFigure:
    """Raises InputError if there is none, or if its file holds another one.

    quick : whether its parts have few points
    """
    numbers = figure_numbers()
    if number not in numbers:
        raise InputError(
            f"figure = {number}; no such figure{nearest(number, numbers)} "
            "(fegear reproduce --list names all)"
        )
    file = FOLDER / f"{number}.toml"
    figure = read_figure(read_text(file), f"figure {number}")
    if figure.number != number:
        raise InputError(
            f"{file}: number = {figure.number}; must be {number}, as its name"
        )
    return QuickFigure.of(figure) if quick else figure


@dataclass(frozen=True, kw_only=True)
class OmittedFigure:
    """Figures of the source that are not made, and why."""

    __pydantic_config__ = STRICT

    numbers: Text
    title: Text
    reason: Text


@dataclass(frozen=True, kw_only=True)
class LeftOutFigures:
    """All of them."""

    __pydantic_config__ = STRICT

    figure: tuple[OmittedFigure, ...]


def omitted_figures() -> tuple[OmittedFigure, ...]:
    """Figures of the source that are not made, in its order."""
    file = DataFile(LeftOutFigures, {"figure": OmittedFigure})
    return file.read(read_text(LEFT_OUT), LEFT_OUT.name).figure


def read_figure(text: str, source: str = "figure") -> SourceFigure:
    """The figure in TOML text; `source` begins the message of an InputError."""
    figure = _FILE.read(text, source)
    _require_one_subject(figure, source)
    names = [part.own_name for part in figure.part]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"{source}: part {name} is there twice; name both")
    for number, reference in enumerate(figure.printed, start=1):
        context = f"{source}: printed {number}"
        _require_value(figure, reference.part, reference.value_name, context)
        if reference.other_part is not None:
            other_context = f"{context} other_part"
            _require_value(
                figure,
                reference.other_part.part,
                reference.other_part.value_name,
                other_context,
            )
    return figure


def _require_one_subject(figure: SourceFigure, source: str) -> None:
    """A gear set or a machine, and no more of a train than that has; equations have
    neither."""
    bare = all(part.of_equation for part in figure.part)
    if bare and (figure.gear_set or figure.machine):
        raise InputError(f"{source}: its parts have neither gear_set nor machine")
    if not bare and bool(figure.gear_set) == bool(figure.machine):
        raise InputError(f"{source}: one of gear_set and machine is needed")
    for part in figure.part:
        if part.of_equation:
            continue
        if part.of_machine != bool(figure.machine):
            of = "machine" if part.of_machine else "gear_set"
            raise InputError(f"{source}: part {part.own_name} needs a {of}")
    for train in () if figure.gear_set else (figure, *figure.part):
        for setting in fields(TrainOverrides):
            if setting.name != "edits" and getattr(train, setting.name) is not None:
                raise InputError(
                    f"{source}: {setting.name} is of trains, not of "
                    f"{_kind_of_subject(figure)}"
                )


def _kind_of_subject(figure: SourceFigure) -> str:
    return "machines" if figure.machine else "equations"


def _require_value(
    figure: SourceFigure, part: str, value_name: str, context: str
) -> None:
    """The name of something that a part of the figure finds, or a reading."""
    parts, (key, other) = figure.parts, required_names(value_name)
    for name in filter(None, (part, other)):
        if name not in parts:
            raise InputError(
                f"{context}, part = {name}; must be one of {', '.join(parts)}"
            )
    keys = parts[part].keys
    if key and not any(re.fullmatch(pattern, key) for pattern in keys):
        raise InputError(
            f"{context}, value_name = {key}; must fit one of {', '.join(keys)}"
        )
