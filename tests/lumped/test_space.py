"""Trains whose gears move in space: rows, springs, coordinates and motions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from machines_in_space import random_machine
from scipy.integrate import solve_ivp
from trains_in_space import ANGLE, POSITIONS, random_law, train_in_space

from lumped.rotors.matrices import assemble
from lumped.rotors.mesh_springs import approach_of_motions, mesh_rows, rigid_motions
from lumped.rotors.response import HarmonicForce, steady_response
from lumped.rotors.whirl import WhirlProblem
from lumped.steady.integration_settings import Settings
from lumped.steady.motion import time_history
from lumped.steady.steady_state import Speed
from lumped.steady.steppers import stepper_of
from lumped.train.bodies import TrainError
from lumped.train.space import angular_speed
from lumped.train.width_springs import width_law

FINE = Settings(tolerance=1e-10, steps=512, max_periods=4000)


SMALL = 7300, 7303, 7309, 7310  # machines of two shafts, soon settled


@pytest.fixture(params=SMALL)
def rng(request):
    return np.random.default_rng(request.param)


def test_approach_by_motions_is_that_by_coordinates(rng):
    system = random_machine(rng)
    matrices = assemble(system)
    for mesh in system.meshes:
        of_motions = approach_of_motions(mesh) @ rigid_motions(matrices, mesh)
        expected = np.stack(mesh_rows(matrices, mesh))
        assert of_motions == pytest.approx(expected, abs=1e-14)


def springs_of(law):
    """Stiffness, gap and place (n, 3) of the springs at the law's positions."""
    at = np.arange(POSITIONS) / POSITIONS
    pairs = law.excitation.pairs
    return tuple(
        np.column_stack([getattr(pair, name)(at) for pair in pairs])
        for name in ("stiffness", "gap", "place")
    )


def test_springs_have_the_loads_and_slopes_of_their_law(rng):
    mesh = random_machine(rng).meshes[0]
    law = random_law(rng, mesh, 3000.0)
    stiffness, gap, place = springs_of(law)
    approach = law.approach[:, :1] + place * law.approach[:, 1:]
    force = stiffness * (approach - gap)
    assert (force >= 0.0).all()
    loads = np.column_stack([force.sum(axis=1), (force * place).sum(axis=1)])
    assert loads == pytest.approx(law.loads, rel=1e-12, abs=1e-9)
    slopes = [(stiffness * place**power).sum(axis=1) for power in range(3)]
    assert np.column_stack(slopes) == pytest.approx(law.slopes, rel=1e-12)
    assert law.moment_left_out < 1e-15


def test_an_even_line_lifts_where_its_end_does():
    """F = k s, M = k a^2 t / 3: its end at -a lifts at M = F a / 3."""
    mesh = random_machine(np.random.default_rng(1)).meshes[0]
    law = random_law(np.random.default_rng(2), mesh, 1000.0, variation=0.0)
    half = float(law.spread[0])
    for part, lifted in ((0.999, False), (1.001, True)):
        center = law.center * law.loads[:, 0]
        loads = np.column_stack(
            [law.loads[:, 0], center + part * law.loads[:, 0] * half / 3.0]
        )
        shares = replace(law, loads=loads).shares
        assert (shares[:, 0] == 0.0).all() == lifted
        assert (shares >= 0.0).all()


def test_a_load_beyond_the_springs_is_told():
    mesh = random_machine(np.random.default_rng(1)).meshes[0]
    law = random_law(np.random.default_rng(2), mesh, 1000.0)
    beyond = law.center + 1.5 * law.spread
    loads = np.column_stack([law.loads[:, 0], beyond * law.loads[:, 0]])
    far = replace(law, loads=loads)
    assert far.moment_left_out == pytest.approx(0.5 * law.spread.max())


def test_teeth_without_stiffness_are_named():
    mesh = random_machine(np.random.default_rng(1)).meshes[0]
    motions, loads = np.zeros((4, 11)), np.ones((4, 11))
    stiffness = np.tile(np.eye(11), (4, 1, 1))
    stiffness[2, 0, 0] = 0.0
    with pytest.raises(TrainError, match=r"at position 0\.5; shafts or bearings"):
        width_law(mesh, motions, loads, stiffness)


