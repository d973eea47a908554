"""Load on the most loaded element in closed form, by Stribeck and Sjoevall.

Harris and Kotzalas, Rolling Bearing Analysis (2007), section 7.2. A sum over elements
becomes an integral over the circumference.
"""

from __future__ import annotations

import math

from scipy.integrate import quad
from scipy.optimize import brentq

from lumped.bearings.rolling import RollingBearing

MIN_ZONE = 1e-9  # smallest extent of the loaded zone looked at
MAX_ZONE = 1e9  # beyond it all elements are loaded alike


def load_integral(zone: float, exponent: float) -> float:
    """Sjoevall's radial load integral J_r.

    zone : extent of the loaded zone over the diameter, 1/2 without clearance
    """
    limit = math.pi if zone >= 1.0 else math.acos(1.0 - 2.0 * zone)

    def load(angle: float) -> float:
        approach = 1.0 - (1.0 - math.cos(angle)) / (2.0 * zone)
        return float(max(approach, 0.0) ** exponent * math.cos(angle))

    return float(quad(load, 0.0, limit, epsabs=1e-13, limit=200)[0] / math.pi)


def max_element_load(bearing: RollingBearing, load: float) -> float:
    """Load on the most loaded element [N] under a radial load [N], with clearance.

    Without clearance it is some 4.37 (balls) or 4.08 (rollers) times the load over the
    number of elements, Stribeck's numbers.
    """
    gap, n = bearing.free_gap, bearing.exponent

    def carried(zone: float) -> tuple[float, float]:
        # displacement r of the ring: zone = (1 - gap / r) / 2, approach r - gap
        approach = 2.0 * zone * abs(gap) / abs(1.0 - 2.0 * zone)
        largest = bearing.coefficient * approach**n
        return bearing.elements * largest * load_integral(zone, n), largest

    if gap == 0.0:
        return load / (bearing.elements * load_integral(0.5, n))
    bounds = (MIN_ZONE, 0.5 - MIN_ZONE) if gap > 0.0 else (0.5 + MIN_ZONE, MAX_ZONE)
    zone = brentq(lambda zone: math.log(carried(zone)[0] / load), *bounds, xtol=1e-14)
    return carried(zone)[1]
