"""Motions read back from history files."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from history_files import CYCLES, HEADER, ROWS, columns, share, written

from fegear.files.errors import InputError
from fegear.gearset import load_gear_set
from fegear.rendering.recorded import mesh_motion, read_history

PAIR = load_gear_set("liu-pair")


def motion(path, **changed):
    return mesh_motion(read_history(written(path, **changed)), PAIR, 0)


def test_rows_are_read_as_they_are(tmp_path):
    recording = motion(tmp_path / "h.csv")
    assert (recording.frequency, recording.direction) == (1600.0, "up")
    assert (recording.torque, recording.friction) == (100.0, 0.05)
    table = columns()
    for row in (0, 5, 20, ROWS - 1):
        instant = recording.at(row)
        assert instant.time == table["time_s"][row]
        assert instant.position == pytest.approx(table["mesh1_position"][row])
        assert instant.loads == {
            (k, False): load
            for k in (-1, 0)
            if (load := table[f"mesh1_pair{k}_load_N"][row]) > 0.0
        }
        assert instant.force == pytest.approx(sum(instant.loads.values()))


def test_pairs_are_followed_over_the_end_of_a_cycle(tmp_path):
    """What is pair -1 at the end of a cycle is pair 0 at the start of the next."""
    recording = motion(tmp_path / "h.csv")
    last = ROWS // CYCLES - 1
    middle = recording.at(last + 0.5)
    assert middle.position == pytest.approx(1.0 - 0.5 * CYCLES / ROWS)
    expected = 0.5 * (share(-CYCLES / ROWS) + share(0.0))
    assert middle.loads[-1, False] == pytest.approx(expected)


def test_largest_force_and_back_side(tmp_path):
    back = np.zeros(ROWS + 1)
    back[7] = 9e3
    none = dict.fromkeys(("mesh1_pair0_load_N", "mesh1_pair-1_load_N"), 0.0 * back)
    recording = motion(tmp_path / "h.csv", mesh1_back0_load_N=back, **none)
    largest = recording.largest()
    assert largest.force == -9e3
    assert largest.back
    assert largest.time == columns()["time_s"][7]
    assert not recording.at(3).loads


def test_frames_cover_the_period_of_the_motion(tmp_path):
    """The transmission error repeats after two cycles; a mesh alone after one."""
    recording = motion(tmp_path / "h.csv")
    assert recording.cycles == 2
    frames = recording.frames(8)
    assert [f.position for f in frames] == pytest.approx([0.0, 0.25, 0.5, 0.75] * 2)
    assert frames[-1].time == pytest.approx(7 / 8 * CYCLES / 1600.0)
    single = motion(tmp_path / "s.csv", mesh1_dte_m=1e-5 * columns()["mesh1_position"])
    assert single.cycles == 1


def test_changed_figures_are_known(tmp_path):
    header = HEADER | {"set mesh.1.tip_relief.magnitude_um": "5"}
    file = read_history(written(tmp_path / "h.csv", header))
    assert file.edits == {"mesh.1.tip_relief.magnitude_um": "5"}


OTHER = HEADER | {"gear set": "liu-idler"}
NO_SPEED = {k: v for k, v in HEADER.items() if k != "mesh_frequency_Hz"}
TIMES = columns()["time_s"]


@pytest.mark.parametrize(
    ("header", "changed", "message"),
    [
        (OTHER, {}, "is of gear set liu-idler; allowed are histories of liu-pair"),
        (NO_SPEED, {}, "no number for 'mesh_frequency_Hz'; allowed"),
        (HEADER, {"mesh1_dte_m": None}, "column mesh1_dte_m is missing; allowed"),
        (HEADER, {"mesh1_position": None}, "column mesh1_position is missing"),
        (HEADER, {"idler_rotation_rad": None}, "is of the gears pinion; allowed"),
        (HEADER, {"mesh1_dte_m": np.nan * TIMES}, "mesh1_dte_m has values that are"),
        (HEADER, {"time_s": TIMES**2}, "not in equal steps; allowed"),
        (HEADER, {"mesh1_position": 0.0 * TIMES}, "not in equal steps; allowed"),
        ({}, {}, "is no history of a motion; allowed"),
        (HEADER, {"time_s": None}, "is no history of a motion; allowed"),
    ],
)
def test_files_that_cannot_be_used(tmp_path, header, changed, message):
    path = written(tmp_path / "h.csv", header, **changed)
    with pytest.raises(InputError) as caught:
        mesh_motion(read_history(path), PAIR, 0)
    assert message in str(caught.value)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (lambda data: data[: len(data) - 30], "are named; allowed"),
        (lambda data: data.replace(b"0.0625", b"zero", 1), "could not convert"),
        (lambda data: b"", "is no history"),
        (lambda data: b"\xff\xfe\x00" + data, "not UTF-8 text"),
        (lambda data: b"torque,position\n1,2\n", "is no history"),
    ],
)
def test_damaged_files(tmp_path, damage, message):
    path = written(tmp_path / "h.csv")
    path.write_bytes(damage(path.read_bytes()))
    with pytest.raises(InputError) as caught:
        read_history(path)
    assert message in str(caught.value)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_missing_file(tmp_path):
    with pytest.raises(InputError, match="cannot be read, no such file"):
        read_history(tmp_path / "none.csv")


def test_a_file_cut_short_of_a_cycle_is_refused(tmp_path):
    path = written(tmp_path / "h.csv")
    lines = path.read_text().splitlines()
    path.write_text("\n".join(lines[: len(HEADER) + 1 + ROWS // CYCLES // 2]) + "\n")
    with pytest.raises(InputError, match=r"ends after 0\.50 of a mesh cycle"):
        mesh_motion(read_history(path), PAIR, 0)


def test_a_film_of_a_long_motion_shows_the_cycle_of_the_largest_force(tmp_path):
    """Tooth pairs with pitch errors may take thousands of cycles to repeat."""
    recording = motion(tmp_path / "h.csv")
    assert recording.film_cycles == (0, 2)
    cycle_rows = ROWS // CYCLES
    cycles = 40
    rows = np.arange(cycles * cycle_rows + 1)
    uneven = 1e-5 + 1e-7 * (rows // cycle_rows)
    load = np.where(rows == 23 * cycle_rows + 3, 9e3, 1e3 + rows)
    long = replace(
        recording,
        time=rows * recording.time[1],
        ste=uneven,
        loads={(0, False): load, (-1, False): 0.0 * load},
    )
    assert long.cycles == cycles
    assert long.film_cycles == (23, 1)
    frames = long.frames(4)
    assert [f.position for f in frames] == pytest.approx([0.0, 0.25, 0.5, 0.75])
    assert frames[0].time == pytest.approx(23 * cycle_rows * recording.time[1])
