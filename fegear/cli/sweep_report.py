"""What a sweep writes, draws and prints, of lumped models and of finite elements."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from fegear.cli.options import Outputs
from fegear.cli.screen import Cells, cell, complain, counted, filled_table, screen

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from rich.console import Console

    from fegear.sweeps import Branches, SweepResult


def show_sweep(result: SweepResult, outputs: Outputs, begin: float) -> None:
    """Write, draw and print; exits after a divergence or Ctrl-C.

    begin : clock when the work began
    """
    if any(branch.responses for _, branch in result.found):
        if outputs.output is not None:
            result.to_csv(outputs.output)
        outputs.draw(lambda: _figure(result))
    values = result.summary
    values["wall_time_s"] = round(time.perf_counter() - begin, 3)
    outputs.show(values, print_sweep)
    _end(result.found, outputs.output)


def title_of_sweep(result: SweepResult) -> str:
    """The gear set, the model and what was edited."""
    from fegear.headings import friction_in_words, friction_of, sliding_of
    from fegear.sweeps import edits_in_words

    header = result.header
    rubs = friction_in_words(friction_of(header), sliding_of(header))
    return (
        f"{header['gear set']}, model {result.model}, {header['excitation']}, "
        f"damping ratio {float(header['damping ratio']):g}{rubs}\n"
        f"{edits_in_words(header)}"
    ).strip()


def _figure(result: SweepResult) -> Figure:
    from lumped.figures import Curve, draw_sweep

    name = result.model if result.beside else ""
    curves = [Curve(torque, branch, name) for torque, branch in result.found]
    curves += [Curve(torque, branch, "Model-1") for torque, branch in result.beside]
    return draw_sweep(
        curves, title_of_sweep(result), f"natural frequency {result.natural}"
    )


def print_sweep(values: dict[str, Any]) -> None:
    from fegear.headings import friction_of_summary

    console = screen()
    lines = ", ".join(f"{f:.1f}" for f in values["natural_frequencies_Hz"])
    first, last = values["first_speed_Hz"], values["last_speed_Hz"]
    span = f"{first:g} Hz" if first == last else f"{first:g} to {last:g} Hz"
    console.print(
        f"{values['gear_set']}, model {values['model']}, {values['excitation']}, "
        f"damping ratio {values['damping_ratio']:g}"
        f"{friction_of_summary(values)}\n"
        f"natural frequencies {values['natural_frequencies']} that strain a mesh "
        f"[Hz]: {lines}\n"
        f"{counted(values['speeds'], 'speed', 'speeds')}, {span} of the first mesh"
    )
    if values.get("body_modes") is not None:
        console.print(
            f"body modes of the gears {values['body_modes']}; those left out "
            f"{values['body_modes_left_out']}"
        )
    _print_branches(console, values["branches"], values["speeds"])
    if "model_1_branches" in values:
        console.print("Model-1 beside it")
        _print_branches(console, values["model_1_branches"], values["speeds"])
    console.print(f"wall time {values['wall_time_s']:.2f} s")


def _print_branches(
    console: Console, branches: list[dict[str, Any]], speeds: int
) -> None:
    title: str | None = "Peaks"
    kind = "peaks"
    if not any(branch["peaks"] for branch in branches):
        kind, title = "largest", "Largest vibration" if speeds > 1 else None
    responses = [branch | entry for branch in branches for entry in branch[kind]]
    touches_back = any(row["back_side_fraction"] > 0.0 for row in responses)
    columns = RESPONSE | BACK if touches_back else RESPONSE
    console.print(filled_table(columns, responses, title, WORDS))
    jumps = [branch | jump for branch in branches for jump in branch["jumps"]]
    if jumps:
        console.print(filled_table(JUMP, jumps, "Jumps", WORDS))
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


WORDS = ("direction",)  # columns of text
PLACE: Cells = {
    "torque\n[N m]": lambda row: f"{row['torque_Nm']:g}",
    "direction": lambda row: str(row["direction"]),
    "mesh": lambda row: str(row["mesh"]),
}
RESPONSE: Cells = PLACE | {
    "at\n[Hz]": lambda row: f"{row['frequency_Hz']:.6g}",
    "RMS of\nDTE [um]": cell("dte_rms_m", 1e6, 4),
    "peak\nforce [N]": cell("force_peak_N", figures=4),
    "contact\nlost [%]": lambda row: f"{100.0 * row['contact_loss_fraction']:.1f}",
}
BACK: Cells = {
    "back\nside [%]": lambda row: f"{100.0 * row['back_side_fraction']:.1f}",
}
JUMP: Cells = PLACE | {
    "from\n[Hz]": lambda row: f"{row['frequency_from_Hz']:.6g}",
    "to\n[Hz]": lambda row: f"{row['frequency_to_Hz']:.6g}",
    "RMS of DTE\nfrom [um]": cell("dte_rms_from_m", 1e6, 4),
    "to\n[um]": cell("dte_rms_to_m", 1e6, 4),
}


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
