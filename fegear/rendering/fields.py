"""Displacement, stress and contact pressure of gears in mesh, in place.

World coordinates in metres, as the gear set is drawn by `fegear show`: the gears are
turned so that their flanks touch without load at the position asked for. A gear in
several meshes has the sum of the fields under the loads of each, its hub held. Nothing
here draws.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from fegear.contact.edges import has_edge
from fegear.contact.loads import (
    PatchLoad,
    in_plane_strain,
    patch_loads,
    tooth_loads,
)
from fegear.contact.problem import ContactProblem
from fegear.contact.solve import run_kernel
from fegear.elasticity.body_stress import ToothLoad, von_mises
from fegear.files.errors import InputError
from fegear.gearset.model import Gear, GearSet, Mesh
from fegear.gearset.phases import tooth_axis
from fegear.gearset.placing import layout
from fegear.rendering.frames import Frame, View, turned
from fegear.rendering.recorded import Instant
from fegear.rendering.sector_field import (
    MIRROR,
    LoadableGear,
    SectorField,
    loadable_gear,
)
from fegear.statics.plausibility import plausibility_warnings
from fegear.statics.settings import StaticsSettings
from fegear.statics.solving import contact_problem
from lumped.common.array_types import Array, Indices
from lumped.common.progress import Progress, silent
from meshes.profile import flank_frame

Role = Literal["driver", "driven"]
Zoom = Literal["contact", "tooth", "gear", "set"]
PLACE_TOL = 1e-5  # of a pitch or of the module, between places by two meshes of a gear
ROLES: tuple[Role, Role] = ("driver", "driven")
OUTLINE = ("tip", "flank", "fillet", "root", "hub")


@dataclass(frozen=True, eq=False)
class GearField:
    """One gear's visible teeth, every sector with nodes of its own.

    points : (n, 2); triangles : (m, 6) corners counterclockwise, then mid-sides
    tooth : (m,) tooth of each triangle, counted as pairs are, 0 in the reference pair
    outline : (k, 3) boundary edges, end, mid-side, end; fillet : nodes on fillets
    displacement : (n, 2) elastic, with the hub held [m]
    hub_motion : (n, 2) rigid turn of the hub that keeps the flanks in contact [m]
    stress : (n, 3) xx, yy, xy [Pa]; out_of_plane : (n,) zz
    layer : 0 in front, other gears behind it
    """

    name: str
    center: Array
    points: Array
    triangles: Indices
    tooth: Indices
    outline: Indices
    fillet: Indices
    displacement: Array
    hub_motion: Array
    stress: Array
    out_of_plane: Array
    is_internal: bool = False
    layer: int = 0

    def moved(self, frame: Frame) -> GearField:
        """The gear with all its fields, its world in a frame."""
        return replace(
            self,
            center=frame.places(self.center),
            points=frame.places(self.points),
            displacement=frame.vectors(self.displacement),
            hub_motion=frame.vectors(self.hub_motion),
            stress=frame.stresses(self.stress),
        )

    @property
    def motion(self) -> Array:
        """Displacement from the gears touching without load, (n, 2) [m]."""
        return self.displacement + self.hub_motion

    @property
    def von_mises(self) -> Array:
        """Equivalent stress (n,) [Pa]."""
        return von_mises(self.stress, self.out_of_plane)

    @property
    def principal_1(self) -> Array:
        """Largest principal stress in the plane, tension positive (n,) [Pa]."""
        x, y, xy = self.stress.T
        return 0.5 * (x + y) + np.hypot(0.5 * (x - y), xy)

    @property
    def elastic_shift(self) -> Array:
        """Length of the elastic displacement (n,) [m]."""
        return np.hypot(*self.displacement.T)


@dataclass(frozen=True, eq=False)
class PairField:
    """Contact pressure of one tooth pair.

    mesh : index of its mesh among those that are solved
    tooth : base pitches by which the pair is ahead of the reference pair
    points : (n, 2) contact nodes, without load, on the driver's flank
    normals : (n, 2) unit, out of the driver's flank
    motion : (n, 2) of the nodes with the driver [m]
    pressure : (n,) of plane strain [Pa]; load : normal force of the pair [N]
    has_edge : whether a tip corner or a kink of a flank is in contact: the
        largest pressure then follows the contact grid and has no limit
    """

    tooth: int
    points: Array
    normals: Array
    motion: Array
    pressure: Array
    load: float
    has_edge: bool
    mesh: int = 0

    def moved(self, frame: Frame) -> PairField:
        """The pair, its world in a frame."""
        return replace(
            self,
            points=frame.places(self.points),
            normals=frame.vectors(self.normals),
            motion=frame.vectors(self.motion),
        )

    @property
    def center(self) -> Array:
        """Point at which the resultant of the load acts, (2,)."""
        return self.pressure @ self.points / self.pressure.sum()


@dataclass(frozen=True, eq=False)
class ContactField:
    """Gears in mesh at one position.

    torque : on the driver that holds the gears; of a whole gear set on its input [N m]
    position : of the first mesh
    ste : the driver's rotation times its base radius, driven gear held [m]; None of a
        whole gear set, where each mesh has its own
    pairs : that carry load, none where contact is lost
    instant : of the motion this is a moment of, None for gears at rest
    """

    torque: float
    position: float
    ste: float | None
    gears: tuple[GearField, ...]
    pairs: tuple[PairField, ...]
    instant: Instant | None = None

    def turned(self, angle: float, center: Array) -> ContactField:
        """All of it turned counterclockwise [rad] about a point (2,)."""
        turn = turned(angle)
        frame = Frame(center - turn @ center, turn)
        gears = tuple(gear.moved(frame) for gear in self.gears)
        pairs = tuple(pair.moved(frame) for pair in self.pairs)
        return replace(self, gears=gears, pairs=pairs)

    @property
    def is_gear_set(self) -> bool:
        """Whether all meshes of a gear set are shown, and not one of them."""
        return self.ste is None

    def of_gears(self, name: str) -> NDArray[Any]:
        """An array of all gears, one after another."""
        return np.concatenate([getattr(gear, name) for gear in self.gears])

    def nodes_of_gears(self, name: str) -> Indices:
        """Node numbers of all gears, each gear's after those of the gears before."""
        starts = self.first_nodes
        shifted = [
            getattr(gear, name) + start
            for gear, start in zip(self.gears, starts, strict=True)
        ]
        return np.vstack(shifted)

    @property
    def first_nodes(self) -> list[int]:
        """Number of each gear's first node among the nodes of all."""
        counts = [len(gear.points) for gear in self.gears]
        return [sum(counts[:index]) for index in range(len(counts))]


