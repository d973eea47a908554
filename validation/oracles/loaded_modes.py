"""Natural frequencies of finite-element gears about their loaded state.

The equations of `fegear.dynamics.model` at rest, with the hubs z, the elastic modes e
of the gears with their hubs held, and the contacts' penetrations x and loads F(x):

    K z + R'F = load,   w^2 e + E'F = 0,   x + Q F(x) = R z + E e - gap.

About that state, D the slopes of F, vibration at an angular frequency s has

    (K - s^2) z - s^2 G'e + R'F = 0,   (w^2 - s^2) e - s^2 G z + E'F = 0,
    F = (1 + D Q)^-1 D (R z + E e),

with the inertia G that couples hubs and modes. Meshes change as gears turn: some of the
modes are averaged over a mesh cycle like the hubs, in a frame that does not turn with
the gear, where contacts stay where they are; the others follow at every position, so
that with L = 1 / (w^2 - s^2) they are gone from

    (K - s^2 - s^4 G'L G) z + (R + s^2 E L G)'F = 0,
    F = (1 + D (Q + E L E'))^-1 D (R + s^2 E L G) z.

Nothing is shared with `lumped.train.coupled`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import eigh, eigvalsh

from lumped.common.array_types import Array, Mask

if TYPE_CHECKING:
    from fegear.dynamics.model import DynamicModel

MAX_ITERATIONS, MIN_NEWTON_STEP = 200, 1e-6  # of Newton's method, and of its steps
EQUILIBRIUM_RTOL = 1e-11  # of the reach of the laws
REFINED, PART = 1e-7, 1e-3  # of a squared frequency; the part of it for derivatives


@dataclass(frozen=True, eq=False)
class LoadedModes:
    """Natural frequencies (n,) [Hz], rising, and the part (n,) of each mode's strain
    energy that is in the meshes and in what follows at every position."""

    frequency_Hz: Array
    mesh_energy: Array


def loaded_modes(model: DynamicModel, averaged: Mask, highest_Hz: float) -> LoadedModes:
    """About the mean tangent over a mesh cycle; every gear at the same place of its.

    averaged : (e,) elastic modes that are, as the hubs, none with half as many nodal
        diameters as teeth; the others must be above highest_Hz
    Raises ArithmeticError where no static equilibrium is found, or no frequency.
    """
    train = Linearised(model, averaged)
    highest = (2.0 * np.pi * highest_Hz) ** 2
    rough = train.near(0.0)[0][: train.count_below(highest)]
    modes = [
        train.refined(k, min(square, highest))
        for k, square in enumerate(rough)
        if square > 0.0
    ]
    return LoadedModes(*np.array(modes).reshape(-1, 2).T)


@dataclass(frozen=True, eq=False)
class Linearised:
    """A model about its loaded state, with a mask (e,) of its averaged modes."""

    model: DynamicModel
    averaged: Mask

    @cached_property
    def parts(self) -> tuple[Mask, Mask]:
        """Coordinates (n,) that are averaged, and those that follow."""
        hubs = np.ones(self.model.modal.damping.size, bool)
        averaged = np.concatenate([hubs, self.averaged])
        return averaged, ~averaged

    @cached_property
    def matrices(self) -> tuple[Array, Array]:
        return mass_and_stiffness(self.model)

    @cached_property
    def tangents(self) -> list[tuple[Array, Array, Array, Array]]:
        """At every position the rows of averaged coordinates and of others, Q and D."""
        averaged, others = self.parts
        rows, slopes = dense_rows(self.model), static_slopes(self.model)
        Q = self.model.contacts.normal_compliance
        return [
            (
                (rows[:, p] @ to_fixed_frame(self.model, p / len(slopes)).T)[
                    :, averaged
                ],
                rows[:, p][:, others],
                Q[p],
                slope,
            )
            for p, slope in enumerate(slopes)
        ]

    def dynamic_stiffness(self, square: float) -> tuple[Array, Array]:
        """(n, n) of averaged coordinates at a squared angular frequency.

        Without the meshes, and of the meshes on the mean.
        """
        averaged, others = self.parts
        mass, stiffness = self.matrices
        L = 1.0 / (stiffness[others, others] - square)
        G = mass[np.ix_(others, averaged)]
        bare = (stiffness - square * mass)[np.ix_(averaged, averaged)]
        bare -= square**2 * (G.T * L) @ G
        meshes = np.zeros_like(bare)
        for rows, E, Q, D in self.tangents:
            R = rows + square * (E * L) @ G
            compliance = Q + (E * L) @ E.T
            F = np.linalg.solve(
                np.eye(D.size) + D[:, None] * compliance, D[:, None] * R
            )
            meshes += R.T @ F / len(self.tangents)
        return bare, 0.5 * (meshes + meshes.T)

    def near(self, square: float) -> tuple[Array, Array]:
        """Squared angular frequencies, right near one, and the modes' mesh energies."""
        step = PART * max(square, self.matrices[1].diagonal().max() * PART**2)
        bare, meshes = self.dynamic_stiffness(square)
        above, below = (sum(self.dynamic_stiffness(square + d)) for d in (step, -step))
        mass = (below - above) / (2.0 * step)
        squares, shapes = eigh(bare + meshes + square * mass, mass)
        strain = np.einsum("in,ij,jn->n", shapes, meshes, shapes)
        return squares, strain / np.where(squares > 0.0, squares, np.inf)

    def count_below(self, square: float) -> int:
        """Modes below a squared angular frequency, which all that follow are above.

        So many eigenvalues of the dynamic stiffness are negative there: each falls as
        the frequency rises, and passes zero at a mode.
        """
        bare, meshes = self.dynamic_stiffness(square)
        return int(np.count_nonzero(eigvalsh(bare + meshes) < 0.0))

    def refined(self, k: int, square: float) -> tuple[float, float]:
        """The frequency [Hz] of mode k, and its mesh energy, from a square nearby."""
        for _ in range(MAX_ITERATIONS):
            squares, energies = self.near(square)
            before, square = square, float(squares[k])
            if abs(square - before) < REFINED * square:
                return np.sqrt(square) / (2.0 * np.pi), float(energies[k])
        raise ArithmeticError(f"no natural frequency near {np.sqrt(square):g} rad/s")


