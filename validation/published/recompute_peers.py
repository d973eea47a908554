"""Ten random spur gear pairs by other programs; writes `peers.toml`.

It runs in an environment of its own, which has the programs and not fegear:

    pip install numpy scipy ross-rotordynamics==2.3.0 "plotly<6" opentorsion==0.3.2
    python validation/published/recompute_peers.py

GEARpie (github.com/cfernandesFEUP/GEARpie) is no package: its formulas for geometry,
rigid load sharing, Hertz pressure and loss factors are repeated here from its classes,
for spur gears without addendum reduction. Pinions and wheels are in pairs (pinion,
wheel); lengths in millimetres.
"""

from __future__ import annotations

import math
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

SEED = 6336
PAIRS, UNSHIFTED = 10, 5  # ROSS has no profile shift
MODULES = 1.0, 1.25, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0
ALPHA = math.radians(20.0)
YOUNG_MODULUS, POISSON_RATIO, DENSITY = 206e9, 0.3, 7850.0
MESH_STIFFNESS = 14e9  # per width [Pa], of the natural frequency alone
GEARPIE_POINTS = 20_000  # of the path of contact; GEARpie has 1000
Numbers = dict[str, Any]


def draw_pairs() -> list[Numbers]:
    """Inputs of the pairs: the first ones without profile shift."""
    rng = np.random.default_rng(SEED)
    return [draw_pair(rng, shifted=i >= UNSHIFTED) for i in range(PAIRS)]


def draw_pair(rng: np.random.Generator, shifted: bool) -> Numbers:
    least = 17 if shifted else 18  # 17 without shift are undercut
    teeth = sorted(int(z) for z in rng.integers(least, 81, 2))
    m = float(rng.choice(MODULES))
    shifts = [round(float(x), 2) for x in np.sort(rng.uniform(0.0, 0.5, 2))[::-1]]
    width = round(float(rng.uniform(6.0, 12.0)) * m, 1)
    roots = [m * (0.5 * z - 1.25) for z in teeth]
    hubs = [round(float(rng.uniform(0.3, 0.6)) * r, 1) for r in roots]
    line_load = float(rng.uniform(20.0, 40.0)) * m  # N/mm
    radii = [0.5 * m * z for z in teeth]
    return {
        "teeth": teeth,
        "module_mm": m,
        "profile_shift": shifts if shifted else [0.0, 0.0],
        "face_width_mm": width,
        "hub_radius_mm": hubs,
        "torque_Nm": round(1e-3 * line_load * width * radii[0], 1),
        "inertia_kg_m2": [
            float(f"{disc_inertia(r, h, width):.6g}")
            for r, h in zip(radii, hubs, strict=True)
        ],
        "mesh_stiffness_N_per_m": round(MESH_STIFFNESS * 1e-3 * width),
    }


def disc_inertia(radius: float, hub: float, width: float) -> float:
    """Inertia of a disc with a bore [kg m2], from millimetres."""
    return 0.5 * math.pi * DENSITY * width * (radius**4 - hub**4) * 1e-15


def ross_values(pair: Numbers) -> Numbers:
    """Stiffness of the mesh by `GearElementTVMS` and `Mesh` [N/m]."""
    from ross.gear_element import GearElementTVMS, Mesh
    from ross.materials import Material

    steel = Material("steel", rho=DENSITY, E=YOUNG_MODULUS, Poisson=POISSON_RATIO)
    gears = [
        GearElementTVMS(
            n=i,
            material=steel,
            width=1e-3 * pair["face_width_mm"],
            bore_diameter=2e-3 * pair["hub_radius_mm"][i],
            module=1e-3 * pair["module_mm"],
            n_teeth=pair["teeth"][i],
            pr_angle=ALPHA,
        )
        for i in range(2)
    ]
    mesh = Mesh(*gears)
    return {
        "contact_ratio": float(mesh.contact_ratio),
        "hertz_stiffness_N_per_m": float(mesh.hertzian_stiffness),
        "start_stiffness_N_per_m": float(mesh.stiffness_range[0]),
        "mean_stiffness_N_per_m": float(np.mean(mesh.stiffness_range)),
    }


