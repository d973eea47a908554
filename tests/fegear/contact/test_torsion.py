"""Bodies of gears that twist over the face width, beside beams in closed form."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad
from sliced_pairs import TORQUE, WIDTH, problem, slope

from fegear.contact.pairs import pair_gaps
from fegear.contact.solve import solve_cycle
from fegear.contact.width.compliance import FaceCompliance
from fegear.contact.width.damage import MomentaryLine, PairsAt
from fegear.contact.width.lines import FaceSolver
from fegear.contact.width.slices import touching_slices
from fegear.contact.width.supports import MOTIONS, AxisSupports, GearSupport
from fegear.contact.width.torsion import BodyTorsion

HALF = 0.5 * WIDTH
FOUNDATION = 1.4e10  # stiffness of teeth per length [N/m2]
CASES = {
    "straight": {},
    "helical": {"helix_angle_deg": 18.0},
    "left-handed": {"helix_angle_deg": -18.0},
}
PLACES = np.array([0.1, 0.6])


def uniform(rigidity, end="start"):
    """Torsion of a body of uniform rigidity."""
    flexibility = np.array([0.0, WIDTH / rigidity])
    places = np.array([-HALF, HALF])
    return BodyTorsion(places, flexibility if end == "start" else flexibility[::-1])


def twisting(contact, *torsions):
    """The contact of axes that are held and gears that twist."""
    driver, driven = (
        GearSupport(np.zeros((MOTIONS, MOTIONS)), np.zeros(MOTIONS), torsion)
        for torsion in torsions
    )
    solver = replace(contact.solver, supports=AxisSupports(driver, driven))
    return replace(contact, solver=solver)


@pytest.mark.parametrize("end", ["start", "end"])
def test_a_uniform_load_turns_the_free_end_by_half_its_torque(end):
    """q r b^2 / (2 G J)."""
    rigidity, count = 2.5e4, 400
    step = WIDTH / count
    loaded = step * (np.arange(count) + 0.5) - HALF
    ends = np.array([-HALF, HALF])
    twist = uniform(rigidity, end).between(ends, loaded) @ np.full(count, 3.0 * step)
    far = 1 if end == "start" else 0
    assert twist[far] == pytest.approx(3.0 * WIDTH**2 / (2.0 * rigidity), rel=1e-12)
    assert abs(twist[1 - far]) < 1e-12 * twist[far]


@pytest.mark.parametrize("end", ["start", "end"])
@pytest.mark.parametrize("seed", range(4))
def test_twist_is_that_of_the_beam_equation(seed, end):
    """G J phi' is the torque beyond a section, integrated numerically."""
    rng = np.random.default_rng([83, seed])
    steps = np.sort(rng.uniform(-HALF, HALF, 2))
    edges = np.array([-HALF, *steps, HALF])
    rigidity = 10.0 ** rng.uniform(3.5, 5.0, 3)
    from_start = np.concatenate([[0.0], np.cumsum(np.diff(edges) / rigidity)])
    flexibility = from_start if end == "start" else from_start[-1] - from_start
    torsion = BodyTorsion(edges, flexibility)
    places, loaded = rng.uniform(-HALF, HALF, 5), rng.uniform(-HALF, HALF, 4)
    torques = rng.uniform(1.0, 9.0, 4)
    held, free = (-HALF, HALF) if end == "start" else (HALF, -HALF)

    def rate(z):
        beyond = np.abs(loaded - free) < abs(z - free)
        return float(torques[beyond].sum()) / rigidity[np.searchsorted(steps, z)]

    for place, ours in zip(
        places, torsion.between(places, loaded) @ torques, strict=True
    ):
        breaks = sorted([held, *steps, *loaded, place])
        within = [z for z in breaks if min(held, place) <= z <= max(held, place)]
        expected = sum(
            quad(rate, a, b, epsabs=0.0, epsrel=1e-13)[0] for a, b in pairwise(within)
        )
        assert ours == pytest.approx(expected, rel=1e-10)
    matrix = torsion.between(places, places)
    assert (matrix == matrix.T).all()
    assert np.linalg.eigvalsh(matrix).min() > -1e-12 * matrix.max()


@pytest.mark.parametrize("kind", CASES)
def test_rigid_bodies_do_not_twist(kind):
    contact = problem(gap=slope(3e-6), **CASES[kind])
    rigid = uniform(1e19)
    ours = solve_cycle(twisting(contact, rigid, rigid), TORQUE, PLACES)
    held = solve_cycle(contact, TORQUE, PLACES)
    assert ours.ste == pytest.approx(held.ste, rel=1e-10)
    scale = held.face.load.max()
    assert ours.face.load == pytest.approx(held.face.load, abs=1e-10 * scale)


