"""Rigid gears of which a tooth is missing: how far the driven one falls back.

The geometry of `RigidPair` is written anew from two involutes; it shares nothing with
the package.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import brentq

from fegear.gearset import make_gear_set


def inv(angle):
    return math.tan(angle) - angle


class RigidPair:
    """An external spur pair at its operating pressure angle, without backlash."""

    def __init__(self, base_radii, tip_radii, distance):
        self.rb, self.ra, self.a = base_radii, tip_radii, distance
        self.working = math.acos(sum(base_radii) / distance)

    def flank(self, gear, radius):
        """Angle of a flank point from where the flank crosses the pitch circle."""
        return inv(math.acos(min(1.0, self.rb[gear] / radius))) - inv(self.working)

    def lag(self, theta):
        """Lag of the driven gear [m] for one pair of teeth, the driver at theta [rad].

        theta : from where both flanks pass the pitch point
        """
        roll = math.tan(self.working) + theta
        line = sum(self.rb) * math.tan(self.working)
        radius = self.rb[0] * math.hypot(1.0, roll)
        mate = math.hypot(self.rb[1], line - self.rb[0] * roll)
        if roll > 0.0 and radius <= self.ra[0] and mate <= self.ra[1]:
            return 0.0
        if roll > 0.0 and radius > self.ra[0]:
            return self._tip_of_driver(theta)
        return self._tip_of_driven(theta)

    def _tip_of_driver(self, theta):
        angle = theta - self.flank(0, self.ra[0])
        x, y = self.ra[0] * math.cos(angle), self.ra[0] * math.sin(angle)
        radius, place = math.hypot(self.a - x, y), math.atan2(y, self.a - x)
        if not self.rb[1] <= radius <= self.ra[1]:
            return math.inf
        return self.rb[0] * theta - self.rb[1] * (place - self.flank(1, radius))

    def _tip_of_driven(self, theta):
        def miss(turned):
            place = turned + self.flank(1, self.ra[1])
            x = self.a - self.ra[1] * math.cos(place)
            y = self.ra[1] * math.sin(place)
            radius = math.hypot(x, y)
            if radius < self.rb[0]:
                return math.nan
            return theta - self.flank(0, radius) - math.atan2(y, x)

        nominal = self.rb[0] * theta / self.rb[1]
        grid = nominal - np.linspace(0.0, 0.2, 401)
        values = [miss(turned) for turned in grid]
        for low, high, one, other in zip(
            grid[1:], grid, values[1:], values, strict=False
        ):
            if np.isfinite([one, other]).all() and one * other <= 0.0:
                turned = brentq(miss, low, high, xtol=1e-15)
                return self.rb[0] * theta - self.rb[1] * turned
        return math.inf

    def fallen_back(self, theta, pitch, missing):
        """Lag [m] of the pairs that are there, by how many pitches they are ahead.

        missing : pitches of the pair that is not there
        """
        lags = [self.lag(theta + k * pitch) for k in range(-3, 4) if k not in missing]
        return min(lags)


def random_pair(seed, helical=False):
    """A pair of which a tooth is missing, of a contact ratio from 1 to 2."""
    rng = np.random.default_rng(seed)
    teeth = rng.integers(18, 60), rng.integers(18, 80)
    pressure = float(rng.uniform(18.0, 25.0))
    gears = [
        {
            "name": name,
            "teeth": int(z),
            "module_mm": 3.0,
            "face_width_mm": 20.0,
            "pressure_angle_deg": pressure,
            "profile_shift": float(shift),
            "addendum_mm": 3.0 * float(addendum),
            "hub_radius_mm": 12.0,
        }
        for name, z, shift, addendum in zip(
            "ab", teeth, rng.uniform(-0.1, 0.2, 2), rng.uniform(0.7, 1.0, 2),
            strict=True,
        )
    ]  # fmt: skip
    if helical:
        angle = float(rng.uniform(5.0, 12.0))
        for gear, hand in zip(gears, ("left", "right"), strict=True):
            gear |= {"helix_angle_deg": angle, "hand": hand}
    gear = int(rng.integers(0, 2))
    gears[gear]["missing_teeth"] = [int(rng.integers(3, 15))]
    mesh = {"driver": "a", "driven": "b", "backlash_um": 100.0}
    return make_gear_set({"name": "gap", "gear": gears, "mesh": [mesh]})
