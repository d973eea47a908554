"""Static contact of a gear pair: the problem, and where it is solved."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from fegear.contact.offset_centers import CenterOffset
from fegear.contact.plane.contact import PlaneContact
from fegear.contact.tooth_faults import ToothFaults
from fegear.contact.width.contact import WidthContact
from fegear.elasticity.flank import FlankCompliance
from fegear.gearset.modifications import (
    FlankLead,
    FlankModifications,
    FlankTopography,
)
from lumped.common.array_types import Array, Indices
from lumped.common.short_repr import ShortRepr
from meshes import GearPair

PATCHES = PlaneContact()

# Base pitches off the path within which corners may touch: where the next pair takes
# over at the latest, and for each of the teeth beside them that are missing or broken
CORNER_RANGE, LONE_CORNER_RANGE = 0.5, 0.75


class ContactFailure(ArithmeticError):
    """A contact problem without a finite, converged solution."""


class OpenContact(ContactFailure):
    """No flanks face each other.

    position : base pitches from the pitch point of the mesh's first reference pair
    """

    def __init__(self, problem: ContactProblem, position: float) -> None:
        angle = math.degrees(problem.pair.driver.pitch_angle * position)
        super().__init__(
            f"no teeth touch at position {position:.5g} base pitches, {angle:.5g} deg "
            "of the driver: the teeth beside those that are missing or broken do not "
            "reach each other, and gears under torque do not rest"
        )


class MeshPositions(NamedTuple):
    """Positions (n,) of a mesh at which its contact is solved.

    position : base pitches from the pitch point of the reference pair
    pitch : (n,) whole base pitches that come to it; pairs count anew in each
    back : whether the flanks are the back flanks, seen in a mirror
    """

    position: Array
    pitch: Indices
    back: bool = False


@dataclass(frozen=True, kw_only=True)
class ContactFlank(FlankModifications, ShortRepr):
    """The flanks of one gear in contact.

    pitch_errors : material missing on the drive flank of each tooth, and too much on
        its back flank, or empty; tooth 0 of both gears forms the reference pair and
        teeth count in the order in which they come into contact
    faults : teeth that differ from the others, or None
    offset : centre off the axis of rotation, or None
    depths_sought : whether slopes by the depths of the topography come with others
    """

    compliance: FlankCompliance
    pitch_errors: tuple[float, ...] = ()
    faults: ToothFaults | None = None
    offset: CenterOffset | None = None
    depths_sought: bool = False


@dataclass(frozen=True, kw_only=True)
class ContactProblem(ShortRepr):
    """Two flanks in contact; lengths in metres.

    driver, driven : flanks, whose compliances have equally many points
    face_width : common width of the pair
    friction : Coulomb coefficient
    corner_contact : whether tip corners touch outside the nominal path
    solver : across the flanks, where loads are uniform over the face width, or along
        the width
    plane_stress_pressure, plane_strain_pressure : contact pressure in that plane over
        that in the plane of the compliances; material below a narrow contact is in
        plane strain
    """

    pair: GearPair
    driver: ContactFlank
    driven: ContactFlank
    face_width: float
    friction: float = 0.0
    corner_contact: bool = True
    solver: PlaneContact | WidthContact = PATCHES
    plane_stress_pressure: float = 1.0
    plane_strain_pressure: float = 1.0

    def __post_init__(self) -> None:
        shapes = [flank.compliance.normal.shape for flank in self.flanks]
        if shapes[0] != shapes[1]:
            raise ValueError(
                f"shapes of compliances = {shapes[0]} and {shapes[1]}; must have "
                "equally many flank points"
            )
        if not self.face_width > 0.0:
            raise ValueError(f"face_width = {self.face_width}; must be positive")
        if not 0.0 <= self.friction < 0.5:
            raise ValueError(f"friction = {self.friction}; must be in [0, 0.5)")

    @property
    def flanks(self) -> tuple[ContactFlank, ContactFlank]:
        """Flanks of driver and driven gear."""
        return self.driver, self.driven

    @property
    def corner_range(self) -> float:
        """Base pitches off the path within which corners may touch, 0 if none do."""
        if not self.corner_contact:
            return 0.0
        faults = [flank.faults for flank in self.flanks if flank.faults is not None]
        # at some position what is missing of one gear is beside that of the other
        beside = sum(one.most_missing_beside + one.has_broken_tips for one in faults)
        return max(CORNER_RANGE, LONE_CORNER_RANGE * beside)

    @property
    def leads(self) -> tuple[FlankLead | None, FlankLead | None]:
        """Lead modifications of driver and driven gear."""
        return self.driver.lead, self.driven.lead

    @property
    def topographies(self) -> tuple[FlankTopography | None, FlankTopography | None]:
        """Topographies of driver and driven gear."""
        return self.driver.topography, self.driven.topography

    @property
    def offsets(self) -> tuple[CenterOffset | None, CenterOffset | None]:
        """Centres of driver and driven gear off their axes of rotation."""
        return self.driver.offset, self.driven.offset
