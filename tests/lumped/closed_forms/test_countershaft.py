"""Closed forms of meshes with two frequencies (chapter 4), print and integration.

Inertias and radii are fitted to the printed natural frequencies.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from scipy.linalg import eigh

from lumped import (
    Gear,
    LumpedSystem,
    Mesh,
    Settings,
    Shaft,
    StiffnessParameters,
    Train,
    analytic_excitation,
    respond_with_history,
)
from lumped.closed_forms import (
    ParametricSystem,
    critical_damping,
    linear_amplitude,
    parametric_system,
    peak_amplitude,
    predictions,
    rectangular_indicator,
    resonance,
    transition_frequencies,
)

EXACT = Settings(method="dopri5", tolerance=1e-7)
RADII = np.array([0.04535, 0.06564, 0.06564, 0.1122])  # m
INERTIAS = np.array([2.62e-3, 8.588e-3, 1.0721e-2, 0.119])  # kg m2
MEANS = 2.98e8 * np.array([1.0, 1.08])  # N/m
SHAFT = 6.35e5  # N m/rad
TORQUE = 100.0  # N m


def countershaft(
    rate: str,
    scale: float = 1.0,
    *,
    variations: tuple[float, float] = (0.3, 0.3),
    ratios: tuple[float, float] = (1.5, 1.5),
    damping: float = 0.04,
    phase: float = 0.0,
) -> LumpedSystem:
    """The second example; rate : mesh frequency of the second mesh over the first's."""
    second = Fraction(rate)
    teeth = (40, 60 * second.denominator, 60 * second.numerator, 90)
    out = -TORQUE * RADII[1] * RADII[3] / (RADII[0] * RADII[2])
    gears = tuple(
        Gear(name=str(i), teeth=z, base_radius=r, inertia=j, torque=q)
        for i, (z, r, j, q) in enumerate(
            zip(teeth, RADII, INERTIAS, (TORQUE, 0.0, 0.0, out), strict=True)
        )
    )
    meshes = (
        Mesh(driver=0, driven=1, pressure_angle=0.37),
        Mesh(driver=2, driven=3, pressure_angle=0.37, phase=phase),
    )
    train = Train(
        gears=gears,
        meshes=meshes,
        shafts=(Shaft(gears=(1, 2), stiffness=SHAFT),),
        damping_ratio=scale * damping,
    )
    waves = tuple(
        analytic_excitation(
            StiffnessParameters(mean=k, variation=scale * eps, contact_ratio=c)
        )
        for k, eps, c in zip(MEANS, variations, ratios, strict=True)
    )
    return LumpedSystem(train, waves)


class Printed:
    """Eq. 4.1 to 4.7 with the mass matrix derived; x1, x2 of the meshes, x3 twist."""

    def __init__(self):
        r1, r2, r3, r4 = RADII
        motion = np.array(
            [[r1, r2, 0, 0], [0, 0, -r3, -r4], [0, r2, -r2, 0]]
        )  # (4.1), with which x2 closes as gear 3 turns
        mass = np.linalg.inv(motion @ np.diag(1.0 / INERTIAS) @ motion.T)
        self.stiffness = np.array([*MEANS, SHAFT / r2**2])
        squares, shapes = eigh(np.diag(self.stiffness), mass)
        self.angular, self.v = np.sqrt(squares), shapes
        self.force = TORQUE / r1
        self.still = np.array([self.force, self.force * r2 / r3]) / MEANS


PRINTED = Printed()


@pytest.fixture(scope="module")
def case_1() -> ParametricSystem:
    """rho = 3/5: harmonics of the meshes never meet below the third."""
    return parametric_system(countershaft("3/5"))


def mode_led_by(system, mesh):
    return int(system.energy[mesh].argmax())


def test_modes_are_those_of_the_printed_coordinates(case_1):
    np.testing.assert_allclose(
        case_1.frequency, PRINTED.angular / (2 * np.pi), rtol=1e-9
    )
    ratios = case_1.frequency / case_1.frequency[0]
    np.testing.assert_allclose(ratios, [1.0, 2.34, 3.29], rtol=2e-3)
    energy = MEANS[:, None] * (PRINTED.v[:2] / PRINTED.angular) ** 2
    np.testing.assert_allclose(case_1.energy, energy, rtol=1e-8)
    np.testing.assert_allclose(case_1.deflection, PRINTED.still, rtol=1e-9)
    assert [mode_led_by(case_1, mesh) for mesh in (0, 1)] == [2, 1]


