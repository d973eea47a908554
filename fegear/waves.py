"""The settled motion of a gear set's lumped train at one speed."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np

from fegear.boundary import public, require_frequencies
from fegear.gearset.model import GearSet
from fegear.headings import friction_in_words, friction_of, sliding_of, torque_of
from fegear.lumped_models import (
    LumpedModel,
    body_entries,
    doubts_of_bodies,
    file_header,
    integration_in_words,
    lumped_system,
    require_method,
)
from fegear.output import write_text
from fegear.result import Result
from fegear.studies.responses import UNITS
from fegear.unphysical import doubts_of_meshes
from lumped.csv_text import exact
from lumped.figures import draw_time_history
from lumped.losses import driven_power
from lumped.motion import (
    TimeHistory,
    arrive,
    speeds_between,
    time_history,
    wave_csv,
)
from lumped.progress import Progress, silent
from lumped.response import FIGURES
from lumped.settings import Settings
from lumped.sweep import reporting

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LINES = 5  # largest ones of a spectrum, in the summary


@dataclass(frozen=True, eq=False, repr=False)
class SettledMotion(Result):
    """A motion over time and the header of its file."""

    gear_set: GearSet
    header: Mapping[str, str]
    motion: TimeHistory

    @property
    def summary(self) -> dict[str, Any]:
        """Plain values, ready for JSON."""
        header, motion, response = self.header, self.motion, self.motion.response
        doubts = [
            *doubts_of_bodies(motion.system, [response.frequency]),
            *doubts_of_meshes(
                self.gear_set.meshes,
                f" at {float(header['torque_Nm']):g} N m",
                *(response.dte_peak, response.back_side),
            ),
        ]
        return {
            "gear_set": header["gear set"],
            "model": header["model"],
            "excitation": header["excitation"],
            "damping_ratio": float(header["damping ratio"]),
            "friction_coefficient": friction_of(header),
            "sliding": sliding_of(header),
            "torque_of": torque_of(header),
            "torque_Nm": float(header["torque_Nm"]),
            "speed_Hz": float(response.frequency),
            "status": str(response.status),
            "settling_time_s": float(response.settling_time),
            "shown_time_s": float(motion.history.time[-1]),
            "section_points": len(motion.section_rate),
            "meshes": [_mesh_summary(motion, m) for m in range(len(motion.pairs))],
            "warnings": doubts,
        }

    def to_csv(self, path: str | PathLike[str]) -> None:
        """Write the motion with its header, a row for every time."""
        write_text(path, wave_csv(self.motion, self.header))

    def draw(self) -> Figure:
        """Time history, tooth pairs, phase plane and spectrum."""
        header = self.header
        title = (
            f"{header['gear set']} at {self.motion.response.frequency:g} Hz and "
            f"{float(header['torque_Nm']):g} N m, model {header['model']}, "
            f"{header['excitation']}, damping ratio {float(header['damping ratio']):g}"
            f"{friction_in_words(friction_of(header), sliding_of(header))}"
        )
        return draw_time_history(self.motion, title)


@public
def settle_motion(
    gear_set: GearSet,
    torque: float,
    speed: float,
    model: LumpedModel | None = None,
    integration: Settings | None = None,
    from_speed: float | None = None,
    progress: Progress = silent,
) -> SettledMotion:
    """Time history, tooth pairs, section and spectrum of the settled motion.

    torque : on the input gear [N m]
    speed : mesh frequency of the first mesh [Hz]
    from_speed : the same at which the motion settles first, to be followed from there;
        None for the speed itself, from rest
    Raises DivergedError.
    """
    model, integration = model or LumpedModel(), integration or Settings()
    require_method(model, integration)
    start = speed if from_speed is None else from_speed
    require_frequencies("speed", [speed])
    require_frequencies("from_speed", [start])
    progress("stiffness", 0, 1)
    system = lumped_system(gear_set, torque, model, speeds=[start, speed])
    observer = reporting(progress, len(speeds_between(start, speed)))
    state = arrive(system, start, speed, integration, observer)
    motion = time_history(system, speed, integration, state, watch=observer.watch)
    words, ratio = (
        integration_in_words(integration, model.number == "coupled"),
        system.train.damping_ratio,
    )
    header = file_header(gear_set, model, ratio, words) | {
        **body_entries(system, [start, speed]),
        "model": model.name,
        "torque_Nm": exact(torque),
        "speed_Hz": exact(speed),
    }
    return SettledMotion(gear_set, header, motion)


def _mesh_summary(motion: TimeHistory, m: int) -> dict[str, Any]:
    response, pairs = motion.response, motion.pairs[m]
    figures = {
        UNITS[name]: float(getattr(response, name)[m])
        for name in FIGURES
        if name in UNITS
    }
    return {
        "mesh": m + 1,
        "period_multiple": int(response.period_multiple[m]),
        **figures,
        "engaged_pairs": sorted({int(count) for count in pairs.count}),
        "contact_conditions": dict(pairs.conditions),
        **_losses(motion, m),
        "largest_lines": _largest_lines(motion, m),
    }


def _losses(motion: TimeHistory, m: int) -> dict[str, float]:
    """What friction takes from a mesh over the motion; empty without friction."""
    system, history = motion.system, motion.history
    if not system.rubs:
        return {}
    lost = motion.friction_power[:, m]
    span = history.time[-1] - history.time[0]
    mean = float(np.trapezoid(lost, history.time) / span)
    carried = driven_power(system, m, motion.response.frequency)
    return {
        "friction_power_mean_W": mean,
        "friction_power_largest_W": float(lost.max()),
        "efficiency": 1.0 - mean / carried if carried > 0.0 else math.nan,
    }


def _largest_lines(motion: TimeHistory, m: int) -> list[dict[str, float]]:
    """The largest lines of the spectrum by falling amplitude, without the mean."""
    order = 1 + motion.spectrum[1:, m].argsort(kind="stable")[::-1][:LINES]
    places = motion.spectrum_frequency[order], motion.spectrum[order, m]
    return [
        {"frequency_Hz": float(frequency), "amplitude_m": float(amplitude)}
        for frequency, amplitude in zip(*places, strict=True)
    ]
