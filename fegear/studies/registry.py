"""The list of all studies, each by the name of its command."""

from __future__ import annotations

from collections.abc import Mapping

# by command: module, of this package where it is one word, class, and what the list of
# commands says of it; a study is loaded where it is asked for
STUDIES = {
    "clatter": (
        "clatter",
        "Clatter",
        "Clattering gearboxes: impacts of loose wheels.",
    ),
    "sets": ("sets", "BuiltinSets", "List the built-in gear sets."),
    "keys": (
        "keys",
        "KeyList",
        "List the keys of files: unit, default, limits and meaning.",
    ),
    "explain": (
        "explain",
        "Explanation",
        "Explain the codes of warnings and of evidence lines.",
    ),
    "new": (
        "new_file",
        "NewFile",
        "Write a commented file to begin with, which runs as it is.",
    ),
    "show": (
        "show",
        "DerivedGeometry",
        "Derived geometry of a gear set, and what was inferred.",
    ),
    "mesh": ("mesh", "GearMesh", "Write the finite-element mesh of a gear."),
    "stiffness": (
        "stiffness",
        "MeshStiffness",
        "Mesh stiffness, transmission error and load sharing.",
    ),
    "identify": (
        "identify",
        "Identification",
        "Face width and hub radii that give measured stiffnesses.",
    ),
    "relief": (
        "relief",
        "ReliefDesign",
        "Profile relief of least transmission error over torque.",
    ),
    "tolerances": (
        "tolerances",
        "Tolerances",
        "Scatter of stiffness and transmission error by tolerances.",
    ),
    "wear": ("wear", "FlankWear", "Wear of both flanks of a mesh by Archard's law."),
    "render": (
        "render",
        "ContactPictures",
        "Pictures and films of the stress of gears in mesh.",
    ),
    "dynamics": (
        "dynamics",
        "Dynamics",
        "Vibration of finite-element gears over speed.",
    ),
    "sweep": ("sweep", "Sweep", "Vibration of a lumped train over speed."),
    "modes": (
        "modes",
        "NaturalModes",
        "Natural frequencies of a train, and what its modes strain.",
    ),
    "bearing": (
        "bearing",
        "BearingLoad",
        "Load on a bearing's balls or rollers, and its stiffness.",
    ),
    "signals": (
        "signals",
        "Signals",
        "Signals of sensors, their averages over turns and sidebands.",
    ),
    "faults": (
        "faults",
        "FaultSignals",
        "Labelled data sets of signals of gears with faults.",
    ),
    "campbell": (
        "campbell",
        "CampbellDiagram",
        "Campbell diagram and critical speeds of spinning shafts.",
    ),
    "export": (
        "export",
        "ModelExport",
        "Mass, damping and stiffness matrices for other programs.",
    ),
    "map": ("map", "Map", "Vibration of a lumped train over a grid of parameters."),
    "branches": (
        "branches",
        "Branches",
        "Periodic motions over speed or a parameter, stable and unstable.",
    ),
    "bifurcations": (
        "bifurcations",
        "Bifurcations",
        "Period doublings and chaos over speed or a parameter.",
    ),
    "stability": (
        "stability",
        "Stability",
        "Parametric instability of a train with tooth friction.",
    ),
    "motion": (
        "motion",
        "Motion",
        "Steady-state motion of a lumped train at one speed.",
    ),
    "sharing": (
        "sharing",
        "PlanetLoadSharing",
        "Load sharing between the planets of a planetary set at rest.",
    ),
    "theory": (
        "theory",
        "Theory",
        "Resonances of a lumped train by closed forms.",
    ),
    "eccentric": (
        "eccentric",
        "Eccentric",
        "An eccentric circular wheel, and the wheel that it drives.",
    ),
    "warmup": (
        "warmup",
        "Warmup",
        "Compile all kernels on all cores, for later runs.",
    ),
    "rattle critical": (
        "rattle_critical",
        "RattleThreshold",
        "Determine whether a machine can run without rattling, and which change helps.",
    ),
    "rattle run-down": (
        "rattle_run_down",
        "RunDown",
        "Damping of a machine from its speed after the motor is switched off.",
    ),
    "rattle basin": (
        "rattle_basin",
        "Basins",
        "Attractors of a machine and their basins of attraction.",
    ),
    "rattle bifurcation": (
        "rattle_bifurcation",
        "OrbitBifurcations",
        "Periodic motions over a parameter: where they begin, double and graze.",
    ),
    "rattle gears": (
        "rattle_gears",
        "MachineFromGears",
        "A machine of two gears in mesh, for the other commands of rattle.",
    ),
    "rattle manifold": (
        "rattle_manifold",
        "Manifolds",
        "Boundaries of basins: stable manifolds of saddles, and curves of grazing.",
    ),
    "rattle noise": (
        "rattle_noise",
        "RattleNoise",
        "Noise level of a machine, and its probability of not rattling.",
    ),
    "rattle periodic": (
        "rattle_periodic",
        "PeriodicOrbits",
        "Periodic motions P(m, n+, n-), stable or not.",
    ),
}


def register(studies: Mapping[str, tuple[str, str, str]]) -> None:
    """Add the studies of another package, listed as in `STUDIES`."""
    STUDIES.update(studies)


def home_of(module: str) -> str:
    """The full name of a module of the list, which is in this package or is full."""
    return module if "." in module else f"fegear.studies.{module}"
