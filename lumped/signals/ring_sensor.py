"""Signals of a sensor on the ring of a planetary set, which the planets pass.

The sensor feels the force of each planet's mesh on the ring through a path that is
short only while the planet is near. A window over the angle between planet and sensor
stands for that path,

    s = sum_n w(theta_n) F_n,  w = (1 + cos(2 pi theta / B)) / 2 within B / 2, else 0

with the force F_n of the ring's mesh with planet n along its line of action. With the
full width B of 2 pi over the number N of planets it is that of M. Inalpolat and A.
Kahraman, A theoretical and experimental investigation of modulation sidebands of
planetary gear sets, J. Sound Vib. 323 (2009) 677.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from lumped.common.array_types import Array
from lumped.signals.coordinate_motion import CoordinateMotion
from lumped.steady.ramps import SpeedRamp
from lumped.train.bodies import TrainError
from lumped.train.system import LumpedSystem
from lumped.train.train import Train

AT_REST = 1e-9  # of the transmission errors, below which the ring does not translate
FORCE, ACCELERATION = "ring_sensor_force_N", "ring_sensor_acceleration_m_per_s2"


@dataclass(frozen=True, eq=False, kw_only=True)
class PlanetPasses:
    """How the planets of a set move along its ring.

    Parameters
    ----------
    ring : int
        Index of the ring, from 0.
    teeth : int
        Teeth of the ring, mesh cycles in a turn of the carrier against it.
    meshes : tuple of int
        Index of the ring's mesh with each planet.
    angles : (n,) array
        Direction of each planet when the first mesh is at its pitch point [rad].
    sense : int
        1 where the carrier turns counter-clockwise against the ring, else -1.
    """

    ring: int
    teeth: int
    meshes: tuple[int, ...]
    angles: Array
    sense: int

    def directions(self, cycles: Array) -> Array:
        """Directions (k, n) of the planets in the frame of the ring [rad].

        Parameters
        ----------
        cycles : (k,) array
            Mesh cycles from the start, at which the axes of ring and carrier agree.
        """
        turns = self.sense * np.asarray(cycles) / self.teeth
        return np.asarray(self.angles + 2.0 * math.pi * turns[:, None])


def planet_passes(train: Train) -> PlanetPasses:
    """How planets pass the ring; raises TrainError for a train without both."""
    carrier = train.carrier
    if carrier is None:
        raise TrainError("carrier = None; a planetary set is needed")
    mesh_of = {
        (mesh.driver if train.gears[mesh.driven].base_radius < 0.0 else mesh.driven): n
        for n, mesh in enumerate(train.meshes)
        if train.is_internal(mesh)
    }
    if not set(carrier.gears) <= set(mesh_of):
        raise TrainError("meshes: each gear on the carrier needs one with a ring")
    meshes = tuple(mesh_of[planet] for planet in carrier.gears)
    first = train.meshes[meshes[0]]
    ring = first.driver + first.driven - carrier.gears[0]
    return PlanetPasses(
        ring=ring,
        teeth=train.gears[ring].teeth,
        meshes=meshes,
        angles=np.array(carrier.angles),
        sense=-train.sense(ring),
    )


@dataclass(frozen=True, eq=False, kw_only=True)
class RingSensor:
    """A sensor on the ring, and the window over the angle at which it feels a planet.

    Parameters
    ----------
    passes : PlanetPasses
        How the planets pass it.
    direction : float
        Its direction from the axis when the first mesh is at its pitch point,
        counter-clockwise from x [rad].
    width : float
        Full width of the window [rad], above 0 and up to a turn.
    """

    passes: PlanetPasses
    direction: float
    width: float

    def angles(self, cycles: Array) -> Array:
        """Angles (k, n) of the planets from the sensor [rad], from -pi to pi.

        Parameters
        ----------
        cycles : (k,) array
            Mesh cycles from the start.
        """
        angle = self.passes.directions(cycles) - self.direction
        return np.asarray(np.mod(angle + math.pi, 2.0 * math.pi) - math.pi)

    def weights(self, cycles: Array) -> Array:
        """Part (k, n) of the force of each planet's mesh that the sensor feels.

        Parameters
        ----------
        cycles : (k,) array
            Mesh cycles from the start.
        """
        return hann_window(self.angles(cycles), self.width)

    def names(self, system: LumpedSystem) -> tuple[str, ...]:
        """Names of its signals; it has an acceleration where the ring translates."""
        indices = system.modes.coordinates.indices
        moves = (self.passes.ring, "x") in indices
        return (FORCE, ACCELERATION) if moves else (FORCE,)

    def signals(
        self, motion: CoordinateMotion, time: Array, ramp: SpeedRamp
    ) -> Mapping[str, Array]:
        """Signals (k,) at times (k,) by name.

        The force above [N], and the acceleration of the ring [m/s2] along the direction
        of the sensor, positive outward.

        Parameters
        ----------
        motion : CoordinateMotion
            Motion of the train, in the frame of the carrier.
        time : (k,) array
            Times from the start [s].
        ramp : SpeedRamp
            Mesh frequency over time.
        """
        cycles = ramp.cycles_at(time)
        forces = motion.mesh_force(time)[:, self.passes.meshes]
        signals = [(forces * self.weights(cycles)).sum(axis=1)]
        if len(self.names(motion.system)) > 1:
            signals.append(self._acceleration(motion, time, ramp))
        return dict(zip(self.names(motion.system), signals, strict=True))

    def _acceleration(
        self, motion: CoordinateMotion, time: Array, ramp: SpeedRamp
    ) -> Array:
        """Acceleration (k,) of the ring toward the sensor, in space [m/s2]."""
        system, passes = motion.system, self.passes
        columns = [system.modes.coordinates.indices[passes.ring, axis] for axis in "xy"]
        displacement, velocity = motion.at(time)
        x, v = (values[:, columns] @ (1.0, 1j) for values in (displacement, velocity))
        # where planets balance each other, derivatives would raise round-off
        if np.abs(x).max() < AT_REST * np.abs(motion.deflection(displacement)).max():
            return np.zeros(len(time))
        a = motion.acceleration(time)[:, columns] @ (1.0, 1j)
        train = system.train
        speed = train.carrier_angular_speed(1.0) * ramp.frequency_at(time)
        change = train.carrier_angular_speed(ramp.rate)
        in_space = a + 2j * speed * v + (1j * change - speed**2) * x
        # direction of the sensor in the frame of the carrier
        turn = passes.directions(ramp.cycles_at(time))[:, 0] - passes.angles[0]
        return np.asarray((in_space * np.exp(-1j * (self.direction - turn))).real)


def hann_window(angle: Array, width: float) -> Array:
    """Window over angles of any shape [rad]: 1 at 0, and 0 beyond half its width."""
    inside = np.abs(angle) < 0.5 * width
    return np.where(inside, 0.5 + 0.5 * np.cos(2.0 * math.pi * angle / width), 0.0)
