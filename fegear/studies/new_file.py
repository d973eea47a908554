"""A commented file to begin with."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from fegear.files.errors import InputError
from fegear.files.output import path_of, write_text
from fegear.files.templates import TEMPLATES, template_text
from fegear.studies.page import Page
from fegear.studies.study import (
    NO_PICTURES,
    Job,
    Study,
    StudyResult,
    Task,
    argument,
)

# by kind, which commands read such a file
COMMANDS = {
    **dict.fromkeys(("pair", "idler", "counter-shaft"), "read by stiffness and sweep"),
    "machine": "read by rattle critical and rattle basin",
    "gearbox": "read by clatter",
    "case": "read by validate",
}


@dataclass(frozen=True, kw_only=True)
class NewFile(Study, command="new", example="new pair -o my-pair.toml"):
    """Write a commented file to begin with, which runs as it is.

    `fegear keys` explains all keys.
    """

    pictures = NO_PICTURES
    output = "Write the file, .toml; one that exists is not replaced."
    endings = (".toml",)
    must_write = True

    kind: str = argument(
        "KIND", "pair, idler, counter-shaft, machine, gearbox or case."
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.kind not in TEMPLATES:
            raise InputError(f"kind = {self.kind}; allowed are {', '.join(TEMPLATES)}")

    def tasks(self) -> Iterator[Task]:
        yield Task("file", self._read_template)

    def _read_template(self, job: Job) -> NewFileResult:
        return NewFileResult(self, template_text(self.kind))


@dataclass(frozen=True, eq=False, repr=False)
class NewFileResult(StudyResult):
    """Text of the file."""

    study: NewFile
    text: str

    @cached_property
    def summary(self) -> dict[str, Any]:
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
        yield f"{self.study.kind}: {COMMANDS[self.study.kind]}"
