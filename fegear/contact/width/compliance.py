"""Compliance between the parts of all lines of contact at one position.

A flank yields near a force like a half-space, and smoothly elsewhere: see
`fegear.elasticity.wide_flank`. Between parts of one line of contact the mean of 1 / R
over both is had in closed form, and what the decay takes away is taken at their
middles. A part's own contact is as long as it is and 2 a wide, with the pressure of
Hertz across it. With the mean of ln|x| over that pressure, ln(a / 2) - 1 / 2, its
middle yields as under a line force at a distance of x = a / (2 sqrt(e)).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fegear.contact.plane.kernels.patches import CORNER_WIDTH, MIN_CORNER_WIDTH
from fegear.contact.width.contact import WidthContact
from fegear.contact.width.supports import unit_wrenches
from fegear.elasticity.flank import MAX_TOOTH_OFFSET
from fegear.elasticity.flank_grid import flank_stencils
from fegear.elasticity.line_kernel import LineKernel
from fegear.elasticity.wide_flank import WideFlank
from fegear.elasticity.width_functions import polynomial_values
from lumped.common.array_types import Array, Indices
from meshes import SpurGear

SHORT, LONG = 4.0, 9.0  # part over the size of contacts; own sizes count if long
# of Gauss quadrature over a part
PART_NODES, PART_WEIGHTS = np.polynomial.legendre.leggauss(3)
TINY = 1e-30  # load [N] in place of none
POINT = 1e-6  # decay lengths in place of no distance, where an integral is finite


@dataclass(frozen=True, eq=False)
class LineParts:
    """Parts (p,) of lines of contact.

    pair : index of the tooth pair
    place : middle along the axis, from that of the common width [m]
    length : of the line of contact [m]
    arcs : (p, 2) of the middle on driver and driven gear [m]
    radius : of relative curvature [m]
    angle : by which a corner is turned from its mate's flank [rad], else 0
    """

    pair: Indices
    place: Array
    length: Array
    arcs: Array
    radius: Array
    angle: Array

    def chosen(self, index: Indices | NDArray[np.bool_]) -> LineParts:
        """Take some of the parts."""
        return LineParts(
            pair=self.pair[index],
            place=self.place[index],
            length=self.length[index],
            arcs=self.arcs[index],
            radius=self.radius[index],
            angle=self.angle[index],
        )

    @property
    def is_same_line(self) -> NDArray[np.bool_]:
        """Whether two parts (p, p) are of one line."""
        return np.asarray(self.pair[:, None] == self.pair[None, :])


@dataclass(frozen=True, eq=False)
class FaceCompliance:
    """Compliance of two gears between parts of their lines of contact.

    gears : driver and driven
    """

    face: WidthContact
    gears: tuple[SpurGear, SpurGear]

    @cached_property
    def helix_cosine(self) -> float:
        return math.cos(self.face.driver.kernel.base_helix_angle)

    def near(self, parts: LineParts, size: float) -> Array:
        """The half-space's share (p, p) but for images, of both gears [m/N].

        On a part itself only what the decay takes away.

        size : x of contacts in the other parts, above 0 [m]
        """
        near = np.zeros((parts.pair.size, parts.pair.size))
        for pair in np.unique(parts.pair):
            index = np.flatnonzero(parts.pair == pair)
            near[np.ix_(index, index)] = self._near_on_line(parts.chosen(index), size)
        return near

    def _near_on_line(self, parts: LineParts, size: float) -> Array:
        middle = parts.place / self.helix_cosine
        apart = np.abs(np.subtract.outer(middle, middle))
        np.einsum("ii->i", apart)[:] = 1.0
        mean = self._mean_over_parts(parts, np.full_like(apart, size))
        near = np.zeros_like(mean)
        for flank in self.face.flanks:
            decay, modulus = flank.kernel.decay, flank.kernel.modulus
            lost = np.expm1(-apart / decay) / apart
            ratio = parts.length / decay
            # the mean of (1 - exp(-R / d)) / R over two places in a part
            lost_itself = 1.0 - ratio / 6.0 + ratio**2 / 36.0 - ratio**3 / 240.0
            of_gear = mean + lost
            np.einsum("ii->i", of_gear)[:] = -lost_itself / decay
            near += of_gear / (math.pi * modulus)
        for gear, flank in enumerate(self.face.flanks):
            near += flank.kernel.tip_image * self._at_tip(gear, flank, parts, size)
        return near

    def _mean_over_parts(self, parts: LineParts, size: Array) -> Array:
        """Mean of 1 / sqrt(dz^2 + size^2) (p, p) over both parts of one line [1/m]."""
        middle, half = parts.place / self.helix_cosine, 0.5 * parts.length
        ends = middle - half, middle + half
        return _mean_inverse(ends, ends, size)

    def _at_tip(
        self, gear: int, flank: WideFlank, parts: LineParts, size: float
    ) -> Array:
        """The half-space's share of an image at the tip corner (p, p) [m/N]."""
        kernel, middle = flank.kernel, parts.place / self.helix_cosine
        distance = np.sqrt(size**2 + self._farther(gear, kernel, parts))
        apart = np.hypot(np.subtract.outer(middle, middle), distance)
        mean = self._mean_over_parts(parts, distance)
        lost = np.expm1(-apart / kernel.decay) / apart
        return np.asarray((mean + lost) / (math.pi * kernel.modulus))

    def _farther(self, gear: int, kernel: LineKernel, parts: LineParts) -> Array:
        arcs, teeth = parts.arcs[:, gear], self.gears[gear]
        squared = np.maximum(
            teeth.tip_roll_length**2 - 2.0 * teeth.base_radius * arcs, 0.0
        )
        metric = 1.0 + kernel.twist**2 * (squared + teeth.base_radius**2)
        rolls, metrics = (
            np.sqrt(np.outer(values, values)) for values in (np.sqrt(squared), metric)
        )
        return kernel.farther(arcs[:, None], arcs, rolls, metrics)

    def between(self, teeth: Indices, parts: LineParts) -> Array:
        """Displacement (p, p) [m/N] of parts under forces, without what is `near`.

        teeth : (pairs,) base pitches by which each pair is ahead
        """
        ahead = teeth[parts.pair]
        total = np.zeros((ahead.size, ahead.size))
        for gear, flank in enumerate(self.face.flanks):
            rows = self._rows(gear, flank, parts)
            # ahead is to the right on the driver, to the left on the driven gear
            sign = 1 if gear == 0 else -1
            offset = sign * (ahead[:, None] - ahead[None, :])
            for value in np.unique(offset):
                if abs(value) > MAX_TOOTH_OFFSET:
                    continue
                table = flank.normal[MAX_TOOTH_OFFSET + value]
                part = _quadratic_form(rows, table)
                total += np.where(offset == value, part, 0.0)
            images = self._images(gear, flank, parts)
            total += np.where(offset == 0, images, 0.0)
        # bearings alone may push otherwise than they are pushed
        of_supports = self.of_supports(self.unit_wrenches(parts))
        return 0.5 * (total + total.T) + of_supports + self.of_torsion(parts)

    def unit_wrenches(self, parts: LineParts) -> tuple[Array, Array]:
        """See `fegear.contact.width.supports.unit_wrenches`."""
        helix = self.face.driver.kernel.base_helix_angle
        driver, driven = (parts.place + offset for offset in self.face.offsets)
        return unit_wrenches(self.gears, helix, parts.arcs, (driver, driven))

    def of_supports(self, wrenches: tuple[Array, Array]) -> Array:
        """Share (p, p) of axes that yield, by the wrenches of the parts [m/N]."""
        if self.face.supports is None:
            return np.zeros((len(wrenches[0]), len(wrenches[0])))
        return self.face.supports.compliance_between(wrenches)

    def of_torsion(self, parts: LineParts) -> Array:
        """Share (p, p) of bodies that twist over their face widths [m/N]."""
        total = np.zeros((parts.place.size, parts.place.size))
        if self.face.supports is None:
            return total
        of_gears = zip(
            self.gears, self.face.supports.gears, self.face.offsets, strict=True
        )
        for gear, support, offset in of_gears:
            if support.torsion is not None:
                lever = self.helix_cosine * gear.base_radius
                places = parts.place + offset
                total += lever**2 * support.torsion.between(places, places)
        return total

    def moved_away(self, parts: LineParts, load: Array) -> Array | None:
        """Gap along the normal (p,) that axes open which yield under forces (p,) [m].

        None where axes are held.
        """
        if self.face.supports is None:
            return None
        return self.face.supports.opened_by(self.unit_wrenches(parts), load)

    def support_gap(self, parts: LineParts) -> Array:
        """Gap along the normal that loads elsewhere open, over torque (p,) [1/N]."""
        if self.face.supports is None:
            return np.zeros(parts.place.size)
        return self.face.supports.gap(self.unit_wrenches(parts))

    def rootward(self, parts: LineParts) -> Array:
        """Displacement (p, p) of lines toward the roots under their own forces [m/N].

        The sum over both gears; the yielding near a force has none.
        """
        total = np.zeros((parts.pair.size, parts.pair.size))
        for gear, flank in enumerate(self.face.flanks):
            table = flank.tangential[MAX_TOOTH_OFFSET]
            total += _quadratic_form(self._rows(gear, flank, parts), table)
        return np.where(parts.is_same_line, total, 0.0)

    def _rows(self, gear: int, flank: WideFlank, parts: LineParts) -> Array:
        """Share (p, n k) of each point and polynomial in a part's displacement."""
        points, count = flank.normal.shape[1:3]
        grid = flank.flank_length, flank.grading, points, flank.both_ends
        first, weight = flank_stencils(parts.arcs[:, gear], *grid)
        functions = self._mean_functions(gear, flank, parts)
        rows = np.zeros((len(first), points, count))
        at = np.arange(len(first))[:, None], first
        rows[at] = weight[:, :, None] * functions[:, None, :]
        return rows.reshape(len(first), points * count)

    def _mean_functions(self, gear: int, flank: WideFlank, parts: LineParts) -> Array:
        """Mean of the polynomials over each part (p, k)."""
        half = 0.5 * self.helix_cosine * parts.length[:, None]
        z = parts.place[:, None] + self.face.offsets[gear] + half * PART_NODES
        values, _ = polynomial_values(flank.width, flank.degree, z.ravel())
        by_point = values.reshape(*z.shape, -1)
        return np.asarray(np.einsum("q,pqk->pk", 0.5 * PART_WEIGHTS, by_point))

    def _images(self, gear: int, flank: WideFlank, parts: LineParts) -> Array:
        """The half-space's share of images at both ends of the width (p, p) [m/N].

        Those of images at the tip corner among them.
        """
        kernel, teeth, arcs = flank.kernel, self.gears[gear], parts.arcs[:, gear]
        z = parts.place + self.face.offsets[gear]
        half = 0.5 * self.helix_cosine * parts.length
        squared_radius = teeth.tip_radius**2 - 2.0 * teeth.base_radius * arcs
        metric = np.sqrt(1.0 + kernel.twist**2 * squared_radius)
        scale = np.sqrt(np.outer(metric, metric))
        apart = np.abs(np.subtract.outer(arcs, arcs))
        at_tip = np.sqrt(apart**2 + self._farther(gear, kernel, parts))
        total = np.zeros_like(apart)
        for sign, strength in zip((-1.0, 1.0), kernel.images, strict=True):
            from_end = 0.5 * flank.width - sign * z
            image = _image_at_end(kernel, from_end, half, scale, apart)
            image += kernel.tip_image * _image_at_end(
                kernel, from_end, half, scale, at_tip
            )
            total += strength * image
        return total

    @cached_property
    def softness(self) -> float:
        """1 / (pi E*) of both gears [1/Pa]."""
        return sum(1.0 / flank.kernel.modulus for flank in self.face.flanks) / math.pi

    def contact_size(self, load: Array, parts: LineParts) -> tuple[Array, Array]:
        """x of the contacts of parts under normal forces [N], (p,) [m].

        And its exponent, d ln x / d ln load. A corner touches over less, see
        `fegear.contact.plane.kernels.patches.corner_width`.
        """
        per_length = load / parts.length
        size = np.sqrt(4.0 * per_length * parts.radius * self.softness)
        wedge = CORNER_WIDTH * math.pi * self.softness * per_length
        ratio = 0.5 * size * parts.angle / wedge
        root = np.hypot(1.0, ratio)
        share = np.maximum(1.0 / (root + ratio), MIN_CORNER_WIDTH)
        exponent = 0.5 * (1.0 + ratio / root)
        return size * share / (2.0 * math.sqrt(math.e)), exponent

    def own_contact(
        self, load: Array, parts: LineParts, size: float
    ) -> tuple[Array, Array]:
        """Approach (p,) [m] of parts by their own contact, and its slope [m/N].

        The contact of a short part is as wide as that of the others. If its width
        followed its own load, the other loads would move it more than its own does.

        load : (p,) normal forces above 0 [N]
        size : as of `near` [m]
        """
        own_size, exponent = self.contact_size(load, parts)
        length = parts.length / size
        share = np.clip((length - SHORT) / (LONG - SHORT), 0.0, 1.0)
        x = size * (own_size / size) ** share / parts.length
        exponent = share * exponent
        root = np.hypot(1.0, x)
        mean = 2.0 * (np.arcsinh(1.0 / x) - root + x)
        slope = 2.0 * (1.0 - root / x)  # over x
        per_load = self.softness / parts.length
        return per_load * mean * load, per_load * (mean + exponent * x * slope)

    def pressure(self, load: Array, parts: LineParts) -> Array:
        """Largest pressure (p,) of parts [Pa], of Hertz."""
        size, _ = self.contact_size(np.maximum(load, TINY), parts)
        half_width = 2.0 * math.sqrt(math.e) * size
        return np.asarray(2.0 * load / parts.length / (math.pi * half_width))


