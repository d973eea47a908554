"""Our values of what the sources publish, each a function of a subject."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np

from fegear.gearset.loss_factor import (
    equal_share_loss_factor,
    sliding_per_base_pitch,
)
from fegear.gearset.lumped_train import train_of
from fegear.gearset.model import Gear
from fegear.gearset.planes import Plane
from lumped.common.checks import require_present
from lumped.train.modes import natural_modes
from validation.oracles import hertz, iso6336, potential_energy, ring
from validation.published import rack_cut_beam
from validation.published.loaded_pair import LoadedPair

MPA = 1e-6
PER_ISO_UNIT = 1.0 / iso6336.SI_PER_ISO_UNIT


def contact_ratio(subject: LoadedPair) -> float:
    return subject.pair.contact_ratio


def path_length(subject: LoadedPair) -> float:
    """Length of the path of contact [mm]."""
    return 1e3 * (subject.pair.path_end - subject.pair.path_start)


def hertz_pressure(subject: LoadedPair) -> float:
    """At the pitch point under the whole load, plane strain [MPa]."""
    s1 = subject.pair.pitch_point
    radius = hertz.effective_radius(s1, subject.pair.line_of_action - s1)
    modulus = hertz.effective_modulus(*_materials(subject), "strain")
    load = subject.force / subject.width
    return MPA * float(hertz.peak_pressure(load, radius, modulus))


def hertz_pressure_fe(subject: LoadedPair) -> float:
    """The largest at the pitch point by finite elements, plane strain [MPa]."""
    cycle = subject.at(0.0, "strain")
    return MPA * float(cycle.pressure[0, 0, cycle.teeth == 0][0])


def hertz_pressure_fe_one_pair(subject: LoadedPair) -> float:
    """Largest pressure of one pair that carries the whole load [MPa]."""
    return MPA * float(subject.one_pair("strain").pressure[0, 0, 0])


def contact_stress_number(subject: LoadedPair) -> float:
    """sigma_H0 of ISO 6336-2: the Hertz pressure times Z_eps [MPa]."""
    reduction = math.sqrt((4.0 - subject.pair.contact_ratio) / 3.0)
    return reduction * hertz_pressure(subject)


def hertz_stiffness(subject: LoadedPair) -> float:
    """Stiffness of Yang and Sun, pi E b / (4 (1 - nu^2)) for equal gears [N/m]."""
    return subject.width / hertz.linear_compliance(*_materials(subject))


def _materials(subject: LoadedPair) -> tuple[hertz.Material, hertz.Material]:
    one, two = (
        hertz.Material(gear.young_modulus, gear.poisson_ratio) for gear in subject.gears
    )
    return one, two


def loss_factor_ohlendorf(subject: LoadedPair) -> float:
    """Loss over transmitted power and friction coefficient, Ohlendorf (1958)."""
    start, end = subject.pair.path
    share = 0.5 * (1.0 - (end - start) + start**2 + end**2)
    return sliding_per_base_pitch(subject.teeth) * share


def loss_factor_rigid(subject: LoadedPair) -> float:
    """Loss factor integrated over the path: pairs share the load equally."""
    return equal_share_loss_factor(subject.pair)


def loss_factor_fe(subject: LoadedPair) -> float:
    """Loss factor with the load sharing of finite elements, plane strain."""
    return float(subject.solved("strain").loss_factors[0])


def iso_theoretical(subject: LoadedPair) -> float:
    """c'_th of the virtual spur gears [N/(mm um)]."""
    return iso6336.theoretical_single_stiffness(_virtual_teeth(subject), subject.shifts)


def iso_single(subject: LoadedPair) -> float:
    """c' = c'_th C_M C_R C_B cos(beta) [N/(mm um)]."""
    inputs = subject.inputs
    rack = iso6336.basic_rack_factor(inputs["dedendum_modules"])
    single = iso6336.single_stiffness(
        iso_theoretical(subject),
        blank_factor=iso_blank_factor(subject),
        rack_factor=rack,
    )
    return single * math.cos(_helix(subject))


def iso_blank_factor(subject: LoadedPair) -> float:
    """C_R of the pinion's web, whose rim ends at the bore."""
    teeth = subject.pair.driver
    rim = (teeth.root_radius - teeth.hub_radius) / teeth.module
    return iso6336.gear_blank_factor(subject.inputs.get("web_ratio", 1.0), rim)


def iso_mesh(subject: LoadedPair) -> float:
    """c_gamma_alpha with the transverse contact ratio [N/(mm um)]."""
    ratio = subject.pair.contact_ratio
    if "helix_angle_deg" in subject.inputs:
        ratio = transverse_contact_ratio(subject)
    return iso6336.mesh_stiffness(iso_single(subject), ratio)


def transverse_contact_ratio(subject: LoadedPair) -> float:
    """Contact ratio of the source's helical gears with standard addenda."""
    inputs, helix = subject.inputs, _helix(subject)
    m, a = inputs["normal_module_mm"], inputs["center_distance_mm"]
    angle = math.atan(math.tan(subject.pair.driver.pressure_angle) / math.cos(helix))
    radii = [0.5 * m * z / math.cos(helix) for z in inputs["teeth"]]
    bases = [r * math.cos(angle) for r in radii]
    tips = [r + m * (1.0 + x) for r, x in zip(radii, subject.shifts, strict=True)]
    rolls = sum(math.sqrt(t**2 - b**2) for t, b in zip(tips, bases, strict=True))
    pitch = math.pi * m / math.cos(helix) * math.cos(angle)
    return (rolls - math.sqrt(a**2 - sum(bases) ** 2)) / pitch


