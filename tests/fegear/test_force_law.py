"""Quasi-static fidelity: the contact law, its statics and its motion."""

from __future__ import annotations

import numpy as np
import pytest

import fegear.force_law as module
from fegear.excitation import Excitations
from fegear.force_law import LawExcitations
from fegear.gearset import load_gear_set
from fegear.train import train_of
from lumped import LumpedSystem, Settings, respond_with_history

SLOW = 1.0  # Hz, far below the lowest mode


@pytest.fixture(scope="module")
def laws(private_cache):
    return LawExcitations(Excitations())


def static_deflection(excitation, position, force):
    """Deflection [m] at which the springs carry a force, by bisection."""
    k = np.array([pair.stiffness(position) for pair in excitation.pairs])
    g = np.array([pair.gap(position) for pair in excitation.pairs])
    low, high = np.zeros(position.size), np.full(position.size, 1e-4)
    for _ in range(60):
        middle = 0.5 * (low + high)
        carried = (k * np.maximum(middle - g, 0.0)).sum(axis=0)
        low = np.where(carried < force, middle, low)
        high = np.where(carried < force, high, middle)
    return high


RELIEFS = {f"mesh.{m}.tip_relief.magnitude_um": 8 for m in (1, 2)}


@pytest.mark.parametrize("edits", [{}, RELIEFS], ids=["plain", "relieved"])
def test_statics_of_the_law_are_those_of_the_table(laws, edits):
    gear_set = load_gear_set("liu-pair", {k: v for k, v in edits.items() if ".1." in k})
    table = laws.excitations.table(gear_set, 0, 100.0)
    force = 100.0 / gear_set.meshes[0].pair.driver.base_radius
    found = static_deflection(laws.of(gear_set, 0, 100.0), table.position, force)
    error = np.abs(found / table["ste_m"][0] - 1.0)
    assert np.median(error) < 3e-4
    assert error.max() < 3e-3  # where a corner comes into contact


def test_chords_err_with_the_square_of_their_length(laws, monkeypatch):
    gear_set = load_gear_set("liu-pair")
    table = laws.excitations.table(gear_set, 0, 100.0)
    force = 100.0 / gear_set.meshes[0].pair.driver.base_radius
    errors = []
    for fine in (0.2, 0.1):
        monkeypatch.setattr(module, "FINE", fine)
        # shifted by half a chord, so that no deflection meets a corner
        half = force * 0.9
        found = static_deflection(laws.of(gear_set, 0, 100.0), table.position, half)
        monkeypatch.setattr(module, "FINE", 0.0125)
        exact = static_deflection(laws.of(gear_set, 0, 100.0), table.position, half)
        errors.append(np.median(np.abs(found / exact - 1.0)))
    assert errors[1] < 0.5 * errors[0]
    assert errors[1] < 1e-3


def test_slow_motion_is_static(laws):
    """Where no corner strikes, which rings even at this speed."""
    gear_set = load_gear_set("liu-pair")
    system = LumpedSystem(
        train_of(gear_set, 100.0, damping_ratio=0.2), (laws.of(gear_set, 0, 100.0),)
    )
    _, history = respond_with_history(system, SLOW, Settings(steps=512))
    table = laws.excitations.table(gear_set, 0, 100.0)
    x = table.position
    found = np.interp(x, history.time * SLOW, history.deflection[:, 0])
    error = np.abs(found / table["ste_m"][0] - 1.0)
    assert np.median(error) < 5e-4
    assert np.quantile(error, 0.9) < 2e-3


def test_dynamic_stiffness_exceeds_the_average_one(laws):
    """Contact stiffens with load, so that resonances lie above those of Model-1."""
    gear_set = load_gear_set("liu-idler")
    law = laws.of(gear_set, 0, 100.0)
    table = laws.excitations.table(gear_set, 0, 100.0)
    x, ste = table.position, table["ste_m"][0]
    slope = sum(p.stiffness(x) * (p.gap(x) < ste) for p in law.pairs)
    average = table["stiffness_N_per_m"][0]
    assert 1.01 < slope.mean() / average.mean() < 1.08
    np.testing.assert_allclose(
        slope.mean(), table["local_stiffness_N_per_m"][0].mean(), rtol=1e-2
    )
