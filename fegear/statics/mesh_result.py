"""The result of a mesh: its table with the evidence for it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fegear.contact.problem import ContactProblem
from fegear.contact.result import ContactCycle
from fegear.contact.virtual_work import largest_deflection, work_on_gaps
from fegear.files.output import write_text
from fegear.result import Result, frame
from fegear.statics.harmonics import Harmonic, mesh_harmonics
from fegear.statics.key_figures import key_figures, loss_factors
from fegear.statics.root_stress import RootStresses
from lumped.common.array_types import Array
from lumped.train.table import MeshTable, format_table
from meshes import GearPair

if TYPE_CHECKING:
    from pandas import DataFrame

ERROR_FACTOR = 3.5  # estimated error over the change against a coarser resolution
ROOT_ERROR_FACTOR = 2.0  # the same of the root stress


@dataclass(frozen=True)
class ErrorEstimate:
    """Estimated discretisation error of the transmission error at one torque.

    Relative to the deflection, the transmission error beyond that without load.

    Attributes
    ----------
    mean : float
        Error of its mean, from the mean of the changes' amounts, whose signs may
        cancel.
    path : float
        Largest error on the nominal path.
    corner : float
        Largest error where a tip corner is in contact, from the largest change of all
        positions, as those are few; NaN where there is none.
    root_stress : float
        Largest error of the root stress of either gear over its peak; NaN where that is
        not computed.
    peak_to_peak : float
        Error of its peak-to-peak value over that value, from the range of the changes;
        NaN where it does not vary.
    distribution : float
        Error of the load distribution factor K_Hbeta, slices among what is coarser; NaN
        where loads are uniform over the face width.
    slice_load : float
        Error of the largest load on a slice over the mean, as `distribution`.

    Notes
    -----
    An error is ERROR_FACTOR times the change against a coarser resolution. With sizes
    in the ratio 0.7, errors of order p are ``0.7^p / (1 - 0.7^p)`` times the change: as
    large at order 2, 2.3 times at order 1, and 3.5 times at order 0.7. On 100 random
    pairs (half with relief) at three torques each, against a mesh 2.4 times as fine as
    the default, the error was at most 2.5 times the change at resolution default and
    3.0 times at coarse, both in corner contact; 1.4 and 2.4 times in the mean. On 20 of
    the pairs it was at most 1.3 times the change at resolution fine.

    The error of the root stress is ROOT_ERROR_FACTOR times its change. On 8 random
    pairs at two torques each, against a mesh 2.4 times as fine as the default, it was
    at most 1.6 times the change, and 0.9 % of the peak.
    """

    mean: float
    path: float
    corner: float
    root_stress: float = math.nan
    peak_to_peak: float = math.nan
    distribution: float = math.nan
    slice_load: float = math.nan

    @property
    def change_of_mean(self) -> float:
        """Mean change of the transmission error against the coarser resolution."""
        return self.mean / ERROR_FACTOR

    @property
    def change_of_distribution(self) -> float:
        """Change of K_Hbeta against the coarser resolution; NaN as `distribution`."""
        return self.distribution / ERROR_FACTOR

    @property
    def change_of_slice_load(self) -> float:
        """Change of the largest load on a slice; NaN as `slice_load`."""
        return self.slice_load / ERROR_FACTOR


@dataclass(frozen=True)
class StaticsResult(Result):
    """A mesh table with its evidence.

    Attributes
    ----------
    table : MeshTable
        Columns over torques (t,) on the driver [N m] and positions (n,) [base pitches].
    cycle : ContactCycle
        Loads, gaps and pressures of all tooth pairs, of which the table is made.
    problem : ContactProblem
        Contact problem that was solved, with the compliances of both flanks.
    errors : tuple of ErrorEstimate
        Estimated discretisation error at each torque; empty where it is not estimated.
    seconds : dict of str to float
        Computing time of each stage [s].
    mesh : int
        Number of the mesh, counted from 1.
    name : str
        Number of the mesh and the names of its gears.
    pitches : int
        Number of base pitches that the table covers, until the tooth pairs repeat.
    roots : RootStresses, optional
        Root stress of all teeth; None where it is not computed.
    """

    table: MeshTable
    cycle: ContactCycle
    problem: ContactProblem
    errors: tuple[ErrorEstimate, ...]
    seconds: dict[str, float]
    mesh: int
    name: str
    pitches: int = 1
    roots: RootStresses | None = None

    @property
    def error(self) -> ErrorEstimate | None:
        """The largest errors of all torques; None where they are not estimated."""
        return largest_errors(self.errors)

    @property
    def teeth(self) -> str:
        """Numbers of teeth of driver and driven gear."""
        return teeth_text(self.problem.pair)

    def to_csv(self, path: str | PathLike[str]) -> None:
        """Write the table with its header.

        Parameters
        ----------
        path : str or path-like
            CSV file.

        Raises
        ------
        InputError
            If the file cannot be written.
        """
        write_text(path, format_table(self.table))

    def to_frame(self) -> DataFrame:
        """The table as a pandas frame; pandas is not installed with this package.

        Returns
        -------
        pandas.DataFrame
            A row for each torque and position, with the columns of `MeshTable.flat`.

        Raises
        ------
        ImportError
            If pandas is missing.
        """
        return frame(self.table.flat)

    def harmonics(
        self, column: str = "ste_m", count: int = 5
    ) -> tuple[tuple[Harmonic, ...], ...]:
        """Harmonics of the mesh frequency in a column of the table.

        Parameters
        ----------
        column : str, optional
            Name of the column, the static transmission error by default.
        count : int, optional
            Number of harmonics; those that the positions do not resolve are left out.

        Returns
        -------
        tuple of tuple of Harmonic
            At each torque the harmonics in rising order, from 1.

        Raises
        ------
        TableError
            If there is no such column.
        """
        return tuple(
            mesh_harmonics(values, count, self.pitches) for values in self.table[column]
        )

    @property
    def key_figures(self) -> tuple[dict[str, Any], ...]:
        """Means, ranges and largest values over the mesh cycle at each torque.

        Names end with units. Pressures are those of pairs without an edge in contact,
        None where there is no such pair.
        """
        return tuple(
            key_figures(self.problem, self.cycle, self.table, self.roots, t)
            for t in range(self.cycle.torque.size)
        )

    @property
    def loss_factors(self) -> Array:
        """Loss factor H_V of the load sharing at each torque (t,), dimensionless.

        Friction loss over friction coefficient and transmitted power, see
        `fegear.contact.path`.
        """
        return loss_factors(self.problem.pair, self.cycle)

    @property
    def evidence(self) -> dict[str, float | None]:
        """What shows that the numbers can be trusted; relative, dimensionless.

        Discretisation errors are the largest of all torques, None where they are not
        estimated.
        """
        return {
            **discretisation(self.error),
            "complementarity_residual": float(self.cycle.residual.max()),
            "torque_balance": self.torque_balance,
            "work_balance": self.work_balance,
            "virtual_work": self.virtual_work,
            "reciprocity": self.reciprocity_error,
        }

    @property
    def reciprocity_error(self) -> float:
        """Largest relative difference of deflections where loads change places."""
        flanks = self.problem.flanks
        return max(flank.compliance.reciprocity_error for flank in flanks)

    @property
    def torque_balance(self) -> float:
        """Largest deviation of T2/T1 from z2/z1, relative."""
        return float(np.abs(self._torque_deviation).max())

    @property
    def work_balance(self) -> float:
        """Deviation of the mean of T2/T1 over the cycle from z2/z1, relative.

        Work that comes in goes out again, but for friction, too few positions and that
        by which deflected flanks tilt, see `fegear.contact.virtual_work`.
        """
        return float(np.abs(self._torque_deviation.mean(axis=1)).max())

    @property
    def virtual_work(self) -> float:
        """Deviation of the mean of T2/T1 from what the gaps give, relative.

        Zero but for friction and too few positions, whatever deflects.
        """
        deviation = self._torque_deviation.mean(axis=1)
        return float(np.abs(deviation - self._gap_work).max())

    @property
    def gap_work(self) -> float:
        """Largest work of the loads on the gaps of the pairs, relative."""
        return float(np.abs(self._gap_work).max())

    @property
    def _gap_work(self) -> Array:
        """Work on the gaps at each torque, see `fegear.contact.virtual_work`."""
        return work_on_gaps(self.cycle, self.problem.pair.base_pitch, self.pitches)

    @property
    def deflection_over_pitch(self) -> float:
        """Largest deflection of a tooth pair over the base pitch.

        An upper bound of `gap_work`, see `fegear.contact.virtual_work`.
        """
        largest = float(largest_deflection(self.cycle).max())
        return largest / self.problem.pair.base_pitch

    @property
    def _torque_deviation(self) -> Array:
        pair = self.problem.pair
        expected = self.cycle.torque[:, None] * pair.driven.teeth / pair.driver.teeth
        return self.cycle.driven_torque / expected - 1.0


def error_estimate(
    change: Array,
    mean_change: float,
    is_corner: NDArray[np.bool_],
    root_change: float = math.nan,
    peak_to_peak_change: float = math.nan,
    distribution_change: float = math.nan,
    slice_change: float = math.nan,
) -> ErrorEstimate:
    """Estimate from relative changes (n,) against a coarser resolution.

    mean_change : mean of the changes' amounts over the mean deflection
    is_corner : (n,) positions with a tip corner in contact
    root_change : largest change of the root stress over its peak
    peak_to_peak_change : range of the changes over that of the transmission error
    distribution_change, slice_change : relative, of K_Hbeta and of the largest slice
    """
    largest = float(change.max()) if is_corner.any() else math.nan
    return ErrorEstimate(
        mean=ERROR_FACTOR * mean_change,
        path=ERROR_FACTOR * float(change[~is_corner].max(initial=0.0)),
        corner=ERROR_FACTOR * largest,
        root_stress=ROOT_ERROR_FACTOR * root_change,
        peak_to_peak=ERROR_FACTOR * peak_to_peak_change,
        distribution=ERROR_FACTOR * distribution_change,
        slice_load=ERROR_FACTOR * slice_change,
    )


def largest_errors(errors: Sequence[ErrorEstimate]) -> ErrorEstimate | None:
    """The largest of each error; None where there are no estimates."""
    if not errors:
        return None
    return ErrorEstimate(
        **{
            field.name: _largest_finite(getattr(error, field.name) for error in errors)
            for field in fields(ErrorEstimate)
        }
    )


def _largest_finite(values: Iterable[float]) -> float:
    return max((value for value in values if math.isfinite(value)), default=math.nan)


def discretisation(error: ErrorEstimate | None) -> dict[str, float | None]:
    """Estimated discretisation errors by name, None where there are none."""
    return {
        "discretisation_ste_mean": error.mean if error else None,
        "discretisation_ste_path": error.path if error else None,
        "discretisation_ste_corner": _finite_or_none(error.corner) if error else None,
        "discretisation_ste_peak_to_peak": (
            _finite_or_none(error.peak_to_peak) if error else None
        ),
        "discretisation_root_stress": (
            _finite_or_none(error.root_stress) if error else None
        ),
        "discretisation_load_distribution_factor": _finite_or_none(error.distribution)
        if error
        else None,
    }


def _finite_or_none(value: float) -> float | None:
    return value if math.isfinite(value) else None


def teeth_text(pair: GearPair) -> str:
    """Numbers of teeth of driver and driven gear."""
    return f"{pair.driver.teeth} / {pair.driven.teeth}"
