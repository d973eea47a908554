"""How the loads of a mesh vary over its cycle while both gears stand still on average.

Three effects excite a machine in which gears move in space: the transmission error, the
mesh force it takes to hold it off, and the place of the load along the axis, which
wanders (shuttling). All are in the variation of the loads W that belong to the motions
r of the gears, the transmission error and five of each axis. At the mean of these
motions, to first order,

    W(t) = W_0(t) - K(t) (r_0(t) - mean r_0),

with the loads W_0 and the stiffness K of the contact at its torque, and with axes that
are held where they are on average, so that r_0 has the transmission error alone.
Bodies that twist over the width are elastic as teeth are.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fegear.contact.solve import solve_cycle
from fegear.contact.width.contact import WidthContact
from fegear.contact.width.supports import MOTIONS, AxisSupports, GearSupport
from fegear.gearset.power_path import mesh_torques_at
from fegear.statics.axes import body_torsion
from fegear.statics.machine import MachineAtRest, loads_on_axes
from lumped.common.array_types import Array, Complex


@dataclass(frozen=True, eq=False)
class StandingMesh:
    """Loads and stiffness of a mesh over its cycle, with axes where they are at rest.

    torque : on the driver [N m]
    error : transmission error (n,) at n equally spaced positions [m]
    axes : motions (10,) of the axes of driver and driven gear along the push, the
        normal and the axis, and slopes toward both [m and rad]
    loads : (n, 11) that belong to the transmission error and to these motions
    stiffness : (n, 11, 11) of the teeth in contact
    """

    torque: float
    error: Array
    axes: Array
    loads: Array
    stiffness: Array

    @property
    def variation(self) -> LoadVariation:
        """Loads at the mean motion of the gears."""
        change = self.error - self.error.mean()
        loads = self.loads - self.stiffness[:, :, 0] * change[:, None]
        return LoadVariation(
            stiffness=self.stiffness.mean(axis=0),
            loads=loads - loads.mean(axis=0),
            mean_force=float(self.loads[0, 0]),
        )


@dataclass(frozen=True, eq=False)
class LoadVariation:
    """Loads of a mesh over its cycle at the mean motion of its gears.

    stiffness : mean K (11, 11) of the teeth in contact
    loads : (n, 11) less their mean, at n equally spaced positions
    mean_force : along the push [N]
    """

    stiffness: Array
    loads: Array
    mean_force: float

    def harmonics(self, count: int) -> Complex:
        """Complex amplitudes (count, 11) of the first harmonics of the mesh cycle."""
        spectrum = np.fft.rfft(self.loads, axis=0)
        return np.asarray(2.0 / len(self.loads) * spectrum[1 : count + 1])


def standing_mesh(machine: MachineAtRest, mesh: int, positions: int) -> StandingMesh:
    """Loads of a mesh with axes held where they are at rest, at its torque."""
    problem, gear_set = machine.problems[mesh], machine.gear_set
    if not isinstance(problem.solver, WidthContact):
        raise TypeError("loads are uniform over the face width")
    torque = mesh_torques_at(gear_set, machine.torque)[mesh]
    frame = machine.axes.frames[mesh]
    axes = [frame @ machine.motions[gear] for gear in gear_set.meshes[mesh].gears]
    driver, driven = (
        GearSupport(
            np.zeros((MOTIONS, MOTIONS)), motion / torque, body_torsion(gear_set, gear)
        )
        for gear, motion in zip(gear_set.meshes[mesh].gears, axes, strict=True)
    )
    standing = replace(problem.solver, supports=AxisSupports(driver, driven))
    held = replace(problem, solver=standing)
    cycle = solve_cycle(held, torque, np.arange(positions) / positions)
    on_axes = -loads_on_axes(held, cycle).reshape(positions, 2 * MOTIONS)
    force = np.full(positions, torque / cycle.base_radius)
    return StandingMesh(
        torque=torque,
        error=cycle.ste[0],
        axes=np.concatenate(axes),
        loads=np.column_stack([force, on_axes]),
        stiffness=cycle.face.rigid_stiffness[0],
    )
