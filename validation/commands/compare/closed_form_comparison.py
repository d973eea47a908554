"""Finite elements against closed forms: one table, differences in per cent."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fegear.contact.edges import edge_pairs
from fegear.contact.plane.solve import solve_pair_alone
from fegear.contact.problem import ContactProblem
from fegear.contact.solve import solve_cycle
from fegear.files.codes import with_code
from fegear.gearset.model import Gear, GearSet
from fegear.gearset.pitch_errors import without_pitch_errors
from fegear.gearset.planes import Plane, section_plane
from fegear.statics.contact_problem import contact_problem
from fegear.statics.mesh_result import StaticsResult
from fegear.statics.settings import StaticsSettings
from fegear.statics.solving import mesh_statics
from fegear.statics.table_warnings import table_warnings
from meshes import GearPair, SpurGear
from validation.oracles import hertz, iso6336, potential_energy, ring

GEOMETRY = (
    *("teeth", "module", "pressure_angle", "profile_shift", "tooth_thinning"),
    *("tip_radius", "root_radius", "hub_radius"),
)


@dataclass(frozen=True)
class Comparison:
    """One quantity by finite elements and by an oracle, both in `unit`.

    plane : of the finite elements
    finite_elements : None where they have no such quantity
    expected : None where the closed form does not apply to the teeth
    note : why it does not, or what limits or reduces it; empty where nothing does
    """

    quantity: str
    slope: str
    plane: Plane
    oracle: str
    unit: str
    finite_elements: float | None
    expected: float | None
    note: str = ""

    @property
    def per_cent(self) -> float | None:
        """How far the oracle lies above the finite elements."""
        if self.expected is None or self.finite_elements is None:
            return None
        return 100.0 * (self.expected / self.finite_elements - 1.0)


@dataclass(frozen=True)
class _SolvedMesh:
    """One solved torque and what the closed forms need to know of it."""

    result: StaticsResult
    gears: tuple[Gear, Gear]  # driver and driven
    plane: Plane
    misalignment: float  # m, at the far end of the width
    slope: float  # m, of misalignment and of leads, over the common width

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
class MeshComparison:
    """All comparisons of a mesh; warnings : why some of them mean little."""

    rows: tuple[Comparison, ...]
    warnings: tuple[str, ...]


def compare_mesh(
    gear_set: GearSet, mesh: int, torque: float, settings: StaticsSettings
) -> MeshComparison:
    """All comparisons for one mesh at one torque on its driver [N m]."""
    spec, plane = gear_set.meshes[mesh], settings.plane_of(gear_set)
    teeth = without_pitch_errors(gear_set)
    solved = _SolvedMesh(
        result=mesh_statics(teeth, mesh, [torque], settings),
        gears=(gear_set.gears[spec.driver], gear_set.gears[spec.driven]),
        plane=plane,
        misalignment=spec.misalignment,
        slope=_slope_over_width(teeth, mesh),
    )
    if spec.varies_over_width:
        rows = tuple(_local_slopes(solved))
        if not any(gear.geometry.sign < 0 for gear in solved.gears):
            rows = (*rows, *_over_the_width(solved))
        unknown = tuple(_unknown_to_closed_forms(solved))
        return MeshComparison(rows, (*unknown, *table_warnings(solved.result)))
    other: Plane = "strain" if plane == "stress" else "stress"
    in_other = contact_problem(teeth, mesh, replace(settings, plane=other))
    rows = (
        *_average_slopes(solved),
        *_local_slopes(solved),
        _pressure_comparison(solved.result.problem, solved, solved.plane),
        _pressure_comparison(in_other, solved, other),
    )
    unknown = tuple(_unknown_to_closed_forms(solved))
    return MeshComparison(rows, (*unknown, *table_warnings(solved.result)))


def _unknown_to_closed_forms(solved: _SolvedMesh) -> Iterator[str]:
    """What the gears have and the closed forms have not."""
    problem = solved.result.problem
    if solved.misalignment:
        yield with_code(
            "W25",
            f"misalignment of {1e6 * solved.misalignment:.4g} um, which of the "
            "closed forms K_Hbeta alone has",
        )
    for gear, flank in zip(solved.gears, problem.flanks, strict=True):
        for modification, value in (
            ("lead modification", flank.lead),
            ("topography", flank.topography),
        ):
            if value:
                yield with_code(
                    "W25",
                    f'gear "{gear.name}" has a {modification}, which the closed forms '
                    "leave out",
                )
        for end, relief in zip(("tip", "root"), flank.reliefs, strict=True):
            if relief:
                yield with_code(
                    "W25",
                    f'gear "{gear.name}" has {end} relief, which the closed forms '
                    "leave out",
                )
        if flank.profile:
            yield with_code(
                "W25",
                f'gear "{gear.name}" has a profile modification, which the closed '
                "forms leave out",
            )
        if any(gear.pitch_errors):
            yield with_code(
                "W26",
                f'gear "{gear.name}" has pitch_errors_um, which are left out: the '
                "closed forms know none",
            )


def _average_slopes(solved: _SolvedMesh) -> list[Comparison]:
    """Force over deflection, against the potential-energy method.

    The pair at the pitch point carries all the load in both, so that the finite
    elements contain no deflection by other pairs.
    """
    table, problem = solved.result.table, solved.result.problem
    stiffness = table["stiffness_N_per_m"][0]
    alone = solve_pair_alone(problem, float(table.torque_Nm[0]), 0.0)
    elements = (
        ("mean mesh stiffness", "N/m", float(stiffness.mean())),
        ("peak-to-peak / mean", "-", _relative_fluctuation(stiffness)),
        ("one pair alone at the pitch point", "N/m", float(alone.stiffness[0, 0])),
    )
    closed: tuple[float | None, ...] = (None, None, None)
    try:
        closed, note = _potential_energy(solved)
    except potential_energy.NotApplicableError as error:
        note = f"does not apply: {error}"
    oracle = "potential energy, Sainsot body"
    return [
        Comparison(name, "average", solved.plane, oracle, unit, value, expected, note)
        for (name, unit, value), expected in zip(elements, closed, strict=True)
    ]


def _potential_energy(solved: _SolvedMesh) -> tuple[tuple[float, float, float], str]:
    """Mean and fluctuation of the mesh stiffness and that of one pair; their limits.

    Raises NotApplicableError for teeth that the method does not describe.
    """
    driver, driven = map(_analytic_gear, solved.gears)
    gears = driver, driven, solved.pair.operating_pressure_angle
    load, law = (solved.force, solved.width), section_plane(solved.plane)
    mesh = potential_energy.mesh_stiffness(
        *gears,
        solved.result.table.position,
        *load,
        contact_law=law,
    )
    (pair,) = potential_energy.pair_stiffness(
        *gears,
        [solved.pair.pitch_point],
        *load,
        contact_law=law,
    )
    limits = (
        f'gear "{gear.name}": {line}'
        for gear, analytic in zip(solved.gears, (driver, driven), strict=True)
        for line in potential_energy.body_fit_limits(analytic)
    )
    return (float(mesh.mean()), _relative_fluctuation(mesh), float(pair)), "; ".join(
        limits
    )


def _local_slopes(solved: _SolvedMesh) -> Iterator[Comparison]:
    """Slope of force over deflection, against ISO 6336, with and without bodies.

    Where the standard reduces the stiffness for a low load, it is shown without the
    reduction as well: finite elements soften by the contact alone, much less.
    """
    local = float(solved.result.table["local_stiffness_N_per_m"][0].mean())
    for gear in solved.gears:
        if gear.geometry.sign < 0:
            note = f"does not apply: {_internal_note(gear)}"
            yield _local_slope(solved, "ISO 6336 c_gamma", local, None, note)
            return
    full = _iso_mesh_stiffness(solved)
    twists = sum(_twist_compliance(gear, solved) for gear in solved.gears)
    limits = "; ".join(_iso_limits(solved))
    specific = _specific_load(solved)
    factor = iso6336.low_load_factor(specific)
    shown = [("", full, limits)]
    if factor < 1.0:
        reduced = (
            f"reduced to {factor:.3g} of its value, as Ft/b is "
            f"{1e-3 * specific:.4g} N/mm, below "
            f"{1e-3 * iso6336.FULL_SPECIFIC_LOAD:g} N/mm"
        )
        note = "; ".join(filter(None, (reduced, limits)))
        shown = [
            ("", factor * full, note),
            (" without its reduction at low load", full, limits),
        ]
    for suffix, iso, note in shown:
        series = 1.0 / (1.0 / iso + twists)
        for oracle, expected in (
            (f"ISO 6336 c_gamma{suffix}", iso),
            (f"ISO 6336{suffix} in series with both ring twists", series),
        ):
            reasons = (note, _bore_note(solved)) if expected == iso else (note,)
            text = "; ".join(filter(None, reasons))
            yield _local_slope(solved, oracle, local, expected, text)


def _slope_over_width(gear_set: GearSet, mesh: int) -> float:
    """Gap over the common width of a helix, by misalignment and slopes of leads [m]."""
    spec, width = gear_set.meshes[mesh], gear_set.helix_width(mesh)
    span = gear_set.common_width(mesh) + gear_set.common_groove(mesh)
    slopes = (
        flank.lead.slope * width / gear_set.gears[gear].face_width
        for gear, flank in zip(spec.gears, spec.flanks, strict=True)
        if flank.lead is not None
    )
    return spec.misalignment * width / span + sum(slopes)


def _over_the_width(solved: _SolvedMesh) -> Iterator[Comparison]:
    """What varies over the width: K_Hbeta, c' of one pair, pressure."""
    figures, plane = solved.result.key_figures[0], solved.plane
    specific = _specific_load(solved)
    reduction = iso6336.low_load_factor(specific)
    per_width = reduction * _iso_mesh_stiffness(solved) / solved.width
    factor = iso6336.face_load_factor(solved.slope, per_width, specific)
    yield Comparison(
        *("load distribution factor K_Hbeta", "-", plane, "ISO 6336 K_Hbeta", "-"),
        *(figures["load_distribution_factor"], factor, _factor_note(solved)),
    )
    yield Comparison(
        *("stiffness of one pair over the width", "-", plane, "ISO 6336 c'"),
        *("N/m", None, reduction * _iso_single_stiffness(solved)),
        "no value by finite elements: no single pair is in contact along one line "
        "over all of its width, with equal loads",
    )
    yield _pressure_over_the_width(solved)


