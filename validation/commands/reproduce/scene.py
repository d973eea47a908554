"""The train of a part, and how its figure shows what it does."""

from __future__ import annotations

import math
from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cache, cached_property
from typing import Any, Literal

import numpy as np

from fegear.files.contents import exact_repr
from fegear.files.errors import InputError
from fegear.gearset import load_gear_set
from fegear.gearset.lumped_train import train_of
from fegear.gearset.model import GearSet
from fegear.gearset.power_path import mesh_torques_at
from fegear.statics.excitation import STIFFNESS, Excitations
from fegear.statics.excitation_settings import ExcitationSettings, Kind
from fegear.statics.given_tables import GivenTables
from fegear.studies.trains.parametric import BENDING, FRICTION, OF_TEETH
from fegear.train.lumped_models import lumped_system
from fegear.train.model_settings import LumpedModel, Number
from lumped.train.modes import MIN_RESONANCE_ENERGY
from lumped.train.system import LumpedSystem
from lumped.train.table import MeshTable
from validation.commands.reproduce.parts import (
    QUANTITIES,
    Part,
    Quantity,
    TrainOverrides,
)
from validation.study.data_files import edits_by_key

# among keys of a gear set, though none is
DELAY, LEAD, CONTACT_RATIO = "delay_rad", "lead_rad", "contact_ratio"


