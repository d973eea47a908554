"""Planetary sets as lumped trains, against printed frequencies and closed forms."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import lumped
from lumped.train.coordinates import train_coordinates
from lumped.train.mode_families import mode_families, multiplicities
from lumped.train.modes import natural_modes

ALPHA = math.radians(24.6)
RADIUS = {"sun": 77.42e-3 / 2, "planet": 100.35e-3 / 2, "ring": 275.03e-3 / 2}
CENTERS = (RADIUS["sun"] + RADIUS["planet"]) / math.cos(ALPHA)
MASS = {"sun": 0.4, "planet": 0.66, "ring": 2.35, "carrier": 5.43}
REDUCED_INERTIA = {"sun": 0.39, "planet": 0.61, "ring": 3.0, "carrier": 6.29}  # I/r^2
BEARING, MESH, RING_TORSION = 1e8, 5e8, 1e9  # N/m
# Natural frequencies [Hz] that Lin and Parker (1999) print for 3 planets
ROTATIONAL = [0.0, 1475.7, 1930.3, 2658.3, 7462.8, 11775.3]
TRANSLATIONAL = [743.2, 1102.4, 1896.0, 2276.4, 6986.3, 9647.9]
PLANET = [1808.2, 5963.8, 6981.7]  # for 4 planets, and twice for 5


def planetary(planets: int, angles=None, **changes) -> lumped.Train:
    """The set of Lin and Parker; changes : of the train."""
    angles = angles or [2.0 * math.pi * n / planets for n in range(planets)]
    bearing = (BEARING, BEARING)

    def gear(name: str, kind: str, teeth: int, sign: int = 1, **more) -> lumped.Gear:
        radius = RADIUS[kind]
        inertia = REDUCED_INERTIA[kind] * radius**2
        sizes = {"teeth": teeth, "base_radius": sign * radius, "inertia": inertia}
        masses = {"mass": MASS[kind], "bearing_stiffness": bearing}
        return lumped.Gear(name=name, **sizes, **masses, **more)

    torsion = RING_TORSION * RADIUS["ring"] ** 2
    carried = [gear(f"planet-{n}", "planet", 35) for n in range(1, planets + 1)]
    meshes = []
    for n, angle in enumerate(angles, 1):
        both = {"pressure_angle": ALPHA}
        meshes += [
            lumped.Mesh(driver=0, driven=n, center_line=angle, **both),
            lumped.Mesh(
                driver=n, driven=planets + 1, center_line=angle + math.pi, **both
            ),
        ]
    carrier = lumped.Carrier(
        name="carrier",
        gears=tuple(range(1, planets + 1)),
        radius=CENTERS,
        angles=tuple(angles),
        inertia=REDUCED_INERTIA["carrier"] * CENTERS**2,
        mass=MASS["carrier"],
        bearing_stiffness=bearing,
    )
    return lumped.Train(
        gears=(
            gear("sun", "sun", 27),
            *carried,
            gear("ring", "ring", 99, sign=-1, coupling_stiffness=torsion),
        ),
        meshes=tuple(meshes),
        carrier=carrier,
        **changes,
    )


def textbook_frequencies(planets: int, angles=None) -> np.ndarray:
    """Natural frequencies [Hz] by matrices in the coordinates of Lin and Parker.

    Carrier, ring and sun have x, y and u = r theta, planets radial and tangential
    translations and u; written here from their deflections alone.
    """
    angles = angles or [2.0 * math.pi * n / planets for n in range(planets)]
    c, r, s = (np.arange(3 * i, 3 * i + 3) for i in range(3))
    size = 9 + 3 * planets
    stiffness = np.zeros((size, size))

    def spring(value: float, *terms: tuple[int, float]) -> None:
        row = np.zeros(size)
        for index, factor in terms:
            row[index] += factor
        stiffness[...] += value * np.outer(row, row)

    sin, cos = math.sin, math.cos
    for n, psi in enumerate(angles):
        zeta, eta, u = range(9 + 3 * n, 12 + 3 * n)
        at_sun, at_ring = psi - ALPHA, psi + ALPHA
        spring(
            MESH,
            *((s[0], -sin(at_sun)), (s[1], cos(at_sun)), (s[2], 1.0)),
            *((zeta, -sin(ALPHA)), (eta, -cos(ALPHA)), (u, 1.0)),
        )
        spring(
            MESH,
            *((r[0], -sin(at_ring)), (r[1], cos(at_ring)), (r[2], 1.0)),
            *((zeta, sin(ALPHA)), (eta, -cos(ALPHA)), (u, -1.0)),
        )
        spring(BEARING, (c[0], cos(psi)), (c[1], sin(psi)), (zeta, -1.0))
        spring(BEARING, (c[0], -sin(psi)), (c[1], cos(psi)), (c[2], 1.0), (eta, -1.0))
    for member in (c, r, s):
        for index in member[:2]:
            spring(BEARING, (index, 1.0))
    spring(RING_TORSION, (r[2], 1.0))
    kinds = ["carrier", "ring", "sun", *["planet"] * planets]
    mass = np.array([[MASS[k], MASS[k], REDUCED_INERTIA[k]] for k in kinds]).ravel()
    squares = np.linalg.eigvalsh(stiffness / np.sqrt(np.outer(mass, mass)))
    return np.sqrt(np.maximum(squares, 0.0)) / (2.0 * math.pi)


def modes_of(train: lumped.Train):
    return natural_modes(train, [MESH] * len(train.meshes))


def test_frequencies_that_lin_and_parker_print():
    train = planetary(3)
    modes = modes_of(train)
    families = np.array(mode_families(train, modes))
    computed = {name: modes.frequency_Hz[families == name] for name in set(families)}
    assert computed["rotational"] == pytest.approx(ROTATIONAL, abs=0.05)
    assert computed["translational"] == pytest.approx(
        np.repeat(TRANSLATIONAL, 2), abs=0.05
    )
    assert set(computed) == {"rotational", "translational"}


@pytest.mark.parametrize("planets", [4, 5, 6])
def test_families_have_the_multiplicities_of_equal_planets(planets):
    train = planetary(planets)
    modes = modes_of(train)
    families = np.array(mode_families(train, modes))
    counts = {name: int((families == name).sum()) for name in set(families)}
    extra = planets - 3
    assert counts == {"rotational": 6, "translational": 12, "planet": 3 * extra}
    computed = modes.frequency_Hz[families == "planet"]
    assert computed == pytest.approx(np.repeat(PLANET, extra), abs=0.05)
    expected = {"rotational": 1, "translational": 2, "planet": extra}
    same = multiplicities(modes.frequency_Hz)
    assert list(same) == [expected[family] for family in families]


@pytest.mark.parametrize("angles", [None, [0.0, 1.3, 2.9, 4.4]])
def test_frequencies_are_those_of_the_textbook_matrices(angles):
    computed = modes_of(planetary(4, angles)).frequency_Hz
    expected = textbook_frequencies(4, angles)
    assert computed[1:] == pytest.approx(expected[1:], rel=1e-9)
    assert computed[0] == 0.0


def test_planets_that_differ_mix_the_families():
    train = planetary(4)
    other = replace(train.gears[2], mass=2.0)
    changed = replace(train, gears=(*train.gears[:2], other, *train.gears[3:]))
    families = mode_families(changed, modes_of(changed))
    assert "mixed" in families


def held(train: lumped.Train, *names: str) -> lumped.Train:
    """The train with some members held and everything on fixed centres."""
    gears = tuple(
        replace(gear, bearing_stiffness=None, is_held=gear.name in names)
        for gear in train.gears
    )
    carrier = replace(train.carrier, bearing_stiffness=None, is_held="carrier" in names)
    return replace(train, gears=gears, carrier=carrier)


def test_held_carrier_on_a_fixed_axis_is_a_train_with_fixed_centres():
    with_carrier = held(planetary(3), "carrier")
    without = replace(with_carrier, carrier=None)
    computed, expected = (
        modes_of(train).frequency_Hz for train in (with_carrier, without)
    )
    assert computed == pytest.approx(expected, rel=1e-12)


def test_planets_without_bearings_are_those_on_stiff_bearings():
    """The error decreases in proportion to the compliance of the bearings."""
    rigid = modes_of(held(planetary(3), "ring")).frequency_Hz
    errors = []
    for stiffness in (1e11, 1e12, 1e13):
        train = held(planetary(3), "ring")
        elastic = tuple(
            replace(gear, bearing_stiffness=(stiffness, stiffness))
            if gear.name.startswith("planet")
            else gear
            for gear in train.gears
        )
        frequencies = modes_of(replace(train, gears=elastic)).frequency_Hz
        errors.append(np.abs(frequencies[: rigid.size] - rigid).max())
    assert errors[0] / errors[1] == pytest.approx(10.0, rel=0.1)
    assert errors[1] / errors[2] == pytest.approx(10.0, rel=0.1)


def closed(train: lumped.Train) -> lumped.Train:
    """The train with a ring whose radius is that of the sun and twice the planet's.

    That printed differs by 0.6 %; its coupling is taken away.
    """
    radius = RADIUS["sun"] + 2.0 * RADIUS["planet"]
    ring = replace(train.gears[-1], base_radius=-radius, coupling_stiffness=0.0)
    return replace(train, gears=(*train.gears[:-1], ring))


@settings(max_examples=30, deadline=None)
@given(
    st.lists(st.floats(0.0, 6.28), min_size=1, max_size=5),
    st.sampled_from(["fixed", "bearings"]),
)
def test_rotation_of_everything_strains_nothing(angles, centres):
    """All members turn by one angle about the axis, and so do the planets' centres."""
    train = closed(planetary(len(angles), list(angles)))
    if centres == "fixed":
        train = held(train)
    space = train_coordinates(train)
    motion = np.zeros(space.mass.size)
    for (body, kind), index in space.indices.items():
        if kind == "rotation":
            motion[index] = 1.0
        elif body in train.carrier.gears:
            angle = angles[train.carrier.gears.index(body)]
            moved = -math.sin(angle) if kind == "x" else math.cos(angle)
            motion[index] = CENTERS * moved
    rows = np.concatenate([space.mesh_rows, space.spring_rows])
    assert rows @ motion == pytest.approx(np.zeros(len(rows)), abs=1e-15)


