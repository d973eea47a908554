"""Find where slices of tooth pairs touch, with the geometry of the plane kernel."""

from __future__ import annotations

from fegear.contact.plane.kernels.patches import place_patch
from lumped.common.compiled import not_allocating


@not_allocating
def place_slices(mesh, flanks, patches, rolls):
    """Find the closest point of each slice.

    mesh, flanks : of the kernel, flanks of driver and driven
    patches : (slices,) records `compliance.PATCH` with their extra gaps
    rolls : (slices,) the driver's nominal roll lengths [m]
    """
    for i in range(patches.size):
        place_patch(mesh, flanks, patches[i], rolls[i])
