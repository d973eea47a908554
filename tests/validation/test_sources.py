"""What kept results depend on: all that is loaded to compute them, but no drawing."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from validation.study.sources import DRAWING, ROOT, SHOWN, digest_of, sources_of

COMPUTED = [
    "validation.study.solving",
    "validation.commands.validate.random_sets.set_runs",
    "validation.commands.reproduce.computations.clatter",
    "validation.commands.reproduce.computations.frequency_response",
    "validation.commands.reproduce.computations.rattle_basins",
]


def loaded(module: str) -> set[Path]:
    """Files of the project that Python loads with a module."""
    code = f"import sys, {module}; print(*(m.__file__ for m in sys.modules.values() if "
    code += "getattr(m, '__file__', None)))"
    argv = [sys.executable, "-c", code]
    done = subprocess.run(argv, capture_output=True, text=True, check=True)
    paths = {Path(name) for name in done.stdout.split()}
    return {path for path in paths if path.is_relative_to(ROOT) and is_own(path)}


def is_own(path: Path) -> bool:
    parts = path.relative_to(ROOT).with_suffix("").parts
    drawn = any(p in DRAWING or p.endswith("_figure") for p in parts)
    is_project = parts[0] in ("fegear", "lumped", "meshes", "validation")
    return is_project and not drawn and not ".".join(parts).startswith(SHOWN)


@pytest.mark.slow
@pytest.mark.parametrize("module", COMPUTED)
def test_all_that_is_loaded_is_among_the_sources(module):
    sources = sources_of(module)
    texts = [path.read_text("utf-8") for path in sources]
    for path in loaded(module) - sources:  # for drawing alone
        name = ".".join(path.relative_to(ROOT).with_suffix("").parts)
        assert not any(f"from {name} import" in text for text in texts), name
    assert all(is_own(path) or path.suffix == ".toml" for path in sources)


def test_drawing_is_no_source_and_data_of_machines_is():
    names = {path.name for path in sources_of(COMPUTED[-1])}
    assert {"manifolds.py", "settle.py", "roots-a.toml"} <= names
    assert not names & {"drawing.py", "figure.py", "plots.py"}


def test_a_changed_source_gives_another_digest(monkeypatch):
    before = digest_of(COMPUTED[0])
    digest_of.cache_clear()
    read_bytes = Path.read_bytes
    monkeypatch.setattr(
        Path, "read_bytes", lambda p: read_bytes(p) + b" " * (p.name == "rk4.py")
    )
    assert digest_of(COMPUTED[0]) != before
    monkeypatch.undo()
    digest_of.cache_clear()
    assert digest_of(COMPUTED[0]) == before
