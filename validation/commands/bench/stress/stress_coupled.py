"""Trying to break the coupled lumped model, on gears solved by finite elements."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from fegear.files.errors import InputError
from fegear.gearset import load_gear_set
from fegear.gearset.model import GearSet
from fegear.gearset.read import make_gear_set
from fegear.statics.excitation import Excitations
from fegear.statics.excitation_settings import ExcitationSettings
from fegear.statics.solving import solve_mesh
from fegear.train.lumped_models import lumped_system
from fegear.train.model_settings import LumpedModel
from lumped.common.array_types import Array
from lumped.common.checks import require_present
from lumped.steady.integration_settings import Settings
from lumped.steady.respond import respond
from lumped.steady.steady_state import Speed
from lumped.steady.steppers import FixedStepper
from lumped.steady.sweep import sweep
from lumped.train.coupled import CoupledContacts
from lumped.train.system import LumpedSystem
from validation.commands.bench.stress.trials import Family, Trial, Trials
from validation.oracles.coupled_train import instant_of

PAIR, IDLER = "liu-pair", "liu-idler"
COUPLED = LumpedModel(number="coupled")
FINE = Settings(steps=512)
SPEED = 2000.0  # Hz, near the resonance of the pair
RATTLING = 2750.0  # Hz, where it loses contact
LOOSE = {"dynamics.damping_ratio": 0.02}
MANY_TEETH: Mapping[str, Any] = {
    "name": "many-teeth",
    "defaults": {"module_mm": 2.0, "face_width_mm": 20.0},
    "gear": [
        {"name": "pinion", "teeth": 19, "hub_radius_mm": 9.0, "profile_shift": 0.3},
        {"name": "wheel", "teeth": 400, "hub_radius_mm": 300.0},
    ],
    "mesh": [
        {"driver": "pinion", "driven": "wheel", "operating_pressure_angle_deg": 20.5}
    ],
    "load": {"gear": "pinion", "torques_Nm": [50.0]},
}
TRIALS: list[Family] = []
FINER = "RMS and multiple on finer steps, or both none"


def trial(function: Family) -> Family:
    """Add a family of attempts to the list."""
    TRIALS.append(function)
    return function


@cache
def excitations() -> Excitations:
    """Coarse tables, solved once for all attempts."""
    return Excitations(ExcitationSettings(resolution="coarse", positions=32))


def system_of(
    edits: Mapping[str, Any] | None = None,
    name: str | Mapping[str, Any] = PAIR,
    torque: float = 100.0,
    model: LumpedModel = COUPLED,
) -> tuple[GearSet, LumpedSystem]:
    """The lumped system of a gear set, by its name or its tables, with edits by key."""
    if isinstance(name, str):
        gear_set = load_gear_set(name, edits)
    else:
        gear_set = make_gear_set(name, edits)
    return gear_set, lumped_system(gear_set, torque, model, excitations())


def disagreement(system: LumpedSystem, frequency: float = SPEED) -> float:
    """RMS at the usual steps against fine ones, relative.

    Infinite where period multiples differ or a motion diverged; 0 for two motions that
    do not repeat.
    """
    one, two = respond(system, frequency), respond(system, frequency, FINE)
    finite = np.isfinite([one.dte_rms, two.dte_rms]).all()
    if one.multiple != two.multiple or not finite:
        return math.inf
    return _relative(one.dte_rms, two.dte_rms) if one.multiple else 0.0


def _relative(one: Array, two: Array) -> float:
    return float(np.max(np.abs(one - two)) / np.max(np.abs(two)))


@trial
def coupled_torque() -> Trials:
    """From a thousandth of the torque on; of a thousandfold one teeth would bend."""
    for torque in (0.1, 1.0, 1e3):
        _, system = system_of(torque=torque)
        yield Trial(f"coupled, {torque:g} N m", FINER, disagreement(system), 5e-3)
    yield refusal("coupled, 1e5 N m", torque=1e5)


def refusal(
    name: str, edits: Mapping[str, Any] | None = None, torque: float = 100.0
) -> Trial:
    """Trial that what cannot be physical is refused."""
    try:
        system_of(edits, torque=torque)
    except InputError:
        return Trial(name, "refused (0)", 0.0, 0.0)
    return Trial(name, "refused (0)", 1.0, 0.0)


@trial
def coupled_stiffness() -> Trials:
    """A hundredfold load on a hundredfold modulus changes nothing but the time."""
    _, soft = system_of()
    firm = {f"gear.{g}.young_modulus_GPa": 206e2 for g in (1, 2)}
    _, stiff = system_of(firm, torque=1e4)
    one, two = respond(soft, SPEED), respond(stiff, 10.0 * SPEED)
    value = _relative(two.dte_rms, one.dte_rms)
    promise = "RMS at ten times the speed and a hundred times the load"
    yield Trial("coupled, Young's modulus x 100", promise, value, 1e-6)
    for name, modulus in (("soft", 2.06), ("stiff", 2.06e4)):
        _, system = system_of({"gear.2.young_modulus_GPa": modulus})
        natural = float(system.resonances_Hz[-1])
        value = disagreement(system, 0.8 * natural)
        yield Trial(f"coupled, wheel 100 times as {name}", FINER, value, 2e-3)


@trial
def coupled_damping() -> Trials:
    for ratio in (1e-3, 0.2):
        _, system = system_of({"dynamics.damping_ratio": ratio})
        yield Trial(
            f"coupled, damping ratio {ratio:g}", FINER, disagreement(system), 2e-3
        )
    _, system = system_of({"dynamics.damping_ratio": 0.0})
    undamped = respond(system, SPEED)
    broken = undamped.multiple > 0 or not np.isfinite(undamped.dte_rms).all()
    promise = "bounded, not called periodic (1 if it is)"
    yield Trial("coupled, damping ratio 0", promise, float(broken), 0.0)


@trial
def coupled_backlash() -> Trials:
    for size in (1e-3, 1.0, 100.0):
        _, system = system_of({"mesh.1.backlash_um": size} | LOOSE)
        value = disagreement(system, RATTLING)
        yield Trial(f"coupled, backlash {size:g} um", FINER, value, 2e-3)
    _, system = system_of({"mesh.1.backlash_um": 0} | LOOSE)
    lost = float(respond(system, RATTLING).contact_loss.max())
    promise = "contact is never lost (part of the cycle)"
    yield Trial("coupled, backlash 0", promise, lost, 1e-3)


@trial
def coupled_relief() -> Trials:
    """Deeper than the teeth deflect, and where no pair is left without."""
    for depth, length in ((20.0, 0.5), (100.0, 0.5), (30.0, 0.9)):
        relief = {"magnitude_um": depth, "length_pitches": length}
        gear_set, system = system_of({"mesh.1.tip_relief": relief})
        name = f"coupled, relief {depth:g} um over {length:g} pitches"
        yield Trial(name, FINER, disagreement(system), 2e-3)
        settings = excitations().settings.statics_of(gear_set)
        table = solve_mesh(gear_set, 1, [100.0], settings).table
        loaded = require_present(system.loaded, "coupled model")
        expected = float(table["ste_m"].mean())
        value = abs(float(loaded.deflection[:-1].mean()) / expected - 1.0)
        yield Trial(name, "mean deflection at rest by finite elements", value, 0.02)


@trial
def coupled_bodies() -> Trials:
    _, thin = system_of({"gear.2.hub_radius_mm": 64.0})
    _, many = system_of(name=MANY_TEETH)
    for name, system in (("a thin rim", thin), ("400 teeth", many)):
        natural = float(system.resonances_Hz[-1])
        value = disagreement(system, 0.8 * natural)
        yield Trial(f"coupled, {name}", FINER, value, 2e-3)


@trial
def coupled_pitch_errors() -> Trials:
    for size, listed in ((50.0, [50.0, 0.0] * 19), (500.0, [500.0, *[0.0] * 37])):
        _, system = system_of({"gear.1.pitch_errors_um": listed})
        value = disagreement(system, 1500.0)
        yield Trial(f"coupled, pitch errors of {size:g} um", FINER, value, 5e-3)
    jammed = [1000.0, *[0.0] * 37]
    yield refusal("coupled, pitch errors of 1 mm", {"gear.1.pitch_errors_um": jammed})


@trial
def coupled_fold() -> Trials:
    """Trials of the speed at which the pair leaves its lower branch as the
    speed rises.
    """
    _, system = system_of(LOOSE)
    # from far below on: from rest near the fold the motion may rise at once
    speeds = np.r_[2400.0:2690.0:50.0, 2690.0:2760.0:2.0]
    speeds_of_jump = []
    for steps in (64, 256):
        rms = sweep(system, speeds, "up", Settings(steps=steps)).column("dte_rms")
        rise = np.diff(np.log(rms[:, 0]))
        speeds_of_jump.append(
            float(speeds[rise.argmax()]) if rise.max() > 0.3 else math.nan
        )
    value = abs(speeds_of_jump[1] / speeds_of_jump[0] - 1.0)
    yield Trial("coupled, fold", "its speed on finer steps", value, 3e-3)
    for beside in (-4.0, 4.0):
        value = disagreement(system, speeds_of_jump[0] + beside)
        yield Trial(f"coupled, {beside:+g} Hz from a fold", FINER, value, 5e-3)


@trial
def coupled_phase() -> Trials:
    zero = respond(system_of({"mesh.2.phase": 0.25}, IDLER)[1], 1600.0)
    for phase in (1.25, -0.75):
        _, system = system_of({"mesh.2.phase": phase}, IDLER)
        value = _relative(respond(system, 1600.0).dte_rms, zero.dte_rms)
        yield Trial(f"coupled, phase {phase:g}", "as phase 0.25", value, 1e-9)


@trial
def coupled_energy() -> Trials:
    """Thrown into undamped vibration, the positions of the meshes held still."""
    # body modes have a damping of their own
    rigid = LumpedModel(number="coupled", without=("modes",))
    _, moving = system_of({"dynamics.damping_ratio": 0.0}, IDLER, model=rigid)
    contacts = require_present(moving.contacts, "coupled model")
    system = replace(moving, contacts=_standing(contacts))
    place, state = instant_of(system, 0.0), system.static_state.copy()
    natural = system.resonances_Hz
    state[1] = 0.1 * np.abs(state[0]) * 2.0 * np.pi * natural

    def energy(now: Array) -> float:
        return 0.5 * float(now[1] @ now[1]) + place.potential(now[0])

    thrown_in = energy(state) - place.potential(state[0])
    for steps, bound in ((64, 1e-4), (256, 1e-6)):
        at = Speed(float(natural[-1]), Settings(steps=steps, step_angle=2.0))
        after, _ = FixedStepper(system).record(state, at, 20)
        value = abs(energy(after) - energy(state)) / thrown_in
        name = f"coupled idler, energy drift, {steps} steps"
        yield Trial(name, "of 20 undamped periods", value, bound)


def _standing(coupled: CoupledContacts) -> CoupledContacts:
    """Contacts with all positions equal to the first."""
    contacts = coupled.contacts

    def first(table: Array) -> Array:
        return np.repeat(table[:, :1], table.shape[1], axis=1)

    compliance = contacts.normal_compliance
    still = contacts._replace(
        gap=first(contacts.gap),
        load_curve=first(contacts.load_curve),
        normal_compliance=np.tile(compliance[:1], (len(compliance), 1, 1)),
    )
    return replace(
        coupled,
        contacts=still,
        rows=first(coupled.rows),
        inertia_rows=first(coupled.inertia_rows),
    )
