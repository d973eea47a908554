"""The coupled model where it must be exact: one ingredient at a time, and limits.

Gears are rims on elastic spokes, `rim_gears`. Where all inertia is in the hub nothing
but static compliance is missing in Model-1; where all is in the rim the hub follows it,
and the inertia relief of the body is exact.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as checked
from hypothesis import strategies as st
from rim_gears import FIRM, FREE, INERTIAS, RADII, STIFF, TORQUE, RimGears
from scipy.integrate import quad

from lumped import Settings, respond
from lumped.steady.integration_settings import CONTACT_STEPS
from lumped.steady.steady_state import Diverged, Speed
from lumped.steady.steppers import FixedStepper, steps_per_period, warm_up
from validation.oracles.coupled_train import instant_of

FORCE = TORQUE / RADII[0]
EXACT = Settings(steps=256, tolerance=1e-9)
RIGHT = 3e-6  # what settling leaves
FINE = Settings(steps=2048, step_angle=2.0, tolerance=1e-9)
CLOSE = Settings(steps=128, step_angle=2.0, tolerance=1e-9)  # on all corners


WAVES = ((0.0, 3e-7), (1e-6, 2e-7), (5e-7, 2e-7), (0.0, 3e-7))
SOFT = 1.5e-9  # m/N of a gear's spokes: half of a contact's compliance
RELIEVED = ((0.0, 0.0), (1.2e-5, 2e-7), *WAVES[2:])  # the second pair carries little
TWO = ((STIFF / 2.0, 0.0),) * 4
CASES = {
    "pairs": RimGears(spokes=SOFT, pairs=2, gap=RELIEVED, stiffness=TWO),
    "meshes": RimGears(gears=3, spokes=SOFT, gap=WAVES),
    "body": RimGears(spokes=SOFT, in_rim=1.0, gap=WAVES, damping=0.01),
}


def still(gaps):
    return tuple((mean, 0.0) for mean, _ in gaps)


@pytest.mark.parametrize("name", CASES)
def test_statics_and_frequencies_are_those_of_rims_on_spokes(name):
    case = replace(CASES[name], gap=still(CASES[name].gap))
    system = case.coupled
    deflection = system.loaded.deflection
    np.testing.assert_allclose(
        deflection, np.tile(case.exact_static, (len(deflection), 1))
    )
    exact = case.dense.angular / (2.0 * np.pi)
    np.testing.assert_allclose(system.resonances_Hz, exact, rtol=1e-9)
    less = replace(case, without=(name,)).coupled.resonances_Hz
    assert np.abs(less / exact - 1.0).max() > 0.02


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("part", [0.4, 1.6])
def test_vibration_is_that_of_rims_on_spokes(name, part):
    """Contacts stay closed: the dense system's forced vibration is exact."""
    case = replace(CASES[name], positions=512)
    frequency = part * case.dense.angular[-1] / (2.0 * np.pi)
    expected = case.exact_rms(frequency)
    response = respond(case.coupled, frequency, EXACT)
    assert not response.contact_loss.any()
    # damping turns a hub without inertia against its rim, which is left out
    bound = 1e-3 if name == "body" else 1e-4
    np.testing.assert_allclose(response.dte_rms, expected, rtol=bound)
    less = respond(replace(case, without=(name,)).coupled, frequency, EXACT)
    assert np.abs(less.dte_rms / expected - 1.0).max() > 10.0 * bound


def test_a_body_that_is_all_rim_is_as_if_its_spokes_were_rigid():
    """Held by its hub it would be softer by a factor that is known."""
    case = RimGears(spokes=SOFT, in_rim=1.0, ground=FREE)
    free, held = (
        replace(case, without=names).coupled.resonances_Hz[-1] * 2.0 * math.pi
        for names in ((), ("body",))
    )
    inverse = (RADII[:2] ** 2 / INERTIAS[:2]).sum()
    assert free == pytest.approx(math.sqrt(STIFF * inverse), rel=1e-12)
    assert held == pytest.approx(free / math.sqrt(1.0 + 2.0 * SOFT * STIFF), rel=1e-12)


