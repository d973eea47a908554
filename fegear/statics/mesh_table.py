"""Columns and header of a mesh table, from the contact over a cycle."""

from __future__ import annotations

import math
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from fegear.contact.path import (
    contact_diameters,
    on_path,
    path_positions,
    roll_angles,
    sliding_over_pitch_speed,
)
from fegear.contact.problem import ContactProblem
from fegear.contact.result import ContactCycle
from fegear.contact.solve import coupling_of_pairs
from fegear.files.version import package_version
from fegear.gearset.leads import width_gap
from fegear.gearset.model import GearSet
from fegear.gearset.yielding import SHAFTS, YIELD
from fegear.statics.mesh_result import ErrorEstimate, largest_errors, teeth_text
from fegear.statics.root_stress import RootStresses
from fegear.statics.settings import BODIES, CORNERS, StaticsSettings
from lumped.common.array_types import Array
from lumped.common.csv_text import format_exact
from lumped.train.table import pair_compliance_name
from meshes import GearPair


def mesh_name(gear_set: GearSet, mesh: int) -> str:
    spec = gear_set.meshes[mesh]
    driver, driven = gear_set.gears[spec.driver], gear_set.gears[spec.driven]
    return f"{mesh + 1} ({driver.name} drives {driven.name})"


def table_columns(
    problem: ContactProblem,
    cycle: ContactCycle,
    stresses: RootStresses | None = None,
) -> dict[str, Array]:
    """Columns of a contact cycle; pairs that never carry load are left out.

    Contact pressures are those of plane strain.
    """
    share, pair = cycle.load_share, problem.pair
    pressure = problem.plane_strain_pressure * cycle.pressure
    bending = np.nansum(share * cycle.friction_bending, axis=2)
    columns = {
        "n_pairs": (cycle.load != 0.0).sum(axis=2).astype(float),
        "stiffness_N_per_m": cycle.stiffness,
        "local_stiffness_N_per_m": cycle.local_stiffness,
        "ste_m": cycle.ste,
        "nlte_m": cycle.no_load,
        "max_pressure_Pa": pressure.max(axis=2),
        "friction_bending_ratio": bending,
        "driven_torque_Nm": cycle.driven_torque,
        **_path_columns(pair, cycle),
    }
    if stresses is not None:
        largest = stresses.largest
        columns["driver_root_stress_Pa"], columns["driven_root_stress_Pa"] = largest
    if not cycle.face.is_uniform:
        columns["axial_force_N"] = np.abs(cycle.face.axial_force_on_driver)
        columns["load_center_mm"] = 1e3 * cycle.face.center
    angle, sliding = _pair_kinematics(pair, cycle)
    for number, k in enumerate(_used_pairs(cycle), start=1):
        gap = np.where(np.isfinite(cycle.gap[..., k]), cycle.gap[..., k], np.nan)
        columns |= {
            f"pair{number}_stiffness_N_per_m": cycle.pair_stiffness[..., k],
            f"pair{number}_load_share": share[..., k],
            f"pair{number}_gap_m": gap,
            f"pair{number}_max_pressure_Pa": pressure[..., k],
            f"pair{number}_friction_bending_ratio": cycle.friction_bending[..., k],
            f"pair{number}_driver_roll_angle_deg": angle[..., k],
            f"pair{number}_sliding_over_pitch_speed": sliding[..., k],
        }
        if stresses is not None:
            columns |= {
                f"pair{number}_driver_root_stress_Pa": stresses.driver[..., k],
                f"pair{number}_driven_root_stress_Pa": stresses.driven[..., k],
            }
    return columns


def _path_columns(pair: GearPair, cycle: ContactCycle) -> dict[str, Array]:
    """Columns of the reference pair's point on the path, empty beyond its ends."""
    reference = cycle.position - np.floor(cycle.position)
    place = np.where(on_path(pair, reference), reference, np.nan)
    angles, diameters = roll_angles(pair, place), contact_diameters(pair, place)
    columns = {
        "path_length_m": pair.base_pitch * place,
        "driver_roll_angle_deg": np.degrees(angles[0]),
        "driven_roll_angle_deg": np.degrees(angles[1]),
        "driver_diameter_m": diameters[0],
        "driven_diameter_m": diameters[1],
        "sliding_over_pitch_speed": sliding_over_pitch_speed(pair, place),
    }
    return {name: np.tile(v, (cycle.torque.size, 1)) for name, v in columns.items()}


