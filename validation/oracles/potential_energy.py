"""Stiffness of spur tooth pairs by the potential energy method.

A tooth is a cantilever of varying section, cut at its true profile (involute, a
radial line below the base circle where needed, and a circular fillet of 0.38 m
tangent to flank and root circle), held where the fillet meets the root circle.
Yang & Lin (1987), Tian (2004); the body follows Sainsot, Velex & Duverger (2004).

Tooth frame: x outward along the centre line of the tooth, y across it, the axis of
the gear at the origin; the loaded flank has y > 0. Angles are measured from x. On
the loaded flank the roll angle phi = s / rb fixes everything: the line of action
makes beta = phi - psi_b with the y axis, where psi_b is half the tooth angle on the
base circle, and crosses x at rb / cos(beta).

Beams are in plane stress (free side faces), as is the body formula. The pairs in
contact do not deflect each other here, and the twist of the body on its hub, which
the body formula contains, is counted once per pair although the pairs share it: so
the stiffness is too large in double contact, the more so the smaller the hub.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lumped.closed_forms.tooth_energy import (
    FlankForce,
    ToothFoundation,
    ToothMaterial,
    ToothSections,
    beam_compliance,
)
from lumped.common.array_types import Array
from validation.oracles.hertz import (
    Material,
    Plane,
    approach,
    effective_radius,
    linear_compliance,
    require_positive,
)

ContactLaw = Plane | Literal["linear"]

FILLET_RADIUS = 0.38  # over the module, rho_fP of the ISO 53 basic rack, profile A
QUADRATURE_POINTS = 16  # per stretch of profile
SHARING_TOLERANCE = 1e-12  # of the force, between two rounds of load sharing
SHARING_ROUNDS = 100  # the Hertz logarithm is weak: about ten are needed

BODY_RATIOS = 1.4, 7.0  # root over hub radius for which the body was fitted
BODY_ANGLES = 0.01, 0.12  # half tooth angle at the root, likewise [rad]


class EnergyTooth(Protocol):
    """Teeth of one gear, of whatever outline; lengths in metres."""

    @property
    def base_radius(self) -> float: ...

    @property
    def base_pitch(self) -> float: ...

    @property
    def base_half_angle(self) -> float: ...

    @property
    def tip_roll_length(self) -> float: ...

    @property
    def material(self) -> Material: ...

    def compliance(self, roll_length: ArrayLike, face_width: float) -> Array:
        """Tooth and body, without contact, at roll lengths (n,), (n,) [m/N]."""
        ...


class NotApplicableError(ValueError):
    """Teeth that the method does not describe; the message says why."""


@dataclass(frozen=True, kw_only=True)
class AnalyticGear:
    """External involute spur gear on a rigid hub; metres, radians, pascals.

    profile_shift is in modules; tooth_thinning is taken off the arc thickness of the
    tooth on the reference circle.
    """

    teeth: int
    module: float
    pressure_angle: float
    profile_shift: float
    tip_radius: float
    root_radius: float
    hub_radius: float
    young_modulus: float
    poisson_ratio: float
    tooth_thinning: float = 0.0

    def __post_init__(self) -> None:
        if not 0.0 < self.hub_radius < self.root_radius < self.tip_radius:
            raise ValueError(
                "radii must satisfy 0 < hub < root < tip, got "
                f"{self.hub_radius}, {self.root_radius}, {self.tip_radius}"
            )
        for name in ("young_modulus", "pressure_angle"):
            require_positive(name, getattr(self, name))
        if not self.tip_half_angle > 0.0:
            raise NotApplicableError(
                "tip_radius must leave some tooth thickness, "
                f"got {self.tip_radius} with half angle {self.tip_half_angle} rad"
            )
        if self.root_half_angle > math.pi / self.teeth:
            raise NotApplicableError(
                f"root fillets of {FILLET_RADIUS} module must fit between the teeth, "
                f"got half tooth angle {self.root_half_angle:.4g} rad at the root, "
                f"allowed is at most {math.pi / self.teeth:.4g} rad"
            )

    @property
    def base_radius(self) -> float:
        return 0.5 * self.module * self.teeth * math.cos(self.pressure_angle)

    @property
    def base_pitch(self) -> float:
        return math.pi * self.module * math.cos(self.pressure_angle)

    @property
    def base_half_angle(self) -> float:
        """psi_b, half the angle of the tooth on the base circle [rad]."""
        alpha, m = self.pressure_angle, self.module
        thickness = m * (0.5 * math.pi + 2.0 * self.profile_shift * math.tan(alpha))
        thickness -= self.tooth_thinning
        return thickness / (m * self.teeth) + math.tan(alpha) - alpha

    @property
    def fillet_centre_roll(self) -> float:
        """Roll length of the fillet centre, on the involute parallel to the flank [m].

        At least rho: a lower fillet meets a radial line, at that distance from it.
        """
        rho = FILLET_RADIUS * self.module
        squared = (self.root_radius + rho) ** 2 - self.base_radius**2
        return max(math.sqrt(max(squared, 0.0)), rho)

    @property
    def form_roll_length(self) -> float:
        """Roll length where the involute begins, 0 at the base circle [m]."""
        return self.fillet_centre_roll - FILLET_RADIUS * self.module

    @property
    def tip_roll_length(self) -> float:
        return math.sqrt(self.tip_radius**2 - self.base_radius**2)

    @property
    def tip_half_angle(self) -> float:
        """Half the angle of the tooth on the tip circle, psi_b - inv(alpha_a) [rad]."""
        tangent = self.tip_roll_length / self.base_radius
        return self.base_half_angle - tangent + math.atan(tangent)

    @property
    def root_half_angle(self) -> float:
        """theta_f, half the angle of the tooth where fillet meets root circle [rad]."""
        centre_radius = self.root_radius + FILLET_RADIUS * self.module
        beta = self.form_roll_length / self.base_radius - self.base_half_angle
        return math.asin(self.fillet_centre_roll / centre_radius) - beta

    @property
    def material(self) -> Material:
        return Material(self.young_modulus, self.poisson_ratio)

    def compliance(self, roll_length: ArrayLike, face_width: float) -> Array:
        return tooth_compliance(self, roll_length, face_width).total


class ToothCompliance(NamedTuple):
    """Displacement along the line of action per unit force, each (n,) [m/N]."""

    bending: Array
    shear: Array
    axial: Array
    body: Array

    @property
    def total(self) -> Array:
        return self.bending + self.shear + self.axial + self.body


def _gauss_points(start: ArrayLike, end: ArrayLike) -> tuple[Array, Array]:
    """Gauss-Legendre points and weights on intervals (n,), shape (n, q) each."""
    node, weight = np.polynomial.legendre.leggauss(QUADRATURE_POINTS)
    low, high = np.atleast_1d(start)[:, None], np.atleast_1d(end)[:, None]
    half = 0.5 * (high - low)
    return low + half * (1.0 + node), half * weight


def _fillet_sections(gear: AnalyticGear) -> ToothSections:
    """Circular fillet, from the root circle to the flank, shape (1, q)."""
    rho, theta_f = FILLET_RADIUS * gear.module, gear.root_half_angle
    beta = gear.form_roll_length / gear.base_radius - gear.base_half_angle
    centre = gear.root_radius + rho
    omega, weight = _gauss_points(theta_f, 0.5 * math.pi - beta)
    x = centre * math.cos(theta_f) - rho * np.cos(omega)
    y = centre * math.sin(theta_f) - rho * np.sin(omega)
    return ToothSections(x, y, y, rho * np.sin(omega) * weight)


def _radial_sections(gear: AnalyticGear) -> ToothSections:
    """Radial flank between fillet and base circle, empty if none, shape (1, q)."""
    if gear.form_roll_length > 0.0:
        return ToothSections(*(np.zeros((1, 0)) for _ in range(4)))
    rho, psi_b = FILLET_RADIUS * gear.module, gear.base_half_angle
    form_radius = math.sqrt((gear.root_radius + rho) ** 2 - rho**2)
    r, weight = _gauss_points(form_radius, gear.base_radius)
    y = r * math.sin(psi_b)
    return ToothSections(r * math.cos(psi_b), y, y, weight * math.cos(psi_b))


def _involute_sections(gear: AnalyticGear, roll_length: Array) -> ToothSections:
    """Involute from the form point to the load at roll_length (n,), shape (n, q)."""
    rb = gear.base_radius
    phi, weight = _gauss_points(gear.form_roll_length / rb, roll_length / rb)
    beta = phi - gear.base_half_angle
    x = rb * (np.cos(beta) + phi * np.sin(beta))
    y = rb * (phi * np.cos(beta) - np.sin(beta))
    return ToothSections(x, y, y, rb * phi * np.cos(beta) * weight)


def tooth_sections(gear: AnalyticGear, roll_length: Array) -> ToothSections:
    """All sections between the root circle and the loaded point, shape (n, q)."""
    parts = (
        _fillet_sections(gear),
        _radial_sections(gear),
        _involute_sections(gear, roll_length),
    )
    n = roll_length.size
    columns = [
        np.concatenate([np.broadcast_to(a, (n, a.shape[1])) for a in fields], axis=1)
        for fields in zip(*parts, strict=True)
    ]
    return ToothSections(*columns)


def body_fit_limits(gear: AnalyticGear) -> Iterator[str]:
    """A line for each range of the fit of Sainsot et al. (2004) that a gear leaves."""
    ratio, theta = gear.root_radius / gear.hub_radius, gear.root_half_angle
    for name, value, (low, high), unit in (
        ("root over hub radius", ratio, BODY_RATIOS, ""),
        ("half tooth angle at the root", theta, BODY_ANGLES, " rad"),
    ):
        if not low <= value <= high:
            yield (
                f"body fitted for {name} from {low:g} to {high:g}{unit}, got "
                f"{value:.4g}"
            )


def body_compliance(gear: AnalyticGear, roll_length: Array, face_width: float) -> Array:
    """Body term where the line of action crosses the centre line, shape (n,) [m/N]."""
    body = ToothFoundation(
        root_radius=gear.root_radius,
        hub_radius=gear.hub_radius,
        root_half_angle=gear.root_half_angle,
        young_modulus=gear.young_modulus,
    )
    beta = roll_length / gear.base_radius - gear.base_half_angle
    return body.compliance(gear.base_radius / np.cos(beta), beta, face_width)


def tooth_compliance(
    gear: AnalyticGear, roll_length: ArrayLike, face_width: float
) -> ToothCompliance:
    """Compliance of one tooth and its body, without contact, each term (n,) [m/N].

    roll_length : (n,) s between the form point and the tip [m]; face_width [m]
    """
    require_positive("face_width", face_width)
    s = _require_on_flank(gear, roll_length)
    load = FlankForce(gear.base_radius, s / gear.base_radius - gear.base_half_angle)
    material = ToothMaterial(gear.young_modulus, gear.poisson_ratio)
    beam = beam_compliance(tooth_sections(gear, s), load, material, face_width)
    return ToothCompliance(*beam, body=body_compliance(gear, s, face_width))


def _require_on_flank(gear: AnalyticGear, roll_length: ArrayLike) -> Array:
    s = np.atleast_1d(np.asarray(roll_length, dtype=float))
    low, high = gear.form_roll_length, gear.tip_roll_length
    slack = 1e-9 * gear.module
    if not np.all((s >= low - slack) & (s <= high + slack)):
        raise NotApplicableError(
            f"roll_length must lie on the involute between {low:.6g} and {high:.6g} m, "
            f"got {s.min():.6g} to {s.max():.6g} m"
        )
    return s


def nominal_path(
    driver: EnergyTooth, driven: EnergyTooth, operating_pressure_angle: float
) -> tuple[float, float]:
    """Roll lengths of the driver at start and end of contact [m]."""
    if not math.isclose(driver.base_pitch, driven.base_pitch, rel_tol=1e-9):
        raise ValueError(
            "driver and driven must have one base pitch, "
            f"got {driver.base_pitch} and {driven.base_pitch}"
        )
    total = _line_of_action(driver, driven, operating_pressure_angle)
    return total - driven.tip_roll_length, driver.tip_roll_length


def _line_of_action(driver: EnergyTooth, driven: EnergyTooth, angle: float) -> float:
    """Length a sin(aw) between the base circles [m]."""
    return (driver.base_radius + driven.base_radius) * math.tan(angle)


def _contact_approach(
    gears: tuple[EnergyTooth, EnergyTooth],
    rolls: tuple[Array, Array],
    load: Array,
    law: ContactLaw,
) -> Array:
    """Hertzian approach at load per width (n,), shape (n,) [m].

    The finite-depth laws measure, after Weber (1949), from the surface to where the
    line of action crosses the centre line of the tooth: d = s - rb tan(beta).
    """
    if law == "linear":
        return load * linear_compliance(gears[0].material, gears[1].material)
    d1, d2 = (
        s - gear.base_radius * np.tan(s / gear.base_radius - gear.base_half_angle)
        for gear, s in zip(gears, rolls, strict=True)
    )
    materials = (gears[0].material, gears[1].material)
    return approach(load, effective_radius(*rolls), materials, (d1, d2), law)


def pair_stiffness(
    driver: EnergyTooth,
    driven: EnergyTooth,
    operating_pressure_angle: float,
    roll_length_of_driver: ArrayLike,
    force: ArrayLike,
    face_width: float,
    *,
    contact_law: ContactLaw = "strain",
) -> Array:
    """Average stiffness F / delta of one pair along the line of action, (n,) [N/m].

    roll_length_of_driver : (n,) s1; the driven gear touches at a sin(aw) - s1 [m]
    force : scalar or (n,) force of the pair > 0 [N]
    contact_law : finite depth in plane "strain" or "stress" (nonlinear), or Yang &
        Sun's "linear" constant
    """
    require_positive("force", force)
    s1 = np.atleast_1d(np.asarray(roll_length_of_driver, dtype=float))
    s2 = _line_of_action(driver, driven, operating_pressure_angle) - s1
    F = np.broadcast_to(np.asarray(force, dtype=float), s1.shape)
    teeth = driver.compliance(s1, face_width) + driven.compliance(s2, face_width)
    contact = _contact_approach((driver, driven), (s1, s2), F / face_width, contact_law)
    return np.asarray(F / (F * teeth + contact))


def mesh_stiffness(
    driver: EnergyTooth,
    driven: EnergyTooth,
    operating_pressure_angle: float,
    positions: ArrayLike,
    force: float,
    face_width: float,
    *,
    contact_law: ContactLaw = "strain",
) -> Array:
    """Average stiffness F / delta of all pairs on the nominal path, (n,) [N/m].

    Pairs deflect equally and share the force; no relief, no contact beyond the
    nominal path, no coupling of the pairs through the bodies (module docstring).

    positions : (n,) p in base pitches from the pitch point; pair k touches at
        s1 = rb1 tan(aw) + (p + k) pb
    force : of the whole mesh > 0 [N]
    """
    require_positive("force", force)
    gears = (driver, driven, operating_pressure_angle)
    s1, active = touching_pairs(*gears, np.atleast_1d(np.asarray(positions, float)))
    shares = force * active / active.sum(axis=1, keepdims=True)
    for _ in range(SHARING_ROUNDS):
        pairs = np.zeros(s1.shape)
        pairs[active] = pair_stiffness(
            *gears, s1[active], shares[active], face_width, contact_law=contact_law
        )
        total = pairs.sum(axis=1)
        previous, shares = shares, force * pairs / total[:, None]
        if np.all(np.abs(shares - previous) <= SHARING_TOLERANCE * force):
            return np.asarray(total)
    raise RuntimeError(f"load sharing did not settle in {SHARING_ROUNDS} rounds")


def touching_pairs(
    driver: EnergyTooth, driven: EnergyTooth, angle: float, positions: Array
) -> tuple[Array, NDArray[np.bool_]]:
    """Roll lengths of the driver [m] and which of them touch, both (n, pairs)."""
    start, end = nominal_path(driver, driven, angle)
    pitch, middle = driver.base_pitch, driver.base_radius * math.tan(angle)
    if not end - start >= pitch:
        raise ValueError(
            f"contact ratio must be 1 or more, got {(end - start) / pitch}"
        )
    first = math.floor((start - middle) / pitch - positions.max())
    last = math.ceil((end - middle) / pitch - positions.min())
    s1 = middle + (positions[:, None] + np.arange(first, last + 1)) * pitch
    return s1, (s1 >= start) & (s1 <= end)
