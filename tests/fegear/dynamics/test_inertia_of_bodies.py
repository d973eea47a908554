"""Gears whose inertia is that of their elastic bodies, as in the guide's example."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fegear.dynamics.build import FiniteElements, prepare
from fegear.dynamics.stepper import DynamicSettings, TimeSteps
from fegear.files.errors import InputError
from fegear.gearset import read_gear_set
from fegear.gearset.inertia import body_inertia, inertia_of, require_inertia_of_bodies
from fegear.statics.excitation import Excitations
from fegear.statics.excitation_settings import ExcitationSettings
from fegear.train.lumped_models import lumped_system
from fegear.train.model_settings import LumpedModel
from lumped.steady.steady_state import steady_state

GUIDE = Path(__file__).parents[3] / "docs" / "howto" / "gear-set-file.md"
TORQUE, SPEEDS = 120.0, [200.0, 4000.0]
SETTINGS = DynamicSettings(tolerance=1e-3, steps=64)


@pytest.fixture(scope="module")
def example():
    text, *_ = re.findall(r"```toml\n(.*?)```", GUIDE.read_text("utf-8"), re.DOTALL)
    return read_gear_set(text)


@pytest.fixture(scope="module")
def prepared(example, compliance_cache):
    tables = Excitations(ExcitationSettings(resolution="coarse", positions=64))
    reference = lumped_system(
        example, TORQUE, LumpedModel(number=1), excitations=tables
    )

    def make(fidelity):
        elements = FiniteElements(fidelity=fidelity, mesh=0.25)
        args = TORQUE, reference, SPEEDS, elements, SETTINGS, tables
        return prepare(example, *args).stepper

    return make


@pytest.mark.slow
def test_modes_and_all_freedoms_agree_from_rest(prepared):
    """From the inertia of a ring up to the reference circle the hub's is negative."""
    speed, steps = SPEEDS[1], 128
    deflections = []
    for fidelity in ("full", "reduced", "auto"):
        stepper = prepared(fidelity)
        size = 1.0 / (speed * steps)
        _, motion = stepper.integrate(
            stepper.start(), TimeSteps(speed, size, 3 * steps, steps)
        )
        deflections.append(motion.deflection[:, 0])
    full, *others = deflections
    for motion in others:
        assert np.sqrt(((motion - full) ** 2).mean()) < 0.06 * full.std()


def test_slow_motion_needs_no_elastic_inertia(prepared):
    still, *moving = (
        steady_state(prepared(fidelity), SPEEDS[0], SETTINGS)[0].dte_rms[0]
        for fidelity in ("quasistatic", "reduced", "auto")
    )
    assert moving == pytest.approx([still, still], rel=5e-3)


def light(gear_set, factor):
    """With so much of the body's inertia given to the first gear."""
    first, *others = gear_set.gears
    first = replace(first, inertia=factor * body_inertia(first))
    return replace(gear_set, gears=(first, *others))


@pytest.mark.parametrize("fidelity", ["full", "reduced", "auto"])
def test_less_inertia_than_the_elastic_body_has_is_refused(example, fidelity):
    elements = FiniteElements(fidelity=fidelity)
    never = None  # nothing is solved before
    with pytest.raises(InputError) as caught:
        prepare(light(example, 0.99), 120.0, never, [1e3], elements, SETTINGS, never)
    (line,) = str(caught.value).splitlines()
    assert 'my-pair: gear "pinion": inertia_kg_m2 = 0.000172929' in line
    assert "less than the 0.000174676 kg m2 of the body" in line
    for key in ("face_width_mm", "hub_radius_mm", "density_kg_per_m3"):
        assert key in line


def test_the_coupled_model_says_what_would_do_without(example):
    model = LumpedModel(number="coupled")
    with pytest.raises(InputError, match="without body counts none of it"):
        lumped_system(light(example, 0.99), 120.0, model)
    left_out = replace(model, without=("body",))
    assert lumped_system(light(example, 0.99), 120.0, left_out).contacts is not None


def test_inertia_as_it_is_printed_is_taken(example):
    gears = [replace(g, inertia=float(f"{inertia_of(g):.6g}")) for g in example.gears]
    require_inertia_of_bodies(replace(example, gears=tuple(gears)))


@pytest.mark.parametrize(
    "change", [{"density": 0.98 * 7850.0}, {"face_width": 0.98 * 20e-3}]
)
def test_a_lighter_body_fits_the_same_inertia(example, change):
    gear_set = light(example, 0.99)
    first, *others = gear_set.gears
    require_inertia_of_bodies(
        replace(gear_set, gears=(replace(first, **change), *others))
    )
