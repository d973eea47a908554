"""Root stress of both gears over a mesh cycle, from the loads of the contact."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fegear.contact.path import path_positions, sliding_sign
from fegear.contact.problem import ContactProblem
from fegear.contact.result import ContactCycle
from fegear.contact.width.contact import WidthContact
from fegear.elasticity.root_stress import MAX_TOOTH_OFFSET, FlankLoad, RootInfluence
from fegear.elasticity.sector import RIGHT
from fegear.elasticity.wide_root import LineLoad, WideRoot
from fegear.files.timing import stage
from lumped.common.array_types import Array, Indices

if TYPE_CHECKING:
    from collections.abc import Iterator

# whose stress along the fillets, and over the width too, is held at a time
POSITIONS_PER_BLOCK, POSITIONS_OVER_WIDTH = 4096, 256
DRIVER, DRIVEN = 0, 1


class RootOverWidth(NamedTuple):
    """Root stress of one gear over the face width.

    place : (z,) from the middle of the common face width [m]
    stress : (t, n, k, z) largest tension across the fillet of the teeth in each pair on
        the side of their loaded flanks [Pa], NaN of missing teeth
    """

    place: Array
    stress: Array

    @property
    def over_cycle(self) -> Array:
        """Largest of all teeth over the mesh cycle (t, z) [Pa]."""
        return np.asarray(np.nanmax(self.stress, axis=(1, 2)))

    @property
    def factor(self) -> Array:
        """K_Fbeta (t,): the largest over the mean over the width, of `over_cycle`."""
        mean = np.trapezoid(self.over_cycle, self.place) / np.ptp(self.place)
        return np.asarray(self.over_cycle.max(axis=1) / mean)

    def largest_at(self, t: int) -> tuple[int, int, int]:
        """Position, pair and place of the largest at a torque, by their indices."""
        n, k, z = np.unravel_index(np.nanargmax(self.stress[t]), self.stress.shape[1:])
        return int(n), int(k), int(z)


class RootStresses(NamedTuple):
    """Largest tension along the fillets of the teeth in each pair (t, n, k) [Pa].

    NaN of missing teeth, and of cracked ones, whose stress at the crack has no limit.

    over_width : of driver and driven gear, empty where loads are uniform over it
    """

    driver: Array
    driven: Array
    over_width: tuple[RootOverWidth, ...] = ()

    @property
    def largest(self) -> tuple[Array, Array]:
        """Largest of whole teeth of driver and driven gear (t, n) [Pa]."""
        return np.nanmax(self.driver, axis=2), np.nanmax(self.driven, axis=2)


def root_stresses(
    problem: ContactProblem,
    cycle: ContactCycle,
    influences: Sequence[RootInfluence],
) -> RootStresses:
    """Tension of all teeth that are in a pair, under the loads of all pairs.

    influences : of driver and driven gear, whose hubs are held

    A load acts at its centre on each flank, over the common face width.
    """
    with stage("root stress"):
        driver, driven = (
            _tensions(problem, cycle, gear, influences[gear])
            for gear in (DRIVER, DRIVEN)
        )
    return RootStresses(driver, driven)


def root_stresses_over_width(
    problem: ContactProblem,
    solver: WidthContact,
    cycle: ContactCycle,
    roots: Sequence[WideRoot],
) -> RootStresses:
    """Tension of all teeth that are in a pair, under the loads of all slices.

    roots : of driver and driven gear, whose hubs are held
    """
    with stage("root stress"):
        over_width = tuple(
            _tensions_over_width(problem, solver, cycle, gear, roots[gear])
            for gear in (DRIVER, DRIVEN)
        )
    driver, driven = (of_gear.stress.max(axis=3) for of_gear in over_width)
    return RootStresses(driver, driven, over_width)


def _tensions_over_width(
    problem: ContactProblem,
    solver: WidthContact,
    cycle: ContactCycle,
    gear: int,
    root: WideRoot,
) -> RootOverWidth:
    face = cycle.face
    if face.base_helix_angle * problem.pair.driver.twist < 0.0:
        root = root.mirrored  # as the contact was
    teeth = face.teeth if gear == DRIVER else -face.teeth
    force = face.load * face.slice_length
    arcs = face.arc[..., gear]
    places = face.place + solver.offsets[gear]
    stress = np.empty((*cycle.load.shape, root.places.size))
    for t in range(cycle.torque.size):
        for rows in _blocks(cycle.position.size, POSITIONS_OVER_WIDTH):
            lines = force[t, rows], arcs[t, rows]
            stress[t, rows] = _under_lines(root, teeth, *lines, places)
    stress[:, _without_stress(problem, cycle, gear)] = np.nan
    return RootOverWidth(root.places - solver.offsets[gear], stress)


def _under_lines(
    root: WideRoot, teeth: Indices, force: Array, arcs: Array, places: Array
) -> Array:
    """Tension (n, k, z) of the teeth of pairs under forces (n, k, m) [N]."""
    every = range(teeth.size)
    places = np.broadcast_to(places, (len(force), places.size))
    # what a load does depends on how far its tooth is from the stressed one
    distances = {int(teeth[j] - teeth[k]) for j in every for k in every}
    effects: dict[tuple[int, int], Array] = {}
    for distance in distances:
        if abs(distance) > MAX_TOOTH_OFFSET:
            continue
        for j in every:
            if force[:, j].any():
                load = LineLoad(distance, arcs[:, j], places, force[:, j])
                effects[j, distance] = root.along_fillet([load])
    tensions = np.zeros((len(force), teeth.size, root.places.size))
    for k in every:
        parts = [
            effects[j, distance]
            for j in every
            if (j, distance := int(teeth[j] - teeth[k])) in effects
        ]
        if parts:
            tensions[:, k] = root.largest(np.sum(parts, axis=0))
    return tensions


def _tensions(
    problem: ContactProblem, cycle: ContactCycle, gear: int, influence: RootInfluence
) -> Array:
    """Tension (t, n, k) of the teeth of one gear."""
    # a pair ahead is clockwise on the driver and the other way on the driven gear
    teeth = cycle.teeth if gear == DRIVER else -cycle.teeth
    normal = cycle.load / problem.face_width
    rootward = problem.friction * sliding_sign(path_positions(cycle)) * normal
    tensions = np.empty_like(normal)
    for rows in _blocks(cycle.position.size, POSITIONS_PER_BLOCK):
        loads = [
            FlankLoad(
                int(tooth),
                RIGHT,
                cycle.arc[:, rows, k, gear],
                normal[:, rows, k],
                rootward[:, rows, k],
            )
            for k, tooth in enumerate(teeth)
        ]
        for k, tooth in enumerate(teeth):
            seen = [load._replace(tooth=load.tooth - int(tooth)) for load in loads]
            tensions[:, rows, k] = influence.stress(seen)
    tensions[:, _without_stress(problem, cycle, gear)] = np.nan
    return tensions


def _without_stress(
    problem: ContactProblem, cycle: ContactCycle, gear: int
) -> NDArray[np.bool_]:
    """Whether teeth (n, k) of a gear are cracked or missing."""
    faults = problem.flanks[gear].faults
    if faults is None:
        return np.zeros(cycle.load.shape[1:], bool)
    # pairs count anew in each base pitch
    pitch = np.floor(cycle.position).astype(np.int64)
    number = pitch[:, None] - cycle.teeth
    return faults.is_cracked(number) | faults.is_missing(number % faults.teeth)


def _blocks(count: int, size: int) -> Iterator[slice]:
    for start in range(0, count, size):
        yield slice(start, start + size)


def relative_change(stresses: RootStresses, others: RootStresses) -> Array:
    """Largest change over the cycle of both gears' root stress over its peak (t,).

    others : at the same torques and at the first of the positions
    """
    changes = []
    for one, other in zip(stresses.largest, others.largest, strict=True):
        change = np.abs(other - one[:, : other.shape[1]]).max(axis=1)
        changes.append(change / one.max(axis=1))
    return np.maximum(*changes)
