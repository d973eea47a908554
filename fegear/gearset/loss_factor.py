"""Power lost by sliding friction of rigid teeth, from the geometry of a pair alone."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from meshes import GearPair


def sliding_per_base_pitch(teeth: Sequence[int]) -> float:
    """Sliding a base pitch from the pitch point, over the speed along the line of
    action.

    teeth : of driver and driven gear, negative of an internal one
    """
    return 2.0 * math.pi * abs(sum(1.0 / z for z in teeth))


def equal_share_loss_factor(pair: GearPair) -> float:
    """Loss factor H_V of a mesh whose tooth pairs share the load equally.

    It is the loss over the coefficient of friction and the transmitted power, which is
    the mesh force times the speed along the line of action: friction acts normal to
    this line, so that the pressure angle does not appear. The mean of |x| over the n
    pairs in contact is integrated along the path, for any contact ratio. With the pitch
    point in single contact it is Ohlendorf's
    pi (1/z1 + 1/z2) (1 - eps + eps_1^2 + eps_2^2).
    """
    start, end = pair.path
    shifts = np.arange(math.ceil(end - start) + 1)
    edges = np.unique(np.concatenate([[0.0], start + shifts, end - shifts]))
    edges = edges[(edges >= start) & (edges <= end)]
    middle, length = 0.5 * (edges[1:] + edges[:-1]), np.diff(edges)
    others = middle[:, None] + np.concatenate([-shifts[1:], shifts])
    pairs = ((others > start) & (others < end)).sum(axis=1)
    mean = float(np.sum(length * np.abs(middle) / pairs))
    gears = pair.driver, pair.driven
    return sliding_per_base_pitch([gear.sign * gear.teeth for gear in gears]) * mean