def mass_and_stiffness(model: DynamicModel) -> tuple[Array, Array]:
    """(n, n) each, without the meshes; hubs first."""
    modal = model.modal
    h, n = modal.damping.size, model.size
    mass, stiffness = np.eye(n), np.zeros((n, n))
    mass[h:, :h] = modal.coupling[:, None] * modal.rotation[modal.gear_of_mode]
    mass[:h, h:] = mass[h:, :h].T
    stiffness[:h, :h] = modal.stiffness
    stiffness[h:, h:] = np.diag(modal.rigidity)
    return mass, stiffness


def dense_rows(model: DynamicModel) -> Array:
    """Penetration (c, p + 1, n) of the contacts per coordinate."""
    packed = model.jacobian
    rows = np.zeros((*packed.normal.shape[:2], model.size))
    for contact, mesh in enumerate(packed.mesh_of):
        width = packed.widths[mesh]
        columns = packed.columns[mesh, :width]
        rows[contact][:, columns] = packed.normal[contact, :, :width]
    return rows


def to_fixed_frame(model: DynamicModel, part: float) -> Array:
    """(n, n) from coordinates that turn with the gears to those that do not.

    part : of a mesh cycle that has passed
    """
    modal, h = model.modal, model.modal.damping.size
    rotation, index = np.eye(model.size), np.arange(modal.rigidity.size)
    angle = part * np.arctan2(modal.sine, modal.cosine)
    pairs = modal.partner != index
    first, other = h + index[pairs], h + modal.partner[pairs]
    rotation[first, first] = np.cos(angle[pairs])
    rotation[first, other] = np.sin(angle[pairs])
    return rotation


