"""Tables of helical gears and misaligned ones: command, models, refusals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from wide_sets import HELICAL

import fegear
from fegear.commands.stiffness.face_figure import draw_face
from fegear.commands.stiffness.path_figure import draw_path, pair_along_path
from fegear.commands.stiffness.sheet_figure import draw_sheet
from fegear.contact.path import roll_angles
from fegear.files.errors import InputError
from fegear.gearset.axial_forces import axial_force_on_driver
from fegear.gearset.leads import MAX_OVERLAP_RATIO
from fegear.gearset.model import GearSet
from fegear.statics.contact_problem import require_solvable, slices_over_width
from fegear.statics.excitation import Excitations
from fegear.statics.settings import RESOLUTIONS
from fegear.statics.table_warnings import table_warnings

COARSE = fegear.StaticsSettings(positions=8, resolution="coarse", root_stress=False)


@pytest.fixture(scope="module")
def solved():
    return fegear.solve_mesh(fegear.make_gear_set(HELICAL), settings=COARSE)


@pytest.mark.slow
def test_a_table_has_what_the_section_does_not_show(solved):
    figures = solved.key_figures
    assert figures[0]["overlap_ratio"] == pytest.approx(
        20.0 * np.sin(np.radians(18.0)) / (3.0 * np.pi), rel=1e-6
    )
    force = solved.cycle.load.sum(axis=2)
    helix = solved.problem.pair.driver.base_helix_angle
    axial = solved.table["axial_force_N"]
    assert axial == pytest.approx(force * np.tan(abs(helix)), rel=1e-9)
    assert np.abs(solved.table["load_center_mm"]).max() < 5.0
    assert solved.table.header["plane"] == "width"
    errors = [error.distribution for error in solved.errors]
    assert np.isfinite(errors).all()
    assert max(errors) > 0.0
    ratio = figures[1]["mean_stiffness_N_per_m"] / figures[0]["mean_stiffness_N_per_m"]
    assert 1.0 < ratio < 1.1


@pytest.mark.slow
def test_the_other_hand_mirrors_the_width(solved):
    one, two = HELICAL["gear"]
    left = {**HELICAL, "gear": [{**one, "hand": "left"}, two]}
    mirrored = fegear.solve_mesh(fegear.make_gear_set(left), settings=COARSE)
    assert mirrored.cycle.ste == pytest.approx(solved.cycle.ste, rel=1e-9)
    centers = mirrored.table["load_center_mm"], solved.table["load_center_mm"]
    assert centers[0] == pytest.approx(-centers[1], abs=1e-6)
    right = [row["driver_axial_force_N"] for row in solved.key_figures]
    left = [row["driver_axial_force_N"] for row in mirrored.key_figures]
    assert right == pytest.approx([-force for force in left], rel=1e-9)
    at_rest = [
        axial_force_on_driver(fegear.make_gear_set(HELICAL), 0, torque)
        for torque in HELICAL["load"]["torques_Nm"]
    ]
    assert right == pytest.approx(at_rest, rel=0.02)  # tip corners tilt normals


@pytest.mark.slow
def test_the_other_hand_mirrors_a_topography():
    one, two = HELICAL["gear"]
    mesh = HELICAL["mesh"][0]
    depths = np.array([[0.0, 2.0, 6.0], [3.0, 0.0, -1.0]])
    cycles = []
    for hand, across in (("right", depths), ("left", depths[:, ::-1])):
        grid = {
            "roll_angle_deg": [16.0, 30.0],
            "place_mm": [-8.0, 0.0, 8.0],
            "depth_um": across.tolist(),
            "bias_um": 4.0 if hand == "right" else -4.0,
        }
        gears = {**HELICAL, "gear": [{**one, "hand": hand}, two]}
        gears["mesh"] = [{**mesh, "driver_topography": grid}]
        solved = fegear.solve_mesh(fegear.make_gear_set(gears), settings=COARSE)
        cycles.append(solved.cycle)
    assert cycles[0].ste == pytest.approx(cycles[1].ste, rel=1e-9)
    loads = cycles[1].face.load[..., ::-1]
    assert cycles[0].face.load == pytest.approx(loads, abs=1e-6 * loads.max())
    assert np.abs(cycles[0].face.load - cycles[1].face.load).max() > 0.1 * loads.max()


@pytest.mark.slow
def test_loads_of_pairs_follow_from_gaps_and_compliances(solved):
    """Pair loads times pair stiffness is what a lumped mesh takes."""
    loaded = solved.cycle.load > 0.0
    deflection = (solved.cycle.ste[..., None] - solved.cycle.gap)[loaded]
    carried = solved.cycle.pair_stiffness[loaded] * deflection
    assert carried == pytest.approx(solved.cycle.load[loaded], rel=1e-9)
    names = [name for name in solved.table.columns if name.endswith("m_per_N")]
    assert names
    for name in names:
        values = solved.table[name]
        assert np.nanmax(np.abs(values)) < 1e-8


@pytest.mark.slow
@pytest.mark.parametrize("number", [1, 2, 3, "coupled"])
def test_models_take_the_table(number):
    study = fegear.Sweep(
        gear_set=fegear.make_gear_set(HELICAL),
        torque=(120.0,),
        speeds=(2500.0,),
        model=fegear.LumpedModel(
            number=number,
            excitation=fegear.ExcitationSettings(resolution="coarse", positions=16),
        ),
    )
    rows = fegear.run(study).table
    assert len(list(rows.rows())) == 2  # up and down


@pytest.mark.slow
def test_wide_teeth_are_warned_of(solved):
    assert not [line for line in table_warnings(solved) if "W57" in line]
    width = solved.problem.solver
    kernel = replace(width.driver.kernel, width=60e-3)
    wide = replace(width, driver=replace(width.driver, kernel=kernel))
    result = replace(solved, problem=replace(solved.problem, solver=wide))
    (line,) = [line for line in table_warnings(result) if "W57" in line]
    assert "face width of 19 modules; above 16" in line


@pytest.mark.slow
def test_the_pressure_at_the_pitch_point_is_that_of_hertz(solved):
    """Of the load per length there, with the curvature across the line of contact."""
    face, pair = solved.cycle.face, solved.problem.pair
    cosine = np.cos(face.base_helix_angle)
    one, two = pair.pitch_point, pair.line_of_action - pair.pitch_point
    radius = one * two / (one + two) / cosine
    modulus = 0.5 * 206e9 / (1.0 - 0.3**2)
    near = np.abs(face.path_position) < 0.07
    for t, values in enumerate(solved.key_figures):
        loads = face.load[t][near & face.on_path]
        hertz = 1e-6 * np.sqrt(loads * modulus / (np.pi * radius))
        pressure = values["pressure_at_pitch_point_plane_strain_MPa"]
        assert 0.98 * hertz.max() < pressure < 1.02 * hertz.max()
        assert hertz.min() > 0.8 * hertz.max()


@pytest.mark.slow
def test_the_picture_of_the_path_is_of_places_on_it(solved):
    along = pair_along_path(solved)
    pair = solved.problem.pair
    ends = [np.degrees(roll_angles(pair, np.array(end))[0]) for end in pair.path]
    loaded = along.angle[np.isfinite(along.pressure[1])]
    step = 360.0 / pair.driver.teeth / 8.0  # between positions of the table
    assert abs(loaded.min() - ends[0]) < step
    assert abs(loaded.max() - ends[1]) < step
    on_path = ~along.is_edge[1] & np.isfinite(along.pressure[1])
    # between positions, of which there are few, the ends of the path are left out
    most = 1e6 * solved.key_figures[1]["max_pressure_plane_strain_MPa"]
    assert 0.75 * most < along.pressure[1][on_path].max() < (1.0 + 1e-9) * most
    figure = draw_path(solved)
    labels = [axes.get_ylabel() for axes in figure.axes]
    assert "largest load per\nlength [N/mm],\ndotted at edges" in labels
    # each torque has a dotted curve with its ends, and a solid one without
    loads = figure.axes[1].lines
    whole, solid = (loads[i].get_ydata() for i in (0, 1))
    assert np.array_equal(np.isnan(solid), np.isnan(whole) | along.is_edge[0])
    assert [text.get_text() for text in figure.axes[0].texts] == ["A", "C", "E"]
    assert "at its ends A and E tip corners touch" in figure.get_suptitle()
    figure = draw_face(solved)
    for axes in figure.axes[:2]:  # slices reach to the ends of the width
        assert axes.get_xlim() == pytest.approx((-10.0, 10.0), rel=0.2)
    line = figure.axes[1].lines[0]
    assert line.get_xdata()[[0, -1]] == pytest.approx([-10.0, 10.0])
    assert line.get_ydata()[::2] == pytest.approx(
        1e-3 * solved.cycle.face.per_width[0].mean(axis=0)
    )


@pytest.mark.slow
def test_the_page_of_a_pair_has_cycle_flank_and_spectrum(solved):
    """Over the cycle on the left, over the flank on the right, in the same colours."""
    figure = draw_sheet(solved)
    labels = [axes.get_ylabel() for axes in figure.axes]
    assert len(labels) == 9  # with the scale of the pressure
    spectrum = labels.index("amplitude of the\ntransmission error [um]")
    ste = solved.table["ste_m"]
    by_fft = 2e6 * np.abs(np.fft.rfft(ste, axis=1))[:, 1:4] / ste.shape[1]
    bars = [bar.get_height() for bar in figure.axes[spectrum].patches]
    count = len(bars) // len(ste)
    heights = np.reshape(bars, (len(ste), count))
    assert heights == pytest.approx(by_fft[:, :count], rel=1e-9)
    colors = {
        line.get_label(): line.get_color()
        for axes in figure.axes
        for line in axes.lines
        if "N m" in str(line.get_label())
    }
    of_loads = figure.axes[labels.index("mesh stiffness F / (δ - δ₀) [N/um]")].lines
    torque = f"{solved.table.torque_Nm[0]:g} N m"
    assert tuple(of_loads[0].get_color()) == tuple(colors[torque])
    assert solved.roots is None  # whose panel is empty
    assert len([axes for axes in figure.axes if axes.axison]) == len(labels) - 1


@pytest.mark.slow
def test_an_edge_in_a_wider_flank_is_warned_of(solved):
    assert not [line for line in table_warnings(solved) if "W58" in line]
    wider = fegear.make_gear_set(HELICAL, {"gear.2.face_width_mm": 30.0})
    result = fegear.solve_mesh(wider, settings=replace(COARSE, resolution="default"))
    (line,) = [line for line in table_warnings(result) if "W58" in line]
    assert "mesh 1: the largest load per length changes by" in line
    change = result.error.change_of_distribution
    assert f"slices, more than 3 %, K_Hbeta by {100.0 * change:.2g} %" in line
    assert change < 0.03


@pytest.mark.slow
def test_a_tooth_that_is_not_there_has_no_root_stress():
    """And the transmission error of the others is larger while it is away."""
    settings = replace(COARSE, root_stress=True, estimate_error=False)
    faults = {
        "gear.one.missing_teeth": [4],
        "gear.one.broken_tips": [
            {"tooth": 9, "height_mm": 0.9, "length_mm": 8.0, "end": "far"}
        ],
    }
    broken = fegear.solve_mesh(fegear.make_gear_set(HELICAL, faults), settings=settings)
    whole = fegear.solve_mesh(fegear.make_gear_set(HELICAL), settings=settings)
    assert broken.pitches == 18
    apart = broken.table["ste_m"][1].reshape(18, -1) - whole.table["ste_m"][1]
    assert apart[3].max() == apart.max() > 5e-6  # the tooth's own base pitch
    assert 0.1e-6 < apart[7:10].max() < apart.max()
    assert (apart > -1e-9).all()
    assert np.abs(apart[[0, 1, 6, 12, 13, 14, 15, 16]]).max() < 1e-12
    cycle = broken.cycle
    pitch = np.floor(cycle.position).astype(int)
    missing = (pitch[:, None] - cycle.teeth) % 18 == 3
    driver, driven = broken.roots.driver, broken.roots.driven
    assert np.isnan(driver[:, missing]).all()
    assert np.isfinite(driver[:, ~missing]).all()
    assert np.isfinite(driven).all()
    for row, healthy in zip(broken.key_figures, whole.key_figures, strict=True):
        name = "driver_root_stress_MPa"
        assert healthy[name] < row[name] < 4.0 * healthy[name]
        assert row["driver_root_stress_factor"] > 1.0


def test_what_is_not_known_is_refused_before_it_is_solved():
    gears = fegear.make_gear_set(HELICAL)
    stress = fegear.StaticsSettings(plane="stress")
    with pytest.raises(InputError, match="plane = stress; must be width, it has hel"):
        fegear.solve_mesh(gears, settings=stress)
    with pytest.raises(InputError, match="body = free; must be held"):
        fegear.solve_mesh(gears, settings=fegear.StaticsSettings(body="free"))
    crack = [{"tooth": 1, "depth_mm": 1.0}]
    faulty = fegear.make_gear_set(HELICAL, {"gear.1.cracks": crack})
    with pytest.raises(InputError, match='"one": cracks are not known with helical'):
        fegear.solve_mesh(faulty)
    study = fegear.Dynamics(gear_set=gears, speeds=(1000.0,))
    with pytest.raises(InputError, match='"one" and "two" are helical; allowed'):
        fegear.run(study)


@pytest.mark.parametrize("number", [1, "auto"])
def test_friction_of_helical_gears_in_motion_is_refused(number):
    model = fegear.LumpedModel(number=number, friction=0.1)
    study = fegear.Motion(
        gear_set=fegear.make_gear_set(HELICAL), model=model, speed=9e2
    )
    told = 'friction = 0.1; must be 0, gears "one" and "two" are helical'
    with pytest.raises(InputError, match=told):
        fegear.run(study)


@pytest.mark.parametrize(("width_mm", "slices"), [(20.0, 32), (80.0, 63)])
def test_overlap_needs_slices(width_mm, slices):
    """24 at least while lines of contact move by a base pitch."""
    gears = fegear.make_gear_set(
        HELICAL, {f"gear.{i}.face_width_mm": width_mm for i in (1, 2)}
    )
    overlap = width_mm * np.sin(np.radians(18.0)) / (3.0 * np.pi)
    assert slices == max(32, np.ceil(24.0 * overlap))
    assert slices_over_width(gears, 0, RESOLUTIONS["default"]) == slices


def set_of_width(width_mm: float) -> GearSet:
    return fegear.make_gear_set(
        HELICAL, {f"gear.{i}.face_width_mm": width_mm for i in (1, 2)}
    )


def width_of_slices(slices: int, per_pitch: float) -> float:
    """Width [mm] that just needs as many slices."""
    return (1.0 - 1e-9) * slices / per_pitch * 3.0 * np.pi / np.sin(np.radians(18.0))


@pytest.mark.parametrize("resolution", ["default", "fine"])
def test_too_many_slices_are_refused_before_any_are_made(monkeypatch, resolution):
    """With their number, the limit and the memory that a position takes."""
    monkeypatch.setattr("fegear.statics.solving.contact_problem", None)
    settings = fegear.StaticsSettings(resolution=resolution)
    per_pitch = RESOLUTIONS[resolution].slices_per_pitch
    fits, wide = (set_of_width(width_of_slices(n, per_pitch)) for n in (1000, 1001))
    require_solvable(fits, 0, settings)
    told = r"1001 slices .*must be at most 1000: a position takes 0\.[345]\d* GB"
    with pytest.raises(InputError, match=told):
        fegear.solve_mesh(wide, 1, 100.0, settings)


def test_no_resolution_solves_what_a_file_is_refused_for():
    coarse = RESOLUTIONS["coarse"]
    widest = width_of_slices(1000, coarse.slices_per_pitch)
    per_overlap = 3.0 * np.pi / np.sin(np.radians(18.0))
    assert 0.98 * widest < MAX_OVERLAP_RATIO * per_overlap < widest
    set_of_width(0.999 * MAX_OVERLAP_RATIO * per_overlap)
    told = "overlap ratio 60.06; must be at most 60, that of a common face width of"
    with pytest.raises(InputError, match=told):
        set_of_width(1.001 * MAX_OVERLAP_RATIO * per_overlap)


@pytest.mark.slow
def test_each_gear_has_one_helix_in_all_its_meshes():
    """Sections of an idler toward the far end are ahead in both meshes, or behind."""
    train = {
        **HELICAL,
        "gear": [*HELICAL["gear"], {"name": "three", "teeth": 21, "hub_radius_mm": 15}],
        "mesh": [*HELICAL["mesh"], {"driver": "two", "driven": "three"}],
    }
    gears = fegear.make_gear_set(train, {"mesh.2.backlash_um": 60.0})
    quick = replace(COARSE, positions=2, estimate_error=False)
    idler = gears.gears[1].geometry
    assert idler.helix_angle < 0.0  # left-handed
    assert gears.senses[1] == -1  # and behind where it turns clockwise
    for mesh in (1, 2):
        face = fegear.solve_mesh(gears, mesh, [60.0], quick).cycle.face
        (slope,) = np.unique(np.diff(face.path_position).round(9))
        step = face.place[1] - face.place[0]
        turned = idler.twist * step / idler.pitch_angle
        assert slope == pytest.approx(turned, abs=2e-9)
        assert slope < 0.0


LOW = {
    "name": "low",
    "defaults": {"module_mm": 2.5, "helix_angle_deg": 25.0, "addendum_mm": 1.3},
    "gear": [
        {"name": "one", "teeth": 21, "hub_radius_mm": 12.0, "face_width_mm": 30.0},
        {"name": "two", "teeth": 45, "hub_radius_mm": 30.0, "face_width_mm": 30.0},
    ],
    "mesh": [{"driver": "one", "driven": "two", "backlash_um": 40.0}],
    "load": {"gear": "one", "torques_Nm": [1.0, 100.0]},
}


@pytest.mark.slow
def test_teeth_that_touch_over_less_than_a_base_pitch_across_the_axis():
    """The overlap carries on; the transmission error knows no gap between pairs."""
    solved = fegear.solve_mesh(fegear.make_gear_set(LOW), settings=COARSE)
    assert solved.problem.pair.contact_ratio < 0.8
    assert solved.cycle.residual.max() < 1e-9
    light, heavy = solved.key_figures
    assert light["nlte_peak_to_peak_um"] < 1e-9
    assert heavy["ste_peak_to_peak_um"] < 0.1 * heavy["ste_mean_um"]
    assert 1.0 < heavy["load_distribution_factor"] < 1.2


def test_given_waves_of_helical_gears_have_the_total_contact_ratio():
    stated = {"mean_stiffness_N_per_m": 2e8, "stiffness_variation": 0.1}
    tables = {**HELICAL, "mesh": [{**HELICAL["mesh"][0], **stated}]}
    gears = fegear.make_gear_set(tables)
    source = Excitations(fegear.ExcitationSettings(kind="rectangular"))
    figures = source.figures(gears, 0, 60.0)
    transverse = gears.meshes[0].pair.contact_ratio
    assert figures.contact_ratio == pytest.approx(transverse + gears.overlap_ratio(0))
    assert figures.approach == pytest.approx(-gears.engagement(0)[0])


@pytest.mark.parametrize(
    "keys",
    [
        {"misalignment_um": 5.0},
        {"driver_lead": {"crowning_um": 4.0}},
        {"tip_relief": {"magnitude_um": 10.0, "start": "HPSTC"}},
    ],
)
def test_given_waves_refuse_gaps_that_vary_over_the_width(keys):
    stated = {"mean_stiffness_N_per_m": 2e8, "stiffness_variation": 0.1}
    tables = {**HELICAL, "mesh": [{**HELICAL["mesh"][0], **stated, **keys}]}
    source = Excitations(fegear.ExcitationSettings(kind="trapezoid"))
    with pytest.raises(InputError, match="varies over the face width"):
        source.mesh_excitation(fegear.make_gear_set(tables), 0, 60.0, 1)


@pytest.mark.slow
def test_the_largest_load_per_length_is_that_of_the_file():
    """Tip corners carry more than the path; both are said."""
    study = fegear.MeshStiffness(
        gear_set=fegear.make_gear_set(HELICAL), elements=COARSE
    )
    result = fegear.run(study)
    for t, figures in enumerate(result.solved.key_figures):
        table, torque = result.more_tables["face_loads"], result.solved.cycle.torque[t]
        rows = [dict(zip(table.names, row, strict=True)) for row in table.rows()]
        written = [r["line_load_N_per_mm"] for r in rows if r["torque_Nm"] == torque]
        assert figures["largest_line_load_N_per_mm"] == pytest.approx(max(written))
        on_path = figures["largest_line_load_on_path_N_per_mm"]
        assert on_path <= figures["largest_line_load_N_per_mm"]
    page = "\n".join(map(str, result.page()))
    assert "on the path" in page
    assert "take local k, the slope" in page


@pytest.mark.slow
def test_a_gap_over_the_width_makes_mean_k_smaller_and_leaves_the_slope():
    crowned = {
        **HELICAL,
        "mesh": [{**HELICAL["mesh"][0], "driver_lead": {"crowning_um": 20.0}}],
    }
    study = fegear.MeshStiffness(
        gear_set=fegear.make_gear_set(crowned), elements=COARSE
    )
    result = fegear.run(study)
    figures = result.solved.key_figures[-1]
    ratio = figures["mean_stiffness_N_per_m"] / figures["mean_local_stiffness_N_per_m"]
    below = f"over the width first: {100.0 * (1.0 - ratio):.2g} % below local k"
    assert below in " ".join("\n".join(map(str, result.page())).split())


def test_light_loads_on_flanks_with_an_excess_of_material_are_solved():
    """The search for slices in contact grows from the transmission error of the gap."""
    tables = {**HELICAL, "mesh": [{**HELICAL["mesh"][0], "misalignment_um": -10.0}]}
    settings = replace(COARSE, positions=4, estimate_error=False)
    gears = fegear.make_gear_set(tables)
    torques = [0.3, 1.0, 30.0]
    solved = fegear.solve_mesh(gears, torques_on_driver=torques, settings=settings)
    assert (solved.cycle.no_load < 0.0).all()
    assert solved.cycle.residual.max() < 1e-9
    deflection = solved.cycle.ste - solved.cycle.no_load
    assert (np.diff(deflection, axis=0) > 0.0).all()
    assert (deflection > 0.0).all()


@pytest.fixture(scope="module")
def roots():
    settings = replace(COARSE, root_stress=True, estimate_error=False)
    return fegear.solve_mesh(fegear.make_gear_set(HELICAL), settings=settings)


def test_root_stress_varies_over_the_width(roots):
    for gear, of_gear in zip(("driver", "driven"), roots.roots.over_width, strict=True):
        columns, stress = roots.table.columns, of_gear.stress
        largest = columns[f"{gear}_root_stress_Pa"]
        assert (largest == stress.max(axis=(2, 3))).all()
        assert np.abs(of_gear.place).max() == pytest.approx(10e-3)
        # loads twice as large, spread a little farther
        assert 1.7 < largest[1].max() / largest[0].max() < 2.0
        mean = np.trapezoid(of_gear.over_cycle, of_gear.place) / 20e-3
        assert of_gear.factor == pytest.approx(stress.max(axis=(1, 2, 3)) / mean)
        assert (of_gear.factor > 1.0).all()
        assert (of_gear.factor < 1.5).all()
        # what carries nothing is pulled by its neighbours alone
        unloaded = roots.cycle.load[1] == 0.0
        assert stress[1][unloaded].max() < 0.25 * largest[1].max()
    figures = roots.key_figures[1]
    assert abs(figures["driver_root_stress_at_mm"]) <= 10.0
    assert figures["driven_root_stress_factor"] == roots.roots.over_width[1].factor[1]


@pytest.mark.slow
def test_root_stress_of_the_other_hand_is_mirrored(roots):
    one, two = HELICAL["gear"]
    left = {**HELICAL, "gear": [{**one, "hand": "left"}, two]}
    settings = replace(COARSE, root_stress=True, estimate_error=False)
    mirrored = fegear.solve_mesh(fegear.make_gear_set(left), settings=settings)
    for other, gear in zip(
        mirrored.roots.over_width, roots.roots.over_width, strict=True
    ):
        largest = gear.stress.max()
        assert other.stress[..., ::-1] == pytest.approx(gear.stress, abs=1e-6 * largest)
        assert other.place[::-1] == pytest.approx(-gear.place)


@pytest.mark.slow
def test_slices_of_straight_teeth_have_nearly_the_root_stress_of_the_section():
    """A lead that hardly opens a gap, and one that leaves half of the width open."""
    straight = {"module_mm": 3.0, "face_width_mm": 20.0}
    settings = replace(COARSE, root_stress=True, estimate_error=False)

    def solve(**keys):
        mesh = [{**HELICAL["mesh"][0], **keys}]
        sets = {**HELICAL, "plane": "width", "defaults": straight, "mesh": mesh}
        return fegear.solve_mesh(fegear.make_gear_set(sets), settings=settings)

    section, sliced = solve(), solve(driver_lead={"crowning_um": 0.01})
    for gear, of_gear in zip(
        ("driver", "driven"), sliced.roots.over_width, strict=True
    ):
        mean = np.trapezoid(of_gear.stress, of_gear.place) / 20e-3
        expected = section.table.columns[f"{gear}_root_stress_Pa"]
        assert mean.max(axis=2) == pytest.approx(expected, rel=0.03)
        assert (of_gear.factor < 1.1).all()
    open_far = solve(driver_lead={"slope_um": 40.0})
    factors = [of_gear.factor[0] for of_gear in open_far.roots.over_width]
    assert min(factors) > 1.5
    assert max(factors) < open_far.cycle.face.distribution_factor[0]
