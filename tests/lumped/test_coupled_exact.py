"""The coupled model where it must be exact: one ingredient at a time, and limits.

Gears are rims on elastic spokes. Where all inertia is in the hub nothing but static
compliance is missing in Model-1; where all is in the rim the hub follows it, and the
inertia relief of the body is exact.
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
from scipy.integrate import quad

from lumped import (
    Gear,
    LumpedSystem,
    Mesh,
    MeshExcitation,
    PairExcitation,
    Settings,
    Train,
    Wave,
    respond,
)
from lumped.coupled import CoupledContacts
from lumped.kernels.arrays import Contacts
from lumped.steady_state import Speed
from lumped.steppers import FixedStepper
from validation.oracles.coupled_train import instant_of
from validation.oracles.rim_train import RimTrain

RADII = np.array([0.04535, 0.06564, 0.11218])  # m, Table 2.1
INERTIAS = np.array([0.002621, 0.01091, 0.1193])  # kg m2
GROUND = (3e4, 5e4, 1e6)  # N m/rad, firm, so that all modes decay soon
FREE = (0.0, 0.0, 0.0)
STIFF = 3e8  # N/m
TORQUE = 100.0  # N m
FORCE = TORQUE / RADII[0]
CELLS = 8  # of a law
EXACT = Settings(steps=256, tolerance=1e-9)
RIGHT = 3e-6  # what settling leaves
CLOSE = Settings(steps=128, step_angle=2.0, tolerance=1e-9)  # on all corners


@dataclass(frozen=True, kw_only=True)
class Rims:
    """A row of gears that are rims on spokes.

    spokes : m of deflection at the base circle per newton, of every gear
    in_rim : part of the inertia in the rim
    pairs : contacts of each mesh; gap : (pairs, 2) mean and amplitude over the cycle
        of each [m]; stiffness : likewise [N/m]
    hardening : of every contact [N/m2]
    ground : couplings of the gears [N m/rad]
    backlash : of meshes with back flanks [m]
    """

    gears: int = 2
    spokes: float = 0.0
    in_rim: float = 0.0
    pairs: int = 1
    gap: tuple[tuple[float, float], ...] = ((0.0, 0.0),) * 4
    stiffness: tuple[tuple[float, float], ...] = ((STIFF, 0.0),) * 4
    hardening: float = 0.0
    without: tuple[str, ...] = ()
    torque: float = TORQUE
    ground: tuple[float, ...] = tuple(GROUND)
    damping: float = 0.04
    backlash: float = math.inf
    phase: float = 0.0
    inertias: tuple[float, ...] = tuple(INERTIAS)
    radii: tuple[float, ...] = tuple(RADII)
    positions: int = 64

    @property
    def train(self) -> Train:
        last, turn = self.gears - 1, 1.0 if self.gears % 2 else -1.0
        torques = [0.0] * self.gears
        torques[0] = self.torque
        torques[last] = -turn * self.torque * self.radii[last] / self.radii[0]
        gears = [
            Gear(
                name=f"gear {g}",
                teeth=40 + g,
                base_radius=self.radii[g],
                inertia=self.inertias[g],
                coupling_stiffness=self.ground[g],
                torque=torques[g],
            )
            for g in range(self.gears)
        ]
        phases = [0.0, self.phase]
        meshes = [
            Mesh(
                driver=m,
                driven=m + 1,
                pressure_angle=0.37,
                backlash=self.backlash,
                phase=phases[m],
            )
            for m in range(last)
        ]
        return Train(
            gears=tuple(gears), meshes=tuple(meshes), damping_ratio=self.damping
        )

    @property
    def model_1(self) -> LumpedSystem:
        """Of rigid gears, with the same springs."""
        return LumpedSystem(self.train, tuple(map(self._excitation, range(self.last))))

    @property
    def last(self) -> int:
        return self.gears - 1

    def _at(self, values: tuple[tuple[float, float], ...], mesh: int, pair: int):
        """(p + 1,) over the cycle of a mesh."""
        mean, size = values[mesh * self.pairs + pair]
        p = np.arange(self.positions + 1) / self.positions
        phase = self.train.meshes[mesh].phase + 0.25 * pair
        return mean + size * np.cos(2.0 * np.pi * (p + phase))

    def _excitation(self, mesh: int) -> MeshExcitation:
        pairs = []
        breaks = np.arange(self.positions + 1) / self.positions
        # tables of contacts begin at the phase of their mesh, waves at position 0
        shift = round(self.train.meshes[mesh].phase * self.positions)
        for pair in range(self.pairs):
            waves = []
            for values in (self.stiffness, self.gap):
                y = np.roll(self._at(values, mesh, pair)[:-1], shift)
                y = np.append(y, y[0])
                rows = np.zeros((self.positions, 4))
                rows[:, 0], rows[:, 1] = y[:-1], np.diff(y) * self.positions
                corners = tuple(breaks[:-1]) if np.ptp(y) else ()
                waves.append(Wave(breaks, rows, corners))
            pairs.append(PairExcitation(*waves))
        mean = sum(self.stiffness[mesh * self.pairs + k][0] for k in range(self.pairs))
        return MeshExcitation(tuple(pairs), mean)

    @property
    def contacts(self) -> list[tuple[int, int, float]]:
        """Mesh, pair and side of each."""
        sides = (1.0, -1.0) if self.backlash < math.inf else (1.0,)
        meshes, pairs = range(self.last), range(self.pairs)
        return [(m, k, side) for m in meshes for side in sides for k in pairs]

    @property
    def arms(self) -> np.ndarray:
        """Penetration (c, n) per turn of each gear's rim [m]."""
        rows = self.model_1.modes.coordinates.mesh_rows
        return np.array([side * rows[m] for m, _, side in self.contacts])

    @property
    def compliance(self) -> np.ndarray:
        """Of the spokes of each gear (n,) [rad/(N m)]."""
        return self.spokes / np.array(self.radii[: self.gears]) ** 2

    @property
    def coupled(self) -> LumpedSystem:
        reference, arms = self.model_1, self.arms
        shapes = reference.modes.shapes[:, reference.moving]
        rim = self.in_rim * np.array(self.inertias[: self.gears])
        static = (arms * self.compliance) @ arms.T
        grid = self.positions + 1
        found = CoupledContacts(
            contacts=self._contacts(np.tile(static, (grid, 1, 1))),
            mesh_of=np.array([m for m, _, _ in self.contacts]),
            pairs=np.array([k for _, k, _ in self.contacts]),
            paths=np.tile([0.0, float(self.pairs)], (self.last, 1)),
            rows=np.repeat((arms @ shapes)[:, None], grid, axis=1),
            inertial=np.repeat(
                ((arms * rim * self.compliance) @ shapes)[:, None], grid, axis=1
            ),
            work=(shapes.T * (rim**2 * self.compliance)) @ shapes,
            without=self.without,
        )
        return replace(reference, contacts=found)

    def _contacts(self, static: np.ndarray) -> Contacts:
        count, grid = static.shape[1:], self.positions + 1
        reach = 20.0 * abs(self.torque) / self.radii[0] / STIFF
        knots = reach * np.linspace(0.0, 1.0, CELLS + 1) ** 2
        law, gap = np.zeros((count[0], grid, 2, CELLS, 4)), np.empty((count[0], grid))
        for c, (m, k, side) in enumerate(self.contacts):
            stiff = self._at(self.stiffness, m, k)[:, None, None]
            law[c, ..., 0] = stiff * knots[:-1] + self.hardening * knots[:-1] ** 2
            law[c, ..., 1] = stiff + 2.0 * self.hardening * knots[:-1]
            own = self._at(self.gap, m, k)
            gap[c] = own if side > 0.0 else self.backlash - own
        law[..., 2] = self.hardening
        meshes = [m for m, _, _ in self.contacts]
        return Contacts(
            first=np.searchsorted(meshes, np.arange(self.gears)),
            side=np.array([side for _, _, side in self.contacts]),
            gap=gap,
            sliding=np.ones((count[0], grid)),
            arms=np.zeros((2, count[0], grid)),
            knots=np.tile(knots, (self.last, 1)),
            law=law,
            normal_compliance=static,
            tangential_compliance=np.zeros_like(static),
            errors=np.zeros((count[0], 0)),
        )

    @property
    def dense(self) -> RimTrain:
        """The same by hubs and rims, all contacts closed and linear."""
        inertia = np.array(self.inertias[: self.gears])
        train = self.train
        return RimTrain(
            hub=(1.0 - self.in_rim) * inertia,
            rim=self.in_rim * inertia,
            spokes=1.0 / self.compliance,
            ground=np.array([gear.coupling_stiffness for gear in train.gears]),
            torque=np.array([gear.torque for gear in train.gears]),
            rows=self.arms,
            stiffness=np.array(
                [self.stiffness[m * self.pairs + k][0] for m, k, _ in self.contacts]
            ),
        )

    def exact_rms(self, frequency: float) -> np.ndarray:
        """Of the meshes' deflections by their hubs (m,), contacts closed [m]."""
        phases = [
            self._at(((0.0, 1.0),) * 4, m, k)[0]
            + 1j * self._at(((0.0, 1.0),) * 4, m, k)[3 * self.positions // 4]
            for m, k, _ in self.contacts
        ]
        size = [self.gap[m * self.pairs + k][1] for m, k, _ in self.contacts]
        n, modes = self.gears, self.model_1.modes
        damping = np.zeros((2 * n, 2 * n))
        damping[:n, :n] = modes.damping_matrix(self.damping)
        turns = self.dense.harmonic_turns(
            2.0 * np.pi * frequency, np.array(size) * phases, damping
        )
        return np.abs(modes.coordinates.mesh_rows @ turns[:n]) / math.sqrt(2.0)

    @property
    def exact_static(self) -> np.ndarray:
        """Deflections (m,) by the hubs under the mean gaps [m]."""
        gaps = np.array([self.gap[m * self.pairs + k][0] for m, k, _ in self.contacts])
        turns = self.dense.static_turns(gaps)[: self.gears]
        return np.asarray(self.model_1.modes.coordinates.mesh_rows @ turns)


WAVES = ((0.0, 3e-7), (1e-6, 2e-7), (5e-7, 2e-7), (0.0, 3e-7))
SOFT = 1.5e-9  # m/N of a gear's spokes: half of a contact's compliance
RELIEVED = ((0.0, 0.0), (1.2e-5, 2e-7), *WAVES[2:])  # the second pair carries little
TWO = ((STIFF / 2.0, 0.0),) * 4
CASES = {
    "pairs": Rims(spokes=SOFT, pairs=2, gap=RELIEVED, stiffness=TWO),
    "meshes": Rims(gears=3, spokes=SOFT, gap=WAVES),
    "body": Rims(spokes=SOFT, in_rim=1.0, gap=WAVES, damping=0.01),
}


def still(gaps):
    return tuple((mean, 0.0) for mean, _ in gaps)


@pytest.mark.parametrize("name", CASES)
def test_statics_and_frequencies_are_those_of_rims_on_spokes(name):
    case = replace(CASES[name], gap=still(CASES[name].gap))
    system = case.coupled
    found = system.loaded.deflection
    np.testing.assert_allclose(found, np.tile(case.exact_static, (len(found), 1)))
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
    found = respond(case.coupled, frequency, EXACT)
    assert not found.contact_loss.any()
    # damping turns a hub without inertia against its rim, which is left out
    bound = 1e-3 if name == "body" else 1e-4
    np.testing.assert_allclose(found.dte_rms, expected, rtol=bound)
    less = respond(replace(case, without=(name,)).coupled, frequency, EXACT)
    assert np.abs(less.dte_rms / expected - 1.0).max() > 10.0 * bound


def test_a_body_that_is_all_rim_is_as_if_its_spokes_were_rigid():
    """Held by its hub it would be softer by a factor that is known."""
    case = Rims(spokes=SOFT, in_rim=1.0, ground=FREE)
    free, held = (
        replace(case, without=names).coupled.resonances_Hz[-1] * 2.0 * math.pi
        for names in ((), ("body",))
    )
    inverse = (RADII[:2] ** 2 / INERTIAS[:2]).sum()
    assert free == pytest.approx(math.sqrt(STIFF * inverse), rel=1e-12)
    assert held == pytest.approx(free / math.sqrt(1.0 + 2.0 * SOFT * STIFF), rel=1e-12)


def test_an_idler_without_its_meshes_is_off_by_what_they_share():
    """Equal ends: the modes see the sum and the difference of two compliances."""
    case = Rims(
        gears=3,
        spokes=SOFT,
        ground=FREE,
        radii=(RADII[0], RADII[1], RADII[0]),
        inertias=(INERTIAS[0], INERTIAS[1], INERTIAS[0]),
    )
    own, shared = 1.0 / STIFF + 2.0 * SOFT, SOFT
    whole = case.coupled.resonances_Hz
    less = replace(case, without=("meshes",)).coupled.resonances_Hz
    # the lower mode turns the ends against each other and leaves the idler still
    expected = [math.sqrt(own / (own - s)) for s in (shared, -shared)]
    found = whole / less
    np.testing.assert_allclose(np.sort(found), np.sort(expected), rtol=1e-12)


@pytest.mark.parametrize("part", [1.6, 3.0])
def test_relief_opens_one_of_two_pairs_that_share_a_body(part):
    """The second pair touches when the first's own spring yields by the gap."""
    gap = part * 1e-6
    touches = 0.5 * STIFF * gap  # of the load, whatever the body yields
    case = Rims(
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
    found = (2.0 * np.pi * system.resonances_Hz) ** 2 / inverse
    np.testing.assert_allclose(found, 1.0 / softness, rtol=1e-9)
    if closed:
        own = c * (1.0 + loads[::-1] / loads)
        alone = (1.0 / (1.0 / k + own)).sum()
        found = (2.0 * np.pi * less.resonances_Hz) ** 2 / inverse
        np.testing.assert_allclose(found, alone, rtol=1e-9)
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
    case = Rims(ground=FREE, hardening=HARDENING, damping=0.0)
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


FIRM = Rims(
    gears=3,
    pairs=2,
    stiffness=((2e8, 9e7), (2e8, 9e7), (1.8e8, 6e7), (1.8e8, 6e7)),
    gap=((1e-6, 1e-6),) * 4,
    positions=16,
    phase=0.25,
)


@pytest.mark.parametrize("backlash", [math.inf, 5e-6])
@pytest.mark.parametrize("frequency", [900.0, 1500.0, 2900.0])
def test_rigid_bodies_lead_back_to_model_1(backlash, frequency):
    """The same springs on the same steps: equal to rounding."""
    case = replace(FIRM, backlash=backlash, damping=0.02)
    both = case.model_1, case.coupled
    one, two = (respond(system, frequency, CLOSE) for system in both)
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
    one, two = (respond(each.coupled, frequency, CLOSE) for each in (case, other))
    for name in ("dte_rms", "dte_mean", "force_peak", "contact_loss"):
        expected, found = getattr(one, name), getattr(two, name)[::-1]
        np.testing.assert_allclose(found, expected, rtol=RIGHT, atol=1e-12)


@SHAKEN
def test_torque_the_other_way_moves_the_back_flanks_alike(frequency):
    case = replace(YIELDING, gap=((0.0, 0.0),) * 4, ground=FREE)
    other = replace(case, torque=-case.torque)
    one, two = (respond(each.coupled, frequency, CLOSE) for each in (case, other))
    for name in ("dte_rms", "force_peak", "contact_loss"):
        expected, found = getattr(one, name), getattr(two, name)
        np.testing.assert_allclose(found, expected, rtol=RIGHT, atol=1e-9)
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
        ground=tuple(firm * each for each in case.ground),
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
    state[1] = 0.1 * np.abs(state[0]) * 2.0 * np.pi * system.resonances_Hz

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

    def _driven(self, at):
        arrays, steps = super()._driven(at)
        return arrays, steps._replace(h=steps.h[: self.count])


def states_over_a_cycle(system, at, state):
    """From a state at the start of a cycle on, (steps + 1, 2, n)."""
    counts = range(1, at.settings.steps + 1)
    later = [ShortStepper(system, n).record(state, at, 1)[0] for n in counts]
    return np.array([state, *later])


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
