"""Shafts of a gear set as beams on bearings, without what they carry."""

from __future__ import annotations

from fegear.gearset.model import GearSet, Shaft
from fegear.gearset.shaft_bodies import ShaftBody
from lumped.rotors.description import Bearing, Rotor, Section
from lumped.rotors.rolling_statics import RollingSupport


def rolling_supports(body: ShaftBody) -> tuple[RollingSupport, ...]:
    """Rolling bearings of a shaft, none where its bearings are linear."""
    return tuple(
        RollingSupport(position=position, mounted=mounted)
        for position, mounted in body.mounted_bearings
    )


def shaft_rotor(gear_set: GearSet, shaft: Shaft, body: ShaftBody) -> Rotor:
    """Sections and bearings of a shaft, without gears and disks.

    A bearing of unknown stiffness along the axis has none; rolling bearings are left
    out, see `rolling_supports`. Raises RotorError for a
    section that is too short.
    """
    sections = zip(body.lengths, body.diameters, body.bores, strict=True)
    return Rotor(
        name="+".join(gear_set.gears[gear].name for gear in shaft.gears),
        sections=tuple(
            Section(length=length, diameter=diameter, bore=bore)
            for length, diameter, bore in sections
        ),
        bearings=tuple(
            Bearing(
                position=bearing.position,
                stiffness=bearing.stiffness,
                axial_stiffness=bearing.axial_stiffness or 0.0,
                tilt_stiffness=bearing.tilt_stiffness,
                damping=(bearing.damping[0], 0.0, 0.0, bearing.damping[1]),
            )
            for bearing in body.bearings
            if bearing.mounted is None
        ),
        young_modulus=body.young_modulus,
        shear_modulus=0.5 * body.young_modulus / (1.0 + body.poisson_ratio),
        density=body.density,
    )
