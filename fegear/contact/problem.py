"""Static contact of a gear pair: the problem, and its solution over a mesh cycle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fegear.contact.face import FaceContact, FaceLoads
from fegear.contact.offset_centers import CenterOffset
from fegear.contact.tooth_faults import ToothFaults
from fegear.elasticity.flank import FlankCompliance
from fegear.gearset.modifications import FlankModifications
from lumped.common.array_types import Array, Indices
from lumped.common.short_repr import ShortRepr
from meshes import GearPair


class ContactFailure(ArithmeticError):
    """A contact problem without a finite, converged solution."""


@dataclass(frozen=True, kw_only=True)
class ContactFlank(FlankModifications, ShortRepr):
    """The flanks of one gear in contact.

    pitch_errors : material missing on the drive flank of each tooth, and too much on
        its back flank, or empty; tooth 0 of both gears forms the reference pair and
        teeth count in the order in which they come into contact
    faults : teeth that differ from the others, or None
    offset : centre off the axis of rotation, or None
    """

    compliance: FlankCompliance
    pitch_errors: tuple[float, ...] = ()
    faults: ToothFaults | None = None
    offset: CenterOffset | None = None


@dataclass(frozen=True, kw_only=True)
class ContactProblem(ShortRepr):
    """Two flanks in contact; lengths in metres.

    driver, driven : flanks, whose compliances have equally many points
    face_width : common width of the pair
    friction : Coulomb coefficient
    corner_contact : whether tip corners touch outside the nominal path
    nodes : of the contact patch of each tooth pair
    face : what varies over the face width, None where loads are uniform over it
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
    nodes: int = 25
    face: FaceContact | None = None
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
        if self.nodes < 5:
            raise ValueError(f"nodes = {self.nodes}; must be at least 5")

    @property
    def flanks(self) -> tuple[ContactFlank, ContactFlank]:
        """Flanks of driver and driven gear."""
        return self.driver, self.driven

    @property
    def offsets(self) -> tuple[CenterOffset | None, CenterOffset | None]:
        """Centres of driver and driven gear off their axes of rotation."""
        return self.driver.offset, self.driven.offset


@dataclass(frozen=True)
class ContactCycle(ShortRepr):
    """Contact over positions (n,) of a mesh cycle at torques (t,) on the driver.

    position : base pitches from the pitch point of the reference pair
    teeth : (k,) base pitches by which each pair is ahead of the reference pair, of the
        one in the same base pitch where pairs count anew in each
    ste : (t, n) static transmission error, the driver's rotation times its
        base radius with the driven gear held [m]; negative on the back side
    no_load : (t, n) the same without load [m]
    local_stiffness : (t, n) slope of force over transmission error [N/m]
    load : (t, n, k) normal force of each pair [N]
    load_slope : (t, n, k) its slope over the transmission error, while all pairs are
        pressed together [N/m]
    relief_slope : (t, n, 2, 2, 2) derivatives of the transmission error with respect
        to magnitude [m] and start roll length [m] of tip and root relief of driver and
        driven gear, nodes of the patches in place; 0 for flanks without relief; (t, 0,
        2, 2, 2) where they were not asked for
    profile_slope : (t, n, 2, 2) the same with respect to crowning and slope [m] of the
        profiles of driver and driven gear, at fixed moment arms; 0 for flanks without
        profile; (t, 0, 2, 2) where they were not asked for
    gap : (t, n, k) transmission error that closes each pair [m]; infinite where its
        flanks do not face each other
    pressure : (t, n, k) largest contact pressure [Pa]
    friction_bending : (t, n, k) reduction of a pair's deflection by friction toward
        the tooth roots, per unit friction force, over its deflection per unit
        normal force; NaN where the pair carries no load
    arc : (t, n, k, 2) of the load's centre, or of the closest point, from the tip
        corners of driver and driven [m]
    turn : (t, n, k, 2) sine of the angle by which a corner's force is turned from the
        normal of its flank toward its root, on driver and driven; else 0
    closing : (t, n, k) penetration per transmission error, 1 on the nominal path of
        flanks without relief
    driven_torque : (t, n) reaction of the driven gear [N m]
    residual : (t, n) of the complementarity problem, relative
    face : loads over the face width, None where they are uniform
    """

    torque: Array
    position: Array
    teeth: Indices
    base_radius: float
    ste: Array
    no_load: Array
    local_stiffness: Array
    load: Array
    load_slope: Array
    relief_slope: Array
    profile_slope: Array
    gap: Array
    pressure: Array
    friction_bending: Array
    arc: Array
    turn: Array
    closing: Array
    driven_torque: Array
    residual: Array
    face: FaceLoads | None = None

    @property
    def mesh_force(self) -> Array:
        """Torque over the driver's base radius, (t, 1) [N]."""
        return self.torque[:, None] / self.base_radius

    @property
    def stiffness(self) -> Array:
        """Average slope of force over transmission error, (t, n) [N/m]."""
        return self.mesh_force / (self.ste - self.no_load)

    @property
    def pair_stiffness(self) -> Array:
        """Average slope of each pair, zero where it carries no load (t, n, k)."""
        deflection = self.ste[..., None] - self.gap
        loaded = self.load != 0.0
        return np.where(loaded, self.load, 0.0) / np.where(loaded, deflection, 1.0)

    @property
    def load_share(self) -> Array:
        """Part of the normal force that each pair carries, (t, n, k)."""
        return self.load / self.load.sum(axis=2, keepdims=True)


def corner_positions(
    problem: ContactProblem, cycle: ContactCycle, torque: int
) -> NDArray[np.bool_]:
    """Positions (n,) at which there is one of `corner_pairs`."""
    return np.asarray(corner_pairs(problem, cycle, torque).any(axis=1))


def corner_pairs(
    problem: ContactProblem, cycle: ContactCycle, torque: int
) -> NDArray[np.bool_]:
    """Whether the nominal contact of a loaded pair (n, k) is off the path, or within a
    Hertz width of its end, at one torque; that of all its loaded slices, where loads
    vary over the face width.
    """
    if cycle.face is not None:
        loaded, on_path = cycle.face.load[torque] != 0.0, cycle.face.on_path
        return np.asarray(loaded.any(axis=2) & ~(loaded & on_path).any(axis=2))
    pair = problem.pair
    # pairs count anew in each base pitch
    position = cycle.position - np.floor(cycle.position)
    s1 = pair.pitch_point + pair.base_pitch * (position[:, None] + cycle.teeth[None, :])
    margin = 0.01 * pair.base_pitch
    inside = (s1 > pair.path_start + margin) & (s1 < pair.path_end - margin)
    return (cycle.load[torque] != 0.0) & ~inside
