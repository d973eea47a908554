"""A pair of gears in ROSS: two short rotors and a mesh with our table.

    python -m validation.programs.ross_pair files

It needs an environment of its own, without fegear, whose figures need another plotly:

    python -m venv ross && ross/bin/pip install ross-rotordynamics==2.3.0 "plotly<6"

Shafts without mass on stiff bearings leave rotations alone, as in fegear. The mesh of
ROSS has no damping, which a subclass adds, and its teeth pull at each other where they
should part; `add_to_RHS` takes that force away, one step late.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from validation.programs.comparison import (
    ComparedValue,
    compare_motions,
    run_comparison,
)
from validation.programs.export_files import LINEAR, NONLINEAR
from validation.programs.exported_pair import (
    Array,
    ExportedPair,
    MeshMotion,
    read_motion,
    read_pair,
)

PERIODS = 50  # of the mesh, after which the start is forgotten
TOLERANCE = 1.0  # %, of motions in permanent contact
SUPPORT = 1e13  # stiffness of bearings [N/m], above that of the mesh by 3e4
SIGN = np.array([1.0, -1.0])  # ROSS counts rotations so that r1 q1 - r2 q2 is closed


def build_rotors(pair: ExportedPair) -> Any:
    """Both rotors with a mesh that takes its stiffness from our table."""
    import ross

    light = ross.Material("light", rho=1e-3, E=1e14, Poisson=0.3)
    rotors = []
    for teeth, inertia, radius in zip(
        pair.teeth, pair.inertia, pair.base_radius, strict=True
    ):
        shaft = ross.ShaftElement(L=0.02, idl=0.0, odl=0.03, material=light)
        gear = ross.GearElement(
            n=0,
            m=1.0,
            Id=inertia,
            Ip=inertia,
            n_teeth=teeth,
            base_diameter=2.0 * radius,
        )
        bearings = [
            ross.BearingElement(n=n, kxx=SUPPORT, kyy=SUPPORT, kzz=SUPPORT, cxx=0.0)
            for n in range(2)
        ]
        rotors.append(ross.Rotor([shaft], [gear], bearings))

    class DampedRotor(ross.MultiRotor):
        """Two rotors with damping between the teeth."""

        def C(self, frequency: float) -> Array:
            gears = self.mesh.driving_gear, self.mesh.driven_gear
            dofs = [i for gear in gears for i in gear.dof_global_index.values()]
            matrix = super().C(frequency)
            matrix[np.ix_(dofs, dofs)] += pair.damping * self.coupling_matrix()
            return np.asarray(matrix)

    train = DampedRotor(
        *rotors,
        coupled_nodes=(0, 0),
        gear_mesh_stiffness=pair.mean_stiffness,
        update_mesh_stiffness=True,
    )
    pitch = 2.0 * math.pi / pair.teeth[0]
    train.mesh.theta_range = pitch * np.append(pair.position, 1.0)
    train.mesh.stiffness_range = np.append(pair.stiffness, pair.stiffness[0])
    return train


def simulate_pair(
    pair: ExportedPair, mesh_frequency: float, steps: int, may_separate: bool
) -> MeshMotion:
    """The last period of the mesh [Hz] by ROSS.

    steps : per period
    may_separate : take away the force of teeth that pull
    """
    train = build_rotors(pair)
    time = np.arange(PERIODS * steps + 1) / (steps * mesh_frequency)
    rotations = [
        gear.dof_global_index[f"theta_{gear.n}"]
        for gear in (train.mesh.driving_gear, train.mesh.driven_gear)
    ]
    load = np.zeros((time.size, train.ndof))
    load[:, rotations] = SIGN * pair.load
    rate = pair.rotation_rates(mesh_frequency)[0]
    row = np.zeros(train.ndof)  # times the displacements it is the deflection
    row[rotations] = SIGN * pair.base_radius
    parting = parting_force(pair, row, rate * time)
    response = train.run_time_response(
        np.full(time.size, rate),
        load,
        time,
        method="newmark",
        **({"add_to_RHS": parting} if may_separate else {}),
    )
    deflection = response.yout[-steps - 1 :] @ row
    stiffness = np.array([pair.stiffness_at(x) for x in rate * time[-steps - 1 :]])
    shown = np.maximum(deflection, 0.0) if may_separate else deflection
    return MeshMotion(time[: steps + 1], deflection, stiffness * shown)


def parting_force(
    pair: ExportedPair, row: Array, rotation: Array
) -> Callable[..., Array]:
    """What makes the linear mesh of ROSS one with backlash, at each of its steps."""

    def added(step: int, **state: Array) -> Array:
        deflection = float(row @ state["disp_resp"])
        linear = pair.stiffness_at(rotation[step]) * deflection
        return (linear - pair.force(rotation[step], deflection)) * row

    return added


def compare(folder: Path) -> list[ComparedValue]:
    """Rows in permanent contact, and with contact loss by a mesh that pulls."""
    pair = read_pair(folder)
    cases = (
        (LINEAR, 128, False, TOLERANCE),
        (NONLINEAR, 128, False, None),
        (NONLINEAR, 128, True, None),
        (NONLINEAR, 256, True, None),
    )
    rows = []
    for speed, steps, may_separate, tolerance in cases:
        theirs = simulate_pair(pair, speed, steps, may_separate)
        mesh = "with loss of contact" if may_separate else "of ROSS"
        label = f"{speed} Hz, mesh {mesh}, {steps} steps"
        rows += compare_motions(label, read_motion(folder, speed), theirs, tolerance)
    return rows


if __name__ == "__main__":
    run_comparison(__doc__ or "", compare, ("ross-rotordynamics", "plotly", "numpy"))
