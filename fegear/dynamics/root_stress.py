"""The root stress of a tooth in motion.

It is the static stress under the contact loads of the instant: the elastic inertia of
the tooth itself is left out. Loads count on the tooth and on the two next to it on
either side; those on teeth farther away are neglected. A load on the third tooth adds
up to 4 % of what it would cause on the tooth itself, one half a turn away 0.1 %.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline

from fegear.elasticity.body_stress import ROOTWARD, nodal_stress
from fegear.elasticity.flank import flamant_loads, ring_fields
from fegear.elasticity.sector import LEFT, RIGHT, CyclicSector
from meshes import SectorMesh, SpurGear
from meshes.profile import flank_frame

Array = NDArray[np.float64]
MAX_TOOTH_OFFSET = 2  # teeth on either side of the stressed one whose loads count


class FlankLoad(NamedTuple):
    """Load on one tooth over time; arrays of equal shape, or scalars.

    tooth : clockwise from the stressed one, any multiple of all teeth apart
    flank : RIGHT or LEFT, seen with the tooth pointing up
    arc : of the load's centre from the tip corner [m]
    normal, rootward : into the flank and toward the root [N/m]
    """

    tooth: int
    flank: int
    arc: ArrayLike
    normal: ArrayLike
    rootward: ArrayLike = 0.0


@dataclass(frozen=True, eq=False)
class RootInfluence:
    """Stress along the fillets of one tooth under loads on it and its neighbours.

    The fillets are free, so their only stress is the trace. Loads are on right
    flanks; those on left flanks are their mirror images.

    fillets : (2, f, 2) points of the right fillet and, mirrored, of the left one [m]
    arcs : (n,) of the points of load from the tip corner [m]
    remainder : (2 MAX_TOOTH_OFFSET + 1, n, 2, 2, f) by loaded tooth, point of load,
        direction (normal, rootward), fillet and its point [1/m]; of the tooth itself
        without the stress of the half-plane tangent to the flank, which is that of a
        point load
    """

    gear: SpurGear
    fillets: Array
    arcs: Array
    remainder: Array

    def stress(self, loads: Sequence[FlankLoad]) -> Array:
        """Largest tension along both fillets under all loads, shaped as they are [Pa].

        It is 0 without load.
        """
        return self.along_fillets(loads).max(axis=(-2, -1))

    def along_fillets(self, loads: Sequence[FlankLoad]) -> Array:
        """Stress (..., 2, f) of the right and left fillet [Pa]."""
        shapes = [np.broadcast_shapes(*map(np.shape, load[2:])) for load in loads]
        shape = np.broadcast_shapes(*shapes)
        total = np.zeros((*shape, *self.fillets.shape[:2]))
        half = self.gear.teeth // 2
        for load in loads:
            if load.flank not in (RIGHT, LEFT):
                raise ValueError(f"flank must be {RIGHT} or {LEFT}, got {load.flank}")
            tooth_offset = (load.tooth + half) % self.gear.teeth - half
            if abs(tooth_offset) > MAX_TOOTH_OFFSET:
                continue
            arc, *forces = (np.broadcast_to(part, shape) for part in load[2:])
            force = np.stack(forces, axis=-1)
            loaded = force.any(axis=-1)
            side = 1 if load.flank == RIGHT else -1
            stress = self._under(side * tooth_offset, arc[loaded], force[loaded])
            total[loaded] += stress[..., ::side, :]
        return total

    def _under(self, tooth: int, arc: Array, forces: Array) -> Array:
        """Stress (t, 2, f) under forces (t, 2) on a right flank at arcs (t,)."""
        inside = np.clip(arc, self.arcs[0], self.arcs[-1])
        smooth = CubicSpline(self.arcs, self.remainder[MAX_TOOTH_OFFSET + tooth])
        influence = smooth(inside)
        if tooth == 0:
            influence = influence + _half_plane(self.gear, inside, self.fillets)
        return np.einsum("td,tdsf->tsf", forces, influence)


def root_influence(sector: CyclicSector) -> RootInfluence:
    """Solve once for all places of load on a gear whose hub is held."""
    rows, mesh = _fillet_nodes(sector.mesh), sector.mesh
    stress = nodal_stress(sector)
    trace = stress[rows.ravel()] + stress[len(mesh.points) + rows.ravel()]
    teeth, arcs = (
        range(-MAX_TOOTH_OFFSET, MAX_TOOTH_OFFSET + 1),
        sector.flanks[RIGHT].arcs,
    )
    remainder = []
    for angle in (0.0, ROOTWARD):
        # what a load on tooth j does to tooth 0, tooth 0 does to tooth -j
        fields = ring_fields(sector, flamant_loads(sector, angle), teeth)
        remainder.append(np.stack([(trace @ fields[-tooth]).T for tooth in teeth]))
    shape = (len(teeth), len(arcs), 2, *rows.shape)
    together = np.stack(remainder, axis=2).reshape(shape)
    return RootInfluence(sector.gear, mesh.points[rows], arcs, together)


def _fillet_nodes(mesh: SectorMesh) -> NDArray[np.int64]:
    """Nodes (2, f) of the right fillet, and of the left one in the same order."""
    right, first_index = np.unique(mesh.edges["fillet"], return_index=True)
    return np.stack([right, mesh.edges["left_fillet"].ravel()[first_index]])


def _half_plane(gear: SpurGear, arc: Array, points: Array) -> Array:
    """Trace (t, 2, 2, f) of Flamant's stress at points (2, f, 2) [1/m].

    Under unit normal and rootward point loads at arcs (t,) of a right flank;
    -2 cos(theta) / (pi r) is radial, Timoshenko & Goodier, article 36.
    """
    origin, inward = flank_frame(gear, arc)
    rootward = np.stack([-inward[:, 1], inward[:, 0]], axis=1)
    offset = points - origin[:, None, None]
    radial_component = np.einsum("dtc,tsfc->tdsf", np.stack([inward, rootward]), offset)
    squared = (offset**2).sum(axis=-1)[:, None]
    at_load = squared == 0.0  # the fillet begins where the flank ends
    return -2.0 / math.pi * radial_component / np.where(at_load, np.inf, squared)