def test_reduced_shafts_have_the_frequencies_of_all_their_coordinates(rng):
    system = train_in_space(rng)
    full = WhirlProblem(assemble(system.space.system))
    expected = np.sqrt(full.squares) / (2.0 * np.pi)
    expected = expected[expected > 1.0]
    frequencies = system.modes.frequency_Hz[system.moving]
    strained = system.modes.mesh_energy.sum(axis=0)[system.moving] >= 0.05
    low = frequencies < 0.6 * frequencies[strained].max()
    count = int(low.sum())
    assert count > 2
    assert frequencies[:count] == pytest.approx(expected[:count], rel=1e-2)
    # with all modes they are the same
    system = train_in_space(np.random.default_rng(7300), bound=np.inf)
    full = WhirlProblem(assemble(system.space.system))
    expected = np.sqrt(full.squares) / (2.0 * np.pi)
    frequencies = system.modes.frequency_Hz[system.moving]
    assert frequencies == pytest.approx(expected[-frequencies.size :], rel=1e-6)


@pytest.mark.slow
def test_motion_is_that_of_an_independent_integration():
    """All coordinates of the shafts, with teeth that lose contact."""
    rng = np.random.default_rng(7300)
    changes = {"bound": np.inf, "variation": 0.3, "across": 3e6}
    system = train_in_space(rng, force=300.0, damping=0.0, **changes)
    space, frequency = system.space, 900.0
    matrices = space.matrices
    speed = angular_speed(frequency, system.train.gears[0].teeth)
    stiffness = matrices.stiffness - matrices.mesh_stiffness.sum(axis=0)
    damping = matrices.damping + speed * matrices.gyroscopic
    load = np.zeros(matrices.size)
    for gear, row in zip(system.train.gears, space.rotations, strict=True):
        load += gear.torque * row
    rows = [np.stack(mesh_rows(matrices, mesh)) for mesh in space.system.meshes]
    middles = [row[0] + _center(system, m) * row[1] for m, row in enumerate(rows)]
    inverse = np.linalg.inv(matrices.mass)
    size = matrices.size

    def rate(time, state):
        x, v = state[:size], state[size:]
        force = load - stiffness @ x - damping @ v
        for m, (mesh, middle) in enumerate(
            zip(system.train.meshes, middles, strict=True)
        ):
            position = mesh.phase + frequency * time * float(system.train.mesh_rates[m])
            for pair in system.excitations[m].pairs:
                row = middle + float(pair.place(position)) * rows[m][1]
                elastic = row @ x - float(pair.gap(position))
                force -= row * float(pair.stiffness(position)) * max(elastic, 0.0)
        return np.concatenate([v, inverse @ force])

    start = system.static_state.copy()
    start[0] *= -1.0  # released where teeth are apart
    shapes = system.modes.shapes[:, system.moving]
    full_start = np.concatenate([space.basis @ shapes @ part for part in start])
    end = 1.0 / frequency
    reference = solve_ivp(
        rate, (0.0, end), full_start, rtol=1e-9, atol=1e-13, method="DOP853"
    ).y[:size, -1]
    _, history = stepper_of(system, FINE).record(
        start, Speed(frequency, FINE), 1, with_states=True
    )
    at = int(np.abs(history.time - end).argmin())
    assert history.time[at] == pytest.approx(end, rel=1e-9)
    assert (history.force[:at] == 0.0).any()  # contact is lost
    end_state = space.basis @ shapes @ history.states[at, 0]
    scale = np.abs(reference).max()
    assert end_state == pytest.approx(reference, abs=1e-5 * scale)


