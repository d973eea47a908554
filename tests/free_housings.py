"""Housings that tests share: random ones, and rigid motions of their nodes."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fegear.files.matlab import write_matlab
from lumped.rotors.housing import Housing, HousingNode


def node_motions(points):
    """Motions (6 n, 6) of nodes at points (n, 3) by those of a rigid body."""
    rows = []
    for x, y, z in points:
        row = np.eye(6)
        row[:3, 3:] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
        rows.append(row)
    return np.concatenate(rows)


def random_definite(rng, scales):
    """Symmetric matrix with a diagonal of about the scales (n,)."""
    size = len(scales)
    factor = rng.normal(size=(size, size)) / np.sqrt(size) + np.eye(size)
    root = np.sqrt(scales)
    return root[:, None] * (factor @ factor.T) * root


def random_housing(rng, nodes, modes=0, damping=True, stiffness=2e8):
    """Held housing with Craig-Bampton modes."""
    of_nodes = [1.0, 1.0, 1.0, 1e-2, 1e-2, 1e-2] * len(nodes)
    stiffnesses = stiffness * np.array(of_nodes)
    masses = 20.0 * np.array(of_nodes)
    stiffnesses = np.concatenate([stiffnesses, np.geomspace(1e6, 1e8, modes)])
    masses = np.concatenate([masses, np.ones(modes)])
    mass = random_definite(rng, masses)
    held = random_definite(rng, stiffnesses)
    size = len(masses) - modes
    # modes of a housing that is held at its nodes are coupled by masses alone
    held[:size, size:] = held[size:, :size] = 0.0
    held[size:, size:] = np.diag(np.diag(held[size:, size:]))
    return Housing(
        stiffness=held,
        mass=mass,
        damping=random_definite(rng, 1e-5 * stiffnesses) if damping else None,
        nodes=nodes,
    )


def free_block(rng, points, nodes, mass=30.0, inertia=0.2, stiffness=1e10):
    """Housing on no feet, whose nodes have its mass."""
    rigid = node_motions(points)
    inside = np.eye(len(rigid)) - rigid @ np.linalg.pinv(rigid)
    held = inside @ random_definite(rng, np.full(len(rigid), stiffness)) @ inside
    count = len(points)
    masses = np.array([mass] * 3 + [inertia] * 3) / count
    return Housing(
        stiffness=0.5 * (held + held.T),
        mass=np.diag(np.tile(masses, count)),
        nodes=nodes,
    )


def bearing_nodes(system):
    """A node for every bearing of a machine, in order."""
    return tuple(
        HousingNode(rotor, bearing)
        for rotor, one in enumerate(system.rotors)
        for bearing in range(len(one.bearings))
    )


def write_housing(path, housing):
    """A housing as a MAT file."""
    rows = [
        (0, 1) if n is None else (n.rotor + 1, n.bearing + 1) for n in housing.nodes
    ]
    damping = {} if housing.damping is None else {"damping": housing.damping}
    matrices = {"stiffness": housing.stiffness, "mass": housing.mass}
    write_matlab(path, {**matrices, **damping, "nodes": np.array(rows, dtype=float)})


def two_shafts():
    """Housing in `housing.mat` of two shafts with two bearings, and a sensor."""
    nodes = tuple(HousingNode(shaft, bearing) for shaft in (0, 1) for bearing in (0, 1))
    return random_housing(np.random.default_rng(99), (*nodes, None), modes=2)


def sensor_alone():
    """Housing in `sensor.mat` of no shaft."""
    return random_housing(np.random.default_rng(99), (None,))


HOUSINGS = Path(__file__).parent / "housings"
STORED = {"two-shafts.mat": two_shafts, "sensor.mat": sensor_alone}

if __name__ == "__main__":
    HOUSINGS.mkdir(exist_ok=True)
    for name, housing_of in STORED.items():
        write_housing(HOUSINGS / name, housing_of())
