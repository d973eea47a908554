"""The version of the program, as it is written into files."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError, version


def package_version() -> str:
    try:
        return version("fegear")
    except PackageNotFoundError:  # run from a source tree that is not installed
        return "uninstalled"
