"""A ring of equal sectors some teeth of which are cracked.

A cracked sector has another super-element S' than the healthy S over its two cuts. The
ring is that of healthy sectors with forces -(S' - S) u on the cuts of cracked ones.
With G the compliance of the healthy ring at these cuts, where loads would displace them
by u0, they move by u = (I + G (S' - S))^-1 u0. That is a change of low rank (Woodbury's
formula): one small system for all cracked teeth together, no assembly of the ring and
no factorisation besides that of each different sector.

What a load on a tooth does to the cuts of its own sector, held or moved, is all that
others see of it. By Maxwell's theorem the same forces give the displacement of its
flank under loads elsewhere.

Cracks are open: their faces carry no traction and do not touch, or else are closed for
all loads on one flank. All per unit face width, as in `fegear.elasticity.sector`. Teeth
count clockwise, as in `fegear.elasticity.flank.ring_fields`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fegear.elasticity.flank import (
    MAX_TOOTH_OFFSET,
    SectorLoads,
    SectorRows,
    hold_cuts,
    resolve_on_flank,
    sector_field,
)
from fegear.elasticity.ring import ring_response
from fegear.elasticity.sector import LEFT, RIGHT, CyclicSector, cyclic_sector
from fegear.elasticity.tooth_loads import ToothLoads, tooth_loads
from fegear.files.timing import stage
from lumped.common.array_types import Array
from lumped.common.workers import require_running
from meshes import SpurGear
from meshes.crack import Crack

ToothCracks = Mapping[int, Crack | Sequence[Crack]]  # by tooth, one a fillet at most
FLANK_SIDES = (RIGHT, LEFT)


@dataclass(frozen=True, eq=False)
class ComplianceChange:
    """What cracks add to the flank compliance of a gear.

    Attributes
    ----------
    teeth : int
        Number of teeth of the gear.
    damaged : (d,) array
        Teeth that are cracked, counted clockwise from 0.
    affected : (T,) array
        Teeth near a damaged one, whose deflection changes: see `DamagedRing.reach`.
    normal : (2, T, T, n, n) array
        By flank, RIGHT or LEFT, receiving tooth and loaded tooth: what is added to the
        inward normal displacement at point i of one under a unit inward normal load at
        point j of the other [m/(N/m)]; 0 for teeth farther than MAX_TOOTH_OFFSET from
        each other. Points and half-plane part are those of `FlankCompliance`.
    tangential : (2, T, T, n, n) array
        The same of displacement toward the root.
    """

    teeth: int
    damaged: NDArray[np.int64]
    affected: NDArray[np.int64]
    normal: Array
    tangential: Array

    def block(self, receiver: int, source: int, flank: int = RIGHT) -> Array:
        """What is added to the compliance of a pair of teeth.

        Parameters
        ----------
        receiver, source : int
            Tooth that deflects and tooth that is loaded, clockwise, any multiple of all
            teeth away.
        flank : int
            RIGHT or LEFT, of both teeth; tooth numbers are the same for both.

        Returns
        -------
        (2, n, n) array
            Change of `FlankCompliance.normal` and `FlankCompliance.tangential` of that
            receiver and source; zero where no damaged tooth is near.
        """
        if flank not in FLANK_SIDES:
            raise ValueError(f"flank = {flank}; must be {RIGHT} or {LEFT}")
        rows = [
            np.flatnonzero(self.affected == t % self.teeth) for t in (receiver, source)
        ]
        if not all(row.size for row in rows):
            return np.zeros((2, *self.normal.shape[-2:]))
        index = (flank, *(int(row[0]) for row in rows))
        return np.stack([self.normal[index], self.tangential[index]])

    def shifted(self, teeth: int) -> ComplianceChange:
        """The change of a gear whose damage is so many teeth farther clockwise."""
        damaged, affected = (
            (numbers + teeth) % self.teeth for numbers in (self.damaged, self.affected)
        )
        return replace(self, damaged=damaged, affected=affected)


@dataclass(frozen=True, eq=False)
class DamagedRing:
    """A ring of healthy sectors, some of which are replaced by cracked ones.

    healthy : the sector of all other teeth
    cracked : sectors by tooth, clockwise
    split : whether the half-plane part is taken out of loads
    reach : teeth on either side of a cracked one whose deflection changes,
        MAX_TOOTH_OFFSET or more; four teeth away a crack of 0.4 modules changed the
        compliance of a solid gear of 12 teeth by 1.4e-4 of it, and a deep one that of a
        ring on soft springs by 4e-3
    """

    healthy: CyclicSector
    cracked: dict[int, CyclicSector]
    split: bool = True
    reach: int = MAX_TOOTH_OFFSET

    @property
    def teeth(self) -> int:
        return self.healthy.gear.teeth

    @cached_property
    def affected(self) -> NDArray[np.int64]:
        offsets = np.arange(-self.reach, self.reach + 1)
        near = np.array(sorted(self.cracked))[:, None] + offsets
        return np.unique(near % self.teeth)

    def sector(self, tooth: int) -> CyclicSector:
        return self.cracked.get(tooth % self.teeth, self.healthy)

    def loads(self, tooth: int, side: int) -> ToothLoads:
        """Loads on a flank of a tooth; equal sectors share them."""
        return self._loads_of(self.sector(tooth), side)

    def on_cuts(self, tooth: int, side: int) -> Array:
        """Polar forces (cut, 2 n) that the ring feels of loads on a flank."""
        if tooth % self.teeth not in self.cracked:
            return self.healthy_on_cuts(side)
        return self.loads(tooth, side).on_cuts

    def healthy_on_cuts(self, side: int) -> Array:
        """Forces of loads on a healthy tooth, a mirror image on its left flank."""
        right = self._loads_of(self.healthy, RIGHT).on_cuts
        if side == RIGHT:
            return right
        left = np.roll(right, len(right) // 2, axis=0)  # the cuts change places
        left[1::2] *= -1.0  # clockwise components
        return left

    def _loads_of(self, sector: CyclicSector, side: int) -> ToothLoads:
        if (sector, side) not in self._stored_loads:
            unit = tooth_loads(sector, side, self.split)
            self._stored_loads[sector, side] = unit
        return self._stored_loads[sector, side]

    @cached_property
    def _stored_loads(self) -> dict[tuple[CyclicSector, int], ToothLoads]:
        return {}

    @cached_property
    def healthy_flank(self) -> tuple[Array, Array]:
        """Displacement (n, n) of the right flank of a healthy tooth that is loaded.

        That of the left one is its mirror image.
        """
        unit_loads, n = (
            self._loads_of(self.healthy, RIGHT),
            len(self.healthy.flanks[RIGHT].arcs),
        )
        cut_displacement = self.between(0, 0) @ unit_loads.on_cuts[:, :n]
        return _displacement_of_loaded_flank(
            self.healthy, unit_loads.loads, cut_displacement, RIGHT
        )

    def without_closed(self, side: int) -> DamagedRing | None:
        """The ring with those cracks alone that loads on a flank open; None if none.

        They are at the fillet of the same side, which bending of the tooth stretches.
        """
        opened_sectors = {}
        for tooth, sector in self.cracked.items():
            open_cracks = tuple(c for c in sector.cracks if c.left == (side == LEFT))
            if open_cracks == sector.cracks:
                opened_sectors[tooth] = sector
            elif open_cracks:
                opened_sectors[tooth] = replace(sector, cracks=open_cracks)
        if not opened_sectors:
            return None
        return (
            self
            if opened_sectors == self.cracked
            else replace(self, cracked=opened_sectors)
        )

    @cached_property
    def cut_compliance(self) -> dict[int, Array]:
        """Displacement (m, m) of the cut so many sectors clockwise of a loaded one."""
        cuts = np.unique(
            np.concatenate([self.affected, self.affected - 1]) % self.teeth
        )
        sectors_apart = np.unique((cuts[:, None] - cuts) % self.teeth)
        sectors_apart = np.unique(
            np.minimum(sectors_apart, self.teeth - sectors_apart)
        ).tolist()
        superelement = self.healthy.condensation.superelement
        m = len(superelement) // 2
        unit_loads, no_loads = np.eye(m), np.zeros((m, m))
        return ring_response(
            superelement, no_loads, unit_loads, self.teeth, sectors_apart
        )

    def compliance(self, rows: Iterable[int], columns: Iterable[int]) -> Array:
        """Compliance of the healthy ring; cut c lies between teeth c and c + 1."""
        return np.block(
            [
                [self._cut_compliance_at(row - column) for column in columns]
                for row in rows
            ]
        )

    def _cut_compliance_at(self, offset: int) -> Array:
        offset %= self.teeth
        if 2 * offset <= self.teeth:
            return self.cut_compliance[offset]
        return self.cut_compliance[self.teeth - offset].T

    @cached_property
    def changed_cuts(self) -> list[int]:
        """Cuts of cracked sectors."""
        return sorted({c % self.teeth for t in self.cracked for c in (t - 1, t)})

    @cached_property
    def correction(self) -> Array:
        """Forces against displacement u0 of the changed cuts of the healthy ring.

        (S' - S) (I + G (S' - S))^-1, symmetric.
        """
        cuts, m = self.changed_cuts, len(self.healthy.cut) // 2
        superelement_change = np.zeros((len(cuts) * m, len(cuts) * m))
        healthy_superelement = self.healthy.condensation.superelement
        for tooth, sector in self.cracked.items():
            tooth_rows = self._rows_of_changed_cuts(tooth)
            change = sector.condensation.superelement - healthy_superelement
            superelement_change[np.ix_(tooth_rows, tooth_rows)] += change
        system = (
            np.eye(len(superelement_change))
            + self.compliance(cuts, cuts) @ superelement_change
        )
        correction = np.linalg.solve(system.T, superelement_change).T
        return 0.5 * (correction + correction.T)

    def _rows_of_changed_cuts(self, tooth: int) -> NDArray[np.int64]:
        """Rows of a cracked tooth's cuts among all that changed."""
        m = len(self.healthy.cut) // 2
        cut_indices = [
            self.changed_cuts.index(c % self.teeth) for c in (tooth - 1, tooth)
        ]
        return np.concatenate([i * m + np.arange(m) for i in cut_indices])

    def between(self, receiver: int, source: int) -> Array:
        """Compliance (cut, cut) of the cuts of two teeth in the healthy ring."""
        return self.compliance((receiver - 1, receiver), (source - 1, source))

    def displacement(self, receiver: int, source: int, load: Array) -> Array:
        """Polar displacement (cut, k) of a tooth's cuts under loads on those of one."""
        at_changed_cuts = (
            self.compliance(self.changed_cuts, (source - 1, source)) @ load
        )
        from_changed_cuts = self.compliance((receiver - 1, receiver), self.changed_cuts)
        without_cracks = self.between(receiver, source) @ load
        return np.asarray(
            without_cracks - from_changed_cuts @ (self.correction @ at_changed_cuts)
        )


