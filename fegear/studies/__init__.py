"""Studies: what a command is made of, and the list of all commands.

>>> import fegear
>>> found = fegear.run(fegear.Clatter(gearbox="seed-five-speed", seconds=1.0))
>>> round(found.summary["wheels"][0]["noise_m2_per_s3"], 3)
0.077
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

from fegear.studies.registry import commands

if TYPE_CHECKING:
    from fegear.studies.study import Study


def load_study(command: str) -> type[Study]:
    """The class of a study by the name of its command."""
    declared = commands()[command]
    study: type[Study] = getattr(import_module(declared.module), declared.study)
    return study
