"""The result of `fegear wear` where loads vary over the face width."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any, ClassVar

import numpy as np

from fegear.commands.wear.face_figure import draw_worn_faces
from fegear.commands.wear.faces import WearingFaces
from fegear.commands.wear.result import CHANGES, GEARS, FlankWearResult
from fegear.contact.path import contact_diameters
from fegear.studies.page import Columns, cell
from fegear.studies.result import Draw
from lumped.common.array_types import Array
from lumped.common.units import MM, UM


@dataclass(frozen=True, eq=False)
class FaceWearResult(FlankWearResult):
    """Depth of wear over profile and face width of both flanks.

    slice_error : of what a passage takes off at the beginning, relative
    """

    losses: ClassVar[Columns] = {
        **GEARS,
        "at place\n[mm]": cell("at_place_mm", 4),
        "mean depth\nof wear [um]": cell("mean_depth_um"),
    }
    changes: ClassVar[Columns] = {
        **CHANGES,
        "K_Hbeta": cell("load_distribution_factor", 4),
    }
    error_text: ClassVar[str] = (
        "depth of wear, estimated error: by steps {steps:.1e} of the largest, by "
        "positions {positions:.1e} and by slices {slices:.1e} of the mean; worn volume "
        "against sliding work {volume_balance:.1e}"
    )

    mesh: WearingFaces
    slice_error: float

    @cached_property
    def _errors(self) -> dict[str, float]:
        return super()._errors | {"slices": self.slice_error}

    def _gear_values(self, row: int) -> dict[str, Any]:
        depth = self.worn.depth
        place = int(depth[row].argmax()) % depth.shape[-1]
        touched = self.mesh.worn_areas(np.ones_like(depth))
        mean = self.mesh.worn_areas(depth) / touched
        return super()._gear_values(row) | {
            "at_place_mm": float(self.mesh.places[row, place]) / MM,
            "mean_depth_um": float(mean[row]) / UM,
        }

    def _columns(self, row: int) -> dict[str, Array]:
        """Columns of a gear, by increasing roll angle and place."""
        mesh, first, last = self.mesh, self.worn.first, self.worn.last
        position, places = mesh.points.position, mesh.places[row]
        of_points = {
            "roll_angle_deg": np.degrees(mesh.roll_angles[row]),
            "diameter_m": contact_diameters(mesh.pair, position)[row],
            "position": position,
            "specific_sliding": mesh.specific_sliding[row],
        }
        columns: dict[str, Any] = {
            "gear": np.full(position.size * places.size, self.names[row]),
            "place_m": np.tile(places, position.size),
        }
        order = np.argsort(mesh.roll_angles[row])
        for name, values in of_points.items():
            columns[name] = np.repeat(values[order], places.size)
        of_faces = {
            "wear_depth_m": self.worn.depth[row],
            "wear_of_first_turn_m": mesh.depth_per_passage(first)[row],
            "wear_of_last_turn_m": mesh.depth_per_passage(last)[row],
            "first_line_load_N_per_m": first.line_load,
            "last_line_load_N_per_m": last.line_load,
        }
        for name, values in of_faces.items():
            columns[name] = values[order].ravel()
        return columns

    @property
    def figures(self) -> Mapping[str, Draw]:
        draw = partial(draw_worn_faces, self.mesh, self.worn, self.names, self._title)
        return {"plot": draw}
