"""Steady vibration of spinning shafts under harmonic forces.

Forces F e^(i w t) give displacements x e^(i w t) with

    (K + Omega H - Omega^2 N - w^2 M + i w (C + Omega G + D)) x = F

in modes of the system at rest, where D has a damping ratio of every one of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lumped.common.array_types import Array, Complex
from lumped.common.checks import require_between
from lumped.rotors.beams import X, Y
from lumped.rotors.bearing_matrices import (
    Z,
    bearing_damping,
    bearing_motion,
    bearing_stiffness,
)
from lumped.rotors.description import RotorSystem
from lumped.rotors.gyroscopic import GyroscopicSystem
from lumped.rotors.housing import HOUSING_NODE_SIZE
from lumped.rotors.whirl import WhirlProblem


@dataclass(frozen=True, eq=False)
class HarmonicForce:
    """Force of a frequency that is proportional to the speed.

    order : frequency over the speed of the system
    force : (n,) complex amplitudes [N and N m]
    """

    order: float
    force: Complex


def steady_response(
    problem: WhirlProblem,
    forces: Sequence[HarmonicForce],
    speed: float,
    damping_ratio: float,
) -> Complex:
    """Complex amplitudes (forces, n) of displacements under each force [m and rad].

    Rotations that nothing resists are left out, as `WhirlProblem` has them.

    Parameters
    ----------
    problem : WhirlProblem
        The shafts in their modes at rest.
    forces : sequence of HarmonicForce
        What acts on them.
    speed : float
        Of the system [rad/s].
    damping_ratio : float
        Of every mode at rest, besides the damping of bearings.
    """
    require_between("damping_ratio", damping_ratio, 0.0, 1.0)
    stiffness, damping = problem.at_speed(speed, damping_ratio)
    size = problem.squares.size
    amplitudes = np.empty((len(forces), problem.system.size), np.complex128)
    for row, one in zip(amplitudes, forces, strict=True):
        frequency = one.order * speed
        dynamic = stiffness - frequency**2 * np.eye(size) + 1j * frequency * damping
        row[:] = problem.basis @ np.linalg.solve(dynamic, problem.basis.T @ one.force)
    return amplitudes


def mean_power(force: HarmonicForce, displacement: Complex, speed: float) -> float:
    """Mean power [W] of a force at displacements (n,) of its frequency."""
    velocity = 1j * force.order * speed * displacement
    return float(0.5 * np.real(np.vdot(velocity, force.force)))


def bearing_forces(
    system: RotorSystem, matrices: GyroscopicSystem, frequencies: Array, motion: Complex
) -> list[Complex]:
    """Forces of every bearing on its shaft along x, y, z (f, 3) [N], one after another.

    frequencies : of the motions (f,) [rad/s]
    motion : amplitudes (f, n)
    """
    forces = []
    for number, rotor in enumerate(system.rotors):
        for index, bearing in enumerate(rotor.bearings):
            at, rows = bearing_motion(matrices, system, number, index)
            in_bearing = motion[:, at] @ rows.T
            rate = 1j * frequencies[:, None]
            of_springs = in_bearing @ bearing_stiffness(bearing).T
            of_dampers = rate * (in_bearing @ bearing_damping(bearing).T)
            forces.append(-(of_springs + of_dampers)[:, [X, Y, Z]])
    return forces


def housing_accelerations(
    system: RotorSystem, matrices: GyroscopicSystem, frequencies: Array, motion: Complex
) -> list[Complex]:
    """Accelerations of every node of the housing along x, y, z (f, 3) [m/s2].

    frequencies, motion : as in `bearing_forces`
    """
    nodes = () if system.housing is None else system.housing.nodes
    firsts = [matrices.shaft_size + HOUSING_NODE_SIZE * n for n in range(len(nodes))]
    square = -(frequencies[:, None] ** 2)
    return [square * motion[:, first : first + 3] for first in firsts]
