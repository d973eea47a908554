"""Teeth that differ, in contact over the face width: against sections, and balances."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from changed_flanks import with_flanks
from numpy.testing import assert_allclose
from sliced_pairs import COARSE, STEEL, TEETH, TORQUE, WIDTH, gears, problem, slope
from slow_tests import first_are_quick

from fegear.contact.offset_centers import CenterOffset
from fegear.contact.plane.contact import PlaneContact
from fegear.contact.problem import ContactFlank, ContactProblem
from fegear.contact.result import ContactCycle
from fegear.contact.solve import solve_cycle
from fegear.contact.tooth_faults import FlankCorner, FlankSpall, ToothFaults
from fegear.elasticity.cache import cached_flank_compliance
from fegear.gearset.modifications import FlankProfile

POSITIONS = np.arange(12) / 12.0
PITCHES = -1, 0, 1  # of the teeth near tooth 0 of either gear
SIDES = "driver", "driven"
HELIX = 18.0  # deg


def near_tooth(
    contact: ContactProblem, positions=POSITIONS, torque=TORQUE
) -> ContactCycle:
    """The cycle while tooth 0 of both gears passes."""
    positions = np.asarray(positions)
    pitches = np.repeat(PITCHES, positions.size)
    return solve_cycle(contact, [torque], np.tile(positions, 3), pitches)


def with_tooth(contact: ContactProblem, side: str, **faults) -> ContactProblem:
    """The problem with faults of tooth 0 of a gear."""
    teeth = TEETH[SIDES.index(side)]
    flank = getattr(contact, side)
    old = flank.faults or ToothFaults(teeth=teeth)
    return with_flanks(contact, **{f"{side}_faults": replace(old, **faults)})


def uniform(sliced: ContactProblem) -> ContactProblem:
    """The section of a spur problem, of teeth of its width."""
    material = replace(STEEL, plane="width", width=WIDTH)
    driver, driven = (
        ContactFlank(compliance=cached_flank_compliance(gear, material, COARSE))
        for gear in gears(0.0)
    )
    return replace(sliced, solver=PlaneContact(), driver=driver, driven=driven)


def deflection(cycle: ContactCycle) -> np.ndarray:
    return (cycle.ste - cycle.no_load)[0]


def pitch_roll(side: str) -> tuple[float, float]:
    """Roll length of a gear at the pitch point, and the base pitch [m]."""
    pair = problem().pair
    point = pair.pitch_point
    if side == "driven":
        point = pair.line_of_action - point
    return point, pair.base_pitch


def helical_roll(side: str) -> tuple[float, float]:
    pair = problem(HELIX).pair
    point = pair.pitch_point
    return point if side == "driver" else pair.line_of_action - point, pair.base_pitch


def roll_below_tip(side: str, height: float, helix=0.0) -> float:
    gear = getattr(problem(helix).pair, side)
    return math.sqrt((gear.tip_radius - height) ** 2 - gear.base_radius**2)


def of_kind(kind: str, side: str) -> dict:
    point, base_pitch = pitch_roll(side)
    if kind == "broken tip":
        return {"corners": {0: roll_below_tip(side, 0.3e-3)}}
    rolls = tuple(point + np.array([-0.3, 0.0, 0.3]) * base_pitch)
    depths = (-1e-6, -4e-6, 0.0)
    profile = FlankProfile(roll_lengths=rolls, deviations=depths)
    return {"profiles": {0: profile}}


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("kind", ["broken tip", "worn"])
def test_a_tooth_alike_over_the_width_is_that_of_a_section(side, kind):
    faults = of_kind(kind, side)
    sliced, section = problem(slices=16), uniform(problem(slices=16))
    cycles = [near_tooth(with_tooth(p, side, **faults)) for p in (sliced, section)]
    healthy = [near_tooth(p) for p in (sliced, section)]
    effects = [(a.ste - b.ste)[0] for a, b in zip(cycles, healthy, strict=True)]
    assert effects[1].max() > 1.5e-6
    assert_allclose(effects[0], effects[1], atol=0.3e-6)
    assert np.sort(np.abs(effects[0] - effects[1]))[-8] < 0.06e-6


@pytest.mark.parametrize("side", SIDES)
def test_a_missing_tooth_is_that_of_a_section(side):
    start, end = problem().pair.path
    fractions = np.arange(12) / 12.0
    others = fractions[(fractions > start + 1.1) & (fractions < end)]
    both = [
        solve_cycle(with_tooth(p, side, missing=frozenset({0})), [TORQUE], others)
        for p in (problem(slices=16), uniform(problem(slices=16)))
    ]
    assert_allclose(both[0].ste, both[1].ste, rtol=2e-3)
    missing = both[0].teeth == 0
    assert missing.any()
    assert (both[0].load[..., missing] == 0.0).all()
    assert np.isinf(both[0].gap[..., missing]).all()
    healthy = solve_cycle(problem(slices=16), [TORQUE], others)
    assert (both[0].ste > 1.2 * healthy.ste)[0, others < end].all()


@pytest.mark.parametrize("side", SIDES)
def test_centres_off_their_axes_are_those_of_a_section(side):
    offset = {f"{side}_offset": CenterOffset(20e-6, 0.4)}
    for pitch in (0, 7):
        one, two = (
            solve_cycle(with_flanks(p, **offset), [TORQUE], POSITIONS, pitch)
            for p in (problem(slices=16), uniform(problem(slices=16)))
        )
        assert_allclose(one.no_load, two.no_load, atol=1e-12)
        apart = np.sort(np.abs(deflection(one) / deflection(two) - 1.0))
        assert apart[-4] < 4e-3
        assert apart[-1] < 5e-2


def test_a_spall_of_nearly_all_the_width_is_about_that_of_a_section():
    point, base_pitch = pitch_roll("driver")
    ends = point - 0.2 * base_pitch, point + 0.2 * base_pitch
    spalls = {0: (FlankSpall(*ends, 0.95),)}
    one, two = (
        solve_cycle(with_tooth(p, "driver", spalls=spalls), [TORQUE], [0.0])
        for p in (problem(slices=24), uniform(problem()))
    )
    healthy = solve_cycle(problem(), [TORQUE], [0.0])
    assert (two.ste > 1.5 * healthy.ste).all()
    assert_allclose(one.ste, two.ste, rtol=0.03)


def spalled(side: str, share=0.4, place=3e-3, helix=HELIX) -> ContactProblem:
    point, base_pitch = helical_roll(side)
    ends = point - 0.25 * base_pitch, point + 0.15 * base_pitch
    spalls = {0: (FlankSpall(*ends, share, place),)}
    return with_tooth(problem(helix), side, spalls=spalls)


def require_balance(contact: ContactProblem, cycle: ContactCycle, torque: float):
    moment = (cycle.load * cycle.closing).sum(axis=2) * cycle.base_radius
    assert_allclose(moment[0], torque, rtol=1e-9)
    assert (cycle.face.load >= 0.0).all()
    assert cycle.residual.max() < 1e-9
    helix = contact.pair.driver.base_helix_angle
    total = cycle.face.load.sum(axis=3) * cycle.face.slice_length
    assert_allclose(math.cos(helix) * total, cycle.load, rtol=1e-9)


@pytest.mark.parametrize("side", SIDES)
def test_nothing_carries_in_a_spall(side):
    """By places of slices and roll lengths at their ends, of an own computation."""
    contact = spalled(side)
    cycle = near_tooth(contact)
    require_balance(contact, cycle, TORQUE)
    pair, face = contact.pair, contact.solver
    lead = pair.driver.base_radius * face.driver.kernel.twist
    spall = getattr(contact, side).faults.spalls[0][0]
    half = 0.5 * WIDTH / face.slices
    reach = 0.2 * WIDTH - half + 1e-9  # of middles of slices within the spall
    inside, beside = [], []
    for n, position in enumerate(cycle.position):
        pitch = math.floor(position)
        for k, ahead in enumerate(cycle.teeth):
            if (pitch - ahead) % TEETH[SIDES.index(side)]:
                continue
            for m in np.flatnonzero(np.abs(face.places - spall.place) < reach):
                ends = face.places[m] + np.array([-half, half])
                way = pair.base_pitch * (position - pitch + ahead)
                rolls = pair.pitch_point + way - lead * ends
                if side == "driven":
                    rolls = pair.line_of_action - rolls
                load = cycle.face.load[0, n, k, m]
                if spall.start < rolls.min() and rolls.max() < spall.end:
                    inside.append(load)
                elif spall.end < rolls.min() < spall.end + 0.5e-3:
                    beside.append(load)
    assert len(inside) >= 20
    assert max(inside) == 0.0
    assert min(beside) > 0.0


@pytest.mark.parametrize("side", SIDES)
def test_a_long_broken_corner_is_a_broken_tip(side):
    """Its edge hardly rises over the width."""
    roll = roll_below_tip(side, 0.4e-3, HELIX)
    tip = with_tooth(problem(HELIX), side, corners={0: roll})
    corner = FlankCorner(roll, 1e5 * WIDTH, is_far=side == "driver")
    long = with_tooth(problem(HELIX), side, broken_corners={0: corner})
    one, two = (near_tooth(p) for p in (tip, long))
    assert_allclose(two.ste, one.ste, rtol=2e-5)
    assert np.ptp(one.ste - near_tooth(problem(HELIX)).ste) > 0.2e-6


@pytest.mark.parametrize("side", SIDES)
def test_a_mirror_has_the_fault_at_the_other_end(side):
    """Of the gears in a plane across their axes, which reverses the helix."""
    corner = FlankCorner(roll_below_tip(side, 0.5e-3, HELIX), 8e-3, is_far=False)
    point, base_pitch = helical_roll(side)
    ends = point - 0.2 * base_pitch, point + 0.2 * base_pitch
    one = with_tooth(
        problem(HELIX, slope(4e-6)), side,
        broken_corners={0: corner}, spalls={0: (FlankSpall(*ends, 0.3, 2e-3),)},
    )  # fmt: skip
    faults = getattr(one, side).faults
    mirrored = replace(
        faults,
        broken_corners={0: corner._replace(is_far=True)},
        spalls={0: (FlankSpall(*ends, 0.3, -2e-3),)},
    )
    gap = one.solver.gap[::-1].copy()
    other = replace(one, solver=replace(one.solver.mirrored, gap=gap, back_gap=gap))
    two = with_flanks(other, **{f"{side}_faults": mirrored})
    cycles = [near_tooth(p) for p in (one, two)]
    assert_allclose(cycles[1].ste, cycles[0].ste, rtol=1e-9)
    flipped = cycles[1].face.load[..., ::-1]
    most = flipped.max()
    assert np.abs(flipped - cycles[0].face.load).max() < 1e-7 * most


@pytest.mark.parametrize("fault", ["spall", "corner"])
def test_the_transmission_error_is_continuous(fault):
    """A line of contact that crosses an edge loses length steadily."""
    contact = spalled("driver")
    if fault == "corner":
        corner = FlankCorner(roll_below_tip("driver", 0.6e-3, HELIX), 9e-3, is_far=True)
        contact = with_tooth(problem(HELIX), "driver", broken_corners={0: corner})
    positions = np.linspace(-0.6, 1.6, 221)
    errors = solve_cycle(contact, [TORQUE], positions).ste[0]
    healthy = solve_cycle(problem(HELIX), [TORQUE], positions).ste[0]
    effect = errors - healthy
    assert effect.max() > 0.1e-6
    steps = [np.abs(np.diff(values)).max() for values in (effect, effect[::2])]
    assert steps[1] < 0.3 * effect.max()
    assert steps[0] < 0.7 * steps[1]  # that of a jump does not grow smaller


def test_back_flanks_have_neither_spalls_nor_wear():
    contact = spalled("driver")
    back = [
        solve_cycle(p, [-TORQUE], POSITIONS[::3]) for p in (contact, problem(HELIX))
    ]
    assert np.array_equal(back[0].ste, back[1].ste)


def random_faults(chance: np.random.Generator, side: str) -> dict:
    point, base_pitch = helical_roll(side)
    gear = getattr(problem(HELIX).pair, side)
    faults: dict = {}
    kinds = chance.random(4) < 0.5
    if kinds[0]:
        ends = np.sort(point + base_pitch * chance.uniform(-0.8, 0.6, 2))
        end = min(ends[1], gear.tip_roll_length)
        share = chance.uniform(0.05, 0.9)
        place = 0.5 * WIDTH * (1.0 - share) * chance.uniform(-1.0, 1.0)
        spall = FlankSpall(float(ends[0]), float(end), float(share), float(place))
        faults["spalls"] = {0: (spall,)}
    if kinds[1]:
        roll = roll_below_tip(side, chance.uniform(0.05e-3, 1.5e-3), HELIX)
        length = float(WIDTH * chance.uniform(0.05, 1.0))
        corner = FlankCorner(roll, length, bool(chance.integers(2)))
        faults["broken_corners"] = {0: corner}
    elif kinds[2]:
        roll = roll_below_tip(side, chance.uniform(0.05e-3, 0.5e-3), HELIX)
        faults["corners"] = {0: roll}
    if kinds[3]:
        rolls = tuple(point + base_pitch * np.linspace(-0.5, 0.4, 4))
        depths = tuple(-chance.uniform(0.0, 6e-6, 4))
        profile = FlankProfile(roll_lengths=rolls, deviations=depths)
        faults["profiles"] = {0: profile}
    return faults


@pytest.mark.parametrize("seed", first_are_quick(range(72, 92), 3))
def test_less_material_never_gives_a_smaller_transmission_error(seed):
    """Whatever is missing: a theorem of contact. Loads balance, and none pulls."""
    chance = np.random.default_rng(seed)
    depth = chance.uniform(0.0, 15e-6)
    contact = healthy = problem(HELIX, slope(depth))
    for side in SIDES:
        contact = with_tooth(contact, side, **random_faults(chance, side))
    torque = chance.uniform(20.0, 300.0)
    positions = chance.uniform(0.0, 1.0, 3)
    cycles = [near_tooth(p, positions, torque) for p in (contact, healthy)]
    require_balance(contact, cycles[0], torque)
    effect = cycles[0].ste - cycles[1].ste
    # within what other cuts of the slices change
    assert (effect > -2e-3 * deflection(cycles[1])).all()
