"""The contacts of a gear set for the coupled lumped model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache, partial

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from fegear.dynamics.body_modes import (
    body_modes,
    lowest_modes_of_gears,
    static_inertias,
    with_body_modes,
)
from fegear.dynamics.cross_mesh import cross_mesh_compliance
from fegear.dynamics.elastic import ElasticGear
from fegear.dynamics.mesh_load_curves import all_mesh_load_curves, tables_of_equal_teeth
from fegear.dynamics.model import dynamic_model
from fegear.dynamics.sides import ContactSide, MeshLoadCurves, contact_sides
from fegear.dynamics.table_load_curves import all_table_load_curves
from fegear.elasticity.cache import cached_body
from fegear.elasticity.inertia_relief import InertiaRelief, inertia_relief
from fegear.elasticity.sector import RIGHT, CyclicSector
from fegear.gearset.model import GearSet
from fegear.statics.excitation import Excitations
from fegear.statics.given_tables import GivenTables
from fegear.statics.settings import StaticsSettings
from lumped.common.array_types import Array
from lumped.train.coupled import CoupledContacts
from lumped.train.system import LumpedSystem


@lru_cache(maxsize=64)  # equal gears, and all torques
def cached_inertia_relief(sector: CyclicSector, density: float) -> InertiaRelief:
    """`inertia_relief`, read from disk where it was computed before."""
    compute = partial(inertia_relief, sector, density)
    inputs = {"density": density}
    return cached_body("inertia-relief", sector, inputs, compute, InertiaRelief)


def coupled_contacts(
    gear_set: GearSet,
    torque: float,
    reference: LumpedSystem,
    excitations: Excitations | GivenTables,
    without: tuple[str, ...] = (),
    retained: NDArray[np.bool_] | None = None,
) -> CoupledContacts:
    """Contacts of all meshes, in the modal coordinates of a lumped system.

    torque : on the input gear [N m]; reference : Model-1 at that torque
    excitations : finite elements, or tables that give the contacts; inertia
        relief, body modes and compliance across meshes are always of finite elements
    without : which of `lumped.train.coupled.COMPONENTS` are left out
    retained : mask of the body modes to choose, where it is known
    """
    settings = excitations.statics
    if isinstance(excitations, GivenTables):
        load_curves = all_table_load_curves(gear_set, torque, excitations, without)
    else:
        tables = tables_of_equal_teeth(gear_set, torque, excitations)
        load_curves = all_mesh_load_curves(gear_set, tables, settings)
    contacts = contacts_from_load_curves(gear_set, reference, load_curves, settings)
    if "body" not in without:
        sides = contact_sides(gear_set, load_curves)
        gear_mode_sets = lowest_modes_of_gears(gear_set, settings, reference)
        modes = body_modes(gear_set, reference, sides, gear_mode_sets)
        mesh_inertias = static_inertias(gear_set, sides, settings)
        contacts = with_body_modes(
            gear_set, contacts, reference, modes, mesh_inertias, retained
        )
    return replace(contacts, without=without)


def contacts_from_load_curves(
    gear_set: GearSet,
    reference: LumpedSystem,
    load_curves: Sequence[MeshLoadCurves],
    settings: StaticsSettings,
) -> CoupledContacts:
    """Contacts from the load curves of all meshes."""
    normal_cross_mesh = cross_mesh_compliance(gear_set, load_curves, settings)
    cross_mesh = (
        None
        if normal_cross_mesh is None
        else (normal_cross_mesh, np.zeros_like(normal_cross_mesh))
    )
    no_elastic_gears: list[ElasticGear | None] = [None] * len(gear_set.gears)
    model = dynamic_model(
        gear_set, reference, load_curves, no_elastic_gears, cross_mesh
    )
    is_moving, modes = reference.moving, reference.modes
    rotation_shapes = [modes.rotation_of(g) for g in range(len(no_elastic_gears))]
    reliefs = [
        cached_inertia_relief(settings.sector(g), g.density) for g in gear_set.gears
    ]
    inertia_rows = np.concatenate(
        [_inertia_rows(side, reliefs, rotation_shapes) for side in model.sides]
    )
    widths = [gear.toothed_width for gear in gear_set.gears]
    relief_works = [
        relief.work * width for relief, width in zip(reliefs, widths, strict=True)
    ]
    work = np.einsum("g,gi,gj->ij", relief_works, rotation_shapes, rotation_shapes)
    return CoupledContacts(
        contacts=model.contacts,
        mesh_of=model.jacobian.mesh_of,
        pairs=np.array([pair for _, pair, _ in model.contact_labels]),
        paths=np.array(
            [gear_set.engagement(mesh) for mesh in range(len(gear_set.meshes))]
        ),
        rows=np.ascontiguousarray(model.jacobian.normal[..., is_moving]),
        penetration_rate=np.concatenate(
            [_penetration_rate(side, gear_set) for side in model.sides]
        ),
        inertia_rows=inertia_rows[..., is_moving],
        work=work[np.ix_(is_moving, is_moving)],
    )


def _penetration_rate(side: ContactSide, gear_set: GearSet) -> Array:
    """Penetration (k, p + 1) of a side's contacts, see `CoupledContacts`."""
    driver = gear_set.meshes[side.mesh].pair.driver
    return np.asarray(
        side.flank_sign * side.load_curves.moment_arms[..., 0].T / driver.base_radius
    )


def _interpolate_over_arcs(relief: InertiaRelief, values: Array, arcs: Array) -> Array:
    """Values (n,) of a flank's points at arcs (...), not beyond the points."""
    arcs_within = np.clip(arcs, relief.arcs[0], relief.arcs[-1])
    return np.asarray(PchipInterpolator(relief.arcs, values)(arcs_within))


def _inertia_rows(
    side: ContactSide,
    reliefs: Sequence[InertiaRelief],
    rotation_shapes: Sequence[Array],
) -> Array:
    """Penetration (k, p + 1, n) of a side's contacts, see `CoupledContacts`."""
    rows_by_gear = []
    for g in side.gears:
        relief, arcs = reliefs[g], side.arcs(g)
        sine = side.load_curves.turn[..., side.gears.index(g)]
        inward = np.sqrt(1.0 - sine**2) * _interpolate_over_arcs(
            relief, relief.inward, arcs
        )
        inward += sine * _interpolate_over_arcs(relief, relief.rootward, arcs)
        # a clockwise load presses right flanks inward and left flanks outward
        mirror = 1.0 if side.flank == RIGHT else -1.0
        rows_by_gear.append(mirror * inward.T[:, :, None] * rotation_shapes[g])
    return rows_by_gear[0] + rows_by_gear[1]
