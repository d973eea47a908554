"""Lumped models at rest beside the mesh tables that they are made from.

At rest every model should have the static transmission error of its table. What it
has instead shows what its springs and gaps leave out.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from lumped.common.array_types import Array
from lumped.common.checks import require_fields
from lumped.common.short_repr import ShortRepr
from lumped.train.analytic import static_error
from lumped.train.excitation import MeshExcitation


@dataclass(frozen=True, eq=False)
class RestReference(ShortRepr):
    """What a mesh of a lumped model is compared with at rest.

    force : transmitted along the line of action [N]
    transmission_error : (n,) of the table, over whole base pitches [m]
    excitation : of the mesh, without friction and without `gap`
    gap : of all its tooth pairs [m], which the table does not have
    """

    force: float
    transmission_error: Array
    excitation: MeshExcitation
    gap: float = 0.0

    def __post_init__(self) -> None:
        require_fields(self)


@dataclass(frozen=True)
class StaticCheck:
    """Static transmission error of a mesh by a model and by its table [m].

    mesh : index from 0
    """

    mesh: int
    mean: float
    peak_to_peak: float
    reference_mean: float
    reference_peak_to_peak: float

    def __post_init__(self) -> None:
        require_fields(self)

    @property
    def error(self) -> float:
        """Relative error of the peak to peak."""
        return self.peak_to_peak / self.reference_peak_to_peak - 1.0

    @property
    def mean_error(self) -> float:
        """Relative error of the mean."""
        return self.mean / self.reference_mean - 1.0


def compare_at_rest(
    mesh: int, transmission_error: Array, reference: Array
) -> StaticCheck | None:
    """Compare transmission errors over whole base pitches [m].

    None where the reference does not vary.
    """
    if not np.ptp(reference) > 0.0:
        return None
    return StaticCheck(
        mesh=mesh,
        mean=float(transmission_error.mean()),
        peak_to_peak=float(np.ptp(transmission_error)),
        reference_mean=float(reference.mean()),
        reference_peak_to_peak=float(np.ptp(reference)),
    )


def check_springs(mesh: int, reference: RestReference) -> StaticCheck | None:
    """Compare the springs of a mesh (index from 0) at rest with their table."""
    excitation, expected = reference.excitation, reference.transmission_error
    error = static_error(excitation.pairs, reference.force)
    # the table covers one base pitch of equal teeth, or all until they repeat
    position = np.arange(expected.size) * (excitation.period / expected.size)
    return compare_at_rest(mesh, error(position), expected)


def remove_pitch_errors(excitation: MeshExcitation) -> MeshExcitation:
    """Return an excitation of tooth pairs without their pitch errors."""
    pairs = (
        replace(pair, gap=replace(pair.gap, offsets=np.zeros(0)))
        for pair in excitation.pairs
    )
    return replace(excitation, pairs=tuple(pairs))
