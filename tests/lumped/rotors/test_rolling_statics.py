"""Shafts at rest on rolling bearings, beside a nonlinear system of its own code."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import root
from shafts_at_rest import LENGTH, free_stiffness, random_loads, shaft

from lumped.bearings.mounted import MountedBearing
from lumped.bearings.rolling import BallBearing, RollerBearing
from lumped.rotors.description import Bearing, LinearisedSupport, RotorError
from lumped.rotors.rolling_statics import (
    RollingSupport,
    rolling_shaft_statics,
    states_at,
)
from lumped.rotors.statics import ShaftLoad, shaft_statics

BALL = BallBearing(balls=9, element_diameter=7.94e-3, pitch_diameter=38.5e-3)
ROLLER = RollerBearing(
    rollers=13,
    element_diameter=7.5e-3,
    pitch_diameter=39e-3,
    length=7.5e-3,
    clearance=5e-6,
)
DEEP_GROOVE = MountedBearing(bearing=replace(BALL, clearance=10e-6))
ROLLERS = MountedBearing(bearing=ROLLER)
PLACES = (0.3, 0.6)


def angular(degrees, preload=0.0):
    angle = math.radians(degrees)
    return MountedBearing(bearing=BALL, contact_angle=angle, axial_preload=preload)


ARRANGEMENTS = {
    "locating and floating": ((0.05, DEEP_GROOVE), (0.75, ROLLERS)),
    "two deep groove": ((0.0, DEEP_GROOVE), (0.8, DEEP_GROOVE)),
    "back to back": ((0.05, angular(25.0)), (0.75, angular(-25.0))),
    "face to face": ((0.05, angular(-40.0)), (0.75, angular(40.0))),
    "preloaded": ((0.05, angular(-25.0, 1e-5)), (0.75, angular(25.0, 1e-5))),
    "axial clearance": ((0.05, angular(-25.0, -2e-5)), (0.75, angular(25.0, -2e-5))),
    "three": ((0.05, DEEP_GROOVE), (0.4, ROLLERS), (0.8, ROLLERS)),
    "paired": ((0.05, angular(-25.0)), (0.05, angular(25.0)), (0.75, ROLLERS)),
}


def supports_of(arrangement):
    return [
        RollingSupport(position=place, mounted=mounted)
        for place, mounted in ARRANGEMENTS[arrangement]
    ]


def loads_of(size, seed=73):
    rng = np.random.default_rng(seed)
    return [
        replace(
            load,
            force=tuple(size * force for force in load.force),
            moment=tuple(size * moment for moment in load.moment),
        )
        for load in random_loads(rng, PLACES)
    ]


@pytest.mark.parametrize("size", [1e-3, 1.0, 5.0])
@pytest.mark.parametrize("arrangement", ARRANGEMENTS)
def test_bearings_balance_the_loads_by_their_own_forces(arrangement, size):
    supports, loads = supports_of(arrangement), loads_of(size)
    statics = rolling_shaft_statics(shaft([]), supports, loads)
    solution = statics.solve(loads)
    states = states_at(supports, statics.motions_of_bearings(solution))
    forces = np.array([state.force for state in states])
    largest = np.abs(forces).max()
    assert np.abs(solution.reactions + forces).max() <= 1e-9 * largest
    on_shaft = np.array([load.force for load in loads])
    total = on_shaft.sum(axis=0) + solution.reactions[:, :3].sum(axis=0)
    assert np.abs(total).max() <= 1e-12 * largest
    for axis, (along, sign) in enumerate(((1, -1.0), (0, 1.0))):
        arms = [
            *(sign * load.position * load.force[along] for load in loads),
            *(
                sign * support.position * reaction[along]
                for support, reaction in zip(supports, solution.reactions, strict=True)
            ),
        ]
        moments = [load.moment[axis] for load in loads]
        total = sum(arms) + sum(moments) + solution.reactions[:, 3 + axis].sum()
        assert abs(total) <= 1e-11 * largest * LENGTH


def ring_by_own_code(mounted, u):
    """Force (5,) on a displaced ring, ball by ball and lamina by lamina."""
    bearing, force = mounted.bearing, np.zeros(5)
    D, alpha = bearing.element_diameter, mounted.contact_angle
    sign = -1.0 if alpha < 0.0 else 1.0
    moving = u + np.array([0.0, 0.0, sign * mounted.axial_preload, 0.0, 0.0])
    tilt = np.array([moving[3], moving[4], 0.0])
    for number in range(bearing.elements):
        psi = 2.0 * math.pi * number / bearing.elements
        outward = np.array([math.cos(psi), math.sin(psi), 0.0])
        if isinstance(bearing, BallBearing):
            A = 2.0 * 0.02 * D
            inclined = replace(
                bearing, pitch_diameter=bearing.pitch_diameter / math.cos(alpha)
            )
            lean = np.array([0.0, 0.0, math.sin(alpha)])
            ball = 0.5 * bearing.pitch_diameter * outward
            center = ball + 0.02 * D * (math.cos(alpha) * outward + lean)
            outer = ball - 0.02 * D * (math.cos(alpha) * outward + lean)
            outer = outer + 0.5 * bearing.clearance * outward
            point = center + moving[:3] + np.cross(tilt, center)
            gap = point - outer
            gap -= (gap @ np.cross(outward, [0.0, 0.0, 1.0])) * np.cross(
                outward, [0.0, 0.0, 1.0]
            )
            if sign * gap[2] < 0.0 and alpha:
                gap[2] = 0.0
            reach = math.sqrt(gap @ gap)
            load = inclined.coefficient * max(reach - A, 0.0) ** 1.5
            on_ring, at = load * gap / reach, center
            force += [*on_ring, *np.cross(at, on_ring)[:2]]
            continue
        for lamina in range(30):
            z = bearing.length * ((lamina + 0.5) / 30.0 - 0.5)
            at = np.array([0.0, 0.0, z])
            moved = (moving[:3] + np.cross(tilt, at)) @ outward
            depth = max(moved - 0.5 * bearing.clearance, 0.0)
            on_ring = bearing.coefficient / 30.0 * depth ** (10.0 / 9.0) * outward
            force += [*on_ring, *np.cross(at, on_ring)[:2]]
    return force


@pytest.mark.parametrize("arrangement", sorted(set(ARRANGEMENTS) - {"paired"}))
def test_motions_beside_a_nonlinear_system_of_all_nodes(arrangement):
    supports, loads = supports_of(arrangement), loads_of(1.0)
    nodes = sorted({0.0, LENGTH, *PLACES, *(one.position for one in supports)})
    size = 5 * len(nodes)
    stiffness, applied = free_stiffness(shaft([]), nodes), np.zeros(size)
    for load in loads:
        at = 5 * nodes.index(load.position)
        applied[at : at + 5] += [*load.force, *load.moment[:2]]
    scales = np.full(size, 1e-4)

    def out_of_balance(scaled):
        u = scales * scaled
        forces = stiffness @ u - applied
        for one in supports:
            at = 5 * nodes.index(one.position)
            forces[at : at + 5] += ring_by_own_code(one.mounted, u[at : at + 5])
        return 1e-3 * forces

    statics = rolling_shaft_statics(shaft([]), supports, loads)
    solution = statics.solve(loads)
    ours = np.hstack([solution.deflection, solution.tilt])
    at_nodes = [int(np.abs(solution.position - node).argmin()) for node in nodes]
    expected = ours[at_nodes].ravel()
    # from another place than the solution, but near enough for a method without search
    rng = np.random.default_rng(73)
    start = expected / scales * rng.uniform(0.97, 1.03, size)
    solved = root(out_of_balance, start, tol=1e-13)
    assert np.abs(out_of_balance(solved.x)).max() < 1e-7
    largest = np.abs(expected).max()
    np.testing.assert_allclose(scales * solved.x, expected, atol=1e-7 * largest)


@pytest.mark.parametrize("arrangement", ["two deep groove", "preloaded", "three"])
def test_compliance_is_the_derivative_of_motions_by_loads(arrangement):
    supports, loads = supports_of(arrangement), loads_of(1.0)

    def motions(loads):
        statics = rolling_shaft_statics(shaft([]), supports, loads)
        p = np.array([[*load.force, *load.moment[:2]] for load in loads]).ravel()
        return statics.offset + statics.compliance @ p, statics

    at_loads, statics = motions(loads)
    solution = statics.solve(loads)
    nodes = [int(np.abs(solution.position - place).argmin()) for place in PLACES]
    ours = np.hstack([solution.deflection, solution.tilt])[nodes].ravel()
    np.testing.assert_allclose(at_loads, ours, atol=1e-12 * np.abs(ours).max())
    step = 1e-2  # N
    for axis in range(3):
        moved = []
        for sign in (1.0, -1.0):
            force = np.array(loads[0].force)
            force[axis] += sign * step
            changed = [replace(loads[0], force=tuple(force.tolist())), loads[1]]
            moved.append(motions(changed)[0])
        slope = (moved[0] - moved[1]) / (2.0 * step)
        largest = np.abs(statics.compliance[:3, :3]).max()
        np.testing.assert_allclose(
            slope, statics.compliance[:, axis], atol=1e-5 * largest
        )


def test_a_preloaded_pair_is_linear_under_small_loads():
    """Its bearings are those with the stiffness that mounting leaves them."""
    supports = supports_of("preloaded")
    nothing = [ShaftLoad(position=place) for place in PLACES]
    at_rest = [ShaftLoad(position=PLACES[0], force=(1e-6, 0.0, 0.0)), nothing[1]]
    mounted = rolling_shaft_statics(shaft([]), supports, at_rest)
    start = mounted.motions_of_bearings(mounted.solve(at_rest))
    tangents = [
        Bearing(
            position=support.position,
            stiffness=(0.0, 0.0, 0.0, 0.0),
            linearised=LinearisedSupport(stiffness=state.stiffness, force=np.zeros(5)),
        )
        for support, state in zip(supports, states_at(supports, start), strict=True)
    ]
    linear = shaft_statics(shaft(tangents), PLACES)
    errors = []
    for size in (1e-2, 1e-3):
        loads = loads_of(size)
        statics = rolling_shaft_statics(shaft([]), supports, loads)
        ours = statics.solve(loads).deflection - mounted.solve(at_rest).deflection
        expected = linear.solve(loads).deflection
        errors.append(np.abs(ours - expected).max() / np.abs(expected).max())
    assert errors[0] < 2e-2
    # of second order in the loads, relative to them of first order
    assert errors[1] < 0.12 * errors[0]


def test_preload_is_in_the_bearings_without_loads():
    """Rings are pushed toward each other, which compresses the shaft between them."""
    supports = supports_of("preloaded")
    loads = [ShaftLoad(position=0.3, force=(1e-6, 0.0, 0.0))]
    solution = rolling_shaft_statics(shaft([]), supports, loads).solve(loads)
    near, far = solution.reactions[:, 2]
    assert near == pytest.approx(-far, rel=1e-9)
    # bearings face to face push the ends of the shaft inward
    assert near > 100.0
    assert solution.axial_force.min() == pytest.approx(-near, rel=1e-9)


def test_shafts_that_bearings_do_not_hold_are_refused():
    rollers = [RollingSupport(position=z, mounted=ROLLERS) for z in (0.1, 0.7)]
    loads = [ShaftLoad(position=0.3, force=(100.0, 0.0, 50.0))]
    with pytest.raises(RotorError, match="'counter': axial force = 50 N, toward the f"):
        rolling_shaft_statics(shaft([]), rollers, loads)
    # cancelling thrusts need no bearing
    balanced = [*loads, ShaftLoad(position=0.6, force=(0.0, 0.0, -50.0))]
    assert not rolling_shaft_statics(shaft([]), rollers, balanced).has_thrust_path
    one_way = [replace(rollers[0], mounted=angular(-25.0)), rollers[1]]
    with pytest.raises(RotorError, match="without a ball bearing that takes it"):
        rolling_shaft_statics(shaft([]), one_way, loads)
    with pytest.raises(RotorError, match="no bearings; one or more needed"):
        rolling_shaft_statics(shaft([]), [], balanced)


def random_support(rng, position):
    """Ball or roller bearing with clearance, contact angle or preload at random."""
    kind, count = rng.integers(3), int(rng.integers(6, 20))
    size = {"element_diameter": 6e-3, "pitch_diameter": 60e-3}
    clearance = float(rng.choice([0.0, 5e-6, 20e-6, 100e-6, -5e-6]))
    if kind == 0:
        mounted = MountedBearing(
            bearing=BallBearing(balls=count, clearance=clearance, **size)
        )
    elif kind == 1:
        angle = float(rng.choice([-40.0, -25.0, -15.0, 15.0, 25.0, 40.0]))
        mounted = MountedBearing(
            bearing=BallBearing(balls=count, **size),
            contact_angle=math.radians(angle),
            axial_preload=float(rng.uniform(-50e-6, 30e-6)),
        )
    else:
        mounted = MountedBearing(
            bearing=RollerBearing(
                rollers=count, length=8e-3, clearance=clearance, **size
            )
        )
    return RollingSupport(position=float(position), mounted=mounted)


@pytest.mark.parametrize("seed", range(30))
def test_equilibrium_of_random_shafts_under_loads_of_all_sizes(seed):
    """Two to four bearings; small loads leave some of them without contact."""
    rng = np.random.default_rng([73, seed])
    positions = np.sort(rng.uniform(0.0, LENGTH, rng.integers(2, 5)))
    supports = [random_support(rng, position) for position in positions]
    loads = loads_of(10.0 ** rng.uniform(-4.0, 1.0), [73, seed])
    senses = {sense for one in supports for sense in one.mounted.thrust_senses}
    if math.copysign(1, sum(load.force[2] for load in loads)) not in senses:
        loads = [replace(load, force=(*load.force[:2], 0.0)) for load in loads]
    statics = rolling_shaft_statics(shaft([]), supports, loads)
    solution = statics.solve(loads)
    motions = statics.motions_of_bearings(solution)
    forces = np.array([state.force for state in states_at(supports, motions)])
    largest = np.abs(forces).max()
    assert np.abs(solution.reactions + forces).max() <= 1e-8 * largest
    applied = np.array([load.force for load in loads])
    total = applied.sum(axis=0) + solution.reactions[:, :3].sum(axis=0)
    assert np.abs(total).max() <= 1e-11 * largest
