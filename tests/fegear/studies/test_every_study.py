"""What holds for all studies, those of a file that a reader writes among them."""

from __future__ import annotations

import inspect
import json
import os
import shutil
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import MISSING, dataclass, fields, replace
from functools import partial
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
import shown_results
from case_files import case_text
from cli_commands import printed
from declared_columns import declared, require_declared
from drawn_figures import axis_labels, require_readable, saved_figures
from interactive_checks import check_figure
from quick_benchmarks import answer_at_once
from recorded_signals import recording_text
from short_uses import input_texts, written_use
from shown_results import what_is_shown
from slow_tests import in_tier_of
from typer.testing import CliRunner
from written_tables import require_same

import fegear
from fegear.cli import app, run
from fegear.cli import study_group as groups
from fegear.elasticity.material import PlaneMaterial
from fegear.elasticity.sector import CyclicSector
from fegear.figures.interactive import to_plotly
from fegear.files.codes import require_warning_code, with_code
from fegear.files.errors import InputError
from fegear.files.output import strict_json
from fegear.files.store import NO_CHECKPOINT, CheckpointOptions
from fegear.files.templates import template_text
from fegear.files.toml import toml_text
from fegear.gearset.read import load_tables
from fegear.studies import load_study
from fegear.studies.page import Page, RowTable, cell
from fegear.studies.problem import Job, Task
from fegear.studies.registry import Command, commands
from fegear.studies.result import StudyResult
from fegear.studies.running import Job as RunningJob
from fegear.studies.running import run as run_study
from fegear.studies.settings import SettingsGroup, exposed_fields, group_of, setting
from fegear.studies.study import Study
from fegear.studies.table import Table
from lumped.common.csv_text import parse_csv
from lumped.common.options import Range
from lumped.figures.drawing import panels
from lumped.train.space_modes import MOTIONS


@dataclass(frozen=True, kw_only=True)
class Squares(Study, command="squares", example="squares --count 3"):
    """Squares of numbers.

    One after the other, each of which is kept.
    """

    resumes = True

    count: int = setting(5, "How many squares.", Range(1, 100))
    power: float = setting(2.0, "Exponent in place of 2, a ratio.", Range(0.0, 4.0))
    loud: bool = setting(False, "Say so.")

    def tasks(self) -> Iterator[Task]:
        for sign in (1, -1):
            yield Task(str(sign), lambda job, sign=sign: self._squared(job, sign))

    def _squared(self, job: Job, sign: int) -> list[float]:
        squares = [record["square"] for record in job.records]
        for number in range(len(squares), self.count):
            job.report(f"squares {sign}", number, self.count)
            squares.append(sign * (number + 1.0) ** self.power)
            job.add_record({"square": squares[-1]}, {"last": np.array(squares[-1:])})
        return squares

    def gather(self, results: Mapping[str, Any]) -> SquaresResult:
        return SquaresResult(self, [*results["1"], *results["-1"]])


@dataclass(frozen=True, eq=False, repr=False)
class SquaresResult(StudyResult):
    study: Squares
    squares: list[float]

    @property
    def summary(self) -> dict[str, Any]:
        warnings = [with_code("W16", "loud")] * self.study.loud
        return {"sum": sum(self.squares), "warnings": warnings}

    @property
    def table(self) -> Table:
        columns = {"number": np.arange(len(self.squares)), "square": self.squares}
        return Table.of(columns, {"count": str(self.study.count)})

    @property
    def figures(self) -> dict[str, Callable[[], Any]]:
        return {"plot": lambda: panels(1, size=(2.0, 2.0))[0]}

    def page(self) -> Page:
        yield f"{len(self.squares)} squares"
        yield RowTable([{"sum": sum(self.squares)}], {"sum": cell("sum")})


@pytest.fixture
def toy(monkeypatch):
    """The command line with the toy study."""
    squares = Command("squares", "Squares of numbers.", __name__, "Squares")
    monkeypatch.setitem(commands(), "squares", squares)
    monkeypatch.setattr(groups, "load_study", lambda command: Squares)

    def invoke(*arguments: object) -> Any:
        return CliRunner().invoke(app, ["squares", *map(str, arguments)])

    return invoke


