"""Teeth of a gear that differ from the others, as the contact of a mesh meets them.

Teeth count from 0 in the order in which they come into contact, tooth 0 in the
reference pair, as pitch errors do.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from fegear.contact.profiles import profile_record
from fegear.gearset.modifications import FlankProfile
from lumped.common.array_types import Array, Indices
from meshes.crack import Crack

MISSING_GAP = 1.0  # [m] of a tooth that is not there, see `flanks.NO_FLANK_GAP`


class ChangedCompliance(Protocol):
    """What damage adds to the compliance of flanks, teeth counted clockwise."""

    def block(self, receiver: int, source: int) -> Array:
        """Change (2, n, n) of normal and tangential displacement.

        As in `FlankCompliance`; receiver, source : teeth, clockwise
        """
        ...


class FlankSpall(NamedTuple):
    """Spall between two roll lengths [m], and the share of the width it takes.

    place : of its middle from that of the gear's width [m]
    """

    start: float
    end: float
    share: float
    place: float = 0.0


class FlankCorner(NamedTuple):
    """Corner of a tooth that is broken off at an end of the face width.

    roll : roll length of its edge at that end [m]
    length : along the width, at which the edge is at the tip [m]
    is_far : whether it is at the far end
    """

    roll: float
    length: float
    is_far: bool


@dataclass(frozen=True, kw_only=True)
class ToothFaults:
    """Teeth of one gear that differ, on their flanks in one mesh.

    teeth : number of teeth of the gear
    change : of the compliance, or None
    clockwise : 1 where teeth that come into contact later are clockwise, -1 where
        those are counter-clockwise
    cracked : open cracks by tooth, as they are in the frame of the loaded flank
    damaged : teeth near them, whose compliance changes
    spalls, profiles : by tooth
    corners : roll length of the tip corner of teeth whose tip is broken off [m]
    broken_corners : by tooth
    missing : teeth that are not there
    """

    teeth: int
    change: ChangedCompliance | None = None
    clockwise: int = 1
    cracked: Mapping[int, Crack] = field(default_factory=dict)
    damaged: frozenset[int] = frozenset()
    spalls: Mapping[int, tuple[FlankSpall, ...]] = field(default_factory=dict)
    profiles: Mapping[int, FlankProfile] = field(default_factory=dict)
    corners: Mapping[int, float] = field(default_factory=dict)
    broken_corners: Mapping[int, FlankCorner] = field(default_factory=dict)
    missing: frozenset[int] = frozenset()

    @property
    def on_back_flanks(self) -> ToothFaults:
        """What differs on back flanks: spalls and wear are on the others, and a crack
        is closed where its root is in compression.
        """
        return replace(
            self, change=None, cracked={}, damaged=frozenset(), spalls={}, profiles={}
        )

    def clockwise_tooth(self, tooth: int) -> int:
        """A tooth as it counts clockwise."""
        return self.clockwise * tooth % self.teeth

    @property
    def clockwise_cracks(self) -> dict[int, Crack]:
        """Open cracks by tooth, counted clockwise."""
        return {self.clockwise_tooth(t): crack for t, crack in self.cracked.items()}

    def different(self, teeth: Indices) -> Indices:
        """Numbers of teeth of any shape within a turn, -1 for those like all others."""
        number = teeth % self.teeth
        unlike = self.damaged | self.with_other_flanks
        return np.where(np.isin(number, sorted(unlike)), number, -1)

    @property
    def with_other_flanks(self) -> frozenset[int]:
        """Teeth whose flanks differ, or that have none."""
        changed = (self.spalls, self.profiles, self.corners, self.broken_corners)
        return self.missing.union(*changed)

    def changes(self, teeth: Sequence[int]) -> Array | None:
        """Change (2, k, k, n, n) of the compliance between teeth (k,), None if none.

        teeth : within a turn, or -1, as from `different`

        By kind, the tooth whose displacement is read, and the loaded one.
        """
        near = [k for k, tooth in enumerate(teeth) if tooth in self.damaged]
        if self.change is None or not near:
            return None
        blocks = {
            (p, q): self.change.block(
                self.clockwise_tooth(teeth[p]), self.clockwise_tooth(teeth[q])
            )
            for p in near
            for q in near
        }
        size = blocks[near[0], near[0]].shape[-1]
        changes = np.zeros((2, len(teeth), len(teeth), size, size))
        for (p, q), block in blocks.items():
            changes[:, p, q] = block
        return changes

    @property
    def has_broken_tips(self) -> bool:
        """Whether tips or corners of teeth are broken off."""
        return bool(self.corners or self.broken_corners)

    @property
    def most_missing_beside(self) -> int:
        """Largest number of teeth beside each other that are missing."""
        most = number = 0
        for tooth in range(2 * self.teeth):  # those beside the last are the first
            number = number + 1 if tooth % self.teeth in self.missing else 0
            most = max(most, number)
        return most

    def is_missing(self, teeth: Indices) -> NDArray[np.bool_]:
        """Whether teeth, as from `different`, are not there."""
        return np.isin(teeth, sorted(self.missing))

    def is_cracked(self, teeth: Indices) -> NDArray[np.bool_]:
        """Whether teeth have an open crack, of any number of turns."""
        return np.isin(teeth % self.teeth, sorted(self.cracked))

    def change_flank(self, flank: Any, tooth: int, lowest: float) -> None:
        """Change the record of a flank into that of a tooth; -1 for no fault.

        lowest : roll length of the lowest point of contact [m]
        """
        for n, spall in enumerate(self.spalls.get(tooth, ())):
            flank.spalls[n] = spall.start, spall.end, spall.share
        if tooth in self.profiles:
            profile = self.profiles[tooth]
            flank.profile = profile_record(profile, lowest, flank.tip_roll)
        if tooth in self.corners:
            break_tip(flank, self.corners[tooth])


def break_tip(flank: Any, roll: float) -> None:
    """End the record of a flank at a roll length [m]."""
    flank.corner_roll = roll
    flank.tip_arc = 0.5 * (flank.tip_roll**2 - roll**2) / flank.base_radius
