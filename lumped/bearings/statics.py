"""Static load on the elements of a bearing and its stiffness, by Newton's method.

The potential of all contacts is a convex function of the ring's displacement, so that
damped Newton steps find its only minimum.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from lumped.bearings.kinematics import cage_over_shaft
from lumped.bearings.rolling import RollingBearing
from lumped.common.array_types import Array
from lumped.common.checks import format_number

MAX_ITERATIONS = 40
LOAD_STEP = 3.0  # ratio of loads from which a smaller one is approached
EQUILIBRIUM_RTOL = 1e-12  # of the load
ROUND_OFF = 1e-14  # of the loads on all elements
MAX_HALVINGS = 60
MIN_STEP = 1e-300  # m
REGULARISATION = 1e-13  # of the stiffness, for a single element in contact
MEAN_ANGLES = 32  # positions of the cage within one spacing that a mean is taken over
MIN_LOAD = 1e-6  # N; less is lost in round-off


@dataclass(frozen=True, eq=False)
class LoadDistribution:
    """Equilibrium of the inner ring at one position of the cage, Z elements.

    displacement : (2,) of the ring, x and y [m]
    angles : (Z,) of the elements, counter-clockwise from x [rad]
    approaches : (Z,) of both races on each element, negative where it is free [m]
    loads : (Z,) on the elements [N]
    stiffness : (2, 2) tangent [N/m]
    """

    displacement: Array
    angles: Array
    approaches: Array
    loads: Array
    stiffness: Array


@dataclass(frozen=True, eq=False)
class RingSupport:
    """Contacts of a bearing at one position of the cage.

    bearing : RollingBearing
    cage_angle : of the first element [rad]
    """

    bearing: RollingBearing
    cage_angle: float

    @cached_property
    def angles(self) -> Array:
        count = self.bearing.elements
        return self.cage_angle + 2.0 * math.pi * np.arange(count) / count

    @cached_property
    def normals(self) -> Array:
        """Directions of the elements (Z, 2)."""
        return np.stack([np.cos(self.angles), np.sin(self.angles)], axis=1)

    @cached_property
    def closed(self) -> Array:
        """Approach of each element (Z,) between centred rings [m]."""
        bearing = self.bearing
        shaft = self.cage_angle / cage_over_shaft(bearing)
        approaches = bearing.runout * np.cos(self.angles - shaft) - bearing.free_gap
        for wave in bearing.waves:
            # eq. 6.7 of the multi-mesh source
            on_race = self.angles - shaft if wave.inner else self.angles
            approaches += wave.amplitude * np.cos(wave.order * on_race + wave.phase)
        return np.asarray(approaches)

    def approaches(self, displacement: Array) -> Array:
        """Approach (Z,) of both races on each element [m]."""
        # eq. 6.6 of the multi-mesh source, of both contacts together
        return self.normals @ displacement + self.closed

    def loads(self, approaches: Array) -> Array:
        """Loads (Z,) on the elements [N]."""
        positive = np.maximum(approaches, 0.0)
        return self.bearing.coefficient * positive**self.bearing.exponent

    def force(self, displacement: Array) -> Array:
        """Force (2,) that moves the ring to a displacement [N]."""
        return self.normals.T @ self.loads(self.approaches(displacement))

    def stiffness(self, displacement: Array) -> Array:
        """Tangent stiffness (2, 2) [N/m]."""
        positive = np.maximum(self.approaches(displacement), 0.0)
        n, coefficient = self.bearing.exponent, self.bearing.coefficient
        slopes = n * coefficient * positive ** (n - 1.0)
        return np.asarray((self.normals.T * slopes) @ self.normals)

    def energy(self, displacement: Array) -> float:
        """Strain energy of all contacts [J]."""
        approaches = self.approaches(displacement)
        total = np.maximum(approaches, 0.0) @ self.loads(approaches)
        return float(total / (self.bearing.exponent + 1.0))


def load_distribution(
    bearing: RollingBearing, load: tuple[float, float], cage_angle: float = 0.0
) -> LoadDistribution:
    """Equilibrium under a radial load.

    bearing : RollingBearing
    load : on the inner ring, along x and y [N]
    cage_angle : of the first element, counter-clockwise from x [rad]

    Raises ValueError if there is no load or no equilibrium is found.
    """
    force = np.array(load, float)
    size = float(np.hypot(*force))
    if not MIN_LOAD <= size < math.inf:
        raise ValueError(
            f"load = {format_number(size)}; must be {MIN_LOAD:g} N or more"
        )
    support = RingSupport(bearing, cage_angle)
    u = _equilibrium(support, force)
    approaches = support.approaches(u)
    return LoadDistribution(
        displacement=u,
        angles=support.angles,
        approaches=approaches,
        loads=support.loads(approaches),
        stiffness=support.stiffness(u),
    )


def _equilibrium(support: RingSupport, force: Array) -> Array:
    """Displacement (2,) under a force (2,); ValueError if none is found.

    A small load behind a large clearance, which few elements carry, is approached from
    larger ones, under which more of them are in contact.
    """
    bearing, size = support.bearing, float(np.hypot(*force))
    depth = (size / bearing.coefficient) ** (1.0 / bearing.exponent)
    play = float(np.abs(support.closed).max())
    reach = 2.0 * depth + play
    u = _newton(support, force, reach * force / size, reach)
    if u is not None:
        return u
    largest = max(size, bearing.coefficient * play**bearing.exponent)
    stages = math.ceil(math.log(largest / size, LOAD_STEP))
    u = reach * force / size
    for stage in range(stages, -1, -1):
        closer = _newton(support, LOAD_STEP**stage * force, u, reach)
        if closer is None:
            raise ValueError("no equilibrium of the bearing was found")
        u = closer
    return u


def _newton(support: RingSupport, force: Array, u: Array, reach: float) -> Array | None:
    """Displacement (2,) under a force (2,) from a first one, None if not found."""
    size = float(np.hypot(*force))
    for _ in range(MAX_ITERATIONS):
        residual = force - support.force(u)
        total = size + float(support.loads(support.approaches(u)).sum())
        if not total < math.inf:
            return None
        if np.hypot(*residual) <= EQUILIBRIUM_RTOL * size + ROUND_OFF * total:
            return u
        u = u + _damped_step(support, force, u, residual, reach)
    return None


def _damped_step(
    support: RingSupport, force: Array, u: Array, residual: Array, reach: float
) -> Array:
    """Newton step, halved until the potential decreases or the residual halves.

    Near equilibrium the change of the potential is round-off. Where one element alone
    is in contact, the ring moves around it by at most `reach` [m].
    """
    stiffness = support.stiffness(u)
    # without contact only this much, so that the ring moves along the force
    level = max(float(np.trace(stiffness)), float(np.hypot(*residual)) / reach)
    step = np.linalg.solve(stiffness + REGULARISATION * level * np.eye(2), residual)
    before, size = support.energy(u) - force @ u, float(np.hypot(*residual))
    step = step * min(1.0, reach / max(float(np.hypot(*step)), MIN_STEP))
    slope = residual @ step
    for _ in range(MAX_HALVINGS):
        ahead = u + step
        if support.energy(ahead) - force @ ahead <= before - 1e-4 * slope:
            break
        if np.hypot(*(force - support.force(ahead))) <= 0.5 * size:
            break
        step, slope = 0.5 * step, 0.5 * slope
    return np.asarray(step)


@dataclass(frozen=True)
class MeanSupport:
    """Means over the positions of the cage.

    along, across : tangent stiffness along the load and across it [N/m]
    variation : peak to peak of the stiffness along the load, over its mean
    displacement : along the load [m]
    max_load : largest load on an element at any position [N]
    """

    along: float
    across: float
    variation: float
    displacement: float
    max_load: float


def mean_support(bearing: RollingBearing, load: float) -> MeanSupport:
    """Stiffness under a radial load [N], as elements pass under it."""
    spacing = 2.0 * math.pi / bearing.elements
    states = [
        load_distribution(bearing, (load, 0.0), spacing * k / MEAN_ANGLES)
        for k in range(MEAN_ANGLES)
    ]
    along = np.array([state.stiffness[0, 0] for state in states])
    across = np.array([state.stiffness[1, 1] for state in states])
    return MeanSupport(
        along=float(along.mean()),
        across=float(across.mean()),
        variation=float(np.ptp(along) / along.mean()),
        displacement=float(np.mean([state.displacement[0] for state in states])),
        max_load=float(max(state.loads.max() for state in states)),
    )
