"""Whether a machine can run quietly, and what change helps."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from fegear.rattle.machines import NamedMachine, figures_of
from lumped.rattle.quiet import contact_margin, critical_by_search

CHANGED = 1e-4  # relative change of a figure that tells a sensitivity
VARIED = "damping", "stiffness"


def quiet_summary(named: NamedMachine) -> dict[str, Any]:
    """Critical eccentricity, margin and sensitivities, plain values ready for JSON."""
    machine = named.machine
    critical = critical_by_search(machine)
    return {
        "machine": named.name,
        **figures_of(machine),
        "critical_eccentricity_rad": critical,
        "least_contact_load_over_mean": contact_margin(machine),
        "quiet_motion_exists": contact_margin(machine) > 0.0,
        "percent_of_critical_per_percent": {
            name: _sensitivity(named, name, critical)
            for name in VARIED
            if not (name == "stiffness" and machine.is_impact)
        },
        "inferences": list(named.inferences),
    }


def _sensitivity(named: NamedMachine, name: str, critical: float) -> float | None:
    """Relative change of the critical eccentricity over that of a figure."""
    if critical == 0.0:
        return None
    machine = named.machine
    changed = {name: getattr(machine, name) * (1.0 + CHANGED)}
    after = critical_by_search(replace(machine, **changed))
    return (after / critical - 1.0) / CHANGED
