"""Cross-mesh compliance: how contacts in different meshes of one gear deflect it.

An idler passes the load from tooth to tooth through its rim: little of the twist that
its body has in one mesh alone, where the hub takes the torque, remains.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from fegear.dynamics.sides import ContactSide, MeshLoadCurves, contact_sides
from fegear.elasticity.cache import cached_arrays
from fegear.elasticity.flank import nodal_loads, ring_fields
from fegear.elasticity.flank_grid import flank_stencils
from fegear.elasticity.sector import LEFT, RIGHT, CyclicSector
from fegear.gearset.model import GearSet
from fegear.statics.settings import StaticsSettings
from lumped.common.array_types import Array


def cross_mesh_compliance(
    gear_set: GearSet, load_curves: Sequence[MeshLoadCurves], settings: StaticsSettings
) -> Array | None:
    """Penetration of contact c per load on contact d of another mesh (p, c, c) [m/N].

    None where no gear is in two meshes. Friction's part is left out.
    """
    sides = contact_sides(gear_set, load_curves)
    ends = np.cumsum([side.load_curves.pair_offsets.size for side in sides])
    total = np.zeros((len(sides[0].load_curves.gap), ends[-1], ends[-1]))
    has_coupling = False
    for g, gear in enumerate(gear_set.gears):
        side_indices = [i for i, side in enumerate(sides) if g in side.gears]
        pairs = [
            (i, j)
            for i in side_indices
            for j in side_indices
            if sides[i].mesh != sides[j].mesh
        ]
        if not pairs:
            continue
        has_coupling = True
        sector = settings.sector(gear)
        for i, j in pairs:
            # the face-width rule: see fegear.elasticity.sector
            width = max(gear_set.common_width(sides[k].mesh) for k in (i, j))
            block = cross_compliance(sector, sides[i], sides[j], g) / width
            rows, columns = (
                slice(ends[k] - sides[k].load_curves.pair_offsets.size, ends[k])
                for k in (i, j)
            )
            total[:, rows, columns] += block
    return total if has_coupling else None


def cross_compliance(
    sector: CyclicSector, receiver: ContactSide, source: ContactSide, gear: int
) -> Array:
    """(p, k, l) between the contacts of two flank pairs on a gear [m/(N/m)]."""
    tooth_offset = receiver.teeth(gear)[:, None] - source.teeth(gear)[None, :]
    # the picture is mirrored where the load is on a left flank
    mirrored = source.flank == LEFT
    flank = receiver.flank if not mirrored else (LEFT, RIGHT)[receiver.flank == LEFT]
    tooth_offset = (-tooth_offset if mirrored else tooth_offset) % sector.gear.teeth
    tables = {
        int(offset): _flank_table(sector, int(offset), flank)
        for offset in np.unique(tooth_offset)
    }
    (i, u), (j, v) = (
        flank_stencils(side.arcs(gear), *sector.flank_grid)
        for side in (receiver, source)
    )
    block = np.zeros((u.shape[0], *tooth_offset.shape))
    for offset, table in tables.items():
        for k, m in np.argwhere(tooth_offset == offset):
            stencil_compliance = table[i[:, k, :, None], j[:, m, None, :]]
            block[:, k, m] = np.einsum(
                "na,nab,nb->n", u[:, k], stencil_compliance, v[:, m]
            )
    return block


@lru_cache(maxsize=1024)  # one for all torques
def _flank_table(sector: CyclicSector, offset: int, flank: int) -> Array:
    """Inward displacement of a flank `offset` teeth to the right, (n, n) [m/(N/m)].

    Per inward load on a right flank. Read from disk where it was computed before.
    """
    arrays = cached_arrays(
        *("across-gear", sector, {"offset": offset, "flank": flank}),
        lambda: {"inward": _solve_flank_table(sector, offset, flank)},
    )
    return arrays["inward"]


def _solve_flank_table(sector: CyclicSector, offset: int, flank: int) -> Array:
    field = ring_fields(sector, nodal_loads(sector), [offset])[offset]
    points = sector.flanks[flank]
    return np.einsum("icj,ic->ij", field[points.dofs], points.inward)
