"""Bodies of gears that twist over the face width, as a compliance between slices.

The torque of the teeth enters or leaves the body at one end of its width. With the
flexibility S(z), the integral of dz / (G J) from that end, a torque t_j at z_j turns
the section at z_i against that end by

    t_j min(S(z_i), S(z_j)),

as there is no torque beyond z_j. A normal force f_j has the torque t_j = r f_j with the
lever r = r_b cos(beta_b), and a turn moves the flank by r times its angle along the
normal, away from the mate. Between slices this adds r^2 min(S(z_i), S(z_j)), which is
symmetrical, positive semidefinite, and 0 at the end where the torque enters: the
transmission error counts from there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lumped.common.array_types import Array


@dataclass(frozen=True, eq=False)
class BodyTorsion:
    """How the body of a gear twists over its face width.

    places : ends of parts of uniform rigidity (n,), rising, from the middle of the face
        width [m]
    flexibility : (n,) twist per torque between them and the end where the torque enters
        or leaves [1/(N m)]
    """

    places: Array
    flexibility: Array

    def between(self, places: Array, loaded: Array) -> Array:
        """Twist (p, q) at places (p,) by unit torques at loaded ones (q,) [1/(N m)].

        Both from the middle of the face width [m].
        """
        at, of_loads = (
            np.interp(one, self.places, self.flexibility) for one in (places, loaded)
        )
        return np.asarray(np.minimum.outer(at, of_loads))
