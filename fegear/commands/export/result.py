"""The result of `fegear export`: its page, tables and figures."""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fegear.commands.export.fmu import FmuMesh, write_fmu
from fegear.files.errors import InputError
from fegear.files.matlab import text_cells, write_matlab
from fegear.files.output import (
    FMU,
    path_of,
    require_ending,
    strict_json,
    write_bytes,
    write_text,
)
from fegear.files.version import package_version
from fegear.studies.page import Page, RowTable, cell, number
from fegear.studies.result import StudyResult
from fegear.studies.settings import display_name
from fegear.studies.table import Table
from fegear.train.loaded_modes import LinearModel
from lumped.common.checks import require_present
from lumped.train.train import Train

MODELS = (".mat", ".npz", ".json", FMU)  # endings of names


# of the entries of a file; of matrices per row, and per column of stiffness and damping
UNITS = {
    "M": "kg m2 of rotations, kg of translations",
    "C": "N m or N for 1 rad/s or 1 m/s",
    "K": "N m or N for 1 rad or 1 m",
    "G": "N m or N for 1 rad/s or 1 m/s, at 1 rad/s of the first mesh's driver",
    "mesh_vectors": "m for 1 rad or 1 m",
    "mesh_tilt_vectors": "rad for 1 rad or 1 m",
    "mesh_tilt_stiffness_Nm_per_rad": "N m/rad",
    "mesh_stiffness_N_per_m": "N/m",
    "mesh_backlash_m": "m",
    "mesh_phase": "base pitches",
    "mesh_frequency_ratio": "1",
    "load": "N m of rotations, N of translations",
    "static_displacement": "rad of rotations, m of translations",
    "static_mesh_force_N": "N",
    "natural_frequency_Hz": "Hz",
    "damping_ratio": "1",
    "torque_Nm": "N m",
}


@dataclass(frozen=True, eq=False)
class ModelExportResult(StudyResult):
    """A train about its state under load, or its mean mesh stiffness.

    torque : on the input gear [N m]
    origins : of the mean stiffness of each mesh, in words
    fmu_mesh : what an FMU contains, if it was asked for
    """

    study: Any
    gear_set: str
    torque: float
    train: Train
    linear: LinearModel
    origins: list[str]
    fmu_mesh: FmuMesh | None = None
    warnings: tuple[str, ...] = ()

    @property
    def coordinates(self) -> list[str]:
        """Names of the coordinates, such as `pinion rotation`."""
        return [" ".join(label) for label in self.linear.labels]

    @property
    def meshes(self) -> list[str]:
        """Names of driver and driven gear of each mesh."""
        gears = self.train.gears
        return [
            f"{gears[m.driver].name} > {gears[m.driven].name}"
            for m in self.train.meshes
        ]

    @cached_property
    def arrays(self) -> dict[str, NDArray[np.float64]]:
        """Matrices, vectors and numbers of the model, with the units `UNITS`."""
        linear, train = self.linear, self.train
        values: dict[str, Any] = {
            "M": linear.mass,
            "C": linear.damping,
            "K": linear.stiffness,
            "mesh_vectors": linear.mesh_rows,
            "mesh_stiffness_N_per_m": linear.mesh_stiffness,
            "mesh_backlash_m": [mesh.backlash for mesh in train.meshes],
            "mesh_phase": [mesh.phase for mesh in train.meshes],
            "mesh_frequency_ratio": [float(rate) for rate in train.mesh_rates],
            "load": linear.load,
            "static_displacement": linear.displacement,
            "static_mesh_force_N": linear.mesh_force,
            "natural_frequency_Hz": linear.frequency_Hz,
            "damping_ratio": train.damping_ratio,
            "torque_Nm": self.torque,
        }
        if linear.in_space is not None:
            values["G"] = linear.in_space.gyroscopic
            values["mesh_tilt_vectors"] = linear.in_space.tilt_rows
            stiffness = linear.in_space.tilt_stiffness
            values["mesh_tilt_stiffness_Nm_per_rad"] = stiffness
        return {name: np.asarray(value, float) for name, value in values.items()}

    @property
    def texts(self) -> dict[str, list[str]]:
        """Names of coordinates and meshes, and where the stiffness comes from."""
        return {
            "coordinates": self.coordinates,
            "coordinate_units": [unit_of_direction(d) for _, d in self.linear.labels],
            "meshes": self.meshes,
            "mesh_stiffness_origin": self.origins,
        }

    @property
    def inputs(self) -> dict[str, str]:
        """What the model was made from."""
        return {
            "made_with": f"fegear {package_version()}",
            "gear_set": self.gear_set,
            **self.study.gear_set.entries,
        }

    @cached_property
    def summary(self) -> dict[str, Any]:
        arrays = {name: value.tolist() for name, value in self.arrays.items()}
        study = self.study
        about = {
            "gear_set": self.gear_set,
            "translations": study.translations,
            "motion": study.motion,
        }
        return {
            **about,
            **self.texts,
            **arrays,
            "units": self.units,
            "warnings": list(self.warnings),
        }

    @property
    def units(self) -> dict[str, str]:
        """Units of all arrays by their names."""
        return {name: unit for name, unit in UNITS.items() if name in self.arrays}

    @property
    def table(self) -> Table:
        """A row for every coordinate."""
        rows = [(*label, *values) for label, values in zip(*self._rows(), strict=True)]
        meshes = range(1, len(self.meshes) + 1)
        names = (
            *("gear", "direction", "inertia_kg_m2", "mass_kg", "torque_Nm", "force_N"),
            *("static_rotation_rad", "static_displacement_m"),
            *(f"mesh{m}_deflection_m" for m in meshes),
        )
        return Table(names, lambda: rows, self.inputs)

    def _rows(self) -> tuple[tuple[tuple[str, str], ...], list[list[float]]]:
        """Labels and values of the coordinates, NaN where the unit is the other's."""
        linear = self.linear
        quantities = np.array([np.diag(linear.mass), linear.load, linear.displacement])
        rotates, moves = (
            np.array([unit_of_direction(d) == unit for _, d in linear.labels])
            for unit in ("rad", "m")
        )
        split = np.empty((len(rotates), 6))
        split[:, ::2] = np.where(rotates, quantities, np.nan).T
        split[:, 1::2] = np.where(moves, quantities, np.nan).T
        values = np.hstack([split, linear.mesh_rows.T])
        return linear.labels, values.tolist()

    def write(self, path: str | Path) -> None:
        """Write the model by the ending of the path, .mat, .npz, .json or .fmu."""
        target = path_of(path)
        require_ending(target, MODELS)
        if (target.suffix.lower() == FMU) != (self.fmu_mesh is not None):
            option = display_name(self.study, "mesh")
            raise InputError(
                f"{target}: an {FMU} needs {option}, others have all meshes"
            )
        WRITERS.get(target.suffix.lower(), _write_json)(target, self)

    @property
    def _equation(self) -> str:
        if self.linear.in_space is None:
            return "M x'' + C x' + K x = load"
        return "M x'' + (C + speed G) x' + K x = load"

    def page(self) -> Page:
        yield (
            f"{self.gear_set}, {self.torque:g} N m on the input gear: "
            f"{len(self.coordinates)} coordinates, {self._equation}"
        )
        if self.fmu_mesh is not None:
            yield (
                f"FMU of {self.fmu_mesh.description}, "
                f"damping {number(self.fmu_mesh.damping)} N s/m"
            )
        names = "mesh_stiffness_N_per_m", "static_mesh_force_N"
        stiffness, force = (self.arrays[name] for name in names)
        rows = [
            {"mesh": name, "stiffness": k, "force": f, "origin": origin}
            for name, k, f, origin in zip(
                self.meshes, stiffness, force, self.origins, strict=True
            )
        ]
        columns = {
            "mesh": lambda row: row["mesh"],
            "mean k\n1e8 N/m": cell("stiffness", 5, 1e-8),
            "static force\nN": cell("force", 5),
            "mean k from": lambda row: row["origin"],
        }
        yield RowTable(rows, columns, text_columns=("mesh", "mean k from"))


