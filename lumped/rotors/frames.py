"""A rotor seen from the frame that turns with it: where eq. 6.10 has its matrix K~.

With x = R(Omega t) u, a rotation of every node, the velocity is R (u' + Omega J u) with
the quarter turn J. M, G and all that is the same in every direction commute with J:

    M u'' + (C + Omega (G + 2 M J)) u' + (K + Omega H' - Omega^2 N) u = 0,
    N = -M J^2 - G J

N holds the mass for translations and I_t - I_p for tilts. It comes from the frame and
not from the rotor: natural frequencies are those of the fixed frame plus or minus
Omega, and K - Omega^2 N is singular at the critical speeds of forward whirl.
"""

from __future__ import annotations

from dataclasses import replace

from lumped.rotors.bearing_matrices import is_isotropic
from lumped.rotors.description import RotorError, RotorSystem
from lumped.rotors.gyroscopic import GyroscopicSystem
from lumped.rotors.matrices import assemble_any


def rotating_frame(system: RotorSystem) -> GyroscopicSystem:
    """Matrices of one rotor in the frame that turns with it.

    Its sections may be asymmetric; its bearings must be the same in all directions.
    The speed of the matrices is that of the rotor. Raises RotorError for others.
    """
    if len(system.rotors) != 1 or system.meshes:
        raise RotorError(
            f"{len(system.rotors)} rotors and {len(system.meshes)} meshes; a frame "
            "turns with one rotor"
        )
    if system.housing is not None:
        raise RotorError("a housing does not turn; bearings must be on ground")
    (rotor,) = system.rotors
    for bearing in rotor.bearings:
        if not is_isotropic(bearing):
            raise RotorError(
                f"rotor {rotor.name!r}: the bearing at {bearing.position:g} m differs "
                "in x and y; its stiffness varies in a frame that turns"
            )
    fixed = assemble_any(replace(system, rotors=(replace(rotor, speed_ratio=1.0),)))
    turn, material = fixed.quarter_turn, rotor.internal_damping
    # damping of the material is by strain rates, which the frame sees without Omega
    of_material = material * fixed.shaft_stiffness
    return replace(
        fixed,
        gyroscopic=fixed.gyroscopic + 2.0 * fixed.mass @ turn,
        circulatory=(fixed.damping - of_material) @ turn,
        centripetal=-fixed.mass @ turn @ turn - fixed.gyroscopic @ turn,
    )
