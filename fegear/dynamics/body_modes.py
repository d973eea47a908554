"""Elastic modes of the gears' bodies as coordinates of the coupled model.

Modes with nodal diameters are seen in a frame that does not turn with the gear: there
the contacts stay in one place, and their penetration per coordinate repeats with the
mesh cycle. See `lumped.coupled.BodyModes`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from fegear.dynamics.build import elastic_damping
from fegear.dynamics.sides import DRIVE, ContactSide
from fegear.elasticity.modes import GearModes, lowest_modes, static_inertia
from fegear.gearset.model import GearSet
from fegear.statics import StaticsSettings
from lumped.coupled import BodyModes, CoupledContacts, LoadedState
from lumped.elastic_inertia import harmonic_amplitudes
from lumped.left_out import BodyInertia
from lumped.system import LumpedSystem

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
DIAMETERS = 6  # families with fewer nodal diameters are looked at,
EACH = 3  # the lowest modes of each
DAMPING = 0.01  # ratio where a gear's first elastic modes are, less above
inertia_once = lru_cache(maxsize=32)(static_inertia)
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


def static_inertias(
    gear_set: GearSet, sides: Sequence[ContactSide], settings: StaticsSettings
) -> Array:
    """Sum (m,) of w^2 / omega^4 over all modes of both gears of each mesh [s2 m/N].

    w : penetration at the pitch point per coordinate of unit mass
    """
    found = np.zeros(len(gear_set.meshes))
    for side in sides:
        if side.side != DRIVE:
            continue
        contact = int(np.flatnonzero(side.laws.teeth == 0)[0])
        for g in side.gears:
            gear = gear_set.gears[g]
            given = settings.sector(gear), gear.density
            arc = float(side.arcs(g)[0, contact])
            found[side.mesh] += inertia_once(*given, arc) / gear.face_width
    return found


def body_modes(
    gear_set: GearSet,
    reference: LumpedSystem,
    sides: Sequence[ContactSide],
    modes: Sequence[GearModes],
) -> BodyModes:
    """All modes of the gears, those without nodal diameters first.

    modes : of each gear, in pairs that follow each other but for those without
    """
    each = [
        _of_gear(g, modes[g], gear_set, reference, sides) for g in range(len(modes))
    ]
    parts = {name: [part[name] for part in each] for name in each[0]}
    rows = np.concatenate(parts["rows"], axis=2)
    joined = {n: np.concatenate(p) for n, p in parts.items() if n != "rows"}
    travelling = joined["nodal_diameters"] > 0
    second = travelling & (np.cumsum(travelling) % 2 == 0)
    order = np.argsort(travelling.astype(int) + second, kind="stable")
    return BodyModes(
        **{name: values[order] for name, values in joined.items()},
        rows=np.ascontiguousarray(rows[..., order]),
    )


def with_body_modes(
    contacts: CoupledContacts,
    reference: LumpedSystem,
    modes: BodyModes,
    static: Array,
    band: tuple[float, float],
    kept: NDArray[np.bool_] | None = None,
) -> CoupledContacts:
    """With those modes as coordinates that matter at a band of speeds [Hz].

    kept : those modes, where they are known

    reference : Model-1 of the same train; modes : all that were solved
    static : (m,) inertia of the meshes' static displacement, see `static_inertias`
    """
    still = replace(reference, contacts=replace(contacts, modes=None))
    assert still.loaded is not None
    inertia = _inertia(contacts, reference, modes, static, still.loaded)
    kept = inertia.choose(band) if kept is None else kept
    return replace(
        contacts, modes=modes.only(kept), inertia=inertia, kept=kept, band=band
    )


def _inertia(
    contacts: CoupledContacts,
    reference: LumpedSystem,
    modes: BodyModes,
    static: Array,
    loaded: LoadedState,
) -> BodyInertia:
    """Shares of the modes are those at the pitch point, in the mean stiffness."""
    families = np.arange(modes.count)
    first, second = np.split(families[modes.nodal_diameters > 0], 2)
    families[second] = first
    side = contacts.contacts.side > 0
    at_pitch = [
        np.flatnonzero((contacts.mesh_of == m) & (contacts.pairs == 0) & side)[0]
        for m in range(len(reference.excitations))
    ]
    stiffness = reference.modes.mean_stiffness[:, None]
    ste = loaded.deflection[:-1].T
    squares = modes.rows[at_pitch, 0] ** 2
    left = static - (squares / modes.angular**4).sum(axis=1)
    rest_Hz = _rest_Hz(modes)
    return BodyInertia(
        frequencies_Hz=modes.angular / (2.0 * np.pi),
        damping_ratio=0.5 * modes.damping / modes.angular,
        families=families,
        compliance=stiffness * squares / modes.angular**2,
        rest_Hz=rest_Hz,
        rest=stiffness[:, 0] * np.maximum(left, 0.0) * (2.0 * np.pi * rest_Hz) ** 2,
        amplitudes=np.stack([harmonic_amplitudes(each) for each in ste]),
        rate=np.array([float(rate) for rate in reference.train.mesh_rates]),
    )


def _rest_Hz(modes: BodyModes) -> float:
    """The lowest mode that was not solved is none of these: no lower than the last
    family's lowest and each family's highest."""
    found = []
    for gear in np.unique(modes.gears):
        own, n = modes.gears == gear, modes.nodal_diameters
        last = own & (n == n[own].max())
        found.append(modes.angular[last].min())
        found += [modes.angular[own & (n == k)].max() for k in np.unique(n[own])]
    return float(min(found)) / (2.0 * np.pi)


def _of_gear(
    g: int,
    modes: GearModes,
    gear_set: GearSet,
    reference: LumpedSystem,
    sides: Sequence[ContactSide],
) -> dict[str, NDArray]:
    """Fields of `BodyModes`."""
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
