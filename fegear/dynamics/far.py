"""How contacts in different meshes of one gear deflect each other.

An idler passes the load from tooth to tooth through its rim: little of the twist that
its body has in one mesh alone, where the hub takes the torque, remains.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from types import SimpleNamespace

import numpy as np
from numpy.typing import NDArray

from fegear.contact.pair_laws import flank_stencils
from fegear.dynamics.sides import ContactSide, MeshLaws, contact_sides
from fegear.elasticity.flank import nodal_excitation, ring_fields
from fegear.elasticity.material import PlaneMaterial
from fegear.elasticity.modes import LEFT, RIGHT, both_flanks
from fegear.elasticity.sector import assemble_sector, condense
from fegear.gearset.model import GearSet
from fegear.statics import StaticsSettings
from meshes import MeshSize, SpurGear, sector_mesh

Array = NDArray[np.float64]


def far_coupling(
    gear_set: GearSet, laws: Sequence[MeshLaws], settings: StaticsSettings
) -> Array | None:
    """Squeeze of contact c per load on contact d of another mesh (p, c, c) [m/N].

    None where no gear is in two meshes. Friction's part is left out.
    """
    sides = contact_sides(gear_set, laws)
    ends = np.cumsum([side.laws.teeth.size for side in sides])
    total = np.zeros((len(sides[0].laws.gap), ends[-1], ends[-1]))
    found = False
    for g, gear in enumerate(gear_set.gears):
        own = [i for i, side in enumerate(sides) if g in side.gears]
        pairs = [(i, j) for i in own for j in own if sides[i].mesh != sides[j].mesh]
        if not pairs:
            continue
        found = True
        tables = far_flanks(gear.geometry, settings.material(gear), settings.size)
        for i, j in pairs:
            # equal ones let the twist of an idler's body cancel; with the wider one
            # the compliance stays positive definite
            width = max(gear_set.common_width(sides[k].mesh) for k in (i, j))
            block = tables.between(sides[i], sides[j], g) / width
            rows, columns = (
                slice(ends[k] - sides[k].laws.teeth.size, ends[k]) for k in (i, j)
            )
            total[:, rows, columns] += block
    return total if found else None


class FarFlanks:
    """Compliance between the flanks of far teeth of one gear, per unit width."""

    def __init__(self, gear: SpurGear, material: PlaneMaterial, size: MeshSize) -> None:
        self._gear, self._size = gear, size
        mesh = sector_mesh(gear, size)
        self._model = assemble_sector(mesh, material)
        self._sector = condense(self._model, gear.teeth)
        self._flanks = both_flanks(gear, mesh, self._model)
        self._excitation = nodal_excitation(
            mesh, self._model, self._sector, self._flanks[RIGHT], material
        )

    def between(self, seen: ContactSide, loaded: ContactSide, number: int) -> Array:
        """(p, k, l) between the contacts of two sides [m/(N/m)]."""
        apart = seen.teeth(number)[:, None] - loaded.teeth(number)[None, :]
        # the picture is mirrored where the load is on a left flank
        mirrored = loaded.flank == LEFT
        flank = seen.flank if not mirrored else (LEFT, RIGHT)[seen.flank == LEFT]
        apart = (-apart if mirrored else apart) % self._gear.teeth
        (i, u), (j, v) = (self._stencils(side.arcs(number)) for side in (seen, loaded))
        block = np.zeros((u.shape[0], *apart.shape))
        for offset in np.unique(apart):
            table = self._table(int(offset), flank)
            for k, m in np.argwhere(apart == offset):
                near = table[i[:, k, :, None], j[:, m, None, :]]
                block[:, k, m] = np.einsum("na,nab,nb->n", u[:, k], near, v[:, m])
        return block

    def _table(self, offset: int, flank: int) -> Array:
        """Inward displacement of a flank per inward load on a right flank (n, n)."""
        fields = ring_fields(
            self._gear, self._model, self._sector, self._excitation, [offset]
        )
        side = self._flanks[flank]
        return np.einsum("icj,ic->ij", fields[offset][side.freedoms], side.inward)

    def _stencils(self, arcs: Array) -> tuple[NDArray[np.int64], Array]:
        flank = SimpleNamespace(
            length=self._gear.flank_length, grading=self._size.flank_grading
        )
        return flank_stencils(arcs, flank, len(self._flanks[RIGHT].arcs))


far_flanks = lru_cache(maxsize=8)(FarFlanks)  # one for all torques
