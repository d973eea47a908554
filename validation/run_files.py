"""The files of a run, and runs as read from them.

sweep.csv     the sweep table
statics.csv   static deflections over the mesh cycle
waves.csv     mesh forces over a cycle at single speeds
result.json   jumps, peaks and cost
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fegear.errors import InputError
from lumped.jumps import Jump, Peak, opposites
from lumped.sweep import Branch
from lumped.sweep_table import SweepTable, format_sweep, read_sweep, sweep_table
from validation.marching import Cost, Marched
from validation.metrics import (
    WAVE_POINTS,
    Curve,
    ForceWave,
    Statics,
    branch_curves,
)
from validation.tasks import Task

RESULT = "result.json"  # written last: a run without it is not done


@dataclass(frozen=True, eq=False)
class Run:
    """A source, fe or a model's name, at a torque on the input gear [N m].

    reused : whether nothing was computed
    natural_Hz : of the lumped train, all above 0; also beside the finite elements
    """

    source: str
    torque: float
    directory: Path
    reused: bool
    table: SweepTable
    curves: tuple[Curve, ...]
    statics: tuple[Statics, ...]
    waves: tuple[ForceWave, ...]
    natural_Hz: tuple[float, ...]
    cost: Cost


def contents(task: Task, marched: Marched) -> dict[str, str]:
    """Texts of the files by name, the result last."""
    system = marched.system
    pairs = [(task.torque, branch) for branch in marched.branches]
    label = task.case.fidelity if task.model is None else str(task.model.number)
    header = {"gear set": task.gear_set.name, "source": task.source}
    result = {
        "source": task.source,
        "torque_Nm": task.torque,
        "natural_Hz": [f for f in system.modes.frequency_Hz.tolist() if f > 0.0],
        "cost": asdict(marched.cost),
        "curves": _features(marched.branches),
        "statics": [{"mesh": s.mesh, "force_N": s.force} for s in marched.statics],
        "waves": [
            {"label": w.label, "mesh": w.mesh, "contact_loss": w.contact_loss}
            for w in marched.waves
        ],
    }
    return {
        "sweep.csv": format_sweep(sweep_table(pairs, label, header)),
        "statics.csv": _statics_csv(marched.statics),
        "waves.csv": _waves_csv(marched.waves),
        RESULT: json.dumps(result, indent=2) + "\n",
    }


def _features(branches: Sequence[Branch]) -> list[dict[str, Any]]:
    """Jumps and peaks of every mesh of every branch, as plain values."""
    return [
        {
            "direction": curve.direction,
            "mesh": curve.mesh,
            "complete": curve.complete,
            "jumps": [asdict(jump) for jump in curve.jumps],
            "peaks": [asdict(peak) for peak in curve.peaks],
        }
        for branch, other in zip(branches, opposites(branches), strict=True)
        if branch.responses
        for curve in branch_curves(branch, other)
    ]


STATICS_COLUMNS = (
    "mesh",
    "position",
    "deflection_m",
    "friction_change_m",
    "single_pair",
)


def _statics_csv(statics: Sequence[Statics]) -> str:
    rows = [
        [s.mesh, *map(repr, map(float, values)), int(single)]
        for s in statics
        for *values, single in zip(
            *(s.position, s.deflection, s.friction, s.single), strict=True
        )
    ]
    return _csv(STATICS_COLUMNS, rows)


def _waves_csv(waves: Sequence[ForceWave]) -> str:
    rows = [
        [w.label, w.mesh, repr(i / w.force.size), repr(float(value))]
        for w in waves
        for i, value in enumerate(w.force)
    ]
    return _csv(("wave", "mesh", "cycle", "force_N"), rows)


def _csv(names: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(names)
    writer.writerows(rows)
    return out.getvalue()


def read_run(task: Task, directory: Path, reused: bool) -> Run:
    """Raises InputError where a file is missing or damaged."""
    try:
        result = json.loads((directory / RESULT).read_text(encoding="utf-8"))
        table = read_sweep(str(directory / "sweep.csv"))
        return Run(
            source=task.source,
            torque=task.torque,
            directory=directory,
            reused=reused,
            table=table,
            curves=tuple(_read_curve(each, table) for each in result["curves"]),
            statics=tuple(_read_statics(result["statics"], directory)),
            waves=tuple(_read_waves(result["waves"], directory)),
            natural_Hz=tuple(result["natural_Hz"]),
            cost=Cost(**result["cost"]),
        )
    except (OSError, ValueError, KeyError, TypeError, IndexError) as error:
        raise InputError(
            f"{directory}: cannot be read back, {error}; remove it to run again"
        ) from None


def _read_curve(features: Mapping[str, Any], table: SweepTable) -> Curve:
    own = (features["direction"], features["mesh"])
    rows = [row for row in table.rows if (row.direction, row.mesh) == own]
    rows.sort(key=lambda row: row.mesh_frequency_Hz)
    columns = {
        "frequency": "mesh_frequency_Hz",
        "dte_rms": "dte_rms_m",
        "force_peak": "force_peak_N",
        "contact_loss": "contact_loss_fraction",
    }
    return Curve(
        direction=features["direction"],
        mesh=features["mesh"],
        **{k: np.array([getattr(row, v) for row in rows]) for k, v in columns.items()},
        jumps=tuple(Jump(**jump) for jump in features["jumps"]),
        peaks=tuple(Peak(**peak) for peak in features["peaks"]),
        complete=features["complete"],
    )


def _read_statics(entries: Sequence[Any], directory: Path) -> Iterator[Statics]:
    rows = _rows(directory / "statics.csv")
    for entry in entries:
        own = [row[1:] for row in rows if int(row[0]) == entry["mesh"]]
        position, deflection, friction, single = np.array(own, float).T
        force = entry["force_N"]
        yield Statics(entry["mesh"], force, position, deflection, friction, single == 1)


def _read_waves(entries: Sequence[Any], directory: Path) -> Iterator[ForceWave]:
    rows = _rows(directory / "waves.csv")
    for i, entry in enumerate(entries):
        own = rows[i * WAVE_POINTS : (i + 1) * WAVE_POINTS]
        force = np.array([float(row[3]) for row in own])
        yield ForceWave(entry["label"], entry["mesh"], force, entry["contact_loss"])


def _rows(path: Path) -> list[list[str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.reader(file))[1:]
