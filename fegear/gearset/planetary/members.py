"""Members of a planetary set: their speeds, torques and powers in closed form.

With z_s and z_r teeth of sun and ring, speeds and torques of sun, ring and carrier
satisfy

    z_s w_s + z_r w_r - (z_s + z_r) w_c = 0
    T_s : T_r : T_c = z_s : z_r : -(z_s + z_r)

(Willis, and the balance of a planet). Friction is left out but in `efficiency`.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Literal, get_args

Member = Literal["sun", "carrier", "ring"]
MAX_PLANETS = 12
MEMBERS: tuple[Member, ...] = get_args(Member)


@dataclass(frozen=True, kw_only=True)
class Members:
    """Sun, ring and carrier, and which of them is driven, drives and is held.

    sun, ring : numbers of teeth
    planets : number of planets
    """

    sun: int
    ring: int
    planets: int
    input: Member
    output: Member
    held: Member

    @property
    def weights(self) -> dict[Member, int]:
        """Torques of the members over that of one tooth; they add up to 0."""
        return {"sun": self.sun, "carrier": -self.sun - self.ring, "ring": self.ring}

    @property
    def speeds(self) -> dict[Member, float]:
        """Rotations of the members per rotation of the input."""
        weights = self.weights
        output = -weights[self.input] / weights[self.output]
        return {self.input: 1.0, self.output: output, self.held: 0.0}

    @property
    def torques(self) -> dict[Member, float]:
        """Torques on the members from outside per torque on the input."""
        weights = self.weights
        return {member: weights[member] / weights[self.input] for member in MEMBERS}

    @property
    def powers(self) -> dict[Member, float]:
        """Powers into the members from outside, over the power of the input."""
        return {m: self.torques[m] * self.speeds[m] for m in MEMBERS}

    @property
    def ratio(self) -> float:
        """Speed of the input over that of the output."""
        return -self.weights[self.output] / self.weights[self.input]

    @property
    def cycles_per_turn(self) -> float:
        """Mesh cycles per rotation of the input: z_s |w_s - w_c| / w_i."""
        relative = {  # with a held member h: z_s (w_s - w_c) = -z_r (w_r - w_c)
            ("sun", "ring"): self.sun * self.ring / (self.sun + self.ring),
            ("ring", "sun"): self.sun * self.ring / (self.sun + self.ring),
            ("sun", "carrier"): float(self.sun),
            ("ring", "carrier"): float(self.ring),
            ("carrier", "ring"): float(self.ring),
            ("carrier", "sun"): float(self.sun),
        }
        return relative[self.input, self.held]

    def cycles_per_turn_of(self, member: Member) -> Fraction | None:
        """Mesh cycles per rotation of a member, None of the one that is held."""
        weights = self.weights
        output = -Fraction(weights[self.input], weights[self.output])
        speeds = {self.input: Fraction(1), self.output: output, self.held: Fraction(0)}
        if member == self.held:
            return None
        relative = abs(speeds["sun"] - speeds["carrier"])
        return self.sun * relative / abs(speeds[member])

    @property
    def rolling_power(self) -> float:
        """Power that the sun's meshes pass on in the frame of the carrier, over the
        power of the input; above 0 where the sun drives the planets."""
        relative = self.speeds["sun"] - self.speeds["carrier"]
        return self.torques["sun"] * relative

    def torque_factor(self, teeth: int) -> float:
        """Torque of one mesh on a gear with some teeth per torque on the input."""
        return teeth / (self.planets * abs(self.weights[self.input]))

    def efficiency(self, basic: float) -> float:
        """Power of the output over that of the input.

        basic : efficiency of both meshes in a row with the carrier held
        """
        passed_on = basic if self.sun_drives else 1.0 / basic
        torques = {"sun": float(self.sun), "ring": passed_on * self.ring}
        torques["carrier"] = -torques["sun"] - torques["ring"]
        ratio = torques[self.output] / torques[self.input]
        return -ratio * self.speeds[self.output]

    @property
    def sun_drives(self) -> bool:
        """Whether the sun drives the planets and they the ring, or the reverse."""
        return sun_drives(self.input, self.held)


def sun_drives(into: Member, held: Member) -> bool:
    """Whether power passes from sun to ring in the frame of the carrier.

    It does where T_s (w_s - w_c) > 0, whatever the numbers of teeth.
    """
    return into == "sun" or (into == "carrier" and held == "sun")
