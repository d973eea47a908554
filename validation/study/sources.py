"""The sources that results depend on, as one digest."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import validation

ROOT = Path(str(validation.__file__)).parents[1]
OWN_PACKAGES = "fegear", "lumped", "meshes", "validation"
DATA_PATTERNS = "machines/*.toml", "gearboxes/*.toml"  # next to modules that read them
# what only shows numbers: a change of it makes no result stale
SHOWN = (
    "fegear.cli",
    "fegear.rendering",
    "validation.commands.validate.report",
    "validation.pages",
)
DRAWING = "figure", "figures", "drawing", "drawings", "plots", "page", "waterfall"
# `from MODULE import NAMES` and `import MODULE`; the syntax tree takes 20 times as long
IMPORT = re.compile(r"^ *(?:from|import) ([\w.]+)(?: import (\([^)]*\)|.*))?$", re.M)


@cache
def digest_of(*modules: str) -> str:
    """Digest of modules and of all that they import of the project, but of drawing."""
    content = hashlib.sha256()
    for path in sorted(sources_of(*modules)):
        content.update(path.relative_to(ROOT).as_posix().encode())
        content.update(path.read_bytes())
    return content.hexdigest()


def sources_of(*modules: str) -> set[Path]:
    """Files of modules, of all that they import, and the data that these read."""
    paths: set[Path] = set()
    waiting = [path for name in modules for path in _files_of(name)]
    while waiting:
        path = waiting.pop()
        if path in paths:
            continue
        paths |= {
            path,
            *(data for part in DATA_PATTERNS for data in path.parent.glob(part)),
        }
        waiting += [
            file for name in _imported_modules(path) for file in _files_of(name)
        ]
    return paths


@cache
def _imported_modules(path: Path) -> tuple[str, ...]:
    """Names of modules that a file imports, and of what it takes of them."""
    module_names: list[str] = []
    for module, names in IMPORT.findall(path.read_text("utf-8")):
        module_names += [
            module,
            *(f"{module}.{name}" for name in re.findall(r"\w+", names)),
        ]
    return tuple(module_names)


def _files_of(name: str) -> Iterator[Path]:
    """The file of a module of the project; none of others, and of drawing."""
    parts = name.split(".")
    drawn = any(part in DRAWING or part.endswith("_figure") for part in parts)
    if parts[0] not in OWN_PACKAGES or drawn or name.startswith(SHOWN):
        return
    base_path = ROOT.joinpath(*parts)
    packages = (ROOT.joinpath(*parts[:n], "__init__.py") for n in range(1, len(parts)))
    for path in (*packages, base_path.with_suffix(".py"), base_path / "__init__.py"):
        if path.is_file():
            yield path
