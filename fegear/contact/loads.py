"""Contact pressure of one position as loads on both flanks."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from fegear.contact.plane.runs import KernelResult
from fegear.contact.plane.solve import run_kernel
from fegear.contact.problem import ContactProblem
from fegear.elasticity.body_stress import ToothLoad
from lumped.common.array_types import Array


@dataclass(frozen=True)
class PatchLoad:
    """Contact load of one tooth pair, piecewise linear between equal nodes.

    tooth : base pitches by which the pair is ahead of the reference pair
    driver_arcs, driven_arcs : (n,) arc lengths of the nodes from the tip corners [m]
    step : spacing of the nodes [m]
    normal : (n,) line loads of the nodes' hats along the common normal, into both
        flanks [N/m]
    rootward : (n,) friction on both teeth, across the normal, toward their roots [N/m]
    turn : of corners on driver and driven, as in `ContactCycle`
    """

    tooth: int
    driver_arcs: Array
    driven_arcs: Array
    step: float
    normal: Array
    rootward: Array
    turn: tuple[float, float]


def patch_loads(
    problem: ContactProblem, torque: float, position: float
) -> list[PatchLoad]:
    """Loads of the touching pairs at a torque on the driver [N m] and a position.

    Raises ValueError for a torque that is not positive.
    """
    if not torque > 0.0:
        raise ValueError(f"torque = {torque}; must be positive")
    solved = run_kernel(problem, np.array([torque]), np.array([position]))
    touching = np.flatnonzero(solved.nodes.force.any(axis=1))
    return [patch_load(problem, solved, int(k)) for k in touching]


def patch_load(problem: ContactProblem, solved: KernelResult, pair: int) -> PatchLoad:
    """Load of pair number `pair` at the last position of a kernel's result."""
    patch, nodes = solved.patches[pair], solved.nodes[pair]
    master_arc = patch.first_arc - patch.step * np.arange(len(nodes))
    arcs = [master_arc, nodes.mate_arc.copy()]
    driver, driven = arcs if patch.master == 0 else arcs[::-1]
    force, mu = nodes.force.copy(), problem.friction * patch.sliding_sign
    tooth, step = int(solved.teeth[pair]), float(patch.step)
    turn = solved.cells.turn[0, -1, pair]
    return PatchLoad(
        tooth, driver, driven, step, force, mu * force, (float(turn[0]), float(turn[1]))
    )


def in_plane_strain(problem: ContactProblem, load: PatchLoad) -> PatchLoad:
    """A load whose contact is as narrow, and its pressure as high, as in plane strain.

    Loads of the nodes stay; the nodes come closer to the centre of pressure.
    """
    ratio, total = problem.plane_strain_pressure, load.normal.sum()

    def closer(arcs: Array) -> Array:
        center = arcs @ load.normal / total
        return center + (arcs - center) / ratio

    return replace(
        load,
        driver_arcs=closer(load.driver_arcs),
        driven_arcs=closer(load.driven_arcs),
        step=load.step / ratio,
    )


def tooth_loads(
    loads: Sequence[PatchLoad], gear: Literal["driver", "driven"], tooth: int = 0
) -> list[ToothLoad]:
    """Contact loads as one gear feels them, seen from its tooth of pair `tooth`.

    Along the normals of its own flanks and across them. The pair ahead is to the right
    on the driver and to the left on the driven gear.
    """
    sign, side = (1, 0) if gear == "driver" else (-1, 1)
    on_gear = []
    for load in loads:
        arcs = (load.driver_arcs, load.driven_arcs)[side]
        sine = load.turn[side]
        cosine = math.sqrt(1.0 - sine**2)
        normal = cosine * load.normal - sine * load.rootward
        rootward = sine * load.normal + cosine * load.rootward
        place = sign * (load.tooth - tooth)
        on_gear.append(ToothLoad(place, arcs, load.step, normal, rootward))
    return on_gear
