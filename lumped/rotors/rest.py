"""Modes of rotors at rest, accurate for the lowest ones however short an element is.

Rigid motions are those that neither bearings nor meshes resist. With them taken out,
M x = mu K x has the lowest modes as its largest eigenvalues, which do not suffer from
the highest frequencies of short elements as those of K x = omega^2 M x do.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import eigh, solve_triangular

from lumped.common.array_types import Array
from lumped.rotors.beams import AXIAL_COORDINATE, NODE_SIZE
from lumped.rotors.description import RotorError
from lumped.rotors.gyroscopic import GyroscopicSystem
from lumped.rotors.housing import massive_null_motions

NULL_RTOL = 1e-13  # stiffness against a rigid motion over the largest one
MIN_INVERSE = 1e-9  # inverse of the square of a frequency over the largest one
MIN_OVERLAP = 0.5  # of a mode with rigid motions, which is 0 or 1


def modes_at_rest(system: GyroscopicSystem) -> tuple[Array, Array]:
    """Squares of frequencies (k,) and shapes (n, k) with unit modal mass, rising.

    Squares are exactly 0 of rigid motions, and negative where K, or its symmetric part,
    is not definite. Modes far above the lowest ones are left out.
    """
    rigid = rigid_motions(system)
    level = bending_quotient(system)
    momenta = system.mass @ rigid
    stiffness = 0.5 * (system.stiffness + system.stiffness.T)
    stiffness += level * momenta @ momenta.T
    inverses, shapes, shift = _definite_modes(
        system.mass, stiffness, level, system.shaft_size
    )
    low = inverses > MIN_INVERSE * inverses.max()
    inverses, shapes = inverses[low], shapes[:, low]
    shapes /= np.sqrt(inverses)
    squares = 1.0 / inverses - shift
    overlap = ((momenta.T @ shapes) ** 2).sum(axis=0)
    squares[overlap > MIN_OVERLAP] = 0.0
    order = np.argsort(squares, kind="stable")
    return squares[order], shapes[:, order]


def _definite_modes(
    mass: Array, stiffness: Array, level: float, shaft_size: int
) -> tuple[Array, Array, float]:
    """Eigenvalues of M x = mu (K + shift M) x, with a shift where K is not definite."""
    shift = 0.0
    while True:
        try:
            values, shapes = eigh(mass, stiffness + shift * mass)
        except np.linalg.LinAlgError:
            if not shift:
                both = stiffness + level * mass
                _require_regular(both[shaft_size:, shaft_size:])
            shift = max(level, 10.0 * shift)
            continue
        return values, shapes, shift


def _require_regular(both: Array) -> None:
    """Raise RotorError for a motion with neither stiffness nor mass.

    both : stiffness and some factor times the mass (h, h) of a housing; shafts have
        mass in all motions
    """
    diagonal = np.abs(np.diag(both))
    scale = 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
    values = np.linalg.eigvalsh(scale[:, None] * both * scale)
    if np.abs(values).min(initial=1.0) <= NULL_RTOL:
        raise RotorError(
            "a motion of the housing has neither stiffness nor mass; one is needed"
        )


def rigid_motions(system: GyroscopicSystem) -> Array:
    """Motions (n, r) of rigid parts that strain nothing, with unit modal mass.

    Parts are shafts, and a housing by the motions that strain nothing in it.
    """
    columns = [
        column
        for rotor, nodes in enumerate(system.nodes)
        for column in _rigid_columns(system, rotor, nodes)
    ]
    columns += _rigid_housing_columns(system)
    motions = np.array(columns).T
    motions /= np.sqrt(np.einsum("ni,nm,mi->i", motions, system.mass, motions))
    factor = np.linalg.cholesky(motions.T @ system.mass @ motions)
    motions = solve_triangular(factor, motions.T, lower=True).T
    supports = system.stiffness - system.shaft_stiffness
    at = np.s_[system.shaft_size :, system.shaft_size :]
    supports[at] -= system.housing_stiffness
    resistance = motions.T @ supports @ motions
    left, values, _ = np.linalg.svd(resistance)
    free = values <= NULL_RTOL * values.max(initial=0.0)
    return np.asarray(motions @ left[:, free])


def _rigid_columns(
    system: GyroscopicSystem, rotor: int, nodes: tuple[float, ...]
) -> list[Array]:
    """Translations, tilts about the middle and rotation of a rotor, then z."""
    first = system.index(rotor, nodes[0], "x")
    at = first + NODE_SIZE * np.arange(len(nodes))
    distance = np.array(nodes) - 0.5 * (nodes[0] + nodes[-1])
    columns = list(np.zeros((NODE_SIZE, system.size)))
    for column in range(NODE_SIZE):
        columns[column][at + column] = 1.0
    columns[2][at + 1] = -distance
    columns[3][at] = distance
    if system.has_axial_motion:
        first = system.index(rotor, nodes[0], AXIAL_COORDINATE)
        columns.append(np.zeros(system.size))
        columns[-1][first : first + len(nodes)] = 1.0
    return columns


def _rigid_housing_columns(system: GyroscopicSystem) -> list[Array]:
    at = np.s_[system.shaft_size :, system.shaft_size :]
    motions = massive_null_motions(system.housing_stiffness, system.mass[at])
    columns = np.zeros((motions.shape[1], system.size))
    columns[:, system.shaft_size :] = motions.T
    return list(columns)


def bending_quotient(system: GyroscopicSystem) -> float:
    """Square of a frequency of shafts alone that bend like parabolas (Rayleigh)."""
    bent = np.zeros(system.size)
    for rotor, nodes in enumerate(system.nodes):
        at = system.index(rotor, nodes[0], "x") + NODE_SIZE * np.arange(len(nodes))
        distance = np.array(nodes) - 0.5 * (nodes[0] + nodes[-1])
        bent[at], bent[at + 3] = distance**2, 2.0 * distance
    return float(bent @ system.shaft_stiffness @ bent / (bent @ system.mass @ bent))
