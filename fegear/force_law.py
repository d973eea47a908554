"""The force of a mesh over deflection and position, solved by finite elements.

With the elastic inertia of the gears left out, this law and the hubs' freedoms are
the whole motion: quasi-static fidelity.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from fegear.contact.instants import contact_at
from fegear.contact.problem import ContactProblem
from fegear.excitation import Excitations
from fegear.gearset.model import GearSet
from fegear.statics import RESOLUTIONS, contact_problem
from lumped.excitation import MeshExcitation, excitation_from_law

Array = NDArray[np.float64]
# deflections over the largest static one: dense where gears at rest are, since a
# chord errs with the square of its length
FINE, COARSE, REACH = 0.05, 0.25, 6.0


def deflection_grid(static: float) -> Array:
    """Deflections [m] for a largest static transmission error [m].

    The first lies just before unmodified flanks touch.
    """
    fine = np.arange(0.0, 1.6, FINE)
    coarse = np.arange(1.6, REACH + COARSE, COARSE)
    return static * np.concatenate([[-1e-6], fine, coarse])


def force_law(problem: ContactProblem, deflections: Array, positions: int) -> Array:
    """Mesh force (positions, deflections) [N]: torque over the driver's base radius."""
    x, s = np.meshgrid(np.arange(positions) / positions, deflections, indexing="ij")
    found = contact_at(problem, x.ravel(), s.ravel())
    return found.torque.reshape(x.shape) / problem.pair.driver.base_radius


@dataclass(frozen=True)
class LawExcitations:
    """Laws in place of the models' springs.

    Natural frequencies and damping stand on the mean stiffness of the mesh table of
    unmodified teeth, as for Model-1. Back flanks are not part of the law.
    """

    excitations: Excitations = field(default_factory=Excitations)

    def of(
        self, gear_set: GearSet, mesh: int, torque: float, model: int = 1
    ) -> MeshExcitation:
        """Of a mesh by its index, around a torque on its driver [N m]."""
        source = self.excitations.source
        resolution = RESOLUTIONS[source.resolution]
        problem = contact_problem(gear_set, mesh, source.statics, resolution)
        table = self.excitations.table(gear_set, mesh, torque)
        deflections = deflection_grid(float(table["ste_m"].max()))
        force = force_law(problem, deflections, source.positions)
        mean = self.excitations.of(gear_set, mesh, torque, 1).mean_stiffness
        return excitation_from_law(deflections, force, mean)