def _factor_note(solved: _SolvedMesh) -> str:
    """Say what the standard's factor is made of."""
    if not solved.slope:
        return "no misalignment: load is uniform by the standard"
    text = (
        f"by a gap of {1e6 * abs(solved.slope):.4g} um over the width and "
        f"c_gamma_beta = {iso6336.MISALIGNED:g} c_gamma_alpha, without running-in"
    )
    if any(flank.lead for flank in solved.result.problem.flanks):
        text += "; crowning and end relief are left out"
    return text


def _pressure_over_the_width(solved: _SolvedMesh) -> Comparison:
    """Hertz at the pitch point under the load spread evenly over the lines of contact.

    Helical pairs have lines of a mean length of b eps_alpha / cos(beta_b) in total.
    """
    pair = solved.pair
    cosine = math.cos(pair.driver.base_helix_angle)
    is_helical = pair.driver.twist != 0.0
    lines = pair.contact_ratio if is_helical else 1.0
    s1 = pair.pitch_point
    radius = hertz.effective_radius(s1, pair.line_of_action - s1) / cosine
    materials = [
        hertz.Material(gear.young_modulus, gear.poisson_ratio) for gear in solved.gears
    ]
    modulus = hertz.effective_modulus(materials[0], materials[1], "strain")
    # the normal force and the length of a line both have the cosine
    load = solved.force / (solved.width * lines)
    pressure = solved.result.key_figures[0]["pressure_at_pitch_point_plane_strain_MPa"]
    note = "load spread evenly over the width of one pair"
    if is_helical:
        note = "load spread evenly over lines of contact of their mean length"
    return Comparison(
        "largest pressure at the pitch point",
        *("-", "strain", "Hertz, plane strain", "Pa"),
        finite_elements=1e6 * pressure,
        expected=float(hertz.peak_pressure(load, radius, modulus)),
        note=note,
    )


