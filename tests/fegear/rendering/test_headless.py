"""Which way to draw without a screen is tried first, whatever is installed."""

from __future__ import annotations

import os
import sys
from contextlib import contextmanager

import pytest

from fegear.files.errors import InputError
from fegear.rendering import headless

EGL, X11 = "vtkEGLRenderWindow", "vtkXOpenGLRenderWindow"
OSMESA = "vtkOSOpenGLRenderWindow"
pytestmark = pytest.mark.skipif(
    not sys.platform.startswith("linux"), reason="other systems have their windows"
)


@pytest.fixture
def machine(monkeypatch):
    """What is there, by name; every attempt is noted in its order."""
    there: set[str] = set()
    tried: list[str] = []

    def opens(name):
        tried.append(name)
        return name in there and (name != X11 or "DISPLAY" in os.environ)

    def has_osmesa():
        tried.append(OSMESA)
        return OSMESA in there

    monkeypatch.setattr(headless, "_opens", opens)
    monkeypatch.setattr(headless, "_has_osmesa", has_osmesa)
    monkeypatch.setattr(headless.shutil, "which", lambda name: None)
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv(headless.WINDOW, raising=False)
    return there, tried


@contextmanager
def same_environment():
    before = dict(os.environ)
    yield
    assert dict(os.environ) == before


@pytest.mark.parametrize(
    ("there", "screen", "chosen", "attempts"),
    [
        ({EGL, OSMESA, X11}, True, EGL, [EGL]),
        ({OSMESA, X11}, True, OSMESA, [EGL, OSMESA]),
        ({X11}, True, X11, [EGL, OSMESA, X11]),
        ({OSMESA}, False, OSMESA, [EGL, OSMESA]),
    ],
)
def test_order_of_attempts(machine, monkeypatch, there, screen, chosen, attempts):
    available, tried = machine
    available |= there
    if screen:
        monkeypatch.setenv("DISPLAY", ":7")
    with same_environment(), headless.drawing_window():
        assert os.environ[headless.WINDOW] == chosen
    assert tried == attempts


ANSWERS = """
import os, pathlib, sys, time
pathlib.Path(__file__).with_name("pid").write_text(str(os.getpid()))
os.write(int(sys.argv[2]), b"42\\n")
time.sleep(60)
"""


def stand_in(folder, script):
    """A program in place of Xvfb."""
    server = folder / "Xvfb"
    server.write_text(f"#!{sys.executable}\n{script}")
    server.chmod(0o755)
    return server


def test_a_virtual_screen_is_the_last_attempt(machine, monkeypatch, tmp_path):
    """A stand-in for Xvfb that writes its number and waits; it ends with its use."""
    server = stand_in(tmp_path, ANSWERS)
    available, tried = machine
    available.add(X11)
    monkeypatch.setattr(headless.shutil, "which", lambda name: str(server))
    with same_environment():
        with headless.drawing_window():
            assert os.environ["DISPLAY"] == ":42"
            assert headless.WINDOW not in os.environ
        assert tried == [EGL, OSMESA, X11]
    pid = int((tmp_path / "pid").read_text())
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)


@pytest.mark.parametrize("script", ["", ANSWERS])
def test_a_screen_of_no_use_ends_in_the_same_line(
    machine, monkeypatch, tmp_path, script
):
    server = stand_in(tmp_path, script)
    monkeypatch.setattr(headless.shutil, "which", lambda name: str(server))
    with (
        same_environment(),
        pytest.raises(InputError, match="cannot draw"),
        headless.drawing_window(),
    ):
        pass


def test_without_anything_one_line_names_what_to_install(machine):
    with (
        same_environment(),
        pytest.raises(InputError) as caught,
        headless.drawing_window(),
    ):
        pass
    text = str(caught.value)
    assert "\n" not in text
    for package in ("libegl1", "mesa-libEGL", "xvfb"):
        assert package in text


def test_environment_is_as_before_after_a_failure(machine):
    available, _ = machine
    available.add(EGL)
    with (
        same_environment(),
        pytest.raises(KeyboardInterrupt),
        headless.drawing_window(),
    ):
        raise KeyboardInterrupt


def test_a_window_chosen_by_the_user_is_kept(machine, monkeypatch):
    _, tried = machine
    monkeypatch.setenv(headless.WINDOW, "mine")
    with same_environment(), headless.drawing_window():
        assert os.environ[headless.WINDOW] == "mine"
    assert not tried
