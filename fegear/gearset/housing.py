"""The housing of a gear set, which holds bearings of its shafts."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from fegear.files.codes import with_code
from lumped.common.checks import require_fields
from lumped.rotors.housing import Housing


@dataclass(frozen=True, kw_only=True)
class HousingFile:
    """Housing and the file that it comes from, as the gear set names it."""

    file: str
    housing: Housing

    def __post_init__(self) -> None:
        require_fields(self)

    @property
    def stated(self) -> str:
        """The file and what it holds, in words."""
        nodes = self.housing.nodes
        bearings = sum(node is not None for node in nodes)
        return (
            f"{self.file}, {self.housing.size} coordinates, {len(nodes)} nodes, "
            f"{bearings} of bearings"
        )


def housing_warnings(housing: HousingFile | None) -> Iterator[str]:
    """A line for a housing that is left out."""
    if housing is not None:
        yield with_code(
            "W70",
            f"the housing {housing.file} is left out, bearings are on ground; "
            "campbell and motion in space have it",
        )
