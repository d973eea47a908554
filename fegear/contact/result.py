"""The solution of a contact problem over a mesh cycle, with loads over the face width.

Every array says once which axes it has and what a pair without contact has in it; those
of a cycle also say how back flanks are seen from the drive side. Cycles are made empty,
joined and mirrored by that.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, TypeVar, get_type_hints

import numpy as np
from numpy.typing import NDArray

from lumped.common.array_types import Array, Indices
from lumped.common.short_repr import ShortRepr

BANDS = 24  # of the common width, in whose parts largest loads are means
REVERSED, THROUGH_BACKLASH = "reversed", "through the backlash"
Values = TypeVar("Values", bound="ContactCycle | FaceLoads")


def largest_of_bands(values: Array) -> Array:
    """Largest means of values of slices (..., m) over a band of the width (...).

    At a sharp edge the load per length grows with the number of slices without limit;
    what a band carries does not.
    """
    return np.asarray(band_means(values).max(axis=-1))


def band_means(values: Array) -> Array:
    """Means (..., b) of values of slices (..., m) over bands of the width.

    A band is a part in BANDS of the width anywhere, or a slice where that is wider. The
    largest mean is that of a band that begins or ends at an end of a slice.
    """
    slices = values.shape[-1]
    length = max(1.0, slices / BANDS)  # of a band, in slices
    edges = np.arange(slices + 1.0)
    starts = np.concatenate([edges, edges - length])
    starts = starts[(starts >= 0.0) & (starts <= slices - length)]
    sums = np.zeros((*values.shape[:-1], slices + 1))
    np.cumsum(values, axis=-1, out=sums[..., 1:])

    def sum_to(place: Array) -> Array:
        index = np.minimum(place.astype(np.int64), slices - 1)
        part = place - index
        return (1.0 - part) * sums[..., index] + part * sums[..., index + 1]

    return np.asarray((sum_to(starts + length) - sum_to(starts)) / length)


@dataclass(frozen=True)
class Over:
    """Axes of a field, its value without contact, and its change on back flanks.

    axes : letters of torques (t), positions (n), pairs (k), slices (m) and both gears
        or ends (g), of positions at which slopes were asked for (s), of sizes of a
        lead (l), of sought depths of a topography (h), of changes of the flanks (c)
        and of motions of an axis (a)
    empty : value of a pair without contact, and where nothing is filled in
    back : seen from the drive side on back flanks: REVERSED, THROUGH_BACKLASH or as is
    """

    axes: str
    empty: float = 0.0
    back: str = ""

    def axis(self, *letters: str) -> int | None:
        """The first of these axes, None where there is none."""
        places = (i for i, letter in enumerate(self.axes) if letter in letters)
        return next(places, None)


@dataclass(frozen=True, eq=False)
class FaceLoads(ShortRepr):
    """Loads over the face width at torques (t), positions (n), pairs (k), slices (m).

    There is one slice where loads are uniform over the width. On back flanks all is as
    in a mirror, where these are drive flanks.

    Parameters
    ----------
    width : float
        Common face width [m].
    base_helix_angle : float
        Base helix angle of the driver [rad], reversed where it turns clockwise.
    place : (m,) array
        Middles of the slices, from the middle of the common width [m].
    teeth : (k,) array of int
        Base pitches by which each pair is ahead.
    reference_position : (n, m) array
        Positions of the reference pair's slices on the path of contact [base pitches].
    on_path : (n, k, m) array of bool
        Whether flanks touch there, away from the ends of the path.
    load : (t, n, k, m) array
        Normal force per length of the line of contact [N/m].
    pressure : (t, n, k, m) array
        Largest contact pressure [Pa], in the plane of the compliances.
    arc : (t, n, k, m, 2) array
        Of the loads, or of the closest points, from the tip corners of driver and
        driven [m].
    coupling : (t, n, k, k) array
        What pairs yield under the loads of others, per force in the section and along
        the line of action [m/N]; zero on the diagonal. Of no pairs where loads are
        uniform.
    load_change : (t, s, k, m, c) array
        Slopes of the load by the changes of `fegear.contact.width.flank_changes`
        [N/m^2]; of no positions where they were not asked for.
    rigid_stiffness : (t, n, 11, 11) array
        Stiffness of the teeth at the load against rigid motions of both gears: slopes
        of the loads that belong to the transmission error and to the motions of the
        axes of driver and driven gear, see `fegear.contact.width.supports`. Of no
        motions where axes are held.
    axis_loads : (t, n, 2, 5) array
        Loads on driver and driven gear that belong to the motions of their axes. Of no
        motions where loads are uniform.
    groove : float
        Width between the halves of double helical gears, in the middle, else 0 [m].
    """

    width: float
    base_helix_angle: float
    place: Array
    teeth: Indices
    reference_position: Annotated[Array, Over("nm")]
    on_path: Annotated[NDArray[np.bool_], Over("nkm", empty=False)]
    load: Annotated[Array, Over("tnkm")]
    pressure: Annotated[Array, Over("tnkm")]
    arc: Annotated[Array, Over("tnkmg")]
    coupling: Annotated[Array, Over("tnkk")]
    load_change: Annotated[Array, Over("tskmc")]
    rigid_stiffness: Annotated[Array, Over("tnqq")]
    axis_loads: Annotated[Array, Over("tnga")]
    groove: float = 0.0

    @property
    def is_uniform(self) -> bool:
        """Whether loads are uniform over the face width, in one slice."""
        return self.place.size == 1

    @property
    def path_position(self) -> Array:
        """Positions of slices on the path of contact (n, k, m) [base pitches]."""
        return np.asarray(self.reference_position[:, None] + self.teeth[:, None])

    @property
    def helix_width(self) -> float:
        """Width along one helix, of double helical gears that of a half [m]."""
        return 0.5 * self.width if self.groove else self.width

    @property
    def slice_length(self) -> float:
        """Length of the line of contact in a slice [m]."""
        return self.width / self.place.size / math.cos(self.base_helix_angle)

    @property
    def per_width(self) -> Array:
        """Force in the section per face width, of all pairs (t, n, m) [N/m]."""
        # the cosine of the direction and that of the line's length are the same
        return np.asarray(self.load.sum(axis=2))

    @property
    def distribution_factor(self) -> Array:
        """Load distribution factor K_Hbeta (t,), of the mean over the cycle.

        The largest mean load over a band of the width, see `largest_of_bands`, over the
        mean of all.
        """
        mean = self.per_width.mean(axis=1)
        return largest_of_bands(mean) / mean.mean(axis=1)

    @property
    def slice_factor(self) -> Array:
        """Factor as `distribution_factor`, of the largest slice, which has no limit."""
        mean = self.per_width.mean(axis=1)
        return np.asarray(mean.max(axis=1) / mean.mean(axis=1))

    @property
    def axial_force_on_driver(self) -> Array:
        """Axial force on the driver, positive toward the far end (t, n) [N].

        Those of the halves of double helical gears cancel.
        """
        if self.groove:
            return np.zeros(self.load.shape[:2])
        normal = self.load.sum(axis=(2, 3)) * self.slice_length
        return np.asarray(-normal * math.sin(self.base_helix_angle) + 0.0)

    @property
    def center(self) -> Array:
        """Centre of the force in the section along the axis (t, n) [m]."""
        of_slices = self.per_width
        return np.asarray((of_slices @ self.place) / of_slices.sum(axis=2))


@dataclass(frozen=True)
class ContactCycle(ShortRepr):
    """Contact over positions (n,) of a mesh cycle at torques (t,) on the driver.

    position : base pitches from the pitch point of the reference pair
    teeth : (k,) base pitches by which each pair is ahead of the reference pair, of the
        one in the same base pitch where pairs count anew in each
    face : loads over the face width
    ste : (t, n) static transmission error, the driver's rotation times its
        base radius with the driven gear held [m]; negative on the back side
    no_load : (t, n) the same without load [m]
    local_stiffness : (t, n) slope of force over transmission error [N/m]
    load : (t, n, k) normal force of each pair [N], of helical teeth in the section
    load_slope : (t, n, k) its slope over the transmission error, while all pairs are
        pressed together [N/m]
    relief_slope : (t, n, 2, 2, 2) derivatives of the transmission error with respect
        to magnitude [m] and start roll length [m] of tip and root relief of driver and
        driven gear, nodes of the patches in place; 0 for flanks without relief; (t, 0,
        2, 2, 2) where they were not asked for
    profile_slope : (t, n, 2, 2) the same with respect to crowning and slope [m] of the
        profiles of driver and driven gear, at fixed moment arms; 0 for flanks without
        profile; (t, 0, 2, 2) where they were not asked for
    lead_slope : (t, n, 2, 4) the same with respect to crowning, slope, end relief and
        its length [m] of the leads of driver and driven gear; 0 for flanks without
        lead; (t, 0, 2, 4) where they were not asked for
    topography_slope : (t, n, 2, h) the same with respect to the depths [m] of the
        topographies of driver and driven gear, those of one roll length after another,
        where they are sought
    gap : (t, n, k) transmission error that closes each pair [m]; infinite where its
        flanks do not face each other
    pressure : (t, n, k) largest contact pressure [Pa]
    friction_bending : (t, n, k) reduction of a pair's deflection by friction toward
        the tooth roots, per unit friction force, over its deflection per unit
        normal force; NaN where the pair carries no load
    arc : (t, n, k, 2) of the load's centre, or of the closest point, from the tip
        corners of driver and driven [m]
    turn : (t, n, k, 2) sine of the angle by which a corner's force is turned from the
        normal of its flank toward its root, on driver and driven; else 0
    closing : (t, n, k) penetration per transmission error, 1 on the nominal path of
        flanks without relief
    driven_torque : (t, n) reaction of the driven gear [N m]
    residual : (t, n) of the complementarity problem, relative
    axial_float : (t, n) of a driver with two helices that is free along its axis,
        positive toward the far end [m]; 0 of others
    """

    torque: Array
    position: Array
    teeth: Indices
    base_radius: float
    face: FaceLoads
    ste: Annotated[Array, Over("tn", back=THROUGH_BACKLASH)]
    no_load: Annotated[Array, Over("tn", back=THROUGH_BACKLASH)]
    local_stiffness: Annotated[Array, Over("tn")]
    load: Annotated[Array, Over("tnk", back=REVERSED)]
    load_slope: Annotated[Array, Over("tnk")]
    relief_slope: Annotated[Array, Over("tsggg")]
    profile_slope: Annotated[Array, Over("tsgg")]
    lead_slope: Annotated[Array, Over("tsgl")]
    topography_slope: Annotated[Array, Over("tsgh")]
    gap: Annotated[Array, Over("tnk", math.inf, THROUGH_BACKLASH)]
    pressure: Annotated[Array, Over("tnk")]
    friction_bending: Annotated[Array, Over("tnk", math.nan)]
    arc: Annotated[Array, Over("tnkg")]
    turn: Annotated[Array, Over("tnkg")]
    closing: Annotated[Array, Over("tnk", 1.0)]
    driven_torque: Annotated[Array, Over("tn", back=REVERSED)]
    residual: Annotated[Array, Over("tn")]
    axial_float: Annotated[Array, Over("tn")]

    @property
    def mesh_force(self) -> Array:
        """Torque over the driver's base radius, (t, 1) [N]."""
        return self.torque[:, None] / self.base_radius

    @property
    def stiffness(self) -> Array:
        """Average slope of force over transmission error, (t, n) [N/m]."""
        return self.mesh_force / (self.ste - self.no_load)

    @property
    def pair_stiffness(self) -> Array:
        """Average slope of each pair, zero where it carries no load (t, n, k)."""
        deflection = self.ste[..., None] - self.gap
        loaded = self.load != 0.0
        return np.where(loaded, self.load, 0.0) / np.where(loaded, deflection, 1.0)

    @property
    def load_share(self) -> Array:
        """Part of the normal force that each pair carries, (t, n, k)."""
        return self.load / self.load.sum(axis=2, keepdims=True)

    def corner_pairs(self, torque: int) -> NDArray[np.bool_]:
        """Whether a loaded pair (n, k) touches off the path, or near its end.

        In all of its loaded slices, at one torque, by its index.
        """
        loaded, on_path = self.face.load[torque] != 0.0, self.face.on_path
        return np.asarray(loaded.any(axis=2) & ~(loaded & on_path).any(axis=2))

    def corner_positions(self, torque: int) -> NDArray[np.bool_]:
        """Positions (n,) at which there is one of `corner_pairs`."""
        return np.asarray(self.corner_pairs(torque).any(axis=1))

    def of_back_flanks(
        self, torque: Array, position: Array, backlash: float
    ) -> ContactCycle:
        """Cycle of drive flanks in the mirror as back flanks, seen from the drive side.

        torque : (t,) on the driver, negative [N m]; position : (n,) of the drive side
        """
        changed: dict[str, Any] = {"torque": torque, "position": position}
        changed["teeth"] = -self.teeth
        for name, over in DECLARED[ContactCycle].items():
            if over.back == REVERSED:
                changed[name] = -getattr(self, name)
            elif over.back == THROUGH_BACKLASH:
                changed[name] = -(backlash + getattr(self, name))
        return replace(self, **changed)


