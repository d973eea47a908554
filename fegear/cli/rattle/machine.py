"""What commands take of a machine: which one, and figures in place of its own."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fegear.cli.groups import Range, option
from fegear.cli.options import limits_of
from fegear.cli.screen import say
from fegear.errors import InputError

if TYPE_CHECKING:
    from fegear.rattle.machines import NamedMachine

ABOVE = Range(least=1e-9, most=1e9)
MachineName = Annotated[
    str,
    typer.Argument(metavar="MACHINE", help="Built-in machine or path of a TOML file."),
]
Velocity = Annotated[
    str | None,
    typer.Option(
        metavar="A:B",
        help="Speeds of departure that are looked at [rad per turn]. "
        "[default: 0 to 4 pi damping + 4 half backlashes, or what forcing can give]",
    ),
]


@dataclass(frozen=True, kw_only=True)
class LoadFigures:
    """Dimensionless figures in place of the machine's that press the flanks."""

    delta: float | None = option(
        "Damping coefficient over inertia and speed. [default: the machine's]",
        allowed=ABOVE,
    )
    epsilon: float | None = option(
        "Eccentricity, as an angle [rad]. [default: the machine's]",
        allowed=Range(least=0.0, most=1e3),
    )
    kappa: float | None = option(
        "Stiffness coefficient of the flanks over inertia and speed squared; inf for "
        "impacts. [default: the machine's]",
    )

    def __post_init__(self) -> None:
        kappa = self.kappa
        if kappa is not None and not (1e-9 <= kappa <= 1e15 or kappa == math.inf):
            raise InputError(
                f"--kappa = {kappa:g}; allowed from 1e-9 to 1e15, inf of impacts"
            )

    def load(self, name: str) -> NamedMachine:
        """The machine with these figures."""
        from fegear.rattle.machines import load_machine

        given = {k: v for k, v in self.given.items() if v is not None}
        return load_machine(name, given)

    @property
    def given(self) -> dict[str, float | None]:
        """By the names of the machine's figures."""
        return {
            "damping": self.delta,
            "eccentricity": self.epsilon,
            "stiffness": self.kappa,
        }


@dataclass(frozen=True, kw_only=True)
class MotionFigures(LoadFigures):
    """All dimensionless figures in place of the machine's."""

    beta: float | None = option(
        "Half of the backlash, as an angle [rad]. [default: the machine's]",
        allowed=ABOVE,
    )
    restitution: float | None = option(
        "Ratio of speeds after and before an impact, the coefficient of restitution. "
        "[default: the machine's]",
        allowed=Range(least=0.0, most=1.0),
    )

    @property
    def given(self) -> dict[str, float | None]:
        own = {"half_backlash": self.beta, "restitution": self.restitution}
        return super().given | own


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
