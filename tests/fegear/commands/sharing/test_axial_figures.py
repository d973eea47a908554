"""Axial forces and tilting moments of planets by their share of the load."""

from __future__ import annotations

import numpy as np
import pytest

from fegear.commands.sharing.study import planet_rows
from fegear.commands.show.force_values import force_figures
from fegear.gearset import load_gear_set
from lumped.train.load_sharing import LoadSharing

SHARES = np.array([0.2, 0.3, 0.5])


def shared(gears, torque):
    """A load sharing with the forces of the set's torque on the sun [N m]."""
    force = torque * SHARES / gears.meshes[0].pair.driver_arm
    return LoadSharing(
        sun_force=force, ring_force=force, share=SHARES, share_peak=SHARES
    )


def test_planets_are_tilted_by_their_share_of_the_load():
    """By the forces of `show`, which are those of equal planets."""
    gears = load_gear_set("planetary-24-36-96", {"defaults.helix_angle_deg": 15.0})
    equal = {row["gears"][0]: row for row in force_figures(gears)["axis_forces"]}
    moment = equal["planet-1"]["tilting_moments_x_Nm"][1]
    sun = equal["sun"]["axial_forces_N"][1]
    rows = planet_rows(shared(gears, 60.0), gears)
    for row, share in zip(rows, SHARES, strict=True):
        assert row["tilting_moment_Nm"] == pytest.approx(3.0 * share * moment)
        assert row["sun_axial_force_N"] == pytest.approx(-share * sun)
        assert row["ring_axial_force_N"] == pytest.approx(share * sun)


def test_spur_planets_have_no_axial_forces():
    gears = load_gear_set("planetary-24-36-96")
    (row, *_) = planet_rows(shared(gears, 60.0), gears)
    assert not {name for name in row if "axial" in name or "tilting" in name}
