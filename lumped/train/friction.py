"""Sliding friction of teeth and its contribution to the force of a tooth pair.

A pair that is x ahead of the pitch point along the line of action carries a normal
force N and a friction force mu N across it. Before the pitch point, in approach, the
driven flank slides faster and pulls the driver's flank along; beyond it, in recess, the
driver's flank is faster. The loads on the coordinates are -N (a - mu sgn b), with a the
mesh's row of `Coordinates`, sgn = 1 in approach and -1 in recess, and b = b_0 + x b_1
the row of friction: moments about both gears' axes with arms l_1 = r_1 tan(phi) + x and
l_2 = r_2 tan(phi) - x, and forces perpendicular to the line of action.

The sliding speed is b v, the speed of the driver's flank minus that of the driven
flank. Nominally it is x times the sum of both gears' speeds. If v is the whole motion,
sgn is -sgn(b v), and friction dissipates the power mu N |b v|. Eq. 6.3 has another sign
of one gear's vibration: as printed it subtracts u_2', which closes the mesh as u_1'
does.

If back flanks touch, the contact moves along the other line of action, on which the
driver is the gear that is pushed. This mirrors the pair about the line of centres and
reverses the sliding: the row is b_0' - x b_1, with the same moments at the pitch point
and forces across the other line, and the friction is -mu N sgn(b v). Like the stiffness
of the back side, x is that of the drive side at the same position: teeth count as thin.
Their normal force stays on the line of the drive side, as in `lumped.train.excitation`.

This is eq. 4.40 and 4.44 of the multi-mesh source except for a sign: with eq. 4.40 the
normal force increases in approach, with the matrix L of eq. 4.44 as printed it
decreases. Only with the former does friction dissipate energy.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

import numpy as np

from lumped.common.array_types import Array
from lumped.common.checks import require_between, require_fields
from lumped.train.coordinates import (
    Coordinates,
    center_motion,
    line_of_centers,
    rolling_sense,
)
from lumped.train.excitation import MeshExcitation
from lumped.train.train import Mesh, Train
from lumped.train.waves import Wave, constant_wave, multiply_waves

Sliding = Literal["nominal", "instantaneous"]


@dataclass(frozen=True)
class ToothFriction:
    """Coulomb friction of a mesh.

    coefficient : mu
    bending : friction-bending ratio, deflection by a friction force over that by a
        normal force of the same magnitude; pairs are stiffer by `bending` mu in
        approach and softer in recess, eq. 4.42. It has one wave for each pair along its
        path through the mesh, by whole base pitches ahead
    sliding : sliding whose direction friction opposes, from the gears' nominal speeds
        or including their vibration
    transition : sliding speed V [m/s] over which instantaneous friction reverses, as
        mu tanh(v / V); 0 for a jump
    """

    coefficient: float
    bending: float | Mapping[int, Wave] = 0.0
    sliding: Sliding = "nominal"
    transition: float = 0.0

    def __post_init__(self) -> None:
        require_between("transition", self.transition, 0, 10)
        for name, value in [("coefficient", self.coefficient), *self._ratios()]:
            require_between(name, value, 0, 1, below=True)
        require_fields(self)
        if self.transition and self.sliding == "nominal":
            raise ValueError(
                f"transition = {self.transition:g}; is of instantaneous sliding"
            )

    def _ratios(self) -> Iterator[tuple[str, float]]:
        """Names and values of all friction-bending ratios, at the breaks of waves."""
        if not isinstance(self.bending, Mapping):
            yield "bending", self.bending
            return
        for pair, wave in self.bending.items():
            ends = wave(wave.breaks[:-1]), wave(wave.breaks[1:], side=-1)
            for value in np.concatenate(ends).tolist():
                yield f"bending of pair {pair}", value

    def bending_of(self, pitches_ahead: int) -> Wave:
        """Friction-bending ratio of a pair by whole base pitches ahead."""
        if not isinstance(self.bending, Mapping):
            return constant_wave(self.bending)
        # a pair that carried no load when the ratio was found has that of the nearest
        nearest = min(self.bending, key=lambda pair: abs(pair - pitches_ahead))
        return self.bending[nearest]


def with_bending(excitation: MeshExcitation, friction: ToothFriction) -> MeshExcitation:
    """Tooth pairs with deflection by friction, with a corner at the pitch point.

    Raises ValueError if the excitation does not consist of tooth pairs.
    """
    if not friction.coefficient:
        return excitation
    pairs = []
    for pair in excitation.pairs:
        if pair.ahead is None:
            raise ValueError(
                "friction needs the stiffness of every tooth pair, that of model 1; "
                "the excitation is one spring for the whole mesh"
            )
        change = sliding_sign(pair.ahead) * friction.coefficient
        factor = friction.bending_of(pair.ahead).scaled(change, 1.0)
        wave = multiply_waves(pair.stiffness, factor)
        if pair.ahead == 0:  # the pair passes from approach to recess
            wave = replace(wave, corners=tuple(sorted({0.0, *wave.corners})))
        pairs.append(replace(pair, stiffness=wave))
    return replace(excitation, pairs=tuple(pairs))


def sliding_sign(pitches_ahead: int) -> int:
    """Sign of a pair by whole base pitches ahead: 1 in approach, -1 in recess."""
    return 1 if pitches_ahead < 0 else -1


def base_pitch(train: Train, mesh: int) -> float:
    """Base pitch of a mesh, from its driver [m]."""
    driver = train.gears[train.meshes[mesh].driver]
    return 2.0 * math.pi * abs(driver.base_radius) / driver.teeth


class FrictionRows(NamedTuple):
    """Load (m, n) on coordinates, or modes, per friction force in every mesh.

    at_pitch : b_0, at the pitch point on the drive side
    at_pitch_back : b_0', at the pitch point on the back side
    per_metre : b_1, per metre ahead of the pitch point
    """

    at_pitch: Array
    at_pitch_back: Array
    per_metre: Array

    def on_modes(self, shapes: Array) -> FrictionRows:
        """Rows on modes of shapes (n, k)."""
        return FrictionRows(*(row @ shapes for row in self))


def friction_rows(train: Train, coordinates: Coordinates) -> FrictionRows:
    """Friction rows on the coordinates."""
    shape = len(train.meshes), coordinates.mass.size
    drive, back, per_metre = np.zeros(shape), np.zeros(shape), np.zeros(shape)
    for m, mesh in enumerate(train.meshes):
        sense = rolling_sense(train, mesh)
        # from the line of centres to the direction of the driver's flank at the contact
        sides = (drive, math.pi - mesh.pressure_angle), (back, mesh.pressure_angle)
        for row, angle in sides:
            row[m] = _row_at_pitch(train, mesh, coordinates, sense * angle)
        for gear, side in ((mesh.driver, 1.0), (mesh.driven, -1.0)):
            if (gear, "rotation") in coordinates.indices:
                per_metre[m, coordinates.indices[gear, "rotation"]] += sense * side
    return FrictionRows(drive, back, per_metre)


def _row_at_pitch(
    train: Train, mesh: Mesh, coordinates: Coordinates, angle: float
) -> Array:
    """Row (n,) of a force on the driver at an angle to the line of centres, and of the
    opposite force on the driven gear."""
    row, slope = np.zeros(coordinates.mass.size), math.tan(mesh.pressure_angle)
    force_angle = line_of_centers(train, mesh) + angle
    for gear, side in ((mesh.driver, 1.0), (mesh.driven, -1.0)):
        arm = rolling_sense(train, mesh) * train.gears[gear].base_radius * slope
        if (gear, "rotation") in coordinates.indices:
            row[coordinates.indices[gear, "rotation"]] += arm
        for axis, cosine in (
            ("x", math.cos(force_angle)),
            ("y", math.sin(force_angle)),
        ):
            for index, motion in center_motion(train, gear, axis, coordinates.indices):
                row[index] += side * cosine * motion
    return row


def sliding_rate(train: Train, mesh: int) -> float:
    """Nominal sliding speed per metre from the pitch point, over the frequency of the
    first mesh, from both gears' speeds and base radii."""
    speed = float(train.mesh_rates[mesh]) * base_pitch(train, mesh)
    spec = train.meshes[mesh]
    radii = (train.gears[g].base_radius for g in (spec.driver, spec.driven))
    return speed * abs(sum(1.0 / radius for radius in radii))


def torque_shares(
    train: Train,
    mesh: int,
    coefficient: float,
    pitches_ahead: Sequence[int],
    position: Array,
    gear: Literal["driver", "driven"] = "driver",
) -> Array:
    """Shares (p, n) of normal forces in the torque on a gear, on the drive side.

    They are 1 - mu sgn l / r, eq. 4.40.

    ahead : (p,) base pitches by which each pair is ahead
    position : (n,) positions in the mesh's cycle
    """
    spec, pitch = train.meshes[mesh], base_pitch(train, mesh)
    signed_pitch = pitch if gear == "driver" else -pitch
    radius, slope = (
        train.gears[getattr(spec, gear)].base_radius,
        math.tan(spec.pressure_angle),
    )
    rows = [
        sliding_sign(pitches) * (slope + signed_pitch * (position + pitches) / radius)
        for pitches in pitches_ahead
    ]
    return 1.0 - coefficient * np.array(rows)
