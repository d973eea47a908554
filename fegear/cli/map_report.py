"""What a map prints: its smallest and largest vibrations, and doubts about them."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from fegear.cli.options import counted
from fegear.cli.screen import number, screen

if TYPE_CHECKING:
    from fegear.gearset.model import GearSet
    from lumped.maps import ParameterMap


def map_summary(found: ParameterMap, where: str) -> dict[str, Any]:
    """Smallest and largest vibration of every mesh, and where."""
    import numpy as np

    statuses = [cell.status.partition(":")[0] for cell in found.cells.values()]
    names = [axis.name for axis in found.axes]
    extremes = []
    for mesh in range(found.meshes):
        rms = found.on_grid("dte_rms_m", mesh).ravel()
        for kind, pick in (("smallest", np.nanargmin), ("largest", np.nanargmax)):
            if np.isnan(rms).all():
                continue
            place = int(pick(rms))
            extremes.append(
                {
                    "mesh": mesh + 1,
                    "extreme": kind,
                    "dte_rms_m": float(rms[place]),
                    "at": dict(zip(names, found.points[place], strict=True)),
                }
            )
    return {
        "gear_set": found.header["gear set"],
        "excitation": found.header["excitation"],
        "response": where,
        "points": len(found.points),
        "statuses": {
            status: statuses.count(status) for status in sorted(set(statuses))
        },
        "reasons": sorted(
            {c.status for c in found.cells.values() if c.status.startswith("imp")}
        ),
        "extremes": extremes,
    }


def print_map(values: dict[str, Any]) -> None:
    console = screen()
    counts = ", ".join(f"{n} {status}" for status, n in values["statuses"].items())
    console.print(
        f"{values['gear_set']}, {values['excitation']}, {values['response']}\n"
        f"{counted(values['points'], 'point', 'points')}: {counts}"
    )
    for reason in itertools.islice(values["reasons"], 3):
        console.print(reason)
    for extreme in values["extremes"]:
        place = ", ".join(f"{name} = {v:g}" for name, v in extreme["at"].items())
        console.print(
            f"mesh {extreme['mesh']}: {extreme['extreme']} RMS of DTE "
            f"{number(1e6 * extreme['dte_rms_m'], 4)} um at {place}"
        )
    console.print(f"wall time {values['wall_time_s']:.2f} s")


def map_warnings(found: ParameterMap, gear_set: GearSet) -> Iterator[str]:
    """What changes nothing, and where the largest values cannot be physical."""
    import numpy as np

    from fegear.unphysical import doubts_of_meshes

    for place, axis in enumerate(found.axes):
        if len(axis.values) > 1 and _changes_nothing(found, place):
            yield f"{axis.name} does not change the response"
    peaks, backs = (
        [
            float(np.fmax.reduce(found.on_grid(name, m), axis=None))
            for m in range(found.meshes)
        ]
        for name in ("dte_peak_m", "back_side_fraction")
    )
    where = ", at its worst point"
    yield from doubts_of_meshes(gear_set.meshes, where, peaks, backs)


def _changes_nothing(found: ParameterMap, place: int) -> bool:
    """Whether all vibrations along an axis are the same, to the bit."""
    import numpy as np

    if len(found.cells) < len(found.points):
        return False
    sizes = [found.on_grid("dte_rms_m", m) for m in range(found.meshes)]
    return all(
        np.array_equal(rms, np.take(rms, [0], place).repeat(rms.shape[place], place))
        for rms in sizes
    )
