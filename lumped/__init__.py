"""Lumped gear models: tables of mesh stiffness in, motion out."""

from __future__ import annotations

from importlib import import_module
from typing import Any

# loaded when first asked for: a use of one part does not wait for the others
_HOMES = {
    "Attractor": "lumped.attractors.attractors",
    "BallBearing": "lumped.bearings.rolling",
    "Branch": "lumped.steady.sweep",
    "Carrier": "lumped.train.bodies",
    "Gear": "lumped.train.bodies",
    "History": "lumped.steady.response",
    "LumpedSystem": "lumped.train.system",
    "Mesh": "lumped.train.train",
    "MeshExcitation": "lumped.train.excitation",
    "MeshTable": "lumped.train.table",
    "Modes": "lumped.train.modes",
    "PairExcitation": "lumped.train.excitation",
    "Response": "lumped.steady.response",
    "RollerBearing": "lumped.bearings.rolling",
    "Settings": "lumped.steady.integration_settings",
    "Shaft": "lumped.train.train",
    "Status": "lumped.steady.response",
    "StiffnessParameters": "lumped.train.analytic",
    "Train": "lumped.train.train",
    "TrainError": "lumped.train.bodies",
    "Wave": "lumped.train.waves",
    "Waviness": "lumped.bearings.rolling",
    "analytic_excitation": "lumped.train.analytic",
    "excitation_from_table": "lumped.train.excitation_tables",
    "find_attractor": "lumped.attractors.attractors",
    "linearise_bearings": "lumped.train.rolling_supports",
    "natural_modes": "lumped.train.modes",
    "pair_errors": "lumped.train.pitch_errors",
    "read_table": "lumped.train.table",
    "respond": "lumped.steady.respond",
    "respond_with_history": "lumped.steady.respond",
    "sweep": "lumped.steady.sweep",
    "sweep_all": "lumped.steady.sweep",
    "sweep_attractors": "lumped.attractors.attractor_sweeps",
    "write_table": "lumped.train.table",
}
__all__ = sorted(_HOMES)


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(_HOMES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__
