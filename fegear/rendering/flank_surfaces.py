"""Teeth of two gears in mesh as helicoids, and contact on their flanks, in space.

Coordinates (x, y, z) in metres: x and y are those of the plane of `PlacedMesh`, seen
from the near end, and z points to the eye. A place over the face width counts from the
middle of the common width to the far end, hence z is its negative. Of a right-handed
helix sections turn clockwise toward the far end.

A flank is the involute helicoid of the unmodified tooth: modifications and elastic
displacements are micrometres. Nothing here draws.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fegear.contact.result import ContactCycle
from fegear.elasticity.wide_root import arcs_along
from fegear.gearset.model import GearSet
from fegear.rendering.placed_mesh import ROLES, PlacedMesh, Role, placed_mesh
from lumped.common.array_types import Array, Indices
from meshes import MeshSize, SpurGear
from meshes.outline import half_sector_outline
from meshes.profile import flank_points, polar, roll_length_at_arc

OUTLINE = MeshSize(flank_edges=24, flank_grading=0.0, fillet_edges=10)
SECTIONS = 33  # of a tooth along its axis
RIM = 0.8  # that is drawn below the root circle, in modules
ACROSS = 9  # points over the width of a contact
MIRROR = np.array([-1.0, 1.0])


@dataclass(frozen=True, eq=False)
class GearInSpace:
    """One gear of a mesh, and where its ends are.

    ends : places of its near and far end, from the middle of the common width [m]
    """

    placed: PlacedMesh
    role: Role
    ends: tuple[float, float]

    @property
    def index(self) -> int:
        """0 of the driver, 1 of the driven gear."""
        return ROLES.index(self.role)

    @property
    def name(self) -> str:
        return self.placed.gear_names[self.index]

    @property
    def teeth(self) -> SpurGear:
        pair = self.placed.mesh.pair
        return pair.driver if self.role == "driver" else pair.driven

    @property
    def directions(self) -> tuple[Array, Array]:
        """Unit vectors (3,) at the pitch point: out of the gear, and to what it drives.

        The second is that of its rotation, of the driven gear the opposite one: its
        loaded flanks look there.
        """
        angle = self.placed.direction + (np.pi if self.role == "driven" else 0.0)
        outward = np.array([np.cos(angle), np.sin(angle), 0.0])
        ahead = np.array([-outward[1], outward[0], 0.0])
        # both gears' loaded flanks look away from themselves, in turns about the middle
        return outward, self.placed.sense * ahead

    def tooth_of(self, pair: int) -> int:
        """Tooth of a pair that is so many base pitches ahead, counted to the right."""
        return pair if self.role == "driver" else -pair

    def points(self, section: Array, place: Array, position: float, pair: int) -> Array:
        """Points (..., 3) of the tooth of a pair.

        section : (..., 2) in the frame of the tooth, its loaded flank at the right
        place : (...) over the face width; position : of the mesh [base pitches]
        """
        frame = self.placed.frame(self.role, position, self.tooth_of(pair))
        x, y = np.moveaxis(frame.vectors(section), -1, 0)
        angle = -self.teeth.twist * place
        c, s = np.cos(angle), np.sin(angle)
        turned = c * x - s * y, s * x + c * y, -place
        center = np.append(frame.center, 0.0)
        return np.asarray(center + np.stack(np.broadcast_arrays(*turned), axis=-1))

    def flank(self, arc: Array, place: Array, position: float, pair: int) -> Array:
        """Points (..., 3) of a loaded flank at arcs (...) from the tip corner [m]."""
        gear = self.teeth
        rolls = roll_length_at_arc(gear, np.clip(arc, 0.0, gear.flank_length))
        return self.points(flank_points(gear, rolls), place, position, pair)


def gears_in_space(gear_set: GearSet, mesh: int) -> tuple[GearInSpace, GearInSpace]:
    """Driver and driven gear of mesh number `mesh`, counted from 0."""
    placed, spec = placed_mesh(gear_set, mesh), gear_set.meshes[mesh]
    middles = gear_set.width_middles(mesh)
    driver, driven = (
        GearInSpace(placed, role, (-half - middle, half - middle))
        for role, half, middle in zip(
            ROLES,
            [0.5 * gear_set.gears[index].face_width for index in spec.gears],
            middles,
            strict=True,
        )
    )
    return driver, driven


@dataclass(frozen=True, eq=False)
class ToothSurface:
    """A tooth with a part of the rim below, as quadrilaterals.

    points : (n, 3); faces : (m, 4)
    arc : (n,) from the tip corner on the loaded flank [m], elsewhere NaN
    along : (n,) from the flank on in the fillet below it [m], elsewhere NaN
    edges : (k, 2) lines where the surface has corners
    """

    points: Array
    faces: Indices
    arc: Array
    along: Array
    edges: Indices


def tooth_surface(gear: GearInSpace, position: float, pair: int) -> ToothSurface:
    """Surface of the tooth of a pair, with both ends."""
    right, arc, along = _half_section(gear.teeth)
    section = np.vstack([MIRROR * right[:0:-1], right])
    n = len(right)  # the tooth's axis meets the outline at n - 1
    count = len(section)
    place = np.linspace(*gear.ends, SECTIONS)
    points = gear.points(section, place[:, None], position, pair)
    node = np.arange(SECTIONS * count).reshape(SECTIONS, count)
    cap = _end_faces(n)
    tip = int(np.flatnonzero(arc == 0.0)[0])
    lines = [node[:, n - 1 + side * tip] for side in (-1, 1)]
    lines += [node[end, 1:-1] for end in (0, -1)]
    return ToothSurface(
        points=points.reshape(-1, 3),
        # neighbours are beside the cuts through the rim
        faces=np.vstack([_quads(node[:, 1:-1]), cap, cap + node[-1, 0]]),
        arc=np.tile(np.concatenate([np.full(n - 1, np.nan), arc]), SECTIONS),
        along=np.tile(np.concatenate([np.full(n - 1, np.nan), along]), SECTIONS),
        edges=np.vstack([np.stack([line[:-1], line[1:]], axis=1) for line in lines]),
    )


def _end_faces(n: int) -> Indices:
    """Quadrilaterals (n - 1, 4) between both halves (n,) of an outline.

    At the tooth's axis there is a triangle, with one corner twice.
    """
    rung = np.arange(1, n)
    left, right = n - 1 - rung, n - 1 + rung
    ladder = np.stack([left[:-1], right[:-1], right[1:], left[1:]], axis=1)
    return np.vstack([[[left[0], n - 1, right[0], right[0]]], ladder])


def _half_section(gear: SpurGear) -> tuple[Array, Array, Array]:
    """Right half of a sector's outline (n, 2), from the tooth's axis to below the rim.

    And arcs (n,) from the tip corner where it is the flank, else NaN, and from the
    flank on where it is fillet or root land, else NaN.
    """
    edges = half_sector_outline(gear, OUTLINE)
    points = [edges[0].vertices[:1]]
    arcs, along, passed = [np.full(1, np.nan)], [np.full(1, np.nan)], 0.0
    for edge in edges:
        vertices = edge.vertices
        points.append(vertices[1:])
        arcs.append(np.full(len(vertices) - 1, np.nan))
        along.append(arcs[-1].copy())
        if edge.name == "tip":
            arcs[-1][-1] = 0.0
        elif edge.name == "flank":
            arcs[-1][:], along[-1][-1] = edge.parameters[1:], 0.0
        else:
            along[-1][:] = passed + arcs_along(vertices)[1:]
            passed = float(along[-1][-1])
    rim = gear.root_radius - RIM * gear.module
    points.append(polar(np.array([rim]), 0.5 * gear.pitch_angle))
    arcs.append(np.full(1, np.nan))
    along.append(np.full(1, np.nan))
    return np.vstack(points), np.concatenate(arcs), np.concatenate(along)


def _quads(node: Indices) -> Indices:
    """Quadrilaterals (m, 4) of a grid of nodes."""
    corners = node[:-1, :-1], node[:-1, 1:], node[1:, 1:], node[1:, :-1]
    return np.stack([corner.ravel() for corner in corners], axis=1)


@dataclass(frozen=True, eq=False)
class ContactBand:
    """Contact of slices (q,) of tooth pairs, as they lie on one gear's flanks.

    pair : base pitches by which the pair of each is ahead
    place : (q, 2) of both ends over the width [m]
    arc : (q, 2) of the line of contact there, from the tip corner [m]
    half_width : of the contact, across the line of contact, of Hertz [m]
    pressure : largest across it [Pa]
    on_path : whether flanks touch there, and not an edge
    """

    pair: Indices
    place: Array
    arc: Array
    half_width: Array
    pressure: Array
    on_path: NDArray[np.bool_]

    def chosen(self, index: Indices | NDArray[np.bool_]) -> ContactBand:
        """Take some of the slices."""
        return ContactBand(
            pair=self.pair[index],
            place=self.place[index],
            arc=self.arc[index],
            half_width=self.half_width[index],
            pressure=self.pressure[index],
            on_path=self.on_path[index],
        )


def contact_band(cycle: ContactCycle, position: int, gear: int) -> ContactBand:
    """Contact at a position of a cycle of one torque, by its index.

    gear : 0 of the driver, 1 of the driven gear

    The half width is that of the load with the pressure of Hertz, 2 w / (pi p).
    """
    face = cycle.face
    load, pressure, arc = face.load[0, position], face.pressure[0, position], face.arc
    pair, slices = np.nonzero((load > 0.0) & (pressure > 0.0))
    half = 0.5 * face.width / face.place.size
    ends = np.array([-half, half])
    slope = _slopes(arc[0, position, ..., gear], load > 0.0, 2.0 * half)
    middle = arc[0, position, pair, slices, gear]
    return ContactBand(
        pair=face.teeth[pair],
        place=face.place[slices, None] + ends,
        arc=middle[:, None] + slope[pair, slices, None] * ends,
        half_width=2.0 * load[pair, slices] / (np.pi * pressure[pair, slices]),
        pressure=pressure[pair, slices],
        on_path=face.on_path[position, pair, slices],
    )


def _slopes(arc: Array, loaded: NDArray[np.bool_], step: float) -> Array:
    """Slopes (k, m) of lines of contact over the width, 0 of a slice by itself.

    The mean of those toward neighbours that are in contact.
    """
    rise = np.diff(arc, axis=1) / step
    both = loaded[:, 1:] & loaded[:, :-1]
    total, count = np.zeros_like(arc), np.zeros(arc.shape)
    for part in (np.s_[:, 1:], np.s_[:, :-1]):
        total[part] += np.where(both, rise, 0.0)
        count[part] += both
    return np.asarray(total / np.maximum(count, 1.0))


@dataclass(frozen=True, eq=False)
class BandSurface:
    """Contact of slices (q,) on flanks, with points across it.

    points : (q, 2, c, 3), both ends of each slice
    arc : (q, 2, c) from the tip corner [m]; pressure : (q, c) [Pa]
    """

    points: Array
    arc: Array
    pressure: Array

    @property
    def faces(self) -> Indices:
        """Quadrilaterals (m, 4) of the points in a row."""
        node = np.arange(self.arc.size).reshape(self.arc.shape)
        return np.vstack([_quads(of_slice) for of_slice in node] or [_NO_FACES])


_NO_FACES = np.empty((0, 4), np.int64)


def band_surface(
    gear: GearInSpace, band: ContactBand, position: float, widening: float = 1.0
) -> BandSurface:
    """The band on the flanks of a gear, drawn so many times as wide as it is.

    What would be beyond the tip corner or the form circle is cut off.
    """
    across = np.linspace(-1.0, 1.0, ACROSS)
    width = widening * band.half_width[:, None, None] * across
    arc = np.clip(band.arc[..., None] + width, 0.0, gear.teeth.flank_length)
    place = np.broadcast_to(band.place[..., None], arc.shape)
    points = np.empty((*arc.shape, 3))
    for pair in np.unique(band.pair):
        of_pair = band.pair == pair
        points[of_pair] = gear.flank(arc[of_pair], place[of_pair], position, int(pair))
    pressure = band.pressure[:, None] * np.sqrt(1.0 - across**2)
    return BandSurface(points, arc, pressure)
