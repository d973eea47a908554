"""Phases against pure geometry: where the teeth of drawn gears touch."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fegear.commands.show.gear_set_figure import gear_outline, line_of_action
from fegear.gearset import GearSet, load_gear_set, read_gear_set
from fegear.gearset.phases import geometric_phase, mesh_phases
from fegear.gearset.placing import Place, layout

IDLER = load_gear_set("liu-idler")
GEARS = (("a", 30), ("b", 41), ("c", 36), ("d", 25))
SHAFT = '[[shaft]]\ngears = ["b", "d"]\n'


def train(*meshes: tuple[str, str, str], more: str = "") -> GearSet:
    """Gears a to d in meshes (driver, driven, further keys)."""
    text = 'name = "train"\n[defaults]\nmodule_mm = 2\nface_width_mm = 20\n'
    for name, teeth in GEARS:
        text += f'[[gear]]\nname = "{name}"\nteeth = {teeth}\nhub_radius_mm = 10\n'
        text += f"tooth_thinning_um = {3 * teeth}\n"
    for number, (driver, driven, keys) in enumerate(meshes):
        text += f'[[mesh]]\ndriver = "{driver}"\ndriven = "{driven}"\n'
        text += f"operating_pressure_angle_deg = {20.5 + 0.4 * number}\n{keys}\n"
    return read_gear_set(text + more)


def along(degrees: float) -> str:
    return f"center_line_deg = {degrees}"


def bent(gear_set: GearSet, *directions: float) -> GearSet:
    """The gear set with centre lines [rad] and without given phases."""
    meshes = [
        replace(mesh, center_line=direction, phase=None)
        for mesh, direction in zip(gear_set.meshes, directions, strict=True)
    ]
    return replace(gear_set, meshes=tuple(meshes))


TRAINS = {
    "idler in line": train(("a", "b", ""), ("b", "c", ""), ("c", "d", "")),
    "idler bent": train(("a", "b", along(20)), ("b", "c", along(75))),
    "two idlers": train(
        ("a", "b", along(-20)), ("b", "c", along(35)), ("c", "d", along(-110))
    ),
    "driver shared": train(("a", "b", along(-90)), ("a", "c", along(50))),
    "driven shared": train(("a", "b", ""), ("c", "b", along(115))),
    "clockwise branch": train(
        ("a", "b", along(10)), ("b", "c", along(80)), ("b", "d", along(-70))
    ),
    "listed backward": train(("b", "c", along(40)), ("a", "b", along(-30))),
}
CASES = [
    pytest.param(gear_set, number, id=f"{name}-{number}")
    for name, gear_set in TRAINS.items()
    for number in range(len(gear_set.meshes))
]


def apart(one: float, two: float) -> float:
    """Difference of two phases as parts of a cycle, without its whole cycles."""
    return math.remainder(one - two, 1.0)


def dense(outline):
    """Points (n, 2) along the edges of a closed polygon, close to each other."""
    edges = np.roll(outline, -1, axis=0) - outline
    along_edge = np.linspace(0.0, 1.0, 40)[:, None, None]
    return (outline + along_edge * edges).reshape(-1, 2)


def test_idler_of_the_built_in_set_in_line():
    assert geometric_phase(IDLER, 1) == pytest.approx(-0.048187, abs=1e-6)
    derived = mesh_phases(bent(IDLER, 0.0, 0.0))[1]
    assert derived.value == geometric_phase(IDLER, 1)
    assert derived.origin == "derived, centres in line"


def test_turning_the_whole_train_changes_nothing():
    turned = mesh_phases(bent(IDLER, 1.1, 1.1))[1]
    assert apart(turned.value, geometric_phase(IDLER, 1)) == pytest.approx(0.0)
    assert turned.origin == "derived, centres in line"


@pytest.mark.parametrize(("gear_set", "number"), CASES)
def test_drawn_flanks_meet_where_the_phase_says(gear_set, number):
    """The outlines know nothing of phases: only where each gear meets the next."""
    mesh, placed = gear_set.meshes[number], layout(gear_set)
    line = line_of_action(mesh, placed.places[mesh.driver], placed.directions[number])
    pair, phase = mesh.pair, mesh_phases(gear_set)[number].value
    checked_count = 0
    for position in (phase - 1.0, phase, phase + 1.0):
        roll_length = pair.pitch_point + position * pair.base_pitch
        if not pair.path_start < roll_length < pair.path_end:
            continue
        point = 1e-3 * np.array(line.at(roll_length))
        for gear in (mesh.driver, mesh.driven):
            teeth, place = gear_set.gears[gear].geometry, placed.places[gear]
            gaps = np.hypot(*(dense(gear_outline(teeth, place)) - point).T)
            assert gaps.min() < 0.002 * pair.base_pitch
        checked_count += 1
    assert checked_count


@settings(max_examples=40, deadline=None)
@given(first=st.floats(-3.0, 3.0), second=st.floats(-3.0, 3.0))
def test_idler_against_pure_geometry(first, second):
    """At position 0 of mesh 1, the idler's leading flank seen from mesh 2."""
    gear_set = bent(IDLER, first, second)
    one, two = gear_set.meshes
    idler = one.pair.driven
    flanks = [
        idler.half_angle(idler.base_radius / math.cos(m.pair.operating_pressure_angle))
        for m in (one, two)
    ]
    touching = first + math.pi  # trailing flank at the first pitch point
    axis = touching - flanks[0]  # the idler turns clockwise: the tooth is ahead
    leading = axis - flanks[1]
    past = (second - leading) / idler.pitch_angle  # clockwise of the pitch point
    assert apart(mesh_phases(gear_set)[1].value, past) == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize("turn", [0.01, -0.4, 2.0])
