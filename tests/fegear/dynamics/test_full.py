"""All freedoms of the finite elements against elastic modes and against none."""

from __future__ import annotations

import numpy as np
import pytest

from fegear.dynamics.kernels import reduced as kernel
from fegear.dynamics.stepper import TimeSteps

FREQUENCY, CYCLE = 1600.0, 128
PLANET_AND_RING = """
name = "planet-ring"
plane = "stress"
defaults = { module_mm = 2.0, face_width_mm = 20.0 }
gear = [
    { name = "planet", teeth = 36, hub_radius_mm = 10.0 },
    { name = "ring", teeth = 96, internal = true, rim_radius_mm = 130.0 },
]
mesh = [{ driver = "planet", driven = "ring", center_distance_mm = 60.0 }]
load = { gear = "planet", torques_Nm = [100.0] }
"""


def passed(stepper, periods=1):
    """Deflection from rest over mesh periods, and the state after them."""
    state, size = stepper.start(), 1.0 / (FREQUENCY * CYCLE)
    state, motion = stepper.integrate(
        state, TimeSteps(FREQUENCY, size, periods * CYCLE, CYCLE)
    )
    return motion, state


def apart(one, other):
    return np.sqrt(((one - other) ** 2).mean()) / other.std()


@pytest.mark.parametrize("friction", [0.0, 0.1])
def test_statics_are_those_of_hubs_alone(case_of, full_of, friction):
    rigid = case_of(friction=friction).stepper(None).start()
    state = full_of(friction=friction).start()
    near = rigid.contact[kernel.PENETRATION] > 0.0
    for row in (kernel.PENETRATION, kernel.LOAD):
        np.testing.assert_allclose(
            state.contact[row, near], rigid.contact[row, near], 1e-8
        )
    same_deflection(state, rigid, full_of(friction=friction))


def same_deflection(one, other, stepper):
    """A free rotation takes part in the motion to rest and strains nothing."""
    shapes = stepper.model.kinematics.deflection
    np.testing.assert_allclose(
        shapes @ one.motion[0], shapes @ other.motion[0], rtol=1e-8
    )


def test_statics_of_an_idler_know_both_its_meshes(case_of, full_of):
    rigid = case_of("liu-idler-small-hubs").stepper(None).start()
    stepper = full_of(name="liu-idler-small-hubs")
    same_deflection(stepper.start(), rigid, stepper)


@pytest.mark.slow
@pytest.mark.parametrize("friction", [0.0, 0.1])
def test_modes_tend_to_all_freedoms(case_of, full_of, friction):
    """Over one period from rest, teeth counted anew at its end, and some beyond."""
    motion, _ = passed(full_of(friction=friction), periods=2)
    expected = motion.deflection[:, 0]
    case = case_of(friction=friction)
    errors = [
        apart(passed(case.stepper(cutoff), 2)[0].deflection[:, 0], expected)
        for cutoff in (12e3, 40e3, 120e3)
    ]
    assert errors[0] > errors[1] > errors[2]
    assert errors[2] < 4e-3


@pytest.mark.slow
def test_modes_of_a_ring_tend_to_all_freedoms(case_of, full_of, tmp_path):
    """A planet that drives a ring, over one period from rest."""
    path = tmp_path / "ring.toml"
    path.write_text(PLANET_AND_RING)
    motion, _ = passed(full_of(name=str(path)))
    expected = motion.deflection[:, 0]
    errors = [
        apart(passed(case_of(str(path)).stepper(cutoff))[0].deflection[:, 0], expected)
        for cutoff in (40e3, 90e3, 180e3)
    ]
    assert errors[0] > errors[1] > errors[2]
    assert errors[2] < 1e-3


@pytest.mark.slow
def test_pitch_errors_move_all_freedoms_and_modes_alike(case_of, full_of):
    """From rest over three cycles, in which other pairs of teeth carry."""
    errors = ((3e-6, -2e-6) * 19, (1e-6, 0.0, -1e-6, 2e-6, -2e-6) * 11)
    motion, _ = passed(full_of(errors=errors), periods=3)
    expected = motion.deflection[:, 0]
    modal, _ = passed(case_of(errors=errors).stepper(40e3), 3)
    equal, _ = passed(case_of().stepper(40e3), 3)
    assert apart(modal.deflection[:, 0], expected) < 0.02
    assert apart(equal.deflection[:, 0], expected) > 0.5


@pytest.mark.slow
def test_marching_on_is_marching_at_once(full_of):
    stepper = full_of()
    whole, end = passed(stepper, periods=2)
    _, half = passed(stepper)
    size = 1.0 / (FREQUENCY * CYCLE)
    after, second = stepper.integrate(half, TimeSteps(FREQUENCY, size, CYCLE, CYCLE))
    np.testing.assert_allclose(second.deflection, whole.deflection[CYCLE:], rtol=1e-9)
    for one, other in zip(after.fields, end.fields, strict=True):
        scale = np.abs(other).max(axis=(1, 2), keepdims=True)
        assert (np.abs(one - other) <= 1e-8 * scale).all()
