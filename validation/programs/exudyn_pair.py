"""A pair of gears in Exudyn: two bodies that rotate and a spring with our table.

    python -m validation.programs.exudyn_pair files

Both bodies turn; the spring takes its stiffness from the rotation of the driver.
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
from validation.programs.export_files import LINEAR, NONLINEAR
from validation.programs.exported_pair import (
    ExportedPair,
    MeshMotion,
    read_motion,
    read_pair,
)

PERIODS, STEPS = 100, 128  # of the mesh until the start is forgotten; per period
TOLERANCE = 1.0  # %


def simulate_pair(
    pair: ExportedPair, mesh_frequency: float, nominal: bool = False
) -> MeshMotion:
    """The last period of the mesh [Hz] by Exudyn, from rest under the mean load.

    nominal : take the stiffness at the nominal rotation, as the models of fegear do,
        instead of at the rotation of the driver, which contains its vibration
    """
    import exudyn

    system = exudyn.SystemContainer()
    mbs = system.AddSystem()
    nodes = add_gears(mbs, pair, mesh_frequency)
    rate = pair.rotation_rates(mesh_frequency)[0] if nominal else None
    add_mesh(mbs, pair, nodes, rate)
    sensors = [add_sensor(mbs, node) for node in nodes]
    mbs.Assemble()
    mbs.SolveDynamic(
        simulation_settings(PERIODS / mesh_frequency),
        solverType=exudyn.DynamicSolverType.RK44,
    )
    stored = [mbs.GetSensorStoredData(sensor)[-STEPS - 1 :] for sensor in sensors]
    time, rotation = stored[0][:, 0], np.array([data[:, 1] for data in stored])
    deflection = pair.base_radius @ rotation
    turned = rotation[0] if rate is None else rate * time
    force = [pair.force(*at) for at in zip(turned, deflection, strict=True)]
    return MeshMotion(time - time[0], deflection, np.array(force))


def add_gears(mbs: Any, pair: ExportedPair, mesh_frequency: float) -> list[Any]:
    """Nodes of both gears, with their inertia and load, in nominal rotation."""
    from exudyn.itemInterface import (
        LoadCoordinate,
        MarkerNodeCoordinate,
        Node1D,
        Rotor1D,
    )

    nodes = []
    rates = pair.rotation_rates(mesh_frequency)
    for i, inertia in enumerate(pair.inertia):
        start, rate = [pair.static_rotation[i]], [rates[i]]
        node = mbs.AddNode(
            Node1D(
                referenceCoordinates=[0.0],
                initialCoordinates=start,
                initialVelocities=rate,
            )
        )
        mbs.AddObject(Rotor1D(nodeNumber=node, inertia=inertia))
        marker = mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=node, coordinate=0))
        mbs.AddLoad(LoadCoordinate(markerNumber=marker, load=pair.load[i]))
        nodes.append(node)
    return nodes


def add_mesh(
    mbs: Any, pair: ExportedPair, nodes: list[Any], nominal_rate: float | None
) -> None:
    """The spring of the mesh; its displacement is the deflection of the teeth."""
    import exudyn
    from exudyn.itemInterface import CoordinateSpringDamperExt, MarkerNodeCoordinate

    def force(
        mbs: Any, t: float, item: int, deflection: float, rate: float, *rest: float
    ) -> float:
        rotation = (
            float(mbs.GetNodeOutput(nodes[0], exudyn.OutputVariableType.Coordinates))
            if nominal_rate is None
            else nominal_rate * t
        )
        return pair.force(rotation, deflection) + pair.damping * rate

    markers = [
        mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=node, coordinate=0))
        for node in nodes
    ]
    mbs.AddObject(
        CoordinateSpringDamperExt(
            markerNumbers=markers,
            factor0=-pair.base_radius[0],  # factor1 q1 - factor0 q0 is the deflection
            factor1=pair.base_radius[1],
            springForceUserFunction=force,
        )
    )


def add_sensor(mbs: Any, node: Any) -> Any:
    """A sensor that keeps the rotation of a gear in memory."""
    import exudyn
    from exudyn.itemInterface import SensorNode

    return mbs.AddSensor(
        SensorNode(
            nodeNumber=node,
            storeInternal=True,
            outputVariableType=exudyn.OutputVariableType.Coordinates,
        )
    )


def simulation_settings(end_time: float) -> Any:
    """Equal steps without files or lines on the screen."""
    import exudyn

    settings = exudyn.SimulationSettings()
    settings.timeIntegration.endTime = end_time
    settings.timeIntegration.numberOfSteps = PERIODS * STEPS
    settings.timeIntegration.verboseMode = 0
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = end_time / (PERIODS * STEPS)
    return settings


def compare(folder: Path) -> list[ComparedValue]:
    """Rows of motions in permanent contact and with contact loss.

    First with the stiffness at the nominal rotation, then at that of the driver.
    """
    pair = read_pair(folder)
    rows = []
    for nominal, words in ((True, "nominal rotation"), (False, "actual rotation")):
        for speed in (LINEAR, NONLINEAR):
            theirs = simulate_pair(pair, speed, nominal)
            ours = read_motion(folder, speed)
            rows += compare_motions(f"{speed} Hz, {words}", ours, theirs, TOLERANCE)
    return rows


if __name__ == "__main__":
    run_comparison(__doc__ or "", compare, ("exudyn", "numpy"))
