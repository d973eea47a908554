"""Key figures of a mesh over its cycle: means, ranges and largest values."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from fegear.contact.edges import edge_positions, finite_pressures
from fegear.contact.path import face_along_path, loss_factor
from fegear.contact.problem import ContactProblem
from fegear.contact.result import ContactCycle, largest_of_bands
from fegear.statics.root_stress import RootStresses
from lumped.common.array_types import Array
from lumped.train.table import MeshTable
from meshes import GearPair

GEARS = "driver", "driven"
FLOAT_DECIMALS = 6  # of micrometres


def key_figures(
    problem: ContactProblem,
    cycle: ContactCycle,
    table: MeshTable,
    roots: RootStresses | None,
    t: int,
) -> dict[str, Any]:
    """Means and ranges over the mesh cycle at one of the torques, by its index.

    Pressures are those of pairs without an edge in contact, see `fegear.contact.edges`,
    None where there is no such pair. That at the pitch point is the largest there of
    all tooth pairs and of all places over the face width, where these differ: of bands
    of it, see `fegear.contact.result.largest_of_bands`.
    """
    names = "stiffness_N_per_m", "local_stiffness_N_per_m", "friction_bending_ratio"
    k, local, bending = (table[name][t] for name in names)
    ste, no_load = (table[name][t] for name in ("ste_m", "nlte_m"))
    pressures = finite_pressures(problem, cycle, t)
    of_all_pairs = pressures.max(axis=(1, 2))
    largest = int(of_all_pairs.argmax())
    at_pitch_point = _pressure_at_pitch_point(problem, cycle, t)
    return {
        "torque_Nm": float(cycle.torque[t]),
        "mean_stiffness_N_per_m": float(k.mean()),
        "peak_to_peak_over_mean": float(np.ptp(k) / k.mean()),
        "mean_local_stiffness_N_per_m": float(local.mean()),
        "ste_mean_um": 1e6 * float(ste.mean()),
        "ste_peak_to_peak_um": 1e6 * float(np.ptp(ste)),
        "nlte_peak_to_peak_um": 1e6 * float(np.ptp(no_load)),
        **_in_both_planes(
            "pressure_at_pitch_point",
            1e-6 * at_pitch_point if at_pitch_point > 0.0 else None,
            problem,
        ),
        **_in_both_planes(
            "max_pressure",
            1e-6 * float(of_all_pairs[largest]) if of_all_pairs.any() else None,
            problem,
        ),
        "max_pressure_at_position": (
            float(table.position[largest]) if of_all_pairs.any() else None
        ),
        "positions_with_edge_contact": int(edge_positions(problem, cycle, t).sum()),
        "friction_bending_ratio_mean": float(bending.mean()),
        "driver_root_stress_MPa": _largest_root_stress(table, "driver", t),
        "driven_root_stress_MPa": _largest_root_stress(table, "driven", t),
        **_roots_over_width(roots, t),
        "loss_factor": float(loss_factors(problem.pair, cycle)[t]),
        **_over_face(problem, cycle, t),
    }


def _pressure_at_pitch_point(
    problem: ContactProblem, cycle: ContactCycle, t: int
) -> float:
    """Largest one in plane strain without an edge in contact [Pa], 0 without any."""
    finite = finite_pressures(problem, cycle, t)
    # of the load on a band, the square of the pressure
    squares = face_along_path(cycle, finite, np.zeros(1)) ** 2
    return math.sqrt(largest_of_bands(squares).max())


def _axial_float(cycle: ContactCycle, t: int) -> dict[str, float]:
    """Where a double helical driver that is free along its axis goes."""
    if not cycle.face.groove:
        return {}
    # of halves that are alike there is round-off
    moved = np.round(1e6 * cycle.axial_float[t], FLOAT_DECIMALS) + 0.0
    return {
        "axial_float_um": float(moved.mean()),
        "axial_float_peak_to_peak_um": float(np.ptp(moved)),
    }


def _over_face(
    problem: ContactProblem, cycle: ContactCycle, t: int
) -> dict[str, float]:
    """How loads are distributed over the face width; nothing where they are equal.

    The largest load per length is that of all contacts, as in the file of loads, and
    beside it the largest of those on the path of contact, where no tip corner touches.
    """
    loads = cycle.face
    if loads.is_uniform:
        return {}
    on_path = np.where(loads.on_path, loads.load[t], 0.0)
    axial_force = float(loads.axial_force_on_driver[t].mean())
    n, k, m = np.unravel_index(loads.load[t].argmax(), on_path.shape)
    return {
        "overlap_ratio": problem.pair.overlap_ratio(loads.helix_width),
        "load_distribution_factor": float(loads.distribution_factor[t]),
        "largest_line_load_N_per_mm": 1e-3 * float(loads.load[t, n, k, m]),
        "largest_line_load_at_mm": 1e3 * float(loads.place[m]),
        "largest_line_load_at_position": float(cycle.position[n]),
        "largest_line_load_on_path_N_per_mm": 1e-3 * float(on_path.max()),
        "axial_force_N": float(abs(axial_force)),
        "driver_axial_force_N": axial_force,
        "driven_axial_force_N": 0.0 - axial_force,
        **_axial_float(cycle, t),
        "load_center_mm": 1e3 * float(loads.center[t].mean()),
        "load_center_peak_to_peak_mm": 1e3 * float(np.ptp(loads.center[t])),
    }


def _in_both_planes(
    name: str, strain: float | None, problem: ContactProblem
) -> dict[str, float | None]:
    """A pressure in plane strain [MPa], and what it is in plane stress."""
    ratio = problem.plane_stress_pressure / problem.plane_strain_pressure
    return {
        f"{name}_plane_strain_MPa": strain,
        f"{name}_plane_stress_MPa": None if strain is None else ratio * strain,
    }


def _largest_root_stress(table: MeshTable, gear: str, t: int) -> float | None:
    """Largest over the cycle at one torque [MPa]; None where it is not computed."""
    values = table.columns.get(f"{gear}_root_stress_Pa")
    return None if values is None else 1e-6 * float(values[t].max())


def _roots_over_width(roots: RootStresses | None, t: int) -> dict[str, float]:
    """Place of the largest root stress and K_Fbeta of both gears; of loads that vary
    over the width alone.
    """
    figures: dict[str, float] = {}
    for gear, root in zip(GEARS, roots.over_width if roots else (), strict=False):
        _, _, z = root.largest_at(t)
        figures[f"{gear}_root_stress_at_mm"] = 1e3 * float(root.place[z])
        figures[f"{gear}_root_stress_factor"] = float(root.factor[t])
    return figures


def loss_factors(pair: GearPair, cycle: ContactCycle) -> Array:
    """Loss factor H_V of the load sharing at each torque (t,), dimensionless.

    Friction loss over friction coefficient and transmitted power, see
    `fegear.contact.path`.
    """
    gears = pair.driver, pair.driven
    teeth = tuple(gear.sign * gear.teeth for gear in gears)
    loads = cycle.face.load.reshape(*cycle.ste.shape, -1)
    # friction comes with the normal force, of which the section has a part
    in_section = loads * math.cos(cycle.face.base_helix_angle)
    share = loads / in_section.sum(axis=2, keepdims=True)
    place = cycle.face.path_position.reshape(cycle.position.size, -1)
    return loss_factor(teeth, place, share)
