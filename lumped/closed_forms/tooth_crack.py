"""A root crack in the potential-energy method: sections that carry load, or a hinge.

A straight crack starts at a place of the loaded flank or its fillet, where the tooth is
pulled. Material above it carries little: the formulas of the literature leave out what
is on the loaded side of a limit line from the crack tip (x_c, y_c) outwards, and differ
in that line:

    parallel   y = y_c, parallel to the centre line: Wu, Zuo and Parey (2008), Chen and
               Shao (2011)
    parabola   to the corner (x_a, y_a) of the tooth's tip: Mohammed, Rantatalo and
               Aidanpaa (2013)

A section reaches to the line, or to the flank if that is nearer. Bending and shear
follow from its smaller thickness; its neutral axis stays on the centre line. Thrust,
contact and body are those of the healthy tooth: thrust closes the crack, and the body
formula has no crack.

Two points do not determine a parabola. Here its axis is parallel to the centre line,
and it bulges towards the loaded flank: with t = (x - x_c) / (x_a - x_c)

    y = y_c + (y_a - y_c) sqrt(t)       y_c <= y_a, vertex at the crack tip
    y = y_a + (y_c - y_a) sqrt(1 - t)   y_c >= y_a, vertex at the corner

which are equal where they meet. Above a deep crack it leaves out less than the parallel
line, which takes material up to the tip of the tooth.

A third model does without limit lines. By fracture mechanics an edge crack of depth a
across a strip of thickness b lets its two parts turn by 24 M S(a/b) / (E w b^2) under a
moment M, which follows from its stress intensity. `hinge` adds this to the bending of
the healthy tooth, where the crack begins, whatever its angle.

Wu, Zuo and Parey, J. Sound Vib. 317 (2008) 890; Chen and Shao, Eng. Fail. Anal. 18
(2011) 2149; Mohammed, Rantatalo and Aidanpaa, Eng. Fail. Anal. 34 (2013) 235. The
integrals are derived here from these limit lines, not copied from the prints.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from lumped.closed_forms.tooth_energy import (
    BeamCompliance,
    FlankForce,
    ToothMaterial,
    ToothOutline,
    ToothSections,
    beam_compliance,
)
from lumped.common.array_types import Array
from lumped.common.checks import format_number

CrackModel = Literal["parallel", "parabola", "hinge"]
BENDING_FIT = 1.122, -1.4, 7.33, -13.08, 14.0  # powers of a/b, of F
MAX_HINGE_PART = 0.6  # of the thickness, to which they are fitted


@dataclass(frozen=True, kw_only=True)
class RootCrack:
    """A straight crack through the face width, from the loaded flank inwards.

    Attributes
    ----------
    start : float
        Position x of its mouth [m].
    depth : float
        Length of the crack [m], 0 for none.
    angle : float
        Angle between the crack and the centre line [rad], above 0 and at most pi/2,
        which is square to it; smaller ones lead to the body.
    model : {"parallel", "parabola", "hinge"}
        Limit line beyond which the tooth carries no load, or a hinge.
    """

    start: float
    depth: float
    angle: float = 0.5 * math.pi
    model: CrackModel = "parallel"

    def __post_init__(self) -> None:
        if not 0.0 <= self.depth < math.inf:
            raise ValueError(f"depth = {format_number(self.depth)}; must be 0 or more")
        if not 0.0 < self.angle <= 0.5 * math.pi:
            raise ValueError(
                f"angle = {format_number(self.angle)}; must be above 0 and at most pi/2"
            )
        if self.model not in get_args(CrackModel):
            allowed = ", ".join(get_args(CrackModel))
            raise ValueError(f"model = {self.model!r}; must be one of {allowed}")

    def tip(self, outline: ToothOutline) -> tuple[float, float]:
        """Crack tip (x_c, y_c) [m]; ValueError if the mouth is not on the tooth."""
        low, high = outline.position[0], outline.position[-1]
        if not low <= self.start < high:
            raise ValueError(
                f"start = {format_number(self.start)}; must be {format_number(low)} m "
                "or more and below "
                f"{format_number(high)} m"
            )
        mouth = float(outline.thickness_at(self.start))
        return (
            self.start - self.depth * math.cos(self.angle),
            mouth - self.depth * math.sin(self.angle),
        )

    def limit_line(self, outline: ToothOutline, position: Array) -> Array:
        """Distance y from the centre line up to which sections carry load.

        Parameters
        ----------
        outline : ToothOutline
            Healthy tooth.
        position : (n,) array
            Positions x [m].

        Returns
        -------
        (n,) array
            y [m], infinite below the crack tip.

        Raises
        ------
        ValueError
            If the model is a hinge.
        """
        if self.model == "hinge":
            raise ValueError("model = 'hinge'; must be a limit line")
        x_c, y_c = self.tip(outline)
        if self.model == "parallel":
            line = np.full(position.shape, y_c)
        else:
            x_a, y_a = outline.position[-1], outline.half_thickness[-1]
            t = np.clip((position - x_c) / (x_a - x_c), 0.0, 1.0)
            rise = np.sqrt(t) if y_c <= y_a else 1.0 - np.sqrt(1.0 - t)
            line = y_c + (y_a - y_c) * rise
        return np.where(position >= x_c, line, np.inf)


def cracked_sections(
    outline: ToothOutline, end: float, crack: RootCrack
) -> ToothSections:
    """Sections of a cracked tooth between its root and the loaded point.

    Parameters
    ----------
    outline : ToothOutline
        Healthy tooth.
    end : float
        Position x of the loaded point [m].
    crack : RootCrack
        Crack; of depth 0 the sections are those of the healthy tooth.

    Returns
    -------
    ToothSections
        Sections with what the limit line leaves of the loaded side.

    Raises
    ------
    ValueError
        If the crack does not begin on the tooth, or leaves a section without thickness.
    """
    if crack.depth == 0.0:
        return outline.sections(end)
    healthy = outline.sections(end, breaks=[crack.tip(outline)[0]])
    line = crack.limit_line(outline, healthy.position)
    loaded_side = np.minimum(healthy.loaded_side, line)
    if not (loaded_side + healthy.back_side > 0.0).all():
        raise ValueError(
            f"depth = {crack.depth:.6g} m; must leave some thickness below the load "
            f"with a limit line {crack.model!r}"
        )
    return healthy._replace(loaded_side=loaded_side)


def cracked_compliance(
    outline: ToothOutline,
    end: float,
    load: FlankForce,
    crack: RootCrack,
    material: ToothMaterial,
    width: float,
) -> BeamCompliance:
    """Compliance of a cracked tooth as a beam.

    Parameters
    ----------
    outline : ToothOutline
        Healthy tooth.
    end : float
        Position x of the loaded point [m].
    load : FlankForce
        Line of action, scalars.
    crack : RootCrack
        Crack; of depth 0 the compliance is that of the healthy tooth to the last bit.
    material : ToothMaterial
        Young's modulus [Pa] and Poisson's ratio.
    width : float
        Face width [m].

    Returns
    -------
    BeamCompliance
        Thrust of the healthy sections, bending and shear of the reduced ones or, with
        a hinge, bending with it and shear of the healthy ones [m/N].
    """
    healthy = beam_compliance(outline.sections(end), load, material, width)
    if crack.model == "hinge":
        added = hinge_compliance(outline, load, crack, material, width)
        return healthy._replace(bending=healthy.bending + added)
    sections = cracked_sections(outline, end, crack)
    reduced = beam_compliance(sections, load, material, width)
    return reduced._replace(axial=healthy.axial)


def hinge_compliance(
    outline: ToothOutline,
    load: FlankForce,
    crack: RootCrack,
    material: ToothMaterial,
    width: float,
) -> float:
    """Compliance along the line of action that a crack adds as a hinge.

    Parameters
    ----------
    outline : ToothOutline
        Healthy tooth.
    load : FlankForce
        Line of action, scalars.
    crack : RootCrack
        Crack, taken to be square to the centre line.
    material : ToothMaterial
        Young's modulus [Pa] and Poisson's ratio.
    width : float
        Face width [m].

    Returns
    -------
    float
        Square of the moment arm times the compliance of the hinge [m/N].

    Notes
    -----
    Plane stress; without the thrust and the shear of the section.
    """
    thickness = 2.0 * float(outline.thickness_at(crack.start))
    part = crack.depth / thickness
    turning = (
        24.0 * hinge_factor(part) / (material.young_modulus * width * thickness**2)
    )
    d, beta = (float(np.asarray(value)) for value in load)
    return turning * (d - crack.start * math.cos(beta)) ** 2


def hinge_factor(part: float) -> float:
    """S(a/b) of an edge crack in a strip under pure bending.

    Parameters
    ----------
    part : float
        Depth of the crack over the thickness of the strip, 0 to 0.6.

    Returns
    -------
    float
        S, without unit: both parts turn by 4 sigma S / E, where sigma = 6 M / (w b^2).

    Notes
    -----
    A crack releases K^2 / E per area, and K = sigma sqrt(pi a) F(a/b): so S is 3 pi
    times the integral of alpha F^2 over alpha from 0 to a/b. F is the polynomial of
    Brown and Srawley (1966), 0.2 % up to a/b = 0.6.
    """
    if not 0.0 <= part <= MAX_HINGE_PART:
        raise ValueError(
            f"depth = {format_number(part)}; must be 0 to {MAX_HINGE_PART:g} of the "
            "thickness"
        )
    F = np.polynomial.Polynomial(BENDING_FIT)
    alpha = np.polynomial.Polynomial((0.0, 1.0))
    return float(3.0 * math.pi * (alpha * F**2).integ()(part))
