"""Natural frequencies and shapes against closed forms, print and scaling laws."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from oracles import linear_train

from lumped import Gear, LumpedSystem, Mesh, Shaft, Train, TrainError, natural_modes

MEANS = (2.9831e8, 3.2108e8)  # N/m
RADII = (0.04535, 0.06564, 0.11218)
COUNTERSHAFT_RADII = (0.04535, 0.06564, 0.06564, 0.1122)
COUNTERSHAFT_INERTIAS = (2.62e-3, 8.588e-3, 1.0721e-2, 0.119)  # a fit to the print
factors = st.floats(1e-2, 1e2)


def countershaft(shaft=6.35e5, radii=COUNTERSHAFT_RADII):
    gears = tuple(
        Gear(name=str(i), teeth=z, base_radius=r, inertia=j)
        for i, (z, r, j) in enumerate(
            zip((38, 55, 55, 94), radii, COUNTERSHAFT_INERTIAS, strict=True)
        )
    )
    return Train(
        gears=gears,
        meshes=(
            Mesh(driver=0, driven=1, pressure_angle=0.37),
            Mesh(driver=2, driven=3, pressure_angle=0.37),
        ),
        shafts=(Shaft(gears=(1, 2), stiffness=shaft),),
    )


def test_idler_on_rigid_bearings_as_checked(idler):
    frequencies = natural_modes(idler(), MEANS).frequency_Hz
    np.testing.assert_allclose(frequencies, [69.5, 1605.0, 3231.0], rtol=1e-3)


def test_idler_on_bearings_as_checked(idler):
    """Table 2.2, which leaves out the pinion's motion across its line of action."""
    modes = natural_modes(idler(translations=True), MEANS)
    across = math.sqrt(1.27e8 / 2.2325) / (2.0 * math.pi)
    is_across = np.abs(modes.frequency_Hz / across - 1.0) < 1e-9
    assert is_across.sum() == 1
    assert modes.mesh_energy[:, is_across].sum() < 1e-12
    checked = [68.8, 446.1, 498.7, 641.1, 889.2, 1076.2, 2528.8, 3851.1]
    np.testing.assert_allclose(modes.frequency_Hz[~is_across], checked, rtol=1e-3)


def test_idler_of_chapter_three(idler):
    inertias = (0.002621, 3.27e-3, 0.119)
    modes = natural_modes(idler(coupled=False, inertias=inertias), MEANS)
    rigid, low, high = modes.frequency_Hz
    assert rigid == 0.0
    assert high / low == pytest.approx(2.763, rel=1e-3)
    masses = [j / r**2 for j, r in zip(inertias, RADII, strict=True)]
    expected = linear_train.idler_frequencies(masses, MEANS)
    np.testing.assert_allclose([low, high], expected, rtol=1e-10)


def test_countershaft_of_chapter_four():
    """1 : 2.34 : 3.29, led by shaft, second mesh, first mesh."""
    k = 2.98e8
    modes = natural_modes(countershaft(), (k, 1.08 * k))
    frequencies = modes.frequency_Hz
    assert frequencies[0] == 0.0
    np.testing.assert_allclose(
        frequencies[1:] / frequencies[1], [1.0, 2.34, 3.29], rtol=2e-3
    )
    expected = linear_train.countershaft_frequencies(
        COUNTERSHAFT_RADII, COUNTERSHAFT_INERTIAS, (k, 1.08 * k), 6.35e5
    )
    np.testing.assert_allclose(frequencies[1:], expected, rtol=1e-9)
    energy = modes.mesh_energy[:, 1:]
    shaft = 1.0 - energy.sum(axis=0)
    led_by = np.vstack([energy, shaft]).argmax(axis=0)
    assert led_by.tolist() == [2, 1, 0]


@pytest.mark.parametrize("shaft", [1e3, 1e5, 1e7, 1e9])
def test_elastic_shafts_match_the_closed_form(shaft):
    radii = (0.03, 0.05, 0.02, 0.08)
    frequencies = natural_modes(countershaft(shaft, radii), MEANS).frequency_Hz
    expected = linear_train.countershaft_frequencies(
        radii, COUNTERSHAFT_INERTIAS, MEANS, shaft
    )
    np.testing.assert_allclose(frequencies[1:], expected, rtol=1e-8)


@given(k=st.floats(1e4, 1e12), j1=st.floats(1e-6, 1e2), j2=st.floats(1e-6, 1e2))
def test_pairs_match_the_closed_form(k, j1, j2):
    gears = tuple(
        Gear(name=str(i), teeth=z, base_radius=r, inertia=j)
        for i, (z, r, j) in enumerate([(38, 0.045, j1), (55, 0.066, j2)])
    )
    train = Train(gears=gears, meshes=(Mesh(driver=0, driven=1, pressure_angle=0.3),))
    rigid, elastic = natural_modes(train, [k]).frequency_Hz
    expected = linear_train.pair_frequency(k, (0.045, 0.066), (j1, j2))
    assert rigid == 0.0
    assert elastic == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("translations", [False, True])
