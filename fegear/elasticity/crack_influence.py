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

from fegear.elasticity.crack_tip import TipField, tip_field
from fegear.elasticity.damaged_ring import FLANK_SIDES, DamagedRing
from fegear.elasticity.flank import MAX_TOOTH_OFFSET, SectorLoads, flamant_displacement
from fegear.elasticity.flank_grid import flank_stencils
from fegear.elasticity.root_stress import FlankLoad, broadcast_loads, near_load
from fegear.elasticity.sector import RIGHT, CyclicSector
from fegear.elasticity.tooth_loads import load_angles
from lumped.common.array_types import Array

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
        By crack (that of the right fillet first), loaded flank (the right one first),
        tooth clockwise from the cracked one, point of load, its direction (normal,
        rootward) and mode: K_I and K_II per unit line load [1/m^0.5]. K_II is positive
        where the face to the left of the crack, looking from its mouth to its tip,
        moves toward the tip.
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
    return replace(ring, healthy=replace(ring.healthy, size=size), cracked=cracked)


def _intensities(ring: DamagedRing, tooth: int) -> tuple[Array, Array]:
    """Stress intensities by both methods, shaped as in `CrackInfluence`."""
    sector = ring.cracked[tooth]
    mesh = sector.mesh
    nodes = mesh.points, mesh.triangles, sector.node_dofs
    tips = [tip_field(*nodes, tip, sector.material) for tip in mesh.tips]
    weights = _tip_weights(sector, tips)
    weights = np.ascontiguousarray(weights[sector.interior])  # no tip is on a cut
    adjoint = sector.condensation.solve(weights)
    by_cuts = -weights.T @ sector.condensation.response
    n = len(sector.flanks[RIGHT].arcs)
    offsets = range(-MAX_TOOTH_OFFSET, MAX_TOOTH_OFFSET + 1)
    tables = np.zeros((len(tips), 2, 2, len(FLANK_SIDES), len(offsets), 2, n))
    for side in FLANK_SIDES:
        for row, offset in enumerate(offsets):
            source = (tooth + offset) % ring.teeth
            ends = ring.displacement(tooth, source, ring.on_cuts(source, side))
            values = by_cuts @ ends
            if source == tooth:
                loads = ring.loads(tooth, side).loads
                values += _of_held(sector, adjoint, loads) - by_cuts @ loads.jump
                if ring.split:
                    values += _of_half_plane(sector, tips, side)
            tables[:, :, :, side, row] = values.reshape(len(tips), 2, 2, 2, n)
    # tip, method, mode, flank, tooth, direction, point
    intensity, correlated = np.transpose(tables, (1, 0, 3, 4, 6, 5, 2))
    return np.ascontiguousarray(intensity), np.ascontiguousarray(correlated)


def _tip_weights(sector: CyclicSector, tips: Sequence[TipField]) -> Array:
    """Weights (freedoms, 4 tips) of displacement: two modes by each of two methods."""
    columns = []
    for tip in tips:
        for rows in (*tip.interaction, *tip.correlation):
            column = np.zeros(sector.basis.N)
            column[tip.rows] = rows
            columns.append(column)
    return np.stack(columns, axis=1)


def _of_held(sector: CyclicSector, adjoint: Array, loads: SectorLoads) -> Array:
    """Intensities (4 tips, 2 n) of the remainder in a loaded sector with held cuts.

    adjoint : (interior, 4 tips) displacement under the weights as loads, which by
        Maxwell's theorem are the weights of loads
    """
    load = loads.force - sector.stiffness[:, sector.hub] @ loads.hub
    return np.asarray(adjoint.T @ load[sector.interior])


def _of_half_plane(sector: CyclicSector, tips: Sequence[TipField], side: int) -> Array:
    """Intensities (4 tips, 2 n) of Flamant's displacement, which is smooth there."""
    values = []
    for tip in tips:
        pairs = np.unique(tip.dofs.reshape(-1, 2), axis=0).ravel()
        angles = load_angles(side)
        fields = [flamant_displacement(sector, pairs, angle, side) for angle in angles]
        rows = np.vstack([tip.interaction, tip.correlation])
        values.append(rows[:, np.searchsorted(tip.rows, pairs)] @ np.hstack(fields))
    return np.vstack(values)
