"""Closed forms of the idler against the print, quadrature and Floquet theory."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from scipy.linalg import eigh, expm
from scipy.optimize import brentq

from lumped.closed_forms import (
    backbone,
    contact_loss_amplitude,
    critical_damping,
    instability_interval,
    limits,
    linear_amplitude,
    lost_stiffness,
    parametric_system,
    peak,
    peak_amplitude,
    phase_extremes,
    rectangular_harmonic,
    rectangular_indicator,
    resonance,
    separation_angle,
    steady_vibrations,
    superharmonic,
    transition_frequencies,
)

HALF = Fraction(1, 2)
RADII = np.array([0.04535, 0.06564, 0.11218])  # m
INERTIAS = np.array([0.002621, 3.27e-3, 0.119])  # kg m2
STIFFNESS = np.array([2.9831e8, 3.2108e8])  # N/m
PEAK_TO_PEAK = np.array([0.35, 0.4])


@pytest.fixture(scope="module")
def parametric(chapter_3):
    return parametric_system(chapter_3())


class Printed:
    """Eq. 3.2 and 3.9 to 3.32 as printed, dimensionless, rectangular waves, phase 0."""

    damping = 0.04
    ratio = STIFFNESS[1] / STIFFNESS[0]

    def __init__(self):
        m1, m2, m3 = INERTIAS / RADII**2
        mass = np.array([[(m2 + m3) * m1, m1 * m3], [m1 * m3, (m1 + m2) * m3]])
        mass /= m1 + m2 + m3
        squares, _ = eigh(np.diag(STIFFNESS), mass)
        self.slowest = np.sqrt(squares[0])  # rad/s
        self.c = np.sqrt(squares / squares[0])
        scaled = squares[0] * mass / STIFFNESS[0]
        self.s = eigh(np.diag([1.0, self.ratio]), scaled)[1]
        self.force = self.s.sum(axis=0) / self.c**2
        self.still = self.s @ self.force  # s_j1 F_1 + s_j2 F_2
        # eq. 3.13 over the mean
        self.first = -PEAK_TO_PEAK / np.pi * np.sin(1.5 * np.pi)
        self.first = self.first * np.exp(-1.5j * np.pi)

    def angles(self, r, alpha):
        x = -self.still / (2.0 * self.s[:, r] * alpha)
        theta = np.arccos(np.clip(x, -1.0, 1.0))
        return np.where(self.s[:, r] > 0.0, np.pi - theta, theta)

    def r123(self, r, alpha):
        s, c = self.s[:, r], self.still
        # 3.30 as printed leaves pi where contact is kept and s_jr < 0
        theta = np.where(np.abs(2.0 * s * alpha) > c, self.angles(r, alpha), 0.0)
        stiff = np.array([1.0, self.ratio])
        r1 = -(stiff * s**2 * (np.sin(theta) * np.cos(theta) + theta)).sum() / np.pi
        r2 = (stiff * np.abs(s) * c * np.sin(theta)).sum() / np.pi
        r3 = (stiff * s * c * self.first).sum()
        return r1, r2, abs(r3)

    def frequencies(self, r, alpha):
        """Eq. 3.31."""
        (r1, r2, r3), c = self.r123(r, alpha), self.c[r]
        root = np.sqrt(r3**2 - 4.0 * self.damping**2 * alpha**2 * c**4)
        return c + (r1 * alpha + r2 + np.array([-root, root])) / (2.0 * alpha * c)

    def q3(self, r):
        stiff = np.array([1.0, self.ratio])
        return abs((stiff * self.s[:, r] ** 2 * self.first).sum())


PRINTED = Printed()


def test_natural_frequencies_and_second_over_first(parametric):
    slowest = PRINTED.slowest / (2.0 * np.pi)
    np.testing.assert_allclose(parametric.frequency, slowest * PRINTED.c, rtol=1e-9)
    assert PRINTED.c[1] == pytest.approx(2.763, abs=1e-3)  # printed 2.76


def test_energy_parts_sum_to_one(parametric):
    np.testing.assert_allclose(parametric.energy.sum(axis=0), 1.0, rtol=1e-9)


@pytest.mark.parametrize("mode", [0, 1])
@pytest.mark.parametrize("part", [0.3, 0.8, 0.99])
def test_frequencies_of_an_amplitude_are_eq_3_31(parametric, mode, part):
    near = resonance(parametric, mode)
    *_, r3 = PRINTED.r123(mode, 1.0)
    alpha = part * r3 / (2.0 * PRINTED.damping * PRINTED.c[mode] ** 2)  # of 3.34
    expected = PRINTED.frequencies(mode, alpha) * PRINTED.slowest / (2.0 * np.pi)
    vibrations = steady_vibrations(near, part * peak_amplitude(near))
    np.testing.assert_allclose([v.frequency for v in vibrations], expected, rtol=1e-6)


def test_first_lost_contact_is_the_checked_one(parametric):
    """SEED-FIGURES.md; printed with finite-element waves 0.870, 1.130; 0.875, 1.073."""
    near = resonance(parametric, 0)
    second, first = (
        np.array(transition_frequencies(near, mesh)) / near.at for mesh in (1, 0)
    )
    np.testing.assert_allclose(second, [0.873, 1.127], atol=5e-4)
    np.testing.assert_allclose(first, [0.886, 1.079], atol=5e-4)


def test_subharmonic_is_gone_at_the_checked_damping(parametric, chapter_3):
    """Printed 0.062 with finite-element waves."""
    near = resonance(parametric, 0, HALF)
    assert critical_damping(near) == pytest.approx(0.0605, abs=5e-5)
    assert critical_damping(near) == pytest.approx(PRINTED.q3(0) / 2.0, rel=1e-9)
    for factor, there in ((0.999, True), (1.001, False)):
        damped = replace(near, damping_ratio=factor * critical_damping(near))
        assert (instability_interval(damped) is not None) == there


def test_separation_stays_below_the_printed_part(parametric):
    top = peak(resonance(parametric, 0))
    assert 0.35 < top.separation.max() / np.pi < 0.41
    assert top.stable


@pytest.mark.parametrize("mode", [0, 1])
def test_lost_stiffness_is_the_first_harmonic_of_the_force_that_is_missing(
    parametric, mode
):
    near = resonance(parametric, mode)
    alpha = 1.7 * contact_loss_amplitude(near).max()
    turn = 2.0 * np.pi * (np.arange(200_000) + 0.5) / 200_000
    vibration = 2.0 * near.shapes[:, None] * alpha * np.cos(turn)
    deflection = near.elastic[:, None] + vibration
    missing = parametric.stiffness[:, None] * np.minimum(deflection, 0.0)
    on_mode = near.shapes @ missing
    first = 2.0 * (on_mode * np.cos(turn)).mean()
    assert lost_stiffness(near, alpha) == pytest.approx(first / (2.0 * alpha), rel=1e-6)
    parts = (deflection < 0.0).mean(axis=1)
    np.testing.assert_allclose(separation_angle(near, alpha) / np.pi, parts, atol=1e-4)
    assert backbone(near, alpha) < near.at


def exact_multiplier(scale, frequency, damping=0.03):
    """Largest Floquet multiplier of the idler with two rectangles in step."""
    m1, m2, m3 = INERTIAS / RADII**2
    mass = np.array([[(m2 + m3) * m1, m1 * m3], [m1 * m3, (m1 + m2) * m3]])
    mass /= m1 + m2 + m3
    squares, modes = eigh(np.diag(STIFFNESS), mass)
    momentum = mass @ modes
    c = momentum @ np.diag(2.0 * scale * damping * np.sqrt(squares)) @ momentum.T
    flow = np.eye(4)
    for side in (1.0, -1.0):
        k = np.diag(STIFFNESS * (1.0 + 0.5 * side * scale * PEAK_TO_PEAK))
        low = -np.linalg.solve(mass, np.hstack([k, c]))
        flow = expm(np.vstack([np.eye(2, 4, 2), low]) * 0.5 / frequency) @ flow
    return np.abs(np.linalg.eigvals(flow)).max()


def interval_error(chapter_3, mode, scale):
    """Of the edges of the subharmonic's interval, relative."""
    system = parametric_system(chapter_3(scale, damping=0.03))
    near = resonance(system, mode, HALF)
    edges = instability_interval(near)
    width = edges[1] - edges[0]

    def growth(f):
        return exact_multiplier(scale, f) - 1.0

    exact = [
        brentq(growth, edge - 0.45 * width, edge + 0.45 * width, xtol=1e-9)
        for edge in edges
    ]
    return np.abs(np.array(exact) - edges).max() / near.at


