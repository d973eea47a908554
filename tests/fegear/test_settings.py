"""No setting of a public dataclass, and no argument of a function, passes unchecked."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import fields, is_dataclass, replace
from fractions import Fraction
from inspect import isfunction, signature
from types import UnionType
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

import numpy as np
import pytest

import fegear
import lumped
from fegear.commands.rattle.machine_studies import LoadMachineRef, MotionMachineRef
from fegear.files.errors import InputError
from fegear.statics.given_tables import GivenTables
from fegear.studies.settings import Setting
from fegear.studies.study import Study
from fegear.studies.trains.gear_sets import GearSetRef
from lumped.branches.branch_settings import BranchSettings
from lumped.steady.maps import Axis
from lumped.train.at_rest import RestReference
from lumped.train.coupled import CoupledContacts
from lumped.train.friction import ToothFriction
from lumped.train.space import MotionInSpace
from lumped.train.waves import constant_wave

GEARS = fegear.load_gear_set("liu-pair")
RESULTS = {  # what functions return, made by nobody else
    CoupledContacts,
    fegear.FaceLoads,
    fegear.StaticsResult,
    RestReference,
    lumped.Attractor,
    lumped.Branch,
    lumped.History,
    lumped.Modes,
    lumped.Response,
    MotionInSpace,
}
READ = {fegear.GearSet}  # made of files and tables, by a schema that checks them
FREE = {
    "name",
    "root_stress",
    "gearbox",
    "machine",
    "wheel",
    "file",
    "orbit",
    "along",
    "gear_name",
    "time_history",
    "gear_set",
    "table",
    "history",
    "runs",
    "cases",
    "numbers",
    "measured",
    "like",
    "directory",
}  # any text
PAIR = lumped.PairExcitation(constant_wave(1e8), constant_wave(0.0))
SPRING = lumped.MeshExcitation((PAIR,), 1e8)
TWO = tuple(
    lumped.Gear(name=name, teeth=30, base_radius=0.04, inertia=1e-3, torque=torque)
    for name, torque in (("a", 1.0), ("b", 1.0))
)
TRAIN = lumped.Train(
    gears=TWO, meshes=(lumped.Mesh(driver=0, driven=1, pressure_angle=0.35),)
)
TABLE = lumped.MeshTable(np.ones(1), np.arange(4) / 4, {})
EXAMPLES = [  # of classes that must be told something
    BranchSettings(),
    ToothFriction(0.1),
    *TWO[:1],
    TRAIN,
    TRAIN.meshes[0],
    lumped.Shaft(gears=(0, 1)),
    lumped.Carrier(name="c", gears=(0,), radius=0.05, angles=(0.0,), inertia=1e-3),
    lumped.BallBearing(balls=9, element_diameter=7.94e-3, pitch_diameter=38.5e-3),
    lumped.RollerBearing(
        rollers=12, element_diameter=7.5e-3, pitch_diameter=39e-3, length=8e-3
    ),
    lumped.Waviness(order=3, amplitude=1e-6),
    SPRING,
    SPRING.pairs[0],
    constant_wave(1.0),
    lumped.LumpedSystem(TRAIN, (SPRING,)),
    lumped.StiffnessParameters(mean=1e8, variation=0.3, contact_ratio=1.5),
    TABLE,
    GivenTables((("t.csv", TABLE),)),
    fegear.Basins(machine="roots-a"),
    fegear.Clatter(gearbox="seed-five-speed"),
    fegear.RattleThreshold(machine="roots-a"),
    fegear.Eccentric(radius=20.0, eccentricity=6.0),
    fegear.MachineFromGears(
        gear_set="liu-pair", speed_rpm=1500.0, drag_Nm=1.0, eccentricity_um=9.0
    ),
    fegear.BuiltinSets(),
    fegear.DerivedGeometry(),
    fegear.GearMesh(),
    fegear.NewFile(kind="pair"),
    fegear.ContactPictures(file="a.png"),
    fegear.MeshStiffness(),
    fegear.Identification(gear_set="liu-pair"),
    fegear.Manifolds(machine="roots-a"),
    fegear.RattleNoise(machine="roots-a"),
    fegear.OrbitBifurcations(machine="roots-a", over=("delta=1:2",)),
    fegear.PeriodicOrbits(machine="roots-a"),
    fegear.RunDown(file="measured.csv"),
    *(kind(gear_set="liu-pair") for kind in (fegear.Sweep, fegear.Theory)),
    fegear.Dynamics(gear_set="liu-pair"),
    fegear.Motion(gear_set="liu-pair", speed=1000.0),
    fegear.BearingLoad(gear_set="liu-pair"),
    fegear.NaturalModes(gear_set="liu-pair"),
    fegear.PlanetLoadSharing(gear_set="planetary-24-36-96"),
    fegear.Signals(gear_set="liu-pair", speed=1000.0),
    fegear.FaultSignals(gear_set="liu-pair", over="pitch_error=0:5:6", rpm=900.0),
    fegear.CampbellDiagram(gear_set="turbo-pair"),
    fegear.LoadedShafts(gear_set="helical-machine"),
    fegear.ModelExport(gear_set="liu-pair"),
    fegear.ClosedForms(),
    fegear.Validation(cases=("idler",), directory="report"),
    fegear.Ablation(gear_set="liu-pair", speeds=[1e3]),
    fegear.Stability(gear_set="liu-pair", over="friction=0,0.1", speeds=[1e3, 2e3]),
    fegear.Bifurcations(gear_set="liu-pair", over="mesh_frequency_Hz=1e3,2e3"),
    fegear.Branches(gear_set="liu-pair", speeds=(1e3, 2e3)),
    fegear.Map(gear_set="liu-pair", over=["torque_Nm=50,100"], at=1e3),
    Axis("friction", (0.0, 0.1)),
    GearSetRef(name="liu-pair"),
    LoadMachineRef(name="roots-a"),
    MotionMachineRef(name="roots-a"),
]
INSTANCES = {type(instance): instance for instance in EXAMPLES}
OFFERED = [getattr(home, name) for home in (fegear, lumped) for name in home.__all__]


def parts(kind: Any) -> Iterator[Any]:
    """A type and those that it is made of."""
    yield kind
    for argument in get_args(kind):
        if get_origin(kind) is not Literal:
            yield from parts(argument)


def public_classes() -> list[type]:
    """Dataclasses that the packages offer, and those of their fields."""
    classes: list[type] = []
    queue = [member for member in OFFERED if is_dataclass(member)] + list(INSTANCES)
    while queue:
        kind = queue.pop(0)
        if kind in {*classes} | RESULTS | READ:
            continue
        classes.append(kind)
        for hint in get_type_hints(kind).values():
            queue += [p for p in parts(hint) if is_dataclass(p)]
    return classes


def example(kind: type) -> Any:
    return INSTANCES[kind] if kind in INSTANCES else kind()


def wrong_values(hint: Any) -> Iterator[Any]:
    """Of other types, NaN among numbers, and words that are none of the allowed."""
    kinds = get_args(hint) if get_origin(hint) in (Union, UnionType) else (hint,)
    if get_origin(kinds[0]) is tuple:
        yield 1.0
        element = get_args(kinds[0])[0]
        yield from ((value,) for value in wrong_values(element))
        return
    yield from ("no such word", math.nan, [2.0])
    if not any(kind in (int, float) for kind in kinds):
        yield 1.5
    yield -math.inf
    if bool not in kinds:
        yield True
    if int in kinds and float not in kinds:
        yield 2.5
    yield from (2.0 + 1.0j, object())


def settings() -> Iterator[Any]:
    for kind in public_classes():
        hints = get_type_hints(kind)
        for field in fields(kind):
            name = f"{kind.__module__}.{kind.__name__}-{field.name}"
            if field.name not in FREE:
                yield pytest.param(kind, field.name, hints[field.name], id=name)


@pytest.mark.parametrize(("kind", "name", "hint"), list(settings()))
def test_no_setting_passes_unchecked(kind, name, hint):
    good = example(kind)
    assert replace(good) is not None
    declared = kind.__dataclass_fields__[name].metadata.get("setting")
    for wrong in wrong_values(hint):
        as_one = wrong is not True and wrong in (1.0, [2.0])
        if as_one and isinstance(declared, Setting) and "float" in str(hint):
            continue  # one number is a list of one, see test_arguments
        with pytest.raises(ValueError, match=rf"\b{name}\b"):
            replace(good, **{name: wrong})


NUMBERS = {  # of any type, and the float that each is
    "inf": (math.inf, math.inf),
    "-inf": (-math.inf, -math.inf),
    "nan": (math.nan, math.nan),
    "longdouble": (np.longdouble("1.5"), 1.5),
    "long longdouble": (np.longdouble("1e4000"), math.inf),
    "fraction": (Fraction(3, 2), 1.5),
    "large fraction": (Fraction(10**400), math.inf),
    "large int": (10**400, math.inf),
    "larger int": (-(10**5000), -math.inf),
    "float16": (np.float16(2.0), 2.0),
    "float32": (np.float32(0.5), 0.5),
    "float64": (np.float64(0.25), 0.25),
    "int8": (np.int8(3), 3.0),
    "uint64": (np.uint64(2**64 - 1), float(2**64 - 1)),
    "array": (np.array(1.5), 1.5),
}
INFINITE = {"kappa", "backlash"}  # of impacts, and of teeth that never meet behind


def numeric_fields() -> Iterator[Any]:
    for kind in public_classes():
        hints = get_type_hints(kind)
        for field in fields(kind):
            kinds = {float, int} & {*parts(hints[field.name])}
            if field.init and kinds and field.name not in FREE:
                name = f"{kind.__module__}.{kind.__name__}-{field.name}"
                yield pytest.param(kind, field.name, kinds, id=name)


@pytest.mark.parametrize(("kind", "name", "kinds"), list(numeric_fields()))
def test_numbers_of_any_type_are_python_numbers_or_refused(kind, name, kinds):
    """Refused by an InputError where the class is a study or a part of one."""
    good = example(kind)
    error = InputError if isinstance(good, Study) else ValueError
    for number, expected in NUMBERS.values():
        for value in (number, (number,), [number, number]):
            try:
                taken = getattr(replace(good, **{name: value}), name)
            except error:
                continue
            taken = taken if isinstance(taken, tuple | list) else (taken,)
            for element in taken:
                assert type(element) in (float, int)
                if isinstance(element, float):
                    assert element == expected
                    assert math.isfinite(element) or name in INFINITE
                else:
                    assert int in kinds or abs(element) < 1e308
                    assert element == number


def test_all_public_settings_are_looked_at():
    names = {kind.__name__ for kind in public_classes()}
    assert {
        "StaticsSettings",
        "ExcitationSettings",
        "Settings",
        "DynamicSettings",
    } <= names
    assert {
        "BranchSettings",
        "SectionSettings",
        "ToothFriction",
        "GivenTables",
    } <= names


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: fegear.StaticsSettings(plane="Stress"),
            "plane = 'Stress'; must be stress, strain, width or None",
        ),
        (
            lambda: fegear.StaticsSettings(friction=-0.1),
            "friction = -0.1; must be 0 to below 0.5",
        ),
        (
            lambda: fegear.ExcitationSettings(resolution="finest"),
            "resolution = 'finest'; must be coarse, default or fine",
        ),
        (
            lambda: fegear.FiniteElements(fidelity="Full"),
            "fidelity = 'Full'; must be full, reduced, quasistatic or auto",
        ),
        (
            lambda: fegear.FiniteElements(tolerance=-1.0),
            "tolerance = -1.0; must be above 0 to 1",
        ),
        (
            lambda: fegear.PictureSettings(width=961),
            "width = 961; must be an even number",
        ),
        (
            lambda: fegear.LumpedModel(number=1, damping_ratio=math.inf),
            "damping_ratio = inf; must be 0 to below 1",
        ),
        (
            lambda: fegear.Sweep(gear_set="liu-pair", direction="sideways"),
            "direction = 'sideways'; must be up, down or both",
        ),
        (
            lambda: fegear.solve_mesh("liu-pair"),
            "gear_set = 'liu-pair'; must be a gear set, "
            'load_gear_set("liu-pair") makes one',
        ),
        (
            lambda: fegear.solve_mesh(GEARS, torques_on_driver="100"),
            "torques_on_driver = '100'; must be a finite number or a list, each a "
            "finite number",
        ),
        (
            lambda: fegear.solve_mesh(GEARS, torques_on_driver=[0.0]),
            "torques_on_driver = 0; must be at least 1e-6 and below 1e9 N m, on the "
            "driver",
        ),
        (
            lambda: fegear.solve_mesh(GEARS, mesh=0),
            "mesh = 0; liu-pair has 1 mesh, from mesh 1 on",
        ),
        (
            lambda: fegear.solve_mesh(GEARS, torques_on_driver=[-5.0]),
            "torques_on_driver = -5; must be at least 1e-6 and below 1e9 N m, on the "
            "driver",
        ),
        (
            lambda: fegear.solve_stress(GEARS, -1.0),
            "torque_on_driver = -1; must be at least 1e-6 and below 1e9 N m, on the "
            "driver",
        ),
        (
            lambda: fegear.solve_stress(GEARS, 100.0, position=math.nan),
            "position = nan; must be a finite number",
        ),
        (
            lambda: fegear.solve_stress(GEARS, 100.0, mesh=-1),
            "mesh = -1; liu-pair has 1 mesh, from mesh 1 on",
        ),
        (
            lambda: fegear.solve_stress(GEARS, 100.0, zoom="near"),
            "zoom = 'near'; must be contact, tooth, gear or set",
        ),
        (
            lambda: fegear.Sweep(gear_set=GEARS, speeds=[-1000.0]),
            "speeds = -1000; must be above 0 to below 1000000000 Hz",
        ),
        (
            lambda: fegear.Motion(gear_set=GEARS, speed=0),
            "speed = 0; must be above 0 to below 1000000000 Hz",
        ),
    ],
)
def test_messages_name_the_setting_the_value_and_what_is_allowed(make, message):
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        make()


WITH_A_GEAR_SET = [
    function
    for function in OFFERED
    if isfunction(function) and "gear_set" in signature(function).parameters
]


@pytest.mark.parametrize("function", WITH_A_GEAR_SET, ids=lambda f: f.__name__)
@pytest.mark.parametrize("wrong", ["liu-pair", None, {"gear": []}])
def test_functions_take_gear_sets_only(function, wrong):
    others = [
        parameter.name
        for parameter in signature(function).parameters.values()
        if parameter.default is parameter.empty and parameter.name != "gear_set"
    ]
    with pytest.raises(ValueError, match=r"gear_set = .*; must be a gear set"):
        function(gear_set=wrong, **dict.fromkeys(others, ()))


def test_numbers_of_numpy_are_numbers():
    settings = fegear.StaticsSettings(
        positions=np.int64(8),
        friction=np.float64(0.1),
        corner_contact=np.bool_(False),
    )
    assert settings.positions == 8
    speeds = np.array([2800.0, 2900.0])
    model = fegear.LumpedModel(
        number=1, excitation=fegear.ExcitationSettings(kind="rectangular")
    )
    torque = np.array([100.0])
    study = fegear.Sweep(gear_set=GEARS, torque=torque, speeds=speeds, model=model)
    assert study.speeds == (2800.0, 2900.0)
    assert study.torque == (100.0,)
    assert "2800,2900" in fegear.Sweep(gear_set="liu-pair", speeds=speeds).argv
