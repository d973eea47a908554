"""One contract for all models and methods, and the exact motion as their judge."""

from __future__ import annotations

import math
import sys
from dataclasses import replace

import numpy as np
import pytest
from oracles import linear_train, piecewise
from oracles.linear_train import LinearTrain, Tone
from oracles.piecewise import Disk, PiecewiseTrain, Toothing

from lumped import (
    Gear,
    LumpedSystem,
    Mesh,
    MeshExcitation,
    PairExcitation,
    Settings,
    Shaft,
    Status,
    Train,
    analytic_excitation,
    respond,
    respond_with_history,
    sweep,
    sweep_all,
)
from lumped.steady.response import RESPONSE_QUANTITIES
from lumped.steady.steady_state import periods_to_settle
from lumped.steady.steppers import steps_per_period
from lumped.train.bodies import TrainError
from lumped.train.waves import constant_wave, wave_from_harmonics

MODELS = (1, 2, 3)
METHODS = ("rk4", "dopri5")
RADII = np.array([0.04535, 0.06564, 0.11218])  # m, Table 2.1
INERTIAS = np.array([0.002621, 0.01091, 0.1193])  # kg m2
COUPLINGS = np.array([3389.6, 0.0, 11297.9])  # N m/rad
WAVES = ((2.9831e8, 0.35, 1.504), (3.2108e8, 0.4, 1.510))
STIFFNESS = np.array([2.9831e8, 3.2108e8])
FORCE = 100.0 / RADII[0]  # N

contract = pytest.mark.parametrize("method", METHODS)
every_model = pytest.mark.parametrize("model", MODELS)


def exact_idler(relief=0.0, backlash=math.inf, phases=(0.0, 0.0)):
    torque = 100.0 * np.array([1.0, 0.0, -RADII[2] / RADII[0]])
    disks = zip(RADII, INERTIAS, torque, COUPLINGS, strict=True)
    return PiecewiseTrain(
        tuple(Disk(radius=r, inertia=j, torque=t, coupling=k) for r, j, t, k in disks),
        tuple(
            Toothing(
                driver=n,
                driven=n + 1,
                sense=(1, -1)[n],
                pairs=piecewise.rectangular_pairs(*WAVES[n], relief),
                mean_stiffness=WAVES[n][0],
                backlash=backlash,
                phase=phases[n],
            )
            for n in range(2)
        ),
        0.04,
    )


def kicked(system, velocity, mode=slice(None)):
    """At rest but for a velocity in all modes [m sqrt(kg)/s]."""
    state = system.static_state.copy()
    state[1, mode] += velocity
    return state


def rotations(system, state):
    """Rotations and speeds of the disks (2 n,)."""
    shapes = system.modes.shapes[:, system.moving]
    return np.concatenate([shapes @ state[0], shapes @ state[1]])


def fitted_order(steps, errors):
    return -np.polyfit(np.log(steps), np.log(errors), 1)[0]


CASES = {
    # train, relief [m], frequency [Hz], kick
    "in contact": ({}, 0.0, 1000.0, 0.0),
    "contact loss": ({}, 0.0, 1600.0, 0.03),
    "partial loss": ({}, 10e-6, 1300.0, 0.03),
    "back side": ({"backlash": 20e-6}, 0.0, 1600.0, 0.15),
    "all at once": (
        {"backlash": 30e-6, "phases": (0.1, 0.3)},
        10e-6,
        2600.0,
        0.15,
    ),
}
exact_cases = pytest.mark.parametrize("case", CASES.values(), ids=CASES)


def against_exact(system, idler, fixed, case, **choices):
    """Largest error over the range of deflection, and of the RMS, in period 5."""
    changes, relief, frequency, kick = case
    built = system(idler(**changes), relief=relief)
    start = kicked(built, kick)
    exact = exact_idler(relief, **changes)
    motion = piecewise.march(exact, frequency, rotations(built, start), 5.0)
    response, history = respond_with_history(built, frequency, fixed(**choices), start)
    expected = motion.deflection(history.time + 4.0 / frequency)
    worst = np.abs(history.deflection - expected).max() / np.ptp(expected)
    rms = motion.rms(4.0 / frequency, 5.0 / frequency)
    return worst, np.abs(response.dte_rms / rms - 1.0).max()