@pytest.mark.parametrize("mode", [0, 1])
def test_error_of_the_instability_interval_falls_with_the_square(chapter_3, mode):
    scales = np.array([0.5, 0.25, 0.125, 0.0625])
    errors = [interval_error(chapter_3, mode, scale) for scale in scales]
    order = np.polyfit(np.log(scales), np.log(errors), 1)[0]
    assert order == pytest.approx(2.0, abs=0.15)


def test_with_both_drives_all_vibrations_meet_the_linear_amplitude(chapter_3):
    """Below lost contact, at the frequencies of an amplitude eq. 2.24 gives it back."""
    system = parametric_system(chapter_3(contact_ratio=1.3))
    near = resonance(system, 0)
    assert abs(near.parametric) > 0.01
    alpha = 0.5 * contact_loss_amplitude(near).min()
    vibrations = steady_vibrations(near, alpha)
    assert len(vibrations) == 2
    for vibration in vibrations:
        assert linear_amplitude(near, vibration.frequency) == pytest.approx(
            alpha, rel=1e-9
        )
        assert vibration.stable
    assert vibrations[0].frequency < near.at < vibrations[1].frequency


def test_the_peak_with_both_drives_is_the_largest_linear_amplitude(chapter_3):
    near = resonance(parametric_system(chapter_3(contact_ratio=1.3, damping=0.05)), 0)
    grid = near.at * np.linspace(0.9, 1.1, 20_001)
    largest = max(linear_amplitude(near, frequency) for frequency in grid)
    assert peak_amplitude(near) == pytest.approx(largest, rel=1e-6)
    first_only = abs(near.drive) / (2.0 * near.damping_ratio)
    assert abs(peak_amplitude(near) / first_only - 1.0) > 0.1


