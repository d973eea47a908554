"""Errors of state transitions of Hill's equation against its exact solution."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from lumped.common.progress import Progress
from validation.commands.reproduce.parts import Curve, Part, PartResult
from validation.commands.reproduce.scene import NoScene
from validation.oracles.hill import (
    exact_transition,
    exponentials,
    first_order_form,
    recursion,
)
from validation.study.data_files import Number, Positive

Count = Annotated[int, Field(strict=True, ge=1, le=10_000)]


@dataclass(frozen=True, kw_only=True)
class SawtoothPart(Part):
    """log10 of the relative error over terms of the recursion, or over divisions.

    by : eq. 4.55 or eq. 4.56 of x'' + (a t + b) x = 0
    counts : terms n, or divisions m; steps : lengths h, a curve for each
    """

    keys: ClassVar = (r"step\d+\.(first|last|least)", r"step\d+\.at\d+")
    of_equation: ClassVar = True
    no_command: ClassVar = "fegear bench stability times both, at one step"

    kind: Literal["sawtooth"] = "sawtooth"
    by: Literal["recursion", "exponentials"]
    a: Number
    b: Number
    steps: Annotated[tuple[Positive, ...], Field(min_length=1)]
    counts: Annotated[tuple[Count, ...], Field(min_length=1)]


def sawtooth(part: SawtoothPart, scene: NoScene, report: Progress) -> PartResult:
    """Values of stepN., steps counted from 1: errors at the first and last count, the
    least of all, and atCOUNT."""
    report("errors", 0, 1)
    curves, values = [], {}
    for number, step in enumerate(part.steps, start=1):
        errors = _errors(part, step)
        points = zip(part.counts, np.log10(errors).tolist(), strict=True)
        rows = tuple((float(count), error) for count, error in points)
        curves.append(Curve("line", rows, label=f"h = {step:g}"))
        start = f"step{number}."
        values[f"{start}first"] = (errors[0],)
        values[f"{start}last"] = (errors[-1],)
        values[f"{start}least"] = (min(errors),)
        values |= {
            f"{start}at{count}": (error,)
            for count, error in zip(part.counts, errors, strict=True)
        }
    return PartResult(tuple(curves), values)


def _errors(part: SawtoothPart, step: float) -> Sequence[float]:
    """Largest difference over the largest entry; no less than round-off of one."""
    exact = exact_transition(part.a, part.b, step)
    form = first_order_form(part.a, part.b)
    way = recursion if part.by == "recursion" else exponentials
    sizes = [np.abs(way(form, step, count) - exact).max() for count in part.counts]
    least = float(np.finfo(float).eps)
    return [max(float(size / np.abs(exact).max()), least) for size in sizes]
