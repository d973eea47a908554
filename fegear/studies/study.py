"""Base of studies: settings, tasks, and the result that is made of them.

A study is a frozen dataclass whose fields are settings:

    @dataclass(frozen=True, kw_only=True)
    class Noise(Study, command="rattle noise", example="rattle noise roots-scaled"):
        \"\"\"How loud a machine is.\"\"\"

        machine: MotionMachine
        starts: int = setting(1000, "Number of runs.", Range(1, 10_000_000))

        def tasks(self) -> Iterator[Task]: ...
        def gather(self, results: Mapping[str, Any]) -> NoiseResult: ...

`fegear.studies.running.run` computes it. The command line, checkpoints and messages
follow from the declaration. A field whose type is a dataclass represents its fields;
by `group` it may be a class of the library that knows of no options.

A result has what `StudyResult` says. `fegear.studies` lists all studies.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from contextvars import ContextVar
from dataclasses import MISSING, Field, dataclass, field, fields, is_dataclass, replace
from functools import lru_cache
from itertools import chain
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar, Protocol, get_type_hints

from fegear.files.errors import InputError
from fegear.files.output import INTO_PICTURE, TABLES, TO_TABLE
from fegear.result import Result
from lumped.common.docstrings import set_lazy_docstring
from lumped.common.options import Range, allowed_of, help_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame

    from fegear.studies.page import Page
    from fegear.studies.table import Table
    from lumped.common.workers import Arrays, Cluster, Parts, Stop


NO_PICTURES: Mapping[str, str] = MappingProxyType({})
PLOT = {"plot": f"Draw the results {INTO_PICTURE}."}


@dataclass(frozen=True, kw_only=True)
class Setting:
    """Help, limits and text form of a field.

    text : that of the field itself where it is empty
    option : its name on the command line, that of the field where it is empty; a field
        with `place` has none, it is found by its place; short : another one
    former : spelling of earlier versions, which is accepted and not in the help
    flags : options without a value: name, value that it means, help; a field of
        truth values that has some has no other option
    reads : whether it names files that are read; checkpoints depend on their content
    parse, write : convert text to a value and back, where types do not say how
    several : whether the option is repeated for a tuple of values that are read, of
        which a text may give more than one, as a tuple
    one_or_list : whether one number is a list of one, or such a list is the number
    """

    text: str = ""
    allowed: Range | None = None
    option: str = ""
    short: str = ""
    former: str = ""
    place: str = ""
    metavar: str | None = None
    flags: tuple[tuple[str, Any, str], ...] = ()
    reads: bool = False
    several: bool = False
    one_or_list: bool = False
    parse: Callable[[str], Any] | None = None
    write: Callable[[Any], str] = str  # of floats to the last bit


UnusedOptions = Callable[[Any], Iterator[tuple[str, str]]]


@dataclass(frozen=True, kw_only=True)
class SettingsGroup:
    """A field whose value has settings of its own.

    kind : its class; exposed : which fields of it are settings here, and how
    unused_options : as `Study.unused_options`, of a value of the class
    default : its value where it is not given, None for that of the class
    """

    kind: type
    exposed: Mapping[str, Setting | SettingsGroup]
    unused_options: UnusedOptions = lambda value: iter(())
    default: Any = None


def expose(
    *names: str, **changes: Setting | SettingsGroup
) -> dict[str, Setting | SettingsGroup]:
    """Fields of a class of options, in order, some with changes on the command line."""
    return {name: changes.get(name, Setting()) for name in names}


def setting(
    default: Any, text: str, allowed: Range | None = None, **options: Any
) -> Any:
    """A field of a study; options : see `Setting`."""
    declared = Setting(text=text, allowed=allowed, **options)
    return field(default=default, metadata={"setting": declared})


def setting_of(kind: type, name: str, **options: Any) -> Any:
    """A field of a study that is the option of a class; options : see `Setting`."""
    entry = next(entry for entry in fields(kind) if entry.name == name)
    text = help_of(kind, name)
    return setting(entry.default, text, allowed_of(entry), **options)


def argument(place: str, text: str, default: Any = MISSING, reads: bool = False) -> Any:
    """A positional argument of a command.

    reads : whether it is, or may be, the name of a file that is read
    """
    declared = Setting(text=text, place=place, reads=reads)
    return field(default=default, metadata={"setting": declared})


def group(declared: SettingsGroup) -> Any:
    """A field with settings of its own, by default those of the group."""
    metadata = {"group": declared}
    if declared.default is not None:
        return field(default=declared.default, metadata=metadata)
    return field(default_factory=declared.kind, metadata=metadata)


@dataclass(frozen=True)
class ExposedField:
    """A setting of a class, as a study or group offers it."""

    field: Field[Any]
    kind: Any  # annotated type
    declared: (
        Setting | SettingsGroup | None
    )  # None for a dataclass with its own settings
    default: Any

    @property
    def name(self) -> str:
        return self.field.name

    @property
    def option(self) -> str:
        """Its name on the command line."""
        named = self.declared.option if isinstance(self.declared, Setting) else ""
        return named or f"--{self.name.replace('_', '-')}"

    @property
    def group(self) -> SettingsGroup | None:
        """The group that it represents, if it does."""
        if self.declared is None:
            return group_of(self.kind)
        return self.declared if isinstance(self.declared, SettingsGroup) else None


def parse_setting(member: ExposedField, text: str) -> Any:
    """Parse a setting from its command-line text."""
    parse = getattr(member.declared, "parse", None)
    if parse is None:
        raise InputError(f"{member.name} = {text}; is no setting that text gives")
    try:
        return parse(text)
    except InputError:
        raise
    except ValueError as error:
        raise InputError(f"{member.name} = {text}; {error}") from None


def parse_several(member: ExposedField, values: Iterable[Any]) -> tuple[Any, ...]:
    """Values of a setting that is repeated, each of which may be given as text."""
    return tuple(chain.from_iterable(_parsed_values(member, v) for v in values))


def _parsed_values(member: ExposedField, value: Any) -> tuple[Any, ...]:
    parsed = parse_setting(member, value) if isinstance(value, str) else value
    gives_several = isinstance(value, str) and type(parsed) is tuple
    return parsed if gives_several else (parsed,)


@lru_cache(maxsize=256)
def _type_hints(kind: Any) -> dict[str, Any]:
    """Types of the fields of a class, which take long to resolve."""
    return get_type_hints(kind)


@lru_cache(maxsize=256)
def declared_fields(kind: Any) -> dict[str, Any]:
    """Declared fields of a dataclass, in the order of its help.

    What is found by its place comes first, then its settings, then groups; None for a
    dataclass with its own settings.
    """
    declarations = dict[str, Any]()
    ranks, hints = dict[str, int](), _type_hints(kind)
    for member in fields(kind):
        declared = member.metadata.get("setting") or member.metadata.get("group")
        inner = is_dataclass(hints[member.name])
        if declared is None and not inner:
            continue
        settings = (
            (declared,) if declared else declared_fields(hints[member.name]).values()
        )
        placed = any(getattr(setting, "place", "") for setting in settings)
        declarations[member.name] = declared
        ranks[member.name] = 0 if placed else 1 + (not isinstance(declared, Setting))
    return {
        name: declarations[name] for name in sorted(declarations, key=ranks.__getitem__)
    }


def exposed_fields(group: SettingsGroup) -> Iterator[ExposedField]:
    """Settings of a group, in order."""
    hints, by_name = _type_hints(group.kind), {f.name: f for f in fields(group.kind)}
    options = {
        name: getattr(declared, "option", "") or f"--{name.replace('_', '-')}"
        for name, declared in group.exposed.items()
    }
    for name, declared in group.exposed.items():
        entry = by_name[name]
        default = getattr(group.default, name, entry.default)
        if isinstance(declared, Setting):
            text = declared.text or help_of(group.kind, name, options)
            declared = replace(declared, text=text)
        yield ExposedField(entry, hints[name], declared, default)


def to_argv(settings: Any, group: SettingsGroup | None = None) -> list[str]:
    """Command-line arguments that give the settings which are not default."""
    places, options = list[str](), list[str]()
    group = group or group_of(settings)
    if not isinstance(settings, group.kind):
        raise InputError(f"{settings!r} has no words of a command")
    for member in exposed_fields(group):
        value = getattr(settings, member.name)
        if member.group is not None:
            options += to_argv(value, member.group)
            continue
        declared = member.declared
        if not isinstance(declared, Setting):
            continue
        if declared.place:
            places += map(str, value if isinstance(value, tuple) else [value])
        elif value != member.default:
            options += _written(declared.short or member.option, declared, value)
    return [*places, *options]


def _one_or_list(value: Any, several: bool) -> Any:
    """One number for a setting of several, and the only one of a list for one."""
    if several:
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        return (value,) if is_number else value
    is_list = isinstance(value, list | tuple) and len(value) == 1
    return value[0] if is_list else value


def options_of(group: SettingsGroup) -> dict[str, str]:
    """Options by the names of settings, those of groups among them."""
    options: dict[str, str] = {}
    for member in exposed_fields(group):
        if member.group is not None:
            options = options_of(member.group) | options
        elif not getattr(member.declared, "place", ""):
            options[member.name] = member.option
    return options


def group_of(settings: Any) -> SettingsGroup:
    """Fields that a dataclass, or a value of one, declares itself."""
    kind = settings if isinstance(settings, type) else type(settings)
    return SettingsGroup(kind=kind, exposed=declared_fields(kind))


def _written(option: str, declared: Setting, value: Any) -> list[str]:
    for flag, meant, _ in declared.flags:
        if value == meant and type(value) is type(meant):
            return [flag]
    if isinstance(value, bool):
        return [option if value else option.replace("--", "--no-", 1)]
    single = declared.parse is not None and not declared.several
    values = value if isinstance(value, tuple) and not single else (value,)
    return [word for element in values for word in (option, declared.write(element))]


def take_plain_values(settings: Any) -> None:
    """Lists and arrays become tuples, paths text, and numbers Python's."""
    for name, value in vars(settings).items():
        if value is not (plain := _plain(value)):
            object.__setattr__(settings, name, plain)


