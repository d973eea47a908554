"""Groups of settings of lumped models, their stiffness and their integration."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, get_args

from fegear.statics.excitation_settings import ExcitationSettings
from fegear.statics.mesh_table_files import TABLE_FILE
from fegear.studies.settings import Setting, SettingsGroup, expose, group, setting
from fegear.train.model_settings import SPRING_MODELS, LumpedModel, Number
from lumped.steady.integration_settings import Settings

TABLES = (
    f"Mesh table {TABLE_FILE} to use instead of finite elements; give one for each "
    "mesh, in order. The coupled model needs the columns of tooth pairs, at two or "
    "more torques unless hardening is left out."
)


def _unused_excitation_settings(
    excitation: ExcitationSettings,
) -> Iterator[tuple[str, str]]:
    if excitation.kind != "trapezoid":
        yield "ramp", "needs {kind} trapezoid"
    if excitation.kind != "fourier":
        yield "harmonics", "needs {kind} fourier"
    if excitation.kind != "fe":
        yield "relief_stiffness", "needs {kind} fe"


EXCITATION = SettingsGroup(
    kind=ExcitationSettings,
    unused_options=_unused_excitation_settings,
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
        raise ValueError("must be auto, coupled, 1, 2 or 3")
    return int(text)


def _parsed_bending(text: str) -> float | str:
    """The friction-bending ratio, or `cycle`; ValueError says what is allowed."""
    if text == "cycle":
        return text
    try:
        return float(text)
    except ValueError:
        raise ValueError("must be cycle or a number") from None


SPRINGS = expose(
    *("number", "damping_ratio", "translations", "excitation"),
    number=Setting(
        option="--model", metavar="1|2|3", text=f"{SPRING_MODELS}.", parse=parsed_number
    ),
    translations=Setting(option="--translations"),
    excitation=EXCITATION,
)

ALL_MODELS = SPRINGS | expose(
    *("number", "without"),
    number=Setting(option="--model", metavar="auto|coupled|1|2|3", parse=parsed_number),
)

SLIDING = expose(
    *("friction", "bending"),
    bending=Setting(metavar="RATIO|cycle", parse=_parsed_bending),
)

MOVING = SLIDING | expose(
    *("sliding", "transition", "torque_of"),
    transition=Setting(option="--transition-speed"),
)

SPACE = expose("motion", motion=Setting(option="--motion"))
BEARINGS = expose("bearings", bearings=Setting(option="--bearings"))


def _unused_model_settings(model: LumpedModel) -> Iterator[tuple[str, str]]:
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
            unused_options=_unused_model_settings,
            default=default,
        )
    )


def _unused_integration_settings(settings: Settings) -> Iterator[tuple[str, str]]:
    if settings.method != "rk4":
        yield "steps", f"{settings.method} chooses its own steps"


SETTLING = "tolerance", "max_periods"


def lumped_integration() -> Any:
    """A field for the time integration of lumped models."""
    exposed_settings = expose(*SETTLING, "steps", "method")
    return group(
        SettingsGroup(
            kind=Settings,
            exposed=exposed_settings,
            unused_options=_unused_integration_settings,
        )
    )


def tables_setting() -> Any:
    return setting(
        (),
        TABLES,
        metavar="FILE",
        reads=True,
    )