def test_a_file_gives_command_help_table_json_picture_and_call(
    toy, tmp_path, monkeypatch
):
    table, plot = tmp_path / "s.csv", tmp_path / "s.png"
    done = toy("--count", 3, "--json", "-o", table, "--plot", plot)
    values = json.loads(done.stdout)
    assert values.keys() == {"sum", "warnings", "wall_time_s"}
    result = fegear.run(Squares(count=3))
    assert table.read_text() == result.table.csv()
    assert table.read_text().splitlines()[:3] == [
        "# count: 3",
        "number,square",
        "0,1.0",
    ]
    monkeypatch.setattr("fegear.studies.table.frame", lambda columns: columns)
    assert result.table.to_frame()["square"] == (1, 4, 9, -1, -4, -9)
    assert plot.read_bytes().startswith(b"\x89PNG")
    text = toy("--help").stdout
    for phrase in ("Squares of numbers.", "--power", "[default: 2.0]", "--resume"):
        assert phrase in text
    assert "fegear squares --count 3" in text
    assert "6 squares" in toy("--count", 3).stdout


def test_a_warning_has_a_code_on_the_screen_and_in_json(toy, monkeypatch):
    done = toy("--loud", "--json")
    assert done.stderr == "warning: loud [W16]\n"
    assert json.loads(done.stdout)["warnings"] == ["loud [W16]"]
    monkeypatch.setitem(globals(), "with_code", lambda code, text: text)
    assert "must end with a code" in str(toy("--loud").exception)


def test_ranges_hold_on_the_command_line_and_in_python(toy):
    error = toy("--count", 0).exception
    assert isinstance(error, InputError)
    assert str(error) == "--count = 0; must be 1 to 100"
    with pytest.raises(InputError, match=r"^count = 0; must be 1 to 100$"):
        Squares(count=0)
    with pytest.raises(InputError, match=r"^count = 2\.5; must be a whole number"):
        Squares(count=2.5)


@pytest.mark.parametrize("stop", [3, 4, 7])  # with something kept
def test_resumed_is_whole_to_the_byte(tmp_path, stop):
    reports, path = [], tmp_path / "s.csv.partial"

    def progress(*report: object) -> None:
        reports.append(report)
        if len(reports) == stop:
            raise KeyboardInterrupt

    study = Squares(count=4)
    with pytest.raises(KeyboardInterrupt):
        run_study(study, CheckpointOptions(checkpoint=path), progress, workers=1)
    assert path.exists()
    later = run_study(study, CheckpointOptions(checkpoint=path, resume=True))
    assert later.table.csv() == run_study(study).table.csv()
    assert not path.exists()
    reports.clear()
    with pytest.raises(KeyboardInterrupt):
        run_study(study, CheckpointOptions(checkpoint=path), progress, workers=1)
    with pytest.raises(InputError, match="was begun with count = '4', now '5'"):
        run_study(Squares(), CheckpointOptions(checkpoint=path, resume=True))


def test_records_of_another_format_are_refused(tmp_path, monkeypatch):
    path = tmp_path / "s.csv.partial"
    with monkeypatch.context() as earlier:
        earlier.setattr("fegear.studies.running.RECORDS_FORMAT", "1")
        interrupted(Squares(), 4, CheckpointOptions(checkpoint=path))
    with pytest.raises(InputError, match="was begun with format of records = '1'"):
        run_study(Squares(), CheckpointOptions(checkpoint=path, resume=True))


@dataclass(frozen=True, kw_only=True)
class Powers(Squares, command="powers", example="powers"):
    """Powers by a task of parts."""

    unit = "power"

    def tasks(self) -> Iterator[Task]:
        yield Task("powers", self._in_parts)

    def gather(self, results: Mapping[str, Any]) -> SquaresResult:
        return results["powers"]

    def _in_parts(self, job: Job) -> SquaresResult:
        numbers = range(1, self.count + 1)
        parts = {str(n): partial(power_of, n, self.power) for n in numbers}
        powers = job.compute("powers", parts)
        more = job.compute("more", {"last": partial(power_of, 0, self.power)})
        columns = [*(powers[name] for name in parts), more["last"]]
        return SquaresResult(self, [float(column["power"][0]) for column in columns])


