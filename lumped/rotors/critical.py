"""Critical speeds: where an order of the speed is a natural frequency.

With a frequency of `order` times the speed, M x'' + Omega G x' + K x = 0 is a linear
eigenvalue problem again, K x = omega^2 (M - i G / order) x, whose matrices are
Hermitian. Its solutions are all critical speeds of undamped motion, exactly; backward
whirl is among them where the rotor and its bearings permit it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh

from lumped.rotors.campbell import Campbell, crossings
from lumped.rotors.description import RotorError
from lumped.rotors.whirl import WhirlModes, WhirlProblem


@dataclass(frozen=True)
class CriticalSpeed:
    """Speed at which an order of it is a natural frequency.

    speed : of the system [rad/s]
    frequency : natural frequency there [rad/s]
    damping_ratio : of that mode
    whirl, torsion, axial, housing, rotor : as in `WhirlModes`
    mesh_energy : part of the strain energy in all meshes
    """

    speed: float
    frequency: float
    damping_ratio: float
    whirl: float
    torsion: float
    axial: float
    housing: float
    rotor: int
    mesh_energy: float


def critical_speeds(
    problem: WhirlProblem, diagram: Campbell, order: float
) -> list[CriticalSpeed]:
    """Critical speeds of an order up to the last speed of a diagram.

    They are eigenvalues where motion is undamped, and roots of the curves of the
    diagram otherwise.
    """
    if not problem.is_hermitian:
        return [_critical(mode, 0) for mode in crossings(problem, diagram, order)]
    low, high = diagram.speeds[0], diagram.speeds[-1]
    speeds = synchronous_speeds(problem, order)
    return [
        _critical_at(problem, speed, order) for speed in speeds if low <= speed <= high
    ]


def synchronous_speeds(problem: WhirlProblem, order: float) -> list[float]:
    """All critical speeds of an order without damping [rad/s], rising.

    Raises RotorError where something else than inertia and springs acts, or where a
    rotor is free to move sideways.
    """
    if not problem.is_hermitian:
        raise RotorError("damped rotors have no critical speeds as eigenvalues")
    if (problem.squares == 0.0).any():
        raise RotorError("a rotor is free to move sideways; it needs bearings")
    if not order > 0.0:
        raise RotorError(f"order = {order:g}; must be above 0")
    scale = 1.0 / np.sqrt(problem.squares)
    inertia = np.eye(scale.size) - 1j * problem.gyroscopic / order
    inverse_squares = eigh(scale[:, None] * inertia * scale, eigvals_only=True)
    positive = inverse_squares[inverse_squares > 0.0]
    return [float(1.0 / (order * np.sqrt(value))) for value in positive[::-1]]


def _critical_at(problem: WhirlProblem, speed: float, order: float) -> CriticalSpeed:
    modes = problem.solve(speed)
    return _critical(modes, int(np.abs(modes.frequency - order * speed).argmin()))


def _critical(modes: WhirlModes, mode: int) -> CriticalSpeed:
    value = modes.eigenvalues[mode]
    return CriticalSpeed(
        speed=float(modes.speed),
        frequency=float(value.imag),
        damping_ratio=float(-value.real / abs(value)),
        whirl=float(modes.whirl[mode]),
        torsion=float(modes.torsion[mode]),
        axial=float(modes.axial[mode]),
        housing=float(modes.housing[mode]),
        rotor=int(modes.rotors[mode]),
        mesh_energy=float(modes.mesh_energy[:, mode].sum()),
    )
