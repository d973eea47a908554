"""Warnings on the frame of a planetary set, which rotates with the carrier."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from fegear.files.codes import with_code
from lumped.train.bodies import Carrier, Gear
from lumped.train.modes import Modes
from lumped.train.rotating_frame import RotatingFrameModes
from lumped.train.system import LumpedSystem
from lumped.train.train import Train

# Twice the carrier's speed over a natural frequency: half of it is the relative change
# of that frequency
MAX_SPEED_RATIO = 0.05
MIN_TRANSLATION = 0.1  # least part of the kinetic energy of a mode that translates


def frame_warnings(train: Train) -> Iterator[str]:
    """A line for each bearing whose stiffness varies as the carrier rotates."""
    if train.carrier is None or train.carrier_speed == 0.0:
        return
    bodies: tuple[Gear | Carrier, ...] = (*train.gears, train.carrier)
    for number, body in enumerate(bodies):
        kx, ky = body.bearing_stiffness or (0.0, 0.0)
        if number in train.carrier.gears or kx == ky:
            continue
        yield with_code(
            "W41",
            f'"{body.name}": bearing_kx_N_per_m = {kx:g} and bearing_ky_N_per_m = '
            f"{ky:g} differ; they are taken to rotate with the carrier",
        )


def left_out_warnings(
    system: LumpedSystem,
    speeds: Sequence[float],
    model: str = "models 1 to 3 leave",
) -> Iterator[str]:
    """A line where springs leave out forces of the frame that matter.

    They change natural frequencies of translations by up to the speed of the carrier.

    speeds : mesh frequencies of the first mesh [Hz], empty where they are not known
    model : what has the springs in its place
    """
    slowest = lowest_translational(system.modes)
    per_Hz = 2.0 * abs(system.train.carrier_angular_speed(1.0))
    if system.contacts is not None or not per_Hz or not math.isfinite(slowest):
        return
    first = MAX_SPEED_RATIO * slowest / per_Hz
    if not speeds or max(speeds) > first:
        yield with_code(
            "W41",
            f"{model} out gyroscopic and centripetal forces of the carrier; beyond "
            f" {first:.3g} Hz twice its speed exceeds "
            f"{100.0 * MAX_SPEED_RATIO:g} % of the lowest translational frequency",
        )


def lowest_translational(modes: Modes) -> float:
    """Lowest angular frequency of a mode that translates [rad/s], inf without one."""
    space = modes.coordinates
    centers = np.array([kind != "rotation" for _, kind in space.labels])
    energy = (space.mass[centers, None] * modes.shapes[centers] ** 2).sum(axis=0)
    translates = (energy > MIN_TRANSLATION) & (modes.angular > 0.0)
    return float(modes.angular[translates].min(initial=math.inf))


def speed_warnings(modes: RotatingFrameModes) -> Iterator[str]:
    """A line where centrifugal forces exceed those of the bearings."""
    growth = float(modes.growth.max())
    if modes.is_supercritical:
        motion = f"grow by up to {growth:.3g} 1/s" if growth > 0.0 else "do not grow"
        yield with_code(
            "W41",
            f"the carrier at {abs(modes.speed):.4g} rad/s is above a critical speed; "
            f"undamped modes {motion}",
        )