@dataclass(frozen=True, eq=False)
class MeshScene:
    """One mesh of a gear set, ready for any torque and position."""

    name: str
    gear_names: tuple[str, str]
    mesh: Mesh
    problem: ContactProblem
    bodies: tuple[LoadableGear, LoadableGear]
    driver_center: Array
    direction: float
    sense: int

    @property
    def module(self) -> float:
        return self.mesh.pair.driver.module

    @property
    def centers(self) -> tuple[Array, Array]:
        along = np.array([math.cos(self.direction), math.sin(self.direction)])
        return (
            self.driver_center,
            self.driver_center + self.mesh.pair.center_distance * along,
        )

    def frame(
        self, role: Role, position: float, tooth: int = 0, back: bool = False
    ) -> Frame:
        """Frame of the sector `tooth` places to the right of the reference pair's
        tooth.

        Right is clockwise, and counterclockwise in the mirror image. Opposite for an
        internal gear, whose teeth point to the centre.

        back : whether the teeth are seen in a mirror, in which their back flanks are
            the right ones; pairs then count the other way, and the driver's tooth
            of the reference pair is the next one
        """
        if back:
            other = self.frame(role, position, (role == "driver") - tooth)
            return Frame(other.center, other.turn @ np.diag([-1.0, 1.0]))
        pair = self.mesh.pair
        index, sense = 0, self.sense
        if role == "driven":
            index, sense = 1, -self.sense * pair.sign
        gear = self.bodies[index].sector.gear
        axis = tooth_axis(self.mesh, role == "driver", sense, self.direction)
        axis += gear.sign * sense * position * gear.pitch_angle
        mirrored = self.sense * pair.driver.sign > 0
        right = tooth * gear.pitch_angle
        to_upright = turned(axis - 0.5 * math.pi)
        mirror = np.diag([-1.0, 1.0]) if mirrored else np.eye(2)
        return Frame(self.centers[index], to_upright @ mirror @ turned(-right))

    def view(self, zoom: Zoom, aspect: float) -> View:
        """What is to be seen; it does not depend on position or load."""
        pair, module = self.mesh.pair, self.mesh.pair.driver.module
        if zoom == "set":
            raise InputError("zoom = set; allowed contact, tooth, gear, for one mesh")
        if zoom == "gear":
            return view_of_gears(zip(self.centers, self.bodies, strict=True), aspect)
        ends = np.array([self._on_path(pair.path_start), self._on_path(pair.path_end)])
        x, y = ends.mean(axis=0)
        width, height = 0.5 * np.abs(ends[1] - ends[0]) + 0.6 * module
        half = max(height, width / aspect)
        return View(x, y, half * (1.0 if zoom == "contact" else 2.0), aspect)

    def _on_path(self, roll_length: float) -> Array:
        """A point of the line of action by the driver's roll length, (2,)."""
        pair = self.mesh.pair
        sense = self.sense * pair.driver.sign
        out = turned(self.direction) @ turned(-sense * pair.operating_pressure_angle)
        point = np.array([pair.driver.base_radius, sense * roll_length])
        return self.driver_center + pair.sign * (out @ point)


