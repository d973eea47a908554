"""fegear sweep: the frequency response of a gear set."""

from __future__ import annotations

import time
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fegear.cli.edits import Edits, edit_entries, edits_in_words, parsed_edits
from fegear.cli.lumped_options import (
    AsJson,
    Damping,
    Excitation,
    ExcitationChoice,
    Harmonics,
    LoadCases,
    MaxPeriods,
    Method,
    MethodChoice,
    Model,
    Output,
    Physics,
    Plane,
    Plot,
    Ramp,
    Resolution,
    SetName,
    Speeds,
    Steps,
    Tables,
    Tolerance,
    Translations,
    checked_settings,
    chosen_torques,
    excitations_of,
    file_header,
    integration_in_words,
    natural_lines,
    parsed_speeds,
    require_elements_used,
    system_at,
    usual_speeds,
)
from fegear.cli.options import progress_bar, require_outputs
from fegear.cli.screen import complain, print_json, ruled_table, screen

if TYPE_CHECKING:
    from fegear.gearset.model import GearSet
    from lumped.sweep import Branch, Direction

    Branches = list[tuple[float, Branch]]  # torque on the input gear [N m], branch


class DirectionChoice(StrEnum):
    up = "up"
    down = "down"
    both = "both"

    @property
    def directions(self) -> tuple[Direction, ...]:
        return ("up", "down") if self.value == "both" else (self.value,)  # type: ignore[return-value]


def sweep_command(
    set_name: SetName,
    model: Model = 1,
    speeds: Speeds = None,
    rpm: Annotated[
        str | None,
        typer.Option(
            metavar="A:B:STEP",
            help="Rotation of the first mesh's driver [rpm], in place of --speeds.",
        ),
    ] = None,
    direction: Annotated[
        DirectionChoice, typer.Option(help="In which the speed changes.")
    ] = DirectionChoice.both,
    torque: LoadCases = None,
    edits: Edits = None,
    damping: Damping = None,
    translations: Translations = False,
    excitation: Excitation = ExcitationChoice.fe,
    ramp: Ramp = 0.1,
    harmonics: Harmonics = 5,
    plane: Plane = None,
    resolution: Resolution = None,
    table: Tables = None,
    steps: Steps = 64,
    method: Method = MethodChoice.rk4,
    tolerance: Tolerance = 1e-4,
    max_periods: MaxPeriods = None,
    output: Output = None,
    plot: Plot = None,
    as_json: AsJson = False,
) -> None:
    """Vibration over speed: resonances, jumps and loss of contact.

    Example: fegear sweep liu-idler --speeds 800:4200:20 -o s.csv --plot s.png
    """
    from fegear.gearset import load_gear_set

    require_outputs([output, plot], [set_name, *(table or ())])
    changes = parsed_edits(edits)
    gear_set = load_gear_set(set_name, changes)
    physics = Physics(
        model=model,
        translations=translations,
        damping=damping,
        excitation=excitation.value,
        ramp=ramp,
        harmonics=harmonics,
        tables=tuple(table or ()),
        plane=plane,
        resolution=resolution,
    )
    settings = checked_settings(method.value, steps, tolerance, max_periods)
    frequencies = asked_frequencies(gear_set, speeds, rpm)
    torques = chosen_torques(gear_set, torque or [])
    begin = time.perf_counter()
    excitations = excitations_of(physics, gear_set)
    from lumped.sweep import sweep_all

    with progress_bar(enabled=not as_json) as report:
        report("stiffness", 0, 1)
        systems = [
            system_at(gear_set, torque, physics, excitations) for torque in torques
        ]
        require_elements_used(physics, excitations)
        frequencies = frequencies or usual_speeds(systems[0])
        branches = sweep_all(
            systems,
            frequencies,
            direction.directions,
            settings,
            lambda done, total: report("sweep", done, total),
        )
    ratio = systems[0].train.damping_ratio
    words = integration_in_words(settings)
    header = file_header(gear_set, physics, words, ratio) | edit_entries(changes)
    found = at_torques(torques, direction, branches)
    outputs = SweepOutputs(csv=output, plot=plot, as_json=as_json)
    tell_sweep(found, str(model), header, frequencies, outputs, begin)


