"""Flank compliances on disk, under a hash of everything they depend on.

A file is trusted only if its own key and the digest of its arrays agree; any
other file is rebuilt. Files appear whole by renaming, so that processes may share
the directory.
"""

from __future__ import annotations

import hashlib
import json
import os
from dataclasses import asdict
from pathlib import Path

import numpy as np

from fegear.elasticity.flank import FlankCompliance, flank_compliance
from fegear.elasticity.material import PlaneMaterial
from fegear.elasticity.sector import cyclic_sector
from fegear.errors import InputError
from fegear.output import make_directory, write_whole
from meshes import MeshSize, SpurGear

FORMAT = 2  # raise when geometry, mesh, elasticity or the file layout change


def cache_directory() -> Path:
    """FEGEAR_CACHE_DIR, or the user's cache directory."""
    chosen = os.environ.get("FEGEAR_CACHE_DIR")
    if chosen:
        return Path(chosen)
    import platformdirs

    return Path(platformdirs.user_cache_dir("fegear"))


def cache_key(
    gear: SpurGear, material: PlaneMaterial, size: MeshSize, order: int, split: bool
) -> str:
    """Hash of all inputs, of this format and of the libraries that matter."""
    from importlib.metadata import version

    inputs = {
        "format": FORMAT,
        "gear": asdict(gear),
        "material": asdict(material),
        "size": asdict(size),
        "order": order,
        "split": split,
        "libraries": {name: version(name) for name in ("gmsh", "scikit-fem")},
    }
    text = json.dumps(inputs, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


def cached_flank_compliance(
    gear: SpurGear,
    material: PlaneMaterial,
    size: MeshSize | None = None,
    order: int = 2,
    split: bool = True,
) -> FlankCompliance:
    """`flank_compliance`, read from disk where it was computed before."""
    size = size or MeshSize()
    key = cache_key(gear, material, size, order, split)
    path = cache_directory() / f"flank-{key[:32]}.npz"
    found = read_compliance(path, key)
    if found is None:
        found = flank_compliance(cyclic_sector(gear, material, size, order), split)
        store_compliance(found, path, key)
    return found


def read_compliance(path: Path, key: str) -> FlankCompliance | None:
    """The stored value, or None where the file is missing, corrupt or stale."""
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: file[name] for name in ("normal", "tangential", "scalars")}
            stored = bytes(file["signature"]).decode()
    except Exception:  # whatever a damaged archive raises, it is not to be trusted
        return None
    if stored != _signature(key, arrays):
        return None
    length, grading, modulus, poisson, split = (float(x) for x in arrays["scalars"])
    return FlankCompliance(
        normal=arrays["normal"],
        tangential=arrays["tangential"],
        flank_length=length,
        grading=grading,
        modulus=modulus,
        poisson=poisson,
        split=bool(split),
    )


def store_compliance(value: FlankCompliance, path: Path, key: str) -> bool:
    """Write it whole or not at all; False where the disk does not take it."""
    numbers = (value.flank_length, value.grading, value.modulus, value.poisson)
    arrays = {
        "normal": value.normal,
        "tangential": value.tangential,
        "scalars": np.array([*numbers, value.split]),
    }
    signature = np.frombuffer(_signature(key, arrays).encode(), np.uint8)

    def write(beside: Path) -> None:
        np.savez(beside, allow_pickle=False, signature=signature, **arrays)

    try:
        make_directory(path.parent)
        write_whole(path, write)
    except InputError:  # a cache that cannot be written is only slower
        return False
    return True


def _signature(key: str, arrays: dict[str, np.ndarray]) -> str:
    digest = hashlib.sha256(key.encode())
    for name in sorted(arrays):
        values = np.ascontiguousarray(arrays[name])
        digest.update(f"{name} {values.shape} {values.dtype.str}".encode())
        digest.update(values.tobytes())
    return digest.hexdigest()
