"""Laws of tooth pairs from tables whose laws are known."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lumped.train.path_load_curves import OPEN_GAP, path_load_curves
from lumped.train.table import (
    MeshTable,
    format_table,
    pair_compliance_name,
    parse_table,
)

RADIUS, POSITIONS = 0.05, 16
STIFFNESS, SIZE = 2e8, 1e-5  # N/m at this penetration [m]
COUPLING = 6e-10  # m/N
TORQUES = 20.0, 60.0, 150.0
PLACES = -1.0 + np.arange(2 * POSITIONS) / POSITIONS  # of two pairs, from the entering


def gap_at(place):
    return 4e-6 * np.abs(place)


def load_at(x, hardening):
    """Known law: F / x is a straight line over log x, at least a tenth of it."""
    x = np.maximum(x, 1e-30)
    return STIFFNESS * x * np.maximum(1.0 + hardening * np.log(x / SIZE), 0.1)


def bisected(residual, high, rounds=60):
    """Where functions (...,) that rise cross zero, from 0 to high (...,)."""
    low, high = np.zeros_like(high), np.array(high)
    for _ in range(rounds):
        middle = 0.5 * (low + high)
        below = residual(middle) < 0.0
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    return low


def penetration_at(load, hardening):
    top = np.full(np.shape(load), 1e-3)
    return bisected(lambda x: load_at(x, hardening) - load, top)


def make_table(hardening=0.0, coupling=COUPLING, torques=TORQUES):
    """Two pairs in equilibrium: s = g_i + x(F_i) + c F_j, F_1 + F_2 = force."""
    position = np.arange(POSITIONS) / POSITIONS
    force = np.repeat(np.array(torques)[:, None] / RADIUS, POSITIONS, axis=1)
    gaps = gap_at(np.stack([position, position - 1.0]))

    def errors(first):
        loads = np.stack([first, force - first])
        penetrations = penetration_at(loads, hardening)
        return gaps[:, None] + penetrations + coupling * loads[::-1]

    first = bisected(lambda f: -np.diff(errors(f), axis=0)[0], force)
    first = np.where(force - first < 1e-9 * force, force, first)
    first = np.where(first < 1e-9 * force, 0.0, first)
    load = np.stack([first, force - first])
    ste = np.take_along_axis(errors(first), load.argmax(axis=0)[None], axis=0)[0]
    columns = {"stiffness_N_per_m": np.full(ste.shape, STIFFNESS), "ste_m": ste}
    for i in (0, 1):
        columns[f"pair{i + 1}_load_share"] = load[i] / force
        columns[f"pair{i + 1}_gap_m"] = np.broadcast_to(gaps[i], ste.shape)
    columns[pair_compliance_name(0, 1)] = np.full(ste.shape, coupling)
    return MeshTable(np.array(torques), position, columns)


def changed(table, header=None, torque=None, **columns):
    torque = table.torque_Nm if torque is None else np.array(torque)
    table_columns = {
        k: v for k, v in {**table.columns, **columns}.items() if v is not None
    }
    return MeshTable(torque, table.position, table_columns, header or {})


@pytest.mark.parametrize("hardening", [0.0, 0.08])
def test_known_laws_are_found_again(hardening):
    """At the torques, between them and beyond: two pairs that deflect each other."""
    path = path_load_curves(make_table(hardening), RADIUS)
    np.testing.assert_allclose(path.position, PLACES)
    np.testing.assert_allclose(path.gap, gap_at(PLACES))
    assert set(path.compliance) == {-1, 1}
    np.testing.assert_allclose(path.compliance[-1][POSITIONS:], COUPLING)
    np.testing.assert_allclose(path.compliance[1][:POSITIONS], COUPLING)
    expected = load_at(path.penetration[1:], hardening)
    for load in path.load[:, 1:]:
        np.testing.assert_allclose(load, expected, rtol=1e-9)
    assert not path.load[:, 0].any()


@given(
    st.lists(st.floats(0.02, 5.0), min_size=1, max_size=4),
    st.lists(st.floats(0.5, 3.0), min_size=4, max_size=4),
)
def test_loads_grow_from_zero_through_all_points(relative, stiff):
    """One pair alone that stiffens as it likes: jumps, or not at all."""
    x = SIZE * np.sort(relative)
    x *= 1.1 ** np.arange(x.size)  # no two alike
    load = STIFFNESS * x * np.sort(stiff)[: x.size]
    shape = x.size, 4
    columns = {
        "stiffness_N_per_m": np.full(shape, STIFFNESS),
        "ste_m": np.repeat(x[:, None], 4, axis=1),
        "pair1_load_share": np.ones(shape),
        "pair1_gap_m": np.zeros(shape),
    }
    table = MeshTable(load * RADIUS, np.arange(4) / 4, columns)
    path = path_load_curves(table, RADIUS, ["hardening"])
    assert path.load[0, 0] == 0.0
    assert (np.diff(path.load, axis=1) > 0.0).all()
    for penetration, force in zip(x, load, strict=True):
        after = int(np.searchsorted(path.penetration, penetration))
        low, high = path.load[0, after - 1 : after + 1]
        assert low * (1.0 - 1e-9) <= force <= high * (1.0 + 1e-9)


def test_a_pair_that_hardly_carries_goes_on_as_where_it_does():
    """Where it never carries at all, its law is its neighbour's."""
    table = make_table(hardening=0.08)
    far = np.array(table["pair2_gap_m"])
    far[:, 0] = 1e-3  # never closed: pair 1 takes all of it
    share = np.array(table["pair1_load_share"])
    share[:, 0] = 1.0
    ste = np.array(table["ste_m"])
    ste[:, 0] = penetration_at(np.array(TORQUES) / RADIUS, 0.08)
    alone = changed(
        table,
        pair1_load_share=share,
        pair2_load_share=1.0 - share,
        pair2_gap_m=far,
        ste_m=ste,
    )
    path = path_load_curves(alone, RADIUS)
    np.testing.assert_allclose(path.load[0], path.load[1], rtol=1e-6, atol=1e-6)
    assert path.gap[0] == 1e-3


