"""Random trains of shafts with helical gears in space, which tests share."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from machines_in_space import random_machine

from lumped.rotors.mesh_springs import approach_of_motions
from lumped.train.bodies import Gear
from lumped.train.space import MotionInSpace, motion_in_space
from lumped.train.system import LumpedSystem
from lumped.train.train import Mesh, Shaft, Train
from lumped.train.width_springs import WidthLaw, with_mean_matrix

POSITIONS = 32
ANGLE = 2.0 * np.pi * np.arange(POSITIONS) / POSITIONS


def waves(rng: Any, mean: float, variation: float) -> Any:
    """A quantity over the mesh cycle with two harmonics."""
    first, second = rng.uniform(0.0, 2.0 * np.pi, 2)
    wave = np.cos(ANGLE + first) + 0.3 * np.cos(2.0 * ANGLE + second)
    return mean * (1.0 + variation * wave)


def random_law(rng: Any, mesh: Any, force: float, variation: float = 0.1) -> WidthLaw:
    """A law of a mesh at a force whose center of stiffness wanders."""
    k = waves(rng, mesh.stiffness, variation)
    center = waves(rng, 0.1 * mesh.width, 1.0 if variation else 0.0)
    spread = waves(rng, mesh.width / np.sqrt(12.0), 0.5 * variation)
    load_center = center + waves(rng, 0.03 * mesh.width, 0.5)
    error = waves(rng, force / mesh.stiffness, 0.2)
    law = WidthLaw(
        rows=approach_of_motions(mesh),
        approach=np.column_stack([error, waves(rng, 2e-5, 0.1)]),
        loads=force * np.column_stack([np.ones(POSITIONS), load_center]),
        slopes=k[:, None]
        * np.column_stack([np.ones(POSITIONS), center, center**2 + spread**2]),
    )
    return law.about(float((k * center).mean() / k.mean()))


def train_in_space(
    rng: Any, *, force: float = 3000.0, damping: float = 0.03, **changes: Any
) -> LumpedSystem:
    """Shafts in a row whose teeth are of random stiffness.

    changes : `variation` of the laws, `bound` of `motion_in_space`, `backlash`, and
        `across`, a stiffness of bearings across [N/m]
    """
    machine = random_machine(rng)
    count = len(machine.meshes)
    teeth = rng.integers(15, 40, 2 * count)
    ratios = [1.0]
    for m in range(count):
        ratios.append(-ratios[-1] * teeth[2 * m] / teeth[2 * m + 1])
    module = rng.uniform(0.004, 0.006)
    across = changes.get("across", 0.0)
    rotors = tuple(
        replace(
            rotor,
            speed_ratio=float(ratio),
            bearings=tuple(
                replace(
                    b,
                    stiffness=(b.stiffness[0], across, -across, b.stiffness[3]),
                    damping=(300.0, 0.0, 0.0, 200.0),
                    axial_damping=100.0,
                )
                for b in rotor.bearings
            ),
        )
        for rotor, ratio in zip(machine.rotors, ratios, strict=True)
    )
    meshes = tuple(
        replace(
            mesh,
            base_radii=tuple(0.5 * module * teeth[2 * m : 2 * m + 2]),
            teeth=int(teeth[2 * m]),
        )
        for m, mesh in enumerate(machine.meshes)
    )
    variation = changes.get("variation", 0.1)
    forces = [force]
    for m in range(count - 1):
        forces.append(forces[-1] * teeth[2 * m + 1] / teeth[2 * m + 2])
    laws = [
        random_law(rng, *pair, variation) for pair in zip(meshes, forces, strict=True)
    ]
    gears = tuple(
        Gear(
            name=f"gear {i + 1}",
            teeth=int(z),
            base_radius=0.5 * module * float(z),
            inertia=1.0,
            torque=0.0,
        )
        for i, z in enumerate(teeth)
    )
    first, last = force * gears[0].base_radius, forces[-1] * gears[-1].base_radius
    out = 1.0 if ratios[-1] < 0.0 else -1.0
    gears = (
        replace(gears[0], torque=first),
        *gears[1:-1],
        replace(gears[-1], torque=out * last),
    )
    train = Train(
        gears=gears,
        meshes=tuple(
            Mesh(
                driver=2 * m,
                driven=2 * m + 1,
                pressure_angle=0.35,
                phase=float(rng.uniform()),
                backlash=changes.get("backlash", np.inf),
            )
            for m in range(count)
        ),
        shafts=tuple(Shaft(gears=(2 * m + 1, 2 * m + 2)) for m in range(count - 1)),
        damping_ratio=damping,
    )
    machine = replace(
        machine,
        rotors=rotors,
        meshes=tuple(
            with_mean_matrix(*pair) for pair in zip(meshes, laws, strict=True)
        ),
    )
    places = [
        (mesh.rotors[side], mesh.positions[side])
        for mesh in machine.meshes
        for side in (0, 1)
    ]
    space: MotionInSpace = motion_in_space(
        machine,
        laws,
        places,
        [gear.torque for gear in gears],
        changes.get("bound", 1.0),
    )
    return LumpedSystem(train, tuple(law.excitation for law in laws), space=space)
