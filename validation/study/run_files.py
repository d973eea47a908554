"""The files of a run, and runs as read from them.

sweep.csv     the sweep table
statics.csv   static deflections over the mesh cycle
waves.csv     mesh forces over a cycle at single speeds
result.json   jumps, peaks and cost
inputs.json   what it was made of, with digests of the other files
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from lumped.common.csv_text import format_csv, parse_csv
from lumped.steady.jumps import Jump, Peak, find_jumps, find_peaks, opposite_branches
from lumped.steady.sweep import Branch
from lumped.steady.sweep_table import SweepTable, format_sweep, parse_sweep, sweep_table
from validation.study.cycle_metrics import ForceCycle
from validation.study.metrics import CYCLE_POINTS, MeasuredCurve, Statics
from validation.study.provenance import machine
from validation.study.run_store import RESULT, read_texts, run_contents
from validation.study.solving import Cost, RunResult
from validation.study.tasks import RunSpec

SWEEP, STATICS, CYCLES = "sweep.csv", "statics.csv", "waves.csv"
FILE_NAMES = (SWEEP, STATICS, CYCLES)
Rows = Sequence[Sequence[str]]  # of a CSV file, without the names


@dataclass(frozen=True, eq=False)
class Run:
    """A source, fe or a model's name, at a torque on the input gear [N m].

    reused : whether nothing was computed
    machine : on which it was made
    natural_Hz : of the lumped train, all above 0; also with finite elements
    warnings : where the source leaves out too much, or values cannot be physical
    """

    source: str
    torque: float
    directory: Path
    reused: bool
    table: SweepTable
    curves: tuple[MeasuredCurve, ...]
    statics: tuple[Statics, ...]
    cycles: tuple[ForceCycle, ...]
    machine: str
    natural_Hz: tuple[float, ...]
    warnings: tuple[str, ...]
    cost: Cost


def contents(task: RunSpec, solution: RunResult) -> dict[str, bytes]:
    """The files by name, in the order in which they are written."""
    system = solution.system
    pairs = [(task.torque, branch) for branch in solution.branches]
    label = task.case.fidelity if task.model is None else str(task.model.number)
    header = {"gear set": task.gear_set.name, "source": task.source}
    result = {
        "source": task.source,
        "torque_Nm": task.torque,
        "machine": machine(),
        "natural_Hz": [f for f in system.resonances_Hz.tolist() if f > 0.0],
        "warnings": list(solution.warnings),
        "cost": asdict(solution.cost),
        "curves": features(solution.branches),
        "statics": [{"mesh": s.mesh, "force_N": s.force} for s in solution.statics],
        "waves": [
            {name: value for name, value in vars(w).items() if name != "force"}
            for w in solution.cycles
        ],
    }
    texts = {
        SWEEP: format_sweep(sweep_table(pairs, label, header)),
        STATICS: _statics_csv(solution.statics),
        CYCLES: _cycles_csv(solution.cycles),
    }
    return run_contents(task.inputs, texts, result)


def features(branches: Sequence[Branch]) -> list[dict[str, Any]]:
    """Jumps and peaks of every mesh of every branch, as plain values."""
    entries: list[dict[str, Any]] = []
    for branch, other in zip(branches, opposite_branches(branches), strict=True):
        jumps, peaks = find_jumps(branch, other), find_peaks(branch)
        meshes = len(branch.system.excitations) if len(branch.frequency_Hz) else 0
        entries += [
            {
                "direction": branch.direction,
                "mesh": mesh,
                "complete": branch.complete,
                "jumps": [asdict(jump) for jump in jumps if jump.mesh == mesh],
                "peaks": [asdict(peak) for peak in peaks if peak.mesh == mesh],
            }
            for mesh in range(1, meshes + 1)
        ]
    return entries


def _statics_csv(statics: Sequence[Statics]) -> str:
    rows = [
        [s.mesh, *map(repr, map(float, values)), int(single)]
        for s in statics
        for *values, single in zip(
            *(s.position, s.deflection, s.friction, s.single_pair_contact), strict=True
        )
    ]
    names = ("mesh", "position", "deflection_m", "friction_change_m", "single_pair")
    return format_csv(names, rows)


def _cycles_csv(waves: Sequence[ForceCycle]) -> str:
    rows = (
        [w.label, w.mesh, i / w.force.size, repr(float(value))]
        for w in waves
        for i, value in enumerate(w.force)
    )
    return format_csv(("wave", "mesh", "cycle", "force_N"), rows)


def read_run(task: RunSpec, directory: Path, reused: bool) -> Run | None:
    """None where a file is missing, damaged, or belongs to something else.

    Raises InputError where files are there and cannot be read.
    """
    texts = read_texts(directory, task.inputs, FILE_NAMES)
    if texts is None:
        return None
    result = json.loads(texts[RESULT])
    table = parse_sweep(texts[SWEEP], str(directory / SWEEP))
    return Run(
        source=task.source,
        torque=task.torque,
        directory=directory,
        reused=reused,
        table=table,
        curves=tuple(
            _read_curve(curve_features, table) for curve_features in result["curves"]
        ),
        statics=tuple(_read_statics(result["statics"], _rows(texts[STATICS]))),
        cycles=tuple(_read_cycles(result["waves"], _rows(texts[CYCLES]))),
        machine=result["machine"],
        natural_Hz=tuple(result["natural_Hz"]),
        warnings=tuple(result["warnings"]),
        cost=Cost(**result["cost"]),
    )


def _read_curve(features: Mapping[str, Any], table: SweepTable) -> MeasuredCurve:
    key = (features["direction"], features["mesh"])
    rows = [row for row in table.rows if (row.direction, row.mesh) == key]
    rows.sort(key=lambda row: row.mesh_frequency_Hz)
    columns = {
        "frequency": "mesh_frequency_Hz",
        "dte_rms": "dte_rms_m",
        "force_peak": "force_peak_N",
        "contact_loss": "contact_loss_fraction",
        "period_multiple": "period_multiple",
    }
    return MeasuredCurve(
        direction=features["direction"],
        mesh=features["mesh"],
        **{k: np.array([getattr(row, v) for row in rows]) for k, v in columns.items()},
        jumps=tuple(Jump(**jump) for jump in features["jumps"]),
        peaks=tuple(Peak(**peak) for peak in features["peaks"]),
        complete=features["complete"],
    )


def _read_statics(entries: Sequence[Any], rows: Rows) -> Iterator[Statics]:
    for entry in entries:
        statics_rows = [row[1:] for row in rows if int(row[0]) == entry["mesh"]]
        position, deflection, friction, single = np.array(statics_rows, float).T
        force = entry["force_N"]
        yield Statics(entry["mesh"], force, position, deflection, friction, single == 1)


def _read_cycles(entries: Sequence[Any], rows: Rows) -> Iterator[ForceCycle]:
    for i, entry in enumerate(entries):
        cycle_rows = rows[i * CYCLE_POINTS : (i + 1) * CYCLE_POINTS]
        force = np.array([float(row[3]) for row in cycle_rows])
        yield ForceCycle(force=force, **entry)


def _rows(text: str) -> Rows:
    return list(parse_csv(text, "a run's file").rows.values())