CALLS = list[int]()


def power_of(number: int, power: float) -> dict[str, Any]:
    CALLS.append(number)
    return {"power": np.array([number**power])}


def test_parts_that_are_finished_are_not_computed_again(tmp_path):
    study, checkpoint = Powers(), tmp_path / "p.csv.partial"
    messages = list[str]()

    def progress(label: str, done: int, total: int) -> None:
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_study(study, CheckpointOptions(checkpoint=checkpoint), progress, workers=1)
    CALLS.clear()
    options = CheckpointOptions(checkpoint=checkpoint, resume=True)
    later = run_study(study, options, workers=1, notify=messages.append)
    (line,) = messages
    finished = int(line.removeprefix(f"{checkpoint}: ").partition(" powers are")[0])
    assert 2 <= finished <= 5
    expected = [1, 2, 3, 4, 5, 0]
    assert expected[finished:] == CALLS
    assert later.squares == run_study(study).squares == [1, 4, 9, 16, 25, 0]


@pytest.mark.parametrize("error", [OSError(28, "No space left"), KeyboardInterrupt()])
@pytest.mark.parametrize("fails", ["s.csv", "s.png"])
def test_a_file_that_fails_leaves_what_was_computed(
    toy, tmp_path, monkeypatch, fails, error
):
    """A full disk, or Ctrl-C in that second: the table is there, and --resume works."""
    table, plot = tmp_path / "s.csv", tmp_path / "s.png"
    checkpoint, computed = tmp_path / "s.csv.partial", list[int]()
    os_replace = os.replace

    def replaced(source: Any, target: Any) -> None:
        if Path(target).name == fails:
            raise error
        os_replace(source, target)

    options = ["--count", 3, "-o", table, "--plot", plot]
    with monkeypatch.context() as patched:
        patched.setattr(os, "replace", replaced)
        attempt = toy(*options)
    assert attempt.exit_code != 0
    assert f"{checkpoint} is stored; --resume continues from it" in attempt.stderr
    assert table.exists() == (fails == "s.png")
    assert not plot.exists()
    assert checkpoint.exists()
    monkeypatch.setattr(RunningJob, "add_record", lambda *args: computed.append(1))
    resumed = toy(*options, "--resume")
    assert resumed.exit_code == 0, resumed.output
    assert not computed
    assert table.read_text() == fegear.run(Squares(count=3)).table.csv()
    assert plot.exists()
    assert not checkpoint.exists()


def test_what_a_caller_delivers_is_safe(tmp_path):
    """`run` of Python without files removes the checkpoint, as nothing is to come."""
    checkpoint, existence = tmp_path / "s.partial", list[bool]()
    options = CheckpointOptions(checkpoint=checkpoint, resume=True)
    run_study(Squares(), options)
    assert not checkpoint.exists()

    def fail(result: Any) -> None:
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        run_study(Squares(), options, deliver=fail)
    assert checkpoint.exists()
    run_study(
        Squares(), options, deliver=lambda _: existence.append(checkpoint.exists())
    )
    assert existence == [True]
    assert not checkpoint.exists()


# of a run, or a difference of what agrees but for round-off
RUN_DEPENDENT_KEYS = {
    *("seconds", "peak_memory_MB", "interpolation_error", "reused"),
    *("compiled_signatures", "functions", "signatures"),  # of a cache that others use
}
WITHOUT_TABLE = {
    *("new", "show", "mesh", "relief", "render", "rattle gears", "bench all")
}


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    answer_at_once(monkeypatch)
    monkeypatch.chdir(tmp_path)


def example_study(command: str, longer: bool = False) -> Study:
    """The short use of a command as a study, with numbers of all digits."""
    return with_all_digits(study_of(written_use(command, Path(), longer)))


def study_of(argv: Sequence[str]) -> Study:
    """The study that words of a command ask for, which is not run."""
    running = patch("fegear.studies.running.run", side_effect=Asked)
    with running as mock, pytest.raises(Asked):
        run(["--debug", *argv])
    return mock.call_args.args[0]


