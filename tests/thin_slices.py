"""Pairs of gears with one faulty tooth, whose teeth are thin slices on their helix.

A slice of a tooth pair is a spring between the ends of the path of contact, stiffest in
its middle. A fault takes away or moves some of the slices of one tooth. At rest slices
share the load by their gaps; the mesh is one spring with the stiffness and the gap of
the slices in contact. No code of fegear takes part.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from lumped import Gear, LumpedSystem, Mesh, Train
from lumped.signals.added_deflections import GearContacts
from lumped.signals.faulty_tooth import Engagement
from lumped.signals.sampling import TurningGear
from lumped.train.excitation import MeshExcitation, PairExcitation
from lumped.train.waves import Wave

KINDS = "crack", "wear", "pitch error", "broken tip", "spall", "missing"
SLICES, PIECES = 16, 48  # over the width, and of a base pitch
SLICE_STIFFNESS = 2.5e8 / SLICES  # N/m, of a tooth pair of a width
LOAD = 3000.0  # N


@dataclass(frozen=True, kw_only=True)
class FaultyPair:
    """Gears with a faulty tooth.

    start, end : of the path of contact, from the pitch point [base pitches]
    overlap : base pitches by which the helix leads over the width
    side : 0 where the driver has the fault, 1 the driven gear
    tooth : from 0, which is at the pitch point after as many base pitches
    kind : of `KINDS`
    size : from 0 to 1
    place : of the middle of a spall, from the pitch point [base pitches]
    """

    teeth: tuple[int, int]
    start: float
    end: float
    overlap: float
    side: int
    tooth: int
    kind: str
    size: float
    place: float = 0.0

    @property
    def contact_ratio(self) -> float:
        return self.end - self.start + self.overlap

    @property
    def engagement(self) -> Engagement:
        """Contact of the teeth of the faulty gear."""
        return self.contacts(self.side).by_mesh[0]

    def contacts(self, side: int) -> GearContacts:
        """Contact of the teeth of the driver (0) or the driven gear (1)."""
        teeth = self.teeth[side]
        gear = TurningGear(
            index=side,
            name="ab"[side],
            teeth=teeth,
            mesh=0,
            rate=Fraction(1),
            phase=0.0,
            orders=(teeth,),
        )
        engagement = Engagement(
            first=0.0,
            start=self.start - 0.5 * self.overlap,
            end=self.end + 0.5 * self.overlap,
            drives=side == 0,
            teeth=1 + np.arange(teeth),
            overlap=self.overlap,
        )
        return GearContacts(gear, {0: engagement})

    def system(self, damping_ratio: float = 0.05) -> LumpedSystem:
        """The pair with its mesh as one spring over a turn of the faulty gear."""
        position = np.arange(self.teeth[self.side] * PIECES) / PIECES
        stiffness, gap = self._mesh_springs(position)
        mean = float(stiffness.mean())
        spring = PairExcitation(_wave(stiffness), _wave(gap))
        radii = [1e-3 * teeth for teeth in self.teeth]
        gears = tuple(
            Gear(
                name="ab"[index],
                teeth=self.teeth[index],
                base_radius=radius,
                inertia=0.5 * math.pi * 7800.0 * 0.02 * radius**4,
                torque=LOAD * radius,
            )
            for index, radius in enumerate(radii)
        )
        mesh = Mesh(
            driver=0, driven=1, pressure_angle=math.radians(20.0), backlash=1e-4
        )
        train = Train(gears=gears, meshes=(mesh,), damping_ratio=damping_ratio)
        return LumpedSystem(train, (MeshExcitation((spring,), mean),))

    def _mesh_springs(self, position: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Stiffness [N/m] and gap [m] of the mesh at positions (t,), by its slices."""
        count = self.teeth[self.side]
        reach = math.ceil(self.contact_ratio) + 1
        ahead = np.arange(-reach, reach + 1)
        pitch = np.floor(position).astype(int)
        tooth = pitch[:, None] + ahead
        lead = self.overlap * ((np.arange(SLICES) + 0.5) / SLICES - 0.5)
        place = (position[:, None] - tooth)[..., None] + lead
        is_faulty = (tooth % count == self.tooth)[..., None]
        stiffness, gap = self._slices(place, is_faulty)
        flat = len(position), -1
        return _sharing(stiffness.reshape(flat), gap.reshape(flat))

    def _slices(
        self, place: np.ndarray, is_faulty: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Stiffness and gap of slices at places of the path."""
        middle, half = 0.5 * (self.start + self.end), 0.5 * (self.end - self.start)
        along = (place - middle) / half
        stiffness = SLICE_STIFFNESS * np.where(
            np.abs(along) <= 1.0, 1.0 - 0.35 * along**2, 0.0
        )
        gap = np.zeros(stiffness.shape)
        share = np.ones(stiffness.shape)
        if self.kind == "crack":
            share -= 0.05 + 0.25 * self.size
        elif self.kind == "wear":
            gap += 1e-6 * (1.0 + 6.0 * self.size) * (1.0 + along**2)
        elif self.kind == "pitch error":
            gap += 1e-6 * (1.0 + 6.0 * self.size)
        elif self.kind == "broken tip":
            # contact passes to the next tooth all the same
            broken = 0.1 + 0.4 * self.size
            broken = min(broken, 0.9 * (self.contact_ratio - 1.0))
            lost = place > self.end - broken
            if self.side == 1:
                lost = place < self.start + broken
            share = np.where(lost, 0.0, 1.0)
        elif self.kind == "spall":
            half_spall = 0.2 + 0.15 * self.size
            is_near = np.abs(place - self.place) <= half_spall
            inside = is_near & (
                np.abs(np.arange(SLICES) + 0.5 - SLICES / 2) < SLICES / 4
            )
            share = np.where(inside, 0.9 - 0.3 * self.size, 1.0)
        else:
            share = np.zeros(stiffness.shape)
        share = np.where(is_faulty, share, 1.0)
        return stiffness * share, np.where(is_faulty, gap, 0.0)


def _sharing(stiffness: np.ndarray, gap: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness (t,) and gap (t,) of one spring for slices (t, n) under the load."""
    order = np.argsort(gap, axis=1)
    k = np.take_along_axis(stiffness, order, axis=1).cumsum(axis=1)
    moments = np.take_along_axis(stiffness * gap, order, axis=1).cumsum(axis=1)
    deflection = (LOAD + moments) / np.maximum(k, 1.0)
    # the first slices that carry the load before the next one touches
    following = np.take_along_axis(gap, order, axis=1)[:, 1:]
    is_reached = np.ones(k.shape, bool)
    is_reached[:, :-1] = deflection[:, :-1] <= following
    last = is_reached.argmax(axis=1)[:, None]
    k, moments = (np.take_along_axis(v, last, axis=1)[:, 0] for v in (k, moments))
    return k, moments / k


def _wave(values: np.ndarray) -> Wave:
    """Straight pieces through values of successive base pitches."""
    ahead = np.roll(values, -1)
    coefficients = np.zeros((values.size, 4))
    coefficients[:, 0], coefficients[:, 1] = values, PIECES * (ahead - values)
    breaks = np.arange(PIECES + 1) / PIECES
    return Wave(breaks, coefficients.reshape(-1, PIECES, 4))


def random_pair(random: np.random.Generator) -> FaultyPair:
    """A pair of a contact ratio of 1.2 to 3, spur or helical, and its fault."""
    is_helical = random.random() < 0.5
    ratio = random.uniform(1.2, 3.0)
    overlap = 0.0
    if is_helical:
        overlap = random.uniform(0.2, max(0.2, min(1.5, ratio - 1.1)))
    transverse = ratio - overlap
    start = -transverse * random.uniform(0.35, 0.65)
    teeth = tuple(int(count) for count in random.integers(15, 50, 2))
    side = int(random.integers(2))
    kinds = KINDS if ratio >= 2.1 else KINDS[:-1]
    return FaultyPair(
        teeth=teeth,
        start=start,
        end=start + transverse,
        overlap=overlap,
        side=side,
        tooth=int(random.integers(teeth[side])),
        kind=str(random.choice(kinds)),
        size=random.random(),
        place=random.uniform(-0.25, 0.25),
    )
