"""Progress in a pipe or file: a line a minute, by a clock of the test."""

from __future__ import annotations

import io
import queue
import threading

import pytest

from fegear.cli.progress import INTERVAL_S, progress_bar, progress_lines

PATIENCE_S = 30.0  # a thread that does not answer fails the test


class Clock:
    """A clock whose minutes pass when the test says so."""

    def __init__(self) -> None:
        self.turns: queue.Queue[bool] = queue.Queue()
        self.lines: queue.Queue[str] = queue.Queue()

    def wait(self, seconds: float) -> bool:
        assert seconds == INTERVAL_S
        return self.turns.get(timeout=PATIENCE_S)

    def next_line(self) -> str:
        self.turns.put(False)
        return self.lines.get(timeout=PATIENCE_S)

    def end(self) -> None:
        self.turns.put(True)


def test_a_line_a_minute_however_seldom_work_reports():
    clock = Clock()
    with progress_lines(clock.lines.put, clock.wait) as report:
        assert clock.next_line() == "1 min: preparation"
        report("sweep", 3, 42)
        report("sweep", 4, 42)
        assert clock.next_line() == "2 min: sweep, 4 of 42"
        assert clock.next_line() == "3 min: sweep, 4 of 42"
        report("results", 0, 1)
        assert clock.next_line() == "4 min: results"
        clock.end()
    assert clock.lines.empty()


def test_no_thread_stays_after_an_error():
    before = threading.active_count()
    with pytest.raises(KeyboardInterrupt), progress_lines(print):
        raise KeyboardInterrupt
    assert threading.active_count() == before


@pytest.mark.parametrize("enabled", [True, False])
def test_a_short_command_writes_nothing_into_a_pipe(enabled, monkeypatch):
    stream = io.StringIO()
    monkeypatch.setattr("sys.stderr", stream)
    with progress_bar(enabled) as report:
        report("sweep", 1, 2)
    assert stream.getvalue() == ""


def test_lines_of_a_pipe_are_on_the_error_stream(monkeypatch, capsys):
    clock = Clock()

    def lines(write):
        return progress_lines(lambda line: clock.lines.put(line) or write(line), wait)

    def wait(seconds: float) -> bool:
        return clock.wait(seconds)

    monkeypatch.setattr("fegear.cli.progress.progress_lines", lines)
    with progress_bar(enabled=True) as report:
        report("branches", 5, 9)
        assert clock.next_line() == "1 min: branches, 5 of 9"
        clock.end()
    captured = capsys.readouterr()
    assert captured.err == "fegear: 1 min: branches, 5 of 9\n"
    assert captured.out == ""