@pytest.mark.parametrize("mesh", [0, 1])
def test_case_1_peaks_and_transitions_are_those_of_one_mesh(case_1, mesh):
    """Eq. 4.20 to 4.23, where 4.22 is right as printed and 4.23 lacks a c_s."""
    mode = mode_led_by(case_1, mesh)
    near = resonance(case_1, mode, case_1.rates[mesh])
    c = PRINTED.angular[mode]
    first = 0.3 / np.pi  # rectangular wave of contact ratio 1.5
    v = PRINTED.v[mesh, mode]
    r3 = abs(v * PRINTED.still[mesh]) * MEANS[mesh] * first
    zeta = 0.04
    alpha = r3 / (2.0 * zeta * c**2)  # of the coordinate v, in place of v / c
    expected = 2.0 * abs(v) * alpha
    amplitude = near.amplitudes(peak_amplitude(near))[mesh]
    assert amplitude == pytest.approx(expected, rel=1e-9)
    onset = PRINTED.still[mesh] / (2.0 * abs(v))
    if alpha > onset:
        half = np.sqrt((r3 / (2.0 * c * onset)) ** 2 - (zeta * c) ** 2) / (2.0 * np.pi)
        edges = np.array(transition_frequencies(near, mesh)) * float(near.order)
        expected_edges = near.frequency + half * np.array([-1.0, 1.0])
        np.testing.assert_allclose(edges, expected_edges, rtol=1e-9)
    assert np.count_nonzero(near.driven_by) == 1


def test_only_the_resonant_mesh_loses_contact(case_1):
    """Figure 4.9, by amplitudes of first loss below eq. 4.22."""
    for mesh in (0, 1):
        near = resonance(case_1, mode_led_by(case_1, mesh), case_1.rates[mesh])
        lost = [bool(transition_frequencies(near, other_mesh)) for other_mesh in (0, 1)]
        assert lost == [other_mesh == mesh for other_mesh in (0, 1)]


def test_case_2_harmonic_z_of_the_slower_mesh_joins():
    """Eq. 4.25 with rho = 1/2: the second harmonic of mesh 2 at w_1 near c_3."""
    system = parametric_system(countershaft("1/2", ratios=(1.7, 1.6), phase=0.1))
    near = resonance(system, 2, 1)
    v = PRINTED.v[:2, 2]
    size = np.abs(v) * MEANS * PRINTED.still * 0.3 / np.pi
    size *= np.abs(np.sin(np.pi * np.array([1.7, 2.0 * 1.6]))) / (1.0, 2.0)
    drives = np.abs(near.driven_by) * PRINTED.angular[2]
    np.testing.assert_allclose(drives, size, rtol=1e-9)


@pytest.mark.parametrize(
    ("rate", "order", "direct", "twice"),
    [
        ("3/5", Fraction(1), (1, 0), (2, 0)),  # case 1 of 4.21
        ("3/5", Fraction(3, 5), (0, 1), (0, 2)),
        ("3/5", Fraction(1, 2), (0, 0), (1, 0)),  # case 1 of 4.26
        ("1/2", Fraction(1), (1, 2), (2, 4)),  # case 2, w_l = w_j / z
        ("1/3", Fraction(1, 3), (0, 1), (0, 2)),  # case 2, w_l = z w_j, z > 2
        ("1/3", Fraction(1, 2), (0, 0), (1, 3)),  # 4.27, z odd
        ("1/4", Fraction(1, 8), (0, 0), (0, 1)),  # 4.27, w_l = z w_j
        ("1/2", Fraction(1, 2), (0, 1), (1, 2)),  # 4.28, z = 1
        ("1/4", Fraction(1, 2), (0, 2), (1, 4)),  # 4.28, z = 2
    ],
)
def test_which_harmonics_drive_in_every_case(rate, order, direct, twice):
    """Harmonics of both meshes that drive directly and parametrically, 0 for none."""
    system = parametric_system(countershaft(rate, ratios=(1.37, 1.29), phase=0.2))
    near = resonance(system, 1, order)
    v = system.shapes[:, 1]
    for mesh in (0, 1):
        z = [0.0, *system.stiffness_harmonics[mesh]]
        stiff = MEANS[mesh] * v[mesh]
        driven = stiff * PRINTED.still[mesh] * z[direct[mesh]]
        assert near.driven_by[mesh] == pytest.approx(driven, rel=1e-9)
        assert near.parametric_by[mesh] == pytest.approx(
            stiff * v[mesh] * z[twice[mesh]], rel=1e-9
        )


def test_the_subharmonic_is_gone_below_a_variation():
    """Case 2 of eq. 4.33 at |R4| = 2 zeta c_s^2.

    Eq. 4.37 prints sin squared and 0.2459, with which more than all of the strain
    energy had to be in mesh 1; with the sine it is a part of 0.948, here 0.849.
    """
    near = resonance(
        parametric_system(countershaft("3/5", ratios=(1.7, 1.6), damping=0.03)),
        2,
        Fraction(1, 2),
    )
    part = MEANS[0] * (PRINTED.v[0, 2] / PRINTED.angular[2]) ** 2
    assert part == pytest.approx(0.849, abs=1e-3)
    least = 2.0 * np.pi * 0.03 / (part * abs(np.sin(1.7 * np.pi)))
    assert 0.3 * 0.03 / critical_damping(near) == pytest.approx(least, rel=1e-9)


