"""A pair of gears as the cases ask of it, with its finite elements solved once."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from fegear.contact.plane.solve import solve_pair_alone
from fegear.contact.result import ContactCycle
from fegear.contact.solve import solve_cycle
from fegear.gearset.model import Gear, GearSet
from fegear.gearset.planes import Plane
from fegear.statics.mesh_result import StaticsResult
from fegear.statics.settings import StaticsSettings
from fegear.statics.solving import solve_mesh
from meshes import GearPair
from validation.oracles.potential_energy import AnalyticGear

POSITIONS = 64  # of the mesh cycle
GEOMETRY = (
    *("teeth", "module", "pressure_angle", "profile_shift", "tooth_thinning"),
    *("tip_radius", "root_radius", "hub_radius"),
)


@dataclass(frozen=True, eq=False)
class LoadedPair:
    """Two gears and their torque; the driver is the pinion.

    inputs : numbers of the source that a gear set has no key for
    """

    gear_set: GearSet
    inputs: Mapping[str, Any] = field(default_factory=dict)

    @property
    def pair(self) -> GearPair:
        return self.gear_set.meshes[0].pair

    @property
    def gears(self) -> tuple[Gear, Gear]:
        pinion, wheel = self.gear_set.gears
        return pinion, wheel

    @property
    def analytic(self) -> tuple[AnalyticGear, AnalyticGear]:
        """Both gears as the potential-energy method describes them."""
        pinion, wheel = map(_analytic, self.gears)
        return pinion, wheel

    @property
    def teeth(self) -> tuple[int, int]:
        return self.pair.driver.teeth, self.pair.driven.teeth

    @property
    def shifts(self) -> tuple[float, float]:
        return self.pair.driver.profile_shift, self.pair.driven.profile_shift

    @property
    def width(self) -> float:
        return self.gear_set.common_width(0)

    @property
    def torque(self) -> float:
        """On the pinion [N m]."""
        return self.gear_set.meshes[0].torques[0]

    @property
    def force(self) -> float:
        """Normal force of the mesh [N]."""
        return self.torque / self.pair.driver.base_radius

    @cached_property
    def _statics_by_plane(self) -> dict[Plane, StaticsResult]:
        return {}

    def solved(self, plane: Plane = "stress") -> StaticsResult:
        """The mesh by finite elements, frictionless."""
        if plane not in self._statics_by_plane:
            settings = StaticsSettings(
                plane=plane,
                positions=POSITIONS,
                estimate_error=False,
                root_stress=False,
            )
            self._statics_by_plane[plane] = solve_mesh(self.gear_set, settings=settings)
        return self._statics_by_plane[plane]

    def at(self, position: float, plane: Plane = "stress") -> ContactCycle:
        """Contact at a position, base pitches past the pitch point."""
        solved = self.solved(plane)
        return solve_cycle(
            solved.problem, solved.cycle.torque, position - math.floor(position)
        )

    def one_pair(self, plane: Plane = "stress") -> ContactCycle:
        """Contact of one pair at the pitch point that carries all the load."""
        return solve_pair_alone(self.solved(plane).problem, self.torque, 0.0)


def _analytic(gear: Gear) -> AnalyticGear:
    return AnalyticGear(
        **{name: getattr(gear.geometry, name) for name in GEOMETRY},
        young_modulus=gear.young_modulus,
        poisson_ratio=gear.poisson_ratio,
    )
