"""Reference pages from what the program declares.

Directives, each with the name of what is listed as its argument:

    ```{command-group} Statics
    ```{file-keys} gear-set
    ```{table-columns}
    ```{codes} W
    ```{materials}
    ```{public-names} lumped
    ```{validation-totals}
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from importlib import import_module
from itertools import groupby
from typing import Any

import typer
from click import Context
from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

import fegear
import lumped
from fegear.cli import app
from fegear.files.keys import FileKey, file_keys
from fegear.studies import load_study
from fegear.studies.registry import commands, listed

ROOT_COMMAND = typer.main.get_command(app)
Lines = Iterable[str]


def command_pages(group: str) -> Lines:
    """The commands of a group of the program's help, a section each."""
    for name in listed()[group]:
        yield from _command_section(name, ROOT_COMMAND.get_command(None, name))


def _command_section(name: str, command: Any) -> Lines:
    context = Context(command, info_name=f"fegear {name}")
    yield from (f"(command-{name.replace(' ', '-')})=", f"## fegear {name}", "")
    if hasattr(command, "commands"):
        yield from (command.help, "")
        for inner in command.list_commands(context):
            yield from _command_section(
                f"{name} {inner}", command.get_command(context, inner)
            )
        return
    yield from (command.help or "", "", "```console", _usage(command, context), "```")
    yield ""
    for parameter in command.params:
        if record := parameter.get_help_record(context):
            option, text = record
            yield from (f"`{option}`", f": {' '.join(text.split())}", "")
    study = load_study(name)
    yield from ("Example:", "", "```console", study.example, "```", "")
    if home := _public_name(study):
        yield from (f"In Python: {{py:class}}`fegear.{home}`.", "")


def _usage(command: Any, context: Any) -> str:
    return " ".join([context.command_path, *command.collect_usage_pieces(context)])


def _public_name(study: type) -> str:
    return study.__name__ if study.__name__ in fegear.__all__ else ""


def key_tables(kind: str) -> Lines:
    """The keys of a kind of file, a section for each table of it."""
    for table, keys in groupby(file_keys(kind), lambda key: key.table):
        yield from (f"## {f'`{table}`' if table else 'Top of the file'}", "")
        yield from _table(
            ("Key", "Unit", "Default", "Allowed", "Meaning"), map(_key_row, keys)
        )


def _key_row(key: FileKey) -> Sequence[str]:
    default = "required" if key.required else _plain(key.default)
    return f"`{key.key}`", key.unit, default, key.allowed, key.meaning


def column_tables(_: str) -> Lines:
    """The columns of all tables, a section for each table of a command."""
    import validation.commands  # noqa: F401  its tables, too
    from fegear.studies.columns import MAIN, columns

    tables: dict[tuple[str, str], list[Sequence[str]]] = {}
    for column in columns():
        row = f"`{column.name}`", column.unit, column.meaning
        for command in column.commands:
            tables.setdefault((command, column.table), []).append(row)
    order = list(commands())
    for command, table in sorted(tables, key=lambda key: order.index(key[0])):
        other = "" if table == MAIN else f": {table}"
        yield from (f"## fegear {command}{other}", "")
        yield from _table(("Column", "Unit", "Meaning"), tables[command, table])


def code_sections(kind: str) -> Lines:
    """The entries of all codes that begin with a letter."""
    from dataclasses import asdict

    from fegear.files.codes import codes

    for entry in codes().values():
        if entry.code.startswith(kind):
            yield from (f"({entry.code.lower()})=", f"## {entry.code}: {entry.title}")
            for name, text in asdict(entry).items():
                if name not in ("code", "title"):
                    yield from ("", f"**{name.capitalize()}.** {text}")
            yield ""


def material_table(_: str) -> Lines:
    """The materials that a gear-set file may name, with values and sources."""
    from fegear.gearset.materials import materials

    head = ("`material`", "Young's modulus [GPa]", "Poisson's ratio")
    head += ("Density [kg/m3]", "Condition, at 23 C", "Source")
    rows = (
        (
            f"`{name}`",
            f"{material.young_modulus_GPa:g}",
            f"{material.poisson_ratio:g}",
            f"{material.density_kg_per_m3:g}",
            material.condition,
            material.source,
        )
        for name, material in materials().items()
    )
    yield from _table(head, rows)


def public_names(package: str) -> Lines:
    """Every public name of a package by autodoc."""
    module = import_module(package)
    for name in sorted(module.__all__, key=str.casefold):
        value = getattr(module, name)
        if isinstance(value, str):
            continue
        if package != "lumped" and getattr(lumped, name, None) is value:
            yield from (f"## {name}", "", f"See {{py:obj}}`lumped.{name}`.", "")
            continue
        kind = "class" if isinstance(value, type) else "function"
        kind = "exception" if kind == "class" and issubclass(value, Exception) else kind
        members = ["   :members:"] if kind == "class" else []
        yield from (f"## {name}", "", "```{eval-rst}")
        yield from (f".. auto{kind}:: {package}.{name}", *members, "```", "")


def validation_totals(_: str) -> Lines:
    """How many metrics the models meet, by the committed run of all cases."""
    from validation.commands.validate.report.totals import committed_totals

    totals = committed_totals()
    coupled, first = (totals["models"][f"model-{name}"] for name in ("coupled", "1"))
    made = totals["made"]
    yield (
        f"In the {coupled['cases']} cases that include it the coupled model meets "
        f"{coupled['within']} of {coupled['of']} metrics, and model 1 meets "
        f"{first['within']} of {first['of']} (`fegear validate --all`, {made['date']}, "
        f"fegear {made['fegear']})."
    )


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> Iterator[str]:
    yield f"| {' | '.join(head)} |"
    yield f"|{'---|' * len(head)}"
    for row in rows:
        yield f"| {' | '.join(_cell(text) for text in row)} |"
    yield ""


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", r"\|").replace("<", "&lt;")


def _plain(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, list | tuple):
        return ", ".join(map(str, value))
    return "" if value is None else str(value)


def directive(write: Callable[[str], Lines]) -> type[SphinxDirective]:
    """A directive whose content is the markdown that a function writes."""

    class Declared(SphinxDirective):
        optional_arguments = 1
        final_argument_whitespace = True

        def run(self) -> list[nodes.Node]:
            text = "\n".join(write(self.arguments[0] if self.arguments else ""))
            return self.parse_text_to_nodes(text, allow_section_headings=True)

    return Declared


DIRECTIVES = {
    "command-group": command_pages,
    "file-keys": key_tables,
    "table-columns": column_tables,
    "codes": code_sections,
    "materials": material_table,
    "public-names": public_names,
    "validation-totals": validation_totals,
}


def setup(app: Sphinx) -> dict[str, Any]:
    for name, write in DIRECTIVES.items():
        app.add_directive(name, directive(write))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
