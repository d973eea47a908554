"""Motions of assemblies beside integration step by step and the one equation."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from lumped.rattle.assembly import Absorber, Assembly, Shafts, SprungGear
from lumped.rattle.departures import follow
from lumped.rattle.machine import Machine
from lumped.rattle.motions import Motions

TURN = 2.0 * math.pi
SCALED = Machine(damping=0.6, eccentricity=0.1, half_backlash=0.6, ripple=0.3)
SPRUNG = SprungGear(stiffness=30.0, inertia=0.3, damping=0.1)
PARTS = {
    "shafts": Shafts(driven_inertia=1.4, driven_drag=0.7),
    "driving_gear": SPRUNG,
    "absorber": Absorber(mass=0.05, pivot_radius=0.4, path_radius=0.5, damping=0.01),
}
ALL = Assembly(machine=replace(SCALED, stiffness=900.0), **PARTS)


def step_by_step(assembly: Assembly, state, turns: float, times):
    """Relative rotation (t,), and speeds at which flanks met, by the equations."""
    linear, m = assembly.linear(), assembly.machine
    n = len(linear.names)
    soft = np.linalg.solve(linear.mass, linear.row)

    def relative(t, u):
        return linear.row @ u[:n] + m.eccentricity * math.cos(TURN * t)

    def rates(t, u):
        x = relative(t, u)
        beyond = math.copysign(max(abs(x) - m.half_backlash, 0.0), x)
        load = 0.0 if m.is_impact else m.stiffness * beyond
        phase = np.exp(1j * TURN * m.ripple_order * t)
        force = linear.mean + (linear.ripple * phase).real - linear.row * load
        force = force - linear.damping @ u[n:] - linear.stiffness @ u[:n]
        return np.concatenate([u[n:], np.linalg.solve(linear.mass, force)])

    events = [lambda t, u, s=s: s * relative(t, u) - m.half_backlash for s in (1, -1)]
    for event in events:
        event.direction, event.terminal = 1.0, True
    t, found, met = 0.0, [], []
    while t < turns:
        inside = times[(times >= t) & (times <= turns)]
        way = solve_ivp(
            *(rates, (t, turns), state, "DOP853"),
            events=events,
            dense_output=True,
            rtol=1e-11,
            atol=1e-12,
            max_step=2e-2,
        )
        t = way.t[-1]
        found += [relative(s, way.sol(s)) for s in inside[inside <= t]]
        state = way.y[:, -1].copy()
        if way.status == 1:
            wave = TURN * m.eccentricity * math.sin(TURN * t)
            w = linear.row @ state[n:] - wave
            met.append(w)
            if m.is_impact:
                loss = (1.0 + m.restitution) * w / (linear.row @ soft)
                state[n:] -= loss * soft
            else:  # past the event, which would be found again
                t += 1e-9
                state = way.sol(t)
    return np.array(found), np.array(met)


@pytest.mark.parametrize("stiffness", [900.0, math.inf])
def test_parts_move_as_step_by_step(stiffness):
    assembly = Assembly(machine=replace(SCALED, stiffness=stiffness), **PARTS)
    motions = Motions(assembly)
    state = motions.settled(0.2, 3.0)
    times = np.linspace(0.0, 3.0, 61)
    rotation, met = step_by_step(assembly, state, 3.0, times)
    found = motions.run(state, 0.0, 3.0, times)
    np.testing.assert_allclose(found.rotation, rotation, atol=2e-6)
    assert found.noise == pytest.approx((met**2).sum() / 3.0, rel=1e-5)
    assert (found.upper, found.lower) == ((met > 0).sum(), (met < 0).sum())


@pytest.mark.parametrize("stiffness", [2000.0, math.inf])
def test_equal_shafts_move_by_their_one_equation(stiffness):
    machine = replace(SCALED, stiffness=stiffness, restitution=1.0)
    motions = Motions(Assembly(machine=machine))
    path = follow(machine, np.array([0.0, 1.3]), 6)
    state = motions.settled(0.6, -1.3)
    ends = path[-1, 0] + 1e-6
    found = motions.run(state, 0.0, ends, np.array([ends]))
    assert found.upper == 5
    assert found.lower == path[:-1, 2].sum()
    assert found.rotation == pytest.approx(0.6 - path[-1, 1] * 1e-6, abs=1e-7)


def test_flanks_that_stay_together_make_no_noise():
    machine = replace(SCALED, ripple=0.0, eccentricity=0.02, stiffness=900.0)
    motions = Motions(Assembly(machine=machine))
    found = motions.run(motions.settled(0.55, 0.0), 40.0, 50.0)
    assert found.is_quiet
    assert found.upper > 0


def test_flanks_that_come_to_rest_in_impacts_are_told():
    machine = replace(SCALED, ripple=0.0, eccentricity=0.02, restitution=0.5)
    motions = Motions(Assembly(machine=machine))
    assert math.isnan(motions.run(motions.settled(0.5, 0.1), 0.0, 50.0).noise)


def test_a_gear_without_inertia_is_refused():
    light = Assembly(machine=SCALED, driving_gear=SprungGear(stiffness=3.0))
    with pytest.raises(ValueError, match="inertia above 0"):
        Motions(light)


def test_an_ensemble_is_its_motions_one_by_one():
    motions = Motions(ALL)
    states = np.array([motions.settled(x, 2.0) for x in (-0.3, 0.0, 0.4)])
    together = motions.run_all(states, 5.0, 20.0)
    alone = [motions.run(state, 5.0, 20.0) for state in states]
    assert [each.noise for each in together] == [each.noise for each in alone]
