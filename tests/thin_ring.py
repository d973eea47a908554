"""An internal gear of small teeth on a thin rim, which is nearly a thin ring."""

from __future__ import annotations

import numpy as np

from meshes.internal import InternalGear

THIN_TEETH, MODULE, RIM = 480, 0.25e-3, 4e-3  # and [m]


def thin_ring(springs):
    reference = 0.5 * THIN_TEETH * MODULE
    return InternalGear(
        teeth=THIN_TEETH,
        module=MODULE,
        pressure_angle=np.deg2rad(20.0),
        profile_shift=0.0,
        tip_radius=-(reference - 0.6 * MODULE),
        dedendum=1.2 * MODULE,
        rack_tip_radius=0.2 * MODULE,
        hub_radius=-(reference + 1.2 * MODULE + RIM),
        cutter_teeth=160,
        foundation=springs,
    )
