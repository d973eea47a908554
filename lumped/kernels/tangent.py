"""A motion and small changes of it, compiled.

Runge-Kutta's rule, applied to the motion and to its linearised equations at once, is
the derivative of the rule's own map from step to step.

Nothing is added where contact changes. What a change of state gains as the motion
passes a switch h(x, t) = 0 is (f+ - f-) h_x dx / (h_x f- + h_t), the saltation: where a
pair gains or loses contact, force and so f are continuous; where a stiffness jumps, it
does so at a given time, h_x = 0. Leine and Nijmeijer, Dynamics and Bifurcations of
Non-Smooth Mechanical Systems (2004), chapter 7.
"""

from __future__ import annotations

import math

from lumped.common.compiled import inlined
from lumped.kernels.mesh_force import pair_slope, set_spring_acceleration


@inlined
def set_varied_acceleration(system, varied, instant, q, v, a, s):
    """Accelerations (n (1 + k),) of a motion and of its changes, deflections (m,).

    varied : VariedSteps; instant : step, and 0, 1 or 2 for its start, middle or end
    """
    damping, tangent = varied.damping, varied.tangent
    n = tangent.shape[0]
    set_spring_motion(system, varied.steps, varied, instant, q[:n], v[:n], a[:n], s)
    for start in range(n, q.size, n):
        for i in range(n):
            total = 0.0
            for j in range(n):
                total -= tangent[i, j] * q[start + j] + damping[i, j] * v[start + j]
            a[start + i] = total


@inlined
def set_spring_motion(system, steps, varied, instant, q, v, a, s):
    """Accelerations (n,), deflections (m,) and the tangent stiffness of springs."""
    set_spring_acceleration(system, steps, instant, q, v, a, s)
    k, stage = instant
    shapes, tangent = system.shapes, varied.tangent
    for i in range(q.size):
        for j in range(q.size):
            tangent[i, j] = system.rigidity[i] if i == j else 0.0
    for m in range(s.size):
        slope = -system.mean_stiffness[m]  # the mean is in the rigidity
        for p in range(system.first_pair[m], system.first_pair[m + 1]):
            elastic = s[m] - steps.gap[k, stage, p]
            slope += pair_slope(
                steps.stiffness[k, stage, p], elastic, system.backlash[m]
            )
        for i in range(q.size):
            for j in range(q.size):
                tangent[i, j] += shapes[m, i] * slope * shapes[m, j]


@inlined
def normalise_perturbations(q, v, angular):
    """Bring changes back to length 1 together; logarithm of their length before.

    q, v : (n (1 + k),) with the motion first; angular : (n,) velocities count by it
    """
    n, square = angular.size, 0.0
    for i in range(n, q.size):
        square += q[i] ** 2 + (v[i] / angular[i % n]) ** 2
    length = math.sqrt(square)
    for i in range(n, q.size):
        q[i] /= length
        v[i] /= length
    return math.log(length)