def _declared(kind: type[Any]) -> Mapping[str, Over]:
    hints = get_type_hints(kind, include_extras=True)
    over = {name: getattr(hint, "__metadata__", ()) for name, hint in hints.items()}
    return {name: values[0] for name, values in over.items() if values}


# what each field of a result is over
DECLARED: Mapping[type[Any], Mapping[str, Over]] = {
    kind: _declared(kind) for kind in (FaceLoads, ContactCycle)
}


def empty_values(
    kind: type[Values], sizes: Mapping[str, int], **constants: Any
) -> Values:
    """Result in which no pair is in contact, to be filled in.

    sizes : of axes by their letter; constants : the other fields
    """
    for name, over in DECLARED[kind].items():
        if name not in constants:
            constants[name] = np.full([sizes[axis] for axis in over.axes], over.empty)
    return kind(**constants)


def joined_cycles(cycles: Sequence[ContactCycle]) -> ContactCycle:
    """Cycles over positions that follow each other as one; pairs are matched by tooth.

    All of drive flanks, or all of back flanks.
    """
    teeth = sorted({int(k) for c in cycles for k in c.teeth}, key=lambda k: (abs(k), k))
    columns = [np.array([teeth.index(k) for k in c.teeth]) for c in cycles]
    sign = 1 if (cycles[0].face.teeth == cycles[0].teeth).all() else -1
    face = _joined([c.face for c in cycles], columns, sign * np.array(teeth))
    position = np.concatenate([c.position for c in cycles])
    joined = _joined(cycles, columns, np.array(teeth))
    return replace(joined, position=position, face=face)


