"""Tooth geometry and second-order sector meshes of spur gears."""

from meshes.gear import GeometryError, SpurGear
from meshes.pairing import GearPair
from meshes.sector import MeshSize, SectorMesh, sector_mesh

__all__ = [
    "GearPair",
    "GeometryError",
    "MeshSize",
    "SectorMesh",
    "SpurGear",
    "sector_mesh",
]
