"""Commented files to begin with, by kind."""

from __future__ import annotations

from importlib import resources

# by kind, the package with its file in the folder `templates`; see `register_template`
TEMPLATE_PACKAGES = dict.fromkeys(
    ("pair", "idler", "counter-shaft", "planetary", "machine", "gearbox", "bearing"),
    "fegear.files",
)


def register_template(kind: str, package: str) -> None:
    """Add a template of another package."""
    TEMPLATE_PACKAGES[kind] = package


def template_text(kind: str) -> str:
    """Text of a template of `TEMPLATE_PACKAGES`."""
    folder = resources.files(TEMPLATE_PACKAGES[kind]) / "templates"
    return (folder / f"{kind}.toml").read_text("utf-8")
