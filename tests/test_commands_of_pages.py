"""Every command that a page shows runs, one after the other in one folder.

Files of the reader are those of GIVEN; what takes minutes is made shorter by SHORTER,
and benchmarks, which have tests of their own, answer at once. Commands
that are the same when made shorter run once.
"""

from __future__ import annotations

import re
import shlex
import shutil
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from page_commands import GUIDES, ROOT, blocks_of, commands_of, files_of, page_text
from quick_benchmarks import answer_at_once
from rexs_files import RexsWriter, as_xml

from fegear.cli import run
from fegear.gearset import load_gear_set

LEFT_OUT = {"docs/gallery.md": "docs/make_gallery.py runs its commands and keeps them"}
PAGES = [
    page
    for page in ("README.md", *GUIDES)
    if page not in LEFT_OUT and commands_of(page)
]

# Part of a command -> part that is run instead, by the reason.
FEWER_SPEEDS = {
    "--speeds 2000:3000:100": "--speeds 2000",
    "--speeds 800:4200:20": "--speeds 2000:2200:100",
    "--speeds 800:4200:50": "--speeds 2000:2200:200",
    "--speeds 1200:3400:40": "--speeds 2000:2200:100",
    "--speeds 1500:8000:50": "--speeds 3000:3200:100",
    "--speeds 500:700:50": "--speeds 600 --resolution coarse",
    "--rpm 500:3000:50": "--rpm 1000:1100:50",
    "--rpm 1000:4500:100": "--rpm 2400:2500:100",
    "--rpm 1000:6000:500": "--rpm 5000:5500:500",
    "--max-rpm 4500 --points 46": "--max-rpm 4500 --points 3 --modes 4",
    "--max-rpm 12000 --points 121": "--max-rpm 12000 --points 3 --resolution coarse",
    "--speeds 1000:4000:50 --designs 30": "--speeds 2400:2800:200 --designs 4",
    "sweep liu-idler -o s.csv": (
        "sweep liu-idler --resolution coarse --speeds 2000 -o s.csv"
    ),
    "sweep my-pair.toml --plot": "sweep my-pair.toml --speeds 900:1000:100 --plot",
    "sweep my-pair.toml --translations": (
        "sweep my-pair.toml --speeds 900:1000:100 --translations"
    ),
    "sweep ring.toml": "sweep ring.toml --speeds 900:1000:100",
    "sweep planetary-24-36-96 --translations -o": (
        "sweep planetary-24-36-96 --resolution coarse --speeds 900 --translations -o"
    ),
    "sweep planetary-24-36-96 --set": (
        "sweep planetary-24-36-96 --resolution coarse --speeds 900 --set"
    ),
    "dynamics liu-idler --torque 100 --model-1": (
        "dynamics liu-idler --torque 100 --speeds 2000:2200:100 --model-1"
    ),
}
FEWER_POINTS = {
    "mesh_frequency_Hz=900:1700:161": "mesh_frequency_Hz=900:1000:3",
    "mesh_frequency_Hz=1200:1700:251": "mesh_frequency_Hz=1200:1300:3",
    "mesh_frequency_Hz=1700:1100:121": "mesh_frequency_Hz=1700:1600:3",
    "stiffness_variation=0.1:0.6:51": "stiffness_variation=0.1:0.2:3",
    "mesh.2.phase=0:1:41": "mesh.2.phase=0:1:3",
    "clearance_um=0:60:13": "clearance_um=0:60:3",
    "magnitude_um=0:12:25": "magnitude_um=0:12:3",
    "friction=0:0.2:41 --speeds 500:7000:10": "friction=0:0.2:3 --speeds 500:7000:500",
    "friction=0:0.2:21 --speeds 4000:8000:25": (
        "friction=0:0.2:3 --speeds 4000:8000:500"
    ),
    "--speeds 2000:6900:10": "--speeds 2000:6900:700",
    "pitch_error=0:5:11": "pitch_error=0:5:3",
    "crack=0:2:9": "crack=0:2:3",
    "seed=1:20:20": "seed=1:2:2",
    "--torque 60:140:20": "--torque 60:140:80",
    "--torque 20:200:20": "--torque 20:200:90",
    "--compromises 9": "--compromises 3",
    "--speeds 700:4500": "--speeds 2000:2040",
    "--speeds 2000:3300 ": "--speeds 2600:2620 ",
    "delta=0.5:0.75": "delta=0.55:0.6 --starts 2 --runs 5",
    "--grid 400": "--grid 40",
    "--grid 300": "--grid 40",
    "basin roots-scaled --plot": "basin roots-scaled --grid 40 --plot",
    "--starts 2000": "--starts 200",
}
COARSER = {
    "--set gear.3.helix_angle_deg=16.2 --set gear.4.helix_angle_deg=16.2": "",
    "--resolution coarse --positions 8 --starts 2": (
        "--resolution coarse --positions 8 --starts 1"
    ),
    "render planetary-24-36-96": "render planetary-24-36-96 --resolution coarse",
    "mesh.2.tip_relief.magnitude_um=0:14": "mesh.2.tip_relief.magnitude_um=0:1",
    "motion liu-idler": "motion liu-idler --resolution coarse",
    "-o faulty.csv": "--resolution coarse -o faulty.csv",
    "--torque 20 --contact": "--torque 20 --positions 8 --resolution coarse --contact",
    "shafts helical-machine": "shafts helical-machine --resolution coarse",
    "relief helical-machine": (
        "relief helical-machine --resolution coarse --positions 8 --starts 1"
    ),
    "sharing planetary-24-36-96": (
        "sharing planetary-24-36-96 --model 1 --resolution coarse"
    ),
    "modes planetary-24-36-96": "modes planetary-24-36-96 --resolution coarse",
    "identify liu-idler": "identify liu-pair --resolution coarse",
    "identify my-pair.toml": "identify my-pair.toml --resolution coarse",
    "relief liu-pair": "relief liu-pair --resolution coarse --positions 16 --starts 2",
    "tolerances liu-pair": "tolerances liu-pair --resolution coarse --samples 20",
    "tolerances best.toml": "tolerances best.toml --resolution coarse --samples 20",
    "wear liu-pair": "wear liu-pair --resolution coarse --steps 2",
}
SHORTER_TIME = {
    "--seconds 200": "--seconds 20",
    "--seconds 3600": "--seconds 20",
}
FEWER_FRAMES = {
    "--turns 1 --frames 160": "--turns 1 --frames 4",
    "-o cycle.mp4": "--frames 4 -o cycle.mp4",
    "-o motion.gif": "--frames 4 -o motion.gif",
}
ONE_CASE = {
    "fegear warmup": "fegear warmup --only statics",
    "validate --all": "validate quick-case.toml",
    "validate idler-forces friction-pair": "validate quick-case.toml",
    "validate random-sets": "validate quick-case.toml",
    "validate friction-relief": "validate quick-case.toml",
    "validate my-case.toml": "validate quick-case.toml",
    "reproduce --all": "reproduce table-2.1",
    "reproduce 3.6 table-2.2 rattle-4.4": "reproduce table-2.1",
    "bench lumped --stress": "bench lumped",
    "ablation liu-idler": "ablation liu-pair",
}
NO_SUCH_HOST = {"--scheduler tcp://host:8786": "--cluster"}
SHORTER = (
    FEWER_SPEEDS
    | FEWER_POINTS
    | COARSER
    | SHORTER_TIME
    | FEWER_FRAMES
    | ONE_CASE
    | NO_SUCH_HOST
)

