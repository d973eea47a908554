"""Commands and files that the pages of the documentation show to a reader."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).parents[1]
GUIDES = sorted(path.relative_to(ROOT).as_posix() for path in ROOT.glob("docs/**/*.md"))
# a fence ends at a line of its own length and nothing else, whatever it begins with
FENCE = re.compile(r"^(`{3,})(.*)\n((?:.*\n)*?)\1$", re.MULTILINE)
SHOWN = re.compile(rf"{FENCE.pattern}|^\| `(fegear .*?)` \|", re.MULTILINE)


def page_text(page: str) -> str:
    return (ROOT / page).read_text(encoding="utf-8")


def commands_of(page: str) -> list[str]:
    """Commands in the fences and tables of a page, in its order."""
    lines = [
        line.strip()
        for _, _, block, cell in SHOWN.findall(page_text(page))
        for line in (block or cell).splitlines()
    ]
    return [line for line in lines if line.startswith("fegear ")]


def blocks_of(page: str, kind: str) -> list[str]:
    """Contents of the fences of a kind, such as `toml`."""
    return [text for _, head, text in FENCE.findall(page_text(page)) if head == kind]


def files_of(page: str) -> dict[str, str]:
    """Contents of the files that the cells of a tutorial write, by name."""
    cells = blocks_of(page, "{code-cell} python3")
    parts = [cell.partition("\n") for cell in cells if cell.startswith("%%writefile ")]
    return {head.split()[1]: text for head, _, text in parts}
