"""Description of a ball or roller bearing with a contact angle of zero."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import ClassVar

from lumped.bearings.hertz import (
    LINE_EXPONENT,
    POINT_EXPONENT,
    EllipticContact,
    effective_modulus,
    elliptic_contact,
    in_series,
    line_coefficient,
    line_pressure,
)
from lumped.common.checks import format_number, require_between, require_fields

MIN_ELEMENTS, MAX_ELEMENTS = 3, 1000
STEEL_MODULUS, STEEL_POISSON = 207e9, 0.3  # of bearing steel, of Harris's constants
CONFORMITY = 0.52  # of race grooves where none is stated
MAX_LENGTH = 1e2  # m, beyond all bearings
MAX_DEVIATION = 1e-2  # m, of clearances, waves and films


@dataclass(frozen=True, kw_only=True)
class Waviness:
    """A wave around a race, eq. 6.7 of the multi-mesh source.

    Parameters
    ----------
    order : int
        Number of waves per circumference, 1 or more.
    amplitude : float
        Excess of material at a crest [m].
    phase : float, optional
        Phase of the cosine [rad].
    inner : bool, optional
        Whether it is on the inner race, with which it rotates.

    Raises
    ------
    ValueError
        If a value is not of its type or not allowed.
    """

    order: int
    amplitude: float
    phase: float = 0.0
    inner: bool = False

    def __post_init__(self) -> None:
        require_fields(self)
        require_between("order", self.order, 1, 10_000)
        require_between("amplitude", self.amplitude, 0.0, MAX_DEVIATION)


@dataclass(frozen=True, kw_only=True)
class RollingBearing:
    """What ball and roller bearings have in common; outer race fixed, inner rotates.

    Elements have no mass: each is in equilibrium between both races.
    """

    exponent: ClassVar[float]
    noun: ClassVar[str]
    max_pressure: ClassVar[float]

    element_diameter: float
    pitch_diameter: float
    clearance: float = 0.0
    contact_stiffness: float | None = None
    young_modulus: float = STEEL_MODULUS
    poisson_ratio: float = STEEL_POISSON
    film_thickness: float = 0.0
    runout: float = 0.0
    waves: tuple[Waviness, ...] = field(default=())

    def __post_init__(self) -> None:
        require_fields(self)
        name = f"{self.noun}s"
        require_between(name, self.elements, MIN_ELEMENTS, MAX_ELEMENTS)
        require_between("pitch_diameter", self.pitch_diameter, 0, MAX_LENGTH, True)
        low, high = 0.0, self.pitch_diameter
        diameter = f"{self.noun}_diameter"
        require_between(diameter, self.element_diameter, low, high, True, True)
        room = self.pitch_diameter * math.sin(math.pi / self.elements)
        if self.element_diameter > room:
            raise ValueError(
                f"{diameter} = {format_number(self.element_diameter)}; must be at "
                f"most {format_number(room)} m "
                f"for {self.elements} {name} on a pitch_diameter of "
                f"{self.pitch_diameter:g} m"
            )
        require_between("clearance", self.clearance, -MAX_DEVIATION, MAX_DEVIATION)
        require_between("film_thickness", self.film_thickness, 0, MAX_DEVIATION)
        require_between("runout", self.runout, 0, MAX_DEVIATION)
        if self.contact_stiffness is not None:
            require_between("contact_stiffness", self.contact_stiffness, 1.0, 1e20)
        require_between("young_modulus", self.young_modulus, 1e6, 1e14)
        require_between("poisson_ratio", self.poisson_ratio, 0.0, 0.5)

    @property
    def elements(self) -> int:
        """Number of rolling elements."""
        raise NotImplementedError

    @property
    def diameter_ratio(self) -> float:
        """Diameter of an element over the pitch diameter."""
        return self.element_diameter / self.pitch_diameter

    @property
    def race_diameters(self) -> tuple[float, float]:
        """Diameters of the inner and the outer race where elements touch [m]."""
        inner = self.pitch_diameter - self.element_diameter
        return inner, self.pitch_diameter + self.element_diameter

    @property
    def free_gap(self) -> float:
        """Approach of centred rings at which an element is loaded [m]; a film on both
        races makes it less."""
        return 0.5 * self.clearance - 2.0 * self.film_thickness

    @cached_property
    def coefficient(self) -> float:
        """Load over approach^n [N/m^n] of an element between both races."""
        if self.contact_stiffness is not None:
            return self.contact_stiffness
        return in_series(*self.race_coefficients, self.exponent)

    @property
    def race_coefficients(self) -> tuple[float, float]:
        """Load over approach^n [N/m^n] of an element on the inner and the outer race,
        from geometry and material."""
        raise NotImplementedError

    def pressures(self, load: float) -> tuple[float, float]:
        """Largest contact pressures of an element on both races.

        Parameters
        ----------
        load : float
            Load of the element [N].

        Returns
        -------
        inner, outer : float
            Pressure on the inner and on the outer race [Pa].
        """
        raise NotImplementedError

    @property
    def _modulus(self) -> float:
        return effective_modulus(self.young_modulus, self.poisson_ratio)


@dataclass(frozen=True, kw_only=True)
class BallBearing(RollingBearing):
    """Ball bearing with a contact angle of zero.

    Parameters
    ----------
    element_diameter : float
        Diameter of a ball [m].
    pitch_diameter : float
        Diameter of the circle of the balls' centres [m].
    clearance : float, optional
        Radial internal clearance, by which the unloaded inner ring moves from one
        extreme to the other [m]; negative with preload.
    contact_stiffness : float, optional
        Load of a ball over its approach between both races to the power 3/2
        [N/m^1.5]; by default from geometry and material.
    young_modulus, poisson_ratio : float, optional
        Of balls and races [Pa].
    film_thickness : float, optional
        Thickness of the film of lubricant in each contact [m].
    runout : float, optional
        Eccentricity of the inner race on its shaft [m].
    waves : tuple of Waviness, optional
        Waviness of the races.
    balls : int
        Number of balls.
    inner_conformity, outer_conformity : float, optional
        Groove radius of each race over the ball's diameter.

    Raises
    ------
    ValueError
        If a value is not of its type or not allowed.
    """

    exponent: ClassVar[float] = POINT_EXPONENT
    max_pressure: ClassVar[float] = 4.2e9  # Pa, of the static load rating, ISO 76
    noun: ClassVar[str] = "ball"

    balls: int
    inner_conformity: float = CONFORMITY
    outer_conformity: float = CONFORMITY

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("inner_conformity", "outer_conformity"):
            require_between(name, getattr(self, name), 0.5, 1e6, above=True)

    @property
    def elements(self) -> int:
        return self.balls

    @property
    def contacts(self) -> tuple[EllipticContact, EllipticContact]:
        """Contacts of a ball with the inner and the outer race."""
        ball = 2.0 / self.element_diameter
        inner, outer = self.race_diameters
        grooves = self.inner_conformity, self.outer_conformity
        of_inner, of_outer = (
            elliptic_contact(rolling, ball - 1.0 / (groove * self.element_diameter))
            for rolling, groove in zip(
                (ball + 2.0 / inner, ball - 2.0 / outer), grooves, strict=True
            )
        )
        return of_inner, of_outer

    @property
    def race_coefficients(self) -> tuple[float, float]:
        of_inner, of_outer = self.contacts
        modulus = self._modulus
        return of_inner.coefficient(modulus), of_outer.coefficient(modulus)

    def pressures(self, load: float) -> tuple[float, float]:
        of_inner, of_outer = self.contacts
        modulus = self._modulus
        return of_inner.pressure(load, modulus), of_outer.pressure(load, modulus)


@dataclass(frozen=True, kw_only=True)
class RollerBearing(RollingBearing):
    """Cylindrical roller bearing.

    Parameters
    ----------
    element_diameter : float
        Diameter of a roller [m].
    pitch_diameter : float
        Diameter of the circle of the rollers' centres [m].
    clearance : float, optional
        Radial internal clearance, by which the unloaded inner ring moves from one
        extreme to the other [m]; negative with preload.
    contact_stiffness : float, optional
        Load of a roller over its approach between both races to the power 10/9
        [N/m^(10/9)]; by default from length and material.
    young_modulus, poisson_ratio : float, optional
        Of rollers and races [Pa].
    film_thickness : float, optional
        Thickness of the film of lubricant in each contact [m].
    runout : float, optional
        Eccentricity of the inner race on its shaft [m].
    waves : tuple of Waviness, optional
        Waviness of the races.
    rollers : int
        Number of rollers.
    length : float
        Effective length of a roller [m].

    Raises
    ------
    ValueError
        If a value is not of its type or not allowed.
    """

    exponent: ClassVar[float] = LINE_EXPONENT
    max_pressure: ClassVar[float] = 4.0e9  # Pa, of the static load rating, ISO 76
    noun: ClassVar[str] = "roller"

    rollers: int
    length: float

    def __post_init__(self) -> None:
        super().__post_init__()
        require_between("length", self.length, 0, MAX_LENGTH, above=True)

    @property
    def elements(self) -> int:
        return self.rollers

    @property
    def race_coefficients(self) -> tuple[float, float]:
        one = line_coefficient(self.length, self._modulus)
        return one, one

    def pressures(self, load: float) -> tuple[float, float]:
        roller = 2.0 / self.element_diameter
        inner, outer = self.race_diameters
        of_inner, of_outer = (
            line_pressure(load, self.length, curvature, self._modulus)
            for curvature in (roller + 2.0 / inner, roller - 2.0 / outer)
        )
        return of_inner, of_outer
