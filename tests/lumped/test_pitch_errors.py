"""Pitch errors: excitation over the common period of all tooth pairs."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from oracles.piecewise import Disk, PiecewiseTrain, Toothing, march, rectangular_pairs

import lumped
from lumped import LumpedSystem, MeshTable, Settings, TrainError, pair_errors
from lumped.steady.motion import resample, spectrum, time_history
from lumped.train.excitation_tables import excitation_from_table, table_pitches
from lumped.train.pitch_errors import minimal_period, pair_gaps
from lumped.train.waves import Wave, constant_wave, wave_from_samples

RADII, INERTIAS, TORQUE = (0.04535, 0.05831), (2.6e-3, 1.1e-2), 100.0
MEAN, VARIATION, RATIO, DAMPING, BACKLASH = 3e8, 0.35, 1.5, 0.04, 40e-6
FORCE = TORQUE / RADII[0]
TORQUES = (TORQUE, TORQUE * RADII[1] / RADII[0])
MASS = 1.0 / sum(r**2 / i for r, i in zip(RADII, INERTIAS, strict=True))
NATURAL = math.sqrt(MEAN / MASS) / (2.0 * math.pi)  # Hz
RNG = np.random.default_rng(3)
SMALL = tuple(tuple(RNG.uniform(-4e-6, 4e-6, z).tolist()) for z in (7, 9))


def train_of(teeth: tuple[int, int], backlash: float = BACKLASH, phase: float = 0.0):
    gears = tuple(
        lumped.Gear(name=n, teeth=z, base_radius=r, inertia=i, torque=t)
        for n, z, r, i, t in zip("ab", teeth, RADII, INERTIAS, TORQUES, strict=True)
    )
    mesh = lumped.Mesh(
        driver=0, driven=1, pressure_angle=0.37, backlash=backlash, phase=phase
    )
    return lumped.Train(gears=gears, meshes=(mesh,), damping_ratio=DAMPING)


def system_of(errors, model=1, teeth=(7, 9), **changes) -> LumpedSystem:
    figures = lumped.StiffnessParameters(
        mean=MEAN, variation=VARIATION, contact_ratio=RATIO
    )
    excitation = lumped.analytic_excitation(
        figures, model, force=FORCE, pitch_errors=pair_errors(*errors)
    )
    return LumpedSystem(train_of(teeth, **changes), (excitation,))


def toothing_of(errors, backlash=BACKLASH):
    """All pairs of teeth, counted as they pass the pitch point."""
    one, two = errors
    count = math.lcm(len(one), len(two))
    gaps = [one[n % len(one)] + two[n % len(two)] for n in range(count)]
    return Toothing(
        driver=0,
        driven=1,
        pairs=rectangular_pairs(MEAN, VARIATION, RATIO, gaps=gaps),
        mean_stiffness=MEAN,
        backlash=backlash,
    )


def touching(errors, x):
    """Gap of each engaged pair at a position, in rising order, and its stiffness."""
    toothing = toothing_of(errors)
    pieces = [toothing.piece(pair, x) for pair in range(toothing.period)]
    engaged = [pair_pieces[0] for pair_pieces in pieces if pair_pieces]
    return sorted(piece.gap_start for piece in engaged), engaged[0].stiffness


def exact_motion(errors, frequency, backlash=BACKLASH):
    """Three periods of 63 mesh cycles, of which the last is settled."""
    disks = tuple(
        Disk(radius=r, inertia=i, torque=t)
        for r, i, t in zip(RADII, INERTIAS, TORQUES, strict=True)
    )
    train = PiecewiseTrain(disks, (toothing_of(errors, backlash),), DAMPING)
    start = np.array([FORCE / MEAN / r / 2.0 for r in RADII] + [0.0, 0.0])
    return march(train, frequency, start, 3.0 * 63.0)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("part", "backlash"), [(0.3, BACKLASH), (0.85, BACKLASH), (0.9, 4e-6)]
)
def test_hunting_teeth_have_the_exact_motion_of_all_pairs(part, backlash):
    """7 and 9 teeth, 63 mesh cycles; also with loss of contact and back contact."""
    frequency = part * NATURAL
    exact = exact_motion(SMALL, frequency, backlash)
    begin, end = 126.0 / frequency, 189.0 / frequency
    time, _ = exact.quadrature(begin, end)
    deflection, force = (x(time)[:, 0] for x in (exact.deflection, exact.force))
    system = system_of(SMALL, backlash=backlash)
    for settings, allowed in (
        (Settings(steps=512), 1e-3),
        (Settings(method="dopri5", tolerance=1e-3), 1e-3),
        (Settings(), 0.02),
    ):
        response, history = lumped.respond_with_history(system, frequency, settings)
        assert response.period_multiple.tolist() == [63]
        samples, _ = resample(history, time - begin)
        off = np.abs(samples[:, 0] - deflection).max()
        assert off < allowed * np.ptp(deflection)
        assert response.force_peak[0] == pytest.approx(np.abs(force).max(), rel=0.01)
        lost = exact.contact_loss(begin, end)[0]
        assert response.contact_loss[0] == pytest.approx(lost, abs=0.01)
    assert (response.contact_loss[0] > 0.2) == (part > 0.5 and backlash > 1e-5)
    assert (response.back_side[0] > 0.01) == (backlash < 1e-5)


def test_the_sample_of_times_grows_dense():
    """Mean, RMS and loss of contact against the exact motion."""
    frequency = 0.85 * NATURAL
    exact = exact_motion(SMALL, frequency)
    within = 126.0 / frequency, 189.0 / frequency
    settings = Settings(method="dopri5", tolerance=1e-3)
    response = lumped.respond(system_of(SMALL), frequency, settings)
    time, weight = exact.quadrature(*within)
    mean = weight @ exact.deflection(time)[:, 0] / weight.sum()
    assert response.dte_mean[0] == pytest.approx(mean, rel=1e-4)
    assert response.dte_rms[0] == pytest.approx(exact.rms(*within)[0], rel=1e-4)
    lost = exact.contact_loss(*within)[0]
    assert response.contact_loss[0] == pytest.approx(lost, abs=2e-3)


def test_rigid_teeth_without_load_follow_the_first_pair_to_touch():
    """Model-3's gap is the no-load transmission error over the whole period."""
    (spring,) = system_of(SMALL, model=3).excitations[0].pairs
    assert spring.period == 63
    x = (np.arange(63 * 40) + 0.37) / 40.0
    expected = [touching(SMALL, position)[0][0] for position in x]
    np.testing.assert_allclose(spring.gap(x), expected, atol=1e-12)
    assert np.ptp(expected) > 5e-6


