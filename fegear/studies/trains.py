"""What studies of a gear set's train share: which gears, which model, what load."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, ClassVar, TypeVar, get_args

from fegear.boundary import require_gear_set
from fegear.files.contents import exact_repr
from fegear.files.errors import InputError
from fegear.files.speeds import parsed_speeds, written_speeds
from fegear.gearset import load_gear_set
from fegear.gearset.edit import parsed_value
from fegear.gearset.fault_checks import require_no_faults, require_nominal
from fegear.gearset.faults import FAULT_KINDS
from fegear.gearset.model import GearSet
from fegear.gearset.plausibility import gear_set_warnings
from fegear.gearset.power_path import input_torques
from fegear.gearset.read import files_of_gear_set
from fegear.gearset.speeds import cycles_per_turn, mesh_frequency
from fegear.statics.excitation import StiffnessSource
from fegear.statics.mesh_table_files import TABLE_FILE
from fegear.studies.axes import limits_or_single, written_limits
from fegear.studies.page import pluralize
from fegear.studies.settings import (
    Setting,
    SettingsGroup,
    argument,
    display_name,
    expose,
    exposed_fields,
    group,
    group_of,
    refusal,
    require_settings,
    setting,
)
from fegear.train.lumped_models import (
    SPRING_MODELS,
    LumpedModel,
    Number,
)
from lumped.common.options import Range
from lumped.steady.maps import Axis
from lumped.steady.settings import Settings

Study = TypeVar("Study", bound=Any)
MIN_TORQUE = 1e-6  # N m, less is lost in round-off
FREQUENCY = Range(above=0.0, below=1e9, unit="Hz")
RPM = Range(above=0.0, below=1e9, unit="rpm")
LOAD = "must be 0, or at least 1e-6 and below 1e9 N m, on the input gear"
DRIVER_LOAD = "must be at least 1e-6 and below 1e9 N m, on the driving gear"
TABLES = (
    f"Mesh table {TABLE_FILE} to use instead of finite elements; give one for each "
    "mesh, in order. The coupled model needs the columns of tooth pairs, at two or "
    "more torques unless hardening is left out."
)


@dataclass(frozen=True, kw_only=True)
class GearSetRef:
    """A gear set by its name, and what is changed in it for one run.

    preloaded : the gear set itself, in place of one that is read
    """

    name: str = argument(
        "SET",
        "Name of a built-in gear set, or path of a gear-set file (TOML).",
        reads=True,
    )
    edits: tuple[str, ...] = setting(
        (),
        "Change a key of the gear set for this run, such as "
        "mesh.1.tip_relief.magnitude_um=10; may be repeated.",
        option="--set",
        metavar="KEY=VALUE",
    )
    preloaded: GearSet | None = None

    def __post_init__(self) -> None:
        require_settings(self)
        _ = self.overrides  # refuses what is no change

    @classmethod
    def of(cls, gear_set: GearSet) -> GearSetRef:
        require_gear_set(gear_set)
        return cls(name=gear_set.name, preloaded=gear_set)

    @cached_property
    def overrides(self) -> dict[str, Any]:
        """Values by key; InputError where there is no `=` or a key comes twice."""
        values: dict[str, Any] = {}
        for text in self.edits:
            key, separator, value = (part.strip() for part in text.partition("="))
            if not (separator and key and value):
                raise self.rejection(text, "KEY=VALUE is needed")
            if key in values:
                raise self.rejection(text, f"{key} is given more than once")
            values[key] = parsed_value(value)
        return values

    @cached_property
    def loaded(self) -> GearSet:
        """The gear set as changed."""
        return self.changed({})

    @cached_property
    def warnings(self) -> tuple[str, ...]:
        """Warnings of the gear set, a line each."""
        return tuple(gear_set_warnings(self.loaded))

    def healthy(self, model: str) -> GearSet:
        """The gear set; InputError with faults, which a model leaves out."""
        require_no_faults(self.loaded, FAULT_KINDS, model)
        return self.loaded

    def nominal(self, model: str) -> GearSet:
        """The gear set; InputError with faults or errors, which a model leaves out."""
        require_nominal(self.loaded, model)
        return self.loaded

    def changed(self, values: Mapping[str, Any]) -> GearSet:
        """The gear set with other values of keys as well."""
        changes = {**self.overrides, **values}
        if self.preloaded is None:
            return load_gear_set(self.name, changes)
        if changes:
            raise InputError(f"{', '.join(changes)}: needs a gear set by its name")
        return self.preloaded

    def rejection(self, text: str, reason: str) -> InputError:
        """Why a change is not made, or does nothing."""
        return InputError(f"{display_name(self, 'edits')} {text}; {reason}")

    @property
    def entries(self) -> dict[str, str]:
        """Entries for the header of a file: what was changed."""
        return {f"set {key}": str(value) for key, value in self.overrides.items()}

    @property
    def inputs(self) -> str:
        """All that a checkpoint must agree with."""
        return exact_repr(self.loaded)

    @property
    def named_files(self) -> list[str]:
        """Files that the gear-set file names."""
        return self.files_with({})

    def files_with(self, values: Mapping[str, Any]) -> list[str]:
        """Files that the gear-set file names, with other values of keys as well."""
        if self.preloaded is not None:
            return []
        return files_of_gear_set(self.name, {**self.overrides, **values})


DEFAULT_PAIR = GearSetRef(name="liu-pair")


def mesh_setting() -> Any:
    return setting(1, "Number of the mesh, counted from 1.")


def mesh_index(gears: GearSet, mesh: int) -> int:
    """Index from 0 of a mesh by its number; InputError where it is not there."""
    count = len(gears.meshes)
    if not 1 <= mesh <= count:
        has = pluralize(count, "mesh", "meshes")
        raise InputError(f"mesh = {mesh}; {gears.name} has {has}")
    return mesh - 1


def speeds_setting(
    default: Any, text: str, allowed: Range = FREQUENCY, **options: Any
) -> Any:
    """A setting of mesh frequencies, `A:B:STEP` in words."""

    def read(value: str) -> tuple[float, ...]:
        speeds = parsed_speeds(value)
        if not speeds:
            raise ValueError("a speed is needed")
        return speeds

    how: dict[str, Any] = {"metavar": "A:B:STEP", "write": written_speeds}
    return setting(default, text, allowed, parse=read, **how | options)


RPM_HELP = (
    "Rotational speed of the first mesh's driver, in a planetary set of its input "
    "[rpm], instead of {}."
)


def rpms_setting(instead: str) -> Any:
    """A setting of rotational speeds; instead : of which option."""
    text = RPM_HELP.format(instead).replace("speed", "speeds", 1)
    return speeds_setting((), text, RPM)


def rpm_limits_setting(instead: str) -> Any:
    """A setting of two rotational speeds A:B, or of one."""
    how: dict[str, Any] = {"parse": limits_or_single, "write": written_limits}
    return setting((), RPM_HELP.format(instead), RPM, metavar="A:B", **how)


def rpm_setting(instead: str) -> Any:
    """A setting of one rotational speed; instead : of which option."""
    return setting(None, RPM_HELP.format(instead), RPM, metavar="RPM")


def refuse_both(study: Any, *names: str) -> None:
    """Raise InputError where two of some settings are given."""
    present = [name for name in names if getattr(study, name) not in (None, ())]
    if len(present) > 1:
        shown = " and ".join(display_name(study, name) for name in present)
        raise InputError(f"{shown} exclude each other")


def with_frequencies(study: Study, speeds: Mapping[str, Any]) -> Study:
    """A study with mesh frequencies [Hz] in place of speeds of rotation.

    speeds : in rpm, by the names of the settings in Hz; None or () where not given
    """
    given = {name: rpm for name, rpm in speeds.items() if rpm not in (None, ())}
    if not given:
        return study
    cycles = cycles_per_turn(study.gear_set.loaded)
    frequencies = {
        name: tuple(mesh_frequency(cycles, one) for one in rpm)
        if isinstance(rpm, tuple)
        else mesh_frequency(cycles, rpm)
        for name, rpm in given.items()
    }
    of_rotation = {
        member.name: member.default
        for member in exposed_fields(group_of(study))
        if member.name in ("rpm", "from_rpm")
    }
    return replace(study, **of_rotation, **frequencies)


def torque_setting() -> Any:
    return setting(
        None,
        "Torque on the input gear [N\u00a0m]. [default: middle load case of the gear "
        "set]",
        one_or_list=True,
    )


def torques_setting(gear: str = "input gear") -> Any:
    """A setting of torques, each a number or `A:B:STEP` in words.

    gear : on which they act
    """
    return setting(
        (),
        f"Torque on the {gear} [N\u00a0m], or several as A:B:STEP or with commas; may "
        "be repeated. [default: all load cases of the gear set]",
        option="--torque",
        metavar="A:B:STEP",
        parse=_torques,
        several=True,
        one_or_list=True,
    )


def _torques(text: str) -> tuple[float, ...]:
    with suppress(ValueError):
        return (float(text),)
    return parsed_speeds(text, name="torques")


def chosen_torques(
    gears: GearSet, torques: tuple[float, ...], mesh: int | None = None
) -> tuple[float, ...]:
    """Torques on the input gear [N m]: as asked, or the gear set's load cases.

    mesh : counted from 1, on whose driver they are instead
    """
    free = mesh is None  # gears without load can be integrated, not solved at rest
    for value in torques:
        _require_load(value, "torque", free)
        if torques.count(value) > 1:
            raise InputError(f"torque = {value:.12g}; is given more than once")
    load_cases = (
        input_torques(gears) if mesh is None else gears.meshes[mesh - 1].torques
    )
    if not torques and not load_cases:
        where = "" if free else f" for mesh {mesh}"
        raise InputError(f"torque is missing; {gears.name} has no load case{where}")
    return torques or load_cases


def _require_load(value: float, name: str, free: bool) -> None:
    """Refuse a torque that is no load; free : whether it may be 0."""
    if not (MIN_TORQUE <= value < 1e9 or (free and value == 0.0)):
        raise InputError(f"{name} = {value:.12g}; {LOAD if free else DRIVER_LOAD}")


def require_torque_axis(axis: Axis, over: str) -> None:
    """Refuse an axis of torques on the input gear of which one is no load."""
    for value in axis.values:
        _require_load(value, f"{over} {axis.name}", free=True)


def chosen_torque(
    gears: GearSet, torque: float | None, mesh: int | None = None
) -> float:
    """The torque that is asked for [N m], or the middle load case."""
    torques = chosen_torques(gears, () if torque is None else (torque,), mesh)
    return torques[len(torques) // 2]


def _number(text: str) -> Any:
    if text in get_args(Number):
        return text
    if text not in ("1", "2", "3"):
        raise ValueError("allowed auto, coupled, 1, 2 and 3")
    return int(text)


def _idle_source(source: StiffnessSource) -> Iterator[tuple[str, str]]:
    if source.kind != "trapezoid":
        yield "ramp", "needs {kind} trapezoid"
    if source.kind != "fourier":
        yield "harmonics", "needs {kind} fourier"
    if source.kind != "fe":
        yield "relief_stiffness", "needs {kind} fe"


SOURCE = SettingsGroup(
    kind=StiffnessSource,
    unused_options=_idle_source,
    exposed=expose(
        *("kind", "ramp", "harmonics", "plane", "resolution", "relief_stiffness"),
        kind=Setting(option="--excitation"),
        harmonics=Setting(option="--excitation-harmonics"),
    ),
)
SPRINGS = expose(
    *("number", "damping_ratio", "translations", "stiffness"),
    number=Setting(
        option="--model", metavar="1|2|3", text=f"{SPRING_MODELS}.", parse=_number
    ),
    damping_ratio=Setting(option="--damping"),
    translations=Setting(option="--translations"),
    stiffness=SOURCE,
)
ALL_MODELS = SPRINGS | expose(
    *("number", "without"),
    number=Setting(option="--model", metavar="auto|coupled|1|2|3", parse=_number),
)
SLIDING = expose(
    *("friction", "bending"),
    bending=Setting(
        metavar="RATIO",
        parse=float,
        flags=(
            (
                "--varying-bending",
                "cycle",
                "Use the friction-bending ratio of each tooth pair along its path"
                " from the mesh tables instead of the mean.",
            ),
            (
                "--no-bending",
                0.0,
                "Leave out the bending of teeth by friction; the ratio is 0.",
            ),
        ),
    ),
)
MOVING = SLIDING | expose(
    *("sliding", "transition", "torque_of"),
    transition=Setting(option="--transition-speed"),
)


BEARINGS = expose("bearings", bearings=Setting(option="--bearings"))


def _idle_model(model: LumpedModel) -> Iterator[tuple[str, str]]:
    if model.number != "coupled":
        yield "without", "needs {number} coupled"
    if model.sliding != "instantaneous":
        yield "transition", "needs {sliding} instantaneous"
    if not model.translations:
        yield "bearings", "needs {translations}"


def lumped_model(
    offers: Mapping[str, Setting | SettingsGroup],
    number: Number = "auto",
) -> Any:
    """A field for a lumped model with these settings; number : by default."""
    default = LumpedModel(number=number)
    return group(
        SettingsGroup(
            kind=LumpedModel,
            exposed=offers,
            unused_options=_idle_model,
            default=default,
        )
    )


def _idle_integration(settings: Settings) -> Iterator[tuple[str, str]]:
    if settings.method != "rk4":
        yield "steps", f"{settings.method} chooses its own steps"


SETTLING = "tolerance", "max_periods"


def lumped_integration() -> Any:
    """A field for the time integration of lumped models."""
    exposed = expose(*SETTLING, "steps", "method")
    return group(
        SettingsGroup(kind=Settings, exposed=exposed, unused_options=_idle_integration)
    )


def tables_setting() -> Any:
    return setting(
        (),
        TABLES,
        metavar="FILE",
        reads=True,
    )


@dataclass(frozen=True, kw_only=True)
class TrainStudy:
    """Settings of all studies of a lumped train; `model` is a `lumped_model` field.

    Where the command reads mesh tables, `table` is declared by `tables_setting`.

    has_rolling : whether its motions may be those on rolling bearings, which have no
        common period; otherwise bearings are linear
    """

    has_rolling: ClassVar[bool] = False

    gear_set: GearSetRef
    model: LumpedModel
    table: tuple[str, ...] = field(default=(), metadata={"help": TABLES})

    def __post_init__(self) -> None:
        super().__post_init__()  # type: ignore[misc]
        if not self.has_friction:
            for name in ("bending", "sliding", "torque_of"):
                if getattr(self.model, name) != getattr(LumpedModel(), name):
                    raise self.rejection(name, "needs {friction} above 0")

    @property
    def has_friction(self) -> bool:
        """Whether teeth have friction somewhere."""
        return bool(self.model.friction)

    @property
    def need_of_model_1(self) -> str:
        """Which of the settings, those of the model apart, needs model 1 to 3."""
        return ""

    def rejection(self, name: str, reason: str) -> InputError:
        """Why the value of a setting of the model is refused.

        Parameters
        ----------
        name : str
            Name of the setting.
        reason : str
            Reason, with names of other settings in braces.

        Returns
        -------
        InputError
            Error to raise.
        """
        model_member = next(
            member
            for member in exposed_fields(group_of(self))
            if member.name == "model"
        )
        return refusal(self.model, name, reason, model_member.group)
