"""Speeds that studies of trains take, as mesh frequencies or speeds of rotation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, TypeVar

from fegear.files.errors import InputError
from fegear.files.speed_ranges import parsed_speeds, written_speeds
from fegear.gearset.speeds import cycles_per_turn, mesh_frequency
from fegear.studies.settings import display_name, exposed_fields, group_of, setting
from fegear.studies.trains.axes import limits_or_single, written_limits
from lumped.common.options import Range

Study = TypeVar("Study", bound=Any)
FREQUENCY = Range(above=0.0, below=1e9, unit="Hz")
RPM = Range(above=0.0, below=1e9, unit="rpm")


def speeds_setting(
    default: Any, text: str, allowed: Range = FREQUENCY, **options: Any
) -> Any:
    """A setting of mesh frequencies, `A:B:STEP` in words."""

    def read(value: str) -> tuple[float, ...]:
        speeds = parsed_speeds(value)
        if not speeds:
            raise ValueError("a speed is needed")
        return speeds

    how: dict[str, Any] = {"metavar": "A:B:STEP", "write": written_speeds}
    return setting(default, text, allowed, parse=read, **how | options)


RPM_HELP = (
    "Rotational speed of the first mesh's driver, in a planetary set of its input "
    "[rpm], instead of {}."
)


def rpms_setting(instead: str) -> Any:
    """A setting of rotational speeds; instead : of which option."""
    text = RPM_HELP.format(instead).replace("speed", "speeds", 1)
    return speeds_setting((), text, RPM)


def rpm_limits_setting(instead: str) -> Any:
    """A setting of two rotational speeds A:B, or of one."""
    how: dict[str, Any] = {"parse": limits_or_single, "write": written_limits}
    return setting((), RPM_HELP.format(instead), RPM, metavar="A:B", **how)


def rpm_setting(instead: str) -> Any:
    """A setting of one rotational speed; instead : of which option."""
    return setting(None, RPM_HELP.format(instead), RPM, metavar="RPM")


def refuse_both(study: Any, *names: str) -> None:
    """Raise InputError where two of some settings are given."""
    given_names = [name for name in names if getattr(study, name) not in (None, ())]
    if len(given_names) > 1:
        shown = " and ".join(display_name(study, name) for name in given_names)
        raise InputError(f"{shown} exclude each other")


def with_frequencies(study: Study, speeds: Mapping[str, Any]) -> Study:
    """A study with mesh frequencies [Hz] in place of speeds of rotation.

    speeds : in rpm, by the names of the settings in Hz; None or () where not given
    """
    given_speeds = {name: rpm for name, rpm in speeds.items() if rpm not in (None, ())}
    if not given_speeds:
        return study
    cycles = cycles_per_turn(study.gear_set.loaded)
    frequencies = {
        name: tuple(mesh_frequency(cycles, is_single) for is_single in rpm)
        if isinstance(rpm, tuple)
        else mesh_frequency(cycles, rpm)
        for name, rpm in given_speeds.items()
    }
    rotation_frequencies = {
        member.name: member.default
        for member in exposed_fields(group_of(study))
        if member.name in ("rpm", "from_rpm")
    }
    return replace(study, **rotation_frequencies, **frequencies)
