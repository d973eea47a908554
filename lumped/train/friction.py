"""Sliding friction of teeth: what it adds to the force of a tooth pair.

A pair that is x ahead of the pitch point along the line of action carries a normal
force N and a friction force mu N across it. Before the pitch point, in approach, the
driven flank slides faster and draws the driver's on; beyond it, in recess, the other
way round. Loads on the coordinates are -N (a - mu sgn b), with a the mesh's row of
`Coordinates`, sgn = 1 in approach and -1 in recess, and b = b_0 + x b_1 the row of
friction: moments about both gears' axes with arms l_1 = r_1 tan(phi) + x and
l_2 = r_2 tan(phi) - x, and forces off the line of action.

Along the row, b v is the sliding speed, that of the driver's flank less that of the
driven's. Nominally it is x times both gears' speeds; with v the whole motion sgn is
-sgn(b v), and friction takes the power mu N |b v|. Eq. 6.3 has it with another sign of
one gear's vibration: as printed it takes u_2' off, which closes the mesh as u_1' does.

Where back flanks touch, the contact runs along the other line of action, on which the
driver is the gear that is pushed. That mirrors the pair about the line of centres and
turns the sliding round: the row is b_0' - x b_1, with the same moments at the pitch
point and forces across the other line, and the friction -mu N sgn(b v). As the
stiffness of the back side is that of the drive side at the same position, so is x:
teeth count as thin. Their normal force stays on the line of the drive side, as in
`lumped.train.excitation`.

This is eq. 4.40 and 4.44 of the multi-mesh source but for a sign: with eq. 4.40 the
normal force grows in approach, with the matrix L of eq. 4.44 as printed it falls.
Only the first lets friction take energy away.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lumped.common.checks import require_between, require_fields
from lumped.train.coordinates import Coordinates
from lumped.train.excitation import MeshExcitation
from lumped.train.train import Mesh, Train
from lumped.train.waves import Wave, constant, product

Array = NDArray[np.float64]
Sliding = Literal["nominal", "instantaneous"]


@dataclass(frozen=True)
class ToothFriction:
    """Coulomb friction of a mesh.

    coefficient : mu
    bending : friction-bending ratio, deflection by a friction force over that by a
        normal force of the same size; pairs are stiffer by `bending` mu in approach
        and softer in recess, eq. 4.42. Over the way through the mesh one wave for each
        pair, by whole base pitches ahead
    sliding : whose direction friction opposes, that of the gears' nominal speeds, or
        with their vibration
    transition : sliding speed V [m/s] about which instantaneous friction turns, as
        mu tanh(v / V); 0 to turn at once
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
            raise ValueError("transition is of instantaneous sliding, got nominal")

    def _ratios(self) -> Iterator[tuple[str, float]]:
        """All friction-bending ratios, of waves at their breaks, by their name."""
        if not isinstance(self.bending, Mapping):
            yield "bending", self.bending
            return
        for ahead, wave in self.bending.items():
            ends = wave(wave.breaks[:-1]), wave(wave.breaks[1:], side=-1)
            for value in np.concatenate(ends).tolist():
                yield f"bending of pair {ahead}", value

    def bending_of(self, ahead: int) -> Wave:
        """Friction-bending ratio of a pair by whole base pitches ahead."""
        if not isinstance(self.bending, Mapping):
            return constant(self.bending)
        # a pair that carries nothing where the ratio was found has that of its nearest
        nearest = min(self.bending, key=lambda pair: abs(pair - ahead))
        return self.bending[nearest]


