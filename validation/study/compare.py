"""Finite elements against closed forms: one table, differences in per cent."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fegear.elasticity.material import Plane
from fegear.gearset.model import Gear, GearSet
from fegear.gearset.pitch_errors import without_pitch_errors
from fegear.statics.solving import StaticsResult, StaticsSettings, solve_mesh
from fegear.studies.stiffness import doubts_of_table
from meshes import GearPair
from validation.oracles import hertz, iso6336, potential_energy, ring

GEOMETRY = (
    *("teeth", "module", "pressure_angle", "profile_shift", "tooth_thinning"),
    *("tip_radius", "root_radius", "hub_radius"),
)


@dataclass(frozen=True)
class Comparison:
    """One quantity by finite elements and by an oracle, both in `unit`."""

    quantity: str
    slope: str
    oracle: str
    unit: str
    finite_elements: float
    expected: float

    @property
    def per_cent(self) -> float:
        """How far the oracle lies above the finite elements."""
        return 100.0 * (self.expected / self.finite_elements - 1.0)


@dataclass(frozen=True)
class _Solved:
    """One solved torque and what the closed forms need to know of it."""

    result: StaticsResult
    gears: tuple[Gear, Gear]  # driver and driven

    @property
    def pair(self) -> GearPair:
        return self.result.problem.pair

    @property
    def width(self) -> float:
        return self.result.problem.face_width

    @property
    def force(self) -> float:
        return float(self.result.cycle.mesh_force[0, 0])


@dataclass(frozen=True)
class Compared:
    """All comparisons of a mesh; warnings : why some of them mean little."""

    rows: tuple[Comparison, ...]
    warnings: tuple[str, ...]


def compare_mesh(
    gear_set: GearSet, mesh: int, torque: float, settings: StaticsSettings
) -> Compared:
    """All comparisons for one mesh at one torque on its driver [N m]."""
    spec = gear_set.meshes[mesh]
    solved = _Solved(
        result=solve_mesh(without_pitch_errors(gear_set), mesh, [torque], settings),
        gears=(gear_set.gears[spec.driver], gear_set.gears[spec.driven]),
    )
    rows = (
        *_average_slopes(solved, settings.plane),
        *_local_slopes(solved),
        _pressure(solved, settings.plane),
    )
    unknown = tuple(_unknown_to_closed_forms(solved))
    return Compared(rows, (*unknown, *doubts_of_table(solved.result)))


def _unknown_to_closed_forms(solved: _Solved) -> Iterator[str]:
    """What the gears have and the closed forms have not."""
    problem = solved.result.problem
    for gear, role in zip(solved.gears, ("driver", "driven"), strict=True):
        for place in ("tip", "root"):
            if getattr(problem, f"{role}_{place}_relief"):
                yield (
                    f'gear "{gear.name}" has {place} relief, which the closed forms '
                    "leave out"
                )
        if any(gear.pitch_errors):
            yield (
                f'gear "{gear.name}" has pitch_errors_um, which are left out: the '
                "closed forms know none"
            )


def _average_slopes(solved: _Solved, plane: Plane) -> list[Comparison]:
    """Force over deflection, against the potential-energy method."""
    oracle = "potential energy, Sainsot body"
    driver, driven = map(_analytic, solved.gears)
    at = solved.pair.operating_pressure_angle
    load = solved.force, solved.width
    table = solved.result.table
    stiffness = table["stiffness_N_per_m"][0]
    energy = potential_energy.mesh_stiffness(
        driver, driven, at, table.position, *load, contact_law=plane
    )
    (pair,) = potential_energy.pair_stiffness(
        driver, driven, at, [solved.pair.pitch_point], *load, contact_law=plane
    )
    rows = [
        ("mean mesh stiffness", "N/m", stiffness.mean(), energy.mean()),
        ("peak-to-peak / mean", "-", _fluctuation(stiffness), _fluctuation(energy)),
        (
            "one pair at the pitch point",
            "N/m",
            solved.result.cycle.pair_stiffness[0, 0, 0],
            pair,
        ),
    ]
    return [
        Comparison(quantity, "average", oracle, unit, float(fe), float(expected))
        for quantity, unit, fe, expected in rows
    ]


def _local_slopes(solved: _Solved) -> list[Comparison]:
    """Slope of force over deflection, against ISO 6336, with and without bodies."""
    iso = _iso_mesh_stiffness(solved)
    twists = [_twist(gear, solved) for gear in solved.gears]
    series = 1.0 / (1.0 / iso + twists[0] + twists[1])
    local = float(solved.result.table["local_stiffness_N_per_m"][0].mean())
    names = ("ISO 6336 c_gamma", "ISO 6336 in series with both ring twists")
    return [
        Comparison("mean mesh stiffness", "local", name, "N/m", local, expected)
        for name, expected in zip(names, (iso, series), strict=True)
    ]


def _iso_mesh_stiffness(solved: _Solved) -> float:
    """Method B for solid discs: c_gamma b [N/m] at the load solved and materials."""
    gears = sorted(solved.gears, key=lambda gear: gear.geometry.teeth)
    pinion, wheel = (gear.geometry for gear in gears)
    # two basic racks count with the mean of their factors, clause 9.3.1
    rack_factors = [
        iso6336.basic_rack_factor(g.dedendum / g.module, g.pressure_angle)
        for g in (pinion, wheel)
    ]
    stiffness = iso6336.mean_mesh_stiffness(
        (pinion.teeth, wheel.teeth),
        solved.pair.contact_ratio,
        solved.width,
        (pinion.profile_shift, wheel.profile_shift),
        (iso6336.CORRECTION, 1.0, sum(rack_factors) / 2.0),
    )
    driver = solved.gears[0].geometry
    tangential = solved.force * driver.base_radius / driver.reference_radius
    moduli = gears[0].young_modulus, gears[1].young_modulus
    return (
        stiffness
        * iso6336.material_factor(moduli)
        * iso6336.low_load_factor(tangential / solved.width)
    )


def _pressure(solved: _Solved, plane: Plane) -> Comparison:
    """Hertz at the pitch point with the load that its pair carries there."""
    s1 = solved.pair.pitch_point
    radius = hertz.effective_radius(s1, solved.pair.line_of_action - s1)
    materials = [
        hertz.Material(gear.young_modulus, gear.poisson_ratio) for gear in solved.gears
    ]
    modulus = hertz.effective_modulus(materials[0], materials[1], plane)
    load = float(solved.result.cycle.load[0, 0, 0]) / solved.width
    expected = float(hertz.peak_pressure(load, radius, modulus))
    computed = float(solved.result.cycle.pressure[0, 0, 0])
    name = "largest pressure at the pitch point"
    return Comparison(name, "-", "Hertz", "Pa", computed, expected)


def _fluctuation(values: NDArray[np.float64]) -> float:
    return float(np.ptp(values) / values.mean())


def _analytic(gear: Gear) -> potential_energy.AnalyticGear:
    return potential_energy.AnalyticGear(
        **{name: getattr(gear.geometry, name) for name in GEOMETRY},
        young_modulus=gear.young_modulus,
        poisson_ratio=gear.poisson_ratio,
    )


def _twist(gear: Gear, solved: _Solved) -> float:
    """Compliance of the body below the root circle, along the line of action [m/N]."""
    body = ring.Ring(
        hub_radius=gear.geometry.hub_radius,
        outer_radius=gear.geometry.root_radius,
        shear_modulus=ring.shear_modulus(gear.young_modulus, gear.poisson_ratio),
        face_width=solved.width,
    )
    return 1.0 / ring.line_of_action_stiffness(body, gear.geometry.base_radius)
