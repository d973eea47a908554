"""Imports point one way, kernels know only numerics, and imports stay cheap."""

from __future__ import annotations

import ast
import graphlib
import re
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator
from functools import cache
from pathlib import Path

import pytest
from source_files import ROOT, nodes

PACKAGES = ("meshes", "fegear", "lumped", "validation")
FILES = [p for name in PACKAGES for p in sorted((ROOT / name).rglob("*.py"))]
UNIX_ONLY = {"fcntl", "grp", "posix", "pty", "pwd", "resource", "syslog", "termios"}
KERNELS = [ROOT / "fegear" / "elasticity" / "flank_grid.py"]
KERNELS += sorted((ROOT / "fegear").rglob("kernels/*.py"))
KERNELS += sorted((ROOT / "lumped").rglob("kernels/*.py"))
NUMERICS = {"__future__", "math", "cmath", "typing", "numpy", "numpy.typing", "numba"}
# Packages from the ground to the roof: a file imports from its own package and from the
# floors below it, never sideways or upward.
FLOORS = """
    lumped.common meshes
    lumped.kernels lumped.bearings lumped.continuation
    lumped.rotors fegear.files fegear.result
    lumped.train lumped.rattle meshes.eccentric
    lumped.clatter fegear.gearset
    fegear.boundary fegear.elasticity
    fegear.contact
    fegear.statics
    lumped.steady
    lumped.branches lumped.closed_forms lumped.signals lumped.stability fegear.dynamics
    lumped.attractors
    lumped.figures fegear.train
    lumped validation
    fegear.figures
    fegear.rendering
    fegear.studies
    fegear.commands
    validation.oracles validation.pages
    validation.study validation.published
    validation.cracked_tooth validation.programs
    validation.commands
    fegear
    fegear.cli
    fegear.__main__
"""
FLOOR = {
    package: number
    for number, floor in enumerate(FLOORS.splitlines())
    for package in floor.split()
}
ALONE = "meshes", "lumped"  # know no other package


@cache
def imported_modules(path: Path) -> set[str]:
    modules: set[str] = set()
    for node in nodes(path):
        if isinstance(node, ast.Import):
            modules |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            modules.add(node.module)
    return modules


@cache
def label(path: Path) -> str:
    return str(path.relative_to(ROOT))


def violations(rule: Callable[[Path], Iterable[str]]) -> list[str]:
    """Return all that breaks a rule, each with the file it is in."""
    return [f"{label(path)}: {text}" for path in FILES for text in rule(path)]


def texts_of(path: Path) -> Iterator[str]:
    for node in nodes(path):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node.value


def module_of(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {module_of(path): path for path in FILES}


def package_of(module: str) -> str:
    """The entry of `FLOORS` that a module belongs to."""
    while module not in FLOOR:
        module = module.rpartition(".")[0]
    return module


@cache
def imports_of(module: str) -> frozenset[str]:
    """Modules of the project that a module imports: also later, and for types."""
    named = set[str]()
    for node in nodes(MODULES[module]):
        if isinstance(node, ast.Import):
            named |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            named |= {f"{node.module}.{alias.name}" for alias in node.names}
    return frozenset(filter(None, map(_module_that_has, named))) - {module}


def _module_that_has(name: str) -> str:
    while name and name not in MODULES:
        name = name.rpartition(".")[0]
    return name


def test_imports_point_downward():
    assert violations(_upward_imports) == []


def _upward_imports(path: Path) -> Iterator[str]:
    module = module_of(path)
    package = package_of(module)
    for imported in sorted(imports_of(module)):
        below = package_of(imported)
        if below != package and FLOOR[below] >= FLOOR[package]:
            yield imported
        building = module.partition(".")[0]
        if building in ALONE and imported.partition(".")[0] != building:
            yield imported


def test_no_imports_go_round_in_circles():
    """Also those within a package, later ones and those for types."""
    order = graphlib.TopologicalSorter({m: imports_of(m) for m in MODULES})
    order.prepare()  # CycleError names a circle


def test_no_text_names_a_package_above():
    """Studies of evidence are registered, not known by name."""
    below = [path for path in FILES if path.relative_to(ROOT).parts[0] != "validation"]
    named = [
        (label(path), text)
        for path in below
        for text in texts_of(path)
        if re.match(r"validation(\.|$)", text)
    ]
    assert named == []


def test_without_the_package_of_evidence_all_else_is_offered(tmp_path):
    code = """
import sys
sys.modules["validation"] = None
import fegear
from fegear.cli import app
from typer.testing import CliRunner
result = CliRunner().invoke(app, ["--help"])
assert "sweep" in result.output and "reproduce" not in result.output, result.output
assert " bench " not in result.output, result.output
assert "no such command" in CliRunner().invoke(app, ["bench"]).output
assert fegear.Sweep and not hasattr(fegear, "Validation")
"""
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True)


