"""A pair and its motions, read from files of fegear by numpy alone."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ExportedPair:
    """Two gears that rotate, and their stiffness table.

    Rotations are positive in the direction in which the load presses the teeth
    together, so that the driver turns forward and the driven gear backward.

    inertia : (2,) [kg m2]
    base_radius : (2,) [m]; times the rotations they sum to the deflection
    load : (2,) [N m]
    damping : viscous, along the line of action [N s/m]
    backlash : along the line of action [m]
    teeth : of driver and driven gear
    position, stiffness : (n,) over a base pitch [base pitches], [N/m]
    static_error : (n,) static transmission error under the load [m]
    static_rotation : (2,) under the load and the mean stiffness [rad]
    mean_stiffness : [N/m]
    natural_frequency : [Hz]
    """

    inertia: Array
    base_radius: Array
    load: Array
    damping: float
    backlash: float
    teeth: tuple[int, int]
    position: Array
    stiffness: Array
    static_error: Array
    static_rotation: Array
    mean_stiffness: float
    natural_frequency: float

    def stiffness_at(self, driver_rotation: float) -> float:
        """Mesh stiffness [N/m] where the driver has turned so far [rad]."""
        position = self.teeth[0] * driver_rotation / (2.0 * math.pi)
        return float(np.interp(position, self.position, self.stiffness, period=1.0))

    def force(self, driver_rotation: float, deflection: float) -> float:
        """Force of the teeth [N], of the back flanks where it is negative."""
        pressed = max(deflection, 0.0) + min(deflection + self.backlash, 0.0)
        return self.stiffness_at(driver_rotation) * pressed

    def rotation_rates(self, mesh_frequency: float) -> Array:
        """Nominal rotation rates (2,) [rad/s] at a mesh frequency [Hz]."""
        driver = 2.0 * math.pi * mesh_frequency / self.teeth[0]
        return np.array([1.0, -self.base_radius[0] / self.base_radius[1]]) * driver


@dataclass(frozen=True, eq=False)
class MeshMotion:
    """A period of the mesh: times (n,) [s], deflection [m] and tooth force [N]."""

    time: Array
    deflection: Array
    force: Array


def read_pair(folder: Path) -> ExportedPair:
    """The pair of train.npz and table.csv."""
    model = np.load(folder / "train.npz")
    comments, columns = read_csv(folder / "table.csv")
    radii = model["mesh_vectors"][0]
    teeth = [int(text) for text in comments["teeth"].split("/")]
    return ExportedPair(
        inertia=np.diag(model["M"]),
        base_radius=radii,
        load=model["load"],
        damping=float(model["C"][0, 0] / radii[0] ** 2),
        backlash=float(model["mesh_backlash_m"][0]),
        teeth=(teeth[0], teeth[1]),
        position=columns["position"],
        stiffness=columns["stiffness_N_per_m"],
        static_error=columns["ste_m"],
        static_rotation=model["static_displacement"],
        mean_stiffness=float(model["mesh_stiffness_N_per_m"][0]),
        natural_frequency=float(model["natural_frequency_Hz"][-1]),
    )


def read_motion(folder: Path, speed: float, model: int = 3) -> MeshMotion:
    """The motion of the first mesh at a mesh frequency [Hz]."""
    _, columns = read_csv(folder / f"motion-{speed:g}-model{model}.csv")
    names = "time_s", "mesh1_dte_m", "mesh1_force_N"
    return MeshMotion(*(columns[name] for name in names))


def read_csv(path: Path) -> tuple[dict[str, str], dict[str, Array]]:
    """Entries of the comment lines, and columns of a CSV file."""
    lines = path.read_text("utf-8").splitlines()
    comments = [line[2:].partition(": ") for line in lines if line.startswith("# ")]
    values = np.genfromtxt(path, delimiter=",", names=True, skip_header=len(comments))
    names = values.dtype.names or ()
    return {key: text for key, _, text in comments}, {n: values[n] for n in names}
