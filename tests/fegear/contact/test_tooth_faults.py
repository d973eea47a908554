"""Contact of teeth that differ from the others, against problems of equal teeth."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import pytest
from changed_flanks import with_flanks
from numpy.testing import assert_allclose
from oracles.offset_involutes import driver_lead

from fegear.contact.offset_centers import CenterOffset
from fegear.contact.plane.contact import PlaneContact
from fegear.contact.plane.kernels import flanks
from fegear.contact.problem import ContactProblem
from fegear.contact.solve import solve_cycle
from fegear.contact.tooth_faults import FlankSpall, ToothFaults
from fegear.elasticity.flank import MAX_TOOTH_OFFSET, FlankCompliance
from fegear.gearset.faults.tooth_faults import MAX_SPALLS
from fegear.gearset.modifications import FlankProfile
from meshes import GearPair, SpurGear

POSITIONS = np.arange(32) / 32
TORQUES = [50.0, 150.0]
TWO_STRETCHES = (-0.213, 0.107), (-0.097, 0.243)  # from the pitch point [base pitches]
COMPARED = "ste", "no_load", "local_stiffness", "load", "pressure", "driven_torque"


@dataclass(frozen=True)
class ShareOfAll:
    """Change of compliance that is a share of that of the healthy teeth."""

    flank: FlankCompliance
    share: float
    teeth: int

    def block(self, receiver: int, source: int) -> np.ndarray:
        half = self.teeth // 2
        offset = (receiver - source + half) % self.teeth - half
        tables = np.stack([self.flank.normal, self.flank.tangential])
        if abs(offset) > MAX_TOOTH_OFFSET:
            return np.zeros_like(tables[:, 0])
        return self.share * tables[:, MAX_TOOTH_OFFSET + offset]


def scaled(flank: FlankCompliance, factor: float) -> FlankCompliance:
    return replace(
        flank, normal=factor * flank.normal, tangential=factor * flank.tangential
    )


def equal_faults(problem: ContactProblem, side: str, **faults) -> ToothFaults:
    teeth = getattr(problem.pair, side).teeth
    return ToothFaults(teeth=teeth, **faults)


def require_equal(one, other, rtol=1e-11):
    for name in COMPARED:
        assert_allclose(
            getattr(one, name), getattr(other, name), rtol=rtol, err_msg=name
        )


@pytest.mark.parametrize("friction", [0.0, 0.1])
@pytest.mark.parametrize("side", ["driver", "driven"])
def test_a_change_of_all_teeth_is_another_compliance(problem, side, friction):
    flank = getattr(problem, side).compliance
    teeth = getattr(problem.pair, side).teeth
    base = replace(problem, friction=friction)
    softer = with_flanks(base, **{f"{side}_compliance": scaled(flank, 1.25)})
    clockwise = -1 if side == "driver" else 1
    changed = with_flanks(
        base,
        **{
            f"{side}_faults": ToothFaults(
                teeth=teeth,
                change=ShareOfAll(flank, 0.25, teeth),
                clockwise=clockwise,
                damaged=frozenset(range(teeth)),
            )
        },
    )
    expected = solve_cycle(softer, TORQUES, POSITIONS)
    require_equal(solve_cycle(changed, TORQUES, POSITIONS), expected)


def test_a_change_of_one_tooth_is_seen_while_it_is_near(problem):
    teeth, tooth = problem.pair.driver.teeth, 5
    near = frozenset(range(tooth - MAX_TOOTH_OFFSET, tooth + MAX_TOOTH_OFFSET + 1))

    @dataclass(frozen=True)
    class OfOneTooth(ShareOfAll):
        def block(self, receiver, source):
            changed = -tooth % self.teeth in (receiver, source)
            return super().block(receiver, source) * changed

    faults = ToothFaults(
        teeth=teeth,
        change=OfOneTooth(problem.driver.compliance, 0.5, teeth),
        clockwise=-1,
        damaged=near,
    )
    changed = with_flanks(problem, driver_faults=faults)
    pitches = np.repeat(np.arange(teeth), POSITIONS.size)
    position = np.tile(POSITIONS, teeth)
    cycle = solve_cycle(changed, [100.0], position, pitches)
    healthy = solve_cycle(problem, [100.0], position, pitches)
    softer = cycle.ste[0] > healthy.ste[0] * (1.0 + 1e-3)
    # the tooth carries load from the start of the path to its end, and a little beyond
    start, end = problem.pair.path
    rotated = position + pitches - tooth
    assert softer[(rotated > start + 0.01) & (rotated < end - 0.01)].all()
    outside = (rotated < start - 0.2) | (rotated > end + 0.2)
    assert_allclose(cycle.ste[0, outside], healthy.ste[0, outside], rtol=1e-12)


def test_teeth_without_faults_change_nothing(problem):
    faults = equal_faults(problem, "driver")
    changed = solve_cycle(
        with_flanks(problem, driver_faults=faults),
        TORQUES,
        POSITIONS,
    )
    healthy = solve_cycle(problem, TORQUES, POSITIONS)
    for name in COMPARED:
        assert np.array_equal(getattr(changed, name), getattr(healthy, name)), name


@pytest.mark.parametrize("side", ["driver", "driven"])
def test_broken_tips_of_all_teeth_are_a_smaller_tip_circle(problem, side):
    gear = getattr(problem.pair, side)
    lower = replace(gear, tip_radius=gear.tip_radius - 0.3e-3)
    shorter = replace(problem.pair, **{side: lower})
    roll = math.sqrt(lower.tip_radius**2 - lower.base_radius**2)
    corners = dict.fromkeys(range(gear.teeth), roll)
    faults = equal_faults(problem, side, corners=corners)
    broken = with_flanks(problem, **{f"{side}_faults": faults})
    flank = getattr(problem, side).compliance
    missing = flank.flank_length - lower.flank_length
    cycle = solve_cycle(broken, [100.0], POSITIONS)
    # the same flanks without the tips, whose compliance is another: gaps alone
    cut_flank = replace(flank, flank_length=lower.flank_length)
    cut = with_flanks(
        replace(problem, pair=shorter), **{f"{side}_compliance": cut_flank}
    )
    expected = solve_cycle(cut, [100.0], POSITIONS)
    touching = np.isfinite(expected.gap[0])
    # corners beside broken tips are sought farther off the path, where none bears here
    assert (cycle.gap[0][~touching] > 2.0 * expected.ste.max()).all()
    assert_allclose(cycle.gap[0][touching], expected.gap[0][touching], atol=1e-15)
    column = 0 if side == "driver" else 1
    difference = cycle.arc[0, ..., column] - expected.arc[0, ..., column]
    alone = (expected.load[0] > 0.0).sum(axis=1) == 1
    assert_allclose(difference[alone & touching[:, 0], 0], missing, rtol=0.05)


def test_a_broken_tip_ends_the_contact_of_its_tooth_alone(problem):
    gear, tooth = problem.pair.driver, 3
    roll = gear.tip_roll_length - 0.25 * problem.pair.base_pitch
    faults = equal_faults(problem, "driver", corners={tooth: roll})
    broken = with_flanks(problem, driver_faults=faults)
    pitches, position = np.repeat(np.arange(7), 64), np.tile(np.arange(64) / 64, 7)
    cycle = solve_cycle(broken, [100.0], position, pitches)
    load = cycle.load[0, :, cycle.teeth.tolist().index(0)]  # of each reference pair
    last = [position[(load > 0.0) & (pitches == n)].max() for n in range(7)]
    assert_allclose(np.delete(last, tooth), last[0], atol=1e-12)
    assert abs(last[0] - last[tooth] - 0.25) < 0.05
    healthy = solve_cycle(problem, [100.0], POSITIONS)
    others = solve_cycle(broken, [100.0], POSITIONS, np.full(32, 20))
    assert_allclose(others.ste, healthy.ste, rtol=1e-12)
    assert cycle.ste[0].max() > healthy.ste.max()


def with_spall(problem: ContactProblem, share: float) -> ContactProblem:
    """All flanks of the driver, from tip to root, with a spall."""
    teeth = problem.pair.driver.teeth
    spalls = dict.fromkeys(range(teeth), (FlankSpall(0.0, 1.0, share),))
    return with_flanks(problem, driver_faults=ToothFaults(teeth=teeth, spalls=spalls))


def hertz_depth(problem: ContactProblem, load: float) -> tuple[float, float]:
    """Approach of both tooth centre lines at the pitch point, and largest pressure.

    load : per width [N/m]; Johnson (1985), section 4.2 (c) and eq. (5.57b)
    """
    pair, flanks = problem.pair, [flank.compliance for flank in problem.flanks]
    compliance = sum(1.0 / flank.modulus for flank in flanks)
    rolls = pair.pitch_point, pair.line_of_action - pair.pitch_point
    radius = rolls[0] * rolls[1] / pair.line_of_action
    half_width = math.sqrt(4.0 * load * radius * compliance / math.pi)
    approach = 0.0
    for flank, gear in zip(flanks, (pair.driver, pair.driven), strict=True):
        pitch_radius = gear.base_radius / math.cos(pair.operating_pressure_angle)
        depth = pitch_radius * gear.half_angle(pitch_radius)
        spread = 2.0 * math.log(2.0 * depth / half_width) - flank.poisson
        approach += load / (math.pi * flank.modulus) * spread
    return approach, 2.0 * load / (math.pi * half_width)


@pytest.mark.parametrize("share", [0.2, 0.4, 0.8])
def test_a_spall_brings_the_flank_nearer_to_the_centre_line_as_hertz(problem, share):
    """At the pitch point of a smooth contact, where one pair carries the load."""
    fine = replace(problem, solver=PlaneContact(nodes=49))
    spalled = with_spall(fine, share)
    before, after = (solve_cycle(p, [100.0], [0.0]) for p in (fine, spalled))
    load = before.load[0, 0].sum() / problem.face_width
    whole, pressure = hertz_depth(problem, load)
    narrow, higher = hertz_depth(problem, load / (1.0 - share))
    added = after.ste[0, 0] - before.ste[0, 0]
    assert_allclose(added, narrow - whole, rtol=0.01)
    ratio = after.pressure.max() / before.pressure.max()
    assert_allclose(ratio, higher / pressure, rtol=0.01)


def test_a_spall_of_larger_gears_is_the_same_at_the_same_stress(problem):
    """Deflection over size does not depend on the unit of length."""
    softer = [
        solve_cycle(with_spall(scaled_up(problem, size), 0.4), [100.0 * size**2], [0.0])
        for size in (1.0, 10.0)
    ]
    assert_allclose(softer[1].ste, 10.0 * softer[0].ste, rtol=1e-9)
    assert_allclose(softer[1].pressure, softer[0].pressure, rtol=1e-9)


def scaled_up(problem: ContactProblem, size: float) -> ContactProblem:
    """The problem in gears that are larger by a factor, of the same face width."""
    lengths = "module", "tip_radius", "dedendum", "rack_tip_radius", "hub_radius"

    def gear(of: SpurGear) -> SpurGear:
        return replace(of, **{name: size * getattr(of, name) for name in lengths})

    def flank(of: FlankCompliance) -> FlankCompliance:
        # the half-plane part, which was taken out, has its logarithm of metres
        normal = of.normal.copy()
        shift = 2.0 * math.log(size) / (math.pi * of.modulus)
        normal[MAX_TOOTH_OFFSET] += shift
        length = size * of.flank_length
        return replace(of, normal=normal, flank_length=length)

    pair = problem.pair
    larger = GearPair(gear(pair.driver), gear(pair.driven), size * pair.center_distance)
    return replace(
        problem,
        pair=larger,
        driver=replace(problem.driver, compliance=flank(problem.driver.compliance)),
        driven=replace(problem.driven, compliance=flank(problem.driven.compliance)),
    )


def test_a_spall_acts_where_its_flank_touches(problem):
    pair = problem.pair
    middle = pair.pitch_point
    spall = FlankSpall(
        middle - 0.1 * pair.base_pitch, middle + 0.1 * pair.base_pitch, 0.5
    )
    faults = equal_faults(problem, "driver", spalls={0: (spall,)})
    positions = np.linspace(-0.3, 0.3, 25)
    cycle = solve_cycle(
        with_flanks(problem, driver_faults=faults),
        [100.0],
        positions,
    )
    healthy = solve_cycle(problem, [100.0], positions)
    softer = cycle.ste[0] / healthy.ste[0] - 1.0
    inside = np.abs(positions) < 0.08
    assert (softer[inside] > 0.01).all()
    assert_allclose(softer[np.abs(positions) > 0.15], 0.0, atol=1e-12)


def test_spalls_side_by_side_are_one_of_their_width(problem):
    pitch, middle = problem.pair.base_pitch, problem.pair.pitch_point
    ends = [(middle + a * pitch, middle + b * pitch) for a, b in TWO_STRETCHES]
    parts = FlankSpall(*ends[0], 0.2), FlankSpall(*ends[1], 0.3)
    pieces = (
        FlankSpall(ends[0][0], ends[1][0] - 1e-12, 0.2),
        FlankSpall(ends[1][0], ends[0][1], 0.5),
        FlankSpall(ends[0][1] + 1e-12, ends[1][1], 0.3),
    )
    positions = np.linspace(-0.4, 0.4, 33)
    solved = []
    for spalls in (parts, pieces):
        faults = equal_faults(problem, "driver", spalls={0: spalls})
        faulty = with_flanks(problem, driver_faults=faults)
        solved.append(solve_cycle(faulty, [100.0], positions))
    assert_allclose(solved[0].ste, solved[1].ste, rtol=1e-12)
    assert_allclose(solved[0].pressure, solved[1].pressure, rtol=1e-12)


def test_as_many_spalls_fit_on_a_flank_as_a_file_may_have():
    assert MAX_SPALLS == flanks.MAX_SPALLS


@pytest.mark.parametrize("side", ["driver", "driven"])
def test_a_missing_tooth_leaves_the_load_to_others(problem, side):
    """Between single and double contact, where others are there to carry it."""
    faults = equal_faults(problem, side, missing=frozenset({0}))
    start, _ = problem.pair.path
    positions = np.linspace(start + 0.02, start + 0.4, 9)  # the pair ahead is there
    cycle = solve_cycle(
        with_flanks(problem, **{f"{side}_faults": faults}), [100.0], positions
    )
    pair = cycle.teeth.tolist().index(0)
    assert (cycle.load[..., pair] == 0.0).all()
    assert np.isinf(cycle.gap[..., pair]).all()
    teeth = problem.pair.driver.teeth
    far = with_flanks(problem, driver_pitch_errors=(1e-3, *[0.0] * (teeth - 1)))
    expected = solve_cycle(far, [100.0], positions)
    assert_allclose(cycle.ste, expected.ste, rtol=1e-12)


def test_wear_of_one_tooth_is_the_profile_of_all_where_it_touches(problem):
    pair = problem.pair
    rolls = np.linspace(pair.path_start, pair.driver.tip_roll_length, 9)
    depth = 5e-6 * np.sin(np.linspace(0.3, 2.5, 9))
    worn = FlankProfile(roll_lengths=tuple(rolls), deviations=tuple(-depth))
    teeth = {0: worn, 1: worn, 2: worn, 36: worn, 37: worn}
    faults = equal_faults(problem, "driver", profiles=teeth)
    one = solve_cycle(
        with_flanks(problem, driver_faults=faults),
        TORQUES,
        POSITIONS,
    )
    of_all = solve_cycle(
        with_flanks(problem, driver_profile=worn),
        TORQUES,
        POSITIONS,
    )
    require_equal(one, of_all)


def test_back_flanks_have_neither_spalls_nor_open_cracks(problem):
    teeth = problem.pair.driver.teeth
    everywhere = range(teeth)
    faults = ToothFaults(
        teeth=teeth,
        change=ShareOfAll(problem.driver.compliance, 0.25, teeth),
        clockwise=-1,
        damaged=frozenset(everywhere),
        spalls=dict.fromkeys(everywhere, (FlankSpall(0.0, 1.0, 0.5),)),
    )
    torques = [-torque for torque in TORQUES]
    healthy = solve_cycle(problem, torques, POSITIONS)
    faulty = solve_cycle(
        with_flanks(problem, driver_faults=faults),
        torques,
        POSITIONS,
    )
    require_equal(faulty, healthy)
    roll = problem.pair.driver.tip_roll_length - 0.25 * problem.pair.base_pitch
    faults = replace(faults, corners=dict.fromkeys(everywhere, roll))
    broken = solve_cycle(
        with_flanks(problem, driver_faults=faults),
        torques,
        POSITIONS,
    )
    largest, whole = (np.ptp(cycle.ste, axis=1) for cycle in (broken, healthy))
    assert (largest > 1.05 * whole).all()


@pytest.mark.parametrize("back", [False, True])
@pytest.mark.parametrize("side", ["driver", "driven"])
def test_offset_centers_transmit_as_rigid_involutes(problem, side, back):
    random = np.random.default_rng(7)
    pair: GearPair = problem.pair
    gear = getattr(pair, side)
    for _ in range(4):
        offset = CenterOffset(random.uniform(1e-5, 1e-4), random.uniform(0.0, 6.0))
        moved = with_flanks(problem, **{f"{side}_offset": offset})
        pitch = int(random.integers(0, gear.teeth))
        torque = -1e-6 if back else 1e-6
        cycle = solve_cycle(moved, [torque], [0.2], pitch)
        way = offset.angle + gear.pitch_angle * (0.2 + pitch)
        direction = way if side == "driver" else math.pi - way
        vector = offset.distance * np.array([math.cos(direction), math.sin(direction)])
        if back:  # in the mirror
            vector[1] = -vector[1]
        lead = driver_lead(pair, 0.1, **{side: vector})
        expected = -(pair.backlash + lead) if back else lead
        assert_allclose(cycle.no_load[0, 0], expected, rtol=1e-9, atol=1e-14)


def test_offset_centers_move_the_path_of_contact(problem):
    """At a larger distance of the centres fewer teeth are in contact."""
    apart = CenterOffset(2e-4, math.pi)
    cycle = solve_cycle(
        with_flanks(problem, driver_offset=apart),
        [100.0],
        POSITIONS,
        np.zeros(32, int),
    )
    distance = problem.pair.center_distance + 2e-4
    wider = replace(problem.pair, center_distance=distance)
    expected = solve_cycle(replace(problem, pair=wider), [100.0], POSITIONS)
    # over the pitch in which the centre is on the line of centres
    near = np.abs(POSITIONS - 0.02) < 0.02
    deflection = (cycle.ste - cycle.no_load)[0, near]
    assert_allclose(deflection, (expected.ste - expected.no_load)[0, near], rtol=1e-3)
