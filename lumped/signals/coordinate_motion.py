"""Motion of all coordinates of a train, from states that an integration records."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from lumped.common.array_types import Array
from lumped.common.checks import require_present
from lumped.steady.integration_settings import Settings
from lumped.steady.ramps import SpeedRamp, ramp_motion
from lumped.steady.response import History
from lumped.train.system import LumpedSystem

if TYPE_CHECKING:
    from scipy.interpolate import CubicHermiteSpline, PchipInterpolator

POINTS_PER_PIECE = 4096  # of a ramp, at least, but for the last piece
END_RTOL = 1e-9  # of a period, by which an instant before its end is its start


@dataclass(frozen=True, eq=False)
class CoordinateMotion:
    """Displacements of all N coordinates of a train, rigid rotation left out.

    Parameters
    ----------
    system : LumpedSystem
        Train on linear bearings.
    time : (t,) array
        Times, rising [s].
    displacement, velocity : (t, N) array
        Displacements of the gears and their rates; of the coupled model those of the
        hubs.
    force : (t, m) array
        Mesh forces [N].
    is_periodic : bool
        Whether the motion repeats after the last time.
    """

    system: LumpedSystem
    time: Array
    displacement: Array
    velocity: Array
    force: Array
    is_periodic: bool = True

    @property
    def period(self) -> float:
        """Time from the first to the last instant [s]."""
        return float(self.time[-1] - self.time[0])

    def at(self, time: Array) -> tuple[Array, Array]:
        """Displacements and velocities (k, N) of all coordinates at times (k,)."""
        time = self._within_period(time)
        return self._cubics(time), self._cubics(time, 1)

    def acceleration(self, time: Array) -> Array:
        """Accelerations (k, N) of all coordinates at times (k,)."""
        return np.asarray(self._cubics(self._within_period(time), 2))

    def mesh_force(self, time: Array) -> Array:
        """Mesh forces (k, m) at times (k,) [N]."""
        return np.asarray(self._force_curves(self._within_period(time)))

    def _within_period(self, time: Array) -> Array:
        if not self.is_periodic:
            return time
        passed = np.mod(time - self.time[0], self.period)
        # start and end differ: round-off must not decide between them
        is_start = passed > (1.0 - END_RTOL) * self.period
        return np.asarray(self.time[0] + np.where(is_start, 0.0, passed))

    def deflection(self, displacement: Array) -> Array:
        """Transmission errors (k, m) at displacements (k, N) [m]."""
        rows = self.system.modes.coordinates.mesh_rows
        return np.asarray(displacement @ rows.T)

    @cached_property
    def _cubics(self) -> CubicHermiteSpline:
        """Cubics of every step: the velocity may have corners where pairs engage."""
        from scipy.interpolate import CubicHermiteSpline

        return CubicHermiteSpline(self.time, self.displacement, self.velocity)

    @cached_property
    def _force_curves(self) -> PchipInterpolator:
        """Cubics without overshoot where forces jump with a stiffness."""
        from scipy.interpolate import PchipInterpolator

        return PchipInterpolator(self.time, self.force)


def coordinate_motion(
    system: LumpedSystem,
    history: History,
    steps: int = 0,
    is_periodic: bool = True,
    first_step: int = 0,
) -> CoordinateMotion:
    """Motion of all coordinates of a history with states.

    Parameters
    ----------
    system : LumpedSystem
        Train on linear bearings, without tooth friction.
    history : History
        Motion with states.
    steps : int, optional
        Steps per period of the first mesh, which the coupled model needs.
    is_periodic : bool, optional
        Whether the motion repeats after the history.
    first_step : int, optional
        Steps from the start of a common period to the history.

    Returns
    -------
    CoordinateMotion
        Displacements of all gears.

    Raises
    ------
    ValueError
        If the system has tooth friction or the history no states.
    TrainError
        If the system has rolling bearings.
    """
    if system.has_friction:
        raise ValueError("system must be without friction")
    system.require_linear_bearings("signals")
    states = require_present(history.states, "states")
    if system.contacts is None:
        shapes = system.modes.shapes[:, system.moving]
        # the end keeps what the tolerance of the steady state leaves: taken away in
        # the last step alone, it would be a peak of the acceleration
        moved, velocity = states[:, 0] @ shapes.T, states[:, 1] @ shapes.T
    else:
        moved = _hub_displacement(system, history, first_step, steps)
        velocity = _rate(history.time, moved, is_periodic)
        if is_periodic:  # but for the tolerance of the steady state
            moved[-1], velocity[-1] = moved[0], velocity[0]
    displacement = moved + _at_rest(system)
    return CoordinateMotion(
        system, history.time, displacement, velocity, history.force, is_periodic
    )


def ramp_pieces(
    system: LumpedSystem, ramp: SpeedRamp, settings: Settings, state: Array
) -> Iterator[CoordinateMotion]:
    """Motion of all coordinates through a ramp, in successive pieces.

    Parameters
    ----------
    system : LumpedSystem
        Train on linear bearings, without tooth friction.
    ramp : SpeedRamp
        Speed over time.
    settings : Settings
        Numerical settings; steps are fixed.
    state : (2, n) array
        State at the start of a common period, as of a steady state.

    Yields
    ------
    CoordinateMotion
        Motion from the end of the previous piece on.

    Raises
    ------
    Diverged
        If the motion has no bound.
    """
    histories: list[History] = []
    steps, passed = 0, 0
    for history, steps in ramp_motion(system, ramp, settings, state):
        histories.append(history)
        if sum(one.time.size for one in histories) > POINTS_PER_PIECE:
            joined, histories = _joined(histories), []
            yield coordinate_motion(system, joined, steps, False, passed)
            passed += joined.time.size - 1
    if histories:
        yield coordinate_motion(system, _joined(histories), steps, False, passed)


def _joined(histories: Sequence[History]) -> History:
    """A history of several, each of which begins where the one before ends."""
    if len(histories) == 1:
        return histories[0]
    values = {}
    for entry in fields(History):
        arrays = [getattr(history, entry.name) for history in histories]
        if arrays[0] is not None:
            parts = [*(array[:-1] for array in arrays[:-1]), arrays[-1]]
            values[entry.name] = np.concatenate(parts)
    return History(**values)


def _at_rest(system: LumpedSystem) -> Array:
    """Displacement (N,) in the modes that strain no mesh and do not move."""
    modes = system.modes
    rests = modes.frequency_Hz > 0.0
    rests[system.moving] = False
    shapes = modes.shapes[:, rests]
    load = shapes.T @ modes.coordinates.load
    return np.asarray(shapes @ (load / modes.angular[rests] ** 2))


def _hub_displacement(
    system: LumpedSystem, history: History, first_step: int, steps: int
) -> Array:
    """Displacements (t, N) of the hubs of the coupled model.

    Hubs follow the mean rotations of the bodies, and contact forces at once.
    first_step, steps : see `coordinate_motion`
    """
    coordinates = require_present(history.states, "states")[:, 0]
    outputs, grid = system.hub_outputs, system.contact_grid(steps)
    loads = require_present(history.contacts, "contacts")[:, 0]
    mesh_of = require_present(system.contacts, "contacts").mesh_of
    rows = (first_step + np.arange(len(loads))) % len(grid.gap)
    hubs = outputs.offset + coordinates @ outputs.rows.T
    for contact, table in enumerate(outputs.per_load):
        position = grid.grid_index[rows, mesh_of[contact]]
        part = grid.fraction[rows, mesh_of[contact], None]
        moved = (1.0 - part) * table[position] + part * table[position + 1]
        hubs += loads[:, contact, None] * moved
    return np.asarray(hubs)


def _rate(time: Array, values: Array, is_periodic: bool) -> Array:
    """Rate (t, N) of values (t, N) by cubic splines, which pass the ends smoothly."""
    from scipy.interpolate import CubicSpline

    if is_periodic:
        values = np.concatenate([values[:-1], values[:1]])
        return np.asarray(CubicSpline(time, values, bc_type="periodic")(time, 1))
    return np.asarray(CubicSpline(time, values)(time, 1))