def static_slopes(model: DynamicModel) -> Array:
    """Slopes (p, c) of the contacts' loads at rest, over a mesh cycle [N/m]."""
    rows, h = dense_rows(model), model.modal.damping.size
    contacts, modes = model.contacts, model.reference.modes
    free = modes.frequency_Hz == 0.0
    hubs = model.modal.stiffness + np.diag(free.astype(float))  # nothing loads these
    z = model.modal.load / np.where(free, 1.0, modes.angular**2)
    slopes: list[Array] = []
    x = np.full(len(rows), np.nan)
    for position in range(contacts.gap.shape[1] - 1):
        R, E = rows[:, position, :h], rows[:, position, h:]
        C = contacts.normal_compliance[position] + (E / model.modal.rigidity) @ E.T
        rest = Rest(model, position, R, C, hubs)
        if not slopes:
            x = R @ z - contacts.gap[:, position]
        x, z = rest.solve(x, z)
        slopes.append(rest.loads(x)[1])
    return np.array(slopes)


@dataclass(frozen=True, eq=False)
class Rest:
    """Equilibrium at a position: rows (c, h), compliance (c, c) with the hubs held and
    stiffness (h, h) of the hubs."""

    model: DynamicModel
    position: int
    rows: Array
    compliance: Array
    hubs: Array

    def loads(self, x: Array) -> tuple[Array, Array]:
        """Loads (c,) [N] and slopes [N/m] at penetrations (c,)."""
        contacts, mesh_of = self.model.contacts, self.model.jacobian.mesh_of
        load_and_slope = np.zeros((2, x.size))
        for c in np.flatnonzero(x > 0.0):
            knots = contacts.knots[mesh_of[c]]
            law = contacts.load_curve[c, self.position, 0]
            inside = min(x[c], knots[-1])
            cell = min(int(np.searchsorted(knots, inside, "right")) - 1, len(law) - 1)
            cubic = np.polynomial.Polynomial(law[cell])
            t = inside - knots[cell]
            slope = cubic.deriv()(t)
            load_and_slope[:, c] = cubic(t) + slope * (x[c] - inside), slope
        return load_and_slope[0], load_and_slope[1]

    def solve(self, x: Array, z: Array) -> tuple[Array, Array]:
        """Penetrations (c,) and hubs (h,) from such nearby, by damped Newton steps."""
        scale, count = self.model.contacts.knots.max(), x.size
        miss = self.miss(x, z)
        for _ in range(MAX_ITERATIONS):
            step = np.linalg.solve(self.matrix(x), miss)
            if np.abs(step[:count]).max() < EQUILIBRIUM_RTOL * scale:
                return x, z
            size, part = self.size(miss), 1.0
            while part > MIN_NEWTON_STEP:
                new = x - part * step[:count], z - part * step[count:]
                miss = self.miss(*new)
                if self.size(miss) < size:
                    break
                part *= 0.5
            x, z = new
        raise ArithmeticError(f"no static equilibrium at position {self.position}")

    def miss(self, x: Array, z: Array) -> Array:
        """Residual of both equations (c + h,), [m] and [N/sqrt(kg)]."""
        F, _ = self.loads(x)
        gap = self.model.contacts.gap[:, self.position]
        closed = x + self.compliance @ F - self.rows @ z + gap
        forces = self.hubs @ z + self.rows.T @ F - self.model.modal.load
        return np.concatenate([closed, forces])

    def size(self, miss: Array) -> float:
        """Norm of the residual: the largest in parts of the laws' reach and the
        loads.
        """
        count, load = len(self.rows), np.abs(self.model.modal.load).max()
        reach = self.model.contacts.knots.max()
        return float(np.abs(np.append(miss[:count] / reach, miss[count:] / load)).max())

    def matrix(self, x: Array) -> Array:
        """Derivative (c + h, c + h) of what is missed."""
        _, slope = self.loads(x)
        by_contacts = np.vstack(
            [np.eye(x.size) + self.compliance * slope, self.rows.T * slope]
        )
        return np.hstack([by_contacts, np.vstack([-self.rows, self.hubs])])
