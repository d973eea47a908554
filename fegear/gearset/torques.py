"""How the input torque is passed on through meshes and shafts."""

from __future__ import annotations

from fegear.files.errors import InputError
from fegear.gearset.planetary.carriers import input_name, members_of
from fegear.gearset.schema import Document, LoadEntry, MeshEntry
from lumped.common.checks import require_present


def mesh_torques(document: Document) -> list[tuple[float, ...]]:
    """Torques on every mesh's driver [N m], a value for each load case.

    They follow from statics alone, T2 = T1 z2 / z1, so a train may not branch.
    Empty where the file has no [load].
    """
    load = document.load
    if load is None:
        return [()] * len(document.mesh)
    if document.planetary:
        return _planetary_torques(document, load)
    shafts = _shaft_of(document)
    driving, driven = _meshes_by_shaft(document, shafts)
    teeth = {gear.name: gear.teeth for gear in document.gear}
    factors: dict[int, float] = {}
    ratio = output_ratio(document)
    if ratio is None:
        _require_input(document, driven, shafts)
    shaft, factor = shafts[load.gear], 1.0 / (ratio or 1.0)
    while shaft in driven:  # back to the input
        shaft = shafts[document.mesh[driven[shaft]].driver]
    while shaft in driving:
        number = driving.pop(shaft)
        mesh = document.mesh[number]
        factors[number] = factor
        factor *= teeth[mesh.driven] / teeth[mesh.driver]
        shaft = shafts[mesh.driven]
    _require_all_reached(document, factors)
    return [
        tuple(torque * factors[number] for torque in load.torques_Nm)
        for number in range(len(document.mesh))
    ]


def output_ratio(document: Document) -> float | None:
    """Torque on the gear of [load] over that on the input, None if it is no output."""
    load = document.load
    if load is None or document.planetary:
        return None
    shafts = _shaft_of(document)
    driving, driven = _meshes_by_shaft(document, shafts)
    shaft, passed = shafts[load.gear], set[int]()
    is_output = any(mesh.driven == load.gear for mesh in document.mesh)
    if shaft in driving or not is_output:
        return None
    teeth, ratio = {gear.name: gear.teeth for gear in document.gear}, 1.0
    while shaft in driven and shaft not in passed:
        passed.add(shaft)
        mesh = document.mesh[driven[shaft]]
        ratio *= teeth[mesh.driven] / teeth[mesh.driver]
        shaft = shafts[mesh.driver]
    return ratio


def torque_inferences(document: Document) -> list[str]:
    """A sentence on torques that are given on the output gear."""
    load, ratio = document.load, output_ratio(document)
    if load is None or ratio is None:
        return []
    torques = ", ".join(f"{torque / ratio:.6g}" for torque in load.torques_Nm)
    return [
        f'load: torques_Nm are on the driven gear "{load.gear}"; divided by the ratio '
        f"{ratio:.6g} they are {torques} N m on the input gear"
    ]


def _planetary_torques(document: Document, load: LoadEntry) -> list[tuple[float, ...]]:
    """Torques of meshes that share the load equally."""
    name, members = input_name(document), members_of(document)
    if load.gear != name:
        raise InputError(
            f'load: gear = "{load.gear}"; must be "{name}", the input of the planetary '
            "set"
        )
    teeth = {gear.name: gear.teeth for gear in document.gear}
    factors = [members.torque_factor(teeth[mesh.driver]) for mesh in document.mesh]
    return [tuple(t * factor for t in load.torques_Nm) for factor in factors]


def _shaft_of(document: Document) -> dict[str, int]:
    """Gears that turn as one share a number."""
    shafts = {name: number for number, name in enumerate(document.gear_names)}
    for shaft in document.shaft:
        shafts.update(dict.fromkeys(shaft.gears, shafts[shaft.gears[0]]))
    return shafts


def _meshes_by_shaft(
    document: Document, shafts: dict[str, int]
) -> tuple[dict[int, int], dict[int, int]]:
    """(mesh that a shaft drives, mesh that drives it), each at most one."""
    driving: dict[int, int] = {}
    driven: dict[int, int] = {}
    for number, mesh in enumerate(document.mesh):
        for meshes, name, does in (
            (driving, mesh.driver, "drives"),
            (driven, mesh.driven, "is driven by"),
        ):
            other = meshes.setdefault(shafts[name], number)
            if other != number:
                raise InputError(_ambiguous(document.mesh[other], mesh, name, does))
    return driving, driven


def _ambiguous(one: MeshEntry, two: MeshEntry, name: str, does: str) -> str:
    return (
        f'load: gear "{name}" or its shaft {does} two meshes, {_ends(one)} and '
        f"{_ends(two)}; the split of the torque is ambiguous, one mesh is allowed"
    )


def _ends(mesh: MeshEntry) -> str:
    return mesh.label.removeprefix("mesh ")


def _require_input(
    document: Document, driven: dict[int, int], shafts: dict[str, int]
) -> None:
    name = require_present(document.load, "load").gear
    inputs = [m.driver for m in document.mesh if shafts[m.driver] not in driven]
    if name not in inputs:
        listed = " or ".join(f'"{gear}"' for gear in inputs)
        raise InputError(
            f'load: gear = "{name}"; must be the driver that no mesh drives, '
            f"{listed or 'but every driver is driven'}"
        )


def _require_all_reached(document: Document, factors: dict[int, float]) -> None:
    for number, mesh in enumerate(document.mesh):
        if number not in factors:
            load = require_present(document.load, "load")
            raise InputError(
                f'load: gear = "{load.gear}"; its torque does not reach '
                f"{mesh.label}, every mesh must be reached"
            )
