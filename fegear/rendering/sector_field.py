"""Displacement and stress in the sectors of one gear under contact loads.

What all positions and loads have in common is computed once: mesh, stiffness,
condensation and the excitation by unit loads. A state is five numbers at a point:
displacement (x, y) [m] and stress (xx, yy, xy) [Pa], in the frame of the sector's
tooth. It is a smooth remainder, quadratic in every element, and on a loaded tooth
the exact half-plane field of its own load, which resolves the contact.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import csr_array
from scipy.spatial import cKDTree
from skfem import ElementTriP2

from fegear.elasticity.body_stress import (
    ROOTWARD,
    ToothLoad,
    hat_stresses,
    nodal_stress,
    point_loads,
)
from fegear.elasticity.flank import SectorLoads, flamant_loads, ring_fields
from fegear.elasticity.halfplane import hat_displacement
from fegear.elasticity.sector import CyclicSector
from lumped.common.array_types import Array, Indices
from lumped.common.short_repr import ShortRepr
from meshes.profile import flank_frame

N_CANDIDATES = 16  # elements among which the one around a point is looked for
CHILD_CORNERS = ((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5))  # nodes of the parent
MIRROR = np.array([-1.0, 1.0])  # of points and vectors, at a tooth's axis
MIRROR_STATE = np.array([-1.0, 1.0, 1.0, 1.0, -1.0])
# Distance from a contact at which plane strain gives way to the plane of the teeth,
# over the module: several widths of a contact, and short of the root
PLANE_STRAIN_REACH = 0.5
MAX_LOCATED = 500  # points located at once, which bounds memory
TRIANGLE = ElementTriP2()  # six nodes, as those of the mesh


def shape_functions(places: Array) -> tuple[Array, Array]:
    """Values (..., 6) and slopes (..., 6, 2) at reference coordinates (..., 2)."""
    x = np.moveaxis(places, -1, 0)
    values, slopes = zip(*(TRIANGLE.lbasis(x, i) for i in range(6)), strict=True)
    return np.stack(values, -1), np.moveaxis(np.stack(slopes), (0, 1), (-2, -1))


def _shapes_of_quarters() -> Array:
    """(4, 6, 6) from the values at a triangle's nodes to those of its quarters."""
    nodes = TRIANGLE.doflocs
    corners = nodes[np.array(CHILD_CORNERS)]  # (4, 3, 2)
    linear = np.column_stack([1.0 - nodes.sum(axis=1), nodes])  # (6, 3)
    return shape_functions(linear @ corners)[0]


