"""What reliefs and leads make least, and the step that does so for a linear change.

Measures of the transmission error in a case, at a torque and a misalignment, are its
peak to peak, or the root of the sum of the squares of amplitudes of chosen harmonics of
the mesh frequency; those of pressures, loads, their distribution over the width and
root stresses are the largest values. All are convex, so that the best step of a linear
change is that of linear programs: one in epigraph form, and a few for harmonics, each
with cuts at the solution of the one before (Kelley 1960).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from fegear.commands.relief.quantities import SCALES, Quantity, SlopedValues
from lumped.common.array_types import Array

Objective = Literal[
    "largest",
    "mean",
    "harmonics",
    "pressure",
    "line_load",
    "distribution",
    "root_stress",
]
MAX_CUTS = 12  # linear programs of a step for harmonics
CUT_RTOL = 1e-3  # of the objective, by which the last one may be below it
OF_ERROR: tuple[Objective, ...] = "largest", "mean", "harmonics"
QUANTITY_OF: Mapping[str, Quantity] = {
    **dict.fromkeys(OF_ERROR, "ste"),
    "pressure": "pressure",
    "line_load": "line_load",
    "distribution": "distribution",
    "root_stress": "root_stress",
}


@dataclass(frozen=True)
class Term:
    """A measure, its largest or mean value of all cases.

    scale : over which it counts, in SI units
    harmonics : orders of the mesh frequency of harmonics
    """

    name: Objective = "largest"
    scale: float = 1.0
    harmonics: tuple[int, ...] = (1, 2, 3)

    @property
    def quantity(self) -> Quantity:
        return QUANTITY_OF[self.name]

    def measures(self, values: Array) -> Array:
        """Measure of values (c, q) in each case (c,)."""
        if self.name == "harmonics":
            parts = values @ harmonic_parts(values.shape[1], self.harmonics).T
            return np.asarray(np.linalg.norm(parts, axis=1))
        if self.quantity == "ste":
            return peak_to_peak(values)
        return np.asarray(values.max(axis=1))

    def value(self, measures: Array) -> float:
        return float(measures.mean() if self.name == "mean" else measures.max())


@dataclass(frozen=True)
class ReliefObjective:
    """A measure, or a sum of several over their scales.

    name, harmonics : of the measure
    factors : of the measure in the cases (c,), 1 where empty
    others : measures that are added; `scale` is that of the first
    """

    name: Objective = "largest"
    harmonics: tuple[int, ...] = (1, 2, 3)
    factors: tuple[float, ...] = ()
    others: tuple[Term, ...] = ()
    scale: float = 1.0

    @property
    def terms(self) -> tuple[Term, ...]:
        return Term(self.name, self.scale, self.harmonics), *self.others

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """What the terms are of, each once."""
        return tuple(dict.fromkeys(term.quantity for term in self.terms))

    @property
    def unit(self) -> float:
        """Size of values, in which a linear program is solved."""
        return 1.0 if self.others else SCALES[self.terms[0].quantity]

    def measures(self, values: Mapping[Quantity, Array]) -> Array:
        """The first measure in each case (c,)."""
        term = self.terms[0]
        return term.measures(values[term.quantity])

    def of(self, values: Mapping[Quantity, Array]) -> float:
        """Objective of values (c, q), of one measure in its SI unit."""
        factors, total = np.asarray(self.factors or 1.0), 0.0
        for term in self.terms:
            measures = factors * term.measures(values[term.quantity])
            total += term.value(measures) / term.scale
        return total

    def of_responses(self, responses: Mapping[Quantity, SlopedValues]) -> float:
        return self.of({name: one.values for name, one in responses.items()})

    def of_linear(
        self, responses: Mapping[Quantity, SlopedValues], change: Array
    ) -> float:
        """Objective of values that change with their slopes by a design (x,)."""
        return self.of(
            {name: one.values + one.slopes @ change for name, one in responses.items()}
        )


def peak_to_peak(ste: Array) -> Array:
    """Peak to peak of transmission errors (c, p), in each case."""
    return np.asarray(np.ptp(ste, axis=1))


def harmonic_parts(positions: int, orders: tuple[int, ...]) -> Array:
    """Matrix (2 k, p) from values at equal steps of a mesh cycle to its harmonics.

    Cosine and sine parts, zero to peak, whose squares add up to that of the amplitude.
    """
    angle = 2.0 * np.pi * np.outer(orders, np.arange(positions)) / positions
    return np.asarray(np.concatenate([np.cos(angle), np.sin(angle)]) * 2.0 / positions)


def linear_step(
    responses: Mapping[Quantity, SlopedValues],
    limits: tuple[Array, Array],
    objective: ReliefObjective,
) -> tuple[Array, float]:
    """Step (x,) within limits that makes the linearised objective least, and its value.

    responses : quantities with their slopes by the step
    """
    factors = np.asarray(objective.factors or 1.0)
    blocks = []
    for term in objective.terms:
        scale = np.asarray(factors / (term.scale * objective.unit))
        values, slopes = responses[term.quantity]
        scaled = SlopedValues(
            values * scale[..., None], slopes * scale[..., None, None]
        )
        blocks.append(_block(term, scaled, limits))
    step, value = _least(blocks, limits)
    if step is None:
        return np.zeros(limits[0].size), objective.of_responses(responses)
    return step, objective.unit * value


class _Block(NamedTuple):
    """The part of a linear program that is one term.

    Its unknowns are the step (x,) and others (o,), whose weighted sum is the term.

    rows : (r, x + o); upper_bounds : (r,); weights : (o,)
    parts, rates : (c, h), (c, h, x) of harmonics, whose largest norm is the term
    """

    rows: Array
    upper_bounds: Array
    weights: Array
    parts: Array
    rates: Array


def _block(term: Term, response: SlopedValues, limits: tuple[Array, Array]) -> _Block:
    if term.name == "harmonics":
        return _harmonics(response, term.harmonics)
    if term.quantity == "ste":
        return _peaks(response, term.name)
    return _largest(response, limits)


def _peaks(response: SlopedValues, name: Objective) -> _Block:
    """Others are the largest and the smallest transmission error in each case, and the
    largest of their differences.
    """
    ste, slopes = response
    cases, positions, size = slopes.shape
    rows = np.zeros((2, cases, positions, size + 2 * cases + 1))
    rows[0, ..., :size], rows[1, ..., :size] = slopes, -slopes
    differences = np.zeros((cases, size + 2 * cases + 1))
    differences[:, -1] = -1.0
    for c in range(cases):
        rows[0, c, :, size + c] = -1.0
        rows[1, c, :, size + cases + c] = 1.0
        differences[c, size + c], differences[c, size + cases + c] = 1.0, -1.0
    weights = differences.mean(axis=0)[size:]
    if name == "largest":
        weights = np.zeros_like(weights)
    weights[-1] = 1.0 if name == "largest" else 0.0
    return _Block(
        np.concatenate([rows.reshape(-1, rows.shape[-1]), differences]),
        np.concatenate([-ste.ravel(), ste.ravel(), np.zeros(cases)]),
        weights,
        *_no_harmonics(size),
    )


def _largest(response: SlopedValues, limits: tuple[Array, Array]) -> _Block:
    """The other is the largest value; those that cannot become so are left out."""
    size = response.slopes.shape[2]
    values, slopes = response.values.ravel(), response.slopes.reshape(-1, size)
    ends = np.sort(np.stack([slopes * limit for limit in limits]), axis=0)
    low, high = values + ends.sum(axis=2)
    counts = high >= low.max()
    rows = np.column_stack([slopes[counts], -np.ones(counts.sum())])
    return _Block(rows, -values[counts], np.ones(1), *_no_harmonics(size))


def _no_harmonics(size: int) -> tuple[Array, Array]:
    return np.empty((0, 0)), np.empty((0, 0, size))


def _harmonics(response: SlopedValues, orders: tuple[int, ...]) -> _Block:
    """The other is the largest measure, which lies above all cuts."""
    matrix = harmonic_parts(response.values.shape[1], orders)
    parts = response.values @ matrix.T
    rates = np.einsum("kp,cpn->ckn", matrix, response.slopes)
    rows = np.append(np.zeros(rates.shape[2]), -1.0)[None]
    return _Block(rows, np.zeros(1), np.ones(1), parts, rates)


def _least(
    blocks: list[_Block], limits: tuple[Array, Array]
) -> tuple[Array | None, float]:
    """Step of the least sum of terms, and that sum; None where there is none."""
    size = limits[0].size
    best: Array | None = None
    best_value, step = np.inf, np.zeros(size)
    for _ in range(MAX_CUTS):
        blocks = [_with_cuts(block, step) for block in blocks]
        solution = _solve_linear_program(blocks, limits)
        if solution is None:
            break
        step = solution[:size]
        terms = list(_terms(blocks, solution))
        value = sum(exact for exact, _ in terms)
        if value < best_value:
            best, best_value = step, value
        if best_value - sum(by_cuts for _, by_cuts in terms) <= CUT_RTOL * best_value:
            break
    return best, best_value


def _with_cuts(block: _Block, step: Array) -> _Block:
    """A block of harmonics with what their norms are at least, as seen from a step."""
    values = block.parts + block.rates @ step
    lengths = np.linalg.norm(values, axis=1)
    rows, bounds = [block.rows], [block.upper_bounds]
    for c in np.flatnonzero(lengths):
        direction = values[c] / lengths[c]
        rows.append(np.append(direction @ block.rates[c], -1.0)[None])
        bounds.append(np.array([-float(direction @ block.parts[c])]))
    return block._replace(
        rows=np.concatenate(rows), upper_bounds=np.concatenate(bounds)
    )


def _terms(blocks: list[_Block], solution: Array) -> Iterator[tuple[float, float]]:
    """Each term at a solution, and what cuts make of it; the same without harmonics."""
    size = blocks[0].rates.shape[2]
    step, first = solution[:size], size
    for block in blocks:
        others = solution[first : first + block.weights.size]
        first += block.weights.size
        exact = by_cuts = float(block.weights @ others)
        if block.parts.size:
            exact = float(
                np.linalg.norm(block.parts + block.rates @ step, axis=1).max()
            )
        yield exact, by_cuts


def _solve_linear_program(
    blocks: list[_Block], limits: tuple[Array, Array]
) -> Array | None:
    """The step, within limits, and the other unknowns of all blocks, which are free.

    `milp` calls the same solver as `linprog` in two thirds of its time.
    """
    from scipy.linalg import block_diag
    from scipy.optimize import Bounds, LinearConstraint, milp

    size = limits[0].size
    others = block_diag(*(block.rows[:, size:] for block in blocks))
    rows = np.column_stack([np.concatenate([b.rows[:, :size] for b in blocks]), others])
    weights = np.concatenate([np.zeros(size), *(block.weights for block in blocks)])
    upper_bounds = np.concatenate([block.upper_bounds for block in blocks])
    free = np.full(weights.size - size, np.inf)
    bounds = Bounds(np.append(limits[0], -free), np.append(limits[1], free))
    constraint = LinearConstraint(rows, -np.inf, upper_bounds)
    solution = milp(
        weights, constraints=constraint, bounds=bounds, options={"presolve": False}
    )
    if solution.x is None or solution.fun is None:
        return None
    return np.asarray(solution.x)
