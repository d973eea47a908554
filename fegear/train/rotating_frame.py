"""Warnings on the frame of a planetary set, which rotates with the carrier."""

from __future__ import annotations

from collections.abc import Iterator

from fegear.files.codes import with_code
from lumped.train.rotating_frame import WhirlModes
from lumped.train.train import Carrier, Gear, Train


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


def speed_warnings(modes: WhirlModes) -> Iterator[str]:
    """A line where centrifugal forces exceed those of the bearings."""
    growth = float(modes.growth.max())
    if modes.is_supercritical:
        motion = f"grow by up to {growth:.3g} 1/s" if growth > 0.0 else "do not grow"
        yield with_code(
            "W41",
            f"the carrier at {abs(modes.speed):.4g} rad/s is above a critical speed; "
            f"undamped modes {motion}",
        )