@exact_cases
@pytest.mark.parametrize(
    ("choices", "motion_error", "rms_error"),
    [
        ({"steps": 64}, 1e-3, 1e-3),
        ({"steps": 1024}, 1e-5, 1e-5),
        ({"method": "dopri5", "accuracy": 1e-6, "steps": 256}, 2e-5, 1e-4),
        ({"method": "dopri5", "accuracy": 1e-12, "steps": 1024}, 2e-11, 1e-9),
    ],
    ids=["rk4", "rk4 fine", "dopri5", "dopri5 fine"],
)
def test_motion_and_rms_are_the_exact_ones(
    system, idler, fixed, case, choices, motion_error, rms_error
):
    worst, rms = against_exact(system, idler, fixed, case, **choices)
    assert worst < motion_error
    assert rms < rms_error


def test_settled_rms_is_the_exact_one(system):
    """From where rk4 settled, the exact motion repeats itself with the same RMS."""
    frequency, built = 1600.0, system()
    response = respond(built, frequency, Settings(steps=256, tolerance=1e-7))
    start = rotations(built, response.state)
    motion = piecewise.march(exact_idler(), frequency, start, 1.0)
    assert response.status == Status.PERIODIC
    assert (response.contact_loss > 0.01).all()
    np.testing.assert_allclose(
        response.dte_rms, motion.rms(0.0, 1.0 / frequency), rtol=1e-4
    )
    end = np.abs(motion.end_state - start).max()
    assert end < 1e-4 * np.abs(start).max()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("case", "least"),
    [("in contact", 3.85), ("contact loss", 1.8), ("partial loss", 1.8)],
)
def test_order_of_fixed_steps_on_rectangles(system, idler, fixed, case, least):
    """The grid lies on the jumps; what contact changes leave is of order 2."""
    steps = 64 * 2 ** np.arange(5)
    logs = np.zeros(steps.size)
    for kick in np.linspace(-0.01, 0.01, 5):
        moved = (*CASES[case][:3], CASES[case][3] + kick)
        if case == "in contact":
            moved = (*CASES[case][:3], 0.2 * kick)
        logs += [
            np.log(against_exact(system, idler, fixed, moved, steps=int(n))[0])
            for n in steps
        ]
    assert fitted_order(steps, np.exp(logs / 5)) > least


@pytest.mark.parametrize("harmonics", [1, 5])
def test_order_of_fixed_steps_on_smooth_waves(system, fixed, harmonics):
    built = system(harmonics=harmonics)
    start = kicked(built, 0.005)
    best = fixed(method="dopri5", accuracy=1e-13)
    reference = respond(built, 1000.0, best, start)
    steps = 48 * 2 ** np.arange(5)
    errors = []
    for n in steps:
        response = respond(built, 1000.0, fixed(steps=int(n)), start)
        assert (response.contact_loss == 0.0).all()
        errors.append(np.abs(response.state - reference.state)[1].max())
    assert fitted_order(steps, errors) == pytest.approx(4.0, abs=0.15)


@exact_cases
def test_adaptive_steps_follow_their_accuracy(system, idler, fixed, case):
    accuracies = np.array([1e-4, 1e-6, 1e-8, 1e-10])
    errors = [
        against_exact(system, idler, fixed, case, method="dopri5", accuracy=float(a))[0]
        for a in accuracies
    ]
    assert np.polyfit(np.log(accuracies), np.log(errors), 1)[0] > 0.9
    assert (errors < 20.0 * accuracies).all()


@contract
def test_models_agree_where_they_must(system, idler, fixed, method):
    """No relief, no contact loss, constant stiffness: one and the same train."""
    settings = fixed(method=method, accuracy=1e-9)
    motions = []
    for model in MODELS:
        built = system(model=model, variation=0.0)
        motion = respond_with_history(built, 1700.0, settings, kicked(built, 0.02))
        motions.append(motion)
    first = motions[0]
    assert (first[0].contact_loss == 0.0).all()
    assert (first[0].dte_rms > 1e-7).all()
    for response, history in motions[1:]:
        for name in RESPONSE_QUANTITIES:
            one, two = getattr(first[0], name), getattr(response, name)
            np.testing.assert_allclose(two, one, rtol=1e-6, err_msg=name)
        np.testing.assert_allclose(history.deflection, first[1].deflection, rtol=1e-6)
        np.testing.assert_allclose(history.force, first[1].force, rtol=1e-6)


