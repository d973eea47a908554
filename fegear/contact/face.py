"""Contact over the face width: what it adds to a contact problem, and its result."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fegear.elasticity.wide_flank import WideFlank
from lumped.common.array_types import Array, Indices
from lumped.common.short_repr import ShortRepr
from meshes import SpurGear

BANDS = 24  # of the common width, in whose parts largest loads are means


def largest_of_bands(values: Array) -> Array:
    """Largest means of values of slices (..., m) over a band of the width (...).

    A band is a part in BANDS of the width anywhere, or a slice where that is wider. At
    a sharp edge the load per length grows with the number of slices without limit; what
    a band carries does not.
    """
    slices = values.shape[-1]
    length = max(1.0, slices / BANDS)  # of a band, in slices
    edges = np.arange(slices + 1.0)
    starts = np.concatenate([edges, edges - length])  # the largest mean is at an edge
    starts = starts[(starts >= 0.0) & (starts <= slices - length)]
    sums = np.zeros((*values.shape[:-1], slices + 1))
    np.cumsum(values, axis=-1, out=sums[..., 1:])

    def sum_to(place: Array) -> Array:
        index = np.minimum(place.astype(np.int64), slices - 1)
        part = place - index
        return (1.0 - part) * sums[..., index] + part * sums[..., index + 1]

    return np.asarray((sum_to(starts + length) - sum_to(starts)).max(axis=-1) / length)


@dataclass(frozen=True, kw_only=True, eq=False)
class FaceContact(ShortRepr):
    """Contact over the face width in slices of equal length.

    driver, driven : compliance over the width of each gear
    width : common face width [m]
    offsets : middle of the common width from the middle of either gear [m]
    gap : (slices,) material missing along the line of action, on both flanks [m]
    """

    driver: WideFlank
    driven: WideFlank
    width: float
    gap: Array
    offsets: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        twist = (
            self.driver.kernel.base_helix_angle + self.driven.kernel.base_helix_angle
        )
        if abs(twist) > 1e-9:
            raise ValueError("helix angles on the base circles must be opposite")
        for flank, offset in zip(self.flanks, self.offsets, strict=True):
            if 0.5 * self.width + abs(offset) > 0.5 * flank.width * (1.0 + 1e-9):
                raise ValueError(
                    f"width = {self.width} at {offset}; must be within {flank.width}"
                )

    @property
    def flanks(self) -> tuple[WideFlank, WideFlank]:
        return self.driver, self.driven

    @property
    def slices(self) -> int:
        return len(self.gap)

    @cached_property
    def places(self) -> Array:
        """Middles of the slices (slices,) from the middle of the common width [m]."""
        return slice_places(self.width, self.slices)

    def gap_at(self, place: Array) -> Array:
        """Material missing at places (p,) from the middle of the common width [m].

        Linear between the middles of slices, and beyond the outer ones.
        """
        if self.slices < 2:
            return np.full(place.shape, self.gap[0])
        step = self.width / self.slices
        first = np.clip(np.floor((place - self.places[0]) / step), 0, self.slices - 2)
        index = first.astype(np.int64)
        part = (place - self.places[index]) / step
        return np.asarray((1.0 - part) * self.gap[index] + part * self.gap[index + 1])

    def overlap(self, gear: SpurGear) -> float:
        """Overlap ratio: base pitches by which the helix leads over the width."""
        return abs(gear.base_radius * gear.twist * self.width) / gear.base_pitch

    @property
    def mirrored(self) -> FaceContact:
        """The contact in a mirror that has the axes in it."""
        return replace(self, driver=self.driver.mirrored, driven=self.driven.mirrored)


@dataclass(frozen=True, eq=False)
class FaceLoads(ShortRepr):
    """Loads over the face width at torques (t), positions (n), pairs (k), slices (m).

    Parameters
    ----------
    place : (m,) array
        Middles of the slices, from the middle of the common width [m].
    base_helix_angle : float
        Base helix angle of the driver [rad], reversed where it turns clockwise.
    path_position : (n, k, m) array
        Positions of slices on the path of contact [base pitches].
    on_path : (n, k, m) array of bool
        Whether flanks touch there, away from the ends of the path.
    load : (t, n, k, m) array
        Normal force per length of the line of contact [N/m].
    pressure : (t, n, k, m) array
        Largest contact pressure, in plane strain [Pa].
    coupling : (t, n, k, k) array
        What pairs yield under the loads of others, per force in the section and along
        the line of action [m/N]; zero on the diagonal.
    """

    place: Array
    base_helix_angle: float
    path_position: Array
    on_path: NDArray[np.bool_]
    load: Array
    pressure: Array
    coupling: Array

    @property
    def slice_length(self) -> float:
        """Length of the line of contact in a slice [m]."""
        width = float(self.place[1] - self.place[0])
        return width / math.cos(self.base_helix_angle)

    @property
    def per_width(self) -> Array:
        """Force in the section per face width, of all pairs (t, n, m) [N/m]."""
        # the cosine of the direction and that of the line's length are the same
        return np.asarray(self.load.sum(axis=2))

    @property
    def distribution_factor(self) -> Array:
        """Load distribution factor K_Hbeta (t,), of the mean over the cycle.

        The largest mean load over a band of the width, see `largest_of_bands`, over the
        mean of all.
        """
        mean = self.per_width.mean(axis=1)
        return largest_of_bands(mean) / mean.mean(axis=1)

    @property
    def slice_factor(self) -> Array:
        """Factor as `distribution_factor`, of the largest slice, which has no limit."""
        mean = self.per_width.mean(axis=1)
        return np.asarray(mean.max(axis=1) / mean.mean(axis=1))

    @property
    def axial_force_on_driver(self) -> Array:
        """Axial force on the driver, positive toward the far end (t, n) [N]."""
        normal = self.load.sum(axis=(2, 3)) * self.slice_length
        return np.asarray(-normal * math.sin(self.base_helix_angle) + 0.0)

    @property
    def center(self) -> Array:
        """Centre of the force in the section along the axis (t, n) [m]."""
        of_slices = self.per_width
        return np.asarray((of_slices @ self.place) / of_slices.sum(axis=2))

    def among(self, columns: Indices, teeth: Indices) -> FaceLoads:
        """Put the pairs at some columns among all pairs, the others without load.

        Parameters
        ----------
        columns : array of int
            Columns of these pairs among all.
        teeth : (k,) array of int
            Base pitches by which each of all pairs is ahead.

        Returns
        -------
        FaceLoads
            Loads of all pairs.
        """
        count = teeth.size
        reference = self.path_position[:, :1] - teeth[columns[0]]

        def placed(values: NDArray[Any], axes: tuple[int, ...]) -> NDArray[Any]:
            shape = [
                count if i in axes else size for i, size in enumerate(values.shape)
            ]
            result = np.zeros(shape, values.dtype)
            index = [
                columns if i in axes else np.arange(n) for i, n in enumerate(shape)
            ]
            result[np.ix_(*index)] = values
            return result

        return replace(
            self,
            path_position=reference + teeth[:, None],
            on_path=placed(self.on_path, (1,)),
            load=placed(self.load, (2,)),
            pressure=placed(self.pressure, (2,)),
            coupling=placed(self.coupling, (2, 3)),
        )

    @classmethod
    def joined(cls, parts: Sequence[FaceLoads]) -> FaceLoads:
        """Loads at positions that follow each other, of the same pairs.

        Parameters
        ----------
        parts : sequence of FaceLoads
            Loads in the order of their positions.

        Returns
        -------
        FaceLoads
            Loads at all positions.
        """

        def join(name: str, axis: int) -> Any:
            return np.concatenate([getattr(part, name) for part in parts], axis=axis)

        return replace(
            parts[0],
            path_position=join("path_position", 0),
            on_path=join("on_path", 0),
            load=join("load", 1),
            pressure=join("pressure", 1),
            coupling=join("coupling", 1),
        )


def slice_places(width: float, slices: int) -> Array:
    """Middles of slices (slices,) of a width from its middle [m]."""
    return width * ((np.arange(slices) + 0.5) / slices - 0.5)
