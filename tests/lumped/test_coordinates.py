"""Degrees of freedom: rows of the meshes, rigid groups, springs, loads."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from lumped import Gear, Mesh, Shaft, Train, TrainError
from lumped.train.coordinates import line_of_action, rigid_groups, train_coordinates


def test_rotations_of_the_idler(idler):
    """Eq. (2.3): S1 = u1 + u2, S2 = -u2 - u3."""
    space = train_coordinates(idler())
    r1, r2, r3 = 0.04535, 0.06564, 0.11218
    expected = [[r1, r2, 0.0], [0.0, -r2, -r3]]
    np.testing.assert_allclose(space.mesh_rows, expected, rtol=1e-15)
    assert [kind for _, kind in space.labels] == ["rotation"] * 3
    np.testing.assert_allclose(space.load, [100.0, 0.0, -100.0 * r3 / r1])
    np.testing.assert_allclose(space.spring_stiffness, [3389.6, 11297.9])


def test_translations_of_the_idler_turned_into_the_seeds_frame(idler):
    """Eq. (2.3) with x along the first line of action: chi = alpha1 + alpha2."""
    train = idler(translations=True)
    space = train_coordinates(train)
    one = np.array(line_of_action(train, train.meshes[0]))
    across = np.array([-one[1], one[0]])
    index = {label: i for i, label in enumerate(space.labels)}
    chi = math.radians(21.22 + 21.02)

    def along(mesh, name):
        row = space.mesh_rows[mesh]
        both = np.array([row[index[name, "x"]], row[index[name, "y"]]])
        return both @ one, abs(both @ across)

    assert along(0, "pinion") == pytest.approx((1.0, 0.0), abs=1e-12)
    assert along(0, "idler") == pytest.approx((-1.0, 0.0), abs=1e-12)
    expected = (abs(math.cos(chi)), abs(math.sin(chi)))
    for name in ("idler", "follower"):
        components = along(1, name)
        assert (abs(components[0]), components[1]) == pytest.approx(expected, rel=1e-12)
    assert along(1, "idler")[0] == pytest.approx(-along(1, "follower")[0])


def test_contact_pushes_the_gears_apart(idler):
    """Both centres move away from each other along the centre line when pressed."""
    space = train_coordinates(idler(translations=True))
    index = {label: i for i, label in enumerate(space.labels)}
    row = space.mesh_rows[0]
    assert row[index["pinion", "x"]] > 0.0  # towards the idler closes the mesh
    assert row[index["idler", "x"]] < 0.0


@pytest.mark.parametrize("mesh", [0, 1])
def test_force_and_moment_of_a_mesh_balance(idler, mesh):
    """As much on one gear as on the other; moments about the pitch point vanish."""
    space = train_coordinates(idler(translations=True))
    row = space.mesh_rows[mesh]
    kinds = np.array([kind for _, kind in space.labels])
    for axis in "xy":
        assert row[kinds == axis].sum() == pytest.approx(0.0, abs=1e-15)


def test_rolling_closes_no_mesh(idler):
    """Rotations in the ratio of the base circles leave every mesh as it is."""
    r1, r2, r3 = 0.04535, 0.06564, 0.11218
    rolling = [1.0 / r1, -1.0 / r2, 1.0 / r3]
    rows = train_coordinates(idler()).mesh_rows
    np.testing.assert_allclose(rows @ rolling, 0.0, atol=1e-15)


def shafted(stiffness=None, second=None):
    gears = tuple(
        Gear(
            name="abcd"[i],
            teeth=(51, 72, 19, 73)[i],
            base_radius=(0.03, 0.05, 0.02, 0.08)[i],
            inertia=1e-3 * (i + 1),
            mass=1.0 + i,
            bearing_stiffness=second if i == 1 else None,
            coupling_stiffness=10.0 if i in (1, 2) else 0.0,
            torque=float(i),
        )
        for i in range(4)
    )
    return Train(
        gears=gears,
        meshes=(
            Mesh(driver=0, driven=1, pressure_angle=0.35),
            Mesh(driver=2, driven=3, pressure_angle=0.35),
        ),
        shafts=(Shaft(gears=(1, 2), stiffness=stiffness),),
    )


def test_rigid_shaft_adds_up():
    space = train_coordinates(shafted())
    assert rigid_groups(shafted()) == [(0,), (1, 2), (3,)]
    assert [name for name, _ in space.labels] == ["a", "b+c", "d"]
    np.testing.assert_allclose(space.mass, [1e-3, 5e-3, 4e-3])
    np.testing.assert_allclose(space.load, [0.0, 3.0, 3.0])
    np.testing.assert_allclose(space.mesh_rows, [[0.03, 0.05, 0], [0, -0.02, -0.08]])
    np.testing.assert_allclose(space.spring_stiffness, [10.0, 10.0])


def test_elastic_shaft_is_a_spring():
    space = train_coordinates(shafted(2e5))
    assert space.mass.size == 4
    np.testing.assert_allclose(space.spring_rows[-1], [0, 1, -1, 0])
    assert space.spring_stiffness[-1] == 2e5


def test_rigid_shaft_shares_one_bearing():
    space = train_coordinates(shafted(second=(1e8, 2e8)))
    assert ("b+c", "x") in space.labels
    x = space.labels.index(("b+c", "x"))
    assert space.mass[x] == pytest.approx(2.0 + 3.0)
    # the force of the second mesh pushes the common centre too
    assert space.mesh_rows[1, x] != 0.0
    assert sorted(space.spring_stiffness) == [10.0, 10.0, 1e8, 2e8]


def test_chains_of_rigid_shafts_are_one_group():
    train = shafted()
    shafts = (Shaft(gears=(3, 2)), Shaft(gears=(2, 1)))
    gears = tuple(replace(g, teeth=20, base_radius=0.03) for g in train.gears)
    joined = Train(gears=gears, meshes=train.meshes[:1], shafts=shafts)
    assert rigid_groups(joined) == [(0,), (1, 2, 3)]


def test_bearings_on_a_shaft_need_every_mass():
    train = shafted(second=(1e8, 1e8))
    gears = list(train.gears)
    gears[2] = replace(gears[2], mass=None)
    with pytest.raises(TrainError, match="gear 'c': mass is needed"):
        train_coordinates(replace(train, gears=tuple(gears)))
