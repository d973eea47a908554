"""What the compiled kernels know of a lumped system, by name.

n modes, m meshes, p pairs in all, s steps.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from numpy.typing import NDArray

Array = NDArray[Any]
PHASE, RATE, OFFSET = 0, 1, 2  # columns of Pieces.place
FIRST_ROW, SHAPES, FIRST_OFFSET, OFFSETS, PITCH, ROW = range(6)  # of Pieces.pitches
PERIOD, MULTIPLE, STREAK = range(3)  # of Convergence.counts


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


class Samples(NamedTuple):
    """Steps of a common period and the excitation on them.

    h (s,) step sizes; stiffness, gap (s, 3, p) at start, middle and end of each
    """

    h: Array
    stiffness: Array
    gap: Array


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
    noise (m,) what the integrator adds to the deflection in a period [m]
    scale (m,) range of deflection that distances are relative to [m]
    counts (3,) common periods passed, the multiple that was found, how often in a row
    """

    sections: Array
    shapes: Array
    angular: Array
    tolerance: float
    limits: Array
    noise: Array
    scale: Array
    counts: Array

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
