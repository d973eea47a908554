"""Packages with further commands, which the distribution declares as entry points."""

from __future__ import annotations

from collections.abc import Iterator
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

GROUP = "fegear.commands"
ROOT = Path(__file__).parents[2]  # of all packages of the distribution
PROJECT = ROOT / "pyproject.toml"  # there in a source checkout


def load_command_packages() -> None:
    """Import the packages of further commands, which register themselves.

    A package of the same name that is found elsewhere is a stranger's, and stays out.
    """
    for name in declared_packages():
        if _is_ours(name):
            import_module(name)


def declared_packages() -> Iterator[str]:
    """Names of the packages, of a source checkout by its own declaration.

    What is installed of it may be older, or nothing.
    """
    if PROJECT.is_file():
        import tomllib

        project = tomllib.loads(PROJECT.read_text("utf-8")).get("project", {})
        yield from project.get("entry-points", {}).get(GROUP, {}).values()
    else:
        from importlib.metadata import entry_points

        yield from dict.fromkeys(entry.value for entry in entry_points(group=GROUP))


def _is_ours(name: str) -> bool:
    """Whether a package lies with this one; finding its top imports nothing."""
    try:
        spec = find_spec(name.partition(".")[0])
    except ValueError:  # a module that is there without a specification
        return False
    places = spec.submodule_search_locations if spec is not None else None
    return bool(places) and ROOT in {Path(place).parent for place in places or ()}
