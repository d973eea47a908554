"""A part of a figure: what is computed, of which train, and what comes out.

A kind of computation is a class of `Part` with its options, and a function from such a
part and its `Scene` to a `PartResult`; all stand in `computations/kinds.py`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cache, cached_property
from typing import Annotated, Any, ClassVar, Literal

from pydantic import AfterValidator, Field

from fegear.excitation import Excitations, Kind, Source
from fegear.gearset import load_gear_set
from fegear.gearset.model import GearSet
from fegear.lumped_system import LumpedModel, Number, lumped_system
from fegear.statics import Progress
from fegear.train import train_of
from lumped.system import LumpedSystem
from validation.cases import require_model
from validation.data_files import STRICT, Edit, Flag, Positive, edits_by_key

Style = Literal["line", "dashed", "dots", "circles", "points", "crosses", "surface"]
Quantity = Literal["dte_rms", "dte_peak", "separation", "force_peak"]
ModelNumber = Annotated[Any, AfterValidator(require_model)]
Harmonics = Annotated[int, Field(strict=True, ge=1, le=200)]
# label, field of a response, factor
QUANTITIES: Mapping[str, tuple[str, str, float]] = {
    "dte_rms": ("RMS of DTE [um]", "dte_rms", 1e6),
    "dte_peak": ("largest DTE [um]", "dte_peak", 1e6),
    "separation": ("separation angle [rad]", "contact_loss", math.pi),
    "force_peak": ("largest mesh force [kN]", "force_peak", 1e-3),
}


@dataclass(frozen=True, kw_only=True)
class Train:
    """A train and what excites it, of a figure or changed for a part of it.

    edits : `KEY=VALUE` of the gear set; a part's come on top of the figure's
    delay_rad : by which mesh 2 drops to fewer tooth pairs after mesh 1, angle of its
        own cycle; None leaves the phase of the gear set
    wave_harmonics : of the stiffness that excitation fourier keeps
    translations : whether gears move in the plane; rotations alone if left out
    """

    __pydantic_config__ = STRICT

    edits: tuple[Edit, ...] = ()
    excitation: Kind | None = None
    delay_rad: float | None = None
    wave_harmonics: Harmonics | None = None
    torque_Nm: Positive | None = None
    model: ModelNumber | None = None
    translations: Flag | None = None


@dataclass(frozen=True, kw_only=True)
class Part(Train):
    """A computation of a figure.

    name : by which printed values refer to it, that of its kind if empty
    label : of its curves; panel : in which they stand, by default one for each mesh
    keys : patterns of the names of what it finds
    """

    keys: ClassVar[tuple[str, ...]] = ()

    name: str = ""
    label: str = ""
    panel: str = ""

    @property
    def own_name(self) -> str:
        """By which it is known in its figure."""
        return self.name or str(vars(self)["kind"])

    def command(self, scene: Scene) -> Sequence[str]:
        """Words after `fegear` that compute the same, none where there are none."""
        return ()


@dataclass(frozen=True)
class Curve:
    """Points (x, y) of a panel, or (x, y, value) of a surface; NaN parts stretches."""

    panel: str
    label: str
    style: Style
    points: tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class PartResult:
    """What a part gave.

    found : by name, all values of it in the unit of the figure, such as all folds
    """

    curves: tuple[Curve, ...]
    found: Mapping[str, tuple[float, ...]] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Scene:
    """The train of a part, and how the figure shows its vibration.

    meshes : that are shown, counted from 1
    relative : whether frequencies are those over the first natural frequency
    """

    set_name: str
    edits: Mapping[str, Any]
    torque: float
    source: Source
    meshes: tuple[int, ...] = (1,)
    relative: bool = False
    quantity: Quantity = "dte_rms"
    number: Number = 1
    translations: bool = False

    def changed(self, edits: Mapping[str, Any]) -> Scene:
        return replace(self, edits={**self.edits, **edits})

    @cached_property
    def gear_set(self) -> GearSet:
        return load_gear_set(self.set_name, self.edits)

    @cached_property
    def model(self) -> LumpedModel:
        return LumpedModel(
            number=self.number,
            translations=self.translations,
            stiffness=self.source,
        )

    @cached_property
    def system(self) -> LumpedSystem:
        excitations = excitations_of(self.source)
        return lumped_system(self.gear_set, self.torque, self.model, excitations)

    @cached_property
    def unit_Hz(self) -> float:
        """Of the figure's frequencies."""
        return float(self.system.resonances_Hz[0]) if self.relative else 1.0

    def panel(self, part: Part, mesh: int) -> str:
        """Of a mesh counted from 1."""
        if len(self.meshes) == 1:
            return part.panel
        return ", ".join(filter(None, (part.panel, f"mesh {mesh}")))

    def shown(self, figures: Mapping[str, Any] | object, mesh: int) -> float:
        """The figure's quantity of a response, in its unit."""
        _, name, factor = QUANTITIES[self.quantity]
        values = (
            figures[name] if isinstance(figures, Mapping) else getattr(figures, name)
        )
        return factor * float(values[mesh - 1])

    def kept_harmonics(self, option: str) -> list[str]:
        """Of a command: how many harmonics Fourier waves keep."""
        source = self.source
        return [option, str(source.harmonics)] if source.kind == "fourier" else []

    @property
    def words(self) -> list[str]:
        """Of a command: the gear set, the model, what excites it and the edits."""
        source = self.source
        found = [self.set_name, "--torque", f"{self.torque:g}"]
        found += [] if self.number == 1 else ["--model", str(self.number)]
        found += [] if source.kind == "fe" else ["--excitation", source.kind]
        return found + self.train_words

    @property
    def train_words(self) -> list[str]:
        """Those of the train alone, without its gear set."""
        edits = (f"{key}={value}" for key, value in self.edits.items())
        found = [word for edit in edits for word in ("--set", edit)]
        return ["--translations", *found] if self.translations else found


