"""Every kind of computation: the class of its part, and the function that makes it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import get_args, get_type_hints

from validation.commands.reproduce.computations import (
    clatter,
    eccentric_gearing,
    finite_elements,
    free_motions,
    mesh_forces,
    rattle_basins,
    rattle_models,
    rattle_motions,
    rattle_orbits,
    recursion,
    settled_motions,
    spectra,
    stability,
    tooth_friction,
)
from validation.commands.reproduce.computations import frequency_response as response
from validation.commands.reproduce.computations import natural_frequencies as natural
from validation.commands.reproduce.computations import parameter_studies as studies
from validation.commands.reproduce.parts import Compute, Part

AnyPart = (
    response.BranchesPart
    | response.SweepPart
    | response.TheoryPart
    | natural.ModesPart
    | natural.ModeEnergiesPart
    | studies.MapPart
    | studies.TheoryMapPart
    | studies.IndicatorsPart
    | studies.WidthPart
    | finite_elements.ElementsPart
    | mesh_forces.ForcesPart
    | settled_motions.AttractorsPart
    | spectra.SpectraPart
    | stability.StabilityPart
    | free_motions.FreeMotionsPart
    | recursion.SawtoothPart
    | tooth_friction.ToothPairsPart
    | tooth_friction.FrictionDeflectionPart
    | tooth_friction.HarmonicsPart
    | rattle_basins.BasinsPart
    | rattle_basins.BoundariesPart
    | rattle_basins.LimitPart
    | rattle_models.QuietPart
    | rattle_motions.MotionsPart
    | rattle_orbits.OrbitBranchesPart
    | rattle_orbits.ExistencePart
    | rattle_orbits.OrbitMotionsPart
    | rattle_orbits.SettledRattlePart
    | eccentric_gearing.WheelsPart
    | eccentric_gearing.TorquePart
    | eccentric_gearing.LimitsPart
    | clatter.ClatterPart
)
COMPUTE: Mapping[type[Part], Compute] = {
    response.BranchesPart: response.branches,
    response.SweepPart: response.sweep,
    response.TheoryPart: response.theory,
    natural.ModesPart: natural.modes,
    natural.ModeEnergiesPart: natural.mode_energies,
    studies.MapPart: studies.parameter_map,
    studies.TheoryMapPart: studies.theory_map,
    studies.IndicatorsPart: studies.indicators,
    studies.WidthPart: studies.width,
    finite_elements.ElementsPart: finite_elements.elements,
    mesh_forces.ForcesPart: mesh_forces.forces,
    settled_motions.AttractorsPart: settled_motions.attractors,
    spectra.SpectraPart: spectra.spectra,
    stability.StabilityPart: stability.stability,
    free_motions.FreeMotionsPart: free_motions.free_motions,
    recursion.SawtoothPart: recursion.sawtooth,
    tooth_friction.ToothPairsPart: tooth_friction.tooth_pairs,
    tooth_friction.FrictionDeflectionPart: tooth_friction.friction_deflection,
    tooth_friction.HarmonicsPart: tooth_friction.harmonics,
    rattle_basins.BasinsPart: rattle_basins.basins,
    rattle_basins.BoundariesPart: rattle_basins.boundaries,
    rattle_basins.LimitPart: rattle_basins.limit,
    rattle_models.QuietPart: rattle_models.quiet,
    rattle_motions.MotionsPart: rattle_motions.motions,
    rattle_orbits.OrbitBranchesPart: rattle_orbits.orbit_branches,
    rattle_orbits.ExistencePart: rattle_orbits.existence,
    rattle_orbits.OrbitMotionsPart: rattle_orbits.orbit_motions,
    rattle_orbits.SettledRattlePart: rattle_orbits.settled_rattle,
    eccentric_gearing.WheelsPart: eccentric_gearing.wheels,
    eccentric_gearing.TorquePart: eccentric_gearing.torque,
    eccentric_gearing.LimitsPart: eccentric_gearing.limits,
    clatter.ClatterPart: clatter.clatter,
}
KINDS: Mapping[str, type[Part]] = {
    str(get_args(get_type_hints(part)["kind"])[0]): part for part in COMPUTE
}
