"""A train whose gears move in space, on shafts that bend, twist and slide on bearings.

Shafts with their gears and bearings are reduced to the six motions of every gear and to
modes with gears held (Craig and Bampton), of which those below a bound are kept. All
motions of this reduced machine are coordinates: its modes without teeth, of unit mass.

Gears are rigid, so that flanks of a mesh approach each other by s + x t at a place x
along the axis, where t is the difference of their slopes along the push: two rows of
the coordinates describe a mesh. Its middle x = 0 is the mean centre of stiffness, about
which the mean stiffness is k s^2 / 2 + kappa t^2 / 2.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from lumped.common.array_types import Array
from lumped.common.short_repr import ShortRepr
from lumped.rotors.beams import AXIAL_COORDINATE, NODE_COORDINATES, X, Y
from lumped.rotors.bearing_matrices import Z, force_at_rest, forces_at_rest
from lumped.rotors.description import RotorSystem
from lumped.rotors.gyroscopic import GyroscopicSystem
from lumped.rotors.housing import HOUSING_NODE_SIZE
from lumped.rotors.matrices import assemble
from lumped.rotors.mesh_springs import approach_of_motions, rigid_motions
from lumped.rotors.response import bearing_forces
from lumped.rotors.rest import modes_at_rest
from lumped.train.coordinates import SHAFT, TILT, Coordinates
from lumped.train.width_springs import WidthLaw

RIGID_RTOL = 1e-7  # frequency over the highest one below which a motion is rigid
# Modes with gears held are kept up to so many times the highest frequency at which the
# whole machine strains its teeth
KEPT_MODES = 1.5
MIN_STRAIN = 0.05  # part of the strain energy of such modes in teeth


@dataclass(frozen=True, eq=False)
class MotionInSpace(ShortRepr):
    """Coordinates of a train in space (n), of gears (g) and meshes (m).

    coordinates : inertias, springs and loads; shafts, and tilts of meshes, are springs
    tilt_rows, tilt_stiffness : (m, n) and (m,), see the module
    damping : (n, n) of bearings [1/s]
    gyroscopic : (n, n) over the speed of the first mesh's driver
    cross_stiffness : (n, n) skew part of the stiffness of bearings [1/s2]
    basis : (N, n) displacements of the shafts' N coordinates per coordinate
    offset : (N,) constant part of these, of shafts between gears that are held
    matrices : shafts that these belong to
    system : the shafts themselves
    rotations : (g, N) rows of the rotations of gears
    mesh_motions : (m, 2, 11) both rows of a mesh by the rigid motions of its gears
    strained_Hz : (k,) natural frequencies of all N coordinates, with mean mesh
        stiffnesses, of modes with MIN_STRAIN of their strain energy in teeth
    """

    coordinates: Coordinates
    tilt_rows: Array
    tilt_stiffness: Array
    damping: Array
    gyroscopic: Array
    cross_stiffness: Array
    basis: Array
    offset: Array
    matrices: GyroscopicSystem
    system: RotorSystem
    rotations: Array
    mesh_motions: Array
    strained_Hz: Array

    @cached_property
    def bearing_forces(self) -> tuple[Array, Array]:
        """Forces (b, 3, n) of bearings on shafts along x, y, z, by coordinate and rate.

        Those of linearised bearings come on top of what they have at rest.

        In the order of the shafts and of the bearings on each [N/m and N s/m].
        """
        motion = self.basis.T.astype(np.complex128)
        unit = bearing_forces(self.system, self.matrices, np.ones(self.count), motion)
        of_rows = np.moveaxis(np.array(unit), 1, -1)
        return of_rows.real, of_rows.imag

    @property
    def bearings(self) -> tuple[tuple[int, float], ...]:
        """Shaft, from 0, and position [m] of every bearing."""
        return tuple(
            (number, bearing.position)
            for number, rotor in enumerate(self.system.rotors)
            for bearing in rotor.bearings
        )

    @property
    def sensors(self) -> tuple[str, ...]:
        """Names of what sensors measure, with units at their ends.

        Forces of shafts on bearings, accelerations of shafts at bearings, and those of
        the nodes of a housing, along x, y, z.
        """
        names = []
        for rotor in self.system.rotors:
            count = len(rotor.bearings)
            names += [f"{rotor.name}_bearing{k}" for k in range(1, count + 1)]
        nodes = () if self.system.housing is None else self.system.housing.nodes
        moving = [*names, *(f"housing_node{k + 1}" for k in range(len(nodes)))]
        return (
            *(f"{name}_{axis}_N" for name in names for axis in "xyz"),
            *(f"{name}_{axis}_m_per_s2" for name in moving for axis in "xyz"),
        )

    def sensed(
        self, displacement: Array, velocity: Array, acceleration: Array
    ) -> Array:
        """What `sensors` measure (k, s) at motions of the coordinates (k, n)."""
        over_displacement, over_velocity = (
            part.reshape(-1, self.count) for part in self.bearing_forces
        )
        force = displacement @ over_displacement.T + velocity @ over_velocity.T
        force = force + self._forces_at_rest
        moving = self.basis[self._places_of_sensors]
        return np.hstack([-force, acceleration @ moving.T])

    @property
    def _forces_at_rest(self) -> Array:
        """Forces (3 b,) of bearings on shafts without motion of the coordinates."""
        forces = [
            force_at_rest(bearing)[[X, Y, Z]]
            for rotor in self.system.rotors
            for bearing in rotor.bearings
        ]
        constant = bearing_forces(
            self.system,
            self.matrices,
            np.zeros(1),
            self.offset[None].astype(np.complex128),
        )
        return np.concatenate(forces) + np.concatenate([f[0].real for f in constant])

    @property
    def _places_of_sensors(self) -> list[int]:
        """Coordinates of shafts at bearings, and of the nodes of a housing."""
        at_bearings = [
            self.matrices.index(number, bearing.position, kind)
            for number, rotor in enumerate(self.system.rotors)
            for bearing in rotor.bearings
            for kind in ("x", "y", AXIAL_COORDINATE)
        ]
        nodes = () if self.system.housing is None else self.system.housing.nodes
        first = self.matrices.shaft_size
        return at_bearings + [
            first + HOUSING_NODE_SIZE * node + axis
            for node in range(len(nodes))
            for axis in range(3)
        ]

    @property
    def middles(self) -> Array:
        """Mean centers of stiffness (m,) from the middles of the planes of action [m].

        Along the axis; deflections and moments of meshes refer to them.
        """
        places = []
        for rows, mesh in zip(self.mesh_motions, self.system.meshes, strict=True):
            away = rows[0] - approach_of_motions(mesh)[0]
            places.append(away @ rows[1] / (rows[1] @ rows[1]))
        return np.array(places)

    @property
    def count(self) -> int:
        """Number of coordinates n."""
        return int(self.basis.shape[1])


def motion_in_space(
    system: RotorSystem,
    laws: Sequence[WidthLaw],
    places: Sequence[tuple[int, float]],
    torques: Sequence[float],
    bound: float = KEPT_MODES,
) -> MotionInSpace:
    """Coordinates of shafts, gears and bearings under torques on the gears.

    laws : of the meshes
    places : rotor, and position along it [m], of every gear
    torques : on every gear, counter-clockwise [N m]
    bound : frequency up to which modes with gears held are kept, see `KEPT_MODES`
    """
    matrices = assemble(system)
    stiffness = matrices.stiffness - matrices.mesh_stiffness.sum(axis=0)
    across = 0.5 * (stiffness - stiffness.T)
    stiffness = stiffness - across
    strained = _strained_frequencies(matrices)
    highest = bound * float(strained.max(initial=0.0))
    at_gears = _coordinates_of_gears(matrices, places)
    basis, squares = _modes(matrices, stiffness, at_gears, highest)
    at_rest = forces_at_rest(matrices, system)
    offset = _deflection_with_gears_held(stiffness, at_gears, at_rest)
    at_rest = at_rest - stiffness @ offset
    rows = np.stack(
        [
            law.rows @ rigid_motions(matrices, mesh) @ basis
            for law, mesh in zip(laws, system.meshes, strict=True)
        ]
    )
    tilt_stiffness = np.array([law.tilt_stiffness for law in laws])
    rotations = np.zeros((len(places), matrices.size))
    for row, (rotor, position) in zip(rotations, places, strict=True):
        row[matrices.index(rotor, position, "rotation")] = 1.0
    return MotionInSpace(
        coordinates=_coordinates(
            squares,
            rows,
            tilt_stiffness,
            (np.array(torques) @ rotations + at_rest) @ basis,
        ),
        tilt_rows=rows[:, 1],
        tilt_stiffness=tilt_stiffness,
        damping=basis.T @ matrices.damping @ basis,
        gyroscopic=basis.T @ matrices.gyroscopic @ basis,
        cross_stiffness=basis.T @ across @ basis,
        basis=basis,
        offset=offset,
        matrices=matrices,
        system=system,
        rotations=rotations,
        mesh_motions=np.stack([law.rows for law in laws]),
        strained_Hz=strained / (2.0 * math.pi),
    )


def _coordinates_of_gears(
    matrices: GyroscopicSystem, places: Sequence[tuple[int, float]]
) -> NDArray[np.intp]:
    kinds = [*NODE_COORDINATES, AXIAL_COORDINATE]
    indices = {
        matrices.index(rotor, position, kind)
        for rotor, position in places
        for kind in kinds
    }
    return np.array(sorted(indices), np.intp)


def _modes(
    matrices: GyroscopicSystem,
    stiffness: Array,
    at_gears: NDArray[np.intp],
    highest: float,
) -> tuple[Array, Array]:
    """Modes (N, n) of unit mass without teeth, and their squared frequencies (n,).

    at_gears : coordinates of gears
    highest : frequency up to which modes with gears held are kept [rad/s]
    """
    inside = np.setdiff1d(np.arange(matrices.size), at_gears)
    within = stiffness[np.ix_(inside, inside)]
    static = np.zeros((matrices.size, at_gears.size))
    static[at_gears, np.arange(at_gears.size)] = 1.0
    static[inside] = -np.linalg.solve(within, stiffness[np.ix_(inside, at_gears)])
    # of a housing there may be coordinates without mass, but none without stiffness
    inverse_squares, held = eigh(matrices.mass[np.ix_(inside, inside)], within)
    chosen = inverse_squares * highest**2 >= 1.0
    with_gears_held = np.zeros((matrices.size, int(chosen.sum())))
    with_gears_held[inside] = held[:, chosen] / np.sqrt(inverse_squares[chosen])
    reduced = np.hstack([static, with_gears_held])
    squares, shapes = eigh(
        *(reduced.T @ part @ reduced for part in (stiffness, matrices.mass))
    )
    squares[squares < RIGID_RTOL**2 * squares[-1]] = 0.0
    return reduced @ shapes, squares


def _deflection_with_gears_held(
    stiffness: Array, at_gears: NDArray[np.intp], load: Array
) -> Array:
    """Displacements (N,) under constant loads (N,), which modes need not have."""
    inside = np.setdiff1d(np.arange(load.size), at_gears)
    deflection = np.zeros(load.size)
    if load.any():
        within = stiffness[np.ix_(inside, inside)]
        deflection[inside] = np.linalg.solve(within, load[inside])
    return deflection


def _strained_frequencies(matrices: GyroscopicSystem) -> Array:
    """Frequencies (k,) of modes of all coordinates that strain teeth [rad/s]."""
    meshes = matrices.mesh_stiffness.sum(axis=0)
    squares, shapes = modes_at_rest(matrices)
    in_teeth = (shapes * (meshes @ shapes)).sum(axis=0)
    strained = (in_teeth >= MIN_STRAIN * squares) & (squares > 0.0)
    return np.asarray(np.sqrt(squares[strained]))


def _coordinates(
    squares: Array, rows: Array, tilt_stiffness: Array, load: Array
) -> Coordinates:
    """Modes as coordinates of unit mass, each with a spring to ground.

    rows : approach of flanks and its growth along the axis (m, 2, n)
    """
    n, elastic = squares.size, squares > 0.0
    return Coordinates(
        labels=tuple(("shafts", f"mode {number}") for number in range(1, n + 1)),
        indices={},
        mass=np.ones(n),
        load=load,
        mesh_rows=np.ascontiguousarray(rows[:, 0]),
        spring_rows=np.concatenate([np.eye(n)[elastic], rows[:, 1]]),
        spring_stiffness=np.concatenate([squares[elastic], tilt_stiffness]),
        spring_kinds=(SHAFT,) * int(elastic.sum()) + (TILT,) * len(rows),
        gyroscopic=np.zeros((n, n)),
        centripetal=np.zeros((n, n)),
    )


def angular_speed(frequency: float, teeth: int) -> float:
    """Speed of the first mesh's driver [rad/s] at its mesh frequency [Hz]."""
    return 2.0 * math.pi * frequency / teeth
