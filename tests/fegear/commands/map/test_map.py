"""`fegear map`: contours, files and interruption."""

from __future__ import annotations

import json

import numpy as np
import pytest
from drawn_figures import are_drawn, axis_labels, saved_figures
from matplotlib.figure import Figure
from typer.testing import CliRunner

import fegear
from fegear.cli import app
from fegear.files.errors import InputError
from fegear.files.keys import file_keys
from fegear.files.store import CheckpointOptions
from lumped.common.csv_text import parse_csv
from lumped.figures.map_plots import axis_label

RELIEF = "mesh.{}.tip_relief.magnitude_um"
BASE = ("liu-idler", "--excitation", "rectangular", "--torque", "100")
SMALL_OVER = (f"{RELIEF.format(1)}=4,5", "mesh.2.phase=0:0.4:3")
SMALL = (*BASE, "--over", f"{RELIEF.format(1)}=4,5", "--over", "mesh.2.phase=0:0.4:3")


def run(*arguments: object) -> str:
    result = CliRunner().invoke(
        app, ["map", *map(str, arguments)], catch_exceptions=False
    )
    assert result.exit_code == 0, result.output
    return result.stdout


def numbers(path) -> np.ndarray:
    lines = [line for line in path.read_text().splitlines() if line[0] != "#"]
    return np.array([[float(v) for v in line.split(",")[:-1]] for line in lines[1:]])


def test_reliefs_make_ellipses_about_the_static_optimum(tmp_path):
    """Figure 2.15, c = 1.4 and 1.6: a positive quadratic form of the reliefs."""
    path = tmp_path / "m.csv"
    over = [word for m in (1, 2) for word in ("--over", f"{RELIEF.format(m)}=4:8:7")]
    ratios = [
        w for m in (1, 2) for w in ("--set", f"mesh.{m}.contact_ratio=1.{2 + 2 * m}")
    ]
    run(*BASE, *ratios, *over, "--at", 1605, "-o", path)
    rows = numbers(path)
    rows = rows[rows[:, 2] == 2]
    x, y, square = rows[:, 0], rows[:, 1], (1e6 * rows[:, 5]) ** 2
    form = np.stack([x**2, x * y, y**2, x, y, np.ones_like(x)], axis=1)
    (a, b, c, d, e, _), *_ = np.linalg.lstsq(form, square, rcond=None)
    fit = form @ np.linalg.lstsq(form, square, rcond=None)[0]
    assert b**2 < 4.0 * a * c
    assert np.abs(fit - square).max() < 0.1 * square.max()
    centre = np.linalg.solve([[2 * a, b], [b, 2 * c]], [-d, -e])
    # eq. 2.28: twice the peak-to-peak static transmission error
    force = 100.0 / 0.04535
    for magnitude, k, eps, ratio in zip(
        centre, (2.9831e8, 3.2108e8), (0.35, 0.40), (1.4, 1.6), strict=True
    ):
        best = 2 * force * eps / k / (1 + eps * (1 - ratio)) / (1 + eps * (2 - ratio))
        assert magnitude == pytest.approx(1e6 * best, rel=0.15)


def test_same_command_gives_the_same_file(tmp_path):
    one, two = tmp_path / "a.csv", tmp_path / "b.csv"
    for path in (one, two):
        run(*SMALL, "--at", 1700, "-o", path)
    assert one.read_bytes() == two.read_bytes()


