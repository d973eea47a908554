"""Warnings of mesh tables that cannot be physical or whose self-checks fail."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from fegear.contact.edges import finite_pressures
from fegear.files.codes import with_code
from fegear.statics.plausibility import (
    MAX_ERROR_ESTIMATE,
    MAX_IMBALANCE,
    MAX_SLICE_CHANGE,
    check_warnings,
    plausibility_warnings,
    tip_warnings,
    unit_warnings,
)

if TYPE_CHECKING:
    from fegear.statics.mesh_result import StaticsResult

MIN_WIDTH = 0.5  # modules, of teeth of their width
MAX_WIDTH = 16.0  # modules, of teeth whose loads vary over the width


def table_warnings(solved: StaticsResult) -> list[str]:
    """Warnings where a table cannot be physical or its self-checks fail."""
    unphysical = [
        line
        for t, torque in enumerate(solved.cycle.torque)
        for line in plausibility_warnings(
            f"mesh {solved.mesh} at {torque:g} N m",
            solved.problem.pair.driver.module,
            deflection=float(np.abs(solved.cycle.ste - solved.cycle.no_load)[t].max()),
            pressure=_finite_pressure(solved, t),
        )
    ]
    warnings = unphysical or [*unit_warnings(solved), *_evidence_warnings(solved)]
    return [
        *_tip_lines(solved),
        *_width_lines(solved),
        *_slice_lines(solved),
        *warnings,
    ]


def _width_lines(solved: StaticsResult) -> Iterator[str]:
    """A warning of teeth that are too thin for finite elements of their width."""
    modules = solved.cycle.face.helix_width / solved.problem.pair.driver.module
    if solved.table.header.get("plane") == "width" and modules < MIN_WIDTH:
        yield with_code(
            "W56",
            f"mesh {solved.mesh}: face width of {modules:.2g} modules; below "
            f"{MIN_WIDTH:g} the mesh of the section is too coarse for plane width, "
            "plane stress is nearer",
        )


def _slice_lines(solved: StaticsResult) -> Iterator[str]:
    """Warnings of teeth too wide for the polynomials, and of loads in few slices."""
    widths = solved.problem.solver.widths
    modules = max(widths) / solved.problem.pair.driver.module
    if modules > MAX_WIDTH:
        yield with_code(
            "W57",
            f"mesh {solved.mesh}: face width of {modules:.3g} modules; above "
            f"{MAX_WIDTH:g} loads that vary over the width are followed less well, at "
            "20 the largest load per length to 10 %",
        )
    error = solved.error
    change = 0.0 if error is None else error.change_of_slice_load
    if error is not None and change > MAX_SLICE_CHANGE:
        yield with_code(
            "W58",
            f"mesh {solved.mesh}: the largest load per length changes by "
            f"{100.0 * change:.2g} % between two numbers of slices, more than "
            f"{100.0 * MAX_SLICE_CHANGE:g} %, K_Hbeta by "
            f"{100.0 * error.change_of_distribution:.2g} %",
        )


def _tip_lines(solved: StaticsResult) -> Iterator[str]:
    """Warnings of tips that meet the edge of an undercut, at the largest torque."""
    t, pair = int(np.abs(solved.cycle.torque).argmax()), solved.problem.pair
    torque, closed = solved.cycle.torque[t], solved.cycle.ste[t].max()
    yield from tip_warnings(solved.mesh, torque, pair, float(closed))


def _finite_pressure(solved: StaticsResult, t: int) -> float:
    """Largest contact pressure [Pa], but for that of edges, which has no limit."""
    return float(finite_pressures(solved.problem, solved.cycle, t).max(initial=0.0))


def _evidence_warnings(solved: StaticsResult) -> Iterator[str]:
    """Self-checks that do not hold.

    The works of both torques differ by that of the loads on the gaps of the flanks.
    It is taken out, whatever its size, and the rest is held to MAX_IMBALANCE. The
    work on the gaps is at most the largest deflection over the base pitch.
    """
    where = f"mesh {solved.mesh}"
    quantity = "gaps and pressures of the contact"
    off = float(solved.cycle.residual.max())
    yield from check_warnings("W04", where, quantity, off)
    quantity = "deflections where loads change places"
    off = solved.reciprocity_error
    yield from check_warnings("W05", where, quantity, off, MAX_ERROR_ESTIMATE)
    if solved.error is not None:
        quantity = "mean transmission errors of two meshes"
        off = solved.error.change_of_mean
        yield from check_warnings("W06", where, quantity, off, MAX_ERROR_ESTIMATE)
    if solved.problem.friction == 0.0:
        quantity = "works of both torques over the cycle"
        places = solved.cycle.position.size / solved.pitches
        missed = 2.0 * solved.torque_balance / places  # by sums that step over jumps
        allowed = MAX_IMBALANCE + missed
        yield from check_warnings("W07", where, quantity, solved.virtual_work, allowed)
        quantity = "works of loads on gaps and of deflection over the cycle"
        allowed += solved.deflection_over_pitch
        yield from check_warnings("W08", where, quantity, solved.gap_work, allowed)
