"""Solve the static contact of a gear pair at torques, on drive or back flanks."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from fegear.contact.pairs import back_side_position, with_back_flanks
from fegear.contact.plane.contact import PlaneContact
from fegear.contact.problem import ContactProblem, MeshPositions
from fegear.contact.result import ContactCycle
from fegear.contact.width.contact import WidthContact
from fegear.contact.width.double import both_halves
from lumped.common.array_types import Array, Indices


def solve_cycle(
    problem: ContactProblem,
    torques: ArrayLike,
    positions: ArrayLike,
    pitches: ArrayLike = 0,
    with_slopes: bool = False,
) -> ContactCycle:
    """Solve the contact at every torque [N m] on the driver and every position.

    pitches : whole base pitches (n,) that come to the positions; pairs count anew in
        each
    with_slopes : whether the slopes by changes of the flanks are asked for

    A negative torque turns the driver back through the backlash and loads the other
    flanks. Raises ContactFailure where no solution was found and ValueError
    for torques that are zero or not finite.
    """
    torque = np.atleast_1d(np.asarray(torques, float))
    position = np.atleast_1d(np.asarray(positions, float))
    pitch = np.broadcast_to(np.asarray(pitches, np.int64), position.shape)
    if not (np.isfinite(torque).all() and (torque != 0.0).all()):
        raise ValueError(f"torques = {torque.tolist()}; must be finite and not zero")
    if not np.isfinite(position).all():
        raise ValueError(f"positions = {position.tolist()}; must be finite")
    if (torque > 0.0).all():
        places = MeshPositions(position, pitch)
        return _solve_flanks(problem, torque, places, with_slopes)
    if (torque < 0.0).all():
        places = MeshPositions(
            back_side_position(problem.pair, position), -pitch, back=True
        )
        of_back = with_back_flanks(problem)
        mirrored = _solve_flanks(of_back, -torque, places, with_slopes)
        backlash = problem.pair.backlash
        return mirrored.of_back_flanks(torque, position + pitch, backlash)
    raise ValueError(f"torques = {torque.tolist()}; must have one sign")


def _solve_flanks(
    problem: ContactProblem, torque: Array, places: MeshPositions, with_slopes: bool
) -> ContactCycle:
    """Solve at positive torques (t,), across the flanks or along the width."""
    from fegear.contact.plane.solve import solve_in_plane
    from fegear.contact.width.solve import solve_over_width

    match problem.solver:
        case PlaneContact():
            return solve_in_plane(problem, torque, places, with_slopes)
        case WidthContact(far=None) as width:
            return solve_over_width(problem, width, torque, places, with_slopes)
        case WidthContact() as width:
            near, far = (
                solve_over_width(problem, half, 0.5 * torque, places, with_slopes)
                for half in width.halves
            )
            return both_halves(near, far, width.groove)


def coupling_of_pairs(
    problem: ContactProblem, cycle: ContactCycle, pairs: Indices
) -> Array:
    """Deflection (t, n, k, k) of some pairs (k,) per load on each other one [m/N].

    Per force in the section, and along the line of action; zero on the diagonal. Loads
    that vary over the width bring it with them, others have it from their centres.
    """
    from fegear.contact.pair_load_curves import pair_coupling

    if not cycle.face.is_uniform:
        return cycle.face.coupling[:, :, pairs][..., pairs]
    arc, turn = (
        values[:, :, pairs].reshape(-1, pairs.size, 2)
        for values in (cycle.arc, cycle.turn)
    )
    normal, _ = pair_coupling(problem, cycle.teeth[pairs], arc, turn)
    return normal.reshape(*cycle.ste.shape, pairs.size, pairs.size)