def _bore_note(solved: _SolvedMesh) -> str:
    """Bores as a reason for differences to a formula of teeth alone."""
    one, two = (
        gear.geometry.hub_radius / gear.geometry.root_radius for gear in solved.gears
    )
    return (
        f"teeth without the bodies on bores of {one:.2g} and {two:.2g} root radii, "
        "which make finite elements softer, or stiffer where they are near the teeth"
    )


def _local_slope(
    solved: _SolvedMesh, oracle: str, local: float, expected: float | None, note: str
) -> Comparison:
    return Comparison(
        "mean mesh stiffness", "local", solved.plane, oracle, "N/m", local, expected,
        note,
    )  # fmt: skip


def _internal_note(gear: Gear) -> str:
    return f'gear "{gear.name}" is internal, the closed form is of external teeth'


def _pinion_and_wheel(solved: _SolvedMesh) -> list[Gear]:
    return sorted(solved.gears, key=lambda gear: gear.geometry.teeth)


def _iso_limits(solved: _SolvedMesh) -> Iterator[str]:
    pinion, wheel = (gear.geometry for gear in _pinion_and_wheel(solved))
    shifts = _normal_shift(pinion), _normal_shift(wheel)
    return iso6336.regression_limits(shifts, solved.pair.contact_ratio)


