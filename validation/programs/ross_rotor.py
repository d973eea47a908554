"""Spinning rotors in ROSS: a published rotor with two disks, and one with gears.

    python -m validation.programs.ross_rotor files

It needs the environment of `ross_pair`; our side runs in it as well, and no file is
read. Elements of both are those of Euler and Bernoulli with rotary inertia, which
ROSS has without shear. Shafts have the same elements.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from lumped.rotors.campbell import campbell
from lumped.rotors.critical import critical_speeds
from lumped.rotors.description import (
    Bearing,
    Disk,
    MeshSpring,
    Rotor,
    RotorSystem,
    Section,
)
from lumped.rotors.matrices import assemble
from lumped.rotors.whirl import WhirlProblem
from validation.programs.comparison import ComparedValue, recorded_rows, run_comparison
from validation.programs.exported_pair import Array

TOLERANCE = 0.1  # %
CRITICAL_SPEEDS = 4  # that are compared
RPM = math.pi / 30.0  # rad/s
STEEL: dict[str, Any] = {
    "young_modulus": 211e9,
    "shear_modulus": 81.2e9,
    "density": 7810.0,
}
# Rotor of examples 5.9.1 and 5.9.2, Friswell et al., Dynamics of Rotating Machines
# (2010): a shaft of 50 mm and 1.5 m with disks 70 mm thick
DISK_DIAMETERS = 0.28, 0.35  # m
DISK_THICKNESS = 0.07  # m
ISOTROPIC = 1e6, 0.0, 0.0, 1e6  # N/m
ANISOTROPIC = 1e6, 0.0, 0.0, 0.8e6
DAMPING = 200.0, 0.0, 0.0, 200.0  # N s/m
# Generator and turbine of Rao et al., Theoretical Analysis of Lateral Response due to
# Torsional Excitation of Geared Rotors, Mech. Mach. Theory 33 (1998)
GENERATOR = ((0.1, 0.3), (4.24, 0.3), (1.16, 0.22), (0.3, 0.22))  # lengths, diameters
GENERATOR_DISKS = ((1, 525.7, 16.1, 32.2), (2, 116.04, 3.115, 6.23))
GENERATOR_GEAR = (4, 726.4, 56.95, 113.9)
TURBINE = ((0.3, 0.15), (5.0, 0.15), (0.1, 0.15))
TURBINE_DISKS = ((2, 7.45, 0.0745, 0.149),)
TURBINE_GEAR = (0, 5.0, 0.002, 0.004)
GEAR_TEETH, GEAR_RADII, GEAR_ANGLE = (328, 23), (0.5081, 0.03563), math.radians(22.5)
MESH_STIFFNESS = 1e8  # N/m
GEAR_BEARINGS = (  # nodes, kxx and kyy
    ((0, 183.9e6, 200.4e6), (3, 183.9e6, 200.4e6)),
    ((1, 10.1e6, 41.6e6), (3, 10.1e6, 41.6e6)),
)


def disk_of(diameter: float) -> tuple[float, float, float]:
    """Mass, transverse and polar inertia of a disk of the shaft's steel."""
    mass = STEEL["density"] * DISK_THICKNESS * math.pi / 4.0 * (diameter**2 - 0.05**2)
    polar = mass / 8.0 * (diameter**2 + 0.05**2)
    return mass, 0.5 * polar + mass * DISK_THICKNESS**2 / 12.0, polar


def our_rotor(
    stiffness: tuple[float, ...], damping: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)
) -> RotorSystem:
    """The rotor with two disks."""
    disks = []
    for position, diameter in zip((0.5, 1.0), DISK_DIAMETERS, strict=True):
        mass, transverse, polar = disk_of(diameter)
        disks.append(
            Disk(
                position=position,
                mass=mass,
                polar_inertia=polar,
                transverse_inertia=transverse,
            )
        )
    bearings = [
        Bearing(position=z, stiffness=stiffness, damping=damping)  # type: ignore[arg-type]
        for z in (0.0, 1.5)
    ]
    rotor = Rotor(
        name="shaft",
        sections=(Section(length=1.5, diameter=0.05),),
        disks=tuple(disks),
        bearings=tuple(bearings),
        **STEEL,
    )
    return RotorSystem(rotors=(rotor,), elements=6)


