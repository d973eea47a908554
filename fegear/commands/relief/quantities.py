"""What reliefs and leads change over the mesh cycle, with slopes by a design."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Literal, NamedTuple

import numpy as np

from fegear.contact.result import ContactCycle, band_means
from fegear.statics.root_stress import RootOverWidth
from lumped.common.array_types import Array
from lumped.common.units import UM

Quantity = Literal["ste", "pressure", "line_load", "distribution", "root_stress"]
# of the square root of its load
PRESSURE_EXPONENT = 0.5


class SlopedValues(NamedTuple):
    """A quantity in cases (c) at places (q) of the mesh cycle.

    values : (c, q); slopes : (c, q, x) by the sizes of a design
    """

    values: Array
    slopes: Array


class Slopes(NamedTuple):
    """Slopes of a cycle by the sizes of a design.

    ste : (t, n, x); load : (t, n, k, m, x) per length of the line of contact
    """

    ste: Array
    load: Array


class SlopedCycle(NamedTuple):
    """A solved cycle with its slopes by the sizes of a design.

    roots : root stress of both gears, where it was asked for
    """

    cycle: ContactCycle
    slopes: Slopes
    roots: tuple[RootOverWidth, ...] = ()


def no_slopes(cycle: ContactCycle) -> Slopes:
    """No slopes, of a cycle that is solved without."""
    return Slopes(*(np.zeros((*v.shape, 0)) for v in (cycle.ste, cycle.face.load)))


def _ste(solved: SlopedCycle) -> SlopedValues:
    return SlopedValues(solved.cycle.ste, solved.slopes.ste)


def _pressure(solved: SlopedCycle) -> SlopedValues:
    """Contact pressure of slices on the path [Pa], in the plane of the compliances."""
    face = solved.cycle.face
    pressure = np.where(face.on_path, face.pressure, 0.0)
    rate = PRESSURE_EXPONENT * pressure / np.where(face.load > 0.0, face.load, np.inf)
    return _over_places(pressure, rate[..., None] * solved.slopes.load)


def _line_load(solved: SlopedCycle) -> SlopedValues:
    """Load per length of the line of contact [N/m], mean over bands of the width."""
    of_bands = np.moveaxis(band_means(np.moveaxis(solved.slopes.load, -1, -2)), -2, -1)
    return _over_places(band_means(solved.cycle.face.load), of_bands)


def _distribution(solved: SlopedCycle) -> SlopedValues:
    """Mean load over the cycle on bands of the width, over that on all of it.

    The largest is K_Hbeta, see `FaceLoads.distribution_factor`. The mean of all hardly
    changes at the same torque.
    """
    per_width = solved.cycle.face.per_width.mean(axis=1)
    mean = per_width.mean(axis=1)[:, None]
    change = np.moveaxis(solved.slopes.load.sum(axis=2).mean(axis=1), -1, -2)
    of_bands = np.moveaxis(band_means(change), -2, -1)
    return SlopedValues(band_means(per_width) / mean, of_bands / mean[..., None])


def _root_stress(solved: SlopedCycle) -> SlopedValues:
    """Root stress over the width of the teeth of both gears [Pa]."""
    parts = [_over_places(root.stress, root.slopes) for root in solved.roots]
    values, slopes = zip(*parts, strict=True)
    return SlopedValues(np.concatenate(values, axis=1), np.concatenate(slopes, axis=1))


def _over_places(values: Array, slopes: Array) -> SlopedValues:
    of_cases = values.shape[0], math.prod(values.shape[1:])
    sizes = slopes.shape[-1]
    return SlopedValues(values.reshape(of_cases), slopes.reshape(*of_cases, sizes))


QUANTITIES: Mapping[Quantity, Callable[[SlopedCycle], SlopedValues]] = {
    "ste": _ste,
    "pressure": _pressure,
    "line_load": _line_load,
    "distribution": _distribution,
    "root_stress": _root_stress,
}
# in which linear programs have numbers of common size
SCALES: Mapping[Quantity, float] = {
    "ste": UM,
    "pressure": 1e6,
    "line_load": 1e3,
    "distribution": 1.0,
    "root_stress": 1e6,
}


def responses(
    names: Sequence[Quantity], cycles: Sequence[SlopedCycle]
) -> dict[Quantity, SlopedValues]:
    """Quantities of cycles, whose cases follow each other."""
    result = {}
    for name in names:
        parts = [QUANTITIES[name](cycle) for cycle in cycles]
        result[name] = SlopedValues(*map(np.concatenate, zip(*parts, strict=True)))
    return result
