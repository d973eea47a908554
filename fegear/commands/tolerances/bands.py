"""Bands of mesh stiffness and transmission error, by samples and to first order."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fegear.commands.tolerances.deviations import (
    CENTER,
    PEAK_TO_PEAK,
    LinearContact,
    ToleranceProblem,
    linear_contact,
)
from fegear.commands.tolerances.variants import line_of_action
from lumped.common.array_types import Array
from meshes import GearPair
from meshes.pairing import undercut_end

LINEAR_SAMPLES = 10_000  # of the first order
SENSITIVITY_SAMPLES = 4000  # of the parts of the variance
PERCENTILES = 5, 50, 95
QUANTILE_STDERR = 0.64  # of a limit over the band, times the root of the sample size


@dataclass(frozen=True)
class SolvedSamples:
    """Contact of s pairs of gears.

    deviations : (s, v) [m]; values : quantities (s,)
    ste : transmission error (s, n) [m]
    lost_contact : (s,) whether a tooth pair on the path of contact carries no load
    """

    deviations: Array
    values: Mapping[str, Array]
    ste: Array
    lost_contact: NDArray[np.bool_]


@dataclass(frozen=True)
class ToleranceBands:
    """Distribution of pairs of gears within their tolerances.

    limits : tolerances [m] by source; variables : the source of each deviation (v,)
    position : (n,) of the mesh cycle [base pitches]
    solved : samples; linear : derivatives
    nominal : quantities without deviations
    linear_values : quantities of samples to first order
    linear_ste_std : standard deviation of the transmission error less its mean to first
        order (n,) [m]
    effects : part of each quantity's variance that each source has
    peak_to_peak_without : what 95 % stay below if a source has no tolerance, to first
        order [m]
    contact_ratios : at the largest, the nominal and the smallest centre distance
    backlash : of the nominal pair [m]; backlash_slope : by the centre distance
    """

    limits: Mapping[str, float]
    variables: tuple[str, ...]
    position: Array
    solved: SolvedSamples
    linear: LinearContact
    nominal: Mapping[str, float]
    linear_values: Mapping[str, Array]
    linear_ste_std: Array
    effects: Mapping[str, Mapping[str, float]]
    peak_to_peak_without: Mapping[str, float]
    contact_ratios: tuple[float, float, float]
    backlash: float
    backlash_slope: float

    @cached_property
    def rows(self) -> list[dict[str, Any]]:
        """Percentiles of each quantity, by samples and to first order."""
        return [
            {
                "quantity": name,
                "nominal": self.nominal[name],
                **_percentiles("p", self.solved.values[name]),
                **_percentiles("first_order_p", self.linear_values[name]),
                "band_error": band_error(
                    self.solved.values[name], self.linear_values[name]
                ),
            }
            for name in self.nominal
        ]

    @property
    def sample_columns(self) -> dict[str, ArrayLike]:
        """Deviations [m] and quantities of every pair of gears (s,)."""
        solved, names = self.solved, _names_with_numbers(self.variables)
        columns: dict[str, ArrayLike] = {
            f"{name}_deviation_m": column
            for name, column in zip(names, solved.deviations.T, strict=True)
        }
        columns |= solved.values
        return columns | {"lost_contact": solved.lost_contact.astype(int)}

    @property
    def cycle_columns(self) -> dict[str, ArrayLike]:
        """Band of the transmission error less its mean at every position (n,) [m]."""
        ste = without_mean(self.solved.ste)
        percentiles = np.percentile(ste, PERCENTILES, axis=0)
        return {
            "position": self.position,
            "ste_nominal_m": without_mean(self.linear.ste),
            **{
                f"ste_p{percent:02d}_m": values
                for percent, values in zip(PERCENTILES, percentiles, strict=True)
            },
            "ste_std_m": ste.std(axis=0),
            "ste_first_order_std_m": self.linear_ste_std,
        }

    @property
    def moved_extremes(self) -> float:
        """Part of the pairs of gears with extremes at other positions."""
        ste, count = self.solved.ste, self.position.size
        moved = np.zeros(len(ste), bool)
        for extreme in (np.argmax, np.argmin):
            shift = np.abs(extreme(ste, axis=1) - extreme(self.linear.ste))
            moved |= np.minimum(shift, count - shift) > 1
        return float(moved.mean())

    @property
    def jammed(self) -> float:
        """Part of the pairs of gears without backlash at their centre distance."""
        increase = self.solved.deviations[:, self.variables.index(CENTER)]
        return float((self.backlash + self.backlash_slope * increase < 0.0).mean())


def _percentiles(prefix: str, values: Array) -> dict[str, float]:
    percentiles = np.percentile(values, PERCENTILES).tolist()
    return {
        f"{prefix}{percent:02d}": value
        for percent, value in zip(PERCENTILES, percentiles, strict=True)
    }


def _names_with_numbers(names: Sequence[str]) -> list[str]:
    """Names with a number where several are equal."""
    return [
        f"{name}_{1 + names[:i].count(name)}" if names.count(name) > 1 else name
        for i, name in enumerate(names)
    ]


def without_mean(ste: Array) -> Array:
    """Transmission errors (..., n) less their means over the mesh cycle."""
    return ste - ste.mean(axis=-1, keepdims=True)


def band_error(values: Array, linear: Array) -> float:
    """Largest difference of the limits of both bands over the band of the values."""
    ends = PERCENTILES[0], PERCENTILES[-1]
    one, other = np.percentile(values, ends), np.percentile(linear, ends)
    return float(np.abs(one - other).max() / (np.ptp(one) or 1.0))


def tolerance_bands(
    problem: ToleranceProblem, solved: SolvedSamples, seed: int
) -> ToleranceBands:
    """Bands of samples that were solved, and those to first order."""
    linear = linear_contact(problem)
    linear_values = linear.solve(problem.sample(LINEAR_SAMPLES, seed))
    none = np.zeros((1, len(problem.variables)))
    nominal = problem.quantities(*linear.solve(none))
    pair, largest = problem.contact.pair, problem.limits[CENTER]
    return ToleranceBands(
        limits=dict(problem.limits),
        variables=problem.variables,
        position=problem.position,
        solved=solved,
        linear=linear,
        nominal={name: float(value[0]) for name, value in nominal.items()},
        linear_values=problem.quantities(*linear_values),
        linear_ste_std=np.asarray(without_mean(linear_values[0]).std(axis=0)),
        effects=total_effects(problem, linear, SENSITIVITY_SAMPLES, seed),
        peak_to_peak_without=peak_to_peak_without(
            problem, linear, LINEAR_SAMPLES, seed
        ),
        contact_ratios=(
            contact_ratio(pair, largest),
            contact_ratio(pair, 0.0),
            contact_ratio(pair, -largest),
        ),
        backlash=pair.backlash,
        backlash_slope=2.0 * pair.sign * float(np.sin(pair.operating_pressure_angle)),
    )


def total_effects(
    problem: ToleranceProblem, linear: LinearContact, count: int, seed: int
) -> dict[str, dict[str, float]]:
    """Part of the variance of each quantity that each source has.

    Total effects of Sobol over their sum, of the linear contact, by the estimator of
    Jansen (1999): a variance that several sources have together counts for each.
    """
    one, other = problem.sample(count, seed), problem.sample(count, seed + 1)
    values = problem.quantities(*linear.solve(one))
    effects: dict[str, dict[str, float]] = {name: {} for name in values}
    for source in problem.sources:
        changes = np.array([name == source for name in problem.variables])
        mixed = problem.quantities(*linear.solve(np.where(changes, other, one)))
        for name, value in values.items():
            effects[name][source] = float(np.mean((value - mixed[name]) ** 2))
    totals = {name: sum(parts.values()) or 1.0 for name, parts in effects.items()}
    return {
        name: {source: part / totals[name] for source, part in parts.items()}
        for name, parts in effects.items()
    }


def peak_to_peak_without(
    problem: ToleranceProblem, linear: LinearContact, count: int, seed: int
) -> dict[str, float]:
    """What 95 % of the peak to peak stay below if a source has no tolerance [m]."""
    deviations = problem.sample(count, seed)
    largest = dict[str, float]()
    for source in problem.sources:
        stays = np.array([name != source for name in problem.variables])
        solved = linear.solve(deviations * stays)
        values = problem.quantities(*solved)[PEAK_TO_PEAK]
        largest[source] = float(np.percentile(values, PERCENTILES[-1]))
    return largest


def contact_ratio(pair: GearPair, increase: float) -> float:
    """Contact ratio at a centre distance that is larger by an amount [m]."""
    line, _ = line_of_action(pair, increase)
    start = max(line - pair.driven.tip_roll_length, undercut_end(pair.driver))
    end = min(pair.driver.tip_roll_length, line - undercut_end(pair.driven))
    return (end - start) / pair.base_pitch