class Asked(Exception):
    """Raised in place of a run."""


def with_all_digits(settings: Any) -> Any:
    """Settings whose numbers that are not the default have no short decimal."""
    changes = {}
    for member in exposed_fields(group_of(settings)):
        value = getattr(settings, member.name)
        if member.group is not None:
            changes[member.name] = value and with_all_digits(value)
        elif value != member.default and isinstance(value, float):
            changes[member.name] = value * (1.0 + 1e-4 / 3.0)
    return replace(settings, **changes)


@pytest.mark.parametrize("command", commands())
def test_the_list_says_what_the_study_says(command):
    study = load_study(command)
    assert study.command == command
    assert inspect.getdoc(study).splitlines()[0] == commands()[command].title
    assert getattr(fegear, commands()[command].study) is study


@pytest.mark.parametrize("command", commands())
def test_words_of_a_study_ask_for_it(command):
    """From values to words and back, floats to the last bit."""
    example = example_study(command)
    files = ["-o", f"t{example.endings[0]}"] if example.must_write else []
    again = study_of([*example.argv, *files])
    assert again == example
    assert again.argv == example.argv


@pytest.mark.parametrize("command", list(map(in_tier_of, commands())))
def test_command_call_and_saved_result_show_the_same(command, tmp_path):
    """All that one run of a study is good for, as examples take seconds to run."""
    study = example_study(command, longer=True)
    path = tmp_path / f"t{study.endings[0]}"
    files = ["-o", path] if study.output_names else []
    values = json.loads(printed(*study.argv, "--json", *files))
    result = fegear.run(study)
    require_shown_where_nothing_else_is_left(result, tmp_path)
    summary = json.loads(strict_json(result.summary))
    assert values.pop("wall_time_s") >= 0.0
    assert strip_run_dependent(values) == strip_run_dependent(summary)
    for warning in summary.get("warnings", ()):
        require_warning_code(warning)
    html, picture = result._repr_html_(), result._repr_png_()
    assert html.count("<table>") == sum(type(part) is not str for part in result.page())
    assert ('src="data:image/png;base64,' in html) == bool(result.figures)
    assert picture.startswith(b"\x89PNG") if result.figures else picture is None
    for draw in result.figures.values():
        with suppress(InputError):  # of a figure that these settings do not give
            figure = draw()
            require_readable(figure)
            check_figure(figure, to_plotly(figure))
    if files:
        stored = contents(path)
        assert stored
        assert content(result, path) == stored
    if command in WITHOUT_TABLE:
        with pytest.raises(InputError, match=f"^{command} has no table$"):
            result.to_csv(path)
        return
    if files and ".csv" in study.endings and not study.folder:
        assert path.read_text("utf-8") == result.table.csv()
    assert {len(row) for row in result.table.rows()} == {len(result.table.names)}
    require_columns_of_example(result)
    if ".xlsx" in study.endings and not study.folder:
        for ending in (".mat", ".nc", ".xlsx"):  # for other programs
            other = tmp_path / f"other{ending}"
            result.write(other)
            require_same(result, other)


