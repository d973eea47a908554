"""Every kind of computation: the class of its part, and the function that makes it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import get_args, get_type_hints

from validation.reproduce.computations.frequency_response import (
    BranchesPart,
    SweepPart,
    TheoryPart,
    branches,
    sweep,
    theory,
)
from validation.reproduce.computations.natural_frequencies import ModesPart, modes
from validation.reproduce.parts import Compute, Part

AnyPart = BranchesPart | SweepPart | TheoryPart | ModesPart
COMPUTE: Mapping[type[Part], Compute] = {
    BranchesPart: branches,
    SweepPart: sweep,
    TheoryPart: theory,
    ModesPart: modes,
}
KINDS: Mapping[str, type[Part]] = {
    str(get_args(get_type_hints(part)["kind"])[0]): part for part in COMPUTE
}
