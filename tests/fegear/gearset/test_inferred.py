"""Centre distance and tips that a gear-set file does not give."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fegear import InputError, make_gear_set
from fegear.commands.show.derived import gear_set_figures


def pair(teeth=(18, 41), shifts=(0.5, 0.3), mesh=None, **keys):
    gears = [
        {"name": name, "teeth": z, "profile_shift": x, "hub_radius_mm": 0.3 * z} | keys
        for name, z, x in zip("ab", teeth, shifts, strict=True)
    ]
    return {
        "name": "own",
        "defaults": {"module_mm": 3.0, "face_width_mm": 20.0},
        "gear": gears,
        "mesh": [{"driver": "a", "driven": "b"} | (mesh or {})],
        "load": {"gear": "a", "torques_Nm": [100.0]},
    }


def ring(shifts=(0.2, 0.1), mesh=None, **keys):
    tables = pair((17, 61), shifts, mesh)
    del tables["gear"][1]["hub_radius_mm"]
    tables["gear"][1] |= {"internal": True, "rim_radius_mm": 105.0, **keys}
    return tables


@pytest.mark.parametrize("seed", range(20))
def test_teeth_at_the_default_distance_have_no_backlash(seed):
    """Recomputed from the thickness of the teeth; external and internal."""
    rng = np.random.default_rng([57, seed])
    shifts = tuple(rng.uniform(0.0, 0.4, 2))
    make = ring if seed % 2 else pair
    gear_set = make_gear_set(make(shifts=shifts))
    (mesh,) = gear_set.meshes
    assert mesh.pair.backlash == pytest.approx(0.0, abs=1e-12)
    (figures,) = gear_set_figures(gear_set)["meshes"]
    assert figures["fitting_profile_shift_sum"] == pytest.approx(sum(shifts))
    distance = figures["fitting_center_distance_mm"]
    assert distance == pytest.approx(figures["center_distance_mm"])
    (line,) = [line for line in gear_set.inferences if "center_distance_mm" in line]
    assert f"center_distance_mm = {distance:.7g} by default" in line
    warnings = gear_set_figures(gear_set)["warnings"]
    assert any("no backlash" in w and w.endswith("[W55]") for w in warnings)


def test_thinned_teeth_have_backlash_at_the_default_distance():
    gear_set = make_gear_set(pair(tooth_thinning_um=50.0))
    expected = 2 * 50.0 * math.cos(math.radians(20.0))
    (figures,) = gear_set_figures(gear_set)["meshes"]
    assert figures["normal_backlash_um"] == pytest.approx(expected, rel=1e-9)
    assert not any("[W55]" in w for w in gear_set_figures(gear_set)["warnings"])


def test_tips_are_shortened_as_in_tables():
    """Clearance of both tips stays a quarter of the module (DIN 3960)."""
    plain = make_gear_set(pair())
    short = make_gear_set(pair(mesh={"tip_shortening": True}))
    for gear_set, clearance in ((plain, 0.558), (short, 0.75)):
        (figures,) = gear_set_figures(gear_set)["meshes"]
        for flank in figures["flanks"]:
            value = flank["tip_root_clearance_mm"]
            assert value == pytest.approx(clearance, abs=5e-4)
    assert short.meshes[0].pair.contact_ratio < plain.meshes[0].pair.contact_ratio
    assert sum("not shortened; tip_shortening" in s for s in plain.inferences) == 2
    assert sum("shortened by 0.1919 mm" in s for s in short.inferences) == 2


def test_shortening_that_changes_nothing_is_refused():
    tables = pair(mesh={"tip_shortening": True}, addendum_mm=3.0)
    with pytest.raises(InputError, match="tip_shortening = true; changes nothing, as"):
        make_gear_set(tables)
    with pytest.raises(InputError, match="tip_shortening = true; is that of external"):
        make_gear_set(ring(mesh={"tip_shortening": True}))


def test_a_sum_of_shifts_that_fits_no_distance_is_refused():
    with pytest.raises(InputError, match=r"the sum of profile shifts -1\.7 fits none"):
        make_gear_set(pair((30, 31), (-0.8, -0.9)))


def test_the_default_tip_of_a_ring_says_why_it_is_short():
    by_cutter = make_gear_set(ring(cutter_teeth=12)).inferences
    by_mate = make_gear_set(ring((0.0, 0.0), cutter_teeth=30)).inferences
    for inferences in (by_cutter, by_mate):
        (line,) = [line for line in inferences if line.startswith('gear "b"')]
        assert "instead of" in line
    reasons = {line.partition("; ")[2] for line in (*by_cutter, *by_mate)}
    assert {r for r in reasons if "cutter" in r or "fillet" in r}


@pytest.mark.parametrize("teeth", [(18, 41), (25, 25)])
def test_torque_on_the_driven_gear_is_divided_by_the_ratio(teeth):
    tables = pair(teeth, (0.0, 0.0))
    tables["load"] = {"gear": "b", "torques_Nm": [100.0, 200.0]}
    gear_set = make_gear_set(tables)
    ratio = teeth[1] / teeth[0]
    assert gear_set.meshes[0].torques == pytest.approx((100 / ratio, 200 / ratio))
    (line,) = [line for line in gear_set.inferences if line.startswith("load:")]
    assert f"divided by the ratio {ratio:.6g}" in line


def test_torque_on_the_output_of_a_counter_shaft():
    """Through both meshes, by hand; a gear in the middle is refused."""
    gears = [
        {"name": name, "teeth": z, "hub_radius_mm": 0.3 * z}
        for name, z in zip("abcd", (20, 60, 25, 50), strict=True)
    ]
    tables = pair() | {
        "gear": gears,
        "mesh": [{"driver": "a", "driven": "b"}, {"driver": "c", "driven": "d"}],
        "shaft": [{"gears": ["b", "c"]}],
        "load": {"gear": "d", "torques_Nm": [600.0]},
    }
    first, second = make_gear_set(tables).meshes
    assert first.torques == pytest.approx((100.0,))
    assert second.torques == pytest.approx((300.0,))
    tables["load"] = {"gear": "b", "torques_Nm": [600.0]}
    with pytest.raises(InputError, match='gear = "b"; must be the driver that no mesh'):
        make_gear_set(tables)
