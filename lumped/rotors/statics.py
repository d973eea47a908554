"""Shafts at rest: deflections, bearing reactions and internal forces under loads.

The force method: a shaft is a cantilever from its first node that carries loads and
reactions, plus a rigid motion. Reactions and rigid motion are the unknowns, and
equilibrium is among the equations, so that reactions balance the loads to round-off
also where elements are short and bearings stiff. Beams yield to shear (Timoshenko).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from scipy.linalg import block_diag

from lumped.common.array_types import Array
from lumped.common.checks import require_between, require_fields
from lumped.common.options import Range
from lumped.rotors.bearing_matrices import STATIC_MOTIONS, bearing_stiffness
from lumped.rotors.description import (
    MIN_ELEMENT,
    POSITION_RTOL,
    Rotor,
    RotorError,
)
from lumped.rotors.free_shafts import (
    SIZE,
    TILT_X,
    X,
    Y,
    Z,
    bearing_positions,
    free_shaft,
    motion_at,
)
from lumped.rotors.gyroscopic import node_at
from lumped.rotors.matrices import nodes_of, require_axial_symmetry

MAX_ELEMENTS = 1000
HELD_RTOL = 1e-12  # least stiffness of bearings against a rigid motion over the largest
THRUST_RTOL = 1e-9  # sum of axial forces that cancel over the sum of their magnitudes


@dataclass(frozen=True, kw_only=True)
class ShaftLoad:
    """Force and moment on a shaft about the point of its axis at a position.

    position : from the shaft's first end [m]
    force : along x, y, z [N]
    moment : about x, y, z; that about z is a torque [N m]
    """

    position: float = field(metadata={"allowed": Range(least=0.0, below=math.inf)})
    force: tuple[float, float, float] = (0.0, 0.0, 0.0)
    moment: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        require_fields(self)


@dataclass(frozen=True, eq=False, kw_only=True)
class ShaftSolution:
    """Shaft under loads, at its n nodes.

    Internal forces and moments are those of the part beyond a section on the part
    before it, so that a moment is E I times the rate of the tilt about its axis. They
    have two values at every node, just before and just after it.

    position : of the nodes from the first end (n,) [m]
    deflection : along x, y, z (n, 3) [m]; z is 0 where no bearing is stiff along it
    tilt : about x and y (n, 2) [rad]
    shear : along x and y (n, 2, 2), of nodes, sides and axes [N]
    axial_force : positive in tension (n, 2) [N]
    moment : about x and y (n, 2, 2), of nodes, sides and axes [N m]
    torque : (n, 2) that balances the torques of loads from the first end on; what is
        left after the last node enters or leaves the shaft elsewhere [N m]
    reactions : forces x, y, z and moments about x, y of every bearing on the shaft
        about the point of the axis in it (bearings, 5) [N], [N m]
    """

    position: Array
    deflection: Array
    tilt: Array
    shear: Array
    axial_force: Array
    moment: Array
    torque: Array
    reactions: Array


@dataclass(frozen=True, eq=False, kw_only=True)
class ShaftStatics:
    """Shaft on its bearings, solved for unit loads at all of its n nodes.

    nodes : positions [m]
    places : where loads act [m]
    has_thrust_path : whether a bearing is stiff along the axis; without one, z is 0
    node_compliance : (5 n, 5 n) displacements along x, y, z and about x and y of every
        node in turn, under unit forces and moments there
    reaction_matrix : (5 bearings, 5 n) forces and moments of bearings on the shaft
        under these
    """

    rotor: Rotor
    nodes: tuple[float, ...]
    places: tuple[float, ...]
    has_thrust_path: bool
    node_compliance: Array
    reaction_matrix: Array

    @cached_property
    def compliance(self) -> Array:
        """Displacements (5 g, 5 g) of the g places under unit loads at them.

        They are along x, y, z and about x and y of every place in turn, forces and
        moments likewise. Rows and columns of z are 0 where there is no thrust path.
        """
        motion = motion_at(self.nodes, self.places)
        return np.asarray(motion @ self.node_compliance @ motion.T)

    @cached_property
    def offset(self) -> Array:
        """Displacements (5 g,) of the g places without loads, by linearised bearings.

        With loads p at the places displacements are offset + compliance p.
        """
        motion = motion_at(self.nodes, self.places)
        return np.asarray(motion @ self.node_compliance @ self._without_loads)

    @property
    def _without_loads(self) -> Array:
        """Forces (5 n,) of linearised bearings on nodes that do not move."""
        forces = [
            np.zeros(SIZE) if bearing.linearised is None else bearing.linearised.force
            for bearing in self.rotor.bearings
        ]
        at_bearings = motion_at(self.nodes, bearing_positions(self.rotor))
        return np.asarray(at_bearings.T @ np.concatenate([np.zeros(0), *forces]))

    def motions_of_bearings(self, solution: ShaftSolution) -> Array:
        """Displacements (b, 5) of the shaft in its bearings."""
        motion = motion_at(self.nodes, bearing_positions(self.rotor))
        displacement = np.hstack([solution.deflection, solution.tilt])
        return np.asarray((motion @ displacement.ravel()).reshape(-1, SIZE))

    def solve(self, loads: Sequence[ShaftLoad]) -> ShaftSolution:
        """Deflections, reactions and internal forces under loads at places or nodes.

        Raises RotorError for a load elsewhere, and for thrust where no bearing is stiff
        along the axis.
        """
        self._require_possible(loads)
        motion = motion_at(self.nodes, [load.position for load in loads])
        applied = np.array([(*load.force, *load.moment[:2]) for load in loads])
        on_nodes = motion.T @ applied.reshape(-1)
        torque = np.zeros(len(self.nodes))
        for load in loads:
            torque[node_at(self.nodes, load.position)] += load.moment[2]
        moving = on_nodes + self._without_loads
        displacement = (self.node_compliance @ moving).reshape(-1, SIZE)
        reactions = self.reaction_matrix @ moving
        for number, bearing in enumerate(self.rotor.bearings):
            if bearing.linearised is not None:
                at = slice(SIZE * number, SIZE * (number + 1))
                reactions[at] += bearing.linearised.force
        at_bearings = motion_at(self.nodes, bearing_positions(self.rotor))
        total = (on_nodes + at_bearings.T @ reactions).reshape(-1, SIZE)
        force = _internal(total[:, :TILT_X])
        return ShaftSolution(
            position=np.array(self.nodes),
            deflection=displacement[:, :TILT_X],
            tilt=displacement[:, TILT_X:],
            shear=force[..., :Z],
            axial_force=force[..., Z],
            moment=_internal_moment(np.array(self.nodes), total),
            torque=_internal(torque),
            reactions=reactions.reshape(-1, SIZE),
        )

    def _require_possible(self, loads: Sequence[ShaftLoad]) -> None:
        name, nodes = self.rotor.name, self.nodes
        for load in loads:
            distance = abs(load.position - nodes[node_at(nodes, load.position)])
            if distance > MIN_ELEMENT * self.rotor.length:
                raise RotorError(
                    f"rotor {name!r}: load at {load.position:g} m; must be at one of "
                    f"the places, {', '.join(f'{one:g}' for one in self.places)} m"
                )
        axial = np.array([load.force[2] for load in loads])
        is_balanced = abs(axial.sum()) <= THRUST_RTOL * np.abs(axial).sum()
        if not (self.has_thrust_path or is_balanced):
            raise RotorError(
                f"rotor {name!r}: axial force = {axial.sum():g} N; must be 0 without a "
                "bearing that has axial_stiffness"
            )


def shaft_statics(
    rotor: Rotor, places: Sequence[float], elements: int = 12
) -> ShaftStatics:
    """A shaft on its bearings, ready for loads at places along it.

    Its disks and torsional springs have no part in it. Elements are exact for loads at
    nodes; more of them only add points to curves.

    Parameters
    ----------
    rotor : Rotor
        The shaft and its bearings.
    places : sequence of float
        Where loads act, from the first end [m].
    elements : int
        Least number of elements.

    Raises
    ------
    RotorError
        If a place is not on the shaft, a section is not axially symmetric, or bearings
        do not hold the shaft.
    """
    require_between("elements", elements, 1, MAX_ELEMENTS)
    require_axial_symmetry(rotor)
    for place in places:
        rotor.require_position("load", place)
    nodes = nodes_of(rotor, list(places), elements)
    at_bearings = motion_at(nodes, bearing_positions(rotor))
    stiffness = _stiffness_of_bearings(rotor)
    has_thrust_path = bool((np.diag(stiffness)[Z::SIZE] > 0.0).any())
    flexibility, rigid = free_shaft(rotor, nodes, has_thrust_path)
    _require_held(rotor, stiffness, at_bearings @ rigid)
    reactions, motion = _reactions(flexibility, rigid, at_bearings, stiffness)
    carried = np.eye(len(rigid)) + at_bearings.T @ reactions
    compliance = flexibility @ carried + rigid @ motion
    if (stiffness == stiffness.T).all():  # displacements are reciprocal
        compliance = 0.5 * (compliance + compliance.T)
    return ShaftStatics(
        rotor=rotor,
        nodes=nodes,
        places=tuple(places),
        has_thrust_path=has_thrust_path,
        node_compliance=compliance,
        reaction_matrix=reactions,
    )


def _stiffness_of_bearings(rotor: Rotor) -> Array:
    """Stiffness (5 b, 5 b) of all bearings against motion of the shaft in them."""
    at = np.ix_(STATIC_MOTIONS, STATIC_MOTIONS)
    blocks = [bearing_stiffness(bearing)[at] for bearing in rotor.bearings]
    return np.asarray(block_diag(*blocks)) if blocks else np.zeros((0, 0))


def _require_held(rotor: Rotor, stiffness: Array, rigid: Array) -> None:
    """Raise RotorError where bearings do not resist one of the rigid motions.

    rigid : motions of the bearings (5 b, r)
    """
    resistance = rigid.T @ stiffness @ rigid
    # a tilt by the path of a point at a distance of the shaft's length
    scale = np.ones(len(resistance))
    scale[-2:] = 1.0 / rotor.length
    resistance = scale[:, None] * resistance * scale
    diagonal = np.abs(np.diag(resistance))
    least = POSITION_RTOL**2 * diagonal.max()
    if least > 0.0:
        norm = 1.0 / np.sqrt(np.maximum(diagonal, least))
        values = np.linalg.svd(norm[:, None] * resistance * norm, compute_uv=False)
        if values[-1] > HELD_RTOL * values[0]:
            return
    positions = ", ".join(f"{one:g} m" for one in bearing_positions(rotor)) or "none"
    raise RotorError(
        f"rotor {rotor.name!r}: bearings at {positions} do not hold the shaft; "
        "stiffness along x and y in two different places, or tilt_stiffness, is needed"
    )


def _reactions(
    flexibility: Array, rigid: Array, at_bearings: Array, stiffness: Array
) -> tuple[Array, Array]:
    """Reactions (5 b, 5 n) and rigid motions (r, 5 n) under unit loads at nodes.

    With reactions R, loads f and the rigid motion q, bearings move by
    u = B F (f + B^T R) + B A q; then R = -K u and A^T (f + B^T R) = 0.
    """
    bent, moved = at_bearings @ flexibility, at_bearings @ rigid
    count, motions = moved.shape
    matrix = np.block(
        [
            [np.eye(count) + stiffness @ bent @ at_bearings.T, stiffness @ moved],
            [moved.T, np.zeros((motions, motions))],
        ]
    )
    right = -np.concatenate([stiffness @ bent, rigid.T])
    # unknowns of about one size, then equations of about one size
    columns = np.ones(count + motions)
    columns[count:] = flexibility.max()
    rows = 1.0 / np.abs(matrix * columns).max(axis=1)
    solution = np.linalg.solve(rows[:, None] * matrix * columns, rows[:, None] * right)
    solution *= columns[:, None]
    return solution[:count], solution[count:]


def _internal(applied: Array) -> Array:
    """Internal forces (n, 2, ...) before and after nodes by those on nodes (n, ...)."""
    after = -np.cumsum(applied, axis=0)
    return np.stack([after + applied, after], axis=1)


def _internal_moment(nodes: Array, total: Array) -> Array:
    """Internal moments about x and y (n, 2, 2) by what acts on nodes (n, 5)."""
    arms = np.tril(nodes - nodes[:, None])  # to nodes before, negative
    moments = _internal(total[:, TILT_X:])
    bent = np.stack([arms @ total[:, Y], -arms @ total[:, X]], axis=-1)
    return moments + bent[:, None]