def test_turned_centre_line_shifts_the_phase_by_its_part_of_a_pitch(turn):
    """The idler turns clockwise: a centre line turned on meets its teeth later."""
    straight, turned = (
        mesh_phases(bent(IDLER, 0.3, 0.3 + angle))[1].value for angle in (0.0, turn)
    )
    pitch_angle = 2.0 * math.pi / 55
    assert apart(turned - straight, turn / pitch_angle) == pytest.approx(0, abs=1e-9)


def test_driven_by_a_counter_clockwise_idler_it_shifts_the_other_way():
    row = TRAINS["two idlers"]
    before, after = (
        mesh_phases(bent(row, 0.0, 0.0, angle))[2].value for angle in (0.0, 0.01)
    )
    assert apart(after, before) == pytest.approx(-0.01 * 36 / (2.0 * math.pi))


@pytest.mark.parametrize("pitches", [1, -3])
def test_turn_by_whole_pitches_leaves_the_phase(pitches):
    turn = pitches * 2.0 * math.pi / 55
    phases = [mesh_phases(bent(IDLER, 0.2, angle))[1] for angle in (0.7, 0.7 + turn)]
    assert apart(phases[0].value, phases[1].value) == pytest.approx(0, abs=1e-9)
    assert phases[1].origin == "derived from the centre lines"


def test_a_given_phase_wins_and_carries_on():
    free, with_phase = (
        train(("a", "b", ""), ("b", "c", keys), ("c", "d", ""))
        for keys in ("", "phase = 0.2")
    )
    loose, held = mesh_phases(free), mesh_phases(with_phase)
    assert (held[1].value, held[1].origin) == (0.2, "given")
    shift = apart(held[2].value, loose[2].value)
    assert shift == pytest.approx(apart(0.2, loose[1].value))
    assert geometric_phase(with_phase, 1) == pytest.approx(loose[1].value)


ORIGINS = {
    "chosen, gears on a shaft can be clocked at will": train(
        ("a", "b", ""), ("d", "c", ""), more=SHAFT
    ),
    "chosen, not linked to the first mesh": train(("a", "b", ""), ("d", "c", "")),
    "chosen, no centre line is given where the train branches": train(
        ("a", "b", ""), ("a", "c", "")
    ),
}


@pytest.mark.parametrize("origin", ORIGINS)
def test_what_nothing_determines_is_chosen(origin):
    first, second = mesh_phases(ORIGINS[origin])
    assert (first.value, first.origin) == (0.0, "reference")
    assert (second.value, second.origin) == (0.0, origin)
    assert geometric_phase(ORIGINS[origin], 1) is None


def test_a_mesh_linked_by_a_later_one_only():
    row = train(("a", "b", ""), ("b", "c", ""), ("c", "d", ""))
    shuffled = replace(row, meshes=tuple(row.meshes[n] for n in (0, 2, 1)))
    values = [phase.value for phase in mesh_phases(shuffled)]
    expected = [mesh_phases(row)[n].value for n in (0, 2, 1)]
    assert values == pytest.approx(expected)


def test_layout_agrees_on_the_sense_of_rotation():
    for gear_set in TRAINS.values():
        places: dict[int, Place] = layout(gear_set).places
        meshing = {g for m in gear_set.meshes for g in (m.driver, m.driven)}
        assert all(places[g].sense == gear_set.senses[g] for g in meshing)
