"""No meeting of the flanks is missed: arcs from event to event beside dense samples.

`python tests/lumped/rattle/test_crossings.py 1000000` does the same from a million
departures of each machine.
"""

from __future__ import annotations

import sys

import numpy as np
import pytest
from oracles.rattle_arcs import min_clearances

from lumped.rattle.arcs import arcs_of
from lumped.rattle.machine import Machine
from lumped.rattle.return_map import follow

FIGURES = {"damping": 0.6, "eccentricity": 0.1, "half_backlash": 0.6}
KINDS = {
    "impacts": {},
    "loud": {"eccentricity": 0.5},
    "small": {"damping": 6e-4, "eccentricity": 1e-4, "half_backlash": 6e-4},
    "soft": {"stiffness": 60.0, "eccentricity": 0.3},
    "stiff": {"stiffness": 1e4},
    "ripple": {"eccentricity": 0.1, "ripple": 6.0, "ripple_order": 7},
}
SAMPLES = 400  # of an arc
SHARE = 2000  # departures at a time


def misses(name: str, count: int, seed: int = 1) -> tuple[int, float, float]:
    """Arcs of so many returns, the deepest that one passes a bound, and the farthest
    that one ends from its bound, over the half backlash."""
    figures = FIGURES | KINDS[name]
    machine, random = Machine(**figures), np.random.default_rng(seed)
    fastest = 12.0 * figures["damping"]
    total, deepest, farthest = 0, 0.0, 0.0
    for first in range(0, count, SHARE):
        share = min(SHARE, count - first)
        starts = random.uniform((0.0, 0.0), (1.0, fastest), (share, 2))
        arc_sets = [arcs_of(machine, follow(machine, start, 2)) for start in starts]
        arcs = np.concatenate(arc_sets)
        clearance, ends = min_clearances(figures, arcs, SAMPLES)
        total += len(arcs)
        deepest = max(deepest, float(-clearance.min()) / figures["half_backlash"])
        farthest = max(farthest, float(ends.max()) / figures["half_backlash"])
    return total, deepest, farthest


@pytest.mark.slow
@pytest.mark.parametrize("name", KINDS)
def test_arcs_keep_to_the_play_and_end_on_its_bounds(name):
    total, deepest, farthest = misses(name, 2000)
    assert total > 1500
    assert deepest < 1e-8  # round-off of the oracle at small damping
    assert farthest < 1e-8


def test_a_meeting_that_is_missed_would_be_seen():
    """Arcs that go on past the lower flank are."""
    machine = Machine(**FIGURES)
    arcs = arcs_of(machine, follow(machine, (0.3, 6.5), 2))
    assert len(arcs) == 2
    arcs[0, 2] = arcs[1, 2]
    clearance, _ = min_clearances(FIGURES, arcs[:1], SAMPLES)
    assert clearance[0] < -0.1


if __name__ == "__main__":
    for kind in KINDS:
        sys.stdout.write(f"{kind}: {misses(kind, int(sys.argv[1]))}\n")
