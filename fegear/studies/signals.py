"""Signals of sensors on a gear set in motion, and their averages over turns."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fegear.files.errors import InputError
from fegear.files.output import TO_SINGLE_TABLE
from fegear.gearset.model import GearSet
from fegear.gearset.pitch_errors import tooth_in_cycles
from fegear.gearset.speeds import SECONDS_PER_MINUTE
from fegear.statics.excitation import ExcitationSource
from fegear.studies.columns import unit_of_column
from fegear.studies.motion import Motion, MotionProblem
from fegear.studies.page import Columns, Page, RowTable, number
from fegear.studies.study import Draw, Job, StudyResult, Task, display_name, setting
from fegear.studies.table import Table, finite_or_none
from fegear.studies.train_problem import TrainFacts
from fegear.studies.trains import SPRINGS, lumped_model, with_frequencies
from fegear.train.lumped_models import LumpedModel
from lumped.common.options import Range
from lumped.figures.turn_averages import AverageCurves, draw_turn_averages
from lumped.signals.averages import TurnAverage
from lumped.signals.sampling import Sampling, residual_indicators, sample_signals
from lumped.steady.settings import Settings

Array = NDArray[np.float64]
# Steps per period of the fastest mesh, unless given: kinks of mesh forces between fewer
# steps change signals by 0.2 %, between these by 0.01 %
DEFAULT_STEPS = 256
MAX_SAMPLES = 5_000_000
SHOWN_SIGNALS = 4  # in the picture
SCALES = {"m": (1e6, "um"), "rad/s": (1e3, "mrad/s"), "N": (1.0, "N")}
MORE_TABLES = MappingProxyType(
    {
        "average": "Write the averages over a turn of the gear and their residuals "
        f"{TO_SINGLE_TABLE}.",
        "spectrum": "Write the amplitudes of the averages at the orders of the gear "
        f"{TO_SINGLE_TABLE}.",
    }
)


@dataclass(frozen=True, kw_only=True)
class SampledTurns:
    """Which signals are sampled, and their noise."""

    gear_name: str = setting(
        "",
        "Name of the gear over whose turns signals are averaged. [default: driver of "
        "the first mesh]",
        option="--gear",
    )
    turns: int = setting(16, "Number of turns of the gear.", Range(1, 10_000))
    samples: int = setting(64, "Number of samples per mesh cycle.", Range(8, 1024))
    noise_percent: float = setting(
        0.0,
        "Standard deviation of white noise, over that of each signal [%].",
        Range(0.0, 10_000.0, unit="%"),
    )
    seed: int = setting(0, "Seed of the noise.", Range(0, 2**32 - 1))


@dataclass(frozen=True, kw_only=True)
class Signals(
    SampledTurns,
    Motion,
    command="signals",
    example="signals my-pair.toml --rpm 900 --noise-percent 10 --plot s.png",
):
    """Signals of sensors, their averages over turns and sidebands.

    Transmission errors, deviations of angular speeds and bearing forces, averaged over
    the turns of a gear: sidebands of the mesh, and the tooth that differs from others.
    """

    more_tables = MORE_TABLES
    has_rolling = False

    model: LumpedModel = lumped_model(SPRINGS, 1)

    def prepare(self) -> SignalsProblem:
        return self.prepare_with(None)

    def prepare_with(self, excitations: ExcitationSource | None) -> SignalsProblem:
        """The problem, with tables that it shares with others.

        Parameters
        ----------
        excitations : ExcitationSource or None
            Source of the tables; one of its own where it is None.

        Returns
        -------
        SignalsProblem
            Problem whose signals are computed.

        Raises
        ------
        InputError
            If the gear is not there, or the model has no signals.
        """
        speeds = {"speed": self.rpm, "from_speed": self.from_rpm}
        problem = SignalsProblem.of(with_frequencies(self, speeds))
        if problem.model.number == "coupled" or problem.model.friction:
            name = "friction" if self.model.friction else "number"
            raise self.rejection(name, "signals are of models 1 to 3 without friction")
        problem = replace(problem, excitations=excitations)
        _ = problem.turning  # refuses a gear that is not there
        return problem


@dataclass(frozen=True)
class TurningGear:
    """A gear by its turns.

    index, mesh : of the gear and of its first mesh, from 0
    rate : cycles of that mesh per cycle of the first mesh
    phase : of that mesh at the start; where it is whole, a tooth is at the pitch point
    orders : cycles per turn of the gear whose multiples are those of meshes
    """

    index: int
    name: str
    teeth: int
    mesh: int
    rate: Fraction
    phase: float
    orders: tuple[int, ...]

    def turn_frequency(self, mesh_frequency: float) -> float:
        """Turns per second at a frequency of the first mesh [Hz]."""
        return mesh_frequency * float(self.rate) / self.teeth


@dataclass(frozen=True, eq=False)
class SignalsProblem(MotionProblem):
    """A train at one torque and speed, with the gear whose turns count."""

    study: Signals

    @property
    def integration(self) -> Settings:
        """Numerical settings of the motion, in enough steps for its signals."""
        settings: Settings = self.study.integration
        return replace(settings, steps=settings.steps or DEFAULT_STEPS)

    @cached_property
    def turning(self) -> TurningGear:
        """The gear; InputError where it is not there or signals are too long."""
        gears, study = self.gears, self.study
        if gears.carrier is not None:
            raise InputError(f"{gears.name}: planetary sets have no signals here")
        index = _gear_index(gears, study)
        teeth = gears.gears[index].geometry.teeth
        samples = study.turns * teeth * study.samples
        if samples > MAX_SAMPLES:
            raise InputError(
                f"{display_name(study, 'turns')} = {study.turns}; {teeth} teeth and "
                f"{study.samples} samples per mesh cycle make {samples} samples, at "
                f"most {MAX_SAMPLES} are allowed"
            )
        train = self.system.train
        rates = train.mesh_rates
        mesh = next(m for m, one in enumerate(gears.meshes) if index in one.gears)
        # a multiple that is no whole order is not in an average
        orders = {(teeth * rate / rates[mesh]).numerator for rate in rates}
        return TurningGear(
            index=index,
            name=gears.gears[index].name,
            teeth=teeth,
            mesh=mesh,
            rate=rates[mesh],
            phase=train.meshes[mesh].phase,
            orders=tuple(sorted(orders)),
        )

    def tasks(self) -> Iterator[Task]:
        yield Task("signals", self._measured)

    def _measured(self, job: Job) -> SignalsResult:
        """The signals; DivergedError where the motion has no bound."""
        study, turning = self.study, self.turning
        motion, _ = self.settled_motion(job)
        if not motion.response.multiple:
            raise InputError(
                f"the motion at {study.frequency:g} Hz does not repeat; signals are "
                "those of one that does"
            )
        sampling, noise = self.sampling, 0.01 * study.noise_percent
        sampled = sample_signals(
            motion.system, motion.history, sampling, noise, study.seed
        )
        return SignalsResult(
            study,
            self.facts(self.single_torque, motion, ()),
            self.single_torque,
            turning,
            sampling.time,
            sampled.names,
            sampled.values,
            sampled.average,
            self.tooth_at_pitch_point,
            self.turns_of_motion(motion.response.multiple),
        )

    @property
    def sampling(self) -> Sampling:
        """How signals are sampled over the turns of the gear."""
        study, turning = self.study, self.turning
        frequency = turning.turn_frequency(study.frequency)
        per_turn = turning.teeth * study.samples
        return Sampling(study.turns, per_turn, frequency, turning.orders)

    def turns_of_motion(self, multiple: int) -> int:
        """Turns of the gear after which the motion repeats.

        multiple : number of common periods after which it does
        """
        turning = self.turning
        cycles = multiple * self.system.common_period[turning.mesh]
        return Fraction(cycles, turning.teeth).numerator

    @property
    def tooth_at_pitch_point(self) -> NDArray[np.int64]:
        """The gear's tooth (p,) at the pitch point of its first mesh, from 1."""
        turning, points = self.turning, self.sampling.points
        position = turning.phase + turning.teeth * np.arange(points) / points
        cycle = np.floor(position + 0.5).astype(np.int64)
        return 1 + tooth_in_cycles(self.gears, turning.mesh, turning.index, cycle)


