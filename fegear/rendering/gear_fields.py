"""Displacement and stress at the nodes of a gear, and pressure of a tooth pair."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fegear.elasticity.body_stress import von_mises
from fegear.rendering.frames import Frame
from lumped.common.array_types import Array, Indices
from lumped.common.short_repr import ShortRepr


@dataclass(frozen=True, eq=False)
class GearField(ShortRepr):
    """One gear's visible teeth, every sector with nodes of its own.

    points : (n, 2); triangles : (m, 6) corners counterclockwise, then mid-sides
    tooth : (m,) tooth of each triangle, counted as pairs are, 0 in the reference pair
    outline : (k, 3) boundary edges, end, mid-side, end; fillet : nodes on fillets
    displacement : (n, 2) elastic, with the hub held [m]
    hub_motion : (n, 2) rigid turn of the hub that keeps the flanks in contact [m]
    stress : (n, 3) xx, yy, xy [Pa]; out_of_plane : (n,) zz
    layer : 0 in front, other gears behind it
    """

    name: str
    center: Array
    points: Array
    triangles: Indices
    tooth: Indices
    outline: Indices
    fillet: Indices
    displacement: Array
    hub_motion: Array
    stress: Array
    out_of_plane: Array
    is_internal: bool = False
    layer: int = 0

    def moved(self, frame: Frame) -> GearField:
        """The gear with all its fields, its world in a frame."""
        return replace(
            self,
            center=frame.places(self.center),
            points=frame.places(self.points),
            displacement=frame.vectors(self.displacement),
            hub_motion=frame.vectors(self.hub_motion),
            stress=frame.stresses(self.stress),
        )

    @property
    def motion(self) -> Array:
        """Displacement from the gears touching without load, (n, 2) [m]."""
        return self.displacement + self.hub_motion

    @property
    def von_mises(self) -> Array:
        """Equivalent stress (n,) [Pa]."""
        return von_mises(self.stress, self.out_of_plane)

    @property
    def principal_1(self) -> Array:
        """Largest principal stress in the plane, tension positive (n,) [Pa]."""
        x, y, xy = self.stress.T
        return 0.5 * (x + y) + np.hypot(0.5 * (x - y), xy)

    @property
    def elastic_shift(self) -> Array:
        """Length of the elastic displacement (n,) [m]."""
        return np.hypot(*self.displacement.T)


@dataclass(frozen=True, eq=False)
class PairField(ShortRepr):
    """Contact pressure of one tooth pair.

    mesh : index of its mesh among those that are solved
    tooth : base pitches by which the pair is ahead of the reference pair
    points : (n, 2) contact nodes, without load, on the driver's flank
    normals : (n, 2) unit, out of the driver's flank
    motion : (n, 2) of the nodes with the driver [m]
    pressure : (n,) of plane strain [Pa]; load : normal force of the pair [N]
    has_edge : whether a tip corner or a kink of a flank is in contact: the
        largest pressure then follows the contact grid and has no limit
    """

    tooth: int
    points: Array
    normals: Array
    motion: Array
    pressure: Array
    load: float
    has_edge: bool
    mesh: int = 0

    def moved(self, frame: Frame) -> PairField:
        """The pair, its world in a frame."""
        return replace(
            self,
            points=frame.places(self.points),
            normals=frame.vectors(self.normals),
            motion=frame.vectors(self.motion),
        )

    @property
    def center(self) -> Array:
        """Point at which the resultant of the load acts, (2,)."""
        return self.pressure @ self.points / self.pressure.sum()
