"""Span and dimension over pins against printed values and a numerical measurement."""

from __future__ import annotations

import math

import numpy as np
import pytest
from conftest import make_gear, make_helical
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.optimize import brentq, minimize

from meshes import GeometryError
from meshes.involute import Involute
from meshes.outline import MeshSize, half_sector_outline
from meshes.profile import flank_points, turn
from meshes.tooth_thickness import (
    default_pin_diameter,
    default_span_teeth,
    least_pin_dimension,
    pin_contact,
    pin_dimension,
    require_on_flank,
    require_seated,
    span,
    span_contact,
    thickness_of_pins,
    thickness_of_span,
)

MIRROR = np.array([-1.0, 1.0])
FINE = {"xatol": 1e-12, "fatol": 1e-16, "maxiter": 2000}
involutes = st.builds(
    Involute,
    teeth=st.integers(5, 300),
    module=st.floats(0.1e-3, 50e-3),
    pressure_angle=st.floats(5.0, 35.0).map(math.radians),
)
shifts = st.floats(-1.0, 1.0)


def thickness_of(gear: Involute, shift: float) -> float:
    shifted = 2.0 * shift * math.tan(gear.pressure_angle)
    return gear.module * (0.5 * math.pi + shifted)


def test_printed_span():
    """SDP/SI, Elements of Metric Gear Technology, section 10.2: 32.8266 mm."""
    gear = Involute(teeth=24, module=3.0, pressure_angle=math.radians(20.0))
    assert span(gear, thickness_of(gear, 0.4), 4) == pytest.approx(32.8266, abs=5e-5)


def test_printed_dimension_over_pins():
    """SDP/SI, Elements of Metric Gear Technology, section 10.3: 22.2941 mm."""
    gear = Involute(teeth=20, module=1.0, pressure_angle=math.radians(20.0))
    dimension = pin_dimension(gear, thickness_of(gear, 0.0), 1.7)
    assert dimension == pytest.approx(22.2941, abs=1e-4)


@given(involutes, shifts, st.integers(1, 40))
def test_thickness_comes_back_from_the_span(gear, shift, number):
    thickness = thickness_of(gear, shift)
    back = thickness_of_span(gear, span(gear, thickness, number), number)
    assert back == pytest.approx(thickness, abs=1e-12 * gear.module * gear.teeth)


@given(involutes, shifts, st.floats(1.4, 2.2))
def test_thickness_comes_back_from_the_pins(gear, shift, modules):
    thickness, pin = thickness_of(gear, shift), modules * gear.module
    try:
        dimension = pin_dimension(gear, thickness, pin)
    except ValueError:
        assume(False)
    assert dimension > least_pin_dimension(gear, pin)
    back = thickness_of_pins(gear, dimension, pin)
    assert back == pytest.approx(thickness, abs=1e-12 * gear.module * gear.teeth)


def test_another_tooth_adds_a_base_pitch(pinion):
    longer, shorter = (span(pinion, 4e-3, k) for k in (6, 5))
    assert longer - shorter == pytest.approx(pinion.base_pitch)


def test_many_teeth_have_the_pins_of_a_rack():
    """The pins in a rack's spaces are 1 / sin(alpha) diameters across its flanks."""
    gear = Involute(teeth=10**6, module=1.0, pressure_angle=math.radians(20.0))
    pin, alpha = 1.728, gear.pressure_angle
    height = 0.5 * pin / math.sin(alpha) - 0.25 * math.pi / math.tan(alpha)
    dimension = pin_dimension(gear, 0.5 * math.pi, pin)
    expected = gear.teeth + 2.0 * height + pin
    assert dimension - gear.teeth == pytest.approx(expected - gear.teeth, rel=1e-5)


def random_gears(count: int, seed: int):
    rng = np.random.default_rng(seed)
    for _ in range(count):
        teeth, angle = int(rng.integers(25, 90)), rng.uniform(17.0, 28.0)
        changes = {
            "pressure_angle": math.radians(angle),
            "profile_shift": (shift := rng.uniform(0.0, 0.5)),
            "tip_radius": 2.54e-3 * (0.5 * teeth + 0.95 + shift),
            "rack_tip_radius": 0.2 * 2.54e-3,
            "tooth_thinning": rng.uniform(-2e-5, 2e-4),
        }
        yield make_gear(teeth, 10e-3, **changes)


GEARS = [*random_gears(12, seed=4), make_gear(38, 15e-3), make_gear(55, 20e-3)]


HELICES = [
    make_helical(teeth, 8e-3, angle, tip_radius=0.5 * 2.54e-3 * teeth + 2.4e-3)
    for teeth, angle in ((19, 12.0), (24, 30.0), (31, 20.0), (42, 38.0))
]


def test_the_span_of_helical_teeth_is_that_of_the_normal_rack():
    """W = m_n cos(alpha_n) (pi (k - 1/2) + z inv(alpha_t) + 2 x tan(alpha_n))."""
    for gear in HELICES:
        normal = math.atan(math.tan(gear.pressure_angle) * gear.helix_cosine)
        turns = math.tan(gear.pressure_angle) - gear.pressure_angle
        for number in (2, 4):
            units = math.pi * (number - 0.5) + gear.teeth * turns
            expected = gear.normal_module * math.cos(normal) * units
            rack = 0.5 * math.pi * gear.module
            assert span(gear, rack, number) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("gear", HELICES)
