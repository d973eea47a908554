"""Motion through a ramp of the speed, beside other integrators and a closed form."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as checked
from hypothesis import strategies as st
from rim_gears import FIRM
from scipy.integrate import solve_ivp

from fegear.gearset import load_gear_set
from fegear.statics.excitation_settings import ExcitationSettings
from fegear.train.lumped_models import lumped_system
from fegear.train.model_settings import LumpedModel
from lumped import Settings, respond
from lumped.signals.coordinate_motion import coordinate_motion, ramp_pieces
from lumped.signals.sensors import signals_of_pieces
from lumped.steady import ramps
from lumped.steady.motion import bounded_response
from lumped.steady.ramps import SpeedRamp
from lumped.steady.steady_state import Speed
from lumped.steady.steppers import stepper_of, steps_per_period
from lumped.train.excitation import MeshExcitation, PairExcitation
from lumped.train.waves import constant_wave, wave_from_samples
from tests.oracles.chirped_oscillator import chirp_response

SETTLED = Settings(tolerance=1e-11, steps=64)


def pair(kind="trapezoid", error=0.0, damping=0.04):
    """The built-in pair by key figures, tooth 8 of its pinion set back [m]."""
    gears = load_gear_set("liu-pair")
    pitch = tuple(error * (tooth == 7) for tooth in range(38)) if error else ()
    first = replace(gears.gears[0], pitch_errors=pitch)
    gears = replace(gears, gears=(first, gears.gears[1]))
    source = ExcitationSettings(kind=kind)
    return lumped_system(
        gears, 100.0, LumpedModel(number=1, damping_ratio=damping, excitation=source)
    )


def through(system, ramp, steps, state, time):
    """Transmission error (t, m) at times through a ramp."""
    pieces = ramp_pieces(system, ramp, Settings(steps=steps, step_angle=2.0), state)
    signals, _ = signals_of_pieces(pieces, time, 0)
    meshes = range(1, 1 + len(system.train.meshes))
    return np.stack([signals[f"mesh{m}_dte_m"] for m in meshes], axis=1)


def integrated(system, ramp, state, time):
    """The transmission error (t, 1) by an integrator of another kind.

    Its steps end on the corners of the excitation.
    """
    arrays, excitation = system.arrays, system.excitation
    corners = np.concatenate([[0.0], excitation.corners()])
    edges = (np.arange(math.ceil(ramp.cycles))[:, None] + corners).ravel()
    edges = ramp.time_at(edges)
    edges = np.append(edges[edges < ramp.duration], ramp.duration)
    n = arrays.load.size

    def slope(t, y, low, high):
        inside = min(max(t, low + 1e-9 * (high - low)), high - 1e-9 * (high - low))
        cycles = ramp.start * inside + 0.5 * ramp.rate * inside**2
        stiffness, gap = (x[0] for x in excitation.evaluate(np.array([cycles])))
        q, v = y[:n], y[n:]
        (s,) = arrays.shapes @ q
        overlap = s - gap
        back = np.minimum(overlap + arrays.backlash[0], 0.0)
        force = (stiffness * (np.maximum(overlap, 0.0) + back)).sum()
        excess = force - arrays.mean_stiffness[0] * s
        a = arrays.load - arrays.damping * v - arrays.rigidity * q
        return np.concatenate([v, a - arrays.shapes[0] * excess])

    y, parts = state.ravel(), []
    for low, high in pairwise(edges):
        at = time[(time >= low) & (time < high)]
        solution = solve_ivp(
            *(slope, (low, high), y),
            t_eval=np.append(at, high),
            args=(low, high),
            method="DOP853",
            rtol=1e-9,
            atol=1e-16,
        )
        y = solution.y[:, -1]
        parts.append(solution.y[:n, :-1].T @ arrays.shapes.T)
    return np.concatenate(parts)


@pytest.mark.parametrize("ends", [(850.0, 1150.0), (1600.0, 1400.0)])
def test_a_ramp_is_as_another_integrator_says(ends):
    """Through resonances of harmonics 3 and 2, the first with loss of contact."""
    system = pair(damping=0.02)
    ramp = SpeedRamp(start=ends[0], end=ends[1], duration=0.015)
    state = respond(system, ramp.start, SETTLED).state
    time = np.linspace(0.0, ramp.duration, 1501)[:-1]
    expected = integrated(system, ramp, state, time)
    errors = [
        np.abs(through(system, ramp, steps, state, time) - expected).max()
        / np.ptp(expected)
        for steps in (128, 2048)
    ]
    assert errors[1] < 1e-5
    assert errors[0] > 16.0 * errors[1]


HARMONIC = 2.0 * np.pi * np.arange(1024) / 1024


def linear_pair(damping):
    """A pair of constant stiffness, excited by a cosine of 0.1 um: no loss of contact.

    Also its natural angular frequency and its mean deflection.
    """
    system = pair()
    stiffness = system.excitations[0].mean_stiffness
    gap = wave_from_samples(1e-7 * np.cos(HARMONIC))
    spring = PairExcitation(constant_wave(stiffness), gap)
    system = replace(
        system,
        train=replace(system.train, damping_ratio=damping),
        excitations=(MeshExcitation((spring,), stiffness),),
    )
    (angular,) = np.sqrt(system.arrays.rigidity)
    return system, angular, float(system.static_deflection[0])


def test_the_closed_form_of_a_chirp_solves_its_equation():
    time = np.linspace(0.0, 30.0, 400)
    for a, b in ((1.5, 0.1), (5.0, -0.06)):
        solution = solve_ivp(
            lambda t, y, a=a, b=b: [
                y[1],
                9.0 * (math.cos(a * t + b * t * t) - y[0]) - 6.0 * 0.05 * y[1],
            ],
            *((0.0, 30.0), [0.3, -1.0]),
            t_eval=time,
            rtol=1e-11,
            atol=1e-12,
        )
        closed = chirp_response(time, 3.0, 0.05, (a, b), np.array([0.3, -1.0]))
        np.testing.assert_allclose(closed, solution.y[0], atol=1e-8)


@pytest.mark.parametrize("rising", [True, False])
def test_a_run_through_resonance_is_that_of_the_closed_form(rising):
    """The largest amplitude comes late and is less than that of the steady state."""
    system, angular, mean = linear_pair(0.01)
    natural = angular / (2.0 * math.pi)
    ends = (0.85 * natural, 1.25 * natural)[:: 1 if rising else -1]
    ramp = SpeedRamp(start=ends[0], end=ends[1], duration=0.12)
    state = respond(system, ramp.start, replace(SETTLED, steps=512)).state
    time = np.linspace(0.0, ramp.duration, 6001)[:-1]
    shape = system.arrays.shapes[0]
    start = np.array([shape @ state[0] - mean, shape @ state[1]])
    chirp = 2.0 * math.pi * ramp.start, math.pi * ramp.rate
    expected = 1e-7 * chirp_response(time, angular, 0.01, chirp, 1e7 * start)
    errors = []
    for steps in (128, 256):
        moved = through(system, ramp, steps, state, time)[:, 0] - mean
        errors.append(np.abs(moved - expected).max() / np.abs(expected).max())
    assert errors[0] < 1e-5
    assert errors[0] > 10.0 * errors[1]  # of fourth order
    peak = np.abs(moved).argmax()
    late = float(ramp.frequency_at(time[peak])) / natural - 1.0
    assert 0.01 < (late if rising else -late) < 0.1
    assert np.abs(moved).max() < 0.9 * 1e-7 / (2.0 * 0.01)


def test_a_slow_ramp_tends_to_the_steady_state():
    system, middle, errors = pair(), 1250.0, []
    steady = respond(system, middle, SETTLED)
    for change in (100.0, 25.0):
        ends = {"start": middle - change, "end": middle + change}
        ramp = SpeedRamp(**ends, duration=0.08)
        state = respond(system, ramp.start, SETTLED).state
        cycles = round(0.5 * ramp.cycles) + np.arange(-256, 256) / 512
        dte = through(system, ramp, 256, state, ramp.time_at(cycles))
        errors.append(abs(dte.std() / steady.dte_rms[0] - 1.0))
    assert errors[1] < 2e-3
    assert errors[0] > 2.0 * errors[1]


@pytest.mark.parametrize("steps", [64, 10])
def test_a_ramp_of_constant_speed_is_the_steady_state(steps, monkeypatch):
    """Whatever the length of pieces; with a tooth that differs."""
    monkeypatch.setattr(ramps, "STEPS_PER_BLOCK", 100)
    system, frequency = pair("rectangular", error=2e-6), 700.0
    settings = Settings(tolerance=1e-11, steps=steps, step_angle=2.0)
    response, _, _ = bounded_response(system, frequency, settings)
    stepper, speed = stepper_of(system, settings), Speed(frequency, settings)
    _, history = stepper.record(response.state, speed, response.multiple, True)
    ramp = SpeedRamp(start=frequency, end=frequency, duration=90.5 / frequency)
    time = np.linspace(0.0, ramp.duration, 3001)
    (expected,) = (
        signals_of_pieces([coordinate_motion(system, history)], time, 0)[0][name]
        for name in ("mesh1_dte_m",)
    )
    moved = through(system, ramp, steps, response.state, time)[:, 0]
    np.testing.assert_allclose(moved, expected, atol=1e-8 * np.ptp(expected))


def test_the_coupled_model_of_rigid_bodies_is_model_1_through_a_ramp():
    """Its speed is constant within a cycle: of first order in the ramp's rate."""
    case = replace(FIRM, damping=0.02)
    errors = []
    for end in (1100.0, 1025.0):
        ramp = SpeedRamp(start=1000.0, end=end, duration=0.05)
        time = np.linspace(0.0, ramp.duration, 2001)
        both = []
        for system in (case.model_1, case.coupled):
            settings = Settings(steps=512, tolerance=1e-10, step_angle=2.0)
            state = respond(system, 1000.0, settings).state
            both.append(through(system, ramp, 512, state, time))
        errors.append(np.abs(both[1] - both[0]).max() / np.ptp(both[0]))
    assert errors[0] < 2e-3
    assert errors[0] > 2.0 * errors[1]