def _plain(value: Any) -> Any:
    from lumped.common.checks import plain_numbers

    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, list | range) or type(value) is tuple:
        return tuple(map(_plain, value))
    return plain_numbers(value)


def require_settings(settings: Any) -> None:
    """Raise InputError for a field outside its type or range.

    See also `take_plain_values`.
    """
    from lumped.common.checks import format_value, is_number, require_fields

    take_plain_values(settings)
    infinite = []
    for member in exposed_fields(group_of(settings)):
        allowed = getattr(member.declared, "allowed", None)
        if allowed is None:
            continue
        infinite += [member.name] * allowed.or_infinite
        values = getattr(settings, member.name)
        for value in values if isinstance(values, tuple) else (values,):
            if is_number(value) and value not in allowed:
                text = shown(value) if isinstance(value, float) else format_value(value)
                raise InputError(f"{member.name} = {text}; allowed {allowed}")
    try:
        require_fields(settings, infinite=infinite)
    except ValueError as error:
        raise InputError(str(error)) from None


# whether messages call settings by their options, as on the command line
AS_OPTIONS = ContextVar("AS_OPTIONS", default=False)


def display_name(settings: Any, name: str) -> str:
    """Name of a setting in messages: its option or its field."""
    return _called(group_of(settings), name)


def _called(group: SettingsGroup, name: str) -> str:
    return options_of(group).get(name, name) if AS_OPTIONS.get() else name