def _quadratic_form(rows: Array, table: Array) -> Array:
    size = rows.shape[1]
    return np.asarray(rows @ table.reshape(size, size) @ rows.T)


def _image_at_end(
    kernel: LineKernel, from_end: Array, half: Array, scale: Array, apart: Array
) -> Array:
    """The half-space's share (p, p) of images at an end of the width [m/N].

    from_end, half : middles (p,) of parts from the end and half their lengths, on the
        axis; scale : (p, p) of distances along it; apart : across it [m]
    """
    size = np.maximum(apart, POINT * kernel.decay)
    low, high = from_end - half, from_end + half
    # images are as far beyond the end
    mean = _mean_inverse((low, high), (-high, -low), size / scale) / scale
    distance = np.hypot(scale * np.add.outer(from_end, from_end), size)
    lost = np.expm1(-distance / kernel.decay) / distance
    return np.asarray((mean + lost) / (math.pi * kernel.modulus))


def _mean_inverse(
    one: tuple[Array, Array], two: tuple[Array, Array], size: Array
) -> Array:
    """Mean of 1 / sqrt(dz^2 + size^2) (p, p) between lines [1/m].

    one, two : lower and upper ends (p,) of lines along z [m]
    """

    def integral(place: Array, other: Array) -> Array:
        return _second_integral(np.subtract.outer(place, other), size)

    (low, high), (other_low, other_high) = one, two
    both = integral(high, other_low) - integral(low, other_low)
    both += integral(low, other_high) - integral(high, other_high)
    return np.asarray(both / np.outer(high - low, other_high - other_low))


def _second_integral(place: Array, size: Array) -> Array:
    """Second integral of 1 / sqrt(place^2 + size^2)."""
    return np.asarray(place * np.arcsinh(place / size) - np.hypot(place, size))
