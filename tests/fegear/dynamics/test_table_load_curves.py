"""The coupled model from mesh tables, beside finite elements and pair laws."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from fegear.contact.pair_load_curves import pair_load_curves
from fegear.dynamics.table_load_curves import load_curves_at
from fegear.files.errors import InputError
from fegear.gearset.power_path import mesh_torques_at
from fegear.statics.contact_problem import contact_problem
from fegear.statics.given_tables import GivenTables, read_mesh_tables
from fegear.statics.settings import StaticsSettings
from fegear.statics.solving import solve_mesh
from fegear.train.coupled import contacts_from_load_curves, coupled_contacts
from fegear.train.lumped_models import lumped_system
from fegear.train.model_settings import LumpedModel
from lumped.steady.integration_settings import Settings
from lumped.steady.steady_state import steady_state
from lumped.steady.steppers import FixedStepper
from lumped.train.path_load_curves import path_load_curves
from lumped.train.table import MeshTable, format_table, pair_compliance_name

POSITIONS = 64
TORQUES = 25.0, 50.0, 100.0, 200.0, 300.0  # N m on the input gear
STATICS = StaticsSettings(positions=POSITIONS, estimate_error=False)
RELIEF = 10.0  # um at all tips
FINE = Settings(steps=256, tolerance=1e-5)


@pytest.fixture(scope="module")
def tables_of(tmp_path_factory):
    """Tables of a case at TORQUES, out of their files."""
    tables_of_cases = {}

    def make(case):
        if case not in tables_of_cases:
            tables, folder = [], tmp_path_factory.mktemp("tables")
            for mesh in range(len(case.gear_set.meshes)):
                torques = [mesh_torques_at(case.gear_set, t)[mesh] for t in TORQUES]
                tables.append(
                    solve_mesh(case.gear_set, mesh + 1, torques, STATICS).table
                )
                path = folder / f"mesh{mesh + 1}.csv"
                path.write_text(format_table(tables[-1]))
            paths = [folder / f"mesh{m + 1}.csv" for m in range(len(tables))]
            tables_of_cases[case] = read_mesh_tables(paths, case.gear_set)
            assert [table for _, table in tables_of_cases[case].tables] == tables
        return tables_of_cases[case]

    return make


def from_tables(case, tables, without=("modes",)):
    contacts = coupled_contacts(case.gear_set, 100.0, case.reference, tables, without)
    return replace(case.reference, contacts=contacts)


def from_laws(case):
    args = case.gear_set, case.reference, case.laws, case.settings
    return replace(case.reference, contacts=contacts_from_load_curves(*args))


def at_rest(case_of, system, torque, **options):
    """Deflection under another torque at the positions of the tables."""
    reference = case_of("liu-pair", torque, **options).reference
    loaded = replace(reference, contacts=system.contacts).loaded
    return loaded.deflection[: -1 : (len(loaded.load) - 1) // POSITIONS, 0]


@pytest.mark.slow
@pytest.mark.parametrize("relief", [0.0, RELIEF])
def test_at_rest_it_is_the_table(case_of, tables_of, relief):
    """Exact at the torques, and close to it between them."""
    case = case_of("liu-pair", relief=relief)
    tables = tables_of(case)
    system, (_, table) = from_tables(case, tables), tables.tables[0]
    for torque, ste in zip(table.torque_Nm, table["ste_m"], strict=True):
        deflection = at_rest(case_of, system, float(torque), relief=relief)
        np.testing.assert_allclose(deflection, ste, rtol=2e-6)
        assert np.median(np.abs(deflection / ste - 1.0)) < 1e-7
    for torque in (35.0, 140.0):
        exact = solve_mesh(case.gear_set, 1, [torque], STATICS).table["ste_m"][0]
        deflection = at_rest(case_of, system, torque, relief=relief)
        np.testing.assert_allclose(deflection, exact, rtol=2e-3)
        assert np.abs(deflection / exact - 1.0).mean() < 1e-4


@pytest.mark.parametrize("relief", [0.0, RELIEF])
def test_its_motion_is_that_of_pair_laws(case_of, tables_of, relief):
    case = case_of("liu-pair", relief=relief)
    systems = from_laws(case), from_tables(case, tables_of(case))
    laws, tables = (system.resonances_Hz for system in systems)
    counts = [(system.loaded.load > 0.0).sum(axis=1) for system in systems]
    differing = np.count_nonzero(counts[0] != counts[1])
    assert differing <= 1
    # a pair that touches by one of both at a position adds at most as much stiffness
    # there as there is in the mean, and the frequency goes with its square root
    touching = 0.5 * differing / counts[0].size
    np.testing.assert_allclose(tables, laws, rtol=3e-4 + touching)
    for speed in (1000.0, 1500.0, 2000.0, 2800.0, 3400.0):
        laws, tables = (
            steady_state(FixedStepper(system), speed, FINE)[0] for system in systems
        )
        np.testing.assert_allclose(tables.dte_rms, laws.dte_rms, rtol=3e-3)
        np.testing.assert_allclose(tables.force_peak, laws.force_peak, rtol=3e-3)


def test_two_meshes_at_a_phase_off_the_tables_positions(case_of, tables_of):
    case = case_of("liu-idler", edits=(("mesh.2.phase", 0.377),))
    systems = from_laws(case), from_tables(case, tables_of(case))
    laws, tables = (system.loaded for system in systems)
    np.testing.assert_allclose(tables.deflection, laws.deflection, rtol=0.01)
    np.testing.assert_allclose(
        systems[1].resonances_Hz, systems[0].resonances_Hz, rtol=2e-3
    )


@pytest.mark.parametrize("back", [False, True])
def test_laws_stand_where_finite_elements_have_them(case_of, tables_of, back):
    """Drive flanks from the table, back flanks as their picture in a mirror."""
    case = case_of("liu-pair")
    problem = contact_problem(case.gear_set, 0, case.settings)
    position = 0.2 + np.arange(9) / 9
    _, table = tables_of(case).tables[0]
    path = path_load_curves(table, problem.pair.driver.base_radius)
    laws = load_curves_at(path, problem.pair, position, back)
    reach = float(table["ste_m"][2].max())
    exact = pair_load_curves(problem, position, reach, back)
    assert set(exact.pair_offsets) <= set(laws.pair_offsets)
    columns = [list(laws.pair_offsets).index(k) for k in exact.pair_offsets]
    close = exact.gap < reach
    assert close.sum() > position.size
    # tables are of transmission errors, laws of penetrations
    closing = (
        np.where(close, exact.moment_arms[..., 0], 1.0)
        / problem.pair.driver.base_radius
    )
    gap = laws.gap[:, columns][close]
    np.testing.assert_allclose(gap, (exact.gap / closing)[close], atol=5e-3 * reach)
    # in corner contact where the nominal path ends
    np.testing.assert_allclose(laws.arc[:, columns][close], exact.arc[close], atol=2e-4)
    for n, k in np.argwhere(exact.gap < 0.5 * reach):
        load = np.interp(
            exact.penetration, laws.penetration, laws.load[n, columns[k], 0]
        )
        scale = exact.load[n, k, 0, -1]
        np.testing.assert_allclose(load, exact.load[n, k, 0], atol=0.02 * scale)
    both = close[:, :, None] & close[:, None, :]
    between = laws.normal_compliance[:, columns][:, :, columns]
    normal = exact.normal_compliance / (closing[:, :, None] * closing[:, None, :])
    np.testing.assert_allclose(between[both], normal[both], rtol=2e-3)


def linear_table(pair, gap, coupling, torques=(50.0, 150.0)):
    """Two pairs that stay in contact: springs that deflect each other."""
    compliance = np.array([[5e-9, coupling], [coupling, 8e-9]])
    gaps, stiff = np.array([0.0, gap]), np.linalg.inv(compliance)
    force = np.array(torques) / pair.driver.base_radius
    ste = (force + (stiff @ gaps).sum()) / stiff.sum()
    load = stiff @ (ste - gaps[:, None])
    shape = len(torques), 8
    columns = {"stiffness_N_per_m": force / ste, "ste_m": ste}
    for i in (0, 1):
        columns[f"pair{i + 1}_load_share"] = load[i] / force
        columns[f"pair{i + 1}_gap_m"] = np.full(len(torques), gaps[i])
        columns[f"pair{i + 1}_stiffness_N_per_m"] = load[i] / (ste - gaps[i])
    columns[pair_compliance_name(0, 1)] = np.full(len(torques), coupling)
    columns = {k: np.repeat(v[:, None], 8, axis=1) for k, v in columns.items()}
    assert all(v.shape == shape for v in columns.values())
    return MeshTable(np.array(torques), np.arange(8) / 8, columns), stiff, gaps


@pytest.mark.parametrize(
    ("gap", "coupling", "torques", "without"),
    [
        (0.0, 0.0, (100.0,), ("hardening", "body")),
        (1e-6, 1e-9, (50.0, 150.0), ("body",)),
        (1e-6, 1e-9, (50.0, 150.0), ("modes",)),
    ],
)
def test_springs_of_another_code_are_solved_by_hand(
    case_of, gap, coupling, torques, without
):
    """Two linear pairs that deflect each other, of a table written by hand."""
    gear_set = case_of("liu-pair").gear_set
    pair = gear_set.meshes[0].pair
    table, stiff, gaps = linear_table(pair, gap, coupling, torques)
    model = LumpedModel(
        number="coupled",
        without=without,
        excitation=GivenTables((("hand.csv", table),)),
    )
    system = lumped_system(gear_set, 100.0, model)
    force = 100.0 / pair.driver.base_radius
    ste = (force + (stiff @ gaps).sum()) / stiff.sum()
    loaded, samples = system.loaded, slice(None, None, 16)  # positions of the table
    np.testing.assert_allclose(loaded.deflection[samples, 0], ste, rtol=1e-9)
    loads = np.sort(loaded.load[samples], axis=1)
    assert (loads[:, :-2] == 0.0).all()
    np.testing.assert_allclose(
        loads[:, -2:],
        np.tile(np.sort(stiff @ (ste - gaps)), (len(loads), 1)),
        rtol=1e-9,
    )
    softness = sum(g.base_radius**2 / g.inertia for g in system.train.gears)
    held = math.sqrt(stiff.sum() * softness) / (2.0 * math.pi)
    stiffness = loaded.tangent(slice(0, -1, 16)).sum(axis=1)[:, 0, 0]
    frequencies = np.sqrt(stiffness) / (2.0 * math.pi)
    if "body" in without:
        np.testing.assert_allclose(frequencies, held, rtol=1e-7)
    else:  # inertia of the gears' own bodies raises the frequency
        assert (frequencies > 1.01 * held).all()
        assert (frequencies < 1.2 * held).all()


def test_equilibrium_is_found_where_relief_is_deeper_than_the_load_presses(case_of):
    case = case_of("liu-pair", 5.0, relief=2.0 * RELIEF)
    ste = from_laws(case).loaded.deflection[:-1, 0]
    settings = replace(STATICS, positions=16)
    exact = solve_mesh(case.gear_set, 1, [5.0], settings).table["ste_m"][0]
    np.testing.assert_allclose(ste[::8], exact, rtol=0.01)


def refused(case, tables, **options):
    model = LumpedModel(number="coupled", excitation=tables, **options)
    with pytest.raises(InputError) as caught:
        lumped_system(case.gear_set, options.pop("torque", 100.0), model)
    return str(caught.value)


def test_what_tables_do_not_know_is_refused_by_the_name_of_the_file(case_of, tables_of):
    case = case_of("liu-pair")
    ((name, table),) = tables_of(case).tables

    def changed_tables(**changes):
        return GivenTables(((name, replace(table, **changes)),))

    one = {n: v[2:3] for n, v in table.columns.items()}
    single = changed_tables(torque_Nm=table.torque_Nm[2:3], columns=one)
    assert f"{name}: torques = 1" in refused(case, single)
    assert "without hardening" in refused(case, single)
    linear = LumpedModel(number="coupled", without=("hardening",), excitation=single)
    deflection = lumped_system(case.gear_set, 100.0, linear).loaded.deflection[:-1:2, 0]
    np.testing.assert_allclose(deflection, one["ste_m"][0], rtol=1e-6)
    free = changed_tables(header={**table.header, "body": "free to accelerate"})
    assert "gears held at their hubs" in refused(case, free)
    model = LumpedModel(number="coupled", excitation=changed_tables())
    with pytest.raises(InputError, match=r"torque 310 N m is outside .* 25 to 300 N m"):
        lumped_system(case.gear_set, 310.0, model)
    gears = (replace(case.gear_set.gears[0], pitch_errors=(0.0, 1e-6) * 19),)
    uneven = replace(case.gear_set, gears=gears + case.gear_set.gears[1:])
    with pytest.raises(InputError, match=r"pitch_errors_um of .* equal teeth"):
        lumped_system(uneven, 100.0, model)
