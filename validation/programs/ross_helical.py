"""A helical pair on shafts that move along their axes, in ROSS.

    python -m validation.programs.ross_helical files

It needs the environment of `ross_pair`; our side runs in it as well, and no file is
read. Teeth touch in one point, the pitch point, as ROSS has it: no face width and a
path of contact without length.

The mesh of ROSS 2.3.0 has two faults of helical gears. The axial part of the normal of
the flanks is sin(alpha_n) sin(beta), where a unit vector has cos(alpha_n) sin(beta);
and moments that tilt the driven gear have the opposite sign, so that a machine that
tilts as a whole strains its mesh. A subclass mends both; the last rows show the mesh as
it is.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from lumped.rotors.description import (
    Bearing,
    Disk,
    MeshSpring,
    Rotor,
    RotorSystem,
    Section,
)
from validation.programs.comparison import ComparedValue, recorded_rows, run_comparison
from validation.programs.exported_pair import Array
from validation.programs.ross_rotor import (
    RPM,
    STEEL,
    our_frequencies,
    their_element,
    their_frequencies,
)

TOLERANCE = 1e-4  # %
COUNT = 12  # frequencies that are compared
CASES = (  # label, whether the mesh of ROSS is mended, and speed [rpm]
    ("helical pair", True, 0.0),
    ("helical pair", True, 6000.0),
    ("mesh of ROSS as it is", False, 0.0),
)
TEETH = 23, 61
NORMAL_ANGLE, HELIX = math.radians(20.0), math.radians(25.0)
NORMAL_MODULE = 3e-3  # m
STIFFNESS = 4e8  # N/m, of a normal force over the approach along it
SHAFTS = (  # lengths and diameters of elements [m]
    ((0.06, 0.035), (0.05, 0.045), (0.07, 0.045), (0.04, 0.03)),
    ((0.05, 0.05), (0.09, 0.06), (0.06, 0.05)),
)
GEAR_NODES = 2, 1
GEARS = (  # mass, transverse and polar inertia
    (1.1, 7e-4, 1.1e-3),
    (7.5, 2e-2, 3.7e-2),
)
BEARINGS = (  # nodes, kxx, kyy and kzz
    ((0, 2e8, 2.4e8, 9e7), (4, 1.5e8, 1.7e8, 0.0)),
    ((0, 3e8, 3.3e8, 0.0), (3, 2.8e8, 2.5e8, 1.2e8)),
)
PITCH_RADII = tuple(0.5 * z * NORMAL_MODULE / math.cos(HELIX) for z in TEETH)
TRANSVERSE_ANGLE = math.atan(math.tan(NORMAL_ANGLE) / math.cos(HELIX))
BASE_HELIX = math.asin(math.sin(HELIX) * math.cos(NORMAL_ANGLE))


def our_pair() -> RotorSystem:
    """Both shafts, whose driver is right-handed."""
    rotors, positions = [], []
    for number, (shaft, (mass, transverse, polar), bearings) in enumerate(
        zip(SHAFTS, GEARS, BEARINGS, strict=True)
    ):
        nodes = np.cumsum([0.0, *(length for length, _ in shaft)]).tolist()
        positions.append(nodes[GEAR_NODES[number]])
        gear = Disk(
            position=positions[-1],
            mass=mass,
            transverse_inertia=transverse,
            polar_inertia=polar,
        )
        rotors.append(
            Rotor(
                name=("driver", "driven")[number],
                sections=tuple(Section(length=L, diameter=d) for L, d in shaft),
                disks=(gear,),
                bearings=tuple(
                    Bearing(
                        position=nodes[n],
                        stiffness=(kx, 0.0, 0.0, ky),
                        axial_stiffness=kz,
                    )
                    for n, kx, ky, kz in bearings
                ),
                speed_ratio=(1.0, -TEETH[0] / TEETH[1])[number],
                **STEEL,
            )
        )
    base_radii = [radius * math.cos(TRANSVERSE_ANGLE) for radius in PITCH_RADII]
    pitch_point = base_radii[0] * math.tan(TRANSVERSE_ANGLE)
    mesh = MeshSpring(
        rotors=(0, 1),
        positions=(positions[0], positions[1]),
        base_radii=(base_radii[0], base_radii[1]),
        direction=(math.sin(TRANSVERSE_ANGLE), math.cos(TRANSVERSE_ANGLE)),
        # of a force in the section over the transmission error
        stiffness=STIFFNESS * math.cos(BASE_HELIX) ** 2,
        teeth=TEETH[0],
        # z is toward who sees a counter-clockwise driver
        base_helix_angle=-BASE_HELIX,
        pressure_angle=TRANSVERSE_ANGLE,
        path=(pitch_point, pitch_point),
    )
    return RotorSystem(
        rotors=tuple(rotors), meshes=(mesh,), elements=1, axial_motion=True
    )


def their_pair(is_mended: bool) -> Any:
    """Both shafts in ROSS.

    is_mended : whether the mesh is without its faults
    """
    import ross

    class MendedPair(ross.MultiRotor):
        """Two rotors whose mesh has the normal of the flanks."""

        def coupling_matrix(self) -> Array:
            scale = np.ones(12)
            # z and both tilts, of driver and driven gear
            scale[[2, 3, 4, 8, 9, 10]] = 1.0 / math.tan(NORMAL_ANGLE)
            scale[[9, 10]] *= -1.0
            return scale[:, None] * np.asarray(super().coupling_matrix()) * scale

    rotors = []
    for number, (shaft, (mass, transverse, polar), bearings) in enumerate(
        zip(SHAFTS, GEARS, BEARINGS, strict=True)
    ):
        gear = ross.GearElement(
            n=GEAR_NODES[number],
            m=mass,
            Id=transverse,
            Ip=polar,
            n_teeth=TEETH[number],
            pitch_diameter=2.0 * PITCH_RADII[number],
            pr_angle=NORMAL_ANGLE,
            helix_angle=HELIX,
        )
        supports = [
            ross.BearingElement(n=n, kxx=kx, kyy=ky, kzz=kz, cxx=0.0)
            for n, kx, ky, kz in bearings
        ]
        elements = [their_element(length, diameter) for length, diameter in shaft]
        rotors.append(ross.Rotor(elements, [gear], supports))
    kind = MendedPair if is_mended else ross.MultiRotor
    return kind(*rotors, coupled_nodes=GEAR_NODES, gear_mesh_stiffness=STIFFNESS)


def our_rows() -> list[ComparedValue]:
    """Rows with ours alone [Hz]."""
    rows = []
    for label, is_mended, rpm in CASES:
        values = our_frequencies(our_pair(), rpm, COUNT) / (2.0 * math.pi)
        for mode, value in enumerate(values.tolist(), start=1):
            name = f"{label}, {rpm:g} rpm: frequency {mode}"
            tolerance = TOLERANCE if is_mended else None
            rows.append(ComparedValue(name, "Hz", value, math.nan, tolerance=tolerance))
    return rows


def compare_recorded() -> list[ComparedValue]:
    """Rows of frequencies with ours computed anew, theirs as they were recorded."""
    theirs = {row.quantity: row.theirs for row in recorded_rows("ross_helical")}
    return [replace(row, theirs=theirs[row.quantity]) for row in our_rows()]


def compare(_folder: Path) -> list[ComparedValue]:
    """All rows."""
    values = np.concatenate(
        [
            their_frequencies(their_pair(is_mended), RPM * rpm, True)[:COUNT]
            for _, is_mended, rpm in CASES
        ]
    ) / (2.0 * math.pi)
    rows = zip(our_rows(), values.tolist(), strict=True)
    return [replace(row, theirs=value) for row, value in rows]


if __name__ == "__main__":
    packages = ("ross-rotordynamics", "plotly", "numpy")
    run_comparison(__doc__ or "", compare, packages)