@pytest.mark.parametrize(
    "seed", [7300, *(pytest.param(n, marks=pytest.mark.slow) for n in (7303, 7309))]
)
def test_small_vibration_is_that_of_the_linear_response(seed):
    """A constant stiffness and a gap that varies, with gyroscopic moments."""
    rng = np.random.default_rng(seed)
    system = train_in_space(rng, variation=0.0, bound=np.inf)
    error = 1e-8 * np.cos(ANGLE)
    excitations = []
    for excitation in system.excitations[:1]:
        pairs = []
        for pair in excitation.pairs:
            mean = pair.gap.mean
            pairs.append(replace(pair, gap=_sampled(mean + error)))
        excitations.append(replace(excitation, pairs=tuple(pairs)))
    for excitation in system.excitations[1:]:
        pairs = [
            replace(pair, gap=_sampled(pair.gap.mean + 0.0 * error))
            for pair in excitation.pairs
        ]
        excitations.append(replace(excitation, pairs=tuple(pairs)))
    system = replace(system, excitations=tuple(excitations))
    frequency = 1.3 * float(system.resonances_Hz[2])
    motion = time_history(system, frequency, FINE)
    assert motion.response.multiple
    assert all((pairs.state == 1).all() for pairs in motion.pairs)
    problem = WhirlProblem(assemble(system.space.system))
    speed = angular_speed(frequency, system.train.gears[0].teeth)
    k = system.excitations[0].mean_stiffness
    matrices = system.space.matrices
    row = np.stack(mesh_rows(matrices, system.space.system.meshes[0]))
    middle = row[0] + _center(system, 0) * row[1]
    amplitude = _harmonic(_sampled(error))
    force = HarmonicForce(
        order=float(system.train.gears[0].teeth), force=k * amplitude * middle
    )
    (response,) = steady_response(problem, [force], speed, system.train.damping_ratio)
    expected = abs(middle @ response) / np.sqrt(2.0)
    assert motion.response.dte_rms[0] == pytest.approx(expected, rel=2e-4)


def _sampled(values):
    from lumped.train.waves import wave_from_samples

    return wave_from_samples(values)


def _harmonic(wave):
    at = np.arange(4096) / 4096
    return complex(2.0 * np.fft.rfft(wave(at))[1] / at.size)


def _center(system, m):
    """Distance of the middle of a mesh from that of its plane of action."""
    mesh, space = system.space.system.meshes[m], system.space
    rows = np.stack(mesh_rows(space.matrices, mesh)) @ space.basis
    away = system.modes.coordinates.mesh_rows[m] - rows[0]
    return float(away @ rows[1] / (rows[1] @ rows[1]))


def balances(system, forces, moments, displacement):
    """Sums of forces and moments on every shaft over the largest force (shafts, 5).

    forces, moments : of the meshes (m,)
    displacement : of the coordinates of the train (n,)
    """
    machine, space = system.space.system, system.space
    stiffness, _ = space.bearing_forces
    on_shafts = stiffness @ displacement
    sums = np.zeros((len(machine.rotors), 5))
    for (shaft, place), (x, y, z) in zip(space.bearings, on_shafts, strict=True):
        # moments turn the axis toward x and y
        sums[shaft] += x, y, z, place * x, place * y
    tilts = np.stack(
        [_slopes(space, number, displacement) for number in range(len(machine.rotors))]
    )
    for number, rotor in enumerate(machine.rotors):
        for bearing, slope in zip(rotor.bearings, tilts[number], strict=True):
            sums[number, 3:] -= bearing.tilt_stiffness * slope
    for m, mesh in enumerate(machine.meshes):
        rows = approach_of_motions(mesh)
        rows[0] += _center(system, m) * rows[1]
        load = forces[m] * rows[0] + moments[m] * rows[1]
        push = np.array(mesh.direction)
        normal = mesh.sense * np.array([push[1], -push[0]])
        for gear, shaft in enumerate(mesh.rotors):
            of_gear = load[1 + 5 * gear : 6 + 5 * gear]
            across = of_gear[0] * push + of_gear[1] * normal
            turning = of_gear[3] * push + of_gear[4] * normal
            turning = turning + mesh.positions[gear] * across
            sums[shaft] -= *across, of_gear[2], *turning
    return sums / np.abs(forces).max()


def _slopes(space, number, displacement):
    """Slopes of x and y over z (b, 2) of a shaft in its bearings."""
    matrices, moved = space.matrices, space.basis @ displacement
    return [
        (
            moved[matrices.index(number, bearing.position, "tilt y")],
            -moved[matrices.index(number, bearing.position, "tilt x")],
        )
        for bearing in space.system.rotors[number].bearings
    ]