def averaged_rates(near, u, frequency):
    """du/dt over w_r / 2, typed from the solvability condition, in rectangular form."""
    still = near.elastic / (2.0 * np.abs(near.shapes) * abs(u))
    theta = np.arccos(np.minimum(still, 1.0))
    lost = (near.energy * (theta - np.sin(theta) * np.cos(theta))).sum() / np.pi
    d = 2.0 - 2.0 * frequency / near.at - lost + 2j * near.damping_ratio
    rate = 1j * (d * u + near.parametric * np.conj(u) + near.drive)
    return np.array([rate.real, rate.imag])


@pytest.mark.parametrize(("order", "ratio"), [(1, 1.5), (1, 1.3), (HALF, 1.5)])
def test_vibrations_rest_and_their_stability_is_that_of_the_averaged_equation(
    chapter_3, order, ratio
):
    near = resonance(parametric_system(chapter_3(contact_ratio=ratio)), 0, order)
    flags = []
    for alpha in contact_loss_amplitude(near).min() * np.array([1.02, 1.3, 1.6]):
        for vibration in steady_vibrations(near, alpha):
            u = alpha * np.exp(-1j * vibration.phase)
            size = 1e-6 * alpha
            rest = averaged_rates(near, u, vibration.frequency)
            assert np.abs(rest).max() < 1e-9 * alpha
            columns = [
                averaged_rates(near, u + step, vibration.frequency)
                - averaged_rates(near, u - step, vibration.frequency)
                for step in (size, 1j * size)
            ]
            growth = np.linalg.eigvals(np.transpose(columns) / (2.0 * size)).real.max()
            assert (growth < 0.0) == vibration.stable
            flags.append(vibration.stable)
    assert {True, False} <= set(flags)


