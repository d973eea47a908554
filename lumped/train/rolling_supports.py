"""Rolling bearings of a train: their springs under load, and their forces in modes."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lumped.bearings.kinematics import cage_over_shaft
from lumped.bearings.rolling import BallBearing, RollerBearing
from lumped.bearings.statics import MIN_LOAD, RingSupport, mean_support
from lumped.common.array_types import Array
from lumped.common.checks import check_arguments, require_present
from lumped.kernels.arrays import BearingSamples, ExcitationSamples, ModalSystem
from lumped.train.bodies import Gear, TrainError
from lumped.train.coordinates import rigid_groups, train_coordinates
from lumped.train.modes import Modes
from lumped.train.train import Train

UNIT_STIFFNESS = (1.0, 1.0)  # N/m, of gears whose load alone is looked for
BALANCE_RTOL = 1e-6  # of torques that forces of meshes and shafts balance
LOAD_RTOL = 1e-9  # load of a bearing over the mesh forces that is round-off
MAX_ITERATIONS = 100
EQUILIBRIUM_RTOL = 1e-11  # of the loads


@check_arguments
def linearise_bearings(train: Train) -> Train:
    """Give gears on rolling bearings the bearings' stiffnesses under load.

    Parameters
    ----------
    train : Train
        Train with `rolling_bearing` on one gear or more.

    Returns
    -------
    Train
        The train with `bearing_stiffness` and `bearing_direction` of these gears: along
        the load on the bearing and across it, means over the positions of the cage.

    Raises
    ------
    TrainError
        If a bearing has no load, gears on one rigid shaft have different bearings or
        the train has a carrier.
    """
    gears = list(train.gears)
    gears_on_rolling_bearings = [
        i for i, gear in enumerate(gears) if gear.rolling_bearing is not None
    ]
    if not gears_on_rolling_bearings:
        return train
    _require_statically_determined(train)
    loads = bearing_loads(train)
    for i in gears_on_rolling_bearings:
        load = float(np.hypot(*loads[i]))
        if load < MIN_LOAD:
            raise TrainError(
                f"gear {gears[i].name!r}: its rolling bearing has no load, under which "
                "its stiffness would be 0"
            )
        gears[i] = _with_linear_bearing(gears[i], loads[i])
    return replace(train, gears=tuple(gears))


def _with_linear_bearing(gear: Gear, load: Array) -> Gear:
    bearing = require_present(gear.rolling_bearing, "rolling_bearing")
    support = mean_support(bearing, float(np.hypot(*load)))
    return replace(
        gear,
        bearing_stiffness=(support.along, support.across),
        bearing_direction=math.atan2(load[1], load[0]),
    )


def without_rolling_bearings(train: Train) -> Train:
    """The train with springs alone, of gears on rolling bearings their linear ones."""
    gears = tuple(replace(gear, rolling_bearing=None) for gear in train.gears)
    return replace(train, gears=gears)


def _require_statically_determined(train: Train) -> None:
    """Raise TrainError for bearings whose load would not follow from the torques."""
    if train.carrier is not None:
        raise TrainError("rolling bearings: not in planetary sets, use stiffnesses")
    for members in rigid_groups(train):
        bearings = {train.gears[i].rolling_bearing for i in members}
        stiffnesses = [train.gears[i].bearing_stiffness for i in members]
        name = "+".join(train.gears[i].name for i in members)
        if bearings - {None} and (len(bearings - {None}) > 1 or any(stiffnesses)):
            raise TrainError(f"gears {name!r}: one rigid shaft, so equal bearings only")


def bearing_loads(train: Train) -> Array:
    """Static load (gears, 2) on each gear's rolling bearing along x and y [N].

    Forces of meshes and shafts balance the torques; gears on one rigid shaft share
    their load equally.
    """
    fixed_gears = [
        replace(gear, bearing_stiffness=None, rolling_bearing=None)
        for gear in train.gears
    ]
    fixed_coordinates = train_coordinates(replace(train, gears=tuple(fixed_gears)))
    rows = np.concatenate([fixed_coordinates.mesh_rows, fixed_coordinates.spring_rows])
    forces, *_ = np.linalg.lstsq(rows.T, fixed_coordinates.load, rcond=None)
    if np.abs(rows.T @ forces - fixed_coordinates.load).max() > BALANCE_RTOL * np.abs(
        fixed_coordinates.load
    ).max(initial=0.0):
        raise TrainError("torques do not balance: the load on bearings is not known")
    moving_gears = [
        replace(gear, bearing_stiffness=UNIT_STIFFNESS)
        if gear.rolling_bearing is not None
        else fixed_gear
        for gear, fixed_gear in zip(train.gears, fixed_gears, strict=True)
    ]
    moving_coordinates = train_coordinates(replace(train, gears=tuple(moving_gears)))
    mesh_forces = forces[: len(train.meshes)]
    body_forces = -moving_coordinates.mesh_rows.T @ mesh_forces
    loads = np.zeros((len(train.gears), 2))
    for members in rigid_groups(train):
        members_on_bearing = [
            i for i in members if train.gears[i].rolling_bearing is not None
        ]
        for i in members_on_bearing:
            for k, axis in enumerate("xy"):
                loads[i, k] = body_forces[moving_coordinates.indices[i, axis]] / len(
                    members_on_bearing
                )
    loads[np.abs(loads) < LOAD_RTOL * np.abs(mesh_forces).max(initial=0.0)] = 0.0
    return loads


@dataclass(frozen=True, eq=False)
class RollingSupports:
    """The b rolling bearings of a train, in n modal coordinates.

    bearings : of the gears `gears`
    rows : (b, 2, n) displacement of each ring per modal coordinate [1/sqrt(kg)]
    reference : (b, 2, 2) stiffness that the modes include [N/m]
    rates : (b,) rotation of each ring [rad] per period of the first mesh
    """

    gears: tuple[int, ...]
    bearings: tuple[BallBearing | RollerBearing, ...]
    rows: Array
    reference: Array
    rates: Array

    @property
    def count(self) -> int:
        return len(self.bearings)

    def extended(self, arrays: ModalSystem) -> ModalSystem:
        """The system with the rotations of the rings as further coordinates."""
        zeros = np.zeros(self.count)
        shapes = np.pad(arrays.shapes, ((0, 0), (0, self.count)))
        return arrays._replace(
            rigidity=np.concatenate([arrays.rigidity, zeros]),
            damping=np.concatenate([arrays.damping, zeros]),
            load=np.concatenate([arrays.load, zeros]),
            shapes=np.ascontiguousarray(shapes),
        )

    def samples(self, samples: ExcitationSamples) -> BearingSamples:
        """Steps of a common period with the bearings."""
        element_counts = [bearing.elements for bearing in self.bearings]
        angles = np.concatenate(
            [2.0 * math.pi * np.arange(n) / n for n in element_counts]
        )
        waves = [
            (wave.order, wave.amplitude, wave.phase, wave.inner)
            for bearing in self.bearings
            for wave in bearing.waves
        ]
        wave_counts = [len(bearing.waves) for bearing in self.bearings]
        return BearingSamples(
            *samples,
            rows=np.pad(self.rows, ((0, 0), (0, 0), (0, self.count))),
            reference=np.ascontiguousarray(self.reference),
            parameters=np.array([_bearing_parameters(b) for b in self.bearings], float),
            first_element=np.concatenate([[0], np.cumsum(element_counts)]),
            angles=angles,
            cosines=np.cos(angles),
            sines=np.sin(angles),
            first_wave=np.concatenate([[0], np.cumsum(wave_counts)]),
            waves=np.array(waves, float).reshape(-1, 4),
        )

    def equilibrium(self, arrays: ModalSystem, start: Array) -> Array:
        """Modal displacements (n,) at rest with mean mesh stiffnesses, cages at 0.

        The potential is convex; Newton's steps are halved until it decreases.

        start : (n,) displacements from which to look for it
        """
        supports = [RingSupport(bearing, 0.0) for bearing in self.bearings]

        def energy(q: Array) -> float:
            springs = 0.5 * arrays.rigidity @ q**2 - arrays.load @ q
            for support, rows, k in zip(
                supports, self.rows, self.reference, strict=True
            ):
                u = rows @ q
                springs += support.energy(u) - 0.5 * u @ k @ u
            return float(springs)

        q, largest_load = start, float(np.abs(arrays.load).max())
        for _ in range(MAX_ITERATIONS):
            residual = arrays.load - arrays.rigidity * q
            jacobian = np.diag(arrays.rigidity)
            for support, rows, k in zip(
                supports, self.rows, self.reference, strict=True
            ):
                u = rows @ q
                residual -= rows.T @ (support.force(u) - k @ u)
                jacobian = jacobian + rows.T @ (support.stiffness(u) - k) @ rows
            if np.abs(residual).max() <= EQUILIBRIUM_RTOL * largest_load:
                break
            q = q + _decreasing_step(energy, q, jacobian, residual)
        return q if np.isfinite(q).all() else start


def _decreasing_step(
    energy: Callable[[Array], float], q: Array, jacobian: Array, residual: Array
) -> Array:
    regularisation = 1e-12 * float(np.abs(jacobian).max())
    step = np.linalg.solve(jacobian + regularisation * np.eye(q.size), residual)
    energy_before, slope = energy(q), float(residual @ step)
    for _ in range(60):
        if energy(q + step) <= energy_before - 1e-4 * slope:
            break
        step, slope = 0.5 * step, 0.5 * slope
    return np.asarray(step)


def _bearing_parameters(bearing: BallBearing | RollerBearing) -> tuple[float, ...]:
    """A row of `BearingSamples.parameters`."""
    ratio = cage_over_shaft(bearing)
    coefficient, exponent = bearing.coefficient, bearing.exponent
    return coefficient, exponent, bearing.free_gap, bearing.runout, ratio


def rolling_supports(
    train: Train, modes: Modes, moving: NDArray[np.intp]
) -> RollingSupports | None:
    """The rolling bearings of a train in some of its modes, None if it has none."""
    gears = tuple(
        i for i, gear in enumerate(train.gears) if gear.rolling_bearing is not None
    )
    if not gears:
        return None
    rows = np.array([bearing_rows(modes, i)[:, moving] for i in gears])
    rates = [train.speeds[i] / train.gears[train.meshes[0].driver].teeth for i in gears]
    return RollingSupports(
        gears=gears,
        bearings=tuple(
            bearing
            for gear in train.gears
            if (bearing := gear.rolling_bearing) is not None
        ),
        rows=rows,
        reference=np.array([_bearing_stiffness_matrix(train.gears[i]) for i in gears]),
        rates=2.0 * math.pi * np.array([float(rate) for rate in rates]),
    )


def require_springs(train: Train) -> None:
    """Raise TrainError for a rolling bearing without springs."""
    for gear in train.gears:
        if gear.rolling_bearing is not None and gear.bearing_stiffness is None:
            raise TrainError(
                f"gear {gear.name!r}: rolling_bearing without bearing_stiffness; "
                "linearise_bearings gives it"
            )


def bearing_rows(modes: Modes, gear: int) -> Array:
    """Displacement (2, n) of a gear's centre per modal coordinate."""
    indices = modes.coordinates.indices
    return np.array([modes.shapes[indices[gear, axis]] for axis in "xy"])


def _bearing_stiffness_matrix(gear: Gear) -> Array:
    """Stiffness matrix (2, 2) of a gear's springs [N/m]."""
    angle = gear.bearing_direction
    axes = np.array(
        [[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]]
    )
    springs = require_present(gear.bearing_stiffness, "bearing_stiffness")
    return np.asarray(axes.T @ np.diag(springs) @ axes)
