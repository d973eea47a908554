"""Drop of mesh stiffness over the depth of a root crack, by finite elements."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

from fegear.contact.plane.solve import solve_pair_alone
from fegear.contact.problem import ContactProblem
from fegear.contact.solve import solve_cycle
from fegear.gearset.faults.tooth_faults import Faults, ToothCrack
from fegear.gearset.model import GearSet
from fegear.statics.contact_problem import contact_problem
from lumped.common.array_types import Array
from meshes.crack import Crack
from validation.cracked_tooth.drops import (
    CRACK_ANGLE,
    TANGENT_ANGLE,
    StiffnessDrop,
    path_positions,
    stiffness_drop,
)
from validation.cracked_tooth.healthy import HealthyPair


@dataclass(frozen=True)
class ElementDrop:
    """Drop of mesh stiffness by finite elements.

    tangent_angle : between the centre line and the fillet where the crack begins [rad]
    crack_angle : between the crack and the centre line [rad]
    corner_contact : of tips outside the nominal path
    """

    pair: HealthyPair
    tangent_angle: float = TANGENT_ANGLE
    crack_angle: float = CRACK_ANGLE
    corner_contact: bool = True

    def __call__(self, depth: float) -> StiffnessDrop:
        """Drop at a depth of the crack [m]."""
        problem = self._cracked_problem(depth)
        added = self._alone(problem) - self._alone(self._healthy)
        stiffness = self._mesh_stiffness(problem)
        return stiffness_drop(self._healthy_stiffness, stiffness, added)

    @cached_property
    def _healthy(self) -> ContactProblem:
        return self._cracked_problem(0.0)

    @cached_property
    def _healthy_stiffness(self) -> Array:
        return self._mesh_stiffness(self._healthy)

    def _cracked_problem(self, depth: float) -> ContactProblem:
        pair = self.pair
        settings = replace(pair.settings, corner_contact=self.corner_contact)
        return contact_problem(self._gear_set(depth), pair.mesh, settings)

    def _gear_set(self, depth: float) -> GearSet:
        """The reference tooth of the driver cracked at its loaded root."""
        gear_set = self.pair.gear_set
        if depth == 0.0:
            return gear_set
        crack = Crack(
            depth=depth, tangent_angle=self.tangent_angle, direction=self.crack_angle
        )
        driver = gear_set.meshes[self.pair.mesh].driver
        gears = list(gear_set.gears)
        faults = Faults(cracks=(ToothCrack(tooth=0, crack=crack),))
        gears[driver] = replace(gears[driver], faults=faults)
        return replace(gear_set, gears=tuple(gears))

    def _mesh_stiffness(self, problem: ContactProblem) -> Array:
        """Stiffness of all pairs at `path_positions`, (1 + n,) [N/m]."""
        cycle = solve_cycle(problem, [self.pair.torque], path_positions(self.pair))
        return cycle.stiffness[0]

    def _alone(self, problem: ContactProblem) -> float:
        """Compliance of the reference pair alone at the pitch point [m/N]."""
        alone = solve_pair_alone(problem, self.pair.torque, 0.0)
        return float(1.0 / alone.stiffness[0, 0])
