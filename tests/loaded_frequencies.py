"""Natural frequencies about the loaded state beside those of finite elements."""

from __future__ import annotations

import fegear
from fegear.gearset import GearSet
from fegear.statics.excitation import Excitations
from fegear.train.loaded_modes import system_of_modes
from fegear.train.lumped_models import lumped_system
from fegear.train.model_settings import LumpedModel
from validation.commands.validate.random_sets.measuring import (
    elastic_gears,
    highest_resonance,
    natural_frequencies,
    reduced_gears,
    speeds_of,
)


def require_frequencies_of_finite_elements(
    gear_set: GearSet, torque: float, source: fegear.ExcitationSettings
) -> None:
    """Within 3 %, by equations that share nothing; of modes that strain the meshes."""
    excitations, springs = Excitations(source), LumpedModel(number=1, excitation=source)
    plain = lumped_system(gear_set, torque, springs, excitations)
    resonance = highest_resonance(plain)
    coupled, _ = system_of_modes(gear_set, torque, springs)
    speeds = speeds_of(resonance, 3)
    elastic = elastic_gears(gear_set, speeds, excitations.settings.statics, 1.0)
    model = reduced_gears(gear_set, torque, plain, excitations, elastic)
    ours, theirs = natural_frequencies(coupled, model, elastic, resonance)
    strained = [row[0] for row in ours if row[1] > 0.25 and row[0] < 1.2 * resonance]
    assert strained
    for frequency in strained:
        apart = min(abs(row[0] - frequency) for row in theirs if row[1] > 0.1)
        assert apart < 0.03 * frequency
