"""Deflections that a faulty tooth adds to the meshes of its gear, by all signals.

Signals are averaged over the turns of a gear, and gaps that open in its meshes are
found from the residuals by least squares. A fault of one of its teeth adds about the
same deflection to all meshes in which the same flank of the tooth touches, each while
the tooth is in contact there. A fault of another gear does not: it shows in one of
these meshes alone, at other teeth in each, or in an average that has less of it.
"""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lumped.common.array_types import Array
from lumped.signals.averages import TurnAverage, synchronous_average
from lumped.signals.faulty_tooth import Engagement
from lumped.signals.receptances import signal_receptances
from lumped.signals.sampling import SampledSignals, Sampling, TurningGear
from lumped.train.system import LumpedSystem

# Least noise of a signal over its residual: receptances are those of a linear train
MODEL_NOISE = 0.05
REGULARISATION = 1e-3  # of the largest answer of all signals
SMOOTHING = 0.05  # standard deviation of the filter [base pitches]
MIN_HEIGHT = 6.0  # of a pulse over the noise
MIN_DEFLECTION = 5e-3  # of a pulse over the deflection at rest
MARGIN = 0.2  # base pitches of an effect before and after the contact of a tooth


class GearContacts(NamedTuple):
    """Contact of a gear's teeth over its turn.

    by_mesh : contact by the indices of the gear's meshes
    """

    gear: TurningGear
    by_mesh: Mapping[int, Engagement]


class AddedDeflections(NamedTuple):
    """Deflections that faults add to the m meshes of a gear over its turn.

    values : (p, m) [m]
    at_rest : (m,) deflections of the meshes under their loads [m]
    contacts : m of the gear's teeth
    """

    values: Array
    at_rest: Array
    contacts: tuple[Engagement, ...]

    @property
    def tooth_heights(self) -> Array:
        """Largest deflection (m, z) in the contact of every tooth, over that at rest.

        Zero where it does not exceed the noise of the mesh.
        """
        heights = np.zeros((len(self.contacts), self.contacts[0].teeth.size))
        rows = zip(heights, self.values.T, self.contacts, self.at_rest, strict=True)
        for row, deflection, contact, rest in rows:
            values, noise = pulses_over_turn(deflection, contact)
            height = _heights_in_contact(np.abs(values), contact)
            row[contact.teeth - 1] = np.where(height > MIN_HEIGHT * noise, height, 0.0)
            row /= rest
        return heights

    @property
    def flank_heights(self) -> Array:
        """Heights (2, z) that all meshes of a flank of every tooth have, over at rest.

        The flank by which the gear is driven is first, the one by which it drives
        second; zero of one that does not touch.
        """
        heights = self.tooth_heights
        drives = np.array([contact.drives for contact in self.contacts])
        flanks = [heights[drives == flank] for flank in (False, True)]
        none = np.zeros(heights.shape[1])
        return np.array([one.min(axis=0) if len(one) else none for one in flanks])

    @property
    def height(self) -> float:
        """Largest height that all meshes of a flank of a tooth have, over at rest."""
        return float(self.flank_heights.max())


def turns_of(sampling: Sampling, gear: TurningGear) -> float:
    """Turns of a gear at constant speed."""
    return float(sampling.turns / _turns_per_turn(sampling.gear, gear))


def _turns_per_turn(gear: TurningGear, other: TurningGear) -> Fraction:
    """Turns of a gear per turn of another."""
    return (gear.rate / gear.teeth) / (other.rate / other.teeth)


def added_deflections(
    system: LumpedSystem,
    sampled: SampledSignals,
    sampling: Sampling,
    contacts: GearContacts,
) -> AddedDeflections | None:
    """Deflections over the turn of a gear by all signals at constant speed.

    None where residuals are round-off.

    Raises ValueError where signals last less than a turn of the gear.
    """
    gear, meshes = contacts.gear, list(contacts.by_mesh)
    points = gear.teeth * sampling.samples
    order = np.arange(points // 2 + 1, dtype=float)
    frequency = order * gear.turn_frequency(sampling.ramp.start)
    signals, receptance = signal_receptances(system, sampled.names, meshes, frequency)
    values = sampled.over_angle[:, signals]
    # a ratio of whole numbers, so that points of gears in a mesh are samples
    per_turn = float(sampling.points * _turns_per_turn(sampling.gear, gear))
    mean, turns = synchronous_average(values, per_turn, points)
    average = TurnAverage(mean, turns, gear.orders)
    if not average.has_residual.any():
        return None
    squares, _ = synchronous_average(values**2, per_turn, points)
    variance = np.maximum((squares - mean**2).mean(axis=0), 0.0)
    noise = np.sqrt(variance / turns)
    return AddedDeflections(
        added_deflection(average.residual, noise, receptance),
        np.abs(system.static_deflection)[meshes],
        tuple(contacts.by_mesh.values()),
    )


def added_deflection(
    residual: Array, noise: Array, receptance: NDArray[np.complex128]
) -> Array:
    """Deflections (p, m) that faults add to m meshes over a turn [m].

    residual : (p, s) of averages of signals over the turn
    noise : (s,) standard deviations of the averages
    receptance : (p // 2 + 1, s, m) complex, at the orders of the turn
    """
    rms = np.sqrt((residual**2).mean(axis=0))
    weight = 1.0 / np.maximum(noise**2 + (MODEL_NOISE * rms) ** 2, np.finfo(float).tiny)
    lines = np.fft.rfft(residual, axis=0)
    answer = receptance.conj() * weight[:, None]
    normal = np.einsum("fsm,fsn->fmn", answer, receptance)
    loads = np.einsum("fsm,fs->fm", answer, lines)
    largest = np.einsum("fmm->fm", normal).real.max()
    normal += REGULARISATION * largest * np.eye(receptance.shape[-1])
    gap = np.linalg.solve(normal, loads[..., None])[..., 0]
    return np.fft.irfft(gap, len(residual), axis=0)


def pulses_over_turn(deflection: Array, contact: Engagement) -> tuple[Array, float]:
    """Smooth deflection (p,) without the part of most teeth, and its noise [m]."""
    per_pitch = deflection.size // contact.teeth.size
    by_tooth = _smooth(deflection, SMOOTHING * per_pitch).reshape(-1, per_pitch)
    # most teeth are alike, and a residual has no part that all have in common
    values = (by_tooth - np.median(by_tooth, axis=0)).ravel()
    return values, float(np.median(np.abs(values))) / 0.6745


def _smooth(values: Array, width: float) -> Array:
    """Values (p,) of a turn by a Gaussian filter.

    width : its standard deviation, in points
    """
    angular = 2.0 * np.pi * np.fft.rfftfreq(values.size)
    lines = np.fft.rfft(values) * np.exp(-0.5 * (width * angular) ** 2)
    return np.fft.irfft(lines, values.size)


def _heights_in_contact(values: Array, contact: Engagement) -> Array:
    """Largest of values (p,) of a turn in the contact of the teeth (z,) in turn."""
    per_pitch = values.size // contact.teeth.size
    start = np.arange(contact.teeth.size) + contact.start - contact.first - MARGIN
    length = contact.end - contact.start + 2.0 * MARGIN
    first = np.round(start * per_pitch).astype(np.int64)
    places = first[:, None] + np.arange(1 + round(length * per_pitch))
    return np.asarray(np.take(values, places, mode="wrap").max(axis=1))
