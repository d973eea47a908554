"""Files and names on the developers' page are there."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "developers.md").read_text("utf-8")
NAMED = sorted(set(re.findall(r"`((?:[\w.]+/)+[\w.]*)`", PAGE)))
FUNCTIONS = sorted(set(re.findall(r"`([a-z]+(?:_[a-z]+)+|[A-Z]\w+)`", PAGE)))
SOURCES = "\n".join(
    path.read_text("utf-8")
    for package in ("meshes", "lumped", "fegear", "validation")
    for path in (ROOT / package).rglob("*.py")
)


@pytest.mark.parametrize("path", NAMED)
def test_files_are_there(path):
    assert (ROOT / path).exists()


@pytest.mark.slow
@pytest.mark.parametrize("name", FUNCTIONS)
def test_names_are_there(name):
    pattern = rf"(def|class) {name}\b|^\s*{name}\b( =|:)"
    assert re.search(pattern, SOURCES, re.MULTILINE)
