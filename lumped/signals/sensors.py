"""Signals of sensors on a train in motion."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

import numpy as np

from lumped.common.array_types import Array
from lumped.common.checks import require_present
from lumped.signals.coordinate_motion import CoordinateMotion
from lumped.train.system import LumpedSystem

ROUND_OFF = 1e-12  # of the time at which a piece ends, relative


def signal_names(system: LumpedSystem) -> tuple[str, ...]:
    """Names of the signals of a train, with units at their ends."""
    train = system.train
    gears = [train.gears[number].name for number in _turning_gears(system)]
    borne = [train.gears[number].name for number in _borne_gears(system)]
    return (
        *(f"mesh{number}_dte_m" for number in range(1, 1 + len(train.meshes))),
        *(f"{name}_speed_deviation_rad_per_s" for name in gears),
        *(f"{name}_bearing_{axis}_N" for name in borne for axis in "xy"),
        *(system.space.sensors if system.space is not None else ()),
    )


def _turning_gears(system: LumpedSystem) -> list[int]:
    numbers = range(len(system.train.gears))
    return [number for number in numbers if system.rotation_row(number) is not None]


def _borne_gears(system: LumpedSystem) -> list[int]:
    """Gears on bearings that can move."""
    indices = system.modes.coordinates.indices
    return [
        number
        for number, gear in enumerate(system.train.gears)
        if gear.bearing_stiffness is not None and (number, "x") in indices
    ]


def sensor_signals(motion: CoordinateMotion, time: Array) -> Mapping[str, Array]:
    """Signals (k,) at times (k,) by name, with units at the ends of the names.

    Transmission error of every mesh; deviation of the angular speed of every gear that
    can rotate from its nominal one, positive where the gear is faster; forces of gears
    on bearings that can move, along x and y. Of gears that move in space, forces of
    shafts on all bearings, and the accelerations of the shafts in them.
    """
    system = motion.system
    train, indices = system.train, system.modes.coordinates.indices
    displacement, velocity = motion.at(time)
    signals = list(motion.deflection(displacement).T)
    for number in _turning_gears(system):
        row = require_present(system.rotation_row(number), "rotation")
        signals.append(train.sense(number) * (velocity @ row))
    for number in _borne_gears(system):
        gear = train.gears[number]
        center = displacement[:, [indices[number, axis] for axis in "xy"]]
        cosine, sine = (f(gear.bearing_direction) for f in (math.cos, math.sin))
        axes = np.array([[cosine, -sine], [sine, cosine]])  # columns: directions
        force = (center @ axes * np.array(gear.bearing_stiffness)) @ axes.T
        signals.extend(force.T)
    if system.space is not None:
        acceleration = motion.acceleration(time)
        signals.extend(system.space.sensed(displacement, velocity, acceleration).T)
    return dict(zip(signal_names(system), signals, strict=True))


def signals_of_pieces(
    pieces: Iterable[CoordinateMotion], time: Array, gear: int
) -> tuple[dict[str, Array], Array]:
    """Signals (k,) at rising times (k,) of successive pieces of a motion.

    Also the rotation (k,) of a gear by vibration [rad], positive in the sense of its
    mean rotation; 0 of one that is held.

    gear : index of the gear, from 0
    """
    signals: list[Mapping[str, Array]] = []
    rotations: list[Array] = []
    begin = 0
    for piece in pieces:
        last = np.inf if piece.is_periodic else (1.0 + ROUND_OFF) * piece.time[-1]
        end = int(np.searchsorted(time, last, "right"))
        part = time[begin:end]
        signals.append(sensor_signals(piece, part))
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
