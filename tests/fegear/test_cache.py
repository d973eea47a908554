"""The compliance cache is verified, never trusted, and shared."""

from __future__ import annotations

import io
import multiprocessing
import shutil
from dataclasses import replace

import numpy as np
import pytest
from conftest import make_gear

from fegear.elasticity import cache
from fegear.elasticity import gear_modes as modes
from fegear.elasticity.flank import FlankCompliance
from fegear.elasticity.material import PlaneMaterial
from fegear.elasticity.sector import cyclic_sector
from fegear.files.array_bytes import unpack
from fegear.files.kept import INPUTS
from meshes import MeshSize

STEEL = PlaneMaterial(206e9, 0.3)
SMALL = MeshSize().refined(0.3)
GEAR = make_gear(38, 15e-3)
FILES = [cache.ARRAYS, INPUTS]


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


@pytest.mark.parametrize("name", FILES)
def test_damaged_files_are_rebuilt(directory, counted, name):
    good = compute()
    (path,) = directory.glob(f"flank-*/{name}")
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    again = compute()
    assert len(counted) == 2
    np.testing.assert_array_equal(again.normal, good.normal)
    compute()
    assert len(counted) == 2


def test_a_valid_file_of_other_inputs_is_not_taken(directory, counted):
    compute()
    (path,) = directory.iterdir()
    other = make_gear(39, 15e-3)
    cache.cached_flank_compliance(other, STEEL, SMALL)
    (of_other,) = set(directory.iterdir()) - {path}
    shutil.rmtree(of_other)
    path.rename(of_other)
    cache.cached_flank_compliance(other, STEEL, SMALL)
    assert len(counted) == 3


def test_pickles_are_refused():
    out = io.BytesIO()
    np.savez(out, normal=np.array([object()], dtype=object))
    with pytest.raises(ValueError, match="allow_pickle"):
        unpack(out.getvalue())


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
def test_every_input_changes_the_directory(directory, monkeypatch, change):
    table = np.zeros(1)
    some = FlankCompliance(table, table, 1.0, 1.0, 1.0, 0.3, True)
    monkeypatch.setattr(cache, "cyclic_sector", lambda *_: None)
    monkeypatch.setattr(cache, "flank_compliance", lambda *_: some)
    inputs = {"gear": GEAR, "material": STEEL, "size": SMALL, "order": 2, "split": True}
    cache.cached_flank_compliance(**inputs)
    cache.cached_flank_compliance(**(inputs | change))
    assert len(list(directory.iterdir())) == 2


def test_a_directory_that_cannot_be_made_only_costs_time(tmp_path, monkeypatch):
    blocked = tmp_path / "file"
    blocked.write_text("")
    monkeypatch.setenv("FEGEAR_CACHE_DIR", str(blocked / "cache"))
    assert np.isfinite(compute().normal).all()


def test_nothing_is_left_beside(directory):
    compute()
    (made,) = directory.iterdir()
    assert sorted(path.name for path in made.iterdir()) == sorted(FILES)


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
    for path in directory.glob("modes-*/arrays.npz"):
        path.write_bytes(path.read_bytes()[:-1] + b"x")
    np.testing.assert_array_equal(
        modes.lowest_modes(sector, 7850.0, range(3), 2).normal, first.normal
    )
    assert len(solved) == 9
