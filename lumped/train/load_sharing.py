"""How the planets of a carrier share the load.

The share of a planet is the force in its mesh with the sun over the sum of these
forces, which is its part of the sun's torque: 1/N each where N planets are equal.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lumped.common.array_types import Array
from lumped.common.checks import require_fields
from lumped.train.bodies import TrainError
from lumped.train.train import Train


@dataclass(frozen=True, eq=False)
class LoadSharing:
    """Forces of p planets over a period of their meshes.

    sun_force, ring_force : (p,) mean force [N] of the mesh with the sun, and with the
        ring
    share : (p,) part of the mean of the sun's torque, NaN where that is none
    share_peak : (p,) largest in the period, over the mean torque
    """

    sun_force: Array
    ring_force: Array
    share: Array
    share_peak: Array

    def __post_init__(self) -> None:
        require_fields(self)


def planet_meshes(train: Train) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Meshes (p,) of the carrier's gears with the sun, and with the ring.

    Raises TrainError where the train has no carrier, or one of its gears not both.
    """
    if train.carrier is None:
        raise TrainError("load sharing is that of gears on a carrier; there is none")
    sides: list[list[int]] = []
    for gear in train.carrier.gears:
        meshes = [m for m, x in enumerate(train.meshes) if gear in (x.driver, x.driven)]
        meshes.sort(key=lambda m: train.is_internal(train.meshes[m]))
        internal = [train.is_internal(train.meshes[m]) for m in meshes]
        if internal != [False, True]:
            raise TrainError(
                f"gear {train.gears[gear].name!r}: one mesh with a sun and one with a "
                "ring are needed for load sharing"
            )
        sides.append(meshes)
    suns, rings = zip(*sides, strict=True)
    return np.array(suns), np.array(rings)


def load_sharing(train: Train, force: Array, time: Array | None = None) -> LoadSharing:
    """Load sharing by forces of all meshes over a period.

    Parameters
    ----------
    train : Train
        Train with a carrier.
    force : (t, m) array
        Forces of the meshes [N].
    time : (t,) array, optional
        Times of the forces [s], the first and the last a period apart; without them
        forces are at even positions.

    Returns
    -------
    LoadSharing
        Shares of the carrier's gears.

    Raises
    ------
    TrainError
        If the gears of the carrier have not each a mesh with a sun and one with a ring.
    """
    suns, rings = planet_meshes(train)
    if time is None:
        mean = force.mean(axis=0)
    else:
        mean = np.trapezoid(force, time, axis=0) / (time[-1] - time[0])
    total = float(mean[suns].sum())
    scale = 1.0 / total if total > 0.0 else np.nan
    return LoadSharing(
        sun_force=mean[suns],
        ring_force=mean[rings],
        share=scale * mean[suns],
        share_peak=scale * force[:, suns].max(axis=0),
    )
