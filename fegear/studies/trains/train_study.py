"""Base of studies of a lumped train."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from typing import Any, ClassVar

from fegear.files.errors import InputError
from fegear.studies.settings import exposed_fields, group_of, refusal
from fegear.studies.trains.gear_sets import GearSetRef
from fegear.studies.trains.models import TABLES
from fegear.train.model_settings import LumpedModel


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
        self._take_own_number()
        if not self.has_friction:
            for name in ("bending", "sliding", "torque_of"):
                if getattr(self.model, name) != getattr(LumpedModel(), name):
                    raise self.rejection(name, "needs {friction} above 0")

    def _take_own_number(self) -> None:
        """A model that is auto has the number of the study where that has only some."""
        default = next(f.default for f in fields(self) if f.name == "model")
        number: Any = getattr(default, "number", "auto")
        if self.model.number == "auto" and number != "auto":
            model = replace(self.model, number=number)
            object.__setattr__(self, "model", model)

    @property
    def has_friction(self) -> bool:
        """Whether teeth have friction somewhere."""
        return bool(self.model.friction)

    @property
    def joins_housing(self) -> bool:
        """Whether shafts are in the housing of the gear set."""
        return self.model.motion == "space"

    @property
    def reason_for_model_1(self) -> str:
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
