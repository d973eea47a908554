"""Records of a lumped system for the compiled kernels.

n modes, m meshes, p pairs in all, s steps.
"""

from __future__ import annotations

from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
R = TypeVar("R", bound=tuple[Any, ...])
NO_ROWS = np.empty((0, 0), np.int64)
NO_CHANGES = np.empty((0, 0))
PHASE, RATE, OFFSET = 0, 1, 2  # columns of Pieces.pair_positions
FIRST_ROW, SHAPES, FIRST_OFFSET, OFFSETS, PITCH, ROW = range(6)  # of Pieces.pitches
# columns of BearingSamples.parameters and of its waves
COEFFICIENT, EXPONENT, FREE_GAP, RUNOUT, CAGE_RATIO = range(5)
ORDER, AMPLITUDE, WAVE_PHASE, ON_INNER = range(4)
PERIOD, MULTIPLE, STREAK = range(3)  # of Convergence.counts


def make_contiguous(record: R) -> R:
    """Return a record with arrays in C order: kernels are recompiled for any other."""
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
    mean_stiffness (m,) of the meshes, included in rigidity [N/m]
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
    """Samples of a train with tooth friction.

    signed_friction (s, 3, p) coefficient of friction, negative in recess; arm (s, 3, p)
    distance of the pair ahead of the pitch point [m]; bending (s, 3, p) relative
    increase of a pair's stiffness by friction in approach
    at_pitch, at_pitch_back, per_metre (m, n) rows of friction in the modes; see
    `lumped.train.friction`
    sliding_rate (m,) nominal sliding speed per distance from the pitch point [1/s]
    reversible (m,) whether vibration can reverse the friction; transition (m,) sliding
    speed over which it then reverses, 0 for a jump [m/s]
    """

    h: Array
    stiffness: Array
    gap: Array
    signed_friction: Array
    arm: Array
    bending: Array
    at_pitch: Array
    at_pitch_back: Array
    per_metre: Array
    sliding_rate: Array
    reversible: Array
    transition: Array


class BearingSamples(NamedTuple):
    """Samples of a train with b rolling bearings of e elements in all.

    The system has b coordinates without inertia forces behind those of its modes: the
    rotations of the inner rings [rad].

    rows (b, 2, n + b) displacement of each ring along x and y per coordinate
    reference (b, 2, 2) stiffness that is included in the rigidity [N/m]
    parameters (b, 5) load of an element over its approach to the power of the exponent,
        exponent, approach of centred rings at which an element is loaded [m],
        eccentricity of the inner race [m], rotation of the cage over that of the ring
    first_element (b + 1,); angles, cosines, sines (e,) of the elements on their cages
    first_wave (b + 1,); waves (w, 4) order, amplitude [m], phase [rad], and 1 if on the
        inner race, else 0
    """

    h: Array
    stiffness: Array
    gap: Array
    rows: Array
    reference: Array
    parameters: Array
    first_element: Array
    angles: Array
    cosines: Array
    sines: Array
    first_wave: Array
    waves: Array


class SpaceSamples(NamedTuple):
    """Samples of a train whose gears move in space, with springs over the face width.

    place (s, 3, p) of each spring along the axis, from the middle that the deflection
        of its mesh refers to [m]
    tilts (m, n) difference of slopes in each mesh per coordinate, by which a spring's
        deflection grows with its place [1/(m sqrt(kg))]
    tilt_stiffness (m,) of the meshes, included in rigidity [N m/rad]
    velocity_forces (n, n) forces over velocities besides modal damping: of bearings and
        of gyroscopic moments at the speed [1/s]
    cross_stiffness (n, n) forces across displacements, besides rigidity, as of the oil
        in bearings [1/s2]; (0, 0) without
    """

    h: Array
    stiffness: Array
    gap: Array
    place: Array
    tilts: Array
    tilt_stiffness: Array
    velocity_forces: Array
    cross_stiffness: Array