def test_a_ball_touches_both_helicoids(gear):
    """The distance of its centre from the flank in three dimensions is its radius."""
    pin = default_pin_diameter(gear)
    dimension = pin_dimension(gear, gear.tooth_thickness, pin)
    across = math.cos(0.5 * math.pi / gear.teeth) if gear.teeth % 2 else 1.0
    radius = 0.5 * (dimension - pin) / across
    center = radius * np.array([0.0, 1.0, 0.0])

    def distance(place):
        # a right flank of the tooth to the left of the space, turned along the axis
        roll, z = place
        angle = gear.twist * z + 0.5 * gear.pitch_angle
        x, y = turn(flank_points(gear, np.array([roll])), -angle)[0]
        return float(np.linalg.norm(center - [x, y, z]))

    start = pin_contact(gear, gear.tooth_thickness, pin).roll_length
    nearest = minimize(distance, [start, 0.0], method="Nelder-Mead", options=FINE)
    assert nearest.fun == pytest.approx(0.5 * pin, rel=1e-7)
    assert nearest.x[0] == pytest.approx(start, rel=1e-3)


def test_spans_fit_the_face_width():
    gear = HELICES[1]
    number = default_span_teeth(gear)
    length = span(gear, gear.tooth_thickness, number)
    most = length * math.sin(gear.base_helix_angle)
    assert default_span_teeth(gear, 1.01 * most) == number
    narrow = default_span_teeth(gear, 0.99 * most)
    assert narrow is None or narrow < number


@pytest.mark.parametrize("gear", GEARS)
def test_span_is_the_distance_of_parallel_planes(gear):
    """Calipers with their jaws along the axis of symmetry of some teeth."""
    number = default_span_teeth(gear)
    roll = np.linspace(gear.form_roll_length, gear.tip_roll_length, 200_001)
    right = turn(flank_points(gear, roll), 0.5 * (number - 1) * gear.pitch_angle)
    widest = int(right[:, 0].argmax())
    assert 0 < widest < len(roll) - 1
    measured = 2.0 * right[widest, 0]
    assert span(gear, gear.tooth_thickness, number) == pytest.approx(measured, rel=1e-9)
    assert span_contact(gear, measured).roll_length == pytest.approx(
        roll[widest], rel=1e-3
    )


def tooth_outline(gear) -> np.ndarray:
    """The whole right half of a tooth, to the middle of the space."""
    pieces = half_sector_outline(gear, MeshSize())
    dense = [
        edges.curve(np.linspace(edges.parameters[0], edges.parameters[-1], 20_001))
        for edges in pieces
    ]
    return np.concatenate(dense)


@pytest.mark.parametrize("gear", GEARS)
def test_pins_touch_the_outline(gear):
    """Each pin is lowered into its space until it touches the outline."""
    pin, outline = default_pin_diameter(gear), tooth_outline(gear)
    axis = 0.5 * gear.pitch_angle  # of the space, clockwise from the tooth
    flanks = np.concatenate([outline, turn(outline * MIRROR, gear.pitch_angle)])

    def gap(radius: float) -> float:
        center = radius * np.array([math.sin(axis), math.cos(axis)])
        return float(np.hypot(*(flanks - center).T).min()) - 0.5 * pin

    radius = brentq(gap, gear.root_radius, 2.0 * gear.tip_radius, xtol=1e-15)
    opposite = gear.teeth // 2 * gear.pitch_angle
    centers = radius * np.hypot(1.0 - math.cos(opposite), math.sin(opposite))
    dimension = pin_dimension(gear, gear.tooth_thickness, pin)
    assert dimension == pytest.approx(centers + pin, rel=1e-8)


@pytest.mark.parametrize("gear", GEARS)
def test_usual_tools_touch_flanks_near_the_middle(gear):
    number, pin = default_span_teeth(gear), default_pin_diameter(gear)
    by_span = span_contact(gear, span(gear, gear.tooth_thickness, number))
    by_pin = pin_contact(gear, gear.tooth_thickness, pin)
    middle = gear.reference_radius + gear.profile_shift * gear.module
    for contact in (by_span, by_pin):
        require_on_flank(gear, contact, "tool")
        assert abs(contact.radius(gear) - middle) < gear.module
    require_seated(gear, pin)


def test_a_pin_of_another_series_where_the_usual_one_does_not_fit():
    tip = 2.54e-3 * (30.0 + 1.35 + 0.9)
    angle = math.radians(11.7)
    gear = make_gear(
        60, 20e-3, profile_shift=1.35, tip_radius=tip, pressure_angle=angle
    )
    pin = default_pin_diameter(gear)
    assert pin is not None
    assert pin > 1.8 * gear.module
    require_seated(gear, pin)
    middle = gear.reference_radius + gear.profile_shift * gear.module
    contact = pin_contact(gear, gear.tooth_thickness, pin)
    assert contact.radius(gear) == pytest.approx(middle)


@pytest.mark.parametrize(
    ("modules", "message"), [(1.0, "at radius"), (3.5, "at radius")]
)
def test_pins_that_do_not_touch_the_flanks_are_refused(pinion, modules, message):
    pin = modules * pinion.module
    contact = pin_contact(pinion, pinion.tooth_thickness, pin)
    with pytest.raises(GeometryError, match=message):
        require_on_flank(pinion, contact, "pin")


def test_pins_below_the_tip_circle_are_refused(pinion):
    with pytest.raises(GeometryError, match="below the tip"):
        require_seated(pinion, 1.4 * pinion.module)


def test_pins_that_slip_between_the_flanks_are_refused(pinion):
    with pytest.raises(ValueError, match="touches no flanks"):
        pin_contact(pinion, pinion.tooth_thickness, 0.5 * pinion.module)


@given(involutes, st.floats(0.5, 3.0))
def test_a_dimension_below_the_base_circle_is_refused(gear, modules):
    pin = modules * gear.module
    with pytest.raises(ValueError, match="base circle"):
        thickness_of_pins(gear, 0.999 * least_pin_dimension(gear, pin), pin)
