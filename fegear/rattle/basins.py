"""Basins of attraction of a machine: computed, kept, summed up and written."""

from __future__ import annotations

import io
import math
from collections.abc import Iterator
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fegear.errors import InputError
from fegear.output import write_whole
from fegear.rattle.limits import MOST_RETURNS
from fegear.rattle.machines import NamedMachine, figures_of
from fegear.result import Result
from fegear.store import Checkpoint, Keeping
from fegear.version import package_version
from lumped.progress import Progress, silent
from lumped.rattle.basins import (
    Basins,
    Grid,
    basins_of,
    settle_grid,
    tiles_of,
)
from lumped.rattle.departures import Settled, settling_returns
from lumped.rattle.figure import draw_basins
from lumped.workers import Cluster, NoClusterError

if TYPE_CHECKING:
    from matplotlib.figure import Figure


SURE = 1.96  # standard errors of an interval that holds the value 19 times of 20
MOST_CELLS = 40_000_000  # of which each takes 48 bytes


@dataclass(frozen=True, eq=False, repr=False)
class BasinsResult(Result):
    """Basins of a named machine."""

    named: NamedMachine
    basins: Basins

    @property
    def summary(self) -> dict[str, Any]:
        """Plain values, ready for JSON."""
        basins = self.basins
        low, high = basins.grid.velocity
        clear = float(np.mean(basins.attractor >= 0))
        return {
            **self.named.heading,
            **figures_of(basins.machine),
            "cells_a_side": basins.grid.side,
            "velocity_rad_per_turn": [low, high],
            "iterations": basins.iterations,
            "attractors": [self._plain(i) for i in range(len(basins.attractors))],
            "unclear_fraction": 1.0 - clear,
            "basin_entropy": basins.entropy,
            "warnings": list(self._warnings()),
        }

    def _warnings(self) -> Iterator[str]:
        basins = self.basins
        unclear = float(np.mean(basins.attractor < 0))
        if unclear:
            needed = settling_returns(basins.machine)
            yield unsettled(unclear, "cells", basins.iterations, needed)

    def _plain(self, number: int) -> dict[str, Any]:
        basins, attractor = self.basins, self.basins.attractors[number]
        fraction, count = float(basins.fractions[number]), basins.grid.cells
        error = math.sqrt(fraction * (1.0 - fraction) / count)
        time, speed = attractor.point
        at_rest = attractor.exponent == -math.inf  # quiet or sticking: reached exactly
        return {
            "name": attractor.name,
            "fraction": fraction,
            "fraction_of_random_starts_within": SURE * error,
            "period": attractor.period,
            "point": None if math.isnan(time) else [time, speed],
            "lyapunov_per_turn": None if at_rest else attractor.exponent,
            "seen_to_end_after_returns": attractor.settles or None,
        }

    def to_npz(self, path: str | PathLike[str]) -> None:
        """Write attractors and returns of the cells, rows of rising speed."""
        basins = self.basins
        figures = figures_of(basins.machine)
        arrays: dict[str, Any] = {
            "attractor": basins.attractor.astype(np.int32),
            "returns": basins.returns.astype(np.int32),
            "velocity_rad_per_turn": np.array(basins.grid.velocity),
            "fraction": basins.fractions,
            "names": np.array([attractor.name for attractor in basins.attractors], str),
            "iterations": np.array(basins.iterations),
            **{k: np.array(math.inf if v is None else v) for k, v in figures.items()},
        }
        out = io.BytesIO()
        np.savez_compressed(out, **arrays)
        write_whole(Path(path), lambda beside: beside.write_bytes(out.getvalue()))

    def draw(self) -> Figure:
        return draw_basins(self.basins, self.named.name)


def unsettled(part: float, what: str, iterations: int, needed: int) -> str:
    """What to do about departures that have not settled."""
    more = f"half the damping ends transients in {needed}: --iterations {needed}"
    if needed > MOST_RETURNS:
        more = (
            f"half the damping ends transients in {needed:.3g}, which --iterations "
            f"cannot be: {MOST_RETURNS} are the most"
        )
    elif iterations >= needed:
        more = "irregular motion may last long before it ends"
        if iterations < MOST_RETURNS:
            more += ": more --iterations"
    return (
        f"{100.0 * part:.3g} % of the {what} have not settled in {iterations} returns; "
        f"{more}"
    )


def find_basins(
    named: NamedMachine,
    grid: Grid,
    iterations: int,
    keeping: Keeping,
    report: Progress = silent,
    workers: Cluster | None = None,
) -> BasinsResult:
    """Basins on a grid of departures from the upper flank.

    iterations : returns after which a motion that still changes counts as chaotic
    keeping : where tiles are kept as they are finished
    workers : that compute tiles; threads, one a core, where there are none
    Raises InputError where the grid takes more memory than it should, or the cluster
    cannot be used.
    """
    if grid.cells > MOST_CELLS:
        raise InputError(
            f"grid = {grid.side}; {grid.cells:.3g} cells, allowed are {MOST_CELLS:g}, "
            f"{math.isqrt(MOST_CELLS)} a side"
        )
    machine = named.machine
    inputs = {name: repr(value) for name, value in figures_of(machine).items()}
    inputs |= {"grid": repr(grid), "iterations": str(iterations)}
    inputs |= {"version": package_version()}
    checkpoint = keeping.open(inputs)
    tiles: dict[int, Settled] = {}
    finished = False

    def keep(number: int, settled: Settled) -> None:
        tiles[number] = settled
        if checkpoint is not None:
            checkpoint.add(f"{number}", {}, settled._asdict())

    try:
        if checkpoint is not None:
            tiles |= _kept(checkpoint, grid)
        if tiles:
            keeping.tell(f"{keeping.checkpoint}: tiles that are finished: {len(tiles)}")
        settled = settle_grid(
            *(machine, grid, iterations, tiles, keep),
            lambda done, total: report("tiles of cells", done, total),
            workers,
        )
        finished = True
    except NoClusterError as error:
        raise InputError(str(error)) from None
    finally:
        if checkpoint is not None:
            checkpoint.close(keep=bool(tiles) and not finished)
    return BasinsResult(named, basins_of(machine, grid, iterations, settled))


def _kept(checkpoint: Checkpoint, grid: Grid) -> dict[int, Settled]:
    """Tiles that are finished, by number."""
    found = {n: checkpoint.state(f"{n}") for n in range(len(tiles_of(grid)))}
    return {n: Settled(**arrays) for n, arrays in found.items() if arrays is not None}