@pytest.mark.parametrize("seed", range(7330, 7340))
def test_forces_and_moments_balance_on_every_shaft(seed):
    """Of teeth and bearings at rest, of ten machines none of which is tuned on."""
    system = train_in_space(np.random.default_rng(seed))
    shapes = system.modes.shapes[:, system.moving]
    displacement = shapes @ system.static_state[0]
    coordinates, space = system.modes.coordinates, system.space
    forces = system.modes.mean_stiffness * (coordinates.mesh_rows @ displacement)
    moments = space.tilt_stiffness * (space.tilt_rows @ displacement)
    sums = balances(system, forces, moments, displacement)
    assert sums == pytest.approx(0.0, abs=1e-9)
    for mesh, force in zip(system.train.meshes, forces, strict=True):
        driver = system.train.gears[mesh.driver]
        if driver.torque:
            assert force * driver.base_radius == pytest.approx(driver.torque, rel=1e-9)


def test_mean_forces_of_a_motion_balance(rng):
    system = train_in_space(rng, damping=0.05)
    frequency = 0.8 * float(system.resonances_Hz[2])
    motion = time_history(system, frequency, FINE)
    assert motion.response.multiple
    _, history = stepper_of(system, FINE).record(
        motion.response.state,
        Speed(frequency, FINE),
        motion.response.multiple,
        with_states=True,
    )
    shapes = system.modes.shapes[:, system.moving]
    span = history.time[-1] - history.time[0]
    quantities = history.force, history.moments, history.states[:, 0] @ shapes.T
    means = [np.trapezoid(q, history.time, axis=0) / span for q in quantities]
    assert balances(system, *means) == pytest.approx(0.0, abs=1e-7)
    first = system.train.gears[0]
    assert means[0][0] * first.base_radius == pytest.approx(first.torque, rel=1e-7)


def test_what_bearings_and_modes_dissipate_is_what_the_excitation_brings(rng):
    """Over a period; springs bring power as their stiffness and gap change."""
    system = train_in_space(rng, damping=0.05)
    finest = replace(FINE, steps=4096)  # quadrature is of second order
    frequency = 0.8 * float(system.resonances_Hz[2])
    motion = time_history(system, frequency, finest)
    speed = Speed(frequency, finest)
    stepper = stepper_of(system, finest)
    multiple = motion.response.multiple
    _, history = stepper.record(motion.response.state, speed, multiple, True)
    arrays, samples = stepper.kernel_arguments(speed)
    v = history.states[:, 1]
    dissipated = v**2 @ arrays.damping
    dissipated += np.einsum("ti,ij,tj->t", v, samples.velocity_forces, v)
    brought = np.zeros_like(dissipated)
    step = 1e-6  # of a base pitch
    for m, excitation in enumerate(system.excitations):
        mesh, rate = system.train.meshes[m], float(system.train.mesh_rates[m])
        position = mesh.phase + frequency * rate * history.time
        s, t = history.deflection[:, m], history.tilts[:, m]
        for pair in excitation.pairs:

            def energy(x, pair=pair, s=s, t=t):
                elastic = s + pair.place(x) * t - pair.gap(x)
                return 0.5 * pair.stiffness(x) * np.maximum(elastic, 0.0) ** 2

            change = energy(position + step) - energy(position - step)
            brought += change / (2.0 * step) * frequency * rate
    means = [np.trapezoid(p, history.time) for p in (brought, dissipated)]
    exchanged = np.trapezoid(np.abs(brought), history.time)
    assert means[1] > 1e-4 * exchanged
    assert means[0] == pytest.approx(means[1], abs=1e-6 * exchanged)


def test_motion_in_space_has_no_tooth_pairs_of_the_plane():
    system = train_in_space(np.random.default_rng(7300))
    excitations = tuple(
        replace(one, pairs=tuple(replace(pair, place=None) for pair in one.pairs))
        for one in system.excitations
    )
    with pytest.raises(TrainError, match="place along the axis"):
        replace(system, excitations=excitations)
    with pytest.raises(ValueError, match="dopri5"):
        stepper_of(system, Settings(method="dopri5"))
    with pytest.raises(TrainError, match="motion in space"):
        system.require_no_space("branches")
