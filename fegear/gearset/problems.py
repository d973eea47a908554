"""What is wrong with a gear set file, in one line for its author."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from fegear.files.errors import nearest
from fegear.gearset.schema import Document, mesh_label
from lumped.common.checks import format_number

PHRASES = {
    "int_type": "must be a whole number",
    "float_type": "must be a number",
    "string_type": "must be a string",
    "tuple_type": "must be a list",
    "list_type": "must be a list",
    "model_type": "must be a table",
    "finite_number": "must be finite",
    "greater_than": "must be above {gt:.12g}",
    "greater_than_equal": "must be at least {ge:.12g}",
    "less_than": "must be below {lt:.12g}",
    "less_than_equal": "must be at most {le:.12g}",
    "literal_error": "must be {expected}",
    "too_short": "has {actual_length} entries; at least {min_length} needed",
    "string_pattern_mismatch": (
        "must not be empty nor hold quotes, control or format characters"
    ),
}
LIMITED = ("greater_than", "greater_than_equal", "less_than", "less_than_equal")
SYMBOLS = {  # of formulas, and the keys that have their values
    "x": "profile_shift",
    "z": "teeth",
    "m": "module_mm",
    "mn": "module_mm",
    "mt": "transverse_module_mm",
    "m_t": "transverse_module_mm",
    "DP": "diametral_pitch_per_in",
    "P": "diametral_pitch_per_in",
    "Pd": "diametral_pitch_per_in",
    "Pnd": "diametral_pitch_per_in",
    "a": "center_distance_mm",
    "aw": "center_distance_mm",
    "b": "face_width_mm",
    "alpha": "pressure_angle_deg",
    "alpha_n": "pressure_angle_deg",
    "alpha_t": "transverse_pressure_angle_deg",
    "da": "tip_diameter_mm",
    "d_a": "tip_diameter_mm",
    "ra": "tip_radius_mm",
    "hf": "dedendum_mm",
    "h_f": "dedendum_mm",
    "ha": "addendum_mm",
    "h_a": "addendum_mm",
    "E": "young_modulus_GPa",
    "nu": "poisson_ratio",
    "rho": "density_kg_per_m3",
    "J": "inertia_kg_m2",
    "T": "torques_Nm",
}
TABLES_IN_LISTS = ("gear", "mesh", "shaft", "planetary")
OTHER_GEARS = re.compile(r"spiral|bevel|worm|crossed", re.I)
PARALLEL_AXES = "spur and helical gears on parallel axes only"
MEANT_KEYS = {  # by what is in words for them
    r"helix|helical|^beta$": "helix_angle_deg",
    r"^hand": "hand",
    r"internal|ring_gear": "internal",
    r"transverse_?module|module_?transverse|^m_?t(_mm)?$": "transverse_module_mm",
    r"transverse_?pressure|pressure_?angle_?t|^alpha_?t(_deg)?$": (
        "transverse_pressure_angle_deg"
    ),
    r"transverse_?diametral|diametral_?pitch_?t": "transverse_diametral_pitch_per_in",
    r"diametral": "diametral_pitch_per_in",
}
IN_OTHER_KEYS = {  # words for what follows from keys
    r"overlap": "the overlap ratio follows from helix_angle_deg and face_width_mm",
}


def nearest_key(word: str, keys: Iterable[str]) -> str:
    """`nearest` of keys, which a symbol of the field may stand for."""
    names, meant = list(keys), SYMBOLS.get(word, "")
    return nearest(meant if meant in names else word, names)


def shown(value: Any) -> str:
    """A value as an author would recognise it, short and on one line."""
    if isinstance(value, float):
        return f"{value:.12g}"
    if isinstance(value, Mapping):
        return "a table"
    if isinstance(value, list):
        return "a list"
    text = json.dumps(value, default=str, ensure_ascii=False)
    return text if len(text) <= 40 else f"{text[:37]}..."


def first_problem(
    error: ValidationError,
    tables: Mapping[str, Any],
    document: type[BaseModel] = Document,
) -> str:
    """One line on the first error; a misspelled key comes before its absence.

    document : what the tables were read as
    """
    details = error.errors(include_url=False)
    misspelled = [item for item in details if item["type"] == "extra_forbidden"]
    first = (misspelled or details)[0]
    where, key = _place(first["loc"], tables)
    text = _statement(first, key, document)
    return f"{where}: {text}" if where else text


def _statement(item: ErrorDetails, key: str, document: type[BaseModel]) -> str:
    kind, value = item["type"], item["input"]
    if kind == "extra_forbidden":
        word, keys = str(item["loc"][-1]), known_keys(item["loc"][:-1], document)
        return f"unknown key {key}{_hint(word, keys)}"
    if kind == "missing":
        return f"{_bracketed(key)} is missing"
    if kind == "value_error":
        reason = str(item["ctx"]["error"])
        if isinstance(value, dict):
            return f"{key}: {reason}" if key else reason
        return f"{key} = {shown(value)}; {reason}"
    if key in TABLES_IN_LISTS and isinstance(value, dict):
        return f"[{key}] must be written [[{key}]], one table for each {key}"
    phrase = PHRASES.get(kind, item["msg"]).format(**item.get("ctx", {}))
    if isinstance(value, int | float) and value < 0:
        if key == "teeth":
            phrase += f"; an internal gear has teeth = {-value} and internal = true"
        if key == "helix_angle_deg":
            phrase += '; which way the teeth turn is said by hand = "left" or "right"'
    if kind == "too_short":
        return f"{key} {phrase}"
    if kind in LIMITED and isinstance(value, float):
        return f"{key} = {format_number(value)}; {phrase}" if key else phrase
    return f"{key} = {shown(value)}; {phrase}" if key else phrase


def _hint(word: str, keys: Sequence[str]) -> str:
    """What to write instead of a word that is no key."""
    for pattern, text in IN_OTHER_KEYS.items():
        if "module_mm" in keys and re.search(pattern, word, re.I):
            return f"; {text}"
    for pattern, meant in MEANT_KEYS.items():
        if meant in keys and re.search(pattern, word, re.I):
            return f", did you mean {meant}?"
    if OTHER_GEARS.search(word):
        return f"; {PARALLEL_AXES}"
    return nearest_key(word, keys)


def _bracketed(key: str) -> str:
    return f"[[{key}]]" if key in TABLES_IN_LISTS else key


def _place(loc: tuple[int | str, ...], tables: Mapping[str, Any]) -> tuple[str, str]:
    """('gear "pinion"', 'hub_radius_mm') of an error's location."""
    if len(loc) >= 2 and loc[0] in TABLES_IN_LISTS and isinstance(loc[1], int):
        return _label(str(loc[0]), loc[1], tables), _dotted(loc[2:])
    if loc and loc[0] in ("defaults", "load", "dynamics") and len(loc) > 1:
        return str(loc[0]), _dotted(loc[1:])
    return "", _dotted(loc)


