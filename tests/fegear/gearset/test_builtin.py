"""The built-in gear sets against the figures that their source prints."""

from __future__ import annotations

import math
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from fegear.commands.show.derived import gear_set_figures
from fegear.gearset import Shaft, builtin_names, load_gear_set
from fegear.gearset.lumped_train import train_of
from fegear.gearset.power_path import mesh_torques_at
from fegear.statics.settings import StaticsSettings
from fegear.statics.solving import solve_mesh
from lumped.train.modes import natural_modes

OF_SOURCE = [name for name in builtin_names() if name.startswith("liu-")]


def test_names():
    assert builtin_names() == [
        "helical-machine",
        "liu-countershaft",
        "liu-countershaft-2",
        "liu-friction",
        "liu-idler",
        "liu-idler-small-hubs",
        "liu-pair",
        "planetary-24-36-96",
        "turbo-pair",
    ]


@pytest.mark.parametrize("name", OF_SOURCE)
def test_every_set_states_what_is_inferred(name):
    gear_set = load_gear_set(name)
    assert gear_set.name == name
    text = " ".join(gear_set.inferences)
    for word in ("hub radii", "tip radii", "dedendum", "not printed"):
        assert word in text


def test_idler_base_radii_and_contact_ratios():
    figures = gear_set_figures(load_gear_set("liu-idler"))
    radii = [round(gear["base_radius_mm"], 2) for gear in figures["gears"]]
    assert radii == [45.35, 65.64, 112.18]
    ratios = [mesh["contact_ratio"] for mesh in figures["meshes"]]
    assert ratios == pytest.approx([1.504, 1.510], abs=1e-9)
    angles = [mesh["operating_pressure_angle_deg"] for mesh in figures["meshes"]]
    assert angles == pytest.approx([21.22, 21.02])
    assert [gear["face_width_mm"] for gear in figures["gears"]] == pytest.approx(
        [20.4] * 3
    )


@pytest.mark.parametrize(
    ("name", "variations"),
    [
        ("liu-idler", (0.35, 0.40)),
        ("liu-pair", (0.35,)),
        ("liu-countershaft", (None, None)),
    ],
)
def test_identified_gears_have_the_printed_mesh_stiffness(name, variations):
    """Tables 2.1, 4.1 and 5.1, at 100 N m on the input gear."""
    gear_set = load_gear_set(name)
    settings = StaticsSettings(estimate_error=False)
    torques = mesh_torques_at(gear_set, 100.0)
    for m, (torque, printed) in enumerate(zip(torques, variations, strict=True)):
        table = solve_mesh(gear_set, m + 1, [torque], settings).table
        k = table["stiffness_N_per_m"][0]
        assert k.mean() == pytest.approx(gear_set.meshes[m].mean_stiffness, rel=0.02)
        if printed is not None:
            assert np.ptp(k) / k.mean() == pytest.approx(printed, abs=0.025)


@pytest.mark.parametrize("name", builtin_names())
def test_rims_are_two_modules_thick_or_more(name):
    for gear in load_gear_set(name).gears:
        teeth = gear.geometry
        assert teeth.root_radius - teeth.hub_radius > 2.0 * teeth.module


def test_small_hubs_differ_from_the_idler_set_in_width_and_hubs_alone():
    small, usual = load_gear_set("liu-idler-small-hubs"), load_gear_set("liu-idler")
    for one, two in zip(small.gears, usual.gears, strict=True):
        hub = replace(one.geometry, hub_radius=two.geometry.hub_radius)
        assert replace(one, geometry=hub, face_width=two.face_width) == two
        assert one.geometry.hub_radius < two.geometry.hub_radius


def test_idler_torques_balance_the_printed_ones():
    gear_set = load_gear_set("liu-idler")
    at_100 = gear_set.meshes[0].torques.index(100.0)
    torque = gear_set.meshes[1].torques[at_100] * 94 / 55
    assert torque == pytest.approx(247.0, abs=0.5)


def test_idler_inertias_and_masses_of_table_2_1():
    gears = load_gear_set("liu-idler").gears
    assert [gear.inertia for gear in gears] == [0.002621, 0.01091, 0.1193]
    assert [gear.mass for gear in gears] == [2.2325, 4.4380, 16.9419]


