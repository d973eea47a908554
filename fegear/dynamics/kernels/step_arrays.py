"""A gear set's finite-element dynamics as arrays for the compiled steps.

Coordinates are h hub coordinates, modes of the rigid train, then e elastic modes of
the gears with their hubs held, all of unit mass. Tables go over the p positions of a
mesh cycle and its end; c contacts, tooth pairs of all meshes and sides, are ordered by
mesh; m meshes.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from numpy.typing import NDArray

from lumped.kernels.arrays import Contacts, PenetrationProblem

Array = NDArray[Any]


class ModalMatrices(NamedTuple):
    """Inertia, elasticity and loads.

    The rotation of a gear carries its elastic modes along: of the mass M =
    [[1, G], [G^T, 1]] only their coupling G to the rotation is stored.

    stiffness (h, h), damping (h,), load (h,) of the hubs
    rigidity (e,) squared angular frequencies, elastic_damping (e,)
    rotation (gears, h) counter-clockwise, of each gear per hub coordinate
    coupling (e,) to the rotation of its gear, gear_of_mode (e,) that gear
    partner (e,), cosine (e,), sine (e,) : what becomes of a mode when teeth are
        counted anew: cosine times itself plus sine times its partner
    """

    stiffness: Array
    damping: Array
    load: Array
    rigidity: Array
    elastic_damping: Array
    rotation: Array
    coupling: Array
    gear_of_mode: Array
    partner: Array
    cosine: Array
    sine: Array


class ContactJacobian(NamedTuple):
    """Penetration and sliding of the contacts per coordinate.

    widths (m,), columns (m, w) coordinates in which a mesh's contacts have entries
    normal (c, p + 1, w) penetration per coordinate
    tangential (c, p + 1, w) the same for friction toward the roots
    mesh_of (c,); friction () coefficient
    share_gear (m, m) whether two meshes have a gear in common
    """

    widths: Array
    columns: Array
    normal: Array
    tangential: Array
    mesh_of: Array
    friction: Array
    share_gear: Array


class Kinematics(NamedTuple):
    """The nominal motion.

    rate (m,) cycles of each mesh per cycle of the first
    gears (m, 2) driver and driven, first_mesh (gears,) a mesh of each gear
    speed (gears,) nominal rotation over the first mesh's angular frequency
    deflection (m, h) of each mesh per hub coordinate
    """

    rate: Array
    gears: Array
    first_mesh: Array
    speed: Array
    deflection: Array


class ModelArrays(NamedTuple):
    """All that the kernels know of a gear set."""

    modal: ModalMatrices
    jacobian: ContactJacobian
    kinematics: Kinematics
    contacts: Contacts


class Newmark(NamedTuple):
    """A step size [s] and the parameters of the generalised-alpha scheme."""

    h: float
    alpha_m: float
    alpha_f: float
    gamma: float
    beta: float


class StepMatrices(NamedTuple):
    """A step size and what it makes of the model.

    mass_weight : of the mass in the step's matrix
    elastic_inverse (e,), hub_inverse (h, h) : of that matrix, its elastic diagonal
        and what is left on the hubs
    """

    newmark: Newmark
    mass_weight: float
    elastic_inverse: Array
    hub_inverse: Array


class Clock(NamedTuple):
    """What a run of steps goes through.

    speed : 2 pi times the first mesh's frequency, or 0 for gears at rest
    cycle : steps of a cycle of the first mesh; start : of them since the clock began
    limit : sum of velocities beyond which a motion has diverged
    """

    speed: float
    cycle: int
    start: int
    limit: float


class Record(NamedTuple):
    """What is recorded at t times: mesh (t, 5, m), load (t, c), hub (t, 2, h)."""

    mesh: Array
    load: Array
    hub: Array


class Row(NamedTuple):
    """A row of the Jacobian for each contact, and what it leaves of the elastic modes.

    row (c, w); condensed_row (c, h) after elimination of the modes, whose solution
    times the row is elastic (c, w)
    """

    row: Array
    condensed_row: Array
    elastic: Array


class StepWorkspace(NamedTuple):
    """Working arrays of a step.

    predicted (2, n) displacement and velocity at its end without acceleration
    rhs (n,), reduced (h,) of the step's equations, acceleration (n,)
    rotation (m, 2) speeds of driver and driven; friction (c,) signed coefficient
    normal, force_rows : rows of penetration and of force
    hub_response (c, h) : the hubs under a unit force
    """

    predicted: Array
    rhs: Array
    acceleration: Array
    reduced: Array
    rotation: Array
    friction: Array
    normal: Row
    force_rows: Row
    hub_response: Array
    problem: PenetrationProblem
