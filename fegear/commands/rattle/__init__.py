"""The commands `fegear rattle`."""

from fegear.studies.registry import Command, Group

COMMANDS = (
    Group(
        "rattle",
        "Rattle of eccentric gears: quiet or noisy.",
        section="Machines",
        place=20,
    ),
    Command(
        "rattle critical",
        "Determine whether a machine can run without rattling, and which change helps.",
        __name__,
        "RattleThreshold",
        file="critical",
        place=10,
    ),
    Command(
        "rattle gears",
        "A machine of two gears in mesh, for the other commands of rattle.",
        __name__,
        "MachineFromGears",
        file="gears",
        place=20,
    ),
    Command(
        "rattle run-down",
        "Damping of a machine from its speed after the motor is switched off.",
        __name__,
        "RunDown",
        file="run_down",
        place=30,
    ),
    Command(
        "rattle periodic",
        "Periodic motions P(m, n+, n-), stable or not.",
        __name__,
        "PeriodicOrbits",
        file="periodic",
        place=40,
    ),
    Command(
        "rattle bifurcation",
        "Periodic motions over a parameter: where they begin, double and graze.",
        __name__,
        "OrbitBifurcations",
        file="bifurcation",
        place=50,
    ),
    Command(
        "rattle basin",
        "Attractors of a machine and their basins of attraction.",
        __name__,
        "Basins",
        file="basin",
        place=60,
    ),
    Command(
        "rattle manifold",
        "Boundaries of basins: stable manifolds of saddles, and curves of grazing.",
        __name__,
        "Manifolds",
        file="manifold",
        place=70,
    ),
    Command(
        "rattle noise",
        "Noise level of a machine, and its probability of not rattling.",
        __name__,
        "RattleNoise",
        file="noise",
        place=80,
    ),
)