def refuse_unused_settings(settings: Any, group: SettingsGroup) -> None:
    """Raise InputError for a setting that is given and changes nothing."""
    if not isinstance(settings, group.kind):
        return
    for member in exposed_fields(group):
        if member.group is not None:
            refuse_unused_settings(getattr(settings, member.name), member.group)
    defaults = {member.name: member.default for member in exposed_fields(group)}
    for name, reason in group.unused_options(settings):
        if name in defaults and getattr(settings, name) != defaults[name]:
            raise refusal(settings, name, reason, group)


def refusal(
    settings: Any, name: str, reason: str, group: SettingsGroup | None = None
) -> InputError:
    """Why the value of a setting is refused; names in braces are those of settings."""
    group = group or group_of(settings)
    value, names = getattr(settings, name), options_of(group)
    value_text = "" if value is True else f" = {shown(value)}"
    called = _called(group, name)
    for flag, meant, _ in getattr(group.exposed.get(name), "flags", ()):
        if AS_OPTIONS.get() and value == meant:
            called, value_text = flag, ""
    reason = reason.format_map({key: _called(group, key) for key in names})
    return InputError(f"{called}{value_text}; {reason}")


def refuse_given(
    settings: Any, names: Sequence[str], reason: str, group: SettingsGroup
) -> None:
    """Refuse the settings that are not the default; see `refusal`."""
    usual = group.kind() if group.default is None else group.default
    for name in names:
        if getattr(settings, name) != getattr(usual, name):
            raise refusal(settings, name, reason, group)


