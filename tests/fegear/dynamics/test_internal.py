"""A planet in a ring in motion: coupled model, elements and closed forms agree."""

from __future__ import annotations

import numpy as np
import pytest

import fegear
from fegear.gearset import make_gear_set
from fegear.gearset.lumped_train import train_of

SPEEDS = (2000.0, 5000.0, 6500.0)  # Hz
TORQUE, RATIO = 100.0, 96 / 36
GEARS = [
    {"name": "planet", "teeth": 36, "hub_radius_mm": 15.0},
    {"name": "ring", "teeth": 96, "internal": True, "rim_radius_mm": 110.0},
]
BEARINGS = ({"kx": 5e8, "ky": 4e8}, {"kx": 1e9, "ky": 9e8})


def planet_and_ring(driver=0, bearings=False, torque=TORQUE):
    names = [gear["name"] for gear in GEARS]
    gears = [
        gear | {f"bearing_{k}_N_per_m": v for k, v in keys.items() if bearings}
        for gear, keys in zip(GEARS, BEARINGS, strict=True)
    ]
    mesh = {"driver": names[driver], "driven": names[1 - driver]}
    return make_gear_set(
        {
            "name": "planet-ring",
            "defaults": {"module_mm": 2.0, "face_width_mm": 20.0},
            "gear": gears,
            "mesh": [mesh | {"center_distance_mm": 60.0, "center_line_deg": 25.0}],
            "load": {"gear": names[driver], "torques_Nm": [torque]},
        }
    )


def rms(study):
    table = fegear.run(study).table
    columns = dict(zip(table.names, np.transpose(list(table.rows())), strict=True))
    return columns["dte_rms_m"].astype(float), columns["force_peak_N"].astype(float)


def coupled(gears, translations=False, speeds=SPEEDS):
    model = fegear.LumpedModel(number="coupled", translations=translations)
    return fegear.Sweep(gear_set=gears, speeds=speeds, direction="up", model=model)


@pytest.mark.slow
@pytest.mark.parametrize("bearings", [False, True])
@pytest.mark.parametrize("driver", [0, 1])
def test_the_coupled_model_moves_as_the_elements_do(driver, bearings):
    gears = planet_and_ring(driver, bearings, TORQUE * (RATIO if driver else 1.0))
    elements = fegear.FiniteElements(fidelity="reduced", cutoff_Hz=90e3)
    one, force = rms(coupled(gears, bearings))
    two, peak = rms(
        fegear.Dynamics(
            gear_set=gears,
            speeds=SPEEDS,
            direction="up",
            elements=elements,
            translations=bearings,
        )
    )
    np.testing.assert_allclose(one, two, rtol=0.02)
    np.testing.assert_allclose(force, peak, rtol=0.02)


@pytest.mark.slow
def test_it_does_not_matter_which_gear_drives():
    """Below the resonance, where tip corners, which differ in approach and recess,
    weigh little.

    The ring's frames, modes and inertia are then those of a driver.
    """
    below = SPEEDS[:2]
    one, _ = rms(coupled(planet_and_ring(), speeds=below))
    two, _ = rms(coupled(planet_and_ring(1, torque=TORQUE * RATIO), speeds=below))
    np.testing.assert_allclose(one, two, rtol=0.01)


def test_the_train_of_a_ring_turns_in_the_sense_of_the_planet():
    train = train_of(planet_and_ring(), TORQUE)
    assert train.gears[1].base_radius < 0.0 < train.gears[0].base_radius
    assert [float(speed) for speed in train.speeds] == pytest.approx([1.0, 36 / 96])
    torques = [gear.torque for gear in train.gears]
    assert torques[1] == pytest.approx(-torques[0] * RATIO)


def test_natural_frequencies_are_those_of_two_rotors():
    """omega^2 = k (r1^2 / J1 + r2^2 / J2) of the mean mesh stiffness."""
    study = fegear.NaturalModes(gear_set=planet_and_ring(), stiffness="fe")
    modes = fegear.run(study).summary
    train = train_of(planet_and_ring(), TORQUE)
    stiffness = modes["mean_stiffness"][0]["stiffness_N_per_m"]
    inverse = sum(gear.base_radius**2 / gear.inertia for gear in train.gears)
    frequencies = [mode["frequency_Hz"] for mode in modes["modes"]]
    expected = np.sqrt(stiffness * inverse) / (2.0 * np.pi)
    assert max(frequencies) == pytest.approx(expected, rel=1e-9)