def test_cells_off_the_path_are_gaps_beyond_reach():
    table = make_table(torques=(1.0, 2.0))  # at the ends of the path a pair is free
    free = np.array(table["pair2_load_share"]) == 0.0
    assert free.any()
    assert not free.all()
    none = {
        name: np.where(free, np.nan, table[name])
        for name in ("pair2_load_share", "pair2_gap_m", pair_compliance_name(0, 1))
    }
    off = free.all(axis=0)
    path = path_load_curves(changed(table, **none), RADIUS)
    assert (path.gap[:POSITIONS][off] == OPEN_GAP).all()


def test_one_torque_gives_straight_lines_where_hardening_is_left_out():
    table = make_table(torques=(60.0,))
    with pytest.raises(ValueError, match=r"torques = 1; .* must be without hardening"):
        path_load_curves(table, RADIUS)
    path = path_load_curves(table, RADIUS, ["hardening"])
    expected = STIFFNESS * path.penetration
    np.testing.assert_allclose(path.load, np.tile(expected, (32, 1)), rtol=1e-9)


def test_torques_may_stand_in_any_order_and_in_a_file():
    table = make_table(hardening=0.08)
    turned = MeshTable(
        table.torque_Nm[::-1],
        table.position,
        {name: values[::-1] for name, values in table.columns.items()},
    )
    one, two = (
        path_load_curves(parse_table(format_table(t)), RADIUS) for t in (table, turned)
    )
    np.testing.assert_array_equal(one.load, two.load)
    np.testing.assert_array_equal(one.gap, two.gap)


def test_a_table_without_compliance_is_one_without_pairs():
    name = pair_compliance_name(0, 1)
    bare = changed(make_table(), **{name: None})
    with pytest.raises(ValueError, match=f"{name} is missing; .* without pairs"):
        path_load_curves(bare, RADIUS)
    path = path_load_curves(bare, RADIUS, ["pairs"])
    assert not any(values.any() for values in path.compliance.values())


def test_without_compliance_a_pair_that_others_keep_open_is_open():
    """Alone it would touch: its gap is the transmission error at which it does."""
    name, coupling = pair_compliance_name(0, 1), 5.0 * COUPLING
    table = make_table(coupling=coupling)
    path = path_load_curves(changed(table, **{name: None}), RADIUS, ["pairs"])
    gap_errors = np.array(
        [path.gap[n] - gap_at(place) for n, place in enumerate(PLACES)]
    )
    assert (gap_errors > -1e-18).all()
    assert 0.1 < gap_errors.max() / (coupling * max(TORQUES) / RADIUS) <= 1.0
    idle = np.concatenate([table[f"pair{pair}_load_share"] for pair in (2, 1)], 1) == 0
    reach = np.tile(table["ste_m"], 2) - path.gap
    assert (reach[idle] <= 0.0).all()
    assert (reach[~idle] > 0.0).all()


EMPTY = np.full((3, POSITIONS), np.nan)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"pair1_load_share": None, "pair2_load_share": None},
            "pair1_load_share is mis",
        ),
        ({"header": {"body": "free to accelerate"}}, "body = free to .* hubs"),
        ({"ste_m": EMPTY}, "ste_m has empty cells"),
        ({"torque": (-5.0, 60.0, 150.0)}, "torque_Nm = -5; .* positive"),
        ({"pair1_load_share": EMPTY}, "load_share of all pairs = .* make 1"),
        ({pair_compliance_name(0, 1): EMPTY}, "compliance_m_per_N is nan at 20 N m"),
        ({"pair1_gap_m": np.full((3, POSITIONS), 1e-3)}, "pair1 at .* contradict"),
        ({"torque": (20.0, 60.0, 60.01)}, "pair2 at .* must grow"),
    ],
)
def test_what_is_wrong_is_refused_by_name(change, message):
    with pytest.raises(ValueError, match=message):
        path_load_curves(changed(make_table(), **change), RADIUS)
