"""Friction on drive and back flanks, beside flanks as lines in the plane."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from friction_pairs import pair_system
from numba import njit

from fegear.gearset import load_gear_set
from fegear.statics.excitation_settings import ExcitationSettings
from fegear.train.lumped_models import lumped_system
from fegear.train.model_settings import LumpedModel
from lumped.kernels.friction import set_friction_acceleration
from lumped.steady.integration_settings import Settings
from lumped.steady.motion import time_history
from lumped.train.analytic import StiffnessParameters, analytic_excitation
from lumped.train.bodies import Gear
from lumped.train.friction import ToothFriction, base_pitch, with_bending
from lumped.train.friction_samples import scale_to_frequency
from lumped.train.system import LumpedSystem
from lumped.train.train import Mesh, Train

MU, BENDING, FREQUENCY, BACKLASH = 0.15, 0.4, 700.0, 8e-5


@njit(error_model="numpy")
def acceleration(system, samples, instant, q, v, a, s):
    set_friction_acceleration(system, samples, instant, q, v, a, s)


def idler(friction):
    """Three gears that yield, the second mesh across the first."""
    gears = tuple(
        Gear(
            name=name,
            teeth=teeth,
            base_radius=1e-3 * teeth,
            inertia=inertia,
            mass=mass,
            bearing_stiffness=(2e8, 3e8),
            torque=torque,
        )
        for name, teeth, inertia, mass, torque in (
            ("a", 30, 1e-3, 1.0, 60.0),
            ("b", 45, 4e-3, 2.0, 0.0),
            ("c", 36, 2e-3, 1.5, -72.0),
        )
    )
    meshes = (
        Mesh(driver=0, driven=1, pressure_angle=0.4, center_line=0.3, phase=0.2),
        Mesh(driver=1, driven=2, pressure_angle=0.35, center_line=-1.1, phase=0.7),
    )
    meshes = tuple(Mesh(**{**vars(m), "backlash": BACKLASH}) for m in meshes)
    train = Train(gears=gears, meshes=meshes, damping_ratio=0.02)
    figures = StiffnessParameters(mean=3e8, variation=0.3, contact_ratio=1.6)
    bent = with_bending(analytic_excitation(figures), friction)
    return LumpedSystem(train, (bent, bent), friction=(friction, friction))


def turned(vector, angle):
    c, s = math.cos(angle), math.sin(angle)
    return np.array([c * vector[0] - s * vector[1], s * vector[0] + c * vector[1]])


class Flanks:
    """A pair in contact on a line of action, its friction by forces in the plane."""

    def __init__(self, system, m, x, side):
        train, mesh = system.train, system.train.meshes[m]
        self.gears, self.sense = (mesh.driver, mesh.driven), train.sense(mesh.driver)
        radii = [train.gears[g].base_radius for g in self.gears]
        line = np.array([math.cos(mesh.center_line), math.sin(mesh.center_line)])
        cosine, quarter = math.cos(mesh.pressure_angle), 0.5 * math.pi
        # the push of the driver; the contact runs along it, or back against it
        lean = side * self.sense * (quarter - mesh.pressure_angle)
        self.normal = turned(line, lean)
        at = radii[0] / cosine * line + side * x * self.normal
        self.arms = at, at - sum(radii) / cosine * line
        along = FREQUENCY * float(train.mesh_rates[m]) * base_pitch(train, m)
        self.turns = self.sense * along / radii[0], -self.sense * along / radii[1]
        self.tangent = turned(self.normal, quarter)
        self.space, self.side = system.modes.coordinates, side

    def speed(self, velocity):
        """Of sliding along the tangent, with vibration `velocity` (n,)."""
        sliding = 0.0
        for gear, turn, arm, sign in zip(
            self.gears, self.turns, self.arms, (1, -1), strict=True
        ):
            turn = turn + velocity[self.space.indices[gear, "rotation"]]
            centre = [velocity[self.space.indices[gear, axis]] for axis in "xy"]
            sliding += (
                sign * (centre + turn * turned(arm, 0.5 * math.pi)) @ self.tangent
            )
        return sliding

    def load(self, force):
        """On the coordinates of a force along the tangent on the driver."""
        out = np.zeros(self.space.mass.size)
        for gear, arm, sign in zip(self.gears, self.arms, (1, -1), strict=True):
            push = sign * force * self.tangent
            out[self.space.indices[gear, "rotation"]] += arm[0] * push[1]
            out[self.space.indices[gear, "rotation"]] -= arm[1] * push[0]
            for axis, part in zip("xy", push, strict=True):
                out[self.space.indices[gear, axis]] += part
        return out


def friction_by_flanks(system, samples, instant, q, v):
    """Modal load of friction and of what it does to stiffness, and its power [W]."""
    shapes = system.modes.shapes[:, system.moving]
    velocity, load, power = (
        shapes @ v,
        np.zeros(system.modes.coordinates.mass.size),
        0.0,
    )
    first, rows = system.arrays.first_pair, system.modes.coordinates.mesh_rows
    for m, rub in enumerate(system.friction):
        deflection = rows[m] @ shapes @ q
        for p in range(first[m], first[m + 1]):
            k, gap = (part[*instant, p] for part in samples[1:3])
            elastic = deflection - gap
            side = 1 if elastic > 0.0 else -1
            overlap = max(elastic, -elastic - BACKLASH, 0.0)
            flanks = Flanks(system, m, samples.arm[*instant, p], side)
            nominal = flanks.speed(0.0 * velocity)
            speed = flanks.speed(velocity)
            direction_speed = nominal if rub.sliding == "nominal" else speed
            # toward the root of the driver while its own flank is ahead in sliding
            toward = [math.copysign(1.0, s) for s in (nominal, direction_speed)]
            approach = 1.0 if samples.signed_friction[*instant, p] > 0.0 else -1.0
            bare = k / (1.0 + approach * rub.bending * MU)
            again = approach * toward[0] * toward[1]
            normal = overlap * bare * (1.0 + again * rub.bending * MU)
            load -= side * (normal - overlap * k) * rows[m]
            load += flanks.load(-toward[1] * MU * normal)
            power += toward[1] * MU * normal * speed
    return shapes.T @ load, power


@pytest.mark.parametrize("sliding", ["nominal", "instantaneous"])
def test_friction_is_that_of_flanks_in_the_plane(sliding):
    """Moments, forces and sliding of both sides; nothing where teeth are apart."""
    system = idler(ToothFriction(MU, BENDING, sliding))
    without = idler(ToothFriction(0.0, 0.0, sliding))
    samples = scale_to_frequency(system.samples(16), FREQUENCY)
    bare = scale_to_frequency(with_no_friction(system.samples(16)), FREQUENCY)
    assert np.array_equal(system.modes.shapes, without.modes.shapes)
    random, n = np.random.default_rng(1), system.moving.size
    to_rows = system.arrays.shapes
    sides, taken = set(), []
    for _ in range(60):
        instant = int(random.integers(samples.h.size)), 1
        v = random.normal(size=n) * 10.0 ** random.uniform(-3.0, 0.0)
        deflection = random.choice([3e-5, -4e-5, -2e-4], 2)
        q = np.linalg.lstsq(to_rows, deflection, rcond=None)[0]
        sides.add(tuple(deflection))
        total, plain, s = np.empty(n), np.empty(n), np.empty(2)
        acceleration(system.arrays, samples, instant, q, v, total, s)
        acceleration(system.arrays, bare, instant, q, v, plain, s)
        load, power = friction_by_flanks(system, samples, instant, q, v)
        scale = np.abs(load).max()
        if (deflection == -4e-5).all():
            np.testing.assert_array_equal(total, plain)
        np.testing.assert_allclose(
            total - plain, load, rtol=1e-9, atol=1e-9 * (scale + np.abs(plain).max())
        )
        taken.append(power)
    assert len(sides) == 9
    if sliding == "instantaneous":
        assert min(taken) >= 0.0


def with_no_friction(samples):
    """The same springs, stiffnesses as friction bends them."""
    return samples._replace(
        signed_friction=0.0 * samples.signed_friction, bending=0.0 * samples.bending
    )


def hammering(friction):
    """The pair of chapter 5 with little backlash."""
    pair = pair_system(0.5, 0.01, friction)
    backlash = 0.2 * float(pair.static_deflection[0])
    mesh = replace(pair.train.meshes[0], backlash=backlash)
    return replace(pair, train=replace(pair.train, meshes=(mesh,)))


@pytest.mark.parametrize("transition", [0.0, 2e-3])
def test_friction_gives_no_energy_where_flanks_hammer(transition):
    """On both sides and while teeth are apart, of forces as they are recorded."""
    rub = ToothFriction(MU, BENDING, "instantaneous", transition)
    system = hammering(rub)
    motion = time_history(system, 1.6, Settings(max_periods=40))
    force, speed, power = (motion.history.friction[:, i] for i in range(3))
    assert (force < 0.0).any()
    assert (force > 0.0).any()
    assert (power >= 0.0).all()
    assert not power[force == 0.0].any()
    turned = np.tanh(speed / transition) if transition else np.sign(speed)
    np.testing.assert_allclose(power, MU * np.abs(force) * turned * speed, rtol=1e-12)
    np.testing.assert_allclose(power.sum(axis=1), motion.friction_power[:, 0])
    np.testing.assert_allclose(force.sum(axis=1), motion.history.force[:, 0])
    np.testing.assert_array_equal(force, motion.pairs[0].force)
    assert {-1, 0, 1} <= set(motion.pairs[0].state.ravel())


def liu_pair(sliding, speed):
    """Settled at a speed [Hz]: RMS of the transmission error and mean power taken."""
    source = ExcitationSettings(kind="rectangular")
    model = LumpedModel(
        number=1, excitation=source, friction=0.1, bending=0.39, sliding=sliding
    )
    system = lumped_system(load_gear_set("liu-pair"), 100.0, model)
    motion = time_history(system, speed, Settings(steps=256, max_periods=100))
    time = motion.history.time
    power = np.trapezoid(motion.friction_power[:, 0], time) / time[-1]
    return motion.response.dte_rms[0], power


def test_vibration_turns_the_sliding_at_low_speeds_only():
    """At 1 Hz a pair slides slower than it vibrates behind the pitch point."""
    for speed, changes in ((1731.0, (1e-5, 1e-6)), (2308.0, (1e-5, 1e-6))):
        pairs = zip(
            liu_pair("nominal", speed), liu_pair("instantaneous", speed), strict=True
        )
        for (nominal, instantaneous), limit in zip(pairs, changes, strict=True):
            assert instantaneous == pytest.approx(nominal, rel=limit)
    (rms, power), (own_rms, own_power) = (
        liu_pair(sliding, 1.0) for sliding in ("nominal", "instantaneous")
    )
    assert own_rms / rms - 1.0 == pytest.approx(2.0e-3, rel=0.2)
    assert own_power / power - 1.0 == pytest.approx(0.155, rel=0.1)
