"""Double helical gears: two halves of opposite hands that carry half the torque each.

One of the gears is free to move along its axis. It goes where the axial forces of both
halves cancel, and as those are to each other as their torques, each has half of it.
With the transmission errors d_1 and d_2 of the halves under half the torque the motion
is their mean, and the gear that is free moves by (d_1 - d_2) / (2 tan(beta_b)). An
error of the apex is a gap between the halves, so that it moves that gear by half of it
and changes nothing else.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from fegear.contact.result import ContactCycle, FaceLoads
from lumped.common.array_types import Array


def both_halves(near: ContactCycle, far: ContactCycle, groove: float) -> ContactCycle:
    """The contact of both halves, each of which has half of the torque.

    groove : between them [m]
    """
    carries = [half.load != 0.0 for half in (near, far)]
    bending = np.where(carries[0], near.friction_bending, far.friction_bending)
    both = carries[0] & carries[1]
    mean_bending = 0.5 * (near.friction_bending + far.friction_bending)
    return replace(
        near,
        torque=near.torque + far.torque,
        face=_both_faces(near.face, far.face, groove),
        ste=_mean(near.ste, far.ste),
        no_load=_mean(near.no_load, far.no_load),
        local_stiffness=_in_halves(near.local_stiffness, far.local_stiffness),
        load=near.load + far.load,
        load_slope=near.load_slope + far.load_slope,
        relief_slope=_mean(near.relief_slope, far.relief_slope),
        profile_slope=_mean(near.profile_slope, far.profile_slope),
        lead_slope=_mean(near.lead_slope, far.lead_slope),
        topography_slope=_mean(near.topography_slope, far.topography_slope),
        gap=_mean(near.gap, far.gap),
        pressure=np.maximum(near.pressure, far.pressure),
        friction_bending=np.where(both, mean_bending, bending),
        arc=_mean(near.arc, far.arc),
        closing=_mean(near.closing, far.closing),
        driven_torque=near.driven_torque + far.driven_torque,
        residual=np.maximum(near.residual, far.residual),
        axial_float=(near.ste - far.ste) / (2.0 * math.tan(near.face.base_helix_angle)),
    )


def _mean(one: Array, two: Array) -> Array:
    return np.asarray(0.5 * (one + two))


def _in_halves(one: Array, two: Array) -> Array:
    """Stiffness to the mean displacement of two that carry equal forces [N/m]."""
    return np.asarray(4.0 * one * two / (one + two))


def half_faces(face: FaceLoads) -> list[tuple[FaceLoads, slice]]:
    """Loads of either half over its own width, and its slices among all; or all."""
    if not face.groove:
        return [(face, slice(None))]
    count = face.place.size // 2
    apart = 0.5 * (face.groove + 0.5 * face.width)
    halves = []
    for side, at in ((-1, slice(count)), (1, slice(count, None))):
        half = replace(
            face,
            width=0.5 * face.width,
            base_helix_angle=-side * face.base_helix_angle,
            place=face.place[at] - side * apart,
            reference_position=face.reference_position[:, at],
            on_path=face.on_path[:, :, at],
            load=face.load[..., at],
            pressure=face.pressure[..., at],
            arc=face.arc[..., at, :],
            load_change=face.load_change[..., at, :],
            groove=0.0,
        )
        halves.append((half, at))
    return halves


def _both_faces(near: FaceLoads, far: FaceLoads, groove: float) -> FaceLoads:
    apart = 0.5 * (groove + near.width)
    # the compliance to the sum of the forces, half of which is on each half
    coupling = 0.25 * (near.coupling + far.coupling)
    return replace(
        near,
        width=near.width + far.width,
        place=np.concatenate([near.place - apart, far.place + apart]),
        reference_position=np.hstack([near.reference_position, far.reference_position]),
        on_path=np.concatenate([near.on_path, far.on_path], axis=2),
        load=np.concatenate([near.load, far.load], axis=3),
        pressure=np.concatenate([near.pressure, far.pressure], axis=3),
        arc=np.concatenate([near.arc, far.arc], axis=3),
        coupling=coupling,
        load_change=np.concatenate([near.load_change, far.load_change], axis=3),
        groove=groove,
    )