@dataclass(frozen=True, kw_only=True)
class SweepOutputs:
    """Where the results of a sweep go."""

    csv: Path | None
    plot: Path | None
    as_json: bool


def tell_sweep(
    found: Branches,
    model: str,
    header: dict[str, str],
    frequencies: list[float],
    outputs: SweepOutputs,
    begin: float,
    beside: Branches | None = None,
) -> None:
    """Write, draw and print; exits after a divergence or Ctrl-C.

    model : its name in files and on the screen; begin : clock when the work began
    beside : branches of Model-1 to be drawn in the same figure
    """
    write_sweep(found, model, header, outputs, beside or [])
    values = sweep_summary(found, model, header, frequencies)
    if beside:
        values["model_1_branches"] = branch_summaries(beside)
    values["wall_time_s"] = round(time.perf_counter() - begin, 3)
    if outputs.as_json:
        print_json(values)
    else:
        print_sweep(values)
    end_sweep(found)


def asked_frequencies(
    gear_set: GearSet, speeds: str | None, rpm: str | None
) -> list[float] | None:
    """Frequencies of the first mesh [Hz] by either option, None if neither is given."""
    from fegear.errors import InputError

    if speeds is not None and rpm is not None:
        raise InputError("--speeds and --rpm exclude each other")
    if rpm is not None:
        teeth = gear_set.gears[gear_set.meshes[0].driver].geometry.teeth
        return [turns * teeth / 60.0 for turns in parsed_speeds(rpm, "--rpm")]
    return None if speeds is None else parsed_speeds(speeds)


def at_torques(
    torques: tuple[float, ...], direction: DirectionChoice, branches: list[Branch]
) -> Branches:
    """Branches with their torques; all directions of a torque follow each other."""
    each = [torque for torque in torques for _ in direction.directions]
    return list(zip(each, branches, strict=True))


def write_sweep(
    found: Branches,
    model: str,
    header: dict[str, str],
    outputs: SweepOutputs,
    beside: Branches,
) -> None:
    from fegear.output import write_text, write_whole
    from lumped.sweep_table import format_sweep, sweep_table

    if outputs.csv is not None:
        text = format_sweep(sweep_table(found, model, header))
        write_text(outputs.csv, text)
    if outputs.plot is not None and any(branch.responses for _, branch in found):
        from fegear.plots import save_figure
        from lumped.figures import Curve, draw_sweep

        title = (
            f"{header['gear set']}, model {model}, {header['excitation']}, "
            f"damping ratio {header['damping ratio']}\n{edits_in_words(header)}"
        ).strip()
        name = model if beside else ""
        curves = [Curve(torque, branch, name) for torque, branch in found]
        curves += [Curve(torque, branch, "Model-1") for torque, branch in beside]
        write_whole(
            outputs.plot, lambda path: save_figure(draw_sweep(curves, title), path)
        )


def sweep_summary(
    found: Branches, model: str, header: dict[str, str], frequencies: list[float]
) -> dict[str, Any]:
    """Plain values, ready for JSON."""
    return {
        "gear_set": header["gear set"],
        "model": model,
        "excitation": header["excitation"],
        "damping_ratio": float(header["damping ratio"]),
        "translations": header["translations"] == "yes",
        "speeds": len(frequencies),
        "first_speed_Hz": min(frequencies),
        "last_speed_Hz": max(frequencies),
        "natural_frequencies_Hz": natural_lines(found[0][1].system),
        "branches": branch_summaries(found),
    }


def branch_summaries(found: Branches) -> list[dict[str, Any]]:
    from lumped.jumps import opposites

    others = opposites([branch for _, branch in found])
    return [
        branch_summary(torque, branch, other)
        for (torque, branch), other in zip(found, others, strict=True)
    ]


