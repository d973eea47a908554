"""Gear sets as objects of ROSS and openTorsion."""

from __future__ import annotations

import math
from importlib import import_module
from typing import Any

import numpy as np

from fegear.boundary import public
from fegear.files.errors import InputError
from fegear.gearset.model import GearSet
from fegear.gearset.power_path import input_torques, mesh_torques_at
from fegear.statics.excitation_settings import ExcitationSettings
from fegear.statics.settings import StaticsSettings
from fegear.statics.solving import solve_mesh
from fegear.train.lumped_models import lumped_system
from fegear.train.model_settings import LumpedModel
from lumped.train.coordinates import rigid_groups
from lumped.train.system import LumpedSystem
from lumped.train.train import Train

SUPPORT = 1e13  # stiffness of bearings [N/m], above that of any mesh by 1e4
SHAFT_LENGTH, SHAFT_DIAMETER = 0.02, 0.03  # [m]
LIGHT_DENSITY, STIFF_MODULUS = 1e-3, 1e14  # of shafts [kg/m3], [Pa]


@public
def to_opentorsion(
    gear_set: GearSet, torque: float | None = None, model: LumpedModel | None = None
) -> Any:
    """A gear set as an assembly of openTorsion.

    Gears are disks, whose meshes and shafts are springs. The stiffness of a mesh is its
    average in model 1 at the torque. The natural frequencies of the assembly are
    therefore those about averages of model 1, the second column of ``fegear modes``.
    Each mesh is damped by the damping ratio of its two gears alone.

    Parameters
    ----------
    gear_set : GearSet
        Gear set without carrier and without motion of the gears' centres.
    torque : float, optional
        Torque on the input gear [N m]; the middle load case unless given.
    model : LumpedModel, optional
        Damping ratio and source of the mesh stiffness; what else it has is not read.

    Returns
    -------
    opentorsion.Assembly
        Rotations in rad, positive counter-clockwise, one node for each gear in the
        order of the gear set, or one for gears that a shaft without stiffness connects.

    Raises
    ------
    InputError
        If openTorsion is not installed or the gear set has a carrier.

    Examples
    --------
    >>> import fegear
    >>> assembly = fegear.to_opentorsion(fegear.load_gear_set("liu-pair"), torque=100.0)
    >>> assembly.dofs
    2
    """
    opentorsion = _import_package("opentorsion", "opentorsion")
    system = _mesh_springs(
        gear_set, _single_torque(gear_set, torque), model or LumpedModel()
    )
    train, nodes = system.train, _nodes_of_gears(system.train)
    disks = [
        opentorsion.Disk(node, gear.inertia, k=gear.coupling_stiffness)
        for node, gear in zip(nodes, train.gears, strict=True)
    ]
    shafts = [
        opentorsion.Shaft(*(nodes[i] for i in shaft.gears), k=shaft.stiffness)
        for shaft in train.shafts
        if shaft.stiffness is not None
    ]
    teeth = []
    for index, mesh in enumerate(train.meshes):
        ends = mesh.driver, mesh.driven
        radii = [train.gears[i].base_radius for i in ends]
        damping = 2.0 * train.damping_ratio * _critical_damping(system, index)
        driver = opentorsion.ElasticGear(nodes[mesh.driver], 0.0, radii[0])
        driven = opentorsion.ElasticGear(
            nodes[mesh.driven],
            0.0,
            radii[1],
            k=float(system.modes.mean_stiffness[index]) * radii[0] ** 2,
            c=damping * radii[0] ** 2,
            parent=driver,
        )
        teeth += [driver, driven]
    return opentorsion.Assembly(shafts, disks, elastic_gear_elements=teeth)