def test_models_of_the_whole_mesh_have_the_statics_of_the_pairs():
    x, expected = (np.arange(63 * 16) + 0.37) / 16.0, []
    for position in x:
        gaps, k = touching(SMALL, position)
        closed = [(FORCE / k + sum(gaps[:n])) / n for n in range(1, len(gaps) + 1)]
        expected.append(min(closed))
    (mean,) = system_of(SMALL, model=2).excitations[0].pairs
    (varying,) = system_of(SMALL, model=3).excitations[0].pairs
    assert mean.period == varying.period == 63
    loaded = varying.gap(x) + FORCE / varying.stiffness(x)
    np.testing.assert_allclose(loaded, expected, rtol=1e-3)
    deflection = mean.gap(x) + FORCE / mean.stiffness(x)
    difference = deflection - expected  # the mean is that of the mean stiffness
    assert np.ptp(difference) < 1e-3 * np.ptp(expected)


def test_only_what_differs_lengthens_the_period():
    seven, nine = SMALL
    assert system_of((seven, ())).common_period == (7,)
    assert system_of(((), nine)).common_period == (9,)
    assert system_of(((), ())).common_period == (1,)
    thrice = nine[:3] * 3
    assert system_of((seven, thrice)).common_period == (21,)
    assert system_of(((2e-6,) * 7, ())).common_period == (1,)


