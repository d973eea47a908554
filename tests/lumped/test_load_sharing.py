"""Load sharing of planets with position errors, against closed forms of statics.

With constant stiffnesses and central members whose axes are fixed, the path of planet i
from sun to ring is a spring k, 1/k = 1/k_s + 1/k_r + 4 cos(alpha)^2 / k_p, behind a gap
G_i = 2 e_i cos(alpha): the forces k max(S - G_i, 0) add up to the torque of the sun
over its base radius.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import lumped
from lumped.train import equilibrium
from lumped.train.bodies import TrainError
from lumped.train.coordinates import train_coordinates
from lumped.train.equilibrium import mesh_forces_at_rest
from lumped.train.excitation import MeshExcitation, PairExcitation
from lumped.train.load_sharing import load_sharing, planet_meshes
from lumped.train.position_errors import position_gaps, with_gap
from lumped.train.waves import Wave

ALPHA = math.radians(22.0)
SUN, PLANET, RING = 24e-3, 36e-3, 96e-3  # base radii [m]
CENTERS = (SUN + PLANET) / math.cos(ALPHA)
SUN_MESH, RING_MESH, PIN = 3e8, 4e8, 2e8  # N/m
TORQUE = 100.0  # N m


def planetary(count: int, load: float = TORQUE, **bearings: float) -> lumped.Train:
    """Sun drives with the torque `load`, carrier is driven, ring is held.

    bearings : stiffness by member [N/m]
    """

    def support(member: str) -> dict:
        stiffness = bearings.get(member)
        return {} if stiffness is None else {"bearing_stiffness": (stiffness,) * 2}

    def gear(name: str, radius: float, torque: float = 0.0, held=False) -> lumped.Gear:
        member = name.partition("-")[0]
        return lumped.Gear(
            name=name,
            teeth=round(1e3 * abs(radius)),
            base_radius=radius,
            inertia=1e-3,
            mass=1.0,
            torque=torque,
            is_held=held,
            **support(member),
        )

    angles = [2.0 * math.pi * n / count for n in range(count)]
    meshes = []
    for n, angle in enumerate(angles, start=1):
        ends = (0, n, angle), (n, count + 1, angle + math.pi)
        meshes += [
            lumped.Mesh(driver=a, driven=b, pressure_angle=ALPHA, center_line=line)
            for a, b, line in ends
        ]
    return lumped.Train(
        gears=(
            gear("sun", SUN, load),
            *(gear(f"planet-{n + 1}", PLANET) for n in range(count)),
            gear("ring", -RING, held=True),
        ),
        meshes=tuple(meshes),
        carrier=lumped.Carrier(
            name="carrier",
            gears=tuple(range(1, count + 1)),
            radius=CENTERS,
            angles=tuple(angles),
            inertia=1e-2,
            mass=2.0,
            torque=-load * (SUN + RING) / SUN,
            **support("carrier"),
        ),
    )


def constant(value: float) -> Wave:
    return Wave(np.array([0.0, 1.0]), np.array([[value, 0.0, 0.0, 0.0]]))


def system_at(train: lumped.Train, errors) -> lumped.LumpedSystem:
    gaps = position_gaps(train, errors)
    stiffnesses = [SUN_MESH, RING_MESH] * (len(train.meshes) // 2)
    excitations = tuple(
        with_gap(MeshExcitation((PairExcitation(constant(k), constant(0.0)),), k), gap)
        for k, gap in zip(stiffnesses, gaps, strict=True)
    )
    return lumped.LumpedSystem(train, excitations)


def shares(train: lumped.Train, errors) -> np.ndarray:
    """Load shares at rest by the model."""
    sharing = load_sharing(train, mesh_forces_at_rest(system_at(train, errors)))
    force = TORQUE / SUN
    assert sharing.sun_force.sum() == pytest.approx(force, rel=1e-9)
    assert sharing.ring_force == pytest.approx(sharing.sun_force, abs=1e-6 * force)
    assert sharing.share.sum() == pytest.approx(1.0, abs=1e-12)
    assert sharing.share_peak == pytest.approx(sharing.share, abs=1e-9)
    return sharing.share


def path_stiffness(pin: float = math.inf) -> float:
    flexibility = 1.0 / SUN_MESH + 1.0 / RING_MESH + 4.0 * math.cos(ALPHA) ** 2 / pin
    return 1.0 / flexibility


def shares_of_springs(errors, pin: float = math.inf) -> np.ndarray:
    """Shares of one-sided springs in parallel, by adding planets as they touch."""
    gaps, k = 2.0 * math.cos(ALPHA) * np.asarray(errors), path_stiffness(pin)
    force, ordered = TORQUE / SUN, np.sort(gaps)
    for touching in range(1, gaps.size + 1):
        closing = (force / k + ordered[:touching].sum()) / touching
        if touching == gaps.size or closing <= ordered[touching]:
            break
    return k * np.maximum(closing - gaps, 0.0) / force


@pytest.mark.parametrize("count", [2, 3, 4, 5, 6])
@pytest.mark.parametrize("bearings", [{}, {"sun": 1e8, "planet": 2e8, "carrier": 5e8}])
def test_equal_planets_share_equally(count, bearings):
    train = planetary(count, **bearings)
    equal = np.full(count, 1.0 / count)
    assert shares(train, ()) == pytest.approx(equal, abs=1e-9)
    # all pins alike rotate the carrier and change nothing else
    assert shares(train, [20e-6] * count) == pytest.approx(equal, abs=1e-9)


@pytest.mark.parametrize("pin", [None, PIN])
def test_shares_of_loaded_planets_are_linear_in_their_errors(pin):
    """share_i = 1/N - 2 k cos(alpha) (e_i - mean e) r_s / T."""
    errors = np.array([0.0, 2e-6, -1e-6, 1.5e-6])
    k = path_stiffness(pin or math.inf)
    factor = 2.0 * k * math.cos(ALPHA) * SUN / TORQUE
    expected = 0.25 - factor * (errors - errors.mean())
    assert expected.min() > 0.0
    train = planetary(4) if pin is None else planetary(4, planet=pin)
    assert shares(train, errors) == pytest.approx(expected, rel=1e-6)


@settings(max_examples=40, deadline=None, derandomize=True)
@given(
    errors=st.lists(st.floats(-60e-6, 60e-6), min_size=2, max_size=6),
    on_pins=st.booleans(),
)
def test_planets_lose_contact_as_springs_behind_gaps_do(errors, on_pins):
    train = planetary(len(errors), **({"planet": PIN} if on_pins else {}))
    expected = shares_of_springs(errors, PIN if on_pins else math.inf)
    assert shares(train, errors) == pytest.approx(expected, abs=1e-7)


def test_a_planet_behind_a_large_gap_carries_nothing():
    assert shares(planetary(3), [0.0, 50e-6, 0.0]) == pytest.approx(
        [0.5, 0.0, 0.5], abs=1e-9
    )
    assert shares(planetary(3), [0.0, -50e-6, 0.0]) == pytest.approx(
        [0.0, 1.0, 0.0], abs=1e-9
    )


@pytest.mark.parametrize("errors", [(0.0, 20e-6, 0.0), (10e-6, -30e-6, 5e-6)])
def test_three_planets_of_a_floating_sun_share_equally(errors):
    """Three forces at 120 degrees balance where they are equal, whatever the errors.

    What is left is the force of the bearing, which is in proportion to its stiffness.
    """
    left = [
        np.abs(shares(planetary(3, sun=stiffness), errors) - 1.0 / 3.0).max()
        for stiffness in (1e3, 1e4)
    ]
    assert left[0] < 1e-5
    assert left[1] / left[0] == pytest.approx(10.0, rel=1e-2)


def test_four_planets_of_a_floating_sun_share_in_opposite_pairs():
    """F1 = F3 and F2 = F4, each by the mean gap of the two."""
    errors = np.array([0.0, 3e-6, 1e-6, -1e-6])
    pairs = 0.5 * (errors + np.roll(errors, 2))
    factor = 2.0 * path_stiffness() * math.cos(ALPHA) * SUN / TORQUE
    expected = 0.25 - factor * (pairs - pairs.mean())
    assert shares(planetary(4, sun=1.0), errors) == pytest.approx(expected, rel=1e-6)


SUN_BEARINGS = None, 1e-3, 1.0, 1e4, 1e8  # N/m


def supported(seed: int) -> tuple[int, dict[str, float], np.ndarray]:
    """Number of planets, bearings, and position errors [m] of a random set."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(2, 7))
    bearings = {
        "sun": SUN_BEARINGS[seed % len(SUN_BEARINGS)],
        "planet": rng.choice([None, PIN]),
        "carrier": rng.choice([None, 5e8]),
    }
    present = {name: value for name, value in bearings.items() if value is not None}
    return count, present, rng.uniform(-60e-6, 60e-6, count)