CASE = """name = "quick-case"
title = "Quick case"
gear_set = "liu-pair"
torques_Nm = [100.0]
speeds_Hz = "2000:2200:100"
directions = ["up"]
fidelity = "quasistatic"
[[model]]
number = 1
[[metric]]
name = "rms_distance"
allowed = 1.0
reason = "the page is tested and not the model"
"""


def new_pair(page: str) -> str:
    return (ROOT / "fegear/files/templates/pair.toml").read_text("utf-8")


def built_in_pair(page: str) -> str:
    return (ROOT / "fegear/gearset/sets/liu-pair.toml").read_text("utf-8")


def pair_of_the_page(page: str) -> str:
    """The built-in pair with what the page's first example adds to its pinion."""
    example = blocks_of(page, "toml")[0]
    pair = built_in_pair(page)
    head = '[[gear]]\nname = "pinion"\nteeth = 38\n'
    assert example.startswith(head)
    assert pair.count(head) == 1
    return pair.replace(head, example)


def pair_with_pitch_errors(page: str) -> str:
    errors = "pitch_errors_um = [" + ", ".join(["0.0, 2.5"] * 19) + "]\n"
    return built_in_pair(page).replace("teeth = 38\n", f"teeth = 38\n{errors}")


def measured_speeds(page: str) -> str:
    """What the page's printf writes."""
    (text,) = re.findall(r"^printf '(.*)' > measured.csv$", page_text(page), re.M)
    return text.replace("\\n", "\n")


