"""From [housing] to a housing: the MAT file that it names."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fegear.files.errors import InputError
from fegear.files.matlab import read_matlab
from fegear.files.output import read_content
from fegear.gearset.housing import HousingFile
from fegear.gearset.problems import shown
from fegear.gearset.schema import HousingEntry
from fegear.gearset.shaft_bodies import ShaftBody
from lumped.rotors.housing import Housing, HousingError, HousingNode

NEEDED, OPTIONAL = ("stiffness", "mass", "nodes"), "damping"
FURTHER = 0  # in place of a shaft's number, of a node that holds no bearing


def housing_file(
    entry: HousingEntry | None, bodies: Sequence[ShaftBody | None], folder: Path
) -> HousingFile | None:
    """The housing of a checked table; InputError where the file does not fit.

    bodies : of all shafts, None of one that does not bend
    folder : where the file lies
    """
    if entry is None:
        return None
    source = f"housing: file = {shown(entry.file)}"
    path = folder / entry.file
    try:
        variables = read_matlab(read_content(path), str(path))
        return HousingFile(file=entry.file, housing=_housing(variables, bodies))
    except InputError as error:
        reason = str(error).removeprefix(f"{path}: ")
        raise InputError(f"{source}; {reason}") from None
    except HousingError as error:
        raise InputError(f"{source}; {error}") from None


def _housing(
    variables: Mapping[str, Any], bodies: Sequence[ShaftBody | None]
) -> Housing:
    for name in NEEDED:
        if name not in variables:
            names = ", ".join(map(str, variables)) or "none"
            raise InputError(
                f"has no variable {name}; needs {', '.join(NEEDED)}, has {names}"
            )
    damping = variables.get(OPTIONAL)
    return Housing(
        stiffness=_matrix("stiffness", variables["stiffness"]),
        mass=_matrix("mass", variables["mass"]),
        damping=None if damping is None else _matrix(OPTIONAL, damping),
        nodes=tuple(_nodes(variables["nodes"], bodies)),
    )


def _matrix(name: str, value: Any) -> NDArray[np.float64]:
    """A dense matrix of real numbers."""
    if hasattr(value, "toarray"):  # a sparse one
        value = value.toarray()
    if not isinstance(value, np.ndarray) or value.dtype.kind not in "fiub":
        kind = value.dtype if isinstance(value, np.ndarray) else type(value).__name__
        raise InputError(f"{name} is of {kind}; must be a matrix of real numbers")
    return np.asarray(value, dtype=float)


def _nodes(
    value: Any, bodies: Sequence[ShaftBody | None]
) -> Iterator[HousingNode | None]:
    """Bearing of every row, None of a further node."""
    rows = _matrix("nodes", value)
    if rows.ndim != 2 or rows.shape[1] != 2:
        shape = " x ".join(map(str, rows.shape))
        raise InputError(
            f"nodes is {shape}; must have 2 columns, numbers of shaft and bearing"
        )
    for number, (shaft, bearing) in enumerate(rows.tolist(), start=1):
        where = f"nodes row {number} = {shaft:g}, {bearing:g}"
        if not (shaft.is_integer() and bearing.is_integer()):
            raise InputError(f"{where}; must be whole numbers")
        if shaft == FURTHER:
            yield None
            continue
        if not 1 <= shaft <= len(bodies):
            raise InputError(
                f"{where}; the shaft must be 1 to {len(bodies)}, or 0 of a node that "
                "holds no bearing"
            )
        body = bodies[int(shaft) - 1]
        count = 0 if body is None else len(body.bearings)
        if not 1 <= bearing <= count:
            allowed = f"must be 1 to {count}" if count else "has none"
            raise InputError(f"{where}; the bearing of shaft {shaft:g} {allowed}")
        yield HousingNode(int(shaft) - 1, int(bearing) - 1)
