"""Signals of sensors on a gear set in motion, and their averages over turns."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from types import MappingProxyType
from typing import Any

import numpy as np

from fegear.commands.signals.entries import MAX_HARMONIC
from fegear.commands.signals.measured import MeasuredProblem
from fegear.commands.signals.measured_settings import MeasuredSettings
from fegear.commands.signals.result import SignalsResult
from fegear.commands.signals.separated import SeparatedGear, separated_gears
from fegear.files.errors import InputError
from fegear.files.output import (
    HDF5,
    INTO_PICTURE,
    TABLE_FORMATS,
    TABLES,
    TO_SINGLE_TABLE,
    listed,
)
from fegear.gearset.pitch_errors import pair_periods
from fegear.studies.problem import Job, Task
from fegear.studies.study import PLOT
from fegear.studies.trains.sampled_signals import SampledProblem, SignalsStudy
from lumped.signals.indicators import na4, window_averages
from lumped.signals.orders import order_map
from lumped.signals.ring_sensor import FORCE
from lumped.signals.sampling import SampledSignals, sample_signals
from lumped.signals.tooth_verdict import tooth_of_run
from lumped.steady.motion import DivergedError, bounded_response
from lumped.steady.steady_state import Diverged
from lumped.steady.truncation_check import check_truncation

MORE_TABLES = MappingProxyType(
    {
        "average": "Write the averages over a turn of the gear and their residuals "
        f"{TO_SINGLE_TABLE}.",
        "spectrum": "Write the amplitudes of the averages at the orders of the gear "
        f"{TO_SINGLE_TABLE}.",
        "orders": "Write the spectra over windows of turns, by orders of the gear, "
        f"{TO_SINGLE_TABLE}.",
        "separated": "Write the averages of the sensor on the ring over the teeth of "
        f"the sun and of each planet, of a planetary set, {TO_SINGLE_TABLE}.",
    }
)


@dataclass(frozen=True, kw_only=True)
class Signals(
    MeasuredSettings,
    SignalsStudy,
    command="signals",
    example="signals my-pair.toml --rpm 900 --noise-percent 10 --plot s.png",
):
    """Signals of sensors, their averages over turns and sidebands.

    Transmission errors, deviations of angular speeds and bearing forces, averaged over
    the turns of a gear: sidebands of the mesh, and the tooth that differs from others.
    At constant speed, or through a ramp of the speed with order tracking. A recording
    of a measurement is averaged alike, and shown beside signals at its mean speed. A
    sensor on the ring of a planetary set tells which planet is damaged.
    """

    endings = (*TABLES, HDF5)
    output = f"Write the results to this file, {listed((*TABLE_FORMATS, HDF5))}."
    more_tables = MORE_TABLES
    pictures = PLOT | {
        "order_map": f"Draw the spectra over speed and orders {INTO_PICTURE}; with a "
        "ramp of the speed or a recording.",
        "separated_plot": "Draw the averages of the sensor on the ring over the teeth "
        f"of the sun and of each planet {INTO_PICTURE}; of a planetary set.",
    }

    def unused_options(self, outputs: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
        for name in ("separated", "separated_plot"):
            if name in outputs and self.gear_set.loaded.carrier is None:
                yield name, "needs a planetary set"
        if self.measured is not None:
            return
        if self.is_ramp:
            if self.turns != type(self).turns:
                yield "turns", "a ramp lasts {seconds}"
        else:
            yield "order_map", "needs {speed} A:B"

    def prepare(self) -> SignalsProblem | MeasuredProblem:
        if self.measured is not None:
            return MeasuredProblem.of_study(self, SignalsProblem)
        return SignalsProblem.of_study(self)


@dataclass(frozen=True, eq=False)
class SignalsProblem(SampledProblem):
    """Signals of a train at one torque, at a speed or through a ramp."""

    study: Signals

    def tasks(self) -> Iterator[Task]:
        yield Task("signals", self._measure_signals)

    def _measure_signals(self, job: Job) -> SignalsResult:
        """The signals; DivergedError where the motion has no bound."""
        study, sampling = self.study, self.sampling
        state, observer = self.start_state(job)
        response, _, settings = bounded_response(
            self.system, study.frequency, self.integration, state, observer.callback
        )
        if not (study.is_ramp or response.multiple):
            raise InputError(
                f"the motion at {study.frequency:g} Hz does not repeat; signals are "
                "those of one that does"
            )
        checks = check_truncation(
            self.system, [response], self.integration, observer.callback
        )
        noise = 0.01 * study.noise_percent
        try:
            sampled = sample_signals(
                self.system, response, settings, sampling, noise, study.seed
            )
        except Diverged as error:
            frequency = float(sampling.ramp.frequency_at(np.array(error.part)))
            raise DivergedError(frequency, error.part) from None
        window = min(study.window, sampled.average.turns)
        highest = MAX_HARMONIC * sampling.gear.teeth
        windows = window_averages(sampled.over_angle, sampling.points, window)
        return SignalsResult(
            study=study,
            facts=self.facts(self.single_torque, response, checks),
            torque=self.single_torque,
            gear=sampling.gear,
            ramp=sampling.ramp,
            time=sampled.time,
            names=sampled.names,
            values=sampled.values,
            average=sampled.average,
            orders=order_map(sampled.over_angle, sampling.points, window, highest),
            na4=na4(windows, sampling.gear.orders),
            tooth=self.tooth_at_pitch_point,
            engagements=self.engagements,
            turns_of_motion=self._turns_of_motion(response.multiple or 1),
            teeth_differ=max(pair_periods(self.gears)) > 1,
            sensor=self.sensor,
            separated=self._separated(sampled),
            verdict=tooth_of_run(
                *(self.system, sampled, sampling),
                *(self.contacts, self.other_contacts),
            ),
        )

    def _separated(self, sampled: SampledSignals) -> tuple[SeparatedGear, ...]:
        """Averages of the ring's sensor over the teeth that pass it."""
        if self.sensor is None:
            return ()
        signal = sampled.over_angle[:, sampled.names.index(FORCE)]
        arguments = self.system.train, self.sensor, signal, self.sampling.samples
        return tuple(separated_gears(self.gears, *arguments))

    def _turns_of_motion(self, multiple: int) -> int:
        """Turns of the gear after which the motion repeats.

        multiple : number of common periods after which it does
        """
        turning = self.turning
        cycles = multiple * self.system.common_period[turning.mesh]
        if self.sensor is not None:  # planets pass the sensor in a turn of the ring
            cycles = math.lcm(cycles, self.sensor.passes.teeth)
        return Fraction(cycles, turning.teeth).numerator
