"""Linear equations of machines in space, in all coordinates of their shafts."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fegear.train.loaded_modes import LinearModel, SpaceTerms
from lumped.common.checks import require_present
from lumped.rotors.beams import AXIAL_COORDINATE, NODE_COORDINATES
from lumped.rotors.bearing_matrices import forces_at_rest
from lumped.rotors.housing import NODE_COORDINATES as HOUSING_COORDINATES
from lumped.rotors.mesh_springs import rigid_motions
from lumped.rotors.rest import modes_at_rest
from lumped.train.space import MotionInSpace
from lumped.train.system import LumpedSystem
from lumped.train.width_springs import mean_loads_of_gaps


def linear_model_in_space(system: LumpedSystem) -> LinearModel:
    """Linear equations of motion about mean mesh stiffnesses.

    Parameters
    ----------
    system : LumpedSystem
        Train whose gears move in space.

    Returns
    -------
    LinearModel
        Matrices in the coordinates of all nodes of the shafts, not reduced, with the
        gyroscopic one.
    """
    space = require_present(system.space, "motion in space")
    matrices = space.matrices
    squares, shapes = modes_at_rest(matrices)
    angular = np.sqrt(np.maximum(squares, 0.0))
    momentum = matrices.mass @ shapes
    modal = (momentum * (2.0 * system.train.damping_ratio * angular)) @ momentum.T
    load = np.array([gear.torque for gear in system.train.gears]) @ space.rotations
    load += forces_at_rest(matrices, space.system)
    rows = np.stack(
        [
            law_rows @ rigid_motions(matrices, mesh)
            for law_rows, mesh in zip(
                space.mesh_motions, space.system.meshes, strict=True
            )
        ]
    )
    offsets = np.array([mean_loads_of_gaps(one) for one in system.excitations])
    elastic = angular > 0.0
    # gaps of teeth act as loads on springs that are always pressed together
    at_rest = load + np.einsum("mk,mkn->n", offsets, rows)
    of_modes = (shapes[:, elastic].T @ at_rest) / squares[elastic]
    displacement = shapes[:, elastic] @ of_modes
    stiffness = system.modes.mean_stiffness
    return LinearModel(
        labels=tuple(_labels(space)),
        mass=matrices.mass,
        damping=matrices.damping + modal,
        stiffness=matrices.stiffness,
        load=load,
        displacement=displacement,
        mesh_rows=rows[:, 0],
        mesh_stiffness=stiffness,
        mesh_force=stiffness * (rows[:, 0] @ displacement) - offsets[:, 0],
        frequency_Hz=angular / (2.0 * np.pi),
        in_space=SpaceTerms(matrices.gyroscopic, rows[:, 1], space.tilt_stiffness),
    )


def _labels(space: MotionInSpace) -> Iterator[tuple[str, str]]:
    """Shaft and place of every coordinate, and its direction."""
    system = space.system
    places = [
        f"{rotor.name} at {1e3 * position:.6g} mm"
        for rotor, positions in zip(system.rotors, space.matrices.nodes, strict=True)
        for position in positions
    ]
    for place in places:
        yield from ((place, kind) for kind in NODE_COORDINATES)
    yield from ((place, AXIAL_COORDINATE) for place in places)
    if system.housing is None:
        return
    nodes = range(1, len(system.housing.nodes) + 1)
    for node in nodes:
        yield from ((f"housing node {node}", kind) for kind in HOUSING_COORDINATES)
    modes = system.housing.size - len(nodes) * len(HOUSING_COORDINATES)
    yield from (("housing", f"mode {number}") for number in range(1, modes + 1))
