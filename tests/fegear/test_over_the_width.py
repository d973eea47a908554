"""Tables of helical gears and misaligned ones: command, models, refusals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import fegear
from fegear.files.errors import InputError
from fegear.statics.table_warnings import table_warnings

HELICAL = {
    "name": "helical",
    "defaults": {"module_mm": 3.0, "helix_angle_deg": 18.0, "face_width_mm": 20.0},
    "gear": [
        {"name": "one", "teeth": 18, "hub_radius_mm": 14.0, "tooth_thinning_um": 60.0},
        {"name": "two", "teeth": 25, "hub_radius_mm": 18.0},
    ],
    "mesh": [{"driver": "one", "driven": "two", "backlash_um": 60.0}],
    "load": {"gear": "one", "torques_Nm": [60.0, 120.0]},
    "dynamics": {"damping_ratio": 0.05},
}
COARSE = fegear.StaticsSettings(positions=8, resolution="coarse", root_stress=False)


@pytest.fixture(scope="module")
def solved():
    return fegear.solve_mesh(fegear.make_gear_set(HELICAL), settings=COARSE)


@pytest.mark.slow
def test_a_table_has_what_the_section_does_not_show(solved):
    figures = solved.key_figures
    assert figures[0]["overlap_ratio"] == pytest.approx(
        20.0 * np.sin(np.radians(18.0)) / (3.0 * np.pi), rel=1e-6
    )
    force = solved.cycle.load.sum(axis=2)
    helix = solved.problem.pair.driver.base_helix_angle
    axial = solved.table["axial_force_N"]
    assert axial == pytest.approx(force * np.tan(abs(helix)), rel=1e-9)
    assert np.abs(solved.table["load_center_mm"]).max() < 5.0
    assert solved.table.header["plane"] == "width"
    assert "driver_root_stress_Pa" not in solved.table.columns
    errors = [error.distribution for error in solved.errors]
    assert np.isfinite(errors).all()
    assert max(errors) > 0.0
    ratio = figures[1]["mean_stiffness_N_per_m"] / figures[0]["mean_stiffness_N_per_m"]
    assert 1.0 < ratio < 1.1


@pytest.mark.slow
def test_the_other_hand_mirrors_the_width(solved):
    one, two = HELICAL["gear"]
    left = {**HELICAL, "gear": [{**one, "hand": "left"}, two]}
    mirrored = fegear.solve_mesh(fegear.make_gear_set(left), settings=COARSE)
    assert mirrored.cycle.ste == pytest.approx(solved.cycle.ste, rel=1e-9)
    centers = mirrored.table["load_center_mm"], solved.table["load_center_mm"]
    assert centers[0] == pytest.approx(-centers[1], abs=1e-6)


@pytest.mark.slow
def test_loads_of_pairs_follow_from_gaps_and_compliances(solved):
    """Pair loads times pair stiffness is what a lumped mesh takes."""
    loaded = solved.cycle.load > 0.0
    deflection = (solved.cycle.ste[..., None] - solved.cycle.gap)[loaded]
    carried = solved.cycle.pair_stiffness[loaded] * deflection
    assert carried == pytest.approx(solved.cycle.load[loaded], rel=1e-9)
    names = [name for name in solved.table.columns if name.endswith("m_per_N")]
    assert names
    for name in names:
        values = solved.table[name]
        assert np.nanmax(np.abs(values)) < 1e-8


@pytest.mark.slow
@pytest.mark.parametrize("number", [1, 2, 3, "coupled"])
def test_models_take_the_table(number):
    study = fegear.Sweep(
        gear_set=fegear.make_gear_set(HELICAL),
        torque=(120.0,),
        speeds=(2500.0,),
        model=fegear.LumpedModel(
            number=number,
            excitation=fegear.ExcitationSettings(resolution="coarse", positions=16),
        ),
    )
    rows = fegear.run(study).table
    assert len(list(rows.rows())) == 2  # up and down


@pytest.mark.slow
def test_wide_teeth_are_warned_of(solved):
    assert not [line for line in table_warnings(solved) if "W57" in line]
    face = solved.problem.face
    kernel = replace(face.driver.kernel, width=60e-3)
    wide = replace(face, driver=replace(face.driver, kernel=kernel))
    result = replace(solved, problem=replace(solved.problem, face=wide))
    (line,) = [line for line in table_warnings(result) if "W57" in line]
    assert "face width of 19 modules; above 16" in line


def test_what_is_not_known_is_refused_before_it_is_solved():
    gears = fegear.make_gear_set(HELICAL)
    stress = fegear.StaticsSettings(plane="stress")
    with pytest.raises(InputError, match="plane = stress; must be width, it has hel"):
        fegear.solve_mesh(gears, settings=stress)
    with pytest.raises(InputError, match="body = free; must be held"):
        fegear.solve_mesh(gears, settings=fegear.StaticsSettings(body="free"))
    faulty = fegear.make_gear_set(HELICAL, {"gear.1.eccentricity_um": 5.0})
    with pytest.raises(InputError, match="faults are not known of helical gears"):
        fegear.solve_mesh(faulty)
    for study in (
        fegear.Dynamics(gear_set=gears, speeds=(1000.0,)),
        fegear.FlankWear(gear_set=gears),
        fegear.Tolerances(gear_set=gears),
    ):
        with pytest.raises(InputError, match='"one" and "two" are helical; allowed'):
            fegear.run(study)
