"""Trying to break the lumped models of springs."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from lumped.common.array_types import Array
from lumped.steady.integration_settings import Settings
from lumped.steady.respond import respond, respond_with_history
from lumped.steady.response import History, Response
from lumped.steady.sweep import sweep, sweep_all
from lumped.train.analytic import StiffnessParameters, analytic_excitation
from lumped.train.bodies import Gear
from lumped.train.excitation import MeshExcitation, PairExcitation
from lumped.train.system import LumpedSystem
from lumped.train.train import Mesh, Train
from lumped.train.waves import constant_wave
from validation.commands.bench.stress.trials import Family, Trial, Trials

ADAPTIVE = Settings(method="dopri5", accuracy=1e-8)
RADII = (0.04535, 0.06564, 0.11218)  # Table 2.1
INERTIAS = (0.002621, 0.01091, 0.1193)
TEETH = (38, 55, 94)
COUPLINGS = (3389.6, 0.0, 11297.9)
NO_COUPLINGS = (0.0, 0.0, 0.0)
MEANS, VARIATIONS, RATIOS = (2.9831e8, 3.2108e8), (0.35, 0.40), (1.504, 1.510)


@dataclass(frozen=True)
class Idler:
    """The idler set of Table 2.1 with rectangular stiffness, and what is varied."""

    torque: float = 100.0
    damping: float = 0.04
    backlash: float = math.inf
    means: tuple[float, float] = MEANS
    variations: tuple[float, float] = VARIATIONS
    ratios: tuple[float, float] = RATIOS
    phase: float = 0.0
    couplings: tuple[float, float, float] = COUPLINGS
    harmonics: int | None = None

    def system(self) -> LumpedSystem:
        torques = (self.torque, 0.0, -self.torque * RADII[2] / RADII[0])
        columns = (TEETH, RADII, INERTIAS, self.couplings, torques)
        gears = tuple(
            Gear(
                name=f"gear {number}",
                teeth=teeth,
                base_radius=radius,
                inertia=inertia,
                coupling_stiffness=coupling,
                torque=torque,
            )
            for number, (teeth, radius, inertia, coupling, torque) in enumerate(
                zip(*columns, strict=True), start=1
            )
        )
        meshes = tuple(
            Mesh(
                driver=m,
                driven=m + 1,
                pressure_angle=math.radians(21.2),
                backlash=self.backlash,
                phase=phase,
            )
            for m, phase in enumerate((0.0, self.phase))
        )
        train = Train(gears=gears, meshes=meshes, damping_ratio=self.damping)
        waves = zip(self.means, self.variations, self.ratios, strict=True)
        figures = [
            StiffnessParameters(mean=mean, variation=variation, contact_ratio=ratio)
            for mean, variation, ratio in waves
        ]
        return LumpedSystem(
            train,
            tuple(
                analytic_excitation(stiffness, 1, (), harmonics=self.harmonics)
                for stiffness in figures
            ),
        )


def response(frequency: float, **varied: Any) -> Response:
    """Response of the idler set with some of its values varied, at a frequency [Hz]."""
    return respond(Idler(**varied).system(), frequency)


def disagreement(system: LumpedSystem, frequency: float, chaos: bool = False) -> float:
    """RMS of rk4 against dopri5, relative; infinite where period multiples differ.

    chaos : whether two motions that do not repeat agree
    """
    one, two = respond(system, frequency), respond(system, frequency, ADAPTIVE)
    if one.multiple != two.multiple:
        return math.inf
    if chaos and not one.multiple:
        finite = np.isfinite([one.dte_rms, two.dte_rms]).all()
        return 0.0 if finite else math.inf
    return _relative(one.dte_rms, two.dte_rms)


def _relative(one: Array, two: Array) -> float:
    return float(np.max(np.abs(one - two) / np.max(np.abs(two))))


TRIALS: list[Family] = []


def trial(function: Family) -> Family:
    """Add a family of attempts to the list."""
    TRIALS.append(function)
    return function


OVER_STATIC = "RMS over the static deflection"
AGREE = "rk4 and dopri5: same RMS and multiple"
STEADY = f"{AGREE}, or both none"


@trial
def stiffness_ratio() -> Trials:
    for ratio in (1e-6, 1e-3, 1e3, 1e6):
        stiff = Idler(means=(MEANS[0], MEANS[0] * ratio)).system()
        natural = stiff.modes.frequency_Hz[-1 if ratio < 1.0 else 1]
        frequency = 0.7 * float(natural)
        value = disagreement(stiff, frequency)
        yield Trial(f"stiffness ratio k2/k1 = {ratio:g}", AGREE, value, 2e-3)


@trial
def stiffness_variation() -> Trials:
    still = float(response(1000.0, variations=(0.0, 0.0)).dte_rms.max())
    yield Trial("stiffness variation 0", "no vibration [m]", still, 1e-15)
    small, smaller = (
        response(2500.0, variations=(size, size)).dte_rms / size
        for size in (1e-4, 1e-6)
    )
    value = _relative(smaller, small)
    yield Trial("stiffness variation 1e-6", "response in proportion", value, 1e-3)
    for variation in (0.9, 0.99):
        system = Idler(variations=(variation, variation)).system()
        value = disagreement(system, 2500.0, chaos=True)
        yield Trial(f"stiffness variation {variation:g}", STEADY, value, 2e-3)


@trial
def damping() -> Trials:
    for ratio in (0.001, 0.01, 0.1, 0.2):
        value = disagreement(Idler(damping=ratio).system(), 2500.0)
        yield Trial(f"damping ratio {ratio:g}", AGREE, value, 2e-3)
    undamped = response(2500.0, damping=0.0)
    broken = undamped.multiple > 0 or not np.isfinite(undamped.dte_rms).all()
    promise = "bounded, not called periodic (1 if it is)"
    yield Trial("damping ratio 0", promise, float(broken), 0.0)


@trial
def backlash() -> Trials:
    for size in (1e-9, 1e-6, 1e-4, 1e-3):
        system = Idler(backlash=size).system()
        value = disagreement(system, 1600.0, chaos=True)
        yield Trial(f"backlash {1e6 * size:g} um", STEADY, value, 2e-3)
    lost = float(response(1600.0, backlash=0.0).contact_loss.max())
    promise = "contact is never lost (part of the cycle)"
    yield Trial("backlash 0", promise, lost, 1e-3)


@trial
def torque() -> Trials:
    expected = response(1600.0).dte_rms
    for size in (1e-6, 1.0, 1e4):
        rms = response(1600.0, torque=size).dte_rms
        value = _relative(rms * 100.0 / size, expected)
        yield Trial(f"torque {size:g} N m", "response scales with torque", value, 1e-6)
    rest = float(response(1600.0, torque=0.0).dte_rms.max())
    yield Trial("torque 0, teeth just touching", "stays at rest [m]", rest, 0.0)


@trial
def free_play() -> Trials:
    """Unloaded gears thrown between the flanks: energy must only leave."""
    system = Idler(torque=0.0, backlash=5e-5, damping=0.04).system()
    state = system.static_state.copy()
    state[1, -1] = 0.05 * system.energy_norm
    before = energy(system, state)
    after = respond(system, 1600.0, Settings(max_periods=200), state)
    value = energy(system, after.state) / before
    yield Trial("free play rattle, torque 0", "energy left, of 1 thrown in", value, 1.0)


@trial
def contact_ratio() -> Trials:
    """Near a whole number the shorter zone vanishes, and with it the vibration."""
    for c in (1.0, 1.0 + 1e-6, 2.0 - 1e-6, 2.0):
        system = Idler(ratios=(c, c)).system()
        value = float(respond(system, 1000.0).dte_rms.max() / _deflection(system))
        yield Trial(f"contact ratio {c:.7g}", OVER_STATIC, value, 1e-4)


def _deflection(system: LumpedSystem) -> float:
    return float(np.abs(system.static_deflection).max())


@trial
def steps() -> Trials:
    system = Idler().system()
    exact = respond(system, 1250.0, replace(ADAPTIVE, accuracy=1e-11, tolerance=1e-8))
    exactly = Settings(step_angle=2.0, tolerance=1e-8, max_periods=20_000)
    for count, bound in ((20, 2e-2), (64, 1e-3), (200, 1e-4), (2000, 1e-6)):
        settings = replace(exactly, steps=count)
        steady = respond(system, 1250.0, settings)
        value = _relative(steady.dte_rms, exact.dte_rms)
        yield Trial(f"{count} steps per period", "RMS against dopri5", value, bound)


@trial
def grazing() -> Trials:
    """At the damping at which contact is just about to be lost."""
    low, high = 0.01, 0.2
    for _ in range(30):
        middle = 0.5 * (low + high)
        lost = response(1700.0, damping=middle).contact_loss.max() > 0.0
        low, high = (middle, high) if lost else (low, middle)
    for name, ratio in (("just lost", low), ("just kept", high)):
        value = disagreement(Idler(damping=ratio).system(), 1700.0)
        yield Trial(f"grazing contact, {name}", AGREE, value, 2e-3)


@trial
def phase() -> Trials:
    zero = response(2500.0)
    for value in (1.0, -1.0, 1e6):
        difference = _relative(response(2500.0, phase=value).dte_rms, zero.dte_rms)
        yield Trial(f"phase {value:g}", "as phase 0", difference, 1e-9)


@trial
def speed_lists() -> Trials:
    system = Idler().system()
    one = sweep(system, [1600.0]).responses[0]
    alone = respond(system, 1600.0)
    difference = _relative(one.dte_rms, alone.dte_rms)
    yield Trial("single speed", "as without a sweep", difference, 0.0)
    speeds = np.arange(1000.0, 1400.0, 50.0)
    up = sweep(system, speeds).column("dte_rms")
    descending = sweep(system, speeds[::-1]).column("dte_rms")
    difference = _relative(descending, up)
    yield Trial("descending list, upward", "as the ascending list", difference, 0.0)


@trial
def jumps() -> Trials:
    """Through every jump, up and down, and with any number of threads."""
    system = Idler(backlash=1e-4).system()
    speeds = np.arange(800.0, 4201.0, 20.0)
    branches = sweep_all([system], speeds, workers=1)
    failed = sum(
        not np.isfinite(branch.column("dte_rms")).all() or not branch.complete
        for branch in branches
    )
    yield Trial("sweeps through all jumps", "branches that fail", float(failed), 0.0)
    again = sweep_all([system], speeds, workers=4)
    different = sum(
        not np.array_equal(a.column("dte_rms"), b.column("dte_rms"))
        for a, b in zip(branches, again, strict=True)
    )
    yield Trial("1 and 4 threads", "branches that differ", float(different), 0.0)


@trial
def speeds_far_off() -> Trials:
    system = Idler().system()
    statics = _quasi_static_rms()
    slow = respond(system, 1.0).dte_rms
    yield Trial("1 Hz", "RMS as in statics", _relative(slow, statics), 2e-2)
    fast = respond(system, 1e6).dte_rms
    ratio = float(fast.max() / _deflection(system))
    yield Trial("1 MHz", OVER_STATIC, ratio, 1e-4)


def _quasi_static_rms() -> Array:
    """RMS of T / (r k) for the rectangular waves."""
    force = 100.0 / RADII[0]
    rms_values = []
    for mean, variation, c in zip(MEANS, VARIATIONS, RATIOS, strict=True):
        part = c - 1.0
        low = force / (mean * (1.0 + variation * (1.0 - part)))
        high = force / (mean * (1.0 - variation * part))
        rms_values.append((high - low) * math.sqrt(part * (1.0 - part)))
    return np.array(rms_values)


@trial
def energy_audit() -> Trials:
    still = (0.0, 0.0)
    free = Idler(torque=0.0, damping=0.0, variations=still, backlash=0.0).system()
    turn = 2.0 * math.pi * float(free.modes.frequency_Hz[-1]) / 1600.0
    exact = replace(ADAPTIVE, accuracy=1e-10)
    for name, settings, bound in (
        ("rk4, 64 steps", Settings(), _dissipation(turn, 64)),
        ("rk4, 128 steps", Settings(steps=128), _dissipation(turn, 128)),
        ("dopri5, 1e-10", exact, 1e-5),
    ):
        value = _energy_drift(free, replace(settings, max_periods=100))
        yield Trial(f"energy drift, {name}", "of 100 undamped periods", value, bound)
    loaded = Idler(harmonics=5, couplings=NO_COUPLINGS).system()
    promise = "meshes deliver what damping takes"
    for name, settings in (("rk4", Settings(steps=512)), ("dopri5", ADAPTIVE)):
        value = _power_gap(loaded, settings)
        yield Trial(f"power balance, {name}", promise, value, 1e-3)


def _dissipation(turn: float, steps: int) -> float:
    """Energy that rk4 takes from the highest mode in 100 periods, (w h)^6 / 72 a step.

    turn : phase of that mode in a period [rad]
    """
    return 100.0 * steps * (turn / steps) ** 6 / 72.0


def _energy_drift(system: LumpedSystem, settings: Settings) -> float:
    """Relative change of energy in closed teeth (no backlash to cross)."""
    state = system.static_state.copy()
    state[1] = 1.0
    after = respond(system, 1600.0, settings, state).state
    return abs(energy(system, after) / energy(system, state) - 1.0)


def energy(system: LumpedSystem, state: Array) -> float:
    """Kinetic and elastic energy with the mean stiffness, contact as it is [J]."""
    rigidity, _, _, shapes, mean, lash, _ = system.arrays
    q, v = state
    s = shapes @ q
    held = 0.5 * float(rigidity @ q**2 + v @ v) - 0.5 * float(mean @ s**2)
    overlap = np.maximum(s, 0.0) + np.minimum(s + lash, 0.0)
    return held + 0.5 * float(mean @ overlap**2)


def _power_gap(system: LumpedSystem, settings: Settings) -> float:
    """Mean power that the meshes deliver over what the damping takes, minus 1.

    Constant torques do no net work on a periodic motion. Without couplings there are
    as many moving modes as meshes, so that the rates give all modal velocities.
    """
    _, history = respond_with_history(system, 1250.0, settings)
    _, damping, _, shapes = system.arrays[:4]
    velocity = np.linalg.solve(shapes, history.rate.T)
    delivered = -_mean(history, (history.force * history.rate).sum(axis=1))
    taken = _mean(history, damping @ velocity**2)
    return abs(delivered / taken - 1.0)


def _mean(history: History, power: Array) -> float:
    h = np.diff(history.time)
    return float(((power[1:] + power[:-1]) / 2.0 * h).sum() / h.sum())


@trial
def bad_numbers() -> Trials:
    """Poisoned excitation and runaway must be called by their name."""
    healthy = Idler().system()
    means = [excitation.mean_stiffness for excitation in healthy.excitations]
    explosive = tuple(
        MeshExcitation(
            (PairExcitation(constant_wave(-mean), constant_wave(0.0)),), mean
        )
        for mean in means
    )
    runaway = respond(LumpedSystem(healthy.train, explosive), 1600.0)
    plausible = runaway.status != "diverged" or np.isfinite(runaway.dte_rms).any()
    promise = "called diverged (0), figures NaN"
    yield Trial("negative stiffness, runaway", promise, float(plausible), 0.0)
