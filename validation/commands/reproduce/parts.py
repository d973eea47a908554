"""A part of a figure: what is computed, of which train, and what comes out.

A kind of computation is a class of `Part` with its options, and a function from such a
part and its `Scene`, or `MachineScene`, to a `PartResult`; all are listed in
`computations/kinds.py`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field

from fegear.statics.excitation_settings import Kind
from lumped.common.progress import Progress
from validation.study.cases import require_model
from validation.study.data_files import STRICT, Edit, Flag, Number, Positive

ROUND_OFF = 1e-9  # relative
Value = float | tuple[float, ...]  # a point of a map has two coordinates
Style = Literal[
    "line",
    "wide",
    "dashed",
    "dotted",
    "dots",
    "circles",
    "crosses",
    "points",
    "pale",
    "surface",
    "cells",
    "outline",
    "broken outline",
]
Quantity = Literal["dte_rms", "dte_peak", "separation", "force_peak"]
ModelNumber = Annotated[Any, AfterValidator(require_model)]
Ratio = Annotated[Number, Field(ge=0.0, lt=1.0)]
Harmonics = Annotated[int, Field(strict=True, ge=1, le=200)]
# label, field of a response, factor
QUANTITIES: Mapping[str, tuple[str, str, float]] = {
    "dte_rms": ("RMS of DTE [um]", "dte_rms", 1e6),
    "dte_peak": ("largest DTE [um]", "dte_peak", 1e6),
    "separation": ("separation angle [rad]", "contact_loss", math.pi),
    "force_peak": ("largest mesh force [kN]", "force_peak", 1e-3),
}


@dataclass(frozen=True, kw_only=True)
class TrainOverrides:
    """A train and what excites it, of a figure or changed for a part of it.

    edits : `KEY=VALUE` of the gear set; a part's come on top of the figure's
    delay_rad : by which mesh 2 drops to fewer tooth pairs after mesh 1, angle of its
        own cycle, below 0 where it is early; None leaves the phase of the gear set
    excitation_harmonics : of the stiffness that are kept, by excitation fe or fourier
    translations : whether gears move in the plane; rotations alone if left out
    corner_contact : whether tip corners touch beyond the nominal path of contact in
        the finite elements; they do if left out
    friction : coefficient of sliding friction of the teeth, none if left out
    bending : friction-bending ratio, the mean of the finite elements' if left out;
        "cycle" for that of each pair over its way
    """

    __pydantic_config__ = STRICT

    edits: tuple[Edit, ...] = ()
    excitation: Kind | None = None
    delay_rad: Number | None = None
    excitation_harmonics: Harmonics | None = None
    torque_Nm: Positive | None = None
    model: ModelNumber | None = None
    translations: Flag | None = None
    corner_contact: Flag | None = None
    friction: Ratio | None = None
    bending: Ratio | Literal["cycle"] | None = None


@dataclass(frozen=True, kw_only=True)
class Part(TrainOverrides):
    """A computation of a figure.

    name : by which printed values refer to it, that of its kind if empty
    label : of its curves; panel : that shows them, by default one for each mesh
    y : label of its panel's axis, where it is not the figure's
    shown : whether its curves are drawn; else it is there for what it finds
    keys : patterns of the names of what it finds
    no_command : why none computes the same, where none does
    """

    keys: ClassVar[tuple[str, ...]] = ()
    of_machine: ClassVar[bool] = False  # that may rattle, in place of a train
    of_equation: ClassVar[bool] = False  # of neither
    no_command: ClassVar[str] = "none computes this part alone"

    name: str = ""
    label: str = ""
    panel: str = ""
    y: str = ""
    shown: Flag = True

    @property
    def own_name(self) -> str:
        """Name of the part in its figure."""
        return self.name or str(vars(self)["kind"])

    def quick(self) -> Self:
        """This part with few points, which checks that it still runs."""
        return self

    def command(self, scene: Any) -> Sequence[str]:
        """Words after `fegear` that compute the same, empty if no command does."""
        return ()


@dataclass(frozen=True)
class Curve:
    """Points (x, y), or (x, y, value) of a surface; NaN parts stretches. Cells are
    those of a grid that lead to the motion of the label.

    mesh : that it is of, counted from 1, 0 for none
    panel, label : further words for its panel and in the legend
    """

    style: Style
    points: tuple[tuple[float, ...], ...]
    mesh: int = 0
    panel: str = ""
    label: str = ""


@dataclass(frozen=True)
class PartResult:
    """What a part gave.

    values : by name, all values of it in the unit of the figure, such as all folds
    """

    curves: tuple[Curve, ...]
    values: Mapping[str, tuple[Value, ...]] = field(default_factory=dict)


def first_largest(values: NDArray[np.float64]) -> int:
    """Place of the first of the largest values, which by symmetry may be several.

    Those count as equal that differ by round-off. NaN is no value.
    """
    return int(np.isclose(values, np.nanmax(values), ROUND_OFF, 0.0).argmax())


Compute = Callable[[Any, Any, Progress], PartResult]  # of a part and its scene