def view_of_gears(gears: Iterable[tuple[Array, LoadableGear]], aspect: float) -> View:
    """The view of whole gears, each by its centre (2,) [m] and its body."""
    placed = [(center, body.sector.gear.outer_radius) for center, body in gears]
    low = np.min([center - radius for center, radius in placed], axis=0)
    high = np.max([center + radius for center, radius in placed], axis=0)
    x, y = 0.5 * (low + high)
    width, height = 0.5 * (high - low)
    return View(x, y, 1.03 * max(height, width / aspect), aspect)


def mesh_scene(
    gear_set: GearSet,
    mesh: int,
    settings: StaticsSettings,
    report: Progress = silent,
    bodies_by_gear: dict[Gear, LoadableGear] | None = None,
) -> MeshScene:
    """Prepare mesh number `mesh`, counted from 0.

    bodies_by_gear : of gears without their names, to be shared between meshes; those
        that are missing are added
    """
    spec = gear_set.meshes[mesh]
    problem = contact_problem(gear_set, mesh, settings, report)
    shared = {} if bodies_by_gear is None else bodies_by_gear
    bodies: list[LoadableGear] = []
    gears = [gear_set.gears[index] for index in spec.gears]
    for gear in gears:
        report(f"elements of {gear.name}", len(bodies), 2)
        unnamed = replace(gear, name="")
        if unnamed not in shared:
            sector = settings.sector(gear)
            shared[unnamed] = loadable_gear(sector, settings.friction > 0.0)
        bodies.append(shared[unnamed])
    placed = layout(gear_set)
    place = placed.places[spec.driver]
    return MeshScene(
        name=gear_set.name,
        gear_names=(gears[0].name, gears[1].name),
        mesh=spec,
        problem=problem,
        bodies=(bodies[0], bodies[1]),
        driver_center=np.array([place.x, place.y]),
        direction=placed.directions[mesh],
        sense=place.sense,
    )


def require_drawable(scene: MeshScene, ste: float) -> None:
    """Refuse a transmission error [m] beyond which teeth are not in mesh."""
    where = f"{scene.name}, {' and '.join(scene.gear_names)}"
    module = scene.mesh.pair.driver.module
    for warning in plausibility_warnings(where, module, deflection=ste):
        raise InputError(warning)


def contact_field(
    scene: MeshScene, torque: float, position: float, view: View
) -> ContactField:
    """Fields of the teeth in view at a torque on the driver [N m] and a position."""
    solved = run_kernel(scene.problem, np.array([torque]), np.array([position]))
    ste = float(solved.rows.ste[0, 0])
    require_drawable(scene, ste)
    loads = patch_loads(scene.problem, torque, position)
    gears, pairs = loaded_gears(scene, RelativePose(position, ste), loads, view)
    return ContactField(torque, position, ste, gears, pairs)


@dataclass(frozen=True)
class RelativePose:
    """Position of the gears relative to each other.

    position : base pitches from the pitch point
    ste : the driver's rotation times its base radius, driven gear held [m]
    back : whether loads are on the back flanks, and seen in the mirror
    """

    position: float
    ste: float
    back: bool = False


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
                moved = replace(load, tooth=load.tooth - count.shift)
                loads[count.mirrored].append(moved)
        if view is not None:
            half, mesh = body.sector.gear.teeth // 2, body.sector.mesh
            corners = mesh.points[np.unique(mesh.triangles[:, :3])]
            teeth |= {
                tooth
                for tooth in range(-half, body.sector.gear.teeth - half)
                if view.contains(self.first.frame(tooth).places(corners))
            }
        return body.sectors(loads[False], sorted(teeth), loads[True])


def _tooth_count(first: MeshSide, other: MeshSide) -> ToothCount:
    """Compare the places of the teeth; InputError where these do not coincide."""
    gear, scene = first.body.sector.gear, other.mesh.scene
    turn = first.frame().turn.T @ other.frame().turn
    mirrored = bool(np.linalg.det(turn) < 0.0)
    if mirrored:
        turn = turn @ np.diag(MIRROR)
    pitches = math.atan2(turn[1, 0], turn[0, 0]) / gear.pitch_angle
    pitches = -pitches if mirrored else pitches
    apart = float(np.hypot(*(other.center - first.center))) / scene.module
    if max(abs(pitches - round(pitches)), apart) > PLACE_TOL:
        raise InputError(
            f"{scene.name}, mesh of {' and '.join(scene.gear_names)}: its phase and "
            f"centre line place {other.name} otherwise than the gear's other mesh "
            "does; allowed in pictures of a set are phases that follow from the centre "
            "lines"
        )
    return ToothCount(gear.teeth, round(pitches), mirrored)


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
        pressure[[0, -1]] *= 2.0  # end nodes carry half a hat, see fegear.contact.grid
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
