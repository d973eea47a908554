"""What pictures of the contact show, whoever draws them: colours, scales, ribbon."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from fegear.rendering.fields import ContactField
from fegear.rendering.frames import View
from fegear.rendering.gear_fields import GearField, PairField
from lumped.common.array_types import Array, Indices

Shown = Literal["von-mises", "principal", "displacement", "pressure", "root-stress"]
PLANE_SHOWN: tuple[Shown, ...] = "von-mises", "principal", "displacement", "pressure"
SIZE = (1920, 1080)  # pixels
HEADER, MARGIN = 0.10, 0.13  # parts of the picture for the title and the colour bar
RIBBON, ALONE = 0.16, 0.22  # height of the largest pressure over the view's half
ARROW = 0.11  # length of the largest mesh force over the view's half
ARROW_WIDTH, HEAD_WIDTH, HEAD_LENGTH = 0.05, 0.22, 0.35  # over that length
DRAWN_MOTION = 0.02  # the largest motion over the view's height
LARGEST_MOTION = 0.06  # modules of drawn motion, so that teeth stay in their gaps
CUT = 1.25  # of the ribbon, over the height of `RenderStyle.pressure`
BODY, RIBBON_COLOUR, INK = "#d5dbe1", "#d01c8b", "#202020"


@dataclass(frozen=True)
class Colours:
    """How a field is shown: its unit and colour map.

    quantity : attribute of a `GearField`
    clipped : whether the contact would hide the rest, so that colours end at the
        largest value in a fillet; signed : whether zero is in the middle
    """

    quantity: str
    title: str
    unit: str
    scale: float
    map: str
    clipped: bool = False
    signed: bool = False


COLOURS: dict[str, Colours] = {
    "von-mises": Colours(
        "von_mises", "von Mises\nstress", "MPa", 1e-6, "turbo", clipped=True
    ),
    "principal": Colours(
        "principal_1",
        "first principal\nstress",
        "MPa",
        1e-6,
        "RdBu_r",
        signed=True,
    ),
    "displacement": Colours(
        "elastic_shift", "elastic\ndisplacement", "um", 1e6, "viridis"
    ),
    "pressure": Colours("", "contact\npressure", "MPa", 1e-6, "plasma"),
    "root-stress": Colours("", "root\nstress", "MPa", 1e-6, "turbo"),
}


@dataclass(frozen=True)
class RenderStyle:
    """What is the same in all pictures of a film.

    motion_scale : drawn over true displacement
    limits : of the colours, in the unit shown
    largest : value of the field in view, in the unit shown
    pressure : that is drawn at the ribbon's full height, the peak of the pair with
        the largest load; a tip corner's own peak is cut off a little above [Pa]
    exact : whether this is all that is shown, not a choice of a film's frames
    force : mesh force that is drawn as an arrow of full length [N], None where the
        pressure is drawn instead
    """

    shown: Shown
    view: View
    motion_scale: float
    limits: tuple[float, float]
    largest: float
    pressure: float
    exact: bool = True
    force: float | None = None

    def still(self, motion_scale: float = 0.0) -> RenderStyle:
        """This look with another scale of motion, by default without motion."""
        return replace(self, motion_scale=motion_scale)

    @property
    def ribbon(self) -> float:
        """Full height of the pressure ribbon over the view's half height."""
        return ALONE if self.shown == "pressure" else RIBBON


def picture_aspect(size: tuple[int, int] = SIZE) -> float:
    """Width over height of the part of the picture that shows the gears."""
    return size[0] * (1.0 - MARGIN) / (size[1] * (1.0 - HEADER))


def look_of(
    fields: Sequence[ContactField],
    shown: Shown,
    view: View,
    module: float,
    motion_scale: float | None = None,
) -> RenderStyle:
    """Colours and scales that suit all of the fields; motion_scale None chooses."""
    gears = [gear for field in fields for gear in field.gears]
    if motion_scale is None:
        largest_value = max(
            np.hypot(*gear.motion[_is_in_view(gear, view)].T).max() for gear in gears
        )
        drawn_motion = min(
            DRAWN_MOTION * 2.0 * view.half_height, LARGEST_MOTION * module
        )
        motion_scale = round_down_to_1_2_5(drawn_motion / float(largest_value))
    fields_in_contact = [field for field in fields if field.pairs]
    most_loaded_pairs = [
        max(field.pairs, key=lambda pair: pair.load) for field in fields_in_contact
    ]
    pressure = max(
        (float(pair.pressure.max()) for pair in most_loaded_pairs), default=1.0
    )
    if shown == "pressure":
        peaks = [float(p.pressure.max()) for f in fields_in_contact for p in f.pairs]
        largest_value = max(peaks, default=pressure)
        scale = COLOURS[shown].scale
        limits = (
            0.0,
            scale * (largest_value if largest_value < CUT * pressure else pressure),
        )
        largest_value *= scale
    else:
        limits, largest_value = _colour_limits(gears, COLOURS[shown], view)
    is_exact = len(fields) == 1
    force = None
    if shown != "pressure" and fields[0].is_gear_set:
        forces = [force.load for field in fields for force in mesh_forces(field.pairs)]
        force = max(forces, default=1.0)
    return RenderStyle(
        shown, view, motion_scale, limits, largest_value, pressure, is_exact, force
    )


