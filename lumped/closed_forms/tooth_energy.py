"""Stiffness of a spur tooth of given outline by beam energies.

A tooth is a cantilever of varying section that is fixed at its root. A force along the
line of action bends, shears and compresses it; half its energies per half the square of
the force are its compliances (Castigliano). The body below it, the contact and the
other gear's tooth are springs in series, and pairs in contact springs in parallel:

    1 / k_pair = 1 / k_h + sum over both gears of (1/k_b + 1/k_s + 1/k_a + 1/k_f)

This is the potential-energy method of Yang and Lin (1987), with the shear of Tian
(2004), the body of Sainsot, Velex and Duverger (J. Mech. Design 126, 2004, 748) and the
contact of Yang and Sun (1985). The integrals are derived here from beam theory.

Tooth frame: x along the centre line of the tooth, outward, y across it, and the axis of
the gear at the origin. The loaded flank has y > 0. The force points at -y and -x: its
line makes the angle beta with the y axis and passes the origin at a distance d, the
base radius of an involute gear. At a section x it has

    moment  M = F (d - x cos beta),  shear  Q = F cos beta,  thrust  N = F sin beta

about the centre line. Teeth are in plane stress. A cracked section keeps these: the
literature does not move its neutral axis (`lumped.closed_forms.tooth_crack`).
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from lumped.common.array_types import Array
from lumped.common.checks import format_number

SHEAR_CORRECTION = 1.2  # rectangular section
GAUSS_POINTS = 4  # between two points of an outline

# Columns A-F of X = A/theta^2 + B h^2 + C h/theta + D/theta + E h + F for
# L*, M*, P*, Q*: Sainsot et al., J. Mech. Design 126 (2004) 748, table 1.
BODY_COEFFICIENTS = np.array(
    [
        [-5.574e-5, -1.9986e-3, -2.3015e-4, 4.7702e-3, 0.0271, 6.8045],
        [60.111e-5, 28.100e-3, -83.431e-4, -9.9256e-3, 0.1624, 0.9086],
        [-50.952e-5, 185.50e-3, 0.0538e-4, 53.300e-3, 0.2895, 0.9236],
        [-6.2042e-5, 9.0889e-3, -4.0964e-4, 7.8297e-3, -0.1472, 0.6904],
    ]
)


class ToothMaterial(NamedTuple):
    """Isotropic linear elasticity."""

    young_modulus: float  # Pa
    poisson_ratio: float

    @property
    def shear_modulus(self) -> float:
        """G = E / (2 (1 + nu)) [Pa]."""
        return self.young_modulus / (2.0 * (1.0 + self.poisson_ratio))


class FlankForce(NamedTuple):
    """Line of a force on the loaded flank, scalars or arrays of one shape."""

    distance: ArrayLike  # d, of the line from the axis of the gear [m]
    angle: ArrayLike  # beta, between the line and the y axis [rad]


class ToothSections(NamedTuple):
    """Quadrature points along a tooth, each of shape (..., q)."""

    position: Array  # x [m]
    loaded_side: Array  # of the section, from the centre line to the loaded flank [m]
    back_side: Array  # from the centre line to the other flank [m]
    weight: Array  # of the quadrature, length along x [m]


class BeamCompliance(NamedTuple):
    """Displacement along the line of action per unit force, each (...) [m/N]."""

    bending: Array
    shear: Array
    axial: Array

    @property
    def total(self) -> Array:
        """Sum of the three [m/N]."""
        return self.bending + self.shear + self.axial


@dataclass(frozen=True, eq=False)
class ToothOutline:
    """Loaded half of a symmetric tooth, from its fixed section to its tip.

    Attributes
    ----------
    position : (n,) array
        Places x along the centre line [m], rising.
    half_thickness : (n,) array
        Half the thickness of the tooth there [m], positive; straight between places.
    """

    position: Array
    half_thickness: Array

    def __post_init__(self) -> None:
        x, h = self.position, self.half_thickness
        if x.ndim != 1 or x.size < 2 or x.shape != h.shape:
            raise ValueError(
                f"shapes of position and half_thickness = {x.shape} and {h.shape}; "
                "must be two or more numbers each"
            )
        if not (np.isfinite(x).all() and (np.diff(x) > 0.0).all()):
            raise ValueError("position must rise from the fixed section to the tip")
        if not ((h > 0.0) & np.isfinite(h)).all():
            raise ValueError("half_thickness must be positive and finite")

    def thickness_at(self, position: float | Array) -> Array:
        """Half thickness at positions [m], of their shape [m]."""
        return np.asarray(np.interp(position, self.position, self.half_thickness))

    def sections(self, end: float, breaks: Iterable[float] = ()) -> ToothSections:
        """Sections between the fixed one and the loaded point.

        Parameters
        ----------
        end : float
            Position x of the loaded point [m].
        breaks : iterable of float
            Positions where a section jumps [m]; those outside the range are left out.

        Returns
        -------
        ToothSections
            `GAUSS_POINTS` sections between two neighbouring points of the outline.

        Raises
        ------
        ValueError
            If `end` is not on the tooth.
        """
        first, last = self.position[0], self.position[-1]
        if not first < end <= last:
            raise ValueError(
                f"end = {format_number(end)}; must be above {format_number(first)} and "
                f"at most {format_number(last)} m"
            )
        inside = self.position[self.position < end]
        jumps = [jump for jump in breaks if first < jump < end]
        places = np.unique(np.concatenate([inside, jumps, [end]]))
        node, weight = np.polynomial.legendre.leggauss(GAUSS_POINTS)
        half = 0.5 * np.diff(places)[:, None]
        x = (places[:-1, None] + half * (1.0 + node)).ravel()
        h = self.thickness_at(x)
        return ToothSections(x, h, h, (half * weight).ravel())


def beam_compliance(
    sections: ToothSections, load: FlankForce, material: ToothMaterial, width: float
) -> BeamCompliance:
    """Compliance of a tooth as a beam that is fixed at its root.

    Parameters
    ----------
    sections : ToothSections
        Sections between the root and the loaded point, shape (..., q).
    load : FlankForce
        Lines of action, shape (...).
    material : ToothMaterial
        Young's modulus [Pa] and Poisson's ratio.
    width : float
        Face width [m].

    Returns
    -------
    BeamCompliance
        Bending, shear and axial part, shape (...) [m/N].

    Notes
    -----
    With the thickness t = loaded + back side, A = t w and I = t^3 w / 12 they are the
    integrals of (d - x cos beta)^2 / (E I), 1.2 cos^2 beta / (G A) and
    sin^2 beta / (E A) over x.
    """
    x, loaded, back, dx = sections
    d, beta = (np.asarray(part, float)[..., None] for part in load)
    thickness = loaded + back
    area, inertia = thickness * width, thickness**3 * width / 12.0
    E, G, cos = material.young_modulus, material.shear_modulus, np.cos(beta)
    return BeamCompliance(
        bending=np.sum((d - x * cos) ** 2 / (E * inertia) * dx, axis=-1),
        shear=np.sum(SHEAR_CORRECTION * cos**2 / (G * area) * dx, axis=-1),
        axial=np.sum(np.sin(beta) ** 2 / (E * area) * dx, axis=-1),
    )


def body_factors(radius_ratio: float, root_half_angle: float) -> Array:
    """Factors L*, M*, P*, Q* of the body of a gear.

    Parameters
    ----------
    radius_ratio : float
        h, root radius over hub radius; fitted over 1.4 to 7.
    root_half_angle : float
        theta_f, half the angle of the tooth at the root circle [rad]; fitted over 0.01
        to 0.12.

    Returns
    -------
    (4,) array
        Factors without unit.

    Notes
    -----
    Eq. (7) of Sainsot et al. (2004).
    """
    h, theta = radius_ratio, root_half_angle
    terms = np.array([1.0 / theta**2, h**2, h / theta, 1.0 / theta, h, 1.0])
    return np.asarray(BODY_COEFFICIENTS @ terms)


@dataclass(frozen=True, kw_only=True)
class ToothFoundation:
    """Body of a gear on a rigid hub, as far as one tooth deflects it.

    Attributes
    ----------
    root_radius, hub_radius : float
        Radii of the ring [m].
    root_half_angle : float
        Half the angle of the tooth at the root circle [rad].
    young_modulus : float
        Young's modulus [Pa].
    """

    root_radius: float
    hub_radius: float
    root_half_angle: float
    young_modulus: float

    def compliance(self, height: ArrayLike, angle: ArrayLike, width: float) -> Array:
        """Compliance of the body along the line of action.

        Parameters
        ----------
        height : array_like
            Distance from the axis at which the line of action crosses the centre line
            of the tooth [m]: d / cos beta.
        angle : array_like
            beta, between the line of action and the y axis [rad].
        width : float
            Face width w [m].

        Returns
        -------
        array
            Compliance, of the shape of `height` [m/N].

        Notes
        -----
        Eq. (6) of Sainsot et al. (2004): cos^2 beta / (E w) times
        (L u^2 + M u + P (1 + Q tan^2 beta)), u the height above the root circle over
        the arc 2 theta_f r_f of the root. A plane body whose root carries linear
        normal and constant shear stress; it turns and deflects its one tooth alone.
        """
        rf, theta = self.root_radius, self.root_half_angle
        L, M, P, Q = body_factors(rf / self.hub_radius, theta)
        beta = np.asarray(angle, float)
        u = (np.asarray(height, float) - rf) / (2.0 * theta * rf)
        shape = L * u**2 + M * u + P * (1.0 + Q * np.tan(beta) ** 2)
        return np.asarray(np.cos(beta) ** 2 * shape / (self.young_modulus * width))


def contact_compliance(
    first: ToothMaterial, second: ToothMaterial, width: float
) -> float:
    """Compliance of a line contact that does not depend on load.

    Parameters
    ----------
    first, second : ToothMaterial
        Materials of both teeth.
    width : float
        Length L of the line of contact [m].

    Returns
    -------
    float
        Sum over both of 2 (1 - nu^2) / (pi E L) [m/N]; of two equal teeth
        1 / k_h = 4 (1 - nu^2) / (pi E L).

    Notes
    -----
    Yang and Sun (1985), eq. (7). A line contact has no linear stiffness: its approach
    grows with the logarithm of load and of depth, so that this constant is rough.
    """
    parts = (2.0 * (1.0 - nu**2) / (math.pi * E * width) for E, nu in (first, second))
    return math.fsum(parts)


def mesh_stiffness(compliances: ArrayLike) -> Array:
    """Stiffness of all pairs in contact, each a spring in series.

    Parameters
    ----------
    compliances : (..., k) array_like
        Compliance of each pair [m/N]; infinite for a pair without contact.

    Returns
    -------
    (...) array
        Sum of the stiffnesses [N/m].
    """
    return np.asarray(np.sum(1.0 / np.asarray(compliances, float), axis=-1))
