"""Gears of a picture under the loads of their meshes."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fegear.contact.edges import has_edge
from fegear.contact.loads import PatchLoad, in_plane_strain, tooth_loads
from fegear.elasticity.body_stress import ToothLoad
from fegear.files.errors import InputError
from fegear.rendering.frames import Frame, View
from fegear.rendering.gear_fields import GearField, PairField
from fegear.rendering.mesh_scene import MeshScene, RelativePose
from fegear.rendering.placed_mesh import ROLES, Role
from fegear.rendering.sector_field import MIRROR, LoadableGear, SectorField
from lumped.common.array_types import Array
from meshes.profile import flank_frame

PLACE_TOL = 1e-5  # of a pitch or of the module, between places by two meshes of a gear
OUTLINE = ("tip", "flank", "fillet", "root", "hub")


@dataclass(frozen=True, eq=False)
class LoadedMesh:
    """A mesh at a moment, and the loads of its tooth pairs."""

    scene: MeshScene
    pose: RelativePose
    loads: Sequence[PatchLoad]

    def frame(self, role: Role, tooth: int = 0) -> Frame:
        """Frame of a sector, see `MeshScene.frame`."""
        return self.scene.frame(role, self.pose.position, tooth, self.pose.back)

    @cached_property
    def narrow_loads(self) -> list[PatchLoad]:
        """The loads on contacts as narrow as in plane strain."""
        return [in_plane_strain(self.scene.problem, load) for load in self.loads]


@dataclass(frozen=True, eq=False)
class MeshSide:
    """One gear of a mesh."""

    mesh: LoadedMesh
    role: Role

    @property
    def index(self) -> int:
        """0 of the driver, 1 of the driven gear."""
        return ROLES.index(self.role)

    @property
    def name(self) -> str:
        return self.mesh.scene.gear_names[self.index]

    @property
    def body(self) -> LoadableGear:
        return self.mesh.scene.bodies[self.index]

    @property
    def center(self) -> Array:
        return self.mesh.scene.centers[self.index]

    @property
    def tooth_loads(self) -> list[ToothLoad]:
        return tooth_loads(self.mesh.narrow_loads, self.role)

    def frame(self, tooth: int = 0) -> Frame:
        return self.mesh.frame(self.role, tooth)


@dataclass(frozen=True)
class ToothCount:
    """How a mesh counts the teeth of a gear, against the gear's first mesh.

    teeth : of the gear
    shift : number of its tooth that is tooth 0 of the first mesh
    mirrored : whether it loads the other flanks, so that its teeth count the other way
    """

    teeth: int
    shift: int
    mirrored: bool

    def in_first(self, tooth: int) -> int:
        """A tooth's number as the gear's first mesh counts it, nearest to 0."""
        number = self.shift - tooth if self.mirrored else tooth - self.shift
        half = self.teeth // 2
        return (number + half) % self.teeth - half


@dataclass(frozen=True, eq=False)
class LoadedGear:
    """A gear and all meshes it is in; its teeth count as in the first of them."""

    sides: tuple[MeshSide, ...]

    @property
    def first(self) -> MeshSide:
        return self.sides[0]

    @cached_property
    def counts(self) -> tuple[ToothCount, ...]:
        """How each of its meshes counts its teeth."""
        return tuple(_tooth_count(self.first, side) for side in self.sides)

    def sectors(self, view: View | None = None) -> list[SectorField]:
        """The loaded sectors and those in view, in the frames of their teeth.

        What is out of view costs nothing.
        """
        body = self.first.body
        teeth: set[int] = set()
        loads: dict[bool, list[ToothLoad]] = {False: [], True: []}
        for side, count in zip(self.sides, self.counts, strict=True):
            for load in side.tooth_loads:
                teeth.add(count.in_first(load.tooth))
                shifted_load = replace(load, tooth=load.tooth - count.shift)
                loads[count.mirrored].append(shifted_load)
        if view is not None:
            half_teeth, mesh = body.sector.gear.teeth // 2, body.sector.mesh
            corners = mesh.points[np.unique(mesh.triangles[:, :3])]
            teeth |= {
                tooth
                for tooth in range(-half_teeth, body.sector.gear.teeth - half_teeth)
                if view.contains(self.first.frame(tooth).places(corners))
            }
        return body.sectors(loads[False], sorted(teeth), loads[True])


def _tooth_count(first_side: MeshSide, other_side: MeshSide) -> ToothCount:
    """Compare the places of the teeth; InputError where these do not coincide."""
    gear, scene = first_side.body.sector.gear, other_side.mesh.scene
    rotation = first_side.frame().turn.T @ other_side.frame().turn
    is_mirrored = bool(np.linalg.det(rotation) < 0.0)
    if is_mirrored:
        rotation = rotation @ np.diag(MIRROR)
    pitches = math.atan2(rotation[1, 0], rotation[0, 0]) / gear.pitch_angle
    pitches = -pitches if is_mirrored else pitches
    center_distance = (
        float(np.hypot(*(other_side.center - first_side.center))) / scene.module
    )
    if max(abs(pitches - round(pitches)), center_distance) > PLACE_TOL:
        raise InputError(
            f"{scene.name}, mesh of {' and '.join(scene.gear_names)}: its phase and "
            f"centre line place {other_side.name} otherwise than the gear's other mesh "
            "does; allowed in pictures of a set are phases that follow from the centre "
            "lines"
        )
    return ToothCount(gear.teeth, round(pitches), is_mirrored)


def loaded_gears(
    scene: MeshScene, stand: RelativePose, loads: Sequence[PatchLoad], view: View
) -> tuple[tuple[GearField, ...], tuple[PairField, ...]]:
    """Both gears of a mesh under any loads, and the pairs that carry them."""
    turn = scene.sense * stand.ste / scene.problem.pair.driver_arm
    turns = {scene.mesh.driver: turn, scene.mesh.driven: 0.0}
    return gears_in_meshes([LoadedMesh(scene, stand, loads)], turns, view)


def gears_in_meshes(
    meshes: Sequence[LoadedMesh],
    turns: Mapping[int, float],
    view: View,
    finest: float = 0.0,
) -> tuple[tuple[GearField, ...], tuple[PairField, ...]]:
    """All gears of some meshes under the loads of each, and the pairs in contact.

    turns : rotation of the hub of each gear, counterclockwise [rad]
    finest : size of triangles that are not refined any further [m]
    """
    sides: dict[int, list[MeshSide]] = {}
    for mesh in meshes:
        for gear, role in zip(mesh.scene.mesh.gears, ROLES, strict=True):
            sides.setdefault(gear, []).append(MeshSide(mesh, role))
    gears = {index: LoadedGear(tuple(parts)) for index, parts in sides.items()}
    sectors = {index: gear.sectors(view) for index, gear in gears.items()}
    fields = tuple(
        _gear_field(gear.first, sectors[index], turns[index], finest)
        for index, gear in gears.items()
    )
    pairs: list[PairField] = []
    for number, mesh in enumerate(meshes):
        driver = mesh.scene.mesh.driver
        by_tooth = {sector.tooth: sector for sector in sectors[driver]}
        loaded = gears[driver]
        count = loaded.counts[[side.mesh for side in loaded.sides].index(mesh)]
        for load, narrow in zip(mesh.loads, mesh.narrow_loads, strict=True):
            sector = by_tooth[count.in_first(load.tooth)]
            contact = DriverContact(mesh, loaded.first, sector, count.mirrored)
            is_sharp = has_edge(mesh.scene.problem, load)
            pairs.append(contact.pair_field(narrow, turns[driver], number, is_sharp))
    return fields, tuple(pairs)


def _gear_field(
    side: MeshSide, sectors: Sequence[SectorField], turn: float, finest: float
) -> GearField:
    """Sectors in the world; turn is the hub's rotation, counterclockwise [rad]."""
    body, center, back = side.body, side.center, side.mesh.pose.back
    edges = body.sector.mesh.edges
    names = [part + name for name in OUTLINE for part in ("", "left_")]
    outline = np.vstack([edges[n] for n in names if n in edges])[:, [0, 2, 1]]
    corners = np.unique([edges["fillet"], edges["left_fillet"]])
    parts, count = [], 0
    for sector in sectors:
        part = _sector_in_world(sector, side.frame(sector.tooth), finest)
        number = _pair_tooth(side.role, sector.tooth, back)
        part["tooth"] = np.full(len(part["triangles"]), number)
        part["triangles"] = part["triangles"] + count
        part |= {"outline": outline + count, "fillet": corners + count}
        parts.append(part)
        count += len(part["points"])
    joined: dict[str, Any] = {
        name: np.concatenate([part[name] for part in parts]) for name in parts[0]
    }
    x, y = (joined["points"] - center).T
    return GearField(
        name=side.name,
        center=center,
        hub_motion=turn * np.stack([-y, x], axis=1),
        out_of_plane=_out_of_plane(body, joined["stress"], joined.pop("beside")),
        is_internal=body.sector.gear.sign < 0,
        **joined,
    )


