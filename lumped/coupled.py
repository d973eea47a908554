"""A train whose contacts deflect each other: the coupled model.

Every tooth pair has its own load over its penetration, stiffening as contact does.
Pairs deflect each other through the bodies of their gears, those of a mesh and those of
other meshes of the same gear. Coordinates are the mean rotations of the gears' masses:
in such axes the inertia of an elastic body does not move its mean, and its compliance
is that of a gear that is free to accelerate, `fegear.elasticity.inertia_relief`.

With the hubs at z, elastic compliance C of the contacts with hubs held, R their
penetration per coordinate, and U and W what the inertial loads of all bodies make of
penetrations and of themselves, per acceleration:

    q = z - P'F - W f,   f = load - K z,   q'' = f - R'F,   P = U - R W
    x + (C - U R' - R U' + R W R') F(x) = R q - P f - gap.

The torque f on the hubs of trains with shafts and couplings hangs on z. Solved for it,
f = b - K1 P'F and b = S load - K1 q, with S = (1 + K W)^-1 and K1 = S K. Where nothing
accelerates this is statics: x + C F(x) = R z - gap.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lumped.kernels.arrays import Contacts, CoupledSystem

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class CoupledContacts:
    """The contacts of a train: c contacts, p positions of a mesh cycle, n modes.

    contacts : with the gears' hubs held, see `lumped.kernels.arrays.Contacts`
    mesh_of : (c,) mesh of each
    rows : (c, p + 1, n) R, penetration per modal coordinate [1/sqrt(kg)]
    inertial : (c, p + 1, n) U, penetration under the inertial loads of all bodies per
        acceleration of each coordinate, reversed [s2/sqrt(kg)]
    work : (n, n) W, work of these loads on themselves [s2]
    """

    contacts: Contacts
    mesh_of: NDArray[np.int64]
    rows: Array
    inertial: Array
    work: Array


def in_mean_axes(
    found: CoupledContacts,
    springs: Array,
    damping: Array,
    load: Array,
    shapes: Array,
    rate: Array,
) -> CoupledSystem:
    """The system as the kernels take it, see there.

    springs : (n, n) K, stiffness besides the meshes [1/s2]
    """
    R, U, W, K = found.rows, found.inertial, found.work, springs
    S = np.linalg.inv(np.eye(len(W)) + K @ W)
    P = U - R @ W
    both = np.einsum("cpi,dpi->pcd", U, R)
    compliance = found.contacts.normal_compliance - both - both.transpose(0, 2, 1)
    compliance += np.einsum("cpi,ij,dpj->pcd", R, W, R)
    compliance -= np.einsum("cpi,ij,dpj->pcd", P, S @ K, P)
    return CoupledSystem(
        stiffness=S @ K,
        damping=damping,
        load=S @ load,
        shapes=shapes,
        rate=rate,
        mesh_of=found.mesh_of,
        rows=R,
        inertial=P,
        work=W,
        contacts=found.contacts._replace(normal_compliance=compliance),
    )
