"""fegear eccentric: an eccentric circular wheel and the wheel that it drives."""

from __future__ import annotations

from dataclasses import MISSING, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from fegear.cli.groups import grouped, option
from fegear.cli.options import (
    AsJson,
    Plot,
    Resolution,
    chosen,
    progress_bar,
    refuse_idle,
    require_ending,
    require_outputs,
    show,
)
from fegear.cli.screen import complain, number, say
from fegear.errors import InputError
from fegear.studies.study import Range

if TYPE_CHECKING:
    from fegear.eccentric.gearing import Gearing
    from fegear.eccentric.turn import TurnTable
    from fegear.store import Keeping
    from lumped.progress import Progress

EXAMPLE = "fegear eccentric --radius 20 --eccentricity 6 --teeth 40 -o wheels.svg"
LENGTH = Range(least=1e-3, most=1e6, unit="mm")
OUTLINES, MESHES = (".csv", ".svg", ".dxf"), (".msh", ".vtu")
FILMS = (".gif", ".mp4")


@dataclass(frozen=True, kw_only=True)
class Wheels:
    """What the gearing is."""

    radius: float = option(
        "Radius of the driver's pitch circle [mm].", default=MISSING, allowed=LENGTH
    )
    eccentricity: float = option(
        "Distance of the driver's bearing from its centre [mm].", default=MISSING
    )
    ratio: float = option(
        "Gear ratio, turns of the driver for one of the driven wheel: a whole number.",
        default=1.0,
    )
    pressure_angle: float = option(
        "Angle of the line of action [degrees].", default=20.0
    )
    teeth: int | None = option(
        "Teeth of the driver. [default: none, pitch and base curves alone]"
    )

    addendum: float | None = option("Of the teeth [modules]. [default: 1]")
    dedendum: float | None = option("Of the teeth [modules]. [default: 1.25]")

    def __post_init__(self) -> None:
        if self.teeth is None:
            own = {"addendum": self.addendum, "dedendum": self.dedendum}
            refuse_idle("needs --teeth", **own)

    @property
    def gearing(self) -> Gearing:
        from fegear.eccentric.gearing import Gearing

        heights = chosen(addendum=self.addendum, dedendum=self.dedendum)
        place = self.radius, self.eccentricity, self.ratio
        return Gearing(*place, self.pressure_angle, self.teeth, **heights)


@dataclass(frozen=True, kw_only=True)
class LoadOptions:
    """A load on the driver, and the finite elements that carry it."""

    torque: float | None = option(
        "Torque on the driver [N\u00a0m]: solves the contact over a turn of the driven "
        "wheel, both wheels of steel. [default: none]",
        allowed=Range(least=1e-6, below=1e9, unit="N m"),
    )
    face_width: float | None = option(
        "Width of both wheels [mm]. [default: 10]", allowed=LENGTH
    )
    positions: int | None = option(
        "Positions of a turn of the driven wheel. [default: 8 for each of its teeth]",
        allowed=Range(least=1, most=100_000),
    )
    contact: Path | None = option("Write the contact over the turn to this CSV file.")
    resume: bool = option(
        "Go on with an interrupted run to the same --contact.", default=False
    )
    bore: float | None = option(
        "Radius of both bores [mm], of meshes and under load. [default: two fifths of "
        "what fits]",
        allowed=LENGTH,
    )
    resolution: Resolution = None

    def require(self, meshed: bool) -> None:
        """Refuse what would change nothing; meshed : whether a mesh is written."""
        if self.torque is not None:
            if self.resume and self.contact is None:
                raise InputError(
                    "--resume needs the --contact of the run to go on with"
                )
            return
        refuse_idle(
            "needs --torque",
            face_width=self.face_width,
            positions=self.positions,
            contact=self.contact,
            resume=self.resume,
        )
        if not meshed:
            reason = "needs --torque or an --output in .msh or .vtu"
            refuse_idle(reason, bore=self.bore, resolution=self.resolution)

    def solve(self, gearing: Gearing, report: Progress) -> TurnTable | None:
        """The contact over a turn, where a load is given."""
        from fegear.eccentric.turn import Load, solve_load

        if self.torque is None:
            return None
        asked = Load(
            torque_Nm=self.torque,
            face_width_mm=self.face_width or 10.0,
            positions=self.positions,
            bore_mm=self.bore,
            resolution=self.resolution or "default",
        )
        return solve_load(gearing, asked, self.keeping, report)

    @property
    def checkpoint(self) -> Path | None:
        """Where finished positions are kept until the table is written."""
        return None if self.contact is None else Path(f"{self.contact}.partial")

    @property
    def keeping(self) -> Keeping:
        from fegear.store import Keeping

        return Keeping(checkpoint=self.checkpoint, resume=self.resume, tell=complain)


