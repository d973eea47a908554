"""Pairs of gears within their tolerances: deviations, contact, first order.

Deviations are random and independent:

- profile slope and profile form of either gear, for all teeth of the gear alike. The
  form deviation is a parabola over the active profile, barrel-shaped or hollow;
- single pitch of either gear, of each step from tooth to tooth. The errors of the
  teeth add up from the tooth of the reference pair on;
- centre distance;
- where loads vary over the face width, helix slope and helix form of either gear, as
  slope and crowning of its lead, and axes that are not parallel: in their plane and out
  of it, as the deviation over the common width, which opens a gap along the line of
  action by sine and cosine of the operating pressure angle (ISO/TR 10064-3).

To first order, the transmission error at every position, and the gap of every tooth
pair, is linear in the deviations. Peak to peak and stiffness follow from these lines:
they have kinks where two positions, or two gaps, are equal, so that their own
derivatives would say little. The slopes are differences over a standard deviation to
both sides, which average the kinks where tooth pairs come into contact. With small
deviations they become the derivatives that one contact solution gives (see
`fegear.commands.relief.best_relief`), which are compared with them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from fegear.commands.tolerances.variants import (
    VariantContact,
    Variants,
    WidthDeviations,
    solve_variants,
    with_profiles,
)
from fegear.commands.tolerances.width_variants import solve_width_variants
from fegear.contact.pairs import candidate_pairs
from fegear.contact.path import on_path
from fegear.contact.plane.contact import PlaneContact
from fegear.contact.problem import ContactProblem
from fegear.contact.solve import solve_cycle
from fegear.contact.width.contact import WidthContact
from fegear.contact.width.lines import pairs_over_width
from lumped.common.array_types import Array

Distribution = Literal["normal", "uniform"]
LIMIT_OVER_STD = 3.0  # of a normal distribution, which is cut off at its limits
PROFILE = (
    *("driver_profile_slope", "driven_profile_slope"),
    *("driver_profile_form", "driven_profile_form"),
)
PITCH = "driver_single_pitch", "driven_single_pitch"
CENTER = "center_distance"
HELIX = (
    *("driver_helix_slope", "driven_helix_slope"),
    *("driver_helix_form", "driven_helix_form"),
)
AXES = "axes_in_plane", "axes_out_of_plane"
MEAN_STIFFNESS, PEAK_TO_PEAK = "mean_stiffness_N_per_m", "ste_peak_to_peak_m"
DISTRIBUTION = "load_distribution_factor"
NO_FLANK_GAP = 1.0  # [m], of a tooth pair whose flanks do not face each other
MIN_STEP = 1e-9  # of differences, where a deviation is 0 [m]


def std_over_limit(distribution: Distribution) -> float:
    """Standard deviation of a deviation over its limit."""
    if distribution == "uniform":
        return float(1.0 / np.sqrt(3.0))
    from scipy.stats import norm

    cut = LIMIT_OVER_STD
    variance = 1.0 - 2.0 * cut * norm.pdf(cut) / (1.0 - 2.0 * norm.sf(cut))
    return float(np.sqrt(variance) / cut)


def unit_deviates(
    distribution: Distribution, shape: tuple[int, int], seed: int
) -> Array:
    """Random deviations over their limits, from -1 to 1."""
    uniform = np.random.default_rng(seed).random(shape)
    if distribution == "uniform":
        return 2.0 * uniform - 1.0
    from scipy.special import ndtr, ndtri

    low, high = ndtr(-LIMIT_OVER_STD), ndtr(LIMIT_OVER_STD)
    return np.asarray(ndtri(low + (high - low) * uniform) / LIMIT_OVER_STD)


@dataclass(frozen=True)
class ToleranceProblem:
    """Pairs of gears that deviate from a contact problem by random amounts.

    torque : on the driver [N m]; position : (n,) of the mesh cycle [base pitches]
    limits : largest amount of the deviations of each of `sources` [m]
    """

    contact: ContactProblem
    torque: float
    position: Array
    limits: Mapping[str, float]
    distribution: Distribution = "normal"

    @property
    def sources(self) -> tuple[str, ...]:
        """Sources of deviations."""
        return sources_of(isinstance(self.contact.solver, WidthContact))

    @property
    def names(self) -> tuple[str, ...]:
        """What is distributed."""
        every = MEAN_STIFFNESS, PEAK_TO_PEAK, DISTRIBUTION
        return every if HELIX[0] in self.sources else every[:2]

    @cached_property
    def teeth(self) -> NDArray[np.int64]:
        """Base pitches by which tooth pairs (k,) are ahead of the reference pair."""
        if isinstance(self.contact.solver, WidthContact):
            return pairs_over_width(self.contact, self.contact.solver, self.position)
        return candidate_pairs(self.contact, self.position)

    @cached_property
    def variables(self) -> tuple[str, ...]:
        """The source of each random variable (v,)."""
        steps = self.teeth.size - 1
        single = [name for name in self.sources if name not in PITCH]
        return (*single, *(name for name in PITCH for _ in range(steps)))

    @property
    def limit(self) -> Array:
        """Limits of the variables (v,) [m]."""
        return np.array([self.limits[name] for name in self.variables])

    @property
    def std(self) -> Array:
        """Standard deviations of the variables (v,) [m]."""
        return self.limit * std_over_limit(self.distribution)

    def sample(self, count: int, seed: int) -> Array:
        """Deviations (count, v) [m]."""
        shape = count, len(self.variables)
        return self.limit * unit_deviates(self.distribution, shape, seed)

    @cached_property
    def pitch_sums(self) -> Array:
        """Errors of teeth (v / 2, k) by the pitch deviations of one gear.

        The tooth of the reference pair has none; a pair that is ahead came earlier.
        """
        tooth = -self.teeth
        steps = np.arange(tooth.min(), tooth.max())[:, None]  # from each to the next
        after = (steps >= 0) & (steps < tooth)
        before = (steps < 0) & (steps >= tooth)
        return after.astype(float) - before.astype(float)

    def tooth_errors(self, deviations: Array) -> tuple[Array, Array]:
        """Material missing on the teeth of the pairs (s, k) [m] of either gear."""
        pitch = deviations[:, self._first_pitch :]
        driver, driven = np.split(pitch, 2, axis=1)
        return driver @ self.pitch_sums, driven @ self.pitch_sums

    @property
    def _first_pitch(self) -> int:
        """Number of the variables that are of no pitch."""
        return len(self.sources) - len(PITCH)

    def _deviations_of(self, names: Sequence[str], deviations: Array) -> Array:
        """Deviations (s, len(names)) of single variables, 0 of those there are not."""
        zero = np.zeros(len(deviations))
        columns = [
            deviations[:, self.variables.index(name)] if name in self.sources else zero
            for name in names
        ]
        return np.stack(columns, axis=1)

    def variants(self, deviations: Array) -> Variants:
        """Pairs of gears with deviations (s, v) [m]."""
        driver, driven = self.tooth_errors(deviations)
        profile, helix, axes, center = (
            self._deviations_of(names, deviations)
            for names in (PROFILE, HELIX, AXES, (CENTER,))
        )
        angle = self.contact.pair.operating_pressure_angle
        over_width = WidthDeviations(
            lead_slope=helix[:, :2],
            lead_crowning=helix[:, 2:],
            misalignment=axes @ np.array([np.sin(angle), np.cos(angle)]),
        )
        return Variants(
            slope=profile[:, :2],
            crowning=profile[:, 2:],
            center_distance=center[:, 0],
            gap=driver + driven,
            over_width=over_width,
        )

    def solve(
        self, deviations: Array, report: Callable[[int], None] = lambda done: None
    ) -> VariantContact:
        """Contact of the pairs of gears over the mesh cycle."""
        at = self.torque, self.position, self.variants(deviations), report
        match self.contact.solver:
            case PlaneContact():
                return solve_variants(self.contact, *at)
            case WidthContact() as face:
                return solve_width_variants(self.contact, face, *at)

    @property
    def mesh_force(self) -> float:
        """Torque over the driver's base radius [N]."""
        return self.torque / self.contact.pair.driver_arm

    def quantities(
        self, ste: Array, no_load: Array, distribution: Array
    ) -> dict[str, Array]:
        """What is distributed (s,), from transmission errors (s, n) [m].

        distribution : (s, b) as of `VariantContact`
        """
        values = {
            MEAN_STIFFNESS: (self.mesh_force / (ste - no_load)).mean(axis=1),
            PEAK_TO_PEAK: np.ptp(ste, axis=1),
        }
        if distribution.shape[1]:
            values[DISTRIBUTION] = distribution.max(axis=1)
        return values

    def lost_contact(self, contact: VariantContact) -> NDArray[np.bool_]:
        """Whether a tooth pair on the path of contact carries no load, (s,)."""
        nominal = on_path(self.contact.pair, self.position[:, None] + self.teeth)
        return np.asarray(((contact.load == 0.0) & nominal).any(axis=(1, 2)))


