"""Recordings of every format: what is read, and what is refused in one line."""

from __future__ import annotations

import io
import wave
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.io import savemat, wavfile

from fegear.files import recording_formats
from fegear.files.errors import InputError
from fegear.files.recordings import Recording, read_recording

RATE, COUNT = 1000.0, 60
TIME = 0.25 + np.arange(COUNT) / RATE
A, B = np.sin(40.0 * TIME), 3.0 * np.cos(55.0 * TIME)
WITH_TIME = {"time_s": TIME, "a": A, "b": B}
WITHOUT_TIME = {"a": A, "b": B}


def csv(
    columns: Mapping[str, np.ndarray], separator: str = ",", comma: str = "."
) -> str:
    rows = zip(*columns.values(), strict=True)
    lines = [separator.join(f"{v!r}".replace(".", comma) for v in r) for r in rows]
    return "\n".join([separator.join(columns), *lines]) + "\n"


def plain(columns: Mapping[str, np.ndarray]) -> dict[str, list[float]]:
    return {name: values.tolist() for name, values in columns.items()}


def write_csv(path: Path) -> None:
    path.write_text(csv(plain(WITH_TIME)))


def write_semicolons(path: Path) -> None:
    columns = {"Time [s]": TIME.tolist()} | plain(WITHOUT_TIME)
    path.write_text("# rig: 3\n" + csv(columns, ";", ","))


def write_tabs(path: Path) -> None:
    path.write_text(csv(plain(WITH_TIME), "\t"))


def write_mat(path: Path) -> None:
    savemat(path, {name: values[:, None] for name, values in WITH_TIME.items()})


def write_struct(path: Path) -> None:
    table = {"a": A, "b": B, "t": TIME[None, :]}
    savemat(path, {"other": {"x": A[:7]}, "run": table, "text": "rig"})


