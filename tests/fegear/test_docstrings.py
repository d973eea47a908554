"""Docstrings of public names follow numpydoc and name what the code has."""

from __future__ import annotations

import inspect
import pydoc
import shlex
from collections.abc import Iterator
from enum import Enum
from pathlib import Path
from typing import Any

import pytest
from numpydoc.docscrape import FunctionDoc, NumpyDocString
from typer.testing import CliRunner

import fegear
import lumped
from fegear.cli import app
from fegear.rendering.pictures import StressResult
from fegear.statics.mesh_result import ErrorEstimate, StaticsResult
from fegear.studies import load_study
from fegear.studies.python_example import python_example
from fegear.studies.registry import commands
from fegear.studies.result import StudyResult
from fegear.studies.table import Table
from lumped import closed_forms
from lumped.attractors.attractor_sweeps import AttractorBranch, AttractorInterval

OURS = ("fegear", "lumped", "meshes", "validation")
RESULTS = (  # of public functions
    *(AttractorBranch, AttractorInterval, ErrorEstimate, StaticsResult, StressResult),
    *(StudyResult, Table),
)
NO_VALUE = (None, "None", inspect.Signature.empty)


def public_objects() -> Iterator[tuple[str, Any]]:
    """Functions and classes of the public interface, by their full names."""
    for module in (fegear, lumped, closed_forms):
        for name in set(module.__all__) - {"__version__"}:
            yield f"{module.__name__}.{name}", getattr(module, name)
    for kind in RESULTS:
        yield f"{kind.__module__}.{kind.__name__}", kind


def members(kind: type) -> Iterator[tuple[str, Any]]:
    """Public methods and properties of a class that are defined in this project."""
    for name, value in inspect.getmembers_static(kind):
        if name.startswith("_") or not is_ours(kind, name):
            continue
        if isinstance(value, classmethod | staticmethod):
            yield name, value.__func__
        elif inspect.isfunction(value) or hasattr(type(value), "__get__"):
            yield name, value


def is_ours(kind: type, name: str) -> bool:
    owner = next(base for base in kind.__mro__ if name in vars(base))
    return owner.__module__.partition(".")[0] in OURS


PUBLIC = dict(sorted(public_objects()))
METHODS = {
    f"{full_name}.{name}": (kind, name, value)
    for full_name, kind in PUBLIC.items()
    if inspect.isclass(kind)
    for name, value in members(kind)
}


def documented_names(parsed: NumpyDocString, *sections: str) -> list[str]:
    entries = [entry.name for section in sections for entry in parsed[section]]
    return [name.strip(" *") for entry in entries for name in entry.split(",")]


def parameter_names(function: Any) -> list[str]:
    names = list(inspect.signature(function).parameters)
    return [name for name in names if name not in ("self", "cls")]


def has_fields(kind: type) -> bool:
    """Whether a class is made by arguments that are those of this project."""
    return is_ours(kind, "__init__") and not issubclass(kind, Enum)


def require_function(text: str, function: Any) -> None:
    parsed = FunctionDoc(None, doc=text)
    assert parsed["Summary"]
    assert documented_names(parsed, "Parameters") == parameter_names(function)
    returned = inspect.signature(function).return_annotation not in NO_VALUE
    assert bool(parsed["Returns"] or parsed["Yields"]) == returned


@pytest.mark.parametrize("name", PUBLIC)
@pytest.mark.filterwarnings("error:Unknown section")
def test_public_names_are_documented(name):
    value = PUBLIC[name]
    text = inspect.getdoc(value)
    assert text
    if not inspect.isclass(value):
        require_function(text, value)
        return
    parsed = NumpyDocString(text)
    assert parsed["Summary"]
    if has_fields(value):
        names = documented_names(parsed, "Parameters", "Attributes")
        assert names == parameter_names(value)


@pytest.mark.parametrize("name", METHODS)
def test_public_methods_are_documented(name):
    kind, attribute, value = METHODS[name]
    text = inspect.getdoc(getattr(kind, attribute))
    if inspect.isfunction(value):
        require_function(text or "", value)
    else:
        assert text


class ParsedError(Exception):
    """A command line was read."""


def study_of_command(argv: list[str], monkeypatch) -> Any:
    """The study that a command makes of its words, without a run."""

    def stop(study: Any, outputs: Any) -> None:
        raise ParsedError(study)

    monkeypatch.setattr("fegear.cli.studies.check_outputs", stop)
    result = CliRunner().invoke(app, argv)
    assert isinstance(result.exception, ParsedError), result.exception
    return result.exception.args[0]


@pytest.mark.parametrize("command", commands())
def test_the_example_in_python_is_that_of_the_command(command, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    for name in ("best.toml", "pair.toml", "my-pair.toml", "measured.csv"):
        Path(name).touch()  # are read later
    kind = load_study(command)
    lines = python_example(kind)
    if command == "rattle critical":  # by parameters that have no public class
        assert lines == []
        return
    names = {"fegear": fegear}
    exec(lines[0], names)
    argv = shlex.split(kind.example)[1:]
    assert names["study"] == study_of_command(argv, monkeypatch)
    assert lines[0] in inspect.getdoc(kind)


def test_help_of_a_study_has_its_columns_and_no_methods_of_all_classes():
    text = pydoc.plain(pydoc.render_doc(fegear.Sweep))
    assert "- `dte_rms_m`: RMS of the dynamic" in text
    assert 'fegear.Sweep(gear_set="liu-idler", speeds="800:4200:20")' in text
    assert "__setattr__" not in text


def test_help_of_a_study_lists_its_settings():
    text = inspect.getdoc(fegear.Sweep)
    assert fegear.Sweep.example in text
    assert "``--spectra``" not in text  # a file that the command writes, no setting
    parsed = NumpyDocString(text)
    speeds = next(entry for entry in parsed["Parameters"] if entry.name == "speeds")
    assert "Allowed: above 0" in " ".join(speeds.desc)
    assert "Parameters" not in fegear.Sweep.description
