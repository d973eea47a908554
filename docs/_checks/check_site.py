"""Check a built site: no broken link, and a place for everything that is declared.

python docs/_checks/check_site.py OUT
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

REFERENCES = {"a": "href", "img": "src", "link": "href", "script": "src"}


class PageParser(HTMLParser):
    """Links, anchors and words of a page."""

    def __init__(self) -> None:
        super().__init__()
        self.links: list[str] = []
        self.anchors: set[str] = set()
        self.text: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = {name: value or "" for name, value in attrs}
        self.anchors |= {values[name] for name in ("id", "name") if name in values}
        if link := values.get(REFERENCES.get(tag, ""), ""):
            self.links.append(link)

    def handle_data(self, data: str) -> None:
        self.text.append(data)


def read_pages(site: Path) -> dict[Path, PageParser]:
    pages = {}
    for path in sorted(site.rglob("*.html")):
        if "_static" in path.parts:  # templates of the theme
            continue
        pages[path.resolve()] = parser = PageParser()
        parser.feed(path.read_text("utf-8"))
    return pages


def broken_links(pages: dict[Path, PageParser]) -> Iterator[str]:
    """Links to files or anchors that are not there; other sites are not opened."""
    for path, page in pages.items():
        for link in page.links:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            target = path
            if parts.path:
                target = (path.parent / unquote(parts.path)).resolve()
            if target.is_dir():
                target /= "index.html"
            anchors = pages[target].anchors if target in pages else None
            if not target.exists() or (
                parts.fragment
                and anchors is not None
                and unquote(parts.fragment) not in anchors
            ):
                yield f"{path.name}: {link} leads nowhere"


def declared_names() -> Iterator[tuple[str, str]]:
    """Yield the folder or the name of a page, and words that it must contain."""
    import fegear
    import lumped
    from fegear.files.codes import codes
    from fegear.files.keys import FILE_KINDS, file_keys
    from fegear.studies.columns import columns
    from fegear.studies.registry import commands

    yield from (("reference/commands", f"fegear {name}") for name in commands())
    for kind in FILE_KINDS:
        yield from ((f"reference/keys/{kind}", key.key) for key in file_keys(kind))
    yield from (("reference/columns", column.name) for column in columns())
    for entry in codes().values():
        kind = "warnings" if entry.code.startswith("W") else "evidence"
        yield f"reference/{kind}", f"{entry.code}: {entry.title}"
    for module in (fegear, lumped):
        public = (name for name in module.__all__ if name != "__version__")
        yield from ((f"reference/python-{module.__name__}", name) for name in public)


def missing_names(site: Path, pages: dict[Path, PageParser]) -> Iterator[str]:
    """Yield a line for each name that is declared and not on its page."""
    texts = {
        path.relative_to(site.resolve()).as_posix(): "".join(page.text)
        for path, page in pages.items()
    }
    for place, name in declared_names():
        if not any(name in text for at, text in texts.items() if at.startswith(place)):
            yield f"{place}: {name} is missing"


def main(site: Path) -> int:
    pages = read_pages(site)
    faults = [*broken_links(pages), *missing_names(site, pages)]
    for fault in faults:
        sys.stdout.write(f"{fault}\n")
    sys.stdout.write(f"{len(pages)} pages, {len(faults)} faults\n")
    return bool(faults)


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
