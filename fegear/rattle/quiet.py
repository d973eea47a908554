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
STRAIGHT = 0.05  # of their sum, by which slopes of less and more of a figure may differ
FLAT = 1e-3  # slope that is as good as none
VARIED = "damping", "stiffness", "ripple"  # of the machine


def quiet_summary(named: NamedMachine) -> dict[str, Any]:
    """Critical eccentricity, margin and sensitivities, plain values ready for JSON."""
    assembly = named.assembly
    motion = quiet_motion(assembly)
    lowest, critical = motion.window or (None, None)
    margin = motion.contact_margin
    of_lowest, of_critical = _sensitivities(assembly)
    return {
        **named.heading,
        **figures_of(assembly.machine),
        "shafts": asdict(assembly.shafts),
        **{name: asdict(part) for name, part in assembly.beside_shafts},
        "least_quiet_eccentricity_rad": lowest,
        "critical_eccentricity_rad": critical,
        "critical_without_ripple_rad": critical_by_receptances(assembly),
        "least_contact_load_over_mean": margin,
        "quiet_motion_exists": margin > 0.0,
        "simple_rattle_in_impacts_from_rad": _simple_rattle(assembly),
        **_of_gears(named, motion.window),
        "percent_of_critical_per_percent": of_critical,
        "percent_of_least_quiet_per_percent": of_lowest,
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


def _of_gears(
    named: NamedMachine, window: tuple[float, float] | None
) -> dict[str, float | None]:
    """Eccentricity of each gear, and how far apart their long sides may stand."""
    if named.gear_eccentricities is None:
        return {}
    driving, driven, phase = named.gear_eccentricities
    values: dict[str, float | None] = {
        "driving_eccentricity_rad": driving,
        "driven_eccentricity_rad": driven,
        "eccentricity_phase_rad": phase,
        "quiet_for_phases_beyond_rad": None,
        "quiet_for_phases_within_rad": None,
    }
    if window is None:
        return values
    least, most = abs(driving - driven), driving + driven
    lowest, critical = window
    if least < critical and lowest <= most:
        values["quiet_for_phases_beyond_rad"] = (
            _phase_of(lowest, driving, driven) if lowest > least else 0.0
        )
        values["quiet_for_phases_within_rad"] = (
            _phase_of(critical, driving, driven) if critical < most else math.pi
        )
    return values


def _phase_of(eccentricity: float, driving: float, driven: float) -> float:
    """Eq. 2.9 solved for the phase."""
    squares = driving**2 + driven**2 - eccentricity**2
    return math.acos(squares / (2.0 * driving * driven))


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


Slopes = dict[str, float | tuple[float, float] | None]


def _sensitivities(assembly: Assembly) -> tuple[Slopes, Slopes]:
    """Relative change of both limits of the quiet window over that of each figure.

    Of less and of more of a figure where a limit has a corner, as at the tuning of an
    absorber; None where a limit is 0 or is not there.
    """
    own = quiet_motion(assembly).window
    lowest: Slopes = {}
    critical: Slopes = {}
    for name, *both in _varied(assembly):
        windows = own, *(quiet_motion(each).window for each in both)
        for side, found in enumerate((lowest, critical)):
            here, less, more = (0.0 if w is None else w[side] for w in windows)
            found[name] = _slope(less, here, more)
    return lowest, critical


def _slope(less: float, here: float, more: float) -> float | tuple[float, float] | None:
    if 0.0 in (less, here, more):
        return None
    below, above = math.log(here / less) / CHANGED, math.log(more / here) / CHANGED
    if abs(above - below) > max(FLAT, STRAIGHT * abs(above + below)):
        return below, above
    return 0.5 * (below + above)