def write_hdf5(path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        file["average/x"] = A[:9]
        for name, values in WITH_TIME.items():
            file[f"table/{name}"] = values


def write_mat_73(path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in WITH_TIME.items():
            file[name] = values[None, :]
            file[name].attrs["MATLAB_class"] = np.bytes_("double")
    content = path.read_bytes()
    path.write_bytes(b"MATLAB 7.3 MAT-file".ljust(512) + content[512:])


def write_tdms(path: Path) -> None:
    nptdms = pytest.importorskip("nptdms")
    wave_properties = {"wf_increment": 1.0 / RATE, "wf_start_offset": float(TIME[0])}
    with nptdms.TdmsWriter(str(path)) as file:
        file.write_segment(
            [
                nptdms.ChannelObject("rig", name, values, properties=wave_properties)
                for name, values in WITHOUT_TIME.items()
            ]
        )


def write_wav(path: Path) -> None:
    wavfile.write(path, int(RATE), np.stack([A, B], axis=1))


WRITERS: dict[str, Callable[[Path], None]] = {
    "r.csv": write_csv,
    "semicolons.txt": write_semicolons,
    "tabs.txt": write_tabs,
    "r.mat": write_mat,
    "struct.mat": write_struct,
    "v73.mat": write_mat_73,
    "r.h5": write_hdf5,
    "r.tdms": write_tdms,
}


@pytest.mark.parametrize("name", WRITERS)
def test_every_format_has_the_same_channels(tmp_path, name):
    path = tmp_path / name
    WRITERS[name](path)
    recording = read_recording(str(path))
    assert list(recording.channels) == ["a", "b"]
    np.testing.assert_array_equal(recording.channels["a"], A)
    np.testing.assert_array_equal(recording.channels["b"], B)
    assert recording.rate == pytest.approx(RATE, rel=1e-12)
    assert recording.start == pytest.approx(TIME[0])
    np.testing.assert_allclose(recording.time, TIME, rtol=1e-12)
    assert recording.notes == ()
    (chosen,) = read_recording(str(path), ["b"]).channels.items()
    assert chosen[0] == "b"


@pytest.mark.parametrize("kind", ["int16", "int32", "uint8", "float32"])
def test_integers_of_wav_files_are_over_their_largest(tmp_path, kind):
    path = tmp_path / "r.wav"
    signal = 0.9 * np.stack([A, B / 3.0], axis=1)
    dtype = np.dtype(kind)
    scale = {"i": 2.0 ** (8 * dtype.itemsize - 1), "u": 128.0, "f": 1.0}[dtype.kind]
    wavfile.write(path, 8000, (scale * signal + 128.0 * (kind == "uint8")).astype(kind))
    recording = read_recording(str(path))
    assert recording.rate == 8000.0
    assert list(recording.channels) == ["channel1", "channel2"]
    read = np.stack(list(recording.channels.values()), axis=1)
    np.testing.assert_allclose(read, signal, atol=1.01 / scale + 1e-7)


def test_24_bits_of_one_channel(tmp_path):
    path = tmp_path / "r.wav"
    values = (A * 2.0**22).astype(int)
    with wave.open(str(path), "wb") as file:
        file.setparams((1, 3, 48_000, 0, "NONE", ""))
        file.writeframes(
            b"".join(int(v).to_bytes(3, "little", signed=True) for v in values)
        )
    recording = read_recording(str(path))
    assert recording.rate == 48_000.0
    np.testing.assert_allclose(recording.channels["channel1"], values / 2.0**23)


@pytest.mark.parametrize(
    ("name", "value"),
    [("fs", 500.0), ("dt", 2e-3), ("Rate_Hz", 500), ("fs_kHz", 0.5), ("dt_ms", 2.0)],
)
def test_rates_beside_vectors_and_matrices(tmp_path, name, value):
    path = tmp_path / "r.mat"
    savemat(path, {name: value, "m": np.stack([A, B], axis=1), "a": A, "gain": 3.0})
    recording = read_recording(str(path))
    assert recording.rate == pytest.approx(500.0)
    assert list(recording.channels) == ["m1", "m2", "a"]
    np.testing.assert_array_equal(recording.channels["m2"], B)


@pytest.mark.parametrize(
    ("name", "seconds"),
    [
        ("Time [ms]", 1e-3),
        ("t (us)", 1e-6),
        ("time_ms", 1e-3),
        ("time [\u03bcs]", 1e-6),
    ],
)
def test_units_of_times(tmp_path, name, seconds):
    path = tmp_path / "r.csv"
    times = {name: (TIME / seconds).tolist()}
    path.write_text(csv(times | plain(WITHOUT_TIME)), encoding="utf-8")
    recording = read_recording(str(path))
    assert recording.rate == pytest.approx(1.0 / (TIME[1] - TIME[0]))
    np.testing.assert_allclose(recording.time, TIME, atol=1e-12)
    assert list(recording.channels) == list(WITHOUT_TIME)


def test_times_of_an_unknown_unit_are_none(tmp_path):
    path = tmp_path / "r.csv"
    path.write_text(csv({"time [min]": TIME.tolist()} | plain(WITHOUT_TIME)))
    with pytest.raises(InputError, match=r"has no times \(time_s, time or t\)"):
        read_recording(str(path))


def test_a_rate_of_a_group(tmp_path):
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "r.h5"
    with h5py.File(path, "w") as file:
        file["a"] = A
        file.attrs["sampling_rate"] = 250.0
        file.attrs["rig"] = "3"
    assert read_recording(str(path)).rate == 250.0


def test_steps_that_jitter_are_made_equal(tmp_path):
    path = tmp_path / "r.csv"
    random = np.random.default_rng(3).uniform(-1.0, 1.0, COUNT)
    time = TIME + 2e-4 / RATE * random * (np.arange(COUNT) % (COUNT - 1) > 0)
    columns = {"time": time, "a": np.sin(40.0 * time)}
    path.write_text(csv(plain(columns)))
    recording = read_recording(str(path))
    np.testing.assert_allclose(recording.time, TIME, rtol=1e-12)
    np.testing.assert_allclose(recording.channels["a"], A, atol=1e-6)
    (note,) = recording.notes
    assert note.startswith("steps of time differ by 0.0003")
    by_rate = read_recording(str(path), rate=RATE)
    np.testing.assert_array_equal(by_rate.channels["a"], columns["a"])


BAD = np.where(np.arange(COUNT) == 7, np.nan, A)
LATE = np.where(np.arange(COUNT) == 5, TIME + 4e-3, TIME)
ROUGH = np.where(np.arange(COUNT) == 5, TIME + 2e-6, TIME)
REFUSED = {
    "a has nan in sample 8, 1 such values; allowed -1e+30 to 1e+30": {
        "time": TIME,
        "a": BAD,
    },
    "a has inf in sample 60, 1 such values": {
        "time": TIME,
        "a": np.append(A[1:], np.inf),
    },
    "time is 0.259 s in sample 6 and 0.256 s in the next; times must rise": {
        "time": LATE,
        "a": A,
    },
    "step of time after sample 5 is 0.001002 s, the mean 0.001 s; at most 0.001": {
        "time": ROUGH,
        "a": A,
    },
    "has no times (time_s, time or t) and no sampling rate; --rate in Hz": {"a": A},
    "has no channel, a vector of two or more numbers": {"time": TIME},
    "a has 3 values; 4 or more are needed": {"a": A[:3]},
}


@pytest.mark.parametrize("message", REFUSED)
def test_columns_that_are_no_recording(tmp_path, message):
    path = tmp_path / "r.csv"
    path.write_text(csv(plain(REFUSED[message])))
    with pytest.raises(InputError) as error:
        read_recording(str(path), rate_name="--rate")
    assert str(error.value).startswith(f"{path}: ")
    assert message in str(error.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "no column names"),
        ("# rig: 3\n", "no column names"),
        ("1,2\n3,4\n", "line 1: 1, 2; names of the columns are needed here"),
        ("a,b\n", "no rows below the names"),
        ("a,a\n1,2\n", "column a is there more than once"),
        ("a,b\n1,2\n3\n5,6\n", "line 3: 1 cells where 2 are named"),
        ("a,b\n1,2,3\n4,5,6\n", "line 2: 3 cells where 2 are named"),
        ("a,b\n1,2\n3,x\n", "line 3: column b has 'x'; must be a number"),
        ("a,b\n1,\n3,4\n5,6\n7,8\n", "b has nan in sample 1, 1 such values"),
    ],
)
def test_text_that_is_no_table(tmp_path, text, message):
    path = tmp_path / "r.txt"
    path.write_text(text)
    with pytest.raises(InputError) as error:
        read_recording(str(path), rate=RATE)
    assert message in str(error.value)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"names": ["c"]}, "has no channel c; it has a, b"),
        ({"rate": 1002.0}, "rate = 1002; times of "),
    ],
)
def test_what_does_not_fit_the_file(tmp_path, arguments, message):
    path = tmp_path / "r.csv"
    write_csv(path)
    with pytest.raises(InputError, match=message):
        read_recording(str(path), **arguments)


