"""Quiet motion: flanks that never part, and the eccentricity that ends it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from scipy.optimize import brentq

from lumped.rattle.machine import TURN, Machine

INSTANTS = 4096  # of a turn at which flanks are looked at


def critical_eccentricity(machine: Machine) -> float:
    """Above which flanks part, without torque ripple [rad]; eqs. 2.36 and 2.37.

    The mean load 4 pi delta must hold the flanks together against the forced motion:
    2 pi delta / kappa > |p|, or, in impacts, 4 pi delta > |forcing|.
    """
    delta, kappa = machine.damping, machine.stiffness
    per_unit = TURN * math.hypot(TURN, delta)
    if machine.is_impact:
        return 2.0 * TURN * delta / per_unit
    dynamic = math.hypot(2.0 * kappa - TURN**2, delta * TURN)
    return TURN * delta / kappa * dynamic / per_unit


def contact_margin(machine: Machine) -> float:
    """Least contact force over a turn, over its mean; negative where flanks part."""
    t = np.arange(INSTANTS) / INSTANTS
    rates = TURN, TURN * machine.ripple_order
    if machine.is_impact:
        # flanks at rest on each other are pressed by what would part them
        waves, mean = machine.loads, 2.0 * TURN * machine.damping
    else:
        stiffness = 2.0 * machine.stiffness
        waves = machine.forced(stiffness)
        mean = 2.0 * TURN * machine.damping / stiffness
    load = sum(
        (wave * np.exp(1j * rate * t)).real
        for wave, rate in zip(waves, rates, strict=True)
    )
    return float(1.0 + np.min(load) / mean)


def critical_by_search(machine: Machine) -> float:
    """The same with torque ripple, by search; 0 if flanks part without eccentricity."""

    def margin(eccentricity: float) -> float:
        return contact_margin(replace(machine, eccentricity=eccentricity))

    if margin(0.0) <= 0.0:
        return 0.0
    high = critical_eccentricity(machine) + 1e-12
    while margin(high) > 0.0:
        high *= 2.0
    return float(brentq(margin, 0.0, high, xtol=1e-15, rtol=1e-12))
