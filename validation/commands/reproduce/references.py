"""References of computed values, and their origin."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import Field

from validation.study.data_files import STRICT, Number, Positive, Text

Origin = Literal["printed", "text", "checked", "fitted", "method"]
ORIGINS: dict[Origin, tuple[str, str]] = {  # word of a line, and of a table
    "printed": ("printed", "printed as a number"),
    "text": ("by the text", "read off words or a picture, no number is printed"),
    "checked": ("recomputed independently", "not printed, recomputed independently"),
    "fitted": ("fitted to", "printed, and the train was chosen to meet it"),
    "method": ("beside", "another method of the same figure"),
}
UnitOfTrains = Literal["1", "Hz", "omega_1", "N", "um", "rad", "deg", "pitches"]
UnitOfMachines = Literal["pitch radii", "rad/turn", "rad2/turn3", "of 25", "s", "%"]
Unit = Literal[UnitOfTrains, UnitOfMachines]


@dataclass(frozen=True, kw_only=True)
class OtherPart:
    """What another part of the figure finds."""

    __pydantic_config__ = STRICT

    part: Text
    value_name: Text


@dataclass(frozen=True, kw_only=True)
class Reference:
    """A value with which a computed one is compared.

    value, point, other_part : one of them; a point has two coordinates
    origin : where it comes from, `method` if it is another part's value
    where : it was read, or what the source says of it
    bound : it is the largest or the least value that agrees, equal ones not
    scale : to which differences are relative if its own size means nothing: of angles,
        places on an axis, and 0
    part, value_name : name of a part and of its value; of several values the nearest
    reason : why it does not agree, where it does not
    """

    __pydantic_config__ = STRICT

    quantity: Text
    value: Number | None = None
    point: tuple[Number, Number] | None = None
    other_part: OtherPart | None = None
    unit: Unit
    origin: Origin = "printed"
    where: Text
    bound: Literal["", "below", "above"] = ""
    scale: Positive | None = None
    part: Text
    value_name: Annotated[str, Field(min_length=1)]
    reason: str = ""

    def __post_init__(self) -> None:
        targets = [
            target
            for target in (self.value, self.point, self.other_part)
            if target is not None
        ]
        if len(targets) != 1:
            raise ValueError("one of value, point and other_part is needed")
        if (self.other_part is not None) != (self.origin == "method"):
            raise ValueError("origin method and other_part belong together")
        size = self.value if self.other_part is None and self.point is None else 1.0
        if not (size or self.scale or self.bound):
            raise ValueError("scale is missing, for the value is 0")
        if self.bound and self.point is not None:
            raise ValueError("bound needs a value, no point")