def test_columns_of_different_length_and_rate(tmp_path):
    path = tmp_path / "r.mat"
    savemat(path, {"fs": RATE, "a": A, "b": B[:50]})
    with pytest.raises(InputError, match="a has 60 values, b 50; all channels need"):
        read_recording(str(path))
    assert read_recording(str(path), ["b"]).channels["b"].size == 50
    with pytest.raises(InputError, match=r"rate = 9; .* has a sampling rate of 1000"):
        read_recording(str(path), ["b"], rate=9.0)


def test_two_rates_of_a_tdms_file(tmp_path):
    nptdms = pytest.importorskip("nptdms")
    path = tmp_path / "r.tdms"
    with nptdms.TdmsWriter(str(path)) as file:
        channels = {"fast": 1e-3, "slow": 2e-3}
        file.write_segment(
            [
                nptdms.ChannelObject("rig", n, A, properties={"wf_increment": step})
                for n, step in channels.items()
            ]
        )
    with pytest.raises(InputError, match="fast has 1000 Hz, slow 500 Hz; take"):
        read_recording(str(path))
    assert read_recording(str(path), ["slow"]).rate == 500.0


def test_a_tdms_file_without_its_package(tmp_path, monkeypatch):
    monkeypatch.setattr(recording_formats, "has_package", lambda name: False)
    path = tmp_path / "r.tdms"
    path.write_bytes(b"TDSm")
    with pytest.raises(InputError, match=r"pip install 'fegear\[tdms\]'"):
        read_recording(str(path))


