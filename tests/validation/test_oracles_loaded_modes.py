"""The oracle of natural frequencies about the loaded state, against itself."""

from __future__ import annotations

import numpy as np
import pytest

from fegear.gearset import load_gear_set
from fegear.statics.excitation import Excitations
from fegear.statics.excitation_settings import ExcitationSettings
from fegear.train.lumped_models import lumped_system
from fegear.train.model_settings import LumpedModel
from validation.commands.validate.random_sets.reduced_gears import (
    elastic_gears,
    reduced_gears,
)
from validation.oracles.loaded_modes import (
    dense_rows,
    loaded_modes,
    mass_and_stiffness,
    static_slopes,
    to_fixed_frame,
)

SOURCE = ExcitationSettings(resolution="coarse", positions=64)


@pytest.fixture(scope="module")
def model(compliance_cache):
    """Of a pair with its modes up to 40 kHz or more."""
    gear_set, excitations = load_gear_set("liu-pair"), Excitations(SOURCE)
    reference = lumped_system(
        gear_set, 100.0, LumpedModel(number=1), excitations=excitations
    )
    elastic = elastic_gears(gear_set, [4000.0], SOURCE.statics, 1.0)
    return reduced_gears(gear_set, 100.0, reference, excitations, elastic)


def test_contacts_stay_where_they_are_in_the_frame_that_does_not_turn(model):
    rows, labels = dense_rows(model), model.contact_labels
    after = rows[:, -1] @ to_fixed_frame(model, 1.0).T
    for contact, (mesh, pair, side) in enumerate(labels):
        if (mesh, pair + 1, side) in labels:
            before = rows[labels.index((mesh, pair + 1, side)), 0]
            np.testing.assert_allclose(
                after[contact], before, atol=2e-3 * np.abs(rows).max()
            )


def test_some_pair_carries_at_every_position(model):
    slopes = static_slopes(model)
    assert slopes.min() == 0.0
    assert slopes.max(axis=1).min() > 1e8  # N/m


def test_mass_is_positive(model):
    mass, stiffness = mass_and_stiffness(model)
    assert np.linalg.eigvalsh(mass).min() > 0.0
    np.testing.assert_array_equal(stiffness, stiffness.T)


def test_high_modes_may_follow_or_be_averaged(model):
    """What follows is exact; averaged, modes far above change little."""
    nobody = np.zeros(model.modal.rigidity.size, bool)
    low = model.modal.rigidity < (2.0 * np.pi * 25e3) ** 2
    mode_sets = [loaded_modes(model, averaged, 4000.0) for averaged in (nobody, low)]
    strained = [modes.frequency_Hz[modes.mesh_energy > 0.01] for modes in mode_sets]
    assert len(strained[0]) == 1
    np.testing.assert_allclose(*strained, rtol=5e-3)
