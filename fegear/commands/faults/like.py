"""Conditions of a recording, at which the runs of a set are computed."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Self

from fegear.files.codes import with_code
from fegear.files.errors import InputError
from fegear.gearset.lumped_train import train_of
from fegear.gearset.model import GearSet
from fegear.gearset.speeds import cycles_per_turn, driver_rpm, mesh_frequency
from fegear.studies.trains.recorded_rotation import (
    averaged_channels,
    channels_of,
    measured_cycles,
    require_turns,
    rotation_of,
)
from fegear.studies.trains.sampled_signals import gear_index
from fegear.studies.trains.turning_gears import turning_gear
from lumped.signals.noise_floor import MIN_TURNS, noise_floor
from lumped.signals.rotation import signals_over_angle

# of the power of a channel that is not noise; by a few per cent the noise is uncertain
MIN_SIGNAL = 0.1


@dataclass(frozen=True, kw_only=True)
class RecordedConditions:
    """Speed, sampling rate and noise of a recording.

    path : of the file; channel : whose noise it is
    rate : samples per second [Hz]
    rpm : mean speed of the first mesh's driver, in a planetary set of its input [rpm]
    rpm_range : lowest and highest speed [rpm]
    noise_percent : standard deviation of white noise over that of the rest [%]
    frequency : of the gear's first mesh [Hz]
    notes : on the recording, in sentences
    """

    path: str
    channel: str
    rate: float
    rpm: float
    rpm_range: tuple[float, float]
    noise_percent: float
    frequency: float
    notes: tuple[str, ...]

    @classmethod
    def of(cls, study: Any, gears: GearSet) -> Self:
        """Conditions of the recording of a study; InputError where it has none.

        study : with `RecordingSettings`, and a file by the name `like`
        """
        turning = turning_gear(gears, train_of(gears, 0.0), gear_index(gears, study))
        cycles = measured_cycles(study, gears, turning)
        recording = channels_of(study, study.like)
        channel = averaged_channels(study, recording)[0]
        driver_cycles, frequency = cycles_per_turn(gears), None
        if study.needs_speed:
            frequency = mesh_frequency(driver_cycles, study.rpm)
        rotation = rotation_of(study, recording, cycles, frequency).rotation
        require_turns(study.like, rotation, turning, cycles, MIN_TURNS)
        mean = rotation.turn_frequency
        ratio = cycles * turning.rate / turning.teeth
        gear_frequency = float(cycles * turning.rate) * mean
        points = turning.teeth * math.ceil(max(8.0, recording.rate / gear_frequency))
        values = recording.channels[channel]
        try:
            signal = signals_over_angle(
                recording.time, values[:, None], rotation, ratio, points
            )
            turns = len(signal.values) // signal.points
            seconds = turns / (float(ratio) * mean)
            noise = noise_floor(
                signal.values[:, 0], signal.points, recording.rate, seconds
            )
        except ValueError as error:
            raise InputError(f"{recording.source}: {channel}: {error}") from None
        power = float(values.var())
        rest = power - noise**2
        if rest <= MIN_SIGNAL * power:
            raise InputError(
                f"{recording.source}: {channel} is noise, more than "
                f"{100.0 * (1.0 - MIN_SIGNAL):g} % of its power"
            )
        rpm = driver_rpm(driver_cycles, float(cycles) * mean)
        slowest, fastest = rotation.speed_range
        return cls(
            path=study.like,
            channel=channel,
            rate=recording.rate,
            rpm=rpm,
            rpm_range=(rpm * slowest / mean, rpm * fastest / mean),
            noise_percent=100.0 * noise / math.sqrt(rest),
            frequency=gear_frequency,
            notes=recording.notes,
        )

    @property
    def entries(self) -> dict[str, Any]:
        """Entries of a summary."""
        return {
            "like": self.path,
            "channel": self.channel,
            "sampling_rate_Hz": self.rate,
            "speed_rpm": self.rpm,
            "noise_percent": self.noise_percent,
        }

    @property
    def sentence(self) -> str:
        """The sampling rate, the speed and the noise that all runs have."""
        slowest, fastest = self.rpm_range
        return (
            f"as in {self.path}: samples of {self.rate:.6g} Hz, {self.rpm:.6g} rpm "
            f"(mean of {slowest:.6g} to {fastest:.6g}), noise of {self.channel} "
            f"{self.noise_percent:.3g} %"
        )

    def warnings(self, gear: str) -> Iterator[str]:
        """Warnings where the runs cannot be as the recording."""
        if 2.0 * self.frequency > self.rate:
            yield with_code(
                "W72",
                f"{self.rate:g} Hz have frequencies below {0.5 * self.rate:g} Hz; the "
                f"first mesh of {gear} is at {self.frequency:.6g} Hz",
            )
