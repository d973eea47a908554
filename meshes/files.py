"""Mesh files in the formats that meshio writes, such as .msh and .vtu."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from meshes.profile import Points, turn
from meshes.sector import SectorMesh

FORMATS = {".msh": "gmsh", ".vtu": "vtu"}


def write_mesh(mesh: SectorMesh, path: Path, copies: int = 1, teeth: int = 1) -> None:
    """Write a sector, or `copies` of it side by side, with coordinates in metres.

    Sectors keep nodes of their own on their cuts. Second-order triangles carry the
    cell array `tooth`, counted clockwise from the one along y. Raises ValueError
    for a file name with another ending.
    """
    count = len(mesh.points)
    angles = 2.0 * np.pi * np.arange(copies) / teeth
    points = np.vstack([turn(mesh.points, angle) for angle in angles])
    triangles = np.vstack([mesh.triangles + i * count for i in range(copies)])
    tooth = np.repeat(np.arange(copies), len(mesh.triangles))
    write_triangles(path, points, triangles, "tooth", tooth)


def write_triangles(
    path: Path,
    points: Points,
    triangles: NDArray[np.int64],
    name: str,
    part: NDArray[np.int64],
) -> None:
    """Write second-order triangles (m, 6) and the part that each belongs to (m,), from
    0, as a cell array. Raises ValueError for a file name with another ending."""
    import meshio

    path = Path(path)
    if path.suffix not in FORMATS:
        known = " or ".join(FORMATS)
        raise ValueError(f"file name must end in {known}, got {path.name!r}")
    data = {name: [part]}
    if path.suffix == ".msh":
        data |= {"gmsh:physical": [part + 1], "gmsh:geometrical": [part + 1]}
    space = np.column_stack([points, np.zeros(len(points))])
    meshio.write(
        path,
        meshio.Mesh(space, [("triangle6", triangles)], cell_data=data),
        file_format=FORMATS[path.suffix],
    )
