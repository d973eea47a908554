"""Spectra over speed: Campbell diagram, and harmonics of a mesh over speed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np

from lumped.common.array_types import Array
from lumped.figures.drawing import color_of, draw_legend, draw_title, panels
from lumped.steady.integration_settings import Settings
from lumped.steady.motion import spectrum
from lumped.steady.response import Status
from lumped.steady.steady_state import Speed
from lumped.steady.steppers import stepper_of
from lumped.steady.sweep import Branch

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SHOWN_HARMONICS = 6  # harmonics of a mesh that are drawn over speed
# Part of a mesh's largest amplitude below which lines are left out
MIN_RELATIVE_AMPLITUDE = 1e-4
MAX_RAYS = 40  # largest multiple of the mesh frequency that is drawn
MIN_AMPLITUDE = 1e-12  # m, scale of amplitudes without vibration
# Multiple of the highest natural frequency up to which lines are drawn
FREQUENCY_LIMIT_RATIO = 1.15
COLUMNS = (
    *("torque_Nm", "direction", "mesh_frequency_Hz", "mesh"),
    *("frequency_Hz", "order", "amplitude_m"),
)


@dataclass(frozen=True, eq=False)
class Lines:
    """Spectral lines of a motion that was recorded over periods of the first mesh.

    speed : frequency of the first mesh [Hz]
    amplitude : (n, m) amplitudes [m] at 0, 1, 2, ... over the time of those periods
    """

    speed: float
    periods: int
    amplitude: Array


@dataclass(frozen=True, eq=False)
class SpectraOverSpeed:
    """Spectral lines of the motions of a branch, in the order of its speeds.

    torque_Nm : torque on the input gear
    """

    torque_Nm: float
    branch: Branch
    lines: tuple[Lines, ...]

    @property
    def rates(self) -> tuple[Fraction, ...]:
        """Frequencies of the meshes over that of the first."""
        return self.branch.system.train.mesh_rates

    @property
    def speeds(self) -> list[float]:
        """Frequencies of the first mesh [Hz]."""
        return [lines.speed for lines in self.lines]

    def harmonic(self, order: int, mesh: int) -> Array:
        """Amplitudes (speeds,) [m] at a multiple of a mesh's frequency."""
        rows = [int(order * self.rates[mesh] * lines.periods) for lines in self.lines]
        row_lines = zip(rows, self.lines, strict=True)
        return np.array([lines.amplitude[place, mesh] for place, lines in row_lines])

    def seen(self, mesh: int) -> Iterator[tuple[float, float, float]]:
        """Speed [Hz], order and amplitude [m] of a mesh's lines that are not faint."""
        min_amplitude = MIN_RELATIVE_AMPLITUDE * self.largest(mesh)
        for lines in self.lines:
            amplitude = lines.amplitude[:, mesh]
            for index in 1 + np.flatnonzero(amplitude[1:] > min_amplitude):
                order = Fraction(int(index), lines.periods) / self.rates[mesh]
                yield lines.speed, float(order), float(amplitude[index])

    def largest(self, mesh: int) -> float:
        """Largest amplitude of a mesh [m]."""
        return max(float(lines.amplitude[1:, mesh].max()) for lines in self.lines)


def spectra_over_speed(
    torque: float, branch: Branch, settings: Settings | None = None
) -> SpectraOverSpeed:
    """Record again the steady motions of a branch, at a torque [N m]."""
    settings = settings or Settings()
    stepper = stepper_of(branch.system, settings)
    lines = []
    for response in branch.responses:
        if response.status == Status.DIVERGED:
            continue
        common_periods = response.multiple or max(
            1, settings.multiples // branch.system.repetitions
        )
        speed = Speed(response.frequency, settings)
        _, history = stepper.record(response.state, speed, common_periods)
        periods = common_periods * branch.system.common_period[0]
        lines.append(Lines(response.frequency, periods, spectrum(history)[1]))
    return SpectraOverSpeed(torque, branch, tuple(lines))


def spectra_rows(branches: Sequence[SpectraOverSpeed]) -> Iterator[tuple[Any, ...]]:
    """Cells of COLUMNS for every line of every mesh and speed."""
    for spectra in branches:
        for mesh, rate in enumerate(spectra.rates):
            for speed, order, amplitude in spectra.seen(mesh):
                labels = spectra.torque_Nm, spectra.branch.direction, speed, mesh + 1
                yield (*labels, order * float(rate) * speed, order, amplitude)


