"""Layers of elements from an arc of the half sector down to the hub.

Under a load on the teeth, displacements vary over lengths that grow with the depth, so
layers grow with the depth too: their number increases with the logarithm of the number
of teeth. Elements become long and narrow, with right angles at their nodes.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from meshes.gear import SpurGear
from meshes.outline import MeshSize
from meshes.profile import Points, polar


def layer_radii(gear: SpurGear, size: MeshSize, top: float) -> NDArray[np.float64]:
    """Radii from `top` down to the hub, one more than there are layers."""
    radii = [top]
    while radii[-1] > gear.hub_radius:
        r = radii[-1]
        growth = size.body_growth * (gear.root_radius - r)
        step = max(size.hub_size * gear.module, growth)
        # the twist of a body decreases as 1 / r
        step = min(step, size.body_growth * abs(r), size.largest_layer * gear.module)
        radii.append(r - step)
    if len(radii) == 1:
        return np.array(radii)
    stops = np.array(radii)
    # stretched uniformly in the logarithm, so that the last layer is not too thin
    scale = math.log(gear.hub_radius / top) / math.log(stops[-1] / top)
    return top * (stops / top) ** scale


def body_layers(
    columns: int, half_angle: float, radii: NDArray[np.float64]
) -> tuple[Points, NDArray[np.int64], dict[str, NDArray[np.int64]]]:
    """Points, triangles and edges of layers over `columns` equal parts of an angle.

    Points lie on a polar grid (2 layers + 1, 2 columns + 1), with angles from the cut
    to the axis. Triangles are clockwise, like those of gmsh along the outline.
    """
    layers = len(radii) - 1
    between = 0.5 * (radii[1:] + radii[:-1])
    r = np.append(np.stack([radii[:-1], between], axis=1).ravel(), radii[-1])
    angles = np.linspace(half_angle, 0.0, 2 * columns + 1)
    points = polar(r[:, None], angles[None, :]).reshape(-1, 2)
    at = np.arange(len(points)).reshape(len(r), len(angles))
    i, j = (2 * indices.ravel() for indices in np.mgrid[:layers, :columns])

    def node(down: int, across: int) -> NDArray[np.int64]:
        return at[i + down, j + across]

    # corners: cut side above, axis side above, and the same below
    one = [node(0, 0), node(2, 2), node(0, 2), node(1, 1), node(1, 2), node(0, 1)]
    two = [node(0, 0), node(2, 0), node(2, 2), node(1, 0), node(2, 1), node(1, 1)]
    triangles = np.concatenate([np.stack(one, axis=1), np.stack(two, axis=1)])
    edges = {
        "cut": _chain(at[:, 0]),
        "hub": _chain(at[-1]),
        "axis": _chain(at[::-1, -1]),
    }
    return points, triangles, edges


def _chain(nodes: NDArray[np.int64]) -> NDArray[np.int64]:
    """Edges (k, 3) along nodes: ends, then mid-side."""
    return np.stack([nodes[:-2:2], nodes[2::2], nodes[1::2]], axis=1)
