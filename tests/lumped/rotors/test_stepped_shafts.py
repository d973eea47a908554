"""Stepped shafts at rest against the unit-load method."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad
from shafts_at_rest import SHEAR, YOUNG, bearing, cowper, shaft

from lumped.rotors.description import MIN_ELEMENT, Section
from lumped.rotors.statics import shaft_statics


@dataclass
class UnitLoads:
    """Compliances in one plane by integrals of internal moments of unit loads.

    ends, rigidities, slidings : of sections, E I and kappa G A
    places : of bearings, with their stiffness against motion and tilts
    """

    ends: list[float]
    rigidities: list[float]
    slidings: list[float]
    places: list[float]
    stiffnesses: list[float]
    tilts: list[float]

    def loads(self, force, moment, at):
        """All forces (position, force, moment) of a unit load on hinges at both ends.

        Moments are positive about the axis by which a slope is positive.
        """
        low, high = self.places[0], self.places[-1]
        far = -(force * (at - low) + moment) / (high - low)
        return [(at, force, moment), (low, -force - far, 0.0), (high, far, 0.0)]

    def integral(self, one, two):
        """Virtual work of internal forces and of both end bearings."""
        cuts = sorted({0.0, *self.ends, *(p for p, _, _ in (*one, *two))})
        total = 0.0
        for low, high in pairwise(cuts):
            index = int(np.searchsorted(self.ends, 0.5 * (low + high)))
            for inner, yields in (
                (bend, 1.0 / self.rigidities[index]),
                (push, 1.0 / self.slidings[index]),
            ):
                value, _ = quad(
                    lambda z, inner=inner: inner(z, one) * inner(z, two), low, high
                )
                total += value * yields
        for number, stiffness in ((1, self.stiffnesses[0]), (2, self.stiffnesses[-1])):
            total += one[number][1] * two[number][1] / stiffness
        return total

    def compliance(self, units):
        """Matrix of units (force, moment, position), with redundant supports."""
        redundant = [(1.0, 0.0, place) for place in self.places[1:-1]]
        yields = [1.0 / k for k in self.stiffnesses[1:-1]]
        for place, tilt in zip(self.places, self.tilts, strict=True):
            if tilt:
                redundant.append((0.0, 1.0, place))
                yields.append(1.0 / tilt)
        states = [self.loads(*unit) for unit in (*units, *redundant)]
        work = np.array([[self.integral(a, b) for b in states] for a in states])
        n = len(units)
        released = work[n:, n:] + np.diag(yields)
        if not redundant:
            return work
        return work[:n, :n] - work[:n, n:] @ np.linalg.solve(released, work[n:, :n])


def bend(z, forces):
    """Internal moment by what is beyond z."""
    return sum(f * (p - z) + m for p, f, m in forces if p > z)


def push(z, forces):
    return sum(f for p, f, _ in forces if p > z)


def random_shaft(rng, count, stiff_against_tilt):
    """Stepped shaft with hollow sections on bearings, and places of loads.

    Those with parts that are nearly in one place, which have rigid arms, are left out.
    """
    while True:
        rotor, places = any_shaft(rng, count, stiff_against_tilt)
        ends = np.cumsum([0.0, *(section.length for section in rotor.sections)])
        stations = [*ends, *places, *(one.position for one in rotor.bearings)]
        if np.diff(np.sort(stations)).min() > MIN_ELEMENT * rotor.length:
            return rotor, places


def any_shaft(rng, count, stiff_against_tilt):
    sections = tuple(
        Section(length=length, diameter=diameter, bore=diameter * bore)
        for length, diameter, bore in zip(
            rng.uniform(0.02, 0.3, 4),
            rng.uniform(0.02, 0.08, 4),
            rng.choice([0.0, 0.3, 0.8], 4),
            strict=True,
        )
    )
    length = sum(section.length for section in sections)
    slots = length * (np.arange(count) + rng.uniform(0.1, 0.9, count)) / count
    tilts = 10.0 ** rng.uniform(3, 6, count) if stiff_against_tilt else [0.0] * count
    bearings = [
        bearing(z, *(10.0 ** rng.uniform(6, 9, 2)), tilt_stiffness=tilt)
        for z, tilt in zip(slots, tilts, strict=True)
    ]
    places = length * np.array([rng.uniform(0.05, 0.45), rng.uniform(0.55, 0.95)])
    return shaft(bearings, sections), places.tolist()


def unit_loads(rotor, axis):
    sections = rotor.sections
    areas = [math.pi * (s.diameter**2 - s.bore**2) / 4.0 for s in sections]
    return UnitLoads(
        ends=np.cumsum([section.length for section in sections]).tolist(),
        rigidities=[
            YOUNG * math.pi * (s.diameter**4 - s.bore**4) / 64.0 for s in sections
        ],
        slidings=[
            cowper(s.bore / s.diameter) * SHEAR * area
            for s, area in zip(sections, areas, strict=True)
        ],
        places=[one.position for one in rotor.bearings],
        stiffnesses=[one.stiffness[3 * axis] for one in rotor.bearings],
        tilts=[one.tilt_stiffness for one in rotor.bearings],
    )


@pytest.mark.parametrize(
    ("count", "stiff_against_tilt"), [(2, False), (3, False), (3, True)]
)
def test_stepped_shafts_by_integrals_over_unit_loads(count, stiff_against_tilt):
    rng = np.random.default_rng(73)
    for _ in range(20):
        rotor, places = random_shaft(rng, count, stiff_against_tilt)
        compliance = shaft_statics(rotor, places).compliance
        units = [unit for p in places for unit in ((1.0, 0.0, p), (0.0, 1.0, p))]
        expected = unit_loads(rotor, 0).compliance(units)
        in_xz = np.array([0, 4, 5, 9])
        scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
        errors = (compliance[np.ix_(in_xz, in_xz)] - expected) / scale
        assert np.abs(errors).max() < 1e-9
        expected = unit_loads(rotor, 1).compliance(units)
        in_yz, signs = np.array([1, 3, 6, 8]), np.array([1.0, -1.0, 1.0, -1.0])
        scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
        turned = np.outer(signs, signs) * compliance[np.ix_(in_yz, in_yz)]
        assert np.abs((turned - expected) / scale).max() < 1e-9
        np.testing.assert_array_equal(compliance[np.ix_(in_xz, in_yz)], 0.0)
