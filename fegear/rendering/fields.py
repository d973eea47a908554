"""Displacement, stress and contact pressure of two gears in mesh, in place.

World coordinates in metres, as the gear set is drawn by `fegear show`: the gears are
turned so that their flanks touch without load at the position asked for. Nothing
here draws.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from fegear.contact.edges import has_edge
from fegear.contact.loads import PatchLoad, patch_loads, tooth_loads
from fegear.contact.problem import ContactProblem, run_kernel
from fegear.elasticity.body_stress import von_mises
from fegear.files.errors import InputError
from fegear.gearset.model import GearSet, Mesh
from fegear.gearset.phases import tooth_axis
from fegear.gearset.placing import layout
from fegear.rendering.frames import Frame, View, turned
from fegear.rendering.recorded import Instant
from fegear.rendering.sector_field import LoadableGear, SectorField, loadable_gear
from fegear.statics.plausibility import plausibility_warnings
from fegear.statics.solving import StaticsSettings, contact_problem
from lumped.common.progress import Progress, silent
from meshes.profile import flank_frame

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Role = Literal["driver", "driven"]
Zoom = Literal["contact", "tooth", "gear"]
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

    tooth : base pitches by which the pair is ahead of the reference pair
    points : (n, 2) contact nodes, without load, on the driver's flank
    normals : (n, 2) unit, out of the driver's flank
    motion : (n, 2) of the nodes with the driver [m]
    pressure : (n,) [Pa]; load : normal force of the pair [N]
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

    @property
    def center(self) -> Array:
        """Point at which the resultant of the load acts, (2,)."""
        return self.pressure @ self.points / self.pressure.sum()


@dataclass(frozen=True, eq=False)
class ContactField:
    """Both gears at one position.

    torque : on the driver that holds the gears [N m]
    ste : the driver's rotation times its base radius, driven gear held [m]
    pairs : that carry load, none where contact is lost
    instant : of the motion this is a moment of, None for gears at rest
    """

    torque: float
    position: float
    ste: float
    gears: tuple[GearField, GearField]
    pairs: tuple[PairField, ...]
    instant: Instant | None = None

    def of_both(self, name: str) -> NDArray[Any]:
        """An array of the gears, the driver's first."""
        return np.concatenate([getattr(gear, name) for gear in self.gears])

    def nodes_of_both(self, name: str) -> Indices:
        """Node numbers of the gears, where the driven one's follow the driver's."""
        one, two = self.gears
        shifted = getattr(two, name) + len(one.points)
        return np.vstack([getattr(one, name), shifted])


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
        if zoom == "gear":
            return self._whole_view(aspect)
        ends = np.array([self._on_path(pair.path_start), self._on_path(pair.path_end)])
        x, y = ends.mean(axis=0)
        width, height = 0.5 * np.abs(ends[1] - ends[0]) + 0.6 * module
        half = max(height, width / aspect)
        return View(x, y, half * (1.0 if zoom == "contact" else 2.0), aspect)

    def _whole_view(self, aspect: float) -> View:
        radii = [body.sector.gear.outer_radius for body in self.bodies]
        low = np.min([c - r for c, r in zip(self.centers, radii, strict=True)], axis=0)
        high = np.max([c + r for c, r in zip(self.centers, radii, strict=True)], axis=0)
        x, y = 0.5 * (low + high)
        width, height = 0.5 * (high - low)
        return View(x, y, 1.03 * max(height, width / aspect), aspect)

    def _on_path(self, roll_length: float) -> Array:
        """A point of the line of action by the driver's roll length, (2,)."""
        pair = self.mesh.pair
        sense = self.sense * pair.driver.sign
        out = turned(self.direction) @ turned(-sense * pair.operating_pressure_angle)
        point = np.array([pair.driver.base_radius, sense * roll_length])
        return self.driver_center + pair.sign * (out @ point)


def mesh_scene(
    gear_set: GearSet,
    mesh: int,
    settings: StaticsSettings,
    report: Progress = silent,
) -> MeshScene:
    """Prepare mesh number `mesh`, counted from 0."""
    spec = gear_set.meshes[mesh]
    problem = contact_problem(gear_set, mesh, settings, report)
    bodies: list[LoadableGear] = []
    gears = [gear_set.gears[index] for index in spec.gears]
    for gear in gears:
        report(f"elements of {gear.name}", len(bodies), 2)
        bodies.append(loadable_gear(settings.sector(gear), settings.friction > 0.0))
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
    for warning in plausibility_warnings(where, module, transmission_error=ste):
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


