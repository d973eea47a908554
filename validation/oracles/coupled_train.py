"""The energy of a train whose contacts deflect each other, by SciPy's root finder.

Hubs are at z, contacts press with F(x) and yield with the bodies by C F, and bodies
accelerate with a = load - K z - R'F in mean coordinates q, one per mode:

    q = z - U'F - W a,    x = R z - gap - C F - U a.

That is what the coupled model eliminates; here all of it is solved for at once.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from scipy.interpolate import PPoly
from scipy.optimize import root

from lumped.common.array_types import Array
from lumped.common.checks import require_present

if TYPE_CHECKING:
    from lumped.train.system import LumpedSystem


@dataclass(frozen=True, kw_only=True, eq=False)
class Instant:
    """c contacts and n modal coordinates at a position of the meshes.

    knots : (c, j + 1) penetrations [m]; load_curve : (c, j, 4) cubics of the load
        beyond each, rising powers [N]
    gap : (c,) [m]; compliance : (c, c) C with hubs held [m/N]
    rows, inertia_rows : (c, n) R, U; work, stiffness : (n, n) W, K; load : (n,)
    """

    knots: Array
    load_curve: Array
    gap: Array
    compliance: Array
    rows: Array
    inertia_rows: Array
    work: Array
    stiffness: Array
    load: Array

    def loads(self, x: Array) -> Array:
        """Loads of the contacts at penetrations (c,) [N]."""
        closed = zip(self._cubics, np.maximum(x, 0.0), strict=True)
        return np.array([float(cubics(at)) for cubics, at in closed])

    @cached_property
    def _cubics(self) -> list[PPoly]:
        load_curves = zip(self.load_curve, self.knots, strict=True)
        return [PPoly(law[:, ::-1].T, knots) for law, knots in load_curves]

    def solve(self, q: Array) -> tuple[Array, Array, Array]:
        """Hubs z (n,), penetrations x (c,) and accelerations a (n,) at coordinates."""
        n, scale = q.size, float(self.knots.max())

        def parts(unknowns: Array) -> tuple[Array, Array, Array, Array]:
            z, x = unknowns[:n] * unit, unknowns[n:] * scale
            F = self.loads(x)
            return z, x, F, self.load - self.stiffness @ z - self.rows.T @ F

        def residual(unknowns: Array) -> Array:
            z, x, F, a = parts(unknowns)
            mean = z - self.inertia_rows.T @ F - self.work @ a - q
            closed = (
                self.rows @ z - self.gap - self.compliance @ F - self.inertia_rows @ a
            )
            return np.concatenate([mean / unit, (closed - x) / scale])

        unit = scale / np.abs(self.rows).max()
        start = np.concatenate([q / unit, (self.rows @ q - self.gap) / scale])
        solution = root(residual, start, tol=1e-13)
        if not np.abs(solution.fun).max() < 1e-9:
            raise ArithmeticError(f"not solved: {solution.message}")
        z, x, _, a = parts(solution.x)
        return z, x, a

    def potential(self, q: Array) -> float:
        """Energy of springs, contacts and bodies, less the loads' work [J]."""
        z, x, a = self.solve(q)
        F = self.loads(x)
        closed = zip(self._cubics, np.maximum(x, 0.0), strict=True)
        contacts = sum(float(cubics.integrate(0.0, at)) for cubics, at in closed)
        bodies = 0.5 * F @ self.compliance @ F + F @ self.inertia_rows @ a
        bodies += 0.5 * a @ self.work @ a
        return float(0.5 * z @ self.stiffness @ z - self.load @ z + contacts + bodies)


def instant_of(system: LumpedSystem, cycle: float) -> Instant:
    """The contacts of a train at a part of the mesh cycle, between its tables' rows."""
    contacts = require_present(system.contacts, "coupled model")
    space = system.modes.coordinates
    grid = contacts.rows.shape[1] - 1
    row, part = int(cycle * grid) % grid, cycle * grid - int(cycle * grid)

    def at(table: Array) -> Array:
        return (1.0 - part) * table[:, row] + part * table[:, row + 1]

    held = space.spring_rows @ system.modes.shapes[:, system.moving]
    return Instant(
        knots=contacts.contacts.knots[contacts.mesh_of],
        load_curve=at(contacts.contacts.load_curve)[:, 0],
        gap=at(contacts.contacts.gap),
        compliance=at(contacts.contacts.normal_compliance.swapaxes(0, 1)),
        rows=at(contacts.rows),
        inertia_rows=at(contacts.inertia_rows),
        work=contacts.work,
        stiffness=(held.T * space.spring_stiffness) @ held,
        load=system.arrays.load,
    )
