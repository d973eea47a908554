"""What the compiled kernels know of a lumped system, by name.

n modes, m meshes, p pairs in all, s steps.
"""

from __future__ import annotations

from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
R = TypeVar("R", bound=tuple[Any, ...])
PHASE, RATE, OFFSET = 0, 1, 2  # columns of Pieces.place
FIRST_ROW, SHAPES, FIRST_OFFSET, OFFSETS, PITCH, ROW = range(6)  # of Pieces.pitches
PERIOD, MULTIPLE, STREAK = range(3)  # of Convergence.counts


def in_row_order(record: R) -> R:
    """A record whose arrays have C order: kernels are compiled again for any other."""
    named_tuple: Any = record
    return named_tuple._make(
        np.ascontiguousarray(value) if isinstance(value, np.ndarray) else value
        for value in named_tuple
    )


class ModalSystem(NamedTuple):
    """A train in modal coordinates of unit mass.

    rigidity (n,) natural angular frequencies squared [1/s^2]
    damping (n,) 2 zeta omega [1/s]
    load (n,) external [N/sqrt(kg)]
    shapes (m, n) mesh deflection of each mode [1/sqrt(kg)]
    mean_stiffness (m,) that the natural frequencies stand on [N/m]
    backlash (m,) [m]
    first_pair (m + 1,) where each mesh's pairs begin
    """

    rigidity: Array
    damping: Array
    load: Array
    shapes: Array
    mean_stiffness: Array
    backlash: Array
    first_pair: Array


class ExcitationSamples(NamedTuple):
    """Steps of a common period and the excitation on them.

    h (s,) step sizes; stiffness, gap (s, 3, p) at start, middle and end of each
    """

    h: Array
    stiffness: Array
    gap: Array


class FrictionSamples(NamedTuple):
    """Samples of a train whose teeth rub.

    slide (s, 3, p) coefficient of friction, negative in recess; arm (s, 3, p) way of
    the pair ahead of the pitch point [m]; bending (s, 3, p) by how much friction
    stiffens a pair in approach, relative
    at_pitch, at_pitch_back, per_metre (m, n) rows of friction in the modes; see
    `lumped.train.friction`
    sliding_rate (m,) nominal sliding speed per way from the pitch point [1/s]
    reversible (m,) whether vibration can turn the friction; transition (m,) sliding
    speed about which it then turns, 0 at once [m/s]
    """

    h: Array
    stiffness: Array
    gap: Array
    slide: Array
    arm: Array
    bending: Array
    at_pitch: Array
    at_pitch_back: Array
    per_metre: Array
    sliding_rate: Array
    reversible: Array
    transition: Array


class Pieces(NamedTuple):
    """The excitation as piecewise cubic functions, of each pair its stiffness and gap.

    place (p, 3) phase and rate of the pair's mesh, offset of its gap at present
    first_piece (2 p + 1,) where the pieces of each function begin
    breaks (pieces + 2 p,), coefficients (pieces, 4) of all functions
    stops (k,) times until all meshes repeat that no step crosses
    mesh_of (p,)
    pitches (2 p, 6) of each function where its coefficients begin and how many base
        pitches of it differ, the same of its offsets; whole base pitches that come to
        the position, and where the coefficients of the present one begin
    offsets (o,) of all functions
    """

    place: Array
    first_piece: Array
    breaks: Array
    coefficients: Array
    stops: Array
    mesh_of: Array
    pitches: Array
    offsets: Array


class Convergence(NamedTuple):
    """What is remembered of a motion to tell when it has become periodic.

    Sections are modal displacements, and velocities over the natural angular
    frequency, at the start of each common period.

    sections (slots, 2, n), a ring of two or more beyond twice the largest multiple
    shapes (m, n) mesh deflection of each mode; angular (n,) [rad/s]
    tolerance : distance to the periodic motion, relative to the range of deflection
    limits (2, m) smallest and largest deflection of the present period [m]
    error_bound (m,) what the integrator adds to the deflection in a period [m]
    scale (m,) range of deflection that distances are relative to [m]
    counts (3,) common periods passed, the multiple that was found, how often in a row
    accept_immediately : whether sections that are the same but for round-off need no
        confirmation, as after a long common period
    """

    sections: Array
    shapes: Array
    angular: Array
    tolerance: float
    limits: Array
    error_bound: Array
    scale: Array
    counts: Array
    accept_immediately: bool

    @property
    def period(self) -> int:
        """Common periods that have passed."""
        return int(self.counts[PERIOD])

    @property
    def multiple(self) -> int:
        """Common periods after which the motion repeats, 0 where none is found."""
        return int(self.counts[MULTIPLE])