def test_rectangular_harmonics_are_those_of_the_excitation(chapter_3):
    """Delays and contact ratios as the lumped system has them, by quadrature there."""
    system = chapter_3(contact_ratio=1.3, phases=(0.0, 0.2))
    parametric = parametric_system(system, harmonics=5)
    for mesh, phase in enumerate((0.0, 0.2)):
        # position 0 is the middle of the path; pairs drop at 0.5 c - 1 + c - 1
        drop = 0.5 * 1.3 - 1.0 - phase
        harmonics = [
            rectangular_harmonic(PEAK_TO_PEAK[mesh], 1.3, 2.0 * np.pi * drop, m)
            for m in range(1, 6)
        ]
        np.testing.assert_allclose(
            parametric.stiffness_harmonics[mesh], harmonics, atol=1e-12
        )


@pytest.mark.parametrize("phi", [0.0, 0.4, 2.0])
def test_indicators_are_the_printed_ones(phi):
    (s1, s2), (c1, c2), ratios = (0.7, -1.3), (0.9, 1.2), (1.2, 1.7)
    k = 0.3 * np.sin(0.2 * np.pi) / np.pi  # contact ratios 1.2 for both
    a, b = s1 * c1, s2 * c2
    for weights, cross in (((a, b), a * b), ((s1**2, s2**2), (s1 * s2) ** 2)):
        indicator = rectangular_indicator(
            weights, (0.3,) * 2, (1.2,) * 2, (0.0, phi), (1,) * 2
        )
        squares = weights[0] ** 2 + weights[1] ** 2
        expected = k * np.sqrt(squares + 2.0 * cross * np.cos(phi))  # 3.46, 3.47
        assert indicator == pytest.approx(expected, rel=1e-12)
    lambdas = (0.3, 0.3 * np.sin(0.2 * np.pi) / np.sin(0.7 * np.pi))  # equal harmonics
    indicator = rectangular_indicator((a, b), lambdas, ratios, (0.0, phi), (1, 1))
    # 3.48; sin(1.2 pi) and sin(1.7 pi) are both negative
    turn = np.cos(phi + np.pi * (ratios[0] - ratios[1]))
    expected = k * np.sqrt(a**2 + b**2 + 2.0 * a * b * turn)
    assert indicator == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(("phi", "sign"), [(0.0, 1.0), (np.pi, -1.0)])
def test_indicators_over_the_second_contact_ratio_are_the_printed_ones(phi, sign):
    a, b, ratio = 0.6, -1.5, 1.27
    indicator = rectangular_indicator(
        (a, b), (0.3, 0.36), (1.5, ratio), (0.0, phi), (1, 1)
    )
    q, wave = 0.36 / 0.3 * b, np.sin(np.pi * ratio) ** 2
    root = np.sqrt(a**2 + sign * q * (2.0 * a + sign * q) * wave)  # 3.49, 3.50
    assert indicator == pytest.approx(0.3 / np.pi * root, rel=1e-12)


@pytest.mark.parametrize(("mode", "order"), [(0, 1), (1, 1), (0, 2), (0, HALF)])
def test_a_delay_of_the_critical_phase_gives_the_extremes(chapter_3, mode, order):
    def drives(delay):
        phases = (0.0, 0.1 - delay)
        system = parametric_system(chapter_3(contact_ratio=1.3, phases=phases))
        near = resonance(system, mode, order)
        return near.parametric_by if order == HALF else near.driven_by

    harmonic = 2 if order == 2 else 1
    extremes = phase_extremes(drives(0.0), 1, harmonic)
    for delay, size in (
        (extremes.at_largest, extremes.largest),
        (extremes.at_least, extremes.least),
        (extremes.at_least + 1.0 / harmonic, extremes.least),
    ):
        assert abs(drives(delay).sum()) == pytest.approx(size, rel=1e-9)
    assert extremes.largest > 1.2 * extremes.least