class Pieces(NamedTuple):
    """Stiffness and gap of each pair as piecewise cubic functions.

    pair_positions (p, 3) phase and rate of the pair's mesh, current offset of its gap
    first_piece (2 p + 1,) where the pieces of each function begin
    breaks (pieces + 2 p,), coefficients (pieces, 4) of all functions
    stops (k,) times until all meshes repeat that no step crosses
    mesh_of (p,)
    pitches (2 p, 6) for each function: first row of its coefficients, number of
        different base pitches, first offset, number of offsets, base pitches to add to
        the position, and first row of the coefficients of the current base pitch
    offsets (o,) of all functions
    """

    pair_positions: Array
    first_piece: Array
    breaks: Array
    coefficients: Array
    stops: Array
    mesh_of: Array
    pitches: Array
    offsets: Array


class Convergence(NamedTuple):
    """State of the convergence test for periodic motions.

    Sections are modal displacements, and velocities over the natural angular
    frequency, at the start of each common period.

    sections (slots, 2, n), a ring buffer of 2 or more than twice the largest multiple
    shapes (m + b, n) deflection of the meshes of each mode, then forces of bearings of
        gears that move in space [N]; angular (n,) [rad/s]
    tolerance : distance to the periodic motion, relative to the scale
    meshes : number m
    limits (2, m + b) smallest and largest deflection, or force, of the current period
    error_bound (m + b,) error of these by the integrator in a period
    scale (m + b,) range that distances are relative to
    counts (3,) common periods passed, period multiple, consecutive confirmations of it
    earlier_steps : steps between sections, of which the largest must exceed the last
    accept_immediately : whether sections that are the same but for round-off need no
        confirmation, as after a long common period
    """

    sections: Array
    shapes: Array
    angular: Array
    tolerance: float
    meshes: int
    limits: Array
    error_bound: Array
    scale: Array
    counts: Array
    earlier_steps: int
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
    """Error bounds of adaptive steps.

    accuracy : error of a step, in the norm of the energy, relative to its size
    limit : sum of modal velocities beyond which a motion has diverged
    frequency : of the first mesh [Hz]
    velocity_scale : typical energy norm, of which errors below accuracy are accepted
    """

    accuracy: float
    limit: float
    frequency: float
    velocity_scale: float


class AdaptiveWork(NamedTuple):
    """Workspace of an adaptive step.

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
    """Load curves and compliance of the contacts.

    first (m + 1,) where each mesh's contacts begin
    side (c,) 1 on the drive side, -1 on the back
    gap (c, p + 1) gap at zero deflection [m]
    sliding (c, p + 1) direction of friction at nominal speeds
    arms (2, c, p + 1) of friction about driver and driven centre [m]
    knots (m, j + 1), load_curve (c, p + 1, 2, j, 4) cubics of the load [N] in the
        penetration beyond each knot; for nominal and for reversed friction
    normal_compliance, tangential_compliance (p + 1, c, c) static, besides that of the
        coordinates [m/N]
    errors (c, n) additional gap of each contact by pitch errors in successive cycles
        of its mesh [m]; (c, 0) without pitch errors
    curve_rows (c, n) row of load_curve that a contact has in successive cycles of its
        mesh, where curves of teeth that differ follow those of the c contacts
    gap_rows (c, n) row of gap_changes (r, p + 1), by which its gap then differs [m];
        all three of no size where teeth are alike and centres on their axes
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
    curve_rows: Array = NO_ROWS
    gap_rows: Array = NO_ROWS
    gap_changes: Array = NO_CHANGES


class Position(NamedTuple):
    """Positions of the meshes (m,) in their tables.

    grid_index, fraction : grid point, and fraction of the cell beyond it
    cycle : number of the mesh cycle
    gap : (c, p + 1) gaps of the contacts' teeth in these cycles [m]
    curve : (c,) rows of their load curves
    """

    grid_index: Array
    fraction: Array
    cycle: Array
    gap: Array
    curve: Array


