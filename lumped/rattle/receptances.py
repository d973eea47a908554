"""Critical eccentricity of every assembly in closed form, without torque ripple.

The rotation of a gear is its side's receptance times the tooth load. While flanks are
in contact, an error e is shared between their compliance and both gears, so that the
amplitude of the tooth load is e over the sum of the three; it must stay below the mean
load. Eqs. 2.36, 4.24 and 4.132 are this sum for equal shafts, unequal shafts and a
sprung gear.
"""

from __future__ import annotations

import math

from lumped.rattle.assembly import Absorber, Assembly, SprungGear
from lumped.rattle.machine import TURN


def critical_by_receptances(assembly: Assembly) -> float:
    """Eccentricity above which flanks separate without torque ripple [rad]."""
    machine, shafts = assembly.machine, assembly.shafts
    drive = shafts.driving_inertia, shafts.driving_drag * machine.damping
    driven = shafts.driven_inertia, shafts.driven_drag * machine.damping
    absorbers: dict[str, Absorber | None] = {"driving": None, "driven": None}
    if assembly.absorber is not None:
        absorbers |= {assembly.absorber.gear: assembly.absorber}
    total = (
        1.0 / machine.stiffness
        + 1.0 / _at_gear(*drive, assembly.driving_gear, absorbers["driving"])
        + 1.0 / _at_gear(*driven, assembly.driven_gear, absorbers["driven"])
    )
    return assembly.mean_load * abs(total)


def _at_gear(
    inertia: float, damping: float, gear: SprungGear | None, absorber: Absorber | None
) -> complex:
    """Torque per rotation of a side at its gear, at one cycle per turn."""
    total = shaft = -inertia * TURN**2 + 1j * damping * TURN
    if gear is not None:
        spring = gear.stiffness + 1j * gear.damping * TURN
        total = spring * shaft / (spring + shaft) - gear.inertia * TURN**2
    if absorber is not None:
        total += _absorbed(absorber)
    return total


def _absorbed(absorber: Absorber) -> complex:
    """Contribution of a pendulum on a gear, infinite if it is tuned to r1 = r2.

    Without damping it is an inertia of m (r1 + r2)^2 r1 / (r1 - r2).
    """
    m, r1, r2 = absorber.mass, absorber.reach, absorber.path_radius
    denominator = m * r2 * (r1 - r2) * TURN**2 + 1j * absorber.damping * r2 * TURN
    straight = -m * (r1 + r2) ** 2 * TURN**2
    if denominator == 0.0:
        return complex(math.inf)
    return straight - (m * r2 * (r1 + r2) * TURN**2) ** 2 / denominator