def _gear_index(gears: GearSet, study: Signals) -> int:
    """Index of the gear of a study; InputError where it is not there."""
    meshing = sorted({gear for mesh in gears.meshes for gear in mesh.gears})
    names = [gears.gears[index].name for index in meshing]
    if not study.gear_name:
        return gears.meshes[0].driver
    if study.gear_name not in names:
        raise InputError(
            f"{display_name(study, 'gear_name')} = {study.gear_name}; {gears.name} has "
            f"{', '.join(names)}"
        )
    return meshing[names.index(study.gear_name)]


@dataclass(frozen=True, eq=False, repr=False)
class SignalsResult(StudyResult):
    """Signals at equal steps of time, and their averages over turns of a gear.

    torque : on the input gear [N m]
    gear : over whose turns signals are averaged
    time : (t,) [s]
    names : of the c signals, with their units
    values : (t, c) samples
    average : over the turns
    tooth : (p,) of the gear at the pitch point of its first mesh, from 1
    turns_of_motion : of the gear, after which the motion repeats
    """

    study: Signals
    facts: TrainFacts
    torque: float
    gear: TurningGear
    time: Array
    names: tuple[str, ...]
    values: Array
    average: TurnAverage
    tooth: NDArray[np.int64]
    turns_of_motion: int

    @cached_property
    def summary(self) -> dict[str, Any]:
        study, turn_frequency = self.study, self._turn_frequency
        return {
            **self.facts.summary,
            "torque_Nm": self.torque,
            "speed_Hz": study.frequency,
            "gear": self.gear.name,
            "gear_speed_rpm": SECONDS_PER_MINUTE * turn_frequency,
            "turns": self.average.turns,
            "motion_repeats_turns": self.turns_of_motion,
            "sampling_rate_Hz": turn_frequency * self.gear.teeth * study.samples,
            "noise_percent": study.noise_percent,
            "mesh_orders": list(self.gear.orders),
            "signals": [self._entry(c) for c in range(len(self.names))],
            "warnings": list(self.facts.warnings),
        }

    @property
    def _turn_frequency(self) -> float:
        return self.gear.turn_frequency(self.study.frequency)

    @cached_property
    def _indicators(self) -> Mapping[str, Array]:
        return residual_indicators(self.average, self.tooth)

    def _entry(self, c: int) -> dict[str, Any]:
        """What the average of a signal tells, in the unit at the end of its name."""
        average, has_residual = self.average, bool(self.average.has_residual[c])
        amplitude = average.amplitude[:, c]
        orders = np.arange(amplitude.size)
        of_mesh = np.any([orders % order == 0 for order in average.orders], axis=0)
        sidebands = np.where(of_mesh, 0.0, amplitude)
        indicators = {name: float(v[c]) for name, v in self._indicators.items()}
        return {
            "signal": self.names[c],
            "unit": unit_of_column(self.names[c]),
            "mesh_amplitude": float(amplitude[1:][of_mesh[1:]].max()),
            "sideband_amplitude": float(sidebands.max()),
            "sideband_order": int(sidebands.argmax()) if has_residual else None,
            "residual_rms": indicators["residual_rms"],
            "residual_peak": indicators["residual_peak"],
            "residual_kurtosis": finite_or_none(indicators["residual_kurtosis"]),
            "residual_peak_angle_deg": finite_or_none(
                360.0 * float(average.peak_turn[c])
            ),
            "tooth": int(indicators["tooth"]) if has_residual else None,
        }

    @property
    def _header(self) -> dict[str, str]:
        study = self.study
        return {
            **self.facts.header,
            "gear": self.gear.name,
            "turns": str(self.average.turns),
            "noise [%]": f"{study.noise_percent:g}, seed {study.seed}",
        }

    @property
    def table(self) -> Table:
        """A row for every sample."""
        turns = self.time * self._turn_frequency
        columns = {"time_s": self.time, "turns_of_gear": turns}
        return Table.of(columns | self._columns(self.values), self._header)

    def _columns(self, values: Array, prefix: str = "") -> dict[str, Array]:
        return {f"{prefix}{name}": values[:, c] for c, name in enumerate(self.names)}

    @property
    def more_tables(self) -> dict[str, Table]:
        """A row for every angle of the average, and for every order."""
        average, teeth = self.average, self.gear.teeth
        points, order = len(average.values), np.arange(len(average.amplitude))
        harmonic = np.floor(order / teeth + 0.5).astype(int)
        over_turn = {
            "angle_deg": 360.0 * np.arange(points) / points,
            "tooth": self.tooth,
            **self._columns(average.values),
            **self._columns(average.residual, "residual_"),
        }
        over_order = {
            "order": order,
            "frequency_Hz": order * self._turn_frequency,
            "mesh_harmonic": harmonic,
            "sideband": order - harmonic * teeth,
            **self._columns(average.amplitude),
        }
        return {
            "average": Table.of(over_turn, self._header),
            "spectrum": Table.of(over_order, self._header),
        }

    @property
    def figures(self) -> dict[str, Draw]:
        """Average, residual and spectrum of the first signals."""
        return {"plot": self._picture}

    def _picture(self) -> Any:
        curves = [self._curves(c) for c in range(len(self.names))[:SHOWN_SIGNALS]]
        noise = self.study.noise_percent
        title = f"{self._title}{f', {noise:g} % noise' if noise else ''}"
        angle = np.arange(len(self.tooth)) / len(self.tooth)
        start = 1.0 + self.gear.phase % self.gear.teeth
        tooth = start + self.gear.teeth * angle
        return draw_turn_averages(curves, tooth, self.gear.orders, title)

    def _curves(self, c: int) -> AverageCurves:
        average, name = self.average, self.names[c]
        scale, unit = SCALES[unit_of_column(name)]
        values = scale * average.values[:, c]
        return AverageCurves(
            name=f"{_label(name)}\n[{unit}]",
            average=values - values.mean(),
            residual=scale * average.residual[:, c],
            amplitude=scale * average.amplitude[:, c],
            has_residual=bool(average.has_residual[c]),
        )

    @property
    def _title(self) -> str:
        values = self.summary
        return (
            f"{values['gear_set']} at {values['speed_Hz']:g} Hz and "
            f"{self.torque:g} N m, model {values['model']}, {values['excitation']}: "
            f"{self.average.turns} turns of {self.gear.name} at "
            f"{values['gear_speed_rpm']:.5g} rpm"
        )

    def page(self) -> Page:
        values = self.summary
        yield from self.facts.notes
        yield self._title
        yield RowTable(values["signals"], SIGNAL_COLUMNS, "averages over a turn")
        if self.average.turns % self.turns_of_motion:
            yield (
                f"the motion repeats after {self.turns_of_motion} turns; averages over "
                "other numbers of turns, but their multiples, contain a part of other "
                "meshes and gears"
            )


def _label(name: str) -> str:
    """Name of a signal without its unit, in words."""
    for suffix in ("_m", "_rad_per_s", "_N"):
        name = name.removesuffix(suffix)
    for short, text in (("_dte", ": transmission error"), ("_speed", ": speed")):
        name = name.replace(short, text)
    return name.replace("_", " ")


def _scaled(name: str) -> Callable[[Any], str]:
    """The cell of a value in the unit that is shown."""
    return lambda row: number(SCALES[row["unit"]][0] * row[name], 3)


def _tooth_text(row: Any) -> str:
    return "none" if row["tooth"] is None else str(row["tooth"])


def _kurtosis_text(row: Any) -> str:
    kurtosis = row["residual_kurtosis"]
    return "none" if kurtosis is None else number(kurtosis, 3)


SIGNAL_COLUMNS: Columns = {
    "signal": lambda row: _label(row["signal"]),
    "unit": lambda row: SCALES[row["unit"]][1],
    "at orders\nof meshes": _scaled("mesh_amplitude"),
    "largest\nsideband": _scaled("sideband_amplitude"),
    "largest\nresidual": _scaled("residual_peak"),
    "at tooth": _tooth_text,
    "kurtosis of\nresidual": _kurtosis_text,
}
