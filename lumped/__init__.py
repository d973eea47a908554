"""Lumped gear models: tables of mesh stiffness in, motion out."""

from lumped.attractors.attractor_sweeps import sweep_attractors
from lumped.attractors.attractors import Attractor, find_attractor
from lumped.bearings.rolling import BallBearing, RollerBearing, Waviness
from lumped.steady.respond import respond, respond_with_history
from lumped.steady.response import History, Response, Status
from lumped.steady.settings import Settings
from lumped.steady.sweep import Branch, sweep, sweep_all
from lumped.train.analytic import StiffnessParameters, analytic_excitation
from lumped.train.excitation import (
    MeshExcitation,
    PairExcitation,
    excitation_from_table,
)
from lumped.train.modes import Modes, natural_modes
from lumped.train.pitch_errors import pair_errors
from lumped.train.rolling_supports import linearise_bearings
from lumped.train.system import LumpedSystem
from lumped.train.table import MeshTable, read_table, write_table
from lumped.train.train import Carrier, Gear, Mesh, Shaft, Train, TrainError
from lumped.train.waves import Wave

__all__ = [
    "Attractor",
    "BallBearing",
    "Branch",
    "Carrier",
    "Gear",
    "History",
    "LumpedSystem",
    "Mesh",
    "MeshExcitation",
    "MeshTable",
    "Modes",
    "PairExcitation",
    "Response",
    "RollerBearing",
    "Settings",
    "Shaft",
    "Status",
    "StiffnessParameters",
    "Train",
    "TrainError",
    "Wave",
    "Waviness",
    "analytic_excitation",
    "excitation_from_table",
    "find_attractor",
    "linearise_bearings",
    "natural_modes",
    "pair_errors",
    "read_table",
    "respond",
    "respond_with_history",
    "sweep",
    "sweep_all",
    "sweep_attractors",
    "write_table",
]


def __getattr__(name: str) -> type[StiffnessParameters]:
    if name == "StiffnessFigures":  # name of earlier versions
        return StiffnessParameters
    raise AttributeError(f"module 'lumped' has no attribute '{name}'")
