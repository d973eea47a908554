"Determine whether a machine can run without rattling, and which change helps."

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, fields, replace
from functools import partial
from typing import Any

from fegear.commands.rattle.machines import NamedMachine, parameters
from fegear.commands.rattle.single_impact import single_impact_summary
from lumped.rattle.assembly import Assembly
from lumped.rattle.motions import AssemblyIntegrator
from lumped.rattle.permanent_contact import quiet_motion
from lumped.rattle.receptances import critical_by_receptances
from lumped.rattle.single_impact import SingleImpact, single_impact_of_parts

DIFFERENCE_STEP = 1e-4  # relative change of a parameter that yields a slope
PERCENT = 1e-2  # change of a parameter that yields a slope
# of the slope, by which changes over one per cent may differ from it
LINEARITY_RTOL = 0.2
MIN_CHANGE_PERCENT = 1e-3  # per cent that are as good as none
VARIED_PARAMETERS = "damping", "stiffness", "ripple"  # of the machine


def contact_limits(named: NamedMachine) -> dict[str, Any]:
    """Critical eccentricity, margin and sensitivities, plain values ready for JSON."""
    assembly = named.assembly
    motion = quiet_motion(assembly)
    lowest, critical = motion.window or (None, None)
    margin = motion.contact_margin
    lowest_sensitivity, critical_sensitivity = _sensitivities(assembly)
    impacts = single_impact_summary(_single_impact(assembly))
    return {
        **named.heading,
        **parameters(assembly.machine),
        "shafts": asdict(assembly.shafts),
        **{name: asdict(part) for name, part in assembly.beside_shafts},
        "least_quiet_eccentricity_rad": lowest,
        "critical_eccentricity_rad": critical,
        "critical_without_ripple_rad": critical_by_receptances(assembly),
        "least_contact_load_over_mean": margin,
        "quiet_motion_exists": margin > 0.0,
        "simple_rattle_in_impacts_from_rad": impacts["from_rad"] if impacts else None,
        "single_impact": impacts,
        **_values_of_gears(named, motion.window),
        "critical_sensitivity": critical_sensitivity,
        "least_quiet_sensitivity": lowest_sensitivity,
    }


def _single_impact(assembly: Assembly) -> SingleImpact | None:
    """Conditions of P(1,1,0), flanks rigid.

    None of other parts than shafts, where a light gear may strike again before it is
    back, with torque ripple, and where damping is too small to decide.
    """
    if any(assembly.beside_shafts) or assembly.machine.ripple:
        return None
    rigid = replace(assembly.machine, stiffness=math.inf, ripple=0.0)
    try:
        motions = AssemblyIntegrator(replace(assembly, machine=rigid))
    except ValueError:
        return None
    return single_impact_of_parts(motions)


def _values_of_gears(
    named: NamedMachine, window: tuple[float, float] | None
) -> dict[str, float | None]:
    """Eccentricity of each gear, and the largest angle between their long sides."""
    if named.gear_eccentricities is None:
        return {}
    driving, driven, phase = named.gear_eccentricities
    values: dict[str, float | None] = {
        "driving_eccentricity_rad": driving,
        "driven_eccentricity_rad": driven,
        "eccentricity_phase_rad": phase,
        "quiet_phase_min_rad": None,
        "quiet_phase_max_rad": None,
    }
    if window is None:
        return values
    least, most = abs(driving - driven), driving + driven
    lowest, critical = window
    if least < critical and lowest <= most:
        values["quiet_phase_min_rad"] = (
            _phase_of(lowest, driving, driven) if lowest > least else 0.0
        )
        values["quiet_phase_max_rad"] = (
            _phase_of(critical, driving, driven) if critical < most else math.pi
        )
    return values


def _phase_of(eccentricity: float, driving: float, driven: float) -> float:
    """Eq. 2.9 solved for the phase."""
    squares = driving**2 + driven**2 - eccentricity**2
    return math.acos(squares / (2.0 * driving * driven))


ScaledAssembly = Callable[[float], Assembly]


def _parameter_variations(assembly: Assembly) -> Iterator[tuple[str, ScaledAssembly]]:
    """Figures that can help, and the assembly with each times a factor."""
    machine = assembly.machine
    for name in VARIED_PARAMETERS:
        value = getattr(machine, name)
        if value and math.isfinite(value):
            yield (
                name,
                partial(_with_scaled_parameter, assembly, "machine", machine, name),
            )
    for table, part in (("shafts", assembly.shafts), *assembly.beside_shafts):
        for field in fields(part):
            value = getattr(part, field.name)
            if isinstance(value, float) and value:
                vary = partial(
                    _with_scaled_parameter, assembly, table, part, field.name
                )
                yield f"{table}.{field.name}", vary


def _with_scaled_parameter(
    assembly: Assembly, table: str, part: Any, name: str, factor: float
) -> Assembly:
    changed = replace(part, **{name: factor * getattr(part, name)})
    return replace(assembly, **{table: changed})


Change = float | tuple[float | None, float | None] | None


def _sensitivities(
    assembly: Assembly,
) -> tuple[dict[str, Change], dict[str, Change]]:
    """Sensitivity of both contact limits to parameters, in per cent per per cent.

    Where a limit bends within one per cent, as at the tuning of an absorber, that of
    one per cent less and of one more; None where a limit is 0 or is not there.
    """
    lowest: dict[str, Change] = {}
    critical: dict[str, Change] = {}
    for name, vary in _parameter_variations(assembly):
        windows = [
            _window_of_varied(vary, 1.0 + change)
            for change in (-PERCENT, -DIFFERENCE_STEP, 0.0, DIFFERENCE_STEP, PERCENT)
        ]
        for side, changes in enumerate((lowest, critical)):
            changes[name] = _relative_change(
                [None if w is None else w[side] for w in windows]
            )
    return lowest, critical


def _window_of_varied(
    vary: ScaledAssembly, factor: float
) -> tuple[float, float] | None:
    """None as well of an assembly that is not possible."""
    try:
        return quiet_motion(vary(factor)).window
    except ValueError:
        return None


def _relative_change(limits: Sequence[float | None]) -> Change:
    """Change of a limit when a parameter is one per cent smaller, slightly smaller,
    unchanged, ...
    """
    here = limits[2]
    if not here:
        return None
    changes = [None if limit is None else limit / here - 1.0 for limit in limits]
    less, below, _, above, more = changes
    if less is None or more is None or below is None or above is None:
        return _percent_or_none(less), _percent_or_none(more)
    slope = (above - below) / (2.0 * DIFFERENCE_STEP)
    off = max(abs(less / PERCENT + slope), abs(more / PERCENT - slope))
    bends = off > max(MIN_CHANGE_PERCENT, LINEARITY_RTOL * abs(slope))
    return (_percent_or_none(less), _percent_or_none(more)) if bends else slope


def _percent_or_none(change: float | None) -> float | None:
    return None if change is None else change / PERCENT
