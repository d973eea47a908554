"""Drawings (.dxf) of closed curves in millimetres, for CAD."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fegear.files.output import write_whole

NO_LAYER = re.compile(r'[<>/\\":;?*|=,`\x00-\x1f\x7f]')  # what no layer's name has


def write_dxf(path: Path, curves: Mapping[str, NDArray[Any]]) -> None:
    """Write closed curves (n, 2) [mm], each on a layer of its name.

    A curve with a point that is not finite is left out. Raises InputError where the
    file cannot be written.
    """
    import ezdxf
    from ezdxf import units

    ezdxf.options.write_fixed_meta_data_for_testing = True  # neither date nor user
    drawing = ezdxf.new("R2000", units=units.MM)
    space = drawing.modelspace()
    for name, points in curves.items():
        if not np.isfinite(points).all():
            continue
        layer = NO_LAYER.sub("_", name)
        if layer not in drawing.layers:
            drawing.layers.add(layer)
        space.add_lwpolyline(points, close=True, dxfattribs={"layer": layer})
    write_whole(path, lambda place: drawing.saveas(place))