@dataclass(frozen=True, eq=False)
class LoadableGear(ShortRepr):
    """One gear, hub held, ready for any loads on its right flanks.

    stress : from displacement to stress at the nodes, as in `nodal_stress`
    unit_loads : on the flank points, normal and, unless there is no friction, rootward
    """

    sector: CyclicSector
    stress: csr_array
    unit_loads: tuple[SectorLoads, ...]

    def sectors(
        self,
        loads: Sequence[ToothLoad],
        teeth: Iterable[int],
        back_loads: Sequence[ToothLoad] = (),
    ) -> list[SectorField]:
        """Fields of the sectors `teeth`, counted to the right as the loads' teeth.

        back_loads : on left flanks. They are seen in the mirror of the axis of tooth 0,
            where these flanks are the right ones and teeth count the other way.
        """
        teeth_list = list(teeth)
        smooth_states = self._smooth_states(loads, teeth_list)
        if back_loads:
            mirrored_states = self._smooth_states(
                back_loads, [-tooth for tooth in teeth_list]
            )
            smooth_states = [
                smooth_state + self._mirror_state(mirrored_state)
                for smooth_state, mirrored_state in zip(
                    smooth_states, mirrored_states, strict=True
                )
            ]
        return [
            SectorField(
                self,
                tooth,
                state,
                self._loads_on_tooth(loads, tooth),
                self._loads_on_tooth(back_loads, -tooth),
            )
            for tooth, state in zip(teeth_list, smooth_states, strict=True)
        ]

    def _smooth_states(
        self, loads: Sequence[ToothLoad], teeth: Sequence[int]
    ) -> list[Array]:
        """Remainder (nodes, 5) in each of the sectors, the sum over the loads."""
        total_fields = np.zeros((len(teeth), self.sector.basis.N))
        for load in loads:
            teeth_apart = [self._teeth_apart(tooth, load.tooth) for tooth in teeth]
            fields = ring_fields(self.sector, self._smooth_loads(load), teeth_apart)
            for row, offset in zip(total_fields, teeth_apart, strict=True):
                row += fields[offset][:, 0]
        return [self._nodal_state(field) for field in total_fields]

    def _mirror_state(self, state: Array) -> Array:
        """A state at the nodes (nodes, 5), reflected at the tooth's axis."""
        nodes, weights = self._mirrored_nodes
        return MIRROR_STATE * np.einsum("pi,pic->pc", weights, state[nodes])

    @cached_property
    def _mirrored_nodes(self) -> tuple[Indices, Array]:
        """Six nodes (nodes, 6) around each node's mirror image, and shape values
        there. A mesh that is read from a file need not be symmetric.
        """
        mesh = self.sector.mesh
        images = np.array_split(
            MIRROR * mesh.points, 1 + len(mesh.points) // MAX_LOCATED
        )
        elements_and_weights = [
            _locate_elements(mesh.points[mesh.triangles], image_points)
            for image_points in images
        ]
        element, weights = (
            np.concatenate(image_points)
            for image_points in zip(*elements_and_weights, strict=True)
        )
        return mesh.triangles[element], weights

    def _teeth_apart(self, tooth: int, other: int) -> int:
        teeth = self.sector.gear.teeth
        return (tooth - other + teeth // 2) % teeth - teeth // 2

    def _loads_on_tooth(
        self, loads: Sequence[ToothLoad], tooth: int
    ) -> tuple[ToothLoad, ...]:
        return tuple(
            load for load in loads if self._teeth_apart(tooth, load.tooth) == 0
        )

    def _smooth_loads(self, load: ToothLoad) -> SectorLoads:
        """What drives the remainder under one tooth's load, in a single column."""
        weighted_loads = []
        for angle, unit_loads in zip((0.0, ROOTWARD), self.unit_loads, strict=False):
            weights = point_loads(self.sector, load, angle)[:, None]
            weighted_loads.append(
                (
                    unit_loads.force @ weights,
                    unit_loads.hub @ weights,
                    unit_loads.jump @ weights,
                )
            )
        return SectorLoads(
            *(sum(column) for column in zip(*weighted_loads, strict=True))
        )

    def _nodal_state(self, field: Array) -> Array:
        stress = (self.stress @ field).reshape(3, -1).T
        return np.hstack([field[self.sector.node_dofs], stress])


def loadable_gear(sector: CyclicSector, friction: bool = True) -> LoadableGear:
    angles = (0.0, ROOTWARD) if friction else (0.0,)
    unit_loads = tuple(flamant_loads(sector, angle) for angle in angles)
    return LoadableGear(sector, nodal_stress(sector), unit_loads)


@dataclass(frozen=True, eq=False)
class SectorField:
    """State of one sector.

    tooth : place to the right of the reference tooth
    smooth : (nodes, 5) remainder at the nodes of the sector mesh
    loads : on the right flank of the sector's own tooth
    back_loads : on its left flank, as they are seen in the mirror of the tooth's axis
    """

    body: LoadableGear
    tooth: int
    smooth: Array
    loads: tuple[ToothLoad, ...] = ()
    back_loads: tuple[ToothLoad, ...] = ()

    def at(self, points: Array) -> Array:
        """State (n, 5) at points (n, 2) of the sector, exact near the contact."""
        mesh = self.body.sector.mesh
        element, weights = _locate_elements(mesh.points[mesh.triangles], points)
        smooth = np.einsum("pi,pic->pc", weights, self.smooth[mesh.triangles[element]])
        return smooth + self.local(points)

    def local(self, points: Array) -> Array:
        """The half-plane state (n, 5) of the tooth's own loads; zeros without any."""
        state = self._half_plane_state(points, self.loads)
        if self.back_loads:
            back_state = self._half_plane_state(MIRROR * points, self.back_loads)
            state += MIRROR_STATE * back_state
        return state

    def _half_plane_state(self, points: Array, loads: Sequence[ToothLoad]) -> Array:
        """State (n, 5) of loads on the right flank."""
        state, gear = np.zeros((len(points), 5)), self.body.sector.gear
        moduli = self.body.sector.material.modulus, self.body.sector.material.poisson
        for load in loads:
            state[:, 2:] += hat_stresses(load, gear, points)
            frame = flank_frame(gear, load.arcs)
            for x, n, *forces in zip(*frame, load.normal, load.rootward, strict=True):
                if any(forces):
                    force = (forces[0], forces[1])
                    state[:, :2] += hat_displacement(
                        points, x, n, load.step, force, moduli
                    )
        return state

    def refined(self, finest: float = 0.0) -> tuple[Array, Indices, Array]:
        """Points (n, 2), triangles (m, 6) and state (n, 5), fine at the contact.

        finest : size below which no triangle is cut [m]

        Nodes of the sector mesh come first. Elements are cut into quarters that
        follow the same map until they are small compared with the distance to the load.
        """
        mesh = self.body.sector.mesh
        places, state = mesh.points, self.smooth
        triangles = mesh.triangles
        if self.loads or self.back_loads:
            places_and_state = np.hstack([places, state])
            places_and_state, triangles = _refine_triangles(
                places_and_state, triangles, *self._refinement_focus(finest)
            )
            places, state = places_and_state[:, :2], places_and_state[:, 2:]
        return places, triangles, state + self.local(places)

    def nearness(self, points: Array) -> Array:
        """From 1 at points (n, 2) beside a contact to 0 far from all (n,)."""
        if not (self.loads or self.back_loads):
            return np.zeros(len(points))
        distance = cKDTree(self._refinement_focus(0.0)[0]).query(points)[0]
        reach = PLANE_STRAIN_REACH * self.body.sector.gear.module
        return np.asarray(np.exp(-((distance / reach) ** 4)))

    def _refinement_focus(self, finest: float) -> tuple[Array, float]:
        """Points that carry load, and the size of the smallest triangles [m]."""
        loaded_points = [
            side * flank_frame(self.body.sector.gear, load.arcs[load.normal != 0.0])[0]
            for side, loads in ((np.ones(2), self.loads), (MIRROR, self.back_loads))
            for load in loads
        ]
        steps = [load.step for load in (*self.loads, *self.back_loads)]
        return np.vstack(loaded_points), max(2.0 * min(steps), finest)


def _refine_triangles(
    values: Array, triangles: Indices, focus: Array, finest: float
) -> tuple[Array, Indices]:
    """Nodal values (n, c), whose first two are the place, on a locally finer mesh."""
    focus_tree, quarter_shapes = cKDTree(focus), _shapes_of_quarters()
    for _ in range(10):
        corners = values[triangles[:, :3], :2]
        size = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
        distance = focus_tree.query(corners.mean(axis=1))[0]
        is_coarse = size > np.maximum(finest, 0.4 * distance)
        if not is_coarse.any():
            break
        new_values = np.einsum(
            "kij,tjc->tkic", quarter_shapes, values[triangles[is_coarse]]
        )
        new_triangles = len(values) + np.arange(new_values[..., 0].size).reshape(-1, 6)
        values = np.vstack([values, new_values.reshape(-1, values.shape[1])])
        triangles = np.vstack([triangles[~is_coarse], new_triangles])
    return values, triangles


def _locate_elements(elements: Array, points: Array) -> tuple[Indices, Array]:
    """Element (p,) around each point and its shape values there (p, 6).

    elements : (m, 6, 2) node places. Newton's method for the curved map; a point
    just outside belongs to the nearest element, whose map is extended.
    """
    center = elements.mean(axis=1)
    size = np.linalg.norm(elements - center[:, None], axis=2).max(axis=1)
    # a large element among many small ones is not among those with near centres
    distance = np.linalg.norm(points[:, None] - center, axis=2) / size
    candidates = np.argsort(distance, axis=1)[:, :N_CANDIDATES]
    nodes = elements[candidates]  # (p, k, 6, 2)
    reference_point = np.full((*candidates.shape, 2), 1.0 / 3.0)
    for _ in range(8):
        values, slopes = shape_functions(reference_point)
        residual = points[:, None] - np.einsum("pki,pkic->pkc", values, nodes)
        jacobian = np.einsum("pkic,pkid->pkcd", nodes, slopes)
        step = np.linalg.solve(jacobian, residual[..., None])[..., 0]
        reference_point = np.clip(reference_point + np.clip(step, -1.0, 1.0), -3.0, 3.0)
    depth_inside = np.minimum(
        reference_point.min(axis=-1), 1.0 - reference_point.sum(axis=-1)
    )
    best_candidate, rows = depth_inside.argmax(axis=1), np.arange(len(points))
    return candidates[rows, best_candidate], shape_functions(
        reference_point[rows, best_candidate]
    )[0]
