"""Labelled sets of signals of gear sets with faults, over sizes, speeds and loads."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import MISSING, dataclass
from itertools import product
from types import MappingProxyType
from typing import Any

import numpy as np

from fegear.commands.faults.axes import (
    FAULTS,
    WHOLE_NUMBERS,
    require_fault_axes,
)
from fegear.commands.faults.problem import FaultSignalsProblem
from fegear.files.data_sets import DATA_SETS
from fegear.files.errors import InputError
from fegear.files.output import TO_SINGLE_TABLE, listed
from fegear.files.recordings import RECORDING_FILE
from fegear.studies.settings import display_name, refusal, setting
from fegear.studies.study import Study
from fegear.studies.trains.axes import MAX_POINTS, parsed_axis, written_axis
from fegear.studies.trains.gear_sets import GearSetRef
from fegear.studies.trains.loads import torque_setting
from fegear.studies.trains.models import ALL_MODELS, lumped_integration, lumped_model
from fegear.studies.trains.recording_settings import RecordingSettings
from fegear.studies.trains.sampled_signals import (
    SampledTurns,
)
from fegear.studies.trains.speeds import RPM, refuse_both
from fegear.studies.trains.train_study import TrainStudy
from fegear.train.model_settings import LumpedModel
from lumped.common.options import Range
from lumped.steady.integration_settings import Settings
from lumped.steady.maps import Axis

OUTPUT_ENDINGS = (".csv", *DATA_SETS)
AXES_HELP = (
    "Axis of the set: N values from A to B, or values with commas, of speed (rpm of "
    "the first mesh's driver), torque_Nm, noise_percent, seed (for repetitions), "
    "tooth, a fault ({}) or a key of the gear set. Runs are all combinations; may be "
    "repeated."
)
LABELS_HELP = f"Write labels and indicators, a row for each run, {TO_SINGLE_TABLE}."


def _axes_setting() -> Any:
    conversions: dict[str, Any] = {"parse": parsed_axis, "write": written_axis}
    text = AXES_HELP.format(", ".join(FAULTS))
    return setting(MISSING, text, metavar="NAME=A:B:N", several=True, **conversions)


@dataclass(frozen=True, kw_only=True)
class FaultSignals(
    RecordingSettings,
    SampledTurns,
    TrainStudy,
    Study,
    command="faults",
    example="faults liu-pair --rpm 900 --over pitch_error=0:5:6 -o s.h5 --plot s.png",
):
    """Labelled data sets of signals of gears with faults.

    Signals as sensors give them, their averages over turns of the faulty gear and
    indicators, for every combination of fault sizes, speeds, torques and noise. The
    noise of each run has a seed of its own, which depends on its number and the seed of
    the set alone. With --output runs are stored in FILE.partial until the file is
    written; --resume continues from there.
    """

    resumes = True
    distributes = True
    unit = "run"
    endings = OUTPUT_ENDINGS
    output = (
        f"Write signals with their labels to this file, {listed(DATA_SETS)}, or labels "
        "and indicators alone, .csv."
    )
    more_tables = MappingProxyType({"labels": LABELS_HELP})

    gear_set: GearSetRef
    over: tuple[Axis, ...] = _axes_setting()
    random: int | None = setting(
        None,
        "Number of runs at random points instead of combinations: a Latin hypercube "
        "between the least and the largest value of each axis. [default: none]",
        Range(1, MAX_POINTS),
    )
    random_seed: int = setting(0, "Seed of the random points.", Range(0, 2**32 - 1))
    tooth: int = setting(
        1,
        "Number of the tooth of --gear that has the faults, counted from 1 as in "
        "pitch_errors_um.",
        Range(1, 10_000),
    )
    rpm: float | None = setting(
        None,
        "Rotational speed of the first mesh's driver [rpm]; this or the axis speed. "
        "[default: none]",
        RPM,
        metavar="RPM",
    )
    torque: float | None = torque_setting()
    like: str | None = setting(
        None,
        f"Recording of a measurement ({RECORDING_FILE}): runs have its sampling rate, "
        "its mean speed and the noise of its first channel. [default: none]",
        metavar="FILE",
        reads=True,
    )
    pulses: int = setting(
        1, "Pulses per turn of the tachometer of a recording.", Range(1, 1024)
    )
    averages: bool = setting(
        False, "Leave out the signals, and write their averages over turns alone."
    )
    model: LumpedModel = lumped_model(ALL_MODELS)
    integration: Settings = lumped_integration()

    def __post_init__(self) -> None:
        super().__post_init__()
        over = display_name(self, "over")
        if not self.over:
            raise InputError(f"{over} = 0; one axis or more is needed")
        require_fault_axes(self)
        self._require_speed(over)
        if self.run_count > MAX_POINTS:
            raise InputError(f"runs = {self.run_count}; at most {MAX_POINTS}")

        for name, reason in self._settings_without_effect():
            if name in self.axis_names:
                names = {key: display_name(self, key) for key in vars(self)}
                raise InputError(f"{over} {name}; {reason.format_map(names)}")
            if getattr(self, name) != type(self).__dataclass_fields__[name].default:
                raise refusal(self, name, reason)

    def _require_speed(self, over: str) -> None:
        """InputError where the speed is missing, or is there twice."""
        rpm = display_name(self, "rpm")
        if self.like is None:
            if self.rpm is None and "speed" not in self.axis_names:
                raise InputError(f"{rpm} RPM or {over} speed=A:B:N is needed")
            return
        like = f"{display_name(self, 'like')} = {self.like}"
        for name in {"speed", "noise_percent"} & set(self.axis_names):
            raise InputError(f"{over} {name}; {like} has it")
        refuse_both(self, "tacho", "speed_channel")
        if self.needs_speed and self.rpm is None:
            channels = [display_name(self, n) for n in ("tacho", "speed_channel")]
            raise InputError(f"{like}; {', '.join(channels)} or {rpm} is needed")

    def _settings_without_effect(self) -> Iterator[tuple[str, str]]:
        """Settings that would change nothing, with the reason."""
        if self.like is None:
            names = "channels", "tacho", "speed_channel", "rate"
            yield from ((name, "needs {like}") for name in names)
        else:
            yield "noise_percent", "{like} has noise of its own"
            if not self.needs_speed:
                rotation = "speed_channel" if self.tacho is None else "tacho"
                yield "rpm", f"{{{rotation}}} gives the speed"
        if self.tacho is None:
            yield "pulses", "needs {tacho}"
        if self.random is None:
            yield "random_seed", "needs {random}"
        if not self.has_faulty_tooth:
            yield "tooth", "needs a fault of a tooth among {over}"
        has_noise = self.noise_percent or self.like is not None
        if not has_noise and "noise_percent" not in self.axis_names:
            yield "seed", "needs {noise_percent}"

    @property
    def axis_names(self) -> list[str]:
        """Names of the axes."""
        return [axis.name for axis in self.over]

    @property
    def has_faulty_tooth(self) -> bool:
        """Whether an axis is the size of a fault of a tooth."""
        axes = [fault for name, fault in FAULTS.items() if name in self.axis_names]
        return not all(fault.is_of_gear for fault in axes)

    @property
    def run_count(self) -> int:
        """Number of runs."""
        sizes = [len(axis.values) for axis in self.over]
        return self.random or int(np.prod(sizes, dtype=object))

    def points(self) -> tuple[tuple[float, ...], ...]:
        """Values of the axes for each run.

        Returns
        -------
        tuple of tuple of float
            A value for each axis, in the order of the runs.
        """
        if self.random is None:
            return tuple(product(*(axis.values for axis in self.over)))
        return random_points(self.over, self.random, self.random_seed)

    def prepare(self) -> FaultSignalsProblem:
        return FaultSignalsProblem.of(self)


def random_points(
    axes: tuple[Axis, ...], count: int, seed: int
) -> tuple[tuple[float, ...], ...]:
    """Latin hypercube between the least and the largest values of axes."""
    from scipy.stats.qmc import LatinHypercube

    unit_points = LatinHypercube(len(axes), seed=np.random.default_rng(seed)).random(
        count
    )
    columns = []
    for axis, fractions in zip(axes, unit_points.T, strict=True):
        low, high = min(axis.values), max(axis.values)
        if axis.name in WHOLE_NUMBERS:
            columns.append(np.floor(low + fractions * (high + 1.0 - low)))
        else:
            columns.append(low + fractions * (high - low))
    return tuple(
        tuple(map(float, axis_values)) for axis_values in np.transpose(columns)
    )
