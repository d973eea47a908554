"""Elasticity of gears on disk, in directories named after all that determines it."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, fields, replace
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
from fegear.elasticity.wide_flank import (
    DEGREE,
    MESH,
    SHORT_END_LAYERS,
    WideFlank,
    WidthModes,
    wide_flank,
    width_and_root_modes,
    width_modes,
)
from fegear.elasticity.wide_root import RootModes, WideRoot
from fegear.elasticity.width import (
    MESH_REFINEMENT,
    WidthCorrection,
    width_correction,
)
from fegear.elasticity.width_functions import END_LAYERS
from fegear.files.array_bytes import pack, unpack
from fegear.files.errors import InputError
from fegear.files.kept import (
    directory_of_inputs,
    read_verified_files,
    with_inputs_file,
    write_verified_files,
)
from lumped.common.checks import require_present
from meshes import MeshSize, SpurGear
from meshes.crack import Crack
from meshes.helical import HelicalGear, HelicalInternalGear

Arrays = dict[str, NDArray[Any]]
ARRAYS = "arrays.npz"
Body = TypeVar("Body")  # a dataclass of numbers and arrays
FORMAT = 6  # raise when geometry, mesh, elasticity or the file layout change


def cache_directory() -> Path:
    """FEGEAR_CACHE_DIR, or the user's cache directory."""
    chosen = os.environ.get("FEGEAR_CACHE_DIR")
    if chosen:
        return Path(chosen)
    import platformdirs

    return Path(platformdirs.user_cache_dir("fegear"))


def inputs_of(
    gear: SpurGear, material: PlaneMaterial, size: MeshSize, order: int = 2
) -> dict[str, Any]:
    """All that determines a sector, this format and the libraries that matter."""
    return {
        "format": FORMAT,
        "gear": asdict(gear),
        "material": asdict(material.section),
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

    name : of the quantity, with which the directory's name begins
    inputs : plain values on which it depends besides the sector
    """
    of_sector = inputs_of(sector.gear, sector.material, sector.size, sector.order)
    if sector.cracks:
        of_sector["cracks"] = [asdict(crack) for crack in sector.cracks]
    return kept_arrays(name, of_sector | {"inputs": dict(inputs)}, compute)


def kept_arrays(
    name: str, inputs: Mapping[str, Any], compute: Callable[[], Arrays]
) -> Arrays:
    """Arrays of all these inputs, read from disk where they were computed before."""
    inputs = {**inputs, "name": name}
    directory = directory_of_inputs(cache_directory(), name, inputs)
    with suppress(InputError):
        contents = read_verified_files(directory, inputs, [ARRAYS])
        if contents is not None:
            return unpack(contents[ARRAYS])
    arrays = compute()
    with suppress(InputError):  # next time it is computed again, which is only slower
        write_verified_files(
            directory, with_inputs_file(inputs, {ARRAYS: pack(arrays)})
        )
    return arrays


def cached_body(
    name: str,
    sector: CyclicSector,
    inputs: Mapping[str, Any],
    compute: Callable[[], Body],
    kind: Callable[..., Body],
) -> Body:
    """`cached_arrays` of a dataclass, whose fields are arrays and numbers."""
    arrays = cached_arrays(name, sector, inputs, lambda: _arrays_of(compute()))
    return kind(**_plain(arrays))


def _arrays_of(values: Any) -> Arrays:
    """Numbers and arrays of a dataclass, without what it is of."""
    names = (f.name for f in fields(values) if f.name not in ("origin", "gear"))
    return {name: np.asarray(getattr(values, name)) for name in names}


def _plain(arrays: Arrays) -> dict[str, Any]:
    return {n: v if v.ndim else v.item() for n, v in arrays.items()}


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
    """`flank_compliance`, read from disk where it was computed before.

    In teeth of their width that in plane strain and what the width adds.
    """
    size = size or MeshSize()
    if material.plane == "width":
        section = cached_flank_compliance(gear, material.section, size, order, split)
        return _cached_width_correction(gear, material).added_to(section, gear)

    def compute() -> Arrays:
        sector = cyclic_sector(gear, material, size, order)
        return _arrays_of(flank_compliance(sector, split))

    inputs = inputs_of(gear, material, size, order) | {"split": split}
    plain = _plain(kept_arrays("flank", inputs, compute))
    has_origin = split and order == 2
    origin = FlankOrigin(gear, material, size) if has_origin else None
    return FlankCompliance(**plain, origin=origin)


def _cached_width_correction(
    gear: SpurGear, material: PlaneMaterial
) -> WidthCorrection:
    """`width_correction`, read from disk where it was computed before."""
    size = MeshSize().refined(MESH_REFINEMENT)
    return cached_body(
        "width",
        cyclic_sector(gear, material, size),
        {"width": material.width, "layers": list(END_LAYERS)},
        lambda: width_correction(gear, material),
        WidthCorrection,
    )


def cached_wide_flank(
    gear: SpurGear, material: PlaneMaterial, size: MeshSize
) -> WideFlank:
    """`wide_flank` of a gear of the material's width, its finite elements from disk."""
    right_handed = _right_handed(gear)
    if right_handed is not gear:
        return cached_wide_flank(right_handed, material, size).mirrored
    modes = _cached_width_modes(gear, material, lambda: width_modes(gear, material))
    section = cached_flank_compliance(gear, material.section, size)
    return wide_flank(gear, section, modes, _width_of(material))


def cached_wide_root(
    gear: SpurGear, material: PlaneMaterial, size: MeshSize
) -> WideRoot:
    """Root stress over the material's width, its finite elements from disk.

    Those of `cached_wide_flank` are solved with them where neither is on disk.
    """
    right_handed = _right_handed(gear)
    if right_handed is not gear:
        return cached_wide_root(right_handed, material, size).mirrored
    modes = cached_root_modes(gear, material)
    section = cached_root_influence(gear, material.section, size)
    return WideRoot(section, modes, _width_of(material))


def cached_root_modes(gear: SpurGear, material: PlaneMaterial) -> RootModes:
    """`width_and_root_modes` of a right-handed gear, both kept on disk."""

    def compute() -> RootModes:
        modes, root = width_and_root_modes(gear, material)
        _cached_width_modes(gear, material, lambda: modes)
        return root

    return _cached_modes("root_over_width", gear, material, compute, RootModes)


def _cached_width_modes(
    gear: SpurGear, material: PlaneMaterial, compute: Callable[[], WidthModes]
) -> WidthModes:
    return _cached_modes("modes_over_width", gear, material, compute, WidthModes)


def _cached_modes(
    name: str,
    gear: SpurGear,
    material: PlaneMaterial,
    compute: Callable[[], Body],
    kind: Callable[..., Body],
) -> Body:
    inputs = {
        "width": _width_of(material),
        "degree": DEGREE,
        "layers": SHORT_END_LAYERS,
    }
    sector = cyclic_sector(gear, material, MESH)
    return cached_body(name, sector, inputs, compute, kind)


def _width_of(material: PlaneMaterial) -> float:
    return require_present(material.width, "width")


def _right_handed(gear: SpurGear) -> SpurGear:
    """The gear, or one with the helix in the other direction if it is left-handed."""
    if isinstance(gear, HelicalGear | HelicalInternalGear) and gear.twist < 0.0:
        return replace(gear, helix_angle=-gear.helix_angle)
    return gear


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

    def compute() -> Arrays:
        return _arrays_of(root_influence(cyclic_sector(gear, material, size)))

    arrays = kept_arrays("root", inputs_of(gear, material, size), compute)
    return RootInfluence(gear, **_plain(arrays))


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