def damaged_ring(
    sector: CyclicSector, cracks: ToothCracks, split: bool = True
) -> DamagedRing:
    """The ring of a healthy sector with cracks.

    Equal cracks share a sector.

    Raises
    ------
    ValueError
        If a tooth does not exist, or has a crack that `cracked_sector_mesh` refuses.
    """
    gear, material = sector.gear, sector.material
    require_teeth(gear, cracks)
    cracked = {
        tooth: cyclic_sector(
            gear, material, sector.size, sector.order, as_cracks(of_tooth)
        )
        for tooth, of_tooth in cracks.items()
    }
    return DamagedRing(sector, cracked, split)


def as_cracks(of_tooth: Crack | Sequence[Crack]) -> tuple[Crack, ...]:
    """Cracks of a tooth, that of the right fillet first."""
    cracks = (of_tooth,) if isinstance(of_tooth, Crack) else tuple(of_tooth)
    return tuple(sorted(cracks, key=lambda crack: crack.left))


def require_teeth(gear: SpurGear, cracks: ToothCracks) -> None:
    """Require one cracked tooth or more, all of which the gear has."""
    if not cracks:
        raise ValueError("cracks: at least one is needed")
    for tooth in cracks:
        if not 0 <= tooth < gear.teeth:
            raise ValueError(f"tooth = {tooth}; must be 0 to {gear.teeth - 1}")