def opentorsion_values(pair: Numbers) -> Numbers:
    """Natural frequency of two free gears in mesh [Hz]."""
    from opentorsion import Assembly, Disk, ElasticGear

    one, two = (1e-3 * r for r in base_radii(pair))
    twist = pair["mesh_stiffness_N_per_m"] * one**2  # at the pinion [N m/rad]
    discs = [Disk(node, inertia) for node, inertia in enumerate(pair["inertia_kg_m2"])]
    pinion = ElasticGear(0, 0.0, one)
    wheel = ElasticGear(1, 0.0, two, k=twist, c=0.0, parent=pinion)
    gears = Assembly([], discs, elastic_gear_elements=[pinion, wheel])
    squares, _ = gears.undamped_modal_analysis()
    highest = math.sqrt(float(max(squares.real)))
    return {"natural_frequency_Hz": highest / (2.0 * math.pi)}


def base_radii(pair: Numbers) -> list[float]:
    return [0.5 * pair["module_mm"] * z * math.cos(ALPHA) for z in pair["teeth"]]


def gearpie_values(pair: Numbers, points: int = GEARPIE_POINTS) -> Numbers:
    """Contact ratio, Hertz pressure at the pitch point and both loss factors.

    points : along the path of contact
    """
    z1, z2 = pair["teeth"]
    m, (x1, x2) = pair["module_mm"], pair["profile_shift"]
    rb1, rb2 = base_radii(pair)
    pb = math.pi * m * math.cos(ALPHA)
    working = working_pressure_angle(pair)
    length = (rb1 + rb2) * math.tan(working)
    tips = m * (0.5 * z1 + 1.0 + x1), m * (0.5 * z2 + 1.0 + x2)
    start = length - math.sqrt(tips[1] ** 2 - rb2**2)
    end = math.sqrt(tips[0] ** 2 - rb1**2)
    ratio, pitch_point = (end - start) / pb, rb1 * math.tan(working)
    eps1, eps2 = (end - pitch_point) / pb, (pitch_point - start) / pb
    force = 1e3 * pair["torque_Nm"] / rb1
    modulus = 0.5e-6 * YOUNG_MODULUS / (1.0 - POISSON_RATIO**2)
    radius = 1.0 / (1.0 / pitch_point + 1.0 / (length - pitch_point))
    at_pitch = force / pair["face_width_mm"]
    half_sum = math.pi * (1.0 / z1 + 1.0 / z2)
    s1 = np.linspace(start, end, points)[:-1]
    pairs = sum(
        ((s1 + k * pb >= start) & (s1 + k * pb < end)).astype(int) for k in range(-2, 3)
    )
    sliding = np.abs(s1 / rb1 - (length - s1) / rb1 * z1 / z2)
    return {
        "center_distance_mm": (rb1 + rb2) / math.cos(working),
        "contact_ratio": ratio,
        "hertz_pressure_MPa": math.sqrt(at_pitch * modulus / (math.pi * radius)),
        "ohlendorf": half_sum * (1.0 - ratio + eps1**2 + eps2**2),
        "wimmer": float(np.trapezoid(sliding / pairs, s1)) / pb,
    }


def working_pressure_angle(pair: Numbers) -> float:
    """Operating pressure angle of teeth without backlash [rad]."""
    from scipy.optimize import brentq

    def involute(angle: float) -> float:
        return math.tan(angle) - angle

    shifts, teeth = sum(pair["profile_shift"]), sum(pair["teeth"])
    wanted = involute(ALPHA) + 2.0 * math.tan(ALPHA) * shifts / teeth
    return float(brentq(lambda a: involute(a) - wanted, 0.01, 0.7, xtol=1e-14))


def as_toml(value: Any) -> str:
    """A number, or a list of numbers."""
    if isinstance(value, list):
        return "[" + ", ".join(map(as_toml, value)) + "]"
    return repr(value) if isinstance(value, int) else f"{value:.10g}"


def table(name: str, values: Numbers) -> str:
    lines = (f"{key} = {as_toml(value)}" for key, value in values.items())
    return "\n".join([name, *lines, ""])


def main() -> None:
    packages = "ross-rotordynamics", "opentorsion", "numpy", "scipy"
    parts = [
        "# Written by recompute_peers.py; not to be edited.\n",
        "[versions]\n" + "".join(f'{name} = "{version(name)}"\n' for name in packages),
    ]
    for pair in draw_pairs():
        parts += [
            table("[[pair]]", pair),
            table("[pair.gearpie]", gearpie_values(pair)),
        ]
        if not any(pair["profile_shift"]):
            parts.append(table("[pair.ross]", ross_values(pair)))
        parts.append(table("[pair.opentorsion]", opentorsion_values(pair)))
    Path(__file__).with_name("peers.toml").write_text("\n".join(parts), "utf-8")


if __name__ == "__main__":
    main()
