"""Fields of all gears of a set, every mesh in contact at the same moment.

The contact of a mesh is that of the mesh alone, under its part of the torque and at its
own position in the cycle. Hubs are held, so that a gear's field under the loads of one
mesh does not depend on the contact of another, and the fields add up.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fegear.contact.loads import patch_loads
from fegear.contact.plane.solve import run_kernel
from fegear.files.errors import InputError
from fegear.gearset.lumped_train import train_of
from fegear.gearset.model import Gear, GearSet
from fegear.gearset.phases import mesh_phases
from fegear.gearset.pitch_errors import pair_periods
from fegear.gearset.placing import layout
from fegear.gearset.power_path import mesh_torques_at
from fegear.rendering.fields import ContactField, mesh_scene, require_drawable
from fegear.rendering.frames import View
from fegear.rendering.loaded_gears import LoadedMesh, gears_in_meshes
from fegear.rendering.mesh_scene import MeshScene, RelativePose, Zoom, view_of_gears
from fegear.rendering.sector_field import LoadableGear
from fegear.statics.settings import StaticsSettings
from lumped.common.checks import require_present
from lumped.common.progress import Progress, silent

# of the view's half height: a quarter of a pixel; the largest stress below a contact is
# then up to 2 % too small
FINEST_TRIANGLE = 5e-4


@dataclass(frozen=True, eq=False)
class GearSetScene:
    """All meshes of a gear set, ready for any torque and position."""

    gear_set: GearSet
    meshes: tuple[MeshScene, ...]

    @property
    def module(self) -> float:
        """Module of the smallest teeth [m]."""
        return min(mesh.module for mesh in self.meshes)

    @cached_property
    def rates(self) -> tuple[float, ...]:
        """Base pitches of each mesh per base pitch of the first."""
        return tuple(map(float, train_of(self.gear_set, 0.0).mesh_rates))

    @cached_property
    def layers(self) -> Mapping[int, int]:
        """Layer of each gear, 0 in front.

        The order of gears along a shaft is not part of a gear set: of the two
        ways round, the one in which more of the smaller gears are in front.
        """
        places, gears = layout(self.gear_set).places, self.gear_set.gears
        layers = {index: place.layer for index, place in places.items()}
        larger_in_front = sum(
            int(np.sign(layers[one] - layers[other]))
            for one in layers
            for other in self.gear_set.axis(one)
            if gears[one].geometry.outer_radius < gears[other].geometry.outer_radius
        )
        last = max(layers.values()) if larger_in_front > 0 else None
        if last is None:
            return layers
        return {index: last - layer for index, layer in layers.items()}

    def view(self, zoom: Zoom, aspect: float) -> View:
        """The view of all gears that are in mesh, which the zoom must be for."""
        if zoom != "set":
            raise InputError(f"zoom = {zoom}; must be set, for a whole gear set")
        sides = [
            side
            for mesh in self.meshes
            for side in zip(mesh.centers, mesh.bodies, strict=True)
        ]
        return view_of_gears(sides, aspect)

    def hub_turns(self, errors: Sequence[float]) -> dict[int, float]:
        """Rotation of each gear's hub, counterclockwise [rad], the last driven held.

        errors : transmission error of each mesh [m]. Where meshes in parallel do not
            agree, as of planets out of phase, the mean square of what is left is least.
        """
        gear_set, senses = self.gear_set, self.gear_set.senses
        axes = {gear: min(gear_set.axis(gear)) for gear in range(len(gear_set.gears))}
        driving = {axes[mesh.mesh.driver] for mesh in self.meshes}
        free = sorted(driving)
        arms = np.zeros((len(self.meshes), len(free)))
        for row, scene in zip(arms, self.meshes, strict=True):
            pair = scene.mesh.pair
            for gear, arm in (
                (scene.mesh.driver, pair.driver_arm),
                (scene.mesh.driven, -abs(pair.driven.base_radius)),
            ):
                if axes[gear] in driving:
                    row[free.index(axes[gear])] += arm
        advances = dict(zip(free, np.linalg.lstsq(arms, errors)[0], strict=True))
        return {
            gear: senses[gear] * float(advances.get(axis, 0.0))
            for gear, axis in axes.items()
        }


def gear_set_scene(
    gear_set: GearSet, settings: StaticsSettings, report: Progress = silent
) -> GearSetScene:
    """Prepare all meshes; equal gears have one body."""
    bodies: dict[Gear, LoadableGear] = {}
    meshes = tuple(
        mesh_scene(gear_set, number, settings, report, bodies)
        for number in range(len(gear_set.meshes))
    )
    return GearSetScene(gear_set, meshes)


def gear_set_field(
    scene: GearSetScene, torque: float, position: float, view: View
) -> ContactField:
    """Fields of the teeth in view at a torque on the input [N m] and a position of the
    first mesh.
    """
    meshes = loaded_meshes(scene, torque, position)
    turns = scene.hub_turns([mesh.pose.ste for mesh in meshes])
    finest = FINEST_TRIANGLE * view.half_height
    gears, pairs = gears_in_meshes(meshes, turns, view, finest)
    indices = dict.fromkeys(gear for mesh in scene.meshes for gear in mesh.mesh.gears)
    layers = scene.layers
    placed = [
        replace(gear, layer=layers[index])
        for index, gear in zip(indices, gears, strict=True)
    ]
    placed.sort(key=lambda gear: -gear.layer)  # what is drawn last is in front
    return ContactField(torque, position, None, tuple(placed), pairs)


def loaded_meshes(
    scene: GearSetScene, torque: float, position: float
) -> list[LoadedMesh]:
    """Every mesh at its own position and under its own torque.

    A mesh that passes no power on has flanks that touch without load.
    """
    torques = mesh_torques_at(scene.gear_set, torque)
    phases = [phase.value for phase in mesh_phases(scene.gear_set)]
    periods = pair_periods(scene.gear_set)
    meshes = []
    for number, mesh in enumerate(scene.meshes):
        local = phases[number] + scene.rates[number] * position
        local = math.fmod(local, periods[number])
        meshes.append(_loaded_mesh(mesh, torques[number], local))
    return meshes


def _loaded_mesh(scene: MeshScene, torque: float, position: float) -> LoadedMesh:
    if torque == 0.0:
        return LoadedMesh(scene, RelativePose(position, 0.0), [])
    solved = run_kernel(scene.problem, np.array([torque]), np.array([position]))
    ste = float(solved.rows.ste[0, 0])
    require_drawable(scene, ste)
    loads = patch_loads(scene.problem, torque, position)
    return LoadedMesh(scene, RelativePose(position, ste), loads)


@dataclass(frozen=True)
class SetMoment:
    """A position of the first mesh [base pitches], and how far the carrier has turned
    in the ground's frame, counterclockwise [rad].
    """

    position: float
    carrier_angle: float = 0.0


def turn_moments(gear_set: GearSet, turns: float, count: int) -> list[SetMoment]:
    """Moments of some turns of the carrier, or of the input of a set without one."""
    carrier, parts = gear_set.carrier, [turns * i / count for i in range(count)]
    if carrier is None:
        teeth = gear_set.gears[gear_set.meshes[0].driver].geometry.teeth
        return [SetMoment(teeth * part) for part in parts]
    held = carrier.gear_of(carrier.members.held)
    if held is None:
        raise InputError(
            f"turns = {turns:g}; the carrier of {gear_set.name} is held, leave it out"
        )
    # against the carrier the held gear turns the other way
    full = -2.0 * math.pi * gear_set.senses[held]
    teeth = gear_set.gears[held].geometry.teeth
    return [SetMoment(teeth * part, full * part) for part in parts]


def field_at(
    scene: GearSetScene, torque: float, moment: SetMoment, view: View
) -> ContactField:
    """Fields at a moment, in the ground's frame where the carrier has turned."""
    field = gear_set_field(scene, torque, moment.position, view)
    if moment.carrier_angle == 0.0:
        return field
    carrier = require_present(scene.gear_set.carrier, "carrier")
    place = layout(scene.gear_set).places[carrier.sun]
    return field.turned(moment.carrier_angle, np.array([place.x, place.y]))
