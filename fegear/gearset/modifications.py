"""Modifications of tooth flanks: reliefs, profiles, leads and topographies."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Literal

from fegear.files.errors import InputError
from fegear.gearset.field_checks import require_fields, require_positive

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

ReliefShape = Literal["linear", "parabolic"]
# monotonic, so that the gap between two flanks has one minimum
Interpolation = Literal["cubic", "linear"]
MAX_PROFILE_POINTS = 1000  # of a measured profile; machines print some 500
MAX_TOPOGRAPHY_POINTS = 200  # in either direction of a topography
LEAD_SIZES = "crowning", "slope", "end_relief", "end_length"  # of a FlankLead
RELIEF_POWERS: dict[ReliefShape, float] = {"linear": 1.0, "parabolic": 2.0}


@dataclass(frozen=True, kw_only=True)
class Relief:
    """Profile modification of one flank, growing from its start to the end.

    Tip relief ends at the tip, root relief at the lowest point of contact. At every
    radius the flank is that of a tooth turned back by depth over base radius: the depth
    is along the normal of the unmodified flank, and the tip circle stays.

    magnitude : material removed at the end [m]
    start_roll_length : sqrt(r^2 - rb^2) where it begins, negative on an internal
        gear [m]
    """

    magnitude: float
    start_roll_length: float
    shape: ReliefShape = "linear"

    def __post_init__(self) -> None:
        require_fields(self)
        require_positive(self, "magnitude")

    @property
    def power(self) -> float:
        """Depth grows with this power of the way from start to end."""
        return RELIEF_POWERS[self.shape]


@dataclass(frozen=True, kw_only=True)
class FlankProfile:
    """Deviations of one gear's flanks over the whole active profile, which add up.

    The active profile goes from the lowest point of contact to the tip; all lengths are
    in metres. Depth and gap functions are as in `Relief`.

    crowning : material removed at both ends of the active profile, by a parabola that
        is zero in its middle
    slope : excess of material at the tip, which grows linearly from zero at the lowest
        point of contact; the profile slope deviation of ISO 1328-1
    roll_lengths : sqrt(r^2 - rb^2) of measured points, increasing, or empty; negative
        on an internal gear, and toward the tip as on others
    deviations : excess of material at these points; constant beyond the first and last
    interpolation : between measured points, shape-preserving cubic or linear
    """

    crowning: float = 0.0
    slope: float = 0.0
    roll_lengths: tuple[float, ...] = ()
    deviations: tuple[float, ...] = ()
    interpolation: Interpolation = "cubic"

    def __post_init__(self) -> None:
        require_fields(self)
        counts = len(self.roll_lengths), len(self.deviations)
        if counts[0] != counts[1] or counts[0] == 1 or counts[0] > MAX_PROFILE_POINTS:
            raise InputError(
                f"deviations = {counts[1]} values at {counts[0]} roll_lengths; as many "
                f"are needed, none or 2 to {MAX_PROFILE_POINTS}"
            )
        if any(b <= a for a, b in pairwise(self.roll_lengths)):
            raise InputError("roll_lengths must increase")

    @property
    def is_measured(self) -> bool:
        return bool(self.roll_lengths)


@dataclass(frozen=True, kw_only=True)
class FlankLead:
    """Material removed from one gear's flanks over its face width, which adds up.

    Depths are along the line of action, in metres.

    crowning : at both ends, by a parabola that is zero in the middle
    slope : at the far end, linear from none at the near end
    end_relief : at both ends, by a parabola over `end_length` from each
    """

    crowning: float = 0.0
    slope: float = 0.0
    end_relief: float = 0.0
    end_length: float = 0.0

    def __post_init__(self) -> None:
        require_fields(self)

    @property
    def of_back_flanks(self) -> FlankLead:
        """That of the other flanks: a helix slope is one of the whole tooth."""
        return replace(self, slope=-self.slope)

    def depth(self, place: NDArray[np.float64], width: float) -> NDArray[np.float64]:
        """Depth (n,) [m] at places (n,) from the middle of a face width [m]."""
        import numpy as np

        way = 2.0 * place / width
        depth = self.crowning * way**2 + 0.5 * self.slope * (1.0 + way)
        if self.end_relief:
            beyond = np.abs(place) - (0.5 * width - self.end_length)
            depth = depth + self.end_relief * (
                np.maximum(beyond / self.end_length, 0.0) ** 2
            )
        return np.asarray(depth)


@dataclass(frozen=True, kw_only=True)
class FlankTopography:
    """Material removed from drive flanks over profile and face width, which adds up.

    Depths are along the line of action as those of a lead, bilinear between points and
    constant beyond the outer ones; all lengths are in metres.

    roll_lengths : (k,) sqrt(r^2 - rb^2) of points, increasing
    places : (l,) along the face width from its middle, increasing toward the far end
    depths : (k, l) material missing at each
    """

    roll_lengths: tuple[float, ...]
    places: tuple[float, ...]
    depths: tuple[tuple[float, ...], ...]

    def __post_init__(self) -> None:
        require_fields(self)
        for name in ("roll_lengths", "places"):
            points = getattr(self, name)
            if not 2 <= len(points) <= MAX_TOPOGRAPHY_POINTS:
                raise InputError(
                    f"{name} = {len(points)} values; 2 to {MAX_TOPOGRAPHY_POINTS} are "
                    "needed"
                )
            if any(b <= a for a, b in pairwise(points)):
                raise InputError(f"{name} must increase")
        counts = {len(row) for row in self.depths}
        if len(self.depths) != len(self.roll_lengths) or counts != {len(self.places)}:
            raise InputError(
                f"depths = {len(self.depths)} rows of {sorted(counts)} values; must be "
                f"{len(self.roll_lengths)} rows, as roll_lengths, of "
                f"{len(self.places)} values, as places"
            )

    def depth(
        self, roll_length: NDArray[np.float64], place: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Depth (n,) [m] at roll lengths and places (n,) [m] of this flank."""
        import numpy as np

        rolls, places, depths = self._arrays
        (i, u), (j, v) = _between(rolls, roll_length), _between(places, place)
        near = (1.0 - u) * depths[i, j] + u * depths[i + 1, j]
        far = (1.0 - u) * depths[i, j + 1] + u * depths[i + 1, j + 1]
        return np.asarray((1.0 - v) * near + v * far)

    @cached_property
    def _arrays(self) -> tuple[NDArray[np.float64], ...]:
        """Roll lengths, places and depths."""
        import numpy as np

        return tuple(map(np.array, (self.roll_lengths, self.places, self.depths)))


