"""Base of studies: settings, from which tasks and their result follow.

A study is a frozen dataclass whose fields are settings:

    @dataclass(frozen=True, kw_only=True)
    class Noise(Study, command="rattle noise", example="rattle noise roots-scaled"):
        \"\"\"How loud a machine is.\"\"\"

        machine: MotionMachine
        starts: int = setting(1000, "Number of runs.", Range(1, 10_000_000))

        def tasks(self) -> Iterator[Task]: ...
        def gather(self, results: Mapping[str, Any]) -> NoiseResult: ...

`fegear.studies.running.run` computes it. The command line, checkpoints and messages
follow from the declaration, see `fegear.studies.settings`. A result has what
`StudyResult` says. `fegear.studies` lists all studies.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, fields, is_dataclass
from inspect import Signature, signature
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar

from fegear.files.errors import InputError
from fegear.files.output import INTO_PICTURE, TABLES, TO_TABLE
from fegear.studies.problem import Solvable, Task
from fegear.studies.settings import (
    ExposedField,
    Setting,
    SettingsGroup,
    exposed_fields,
    group_of,
    read_value,
    refuse_unused_settings,
    require_settings,
    take_plain_values,
    to_argv,
)
from lumped.common.docstrings import set_lazy_docstring
from lumped.common.short_repr import ShortRepr

NO_PICTURES: Mapping[str, str] = MappingProxyType({})
PLOT = {"plot": f"Draw the results {INTO_PICTURE}."}


class _StudyType(type):
    # Class of studies, whose `dir` and `help` leave out what every Python class has.
    # A docstring of its own would hide theirs from `help`.
    __doc__ = type.__dict__["__doc__"]

    if not TYPE_CHECKING:  # checkers see the settings of each class

        def __call__(cls, *values: Any, **settings: Any) -> Any:
            names = _positional(cls)
            if len(values) > len(names):
                taken = f"at most {', '.join(names)}" if names else "none"
                raise TypeError(
                    f"{cls.__name__} takes settings by name; without it {taken}"
                )
            by_place = dict(zip(names, values, strict=False))
            if twice := [name for name in by_place if name in settings]:
                raise TypeError(f"{cls.__name__}: {twice[0]} is there twice")
            _require_settings_exist(cls, settings)
            return super().__call__(**by_place, **settings)

    @property
    def __signature__(cls) -> Signature:
        parameters = list(signature(cls.__init__).parameters.values())  # type: ignore[misc]
        return Signature(parameters[1:])

    def __dir__(cls) -> list[str]:
        return [name for name in super().__dir__() if not name.startswith("__")]


@dataclass(frozen=True)
class Study(ShortRepr, metaclass=_StudyType):
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

    def __init_subclass__(
        cls, *, command: str = "", example: str = "", **options: Any
    ) -> None:
        """Declare the command of a study; a base of several studies has none."""
        super().__init_subclass__(**options)
        if command:
            cls.command, cls.example = command, f"fegear {example}"
            cls.description = cls.__doc__ or ""
            set_lazy_docstring(cls, _section)

    def __post_init__(self) -> None:
        take_plain_values(self)
        for member in exposed_fields(group_of(self)):
            value = read_value(member, getattr(self, member.name))
            object.__setattr__(self, member.name, value)
        require_settings(self)
        refuse_unused_settings(self, group_of(self))

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
        gear_set: Any = getattr(self, "gear_set", None)
        if not hasattr(gear_set, "warnings"):
            return ()
        lines: Iterable[str] = gear_set.warnings(self.joins_housing)
        return lines

    @property
    def joins_housing(self) -> bool:
        """Whether shafts are in the housing of the gear set, which others leave out."""
        return False

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


def _positional(study: type) -> tuple[str, ...]:
    """Settings that are arguments of the command, which need no name in Python."""
    if not is_dataclass(study):
        return ()
    return tuple(
        member.name for member in exposed_fields(group_of(study)) if _is_place(member)
    )


def _is_place(member: ExposedField) -> bool:
    if member.group is not None and member.declared is None:
        return any(_is_place(inner) for inner in exposed_fields(member.group))
    return bool(getattr(member.declared, "place", ""))


def _require_settings_exist(study: type, settings: Mapping[str, Any]) -> None:
    """Raise TypeError that says which group has a setting that the study has not."""
    names_of_study = {entry.name for entry in fields(study)}
    for name in settings:
        if name in names_of_study:
            continue
        for member in exposed_fields(group_of(study)):
            if member.group is None or name not in member.group.exposed:
                continue
            kind = member.group.kind.__name__
            raise TypeError(
                f"{name} is a setting of {member.name}: "
                f"{study.__name__}({member.name}={kind}({name}={settings[name]!r}))"
            )


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
