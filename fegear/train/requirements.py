"""What a lumped model needs of a gear set, refused before anything is computed."""

from __future__ import annotations

from dataclasses import replace

from fegear.files.errors import InputError
from fegear.gearset.inertia import (
    require_inertia_beyond_springs,
    require_inertia_of_bodies,
)
from fegear.gearset.leads import require_spur
from fegear.gearset.model import GearSet
from fegear.statics.excitation import Excitations, ExcitationSource
from fegear.train.model_settings import (
    LINEAR_ONLY,
    LumpedModel,
    contact_source_of,
    has_rolling_bearings,
)
from fegear.train.rotors import rotor_system
from lumped.steady import steppers
from lumped.steady.integration_settings import Method

BENDING_NEEDED = (
    "bending is missing; the friction-bending ratio comes from mesh tables "
    "by finite elements, of other excitations it must be given"
)


def require_model(
    gear_set: GearSet, model: LumpedModel, source: ExcitationSource
) -> None:
    """Raise InputError for what settings and gear set alone decide.

    model : with a number that is not auto
    """
    if model.friction:
        require_spur(gear_set, f"friction = {model.friction:g}")
    if model.number == "coupled":
        _require_coupled(gear_set, model, source)
    if model.motion == "space":
        _require_space(gear_set, source)
    if isinstance(source, Excitations):
        for mesh in range(len(gear_set.meshes)):
            source.require_mesh(gear_set, mesh)
        needs_tables = model.friction and not isinstance(model.bending, float | int)
        if needs_tables and source.settings.kind != "fe":
            raise InputError(BENDING_NEEDED)


def require_method(
    method: Method, model: LumpedModel, gear_set: GearSet, ramp: bool = False
) -> None:
    """Raise InputError where a method does not integrate the motion of a model.

    model : with a number that is not auto; ramp : whether the speed changes
    """
    needed = {
        steppers.CONTACTS: model.number == "coupled",
        steppers.FRICTION: model.friction > 0.0,
        steppers.ROLLING: has_rolling_bearings(model, gear_set),
        steppers.SPACE: model.motion == "space",
        steppers.RAMP: ramp,
    }
    try:
        steppers.require_method(method, [kind for kind in needed if needed[kind]])
    except ValueError as error:
        raise InputError(str(error)) from None


def _require_coupled(
    gear_set: GearSet, model: LumpedModel, source: ExcitationSource
) -> None:
    if has_rolling_bearings(model, gear_set):
        raise InputError(f"{gear_set.name}: {LINEAR_ONLY}, use bearings = linear")
    contact_source_of(gear_set, model, source)
    if "body" not in model.without:
        alternative = "the coupled model without body counts none of it"
        require_inertia_of_bodies(gear_set, alternative)
        require_inertia_beyond_springs(gear_set, alternative)


def _require_space(gear_set: GearSet, source: ExcitationSource) -> None:
    """Raise InputError where gears cannot move in space."""
    if gear_set.carrier is not None:
        raise InputError(
            f"{gear_set.name}: motion = space; of gears on fixed axes, not of "
            "planetary sets"
        )
    if not isinstance(source, Excitations) or source.settings.kind != "fe":
        raise InputError(
            "motion = space; loads over the face width come from finite elements, "
            "other excitations know nothing of them"
        )
    plane = source.settings.statics.plane_of(gear_set)
    if plane != "width":
        raise InputError(
            f"motion = space; needs loads that vary over the face width, plane = width,"
            f" not {plane}"
        )
    # bearings that roll are linearised, and a housing is joined, where loads are known
    bare = replace(gear_set, housing=None)
    rotor_system(bare, [1.0] * len(gear_set.meshes), 1, "space")
