"""Random gear sets whose teeth are all relieved, with seeds of their own."""

from __future__ import annotations

from typing import Any

import numpy as np

from fegear.files.errors import InputError
from fegear.gearset import GearSet, make_gear_set
from validation.commands.validate.random_sets import generator

SEED = 20261125


def relieved_set(number: int, seed: int = SEED) -> GearSet:
    """Pairs, idlers and counter-shafts in turn, each with one torque."""
    rng = np.random.default_rng([seed, number])
    kind = list(generator.KINDS)[number % len(generator.KINDS)]
    while True:
        tables = generator.KINDS[kind](rng) | {"name": f"relieved-{kind}-{number}"}
        for mesh in tables["mesh"]:
            mesh["tip_relief"] = _relief(rng)
        try:
            plain = make_gear_set(tables)
            generator.give_inertias(tables, plain, rng)
            torque = generator.draw_torque(plain, rng)
            tables["load"] = {"gear": "a", "torques_Nm": [torque]}
            return make_gear_set(tables)
        except InputError:
            continue  # the next that this number draws


def _relief(rng: np.random.Generator) -> dict[str, Any]:
    return {
        "magnitude_um": rng.uniform(5.0, 30.0),
        "length_pitches": rng.uniform(0.15, 0.45),
        "shape": str(rng.choice(["linear", "parabolic"])),
    }
