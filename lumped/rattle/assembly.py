"""Machine made of parts: shafts, gears on springs, a pendulum absorber.

Inertia, drag and stiffness are scaled by the inertia I and the speed of an equal shaft,
in turns per second, as in `Machine`; lengths are scaled by the pitch radius r.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterator
from dataclasses import dataclass, field, fields, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from lumped.common.array_types import Array
from lumped.common.checks import format_number
from lumped.rattle.machine import TURN, Machine

Side = Literal["driving", "driven"]


def _require(part: Any, *allowed: tuple[str, str, bool]) -> None:
    for name, text, good in allowed:
        if not good:
            raise ValueError(
                f"{name} = {format_number(getattr(part, name))}; must be {text}"
            )


def _require_positive(part: Any, *names: str) -> None:
    _require(
        part,
        *((n, "above 0 and finite", 0.0 < getattr(part, n) < math.inf) for n in names),
    )


def _require_not_negative(part: Any, *names: str) -> None:
    _require(
        part,
        *((n, "0 or more", 0.0 <= getattr(part, n) < math.inf) for n in names),
    )


@dataclass(frozen=True, kw_only=True)
class Shafts:
    """Inertias over I and drags over those of equal shafts.

    They are 1 + eta and 1 - eta in eq. 4.3. Mass added to one shaft, eq. 4.27, makes
    one of them 1 + 2 mu; mass added to both, eq. 4.49, makes both 1 + nu.
    """

    driving_inertia: float = 1.0
    driven_inertia: float = 1.0
    driving_drag: float = 1.0
    driven_drag: float = 1.0

    def __post_init__(self) -> None:
        _require_positive(self, *(entry.name for entry in fields(self)))


@dataclass(frozen=True, kw_only=True)
class SprungGear:
    """Gear on a torsional spring on its shaft, eqs. 4.105-4.111 and appendix A.

    motor_on_gear : whether the torque acts on the gear, not on the shaft behind it
    """

    stiffness: float
    inertia: float = 0.0
    damping: float = 0.0
    motor_on_gear: bool = False

    def __post_init__(self) -> None:
        _require_positive(self, "stiffness")
        _require_not_negative(self, "inertia", "damping")


@dataclass(frozen=True, kw_only=True)
class Absorber:
    """Centrifugal pendulum on a gear, a point on a circular path; section 5.2.

    mass : mass over I / r^2
    damping : damping force along the path per angle, over I times speed over r
    pivot_radius, path_radius : r1 from the gear's centre to that of the path, and r2
    gear_eccentricity, offset_angle : eccentricity E of the gear over r [rad], and the
        angle from it to the neutral position [rad]
    """

    mass: float
    pivot_radius: float
    path_radius: float
    damping: float = 0.0
    gear_eccentricity: float = 0.0
    offset_angle: float = 0.0
    gear: Side = "driving"

    def __post_init__(self) -> None:
        _require_positive(self, "mass", "pivot_radius", "path_radius")
        _require_not_negative(self, "damping", "gear_eccentricity")
        _require(self, ("offset_angle", "finite", math.isfinite(self.offset_angle)))
        if self.reach == 0.0:
            raise ValueError("the path's centre must be off the axis of rotation")

    @property
    def reach(self) -> float:
        """Distance from the axis of rotation to the centre of the path, over r.

        Both rotate with the gear, so that an eccentric gear acts like a concentric one
        with this pivot radius, whose pendulum rests at another angle.
        """
        arm = cmath.rect(self.pivot_radius, self.offset_angle)
        return abs(arm + self.gear_eccentricity)


@dataclass(frozen=True)
class Linear:
    """M q'' + C q' + K q = mean + ripple e^(i n w t) - row N, flanks pressed together.

    row q + e(t) = half backlash + compliance N, where N is the tooth load and e(t) the
    transmission error; `compliance` is that of the flanks, 0 in impacts. Mean loads are
    those in addition to steady rotation. The arrays have shapes (n, n) and (n,).
    """

    mass: Array
    damping: Array
    stiffness: Array
    row: Array
    mean: Array
    ripple: NDArray[np.complex128]
    compliance: float
    names: tuple[str, ...]

    def respond(
        self, rate: float, force: NDArray[Any], error: complex = 0.0
    ) -> NDArray[np.complex128]:
        """Amplitudes (n + 1,) of q and N under a force and an error e^(i rate t)."""
        n = self.row.size
        matrix = np.zeros((n + 1, n + 1), complex)
        matrix[:n, :n] = self.stiffness - rate**2 * self.mass
        matrix[:n, :n] += 1j * rate * self.damping
        matrix[:n, n] = matrix[n, :n] = self.row
        matrix[n, n] = -self.compliance
        load = np.append(force, -error).astype(complex)
        if rate == 0.0:
            # all parts may rotate together without load: fix the driving shaft
            matrix[0], load[0] = np.eye(n + 1)[0], 0.0
        return np.linalg.solve(matrix, load)


@dataclass(frozen=True, kw_only=True)
class Assembly:
    """Machine and the parts that replace two equal stiff shafts."""

    machine: Machine
    shafts: Shafts = field(default_factory=Shafts)
    driving_gear: SprungGear | None = None
    driven_gear: SprungGear | None = None
    absorber: Absorber | None = None

    def __post_init__(self) -> None:
        if self.driven_gear is not None and self.driven_gear.motor_on_gear:
            raise ValueError("driven_gear.motor_on_gear = true; must be false")
        if self.machine.drive != 1.0:
            raise ValueError(f"drive = {format_number(self.machine.drive)}; must be 1")

    @property
    def beside_shafts(self) -> Iterator[tuple[str, Any]]:
        """Parts other than the shafts, by name."""
        for entry in fields(self)[2:]:
            part = getattr(self, entry.name)
            if part is not None:
                yield entry.name, part

    @property
    def mean_load(self) -> float:
        """Mean load of the teeth, which balances the drag of the driven shaft."""
        return TURN * self.machine.damping * self.shafts.driven_drag

    @property
    def more_equations(self) -> str:
        """Reason why relative motion has more than one equation, empty if it has one.

        It has one for stiff shafts whose drags are in the ratio of their inertias,
        since both then decelerate at the same rate in the play.
        """
        for name, _ in self.beside_shafts:
            return f"[{name}] adds a motion of its own"
        shafts = self.shafts
        x, y = shafts.driving_inertia, shafts.driven_inertia
        one, two = shafts.driving_drag, shafts.driven_drag
        if math.isclose(one / x, two / y, rel_tol=1e-9):
            return ""
        return (
            f"[shafts] drags {one:g} and {two:g} are not in the ratio of the inertias "
            f"{x:g} and {y:g}"
        )

    def as_machine(self) -> Machine:
        """Single equation of relative motion; ValueError if there are more."""
        if self.more_equations:
            raise ValueError(self.more_equations)
        x, y = self.shafts.driving_inertia, self.shafts.driven_inertia
        stiffness = self.machine.stiffness * 0.5 * (1.0 / x + 1.0 / y)
        return replace(self.shafts_in_impacts, stiffness=stiffness)

    @property
    def shafts_in_impacts(self) -> Machine:
        """Shafts without other parts in the impact limit, as if both decelerated at the
        mean of their rates, under the mean load of the teeth."""
        shafts, machine = self.shafts, self.machine
        x, y = shafts.driving_inertia, shafts.driven_inertia
        rate = 0.5 * (shafts.driving_drag / x + shafts.driven_drag / y)
        return replace(
            machine,
            damping=machine.damping * rate,
            stiffness=math.inf,
            drive=0.5 * shafts.driven_drag * (1.0 / x + 1.0 / y) / rate,
            ripple=machine.ripple / x,
        )

    def linear(self) -> Linear:
        """Linear equations of the parts in permanent contact."""
        return _Builder(self).linear()


class _Builder:
    """Builder of the rows and columns of an assembly's matrices."""

    def __init__(self, assembly: Assembly) -> None:
        self.assembly = assembly
        gears = assembly.driving_gear, assembly.driven_gear
        names = ["driving shaft", "driven shaft"]
        names += [
            f"{side} gear"
            for side, gear in zip(("driving", "driven"), gears, strict=True)
            if gear is not None
        ]
        names += ["absorber"] * (assembly.absorber is not None)
        self.names = tuple(names)
        size = len(names)
        self.mass, self.damping, self.stiffness = np.zeros((3, size, size))

    def gear(self, side: str) -> int:
        """Index of a gear, or of the shaft to which it is rigidly attached."""
        gear_name = f"{side} gear"
        return self.names.index(
            gear_name if gear_name in self.names else f"{side} shaft"
        )

    def linear(self) -> Linear:
        assembly, machine = self.assembly, self.assembly.machine
        drags = assembly.shafts.driving_drag, assembly.shafts.driven_drag
        inertias = assembly.shafts.driving_inertia, assembly.shafts.driven_inertia
        for i in range(2):
            self.mass[i, i] = inertias[i]
            self.damping[i, i] = machine.damping * drags[i]
        self.add_spring("driving", assembly.driving_gear)
        self.add_spring("driven", assembly.driven_gear)
        if assembly.absorber is not None:
            self.add_absorber(assembly.absorber)
        size = len(self.names)
        row, motor = np.zeros(size), np.zeros(size)
        row[self.gear("driving")], row[self.gear("driven")] = 1.0, -1.0
        driving_gear = assembly.driving_gear
        on_gear = driving_gear is not None and driving_gear.motor_on_gear
        motor[self.gear("driving") if on_gear else 0] = 1
        mean = motor * TURN * machine.damping * sum(drags)
        mean[:2] -= TURN * machine.damping * np.array(drags)
        return Linear(
            *(self.mass, self.damping, self.stiffness, row, mean),
            ripple=np.asarray(motor * machine.loads[1], np.complex128),
            compliance=1.0 / machine.stiffness,
            names=self.names,
        )

    def add_spring(self, side: str, gear: SprungGear | None) -> None:
        if gear is None:
            return
        index = self.gear(side)
        ends = np.zeros(len(self.names))
        ends[index], ends[self.names.index(f"{side} shaft")] = 1.0, -1.0
        self.mass[index, index] += gear.inertia
        self.damping += gear.damping * np.outer(ends, ends)
        self.stiffness += gear.stiffness * np.outer(ends, ends)

    def add_absorber(self, absorber: Absorber) -> None:
        """Add eqs. 5.45-5.49, with the gear's row before the absorber's is subtracted.

        The second row is that of the source times r2.
        """
        indices = [self.gear(absorber.gear), len(self.names) - 1]
        m, r1, r2 = absorber.mass, absorber.reach, absorber.path_radius
        arms = np.array([r1 + r2, r2])
        self.mass[np.ix_(indices, indices)] += m * np.outer(arms, arms)
        self.damping[indices[1], indices[1]] += absorber.damping * r2
        self.stiffness[indices[1], indices[1]] += m * r1 * r2 * TURN**2
