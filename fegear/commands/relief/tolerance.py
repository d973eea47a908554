"""What scatter of reliefs does to their objective."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fegear.commands.relief.objective import ReliefObjective
from fegear.commands.relief.relief_problem import ReliefProblem
from lumped.common.array_types import Array
from lumped.common.units import UM

SAMPLES = 200  # designs that are solved
QUANTILE = 0.95


@dataclass(frozen=True)
class ToleranceBand:
    """Objective that 95 % of gears with reliefs of some scatter do not exceed [m].

    first_order : by the derivatives of the best design
    solved : by solutions for the same designs; nominal : of the best design
    """

    nominal: float
    first_order: float
    solved: float
    samples: int

    @property
    def difference(self) -> float:
        """How far the rise by derivatives is from that by solutions, relative."""
        rise = self.solved - self.nominal
        return abs(self.first_order - self.solved) / max(rise, 1e-3 * self.nominal)


def tolerance_band(
    problem: ReliefProblem,
    design: Array,
    objective: ReliefObjective,
    magnitude: float,
    length: float,
    samples: int = SAMPLES,
) -> ToleranceBand:
    """Band of the objective where magnitudes and lengths are uniform within limits.

    The transmission errors are changed by their derivatives, and the objective of
    these is taken: its kinks, where other torques or positions count, are included.
    What is not are kinks of the transmission error itself, where a magnitude reaches
    zero or the contact reaches the start of a linear relief.

    magnitude : by which each may be larger or smaller [m]; length : [base pitches]
    """
    responses = problem.responses(design)
    count = len(problem.ranges)
    limits = np.zeros(design.size)  # leads are as they are
    limits[: 2 * count] = np.repeat([magnitude / UM, length], count)
    random = np.random.default_rng(0)
    changes = limits * random.uniform(-1.0, 1.0, (samples, design.size))
    low = np.array(problem.bounds)[:, 0]
    changes = np.maximum(design + changes, low) - design
    linear = [objective.of_linear(responses, change) for change in changes]
    solved = [objective.of(problem.values(design + change)) for change in changes]
    return ToleranceBand(
        nominal=objective.of_responses(responses),
        first_order=float(np.quantile(linear, QUANTILE)),
        solved=float(np.quantile(solved, QUANTILE)),
        samples=samples,
    )