def first_example(page: str) -> str:
    return blocks_of(page, "toml")[0]


def new_gearbox(page: str) -> str:
    return (ROOT / "fegear/files/templates/gearbox.toml").read_text("utf-8")


def rexs_file(page: str) -> str:
    return as_xml(RexsWriter(load_gear_set("liu-pair")).tree())


GIVEN: dict[str, dict[str, Callable[[str], str]]] = {
    "README.md": {
        "FILE": lambda _: pair_of_the_page("docs/howto/bearings.md"),
    },
    "docs/howto/bearings.md": {"my-pair.toml": pair_of_the_page},
    "docs/howto/faulty-teeth.md": {"my-pair.toml": pair_of_the_page},
    # the page's list is of a gear of six teeth, too few for most pairs
    "docs/howto/pitch-errors.md": {"my-pair.toml": pair_with_pitch_errors},
    "docs/howto/identify-bodies.md": {"my-pair.toml": built_in_pair},
    "docs/howto/signals.md": {"my-pair.toml": new_pair},
    "docs/howto/stiffness-table.md": {"my-pair.toml": new_pair},
    "docs/howto/internal-gears.md": {"ring.toml": first_example},
    "docs/howto/rattle.md": {"measured.csv": measured_speeds},
    "docs/howto/rexs.md": {"gearbox.rexs": rexs_file},
    "docs/howto/clatter.md": {"my-gearbox.toml": new_gearbox},
}
# Commands that stand above those of the page
BEFORE = {
    "docs/howto/tables-from-other-programs.md": ["fegear stiffness liu-pair -o t.csv"],
}


def shortened(command: str) -> str:
    for part, shorter in SHORTER.items():
        command = command.replace(part, shorter)
    return command


def typed(command: str) -> int:
    """Exit code of a command."""
    return run(shlex.split(command, comments=True)[1:])


def accepted(command: str, monkeypatch: pytest.MonkeyPatch) -> int:
    """Exit code of a command that ends where the computation would begin."""
    with monkeypatch.context() as patch:
        patch.setattr("fegear.studies.running.run", lambda *_: sys.exit(0))
        return typed(command)


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES)
def test_commands_of_a_page_run(page, tmp_path, monkeypatch, capsys):
    """Only this finds a command of a page that does not run as it is written."""
    monkeypatch.chdir(tmp_path)
    answer_at_once(monkeypatch)
    shutil.copytree(ROOT / "docs" / "examples", tmp_path / "docs" / "examples")
    (tmp_path / "quick-case.toml").write_text(CASE, "utf-8")
    texts = {name: text(page) for name, text in GIVEN.get(page, {}).items()}
    for name, text in (texts | files_of(page)).items():
        Path(name).write_text(text, "utf-8")
    done = set[str]()
    for command in (*BEFORE.get(page, ()), *commands_of(page)):
        shorter = shortened(command)
        code = accepted(command, monkeypatch) if shorter != command else 0
        if shorter == command or shorter not in done:
            code = code or typed(shorter)
        done.add(shorter)
        error = capsys.readouterr().err
        assert code == 0, f"{command}: {error}"
        assert "Traceback" not in error


def test_example_of_a_tutorial_is_the_file_that_it_writes():
    page, name = "docs/tutorials/two-stage-gearbox.md", "two-stage-gearbox.toml"
    example = (ROOT / "docs" / "examples" / name).read_text("utf-8")
    assert files_of(page)[name] == example


def test_every_shorter_command_is_on_a_page():
    commands = [command for page in PAGES for command in commands_of(page)]
    for part in SHORTER:
        assert any(part in command for command in commands), part


def test_pages_that_are_named_exist():
    assert GIVEN.keys() | BEFORE.keys() <= set(PAGES)
    for page in LEFT_OUT:
        assert page_text(page)
