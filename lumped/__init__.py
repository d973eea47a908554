"""Lumped gear models: tables of mesh stiffness in, motion out."""

from lumped.analytic import StiffnessFigures, analytic_excitation
from lumped.attractor_sweeps import sweep_attractors
from lumped.attractors import Attractor, find_attractor
from lumped.excitation import MeshExcitation, PairExcitation, excitation_from_table
from lumped.modes import Modes, natural_modes
from lumped.pitch_errors import pair_errors
from lumped.respond import respond, respond_with_history
from lumped.response import History, Response, Status
from lumped.settings import Settings
from lumped.sweep import Branch, sweep, sweep_all
from lumped.system import LumpedSystem
from lumped.table import MeshTable, read_table, write_table
from lumped.train import Gear, Mesh, Shaft, Train, TrainError
from lumped.waves import Wave

__all__ = [
    "Attractor",
    "Branch",
    "Gear",
    "History",
    "LumpedSystem",
    "Mesh",
    "MeshExcitation",
    "MeshTable",
    "Modes",
    "PairExcitation",
    "Response",
    "Settings",
    "Shaft",
    "Status",
    "StiffnessFigures",
    "Train",
    "TrainError",
    "Wave",
    "analytic_excitation",
    "excitation_from_table",
    "find_attractor",
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
