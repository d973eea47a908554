"""Tip relief by closed forms (chapter 2) against static and integrated motion."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from lumped import Settings, respond_with_history
from lumped.closed_forms import (
    limits,
    linear_amplitude,
    optimal_relief,
    parametric_system,
    relief_contours,
    resonance,
    with_superharmonic,
)
from lumped.train.analytic import static_error

EXACT = Settings(method="dopri5", tolerance=1e-7)
FORCE = 100.0 / 0.04535  # N
FIGURES = ((2.9831e8, 0.35), (3.2108e8, 0.4))  # N/m, peak to peak over mean
RATIOS = (1.4, 1.6)


def best(scale=1.0, ratios=RATIOS):
    """Optimal reliefs, from eq. 2.28 as printed."""
    reliefs = []
    for (k, variation), c in zip(FIGURES, ratios, strict=True):
        eps = scale * variation
        below = (1.0 + eps * (1.0 - c)) * (1.0 + eps * (2.0 - c))
        reliefs.append(2.0 * FORCE * eps / (k * below))
    return np.array(reliefs)


def relieved(chapter_3, parts, scale=1.0, **changes):
    """Teeth with parts of the optimal reliefs."""
    reliefs = tuple(np.multiply(parts, best(scale)))
    return chapter_3(scale, contact_ratio=RATIOS, reliefs=reliefs, **changes)


@pytest.mark.parametrize("mesh", [0, 1])
def test_optimal_relief_leaves_a_constant_static_error(chapter_3, mesh):
    (k, eps), c = FIGURES[mesh], RATIOS[mesh]
    low, high = k * (1.0 + eps * (1.0 - c)), k * (1.0 + eps * (2.0 - c))
    relief = optimal_relief(FORCE, low, high)
    assert relief == pytest.approx(best()[mesh], rel=1e-12)
    x = np.arange(1000) / 1000.0

    def range_with(part):
        pairs = relieved(chapter_3, (part, part)).excitations[mesh].pairs
        return np.ptp(static_error(pairs, FORCE)(x))

    assert relief == pytest.approx(2.0 * range_with(0.0), rel=1e-9)
    assert range_with(1.0) < 1e-9 * relief
    assert min(range_with(0.95), range_with(1.05)) > 0.01 * relief


@pytest.mark.parametrize(("mode", "order"), [(0, 1), (1, 1), (0, 2), (1, 3)])
@pytest.mark.parametrize("phase", [0.0, 0.3])
def test_drive_is_the_quadratic_form_of_the_reliefs(chapter_3, mode, order, phase):
    """At any harmonic, against the harmonics of stiffness times gap by quadrature."""
    phases = (0.0, phase)
    plain = resonance(
        parametric_system(relieved(chapter_3, (0, 0), phases=phases)), mode, order
    )
    contours = relief_contours(plain, best())
    for parts in ((0.5, 0.2), (1.0, 0.4), (1.3, 1.6), (1.0, 1.0)):
        system = parametric_system(relieved(chapter_3, parts, phases=phases))
        drive = abs(resonance(system, mode, order).drive)
        away = (np.array(parts) - 1.0) * best()
        expected = np.sqrt(max(0.0, away @ contours.form @ away))
        assert drive == pytest.approx(expected, rel=1e-9, abs=1e-9 * abs(plain.drive))


def test_the_phase_turns_the_ellipse_and_leaves_its_centre(chapter_3):
    angles = []
    for phase in (0.0, 0.5):
        near = resonance(
            parametric_system(relieved(chapter_3, (0, 0), phases=(0.0, phase))), 0
        )
        directions, growth = relief_contours(near, best()).axes()
        assert 0.0 <= growth[0] < growth[1]
        steepest = directions[:, 1]
        angles.append(np.degrees(np.arctan2(steepest[1], steepest[0])) % 180.0)
    assert abs(angles[0] - angles[1]) > 30.0  # figures 2.15 and 2.16: about 40


def test_meshes_in_step_make_up_for_each_other(chapter_3):
    """Equal contact ratios and phases: contours are straight lines."""
    near = resonance(parametric_system(chapter_3()), 0)
    contours = relief_contours(near, best(ratios=(1.5, 1.5)))
    directions, growth = contours.axes()
    assert growth[0] < 1e-6 * growth[1]
    away = contours.centre + 5e-6 * directions[:, 0]
    assert contours.amplitude(away, near.at) < 1e-6 * linear_amplitude(near, near.at)
    for frequency in (0.97 * near.at, near.at):
        without = contours.amplitude(np.zeros(2), frequency)
        assert without == pytest.approx(linear_amplitude(near, frequency), rel=1e-9)


def test_relief_does_not_move_the_primary_instability(chapter_3):
    """Eq. 2.27 has no relief in it."""
    half = Fraction(1, 2)
    with_relief, without = (
        resonance(parametric_system(relieved(chapter_3, parts)), 0, half).parametric
        for parts in ((0.7, 1.2), (0.0, 0.0))
    )
    assert with_relief == pytest.approx(without, rel=1e-12)


def amplitude_errors(chapter_3, scale, order):
    """Beside the first mode, of the first order alone and with the second order."""
    system = relieved(chapter_3, (0.7, 0.7), scale)
    parametric = parametric_system(system)
    near = resonance(parametric, 0, order)
    frequency = near.at * (1.0 + 0.05 * scale)
    response, history = respond_with_history(system, frequency, EXACT)
    assert response.contact_loss.max() == 0.0
    turn = np.exp(-2j * np.pi * order * frequency * history.time)
    area = np.trapezoid(history.deflection * turn[:, None], history.time, axis=0)
    amplitudes = 2.0 * np.abs(area) / (history.time[-1] - history.time[0])
    return [
        np.abs(
            amplitudes / near.amplitudes(linear_amplitude(approximation, frequency))
            - 1.0
        ).max()
        for approximation in (near, with_superharmonic(parametric, near))
    ]


def test_a_fundamental_with_relief_is_right_to_first_order(chapter_3):
    scales = np.array([0.5, 0.25, 0.125])
    errors = [amplitude_errors(chapter_3, scale, 1)[0] for scale in scales]
    assert np.polyfit(np.log(scales), np.log(errors), 1)[0] == pytest.approx(1.0, 0.15)
    assert errors[-1] < 0.05


def test_a_second_harmonic_needs_the_drive_of_second_order(chapter_3):
    """Both are right in the limit; at variations of 5 % the first alone is 50 % off."""
    scales = np.array([0.25, 0.125, 0.0625])
    alone, joint = np.transpose(
        [amplitude_errors(chapter_3, scale, 2) for scale in scales]
    )
    for errors in (alone, joint):
        assert np.polyfit(np.log(scales), np.log(errors), 1)[0] > 0.75
    assert alone[1] > 0.4
    assert joint[1] < 0.1


def test_lost_contact_with_relief_is_told(chapter_3):
    system = parametric_system(relieved(chapter_3, (2.6, 2.6), damping=0.02))
    told = " ".join(limits(system, resonance(system, 0)))
    assert "gaps or transmission errors excite" in told


def test_inputs_are_checked(chapter_3):
    with pytest.raises(ValueError, match=r"force = .*; must be positive"):
        optimal_relief(0.0, 1e8, 1.5e8)
    for low, high in ((1e8, 2.1e8), (1e8, 0.9e8), (0.0, 1e8), (np.nan, 1e8)):
        with pytest.raises(ValueError, match=r"highest = .*; must be"):
            optimal_relief(1e3, low, high)
    near = resonance(parametric_system(chapter_3()), 0)
    with pytest.raises(ValueError, match=r"optimal = .*; must be 2 positive"):
        relief_contours(near, [1e-5])