def _helix_angle(gear: SpurGear) -> float:
    return math.atan(abs(gear.twist) * gear.reference_radius)


def _normal_shift(gear: SpurGear) -> float:
    """Profile shift in normal modules."""
    return gear.profile_shift / math.cos(_helix_angle(gear))


def _iso_single_stiffness(solved: _SolvedMesh) -> float:
    """Method B for solid discs: c' b [N/m], that of a mesh at a contact ratio of 1."""
    return _iso_mesh_stiffness(solved, contact_ratio=1.0)


def _iso_mesh_stiffness(
    solved: _SolvedMesh, contact_ratio: float | None = None
) -> float:
    """Method B for solid discs: c_gamma b [N/m] at full load and of the materials.

    contact_ratio : None for that of the pair
    """
    gears = _pinion_and_wheel(solved)
    pinion, wheel = (gear.geometry for gear in gears)
    # two basic racks count with the mean of their factors, clause 9.3.1
    helix_angle = _helix_angle(pinion)
    cosine = math.cos(helix_angle)
    normal_angle = math.atan(math.tan(pinion.pressure_angle) * cosine)
    rack_factors = [
        iso6336.basic_rack_factor(g.dedendum / (g.module * cosine), normal_angle)
        for g in (pinion, wheel)
    ]
    stiffness = iso6336.mean_mesh_stiffness(
        (pinion.teeth, wheel.teeth),
        solved.pair.contact_ratio if contact_ratio is None else contact_ratio,
        solved.width,
        (_normal_shift(pinion), _normal_shift(wheel)),
        (iso6336.CORRECTION, 1.0, sum(rack_factors) / 2.0),
        (helix_angle, pinion.base_helix_angle),
    )
    moduli = gears[0].young_modulus, gears[1].young_modulus
    return stiffness * iso6336.material_factor(moduli)


def _specific_load(solved: _SolvedMesh) -> float:
    """Ft / b at the reference circle [N/m]."""
    driver = solved.gears[0].geometry
    return solved.force * driver.base_radius / driver.reference_radius / solved.width


def _pressure_comparison(
    problem: ContactProblem, solved: _SolvedMesh, plane: Plane
) -> Comparison:
    """Hertz in a plane, at the pitch point with the load that its pair carries there.

    problem : the mesh in this plane
    """
    s1 = solved.pair.pitch_point
    radius = hertz.effective_radius(s1, solved.pair.line_of_action - s1)
    materials = [
        hertz.Material(gear.young_modulus, gear.poisson_ratio) for gear in solved.gears
    ]
    modulus = hertz.effective_modulus(materials[0], materials[1], section_plane(plane))
    cycle = solve_cycle(problem, solved.result.cycle.torque, 0.0)
    reference = cycle.teeth == 0
    load = float(cycle.load[0, 0, reference][0]) / solved.width
    computed = float(cycle.pressure[0, 0, reference][0])
    expected = float(hertz.peak_pressure(load, radius, modulus))
    quantity, oracle = "largest pressure at the pitch point", f"Hertz, plane {plane}"
    note = ""
    if edge_pairs(problem, cycle, 0)[0, reference][0]:
        note = "an edge of a flank is in contact, where pressure has no limit"
    return Comparison(quantity, "-", plane, oracle, "Pa", computed, expected, note)


def _relative_fluctuation(values: NDArray[np.float64]) -> float:
    return float(np.ptp(values) / values.mean())


def _analytic_gear(gear: Gear) -> potential_energy.AnalyticGear:
    if gear.geometry.sign < 0:
        raise potential_energy.NotApplicableError(_internal_note(gear))
    try:
        return potential_energy.AnalyticGear(
            **{name: getattr(gear.geometry, name) for name in GEOMETRY},
            young_modulus=gear.young_modulus,
            poisson_ratio=gear.poisson_ratio,
        )
    except potential_energy.NotApplicableError as error:
        message = f'gear "{gear.name}": {error}'
        raise potential_energy.NotApplicableError(message) from None


def _twist_compliance(gear: Gear, solved: _SolvedMesh) -> float:
    """Compliance of the body below the root circle, along the line of action [m/N]."""
    body = ring.Ring(
        hub_radius=gear.geometry.hub_radius,
        outer_radius=gear.geometry.root_radius,
        shear_modulus=ring.shear_modulus(gear.young_modulus, gear.poisson_ratio),
        face_width=solved.width,
    )
    return 1.0 / ring.line_of_action_stiffness(body, gear.geometry.base_radius)
