"""The states of a mesh that a picture or a film shows: at rest, or of a motion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from fegear.contact.problem import ContactFailure
from fegear.errors import InputError
from fegear.rendering.fields import ContactField, MeshScene, contact_field
from fegear.rendering.frames import View
from fegear.rendering.motion_field import instant_field
from fegear.rendering.recorded import Instant, RecordedMotion

SAMPLES = 6  # states that fix the colours of a film


class States(Protocol):
    """What is drawn of a scene, frame by frame or in a single picture."""

    def still(self, view: View) -> ContactField: ...

    def frame(self, number: int, count: int, view: View) -> ContactField: ...

    def samples(self, view: View) -> list[ContactField]:
        """States among which colours and scales of a film are chosen."""
        ...


@dataclass(frozen=True)
class AtRest:
    """A mesh under a torque on its driver [N m], at one or all positions."""

    scene: MeshScene
    torque: float
    position: float = 0.0

    def still(self, view: View) -> ContactField:
        return contact_field(self.scene, self.torque, self.position, view)

    def frame(self, number: int, count: int, view: View) -> ContactField:
        return contact_field(self.scene, self.torque, number / count, view)

    def samples(self, view: View) -> list[ContactField]:
        return [self.frame(i, SAMPLES, view) for i in range(SAMPLES)]


@dataclass(frozen=True)
class InMotion:
    """A recorded motion over its period, or where its mesh force is largest.

    phase : position at the start of the mesh's cycle, see `fegear.gearset.phases`
    """

    scene: MeshScene
    motion: RecordedMotion
    phase: float

    def still(self, view: View) -> ContactField:
        return self._field(self.motion.largest(), view)

    def frame(self, number: int, count: int, view: View) -> ContactField:
        return self._field(self.motion.frames(count)[number], view)

    def samples(self, view: View) -> list[ContactField]:
        return [self._field(instant, view) for instant in self.motion.extremes()]

    def _field(self, instant: Instant, view: View) -> ContactField:
        """Raises InputError where the motion has load and these gears no contact."""
        try:
            return instant_field(self.scene, instant, self.phase, view)
        except ContactFailure as error:
            raise InputError(
                f"{self.motion.source}: {error}; allowed are histories of this gear set"
            ) from None
