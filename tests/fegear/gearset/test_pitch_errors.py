"""Pitch errors as the meshes meet them, against where the teeth of gears stand."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from fegear.gearset import GearSet, load_gear_set, read_gear_set
from fegear.gearset.phases import mesh_phases
from fegear.gearset.pitch_errors import (
    mesh_errors,
    pair_periods,
    tooth_in_cycles,
    tooth_pair_errors,
    without_pitch_errors,
)

TEETH = {"a": 17, "b": 24, "c": 31}


def with_errors(gear_set: GearSet, *gears: int) -> GearSet:
    """Another error for every tooth of some gears [m]."""
    changed = list(gear_set.gears)
    for g in gears:
        count = changed[g].geometry.teeth
        errors = tuple(1e-6 * (1.0 + g + 0.01 * n) for n in range(count))
        changed[g] = replace(changed[g], pitch_errors=errors)
    return replace(gear_set, gears=tuple(changed))


def train(*meshes: tuple[str, str, str]) -> GearSet:
    text = 'name = "train"\n[defaults]\nmodule_mm = 3\nface_width_mm = 20\n'
    for name, teeth in TEETH.items():
        text += f'[[gear]]\nname = "{name}"\nteeth = {teeth}\nhub_radius_mm = 10\n'
        text += "profile_shift = 0.2\n"
    for driver, driven, keys in meshes:
        text += f'[[mesh]]\ndriver = "{driver}"\ndriven = "{driven}"\n'
        text += f"operating_pressure_angle_deg = 23\n{keys}\n"
    return read_gear_set(text)


TRAINS = {
    "in line": train(("a", "b", ""), ("b", "c", "")),
    "bent": train(
        ("a", "b", "center_line_deg = 20"), ("b", "c", "center_line_deg = -75")
    ),
    "driver shared": train(
        ("b", "a", "center_line_deg = 10"), ("b", "c", "center_line_deg = 140")
    ),
    "driven shared": train(
        ("a", "b", "center_line_deg = 200"), ("c", "b", "center_line_deg = 77")
    ),
    "seed": load_gear_set("liu-idler"),
}


def flank_angle(gear_set: GearSet, number: int, gear: int) -> float:
    """From a tooth's axis to its loaded flank on the pitch circle, counterclockwise."""
    mesh = gear_set.meshes[number]
    geometry = gear_set.gears[gear].geometry
    pitch_radius = geometry.base_radius / math.cos(mesh.pair.operating_pressure_angle)
    leading = gear_set.senses[gear] * geometry.half_angle(pitch_radius)
    return leading if mesh.driver == gear else -leading


def tooth_at_pitch_point(gear_set: GearSet, number: int, gear: int) -> float:
    """Which tooth of the list has its loaded flank there at position 0 of the mesh.

    The list begins with the tooth there at position 0 of the gear's first mesh; the
    teeth behind it, as the gear turns, follow.
    """
    sense, pitch = gear_set.senses[gear], gear_set.gears[gear].geometry.pitch_angle
    first = next(
        n for n, m in enumerate(gear_set.meshes) if gear in (m.driver, m.driven)
    )
    axes, phases = [], mesh_phases(gear_set)
    for n in (first, number):
        mesh = gear_set.meshes[n]
        point = mesh.direction + (0.0 if mesh.driver == gear else math.pi)
        # axis of the tooth at the pitch point, turned back to the common time 0
        axis = point - flank_angle(gear_set, n, gear)
        axes.append(axis + sense * phases[n].value * pitch)
    # two teeth of the gear at one time: a whole number of pitches apart
    return sense * (axes[0] - axes[1]) / pitch


@pytest.mark.parametrize("name", TRAINS)
@pytest.mark.parametrize("number", [0, 1])
def test_the_reference_pair_has_the_errors_of_its_teeth(name, number):
    gear_set = with_errors(TRAINS[name], 0, 1, 2)
    mesh = gear_set.meshes[number]
    errors_of_gears = mesh_errors(gear_set, number)
    for errors, gear in zip(errors_of_gears, (mesh.driver, mesh.driven), strict=True):
        tooth = tooth_at_pitch_point(gear_set, number, gear)
        derived = mesh.phase is None or number == 0
        assert abs(tooth - round(tooth)) < (1e-6 if derived else 0.5)
        pitch_errors = gear_set.gears[gear].pitch_errors
        sizes = [abs(error) for error in errors]
        assert sizes == [
            pitch_errors[(round(tooth) + n) % len(pitch_errors)]
            for n in range(len(pitch_errors))
        ]
        cycles = np.arange(3)
        teeth = tooth_in_cycles(gear_set, number, gear, cycles)
        assert teeth.tolist() == [
            (round(tooth) + n) % len(pitch_errors) for n in cycles
        ]


def test_the_other_flank_of_a_tooth_out_of_place_is_too_far_ahead():
    """An idler is driven on one flank and drives with the other."""
    idler = with_errors(TRAINS["in line"], 1)
    assert all(error > 0.0 for error in mesh_errors(idler, 0)[1])
    assert all(error < 0.0 for error in mesh_errors(idler, 1)[0])
    shared = with_errors(TRAINS["driver shared"], 1)
    assert all(error > 0.0 for error in mesh_errors(shared, 0)[0])
    assert all(error > 0.0 for error in mesh_errors(shared, 1)[0])


@pytest.mark.parametrize("phase", [0.3, 1.3, -2.45])
def test_whole_base_pitches_of_a_given_phase_count(phase):
    """What comes one base pitch later has the next tooth in its reference pair."""
    base = with_errors(TRAINS["bent"], 1)
    meshes = base.meshes
    errors = [
        mesh_errors(
            replace(base, meshes=(meshes[0], replace(meshes[1], phase=phase + n))), 1
        )[0]
        for n in (0, 1)
    ]
    # one base pitch on at the start, its reference pair came into contact before
    assert errors[1][1:] == errors[0][:-1]


def test_periods_are_those_of_what_differs():
    plain = TRAINS["seed"]
    assert pair_periods(plain) == (1, 1)
    assert pair_periods(with_errors(plain, 0)) == (38, 1)
    assert pair_periods(with_errors(plain, 1)) == (55, 55)
    assert pair_periods(with_errors(plain, 0, 1, 2)) == (38 * 55, 55 * 94)
    assert without_pitch_errors(with_errors(plain, 0, 1, 2)) == plain
    assert tooth_pair_errors(plain, 0).size == 0


def test_pairs_add_up_the_errors_of_their_teeth():
    gear_set = with_errors(TRAINS["in line"], 0, 1)
    driver, driven = mesh_errors(gear_set, 0)
    gaps = tooth_pair_errors(gear_set, 0)
    assert gaps.size == 17 * 24
    assert gaps[100] == driver[100 % 17] + driven[100 % 24]