@given(
    st.floats(10.0, 1e4),
    st.floats(10.0, 1e4),
    st.floats(1e-3, 1e3),
    st.floats(0.0, 1.0),
)
@checked(max_examples=200, deadline=None)
def test_times_and_cycles_are_each_others_inverse(start, end, duration, part):
    ramp = SpeedRamp(start=start, end=end, duration=duration)
    cycles = np.array([part * ramp.cycles])
    time = ramp.time_at(cycles)
    np.testing.assert_allclose(ramp.cycles_at(time), cycles, rtol=1e-9, atol=1e-12)
    assert -1e-12 <= time[0] <= duration * (1.0 + 1e-9)
    assert ramp.cycles_at(np.array(duration)) == pytest.approx(ramp.cycles)
    assert ramp.frequency_at(np.array(duration)) == pytest.approx(end)


@pytest.mark.parametrize("name", ["start", "end", "duration"])
@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
def test_a_ramp_of_no_speed_or_time_is_refused(name, value):
    with pytest.raises(ValueError, match=name):
        SpeedRamp(**({"start": 1.0, "end": 2.0, "duration": 1.0} | {name: value}))


def test_a_ramp_that_ends_near_standstill_has_finite_times():
    system = pair("rectangular")
    ramp = SpeedRamp(start=900.0, end=1.0, duration=0.05)
    state = respond(system, ramp.start, SETTLED).state
    time = np.linspace(0.0, ramp.duration, 200)
    dte = through(system, ramp, 64, state, time)
    assert np.isfinite(dte).all()
    # with the teeth almost at rest, the deflection is that of a spring of the table
    stiffness, _ = system.excitation.evaluate(np.array([ramp.cycles]))
    force = system.static_deflection[0] * system.excitations[0].mean_stiffness
    assert dte[-1, 0] == pytest.approx(force / stiffness.sum(), rel=0.05)
    assert steps_per_period(system, 1.0, Settings()) > 1000
