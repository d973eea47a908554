"""What figures of the sources give in quick runs, recorded and compared.

    PYTHONPATH=. python tests/quick_figures.py            # records all
    PYTHONPATH=. python tests/quick_figures.py 3.6 4.10   # records these as well

The processor time of each is printed, so that one that is not quick is seen.
The recorded values are not those of the sources: they show that nothing has changed.
"""

from __future__ import annotations

import json
import math
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import fegear
from validation.commands.reproduce.source_figures import figure_numbers

RECORDED = Path(__file__).parent / "validation" / "quick_figures.json"
DIGITS = 9
Values = Mapping[str, Mapping[str, Sequence[Any]]]


def quick_values(number: str, directory: Path) -> dict[str, dict[str, list[Any]]]:
    """Values of a figure by the name of the part and that of the value.

    What is read from curves for the references stands beside what parts find.
    """
    study = fegear.Reproduction(numbers=(number,), quick=True, directory=str(directory))
    result = fegear.run(study)
    assert result.complete
    assert (directory / "index.html").is_file()
    (figure,) = result.values["figures"]
    values = {part["part"]: dict(part["found"]) for part in figure["parts"]}
    read: dict[str, list[Any]] = {}
    for row in figure["printed"]:
        read.setdefault(row["quantity"], []).append(row["computed"])
    return values | {"printed": read}


def main(numbers: Sequence[str]) -> None:
    recorded = json.loads(RECORDED.read_text()) if numbers else {}
    for number in numbers or figure_numbers():
        begin = time.process_time()
        with tempfile.TemporaryDirectory() as directory:
            recorded[number] = _plain(quick_values(number, Path(directory)))
        text = json.dumps(recorded, indent=1, sort_keys=True, allow_nan=False)
        RECORDED.write_text(text + "\n")
        print(f"{number}: {time.process_time() - begin:.1f} s", flush=True)  # noqa: T201


def _plain(value: Any) -> Any:
    """Rounded numbers; none where there is no number."""
    if isinstance(value, Mapping):
        return {key: _plain(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(entry) for entry in value]
    return float(f"{value:.{DIGITS}g}") if math.isfinite(value) else None


if __name__ == "__main__":
    main(sys.argv[1:])
