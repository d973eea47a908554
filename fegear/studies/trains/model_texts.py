"""Headers of files, lines and warnings about lumped models of a train."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from fegear.files.codes import with_code
from fegear.files.version import package_version
from fegear.gearset.model import GearSet
from fegear.gearset.pitch_errors import pair_periods
from fegear.train.model_settings import LumpedModel, TorqueOf
from fegear.train.truncation import flank_bound, truncation_bound
from lumped.common.csv_text import format_exact
from lumped.steady.integration_settings import Settings
from lumped.steady.truncation_check import TruncationCheck
from lumped.train.system import LumpedSystem
from lumped.train.truncation import MAX_ERROR

BENDING = "friction-bending ratio"  # entries of the header of a file
TURNED_FRICTION = "direction of friction"  # where vibration can turn it
TORQUE_OF = "torque"  # where it is that of the input gear with friction
NEGLECTED = {  # of what the coupled model has
    1: "stiffening with load, deflection of tooth pairs by each other and vibration of "
    "the gears' bodies",
    2: "varying stiffness, load sharing of tooth pairs and vibration of the gears' "
    "bodies",
    3: "load sharing of tooth pairs in motion and vibration of the gears' bodies",
}

STATIC_ERROR = 0.1  # allowed relative error of the peak to peak at rest

NEGLECTED_IN_SPACE = (
    "stiffening beyond the load at rest and vibration of the gears' bodies"
)


def left_out_line(model: LumpedModel) -> str:
    """Sentence that says what a model lacks of the coupled one, or empty."""
    if model.number not in NEGLECTED:
        return ""
    if model.motion == "space":
        return f"model {model.name} leaves out {NEGLECTED_IN_SPACE}"
    return f"model {model.number} leaves out {NEGLECTED[model.number]}"


def static_entries(
    systems: Mapping[float, LumpedSystem], meshes: int
) -> dict[str, Any]:
    """Return what a summary says of models at rest.

    Parameters
    ----------
    systems : mapping
        Systems by torque on the input gear [N m].
    meshes : int
        Number of meshes.

    Returns
    -------
    dict
        `static_error`, the relative error of the peak to peak of the static
        transmission error of each mesh, the largest of all torques and None where it is
        not known; `static`, what it is made of.
    """
    rows = [
        {
            "torque_Nm": torque,
            "mesh": check.mesh + 1,
            "peak_to_peak_m": check.peak_to_peak,
            "reference_peak_to_peak_m": check.reference_peak_to_peak,
            "peak_to_peak_error": check.error,
            "mean_m": check.mean,
            "reference_mean_m": check.reference_mean,
            "mean_error": check.mean_error,
        }
        for torque, system in systems.items()
        for check in system.static_checks
    ]
    errors = [
        [row["peak_to_peak_error"] for row in rows if row["mesh"] == mesh + 1]
        for mesh in range(meshes)
    ]
    return {
        "static_error": [
            max(mesh_errors, key=abs) if mesh_errors else None for mesh_errors in errors
        ],
        "static": rows,
    }


def static_line(entries: Mapping[str, Any]) -> str:
    """Say in a line what `static_entries` has, the worst torque of each mesh."""
    parts = []
    for mesh, error in enumerate(entries["static_error"], start=1):
        rows = [row for row in entries["static"] if row["mesh"] == mesh]
        if error is None or not rows:
            continue
        row = max(rows, key=lambda row: abs(row["peak_to_peak_error"]))
        parts.append(
            f"mesh {mesh} {1e6 * row['peak_to_peak_m']:.4g} um, "
            f"{100.0 * error:+.2g} % from its table at {row['torque_Nm']:g} N m, "
            f"mean {100.0 * row['mean_error']:+.2g} %"
        )
    if not parts:
        return ""
    line = f"peak to peak of the static transmission error: {'; '.join(parts)}"
    return with_code("E03", line)


def static_warnings(systems: Mapping[float, LumpedSystem]) -> Iterator[str]:
    """Warn where a model at rest is far from the table that it is made from.

    systems : by torque on the input gear [N m]
    """
    for torque, system in systems.items():
        for check in system.static_checks:
            if abs(check.error) <= STATIC_ERROR:
                continue
            yield with_code(
                "W12",
                f"mesh {check.mesh + 1} at {torque:g} N m: the static transmission "
                f"error of the model has a peak to peak of "
                f"{1e6 * check.peak_to_peak:.3g} um, that of its table "
                f"{1e6 * check.reference_peak_to_peak:.3g} um; allowed are "
                f"{100.0 * STATIC_ERROR:g} % of difference",
            )


def body_modes_warnings(system: LumpedSystem, speeds: Sequence[float]) -> Iterator[str]:
    """A line where the body modes that the coupled model leaves out matter.

    speeds : mesh frequencies of the first mesh [Hz]
    """
    error, on_flanks = truncation_bound(system, speeds), flank_bound(system, speeds)
    if on_flanks is not None and on_flanks > MAX_ERROR:
        yield with_code(
            "W13",
            "body modes that the coupled model leaves out shift sharp resonances: "
            f"amplitudes on their flanks change by up to {100.0 * on_flanks:.2g} % "
            f"between mesh frequencies of {min(speeds):g} and {max(speeds):g} Hz, "
            f"allowed are {100.0 * MAX_ERROR:g} %; finite elements are as sensitive to "
            "their cutoff frequency there",
        )
    if error is not None and error > MAX_ERROR:
        yield with_code(
            "W14",
            "body modes that the coupled model leaves out change the mesh compliance "
            f"by up to {100.0 * error:.2g} % of the excitation's RMS between mesh "
            f"frequencies of {min(speeds):g} and {max(speeds):g} Hz, allowed are "
            f"{100.0 * MAX_ERROR:g} %; finite elements of fidelity reduced have more",
        )


def body_entries(system: LumpedSystem, speeds: Sequence[float]) -> dict[str, str]:
    """Entries of a file's header: body modes of the coupled model's gears, in order,
    and what those that are left out change.

    speeds : mesh frequencies of the first mesh [Hz]
    """
    error, on_flanks = truncation_bound(system, speeds), flank_bound(system, speeds)
    if error is None or on_flanks is None or system.contacts is None:
        return {}
    gears = system.contacts.body_modes.gears
    counts = [int((gears == g).sum()) for g in range(len(system.train.gears))]
    return {
        "body modes": " + ".join(map(str, counts)),
        "body modes left out": "change the mesh compliance by at most "
        f"{100.0 * error:.2g} % of the excitation's RMS, and amplitudes on the flanks "
        f"of resonances by at most {100.0 * on_flanks:.2g} %",
    }


def truncation_entries(
    system: LumpedSystem, checks: Sequence[TruncationCheck]
) -> dict[str, str]:
    """Entries of a file's header: body modes of the coupled model's gears, in order,
    and what those that are left out change.
    """
    contacts = system.contacts
    if contacts is None or contacts.solved_modes is None:
        return {}
    gears, solved = contacts.body_modes.gears, contacts.solved_modes.count
    counts = [int((gears == g).sum()) for g in range(len(system.train.gears))]
    entries = {"body modes": " + ".join(map(str, counts))}
    if contacts.body_modes.count == solved:
        return entries | {"body modes left out": "none"}
    if checks:
        worst = max(checks, key=lambda check: check.error)
        speeds = "a speed" if len(checks) == 1 else f"{len(checks)} speeds"
        if not math.isfinite(worst.error):
            reason = f"with all {solved} solved ones the motion diverges"
            worst_text = f"at {worst.frequency:.6g} Hz"
            return entries | {"body modes left out": f"{reason} {worst_text}"}
        entries["body modes left out"] = (
            f"all {solved} solved ones change the RMS at {speeds} by at most "
            f"{100.0 * worst.error:.2g} %, at {worst.frequency:.6g} Hz"
        )
    else:
        entries["body modes left out"] = "not compared, no motion repeats"
    return entries


def truncation_warnings(checks: Sequence[TruncationCheck]) -> Iterator[str]:
    """Warn where body modes that are left out matter, at the worst of the speeds."""
    worst = max(checks, key=lambda check: check.error, default=None)
    if worst is None or worst.error <= MAX_ERROR:
        return
    change = f"RMS changes by {100.0 * worst.error:.2g} %"
    change = change if math.isfinite(worst.error) else "motion diverges"
    yield with_code(
        "W15",
        f"body modes that the coupled model leaves out matter, most at "
        f"{worst.frequency:.6g} Hz of {len(checks)} compared speeds: with all solved "
        f"ones the {change}, allowed are {100.0 * MAX_ERROR:g} %; finite elements of "
        "fidelity reduced have more",
    )


def natural_in_words(system: LumpedSystem, torque: float) -> str:
    """Which natural frequencies a system has; torque : on the input gear [N m]."""
    error_text = "averages of the mesh stiffness"
    if system.contacts is not None:
        error_text = "the loaded state"
    return f"about {error_text} at {torque:g} N m"


def file_header(
    gear_set: GearSet, model: LumpedModel, damping_ratio: float, integration: str
) -> dict[str, str]:
    """Entries that say how a file came about; nothing that differs between runs.

    damping_ratio : that of the train; integration : its scheme and limits, in words
    """
    return {
        "gear set": gear_set.name,
        "fegear version": package_version(),
        **model.excitation.header_of(gear_set),
        "damping ratio": format_exact(damping_ratio),
        "translations": "yes" if model.translations else "no",
        "motion": model.motion,
        **_bearings(gear_set, model),
        **_friction(model),
        "integration": integration,
        **_pitch_errors(gear_set),
    }


def _bearings(gear_set: GearSet, model: LumpedModel) -> dict[str, str]:
    """How ball and roller bearings are modelled, where gears move on some."""
    rolling = any(gear.rolling_bearing for gear in gear_set.gears)
    return {"bearings": model.bearings} if rolling and model.translations else {}


def _friction(model: LumpedModel) -> dict[str, str]:
    if not model.friction:
        return {}
    bending = "of the mesh tables"
    if isinstance(model.bending, str):
        bending = "of the mesh tables, over the way of each pair"
    elif model.bending is not None:
        bending = format_exact(model.bending)
    entries = {
        "friction coefficient": format_exact(model.friction),
        BENDING: bending,
    }
    if model.sliding == "instantaneous":
        turns = (
            f" within {format_exact(model.transition)} m/s" if model.transition else ""
        )
        entries[TURNED_FRICTION] = f"turned by vibration{turns}"
    return entries | torque_entry(model.torque_of)


def torque_entry(torque_of: TorqueOf) -> dict[str, str]:
    """Return the header entry for torques that include friction losses."""
    if torque_of == "nominal":
        return {}
    return {TORQUE_OF: "of the input gear, with friction"}


def _pitch_errors(gear_set: GearSet) -> dict[str, str]:
    """After how long tooth pairs repeat, where they differ."""
    periods = pair_periods(gear_set)
    if max(periods) == 1:
        return {}
    repeats = ", ".join(f"{n} of mesh {m}" for m, n in enumerate(periods, start=1))
    name = "faults" if any(g.faults.any for g in gear_set.gears) else "pitch errors"
    return {name: f"tooth pairs repeat after base pitches: {repeats}"}


def integration_in_words(settings: Settings, coupled: bool = False) -> str:
    """coupled : whether it is of the coupled model"""
    method = "exact but for cubic contact forces" if coupled else settings.method
    scheme = f"{method}, tolerance {format_exact(settings.tolerance)}"
    if settings.method == "rk4":
        steps = settings.min_steps(coupled)
        scheme += f", {steps} steps per period or more"
    return f"{scheme}, up to {cap_in_words(settings.max_periods)}"


def cap_in_words(max_periods: int | None) -> str:
    return "what the damping needs" if max_periods is None else f"{max_periods} periods"
