"""Fields of two gears at an instant of their motion.

The loads are those of the instant, pair by pair; the teeth under them are at rest:
what a tooth's own mass adds to its stress is left out. The gears are placed
as the motion has them, so that flanks out of contact are apart by their gap.
"""

from __future__ import annotations

import numpy as np

from fegear.contact.loads import PatchLoad, patch_load
from fegear.contact.pairs import back_side_position
from fegear.contact.plane.runs import KernelResult, solve_pairs
from fegear.contact.problem import ContactFailure, ContactProblem
from fegear.rendering.fields import ContactField
from fegear.rendering.frames import View
from fegear.rendering.loaded_gears import loaded_gears
from fegear.rendering.mesh_scene import MeshScene, RelativePose
from fegear.rendering.recorded import Instant


def instant_field(
    scene: MeshScene, instant: Instant, phase: float, view: View
) -> ContactField:
    """Fields of the teeth in view.

    phase : position at the start of the mesh's cycle, see `fegear.gearset.phases`
    """
    position = phase + instant.position
    back = instant.back
    side_position = position
    if back:
        side_position = float(back_side_position(scene.problem.pair, position))
    loads = [
        pair_load(scene.problem, -pair if back else pair, side_position, load)
        for (pair, on_back), load in sorted(instant.loads.items())
        if on_back == back
    ]
    stand = RelativePose(position, instant.ste, back)
    gears, pairs = loaded_gears(scene, stand, loads, view)
    torque = instant.force * scene.problem.pair.driver_arm
    return ContactField(torque, position, instant.ste, gears, pairs, instant)


def pair_load(
    problem: ContactProblem, tooth: int, position: float, load: float
) -> PatchLoad:
    """Pressure of one pair alone that adds up to a load [N].

    tooth : base pitches by which the pair is ahead of the reference pair
    Raises ContactFailure where its flanks do not face each other.
    """
    # the arm of the force about the driver depends on the place, not on the load
    arm = _solve_pair(problem, tooth, position, problem.pair.driver.base_radius * load)[
        0
    ]
    solved = _solve_pair(problem, tooth, position, arm * load)[1]
    return patch_load(problem, solved, 0)


def _solve_pair(
    problem: ContactProblem, tooth: int, position: float, torque: float
) -> tuple[float, KernelResult]:
    """Arm of the force [m] and solution of one pair at a torque [N m]."""
    from fegear.contact.plane.kernels.cycle import TORQUE

    targets = np.array([[torque / problem.face_width]])
    place = np.array([position])
    solved = solve_pairs(
        problem, np.array([tooth]), np.zeros((1, 1)), place, TORQUE, targets
    )
    if solved.rows.status[0, 0] != 0:
        raise ContactFailure(
            f"no contact of pair {tooth} at position {position:g}, where the motion "
            "has a load"
        )
    patch = solved.patches[0]
    mu = problem.friction * patch.sliding_sign
    return float(patch.moment_arms[0] - mu * patch.moment_arms[2]), solved
