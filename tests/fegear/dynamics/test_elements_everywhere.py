"""Plane state, resolution and face width reach every part that is solved."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from skfem.models import elasticity
from typer.testing import CliRunner

from fegear.cli import app
from fegear.dynamics.build import FiniteElements, prepare
from fegear.dynamics.contact_history import ContactHistory
from fegear.dynamics.cross_mesh import _flank_table
from fegear.dynamics.gear_elasticity import cached_gear_modes
from fegear.dynamics.stepper import DynamicSettings, TimeSteps
from fegear.elasticity import sector
from fegear.elasticity.material import PlaneMaterial
from fegear.gearset import load_gear_set
from fegear.statics.excitation import Excitations
from fegear.statics.excitation_settings import ExcitationSettings
from fegear.statics.settings import RESOLUTIONS
from fegear.train.lumped_models import lumped_system
from fegear.train.model_settings import LumpedModel
from meshes import sector as meshing

TORQUE, SPEED, CUTOFF = 100.0, 1500.0, 15e3
SET = "liu-idler-small-hubs"  # whose idler twists below the cut-off
STRAIN = ExcitationSettings(resolution="coarse", positions=64, plane="strain")
STRESS = replace(STRAIN, plane="stress")


def prepared(gear_set, source, fidelity="reduced", torque=TORQUE):
    tables = Excitations(source)
    system = lumped_system(gear_set, torque, LumpedModel(number=1), excitations=tables)
    elements = FiniteElements(fidelity=fidelity, cutoff_Hz=CUTOFF, mesh=0.25)
    args = system, [SPEED], elements, DynamicSettings(), tables
    return prepare(gear_set, torque, *args).stepper


def with_gears(gear_set, change):
    gears = tuple(replace(gear, **change(gear)) for gear in gear_set.gears)
    return replace(gear_set, gears=gears)


@pytest.fixture(scope="module")
def idler():
    return load_gear_set(SET)


def arrays(stepper):
    """What a stepper knows of the finite elements, by name."""
    model = stepper.model
    by_name = {
        "mean stiffness": model.reference.modes.mean_stiffness,
        "laws": model.contacts.load_curve[..., 1:],
        "compliance": model.contacts.normal_compliance,
        "elastic frequencies": np.sqrt(model.modal.rigidity),
    }
    if hasattr(stepper, "fields"):
        for field in stepper.fields:
            by_name[f"stiffness of {field.gear_index}"] = (
                field.cyclic_gear.stiffness.toarray()
            )
    return by_name


def largest_change(one, other):
    return np.abs(one - other).max(initial=0.0) / np.abs(other).max(initial=1e-300)


@pytest.mark.slow
@pytest.mark.parametrize("fidelity", ["reduced", "full"])
def test_plane_strain_is_plane_stress_of_another_material(idler, fidelity):
    """E / (1 - nu^2) and nu / (1 - nu); the density and all else stay."""
    other = with_gears(
        idler,
        lambda g: {
            "young_modulus": g.young_modulus / (1.0 - g.poisson_ratio**2),
            "poisson_ratio": g.poisson_ratio / (1.0 - g.poisson_ratio),
        },
    )
    strain = arrays(prepared(idler, STRAIN, fidelity))
    same = arrays(prepared(other, STRESS, fidelity))
    stress = arrays(prepared(idler, STRESS, fidelity))
    for name, values in strain.items():
        assert largest_change(same[name], values) < 1e-7, name
        if values.size:  # elastic frequencies of whole gears are none
            assert not np.allclose(stress[name], values, rtol=1e-3, atol=0.0), name


def marched(gear_set, fidelity, torque):
    stepper = prepared(gear_set, STRESS, fidelity, torque)
    size, steps = 1.0 / (SPEED * 128), 128
    _, motion = stepper.integrate(stepper.start(), TimeSteps(SPEED, size, steps, steps))
    return motion.deflection


@pytest.mark.parametrize("fidelity", ["quasistatic", "reduced"])
def test_wider_gears_move_the_same_under_as_much_more(idler, fidelity):
    wide = with_gears(
        idler,
        lambda g: {
            "face_width": 2.0 * g.face_width,
            "inertia": 2.0 * g.inertia,
            "coupling_stiffness": 2.0 * g.coupling_stiffness,
        },
    )
    expected = marched(idler, fidelity, TORQUE)
    deflection = marched(wide, fidelity, 2.0 * TORQUE)
    np.testing.assert_allclose(deflection, expected, rtol=1e-6)


def test_a_wider_idler_moves_more_mass_on_the_same_statics(idler):
    pinion, gear, follower = idler.gears
    wide_gear = replace(gear, face_width=50.8e-3, inertia=2.0 * gear.inertia)
    wide = replace(idler, gears=(pinion, wide_gear, follower))
    assert wide.common_width(0) == wide.common_width(1) == gear.face_width
    one, two = (prepared(g, STRESS, "quasistatic").model for g in (idler, wide))
    for name in ("load_curve", "normal_compliance"):
        np.testing.assert_array_equal(*(getattr(m.contacts, name) for m in (one, two)))
    before, after = (prepared(g, STRESS).model.modal for g in (idler, wide))
    scale = np.where(before.gear_of_mode == 1, np.sqrt(2.0), 1.0)
    np.testing.assert_allclose(after.coupling, scale * before.coupling, rtol=1e-12)
    assert before.coupling[before.gear_of_mode == 1].any()
    assert prepared(wide, STRESS, "full").fields[1].width == 50.8e-3


def test_twist_of_an_idlers_body_cancels(idler):
    """Equal torques in and out, however much wider than its mates it is."""
    deflections = []
    for factor in (1.0, 3.0):
        gear = replace(idler.gears[1], face_width=factor * 25.4e-3)
        gear_set = replace(idler, gears=(idler.gears[0], gear, idler.gears[2]))
        stepper = prepared(gear_set, STRESS, "quasistatic")
        state = stepper.start()
        deflections.append(stepper.model.kinematics.deflection @ state.motion[0])
    np.testing.assert_allclose(deflections[1], deflections[0], rtol=1e-6)


def test_root_stress_is_of_the_load_over_the_common_width(idler):
    wide = with_gears(idler, lambda g: {"face_width": 2.0 * g.face_width})
    loads = []
    for gear_set in (idler, wide):
        side = prepared(gear_set, STRESS, "quasistatic").model.sides[0]
        ends, weights = np.zeros((1, 2), np.int64), np.array([[1.0, 0.0]])
        places = ends, weights, np.zeros(1, np.int64)
        contact = ContactHistory(side, 0, np.array([1e3]), np.zeros(1), *places)
        loads.append(contact.flank_load(0, 0, slice(None)).normal)
    assert loads[1] == pytest.approx(0.5 * loads[0])


@pytest.fixture
def solved(monkeypatch, tmp_path):
    """All sizes that sectors are meshed with, and elastic constants assembled."""
    sizes, constants = [], []
    outline, form = meshing.half_sector_outline, elasticity.linear_elasticity

    def noted_outline(gear, size):
        # layers of modes and whole gears follow from frequencies besides
        sizes.append(replace(size, largest_layer=math.inf))
        return outline(gear, size)

    def noted_form(*lame):
        constants.append(lame)
        return form(*lame)

    monkeypatch.setattr(meshing, "half_sector_outline", noted_outline)
    monkeypatch.setattr(elasticity, "linear_elasticity", noted_form)
    monkeypatch.setenv("FEGEAR_CACHE_DIR", str(tmp_path / "cache"))
    cached_gear_modes.cache_clear()
    sector._first_of_equals.cache_clear()
    _flank_table.cache_clear()
    return sizes, constants


DYNAMICS = ["dynamics", "liu-idler", "--torque", "100", "--speeds", "1500"]
SETTLE = ["--direction", "up", "--tolerance", "0.1", "--max-periods", "1"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("argv", "meshed"),
    [
        # flanks, cross-mesh compliance and root stress of the same sectors; modes
        (
            [*DYNAMICS, *SETTLE, "--fidelity", "reduced", "--root-stress", "idler"],
            3 + 3,
        ),
        (["sweep", "liu-idler", "--torque", "100", "--speeds", "1500"], 3),
        (["motion", "liu-pair", "--torque", "100", "--speed", "1500"], 2),
        (["map", "liu-pair", "--over", "torque_Nm=100", "--at", "1500"], 2),
        (["modes", "liu-idler", "--stiffness", "fe"], 3),
        (["render", "liu-pair"], 2),
    ],
    ids=lambda value: value[0] if isinstance(value, list) else "",
)
def test_commands_solve_all_as_they_are_asked(solved, tmp_path, argv, meshed):
    if argv[0] == "dynamics":
        argv = [*argv, "--history", str(tmp_path / "h")]
    if argv[0] == "render":
        argv = [*argv, "-o", str(tmp_path / "c.vtu")]
    argv = [*argv, "--plane", "strain", "--resolution", "coarse"]
    result = CliRunner().invoke(app, argv, catch_exceptions=False)
    assert result.exit_code == 0
    sizes, constants = solved
    assert sizes == [RESOLUTIONS["coarse"].size] * meshed
    assert set(constants) == {PlaneMaterial(206e9, 0.3, "strain").lame}


def test_whole_gears_follow_the_resolution(solved, idler):
    prepared(idler, STRAIN, "full")
    sizes, _ = solved
    coarse = RESOLUTIONS["coarse"].size
    assert set(sizes) == {coarse, coarse.refined(0.25)}


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            ["--excitation", "rectangular"],
            "the gear set gives all stiffness parameters",
        ),
        (["--table", "a.csv", "--table", "b.csv"], "--table replaces it"),
    ],
)
def test_elements_that_are_not_solved_take_no_options(options, message):
    argv = ["sweep", "liu-idler", "--speeds", "1500", "--plane", "strain", *options]
    result = CliRunner().invoke(app, argv)
    assert str(result.exception).startswith("--plane = strain; ")
    assert message in str(result.exception)
