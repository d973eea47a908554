"""The commands `fegear bench`."""

from fegear.studies.registry import Command, Group

COMMANDS = (
    Group("bench", "Run time against error.", section="Evidence and upkeep", place=50),
    Command(
        "bench stiffness",
        "Statics over mesh size, element order and contact grid.",
        __name__,
        "StiffnessBenchmark",
        place=10,
    ),
    Command(
        "bench dynamics",
        "Finite-element dynamics over time steps and modes.",
        __name__,
        "DynamicsBenchmark",
        place=20,
    ),
    Command(
        "bench lumped",
        "Time integrators of the lumped models compared with those of SciPy.",
        __name__,
        "LumpedBenchmark",
        place=30,
    ),
    Command(
        "bench branches",
        "Periodic motions by harmonic balance compared with sweeps.",
        __name__,
        "BranchesBenchmark",
        place=40,
    ),
    Command(
        "bench stability",
        "Floquet multipliers of trains with tooth friction, and closed forms.",
        __name__,
        "StabilityBenchmark",
        place=50,
    ),
    Command(
        "bench growth",
        "Run time of the lumped models over the number of gears.",
        __name__,
        "GrowthBenchmark",
        place=60,
    ),
    Command(
        "bench width",
        "Loads over the face width: degree, mesh of the section and slices.",
        __name__,
        "WidthBenchmark",
        place=55,
    ),
    Command(
        "bench eccentric",
        "Eccentric wheels: centre distance, and contact over the mesh size.",
        __name__,
        "EccentricBenchmark",
        place=70,
    ),
    Command(
        "bench clatter",
        "Clattering wheels: impacts per second, and the tolerance of events.",
        __name__,
        "ClatterBenchmark",
        place=80,
    ),
    Command(
        "bench commands",
        "Processor time and memory of whole commands, over those of fixed jobs.",
        __name__,
        "CommandsBenchmark",
        place=90,
    ),
    Command(
        "bench all",
        "All benchmarks on one page, index.html.",
        __name__,
        "AllBenchmarks",
        place=100,
    ),
)
