"""Tables as the text of a TOML file."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from typing import Any


def toml_text(tables: Mapping[str, Any]) -> str:
    """TOML text from which `tomllib` reads the same tables.

    Tables of a list come as `[[name]]`, tables within tables as `[name.inner]`.
    """
    return "\n".join(_lines(tables, "")).strip() + "\n"


def _lines(table: Mapping[str, Any], name: str) -> Iterator[str]:
    inner = {key: value for key, value in table.items() if _is_table(value)}
    for key, value in table.items():
        if key not in inner:
            yield f"{_key(key)} = {toml_value(value)}"
    for key, value in inner.items():
        path = f"{name}.{_key(key)}".lstrip(".")
        single = isinstance(value, Mapping)
        for entry in [value] if single else value:
            yield from ("", f"[{path}]" if single else f"[[{path}]]")
            yield from _lines(entry, path)


def _is_table(value: Any) -> bool:
    if isinstance(value, list):
        return bool(value) and all(isinstance(entry, Mapping) for entry in value)
    return isinstance(value, Mapping)


def _key(key: str) -> str:
    bare = key.isascii() and key.replace("_", "").replace("-", "").isalnum()
    return key if bare else toml_value(key)


def toml_value(value: Any) -> str:
    """A text, number, truth value, list or inline table of them as TOML."""
    if isinstance(value, Mapping):
        entries = (f"{_key(key)} = {toml_value(entry)}" for key, entry in value.items())
        return f"{{ {', '.join(entries)} }}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(toml_value, value))}]"
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    return json.dumps(value, ensure_ascii=False)
