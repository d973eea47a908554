"""Stress at the nodes of a sector, for tests that compare with it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fegear.elasticity.body_stress import von_mises
from fegear.elasticity.sector import CyclicSector
from fegear.rendering.sector_field import loadable_gear
from meshes import MeshSize


def nodal_state(field):
    """State (nodes, 5) of a `SectorField` at the nodes of its sector mesh."""
    return field.smooth + field.local(field.body.sector.mesh.points)


@dataclass(frozen=True)
class SectorStress:
    """components : (nodes, 3) as (xx, yy, xy) in the tooth frame [Pa]."""

    sector: CyclicSector
    components: np.ndarray

    @property
    def von_mises(self):
        out_of_plane = self.sector.material.out_of_plane(self.components)
        return von_mises(self.components, out_of_plane)

    @property
    def root_stress(self):
        """Largest tension along the fillet on the loaded side [Pa]."""
        nodes = np.unique(self.sector.mesh.edges["fillet"])
        return float(self.components[nodes, :2].sum(axis=1).max())


def sector_stress(gear, material, loads, size=None):
    """Stress of the sector with tooth 0; loads may act on any teeth."""
    sector = CyclicSector(gear, material, size or MeshSize())
    (field,) = loadable_gear(sector).sectors(loads, [0])
    return SectorStress(sector, nodal_state(field)[:, 2:])
