"""Motions of assemblies beside integration step by step and the one equation."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from lumped.rattle.assembly import Absorber, Assembly, Shafts, SprungGear
from lumped.rattle.impulses import impulse_rattle
from lumped.rattle.machine import Machine
from lumped.rattle.motions import AssemblyIntegrator
from lumped.rattle.noise import measure_noise, measure_noise_of_parts
from lumped.rattle.periodic_orbits import min_eccentricity, simple_rattle
from lumped.rattle.permanent_contact import quiet_motion
from lumped.rattle.return_map import follow

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
    t, rotations, met = 0.0, [], []
    while t < turns:
        inside = times[(times >= t) & (times <= turns)]
        solution = solve_ivp(
            *(rates, (t, turns), state, "DOP853"),
            events=events,
            dense_output=True,
            rtol=1e-11,
            atol=1e-12,
            max_step=2e-2,
        )
        t = solution.t[-1]
        rotations += [relative(s, solution.sol(s)) for s in inside[inside <= t]]
        state = solution.y[:, -1].copy()
        if solution.status == 1:
            wave = TURN * m.eccentricity * math.sin(TURN * t)
            w = linear.row @ state[n:] - wave
            met.append(w)
            if m.is_impact:
                loss = (1.0 + m.restitution) * w / (linear.row @ soft)
                state[n:] -= loss * soft
            else:  # past the event, which would be found again
                t += 1e-9
                state = solution.sol(t)
    return np.array(rotations), np.array(met)


@pytest.mark.parametrize("stiffness", [900.0, math.inf])
def test_parts_move_as_step_by_step(stiffness):
    assembly = Assembly(machine=replace(SCALED, stiffness=stiffness), **PARTS)
    motions = AssemblyIntegrator(assembly)
    state = motions.settled(0.2, 3.0)
    times = np.linspace(0.0, 3.0, 61)
    rotation, met = step_by_step(assembly, state, 3.0, times)
    run = motions.run(state, 0.0, 3.0, times)
    np.testing.assert_allclose(run.rotation, rotation, atol=2e-6)
    assert run.noise == pytest.approx((met**2).sum() / 3.0, rel=1e-5)
    assert (run.upper, run.lower) == ((met > 0).sum(), (met < 0).sum())


@pytest.mark.parametrize("stiffness", [2000.0, math.inf])
def test_equal_shafts_move_by_their_one_equation(stiffness):
    machine = replace(SCALED, stiffness=stiffness, restitution=1.0)
    motions = AssemblyIntegrator(Assembly(machine=machine))
    path = follow(machine, np.array([0.0, 1.3]), 6)
    state = motions.settled(0.6, -1.3)
    ends = path[-1, 0] + 1e-6
    run = motions.run(state, 0.0, ends, np.array([ends]))
    assert run.upper == 5
    assert run.lower == path[:-1, 2].sum()
    assert run.rotation == pytest.approx(0.6 - path[-1, 1] * 1e-6, abs=1e-7)


def test_flanks_that_stay_together_make_no_noise():
    machine = replace(SCALED, ripple=0.0, eccentricity=0.02, stiffness=900.0)
    motions = AssemblyIntegrator(Assembly(machine=machine))
    state = motions.settled(0.55, 0.0)
    assert motions.run(state, 0.0, 50.0).upper > 0
    assert motions.run(state, 40.0, 50.0).is_quiet


def test_flanks_come_to_rest_in_impacts_and_part_where_the_load_ends():
    """Below the critical eccentricity for good, above it until the load is 0."""
    machine = replace(SCALED, ripple=0.0, restitution=0.5)
    limit = quiet_motion(Assembly(machine=machine, **PARTS)).critical_eccentricity
    for factor, quiet in ((0.97, True), (1.03, False)):
        scaled_machine = replace(machine, eccentricity=factor * limit)
        motions = AssemblyIntegrator(Assembly(machine=scaled_machine, **PARTS))
        run = motions.run(motions.settled(0.59, 0.01), 60.0, 70.0)
        assert run.is_quiet is quiet
        assert math.isfinite(run.noise)


@pytest.mark.parametrize(("restitution", "eccentricity"), [(0.0, 0.4), (0.3, 0.2)])
def test_flanks_that_rest_in_every_turn_are_as_loud_as_by_one_equation(
    restitution, eccentricity
):
    machine = replace(
        SCALED, ripple=0.0, restitution=restitution, eccentricity=eccentricity
    )
    starts = np.array([[0.1, 1.0], [0.6, 2.5]])
    alone = measure_noise(machine, starts, 300, 50)
    parts = measure_noise_of_parts(Assembly(machine=machine), starts, 100, 50)
    np.testing.assert_allclose(parts.level, alone.level, rtol=1e-6)
    assert [attractor.name for attractor in parts.attractors] == ["single-sided rattle"]


def test_flights_that_fade_away_are_quiet():
    """In impacts without losses; flanks meet ever more often and never rest. Seen as
    motions, of which nothing is left out, they come closer to the flank."""
    machine = replace(SCALED, ripple=0.0)
    limit = quiet_motion(Assembly(machine=machine, **PARTS)).critical_eccentricity
    scaled_machine = replace(machine, eccentricity=0.1 * limit)
    motions = AssemblyIntegrator(Assembly(machine=scaled_machine, **PARTS))
    times = np.linspace(0.0, 14.0, 14 * 400 + 1)
    for rotation, speed in ((0.59, 0.1), (0.6, 0.4), (0.55, 0.2)):
        state = motions.settled(rotation, -speed)
        assert motions.run(state, 0.0, 14.0).is_quiet
        run = motions.run(state, 0.0, 14.0, times)
        assert run.noise > 0.0
        away = 0.6 - run.rotation[:-1].reshape(14, 400).min(axis=1)
        assert (np.diff(away[4:]) < 0.0).all()
        assert away[-1] < 0.1 * away[0]
    scaled_machine = replace(machine, eccentricity=1.05 * limit)
    motions = AssemblyIntegrator(Assembly(machine=scaled_machine, **PARTS))
    assert not motions.run(motions.settled(0.6, -1e-3), 0.0, 14.0).is_quiet


def test_a_gear_without_inertia_is_refused():
    light = Assembly(machine=SCALED, driving_gear=SprungGear(stiffness=3.0))
    with pytest.raises(ValueError, match="inertia above 0"):
        AssemblyIntegrator(light)


def test_an_ensemble_is_its_motions_one_by_one():
    motions = AssemblyIntegrator(ALL)
    states = np.array([motions.settled(x, 2.0) for x in (-0.3, 0.0, 0.4)])
    together = motions.run_all(states, 5.0, 20.0)
    alone = [motions.run(state, 5.0, 20.0) for state in states]
    assert [run.noise for run in together] == [run.noise for run in alone]


@pytest.mark.parametrize("restitution", [1.0, 0.6])
@pytest.mark.parametrize("turns", [1, 3])
def test_equal_shafts_rattle_as_constructed(restitution, turns):
    machine = replace(
        SCALED, ripple=0.0, restitution=restitution, eccentricity=1.5, half_backlash=3.0
    )
    rattle = impulse_rattle(AssemblyIntegrator(Assembly(machine=machine)), turns)
    exact = simple_rattle(machine, turns)
    assert rattle.times == pytest.approx([motion.time for motion in exact], rel=1e-9)
    assert rattle.velocity == pytest.approx(exact[0].velocity, rel=1e-9)
    least = min_eccentricity(machine, turns)
    assert rattle.min_eccentricity == pytest.approx(least, rel=1e-9)


@pytest.mark.parametrize("eta", [0.0, 0.3, -0.6])
def test_unequal_shafts_rattle_from_eq_4_88_on(eta):
    """delta^2 m^2 (1 + eta^2) / (6 (1 - eta^2)^2) to the leading order, as derived."""
    shafts = Shafts(driving_inertia=1.0 + eta, driven_inertia=1.0 - eta)
    machine = replace(SCALED, ripple=0.0, damping=0.01)
    rattle = impulse_rattle(
        AssemblyIntegrator(Assembly(machine=machine, shafts=shafts)), 2
    )
    leading = 0.01**2 * 4.0 * (1.0 + eta**2) / (6.0 * (1.0 - eta**2) ** 2)
    assert rattle.min_eccentricity == pytest.approx(leading, rel=1e-3)


OF_PARTS = [
    {"shafts": Shafts(driving_inertia=1.5, driven_inertia=0.8, driven_drag=1.2)},
    {"driving_gear": SprungGear(stiffness=2.0, inertia=1.0, damping=0.3)},
]


@pytest.mark.parametrize("parts", OF_PARTS, ids=lambda parts: next(iter(parts)))
def test_machines_in_parts_rattle_as_constructed(parts):
    machine = replace(SCALED, ripple=0.0, restitution=0.7, half_backlash=9.0)
    least = impulse_rattle(AssemblyIntegrator(Assembly(machine=machine, **parts)))
    machine = replace(machine, eccentricity=1.05 * least.min_eccentricity)
    motions = AssemblyIntegrator(Assembly(machine=machine, **parts))
    rattle = impulse_rattle(motions)
    assert len(rattle.times) == 2
    for time in rattle.times:
        times = time + np.linspace(0.0, 2.0, 41)
        state = rattle.state(time)
        motion = motions.run(state, time, time + 2.0 - 1e-6, times, start=time)
        rotation = motion.rotation[:-1]
        assert (motion.upper, motion.lower) == (1, 0)
        np.testing.assert_allclose(rotation[:20], rotation[20:], atol=1e-9)
        assert motion.noise * 2.0 == pytest.approx(
            (rattle.velocity / 0.7) ** 2, rel=1e-5
        )
