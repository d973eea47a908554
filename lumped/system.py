"""A train with its excitation, in modal coordinates and ready to be marched."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from lumped.excitation import MeshExcitation, PairExcitation
from lumped.modes import Modes, natural_modes
from lumped.train import Train, TrainError
from lumped.waves import SAME

Array = NDArray[np.float64]
UNTOUCHED = 1e-20  # part of strain energy in the meshes below which a mode is left out
BALANCED = 1e-3  # of the torques on a motion that nothing holds; less is rounding
MOST_BYTES = 1e9  # of the excitation on the steps of a common period
GAP_POINTS = 256  # per base pitch
RUNAWAY = 1e6  # times the largest velocity that statics and gaps suggest


@dataclass(frozen=True, eq=False)
class LumpedSystem:
    """A train and the excitation of each of its meshes.

    Modes that strain no mesh, rigid rotation among them, take no part in the
    motion; raises TrainError where torques do not balance on one that is free.
    """

    train: Train
    excitations: tuple[MeshExcitation, ...]

    def __post_init__(self) -> None:
        if len(self.excitations) != len(self.train.meshes):
            raise TrainError(
                f"excitations: {len(self.excitations)} for "
                f"{len(self.train.meshes)} meshes"
            )
        space = self.modes.coordinates
        free = self.modes.shapes[:, self.modes.frequency_Hz == 0.0]
        net = np.abs(free.T @ space.load)
        size = np.abs(free.T) @ np.abs(space.load)
        if (net > BALANCED * size).any():
            raise TrainError(
                "torques do not balance: the train would accelerate; "
                "hold a gear by a coupling_stiffness or change a torque"
            )

    @cached_property
    def modes(self) -> Modes:
        return natural_modes(self.train, [e.mean_stiffness for e in self.excitations])

    @cached_property
    def moving(self) -> NDArray[np.intp]:
        """Indices of the modes that take part in the motion."""
        return np.flatnonzero(self.modes.mesh_energy.sum(axis=0) > UNTOUCHED)

    @cached_property
    def arrays(self) -> tuple[Array, ...]:
        """The tuple of arrays that `lumped.kernels.law` describes."""
        modes, kept = self.modes, self.moving
        angular = modes.angular[kept]
        pairs = [len(excitation.pairs) for excitation in self.excitations]
        return (
            angular**2,
            2.0 * self.train.damping_ratio * angular,
            modes.shapes[:, kept].T @ modes.coordinates.load,
            np.ascontiguousarray(modes.mesh_shapes[:, kept]),
            modes.mean_stiffness,
            np.array([mesh.backlash for mesh in self.train.meshes]),
            np.concatenate([[0], np.cumsum(pairs)]),
        )

    @cached_property
    def static_state(self) -> Array:
        """Modal displacement at rest under the mean stiffness, zero velocity (2, n).

        No gap counts: a train without load starts with its teeth just touching.
        """
        rigidity, _, load = self.arrays[:3]
        return np.stack([load / rigidity, np.zeros_like(load)])

    @cached_property
    def static_deflection(self) -> Array:
        """Mean mesh deflections (m,) under the external torques [m]."""
        return self.arrays[3] @ self.static_state[0]

    @cached_property
    def pieces(self) -> tuple[Array, ...]:
        """The tuple of arrays that `lumped.kernels.dopri5` describes."""
        waves, places, mesh_of = [], [], []
        for m, excitation in enumerate(self.excitations):
            for pair in excitation.pairs:
                waves += [pair.stiffness, pair.gap]
                places.append(self._places[m])
                mesh_of.append(m)
        sizes = [wave.coefficients.shape[0] for wave in waves]
        return (
            np.array(places),
            np.concatenate([[0], np.cumsum(sizes)]),
            np.concatenate([wave.breaks for wave in waves]),
            np.concatenate([wave.coefficients for wave in waves]),
            np.unique(np.concatenate([self.corners(), self._handovers()])),
            np.array(mesh_of),
        )

    def _handovers(self) -> Array:
        """Times at which a mesh starts a cycle and pairs pass their waves on."""
        length = self.train.common_period[0]
        return np.concatenate(
            [
                (np.arange(round(length * rate)) + (-phase) % 1.0) / rate
                for phase, rate in self._places
            ]
        )

    @cached_property
    def energy_norm(self) -> float:
        """A moderate sum of modal velocities, from the loads and the gaps."""
        stiffness, backlash = self.arrays[4:6]
        reach = np.abs(self.static_deflection).sum() + sum(
            largest_gap(pair) for e in self.excitations for pair in e.pairs
        )
        reach += backlash[np.isfinite(backlash)].sum()
        return math.sqrt(stiffness.max()) * max(reach, 1e-9)

    @property
    def limit(self) -> float:
        """Sum of modal velocities beyond which a run has diverged."""
        return RUNAWAY * self.energy_norm

    @lru_cache(maxsize=16)  # noqa: B019  the system is immutable and short-lived
    def samples(self, steps: int) -> tuple[Array, Array, Array]:
        """Steps of one common period and the excitation on them.

        steps : at least so many per period of the first mesh
        Returns h (k,) in periods of the first mesh, stiffness and gap (k, 3, p) at
        the start, middle and end of each step. Raises TrainError where that is more
        than memory should hold.
        """
        self._require_memory(steps)
        times = self._grid(steps)
        middle = 0.5 * (times[:-1] + times[1:])
        points = ((times[:-1], 1), (middle, 1), (times[1:], -1))
        waves = [
            (pair, *place)
            for excitation, place in zip(self.excitations, self._places, strict=True)
            for pair in excitation.pairs
        ]
        stiffness, gap = (
            np.array(
                [
                    [getattr(pair, name)(phase + rate * t, side) for t, side in points]
                    for pair, phase, rate in waves
                ]
            )
            for name in ("stiffness", "gap")
        )
        axes = (2, 1, 0)
        return (
            np.diff(times),
            np.ascontiguousarray(stiffness.transpose(axes)),
            np.ascontiguousarray(gap.transpose(axes)),
        )

    def _require_memory(self, steps: int) -> None:
        periods = self.train.common_period[0]
        pairs = sum(len(excitation.pairs) for excitation in self.excitations)
        if 48 * periods * steps * pairs > MOST_BYTES:
            raise TrainError(
                f"{periods} periods of the first mesh, after which all meshes repeat, "
                f"of {steps:.3g} steps each: more than a run should hold in memory; "
                "allowed are higher speeds or simpler tooth ratios"
            )

    @cached_property
    def _places(self) -> list[tuple[float, float]]:
        """(phase within a cycle, rate) of each mesh."""
        meshes, rates = self.train.meshes, self.train.mesh_rates
        return [
            (math.fmod(mesh.phase, 1.0), float(rate))
            for mesh, rate in zip(meshes, rates, strict=True)
        ]

    def _grid(self, steps: int) -> Array:
        """Times from 0 to the common period, on all corners and even between."""
        length = self.train.common_period[0]
        ends = np.concatenate([self.corners(), [float(length)]])
        starts = np.concatenate([[0.0], self.corners()])
        parts = [
            np.linspace(a, b, max(1, math.ceil((b - a) * steps - SAME)), endpoint=False)
            for a, b in zip(starts, ends, strict=True)
        ]
        return np.concatenate([*parts, [float(length)]])

    def corners(self) -> Array:
        """Times within a common period at which some excitation has a corner."""
        length = self.train.common_period[0]
        found: set[float] = set()
        for excitation, (phase, rate) in zip(
            self.excitations, self._places, strict=True
        ):
            waves = [w for p in excitation.pairs for w in (p.stiffness, p.gap)]
            for corner in {corner for wave in waves for corner in wave.corners}:
                first = (corner - phase) % 1.0
                found |= {(first + i) / rate for i in range(round(length * rate))}
        times = np.sort([t for t in found if SAME < t < length - SAME])
        return times[np.diff(times, prepend=-1.0) > 1e3 * SAME]


def largest_gap(pair: PairExcitation) -> float:
    """Largest gap where the pair has a stiffness [m]."""
    x = np.arange(GAP_POINTS) / GAP_POINTS
    return float(np.abs(pair.gap(x) * (pair.stiffness(x) > 0.0)).max())
