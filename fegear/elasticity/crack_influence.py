"""Stress intensities of a crack in a tooth under loads on the flanks of a gear.

They are linear in loads, so that a gear is solved once for all positions of load. The
stated error is the change from a mesh half as fine, of which that of a mesh with this
order of convergence is a fraction. A crack is open in the solution: where the loads
together press its faces onto each other, K_I is negative and means only that.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fegear.elasticity.body_stress import ROOTWARD
from fegear.elasticity.crack_tip import TipField, tip_field
from fegear.elasticity.damaged_ring import SIDES, DamagedRing
from fegear.elasticity.flank import (
    MAX_TOOTH_OFFSET,
    SectorRows,
    flamant_displacement,
    sector_field,
)
from fegear.elasticity.flank_grid import flank_stencils
from fegear.elasticity.root_stress import FlankLoad, broadcast_loads, near_load
from fegear.elasticity.sector import LEFT, RIGHT, CyclicSector

Array = NDArray[np.float64]
COARSER = 0.5  # refinement of the mesh by which the error is estimated


@dataclass(frozen=True, eq=False)
class CrackInfluence:
    """Stress intensities of the cracks of one tooth under unit loads.

    Attributes
    ----------
    teeth : int
        Number of teeth of the gear.
    modulus : float
        E' of the plane state [Pa].
    flank_length, grading, both_ends
        Of the points of load, as `flank_stencils` takes them.
    arcs : (n,) array
        Points of load from the tip corner [m].
    intensity : (tips, 2, 2 MAX_TOOTH_OFFSET + 1, n, 2, 2) array
        By crack (that of the right fillet first), loaded flank (RIGHT, LEFT), tooth
        clockwise from the cracked one, point of load, its direction (normal, rootward)
        and mode: K_I and K_II per unit line load [1/m^0.5]. K_II is positive where the
        face to the left of the crack, looking from its mouth to its tip, moves toward
        the tip.
    error : array of the same shape
        Change from a coarser mesh.
    correlated : array of the same shape
        The same intensities by displacement correlation.
    """

    teeth: int
    modulus: float
    flank_length: float
    grading: float
    both_ends: bool
    arcs: Array
    intensity: Array
    error: Array
    correlated: Array

    def stress_intensity(self, loads: Sequence[FlankLoad]) -> Array:
        """K_I and K_II of each crack under all loads together.

        Parameters
        ----------
        loads : sequence of FlankLoad
            Loads, with teeth counted from the cracked one; those farther than
            MAX_TOOTH_OFFSET from it are left out.

        Returns
        -------
        (..., tips, 2) array
            Intensities [Pa m^0.5], shaped as the loads are.
        """
        return self._sum(self.intensity, loads)

    def stress_intensity_error(self, loads: Sequence[FlankLoad]) -> Array:
        """Estimated error (..., tips, 2) of `stress_intensity` [Pa m^0.5]."""
        return np.abs(self._sum(self.error, loads))

    def energy_release_rate(self, loads: Sequence[FlankLoad]) -> Array:
        """Energy release rate G = (K_I^2 + K_II^2) / E' of each crack under all loads.

        A negative K_I, which closes the crack, releases nothing.

        Returns
        -------
        (..., tips) array
            Energy per area of crack [J/m2].
        """
        return self._rate(self.stress_intensity(loads))

    def energy_release_rate_error(self, loads: Sequence[FlankLoad]) -> Array:
        """Estimated error (..., tips) of `energy_release_rate` [J/m2]."""
        intensity = self.stress_intensity(loads)
        coarser = intensity - self._sum(self.error, loads)
        return np.abs(self._rate(intensity) - self._rate(coarser))

    def _rate(self, intensity: Array) -> Array:
        opening, sliding = np.maximum(intensity[..., 0], 0.0), intensity[..., 1]
        return np.asarray((opening**2 + sliding**2) / self.modulus)

    def _sum(self, influence: Array, loads: Sequence[FlankLoad]) -> Array:
        shape = broadcast_loads(loads)
        total = np.zeros((*shape, len(influence), 2))
        for load in loads:
            near = near_load(load, shape, self.teeth, MAX_TOOTH_OFFSET)
            if near is None:
                continue
            index, weights = flank_stencils(
                np.clip(near.arc, self.arcs[0], self.arcs[-1]),
                self.flank_length,
                self.grading,
                len(self.arcs),
                self.both_ends,
            )
            side = 0 if load.flank == RIGHT else 1
            of_tooth = influence[:, side, MAX_TOOTH_OFFSET + near.tooth_offset]
            total[near.loaded] += np.einsum(
                "tp,ctpdm,td->tcm", weights, of_tooth[:, index], near.force
            )
        return total


def crack_influence(
    ring: DamagedRing, tooth: int, coarser: DamagedRing | None = None
) -> CrackInfluence:
    """Compute the stress intensities of the cracks of one tooth.

    Parameters
    ----------
    ring : DamagedRing
        The gear with all its cracks.
    tooth : int
        Cracked tooth.
    coarser : DamagedRing, optional
        The same gear with a mesh by which the error is estimated; by default that is
        one of half the refinement.

    Returns
    -------
    CrackInfluence
        Intensities for loads on both flanks of the teeth around it.
    """
    intensity, correlated = _intensities(ring, tooth)
    gear, arcs = ring.healthy.gear, ring.healthy.flanks[RIGHT].arcs
    length, grading, _, both_ends = ring.healthy.flank_grid
    influence = CrackInfluence(
        gear.teeth,
        ring.healthy.material.modulus,
        length,
        grading,
        both_ends,
        arcs,
        intensity,
        np.zeros_like(intensity),
        correlated,
    )
    coarser = coarser or _coarser(ring)
    coarse, _ = _intensities(coarser, tooth)
    index, weights = flank_stencils(arcs, *coarser.healthy.flank_grid)
    at_arcs = np.einsum("np,cstnpdm->cstndm", weights, coarse[:, :, :, index])
    return replace(influence, error=intensity - at_arcs)


def _coarser(ring: DamagedRing) -> DamagedRing:
    size = ring.healthy.size.refined(COARSER)
    cracked = {t: replace(sector, size=size) for t, sector in ring.cracked.items()}
    return DamagedRing(replace(ring.healthy, size=size), cracked, ring.split)


def _intensities(ring: DamagedRing, tooth: int) -> tuple[Array, Array]:
    """Stress intensities by both methods, shaped as in `CrackInfluence`."""
    sector = ring.cracked[tooth]
    tips = [
        tip_field(
            sector.mesh.points,
            sector.mesh.triangles,
            sector.node_dofs,
            tip,
            sector.material,
        )
        for tip in sector.mesh.tips
    ]
    n = len(sector.flanks[RIGHT].arcs)
    offsets = range(-MAX_TOOTH_OFFSET, MAX_TOOTH_OFFSET + 1)
    tables = np.zeros((2, len(tips), len(SIDES), len(offsets), n, 2, 2))
    for k, tip in enumerate(tips):
        for side in SIDES:
            for row, offset in enumerate(offsets):
                u = _displacement(ring, tooth, tip, side, offset)
                for table, rows in zip(
                    tables, (tip.interaction, tip.correlation), strict=True
                ):
                    values = (rows @ u).reshape(2, 2, n)  # mode, direction, point
                    table[k, side, row] = values.T
    return tables[0], tables[1]


def _displacement(
    ring: DamagedRing, tooth: int, tip: TipField, side: int, offset: int
) -> Array:
    """Displacement (k, 2 n) around a tip under loads on a flank of a tooth."""
    sector = ring.cracked[tooth]
    source = (tooth + offset) % ring.teeth
    held = ring.loads[source].held[side]
    ends = ring.displacement(tooth, source, held.cut_load)
    own_load = held if source == tooth else None
    u = sector_field(sector, SectorRows.of(sector, tip.rows), ends, own_load)
    return u if own_load is None else u + _flamant(sector, tip, side, ring.split)


def _flamant(sector: CyclicSector, tip: TipField, side: int, split: bool) -> Array:
    """Flamant's displacement (k, 2 n) around a tip."""
    angles = 0.0, ROOTWARD if side != LEFT else -ROOTWARD
    count = 2 * len(sector.flanks[side].arcs)
    if not split:
        return np.zeros((len(tip.rows), count))
    dofs = tip.dofs.reshape(-1, 2)
    order = np.unique(dofs[:, 0], return_index=True)[1]
    pairs = dofs[order].ravel()
    fields = [flamant_displacement(sector, pairs, angle, side) for angle in angles]
    u = np.empty((len(tip.rows), count))
    u[np.searchsorted(tip.rows, pairs)] = np.hstack(fields)
    return u
