"""The documentation has a page for all that is declared, and its check finds faults."""

from __future__ import annotations

import importlib
import importlib.util
import re
from pathlib import Path
from typing import Any

from fegear.files.codes import codes
from fegear.files.keys import FILE_KINDS
from fegear.studies.registry import listed as help_sections

DOCS = Path(__file__).parents[1] / "docs"
DIRECTIVE = re.compile(r"^```\{([\w-]+)\} ?(.*)$", re.MULTILINE)


def load_checks() -> Any:
    spec = importlib.util.spec_from_file_location(
        "check_site", DOCS / "_checks" / "check_site.py"
    )
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


CHECKS = load_checks()


def test_the_reference_lists_everything():
    """Each directive writes all that its argument has; see docs/_extensions."""
    texts = [path.read_text("utf-8") for path in DOCS.glob("reference/**/*.md")]
    listed = {match.groups() for text in texts for match in DIRECTIVE.finditer(text)}
    assert {("command-group", name) for name in help_sections()} <= listed
    assert {("file-keys", kind) for kind in FILE_KINDS} <= listed
    assert {("codes", code[0]) for code in codes()} <= listed
    assert {("public-names", "fegear"), ("public-names", "lumped")} <= listed
    assert ("table-columns", "") in listed


def test_names_that_must_be_on_the_site_are_many():
    places = [place for place, _ in CHECKS.declared_names()]
    assert len(places) > 700
    assert {place.split("/")[0] for place in places} == {"reference"}


def test_every_page_is_in_a_list_of_pages():
    """Else a reader can only find it by a search."""
    pages = {path.relative_to(DOCS).with_suffix("") for path in DOCS.glob("**/*.md")}
    listed = {Path("index")}
    for page in pages:
        text = (DOCS / page).with_suffix(".md").read_text("utf-8")
        for block in re.findall(r"```\{toctree\}\n(.*?)```", text, re.DOTALL):
            names = [line for line in block.split() if not line.startswith(":")]
            listed |= {page.parent / name.strip("<>") for name in names}
    assert pages <= listed


def test_broken_links_and_missing_names_are_found(tmp_path):
    (tmp_path / "index.html").write_text(
        '<a href="b.html#there">1</a><a href="b.html#gone">2</a><img src="no.png">'
        '<a href="https://example.org/x">3</a><a href="#here" id="here">4</a>'
    )
    (tmp_path / "b.html").write_text('<h1 id="there">fegear stiffness</h1>')
    pages = CHECKS.read_pages(tmp_path)
    assert list(CHECKS.broken_links(pages)) == [
        "index.html: b.html#gone leads nowhere",
        "index.html: no.png leads nowhere",
    ]
    missing = list(CHECKS.missing_names(tmp_path, pages))
    assert "reference/commands: fegear sweep is missing" in missing


IMPORT = re.compile(
    r"^from ((?:fegear|lumped|meshes|validation)[\w.]*) import ([\w, ]+)", re.M
)


def test_pages_import_what_is_there():
    """Their code is run when the site is built, minutes later."""
    imported = [
        (path.name, module, name.split(" as ")[0].strip())
        for path in [*DOCS.rglob("*.md"), DOCS.parent / "README.md"]
        for module, names in IMPORT.findall(path.read_text("utf-8"))
        for name in names.split(",")
    ]
    assert len(imported) > 5
    assert [entry for entry in imported if not _has(*entry[1:])] == []


def _has(module: str, name: str) -> bool:
    if hasattr(importlib.import_module(module), name):
        return True
    return importlib.util.find_spec(f"{module}.{name}") is not None
