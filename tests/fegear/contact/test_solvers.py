"""One contract of both kinds of contact: in patches, and in slices of the width.

One gear pair, solved across the flanks and along the width of spur and helical teeth,
and one with an internal gear.
"""

from __future__ import annotations

from dataclasses import fields, replace
from itertools import pairwise

import numpy as np
import pytest
from sliced_pairs import WIDTH, problem, slope

from fegear.contact.pairs import back_side_position
from fegear.contact.plane.contact import PlaneContact
from fegear.contact.result import DECLARED, ContactCycle, FaceLoads, joined_cycles
from fegear.contact.solve import coupling_of_pairs, solve_cycle
from fegear.contact.width.supports import MOTIONS
from fegear.gearset.modifications import LEAD_SIZES

TORQUES = [60.0, 100.0]
POSITIONS = np.arange(8) / 8.0


def in_patches():
    """The section of the pair whose width has slices."""
    return replace(problem(), solver=PlaneContact(nodes=9))


PROBLEMS = {
    "patches": in_patches,
    "straight": lambda: problem(gap=slope(10e-6)),
    "helical": lambda: problem(18.0),
    "in a ring": lambda: problem(18.0, ring="driven"),
    "by a ring": lambda: problem(-18.0, ring="driver"),
}


@pytest.fixture(scope="module", params=PROBLEMS)
def contact(request):
    return PROBLEMS[request.param]()


@pytest.fixture(scope="module", params=[1.0, -1.0], ids=["drive", "back"])
def cycle(request, contact):
    return solve_cycle(contact, request.param * np.array(TORQUES), POSITIONS)


def test_fields_are_over_what_they_declare(cycle):
    face = cycle.face
    sizes = {"t": 2, "n": 8, "k": cycle.teeth.size, "m": face.place.size, "g": 2}
    sizes |= {"l": len(LEAD_SIZES), "h": 0, "c": 0, "q": 0}
    sizes["a"] = 0 if face.is_uniform else MOTIONS
    for values in (cycle, face):
        for name, over in DECLARED[type(values)].items():
            sizes["s"] = 0 if name.endswith(("_slope", "_change")) else sizes["n"]
            shape = getattr(values, name).shape
            if name != "coupling" or shape[2]:
                assert shape == tuple(sizes[axis] for axis in over.axes), name


def test_every_array_of_a_result_is_declared():
    """Else it is neither joined nor mirrored."""
    undeclared = {"torque", "position", "teeth", "base_radius", "face"}
    undeclared |= {"width", "base_helix_angle", "place", "groove"}
    for kind in (ContactCycle, FaceLoads):
        assert {f.name for f in fields(kind)} - DECLARED[kind].keys() <= undeclared


def test_torques_and_forces_balance(contact, cycle):
    moment = (cycle.load * cycle.closing).sum(axis=2) * cycle.base_radius
    expected = np.broadcast_to(cycle.torque[:, None], moment.shape)
    assert moment == pytest.approx(expected, rel=1e-9)
    face = cycle.face
    cosine = np.cos(face.base_helix_angle)
    of_pairs = cosine * face.load.sum(axis=3) * face.slice_length
    assert of_pairs == pytest.approx(np.abs(cycle.load), rel=1e-9)
    assert face.per_width.mean(axis=2) * WIDTH == pytest.approx(
        np.abs(cycle.load).sum(axis=2), rel=1e-9
    )
    assert face.pressure.max(axis=3) == pytest.approx(cycle.pressure, rel=1e-12)
    assert cycle.residual.max() < 1e-8


def test_parts_of_a_cycle_are_joined(contact, cycle):
    """Also where the first of them has fewer pairs than all."""
    ends = [0, 1, 5, 8]
    parts = [
        solve_cycle(contact, cycle.torque, POSITIONS[low:high])
        for low, high in pairwise(ends)
    ]
    assert parts[0].teeth.size < cycle.teeth.size
    joined = joined_cycles(parts)
    order = [joined.teeth.tolist().index(k) for k in cycle.teeth]
    for name, over in DECLARED[ContactCycle].items():
        values, whole = getattr(joined, name), getattr(cycle, name)
        if over.axis("k") is not None:
            values = values[:, :, order]
            # a part has fewer candidates, of which those without load are left out
            loaded = cycle.load != 0.0
            values, whole = values[loaded], whole[loaded]
        most = np.abs(whole).max(initial=0.0)
        assert np.abs(values - whole).max(initial=0.0) <= 1e-7 * most, name
    path = joined.face.path_position[:, order]
    assert path == pytest.approx(cycle.face.path_position, abs=1e-12)
    load = joined.face.load[:, :, order]
    assert load == pytest.approx(cycle.face.load, abs=1e-7 * load.max())


def test_back_flanks_carry_as_drive_flanks_in_a_mirror(contact):
    back = solve_cycle(contact, [-100.0], POSITIONS)
    mirrored = back_side_position(contact.pair, POSITIONS)
    drive = solve_cycle(contact, [100.0], mirrored)
    assert -(back.ste + contact.pair.backlash) == pytest.approx(drive.ste, rel=1e-9)
    assert (back.load <= 0.0).all()
    assert back.load.sum(axis=2) == pytest.approx(-drive.load.sum(axis=2), rel=1e-9)
    assert back.driven_torque == pytest.approx(-drive.driven_torque, rel=1e-9)
    assert back.stiffness == pytest.approx(drive.stiffness, rel=1e-9)
    # the helix is that of the mirror
    path = drive.face.path_position[..., ::-1]
    assert back.face.path_position == pytest.approx(path, abs=1e-12)


def test_what_pairs_yield_under_others_is_mutual(contact):
    cycle = solve_cycle(contact, [100.0], POSITIONS)
    pairs = np.arange(2)
    coupling = coupling_of_pairs(contact, cycle, pairs)
    assert coupling.shape == (1, 8, 2, 2)
    assert (coupling[..., pairs, pairs] == 0.0).all()
    assert (coupling[..., 0, 1] > 0.0).any()
    apart = np.abs(coupling[..., 0, 1] - coupling[..., 1, 0]).max()
    # tables of displacement under loads are as symmetric as their mesh is fine
    limit = 5e-4 if cycle.face.is_uniform else 1e-12
    assert apart < limit * coupling.max()