def _label(kind: str, index: int, tables: Mapping[str, Any]) -> str:
    table = tables[kind][index]
    entry = table if isinstance(table, dict) else {}
    name, driver, driven = map(entry.get, ("name", "driver", "driven"))
    if kind == "gear" and isinstance(name, str):
        return f"gear {shown(name)}"
    if kind == "mesh" and isinstance(driver, str) and isinstance(driven, str):
        return mesh_label(driver, driven)
    return kind if kind == "planetary" else f"{kind} {index + 1}"


def _dotted(parts: Iterable[int | str]) -> str:
    """tip_relief.magnitude_um, or torques_Nm entry 2."""
    text = ""
    for part in parts:
        if isinstance(part, int):
            text += f" entry {part + 1}"
        else:
            text += f".{part}" if text else part
    return text


def known_keys(
    loc: Iterable[int | str], document: type[BaseModel] = Document
) -> list[str]:
    """Keys of the table at a location of the document."""
    model = document
    for part in loc:
        if isinstance(part, str) and part in model.model_fields:
            model = model_of(model.model_fields[part].annotation) or model
    return list(model.model_fields)


def lists_tables(loc: Sequence[str], document: type[BaseModel] = Document) -> bool:
    """Whether a location of the document holds a list of tables."""
    model, annotation = document, None
    for part in loc:
        if part not in model.model_fields:
            return False
        annotation = model.model_fields[part].annotation
        model = model_of(annotation) or model
    return get_origin(annotation) is tuple and model_of(annotation) is not None


def model_of(annotation: Any) -> type[BaseModel] | None:
    """The table's model in `X`, `X | None` or `tuple[X, ...]`."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    models = (model_of(part) for part in get_args(annotation))
    return next((model for model in models if model), None)
