"""Sliding friction of tooth pairs on both sides, compiled.

Force, direction of sliding and rows of `lumped.train.friction`, on modes. The system
is a `lumped.kernels.arrays.ModalSystem`, the samples are FrictionSamples.
"""

from __future__ import annotations

import math

from lumped.common.compiled import inlined
from lumped.kernels.mesh_force import (
    pair_force,
    record,
    record_before,
    set_spring_acceleration,
)


@inlined
def row_speeds(samples, m, v):
    """Speeds of vibration along the rows of mesh m: at the pitch point on the drive
    side and on the back side [m/s], and per metre ahead of it [1/s]."""
    drive, back, per_metre = 0.0, 0.0, 0.0
    for i in range(v.size):
        drive += samples.at_pitch[m, i] * v[i]
        back += samples.at_pitch_back[m, i] * v[i]
        per_metre += samples.per_metre[m, i] * v[i]
    return drive, back, per_metre


@inlined
def sliding_factor(samples, m, speed):
    """Direction of sliding, from -1 to 1, at a sliding speed [m/s]."""
    if samples.transition[m] > 0.0:
        return math.tanh(speed / samples.transition[m])
    if speed == 0.0:
        return 0.0
    return math.copysign(1.0, speed) + 0.0 * speed  # NaN stays NaN


@inlined
def pair_friction(samples, instant, m, p, elastic, backlash, speeds):
    """(normal force [N], what reversed sliding adds to it, sliding speed [m/s],
    sliding factor) of pair p of mesh m, whose force is 0 where teeth are apart.

    elastic : deflection minus gap [m]; speeds : see `row_speeds`
    """
    k, stage = instant
    arm, signed_friction = (
        samples.arm[k, stage, p],
        samples.signed_friction[k, stage, p],
    )
    force = pair_force(samples.stiffness[k, stage, p], elastic, backlash)
    if force == 0.0:
        return 0.0, 0.0, 0.0, 0.0
    side = -1.0 if elastic < -backlash else 1.0
    at_pitch = speeds[0] if side > 0.0 else speeds[1]
    speed = at_pitch + side * arm * (samples.sliding_rate[m] + speeds[2])
    nominal = -side * math.copysign(1.0, signed_friction)
    if not samples.reversible[m]:
        return force, 0.0, speed, nominal
    factor = sliding_factor(samples, m, speed)
    # the stiffness is that of nominal sliding, eq. 4.42
    bending = side * samples.bending[k, stage, p]
    force_change = force * ((1.0 - bending * factor) / (1.0 - bending * nominal) - 1.0)
    return force + force_change, force_change, speed, factor


@inlined
def set_friction_acceleration(system, samples, instant, q, v, a, s):
    """Modal accelerations (n,) and mesh deflections (m,) at one instant.

    instant : step, and 0, 1 or 2 for its start, middle or end
    """
    set_spring_acceleration(system, samples, instant, q, v, a, s)
    k, stage = instant
    at_pitch, back_at_pitch = samples.at_pitch, samples.at_pitch_back
    for m in range(s.size):
        backlash, speeds = system.backlash[m], (0.0, 0.0, 0.0)
        if samples.reversible[m]:
            speeds = row_speeds(samples, m, v)
        drive, back, moment, excess = 0.0, 0.0, 0.0, 0.0
        for p in range(system.first_pair[m], system.first_pair[m + 1]):
            elastic = s[m] - samples.gap[k, stage, p]
            force, force_change, _, factor = pair_friction(
                samples, instant, m, p, elastic, backlash, speeds
            )
            if force == 0.0:
                continue
            # against the sliding
            friction_force = (
                -factor * abs(samples.signed_friction[k, stage, p]) * abs(force)
            )
            excess += force_change
            if elastic < -backlash:
                back += friction_force
                moment -= friction_force * samples.arm[k, stage, p]
            else:
                drive += friction_force
                moment += friction_force * samples.arm[k, stage, p]
        for i in range(q.size):
            a[i] += at_pitch[m, i] * drive + back_at_pitch[m, i] * back
            a[i] += samples.per_metre[m, i] * moment - system.shapes[m, i] * excess


@inlined
def record_friction(system, samples, k, q, v, out):
    """The meshes (6 + 3 k, m) at the start of step k, see `mesh_force.record`.

    After those rows come normal force [N], sliding speed [m/s] and power taken [W] of
    each mesh's pairs, k at most; all are 0 where teeth are apart.
    """
    before = k - 1 if k > 0 else samples.h.size - 1
    record(system, samples.stiffness[k, 0], samples.gap[k, 0], q, v, out)
    record_before(system, samples.stiffness[before, 2], samples.gap[before, 2], q, out)
    for m in range(system.backlash.size):
        speeds, backlash = row_speeds(samples, m, v), system.backlash[m]
        first = system.first_pair[m]
        for p in range(first, system.first_pair[m + 1]):
            instant, row = (k, 0), 6 + 3 * (p - first)
            elastic = out[0, m] - samples.gap[k, 0, p]
            force, force_change, speed, factor = pair_friction(
                samples, instant, m, p, elastic, backlash, speeds
            )
            out[2, m] += force_change
            out[row, m], out[row + 1, m] = force, speed
            friction_force = factor * abs(samples.signed_friction[k, 0, p]) * abs(force)
            out[row + 2, m] = friction_force * speed
            elastic = out[0, m] - samples.gap[before, 2, p]
            _, force_change, _, _ = pair_friction(
                samples, (before, 2), m, p, elastic, backlash, speeds
            )
            out[5, m] += force_change
