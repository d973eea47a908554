"""Drawing by VTK on machines without a screen."""

from __future__ import annotations

import ctypes
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager

from fegear.files.errors import InputError

WINDOW = "VTK_DEFAULT_OPENGL_WINDOW"
MISSING = (
    "cannot draw: there is no screen and neither EGL, OSMesa nor Xvfb work; install "
    "one of them, such as libegl1 with libgl1-mesa-dri (Debian, Ubuntu) or "
    "mesa-libEGL with mesa-dri-drivers (Fedora), or xvfb"
)


@contextmanager
def drawing_window() -> Iterator[None]:
    """Off-screen windows that VTK can open: EGL, OSMesa, a screen, then Xvfb.

    VTK ends the program where it can open none, so each is tried beforehand.
    Raises InputError where nothing works.
    """
    window = os.environ.get(WINDOW)
    if window is not None or not sys.platform.startswith("linux"):
        yield
        return
    if name := _working_window():
        os.environ[WINDOW] = name
        try:
            yield
        finally:
            del os.environ[WINDOW]
        return
    with _virtual_screen():
        if not _opens("vtkXOpenGLRenderWindow"):
            raise InputError(MISSING)
        yield


def _working_window() -> str | None:
    if _opens("vtkEGLRenderWindow"):
        return "vtkEGLRenderWindow"
    if _has_osmesa():
        return "vtkOSOpenGLRenderWindow"
    if os.environ.get("DISPLAY") and _opens("vtkXOpenGLRenderWindow"):
        return "vtkXOpenGLRenderWindow"
    return None


def _opens(name: str) -> bool:
    """Whether VTK has this kind of window and can open one; it warns if not."""
    from vtkmodules import vtkRenderingOpenGL2
    from vtkmodules.vtkCommonCore import vtkLogger

    kind = getattr(vtkRenderingOpenGL2, name, None)
    if kind is None:
        return False
    before = vtkLogger.GetCurrentVerbosityCutoff()
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)
    try:
        window = kind()
        window.SetOffScreenRendering(True)
        return bool(window.SupportsOpenGL())
    finally:
        vtkLogger.SetStderrVerbosity(before)


def _has_osmesa() -> bool:
    """Whether the library of OSMesa is there: VTK reports it in any case."""
    for version in ("8", "6"):
        try:
            ctypes.CDLL(f"libOSMesa.so.{version}")
        except OSError:
            continue
        return True
    return False


@contextmanager
def _virtual_screen() -> Iterator[None]:
    """An X server without a screen, for as long as it is needed."""
    program = shutil.which("Xvfb")
    if program is None:
        raise InputError(MISSING)
    read, write = os.pipe()
    with tempfile.TemporaryFile() as messages:
        server = subprocess.Popen(
            [program, "-displayfd", str(write), "-screen", "0", "1920x1080x24"],
            pass_fds=[write],
            stderr=messages,
            start_new_session=True,  # Ctrl-C is not for it: VTK would lose its screen
        )
    os.close(write)
    before = os.environ.get("DISPLAY")
    try:
        with os.fdopen(read) as line:  # it ends where the server fails to start
            number = line.readline().strip()
        if not number:
            raise InputError(MISSING)
        os.environ["DISPLAY"] = f":{number}"
        yield
    finally:
        server.terminate()
        server.wait()
        if before is None:
            os.environ.pop("DISPLAY", None)
        else:
            os.environ["DISPLAY"] = before
