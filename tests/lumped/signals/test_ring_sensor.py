"""Where planets pass a sensor on the ring, and how it feels them."""

from __future__ import annotations

import math

import numpy as np
import pytest

import lumped
from lumped.signals.ring_sensor import RingSensor, hann_window, planet_passes


def train(planets=3, sun_drives=True):
    """Sun with 24 teeth, planets with 36 and a ring with 96, which is held."""
    angles = [2.0 * math.pi * n / planets for n in range(planets)]
    gears = [lumped.Gear(name="sun", teeth=24, base_radius=0.02, inertia=1e-4)]
    gears += [
        lumped.Gear(name=f"p{n}", teeth=36, base_radius=0.03, inertia=1e-4, mass=0.1)
        for n in range(planets)
    ]
    ring = {"teeth": 96, "base_radius": -0.08, "inertia": 1e-2, "is_held": True}
    gears.append(lumped.Gear(name="ring", **ring))
    meshes = []
    for number, angle in enumerate(angles, start=1):
        pairs = (0, number), (number, 1 + planets)
        for pair, line in zip(pairs, (angle, angle + math.pi), strict=True):
            driver, driven = pair if sun_drives else pair[::-1]
            meshes.append(
                lumped.Mesh(
                    driver=driver,
                    driven=driven,
                    pressure_angle=0.35,
                    center_line=line if sun_drives else line + math.pi,
                )
            )
    carrier = lumped.Carrier(
        name="carrier",
        gears=tuple(range(1, 1 + planets)),
        radius=0.06,
        angles=tuple(angles),
        inertia=1e-3,
    )
    return lumped.Train(gears=tuple(gears), meshes=tuple(meshes), carrier=carrier)


def test_planets_pass_in_the_sense_of_the_carrier():
    """The sun turns counter-clockwise, and so do carrier and planets' directions."""
    for sun_drives, sense in ((True, 1), (False, -1)):
        one = train(sun_drives=sun_drives)
        passes = planet_passes(one)
        assert (passes.ring, passes.teeth, passes.meshes) == (4, 96, (1, 3, 5))
        assert passes.sense == sense == np.sign(one.carrier_speed)
        # a quarter of a turn of the carrier has 24 mesh cycles
        turned = passes.directions(np.array([0.0, 24.0]))
        np.testing.assert_allclose(turned[0], one.carrier.angles)
        np.testing.assert_allclose(turned[1] - turned[0], sense * 0.5 * math.pi)
        # which the carrier's speed has in the time of 24 cycles
        angle = one.carrier_angular_speed(1.0) * 24.0
        assert angle == pytest.approx(sense * 0.5 * math.pi)


def test_a_sensor_feels_the_planet_beside_it():
    sensor = RingSensor(passes=planet_passes(train()), direction=1.0, width=2.0)
    cycles = 96.0 / (2.0 * math.pi)  # of a radian of the carrier
    weights = sensor.weights(np.array([0.0, 0.5, 1.0, 1.5, 2.0]) * cycles)
    expected = [0.0, 0.5, 1.0, 0.5, 0.0]
    np.testing.assert_allclose(weights[:, 0], expected, atol=1e-12)


def test_windows_of_equally_spaced_planets_add_up_to_a_hann_window_each():
    """Those of 2 pi over their number leave no place without a planet but one."""
    angle = np.linspace(-math.pi, math.pi, 721)
    window = hann_window(angle, 2.0 * math.pi / 3.0)
    assert window.max() == 1.0
    assert window[np.abs(angle) >= math.pi / 3.0].max() == 0.0
    assert window.mean() == pytest.approx(1.0 / 6.0, rel=2e-3)


def test_a_train_without_a_carrier_has_no_passes():
    gears = [
        lumped.Gear(name=name, teeth=20, base_radius=0.02, inertia=1e-4)
        for name in ("a", "b")
    ]
    mesh = lumped.Mesh(driver=0, driven=1, pressure_angle=0.35)
    with pytest.raises(lumped.TrainError, match="carrier = None; a planetary set"):
        planet_passes(lumped.Train(gears=tuple(gears), meshes=(mesh,)))
