"""Closed forms of resonances by multiple scales, chapters 2 to 4 of the source.

known = parametric_system(system)     # from a LumpedSystem, or from plain numbers
near = resonance(known, mode=0)       # order 1/2 subharmonic, 2 second harmonic
top = peak(near)
limits(known, near)                   # assumptions that do not hold

The equations of the multi-mesh source are computed in these functions:

    2.24, 2.25, 2.26            linear_amplitude, for orders 1 and 2
    2.27, 3.44                  instability_interval, critical_damping
    2.28                        optimal_relief
    2.29 to 2.33                relief_contours
    3.28, 3.31, 3.35, 3.37      steady_vibrations; 4.21, 4.26, 4.28, stability 4.24
    3.30, 4.16                  separation_angle
    3.32, 3.36, 4.20            resonance (drive), lost_stiffness (lost contact)
    3.33, 3.43, 4.22            contact_loss_amplitude, transition_frequencies
    3.34, 4.23                  peak
    3.38, 4.25, 4.27            resonance, for any order and mesh
    3.39 to 3.42                superharmonic
    3.45 to 3.50, 4.32 to 4.37  rectangular_indicator, phase_extremes

The docstrings note where the printed equation differs from the derivation.

The stiffness of teeth by beam energies, healthy or cracked, is in `tooth_energy` and
`tooth_crack`.
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