def _pair_kinematics(pair: GearPair, cycle: ContactCycle) -> tuple[Array, Array]:
    """Driver's roll angle [deg] and sliding of each pair (t, n, k), as of the path."""
    every = path_positions(cycle)
    place = np.where(on_path(pair, every), every, np.nan)
    angle = np.degrees(roll_angles(pair, place)[0])
    sliding = sliding_over_pitch_speed(pair, place)
    shape = cycle.load.shape
    return np.broadcast_to(angle, shape), np.broadcast_to(sliding, shape)


def pair_compliances(problem: ContactProblem, cycle: ContactCycle) -> dict[str, Array]:
    """Columns of the transmission error of either pair per load of the other.

    Empty where one of them faces no flank.
    """
    used = _used_pairs(cycle)
    compliance = coupling_of_pairs(problem, cycle, used)
    facing = np.isfinite(cycle.gap[..., used])
    closing = np.where(facing, cycle.closing[..., used], np.nan)
    return {
        pair_compliance_name(i, j): compliance[..., i, j]
        / (closing[..., i] * closing[..., j])
        for i, j in combinations(range(used.size), 2)
    }


def _used_pairs(cycle: ContactCycle) -> NDArray[np.intp]:
    return np.flatnonzero((cycle.load != 0.0).any(axis=(0, 1)))


def table_header(
    gear_set: GearSet,
    mesh: int,
    settings: StaticsSettings,
    cycle: ContactCycle,
    errors: tuple[ErrorEstimate, ...],
) -> dict[str, str]:
    spec = gear_set.meshes[mesh]
    used = enumerate(_used_pairs(cycle), start=1)
    pairs = " ".join(f"pair{i}={cycle.teeth[k]:+d}" for i, k in used)
    header = {
        "format": "fegear mesh table 1",
        "fegear version": package_version(),
        "gear set": gear_set.name,
        "mesh": mesh_name(gear_set, mesh),
        "teeth": teeth_text(spec.pair),
        "contact ratio": f"{spec.pair.contact_ratio:.6g}",
        "base pitch [mm]": format_exact(1e3 * spec.pair.base_pitch),
        **_width_gaps(gear_set, mesh),
        "plane": settings.plane_of(gear_set),
        "resolution": settings.resolution,
        "friction coefficient": format_exact(settings.friction),
        "corner contact": CORNERS[settings.corner_contact],
        "body": BODIES[settings.body],
        **({SHAFTS: YIELD} if spec.on_shafts else {}),
        "pairs ahead of the reference pair [base pitches]": pairs,
        "position": "base pitches past the pitch point of the reference pair",
        "units": "in column names; torque is on the driver; transmission errors are "
        "driver rotation times base radius, driven gear held; compliance of two pairs "
        "is the transmission error of either per load of the other",
        "pressure": "plane strain, as below a narrow contact; with a tip corner or a "
        "kink, such as the start of a linear relief, in contact it has no limit and "
        "follows the contact grid",
        "largest complementarity residual": f"{cycle.residual.max():.3g}",
    }
    error = largest_errors(errors)
    if error is not None:
        parts = {"mean": error.mean, "path": error.path, "corner": error.corner}
        header["estimated discretisation error of ste_m"] = ", ".join(
            f"{name} {part:.2g}" for name, part in parts.items() if part == part
        ) + (", the largest of all torques" if len(errors) > 1 else "")
        if error.root_stress == error.root_stress:
            header["discretisation error of root stress"] = (
                f"estimated as {error.root_stress:.2g} of the peak"
            )
    return header


def _width_gaps(gear_set: GearSet, mesh: int) -> dict[str, str]:
    """Gap of both flanks over the common width; nothing where there is none."""
    width = gear_set.common_width(mesh)
    gaps = 1e6 * width_gap(gear_set, mesh, width * np.array([-0.5, 0.0, 0.5]))
    if not gaps.any():
        return {}
    cosine = math.cos(gear_set.meshes[mesh].pair.driver.base_helix_angle)
    ends = zip(("near end", "middle", "far end"), cosine * gaps, strict=True)
    return {
        "gap of both flanks along the normal [um]": ", ".join(
            f"{end} {gap:.6g}" for end, gap in ends
        )
    }