class PenetrationProblem(NamedTuple):
    """Equations for the penetrations of the active contacts, of all c.

    knots, load_curve : as in Contacts
    grid_index, fraction, curve : as in Position; mesh_of : (c,)
    friction_reversed : (c,) whether a contact slides against its nominal direction
    free : (c,) penetrations without contact forces [m]; guess : (c,) initial guess
    cell : (c,) interval of the load curve that was evaluated last
    active : (c,) active contacts first; Q : (c, c) compliance of these [m/N]
    newton : (6, c), loaded : (c,), matrix : (c, c + 1) working arrays
    """

    knots: Array
    load_curve: Array
    grid_index: Array
    fraction: Array
    curve: Array
    mesh_of: Array
    friction_reversed: Array
    free: Array
    guess: Array
    cell: Array
    active: Array
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

    grid_index, fraction (s, m) in the tables; mesh_cycle (s, m) whole cycles passed
    periods (m,) cycles of each mesh after which the steps repeat but for pitch errors
    gap (s, c) [m]; ahead (s, c, m); compliance (s, c, c) [m/N]
    rows (s, c, a + 2 k) penetration per coordinate: of those that do not whirl, then of
    E1 and E2 of the k = wave_count (1,) pairs from first_wave (c,) on, which include
    all of both gears
    facing (s, c) whether flanks face each other; facing_contacts (s, k) indices of
    those that do, then -1
    """

    grid_index: Array
    fraction: Array
    mesh_cycle: Array
    periods: Array
    gap: Array
    rows: Array
    first_wave: Array
    wave_count: Array
    ahead: Array
    compliance: Array
    facing: Array
    facing_contacts: Array


class Propagator(NamedTuple):
    """A step of the linear part of a train, exact for forces that are cubic in time.

    The a coordinates that do not whirl have (displacement, velocity) as state (2 a,);
    a pair of travelling modes Z = E1 - i E2 is the sum of a forward and a backward
    wave, of which real and imaginary parts are stored.

    transition (5 a, 2 a) transposed matrix of the state, then of forces at the start of
    the step, one and two steps before that
    force_response (a, 2 a) state per force at the end of the step
    waves (2, 10, w) : forward and backward, real and imaginary factors for the wave
    itself, then for forces at the end of the step, at its start and so on
    rates (2, 2, w) of the waves [1/s]
    """

    transition: Array
    force_response: Array
    waves: Array
    rates: Array


class CoupledSteps(NamedTuple):
    """Equal steps of a common period at a speed, for the coupled model.

    h (s,) step sizes [s], of all repetitions of the grid
    compliance (s, c, c) of the contacts at the end of the step that ends there,
    including the motion in the step [m/N]
    penetration [m], load [N] (c,) of an instant; ratio (c,) of the penetration to that
    without new forces, at the step before, 0 where it is not known
    continues (1,) whether a motion continues from the end of the last call, after
    force (4, n) at the last nodes
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
    nodes, in a ring buffer whose newest entry is head (1,); q (n,) displacements
    inputs (5 a,), start_state, start_waves as state and waves : working arrays
    """

    state: Array
    waves: Array
    force: Array
    head: Array
    q: Array
    inputs: Array
    start_state: Array
    start_waves: Array


class CoupledChanges(NamedTuple):
    """k small changes of a CoupledMotion.

    state (2 a, k), waves (2, 2, w, k), force (4, n, k), q (n, k), as of the motion
    inputs (5 a, k), start_state, start_waves as state and waves, matrix (c, c + k) :
    working arrays
    """

    state: Array
    waves: Array
    force: Array
    q: Array
    inputs: Array
    start_state: Array
    start_waves: Array
    matrix: Array


class VariedSteps(NamedTuple):
    """Steps along which small changes of a motion are integrated.

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
    stiffness, gap (e, 5, p) at `lumped.kernels.orbit.PIECE_CHECKS` of each piece
    """

    edges: Array
    stiffness: Array
    gap: Array


class FourierOrbit(NamedTuple):
    """A periodic motion as Fourier series of the mesh deflections.

    series (2 h + 1, m) mean, then h cosines and h sines [m]
    length : period, in periods of the first mesh
    deflection (e, 5, m) at the checks of a QuadratureGrid [m]
    waves : Pieces, not shared with other motions
    """

    series: Array
    length: float
    deflection: Array
    waves: Pieces


class ContactPieces(NamedTuple):
    """Pieces of a period in which no pair changes its contact, at three Gauss points.

    start, length (n,) [periods of the first mesh]
    grid_piece (n,) index of the same piece of the grid, -1 if that was cut
    force (n, 3, m) [N]; slope (n, 3, m) tangent stiffness [N/m]; of the coupled model
    on its coordinates, slope as matrices
    """

    start: Array
    length: Array
    grid_piece: Array
    force: Array
    slope: Array