def shown(value: Any) -> str:
    """A value in a message."""
    if isinstance(value, tuple):
        return ", ".join(map(shown, value))
    return f"{value:.12g}" if isinstance(value, float) else str(value)


Draw = Callable[[], "Figure"]


class Job(Protocol):
    """Services that a task may use while it runs."""

    @property
    def records(self) -> list[Any]:
        """Values of an earlier run, in order."""

    @property
    def state(self) -> Arrays | None:
        """State at the end of the last record."""

    def add_record(self, record: Any, state: Arrays) -> None:
        """Store a value that `Encoder` can write, and the state to go on from."""

    def compute(self, stage: str, parts: Parts) -> Mapping[str, Arrays]:
        """Arrays of parts by name, on all workers; those kept are not computed again.

        With a cluster their functions are those of modules, with plain arguments.
        """

    @property
    def workers(self) -> int | Cluster | None:
        """Threads, one a core if None, or the cluster that computes parts."""

    @property
    def stop(self) -> Stop:
        """Event after which `report` raises Stopped."""

    @property
    def stop_event(self) -> Stop:
        """Event that asks parts to stop; they raise Stopped."""

    def report(self, stage: str, done: int, total: int) -> None:
        """Progress. Raises Stopped where the run is to end."""


@dataclass(frozen=True)
class Task:
    """A part of a study that depends on no other.

    key : its name in checkpoints, unique in the study
    work : computes what it gives, in any thread
    size : steps that it reports, for a bar over all tasks; 0 for a bar of its own
    n_records : records that it keeps, None for one in each step
    """

    key: str
    work: Callable[[Job], Any]
    size: int = 0
    n_records: int | None = None


class Solvable(Protocol):
    """A study, or the problem that its settings pose."""

    @property
    def inputs(self) -> Mapping[str, str]:
        """All that determines the records of a checkpoint."""

    @property
    def announcements(self) -> Iterable[str]:
        """Lines that are said before anything is computed."""

    def tasks(self) -> Iterable[Task]:
        """All parts; InputError for what cannot be computed."""

    def gather(self, results: Mapping[str, Any]) -> Any:
        """Make the result from the results of the tasks, by key."""


@dataclass(frozen=True, eq=False)
class Problem:
    """Base of problems: what a study solves, with what follows from its settings."""

    study: Any

    @property
    def inputs(self) -> Mapping[str, str]:
        """All that determines the records of a checkpoint."""
        inputs: Mapping[str, str] = self.study.inputs
        return inputs

    @property
    def announcements(self) -> Iterable[str]:
        """Lines that are said before anything is computed."""
        lines: Iterable[str] = self.study.announcements
        return lines

    def tasks(self) -> Iterable[Task]:
        """All parts; InputError for what cannot be computed."""
        raise NotImplementedError

    def gather(self, results: Mapping[str, Any]) -> Any:
        """Make the result from the results of the tasks, by key."""
        (result,) = results.values()
        return result


