"""Gears of a carrier off their places, as gaps of the meshes that they are in.

A centre that is displaced by a small e moves its gear's teeth along the line of action
of each of its meshes. Coordinates of the gear count from its displaced place of rest,
so that e changes no spring, but the gap of the mesh: by -e.n where the gear drives and
by e.n where it is driven, with n the unit vector of the driver's push.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from lumped.common.array_types import Array
from lumped.train.bodies import TrainError
from lumped.train.coordinates import line_of_action
from lumped.train.excitation import MeshExcitation
from lumped.train.train import Train
from lumped.train.waves import Wave


def position_gaps(train: Train, errors: Sequence[float]) -> Array:
    """Gap of every mesh (m,) from position errors of the gears of a carrier.

    Parameters
    ----------
    train : Train
        Train with a carrier.
    errors : sequence of float
        Displacement of the centre of each of the carrier's gears along its circle [m],
        positive counter-clockwise; empty for none.

    Returns
    -------
    (m,) array
        Gap [m] on the drive side, positive where the error opens it; that of the back
        side is the opposite.

    Raises
    ------
    TrainError
        If there are not as many errors as gears of a carrier.
    """
    gaps, carrier = np.zeros(len(train.meshes)), train.carrier
    if not len(errors):
        return gaps
    places = carrier.gears if carrier else ()
    if carrier is None or len(errors) != len(places):
        raise TrainError(
            f"position errors: {len(errors)} for {len(places)} gears on a carrier"
        )
    for m, mesh in enumerate(train.meshes):
        x, y = line_of_action(train, mesh)
        for gear, side in ((mesh.driver, -1.0), (mesh.driven, 1.0)):
            if gear in places:
                place = places.index(gear)
                angle = carrier.angles[place]
                along = y * math.cos(angle) - x * math.sin(angle)
                gaps[m] += side * errors[place] * along
    return gaps


def with_gap(excitation: MeshExcitation, gap: float) -> MeshExcitation:
    """Return an excitation all of whose pairs have an additional gap [m]."""
    if gap == 0.0:
        return excitation
    pairs = (replace(pair, gap=_raised(pair.gap, gap)) for pair in excitation.pairs)
    return replace(excitation, pairs=tuple(pairs))


def _raised(wave: Wave, constant: float) -> Wave:
    coefficients = wave.coefficients.copy()
    coefficients[..., 0] += constant
    return replace(wave, coefficients=coefficients)