@pytest.mark.parametrize("coupled", [False, True])
def test_shapes_are_normalised_and_orthogonal(idler, translations, coupled):
    modes = natural_modes(idler(translations=translations, coupled=coupled), MEANS)
    space, v = modes.coordinates, modes.shapes
    np.testing.assert_allclose((v.T * space.mass) @ v, np.eye(v.shape[1]), atol=1e-11)
    rows = np.concatenate([space.mesh_rows, space.spring_rows])
    springs = np.concatenate([MEANS, space.spring_stiffness])
    rigidity = (rows @ v).T @ (springs[:, None] * (rows @ v))
    scale = modes.angular.max() ** 2
    np.testing.assert_allclose(
        rigidity / scale, np.diag(modes.angular**2) / scale, atol=1e-12
    )
    assert (np.diff(modes.frequency_Hz) >= 0.0).all()


@pytest.mark.parametrize("translations", [False, True])
def test_rigid_motion_is_exactly_free(idler, translations):
    modes = natural_modes(idler(translations=translations, coupled=False), MEANS)
    assert modes.frequency_Hz[0] == 0.0
    assert (modes.mesh_shapes[:, 0] == 0.0).all()
    assert (modes.mesh_energy[:, 0] == 0.0).all()
    assert modes.frequency_Hz[1] > 1.0


def test_a_soft_coupling_beside_stiff_teeth_keeps_its_digits(idler):
    """A mode 1e7 times slower: sqrt(k / J) of the whole train."""
    train = idler(coupled=False)
    k = 1e-4
    gears = (replace(train.gears[0], coupling_stiffness=k), *train.gears[1:])
    modes = natural_modes(replace(train, gears=gears), MEANS)
    ratios = [RADII[0] / r for r in RADII]
    inertia = sum(g.inertia * q * q for g, q in zip(gears, ratios, strict=True))
    expected = math.sqrt(k / inertia) / (2.0 * math.pi)
    assert modes.frequency_Hz[0] == pytest.approx(expected, rel=1e-6)


@given(turned=st.floats(-10.0, 10.0))
def test_turning_all_centre_lines_changes_nothing(idler, turned):
    """Bearings are equal in x and y."""
    one = natural_modes(idler(translations=True), MEANS).frequency_Hz
    two = natural_modes(idler(translations=True, turned=turned), MEANS).frequency_Hz
    np.testing.assert_allclose(two, one, rtol=1e-9)


@given(factor=factors)
def test_frequencies_scale_with_the_root_of_stiffness(idler, factor):
    train = idler(translations=True)
    gears = tuple(
        replace(
            g,
            coupling_stiffness=factor * g.coupling_stiffness,
            bearing_stiffness=tuple(factor * k for k in g.bearing_stiffness),
        )
        for g in train.gears
    )
    one = natural_modes(train, MEANS).frequency_Hz
    two = natural_modes(replace(train, gears=gears), [factor * k for k in MEANS])
    np.testing.assert_allclose(two.frequency_Hz, math.sqrt(factor) * one, rtol=1e-9)


@given(factor=factors)
def test_frequencies_fall_with_the_root_of_inertia(idler, factor):
    train = idler(translations=True)
    gears = tuple(
        replace(g, inertia=factor * g.inertia, mass=factor * g.mass)
        for g in train.gears
    )
    one = natural_modes(train, MEANS).frequency_Hz
    two = natural_modes(replace(train, gears=gears), MEANS).frequency_Hz
    np.testing.assert_allclose(two, one / math.sqrt(factor), rtol=1e-9)


@given(factor=st.floats(1.0, 10.0), mesh=st.integers(0, 1))
def test_a_stiffer_mesh_lowers_no_frequency(idler, factor, mesh):
    means = list(MEANS)
    means[mesh] *= factor
    one = natural_modes(idler(translations=True), MEANS).frequency_Hz
    two = natural_modes(idler(translations=True), means).frequency_Hz
    assert (two >= one * (1.0 - 1e-10)).all()


def test_damping_matrix_damps_every_mode_alike(idler):
    modes = natural_modes(idler(translations=True), MEANS)
    modal_damping = modes.shapes.T @ modes.damping_matrix(0.04) @ modes.shapes
    scale = modes.angular.max()
    np.testing.assert_allclose(
        modal_damping / scale, np.diag(0.08 * modes.angular) / scale, atol=1e-11
    )


def test_strain_energies_add_up(idler):
    """Without couplings and bearings all of it is in the meshes."""
    modes = natural_modes(idler(coupled=False), MEANS)
    np.testing.assert_allclose(modes.mesh_energy.sum(axis=0), [0.0, 1.0, 1.0])


def test_torques_that_do_not_balance_are_refused(idler, system):
    train = idler(coupled=False)
    gears = (*train.gears[:2], replace(train.gears[2], torque=-240.0))
    with pytest.raises(TrainError, match="torques do not balance"):
        system(replace(train, gears=gears))


def test_excitations_are_counted(idler, system):
    with pytest.raises(TrainError, match="1 for 2 meshes"):
        LumpedSystem(idler(), system().excitations[:1])


@pytest.mark.parametrize("means", [(3e8,), (3e8, 0.0), (3e8, math.nan), (-1.0, 3e8)])
def test_mean_stiffnesses_are_checked(idler, means):
    with pytest.raises(TrainError, match=r"mean_stiffness = .*; must hold 2 positive"):
        natural_modes(idler(), means)
