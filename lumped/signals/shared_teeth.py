"""Which tooth differs of a gear whose teeth are in several meshes.

Forces at both meshes of a planet are nearly equal, so that a fault in one is felt in
the other with about the same size: a signal has the fault twice in a turn, and one of
the two is in the contact of another tooth. Of all teeth the faulty one is in contact,
in one mesh or the other, at all times of its effect.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from lumped.common.array_types import Array
from lumped.signals.faulty_tooth import Engagement

# Weight of the other mesh of a planet for the transmission error of one: on stiff
# bearings a fault in either mesh shows in both alike, on soft ones in its own alone
OTHER_MESH_WEIGHT = 0.7


def tooth_of_meshes(
    residual: Array, engagements: Sequence[Engagement], other_weight: float = 1.0
) -> tuple[int, float]:
    """Tooth that differs most in all meshes of its gear, from 1, and its RMS there.

    Parameters
    ----------
    residual : (p,) array
        Residual of an average over a turn of the gear.
    engagements : sequence of Engagement
        Contact of the gear's teeth in its meshes.
    other_weight : float, optional
        Weight of the meshes after the first one.
    """
    teeth = engagements[0].teeth.size
    integrals = np.zeros((len(engagements), teeth))
    for integral, engagement in zip(integrals, engagements, strict=True):
        # not the means, in which a short contact of another tooth would count more
        length = engagement.end - engagement.start
        by_place = engagement.mean_squares(residual[:, None])[:, 0]
        integral[engagement.teeth - 1] = length * by_place
    weights = np.full(len(engagements), other_weight)
    weights[0] = 1.0
    index = int((weights @ integrals).argmax())
    duration = sum(engagement.end - engagement.start for engagement in engagements)
    return 1 + index, math.sqrt(integrals[:, index].sum() / duration)
