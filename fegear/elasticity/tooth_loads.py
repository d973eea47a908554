"""Loads on the teeth of a ring."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fegear.elasticity.body_stress import ROOTWARD
from fegear.elasticity.flank import SectorLoads, flamant_loads, join_loads, nodal_loads
from fegear.elasticity.sector import RIGHT, CyclicSector
from lumped.common.array_types import Array


@dataclass(frozen=True, eq=False)
class ToothLoads:
    """Unit loads on a flank of a tooth, and what its cuts feel of them.

    loads : n normal loads and then n toward the root
    on_cuts : (cut, 2 n) polar forces that the ring feels
    """

    loads: SectorLoads
    on_cuts: Array


def tooth_loads(sector: CyclicSector, side: int, split: bool = True) -> ToothLoads:
    """Loads on a flank of a sector; no system is solved but for its cuts."""
    make_loads = flamant_loads if split else nodal_loads
    loads = join_loads([make_loads(sector, angle, side) for angle in load_angles(side)])
    return ToothLoads(loads, _cut_load(sector, loads))


def load_angles(side: int) -> tuple[float, float]:
    """Angles of normal loads and of those toward the root, as of `flamant_loads`."""
    return 0.0, ROOTWARD if side == RIGHT else -ROOTWARD  # a mirror image


def _cut_load(sector: CyclicSector, loads: SectorLoads) -> Array:
    """`HeldSolution.cut_load` by Maxwell's theorem.

    What displacement of the cuts does to the interior, loads there do to the cuts.
    """
    condensed = sector.condensation
    load = loads.force - sector.stiffness[:, sector.hub] @ loads.hub
    on_cuts = sector.polar.T @ load[sector.cut]
    on_cuts -= condensed.response.T @ load[sector.interior]
    return np.asarray(on_cuts + condensed.superelement @ loads.jump)
