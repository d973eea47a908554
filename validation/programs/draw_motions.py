"""A figure of the motions of Exudyn and of ROSS beside ours.

    python -m validation.programs.draw_motions files exudyn -o motions.png

The program, exudyn or ross, must be installed, and matplotlib with it.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from validation.programs import exudyn_pair, ross_pair
from validation.programs.export_files import LINEAR, NONLINEAR
from validation.programs.exported_pair import MeshMotion, read_motion, read_pair

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Motions = dict[str, MeshMotion]
ROSS_STEPS = 128  # per period


def motions_of(program: str, folder: Path, speed: float) -> Motions:
    """Motions of the program at a mesh frequency [Hz], by what is special in them."""
    pair = read_pair(folder)
    if program == "exudyn":
        return {"Exudyn": exudyn_pair.simulate_pair(pair, speed)}
    motions = {"ROSS": ross_pair.simulate_pair(pair, speed, ROSS_STEPS, False)}
    if speed == NONLINEAR:
        parting = ross_pair.simulate_pair(pair, speed, ROSS_STEPS, True)
        motions["ROSS, teeth that part"] = parting
    return motions


def draw_motions(ours: dict[int, MeshMotion], theirs: dict[int, Motions]) -> Figure:
    """Deflection over a mesh period, a panel for each mesh frequency [Hz]."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 3.6), dpi=110, layout="constrained")
    panels = figure.subplots(1, len(ours))
    for axes, (speed, motion) in zip(panels, ours.items(), strict=True):
        axes.plot(motion.time * speed, 1e6 * motion.deflection, lw=3, label="fegear")
        for (name, other), style in zip(
            theirs[speed].items(), ("--", ":"), strict=False
        ):
            axes.plot(other.time * speed, 1e6 * other.deflection, style, label=name)
        axes.axhline(0.0, color="0.6", lw=0.8)
        axes.set(title=f"{speed} Hz", xlabel="mesh periods", ylabel="deflection [um]")
        axes.legend()
    return figure


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("program", choices=("exudyn", "ross"))
    parser.add_argument("-o", "--output", type=Path, required=True)
    arguments = parser.parse_args()
    speeds = LINEAR, NONLINEAR
    ours = {speed: read_motion(arguments.folder, speed) for speed in speeds}
    theirs = {
        speed: motions_of(arguments.program, arguments.folder, speed)
        for speed in speeds
    }
    draw_motions(ours, theirs).savefig(arguments.output)


if __name__ == "__main__":
    main()
