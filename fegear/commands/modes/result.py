"""The result of `fegear modes`: its page, tables and figures."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from fegear.files.codes import with_code
from fegear.studies.page import ColumnTable, Page, pluralize
from fegear.studies.result import StudyResult
from fegear.studies.table import Table
from fegear.studies.trains.model_texts import body_entries, body_modes_warnings
from fegear.studies.trains.train_problem import bodies_described
from fegear.train.resonances import default_speeds
from lumped.train.coordinates import SPRING_KINDS
from lumped.train.mode_families import Family, Whirl, multiplicities
from lumped.train.modes import MIN_FELT_ENERGY, Modes
from lumped.train.space_modes import HOUSING, SpaceShares
from lumped.train.system import LumpedSystem

COLUMN_OF_SPRINGS = {
    "shaft": "\nshafts\n[%]",
    "bearing": "\nbearings\n[%]",
    "body": "\nbodies\n[%]",
    "tilt": "\nteeth in\ntilt [%]",
}

MIN_SHOWN_ENERGY = 5e-4  # part of the energy; a column without a larger one is left out

SHOWN_IN_SPACE = 24  # modes in space, on the screen
MAX_COLUMNS = 3  # of meshes with a column of their own on the screen

MIN_MESH_ENERGY_FRACTION = (
    1e-6  # part of the strain energy in the meshes below which there is none
)


@dataclass(frozen=True, eq=False)
class ModesResult(StudyResult):
    """Modes of a train.

    torque : on the input gear [N m], None where nothing depends on it
    origins : of the mean stiffness of each mesh, in words
    system : of the coupled model, None for others
    averages : natural frequency of each mode about the averages of model 1 [Hz], None
        for vibration of the bodies; empty for others than the coupled model at rest
    reason : why the model was chosen, empty where it was given
    families : of the modes of a planetary set, empty for others
    whirl : senses of the orbits of its members at speed, empty at rest
    shares : of modes in space, None of others
    """

    study: Any
    gear_set: str
    torque: float | None
    damping_ratio: float
    modes: Modes
    origins: list[str]
    system: LumpedSystem | None = None
    averages: tuple[float | None, ...] = ()
    reason: str = ""
    gear_warnings: tuple[str, ...] = ()
    families: tuple[Family, ...] = ()
    whirl: tuple[Whirl, ...] = ()
    shares: SpaceShares | None = None

    @cached_property
    def summary(self) -> dict[str, Any]:
        study, modes = self.study, self.modes
        return {
            "gear_set": self.gear_set,
            "model_reason": self.reason or None,
            "torque_Nm": self.torque,
            "translations": study.translations,
            "motion": study.motion,
            "input_speed_rpm": study.rpm,
            "damping_ratio": self.damping_ratio,
            "mean_stiffness": [
                {"mesh": m, "stiffness_N_per_m": float(value), "origin": origin}
                for m, (value, origin) in enumerate(
                    zip(modes.mean_stiffness, self.origins, strict=True), start=1
                )
            ],
            "natural_frequencies_Hz": [
                float(modes.frequency_Hz[i])
                for i in np.flatnonzero(modes.mesh_energy.sum(axis=0) > MIN_FELT_ENERGY)
            ],
            "modes": [
                {
                    "frequency_Hz": float(modes.frequency_Hz[i]),
                    "average_frequency_Hz": self.averages[i] if self.averages else None,
                    "mesh_energy": [float(part) for part in modes.mesh_energy[:, i]],
                    **{
                        f"{part}_energy": v[i]
                        for part, v in self._parts_without_mesh.items()
                    },
                    "kind": self._kind(i),
                    **self._kinetic_values(i),
                    **self._family_values(i),
                }
                for i in range(modes.frequency_Hz.size)
            ],
            **self._body_values(),
        }

    @cached_property
    def _parts_without_mesh(self) -> dict[str, list[float]]:
        """Fractions (n,) of the strain energy that are not in the meshes.

        What is left of the coupled model is in the bodies of the gears.
        """
        modes = self.modes
        if self.shares is not None:
            return {kind: part.tolist() for kind, part in self.shares.strain.items()}
        parts = {kind: modes.spring_energy(kind) for kind in SPRING_KINDS}
        if self.system is not None:
            outside_bodies = modes.mesh_energy.sum(axis=0) + sum(parts.values())
            parts["body"] = np.where(modes.strain > 0.0, 1.0 - outside_bodies, 0.0)
        return {kind: part.tolist() for kind, part in parts.items()}

    def _kind(self, i: int) -> str:
        """What moves most in a mode."""
        if self.shares is None:
            return name_mode(self.modes, i)
        if self.modes.frequency_Hz[i] == 0.0:
            return "rigid rotation"
        kind, shaft = self.shares.kind(i), int(self.shares.shaft[i])
        if kind == HOUSING:
            return kind
        gears = self.study.gears
        names = [gears.gears[gear].name for gear in gears.shafts[shaft].gears]
        return f"{kind} of {'+'.join(names)}"

    def _kinetic_values(self, i: int) -> dict[str, float]:
        """Parts of the kinetic energy of a mode in space, empty of others."""
        if self.shares is None:
            return {}
        return {f"{m}_motion": float(p[i]) for m, p in self.shares.kinetic.items()}

    def _family_values(self, i: int) -> dict[str, Any]:
        """Family, multiplicity and whirl of a mode of a planetary set, None for
        others."""
        whirl = self.whirl[i] if self.whirl else None
        if not self.families:
            return {"family": None, "multiplicity": None, "whirl": whirl}
        multiplicities_of_modes = multiplicities(self.modes.frequency_Hz.tolist())
        return {
            "family": self.families[i],
            "multiplicity": multiplicities_of_modes[i],
            "whirl": whirl,
        }

    def _body_values(self) -> dict[str, Any]:
        if self.system is None:
            return {**bodies_described({}), "warnings": list(self.gear_warnings)}
        speeds = default_speeds(self.system)
        entries = bodies_described(body_entries(self.system, speeds))
        warnings = body_modes_warnings(self.system, speeds)
        return entries | {"warnings": [*self.gear_warnings, *warnings]}

    @property
    def table(self) -> Table:
        """A row for every mode."""
        meshes = range(1, len(self.origins) + 1)
        first_names = [
            "frequency_Hz",
            *(["average_frequency_Hz"] if self.averages else []),
        ]
        parts = [f"{kind}_energy" for kind in self._parts_without_mesh]
        last_names = ["kind", *(("family", "multiplicity") if self.families else ())]
        last_names += ["whirl"] if self.whirl else []
        moving = [f"{m}_motion" for m in self.shares.kinetic] if self.shares else []
        names = (
            *first_names,
            *(f"mesh{m}_energy_fraction" for m in meshes),
            *(f"{part}_fraction" for part in (*parts, *moving)),
            *last_names,
        )
        rows = [
            (
                *(math.nan if mode[key] is None else mode[key] for key in first_names),
                *mode["mesh_energy"],
                *(mode[key] for key in (*parts, *moving, *last_names)),
            )
            for mode in self.summary["modes"]
        ]
        header = {
            "gear set": self.gear_set,
            "translations": "yes" if self.study.translations else "no",
            "motion": self.study.motion,
            **({"input speed": f"{self.study.rpm:g} rpm"} if self.whirl else {}),
            **{f"mesh {m}": self.origins[m - 1] for m in meshes},
            **self.study.gear_set.entries,
        }
        return Table(names, lambda: rows, header)

    def page(self) -> Page:
        values = self.summary
        if self.reason:
            yield self.reason
        for entry in values["mean_stiffness"]:
            yield (
                f"mesh {entry['mesh']}: mean stiffness "
                f"{entry['stiffness_N_per_m']:.5g} N/m, {entry['origin']}"
            )
        if values["body_modes"] is not None:
            yield with_code(
                "E05",
                f"body modes of the gears {values['body_modes']}; those left out "
                f"{values['body_modes_left_out']}",
            )
        title, torque = values["gear_set"], values["torque_Nm"]
        if torque is not None:
            title += f", {torque:g} N m on the input gear"
        if self.whirl:
            title += f", input at {values['input_speed_rpm']:g} rpm"
        modes = self._modes_in_page(values["modes"])
        columns = {}
        if self.averages:
            columns["averages\nof model 1\n[Hz]"] = [
                "-" if (f := mode["average_frequency_Hz"]) is None else f"{f:.1f}"
                for mode in modes
            ]
        columns |= self._energy_columns(modes)
        if self.families:
            columns["family"] = [mode["family"] for mode in modes]
        if self.whirl:
            columns["whirl"] = [mode["whirl"] for mode in modes]
        columns["what moves most"] = [mode["kind"] for mode in modes]
        frequencies = [f"{mode['frequency_Hz']:10.1f}" for mode in modes]
        yield ColumnTable(frequencies, columns, "natural\nfrequency\n[Hz]", title)
        if others := values["modes"][len(modes) :]:
            ends = (others[0]["frequency_Hz"], others[-1]["frequency_Hz"])
            added = ", which the bodies add" if self.shares is None else ""
            yield (
                f"{pluralize(len(others), 'more mode')}, {ends[0]:.1f} to "
                f"{ends[1]:.1f} Hz{added}: all by -o or --json"
            )

    def _modes_in_page(self, modes: list[dict[str, Any]]) -> list[dict[str, Any]]:
        """The lowest modes, as many as the train has with rigid bodies."""
        if self.shares is not None:
            return modes[:SHOWN_IN_SPACE]
        if self.system is None:
            return modes
        return modes[: self.system.modes.frequency_Hz.size]

    def _energy_columns(self, modes: list[dict[str, Any]]) -> dict[str, list[str]]:
        """Columns of the parts of the strain energy, which add up to 100 %."""
        meshes = range(len(self.origins))
        if len(meshes) > MAX_COLUMNS:
            columns = {
                f"energy in\nmeshes 1 to {len(meshes)}\n[%]": [
                    " ".join(str(round(100.0 * part)) for part in mode["mesh_energy"])
                    for mode in modes
                ]
            }
        else:
            columns = {
                f"energy in\nmesh {m + 1}\n[%]": [
                    f"{100.0 * mode['mesh_energy'][m]:.1f}" for mode in modes
                ]
                for m in meshes
            }
        for kind, parts in self._parts_without_mesh.items():
            if any(abs(part) > MIN_SHOWN_ENERGY for part in parts):
                columns[COLUMN_OF_SPRINGS[kind]] = [
                    f"{100.0 * max(part, 0.0):.1f}" for part in parts[: len(modes)]
                ]
        return columns


def name_mode(modes: Modes, i: int) -> str:
    """Rigid rotation, or the coordinate that holds most of the kinetic energy."""
    energy = modes.coordinates.mass * np.abs(modes.shapes[:, i]) ** 2
    gear, direction = modes.coordinates.labels[int(energy.argmax())]
    if modes.frequency_Hz[i] == 0.0:
        return (
            "rigid rotation" if direction == "rotation" else f"free: {gear} {direction}"
        )
    leader = f"{gear} {direction}"
    if modes.mesh_energy[:, i].sum() < MIN_MESH_ENERGY_FRACTION:
        return f"strains no mesh: {leader}"
    return leader
