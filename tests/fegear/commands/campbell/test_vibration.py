"""Vibration of machines in space, excited by the loads of teeth over their cycles."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from yielding_machines import SETTINGS, TORQUE, one_stage, two_stages

import fegear
from fegear.commands.campbell.response import machine_response
from fegear.contact.solve import solve_cycle
from fegear.statics.axes import SLOPES
from fegear.statics.load_variation import standing_mesh
from fegear.statics.machine import loads_on_axes, machine_at_rest
from fegear.train.rotors import rotor_system
from lumped.rotors.matrices import assemble
from lumped.rotors.statics import ShaftLoad
from lumped.rotors.whirl import WhirlProblem

POSITIONS = 32


def solved(gear_set):
    """Machine at rest, variations of its meshes, and its shafts with them."""
    machine = machine_at_rest(SETTINGS.on_shafts(gear_set), TORQUE, SETTINGS)
    count = len(gear_set.meshes)
    variations = [
        standing_mesh(machine, mesh, POSITIONS).variation for mesh in range(count)
    ]
    matrices = [one.stiffness for one in variations]
    stiffness = [matrix[0, 0] for matrix in matrices]
    system = rotor_system(gear_set, stiffness, 12, "space", matrices)
    return machine, variations, system


@pytest.mark.parametrize(
    "keys", [{}, {"driven_from": "end"}], ids=["rigid", "twisting"]
)
def test_at_slow_speed_bearings_have_the_forces_of_statics(keys):
    """RMS over the mesh cycle, also of the place of the load that wanders."""
    machine, variations, system = solved(one_stage(**keys))
    problem = WhirlProblem(assemble(system))
    response = machine_response(
        machine.gear_set, system, problem, variations, np.array([0.0, 1.0]), 0.04
    )
    cycle = solve_cycle(machine.problems[0], TORQUE, np.arange(POSITIONS) / POSITIONS)
    loads = loads_on_axes(machine.problems[0], cycle)
    expected = []
    for gear, (statics, gears) in enumerate(machine.axes.shafts.values()):
        assert gears == (gear,)
        reactions = []
        for load in loads[:, gear] @ machine.axes.frames[0]:
            moments = SLOPES.T @ load
            force = ShaftLoad(
                position=statics.places[0],
                force=tuple(load[:3]),
                moment=(*moments[3:].tolist(), 0.0),
            )
            reactions.append(statics.solve([force]).reactions[:, :3])
        expected.append(np.std(reactions, axis=0))
    of_statics = np.concatenate(expected)
    assert of_statics[:, :2].max() > 5.0
    for row in response.bearing_force:
        # eight harmonics of the cycle, and Euler-Bernoulli beams
        assert row == pytest.approx(of_statics, rel=0.02, abs=2e-3 * of_statics.max())


def test_loads_at_the_mean_motion_have_what_the_error_asks_for():
    """At a constant error the force varies as the stiffness resists its variation."""
    machine, (variation,), _ = solved(one_stage())
    held = machine.problems[0]
    cycle = solve_cycle(held, TORQUE, np.arange(POSITIONS) / POSITIONS)
    assert variation.mean_force == pytest.approx(TORQUE / cycle.base_radius)
    # to first order that is the error at rest times the stiffness
    rough = -variation.stiffness[0, 0] * (cycle.ste[0] - cycle.ste[0].mean())
    assert variation.loads[:, 0] == pytest.approx(rough, abs=0.3 * np.ptp(rough))
    spectrum = variation.harmonics(POSITIONS // 2 - 1)
    angle = 2j * np.pi * np.arange(1, POSITIONS // 2) / POSITIONS
    at = np.real(np.exp(np.outer(np.arange(POSITIONS), angle)) @ spectrum)
    assert at == pytest.approx(variation.loads, abs=0.05 * np.ptp(variation.loads))


def test_a_machine_turned_about_its_axes_vibrates_the_same():
    gear_set = one_stage()
    turned = replace(
        gear_set, meshes=(replace(gear_set.meshes[0], center_line=0.5 * np.pi),)
    )
    rpm = np.array([500.0, 3000.0, 9000.0])
    forces = []
    for one in (gear_set, turned):
        # bearings alike in x and y turn with it
        shafts = tuple(
            replace(
                shaft,
                body=replace(
                    shaft.body,
                    bearings=tuple(
                        replace(b, stiffness=(2e8, 0.0, 0.0, 2e8))
                        for b in shaft.body.bearings
                    ),
                ),
            )
            for shaft in one.shafts
        )
        machine, variations, system = solved(replace(one, shafts=shafts))
        problem = WhirlProblem(assemble(system))
        response = machine_response(
            machine.gear_set, system, problem, variations, rpm, 0.04
        )
        forces.append((response.radial_force, response.mesh_force))
    for one, other in zip(*forces, strict=True):
        assert one == pytest.approx(other, rel=1e-6)


def test_meshes_of_two_stages_excite_each_others_bearings():
    machine, variations, system = solved(two_stages())
    problem = WhirlProblem(assemble(system))
    rpm = np.array([2000.0])
    place = machine.gear_set, system, problem
    both = machine_response(*place, variations, rpm, 0.04)
    silent = [replace(one, loads=0.0 * one.loads) for one in variations]
    one, other = (
        machine_response(*place, pair, rpm, 0.04)
        for pair in ([variations[0], silent[1]], [silent[0], variations[1]])
    )
    # frequencies differ, so that squares add up
    squares = one.bearing_force**2 + other.bearing_force**2
    assert both.bearing_force**2 == pytest.approx(squares, rel=1e-9)
    assert (one.radial_force > 0.0).all()


@pytest.mark.parametrize("output", ["bearing_forces", "mesh_forces", "response"])
def test_vibration_needs_teeth_that_are_solved(output):
    stated = fegear.CampbellDiagram(gear_set="helical-machine")
    by_elements = replace(stated, stiffness="fe")
    for study in (stated, replace(by_elements, motion="plane")):
        ((name, reason),) = study.unused_options({output: "x"})
        assert (name, reason.partition(" ")[0]) == (output, "needs")
    assert not list(by_elements.unused_options({output: "x"}))


@pytest.mark.parametrize(
    ("cross", "grows"), [(2e6, False), (1e8, True)], ids=["damped", "growing"]
)
def test_warning_of_growth_is_that_of_the_forces_in_vibration(cross, grows):
    """Modes are without damping_ratio, forces in vibration have it."""
    keys = {
        "bearing_kxy_N_per_m": [cross, cross],
        "bearing_kyx_N_per_m": [-cross, -cross],
    }
    study = fegear.CampbellDiagram(
        gear_set=one_stage(**keys),
        stiffness="fe",
        points=3,
        max_rpm=3000.0,
        elements=3,
        modes=4,
        excitation=fegear.ExcitationSettings(resolution="coarse"),
    )
    result = fegear.run(study)
    warnings = [line for line in result.summary["warnings"] if "[W43]" in line]
    assert "flutter" in warnings[0]
    assert "without damping_ratio" in warnings[0]
    assert result.response.grows.tolist() == [grows] * 3
    if grows:
        assert len(warnings) == 2
        assert "3 of 3 speeds" in warnings[1]
        assert "damping_ratio = 0.04 too" in warnings[1]
    else:
        assert len(warnings) == 1
        assert "with damping_ratio = 0.04, which the forces" in warnings[0]
        assert warnings[0].endswith("it does not [W43]")
