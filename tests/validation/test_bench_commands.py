"""The benchmark of whole commands: ratios, records, limits."""

from __future__ import annotations

import math

import pytest

from fegear.files.errors import InputError
from validation.commands.bench import bench_commands
from validation.commands.bench import benchmark as bench
from validation.commands.bench.bench_commands import (
    COLD,
    COMMANDS,
    WARM,
    CommandRunner,
    Sizes,
    Usage,
)

SIZES = Sizes(("show", "stiffness"), ("stiffness",), rounds=3)


def no_progress(stage: str, done: int, total: int) -> None: ...


def measured(monkeypatch, seconds, megabytes=300.0):
    """A benchmark in which every command takes so much, every job 2 s and 100 MB."""
    monkeypatch.setattr(
        CommandRunner, "command", lambda *_: Usage(seconds, megabytes), raising=True
    )
    monkeypatch.setattr(CommandRunner, "job", lambda *_: Usage(2.0, 100.0))
    return bench_commands.measure(no_progress, SIZES)


def test_ratios_are_those_to_the_job_beside(monkeypatch):
    points = measured(monkeypatch, 5.0).tables[bench.POINTS]
    assert [(p["state"], p["command"]) for p in points] == [
        (COLD, "stiffness"),
        (WARM, "show"),
        (WARM, "stiffness"),
    ]
    for point in points:
        assert point["processor_ratio"] == pytest.approx(2.5)
        assert point["memory_ratio"] == pytest.approx(3.0)


@pytest.mark.parametrize(("factor", "fails"), [(1.4, False), (1.6, True)])
@pytest.mark.parametrize("quantity", ["time", "memory"])
def test_more_than_is_recorded_fails(monkeypatch, factor, fails, quantity):
    recorded = {(c, s): (2.5, 3.0) for c in COMMANDS for s in (COLD, WARM)}
    monkeypatch.setattr(bench_commands, "_recorded_ratios", lambda: recorded)
    seconds, megabytes = (5.0 * factor, 300.0), (5.0, 300.0 * factor)
    cost = seconds if quantity == "time" else megabytes
    failures = measured(monkeypatch, *cost).failures
    assert len(failures) == (3 if fails else 0)
    for line in failures:
        assert f"{factor:.2f} times what is recorded" in line


def test_what_is_beyond_its_limit_by_chance_is_measured_again(monkeypatch):
    """The middle one of up to five rounds counts, the lower one of two."""
    recorded = {(c, s): (2.5, 3.0) for c in COMMANDS for s in (COLD, WARM)}
    monkeypatch.setattr(bench_commands, "_recorded_ratios", lambda: recorded)
    usages = iter([5.0, 9.0, 5.0, 7.0])  # the first one fills the caches
    monkeypatch.setattr(CommandRunner, "command", lambda *_: Usage(next(usages), 300.0))
    monkeypatch.setattr(CommandRunner, "job", lambda *_: Usage(2.0, 100.0))
    sizes = Sizes(("show",), (), rounds=1)
    result = bench_commands.measure(no_progress, sizes)
    assert result.tables[bench.POINTS][0]["processor_ratio"] == pytest.approx(2.5)
    assert not result.failures
    assert next(usages) == 7.0  # rounds end as soon as the middle one is within


def test_nothing_fails_that_is_not_recorded(monkeypatch):
    monkeypatch.setattr(bench_commands, "_recorded_ratios", dict)
    result = measured(monkeypatch, 1e6)
    assert not result.failures
    assert math.isnan(result.tables[bench.POINTS][0]["recorded_memory_ratio"])


def test_all_commands_are_recorded():
    full = bench_commands.FULL
    expected = {(command, COLD) for command in full.cold}
    expected |= {(command, WARM) for command in COMMANDS}
    assert set(bench_commands._recorded_ratios()) == expected
    quick = bench_commands.QUICK
    assert 2 * len(quick.warm) == len(full.warm) == 14
    assert set(quick.cold) < set(full.cold)


def test_a_process_is_measured_and_its_failure_told(tmp_path):
    runner = CommandRunner(tmp_path)
    usage = runner.command("sets", COLD)
    assert 0.05 < usage.processor < 60.0
    assert 10.0 < usage.memory < 500.0
    with pytest.raises(InputError, match=r"show nothing ended with exit code 2: .*set"):
        runner.command("show nothing", WARM)