def test_path_of_contact_agrees_with_the_printed_switching_points():
    """Figure 2.2: the first pair leaves at 0.78, the second enters at 0.26."""
    mesh = gear_set_figures(load_gear_set("liu-idler"))["meshes"][0]
    assert mesh["recess_pitches"] == pytest.approx(0.78, abs=0.02)
    assert 1.0 - mesh["approach_pitches"] == pytest.approx(0.26, abs=0.005)


def test_centres_in_line_give_nearly_the_printed_phase():
    """Table 2.1 prints phase 0; an idler of 55 teeth between centres in a row."""
    mesh = gear_set_figures(load_gear_set("liu-idler"))["meshes"][1]
    assert mesh["geometric_phase_pitches"] == pytest.approx(0.0, abs=0.06)
    assert mesh["phase_pitches"] == 0.0


def test_pair_is_the_first_mesh_of_the_idler_set():
    """But for its own stiffness figures, and for bearings, which are not printed."""
    pair, train = load_gear_set("liu-pair"), load_gear_set("liu-idler")
    stiffness = {"mean_stiffness": 2.98e8, "load_share": 0.6}
    assert pair.meshes[0] == replace(train.meshes[0], **stiffness)
    free = {"bearing_stiffness": None, "coupling_stiffness": 0.0}
    assert pair.gears == tuple(replace(gear, **free) for gear in train.gears[:2])


def test_countershaft_table_4_1():
    gear_set = load_gear_set("liu-countershaft")
    assert [gear.geometry.teeth for gear in gear_set.gears] == [51, 72, 19, 73]
    widths = [round(1e3 * gear.face_width, 6) for gear in gear_set.gears]
    assert widths == [22.5, 29.0, 20.0, 20.0]
    ratios = [mesh.pair.contact_ratio for mesh in gear_set.meshes]
    assert ratios == pytest.approx([1.60, 1.70], abs=1e-9)
    radians = 2.0 * math.pi * gear_set.meshes[1].phase
    assert radians == pytest.approx(0.257, abs=1e-4)
    assert gear_set.shafts == (Shaft(gears=(1, 2), stiffness=None),)
    means = [mesh.mean_stiffness for mesh in gear_set.meshes]
    assert means == [4.24e8, 3.45e8]


def test_idler_bearings_couplings_and_stiffness_of_table_2_1():
    gear_set = load_gear_set("liu-idler")
    bearings = [gear.bearing_stiffness for gear in gear_set.gears]
    assert bearings == [(1.27e8,) * 2, (1.4732e8,) * 2, (1.6637e8,) * 2]
    couplings = [gear.coupling_stiffness for gear in gear_set.gears]
    assert couplings == [3389.6, 0.0, 11297.9]
    means = [mesh.mean_stiffness for mesh in gear_set.meshes]
    assert means == [2.9831e8, 3.2108e8]
    assert [mesh.stiffness_variation for mesh in gear_set.meshes] == [0.35, 0.40]


@pytest.mark.parametrize("name", OF_SOURCE)
def test_damping_is_marked_as_inferred_or_printed(name):
    gear_set = load_gear_set(name)
    ratio = 0.001 if name == "liu-friction" else 0.04
    assert gear_set.damping_ratio == ratio
    assert any(f"damping ratio {ratio}" in text for text in gear_set.inferences)


@pytest.mark.parametrize(
    "edits",
    [
        {},
        {
            "gear.middle-2.teeth": 55,
            "gear.output.teeth": 94,
            "gear.middle-2.module_mm": 2.54,
            "gear.output.module_mm": 2.54,
        },
    ],
    ids=["3/5", "1/2"],
)
def test_second_countershaft_has_the_printed_frequencies(edits):
    """Section 4.3.2: ratios of natural frequencies, and which mesh leads a mode."""
    gear_set = load_gear_set("liu-countershaft-2", edits)
    train = train_of(gear_set, 100.0)
    modes = natural_modes(train, [mesh.mean_stiffness for mesh in gear_set.meshes])
    elastic = modes.frequency_Hz[1:]
    assert elastic / elastic[0] == pytest.approx([1.0, 2.34, 3.29], abs=5e-3)
    assert modes.mesh_energy[:, 2:].argmax(axis=0).tolist() == [1, 0]
    rate = Fraction(1, 2) if edits else Fraction(3, 5)
    assert train.mesh_rates == (1, rate)
