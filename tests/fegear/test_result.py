"""Results show themselves in one line, and make frames where pandas is there."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from drawn_figures import are_drawn, axis_labels, saved_figures

import fegear
from lumped.common.short_repr import shown

FAST = fegear.LumpedModel(
    number=1, excitation=fegear.ExcitationSettings(kind="rectangular")
)


@pytest.fixture(scope="module")
def gears():
    return fegear.load_gear_set("liu-pair")


@pytest.fixture(scope="module")
def swept(gears):
    speeds = [2000.0, 2100.0]
    return fegear.run(
        fegear.Sweep(gear_set=gears, torque=[100.0], speeds=speeds, model=FAST)
    )


def test_what_is_shown_is_short(gears, swept):
    coarse = fegear.StaticsSettings(positions=4, resolution="coarse")
    for result in (
        swept,
        fegear.solve_mesh(gears, 1, [100.0], coarse),
        fegear.run(
            fegear.Motion(gear_set=gears, torque=100.0, speed=2000.0, model=FAST)
        ),
        fegear.run(fegear.Theory(gear_set=gears, torque=100.0, model=FAST)),
        fegear.run(fegear.Dynamics(gear_set=gears, torque=[100.0], speeds=[2900.0])),
        fegear.solve_stress(gears, 100.0, settings=coarse),
    ):
        assert repr(result).startswith(f"{type(result).__name__}(")
        assert len(repr(result)) <= 300
    assert repr(swept).startswith("SweepResult(study=<Sweep>, facts=<TrainFacts>, ")


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (1.5, "1.5"),
        (None, "None"),
        ("a" * 50, "'" + "a" * 39 + "..."),
        (np.zeros((2, 3)), "<array 2 x 3>"),
        ([1, 2], "<list of 2>"),
        ({"a": 1}, "<dict of 1>"),
        (object(), "<object>"),
    ],
)
def test_what_fields_show(value, text):
    assert shown(value) == text


def test_without_pandas_a_frame_says_what_to_type(swept, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(ImportError, match=r"pip install 'fegear\[pandas\]'"):
        swept.to_frame()


def test_a_mesh_table_shows_and_draws_itself(gears, tmp_path):
    coarse = fegear.StaticsSettings(positions=4, resolution="coarse")
    torques = [50.0, 100.0]
    study = fegear.MeshStiffness(gear_set=gears, torque=torques, elements=coarse)
    result = fegear.run(study)
    html = result._repr_html_()
    assert html.count("<table>") == 2
    assert html.count("<tr>") == 2 * 3  # names and both torques
    assert 'src="data:image/png;base64,' in html
    path = tmp_path / "table.png"
    with saved_figures() as figures:
        result.draw(path)
    assert axis_labels(*figures) == {
        "mesh stiffness F / (δ - δ₀) [N/um]",
        "static transmission\nerror δ [um]",
        "transmission error\nabout its mean [um]",
        "mesh position [base pitches from the pitch point]",
        "load share [%]\nat 100 N m",
    }
    table = result.solved.table
    for stiffness in 1e-6 * table["stiffness_N_per_m"]:
        points = np.column_stack([table.position, stiffness])
        assert are_drawn(*figures, points)
    with pytest.raises(fegear.InputError, match=r"name must end in \.png"):
        result.draw(tmp_path / "table.jpg")
