"""Attractors over a parameter: what is carried on, kept and named."""

from __future__ import annotations

import threading

import numpy as np
import pytest

from lumped.attractors.attractor_sweeps import AttractorBranch, sweep_attractors
from lumped.attractors.attractors import Attractor, SectionSettings
from lumped.steady.integration_settings import Settings
from lumped.steady.respond import respond_with_history
from lumped.steady.sweep import Observer

CHAPTER_3 = 2.621e-3, 3.27e-3, 0.119  # kg m2
FEW = SectionSettings(sections=20)
SETTINGS = Settings(multiples=32)
SPEEDS = 1660.0, 1630.0, 1615.0, 1600.0, 1540.0  # Hz


@pytest.fixture(scope="module")
def at(system, idler):
    """The idler of chapter 3 on rectangular waves at speeds and torques."""

    def made(speed, torque=100.0, **changes):
        train = idler(
            inertias=CHAPTER_3, coupled=False, phases=(0.0, -0.125), torque=torque
        )
        return system(train, **({"contact_ratio": 1.5} | changes)), speed

    return made


@pytest.fixture(scope="module")
def falling(at):
    whole = at(0.0)[0]
    return sweep_attractors(SPEEDS, lambda speed: (whole, speed), "down", SETTINGS, FEW)


def test_a_period_doubles_and_chaos_begins(falling):
    assert falling.complete
    assert falling.values == SPEEDS
    names = [(interval.name, interval.transition) for interval in falling.intervals]
    assert names == [
        ("period 1", ""),
        ("period 2", "period doubling"),
        ("quasi-periodic", "torus"),
        ("chaotic", "chaos begins"),
    ]
    for attractor in falling.attractors:
        assert attractor.deflection.shape == (attractor.multiple or 20, 2)
        if attractor.multiple:
            assert attractor.exponent < 0.0


def test_sections_are_where_periods_of_the_motion_begin(at):
    built, speed = at(1615.0)
    fine = Settings(steps=512, multiples=32, tolerance=1e-6)
    _, history = respond_with_history(built, speed, fine)
    attractor = sweep_attractors([speed], at, "up", fine).attractors[0]
    half = (history.time.size - 1) // 2
    expected = history.deflection[[0, half]]
    order = np.argsort(attractor.deflection[:, 0])
    expected = expected[np.argsort(expected[:, 0])]
    np.testing.assert_allclose(attractor.deflection[order], expected, rtol=2e-3)


def test_all_grows_with_the_torque_while_back_flanks_do_not_touch(at):
    """Forces are then in proportion to deflections, whatever gaps open."""
    torques = 50.0, 100.0, 200.0
    attractors = sweep_attractors(
        torques, lambda torque: at(1615.0, torque), "up", SETTINGS
    ).attractors
    assert [attractor.multiple for attractor in attractors] == [2, 2, 2]
    for torque, attractor in zip(torques[1:], attractors[1:], strict=True):
        part, first = torque / torques[0], attractors[0]
        order, other_order = (
            np.argsort(a.deflection[:, 0]) for a in (first, attractor)
        )
        expected = part * first.deflection[order]
        np.testing.assert_allclose(
            attractor.deflection[other_order], expected, rtol=2e-3
        )
        assert attractor.exponent == pytest.approx(first.exponent, rel=0.02)


def test_motions_are_carried_on_to_other_systems_as_gears_move(at):
    one, other = at(900.0)[0], at(900.0, 150.0, variation=0.1, contact_ratio=1.3)[0]
    state = np.random.default_rng(0).standard_normal((2, one.arrays.rigidity.size))
    moved = other.state_from(one, state)
    for before, after in zip(state, moved, strict=True):
        np.testing.assert_allclose(
            other.arrays.shapes @ after, one.arrays.shapes @ before, rtol=1e-12
        )
    np.testing.assert_allclose(one.state_from(one, state), state, rtol=1e-12)