def test_teeth_that_stand_back_alike_deflect_by_as_much_more():
    plain = lumped.respond(system_of(((), ())), 0.5 * NATURAL)
    back = lumped.respond(system_of(((2e-6,) * 7, (1e-6,) * 9)), 0.5 * NATURAL)
    assert back.dte_mean[0] - plain.dte_mean[0] == pytest.approx(3e-6, abs=1e-9)
    assert back.dte_rms[0] == pytest.approx(plain.dte_rms[0], rel=1e-3)


def test_equal_teeth_are_left_as_they_were():
    """No offset, no longer period, and samples that are kept."""
    plain, zero = system_of(((), ())), system_of(((0.0,) * 7, (0.0,) * 9))
    for system in (plain, zero):
        assert system.repetitions == 1
        assert all(p.gap.offsets.size == 0 for p in system.excitations[0].pairs)
        assert system.samples(64) is system.samples(64)


def test_a_later_pair_is_that_of_the_phase():
    """Whole base pitches of the phase count; the motion is the same, shifted."""
    shift, frequency = 2.3, 0.6 * NATURAL
    _, here = lumped.respond_with_history(system_of(SMALL), frequency)
    _, there = lumped.respond_with_history(system_of(SMALL, phase=shift), frequency)
    x = np.arange(40 * 8) / 8.0
    one, _ = resample(here, (x + shift) / frequency)
    other, _ = resample(there, x / frequency)
    np.testing.assert_allclose(one, other, atol=0.01 * np.ptp(one))


@pytest.mark.parametrize("method", ["rk4", "dopri5"])
def test_meshes_of_one_train_repeat_together(idler, figures, method):
    """Errors of the idler alone: 55 cycles in both meshes, whatever the phase."""
    errors = tuple(np.random.default_rng(5).uniform(-3e-6, 3e-6, 55).tolist())
    seen = ((), errors), (tuple(-e for e in errors), ())
    excitations = tuple(
        lumped.analytic_excitation(figures(m), pitch_errors=pair_errors(*seen[m]))
        for m in range(2)
    )
    system = LumpedSystem(idler(phases=(0.0, 0.3)), excitations)
    assert system.common_period == (55, 55)
    tight = 1e-3 if method == "dopri5" else 1e-4
    response = lumped.respond(system, 900.0, Settings(method=method, tolerance=tight))
    assert response.period_multiple.tolist() == [55, 55]
    fine = lumped.respond(system, 900.0, Settings(steps=256))
    np.testing.assert_allclose(response.dte_rms, fine.dte_rms, rtol=5e-3)


def test_meshes_at_other_rates_wait_for_each_other():
    """51/72 and 19/73 teeth, errors on the first pinion: 1224 cycles of mesh 1."""
    gears = tuple(
        lumped.Gear(name=str(z), teeth=z, base_radius=0.05, inertia=0.01, torque=t)
        for z, t in ((51, 1.0), (72, 0.0), (19, 0.0), (73, -1.0))
    )
    meshes = tuple(
        lumped.Mesh(driver=i, driven=i + 1, pressure_angle=0.35) for i in (0, 2)
    )
    shafts = (lumped.Shaft(gears=(1, 2), stiffness=1e5),)
    train = lumped.Train(gears=gears, meshes=meshes, shafts=shafts)
    figures = lumped.StiffnessParameters(mean=1e8, variation=0.3, contact_ratio=1.5)
    first = pair_errors(np.arange(51) * 1e-7, ())
    excitations = [
        lumped.analytic_excitation(figures, pitch_errors=e) for e in (first, ())
    ]
    system = LumpedSystem(train, tuple(excitations))
    assert train.common_period == (72, 19)
    assert system.common_period == (1224, 323)
    second = pair_errors((), np.arange(19) * 1e-7)  # 19 cycles pass in 72 anyway
    excitations = [
        lumped.analytic_excitation(figures, pitch_errors=e) for e in ((), second)
    ]
    assert LumpedSystem(train, tuple(excitations)).common_period == (72, 19)


