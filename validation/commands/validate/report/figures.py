"""Figures of a report, functions of results, in the look of `validation.pages.look`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from lumped.common.array_types import Array
from validation.pages.look import COLORS, WIDTH, grid
from validation.study.cycle_metrics import ForceCycle
from validation.study.metrics import METRICS, MeasuredCurve, Verdict
from validation.study.run_files import Run
from validation.study.runs import CaseResult
from validation.study.tasks import FE, FE_FRICTIONLESS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure

Column = Literal["dte_rms", "force_peak", "contact_loss"]
MARKERS = "osD^vP"
LEGEND: Mapping[str, Any] = {
    "loc": "outside upper center",
    "fontsize": 8,
    "frameon": False,
}
LETTERS = 28  # of a name in a legend of three columns
LABELS: dict[Column, tuple[str, float]] = {
    "dte_rms": ("RMS of DTE [um]", 1e6),
    "force_peak": ("largest mesh force [kN]", 1e-3),
    "contact_loss": ("contact lost [% of time]", 100.0),
}
SPAN = (
    1e-2,
    1e2,
)  # of measured over allowed that is drawn; larger ones are on the edge


def source_name(source: str) -> str:
    """`model-1-rectangular` as `model 1, rectangular`."""
    if source in (FE, FE_FRICTIONLESS):
        return "finite elements" + (
            ", no friction" if source == FE_FRICTIONLESS else ""
        )
    model, *others = source.replace("-", " ", 1).split("-")
    text = ", ".join([model, *others])
    return text.replace("without, ", "without ").replace("bending, ", "bending ratio ")


def draw_over_speed(result: CaseResult, torque: float, column: Column) -> Figure:
    """A column of the sweeps over speed at one torque, a panel for each mesh."""
    runs = _runs_at_torque(result, torque)
    meshes = sorted({curve.mesh for run in runs for curve in run.curves})
    figure, stack = _panels(len(meshes), 2.1)
    label, factor = LABELS[column]
    for mesh, axes in zip(meshes, stack, strict=True):
        for run, style in _styled(runs):
            for curve in (c for c in run.curves if c.mesh == mesh):
                values = factor * getattr(curve, column)
                dashes = "-" if curve.direction == "up" else (0, (3, 1.5))
                axes.plot(curve.frequency, values, **style, ls=dashes)
                if column == "dte_rms":
                    _mark_jumps(axes, curve, factor, style)
        axes.set_ylabel(f"mesh {mesh}: {label}")
        axes.set_ylim(bottom=0.0)
        axes.margins(x=0.01)
    first = " of mesh 1" if len(meshes) > 1 else ""
    stack[-1].set_xlabel(f"mesh frequency{first} [Hz]; dashed: speed falls")
    _legend(figure, runs)
    return figure


def _mark_jumps(
    axes: Axes, curve: MeasuredCurve, factor: float, style: dict[str, Any]
) -> None:
    """A dot where a jump lands."""
    for jump in curve.jumps:
        axes.plot(
            *([jump.frequency_to], [factor * jump.dte_rms_to]),
            marker="o" if curve.direction == "up" else "s",
            ms=4.0,
            color=style["color"],
            zorder=style["zorder"] + 1,
        )


def draw_statics(result: CaseResult, torque: float) -> Figure:
    """Static deflection over the mesh cycle, and what friction adds to it."""
    runs = _runs_at_torque(result, torque)
    reference = runs[0]
    friction = result.case.friction > 0.0
    meshes = len(reference.statics)
    figure, stack = _panels(meshes * (1 + friction), 1.7)
    for m, axes in enumerate(stack[:meshes]):
        for run, style in _styled(runs):
            statics = run.statics[m]
            axes.plot(
                *_closed_cycle(statics.position, 1e6 * statics.deflection), **style
            )
        mesh = reference.statics[m].mesh
        axes.set_ylabel(f"mesh {mesh}: static\ndeflection [um]")
        axes.margins(x=0.0)
    for m, axes in enumerate(stack[meshes:]):
        statics = reference.statics[m]
        for run, style in _styled(runs):
            model_statics = run.statics[m]
            if model_statics.friction.any():
                axes.plot(
                    *_closed_cycle(
                        model_statics.position, 1e9 * model_statics.friction
                    ),
                    **style,
                )
        axes.set_ylabel(f"mesh {statics.mesh}: change\nby friction [nm]")
        axes.fill_between(
            *_closed_cycle(statics.position, statics.single_pair_contact.astype(float)),
            transform=axes.get_xaxis_transform(),
            color="black",
            alpha=0.08,
            lw=0.0,
        )
        axes.set_title("shaded: a single tooth pair carries", fontsize=8)
    stack[-1].set_xlabel("mesh position [base pitches from the pitch point]")
    _legend(figure, runs)
    return figure


def _closed_cycle(position: Array, values: Array) -> tuple[Array, Array]:
    """A periodic column with its first value repeated one base pitch on."""
    order = np.argsort(position)
    at, column = position[order], values[order]
    return np.append(at, at[0] + 1.0), np.append(column, column[0])


def draw_force_cycle(result: CaseResult, torque: float, label: str) -> Figure:
    """Mesh force over a cycle at a single speed, a panel for each mesh."""
    runs = _runs_at_torque(result, torque)
    meshes = [w.mesh for w in runs[0].cycles if w.label == label]
    figure, stack = _panels(len(meshes), 2.1)
    for mesh, axes in zip(meshes, stack, strict=True):
        for run, style in _styled(runs):
            (wave,) = (w for w in run.cycles if (w.label, w.mesh) == (label, mesh))
            cycle = np.arange(wave.force.size) / wave.force.size
            axes.plot(cycle, 1e-3 * wave.force, **style)
            if wave.period_multiple != 1:
                _note_period(axes, run.source, wave)
        axes.set_ylabel(f"mesh {mesh}: force [kN]")
        axes.set_xlim(0.0, 1.0)
    stack[-1].set_xlabel("cycle of the mesh")
    _legend(figure, runs)
    return figure


def _note_period(axes: Axes, source: str, wave: ForceCycle) -> None:
    """That a cycle is one of several."""
    times = wave.period_multiple
    repetition = f"repeats after {times} cycles" if times else "does not repeat"
    title = "; ".join(filter(None, (axes.get_title(), f"{source}: {repetition}")))
    axes.set_title(title, fontsize=8)


def draw_verdicts(result: CaseResult) -> Figure:
    """Measured over allowed, one mark for each verdict; right of 1 is outside."""
    names = [entry.name for entry in result.case.metric]
    names = [n for n in names if any(v.metric == n for v in result.verdicts)]
    figure, (axes,) = _panels(1, 0.8 + 0.28 * len(names))
    models, points = result.models, {}
    for i, model in enumerate(models):
        offset = 0.6 * (i + 0.5) / len(models) - 0.3
        model_verdicts = [v for v in result.verdicts if v.model == model]
        points[model] = [
            (_over_allowed(v), names.index(v.metric) + offset) for v in model_verdicts
        ]
    _mark_models(axes, points, ms=3.2, alpha=0.75)
    axes.axvline(1.0, color="black", lw=1.0)
    axes.set_xscale("log")
    axes.set_xlim(SPAN[0] / 1.3, SPAN[1] * 1.3)
    axes.set_ylim(max(len(names), 1) - 0.5, -0.5)
    axes.set_yticks(range(len(names)), [name.replace("_", " ") for name in names])
    axes.set_xlabel("measured over allowed; right of the line: outside")
    if result.verdicts:  # else there is nothing to name
        figure.legend(ncols=2, **LEGEND)
    return figure


def _over_allowed(verdict: Verdict) -> float:
    """1 at the tolerance, drawn within SPAN; NaN, never within, on its right edge."""
    if METRICS[verdict.metric].allowed_is_minimum:
        measured, allowed = 1.0 - verdict.measured, 1.0 - verdict.allowed
    else:
        measured, allowed = abs(verdict.measured), verdict.allowed
    if measured == 0.0:
        return SPAN[0]
    ratio = measured / allowed if allowed > 0.0 else np.inf
    return float(np.clip(np.nan_to_num(ratio, nan=np.inf), *SPAN))


def draw_cost(results: Sequence[CaseResult]) -> Figure | None:
    """Seconds per speed against the distance from the finite elements.

    None where no case has a distance.
    """
    models = list(dict.fromkeys(m for result in results for m in result.models))
    points = {model: list(_cost_points(results, model)) for model in models}
    if not any(points.values()):
        return None
    figure, (axes,) = _panels(1, 3.2)
    _mark_models(axes, points, ms=5.0)
    moving = [result for result in results if result.case.speeds]
    for i, result in enumerate(moving):
        label = "finite elements, the reference" if i == 0 else None
        axes.axvline(result.per_speed_s(FE), color="black", lw=0.9, label=label)
    axes.set_xscale("log")
    axes.set_yscale("log")
    _number_decades(axes.xaxis)
    _number_decades(axes.yaxis)
    axes.set_xlabel("run time per speed [s]")
    axes.set_ylabel("RMS distance of the curves [%]\nmedian over meshes and torques")
    figure.legend(ncols=2, **LEGEND)
    return figure


def _number_decades(axis: Axis) -> None:
    """Numbers at 1, 2 and 5 of each decade of a logarithmic axis."""
    from matplotlib.ticker import LogLocator, NullFormatter

    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter("{x:g}")
    axis.set_minor_formatter(NullFormatter())


def _mark_models(
    axes: Axes, points: Mapping[str, Sequence[tuple[float, float]]], **look: Any
) -> None:
    """Marks of each model at its points (x, y)."""
    for i, (model, places) in enumerate(points.items()):
        axes.plot(
            *np.array(places).reshape(-1, 2).T,
            marker=MARKERS[i % len(MARKERS)],
            color=COLORS[i % len(COLORS)],
            ls="",
            label=source_name(model),
            **look,
        )


def _cost_points(
    results: Sequence[CaseResult], model: str
) -> Iterator[tuple[float, float]]:
    """Seconds per speed and per cent of each case where both are above 0."""
    for result in results:
        errors = [
            100.0 * v.measured
            for v in result.verdicts
            if (v.model, v.metric) == (model, "rms_distance")
        ]
        point = result.per_speed_s(model), float(np.median(errors or [0.0]))
        if min(point) > 0.0:
            yield point


def _panels(count: int, height: float) -> tuple[Figure, list[Axes]]:
    """Panels over one another with one abscissa, each of a height in inches."""
    size = WIDTH, 0.9 + height * count
    figure, rows = grid(count, 1, size, share=True)
    return figure, [axes for (axes,) in rows]


def _runs_at_torque(result: CaseResult, torque: float) -> list[Run]:
    """Runs at a torque, the finite elements first."""
    runs = [run for run in result.judged if run.torque == torque]
    return sorted(runs, key=lambda run: run.source != FE)


def _styled(runs: Sequence[Run]) -> Iterator[tuple[Run, dict[str, Any]]]:
    """The finite elements black below all; models narrower and higher the earlier.

    So that lines that coincide are all seen.
    """
    reference, *others = runs
    models = len(others)
    yield reference, {"color": "black", "lw": 1.9 + 0.5 * models, "zorder": 2}
    for i, run in enumerate(others):
        style = {"color": COLORS[i % len(COLORS)], "lw": 1.0 + 0.5 * i}
        yield run, style | {"zorder": 3 + 2 * (models - i)}


def _legend(figure: Figure, runs: Sequence[Run]) -> None:
    from matplotlib.lines import Line2D

    handles = [
        Line2D([], [], color=s["color"], lw=s["lw"], label=source_name(run.source))
        for run, s in _styled(runs)
    ]
    longest = max(len(source_name(run.source)) for run in runs)
    figure.legend(handles=handles, ncols=3 if longest <= LETTERS else 2, **LEGEND)
