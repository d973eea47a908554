"""Drop of mesh stiffness over the depth of a root crack, by formulas and by others.

The first gear's reference tooth has the crack. Its mesh has the stiffness of all pairs
in contact, which the pair of the cracked tooth shares with healthy ones: it is compared
where that pair touches at the pitch point, and as a mean over that pair's path.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import get_args

import numpy as np

from lumped.closed_forms.tooth_crack import CrackModel, RootCrack
from lumped.closed_forms.tooth_energy import mesh_stiffness
from lumped.common.array_types import Array
from validation.cracked_tooth.healthy import HealthyPair
from validation.oracles.cut_tooth import CutTooth, tangent_point
from validation.oracles.potential_energy import touching_pairs

POSITIONS = 64  # of the path of the cracked tooth
TANGENT_ANGLE = math.radians(30.0)  # of the fillet where the crack begins
CRACK_ANGLE = math.radians(60.0)  # to the centre line: along the normal there


@dataclass(frozen=True)
class StiffnessDrop:
    """Drop of mesh stiffness, 0 to 1, of the stiffness without crack.

    at_pitch_point : where the cracked tooth touches at the pitch point
    over_path : mean over the path of contact of the cracked tooth
    added_compliance : of the cracked tooth, loaded at the pitch point [m/N]
    """

    at_pitch_point: float
    over_path: float
    added_compliance: float


def stiffness_drop(healthy: Array, cracked: Array, added: float) -> StiffnessDrop:
    """Drop from mesh stiffnesses at `path_positions`, (1 + n,) [N/m].

    added : compliance of the cracked tooth at the pitch point [m/N]
    """
    mean = 1.0 - cracked[1:].mean() / healthy[1:].mean()
    return StiffnessDrop(float(1.0 - cracked[0] / healthy[0]), float(mean), added)


def path_positions(pair: HealthyPair) -> Array:
    """The pitch point, then positions along the path of one pair, (1 + n,).

    Base pitches of the pair from the pitch point, in the middle of equal steps.
    """
    start, end = pair.pair.path
    steps = (np.arange(POSITIONS) + 0.5) / POSITIONS
    return np.concatenate([[0.0], start + steps * (end - start)])


@dataclass(frozen=True)
class EnergyDrop:
    """Drop of mesh stiffness by potential energy, its contact that of Yang and Sun.

    tangent_angle : between the centre line and the fillet where the crack begins [rad]
    crack_angle : between the crack and the centre line [rad]
    """

    pair: HealthyPair
    model: CrackModel
    tangent_angle: float = TANGENT_ANGLE
    crack_angle: float = CRACK_ANGLE

    def __call__(self, depth: float) -> StiffnessDrop:
        """Drop at a depth of the crack [m]."""
        crack, tooth = self.crack(depth), self.pair.teeth[0]
        at_pitch_point = self.pair.pair.pitch_point, self.pair.width
        added = CutTooth(tooth.gear, crack).compliance(*at_pitch_point)
        added -= tooth.compliance(*at_pitch_point)
        stiffness = self.mesh_stiffness(crack)
        return stiffness_drop(self._healthy, stiffness, float(added[0]))

    def crack(self, depth: float) -> RootCrack:
        start, _ = tangent_point(self.pair.teeth[0].teeth, self.tangent_angle)
        return RootCrack(
            start=start, depth=depth, angle=self.crack_angle, model=self.model
        )

    @cached_property
    def _healthy(self) -> Array:
        return self.mesh_stiffness(None)

    def mesh_stiffness(self, crack: RootCrack | None) -> Array:
        """Stiffness of all pairs at `path_positions`, (1 + n,) [N/m]."""
        driver, driven = self.pair.teeth
        angle = self.pair.pair.operating_pressure_angle
        positions = path_positions(self.pair)
        rolls, active = touching_pairs(driver, driven, angle, positions)
        compliances = np.full(rolls.shape, np.inf)
        cracked_roll = self.pair.pair.pitch_point + positions * driver.base_pitch
        cracked = np.isclose(rolls, cracked_roll[:, None], rtol=1e-9)
        compliances[active] = self._compliance(driver, rolls[active])
        compliances[cracked] = self._compliance(
            CutTooth(driver.gear, crack), rolls[cracked]
        )
        return mesh_stiffness(compliances)

    def _compliance(self, driver: CutTooth, rolls: Array) -> Array:
        """Compliances of pairs that touch at roll lengths (n,) of the driver [m/N]."""
        driven, width = self.pair.teeth[1], self.pair.width
        others = self.pair.pair.line_of_action - rolls
        teeth = driver.compliance(rolls, width) + driven.compliance(others, width)
        return self.pair.contact_compliance + teeth


def root_thickness(pair: HealthyPair) -> float:
    """Thickness of the driver's tooth where the crack begins [m]."""
    return 2.0 * tangent_point(pair.teeth[0].teeth, TANGENT_ANGLE)[1]


DropOf = Callable[[float], StiffnessDrop]


@dataclass(frozen=True)
class DropCurves:
    """Drops over depths (n,), over the root thickness, by each method."""

    depths: Array
    drops: dict[str, list[StiffnessDrop]]


def compare_drops(
    pair: HealthyPair,
    depths: Iterable[float],
    fe_drop: DropOf | None = None,
    crack_angle: float = CRACK_ANGLE,
) -> DropCurves:
    """Drops by all formulas, and by finite elements if their function is at hand.

    depths : over the root thickness, 0 to about a half
    fe_drop : drop of mesh stiffness at a depth [m]
    crack_angle : between the crack and the centre line, of the formulas [rad]
    """
    methods: dict[str, DropOf] = {
        model: EnergyDrop(pair, model, crack_angle=crack_angle)
        for model in get_args(CrackModel)
    }
    if fe_drop is not None:
        methods["finite elements"] = fe_drop
    relative = np.array(list(depths), float)
    thickness = root_thickness(pair)
    drops = {
        name: [drop(float(depth) * thickness) for depth in relative]
        for name, drop in methods.items()
    }
    return DropCurves(relative, drops)
