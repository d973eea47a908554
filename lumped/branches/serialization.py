"""Branches as plain values that JSON holds to the bit, and back."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from lumped.branches.periodic import PeriodicBranch
from lumped.branches.points import BranchPoint


def branch_to_dict(branch: PeriodicBranch) -> dict[str, Any]:
    points = [vars(point) | _plain_arrays(point) for point in branch.points]
    return {**vars(branch), "points": points}


def _plain_arrays(point: BranchPoint) -> dict[str, Any]:
    multipliers = point.multipliers
    return {
        "x": point.x.tolist(),
        "multipliers": [multipliers.real.tolist(), multipliers.imag.tolist()],
        "figures": {name: values.tolist() for name, values in point.figures.items()},
    }


def branch_from_dict(values: Mapping[str, Any]) -> PeriodicBranch:
    """The branch of `branch_to_dict`."""
    points = tuple(_read_point(point) for point in values["points"])
    return PeriodicBranch(**{**values, "points": points})


def _read_point(values: Mapping[str, Any]) -> BranchPoint:
    real, imaginary = map(np.array, values["multipliers"])
    arrays = {
        "x": np.array(values["x"]),
        "multipliers": real + 1j * imaginary,
        "figures": {name: np.array(v) for name, v in values["figures"].items()},
    }
    return BranchPoint(**{**values, **arrays})