def their_rotor(
    stiffness: tuple[float, ...], damping: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)
) -> Any:
    """Shaft with two disks in ROSS."""
    import ross

    shaft = [their_element(0.25, 0.05) for _ in range(6)]
    disks = []
    for node, diameter in zip((2, 4), DISK_DIAMETERS, strict=True):
        mass, transverse, polar = disk_of(diameter)
        disks.append(ross.DiskElement(n=node, m=mass, Id=transverse, Ip=polar))
    bearings = [
        ross.BearingElement(
            n=node, kxx=stiffness[0], kyy=stiffness[3], cxx=damping[0], cyy=damping[3]
        )
        for node in (0, 6)
    ]
    return ross.Rotor(shaft, disks, bearings)


def their_element(length: float, diameter: float) -> Any:
    """Element of a shaft in ROSS, without shear."""
    import ross

    steel = ross.Material(
        "steel",
        rho=STEEL["density"],
        E=STEEL["young_modulus"],
        G_s=STEEL["shear_modulus"],
    )
    return ross.ShaftElement(
        L=length,
        idl=0.0,
        odl=diameter,
        material=steel,
        shear_effects=False,
        rotary_inertia=True,
        gyroscopic=True,
    )


def our_gears() -> RotorSystem:
    """Generator and turbine."""
    parts = (
        (GENERATOR, (*GENERATOR_DISKS, GENERATOR_GEAR), GENERATOR_GEAR),
        (TURBINE, (*TURBINE_DISKS, TURBINE_GEAR), TURBINE_GEAR),
    )
    ratios = 1.0, -GEAR_TEETH[0] / GEAR_TEETH[1]
    rotors, positions = [], []
    for (shaft, disks, gear), bearings, ratio in zip(
        parts, GEAR_BEARINGS, ratios, strict=True
    ):
        nodes = np.cumsum([0.0, *(length for length, _ in shaft)]).tolist()
        positions.append(nodes[gear[0]])
        rotors.append(
            Rotor(
                name="shaft",
                sections=tuple(Section(length=L, diameter=d) for L, d in shaft),
                disks=tuple(
                    Disk(
                        position=nodes[n],
                        mass=m,
                        transverse_inertia=transverse,
                        polar_inertia=polar,
                    )
                    for n, m, transverse, polar in disks
                ),
                bearings=tuple(
                    Bearing(position=nodes[n], stiffness=(kx, 0.0, 0.0, ky))
                    for n, kx, ky in bearings
                ),
                speed_ratio=ratio,
                **STEEL,
            )
        )
    mesh = MeshSpring(
        rotors=(0, 1),
        positions=(positions[0], positions[1]),
        base_radii=GEAR_RADII,
        direction=(math.sin(GEAR_ANGLE), math.cos(GEAR_ANGLE)),
        stiffness=MESH_STIFFNESS,
        teeth=GEAR_TEETH[0],
    )
    return RotorSystem(rotors=tuple(rotors), meshes=(mesh,), elements=1)


def their_gears() -> Any:
    """Generator and turbine in ROSS."""
    import ross

    parts = (
        (GENERATOR, GENERATOR_DISKS, GENERATOR_GEAR),
        (TURBINE, TURBINE_DISKS, TURBINE_GEAR),
    )
    rotors = []
    for number, (shaft, disks, gear) in enumerate(parts):
        elements = [their_element(length, diameter) for length, diameter in shaft]
        wheels = [
            ross.DiskElement(n=n, m=m, Id=transverse, Ip=polar)
            for n, m, transverse, polar in disks
        ]
        n, mass, transverse, polar = gear
        wheels.append(
            ross.GearElement(
                n=n,
                m=mass,
                Id=transverse,
                Ip=polar,
                n_teeth=GEAR_TEETH[number],
                base_diameter=2.0 * GEAR_RADII[number],
                pr_angle=GEAR_ANGLE,
            )
        )
        bearings = [
            ross.BearingElement(n=n, kxx=kx, kyy=ky, cxx=0.0)
            for n, kx, ky in GEAR_BEARINGS[number]
        ]
        rotors.append(ross.Rotor(elements, wheels, bearings))
    nodes = GENERATOR_GEAR[0], TURBINE_GEAR[0]
    return ross.MultiRotor(
        *rotors, coupled_nodes=nodes, gear_mesh_stiffness=MESH_STIFFNESS
    )


