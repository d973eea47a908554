"""Hertzian line contact of two long elastic cylinders (half-planes).

Symbols and equation numbers follow K. L. Johnson, Contact Mechanics (1985).
Every load is per unit length of contact line, positive in compression.

The half-plane formulas need two moduli of a body only: E' and nu', with
strain = (stress - nu' transverse stress) / E'. Plane strain has
E' = E / (1 - nu^2) and nu' = nu / (1 - nu); plane stress has E' = E and nu' = nu.
Johnson prints plane strain; the plane stress analogue is this replacement.
"""

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from lumped.closed_forms.tooth_energy import ToothMaterial, contact_compliance
from lumped.common.array_types import Array

Plane = Literal["stress", "strain"]


class Material(NamedTuple):
    """Isotropic linear elasticity."""

    young_modulus: float  # Pa
    poisson_ratio: float


def plane_moduli(material: Material, plane: Plane) -> Material:
    """Moduli E' [Pa] and nu' of the in-plane law, see the module docstring."""
    E, nu = material
    if plane == "stress":
        return Material(E, nu)
    if plane == "strain":
        return Material(E / (1.0 - nu**2), nu / (1.0 - nu))
    raise ValueError(f"plane = {plane!r}; must be 'stress' or 'strain'")


def effective_modulus(first: Material, second: Material, plane: Plane) -> float:
    """Contact modulus E* [Pa], 1/E* = 1/E1' + 1/E2', Johnson eq. (4.2c)."""
    E1, E2 = (plane_moduli(body, plane).young_modulus for body in (first, second))
    return 1.0 / (1.0 / E1 + 1.0 / E2)


def effective_radius(first: ArrayLike, second: ArrayLike) -> Array:
    """R, 1/R = 1/R1 + 1/R2 [m]; convex radii are positive, inf is flat."""
    R1, R2 = np.asarray(first, dtype=float), np.asarray(second, dtype=float)
    return np.asarray(1.0 / (1.0 / R1 + 1.0 / R2))


def half_width(load: ArrayLike, radius: ArrayLike, modulus: float) -> Array:
    """Half-width a = sqrt(4 P R / (pi E*)), Johnson eq. (4.43), shape (n,) [m].

    load : (n,) force per length P [N/m], compression positive
    radius : effective radius R, scalar or (n,) [m]
    modulus : contact modulus E* [Pa]
    """
    P, R = np.asarray(load, dtype=float), np.asarray(radius, dtype=float)
    return np.asarray(np.sqrt(4.0 * P * R / (np.pi * modulus)))


def peak_pressure(load: ArrayLike, radius: ArrayLike, modulus: float) -> Array:
    """Peak p0 = sqrt(P E* / (pi R)), Johnson eq. (4.45), shape (n,) [Pa]."""
    P, R = np.asarray(load, dtype=float), np.asarray(radius, dtype=float)
    return np.asarray(np.sqrt(P * modulus / (np.pi * R)))


def pressure(position: ArrayLike, half_width: float, peak: float) -> Array:
    """p = p0 sqrt(1 - (x/a)^2) inside, 0 outside, Johnson eq. (4.44), (n,) [Pa]."""
    x = np.asarray(position, dtype=float) / half_width
    return np.asarray(peak * np.sqrt(np.maximum(1.0 - x**2, 0.0)))


def compression(
    load: ArrayLike, half_width: ArrayLike, depth: ArrayLike, body: Material
) -> Array:
    """Approach of the surface to the point at depth d below it, shape (n,) [m].

    delta = 2 P / (pi E') (asinh(d/a) - nu' (d/a) (sqrt(1 + (d/a)^2) - d/a))

    exactly for a half-plane: the integral over 0 < z < d of the axial strain
    (sigma_z - nu' sigma_x) / E' of Johnson eq. (4.46), with P = pi a p0 / 2.
    For d >> a it tends to P / (pi E') (2 ln(2 d/a) - nu'), which in plane strain
    is Johnson eq. (5.57), also Weber (1949).

    load : (n,) force per length P [N/m]; body : in-plane moduli, `plane_moduli`
    half_width, depth : scalars or (n,), a and d [m]
    """
    P = np.asarray(load, dtype=float)
    d = np.asarray(depth, dtype=float) / np.asarray(half_width, dtype=float)
    lateral = d / (np.sqrt(1.0 + d**2) + d)  # without the cancellation at d >> a
    scale = 2.0 * P / (np.pi * body.young_modulus)
    return np.asarray(scale * (np.arcsinh(d) - body.poisson_ratio * lateral))


def approach(
    load: ArrayLike,
    radius: ArrayLike,
    materials: tuple[Material, Material],
    depths: tuple[ArrayLike, ArrayLike],
    plane: Plane,
) -> Array:
    """Mutual approach of one point in each body, shape (n,) [m].

    load : (n,) force per length P > 0 [N/m]
    radius : effective radius R, scalar or (n,) [m]
    depths : distances d1, d2 from the contact to the two points, scalar or (n,) [m]

    A line load has no approach of "distant" points: it grows with ln(d1 d2).
    """
    require_positive("load", load)
    require_positive("radius", radius)
    a = half_width(load, radius, effective_modulus(*materials, plane))
    bodies = [plane_moduli(material, plane) for material in materials]
    parts = [
        compression(load, a, depth, body)
        for depth, body in zip(depths, bodies, strict=True)
    ]
    return np.asarray(parts[0] + parts[1])


def linear_compliance(first: Material, second: Material) -> float:
    """Load-free contact compliance of Yang & Sun (1985), per length [m^2/N].

    It has no logarithm and no depth, so it is a rough constant to compare with, not a
    limit of `approach`.
    """
    return contact_compliance(ToothMaterial(*first), ToothMaterial(*second), width=1.0)


def require_positive(name: str, value: ArrayLike) -> None:
    """Raise unless every element is positive; NaN is refused too."""
    if not np.all(np.asarray(value, dtype=float) > 0.0):
        raise ValueError(f"{name} = {value!r}; must be positive")
