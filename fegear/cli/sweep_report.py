"""What a sweep writes, draws and prints, of lumped models and of finite elements."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from fegear.cli.edits import edits_in_words
from fegear.cli.options import counted
from fegear.cli.screen import complain, number, print_json, ruled_table, screen, warn
from fegear.cli.systems import natural_lines

if TYPE_CHECKING:
    from rich.console import Console

    from fegear.gearset.model import GearSet
    from lumped.sweep import Branch

    Branches = Sequence[tuple[float, Branch]]  # torque on the input gear [N m], branch

UNITS = {
    "frequency": "frequency_Hz",
    "frequency_from": "frequency_from_Hz",
    "frequency_to": "frequency_to_Hz",
    "dte_rms": "dte_rms_m",
    "dte_rms_from": "dte_rms_from_m",
    "dte_rms_to": "dte_rms_to_m",
    "force_peak": "force_peak_N",
    "contact_loss": "contact_loss_fraction",
    "back_side": "back_side_fraction",
}


@dataclass(frozen=True, eq=False, kw_only=True)
class SweepResult:
    """What was run and found.

    model : its name in files and on the screen; frequencies : asked for [Hz]
    beside : branches of Model-1, to be shown with those found
    """

    gear_set: GearSet
    model: str
    header: dict[str, str]
    frequencies: Sequence[float]
    found: Branches
    beside: Branches = ()


@dataclass(frozen=True, kw_only=True)
class SweepOutputs:
    """Where the results go."""

    csv: Path | None
    plot: Path | None
    as_json: bool


def tell_sweep(result: SweepResult, outputs: SweepOutputs, begin: float) -> None:
    """Write, draw and print; exits after a divergence or Ctrl-C.

    begin : clock when the work began
    """
    _write(result, outputs)
    values = sweep_summary(result)
    values["wall_time_s"] = round(time.perf_counter() - begin, 3)
    if outputs.as_json:
        print_json(values)
    else:
        print_sweep(values)
    warn(values["warnings"])
    _end(result.found, outputs.csv)


def _write(result: SweepResult, outputs: SweepOutputs) -> None:
    from fegear.output import write_text, write_whole
    from lumped.sweep_table import format_sweep, sweep_table

    some = any(branch.responses for _, branch in result.found)
    if outputs.csv is not None and some:
        table = sweep_table(result.found, result.model, result.header | _gaps(result))
        write_text(outputs.csv, format_sweep(table))
    if outputs.plot is not None and some:
        from fegear.plots import save_figure
        from lumped.figures import Curve, draw_sweep

        header, name = result.header, result.model if result.beside else ""
        title = (
            f"{header['gear set']}, model {result.model}, {header['excitation']}, "
            f"damping ratio {header['damping ratio']}\n{edits_in_words(header)}"
        ).strip()
        curves = [Curve(torque, branch, name) for torque, branch in result.found]
        curves += [Curve(torque, branch, "Model-1") for torque, branch in result.beside]
        write_whole(
            outputs.plot, lambda path: save_figure(draw_sweep(curves, title), path)
        )


def _gaps(result: SweepResult) -> dict[str, str]:
    """An entry of the header where an end before the end left speeds out."""
    total = len(result.found) * len(result.frequencies)
    done = sum(len(branch.responses) for _, branch in result.found)
    return {"incomplete": f"{done} of {total} speeds"} if done < total else {}


def sweep_summary(result: SweepResult) -> dict[str, Any]:
    """Plain values, ready for JSON."""
    header = result.header
    values: dict[str, Any] = {
        "gear_set": header["gear set"],
        "model": result.model,
        "excitation": header["excitation"],
        "damping_ratio": float(header["damping ratio"]),
        "translations": header["translations"] == "yes",
        "speeds": len(result.frequencies),
        "first_speed_Hz": min(result.frequencies),
        "last_speed_Hz": max(result.frequencies),
        "natural_frequencies_Hz": natural_lines(result.found[0][1].system),
        "branches": _branch_summaries(result.found),
    }
    if result.beside:
        values["model_1_branches"] = _branch_summaries(result.beside)
    return values | {"warnings": list(_warnings(result))}


def _branch_summaries(found: Branches) -> list[dict[str, Any]]:
    from lumped.jumps import opposites

    others = opposites([branch for _, branch in found])
    return [
        _branch_summary(torque, branch, other)
        for (torque, branch), other in zip(found, others, strict=True)
    ]


def _branch_summary(
    torque: float, branch: Branch, other: Branch | None
) -> dict[str, Any]:
    from lumped.jumps import find_jumps, find_peaks, largest_responses

    statuses = [str(response.status) for response in branch.responses]

    def named(thing: Any) -> dict[str, Any]:
        return {UNITS.get(name, name): value for name, value in asdict(thing).items()}

    return {
        "torque_Nm": torque,
        "direction": branch.direction,
        "complete": branch.complete,
        "finished_speeds": len(statuses) - statuses.count("diverged"),
        "aperiodic_speeds": statuses.count("aperiodic"),
        "largest": [named(each) for each in largest_responses(branch)],
        "peaks": [named(peak) for peak in find_peaks(branch)],
        "jumps": [named(jump) for jump in find_jumps(branch, other)],
    }


def _warnings(result: SweepResult) -> Iterator[str]:
    """Where the largest values of a torque cannot be physical, mesh by mesh."""
    from fegear.unphysical import Extremes, doubts

    for torque in dict.fromkeys(torque for torque, _ in result.found):
        responses = [
            response
            for at, branch in (*result.found, *result.beside)
            for response in branch.responses
            if at == torque and response.status != "diverged"
        ]
        for m, mesh in enumerate(result.gear_set.meshes if responses else ()):
            yield from doubts(
                Extremes(
                    where=f"mesh {m + 1} at {torque:g} N m",
                    module=mesh.pair.driver.module,
                    transmission_error=max(float(r.dte_peak[m]) for r in responses),
                    backlash=mesh.backlash,
                    back_side=max(float(r.back_side[m]) for r in responses),
                )
            )


def print_sweep(values: dict[str, Any]) -> None:
    console = screen()
    lines = ", ".join(f"{f:.1f}" for f in values["natural_frequencies_Hz"])
    first, last = values["first_speed_Hz"], values["last_speed_Hz"]
    span = f"{first:g} Hz" if first == last else f"{first:g} to {last:g} Hz"
    console.print(
        f"{values['gear_set']}, model {values['model']}, {values['excitation']}, "
        f"damping ratio {values['damping_ratio']:g}\n"
        f"natural frequencies that strain a mesh [Hz]: {lines}\n"
        f"{counted(values['speeds'], 'speed', 'speeds')}, {span} of the first mesh"
    )
    _print_branches(console, values["branches"], values["speeds"])
    if "model_1_branches" in values:
        console.print("Model-1 beside it")
        _print_branches(console, values["model_1_branches"], values["speeds"])
    console.print(f"wall time {values['wall_time_s']:.2f} s")


def _print_branches(
    console: Console, branches: list[dict[str, Any]], speeds: int
) -> None:
    title = "Largest vibration" if speeds > 1 else None
    if any(branch["peaks"] for branch in branches):
        console.print(_response_table("Peaks", _entries(branches, "peaks")))
    else:
        console.print(_response_table(title, _entries(branches, "largest")))
    if any(branch["jumps"] for branch in branches):
        console.print(_jump_table(_entries(branches, "jumps")))
    elif speeds > 1 and any(branch["finished_speeds"] > 1 for branch in branches):
        console.print("no jumps")
    for branch in branches:
        name = f"{branch['torque_Nm']:g} N m {branch['direction']}"
        done = branch["finished_speeds"]
        if branch["aperiodic_speeds"]:
            console.print(
                f"{name}: the motion did not repeat at {branch['aperiodic_speeds']} "
                f"of {counted(done, 'speed', 'speeds')}"
            )
        if not branch["complete"]:
            console.print(
                f"{name}: ended after {done} of {counted(speeds, 'speed', 'speeds')}"
            )


PLACE = ("torque\n[N m]", "direction", "mesh")  # of a response or jump
Entries = Sequence[tuple[dict[str, Any], dict[str, Any]]]  # branch, what it holds


def _entries(branches: Sequence[dict[str, Any]], kind: str) -> Entries:
    return [(branch, entry) for branch in branches for entry in branch[kind]]


def _response_table(title: str | None, entries: Entries) -> Any:
    """A row for each response; contact of the back flanks where there is any."""
    columns = ("at\n[Hz]", "RMS of\nDTE [um]", "peak\nforce [N]", "contact\nlost [%]")
    back = any(entry["back_side_fraction"] > 0.0 for _, entry in entries)
    table = ruled_table(*PLACE, *columns, title=title, words=("direction",))
    if back:
        table.add_column("back\nside [%]", justify="right")
    for branch, entry in entries:
        parts = [entry["contact_loss_fraction"], entry["back_side_fraction"]]
        table.add_row(
            *_place(branch, entry),
            f"{entry['frequency_Hz']:.6g}",
            number(1e6 * entry["dte_rms_m"], 4),
            number(entry["force_peak_N"], 4),
            *(f"{100.0 * part:.1f}" for part in parts[: 1 + back]),
        )
    return table


def _jump_table(entries: Entries) -> Any:
    columns = ("from\n[Hz]", "to\n[Hz]", "RMS of DTE\nfrom [um]", "to\n[um]")
    table = ruled_table(*PLACE, *columns, title="Jumps", words=("direction",))
    for branch, jump in entries:
        table.add_row(
            *_place(branch, jump),
            f"{jump['frequency_from_Hz']:.6g}",
            f"{jump['frequency_to_Hz']:.6g}",
            number(1e6 * jump["dte_rms_from_m"], 4),
            number(1e6 * jump["dte_rms_to_m"], 4),
        )
    return table


def _place(branch: dict[str, Any], entry: dict[str, Any]) -> tuple[str, str, str]:
    return f"{branch['torque_Nm']:g}", branch["direction"], str(entry["mesh"])


def _end(found: Branches, csv: Path | None) -> None:
    """Exit code 1 after a divergence, 130 after Ctrl-C; rows are written by then."""
    from lumped.motion import DivergedError

    last = [branch.responses[-1] for _, branch in found if branch.responses]
    diverged = [response for response in last if response.status == "diverged"]
    if diverged:
        error = DivergedError(diverged[0].frequency, diverged[0].settling_time)
        complain(f"{error}; finished speeds are in {csv}" if csv else str(error))
        raise typer.Exit(1)
    if not all(branch.complete for _, branch in found):
        if csv is not None and last:
            complain(f"finished speeds are in {csv}")
        raise KeyboardInterrupt
