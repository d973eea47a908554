"""What the compiled steps know of a gear set in motion, as arrays.

Coordinates are h hub coordinates, modes of the rigid train, then e elastic modes of
the gears with their hubs held, all of unit mass. Tables go over the p positions of a
mesh cycle and its end; c contacts, tooth pairs of all meshes and sides, are ordered by
mesh; m meshes. Kernels take plain tuples of these: they compile faster.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from numpy.typing import NDArray

Array = NDArray[Any]


class Body(NamedTuple):
    """Inertia, elasticity and loads.

    The turn of a gear carries its elastic modes along: of the mass M =
    [[1, G], [G^T, 1]] only their coupling G to the turn is stored.

    stiffness (h, h), damping (h,), load (h,) of the hubs
    rigidity (e,) squared angular frequencies, elastic_damping (e,)
    turning (gears, h) counter-clockwise rotation of each gear per hub coordinate
    coupling (e,) to the rotation of its gear, owner (e,) that gear
    partner (e,), cosine (e,), sine (e,) : what becomes of a mode when teeth are
        counted anew: cosine times itself plus sine times its partner
    """

    stiffness: Array
    damping: Array
    load: Array
    rigidity: Array
    elastic_damping: Array
    turning: Array
    coupling: Array
    owner: Array
    partner: Array
    cosine: Array
    sine: Array


class Rows(NamedTuple):
    """How contacts act on the coordinates.

    widths (m,), columns (m, w) coordinates in which a mesh's contacts have entries
    closing (c, p + 1, w) squeeze per coordinate
    rootward (c, p + 1, w) the same for friction toward the roots
    mesh_of (c,); friction () coefficient
    linked (m, m) whether two meshes have a gear in common
    """

    widths: Array
    columns: Array
    closing: Array
    rootward: Array
    mesh_of: Array
    friction: Array
    linked: Array


class Turning(NamedTuple):
    """The nominal motion.

    rate (m,) cycles of each mesh per cycle of the first
    gears (m, 2) driver and driven, first_mesh (gears,) a mesh of each gear
    speed (gears,) nominal rotation over the first mesh's angular frequency
    deflection (m, h) of each mesh per hub coordinate
    """

    rate: Array
    gears: Array
    first_mesh: Array
    speed: Array
    deflection: Array


class Contacts(NamedTuple):
    """The laws of the contacts.

    first (m + 1,) where each mesh's contacts begin
    side (c,) 1 on the drive side, -1 on the back
    gap (c, p + 1) squeeze that is missing where the deflection is 0 [m]
    sliding (c, p + 1) direction of friction at nominal speeds
    arms (2, c, p + 1) of friction about driver and driven centre [m]
    knots (m, j + 1), law (c, p + 1, 2, j, 4) cubics of the load [N] in the squeeze
        beyond each knot; nominal friction and turned
    normal, tangential (p + 1, c, c) static compliance beside the coordinates' [m/N]
    errors (c, n) gap that comes to each contact in the cycles of its mesh, one after
        another, from pitch errors [m]; (c, 0) where there are none
    """

    first: Array
    side: Array
    gap: Array
    sliding: Array
    arms: Array
    knots: Array
    law: Array
    normal: Array
    tangential: Array
    errors: Array
