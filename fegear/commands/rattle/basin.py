"""Basins of attraction of a machine that rattles."""

from __future__ import annotations

import io
import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, partial
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np

from fegear.commands.rattle.machine_studies import (
    MAX_RETURNS,
    MIN_RETURNS,
    Z_95,
    MachineStudy,
    default_returns,
    not_converged_warning,
)
from fegear.commands.rattle.machines import NamedMachine, parameters
from fegear.files.codes import with_code
from fegear.files.output import write_bytes
from fegear.studies.page import Columns, Page, RowTable, cell, heading
from fegear.studies.problem import Job, Task
from fegear.studies.result import Draw, StudyResult
from fegear.studies.settings import setting
from fegear.studies.study import Study
from fegear.studies.table import Table, finite_or_none
from lumped.common.options import Range
from lumped.figures.rattle import draw_basins
from lumped.rattle import basins as of
from lumped.rattle.return_map import DEFAULT_RETURNS, settling_returns

MAX_CELLS = 6324  # per side: 40 million cells of 48 bytes each
DEFAULT_CELLS, MIN_CELLS = 400, 20  # a side


@dataclass(frozen=True, kw_only=True)
class Basins(
    MachineStudy,
    Study,
    command="rattle basin",
    example="rattle basin roots-scaled -o basins.npz --plot basins.png",
):
    """Attractors of a machine and their basins of attraction.

    Every cell of a grid of lift-offs from the upper flank is followed until its
    attractor is identified. With --output tiles of cells are stored in FILE.partial
    until the file is written; --resume continues from there.
    """

    resumes = True
    unit = "tile"
    distributes = True
    output = "Write attractor and returns of every cell to this NPZ file."
    endings = (".npz",)

    grid: int | None = setting(
        None,
        "Cells per side of the grid, over a turn and over the speeds. [default: 400, "
        "or down to 20 where low damping makes each cell take longer]",
        Range(5, MAX_CELLS),
    )
    iterations: int | None = setting(
        None,
        "Returns after which aperiodic motion counts as chaotic. [default: 1499, or "
        "more where low damping prolongs transients]",
        Range(MIN_RETURNS, MAX_RETURNS),
    )

    def tasks(self) -> Iterator[Task]:
        yield Task("tiles", self._find_basins)

    def _find_basins(self, job: Job) -> BasinsResult:
        machine = self.named.machine
        iterations = self.iterations or default_returns(settling_returns(machine))
        side = self.grid or default_side(iterations)
        grid_arguments = (
            machine,
            of.InitialGrid(side=side, velocity=self.speeds),
            iterations,
        )
        settled_cells = of.settle_grid(
            *grid_arguments, partial(job.compute, "tiles of cells")
        )
        return BasinsResult(
            self, self.named, of.basins_of(*grid_arguments, settled_cells)
        )


def default_side(iterations: int) -> int:
    """Cells per side that all together take as many returns as 400 of 1499 returns."""
    side = math.floor(DEFAULT_CELLS * math.sqrt(DEFAULT_RETURNS / iterations))
    return min(max(side, MIN_CELLS), DEFAULT_CELLS)


@dataclass(frozen=True, eq=False)
class BasinsResult(StudyResult):
    """Basins of a named machine."""

    study: Basins
    named: NamedMachine
    basins: of.BasinMap

    @cached_property
    def summary(self) -> dict[str, Any]:
        basins = self.basins
        undecided = 1.0 - float(np.mean(basins.attractor >= 0))
        return {
            **self.named.heading,
            **parameters(basins.machine),
            "cells_a_side": basins.grid.side,
            "velocity_rad_per_turn": list(basins.grid.velocity),
            "iterations": basins.iterations,
            "attractors": [
                self._attractor_values(i) for i in range(len(basins.attractors))
            ],
            "undecided_fraction": undecided,
            "basin_entropy": finite_or_none(basins.entropy),
            "warnings": list(self._warnings()),
        }

    def _warnings(self) -> Iterator[str]:
        undecided = float(np.mean(self.basins.attractor < 0))
        if undecided:
            needed = settling_returns(self.basins.machine)
            yield not_converged_warning(
                self.study, undecided, "cells", self.basins.iterations, needed
            )

    def _attractor_values(self, number: int) -> dict[str, Any]:
        basins, attractor = self.basins, self.basins.attractors[number]
        fraction, count = float(basins.fractions[number]), basins.grid.cells
        error = math.sqrt(fraction * (1.0 - fraction) / count)
        time, speed = attractor.point
        return {
            "name": attractor.name,
            "fraction": fraction,
            "fraction_ci95": Z_95 * error,
            "period": attractor.period,
            "point": None if math.isnan(time) else [time, speed],
            # quiet and sticking ones, -inf, are reached exactly
            "lyapunov_per_turn": finite_or_none(attractor.exponent),
            "transient_returns": attractor.transient_returns or None,
        }

    @property
    def table(self) -> Table:
        """A row for each cell: its attractor, from 0, or -1 if it is undecided."""
        basins = self.basins
        time, speed = basins.grid.initial_conditions(0, basins.grid.cells).T
        columns = {
            "time_turns": time,
            "speed_rad_per_turn": speed,
            "attractor": basins.attractor.ravel(),
            "returns": basins.returns.ravel(),
        }
        return Table.of(columns, {"machine": self.named.name})

    def write(self, path: str | Path) -> None:
        """Write attractors and returns of the cells, rows of rising speed, as NPZ."""
        basins = self.basins
        figures = parameters(basins.machine)
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
        write_bytes(path, out.getvalue())

    @property
    def figures(self) -> dict[str, Draw]:
        return {"plot": partial(draw_basins, self.basins, self.named.name)}

    def page(self) -> Page:
        values = self.summary
        yield from heading(self.named)
        yield (
            f"{values['cells_a_side']} cells a side, speeds up to "
            f"{values['velocity_rad_per_turn'][1]:.4g} rad per turn, "
            f"{values['iterations']} returns at most"
        )
        rows = []
        for attractor in values["attractors"]:
            time, speed = attractor["point"] or (None, None)
            rows.append({**attractor, "time": time, "speed": speed})
        columns: Columns = {
            "motion": itemgetter("name"),
            "part [%]": lambda row: f"{100.0 * row['fraction']:.2f}",
            "+- [%]": lambda row: f"{100.0 * row['fraction_ci95']:.2f}",
            "period\n[turns]": lambda row: str(row["period"] or ""),
            "at time\n[turns]": cell("time"),
            "speed\n[rad per turn]": cell("speed"),
            "Lyapunov\n[1/turn]": cell("lyapunov_per_turn"),
        }
        yield RowTable(rows, columns)
        if values["undecided_fraction"]:
            part = 100.0 * values["undecided_fraction"]
            yield with_code("E09", f"attractor undecided: {part:.2f} % of cells")
        if values["basin_entropy"] is not None:
            yield f"basin entropy {values['basin_entropy']:.3f}"