def unit_of_direction(direction: str) -> str:
    """Unit of a coordinate of unit mass for vibration of a body, rad or m."""
    if direction in ("x", "y", "z"):
        return "m"
    is_angle = direction.startswith(("rotation", "tilt", "about"))
    return "rad" if is_angle else "m sqrt(kg)"


def _write_matlab(path: Path, result: ModelExportResult) -> None:
    """Matrices, n x 1 vectors, cells of texts, and structs of units and inputs."""
    numbers = {
        name: value[:, None] if value.ndim == 1 else value
        for name, value in result.arrays.items()
    }
    texts = {n: text_cells([[t] for t in names]) for n, names in result.texts.items()}
    rows = [[key, text] for key, text in result.inputs.items()]
    more = {"units": result.units, "inputs": text_cells(rows)}
    write_matlab(path, {**numbers, **texts, **more})


def _write_npz(path: Path, result: ModelExportResult) -> None:
    """Arrays of numbers and of texts; units and inputs as rows of name and text."""
    texts = {name: np.array(names, str) for name, names in result.texts.items()}
    pairs = {"units": result.units, "inputs": result.inputs}
    rows = {name: np.array([*entries.items()], str) for name, entries in pairs.items()}
    out = io.BytesIO()
    contents: Any = {**result.arrays, **texts, **rows}
    np.savez(out, **contents)
    write_bytes(path, out.getvalue())


def _write_json(path: Path, result: ModelExportResult) -> None:
    """Rows of matrices; null of a backlash that is infinite."""
    arrays = {name: value.tolist() for name, value in result.arrays.items()}
    more = {"units": result.units, "inputs": result.inputs}
    text = strict_json({**arrays, **result.texts, **more})
    write_text(path, text)


def _write_fmu(path: Path, result: ModelExportResult) -> None:
    """The mesh of the study as an FMU."""
    write_fmu(path, require_present(result.fmu_mesh, "fmu_mesh"))


Writer = Callable[[Path, ModelExportResult], None]

WRITERS: Mapping[str, Writer] = {
    ".mat": _write_matlab,
    ".npz": _write_npz,
    FMU: _write_fmu,
}
