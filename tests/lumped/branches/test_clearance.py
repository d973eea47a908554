"""One gear pair with clearance: answers of the literature in closed form."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import brentq

from lumped import (
    Gear,
    LumpedSystem,
    Mesh,
    StiffnessParameters,
    Train,
    analytic_excitation,
)
from lumped.branches.branch_settings import BranchSettings
from lumped.branches.motions import SpeedFamily
from lumped.branches.periodic import BranchFinder
from lumped.train.excitation import MeshExcitation, PairExcitation
from lumped.train.waves import constant_wave, wave_from_samples

RADII, INERTIAS = (0.05, 0.08), (3e-3, 2e-2)  # m, kg m2
MASS = 1.0 / sum(r * r / i for r, i in zip(RADII, INERTIAS, strict=True))
STIFFNESS, FORCE, CLEARANCE = 3e8, 1500.0, 2e-5  # N/m, N, m
NATURAL = math.sqrt(STIFFNESS / MASS) / (2.0 * math.pi)


def pair(excitation, damping, backlash):
    gears = tuple(
        Gear(
            name=f"gear {i}",
            teeth=teeth,
            base_radius=RADII[i],
            inertia=INERTIAS[i],
            torque=sign * FORCE * RADII[i],
        )
        for i, (teeth, sign) in enumerate(((25, 1.0), (40, 1.0)))
    )
    mesh = Mesh(driver=0, driven=1, pressure_angle=0.35, backlash=backlash)
    train = Train(gears=gears, meshes=(mesh,), damping_ratio=damping)
    return LumpedSystem(train, (excitation,))


def free_motion(stiffness, rate, time):
    """(2, 2) of m s'' + m rate s' + stiffness s = 0 over a time."""
    decay = 0.5 * rate
    omega = math.sqrt(stiffness / MASS - decay**2)
    c, s = math.cos(omega * time), math.sin(omega * time) / omega
    matrix = np.array([[c + decay * s, s], [-stiffness / MASS * s, c - decay * s]])
    return math.exp(-decay * time) * matrix


@pytest.mark.parametrize(("variation", "damping"), [(0.3, 0.02), (0.5, 0.05)])
def test_instability_is_that_of_meissners_equation(variation, damping):
    """Stiffness that takes two values in turn: trace = -(1 + det) at a doubling.

    E. Meissner, Schweizerische Bauzeitung 72 (1918) 95.
    """
    ratio = 1.4
    figures = StiffnessParameters(
        mean=STIFFNESS, variation=variation, contact_ratio=ratio
    )
    system = pair(analytic_excitation(figures, 3), damping, math.inf)
    low = STIFFNESS * (1.0 + variation * (1.0 - ratio))
    high = STIFFNESS * (1.0 + variation * (2.0 - ratio))
    rate = 2.0 * damping * 2.0 * math.pi * NATURAL

    def beyond(frequency):
        double = free_motion(high, rate, (ratio - 1.0) / frequency)
        transfer = free_motion(low, rate, (2.0 - ratio) / frequency) @ double
        return np.trace(transfer) + 1.0 + np.linalg.det(transfer)

    around = 1.7 * NATURAL, 2.0 * NATURAL, 2.3 * NATURAL
    exact = [brentq(beyond, *ends, xtol=1e-9) for ends in pairwise(around)]
    settings = BranchSettings(harmonics=20, period_multiple=1)
    finder = BranchFinder(SpeedFamily(system), (around[0], around[2]), settings)
    finder.from_rest(around[0])
    (branch,) = finder.branches
    assert [point.kind for point in branch.bifurcations] == ["period doubling"] * 2
    frequencies = [point.frequency for point in branch.bifurcations]
    np.testing.assert_allclose(frequencies, exact, rtol=1e-6)


def clipped(mean, amplitude):
    """Mean and cosine of max(mean + amplitude cos x, 0), amplitude >= 0."""
    angle = math.acos(min(max(-mean / amplitude, -1.0), 1.0))
    sine, twice = math.sin(angle), math.sin(2.0 * angle)
    constant_part = (mean * angle + amplitude * sine) / math.pi
    first = (2.0 * mean * sine + amplitude * (angle + 0.5 * twice)) / math.pi
    return constant_part, first


def test_one_harmonic_is_the_describing_function_of_clearance():
    """Under a sinusoidal transmission error, with flanks that open and strike behind.

    A. Kahraman and R. Singh, J. Sound Vib. 142 (1990) 49: mean and first harmonic of
    f(q) = q, 0, q + b over q = s - e.
    """
    damping, error = 0.03, 4e-6
    grid = np.arange(256) / 256.0
    wave = wave_from_samples(error * np.cos(2.0 * np.pi * grid))
    excitation = MeshExcitation(
        pairs=(PairExcitation(constant_wave(STIFFNESS), wave),),
        mean_stiffness=STIFFNESS,
    )
    system = pair(excitation, damping, CLEARANCE)
    limits = 0.6 * NATURAL, 1.2 * NATURAL
    settings = BranchSettings(harmonics=1, period_multiple=1)
    finder = BranchFinder(SpeedFamily(system), limits, settings)
    finder.find(limits[0])
    opened = struck = 0
    for branch in finder.branches:
        for point in branch.points:
            mean, a, b = point.x
            q = complex(a - error, -b)
            amplitude = abs(q)
            drive, back = (
                clipped(mean, amplitude),
                clipped(-mean - CLEARANCE, amplitude),
            )
            omega = 2.0 * math.pi * point.frequency
            s, turn = complex(a, -b), q / amplitude
            rate = 2.0 * damping * 2.0 * math.pi * NATURAL
            # the back side sees q turned round
            force = STIFFNESS * (drive[1] + back[1]) * turn
            left = MASS * (-(omega**2) + 1j * omega * rate) * s + force
            assert abs(left) < 1e-4 * STIFFNESS * amplitude
            assert STIFFNESS * (drive[0] - back[0]) == pytest.approx(FORCE, rel=1e-4)
            opened += mean < amplitude
            struck += -mean - CLEARANCE > -amplitude
    assert opened > 20
    assert struck > 3
