"""The oracle of relieved flanks against what is known of involutes."""

from __future__ import annotations

import math

import numpy as np
import pytest
from oracles.relieved_flanks import Flank, closing_way, relief_depth

BASES = 0.047, 0.0695  # m
DISTANCE = 0.12479
LINE = math.sqrt(DISTANCE**2 - sum(BASES) ** 2)
PITCH_POINT = LINE * BASES[0] / sum(BASES)
REACH = 0.009  # m, of both tips past the pitch point


def none(s):
    return 0.0 * s


def way(roll, driver=none, driven=none):
    tips = PITCH_POINT + REACH, LINE - PITCH_POINT + REACH
    lows = LINE - tips[1] - 0.002, LINE - tips[0] - 0.002
    flanks = (
        Flank(*dimensions)
        for dimensions in zip(BASES, tips, lows, (driver, driven), strict=True)
    )
    return closing_way(*flanks, DISTANCE, PITCH_POINT + roll)


@pytest.mark.parametrize("roll", [-0.008, -0.001, 0.0, 0.003, 0.0085])
def test_unmodified_flanks_touch_on_the_whole_path(roll):
    assert abs(way(roll)) < 1e-15


@pytest.mark.parametrize("roll", [-0.004, 0.0085])
def test_equal_depth_everywhere_is_a_turn(roll):
    def depth(s):
        return 5e-6 + 0.0 * s

    assert way(roll, driver=depth) == pytest.approx(5e-6, abs=1e-15)
    assert way(roll, driven=depth) == pytest.approx(5e-6, abs=1e-15)


def test_tip_corners_close_off_the_path():
    ways = [way(roll) for roll in (0.0091, 0.0095, 0.01, 0.011)]
    assert ways[0] > 0.0
    assert (np.diff(ways) > 0.0).all()


def test_small_linear_relief():
    """The closest point leaves the nominal one along the slope e' by R e' and saves
    R e'^2 / 2; R is of relative curvature, e' the slope along the arc."""
    start, end, roll = PITCH_POINT + 0.002, PITCH_POINT + REACH, 0.006
    s1, s2 = PITCH_POINT + roll, LINE - PITCH_POINT - roll
    for magnitude in (1e-6, 4e-6):
        slope = magnitude / (end - start) * BASES[0] / s1
        saved = 0.5 * s1 * s2 / LINE * slope**2
        expected = magnitude * (s1 - start) / (end - start) - saved
        closing = way(roll, driver=relief_depth(magnitude, start, end, 1.0))
        assert closing == pytest.approx(expected, abs=0.02 * saved)