class MemoryStore(list):
    """A store of values in memory."""

    def finished(self):
        return list(self)

    def add(self, response, attractor):
        self.append((response, attractor))


def test_a_stopped_sweep_goes_on_where_it_ended(at, falling):
    train, store, stop = at(0.0)[0], MemoryStore(), threading.Event()
    arguments = (SPEEDS, lambda speed: (train, speed), "down", SETTINGS, FEW)

    def passed():
        if len(store) == 2:
            stop.set()

    begun = sweep_attractors(
        *arguments, store=store, observer=Observer(passed), stop=stop
    )
    assert not begun.complete
    assert begun.values == SPEEDS[: len(store)] != SPEEDS
    resumed = sweep_attractors(*arguments, store=store)
    assert resumed.complete
    for one, other in zip(resumed.attractors, falling.attractors, strict=True):
        assert one.exponent == other.exponent
        np.testing.assert_array_equal(one.deflection, other.deflection)


def test_a_sweep_that_is_stopped_at_once_has_no_stretches(at):
    stop = threading.Event()
    stop.set()
    begun = sweep_attractors(SPEEDS, at, "down", SETTINGS, FEW, stop=stop)
    assert not begun.complete
    assert begun.values == begun.intervals == ()


def test_a_motion_that_only_coarse_steps_hold_is_left(system, idler):
    """At 1630 Hz on 64 steps the motion of one period repeats, though it doubles."""
    train = idler(inertias=CHAPTER_3, phases=(0.0, -0.125))
    built = system(train, contact_ratio=1.5)
    speeds = np.arange(1620.0, 1661.0, 10.0)
    attractor_sweep = sweep_attractors(
        speeds, lambda speed: (built, speed), "down", SETTINGS
    )
    attractors = attractor_sweep.attractors
    for value, attractor in zip(attractor_sweep.values, attractors, strict=True):
        assert attractor.multiple in (1, 2)
        assert attractor.exponent < 0.0, value


def test_a_divergence_ends_a_sweep(at, monkeypatch):
    from lumped.train.system import LumpedSystem

    monkeypatch.setattr(LumpedSystem, "limit", 1e-12)
    attractor_sweep = sweep_attractors([900.0, 1000.0], at, "up")
    assert [attractor.name for attractor in attractor_sweep.attractors] == ["diverged"]
    assert not attractor_sweep.complete
    assert np.isnan(attractor_sweep.intervals[0].exponent)


@pytest.mark.parametrize(
    ("before", "after", "change"),
    [
        ((4, -0.1), (8, -0.1), "period doubling"),
        ((8, -0.1), (4, -0.1), "period halving"),
        ((1, -0.1), (3, -0.1), ""),
        ((8, -0.1), (0, 0.1), "chaos begins"),
        ((0, 0.1), (3, -0.1), "chaos ends"),
        ((0, 0.1), (0, 0.0), "chaos ends"),
        ((2, -0.1), (0, 0.0), "torus"),
    ],
)
def test_changes_have_the_names_of_the_field(before, after, change):
    empty = np.empty((0, 1))
    attractors = tuple(
        Attractor(multiple, empty, empty, exponent, 1e-4)
        for multiple, exponent in (before, after)
    )
    branch = AttractorBranch("up", (1.0, 2.0), attractors, True)
    assert branch.intervals[1].transition == change


def test_a_wrong_direction_is_named(at):
    with pytest.raises(ValueError, match="direction = 'left'; must be up or down"):
        sweep_attractors([900.0], at, "left")


def test_what_is_unstable_on_finest_steps_too_does_not_repeat(at, monkeypatch):
    """As chaos may pass by near an orbit for longer than is looked for."""
    monkeypatch.setattr("lumped.attractors.attractor_sweeps.MAX_NEUTRAL_EXPONENT", -1.0)
    (attractor,) = sweep_attractors([900.0], at, "up").attractors
    assert (attractor.multiple, attractor.name) == (0, "not converged")
    assert attractor.deflection.shape == (100, 2)
