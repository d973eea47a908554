"""Groups of settings of lumped models, their stiffness and their integration."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, get_args

from fegear.statics.mesh_table_files import TABLE_FILE
from fegear.statics.stiffness_source import StiffnessSource
from fegear.studies.settings import Setting, SettingsGroup, expose, group, setting
from fegear.train.model_settings import SPRING_MODELS, LumpedModel, Number
from lumped.steady.integration_settings import Settings

TABLES = (
    f"Mesh table {TABLE_FILE} to use instead of finite elements; give one for each "
    "mesh, in order. The coupled model needs the columns of tooth pairs, at two or "
    "more torques unless hardening is left out."
)


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


def parsed_number(text: str) -> Any:
    """The number or name of a lumped model; ValueError says what is allowed."""
    if text in get_args(Number):
        return text
    if text not in ("1", "2", "3"):
        raise ValueError("allowed auto, coupled, 1, 2 and 3")
    return int(text)


SPRINGS = expose(
    *("number", "damping_ratio", "translations", "stiffness"),
    number=Setting(
        option="--model", metavar="1|2|3", text=f"{SPRING_MODELS}.", parse=parsed_number
    ),
    damping_ratio=Setting(option="--damping"),
    translations=Setting(option="--translations"),
    stiffness=SOURCE,
)

ALL_MODELS = SPRINGS | expose(
    *("number", "without"),
    number=Setting(option="--model", metavar="auto|coupled|1|2|3", parse=parsed_number),
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
