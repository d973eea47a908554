"""Natural modes of a gear set by the model that is right, about its loaded state."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fegear.gearset.model import GearSet
from fegear.train.lumped_models import lumped_system
from fegear.train.model_settings import LumpedModel, resolve_model
from lumped.common.array_types import Array
from lumped.common.checks import require_present
from lumped.train.modes import Modes
from lumped.train.system import LumpedSystem


def system_of_modes(
    gear_set: GearSet, torque: float, model: LumpedModel
) -> tuple[LumpedSystem, str]:
    """The system whose natural frequencies are those of a gear set, and why it is.

    The coupled model, or model 1 where something needs that, by `resolve_model`.

    Parameters
    ----------
    gear_set : GearSet
        Gear set of the train.
    torque : float
        Torque on the input gear [N m].
    model : LumpedModel
        Translations, damping ratio and source of the mesh stiffness; its number, its
        friction and what it has of bearings are not read.

    Returns
    -------
    system : LumpedSystem
        System at the torque, with linear bearings.
    reason : str
        Reason for the choice of its model.
    """
    chosen_model = LumpedModel(
        number="auto",
        translations=model.translations,
        bearings="linear",
        damping_ratio=model.damping_ratio,
        excitation=model.excitation,
    )
    chosen_model, reason = resolve_model(chosen_model, gear_set)
    return lumped_system(gear_set, torque, chosen_model), reason


@dataclass(frozen=True, eq=False)
class SpaceTerms:
    """What machines in space have besides, of n coordinates and m meshes.

    gyroscopic : (n, n) forces over velocities, per speed of the first mesh's driver
    tilt_rows : (m, n) difference of the slopes of both gears along the push
    tilt_stiffness : (m,) mean moment over it [N m/rad]
    """

    gyroscopic: Array
    tilt_rows: Array
    tilt_stiffness: Array


@dataclass(frozen=True, eq=False)
class LinearModel:
    """Linear equations of motion M x'' + C x' + K x = load of a train.

    labels : of the n coordinates, such as ("pinion", "rotation"); vibration of the
        bodies against their hubs has coordinates of unit mass
    mass, damping, stiffness : (n, n)
    load : (n,) from outside
    displacement : (n,) at rest, mean over a mesh cycle
    mesh_rows : (m, n) deflection of the meshes by the hubs
    mesh_stiffness : (m,) mean over a mesh cycle [N/m]
    mesh_force : (m,) at rest, mean over a mesh cycle [N]
    frequency_Hz : (n,) natural frequencies
    in_space : of gears that move in space, else None
    """

    labels: tuple[tuple[str, str], ...]
    mass: Array
    damping: Array
    stiffness: Array
    load: Array
    displacement: Array
    mesh_rows: Array
    mesh_stiffness: Array
    mesh_force: Array
    frequency_Hz: Array
    in_space: SpaceTerms | None = None


def linear_model_of_springs(modes: Modes, damping_ratio: float) -> LinearModel:
    """Linear equations of motion of a train whose meshes are springs.

    Parameters
    ----------
    modes : Modes
        Modes about the mean stiffnesses of the meshes.
    damping_ratio : float
        Damping ratio of every mode.

    Returns
    -------
    LinearModel
        Matrices in the coordinates of the train.
    """
    coordinates, is_held = modes.coordinates, modes.angular > 0.0
    load = modes.shapes[:, is_held].T @ coordinates.load
    displacement = modes.shapes[:, is_held] @ (load / modes.angular[is_held] ** 2)
    return LinearModel(
        labels=coordinates.labels,
        mass=np.diag(coordinates.mass),
        damping=modes.damping_matrix(damping_ratio),
        stiffness=modes.stiffness_matrix,
        load=coordinates.load,
        displacement=displacement,
        mesh_rows=coordinates.mesh_rows,
        mesh_stiffness=modes.mean_stiffness,
        mesh_force=modes.mean_stiffness * (coordinates.mesh_rows @ displacement),
        frequency_Hz=modes.frequency_Hz,
    )


def linear_model(system: LumpedSystem) -> LinearModel:
    """Linear equations of motion of a coupled model about its loaded state.

    Parameters
    ----------
    system : LumpedSystem
        System of the coupled model.

    Returns
    -------
    LinearModel
        Matrices whose natural frequencies are those of `modes_under_load`.
    """
    arrays = require_present(system.coupled_arrays, "coupled model")
    loaded_state = require_present(system.loaded, "loaded state")
    fixed_modes = _fixed_modes(system)
    to_modal = np.linalg.inv(_coordinate_shapes(system))
    fixed_angular = system.modes.angular[fixed_modes]

    def in_coordinates(fixed_diagonal: Array, moving_matrix: Array) -> Array:
        size = fixed_modes.size
        matrix = np.zeros((len(to_modal), len(to_modal)))
        matrix[:size, :size] = np.diag(fixed_diagonal)
        matrix[size:, size:] = moving_matrix
        return np.asarray(to_modal.T @ matrix @ to_modal)

    mean_coordinates = loaded_state.coordinates[:-1].mean(axis=0)
    displacement_at_rest = np.concatenate(
        [_displacement_of_fixed_modes(system), mean_coordinates]
    )
    contact_load, modes = loaded_state.load[:-1].mean(axis=0), modes_under_load(system)
    meshes = range(len(system.excitations))
    return LinearModel(
        labels=_coordinate_labels(system),
        mass=in_coordinates(
            np.ones(fixed_modes.size), np.eye(len(to_modal) - fixed_modes.size)
        ),
        damping=in_coordinates(
            2.0 * system.train.damping_ratio * fixed_angular, arrays.damping
        ),
        stiffness=in_coordinates(
            fixed_angular**2, loaded_state.springs + loaded_state.meshes.sum(axis=0)
        ),
        load=modes.coordinates.load,
        displacement=_coordinate_shapes(system) @ displacement_at_rest,
        mesh_rows=modes.coordinates.mesh_rows,
        mesh_stiffness=modes.mean_stiffness,
        frequency_Hz=modes.frequency_Hz,
        mesh_force=np.array(
            [contact_load[loaded_state.mesh_of == m].sum() for m in meshes]
        ),
    )


def modes_under_load(system: LumpedSystem) -> Modes:
    """Modes of the coupled model about its loaded state.

    Mean stiffnesses are tangents of the meshes.

    Parameters
    ----------
    system : LumpedSystem
        System of the coupled model.

    Returns
    -------
    Modes
        Modes in the coordinates of the train and of the vibration of the bodies.
    """
    contacts = require_present(system.contacts, "coupled model")
    loaded_state = require_present(system.loaded, "loaded state")
    modes, fixed_modes = system.modes, _fixed_modes(system)
    bodies, space = contacts.body_modes, modes.coordinates
    # of bodies that yield as they do at rest, without loads by their inertia
    left_out_parts = tuple({*contacts.without, "body"})
    system_without_inertia = replace(
        system, contacts=replace(contacts, modes=None, without=left_out_parts)
    )
    static_state = require_present(system_without_inertia.loaded, "loaded state")
    mesh_deflections = system.arrays.shapes
    modal_stiffness = np.einsum(
        "mi,mij,mj->m", mesh_deflections, static_state.meshes, mesh_deflections
    )
    frequency = np.concatenate(
        [modes.frequency_Hz[fixed_modes], loaded_state.frequency_Hz]
    )
    mode_order = np.argsort(frequency, kind="stable")
    shapes = _shapes_of_all_modes(fixed_modes.size, loaded_state.shapes)[:, mode_order]
    hubs = (bodies.to_unit @ loaded_state.shapes)[: system.moving.size]
    return Modes(
        coordinates=replace(
            space,
            labels=_coordinate_labels(system),
            mass=np.append(space.mass, np.ones(bodies.count)),
            load=np.append(space.load, np.zeros(bodies.count)),
            mesh_rows=np.pad(space.mesh_rows, ((0, 0), (0, bodies.count))),
            spring_rows=np.pad(space.spring_rows, ((0, 0), (0, bodies.count))),
            gyroscopic=np.pad(space.gyroscopic, (0, bodies.count)),
            centripetal=np.pad(space.centripetal, (0, bodies.count)),
        ),
        mean_stiffness=modal_stiffness / (mesh_deflections**2).sum(axis=1) ** 2,
        frequency_Hz=frequency[mode_order],
        shapes=_coordinate_shapes(system) @ shapes,
        mesh_shapes=np.hstack(
            [modes.mesh_shapes[:, fixed_modes], mesh_deflections @ hubs]
        )[:, mode_order],
        mesh_energy=np.hstack(
            [modes.mesh_energy[:, fixed_modes], loaded_state.mesh_energy]
        )[:, mode_order],
    )


def mesh_stiffness_of_modes(system: LumpedSystem, modes: Modes) -> Array:
    """Tangent stiffness of each mesh in the modes about the loaded state.

    Parameters
    ----------
    system : LumpedSystem
        System of the coupled model.
    modes : Modes
        Its `modes_under_load`.

    Returns
    -------
    (m, n, n) array
        Stiffness [1/s2].
    """
    loaded_state = require_present(system.loaded, "loaded state")
    modal_shapes = np.linalg.solve(_coordinate_shapes(system), modes.shapes)[
        _fixed_modes(system).size :
    ]
    return np.asarray(modal_shapes.T @ loaded_state.meshes @ modal_shapes)


def averages_of_modes(system: LumpedSystem, modes: Modes) -> list[float | None]:
    """Natural frequency about the averages of model 1 for each mode under load.

    Modes in which the gears move alike on average belong together, so that the sum of
    their likenesses is the largest.

    Parameters
    ----------
    system : LumpedSystem
        System of the coupled model.
    modes : Modes
        Its `modes_under_load`.

    Returns
    -------
    list of float or None
        Frequency [Hz] for each mode, None for those of the bodies that model 1 has not.
    """
    from scipy.optimize import linear_sum_assignment

    rigid_modes, moving = system.modes, system.moving
    bodies = require_present(system.contacts, "coupled model").body_modes
    hub_shapes, body_shapes = np.split(
        modes.shapes, [rigid_modes.coordinates.mass.size]
    )
    # mean motions of hubs and bodies, in which the momentum is that of rigid gears
    mean_motion = rigid_modes.shapes.T @ (
        rigid_modes.coordinates.mass[:, None] * hub_shapes
    )
    mean_motion[moving] += bodies.coupling.T @ body_shapes
    likeness = mean_motion**2
    rigid_indices, loaded_indices = linear_sum_assignment(-likeness)
    averages: list[float | None] = [None] * modes.frequency_Hz.size
    for i, j in zip(rigid_indices.tolist(), loaded_indices.tolist(), strict=True):
        averages[j] = float(rigid_modes.frequency_Hz[i])
    return averages


def _fixed_modes(system: LumpedSystem) -> NDArray[np.intp]:
    """Modes that strain no mesh, which take no part in motions."""
    return np.setdiff1d(np.arange(system.modes.frequency_Hz.size), system.moving)


def _coordinate_shapes(system: LumpedSystem) -> Array:
    """Displacement (n, n) of hubs and bodies per modal coordinate of unit mass.

    Coordinates are the modes that strain no mesh, then those of the coupled model.
    """
    bodies = require_present(system.contacts, "coupled model").body_modes
    modes, fixed_modes, moving = system.modes, _fixed_modes(system), system.moving
    hubs = modes.shapes[:, moving] @ bodies.to_unit[: moving.size]
    no_displacement = np.zeros((bodies.count, fixed_modes.size))
    return np.block(
        [
            [modes.shapes[:, fixed_modes], hubs],
            [no_displacement, bodies.to_unit[moving.size :]],
        ]
    )


def _shapes_of_all_modes(n_fixed: int, shapes: Array) -> Array:
    """Shapes (n, n) of all modes, of which the first strain no mesh."""
    size = n_fixed + len(shapes)
    all_shapes = np.zeros((size, size))
    all_shapes[:n_fixed, :n_fixed] = np.eye(n_fixed)
    all_shapes[n_fixed:, n_fixed:] = shapes
    return all_shapes


def _displacement_of_fixed_modes(system: LumpedSystem) -> Array:
    """Displacement at rest of modes that strain no mesh, without free motions."""
    modes, fixed_modes = system.modes, _fixed_modes(system)
    load = modes.shapes[:, fixed_modes].T @ modes.coordinates.load
    squared_angular = modes.angular[fixed_modes] ** 2
    return np.divide(
        load, squared_angular, out=np.zeros_like(load), where=squared_angular > 0.0
    )


def _coordinate_labels(system: LumpedSystem) -> tuple[tuple[str, str], ...]:
    """Names of coordinates: of the train, then of the bodies' vibration."""
    bodies = require_present(system.contacts, "coupled model").body_modes
    names = [_body_name(system, i) for i in range(bodies.count)]
    return (*system.modes.coordinates.labels, *names)


def _body_name(system: LumpedSystem, i: int) -> tuple[str, str]:
    """Gear, and the number of nodal diameters."""
    bodies = require_present(system.contacts, "coupled model").body_modes
    gear, n = system.train.gears[int(bodies.gears[i])], int(bodies.nodal_diameters[i])
    diameters = "1 nodal diameter" if n == 1 else f"{n} nodal diameters"
    return gear.name, f"body, {diameters}" if n else "body against its hub"
