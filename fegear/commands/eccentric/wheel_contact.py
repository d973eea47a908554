"""Contact of both wheels at positions of a turn: transmission error, load sharing.

Flanks that are conjugate touch on one line through the pitch point, so all pairs of
teeth approach each other by the same way. Each pair is a Hertzian contact between the
half-planes of its flanks; the finite elements of both wheels couple the pairs. Outside
of the lines of contact, at tip corners, no contact is looked for.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fegear.commands.eccentric.elastic_wheel import ElasticWheel
from fegear.contact.problem import ContactFailure
from fegear.elasticity.material import pressure_in_plane
from fegear.result import Result
from lumped.common.array_types import Array
from meshes.eccentric.base import LEADING, TRAILING, Side
from meshes.eccentric.teeth import ToothedPair, ToothedWheel

MAX_ITERATIONS = 60
EQUILIBRIUM_RTOL = 1e-12
# of an edge: nearer to a tip corner, a concentrated load's tractions on the tip land
# are too uneven for quadrature, which would miss half of the deflection
CORNER_MARGIN = 0.1


@dataclass(frozen=True, eq=False)
class Pairs:
    """Pairs of teeth that touch at one position, (k,) each.

    driver_tooth, driven_tooth : their numbers
    driver_point, driven_point : (k, 2) in the wheels' own frames [m]
    radius : of relative curvature of the flanks [m]
    """

    driver_tooth: NDArray[np.int64]
    driven_tooth: NDArray[np.int64]
    driver_point: Array
    driven_point: Array
    radius: Array


@dataclass(frozen=True, eq=False)
class TurnContact(Result):
    """Contact at positions (n,) of a turn of the driven wheel.

    angle : of the driver's centre [rad]; driver_turn, driven_turn : of the wheels [rad]
    effective_arm : of the normal force about the driver's bearing [m]
    pairs : in contact; error : approach of the flanks along the line of action [m]
    driver_error : turn of the driver with the driven wheel held [rad]
    pressure : the largest of all contacts, in plane strain [Pa]
    largest_share : of the normal force that one pair carries
    torque_ratio : of the moments of the contact forces about both bearings, by the
        flanks as they are meshed
    """

    angle: Array
    driver_turn: Array
    driven_turn: Array
    effective_arm: Array
    pairs: NDArray[np.int64]
    error: Array
    driver_error: Array
    pressure: Array
    largest_share: Array
    torque_ratio: Array


def pairs_at(teeth: ToothedPair, arc: float) -> Pairs:
    """Pairs of teeth whose flanks touch where the pitch point has gone an arc [m]."""
    lap = teeth.driven.curve.length
    laps = np.floor((arc - teeth.contact[:, 0]) / lap) * lap
    number = np.flatnonzero(arc - laps <= teeth.contact[:, 1])
    pair_arc = arc - laps[number]
    driver, driven, rack = teeth.driver, teeth.driven, teeth.rack
    flank_position = rack.pitch * (number - 0.25)
    alpha = rack.pressure_angle
    distance = (flank_position - pair_arc) * math.cos(alpha)
    angle = pair_arc / driver.curve.radius
    driver_radius = math.sin(alpha) / driver.curve.frames(angle).curvature - distance
    driven_radius = math.sin(alpha) / driven.curve.frames(angle).curvature + distance
    return Pairs(
        number % driver.teeth,
        (number - 1) % driven.teeth,
        driver.flank(flank_position, pair_arc, TRAILING),
        driven.flank(flank_position, pair_arc, LEADING),
        driver_radius * driven_radius / (driver_radius + driven_radius),
    )


def solve_contact_cycle(
    teeth: ToothedPair,
    driver: ElasticWheel,
    driven: ElasticWheel,
    load: float,
    arcs: Array,
) -> TurnContact:
    """Contact where the pitch point has gone arcs (n,) [m].

    load : torque on the driver per face width [N]
    Raises ContactFailure where no solution is found.
    """
    contacts = [pairs_at(teeth, arc) for arc in arcs.tolist()]
    count = np.array([p.radius.size for p in contacts])
    loads = [(p.driver_tooth, p.driver_point) for p in contacts]
    driver_compliance, driver_arm = _compliances(driver, teeth.driver, TRAILING, loads)
    loads = [(p.driven_tooth, p.driven_point) for p in contacts]
    driven_compliance, driven_arm = _compliances(driven, teeth.driven, LEADING, loads)
    softness = 1.0 / driver.material.modulus + 1.0 / driven.material.modulus
    ratio = pressure_in_plane(driver.material, driven.material, "strain")
    pair, angle = teeth.pair, arcs / teeth.pair.radius
    arm = _arm(teeth, angle)
    error, share, torque_ratio, pressure = (np.empty(len(contacts)) for _ in range(4))
    for n, pairs in enumerate(contacts):
        force, error[n] = share_load(
            driver_compliance[n] + driven_compliance[n],
            pairs.radius,
            softness,
            load / float(arm[n]),
        )
        share[n] = force.max() / force.sum()
        pressure[n] = np.sqrt(force / (math.pi * softness * pairs.radius)).max()
        torque_ratio[n] = (force @ driven_arm[n]) / (force @ driver_arm[n])
    return TurnContact(
        *(angle, pair.driver_turn(angle), pair.driven_turn(angle), arm, count),
        *(error, error / arm, ratio * pressure, share, torque_ratio),
    )


def share_load(
    compliance: Array, radius: Array, softness: float, force: float
) -> tuple[Array, float]:
    """Forces (k,) of pairs and their common approach [N/m, m] under a force [N/m].

    compliance : (k, k) of both wheels in addition to their half-planes [m/(N/m)]
    radius : (k,) of relative curvature [m]; softness : 1/E' of both [1/Pa]

    Under the semi-ellipse of Hertz over a half-width b, b^2 = 4 F R softness / pi, the
    half-planes approach by 2/pi softness F (1/2 - ln(b/2)), b in metres.
    """
    touching = np.ones(radius.size, bool)
    forces = np.full(radius.size, force / radius.size)
    for _ in range(MAX_ITERATIONS):
        width = np.sqrt(4.0 / math.pi * softness * forces * radius)
        local = 2.0 / math.pi * softness * (0.5 - np.log(0.5 * width[touching]))
        matrix = compliance[np.ix_(touching, touching)] + np.diag(local)
        unit = np.linalg.solve(matrix, np.ones(local.size))
        approach = force / float(unit.sum())
        new = np.zeros(radius.size)
        new[touching] = approach * unit
        if (new < 0.0).any():
            touching &= new > 0.0
            forces = np.where(touching, np.maximum(new, EQUILIBRIUM_RTOL * force), 0.0)
            continue
        change = float(np.abs(new - forces).max())
        forces = new
        if change <= EQUILIBRIUM_RTOL * force:
            return forces, approach
    raise ContactFailure(f"contact not solved under {force:g} N/m")


def _arm(teeth: ToothedPair, angle: Array) -> Array:
    """Lever arm of the line of action about the driver's bearing (n,) [m]."""
    arc = angle * teeth.driver.curve.radius
    action = teeth.driver.action(arc, TRAILING)
    point = teeth.driver.curve.frames(angle).point
    return np.abs(point[:, 0] * action[:, 1] - point[:, 1] * action[:, 0])


def _compliances(
    wheel: ElasticWheel,
    toothed: ToothedWheel,
    side: Side,
    loads: list[tuple[NDArray[np.int64], Array]],
) -> tuple[list[Array], list[Array]]:
    """Compliance (k, k) and arms (k,) about the bearing at each position."""
    matrices: list[Array] = []
    arms: list[Array] = []
    for tooth, point in loads:
        tooth_centre = toothed.first + toothed.rack.pitch * tooth
        outward = toothed.curve.frames(tooth_centre / toothed.curve.radius).normal
        flanks = wheel.mesh.flanks[side][tooth]
        x, n = wheel.places(point, outward, flanks)[:2]
        flank_places = wheel.places(point, outward, flanks, CORNER_MARGIN)
        matrices.append(wheel.compliance(flank_places, wheel.respond(flank_places)))
        arms.append(x[:, 0] * n[:, 1] - x[:, 1] * n[:, 0])
    return matrices, arms
