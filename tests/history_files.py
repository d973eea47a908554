"""Files as `fegear dynamics --history` writes them, for liu-pair and made up."""

from __future__ import annotations

import numpy as np

HEADER = {
    "gear set": "liu-pair",
    "friction coefficient": "0.05",
    "torque_Nm": "100",
    "direction": "up",
    "mesh_frequency_Hz": "1600",
    "time_s": "from the start",
}
ROWS, CYCLES = 32, 2


def share(way):
    """Load of a pair [N] at its way past the pitch point [base pitches]."""
    return 1500.0 * np.maximum(0.0, 1.0 - (way / 0.7) ** 2)


def columns() -> dict[str, np.ndarray]:
    """Two cycles of a mesh; a pair goes by with a load of its own from start to end."""
    passed = CYCLES * np.arange(ROWS + 1) / ROWS
    position = passed - np.floor(passed + 1e-9)
    loads = {k: share(position + k) for k in (-1, 0)}
    return {
        "time_s": passed / 1600.0,
        "mesh1_position": position,
        "mesh1_dte_m": 1e-5 * np.cos(np.pi * passed),
        "mesh1_force_N": loads[-1] + loads[0],
        "mesh1_pair-1_load_N": loads[-1],
        "mesh1_pair0_load_N": loads[0],
        "mesh1_back0_load_N": 0.0 * position,
        "pinion_rotation_rad": 0.0 * position,
        "idler_rotation_rad": 0.0 * position,
    }


def written(path, header=HEADER, **changed):
    """A history file; changed columns replace the usual ones, None leaves out."""
    table = columns() | changed
    table = {name: values for name, values in table.items() if values is not None}
    lines = [f"# {key}: {value}" for key, value in header.items()]
    lines += [",".join(table)]
    lines += [
        ",".join(map(repr, row)) for row in np.array([*table.values()]).T.tolist()
    ]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path
