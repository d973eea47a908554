"""Noise levels beside closed forms, and chances that are those of basins."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from fegear.commands.rattle.noise import proportion_limits
from lumped.figures.rattle import draw_noise
from lumped.rattle.assembly import Assembly
from lumped.rattle.machine import Machine
from lumped.rattle.motions import AssemblyIntegrator, AssemblyRun
from lumped.rattle.noise import (
    measure_noise,
    measure_noise_of_parts,
    random_initial_conditions,
)
from lumped.rattle.orbits import find_orbits
from lumped.rattle.periodic_orbits import simple_rattle
from lumped.rattle.return_map import follow

FIGURES = {"eccentricity": 0.1, "half_backlash": 0.6}
SPEEDS = 0.0, 7.0


@pytest.mark.parametrize("stiffness", [math.inf, 1e7])
def test_motions_are_as_loud_as_their_impacts(stiffness):
    """Without meetings of the lower flank they are at the speeds of departure; those
    of simple rattle are known in closed form."""
    machine = Machine(damping=0.575, stiffness=stiffness, **FIGURES)
    starts = random_initial_conditions(200, SPEEDS, 3)
    noise = measure_noise(machine, starts, 1499, 300)
    numbers = {attractor.name: i for i, attractor in enumerate(noise.attractors)}
    assert {"quiet", "P(1,1,0)", "P(1,2,0)"} <= numbers.keys()
    for name, count in (("P(1,1,0)", 1), ("P(1,2,0)", 2)):
        mask = noise.motion == numbers[name]
        point = noise.attractors[numbers[name]].point
        speeds = follow(machine, point, count)[:, 1]
        lost = 1e-7 if math.isinf(stiffness) else 1e-3  # while flanks are pressed
        np.testing.assert_allclose(noise.level[mask], np.sum(speeds**2), rtol=lost)
        np.testing.assert_allclose(noise.impacts[mask], count, rtol=1e-9)
    assert (noise.level[noise.motion == numbers["quiet"]] == 0.0).all()
    (rattle,) = [
        e for e in simple_rattle(replace(machine, stiffness=math.inf)) if e.in_phase
    ]
    simple = noise.level[noise.motion == numbers["P(1,1,0)"]]
    np.testing.assert_allclose(simple, rattle.velocity**2, rtol=2e-2)


@pytest.mark.parametrize("turns", [1, 7, 201])
def test_noise_is_of_whole_periods(turns):
    """Of P(2,2,1), and with three meetings in two turns."""
    machine = Machine(damping=0.575, **FIGURES)
    starts = random_initial_conditions(200, SPEEDS, 3)
    noise = measure_noise(machine, starts, 1499, turns)
    (number,) = [i for i, e in enumerate(noise.attractors) if e.name == "P(2,2,1)"]
    mask = noise.motion == number
    assert mask.any()
    np.testing.assert_allclose(noise.impacts[mask], 1.5, rtol=1e-7)
    (orbit,) = [e for e in find_orbits(machine, 2, SPEEDS) if e.name == "P(2,2,1)"]
    speeds = [speed for _, speed in orbit.departures]
    path = lower_speeds(machine, orbit.departures)
    exact = 0.5 * float(np.sum(np.square(speeds)) + np.sum(np.square(path)))
    np.testing.assert_allclose(noise.level[mask], exact, rtol=1e-7)


def lower_speeds(machine: Machine, departures) -> list[float]:
    """At which arcs from departures meet the lower flank before the upper one, by the
    solution of eq. 2.28 on a fine grid of times."""
    speeds = []
    for start, speed in departures:
        t = start + np.linspace(0.0, 2.0, 200_001)[1:]
        drift, e = 4.0 * math.pi, machine.eccentricity
        wave = drift * t + e * np.cos(2.0 * math.pi * t)
        first = drift * start + e * math.cos(2.0 * math.pi * start)
        rate = drift - 2.0 * math.pi * e * np.sin(2.0 * math.pi * t)
        free_speed = (
            -speed - drift + 2.0 * math.pi * e * math.sin(2.0 * math.pi * start)
        )
        fade = np.exp(-machine.damping * (t - start))
        x = 0.6 + wave - first + free_speed * (1.0 - fade) / machine.damping
        v = rate + free_speed * fade
        met = int(np.argmax(np.abs(x) > 0.6))
        if x[met] < 0.0:
            part = (-0.6 - x[met - 1]) / (x[met] - x[met - 1])
            speeds.append(float(v[met - 1] + part * (v[met] - v[met - 1])))
    return speeds


def test_slow_transients_are_not_measured():
    """Of P(5,6,3), which attracts by 0.7 % a turn: its noise is that of the last six
    departures of very many."""
    machine = Machine(damping=0.6, eccentricity=0.5, half_backlash=0.6, restitution=0.5)
    noise = measure_noise(machine, random_initial_conditions(50, SPEEDS, 3), 1499, 100)
    assert [attractor.name for attractor in noise.attractors] == ["P(5,6,3)"]
    assert (noise.motion == 0).all()
    last = follow(machine, (0.3, 2.0), 60_000)[-6:]
    upper, lower = last[:, 1] / 0.5, lower_speeds(machine, last[:, :2])
    assert len(lower) == 3
    exact = (np.sum(upper**2) + np.sum(np.square(lower))) / 5.0
    np.testing.assert_allclose(noise.level, exact, rtol=1e-7)
    np.testing.assert_allclose(noise.impacts, 9.0 / 5.0, rtol=1e-9)


def test_runs_that_are_not_clear_have_no_noise():
    machine = Machine(damping=0.02, **FIGURES)
    noise = measure_noise(machine, random_initial_conditions(5, SPEEDS, 3), 100, 20)
    assert (noise.motion == -1).any()
    unclear = noise.motion == -1
    assert np.isnan(noise.level[unclear]).all()
    assert np.isnan(noise.impacts[unclear]).all()


def test_runs_are_made_again_by_their_seed():
    one, again, other = (
        random_initial_conditions(50, SPEEDS, seed) for seed in (4, 4, 5)
    )
    np.testing.assert_array_equal(one, again)
    assert not np.array_equal(one, other)
    assert ((one >= [0.0, 0.0]) & (one <= [1.0, 7.0])).all()


def test_limits_of_a_proportion_hold_it():
    """Beside many draws."""
    random = np.random.default_rng(1)
    for chance in (0.02, 0.5):
        inside = []
        for seen in random.binomial(200, chance, 4000):
            low, high = proportion_limits(int(seen), 200)
            inside.append(low <= chance <= high)
        assert np.mean(inside) == pytest.approx(0.95, abs=0.03)


def test_runs_whose_meetings_are_not_found_have_no_figures(monkeypatch):
    lost = AssemblyRun(math.nan, 3, 0, np.empty(0))
    monkeypatch.setattr(AssemblyIntegrator, "run", lambda *args, **options: lost)
    assembly = Assembly(machine=Machine(damping=0.6, **FIGURES))
    noise = measure_noise_of_parts(
        assembly, random_initial_conditions(3, SPEEDS, 1), 9, 9
    )
    assert np.isnan(noise.impacts).all()
    assert not noise.attractors
    assert (noise.motion == -1).all()
    (axes,) = draw_noise(noise, "a machine").axes
    assert "no attractor" in axes.texts[0].get_text()