@pytest.mark.parametrize("seed", range(60))
def test_forces_at_rest_do_not_depend_on_round_off(seed, monkeypatch):
    """Nor do they where springs have none, as a sun that hardly has a bearing."""
    count, bearings, errors = supported(seed)
    train = planetary(count, **bearings)
    expected = mesh_forces_at_rest(system_at(train, errors))
    rng = np.random.default_rng(seed)
    rounded = 0

    def springs_with_round_off(system):
        nonlocal rounded
        rounded += 1
        springs = springs_of(system)
        noise = rng.uniform(-1.0, 1.0, springs.stiffness.shape)
        noise *= 1e-15 * np.abs(springs.stiffness).max()
        return replace(springs, stiffness=springs.stiffness + 0.5 * (noise + noise.T))

    springs_of = equilibrium._springs
    monkeypatch.setattr(equilibrium, "_springs", springs_with_round_off)
    force = mesh_forces_at_rest(system_at(train, errors))
    assert rounded == 1
    assert force == pytest.approx(expected, abs=1e-6 * TORQUE / SUN)


@pytest.mark.parametrize("seed", range(60))
def test_forces_at_rest_are_in_proportion_to_loads_and_gaps(seed):
    count, bearings, errors = supported(seed)
    expected = mesh_forces_at_rest(system_at(planetary(count, **bearings), errors))
    lighter = planetary(count, load=1e-3 * TORQUE, **bearings)
    force = mesh_forces_at_rest(system_at(lighter, 1e-3 * errors))
    assert 1e3 * force == pytest.approx(expected, abs=1e-6 * TORQUE / SUN)


