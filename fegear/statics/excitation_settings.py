"""Which stiffness the meshes of a lumped train have, and how it is computed."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

from fegear.gearset.model import GearSet
from fegear.gearset.pitch_errors import pair_periods
from fegear.gearset.planes import Plane
from fegear.statics.choices import PLANE, RESOLUTION
from lumped.common.checks import require_fields
from lumped.common.csv_text import format_exact
from lumped.common.options import Range, documented, option
from lumped.common.short_repr import ShortRepr
from lumped.train.excitation_tables import ReliefStiffness

if TYPE_CHECKING:
    from fegear.statics.settings import StaticsSettings

Kind = Literal["fe", "rectangular", "trapezoid", "fourier"]
LONG_POSITIONS = 64  # of a base pitch, at most, where tooth pairs differ


@documented
@dataclass(frozen=True, kw_only=True)
class ExcitationSettings(ShortRepr):
    """Source of the mesh stiffness."""

    kind: Kind = option(
        "fe",
        "Mesh stiffness over the mesh cycle. fe: tables solved by finite elements; "
        "rectangular, trapezoid, fourier: built from mean_stiffness_N_per_m, "
        "stiffness_variation and load_share of the gear set; finite elements give what "
        "is missing.",
    )
    ramp: float = option(
        0.1,
        "Length over which the stiffness of {kind} trapezoid rises and falls [base "
        "pitches].",
        Range(0.0, 1.0),
    )
    harmonics: int = option(
        5,
        "Number of harmonics of the mesh frequency that {kind} fourier keeps.",
        Range(1, 1000),
    )
    positions: int = option(
        256,
        "Number of mesh positions per base pitch of a finite-element table.",
        Range(4, 1_000_000),
    )
    resolution: Literal["coarse", "default", "fine"] = option("default", RESOLUTION)
    plane: Plane | None = option(None, PLANE)
    corner_contact: bool = option(
        True, "Contact of tip corners before and after the nominal path of contact."
    )
    relief_stiffness: ReliefStiffness = option(
        "own",
        "Stiffness of tooth pairs with relief in model 1. own: that of the relieved "
        "teeth where they carry load at rest; unmodified: that of teeth without "
        "relief, as in the multi-mesh source.",
    )

    def __post_init__(self) -> None:
        require_fields(self)

    @property
    def statics(self) -> StaticsSettings:
        """How the finite elements solve a table."""
        from fegear.statics.settings import StaticsSettings

        return StaticsSettings(
            positions=self.positions,
            resolution=self.resolution,
            plane=self.plane,
            corner_contact=self.corner_contact,
            shafts="off",  # gears that move have coordinates of their own
            estimate_error=False,
            root_stress=False,
        )

    def header_of(self, gear_set: GearSet) -> dict[str, str]:
        """Entries of a file's header: what was solved, and how.

        Parameters
        ----------
        gear_set : GearSet
            Gear set that is solved, which may name the plane state.

        Returns
        -------
        dict of str
            Entries by their names.
        """
        shape = {
            "fe": "finite elements",
            "trapezoid": f"trapezoid, ramp {format_exact(self.ramp)} base pitches",
            "fourier": f"fourier, {self.harmonics} harmonics",
        }.get(self.kind, self.kind)
        elements: dict[str, str] = {"plane": self.statics.plane_of(gear_set)}
        elements["resolution"] = self.resolution
        if self.relief_stiffness != "own":
            elements["stiffness of relieved pairs"] = "that of unmodified teeth"
        return {"excitation": shape, **elements}

    def solves_elements(self, gear_set: GearSet) -> bool:
        """Whether finite elements are needed for what the gear set does not give.

        Parameters
        ----------
        gear_set : GearSet
            Gear set whose meshes may give a mean stiffness and its variation.

        Returns
        -------
        bool
            True if a table is solved by finite elements.
        """
        return self.kind == "fe" or any(
            mesh.mean_stiffness is None or mesh.stiffness_variation is None
            for mesh in gear_set.meshes
        )

    def statics_of(self, gear_set: GearSet) -> StaticsSettings:
        """Settings of the statics for the meshes of a gear set.

        They have fewer positions where tooth pairs of any mesh differ: meshes that are
        alike have equal tables, too.

        Parameters
        ----------
        gear_set : GearSet
            Gear set.

        Returns
        -------
        StaticsSettings
            Settings for `fegear.solve_mesh`.
        """
        fewer = min(self.positions, LONG_POSITIONS)
        long = max(pair_periods(gear_set)) > 1
        return replace(self.statics, positions=fewer) if long else self.statics
