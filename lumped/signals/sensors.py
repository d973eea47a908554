"""Signals of sensors on a train in motion."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping

import numpy as np

from lumped.common.array_types import Array
from lumped.common.checks import require_present
from lumped.signals.coordinate_motion import CoordinateMotion
from lumped.train.bodies import Gear
from lumped.train.coordinates import carrier_point_motion, train_bodies
from lumped.train.system import LumpedSystem
from lumped.train.train import Train

MoreSignals = Callable[[CoordinateMotion, Array], Mapping[str, Array]]

ROUND_OFF = 1e-12  # of the time at which a piece ends, relative


def signal_names(system: LumpedSystem) -> tuple[str, ...]:
    """Names of the signals of a train, with units at their ends."""
    bodies, meshes = train_bodies(system.train), len(system.train.meshes)
    turning = [bodies[number].name for number in _turning_bodies(system)]
    borne = [bodies[number].name for number in _borne_bodies(system)]
    return (
        *(dte_name(mesh) for mesh in range(meshes)),
        *(f"{name}_speed_deviation_rad_per_s" for name in turning),
        *(f"{name}_bearing_{axis}_N" for name in borne for axis in "xy"),
        *(system.space.sensors if system.space is not None else ()),
    )


def dte_name(mesh: int) -> str:
    """Name of the transmission error of a mesh by its index, from 0."""
    return f"mesh{1 + mesh}_dte_m"


def _turning_bodies(system: LumpedSystem) -> list[int]:
    numbers = range(len(train_bodies(system.train)))
    return [number for number in numbers if system.rotation_row(number) is not None]


def _borne_bodies(system: LumpedSystem) -> list[int]:
    """Gears, and the carrier as the one after the last, on bearings that can move."""
    indices = system.modes.coordinates.indices
    return [
        number
        for number, body in enumerate(train_bodies(system.train))
        if body.bearing_stiffness is not None and (number, "x") in indices
    ]


def sensor_signals(motion: CoordinateMotion, time: Array) -> Mapping[str, Array]:
    """Signals (k,) at times (k,) by name, with units at the ends of the names.

    Transmission error of every mesh; deviation of the angular speed of every gear that
    can rotate from its nominal one, positive where the gear is faster; forces of gears
    on bearings that can move, along x and y. Of gears that move in space, forces of
    shafts on all bearings, and the accelerations of the shafts in them. Of a planetary
    set, senses are those against the carrier, x and y turn with it, and its own speed
    and bearing forces are there as well.
    """
    system = motion.system
    train, indices = system.train, system.modes.coordinates.indices
    displacement, velocity = motion.at(time)
    signals = list(motion.deflection(displacement).T)
    for number in _turning_bodies(system):
        row = require_present(system.rotation_row(number), "rotation")
        signals.append(_sense(train, number) * (velocity @ row))
    for number in _borne_bodies(system):
        body = train_bodies(train)[number]
        direction = body.bearing_direction if isinstance(body, Gear) else 0.0
        cosine, sine = math.cos(direction), math.sin(direction)
        axes = np.array([[cosine, -sine], [sine, cosine]])  # columns: directions
        elongation = displacement @ _elongation_rows(train, number, indices).T
        force = (elongation @ axes * np.array(body.bearing_stiffness)) @ axes.T
        signals.extend(force.T)
    if system.space is not None:
        acceleration = motion.acceleration(time)
        signals.extend(system.space.sensed(displacement, velocity, acceleration).T)
    return dict(zip(signal_names(system), signals, strict=True))


def _sense(train: Train, number: int) -> int:
    """Sense of rotation of a gear, or of the carrier, the body after the last gear."""
    if number < len(train.gears):
        return train.sense(number)
    return -1 if train.carrier_speed < 0.0 else 1


def _elongation_rows(
    train: Train, number: int, indices: Mapping[tuple[int, str], int]
) -> Array:
    """Motion (2, n) of a body along x and y against what carries its bearing."""
    rows, carrier = np.zeros((2, 1 + max(indices.values()))), train.carrier
    for row, axis in zip(rows, "xy", strict=True):
        row[indices[number, axis]] = 1.0
        if carrier is not None and number in carrier.gears:
            place = carrier.gears.index(number)
            for index, motion in carrier_point_motion(
                train, carrier, place, axis, indices
            ):
                row[index] -= motion
    return rows


def signals_of_pieces(
    pieces: Iterable[CoordinateMotion],
    time: Array,
    gear: int,
    more_signals: MoreSignals | None = None,
) -> tuple[dict[str, Array], Array]:
    """Signals (k,) at rising times (k,) of successive pieces of a motion.

    Also the rotation (k,) of a gear by vibration [rad], positive in the sense of its
    mean rotation; 0 of one that is held.

    gear : index of the gear, from 0
    more_signals : signals of a piece at times beside those of `sensor_signals`
    """
    signals: list[Mapping[str, Array]] = []
    rotations: list[Array] = []
    begin = 0
    for piece in pieces:
        last = np.inf if piece.is_periodic else (1.0 + ROUND_OFF) * piece.time[-1]
        end = int(np.searchsorted(time, last, "right"))
        part = time[begin:end]
        signals.append(sensor_signals(piece, part))
        if more_signals is not None:
            signals[-1] = {**signals[-1], **more_signals(piece, part)}
        rotations.append(_vibration(piece, part, gear))
        begin = end
    joined = {n: np.concatenate([one[n] for one in signals]) for n in signals[0]}
    return joined, np.concatenate(rotations)


def _vibration(motion: CoordinateMotion, time: Array, gear: int) -> Array:
    """Rotation (k,) of a gear at times (k,) beside its mean rotation [rad]."""
    row = motion.system.rotation_row(gear)
    if row is None:
        return np.zeros(time.size)
    return np.asarray(motion.system.train.sense(gear) * (motion.at(time)[0] @ row))


def with_noise(
    signals: Mapping[str, Array], part: float, seed: int
) -> dict[str, Array]:
    """Signals with white Gaussian noise.

    part : its standard deviation over that of each signal
    seed : of the random numbers
    """
    if part == 0.0:
        return dict(signals)
    random = np.random.default_rng(seed)
    return {
        name: values + part * values.std() * random.standard_normal(values.size)
        for name, values in signals.items()
    }
