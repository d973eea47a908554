"""The machine that may rattle of a part, with what is changed of it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

from fegear.commands.rattle.machines import NamedMachine, load_machine
from fegear.files.contents import exact_repr
from lumped.rattle.assembly import Assembly
from lumped.rattle.machine import Machine


@dataclass(frozen=True, eq=False, kw_only=True)
class MachineScene:
    """A machine file and edits of its keys, `table.key`."""

    name: str
    overrides: Mapping[str, Any]
    no_commands = ""  # every part says for itself

    def changed(self, values: Mapping[str, Any]) -> MachineScene:
        """This scene with other parameters."""
        return replace(self, overrides={**self.overrides, **values})

    @cached_property
    def named(self) -> NamedMachine:
        return load_machine(self.name, edits=self.overrides)

    @property
    def assembly(self) -> Assembly:
        return self.named.assembly

    @property
    def machine(self) -> Machine:
        """The one equation of its relative motion."""
        return self.named.machine

    @property
    def inputs(self) -> dict[str, str]:
        """All of it that determines a result."""
        return {"machine": exact_repr(self.assembly)}

    def table_commands(self) -> Iterator[list[str]]:
        """None: no command on machines takes mesh tables."""
        return iter(())