def _helix(subject: LoadedPair) -> float:
    return math.radians(subject.inputs.get("helix_angle_deg", 0.0))


def _virtual_teeth(subject: LoadedPair) -> tuple[float, float]:
    """z_n = z / (cos(beta_b)^2 cos(beta)), of the inputs where they have teeth."""
    helix, alpha = _helix(subject), subject.pair.driver.pressure_angle
    base_helix = math.asin(math.sin(helix) * math.cos(alpha))
    one, two = subject.inputs.get("teeth", subject.teeth)
    return iso6336.virtual_teeth((one, two), helix, base_helix)


def single_stiffness_fe(subject: LoadedPair) -> float:
    """Slope of force over deflection of one pair at the pitch point, as c'."""
    slope = float(subject.one_pair().local_stiffness[0, 0]) / subject.width
    return PER_ISO_UNIT * slope * math.cos(_helix(subject))


def single_stiffness_fe_no_twist(subject: LoadedPair) -> float:
    """Slope of one pair without the twist of bodies from hub to root circle."""
    slope = float(subject.one_pair().local_stiffness[0, 0])
    compliance = 1.0 / slope - sum(_twist(gear, subject) for gear in subject.gears)
    return PER_ISO_UNIT * math.cos(_helix(subject)) / (compliance * subject.width)


def _twist(gear: Gear, subject: LoadedPair) -> float:
    """Compliance of a body along the line of action [m/N]."""
    body = ring.Ring(
        hub_radius=gear.geometry.hub_radius,
        outer_radius=gear.geometry.root_radius,
        shear_modulus=ring.shear_modulus(gear.young_modulus, gear.poisson_ratio),
        face_width=subject.width,
    )
    return 1.0 / ring.line_of_action_stiffness(body, gear.geometry.base_radius)


def mesh_stiffness_fe(subject: LoadedPair) -> float:
    """Mean slope of force over transmission error, as c_gamma."""
    slope = float(subject.solved().cycle.local_stiffness.mean()) / subject.width
    return PER_ISO_UNIT * slope


def start_stiffness_rack_cut(subject: LoadedPair) -> float:
    """Stiffness of two pairs at the start, by the conventions of ROSS [N/m]."""
    ratio = subject.pair.contact_ratio
    return rack_cut_beam.mesh_stiffness(subject.gears, ratio, 0.0, subject.width)


def mean_stiffness_rack_cut(subject: LoadedPair) -> float:
    """Mean over the mesh cycle, by the conventions of ROSS [N/m]."""
    ratio = subject.pair.contact_ratio
    return rack_cut_beam.mean_stiffness(subject.gears, ratio, subject.width)


def start_stiffness_energy(subject: LoadedPair) -> float:
    """Stiffness by our potential-energy method, where the driven tip enters [N/m]."""
    return float(_energy(subject, np.array([subject.pair.path[0] + 1e-9]))[0])


def mean_stiffness_energy(subject: LoadedPair) -> float:
    """Mean by our potential-energy method over the mesh cycle [N/m]."""
    places = (np.arange(2000) + 0.5) / 2000
    return float(_energy(subject, places).mean())


def _energy(subject: LoadedPair, places: np.ndarray) -> np.ndarray:
    """Pairs with the linear contact of Yang and Sun, as ROSS has it."""
    return potential_energy.mesh_stiffness(
        *subject.analytic,
        subject.pair.operating_pressure_angle,
        places,
        subject.force,
        subject.width,
        contact_law="linear",
    )


def start_stiffness_fe(subject: LoadedPair) -> float:
    """Force over deflection where the driven tip enters, plane stress [N/m]."""
    return float(subject.at(subject.pair.path[0]).stiffness[0, 0])


def mean_stiffness_fe(subject: LoadedPair, plane: Plane = "stress") -> float:
    """Mean of force over deflection, plane stress [N/m]."""
    return float(subject.solved(plane).cycle.stiffness.mean())


def natural_frequency(subject: LoadedPair) -> float:
    """Frequency of two free gears with the mesh stiffness of the gear set [Hz]."""
    train = train_of(subject.gear_set, subject.torque)
    given = subject.gear_set.meshes[0].mean_stiffness
    stiffness = require_present(given, "mean_stiffness_N_per_m")
    return float(natural_modes(train, [stiffness]).frequency_Hz.max())


QUANTITIES: Mapping[str, Callable[[LoadedPair], float]] = {
    function.__name__: function
    for function in (
        *(contact_ratio, path_length, hertz_pressure, hertz_pressure_fe),
        *(hertz_pressure_fe_one_pair, contact_stress_number),
        *(hertz_stiffness, loss_factor_ohlendorf, loss_factor_rigid, loss_factor_fe),
        *(iso_theoretical, iso_single, iso_blank_factor, iso_mesh),
        *(single_stiffness_fe, mesh_stiffness_fe),
        *(start_stiffness_rack_cut, mean_stiffness_rack_cut),
        *(start_stiffness_energy, mean_stiffness_energy),
        *(start_stiffness_fe, mean_stiffness_fe, natural_frequency),
    )
}