@contract
def test_models_1_and_3_agree_without_relief(system, method):
    """Pairs without gaps touch together, eq. (2.9); contact loss included."""
    settings = Settings(method=method, accuracy=1e-8, tolerance=1e-7)
    one, three = (respond(system(model=m), 1600.0, settings) for m in (1, 3))
    assert (one.contact_loss > 0.0).all()
    np.testing.assert_allclose(three.dte_rms, one.dte_rms, rtol=1e-6)


def transmission_error(mesh):
    harmonics = (2e-7 * np.exp(0.3j), 1e-7 * np.exp(1.1j), 3e-8j)
    return np.array(harmonics) * (1.0, 1.3)[mesh] * np.exp(1j * mesh)


def excited_linearly(train):
    """Constant stiffness and transmission errors of three harmonics."""
    excitations = tuple(
        MeshExcitation(
            (
                PairExcitation(
                    constant_wave(k), wave_from_harmonics(0.0, transmission_error(m))
                ),
            ),
            k,
        )
        for m, k in enumerate(STIFFNESS)
    )
    return LumpedSystem(train, excitations)


def linear_idler(coupled):
    ground = np.diag(COUPLINGS) if coupled else np.zeros((3, 3))
    return LinearTrain(
        inertia=INERTIAS,
        rows=np.array([[RADII[0], RADII[1], 0.0], [0.0, -RADII[1], -RADII[2]]]),
        stiffness=STIFFNESS,
        ground=ground,
        torque=100.0 * np.array([1.0, 0.0, -RADII[2] / RADII[0]]),
        damping_ratio=0.04,
    )


@contract
@pytest.mark.parametrize("coupled", [True, False])
@pytest.mark.parametrize("frequency", [700.0, 1250.0, 2300.0])
def test_linear_response_is_the_closed_form(idler, method, coupled, frequency):
    """Model-2 without contact loss: a sum over harmonics, mode by mode."""
    system = excited_linearly(idler(coupled=coupled))
    settings = Settings(method=method, accuracy=1e-9, steps=256, tolerance=1e-8)
    response = respond(system, frequency, settings)
    tones = [
        Tone(
            2.0 * np.pi * frequency * s,
            np.array([transmission_error(m)[s - 1] for m in range(2)]),
        )
        for s in (1, 2, 3)
    ]
    train = linear_idler(coupled)
    expected = linear_train.rms(linear_train.harmonic_deflection(train, tones))
    assert response.status == Status.PERIODIC
    assert (response.contact_loss == 0.0).all()
    np.testing.assert_allclose(response.dte_rms, expected, rtol=2e-6)
    static = linear_train.static_deflection(train)
    np.testing.assert_allclose(response.dte_mean, static, rtol=2e-6)
    np.testing.assert_allclose(system.static_deflection, static, rtol=1e-9)


@contract
def test_two_mesh_frequencies_superpose(method):
    """A counter-shaft set: errors of different periods, closed form."""
    r, teeth = (0.0337, 0.0475, 0.0198, 0.0760), (51, 72, 19, 73)
    j = (0.01837, 0.03531, 0.00071, 0.1740)
    torque = (100.0, 0.0, 0.0, -100.0 * r[1] / r[0] * r[3] / r[2])
    gears = tuple(
        Gear(name=str(i), teeth=teeth[i], base_radius=r[i], inertia=j[i], torque=t)
        for i, t in enumerate(torque)
    )
    meshes = tuple(
        Mesh(driver=a, driven=a + 1, pressure_angle=0.35, phase=p)
        for a, p in ((0, 0.0), (2, 0.257))
    )
    train = Train(
        gears=gears,
        meshes=meshes,
        shafts=(Shaft(gears=(1, 2), stiffness=5e5),),
        damping_ratio=0.04,
    )
    system = excited_linearly(train)
    settings = Settings(method=method, accuracy=1e-8, steps=64, tolerance=1e-7)
    response = respond(system, 1500.0, settings)
    rows = np.array([[r[0], r[1], 0.0, 0.0], [0.0, 0.0, -r[2], -r[3]]])
    twist = np.array([0.0, 1.0, -1.0, 0.0])
    linear = LinearTrain(
        inertia=np.array(j),
        rows=rows,
        stiffness=STIFFNESS,
        ground=5e5 * np.outer(twist, twist),
        torque=np.array(torque),
        damping_ratio=0.04,
    )
    tones = []
    for mesh, rate in ((0, 1.0), (1, 19.0 / 72.0)):
        for s, amplitude in enumerate(transmission_error(mesh), 1):
            both = np.zeros(2, complex)
            both[mesh] = amplitude
            tones.append(Tone(2.0 * np.pi * 1500.0 * rate * s, both))
    expected = linear_train.rms(linear_train.harmonic_deflection(linear, tones))
    assert response.period_multiple.tolist() == [72, 19]
    np.testing.assert_allclose(response.dte_rms, expected, rtol=1e-5)
    static = linear_train.static_deflection(linear)
    np.testing.assert_allclose(response.dte_mean, static, rtol=1e-5)