def test_a_subharmonic_without_damping_to_spare_has_no_vibrations(chapter_3):
    near = resonance(parametric_system(chapter_3(damping=0.07)), 0, HALF)
    assert steady_vibrations(near, 1.0) == ()
    assert transition_frequencies(near, 0) == ()


def test_printed_r4_of_lost_mean_deflections_is_not_taken(chapter_3):
    """Eq. 3.27 has C_j in the second harmonics, which would scale with the torque."""
    one, two = (
        resonance(parametric_system(chapter_3(contact_ratio=1.3, torque=torque)), 0)
        for torque in (100.0, 200.0)
    )
    assert two.parametric == pytest.approx(one.parametric, rel=1e-9)
    assert two.drive == pytest.approx(2.0 * one.drive, rel=1e-9)


def test_limits_are_told(chapter_3, parametric):
    assert limits(parametric, resonance(parametric, 1)) == ()
    uneven = parametric_system(chapter_3(contact_ratio=1.3, phases=(0.0, 0.4)))
    # the third harmonic excites mode 2, the fourth both modes together
    both = replace(uneven, frequency=np.array([1.0, 3.0]), damping_ratio=1e-3)
    sentences = " ".join(limits(both, resonance(both, 0)))
    assert "3 times the mesh frequency, nearest to the mode at 3, " in sentences
    assert "4 times the mesh frequency is near the sum" in sentences

    def limit_text(order=1, mode=0, scale=1.0, **changes):
        system = parametric_system(chapter_3(scale, **changes))
        return " ".join(limits(system, resonance(system, mode, order)))

    assert "varies by" in limit_text(scale=2.3)
    assert "contact is lost for" in limit_text(damping=0.02)
    assert "backlash" in limit_text(backlash=1e-6)
    assert "2 damping ratios or more" in limit_text(contact_ratio=1.25, damping=0.02)


def test_inputs_are_checked(chapter_3, parametric):
    with pytest.raises(ValueError, match="mode = 2; must be 0 to 1"):
        resonance(parametric, 2)
    with pytest.raises(ValueError, match=r"order = .*; must be positive"):
        resonance(parametric, 0, 0)
    with pytest.raises(ValueError, match=r"amplitude = .*; must be positive"):
        separation_angle(resonance(parametric, 0), 0.0)
    with pytest.raises(ValueError, match="drive = 0; must not be"):
        peak(resonance(parametric, 0, HALF))
    with pytest.raises(ValueError, match=r"elastic = .*; must be positive"):
        replace(parametric, elastic=-parametric.elastic)
    with pytest.raises(ValueError, match="shape"):
        replace(parametric, backlash=np.zeros(3))
    for ratio in (0.0, 1e-300, 1.0):
        with pytest.raises(
            ValueError, match=r"damping_ratio = .*; must be 1e-09 to below 1"
        ):
            replace(parametric, damping_ratio=ratio)
    with pytest.raises(ValueError, match="finite"):
        replace(parametric, deflection=np.array([np.nan, 1.0]))
    with pytest.raises(ValueError, match="drive flanks"):
        parametric_system(chapter_3(torque=-100.0))
    with pytest.raises(ValueError, match="order = 0; must be 1 or more"):
        rectangular_harmonic(0.3, 1.5, order=0)
    with pytest.raises(ValueError, match="harmonic = 0; must be 1 or more"):
        phase_extremes([1.0, 1.0], 1, 0)
    with pytest.raises(ValueError, match="harmonics = 0; must be 1 or more"):
        parametric_system(chapter_3(), harmonics=0)
    near = resonance(parametric, 0, HALF)
    with pytest.raises(ValueError, match="inside of a parametric instability"):
        linear_amplitude(near, near.at)


def test_a_superharmonic_needs_two_harmonics(chapter_3):
    one = parametric_system(chapter_3(harmonics=1), harmonics=1)
    assert resonance(one, 0, 2).drive == 0.0
    assert abs(superharmonic(one, 0, 2).drive) > 0.0
    assert superharmonic(one, 0, 3).drive == 0.0
