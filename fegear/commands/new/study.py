"""A commented file to begin with."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from fegear.commands.new.rexs import ENDINGS, RexsGearSet, convert_gearbox, read_rexs
from fegear.files.errors import InputError
from fegear.files.output import path_of, write_text
from fegear.files.printable import printable
from fegear.files.templates import TEMPLATE_PACKAGES, template_text
from fegear.gearset.read import make_gear_set, parsed_toml
from fegear.studies.page import Page
from fegear.studies.problem import Job, Task
from fegear.studies.result import StudyResult
from fegear.studies.settings import argument, display_name, setting
from fegear.studies.study import NO_PICTURES, Study

# by kind, which commands read such a file
COMMANDS = {
    **dict.fromkeys(
        ("pair", "idler", "counter-shaft", "planetary"), "read by stiffness and sweep"
    ),
    "machine": "read by rattle critical and rattle basin",
    "gearbox": "read by clatter",
    "bearing": "read by bearing",
    "case": "read by validate",
}


@dataclass(frozen=True, kw_only=True)
class NewFile(Study, command="new", example="new pair -o my-pair.toml"):
    """Write a commented file to begin with, which runs as it is.

    `fegear keys` explains all keys. With `--from`, the file has the spur stages of a
    REXS file, and the lines that are printed say what was assumed and left out.
    """

    pictures = NO_PICTURES
    output = "Write the file, .toml; one that exists is not replaced."
    endings = (".toml",)
    must_write = True

    kind: str = argument(
        "KIND",
        "pair, idler, counter-shaft, planetary, machine, gearbox, bearing or case; "
        "none with --from.",
        default="",
    )
    source: str = setting(
        "",
        "Read this REXS file, XML, JSON or ZIP, instead of a KIND. [default: none]",
        option="--from",
        metavar="FILE",
        reads=True,
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        source = display_name(self, "source")
        if self.source and self.kind:
            raise InputError(
                f"{source} = {self.source}; kind {self.kind} excludes it, leave one out"
            )
        if not self.source and self.kind not in TEMPLATE_PACKAGES:
            kind, kinds = self.kind or "nothing", ", ".join(TEMPLATE_PACKAGES)
            raise InputError(f"kind = {kind}; allowed are {kinds}, or {source} FILE")

    def tasks(self) -> Iterator[Task]:
        yield Task("file", self._convert if self.source else self._read_template)

    def _read_template(self, job: Job) -> NewFileResult:
        return NewFileResult(self, template_text(self.kind))

    def _convert(self, job: Job) -> NewFileResult:
        converted = gear_set_of_rexs(self.source)
        return NewFileResult(
            self,
            converted.text,
            converted.assumed,
            converted.left_out,
            problems_of(converted),
        )


def gear_set_of_rexs(path: str | Path) -> RexsGearSet:
    """The gear-set file of a REXS file."""
    source = Path(path)
    if source.suffix.lower() not in ENDINGS:
        raise InputError(f"{path}: a REXS file ends with {', '.join(ENDINGS)}")
    model = read_rexs(source)
    name = printable(source.stem).replace('"', "'")
    try:
        return convert_gearbox(model, printable(source.name), name)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def problems_of(converted: RexsGearSet) -> tuple[str, ...]:
    """Why the gear set is refused as it is: a line for each pair that is, or one."""
    tables = parsed_toml(converted.text)
    if not (whole := _refusal(tables)):
        return ()
    gears = {gear["name"]: gear for gear in tables["gear"]}
    lines = [
        line
        for mesh in tables.get("mesh", ())
        if (line := _refusal(_pair_of(mesh, gears)))
    ]
    return tuple(dict.fromkeys([*lines, whole] if whole not in lines else lines))


def _pair_of(mesh: dict[str, Any], gears: Mapping[str, Any]) -> dict[str, Any]:
    """Tables of a mesh alone."""
    pair = [gears[mesh[role]] for role in ("driver", "driven")]
    alone = {key: value for key, value in mesh.items() if key != "center_line_deg"}
    return {"name": "pair", "gear": pair, "mesh": [alone]}


def _refusal(tables: dict[str, Any]) -> str:
    try:
        make_gear_set(tables)
    except InputError as error:
        return str(error)
    return ""


@dataclass(frozen=True, eq=False)
class NewFileResult(StudyResult):
    """Text of the file, and what it has of a REXS file.

    assumed : values that are not in it, and how they were chosen
    left_out : what the gear set has not
    problems : why it is refused until it is mended, a line for each pair
    """

    study: NewFile
    text: str
    assumed: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()
    problems: tuple[str, ...] = ()

    @cached_property
    def summary(self) -> dict[str, Any]:
        if self.study.source:
            return {
                "source": self.study.source,
                "assumed": list(self.assumed),
                "left_out": list(self.left_out),
                "to_mend": list(self.problems),
                "text": self.text,
            }
        return {"kind": self.study.kind, "text": self.text}

    def write(self, path: str | Path) -> None:
        """Write the file. InputError where there is one: it may have been edited."""
        target = path_of(path)
        if target.is_file():
            raise InputError(
                f"{target}: exists, and would be replaced; remove it first"
            )
        write_text(target, self.text)

    def page(self) -> Page:
        if not self.study.source:
            yield f"{self.study.kind}: {COMMANDS[self.study.kind]}"
            return
        yield f"gear set: {COMMANDS['pair']}"
        yield from (f"assumed: {line}" for line in self.assumed)
        yield from (f"left out: {line}" for line in self.left_out)
        yield from (f"to mend: {line}" for line in self.problems)
