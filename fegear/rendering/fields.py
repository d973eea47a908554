"""Displacement, stress and contact pressure of gears in mesh, in place.

World coordinates in metres, as the gear set is drawn by `fegear show`: the gears are
turned so that their flanks touch without load at the position asked for. A gear in
several meshes has the sum of the fields under the loads of each, its hub held. Nothing
here draws.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fegear.contact.loads import patch_loads
from fegear.contact.plane.solve import run_kernel
from fegear.files.errors import InputError
from fegear.gearset.model import Gear, GearSet
from fegear.rendering.frames import Frame, View, turned
from fegear.rendering.gear_fields import GearField, PairField
from fegear.rendering.loaded_gears import loaded_gears
from fegear.rendering.mesh_scene import MeshScene, RelativePose
from fegear.rendering.placed_mesh import placed_mesh
from fegear.rendering.recorded import Instant
from fegear.rendering.sector_field import LoadableGear, loadable_gear
from fegear.statics.contact_problem import contact_problem
from fegear.statics.plausibility import plausibility_warnings
from fegear.statics.settings import StaticsSettings
from lumped.common.array_types import Array, Indices
from lumped.common.progress import Progress, silent
from lumped.common.short_repr import ShortRepr


@dataclass(frozen=True, eq=False)
class ContactField(ShortRepr):
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
    placed = placed_mesh(gear_set, mesh)
    return MeshScene(
        name=gear_set.name,
        gear_names=placed.gear_names,
        mesh=spec,
        problem=problem,
        bodies=(bodies[0], bodies[1]),
        driver_center=placed.driver_center,
        direction=placed.direction,
        sense=placed.sense,
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
