"""Studies, each in a file that declares it, computes it, and shows what it found.

>>> import fegear
>>> found = fegear.run(fegear.Clatter(gearbox="seed-five-speed", seconds=1.0))
>>> round(found.summary["wheels"][0]["noise_m2_per_s3"], 3)
0.077
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

from fegear.studies.registry import STUDIES, home_of

if TYPE_CHECKING:
    from fegear.studies.study import Study


def load_study(command: str) -> type[Study]:
    """The class of a study by the name of its command."""
    module, name, _ = STUDIES[command]
    study_class: type[Study] = getattr(import_module(home_of(module)), name)
    return study_class
