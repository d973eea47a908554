"""What an identification shows: plain values, a table for a file, and a figure."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from fegear.gearset.model import GearSet
from fegear.identify import (
    WIDTH_FACTORS,
    Candidate,
    Identification,
    MeasuredStiffness,
    hub_limits,
)
from lumped.csv_text import format_csv
from lumped.drawing import draw_title, panels

FAR_OFF = 3.0  # spreads of a figure, beyond which it is not met
AT_BOUND = 1e-3  # relative distance

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def identification_values(
    gear_set: GearSet, measured: MeasuredStiffness, found: Identification
) -> dict[str, Any]:
    """The identification as plain values, ready for JSON; NaN where unknown."""
    return {
        "gear_set": gear_set.name,
        "driver_torque_Nm": [float(torque) for torque in measured.torque],
        "measured_mean_stiffness_N_per_m": [float(k) for k in measured.mean],
        "measured_stiffness_variation": [float(eps) for eps in measured.variation],
        "mean_spread": measured.mean_spread,
        "variation_spread": measured.variation_spread,
        "best": candidate_values(gear_set, found.best),
        "warnings": list(doubts_of_fit(gear_set, measured, found)),
        "interpolation_error": found.interpolation_error,
        "equally_good_from": gear_set.gears[found.along].name,
        "equally_good": [candidate_values(gear_set, c) for c in found.equally_good],
        "valley": [candidate_values(gear_set, c) for c in found.valley],
    }


def doubts_of_fit(
    gear_set: GearSet, measured: MeasuredStiffness, found: Identification
) -> Iterator[str]:
    """Why the set chosen does not stand for what was measured, if so."""
    best = found.best
    worst = float(np.abs(measured.misfits(best.mean, best.variation)).max())
    if worst > FAR_OFF:
        yield (
            f"no set meets the figures: the best one is {worst:.3g} spreads off; the "
            "figures, the material or the number of teeth may be others"
        )
    for gear, hub in zip(gear_set.gears, best.hub_radius, strict=True):
        for limit in hub_limits(gear):
            if abs(hub / limit - 1.0) < AT_BOUND:
                yield f'hub radius of gear "{gear.name}" is at its limit'
    if min(abs(best.width_factor / limit - 1.0) for limit in WIDTH_FACTORS) < AT_BOUND:
        yield f"face widths are at their limit, {best.width_factor:.3g} of those given"


def candidate_values(gear_set: GearSet, candidate: Candidate) -> dict[str, float]:
    """One set by column name, to the digits that a search finds again."""
    values = {}
    for gear, hub in zip(gear_set.gears, candidate.hub_radius, strict=True):
        width = 1e3 * candidate.width_factor * gear.face_width
        values[f"{gear.name}_face_width_mm"] = float(width)
        values[f"{gear.name}_hub_radius_mm"] = 1e3 * float(hub)
    for m, (mean, variation) in enumerate(
        zip(candidate.mean, candidate.variation, strict=True), start=1
    ):
        values[f"mesh{m}_mean_stiffness_N_per_m"] = float(mean)
        values[f"mesh{m}_stiffness_variation"] = float(variation)
    rounded = {name: float(f"{value:.5g}") for name, value in values.items()}
    return rounded | {"misfit": round(candidate.misfit, 4)}


def valley_csv(values: dict[str, Any]) -> str:
    """The set chosen and the valley as CSV text, there the smallest hub first.

    `set` says which: chosen, equally good, or worse.
    """
    rows = [{"set": "chosen"} | values["best"]]
    for row in values["valley"]:
        kind = "equally good" if row in values["equally_good"] else "worse"
        rows.append({"set": kind} | row)
    header = {
        "gear set": values["gear_set"],
        "misfit": "sum of squares of (figure - measured) over its spread",
    }
    return format_csv(rows[0], (row.values() for row in rows), header)


def draw_valley(
    gear_set: GearSet, measured: MeasuredStiffness, found: Identification
) -> Figure:
    """Hubs and width, and the figures they give, along the valley."""
    heights = (1.5, 1.0, 1.0, 0.8)
    figure, rows = panels(4, size=(8.0, 9.0), heights=heights, share=True)
    hubs, means, variations, misfit = (row[0] for row in rows)
    along = gear_set.gears[found.along].name
    x = np.array([1e3 * c.hub_radius[found.along] for c in found.valley])
    _draw_hubs(hubs, gear_set, found, x)
    for m in range(len(gear_set.meshes)):
        for axes, name, scale in ((means, "mean", 1e-8), (variations, "variation", 1)):
            curve = scale * np.array([getattr(c, name)[m] for c in found.valley])
            (line,) = axes.plot(x, curve, label=f"mesh {m + 1}")
            wanted = scale * getattr(measured, name)[m]
            axes.axhline(wanted, color=line.get_color(), linestyle=":")
    means.set_ylabel("mean stiffness\n[1e8 N/m]")
    variations.set_ylabel("peak to peak\nover mean")
    means.legend(title="dotted: measured", fontsize=8)
    misfit.plot(x, [c.misfit for c in found.valley], color="k")
    misfit.set_ylim(0.0, found.best.misfit + 6.0)
    misfit.set_ylabel("misfit")
    misfit.set_xlabel(f"hub radius of {along} [mm]")
    good = [1e3 * c.hub_radius[found.along] for c in found.equally_good]
    for axes in (hubs, means, variations, misfit):
        if good:
            axes.axvspan(min(good), max(good), color="0.93", zorder=0)
        axes.axvline(1e3 * found.best.hub_radius[found.along], color="0.4", lw=0.8)
    draw_title(
        figure,
        f"{gear_set.name}: face width and hub radii from mesh stiffness\n"
        "grey: equally good sets, line: the set chosen",
    )
    return figure


def _draw_hubs(
    axes: Axes, gear_set: GearSet, found: Identification, x: np.ndarray
) -> None:
    for i, gear in enumerate(gear_set.gears):
        if i != found.along:
            radius = [1e3 * c.hub_radius[i] for c in found.valley]
            axes.plot(x, radius, label=f"hub radius of {gear.name}")
    width = [c.width_factor * 1e3 * gear_set.gears[0].face_width for c in found.valley]
    name = gear_set.gears[0].name
    axes.plot(x, width, color="k", linestyle="--", label=f"face width of {name}")
    axes.set_ylabel("[mm]")
    axes.legend(fontsize=8)
