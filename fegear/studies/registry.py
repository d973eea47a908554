"""The commands that there are, each declared in its folder.

A folder below one of the roots is a command, or a group of commands, by the entries of
`COMMANDS` in its `__init__`, which imports nothing else: the help lists commands that
are loaded when they are asked for.

    COMMANDS = (
        Command("wear", "Wear of flanks.", __name__, "FlankWear", section="Statics"),
    )

`PUBLIC` has the modules of what `fegear` offers of it besides the classes of studies.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from pkgutil import iter_modules
from types import ModuleType

SECTIONS = (  # of the help, in order
    *("Gears and files", "Statics", "Vibration", "Machines", "Evidence and upkeep"),
)
_ROOTS = ["fegear.commands"]


@dataclass(frozen=True)
class Command:
    """A command and the class of its study.

    Parameters
    ----------
    name : str
        Words of the command; the first of two is that of a group.
    title : str
        First line of its help.
    package : str
        Folder of the command, as a package.
    study : str
        Name of the class.
    file : str, optional
        Module of the folder that has the class.
    section : str, optional
        Heading in the help, one of `SECTIONS`; a group has one for all its commands.
    place : int, optional
        Commands of a section or group are listed in rising order.
    """

    name: str
    title: str
    package: str
    study: str
    file: str = "study"
    section: str = ""
    place: int = 0

    @property
    def module(self) -> str:
        """Full name of the module with the class."""
        return f"{self.package}.{self.file}"

    @property
    def group(self) -> str:
        """Name of its group, empty where it has none."""
        return self.name.partition(" ")[0] if " " in self.name else ""


@dataclass(frozen=True)
class Group:
    """Commands whose first word is the same; fields are those of `Command`."""

    name: str
    title: str
    section: str
    place: int = 0


def add_root(package: str) -> None:
    """Add the folders of another package to the commands."""
    if package not in _ROOTS:
        _ROOTS.append(package)
        for cached in (folders, public_names, groups, commands):
            cached.cache_clear()


@cache
def folders() -> tuple[ModuleType, ...]:
    """Packages of the folders of all commands."""
    return tuple(
        import_module(f"{root}.{info.name}")
        for root in _ROOTS
        for info in iter_modules(import_module(root).__path__)
        if info.ispkg
    )


def packages() -> frozenset[str]:
    """Top-level packages that have commands."""
    return frozenset(root.partition(".")[0] for root in _ROOTS)


def _entries() -> Iterator[Command | Group]:
    for folder in folders():
        yield from folder.COMMANDS


@cache
def public_names() -> dict[str, str]:
    """Modules by the public names that folders have besides their studies."""
    return {
        name: module
        for folder in folders()
        for name, module in getattr(folder, "PUBLIC", {}).items()
    }


@cache
def groups() -> dict[str, Group]:
    """Groups of commands by name."""
    return {entry.name: entry for entry in _entries() if isinstance(entry, Group)}


@cache
def commands() -> dict[str, Command]:
    """All commands by name, in the order of the help."""
    declared = [entry for entry in _entries() if isinstance(entry, Command)]

    def rank(command: Command) -> tuple[int, int, int]:
        listed = groups()[command.group] if command.group else command
        return SECTIONS.index(listed.section), listed.place, command.place

    return {command.name: command for command in sorted(declared, key=rank)}


def listed(group: str = "") -> dict[str, list[str]]:
    """Names in the help by heading: those of a group, or all others and the groups."""
    if group:
        names = [
            c.name.partition(" ")[2] for c in commands().values() if c.group == group
        ]
        return {"Commands": names}
    headings: dict[str, list[str]] = {section: [] for section in SECTIONS}
    for command in commands().values():
        entry = groups()[command.group] if command.group else command
        if entry.name not in headings[entry.section]:
            headings[entry.section].append(entry.name)
    return {heading: names for heading, names in headings.items() if names}
