"""Base of studies of signals: what is sampled, of which gear, along which ramp."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from fegear.files.errors import InputError
from fegear.gearset.model import CARRIER, GearSet
from fegear.statics.excitation import ExcitationSource
from fegear.studies.settings import display_name, refusal, setting
from fegear.studies.trains.axes import written_limits
from fegear.studies.trains.models import ALL_MODELS, SPACE, lumped_model
from fegear.studies.trains.one_speed import OneSpeedProblem, OneSpeedStudy
from fegear.studies.trains.speeds import FREQUENCY, RPM, RPM_HELP, with_frequencies
from fegear.studies.trains.train_problem import MOTION_PERIODS
from fegear.studies.trains.turning_gears import (
    contacts_of,
    engagements_of,
    meshing_gears,
    tooth_at_pitch_point,
    turning_gear,
)
from fegear.train.model_settings import LumpedModel
from fegear.train.requirements import require_method
from lumped.common.options import Range
from lumped.signals.added_deflections import GearContacts
from lumped.signals.faulty_tooth import Engagement
from lumped.signals.orders import MIN_PULSES
from lumped.signals.ring_sensor import RingSensor, planet_passes
from lumped.signals.sampling import TURN_RTOL, Sampling, TurningGear
from lumped.signals.sensors import signal_names
from lumped.steady.integration_settings import Settings
from lumped.steady.ramps import SpeedRamp
from lumped.train.train import Train

# Steps per period of the fastest mesh, unless given: kinks of mesh forces between fewer
# steps change signals by 0.2 %, between these by 0.01 %
DEFAULT_STEPS = 256

MAX_SAMPLES = 5_000_000


def speed_or_ramp(text: str) -> float | tuple[float, float]:
    """A speed, or two A:B from one to the other."""
    try:
        start, *ends = map(float, text.split(":"))
        (end,) = ends or [math.nan]
    except ValueError:
        raise ValueError("must be a speed, or A:B from one to another") from None
    return (start, end) if ends else start


def written_ramp(speed: float | tuple[float, float]) -> str:
    """Text from which `speed_or_ramp` reads this speed or these."""
    return written_limits(speed if isinstance(speed, tuple) else (speed,))


def ramp_setting(text: str, allowed: Range) -> Any:
    """A setting of a speed, or of two between which it rises or falls."""
    how: dict[str, Any] = {"parse": speed_or_ramp, "write": written_ramp}
    return setting(None, text, allowed, metavar="A|A:B", **how)


@dataclass(frozen=True, kw_only=True)
class SampledTurns:
    """Which signals are sampled, and their noise."""

    gear_name: str = setting(
        "",
        "Name of the gear over whose turns signals are averaged. [default: driver of "
        "the first mesh]",
        option="--gear",
    )
    turns: int = setting(
        16, "Number of turns of the gear at constant speed.", Range(1, 10_000)
    )
    samples: int = setting(
        64, "Number of samples per mesh cycle of the gear.", Range(8, 1024)
    )
    noise_percent: float = setting(
        0.0,
        "Standard deviation of white noise, over that of each signal [%].",
        Range(0.0, 10_000.0, unit="%"),
    )
    seed: int = setting(0, "Seed of the noise.", Range(0, 2**32 - 1))


@dataclass(frozen=True, kw_only=True)
class SignalsStudy(SampledTurns, OneSpeedStudy):
    """Settings of signals of sensors at constant speed or through a ramp."""

    has_rolling = False

    speed: float | tuple[float, float] | None = ramp_setting(  # type: ignore[assignment]
        "Mesh frequency of the first mesh [Hz], or A:B from one to another at a "
        "constant rate; this or --rpm. [default: none]",
        FREQUENCY,
    )
    rpm: float | tuple[float, float] | None = ramp_setting(  # type: ignore[assignment]
        RPM_HELP.format("--speed").replace(" [rpm]", " [rpm], or A:B"), RPM
    )
    seconds: float | None = setting(
        None, "Duration of a ramp A:B [s]. [default: none]", Range(1e-6, 1e7, "s")
    )
    samples: int = setting(
        64,
        "Number of samples per mesh cycle of the gear, at the highest speed of a ramp.",
        Range(8, 1024),
    )
    pulses: int = setting(
        0,
        "Pulses per turn of a tachometer on the gear, from which its angle follows by "
        "cubic interpolation; 0 takes the angle of the nominal speed.",
        Range(0, 1024),
    )
    window: int = setting(
        4,
        "Turns of the gear in a window of the spectra over turns, or all turns if they "
        "are fewer.",
        Range(1, 10_000),
    )
    sensor_deg: float = setting(
        0.0,
        "Direction of the sensor on the ring of a planetary set at the start, "
        "counter-clockwise from x [degrees].",
        Range(-360.0, 360.0, unit="deg"),
    )
    sensor_window_deg: float | None = setting(
        None,
        "Angle over which the sensor on the ring feels a passing planet, full width of "
        "a Hann window [degrees]. [default: 360 over the number of planets]",
        Range(1.0, 360.0, unit="deg"),
    )
    model: LumpedModel = lumped_model(ALL_MODELS | SPACE)

    def __post_init__(self) -> None:
        super().__post_init__()
        seconds = display_name(self, "seconds")
        if self.is_ramp and self.seconds is None:
            raise InputError(f"{seconds} is missing; a ramp of the speed needs it")
        if not self.is_ramp and self.seconds is not None:
            raise InputError(f"{seconds} = {self.seconds:g}; needs a speed A:B")
        for name in ("speed", "rpm"):
            ends = getattr(self, name)
            if isinstance(ends, tuple) and ends[0] == ends[1]:
                shown = f"{display_name(self, name)} = {written_limits(ends)}"
                raise InputError(f"{shown}; the speeds of a ramp must differ")

    @property
    def is_ramp(self) -> bool:
        """Whether the speed rises or falls."""
        return isinstance(self.speed, tuple) or isinstance(self.rpm, tuple)

    @property
    def mesh_frequencies(self) -> tuple[float, float]:
        """Mesh frequencies of the first mesh at the start and at the end [Hz]."""
        speed = self.speed
        return speed if isinstance(speed, tuple) else (self.frequency, self.frequency)

    @property
    def frequency(self) -> float:
        """Mesh frequency of the first mesh at the start [Hz]."""
        if isinstance(self.speed, tuple):
            return self.speed[0]
        return super().frequency


@dataclass(frozen=True, eq=False)
class SampledProblem(OneSpeedProblem):
    """A train at one torque, at a speed or through a ramp, with the gear whose turns
    count.

    own_rate : samples per second, see `Sampling`
    """

    study: SignalsStudy
    own_rate: float | None = field(default=None, kw_only=True)

    @classmethod
    def of_study(
        cls,
        study: SignalsStudy,
        excitations: ExcitationSource | None = None,
        own_rate: float | None = None,
    ) -> Self:
        """The problem of a study, with tables that it shares with others.

        Parameters
        ----------
        study : SignalsStudy
            Settings, which are those of signals at one speed or through a ramp.
        excitations : ExcitationSource, optional
            Source of the tables; one of its own where it is None.
        own_rate : float, optional
            Samples per second [Hz]; None takes as many in every mesh cycle.

        Returns
        -------
        SampledProblem
            Problem whose signals are computed.

        Raises
        ------
        InputError
            If the gear is not there, or the model or the method has no signals.
        """
        speeds = {"speed": study.rpm, "from_speed": study.from_rpm}
        problem = cls.of(with_frequencies(study, speeds))
        if problem.model.friction:
            raise study.rejection("friction", "signals are without friction")
        method = study.integration.method
        require_method(method, problem.model, problem.gears, study.is_ramp)
        problem = replace(problem, excitations=excitations, own_rate=own_rate)
        require_sensor_settings(problem.gears, study)
        if problem.gears.carrier is not None and study.pulses:
            raise InputError(
                f"{display_name(study, 'pulses')} = {study.pulses}; a tachometer does "
                "not have the turns of planetary sets, which are against the carrier"
            )
        _ = problem.sampling  # refuses a gear that is not there
        return problem

    @property
    def integration(self) -> Settings:
        """Numerical settings of the motion, in enough steps for its signals."""
        settings: Settings = self.study.integration
        if self.model.number == "coupled":
            return settings
        return replace(settings, steps=settings.steps or DEFAULT_STEPS)

    @cached_property
    def turning(self) -> TurningGear:
        """The gear; InputError where it is not there."""
        gears, study = self.gears, self.study
        turning = turning_gear(gears, self.system.train, gear_index(gears, study))
        # the ring turns against the carrier as often as the carrier against the ring
        return replace(turning, name=study.gear_name or turning.name)

    @cached_property
    def sensor(self) -> RingSensor | None:
        """The sensor on the ring of a planetary set."""
        return ring_sensor(self.gears, self.system.train, self.study)

    @cached_property
    def sampling(self) -> Sampling:
        """How signals are sampled; InputError where they are too long or short."""
        study, turning = self.study, self.turning
        start, end = study.mesh_frequencies
        duration = study.seconds or study.turns / turning.turn_frequency(start)
        ramp = SpeedRamp(start=start, end=end, duration=duration)
        sampling = Sampling(
            *(turning, ramp, study.turns, study.samples, study.pulses),
            self.sensor,
            self.own_rate,
        )
        self._require_length(sampling)
        return sampling

    def _require_length(self, sampling: Sampling) -> None:
        """Refuse signals that are too long, or a ramp too short for a turn."""
        study, turning = self.study, sampling.gear
        name, value = "turns", f"{study.turns}"
        if study.is_ramp:
            name, value = "seconds", f"{study.seconds:g}"
        given_length = f"{display_name(study, name)} = {value}"
        turns = turning.turns(sampling.ramp.cycles)
        if turns < 1.0 - TURN_RTOL:
            raise InputError(
                f"{given_length}; {turning.name} turns {turns:.3g} times, 1 turn "
                "is needed"
            )
        if study.pulses and turns * study.pulses < MIN_PULSES:
            raise InputError(
                f"{given_length}; {display_name(study, 'pulses')} = {study.pulses} "
                f"makes {turns * study.pulses:.3g} pulses, {MIN_PULSES} or more "
                "are needed"
            )
        rate = sampling.refinement * sampling.rate
        samples = round(sampling.ramp.duration * rate)
        if samples > MAX_SAMPLES:
            raise InputError(
                f"{given_length}; {turning.teeth} teeth and "
                f"{study.samples} samples per mesh cycle make {samples} samples, at "
                f"most {MAX_SAMPLES} are allowed"
            )

    @property
    def motions(self) -> float:
        ramp = self.sampling.ramp
        return super().motions + ramp.cycles / MOTION_PERIODS * self.study.is_ramp

    @property
    def tooth_at_pitch_point(self) -> NDArray[np.int64]:
        """The gear's tooth (p,) nearest to its first mesh's pitch point, from 1."""
        return tooth_at_pitch_point(self.gears, self.turning, self.sampling.points)

    @property
    def engagements(self) -> dict[str, tuple[Engagement, ...]]:
        """Contact of the gear's teeth by signals, see `engagements_of`."""
        names = signal_names(self.system)
        return engagements_of(self.gears, self.turning, names)

    @property
    def contacts(self) -> GearContacts:
        """Contact of the gear's teeth over a turn."""
        return contacts_of(self.gears, self.turning)

    @property
    def other_contacts(self) -> list[GearContacts]:
        """Contact of the teeth of all other gears, each over its turn."""
        return [
            contacts_of(self.gears, turning_gear(self.gears, self.system.train, index))
            for index in meshing_gears(self.gears)
            if index != self.turning.index
        ]


