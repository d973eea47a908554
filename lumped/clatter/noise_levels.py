"""Noise of the wheels of a gearbox: squared approach speeds and energy per time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lumped.clatter.groups import WheelGroup
from lumped.clatter.impact_runs import Impacts


@dataclass(frozen=True)
class PlayNoise:
    """Noise of a play of a wheel.

    impacts : number of impacts
    level : sum of squared approach speeds per time [m2/s3]
    power : energy dissipated by the impacts per time [W]
    """

    wheel: str
    play: str
    impacts: int
    level: float
    power: float
    fastest: float


def noise_of(group: WheelGroup, impacts: Impacts, seconds: float) -> list[PlayNoise]:
    """Noise of each play of a group, over a time [s]."""
    noises = []
    for number, (wheel, name) in enumerate(group.plays):
        of_play = impacts.play == number
        speed = impacts.speed[of_play]
        noises.append(
            PlayNoise(
                *(wheel.name, name, int(of_play.sum())),
                level=float(np.sum(speed**2)) / seconds,
                power=float(np.sum(impacts.lost[of_play])) / seconds,
                fastest=float(speed.max(initial=0.0)),
            )
        )
    return noises
