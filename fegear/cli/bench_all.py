"""fegear bench all: every benchmark on one page."""

from __future__ import annotations

import shlex
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from fegear.cli.bench_outcome import Outcome, outputs_of, write_outcome
from fegear.cli.options import progress_bar, require_outputs
from fegear.cli.screen import print_json, say
from fegear.output import strict_json

if TYPE_CHECKING:
    from fegear.statics import Progress

PAIR, TRAIN = "liu-pair", "liu-idler"
TORQUE = 100.0  # N m, on the driving gear
NAMES = ("stiffness", "lumped", "dynamics")


def run_all(output: Path, as_json: bool) -> None:
    """Measure one after the other; after Ctrl-C a page of what was finished."""
    from fegear.output import make_directory, write_text
    from validation.bench_page import write_page

    make_directory(output)
    outputs = [path for name in NAMES for path in outputs_of(name, output)]
    require_outputs([*outputs, output / "index.html", output / "bench.json"])
    done: list[Outcome] = []
    with progress_bar(enabled=not as_json) as report:
        for name, measure in _benchmarks():
            done.append(measure(_named(name, report)))
            if done[-1].interrupted:
                break
    measured = [outcome for outcome in done if outcome.points]
    if not measured:
        raise KeyboardInterrupt
    for outcome in measured:
        write_outcome(outcome, output)
    values = {outcome.name: outcome.values for outcome in measured}
    write_text(output / "bench.json", strict_json(values))
    command = shlex.join(["fegear", "bench", "all", "-o", str(output)])
    page = write_page(measured, output, command)
    if as_json:
        print_json(values)
    else:
        say(f"wrote {page}")
    if done[-1].interrupted:
        raise KeyboardInterrupt


def _benchmarks() -> list[tuple[str, Callable[[Progress], Outcome]]]:
    from fegear.cli.bench_dynamics import measure_dynamics
    from fegear.cli.bench_lumped import measure_lumped
    from fegear.cli.bench_stiffness import measure_stiffness
    from fegear.gearset import load_gear_set

    pair, train = load_gear_set(PAIR), load_gear_set(TRAIN)
    measures = (
        partial(measure_stiffness, pair, TORQUE),
        partial(measure_lumped, train, TORQUE, None),
        partial(measure_dynamics, pair, TORQUE),
    )
    return list(zip(NAMES, measures, strict=True))


def _named(name: str, report: Progress) -> Progress:
    return lambda what, done, total: report(f"{name}: {what}", done, total)