def test_a_file_that_another_map_has_kept_is_refused(tmp_path):
    """Unless it is overwritten."""
    path = tmp_path / "m.csv"
    checkpoint = tmp_path / "m.csv.partial"

    def stopped(label, done, total):
        if (label, done) == ("points", 3):
            raise KeyboardInterrupt

    study = fegear.Map(
        gear_set="liu-idler",
        over=SMALL_OVER,
        at=1700.0,
        torque=100.0,
        model=fegear.LumpedModel(
            number="auto", excitation=fegear.ExcitationSettings(kind="rectangular")
        ),
    )
    with pytest.raises(KeyboardInterrupt):
        fegear.run(study, CheckpointOptions(checkpoint=checkpoint), stopped)
    arguments = [*SMALL, "-o", path]
    with pytest.raises(InputError, match=r"at = '1700\.0', now '1800\.0'"):
        run(*arguments, "--at", 1800, "--resume")
    with pytest.raises(InputError, match="gear_set"):
        run(*arguments, "--at", 1700, "--set", "gear.1.teeth=39", "--resume")
    with pytest.raises(InputError, match="an interrupted run has finished"):
        run(*arguments, "--at", 1700)
    other = path.with_name("o.csv")
    run(*SMALL, "--at", 1700, "-o", other)
    run(*arguments, "--at", 1700, "--resume")
    assert path.read_bytes() == other.read_bytes()
    with pytest.raises(KeyboardInterrupt):
        fegear.run(study, CheckpointOptions(checkpoint=checkpoint), stopped)
    run(*arguments, "--at", 1800, "--overwrite")
    assert "at 1800 Hz" in path.read_text()
    assert not checkpoint.exists()


def test_band_finds_the_peak(tmp_path):
    path = tmp_path / "m.csv"
    options = ("--over", "damping_ratio=0.1,0.2", "--band", "1500:1700:20")
    run(*BASE, *options, "-o", path)
    rows = numbers(path)
    mesh2 = rows[rows[:, 1] == 2]
    assert mesh2[0, 4] > mesh2[1, 4]
    assert 1500.0 <= mesh2[0, 2] <= 1700.0


def test_an_axis_that_changes_nothing_is_named():
    """Rectangular stiffness is printed, so that it does not hang on the hub."""
    arguments = (*BASE, "--over", "gear.1.hub_radius_mm=20,21", "--at", 1500)
    two_axes = (*arguments, "--over", "mesh.2.phase=0,0.3", "--json")
    warnings = json.loads(run(*two_axes))["warnings"]
    assert warnings == ["gear.1.hub_radius_mm does not change the response [W16]"]


def test_torque_is_an_axis():
    axis = ("--over", "torque_Nm=50,100", "--at", 1700)
    text = run(*BASE[:-2], *axis, "--json")
    small, large = json.loads(text)["extremes"][:2]
    assert large["dte_rms_m"] == pytest.approx(2.0 * small["dte_rms_m"], rel=1e-6)
    with pytest.raises(InputError, match="--torque = 100; --over torque_Nm replaces"):
        run(*BASE, *axis)


def test_points_without_gears_are_marked(tmp_path):
    path = tmp_path / "m.csv"
    text = run(*BASE, "--over", "mesh.1.contact_ratio=1.5,3", "--at", 1700, "-o", path)
    assert "1 impossible" in text
    assert "impossible: liu-idler" in path.read_text()


@pytest.fixture
def drawn(tmp_path):
    """A function that gives the figure and the rows of a map."""

    def draw(*arguments: object) -> tuple[Figure, np.ndarray]:
        files = "-o", tmp_path / "m.csv", "--plot", tmp_path / "m.png"
        with saved_figures() as figures:
            run(*arguments, "--at", 1700, *files)
        return *figures, numbers(tmp_path / "m.csv")

    return draw


def test_one_axis_is_plotted_as_lines(drawn):
    figure, rows = drawn(*BASE, "--over", "mesh.2.phase=0,1")
    error = "RMS of the DTE without mean [um]"
    assert axis_labels(figure) == {"mesh 2, phase", error}
    assert are_drawn(figure, rows[:, [0, 4]] * [1.0, 1e6])


def test_two_axes_are_plotted_as_contours(drawn):
    figure, rows = drawn(*SMALL)
    assert axis_labels(figure) == {
        *("mesh 1, tip relief, magnitude [um]", "mesh 2, phase"),
        "RMS of the DTE without mean [um]",
    }
    for mesh, axes in enumerate(figure.axes[:2], start=1):
        errors = 1e6 * rows[rows[:, 2] == mesh, 5]
        filled = axes.collections[0]
        assert (filled.zmin, filled.zmax) == pytest.approx((errors.min(), errors.max()))


