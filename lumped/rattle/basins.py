"""Basins of attraction of a machine, from a grid of departures from the upper flank.

The method is cell-to-cell mapping with many uncorrected returns: the centre of each
cell is followed until its attractor is known. See C. S. Hsu and R. S. Guttalu,
J. Appl. Mech. 47 (1980) 940, and section 3.3 of the source.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np

from lumped.common.array_types import Array, Indices
from lumped.common.checks import format_number
from lumped.common.workers import Arrays, Compute, compute_in_threads
from lumped.rattle.attractors import RattleAttractor, classify_attractors
from lumped.rattle.machine import Machine
from lumped.rattle.return_map import Settled, iterate_map_points

CELLS_PER_TILE = 2_000  # cells that a worker takes at a time
BOX_SIDE = 5  # cells per side of the boxes of basin entropy


@dataclass(frozen=True, kw_only=True)
class InitialGrid:
    """Departures at the centres of cells, `side` of them in time and in speed.

    velocity : lowest and highest speed [rad per turn]; times span one turn
    """

    side: int
    velocity: tuple[float, float]

    def __post_init__(self) -> None:
        low, high = self.velocity
        if not 0.0 <= low < high < math.inf:
            raise ValueError(
                f"velocity = {format_number(low)}:{format_number(high)}; must rise "
                "from 0 or more"
            )
        if self.side < 1:
            raise ValueError(f"side = {self.side}; must be at least 1")

    @property
    def cells(self) -> int:
        return self.side**2

    def initial_conditions(self, first: int, last: int) -> Array:
        """Times and speeds (c, 2) of cells by number, row by row of equal speeds."""
        low, high = self.velocity
        row, column = np.divmod(np.arange(first, last), self.side)
        speed = low + (row + 0.5) / self.side * (high - low)
        return np.stack([(column + 0.5) / self.side, speed], axis=1)


@dataclass(frozen=True, eq=False)
class BasinMap:
    """Attractor index (side, side) of every cell, -1 if undecided, and the number of
    returns (side, side) until it was known; speeds increase with the rows."""

    machine: Machine
    grid: InitialGrid
    iterations: int
    attractors: tuple[RattleAttractor, ...]
    attractor: Indices
    returns: Indices

    @property
    def fractions(self) -> Array:
        """Fractions (attractors,) of the cells."""
        clear = self.attractor[self.attractor >= 0]
        return np.bincount(clear, minlength=len(self.attractors)) / self.grid.cells

    @property
    def entropy(self) -> float:
        """Basin entropy of boxes of five cells per side, 0 for one basin; NaN if no
        cell is decided.

        See A. Daza et al., Sci. Rep. 6 (2016) 31416, eq. 4.
        """
        count = self.grid.side // BOX_SIDE
        if not count or not self.attractors:
            return math.nan
        inside = self.attractor[: count * BOX_SIDE, : count * BOX_SIDE]
        split = inside.reshape(count, BOX_SIDE, count, BOX_SIDE).swapaxes(1, 2)
        boxes = split.reshape(count**2, BOX_SIDE**2)
        total = 0.0
        for number in range(-1, len(self.attractors)):
            part = (boxes == number).mean(axis=1)
            total -= float(np.sum(part * np.log(np.where(part > 0.0, part, 1.0))))
        return total / count**2


def settle_tile(
    machine: Machine, grid: InitialGrid, first: int, last: int, iterations: int
) -> Arrays:
    """Follow the cells from `first` to before `last`; see `Settled`."""
    cells = grid.initial_conditions(first, last)
    return iterate_map_points(machine, cells, iterations)._asdict()


def settle_grid(
    machine: Machine,
    grid: InitialGrid,
    iterations: int,
    compute: Compute = compute_in_threads,
) -> Settled:
    """Follow all cells.

    compute : function that computes the arrays of tiles, on several cores or a cluster
    """
    tiles = pairwise([*range(0, grid.cells, CELLS_PER_TILE), grid.cells])
    parts = {
        f"{number}": partial(settle_tile, machine, grid, first, last, iterations)
        for number, (first, last) in enumerate(tiles)
    }
    tile_results = compute(parts)
    columns = ([tile_results[name][key] for name in parts] for key in Settled._fields)
    return Settled(*map(np.concatenate, columns))


def basins_of(
    machine: Machine, grid: InitialGrid, iterations: int, settled: Settled
) -> BasinMap:
    """Attractors that cells converge to, quiet first, with the basin of each."""
    attractors, attractor, _ = classify_attractors(machine, iterations, settled)
    shape = grid.side, grid.side
    return BasinMap(
        machine=machine,
        grid=grid,
        iterations=iterations,
        attractors=attractors,
        attractor=attractor.reshape(shape),
        returns=settled.returns.reshape(shape),
    )
