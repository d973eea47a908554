"""Runs that a case needs, and all that determines their results."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import get_args

from fegear.dynamics.build import FiniteElements
from fegear.dynamics.stepper import DynamicSettings
from fegear.files.contents import exact_repr
from fegear.files.kept import directory_of_inputs
from fegear.files.version import package_version
from fegear.gearset import load_gear_set
from fegear.gearset.leads import require_uniform_loads
from fegear.gearset.model import GearSet
from fegear.statics.excitation_settings import ExcitationSettings
from fegear.train.model_settings import shares_a_gear
from lumped.steady.integration_settings import Settings
from validation.study.cases import Case, Model, Part, SingleSpeed
from validation.study.metrics import FE, FE_FRICTIONLESS, FRICTION_EFFECT
from validation.study.sources import digest_of

FORMAT = "fegear validation run 5"  # of the files and of their content


@dataclass(frozen=True, kw_only=True)
class RunSpec:
    """A run to be made; model None for the finite elements.

    frictionless : whether these are without the friction of the case
    """

    case: Case
    model: Model | None
    torque: float
    gear_set: GearSet
    frictionless: bool = False

    @property
    def source(self) -> str:
        if self.model is None:
            return FE_FRICTIONLESS if self.frictionless else FE
        return self.model.name

    @property
    def friction(self) -> float:
        """Coefficient of friction of the teeth."""
        has_friction = (
            not self.frictionless if self.model is None else self.model.friction
        )
        return self.case.friction if has_friction else 0.0

    @property
    def single_speeds(self) -> tuple[SingleSpeed, ...]:
        return tuple(w for w in self.case.single_speed if w.torque_Nm == self.torque)

    @property
    def speeds(self) -> tuple[float, ...]:
        """Speeds of the sweeps, single speeds, and the starts of the way to
        these [Hz].
        """
        ends = ((w.speed_Hz, w.from_speed_Hz or w.speed_Hz) for w in self.single_speeds)
        return (*self.case.speeds, *chain.from_iterable(ends))

    @property
    def inputs(self) -> dict[str, str]:
        """All that determines the results."""
        case, model = self.case, self.model
        common = {
            "format": FORMAT,
            "fegear version": package_version(),
            "sources": digest_of("validation.study.solving"),
            "gear set": exact_repr(self.gear_set),
            "torque_Nm": repr(self.torque),
            "speeds_Hz": ", ".join(map(repr, case.speeds)),
            "directions": ", ".join(case.directions),
            "waves": exact_repr(self.single_speeds),
            "translations": repr(case.translations),
            "damping ratio": exact_repr(case.damping_ratio),
        }
        if model is None:
            settings = exact_repr((self.elements, DynamicSettings()))
            return common | {"source": FE, "settings": settings}
        source = ExcitationSettings(kind=model.excitation)
        lumped_inputs = {"model": repr(model.number), "excitation": exact_repr(source)}
        lumped_inputs |= {"without": ", ".join(model.without)} if model.without else {}
        lumped_inputs |= {"friction": repr((self.friction, model.bending))}
        settings = exact_repr(Settings())
        return common | {"source": "lumped", "settings": settings} | lumped_inputs

    @property
    def elements(self) -> FiniteElements:
        return FiniteElements(fidelity=self.case.fidelity, friction=self.friction)

    def directory(self, store: Path) -> Path:
        label = f"{self.source}-{self.torque:g}Nm"
        return directory_of_inputs(store, label, self.inputs)


def tasks_of(case: Case) -> Iterator[RunSpec]:
    """The finite elements first: what they take without tables at hand is theirs."""
    every = [(model, False) for model in (None, *case.model, *parts_of(case))]
    if FRICTION_EFFECT in {entry.name for entry in case.metric}:
        every.insert(1, (None, True))
    for model, plain in every:
        gear_set = load_gear_set(case.gear_set, case.edits_of(model))
        require_uniform_loads(gear_set, "motions by finite elements")
        for torque in case.torques_Nm:
            yield RunSpec(
                case=case,
                model=model,
                torque=torque,
                gear_set=gear_set,
                frictionless=plain,
            )


def parts_of(case: Case) -> tuple[Model, ...]:
    """The coupled model without each of its parts, where an error budget needs it."""
    if not case.ablation:
        return ()
    shared = shares_a_gear(load_gear_set(case.gear_set, case.edits_of()))
    parts = (
        Model(number="coupled", without=(part,))
        for part in get_args(Part)
        if shared or part != "meshes"
    )
    judged = {model.name for model in case.model}
    return tuple(model for model in parts if model.name not in judged)
