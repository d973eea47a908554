"""How a mesh table is computed: mesh, contact and what is left out."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from fegear.elasticity.material import PlaneMaterial
from fegear.elasticity.sector import CyclicSector, cyclic_sector
from fegear.gearset.model import Gear, GearSet
from fegear.gearset.planes import Plane, SectionPlane
from fegear.gearset.yielding import on_shafts
from fegear.statics.choices import PLANE, RESOLUTION
from lumped.common.checks import require_fields
from lumped.common.options import Range, documented, option
from lumped.common.short_repr import ShortRepr
from meshes import MeshSize

MAX_ROWS = 1_000_000  # of a table
STRAIN_WIDTH = 5.0  # modules, from which teeth are nearer to plane strain


@dataclass(frozen=True)
class Resolution:
    """Mesh of a sector, nodes of a contact patch and slices of the face width.

    slices : at least; more where there is much overlap, see `slices_per_pitch`
    """

    size: MeshSize
    nodes: int
    slices: int = 32

    @property
    def slices_per_pitch(self) -> float:
        """Slices while lines of contact move by a base pitch along the path.

        With fewer than half as many, reliefs close slice by slice and the transmission
        error shows it.
        """
        return 0.75 * self.slices

    def coarsened(self) -> Resolution:
        """The companion that the discretisation estimate compares with."""
        nodes, slices = max(9, round(0.7 * self.nodes)), round(0.7 * self.slices)
        return Resolution(self.size.refined(0.7), nodes, slices)


Fineness = Literal["coarse", "default", "fine"]
RESOLUTIONS: dict[Fineness, Resolution] = {
    "coarse": Resolution(MeshSize().refined(0.7), 17, 22),
    "default": Resolution(MeshSize(), 25),
    "fine": Resolution(MeshSize().refined(1.7), 49, 64),
}

CORNERS = {True: "on", False: "off"}
BODIES = {
    "held": "held at the hub",
    "free": "free to accelerate, transmission errors of mean rotations",
}


def nearer_plane(gear: Gear) -> SectionPlane:
    """The plane state that the compliance of a gear's teeth is nearer to."""
    narrow = gear.face_width < STRAIN_WIDTH * gear.geometry.module
    return "stress" if narrow else "strain"


@documented
@dataclass(frozen=True, kw_only=True)
class StaticsSettings(ShortRepr):
    """How a mesh table is computed by finite elements."""

    positions: int = option(
        64, "Number of mesh positions per base pitch.", Range(1, MAX_ROWS)
    )
    friction: float = option(
        0.0, "Coulomb friction coefficient.", Range(0.0, below=0.5)
    )
    plane: Plane | None = option(None, PLANE)
    resolution: Fineness = option("default", RESOLUTION)
    corner_contact: bool = option(
        True, "Contact of tip corners before and after the nominal path of contact."
    )
    body: Literal["held", "free"] = option(
        "held",
        "Support of the gear bodies. held: at their hubs; free: by their inertia "
        "alone, which gives the compliance of gears that vibrate.",
    )
    shafts: Literal["on", "off"] | None = option(
        None,
        "Whether shafts with lengths_mm and bearings yield under the forces of teeth. "
        "[default: on, off in plane stress and plane strain and with free bodies]",
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

    def on_shafts(self, gear_set: GearSet) -> GearSet:
        """Gear set whose shafts and bearings yield, if they do.

        Parameters
        ----------
        gear_set : fegear.gearset.model.GearSet
            Gear set with shafts or without.

        Returns
        -------
        fegear.gearset.model.GearSet
            The same where shafts are left out or not described.

        Raises
        ------
        InputError
            If no bearing takes the thrust of helical gears, or one is double helical.
        """
        is_solid = self.plane_of(gear_set) == "width" and self.body == "held"
        yields = is_solid if self.shafts is None else self.shafts == "on"
        return on_shafts(gear_set) if yields else gear_set

    def plane_of(self, gears: Gear | GearSet) -> Plane:
        """State of the finite elements of a gear, or of those of a set.

        Parameters
        ----------
        gears : fegear.gearset.model.Gear or GearSet
            What it is asked of.

        Returns
        -------
        str
            The chosen one, or what the gear set names.
        """
        return self.plane or gears.plane

    def material(self, gear: Gear, width: float | None = None) -> PlaneMaterial:
        """Material of a gear in the plane of the settings.

        Parameters
        ----------
        gear : fegear.gearset.model.Gear
            Gear whose Young's modulus and Poisson's ratio are taken.
        width : float, optional
            Common face width of its mesh [m]; that of the gear by default.

        Returns
        -------
        PlaneMaterial
            Elastic constants in plane stress, plane strain or teeth of that width.
        """
        plane = self.plane_of(gear)
        constants = gear.young_modulus, gear.poisson_ratio, plane
        if plane != "width":
            return PlaneMaterial(*constants)
        return PlaneMaterial(*constants, gear.helix_width if width is None else width)

    def sector(self, gear: Gear, refinement: float = 1.0) -> CyclicSector:
        """What all finite elements of a gear are made from.

        Those of teeth of their width are in the plane state that is nearer to it.

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
        material = self.material(gear)
        if self.plane_of(gear) == "width":
            material = replace(material, plane=nearer_plane(gear), width=None)
        return cyclic_sector(gear.geometry, material, size)
