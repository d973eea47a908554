"""Rotation of a gear in a recording, by the settings of a study."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from fegear.files.errors import InputError
from fegear.files.recordings import Recording, read_recording
from fegear.gearset.model import CARRIER, GearSet
from fegear.gearset.planetary.members import Member
from fegear.gearset.speeds import SECONDS_PER_MINUTE
from fegear.studies.settings import display_name
from lumped.common.array_types import Array
from lumped.signals.rotation import (
    Rotation,
    constant_rotation,
    rotation_of_pulses,
    rotation_of_speed,
)
from lumped.signals.sampling import TurningGear
from lumped.signals.tachometer import PulseTrain, repaired_pulses, rising_edges

MAX_VALUES = 20_000_000  # of all channels that are averaged


@dataclass(frozen=True, eq=False)
class MeasuredRotation:
    """Rotation of the gear in a recording.

    source : what it follows from, in words
    pulses : of the tachometer; None without one
    """

    rotation: Rotation
    source: str
    pulses: PulseTrain | None = None


def channels_of(study: Any, path: str) -> Recording:
    """The channels of a file that are averaged, and the one that has the rotation.

    study : with `RecordingSettings`
    """
    rotation = [name for name in (study.tacho, study.speed_channel) if name]
    names = [*study.channels, *rotation] if study.channels else []
    rate_name = display_name(study, "rate")
    for name in ("tacho", "speed_channel"):
        channel = getattr(study, name)
        if channel is not None and channel in study.channels:
            raise InputError(
                f"{display_name(study, 'channels')} = {channel}; has the rotation, "
                f"{display_name(study, name)}"
            )
    recording = read_recording(path, names, study.rate, rate_name)
    for name in rotation:
        if name not in recording.channels:
            read_recording(path, [name], study.rate, rate_name)  # names what is there
    return recording


def averaged_channels(study: Any, recording: Recording) -> tuple[str, ...]:
    """Names of the channels but that of the rotation; InputError where none is left."""
    names = tuple(
        name
        for name in recording.channels
        if name not in (study.tacho, study.speed_channel)
    )
    if not names:
        raise InputError(f"{recording.source}: has no channel but that of the rotation")
    samples = recording.channels[names[0]].size
    if samples * len(names) > MAX_VALUES:
        option = display_name(study, "channels")
        raise InputError(
            f"{recording.source}: {len(names)} channels of {samples} samples; at most "
            f"{MAX_VALUES} values are averaged, choose some by {option}"
        )
    return names


def measured_cycles(study: Any, gears: GearSet, turning: TurningGear) -> Fraction:
    """Cycles of the first mesh per turn of the rotation that is measured.

    Of planetary sets that is the rotation of a member in space, where it is measured,
    and else the turn of the gear against the carrier.
    """
    carrier = gears.carrier
    if carrier is None or study.needs_speed:
        return turning.teeth / turning.rate
    members: dict[str, Member] = {
        CARRIER: "carrier",
        gears.gears[carrier.sun].name: "sun",
        gears.gears[carrier.ring].name: "ring",
    }
    member = members.get(turning.name)
    cycles = None if member is None else carrier.members.cycles_per_turn_of(member)
    if cycles is None:
        held = carrier.members.held
        allowed = [name for name, member in members.items() if member != held]
        raise InputError(
            f"{display_name(study, 'gear_name')} = {turning.name}; its rotation cannot "
            f"be measured, {' or '.join(allowed)} is needed"
        )
    return cycles


def rotation_of(
    study: Any,
    recording: Recording,
    cycles_per_turn: Fraction,
    mesh_frequency: float | None,
) -> MeasuredRotation:
    """Rotation of the gear; InputError where the channel has none.

    cycles_per_turn : of the first mesh, see `measured_cycles`
    mesh_frequency : of the first mesh where no channel has the rotation [Hz]
    """
    time = recording.time
    try:
        if study.tacho is not None:
            edges = rising_edges(time, recording.channels[study.tacho])
            pulses, per_turn = repaired_pulses(edges), study.pulses or 1
            source = f"by {per_turn} pulses per turn in {study.tacho}"
            rotation = rotation_of_pulses(pulses.time, per_turn)
            return MeasuredRotation(
                rotation, source.replace("1 pulses", "1 pulse"), pulses
            )
        if study.speed_channel is not None:
            rpm = recording.channels[study.speed_channel]
            _require_positive(rpm)
            source = f"by the speed in {study.speed_channel}"
            rotation = rotation_of_speed(time, rpm / SECONDS_PER_MINUTE)
            return MeasuredRotation(rotation, source)
    except ValueError as error:
        channel = study.tacho or study.speed_channel
        raise InputError(f"{recording.source}: {channel}: {error}") from None
    if mesh_frequency is None:
        raise ValueError("mesh_frequency is missing; no channel has the rotation")
    frequency = mesh_frequency / float(cycles_per_turn)
    rotation = constant_rotation(float(time[0]), float(time[-1]), frequency)
    return MeasuredRotation(rotation, "at constant speed")


def _require_positive(rpm: Array) -> None:
    wrong = ~(rpm > 0.0)
    if wrong.any():
        row = int(wrong.argmax())
        raise ValueError(
            f"{rpm[row]:g} rpm in sample {row + 1}, {int(wrong.sum())} such values; "
            "must be above 0"
        )


def require_turns(
    path: str,
    rotation: Rotation,
    turning: TurningGear,
    cycles_per_turn: Fraction,
    least: int = 1,
) -> None:
    """Raise InputError where a recording is shorter than some turns of a gear."""
    turns = rotation.total * float(cycles_per_turn * turning.rate / turning.teeth)
    if turns < least:
        needed = "1 turn is" if least == 1 else f"{least} turns are"
        raise InputError(
            f"{path}: {turning.name} turns {turns:.3g} times, {needed} needed"
        )