def draw_waterfall(branches: Sequence[SpectraOverSpeed], title: str = "") -> Figure:
    """Plot lines and harmonics of each mesh over speed, with a column per branch."""
    meshes = len(branches[0].branch.system.excitations)
    size = 2.0 + 6.0 * len(branches), 1.0 + 6.5 * meshes
    figure, rows = panels(2 * meshes, len(branches), size=size, heights=(3, 2) * meshes)
    for column, spectra in enumerate(branches):
        for mesh in range(meshes):
            lines, harmonics = (rows[2 * mesh + i][column] for i in range(2))
            largest = 1e6 * max(
                MIN_AMPLITUDE, *(other.largest(mesh) for other in branches)
            )
            _draw_lines(lines, spectra, mesh, largest)
            _draw_harmonics(harmonics, spectra, mesh)
            harmonics.set_ylim(0.0, 1.05 * largest)
            lines.sharex(harmonics)
            lines.set_title(
                f"mesh {mesh + 1}, {spectra.torque_Nm:g} N m, speed "
                f"{'rising' if spectra.branch.direction == 'up' else 'falling'}",
                fontsize=10,
                pad=16.0,
            )
    _draw_legend(figure)
    draw_title(figure, title)
    return figure


def _draw_lines(
    axes: Axes, spectra: SpectraOverSpeed, mesh: int, largest: float
) -> None:
    """Draw lines at their speed and frequency, with mesh-frequency multiples as rays.

    largest : largest amplitude of the colour scale [um]
    """
    from matplotlib.colors import LogNorm

    system, rate = spectra.branch.system, float(spectra.rates[mesh])
    highest = FREQUENCY_LIMIT_RATIO * float(system.resonances_Hz.max())
    _draw_rays(axes, rate, spectra.speeds, highest)
    for natural in system.resonances_Hz:
        axes.axhline(natural, color="tab:red", lw=0.8, ls="--")
    speed, order, amplitude = np.array(list(spectra.seen(mesh))).reshape(-1, 3).T
    rising = amplitude.argsort()  # the largest on top
    shown = axes.scatter(
        speed[rising],
        (order * rate * speed)[rising],
        14.0,
        1e6 * amplitude[rising],
        norm=LogNorm(MIN_RELATIVE_AMPLITUDE * largest, largest),
        cmap="viridis_r",
        zorder=3,
    )
    axes.figure.colorbar(shown, ax=axes, label="amplitude [um]")
    axes.set_ylim(0.0, highest)
    axes.set_ylabel("frequency of vibration [Hz]")


def _draw_rays(
    axes: Axes, rate: float, speeds: Sequence[float], highest: float
) -> None:
    """Draw multiples of a mesh's frequency, as far as they are in the plot."""
    low, high = min(speeds), max(speeds)
    for order in range(1, min(MAX_RAYS, int(highest / (rate * low))) + 1):
        end = min(high, highest / (order * rate))
        ray = order * rate * low, order * rate * end
        axes.plot((low, end), ray, color="0.8", lw=0.7, zorder=1)
        if order <= SHOWN_HARMONICS:
            axes.annotate(
                str(order),
                (end, ray[1]),
                xytext=(0.0, 4.0),
                textcoords="offset points",
                fontsize=8,
                ha="center",
            )


def _draw_harmonics(axes: Axes, spectra: SpectraOverSpeed, mesh: int) -> None:
    for order in range(1, SHOWN_HARMONICS + 1):
        amplitude = 1e6 * spectra.harmonic(order, mesh)
        axes.plot(spectra.speeds, amplitude, color=color_of(order - 1), lw=1.2)
    first = " of the first mesh" if len(spectra.branch.system.excitations) > 1 else ""
    axes.set_xlabel(f"mesh frequency{first} [Hz]")
    axes.set_ylabel("amplitude [um]")


def _draw_legend(figure: Figure) -> None:
    from matplotlib.lines import Line2D

    entries = [
        Line2D([], [], color=color_of(order - 1), label=f"harmonic {order}")
        for order in range(1, SHOWN_HARMONICS + 1)
    ]
    entries += [
        Line2D([], [], color="0.8", label="multiples of the mesh frequency"),
        Line2D([], [], color="tab:red", ls="--", label="natural frequencies"),
    ]
    draw_legend(figure, entries, 4)
