"""Mesh files in the formats that meshio writes, such as .msh and .vtu."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from meshes.profile import Points, turn
from meshes.sector import SectorMesh

# gmsh cannot open version 4 of its own format as written by meshio, without entities
FORMATS = {".msh": "gmsh22", ".vtu": "vtu"}


def write_mesh(mesh: SectorMesh, path: Path, copies: int = 1, teeth: int = 1) -> None:
    """Write a sector, or `copies` of it side by side, with coordinates in metres.

    Sectors do not share nodes on their cuts. Second-order triangles have the cell array
    `tooth`, numbered clockwise from 0 for the tooth along y, and form physical groups
    `tooth 1`, `tooth 2`, ... in .msh files. Raises ValueError for a file name with
    another extension.
    """
    count = len(mesh.points)
    angles = 2.0 * np.pi * np.arange(copies) / teeth
    points = np.vstack([turn(mesh.points, angle) for angle in angles])
    triangles = np.vstack([mesh.triangles + i * count for i in range(copies)])
    tooth = np.repeat(np.arange(copies), len(mesh.triangles))
    names = [f"tooth {number + 1}" for number in range(copies)]
    write_triangles(path, points, triangles, "tooth", tooth, names)


def write_triangles(
    path: Path,
    points: Points,
    triangles: NDArray[np.int64],
    kind: str,
    part: NDArray[np.int64],
    names: Sequence[str],
) -> None:
    """Write second-order triangles (m, 6), coordinates in metres.

    part : (m,) part to which each triangle belongs, from 0, the cell array `kind`
    names : names of the parts, physical groups in .msh files

    Raises ValueError for a file name with another extension.
    """
    import meshio

    path = Path(path)
    ending = path.suffix.lower()
    if ending not in FORMATS:
        extensions = " or ".join(FORMATS)
        raise ValueError(f"file name = {path.name!r}; must end in {extensions}")
    data, groups = {kind: [part]}, {}
    if ending == ".msh":
        data |= {"gmsh:physical": [part + 1], "gmsh:geometrical": [part + 1]}
        groups = {name: np.array([i + 1, 2]) for i, name in enumerate(names)}
    space = np.column_stack([points, np.zeros(len(points))])
    meshio.write(
        path,
        meshio.Mesh(space, [("triangle6", triangles)], None, data, groups),
        file_format=FORMATS[ending],
    )
