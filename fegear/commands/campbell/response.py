"""Vibration of the whole machine over the speed, excited by its meshes.

Motions are small: teeth keep contact with their mean stiffness, and their loads vary as
they do at rest, see `fegear.statics.load_variation`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fegear.gearset.model import GearSet
from fegear.gearset.phases import mesh_phases
from fegear.gearset.speeds import SECONDS_PER_MINUTE
from lumped.common.array_types import Array, Complex
from lumped.figures.drawing import draw_legend, draw_title
from lumped.rotors.description import RotorSystem
from lumped.rotors.mesh_springs import rigid_motions
from lumped.rotors.response import (
    HarmonicForce,
    bearing_forces,
    housing_accelerations,
    steady_response,
)
from lumped.rotors.whirl import WhirlProblem

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from fegear.statics.load_variation import LoadVariation

EQUAL_ORDERS = 1e-9  # of frequencies over the speed, whose vibrations add up
HARMONICS = 8  # of every mesh; teeth excite little above
LEGEND_COLUMNS = 2
LOWEST_FORCE = 1e-4  # of the largest force between teeth


@dataclass(frozen=True, eq=False)
class MachineResponse:
    """Vibration over the speed, RMS without mean values.

    rpm : speeds (s,) of the first mesh's driver
    bearings : shaft, by the names of its gears, and position [m] of every bearing
    bearing_force : (s, bearings, 3) of bearings on shafts along x, y, z [N]
    mesh_force : (s, meshes) between teeth along the push, in the section [N]
    peak_mesh_force : (s, meshes) at most, if all harmonics met [N]
    mean_mesh_force : (meshes,) at rest [N]
    housing_nodes : shaft and position [m] of the bearing at every node of the housing,
        empty and None of further ones
    housing_acceleration : (s, nodes, 3) along x, y, z [m/s2]
    damping_ratio : of every mode at rest, besides the damping of bearings
    grows : (s,) whether free vibration grows with that damping, so that no forced one
        lasts
    """

    rpm: Array
    bearings: tuple[tuple[str, float], ...]
    bearing_force: Array
    mesh_force: Array
    peak_mesh_force: Array
    mean_mesh_force: Array
    housing_nodes: tuple[tuple[str, float | None], ...]
    housing_acceleration: Array
    damping_ratio: float
    grows: NDArray[np.bool_]

    @property
    def radial_force(self) -> Array:
        """RMS (s, bearings) of both directions across the axis [N]."""
        return np.asarray(np.hypot(*np.moveaxis(self.bearing_force[..., :2], -1, 0)))

    @property
    def may_lose_contact(self) -> Array:
        """Speeds and meshes (s, meshes) where the force between teeth may vanish."""
        return np.asarray(self.peak_mesh_force > self.mean_mesh_force)

    def bearing_rows(self) -> Iterator[tuple[Any, ...]]:
        """Speed, shaft, position and RMS forces of every bearing."""
        for rpm, forces in zip(self.rpm.tolist(), self.bearing_force, strict=True):
            for bearing, force in zip(self.bearings, forces.tolist(), strict=True):
                yield (rpm, *bearing, *force)

    def mesh_rows(self) -> Iterator[tuple[Any, ...]]:
        """Speed, mesh, RMS and largest force, and the mean one."""
        of_speeds = zip(
            self.rpm.tolist(), self.mesh_force, self.peak_mesh_force, strict=True
        )
        for rpm, *forces in of_speeds:
            of_meshes = zip(*forces, self.mean_mesh_force, strict=True)
            for mesh, values in enumerate(of_meshes, start=1):
                yield (rpm, mesh, *map(float, values))

    def housing_rows(self) -> Iterator[tuple[Any, ...]]:
        """Speed, node, bearing and RMS accelerations of every node of the housing."""
        of_speeds = zip(self.rpm.tolist(), self.housing_acceleration, strict=True)
        for rpm, accelerations in of_speeds:
            of_nodes = zip(self.housing_nodes, accelerations.tolist(), strict=True)
            for number, (node, acceleration) in enumerate(of_nodes, start=1):
                yield (rpm, number, *node, *acceleration)

    def largest(self) -> dict[str, list[dict[str, Any]]]:
        """Largest values over the speed of bearings, meshes and housing, and where."""

        def at(values: Array, name: str, unit: str = "N") -> dict[str, float | None]:
            index = int(values.argmax())
            if not values[index]:  # a bearing that floats along the axis
                return {f"{name}_rms_{unit}": 0.0, f"{name}_at_rpm": None}
            return {
                f"{name}_rms_{unit}": float(values[index]),
                f"{name}_at_rpm": float(self.rpm[index]),
            }

        radial = self.radial_force
        total = np.linalg.norm(self.housing_acceleration, axis=-1)
        return {
            "bearings": [
                {"shaft": shaft, "position_mm": 1e3 * position}
                | at(radial[:, b], "radial_force")
                | at(self.bearing_force[:, b, 2], "axial_force")
                for b, (shaft, position) in enumerate(self.bearings)
            ],
            "meshes": [
                {"mesh": m + 1, "mean_force_N": float(force)}
                | at(self.mesh_force[:, m], "force")
                for m, force in enumerate(self.mean_mesh_force)
            ],
            "housing": [
                {"node": n + 1, "shaft": shaft}
                | at(total[:, n], "acceleration", "m_per_s2")
                for n, (shaft, _) in enumerate(self.housing_nodes)
            ],
        }


def machine_response(
    gear_set: GearSet,
    system: RotorSystem,
    problem: WhirlProblem,
    variations: Sequence[LoadVariation],
    rpm: Array,
    damping_ratio: float,
    report: Callable[[int], None] = lambda done: None,
) -> MachineResponse:
    """Vibration at speeds of the first mesh's driver (s,) [rpm], which may be at rest.

    variations : of the loads of all meshes
    report : called with the number of finished speeds
    """
    matrices = problem.system
    motions = [rigid_motions(matrices, mesh) for mesh in system.meshes]
    excitations = _excitations(gear_set, system, motions, variations)
    forces = [HarmonicForce(order=one.order, force=one.force) for one in excitations]
    orders = np.array([one.order for one in excitations])
    # of the teeth of a mesh (e, meshes), by its own harmonics
    own_loads = np.zeros((orders.size, len(variations)), np.complex128)
    for row, one in enumerate(excitations):
        own_loads[row, one.mesh] = one.loads[0]
    on_bearings, on_meshes, peaks, of_housing, grows = [], [], [], [], []
    for done, speed in enumerate((2.0 * math.pi / SECONDS_PER_MINUTE * rpm).tolist()):
        report(done)
        grows.append(problem.grows(speed, damping_ratio))
        motion = steady_response(problem, forces, speed, damping_ratio)
        at_speed = system, matrices, orders * speed, motion
        of_bearings = bearing_forces(*at_speed)
        accelerations = np.reshape(
            housing_accelerations(*at_speed), (-1, orders.size, 3)
        )
        of_housing.append(_rms(orders, np.swapaxes(accelerations, 0, 1)))
        of_meshes = own_loads + np.stack(
            [
                (motion @ rows.T) @ variation.stiffness[0]
                for rows, variation in zip(motions, variations, strict=True)
            ],
            axis=1,
        )
        on_bearings.append(_rms(orders, np.stack(of_bearings, axis=1)))
        on_meshes.append(_rms(orders, of_meshes))
        peaks.append(np.abs(of_meshes).sum(axis=0))
    return MachineResponse(
        rpm=rpm,
        bearings=tuple(
            (rotor.name, bearing.position)
            for rotor in system.rotors
            for bearing in rotor.bearings
        ),
        bearing_force=np.array(on_bearings),
        mesh_force=np.array(on_meshes),
        peak_mesh_force=np.array(peaks),
        mean_mesh_force=np.array([one.mean_force for one in variations]),
        housing_nodes=tuple(_housing_nodes(system)),
        housing_acceleration=np.array(of_housing),
        damping_ratio=damping_ratio,
        grows=np.array(grows),
    )


def _housing_nodes(system: RotorSystem) -> Iterator[tuple[str, float | None]]:
    for node in () if system.housing is None else system.housing.nodes:
        if node is None:
            yield "", None
        else:
            rotor = system.rotors[node.rotor]
            yield rotor.name, rotor.bearings[node.bearing].position


@dataclass(frozen=True, eq=False)
class _Excitation:
    """A harmonic of a mesh: loads (11,) of its teeth and the force (n,) by them."""

    mesh: int
    order: float
    loads: Complex
    force: Complex


def _excitations(
    gear_set: GearSet,
    system: RotorSystem,
    motions: Sequence[Array],
    variations: Sequence[LoadVariation],
) -> list[_Excitation]:
    excitations = []
    for mesh, (spring, phase, variation) in enumerate(
        zip(system.meshes, mesh_phases(gear_set), variations, strict=True)
    ):
        ratio = abs(system.rotors[spring.rotors[0]].speed_ratio)
        for number, loads in enumerate(variation.harmonics(HARMONICS), start=1):
            turned = loads * np.exp(2j * math.pi * number * phase.value)
            excitations.append(
                _Excitation(
                    mesh=mesh,
                    order=number * spring.teeth * ratio,
                    loads=turned,
                    force=-motions[mesh].T @ turned,
                )
            )
    return excitations


def _rms(orders: Array, amplitudes: Complex) -> Array:
    """Root mean square of vibrations (e, ...), those of one order added up first."""
    square = np.zeros(amplitudes.shape[1:])
    remaining = np.ones(orders.size, bool)
    for order in orders:
        together = remaining & (np.abs(orders - order) <= EQUAL_ORDERS * order)
        square += 0.5 * np.abs(amplitudes[together].sum(axis=0)) ** 2
        remaining &= ~together
    return np.sqrt(square)


def draw_response(response: MachineResponse, title: str = "") -> Figure:
    """Draw RMS forces of bearings, across and along the axes, and between teeth."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 8.5), layout="constrained")
    across, along, teeth = figure.subplots(3, 1, sharex=True)
    for number, (shaft, position) in enumerate(response.bearings):
        label = f"bearing of {shaft}, {1e3 * position:.4g} mm"
        across.semilogy(response.rpm, response.radial_force[:, number], label=label)
        axial = response.bearing_force[:, number, 2]
        if axial.any():
            color = across.lines[-1].get_color()
            along.semilogy(response.rpm, axial, color=color)
    for mesh, mean in enumerate(response.mean_mesh_force.tolist()):
        (line,) = teeth.semilogy(
            response.rpm, response.mesh_force[:, mesh], label=f"mesh {mesh + 1}"
        )
        teeth.axhline(mean, color=line.get_color(), linestyle=":")
    # at rest nothing but round-off is left of it
    teeth.set_ylim(bottom=LOWEST_FORCE * response.mesh_force.max())
    across.set_ylabel("bearings, radial [N RMS]")
    along.set_ylabel("bearings, axial [N RMS]")
    teeth.set_ylabel("between teeth [N RMS],\nmean dotted [N]")
    teeth.set_xlabel("speed of the first driver [rpm]")
    for axes in (across, along, teeth):
        axes.grid(alpha=0.25)
    handles = across.get_legend_handles_labels()[0]
    draw_legend(figure, handles, LEGEND_COLUMNS)
    teeth.legend(fontsize="small")
    draw_title(figure, title)
    return figure
