"""Flank deflection by inertia of the accelerating body.

The hub turns by theta, the body moves by u against it, r is the unit turn of the whole
gear and J its inertia, hub included:

    J theta'' + r'M u'' = T - sum a F,    M u'' + M r theta'' + K u = sum c F

with contact forces F along the inward normals c at arms a. Of the mean rotation
phi = theta + r'M u / J the first line is J phi'' = T - sum a F: no elastic mode has
part in it. What is left of u'' in such a frame belongs to modes of the free gear, and
below their frequencies K u = c F - M r phi'' is left, the inertia relief.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fegear.elasticity.flank import FlankCompliance
from fegear.elasticity.gear_modes import cyclic_inverse
from fegear.elasticity.sector import RIGHT, CyclicSector
from fegear.files.timing import stage
from lumped.common.array_types import Array


@dataclass(frozen=True, eq=False)
class InertiaRelief:
    """Static displacement u = K^-1 M r with the hub held, as little as flanks need.

    M r loads the body when the whole gear is accelerated by 1 rad/s2 counter-clockwise.

    arcs : (n,) of the right flank's points from the tip corner [m]
    inward, rootward : (n,) displacement at them, p [m s2/rad]; of the left flank the
        inward one is the negative of it
    inward_arm, rootward_arm : (n,) of a unit clockwise turn at them [m]
    work : r'M u of the whole gear per unit width, q [kg m s2]
    """

    arcs: Array
    inward: Array
    rootward: Array
    inward_arm: Array
    rootward_arm: Array
    work: float


def inertia_relief(sector: CyclicSector, density: float) -> InertiaRelief:
    """Solve for the zeroth harmonic: all sectors move alike; density in kg/m3."""
    constraint, rotation = sector.cyclic_constraint(1.0), sector.rigid_body_modes[:, 0]
    mass = sector.mass(density)
    momentum = mass @ rotation
    with stage("inertia relief"):
        stiffness = constraint.T @ sector.stiffness @ constraint
        inverse = cyclic_inverse(sector.condensation, stiffness, 1.0)
        field = constraint @ inverse.matvec(constraint.T @ momentum)
    flank = sector.flanks[RIGHT]

    def component_along(directions: Array, values: Array) -> Array:
        return np.einsum("ic,ic->i", values[flank.dofs], directions)

    return InertiaRelief(
        arcs=flank.arcs,
        inward=component_along(flank.inward, field),
        rootward=component_along(flank.rootward, field),
        inward_arm=component_along(flank.inward, rotation),
        rootward_arm=component_along(flank.rootward, rotation),
        work=sector.gear.teeth * float(momentum @ field),
    )


def in_mean_axes(
    held: FlankCompliance, relief: InertiaRelief, widths: tuple[float, float], J: float
) -> FlankCompliance:
    """Flank compliance of a gear that is free to accelerate, C - (p a + a p) / J + ...

    widths : of the contact and of the body [m]; J : inertia of the gear [kg m2]
    """
    contact, body = widths
    p, a = relief.inward, relief.inward_arm
    work_of_body = relief.work * body / J

    def displacement_in_mean_axes(displacement: Array, arm: Array) -> Array:
        twist = displacement[:, None] * a + arm[:, None] * p
        return contact / J * (twist - work_of_body * np.outer(arm, a))

    return replace(
        held,
        normal=held.normal - displacement_in_mean_axes(p, a),
        tangential=held.tangential
        - displacement_in_mean_axes(relief.rootward, relief.rootward_arm),
        origin=None,
    )
