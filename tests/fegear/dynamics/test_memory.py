"""What all freedoms of the gears need is known before memory runs out."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

from fegear.dynamics import memory
from fegear.dynamics.build import FiniteElements, prepare
from fegear.dynamics.memory import full_bytes, require_memory
from fegear.dynamics.stepper import DynamicSettings, TimeSteps
from fegear.files.errors import InputError
from fegear.gearset import load_gear_set
from fegear.statics.excitation import Excitations
from fegear.statics.excitation_settings import ExcitationSettings
from fegear.train.lumped_models import lumped_system
from fegear.train.model_settings import LumpedModel

FULL = FiniteElements(fidelity="full", mesh=0.35)


@pytest.fixture(scope="module")
def made(compliance_cache):
    """Prepares a gear set at 100 N m."""
    tables = Excitations(ExcitationSettings(resolution="coarse", positions=64))

    def make(name):
        gear_set = load_gear_set(name)
        system = lumped_system(
            gear_set, 100.0, LumpedModel(number=1), excitations=tables
        )
        args = system, [1000.0], FULL, DynamicSettings(), tables
        return prepare(gear_set, 100.0, *args)

    return make


def integrated(prepared):
    """State after a few steps of three lengths."""
    stepper = prepared.stepper
    state = stepper.start()
    for size in 1e-5 * np.array([1.0, 1.1, 1.2]):
        state, _ = stepper.integrate(state, TimeSteps(1000.0, size, 3, 100))
    return state


@pytest.mark.slow
@pytest.mark.parametrize("name", ["liu-pair", "liu-idler"])
def test_estimate_is_above_what_is_used_and_near_it(made, monkeypatch, name):
    estimates = []
    monkeypatch.setattr(
        "fegear.dynamics.build.full_bytes",
        lambda *args: estimates.append(full_bytes(*args)) or estimates[-1],
    )
    integrated(made(name))  # what is loaded and compiled once is not counted
    tracemalloc.start()
    integrated(made(name))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert 0.3 * estimates[-1] < peak < estimates[-1]


def test_too_little_memory_is_one_line_with_both_figures(made, monkeypatch):
    monkeypatch.setattr(memory, "available_bytes", lambda: 12.34e6)
    with pytest.raises(InputError) as caught:
        made("liu-pair")
    (line,) = str(caught.value).splitlines()
    assert line.startswith("liu-pair: fidelity full needs 0.0")
    assert "0.01 GB are available; fidelity reduced" in line


def test_what_is_there_is_enough(monkeypatch):
    gear_set = load_gear_set("liu-pair")
    monkeypatch.setattr(memory, "available_bytes", lambda: 1e9)
    require_memory(gear_set, 1e9)
    with pytest.raises(InputError, match=r"needs 1.01 GB .* 1 GB are available"):
        require_memory(gear_set, 1.0001e9)