def compliance_change(ring: DamagedRing, closing: bool = False) -> ComplianceChange:
    """Compute what cracks add to the flank compliance of a gear.

    Parameters
    ----------
    ring : DamagedRing
        The gear with its cracks.
    closing : bool
        Whether a crack closes under loads on the flank of the other side, which press
        its faces onto each other: it then neither opens nor slides. By default it is
        open under all loads, and its faces may overlap.

    Returns
    -------
    ComplianceChange
        For both flanks of the affected teeth.
    """
    affected = ring.affected.tolist()
    n = len(ring.healthy.flanks[RIGHT].arcs)
    shape = (len(FLANK_SIDES), len(affected), len(affected), n, n)
    normal, tangential = np.zeros(shape), np.zeros(shape)
    with stage("cracks"):
        for side in FLANK_SIDES:
            open_ring = ring.without_closed(side) if closing else ring
            if open_ring is None:
                continue
            for teeth, (normal_change, tangential_change) in _changes_on_flank(
                open_ring, side
            ).items():
                i, j = map(affected.index, teeth)
                normal[side, i, j], tangential[side, i, j] = (
                    normal_change,
                    tangential_change,
                )
    damaged = np.array(sorted(ring.cracked))
    return ComplianceChange(ring.teeth, damaged, ring.affected, normal, tangential)


