"""What follows from a planetary set: motion, power, and which harmonics drive what.

Plain values, ready for JSON; units are in the names.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from fegear.gearset.loss_factor import equal_share_loss_factor
from fegear.gearset.model import GearSet, PlanetCarrier
from fegear.gearset.planetary.members import MEMBERS
from lumped.common.array_types import Array
from lumped.common.checks import require_present

NEGLIGIBLE_SHARE = (
    1e-6  # part of what all planets together could give, below which it is none
)


def planetary_figures(gear_set: GearSet) -> dict[str, Any] | None:
    """All figures of the planetary set, None where the gear set is none."""
    carrier = gear_set.carrier
    if carrier is None:
        return None
    members = carrier.members
    kx, ky = carrier.bearing_stiffness or (None, None)
    return {
        "input": members.input,
        "output": members.output,
        "held": members.held,
        "ratio": members.ratio,
        "mesh_cycles_per_turn": members.cycles_per_turn,
        "center_radius_mm": 1e3 * carrier.radius,
        "positions_deg": [math.degrees(angle) for angle in carrier.angles],
        "position_errors_um": [1e6 * error for error in carrier.position_errors],
        "carrier_inertia_kg_m2": carrier.inertia,
        "carrier_mass_kg": carrier.mass,
        "carrier_bearing_kx_N_per_m": kx,
        "carrier_bearing_ky_N_per_m": ky,
        "carrier_coupling_stiffness_Nm_per_rad": carrier.coupling_stiffness,
        "input_torques_Nm": list(carrier.torques),
        "members": member_figures(gear_set),
        "rolling_power_over_input": abs(members.rolling_power),
        "loss_per_friction": loss_per_friction(gear_set),
        "harmonics": harmonic_figures(members.sun, carrier.angles),
    }


def member_figures(gear_set: GearSet) -> list[dict[str, Any]]:
    """Speed, torque and power of each member over those of the input, and of planets.

    Planets rotate against the carrier, no torque acts on them from outside.
    """
    carrier = require_present(gear_set.carrier, "carrier")
    members = carrier.members
    speeds, torques, powers = members.speeds, members.torques, members.powers
    rows: list[dict[str, Any]] = [
        {
            "member": member,
            "role": _role(carrier, member),
            "speed_over_input": speeds[member],
            "speed_against_carrier_over_input": speeds[member] - speeds["carrier"],
            "torque_over_input": torques[member],
            "power_over_input": powers[member],
        }
        for member in MEMBERS
    ]
    teeth = gear_set.gears[carrier.planets[0]].geometry.teeth
    against = -(speeds["sun"] - speeds["carrier"]) * members.sun / teeth
    planet = {
        "member": "planets",
        "role": "",
        "speed_over_input": speeds["carrier"] + against,
        "speed_against_carrier_over_input": against,
        "torque_over_input": 0.0,
        "power_over_input": 0.0,
    }
    return [*rows, planet]


def _role(carrier: PlanetCarrier, member: str) -> str:
    members = carrier.members
    roles = {members.input: "input", members.output: "output", members.held: "held"}
    return roles[member]  # type: ignore[index]


def loss_per_friction(gear_set: GearSet) -> float:
    """Power lost over that of the input, per coefficient of friction of the teeth.

    Both meshes lose H_V of the power that rolls through them; for small friction and
    rigid teeth that share the load equally.
    """
    carrier = require_present(gear_set.carrier, "carrier")
    factors = [equal_share_loss_factor(mesh.pair) for mesh in gear_set.meshes[:2]]
    return abs(carrier.members.rolling_power) * sum(factors)


def harmonic_figures(sun: int, angles: Sequence[float]) -> list[dict[str, Any]]:
    """Which motions of equal planets the harmonics of the mesh frequency drive.

    Forces of the planets are alike but for a phase k z_s psi of harmonic k. Their
    sum drives rotations of sun, ring and carrier; the sums with one more or one less
    turn of psi, which rotate, drive translations. What of the planets' own forces is
    part of neither, as it cancels in all sums, drives planets against each other. Each
    is over the number of planets, 0 to 1: sums, and the own forces by their RMS.
    `drives` names what is not negligible, the largest first.

    sun : its number of teeth
    angles : positions of the planets [rad]
    """
    return [
        _harmonic(k, sun, [a - angles[0] for a in angles])
        for k in range(1, len(angles) + 1)
    ]


def _harmonic(k: int, sun: int, angles: Sequence[float]) -> dict[str, Any]:
    torque, *forces = (
        abs(sum(cmath.exp(1j * (k * sun + turn) * a) for a in angles)) / len(angles)
        for turn in (0, -1, 1)
    )
    outside_sums = _force_outside_sums(np.exp(1j * k * sun * np.array(angles)), angles)
    parts = {"rotation": torque, "translation": max(forces), "planets": outside_sums}
    driven = [name for name, size in parts.items() if size > NEGLIGIBLE_SHARE]
    return {
        "harmonic": k,
        "phase_deg": [
            math.degrees(math.remainder(k * sun * a, 2.0 * math.pi)) for a in angles
        ],
        "torque_sum": torque,
        "force_sum": max(forces),
        "own_force_outside_sums": outside_sums,
        "drives": " and ".join(sorted(driven, key=lambda name: -parts[name])),
    }


def _force_outside_sums(forces: Array, angles: Sequence[float]) -> float:
    """RMS of what is left of the planets' forces without those that sums have.

    forces : (n,) complex, of each planet
    """
    turns = np.exp(1j * np.outer(angles, (0, -1, 1)))
    in_sums = turns @ np.linalg.lstsq(turns, forces)[0]
    return float(np.sqrt((np.abs(forces - in_sums) ** 2).mean()))