class _StudyType(type):
    # Class of studies, whose `dir` and `help` leave out what every Python class has.
    # A docstring of its own would hide theirs from `help`.
    __doc__ = type.__dict__["__doc__"]

    def __dir__(cls) -> list[str]:
        return [name for name in super().__dir__() if not name.startswith("__")]


@dataclass(frozen=True)
class Study(metaclass=_StudyType):
    """Base of all studies; see the top of this file."""

    command: ClassVar[str]
    example: ClassVar[str]
    description: ClassVar[str]  # what the class says, without its parameters
    pictures: ClassVar[Mapping[str, str]] = PLOT  # options that take a file, with help
    more_tables: ClassVar[Mapping[str, str]] = NO_PICTURES  # described as these
    # other files, with help and endings
    more_files: ClassVar[Mapping[str, tuple[str, Sequence[str]]]] = MappingProxyType({})
    resumes: ClassVar[bool] = False  # whether tasks keep records or parts
    unit: ClassVar[str] = "speed"  # of what tasks keep, one by one
    checkpoint_beside: ClassVar[str] = (
        "output"  # name of the file next to which that is
    )
    partial: ClassVar[bool] = False  # whether what Ctrl-C leaves can be gathered
    distributes: ClassVar[bool] = False  # whether parts may go to other processes
    output: ClassVar[str] = f"Write the results {TO_TABLE}."
    # of its option; none where files are settings that tasks write
    output_names: ClassVar[Sequence[str]] = ("-o", "--output")
    must_write: ClassVar[bool] = False  # whether the output must be given
    endings: ClassVar[Sequence[str]] = TABLES  # of its name
    folder: ClassVar[bool] = False  # whether it is a directory, with `files` in it

    def __init_subclass__(cls, *, command: str, example: str, **options: Any) -> None:
        super().__init_subclass__(**options)
        cls.command, cls.example = command, f"fegear {example}"
        cls.description = cls.__doc__ or ""
        set_lazy_docstring(cls, _section)

    def __post_init__(self) -> None:
        take_plain_values(self)
        for member in exposed_fields(group_of(self)):
            value, declared = self._read(member), member.group
            if declared is None or isinstance(value, declared.kind):
                continue
            kind: Any = declared.kind
            names = [f.name for f in fields(kind)]
            if isinstance(value, str) and "name" in names:  # a name in its place
                object.__setattr__(self, member.name, kind(name=value))
            elif hasattr(kind, "of"):
                object.__setattr__(self, member.name, kind.of(value))
        require_settings(self)
        refuse_unused_settings(self, group_of(self))

    def _read(self, member: ExposedField) -> Any:
        """A value of a setting, which may be given as text."""
        value, declared = getattr(self, member.name), member.declared
        if not isinstance(declared, Setting):
            return value
        if declared.one_or_list:
            value = _one_or_list(value, declared.several)
            object.__setattr__(self, member.name, value)
        if declared.parse is None:
            return value
        if declared.several and isinstance(value, list | tuple):
            value = parse_several(member, value)
        elif isinstance(value, str):
            if declared.several:
                value = parse_several(member, [value])
            else:
                value = parse_setting(member, value)
        object.__setattr__(self, member.name, value)
        return value

    @property
    def default_output(self) -> str | None:
        """Default directory of the output."""
        return None

    @property
    def files(self) -> Sequence[str]:
        """Names of the main files in the directory that is written."""
        return ()

    def unused_options(self, outputs: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
        """Outputs and settings that would change nothing, with the reason.

        Parameters
        ----------
        outputs : mapping of str
            Files and other outputs that are asked for, by name.

        Yields
        ------
        tuple of (str, str)
            Name and reason. Other names are in braces in the reasons, as in
            ``needs {kind} event``.
        """
        return iter(())

    def prepare(self) -> Solvable:
        """What is solved: values that follow from the settings, derived once.

        A study that derives nothing is its own problem.

        Returns
        -------
        Solvable
            Problem whose tasks `fegear.run` computes.

        Raises
        ------
        InputError
            If something cannot be computed.
        """
        return self

    @property
    def announcements(self) -> Iterable[str]:
        """Lines that are said before anything is computed, such as warnings of the
        gear set."""
        lines: Iterable[str] = getattr(getattr(self, "gear_set", None), "warnings", ())
        return lines

    def tasks(self) -> Iterable[Task]:
        """Parts of the study that depend on no other.

        Returns
        -------
        iterable of Task
            All parts.

        Raises
        ------
        InputError
            If something cannot be computed.
        """
        raise NotImplementedError

    def gather(self, results: Mapping[str, Any]) -> Any:
        """Make the result of the study from the results of its tasks.

        Parameters
        ----------
        results : mapping of str
            Results of the tasks, by key.

        Returns
        -------
        StudyResult
            Result of the study.
        """
        (result,) = results.values()
        return result

    @property
    def argv(self) -> list[str]:
        """Command-line arguments of this study."""
        return [*self.command.split(), *to_argv(self)]

    @property
    def inputs(self) -> dict[str, str]:
        """All that determines the records of a checkpoint.

        Files that settings name are among it by their content.
        """
        from fegear.files.contents import file_digests

        files = dict.fromkeys(files_read(self, whole=False))
        return {
            **dict(_inputs(self, "")),
            **{f"content of {name}": text for name, text in file_digests(files)},
        }


def _section(study: type) -> str:
    from fegear.studies.docstring import study_section

    return study_section(study)


def files_read(
    settings: Any, group: SettingsGroup | None = None, whole: bool = True
) -> Iterator[str]:
    """Names of files that settings declare; also of what comes with the program.

    whole : also those of groups that tell by `inputs` what they have read, and files
        that are named in other files, by `named_files` of the settings
    """
    if whole:
        with suppress(InputError):  # the study refuses what it cannot read
            yield from getattr(settings, "named_files", ())
    for member in exposed_fields(group or group_of(settings)):
        value = getattr(settings, member.name)
        if member.group is not None:
            if isinstance(value, member.group.kind) and (
                whole or not hasattr(value, "inputs")
            ):
                yield from files_read(value, member.group, whole)
        elif isinstance(member.declared, Setting) and member.declared.reads:
            names = value if isinstance(value, tuple) else (value,)
            yield from (str(name) for name in names if name is not None)


def _inputs(settings: Any, prefix: str) -> Iterator[tuple[str, str]]:
    from fegear.files.contents import exact_repr

    for member in fields(settings):
        value, name = getattr(settings, member.name), f"{prefix}{member.name}"
        if is_dataclass(value) and not hasattr(value, "inputs"):
            yield from _inputs(value, f"{name}.")
        else:
            yield name, getattr(value, "inputs", exact_repr(value))


class StudyResult(Result):
    """Result of a study; a frozen dataclass.

    Results of the studies have further attributes with what they computed.

    Attributes
    ----------
    study : Study
        Study that was run.
    summary : dict of str
        Plain values for JSON, warnings among them; names end with units.
    figures : mapping of str to callable
        Functions that draw the pictures of the study, by name.
    more_tables : mapping of str to Table
        Tables in addition to the first, by name.
    more_files : mapping of str to callable
        Functions of a path that write other files, by name.
    complete : bool
        Whether nothing is left out, after Ctrl-C or a failure.
    empty : bool
        Whether there is nothing to write.
    failure : str
        Why the command fails, once all is written; empty if it does not.
    dots_per_inch : int
        Resolution of pictures [dots per inch].
    """

    study: Any
    summary: Any
    figures: Any = MappingProxyType({})
    more_tables: Any = MappingProxyType({})
    more_files: Any = MappingProxyType({})
    complete: Any = True
    empty: Any = False
    failure: Any = ""
    dots_per_inch: Any = 130  # of pictures

    @property
    def table(self) -> Table:
        """Table of the result; names of columns end with units."""
        raise InputError(f"{self.study.command} has no table")

    def page(self) -> Page:
        """Content of the screen.

        Returns
        -------
        iterator of str, RowTable or ColumnTable
            Lines of text and tables, in order.
        """
        raise NotImplementedError

    def write(self, path: str | Path) -> None:
        """Write what ``--output`` of the command writes, by the ending of the path.

        Unless the study says else, ``.csv`` has the table, ``.mat`` and ``.xlsx`` have
        all tables with units and meanings, and ``.nc`` has the whole result, as `save`.

        Parameters
        ----------
        path : str or Path
            File, or directory of a study that writes several files.

        Raises
        ------
        InputError
            If the ending is another one, the file cannot be written or does not hold
            the tables, or a package that writes it is missing.
        """
        from fegear.studies.table_files import write_result

        write_result(self, path)

    def write_table(self, path: str | Path, name: str) -> None:
        """Write one of `more_tables` alone, by the ending of the path.

        Parameters
        ----------
        path : str or Path
            File with the ending ``.csv``, ``.mat`` or ``.xlsx``.
        name : str
            Name of the table, one of `more_tables`.

        Raises
        ------
        InputError
            If there is no such table or ending, or the file cannot be written.
        """
        from fegear.studies.table_files import write_table

        write_table(self, path, name)

    def save(self, path: str | Path) -> None:
        """Write the whole result for `fegear.load`.

        Parameters
        ----------
        path : str or Path
            File with the ending ``.nc``.

        Raises
        ------
        InputError
            If the ending is another one, the file cannot be written or a value cannot
            be saved.
        """
        from fegear.studies.saving import save

        save(self, path)

    def to_csv(self, path: str | Path) -> None:
        """Write the table with its header.

        Parameters
        ----------
        path : str or Path
            CSV file.

        Raises
        ------
        InputError
            If the study has no table or the file cannot be written.
        """
        from fegear.files.output import path_of, write_text

        write_text(path_of(path), self.table.csv())

    def to_frame(self) -> DataFrame:
        """The table as a pandas frame.

        Returns
        -------
        pandas.DataFrame
            A column for each column of `table`.

        Raises
        ------
        ImportError
            If pandas is missing.
        InputError
            If the study has no table.
        """
        return self.table.to_frame()

    def draw(self, path: str | Path, name: str = "plot") -> None:
        """Draw a picture by the ending of the path.

        Parameters
        ----------
        path : str or Path
            Picture, with the ending ``.png``, ``.pdf``, ``.svg`` or ``.html``.
        name : str, optional
            Name of the picture, one of `figures`.

        Raises
        ------
        InputError
            If there is no such picture or ending, or the file cannot be written.
        """
        from fegear.figures.statics import save_figure
        from fegear.files.output import path_of, require_picture, write_whole

        if name not in self.figures:
            drawn = f"drawn are {', '.join(self.figures)}"
            raise InputError(f"name = {name}; {drawn if self.figures else 'none is'}")
        target = path_of(path)
        require_picture(target)
        figure = self.figures[name]
        write_whole(
            target, lambda place: save_figure(figure(), place, self.dots_per_inch)
        )

    def _repr_html_(self) -> str:
        """The page of the result in a notebook, with its figure."""
        from fegear.studies.notebook import page_html

        return page_html(self.page(), self._first_figure(), self.dots_per_inch)

    def _repr_png_(self) -> bytes | None:
        """The first figure that can be drawn, None where there is none."""
        from fegear.studies.notebook import figure_png

        figure = self._first_figure()
        return None if figure is None else figure_png(figure, self.dots_per_inch)

    def _first_figure(self) -> Figure | None:
        for draw in self.figures.values():
            with suppress(InputError):  # of a figure that these settings do not give
                return draw()
        return None
