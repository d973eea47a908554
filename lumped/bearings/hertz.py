"""Load over approach of a rolling element between two races.

Point contact, Harris and Kotzalas, Rolling Bearing Analysis (2007), chapter 6, and
Hamrock and Brewe, J. Lubr. Technol. 105 (1983) 171; line contact, Palmgren, Ball and
Roller Bearing Engineering (1959).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

POINT_EXPONENT, LINE_EXPONENT = 3.0 / 2.0, 10.0 / 9.0
MAX_ELLIPTICITY = 1e4
PALMGREN = 3.84e-5  # mm at 1 N on a roller of 1 mm and the modulus below
PALMGREN_MODULUS = 2.0 * 206e9 / (2.0 * (1.0 - 0.3**2))  # effective modulus [Pa]
MILLIMETRE = 1e-3


@dataclass(frozen=True)
class EllipticContact:
    """Shape of the contact between two bodies of four principal curvatures.

    ellipticity : long over short half-axis of the contact ellipse, 1 or more
    first, second : complete elliptic integrals of modulus sqrt(1 - 1 / ellipticity^2)
    radius : R, reciprocal sum of the principal curvatures [m]
    """

    ellipticity: float
    first: float
    second: float
    radius: float

    def coefficient(self, modulus: float) -> float:
        """Force over approach^(3/2) [N/m^1.5] at an effective modulus E' [Pa]."""
        # eq. 6.5 of the multi-mesh source
        shape = math.sqrt(2.0 * self.second * self.radius / self.first)
        return math.pi * self.ellipticity * modulus / (3.0 * self.first) * shape

    def pressure(self, load: float, modulus: float) -> float:
        """Largest pressure [Pa] under a load [N] at an effective modulus E' [Pa]."""
        k, E2, R = self.ellipticity, self.second, self.radius
        # longer half-axis over the cube root of the load, which may be 0
        long = (6.0 * k**2 * E2 * R / (math.pi * modulus)) ** (1.0 / 3.0)
        return 1.5 * k * load ** (1.0 / 3.0) / (math.pi * long**2)


def line_pressure(
    load: float, length: float, curvature: float, modulus: float
) -> float:
    """Largest pressure [Pa] of a line contact.

    load : on the contact [N]; length : of it [m]; curvature : sum of both bodies' [1/m]
    modulus : effective modulus E' [Pa]
    """
    return math.sqrt(load * curvature * modulus / (2.0 * math.pi * length))


def effective_modulus(young_modulus: float, poisson_ratio: float) -> float:
    """E' of two equal materials [Pa], 2 / E' = 2 (1 - nu^2) / E."""
    return young_modulus / (1.0 - poisson_ratio**2)


def elliptic_contact(rolling: float, transverse: float) -> EllipticContact:
    """Contact of bodies by the sums of their curvatures in two normal planes [1/m].

    rolling : along the direction of rolling
    transverse : across it
    """
    from scipy.optimize import brentq

    difference = abs(rolling - transverse) / (rolling + transverse)

    def excess(ellipticity: float) -> float:
        first, second = _integrals(ellipticity)
        square = ellipticity**2
        ratio = ((square + 1.0) * second - 2.0 * first) / ((square - 1.0) * second)
        return ratio - difference

    ellipticity = 1.0
    if difference > 1e-9:
        ellipticity = brentq(excess, 1.0 + 1e-9, MAX_ELLIPTICITY, xtol=1e-13)
    first, second = _integrals(ellipticity)
    return EllipticContact(ellipticity, first, second, 1.0 / (rolling + transverse))


def _integrals(ellipticity: float) -> tuple[float, float]:
    from scipy.special import ellipe, ellipkm1

    complement = 1.0 / ellipticity**2
    return float(ellipkm1(complement)), float(ellipe(1.0 - complement))


def line_coefficient(length: float, modulus: float) -> float:
    """Force over approach^(10/9) [N/m^(10/9)] of a roller on one race.

    length : effective length of the roller [m]
    modulus : effective modulus E' [Pa]
    """
    compliance = PALMGREN * (PALMGREN_MODULUS / modulus) ** 0.9
    compliance *= (length / MILLIMETRE) ** -0.8
    return float((compliance * MILLIMETRE) ** -LINE_EXPONENT)


def in_series(one: float, other: float, exponent: float) -> float:
    """Coefficient of two contacts that carry one load, as an element between races."""
    return float(sum(k ** (-1.0 / exponent) for k in (one, other)) ** -exponent)
