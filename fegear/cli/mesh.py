"""fegear mesh: write the finite-element mesh of a gear."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fegear.cli.options import Resolution, SetName, require
from fegear.cli.screen import say

EXAMPLE = "fegear mesh liu-idler --gear 2 --whole -o idler.vtu"


def mesh_command(
    output: Annotated[
        Path,
        typer.Option(
            "-o", "--output", help="File to write [m]; its ending is .msh or .vtu."
        ),
    ],
    set_name: SetName = "liu-pair",
    gear: Annotated[int, typer.Option(help="Number of the gear, counted from 1.")] = 1,
    resolution: Resolution = None,
    whole: Annotated[
        bool,
        typer.Option("--whole", help="Write all teeth instead of one tooth sector."),
    ] = False,
) -> None:
    """Write the finite-element mesh of a gear.

    One tooth sector, or all of them, of second-order triangles.
    """
    from fegear.errors import InputError
    from fegear.gearset import load_gear_set
    from fegear.output import require_writable, write_whole
    from meshes.files import FORMATS, write_mesh

    if output.suffix not in FORMATS:
        raise InputError(f"--output = {output}; allowed endings .msh and .vtu")
    require_writable(output)
    gear_set = load_gear_set(set_name)
    count = len(gear_set.gears)
    require(1 <= gear <= count, "--gear", gear, f"{gear_set.name} has {count} gears")
    from fegear.statics import RESOLUTIONS
    from meshes import sector_mesh

    geometry = gear_set.gears[gear - 1].geometry
    mesh = sector_mesh(geometry, RESOLUTIONS[resolution or "default"].size)
    copies = geometry.teeth if whole else 1
    write_whole(output, lambda path: write_mesh(mesh, path, copies, geometry.teeth))
    say(
        f"{output}: {copies * len(mesh.triangles)} triangles, "
        f"{copies * len(mesh.points)} nodes"
    )
