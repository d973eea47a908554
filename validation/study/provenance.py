"""Provenance of results: versions of the program and its libraries, and the machine."""

from __future__ import annotations

import os
import platform
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from fegear.files.version import package_version
from validation.study.sources import digest_of

LIBRARIES = ("numpy", "scipy", "numba", "scikit-fem", "gmsh", "matplotlib")


def provenance() -> Iterator[tuple[str, str]]:
    """Names and values in the order in which they are shown."""
    sources = digest_of("validation.study.runs")[:12]
    yield "fegear", f"{package_version()}, sources {sources}"
    libraries = ", ".join(f"{name} {_version(name)}" for name in LIBRARIES)
    yield "libraries", f"Python {platform.python_version()}, {libraries}"
    yield "threads of BLAS", os.environ.get("OPENBLAS_NUM_THREADS", "not limited")


def machine() -> str:
    """Processor, cores and system."""
    return f"{_processor()}, {os.cpu_count()} cores, {platform.platform()}"


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "unknown"


def _processor() -> str:
    """Its name where the system reports one, else its architecture."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    names = [line.partition(":")[2] for line in lines if line.startswith("model name")]
    return names[0].strip() if names else platform.processor() or platform.machine()
