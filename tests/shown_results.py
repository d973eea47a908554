"""Texts and digests of all that a result shows; the program loads a saved result.

python tests/shown_results.py x.nc
"""

from __future__ import annotations

import hashlib
import json
import sys
import tempfile
from pathlib import Path
from typing import Any

import fegear
from fegear.files.output import strict_json
from fegear.studies.notebook import page_html


def what_is_shown(result: Any) -> dict[str, Any]:
    """Summary, page, tables and pictures of a result, as JSON holds them."""
    tables = {name: table.csv() for name, table in result.more_tables.items()}
    try:
        tables["table"] = result.table.csv()
    except fegear.InputError:  # there is none
        tables["table"] = ""
    return {
        "summary": json.loads(strict_json(result.summary)),
        "page": page_html(result.page()),
        "tables": tables,
        "pictures": {name: _digest(result, name) for name in result.figures},
    }


def _digest(result: Any, name: str) -> str:
    with tempfile.TemporaryDirectory() as folder:
        picture = Path(folder) / "picture.png"
        try:
            result.draw(picture, name)
        except fegear.InputError as error:  # these settings do not give it
            return str(error)
        return hashlib.sha256(picture.read_bytes()).hexdigest()


def forbid_reading() -> None:
    """No file is read by name any more, as if all were gone."""

    def refuse(path: Path, *_: Any, **__: Any) -> Any:
        if path.suffix == ".toml":
            raise AssertionError(f"{path} is read")
        return genuine(path)

    genuine = Path.read_bytes
    Path.read_bytes = refuse  # type: ignore[method-assign]


def main() -> None:
    loaded = fegear.load(sys.argv[1])
    forbid_reading()
    sys.stdout.write(json.dumps(what_is_shown(loaded)))


if __name__ == "__main__":
    main()