def test_gaps_are_those_that_a_rotation_of_the_carrier_opens():
    """All pins displaced by r phi are the carrier rotated by phi."""
    train, rotation = planetary(5), 1e-4
    coordinates = train_coordinates(train)
    column = coordinates.indices[len(train.gears), "rotation"]
    errors = [CENTERS * rotation] * 5
    expected = -rotation * coordinates.mesh_rows[:, column]
    assert position_gaps(train, errors) == pytest.approx(expected, rel=1e-12)
    assert position_gaps(train, errors) == pytest.approx(
        errors[0] * math.cos(ALPHA), rel=1e-12
    )


def test_a_gap_moves_the_back_flanks_with_the_drive_flanks():
    """Backlash of a mesh stays: teeth that leave one side come nearer on the other."""
    wave = constant(3e-6)
    pair = PairExcitation(constant(1e8), wave)
    excitation = with_gap(MeshExcitation((pair,), 1e8), 5e-6)
    assert excitation.pairs[0].gap([0.0, 0.5]) == pytest.approx([8e-6, 8e-6])
    assert wave([0.0]) == pytest.approx([3e-6])


def test_shares_over_times_weigh_each_with_its_span():
    train = planetary(2)
    time = np.array([0.0, 1.0, 4.0])
    force = np.zeros((3, 4))
    force[:, 0], force[:, 2] = [2.0, 0.0, 0.0], [1.0, 1.0, 1.0]
    sharing = load_sharing(train, force, time)
    assert sharing.sun_force == pytest.approx([0.25, 1.0])
    assert sharing.share == pytest.approx([0.2, 0.8])
    assert sharing.share_peak == pytest.approx([1.6, 0.8])
    assert np.isnan(load_sharing(train, 0.0 * force).share).all()


def test_errors_and_planets_that_do_not_fit_are_refused():
    train = planetary(3)
    with pytest.raises(TrainError, match="2 for 3 gears on a carrier"):
        position_gaps(train, [0.0, 1e-6])
    pair = lumped.Train(
        gears=train.gears[:2],
        meshes=(lumped.Mesh(driver=0, driven=1, pressure_angle=ALPHA),),
    )
    with pytest.raises(TrainError, match="1 for 0 gears on a carrier"):
        position_gaps(pair, [1e-6])
    with pytest.raises(TrainError, match="there is none"):
        planet_meshes(pair)
