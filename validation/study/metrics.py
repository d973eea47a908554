"""How far a model is from the finite elements: curves and forces over a cycle.

Relative figures are over the reference, NaN passes through to a verdict that is
outside, and no figure is folded into a score.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lumped.common.array_types import Array
from lumped.steady.jumps import Jump, Peak
from lumped.steady.sweep import Direction

FE = "fe"  # source of the finite elements' values, in addition to the names of models
FE_FRICTIONLESS = "fe-without-friction"  # the same, where others have friction
FRICTION_EFFECT = "friction_effect"
FREQUENCY_MATCH_RTOL = 0.15  # of the frequency: jumps or peaks further apart are two
CYCLE_POINTS = 256  # of a cycle


@dataclass(frozen=True)
class Metric:
    """A unit and what is measured.

    allowed_is_minimum : whether the allowed value is the smallest
    needs : what a case must contain, `speeds_Hz`, `single_speed` or nothing
    """

    unit: str
    meaning: str
    allowed_is_minimum: bool = False
    needs: str = "speeds_Hz"


METRICS: Mapping[str, Metric] = {
    "rms_distance": Metric("1", "RMS distance of the curves of DTE over speed"),
    "off_jump_distance": Metric("1", "the same without speeds between jumps"),
    "peak_amplitude": Metric("1", "RMS of DTE on a peak, less the reference's"),
    "peak_frequency": Metric("1", "frequency of a peak, less the reference's"),
    "peaks_unmatched": Metric("peaks", "peaks that only one of both has"),
    "jump_frequency": Metric("Hz", "frequency of a jump, less the reference's"),
    "jumps_unmatched": Metric("jumps", "jumps that only one of both has"),
    "contact_loss": Metric("1", "largest contact-loss fraction, less the reference's"),
    "peak_force": Metric("1", "largest mesh force over the reference's, less 1"),
    FRICTION_EFFECT: Metric(
        "1", "largest RMS of DTE with friction over that without, less the reference's"
    ),
    "wave_correlation": Metric(
        "1", "correlation of mesh forces over a cycle", True, "single_speed"
    ),
    "wave_phase": Metric(
        "cycles", "shift of mesh forces, positive where late", needs="single_speed"
    ),
    "wave_peak_force": Metric(
        "1", "peak of mesh forces, ratio less 1", needs="single_speed"
    ),
    "wave_contact_loss": Metric(
        "1", "contact-loss fraction, less the reference's", needs="single_speed"
    ),
    "mean_stiffness": Metric(
        "1", "mean of load over static deflection, less 1", needs=""
    ),
    "stiffness_variation": Metric(
        "1", "its peak-to-peak over mean, difference", needs=""
    ),
    "static_deflection": Metric(
        "1", "RMS distance of its vibration, no mean", needs=""
    ),
}


@dataclass(frozen=True)
class Verdict:
    """A metric of a model at one place, such as `100 N m, up, mesh 1`.

    measured : signed where it is a difference; NaN is never within
    allowed : size of what is measured, or the least where the metric says so
    cause : of a value outside, whether the model is off or on another branch
    """

    metric: str
    model: str
    where: str
    measured: float
    allowed: float
    unit: str
    within: bool
    reason: str
    cause: str = ""


def verdict(
    metric: str, model: str, where: str, measured: float, allowed: float, reason: str
) -> Verdict:
    """The verdict on a measured value; written so that NaN cannot pass."""
    spec = METRICS[metric]
    within = (
        measured >= allowed if spec.allowed_is_minimum else abs(measured) <= allowed
    )
    return Verdict(
        metric, model, where, float(measured), allowed, spec.unit, bool(within), reason
    )


@dataclass(frozen=True, eq=False)
class MeasuredCurve:
    """One mesh over n rising speeds of one branch.

    frequency : (n,) of the first mesh [Hz]; dte_rms [m], force_peak [N], contact_loss
        part of the time, all (n,)
    complete : whether all speeds were reached
    period_multiple : (n,) periods of the mesh after which the motion repeats, 0 if it
        does not; None where it is not known
    """

    direction: Direction
    mesh: int
    frequency: Array
    dte_rms: Array
    force_peak: Array
    contact_loss: Array
    jumps: tuple[Jump, ...] = ()
    peaks: tuple[Peak, ...] = ()
    complete: bool = True
    period_multiple: NDArray[np.int64] | None = None


def match_frequencies(
    reference: Sequence[float], model: Sequence[float]
) -> list[tuple[int, int]]:
    """Index pairs of the nearest frequencies [Hz], nearest pairs first, each once."""
    distances = sorted(
        (abs(a - b), i, j)
        for i, a in enumerate(reference)
        for j, b in enumerate(model)
        if abs(a - b) <= FREQUENCY_MATCH_RTOL * max(a, b)
    )
    pairs: list[tuple[int, int]] = []
    for _, i, j in distances:
        if all(
            i != reference_index and j != matched_index
            for reference_index, matched_index in pairs
        ):
            pairs.append((i, j))
    return pairs


def count_unmatched(reference: Sequence[float], model: Sequence[float]) -> int:
    """Number of frequencies without a match, in either list."""
    return len(reference) + len(model) - 2 * len(match_frequencies(reference, model))


def jump_frequencies(curve: MeasuredCurve) -> list[float]:
    """Frequencies of the jumps, midpoints of their speed steps [Hz]."""
    return [0.5 * (jump.frequency_from + jump.frequency_to) for jump in curve.jumps]


def jump_zones(
    reference: MeasuredCurve, model: MeasuredCurve
) -> list[tuple[float, float]]:
    """Ranges [Hz] where the curves are on different sides of a jump.

    From one jump to its match in the other curve; of a jump without a match the step
    alone, so that what it leads to is seen in the distance.
    """
    pairs = match_frequencies(jump_frequencies(reference), jump_frequencies(model))
    steps = [(reference.jumps[i], model.jumps[j]) for i, j in pairs]
    unmatched_jumps = [
        (j,) for i, j in enumerate(reference.jumps) if i not in dict(pairs)
    ]
    matched_model_jumps = {j for _, j in pairs}
    unmatched_jumps += [
        (jump,) for j, jump in enumerate(model.jumps) if j not in matched_model_jumps
    ]
    zones = []
    for jumps in [*steps, *unmatched_jumps]:
        ends = [f for jump in jumps for f in (jump.frequency_from, jump.frequency_to)]
        zones.append((min(ends), max(ends)))
    return sorted(zones)


@dataclass(frozen=True)
class Distance:
    """Relative RMS distance, and the number of speeds compared and left out."""

    value: float
    speeds: int
    left_out: int


def curve_distance(
    reference: MeasuredCurve,
    model: MeasuredCurve,
    zones: Sequence[tuple[float, float]] = (),
) -> Distance:
    """Distance of the RMS of the DTE at common speeds outside the zones [Hz].

    The value is NaN where no speed is left, a value is, or the reference is still.
    """
    common, reference_index, model_index = np.intersect1d(
        reference.frequency, model.frequency, return_indices=True
    )
    outside = np.ones(common.size, bool)
    for low, high in zones:
        outside &= (common < low) | (common > high)
    reference_index, model_index = reference_index[outside], model_index[outside]
    value = relative_distance(
        reference.dte_rms[reference_index], model.dte_rms[model_index]
    )
    return Distance(value, int(outside.sum()), int((~outside).sum()))


def relative_distance(reference: ArrayLike, model: ArrayLike) -> float:
    """RMS of the difference of arrays of one shape over the RMS of the reference."""
    a, b = np.asarray(reference, float), np.asarray(model, float)
    reference_rms = float(np.sqrt((a**2).mean())) if a.size else math.nan
    if not reference_rms > 0.0:
        return math.nan
    return float(np.sqrt(((a - b) ** 2).mean())) / reference_rms


def relative_error(reference: float, model: float) -> float:
    """Relative error of a model; NaN where the reference is not positive."""
    return model / reference - 1.0 if reference > 0.0 else math.nan


def maximum(values: Array) -> float:
    """Maximum of an array; NaN if it is empty or any value is NaN."""
    return float(values.max()) if values.size else math.nan


Measured = tuple[str, str, float]  # (metric, place within the curve, value)


def curve_measures(
    reference: MeasuredCurve, model: MeasuredCurve
) -> Iterator[Measured]:
    """All metrics of a mesh and direction; peaks and jumps one by one."""
    if reference.direction != model.direction or reference.mesh != model.mesh:
        raise ValueError(
            f"curves = {reference.mesh} {reference.direction} and {model.mesh} "
            f"{model.direction}; must be of one mesh and direction"
        )
    is_complete = model.complete and reference.complete
    for name, zones in (
        ("rms_distance", []),
        ("off_jump_distance", jump_zones(reference, model)),
    ):
        distance = curve_distance(reference, model, zones)
        counted = f"{distance.speeds} speeds"
        counted += f", {distance.left_out} left out" if distance.left_out else ""
        yield name, counted, distance.value if is_complete else math.nan
    yield from _peak_measures(reference.peaks, model.peaks)
    yield from _jump_measures(reference, model)
    lost = maximum(model.contact_loss) - maximum(reference.contact_loss)
    yield "contact_loss", "", lost if is_complete else math.nan
    force = relative_error(maximum(reference.force_peak), maximum(model.force_peak))
    yield "peak_force", "", force if is_complete else math.nan


def friction_effect(with_friction: MeasuredCurve, without: MeasuredCurve) -> float:
    """Largest RMS of a mesh with friction over the one without; NaN of branches that
    ended early."""
    if not (with_friction.complete and without.complete):
        return math.nan
    return 1.0 + relative_error(
        maximum(without.dte_rms), maximum(with_friction.dte_rms)
    )


def _peak_measures(
    reference: Sequence[Peak], model: Sequence[Peak]
) -> Iterator[Measured]:
    reference_frequencies, model_frequencies = (
        [peak.frequency for peak in side] for side in (reference, model)
    )
    for i, j in sorted(match_frequencies(reference_frequencies, model_frequencies)):
        label = f"peak at {reference_frequencies[i]:g} Hz"
        amplitude = relative_error(reference[i].dte_rms, model[j].dte_rms)
        yield "peak_amplitude", label, amplitude
        yield (
            "peak_frequency",
            label,
            relative_error(reference_frequencies[i], model_frequencies[j]),
        )
    yield (
        "peaks_unmatched",
        _format_unmatched(reference_frequencies, model_frequencies),
        float(count_unmatched(reference_frequencies, model_frequencies)),
    )


def _jump_measures(
    reference: MeasuredCurve, model: MeasuredCurve
) -> Iterator[Measured]:
    reference_frequencies, model_frequencies = (
        jump_frequencies(reference),
        jump_frequencies(model),
    )
    for i, j in sorted(match_frequencies(reference_frequencies, model_frequencies)):
        yield (
            "jump_frequency",
            f"jump at {reference_frequencies[i]:g} Hz",
            model_frequencies[j] - reference_frequencies[i],
        )
    yield (
        "jumps_unmatched",
        _format_unmatched(reference_frequencies, model_frequencies),
        float(count_unmatched(reference_frequencies, model_frequencies)),
    )


def _format_unmatched(reference: Sequence[float], model: Sequence[float]) -> str:
    """Which frequencies have no match."""
    pairs = match_frequencies(reference, model)
    missing = [f for i, f in enumerate(reference) if i not in {a for a, _ in pairs}]
    extra = [f for j, f in enumerate(model) if j not in {b for _, b in pairs}]
    parts = [("missing", missing), ("extra", extra)]
    return "; ".join(
        f"{n} {', '.join(f'{f:g}' for f in fs)} Hz" for n, fs in parts if fs
    )


@dataclass(frozen=True, eq=False)
class Statics:
    """Static deflection of a mesh under its force [N], n positions of its cycle.

    position : (n,) in base pitches, 0 at the pitch point
    deflection : (n,) [m]; friction : (n,) what friction adds to it [m]
    single_pair_contact : (n,) where a single tooth pair carries
    """

    mesh: int
    force: float
    position: Array
    deflection: Array
    friction: Array
    single_pair_contact: NDArray[np.bool_]

    def friction_change(self, start: float, end: float) -> float:
        """Mean of what friction adds [m] to a single pair between two positions.

        NaN where no single pair carries there.
        """
        in_range = (
            self.single_pair_contact & (self.position >= start) & (self.position < end)
        )
        return float(self.friction[in_range].mean()) if in_range.any() else math.nan

    @property
    def stiffness(self) -> Array:
        """Load over deflection (n,) [N/m]; of a mesh without relief only."""
        return self.force / self.deflection

    @property
    def mean_stiffness(self) -> float:
        return float(self.stiffness.mean())

    @property
    def variation(self) -> float:
        """Peak-to-peak over mean of the stiffness, eps."""
        return float(np.ptp(self.stiffness)) / self.mean_stiffness


def static_measures(reference: Statics, model: Statics) -> Iterator[Measured]:
    mean = relative_error(reference.mean_stiffness, model.mean_stiffness)
    yield "mean_stiffness", "", mean
    yield "stiffness_variation", "", model.variation - reference.variation
    pitches = math.ceil(reference.position[-1])
    reference_deflection = np.interp(
        model.position, reference.position, reference.deflection, period=pitches
    )
    vibrations = (
        deflection - deflection.mean()
        for deflection in (reference_deflection, model.deflection)
    )
    yield "static_deflection", "", relative_distance(*vibrations)