@contract
@every_model
def test_twice_the_torque_is_twice_the_response(system, idler, method, model):
    """Without relief at fixed waves all is proportional to load (seed, 3.3.5)."""
    settings = Settings(method=method)
    speeds = np.arange(1100.0, 1500.0, 50.0)
    one, two = (
        sweep(
            system(idler(torque=t), model=model, force=t / RADII[0]),
            speeds,
            "up",
            settings,
        )
        for t in (100.0, 200.0)
    )
    for name in RESPONSE_QUANTITIES[:5]:
        np.testing.assert_allclose(two.column(name), 2.0 * one.column(name), rtol=1e-6)
    for name in RESPONSE_QUANTITIES[5:]:
        np.testing.assert_allclose(two.column(name), one.column(name), atol=1e-6)
    assert one.column("contact_loss").max() > 0.1


def test_jumps_stand_at_the_same_speeds_under_twice_the_torque(system, idler):
    speeds = np.arange(1000.0, 1400.0, 20.0)
    branches = [sweep(system(idler(torque=t)), speeds, "down") for t in (100.0, 200.0)]
    jumps = [np.abs(np.diff(b.column("dte_rms")[:, 1])).argmax() for b in branches]
    sizes = [b.column("dte_rms")[:, 1] for b in branches]
    assert jumps[0] == jumps[1]
    assert np.abs(np.diff(sizes[0])).max() > 2e-6
    np.testing.assert_allclose(sizes[1], 2.0 * sizes[0], rtol=1e-6)


@contract
@every_model
def test_a_whole_phase_is_none(system, idler, fixed, method, model):
    settings = fixed(method=method, accuracy=1e-9)
    responses = []
    for phases in ((0.3, 0.7), (1.3, -0.3), (-4.7, 5.7)):
        built = system(idler(phases=phases), model=model, relief=8e-6)
        start = kicked(built, 0.02)
        responses.append(respond(built, 1500.0, settings, start))
    for other in responses[1:]:
        for name in RESPONSE_QUANTITIES:
            one, two = getattr(responses[0], name), getattr(other, name)
            np.testing.assert_allclose(two, one, rtol=1e-6, atol=1e-9, err_msg=name)


def permuted(train):
    """The same train with its gears listed backwards."""
    last = len(train.gears) - 1
    meshes = tuple(
        Mesh(
            driver=last - m.driver,
            driven=last - m.driven,
            pressure_angle=m.pressure_angle,
            backlash=m.backlash,
        )
        for m in train.meshes
    )
    return Train(
        gears=train.gears[::-1], meshes=meshes, damping_ratio=train.damping_ratio
    )


@contract
@pytest.mark.parametrize("translations", [False, True])
def test_order_of_the_gears_does_not_matter(system, idler, fixed, method, translations):
    train = idler(translations=translations, backlash=50e-6)
    settings = fixed(method=method, accuracy=1e-9)
    one = respond(system(train, relief=5e-6), 1400.0, settings)
    two = respond(system(permuted(train), relief=5e-6), 1400.0, settings)
    for name in RESPONSE_QUANTITIES:
        first, second = getattr(one, name), getattr(two, name)
        np.testing.assert_allclose(second, first, rtol=1e-6, atol=1e-9)


@contract
@every_model
def test_mean_force_is_the_static_one(system, idler, method, model):
    """Over a period inertia and damping give nothing, and no spring holds a disk."""
    settings = Settings(method=method, accuracy=1e-8, steps=512, tolerance=1e-7)
    built = system(idler(coupled=False), model=model)
    response, h = respond_with_history(built, 1500.0, settings)
    assert response.status == Status.PERIODIC
    ends = 0.5 * np.diff(h.time)[:, None] * (h.force[:-1] + h.force_before[1:])
    mean = ends.sum(axis=0) / (h.time[-1] - h.time[0])
    np.testing.assert_allclose(mean, FORCE, rtol=5e-5)


