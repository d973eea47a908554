"""Load curves of pairs along the face width, against the contact of all pairs."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq
from sliced_pairs import problem, slope
from wide_sets import HELICAL

import fegear
from fegear.contact.pair_load_curves import pair_load_curves
from fegear.contact.pairs import back_side_position
from fegear.contact.solve import solve_cycle
from fegear.contact.width.load_curves import (
    OPEN_GAP,
    interpolated_curves,
    width_load_curves,
)
from fegear.dynamics.mesh_load_curves import (
    all_mesh_load_curves,
    largest_deflection,
    tables_of_equal_teeth,
)
from fegear.gearset import make_gear_set
from fegear.statics.excitation import Excitations
from fegear.statics.given_tables import GivenTables
from fegear.statics.settings import StaticsSettings
from fegear.train.lumped_models import lumped_system
from fegear.train.model_settings import LumpedModel
from lumped.train.table import MeshTable

SPUR = {
    **HELICAL,
    "plane": "width",
    "defaults": {"module_mm": 3.0, "face_width_mm": 20.0},
    "mesh": [{"driver": "one", "driven": "two", "backlash_um": 200.0}],
}
PENETRATION = 90e-6 * np.linspace(0.0, 1.0, 129) ** 2
CASES = {
    "straight": lambda: problem(gap=slope(12e-6)),
    "helical": lambda: problem(18.0),
}


@pytest.fixture(scope="module", params=CASES)
def contact(request):
    return CASES[request.param]()


@pytest.fixture(scope="module")
def curves(contact):
    return width_load_curves(contact, contact.solver, np.arange(4) / 4.0, PENETRATION)


def loads_at(curves, n, ste):
    """Of pairs that yield under each other at a transmission error, by iteration."""
    loads = np.zeros(curves.teeth.size)
    for _ in range(60):
        depth = ste - curves.gap[n] - curves.coupling[n] @ loads
        new = [
            np.interp(x, PENETRATION, load) if x > 0.0 else 0.0
            for x, load in zip(depth, curves.load[n], strict=True)
        ]
        loads = 0.5 * (loads + np.array(new))
    return loads


def test_pairs_together_carry_as_in_the_whole_contact(contact, curves):
    """To what the compliance between centres of load leaves out."""
    torques = [40.0, 120.0]
    cycle = solve_cycle(contact, torques, np.arange(4) / 4.0)
    for t, n in np.ndindex(2, 4):
        force = torques[t] / cycle.base_radius
        ste = brentq(
            lambda x, n=n, force=force: loads_at(curves, n, x).sum() - force,
            cycle.no_load[t, n],
            cycle.ste[t, n] + 10e-6,
        )
        deflection = cycle.ste[t, n] - cycle.no_load[t, n]
        assert abs(ste - cycle.ste[t, n]) < 0.015 * deflection
        column = [cycle.teeth.tolist().index(k) for k in curves.teeth]
        ours = loads_at(curves, n, ste)
        theirs = (cycle.load * cycle.closing)[t, n, column]
        assert ours == pytest.approx(theirs, abs=0.03 * force)


def test_loads_grow_with_penetration(curves):
    assert (curves.load[..., 0] == 0.0).all()
    faces = curves.gap < OPEN_GAP
    assert faces.any()
    assert (np.diff(curves.load[faces], axis=1) > 0.0).all()
    # contacts that spread and stiffen: more than in proportion
    half = PENETRATION.size // 2
    secant = curves.load[faces][:, [half, -1]] / PENETRATION[[half, -1]]
    assert (secant[:, 1] > secant[:, 0]).all()
    assert (curves.load[~faces] == 0.0).all()


@pytest.mark.parametrize("seed", range(6))
def test_loads_of_any_gap_grow_and_pull_nowhere(seed):
    chance = np.random.default_rng(seed)
    gap = chance.uniform(0.0, 10.0 ** chance.uniform(-6.0, -3.5), 16)
    helix = (0.0, 18.0)[seed % 2]
    pair = problem(helix, lambda z: gap, friction=0.1 * (seed % 3 == 0))
    depth = chance.uniform(5e-6, 200e-6) * np.linspace(0.0, 1.0, 33) ** 2
    place = chance.uniform(0.0, 1.0, 3)
    curves = width_load_curves(pair, pair.solver, place, depth)
    faces = curves.gap < OPEN_GAP
    assert (np.diff(curves.load[faces], axis=1) > 0.0).all()
    assert np.isfinite(curves.load).all()
    assert np.isfinite(curves.pressure).all()


def test_what_pairs_yield_is_mutual(curves):
    apart = np.abs(curves.coupling - curves.coupling.transpose(0, 2, 1))
    assert apart.max() < 1e-12 * curves.coupling.max()


def test_fewer_penetrations_change_little(contact, monkeypatch):
    place = np.array([0.3])
    coarse = width_load_curves(contact, contact.solver, place, PENETRATION)
    monkeypatch.setattr("fegear.contact.width.load_curves.SOLVED", 48)
    fine = width_load_curves(contact, contact.solver, place, PENETRATION)
    most = fine.load.max(axis=2, keepdims=True, initial=1.0)
    assert (np.abs(coarse.load - fine.load) / most).max() < 3e-3


def test_every_second_position_is_enough(contact):
    position = 0.2 + np.arange(13) / 128.0
    direct = width_load_curves(contact, contact.solver, position, PENETRATION)
    between = interpolated_curves(contact, contact.solver, position, PENETRATION)
    assert (between.teeth == direct.teeth).all()
    near = direct.gap < PENETRATION[-1]
    most = direct.load.max()
    assert np.abs(between.load - direct.load)[near].max() < 4e-3 * most
    # of corners, whose gaps open fast
    assert np.abs(between.gap - direct.gap)[near].max() < 0.01 * PENETRATION[-1]
    solved = np.abs(between.load - direct.load)[::2][near[::2]]
    assert solved.max() < 1e-9 * most


@pytest.mark.slow
def test_curves_reach_as_far_whichever_way_axes_are_misaligned():
    """The gap is the same but for a rotation, which corners in contact tell alone."""
    loads = []
    for gap in (40.0, -40.0):
        pair = {**SPUR["mesh"][0], "misalignment_um": gap}
        gears = make_gear_set({**SPUR, "mesh": [pair]})
        settings = fegear.ExcitationSettings(resolution="coarse")
        tables = tables_of_equal_teeth(gears, 60.0, Excitations(settings))
        (curves,) = all_mesh_load_curves(
            gears, tables, StaticsSettings(resolution="coarse")
        )
        loads.append(curves.drive)
    one, other = loads
    assert other.penetration == pytest.approx(one.penetration, rel=5e-3)
    assert np.abs(other.load - one.load).max() < 0.01 * one.load.max()


def test_a_rotation_in_common_is_no_deflection():
    columns = {"ste_m": 1e-6 * np.array([[5.0, 7.0]]), "nlte_m": np.zeros((1, 2))}
    turned = {name: values - 9e-6 for name, values in columns.items()}
    place = np.array([0.0, 0.5])
    for values in (columns, turned):
        table = MeshTable(np.array([60.0]), place, values, {})
        assert largest_deflection(table, 60.0) == pytest.approx(7e-6)
    del turned["nlte_m"]
    table = MeshTable(np.array([60.0]), place, turned, {})
    assert largest_deflection(table, 60.0) == pytest.approx(-2e-6)


def test_back_flanks_have_the_curves_of_the_mirror():
    straight = CASES["straight"]()
    position = np.arange(3) / 3.0
    back = pair_load_curves(straight, position, 30e-6, back=True)
    mirrored = back_side_position(straight.pair, position)
    drive = pair_load_curves(straight, mirrored, 30e-6)
    order = [drive.pair_offsets.tolist().index(-k) for k in back.pair_offsets]
    assert back.load == pytest.approx(drive.load[:, order], rel=1e-9)
    assert back.gap == pytest.approx(drive.gap[:, order], rel=1e-9)


LEAD = {
    "name": "lead",
    "defaults": {"module_mm": 3.0, "face_width_mm": 20.0},
    "gear": [
        {"name": "one", "teeth": 21, "hub_radius_mm": 16.0, "tooth_thinning_um": 60.0},
        {"name": "two", "teeth": 30, "hub_radius_mm": 22.0},
    ],
    "mesh": [
        {"driver": "one", "driven": "two", "backlash_um": 60.0}
        | {"lead": {"crowning_um": 8.0}, "misalignment_um": 12.0}
    ],
    "load": {"gear": "one", "torques_Nm": [60.0]},
    "dynamics": {"damping_ratio": 0.05},
}


@pytest.mark.slow
@pytest.mark.parametrize("entries", [HELICAL, LEAD], ids=lambda e: e["name"])
def test_motions_are_those_of_curves_from_tables_over_torques(entries):
    """Tables have all pairs at once: their curves are of the contact as it shares."""
    gears, torque = make_gear_set(entries), 60.0
    statics = fegear.StaticsSettings(
        resolution="coarse", positions=64, estimate_error=False
    )
    torques = [factor * torque for factor in (0.125, 0.25, 0.5, 1.0, 2.0, 4.0)]
    table = fegear.solve_mesh(gears, 1, torques, statics).table
    sources = {
        "pairs": fegear.ExcitationSettings(resolution="coarse", positions=32),
        "tables": GivenTables((("tables", table),)),
    }
    rms, frequencies = {}, {}
    for name, source in sources.items():
        sweep = fegear.Sweep(
            gear_set=gears,
            torque=torque,
            speeds=(1500.0, 2500.0, 5200.0, 8500.0),
            direction="up",
            model=LumpedModel(number="coupled", excitation=source),
        )
        result = fegear.run(sweep)
        rms[name] = np.array(result.to_frame()["dte_rms_m"], float)
        frequencies[name] = result.summary["natural_frequencies_Hz"][0]
    assert frequencies["pairs"] == pytest.approx(frequencies["tables"], rel=0.01)
    np.testing.assert_allclose(rms["pairs"], rms["tables"], rtol=0.04)


@pytest.mark.slow
def test_a_pair_whose_tables_contradict_themselves_is_solved():
    """Of lines of contact that take over slice by slice, tables know no load curve."""
    entries = {
        "name": "long",
        "defaults": {"module_mm": 3.0, "helix_angle_deg": 20.0, "face_width_mm": 20.0},
        "gear": [
            {"name": "one", "teeth": 25, "hub_radius_mm": 15.0},
            {"name": "two", "teeth": 44, "hub_radius_mm": 25.0},
        ],
        "mesh": [{"driver": "one", "driven": "two", "backlash_um": 80.0}],
        "load": {"gear": "one", "torques_Nm": [100.0]},
    }
    coarse = fegear.ExcitationSettings(resolution="coarse", positions=32)
    model = LumpedModel(number="coupled", excitation=coarse)
    (check,) = lumped_system(make_gear_set(entries), 100.0, model).static_checks
    assert abs(check.mean_error) < 5e-3