def test_an_idler_without_its_meshes_is_off_by_what_they_share():
    """Equal ends: the modes see the sum and the difference of two compliances."""
    case = RimGears(
        gears=3,
        spokes=SOFT,
        ground=FREE,
        radii=(RADII[0], RADII[1], RADII[0]),
        inertias=(INERTIAS[0], INERTIAS[1], INERTIAS[0]),
    )
    direct, shared = 1.0 / STIFF + 2.0 * SOFT, SOFT
    whole = case.coupled.resonances_Hz
    less = replace(case, without=("meshes",)).coupled.resonances_Hz
    # the lower mode turns the ends against each other and leaves the idler still
    expected = [math.sqrt(direct / (direct - s)) for s in (shared, -shared)]
    ratios = whole / less
    np.testing.assert_allclose(np.sort(ratios), np.sort(expected), rtol=1e-12)


@pytest.mark.parametrize("part", [1.6, 3.0])
def test_relief_opens_one_of_two_pairs_that_share_a_body(part):
    """The second pair touches when the first's own spring yields by the gap."""
    gap = part * 1e-6
    touches = 0.5 * STIFF * gap  # of the load, whatever the body yields
    case = RimGears(
        spokes=SOFT,
        pairs=2,
        stiffness=TWO,
        gap=((0.0, 0.0), (gap, 0.0)),
        ground=FREE,
        torque=RADII[0] * 300.0,
    )
    load, k, c = 300.0, STIFF / 2, 2.0 * SOFT
    closed = load > touches
    loads = np.array([load + k * gap, load - k * gap]) / 2.0 if closed else [load, 0.0]
    inverse = (RADII[:2] ** 2 / INERTIAS[:2]).sum()
    system, less = case.coupled, replace(case, without=("pairs",)).coupled
    for model in (system, less):
        np.testing.assert_allclose(model.loaded.load[0], loads, rtol=1e-9, atol=1e-6)
    softness = c + 1.0 / (k * (2.0 if closed else 1.0))
    stiffness = (2.0 * np.pi * system.resonances_Hz) ** 2 / inverse
    np.testing.assert_allclose(stiffness, 1.0 / softness, rtol=1e-9)
    if closed:
        compliances = c * (1.0 + loads[::-1] / loads)
        alone = (1.0 / (1.0 / k + compliances)).sum()
        stiffness = (2.0 * np.pi * less.resonances_Hz) ** 2 / inverse
        np.testing.assert_allclose(stiffness, alone, rtol=1e-9)
        assert abs(alone * softness - 1.0) > 0.05


def free_period(mass, size):
    """Of x about rest at FORCE under F = k x + h x^2, from x at rest [s]."""

    def potential(x):
        return STIFF * x**2 / 2.0 + HARDENING * x**3 / 3.0 - FORCE * x

    rest = (math.sqrt(STIFF**2 + 4.0 * HARDENING * FORCE) - STIFF) / (2.0 * HARDENING)
    start = rest + size
    cubic = [HARDENING / 3.0, STIFF / 2.0, -FORCE, -potential(start)]
    other = max(x.real for x in np.roots(cubic) if x.real < rest)
    assert other > 0.0, "contact must hold"
    middle, half = 0.5 * (start + other), 0.5 * (start - other)

    def slowness(angle):
        x = middle + half * math.sin(angle)
        return half * math.cos(angle) / math.sqrt(potential(start) - potential(x))

    whole, _ = quad(slowness, -0.5 * math.pi, 0.5 * math.pi, epsabs=0.0, epsrel=1e-10)
    return math.sqrt(2.0 * mass) * whole, rest


HARDENING = 2e13  # N/m2


def test_free_vibration_of_a_hardening_contact_has_the_period_of_its_energy():
    """Of finite size, by the integral over the potential well."""
    case = RimGears(ground=FREE, hardening=HARDENING, damping=0.0)
    mass = 1.0 / (RADII[:2] ** 2 / INERTIAS[:2]).sum()
    size = 2e-6
    period, rest = free_period(mass, size)
    secant = 2.0 * math.pi * math.sqrt(mass * rest / FORCE)
    assert secant / period > 1.1

    def back_after(system, time):
        """Distance from the start after a time, of the amplitude."""
        state = system.static_state
        state = state * (rest + size) / (system.arrays.shapes @ state[0])
        at = Speed(1.0 / time, Settings(steps=256))
        after, history = FixedStepper(system).record(state, at, 1)
        assert history.deflection[0, 0] == pytest.approx(rest + size, rel=1e-9)
        return np.abs(after[0] / state[0] - 1.0) * (rest + size) / size

    less = replace(case, without=("hardening",)).coupled
    assert back_after(case.coupled, period) < 1e-7
    assert back_after(less, secant) < 1e-7
    expected = 1.0 - math.cos(2.0 * math.pi * period / secant)
    assert back_after(less, period) == pytest.approx(expected, rel=1e-3)


