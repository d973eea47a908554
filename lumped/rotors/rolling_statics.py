"""Shafts at rest on rolling bearings, whose forces are not linear.

The energy of a shaft and its bearings is a convex function of the motions v of the
shaft in the bearings. A shaft under loads needs the forces S v + R in its bearings to
be there, and rings need g(v); equilibrium is g(v) + S v + R = 0. Newton steps with
springs to the last motion (Levenberg and Marquardt) reduce the energy until they find
it, also where clearance leaves parts without contact.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag

from lumped.bearings.mounted import MountedBearing, RingState
from lumped.common.array_types import Array
from lumped.rotors.description import Bearing, LinearisedSupport, Rotor, RotorError
from lumped.rotors.free_shafts import SIZE, TILT_X, Z, free_shaft, motion_at
from lumped.rotors.matrices import nodes_of
from lumped.rotors.statics import THRUST_RTOL, ShaftLoad, ShaftStatics, shaft_statics

MAX_STEPS = 300
FIRST_MOTION = 1e-4  # largest motion in the first step [m]
FACTOR = 10.0  # on the springs to the last motion, by success
MIN_SPRING = 1e-13  # over the stiffness of bearings and shaft
SEARCH_RTOL = 1e-7  # of the loads, from which on Newton steps converge
EQUILIBRIUM_RTOL = 1e-11  # of the loads
ROUND_OFF_RTOL = 1e-8  # likewise, where round-off beside clearance stops the steps
MAX_NEWTON_STEPS = 12
FREE_RTOL = 1e-12  # axial over radial stiffness, below which a shaft is free along z
WEAK = 1e-6  # over the radial stiffness, of springs that leave such a shaft in place
SEAT = 1e-9  # compliance of a bearing's seat over the largest of the shaft


@dataclass(frozen=True, kw_only=True)
class RollingSupport:
    """Rolling bearing of a shaft.

    position : of its middle, from the shaft's first end [m]
    mounted : the bearing
    """

    position: float
    mounted: MountedBearing


def rolling_shaft_statics(
    rotor: Rotor,
    supports: Sequence[RollingSupport],
    loads: Sequence[ShaftLoad],
    elements: int = 12,
) -> ShaftStatics:
    """A shaft on rolling bearings, linearised at its equilibrium under loads.

    It is solved by `ShaftStatics.solve` with the same loads, and with others nearby to
    first order.

    Parameters
    ----------
    rotor : Rotor
        The shaft without bearings.
    supports : sequence of RollingSupport
        Its bearings.
    loads : sequence of ShaftLoad
        Loads, at whose positions others may act.
    elements : int
        Least number of elements.

    Raises
    ------
    RotorError
        If bearings do not hold the shaft or take its thrust, or no equilibrium is
        found.
    """
    require_thrust_taken(rotor.name, supports, [load.force[2] for load in loads])
    problem = _RollingShaft.of(rotor, supports, loads, elements)
    motions = problem.search()
    for _ in range(MAX_NEWTON_STEPS):
        states = problem.states(motions)
        statics = shaft_statics(
            replace(rotor, bearings=_linearised(supports, motions, states)),
            [load.position for load in loads],
            elements,
        )
        solution = statics.solve(loads)
        motions = statics.motions_of_bearings(solution)
        forces = np.array([state.force for state in problem.states(motions)])
        largest = max(problem.size, problem.norm(forces))
        imbalance = problem.norm(solution.reactions + forces) / largest
        if imbalance <= EQUILIBRIUM_RTOL:
            return statics
    if imbalance <= ROUND_OFF_RTOL:
        return statics
    raise RotorError(_no_equilibrium(rotor))


def require_thrust_taken(
    name: str, supports: Sequence[RollingSupport], axial: Sequence[float]
) -> None:
    """Raise RotorError for axial forces on a shaft [N] that no bearing of it takes."""
    thrust = math.fsum(axial)
    if abs(thrust) <= THRUST_RTOL * math.fsum(map(abs, axial)):
        return
    senses = {sense for one in supports for sense in one.mounted.thrust_senses}
    if math.copysign(1.0, thrust) not in senses:
        end = "near" if thrust < 0.0 else "far"
        raise RotorError(
            f"rotor {name!r}: axial force = {thrust:g} N, toward the {end} end; must "
            "be 0 without a ball bearing that takes it"
        )


def states_at(
    supports: Sequence[RollingSupport], motions: Array
) -> tuple[RingState, ...]:
    """Contacts of bearings by the motions (b, 5) of the shaft in them."""
    pairs = zip(supports, motions, strict=True)
    return tuple(support.mounted.state(motion) for support, motion in pairs)


@dataclass(frozen=True, eq=False)
class _RollingShaft:
    """Energy of a shaft by its motions in b bearings.

    stiffness, force : S (5 b, 5 b) and R (5 b,) of the bent shaft
    scales : lengths (5,) by which tilts are comparable with displacements [1 and m]
    size : largest of the loads, as a force [N]
    free : which of the motions count; along z only where there is a thrust path
    """

    rotor: Rotor
    supports: Sequence[RollingSupport]
    stiffness: Array
    force: Array
    scales: Array
    size: float
    free: Array

    @classmethod
    def of(
        cls,
        rotor: Rotor,
        supports: Sequence[RollingSupport],
        loads: Sequence[ShaftLoad],
        elements: int,
    ) -> _RollingShaft:
        positions = [support.position for support in supports]
        if len(positions) == 0:
            raise RotorError(f"rotor {rotor.name!r}: no bearings; one or more needed")
        on_bearings = replace(rotor, bearings=tuple(map(_without_stiffness, positions)))
        places = [load.position for load in loads]
        nodes = nodes_of(on_bearings, places, elements)
        has_thrust_path = any(support.mounted.thrust_senses for support in supports)
        flexibility, rigid = free_shaft(on_bearings, nodes, has_thrust_path)
        at_bearings = motion_at(nodes, positions)
        applied = np.array([(*load.force, *load.moment[:2]) for load in loads])
        on_nodes = motion_at(nodes, places).T @ applied.reshape(-1)
        scales = np.ones(SIZE)
        scales[TILT_X:] = rotor.length
        free = np.ones((len(positions), SIZE), bool)
        free[:, Z] = has_thrust_path
        stiffness, force = _condensed(
            at_bearings @ flexibility @ at_bearings.T,
            at_bearings @ rigid,
            at_bearings @ (flexibility @ on_nodes),
            rigid.T @ on_nodes,
            np.tile(scales, len(positions)),
        )
        return cls(
            rotor=rotor,
            supports=supports,
            stiffness=stiffness,
            force=force,
            scales=scales,
            size=float(np.abs(applied / scales).max(initial=0.0)),
            free=free.ravel(),
        )

    def states(self, motions: Array) -> tuple[RingState, ...]:
        return states_at(self.supports, motions)

    def norm(self, forces: Array) -> float:
        """Largest of forces and moments (b, 5), as a force [N]."""
        return float(np.abs(forces / self.scales).max())

    def search(self) -> Array:
        """Motions (b, 5) near equilibrium; RotorError where none is found."""
        v = np.zeros(self.force.size)
        at_v = self._balance(v)
        spring = at_v.norm / FIRST_MOTION
        weights = np.tile(self.scales, len(self.supports)) ** 2
        for _ in range(MAX_STEPS):
            if at_v.norm <= SEARCH_RTOL * at_v.largest:
                return v.reshape(-1, SIZE)
            if not math.isfinite(at_v.norm):
                break
            level = float((np.diag(at_v.tangent) / weights).max())
            spring = max(spring, MIN_SPRING * level)
            matrix = at_v.tangent + np.diag(spring * weights)
            step = np.zeros_like(v)
            step[self.free] = np.linalg.solve(
                matrix[np.ix_(self.free, self.free)], -at_v.residual[self.free]
            )
            ahead = self._balance(v + step)
            # close to equilibrium the change of the energy is round-off
            shrinks = ahead.norm <= 0.5 * at_v.norm
            if shrinks or ahead.energy <= at_v.energy + 1e-4 * (at_v.residual @ step):
                v, at_v = v + step, ahead
                spring /= FACTOR
            else:
                spring *= FACTOR
        raise RotorError(_no_equilibrium(self.rotor))

    def _balance(self, v: Array) -> _Balance:
        """Energy and forces at motions (5 b,)."""
        states, bent = self.states(v.reshape(-1, SIZE)), self.stiffness @ v
        forces = np.array([state.force for state in states])
        residual = forces.ravel() + bent + self.force
        residual = np.where(self.free, residual, 0.0)
        energies = sum(state.energy for state in states)
        return _Balance(
            energy=float(energies + (0.5 * bent + self.force) @ v),
            residual=residual,
            tangent=block_diag(*(state.stiffness for state in states)) + self.stiffness,
            norm=self.norm(residual.reshape(-1, SIZE)),
            largest=max(self.size, self.norm(forces)),
        )


class _Balance(NamedTuple):
    """Forces in the bearings of a shaft at motions there.

    energy : of shaft, bearings and loads [J]
    residual : its gradient (5 b,), forces that are out of balance
    tangent : its second derivative (5 b, 5 b)
    norm, largest : of the residual; of loads and bearings, both as a force [N]
    """

    energy: float
    residual: Array
    tangent: Array
    norm: float
    largest: float


def _condensed(
    flexibility: Array, rigid: Array, bent: Array, total: Array, scales: Array
) -> tuple[Array, Array]:
    """Stiffness S (5 b, 5 b) and force R (5 b,) of a shaft by motions v in b bearings.

    Forces r of bearings, loads f and the rigid motion q move the shaft there by
    v = F r + bent + A q, with A^T r + total = 0; then r = S v + R.

    flexibility, rigid : F (5 b, 5 b) and A (5 b, m)
    bent, total : motion (5 b,) by loads, and their sum (m,)
    scales : lengths (5 b,) by which tilts are comparable with displacements
    """
    weighted = scales[:, None] * flexibility * scales
    # seats that yield a little, where two bearings are on one node
    seats = SEAT * np.diag(weighted).max() * np.eye(len(scales))
    arms, count = scales[:, None] * rigid, len(scales)
    unit = np.abs(weighted).max() or 1.0
    matrix = np.block(
        [
            [(weighted + seats) / unit, arms],
            [arms.T, np.zeros((arms.shape[1], arms.shape[1]))],
        ]
    )
    right = np.zeros((len(matrix), count + 1))
    right[:count, :count] = np.diag(scales) / unit
    right[:count, -1] = -scales * bent / unit
    right[count:, -1] = -total
    forces = scales[:, None] * np.linalg.solve(matrix, right)[:count]
    stiffness = forces[:, :count]
    return 0.5 * (stiffness + stiffness.T), forces[:, -1]


def _without_stiffness(position: float) -> Bearing:
    return Bearing(position=position, stiffness=(0.0, 0.0, 0.0, 0.0))


def _linearised(
    supports: Sequence[RollingSupport], motions: Array, states: Sequence[RingState]
) -> tuple[Bearing, ...]:
    """Bearings with their tangents at motions (b, 5).

    Where axial clearance leaves a shaft free, weak springs hold it at its place.
    """
    stiffnesses = np.array([state.stiffness for state in states])
    # second derivatives of an energy, but for round-off
    stiffnesses = 0.5 * (stiffnesses + stiffnesses.transpose(0, 2, 1))
    radial = float(stiffnesses[:, :Z, :Z].max())
    if stiffnesses[:, Z, Z].sum() <= FREE_RTOL * radial:
        for stiffness, support in zip(stiffnesses, supports, strict=True):
            stiffness[Z, Z] += WEAK * radial * bool(support.mounted.thrust_senses)
    return tuple(
        replace(
            _without_stiffness(support.position),
            linearised=LinearisedSupport(
                stiffness=stiffness, force=stiffness @ motion - state.force
            ),
        )
        for support, motion, state, stiffness in zip(
            supports, motions, states, stiffnesses, strict=True
        )
    )


def _no_equilibrium(rotor: Rotor) -> str:
    return (
        f"rotor {rotor.name!r}: no equilibrium on its rolling bearings was found; they "
        "must hold it in two places"
    )
