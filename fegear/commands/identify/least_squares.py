"""Face width and hub radii that give known mesh stiffnesses, by least squares.

Of most gears the mesh stiffness is known better, from print or from a test, than the
plane model's two free choices: how wide the gears are taken to be and where their
bodies are held. Wider gears are stiffer in proportion; larger hubs take compliance
away that does not vary over the mesh cycle, so that the variation grows as well. Hubs
of gears in mesh can replace each other: the measured values leave a valley of sets that
are equally good, which is returned with the set chosen.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.polynomial.chebyshev import chebpts1

from fegear.contact.problem import ContactProblem
from fegear.contact.solve import solve_cycle
from fegear.elasticity.cache import cached_flank_compliance
from fegear.elasticity.flank import FlankCompliance
from fegear.files.errors import InputError
from fegear.gearset.model import Gear, GearSet
from fegear.result import Result
from fegear.statics.contact_problem import contact_problem
from fegear.statics.settings import StaticsSettings
from lumped.common.array_types import Array
from lumped.common.progress import Progress, silent

Figures = tuple[Array, Array]
MIN_RIM_MODULES = 2.0  # modules from hub to root circle
MIN_HUB_RATIO = 0.15  # of the root radius
WIDTH_FACTORS = 0.25, 4.0  # smallest and largest
# hub radii at which a gear's compliance is computed; between them it is interpolated,
# which is 1e-3 of it off at most
HUB_RADIUS_COUNT = 12
HUB_SPREAD = 1.0  # spread of ln(hub / root radius), far wider than that of any figure
CONVERGENCE_RTOL = 1e-12  # relative; more than is shown, so that results repeat
DIFFERENCE_STEP = 1e-3  # of the logarithms, for derivatives
# misfit above the smallest one up to which a set is equally good
MAX_EXTRA_MISFIT = 1.0
VALLEY_POINTS = 25


@dataclass(frozen=True, kw_only=True, eq=False)
class MeasuredStiffness:
    """What is known of every mesh (m,), NaN where it is not known.

    torque : on each mesh's driver [N m]
    mean : of the average-slope stiffness over the mesh cycle [N/m]
    variation : peak to peak of the stiffness over its mean
    mean_std, variation_std : standard deviations, of the mean relative to it
    """

    torque: Array
    mean: Array
    variation: Array
    mean_std: float = 0.02
    variation_std: float = 0.025

    def misfits(self, mean: Array, variation: Array) -> Array:
        """Differences of the known figures over their standard deviations (k,)."""
        misfits = np.concatenate(
            [
                (mean / self.mean - 1.0) / self.mean_std,
                (variation - self.variation) / self.variation_std,
            ]
        )
        return misfits[np.isfinite(np.concatenate([self.mean, self.variation]))]


@dataclass(frozen=True, eq=False)
class Candidate:
    """One choice of widths and hubs, and what stiffness it gives.

    width_factor : of all face widths of the gear set
    hub_radius : (gears,) [m]
    mean, variation : (m,) [N/m], peak to peak over mean
    misfit : sum of squares of the misfits
    """

    width_factor: float
    hub_radius: Array
    mean: Array
    variation: Array
    misfit: float


@dataclass(frozen=True)
class Identified(Result):
    """The chosen set, computed anew with its own hubs, and the valley around it.

    along : index of the gear whose hub radius runs through the valley
    valley : the best sets at given radii of that hub, from small to large
    interpolation_error : largest relative change of a mean stiffness by using the
        chosen hubs themselves in place of interpolated compliances
    """

    best: Candidate
    along: int
    valley: tuple[Candidate, ...]
    interpolation_error: float

    @property
    def equally_good(self) -> tuple[Candidate, ...]:
        limit = min(c.misfit for c in (self.best, *self.valley)) + MAX_EXTRA_MISFIT
        return tuple(c for c in self.valley if c.misfit <= limit)


@dataclass(frozen=True)
class CompliancesOverHub:
    """A gear's flank compliance as a function of its hub radius [m].

    limits : smallest and largest radius; samples at Chebyshev points between them
    """

    limits: tuple[float, float]
    samples: tuple[FlankCompliance, ...]

    @cached_property
    def _interpolant(self) -> Callable[[float], Array]:
        from scipy.interpolate import BarycentricInterpolator

        values = np.array([[c.normal, c.tangential] for c in self.samples])
        return BarycentricInterpolator(_sampled_logarithms(self.limits), values)

    def __call__(self, hub_radius: float) -> FlankCompliance:
        normal, tangential = self._interpolant(math.log(hub_radius))
        sample = self.samples[0]
        return replace(sample, normal=normal, tangential=tangential, origin=None)


def _sampled_logarithms(limits: tuple[float, float]) -> Array:
    low, high = np.log(limits)
    return 0.5 * (low + high) + 0.5 * (high - low) * chebpts1(HUB_RADIUS_COUNT)


@dataclass(frozen=True)
class StiffnessModel:
    """What gives the stiffness of all meshes for any widths and hubs.

    torque : (m,) on each mesh's driver [N m]
    problems : of the gear set as given; their flanks and widths are replaced
    families : of each gear
    """

    gear_set: GearSet
    settings: StaticsSettings
    torque: Array
    problems: tuple[ContactProblem, ...]
    families: tuple[CompliancesOverHub, ...]

    def figures(self, width_factor: float, hub_radius: Array) -> Figures:
        """Mean [N/m] and variation of every mesh at hub radii (gears,) [m]."""
        pairs = zip(self.families, hub_radius, strict=True)
        return self._figures(width_factor, [family(hub) for family, hub in pairs])

    def meshed_figures(self, width_factor: float, hub_radius: Array) -> Figures:
        """Stiffness values with the hubs' own compliances instead of
        interpolated ones.
        """
        pairs = zip(self.gear_set.gears, hub_radius, strict=True)
        flanks = [_compliance(gear, float(hub), self.settings) for gear, hub in pairs]
        return self._figures(width_factor, flanks)

    def _figures(self, width_factor: float, flanks: list[FlankCompliance]) -> Figures:
        position = np.arange(self.settings.positions) / self.settings.positions
        curves = []
        for mesh, problem, torque in zip(
            self.gear_set.meshes, self.problems, self.torque, strict=True
        ):
            changed_problem = replace(
                problem,
                driver=replace(problem.driver, compliance=flanks[mesh.driver]),
                driven=replace(problem.driven, compliance=flanks[mesh.driven]),
                face_width=width_factor * problem.face_width,
            )
            curves.append(solve_cycle(changed_problem, torque, position).stiffness[0])
        mean = np.mean(curves, axis=1)
        return mean, np.ptp(curves, axis=1) / mean


def stiffness_model(
    gear_set: GearSet,
    torque: Sequence[float] | Array,
    settings: StaticsSettings | None = None,
    report: Progress = silent,
) -> StiffnessModel:
    """Compute every gear's compliance over its hub radii.

    torque : on each mesh's driver [N m]
    Raises InputError for a gear that leaves no room for a hub or has pitch errors.
    """
    settings = settings or StaticsSettings()
    for gear in gear_set.gears:
        if any(gear.pitch_errors):
            raise InputError(
                f'{gear_set.name}: gear "{gear.name}" has pitch_errors_um; hubs are '
                "identified from the stiffness of equal teeth, leave them out"
            )
    limits = [hub_limits(gear) for gear in gear_set.gears]
    families = []
    for i, gear in enumerate(gear_set.gears):
        radii = np.exp(_sampled_logarithms(limits[i]))
        samples = []
        for n, radius in enumerate(radii):
            report(f"hubs of {gear.name}", n, HUB_RADIUS_COUNT)
            samples.append(_compliance(gear, float(radius), settings))
        families.append(CompliancesOverHub(limits[i], tuple(samples)))
    problems = tuple(
        contact_problem(gear_set, mesh, settings)
        for mesh in range(len(gear_set.meshes))
    )
    return StiffnessModel(
        gear_set, settings, np.array(torque, float), problems, tuple(families)
    )


def _compliance(
    gear: Gear, hub_radius: float, settings: StaticsSettings
) -> FlankCompliance:
    geometry = replace(gear.geometry, hub_radius=hub_radius)
    return cached_flank_compliance(geometry, settings.material(gear), settings.size)


def hub_limits(gear: Gear) -> tuple[float, float]:
    """Smallest and largest hub radius that make sense [m]."""
    teeth = gear.geometry
    if teeth.sign < 0:
        raise InputError(
            f'gear "{gear.name}": internal = true; bodies of external gears only are '
            "identified"
        )
    low = MIN_HUB_RATIO * teeth.root_radius
    high = teeth.root_radius - MIN_RIM_MODULES * teeth.module
    if not low < high:
        raise InputError(
            f'gear "{gear.name}": root radius {1e3 * teeth.root_radius:.4g} mm; must '
            f"leave a hub below a rim of {MIN_RIM_MODULES:g} modules to be identified"
        )
    return low, high


def identify(
    model: StiffnessModel,
    measured: MeasuredStiffness,
    hold_width: bool = False,
    along: int = 0,
    report: Progress = silent,
) -> Identified:
    """The widths and hubs that meet what was measured best, and their valley.

    Of sets that are equally good the one is chosen whose hubs are most alike in
    proportion to their root circles.

    hold_width : face widths are known and stay
    along : index of the gear whose hub radius runs through the valley
    Raises InputError where nothing was measured.
    """
    if not np.isfinite([measured.mean, measured.variation]).any():
        raise InputError("no mean stiffness and no variation is known; one is needed")
    fit = _LeastSquaresFit(model, measured)
    fixed_logarithms = {0: 0.0} if hold_width else {}
    report("best set", 0, 1)
    best = fit.solve(fixed_logarithms, fit.bounds.mean(axis=0))
    smallest, largest = np.exp(fit.bounds[:, 1 + along])
    radii = np.log(np.linspace(smallest, largest, VALLEY_POINTS))
    is_above_best = radii > best[1 + along]
    solutions: list[Array] = []
    for stretch in (
        radii[~is_above_best][::-1],
        radii[is_above_best],
    ):  # outward from the best set
        x = best
        for radius in stretch:
            report("valley", len(solutions), VALLEY_POINTS)
            x = fit.solve({**fixed_logarithms, 1 + along: float(radius)}, x)
            solutions.append(x)
    solutions.sort(key=lambda x: x[1 + along])
    valley = tuple(fit.candidate(x, model.figures) for x in solutions)
    identified = fit.candidate(best, model.meshed_figures)
    interpolated = fit.candidate(best, model.figures)
    error = float(np.abs(interpolated.mean / identified.mean - 1.0).max())
    return Identified(identified, along, valley, error)


@dataclass(frozen=True)
class _LeastSquaresFit:
    """The least-squares problem in x = ln(width factor), ln(hub radii)."""

    model: StiffnessModel
    measured: MeasuredStiffness

    @cached_property
    def bounds(self) -> Array:
        """Smallest and largest x (2, 1 + gears)."""
        limits = [WIDTH_FACTORS, *(family.limits for family in self.model.families)]
        return np.log(limits).T

    def residuals(self, x: Array) -> Array:
        figures = self.model.figures(math.exp(x[0]), np.exp(x[1:]))
        gears = self.model.gear_set.gears
        part = x[1:] - np.log([gear.geometry.root_radius for gear in gears])
        hub_spread = (part - part.mean()) / HUB_SPREAD
        return np.concatenate([self.measured.misfits(*figures), hub_spread])

    def solve(self, fixed_logarithms: Mapping[int, float], start: Array) -> Array:
        """The best x with some of its entries held."""
        from scipy.optimize import least_squares

        x = start.copy()
        x[list(fixed_logarithms)] = list(fixed_logarithms.values())
        free = [i for i in range(x.size) if i not in fixed_logarithms]
        low, high = self.bounds[:, free]
        inside = 1e-6 * (high - low)  # the method starts off the bounds

        def residuals(part: Array) -> Array:
            x[free] = part
            return self.residuals(x)

        x[free] = least_squares(
            residuals,
            np.clip(x[free], low + inside, high - inside),
            bounds=(low, high),
            diff_step=[DIFFERENCE_STEP],
            xtol=CONVERGENCE_RTOL,
            ftol=CONVERGENCE_RTOL,
        ).x
        return x

    def candidate(
        self, x: Array, figures_of: Callable[[float, Array], Figures]
    ) -> Candidate:
        width_factor, hub_radius = math.exp(x[0]), np.exp(x[1:])
        figures = figures_of(width_factor, hub_radius)
        misfit = float((self.measured.misfits(*figures) ** 2).sum())
        return Candidate(width_factor, hub_radius, *figures, misfit)
