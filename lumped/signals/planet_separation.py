"""Averages over the teeth of planets and sun, of a sensor that planets pass.

Whenever a planet passes the sensor on the ring, a window is cut from the signal and
assigned to the tooth of the planet, or of the sun, that is then in mesh. Windows of the
same teeth are averaged, and all together cover a turn of the gear: P. D. McFadden, A
technique for calculating the time domain averages of the vibration of the individual
planet gears and the sun gear in an epicyclic gearbox, J. Sound Vib. 144 (1991) 163.
Windows are tapered and overlap, as in Window functions for the calculation of the time
domain averages of the vibration of the individual planet gears and sun gear in an
epicyclic gearbox, J. Vib. Acoust. 116 (1994) 179.

A turn of the carrier against the ring has z_r mesh cycles, in which another tooth of a
gear with z teeth comes to the sensor. The sequence repeats after z / gcd(z, z_r) turns,
in which the planet passes with every gcd(z, z_r)th tooth; windows are as wide as twice
the largest distance of these teeth. Their sum is divided by that of the weights with
which the sensor feels the planet: what repeats with the teeth comes back as it is where
no other planet is felt within the windows.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from lumped.common.array_types import Array
from lumped.signals.ring_sensor import RingSensor, hann_window

MIN_TEETH = 1.0  # between neighbouring windows
# Least weight of any angle of the gear, over the mean one, below which noise is raised
MIN_WEIGHT = 0.05
TEETH_TOL = 1e-6  # by which windows may be wider than that of the sensor


@dataclass(frozen=True, eq=False, kw_only=True)
class PassingGear:
    """A planet, or the sun, whose teeth come to a sensor with planets.

    Parameters
    ----------
    teeth : int
        Its teeth, mesh cycles in a turn against the carrier.
    planets : tuple of int
        Numbers of the planets with which its teeth pass, from 0.
    leads : tuple of float
        Teeth by which the gear has turned further at each of these planets than at the
        one from which its turn is counted.
    """

    teeth: int
    planets: tuple[int, ...]
    leads: tuple[float, ...]

    def turns_needed(self, ring_teeth: int) -> int:
        """Turns of the carrier against the ring after which the same teeth pass.

        Parameters
        ----------
        ring_teeth : int
            Teeth of the ring.
        """
        return self.teeth // math.gcd(self.teeth, ring_teeth)


def planet_gear(number: int, teeth: int) -> PassingGear:
    """A planet, by its number from 0 and its teeth."""
    return PassingGear(teeth=teeth, planets=(number,), leads=(0.0,))


def sun_gear(sensor: RingSensor, teeth: int, sense: int) -> PassingGear:
    """The sun, whose turn is counted at the first planet.

    Parameters
    ----------
    sensor : RingSensor
        Sensor that the planets pass.
    teeth : int
        Teeth of the sun.
    sense : int
        1 where it turns counter-clockwise against the carrier, else -1.
    """
    angles = sensor.passes.angles
    leads = -sense * teeth * (angles - angles[0]) / (2.0 * math.pi)
    return PassingGear(
        teeth=teeth, planets=tuple(range(angles.size)), leads=tuple(leads.tolist())
    )


@dataclass(frozen=True, eq=False)
class SeparatedAverage:
    """Average of a sensor's signal over the turn of a gear whose teeth pass it.

    Parameters
    ----------
    values : (p,) array
        Average at equal angles of the gear, from the start of a turn.
    windows : int
        Number of windows.
    window_teeth : float
        Full width of each window [teeth].
    """

    values: Array
    windows: int
    window_teeth: float


def separated_average(
    signal: ArrayLike, samples: int, sensor: RingSensor, gear: PassingGear
) -> SeparatedAverage | None:
    """Average over the teeth of a gear, from windows in which planets pass a sensor.

    Parameters
    ----------
    signal : (k,) array_like
        Signal of the sensor at equal angles of the gears, from the start on.
    samples : int
        Samples in a mesh cycle.
    sensor : RingSensor
        Where the sensor is, and how it feels a planet.
    gear : PassingGear
        Gear over whose turn the average is.

    Returns
    -------
    SeparatedAverage or None
        The average; None where windows do not cover a turn of the gear, as those of the
        signal are too few, or their teeth farther apart than the sensor feels.
    """
    from scipy.interpolate import CubicSpline

    values = np.asarray(signal, float)
    last = (len(values) - 1) / samples
    passes = [
        _pass_cycles(sensor, planet, last + 1.0 / samples) for planet in gear.planets
    ]
    teeth_at_sensor = [p + lead for p, lead in zip(passes, gear.leads, strict=True)]
    width = _window_width(np.concatenate(teeth_at_sensor), gear.teeth)
    ring = sensor.passes.teeth
    if width > sensor.width * ring / (2.0 * math.pi) + TEETH_TOL:
        return None
    curve = CubicSpline(np.arange(len(values)) / samples, values)
    points = gear.teeth * samples
    sums, weights = np.zeros((2, points))
    for planet, lead in zip(gear.planets, gear.leads, strict=True):
        # cycles at which the gear is at points of its average
        first, end = math.ceil(lead * samples), math.floor((last + lead) * samples)
        position = np.arange(first, end + 1)
        cycles = np.clip(position / samples - lead, 0.0, last)
        angle = sensor.angles(cycles)[:, planet]
        taper = hann_window(angle * ring / (2.0 * math.pi), width)
        felt = taper * hann_window(angle, sensor.width)
        np.add.at(sums, position % points, taper * curve(cycles))
        np.add.at(weights, position % points, felt)
    if weights.min() < MIN_WEIGHT * weights.mean():
        return None
    windows = sum(len(cycles) for cycles in passes)
    return SeparatedAverage(sums / weights, windows, width)


def with_equal_loads(signal: ArrayLike, samples: int, sensor: RingSensor) -> Array:
    """Signal as if the mean forces of all planets were alike.

    An average over teeth of the sun has windows of all planets, and would have steps
    where their loads differ. Means are those of least squares through the windows of
    the sensor. Where the sun brings the same teeth to the same planets, what its teeth
    change slowly over its turn is taken for such means.

    Parameters
    ----------
    signal, samples, sensor
        As in `separated_average`.

    Returns
    -------
    (k,) array
        Signal.
    """
    values = np.asarray(signal, float)
    felt = sensor.weights(np.arange(len(values)) / samples)
    means, *_ = np.linalg.lstsq(felt, values)
    return np.asarray(values - felt @ (means - means.mean()))


def _pass_cycles(sensor: RingSensor, planet: int, end: float) -> Array:
    """Mesh cycles from 0 to below an end at which a planet is at the sensor."""
    passes = sensor.passes
    turn = -passes.sense * (passes.angles[planet] - sensor.direction) / (2.0 * math.pi)
    first = passes.teeth * (turn % 1.0)
    return np.asarray(first + passes.teeth * np.arange(math.ceil(end / passes.teeth)))


def _window_width(teeth_at_sensor: Array, teeth: int) -> float:
    """Full width of windows that overlap by half where their teeth are farthest apart.

    teeth_at_sensor : (w,) of the gear in the middle of each window, not wrapped
    """
    rounded = np.round(teeth_at_sensor % teeth, 9) % teeth
    places = np.unique(rounded)
    gaps = np.diff(np.concatenate([places, places[:1] + teeth]))
    return 2.0 * max(MIN_TEETH, float(gaps.max(initial=0.0)))
