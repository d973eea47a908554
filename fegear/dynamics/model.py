"""A gear set in motion as arrays for the implicit steps.

Hub freedoms are the modes of the rigid train on its mean mesh stiffness, so that
damping is that of the lumped models; the mesh stiffness itself is taken out again
and contact put in its place. Elastic freedoms are the modes of each gear with its hub
held, in a frame that turns with the gear; gyroscopic and centrifugal terms are left
out, and so is the momentum of a gear's elastic modes on its bearings. What the
modes lack of the static compliance stays in the contact laws, so that statics are
those of the finite elements whatever modes are kept.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fegear.dynamics.elastic import ElasticGear, elastic_body
from fegear.dynamics.kernels.step_arrays import (
    ContactJacobian,
    Kinematics,
    ModalMatrices,
    ModelArrays,
)
from fegear.dynamics.load_curves import assemble_contacts
from fegear.dynamics.rows import contact_rows, is_supported
from fegear.dynamics.sides import ContactSide, MeshLoadCurves, contact_sides
from fegear.gearset.model import GearSet
from fegear.gearset.phases import rolling_senses
from fegear.gearset.position_errors import position_gaps
from lumped.common.array_types import Array
from lumped.kernels.arrays import Contacts
from lumped.train.system import LumpedSystem


@dataclass(frozen=True, eq=False)
class DynamicModel:
    """Arrays for the kernels, which describe them, and the train of the model."""

    reference: LumpedSystem
    sides: tuple[ContactSide, ...]
    modal: ModalMatrices
    jacobian: ContactJacobian
    kinematics: Kinematics
    contacts: Contacts

    @property
    def arrays(self) -> ModelArrays:
        """The arrays of the model that the kernels take."""
        return ModelArrays(self.modal, self.jacobian, self.kinematics, self.contacts)

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return self.modal.damping.size + self.modal.rigidity.size

    @property
    def limit(self) -> float:
        """Sum of velocities beyond which a motion has diverged."""
        return self.reference.limit * max(1.0, self.size)

    @property
    def contact_count(self) -> int:
        """Number of contacts, tooth pairs of all meshes and sides."""
        return self.contacts.side.size

    @property
    def contact_labels(self) -> list[tuple[int, int, int]]:
        """(mesh, pair, side) of each contact."""
        return [
            (side.mesh, int(k), side.flank_sign)
            for side in self.sides
            for k in side.load_curves.pair_offsets
        ]


def dynamic_model(
    gear_set: GearSet,
    reference: LumpedSystem,
    load_curves: Sequence[MeshLoadCurves],
    elastic: Sequence[ElasticGear | None],
    cross_mesh_compliance: tuple[Array, Array] | None = None,
) -> DynamicModel:
    """Assemble; elastic holds None for gears that are rigid but for their contact.

    reference : the lumped system at the same torque, whose mean stiffnesses give
        the modes that have the damping ratio
    cross_mesh_compliance : (p, c, c) penetration of a contact per normal, and per
        tangential, load on another that load curves and modes do not have [m/N]
    """
    sides = contact_sides(gear_set, load_curves)
    modal = modal_matrices(gear_set, reference, elastic)
    jacobian = contact_rows(
        gear_set, reference, sides, elastic, load_curves[0].friction
    )
    return DynamicModel(
        reference=reference,
        sides=tuple(sides),
        modal=modal,
        jacobian=jacobian,
        kinematics=_kinematics(gear_set, reference),
        contacts=assemble_contacts(
            *(sides, jacobian, modal, cross_mesh_compliance),
            position_gaps(gear_set, reference.train),
        ),
    )


def modal_matrices(
    gear_set: GearSet,
    reference: LumpedSystem,
    elastic: Sequence[ElasticGear | None],
) -> ModalMatrices:
    """Inertia, elasticity and loads of hubs and elastic modes."""
    modes, ratio = reference.modes, reference.train.damping_ratio
    space, angular = modes.coordinates, modes.angular
    mean = modes.mean_stiffness[:, None, None]
    meshes = modes.mesh_shapes[:, :, None] * modes.mesh_shapes[:, None, :]
    stiffness = np.diag(angular**2) - (mean * meshes).sum(axis=0)
    parts = [elastic_body(g, gear) for g, gear in enumerate(elastic)]
    count = 0
    for part in parts:
        part["partner"] = part["partner"] + count
        count += part["rigidity"].size
    arrays = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    senses = np.array(rolling_senses(gear_set), float)
    arrays["sine"] = arrays["sine"] * senses[arrays["gear_of_mode"]]
    return ModalMatrices(
        stiffness=stiffness,
        damping=2.0 * ratio * angular,
        load=is_supported(reference) * (modes.shapes.T @ space.load),
        rotation=np.stack([modes.rotation_of(g) for g in range(len(gear_set.gears))]),
        **arrays,
    )


def _kinematics(gear_set: GearSet, reference: LumpedSystem) -> Kinematics:
    train = reference.train
    gears = np.array([(mesh.driver, mesh.driven) for mesh in gear_set.meshes])
    members = range(len(gear_set.gears))
    # 0 for a gear without mesh, such as a flywheel: it has no contacts
    first_mesh = [int(np.argmax((gears == g).any(axis=1))) for g in members]
    teeth = gear_set.gears[gear_set.meshes[0].driver].geometry.teeth
    deflection = is_supported(reference) * reference.modes.mesh_shapes
    return Kinematics(
        rate=np.array([float(rate) for rate in train.mesh_rates]),
        gears=gears,
        first_mesh=np.array(first_mesh),
        speed=np.array([float(s) for s in train.speeds]) / teeth,
        deflection=np.ascontiguousarray(deflection),
    )
