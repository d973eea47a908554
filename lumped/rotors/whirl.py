"""Whirling modes of a gyroscopic system at one speed.

Undamped systems lead to a Hermitian eigenvalue problem, so that their frequencies are
real to the last bit; others to one of a real matrix. Both are in modes of the system
at rest, all of them, which scales coordinates alike.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eig, eigh

from lumped.common.array_types import Array, Complex
from lumped.rotors.gyroscopic import GyroscopicSystem
from lumped.rotors.rest import modes_at_rest

Instability = Literal["flutter", "divergence"]
ModeKind = Literal["forward", "backward", "planar", "torsion", "axial", "housing"]
MIN_WHIRL = 0.1  # of a motion that is not planar
GROWTH_RTOL = 1e-14  # rate of growth over the highest frequency that is round-off
MAX_IDLE_ENERGY = 1e-9  # part of the kinetic energy of a rotation that is sideways
EQUAL_RTOL = 1e-8  # between frequencies of one group, whose shapes are a plane's


@dataclass(frozen=True, eq=False)
class WhirlModes:
    """Modes that oscillate at one speed, by rising frequency; k of them.

    speed : of the system [rad/s]
    eigenvalues : growth rate + i frequency (k,) [rad/s]
    states : (s, k) positions and velocities, of unit length, to compare modes by
    shapes : (n, k) displacements with a kinetic energy of unit amplitude
    whirl : (k,) of the rotor that moves most sideways, from 1 for forward circles, in
        its own sense of rotation, to -1 for backward ones; 0 where it is planar
    rotors : (k,) that rotor
    torsion : (k,) part of the kinetic energy in rotations about the axes
    axial : (k,) part of the kinetic energy in motion along the axes
    housing : (k,) part of the kinetic energy in the housing
    mesh_energy : (meshes, k) part of the strain energy in each mesh
    growing : eigenvalues with a growth rate above round-off, also those that do not
        oscillate
    """

    speed: float
    eigenvalues: Complex
    states: Complex
    shapes: Complex
    whirl: Array
    rotors: NDArray[np.intp]
    torsion: Array
    axial: Array
    housing: Array
    mesh_energy: Array
    growing: Complex

    @property
    def frequency(self) -> Array:
        """Damped frequencies (k,) [rad/s]."""
        return self.eigenvalues.imag

    @property
    def instability(self) -> Instability | None:
        """Flutter where a growing motion oscillates, else divergence, or None."""
        if not self.growing.size:
            return None
        fastest = self.growing[self.growing.real.argmax()]
        return "flutter" if abs(fastest.imag) > fastest.real * 1e-6 else "divergence"

    def take(self, places: NDArray[np.intp]) -> WhirlModes:
        """Some of the modes, in another order."""
        return WhirlModes(
            self.speed,
            self.eigenvalues[places],
            self.states[:, places],
            self.shapes[:, places],
            self.whirl[places],
            self.rotors[places],
            self.torsion[places],
            self.axial[places],
            self.housing[places],
            self.mesh_energy[:, places],
            self.growing,
        )


def mode_kind(
    whirl: float, torsion: float, axial: float = 0.0, housing: float = 0.0
) -> ModeKind:
    """What has the largest part of a mode's kinetic energy.

    Torsion, motion along the axes, the housing, or whirl of the rotor that moves most
    sideways.
    """
    sideways = 1.0 - torsion - axial - housing
    if housing > max(torsion, axial, sideways):
        return "housing"
    if torsion > max(axial, sideways):
        return "torsion"
    if axial > sideways:
        return "axial"
    if abs(whirl) < MIN_WHIRL:
        return "planar"
    return "forward" if whirl > 0.0 else "backward"


class WhirlProblem:
    """A gyroscopic system in its modes at rest, ready to be solved at any speed."""

    def __init__(self, system: GyroscopicSystem) -> None:
        self.system = system
        squares, basis = modes_at_rest(system)
        moving = np.logical_not(self._is_idle(system, squares, basis))
        self.squares, self.basis = squares[moving], basis[:, moving]
        self.rigid_motions = int(squares.size - moving.sum())

    @staticmethod
    def _is_idle(system: GyroscopicSystem, squares: Array, basis: Array) -> Array:
        """Rigid rotations about the axes and motions along them.

        Nothing but inertia acts on them, whatever the speed.
        """
        moves_others = ~(system.is_rotation | system.is_axial)
        lateral = basis * moves_others[:, None]
        energy = np.einsum("ni,nm,mi->i", lateral, system.mass, lateral)
        return np.asarray((squares == 0.0) & (energy < MAX_IDLE_ENERGY))

    def modal(self, matrix: Array) -> Array:
        """A matrix (n, n) in modes at rest."""
        return np.asarray(self.basis.T @ matrix @ self.basis)

    @cached_property
    def gyroscopic(self) -> Array:
        """Modal G, skew-symmetric to the last bit."""
        matrix = self.modal(self.system.gyroscopic)
        return 0.5 * (matrix - matrix.T)

    @cached_property
    def damping(self) -> Array:
        """Modal C."""
        return self.modal(self.system.damping)

    @cached_property
    def is_hermitian(self) -> bool:
        """Whether all eigenvalues are imaginary at every speed."""
        return self.system.is_conservative and bool((self.squares >= 0.0).all())

    @cached_property
    def _added_stiffness(self) -> tuple[Array, Array, Array]:
        """Modal skew part of K, then H and N."""
        stiffness = self.system.stiffness
        skew = 0.5 * (stiffness - stiffness.T)
        parts = skew, self.system.circulatory, self.system.centripetal
        skew_part, circulatory, centripetal = map(self.modal, parts)
        return skew_part, circulatory, centripetal

    @cached_property
    def _sideways(self) -> list[tuple[Array, Array]]:
        """Modal mass of each rotor's bending, and its turning by a quarter over i."""
        system, pairs = self.system, []
        for rotor, ratio in enumerate(system.speed_ratios):
            bends = (system.rotor_of == rotor) & system.is_sideways
            mass = system.mass * np.outer(bends, bends)
            turned = np.sign(ratio) * mass @ system.quarter_turn
            pairs.append((self.modal(mass), self.modal(turned)))
        return pairs

    @cached_property
    def _along(self) -> Array:
        """Modal mass of motion along the axes."""
        return self._modal_mass_of(self.system.is_axial)

    @cached_property
    def _of_housing(self) -> Array:
        """Modal mass of the housing."""
        return self._modal_mass_of(self.system.is_housing)

    def _modal_mass_of(self, part: NDArray[np.bool_]) -> Array:
        return self.modal(self.system.mass * np.outer(part, part))

    def solve(self, speed: float, count: int | None = None) -> WhirlModes:
        """Lowest modes that oscillate at a speed [rad/s]; all where count is None."""
        if self.is_hermitian:
            values, states, rates = self._solve_hermitian(speed, count)
            growing = np.zeros(0, np.complex128)
        else:
            values, states, rates, growing = self._solve_general(speed, count)
        return self._described(speed, values, states, rates, growing)

    def at_speed(self, speed: float, damping_ratio: float = 0.0) -> tuple[Array, Array]:
        """Modal stiffness and damping (k, k) at a speed [rad/s], gyroscopic forces
        among the latter.

        damping_ratio : of every mode at rest, besides the damping of the system
        """
        skew, circulatory, centripetal = self._added_stiffness
        stiffness = np.diag(self.squares) + skew + speed * circulatory
        stiffness -= speed**2 * centripetal
        of_modes = 2.0 * damping_ratio * np.sqrt(np.maximum(self.squares, 0.0))
        return stiffness, self.damping + speed * self.gyroscopic + np.diag(of_modes)

    @cached_property
    def is_dissipative(self) -> bool:
        """Whether no force feeds energy into vibration, at any speed."""
        rates = np.linalg.eigvalsh(self.damping + self.damping.T)
        round_off = GROWTH_RTOL * np.abs(rates).max(initial=0.0)
        feeds = any(part.any() for part in self._added_stiffness)
        at_rest = bool((self.squares >= 0.0).all())
        return at_rest and not feeds and bool((rates >= -round_off).all())

    def grows(self, speed: float, damping_ratio: float = 0.0) -> bool:
        """Whether free vibration grows at a speed [rad/s]; see `at_speed`."""
        if self.is_dissipative:
            return False
        values = np.linalg.eigvals(
            self._state_matrix(*self.at_speed(speed, damping_ratio))
        )
        return bool((values.real > GROWTH_RTOL * np.abs(values).max()).any())

    def _state_matrix(self, stiffness: Array, damping: Array) -> Array:
        """Matrix of y' = A y, y of scaled modal displacements and velocities."""
        number = self.squares.size
        positive = np.abs(self.squares[self.squares != 0.0])
        scale = np.sqrt(np.maximum(np.abs(self.squares), positive.min(initial=1.0)))
        return np.block(
            [
                [np.zeros((number, number)), np.diag(scale)],
                [-stiffness / scale, -damping],
            ]
        )

    def _solve_hermitian(
        self, speed: float, count: int | None
    ) -> tuple[Complex, Complex, Complex]:
        """Solve y' = A y of y = (W q, q'), with a skew-symmetric A."""
        strained = self.squares > 0.0
        frequencies = np.sqrt(self.squares[strained])
        number, total = frequencies.size, frequencies.size + self.squares.size
        matrix = np.zeros((total, total))
        rows = np.flatnonzero(strained) + number
        matrix[np.arange(number), rows] = frequencies
        matrix[rows, np.arange(number)] = -frequencies
        matrix[number:, number:] = -speed * self.gyroscopic
        # i A y = -omega y with the eigenvalue i omega of A; half of the spectrum
        lowest = 0 if count is None else max(0, number - count)
        values, states = eigh(1j * matrix, subset_by_index=(lowest, number - 1))
        order = np.argsort(-values, kind="stable")
        states = np.asarray(states[:, order], dtype=np.complex128)
        return np.asarray(-1j * values[order]), states, states[number:]

    def _solve_general(
        self, speed: float, count: int | None
    ) -> tuple[Complex, Complex, Complex, Complex]:
        number = self.squares.size
        values, states = eig(self._state_matrix(*self.at_speed(speed)))
        round_off = GROWTH_RTOL * abs(values).max()
        growing = values[values.real > round_off]
        oscillating = np.flatnonzero(values.imag > round_off)
        order = oscillating[np.argsort(values[oscillating].imag, kind="stable")][:count]
        states = states[:, order]
        return values[order], states, states[number:], growing

    def _described(
        self,
        speed: float,
        values: Complex,
        states: Complex,
        rates: Complex,
        growing: Complex,
    ) -> WhirlModes:
        states, rates = self._circular(values, states, rates)
        energies, turns = (
            np.array([_products(rates, pair[k], rates) for pair in self._sideways])
            for k in (0, 1)
        )
        rotors = energies.real.argmax(axis=0)
        along = np.arange(values.size)
        sideways = energies.real[rotors, along]
        total = (np.abs(rates) ** 2).sum(axis=0)
        moves = sideways > 1e-12 * total
        turning = (-1j * turns[rotors, along]).real
        whirl = np.divide(turning, sideways, out=np.zeros(values.size), where=moves)
        shapes = self.basis @ (rates / np.sqrt(total))
        strain = _products(shapes, self.system.stiffness, shapes).real
        meshes = [_products(shapes, k, shapes).real for k in self.system.mesh_stiffness]
        share = np.array(meshes).reshape(-1, values.size) / strain
        axial, housing = np.zeros((2, values.size))
        if self.system.has_axial_motion:
            axial = _products(rates, self._along, rates).real / total
        if self.system.is_housing.any():
            housing = _products(rates, self._of_housing, rates).real / total
        torsion = 1.0 - energies.real.sum(axis=0) / total - axial - housing
        torsion, axial, housing = np.clip([torsion, axial, housing], 0.0, 1.0)
        parts = whirl, rotors, torsion, axial, housing, share
        return WhirlModes(speed, values, states, shapes, *parts, growing)

    def _circular(
        self, values: Complex, states: Complex, rates: Complex
    ) -> tuple[Complex, Complex]:
        """Modes of equal frequency made those that turn forward or backward.

        At rest the shapes of an isotropic rotor are any of a plane; these are the ones
        that the least speed leads to.
        """
        states, rates = states.copy(), rates.copy()
        turning = sum(pair[1] for pair in self._sideways)
        for group in groups_of_equal(values):
            if len(group) > 1:
                part = rates[:, group]
                _, turned = eigh(-1j * part.conj().T @ turning @ part)
                states[:, group] = states[:, group] @ turned
                rates[:, group] = part @ turned
        return states, rates


def groups_of_equal(values: Complex) -> list[list[int]]:
    """Indices of eigenvalues that are equal, in groups; in order of frequency."""
    groups: list[list[int]] = []
    for index, value in enumerate(values):
        if groups and abs(value - values[groups[-1][-1]]) <= EQUAL_RTOL * abs(value):
            groups[-1].append(index)
        else:
            groups.append([index])
    return groups


def _products(left: Complex, matrix: Array, right: Complex) -> Complex:
    """v^H A v of columns (k,)."""
    return np.asarray((left.conj() * (matrix @ right)).sum(axis=0))
