"""Housing as a condensed matrix at bearings, as finite-element programs write it.

Every node has six coordinates; modes of a housing that is held at its nodes (Craig and
Bampton 1968) may follow. Housings do not turn, so that they have no gyroscopic forces.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from lumped.common.array_types import Array
from lumped.rotors.beams import TILT_X, TILT_Y, X, Y

NODE_COORDINATES = ("x", "y", "z", "rotation about x", "about y", "about z")
HOUSING_NODE_SIZE = len(NODE_COORDINATES)
HOUSING_Z = 2
# coordinates of a node of a shaft, and those of a housing that move a bearing likewise
IN_HOUSING = {X: 0, Y: 1, TILT_X: 3, TILT_Y: 4}
SYMMETRY_RTOL = 1e-8  # of the largest value, which programs that print digits leave
ROUND_OFF_RTOL = 1e-14  # of the largest value, that is no stiffness or mass
DEFINITE_RTOL = 1e-9  # of the largest eigenvalue, that is round-off
MASSLESS_RTOL = 1e-12  # of the largest mass of a coordinate


class HousingError(ValueError):
    """A housing whose matrices or nodes cannot be used, in one line."""


class HousingNode(NamedTuple):
    """Bearing that a node of a housing holds, by the indices of rotor and bearing."""

    rotor: int
    bearing: int


@dataclass(frozen=True, eq=False, kw_only=True)
class Housing:
    """Matrices (h, h) of a housing in coordinates of its nodes, then of modes.

    stiffness, mass : symmetric and positive semidefinite; units are SI
    damping : likewise, None for 0
    nodes : bearing of every node, None of a further one; coordinates of a node are
        displacements along x, y, z and rotations about them
    """

    stiffness: Array
    mass: Array
    damping: Array | None = None
    nodes: tuple[HousingNode | None, ...]

    def __post_init__(self) -> None:
        least = HOUSING_NODE_SIZE * len(self.nodes)
        for name, matrix in self._matrices():
            size = np.shape(self.stiffness)[0] if np.ndim(self.stiffness) else 0
            if matrix.shape != (size, size):
                raise HousingError(
                    f"{name} is {_shape_text(matrix)}; must be square"
                    + ("" if name == "stiffness" else f", {size} x {size}")
                )
            if size < max(least, 1):
                raise HousingError(
                    f"{name} is {_shape_text(matrix)}; must have {HOUSING_NODE_SIZE} "
                    f"rows for each of {len(self.nodes)} nodes, {least} or more"
                )
            _require_sound(name, matrix)
        bearings = [node for node in self.nodes if node is not None]
        for number, node in enumerate(self.nodes, start=1):
            if node is not None and bearings.count(node) > 1:
                raise HousingError(
                    f"nodes row {number} = {node.rotor + 1}, {node.bearing + 1}; the "
                    "bearing is named more than once"
                )

    def _matrices(self) -> Iterator[tuple[str, Array]]:
        yield "stiffness", self.stiffness
        yield "mass", self.mass
        if self.damping is not None:
            yield "damping", self.damping

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Housing) and self._content == other._content

    def __hash__(self) -> int:
        return hash(self._content)

    @cached_property
    def _content(self) -> tuple[object, ...]:
        return self.nodes, *((n, m.shape, m.tobytes()) for n, m in self._matrices())

    @property
    def size(self) -> int:
        """Number of coordinates h."""
        return len(self.stiffness)

    def node_of(self, rotor: int, bearing: int) -> int | None:
        """Index of the node that holds a bearing, None where it is on ground."""
        node = HousingNode(rotor, bearing)
        return self.nodes.index(node) if node in self.nodes else None


def massive_null_motions(stiffness: Array, mass: Array) -> Array:
    """Motions (h, r) that have mass and strain nothing, none of a held housing."""
    scale = _unit_scale(stiffness)
    values, shapes = np.linalg.eigh(_scaled(stiffness, scale))
    free = np.abs(values) <= DEFINITE_RTOL * values.max(initial=0.0)
    motions = scale[:, None] * shapes[:, free]
    masses, parts = np.linalg.eigh(motions.T @ mass @ motions)
    # that all coordinates would have if each were as large as any
    largest = float((scale**2 * np.abs(np.diag(mass))).max(initial=0.0))
    has_mass = masses > MASSLESS_RTOL * largest
    return np.asarray(motions @ parts[:, has_mass])


def symmetric(matrix: Array) -> Array:
    """Symmetric part of a matrix, to the last bit."""
    return np.asarray(0.5 * (matrix + matrix.T))


def _shape_text(matrix: Array) -> str:
    return " x ".join(map(str, matrix.shape))


def _unit_scale(matrix: Array) -> Array:
    """Factors (n,) on coordinates that make the diagonal 1, or round-off of 1."""
    diagonal = np.diag(matrix)
    largest = np.abs(matrix).max(initial=0.0) or 1.0
    counts = diagonal > ROUND_OFF_RTOL * largest
    return np.asarray(1.0 / np.sqrt(np.where(counts, diagonal, largest)))


def _scaled(matrix: Array, scale: Array) -> Array:
    return np.asarray(scale[:, None] * matrix * scale)


def _require_sound(name: str, matrix: Array) -> None:
    """Raise HousingError for a matrix that is not symmetric and semidefinite."""
    if not np.isfinite(matrix).all():
        row, column = np.argwhere(~np.isfinite(matrix))[0]
        raise HousingError(
            f"{name}({row + 1}, {column + 1}) = {matrix[row, column]}; must be finite"
        )
    difference = np.abs(matrix - matrix.T)
    # of coordinates with different units, by their stiffness or mass
    diagonal = np.sqrt(np.maximum(np.diag(matrix), 0.0))
    allowed = SYMMETRY_RTOL * np.maximum(np.outer(diagonal, diagonal), np.abs(matrix))
    allowed = np.maximum(allowed, ROUND_OFF_RTOL * np.abs(matrix).max())
    if (difference > allowed).any():
        row, column = np.unravel_index((difference - allowed).argmax(), matrix.shape)
        above, below = matrix[row, column], matrix[column, row]
        raise HousingError(
            f"{name}({row + 1}, {column + 1}) = {above:.9g} and {name}"
            f"({column + 1}, {row + 1}) = {below:.9g}; the matrix must be symmetric"
        )
    values = np.linalg.eigvalsh(_scaled(symmetric(matrix), _unit_scale(matrix)))
    largest = float(np.abs(values).max())
    if values[0] < -DEFINITE_RTOL * largest:
        raise HousingError(
            f"{name} has an eigenvalue of {values[0] / largest:.3g} times the largest, "
            f"scaled to a diagonal of 1; must be at least {-DEFINITE_RTOL:g}, positive "
            "semidefinite"
        )
