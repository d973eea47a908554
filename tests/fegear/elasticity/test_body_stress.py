"""Stress of teeth in mesh."""

from __future__ import annotations

import numpy as np
import pytest
from sector_stress import sector_stress

from fegear.contact.loads import patch_loads, tooth_loads
from fegear.elasticity.material import PlaneMaterial
from meshes.profile import roll_length_at_arc

STEEL = PlaneMaterial(206e9, 0.3)


def test_teeth_of_both_gears_are_placed_where_they_touch(problem):
    loads = patch_loads(problem, 100.0, 0.5)
    pair = problem.pair
    for load, driver, driven in zip(
        loads, tooth_loads(loads, "driver"), tooth_loads(loads, "driven"), strict=True
    ):
        middle = pair.pitch_point + (0.5 + load.tooth) * pair.base_pitch
        centre = (load.normal @ driver.arcs) / load.normal.sum()
        s1 = roll_length_at_arc(pair.driver, centre)
        assert s1 == pytest.approx(middle, rel=1e-3)
        assert driver.tooth == load.tooth
        assert driven.tooth == -load.tooth


def test_root_stress_over_the_mesh_cycle_is_that_of_the_field(problem, pinion):
    """Largest under single contact high on the tooth; Lewis's order of size."""
    roots = []
    for position in (0.0, 0.15, 0.5):
        loads = tooth_loads(patch_loads(problem, 100.0, position), "driver")
        roots.append(sector_stress(pinion, STEEL, loads).root_stress)
    assert roots[0] < roots[1]
    assert roots[2] < roots[1]
    nominal = 100.0 / 48.26e-3 / (problem.face_width * pinion.module)
    assert 1.8 < roots[1] / nominal < 3.5


def test_neighbours_load_strains_the_root_little(problem, pinion):
    loads = tooth_loads(patch_loads(problem, 100.0, 0.5), "driver")
    tooth_zero = [load for load in loads if load.tooth == 0]
    both = sector_stress(pinion, STEEL, loads).root_stress
    alone = sector_stress(pinion, STEEL, tooth_zero).root_stress
    assert both == pytest.approx(alone, rel=0.25)
    assert both != alone


def test_von_mises_is_bounded_by_hertz_and_positive(problem, pinion):
    loads = patch_loads(problem, 100.0, 0.0)
    stress = sector_stress(pinion, STEEL, tooth_loads(loads, "driver"))
    peak = loads[0].normal.max() / loads[0].step
    assert np.isfinite(stress.von_mises).all()
    assert (stress.von_mises >= 0.0).all()
    assert stress.von_mises.max() < 1.2 * peak
