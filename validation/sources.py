"""The sources that results depend on, as one digest."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from types import ModuleType

import fegear
import lumped
import meshes
import validation

# packages whose sources results depend on, and which of their files
PACKAGES: Mapping[ModuleType, tuple[str, ...]] = {
    meshes: ("**/*.py",),
    lumped: ("**/*.py",),
    fegear: (
        *(f"{folder}/**/*.py" for folder in ("contact", "elasticity", "gearset")),
        *("dynamics/**/*.py", "excitation.py", "lumped_models.py", "statics.py"),
        *("store.py", "sweeps.py", "train.py", "unphysical.py"),
    ),
    validation: ("kept.py", "metrics.py", "run_files.py", "solving.py"),
}


def source_digest() -> str:
    """Of the sources that results depend on."""
    return digest_of(tuple(PACKAGES.items()))


@cache
def digest_of(packages: tuple[tuple[ModuleType, tuple[str, ...]], ...]) -> str:
    """Of the files of packages that fit patterns."""
    content = hashlib.sha256()
    for package, parts in packages:
        root = Path(str(package.__file__)).parent
        files = {path for part in parts for path in root.glob(part)}
        for path in sorted(files):
            content.update(path.relative_to(root.parent).as_posix().encode())
            content.update(path.read_bytes())
    return content.hexdigest()
