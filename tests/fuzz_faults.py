"""Random faults of gears for `fuzz_gear_sets.py`, most of which fit the teeth."""

from __future__ import annotations

import random
from collections.abc import Callable
from typing import Any

Tables = dict[str, Any]
TALL = 2.6  # mm, addendum of teeth with a contact ratio above 2


def tooth(r: random.Random, gear: Tables) -> Any:
    """A number of a tooth, now and then beyond the last or none at all."""
    teeth = gear.get("teeth", 20)
    teeth = teeth if isinstance(teeth, int) and 1 <= teeth < 1000 else 20
    return r.randint(1, teeth) if r.random() < 0.97 else r.choice([0, teeth + 1, 1.5])


def angles(r: random.Random, count: int) -> list[float]:
    """Roll angles in order, most of them on a flank."""
    low, high = r.choice([(18.0, 24.0), (20.0, 26.0), (20.0, 23.0), (0.0, 60.0)])
    points = sorted(round(r.uniform(low, high), 3) for _ in range(count))
    return points if r.random() < 0.97 else points[::-1]


def crack(r: random.Random, gear: Tables) -> Tables:
    entry: Tables = {
        "tooth": tooth(r, gear),
        "depth_mm": round(10.0 ** r.uniform(-2.0, r.choice([0.1, 0.1, 0.9])), 4),
    }
    if r.random() < 0.3:
        middle, width = r.choice([(35.0, 10.0), (35.0, 10.0), (45.0, 40.0)])
        entry["tangent_angle_deg"] = round(middle + width * r.uniform(-1.0, 1.0), 2)
    if r.random() < 0.4:
        middle, width = r.choice([(60.0, 25.0), (60.0, 25.0), (90.0, 90.0)])
        entry["direction_deg"] = round(middle + width * r.uniform(-1.0, 1.0), 2)
    if r.random() < 0.4:
        entry["root"] = r.choice([*["loaded", "back"] * 10, "left"])
    return entry


def spall(r: random.Random, gear: Tables) -> Tables:
    start, end = angles(r, 2)
    return {
        "tooth": tooth(r, gear),
        "start_roll_angle_deg": start,
        "end_roll_angle_deg": end,
        "width_share": r.choice([*[0.3, 0.5, 0.95, 1e-6] * 5, 0.96]),
    }


def broken_tip(r: random.Random, gear: Tables) -> Tables:
    height = round(10.0 ** r.uniform(-3.0, r.choice([-0.5, 0.0, 0.8])), 4)
    return {"tooth": tooth(r, gear), "height_mm": height}


def wear(r: random.Random, gear: Tables) -> Tables:
    count = r.choice([*[2, 3, 5] * 8, 1])
    points: Tables = {"roll_angle_deg": angles(r, count)}
    if r.random() < 0.2:
        points = {"diameter_mm": sorted(r.uniform(30.0, 60.0) for _ in range(count))}
    entry = points | {
        "depth_um": [
            r.choice([*[0.0, 1.0, 2.0] * 15, 300.0, -1.0]) for _ in range(count)
        ]
    }
    if r.random() < 0.6:
        entry["tooth"] = tooth(r, gear)
    return entry


ENTRIES: dict[str, Callable[[random.Random, Tables], Any]] = {
    "cracks": crack,
    "spalls": spall,
    "broken_tips": broken_tip,
    "worn_teeth": wear,
    "missing_teeth": tooth,
}


def with_faults(r: random.Random, tables: Tables) -> Tables:
    """The tables of a gear set with faults of one gear or of several."""
    for gear in tables["gear"]:
        if r.random() < 0.3:
            continue
        for key in r.sample(list(ENTRIES), r.choice([0, 1, 1, 1, 1, 2])):
            if key == "missing_teeth" and r.random() < 0.5:
                continue  # many in a row are refused by statics
            count = r.choice([1, 1, 1, 1, 1, 1, 2, 6])
            gear[key] = [ENTRIES[key](r, gear) for _ in range(count)]
        if r.random() < 0.3:
            gear["eccentricity_um"] = round(
                10.0 ** r.uniform(-1.0, r.choice([1.5, 1.5, 3.5])), 3
            )
        if r.random() < (0.3 if "eccentricity_um" in gear else 0.02):
            gear["eccentricity_angle_deg"] = round(r.uniform(-180.0, 180.0), 2)
    return tables


def meshing_pair(r: random.Random) -> Tables:
    """Two gears that run together, some with teeth that bridge a missing one."""
    teeth, thinning = (r.randint(18, 60), r.randint(18, 60)), r.choice([20.0, 80.0])
    defaults: Tables = {
        "module_mm": 2.0,
        "face_width_mm": 10.0,
        "hub_radius_mm": 8.0,
        "tooth_thinning_um": thinning,
    }
    if r.random() < 0.3:
        teeth = r.randint(50, 80), r.randint(50, 80)
        defaults |= {"addendum_mm": TALL, "dedendum_mm": 3.0}
    names = r.sample(["a", "b", "pinion 1"], 2)
    mesh = dict(zip(["driver", "driven"], r.sample(names, 2), strict=True))
    return {
        "name": "pair",
        "defaults": defaults,
        "gear": [{"name": n, "teeth": z} for n, z in zip(names, teeth, strict=True)],
        "mesh": [mesh | {"center_distance_mm": float(sum(teeth))}],
        "load": {"gear": mesh["driver"], "torques_Nm": [20.0]},
    }


EDITS = (
    "gear.1.cracks.1.depth_mm=1",
    "gear.1.cracks.1.depth_mm=0",
    "gear.1.cracks.2.tooth=3",
    "gear.1.cracks.7.tooth=3",
    "gear.2.spalls.1.width_share=0",
    "gear.2.broken_tips.1.height_mm=0.2",
    "gear.1.missing_teeth=[1]",
    "gear.1.worn_teeth.1.depth_um=[1,2]",
    "gear.1.worn_teeth.depth_um=[1,2]",
    "gear.1.cracks.1=3",
    "gear.1.cracks.99999999999.tooth=3",
    "gear.1.eccentricity_um=5",
)


def fault_command(r: random.Random, name: str) -> list[str]:
    """A command on a gear set with faults: `show`, `stiffness` or `signals`."""
    if name == "show":
        return show_command(r)
    arguments = [name, "set.toml", "--resolution", "coarse"]
    if name == "stiffness":
        arguments += ["--positions", "8"]
        arguments += r.choice([[], ["--json"], ["--friction", "0.1"], ["-o", "t.csv"]])
        arguments += r.choice([[], ["--cracks", "c.csv"], ["--plot", "p.png"]])
    else:
        arguments += ["--rpm", str(r.randint(100, 6000)), "--turns", "2"]
        arguments += r.choice([[], ["--json"], ["--model", "3"], ["--plot", "p.png"]])
    return arguments


def show_command(r: random.Random) -> list[str]:
    """`show` with one of its outputs, now and then with faults that are set."""
    arguments = ["show", "set.toml"]
    arguments += r.choice([[], ["--json"], ["-o", "out.dxf"], ["--plot", "out.png"]])
    if r.random() < 0.2:
        arguments += ["--set", r.choice(EDITS)]
    return arguments
