"""Random machines of shafts with helical gears, which tests share."""

from __future__ import annotations

import math

from lumped.rotors.description import (
    Bearing,
    Disk,
    MeshSpring,
    Rotor,
    RotorSystem,
    Section,
)

GRID = 0.025  # m


def place_on(rng, length):
    """A place on a shaft that is not an end."""
    return GRID * float(rng.integers(1, round(length / GRID)))


def random_rotor(rng, number, ratio):
    # no element is short, for its stiffness would bring round-off
    lengths = GRID * rng.integers(4, 12, rng.integers(1, 4))
    total = math.fsum(lengths)
    return Rotor(
        name=f"shaft {number}",
        sections=tuple(
            Section(length=L, diameter=rng.uniform(0.03, 0.08), bore=0.01)
            for L in lengths
        ),
        disks=tuple(
            Disk(
                position=place_on(rng, total),
                mass=rng.uniform(1.0, 20.0),
                polar_inertia=rng.uniform(0.01, 0.2),
                transverse_inertia=rng.uniform(0.01, 0.2),
            )
            for _ in range(rng.integers(1, 3))
        ),
        bearings=tuple(
            Bearing(
                position=place,
                stiffness=(rng.uniform(1e7, 1e9), 0.0, 0.0, rng.uniform(1e7, 1e9)),
                axial_stiffness=axial,
                tilt_stiffness=rng.choice([0.0, 1e5]),
            )
            for place, axial in ((0.0, rng.uniform(1e6, 1e8)), (total, 0.0))
        ),
        young_modulus=2.06e11,
        shear_modulus=7.9e10,
        density=7850.0,
        speed_ratio=ratio,
    )


def random_machine(rng):
    """Two or three shafts in a row, whose gears are somewhere along them."""
    radii = rng.uniform(0.03, 0.15, 4)
    shafts = int(rng.integers(2, 4))
    ratios = [1.0, -radii[0] / radii[1]]
    ratios.append(-ratios[1] * radii[2] / radii[3])
    rotors = tuple(random_rotor(rng, i, ratios[i]) for i in range(shafts))
    meshes = []
    for i in range(shafts - 1):
        angle, pressure = rng.uniform(0.0, 2.0 * math.pi), rng.uniform(0.2, 0.5)
        pitch = radii[2 * i] * math.tan(pressure)
        meshes.append(
            MeshSpring(
                rotors=(i, i + 1),
                positions=tuple(place_on(rng, r.length) for r in rotors[i : i + 2]),
                offsets=tuple(rng.uniform(-0.01, 0.01, 2)),
                base_radii=tuple(radii[2 * i : 2 * i + 2]),
                direction=(math.cos(angle), math.sin(angle)),
                sense=1 if ratios[i] > 0.0 else -1,
                stiffness=rng.uniform(1e8, 1e9),
                width=rng.uniform(0.02, 0.08),
                base_helix_angle=rng.uniform(-0.6, 0.6),
                pressure_angle=pressure,
                path=(pitch - rng.uniform(0.0, 0.01), pitch + rng.uniform(0.0, 0.01)),
            )
        )
    return RotorSystem(
        rotors=rotors, meshes=tuple(meshes), elements=3, axial_motion=True
    )