def sources_of(over_width: bool) -> tuple[str, ...]:
    """Sources of deviations; over_width : whether loads vary over the face width."""
    of_width = (*HELIX, *AXES) if over_width else ()
    return (*PROFILE, *of_width, CENTER, *PITCH)


@dataclass(frozen=True)
class LinearContact:
    """The contact as a linear function of the deviations from the nominal pair.

    ste, gap : of the nominal pair (n,), (n, k) [m]
    distribution : of loads over the width, of the nominal pair (b,)
    ste_slope, gap_slope, distribution_slope : slopes (n, v), (n, k, v), (b, v) by the
        deviations
    derivative_error : difference of slopes from the derivatives that the contact
        solution gives, relative
    """

    ste: Array
    gap: Array
    distribution: Array
    ste_slope: Array
    gap_slope: Array
    distribution_slope: Array
    derivative_error: float

    def solve(self, deviations: Array) -> tuple[Array, Array, Array]:
        """Transmission error under load and without (s, n) [m] by deviations (s, v).

        And the distribution of loads over the width (s, b).
        """
        ste = self.ste + deviations @ self.ste_slope.T
        no_load = np.full_like(ste, np.inf)
        for gap, slope in zip(
            self.gap.T, np.moveaxis(self.gap_slope, 1, 0), strict=True
        ):
            no_load = np.minimum(no_load, gap + deviations @ slope.T)
        distribution = self.distribution + deviations @ self.distribution_slope.T
        return ste, no_load, distribution


