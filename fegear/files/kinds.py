"""What a file is that was given in place of another one."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from fegear.files.errors import InputError

# by kind of file, tables and keys that no other kind has
SIGNS = {
    "gear-set": ("gear", "mesh"),
    "machine": ("machine",),
    "gearbox": ("wheel",),
    "case": ("gear_set", "metric"),
    "bearing": ("ball_bearing", "roller_bearing"),
}
READ_BY = {
    "gear-set": "`fegear stiffness` and `fegear sweep` read",
    "machine": "`fegear rattle critical` and `fegear rattle basin` read",
    "gearbox": "`fegear clatter` reads",
    "case": "`fegear validate` reads",
    "bearing": "`fegear bearing` reads",
}
REXS = "a REXS file, which `fegear new` reads"
MESH_TABLE = "a table, such as `fegear sweep` reads of meshes"
# by the ending of a name: files that are no text
KIND_OF_ENDING = {
    **dict.fromkeys((".rexs", ".rexsz", ".rexsj"), REXS),
    **dict.fromkeys((".mat", ".nc", ".h5", ".hdf5", ".xlsx"), MESH_TABLE),
}
TABLE_ROW = re.compile(r"\s*[^,;\t=\[]+([,;\t][^,;\t=\[]*)+")


def require_kind(tables: Mapping[str, Any], kind: str) -> None:
    """InputError where tables of a TOML file are those of another kind of `SIGNS`."""
    if any(name in tables for name in SIGNS[kind]):
        return
    for other, names in SIGNS.items():
        if any(name in tables for name in names):
            raise InputError(
                f"seems to be a {other} file, which {READ_BY[other]}; a {kind} file is "
                "needed"
            )


def kind_of_text(text: str) -> str:
    """What a text that is not TOML seems to be, or nothing."""
    start = text.lstrip()
    if re.match(r"<(\?xml|model\b|!--)", start) and "<model" in start[:2000]:
        return REXS
    if start.startswith("<"):
        return "XML or HTML"
    if start.startswith("{"):
        return f"JSON, or {REXS}" if '"model"' in start[:2000] else "JSON"
    rows = [line for line in start.splitlines()[:200] if not line.startswith("#")]
    if len(rows) > 1 and all(TABLE_ROW.fullmatch(row) for row in rows[:3]):
        return MESH_TABLE
    return ""