# declared columns that tables of the examples do not have
IN_SPACE = {  # signals of machines that move in space
    *(f"{{gear}}_bearing{{n}}_{axis}_N" for axis in "xyz"),
    *(f"{{gear}}_bearing{{n}}_{axis}_m_per_s2" for axis in "xyz"),
    *(f"housing_node{{n}}_{axis}_m_per_s2" for axis in "xyz"),
}
ON_RING = {"ring_sensor_force_N", "ring_sensor_acceleration_m_per_s2"}
ELSEWHERE = IN_SPACE | ON_RING  # of machines in space and of planetary sets
OF_CHANNELS = {"{parameter}", *ELSEWHERE}  # of recordings
INDICATORS = {  # of recordings
    *("source", "gear", "signal", "unit", "mesh_amplitude", "sideband_amplitude"),
    *("sideband_order", "residual_rms", "residual_peak", "residual_kurtosis"),
    *("residual_peak_angle_deg", "residual_tooth_rms", "tooth"),
    *("fm4", "m6a", "na4", "energy_ratio"),
}
INDICATORS_ON_RING = [
    f"{signal}_{indicator}"
    for signal, unit in (("force", "N"), ("acceleration", "m_per_s2"))
    for indicator in (
        *(f"{name}_{unit}" for name in ("rms", "residual_rms", "residual_peak")),
        *("residual_kurtosis", "tooth"),
    )
]
NOT_IN_EXAMPLE = {
    "branches": {"{parameter}"},  # in place of the speed
    "faults": {  # other faults
        *("crack_mm", "spall_width_share", "broken_tip_mm", "wear_um"),
        "eccentricity_um",
        *(f"ring_sensor_{name}" for name in INDICATORS_ON_RING),
    },
    "map": {"lyapunov_per_period"},  # where exponents are asked for
    "modes": {  # of planetary sets, and of gears that move in space
        *("family", "multiplicity", "whirl", "tilt_energy_fraction"),
        *(f"{motion}_motion_fraction" for motion in MOTIONS),
    },
    "motion": {  # without friction, and of gears that move in space
        *("mesh{n}_friction_power_W", "mesh{n}_moment_Nm"),
        *("mesh{n}_spring{n}_force_N", "mesh{n}_spring{n}_state"),
    },
    "rattle bifurcation": {"curve", "bifurcation"},  # over two parameters
    "sharing": {  # of helical gears
        *("sun_axial_force_N", "ring_axial_force_N", "tilting_moment_Nm"),
    },
    "signals": INDICATORS | ELSEWHERE,
    "signals: average": OF_CHANNELS
    | {"gear", "residual_{parameter}", *(f"residual_{name}" for name in ELSEWHERE)},
    "signals: spectrum": OF_CHANNELS | {"gear"},
    "signals: orders": OF_CHANNELS,
    "stiffness": {"axial_force_N", "load_center_mm"},  # over the face width
    "reproduce": {"number", "title", "missing"},  # of a list
    "wear": {"place_m"},  # over the face width
    "tolerances: samples_table": {  # over the face width
        *(f"{gear}_helix_slope_deviation_m" for gear in ("driver", "driven")),
        *(f"{gear}_helix_form_deviation_m" for gear in ("driver", "driven")),
        *("axes_in_plane_deviation_m", "axes_out_of_plane_deviation_m"),
        "load_distribution_factor",
    },
}
CHOSEN_PARAMETERS = {
    "faults": {"mesh.2.phase"},
    "map": {"gear.a.mass_kg"},
    "stability": {"friction"},
    "bifurcations": {"gear.a.inertia_kg_m2"},
    "rattle bifurcation": {"eccentricity_rad"},
}


def require_columns_of_example(result: Any) -> None:
    """Columns are declared; benchmarks are stubs, see `test_columns`."""
    command = result.study.command
    if command.startswith("bench "):
        return
    missing = NOT_IN_EXAMPLE.get(command, ())
    chosen = CHOSEN_PARAMETERS.get(command, ())
    require_declared(command, result.table.names, "table", missing, chosen)
    for name, table in result.more_tables.items():
        if name == "labels":  # the same as the first
            require_declared(command, table.names, name, missing, chosen)
        else:
            missing_here = NOT_IN_EXAMPLE.get(f"{command}: {name}", ())
            require_declared(command, table.names, name, missing_here)
    for path in Path(getattr(result.study, "directory", "none")).glob("tables/*.csv"):
        text = path.read_text("utf-8")  # empty without rows
        if text and declared(command, path.stem):  # no curves of a picture
            names = parse_csv(text, path.name).names
            require_declared(command, names, path.stem)


def settings_that_read(group: SettingsGroup) -> Iterator[str]:
    """Names of settings of a study that name a file to read."""
    for member in exposed_fields(group):
        if member.group is not None:
            yield from settings_that_read(member.group)
        elif member.declared.reads:
            yield member.name