def _between(
    points: NDArray[np.float64], values: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Index of the point before each value, and the way from there to the next one."""
    import numpy as np

    first = np.searchsorted(points, values, side="right") - 1
    index = np.clip(first, 0, points.size - 2)
    way = (values - points[index]) / (points[index + 1] - points[index])
    return index, np.clip(way, 0.0, 1.0)


@dataclass(frozen=True, kw_only=True)
class FlankModifications:
    """What is taken off the flanks of one gear in a mesh, of all teeth alike."""

    tip_relief: Relief | None = None
    root_relief: Relief | None = None
    profile: FlankProfile | None = None
    lead: FlankLead | None = None
    topography: FlankTopography | None = None

    @property
    def reliefs(self) -> tuple[Relief | None, Relief | None]:
        """Tip relief and root relief."""
        return self.tip_relief, self.root_relief

    @property
    def is_modified(self) -> bool:
        others = self.profile, self.lead, self.topography
        return (*self.reliefs, *others) != (None,) * 5

    @property
    def varies_over_width(self) -> bool:
        return self.lead is not None or self.topography is not None


UNMODIFIED = FlankModifications()
Flanks = tuple[FlankModifications, FlankModifications]  # of driver and driven gear


def named_reliefs(flanks: Flanks) -> Iterator[tuple[str, Relief]]:
    """Reliefs of driver and driven gear, by their keys in a mesh of a file."""
    for role, flank in zip(("driver", "driven"), flanks, strict=True):
        for place, relief in zip(("tip", "root"), flank.reliefs, strict=True):
            if relief is not None:
                yield f"{role}_{place}_relief", relief
