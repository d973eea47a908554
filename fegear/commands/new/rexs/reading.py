"""REXS files: XML, JSON, or either in a ZIP file."""

from __future__ import annotations

import io
import json
import re
import zipfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from fegear.commands.new.rexs.components import (
    Attribute,
    Component,
    Relation,
    RexsModel,
)
from fegear.files.errors import InputError
from fegear.files.output import read_content

ENDINGS = (".rexs", ".rexsj", ".rexsz", ".json", ".xml")
MAX_BYTES = 64 * 1024**2  # of a file, also after it is unpacked
VERSION = re.compile(r"1\.\d+(\.\d+)*")
# keys of a JSON attribute that hold no value
NOT_A_VALUE = ("id", "unit")


def read_rexs(path: str | Path) -> RexsModel:
    """The model of a REXS file; InputError names the file."""
    data = read_content(path, MAX_BYTES)
    try:
        return parse_rexs(data)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def parse_rexs(data: bytes) -> RexsModel:
    """The model of the content of a REXS file."""
    if data.startswith(b"PK"):
        data = _unpacked_model(data)
    is_json = data.removeprefix(b"\xef\xbb\xbf").lstrip().startswith(b"{")
    return _model(_json_tree(data) if is_json else _xml_tree(data))


def _unpacked_model(data: bytes) -> bytes:
    """The model in a ZIP file, which may hold other files, such as pictures."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            names = [n for n in archive.namelist() if n.lower().endswith(ENDINGS)]
            if not names:
                raise InputError("ZIP file without a .rexs file")
            with archive.open(min(names, key=_rank_of_ending)) as file:
                content = file.read(MAX_BYTES + 1)
    except InputError:
        raise
    except Exception as error:  # zipfile and zlib raise errors of many types
        raise InputError(f"ZIP file cannot be read: {error}") from None
    if len(content) > MAX_BYTES:
        raise InputError(f"larger than {MAX_BYTES // 1024**2} MiB when unpacked")
    return content


def _rank_of_ending(name: str) -> tuple[int, str]:
    """Order of names: .rexs first."""
    return next(n for n, end in enumerate(ENDINGS) if name.lower().endswith(end)), name


class _TreeBuilder(ElementTree.TreeBuilder):
    """Elements of a document without a type, which could define entities."""

    def doctype(self, name: str, pubid: str | None, system: str | None) -> None:
        raise InputError("XML with a DOCTYPE, which a REXS file has not")


def _xml_tree(data: bytes) -> dict[str, Any]:
    """The tree of a JSON file from XML."""
    try:
        root = ElementTree.fromstring(  # entities are refused above
            data, ElementTree.XMLParser(target=_TreeBuilder())
        )
    except (ElementTree.ParseError, LookupError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"not a REXS file: XML syntax: {error}") from None
    if _local_tag(root) != "model":
        raise InputError(
            f"not a REXS file: root <{_local_tag(root)[:40]}>; must be <model>"
        )
    return {
        **root.attrib,
        "relations": [_xml_relation(item) for item in _descendants(root, "relations")],
        "components": [
            _xml_component(item) for item in _descendants(root, "components")
        ],
        "load_spectrum": {"load_cases": list(_xml_load_cases(root))},
    }


def _local_tag(element: ElementTree.Element) -> str:
    return str(element.tag).rpartition("}")[2]


def _descendants(root: ElementTree.Element, name: str) -> list[ElementTree.Element]:
    """Elements within those of a name."""
    return [item for child in root if _local_tag(child) == name for item in child]


def _xml_load_cases(root: ElementTree.Element) -> Iterator[dict[str, Any]]:
    for case in _descendants(root, "load_spectrum"):
        if _local_tag(case) == "load_case":
            yield {"components": [_xml_component(item) for item in case]}


def _xml_relation(element: ElementTree.Element) -> dict[str, Any]:
    return {**element.attrib, "refs": [dict(ref.attrib) for ref in element]}


def _xml_component(element: ElementTree.Element) -> dict[str, Any]:
    attributes = [
        _xml_attribute(item) for item in element if _local_tag(item) == "attribute"
    ]
    return {**element.attrib, "attributes": attributes}


def _xml_attribute(element: ElementTree.Element) -> dict[str, Any]:
    value: Any = element.text
    for child in element:
        value = [item.text for item in child] if _local_tag(child) == "array" else None
    return {**element.attrib, "value": value}


def _json_tree(data: bytes) -> dict[str, Any]:
    try:
        tree = json.loads(data.decode("utf-8-sig"))
    except RecursionError:
        raise InputError("not a REXS file: JSON nested too deeply") from None
    except ValueError as error:
        raise InputError(f"not a REXS file: JSON syntax: {error}") from None
    model = tree.get("model") if isinstance(tree, dict) else None
    if not isinstance(model, dict):
        raise InputError('not a REXS file: JSON without the object "model"')
    return model


def _model(tree: Mapping[str, Any]) -> RexsModel:
    version = str(tree.get("version", "missing"))[:40]
    if not VERSION.fullmatch(version):
        raise InputError(f"version = {version}; must be one of REXS 1, such as 1.4")
    components = _components_by_number(_entries(tree, "components"))
    return RexsModel(
        version=version,
        application=_printable_text(tree.get("applicationId")),
        components=components,
        relations=tuple(
            _relation(entry, components) for entry in _entries(tree, "relations")
        ),
        load_cases=tuple(
            _load_case(number, case)
            for number, case in enumerate(
                _entries(tree.get("load_spectrum") or {}, "load_cases"), 1
            )
        ),
    )


def _load_case(number: int, case: dict[str, Any]) -> dict[int, Component]:
    try:
        return _components_by_number(_entries(case, "components"))
    except InputError as error:
        raise InputError(f"load case {number}: {error}") from None


def _entries(tree: Any, name: str) -> list[dict[str, Any]]:
    """A list of objects, empty where there is none."""
    entries = (tree.get(name) or []) if isinstance(tree, dict) else None
    if not isinstance(entries, list) or not all(isinstance(e, dict) for e in entries):
        raise InputError(f"{name}: must be a list of objects")
    return entries


def _components_by_number(entries: list[dict[str, Any]]) -> dict[int, Component]:
    components: dict[int, Component] = {}
    for entry in entries:
        component = _component(entry)
        if component.number in components:
            raise InputError(f"component id = {component.number}; is there twice")
        components[component.number] = component
    return components


def _component(entry: dict[str, Any]) -> Component:
    number, kind = _number(entry, "component"), _printable_text(entry.get("type"))
    if not kind:
        raise InputError(f"component {number}: type is missing")
    attributes = map(_attribute, _entries(entry, "attributes"))
    return Component(
        number,
        kind,
        _printable_text(entry.get("name")),
        {item.name: item for item in attributes},
    )


def _attribute(entry: dict[str, Any]) -> Attribute:
    values = [value for key, value in entry.items() if key not in NOT_A_VALUE]
    unit = entry.get("unit")
    return Attribute(
        _printable_text(entry.get("id")),
        None if unit is None else _printable_text(unit),
        values[0] if values else None,
    )


def _relation(entry: dict[str, Any], components: Mapping[int, Component]) -> Relation:
    number = _number(entry, "relation")
    roles = tuple(
        (_printable_text(ref.get("role")), _number(ref, f"relation {number}: ref"))
        for ref in _entries(entry, "refs")
    )
    for role, other in roles:
        if other not in components:
            raise InputError(
                f"relation {number}: ref with role {role} has id = {other}; "
                "there is no such component"
            )
    return Relation(number, _printable_text(entry.get("type")), roles)


def _number(entry: dict[str, Any], where: str) -> int:
    """The id of an entry, a whole number."""
    value = entry.get("id")
    try:
        if isinstance(value, bool | float):
            raise ValueError
        return int(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        text = _printable_text(value)[:40] or "nothing"
        raise InputError(f"{where} id = {text}; must be a whole number") from None


def _printable_text(value: Any) -> str:
    """Text of a name on one line, without quotes and what cannot be printed."""
    text = " ".join(str("" if value is None else value).replace('"', "'").split())
    return "".join(letter for letter in text if letter.isprintable())[:200]
