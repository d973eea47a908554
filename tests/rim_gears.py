"""Gears that are a rim on elastic spokes: the same train as springs, coupled, dense."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from oracles.rim_train import RimTrain

from lumped import Gear, LumpedSystem, Mesh, MeshExcitation, PairExcitation, Train, Wave
from lumped.kernels.arrays import Contacts
from lumped.train.coupled import BodyModes, CoupledContacts

RADII = np.array([0.04535, 0.06564, 0.11218])  # m, Table 2.1
INERTIAS = np.array([0.002621, 0.01091, 0.1193])  # kg m2
GROUND = (3e4, 5e4, 1e6)  # N m/rad, firm, so that all modes decay soon
FREE = (0.0, 0.0, 0.0)
STIFF = 3e8  # N/m
TORQUE = 100.0  # N m
CELLS = 8  # of a law
Harmonics = tuple[tuple[float, float], ...]  # mean and amplitude of each contact


@dataclass(frozen=True, kw_only=True)
class RimGears:
    """A row of gears that are rims on spokes.

    spokes : deflection of a rim at its base circle per load there, of every gear [m/N]
    in_rim : part of the inertia in the rim
    pairs : drive contacts of each mesh, each a quarter of a cycle after another
    gap : mean and amplitude over the cycle of each contact, mesh by mesh [m];
        stiffness : likewise [N/m]; hardening : of all [N/m2]
    ground : couplings of the gears [N m/rad]
    backlash : of meshes with back flanks [m]
    phase : of the second mesh; positions : of a cycle in the tables
    vibrating : whether rims turn on their spokes as coordinates of their own
    """

    gears: int = 2
    spokes: float = 0.0
    in_rim: float = 0.0
    pairs: int = 1
    gap: Harmonics = ((0.0, 0.0),) * 4
    stiffness: Harmonics = ((STIFF, 0.0),) * 4
    hardening: float = 0.0
    without: tuple[str, ...] = ()
    torque: float = TORQUE
    ground: tuple[float, ...] = tuple(GROUND)
    damping: float = 0.04
    backlash: float = math.inf
    phase: float = 0.0
    inertias: tuple[float, ...] = tuple(INERTIAS)
    radii: tuple[float, ...] = tuple(RADII)
    positions: int = 64
    vibrating: bool = False

    @property
    def train(self) -> Train:
        last, turn = self.gears - 1, 1.0 if self.gears % 2 else -1.0
        torques = [0.0] * self.gears
        torques[0] = self.torque
        torques[last] = -turn * self.torque * self.radii[last] / self.radii[0]
        gears = [
            Gear(
                name=f"gear {g}",
                teeth=40 + g,
                base_radius=self.radii[g],
                inertia=self.inertias[g],
                coupling_stiffness=self.ground[g],
                torque=torques[g],
            )
            for g in range(self.gears)
        ]
        phases = [0.0, self.phase]
        meshes = [
            Mesh(
                driver=m,
                driven=m + 1,
                pressure_angle=0.37,
                backlash=self.backlash,
                phase=phases[m],
            )
            for m in range(last)
        ]
        return Train(
            gears=tuple(gears), meshes=tuple(meshes), damping_ratio=self.damping
        )

    @property
    def model_1(self) -> LumpedSystem:
        """Of rigid gears, with the same springs."""
        return LumpedSystem(self.train, tuple(map(self._excitation, range(self.last))))

    @property
    def last(self) -> int:
        """Index of the last gear, and number of the meshes."""
        return self.gears - 1

    def _angle(self, mesh: int, pair: int) -> float:
        """By which the values of a contact are ahead of the first mesh's [rad]."""
        return 2.0 * math.pi * (self.train.meshes[mesh].phase + 0.25 * pair)

    def _at(self, values: Harmonics, mesh: int, pair: int) -> np.ndarray:
        """(p + 1,) over the cycle of a mesh."""
        mean, size = values[mesh * self.pairs + pair]
        turn = 2.0 * np.pi * np.arange(self.positions + 1) / self.positions
        return mean + size * np.cos(turn + self._angle(mesh, pair))

    def _excitation(self, mesh: int) -> MeshExcitation:
        pairs = []
        breaks = np.arange(self.positions + 1) / self.positions
        # tables of contacts begin at the phase of their mesh, waves at position 0
        shift = round(self.train.meshes[mesh].phase * self.positions)
        for pair in range(self.pairs):
            waves = []
            for values in (self.stiffness, self.gap):
                y = np.roll(self._at(values, mesh, pair)[:-1], shift)
                y = np.append(y, y[0])
                rows = np.zeros((self.positions, 4))
                rows[:, 0], rows[:, 1] = y[:-1], np.diff(y) * self.positions
                corners = tuple(breaks[:-1]) if np.ptp(y) else ()
                waves.append(Wave(breaks, rows, corners))
            pairs.append(PairExcitation(*waves))
        mean = sum(self.stiffness[mesh * self.pairs + k][0] for k in range(self.pairs))
        return MeshExcitation(tuple(pairs), mean)

    @property
    def contacts(self) -> list[tuple[int, int, float]]:
        """Mesh, pair and side of each."""
        sides = (1.0, -1.0) if self.backlash < math.inf else (1.0,)
        meshes, pairs = range(self.last), range(self.pairs)
        return [(m, k, side) for m in meshes for side in sides for k in pairs]

    @property
    def arms(self) -> np.ndarray:
        """Penetration (c, n) per turn of each gear's rim [m]."""
        rows = self.model_1.modes.coordinates.mesh_rows
        return np.array([side * rows[m] for m, _, side in self.contacts])

    @property
    def compliance(self) -> np.ndarray:
        """Of the spokes of each gear (n,) [rad/(N m)]."""
        return self.spokes / np.array(self.radii[: self.gears]) ** 2

    @property
    def coupled(self) -> LumpedSystem:
        """Of gears whose rims yield to the contacts and to their own inertia."""
        reference, arms = self.model_1, self.arms
        shapes = reference.modes.shapes[:, reference.moving]
        rim = self.in_rim * np.array(self.inertias[: self.gears])
        static = (arms * self.compliance) @ arms.T
        grid = self.positions + 1
        contacts = CoupledContacts(
            contacts=self._contacts(np.tile(static, (grid, 1, 1))),
            mesh_of=np.array([m for m, _, _ in self.contacts]),
            pairs=np.array([k for _, k, _ in self.contacts]),
            paths=np.tile([0.0, float(self.pairs)], (self.last, 1)),
            rows=np.repeat((arms @ shapes)[:, None], grid, axis=1),
            penetration_rate=np.repeat(
                [[side] for _, _, side in self.contacts], grid, axis=1
            ),
            inertia_rows=np.repeat(
                ((arms * rim * self.compliance) @ shapes)[:, None], grid, axis=1
            ),
            work=(shapes.T * (rim**2 * self.compliance)) @ shapes,
            modes=self._rims(shapes) if self.vibrating else None,
            without=self.without,
        )
        return replace(reference, contacts=contacts)

    def _rims(self, shapes: np.ndarray) -> BodyModes:
        """Each rim on its spokes with the hub held; shapes : turns of the hubs."""
        root = np.sqrt(self.in_rim * np.array(self.inertias[: self.gears]))
        rows = np.repeat((self.arms / root)[:, None], self.positions + 1, axis=1)
        none = np.zeros(self.gears)
        reference = self.model_1
        still = root[:, None] * np.delete(
            reference.modes.shapes, reference.moving, axis=1
        )
        return BodyModes(
            angular=1.0 / (root * np.sqrt(self.compliance)),
            damping=none,
            coupling=root[:, None] * shapes,
            mass=np.eye(self.gears) - still @ still.T,
            rows=rows,
            whirl=none,
            gears=np.arange(self.gears),
            nodal_diameters=np.zeros(self.gears, np.int64),
        )

    def _contacts(self, static: np.ndarray) -> Contacts:
        """static : (p + 1, c, c) compliance of the spokes [m/N]"""
        count, grid = len(self.contacts), self.positions + 1
        reach = 20.0 * abs(self.torque) / self.radii[0] / STIFF
        knots = reach * np.linspace(0.0, 1.0, CELLS + 1) ** 2
        law, gap = np.zeros((count, grid, 2, CELLS, 4)), np.empty((count, grid))
        for c, (m, k, side) in enumerate(self.contacts):
            stiff = self._at(self.stiffness, m, k)[:, None, None]
            law[c, ..., 0] = stiff * knots[:-1] + self.hardening * knots[:-1] ** 2
            law[c, ..., 1] = stiff + 2.0 * self.hardening * knots[:-1]
            pair_gap = self._at(self.gap, m, k)
            gap[c] = pair_gap if side > 0.0 else self.backlash - pair_gap
        law[..., 2] = self.hardening
        meshes = [m for m, _, _ in self.contacts]
        return Contacts(
            first=np.searchsorted(meshes, np.arange(self.gears)),
            side=np.array([side for _, _, side in self.contacts]),
            gap=gap,
            sliding=np.ones((count, grid)),
            arms=np.zeros((2, count, grid)),
            knots=np.tile(knots, (self.last, 1)),
            load_curve=law,
            normal_compliance=static,
            tangential_compliance=np.zeros_like(static),
            errors=np.zeros((count, 0)),
        )

    @property
    def dense(self) -> RimTrain:
        """The same by hubs and rims, all contacts closed and linear."""
        inertia = np.array(self.inertias[: self.gears])
        train = self.train
        return RimTrain(
            hub=(1.0 - self.in_rim) * inertia,
            rim=self.in_rim * inertia,
            spokes=1.0 / self.compliance,
            ground=np.array([gear.coupling_stiffness for gear in train.gears]),
            torque=np.array([gear.torque for gear in train.gears]),
            rows=self.arms,
            stiffness=np.array(
                [self.stiffness[m * self.pairs + k][0] for m, k, _ in self.contacts]
            ),
        )

    def exact_rms(self, frequency: float) -> np.ndarray:
        """Of the meshes' deflections by their hubs (m,), contacts closed [m]."""
        gaps = [
            self.gap[m * self.pairs + k][1] * np.exp(1j * self._angle(m, k))
            for m, k, _ in self.contacts
        ]
        n, modes = self.gears, self.model_1.modes
        damping = np.zeros((2 * n, 2 * n))
        damping[:n, :n] = modes.damping_matrix(self.damping)
        turns = self.dense.harmonic_turns(
            2.0 * np.pi * frequency, np.array(gaps), damping
        )
        return np.abs(modes.coordinates.mesh_rows @ turns[:n]) / math.sqrt(2.0)

    @property
    def exact_static(self) -> np.ndarray:
        """Deflections (m,) by the hubs under the mean gaps [m]."""
        gaps = np.array([self.gap[m * self.pairs + k][0] for m, k, _ in self.contacts])
        turns = self.dense.static_turns(gaps)[: self.gears]
        return np.asarray(self.model_1.modes.coordinates.mesh_rows @ turns)


FIRM = RimGears(
    gears=3,
    pairs=2,
    stiffness=((2e8, 9e7), (2e8, 9e7), (1.8e8, 6e7), (1.8e8, 6e7)),
    gap=((1e-6, 1e-6),) * 4,
    positions=16,
    phase=0.25,
)
