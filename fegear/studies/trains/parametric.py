"""Trains of which parameters are varied: keys of the gear set, torque, damping."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any, ClassVar, Self

from fegear.files.contents import content_digest, exact_repr
from fegear.files.errors import InputError
from fegear.files.speed_ranges import MESH_FREQUENCY
from fegear.gearset.edit import require_known_key
from fegear.gearset.model import GearSet
from fegear.gearset.speeds import cycles_per_turn
from fegear.statics.excitation import ExcitationSource
from fegear.studies.settings import display_name, refusal
from fegear.studies.trains.axes import require_axes, require_within
from fegear.studies.trains.loads import require_torque_axis
from fegear.studies.trains.model_texts import body_entries, file_header
from fegear.studies.trains.train_problem import TrainFacts, TrainProblem
from fegear.studies.trains.train_study import TrainStudy
from fegear.train.lumped_models import lumped_system
from fegear.train.model_settings import NO_FRICTION, LumpedModel
from lumped.common.checks import require_present
from lumped.common.options import Range, allowed_of
from lumped.steady.maps import Axis
from lumped.train.system import LumpedSystem

Point = tuple[float, ...]
TORQUE, DAMPING = "torque_Nm", "damping_ratio"  # axes that are no keys of a gear set,
FRICTION, BENDING = "friction", "friction_bending"  # of teeth, the same of all meshes
SUMMARY_HEAD_KEYS = "gear_set", "model", "model_reason", "excitation"  # of a summary
HEADER_ENTRY_OF_AXIS = {
    FRICTION: "friction coefficient",
    BENDING: "friction-bending ratio",
}
OF_TEETH = {FRICTION: "friction", BENDING: "bending"}  # fields of a lumped model
DAMPING_RATIO_RANGE = require_present(
    allowed_of(LumpedModel.__dataclass_fields__["damping_ratio"]), "allowed"
)
KEY_OF_AXIS = {DAMPING: "dynamics.damping_ratio"}
FIELD_OF_AXIS = {
    TORQUE: "torque",
    DAMPING: "damping_ratio",
    KEY_OF_AXIS[DAMPING]: "damping_ratio",
}


@dataclass(frozen=True, kw_only=True)
class ParametricStudy(TrainStudy):
    """Settings of studies that vary parameters of a train.

    keeps_impossible : whether a point that the gears refuse is a row with the reason,
        not the end of the run
    """

    keeps_impossible: ClassVar[bool] = False
    torque: float | None = None

    @property
    def axes(self) -> tuple[Axis, ...]:
        """Parameters of the train that vary, the speed not among them."""
        raise NotImplementedError

    @property
    def fixed_mesh_frequencies(self) -> tuple[float, ...]:
        """Mesh frequencies of the first mesh [Hz], where they are given."""
        return ()

    @property
    def axis_names(self) -> set[str]:
        """Names of the axes."""
        return {axis.name for axis in self.axes}

    @property
    def has_friction(self) -> bool:
        """Whether teeth have friction somewhere."""
        return bool(self.model.friction) or FRICTION in self.axis_names

    @property
    def reason_for_model_1(self) -> str:
        return NO_FRICTION if self.has_friction else ""

    def __post_init__(self) -> None:
        super().__post_init__()
        over = display_name(self, "over")
        require_axes(self.axes)
        for axis in self.axes:
            self._require_axis(axis, over)

    def _require_axis(self, axis: Axis, over: str) -> None:
        """Refuse an axis that is not known, or is fixed as well."""
        if axis.name == MESH_FREQUENCY:
            speeds = display_name(self, "speeds")
            raise InputError(f"{over} {MESH_FREQUENCY}; is the speed, {speeds}")
        replaced_reason = f"{over} {axis.name} replaces it, leave it out"
        name = OF_TEETH.get(axis.name) or FIELD_OF_AXIS.get(axis.name, "")
        if name == "torque" and self.torque is not None:
            raise refusal(self, "torque", replaced_reason)
        is_model_field = name in ("friction", "bending", "damping_ratio")
        if is_model_field and getattr(self.model, name) != getattr(LumpedModel(), name):
            raise self.rejection(name, replaced_reason)
        if axis.name == BENDING and not self.has_friction:
            raise InputError(
                f"{over} {BENDING}; needs {display_name(self, 'friction')} above 0"
            )
        if name == "torque":
            require_torque_axis(axis, over)
        elif axis.name in OF_TEETH:
            require_within(axis, Range(0.0, below=1.0), over)
        elif name == "damping_ratio":
            require_within(axis, DAMPING_RATIO_RANGE, over)
        key = KEY_OF_AXIS.get(axis.name, axis.name)
        if key in self.gear_set.overrides:
            raise self.gear_set.rejection(key, f"{over} varies it, leave it out")
        if axis.name != TORQUE and axis.name not in OF_TEETH:
            require_known_key(key)


@dataclass(frozen=True, eq=False)
class ParametricProblem(TrainProblem):
    """A train of which parameters vary."""

    @classmethod
    def of(cls, study: Any) -> Self:
        problem = super().of(study)
        if not study.keeps_impossible:
            problem._require_values_of_keys()
        return problem

    def _require_values_of_keys(self) -> None:
        """Refuse values that the gears refuse; of other axes the first value stands."""
        first = {axis.name: axis.values[0] for axis in self.study.axes}
        for axis in self.study.axes:
            for value in axis.values:
                changes = _keys_of({**first, axis.name: value})
                self._gear_set_with_values(tuple(changes.items()))

    @property
    def varied_models(self) -> tuple[LumpedModel, ...]:
        axes = {axis.name: max(axis.values) for axis in self.study.axes}
        values = {OF_TEETH[name]: axes[name] for name in OF_TEETH.keys() & axes.keys()}
        changes: dict[str, Any] = values
        return (replace(self.model, **changes),)

    @cached_property
    def reference_torque(self) -> float:
        """Torque on the input gear where no axis varies it [N m]."""
        axis_torques = [
            max(axis.values) for axis in self.study.axes if axis.name == TORQUE
        ]
        return axis_torques[0] if axis_torques else self.single_torque

    @cached_property
    def excitations(self) -> ExcitationSource:
        """One for all points, whose tables are solved once each."""
        return self.model.excitations

    def _system_at_load(self, model: LumpedModel) -> LumpedSystem:
        return lumped_system(self.gears, self.reference_torque, model, self.excitations)

    @cached_property
    def _reference_system(self) -> LumpedSystem | None:
        """System that defines the body modes of all points."""
        coupled = self.model.number == "coupled"
        return self._system_at_load(self.model) if coupled else None

    def system(self, point: Point) -> LumpedSystem:
        """The lumped system of a point."""
        names = [axis.name for axis in self.study.axes]
        values = dict(zip(names, point, strict=True))
        torque = values.get(TORQUE, self.reference_torque)
        tooth_values: dict[str, Any] = {
            OF_TEETH[name]: values[name] for name in OF_TEETH.keys() & values.keys()
        }
        try:
            model = replace(self.model, **tooth_values)
        except ValueError as error:
            raise InputError(str(error)) from None
        gears = self._gear_set_with_values(tuple(_keys_of(values).items()))
        arguments = gears, torque, model, self.excitations
        return lumped_system(*arguments, self._reference_system)

    @cached_property
    def _gear_set_with_values(self) -> Any:
        """The gear set with other values of keys; the last one is kept."""

        def change_gear_set(values: tuple[tuple[str, float], ...]) -> GearSet:
            return self.study.gear_set.changed(dict(values)) if values else self.gears

        return lru_cache(maxsize=1)(change_gear_set)

    @cached_property
    def ratio(self) -> float | None:
        """Damping ratio of every mode, None where it varies."""
        is_varied = bool({DAMPING, KEY_OF_AXIS[DAMPING]} & self.study.axis_names)
        return None if is_varied else self._any_system.train.damping_ratio

    @cached_property
    def _any_system(self) -> LumpedSystem:
        if self._reference_system is not None:
            return self._reference_system
        model = self.model
        if BENDING in self.study.axis_names:
            model = replace(model, bending=0.0)  # no mesh table need have it
        return self._system_at_load(model)

    def header(self, integration: str) -> dict[str, str]:
        """Entries of a file without what the axes vary; see `file_header`."""
        # the friction is described unless no point has any
        axes = self.study.axes
        largest_frictions = (max(axis.values) for axis in axes if axis.name == FRICTION)
        friction = next(largest_frictions, self.study.model.friction)
        shown_model = replace(self.model, friction=friction)
        header = file_header(self.gears, shown_model, self.ratio or 0.0, integration)
        if self.study.fixed_mesh_frequencies:
            header |= body_entries(self._any_system, self.study.fixed_mesh_frequencies)
        if self.ratio is None:
            del header["damping ratio"]
        for name, entry in HEADER_ENTRY_OF_AXIS.items():
            if name in self.study.axis_names:
                header.pop(entry, None)
        return header | {"model": self.model.name}

    def facts(
        self,
        over: str,
        header: Mapping[str, str],
        speed: float | None = None,
        warnings: Iterable[str] = (),
    ) -> TrainFacts:
        """What a result tells of the train, None for what varies.

        over : name of what varies; speed : of the first mesh where it does not [Hz]
        warnings : besides those of the train at rest
        """
        train_values = self.summary_head(self.ratio)
        summary = {
            **{name: train_values[name] for name in SUMMARY_HEAD_KEYS},
            "over": over,
            "speed_Hz": speed,
            "torque_Nm": None
            if TORQUE in self.study.axis_names
            else self.reference_torque,
            "damping_ratio": self.ratio,
        }
        names = self.study.axis_names
        teeth_vary = any(
            name.endswith(".teeth") or name.startswith("planetary.") for name in names
        )
        system = {self.reference_torque: self._any_system}
        rest_warnings = self.warnings_at_rest(system, self.study.fixed_mesh_frequencies)
        return TrainFacts(
            summary=summary,
            header={**header, **self.study.gear_set.entries},
            cycles_per_turn=None if teeth_vary else cycles_per_turn(self.gears),
            notes=self.notes,
            warnings=(*rest_warnings, *warnings),
        )


def _keys_of(values: Mapping[str, float]) -> dict[str, float]:
    """Values of keys of the gear set, whole numbers as such, by those of axes."""
    return {
        KEY_OF_AXIS.get(name, name): int(value) if float(value).is_integer() else value
        for name, value in values.items()
        if name != TORQUE and name not in OF_TEETH
    }


def digest(gear_set: GearSet) -> str:
    """Tells gear sets apart that have one name, such as a file that was edited."""
    return content_digest(exact_repr(gear_set).encode())