def test_modules_that_every_system_has():
    """Others are imported only where their absence is handled."""
    assert violations(_modules_of_unix) == []


def _modules_of_unix(path: Path) -> set[str]:
    handled = {
        alias.name
        for node in nodes(path)
        if isinstance(node, ast.Try)
        and [ast.unparse(handler.type) for handler in node.handlers] == ["ImportError"]
        for statement in node.body
        if isinstance(statement, ast.Import)
        for alias in statement.names
    }
    modules = {m.split(".")[0] for m in imported_modules(path)}
    return (modules - handled) & UNIX_ONLY


@pytest.mark.parametrize("path", KERNELS, ids=lambda path: path.stem)
def test_kernels_import_only_numerics(path):
    packages = (
        "fegear.contact",
        "fegear.dynamics",
        "fegear.elasticity.flank_grid",
        "lumped.kernels",
        "lumped.clatter.kernels",
        "lumped.rattle.kernels",
        "lumped.stability.kernels",
        "lumped.common.array_types",
        "lumped.common.compiled",
    )
    outside = {m for m in imported_modules(path) if not m.startswith(packages)}
    assert outside <= NUMERICS
    inside = imported_modules(path) - outside
    assert not inside & {"fegear.contact.problem", "fegear.contact.solve"}


def loaded_by(statement: str) -> set[str]:
    code = f"import sys; {statement}; print(*sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    return set(done.stdout.split())


@pytest.mark.parametrize(
    ("statement", "heavy"),
    [
        (
            "import lumped",
            {"gmsh", "vtk", "pyvista", "skfem", "scipy", "matplotlib", "numba"},
        ),
        ("import meshes", {"gmsh", "vtk", "pyvista", "skfem", "meshio"}),
        ("import fegear.cli", {"numpy", "numba", "gmsh", "vtk", "skfem", "scipy"}),
        ("import fegear.gearset", {"gmsh", "skfem", "numba", "scipy", "matplotlib"}),
        ("import fegear.statics.solving", {"vtk", "pyvista", "gmsh", "matplotlib"}),
        (
            "from fegear.cli import run; run(['show', 'liu-pair'])",
            {"skfem", "numba", "scipy.optimize", "scipy.linalg", "matplotlib"},
        ),
        (
            "import fegear.commands.stiffness.study",
            {"skfem", "gmsh", "scipy.optimize", "lumped.attractors", "lumped.branches"},
        ),
        (
            "from fegear.cli import run; run(['reproduce', '--list'])",
            {"vtk", "pyvista", "gmsh", "matplotlib", "meshio"},
        ),
    ],
)
def test_heavy_libraries_load_where_they_are_used(statement, heavy):
    assert not loaded_by(statement) & heavy


def test_only_the_command_line_and_studies_name_options():
    """A Python user reads names of settings."""
    assert violations(_named_options) == []


def _named_options(path: Path) -> Iterator[str]:
    place = label(path)
    if (
        not place.startswith(("fegear/", "lumped/"))
        or "/studies/" in place
        or "/commands/" in place
    ):
        return
    if place.startswith("fegear/cli/"):
        return
    for text in texts_of(path):
        if re.search(r"(^|[\s`(])--[a-z]", text):
            yield text


def test_no_summary_reads_a_header():
    for path in FILES:
        assert "float(header[" not in path.read_text("utf-8"), path
        assert "float(self.header[" not in path.read_text("utf-8"), path


def test_there_is_one_progress():
    """An alias of one module, and no other of its kind."""
    defined = [
        label(path)
        for path in FILES
        if re.search(r"^Progress = |^class Progress\b", path.read_text("utf-8"), re.M)
    ]
    assert defined == ["lumped/common/progress.py"]


NO_SUBJECT = "Of ", "By ", "The same ", "Those ", "With ", "As ", "Without "
DOCUMENTED = ast.Module, ast.ClassDef, ast.FunctionDef


def test_docstrings_begin_with_what_they_return_or_do():
    assert violations(_docstrings_without_subject) == []


def _docstrings_without_subject(path: Path) -> Iterator[str]:
    for node in nodes(path):
        if isinstance(node, DOCUMENTED):
            text = ast.get_docstring(node) or ""
            if text.startswith(NO_SUBJECT):
                yield text
