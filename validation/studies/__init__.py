"""Studies that compare models with evidence."""

from fegear.files.keys import register_file
from fegear.files.templates import register_template
from fegear.studies.columns import register_columns
from fegear.studies.registry import register

register_file("case", "validation.study.cases", "Case")
register_template("case", "validation")
register_columns("validation", "columns.toml")

register(
    {
        "compare": (
            "validation.studies.compare",
            "ClosedForms",
            "Finite elements compared with ISO 6336 and other closed forms.",
        ),
        "ablation": (
            "validation.studies.budget",
            "Ablation",
            "Contribution of each part of the coupled model.",
        ),
        "validate": (
            "validation.studies.validate",
            "Validation",
            "Lumped models against finite elements, with tolerances.",
        ),
        "reproduce": (
            "validation.studies.reproduce",
            "Reproduction",
            "Figures and tables of the sources, recomputed.",
        ),
        "bench stiffness": (
            "validation.studies.benchmarks",
            "StiffnessBenchmark",
            "Statics over mesh size, element order and contact grid.",
        ),
        "bench dynamics": (
            "validation.studies.benchmarks",
            "DynamicsBenchmark",
            "Finite-element dynamics over time steps and modes.",
        ),
        "bench lumped": (
            "validation.studies.benchmarks",
            "LumpedBenchmark",
            "Time integrators of the lumped models compared with those of SciPy.",
        ),
        "bench branches": (
            "validation.studies.benchmarks",
            "BranchesBenchmark",
            "Periodic motions by harmonic balance compared with sweeps.",
        ),
        "bench stability": (
            "validation.studies.benchmarks",
            "StabilityBenchmark",
            "Floquet multipliers of trains with tooth friction, and closed forms.",
        ),
        "bench eccentric": (
            "validation.studies.benchmarks",
            "EccentricBenchmark",
            "Eccentric wheels: centre distance, and contact over the mesh size.",
        ),
        "bench clatter": (
            "validation.studies.benchmarks",
            "ClatterBenchmark",
            "Clattering wheels: impacts per second, and the tolerance of events.",
        ),
        "bench growth": (
            "validation.studies.benchmarks",
            "GrowthBenchmark",
            "Run time of the lumped models over the number of gears.",
        ),
        "bench commands": (
            "validation.studies.benchmarks",
            "CommandsBenchmark",
            "Processor time and memory of whole commands, over those of fixed jobs.",
        ),
        "bench all": (
            "validation.studies.benchmarks",
            "AllBenchmarks",
            "All benchmarks on one page, index.html.",
        ),
    }
)