def test_what_diverges_is_warmed_up_all_the_same(monkeypatch):
    """So that a budget shows a model that diverges next to the others."""
    seen = []

    def diverge(self, *arguments):
        seen.append(arguments)
        raise Diverged(0.0)

    monkeypatch.setattr(FixedStepper, "monodromy", diverge)
    warm_up(FixedStepper(replace(FIRM, damping=0.02).coupled), 900.0, Settings())
    assert seen


def test_resonances_of_harmonics_take_more_steps():
    """Large steps would shift sharp ones, and take high harmonics for lower ones; a
    refined run doubles the steps that they take."""
    sharp, broad = (replace(FIRM, damping=d).coupled for d in (0.005, 0.05))
    highest = sharp.highest_mesh_mode_angular / (2.0 * math.pi)
    frequency = highest / 8.0
    for system in (sharp, broad):
        many = steps_per_period(system, frequency, Settings())
        assert 200 < many < 300
        assert steps_per_period(system, highest, Settings()) == CONTACT_STEPS
        settings = FixedStepper(system).refined(frequency, Settings(), repeats=True)
        assert steps_per_period(system, frequency, settings) >= 2 * many
        coarse, fine = (
            respond(system, frequency, replace(settings, steps=steps)).dte_rms
            for steps in (many, 1024)
        )
        np.testing.assert_allclose(coarse, fine, rtol=0.05)
    # the fortieth harmonic is small: only sharp resonances need more than the finest
    most, enough = (
        steps_per_period(system, highest / 40.0, Settings())
        for system in (sharp, broad)
    )
    assert most > enough >= 512


@pytest.mark.parametrize("backlash", [math.inf, 5e-6])
@pytest.mark.parametrize("frequency", [900.0, 1500.0, 2900.0])
def test_rigid_bodies_lead_back_to_model_1(backlash, frequency):
    """The same springs: steps of either scheme end on their corners, beyond which
    those of the coupled model lose the order of their cubics."""
    case = replace(FIRM, backlash=backlash, damping=0.02)
    both = case.model_1, case.coupled
    one, two = (respond(system, frequency, FINE) for system in both)
    assert one.multiple == two.multiple > 0
    for name in ("dte_rms", "dte_mean", "force_peak", "contact_loss", "back_side"):
        expected = getattr(one, name)
        bound = 1e-3 if name == "contact_loss" else RIGHT
        np.testing.assert_allclose(getattr(two, name), expected, rtol=bound, atol=1e-12)


YIELDING = replace(FIRM, spokes=SOFT, in_rim=0.6, backlash=2e-5, damping=0.02)
SHAKEN = pytest.mark.parametrize("frequency", [900.0, 3400.0])


@SHAKEN
def test_a_train_listed_from_its_other_end_moves_alike(frequency):
    case = YIELDING
    other = replace(
        case,
        **{
            name: getattr(case, name)[::-1]
            for name in ("radii", "inertias", "ground", "stiffness", "gap")
        },
        torque=case.torque * RADII[2] / RADII[0],
        phase=-case.phase,
    )
    one, two = (respond(model.coupled, frequency, FINE) for model in (case, other))
    for name in ("dte_rms", "dte_mean", "force_peak", "contact_loss"):
        expected, mirrored = getattr(one, name), getattr(two, name)[::-1]
        np.testing.assert_allclose(mirrored, expected, rtol=RIGHT, atol=1e-12)


@SHAKEN
def test_torque_the_other_way_moves_the_back_flanks_alike(frequency):
    case = replace(YIELDING, gap=((0.0, 0.0),) * 4, ground=FREE)
    other = replace(case, torque=-case.torque)
    one, two = (respond(model.coupled, frequency, CLOSE) for model in (case, other))
    for name in ("dte_rms", "force_peak", "contact_loss"):
        expected, mirrored = getattr(one, name), getattr(two, name)
        np.testing.assert_allclose(mirrored, expected, rtol=RIGHT, atol=1e-9)
    np.testing.assert_allclose(two.dte_mean, -one.dte_mean - case.backlash, rtol=RIGHT)
    in_contact = 1.0 - two.contact_loss
    np.testing.assert_allclose(two.back_side, in_contact, rtol=RIGHT)


decades = st.floats(-3.0, 3.0)


