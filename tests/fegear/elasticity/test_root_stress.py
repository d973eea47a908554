"""Root stress from influences, against the stress field of the whole sector."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import make_gear
from sector_stress import sector_stress
from slow_tests import first_are_quick

from fegear.contact.loads import patch_loads, tooth_loads
from fegear.elasticity.cache import cached_root_influence
from fegear.elasticity.material import PlaneMaterial
from fegear.elasticity.root_stress import MAX_TOOTH_OFFSET, FlankLoad, root_influence
from fegear.elasticity.sector import LEFT, RIGHT, CyclicSector
from fegear.gearset import load_gear_set
from fegear.statics.contact_problem import contact_problem
from fegear.statics.settings import StaticsSettings
from meshes import MeshSize

STEEL = PlaneMaterial(206e9, 0.3, "stress")
OTHER = {RIGHT: LEFT, LEFT: RIGHT}
GEARS = ("driver", "driven")


@pytest.fixture(scope="module")
def liu_pair(compliance_cache):
    """Contact problem of the gear set, with friction."""
    settings = StaticsSettings(friction=0.1)
    return contact_problem(load_gear_set("liu-pair"), 0, settings)


@pytest.fixture(scope="module")
def influences(liu_pair):
    return {
        gear: root_influence(CyclicSector(getattr(liu_pair.pair, gear), STEEL))
        for gear in GEARS
    }


@pytest.fixture(scope="module")
def influence(influences):
    return influences["driver"]


def lumped_loads(loads) -> list[FlankLoad]:
    """Patches of the statics as point loads at their centres, on right flanks."""
    return [
        FlankLoad(
            load.tooth,
            RIGHT,
            load.normal @ load.arcs / load.normal.sum(),
            load.normal.sum(),
            load.rootward.sum(),
        )
        for load in loads
    ]


@pytest.mark.parametrize("gear", GEARS)
@pytest.mark.parametrize("position", first_are_quick([0.15, -0.5, 0.0, 0.5, 0.75], 1))
def test_static_loads_give_the_stress_of_the_field(
    liu_pair, influences, gear, position
):
    """That of nodes on a finer mesh, where its own error is about 0.5 %."""
    loads = tooth_loads(patch_loads(liu_pair, 100.0, position), gear)
    fine = MeshSize().refined(2.0)
    field = sector_stress(getattr(liu_pair.pair, gear), STEEL, loads, fine)
    stress = influences[gear].stress(lumped_loads(loads))
    assert stress == pytest.approx(field.root_stress, rel=0.012)
    nodes = np.unique(field.sector.mesh.edges["fillet"])
    right = field.components[nodes, :2].sum(axis=1)
    along = influences[gear].along_fillets(lumped_loads(loads))[0]
    assert along.max() == pytest.approx(right.max(), rel=0.012)
    assert along.min() >= right.min() - 0.03 * right.max()


def largest_tensions(gear, factor):
    """Root stress under a load at four places of the flank, friction among it."""
    influence = root_influence(CyclicSector(gear, STEEL, MeshSize().refined(factor)))
    arcs = np.array([0.02, 0.2, 0.5, 0.8]) * gear.flank_length
    return influence.stress([FlankLoad(0, RIGHT, arcs, 1e5, 5e3)])


@pytest.mark.slow
@pytest.mark.parametrize(("teeth", "shift"), [(10, 0.5), (17, 0.2), (30, -0.3)])
def test_root_stress_converges_at_second_order(teeth, shift):
    gear = make_gear(teeth, 0.6e-3 * teeth, profile_shift=shift)
    exact, *others = (largest_tensions(gear, factor) for factor in (6.0, 0.5, 1.0, 2.0))
    errors = [np.abs(values / exact - 1.0).max() for values in others]
    assert errors[1] < 0.01
    assert 0.5 * np.log2(errors[0] / errors[2]) > 1.5


def test_an_influence_is_read_from_the_cache_as_it_was(pinion, compliance_cache):
    coarse = MeshSize().refined(0.5)
    computed, read = (cached_root_influence(pinion, STEEL, coarse) for _ in range(2))
    assert computed is not read
    load = FlankLoad(0, RIGHT, 1e-3, 1e5, 1e4)
    assert (computed.along_fillets([load]) == read.along_fillets([load])).all()


def test_stress_is_linear_in_the_loads(influence):
    arc = 0.4 * influence.arcs[-1]
    one, two = FlankLoad(0, RIGHT, arc, 1e5, 1e4), FlankLoad(1, LEFT, arc, 7e4, -2e3)
    parts = [influence.along_fillets([load]) for load in (one, two)]
    both = influence.along_fillets([one, two])
    np.testing.assert_allclose(both, parts[0] + parts[1], rtol=1e-12, atol=1e-6)
    doubled = one._replace(normal=2e5, rootward=2e4)
    assert influence.stress([doubled]) == pytest.approx(2.0 * influence.stress([one]))


@pytest.mark.parametrize("flank", [RIGHT, LEFT])
@pytest.mark.parametrize("tooth", range(-MAX_TOOTH_OFFSET, MAX_TOOTH_OFFSET + 1))
def test_mirrored_loads_stress_the_other_fillet(influence, tooth, flank):
    load = FlankLoad(tooth, flank, 0.3 * influence.arcs[-1], 1e5, 1e4)
    mirrored = load._replace(tooth=-tooth, flank=OTHER[flank])
    one, two = (
        influence.along_fillets([flank_load]) for flank_load in (load, mirrored)
    )
    np.testing.assert_allclose(one, two[::-1], rtol=1e-12)
    assert influence.stress([load]) == influence.stress([mirrored])


@pytest.mark.parametrize("flank", [RIGHT, LEFT])
def test_the_loaded_side_is_in_tension_the_other_compressed(influence, flank):
    load = FlankLoad(0, flank, 0.2 * influence.arcs[-1], 1e5)
    along = influence.along_fillets([load])
    assert along[flank].max() == influence.stress([load])
    assert along[OTHER[flank]].min() < -along[flank].max()  # the push compresses too


def test_loads_matter_less_the_farther_away_they_are(influence):
    arc = 0.5 * influence.arcs[-1]
    load = FlankLoad(0, RIGHT, arc, 1e5)
    alone = influence.stress([load])
    for side in (-1, 1):
        near, far = (load._replace(tooth=side * k) for k in (1, 2))
        changes = [abs(influence.stress([load, x]) / alone - 1.0) for x in (near, far)]
        assert changes[1] < changes[0] < 0.15
        assert changes[1] < 0.06
        assert influence.stress([far]) < 0.15 * alone
    neglected = load._replace(tooth=MAX_TOOTH_OFFSET + 1)
    assert influence.stress([load, neglected]) == alone


def test_teeth_count_around_the_gear(influence):
    load = FlankLoad(-1, RIGHT, 0.5 * influence.arcs[-1], 1e5)
    around = load._replace(tooth=-1 + 3 * influence.gear.teeth)
    assert influence.stress([load]) == influence.stress([around])


def test_time_is_vectorised(influence):
    arcs = np.linspace(0.1, 0.9, 7) * influence.arcs[-1]
    loads = np.linspace(0.0, 1e5, 7)
    fixed = FlankLoad(1, RIGHT, 0.5 * influence.arcs[-1], 5e4)
    stress = influence.stress([FlankLoad(0, LEFT, arcs, loads, 0.1 * loads), fixed])
    single = [
        influence.stress([FlankLoad(0, LEFT, arc, load, 0.1 * load), fixed])
        for arc, load in zip(arcs, loads, strict=True)
    ]
    assert stress.shape == (7,)
    np.testing.assert_allclose(stress, single, rtol=1e-12)


def test_loads_at_both_ends_of_the_flank_are_finite(influence):
    ends = np.array([0.0, influence.arcs[-1]])
    along = influence.along_fillets([FlankLoad(0, RIGHT, ends, 1e5, 1e4)])
    assert np.isfinite(along).all()
    assert (along.max(axis=(1, 2)) > 0.0).all()


def test_no_load_is_no_stress_and_a_wrong_flank_is_named(influence):
    assert influence.stress([]) == 0.0
    assert influence.stress([FlankLoad(0, RIGHT, 1e-3, 0.0)]) == 0.0
    with pytest.raises(ValueError, match="flank = 2; must be 0 or 1"):
        influence.stress([FlankLoad(0, 2, 1e-3, 1.0)])