@dataclass(frozen=True, kw_only=True)
class Files:
    """What is written."""

    output: Path | None = option(
        "File to write: points in .csv, drawings to scale in .svg or .dxf [mm], meshes "
        "in .msh or .vtu [m].",
        "-o",
        "--output",
    )
    animate: Path | None = option("Film of a turn of the driven wheel, .gif or .mp4.")
    plot: Plot = None
    as_json: AsJson = False

    def __post_init__(self) -> None:
        for path, allowed in (
            (self.output, (*OUTLINES, *MESHES)),
            (self.animate, FILMS),
        ):
            if path is not None and path.suffix not in allowed:
                raise InputError(f"{path}: the name must end in {', '.join(allowed)}")

    @property
    def meshed(self) -> bool:
        return self.output is not None and self.output.suffix in MESHES


@grouped
def eccentric_command(*, wheels: Wheels, load: LoadOptions, files: Files) -> None:
    """An eccentric circular wheel, and the wheel that it drives.

    Its pitch curve and centre distance follow from rolling, its base curve and whether
    involute teeth can stand on it from the pressure angle. With teeth both wheels are
    drawn and meshed, and under a torque their contact is solved over a turn.
    """
    from fegear.eccentric.files import write_animation, write_gearing, write_plot
    from fegear.output import write_text

    load.require(files.meshed)
    require_ending(load.contact)
    require_outputs([files.output, files.animate, load.contact], (), files.plot)
    gearing = wheels.gearing
    values = dict(gearing.summary)
    with progress_bar(enabled=not files.as_json) as report:
        turn = load.solve(gearing, report)
        if turn is not None:
            values["contact"] = turn.summary
            values["warnings"] = turn.summary["warnings"]
            if load.contact is not None:
                write_text(load.contact, turn.csv())
        if files.output is not None:
            resolution = load.resolution or "default"
            write_gearing(gearing, files.output, load.bore, resolution)
        if files.plot is not None:
            write_plot(gearing, turn, files.plot)
        if files.animate is not None:
            write_animation(gearing, files.animate, report)
    show(values, files.as_json, print_eccentric)
    if turn is not None and not turn.complete:
        if load.checkpoint is not None:
            complain(f"{load.checkpoint} is kept, --resume goes on there")
        raise typer.Exit(130)


def print_eccentric(values: dict[str, Any]) -> None:
    from fegear.eccentric.gearing import ANGLES

    say(
        f"radius {values['radius_mm']:g} mm, eccentricity "
        f"{values['eccentricity_mm']:g} mm, ratio {values['ratio']}, pressure angle "
        f"{values['pressure_angle_deg']:g} degrees"
    )
    say(
        f"centre distance {values['center_distance_mm']:.9g} mm; Burmester's "
        f"approximation {values['burmester_center_distance_mm']:.9g} mm, with which "
        "the driven curve misses itself by "
        f"{values['burmester_closing_error_deg']:.3g} degrees"
    )
    if values["feasible"]:
        say("involute teeth can stand on both pitch curves")
    else:
        say(f"not feasible: {values['reason']}")
    angle, most = values["largest_pressure_angle_deg"], ANGLES[1]
    words = f"{number(angle, 4)}" if angle <= most else f"above {most:g}"
    say(
        f"largest pressure angle {words} degrees with this eccentricity, largest "
        f"eccentricity {number(values['largest_eccentricity_mm'], 5)} mm with this "
        "pressure angle"
    )
    say(
        f"torque ratio {values['least_torque_ratio']:.4g} to "
        f"{values['largest_torque_ratio']:.4g} over a turn"
    )
    if "module_mm" in values:
        say(
            f"{values['driver_teeth']} and {values['driven_teeth']} teeth, module "
            f"{values['module_mm']:.6g} mm, contact ratio "
            f"{values['least_contact_ratio']:.3f} to "
            f"{values['largest_contact_ratio']:.3f}"
        )
    if "contact" in values:
        _print_contact(values["contact"])


def _print_contact(values: dict[str, Any]) -> None:
    say(
        f"under {values['torque_Nm']:g} N m on {values['face_width_mm']:g} mm: mean "
        f"transmission error {number(values['mean_transmission_error_um'], 4)} um, "
        f"peak to peak {number(values['peak_to_peak_transmission_error_um'], 4)} um, "
        f"contact pressure up to {number(values['largest_contact_pressure_MPa'], 4)} "
        f"MPa, at {values['positions']} positions"
    )
    say(
        "torques of the contact forces keep to the kinematics within "
        f"{values['largest_deviation_of_torque_ratio']:.1e}"
    )
