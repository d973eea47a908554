"""Root stress of both gears over a mesh cycle, from the loads of the contact."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fegear.contact.path import path_positions, sliding_sign
from fegear.contact.problem import ContactProblem
from fegear.contact.result import ContactCycle, FaceLoads
from fegear.contact.width.contact import WidthContact
from fegear.contact.width.double import half_faces
from fegear.elasticity.root_stress import MAX_TOOTH_OFFSET, FlankLoad, RootInfluence
from fegear.elasticity.sector import RIGHT
from fegear.elasticity.wide_root import LineLoad, WideRoot, arcs_along
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
    slopes : (t, n, k, z, x) of that by changes of the loads
    helices : along which the places are in turn, 2 of double helical gears
    """

    place: Array
    stress: Array
    slopes: Array
    helices: int = 1

    @property
    def over_cycle(self) -> Array:
        """Largest of all teeth over the mesh cycle (t, z) [Pa]."""
        return np.asarray(np.nanmax(self.stress, axis=(1, 2)))

    @property
    def factor(self) -> Array:
        """K_Fbeta (t,): the largest over the mean over the width, of `over_cycle`."""
        most = self.over_cycle
        parts = zip(
            np.split(most, self.helices, axis=1),
            np.split(self.place, self.helices),
            strict=True,
        )
        means = [np.trapezoid(of_part, at) / np.ptp(at) for of_part, at in parts]
        return np.asarray(most.max(axis=1) / np.mean(means, axis=0))

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
    load_slopes: Array | None = None,
) -> RootStresses:
    """Tension of all teeth that are in a pair, under the loads of all slices.

    roots : of driver and driven gear, whose hubs are held
    load_slopes : (t, n, k, m, x) of loads per length of the line of contact by changes,
        in whose slopes of the tension arcs of loads stay
    """
    if load_slopes is None:
        load_slopes = np.empty((*cycle.face.load.shape, 0))
    with stage("root stress"):
        over_width = tuple(
            _joined_over_width(
                [
                    _tensions_over_width(
                        problem, half, face, gear, roots[gear], load_slopes[..., at, :]
                    )
                    for half, (face, at) in zip(
                        solver.halves, half_faces(cycle.face), strict=True
                    )
                ],
                0.5 * (solver.groove + solver.width),
            )
            for gear in (DRIVER, DRIVEN)
        )
    for gear, of_gear in enumerate(over_width):
        of_gear.stress[:, _without_stress(problem, cycle, gear)] = np.nan
    driver, driven = (of_gear.stress.max(axis=3) for of_gear in over_width)
    return RootStresses(driver, driven, over_width)


class FilletTension(NamedTuple):
    """Tension across the fillets of the teeth (k,) of one gear, at positions (n,).

    teeth : (k,) base pitches by which their pairs are ahead
    along : (f,) of points of a fillet, from the flank on [m]
    place : (z,) from the middle of the common face width [m]
    stress : (n, k, f, z) [Pa]; beside a contact it is not that of the root
    """

    teeth: Indices
    along: Array
    place: Array
    stress: Array


def fillet_tension(
    problem: ContactProblem,
    solver: WidthContact,
    cycle: ContactCycle,
    gear: int,
    root: WideRoot,
) -> FilletTension:
    """Tension on the side of the loaded flanks, under the first of the torques.

    root : of the gear, whose loads vary over the width along one helix
    """
    face, offset = cycle.face, solver.offsets[gear]
    root = _as_solved(root, problem, face)
    along = arcs_along(root.section.fillets[0])
    stress = np.zeros((*face.load.shape[1:3], along.size, root.places.size))
    with stage("root stress"):
        of_teeth = _along_fillets(
            root,
            face.teeth if gear == DRIVER else -face.teeth,
            face.load[0] * face.slice_length,
            face.arc[0, ..., gear],
            face.place + offset,
        )
        for k, tension in of_teeth:
            stress[:, k] = tension
    stress[_without_stress(problem, cycle, gear)] = np.nan
    return FilletTension(face.teeth, along, root.places - offset, stress)


def _as_solved(root: WideRoot, problem: ContactProblem, face: FaceLoads) -> WideRoot:
    """The root with the helix that the loads have, which may be the mirrored one."""
    is_mirrored = face.base_helix_angle * problem.pair.driver.twist < 0.0
    return root.mirrored if is_mirrored else root


def _joined_over_width(halves: list[RootOverWidth], apart: float) -> RootOverWidth:
    """Tension along the near and the far half, or all of the width.

    apart : middles of the halves from that of the whole width [m]
    """
    if len(halves) == 1:
        return halves[0]
    near, far = halves
    return RootOverWidth(
        np.concatenate([near.place - apart, far.place + apart]),
        np.concatenate([near.stress, far.stress], axis=3),
        np.concatenate([near.slopes, far.slopes], axis=3),
        helices=2,
    )


def _tensions_over_width(
    problem: ContactProblem,
    solver: WidthContact,
    face: FaceLoads,
    gear: int,
    root: WideRoot,
    load_slopes: Array,
) -> RootOverWidth:
    root = _as_solved(root, problem, face)
    teeth = face.teeth if gear == DRIVER else -face.teeth
    force, changes = face.load * face.slice_length, load_slopes * face.slice_length
    arcs = face.arc[..., gear]
    places = face.place + solver.offsets[gear]
    stress = np.empty((*face.load.shape[:3], root.places.size))
    slopes = np.empty((*stress.shape, changes.shape[-1]))
    for t in range(len(face.load)):
        for rows in _blocks(face.load.shape[1], POSITIONS_OVER_WIDTH):
            lines = force[t, rows], changes[t, rows], arcs[t, rows], places
            stress[t, rows], slopes[t, rows] = _under_lines(root, teeth, *lines)
    return RootOverWidth(root.places - solver.offsets[gear], stress, slopes)


def _under_lines(
    root: WideRoot,
    teeth: Indices,
    force: Array,
    changes: Array,
    arcs: Array,
    places: Array,
) -> tuple[Array, Array]:
    """Tension (n, k, z) of the teeth of pairs under forces (n, k, m) [N].

    And its slopes (n, k, z, x) by changes (n, k, m, x) of the forces.
    """
    stress = np.zeros((len(force), teeth.size, root.places.size))
    slopes = np.zeros((*stress.shape, changes.shape[-1]))
    points = {}
    for k, tension in _along_fillets(root, teeth, force, arcs, places):
        points[k] = root.largest_at(tension)
        largest = np.take_along_axis(tension, points[k], axis=1)[:, 0]
        stress[:, k] = np.maximum(largest, 0.0)
    for x in range(changes.shape[-1]):
        for k, tension in _along_fillets(root, teeth, changes[..., x], arcs, places):
            if k in points:
                of_largest = np.take_along_axis(tension, points[k], axis=1)
                slopes[:, k, :, x] = of_largest[:, 0]
    slopes[stress == 0.0] = 0.0
    return stress, slopes


def _along_fillets(
    root: WideRoot, teeth: Indices, force: Array, arcs: Array, places: Array
) -> Iterator[tuple[int, Array]]:
    """Each pair with the tension (n, f, z) of its tooth under forces (n, k, m) [N]."""
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
    for k in every:
        parts = [
            effects[j, distance]
            for j in every
            if (j, distance := int(teeth[j] - teeth[k])) in effects
        ]
        if parts:
            yield k, np.sum(parts, axis=0)


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
