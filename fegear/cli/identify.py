"""fegear identify: face width and hub radii from measured mesh stiffness."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from fegear.cli.edits import EditedSet
from fegear.cli.groups import grouped, option
from fegear.cli.lumped_options import LoadCase, middle_torque
from fegear.cli.options import Elements, Outputs, require
from fegear.cli.screen import ruled_table, screen
from fegear.errors import InputError
from fegear.studies.page import number
from fegear.studies.study import Range

if TYPE_CHECKING:
    from rich.table import Table

    from fegear.gearset.model import GearSet
    from fegear.identify import MeasuredStiffness

EXAMPLE = "fegear identify liu-pair --mean 2.9e8 --variation 0.35"

PART = Range(above=0.0, below=1.0)


@dataclass(frozen=True, kw_only=True)
class Measured:
    """Measured stiffnesses and how far they may be off."""

    mean: list[float] | None = option(
        "Measured mean mesh stiffness [N/m], once for each mesh in order. [default: "
        "mean_stiffness_N_per_m of the gear set]",
        allowed=Range(above=0.0, below=1e12, unit="N/m"),
    )
    variation: list[float] | None = option(
        "Measured peak-to-peak mesh stiffness over its mean, once for each mesh in "
        "order. [default: stiffness_variation of the gear set]",
        allowed=PART,
    )
    mean_spread: float = option(
        "Relative standard deviation of the mean stiffnesses.",
        default=0.02,
        allowed=PART,
    )
    variation_spread: float = option(
        "Standard deviation of the variations.",
        default=0.025,
        allowed=PART,
    )

    def of(self, gear_set: GearSet, torque: float) -> MeasuredStiffness:
        """What the options and the gear set know of the meshes.

        torque : on the input gear [N m]
        """
        import numpy as np

        from fegear.identify import MeasuredStiffness
        from fegear.train import mesh_torques_at

        meshes = gear_set.meshes
        for name, given in (("--mean", self.mean), ("--variation", self.variation)):
            if given and len(given) != len(meshes):
                raise InputError(
                    f"{name} is given {len(given)} times; {gear_set.name} has "
                    f"{len(meshes)} meshes, one for each is needed"
                )
        own_mean = [mesh.mean_stiffness for mesh in meshes]
        own_variation = [mesh.stiffness_variation for mesh in meshes]
        mean, variation = self.mean or own_mean, self.variation or own_variation
        if not any(mean) and not any(variation):
            raise InputError(
                f"--mean or --variation is missing; {gear_set.name} has no "
                "mean_stiffness_N_per_m and no stiffness_variation"
            )
        return MeasuredStiffness(
            torque=np.array(mesh_torques_at(gear_set, torque)),
            mean=np.array(mean, float),
            variation=np.array(variation, float),
            mean_spread=self.mean_spread,
            variation_spread=self.variation_spread,
        )


@dataclass(frozen=True, kw_only=True)
class Unknowns:
    """What is identified, and along what the sets are listed."""

    hold_width: bool = option(
        "Keep the face widths and identify hub radii alone.",
        default=False,
    )
    along: str | None = option(
        "Gear whose hub radius runs through the valley of equally good sets. "
        "[default: the first gear]",
        metavar="GEAR",
    )

    def start(self, gear_set: GearSet) -> int:
        """Index of the gear whose hub radius runs."""
        names = [gear.name for gear in gear_set.gears]
        if self.along is None:
            return 0
        if self.along not in names:
            known = ", ".join(names)
            raise InputError(f"--along {self.along}; {gear_set.name} has {known}")
        return names.index(self.along)


@grouped
def identify_command(
    *,
    subject: EditedSet,
    measured: Measured,
    unknowns: Unknowns,
    torque: LoadCase = None,
    elements: Elements,
    outputs: Outputs,
) -> None:
    """Face width and hub radii that give measured stiffnesses.

    A weighted least-squares fit of one factor on all face widths and of every gear's
    hub radius. Figures that leave several sets equally good are shown with them.
    """
    outputs.require(subject.set_name)
    gear_set, _ = subject.load(torque=torque)
    start, at = unknowns.start(gear_set), middle_torque(gear_set, torque)
    require(at > 0.0, "--torque", at, "must be positive, on the input gear [N m]")
    from fegear.identify import identify, stiffness_model
    from fegear.identify_report import draw_valley, identification_values, valley_csv
    from fegear.statics import StaticsSettings

    known = measured.of(gear_set, at)
    settings = StaticsSettings(**elements.choices)
    with outputs.progress() as report:
        model = stiffness_model(gear_set, known.torque, settings, report)
        found = identify(model, known, unknowns.hold_width, start, report)
    values = identification_values(gear_set, known, found)
    outputs.write(lambda: valley_csv(values))
    outputs.draw(lambda: draw_valley(gear_set, known, found))
    names = [gear.name for gear in gear_set.gears]
    outputs.show(values, lambda values: print_identification(values, names))


def print_identification(values: dict[str, Any], names: list[str]) -> None:
    """The sets that are equally good, and how the chosen one meets the figures."""
    console = screen()
    console.print(_sets_table(values, names))
    console.print(_figures_table(values))
    console.print(
        f"misfit: squares of the differences over their spreads "
        f"({100.0 * values['mean_spread']:g} % of a mean, "
        f"{values['variation_spread']:g} of a variation), summed; interpolation "
        f"between hub radii changes a mean by {values['interpolation_error']:.1e}"
    )


def _sets_table(values: dict[str, Any], names: list[str]) -> Table:
    title = f"{values['gear_set']}: equally good sets, * the set chosen"
    table = ruled_table("", title=title)
    width = f"{names[0]}_face_width_mm"
    hubs = [f"{name}_hub_radius_mm" for name in names]
    for name in names:
        title = f"hub radius\nof {name}\n[mm]"
        table.add_column(title, justify="right", min_width=6)
    table.add_column(f"face width\nof {names[0]}\n[mm]", justify="right", min_width=6)
    table.add_column("misfit", justify="right", min_width=6)
    best = values["best"]
    key = f"{values['equally_good_from']}_hub_radius_mm"
    for row in sorted([best, *values["equally_good"]], key=lambda row: row[key]):
        numbers = [f"{row[name]:.2f}" for name in (*hubs, width)]
        table.add_row("*" if row is best else "", *numbers, f"{row['misfit']:.3f}")
    return table


def _figures_table(values: dict[str, Any]) -> Table:
    title = "the set chosen, meshed, beside what was measured"
    table = ruled_table("mesh", title=title, words=())
    for quantity in ("mean stiffness\n[1e8 N/m]", "peak to peak\nover mean"):
        for origin in ("", "measured "):
            table.add_column(f"{origin}{quantity}", justify="right")
    for m, (mean, variation) in enumerate(
        zip(
            values["measured_mean_stiffness_N_per_m"],
            values["measured_stiffness_variation"],
            strict=True,
        ),
        start=1,
    ):
        row = values["best"]
        table.add_row(
            str(m),
            number(1e-8 * row[f"mesh{m}_mean_stiffness_N_per_m"]),
            "-" if math.isnan(mean) else number(1e-8 * mean),
            f"{row[f'mesh{m}_stiffness_variation']:.4f}",
            "-" if math.isnan(variation) else f"{variation:.4f}",
        )
    return table