@contract
def test_reversed_torque_mirrors_the_response(system, idler, fixed, method):
    """s -> -b - s turns every pair force k s of the drive side into -k (s + b).

    Both meshes can take up b without any strain where no spring holds a disk, so
    that the reversed torque moves the train on the other flanks in the same way.
    """
    backlash = 60e-6
    settings = fixed(method=method, accuracy=1e-10)
    forth, back = (
        system(idler(torque=t, backlash=backlash, coupled=False))
        for t in (100.0, -100.0)
    )
    start = kicked(forth, 0.05)
    shift = np.linalg.solve(forth.arrays.shapes, [-backlash, -backlash])
    mirrored = np.stack([shift - start[0], -start[1]])
    one, h1 = respond_with_history(forth, 1600.0, settings, start)
    two, h2 = respond_with_history(back, 1600.0, settings, mirrored)
    scale = np.ptp(h1.deflection)
    assert (one.contact_loss > 0.01).any()
    np.testing.assert_allclose(
        h2.deflection, -backlash - h1.deflection, atol=1e-7 * scale
    )
    np.testing.assert_allclose(h2.force, -h1.force, atol=1e-6 * np.abs(h1.force).max())
    np.testing.assert_allclose(two.dte_rms, one.dte_rms, rtol=1e-6)
    np.testing.assert_allclose(two.contact_loss, one.contact_loss, atol=1e-5)
    drive = 1.0 - one.contact_loss - one.back_side
    np.testing.assert_allclose(two.back_side, drive, atol=1e-5)


def free_train(idler, backlash):
    """No load, no damping, no coupling, constant stiffness."""
    train = idler(torque=0.0, damping=0.0, coupled=False, backlash=backlash)
    excitations = tuple(
        MeshExcitation((PairExcitation(constant_wave(k), constant_wave(0.0)),), k)
        for k in STIFFNESS
    )
    return LumpedSystem(train, excitations)


def energy(system, history, row):
    """Of motion and of the teeth that touch, without the rigid rotation [J]."""
    rates = np.linalg.solve(system.arrays.shapes, history.rate[row])
    drive = np.maximum(history.drive_overlap[row], 0.0)
    back = np.maximum(history.back_overlap[row], 0.0)
    return 0.5 * (rates @ rates + STIFFNESS @ (drive**2 + back**2))


def energy_drift(system, settings):
    start = np.zeros((2, 2))
    start[1] = 0.3, 0.2
    _, history = respond_with_history(system, 1500.0, settings, start)
    return abs(energy(system, history, -1) / (0.5 * start[1] @ start[1]) - 1.0)


def test_energy_of_fixed_steps_drifts_with_the_fifth_power(idler, fixed):
    """|R(iz)| = 1 - z^6 / 144 per step is z^5 per unit of time."""
    system = free_train(idler, 0.0)
    steps = 64 * 2 ** np.arange(4)
    drifts = [energy_drift(system, fixed(steps=int(n))) for n in steps]
    assert fitted_order(steps, drifts) == pytest.approx(5.0, abs=0.1)
    angles = np.sqrt(system.arrays.rigidity) / 1500.0 / steps[-1]
    worst = 5 * steps[-1] * (angles**6).max() / 72.0
    assert drifts[-1] < 1.05 * worst


@pytest.mark.parametrize("backlash", [0.0, 10e-6, 1e-3])
def test_energy_of_adaptive_steps_is_kept_to_their_accuracy(idler, fixed, backlash):
    """Rattle through free play included."""
    system = free_train(idler, backlash)
    for accuracy in (1e-6, 1e-9, 1e-12):
        settings = fixed(method="dopri5", accuracy=accuracy)
        assert energy_drift(system, settings) < 200.0 * accuracy + 1e-13


@pytest.mark.parametrize("backlash", [10e-6, 1e-3])
def test_energy_in_rattle_improves_with_fixed_steps(idler, fixed, backlash):
    system = free_train(idler, backlash)
    drifts = [energy_drift(system, fixed(steps=n)) for n in (64, 1024)]
    assert drifts[0] < 0.02
    assert drifts[1] < 2e-4


