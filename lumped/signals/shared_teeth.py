"""Which tooth differs of a gear whose teeth are in several meshes.

Forces at both meshes of a planet, or of an idler, are nearly equal, so that a fault in
one is felt in the other with about the same size: a signal has the fault twice in a
turn, and one of the two is in the contact of another tooth. Of all teeth the faulty one
is in contact, in one mesh or the other, at all times of its effect.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from lumped.common.array_types import Array
from lumped.signals.faulty_tooth import Engagement


def tooth_of_meshes(
    residual: Array, engagements: Sequence[Engagement]
) -> tuple[int, float]:
    """Tooth that differs most in all meshes of its gear, from 1, and its RMS there.

    Parameters
    ----------
    residual : (p,) array
        Residual of an average over a turn of the gear.
    engagements : sequence of Engagement
        Contact of the gear's teeth in its meshes.
    """
    squares = np.zeros(engagements[0].teeth.size)
    for engagement in engagements:
        by_place = engagement.mean_squares(residual[:, None])[:, 0]
        squares[engagement.teeth - 1] += by_place / len(engagements)
    index = int(squares.argmax())
    return 1 + index, math.sqrt(squares[index])
