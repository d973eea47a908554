"""What the tooth pairs of a recorded motion did: forces and contact.

Pairs count from the one that enters the mesh. They count anew where a pair passes the
pitch point, and each takes the place of the one ahead of it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lumped.coupled import ROUNDING
from lumped.response import History
from lumped.settings import Settings
from lumped.steppers import steps_per_period
from lumped.system import LumpedSystem

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
NOWHERE = -1.0  # m, penetration of a pair that has no contact on a side
PARTS = 16  # of a step, for the time that contact conditions last
MIDDLES = (np.arange(PARTS) + 0.5) / PARTS
CONDITIONS = {
    "I": "no pair touches",
    "II": "the entering pair is lost",
    "III": "all pairs touch",
    "IV": "the leaving pair is lost",
    "back": "a pair touches on its back side",
    "other": "only a pair in the middle touches, or is lost",
}


@dataclass(frozen=True, eq=False)
class PairMotion:
    """Tooth pairs of one mesh, t points and p pairs from the entering one on.

    force : (t, p) [N], negative on the back side
    state : (t, p) 1 drive side, 0 no contact, -1 back side
    engaged : (t, p) whether the pair has a stiffness; of the coupled model, whether
        its drive flanks are on the nominal path of contact, beyond which tip corners
        may touch and carry as well
    conditions : part of the time by key of CONDITIONS, while two pairs or more
        are engaged; empty where this never is so
    """

    force: Array
    state: Indices
    engaged: NDArray[np.bool_]
    conditions: Mapping[str, float]

    @property
    def count(self) -> Indices:
        """Engaged pairs (t,)."""
        return self.engaged.sum(axis=1)

    @property
    def in_mesh(self) -> NDArray[np.bool_]:
        """Whether each pair is engaged or touches (t, p)."""
        return self.engaged | (self.state != 0)


def pair_motions(
    system: LumpedSystem, frequency: float, settings: Settings, history: History
) -> tuple[PairMotion, ...]:
    """Every pair's force and contact.

    Of springs k_p (s - g_p) and so on of `excitation`, where the history stands on the
    grid of the samples, repeated; of the coupled model as recorded.
    """
    if system.contacts is not None:
        meshes = range(len(system.train.meshes))
        return tuple(_contact_motion(system, m, frequency, history) for m in meshes)
    h, stiffness, gap = system.samples(steps_per_period(system, frequency, settings))
    rows = np.arange(history.time.size) % h.size
    first = system.arrays.first_pair
    return tuple(
        _spring_motion(
            stiffness[rows][:, :, first[m] : first[m + 1]],
            gap[rows][:, :, first[m] : first[m + 1]],
            history.deflection[:, m],
            np.diff(history.time),
            mesh.backlash,
        )
        for m, mesh in enumerate(system.train.meshes)
    )


def _spring_motion(
    stiffness: Array, gap: Array, s: Array, h: Array, backlash: float
) -> PairMotion:
    """stiffness, gap : (t, 3, p) at start, middle and end of the step from there."""
    elastic = s[:, None] - gap[:, 0]
    k = stiffness[:, 0]
    state = np.where(elastic > 0.0, 1, np.where(elastic < -backlash, -1, 0))
    state = np.where(k > 0.0, state, 0)
    overlap = np.where(state == -1, elastic + backlash, elastic)
    force = np.where(state == 0, 0.0, k * overlap)
    before = s[1:, None] - gap[:-1, 2]
    # not where a pair fades in or out within a step: its gap is out of bounds there
    throughout = stiffness[:-1].min(axis=1) > 0.0
    conditions = contact_conditions(
        elastic[:-1], before, throughout[:, None], h, backlash
    )
    return PairMotion(force, state, k > 0.0, conditions)


def _contact_motion(
    system: LumpedSystem, m: int, frequency: float, history: History
) -> PairMotion:
    """Of the coupled model: a pair is its contacts on the drive and the back side.

    Pairs on the nominal path count, and what carries outside of it.
    """
    assert system.contacts is not None
    (low, high), mesh = system.contacts.paths[m], system.train.meshes[m]
    cycles = _mesh_cycles(system, m, frequency, history)
    turn = np.floor(cycles + ROUNDING).astype(np.int64)
    pitch = np.floor(mesh.phase + cycles + ROUNDING).astype(np.int64)
    ahead, columns = _pair_columns(system, m, turn - pitch)
    loads, drive, back = _by_pairs(history, columns)
    force = loads[0] - loads[1] + 0.0  # no negative zeros
    state = np.where(back > 0.0, -1, np.where(drive > 0.0, 1, 0))
    position = (mesh.phase + cycles - pitch)[:, None] + ahead
    engaged = (position > low) & (position < high)
    way = position[:-1, None] + np.diff(cycles)[:, None, None] * MIDDLES[:, None]
    # flanks that do not face each other are out of bounds
    apart = np.maximum(drive, -mesh.backlash)
    elastic = np.where(back > 0.0, -mesh.backlash - back, apart)
    # a pair that passes the pitch point in a step takes the next place
    places = np.diff(pitch)[:, None] + np.arange(ahead.size)
    end = np.take_along_axis(np.pad(elastic[1:], ((0, 0), (0, 1))), places, axis=1)
    conditions = contact_conditions(
        *(elastic[:-1], end, (way > low) & (way < high)),
        *(np.diff(history.time), mesh.backlash),
    )
    used = np.flatnonzero((engaged | (state != 0)).any(axis=0))
    kept = slice(used[0], used[-1] + 1)
    return PairMotion(force[:, kept], state[:, kept], engaged[:, kept], conditions)


def _mesh_cycles(
    system: LumpedSystem, m: int, frequency: float, history: History
) -> Array:
    """Cycles (t,) of a mesh that have passed at even steps."""
    last = history.time.size - 1
    periods = round(history.time[-1] * frequency)
    rate = float(system.train.mesh_rates[m])
    return rate * periods * np.arange(last + 1) / last


def _pair_columns(
    system: LumpedSystem, m: int, shift: Indices
) -> tuple[Indices, tuple[Indices, Indices]]:
    """Base pitches (p,) by which pairs are ahead, and their contacts (t, p), or -1.

    shift : (t,) from these pairs to those that the contacts count
    The contacts of the drive side come first, those of the back side second.
    """
    found = system.contacts
    assert found is not None
    own = found.mesh_of == m
    counted = found.pairs[own]
    ahead = np.arange(counted.min() - shift.max(), counted.max() - shift.min() + 1)
    wanted = shift[:, None] + ahead
    columns = []
    for side in (1.0, -1.0):
        contact = np.full(np.ptp(wanted) + 1, -1)
        for c in np.flatnonzero(own & (found.contacts.side == side)):
            contact[found.pairs[c] - wanted.min()] = c
        columns.append(contact[wanted - wanted.min()])
    return ahead, (columns[0], columns[1])


def _by_pairs(
    history: History, columns: tuple[Indices, Indices]
) -> tuple[Array, Array, Array]:
    """Loads (2, t, p) of both sides [N], penetrations (t, p) of each [m]."""
    assert history.contacts is not None
    rows = np.arange(history.time.size)[:, None]
    load, penetration = history.contacts.transpose(1, 0, 2)
    loads = [np.where(c < 0, 0.0, load[rows, c]) for c in columns]
    drive, back = (np.where(c < 0, NOWHERE, penetration[rows, c]) for c in columns)
    return np.array(loads), drive, back


def contact_conditions(
    start: Array, end: Array, engaged: NDArray[np.bool_], h: Array, backlash: float
) -> dict[str, float]:
    """Part of the time that each of CONDITIONS lasts, but those that never occur.

    Counted while two pairs or more are engaged, over the whole time; the first
    engaged pair is the entering one, the last the leaving one.

    start, end : (n, p) deflection minus gap at the ends of n steps [m], taken as
        straight between them
    engaged : (n, 1, p) throughout the steps, or (n, PARTS, p) in parts of them
    h : (n,) [s]
    """
    found = dict.fromkeys(CONDITIONS, 0.0)
    several = np.flatnonzero((engaged.sum(axis=-1) >= 2).any(axis=1))
    start, end, there = start[several], end[several], engaged[several]
    elastic = start[:, None] + (end - start)[:, None] * MIDDLES[:, None]
    there = np.broadcast_to(there, elastic.shape)
    touch, back = (elastic > 0.0) & there, (elastic < -backlash) & there
    count, touching = there.sum(axis=-1), touch.sum(axis=-1)
    entering, leaving = (_at_the_end(touch, there, end) for end in (0, -1))
    one_lost = touching == count - 1
    kinds = {
        "": count < 2,
        "back": back.any(axis=-1),
        "I": touching == 0,
        "III": touching == count,
        "II": one_lost & ~entering,
        "IV": one_lost & ~leaving,
    }
    kind = np.select(list(kinds.values()), range(len(kinds)), len(kinds))
    for i, name in enumerate([*kinds, "other"][1:], start=1):
        found[name] = float(((kind == i).mean(axis=1) * h[several]).sum() / h.sum())
    return {name: value for name, value in found.items() if value > 0.0}


def _at_the_end(
    touch: NDArray[np.bool_], engaged: NDArray[np.bool_], end: int
) -> NDArray[np.bool_]:
    """Whether the first (0) or last (-1) engaged pair touches (n, PARTS).

    touch, engaged : (n, PARTS, p)
    """
    place = engaged.argmax(axis=-1)
    if end == -1:
        place = engaged.shape[-1] - 1 - engaged[..., ::-1].argmax(axis=-1)
    return np.take_along_axis(touch, place[..., None], axis=-1)[..., 0]
