"""How a mesh table is computed: mesh, contact and what is left out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from fegear.elasticity.material import Plane, PlaneMaterial
from fegear.elasticity.sector import CyclicSector, cyclic_sector
from fegear.gearset.model import Gear
from fegear.statics.choices import PLANE, RESOLUTION
from lumped.common.checks import require_fields
from lumped.common.options import Range, documented, option
from meshes import MeshSize

MAX_ROWS = 1_000_000  # of a table


@dataclass(frozen=True)
class Resolution:
    """Mesh of a sector and nodes of a contact patch."""

    size: MeshSize
    nodes: int

    def coarsened(self) -> Resolution:
        """The companion that the discretisation estimate compares with."""
        return Resolution(self.size.refined(0.7), max(9, round(0.7 * self.nodes)))


Fineness = Literal["coarse", "default", "fine"]
RESOLUTIONS: dict[Fineness, Resolution] = {
    "coarse": Resolution(MeshSize().refined(0.7), 17),
    "default": Resolution(MeshSize(), 25),
    "fine": Resolution(MeshSize().refined(1.7), 49),
}

CORNERS = {True: "on", False: "off"}
BODIES = {
    "held": "held at the hub",
    "free": "free to accelerate, transmission errors of mean rotations",
}


@documented
@dataclass(frozen=True, kw_only=True)
class StaticsSettings:
    """How a mesh table is computed by finite elements."""

    positions: int = option(
        64, "Number of mesh positions per base pitch.", Range(1, MAX_ROWS)
    )
    friction: float = option(
        0.0, "Coulomb friction coefficient.", Range(0.0, below=0.5)
    )
    plane: Plane = option("stress", PLANE)
    resolution: Fineness = option("default", RESOLUTION)
    corner_contact: bool = option(
        True, "Contact of tip corners before and after the nominal path of contact."
    )
    body: Literal["held", "free"] = option(
        "held",
        "Support of the gear bodies. held: at their hubs; free: by their inertia "
        "alone, which gives the compliance of gears that vibrate.",
    )
    estimate_error: bool = option(
        True, "Whether the discretisation error is estimated on a coarser mesh."
    )
    root_stress: bool = option(
        True, "Whether the root stress of both gears is computed."
    )

    def __post_init__(self) -> None:
        require_fields(self)

    @property
    def size(self) -> MeshSize:
        """Size of the sector mesh, for everything that is solved on it."""
        return RESOLUTIONS[self.resolution].size

    def material(self, gear: Gear) -> PlaneMaterial:
        """Material of a gear in the plane of the settings.

        Parameters
        ----------
        gear : fegear.gearset.model.Gear
            Gear whose Young's modulus and Poisson's ratio are taken.

        Returns
        -------
        PlaneMaterial
            Elastic constants in plane stress or plane strain.
        """
        return PlaneMaterial(gear.young_modulus, gear.poisson_ratio, self.plane)

    def sector(self, gear: Gear, refinement: float = 1.0) -> CyclicSector:
        """What all finite elements of a gear are made from.

        Parameters
        ----------
        gear : fegear.gearset.model.Gear
            Gear that is meshed.
        refinement : float, optional
            Factor on the fineness of the mesh, finer above 1.

        Returns
        -------
        CyclicSector
            Mesh, stiffness and flanks of one tooth sector.
        """
        size = self.size if refinement == 1.0 else self.size.refined(refinement)
        return cyclic_sector(gear.geometry, self.material(gear), size)
