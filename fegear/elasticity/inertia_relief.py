"""What the inertia of a gear's own body does to its flanks while it accelerates.

The hub turns by theta, the body moves by u against it, r is the unit turn of the whole
gear and J its inertia, hub included:

    J theta'' + r'M u'' = T - sum a F,    M u'' + M r theta'' + K u = sum c F

with contact forces F along the inward normals c at arms a. Of the mean rotation
phi = theta + r'M u / J the first line is J phi'' = T - sum a F: no elastic mode has
part in it. What is left of u'' in such a frame belongs to modes of the free gear, and
below their frequencies K u = c F - M r phi'' is left, the inertia relief.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fegear.elasticity.modes import cyclic_inverse
from fegear.elasticity.sector import RIGHT, CyclicSector
from fegear.timing import stage

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class InertiaRelief:
    """Static displacement u = K^-1 M r with the hub held, as little as flanks need.

    M r loads the body when the whole gear is accelerated by 1 rad/s2 counter-clockwise.

    arcs : (n,) of the right flank's points from the tip corner [m]
    inward : (n,) its normal displacement at them, p [m s2/rad]; of the left flank the
        negative of it
    work : r'M u of the whole gear per unit width, q [kg m]
    """

    arcs: Array
    inward: Array
    work: float


def inertia_relief(sector: CyclicSector, density: float) -> InertiaRelief:
    """Solve for the zeroth harmonic: all sectors move alike; density in kg/m3."""
    constraint = sector.cyclic_constraint(1.0)
    momentum = sector.mass(density) @ sector.rigid_fields[:, 0]
    with stage("inertia relief"):
        stiffness = constraint.T @ sector.stiffness @ constraint
        inverse = cyclic_inverse(sector.condensation, stiffness, 1.0)
        field = constraint @ inverse.matvec(constraint.T @ momentum)
    flank = sector.flanks[RIGHT]
    inward = np.einsum("ic,ic->i", field[flank.freedoms], flank.inward)
    work = sector.gear.teeth * float(momentum @ field)
    return InertiaRelief(flank.arcs, inward, work)
