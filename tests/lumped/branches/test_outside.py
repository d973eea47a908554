"""Branches of the idler of chapter 3 beside those of AUTO, an outside code.

AUTO-07p 0.9.2 followed J_i th_i'' + (C th')_i + kc_i th_i + sum_m R_mi F_m = T_i, three
rotations with s = R th, R = [[r1, r2, 0], [0, -r2, -r3]], C of damping ratio 0.04 in
every mode about the mean stiffness k_m, and F_m = k_m(t) e ln(1 + exp(s_m / e)), which
tends to the contact force k_m(t) max(s_m, 0). Cosines came from a Hopf normal form
beside them, its limit cycle of radius 1. Orthogonal collocation of degree 4 on 300
(e = 0.05 um) and 400 (0.025 um) intervals; 200 and 400 agree to 1e-8. Errors
fall with e^2, and the values below are extrapolated to e = 0. The first torus and the
doubling at 1540 Hz, which AUTO steps over, are from its multipliers, interpolated
between points of the branch.
"""

from __future__ import annotations

import pytest

from lumped.branches.branch_settings import BranchSettings
from lumped.branches.motions import SpeedFamily
from lumped.branches.periodic import BranchFinder

# in the order of the branch [Hz]
MAIN = (
    ("fold", 1536.86668),
    ("fold", 1518.33351),
    ("torus", 1518.6735),
    ("torus", 1550.16389),
    ("fold", 1550.95206),
    ("period doubling", 1540.2313),
    ("period doubling", 1323.27387),
    ("fold", 1285.95523),
)
SECOND = 1384.8776  # Hz, period doubling of the branch of twice the period
UNLOST = 3416.968911, 3733.780583  # Hz, doublings of a motion that loses no contact


@pytest.fixture(scope="module")
def train(system, idler):
    inertias = 2.621e-3, 3.27e-3, 0.119
    return system(idler(inertias=inertias), harmonics=3)


def branches(train, low, high, **settings):
    finder = BranchFinder(SpeedFamily(train), (low, high), BranchSettings(**settings))
    finder.from_rest(low)
    finder.doublings()
    return finder.branches


# a long loss of contact leaves more to the harmonics that a doubling lacks
@pytest.mark.slow
@pytest.mark.parametrize(("harmonics", "doubling"), [(20, 2e-4), (40, 2e-5)])
def test_bifurcations_of_the_fundamental_resonance(train, harmonics, doubling):
    main, doubled = branches(train, 1250.0, 1600.0, harmonics=harmonics)
    assert [point.kind for point in main.bifurcations] == [kind for kind, _ in MAIN]
    for point, (kind, exact) in zip(main.bifurcations, MAIN, strict=True):
        within = doubling if kind == "period doubling" else 1e-5
        assert point.frequency == pytest.approx(exact, rel=within), kind
    assert doubled.multiple == 2
    # where it leaves the main branch and comes back to it there is nothing else
    kinds = [point.kind for point in doubled.bifurcations]
    assert kinds == ["period doubling"] * 2
    second = [point.frequency for point in doubled.bifurcations]
    assert min(second) == pytest.approx(SECOND, rel=doubling)


def test_doublings_without_contact_loss(train):
    (main,) = branches(train, 3300.0, 3850.0, period_multiple=1)
    assert [point.kind for point in main.bifurcations] == ["period doubling"] * 2
    frequencies = [point.frequency for point in main.bifurcations]
    assert frequencies == pytest.approx(UNLOST, rel=1e-8)
