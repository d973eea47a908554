"""The contacts of a gear set for the coupled lumped model."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from fegear.dynamics.cross_mesh import cross_mesh_compliance
from fegear.dynamics.model import dynamic_model
from fegear.dynamics.sides import ContactSide, MeshLaws
from fegear.elasticity.inertia_relief import InertiaRelief, inertia_relief
from fegear.elasticity.sector import RIGHT
from fegear.gearset.model import GearSet
from fegear.statics import StaticsSettings
from lumped.coupled import CoupledContacts
from lumped.system import LumpedSystem

Array = NDArray[np.float64]


def coupled_contacts(
    gear_set: GearSet,
    reference: LumpedSystem,
    laws: Sequence[MeshLaws],
    settings: StaticsSettings,
) -> CoupledContacts:
    """Of all meshes, in the modal coordinates of a lumped system.

    reference : Model-1 at the same torque
    """
    far = cross_mesh_compliance(gear_set, laws, settings)
    beside = None if far is None else (far, np.zeros_like(far))
    rigid = [None] * len(gear_set.gears)
    model = dynamic_model(gear_set, reference, laws, rigid, beside)
    moving, modes = reference.moving, reference.modes
    places = modes.coordinates.places
    turns = [modes.shapes[places[g, "rotation"]] for g in range(len(rigid))]
    reliefs = [inertia_relief(settings.sector(g), g.density) for g in gear_set.gears]
    inertial = np.concatenate([_inertial(side, reliefs, turns) for side in model.sides])
    work = sum(
        gear.face_width * relief.work * np.outer(turn, turn)
        for gear, relief, turn in zip(gear_set.gears, reliefs, turns, strict=True)
    )
    return CoupledContacts(
        contacts=model.contacts,
        mesh_of=model.jacobian.mesh_of,
        rows=np.ascontiguousarray(model.jacobian.normal[..., moving]),
        inertial=inertial[..., moving],
        work=work[np.ix_(moving, moving)],
    )


def _inertial(
    side: ContactSide, reliefs: Sequence[InertiaRelief], turns: Sequence[Array]
) -> Array:
    """Penetration (k, p + 1, n) of a side's contacts, see `CoupledContacts`."""
    parts = []
    for g in side.gears:
        relief, arcs = reliefs[g], side.arcs(g)
        inside = np.clip(arcs, relief.arcs[0], relief.arcs[-1])
        inward = PchipInterpolator(relief.arcs, relief.inward)(inside)
        # clockwise loads press right flanks in as they open left ones
        mirror = 1.0 if side.flank == RIGHT else -1.0
        parts.append(mirror * inward.T[:, :, None] * turns[g])
    return parts[0] + parts[1]