def require_sensor_settings(gears: GearSet, study: SignalsStudy) -> None:
    """Refuse settings of the sensor on the ring where there is none."""
    if gears.carrier is not None:
        return
    for name in ("sensor_deg", "sensor_window_deg"):
        if getattr(study, name) != getattr(SignalsStudy, name):
            raise refusal(study, name, f"needs a planetary set, {gears.name} is none")


def ring_sensor(gears: GearSet, train: Train, study: SignalsStudy) -> RingSensor | None:
    """The sensor on the ring of a planetary set, None of others.

    train : of the set
    """
    if gears.carrier is None:
        return None
    width = study.sensor_window_deg or 360.0 / len(gears.carrier.planets)
    return RingSensor(
        passes=planet_passes(train),
        direction=math.radians(study.sensor_deg),
        width=math.radians(width),
    )


def gear_index(gears: GearSet, study: SignalsStudy) -> int:
    """Index of the gear of a study; InputError where it is not there."""
    meshing = meshing_gears(gears)
    names = [gears.gears[index].name for index in meshing]
    if gears.carrier is not None:
        meshing, names = [*meshing, gears.carrier.ring], [*names, CARRIER]
    if not study.gear_name:
        return gears.meshes[0].driver
    if study.gear_name not in names:
        raise InputError(
            f"{display_name(study, 'gear_name')} = {study.gear_name}; {gears.name} has "
            f"{', '.join(names)}"
        )
    return meshing[names.index(study.gear_name)]