def test_a_period_that_memory_cannot_hold_is_refused_with_its_length(idler, figures):
    teeth = [np.arange(z) * 1e-7 for z in (38, 55, 94)]
    excitations = tuple(
        lumped.analytic_excitation(
            figures(m), pitch_errors=pair_errors(teeth[m], teeth[m + 1])
        )
        for m in range(2)
    )
    system = LumpedSystem(idler(), excitations)
    with pytest.raises(TrainError, match=r"98230 periods .* GB .* allowed are"):
        lumped.respond(system, 1500.0)


def test_sections_and_spectrum_span_the_whole_period():
    motion = time_history(system_of(SMALL), 0.4 * NATURAL)
    assert len(motion.section_rate) == 63
    # no line lies between the orders of the shafts' common turn
    assert motion.spectrum_frequency[1] == pytest.approx(0.4 * NATURAL / 63)
    lines = spectrum(motion.history)[1][:, 0]
    shafts = lines[[9, 7]]  # once a turn of the gear with 7, with 9 teeth
    assert (shafts > 10.0 * np.median(lines[1:63])).all()


@given(
    st.lists(st.integers(-3, 3), min_size=1, max_size=12),
    st.lists(st.integers(-3, 3), min_size=1, max_size=12),
)
def test_pairs_repeat_after_their_shortest_period(driver, driven):
    gaps = pair_errors(driver, driven)
    every = np.arange(4 * len(driver) * len(driven))
    full = pair_gaps(driver, driven, every)
    if not gaps.size:
        assert not full.any()
        return
    np.testing.assert_array_equal(gaps[every % gaps.size], full)
    assert len(driver) * len(driven) % gaps.size == 0


def test_the_shortest_period_is_a_divisor():
    assert minimal_period([1, 2, 1, 2, 1, 2]) == 2
    assert minimal_period([1, 2, 1, 2, 1]) == 5
    assert minimal_period([4, 4, 4]) == 1


def test_back_flanks_stand_ahead_and_meet_the_tooth_before():
    driver, driven = [1.0, 2.0, 4.0], [10.0, 20.0]
    drive = pair_gaps(driver, driven, np.arange(6))
    np.testing.assert_array_equal(drive, [11, 22, 14, 21, 12, 24])
    back = pair_gaps(driver, driven, np.arange(6), back=True)
    np.testing.assert_array_equal(back, [-14, -21, -12, -24, -11, -22])


def test_waves_over_several_pitches():
    samples = np.random.default_rng(1).normal(size=15)
    wave = wave_from_samples(samples, pitches=3)
    assert wave.period == 3
    x = np.arange(15) / 5.0
    np.testing.assert_allclose(wave(x), samples)
    np.testing.assert_allclose(wave(x + 3.0), samples)
    np.testing.assert_allclose(wave(0.0, pitch=np.arange(3)), samples[::5])
    np.testing.assert_allclose(wave(1.0, side=-1), samples[5])  # continuous
    shifted = Wave(wave.breaks, wave.coefficients, offsets=np.array([0.0, 7.0]))
    assert shifted.period == 6
    np.testing.assert_allclose(
        shifted(x + 1.0) - wave(x + 1.0), [7] * 5 + [0] * 5 + [7] * 5
    )
    # the end of one base pitch is not the start of the next
    steps = replace(constant_wave(1.0), offsets=np.array([0.0, 5.0]))
    assert (steps(1.0, side=-1), steps(1.0)) == (1.0, 6.0)
    assert steps.mean == pytest.approx(3.5)
    assert shifted.scaled(2.0, 1.0)(0.4) == pytest.approx(2.0 * shifted(0.4) + 1.0)


def table_of(pitches: int, errors=()) -> MeshTable:
    """Two pairs of constant stiffness on the way, with the gaps of the errors."""
    per_pitch = 8
    position = np.arange(pitches * per_pitch) / per_pitch
    pitch = position.astype(int)
    offset = np.asarray(errors or (0.0,))
    columns = {"stiffness_N_per_m": 2.0 + 0.1 * np.cos(2.0 * np.pi * position)}
    columns |= {"ste_m": offset[pitch % offset.size], "nlte_m": 0.0 * position}
    for number, k in enumerate((0, -1), start=1):
        columns |= {
            f"pair{number}_stiffness_N_per_m": 1.0 + 0.1 * (position % 1.0 + k),
            f"pair{number}_load_share": np.full(position.size, 0.5),
            f"pair{number}_gap_m": offset[(pitch - k) % offset.size],
        }
    columns = {name: values[None] for name, values in columns.items()}
    header = {"pairs ahead of the reference pair": "pair1=+0 pair2=-1"}
    return MeshTable(np.array([100.0]), position, columns, header)