def branch_summary(
    torque: float, branch: Branch, other: Branch | None
) -> dict[str, Any]:
    from dataclasses import asdict

    from lumped.jumps import find_jumps, find_peaks

    statuses = [str(response.status) for response in branch.responses]
    units = {
        "frequency": "frequency_Hz",
        "frequency_from": "frequency_from_Hz",
        "frequency_to": "frequency_to_Hz",
        "dte_rms": "dte_rms_m",
        "dte_rms_from": "dte_rms_from_m",
        "dte_rms_to": "dte_rms_to_m",
        "force_peak": "force_peak_N",
        "contact_loss": "contact_loss_fraction",
    }

    def named(thing: Any) -> dict[str, Any]:
        return {units.get(name, name): value for name, value in asdict(thing).items()}

    return {
        "torque_Nm": torque,
        "direction": branch.direction,
        "complete": branch.complete,
        "finished_speeds": len(statuses) - statuses.count("diverged"),
        "aperiodic_speeds": statuses.count("aperiodic"),
        "peaks": [named(peak) for peak in find_peaks(branch)],
        "jumps": [named(jump) for jump in find_jumps(branch, other)],
    }


def print_sweep(values: dict[str, Any]) -> None:
    console = screen()
    lines = ", ".join(f"{f:.1f}" for f in values["natural_frequencies_Hz"])
    console.print(
        f"{values['gear_set']}, model {values['model']}, {values['excitation']}, "
        f"damping ratio {values['damping_ratio']:g}\n"
        f"natural frequencies that strain a mesh [Hz]: {lines}\n"
        f"{values['speeds']} speeds, {values['first_speed_Hz']:g} to "
        f"{values['last_speed_Hz']:g} Hz of the first mesh"
    )
    console.print(_peak_table(values["branches"]))
    console.print(_jump_table(values["branches"]))
    for branch in values["branches"]:
        if branch["aperiodic_speeds"]:
            console.print(
                f"{branch['torque_Nm']:g} N m {branch['direction']}: motion did not "
                f"repeat at {branch['aperiodic_speeds']} of "
                f"{branch['finished_speeds']} speeds"
            )
    for branch in values["branches"]:
        if not branch["complete"]:
            console.print(
                f"{branch['torque_Nm']:g} N m {branch['direction']}: ended after "
                f"{branch['finished_speeds']} of {values['speeds']} speeds"
            )
    console.print(f"wall time {values['wall_time_s']:.2f} s")


PLACE = ("torque\n[N m]", "direction", "mesh")  # of a peak or jump


def _peak_table(branches: list[dict[str, Any]]) -> Any:
    columns = ("peak\n[Hz]", "RMS of\nDTE [um]", "force\n[N]", "contact\nlost [%]")
    table = ruled_table(*PLACE, *columns, title="Peaks", text=2)
    for branch, peak in _entries(branches, "peaks"):
        table.add_row(
            *_place(branch, peak),
            f"{peak['frequency_Hz']:.6g}",
            f"{1e6 * peak['dte_rms_m']:.3f}",
            f"{peak['force_peak_N']:.0f}",
            f"{100.0 * peak['contact_loss_fraction']:.1f}",
        )
    return table if table.row_count else "no peaks"


def _jump_table(branches: list[dict[str, Any]]) -> Any:
    columns = ("from\n[Hz]", "to\n[Hz]", "RMS of DTE\nfrom [um]", "to\n[um]")
    table = ruled_table(*PLACE, *columns, title="Jumps", text=2)
    for branch, jump in _entries(branches, "jumps"):
        table.add_row(
            *_place(branch, jump),
            f"{jump['frequency_from_Hz']:.6g}",
            f"{jump['frequency_to_Hz']:.6g}",
            f"{1e6 * jump['dte_rms_from_m']:.3f}",
            f"{1e6 * jump['dte_rms_to_m']:.3f}",
        )
    return table if table.row_count else "no jumps"


def _entries(branches: list[dict[str, Any]], kind: str) -> list[tuple[Any, Any]]:
    return [(branch, entry) for branch in branches for entry in branch[kind]]


def _place(branch: dict[str, Any], entry: dict[str, Any]) -> tuple[str, str, str]:
    return f"{branch['torque_Nm']:g}", branch["direction"], str(entry["mesh"])


def end_sweep(found: Branches) -> None:
    """Exit code 1 after a divergence, 130 after Ctrl-C; rows are written by then."""
    from lumped.motion import DivergedError

    last = [branch.responses[-1] for _, branch in found if branch.responses]
    diverged = [response for response in last if response.status == "diverged"]
    if diverged:
        error = DivergedError(diverged[0].frequency, diverged[0].settling_time)
        complain(f"{error}; finished rows are kept")
        raise typer.Exit(1)
    if not all(branch.complete for _, branch in found):
        raise KeyboardInterrupt