class AdaptiveRules(NamedTuple):
    """What adaptive steps keep to.

    accuracy : error of a step, in the norm of the energy, relative to its size
    limit : sum of modal velocities beyond which a motion has diverged
    frequency : of the first mesh [Hz]; size : norm of the energy that is moderate
    """

    accuracy: float
    limit: float
    frequency: float
    size: float


class AdaptiveWork(NamedTuple):
    """Room for an adaptive step.

    contact (p,) state of each pair, held within a step
    slopes (7, 2, n) of the stages; end, probe, trial (2, n)
    stiffness, gap (p,), deflection (m,) at an instant
    limits (2, m) smallest and largest deflection at the steps' ends
    """

    contact: Array
    slopes: Array
    end: Array
    probe: Array
    trial: Array
    stiffness: Array
    gap: Array
    deflection: Array
    limits: Array


class Contacts(NamedTuple):
    """The laws of the contacts.

    first (m + 1,) where each mesh's contacts begin
    side (c,) 1 on the drive side, -1 on the back
    gap (c, p + 1) penetration that is missing where the deflection is 0 [m]
    sliding (c, p + 1) direction of friction at nominal speeds
    arms (2, c, p + 1) of friction about driver and driven centre [m]
    knots (m, j + 1), law (c, p + 1, 2, j, 4) cubics of the load [N] in the penetration
        beyond each knot; friction as it is nominally, and reversed
    normal_compliance, tangential_compliance (p + 1, c, c) static, besides that of the
        coordinates [m/N]
    errors (c, n) gap that comes to each contact in the cycles of its mesh, one after
        another, from pitch errors [m]; (c, 0) where there are none
    """

    first: Array
    side: Array
    gap: Array
    sliding: Array
    arms: Array
    knots: Array
    load_curve: Array
    normal_compliance: Array
    tangential_compliance: Array
    errors: Array


class Position(NamedTuple):
    """Places of the meshes (m,) in their tables.

    place, part : grid point and the part of a cell beyond it
    cycle : number of the mesh cycle
    gap : (c, p + 1) gaps of the contacts with the pitch errors of these cycles [m]
    """

    place: Array
    part: Array
    cycle: Array
    gap: Array


class PenetrationProblem(NamedTuple):
    """The equations for the penetrations of the n first `chosen` contacts, of all c.

    knots, load_curve : as in Contacts; place, part : as in Position; mesh_of : (c,)
    reversed : (c,) whether a contact slides against its nominal direction
    free : (c,) penetrations without contact forces [m]; start : (c,) first guess
    cell : (c,) of the law where the last penetration was looked up
    chosen : (c,); Q : (c, c) [m/N], of those chosen
    newton : (6, c), loaded : (c,), matrix : (c, c + 1) working arrays
    """

    knots: Array
    load_curve: Array
    place: Array
    part: Array
    mesh_of: Array
    reversed: Array
    free: Array
    start: Array
    cell: Array
    chosen: Array
    Q: Array
    newton: Array
    loaded: Array
    matrix: Array


class CoupledSystem(NamedTuple):
    """A train whose contacts deflect each other, in n coordinates of unit mass.

    Coordinates are mean rotations of the gears and standing body modes, then E1 of w
    pairs of travelling body modes, then E2: see `lumped.train.coupled`.

    stiffness (n, n) of all springs but the meshes [1/s^2]; damping (n, n), load (n,)
    whirl (w,) rate at which each pair's pattern turns past its gear, cycles per cycle
    of the first mesh
    shapes (m, n), offset (m,) mesh deflection by the hubs per coordinate, and of all 0
    rate (m,) cycles of each mesh per cycle of the first; mesh_of (c,)
    rows (c, p + 1, n) penetration of each contact per coordinate
    ahead (c, p + 1, m) mesh deflection by the hubs per load of each contact [m/N]
    contacts : of all meshes, compliance in mean axes, gaps under the constant loads
    """

    stiffness: Array
    damping: Array
    load: Array
    whirl: Array
    shapes: Array
    offset: Array
    rate: Array
    mesh_of: Array
    rows: Array
    ahead: Array
    contacts: Contacts


