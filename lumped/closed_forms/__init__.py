"""Closed forms of resonances by multiple scales, chapters 2 to 4 of the source.

known = parametric_system(system)     # of a LumpedSystem, or from plain numbers
near = resonance(known, mode=0)       # order 1/2 subharmonic, 2 second harmonic
top = peak(near)
limits(known, near)                   # what it leaves out
"""

from lumped.closed_forms.frequency_response import (
    SteadyVibration,
    critical_damping,
    instability_interval,
    linear_amplitude,
    peak,
    peak_amplitude,
    steady_vibrations,
    transition_frequencies,
)
from lumped.closed_forms.indicators import (
    PhaseExtremes,
    phase_extremes,
    rectangular_harmonic,
    rectangular_indicator,
)
from lumped.closed_forms.limits import limits
from lumped.closed_forms.parametric import ParametricSystem, parametric_system
from lumped.closed_forms.predictions import Prediction, predictions
from lumped.closed_forms.relief import (
    ReliefContours,
    optimal_relief,
    relief_contours,
)
from lumped.closed_forms.resonance import Resonance, resonance
from lumped.closed_forms.separation import (
    backbone,
    contact_loss_amplitude,
    lost_stiffness,
    separation_angle,
)
from lumped.closed_forms.superharmonic import superharmonic, with_superharmonic

__all__ = [
    "ParametricSystem",
    "PhaseExtremes",
    "Prediction",
    "ReliefContours",
    "Resonance",
    "SteadyVibration",
    "backbone",
    "contact_loss_amplitude",
    "critical_damping",
    "instability_interval",
    "limits",
    "linear_amplitude",
    "lost_stiffness",
    "optimal_relief",
    "parametric_system",
    "peak",
    "peak_amplitude",
    "phase_extremes",
    "predictions",
    "rectangular_harmonic",
    "rectangular_indicator",
    "relief_contours",
    "resonance",
    "separation_angle",
    "steady_vibrations",
    "superharmonic",
    "transition_frequencies",
    "with_superharmonic",
]
