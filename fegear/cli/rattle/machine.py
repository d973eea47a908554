"""What commands take of a machine: which one, and figures in place of its own."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from fegear.cli.options import limits_of
from fegear.cli.screen import say
from fegear.rattle.choice import NAME

if TYPE_CHECKING:
    from fegear.rattle.machines import NamedMachine

MachineName = Annotated[
    str,
    typer.Argument(metavar="MACHINE", help=NAME),
]
Velocity = Annotated[
    str | None,
    typer.Option(
        metavar="A:B",
        help="Speeds of departure that are looked at [rad per turn]. "
        "[default: 0 to 4 pi damping + 4 half backlashes, or what forcing can give]",
    ),
]


def print_machine(values: dict[str, Any]) -> None:
    """What it is, and what of it was not printed in its source."""
    say(f"{values['machine']}: {values['description'] or 'no description'}")
    for inference in values["inferences"]:
        say(f"inferred: {inference}")


def speeds_of(text: str | None, named: NamedMachine) -> tuple[float, float]:
    """Where none are given, up to the usual one of the machine's shafts."""
    if text is not None:
        wrong = f"--velocity = {text}; must be A:B from 0 on"
        return limits_of(wrong, text, least=0.0)
    from lumped.rattle.orbits import usual_speed

    return 0.0, usual_speed(named.assembly.shafts_in_impacts)
