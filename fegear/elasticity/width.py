"""Teeth of their true width under loads that are uniform over it.

A tooth of finite width is softer than one in plane strain: at its free ends material
can move along the axis. The difference is found by finite elements on one mesh, so that
the singular errors of a point load cancel, and added to the flank compliance in plane
strain, whose half-plane part is exact. Displacement is the mean over the width.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fegear.elasticity.condensed_width import width_tables
from fegear.elasticity.flank import FlankCompliance, flank_compliance
from fegear.elasticity.material import PlaneMaterial
from fegear.elasticity.sector import cyclic_sector
from fegear.elasticity.twisted_sector import TwistedSector
from fegear.elasticity.wide_sector import WideSector
from fegear.elasticity.width_functions import (
    END_LAYERS,
    layered_functions,
)
from lumped.common.array_types import Array
from meshes import MeshSize, SpurGear

SPLINE_DEGREE = 3  # over the flank
MESH_REFINEMENT = 0.4  # of the default mesh, whose errors cancel in the difference


@dataclass(frozen=True, eq=False)
class WidthCorrection:
    """Flank compliance of teeth of a width less that in plane strain [m/(N/m)].

    normal, tangential : (teeth, n, n), as in `FlankCompliance`, at points of a mesh
    """

    normal: Array
    tangential: Array

    def added_to(self, compliance: FlankCompliance, gear: SpurGear) -> FlankCompliance:
        """The compliance of a gear's teeth of that width."""
        table_places = flank_places(gear, self.normal.shape[1])
        places = flank_places(gear, compliance.normal.shape[1])
        tables = (
            interpolated(table, table_places, places)
            for table in (self.normal, self.tangential)
        )
        normal, tangential = tables
        return replace(
            compliance,
            normal=compliance.normal + normal,
            tangential=compliance.tangential + tangential,
        )


def interpolated(
    table: Array, table_places: Array, places: Array, axes: tuple[int, ...] = (1, 2)
) -> Array:
    """A table of flank places along its axes, such as (teeth, n, n), at others."""
    from scipy.interpolate import make_interp_spline

    for axis in axes:
        spline = make_interp_spline(table_places, table, SPLINE_DEGREE, axis=axis)
        # the result has the interpolated axis in its place
        table = spline(places)
    return table


def flank_places(gear: SpurGear, count: int) -> Array:
    """Places of so many points of a flank, in equal steps from vertex to vertex.

    Corners at the ends are none, see `FlankPoints`; the vertices of meshes of any size
    are graded alike.
    """
    if gear.is_undercut:
        return np.linspace(0.0, 1.0, count + 2)[1:-1]
    return np.linspace(0.0, 1.0, count + 1)[1:]


def width_correction(gear: SpurGear, material: PlaneMaterial) -> WidthCorrection:
    """Mean displacement of teeth of the material's width less that in plane strain."""
    if material.width is None:
        raise ValueError(f"plane = {material.plane}; must be width")
    sector = cyclic_sector(gear, material, MeshSize().refined(MESH_REFINEMENT))
    layers = [layer * gear.module for layer in END_LAYERS]
    wide = WideSector(TwistedSector(sector), layered_functions(material.width, layers))
    plane = flank_compliance(sector, split=False)
    # the mean over the width of displacement under loads of one per width
    tables = width_tables(wide)
    normal, tangential = (
        table[:, :, 0, :, 0] / material.width
        for table in (tables.normal, tables.rootward)
    )
    return WidthCorrection(normal - plane.normal, tangential - plane.tangential)