@public
def to_ross(
    gear_set: GearSet, torque: float | None = None, model: LumpedModel | None = None
) -> Any:
    """A pair of gears as two rotors of ROSS with the mesh stiffness of its teeth.

    The stiffness over the rotation of the driver is that of ``fegear stiffness`` at the
    torque. Shafts are light and stiff and their bearings too, so that the gears rotate
    alone: put the rotors' own in their place. The mesh of ROSS has neither backlash nor
    damping nor the gap of reliefs.

    Parameters
    ----------
    gear_set : GearSet
        Gear set of one mesh between external gears.
    torque : float, optional
        Torque on the driver [N m]; the middle load case unless given.
    model : LumpedModel, optional
        Source of the mesh stiffness; what else it has is not read.

    Returns
    -------
    ross.MultiRotor
        Rotors of driver and driven gear, which are coupled at their nodes 0.

    Raises
    ------
    InputError
        If ROSS is not installed or the gear set has other meshes or internal gears.
    """
    ross = _import_package("ross", "ross-rotordynamics")
    internal = any(mesh.pair.is_internal for mesh in gear_set.meshes)
    if len(gear_set.meshes) > 1 or internal:
        raise InputError(
            f"{gear_set.name}: ROSS has one mesh between two external gears"
        )
    on_input = _single_torque(gear_set, torque)
    system = _mesh_springs(gear_set, on_input, model or LumpedModel())
    (mesh,) = system.train.meshes
    solved = solve_mesh(
        gear_set,
        torques_on_driver=mesh_torques_at(gear_set, on_input),
        settings=_mesh_statics(model or LumpedModel()),
    )
    stiffness = solved.table["stiffness_N_per_m"][0]
    rotors = [_ross_rotor(ross, system.train, i) for i in (mesh.driver, mesh.driven)]
    train = ross.MultiRotor(
        *rotors,
        coupled_nodes=(0, 0),
        gear_mesh_stiffness=float(stiffness.mean()),
        update_mesh_stiffness=True,
    )
    pitch = 2.0 * math.pi / system.train.gears[mesh.driver].teeth
    train.mesh.theta_range = pitch * np.linspace(0.0, 1.0, stiffness.size + 1)
    train.mesh.stiffness_range = np.append(stiffness, stiffness[0])
    return train


def _import_package(name: str, to_install: str) -> Any:
    try:
        return import_module(name)
    except ModuleNotFoundError:
        raise InputError(
            f"{name} is not installed; `pip install {to_install}` does it"
        ) from None


def _single_torque(gear_set: GearSet, torque: float | None) -> float:
    """The torque that is asked for [N m], or the middle load case."""
    cases = input_torques(gear_set)
    if torque is None and not cases:
        raise InputError(f"torque is missing; {gear_set.name} has no load case")
    return cases[len(cases) // 2] if torque is None else torque


def _mesh_springs(gear_set: GearSet, torque: float, model: LumpedModel) -> LumpedSystem:
    """The gear set by model 1, whose meshes are springs."""
    if gear_set.carrier is not None:
        raise InputError(
            f"{gear_set.name}: gears on a carrier cannot be told by disks and springs"
        )
    springs = LumpedModel(
        number=1, damping_ratio=model.damping_ratio, excitation=model.excitation
    )
    return lumped_system(gear_set, torque, springs)


def _mesh_statics(model: LumpedModel) -> StaticsSettings:
    source = model.excitation
    if not isinstance(source, ExcitationSettings):
        raise InputError("excitation = tables of meshes; must be ExcitationSettings")
    return StaticsSettings(
        plane=source.plane, resolution=source.resolution, estimate_error=False
    )


def _nodes_of_gears(train: Train) -> list[int]:
    """Node of each gear: gears that move as one share theirs."""
    nodes = [0] * len(train.gears)
    for node, members in enumerate(sorted(map(sorted, rigid_groups(train)))):
        for gear in members:
            nodes[gear] = node
    return nodes


def _critical_damping(system: LumpedSystem, mesh: int) -> float:
    """Half of the critical damping of a mesh between its two gears alone [N s/m]."""
    ends = system.train.meshes[mesh].driver, system.train.meshes[mesh].driven
    gears = [system.train.gears[i] for i in ends]
    mobility = sum(gear.base_radius**2 / gear.inertia for gear in gears)
    return math.sqrt(float(system.modes.mean_stiffness[mesh]) / mobility)


def _ross_rotor(ross: Any, train: Train, index: int) -> Any:
    gear = train.gears[index]
    light = ross.Material("light", rho=LIGHT_DENSITY, E=STIFF_MODULUS, Poisson=0.3)
    shaft = ross.ShaftElement(
        L=SHAFT_LENGTH, idl=0.0, odl=SHAFT_DIAMETER, material=light
    )
    teeth = ross.GearElement(
        n=0,
        m=gear.mass or 1.0,
        Id=gear.inertia,
        Ip=gear.inertia,
        n_teeth=gear.teeth,
        base_diameter=2.0 * gear.base_radius,
    )
    bearings = [
        ross.BearingElement(n=n, kxx=SUPPORT, kyy=SUPPORT, kzz=SUPPORT, cxx=0.0)
        for n in range(2)
    ]
    return ross.Rotor([shaft], [teeth], bearings)
