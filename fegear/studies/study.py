"""What a study is: settings, tasks, and the result that they are gathered into.

A study is a frozen dataclass whose fields are settings:

    @dataclass(frozen=True, kw_only=True)
    class Noise(Study, command="rattle noise", example="rattle noise roots-scaled"):
        \"\"\"How loud a machine is.\"\"\"

        machine: MotionMachine
        starts: int = setting(1000, "Number of runs.", Range(1, 10_000_000))

        def tasks(self) -> Iterator[Task]: ...
        def gather(self, found: Mapping[str, Any]) -> NoiseResult: ...

`fegear.studies.running.run` computes it. The command line, checkpoints and messages
follow from the declaration. A field whose type is a dataclass stands for its fields.

A result has what `StudyResult` says. `fegear.studies` lists all studies.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import Field, dataclass, field, fields, is_dataclass
from math import inf
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar, Protocol, get_type_hints

from fegear.errors import InputError
from fegear.result import Result

if TYPE_CHECKING:
    import numpy as np
    from matplotlib.figure import Figure
    from numpy.typing import NDArray
    from pandas import DataFrame

    from fegear.studies.page import Page
    from fegear.studies.table import Table

    Arrays = Mapping[str, NDArray[np.generic]]

PLOT = {"plot": "Draw the results into this file, .png, .pdf or .svg."}


@dataclass(frozen=True)
class Range:
    """Numbers that a setting takes: from or above, and to or below."""

    least: float = -inf
    most: float = inf
    unit: str = ""
    above: float = -inf
    below: float = inf

    def __contains__(self, value: float) -> bool:
        inside = self.least <= value <= self.most
        return inside and self.above < value < self.below

    def __str__(self) -> str:
        low = f"above {self.above:.12g}" if self.least == -inf else f"{self.least:.12g}"
        high = f"below {self.below:.12g}" if self.most == inf else f"{self.most:.12g}"
        return f"{low} to {high} {self.unit}".strip()


@dataclass(frozen=True, kw_only=True)
class Setting:
    """How a field is described, limited, and written in words.

    option : its name on the command line, that of the field where it is empty; a field
        with `place` has none, it is found by its place
    read, write : between the text of a command and the value, where types do not say
    """

    text: str
    allowed: Range | None = None
    option: str = ""
    place: str = ""
    metavar: str | None = None
    read: Callable[[str], Any] | None = None
    write: Callable[[Any], str] = str  # of floats to the last bit


def setting(default: Any, text: str, allowed: Range | None = None, **words: Any) -> Any:
    """A field of a study; words : see `Setting`."""
    declared = Setting(text=text, allowed=allowed, **words)
    return field(default=default, metadata={"setting": declared})


def argument(place: str, text: str) -> Any:
    """A field that must be given, first of all words of a command."""
    return field(metadata={"setting": Setting(text=text, place=place)})


def setting_of(each: Field[Any]) -> Setting | None:
    """None for a group of settings."""
    found: Setting | None = each.metadata.get("setting")
    return found


def option_of(each: Field[Any]) -> str:
    """The option of a field."""
    declared = setting_of(each)
    named = declared.option if declared is not None else ""
    return named or f"--{each.name.replace('_', '-')}"


def words_of(settings: Any) -> list[str]:
    """Words of a command line from which settings that are no default are read."""
    places, options = list[str](), list[str]()
    for each in fields(settings):
        value, declared = getattr(settings, each.name), setting_of(each)
        if declared is None:
            options += words_of(value)
        elif declared.place:
            places.append(str(value))
        elif value != each.default:
            name = option_of(each)
            options += [name] if value is True else [name, declared.write(value)]
    return [*places, *options]


def require_settings(settings: Any) -> None:
    """Fields are what their types and ranges say; else InputError with the field."""
    from lumped.checks import require_fields

    try:
        unbounded = [name for name, value in vars(settings).items() if value == inf]
        require_fields(settings, infinite=unbounded)
    except ValueError as error:
        raise InputError(str(error)) from None
    for each in fields(settings):
        declared, value = setting_of(each), getattr(settings, each.name)
        if declared is None or declared.allowed is None or value is None:
            continue
        if value not in declared.allowed:
            raise InputError(f"{each.name} = {value:.12g}; allowed {declared.allowed}")


Draw = Callable[[], "Figure"]


class Job(Protocol):
    """What a task may use while it works."""

    kept: list[Any]  # records of an earlier run, in order
    state: Arrays | None  # where the last of them ended

    def keep(self, record: Mapping[str, Any], state: Arrays) -> None:
        """The next record, which JSON can hold, and the state to go on from."""

    def report(self, what: str, done: int, total: int) -> None:
        """Progress. Raises Stopped where the run is to end."""


class Stopped(Exception):
    """Ends a task early; what it has kept is not lost."""


@dataclass(frozen=True)
class Task:
    """A part of a study that depends on no other.

    key : its name in checkpoints, unique in the study
    work : computes what it gives, in any thread
    """

    key: str
    work: Callable[[Job], Any]


@dataclass(frozen=True)
class Study:
    """Base of all studies; see the top of this file."""

    command: ClassVar[str]
    example: ClassVar[str]
    pictures: ClassVar[Mapping[str, str]] = PLOT  # options that take a file, with help
    resumes: ClassVar[bool] = False  # whether tasks keep records

    def __init_subclass__(cls, *, command: str, example: str, **words: Any) -> None:
        super().__init_subclass__(**words)
        cls.command, cls.example = command, f"fegear {example}"

    def __post_init__(self) -> None:
        for each in fields(self):  # a name in place of a group that has one
            value, kind = getattr(self, each.name), _kind_of(self, each)
            if isinstance(value, str) and is_dataclass(kind):
                named: Any = kind
                object.__setattr__(self, each.name, named(name=value))
        require_settings(self)

    def idle(self, given: Collection[str]) -> Iterator[tuple[str, str]]:
        """Names of outputs and settings that would change nothing, with the reason.

        given : names of the outputs that are asked for
        Other names are in braces in the reasons, as in `needs {kind} event`.
        """
        return iter(())

    def tasks(self) -> Iterable[Task]:
        """All parts; InputError for what cannot be computed."""
        raise NotImplementedError

    def gather(self, found: Mapping[str, Any]) -> Any:
        """The result of what tasks gave, by their keys; that of an only one."""
        (result,) = found.values()
        return result

    @property
    def words(self) -> list[str]:
        """Words of the command line that ask for this study."""
        return [*self.command.split(), *words_of(self)]

    @property
    def inputs(self) -> dict[str, str]:
        """All that determines the records of a checkpoint.

        A study whose settings name files has their texts here as well.
        """
        return {each.name: repr(getattr(self, each.name)) for each in fields(self)}


def _kind_of(study: Study, each: Field[Any]) -> Any:
    return get_type_hints(type(study))[each.name]


class StudyResult(Result):
    """What a study found; a frozen dataclass.

    study : what was asked for
    summary : plain values for JSON, warnings among them
    figures : by name, functions that draw the pictures of the study
    """

    study: Any
    summary: Any
    figures: Any = MappingProxyType({})

    @property
    def table(self) -> Table:
        raise NotImplementedError

    def page(self) -> Page:
        """What the screen shows."""
        raise NotImplementedError

    def to_csv(self, path: str | Path) -> None:
        """Write the table. Raises InputError where the file cannot be written."""
        from fegear.output import write_text

        write_text(Path(path), self.table.csv())

    def to_frame(self) -> DataFrame:
        """The table as a pandas frame; ImportError where pandas is missing."""
        return self.table.to_frame()

    def draw(self, path: str | Path, name: str = "plot") -> None:
        """Draw a picture by the ending of the path: .png, .pdf or .svg."""
        from fegear.output import write_whole
        from fegear.plots import save_figure

        if name not in self.figures:
            raise InputError(f"name = {name}; drawn are {', '.join(self.figures)}")
        figure = self.figures[name]
        write_whole(Path(path), lambda place: save_figure(figure(), place))
