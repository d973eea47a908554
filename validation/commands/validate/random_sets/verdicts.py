"""Whether the coupled model keeps its promises on a random gear set.

Vibration: of the errors |RMS / RMS of the reference - 1| of the dynamic transmission
error, the worst mesh at each speed, the median and the 90th percentile are within
bounds, or the run warns of the body modes that it leaves out.

Natural frequencies about the loaded state agree, each with its nearest partner: those
of the coupled model with finite elements and the other way round.

Other branches: a speed is counted apart, and not among the errors, where these exceed
the bound on the percentile, and either the periods after which both repeat differ, or
one of both with the speed falling is within the median's bound of the other with the
speed rising: it is then known to have that motion as well. Of too many such speeds
nothing is known: then the promise is broken.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lumped.common.array_types import Array, Mask
from validation.commands.validate.random_sets.measuring import (
    COUPLED_DOWN,
    COUPLED_UP,
    NATURAL,
    REDUCED,
    REFERENCE,
    REFERENCE_DOWN,
    Measured,
)
from validation.study.other_branches import (
    MAX_SHARE,
    OTHER_MOTION,
    SAME_MOTION,
    on_other_branch,
)

MEDIAN, MAX_P90 = SAME_MOTION, OTHER_MOTION  # bounds on median and 90th percentile
MAX_OTHER_BRANCH = MAX_SHARE  # of the speeds
NATURAL_ERROR = 5e-3
STRAINS, PARTNER = 1e-2, 1e-3  # mesh energy of modes that count, and of partners


@dataclass(frozen=True)
class SetVerdict:
    """Verdict on a set: errors are relative, NaN where there is none.

    other_branch_speeds : speeds that are counted apart; median_all, p90_all : with
        these speeds
    reference : 90th percentile of the distance from the usual cut-off to the reference
    worst_Hz : where the largest error is that counts
    natural : largest error of a natural frequency, natural_Hz : of which
    """

    median: float
    p90: float
    median_all: float
    p90_all: float
    other_branch_speeds: int
    reference: float
    worst: float
    worst_Hz: float
    natural: float
    natural_Hz: float
    vibration_passed: bool
    warns: bool

    @property
    def natural_passed(self) -> bool:
        return self.natural <= NATURAL_ERROR

    @property
    def passed(self) -> bool:
        return (self.vibration_passed or self.warns) and self.natural_passed

    @property
    def summary(self) -> str:
        """`passed`, or which promise is not."""
        if self.vibration_passed or self.warns:
            vibration = "" if self.vibration_passed else "warns"
        else:
            vibration = "vibration off"
        frequencies = "" if self.natural_passed else "frequencies off"
        return ", ".join(filter(None, (vibration, frequencies))) or "passed"


def evaluate(measured: Measured) -> SetVerdict:
    errors = speed_errors(measured, COUPLED_UP)
    is_other_branch = other_branch(measured, errors)
    counted = errors[~is_other_branch]
    median, p90 = quantiles(counted)
    within = (
        median <= MEDIAN
        and p90 <= MAX_P90
        and is_other_branch.mean() <= MAX_OTHER_BRANCH
    )
    worst = int(np.argmax(np.where(is_other_branch, -1.0, errors)))
    natural, natural_Hz = largest_frequency_error(measured)
    median_all, p90_all = quantiles(errors)
    return SetVerdict(
        median=median,
        p90=p90,
        median_all=median_all,
        p90_all=p90_all,
        other_branch_speeds=int(is_other_branch.sum()),
        reference=quantiles(speed_errors(measured, REDUCED))[1],
        worst=float(errors[worst]),
        worst_Hz=measured.speeds_Hz[worst],
        natural=natural,
        natural_Hz=natural_Hz,
        vibration_passed=bool(within),
        warns=bool(measured.warnings),
    )


def speed_errors(measured: Measured, source: str, reference: str = REFERENCE) -> Array:
    """Error of the worst mesh at every speed (s,), infinite where either has no
    motion.
    """
    rms, other_rms = (np.array(measured.rms_m[s]) for s in (source, reference))
    errors = np.abs(rms / other_rms - 1.0).max(axis=1)
    return np.where(np.isfinite(errors), errors, np.inf)


def other_branch(measured: Measured, errors: Array) -> Mask:
    """Speeds (s,) that are counted apart, see the top of this file."""
    multiples, reference = (
        np.array(measured.multiples[s]) for s in (COUPLED_UP, REFERENCE)
    )
    differs = (multiples != reference).any(axis=1)
    own_reaches = speed_errors(measured, COUPLED_DOWN) <= MEDIAN
    is_reached = speed_errors(measured, COUPLED_UP, REFERENCE_DOWN) <= MEDIAN
    reached = own_reaches | is_reached
    return on_other_branch(errors, differs, reached)


def quantiles(errors: Array) -> tuple[float, float]:
    """Median and 90th percentile of errors, infinite of none at all.

    The percentile is one of the errors: half of an infinite one is none.
    """
    if not errors.size:
        return np.inf, np.inf
    return float(np.median(errors)), float(np.quantile(errors, 0.9, method="higher"))


def largest_frequency_error(measured: Measured) -> tuple[float, float]:
    """Relative, and the frequency [Hz] of which; NaN where no mode counts."""
    highest = NATURAL * measured.resonance_Hz
    natural, fe = measured.natural, measured.natural_fe
    errors = [
        *frequency_errors(natural, fe, highest),
        *frequency_errors(fe, natural, highest),
    ]
    return max(errors, default=(np.nan, np.nan))


def frequency_errors(
    modes: Sequence[Sequence[float]], others: Sequence[Sequence[float]], highest: float
) -> list[tuple[float, float]]:
    """(relative, frequency [Hz]) of each of one's own modes below a frequency from
    its nearest partner; infinite without any."""
    partners = np.array([f for f, energy in others if energy > PARTNER])
    return [
        (float(np.abs(partners / f - 1.0).min(initial=np.inf)), f)
        for f, energy in modes
        if energy > STRAINS and f < highest
    ]
