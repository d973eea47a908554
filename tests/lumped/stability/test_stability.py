"""Stability with tooth friction, beside exact solutions and perturbation."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import get_args

import numpy as np
import pytest
from friction_pairs import ACROSS, COUPLED, RADII, pair_system
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import fsolve

from fegear.gearset import load_gear_set
from fegear.statics.excitation_settings import ExcitationSettings
from fegear.train.lumped_models import lumped_system
from fegear.train.model_settings import LumpedModel
from lumped.stability.combinations import combinations
from lumped.stability.intervals import scan_stability
from lumped.stability.multipliers import (
    Method,
    largest_multiplier,
    multipliers,
    scaled_transition,
    transition,
)
from lumped.stability.periodic_system import PeriodicSystem, periodic_system
from lumped.train.analytic import StiffnessParameters, analytic_excitation
from lumped.train.bodies import TrainError
from lumped.train.friction import ToothFriction, base_pitch, friction_rows, with_bending
from lumped.train.system import LumpedSystem
from validation.oracles.hill import exact_transition, first_order_form, recursion

SPEEDS = np.linspace(1.7, 12.0, 400)
METHODS = get_args(Method)


def intervals(system, low, high, kind):
    scan = scan_stability(system, np.linspace(low, high, 101))
    return [interval for interval in scan.intervals if interval.kind == kind]


def test_the_pair_has_the_printed_natural_frequencies():
    frequencies = pair_system(0.3).modes.frequency_Hz
    exact = sorted([0.0, *COUPLED, *ACROSS])
    np.testing.assert_allclose(frequencies, exact, atol=1e-9)


def sawtooth(a, b):
    """x'' + (a t + b) x = 0 over a period of one."""
    stiffness = np.array([[[[b]], [[a]]]])
    edges = np.array([0.0, 1.0])
    return PeriodicSystem(np.ones(1), np.zeros(1), edges, stiffness)


@pytest.mark.parametrize(("a", "b"), [(-1.0, -1.0), (30.0, 5.0), (-200.0, 150.0)])
def test_the_sawtooth_has_its_exact_solution(a, b):
    """Eq. 4.57."""
    exact = exact_transition(a, b, 1.0)
    matrix = transition(sawtooth(a, b), 1.0)[0]
    np.testing.assert_allclose(matrix, exact, atol=1e-11 * np.abs(exact).max())


@pytest.mark.parametrize("method", METHODS)
def test_methods_agree(method):
    system = periodic_system(pair_system(0.3, 0.001, ToothFriction(0.1, 0.5)))
    at = np.array([1.9, 4.2, 7.0, 11.4])
    matrix, reference = transition(system, at, method), transition(system, at)
    within = {"integration": 1e-7, "exponential": 1e-4, "peano-baker": 1e-15}[method]
    assert np.abs(matrix - reference).max() < within


def test_exponentials_converge_with_the_square_of_their_number():
    system = periodic_system(pair_system(0.3, 0.001, ToothFriction(0.1, 0.5)))
    exact = transition(system, 7.0)
    errors = [
        np.abs(transition(system.averaged(n), 7.0) - exact).max() for n in (8, 16, 32)
    ]
    assert np.log2(np.array(errors[:-1]) / errors[1:]) == pytest.approx(2.0, abs=0.1)


def test_without_variation_multipliers_are_those_of_the_modes():
    system = periodic_system(pair_system(0.0, 0.02))
    roots = 2.0 * math.pi * np.array(COUPLED)
    exact = np.exp((-0.02 + 1j * math.sqrt(1.0 - 0.02**2)) * roots / 7.0)
    eigenvalues = multipliers(system, 7.0)[0]
    for value in exact:
        assert np.abs(eigenvalues - value).min() < 1e-12


def test_friction_takes_energy_away():
    """In approach and in recess, whatever the gears."""
    train = pair_system(0.3).train
    space = pair_system(0.3).modes.coordinates
    at_pitch, _, per_metre = friction_rows(train, space)
    # both gears turn, their pitch circles roll on each other
    turning = np.zeros(space.mass.size)
    turning[space.indices[0, "rotation"]] = 1.0 / RADII[0]
    turning[space.indices[1, "rotation"]] = -1.0 / RADII[1]
    assert space.mesh_rows[0] @ turning == pytest.approx(0.0, abs=1e-12)
    for place in (-0.7, -0.2, 0.3, 0.8):
        x = place * base_pitch(train, 0)
        side = 1 if place < 0.0 else -1
        power = side * (at_pitch[0] + x * per_metre[0]) @ turning
        sliding = abs(x) * (1.0 / RADII[0] + 1.0 / RADII[1])
        assert power == pytest.approx(-sliding, rel=1e-12)


def test_the_normal_force_grows_in_approach():
    """Eq. 4.40, T = N (r - mu l) for both gears, arms that add up to the length of
    the line between the base circles."""
    system = pair_system(0.3)
    space = system.modes.coordinates
    at_pitch, _, per_metre = friction_rows(system.train, space)
    x = -0.4 * base_pitch(system.train, 0)
    load = space.mesh_rows[0] - 0.1 * (at_pitch[0] + x * per_metre[0])
    slope = math.tan(math.radians(20.0))
    arms = RADII[0] * slope + x, RADII[1] * slope - x
    assert sum(arms) == pytest.approx(sum(RADII) * slope)
    for gear, arm in enumerate(arms):
        place = space.indices[gear, "rotation"]
        assert load[place] == pytest.approx(RADII[gear] - 0.1 * arm, rel=1e-12)
        others = [space.indices[gear, axis] for axis in "xy"]
        assert np.linalg.norm(load[others]) == pytest.approx(math.hypot(1.0, 0.1))


@pytest.mark.parametrize(
    ("name", "low", "high"), [("2 f3", 10.5, 12.0), ("f1 + f3", 6.5, 7.6)]
)
@pytest.mark.parametrize("damping", [0.0, 0.02])
def test_perturbation_is_right_to_second_order(name, low, high, damping):
    errors = []
    for size in (0.1, 0.05, 0.025):
        rub = ToothFriction(size / 3.0, 0.4) if damping else None
        system = periodic_system(pair_system(size, damping * size, rub))
        (interval,) = intervals(system, low, high, name)
        (near,) = [c for c in combinations(system, (low, high)) if c.name == name]
        errors.append(max(abs(near.low - interval.low), abs(near.high - interval.high)))
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    assert rates == pytest.approx(2.0, abs=0.45)


def test_the_printed_stable_and_unstable_speeds():
    """Eps 0.1 without friction or damping; the edges are 11.230 and 11.567, which
    print rounds to 11.2 and 11.6."""
    system = periodic_system(pair_system(0.1))
    grows = largest_multiplier(system, [7.25, 7.79, 11.25, 11.55]) > 1.001
    assert grows.all()
    still = largest_multiplier(system, [11.1, 11.7])
    np.testing.assert_allclose(still, 1.0, atol=1e-9)
    (interval,) = intervals(system, 11.0, 11.8, "2 f3")
    assert (interval.low, interval.high) == pytest.approx((11.2, 11.6), abs=0.035)


def monodromy_at(speed):
    """Of eq. 4.44 in u, y1, y2 without friction or damping, by matrix exponentials;
    its masses from the printed frequencies by a root finder. Eps 0.1, c = 1.5."""
    row = np.array([1.0, 1.0, -1.0])
    squares = (2.0 * math.pi * np.array(COUPLED)) ** 2
    held = (2.0 * math.pi * np.array([0.0, *ACROSS])) ** 2

    def over_mass(logs, share=1.0):
        """Stiffness over mass, of k and both masses; u has a mass of one."""
        k, *others = np.exp(logs)
        return np.diag(held) + share * k * np.outer(row / np.array([1.0, *others]), row)

    logs = fsolve(
        lambda logs: np.sort(np.linalg.eigvals(over_mass(logs)).real) / squares - 1.0,
        np.log([squares[2] / 2.0, 2.0, 2.0]),
        xtol=1e-13,
    )
    whole = np.eye(6)
    for share in (1.05, 0.95):  # half of the cycle each
        rate = np.block(
            [[np.zeros((3, 3)), np.eye(3)], [-over_mass(logs, share), np.zeros((3, 3))]]
        )
        whole = expm(0.5 / speed * rate) @ whole
    return np.abs(np.linalg.eigvals(whole)).max()


@pytest.mark.parametrize(
    ("speed", "grows"),
    [
        (11.1, False),
        (11.2, False),  # printed as unstable, 0.03 beside the edge
        (11.25, True),
        (11.55, True),
        (11.6, False),
        (11.7, False),
        (7.25, True),
        (7.79, True),
    ],
)
def test_the_printed_speeds_by_equations_written_again(speed, grows):
    """The pair in the printed unit, and the gear set made from it."""
    exact = monodromy_at(speed)
    assert (exact > 1.001) == grows
    pair = periodic_system(pair_system(0.1))
    assert largest_multiplier(pair, speed)[0] == pytest.approx(exact, abs=1e-7)
    edits = {"dynamics.damping_ratio": 0.0, "mesh.1.stiffness_variation": 0.1}
    model = LumpedModel(
        number=1, excitation=ExcitationSettings(kind="rectangular"), translations=True
    )
    system = lumped_system(load_gear_set("liu-friction", edits), 100.0, model)
    unit = system.resonances_Hz[0] / COUPLED[0]
    varying = periodic_system(system)
    assert largest_multiplier(varying, unit * speed)[0] == pytest.approx(
        exact, abs=2e-4
    )


def test_difference_type_comes_with_friction_only():
    kinds = [
        {
            interval.kind
            for interval in scan_stability(periodic_system(pair), SPEEDS).intervals
        }
        for pair in (
            pair_system(0.3, 0.001),
            pair_system(0.3, 0.001, ToothFriction(0.1)),
        )
    ]
    differences = [{kind for kind in names if " - " in kind} for names in kinds]
    assert not differences[0]
    assert "f3 - f1" in differences[1]


@settings(max_examples=100, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_sum_type_is_wider_where_the_real_part_of_psi_is_positive(seed):
    """For pairs of random gears; Appendix B has it positive for any.

    Where the stiffness hardly couples two modes friction makes it negative, and then
    differences are the wider ones.
    """
    random = np.random.default_rng(seed)
    base = pair_system(random.uniform(0.05, 0.6), 0.0)
    gears = [
        type(gear)(
            **{
                **vars(gear),
                "mass": gear.mass * random.uniform(0.2, 5.0),
                "inertia": gear.inertia * random.uniform(0.2, 5.0),
                "bearing_stiffness": tuple(
                    k * random.uniform(0.1, 10.0) for k in gear.bearing_stiffness
                ),
            }
        )
        for gear in base.train.gears
    ]
    train = type(base.train)(
        gears=tuple(gears), meshes=base.train.meshes, damping_ratio=0.0005
    )
    rub = (ToothFriction(random.uniform(0.01, 0.05)),)
    varying = periodic_system(type(base)(train, base.excitations, friction=rub))
    resonances = {}
    for resonance in combinations(varying):
        modes = resonance.first, resonance.second
        resonances[resonance.kind, *modes, resonance.order] = resonance
    squares, right = np.linalg.eig(varying.mean)
    right = right[:, np.argsort(squares)]
    for (kind, first, second, order), difference in resonances.items():
        if kind != "difference" or not difference.unstable:
            continue
        harmonic = varying.harmonic(round(order * varying.length))
        coupling = np.linalg.solve(right, harmonic @ right)
        psi = coupling[second, first] * coupling[first, second].conjugate()
        other = resonances["sum", first, second, order]
        sizes = (resonance.high - resonance.low for resonance in (other, difference))
        assert np.subtract(*np.nan_to_num(list(sizes))) * psi.real > 0.0


def whole_monodromy(speed, rub, eps, damping):
    """Of all of eq. 4.44, u, x1, y1, x2, y2 with the sign of eq. 4.40, by integration
    between the jumps of the stiffness; modal damping."""
    share, gamma, ratio = 0.6, 0.28, 1.5
    pair = pair_system(eps)
    k, masses = pair.excitations[0].mean_stiffness, [g.mass for g in pair.train.gears]
    mass = np.array([1.0, masses[0], masses[0], masses[1], masses[1]])
    row = np.array([1.0, 0.0, 1.0, 0.0, -1.0])
    held = mass * np.repeat([0.0, *ACROSS], [1, 2, 2]) ** 2 * (2.0 * math.pi) ** 2
    root = np.sqrt(mass)
    mean = (np.diag(held) + k * np.outer(row, row)) / np.outer(root, root)
    squares, shapes = np.linalg.eigh(mean)
    rates = 2.0 * damping * (shapes * np.sqrt(squares)) @ shapes.T
    rates *= root / root[:, None]
    eta, pitch = masses[1] / sum(masses), 2.0 * math.pi * RADII[0] / 38
    slope = math.tan(math.radians(20.0))

    def pull(place):
        """K + L over the mass."""
        low, high = 1.0 + eps * (1.0 - ratio), 1.0 + eps * (2.0 - ratio)
        part = (place - gamma) / (ratio - 1.0)
        fraction = share + (1.0 - 2.0 * share) * part
        loads = high * fraction, high * (1.0 - fraction)
        if not 0.0 <= part <= 1.0:
            loads = (low, 0.0) if part < 0.0 else (0.0, low)
        total = np.diag(held)
        for side, way, load in zip((-1, 1), (place, place - 1.0), loads, strict=True):
            arms = RADII[0] * slope + way * pitch, RADII[1] * slope - way * pitch
            turn = eta * arms[0] / RADII[0] + (1.0 - eta) * arms[1] / RADII[1]
            across = np.array([turn, -1.0, 0.0, 1.0, 0.0])
            stiff = k * load * (1.0 + side * rub.bending * rub.coefficient)
            total = total + stiff * np.outer(row - side * rub.coefficient * across, row)
        return total / mass[:, None]

    def rate(t, y):
        q, v = y.reshape(2, 5, 10)
        return np.stack([v, -pull(t * speed) @ q - rates @ v]).ravel()

    state = np.eye(10).ravel()
    for start, end in pairwise([0.0, gamma, gamma + ratio - 1.0, 1.0]):
        span = (start + 1e-12) / speed, (end - 1e-12) / speed
        state = solve_ivp(rate, span, state, "DOP853", rtol=1e-9, atol=1e-10).y[:, -1]
    return state.reshape(10, 10)


@pytest.mark.parametrize("across", ACROSS)
@pytest.mark.parametrize("mode", [0, 1, 2])
@pytest.mark.parametrize("sign", [1, -1])
def test_no_mode_with_rotation_grows_with_one_across(mode, across, sign):
    """Where both would meet the mesh frequency multipliers are those of the modes with
    rotation and, damped, of the others: these drive nothing."""
    rub, damping = ToothFriction(0.2, 0.4), 0.004
    speed = abs(COUPLED[mode] + sign * across)
    system = pair_system(0.3, damping, rub)
    assert system.moving.size == 3
    exact = np.linalg.eigvals(whole_monodromy(speed, rub, 0.3, damping))
    modal_multipliers = multipliers(periodic_system(system), speed)[0].tolist()
    for hertz in ACROSS:
        angular = 2.0 * math.pi * hertz / speed
        free = np.exp((-damping + 1j * math.sqrt(1.0 - damping**2)) * angular)
        modal_multipliers += [free, free.conjugate()]
    for value in modal_multipliers:
        assert np.abs(exact - value).min() < 1e-6


@pytest.mark.parametrize(
    ("kwargs", "message"),
    [
        ({"coefficient": -0.1}, "coefficient = .*; must be 0"),
        ({"coefficient": 1.0}, "coefficient = .*; must be 0"),
        ({"coefficient": math.nan}, "coefficient = .*; must be 0"),
        ({"coefficient": 0.1, "bending": 2.0}, "bending = .*; must be 0"),
    ],
)
def test_friction_that_cannot_be(kwargs, message):
    with pytest.raises(ValueError, match=message):
        ToothFriction(**kwargs)


def test_friction_is_of_every_mesh():
    pair = pair_system(0.3)
    with pytest.raises(TrainError, match="friction: 2 for 1 meshes"):
        LumpedSystem(pair.train, pair.excitations, friction=(ToothFriction(0.1),) * 2)


def test_friction_needs_tooth_pairs():
    pair = pair_system(0.3)
    one = analytic_excitation(
        StiffnessParameters(mean=1e8, variation=0.3, contact_ratio=1.5), harmonics=3
    )
    with pytest.raises(ValueError, match="that of model 1"):
        with_bending(one, ToothFriction(0.1))
    with pytest.raises(TrainError, match="needs tooth pairs"):
        LumpedSystem(pair.train, (one,), friction=(ToothFriction(0.1),))


@pytest.mark.parametrize("speed", [0.0, -1.0, math.nan, math.inf])
def test_speeds_are_positive(speed):
    with pytest.raises(ValueError, match=r"frequency = .*; must be positive"):
        transition(periodic_system(pair_system(0.3)), [7.0, speed])


def test_harmonics_are_those_of_the_meshes():
    """Of a counter-shaft that repeats after five periods of the first mesh."""
    source = ExcitationSettings(kind="rectangular")
    model = LumpedModel(number=1, excitation=source, friction=0.1, bending=0.4)
    gears = load_gear_set("liu-countershaft-2")
    varying = periodic_system(lumped_system(gears, 100.0, model))
    assert varying.length == 5.0
    orders = varying.orders(3)
    assert orders == [3, 5, 6, 9, 10, 12, 15]
    sizes = {s: np.abs(varying.harmonic(s)).max() for s in range(1, 16)}
    assert min(sizes[s] for s in orders if s not in (6, 10, 12)) > 1e-3 * sizes[5]
    assert max(size for s, size in sizes.items() if s not in orders) < 1e-9 * sizes[5]


@pytest.mark.parametrize("kind", ["trapezoid", "fourier"])
def test_pieces_of_time_are_the_stiffness_of_meshes_at_other_rates(kind):
    """Of a counter-shaft whose second mesh is slower."""
    source, gears = ExcitationSettings(kind=kind), load_gear_set("liu-countershaft-2")
    system = lumped_system(gears, 100.0, LumpedModel(number=1, excitation=source))
    varying = periodic_system(system)
    times = np.random.default_rng(0).uniform(0.0, varying.length, 40)
    piece = np.searchsorted(varying.edges, times, "right") - 1
    computed = varying.at(times - varying.edges[piece], piece)
    expected = np.zeros_like(computed)
    v = system.arrays.shapes
    for m, excitation in enumerate(system.excitations):
        mesh, rate = system.train.meshes[m], float(system.train.mesh_rates[m])
        x = (mesh.phase + rate * times) % 1.0
        k = sum(pair.stiffness(x) for pair in excitation.pairs)
        expected += np.einsum("t,i,j->tij", k, v[m], v[m])
    apart, by_hand = computed - computed[0], expected - expected[0]
    assert np.ptp(by_hand) > 0.0
    assert np.abs(apart - by_hand).max() < 1e-9 * np.abs(by_hand).max()


def test_the_recursion_of_the_source_and_the_series_are_one():
    """Figure 5.4: round-off at 20 terms and a step of 0.5, a = b = -1."""
    a, b, h = -1.0, -1.0, 0.5
    G = first_order_form(a, b)
    stiffness, edges = np.array([[[[b]], [[a]]]]), np.array([0.0, h])
    system = PeriodicSystem(np.ones(1), np.zeros(1), edges, stiffness)
    exact = exact_transition(a, b, h)
    errors = [np.abs(recursion(G, h, n) - exact).max() for n in (4, 8, 12, 20)]
    assert errors[0] > 1e-4 > errors[1] > 1e-12
    assert errors[-1] < 1e-14
    np.testing.assert_allclose(transition(system, 1.0)[0], exact, atol=1e-14)
    for divisions, least in ((20, 1e-6), (200, 1e-8)):
        matrix = transition(system.averaged(divisions), 1.0)[0]
        assert least < np.abs(matrix - exact).max() < 1e3 * least


def test_pitch_errors_change_no_stability():
    """They move the teeth, which stay in contact, and not their stiffness."""
    teeth = load_gear_set("liu-pair").gears[0].geometry.teeth
    off = {"gear.1.pitch_errors_um": [0.0] * (teeth - 1) + [3.0]}
    model = LumpedModel(number=1, excitation=ExcitationSettings(kind="rectangular"))
    one, other = (
        periodic_system(lumped_system(load_gear_set("liu-pair", edits), 100.0, model))
        for edits in ({}, off)
    )
    at = np.linspace(1000.0, 6000.0, 7)
    np.testing.assert_array_equal(
        largest_multiplier(one, at), largest_multiplier(other, at)
    )


def test_growth_beyond_all_numbers_is_infinite():
    """Motions of q'' = q over 2000 periods of 1 s grow by e^2000, one of two modes."""
    stiffness = np.diag([-1.0, 1e-2])[None, None]
    length = np.array([0.0, 2000.0])
    system = PeriodicSystem(np.array([1.0, 0.1]), np.zeros(2), length, stiffness)
    scaled, growth = scaled_transition(system, 1.0)
    largest = np.log(np.abs(np.linalg.eigvals(scaled)).max(axis=1)) + growth
    assert largest == pytest.approx(2000.0, rel=1e-12)
    assert largest_multiplier(system, 1.0) == math.inf
    assert np.isinf(transition(system, 1.0)[0][0, 0])
