"""Spectra of settled motions."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from fegear.dynamics.stepper import DynamicSettings
from lumped.common.array_types import Array
from lumped.common.progress import Progress
from lumped.steady.integration_settings import Settings
from lumped.steady.motion import DivergedError, spectrum
from lumped.steady.steady_state import Speed, Stepper
from lumped.steady.steppers import stepper_of
from lumped.steady.sweep import SweepPoint, continue_sweep
from validation.commands.reproduce.computations.finite_elements import element_stepper
from validation.commands.reproduce.parts import Curve, Part, PartResult
from validation.commands.reproduce.scene import Scene
from validation.study.data_files import Flag, Speeds, few_speeds, parsed_speeds

HIGH, LOW = 0.05, 1e-4  # of the largest amplitude: high peaks, and all


@dataclass(frozen=True, kw_only=True)
class SpectraPart(Part):
    """Amplitude of the dynamic transmission error over frequency, a panel a speed.

    speeds : in the unit of the figure, passed in their order
    periods : common periods that are recorded
    up_to : largest frequency that is drawn, in the unit of the figure
    elements : of the finite elements, else of the lumped model
    """

    keys: ClassVar = (r"speed\d+\.mesh[12]\.(peaks|highest|lowest)",)
    no_command: ClassVar = "fegear motion comes from one speed, not by way of several"

    kind: Literal["spectra"] = "spectra"
    speeds: Speeds
    periods: Annotated[int, Field(strict=True, ge=8, le=4096)] = 128
    up_to: Annotated[float, Field(gt=0.0, lt=1e3)] = 6.0
    elements: Flag = False

    def quick(self) -> Self:
        return replace(self, speeds=few_speeds(self.speeds, 2), periods=8)


def spectra(part: SpectraPart, scene: Scene, report: Progress) -> PartResult:
    """Values of speedN., speeds counted from 1:

    peaks : frequencies of peaks above a twentieth of the highest, in the unit of the
        figure; highest : that of the highest one; lowest : of all, the first
    """
    unit, values = scene.unit_Hz, parsed_speeds(part.speeds)
    stepper, settings = _stepper(part, scene)
    done = 0

    def station(value: float) -> SweepPoint:
        nonlocal done
        report("spectra", done, len(values))
        done += 1
        return stepper, unit * value

    responses, complete = continue_sweep(values, station, settings)
    if not complete:
        raise DivergedError(responses[-1].frequency, responses[-1].settling_time)
    curves: list[Curve] = []
    quantities: dict[str, tuple[float, ...]] = {}
    for number, (value, response) in enumerate(
        zip(values, responses, strict=True), start=1
    ):
        at = Speed(response.frequency, settings)
        _, history = stepper.record(response.state, at, part.periods)
        frequency, amplitudes = spectrum(history)
        for mesh in scene.meshes:
            amplitude = amplitudes[:, mesh - 1]
            shown = frequency <= unit * part.up_to
            points = np.stack([frequency / unit, 1e6 * amplitude], axis=1)[shown]
            rows = tuple((float(x), float(y)) for x, y in points[1:])
            panel = f"mesh frequency {value:g}"
            curves.append(Curve("line", rows, mesh, panel=panel))
            start = f"speed{number}.mesh{mesh}"
            for name, places in (
                ("peaks", _peaks(amplitude, HIGH)),
                ("highest", [1 + amplitude[1:].argmax()]),
                ("lowest", _peaks(amplitude, LOW)[:1]),
            ):
                quantities[f"{start}.{name}"] = tuple(
                    (frequency[places] / unit).tolist()
                )
    return PartResult(tuple(curves), quantities)


def _stepper(
    part: SpectraPart, scene: Scene
) -> tuple[Stepper, Settings | DynamicSettings]:
    if not part.elements:
        return stepper_of(scene.system, Settings()), Settings()
    settings = DynamicSettings()
    speeds = [scene.unit_Hz * value for value in parsed_speeds(part.speeds)]
    return element_stepper(scene, speeds, settings), settings


def _peaks(amplitude: Array, part: float) -> NDArray[np.int64]:
    """Places higher than their neighbours and than a part of the highest."""
    inner = amplitude[1:-1]
    high = inner > part * amplitude[1:].max()  # at 0 is the mean
    high &= (inner > amplitude[:-2]) & (inner >= amplitude[2:])
    return np.flatnonzero(high) + 1
