"""A ring on lugs: springs at equally spaced places of its outside.

Between its lugs a ring rests on its foundation, which may be very soft, and bends. Lugs
are a change of low rank of a ring that is equal in all sectors: with C the compliance
of that ring at the lugs and k their stiffnesses, their forces under loads that would
displace them by d are -(1/k + C)^-1 d (Woodbury's formula). Two loads on one sector,
solved once, give all compliances by Maxwell's theorem.

All per unit face width, as in `fegear.elasticity.sector`. Teeth count as in
`fegear.elasticity.flank.ring_fields`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fegear.elasticity.flank import SectorLoads, ring_fields
from fegear.elasticity.flank_grid import flank_stencils
from fegear.elasticity.sector import RIGHT, CyclicSector
from lumped.common.array_types import Array
from lumped.common.checks import format_number


@dataclass(frozen=True, kw_only=True)
class Lugs:
    """Lugs of a ring, the first one at the sector of tooth 0.

    A lug is as wide as a sector. Its springs take the mean displacement of the outside
    there, so that it does not resist rotation by bending.

    Parameters
    ----------
    count : int
        Number of lugs, 2 or more; it divides the number of teeth.
    radial, tangential : float
        Stiffness of a lug per face width [N/m per m]; infinite for a pin that does not
        give way.
    """

    count: int
    radial: float = math.inf
    tangential: float = math.inf

    def __post_init__(self) -> None:
        if not self.count >= 2:
            raise ValueError(f"count = {self.count}; must be 2 or more")
        for name in ("radial", "tangential"):
            if not getattr(self, name) > 0.0:
                raise ValueError(
                    f"{name} = {format_number(getattr(self, name))}; must be positive"
                )


class ToothForce(NamedTuple):
    """Line load into the right flank of a tooth [N/m], at an arc from its tip [m]."""

    tooth: int
    arc: float
    normal: float


@dataclass(frozen=True)
class RingDeflection:
    """Ring on lugs under loads at rest.

    Attributes
    ----------
    outside : (teeth, 2) array
        Mean displacement of the outside of each sector, outward and clockwise [m].
    lug_forces : (count, 2) array
        Force of each lug on the ring, outward and clockwise [N/m].
    """

    outside: Array
    lug_forces: Array


@dataclass(frozen=True, eq=False)
class RingOnLugs:
    """Compliances of a ring on a foundation and lugs; see `ring_on_lugs`.

    Attributes
    ----------
    sector : CyclicSector
        Sector of the ring without its lugs.
    lugs : Lugs
        Its lugs.
    outside : (teeth, 2, 2) array
        Displacement of the outside of the sector that is so many teeth to the right of
        one whose outside is loaded, by its component and that of the load [m/(N/m)].
    flank : (teeth, points, 2) array
        Inward displacement of the right flank there.
    support : (2 count, 2 count) array
        Forces that lugs exert against displacement of the ring without them [Pa].
    """

    sector: CyclicSector
    lugs: Lugs
    outside: Array
    flank: Array
    support: Array

    @property
    def positions(self) -> NDArray[np.int64]:
        """Tooth (count,) at which each lug is."""
        teeth = self.sector.gear.teeth
        return np.arange(self.lugs.count) * (teeth // self.lugs.count)

    def deflection(
        self, forces: Sequence[ToothForce], outside: Array | None = None
    ) -> RingDeflection:
        """Static deflection of the ring.

        Parameters
        ----------
        forces : sequence of ToothForce
            Loads on right flanks, such as those of planets.
        outside : (teeth, 2) array, optional
            Loads on the outside of sectors, outward and clockwise [N/m].

        Returns
        -------
        RingDeflection
            Displacement of the outside, and forces of the lugs.
        """
        teeth = np.arange(self.sector.gear.teeth)
        free = np.zeros((teeth.size, 2))
        if outside is not None:
            free += self._under(np.asarray(outside, float))
        for force in forces:
            index, weights = flank_stencils(
                np.array([force.arc]), *self.sector.flank_grid
            )
            # what a load on a flank does outside, one outside does to the flank
            rows = self.flank[(force.tooth - teeth) % teeth.size][:, index[0]]
            free += force.normal * np.einsum("tpc,p->tc", rows, weights[0])
        lug_forces = -(self.support @ free[self.positions].ravel()).reshape(-1, 2)
        loads = np.zeros_like(free)
        loads[self.positions] = lug_forces
        return RingDeflection(free + self._under(loads), lug_forces)

    def compliance_change(self, tooth: int) -> Array:
        """What lugs add to the compliance of the right flank of one tooth.

        Parameters
        ----------
        tooth : int
            Tooth whose flank is loaded and observed.

        Returns
        -------
        (points, points) array
            Change of inward displacement per unit inward load, none of its diagonal
            positive [m/(N/m)].
        """
        offsets = (tooth - self.positions) % self.sector.gear.teeth
        rows = self.flank[offsets].transpose(1, 0, 2).reshape(self.flank.shape[1], -1)
        return -rows @ self.support @ rows.T

    def _under(self, loads: Array) -> Array:
        """Displacement (teeth, 2) of the ring without lugs, outside loaded."""
        teeth = np.arange(len(loads))
        total = np.zeros_like(loads)
        for source in np.flatnonzero(loads.any(axis=1)):
            total += self.outside[(teeth - source) % teeth.size] @ loads[source]
        return total


def ring_on_lugs(sector: CyclicSector, lugs: Lugs) -> RingOnLugs:
    """Compliances of a ring on lugs, from two solutions for one sector.

    Parameters
    ----------
    sector : CyclicSector
        Sector of a ring on a foundation, of which the lugs are no part.
    lugs : Lugs
        Lugs of the ring.

    Returns
    -------
    RingOnLugs
        Compliances, for all positions of loads.

    Raises
    ------
    ValueError
        If the outside is held or the number of lugs does not divide that of the teeth.
    """
    teeth = sector.gear.teeth
    if sector.foundation is None:
        raise ValueError(
            "foundation = None; lugs need a ring whose outside is not held"
        )
    if teeth % lugs.count:
        raise ValueError(
            f"count = {lugs.count}; must divide the number of teeth, {teeth}"
        )
    mean = _mean_outside(sector)
    nothing = [np.zeros((len(part), 2)) for part in (sector.hub, sector.cut)]
    points = sector.flanks[RIGHT]
    rows = np.flatnonzero(mean.any(axis=1))
    dofs = np.concatenate([rows, points.dofs.ravel()])
    fields = ring_fields(sector, SectorLoads(mean, *nothing), range(teeth), dofs)
    field = np.stack([fields[tooth] for tooth in range(teeth)])
    outside = np.einsum("rc,trd->tcd", mean[rows], field[:, : rows.size])
    at_flank = field[:, rows.size :].reshape(teeth, *points.dofs.shape, 2)
    flank = np.einsum("tpcd,pc->tpd", at_flank, points.inward)
    step, lug = teeth // lugs.count, np.arange(lugs.count)
    between = outside[(lug[:, None] - lug) * step % teeth]  # (n, n, 2, 2)
    size = 2 * lugs.count
    compliance = between.transpose(0, 2, 1, 3).reshape(size, size)
    of_lugs = np.tile([1.0 / lugs.radial, 1.0 / lugs.tangential], lugs.count)
    support = np.linalg.inv(np.diag(of_lugs) + 0.5 * (compliance + compliance.T))
    return RingOnLugs(sector, lugs, outside, flank, support)


def _mean_outside(sector: CyclicSector) -> Array:
    """Nodal loads (freedoms, 2) of unit resultants spread evenly over the outside.

    Outward and clockwise; times displacement they give its mean.
    """
    boundary = sector.boundary_quadrature(["hub", "left_hub"])
    radial = boundary.points / np.hypot(*boundary.points.T)[:, None]
    clockwise = np.stack([radial[:, 1], -radial[:, 0]], axis=1)
    tractions = np.stack([radial.T.ravel(), clockwise.T.ravel()], axis=1)
    along_x = np.repeat([1.0, 0.0], len(radial))
    length = float((boundary.operator @ along_x).sum())
    return np.asarray(boundary.operator @ tractions) / length