def test_whole_numbers_are_whole(tmp_path):
    path = tmp_path / "m.csv"
    run(*BASE, "--over", "gear.3.teeth=94,95", "--at", 1700, "-o", path)
    assert "impossible" not in path.read_text().splitlines()[-3]


def test_friction_is_an_axis_or_the_same_at_all_points(tmp_path):
    """The points of one map are on the other."""
    base = ("liu-pair", "--excitation", "rectangular", "--at", 1000, "--torque", 100)
    over, fixed = tmp_path / "over.csv", tmp_path / "fixed.csv"
    run(*base, "--bending", 0.4, "--over", "friction=0,0.1,0.2", "-o", over)
    options = ("--friction", 0.2, "--over", "friction_bending=0,0.4", "-o", fixed)
    run(*base, *options)
    rows, others = numbers(over), numbers(fixed)
    assert len(set(rows[:, 4])) == 3
    np.testing.assert_array_equal(rows[2, 1:], others[1, 1:])
    assert others[0, 4] != others[1, 4]
    assert "friction coefficient: 0.2" in fixed.read_text()
    assert "friction coefficient" not in over.read_text()


def test_exponents_are_those_of_sections_and_drawn(tmp_path):
    """One point at a time from rest, as the first value of a bifurcation diagram."""
    over = "damping_ratio=0.03,0.05"
    path, plot = tmp_path / "m.csv", tmp_path / "m.png"
    arguments = (*BASE, "--over", over, "--at", 1700, "--exponents")
    with saved_figures() as figures:
        values = json.loads(run(*arguments, "--json", "-o", path, "--plot", plot))
    table = parse_csv(path.read_text("utf-8"), "m.csv")
    at = [table.names.index(n) for n in ("damping_ratio", "lyapunov_per_period")]
    exponents = dict(tuple(float(row[i]) for i in at) for row in table.rows.values())
    model = fegear.LumpedModel(
        number=1, excitation=fegear.ExcitationSettings(kind="rectangular")
    )
    for damping, exponent in exponents.items():
        sections = fegear.run(
            fegear.Bifurcations(
                gear_set="liu-idler",
                torque=100.0,
                at=1700.0,
                over=f"damping_ratio={damping}",
                direction="up",
                model=model,
            )
        )
        (attractor,) = sections.branches[0].attractors
        assert exponent == pytest.approx(attractor.exponent, rel=1e-6)
        assert exponent < 0.0
    assert values["chaotic_points"] == 0
    assert values["largest_lyapunov_per_period"] == max(exponents.values())
    assert are_drawn(*figures, list(exponents.items()))
    assert "largest Lyapunov exponent [1/period]" in axis_labels(*figures)


def test_the_exponent_of_a_band_is_the_largest_of_its_sweeps(tmp_path):
    path, speeds = tmp_path / "m.csv", ("1500", "1600", "1700")
    options = ("--over", "damping_ratio=0.04", "--exponents")
    run(*BASE, *options, "--band", ",".join(speeds), "-o", path)
    table = parse_csv(path.read_text("utf-8"), "m.csv")
    at = table.names.index("lyapunov_per_period")
    sections = fegear.run(
        fegear.Bifurcations(
            gear_set="liu-idler",
            torque=100.0,
            over=f"mesh_frequency_Hz={','.join(speeds)}",
            model=fegear.LumpedModel(
                number=1, excitation=fegear.ExcitationSettings(kind="rectangular")
            ),
        )
    )
    largest = max(a.exponent for b in sections.branches for a in b.attractors)
    for row in table.rows.values():
        assert float(row[at]) == pytest.approx(largest, rel=1e-6)


def test_an_axis_has_the_unit_of_its_key():
    keys = [key for key in file_keys("gear-set") if key.unit]
    assert len(keys) > 60
    for key in keys:
        label = axis_label(f"gear.1.{key.key}")
        assert label.endswith(f" [{key.unit}]"), label