def loaded_gears(
    scene: MeshScene, stand: RelativePose, loads: Sequence[PatchLoad], view: View
) -> tuple[tuple[GearField, GearField], tuple[PairField, ...]]:
    """Both gears under any loads, and the pairs that carry them."""
    driving, driven = (
        sector_fields(scene, role, loads, stand.position, view, stand.back)
        for role in ROLES
    )
    turn = scene.sense * stand.ste / scene.problem.pair.driver_arm
    gears = (
        _gear_field(scene, "driver", driving, stand, turn),
        _gear_field(scene, "driven", driven, stand, 0.0),
    )
    by_tooth = {sector.tooth: sector for sector in driving}
    pairs = tuple(
        _pair_field(scene, load, by_tooth[load.tooth], stand, turn) for load in loads
    )
    return gears, pairs


def sector_fields(
    scene: MeshScene,
    role: Role,
    loads: Sequence[PatchLoad],
    position: float,
    view: View | None = None,
    back: bool = False,
) -> list[SectorField]:
    """The loaded sectors of one gear and those in view, in the frames of their teeth.

    What is out of view costs nothing.
    """
    body = scene.bodies[0 if role == "driver" else 1]
    on_teeth = tooth_loads(loads, role)
    teeth = {load.tooth for load in on_teeth}
    if view is not None:
        half = body.sector.gear.teeth // 2
        corners = body.sector.mesh.points[np.unique(body.sector.mesh.triangles[:, :3])]
        teeth |= {
            tooth
            for tooth in range(-half, body.sector.gear.teeth - half)
            if view.contains(scene.frame(role, position, tooth, back).places(corners))
        }
    return body.sectors(on_teeth, sorted(teeth))


def _gear_field(
    scene: MeshScene,
    role: Role,
    sectors: Sequence[SectorField],
    stand: RelativePose,
    turn: float,
) -> GearField:
    """Sectors in the world; turn is the hub's rotation, counterclockwise [rad]."""
    index = 0 if role == "driver" else 1
    body, center = scene.bodies[index], scene.centers[index]
    edges = body.sector.mesh.edges
    names = [side + name for name in OUTLINE for side in ("", "left_")]
    sides = np.vstack([edges[n] for n in names if n in edges])[:, [0, 2, 1]]
    corners = np.unique([edges["fillet"], edges["left_fillet"]])
    parts, count = [], 0
    for sector in sectors:
        frame = scene.frame(role, stand.position, sector.tooth, stand.back)
        part = _sector_in_world(sector, frame)
        number = _pair_tooth(role, sector.tooth, stand.back)
        part["tooth"] = np.full(len(part["triangles"]), number)
        part["triangles"] = part["triangles"] + count
        part |= {"outline": sides + count, "fillet": corners + count}
        parts.append(part)
        count += len(part["points"])
    joined = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    x, y = (joined["points"] - center).T
    return GearField(
        name=scene.gear_names[index],
        center=center,
        hub_motion=turn * np.stack([-y, x], axis=1),
        out_of_plane=body.sector.material.out_of_plane(joined["stress"]),
        is_internal=body.sector.gear.sign < 0,
        **joined,
    )


def _sector_in_world(sector: SectorField, frame: Frame) -> dict[str, NDArray[Any]]:
    """Points, triangles, displacement and stress of a refined sector."""
    places, nodes, state = sector.refined()
    if np.linalg.det(frame.turn) < 0.0:  # a mirror image turns triangles over
        nodes = nodes[:, [0, 2, 1, 5, 4, 3]]
    return {
        "points": frame.places(places),
        "triangles": nodes,
        "displacement": frame.vectors(state[:, :2]),
        "stress": frame.stresses(state[:, 2:]),
    }


def _pair_tooth(role: Role, right: int, back: bool) -> int:
    """A tooth's number in the order of contact: ahead is to the left when driven."""
    if back:
        right = (role == "driver") - right
    return right if role == "driver" else -right


def _pair_field(
    scene: MeshScene,
    load: PatchLoad,
    sector: SectorField,
    stand: RelativePose,
    turn: float,
) -> PairField:
    gear = scene.problem.pair.driver
    flank, inward = flank_frame(gear, load.driver_arcs)
    frame = scene.frame("driver", stand.position, load.tooth, stand.back)
    points = frame.places(flank)
    x, y = (points - frame.center).T
    elastic = frame.vectors(sector.at(flank)[:, :2])
    pressure = load.normal / load.step
    pressure[[0, -1]] *= 2.0  # end nodes carry half a hat, see fegear.contact.grid
    return PairField(
        tooth=-load.tooth if stand.back else load.tooth,
        points=points,
        normals=-frame.vectors(inward),
        motion=elastic + turn * np.stack([-y, x], axis=1),
        pressure=pressure,
        load=float(load.normal.sum()) * scene.problem.face_width,
        has_edge=has_edge(scene.problem, load),
    )
