"""Maps of impacts beside the events of the same wheel."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from loose_wheels import SINE, freedom, spur

from lumped.clatter.gearbox import Group, Harmonics
from lumped.clatter.maps import follow_map
from lumped.clatter.runs import middle, move

# R = m = Theta = 1, equal dampings and a radial play that is never used up
UNIT = spur(
    *(0.7, -0.4, 0.5),
    inertia=1.0,
    mass=1.0,
    base_radius=1.0,
    ratio=1.0,
    radial=freedom(1.0, 0.5, -0.1, 0.5),
)


@pytest.mark.parametrize("wheel", [UNIT, spur(), spur(0.7, -0.02, 0.0)])
def test_the_implicit_map_is_the_event_system(wheel):
    group = Group((wheel,), SINE)
    state = middle(group)
    # chaos drives them apart in many impacts: the map starts from each event anew
    compared, last, start = 0, None, None
    for part in move(group, state, 2.0, most=0):
        if start is not None and len(part) == 1 and part.speed[0] > 1e-5:
            mapped = follow_map(group, "implicit", start, int(last.edge[0]), 1)
            for name in ("time", "edge", "speed", "impulse"):
                wanted, found = getattr(part, name), getattr(mapped, name)
                np.testing.assert_allclose(found, wanted, rtol=1e-10, atol=1e-13)
            compared += 1
        resting = len(part) != 1 or state.held.any()
        start, last = (None if resting else state.copy()), part
    assert compared > 20


def test_the_fermi_map_is_where_the_implicit_one_leads():
    """A large play, a small fast way of the excitation, no drag and no damping."""
    wheel = spur(0.99, 0.0, 0.0, ratio=1.0)
    wheel = replace(wheel, rotation=replace(wheel.rotation, play=1e-2))
    errors = []
    for size in (1e-5, 1e-6):
        group = Group((wheel,), Harmonics(1.0, (size,), (0.2,)))
        state = middle(group)
        state.q[0] = (group.excitation.at(np.zeros(1))[0]) / wheel.base_radius
        state.v[0] = 0.5 / wheel.base_radius  # from the upper edge to the lower one
        few = 5
        implicit, fermi = (
            follow_map(group, name, state.copy(), 1, few)
            for name in ("implicit", "fermi")
        )
        errors.append(np.abs(implicit.time / fermi.time - 1.0).max())
    assert errors[0] < 1e-2
    assert errors[1] < 0.2 * errors[0]
