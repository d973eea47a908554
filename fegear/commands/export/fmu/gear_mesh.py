"""The program inside of an FMU: torques of a gear mesh from angles and speeds.

It runs in the Python of the simulating program, with the standard library alone, and
reads `mesh.json` beside it: springs in parallel, one for each tooth pair, whose
stiffness and gap are cubic pieces over a base pitch.
"""

from __future__ import annotations

import json
import math
from bisect import bisect_right
from pathlib import Path
from typing import Any

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real

POSITION_TOL = 1e-12  # base pitches within which two positions are equal
SENSE = "positive in the sense in which the gear turns when the driver drives"
# name: unit, description
INPUTS = {
    "driver_angle": ("rad", f"Angle of the driver, {SENSE}; 0 is position `phase`"),
    "driven_angle": ("rad", f"Angle of the driven gear, {SENSE}"),
    "driver_speed": ("rad/s", "Derivative of driver_angle"),
    "driven_speed": ("rad/s", "Derivative of driven_angle"),
}
OUTPUTS = {
    "driver_torque": ("N.m", "Torque of the mesh on the driver, in its angle's sense"),
    "driven_torque": ("N.m", "Torque of the mesh on the driven gear, likewise"),
    "mesh_force": ("N", "Force of the teeth, negative on their back sides"),
    "deflection": ("m", "Deflection along the line of action, positive if pressed"),
    "position": ("1", "Mesh position from the pitch point in base pitches"),
}
PARAMETERS = {
    "damping": ("N.s/m", "Viscous damping along the line of action, always acting"),
    "phase": ("1", "Mesh position at driver_angle 0 in base pitches"),
}
UNITS = {name: unit for name, (unit, _) in {**INPUTS, **OUTPUTS, **PARAMETERS}.items()}


def wave_value(wave: dict[str, Any], position: float) -> float:
    """A wave at a position [base pitches], as `Wave` of the lumped models has it."""
    if abs(position - round(position)) < POSITION_TOL:
        position = float(round(position))
    pitch = math.floor(position)
    x, breaks = position - pitch, wave["breaks"]
    piece = min(max(bisect_right(breaks, x + POSITION_TOL) - 1, 0), len(breaks) - 2)
    shapes, offsets = wave["coefficients"], wave["offsets"]
    c0, c1, c2, c3 = shapes[pitch % len(shapes)][piece]
    t = x - breaks[piece]
    value = c0 + t * (c1 + t * (c2 + t * c3))
    return float(value + offsets[pitch % len(offsets)] if offsets else value)


class GearMeshUnit(Fmi2Slave):
    """Two gears in mesh; the inertias belong to the program that simulates."""

    def __init__(self, **arguments: Any) -> None:
        super().__init__(**arguments)
        text = (Path(str(self.resources)) / "mesh.json").read_text("utf-8")
        self.mesh = json.loads(text)
        self.modelName = "GearMesh"
        self.description = self.mesh["description"]
        self.radii, self.teeth = self.mesh["base_radii"], self.mesh["driver_teeth"]
        backlash = self.mesh["backlash"]
        self.backlash = math.inf if backlash is None else backlash
        for name in INPUTS:
            setattr(self, name, 0.0)
            self._register(name, INPUTS, Fmi2Causality.input)
        for name in PARAMETERS:
            setattr(self, name, self.mesh[name])
            self._register(name, PARAMETERS, Fmi2Causality.parameter)
        for name in OUTPUTS:
            self._register(name, OUTPUTS, Fmi2Causality.output)

    def _register(
        self, name: str, group: dict[str, tuple[str, str]], causality: Any
    ) -> None:
        """A real variable; that of parameters is constant during a simulation."""
        fixed = causality == Fmi2Causality.parameter
        kind = Fmi2Variability.fixed if fixed else Fmi2Variability.continuous
        _, description = group[name]
        variable = Real(
            name, causality=causality, variability=kind, description=description
        )
        self.register_variable(variable)

    @property
    def position(self) -> float:
        """Mesh position [base pitches]."""
        return self.teeth * self.driver_angle / (2.0 * math.pi) + self.phase

    @property
    def deflection(self) -> float:
        """Deflection along the line of action [m]."""
        driver, driven = self.radii
        return driver * self.driver_angle - driven * self.driven_angle

    @property
    def mesh_force(self) -> float:
        """Force of all tooth pairs [N]."""
        deflection, position = self.deflection, self.position
        return sum(
            self._pair_force(p, deflection, position) for p in self.mesh["pairs"]
        )

    def _pair_force(
        self, pair: dict[str, Any], deflection: float, position: float
    ) -> float:
        """Force of a tooth pair [N]; none within the backlash."""
        pressed = deflection - wave_value(pair["gap"], position)
        overlap = max(pressed, 0.0) + min(pressed + self.backlash, 0.0)
        return wave_value(pair["stiffness"], position) * overlap if overlap else 0.0

    @property
    def line_force(self) -> float:
        """Force of teeth and damping along the line of action [N]."""
        driver, driven = self.radii
        rate = driver * self.driver_speed - driven * self.driven_speed
        return self.mesh_force + self.damping * rate

    @property
    def driver_torque(self) -> float:
        """Torque on the driver [N m]."""
        return -self.radii[0] * self.line_force

    @property
    def driven_torque(self) -> float:
        """Torque on the driven gear [N m]."""
        return self.radii[1] * self.line_force

    def do_step(self, current_time: float, step_size: float) -> bool:
        """There is nothing to integrate: outputs follow from inputs."""
        return True