@pytest.mark.parametrize("kind", CASES)
def test_twisted_gears_carry_their_torque_and_more_near_its_end(kind):
    contact = problem(corner_contact=False, **CASES[kind])
    held = solve_cycle(contact, TORQUE, PLACES)
    assert twisting(contact, uniform(4e3), None).solver.supports.are_moved is False
    centers = {}
    for end in ("start", "end"):
        twisted = twisting(contact, uniform(4e3, end), uniform(4e4, end))
        cycle = solve_cycle(twisted, TORQUE, PLACES)
        face, driver = cycle.face, contact.pair.driver
        force = face.load[0].sum(axis=(1, 2)) * face.slice_length
        lever = driver.base_radius * math.cos(face.base_helix_angle)
        assert lever * force == pytest.approx(TORQUE, rel=1e-9)
        centers[end] = face.center[0].mean()
        assert (cycle.ste > held.ste).all()
    middle = held.face.center[0].mean()
    assert centers["start"] < middle - 0.01 * WIDTH
    assert centers["end"] > middle + 0.01 * WIDTH


def test_a_twist_is_a_gap_that_its_own_loads_open():
    """The contact of gears that do not twist, with that gap, has the same loads."""
    contact = problem(gap=slope(3e-6), corner_contact=False)
    torsion, places = uniform(4e3), PLACES[1:]
    expected = solve_cycle(twisting(contact, torsion, None), TORQUE, places)
    face, driver = expected.face, contact.pair.driver
    torque = driver.base_radius * face.load[0, 0].sum(axis=0) * face.slice_length
    twist = torsion.between(face.place, face.place) @ torque
    gap = contact.solver.gap + driver.base_radius * twist
    bent = replace(contact, solver=replace(contact.solver, gap=gap))
    ours = solve_cycle(bent, TORQUE, places)
    assert ours.ste == pytest.approx(expected.ste, rel=1e-9)
    scale = face.load.max()
    assert ours.face.load == pytest.approx(face.load, abs=1e-8 * scale)


@dataclass(frozen=True, eq=False)
class FoundationCompliance(FaceCompliance):
    """Teeth as a foundation of uniform stiffness (Winkler) on bodies that twist."""

    def between(self, teeth, parts):
        return self.of_torsion(parts)

    def near(self, parts, size):
        return np.diag(1.0 / (FOUNDATION * parts.length))

    def own_contact(self, load, parts, size):
        return np.zeros_like(load), np.zeros_like(load)


def on_foundation(contact, torque=TORQUE):
    """Places, forces per length, transmission error and energy of one pair."""
    face, pair, position = contact.solver, contact.pair, 0.0
    teeth, solver = np.zeros(1, np.int64), FaceSolver(contact, face)
    gaps = pair_gaps(contact, teeth, False)
    line = MomentaryLine.of(pair)
    lines = solver.lines(PairsAt(teeth, position, gaps, line, None))
    compliance = FoundationCompliance(face, (pair.driver, pair.driven))
    slices = touching_slices(compliance, lines, teeth, math.inf)
    solved = slices.solve(torque, 1e-5)
    order = np.argsort(slices.parts.place)
    parts = slices.parts.chosen(order)
    stored = 0.5 * solved.load @ solved.matrix @ solved.load
    stored += (slices.closing * slices.gap) @ solved.load
    return parts.place, solved.load[order] / parts.length, solved.ste, float(stored)


def test_load_of_teeth_on_a_foundation_is_a_hyperbolic_cosine():
    """f'' = kappa^2 f with f' = 0 at the free end, of second order in the slices."""
    kappa = 2.0 / WIDTH
    errors = []
    for count in (8, 16, 32, 64):
        contact = problem(slices=count, corner_contact=False)
        radius = contact.pair.driver.base_radius
        rigidity = FOUNDATION * radius**2 / kappa**2
        place, load, ste, _ = on_foundation(twisting(contact, uniform(rigidity), None))
        of_end = np.cosh(kappa * (HALF - place))
        total = TORQUE / radius  # over the width, of cosh it is sinh / kappa
        expected = total * kappa / math.sinh(kappa * WIDTH) * of_end
        errors.append(np.abs(load - expected).max() / expected.max())
        at_end = total * kappa / math.tanh(kappa * WIDTH)
        errors_of_ste = ste * FOUNDATION / at_end - 1.0
    assert errors[-1] < 3e-4
    assert abs(errors_of_ste) < 3e-4
    ratios = np.array(errors[:-1]) / errors[1:]
    assert ratios == pytest.approx(4.0, rel=0.1)


def test_transmission_error_is_the_slope_of_the_energy():
    """Castigliano: over the torque by the base radius, also where slices are open."""
    opened = problem(gap=slope(60e-6), corner_contact=False)
    contact = twisting(opened, uniform(2e4), uniform(5e4, "end"))
    step = 1e-3 * TORQUE
    _, load, ste, _ = on_foundation(contact)
    assert 2 < np.count_nonzero(load) < load.size
    (*_, less), (*_, more) = (
        on_foundation(contact, TORQUE + sign * step) for sign in (-1.0, 1.0)
    )
    radius = contact.pair.driver.base_radius
    assert (more - less) / (2.0 * step) == pytest.approx(ste / radius, rel=1e-6)