@checked(max_examples=12)
@given(decades, decades)
def test_linear_contacts_know_no_load_and_no_stiffness_of_their_own(load, stiff):
    """Deflections in proportion to the load, speeds to the root of the stiffness."""
    size, firm = 10.0**load, 10.0**stiff

    def scaled(values, factor):
        return tuple((factor * mean, factor * wave) for mean, wave in values)

    case = YIELDING
    other = replace(
        case,
        torque=size * firm * case.torque,
        spokes=SOFT / firm,
        stiffness=scaled(case.stiffness, firm),
        gap=scaled(case.gap, size),
        backlash=size * case.backlash,
        ground=tuple(firm * spring for spring in case.ground),
    )
    one = respond(case.coupled, 1500.0)
    two = respond(other.coupled, 1500.0 * math.sqrt(firm))
    np.testing.assert_allclose(two.dte_rms, size * one.dte_rms, rtol=1e-5)
    np.testing.assert_allclose(two.force_peak, size * firm * one.force_peak, rtol=1e-5)


MOVING = replace(
    FIRM, spokes=SOFT, in_rim=0.6, hardening=1e13, gap=WAVES, positions=32, phase=0.0
)


def test_undamped_motion_in_one_place_keeps_its_energy():
    """To the order of the scheme; the energy is that of the oracle."""
    fixed = tuple((mean, 0.0) for mean, _ in MOVING.stiffness)
    case = replace(MOVING, gap=still(MOVING.gap), stiffness=fixed, damping=0.0)
    system = case.coupled
    place = instant_of(system, 0.0)
    state = system.static_state.copy()
    state[1] = 0.1 * np.abs(state[0]) * 2.0 * np.pi * system.loaded.frequency_Hz

    def energy(q, v):
        return 0.5 * float(v @ v) + place.potential(q)

    rest = place.potential(state[0])
    counts, drifts = (24, 48, 96), []
    for steps in counts:
        at = Speed(system.resonances_Hz[-1], Settings(steps=steps, step_angle=2.0))
        after, history = FixedStepper(system).record(state, at, 20)
        assert (history.drive_overlap > 0.0).all()
        given_in = energy(*state) - rest
        drifts.append(abs(energy(*after) - energy(*state)) / given_in)
    orders = -np.diff(np.log(drifts)) / np.diff(np.log(counts))
    assert (orders > 3.8).all()
    assert drifts[-1] < 1e-5


@dataclass(frozen=True, eq=False)
class ShortStepper(FixedStepper):
    """Ends after so many steps of the common period."""

    count: int = 0

    def kernel_arguments(self, at):
        arrays, steps = super().kernel_arguments(at)
        return arrays, steps._replace(h=steps.h[: self.count])


def states_over_a_cycle(system, at, state):
    """From a state at the start of a cycle on, (steps + 1, 2, n)."""
    counts = range(1, at.settings.steps + 1)
    later = [ShortStepper(system, n).record(state, at, 1)[0] for n in counts]
    return np.array([state, *later])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("frequency", "damping", "lost"), [(1500.0, 0.04, False), (2000.0, 0.01, True)]
)
def test_moving_contacts_give_what_damping_takes(frequency, damping, lost):
    """Over a settled cycle.

    The energy of the contacts depends on their place. Where the place moves on from
    one time to the next while nothing else does, it changes by what the drive of the
    gears puts in.
    """
    system = replace(MOVING, damping=damping).coupled
    gaps = []
    for steps in (64, 128, 256):
        settings = Settings(steps=steps, step_angle=2.0, tolerance=1e-9)
        response = respond(system, frequency, settings)
        assert response.multiple == 1
        assert (response.contact_loss > 0.0).any() == lost
        at = Speed(frequency, settings)
        q, v = states_over_a_cycle(system, at, response.state).swapaxes(0, 1)
        places = [instant_of(system, k / (len(q) - 1)) for k in range(len(q))]
        given_in = sum(
            0.5 * (later.potential(x) - now.potential(x))
            for k, (now, later) in enumerate(pairwise(places))
            for x in (q[k], q[k + 1])
        )
        power = np.einsum("ki,ij,kj->k", v, system.coupled_arrays.damping, v)
        taken = power[:-1].sum() / (frequency * (len(q) - 1))
        gaps.append(abs(given_in / taken - 1.0))
    # of second order; where contact is lost the error hangs on where steps fall
    assert gaps[-1] < gaps[0] / 8.0
    assert gaps[-1] < 2e-3
