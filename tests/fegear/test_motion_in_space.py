"""Gear sets whose gears move in space: statics, refusals and what studies say."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigh
from yielding_machines import SETTINGS, TORQUE, one_stage, two_stages

import fegear
from fegear.contact.solve import solve_cycle
from fegear.files.errors import InputError
from fegear.gearset import load_gear_set
from fegear.statics.axes import SLOPES
from fegear.statics.excitation_settings import ExcitationSettings
from fegear.statics.machine import loads_on_axes, machine_at_rest
from fegear.train.model_settings import LumpedModel, resolve_model
from fegear.train.space import POSITIONS, system_in_space
from lumped.rotors.statics import ShaftLoad
from lumped.steady.integration_settings import Settings
from lumped.steady.motion import time_history
from lumped.steady.steady_state import Speed
from lumped.steady.steppers import stepper_of

SLOW = 5.0  # Hz


def solved(gear_set):
    machine = machine_at_rest(SETTINGS.on_shafts(gear_set), TORQUE, SETTINGS)
    return machine, system_in_space(gear_set, machine)


def test_slow_motion_tends_to_the_statics_of_the_machine():
    """Transmission error of the rotations, and forces of bearings over a cycle."""
    machine, system = solved(one_stage())
    cycle = solve_cycle(machine.problems[0], TORQUE, np.arange(POSITIONS) / POSITIONS)
    motion = time_history(system, SLOW)
    _, history = stepper_of(system, Settings()).record(
        motion.response.state, Speed(SLOW, Settings()), 1, with_states=True
    )
    at = np.searchsorted(history.time, np.arange(POSITIONS) / (POSITIONS * SLOW))
    shapes = system.modes.shapes[:, system.moving]
    displacement = history.states[at, 0] @ shapes.T
    arms = [gear.base_radius for gear in system.train.gears]
    rotations = [system.rotation_row(gear) for gear in range(2)]
    error = displacement @ np.array(rotations).T @ arms
    expected = cycle.ste[0]
    difference = (error - error.mean()) - (expected - expected.mean())
    assert np.abs(difference).max() < 0.01 * np.ptp(expected)
    stiffness, damping = system.space.bearing_forces
    forces = np.einsum("bin,tn->tbi", stiffness, displacement)
    forces += np.einsum("bin,tn->tbi", damping, history.states[at, 1] @ shapes.T)
    of_statics = np.concatenate(list(reactions(machine, cycle)), axis=1)
    scale = np.abs(of_statics).max()
    assert forces.mean(axis=0) == pytest.approx(
        of_statics.mean(axis=0), abs=2e-4 * scale
    )
    wandering = of_statics.std(axis=0)
    assert wandering.max() > 5.0
    assert forces.std(axis=0) == pytest.approx(
        wandering, rel=5e-3, abs=1e-3 * wandering.max()
    )


def reactions(machine, cycle):
    """Forces (n, bearings, 3) of the bearings of every shaft at rest."""
    loads = loads_on_axes(machine.problems[0], cycle)
    for gear, (statics, _) in enumerate(machine.axes.shafts.values()):
        of_shaft = []
        for load in loads[:, gear] @ machine.axes.frames[0]:
            moments = SLOPES.T @ load
            force = ShaftLoad(
                position=statics.places[0],
                force=tuple(load[:3]),
                moment=(*moments[3:].tolist(), 0.0),
            )
            of_shaft.append(statics.solve([force]).reactions[:, :3])
        yield np.array(of_shaft)


def test_meshes_of_two_stages_carry_their_torques():
    _, system = solved(two_stages())
    forces = system.static_deflection * system.arrays.mean_stiffness
    for mesh, force in zip(system.train.meshes, forces, strict=True):
        driver, driven = (system.train.gears[i] for i in (mesh.driver, mesh.driven))
        for gear in (driver, driven):
            if gear.torque:
                torque = force * abs(gear.base_radius)
                assert torque == pytest.approx(abs(gear.torque), rel=1e-9)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"number": "coupled"}, "motion = space; needs model 1, not coupled"),
        ({"translations": True}, "motion = space has all of them"),
        ({"friction": 0.1}, "friction = 0.1; must be 0 with motion = space"),
    ],
)
def test_what_motion_in_space_has_not_is_refused(settings, message):
    with pytest.raises(ValueError, match=message):
        LumpedModel(motion="space", **settings)


def test_the_model_of_motion_in_space_is_chosen():
    model, reason = resolve_model(LumpedModel(motion="space"), one_stage())
    assert model.number == 1
    assert "over the face width" in reason


def test_loads_that_are_even_over_the_width_are_refused():
    study = fegear.Sweep(
        gear_set="liu-pair", speeds=(500.0,), model=LumpedModel(motion="space")
    )
    with pytest.raises(InputError, match="plane = width"):
        fegear.run(study)


def test_a_shaft_without_thrust_bearings_is_named():
    bare = one_stage()
    shafts = tuple(
        replace(
            shaft,
            body=replace(
                shaft.body,
                bearings=tuple(
                    replace(b, axial_stiffness=0.0) for b in shaft.body.bearings
                ),
            ),
        )
        for shaft in bare.shafts
    )
    from fegear.train.lumped_models import lumped_system

    with pytest.raises(InputError, match="bearing must take the thrust"):
        lumped_system(replace(bare, shafts=shafts), TORQUE, LumpedModel(motion="space"))


def in_space(study, **settings):
    excitation = ExcitationSettings(resolution="coarse")
    return fegear.run(
        study(
            gear_set="helical-machine",
            motion="space",
            torque=40.0,
            excitation=excitation,
            **settings,
        )
    )


def test_energies_of_modes_in_space_add_up():
    result = in_space(fegear.NaturalModes)
    modes = result.summary["modes"]
    assert modes[0]["kind"] == "rigid rotation"
    kinds = {mode["kind"].partition(" ")[0] for mode in modes[1:]}
    assert kinds >= {"torsion", "bending", "tilting", "axial"}
    for mode in modes[1:]:
        parts = ("shaft", "bearing", "tilt")
        strain = sum(mode["mesh_energy"]) + sum(mode[f"{p}_energy"] for p in parts)
        assert strain == pytest.approx(1.0, abs=1e-6)
        names = [name for name in mode if name.endswith("_motion")]
        assert sum(mode[name] for name in names) == pytest.approx(1.0, rel=1e-9)


def base_radius(name):
    gears = load_gear_set("helical-machine").gears
    return next(g.geometry.base_radius for g in gears if g.name == name)


def test_exported_matrices_are_those_of_the_whole_machine():
    arrays = in_space(fegear.ModelExport).arrays
    mass, stiffness, load = (arrays[name] for name in ("M", "K", "load"))
    squares, shapes = eigh(stiffness, mass)
    frequencies = np.sqrt(np.maximum(squares, 0.0)) / (2.0 * np.pi)
    assert arrays["natural_frequency_Hz"][1:] == pytest.approx(frequencies[1:])
    modes = in_space(fegear.NaturalModes).summary["natural_frequencies_Hz"]
    for frequency in modes[:10]:
        error = np.abs(frequencies / frequency - 1.0).min()
        assert error < 1e-3
    displacement = arrays["static_displacement"]
    assert np.abs(shapes[:, 0] @ load) < 1e-6 * load.max()
    gyroscopic = arrays["G"]
    assert np.array_equal(gyroscopic, -gyroscopic.T)
    assert gyroscopic.any()
    # two bearings a shaft: forces of statics, whichever beams shafts are
    shafts = fegear.LoadedShafts(
        gear_set="helical-machine",
        torque=40.0,
        elements=fegear.StaticsSettings(resolution="coarse"),
    )
    names = in_space(fegear.ModelExport).coordinates
    for entry, k in zip(
        fegear.run(shafts).summary["bearings"][:4],
        (1.5e8, 1.5e8, 2e8, 2e8),
        strict=True,
    ):
        place = f"{entry['shaft']} at {entry['position_mm']:g} mm"
        for axis in "xy":
            moved = displacement[names.index(f"{place} {axis}")]
            expected = entry[f"force_{axis}_N"]
            scale = entry["radial_force_N"]
            assert abs(k * moved) == pytest.approx(abs(expected), abs=2e-3 * scale)
    torque = arrays["static_mesh_force_N"][0] * base_radius("pinion-1")
    assert torque == pytest.approx(40.0, rel=1e-6)
    tilts = arrays["mesh_tilt_vectors"]
    # a shaft that moves as a whole along x does not tilt
    along_x = [name.endswith(" x") for name in in_space(fegear.ModelExport).coordinates]
    assert tilts @ np.array(along_x, float) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(
    ("study", "settings"),
    [
        (fegear.NaturalModes, {"stiffness": "given"}),
        (fegear.ModelExport, {"stiffness": "fe"}),
        (fegear.ModelExport, {"mesh": 1}),
    ],
)
def test_models_of_the_plane_are_refused_in_space(study, settings):
    with pytest.raises(InputError, match="motion = space; needs stiffness auto"):
        in_space(study, **settings)


def test_stiff_bearings_leave_gears_that_rotate():
    """The mode of the plane, k (r1^2 / J1 + r2^2 / J2), on shafts without mass."""
    gear_set = one_stage()
    shafts = tuple(
        replace(
            shaft,
            body=replace(
                shaft.body,
                density=1e-3,
                bearings=tuple(
                    replace(
                        bearing,
                        position=shaft.body.gear_positions[0] + place,
                        stiffness=(1e13, 0.0, 0.0, 1e13),
                        axial_stiffness=1e13,
                        tilt_stiffness=1e9,
                    )
                    for bearing, place in zip(
                        shaft.body.bearings, (-0.004, 0.004), strict=True
                    )
                ),
            ),
        )
        for shaft in gear_set.shafts
    )
    stiff = replace(gear_set, shafts=shafts)
    _, system = solved(stiff)
    mobility = sum(gear.base_radius**2 / gear.inertia for gear in system.train.gears)
    expected = np.sqrt(system.excitations[0].mean_stiffness * mobility) / (2.0 * np.pi)
    in_mesh = system.modes.mesh_energy[0].argmax()
    assert system.modes.frequency_Hz[in_mesh] == pytest.approx(expected, rel=5e-3)
