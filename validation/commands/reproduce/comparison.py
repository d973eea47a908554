"""Computed values compared with references: how far apart, and how many agree."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from validation.commands.reproduce.parts import Value
from validation.commands.reproduce.readings import Results, read_values
from validation.commands.reproduce.references import ORIGINS, Reference
from validation.study.printed import nearest

LIMITS = (0.01, 0.05, 0.1)  # of the scale: how close values are counted
EQUAL_RTOL = 1e-6  # of the scale
NONE = math.nan
QUICK = "quick, not compared"


@dataclass(frozen=True)
class ReferenceCheck:
    """A reference and the computed value, NaN where there is none.

    value : of the reference; choices : computed values of which this is the nearest
    judged : whether both are compared, which those of quick figures are not
    """

    reference: Reference
    value: Value
    computed: Value
    choices: int = 1
    judged: bool = True

    @property
    def difference(self) -> float:
        """In the unit; of points that of the coordinates that differ most."""
        pairs = zip(_as_point(self.computed), _as_point(self.value), strict=True)
        return max((a - b for a, b in pairs), key=abs)

    @property
    def scale(self) -> float:
        """Scale of which the difference is a fraction."""
        size = max(abs(value) for value in _as_point(self.value))
        return self.reference.scale or size or NONE

    @property
    def is_met(self) -> bool:
        """Whether it keeps a bound."""
        bound = self.reference.bound
        gap = -self.difference if bound == "below" else self.difference
        return bool(bound) and gap > 0.0

    @property
    def relative_error(self) -> float:
        """Difference over the scale, 0 of a bound that is kept, NaN if it is not.

        NaN where it is not judged.
        """
        if not self.judged:
            return NONE
        if self.reference.bound:
            return 0.0 if self.is_met else NONE
        return abs(self.difference) / self.scale

    @property
    def verdict(self) -> str:
        """`1.2 % apart`, `0.16 rad apart, 5.1 % of 3.142 rad`, `not met`."""
        reference = self.reference
        if not self.judged:
            return QUICK
        if math.isnan(_as_point(self.computed)[0]):
            return "none found"
        if reference.bound:
            return "met" if self.is_met else "not met"
        if self.relative_error < EQUAL_RTOL:
            return "equal"
        percent = f"{100.0 * self.relative_error:.2g} %"
        if reference.scale is None:
            return f"{percent} apart"
        gap = _value_text(abs(self.difference), reference.unit, 2)
        return f"{gap} apart, {percent} of {_value_text(self.scale, reference.unit)}"

    @property
    def line(self) -> str:
        """`jump down: computed 0.81, printed 0.8, 1.2 % apart: why`."""
        reference = self.reference
        terms = [
            ORIGINS[reference.origin][0],
            reference.bound,
            _value_text(self.value, reference.unit),
        ]
        if reference.other_part is not None:
            terms = [
                *terms[1 if reference.bound else 0 :],
                f"of {reference.other_part.part}",
            ]
        reference_text = " ".join(filter(None, terms))
        reason = f": {reference.reason}" if reference.reason and self.judged else ""
        if math.isnan(_as_point(self.computed)[0]):
            return f"{reference.quantity}: {reference_text}, none found{reason}"
        among = f" (nearest of {self.choices})" if self.choices > 1 else ""
        computed = _value_text(self.computed, reference.unit)
        return (
            f"{reference.quantity}: computed {computed}{among}, {reference_text}, "
            f"{self.verdict}{reason}"
        )


def compare(
    reference: Reference, results: Results, judged: bool = True
) -> ReferenceCheck:
    """A reference and what its part found; judged : see `ReferenceCheck`."""
    values = read_values(results, reference.part, reference.value_name)
    value: Value = NONE
    if reference.other_part is not None:
        other = read_values(
            results, reference.other_part.part, reference.other_part.value_name
        )
        value = _nearest_value(other, values[0]) if values and other else NONE
    elif reference.point is not None:
        value = reference.point
    elif reference.value is not None:
        value = reference.value
    computed = _nearest_value(values, value, far=reference.scale is not None)
    return ReferenceCheck(reference, value, computed, max(1, len(values)), judged)


def _nearest_value(values: Sequence[Value], value: Value, far: bool = True) -> Value:
    """A single value as it is; of several the nearest, points as a whole.

    far : whether one that is far off counts, else it is not the same thing
    """
    if not values:
        return tuple(NONE for _ in value) if isinstance(value, tuple) else NONE
    if len(values) == 1:
        return values[0]
    if far or isinstance(value, tuple):
        return min(
            values,
            key=lambda candidate: math.dist(_as_point(candidate), _as_point(value)),
        )
    return nearest(
        [float(candidate) for candidate in values if not isinstance(candidate, tuple)],
        value,
    )


def _as_point(value: Value) -> tuple[float, ...]:
    return value if isinstance(value, tuple) else (value,)


def _value_text(value: Value, unit: str, digits: int = 4) -> str:
    numbers = ", ".join(f"{coordinate:.{digits}g}" for coordinate in _as_point(value))
    text = f"({numbers})" if isinstance(value, tuple) else numbers
    return text if unit == "1" else f"{text} {unit}"


def count_lines(compared: Iterable[ReferenceCheck]) -> list[dict[str, Any]]:
    """Count of lines by their origin: how many, how close, and how many with a reason.

    Lines that are neither within the last of LIMITS nor keep their bound are `beyond`.
    """
    lines = [check for check in compared if check.judged]
    rows = []
    for origin, (_, meaning) in ORIGINS.items():
        checks = [check for check in lines if check.reference.origin == origin]
        if not checks:
            continue
        within = {
            f"within_{100.0 * limit:g}_percent": sum(
                e.relative_error <= limit for e in checks
            )
            for limit in LIMITS
        }
        beyond = [check for check in checks if not check.relative_error <= LIMITS[-1]]
        rows.append(
            {"origin": origin, "meaning": meaning, "lines": len(checks)}
            | within
            | {
                "beyond": len(beyond),
                "explained": sum(bool(check.reference.reason) for check in checks),
            }
        )
    return rows


def overview(compared: Sequence[ReferenceCheck]) -> Mapping[str, Any]:
    """The largest difference over its scale, and how many are not met or not found."""
    errors = [check.relative_error for check in compared if check.judged]
    finite_errors = [value for value in errors if not math.isnan(value)]
    return {
        "max_error_percent": 100.0 * max(finite_errors, default=NONE),
        "not_met": len(errors) - len(finite_errors),
    }
