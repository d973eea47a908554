"""Plots of sweeps and motions; functions of a result, drawn without a screen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from lumped.common.array_types import Array
from lumped.figures.drawing import color_of, draw_legend, draw_title, panels
from lumped.steady.jumps import find_jumps, opposite_branches
from lumped.steady.motion import TimeHistory, resample
from lumped.steady.sweep import Branch
from lumped.train.system import LumpedSystem

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# wide lines under narrow ones, so that pairs with equal forces are both visible;
# in other colours than those of states
TOOTH_LINES = (("tab:orange", 3.4), ("tab:pink", 2.4), ("tab:blue", 1.4))
STATE_COLORS = {1: "tab:green", 0: "tab:red", -1: "tab:purple"}
STATE_NAMES = {1: "drive side", 0: "contact lost", -1: "back side"}
SHOWN_PERIODS = 8  # periods of a mesh in the panels over time
SHOWN_ORDERS = 10  # orders of a mesh in its spectrum
PHASE_PLANE_REFINEMENT = 4  # refinement of the integration steps in the phase plane
# Dots of one direction are inside of the squares of the other where both coincide
UP_STYLE: dict[str, Any] = {"ls": "-", "marker": "o", "ms": 2.6}
DOWN_STYLE: dict[str, Any] = {"ls": "--", "marker": "s", "ms": 5.0, "mfc": "none"}
# Part of the largest line below which a spectrum is not drawn
MIN_RELATIVE_AMPLITUDE = 1e-5


@dataclass(frozen=True)
class ResponseCurve:
    """Branch and its torque on the input gear [N m].

    model : model named in the legend if curves of several models are drawn together
    """

    torque_Nm: float
    branch: Branch
    model: str = ""

    @property
    def name(self) -> str:
        return ", ".join(filter(None, (f"{self.torque_Nm:g} N m", self.model)))


def draw_sweep(
    curves: Sequence[ResponseCurve],
    title: str = "",
    natural: str = "natural frequency",
    natural_Hz: Sequence[float] | None = None,
) -> Figure:
    """Plot the RMS of the dynamic transmission error over speed for each mesh.

    natural : label of the lines at resonances in the legend
    natural_Hz : natural frequencies of these lines, by default those of the system
    """
    system = curves[0].branch.system
    meshes = len(system.excitations)
    lines_at = system.resonances_Hz if natural_Hz is None else natural_Hz
    figure, rows = panels(meshes, size=(9.0, 1.2 + 3.4 * meshes), share=True)
    names = list(dict.fromkeys(curve.name for curve in curves))
    others = [_opposite(curve, curves) for curve in curves]
    marks: set[str] = set()
    for m, (axes,) in enumerate(rows):
        for curve, other in zip(curves, others, strict=True):
            color = color_of(names.index(curve.name))
            marks |= _draw_branch(axes, curve, other, m, color)
        axes.set_ylabel(f"mesh {m + 1}: RMS of dynamic\ntransmission error [um]")
        axes.set_ylim(bottom=0.0)
        axes.margins(x=0.01)
        if _mark_resonances(axes, system, m, lines_at):
            marks.add("resonance")
    rows[-1][0].set_xlabel(_speed_label(system))
    directions: set[str] = {curve.branch.direction for curve in curves}
    _legend_of_sweep(figure, names, directions, natural, marks)
    draw_title(figure, title)
    return figure


def _opposite(curve: ResponseCurve, curves: Sequence[ResponseCurve]) -> Branch | None:
    """Branch of the same model and torque that was passed in the other direction.

    Finite elements and the lumped model compared with them refer to the same system.
    """
    same = [other.branch for other in curves if other.name == curve.name]
    return opposite_branches([curve.branch, *same])[0]


def _speed_label(system: LumpedSystem) -> str:
    first = " of the first mesh" if len(system.excitations) > 1 else ""
    return f"mesh frequency{first} [Hz]"


def _draw_branch(
    axes: Axes, curve: ResponseCurve, other: Branch | None, m: int, color: str
) -> set[str]:
    """Draw a branch; return the marks that it needs in the legend."""
    branch, marks = curve.branch, set[str]()
    if not branch.responses:
        return marks
    frequency, up = branch.frequency_Hz, branch.direction == "up"
    rms = 1e6 * branch.column("dte_rms")[:, m]
    style: dict[str, Any] = UP_STYLE | {"mfc": color} if up else DOWN_STYLE
    axes.plot(frequency, rms, color=color, lw=1.0, mew=0.7, **style)
    lost = branch.column("contact_loss")[:, m] > 0.0
    axes.fill_between(frequency, rms, where=lost, color=color, alpha=0.12, lw=0.0)
    if lost.any():
        marks.add("loss")
    for jump in find_jumps(branch, other):
        if jump.mesh == m + 1:
            _draw_jump(axes, jump.frequency_from, jump.frequency_to, rms, frequency)
            marks.add("jump")
    return marks


def _draw_jump(
    axes: Axes, start: float, end: float, rms: Array, frequency: Array
) -> None:
    ends = [(f, rms[frequency == f][0]) for f in (start, end)]
    arrow = {"arrowstyle": "-|>", "color": "black", "lw": 1.3, "shrinkA": 0.0}
    axes.annotate("", xy=ends[1], xytext=ends[0], arrowprops=arrow, zorder=5)


def _mark_resonances(
    axes: Axes, system: LumpedSystem, m: int, natural_Hz: Sequence[float] | Array
) -> bool:
    """Draw thin lines at first-mesh frequencies at which a mesh excites a mode.

    Returns whether there are any.
    """
    any_drawn = False
    rates = sorted({float(rate) for rate in system.train.mesh_rates}, reverse=True)
    low, high = axes.get_xlim()
    for natural in natural_Hz:
        for rate in rates:
            frequency = natural / rate
            if not low < frequency < high:
                continue
            axes.axvline(frequency, color="0.4", lw=0.7, ls="-" if rate == 1.0 else ":")
            any_drawn = True
            if m == 0:
                name = f"{natural:.0f} Hz"
                if rate != 1.0:
                    name += f" / {rate:.3g}"
                axes.text(
                    frequency,
                    1.01,
                    name,
                    transform=axes.get_xaxis_transform(),
                    ha="center",
                    fontsize=8,
                    color="0.3",
                )
    return any_drawn


def _legend_of_sweep(
    figure: Figure,
    names: Sequence[str],
    directions: set[str],
    natural: str,
    marks: set[str],
) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    entries: list[Any] = [
        Line2D([], [], color=color_of(i), label=name) for i, name in enumerate(names)
    ]
    plain: dict[str, Any] = {"color": "black", "lw": 1.0, "mew": 0.7}
    for direction, style in (("up", UP_STYLE), ("down", DOWN_STYLE)):
        if direction in directions:
            label = f"speed {direction}"
            if directions == {"up", "down"} and direction == "down":
                label += " (dot inside: both)"
            entries.append(Line2D([], [], label=label, **plain, **style))
    if "loss" in marks:
        entries.append(Patch(color="0.85", label="contact lost in part"))
    if "jump" in marks:
        jump = Line2D([], [], color="black", marker=">", lw=1.3, label="jump")
        entries.append(jump)
    if "resonance" in marks:
        entries.append(Line2D([], [], color="0.4", lw=0.7, label=natural))
    draw_legend(figure, entries, min(len(entries), 6))


SPRINGS = "start", "middle", "end"  # of the face width, where springs are


def draw_time_history(motion: TimeHistory, title: str = "") -> Figure:
    """Plot deflection, forces, contact, phase plane and spectrum of each mesh."""
    meshes, heights = len(motion.pairs), (1.0, 1.3, 0.6, 1.5, 1.0)
    size = (1.5 + 5.5 * meshes, 13.5)
    figure, rows = panels(5, meshes, size=size, heights=heights)
    columns = zip(*rows, strict=True)
    for m, (error, force, state, plane, lines) in enumerate(columns):
        _draw_over_time(motion, m, (error, force, state))
        _draw_phase_plane(plane, motion, m)
        _draw_spectrum(lines, motion, m)
        error.set_title(f"mesh {m + 1}", fontsize=10)
    _legend_of_states(figure, motion)
    draw_title(figure, title)
    return figure


def _draw_over_time(
    motion: TimeHistory, m: int, shown_in: tuple[Axes, Axes, Axes]
) -> None:
    history, pairs = motion.history, motion.pairs[m]
    frequency = _mesh_frequency(motion, m)
    periods = history.time * frequency
    shown = periods <= SHOWN_PERIODS + 1e-6
    x = periods[shown]
    error, force, state = shown_in
    error.plot(x, 1e6 * history.deflection[shown, m], "k", lw=1.0)
    error.set_ylabel("dynamic transmission\nerror [um]")
    _draw_teeth(force, motion, m, shown)
    force.plot(x, 1e-3 * history.force[shown, m], "k", lw=1.0)
    force.set_ylabel("force [kN]")
    force.set_ylim(top=1.2 * force.get_ylim()[1])
    _legend_of_forces(force, _is_in_space(motion))
    _draw_states(state, x, pairs.state[shown], pairs.in_mesh[shown])
    if _is_in_space(motion):
        state.set_yticklabels(SPRINGS)
    for axes in shown_in:
        axes.set_xlim(0.0, x[-1])
    left = "" if shown.all() else f", of {periods[-1]:.0f}"
    state.set_xlabel(f"time [periods of this mesh, {1e3 / frequency:.4g} ms{left}]")


def _draw_teeth(
    axes: Axes, motion: TimeHistory, m: int, shown: NDArray[np.bool_]
) -> None:
    """Draw the force of every pair of teeth on its path through the mesh.

    After each cycle a pair takes the place of the one ahead of it.
    """
    pairs = motion.pairs[m]
    periods = motion.history.time[shown] * _mesh_frequency(motion, m)
    phase = motion.system.train.meshes[m].phase
    cycle = np.floor(periods + phase + 1e-9).astype(int)
    if _is_in_space(motion):  # springs stay where they are
        cycle = np.zeros_like(cycle)
    force = np.where(pairs.in_mesh[shown], 1e-3 * pairs.force[shown], np.nan)
    rows, columns = np.arange(cycle.size), force.shape[1]
    for tooth in range(cycle[0] - columns + 1, cycle[-1] + 1):
        column = cycle - tooth
        inside = (column >= 0) & (column < columns)
        tooth_force = np.where(
            inside, force[rows, np.clip(column, 0, columns - 1)], np.nan
        )
        style = tooth % len(TOOTH_LINES)
        color, width = TOOTH_LINES[style]
        axes.plot(periods, tooth_force, color=color, lw=width)


def _is_in_space(motion: TimeHistory) -> bool:
    return motion.system.space is not None


def _legend_of_forces(axes: Axes, is_in_space: bool) -> None:
    """The colours that tooth pairs have in turn, or springs, and that of their sum."""
    from matplotlib.legend_handler import HandlerTuple
    from matplotlib.lines import Line2D

    pairs = [Line2D([], [], color=color, lw=lw) for color, lw in TOOTH_LINES]
    parts, names = [tuple(pairs)], ["tooth pairs in turn"]
    if is_in_space:
        # the column of a spring is the negative of its tooth
        parts, names = [(pairs[-p % len(pairs)],) for p in range(3)], [*SPRINGS]
    axes.legend(
        [*parts, Line2D([], [], color="black", lw=1.0)],
        [*names, "mesh"],
        handler_map={tuple: HandlerTuple(ndivide=None)},
        handlelength=4.0,
        fontsize=8,
        ncols=2,
        loc="upper right",
    )


def _mesh_frequency(motion: TimeHistory, m: int) -> float:
    return motion.response.frequency * float(motion.system.train.mesh_rates[m])


def _draw_states(
    axes: Axes,
    x: Array,
    state: NDArray[np.int64],
    in_mesh: NDArray[np.bool_],
) -> None:
    """Draw a lane for each pair, coloured while it is in mesh."""
    pairs = state.shape[1]
    for p in range(pairs):
        for value, color in STATE_COLORS.items():
            inside = (state[:-1, p] == value) & in_mesh[:-1, p]
            bars = [(x[i], x[i + 1] - x[i]) for i in np.flatnonzero(inside)]
            axes.broken_barh(bars, (p + 0.6, 0.8), color=color, lw=0.0)
    axes.set_ylim(0.4, pairs + 0.6)
    axes.set_yticks(range(1, pairs + 1), [f"pair {p + 1}" for p in range(pairs)])


def _draw_phase_plane(axes: Axes, motion: TimeHistory, m: int) -> None:
    time = motion.history.time
    fine = np.linspace(time[0], time[-1], PHASE_PLANE_REFINEMENT * time.size)
    deflection, rate = resample(motion.history, fine)
    axes.plot(1e6 * deflection[:, m], 1e3 * rate[:, m], color="0.6", lw=0.8)
    points = len(motion.section_rate)
    axes.plot(
        1e6 * motion.section_deflection[:, m],
        1e3 * motion.section_rate[:, m],
        "o",
        color="tab:red",
        ms=5.0 if points <= 8 else 2.5,
    )
    axes.set_title(
        f"phase plane; dots: start of each first-mesh period, {points} in all",
        fontsize=9,
    )
    axes.set_xlabel("dynamic transmission error [um]")
    axes.set_ylabel("rate [mm/s]")


def _draw_spectrum(axes: Axes, motion: TimeHistory, m: int) -> None:
    """Draw lines over the orders of a mesh, with natural frequencies marked."""
    frequency = _mesh_frequency(motion, m)
    order = motion.spectrum_frequency / frequency
    shown = (order > 0.0) & (order <= SHOWN_ORDERS + 0.5)
    height = 1e6 * motion.spectrum[shown, m]
    floor = MIN_RELATIVE_AMPLITUDE * max(float(height.max()), 1e-9)
    is_drawn = height > floor
    axes.vlines(order[shown][is_drawn], floor, height[is_drawn], color="black", lw=1.2)
    axes.plot(order[shown][is_drawn], height[is_drawn], "k.", ms=4.0)
    axes.set_yscale("log")
    axes.set_ylim(floor, 3.0 * max(float(height.max()), 2.0 * floor))
    axes.set_xlim(0.0, SHOWN_ORDERS + 0.5)
    modes = motion.system.resonances_Hz
    for natural in modes[modes < (SHOWN_ORDERS + 0.5) * frequency]:
        axes.axvline(natural / frequency, color="tab:blue", lw=0.8, ls=":")
    axes.set_xlabel(
        f"frequency [orders of this mesh, {frequency:.5g} Hz]; natural ones dotted"
    )
    axes.set_ylabel("amplitude [um]")


def _legend_of_states(figure: Figure, motion: TimeHistory) -> None:
    """The states that occur while pairs are in mesh."""
    from matplotlib.patches import Patch

    states = {
        int(value)
        for pairs in motion.pairs
        for value in np.unique(pairs.state[pairs.in_mesh])
    }
    entries = [
        Patch(color=color, label=STATE_NAMES[value])
        for value, color in STATE_COLORS.items()
        if value in states
    ]
    draw_legend(figure, entries, 3)
