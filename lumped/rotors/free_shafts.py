"""Shafts without bearings: cantilever and rigid motions of a Timoshenko beam."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from lumped.common.array_types import Array
from lumped.rotors.beams import NODE_SIZE, rigid_arm
from lumped.rotors.description import Rotor, Section
from lumped.rotors.gyroscopic import node_at
from lumped.rotors.matrices import element_stiffness, section_at

STATIC_COORDINATES = ("x", "y", "z", "tilt x", "tilt y")
SIZE = len(STATIC_COORDINATES)
X, Y, Z, TILT_X, TILT_Y = range(SIZE)
# Coordinates of a node in `matrices` that are these; z takes the place of the rotation
STATIC_ORDER = np.array([0, 1, 4, 2, 3])


def free_shaft(
    rotor: Rotor, nodes: tuple[float, ...], has_thrust_path: bool
) -> tuple[Array, Array]:
    """Shaft without bearings, at n nodes.

    Parameters
    ----------
    rotor : Rotor
        The shaft.
    nodes : tuple of float
        Positions [m].
    has_thrust_path : bool
        Whether it yields and moves along its axis.

    Returns
    -------
    flexibility : (5 n, 5 n) array
        Displacements under unit loads where the first node is clamped.
    rigid : (5 n, r) array
        Rigid motions that move a point amid the bearings by unit steps.
    """
    flexibility = _cantilever_compliance(rotor, nodes)
    rigid = _rigid_motions(rotor, nodes)
    if not has_thrust_path:
        flexibility[Z::SIZE] = flexibility[:, Z::SIZE] = 0.0
        rigid = np.delete(rigid, Z, axis=1)
    return flexibility, rigid


def motion_at(nodes: tuple[float, ...], positions: Sequence[float]) -> Array:
    """Motion (5 p, 5 n) of points of the axis by that of all nodes.

    A point moves with the nearest node, on a rigid arm where it is not there.
    """
    motion = np.zeros((len(positions), SIZE, len(nodes), SIZE))
    for number, position in enumerate(positions):
        node = node_at(nodes, position)
        motion[number, :, node] = _static_arm(position - nodes[node])
    return motion.reshape(SIZE * len(positions), SIZE * len(nodes))


def bearing_positions(rotor: Rotor) -> list[float]:
    """Positions of all bearings from the first end [m]."""
    return [bearing.position for bearing in rotor.bearings]


def shear_coefficient(section: Section, poisson_ratio: float) -> float:
    """Shear coefficient kappa of a round section, solid or hollow.

    Cowper, The Shear Coefficient in Timoshenko's Beam Theory, J. Appl. Mech. 33 (1966).
    """
    nu, m = poisson_ratio, section.bore / section.diameter
    ring = (1.0 + m**2) ** 2
    return (
        6.0 * (1.0 + nu) * ring / ((7.0 + 6.0 * nu) * ring + (20.0 + 12.0 * nu) * m**2)
    )


def shear_number(rotor: Rotor, section: Section, length: float) -> float:
    """Timoshenko's number phi = 12 E I / (kappa G A L^2) of an element."""
    E, G = rotor.young_modulus, rotor.shear_modulus
    kappa = shear_coefficient(section, 0.5 * E / G - 1.0)
    area, second_moment = section.area, section.second_moment
    return 12.0 * E * second_moment / (kappa * G * area * length**2)


def _cantilever_compliance(rotor: Rotor, nodes: tuple[float, ...]) -> Array:
    """Compliance (5 n, 5 n) of the shaft that is clamped at its first node."""
    size = SIZE * len(nodes)
    compliance = np.zeros((size, size))
    for number, (low, high) in enumerate(pairwise(nodes), start=1):
        beyond = [_static_arm(node - high) for node in nodes[number:]]
        carried, at = np.concatenate(beyond), slice(SIZE * number, size)
        section = section_at(rotor, 0.5 * (low + high))
        element = _element_compliance(rotor, section, high - low)
        compliance[at, at] += carried @ element @ carried.T
    return compliance


def _element_compliance(rotor: Rotor, section: Section, length: float) -> Array:
    """Compliance (5, 5) of the far end of an element whose near end is clamped."""
    shear = shear_number(rotor, section, length)
    far_end = element_stiffness(rotor, section, length, shear)[NODE_SIZE:, NODE_SIZE:]
    stiffness = far_end[np.ix_(STATIC_ORDER, STATIC_ORDER)]
    stiffness[Z, Z] = rotor.young_modulus * section.area / length
    compliance = np.linalg.inv(stiffness)
    return 0.5 * (compliance + compliance.T)


def _rigid_motions(rotor: Rotor, nodes: tuple[float, ...]) -> Array:
    """Rigid motions (5 n, 5) that move a point amid the bearings by unit steps."""
    middle = float(np.mean(bearing_positions(rotor) or [0.0]))
    return np.concatenate([_static_arm(node - middle) for node in nodes])


def _static_arm(distance: float) -> Array:
    """Motion (5, 5) of a point of the axis by that of one at a distance before it."""
    return rigid_arm(distance)[np.ix_(STATIC_ORDER, STATIC_ORDER)]