def written_options(study: Study) -> Iterator[tuple[list[str], str]]:
    """Words that name an output, each that a study can write, and the file."""
    if study.folder:
        yield from ((["-o", "."], name) for name in study.files)
        return
    endings = dict.fromkeys(study.more_tables, ".csv")
    endings |= {name: ends[0] for name, (_, ends) in study.more_files.items()}
    endings |= dict.fromkeys(study.pictures, ".png")
    for name, ending in endings.items():
        file = f"taken{ending}"
        if name not in dict(study.unused_options({name: file})):
            yield [f"--{name.replace('_', '-')}", file], file
    if study.output_names:
        yield ["-o", f"taken{study.endings[0]}"], f"taken{study.endings[0]}"
    elif study.command == "render":  # files that are settings
        yield [], study.file
    elif study.command == "validate":
        yield [], f"{study.directory}/report.md"


def files_of_example(command: str, name: str) -> Iterator[tuple[list[str], bytes]]:
    """Words of an example that reads the file `name`, for each setting that reads,
    and content of the file."""
    study: Any = example_study(command)
    for setting_name in settings_that_read(group_of(study)):
        if "machine" in vars(study):
            machine = type(study.machine)(name=name)
            text = template_text("machine")
            yield replace(study, machine=machine).argv, text.encode()
        elif setting_name == "name":
            yield from _gear_sets_of_example(study, name)
        elif setting_name in ("table", "time_history"):
            option = f"--{setting_name.replace('_', '-')}"
            yield [*study.argv, option, name], b"position\n"
        elif setting_name == "measured":  # with noise of its own
            changed = replace(study, noise_percent=0.0, measured=name)
            yield changed.argv, recording_text().encode()
        elif setting_name == "like":
            changed = replace(study, rpm=None, tacho="tacho", like=name)
            yield changed.argv, recording_text().encode()
        else:
            value, text = READ_BY_EXAMPLE[setting_name](name)
            yield replace(study, **{setting_name: value}).argv, text.encode()


READ_BY_EXAMPLE: dict[str, Callable[[str], tuple[Any, str]]] = {
    "cases": lambda name: ((name,), case_text()),
    "file": lambda name: (name, input_texts()["falling.csv"]),
    "gearbox": lambda name: (name, template_text("gearbox")),
}


def _gear_sets_of_example(study: Any, name: str) -> Iterator[tuple[list[str], bytes]]:
    """A profile that a gear-set file names, and the gear-set file itself."""
    has_edits = "gear_set" in vars(study)
    source = study.gear_set.name if has_edits else study.name
    gear = fegear.load_gear_set(source).gears[0].geometry
    ends = 2.04e3 * gear.base_radius, 1.98e3 * gear.tip_radius
    profile = "diameter_mm,deviation_um\n{:.3f},0\n{:.3f},-5\n".format(*ends)
    key = "mesh.1.driver_profile.file"
    if "planetary" in load_tables(source, {}):  # whose file has no profiles
        edited = replace(study.gear_set, edits=(f"{key}={name}",))
        yield replace(study, gear_set=edited).argv, profile.encode()
        return
    Path("g.toml").write_text(toml_text(load_tables(source, {key: name})))
    for file, content in (("g.toml", profile.encode()), (name, b"")):
        named = replace(study.gear_set, name=file) if has_edits else file
        changed = {"gear_set" if has_edits else "name": named}
        text = content or Path("g.toml").read_bytes()
        yield replace(study, **changed).argv, text


@pytest.mark.parametrize("command", commands())
def test_no_output_replaces_a_file_that_is_read(command, capsys):
    """Given itself or named in another file."""
    study = example_study(command)
    if command == "new":  # reads other files than it writes
        return
    for options, name in written_options(study):
        others = ["-o", f"x{study.endings[0]}"] * study.must_write
        written = options if "-o" in options else [*others, *options]
        Path(name).parent.mkdir(exist_ok=True)
        for argv, content in files_of_example(command, name):
            Path(name).write_bytes(content)
            assert run([*argv, *written]) == 2, argv
            (line,) = capsys.readouterr().err.splitlines()
            assert line.startswith(f"fegear: {name}: "), argv
            assert Path(name).read_bytes() == content
            Path(name).unlink()


