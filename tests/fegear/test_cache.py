"""The compliance cache is verified, never trusted, and shared."""

from __future__ import annotations

import multiprocessing
from dataclasses import replace

import numpy as np
import pytest
from conftest import make_gear

from fegear.elasticity import cache
from fegear.elasticity import gear_modes as modes
from fegear.elasticity.material import PlaneMaterial
from fegear.elasticity.sector import cyclic_sector
from fegear.files.array_files import load_arrays, save_arrays
from meshes import MeshSize

STEEL = PlaneMaterial(206e9, 0.3)
SMALL = MeshSize().refined(0.3)
GEAR = make_gear(38, 15e-3)


def compute():
    return cache.cached_flank_compliance(GEAR, STEEL, SMALL)


@pytest.fixture
def directory(tmp_path, monkeypatch):
    monkeypatch.setenv("FEGEAR_CACHE_DIR", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.fixture
def counted(monkeypatch):
    """How often the finite elements ran."""
    runs = []
    original = cache.flank_compliance

    def counting(*arguments):
        runs.append(1)
        return original(*arguments)

    monkeypatch.setattr(cache, "flank_compliance", counting)
    return runs


def test_second_call_reads_the_same_bits(directory, counted):
    one, two = compute(), compute()
    assert len(counted) == 1
    np.testing.assert_array_equal(one.normal, two.normal)
    np.testing.assert_array_equal(one.tangential, two.tangential)
    assert replace(two, normal=0, tangential=0) == replace(one, normal=0, tangential=0)


DAMAGE = {
    "empty": lambda data: b"",
    "truncated": lambda data: data[: len(data) // 2],
    "text": lambda data: b"not an archive",
    "flipped": lambda data: (
        data[: len(data) // 2]
        + bytes([data[len(data) // 2] ^ 1])
        + data[len(data) // 2 + 1 :]
    ),
}


@pytest.mark.parametrize("damage", DAMAGE.values(), ids=DAMAGE)
def test_damaged_files_are_rebuilt(directory, counted, damage):
    good = compute()
    (path,) = directory.glob("flank-*.npz")
    path.write_bytes(damage(path.read_bytes()))
    again = compute()
    assert len(counted) == 2
    np.testing.assert_array_equal(again.normal, good.normal)
    compute()
    assert len(counted) == 2


def test_no_flipped_bit_gives_another_result(tmp_path):
    """In any byte: checksums of NumPy's archives leave most header bits out."""
    path, key = tmp_path / "flank.npz", "abc"
    good = {"normal": np.arange(6.0).reshape(1, 2, 3), "grading": np.asarray(0.5)}
    save_arrays(path, key, good)
    content = path.read_bytes()
    assert same_arrays(load_arrays(path, key), good)
    assert load_arrays(path, "abd") is None
    for index in range(len(content)):
        damaged = bytearray(content)
        damaged[index] ^= 1 << index % 8
        path.write_bytes(damaged)
        assert load_arrays(path, key) is None, index


def same_arrays(actual, expected):
    return actual.keys() == expected.keys() and all(
        np.array_equal(actual[name], expected[name]) for name in expected
    )


def test_flipped_bits_of_a_real_file_change_no_compliance(directory, counted):
    """Bits of the headers, where order and shape of the arrays are, and any others."""
    good = compute()
    (path,) = directory.glob("flank-*.npz")
    content, chance = path.read_bytes(), np.random.default_rng(43)
    start = content.index(b"fortran_order")
    bits = {*range(8 * start, 8 * (start + 60), 8)}
    bits |= set(chance.integers(0, 8 * len(content), 100).tolist())
    key = cache.cache_key(GEAR, STEEL, SMALL, 2, True)
    for bit in bits:
        damaged = bytearray(content)
        damaged[bit // 8] ^= 1 << bit % 8
        path.write_bytes(damaged)
        assert load_arrays(path, key) is None, bit
    again = compute()
    assert len(counted) == 2
    np.testing.assert_array_equal(again.normal, good.normal)


def test_a_valid_file_of_other_inputs_is_not_taken(directory, counted):
    compute()
    (path,) = directory.glob("flank-*.npz")
    other = make_gear(39, 15e-3)
    key = cache.cache_key(other, STEEL, SMALL, 2, True)
    path.rename(directory / f"flank-{key[:32]}.npz")
    cache.cached_flank_compliance(other, STEEL, SMALL)
    assert len(counted) == 2


def test_pickles_are_refused(directory):
    directory.mkdir()
    key = cache.cache_key(GEAR, STEEL, SMALL, 2, True)
    path = directory / f"flank-{key[:32]}.npz"
    np.savez(path, normal=np.array([object()], dtype=object))
    assert load_arrays(path, key) is None


@pytest.mark.parametrize(
    "change",
    [
        {"gear": make_gear(38, 15.000001e-3)},
        {"material": PlaneMaterial(206e9, 0.3, "strain")},
        {"size": MeshSize()},
        {"order": 1},
        {"split": False},
    ],
    ids=lambda change: next(iter(change)),
)
def test_every_input_changes_the_key(change):
    inputs = {"gear": GEAR, "material": STEEL, "size": SMALL, "order": 2, "split": True}
    assert cache.cache_key(**inputs) != cache.cache_key(**(inputs | change))


def test_a_directory_that_cannot_be_made_only_costs_time(tmp_path, monkeypatch):
    blocked = tmp_path / "file"
    blocked.write_text("")
    monkeypatch.setenv("FEGEAR_CACHE_DIR", str(blocked / "cache"))
    assert np.isfinite(compute().normal).all()


def test_nothing_is_left_beside(directory):
    compute()
    assert [p.suffix for p in directory.iterdir()] == [".npz"]


def test_processes_share_the_directory(directory):
    context = multiprocessing.get_context("spawn")
    with context.Pool(2) as pool:
        results = [pool.apply_async(compute) for _ in range(4)]
        tables = [r.get(timeout=120).normal for r in results]
    for table in tables[1:]:
        np.testing.assert_array_equal(table, tables[0])


def test_modes_are_read_as_they_were_solved(directory, monkeypatch):
    """Families are kept one by one, whichever others a torque asks for."""
    solved, original = [], modes._solve_modes

    def counting(sector, mass, n, count):
        solved.append(n)
        return original(sector, mass, n, count)

    monkeypatch.setattr(modes, "_solve_modes", counting)
    sector = cyclic_sector(GEAR, STEEL, SMALL)
    first = modes.lowest_modes(sector, 7850.0, range(3), 2)
    again = modes.lowest_modes(sector, 7850.0, range(3), 2)
    assert solved == [0, 1, 2]
    for name, values in vars(first).items():
        np.testing.assert_array_equal(vars(again)[name], values)
    more = modes.lowest_modes(sector, 7850.0, range(3), 2, 5, 1e6)
    assert solved == [0, 1, 2, 3, 4]
    assert (np.diff(more.frequencies_Hz) >= 0.0).all()
    assert more.frequencies_Hz.size == 2 + 4 * 4
    modes.lowest_modes(sector, 7800.0, range(1), 2)
    assert solved[5:] == [0]
    for path in directory.glob("modes-*.npz"):
        path.write_bytes(path.read_bytes()[:-1] + b"x")
    np.testing.assert_array_equal(
        modes.lowest_modes(sector, 7850.0, range(3), 2).normal, first.normal
    )
    assert len(solved) == 9
