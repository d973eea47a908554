"""Codes at the end of warnings and of evidence lines, and what they mean.

They are declared in `codes.toml`, which is read when a code is first needed.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import TypeAlias

CODE_AT_END = re.compile(r" \[([WE]\d\d)\]$")


@dataclass(frozen=True, kw_only=True)
class WarningCode:
    """Why a warning is printed, and what to do about it."""

    code: str
    title: str
    cause: str
    cure: str


@dataclass(frozen=True, kw_only=True)
class EvidenceCode:
    """What a line with errors or self-checks shows, and what it does not."""

    code: str
    title: str
    meaning: str
    limits: str


Code: TypeAlias = WarningCode | EvidenceCode


@cache
def codes() -> Mapping[str, Code]:
    """All declarations by code, warnings first."""
    import tomllib

    text = (resources.files("fegear.files") / "codes.toml").read_text("utf-8")
    return {
        code: _code_of_entry(code, entry) for code, entry in tomllib.loads(text).items()
    }


def _code_of_entry(code: str, entry: Mapping[str, str]) -> Code:
    if code.startswith("W"):
        return WarningCode(code=code, **entry)
    return EvidenceCode(code=code, **entry)


def with_code(code: str, text: str) -> str:
    """A line that ends with a declared code; KeyError for another code."""
    return f"{text} [{codes()[code].code}]"


def is_warning(line: str) -> bool:
    """Whether a declared code of a warning ends a line."""
    match = CODE_AT_END.search(line)
    return match is not None and isinstance(codes().get(match[1]), WarningCode)


def require_warning_code(line: str) -> str:
    """The line, if a declared code of a warning ends it; ValueError otherwise."""
    if not is_warning(line):
        raise ValueError(f"a warning must end with a code such as [W01], got {line!r}")
    return line
