"""Cases of published values: data files, our values and their deviations."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

from fegear.gearset.read import make_gear_set
from validation.published.loaded_pair import LoadedPair
from validation.published.quantities import QUANTITIES

FOLDER = Path(__file__).parent
CASES = (
    *("iso_tr_6336_30", "ross_pair", "fzg_c14", "fzg_c14_report", "nrel_stage"),
    "random_pairs",
)
MAX_UNEXPLAINED = 2.0  # per cent
PAIR_NAME = "pair {}"


@dataclass(frozen=True, kw_only=True)
class PublishedRow:
    """A published value beside ours.

    subject : which pair, of cases with several
    definition : what the source means by the quantity
    method : by which ours is computed
    tolerance : relative, within which ours agrees; None where it is explained
    explanation : why ours deviates by more than 2 %, else empty
    band : least and largest deviation that the explanation accounts for [%], or None
    note : what else a reader should know
    """

    quantity: str
    unit: str
    definition: str
    method: str
    published: float
    ours: float
    tolerance: float | None = None
    explanation: str = ""
    band: tuple[float, float] | None = None
    note: str = ""
    subject: str = ""

    @property
    def per_cent(self) -> float:
        """Deviation of ours from the published value."""
        return 100.0 * (self.ours / self.published - 1.0)

    @property
    def is_explained(self) -> bool:
        return bool(self.explanation)

    @property
    def problem(self) -> str:
        """What is wrong with the row, empty if it is sound."""
        deviation = self.per_cent
        if not math.isfinite(deviation):
            return f"{self.quantity}: {deviation}"
        if not self.is_explained:
            allowed = 100.0 * (self.tolerance or 0.0)
            if abs(deviation) <= allowed:
                return ""
            return f"{self.quantity}: {deviation:+.4g} %, allowed is {allowed:g} %"
        if abs(deviation) <= MAX_UNEXPLAINED:
            return f"{self.quantity}: {deviation:+.4g} % needs no explanation"
        low, high = self.band or (0.0, 0.0)
        if not low <= deviation <= high:
            return f"{self.quantity}: {deviation:+.4g} % is outside {low:g} to {high:g}"
        return ""


@dataclass(frozen=True, kw_only=True)
class PublishedCase:
    """All rows of a source.

    inputs : what was assumed where the source is silent, a sentence each
    """

    name: str
    title: str
    source: str
    inputs: tuple[str, ...]
    rows: tuple[PublishedRow, ...]


def case_names() -> tuple[str, ...]:
    return CASES


def published_cases() -> tuple[PublishedCase, ...]:
    """All cases, computed; some ten seconds, and once in a process.

    Returns
    -------
    tuple of PublishedCase
        Cases in the order of `case_names`.
    """
    return tuple(map(published_case, CASES))


@cache
def published_case(name: str) -> PublishedCase:
    """One case by its name, computed once in a process."""
    data = read_case(name)
    rows = _peer_rows(data) if name == "random_pairs" else _own_rows(data)
    return PublishedCase(
        name=name,
        title=data["title"],
        source=data["source"],
        inputs=tuple(data["assumptions"]),
        rows=tuple(rows),
    )


def read_case(name: str) -> dict[str, Any]:
    return tomllib.loads((FOLDER / f"{name}.toml").read_text("utf-8"))


def pair_of(name: str, edits: Mapping[str, Any] | None = None) -> LoadedPair:
    """The pair of a case, with edits of its gear set such as `gear.1.hub_radius_mm`."""
    data = read_case(name)
    return LoadedPair(make_gear_set(data["gear_set"], edits), data.get("inputs", {}))


def _own_rows(data: Mapping[str, Any]) -> Iterator[PublishedRow]:
    subject = LoadedPair(make_gear_set(data["gear_set"]), data.get("inputs", {}))
    for value in data["value"]:
        yield _row(value, value["published"], QUANTITIES[value["ours"]](subject))


def _row(
    value: Mapping[str, Any], published: float, ours: float, name: str = ""
) -> PublishedRow:
    band = value.get("band")
    return PublishedRow(
        quantity=value["quantity"],
        unit=value["unit"],
        definition=value["definition"],
        method=value["method"],
        published=published,
        ours=ours,
        tolerance=value.get("tolerance"),
        explanation=value.get("explanation", ""),
        band=None if band is None else (band[0], band[1]),
        note=value.get("note", ""),
        subject=name,
    )


def _peer_rows(data: Mapping[str, Any]) -> Iterator[PublishedRow]:
    """A row for every pair that the other program has a value of."""
    pairs = read_case("peers")["pair"]
    loaded = [peer_pair(pair, data["inputs"]) for pair in pairs]
    for value in data["value"]:
        program, key = value["peer"].split(".")
        for number, (pair, subject) in enumerate(zip(pairs, loaded, strict=True), 1):
            if program in pair:
                ours = QUANTITIES[value["ours"]](subject)
                name = PAIR_NAME.format(number)
                yield _of_pair(_row(value, pair[program][key], ours, name))


def _of_pair(row: PublishedRow) -> PublishedRow:
    """An explanation of all pairs is that of those beyond 2 % alone."""
    if row.is_explained and abs(row.per_cent) <= MAX_UNEXPLAINED:
        return replace(row, explanation="", tolerance=MAX_UNEXPLAINED / 100.0)
    return row


def peer_pair(pair: Mapping[str, Any], inputs: Mapping[str, Any]) -> LoadedPair:
    """A pair of `peers.toml`, with the rack of ROSS."""
    m = pair["module_mm"]
    gears = [
        {
            "name": name,
            "teeth": pair["teeth"][i],
            "module_mm": float(m),
            "profile_shift": float(pair["profile_shift"][i]),
            "face_width_mm": float(pair["face_width_mm"]),
            "hub_radius_mm": float(pair["hub_radius_mm"][i]),
            "rack_tip_radius_mm": m * inputs["rack_tip_radius_modules"],
            "inertia_kg_m2": pair["inertia_kg_m2"][i],
        }
        for i, name in enumerate(("pinion", "wheel"))
    ]
    distance = pair["gearpie"]["center_distance_mm"] + inputs["more_distance_mm"]
    mesh = {
        "driver": "pinion",
        "driven": "wheel",
        "center_distance_mm": distance,
        "mean_stiffness_N_per_m": float(pair["mesh_stiffness_N_per_m"]),
    }
    load = {"gear": "pinion", "torques_Nm": [float(pair["torque_Nm"])]}
    return LoadedPair(
        make_gear_set({"name": "pair", "gear": gears, "mesh": [mesh], "load": load})
    )
