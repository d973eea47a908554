"""The result of `fegear map`: its page, tables and figures."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np

from fegear.studies.page import Page, number, pluralize
from fegear.studies.result import Draw, StudyResult
from fegear.studies.table import Table, finite_or_none
from fegear.studies.trains.headings import edits_in_words
from fegear.studies.trains.train_problem import TrainFacts
from lumped.attractors.attractors import MAX_NEUTRAL_EXPONENT
from lumped.figures.map_plots import draw_map
from lumped.steady.maps import ParameterMap, map_columns, map_rows

FORMAT = "lumped parameter map 2"
MAX_REASONS = 3  # why points are impossible, on the screen


@dataclass(frozen=True, eq=False)
class MapResult(StudyResult):
    """Vibration over a grid of parameters."""

    study: Any
    facts: TrainFacts
    parameter_map: ParameterMap

    @property
    def table(self) -> Table:
        """A row for each point and mesh."""
        header = {"format": FORMAT, **self.parameter_map.header}
        for axis in self.parameter_map.axes:
            header[f"axis {axis.name}"] = " ".join(repr(float(v)) for v in axis.values)
        rows = partial(map_rows, self.parameter_map)
        table = Table(map_columns(self.parameter_map), rows, header)
        return self.facts.with_driver_speed(table)

    @cached_property
    def summary(self) -> dict[str, Any]:
        """Smallest and largest vibration of every mesh, and where."""
        parameter_map = self.parameter_map
        cells = parameter_map.cells.values()
        statuses = [cell.status.partition(":")[0] for cell in cells]
        return {
            "gear_set": parameter_map.header["gear set"],
            "excitation": parameter_map.header["excitation"],
            "response": parameter_map.header["response"],
            "points": len(parameter_map.points),
            "statuses": {
                status: statuses.count(status) for status in sorted(set(statuses))
            },
            "reasons": sorted({c.status for c in cells if c.status.startswith("imp")}),
            "extremes": list(self._extremes()),
            "largest_lyapunov_per_period": self._largest_exponent,
            "chaotic_points": self._chaotic_points,
            "warnings": list(self.facts.warnings),
        }

    @property
    def _largest_exponent(self) -> float | None:
        """Per period of the first mesh; None without exponents."""
        if not self.study.exponents:
            return None
        return finite_or_none(np.fmax.reduce(self.parameter_map.exponents, axis=None))

    @property
    def _chaotic_points(self) -> int | None:
        """Number of points with a clearly positive exponent; None without exponents."""
        if not self.study.exponents:
            return None
        return int((self.parameter_map.exponents > MAX_NEUTRAL_EXPONENT).sum())

    def _extremes(self) -> Iterator[dict[str, Any]]:
        names = [axis.name for axis in self.parameter_map.axes]
        for mesh in range(self.parameter_map.meshes):
            rms = self.parameter_map.on_grid("dte_rms_m", mesh).ravel()
            for kind, pick in (("smallest", np.nanargmin), ("largest", np.nanargmax)):
                if np.isnan(rms).all():
                    continue
                place = int(pick(rms))
                yield {
                    "mesh": mesh + 1,
                    "extreme": kind,
                    "dte_rms_m": float(rms[place]),
                    "at": dict(
                        zip(names, self.parameter_map.points[place], strict=True)
                    ),
                }

    @property
    def figures(self) -> dict[str, Draw]:
        return {"plot": lambda: draw_map(self.parameter_map, self._title)}

    @property
    def _title(self) -> str:
        facts = self.facts.summary
        fixed = {"torque {:g} N m": "torque_Nm", "damping ratio {:g}": "damping_ratio"}
        changes = [
            form.format(facts[name])
            for form, name in fixed.items()
            if facts[name] is not None
        ]
        changes.append(edits_in_words(self.parameter_map.header))
        return (
            f"{facts['gear_set']}, model {facts['model']}, {facts['excitation']}, "
            f"{self.study.response}\n{', '.join(filter(None, changes))}"
        )

    def page(self) -> Page:
        values = self.summary
        counts = ", ".join(f"{n} {status}" for status, n in values["statuses"].items())
        yield from self.facts.notes
        yield (
            f"{values['gear_set']}, {values['excitation']}, {values['response']}\n"
            f"{pluralize(values['points'], 'point')}: {counts}"
        )
        yield from itertools.islice(values["reasons"], MAX_REASONS)
        for extreme in values["extremes"]:
            place = ", ".join(f"{name} = {v:g}" for name, v in extreme["at"].items())
            yield (
                f"mesh {extreme['mesh']}: {extreme['extreme']} RMS of DTE "
                f"{number(1e6 * extreme['dte_rms_m'], 4)} um at {place}"
            )
        if values["chaotic_points"] is not None:
            yield (
                f"chaotic at {pluralize(values['chaotic_points'], 'point')}: "
                f"largest Lyapunov exponent above {MAX_NEUTRAL_EXPONENT:g} per period"
            )
