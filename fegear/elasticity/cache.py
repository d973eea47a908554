"""What gears are solved for on disk, under a hash of everything it depends on."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, fields
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from fegear.elasticity.crack_influence import CrackInfluence, crack_influence
from fegear.elasticity.damaged_ring import (
    ComplianceChange,
    ToothCracks,
    as_cracks,
    compliance_change,
    damaged_ring,
    require_teeth,
)
from fegear.elasticity.flank import (
    FlankCompliance,
    FlankOrigin,
    flank_compliance,
    rootward_compliance,
)
from fegear.elasticity.material import PlaneMaterial
from fegear.elasticity.root_stress import RootInfluence, root_influence
from fegear.elasticity.sector import CyclicSector, cyclic_sector
from fegear.files.array_files import digest, load_arrays, save_arrays
from meshes import MeshSize, SpurGear
from meshes.crack import Crack

Arrays = dict[str, NDArray[Any]]
Body = TypeVar("Body")  # a dataclass of numbers and arrays
FORMAT = 5  # raise when geometry, mesh, elasticity or the file layout change


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
    return digest(_inputs(gear, material, size, order) | {"split": split})


def _inputs(
    gear: SpurGear, material: PlaneMaterial, size: MeshSize, order: int
) -> dict[str, Any]:
    return {
        "format": FORMAT,
        "gear": asdict(gear),
        "material": asdict(material),
        "size": asdict(size),
        "order": order,
        "libraries": _versions(),
    }


def cached_arrays(
    name: str,
    sector: CyclicSector,
    inputs: Mapping[str, Any],
    compute: Callable[[], Arrays],
) -> Arrays:
    """Arrays of a sector, read from disk where they were computed before.

    name : of the quantity, with which the file's name begins
    inputs : plain values on which it depends besides the sector
    """
    of_sector = _inputs(sector.gear, sector.material, sector.size, sector.order)
    if sector.cracks:
        of_sector["cracks"] = [asdict(crack) for crack in sector.cracks]
    key = digest(of_sector | {"name": name, "inputs": dict(inputs)})
    path = _path(name, key)
    arrays = load_arrays(path, key)
    if arrays is None:
        arrays = compute()
        save_arrays(path, key, arrays)
    return arrays


def cached_body(
    name: str,
    sector: CyclicSector,
    inputs: Mapping[str, Any],
    compute: Callable[[], Body],
    kind: Callable[..., Body],
) -> Body:
    """`cached_arrays` of a dataclass, whose fields are arrays and numbers."""

    def as_arrays() -> Arrays:
        values: Any = compute()
        return {n.name: np.asarray(getattr(values, n.name)) for n in fields(values)}

    arrays = cached_arrays(name, sector, inputs, as_arrays)
    return kind(**{n: v if v.ndim else v.item() for n, v in arrays.items()})


@cache
def _versions() -> dict[str, str]:
    from importlib.metadata import version

    return {name: version(name) for name in ("gmsh", "scikit-fem")}


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
    path = _path("flank", key)
    arrays = load_arrays(path, key)
    if arrays is None:
        computed = flank_compliance(cyclic_sector(gear, material, size, order), split)
        names = [f.name for f in fields(computed) if f.name != "origin"]
        arrays = {name: np.asarray(getattr(computed, name)) for name in names}
        save_arrays(path, key, arrays)
    plain: Any = {n: v if v.ndim else v.item() for n, v in arrays.items()}
    has_origin = split and order == 2
    origin = FlankOrigin(gear, material, size) if has_origin else None
    return FlankCompliance(**plain, origin=origin)


def cached_rootward_compliance(origin: FlankOrigin) -> NDArray[np.float64]:
    """`rootward_compliance`, read from disk where it was computed before."""
    sector = cyclic_sector(origin.gear, origin.material, origin.size)

    def compute() -> Arrays:
        return {"rootward": rootward_compliance(sector)}

    return cached_arrays("rootward", sector, {}, compute)["rootward"]


def cached_root_influence(
    gear: SpurGear, material: PlaneMaterial, size: MeshSize
) -> RootInfluence:
    """`root_influence`, read from disk where it was computed before."""
    key = cache_key(gear, material, size, order=2, split=True)
    path = _path("root", key)
    arrays = load_arrays(path, key)
    if arrays is not None:
        return RootInfluence(gear, grading=size.flank_grading, **arrays)
    influence = root_influence(cyclic_sector(gear, material, size))
    names = "fillets", "arcs", "remainder"
    save_arrays(path, key, {name: getattr(influence, name) for name in names})
    return influence


def cached_compliance_change(
    gear: SpurGear,
    material: PlaneMaterial,
    size: MeshSize,
    cracks: ToothCracks,
    closing: bool = False,
) -> ComplianceChange:
    """`compliance_change`, read from disk where it was computed before.

    Turned by some teeth it is that of the same cracks on other teeth.

    Parameters
    ----------
    gear, material, size
        As of `cached_flank_compliance`.
    cracks : mapping of int to Crack or sequence of Crack
        Cracks by tooth, counted clockwise from 0; at least one.
    closing : bool
        As of `compliance_change`.

    Returns
    -------
    ComplianceChange
        What the cracks add to the compliance of the healthy gear.
    """
    require_teeth(gear, cracks)
    sector, first = cyclic_sector(gear, material, size), min(cracks)
    turned = _counted_from(cracks, first, gear.teeth)

    def compute() -> ComplianceChange:
        return compliance_change(damaged_ring(sector, turned), closing)

    inputs = {"cracks": _plain_cracks(turned), "closing": closing}
    change = cached_body("cracks", sector, inputs, compute, ComplianceChange)
    return change.shifted(first)


def cached_crack_influence(
    gear: SpurGear,
    material: PlaneMaterial,
    size: MeshSize,
    cracks: ToothCracks,
    tooth: int,
) -> CrackInfluence:
    """`crack_influence` of one cracked tooth, read from disk where it was computed
    before.

    Parameters
    ----------
    gear, material, size, cracks
        As of `cached_compliance_change`.
    tooth : int
        Cracked tooth.

    Returns
    -------
    CrackInfluence
        Stress intensities under loads on the teeth around it.
    """
    require_teeth(gear, cracks)
    if tooth not in cracks:
        raise ValueError(f"tooth = {tooth}; cracked are {sorted(cracks)}")
    sector = cyclic_sector(gear, material, size)
    turned = _counted_from(cracks, tooth, gear.teeth)

    def compute() -> CrackInfluence:
        return crack_influence(damaged_ring(sector, turned), 0)

    inputs = {"cracks": _plain_cracks(turned)}
    return cached_body("intensity", sector, inputs, compute, CrackInfluence)


def _counted_from(
    cracks: ToothCracks, first: int, teeth: int
) -> dict[int, tuple[Crack, ...]]:
    """Cracks by tooth, in the order of teeth from one that counts as 0."""
    turned = {(t - first) % teeth: as_cracks(parts) for t, parts in cracks.items()}
    return dict(sorted(turned.items()))


def _plain_cracks(cracks: Mapping[int, Sequence[Crack]]) -> list[Any]:
    return [[t, [asdict(crack) for crack in parts]] for t, parts in cracks.items()]


def _path(kind: str, key: str) -> Path:
    return cache_directory() / f"{kind}-{key[:32]}.npz"
