"""Trains in openTorsion: natural frequencies, and the response to transmission error.

    python -m validation.programs.opentorsion_train files

openTorsion is linear with a constant stiffness of each mesh, as model 2 of fegear.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from validation.programs.comparison import (
    ComparedValue,
    compare_motions,
    run_comparison,
)
from validation.programs.export_files import LINEAR
from validation.programs.exported_pair import (
    Array,
    ExportedPair,
    MeshMotion,
    read_motion,
    read_pair,
)

FREQUENCY_TOLERANCE, MOTION_TOLERANCE = 1e-6, 1.0  # %
GROUND_INERTIA = 1e9  # of what turns uniformly [kg m2]


def build_assembly(
    inertia: Array,
    radii: Array,
    mesh_stiffness: Array,
    ground_stiffness: Array,
    damping: float = 0.0,
) -> Any:
    """Gears in a row, of which each drives the next.

    radii : (m, 2), of the driver and the driven gear of each mesh
    ground_stiffness : of shafts from the gears to what turns uniformly [N m/rad]
    damping : viscous, along the line of action of each mesh [N s/m]
    """
    from opentorsion import Assembly, Disk, ElasticGear, Shaft

    discs = [Disk(node, value) for node, value in enumerate(inertia)]
    ground = len(discs)
    shafts = [Shaft(i, ground, k=k) for i, k in enumerate(ground_stiffness) if k > 0.0]
    if shafts:
        discs.append(Disk(ground, GROUND_INERTIA))
    gears = [ElasticGear(0, 0.0, radii[0, 0])]
    for m, (k, (driver, driven)) in enumerate(zip(mesh_stiffness, radii, strict=True)):
        at_driver = driver**2  # stiffness is that of the driver's rotation [N m/rad]
        gears.append(
            ElasticGear(
                m + 1,
                0.0,
                driven,
                k=k * at_driver,
                c=damping * at_driver,
                parent=gears[-1],
            )
        )
    return Assembly(shafts, discs, elastic_gear_elements=gears)


def natural_frequencies(assembly: Any) -> Array:
    """Natural frequencies without that of the free rotation [Hz]."""
    squares, _ = assembly.undamped_modal_analysis()
    return np.sqrt(np.sort(np.real(squares))[1:]) / (2.0 * np.pi)


def forced_motion(
    pair: ExportedPair, assembly: Any, mesh_frequency: float
) -> MeshMotion:
    """The steady motion under the load and the static transmission error."""
    lines = np.fft.rfft(pair.static_error)[1:] * 2.0 / pair.static_error.size
    lines[-1] *= 0.5  # half of the sampling rate
    angular = 2.0 * np.pi * mesh_frequency * np.arange(1, lines.size + 1)
    torque = pair.mean_stiffness * pair.base_radius[:, None] * lines
    rotation, _ = assembly.ss_response(torque, angular)
    time = np.arange(pair.position.size + 1) / (pair.position.size * mesh_frequency)
    waves = np.exp(1j * np.outer(angular, time))
    static = pair.base_radius @ pair.static_rotation
    deflection = static + np.real((pair.base_radius @ rotation) @ waves)
    error = np.append(pair.static_error, pair.static_error[0]) - np.mean(
        pair.static_error
    )
    return MeshMotion(time, deflection, pair.mean_stiffness * (deflection - error))


def compare(folder: Path) -> list[ComparedValue]:
    """Natural frequencies of a train of three gears, and a forced motion of a pair."""
    idler = np.load(folder / "idler.npz")
    rows, stiffness = idler["mesh_vectors"], idler["mesh_stiffness_N_per_m"]
    radii = np.array([np.abs(row[m : m + 2]) for m, row in enumerate(rows)])
    ground = np.diag(idler["K"] - rows.T @ (stiffness[:, None] * rows))
    ground = np.where(ground > 1e-9 * np.diag(idler["K"]), ground, 0.0)
    train = build_assembly(np.diag(idler["M"]), radii, stiffness, ground)
    ours = idler["natural_frequency_Hz"]
    frequencies = [
        ComparedValue(
            f"liu-idler: natural frequency {i + 1}",
            "Hz",
            float(both[0]),
            float(both[1]),
            tolerance=FREQUENCY_TOLERANCE,
        )
        for i, both in enumerate(zip(ours, natural_frequencies(train), strict=True))
    ]
    pair = read_pair(folder)
    assembly = build_assembly(
        pair.inertia,
        pair.base_radius[None, :],
        np.array([pair.mean_stiffness]),
        np.zeros(2),
        pair.damping,
    )
    theirs = forced_motion(pair, assembly, LINEAR)
    motion = read_motion(folder, LINEAR, model=2)
    label = f"liu-pair, {LINEAR} Hz"
    return [*frequencies, *compare_motions(label, motion, theirs, MOTION_TOLERANCE)]


if __name__ == "__main__":
    run_comparison(__doc__ or "", compare, ("opentorsion", "numpy", "scipy"))
