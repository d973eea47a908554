"""Excitations of all meshes of a train over the time after which they repeat."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from lumped.common.array_types import Array
from lumped.kernels.arrays import PITCH, ExcitationSamples, Pieces
from lumped.train.excitation import MeshExcitation, PairExcitation
from lumped.train.train import Train
from lumped.train.waves import POSITION_TOL, Wave

GAP_POINTS = 256  # points of a gap per base pitch


@dataclass(frozen=True, eq=False)
class TrainExcitation:
    """Stiffness and gap of all p tooth pairs, mesh by mesh.

    Times are in periods of the first mesh, which is at its phase at time 0.
    """

    train: Train
    meshes: tuple[MeshExcitation, ...]

    @cached_property
    def common_period(self) -> tuple[int, ...]:
        """Shortest time after which everything repeats, in periods of each mesh.

        It is that of the meshes or, if teeth differ, that of the pairs they form.
        """
        rates = self.train.mesh_rates
        periods = (e.period / r for e, r in zip(self.meshes, rates, strict=True))
        first = math.lcm(*(period.numerator for period in periods))
        return tuple(int(first * rate) for rate in rates)

    @property
    def repetitions(self) -> int:
        """Number of periods of all meshes until their teeth repeat."""
        return self.common_period[0] // self.train.common_period[0]

    @cached_property
    def mesh_of(self) -> NDArray[np.intp]:
        """Mesh of every pair (p,)."""
        counts = [len(excitation.pairs) for excitation in self.meshes]
        return np.repeat(np.arange(len(counts)), counts)

    @cached_property
    def pieces(self) -> Pieces:
        """Excitation in the form that adaptive steps take."""
        waves = [wave for mesh_waves in self._waves for wave in mesh_waves]
        sizes = [wave.breaks.size - 1 for wave in waves]
        shapes = [len(wave.shapes) for wave in waves]
        rows = np.cumsum([0] + [n * c for n, c in zip(sizes, shapes, strict=True)])[:-1]
        offsets = np.cumsum([0] + [wave.offsets.size for wave in waves])
        whole = np.repeat([self._whole[m] for m in self.mesh_of], 2)
        pitches = (rows, shapes, offsets[:-1], np.diff(offsets), whole, rows)
        return Pieces(
            pair_positions=np.array([(*self._places[m], 0.0) for m in self.mesh_of]),
            first_piece=np.concatenate([[0], np.cumsum(sizes)]),
            breaks=np.concatenate([wave.breaks for wave in waves]),
            coefficients=np.concatenate(
                [wave.coefficients.reshape(-1, 4) for wave in waves]
            ),
            stops=np.unique(np.concatenate([self.corners(), self._pair_switches()])),
            mesh_of=self.mesh_of,
            pitches=np.stack(pitches, axis=1),
            offsets=np.concatenate([wave.offsets for wave in waves]),
        )

    @cached_property
    def turns(self) -> NDArray[np.int64]:
        """Base pitches (2 p,) by which each function advances in a round."""
        return np.repeat(np.array(self.train.common_period)[self.mesh_of], 2)

    def pieces_in(self, number: int) -> Pieces:
        """Separate `pieces` for a round of the common period, by its number."""
        pitches = self.pieces.pitches.copy()
        pitches[:, PITCH] += number * self.turns
        return self.pieces._replace(
            pair_positions=self.pieces.pair_positions.copy(), pitches=pitches
        )

    def _pair_switches(self) -> Array:
        """Times at which a mesh starts a cycle and pairs pass their waves on."""
        length = self.train.common_period[0]
        return np.concatenate(
            [
                (np.arange(round(length * rate)) + (-phase) % 1.0) / rate
                for phase, rate in self._places
            ]
        )

    def evaluate(self, times: Array, side: int = 1) -> tuple[Array, Array]:
        """Stiffness [N/m] and gap [m] of all pairs (..., p) at times.

        side : -1 for the limit from below
        """
        stiffness, gap = (self._values(waves, times, side) for waves in self._functions)
        return stiffness, gap

    @property
    def _functions(self) -> tuple[list[Wave], list[Wave]]:
        """Stiffnesses and gaps of all pairs."""
        pairs = [pair for mesh in self.meshes for pair in mesh.pairs]
        return [pair.stiffness for pair in pairs], [pair.gap for pair in pairs]

    def _values(
        self,
        waves: Sequence[Wave],
        times: Array,
        side: int = 1,
        repetitions: NDArray[np.intp] | int = 0,
    ) -> Array:
        """Values (..., p) of a wave of each pair at times.

        repetitions : number of common periods of the meshes that have passed, broadcast
        """
        # a constant wave does not broadcast by itself
        shape = np.broadcast_shapes(times.shape, np.shape(repetitions))
        values = np.empty((*shape, len(waves)))
        for p, (wave, m) in enumerate(zip(waves, self.mesh_of, strict=True)):
            phase, rate = self._places[m]
            pitch = (
                self._whole[m] + np.asarray(repetitions) * self.train.common_period[m]
            )
            values[..., p] = wave(phase + rate * times, side, pitch)
        return values

    def grid(self, steps: int) -> Array:
        """Times (s + 1,) until all meshes repeat, at all corners and even between.

        steps : least number of steps per period of the first mesh
        """
        length = self.train.common_period[0]
        ends = np.concatenate([self.corners(), [float(length)]])
        starts = np.concatenate([[0.0], self.corners()])
        parts = [
            np.linspace(
                a, b, max(1, math.ceil((b - a) * steps - POSITION_TOL)), endpoint=False
            )
            for a, b in zip(starts, ends, strict=True)
        ]
        return np.concatenate([*parts, [float(length)]])

    def samples(self, times: Array) -> ExcitationSamples:
        """Steps of the common period between times of a grid, with the excitation."""
        stiffness, gap = (self.sample_steps(waves, times) for waves in self._functions)
        return ExcitationSamples(
            np.tile(np.diff(times), self.repetitions), stiffness, gap
        )

    @property
    def _places_of_springs(self) -> list[Wave]:
        """Places of the springs of gears that move in space, none of others."""
        pairs = [pair for mesh in self.meshes for pair in mesh.pairs]
        return [pair.place for pair in pairs if pair.place is not None]

    def places_at(self, times: Array, side: int = 1) -> Array:
        """Places of springs along the axis at times.

        Parameters
        ----------
        times : array
            Times [periods of the first mesh].
        side : int, optional
            -1 for the limit from below.

        Returns
        -------
        array
            Places (..., p) [m].
        """
        return self._values(self._places_of_springs, times, side)

    def places_in_space(self, times: Array) -> Array:
        """Places of springs along the axis at the steps, as `sample_steps`.

        Parameters
        ----------
        times : array
            Times of a grid, whose steps cross no corner.

        Returns
        -------
        array
            Places (s, 3, p) [m].
        """
        return self.sample_steps(self._places_of_springs, times)

    def sample_steps(self, waves: Sequence[Wave], times: Array) -> Array:
        """Values (s, 3, p) of a wave per pair at start, middle and end of all steps.

        times : times of a grid, whose steps cross no corner
        """
        middle = 0.5 * (times[:-1] + times[1:])
        points = ((times[:-1], 1), (middle, 1), (times[1:], -1))
        rounds = np.arange(self.repetitions)[:, None]
        values = [self._values(waves, t, side, rounds) for t, side in points]
        return np.stack(values, axis=2).reshape(-1, 3, len(waves))

    @cached_property
    def _places(self) -> list[tuple[float, float]]:
        """Phase within a cycle and rate of each mesh."""
        meshes, rates = self.train.meshes, self.train.mesh_rates
        return [
            (math.fmod(mesh.phase, 1.0), float(rate))
            for mesh, rate in zip(meshes, rates, strict=True)
        ]

    @cached_property
    def _whole(self) -> list[int]:
        """Whole base pitches in the phase of each mesh."""
        return [int(mesh.phase) for mesh in self.train.meshes]

    def corners(self) -> Array:
        """Times, until all meshes repeat, at which any excitation has a corner."""
        return self._times(
            [{c for w in mesh_waves for c in w.corners} for mesh_waves in self._waves]
        )

    def breaks(self) -> Array:
        """Times, until all meshes repeat, at which an excitation begins a new cubic."""
        return self._times(
            [{x for w in mesh_waves for x in w.breaks} for mesh_waves in self._waves]
        )

    @property
    def _waves(self) -> list[list[Wave]]:
        """Stiffnesses and gaps of the pairs of each mesh."""
        return [
            [wave for pair in e.pairs for wave in (pair.stiffness, pair.gap)]
            for e in self.meshes
        ]

    def _times(self, positions: Sequence[Iterable[float]]) -> Array:
        """Times, sorted, at which the meshes are at positions of their cycles."""
        length = self.train.common_period[0]
        instants: set[float] = set()
        for mesh_positions, (phase, rate) in zip(positions, self._places, strict=True):
            for position in mesh_positions:
                first = (position - phase) % 1.0
                instants |= {(first + i) / rate for i in range(round(length * rate))}
        times = np.sort(
            [t for t in instants if POSITION_TOL < t < length - POSITION_TOL]
        )
        return times[np.diff(times, prepend=-1.0) > 1e3 * POSITION_TOL]


def largest_gap(pair: PairExcitation) -> float:
    """Largest gap where the pair has a stiffness [m]."""
    x = np.arange(GAP_POINTS) / GAP_POINTS
    pitch = np.arange(pair.period)[:, None]
    stiff = pair.stiffness(x, pitch=pitch) > 0.0
    return float(np.abs(pair.gap(x, pitch=pitch) * stiff).max())