@contract
@pytest.mark.parametrize("frequency", [1000.0, 1600.0, 2600.0])
def test_work_of_jumps_pays_for_damping(system, idler, method, frequency):
    """Over a period torques do no net work: sum of dk s^2 / 2 = loss.

    Follows from d/dt (k s^2 / 2) = F s' + k' s^2 / 2; at a jump the force changes by
    dk s. Pairs without gaps touch together.
    """
    built = system(idler(coupled=False))
    settings = Settings(method=method, accuracy=1e-9, steps=512, tolerance=1e-8)
    _, h = respond_with_history(built, frequency, settings)
    jumps = 0.5 * (h.force - h.force_before) * h.deflection
    gained = jumps[:-1].sum()  # the last row is the first one again
    rates = h.rate @ np.linalg.inv(built.arrays.shapes).T
    power = (rates**2) @ built.arrays.damping
    lost = np.trapezoid(power, h.time)
    assert gained == pytest.approx(lost, rel=2e-4)


@contract
def test_work_of_a_smooth_stiffness_pays_for_damping(system, idler, method):
    """The same with the integral of k' s^2 / 2, k' from the harmonics."""
    built = system(idler(coupled=False), harmonics=2)
    settings = Settings(method=method, accuracy=1e-9, steps=512, tolerance=1e-8)
    response, h = respond_with_history(built, 1000.0, settings)
    assert (response.contact_loss == 0.0).all()
    x = 1000.0 * h.time
    step = 1e-4
    slope = [
        (e.pairs[0].stiffness(x + step) - e.pairs[0].stiffness(x - step)) / (2 * step)
        for e in built.excitations
    ]
    gain = 0.5 * 1000.0 * np.array(slope).T * h.deflection**2
    rates = h.rate @ np.linalg.inv(built.arrays.shapes).T
    lost = np.trapezoid((rates**2) @ built.arrays.damping, h.time)
    assert np.trapezoid(gain.sum(axis=1), h.time) == pytest.approx(lost, rel=1e-5)


def assert_diverged(response):
    assert response.status == Status.DIVERGED
    assert response.multiple == 0
    for name in RESPONSE_QUANTITIES:
        assert np.isnan(getattr(response, name)).all()
    assert math.isfinite(response.settling_time)


@contract
@pytest.mark.parametrize("bad", [math.nan, math.inf])
@pytest.mark.parametrize("place", [(0, 0), (1, 0), (0, -1), (1, -1)])
def test_a_start_that_is_no_number_diverges(system, method, bad, place):
    built = system()
    state = built.static_state.copy()
    state[place] = bad
    assert_diverged(respond(built, 1000.0, Settings(method=method), state))


@contract
def test_parametric_instability_diverges(system, idler, method):
    """Undamped, held on both flanks, twice the natural frequency: unbounded."""
    built = system(idler(damping=0.0, backlash=0.0), harmonics=1)
    response = respond(
        built,
        float(2.0 * built.modes.frequency_Hz[-1]),
        Settings(method=method, accuracy=1e-4),
        kicked(built, 1e-3),
    )
    assert_diverged(response)
    assert response.settling_time > 0.0


def test_steps_far_too_long_diverge(idler):
    """A spring far stiffer than the mean that modes and steps are chosen by."""
    excitation = MeshExcitation(
        (PairExcitation(constant_wave(3e10), constant_wave(0.0)),), 3e8
    )
    built = LumpedSystem(idler(backlash=0.0), (excitation, excitation))
    settings = Settings(steps=4, step_angle=2.0)
    assert_diverged(respond(built, 3000.0, settings, kicked(built, 0.01)))


def test_step_angle_keeps_slow_speeds_stable(system):
    """However few the steps asked for, the highest mode is resolved."""
    built = system()
    settings = Settings(steps=4, step_angle=2.0)
    count = steps_per_period(built, 50.0, settings)
    assert math.sqrt(built.arrays.rigidity.max()) / (50.0 * count) <= 2.0
    response = respond(built, 50.0, settings)
    assert response.status == Status.PERIODIC
    assert (np.abs(response.dte_mean) < 1e-4).all()


@contract
def test_divergence_ends_a_branch_and_keeps_what_was_done(system, idler, method):
    built = system(idler(damping=0.0, backlash=0.0), harmonics=1)
    unstable = float(2.0 * built.modes.frequency_Hz[-1])
    settings = Settings(method=method, accuracy=1e-4, max_periods=5000)
    branch = sweep(built, [unstable, unstable + 100.0], "up", settings)
    states = [response.status for response in branch.responses]
    assert not branch.complete
    assert states == [Status.DIVERGED]


