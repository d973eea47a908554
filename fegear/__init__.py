"""Contact and vibration of spur gears by plane finite elements.

A gear set is loaded from a file, taken from those that come with the package, or made
of tables with the keys of such a file. Every function below takes one and settings,
and returns a frozen result; SI units throughout, named where there is doubt.

A table of mesh stiffness and transmission error, with its discretisation error:

>>> import fegear
>>> gears = fegear.load_gear_set("liu-pair", {"mesh.1.tip_relief.magnitude_um": 10})
>>> table = fegear.solve_mesh(gears, torques_on_driver=[100.0])
>>> print(f"{table.table['stiffness_N_per_m'].mean():.2e} N/m")
2.46e+08 N/m
>>> print(f"error of the mean transmission error {table.error.mean:.0e}")
error of the mean transmission error 6e-04
>>> table.to_csv("table.csv")

Vibration over speed of a lumped model, on the mesh stiffness of key figures:

>>> model = fegear.LumpedModel(excitation=fegear.ExcitationSettings(kind="rectangular"))
>>> speeds = range(2000, 3100, 100)  # mesh frequencies [Hz]
>>> sweep = fegear.Sweep(gear_set=gears, torque=[100.0], speeds=speeds, model=model)
>>> result = fegear.run(sweep)
>>> (peak,) = result.summary["branches"][0]["peaks"]
>>> print(f"{1e6 * peak['dte_rms_m']:.1f} um at {peak['frequency_Hz']:g} Hz")
7.0 um at 2800 Hz
>>> result.to_csv("sweep.csv")

The same by the finite elements themselves:

>>> gears = fegear.load_gear_set("liu-pair")
>>> dynamics = fegear.Dynamics(gear_set=gears, torque=[100.0], speeds=[2900.0])
>>> result = fegear.run(dynamics)
>>> result.reasons[0][1].partition(":")[0]
'reduced'
>>> result.to_csv("dynamics.csv")

One speed by the lumped model that agrees with them, tooth pair by tooth pair:

>>> coupled = fegear.LumpedModel(number="coupled")
>>> motion = fegear.Motion(gear_set=gears, torque=100.0, speed=2500.0, model=coupled)
>>> result = fegear.run(motion)
>>> pairs = result.motion.pairs[0]
>>> pairs.force.shape[1], list(pairs.conditions)
(2, ['III'])
>>> result.to_csv("motion.csv")

Stress in the teeth, and a picture of it:

>>> stress = fegear.solve_stress(gears, 100.0, position=0.9)
>>> {name: f"{1e-6 * value:.0f} MPa" for name, value in stress.largest_Pa.items()}
{'pinion': '361 MPa', 'idler': '363 MPa'}
>>> stress.draw("contact.png")

Studies, such as `Sweep` and `Dynamics`, `LumpedModel`, `ExcitationSettings`,
`StaticsSettings`, `FiniteElements` and `PictureSettings` say what can be chosen. A
setting or argument that cannot be used raises `ValueError`, what files and gear sets
hold its kind `InputError`, both in one line. `python -m fegear` is the command line.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

from fegear.studies import registry
from fegear.studies.command_packages import load_command_packages
from fegear.studies.public import public_homes

load_command_packages()

_HOMES = public_homes()
__all__ = ["__version__", *_HOMES]


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from fegear.files.version import package_version

        return package_version()
    if name not in _HOMES:
        raise AttributeError(f"module 'fegear' has no attribute '{name}'{_hint(name)}")
    return getattr(import_module(_HOMES[name]), name)


def _hint(name: str) -> str:
    """Which study a command has, for a name like that of the command."""
    wanted = name.lower().replace("_", "")
    for command in registry.commands().values():
        if command.name.replace(" ", "").replace("-", "") == wanted:
            return f"; the study of `fegear {command.name}` is {command.study}"
    return ""


def __dir__() -> list[str]:
    return __all__
