"""Excitations from mesh tables: pairs joined across pitches, torques, messages."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from lumped import MeshExcitation, MeshTable, PairExcitation, excitation_from_table
from lumped.train.excitation_tables import column_at_torque
from lumped.train.waves import constant_wave, sum_waves

RADIUS, POSITIONS, RATIO = 0.04535, 48, 1.6
TORQUES = (80.0, 120.0)
AHEAD = "pairs ahead of the reference pair [base pitches]"


def pair_stiffness(x):
    """Of one pair, x base pitches past its pitch point [N/m]; none out of contact."""
    inside = np.abs(x) < 0.5 * RATIO
    return np.where(inside, 2.0e8 * (1.0 - 0.5 * x**2 + 0.1 * x), 0.0)


def pair_gap(x):
    """Relief growing to both ends [m]."""
    return 1e-5 * np.maximum(np.abs(x) - 0.3, 0.0) ** 2


def equilibrium(stiffness, gap, force):
    """Deflections (n,) at which springs (p, n) carry a force, by bisection."""
    low = np.zeros(stiffness.shape[1])
    high = low + 1e-3
    for _ in range(80):
        middle = 0.5 * (low + high)
        held = (stiffness * np.maximum(middle - gap, 0.0)).sum(axis=0)
        low, high = (
            np.where(held < force, middle, low),
            np.where(held < force, high, middle),
        )
    return 0.5 * (low + high)


def make_table(torques=TORQUES, ahead=(0, -1), relief=1.0):
    """What a statics code writes for the pairs above, pairs in any order."""
    x = np.arange(POSITIONS) / POSITIONS
    k = np.array([pair_stiffness(x + a) for a in ahead])
    g = relief * np.array([pair_gap(x + a) for a in ahead])
    columns = {name: [] for name in ("stiffness_N_per_m", "ste_m", "nlte_m")}
    columns |= {
        f"pair{i}_{name}": []
        for i in (1, 2)
        for name in ("stiffness_N_per_m", "load_share", "gap_m")
    }
    for torque in torques:
        force = torque / RADIUS
        ste = equilibrium(k, g, force)
        free = np.where(k > 0.0, g, np.inf).min(axis=0)
        load = k * np.maximum(ste - g, 0.0)
        columns["ste_m"].append(ste)
        columns["nlte_m"].append(free)
        columns["stiffness_N_per_m"].append(force / (ste - free))
        for i in (0, 1):
            touches = load[i] > 0.0
            values = (
                np.where(touches, k[i], np.nan),
                load[i] / force,
                np.where(k[i] > 0.0, g[i], np.nan),
            )
            for name, value in zip(
                ("stiffness_N_per_m", "load_share", "gap_m"), values, strict=True
            ):
                columns[f"pair{i + 1}_{name}"].append(value)
    header = {AHEAD: " ".join(f"pair{i}={a:+d}" for i, a in enumerate(ahead, 1))}
    return MeshTable(
        np.array(torques),
        x,
        {name: np.array(values) for name, values in columns.items()},
        header,
    )


def deflection(excitation, x, force):
    k = np.array([pair.stiffness(x) for pair in excitation.pairs])
    g = np.array([pair.gap(x) for pair in excitation.pairs])
    return equilibrium(k, g, force)


@pytest.mark.parametrize("ahead", [(0, -1), (-1, 0)])
@pytest.mark.parametrize("torque", TORQUES)
@pytest.mark.parametrize("relief", [0.0, 1.0])
def test_equilibrium_of_the_pairs_is_the_tables_error(ahead, torque, relief):
    """Model-1 at rest, at every position of the table."""
    table = make_table(ahead=ahead, relief=relief)
    excitation = excitation_from_table(table, torque)
    error = deflection(excitation, table.position, torque / RADIUS)
    expected = column_at_torque(table, "ste_m", torque)
    np.testing.assert_allclose(error, expected, rtol=1e-9)


@pytest.mark.parametrize(("corners", "tolerance"), [(False, 1e-9), (True, 3e-3)])
def test_equilibrium_with_a_finite_element_table(corners, tolerance):
    """A force on a tip corner has a shorter lever than the base radius."""
    from fegear.gearset import load_gear_set
    from fegear.statics.settings import StaticsSettings
    from fegear.statics.solving import solve_mesh

    gear_set = load_gear_set("liu-pair")
    settings = StaticsSettings(
        positions=64, corner_contact=corners, estimate_error=False
    )
    table = solve_mesh(gear_set, 1, [100.0], settings).table
    excitation = excitation_from_table(table, 100.0)
    radius = gear_set.meshes[0].pair.driver.base_radius
    error = deflection(excitation, table.position, 100.0 / radius)
    np.testing.assert_allclose(error, table["ste_m"][0], rtol=tolerance)


def test_pairs_hand_over_at_the_pitch_without_a_jump():
    excitation = excitation_from_table(make_table(), 100.0)
    ends = [(pair.stiffness(1.0, -1), pair.stiffness(0.0)) for pair in excitation.pairs]
    leaving, entering = sorted(ends, key=lambda pair: float(pair[0]))
    assert float(leaving[0]) == pytest.approx(0.0, abs=1.0)
    assert entering[0] == pytest.approx(leaving[1], rel=1e-9)
    assert float(entering[1]) == pytest.approx(0.0, abs=1.0)


def test_no_pair_adds_stiffness_that_the_table_has_not():
    """Between positions the sum stays within its neighbours, jumps included."""
    excitation = excitation_from_table(make_table(relief=0.0), 100.0)
    x = np.linspace(0.0, 1.0, 2000, endpoint=False)
    stiffness = sum_waves([pair.stiffness for pair in excitation.pairs])(x)
    samples = excitation_sum(np.arange(POSITIONS) / POSITIONS)
    assert stiffness.max() < 1.02 * samples.max()
    assert stiffness.min() > 0.98 * samples.min()


def excitation_sum(x):
    return sum(pair_stiffness(x + a) for a in (0, -1))


def test_torques_between_are_interpolated():
    table = make_table()
    one, middle, two = (
        column_at_torque(table, "ste_m", t) for t in (80.0, 90.0, 120.0)
    )
    np.testing.assert_allclose(middle, 0.75 * one + 0.25 * two, rtol=1e-14)
    np.testing.assert_array_equal(one, table["ste_m"][0])
    np.testing.assert_array_equal(two, table["ste_m"][1])


def test_torques_may_stand_in_any_order():
    one, two = make_table(), make_table(torques=TORQUES[::-1])
    for name in ("ste_m", "stiffness_N_per_m"):
        np.testing.assert_allclose(
            column_at_torque(two, name, 93.0),
            column_at_torque(one, name, 93.0),
            rtol=1e-14,
        )


@pytest.mark.parametrize("torque", [79.0, 121.0, -80.0, math.nan])
def test_torques_outside_are_named(torque):
    wrong = r"outside of the mesh table's 80 to 120 N m|torque = nan; must be"
    with pytest.raises(ValueError, match=wrong):
        excitation_from_table(make_table(), torque)


def test_model_2_is_mean_stiffness_and_loaded_error():
    table = make_table()
    excitation = excitation_from_table(table, 80.0, model=2)
    (spring,) = excitation.pairs
    mean = table["stiffness_N_per_m"][0].mean()
    assert spring.stiffness(0.3) == pytest.approx(mean)
    error = table["ste_m"][0]
    np.testing.assert_allclose(
        spring.gap(table.position), error - error.mean(), atol=1e-18
    )


def test_model_3_is_total_stiffness_and_unloaded_error():
    table = make_table()
    excitation = excitation_from_table(table, 80.0, model=3)
    (spring,) = excitation.pairs
    x = table.position
    np.testing.assert_allclose(spring.stiffness(x), table["stiffness_N_per_m"][0])
    np.testing.assert_allclose(spring.gap(x), table["nlte_m"][0], atol=1e-18)
    assert excitation.mean_stiffness == spring.stiffness.mean


def test_model_3_carries_the_load_at_the_tables_error():
    table = make_table()
    (spring,) = excitation_from_table(table, 80.0, model=3).pairs
    x = table.position
    force = spring.stiffness(x) * (table["ste_m"][0] - spring.gap(x))
    np.testing.assert_allclose(force, 80.0 / RADIUS, rtol=1e-12)


@pytest.mark.parametrize("model", [1, 2, 3])
def test_stiffness_comes_from_the_unmodified_teeth(model):
    """Relieved teeth that carry nothing at rest have one all the same."""
    plain, relieved = make_table(relief=0.0), make_table(relief=30.0)
    excitation = excitation_from_table(relieved, 80.0, model, plain)
    x = plain.position
    stiffness = sum(pair.stiffness(x) for pair in excitation.pairs)
    expected = plain["stiffness_N_per_m"][0]
    if model == 2:
        expected = np.full_like(expected, expected.mean())
    np.testing.assert_allclose(stiffness, expected, rtol=1e-9)


def minimal(**changes):
    x = np.arange(8) / 8
    stiffness = 3e8 + 1e7 * np.cos(2 * np.pi * x)
    values = {"columns": {"stiffness_N_per_m": stiffness[None]}, "position": x}
    return MeshTable(torque_Nm=np.array([100.0]), **(values | changes))


@pytest.mark.parametrize("model", [1, 3])
def test_tables_of_another_code_need_only_a_stiffness(model):
    excitation = excitation_from_table(minimal(), 100.0, model)
    (spring,) = excitation.pairs
    assert spring.gap(0.3) == 0.0
    assert excitation.mean_stiffness == pytest.approx(3e8, rel=1e-6)


def test_missing_columns_are_named():
    with pytest.raises(ValueError, match="no column ste_m"):
        excitation_from_table(minimal(), 100.0, model=2)


def test_uneven_positions_are_refused():
    table = replace(minimal(), position=np.arange(8) / 9.0)
    with pytest.raises(ValueError, match="equally spaced positions"):
        excitation_from_table(table, 100.0)


@pytest.mark.parametrize("model", [1, 3])
def test_stiffness_that_is_no_number_is_refused(model):
    stiffness = np.full((1, 8), 3e8)
    stiffness[0, 3] = math.nan
    table = minimal(columns={"stiffness_N_per_m": stiffness})
    with pytest.raises(ValueError, match=r"finite|positive"):
        excitation_from_table(table, 100.0, model)


def test_models_are_counted():
    with pytest.raises(ValueError, match="model = 0; must be 1, 2 or 3"):
        excitation_from_table(minimal(), 100.0, model=0)


@pytest.mark.parametrize("mean", [0.0, -1.0, math.nan, math.inf])
def test_mean_stiffness_is_checked(mean):
    spring = PairExcitation(constant_wave(1.0), constant_wave(0.0))
    with pytest.raises(ValueError, match=r"mean_stiffness = .*; must be positive"):
        MeshExcitation((spring,), mean)


def test_a_mesh_has_pairs():
    with pytest.raises(ValueError, match="pairs must not be empty"):
        MeshExcitation((), 3e8)


def changed(table, column, value, t, n):
    columns = dict(table.columns)
    columns[column] = columns[column].copy()
    columns[column][t, n] = value
    return MeshTable(table.torque_Nm, table.position, columns, table.header)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("torque", [0, 1])
@pytest.mark.parametrize(
    ("model", "column"),
    [
        (1, "pair1_gap_m"),
        (1, "pair2_gap_m"),
        (1, "pair1_stiffness_N_per_m"),
        (1, "pair2_stiffness_N_per_m"),
        (1, "stiffness_N_per_m"),
        (2, "stiffness_N_per_m"),
        (2, "ste_m"),
        (3, "stiffness_N_per_m"),
        (3, "nlte_m"),
    ],
)
def test_no_hole_in_a_table_becomes_a_number(model, column, value, torque):
    table = make_table()
    carries = table["pair2_load_share"][torque] > 0.0  # pair 1 does everywhere
    n = int(np.flatnonzero(carries)[carries.sum() // 2])
    wrong = changed(table, column, value, torque, n)
    with pytest.raises(ValueError, match=column) as caught:
        excitation_from_table(wrong, 100.0, model)
    seen = "empty" if np.isnan(value) else str(value)
    where = f"torque {table.torque_Nm[torque]:g} N m, position {table.position[n]:g}"
    assert f"{column} is {seen} at {where}; " in str(caught.value)


def test_a_row_without_any_pair_on_the_path_is_a_hole():
    table = make_table()
    share, n = table["pair1_load_share"][0], 3
    assert share[n] > 0.0
    for name in ("stiffness_N_per_m", "load_share", "gap_m"):
        table = changed(table, f"pair1_{name}", np.nan, 0, n)
    with pytest.raises(ValueError, match="pair1_stiffness_N_per_m is empty"):
        excitation_from_table(table, 100.0)


def test_a_pair_that_carries_has_stiffness():
    table = make_table()
    for value in (0.0, -1e8):
        wrong = changed(table, "pair1_stiffness_N_per_m", value, 0, 3)
        with pytest.raises(ValueError, match="pair1_stiffness_N_per_m is"):
            excitation_from_table(wrong, 100.0)


def test_cells_off_the_path_of_contact_may_be_empty():
    table = make_table()
    off = np.isnan(table["pair2_stiffness_N_per_m"][0])
    assert off.any()
    zeros = table
    for n in np.flatnonzero(off):
        zeros = changed(zeros, "pair2_stiffness_N_per_m", 0.0, 0, n)
    x = np.linspace(0.0, 1.0, 100)
    one, other = (
        excitation_from_table(mesh_table, TORQUES[0]) for mesh_table in (table, zeros)
    )
    for p, q in zip(one.pairs, other.pairs, strict=True):
        np.testing.assert_array_equal(p.stiffness(x), q.stiffness(x))


def test_a_missing_column_is_named():
    table = make_table()
    columns = {n: v for n, v in table.columns.items() if n != "pair2_gap_m"}
    short = MeshTable(table.torque_Nm, table.position, columns, table.header)
    with pytest.raises(ValueError, match="no column pair2_gap_m"):
        excitation_from_table(short, 100.0)


def single(torque=80.0):
    return make_table(torques=(torque,))


@pytest.mark.parametrize("torque", [800.0, 81.0, 0.0])
def test_model_2_refuses_a_table_of_another_torque(torque):
    """Its transmission error is that under the torque: 7 times off at ten times it."""
    with pytest.raises(ValueError, match=r"torque .* N m; the mesh table is of 80 N m"):
        excitation_from_table(single(), torque, model=2)
    for model in (1, 3):
        assert excitation_from_table(single(), torque, model=model).pairs


def test_model_2_takes_a_table_of_its_torque_as_it_is_typed():
    gap = excitation_from_table(single(144.74), 100.0 * 55 / 38, model=2).pairs[0].gap
    exact_gap = excitation_from_table(single(144.74), 144.74, model=2).pairs[0].gap
    x = np.linspace(0.0, 1.0, 9)
    np.testing.assert_array_equal(gap(x), exact_gap(x))