@pytest.mark.parametrize("link", ["relative", "symbolic", "hard"])
def test_no_path_of_a_file_that_is_read_is_written(link, tmp_path, capsys):
    gear = fegear.load_gear_set("liu-pair").gears[0].geometry
    ends = 2.04e3 * gear.base_radius, 1.98e3 * gear.tip_radius
    (tmp_path / "sub").mkdir()
    profile, other = tmp_path / "p.csv", tmp_path / "other.csv"
    profile.write_text("diameter_mm,deviation_um\n{:.3f},0\n{:.3f},-5\n".format(*ends))
    before = profile.read_bytes()
    if link == "relative":
        other = Path("sub/../p.csv")
    elif link == "symbolic":
        other.symlink_to("p.csv")
    else:
        os.link(profile, other)
    edit = f"mesh.1.driver_profile.file={profile}"
    for option in ("-o", "--spectra"):
        argv = ["sweep", "liu-pair", "--set", edit, option, str(other)]
        assert run(argv) == 2
        taken = f"fegear: {other}: is read or written already by this command\n"
        assert capsys.readouterr().err == taken
    assert profile.read_bytes() == other.read_bytes() == before


def require_shown_where_nothing_else_is_left(result: StudyResult, folder: Path) -> None:
    """A saved result shows the same in a new process, without the files it read."""
    study = result.study
    assert vars(study).keys() == {setting.name for setting in fields(study)}
    result.save(folder / "result.nc")
    alone = folder / "alone"
    alone.mkdir()
    process = subprocess.run(
        [sys.executable, Path(shown_results.__file__), folder / "result.nc"],
        cwd=alone,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
        capture_output=True,
        text=True,
    )
    assert not process.stderr
    assert json.loads(process.stdout) == what_is_shown(result)


def strip_run_dependent(values: Any) -> Any:
    """Values without those that differ from run to run, at any depth."""
    if isinstance(values, dict):
        keys = values.keys() - RUN_DEPENDENT_KEYS
        return {key: strip_run_dependent(values[key]) for key in keys}
    if isinstance(values, list):
        return [strip_run_dependent(v) for v in values]
    return values


RESUMING = [command for command in commands() if load_study(command).resumes]


class Interrupted:
    """Progress that ends a run at a call by Ctrl-C; counts calls without one."""

    def __init__(self, at: int = 0):
        self.at, self.calls = at, 0

    def __call__(self, label: str, done: int, total: int) -> None:
        self.calls += 1
        if self.calls == self.at:
            raise KeyboardInterrupt


def interrupted(
    study: Study, at: int, options: CheckpointOptions = NO_CHECKPOINT
) -> Any:
    """The result after Ctrl-C at a call of the progress, None where there is none."""
    with suppress(KeyboardInterrupt):
        return run_study(study, options, Interrupted(at), workers=1)


def content(result: Any, path: Path) -> Mapping[str, bytes]:
    """What a result writes anew: a file, or files in a directory."""
    if result.study.folder:
        shutil.rmtree(path, ignore_errors=True)
        path.mkdir()
    else:
        path.unlink(missing_ok=True)
    result.write(path)
    return contents(path)


def contents(path: Path) -> Mapping[str, bytes]:
    """Contents of a file, or of the files in a directory, by name."""
    files = path.iterdir() if path.is_dir() else [path]
    return {file.name: file.read_bytes() for file in files if file.is_file()}