@dataclass(frozen=True, eq=False, kw_only=True)
class Scene:
    """A train at a torque on its input gear [N m].

    overrides : edits of the gear set, without the phase that a delay gives
    delay : see `Train`
    stored : harmonics of the finite elements' stiffness, None for all
    relative : whether frequencies are those over the first natural frequency
    friction, bending : of the teeth, see `Train`
    """

    set_name: str
    overrides: Mapping[str, Any]
    torque: float
    source: ExcitationSettings
    delay: float | None = None
    stored: int | None = None
    relative: bool = False
    quantity: Quantity = "dte_rms"
    number: Number = 1
    translations: bool = False
    friction: float = 0.0
    bending: float | Literal["cycle"] | None = None

    @property
    def inputs(self) -> dict[str, str]:
        """All of it that determines a result."""
        return {
            "gear set": exact_repr(self.gear_set),
            "torque_Nm": repr(self.torque),
            "model": exact_repr(self.model),
            "shown": repr((self.relative, self.quantity)),
        }

    def changed(self, values: Mapping[str, float]) -> Scene:
        """This scene with other parameters of the gear set or of friction, another
        delay or lead of mesh 2, or another contact ratio of mesh 1, see
        `with_contact_ratio`.
        """
        parameters = dict(values)
        teeth = OF_TEETH.keys() & parameters.keys()
        tooth_fields: dict[str, Any] = {
            OF_TEETH[key]: parameters.pop(key) for key in teeth
        }
        edits = {k: int(v) if v.is_integer() else v for k, v in parameters.items()}
        delay = edits.pop(DELAY, self.delay)
        if LEAD in edits:
            delay = -edits.pop(LEAD)
        if CONTACT_RATIO in edits:
            ratio = float(edits.pop(CONTACT_RATIO))
            edits |= self.with_contact_ratio(ratio)
        return replace(
            self, overrides={**self.overrides, **edits}, delay=delay, **tooth_fields
        )

    def with_contact_ratio(self, ratio: float) -> dict[str, float]:
        """The tip of the driver that ends the path of mesh 1 there; its start stays."""
        mesh = load_gear_set(self.set_name, self.overrides).meshes[0]
        pair = mesh.pair
        end = pair.path_start + ratio * pair.base_pitch
        tip = math.hypot(pair.driver.base_radius, end)
        # up to a nanometre, so that a contact ratio of 1 is one
        return {f"gear.{mesh.driver + 1}.tip_radius_mm": math.ceil(1e9 * tip) / 1e6}

    @cached_property
    def edits(self) -> dict[str, Any]:
        """All that is set in the gear set.

        Phases of a gear set count from the pitch points, delays from where the
        stiffness drops, at the end of a tooth pair's path.
        """
        if self.delay is None:
            return dict(self.overrides)
        gear_set = load_gear_set(self.set_name, self.overrides)
        one, two = (mesh.pair.path[1] for mesh in gear_set.meshes[:2])
        rate = float(train_of(gear_set, self.torque).mesh_rates[1])
        phase = (two - rate * one - self.delay / (2.0 * math.pi)) % 1.0
        return {**self.overrides, "mesh.2.phase": round(phase, 9)}

    @cached_property
    def gear_set(self) -> GearSet:
        return load_gear_set(self.set_name, self.edits)

    @cached_property
    def model(self) -> LumpedModel:
        return LumpedModel(
            number=self.number,
            translations=self.translations,
            excitation=self.source if self.stored is None else self._few_harmonics(),
            friction=self.friction,
            bending=self.bending,
        )

    @cached_property
    def system(self) -> LumpedSystem:
        excitations = excitations_of(self.source) if self.stored is None else None
        return lumped_system(self.gear_set, self.torque, self.model, excitations)

    def _few_harmonics(self) -> GivenTables:
        """Tables of the finite elements' stiffness of which few harmonics are left."""
        elements, tables = excitations_of(self.source), []
        for mesh, torque in enumerate(mesh_torques_at(self.gear_set, self.torque)):
            table = elements.table(self.gear_set, mesh, torque)
            waves = np.fft.rfft(table[STIFFNESS])
            waves[:, (self.stored or 0) + 1 :] = 0.0
            columns = {STIFFNESS: np.fft.irfft(waves, table.position.size)}
            few = MeshTable(table.torque_Nm, table.position, columns, {})
            tables.append((f"mesh {mesh + 1}, {self.stored} harmonics", few))
        return GivenTables(tuple(tables))

    @cached_property
    def modes(self) -> list[int]:
        """Places, among modes that move, of those that meshes excite.

        Modes of a figure are counted among them, from 1.
        """
        system = self.system
        energy = system.modes.mesh_energy[:, system.moving].sum(axis=0)
        return [int(index) for index in np.flatnonzero(energy >= MIN_RESONANCE_ENERGY)]

    def place_of(self, mode: int) -> int:
        """Place of a mode among those that move."""
        if mode > len(self.modes):
            raise InputError(
                f"mode = {mode}; meshes of {self.set_name} excite {len(self.modes)}"
            )
        return self.modes[mode - 1]

    @cached_property
    def unit_Hz(self) -> float:
        """Unit of the figure's frequencies [Hz]."""
        first = self.system.resonances_Hz[self.modes[0]] if self.relative else 1.0
        return float(first)

    @property
    def meshes(self) -> range:
        """Numbers of its meshes, counted from 1."""
        return range(1, len(self.gear_set.meshes) + 1)

    def shown(self, figures: Mapping[str, Any] | object, mesh: int) -> float:
        """The figure's quantity of a response, in its unit."""
        _, name, factor = QUANTITIES[self.quantity]
        values = (
            figures[name] if isinstance(figures, Mapping) else getattr(figures, name)
        )
        return factor * float(values[mesh - 1])

    @property
    def harmonics_argv(self) -> list[str]:
        """Words of a command: the number of harmonics of Fourier waves."""
        source = self.source
        if source.kind != "fourier":
            return []
        return ["--excitation-harmonics", str(source.harmonics)]

    @property
    def argv(self) -> list[str]:
        """Words of a command of lumped models: what those of finite elements have, and
        the model."""
        argv = [*self.element_words, "--model", str(self.number)]
        if self.source.relief_stiffness != "own" and not self.needs_tables:
            argv += ["--relief-stiffness", self.source.relief_stiffness]
        return argv

    @property
    def element_words(self) -> list[str]:
        """Words of a command: the gear set, the excitation and the edits."""
        source = self.source
        argv = [self.set_name, "--torque", f"{self.torque:g}"]
        argv += [] if source.kind == "fe" else ["--excitation", source.kind]
        if self.needs_tables:
            argv += [word for path in self._tables for word in ("--table", path)]
        return argv + self.train_words

    def friction_words(self, over: Container[str] = ()) -> list[str]:
        """Words of a command that takes friction of the teeth, without what varies."""
        if FRICTION in over:
            return [] if BENDING in over else self.bending_words
        argv = self.coefficient_words
        return argv + self.bending_words if argv and BENDING not in over else argv

    @property
    def coefficient_words(self) -> list[str]:
        """Words of friction where finite elements bend the teeth."""
        return ["--friction", f"{self.friction:g}"] if self.friction else []

    @property
    def bending_words(self) -> list[str]:
        if isinstance(self.bending, str):
            return ["--bending", "cycle"]
        return [] if self.bending is None else ["--bending", f"{self.bending:g}"]

    @property
    def needs_tables(self) -> bool:
        """Whether a command takes mesh tables that another one makes."""
        return self.source.kind == "fe" and not self.source.corner_contact

    @property
    def _tables(self) -> list[str]:
        return [f"mesh-{mesh}.csv" for mesh in self.meshes]

    @property
    def no_commands(self) -> str:
        """Why no command has this train, empty where commands have it."""
        if self.stored is not None:
            return "no command keeps few harmonics of the finite elements' stiffness"
        if self.needs_tables and any(key.startswith("mesh.") for key in self.overrides):
            return "no command makes mesh tables of a mesh that --set changes"
        return ""

    def table_commands(self) -> Iterator[list[str]]:
        """Commands that make the mesh tables that a command takes, if it takes any."""
        if not self.needs_tables:
            return
        torques = mesh_torques_at(self.gear_set, self.torque)
        for mesh, torque in zip(self.meshes, torques, strict=True):
            at = ["--mesh", str(mesh), "--torque", f"{torque:.9g}"]
            options = ["--positions", str(self.source.positions), "--no-corner-contact"]
            yield [
                "stiffness",
                self.set_name,
                *at,
                *options,
                "-o",
                self._tables[mesh - 1],
            ]

    @property
    def train_words(self) -> list[str]:
        """Words of the train alone, without its gear set."""
        edits = (f"{key}={value}" for key, value in self.edits.items())
        options = [word for edit in edits for word in ("--set", edit)]
        return ["--translations", *options] if self.translations else options


