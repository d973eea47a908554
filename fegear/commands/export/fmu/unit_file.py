"""An FMU of a gear mesh: FMI 2.0, co-simulation, run by the loader of pythonfmu."""

from __future__ import annotations

import hashlib
import io
import json
import math
import tempfile
import uuid
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from fegear.files.output import write_bytes
from fegear.files.version import package_version
from lumped.train.excitation import MeshExcitation
from lumped.train.waves import Wave

PROGRAM = Path(__file__).with_name("gear_mesh.py")
MODEL = "GearMesh"  # name of the model and of its libraries
# exponents of base units
BASE_UNITS = {
    "rad": {"rad": 1},
    "rad/s": {"rad": 1, "s": -1},
    "N.m": {"kg": 1, "m": 2, "s": -2},
    "N": {"kg": 1, "m": 1, "s": -2},
    "m": {"m": 1},
    "1": {},
    "N.s/m": {"kg": 1, "s": -1},
}


@dataclass(frozen=True, eq=False)
class FmuMesh:
    """A mesh between two gears whose inertia is elsewhere.

    excitation : springs in parallel, of all tooth pairs
    driver_teeth : number of teeth
    base_radii : of driver and driven gear [m]
    backlash : along the line of action [m]
    damping : viscous, along the line of action [N s/m]
    phase : position at the driver's angle 0 [base pitches]
    description : in words
    """

    excitation: MeshExcitation
    driver_teeth: int
    base_radii: tuple[float, float]
    backlash: float
    damping: float
    phase: float
    description: str

    @property
    def data(self) -> dict[str, Any]:
        """What the program of the FMU reads; no backlash is null."""
        pairs = [
            {"stiffness": wave_data(pair.stiffness), "gap": wave_data(pair.gap)}
            for pair in self.excitation.pairs
        ]
        return {
            "description": self.description,
            "driver_teeth": self.driver_teeth,
            "base_radii": list(self.base_radii),
            "backlash": self.backlash if math.isfinite(self.backlash) else None,
            "damping": self.damping,
            "phase": self.phase,
            "pairs": pairs,
        }


def wave_data(wave: Wave) -> dict[str, Any]:
    """Breaks, coefficients of all base pitches (c, n, 4) and offsets, as lists."""
    return {
        "breaks": wave.breaks.tolist(),
        "coefficients": wave.shapes.tolist(),
        "offsets": wave.offsets.tolist(),
    }


def write_fmu(path: Path, mesh: FmuMesh) -> None:
    """Write the FMU; equal meshes give files of equal bytes.

    Raises InputError where the file cannot be written.
    """
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        for name, content in sorted(fmu_files(mesh)):
            # of the oldest date, so that equal meshes are equal
            archive.writestr(zipfile.ZipInfo(name), content, zipfile.ZIP_DEFLATED)
    write_bytes(path, out.getvalue())


def fmu_files(mesh: FmuMesh) -> Iterator[tuple[str, bytes]]:
    """Names and contents of all files of the FMU."""
    data = json.dumps(mesh.data, allow_nan=False).encode()
    program = PROGRAM.read_bytes()
    yield "modelDescription.xml", model_description(data, program)
    yield "resources/mesh.json", data
    yield f"resources/{PROGRAM.name}", program
    yield "resources/slavemodule.txt", PROGRAM.stem.encode()
    loader = loader_folder()
    for source in loader.glob("*.py"):
        yield f"resources/pythonfmu/{source.name}", source.read_bytes()
    binaries = loader / "resources" / "binaries"
    for ending in (".so", ".dll", ".dylib"):
        for library in binaries.rglob(f"*{ending}"):
            name = f"binaries/{library.parent.name}/{MODEL}{ending}"
            yield name, library.read_bytes()


def loader_folder() -> Path:
    """The folder of pythonfmu, which the FMU takes along."""
    spec = find_spec("pythonfmu")
    if spec is None or spec.origin is None:
        raise ModuleNotFoundError("pythonfmu")
    return Path(spec.origin).parent


def model_description(data: bytes, program: bytes) -> bytes:
    """The description in XML that pythonfmu gives, with units and without a date."""
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "mesh.json").write_bytes(data)
        from fegear.commands.export.fmu.gear_mesh import UNITS, GearMeshUnit

        root = GearMeshUnit(instance_name="description", resources=folder).to_xml()
    digest = hashlib.sha256(data + program).hexdigest()
    tool = root.attrib["generationTool"]
    root.set("guid", str(uuid.uuid5(uuid.NAMESPACE_OID, digest)))
    root.set("generationTool", f"fegear {package_version()} with {tool}")
    root.attrib.pop("generationDateAndTime", None)
    root.insert(1, unit_definitions(sorted(set(UNITS.values()))))
    for variable in root.iter("ScalarVariable"):
        variable[0].set("unit", UNITS[variable.attrib["name"]])
    add_initial_unknowns(root)
    ElementTree.indent(root)
    text: bytes = ElementTree.tostring(root, "utf-8", xml_declaration=True)
    return text


def add_initial_unknowns(root: ElementTree.Element) -> None:
    """Say that all outputs follow from inputs at the start as well."""
    for structure in root.iter("ModelStructure"):
        initial = ElementTree.SubElement(structure, "InitialUnknowns")
        for unknown in [*structure.iter("Unknown")]:
            ElementTree.SubElement(initial, "Unknown", dict(unknown.attrib))


def unit_definitions(units: list[str]) -> ElementTree.Element:
    """Units in terms of those of the SI."""
    definitions = ElementTree.Element("UnitDefinitions")
    for unit in units:
        element = ElementTree.SubElement(definitions, "Unit", name=unit)
        powers = {base: str(power) for base, power in BASE_UNITS[unit].items()}
        ElementTree.SubElement(element, "BaseUnit", powers)
    return definitions
