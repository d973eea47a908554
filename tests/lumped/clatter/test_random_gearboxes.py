"""Gearboxes of random wheels in rows and plays of every size: no play is left."""

from __future__ import annotations

import numpy as np
import pytest

from lumped.clatter.gearbox import Freedom, Gearbox, Harmonics, LooseWheel, Variation
from lumped.clatter.groups import WheelGroup
from lumped.clatter.impact_runs import random_state, simulate


def random_wheel(random: np.random.Generator, number: int) -> LooseWheel:
    """A loose wheel, driven by the input or by one before it."""

    def size(low: float, high: float) -> float:
        return float(10.0 ** random.uniform(low, high))

    def freedom(inertia: float, force: float) -> Freedom:
        return Freedom(
            play=size(-5, -3),
            restitution=float(random.choice([0.0, 0.3, 0.8, 1.0])),
            drag=float(random.choice([0.0, 1.0, -1.0])) * size(-3, 1) * force,
            damping=float(random.choice([0.0, 1.0])) * size(-3, 1.5) * inertia,
        )

    mass, inertia = size(-1, 1), size(-4, -2)
    driver = str(random.integers(0, number)) if random.random() < 0.7 * number else None
    turning, part = freedom(inertia, 0.1), float(random.choice([0.0, 0.3, -0.9]))
    waves = Variation(part * turning.play, number + 1, size(-1, 1))
    return LooseWheel(
        name=str(number),
        inertia=inertia,
        mass=mass,
        base_radius=size(-2, -1),
        rotation=turning,
        variation=waves if part else None,
        axial=freedom(mass, 1.0) if random.random() < 0.6 else None,
        radial=freedom(mass, 1.0) if random.random() < 0.6 else None,
        helix_angle=float(random.choice([0.0, 0.4, -0.4])),
        ratio=size(-0.5, 0.5),
        driver=driver,
    )


@pytest.mark.parametrize("seed", range(12))
def test_no_random_wheel_leaves_its_plays(seed):
    random = np.random.default_rng(seed)
    waves = int(random.integers(1, 4))
    sizes = tuple(1e-3 * random.uniform(size=waves))
    excitation = Harmonics(0.04, sizes, tuple(random.uniform(0.0, 6.0, waves)))
    wheels = tuple(random_wheel(random, k) for k in range(4))
    for members in Gearbox(excitation, wheels).groups:
        group = WheelGroup(members, excitation)
        state, count = random_state(group, seed), 0
        for time in np.arange(0.0133, 2.0, 0.0133):
            for part in simulate(group, state, time, max_impacts=10_000):
                count += len(part)
                if count > 50_000:
                    break
            time = state.time * excitation.period
            e = excitation.at(np.array([time]))[0]
            s = group.ratios * e + group.rows @ state.q
            assert np.all(s <= 1e-13)
            assert np.all(s >= -group.widths(np.array([time]))[0] - 1e-13)
            if count > 50_000:
                break
        assert count > 0


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(12))
def test_constant_drags_bring_every_wheel_to_rest(seed):
    """In a corner of its plays, without damping: impacts take the energy."""
    random = np.random.default_rng(100 + seed)
    still = Harmonics(0.04, (0.0,), (0.0,))

    def freedom() -> Freedom:
        return Freedom(
            play=float(10.0 ** random.uniform(-9.0, -3.0)),
            restitution=float(random.choice([0.0, 0.3, 0.7])),
            drag=float(random.choice([-1.0, 1.0]) * 10.0 ** random.uniform(-2.0, 1.0)),
        )

    wheels = tuple(
        LooseWheel(
            name=str(number),
            inertia=float(10.0 ** random.uniform(-4.0, -2.0)),
            mass=float(10.0 ** random.uniform(-2.0, 1.0)),
            base_radius=float(10.0 ** random.uniform(-2.0, -1.0)),
            rotation=freedom(),
            axial=freedom(),
            radial=freedom(),
            helix_angle=random.uniform(0.1, 0.6),
            driver=str(number - 1) if number else None,
        )
        for number in range(2)
    )
    group = WheelGroup(wheels, still)
    state, count = random_state(group, seed), 0
    for part in simulate(group, state, 400.0):
        count += len(part)
        assert count < 200_000
    assert np.all(state.held != 0)
    assert np.abs(state.v).max() < 1e-20