def their_frequencies(rotor: Any, speed: float, axial_motion: bool = False) -> Array:
    """Frequencies by all six coordinates of nodes [rad/s].

    axial_motion : else along the axis alone, which spur gears couple with nothing, is
        left out
    """
    places = np.flatnonzero(axial_motion | (np.arange(rotor.ndof) % 6 != 2))
    across = np.ix_(places, places)
    mass, stiffness = rotor.M(speed)[across], rotor.K(speed)[across]
    damping = rotor.C(speed)[across] + speed * rotor.G()[across]
    number = places.size
    state = np.block(
        [
            [np.zeros((number, number)), np.eye(number)],
            [-np.linalg.solve(mass, stiffness), -np.linalg.solve(mass, damping)],
        ]
    )
    values = np.linalg.eigvals(state)
    return np.sort(values.imag[values.imag > 1.0])


def our_frequencies(rotors: RotorSystem, rpm: float, count: int) -> Array:
    """Lowest frequencies [rad/s] at a speed of rotation."""
    return WhirlProblem(assemble(rotors)).solve(RPM * rpm, count).frequency[:count]


def cases() -> list[tuple[str, RotorSystem, Callable[[], Any], tuple[float, ...], int]]:
    """Label, our rotors, theirs, speeds of rotation [rpm] and number of frequencies."""
    bearings: tuple[tuple[str, tuple[Any, ...]], ...] = (
        ("isotropic bearings", (ISOTROPIC,)),
        ("anisotropic bearings", (ANISOTROPIC,)),
        ("damped bearings", (ANISOTROPIC, DAMPING)),
    )
    speeds = 0.0, 2000.0, 4000.0
    disks = [
        (label, our_rotor(*values), partial(their_rotor, *values), speeds, 6)
        for label, values in bearings
    ]
    geared = "generator and turbine", our_gears(), their_gears, (0.0, 1500.0), 12
    return [*disks, geared]


def row_of(
    label: str, rpm: float, mode: int, ours: float, theirs: float
) -> ComparedValue:
    """A row of a frequency [Hz] by both."""
    name = f"{label}, {rpm:g} rpm: frequency {mode}"
    return ComparedValue(name, "Hz", ours, theirs, tolerance=TOLERANCE)


def compare_recorded() -> list[ComparedValue]:
    """Rows of frequencies with ours computed anew, theirs as they were recorded."""
    theirs = {row.quantity: row.theirs for row in recorded_rows("ross_rotor")}
    rows = []
    for label, rotors, _, speeds, count in cases():
        for rpm in speeds:
            for mode, value in enumerate(our_frequencies(rotors, rpm, count), start=1):
                row = row_of(label, rpm, mode, float(value) / (2.0 * math.pi), math.nan)
                rows.append(replace(row, theirs=theirs[row.quantity]))
    return rows


def compare_critical_speeds() -> list[ComparedValue]:
    """Rows of the lowest critical speeds, those of ROSS by its own iteration."""
    problem = WhirlProblem(assemble(our_rotor(ISOTROPIC)))
    diagram = campbell(problem, np.linspace(0.0, 4500.0 * RPM, 10).tolist(), 6)
    mine = [one.speed / RPM for one in critical_speeds(problem, diagram, 1.0)]
    solved = their_rotor(ISOTROPIC).run_critical_speed(num_modes=24)
    other = np.sort(solved.wd()) / RPM
    return [
        ComparedValue(
            f"isotropic bearings: critical speed {number}",
            "rpm",
            value,
            float(other[np.abs(other - value).argmin()]),
            tolerance=TOLERANCE,
        )
        for number, value in enumerate(mine[:CRITICAL_SPEEDS], start=1)
    ]


def compare(_folder: Path) -> list[ComparedValue]:
    """All rows."""
    rows = []
    for label, rotors, build, speeds, count in cases():
        theirs = build()
        for rpm in speeds:
            mine = our_frequencies(rotors, rpm, count) / (2.0 * math.pi)
            other = their_frequencies(theirs, RPM * rpm)[: mine.size] / (2.0 * math.pi)
            pairs = zip(mine.tolist(), other.tolist(), strict=True)
            for mode, pair in enumerate(pairs, start=1):
                rows.append(row_of(label, rpm, mode, *pair))
    return [*rows, *compare_critical_speeds()]


if __name__ == "__main__":
    packages = ("ross-rotordynamics", "plotly", "numpy")
    run_comparison(__doc__ or "", compare, packages)
