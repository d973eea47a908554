"""Excitation of one mesh: stiffness and gap of each tooth pair.

The three models differ only in these. With mesh deflection s, positive if the teeth
are pressed together, pair p carries k_p (s - g_p) on its drive side,
k_p (s - g_p + b) on its back side, and nothing within the backlash b between.
Model-1: a stiffness and a gap for every pair (eq. 2.2 of the multi-mesh source).
Model-2: the mean stiffness of the mesh and the loaded static transmission error without
its mean (eq. 2.10). Model-3: the total stiffness and the no-load transmission error
(eq. 2.11). Eq. 2.4 as printed reverses the back side's force; it is derived here from
the overlap of the back flanks. As there, the backlash is measured from the same gap.
This is correct for displaced teeth, as with pitch errors, whereas a relief of the drive
flank also affects the back.

With pitch errors the tooth pairs differ. In Model-1 an error is a constant added to the
gap of its pair, which is exact on the nominal path and accurate to about a per cent of
the error in corner contact. Stiffnesses are those of the teeth without errors, and a
pair carries no load where these are zero. Models 2 and 3 use the transmission errors of
the whole period, after which the pairs repeat. So do all models where teeth are
damaged: the stiffness of a pair then is that of its teeth.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from lumped.common.array_types import Array
from lumped.common.checks import format_value, is_number, require_fields
from lumped.common.short_repr import ShortRepr
from lumped.train.waves import Wave


@dataclass(frozen=True)
class PairExcitation(ShortRepr):
    """Stiffness [N/m] and gap [m] of a tooth pair over the mesh cycle.

    If the pairs that occupy this place one after another differ, it describes them all.

    Parameters
    ----------
    stiffness : Wave
        Stiffness [N/m].
    gap : Wave
        Gap [m].
    ahead : int, optional
        Base pitches by which the pair is ahead of the reference pair, which passes the
        pitch point at position 0; None for a spring that represents the whole mesh.
    place : Wave, optional
        Place of the spring along the axis, from the middle of its mesh [m], of gears
        that move in space.

    Raises
    ------
    ValueError
        If a value is not of its type.
    """

    stiffness: Wave
    gap: Wave
    ahead: int | None = None
    place: Wave | None = None

    def __post_init__(self) -> None:
        require_fields(self)

    @property
    def period(self) -> int:
        """Base pitches after which the pair's excitation repeats."""
        return math.lcm(self.stiffness.period, self.gap.period)


@dataclass(frozen=True)
class MeshExcitation(ShortRepr):
    """Springs in parallel that represent a mesh.

    Parameters
    ----------
    pairs : tuple of PairExcitation
        Springs, one or more.
    mean_stiffness : float
        Mean stiffness of the mesh [N/m], positive.

    Raises
    ------
    ValueError
        If there is no spring or a value is not allowed.
    """

    pairs: tuple[PairExcitation, ...]
    mean_stiffness: float

    def __post_init__(self) -> None:
        if not self.pairs:
            raise ValueError("pairs must not be empty")
        if not is_number(self.mean_stiffness) or not 0 < self.mean_stiffness < math.inf:
            value = format_value(self.mean_stiffness)
            raise ValueError(f"mean_stiffness = {value}; must be positive")
        require_fields(self)

    @property
    def period(self) -> int:
        """Base pitches after which the excitation repeats."""
        return math.lcm(*(pair.period for pair in self.pairs))


def with_pitch_errors(gap: Wave, ahead: int, errors: Array) -> Wave:
    """Gap of the pairs that are `ahead` of the reference pair, by their pitch errors.

    errors : of the tooth pairs (n,) [m], the reference pair at position 0 first, then
        those that come into contact after it
    """
    # pairs ahead came into contact earlier
    return replace(gap, offsets=np.roll(errors, ahead)) if errors.size else gap


def with_more_gaps(gap: Wave, ahead: int, gaps: Array) -> Wave:
    """Gap of the pairs that are `ahead`, by further gaps (n,) [m] of tooth pairs.

    gaps : as errors of `with_pitch_errors`
    """
    offsets = gap.offsets if gap.offsets.size else np.zeros(1)
    number = np.arange(math.lcm(offsets.size, gaps.size))
    further = np.roll(gaps, ahead)[number % gaps.size]
    return replace(gap, offsets=offsets[number % offsets.size] + further)