def _sector_in_world(
    sector: SectorField, frame: Frame, finest: float
) -> dict[str, NDArray[Any]]:
    """Points, triangles, displacement and stress of a refined sector."""
    places, nodes, state = sector.refined(finest)
    if np.linalg.det(frame.turn) < 0.0:  # a mirror image turns triangles over
        nodes = nodes[:, [0, 2, 1, 5, 4, 3]]
    return {
        "points": frame.places(places),
        "triangles": nodes,
        "displacement": frame.vectors(state[:, :2]),
        "stress": frame.stresses(state[:, 2:]),
        "beside": sector.nearness(places),
    }


def _out_of_plane(body: LoadableGear, stress: Array, beside: Array) -> Array:
    """Stress zz (n,), beside a contact that of plane strain [Pa].

    beside : (n,) from 1 at a contact to 0 far from it
    """
    material = body.sector.material
    far = material.out_of_plane(stress)
    near = replace(material, plane="strain").out_of_plane(stress)
    return far + beside * (near - far)


def _pair_tooth(role: Role, right: int, back: bool) -> int:
    """A tooth's number in the order of contact: ahead is to the left when driven."""
    if back:
        right = (role == "driver") - right
    return right if role == "driver" else -right


@dataclass(frozen=True, eq=False)
class DriverContact:
    """Where a pair of a mesh touches, on the driver.

    first : first mesh of that gear, which counts its teeth
    sector : that carries the load; mirrored : see `ToothCount`
    """

    mesh: LoadedMesh
    first: MeshSide
    sector: SectorField
    mirrored: bool

    def pair_field(
        self, load: PatchLoad, turn: float, number: int, is_sharp: bool
    ) -> PairField:
        """The pair in the world.

        turn : the driver's hub's rotation [rad]; number : of the mesh
        is_sharp : whether an edge is in contact
        """
        scene, pose = self.mesh.scene, self.mesh.pose
        flank, inward = flank_frame(scene.problem.pair.driver, load.driver_arcs)
        frame = self.mesh.frame("driver", load.tooth)
        points = frame.places(flank)
        x, y = (points - frame.center).T
        in_sector = MIRROR * flank if self.mirrored else flank
        elastic = self.first.frame(self.sector.tooth).vectors(
            self.sector.at(in_sector)[:, :2]
        )
        pressure = load.normal / load.step
        pressure[[0, -1]] *= 2.0  # end nodes carry half a hat, see `plane.grid`
        return PairField(
            tooth=-load.tooth if pose.back else load.tooth,
            points=points,
            normals=-frame.vectors(inward),
            motion=elastic + turn * np.stack([-y, x], axis=1),
            pressure=pressure,
            load=float(load.normal.sum()) * scene.problem.face_width,
            has_edge=is_sharp,
            mesh=number,
        )