def _colour_limits(
    gears: Sequence[GearField], colours: Colours, view: View
) -> tuple[tuple[float, float], float]:
    """Range of the colours and the largest value in view."""
    largest_value, largest_in_fillet = 0.0, 0.0
    for gear in gears:
        is_in_view, values = (
            _is_in_view(gear, view),
            colours.scale * getattr(gear, colours.quantity),
        )
        largest_value = max(largest_value, float(values[is_in_view].max()))
        nodes = gear.fillet[is_in_view[gear.fillet]]
        largest_in_fillet = max(
            largest_in_fillet, float(values[nodes].max(initial=0.0))
        )
    upper_limit = (
        largest_in_fillet
        if colours.clipped and largest_in_fillet > 0.0
        else largest_value
    )
    upper_limit = upper_limit or 1.0  # nothing is loaded
    return (-upper_limit if colours.signed else 0.0, upper_limit), largest_value


def _is_in_view(gear: GearField, view: View) -> NDArray[np.bool_]:
    """Points (n,) that lie in the view."""
    return np.all(np.abs(gear.points - view.middle) < view.half, axis=1)


def round_down_to_1_2_5(value: float) -> float:
    """To 1, 2 or 5 times a power of ten, at least 1."""
    if not 1.0 < value < np.inf:
        return 1.0
    power = 10.0 ** np.floor(np.log10(value))
    return float(max(step * power for step in (1.0, 2.0, 5.0) if step * power <= value))


def ribbon_base(pair: PairField, look: RenderStyle) -> Array:
    """Positions at which the loaded contact nodes of a pair are drawn (n, 2)."""
    return pair.points + look.motion_scale * pair.motion


def ribbon_of(
    pairs: Sequence[PairField], look: RenderStyle
) -> tuple[Array, Indices, Array] | None:
    """The pressure of all pairs as an area over the driver's flank, None without.

    Points (n, 2) [m], quadrilaterals (m, 4) and the pressure at the points (n,) [Pa].
    """
    points, faces, pressure = [], [], []
    n_points = 0
    full_height = look.ribbon * look.view.half_height
    for pair in pairs:
        loaded_indices = np.flatnonzero(pair.pressure > 0.0)
        loaded_range = slice(max(0, loaded_indices[0] - 1), loaded_indices[-1] + 2)
        base_points, p = (
            ribbon_base(pair, look)[loaded_range],
            pair.pressure[loaded_range],
        )
        height = full_height * np.minimum(p / look.pressure, CUT)
        crest_points = base_points + height[:, None] * pair.normals[loaded_range]
        n = len(base_points)
        i = n_points + np.arange(n - 1)
        points += [base_points, crest_points]
        faces.append(np.stack([i, i + 1, i + 1 + n, i + n], axis=1))
        pressure.append(np.tile(p, 2))
        n_points += 2 * n
    if not points:
        return None
    return np.vstack(points), np.vstack(faces), np.concatenate(pressure)


@dataclass(frozen=True, eq=False)
class MeshForce:
    """Resultant of the pairs of one mesh.

    point : at which it acts, without load (2,); motion : of that point (2,) [m]
    direction : of the force on the driven gear (2,), of length 1
    load : [N]; pressure : largest of the pairs [Pa]
    """

    point: Array
    motion: Array
    direction: Array
    load: float
    pressure: float

    def base(self, look: RenderStyle) -> Array:
        """Where the point is drawn (2,)."""
        return self.point + look.motion_scale * self.motion

    def arrow(self, look: RenderStyle) -> Array:
        """Corners (7, 2) of an arrow, its tip in the middle."""
        length = ARROW * look.view.half_height * self.load / (look.force or self.load)
        along, across = self.direction, np.array([-1.0, 1.0]) * self.direction[::-1]
        full_length = (
            ARROW * look.view.half_height
        )  # a small force has as wide an arrow
        neck_length = max(length - HEAD_LENGTH * full_length, 0.0)
        half_width, half_head_width = (
            0.5 * ARROW_WIDTH * full_length,
            0.5 * HEAD_WIDTH * full_length,
        )
        corners = [
            (0.0, half_width),
            (neck_length, half_width),
            (neck_length, half_head_width),
            (length, 0.0),
        ]
        corners += [(x, -y) for x, y in corners[2::-1]]
        return self.base(look) + [x * along + y * across for x, y in corners]


def mesh_forces(pairs: Sequence[PairField]) -> list[MeshForce]:
    """Resultant of each mesh with contact, in the order of the meshes."""
    forces = []
    for mesh in sorted({pair.mesh for pair in pairs}):
        mesh_pairs = [pair for pair in pairs if pair.mesh == mesh]
        weights = np.array([pair.load for pair in mesh_pairs])
        weights /= weights.sum()
        direction = sum(
            weight * (pair.pressure @ pair.normals)
            for weight, pair in zip(weights, mesh_pairs, strict=True)
        )
        tops = [int(pair.pressure.argmax()) for pair in mesh_pairs]
        motions = [pair.motion[top] for pair, top in zip(mesh_pairs, tops, strict=True)]
        forces.append(
            MeshForce(
                point=weights @ [pair.center for pair in mesh_pairs],
                motion=weights @ motions,
                direction=direction / np.hypot(*direction),
                load=sum(pair.load for pair in mesh_pairs),
                pressure=max(float(pair.pressure.max()) for pair in mesh_pairs),
            )
        )
    return forces


def palette(shown: Shown) -> NDArray[np.uint8]:
    """All colours of a picture (256, 3), for files that hold no more."""
    from matplotlib import colormaps
    from matplotlib.colors import to_rgb

    painted = colormaps[COLOURS[shown].map](np.linspace(0.0, 1.0, 200))[:, :3]
    white, shades = np.ones(3), np.linspace(0.0, 1.0, 28)[:, None]
    mixed = [
        np.array(to_rgb(colour)) * (1.0 - shades) + shades * white
        for colour in (INK, RIBBON_COLOUR)
    ]
    return np.round(255.0 * np.vstack([painted, *mixed])).astype(np.uint8)