@dataclass(frozen=True)
class NoScene:
    """The scene of a part that needs neither gears nor a machine."""

    no_commands = ""  # every part says for itself

    @property
    def inputs(self) -> dict[str, str]:
        return {}

    def table_commands(self) -> Iterator[list[str]]:
        return iter(())


@cache
def excitations_of(source: ExcitationSettings) -> Excitations:
    """One for all parts, whose tables are solved once each."""
    return Excitations(source)


def scene_of(part: Part, figure: TrainOverrides, **others: Any) -> Scene:
    """The figure's train with what a part changes.

    others : fields of the scene that are the figure's alone
    """
    values = {
        setting.name: _latest((figure, part), setting.name)
        for setting in fields(TrainOverrides)
        if setting.name != "edits"
    }
    kind: Kind = values["excitation"] or "fe"
    harmonic_count = values["excitation_harmonics"]
    fourier = (
        {"harmonics": harmonic_count} if kind == "fourier" and harmonic_count else {}
    )
    edits = edits_by_key((*figure.edits, *part.edits))
    number: Number = values["model"] or 1
    # the source takes the stiffnesses of tooth pairs from teeth without relief
    relieved = kind == "fe" and any("_relief" in key for key in edits)
    takes_unmodified = relieved and number == 1
    return Scene(
        overrides=edits,
        torque=values["torque_Nm"] or 100.0,
        source=ExcitationSettings(
            kind=kind,
            corner_contact=values["corner_contact"] is not False,
            relief_stiffness="unmodified" if takes_unmodified else "own",
            **fourier,
        ),
        delay=values["delay_rad"],
        stored=harmonic_count if kind == "fe" else None,
        number=number,
        translations=bool(values["translations"]),
        friction=values["friction"] or 0.0,
        bending=values["bending"],
        **others,
    )


def _latest(trains: Sequence[TrainOverrides], name: str) -> Any:
    settings = [getattr(train, name) for train in trains]
    return next((value for value in reversed(settings) if value is not None), None)