@pytest.mark.slow
@pytest.mark.parametrize("command", RESUMING)
def test_an_interrupted_study_is_resumed_to_the_byte(command, tmp_path):
    """Interrupted at a third and at two thirds of its way, then resumed."""
    study, count = example_study(command, longer=True), Interrupted()
    path = tmp_path / f"t{study.endings[0]}"
    expected = content(run_study(study, progress=count, workers=1), path)
    checkpoint, stored = tmp_path / "t.partial", False
    for part in (1, 2):
        options = CheckpointOptions(checkpoint=checkpoint, resume=checkpoint.exists())
        result = interrupted(study, 1 + part * count.calls // 3, options)
        stored |= checkpoint.exists()
    assert stored or count.calls == 2  # of one part, which is whole or was not begun
    assert checkpoint.exists() or (result is not None and result.complete)
    options = CheckpointOptions(checkpoint=checkpoint, resume=checkpoint.exists())
    later = run_study(study, options)
    assert later.complete
    assert not checkpoint.exists()
    assert content(later, path) == expected


@pytest.mark.slow
@pytest.mark.parametrize("command", commands())
def test_ctrl_c_leaves_no_result_or_one_that_is_not_complete(command, tmp_path):
    study = example_study(command, longer=True)
    path = tmp_path / f"t{study.endings[0]}"
    assert interrupted(study, 1) is None
    for at in (2, 3):
        result = interrupted(study, at)
        if result is not None and result.complete:  # all was computed before
            assert content(result, path) == content(run_study(study), path)
        elif result is not None:
            assert study.partial


def ranges(group: SettingsGroup) -> Iterator[tuple[Any, Range]]:
    """Default and range of the settings of a group that have both, its groups' too."""
    for member in exposed_fields(group):
        if member.group is not None:
            yield from ranges(member.group)
        allowed = getattr(member.declared, "allowed", None)
        if allowed and member.default not in (None, (), MISSING):
            yield member.default, allowed


WITH_RANGES = [name for name in commands() if list(ranges(group_of(load_study(name))))]


@pytest.mark.parametrize("command", WITH_RANGES)
def test_defaults_are_within_their_ranges(command):
    for default, allowed in ranges(group_of(load_study(command))):
        assert default in allowed


@pytest.mark.parametrize("command", commands())
def test_defaults_of_groups_are_of_their_class(command):
    for member in exposed_fields(group_of(load_study(command))):
        if member.group is not None and member.field.default is not MISSING:
            assert isinstance(member.field.default, member.group.kind)


def test_a_name_stands_for_a_machine_without_changes(tmp_path):
    study = fegear.RattleNoise(machine="roots-scaled", starts=2, turns=2)
    assert study.machine == type(study.machine)(name="roots-scaled")
    result = fegear.run(study)
    result.to_csv("noise.csv")
    with saved_figures() as figures:
        result.draw("noise.png")
    assert (tmp_path / "noise.csv").read_text("utf-8") == result.table.csv()
    assert "part of the runs that are less loud" in axis_labels(*figures)
    with pytest.raises(InputError, match=r"^name = other; drawn are plot$"):
        result.draw("other.png", "other")
    assert repr(result).startswith(
        "NoiseResult(study=<RattleNoise>, named=<NamedMachine roots-scaled>, "
    )


def test_a_bar_moves_until_files_are_written(toy, tmp_path, monkeypatch):
    reports: list[tuple[str, bool]] = []
    table = tmp_path / "s.csv"

    @contextmanager
    def bar(enabled: bool) -> Iterator[Callable[..., None]]:
        yield lambda label, done, total: reports.append((label, table.exists()))
        reports.append(("end", table.exists()))

    monkeypatch.setattr("fegear.cli.outputs.progress_bar", bar)
    assert toy("-o", table).exit_code == 0
    assert reports[-2:] == [("results", False), ("end", True)]


BEGUN_AFTER_CTRL_C: list[str] = []


@dataclass(frozen=True, kw_only=True)
class LongParts(Study, command="long parts", example="long parts"):
    """A compliance that is computed when Ctrl-C comes."""

    def tasks(self) -> Iterator[Task]:
        begun = threading.Event()
        yield Task("compliance", partial(self._solved, begun))
        yield Task("ctrl-c", partial(self._interrupted, begun))

    def _solved(self, begun: threading.Event, job: Any) -> None:
        gear = fegear.load_gear_set("liu-pair").gears[0].geometry
        sector = CyclicSector(gear, PlaneMaterial(2e11, 0.3))
        begun.set()
        job.stop.wait()
        BEGUN_AFTER_CTRL_C.append(str(sector.mesh))

    def _interrupted(self, begun: threading.Event, job: Any) -> None:
        begun.wait()
        raise KeyboardInterrupt


def test_no_part_of_a_compliance_begins_after_ctrl_c():
    with pytest.raises(KeyboardInterrupt):
        run_study(LongParts(), workers=2)
    assert BEGUN_AFTER_CTRL_C == []