@pytest.mark.parametrize("phi", [0.0, 0.7, np.pi])
def test_parameter_studies_are_the_printed_sums(phi):
    """Case 1 of eq. 4.32 and 4.33 with z = 2 and 3."""
    (vj, vl), (wj, wl), (ej, el), (cj, cl) = (0.8, -0.5), (1.1, 0.9), (0.3, 0.2), RATIOS
    for z, a, b in ((2, vj * wj, vl * wl), (3, vj**2, vl**2)):
        one, two = a * ej / np.pi, b * el / (z * np.pi)
        s, t = np.sin(np.pi * cj), np.sin(z * np.pi * cl)
        turn = np.cos(np.pi * (z * cl - cj) - z * phi)
        square = (one * s) ** 2 + (two * t) ** 2 + 2.0 * one * two * s * t * turn
        indicator = rectangular_indicator(
            (a, b), (ej, el), (cj, cl), (0.0, phi), (1, z)
        )
        assert indicator == pytest.approx(np.sqrt(square), rel=1e-12)


RATIOS = (1.7, 1.6)


def integrated(system, parametric, near, frequency):
    """Error of the amplitudes of the mode's frequency, against integration."""
    response, history = respond_with_history(system, frequency, EXACT)
    assert response.contact_loss.max() == 0.0
    omega = 2.0 * np.pi * float(near.order) * frequency
    turn = np.exp(-1j * omega * history.time)
    area = np.trapezoid(history.deflection * turn[:, None], history.time, axis=0)
    amplitudes = 2.0 * np.abs(area) / (history.time[-1] - history.time[0])
    expected = near.amplitudes(linear_amplitude(near, frequency))
    mesh = int(parametric.energy[:, near.mode].argmax())
    return abs(amplitudes[mesh] / expected[mesh] - 1.0)


@pytest.mark.parametrize(
    ("rate", "mode", "order"),
    [
        ("3/5", 2, Fraction(1)),
        ("3/5", 1, Fraction(3, 5)),
        ("1/2", 2, Fraction(1)),
        ("1/2", 2, Fraction(1, 2)),  # fundamental and subharmonic combined
    ],
)
def test_response_is_right_to_first_order(rate, mode, order):
    scales, errors = np.array([0.4, 0.2, 0.1]), []
    for scale in scales:
        system = countershaft(rate, scale, ratios=(1.4, 1.3), damping=0.08)
        parametric = parametric_system(system)
        near = resonance(parametric, mode, order)
        frequency = near.at * (1.0 + 0.05 * scale)
        errors.append(integrated(system, parametric, near, frequency))
    assert errors[-1] < 0.05
    assert np.polyfit(np.log(scales), np.log(errors), 1)[0] > 0.7


def test_the_phase_between_both_kinds_counts():
    """Half a cycle of mesh 2 is a whole one of mesh 1: the same motion, begun later.

    |f / alpha + p| = 2 zeta, as eq. 4.28 has it, gives it two amplitudes.
    """
    printed, amplitudes = [], []
    for phase in (0.1, 0.6):
        system = countershaft("1/2", 0.05, ratios=(1.4, 1.3), damping=0.06, phase=phase)
        parametric = parametric_system(system)
        near = resonance(parametric, 2, Fraction(1, 2))
        f, p, zeta = near.drive, near.parametric, near.damping_ratio
        assert abs(p) > zeta
        rest = abs(p) ** 2 - 4.0 * zeta**2
        inverse = np.roots([abs(f) ** 2, 2.0 * (f * p.conjugate()).real, rest])
        printed.append(1.0 / inverse.max())
        amplitudes.append(linear_amplitude(near, near.at))
        assert integrated(system, parametric, near, near.at) < 0.05
    assert amplitudes[0] == pytest.approx(amplitudes[1], rel=1e-9)
    assert abs(printed[0] / printed[1] - 1.0) > 0.5


def test_predictions_cover_both_meshes():
    resonances = predictions(parametric_system(countershaft("1/2")))
    kinds = {tuple(sorted(prediction.kinds.items())) for prediction in resonances}
    assert ((0, "fundamental"), (1, "second harmonic")) in kinds
    assert ((0, "subharmonic"), (1, "fundamental")) in kinds
    assert len(resonances) == 3 * 4  # orders 1/4, 1/2, 1 and 2 of each mode
