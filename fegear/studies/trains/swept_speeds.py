"""Speeds that a study sweeps, and branches of which nothing is computed."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

from fegear.files.errors import InputError
from fegear.files.speed_ranges import written_speeds
from fegear.studies.settings import display_name, setting
from fegear.studies.trains.speeds import refuse_both, rpms_setting, speeds_setting
from lumped.steady.sweep import DIRECTIONS, Branch, Direction
from lumped.train.system import LumpedSystem


@dataclass(frozen=True, kw_only=True)
class SweptSpeeds:
    """Speeds, and the order in which they are passed."""

    speeds: tuple[float, ...] = speeds_setting(
        (),
        "Mesh frequencies of the first mesh [Hz]; a number, or several with commas, as "
        "well. [default: 0.5 to 1.3 times the resonances]",
    )
    rpm: tuple[float, ...] = rpms_setting("--speeds")
    direction: Literal["up", "down", "both"] = setting(
        "both", "Whether the speed rises, falls, or first rises and then falls."
    )

    def __post_init__(self) -> None:
        super().__post_init__()  # type: ignore[misc]
        refuse_both(self, "speeds", "rpm")
        for name in ("speeds", "rpm"):
            self._require_rising(name)

    def _require_rising(self, name: str) -> None:
        """Refuse speeds that fall, as the direction orders them."""
        speeds = getattr(self, name)
        if len(speeds) > 1 and all(b < a for a, b in pairwise(speeds)):
            shown = f"{display_name(self, name)} = {written_speeds(speeds)}"
            falling_speeds = f"{display_name(self, 'direction')} down"
            raise InputError(
                f"{shown}; must rise; {falling_speeds} passes them from the highest "
                "to the lowest"
            )
        # others in rising order, each once, as they are passed
        object.__setattr__(self, name, tuple(sorted(set(speeds))))

    @property
    def directions(self) -> tuple[Direction, ...]:
        """The directions of the speed, in order."""
        return DIRECTIONS if self.direction == "both" else (self.direction,)


def unbegun_branch(system: LumpedSystem, direction: Direction) -> Branch:
    """A branch of which Ctrl-C left nothing."""
    return Branch(system, direction, (), complete=False)