def read_or_refuse(path: Path) -> Recording | None:
    """A recording of finite numbers, or None where one line refuses it."""
    message = ""
    try:
        recording = read_recording(str(path))
    except InputError as error:
        message = str(error)
    if message:
        assert message.startswith(str(path))
        assert "\n" not in message
        return None
    assert all(np.isfinite(v).all() for v in recording.channels.values())
    assert 0.0 < recording.rate < np.inf
    return recording


@pytest.fixture
def content(name, tmp_path) -> bytes:
    """Content of a file that is whole."""
    path = tmp_path / f"whole-{name}"
    {**WRITERS, "r.wav": write_wav}[name](path)
    return path.read_bytes()


DAMAGED = settings(
    deadline=None,
    max_examples=60,
    derandomize=True,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)


@pytest.mark.parametrize("name", [*WRITERS, "r.wav"])
@DAMAGED
@given(data=st.data())
def test_damaged_files_are_read_or_refused(tmp_path, content, name, data):
    """Cut short, with bytes that are others, and with bytes too many."""
    path = tmp_path / name
    place = data.draw(st.integers(0, len(content) - 1))
    piece = data.draw(st.binary(max_size=8))
    kind = data.draw(st.sampled_from(["cut", "flip", "replace", "insert"]))
    if kind == "cut":
        changed = content[:place]
    elif kind == "flip":
        flipped = content[place] ^ (1 << data.draw(st.integers(0, 7)))
        changed = content[:place] + bytes([flipped]) + content[place + 1 :]
    elif kind == "replace":
        changed = content[:place] + piece + content[place + len(piece) :]
    else:
        changed = content[:place] + piece + content[place:]
    path.write_bytes(changed)
    read_or_refuse(path)


def test_no_bit_of_a_mat_file_ends_the_program(tmp_path):
    """SciPy looks types up out of bounds, unless they are checked first."""
    path, start = tmp_path / "r.mat", 128
    savemat(path, {"run": {"a": A[:5], "t": TIME[:5]}, "text": "rig", "fs": 3.0})
    content = path.read_bytes()
    for place in range(start, len(content)):
        for bit in {3, place % 8}:
            flipped = bytes([content[place] ^ (1 << bit)])
            path.write_bytes(content[:place] + flipped + content[place + 1 :])
            read_or_refuse(path)


@pytest.mark.parametrize("name", ["r.mat", "r.h5", "r.tdms", "r.wav"])
def test_files_that_end_early_are_refused(tmp_path, content, name):
    path = tmp_path / name
    for part in (0.3, 0.6, 0.95):
        path.write_bytes(content[: int(part * len(content))])
        assert read_or_refuse(path) is None


@pytest.mark.parametrize("ending", recording_formats.READERS)
def test_other_files_are_refused(tmp_path, ending):
    """Also without the package that would read them."""
    path = tmp_path / f"r{ending}"
    for content in (b"", b"\0" * 400, bytes(range(256)) * 4, b"RIFF" + b"\xff" * 90):
        path.write_bytes(content)
        assert read_or_refuse(path) is None


def test_not_a_number_in_a_wav_file(tmp_path):
    stream = io.BytesIO()
    wavfile.write(stream, 1000, BAD.astype("float32"))
    path = tmp_path / "r.wav"
    path.write_bytes(stream.getvalue())
    with pytest.raises(InputError, match="channel1 has nan in sample 8"):
        read_recording(str(path))
