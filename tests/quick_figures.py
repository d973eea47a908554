"""What figures of the sources give in quick runs, recorded and compared.

    PYTHONPATH=. python tests/quick_figures.py            # records all
    PYTHONPATH=. python tests/quick_figures.py 3.6 4.10   # records these as well

The processor time of each is printed, so that one that is not quick is seen.
The recorded values are not those of the sources: they show that nothing has changed.
Of each figure ten values are recorded, those beside printed ones first, and of all
values two digests, which move by as much as a value does, not by its round-off.
"""

from __future__ import annotations

import hashlib
import json
import math
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from fnmatch import fnmatchcase
from itertools import islice
from pathlib import Path
from typing import Any

import fegear
from validation.commands.reproduce.source_figures import figure_numbers

RECORDED = Path(__file__).parent / "validation" / "quick_figures.json"
DIGITS = 9
REVIEWED = 10  # values of a figure that a reader sees
RTOL, ATOL = 1e-4, 1e-9
# of values that depend on the last bit, by figure, part and value
LOOSE_RTOL: Mapping[str, float] = {
    # chaotic motions, whose points part within few periods: 3 to 9 % between processors
    "3.12/*/*exponent*": 0.5,
    "3.11/sweep-pi-4/*": 0.03,  # averages of such motions, 0.4 to 0.8 %
    # noise of 20 turns of such motions: the median 0.7 %, the largest 15 %
    "rattle-table-6.1/*": 0.3,
    "rattle-6.3/*": 0.3,
}
# of lists whose length depends on it as well: how many values are the same everywhere
FIRST: Mapping[str, int] = {
    # of a chaotic motion; the smaller peaks pass the limit on some processors
    "3.11b/spectra/speed2.mesh1.peaks": 5,
    "3.11b/spectra/speed2.mesh2.peaks": 2,
    "3.11b/spectra/speed2.mesh1.lowest": 0,
}
Values = Mapping[str, Mapping[str, Sequence[Any]]]
Places = dict[str, float | None]  # numbers by figure, part, name and index


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


def rtol_of(place: str) -> float:
    return next((r for key, r in LOOSE_RTOL.items() if fnmatchcase(place, key)), RTOL)


def places_of(number: str, values: Values) -> Places:
    """Numbers that are the same everywhere, None where there is no number."""
    places = Places()
    for part in sorted(values):
        for name in sorted(values[part]):
            place = f"{number}/{part}/{name}"
            numbers = numbers_in(values[part][name])
            for index, value in enumerate(islice(numbers, FIRST.get(place))):
                places[f"{place}/{index}"] = value
    return places


def numbers_in(values: Any) -> Iterator[float | None]:
    """Numbers of lists in lists, in order."""
    if isinstance(values, list | tuple):
        for value in values:
            yield from numbers_in(value)
    else:
        yield None if values is None or not math.isfinite(values) else values


def record_of(places: Places) -> dict[str, Any]:
    """The record of a figure: number and names of its values, digests, ten values."""
    names = [f"{place}{'?' * (value is None)}" for place, value in places.items()]
    return {
        "numbers": len(places),
        "names": hashlib.sha256("\n".join(names).encode()).hexdigest()[:16],
        "digests": [round(digest(places, salt), DIGITS - 2) for salt in "ab"],
        "values": {place: _rounded(places[place]) for place in reviewed(places)},
    }


def digest(places: Places, salt: str) -> float:
    """A sum that changes by r to 2 r where one value changes by a part r of itself.

    A value below ATOL / RTOL counts by its difference over that, as by the tolerances.
    Each value has a weight of its own, so that two do not change places unseen. Those
    of LOOSE_RTOL do not count.
    """
    return math.fsum(
        _weight(f"{salt}{place}") * math.asinh(value * RTOL / ATOL)
        for place, value in places.items()
        if value is not None and rtol_of(place) == RTOL
    )


def _weight(text: str) -> float:
    """A number of size 1 to 2."""
    sign, size = hashlib.sha256(text.encode()).digest()[:2]
    return (1.0 - 2.0 * (sign % 2)) * (1.0 + size / 256.0)


def reviewed(places: Places) -> list[str]:
    """Places of those beside printed values, then others from all parts; all loose."""
    numbers = [place for place, value in places.items() if value is not None]
    loose = [place for place in numbers if rtol_of(place) != RTOL]
    printed = [place for place in numbers if place.split("/")[1] == "printed"]
    others = [place for place in numbers if place not in {*printed, *loose}]
    space = max(REVIEWED - len(printed), 0)
    spread = [others[i * len(others) // space] for i in range(space)] if others else []
    chosen = {*printed[:REVIEWED], *spread, *loose}
    return [place for place in numbers if place in chosen]


def differences(places: Places, recorded: Mapping[str, Any]) -> Iterator[str]:
    """Lines of what is not as it was recorded."""
    computed = record_of(places)
    for name in ("numbers", "names"):
        if computed[name] != recorded[name]:
            yield f"{name}: {computed[name]}, recorded {recorded[name]}"
    for place, expected in recorded["values"].items():
        value = places.get(place)
        close = value is not None and math.isclose(
            value, expected, rel_tol=rtol_of(place), abs_tol=ATOL
        )
        if not close:
            yield f"{place}: {value}, recorded {expected}"
    moved = [
        abs(one - two)
        for one, two in zip(computed["digests"], recorded["digests"], strict=True)
    ]
    if max(moved) > RTOL:
        yield f"all values: digests moved by {moved}, more than {RTOL}"


def main(numbers: Sequence[str]) -> None:
    recorded = json.loads(RECORDED.read_text()) if numbers else {}
    for number in numbers or figure_numbers():
        begin = time.process_time()
        with tempfile.TemporaryDirectory() as directory:
            values = quick_values(number, Path(directory))
        recorded[number] = record_of(places_of(number, values))
        write(recorded)
        print(f"{number}: {time.process_time() - begin:.1f} s", flush=True)  # noqa: T201


def write(recorded: Mapping[str, Any]) -> None:
    text = json.dumps(recorded, indent=1, sort_keys=True, allow_nan=False)
    RECORDED.write_text(text + "\n")


def _rounded(value: float | None) -> float | None:
    return None if value is None else float(f"{value:.{DIGITS}g}")


if __name__ == "__main__":
    main(sys.argv[1:])
