"""Contact and vibration of gears by finite elements and lumped models.

Functions and studies take a gear set and frozen settings, and give frozen results. All
values are in SI units. A mesh is chosen by its number from 1, as in files and commands.

>>> import fegear
>>> gears = fegear.load_gear_set("liu-pair", {"mesh.1.tip_relief.magnitude_um": 10})
>>> solved = fegear.solve_mesh(gears, mesh=1, torques_on_driver=100.0)
>>> print(f"{solved.table['stiffness_N_per_m'].mean():.2e} N/m")
2.46e+08 N/m
>>> print(f"error of the mean transmission error {100 * solved.error.mean:.1f} %")
error of the mean transmission error 0.1 %
>>> (figures,) = solved.key_figures
>>> print(f"{figures['ste_peak_to_peak_um']:.1f} um peak to peak")
1.9 um peak to peak

>>> model = fegear.LumpedModel(excitation=fegear.ExcitationSettings(kind="rectangular"))
>>> sweep = fegear.Sweep("liu-pair", torque=100.0, speeds="2000:3000:100", model=model)
>>> result = fegear.run(sweep)  # print(result) shows its page
>>> print(f"{1e6 * result.table['dte_rms_m'].max():.1f} um")
20.2 um

`help(fegear.Sweep)` describes one name. What cannot be used raises `ValueError`, what
files and gear sets hold its kind `InputError`, both in one line.
"""

from __future__ import annotations

import sys
from importlib import import_module
from typing import Any

from fegear.studies import registry
from fegear.studies.command_packages import load_command_packages
from fegear.studies.public import names_by_subject, names_text, public_homes

load_command_packages()

_HOMES = public_homes()
_NAMES = ["__version__", *(n for names in names_by_subject().values() for n in names)]
__doc__ = f"{__doc__ or ''}\n{names_text()}\n"


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from fegear.files.version import package_version

        return package_version()
    if name == "__all__" and not _is_read_by_help():
        return list(_NAMES)
    if name not in _HOMES:
        raise AttributeError(f"module 'fegear' has no attribute '{name}'{_hint(name)}")
    return getattr(import_module(_HOMES[name]), name)


def _is_read_by_help() -> bool:
    """Whether `help` reads `__all__`, all of whose names it would print in full."""
    return sys._getframe(2).f_globals.get("__name__") == "pydoc"


def _hint(name: str) -> str:
    """Which study a command has, for a name like that of the command."""
    wanted = name.lower().replace("_", "")
    for command in registry.commands().values():
        if command.name.replace(" ", "").replace("-", "") == wanted:
            return f"; the study of `fegear {command.name}` is {command.study}"
    return ""


def __dir__() -> list[str]:
    return list(_NAMES)