def _changes_on_flank(
    ring: DamagedRing, side: int
) -> dict[tuple[int, int], tuple[Array, Array]]:
    """Changes (n, n), normal and tangential, by receiving and loaded tooth."""
    affected, teeth = ring.affected.tolist(), ring.teeth
    n = len(ring.healthy.flanks[side].arcs)
    loads_on_cuts = {t: ring.on_cuts(t, side) for t in affected}
    at_changed_cuts = {
        t: ring.compliance(ring.changed_cuts, (t - 1, t)) @ loads_on_cuts[t]
        for t in affected
    }
    healthy_loads = ring.healthy_on_cuts(side)
    changes = {}
    for source in affected:
        require_running()
        correcting_forces = ring.correction @ at_changed_cuts[source][:, :n]
        for receiver in affected:
            offset = (receiver - source) % teeth
            if min(offset, teeth - offset) > MAX_TOOTH_OFFSET:
                continue
            if receiver == source and source in ring.cracked:
                changes[receiver, source] = _change_of_loaded_tooth(ring, source, side)
                continue
            change = -at_changed_cuts[receiver].T @ correcting_forces
            if {receiver, source} & set(ring.cracked):
                between_cuts = ring.between(receiver, source)
                change += (
                    loads_on_cuts[receiver].T
                    @ between_cuts
                    @ loads_on_cuts[source][:, :n]
                )
                change -= healthy_loads.T @ between_cuts @ healthy_loads[:, :n]
            changes[receiver, source] = change[:n], change[n:]
    return changes


def _change_of_loaded_tooth(
    ring: DamagedRing, tooth: int, side: int
) -> tuple[Array, Array]:
    """Changes (n, n), normal and tangential, of a damaged tooth that is loaded."""
    unit_loads, sector = ring.loads(tooth, side), ring.cracked[tooth]
    n = len(sector.flanks[side].arcs)
    cut_displacement = ring.displacement(tooth, tooth, unit_loads.on_cuts[:, :n])
    cracked_flank = _displacement_of_loaded_flank(
        sector, unit_loads.loads, cut_displacement, side
    )
    normal, tangential = (
        a - b for a, b in zip(cracked_flank, ring.healthy_flank, strict=True)
    )
    return normal, tangential


def _displacement_of_loaded_flank(
    sector: CyclicSector, loads: SectorLoads, cut_displacement: Array, side: int
) -> tuple[Array, Array]:
    """Displacement (n, n), normal and toward the root, of a flank under normal loads.

    The half-plane part of loads is left out: Flamant's displacement is the same in a
    cracked sector.
    """
    flank, n = sector.flanks[side], cut_displacement.shape[1]
    normal_loads = SectorLoads(loads.force[:, :n], loads.hub[:, :n], loads.jump[:, :n])
    held_solution = hold_cuts(sector, normal_loads)
    rows = SectorRows.of(sector, flank.dofs.ravel())
    return resolve_on_flank(
        flank, sector_field(sector, rows, cut_displacement, held_solution)
    )
