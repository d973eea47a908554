"""Gears shared by the tests, and a cache directory of their own."""

from __future__ import annotations

import ctypes
import getpass
import hashlib
import math
import os
import shutil
import signal
import sys
import tempfile
import time
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path

# before numpy is loaded: workers that share the cores wait for each other's threads
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import hypothesis
import psutil
import pytest
from blas_tests import pytest_itemcollected
from slow_tests import pytest_collection_modifyitems

from meshes import GearPair, SpurGear
from meshes.helical import HelicalGear

__all__ = ["pytest_collection_modifyitems", "pytest_itemcollected"]  # hooks of pytest

# commands that tests start take Ctrl-C even where these run in the background
signal.signal(signal.SIGINT, signal.default_int_handler)

# the same random inputs in every run: what fails once fails for everybody
hypothesis.settings.register_profile("fixed", derandomize=True, deadline=None)
hypothesis.settings.load_profile("fixed")

ROOT = Path(__file__).parents[1]
DAY_S = 86400.0
LARGE_MEMORY = 1e9  # B, of a process
# folders whose sources compute what the cache of compliances holds
OF_ELASTICITY = "meshes", "lumped/common", "fegear/files", "fegear/elasticity"
OF_ELASTICITY += ("fegear/dynamics",)
MODULE = 2.54e-3
ADDENDUM = 2.74842621e-3  # gives contact ratio 1.504
SMALL_HUBS = {  # liu-pair as in liu-idler-small-hubs: its bodies yield more
    "defaults.face_width_mm": 25.4,
    "gear.1.hub_radius_mm": 14.07,
    "gear.2.hub_radius_mm": 20.0,
}


@pytest.fixture(scope="session", autouse=True)
def compliance_cache():
    """Elasticity of gears by the sources as they are, shared by all processes and runs.

    What another state of the sources has left behind is never read.
    """
    before = os.environ.get("FEGEAR_CACHE_DIR")
    os.environ["FEGEAR_CACHE_DIR"] = str(cache_of_sources())
    yield
    if before is None:
        del os.environ["FEGEAR_CACHE_DIR"]
    else:
        os.environ["FEGEAR_CACHE_DIR"] = before


@pytest.fixture(scope="session", autouse=True)
def no_litter():
    """Tests leave no files in the folder of the project."""
    before = files_of_project()
    yield
    assert files_of_project() - before == set()


@pytest.fixture(scope="module", autouse=True)
def memory_is_given_back():
    """A process gives back the memory that glibc keeps between arrays in use."""
    yield
    if psutil.Process().memory_info().rss > LARGE_MEMORY and sys.platform == "linux":
        with suppress(OSError, AttributeError):  # of another C library
            ctypes.CDLL("libc.so.6").malloc_trim(0)


def files_of_project() -> set[str]:
    return {path.name for path in ROOT.iterdir() if path.is_file()}


def cache_of_sources() -> Path:
    """A folder that is named after what computes elasticity; those of a day ago go.

    Each choice of BLAS kernels and threads has its own, as round-off differs.
    """
    choices = sorted(item for item in os.environ.items() if "BLAS" in item[0])
    digest = hashlib.sha256(repr(choices).encode())
    for folder in OF_ELASTICITY:
        for path in sorted((ROOT / folder).rglob("*.py")):
            digest.update(path.read_bytes())
    parent = Path(tempfile.gettempdir()) / f"fegear-tests-{getpass.getuser()}"
    folder = parent / digest.hexdigest()[:16]
    folder.mkdir(parents=True, exist_ok=True)
    os.utime(folder)
    for other in parent.iterdir():
        if time.time() - other.stat().st_mtime > DAY_S:
            shutil.rmtree(other, ignore_errors=True)
    return folder


def center_distance_at(one: SpurGear, two: SpurGear, pressure_angle: float) -> float:
    """Centre distance [m] that gives the operating pressure angle [rad]."""
    return (one.base_radius + two.base_radius) / math.cos(pressure_angle)


def make_gear(teeth: int, hub_radius: float, **changes) -> SpurGear:
    values = {
        "teeth": teeth,
        "module": MODULE,
        "pressure_angle": math.radians(20.0),
        "profile_shift": 0.0,
        "tip_radius": 0.5 * MODULE * teeth + ADDENDUM,
        "dedendum": 1.25 * MODULE,
        "rack_tip_radius": 0.3 * MODULE,
        "hub_radius": hub_radius,
    }
    return SpurGear(**(values | changes))


def make_helical(teeth: int, hub: float, helix_angle_deg: float, **changes):
    """The gear of `make_gear` along a helix; its section differs in the fillet."""
    fields = asdict(make_gear(teeth, hub, **changes))
    return HelicalGear(**fields, helix_angle=math.radians(helix_angle_deg))


@pytest.fixture(scope="session")
def pinion() -> SpurGear:
    return make_gear(38, 15e-3)


@pytest.fixture(scope="session")
def wheel() -> SpurGear:
    return make_gear(55, 20e-3)


@pytest.fixture(scope="session")
def pair(pinion, wheel) -> GearPair:
    distance = center_distance_at(pinion, wheel, math.radians(21.22))
    return GearPair(pinion, wheel, distance)


@pytest.fixture(scope="module")
def browser():
    """Headless Chromium."""
    program = shutil.which("chromium") or shutil.which("chromium-browser")
    if program is None:
        pytest.skip("there is no Chromium")
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(
            executable_path=program, args=["--no-sandbox"]
        )
        yield chromium
        chromium.close()
