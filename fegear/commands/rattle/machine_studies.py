"""Machine of a study, with overridden parameters."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Self

from fegear.files.codes import with_code
from fegear.files.contents import exact_repr
from fegear.files.speed_ranges import parsed_limits
from fegear.studies.settings import argument, display_name, require_settings, setting
from lumped.common.options import Range
from lumped.rattle.return_map import DEFAULT_RETURNS

if TYPE_CHECKING:
    from fegear.commands.rattle.machines import NamedMachine

MIN_RETURNS, MAX_RETURNS = 100, 10_000_000  # until motions count as settled
Z_95 = 1.96  # standard errors of an interval that holds the value 19 times of 20
POSITIVE = Range(1e-9, 1e9)
NAME = "Built-in machine or path of a TOML file."


SPEEDS = (
    "Range of lift-off speeds [rad per turn]. [default: 0 to 4 pi damping + 4 "
    "half backlashes, or the largest that forcing allows]"
)


def limits(name: str, text: str = SPEEDS) -> Any:
    """A setting of two rising values from 0 on, A:B as text, None by default."""

    def read(value: str) -> tuple[float, float]:
        return parsed_limits(
            f"{name} = {value}; must be A:B from 0 on", value, least=0.0
        )

    def write(values: tuple[float, float]) -> str:
        return f"{values[0]!r}:{values[1]!r}"

    return setting(None, text, metavar="A:B", parse=read, write=write)


@dataclass(frozen=True, kw_only=True)
class LoadParameters:
    """Overridden dimensionless parameters that press the flanks."""

    delta: float | None = setting(
        None,
        "Damping coefficient over inertia and speed. [default: the machine's]",
        POSITIVE,
    )
    epsilon: float | None = setting(
        None,
        "Eccentricity, as an angle [rad]. [default: the machine's]",
        Range(0.0, 1e3),
    )
    kappa: float | None = setting(
        None,
        "Stiffness coefficient of the flanks over inertia and speed squared; inf for "
        "impacts. [default: the machine's]",
        Range(1e-9, 1e15, or_infinite=True),
    )

    def __post_init__(self) -> None:
        require_settings(self)

    def load(self, name: str) -> NamedMachine:
        """The machine with these figures."""
        from fegear.commands.rattle.machines import load_machine

        overrides = {k: v for k, v in self.overrides.items() if v is not None}
        return load_machine(name, overrides)

    @property
    def overrides(self) -> dict[str, float | None]:
        """Values by the names of the machine's parameters."""
        return {
            "damping": self.delta,
            "eccentricity": self.epsilon,
            "stiffness": self.kappa,
        }


@dataclass(frozen=True, kw_only=True)
class MotionParameters(LoadParameters):
    """All dimensionless parameters, overridden."""

    beta: float | None = setting(
        None,
        "Half of the backlash, as an angle [rad]. [default: the machine's]",
        POSITIVE,
    )
    restitution: float | None = setting(
        None,
        "Ratio of speeds after and before an impact, the coefficient of restitution. "
        "[default: the machine's]",
        Range(0.0, 1.0),
    )

    @property
    def overrides(self) -> dict[str, float | None]:
        contact = {"half_backlash": self.beta, "restitution": self.restitution}
        return super().overrides | contact


@dataclass(frozen=True, kw_only=True)
class LoadMachineRef(LoadParameters):
    """A machine by its name, with overridden parameters."""

    name: str = argument("MACHINE", NAME, reads=True)

    @classmethod
    def of(cls, value: str) -> Self:
        """A machine by its name."""
        return cls(name=value)

    @cached_property
    def named(self) -> NamedMachine:
        return self.load(self.name)


@dataclass(frozen=True, kw_only=True)
class MotionMachineRef(MotionParameters, LoadMachineRef):
    """A machine by its name, with overridden parameters of its motion."""

    @property
    def inputs(self) -> str:
        """The machine itself, whatever it is called."""
        return exact_repr(self.named.assembly)


@dataclass(frozen=True, kw_only=True)
class MachineStudy:
    """Settings of all studies of lift-offs from the upper flank of a machine."""

    machine: MotionMachineRef
    velocity: tuple[float, float] | None = limits("velocity")

    @property
    def named(self) -> NamedMachine:
        """The machine with the overridden parameters, and its name."""
        return self.machine.named

    @property
    def speeds(self) -> tuple[float, float]:
        """Lowest and highest speed of lift-offs [rad per turn]."""
        from lumped.rattle.orbits import default_speed

        return self.velocity or (
            0.0,
            default_speed(self.named.assembly.shafts_in_impacts),
        )


def default_returns(settling: float) -> int:
    """Returns after which motions count as settled unless a study says otherwise.

    They are those in which transients end at the machine's damping, and those of the
    source where that is out of reach or not a number of returns.

    settling : returns in which transients end, see `settling_returns`
    """
    return int(settling) if settling <= MAX_RETURNS else DEFAULT_RETURNS


def not_converged_warning(
    study: Any, part: float, subject: str, iterations: int, needed: int
) -> str:
    """Warning about undecided runs, and the iterations that they need."""
    name = display_name(study, "iterations")
    more = f"half the damping ends transients in {needed}: {name} {needed}"
    if needed > MAX_RETURNS:
        more = (
            f"half the damping ends transients in {needed:.3g}, which {name} "
            f"cannot be: {MAX_RETURNS} are the most"
        )
    elif iterations >= needed:
        more = "irregular motion may last long before it ends"
        if iterations < MAX_RETURNS:
            more += f": more {name}"
    return with_code(
        "W22",
        f"{100.0 * part:.3g} % of the {subject} have reached no attractor in "
        f"{iterations} returns; {more}",
    )