def linear_contact(problem: ToleranceProblem) -> LinearContact:
    """Slopes over a standard deviation to both sides of the nominal pair of gears."""
    step = np.maximum(problem.std, MIN_STEP)
    both_sides = problem.solve(np.concatenate([np.diag(step), -np.diag(step)]))
    nominal = problem.solve(np.zeros((1, step.size)))
    gap = np.where(np.isfinite(both_sides.gap), both_sides.gap, nominal.gap)
    facing = np.isfinite(nominal.gap[0])
    gap = np.where(facing & np.isfinite(gap), gap, NO_FLANK_GAP)
    difference = _difference(both_sides.ste, step)
    has_derivative = [name not in (CENTER, *AXES) for name in problem.variables]
    weight = problem.std * np.array(has_derivative)
    change = np.linalg.norm((ste_derivatives(problem) - difference) * weight)
    return LinearContact(
        ste=nominal.ste[0],
        gap=np.where(facing, nominal.gap[0], NO_FLANK_GAP),
        distribution=nominal.distribution[0],
        distribution_slope=_difference(both_sides.distribution, step),
        ste_slope=difference,
        gap_slope=_difference(gap, step),
        derivative_error=float(change / (np.linalg.norm(difference * weight) or 1.0)),
    )


def _difference(values: Array, step: Array) -> Array:
    """Derivatives (..., v) from values (2 v, ...) on both sides."""
    rise = values[: step.size] - values[step.size :]
    return np.moveaxis(rise, 0, -1) / (2.0 * step)


def ste_derivatives(problem: ToleranceProblem) -> Array:
    """Derivatives (n, v) of the transmission error from one contact solution.

    Zero for the centre distance and the axes.
    """
    contact = with_profiles(problem.contact)
    cycle = solve_cycle(contact, problem.torque, problem.position, with_slopes=True)
    by_gap = cycle.load_slope / (cycle.load_slope * cycle.closing).sum(
        -1, keepdims=True
    )
    by_pitch = by_gap[0] @ problem.pitch_sums.T
    derivatives = np.zeros((problem.position.size, len(problem.variables)))
    for names, slopes in ((PROFILE, cycle.profile_slope), (HELIX, cycle.lead_slope)):
        for gear in range(2):
            for name, size in ((names[gear], 1), (names[2 + gear], 0)):
                if name in problem.variables:
                    at = problem.variables.index(name)
                    derivatives[:, at] = slopes[0, :, gear, size]
    first = problem.variables.index(PITCH[0])
    derivatives[:, first:] = np.concatenate([by_pitch, by_pitch], axis=1)
    return derivatives