@pytest.mark.parametrize("frequency", [0.0, -1.0, math.nan, math.inf])
def test_frequency_is_checked(system, frequency):
    with pytest.raises(
        ValueError, match=r"frequency = .*; must be (positive|a finite)"
    ):
        respond(system(), frequency)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("method", "euler"),
        ("steps", 3),
        ("step_angle", 2.1),
        ("accuracy", 0.0),
        ("tolerance", math.nan),
        ("max_periods", 0),
        ("multiples", 65),
    ],
)
def test_settings_name_what_is_wrong(name, value):
    with pytest.raises(ValueError, match=name):
        Settings(**{name: value})


def same_bits(one, two):
    pairs = [(one.column(name), two.column(name)) for name in RESPONSE_QUANTITIES]
    pairs.append((one.frequency_Hz, two.frequency_Hz))
    return all(a.tobytes() == b.tobytes() for a, b in pairs)


@contract
def test_threads_do_not_change_a_bit(system, method):
    systems = [system(relief=r) for r in (0.0, 5e-6)]
    speeds = np.arange(1000.0, 1300.0, 60.0)
    settings = Settings(method=method)
    runs = [sweep_all(systems, speeds, settings=settings, workers=n) for n in (1, 2, 4)]
    for other in runs[1:]:
        for one, two in zip(runs[0], other, strict=True):
            assert same_bits(one, two)


def test_a_long_speed_reports_its_periods_and_changes_no_bit(system, monkeypatch):
    """Where a period takes long it is told how far the speed has come."""
    built, speeds, reports = system(), [1000.0, 1240.0], []
    (plain,) = sweep_all([built], speeds, ["up"], report=lambda *args: None)
    monkeypatch.setattr("lumped.steady.steppers.STEPS_PER_CALLBACK", 1)
    monkeypatch.setattr(sys.modules["lumped.steady.sweep"], "REPORT_INTERVAL", -1.0)
    (watched,) = sweep_all([built], speeds, ["up"], report=lambda *w: reports.append(w))
    assert same_bits(plain, watched)
    first = reports[: reports.index(("sweep", 1, 2))]
    count = round(plain.responses[0].settling_time * 1000.0)
    assert first[:2] == [("1000 Hz, period 1", 0, 2), ("1000 Hz, period 2", 0, 2)]
    assert first[-1][0] == f"1000 Hz, period {count}"
    assert count > 5
    assert reports[-1] == ("sweep", 2, 2)


def test_order_of_the_speeds_given_does_not_matter(system):
    speeds = np.arange(1000.0, 1300.0, 20.0)
    one = sweep(system(), speeds, "down")
    two = sweep(system(), speeds[::-1], "down")
    assert same_bits(one, two)
    assert (np.diff(one.frequency_Hz) < 0.0).all()


@pytest.mark.parametrize("direction", ["up", "down"])
def test_a_sweep_goes_on_from_the_state_before(system, direction):
    built = system()
    branch = sweep(built, [1240.0, 1260.0, 1280.0], direction)
    state = None
    for response in branch.responses:
        alone = respond(built, response.frequency, None, state)
        np.testing.assert_array_equal(alone.state, response.state)
        np.testing.assert_array_equal(alone.dte_rms, response.dte_rms)
        state = alone.state


def test_up_and_down_part_at_the_jump(system):
    """Softening by contact loss: two stable responses below the resonance."""
    speeds = np.arange(1200.0, 1500.0, 20.0)
    up, down = (sweep(system(), speeds, d) for d in ("up", "down"))
    difference = down.column("dte_rms")[::-1] - up.column("dte_rms")
    assert difference[:, 1].max() > 2e-6
    assert np.abs(difference[-1]).max() < 1e-8


def test_a_run_does_not_touch_the_state_it_starts_from(system):
    built = system()
    state = built.static_state.copy()
    respond(built, 1500.0, None, state)
    np.testing.assert_array_equal(state, built.static_state)


def test_wrong_direction_is_named(system):
    with pytest.raises(ValueError, match="direction = 'left'; must be up or down"):
        sweep(system(), [1000.0], "left")