def joined_torques(cycles: Sequence[ContactCycle]) -> ContactCycle:
    """Cycles at torques that follow each other as one, of the same positions."""
    face = _along_torques([cycle.face for cycle in cycles])
    torque = np.concatenate([cycle.torque for cycle in cycles])
    return replace(_along_torques(cycles), torque=torque, face=face)


def _along_torques(parts: Sequence[Values]) -> Values:
    changed: dict[str, Any] = {
        name: np.concatenate(
            [getattr(part, name) for part in parts], axis=over.axis("t")
        )
        for name, over in DECLARED[type(parts[0])].items()
        if over.axis("t") is not None
    }
    return replace(parts[0], **changed)


def _joined(
    parts: Sequence[Values], columns: Sequence[Indices], teeth: Indices
) -> Values:
    """Values of all pairs (k,), whose columns each of the parts has."""
    changed: dict[str, Any] = {"teeth": teeth}
    for name, over in DECLARED[type(parts[0])].items():
        values = [getattr(part, name) for part in parts]
        of_pairs, along = over.axis("k"), over.axis("n", "s")
        if of_pairs is not None and values[0].shape[of_pairs]:
            values = [
                _among_all(v, over, of_part, teeth.size)
                for v, of_part in zip(values, columns, strict=True)
            ]
        if along is not None:
            changed[name] = np.concatenate(values, axis=along)
    return replace(parts[0], **changed)


def _among_all(
    values: NDArray[Any], over: Over, columns: Indices, count: int
) -> NDArray[Any]:
    """Values with the pairs at some columns among all, the others without contact."""
    sizes = list(zip(over.axes, values.shape, strict=True))
    placed = np.full([count if a == "k" else n for a, n in sizes], over.empty)
    placed = placed.astype(values.dtype)
    placed[np.ix_(*(columns if a == "k" else np.arange(n) for a, n in sizes))] = values
    return placed