def test_a_table_over_all_pairs_is_that_of_one_pitch_with_errors():
    errors = [0.0, 3e-6, -1e-6]
    whole = excitation_from_table(table_of(3, errors), 100.0)
    single = excitation_from_table(table_of(1), 100.0, pitch_errors=errors)
    assert whole.period == single.period == 3
    x = (np.arange(60) + 0.5) / 20.0
    for one, other in zip(whole.pairs, single.pairs, strict=True):
        np.testing.assert_allclose(one.gap(x), other.gap(x), atol=1e-12)
        np.testing.assert_allclose(one.stiffness(x), other.stiffness(x), rtol=1e-12)


def test_a_table_over_all_pairs_serves_the_models_of_the_whole_mesh():
    table = table_of(3, [0.0, 3e-6, -1e-6])
    assert table_pitches(table) == 3
    (spring,) = excitation_from_table(table, 100.0, model=2).pairs
    np.testing.assert_allclose(
        spring.gap([0.5, 1.5, 2.5]), [-2e-6 / 3, 7e-6 / 3, -5e-6 / 3], atol=1e-12
    )
    assert excitation_from_table(table, 100.0, model=3).period == 3


def test_errors_need_tooth_pairs():
    for model in (2, 3):
        with pytest.raises(ValueError, match="model 1 and a table with columns"):
            excitation_from_table(table_of(1), 100.0, model, pitch_errors=[1e-6, 0.0])
    figures = lumped.StiffnessParameters(mean=1e8, variation=0.3, contact_ratio=1.5)
    with pytest.raises(ValueError, match="harmonics represent the complete mesh"):
        lumped.analytic_excitation(figures, harmonics=3, pitch_errors=[1e-6, 0.0])


@pytest.mark.parametrize("size", [12, 13])
def test_tables_that_end_within_a_base_pitch_are_refused(size):
    table = table_of(2)
    columns = {name: values[:, :size] for name, values in table.columns.items()}
    short = MeshTable(table.torque_Nm, table.position[:size], columns, table.header)
    with pytest.raises(ValueError, match="as many in each further base pitch"):
        excitation_from_table(short, 100.0)


@pytest.mark.parametrize("cell", [3, 11, 20])
def test_holes_on_the_way_of_any_pair_are_refused(cell):
    """A pair's way goes on in the next column after each base pitch."""
    table = table_of(3, [0.0, 3e-6, -1e-6])
    for name in ("stiffness_N_per_m", "gap_m"):
        columns = {key: values.copy() for key, values in table.columns.items()}
        columns[f"pair2_{name}"][0, cell] = np.nan
        holed = MeshTable(table.torque_Nm, table.position, columns, table.header)
        place = f"pair2_{name} is empty .* position {cell / 8:g};"
        with pytest.raises(ValueError, match=place):
            excitation_from_table(holed, 100.0)


def test_a_pair_may_carry_nothing_before_and_after_its_way():
    """In some base pitches more than in others: no hole, but a stiffness of zero."""
    table = table_of(3)
    columns = {key: values.copy() for key, values in table.columns.items()}
    for name in ("stiffness_N_per_m", "load_share", "gap_m"):
        # the pair that is reference pair in base pitch 1 comes late, in base pitch 2
        columns[f"pair2_{name}"][0, 16:19] = np.nan if name == "gap_m" else 0.0
    late = MeshTable(table.torque_Nm, table.position, columns, table.header)
    pair = excitation_from_table(late, 100.0).pairs[0]
    stiffness = pair.stiffness([2.05, 1.05, 0.05])
    assert stiffness[0] == 0.0
    assert (stiffness[1:] > 0.0).all()
