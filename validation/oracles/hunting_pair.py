"""A gear pair over all pairs of its teeth, integrated from one event to the next.

    m s'' + c s' + sum_n k(x - n) overlap(s - g_n) = F,    x = f t

Tooth n of the driver, counted as teeth come into contact, meets tooth n of the driven
gear; their errors add up to the gap g_n. A pair is x - n base pitches past the pitch
point. Its stiffness is a rectangle over the path of contact, shared evenly by two
pairs (multi-mesh source, eqs. 2.1-2.4, 2.28). Nothing is shared with the packages:
teeth are counted through the whole period of z1 z2 / gcd(z1, z2) mesh cycles, no
wave, table or phase is made.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class HuntingPair:
    """errors : material missing on each tooth of driver and driven gear [m]

    mean, variation : of the mesh stiffness [N/m], peak to peak over mean
    contact_ratio : from 1 to 2, half of it before the pitch point
    mass [kg], damping [N s/m], force [N], backlash [m] along the line of action
    """

    errors: tuple[tuple[float, ...], tuple[float, ...]]
    mean: float
    variation: float
    contact_ratio: float
    mass: float
    damping: float
    force: float
    backlash: float

    @property
    def period(self) -> int:
        """Mesh cycles after which the same teeth meet again."""
        return math.lcm(*(len(each) for each in self.errors))

    def gap(self, pair: int) -> float:
        one, two = self.errors
        return one[pair % len(one)] + two[pair % len(two)]

    def engaged(self, x: float) -> list[int]:
        """Pairs on the path of contact at a position between two events."""
        half = 0.5 * self.contact_ratio
        return [
            n
            for n in range(math.floor(x - half) - 1, math.ceil(x + half) + 2)
            if abs(x - n) < half
        ]

    def stiffness(self, pairs: int) -> float:
        """Of one of so many engaged pairs; the mean over a cycle is `mean` [N/m]."""
        extra = self.contact_ratio - 1.0  # part of the cycle with two pairs
        level = 1.0 - extra if pairs == 2 else -extra
        return self.mean * (1.0 + self.variation * level) / pairs

    def events(self, cycle: int) -> list[float]:
        """Positions in a cycle at which a pair enters or leaves, and its ends."""
        half = 0.5 * self.contact_ratio
        inner = {half % 1.0, -half % 1.0}
        return [cycle + x for x in sorted({0.0, 1.0, *inner})]

    def force_of(self, s: float, pairs: list[int]) -> float:
        """Mesh force [N] of engaged pairs at a deflection [m]."""
        total = 0.0
        for n in pairs:
            e = s - self.gap(n)
            overlap = max(e, 0.0) + min(e + self.backlash, 0.0)
            total += self.stiffness(len(pairs)) * overlap
        return total

    def apart(self, s: float, pairs: list[int]) -> bool:
        """Whether none of the pairs touches on either side."""
        gaps = [s - self.gap(n) for n in pairs]
        return all(-self.backlash <= e <= 0.0 for e in gaps)

    def static_error(self, x: float) -> float:
        """Deflection at which the engaged pairs carry the force at rest [m]."""
        pairs = self.engaged(x)
        free = self.rigid_error(x)
        most = free + len(pairs) * self.force / self.stiffness(len(pairs))
        return float(brentq(lambda s: self.force_of(s, pairs) - self.force, free, most))

    def rigid_error(self, x: float) -> float:
        """Transmission error of rigid teeth without load: the first pair to touch."""
        return min(self.gap(n) for n in self.engaged(x))


@dataclass(frozen=True, eq=False)
class HuntingMotion:
    """Over pieces between events, `points` rows each with the ends among them.

    x : positions; s [m], force [N]; lost : no pair touches; (pieces, points)
    """

    x: Array
    s: Array
    force: Array
    lost: NDArray[np.bool_]

    @property
    def contact_loss(self) -> float:
        """Part of the time."""
        return float((self.lost.mean(axis=1) * np.ptp(self.x, axis=1)).sum()) / (
            self.x[-1, -1] - self.x[0, 0]
        )


def motion(
    pair: HuntingPair, frequency: float, settle: int, points: int, rtol: float = 1e-10
) -> HuntingMotion:
    """The motion over one whole period after `settle` of them, from near rest."""
    scale = pair.force / pair.mean
    state = np.array([scale, 0.0])
    atol = rtol * scale * np.array([1.0, 2.0 * math.pi * frequency])
    rows: list[tuple[Array, Array, list[int]]] = []

    def slope(x: float, y: Array, pairs: list[int]) -> Array:
        push = pair.force - pair.damping * y[1] - pair.force_of(y[0], pairs)
        return np.array([y[1], push / pair.mass]) / frequency

    for cycle in range((settle + 1) * pair.period):
        for a, b in itertools.pairwise(pair.events(cycle)):
            pairs = pair.engaged(0.5 * (a + b))
            found = solve_ivp(
                slope,
                (a, b),
                state,
                method="DOP853",
                t_eval=np.linspace(a, b, points),
                args=(pairs,),
                rtol=rtol,
                atol=atol,
            )
            state = found.y[:, -1]
            if cycle >= settle * pair.period:
                rows.append((found.t - settle * pair.period, found.y[0], pairs))
    x, s = np.array([row[0] for row in rows]), np.array([row[1] for row in rows])
    force = [[pair.force_of(each, pairs) for each in way] for _, way, pairs in rows]
    lost = [[pair.apart(each, pairs) for each in way] for _, way, pairs in rows]
    return HuntingMotion(x, s, np.array(force), np.array(lost))
