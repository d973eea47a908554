"""Gaps and levers of relieved flanks against their geometry alone."""

from __future__ import annotations

import math

import numpy as np
import pytest
from changed_flanks import with_flanks
from oracles.relieved_flanks import Flank, closing_way, relief_depth

from fegear.contact.pair_load_curves import pair_load_curves
from fegear.contact.plane.solve import solve_drive_side
from fegear.contact.problem import ContactFlank, ContactProblem
from fegear.contact.solve import solve_cycle
from fegear.elasticity.cache import cached_flank_compliance
from fegear.elasticity.material import PlaneMaterial
from fegear.gearset.modifications import Relief
from meshes import GearPair, SpurGear

MODULE, CENTER_DISTANCE = 4e-3, 124.79e-3
DEPTH = 20e-6
CLOSE = 50e-6  # m, gap of pairs that could carry load
POSITIONS = np.arange(24) / 24 + 0.003
KINDS = ("driver_tip", "driver_root", "driven_tip", "driven_root")
CASES = [(kind,) for kind in KINDS] + [KINDS]


def gear_of(teeth, shift):
    return SpurGear(
        teeth=teeth,
        module=MODULE,
        pressure_angle=math.radians(20.0),
        profile_shift=shift,
        tip_radius=MODULE * (0.5 * teeth + 1.0 + shift),
        dedendum=1.25 * MODULE,
        rack_tip_radius=0.3 * MODULE,
        hub_radius=0.25 * MODULE * teeth,
    )


@pytest.fixture(scope="module")
def unmodified():
    gears, steel = (gear_of(25, 0.3), gear_of(37, -0.1)), PlaneMaterial(2.06e11, 0.3)
    driver, driven = (cached_flank_compliance(gear, steel) for gear in gears)
    pair = GearPair(*gears, CENTER_DISTANCE)
    return ContactProblem(
        pair=pair,
        driver=ContactFlank(compliance=driver),
        driven=ContactFlank(compliance=driven),
        face_width=0.03,
    )


def ways_of(pair):
    """Roll lengths by kind: where single contact begins, and where the flank ends."""
    start, end, line = pair.path_start, pair.path_end, pair.line_of_action
    high, low = start + pair.base_pitch, end - pair.base_pitch
    return {
        "driver_tip": (high, end),
        "driver_root": (low, start),
        "driven_tip": (line - low, line - start),
        "driven_root": (line - high, line - end),
    }


def relieved(problem, kinds, shape):
    ways = ways_of(problem.pair)
    reliefs = {
        f"{kind}_relief": Relief(
            magnitude=DEPTH, start_roll_length=ways[kind][0], shape=shape
        )
        for kind in kinds
    }
    return with_flanks(problem, **reliefs)


def oracle(problem, kinds, shape):
    """Transmission error [m] that closes a pair at positions, by geometry alone."""
    pair, ways = problem.pair, ways_of(problem.pair)
    power = {"linear": 1.0, "parabolic": 2.0}[shape]
    flanks = []
    for name in ("driver", "driven"):
        gear, depth = (
            getattr(pair, name),
            getattr(problem, name).compliance.flank_length,
        )
        reliefs = [relief_depth(DEPTH, *ways[k], power) for k in kinds if name in k]
        tip = gear.tip_roll_length
        low = math.sqrt(max(0.0, tip**2 - 2.0 * gear.base_radius * depth))
        flanks.append(
            Flank(
                gear.base_radius,
                tip,
                low,
                lambda s, reliefs=reliefs: sum(f(s) for f in reliefs),
            )
        )

    def gap(position):
        roll = pair.pitch_point + pair.base_pitch * position
        return closing_way(*flanks, CENTER_DISTANCE, roll)

    return gap


@pytest.mark.parametrize("shape", ["linear", "parabolic"])
@pytest.mark.parametrize("kinds", CASES, ids=lambda kinds: "+".join(kinds))
def test_gap_is_that_of_the_geometry(unmodified, kinds, shape):
    """On the path, at tip corners and where a relief begins; and the no-load error."""
    problem, exact = (
        relieved(unmodified, kinds, shape),
        oracle(unmodified, kinds, shape),
    )
    cycle = solve_cycle(problem, [200.0], POSITIONS)
    expected = np.full(cycle.gap[0].shape, np.inf)
    for n, k in np.argwhere(cycle.gap[0] < CLOSE):
        expected[n, k] = exact(POSITIONS[n] + cycle.teeth[k])
    gap = np.where(cycle.gap[0] < CLOSE, cycle.gap[0], np.inf)
    np.testing.assert_allclose(gap, expected, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(cycle.no_load[0], expected.min(axis=1), atol=1e-12)


@pytest.mark.parametrize("kinds", CASES, ids=lambda kinds: "+".join(kinds))
def test_levers_are_those_of_the_common_normal(unmodified, kinds):
    """Rigid flanks stay in contact: with the driven gear's way x, the driver's is
    x + gap(x), and levers times angles are equal."""
    problem, exact = (
        relieved(unmodified, kinds, "linear"),
        oracle(unmodified, kinds, "linear"),
    )
    teeth = np.arange(-1, 2)
    none, still = np.zeros((POSITIONS.size, teeth.size)), np.zeros(POSITIONS.size)
    _, cells = solve_drive_side(problem, teeth, none, POSITIONS, still)
    step, pitch = 1e-4, problem.pair.base_pitch
    bases = problem.pair.driver.base_radius, problem.pair.driven.base_radius
    for n, k in np.argwhere(cells.gap < CLOSE):
        position, moment_arms = POSITIONS[n] + teeth[k], cells.moment_arms[n, k]
        slope = (exact(position + step) - exact(position - step)) / (2.0 * step * pitch)
        rates = moment_arms[0] / bases[0] * (1.0 + slope), moment_arms[1] / bases[1]
        assert rates[0] == pytest.approx(rates[1], abs=2e-5)


def test_laws_of_moving_pairs_have_the_same_gaps(unmodified):
    problem, exact = (f(unmodified, KINDS, "parabolic") for f in (relieved, oracle))
    laws = pair_load_curves(problem, POSITIONS[::6], CLOSE)
    closing = laws.moment_arms[..., 0] / problem.pair.driver.base_radius
    gap = laws.gap / closing
    for n, k in np.argwhere(gap < CLOSE):
        expected = exact(POSITIONS[6 * n] + laws.pair_offsets[k])
        assert gap[n, k] == pytest.approx(expected, abs=1e-12)