@cache
def excitations_of(source: Source) -> Excitations:
    """One for all parts, whose tables are solved once each."""
    return Excitations(source)


def with_delay(
    set_name: str, edits: Mapping[str, Any], torque: float, delay: float
) -> dict[str, Any]:
    """Edits by which mesh 2 drops to fewer tooth pairs a delay [rad] after mesh 1.

    Phases of a gear set count from the pitch points, those of the source from where
    the stiffness drops, at the end of a tooth pair's path.
    """
    gear_set = load_gear_set(set_name, edits)
    one, two = (mesh.pair.path[1] for mesh in gear_set.meshes[:2])
    rate = float(train_of(gear_set, torque).mesh_rates[1])
    phase = (two - rate * one - delay / (2.0 * math.pi)) % 1.0
    return {**edits, "mesh.2.phase": round(phase, 9)}


def merged(parts: Sequence[Train]) -> Iterator[tuple[str, Any]]:
    """Fields of the first, replaced by those that the others give."""
    for name in (each.name for each in fields(Train) if each.name != "edits"):
        given = [getattr(part, name) for part in parts]
        yield name, next((v for v in reversed(given) if v is not None), None)


def scene_of(part: Part, figure: Train, **others: Any) -> Scene:
    """others : fields of the scene that are the figure's alone"""
    values = dict(merged((figure, part)))
    torque = values["torque_Nm"] or 100.0
    kept = values["wave_harmonics"]
    source = Source(
        kind=values["excitation"] or "fe", **({"harmonics": kept} if kept else {})
    )
    edits = edits_by_key((*figure.edits, *part.edits))
    if values["delay_rad"] is not None:
        edits = with_delay(others["set_name"], edits, torque, values["delay_rad"])
    return Scene(
        edits=edits,
        torque=torque,
        source=source,
        number=values["model"] or 1,
        translations=bool(values["translations"]),
        **others,
    )


Compute = Callable[[Any, Scene, Progress], PartResult]