def with_bending(excitation: MeshExcitation, friction: ToothFriction) -> MeshExcitation:
    """Tooth pairs as friction bends them, with a corner at the pitch point.

    Raises ValueError where the excitation is not made of tooth pairs.
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
        change = side_of(pair.ahead) * friction.coefficient
        factor = friction.bending_of(pair.ahead).scaled(change, 1.0)
        wave = product(pair.stiffness, factor)
        if pair.ahead == 0:  # it has come from approach to recess
            wave = replace(wave, corners=tuple(sorted({0.0, *wave.corners})))
        pairs.append(replace(pair, stiffness=wave))
    return replace(excitation, pairs=tuple(pairs))


def side_of(ahead: int) -> int:
    """1 in approach, -1 in recess, of a pair by whole base pitches ahead."""
    return 1 if ahead < 0 else -1


def base_pitch(train: Train, mesh: int) -> float:
    """Base pitch of a mesh, by its driver [m]."""
    driver = train.gears[train.meshes[mesh].driver]
    return 2.0 * math.pi * driver.base_radius / driver.teeth


class FrictionRows(NamedTuple):
    """What a friction force does to coordinates, or modes, of every mesh (m, n).

    at_pitch : b_0, at the pitch point on the drive side; at_pitch_back : the same on
        the back side; per_metre : b_1, per metre ahead of it
    """

    at_pitch: Array
    at_pitch_back: Array
    per_metre: Array

    def of_shapes(self, shapes: Array) -> FrictionRows:
        """On modes of shapes (n, k)."""
        return FrictionRows(*(row @ shapes for row in self))


def friction_rows(train: Train, space: Coordinates) -> FrictionRows:
    """On the coordinates."""
    shape = len(train.meshes), space.mass.size
    drive, back, per_metre = np.zeros(shape), np.zeros(shape), np.zeros(shape)
    for m, mesh in enumerate(train.meshes):
        sense = train.sense(mesh.driver)
        # from the line of centres to the way of the driver's flank at the contact
        ways = (drive, math.pi - mesh.pressure_angle), (back, mesh.pressure_angle)
        for row, angle in ways:
            row[m] = _row_at_pitch(train, mesh, space, sense * angle)
        for gear, side in ((mesh.driver, 1.0), (mesh.driven, -1.0)):
            per_metre[m, space.places[gear, "rotation"]] += sense * side
    return FrictionRows(drive, back, per_metre)


def _row_at_pitch(train: Train, mesh: Mesh, space: Coordinates, angle: float) -> Array:
    """Row of a force on the driver at an angle to the line of centres (n,), and of the
    opposite force on the driven gear.
    """
    row, slope = np.zeros(space.mass.size), math.tan(mesh.pressure_angle)
    way = mesh.center_line + angle
    for gear, side in ((mesh.driver, 1.0), (mesh.driven, -1.0)):
        arm = train.sense(mesh.driver) * train.gears[gear].base_radius * slope
        row[space.places[gear, "rotation"]] += arm
        for axis, cosine in (("x", math.cos(way)), ("y", math.sin(way))):
            if (gear, axis) in space.places:
                row[space.places[gear, axis]] += side * cosine
    return row


def sliding_rate(train: Train, mesh: int) -> float:
    """Nominal sliding speed per metre from the pitch point, over the frequency of the
    first mesh: both gears' speeds by their base radii."""
    along = float(train.mesh_rates[mesh]) * base_pitch(train, mesh)
    spec = train.meshes[mesh]
    radii = (train.gears[g].base_radius for g in (spec.driver, spec.driven))
    return along * sum(1.0 / radius for radius in radii)


def torque_shares(
    train: Train,
    mesh: int,
    coefficient: float,
    ahead: Sequence[int],
    position: Array,
    gear: Literal["driver", "driven"] = "driver",
) -> Array:
    """Share of the normal forces of pairs that turns a gear: 1 - mu sgn l / r, eq.
    4.40.

    ahead : base pitches by which each is ahead; position : (n,) of the mesh's cycle
    Of shape (p, n); on the drive side.
    """
    spec, pitch = train.meshes[mesh], base_pitch(train, mesh)
    way = pitch if gear == "driver" else -pitch
    radius, slope = (
        train.gears[getattr(spec, gear)].base_radius,
        math.tan(spec.pressure_angle),
    )
    rows = [
        side_of(each) * (slope + way * (position + each) / radius) for each in ahead
    ]
    return 1.0 - coefficient * np.array(rows)
