"""Signals of a recording, averaged over turns as computed ones are."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any, Self

import numpy as np

from fegear.commands.signals.entries import MAX_HARMONIC, GearAverages
from fegear.commands.signals.measured_result import MeasuredResult
from fegear.commands.signals.separated import SeparatedGear, separated_gears
from fegear.files.codes import with_code
from fegear.files.errors import InputError
from fegear.files.recordings import Recording
from fegear.gearset.lumped_train import train_of
from fegear.gearset.model import GearSet
from fegear.gearset.power_path import input_torques
from fegear.studies.problem import Job, Problem, Task
from fegear.studies.trains.recorded_rotation import (
    MeasuredRotation,
    averaged_channels,
    channels_of,
    measured_cycles,
    require_turns,
    rotation_of,
)
from fegear.studies.trains.sampled_signals import (
    SampledProblem,
    gear_index,
    require_sensor_settings,
    ring_sensor,
)
from fegear.studies.trains.speeds import with_frequencies
from fegear.studies.trains.turning_gears import (
    engagements_of,
    meshing_gears,
    tooth_at_pitch_point,
    turning_gear,
)
from lumped.signals.averages import TurnAverage
from lumped.signals.indicators import band_limited, na4, window_averages
from lumped.signals.orders import order_map
from lumped.signals.ring_sensor import RingSensor
from lumped.signals.rotation import SignalsOverAngle, signals_over_angle
from lumped.signals.sampling import TurningGear

# RMS of the places of pulses, in mesh cycles, at which 5 % of the mesh's lines are lost
MAX_PULSE_ERROR = 0.05


@dataclass(frozen=True, eq=False)
class MeasuredProblem(Problem):
    """A recording of a gear set, and the signals that are computed beside it.

    turning : gears that mesh, by their turns; shown : index among them of the gear
        whose rotation is measured
    cycles_per_turn : of the first mesh, per turn of the rotation that is measured
    names : of the channels that are averaged
    sensor : on the ring of a planetary set, None of others
    computed : None where nothing is
    notes : on the recording, in sentences
    """

    study: Any
    gears: GearSet
    turning: tuple[TurningGear, ...]
    shown: int
    recording: Recording
    rotation: MeasuredRotation
    cycles_per_turn: Fraction
    names: tuple[str, ...]
    sensor: RingSensor | None
    computed: SampledProblem | None
    notes: tuple[str, ...]

    @classmethod
    def of_study(cls, study: Any, computed: type[SampledProblem]) -> Self:
        """The problem of a study; InputError for a recording that is none of its gears.

        computed : class of the problem of computed signals
        """
        gears = study.gear_set.loaded
        require_sensor_settings(gears, study)
        index = gear_index(gears, study)
        train = train_of(gears, 0.0)
        turning = [turning_gear(gears, train, i) for i in meshing_gears(gears)]
        shown = [gear.index for gear in turning].index(index)
        if study.gear_name:
            turning[shown] = replace(turning[shown], name=study.gear_name)
        cycles = measured_cycles(study, gears, turning[shown])
        recording = channels_of(study, study.measured)
        at_speed = with_frequencies(study, {"speed": study.rpm})
        frequency = at_speed.frequency if study.needs_speed else None
        rotation = rotation_of(study, recording, cycles, frequency)
        require_turns(study.measured, rotation.rotation, turning[shown], cycles)
        mesh_frequency = float(cycles) * rotation.rotation.turn_frequency
        beside, notes = _computed_beside(study, computed, mesh_frequency)
        return cls(
            study,
            gears=gears,
            turning=tuple(turning),
            shown=shown,
            recording=recording,
            rotation=rotation,
            cycles_per_turn=cycles,
            sensor=ring_sensor(gears, train, study),
            names=averaged_channels(study, recording),
            computed=beside,
            notes=(*recording.notes, *notes),
        )

    @property
    def announcements(self) -> Iterator[str]:
        if self.computed is None:
            yield from self.study.announcements
        else:
            yield from self.computed.announcements

    def tasks(self) -> Iterator[Task]:
        yield Task("measured", self._measured)
        if self.computed is not None:
            yield from self.computed.tasks()

    def gather(self, results: Mapping[str, Any]) -> MeasuredResult:
        """The result of the recording, with that of the computed signals."""
        measured: MeasuredResult = results["measured"]
        return replace(measured, computed=results.get("signals"))

    def _measured(self, job: Job) -> MeasuredResult:
        """The result of the recording alone."""
        rotation, pulses = self.rotation.rotation, self.rotation.pulses
        shown, averages = self.turning[self.shown], list[GearAverages]()
        signals = self._over_angle(shown)
        for number, gear in enumerate(self.turning):
            job.report("averages", number, len(self.turning))
            if gear is shown:
                averages.append(self._averages(gear, signals))
            elif rotation.total * float(self._ratio(gear)) >= 1.0:
                averages.append(self._averages(gear, self._over_angle(gear)))
        turns = len(signals.values) // signals.points
        window = min(int(self.study.window), turns)
        highest = MAX_HARMONIC * shown.teeth
        ratio, (slowest, fastest) = float(self._ratio(shown)), rotation.speed_range
        return MeasuredResult(
            study=self.study,
            gear_set=self.gears.name,
            averages=tuple(averages),
            shown=[one.gear.index for one in averages].index(shown.index),
            sampling_rate=self.recording.rate,
            duration=float(self.recording.time[-1] - self.recording.start),
            turns=rotation.total * ratio,
            mean_speed=rotation.turn_frequency * ratio,
            speed_range=(slowest * ratio, fastest * ratio),
            rotation_source=self.rotation.source,
            repaired_pulses=(pulses.dropped, pulses.doubled) if pulses else None,
            pulse_scatter=pulses.scatter if pulses else None,
            orders=order_map(signals.values, signals.points, window, highest),
            notes=self.notes,
            warnings=tuple(self._warnings(shown)),
            sensor=self.sensor,
            separated=self._separated(),
        )

    def _separated(self) -> dict[str, tuple[SeparatedGear, ...]]:
        """Averages of each channel over the teeth that pass the sensor on the ring."""
        sensor = self.sensor
        if sensor is None:
            return {}
        ring = next(gear for gear in self.turning if gear.index == sensor.passes.ring)
        # of a recording that is shorter than a turn of the carrier nothing is averaged
        samples, values = int(self.study.samples), np.empty((0, len(self.names)))
        if self.rotation.rotation.total * float(self._ratio(ring)) >= 1.0:
            signals = self._over_angle(ring)
            samples, values = signals.points // ring.teeth, signals.values
        train = train_of(self.gears, 0.0)
        return {
            name: tuple(separated_gears(self.gears, train, sensor, channel, samples))
            for name, channel in zip(self.names, values.T, strict=True)
        }

    def _ratio(self, gear: TurningGear) -> Fraction:
        """Turns of a gear per turn of the rotation that is measured."""
        return self.cycles_per_turn * gear.rate / gear.teeth

    def _over_angle(self, gear: TurningGear) -> SignalsOverAngle:
        values = np.stack([self.recording.channels[n] for n in self.names], axis=1)
        points = gear.teeth * self.study.samples
        arguments = self.rotation.rotation, self._ratio(gear), points
        try:
            return signals_over_angle(self.recording.time, values, *arguments)
        except ValueError as error:
            raise InputError(f"{self.recording.source}: {error}") from None

    def _averages(self, gear: TurningGear, signals: SignalsOverAngle) -> GearAverages:
        """Averages over the turns of a gear, and over windows of them."""
        points = gear.teeth * self.study.samples
        turns = len(signals.values) // signals.points
        average = window_averages(signals.values, signals.points, turns)[0]
        window = min(int(self.study.window), turns)
        windows = window_averages(signals.values, signals.points, window)
        return GearAverages(
            gear=gear,
            names=self.names,
            average=TurnAverage(band_limited(average, points), turns, gear.orders),
            na4=na4(band_limited(windows, points), gear.orders),
            tooth=tooth_at_pitch_point(self.gears, gear, points),
            engagements=engagements_of(self.gears, gear, self.names),
        )

    def _warnings(self, shown: TurningGear) -> Iterator[str]:
        """Warnings of the recording."""
        pulses, rate = self.rotation.pulses, self.recording.rate
        cycles = float(self.cycles_per_turn * shown.rate)
        mesh = cycles * self.rotation.rotation.turn_frequency
        if 2.0 * mesh > rate:
            yield with_code(
                "W72",
                f"{rate:g} Hz have frequencies below {0.5 * rate:g} Hz; the first mesh "
                f"of {shown.name} is at {mesh:.6g} Hz",
            )
        if pulses is not None and pulses.dropped + pulses.doubled:
            yield with_code(
                "W73",
                f"{self.study.tacho}: of {pulses.time.size} pulses {pulses.dropped} "
                f"were missing, {pulses.doubled} too many",
            )
        if pulses is not None:
            error = cycles * pulses.error / self.rotation.rotation.pulses
            if error > MAX_PULSE_ERROR:
                yield with_code(
                    "W74",
                    f"{self.study.tacho}: pulses are off equal angles by {error:.2g} "
                    f"mesh cycles of {shown.name}",
                )


def _computed_beside(
    study: Any,
    problem: type[SampledProblem],
    mesh_frequency: float,
) -> tuple[SampledProblem | None, tuple[str, ...]]:
    """The problem of signals at a mean speed, and why there is none.

    mesh_frequency : of the first mesh [Hz]
    """
    if not study.computed:
        return None, ()
    gears = study.gear_set.loaded
    if study.torque is None and not input_torques(gears):
        note = f"{gears.name} has no load case: signals are computed with a torque"
        return None, (note,)
    alone = dict.fromkeys(("measured", "tacho", "speed_channel", "rate", "rpm"))
    at_mean = replace(
        study,
        **alone,
        channels=(),
        pulses=0,
        speed=mesh_frequency,
    )
    return problem.of_study(at_mean), ()
