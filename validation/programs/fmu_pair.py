"""A pair of gears whose mesh is an FMU, simulated by FMPy.

    python -m validation.programs.fmu_pair files

The inertias are here: each step gives angles and speeds to the FMU, and takes its
torques back for a step of second order.
"""

from __future__ import annotations

import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from validation.programs.comparison import (
    ComparedValue,
    compare_motions,
    run_comparison,
)
from validation.programs.export_files import FMU, LINEAR
from validation.programs.exported_pair import (
    Array,
    ExportedPair,
    MeshMotion,
    read_motion,
    read_pair,
)

PERIODS = 60  # of the mesh, after which the start is forgotten
FORCE_TOLERANCE, MOTION_TOLERANCE = 1e-4, 1.0  # %
SENSE = np.array([1.0, -1.0])  # of the FMU, where both gears turn forward
INPUTS = "driver_angle", "driven_angle", "driver_speed", "driven_speed"
TORQUES = "driver_torque", "driven_torque"


class RunningMesh:
    """An FMU between its initialisation and its end."""

    def __init__(self, path: Path, folder: str, rates: Array) -> None:
        import fmpy
        from fmpy.fmi2 import FMU2Slave

        description = fmpy.read_model_description(str(path))
        self.references = {v.name: v.valueReference for v in description.modelVariables}
        self.slave = FMU2Slave(
            guid=description.guid,
            unzipDirectory=folder,
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName="mesh",
        )
        self.slave.instantiate()
        self.slave.setupExperiment(startTime=0.0)
        self.slave.enterInitializationMode()
        self.set_state(np.zeros(2), rates)
        self.slave.exitInitializationMode()

    def set_state(self, angle: Array, speed: Array) -> None:
        """Give angles (2,) [rad] and speeds (2,) [rad/s]."""
        references = [self.references[name] for name in INPUTS]
        self.slave.setReal(references, [*map(float, (*angle, *speed))])

    def outputs(self, names: Sequence[str]) -> list[float]:
        """Values of outputs by their names."""
        return list(self.slave.getReal([self.references[name] for name in names]))


@contextmanager
def running_mesh(path: Path, rates: Array) -> Iterator[RunningMesh]:
    """The FMU, unpacked and initialised at speeds (2,) [rad/s], and its end."""
    import fmpy

    folder = fmpy.extract(str(path))
    mesh = RunningMesh(path, folder, rates)
    try:
        yield mesh
    finally:
        mesh.slave.terminate()
        mesh.slave.freeInstance()
        shutil.rmtree(folder, ignore_errors=True)


def simulate_pair(
    path: Path, pair: ExportedPair, mesh_frequency: float, steps: int
) -> MeshMotion:
    """The last period of the mesh [Hz], with so many steps in each."""
    step = 1.0 / (steps * mesh_frequency)
    load, rates = SENSE * pair.load, SENSE * pair.rotation_rates(mesh_frequency)
    angle, speed = SENSE * pair.static_rotation, rates
    rows = []
    with running_mesh(path, rates) as mesh:

        def acceleration(angle: Array, speed: Array) -> Array:
            mesh.set_state(angle, speed)
            return np.asarray((load + mesh.outputs(TORQUES)) / pair.inertia)

        before = acceleration(angle, speed)
        for number in range(PERIODS * steps + 1):
            if number >= (PERIODS - 1) * steps:
                rows.append(mesh.outputs(("deflection", "mesh_force")))
            angle = angle + step * speed + 0.5 * step**2 * before
            after = acceleration(angle, speed + step * before)
            speed = speed + 0.5 * step * (before + after)
            before = acceleration(angle, speed)
            mesh.slave.doStep(number * step, step)
    deflection, force = np.array(rows).T
    time = np.arange(steps + 1, dtype=np.float64) * step
    return MeshMotion(time, deflection, force)


def forces_at(
    path: Path, pair: ExportedPair, mesh_frequency: float, motion: MeshMotion
) -> Array:
    """Forces (n,) of the FMU at the rotations and deflections of a motion."""
    rates = SENSE * pair.rotation_rates(mesh_frequency)
    one, two = pair.base_radius
    with running_mesh(path, rates) as mesh:
        forces = []
        for time, deflection in zip(motion.time, motion.deflection, strict=True):
            driver = rates[0] * time
            angle = np.array([driver, (one * driver - deflection) / two])
            mesh.set_state(angle, rates)
            forces += mesh.outputs(("mesh_force",))
    return np.array(forces)


def compare(folder: Path) -> list[ComparedValue]:
    """Rows of forces at equal angles, and of motions with steps of several sizes."""
    path, pair = folder / FMU, read_pair(folder)
    ours = read_motion(folder, LINEAR, model=1)
    forces = forces_at(path, pair, LINEAR, ours)
    distance = float(np.abs(forces - ours.force).max())
    rows = [
        ComparedValue(
            "force at equal angles, largest distance",
            "N",
            0.0,
            distance,
            float(ours.force.max()),
            FORCE_TOLERANCE,
        )
    ]
    for steps in (64, 128, 256):
        theirs = simulate_pair(path, pair, LINEAR, steps)
        label = f"{LINEAR} Hz, {steps} steps"
        tolerance = MOTION_TOLERANCE if steps == 256 else None
        rows += compare_motions(label, ours, theirs, tolerance)
    return rows


if __name__ == "__main__":
    run_comparison(__doc__ or "", compare, ("fmpy", "pythonfmu", "numpy"))
