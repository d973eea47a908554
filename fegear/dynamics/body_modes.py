"""Elastic modes of the gears' bodies as coordinates of the coupled model.

Modes with nodal diameters are seen in a frame that does not turn with the gear: there
the contacts stay in one place, and their penetration per coordinate repeats with the
mesh cycle. See `lumped.coupled.BodyModes`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from fegear.dynamics.build import elastic_damping
from fegear.dynamics.sides import ContactSide
from fegear.elasticity.modes import GearModes, lowest_modes
from fegear.gearset.model import GearSet
from fegear.statics import StaticsSettings
from lumped.coupled import BodyModes
from lumped.system import LumpedSystem

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
DIAMETERS = 5  # families with fewer nodal diameters are looked at,
EACH = 2  # the lowest modes of each
DAMPING = 0.01  # ratio where a gear's first elastic modes are, less above
modes_once = lru_cache(maxsize=16)(lowest_modes)  # equal gears, and all torques


def gears_modes(gear_set: GearSet, settings: StaticsSettings) -> list[GearModes]:
    """The lowest modes of every gear, by families of nodal diameters."""
    return [
        modes_once(
            *(settings.sector(gear), gear.density),
            *(range(min(DIAMETERS, (gear.geometry.teeth + 1) // 2)), EACH),
        )
        for gear in gear_set.gears
    ]


def body_modes(
    gear_set: GearSet,
    reference: LumpedSystem,
    sides: Sequence[ContactSide],
    modes: Sequence[GearModes],
) -> BodyModes:
    """All modes of the gears, those without nodal diameters first.

    modes : of each gear, in pairs that follow each other but for those without
    """
    each = [_of_gear(g, modes[g], gear_set, reference, sides) for g in range(len(modes))]
    parts = {name: [part[name] for part in each] for name in each[0]}
    rows = np.concatenate(parts["rows"], axis=2)
    joined = {n: np.concatenate(p) for n, p in parts.items() if n != "rows"}
    order = np.argsort(joined["nodal_diameters"] > 0, kind="stable")
    joined = {name: values[order] for name, values in joined.items()}
    travelling = joined["nodal_diameters"] > 0
    return BodyModes(
        **joined | {"whirl": joined["whirl"][travelling][::2]},
        rows=np.ascontiguousarray(rows[..., order]),
    )


def _of_gear(
    g: int,
    modes: GearModes,
    gear_set: GearSet,
    reference: LumpedSystem,
    sides: Sequence[ContactSide],
) -> dict[str, NDArray]:
    """Fields of `BodyModes`, `whirl` for every mode."""
    gear, n = gear_set.gears[g], modes.nodal_diameters
    mesh = next(m for m, x in enumerate(gear_set.meshes) if g in (x.driver, x.driven))
    turning = gear_set.senses[g] * float(reference.train.mesh_rates[mesh]) / modes.teeth
    place = reference.modes.coordinates.places[g, "rotation"]
    rotation = reference.modes.shapes[place, reference.moving]
    carried = -math.sqrt(gear.face_width) * modes.rotation_coupling  # modes: clockwise
    return {
        "angular": 2.0 * np.pi * modes.frequencies_Hz,
        "damping": np.full(n.size, elastic_damping(gear, DAMPING).mass),
        "coupling": carried[:, None] * rotation,
        "rows": np.concatenate([_rows(g, modes, gear_set, side) for side in sides]),
        "whirl": n * turning,
        "gears": np.full(n.size, g),
        "nodal_diameters": n,
    }


def _rows(g: int, modes: GearModes, gear_set: GearSet, side: ContactSide) -> Array:
    """Penetration (k, p + 1, b) of a side's contacts per coordinate."""
    shape = *side.laws.gap.T.shape, modes.frequencies_Hz.size
    if g not in side.gears:
        return np.zeros(shape)
    arcs, teeth = side.arcs(g).T, side.teeth(g)
    inside = np.clip(arcs, modes.arcs[0], modes.arcs[-1])
    flank = modes.normal[:, side.flank]
    both = PchipInterpolator(modes.arcs, np.stack([flank.real, flank.imag]), axis=2)
    real, imaginary = both(inside)  # (b, k, p + 1)
    cycle = np.linspace(0.0, 1.0, shape[1])
    tooth = teeth[:, None] - gear_set.senses[g] * cycle
    turn = 2.0 * np.pi * modes.nodal_diameters[:, None, None] * tooth / modes.teeth
    found = real * np.cos(turn) - imaginary * np.sin(turn)
    # inward displacement opens a contact
    return -found.transpose(1, 2, 0) / math.sqrt(gear_set.gears[g].face_width)
