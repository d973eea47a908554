"""Settings of a recording: its channels, and how its gear turns."""

from __future__ import annotations

from dataclasses import dataclass

from fegear.studies.settings import setting
from lumped.common.options import Range


def channel_names(text: str) -> tuple[str, ...]:
    """Names of channels that a text lists with commas."""
    names = tuple(name.strip() for name in text.split(","))
    if not all(names):
        raise ValueError("must be names of channels with commas between them")
    return names


@dataclass(frozen=True, kw_only=True)
class RecordingSettings:
    """Which channels of a recording are read, and which has the rotation."""

    channels: tuple[str, ...] = setting(
        (),
        "Channels of the recording, with commas. [default: all but those of the "
        "rotation]",
        metavar="A,B",
        parse=channel_names,
        write=",".join,
    )
    tacho: str | None = setting(
        None,
        "Channel with the pulses of a tachometer on --gear, --pulses per turn or 1. "
        "[default: none]",
        metavar="CHANNEL",
    )
    speed_channel: str | None = setting(
        None,
        "Channel with the speed of --gear over time [rpm]. [default: none]",
        metavar="CHANNEL",
    )
    rate: float | None = setting(
        None,
        "Sampling rate of a recording without times [Hz]. [default: that of the file]",
        Range(above=0.0, below=1e9, unit="Hz"),
    )

    @property
    def needs_speed(self) -> bool:
        """Whether the speed is a setting, and follows from nothing else."""
        return self.tacho is None and self.speed_channel is None
