"""Contact over the face width of a mesh, at the positions that pictures show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fegear.contact.problem import ContactProblem
from fegear.contact.result import ContactCycle, joined_cycles
from fegear.contact.solve import solve_cycle
from fegear.contact.width.contact import WidthContact
from fegear.elasticity.cache import cached_wide_root
from fegear.elasticity.wide_root import NEAR_FLANK
from fegear.files.errors import InputError
from fegear.gearset.model import GearSet
from fegear.gearset.pitch_errors import pair_periods
from fegear.rendering.contact_sequence import mesh_title, require_position
from fegear.rendering.flank_surfaces import (
    ContactBand,
    GearInSpace,
    ToothSurface,
    contact_band,
    gears_in_space,
)
from fegear.rendering.look import round_down_to_1_2_5
from fegear.statics.contact_problem import require_solvable
from fegear.statics.machine import loaded_problem
from fegear.statics.plausibility import plausibility_warnings
from fegear.statics.root_stress import FilletTension, fillet_tension
from fegear.statics.settings import StaticsSettings
from lumped.common.array_types import Array
from lumped.common.progress import Progress, silent
from lumped.common.short_repr import ShortRepr

DRAWN_WIDTH = 0.25  # of the widest contact that is drawn, over the height of a flank
TEETH_BESIDE = 1  # that are drawn beside those that touch


@dataclass(frozen=True, kw_only=True)
class WidthSequence(ShortRepr):
    """The contact of a mesh whose loads vary over the face width, at rest.

    mesh : index from 0; torque : on its driver [N m]
    position : of a single picture, base pitches from the pitch point
    with_root : whether the root stress is asked for
    """

    gear_set: GearSet
    mesh: int
    torque: float
    position: float
    statics: StaticsSettings
    with_root: bool = False

    @property
    def title(self) -> str:
        return mesh_title(self.gear_set, self.mesh, self.statics)

    @property
    def film_title(self) -> str:
        """What the title of a film says beside."""
        period = pair_periods(self.gear_set)[self.mesh]
        first = f", the first of {period} base pitches with pitch errors"
        return first if period > 1 else ""

    def solved(
        self, positions: Sequence[float], report: Progress = silent
    ) -> WidthMoments:
        """The contact at positions of the cycle [base pitches]."""
        statics = replace(self.statics, root_stress=self.with_root)  # it takes time
        place = self.gear_set, self.mesh, statics
        problem = loaded_problem(*place, self.torque, report)
        places = np.array(positions, float)
        pitch = np.floor(places).astype(np.int64)
        size, cycles = problem.solver.positions_at_once, []
        for first in range(0, places.size, size):
            report("contact", first, places.size)
            chunk = slice(first, first + size)
            torques = [self.torque]
            position = places[chunk] - pitch[chunk]
            cycles.append(solve_cycle(problem, torques, position, pitch[chunk]))
        cycle = cycles[0] if len(cycles) == 1 else joined_cycles(cycles)
        self._require_in_mesh(float(cycle.ste.max()))
        gears = gears_in_space(self.gear_set, self.mesh)
        return WidthMoments(gears, cycle, self._tensions(problem, cycle))

    def _tensions(
        self, problem: ContactProblem, cycle: ContactCycle
    ) -> tuple[FilletTension, ...]:
        """Tension in the fillets of driver and driven gear; none if not asked for."""
        solver = problem.solver
        if not (self.with_root and isinstance(solver, WidthContact)):
            return ()
        gears = [self.gear_set.gears[i] for i in self.gear_set.meshes[self.mesh].gears]
        sectors = [(g.geometry, self.statics.material(g)) for g in gears]
        return tuple(
            fillet_tension(
                *(problem, solver, cycle, number),
                cached_wide_root(*sector, self.statics.size),
            )
            for number, sector in enumerate(sectors)
        )

    def _require_in_mesh(self, ste: float) -> None:
        """Refuse a transmission error [m] beyond which teeth are not in mesh."""
        spec = self.gear_set.meshes[self.mesh]
        names = (self.gear_set.gears[index].name for index in spec.gears)
        where = f"{self.gear_set.name}, {' and '.join(names)}"
        module = spec.pair.driver.module
        for warning in plausibility_warnings(where, module, deflection=ste):
            raise InputError(warning)


def width_contact_at_rest(
    gear_set: GearSet,
    mesh: int,
    torque: float,
    position: float,
    statics: StaticsSettings,
    with_root: bool = False,
) -> WidthSequence:
    """Contact of a mesh (index from 0) under a torque on its driver [N m].

    position : base pitches from the pitch point
    with_root : whether the root stress is asked for

    Raises InputError for what `require_solvable` refuses.
    """
    require_position(gear_set, mesh, position)
    require_solvable(gear_set, mesh, statics)
    return WidthSequence(
        gear_set=gear_set,
        mesh=mesh,
        torque=torque,
        position=position,
        statics=statics,
        with_root=with_root,
    )


def pair_number(pair: int) -> str:
    """Base pitches by which a pair is ahead, with a sign unless it is 0."""
    return f"{pair:+d}" if pair else "0"


@dataclass(frozen=True, eq=False)
class PairLoad:
    """Normal force of a tooth pair [N], and the middle of its contact.

    pressure : largest of slices on the path [Pa], None where only edges touch
    band : its contact on the flank of the gear that is looked at
    """

    pair: int
    load: float
    pressure: float | None
    band: ContactBand


@dataclass(frozen=True, eq=False)
class WidthMoment:
    """The contact at one position of a mesh, by the index in its cycle."""

    gears: tuple[GearInSpace, GearInSpace]
    cycle: ContactCycle
    index: int
    tensions: tuple[FilletTension, ...] = ()

    @property
    def torque(self) -> float:
        """On the driver [N m]."""
        return float(self.cycle.torque[0])

    @property
    def position(self) -> float:
        """Base pitches from the pitch point of the reference pair."""
        return float(self.cycle.position[self.index])

    @property
    def place(self) -> float:
        """Position within the base pitch, from which pairs count."""
        return self.position - float(np.floor(self.position))

    @property
    def ste(self) -> float:
        """Transmission error [m]."""
        return float(self.cycle.ste[0, self.index])

    def root_stress(self, gear: int, pair: int, tooth: ToothSurface) -> Array:
        """Tension across the fillet at points (n,) of a tooth [Pa], elsewhere NaN.

        gear : 0 of the driver, 1 of the driven gear; tooth : of a pair
        """
        from scipy.interpolate import RegularGridInterpolator

        result, tension = np.full(tooth.along.size, np.nan), self.tensions[gear]
        (at,) = np.nonzero(tension.teeth == pair)
        if at.size:
            field = RegularGridInterpolator(
                (tension.along, tension.place), tension.stress[self.index, at[0]]
            )
            inside = np.flatnonzero(np.isfinite(tooth.along))
            along = np.clip(tooth.along[inside], 0.0, tension.along[-1])
            place = np.clip(-tooth.points[inside, 2], *tension.place[[0, -1]])
            result[inside] = field(np.stack([along, place], axis=1))
        return result

    def band(self, gear: int) -> ContactBand:
        """Contact on the flanks of driver, 0, or driven gear, 1."""
        return contact_band(self.cycle, self.index, gear)

    def pair_loads(self, gear: int) -> list[PairLoad]:
        """Loaded pairs, as they are on the flanks of a gear."""
        face, band = self.cycle.face, self.band(gear)
        loads = face.load[0, self.index].sum(axis=1) * face.slice_length
        result = []
        for pair in np.unique(band.pair):
            local = band.chosen(band.pair == pair)
            load = float(loads[face.teeth == pair][0])
            on_path = local.pressure[local.on_path]
            pressure = float(on_path.max()) if on_path.size else None
            result.append(PairLoad(int(pair), load, pressure, local))
        return result


@dataclass(frozen=True)
class WidthPeak:
    """Largest pressure of slices on the path [Pa].

    position : of the mesh [base pitches]; pair : base pitches by which it is ahead
    place : over the face width, from the middle of the common width [m]
    """

    value: float
    position: float
    pair: int
    place: float


@dataclass(frozen=True, eq=False)
class WidthMoments(ShortRepr):
    """The contact of a mesh at positions of a cycle, under one torque."""

    gears: tuple[GearInSpace, GearInSpace]
    cycle: ContactCycle
    tensions: tuple[FilletTension, ...] = ()

    def __len__(self) -> int:
        return self.cycle.position.size

    def __getitem__(self, index: int) -> WidthMoment:
        return WidthMoment(self.gears, self.cycle, index, self.tensions)

    @property
    def positions(self) -> Array:
        """Positions within the base pitch (n,)."""
        return np.asarray(self.cycle.position - np.floor(self.cycle.position))

    @property
    def peak(self) -> WidthPeak | None:
        """Largest pressure of all positions, None where only edges touch."""
        face = self.cycle.face
        pressure = np.where(face.on_path, face.pressure[0], 0.0)
        at = np.unravel_index(int(pressure.argmax()), pressure.shape)
        if not pressure[at] > 0.0:
            return None
        n, pair, part = (int(index) for index in at)
        return WidthPeak(
            value=float(pressure[at]),
            position=float(self.cycle.position[n]),
            pair=int(face.teeth[pair]),
            place=float(face.place[part]),
        )

    @property
    def root_peaks(self) -> tuple[float, ...]:
        """Largest root stress of both gears [Pa], of all positions."""
        peaks = []
        for gear, tension in enumerate(self.tensions):
            is_root = tension.along > NEAR_FLANK * self.gears[gear].teeth.module
            peaks.append(float(np.nanmax(tension.stress[:, :, is_root])))
        return tuple(peaks)

    @property
    def edge_slices(self) -> int:
        """Number of loaded slices at which an edge touches, of all positions."""
        face = self.cycle.face
        return int(((face.load[0] > 0.0) & ~face.on_path).sum())

    @property
    def pairs(self) -> list[int]:
        """Pairs whose teeth are drawn: all that touch, and the next to them."""
        face = self.cycle.face
        teeth = face.teeth[(face.load[0] > 0.0).any(axis=(0, 2))]
        first, last = int(teeth.min()), int(teeth.max())
        return list(range(first - TEETH_BESIDE, last + TEETH_BESIDE + 1))

    @property
    def limit(self) -> float:
        """Value at the end of the colours [Pa]; edges are beyond."""
        if self.tensions:
            return max(self.root_peaks)
        if self.peak is not None:
            return self.peak.value
        return float(self.cycle.face.pressure.max())

    @property
    def widening(self) -> float:
        """Drawn over true width of contacts: 1, 2 or 5 times a power of ten."""
        bands = [self[n].band(gear) for n in range(len(self)) for gear in (0, 1)]
        widest = 2.0 * max(float(band.half_width.max()) for band in bands)
        height = min(gear.teeth.flank_length for gear in self.gears)
        return round_down_to_1_2_5(DRAWN_WIDTH * height / widest)
