"""Whether a machine can run quietly, and what change helps."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import asdict, fields, replace
from typing import Any

from fegear.rattle.machines import NamedMachine, figures_of
from lumped.rattle.assembly import Assembly
from lumped.rattle.impulses import impulse_rattle
from lumped.rattle.motions import Motions
from lumped.rattle.quiet import quiet_motion
from lumped.rattle.receptances import critical_by_receptances

CHANGED = 1e-4  # relative change of a figure that tells a sensitivity
VARIED = "damping", "stiffness", "ripple"  # of the machine


def quiet_summary(named: NamedMachine) -> dict[str, Any]:
    """Critical eccentricity, margin and sensitivities, plain values ready for JSON."""
    assembly = named.assembly
    motion = quiet_motion(assembly)
    critical, margin = motion.critical_eccentricity, motion.contact_margin
    return {
        **named.heading,
        **figures_of(assembly.machine),
        "shafts": asdict(assembly.shafts),
        **{name: asdict(part) for name, part in assembly.beside_shafts},
        "critical_eccentricity_rad": critical,
        "critical_without_ripple_rad": critical_by_receptances(assembly),
        "least_contact_load_over_mean": margin,
        "quiet_motion_exists": margin > 0.0,
        "simple_rattle_in_impacts_from_rad": _simple_rattle(assembly),
        **_of_gears(named, critical),
        "percent_of_critical_per_percent": {
            name: _sensitivity(*both) for name, *both in _varied(assembly)
        },
    }


def _simple_rattle(assembly: Assembly) -> float | None:
    """Eccentricity from which P(1,1,0) exists, flanks rigid.

    None of other parts than shafts, where a light gear may strike again before it is
    back, with torque ripple, and where damping is too small to tell.
    """
    if any(assembly.beside_shafts) or assembly.machine.ripple:
        return None
    rigid = replace(assembly.machine, stiffness=math.inf, ripple=0.0)
    try:
        motions = Motions(replace(assembly, machine=rigid))
    except ValueError:
        return None
    return impulse_rattle(motions).least_eccentricity


def _of_gears(named: NamedMachine, critical: float) -> dict[str, float | None]:
    """Eccentricity of each gear, and how far apart their long sides may stand."""
    if named.gear_eccentricities is None:
        return {}
    driving, driven, phase = named.gear_eccentricities
    within = None
    if critical > abs(driving - driven):
        within = math.pi
        if critical < driving + driven:
            # eq. 2.9 solved for the phase
            cosine = (driving**2 + driven**2 - critical**2) / (2.0 * driving * driven)
            within = math.acos(cosine)
    return {
        "driving_eccentricity_rad": driving,
        "driven_eccentricity_rad": driven,
        "eccentricity_phase_rad": phase,
        "quiet_for_phases_within_rad": within,
    }


def _varied(assembly: Assembly) -> Iterator[tuple[str, Assembly, Assembly]]:
    """Figures that can help, with less and more of each."""
    machine = assembly.machine
    for name in VARIED:
        value = getattr(machine, name)
        if value and math.isfinite(value):
            less, more = (
                replace(assembly, machine=replace(machine, **{name: value * factor}))
                for factor in (1.0 - CHANGED, 1.0 + CHANGED)
            )
            yield name, less, more
    for table, part in (("shafts", assembly.shafts), *assembly.beside_shafts):
        for each in fields(part):
            value = getattr(part, each.name)
            if isinstance(value, float) and value:
                less, more = (
                    replace(
                        assembly,
                        **{table: replace(part, **{each.name: value * factor})},
                    )
                    for factor in (1.0 - CHANGED, 1.0 + CHANGED)
                )
                yield f"{table}.{each.name}", less, more


def _sensitivity(less: Assembly, more: Assembly) -> float | None:
    """Relative change of the critical eccentricity over that of a figure."""
    low, high = (quiet_motion(each).critical_eccentricity for each in (less, more))
    if low == 0.0 or high == 0.0:
        return None
    return math.log(high / low) / (2.0 * CHANGED)
