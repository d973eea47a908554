"""Codes of warnings and evidence lines."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any

from fegear.files.codes import Code, WarningCode, codes
from fegear.files.errors import InputError
from fegear.studies.page import Page
from fegear.studies.problem import Job, Task
from fegear.studies.result import StudyResult
from fegear.studies.settings import argument
from fegear.studies.study import NO_PICTURES, Study
from fegear.studies.table import Table

COLUMNS = "code", "title", "cause", "cure", "meaning", "limits"
HEADINGS = {"W": "Warnings", "E": "Evidence"}


@dataclass(frozen=True, kw_only=True)
class Explanation(Study, command="explain", example="explain W03 E01"):
    """Explain the codes of warnings and of evidence lines.

    A warning has a cause and a cure. Lines of evidence, which show errors and
    self-checks, have a meaning and limits. Without codes it lists all of them.
    """

    pictures = NO_PICTURES

    codes: tuple[str, ...] = argument(
        "CODE", "Codes at the end of lines, such as W03 or E01. [default: all]", ()
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        for code in self.codes:
            if code.upper() not in codes():
                raise InputError(f"codes = {code}; allowed are {', '.join(codes())}")

    def tasks(self) -> Iterator[Task]:
        yield Task("codes", self._look_up)

    def _look_up(self, job: Job) -> ExplanationResult:
        chosen = dict.fromkeys(code.upper() for code in self.codes) or codes()
        return ExplanationResult(self, [codes()[code] for code in chosen])


@dataclass(frozen=True, eq=False)
class ExplanationResult(StudyResult):
    """Entries in the order asked for."""

    study: Explanation
    entries: list[Code]

    @cached_property
    def plain(self) -> list[dict[str, str]]:
        """Entries as plain values."""
        return [asdict(entry) for entry in self.entries]

    @property
    def summary(self) -> dict[str, Any]:
        return {"codes": self.plain}

    @property
    def table(self) -> Table:
        """A row for each code; cells that it does not have are empty."""
        rows = [[entry.get(name, "") for name in COLUMNS] for entry in self.plain]
        return Table(COLUMNS, lambda: rows)

    def page(self) -> Page:
        if self.study.codes:
            for entry in self.entries:
                yield from _lines(entry)
            return
        for letter, heading in HEADINGS.items():
            yield heading
            for entry in self.entries:
                if entry.code.startswith(letter):
                    yield f"  {entry.code}  {entry.title}"


def _lines(entry: Code) -> Iterator[str]:
    """The title, and a line for each of the two parts."""
    yield f"{entry.code}  {entry.title}"
    for name in ("cause", "cure") if isinstance(entry, WarningCode) else COLUMNS[-2:]:
        yield f"  {name}: {getattr(entry, name)}"