class ContactGrid(NamedTuple):
    """The contacts at s equal steps of the time after which all meshes repeat.

    place, part (s, m) in the tables; turn (s, m) whole cycles of each mesh
    periods (m,) cycles of each mesh after which the steps repeat but for pitch errors
    gap (s, c) [m]; rows (s, c, n), ahead (s, c, m); compliance (s, c, c) [m/N]
    facing (s, c) whether flanks face each other; faces (s, k) those that do,
    then -1
    """

    place: Array
    part: Array
    turn: Array
    periods: Array
    gap: Array
    rows: Array
    ahead: Array
    compliance: Array
    facing: Array
    faces: Array


class Propagator(NamedTuple):
    """A step of the linear part of a train, exact for forces that are cubic in time.

    The a coordinates that do not whirl have (displacement, velocity) as state (2 a,);
    a pair of travelling modes Z = E1 - i E2 is the sum of a forward and a backward
    wave, of which real and imaginary parts are stored.

    carry (5 a, 2 a) transposed, of the state and then of forces at the start of the
    step, and one and two steps before that; push (a, 2 a) of forces at its end
    waves (2, 10, w) : forward and backward, real and imaginary factors for the wave
    itself, then for forces at the end of the step, at its start and so on
    rates (2, 2, w) of the waves [1/s]
    """

    carry: Array
    push: Array
    waves: Array
    rates: Array


class CoupledSteps(NamedTuple):
    """Equal steps of a common period at a speed, for the coupled model.

    h (s,) step sizes [s], of all rounds of the grid
    compliance (s, c, c) of the contacts at the end of the step that ends there, with
    what moves in it [m/N]
    penetration [m], load [N] (c,) of an instant; ratio (c,) of the penetration to that
    without new forces, at the step before, 0 where it is not known
    continues (1,) whether a motion goes on from where these steps ended, after force
    (4, n) at the last nodes
    """

    h: Array
    grid: ContactGrid
    propagator: Propagator
    compliance: Array
    penetration: Array
    ratio: Array
    load: Array
    continues: Array
    force: Array
    problem: PenetrationProblem


class CoupledMotion(NamedTuple):
    """A motion in the variables of a Propagator.

    state (2 a,), waves (2, 2, w); force (4, n) on the coordinates at the last four
    nodes, in a ring whose newest is head (1,); q (n,) displacements
    inputs (5 a,), begin_state, begin_waves as state and waves : working arrays
    """

    state: Array
    waves: Array
    force: Array
    head: Array
    q: Array
    inputs: Array
    begin_state: Array
    begin_waves: Array


class CoupledChanges(NamedTuple):
    """k small changes of a CoupledMotion.

    state (2 a, k), waves (2, 2, w, k), force (4, n, k), q (n, k), as of the motion
    inputs (5 a, k), begin_state, begin_waves as state and waves, matrix (c, c + k) :
    working arrays
    """

    state: Array
    waves: Array
    force: Array
    q: Array
    inputs: Array
    begin_state: Array
    begin_waves: Array
    matrix: Array


class VariedSteps(NamedTuple):
    """Steps along which small changes are carried with a motion.

    h (s,) of the steps [s]; steps : Samples of the motion
    damping (n, n) [1/s]; tangent (n, n) stiffness at an instant [1/s2]
    """

    h: Array
    steps: Any
    damping: Array
    tangent: Array


class QuadratureGrid(NamedTuple):
    """Pieces of a common period that end on corners, and the excitation in them.

    edges (e + 1,) [periods of the first mesh]
    stiffness, gap (e, 5, p) at `lumped.kernels.orbit.CHECKS` of each piece
    """

    edges: Array
    stiffness: Array
    gap: Array


class FourierOrbit(NamedTuple):
    """A periodic motion as Fourier series of the mesh deflections.

    series (2 h + 1, m) mean, then h cosines and h sines [m]
    length : period, in periods of the first mesh
    deflection (e, 5, m) at the checks of a QuadratureGrid [m]
    waves : Pieces, its own
    """

    series: Array
    length: float
    deflection: Array
    waves: Pieces


class ContactPieces(NamedTuple):
    """Pieces of a period in which no pair changes its contact, at three Gauss points.

    start, length (n,) [periods of the first mesh]
    whole (n,) piece of the grid that it is, -1 where that was cut
    force (n, 3, m) [N]; slope (n, 3, m) tangent stiffness [N/m]; of the coupled model
    on its coordinates, slope as matrices
    """

    start: Array
    length: Array
    whole: Array
    force: Array
    slope: Array