@contract
def test_kernels_are_the_same_uncompiled(system, idler, fixed, method, request):
    built = system(idler(backlash=20e-6), relief=5e-6)
    settings = fixed(method=method, steps=16, step_angle=1.5, accuracy=1e-4)
    start = kicked(built, 0.4)
    compiled, h1 = respond_with_history(built, 2600.0, settings, start)
    request.getfixturevalue("uncompiled")
    plain, h2 = respond_with_history(built, 2600.0, settings, start)
    assert (compiled.contact_loss > 0.0).any()
    np.testing.assert_allclose(h2.deflection, h1.deflection, rtol=1e-7, atol=1e-13)
    np.testing.assert_allclose(plain.dte_rms, compiled.dte_rms, rtol=1e-7)


@contract
def test_uncompiled_kernels_report_divergence_too(system, fixed, method, uncompiled):
    built = system()
    state = built.static_state.copy()
    state[0, 0] = math.nan
    with np.errstate(invalid="ignore"):
        response = respond(built, 1000.0, fixed(method=method), state)
    assert_diverged(response)


def test_statics_follow_slow_speeds(system, figures, idler):
    """At 2 Hz the deflection is the static one, F / k, eq. (2.8)."""
    built = system(idler(coupled=False), ramp=0.2)
    settings = Settings(method="dopri5", accuracy=1e-6, steps=64)
    _, history = respond_with_history(built, 2.0, settings)
    for m in range(2):
        pairs = analytic_excitation(figures(m, ramp=0.2)).pairs
        stiffness = sum(pair.stiffness(2.0 * history.time) for pair in pairs)
        np.testing.assert_allclose(
            history.deflection[:, m], FORCE / stiffness, rtol=2e-3
        )


def test_what_memory_cannot_hold_is_refused(system):
    with pytest.raises(TrainError, match="more than a run should hold"):
        respond(system(), 1e-6)


@pytest.fixture(scope="module")
def two_stages(figures):
    """Mesh frequencies 72 to 19, so that a common period is long and full of stops."""
    teeth, radii = (51, 72, 19, 73), (0.0337, 0.0475, 0.0198, 0.0761)
    inertias = (0.01837, 0.03531, 0.00071, 0.1740)
    gears = tuple(
        Gear(name=str(i), teeth=z, base_radius=r, inertia=j, torque=t)
        for i, (z, r, j, t) in enumerate(
            zip(teeth, radii, inertias, (100.0, 0.0, 0.0, -100.0), strict=True)
        )
    )
    torque = 100.0 * radii[1] / radii[0] * radii[3] / radii[2]
    gears = (*gears[:3], replace(gears[3], torque=-torque))
    meshes = tuple(
        Mesh(driver=i, driven=i + 1, pressure_angle=math.radians(20.0)) for i in (0, 2)
    )
    train = Train(
        gears=gears, meshes=meshes, shafts=(Shaft(gears=(1, 2)),), damping_ratio=0.04
    )
    return LumpedSystem(
        train, tuple(analytic_excitation(figures(m), 1) for m in range(2))
    )


@pytest.mark.parametrize(
    "settings",
    [
        Settings(method="dopri5"),
        Settings(method="dopri5", tolerance=1e-8),
        Settings(tolerance=1e-8),
        Settings(tolerance=1e-12),
    ],
    ids=lambda s: f"{s.method} {s.tolerance:g}",
)
def test_settled_motions_are_not_called_aperiodic(two_stages, settings):
    usual = respond(two_stages, 2600.0, Settings(steps=256))
    response = respond(two_stages, 2600.0, settings)
    assert usual.multiple == response.multiple == 1
    np.testing.assert_allclose(response.dte_rms, usual.dte_rms, rtol=1e-3)
    assert not response.dte_rms_stderr.any()


def test_error_of_adaptive_steps_follows_the_tolerance():
    assert Settings().step_error == 1e-8
    assert Settings(tolerance=1e-7).step_error == pytest.approx(1e-10)
    assert Settings(tolerance=1e-12).step_error == 1e-13
    assert Settings(tolerance=1e-7, accuracy=1e-6).step_error == 1e-6


@pytest.mark.parametrize("damping", [1e-300, 1e-7, 0.0])
def test_decay_that_is_too_slow_is_not_waited_for(system, idler, damping):
    slow = system(idler(damping=damping))
    assert periods_to_settle(slow, 1500.0, Settings()) == 2000
    usual = system(idler(damping=1e-3))
    assert 2000 < periods_to_settle(usual, 1500.0, Settings()) < 200_000
