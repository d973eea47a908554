"""Figures of a gear set that are varied: `KEY=A:B:N` or `KEY=v,v,...`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from fegear.cli.edits import EditedSet
from fegear.cli.lumped_options import LumpedOptions, middle_torque
from fegear.cli.options import refuse_idle, require
from fegear.errors import InputError

if TYPE_CHECKING:
    from fegear.parameter_maps import VariedSet
    from lumped.maps import Axis

POINTS_LIMIT = 1_000_000


def parsed_axes(over: Sequence[str]) -> tuple[Axis, ...]:
    """One or two axes of `KEY=A:B:N` or `KEY=v,v,...`."""
    from lumped.maps import Axis, MapError

    require(1 <= len(over) <= 2, "--over", len(over), "one or two are allowed")
    axes = []
    for text in over:
        name, separator, values = text.partition("=")
        if not (separator and name.strip()):
            raise InputError(f"--over {text}; KEY=A:B:N is needed")
        try:
            axes.append(Axis(name.strip(), _axis_values(values, text)))
        except MapError as error:
            raise InputError(f"--over {error}") from None
    if len({axis.name for axis in axes}) < len(axes):
        raise InputError(f"--over {axes[0].name}; is given twice")
    count = 1
    for axis in axes:
        count *= len(axis.values)
    require(count <= POINTS_LIMIT, "--over", count, f"at most {POINTS_LIMIT} points")
    return tuple(axes)


def _axis_values(values: str, text: str) -> tuple[float, ...]:
    import numpy as np

    try:
        if ":" not in values:
            return tuple(float(value) for value in values.split(","))
        start, end, count = values.split(":")
        alone = int(count) == 1 and float(start) != float(end)
        if alone or not 1 <= int(count) <= POINTS_LIMIT:
            raise ValueError
        points = np.linspace(float(start), float(end), int(count))
        return tuple(float(f"{point:.12g}") for point in points)
    except ValueError:
        raise InputError(
            f"--over {text}; allowed KEY=A:B:N with N values from A to B, or values "
            "with commas"
        ) from None


def varied_set(
    subject: EditedSet,
    axes: tuple[Axis, ...],
    model: LumpedOptions,
    torque: float | None,
) -> VariedSet:
    """The gear set as the axes vary it.

    Raises InputError where an axis is not known or is fixed as well.
    """
    from fegear.gearset.edit import require_known_key
    from fegear.parameter_maps import DAMPING, OF_TEETH, SHORT, TORQUE, VariedSet

    names, ratio = {axis.name for axis in axes}, model.train.damping
    if TORQUE in names:
        refuse_idle(f"--over {TORQUE} replaces it, leave it out", torque=torque)
    if {DAMPING, SHORT[DAMPING]} & names:
        refuse_idle(f"--over {DAMPING} replaces it, leave it out", damping=ratio)
    gear_set, fixed = model.load(subject, torque)
    for axis in axes:
        key = SHORT.get(axis.name, axis.name)
        if key in fixed:
            raise InputError(f"--set {key}; --over varies it, leave it out")
        if axis.name != TORQUE and axis.name not in OF_TEETH:
            require_known_key(key)
    on_axis = [axis.values for axis in axes if axis.name == TORQUE]
    load = max(on_axis[0]) if on_axis else middle_torque(gear_set, torque)
    description = model.lumped_model(gear_set)
    return VariedSet(subject.set_name, gear_set, axes, load, description, fixed)