def test_torques_in_the_ratio_of_radii_balance_on_the_free_rotation():
    train = closed(held(planetary(3), "ring"))
    modes = modes_of(train)
    sun, ring = RADIUS["sun"], -train.gears[-1].base_radius
    load = np.zeros(modes.coordinates.mass.size)
    indices = modes.coordinates.indices
    load[indices[0, "rotation"]] = sun
    load[indices[5, "rotation"]] = -(sun + ring)
    free = modes.shapes[:, modes.frequency_Hz == 0.0]
    assert free.shape[1] == 1
    assert abs(free.T @ load) < 1e-13 * (abs(free.T) @ abs(load))


def test_gears_on_a_carrier_need_a_mass():
    train = planetary(3)
    gears = tuple(
        replace(gear, bearing_stiffness=None, mass=None) for gear in train.gears
    )
    with pytest.raises(lumped.TrainError, match=r"planet-1.*mass is needed"):
        train_coordinates(replace(train, gears=gears))


def test_planets_out_of_balance_need_bearings():
    train = planetary(2, [0.0, 1.0])
    gears = tuple(replace(gear, bearing_stiffness=None) for gear in train.gears)
    with pytest.raises(lumped.TrainError, match="not balanced"):
        train_coordinates(replace(train, gears=gears))
