"""Materials by name, from `materials.toml`."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from functools import cache
from importlib import resources

STEEL = "steel"  # of a gear whose file says nothing


@dataclass(frozen=True, kw_only=True)
class NamedMaterial:
    """Elastic values of a material at 23 C, in the units of a gear-set file.

    condition : to which they apply, besides the temperature
    """

    young_modulus_GPa: float
    poisson_ratio: float
    density_kg_per_m3: float
    condition: str
    source: str


@cache
def materials() -> dict[str, NamedMaterial]:
    """All materials by name, in the order of the file."""
    text = (resources.files("fegear.gearset") / "materials.toml").read_text("utf-8")
    return {
        name: NamedMaterial(**values) for name, values in tomllib.loads(text).items()
    }


def material_names() -> tuple[str, ...]:
    return tuple(materials())


def require_material(name: str) -> str:
    """The name; ValueError with the names that are allowed."""
    if name not in materials():
        raise ValueError(f"allowed are {', '.join(materials())}")
    return name
