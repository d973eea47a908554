"""Single access point to gmsh, whose state is global and is isolated here."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from types import ModuleType

SYSTEM_PACKAGES = (
    "apt-get install -y libgl1 libglu1-mesa libxrender1 libxcursor1 libxft2 "
    "libxinerama1 libgomp1"
)


class MissingSystemLibrary(RuntimeError):
    """Raised if a compiled wheel cannot be loaded on this machine."""


def import_gmsh() -> ModuleType:
    try:
        import gmsh
    except OSError as error:  # the wheel links to X11 and OpenGL
        raise MissingSystemLibrary(
            f"gmsh does not load ({error}); on Debian or Ubuntu run: {SYSTEM_PACKAGES}"
        ) from error
    return gmsh


@contextmanager
def gmsh_model(name: str) -> Iterator[ModuleType]:
    """Open a fresh, silent gmsh session with one model, and close it in any case."""
    gmsh = import_gmsh()
    if gmsh.isInitialized():
        raise RuntimeError("gmsh is already open in this process; close it first")
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("General.NumThreads", 1)
        gmsh.option.setNumber("Mesh.RandomSeed", 1)
        gmsh.model.add(name)
        yield gmsh
    finally:
        gmsh.finalize()
