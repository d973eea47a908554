"""Forces and contact of the tooth pairs of a recorded motion.

Pairs are numbered from the one that enters the mesh. The numbers shift when a pair
passes the pitch point: each pair then takes the place of the one ahead of it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lumped.common.array_types import Array, Indices
from lumped.common.checks import require_present
from lumped.common.short_repr import ShortRepr
from lumped.kernels.arrays import SpaceSamples
from lumped.steady.integration_settings import Settings
from lumped.steady.response import History
from lumped.steady.steppers import steps_per_period
from lumped.train.coupled import POSITION_ROUND_OFF
from lumped.train.system import LumpedSystem

Ends = tuple[Array, Array]  # at the starts and ends of steps
NO_CONTACT_GAP = -1.0  # m, penetration of a pair that has no contact on a side
SUBSTEPS = 16  # parts of a step that resolve the duration of contact conditions
SUBSTEP_CENTRES = (np.arange(SUBSTEPS)[:, None] + 0.5) / SUBSTEPS
STEPS_PER_BLOCK = 8192  # steps whose parts are evaluated together
CONDITIONS = {
    "I": "no pair touches",
    "II": "the entering pair is lost",
    "III": "all pairs touch",
    "IV": "the leaving pair is lost",
    "back": "a pair touches on its back side",
    "other": "only a pair in the middle touches, or is lost",
}


@dataclass(frozen=True, eq=False)
class PairMotion(ShortRepr):
    """Tooth pairs of one mesh, with t points and p pairs from the entering one on.

    force : (t, p) [N], negative on the back side
    state : (t, p) 1 drive side, 0 no contact, -1 back side
    engaged : (t, p) whether the pair has a stiffness; in the coupled model, whether
        its drive flanks are on the nominal path of contact, beyond which tip corners
        may also touch and carry load
    conditions : fraction of the time by key of CONDITIONS, while two pairs or more
        are engaged; empty if that is never the case
    """

    force: Array
    state: Indices
    engaged: NDArray[np.bool_]
    conditions: Mapping[str, float]

    @property
    def count(self) -> Indices:
        """Number of engaged pairs (t,)."""
        return self.engaged.sum(axis=1)

    @property
    def in_mesh(self) -> NDArray[np.bool_]:
        """Whether each pair is engaged or touches (t, p)."""
        return self.engaged | (self.state != 0)


def pair_motions(
    system: LumpedSystem, frequency: float, settings: Settings, history: History
) -> tuple[PairMotion, ...]:
    """Force and contact of every pair.

    They follow from springs k_p (s - g_p) of `excitation` if the history is on the
    repeated grid of the samples; in the coupled model they are recorded.
    """
    if system.contacts is not None:
        meshes = range(len(system.train.meshes))
        return tuple(_contact_motion(system, m, frequency, history) for m in meshes)
    samples = system.samples(steps_per_period(system, frequency, settings))
    h, stiffness, gap = samples[:3]
    rows = np.arange(history.time.size) % h.size
    if isinstance(samples, SpaceSamples):
        return _springs_in_space(system, samples, rows, history)
    first_pairs = system.arrays.first_pair
    motions = tuple(
        _spring_motion(
            stiffness[rows][:, :, first_pairs[m] : first_pairs[m + 1]],
            gap[rows][:, :, first_pairs[m] : first_pairs[m + 1]],
            history.deflection[:, m],
            np.diff(history.time),
            mesh.backlash,
        )
        for m, mesh in enumerate(system.train.meshes)
    )
    if history.friction is None:
        return motions
    # reversed sliding bends teeth the other way
    normal_forces = np.split(history.friction[:, 0], first_pairs[1:-1], axis=1)
    motions_and_forces = zip(motions, normal_forces, strict=True)
    return tuple(replace(pairs, force=force) for pairs, force in motions_and_forces)


def _springs_in_space(
    system: LumpedSystem,
    samples: SpaceSamples,
    rows: NDArray[np.intp],
    history: History,
) -> tuple[PairMotion, ...]:
    """Springs over the face width of gears that move in space, in order of places.

    rows : (t,) of the samples, at the points of the history
    """
    tilts = require_present(history.tilts, "tilts")
    motions = []
    for m, mesh in enumerate(system.train.meshes):
        springs = slice(*system.arrays.first_pair[m : m + 2])
        gap, place = samples.gap[rows, :, springs], samples.place[rows, :, springs]
        gap = gap - place * tilts[:, m, None, None]
        # the end of a step has the tilt of the next point
        next_tilts = np.append(tilts[1:, m], tilts[-1, m])
        gap[:, 2] = samples.gap[rows, 2, springs]
        gap[:, 2] -= place[:, 2] * next_tilts[:, None]
        motion = _spring_motion(
            samples.stiffness[rows, :, springs],
            gap,
            history.deflection[:, m],
            np.diff(history.time),
            mesh.backlash,
        )
        motions.append(replace(motion, conditions={}))
    return tuple(motions)


def _spring_motion(
    stiffness: Array, gap: Array, s: Array, h: Array, backlash: float
) -> PairMotion:
    """Motion of pairs that are springs.

    stiffness, gap : (t, 3, p) at start, middle and end of the step from each point
    """
    elastic = s[:, None] - gap[:, 0]
    k = stiffness[:, 0]
    state = np.where(elastic > 0.0, 1, np.where(elastic < -backlash, -1, 0))
    state = np.where(k > 0.0, state, 0)
    overlap = np.where(state == -1, elastic + backlash, elastic)
    force = np.where(state == 0, 0.0, k * overlap)
    elastic_at_end = s[1:, None] - gap[:-1, 2]
    # a pair that enters or leaves within a step is excluded: its gap is out of bounds
    inside = np.where(stiffness[:-1].min(axis=1) > 0.0, 1.0, -1.0)
    conditions = contact_conditions(
        (elastic[:-1], elastic_at_end), (inside, inside), h, backlash
    )
    return PairMotion(force, state, k > 0.0, conditions)


def _contact_motion(
    system: LumpedSystem, m: int, frequency: float, history: History
) -> PairMotion:
    """Motion of pairs of the coupled model, each with drive-side and back contacts.

    Pairs on the nominal path count, and pairs that carry load outside of it.
    """
    contacts = require_present(system.contacts, "coupled model")
    (path_start, path_end), mesh = contacts.paths[m], system.train.meshes[m]
    cycles = _mesh_cycles(system, m, frequency, history)
    mesh_cycle = np.floor(cycles + POSITION_ROUND_OFF).astype(np.int64)
    pitch_number = np.floor(mesh.phase + cycles + POSITION_ROUND_OFF).astype(np.int64)
    pitches_ahead, loads, (drive_penetration, back_penetration) = _arrange_by_pairs(
        system, m, mesh_cycle - pitch_number, history
    )
    force = loads[0] - loads[1] + 0.0  # no negative zeros
    state = np.where(
        back_penetration > 0.0, -1, np.where(drive_penetration > 0.0, 1, 0)
    )
    position = (mesh.phase + cycles - pitch_number)[:, None] + pitches_ahead
    distance_inside_path = np.minimum(position - path_start, path_end - position)
    is_engaged = distance_inside_path > 0.0
    # gaps of flanks that do not face each other are out of bounds
    separation = np.maximum(drive_penetration, -mesh.backlash)
    elastic = np.where(
        back_penetration > 0.0, -mesh.backlash - back_penetration, separation
    )
    # a pair that passes the pitch point in a step takes the next place
    next_columns = np.diff(pitch_number)[:, None] + np.arange(pitches_ahead.size)
    elastic_ends, inside_ends = (
        (
            v[:-1],
            np.take_along_axis(np.pad(v[1:], ((0, 0), (0, 1))), next_columns, axis=1),
        )
        for v in (elastic, distance_inside_path)
    )
    h = np.diff(history.time)
    conditions = contact_conditions(elastic_ends, inside_ends, h, mesh.backlash)
    used_columns = np.flatnonzero((is_engaged | (state != 0)).any(axis=0))
    columns = slice(used_columns[0], used_columns[-1] + 1)
    return PairMotion(
        force[:, columns], state[:, columns], is_engaged[:, columns], conditions
    )


def _mesh_cycles(
    system: LumpedSystem, m: int, frequency: float, history: History
) -> Array:
    """Cycles (t,) of a mesh that have passed, at even steps."""
    n_steps = history.time.size - 1
    periods = round(history.time[-1] * frequency)
    rate = float(system.train.mesh_rates[m])
    return rate * periods * np.arange(n_steps + 1) / n_steps


def _arrange_by_pairs(
    system: LumpedSystem, m: int, shift: Indices, history: History
) -> tuple[Indices, Array, Array]:
    """Base pitches (p,) by which pairs of a mesh are ahead, and their contacts.

    The contacts are loads [N] and penetrations [m] on the drive and the back side, each
    of shape (2, t, p).

    shift : (t,) base pitches by which the contacts number a pair further ahead
    """
    contacts = require_present(system.contacts, "coupled model")
    contact_record = require_present(history.contacts, "record of the contacts")
    mesh_contacts = np.flatnonzero(contacts.mesh_of == m)
    pair_numbers = contacts.pairs[mesh_contacts]
    pitches_ahead = np.arange(
        pair_numbers.min() - shift.max(), pair_numbers.max() - shift.min() + 1
    )
    pairs = shift[:, None] + pitches_ahead
    loads, penetrations = (
        np.zeros((2, *pairs.shape)),
        np.full((2, *pairs.shape), NO_CONTACT_GAP),
    )
    for c in mesh_contacts:
        side = int(contacts.contacts.side[c] < 0.0)
        rows, columns = np.nonzero(pairs == contacts.pairs[c])
        loads[side, rows, columns] = contact_record[rows, 0, c]
        penetrations[side, rows, columns] = contact_record[rows, 1, c]
    return pitches_ahead, loads, penetrations


def contact_conditions(
    elastic: Ends, inside: Ends, h: Array, backlash: float
) -> dict[str, float]:
    """Fraction of the time that each of CONDITIONS lasts, without those of zero time.

    Time counts while two pairs or more are engaged, as a fraction of the whole time;
    the first engaged pair is the entering one, the last the leaving one.

    elastic : (n, p) deflection minus gap at the starts and ends of n steps [m]
    inside : (n, p) a quantity that is positive while a pair is engaged, likewise
    h : (n,) [s]; all quantities are linear within steps
    """
    time = np.zeros(len(CONDITIONS))
    for first_step in range(0, h.size, STEPS_PER_BLOCK):
        rows = slice(first_step, first_step + STEPS_PER_BLOCK)
        deflected, engaged = (
            start[rows, None] + (end[rows] - start[rows])[:, None] * SUBSTEP_CENTRES
            for start, end in (elastic, inside)
        )
        condition_index = _condition_indices(deflected, engaged > 0.0, backlash)
        for i in range(time.size):
            time[i] += ((condition_index == i).mean(axis=1) * h[rows]).sum()
    fractions = zip(CONDITIONS, time / h.sum(), strict=True)
    return {name: float(part) for name, part in fractions if part > 0.0}


def _condition_indices(
    elastic: Array, engaged: NDArray[np.bool_], backlash: float
) -> Indices:
    """Indices in CONDITIONS of pairs (..., p); -1 where fewer than two are engaged."""
    is_touching, is_back_contact = (
        (elastic > 0.0) & engaged,
        (elastic < -backlash) & engaged,
    )
    n_engaged, n_touching = engaged.sum(axis=-1), is_touching.sum(axis=-1)
    entering_pair = engaged.argmax(axis=-1)[..., None]
    leaving_pair = -1 - engaged[..., ::-1].argmax(axis=-1)[..., None]
    is_entering_touching, is_leaving_touching = (
        np.take_along_axis(is_touching, index % is_touching.shape[-1], axis=-1)[..., 0]
        for index in (entering_pair, leaving_pair)
    )
    is_one_lost = n_touching == n_engaged - 1
    masks = {
        "": n_engaged < 2,
        "back": is_back_contact.any(axis=-1),
        "I": n_touching == 0,
        "III": n_touching == n_engaged,
        "II": is_one_lost & ~is_entering_touching,
        "IV": is_one_lost & ~is_leaving_touching,
    }
    indices = [list(CONDITIONS).index(name) if name else -1 for name in masks]
    return np.select(list(masks.values()), indices, len(CONDITIONS) - 1)
