"""Validation cases: what to run, what to measure, and what a user would accept.

A case is a TOML file; the built-in ones are in `validation/cases/`. Units are in
the keys. Every tolerance says why it is what it is.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field

from fegear.files.errors import InputError
from fegear.files.output import read_text
from fegear.files.speed_ranges import parsed_speeds
from fegear.gearset.read import path_of
from fegear.statics.excitation_settings import Kind
from lumped.common.checks import format_number
from lumped.steady.motion import APPROACH_STEP
from lumped.steady.sweep import Direction
from validation.study.data_files import (
    MAX_SPEEDS,
    STRICT,
    DataFile,
    Edit,
    Flag,
    Number,
    Positive,
    Speeds,
    Text,
    edits_by_key,
    require_name,
    require_own_names,
)
from validation.study.metrics import FRICTION_EFFECT, METRICS
from validation.study.printed_keys import require_key

FOLDER = Path(__file__).parents[1] / "cases"
LADDER = "model-1", "model-coupled"  # from where to where a budget leads
QUICK_SPEEDS, QUICK_STEPS = 3, 2  # of a sweep; on the way to a single speed
Part = Literal["hardening", "pairs", "body", "meshes", "modes"]  # of the coupled model
Fidelity = Literal["full", "reduced", "quasistatic"]


def _require_metric(name: str) -> str:
    if name not in METRICS:
        raise ValueError(f"must be one of {', '.join(METRICS)}")
    return name


def require_model(number: Any) -> Any:
    if number != "coupled" and (type(number) is not int or number not in (1, 2, 3)):
        raise ValueError("must be 1, 2, 3 or coupled")
    return number


@dataclass(frozen=True, kw_only=True)
class Model:
    """A lumped model and what excites it."""

    __pydantic_config__ = STRICT

    number: Annotated[
        Annotated[Any, AfterValidator(require_model)],
        Field(
            description="Lumped model: 1 every tooth pair with its gap; 2 mean "
            "stiffness and loaded transmission error; 3 total stiffness "
            "and no-load transmission error; or coupled."
        ),
    ]
    excitation: Annotated[
        Kind,
        Field(
            description="Mesh stiffness and transmission error: finite elements or an"
            " analytic wave."
        ),
    ] = "fe"
    without: Annotated[
        tuple[Part, ...],
        Field(description="Parts of the coupled model that are left out."),
    ] = ()
    friction: Annotated[
        Flag,
        Field(description="Whether teeth of model 1 have the friction of the case."),
    ] = False
    bending: Annotated[
        Annotated[Number, Field(ge=0.0, lt=1.0)] | None,
        Field(
            description="Friction-bending ratio. [default: that of the finite elements]"
        ),
    ] = None
    edits: Annotated[
        tuple[Edit, ...],
        Field(description="Changes of the gear set for this model, KEY=VALUE."),
    ] = ()

    def __post_init__(self) -> None:
        if self.friction and self.number != 1:
            raise ValueError("friction needs model 1")
        if self.bending is not None and not self.friction:
            raise ValueError("bending needs friction = true")
        if self.number == "coupled" and self.excitation != "fe":
            raise ValueError("the coupled model takes excitation fe only")
        if self.without and self.number != "coupled":
            raise ValueError("without needs the coupled model")

    @property
    def name(self) -> str:
        """Such as model-1, model-1-rectangular or model-coupled-without-body; with
        friction model-1-friction or model-1-friction-bending-0."""
        parts = [f"model-{self.number}"]
        parts += [f"without-{name}" for name in self.without]
        parts += ["friction"] if self.friction else []
        parts += [] if self.bending is None else [f"bending-{self.bending:g}"]
        parts += [] if self.excitation == "fe" else [self.excitation]
        return "-".join(parts + (["edited"] if self.edits else []))

    @property
    def frictionless(self) -> Model:
        """This model without friction."""
        return replace(self, friction=False, bending=None)


@dataclass(frozen=True, kw_only=True)
class Tolerance:
    """What is allowed of a metric of `validation.study.metrics.METRICS`, and why."""

    __pydantic_config__ = STRICT

    name: Annotated[
        Annotated[str, AfterValidator(_require_metric)],
        Field(description="Metric that is judged."),
    ]
    allowed: Annotated[
        Annotated[Number, Field(ge=0.0)],
        Field(description="Largest value that is allowed."),
    ]
    reason: Annotated[Text, Field(description="Why this value is allowed.")]


@dataclass(frozen=True, kw_only=True)
class SingleSpeed:
    """A motion at one speed [Hz], reached from another, at a torque [N m].

    From rest if `from_speed_Hz` is left out, else through speeds of `step_Hz` at most.
    """

    __pydantic_config__ = STRICT

    torque_Nm: Annotated[
        Positive, Field(description="Torque on the input gear, one of torques_Nm.")
    ]
    speed_Hz: Annotated[
        Positive, Field(description="Mesh frequency of the first mesh.")
    ]
    from_speed_Hz: Annotated[
        Positive | None,
        Field(description="Speed from which it is reached. [default: from rest]"),
    ] = None
    step_Hz: Annotated[
        Positive, Field(description="Largest step on the way from that speed.")
    ] = APPROACH_STEP

    @property
    def quick(self) -> SingleSpeed:
        """This motion, reached in a few steps."""
        if self.from_speed_Hz is None:
            return self
        step = abs(self.from_speed_Hz - self.speed_Hz) / QUICK_STEPS
        return replace(self, step_Hz=max(self.step_Hz, step))

    @property
    def label(self) -> str:
        came = "rest" if self.from_speed_Hz is None else f"{self.from_speed_Hz:g} Hz"
        return f"{self.speed_Hz:g} Hz from {came}"


@dataclass(frozen=True, kw_only=True)
class Printed:
    """A value that the source prints; whether it is met is a finding, no verdict.

    figure : key of the computed value, see `validation.study.printed`; of
        jumps, peaks and natural frequencies the one nearest to the value
    """

    __pydantic_config__ = STRICT

    quantity: Annotated[Text, Field(description="Quantity, as the source names it.")]
    value: Annotated[Number, Field(description="Printed value.")]
    unit: Annotated[str, Field(description="Unit of the printed value.")]
    where: Annotated[Text, Field(description="Where it is printed.")]
    figure: Annotated[
        Annotated[str, AfterValidator(require_key)] | None,
        Field(
            description="Key of the computed value. [default: none, it is not compared]"
        ),
    ] = None


@dataclass(frozen=True, kw_only=True)
class Case:
    """A comparison of lumped models with the finite elements.

    Runs of an ablation are for the error budget: none of them is judged.
    """

    __pydantic_config__ = STRICT

    name: Annotated[
        Annotated[str, AfterValidator(require_name)],
        Field(description="Name of the case, which files are named after."),
    ]
    title: Annotated[Text, Field(description="Heading of the report.")]
    gear_set: Annotated[Text, Field(description="Built-in gear set, or a file's path.")]
    torques_Nm: Annotated[
        Annotated[tuple[Positive, ...], Field(min_length=1)],
        Field(description="Torques on the input gear."),
    ]
    model: Annotated[
        Annotated[
            tuple[Model, ...], Field(min_length=1), AfterValidator(require_own_names)
        ],
        Field(description="Lumped models that are compared."),
    ]
    metric: Annotated[
        Annotated[
            tuple[Tolerance, ...],
            Field(min_length=1),
            AfterValidator(require_own_names),
        ],
        Field(description="Metrics that are judged."),
    ]
    speeds_Hz: Annotated[
        Speeds,
        Field(
            description="Mesh frequencies of the first mesh: A:B:STEP and numbers "
            "with commas; empty where nothing moves."
        ),
    ] = ""
    directions: Annotated[
        Annotated[tuple[Direction, ...], Field(min_length=1)],
        Field(description="Directions of the speed."),
    ] = ("up", "down")
    edits: Annotated[
        tuple[Edit, ...], Field(description="Changes of the gear set, KEY=VALUE.")
    ] = ()
    translations: Annotated[
        Flag, Field(description="Whether centres of gears move on their bearings.")
    ] = False
    friction: Annotated[
        Annotated[Number, Field(ge=0.0, lt=0.5)],
        Field(description="Coefficient of Coulomb friction of the teeth."),
    ] = 0.0
    damping_ratio: Annotated[
        Annotated[Number, Field(ge=0.0, lt=1.0)] | None,
        Field(
            description="Damping ratio of every vibration mode. [default: that of the"
            " gear set]"
        ),
    ] = None
    fidelity: Annotated[Fidelity, Field(description="Finite elements in motion.")] = (
        "reduced"
    )
    single_speed: Annotated[
        tuple[SingleSpeed, ...], Field(description="Motions at one speed.")
    ] = ()
    printed: Annotated[
        tuple[Printed, ...], Field(description="Values that the source prints.")
    ] = ()
    ablation: Annotated[
        Flag,
        Field(
            description="Whether the coupled model is also run without each of its "
            "parts."
        ),
    ] = False
    notes: Annotated[str, Field(description="Text of the report.")] = ""

    @cached_property
    def speeds(self) -> tuple[float, ...]:
        """Frequencies of the first mesh [Hz]."""
        return parsed_speeds(self.speeds_Hz, MAX_SPEEDS)

    @property
    def quick(self) -> Case:
        """This case with few speeds and its first torque, to pass through all of
        the program; its metrics are other ones and cannot be judged.
        """
        torque = self.torques_Nm[0]
        return replace(
            self,
            torques_Nm=(torque,),
            speeds_Hz=", ".join(f"{speed!r}" for speed in self.speeds[:QUICK_SPEEDS]),
            single_speed=tuple(
                motion.quick
                for motion in self.single_speed
                if motion.torque_Nm == torque
            )[:1],
        )

    def edits_of(self, model: Model | None = None) -> dict[str, Any]:
        """Edits of the gear set by key; with those of a model."""
        return edits_by_key((*self.edits, *(() if model is None else model.edits)))


def case_names() -> tuple[str, ...]:
    """Names of the built-in cases, sorted."""
    return tuple(sorted(path.stem for path in FOLDER.glob("*.toml")))


def load_case(name_or_path: str) -> Case:
    """A built-in case by its name, or the one in a file.

    Raises InputError, in one line that names file, field, value and what is allowed.
    """
    names = case_names()
    if name_or_path in names:
        text = read_text(FOLDER / f"{name_or_path}.toml")
        return read_case(text, f"case {name_or_path}")
    path = path_of(name_or_path, "case", names)
    return read_case(read_text(path), str(path))


def read_case(text: str, source: str = "case") -> Case:
    """The case in TOML text; `source` begins the message of an InputError."""
    case = _FILE.read(text, source)
    for metric in case.metric:
        needed = METRICS[metric.name].needs
        if needed and not getattr(case, needed):
            raise InputError(
                f"{source}: metric {metric.name} needs {needed}, which is missing"
            )
    _require_ablation(case, source)
    _require_friction(case, source)
    if len(set(case.torques_Nm)) < len(case.torques_Nm):
        raise InputError(
            f"{source}: torques_Nm = {list(case.torques_Nm)}; each is allowed once"
        )
    for motion in case.single_speed:
        if motion.torque_Nm not in case.torques_Nm:
            allowed = ", ".join(
                f"{format_number(torque)}" for torque in case.torques_Nm
            )
            raise InputError(
                f"{source}: single_speed.torque_Nm = "
                f"{format_number(motion.torque_Nm)}; must be "
                f"one of torques_Nm, {allowed}"
            )
    return case


def _require_ablation(case: Case, source: str) -> None:
    """Require the models that a budget compares."""
    names = {model.name for model in case.model}
    if case.ablation and not names >= set(LADDER):
        raise InputError(
            f"{source}: ablation = true; needs models 1 and coupled, excited by fe"
        )
    if case.ablation and not case.speeds:
        raise InputError(
            f"{source}: ablation = true; needs speeds_Hz, which is missing"
        )


def _require_friction(case: Case, source: str) -> None:
    """That of models is the case's; its effect needs the model without as well."""
    rubbing = [model for model in case.model if model.friction]
    if rubbing and not case.friction:
        raise InputError(f"{source}: model {rubbing[0].name} needs friction above 0")
    if FRICTION_EFFECT not in {entry.name for entry in case.metric}:
        return
    names = {model.name for model in case.model}
    if not rubbing:
        raise InputError(
            f"{source}: metric {FRICTION_EFFECT} needs a model with friction"
        )
    for model in rubbing:
        if model.frictionless.name not in names:
            raise InputError(
                f"{source}: metric {FRICTION_EFFECT} needs "
                f"{model.frictionless.name} beside {model.name}"
            )


_FILE = DataFile(
    Case,
    {
        "model": Model,
        "metric": Tolerance,
        "single_speed": SingleSpeed,
        "printed": Printed,
    },
    kind="case",
)
