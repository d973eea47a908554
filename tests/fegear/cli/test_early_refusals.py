"""What settings and gear set alone decide is refused before anything is computed."""

from __future__ import annotations

from pathlib import Path

import pytest
from cli_commands import refused
from nothing_computed import arguments_of, nothing_is_computed

__all__ = ["nothing_is_computed"]

HELICAL = """\
name = "helical"
[defaults]
module_mm = 2.5
helix_angle_deg = 20
face_width_mm = 30
[[gear]]
name = "one"
teeth = 15
hub_diameter_mm = 20
[[gear]]
name = "two"
teeth = 45
hub_diameter_mm = 60
[[mesh]]
driver = "one"
driven = "two"
center_distance_mm = 80
[load]
gear = "one"
torques_Nm = [100]
"""
CASE = """\
name = "case"
title = "A case"
gear_set = "set.toml"
torques_Nm = [100.0]
speeds_Hz = "1000:2000:500"
fidelity = "reduced"
[[model]]
number = 1
[[metric]]
name = "rms_distance"
allowed = 0.5
reason = "a test"
"""
PLANE = 'plane = "stress"\n' + HELICAL
CRACKED = HELICAL.replace(
    '"one"\nteeth', '"one"\ncracks = [{ tooth = 1, depth_mm = 1 }]\nteeth'
)
ECCENTRIC = HELICAL.replace('"one"\nteeth', '"one"\neccentricity_um = 5\nteeth')
SPUR = HELICAL.replace("helix_angle_deg = 20\n", "")
SPUR = SPUR.replace("center_distance_mm = 80", "center_distance_mm = 75.2")
LIGHT = SPUR.replace("face_width_mm", "inertia_kg_m2 = 1e-6\nface_width_mm", 1)
WIDE = HELICAL.replace("= 30\n", "= 1200\n")
ELEMENTS = ("sweep", "motion", "signals", "faults", "theory", "map", "branches")
ELEMENTS += ("bifurcations",)
SOLVED = (
    "tolerances",
    "stiffness",
    "compare",
    "relief",
    "rattle gears",
    "export",
    "modes",
    "wear",
)
SOLVED += ("render",)
SOLVED += ELEMENTS
SPUR_ONLY = ("dynamics", "identify", "render --zoom set")
SPUR_ONLY += ("ablation", "validate")
COUPLED = [f"{name} --model coupled" for name in ("sweep", "motion", "signals", "map")]
REFUSED = {
    (HELICAL, "helical; allowed for"): SPUR_ONLY,
    (HELICAL, "friction = 0.1; must be 0, gears"): (
        "stability",
        *(f"{name} --friction 0.1" for name in ("sweep", "motion", "map")),
        "map --over friction=0,0.1",
        "bifurcations --at 1500 --over friction=0,0.1",
    ),
    (PLANE, "plane = stress; must be width, it has helical gears"): SOLVED,
    (CRACKED, "cracks are not known with helical gears"): ("stiffness", *ELEMENTS),
    (ECCENTRIC, "eccentricity_um; not modelled by"): ("relief", "tolerances", "render"),
    (WIDE, "slices of the face width, of an overlap ratio of"): ("export", *ELEMENTS),
    (LIGHT, "is less than the"): COUPLED,
}
CASES = [
    (text, message, command)
    for (text, message), commands in REFUSED.items()
    for command in commands
]


@pytest.mark.parametrize(("text", "message", "command"), CASES)
def test_refused_before_anything_is_computed(capsys, text, message, command):
    Path("set.toml").write_text(text, "utf-8")
    Path("case.toml").write_text(CASE, "utf-8")
    error = refused(capsys, *arguments_of(command))
    assert message in error


@pytest.mark.parametrize("command", ["bifurcations --at 1500", "stability"])
def test_values_of_an_axis_are_refused_before_anything_is_computed(capsys, command):
    """Those of a map are points that are impossible, with the reason."""
    Path("set.toml").write_text(SPUR, "utf-8")
    over = " --over gear.one.profile_shift=0,-0.1,3"
    error = refused(capsys, *arguments_of(command + over))
    assert 'gear "one": profile_shift = 3; must be at most' in error


@pytest.mark.parametrize("command", ["stiffness", "export", "rattle gears"])
def test_a_mesh_in_a_refusal_is_no_option(capsys, command):
    Path("set.toml").write_text(PLANE, "utf-8")
    error = refused(capsys, *arguments_of(command))
    assert error.startswith('fegear: mesh "one"-"two": plane = stress; must be width')
