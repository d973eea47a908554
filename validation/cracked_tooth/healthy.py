"""Why potential energy gives stiffer meshes than finite elements, in measured factors.

The ratio of both mean mesh stiffnesses is a product of four, each of two computations
that differ in one respect:

contact        constant contact stiffness over one that depends on load and depth, both
               with the beams and bodies of the potential-energy method
tooth_and_body potential energy over finite elements of pairs that are alone, each under
               its share of the load, both summed like springs in parallel
other_pairs    these pairs alone over all pairs together, by finite elements
corners        contact on the nominal path alone over contact of tip corners as well, by
               finite elements
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fegear.contact.plane.solve import solve_pair_alone
from fegear.gearset.model import GearSet
from fegear.gearset.planes import section_plane
from fegear.statics.mesh_result import StaticsResult
from fegear.statics.settings import StaticsSettings
from fegear.statics.solving import mesh_statics
from lumped.closed_forms.tooth_energy import ToothMaterial, contact_compliance
from lumped.common.array_types import Array
from meshes import GearPair
from validation.oracles import potential_energy, ring
from validation.oracles.cut_tooth import CutTooth
from validation.oracles.potential_energy import ContactLaw

SETTINGS = StaticsSettings(
    positions=64,
    plane="stress",
    estimate_error=False,
    root_stress=False,
    corner_contact=False,
)


@dataclass(frozen=True)
class HealthyPair:
    """A mesh of two external gears under a torque on its driver [N m]."""

    name: str
    gear_set: GearSet
    torque: float
    mesh: int = 0
    settings: StaticsSettings = SETTINGS

    @property
    def pair(self) -> GearPair:
        return self.gear_set.meshes[self.mesh].pair

    @property
    def width(self) -> float:
        return self.gear_set.common_width(self.mesh)

    @property
    def force(self) -> float:
        """Normal force of the mesh [N]."""
        return self.torque / self.pair.driver.base_radius

    @property
    def teeth(self) -> tuple[CutTooth, CutTooth]:
        """Teeth of driver and driven gear."""
        spec = self.gear_set.meshes[self.mesh]
        gears = self.gear_set.gears
        return CutTooth(gears[spec.driver]), CutTooth(gears[spec.driven])

    @property
    def contact_compliance(self) -> float:
        """Constant of Yang and Sun (1985) [m/N]."""
        first, second = (ToothMaterial(*tooth.material) for tooth in self.teeth)
        return contact_compliance(first, second, self.width)

    @property
    def positions(self) -> Array:
        """Base pitches from the pitch point, (n,)."""
        return np.arange(self.settings.positions) / self.settings.positions

    def energy_stiffness(self, contact_law: ContactLaw) -> Array:
        """Mesh stiffness by potential energy at the positions, (n,) [N/m]."""
        return potential_energy.mesh_stiffness(
            *self.teeth,
            self.pair.operating_pressure_angle,
            self.positions,
            self.force,
            self.width,
            contact_law=contact_law,
        )

    def solved(self, corner_contact: bool) -> StaticsResult:
        """Mesh at the positions, by finite elements."""
        settings = replace(self.settings, corner_contact=corner_contact)
        return mesh_statics(self.gear_set, self.mesh, [self.torque], settings)

    @cached_property
    def on_path(self) -> StaticsResult:
        """Mesh with contact on the nominal path alone, by finite elements."""
        return self.solved(corner_contact=False)

    @cached_property
    def lone_pairs(self) -> Array:
        """Stiffness of each pair alone under its share of the load, (n, k) [N/m].

        Zero where it carries none.
        """
        cycle, problem = self.on_path.cycle, self.on_path.problem
        stiffness = np.zeros(cycle.load.shape[1:])
        for i, k in np.argwhere(cycle.load[0] > 0.0):
            torque = self.torque * cycle.load_share[0, i, k]
            pair = int(cycle.teeth[k])
            alone = solve_pair_alone(problem, torque, cycle.position[i], pair)
            stiffness[i, k] = alone.stiffness[0, 0]
        return stiffness

    @property
    def body_twist(self) -> float:
        """Twist of both bodies on their hubs along the line of action [m/N]."""
        return sum(1.0 / self._twist_stiffness(tooth) for tooth in self.teeth)

    def _twist_stiffness(self, tooth: CutTooth) -> float:
        E, nu = tooth.material
        body = ring.Ring(
            hub_radius=tooth.teeth.hub_radius,
            outer_radius=tooth.teeth.root_radius,
            shear_modulus=ring.shear_modulus(E, nu),
            face_width=self.width,
        )
        return ring.line_of_action_stiffness(body, tooth.base_radius)


@dataclass(frozen=True, kw_only=True)
class StiffnessFactors:
    """Mean stiffness by potential energy over that by finite elements.

    energy, elements : mean mesh stiffnesses [N/m]
    contact, tooth_and_body, other_pairs, corners : factors, see the module
    twist : part of other_pairs that is the twist of the bodies, which pairs share and
        the body formula counts for each
    """

    name: str
    energy: float
    elements: float
    contact: float
    tooth_and_body: float
    other_pairs: float
    corners: float
    twist: float

    @property
    def ratio(self) -> float:
        """Ratio of both mean stiffnesses; the product of the factors."""
        return self.energy / self.elements


def stiffness_factors(pair: HealthyPair) -> StiffnessFactors:
    """Both mean mesh stiffnesses of a pair, and what accounts for their ratio."""
    linear = float(pair.energy_stiffness("linear").mean())
    deep = float(
        pair.energy_stiffness(
            section_plane(pair.settings.plane_of(pair.gear_set))
        ).mean()
    )
    alone = pair.lone_pairs.sum(axis=1)
    pairs = (pair.lone_pairs > 0.0).sum(axis=1)
    shared_twist = 1.0 / (1.0 / alone + pair.body_twist * (1.0 - 1.0 / pairs))
    together = float(pair.on_path.cycle.stiffness.mean())
    elements = float(pair.solved(corner_contact=True).cycle.stiffness.mean())
    return StiffnessFactors(
        name=pair.name,
        energy=linear,
        elements=elements,
        contact=linear / deep,
        tooth_and_body=deep / float(alone.mean()),
        other_pairs=float(alone.mean()) / together,
        corners=together / elements,
        twist=float(alone.mean() / shared_twist.mean()),
    )
