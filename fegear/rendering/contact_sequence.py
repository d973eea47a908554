"""Contacts that a picture or film shows: at rest, of all meshes, or in motion."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from fegear.contact.problem import ContactFailure
from fegear.files.errors import InputError
from fegear.gearset.lumped_train import train_of
from fegear.gearset.model import GearSet
from fegear.gearset.phases import mesh_phases
from fegear.gearset.pitch_errors import pair_periods
from fegear.gearset.planes import plane_in_words
from fegear.rendering.fields import ContactField, contact_field, mesh_scene
from fegear.rendering.frames import View
from fegear.rendering.gear_set_scene import (
    GearSetScene,
    SetMoment,
    field_at,
    gear_set_scene,
    turn_moments,
)
from fegear.rendering.mesh_scene import MeshScene
from fegear.rendering.motion_field import instant_field
from fegear.rendering.recorded import Instant, RecordedMotion
from fegear.statics.settings import StaticsSettings
from lumped.common.checks import format_number
from lumped.common.progress import Progress, silent
from lumped.common.short_repr import ShortRepr

COLOUR_SCALE_POSITIONS = 6  # positions that fix the colours of a film


@dataclass(frozen=True, kw_only=True)
class ContactSequence(ShortRepr):
    """The contact that is drawn, at moments of a mesh cycle or of a recorded motion.

    mesh : index from 0, None for all meshes of the gear set at the same moment
    film_title : added to the title of a film
    still : moment of a single picture
    samples : moments among which colours and scales of a film are chosen
    frames : moments of a film by their number
    field : of the teeth in a view at a moment
    """

    gear_set: GearSet
    mesh: int | None
    statics: StaticsSettings
    title: str
    film_title: str
    still: Any
    samples: Sequence[Any]
    frames: Callable[[int], Sequence[Any]]
    field: Callable[[Any, Any, View], ContactField]

    def scene(self, report: Progress = silent) -> MeshScene | GearSetScene:
        """The gears, with what all moments have in common."""
        if self.mesh is None:
            return gear_set_scene(self.gear_set, self.statics, report)
        return mesh_scene(self.gear_set, self.mesh, self.statics, report)


def require_position(gear_set: GearSet, mesh: int, position: float) -> int:
    """Require a position of a mesh until its tooth pairs repeat.

    Returns after how many base pitches they do.
    """
    period = pair_periods(gear_set)[mesh]
    if not 0.0 <= position <= period:
        raise InputError(f"position = {format_number(position)}; must be 0 to {period}")
    return period


def contact_at_rest(
    gear_set: GearSet,
    mesh: int,
    torque: float,
    position: float,
    statics: StaticsSettings,
) -> ContactSequence:
    """Contact of a mesh (index from 0) under a torque on its driver [N m].

    position : base pitches from the pitch point
    """
    period = require_position(gear_set, mesh, position)

    def positions(count: int) -> list[float]:
        return [i / count for i in range(count)]

    first = f", the first of {period} base pitches with pitch errors"
    return ContactSequence(
        gear_set=gear_set,
        mesh=mesh,
        statics=statics,
        title=mesh_title(gear_set, mesh, statics),
        film_title=first if period > 1 else "",
        still=position,
        samples=positions(COLOUR_SCALE_POSITIONS),
        frames=positions,
        field=lambda scene, at, view: contact_field(scene, torque, at, view),
    )


def contacts_of_set(
    gear_set: GearSet,
    torque: float,
    position: float,
    statics: StaticsSettings,
    turns: float | None = None,
) -> ContactSequence:
    """Contact of all meshes under a torque on the input [N m].

    position : of the first mesh, base pitches from the pitch point
    turns : of the carrier or the input that a film shows, None for one cycle of the
        slowest mesh
    """
    require_position(gear_set, 0, position)
    length = 1.0 / min(map(float, train_of(gear_set, torque).mesh_rates))

    def cycle(count: int) -> list[SetMoment]:
        return [SetMoment(length * i / count) for i in range(count)]

    def frames(count: int) -> list[SetMoment]:
        return cycle(count) if turns is None else turn_moments(gear_set, turns, count)

    frames(1)  # refuses turns of a carrier that is held
    film_title = "" if length < 1.001 else f", {length:.3g} cycles of mesh 1"
    if turns is not None:
        member = "input" if gear_set.carrier is None else "carrier"
        film_title = (
            f", {turns:.3g} {'turn' if turns == 1.0 else 'turns'} of the {member}"
        )
    return ContactSequence(
        gear_set=gear_set,
        mesh=None,
        statics=statics,
        title=f"{gear_set.name}, all meshes{_settings_text(gear_set, statics)}",
        film_title=film_title,
        still=SetMoment(position),
        samples=cycle(COLOUR_SCALE_POSITIONS),
        frames=frames,
        field=lambda scene, at, view: field_at(scene, torque, at, view),
    )


def contact_in_motion(
    gear_set: GearSet, mesh: int, motion: RecordedMotion, statics: StaticsSettings
) -> ContactSequence:
    """Contact of a recorded motion of a mesh (index from 0), with the friction and
    plane of the record.

    A single picture shows the largest mesh force.
    """
    phase = mesh_phases(gear_set)[mesh].value

    def field(scene: MeshScene, instant: Instant, view: View) -> ContactField:
        try:
            return instant_field(scene, instant, phase, view)
        except ContactFailure as error:
            raise InputError(
                f"{motion.source}: {error}; allowed are histories of this gear set"
            ) from None

    statics = replace(statics, friction=motion.friction, plane=motion.plane)
    changes = "".join(f", {key} = {value}" for key, value in motion.edits.items())
    title = f"{mesh_title(gear_set, mesh, statics)}, {motion.torque:g} N m on the input"
    first, count = motion.film_cycles
    one = f", cycle {first + 1} of {motion.cycles}"
    return ContactSequence(
        gear_set=gear_set,
        mesh=mesh,
        statics=statics,
        title=title + changes,
        film_title=one if count < motion.cycles else "",
        still=motion.largest(),
        samples=motion.extremes(),
        frames=motion.frames,
        field=field,
    )


def mesh_title(gear_set: GearSet, mesh: int, statics: StaticsSettings) -> str:
    """Gear set, mesh by its index from 0, its gears and settings in one line."""
    spec = gear_set.meshes[mesh]
    driver, driven = (gear_set.gears[i].name for i in (spec.driver, spec.driven))
    title = f"{gear_set.name}, mesh {mesh + 1}: {driver} drives {driven}"
    shafts = " on shafts that yield" if spec.on_shafts else ""
    return title + _settings_text(gear_set, statics) + shafts


def _settings_text(gear_set: GearSet, statics: StaticsSettings) -> str:
    friction = f", friction {statics.friction:g}" if statics.friction else ""
    return f", {plane_in_words(statics.plane_of(gear_set))}{friction}"
