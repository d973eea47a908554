"""Linear answer of signals to gaps that open in meshes.

A gap g that opens in a mesh takes k g from its force, k its mean stiffness. By the
modes of the train about the mean stiffnesses, coordinates x answer at the angular
frequency w with

    x = sum_n v_n (a . v_n) k g / (w_n^2 - w^2 + 2 i zeta w_n w)

where a is the row of the mesh. Loss of contact and the variation of stiffness are left
out.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from lumped.common.array_types import Array
from lumped.train.system import LumpedSystem


def signal_receptances(
    system: LumpedSystem,
    names: Sequence[str],
    meshes: Sequence[int],
    frequency: Array,
) -> tuple[NDArray[np.intp], NDArray[np.complex128]]:
    """Transmission errors and speed deviations per gap of meshes.

    Parameters
    ----------
    system : LumpedSystem
        Train, whose gears move in the plane.
    names : sequence of str
        Names of signals, as of `lumped.signals.sensors.signal_names`.
    meshes : sequence of int
        Indices (m,) of the meshes with gaps, from 0.
    frequency : (f,) array
        Frequencies [Hz].

    Returns
    -------
    signals : (s,) array of int
        Places in `names` of the signals that are transmission errors or speeds.
    receptance : (f, s, m) array of complex
        Their amplitudes per gap, [m/m] and [rad/s/m].
    """
    rows, is_rate, signals = [], [], []
    of_name = _rows_of_signals(system)
    for place, name in enumerate(names):
        if name in of_name:
            row, rate = of_name[name]
            rows.append(row)
            is_rate.append(rate)
            signals.append(place)
    modes = system.modes
    strained = modes.angular > 0.0
    natural, shapes = modes.angular[strained], modes.shapes[:, strained]
    stiffness = np.asarray([system.excitations[m].mean_stiffness for m in meshes])
    force = modes.mesh_shapes[np.asarray(meshes)][:, strained] * stiffness[:, None]
    angular = 2.0 * np.pi * np.asarray(frequency)[:, None]
    damping = 2.0j * system.train.damping_ratio * natural * angular
    flexibility = 1.0 / (natural**2 - angular**2 + damping)
    at_signals = np.asarray(rows).reshape(len(rows), -1) @ shapes
    answer = np.einsum("fn,sn,mn->fsm", flexibility, at_signals, force)
    rates = np.where(np.asarray(is_rate, bool)[:, None], 1j * angular[..., None], 1.0)
    return np.asarray(signals, np.intp), answer * rates


def _rows_of_signals(system: LumpedSystem) -> dict[str, tuple[Array, bool]]:
    """Rows (N,) of signals by name, and whether they are rates."""
    train = system.train
    rows = {
        f"mesh{number}_dte_m": (row, False)
        for number, row in enumerate(system.modes.coordinates.mesh_rows, 1)
    }
    for number, gear in enumerate(train.gears):
        rotation = system.rotation_row(number)
        if rotation is not None:
            name = f"{gear.name}_speed_deviation_rad_per_s"
            rows[name] = (train.sense(number) * rotation, True)
    return rows
