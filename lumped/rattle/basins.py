"""Which motion a machine settles to, from a grid of departures from the upper flank.

Cell-to-cell mapping with many uncorrected returns: the centre of each cell is followed
until it is clear where it leads. C. S. Hsu and R. S. Guttalu, J. Appl. Mech. 47 (1980)
940; section 3.3 of the source.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from lumped.common.workers import Arrays, Compute, in_threads
from lumped.rattle.attractors import Attractor, sort_departures
from lumped.rattle.departures import Settled, settle_departures
from lumped.rattle.machine import Machine

Array = NDArray[np.float64]
Numbers = NDArray[np.int64]
TILE = 2_000  # cells that a worker takes at a time
BOX = 5  # cells a side of the boxes of basin entropy


@dataclass(frozen=True, kw_only=True)
class Grid:
    """Departures at the centres of cells, `side` of them in time and in speed.

    velocity : lowest and highest [rad per turn]; times are those of a turn
    """

    side: int
    velocity: tuple[float, float]

    def __post_init__(self) -> None:
        low, high = self.velocity
        if not 0.0 <= low < high < math.inf:
            raise ValueError(f"velocity must rise from 0 or more, got {low:g}:{high:g}")
        if self.side < 1:
            raise ValueError(f"side must be at least 1, got {self.side}")

    @property
    def cells(self) -> int:
        return self.side**2

    def departures(self, first: int, last: int) -> Array:
        """Times and speeds of cells (c, 2) by number, row by row of equal speeds."""
        low, high = self.velocity
        row, column = np.divmod(np.arange(first, last), self.side)
        speed = low + (row + 0.5) / self.side * (high - low)
        return np.stack([(column + 0.5) / self.side, speed], axis=1)


@dataclass(frozen=True, eq=False)
class Basins:
    """Number of the attractor of every cell (side, side), -1 where it is not
    identified, and the returns (side, side) until it was; speeds rise with the rows.
    """

    machine: Machine
    grid: Grid
    iterations: int
    attractors: tuple[Attractor, ...]
    attractor: Numbers
    returns: Numbers

    @property
    def fractions(self) -> Array:
        """Parts of the cells (attractors,)."""
        clear = self.attractor[self.attractor >= 0]
        return np.bincount(clear, minlength=len(self.attractors)) / self.grid.cells

    @property
    def entropy(self) -> float:
        """Basin entropy of boxes of five cells a side, 0 for one basin; NaN where it is
        not clear where any cell leads.

        A. Daza et al., Sci. Rep. 6 (2016) 31416, eq. 4.
        """
        count = self.grid.side // BOX
        if not count or not self.attractors:
            return math.nan
        inside = self.attractor[: count * BOX, : count * BOX]
        split = inside.reshape(count, BOX, count, BOX).swapaxes(1, 2)
        boxes = split.reshape(count**2, BOX**2)
        found = 0.0
        for number in range(-1, len(self.attractors)):
            part = (boxes == number).mean(axis=1)
            found -= float(np.sum(part * np.log(np.where(part > 0.0, part, 1.0))))
        return found / count**2


def settle_tile(
    machine: Machine, grid: Grid, first: int, last: int, iterations: int
) -> Arrays:
    """Follow cells from the first to before the last; see `Settled`."""
    cells = grid.departures(first, last)
    return settle_departures(machine, cells, iterations)._asdict()


def settle_grid(
    machine: Machine, grid: Grid, iterations: int, compute: Compute = in_threads
) -> Settled:
    """Follow all cells to their ends.

    compute : gives the arrays of tiles, on several cores or on a cluster
    """
    tiles = pairwise([*range(0, grid.cells, TILE), grid.cells])
    parts = {
        f"{number}": partial(settle_tile, machine, grid, first, last, iterations)
        for number, (first, last) in enumerate(tiles)
    }
    found = compute(parts)
    columns = ([found[name][key] for name in parts] for key in Settled._fields)
    return Settled(*map(np.concatenate, columns))


def basins_of(
    machine: Machine, grid: Grid, iterations: int, settled: Settled
) -> Basins:
    """The attractors that cells settle to, quiet first, and which cell leads where."""
    attractors, attractor, _ = sort_departures(machine, iterations, settled)
    shape = grid.side, grid.side
    return Basins(
        machine=machine,
        grid=grid,
        iterations=iterations,
        attractors=attractors,
        attractor=attractor.reshape(shape),
        returns=settled.returns.reshape(shape),
    )
