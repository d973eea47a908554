"""Commands up to where they begin to compute."""

from __future__ import annotations

from importlib import import_module

import pytest
from short_uses import SHORT_USES

# what is replaced, and the modules that bind it by its name: a first import while it is
# replaced would keep the replacement
REPLACED = {
    "fegear.elasticity.cache.cached_arrays": (
        "fegear.dynamics.body_modes",
        "fegear.dynamics.cross_mesh",
    ),
    "fegear.elasticity.cache.kept_arrays": (),
    "fegear.elasticity.cache.cached_body": (
        "fegear.elasticity.gear_modes",
        "fegear.train.coupled",
    ),
    "lumped.steady.steady_state.steady_state": ("lumped.steady.truncation_check",),
}


class Computed(BaseException):
    """Something was computed, or read where it had been."""


@pytest.fixture(autouse=True)
def nothing_is_computed(monkeypatch, tmp_path) -> None:
    def fail(*_arguments: object, **_options: object) -> None:
        raise Computed

    for place, modules in REPLACED.items():
        for module in modules:
            import_module(module)
            monkeypatch.setattr(f"{module}.{place.rpartition('.')[2]}", fail)
        monkeypatch.setattr(place, fail)
    sector = "fegear.elasticity.sector.CyclicSector.__post_init__"
    monkeypatch.setattr(sector, fail, raising=False)
    monkeypatch.chdir(tmp_path)


def arguments_of(command: str) -> list[str]:
    """A short use of a command with finite elements; further ones replace its own."""
    name = next(
        name for name in sorted(SHORT_USES, key=len)[::-1] if command.startswith(name)
    )
    more = command.removeprefix(name).split()
    arguments = SHORT_USES[name].text.split()
    for option in ("--excitation", "--bending", *more[::2]):
        if option in arguments:
            at = arguments.index(option)
            del arguments[at : at + 2]
    if name == "bifurcations" and not more:
        more = ["--direction", "up"]
    files = {"SET": "set.toml", "CASE": "case.toml"}
    arguments = [files.get(word, word) for word in arguments]
    return [*name.split(), *arguments, *more]
