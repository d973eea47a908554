"""Error budgets on the screen: values, changes, what is left out, and the picture."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
from drawn_figures import saved_figures
from typer.testing import CliRunner

from fegear.cli import app
from validation.commands.ablation.study import _cell

pytestmark = pytest.mark.slow

EDIT = "gear.1.hub_radius_mm=14"
FAST = "ablation liu-pair --torque 100 --speeds 7000,7100"  # beside an elastic body


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("ablation")


@pytest.fixture(scope="module")
def outputs(folder):
    """(result of the command, figure)."""
    arguments = [*FAST.split(), "--set", EDIT, "--runs", str(folder / "runs")]
    arguments += ["--plot", str(folder / "b.png")]
    with saved_figures() as figures:
        result = CliRunner().invoke(app, arguments, catch_exceptions=False)
    return result, *figures


@pytest.fixture(scope="module")
def printed(outputs):
    return outputs[0]


@pytest.fixture(scope="module")
def values(folder, printed):
    """Of the same runs."""
    arguments = [*FAST.split(), "--set", EDIT, "--runs", str(folder / "runs"), "--json"]
    result = CliRunner().invoke(app, arguments, catch_exceptions=False)
    return json.loads(result.stdout)


def test_the_screen_shows_the_values(printed, values):
    assert printed.exit_code == 0
    assert f"liu-pair, 100 N m, {EDIT.replace('=', ' = ')}" in printed.stdout
    (curve,) = (q for q in values["quantities"] if q["quantity"] == "curve off jumps")
    assert curve["unit"] == "%"
    for model in curve["models"]:
        assert f" {model['largest_error']:.1f}" in printed.stdout
    assert values[f"set {EDIT.split('=')[0]}"] == "14"
    assert values["recommended"] in {model["model"] for model in curve["models"]}
    assert f"{values['recommended']} is the cheapest within 5 %" in printed.stdout
    (warning,) = values["warnings"]  # of the model without them
    assert warning.startswith("model-coupled-without-modes: body modes that")


def test_body_modes_decide_beside_an_elastic_body(values):
    (curve,) = (q for q in values["quantities"] if q["quantity"] == "curve off jumps")
    errors = {model["model"]: model["largest_error"] for model in curve["models"]}
    assert errors["coupled"] < 4.0
    assert errors["without modes"] > 2.0 * errors["coupled"]
    assert errors["model 1"] > 20.0


def test_the_picture_has_the_errors_of_all_models(outputs, values):
    """The largest stands in the line of its model."""
    _, figure = outputs
    panels = {axes.get_title(): axes for axes in figure.axes}
    (curve,) = (q for q in values["quantities"] if q["quantity"] == "curve off jumps")
    axes = panels["curve off jumps [%]"]
    labels = [label.get_text() for label in figure.axes[0].get_yticklabels()]
    assert len(labels) == len(curve["models"])
    points = np.concatenate([line.get_xydata() for line in axes.lines])
    for place, model in enumerate(curve["models"]):
        errors = points[points[:, 1] == place, 0]
        assert np.abs(errors).max() == pytest.approx(model["largest_error"])


def test_a_cell_holds_the_error_and_what_is_missing():
    model = {
        "model": "without body",
        "places": 2,
        "largest_error": 3.14,
        "change_to_coupled": -2.55,
    }
    assert re.fullmatch(r"3\.1 \(-2\.[56]\)", _cell(model))
    assert _cell(model | {"change_to_coupled": -1e-12}) == "3.1 (+0.0)"
    assert _cell(model | {"change_to_coupled": float("nan")}) == "3.1"
    assert _cell(model | {"model": "coupled"}) == "3.1"
    assert _cell(model | {"places": 0}) == "-"
