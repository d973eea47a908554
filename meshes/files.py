"""Mesh files in the formats that meshio writes, such as .msh and .vtu."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from meshes.profile import turn
from meshes.sector import SectorMesh

FORMATS = {".msh": "gmsh", ".vtu": "vtu"}


def write_mesh(mesh: SectorMesh, path: Path, copies: int = 1, teeth: int = 1) -> None:
    """Write a sector, or `copies` of it side by side, with coordinates in metres.

    Sectors keep nodes of their own on their cuts. Second-order triangles carry the
    cell array `tooth`, counted clockwise from the one along y. Raises ValueError
    for a file name with another ending.
    """
    import meshio

    path = Path(path)
    if path.suffix not in FORMATS:
        known = " or ".join(FORMATS)
        raise ValueError(f"file name must end in {known}, got {path.name!r}")
    count = len(mesh.points)
    angles = 2.0 * np.pi * np.arange(copies) / teeth
    points = np.vstack([turn(mesh.points, angle) for angle in angles])
    points = np.column_stack([points, np.zeros(len(points))])
    triangles = np.vstack([mesh.triangles + i * count for i in range(copies)])
    tooth = np.repeat(np.arange(copies), len(mesh.triangles))
    data = {"tooth": [tooth]}
    if path.suffix == ".msh":
        data |= {"gmsh:physical": [tooth + 1], "gmsh:geometrical": [tooth + 1]}
    meshio.write(
        path,
        meshio.Mesh(points, [("triangle6", triangles)], cell_data=data),
        file_format=FORMATS[path.suffix],
    )
