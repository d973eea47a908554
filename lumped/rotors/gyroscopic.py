"""Matrices of a gyroscopic system, and the order of its coordinates.

Coordinates along the axes come after all others, so that a system without them is the
leading part of the one with them. Those of a housing follow at the end.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from lumped.common.array_types import Array
from lumped.rotors.beams import (
    AXIAL_COORDINATE,
    NODE_COORDINATES,
    NODE_SIZE,
    QUARTER_TURN,
    ROTATION,
)


@dataclass(frozen=True, eq=False)
class GyroscopicSystem:
    """Matrices of n coordinates over the speed Omega of the system.

    nodes : positions of the nodes of every rotor [m]; five coordinates each, see
        `NODE_COORDINATES`, and after these, in the same order, those along the axes
        where the system has axial motion, then those of the housing
    speed_ratios : of every rotor over the speed of the system
    mass, damping, stiffness : M, C, K (n, n)
    gyroscopic : G (n, n), skew-symmetric
    circulatory : H (n, n), of damping that turns with a rotor
    centripetal : N (n, n), of a frame that turns
    shaft_stiffness : (n, n), part of `stiffness`
    mesh_stiffness : (meshes, n, n), part of `stiffness`
    housing_stiffness : (h, h), part of `stiffness` of the last h coordinates, which are
        those of a housing; none without one
    """

    nodes: tuple[tuple[float, ...], ...]
    speed_ratios: tuple[float, ...]
    mass: Array
    damping: Array
    stiffness: Array
    gyroscopic: Array
    circulatory: Array
    centripetal: Array
    shaft_stiffness: Array
    mesh_stiffness: Array
    housing_stiffness: Array

    @property
    def size(self) -> int:
        """Number of coordinates n."""
        return int(self.mass.shape[0])

    @property
    def node_count(self) -> int:
        """Number of nodes of all rotors."""
        return sum(map(len, self.nodes))

    @property
    def has_axial_motion(self) -> bool:
        """Whether there are coordinates along the axes."""
        return self.shaft_size > NODE_SIZE * self.node_count

    @property
    def shaft_size(self) -> int:
        """Number of coordinates of shafts, which are the first ones."""
        return self.size - len(self.housing_stiffness)

    @cached_property
    def rotor_of(self) -> NDArray[np.intp]:
        """Rotor of every coordinate (n,), -1 of a housing's."""
        counts = list(map(len, self.nodes))
        of_nodes = np.repeat(np.arange(len(counts)), counts)
        along = of_nodes if self.has_axial_motion else of_nodes[:0]
        of_housing = np.full(len(self.housing_stiffness), -1)
        return np.concatenate([np.repeat(of_nodes, NODE_SIZE), along, of_housing])

    @cached_property
    def is_housing(self) -> NDArray[np.bool_]:
        """Whether a coordinate is one of the housing (n,)."""
        return np.arange(self.size) >= self.shaft_size

    @cached_property
    def is_axial(self) -> NDArray[np.bool_]:
        """Whether a coordinate is along the axis (n,)."""
        return (np.arange(self.size) >= NODE_SIZE * self.node_count) & ~self.is_housing

    @cached_property
    def is_rotation(self) -> NDArray[np.bool_]:
        """Whether a coordinate is a rotation about the axis (n,)."""
        of_nodes = np.arange(self.size) < NODE_SIZE * self.node_count
        return of_nodes & (np.arange(self.size) % NODE_SIZE == ROTATION)

    @cached_property
    def is_sideways(self) -> NDArray[np.bool_]:
        """Whether a coordinate moves a shaft across its axis or tilts it (n,)."""
        return ~(self.is_rotation | self.is_axial | self.is_housing)

    @cached_property
    def quarter_turn(self) -> Array:
        """Matrix J (n, n) that turns every node by a quarter, x to y."""
        turn = np.kron(np.eye(self.node_count), QUARTER_TURN)
        return np.pad(turn, (0, self.size - len(turn)))

    @cached_property
    def is_conservative(self) -> bool:
        """Whether M, K are symmetric and nothing else but G is there."""
        others = self.damping, self.circulatory, self.centripetal
        asymmetry = self.stiffness - self.stiffness.T
        return not any(part.any() for part in (*others, asymmetry))

    def index(self, rotor: int, position: float, kind: str) -> int:
        """Index of a coordinate by rotor, position of a node [m] and kind."""
        before = sum(len(nodes) for nodes in self.nodes[:rotor])
        node = before + node_at(self.nodes[rotor], position)
        if kind == AXIAL_COORDINATE:
            return NODE_SIZE * self.node_count + node
        return NODE_SIZE * node + NODE_COORDINATES.index(kind)


def node_at(nodes: tuple[float, ...], position: float) -> int:
    """Index of the node that is nearest to a position [m]."""
    return int(np.abs(np.asarray(nodes) - position).argmin())
