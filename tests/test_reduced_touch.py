"""A reduced touch: interpolation, relaxation, streaming, files, and agreement with the full solver."""

import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import fingerpad as fp
from fingerpad.cli import main
from fingerpad.core.signals import Traces
from fingerpad.geometry.motion import Pose
from fingerpad.neuron.afferent_types import afferent_types
from fingerpad.reduction.building import filtered, joint_bounds, largest_errors, reduce_touch
from fingerpad.reduction.model import (
    AT_ONCE,
    LEVELS,
    ReducedModel,
    Springs,
    amplitudes,
    levels_mm,
    lost,
    slope_changes,
    write_reduced,
)
from fingerpad.reduction.streaming import read_local
from fingerpad.reduction.training import (
    Axis,
    ReducedRange,
    ReducedTraining,
    chebyshev_points,
    first_touch_mm,
    lagrange,
)
from refusals import refusals, refused

DEEPEST_MM = 1.0
TOUCH = fp.touch_of(fp.Fingertip(), fp.Sphere(curvature_per_m=287))


@pytest.fixture(scope="module")
def training() -> ReducedTraining:
    return ReducedTraining(TOUCH, ReducedRange(DEEPEST_MM))


WORDS = "reduce", "range.yaml", "--out", "ball.npz", "--jobs", "1"


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """Folder in which the command has made the same reduced touch, and what it printed."""
    folder = tmp_path_factory.mktemp("reduced")
    content = f"""
object: {{kind: sphere, curvature_per_m: 287}}
place: {{tilt_deg: 0}}
range: {{depth_mm: {DEEPEST_MM}}}
calibration: 0
"""
    (folder / "range.yaml").write_text(content, encoding="utf-8")
    command = (sys.executable, "-W", "error", "-m", "fingerpad", *WORDS)
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return folder, done.stdout


@pytest.fixture(scope="module")
def model(written: tuple[Path, str], training: ReducedTraining) -> ReducedModel:
    return fp.read_reduced(written[0] / "ball.npz", training.touch)


def test_the_model_s_interpolation_is_exact_within_its_range():
    points, at = chebyshev_points(5), np.linspace(0.0, 1.0, 11)
    for power in range(5):
        np.testing.assert_allclose(lagrange(points, at) @ points**power, at**power, atol=1e-13)
    assert np.abs(lagrange(points, at) @ points**5 - at**5).max() > 1e-4
    axis = Axis("x_mm", -1.0, 2.0, 4)
    np.testing.assert_allclose(axis.weights(1.3) @ axis.values, 1.3)
    with pytest.raises(fp.InputError, match=r"x_mm must lie within -1 to 2, .* got 2.5"):
        axis.weights(2.5)
    i, j = np.meshgrid(np.arange(9.0), np.arange(9.0), indexing="ij")
    places = np.array([[2.3, 4.7], [5.0, 5.0], [3.5, 1.25]])
    u, v = places.T
    field = (0.3 * i**2 - 0.1 * i * j + j)[..., None]
    np.testing.assert_allclose(read_local(field, places)[0], 0.3 * u**2 - 0.1 * u * v + v, atol=1e-12)
    assert (read_local(field, np.array([[-0.1, 3.0], [3.0, 8.2]])) == 0.0).all()
    levels = levels_mm(1.5)
    ends = np.append(levels, 1.5)
    weights = slope_changes(levels, 1.5, np.stack([ends**1.5, ends**2], axis=1))
    np.testing.assert_allclose(
        np.maximum(ends[:, None] - levels, 0.0) @ weights, np.stack([ends**1.5, ends**2], axis=1), atol=1e-12
    )


def test_the_filter_solves_its_equation() -> None:
    times = np.array([0.0, 10.0, 30.0, 80.0, 81.0])
    values = np.array([[0.0], [2.0], [1.0], [1.0], [4.0]])

    def slope(time: float, m: np.ndarray) -> np.ndarray:
        return np.asarray((np.interp(time, times, values[:, 0]) - m) / 25.0)

    known = solve_ivp(slope, (0.0, 81.0), [0.0], t_eval=times, max_step=0.5, rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(filtered(times, values, 25.0)[:, 0], known.y[0], atol=1e-6)


def test_the_energy_of_a_branch_is_the_square_of_its_strain() -> None:
    times, constant, share = np.linspace(0.0, 300.0, 3001), 40.0, 0.3
    strain = np.minimum(times / 50.0, 1.0)[:, None]
    relaxed = filtered(times, share**0.5 * strain, constant)
    values = np.stack([share * strain[:, 0] ** 2, share**0.5 * strain[:, 0]])  # energy, and a stress
    squared = np.array([True, False])
    left = values[:, None] - lost(amplitudes(values, squared), relaxed.T.repeat(2, axis=0), squared)[:, None]
    # A spring of stiffness 2 g in line with a damper: its strain decays, and its energy twice as fast.
    hold = times >= 50.0
    decay = np.exp(-(times[hold] - 50.0) / constant)
    strain_left = (share**0.5 * constant / 50.0) * (1.0 - np.exp(-50.0 / constant)) * decay
    np.testing.assert_allclose(left[1, 0, hold], strain_left, rtol=1e-6)
    np.testing.assert_allclose(left[0, 0, hold], strain_left**2, rtol=1e-6)


def test_a_released_spring_stays_behind_and_recovers_in_closed_form() -> None:
    constant, share, way_mm = 60.0, 0.4, 0.8
    times_ms, shares = np.array([constant]), np.array([share])

    def at(mm: float) -> np.ndarray:
        return np.full(LEVELS, mm)

    springs = Springs.at_rest(1).followed(1e-3, at(way_mm), times_ms, shares)
    springs = springs.followed(1e3 * constant, at(way_mm), times_ms, shares)
    np.testing.assert_allclose(springs.relaxed_mm, share * way_mm, rtol=1e-6)
    springs = springs.followed(1e-6, at(0.0), times_ms, shares)  # nothing presses: u = g u0
    np.testing.assert_allclose(springs.way_mm, share * way_mm, rtol=1e-6)
    step_ms, n = 0.5, 100
    for _ in range(n):  # tau du/dt = g u - u
        springs = springs.followed(step_ms, at(0.0), times_ms, shares)
    recovered_mm = share * way_mm * np.exp(-(1.0 - share) * n * step_ms / constant)
    np.testing.assert_allclose(springs.way_mm, recovered_mm, rtol=1e-4)
    met = springs.followed(step_ms, at(0.3), times_ms, shares)
    np.testing.assert_allclose(met.way_mm, 0.3)


@pytest.mark.parametrize(
    ("times_ms", "depth_mm", "bounds"),
    [
        ([0.0, 60.0, 800.0], [0.0, 0.8, 0.8], (0.009, 0.014, 0.009, 0.005)),
        ([0.0, 40.0, 300.0, 340.0, 600.0], [0.0, 0.95, 0.95, 0.4, 0.4], (0.006, 0.012, 0.006, 0.0035)),
        ([0.0, 40.0, 1000.0, 1030.0, 1300.0, 1330.0, 1600.0], [0.0, 0.95, 0.95, 0.15, 0.15, 0.9, 0.9],
         (0.03, 0.045, 0.045, 0.015)),
    ],
    ids=["press and hold", "partial release", "almost released, and again"],
)  # fmt: skip
def test_it_agrees_with_the_full_solver_on_touches_not_used(
    training: ReducedTraining,
    model: ReducedModel,
    times_ms: list[float],
    depth_mm: list[float],
    bounds: tuple[float, ...],
) -> None:
    skin = training.touch_with((), fp.Trajectory(tuple(times_ms), depth_mm=tuple(depth_mm))).solve()
    found = largest_errors(model, skin)
    assert (found < np.array(bounds)).all(), found
    if len(times_ms) == 3:  # without relaxation it is wrong
        at_once = np.arange(model.totals.shape[1]) < AT_ONCE
        elastic = replace(model, totals=model.totals * at_once[:, None])
        assert largest_errors(elastic, skin)[-1] > 0.02


def test_bounds_hold_for_all_quantities_together() -> None:
    random, kept = np.random.default_rng(5), []
    for _ in range(2000):
        errors = random.lognormal(size=(20 + 1, 3)) * [1.0, 20.0, 0.01]
        kept.append(bool((errors[-1] <= joint_bounds(errors[:-1])).all()))
    assert np.mean(kept) == pytest.approx(20 / 21, abs=0.015)


def test_a_force_finds_its_depth(model: ReducedModel) -> None:
    by_depth, by_force = (fp.ReducedTouch(model, [(17.37, 0.0)]) for _ in range(2))
    wanted = by_depth.step(100.0, depth_mm=0.7)
    found = by_force.step(100.0, force_mn=wanted.force_mn)
    assert found.depth_mm == pytest.approx(0.7, abs=1e-5)
    later = by_force.step(1000.0, force_mn=wanted.force_mn)
    assert later.depth_mm > found.depth_mm  # the skin creeps


def test_a_force_may_fall_to_nothing_and_come_back(model: ReducedModel) -> None:
    stream = fp.ReducedTouch(model, [(17.37, 0.0)])
    forces_mn = {1000.0: 40.0, 1020.0: 5.0, 1040.0: 0.01, 1060.0: 1e-9, 1100.0: 0.0, 1200.0: 20.0}
    for until_ms, wanted_mn in forces_mn.items():
        sample = stream.step(until_ms, force_mn=wanted_mn)
        # A touch of a few micrometres of skin that is still behind is not resolved.
        assert sample.force_mn == pytest.approx(wanted_mn, abs=1e-3 if wanted_mn >= 5.0 else 0.05)
        assert -1e-6 < sample.depth_mm < DEEPEST_MM


def test_a_touch_out_of_its_range_leaves_the_state_as_it_was(model: ReducedModel) -> None:
    stream = fp.ReducedTouch(model, [(17.37, 0.0)])
    stream.step(50.0, depth_mm=0.5)
    for wrong in ({"depth_mm": 1.5}, {"depth_mm": 0.5, "x_mm": 1.0}, {"force_mn": 1e4}, {}):
        with pytest.raises(fp.InputError):
            stream.step(60.0, **wrong)
    with pytest.raises(fp.InputError, match="time_ms must not go back"):
        stream.step(40.0, depth_mm=0.5)
    again = fp.ReducedTouch(model, [(17.37, 0.0)])
    again.step(50.0, depth_mm=0.5)
    assert stream.step(70.0, depth_mm=0.6).fields == again.step(70.0, depth_mm=0.6).fields


def test_a_file_has_the_same_bits_and_tells_damage(tmp_path: Path, model: ReducedModel) -> None:
    path = tmp_path / "sphere.npz"
    write_reduced(model, path)
    assert path.stat().st_size < 5e6
    read = fp.read_reduced(path, fp.touch_of(fp.Fingertip(), fp.Sphere()))
    assert (read.modes == model.modes).all()
    assert read.axes == model.axes
    assert repr(read) == repr(model)
    assert "\n" not in repr(read)
    assert "errors not measured" in repr(read)
    with pytest.raises(fp.InputError, match="another finger"):
        fp.read_reduced(path, fp.touch_of(fp.Fingertip.of("child"), fp.Sphere()))
    content = path.read_bytes()
    flipped = [
        content[:place] + bytes([content[place] ^ 16]) + content[place + 1 :]
        for place in range(100, len(content), len(content) // 7)
    ]
    for damaged in (content[:-200], content[: len(content) // 2], b"nothing of this kind", b"", *flipped):
        path.write_bytes(damaged)
        with pytest.raises(fp.InputError, match=r"sphere\.npz"):
            fp.read_reduced(path)
    with pytest.raises(fp.InputError, match="must be a file that can be read"):
        fp.read_reduced(tmp_path / "none.npz")


test_what_cannot_be_reduced_is_told_before_a_press = refusals(
    (lambda: ReducedRange(0.0), ("depth_mm",)),
    (lambda: ReducedRange(1.0, x_mm=(1.0, 2.0)), ("x_mm",)),
    (lambda: ReducedRange(1.0, z_mm=(2.0, -2.0)), ("z_mm",)),
    (lambda: ReducedRange(1.0, x_mm=3.0), ("x_mm",)),
    (lambda: ReducedRange(1.0, parameter="curvature_per_m"), "or neither"),
    (lambda: ReducedTraining(replace(TOUCH, friction=0.5), ReducedRange(1.0, (-1, 1))), ("friction",)),
    (lambda: ReducedTraining(TOUCH, ReducedRange(1.0, parameter="a", values=(1, 2))), ("parameter",)),
    (lambda: reduce_touch(ReducedTraining(TOUCH, ReducedRange(1.0)), calibration=5), ("calibration",)),
    (lambda: list(ReducedTraining(TOUCH, ReducedRange(9.0)).poses()), ("depth_mm",)),
)  # fmt: skip


def test_a_pose_aside_is_met_as_by_an_indenter_that_moves_there() -> None:
    touch = fp.touch_of(fp.Fingertip(), fp.Sphere(curvature_per_m=287), tilt_deg=5.0)
    aside = ReducedTraining(touch, ReducedRange(1.0, x_mm=(0.0, 2.0)))
    for pose in aside.poses():
        x_mm = pose.values[0]
        base = aside.touch_with()
        start_mm = base.placement.origin_mm + np.array([x_mm, 0.0, 0.0])
        off = pose.touches[0].placement.origin_mm - start_mm
        along = off @ base.placement.axis
        assert np.linalg.norm(off - along * base.placement.axis) < 1e-6
        assert pose.first_touch_mm == pytest.approx(along, abs=1e-9)


@dataclass(frozen=True)
class Leaf(fp.Indenter):
    """Wide plate that skin nodes are soon behind of."""

    thickness_mm: float = 0.1

    def gap(self, points_mm: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        middle = points_mm[:, 1] + 0.5 * self.thickness_mm
        return np.abs(middle) - 0.5 * self.thickness_mm, np.sign(middle)[:, None] * [0.0, 1.0, 0.0]


@pytest.mark.parametrize(
    "body",
    [Leaf(), fp.Plate(), fp.bodies.Union([Leaf(), fp.Sphere(radius_mm=1.0)], [(0, 0, 0), (2, -3, 0)])],
    ids=["thin", "without an end", "of parts"],
)
@pytest.mark.parametrize("tilt_deg", [-40.0, 0.0, 15.0])
def test_a_tilted_face_meets_the_skin_where_it_does_in_closed_form(
    body: fp.Indenter, tilt_deg: float
) -> None:
    """The root was sought over 6 mm to either side: behind a thin body, and too near to a tilted plate."""
    touch = fp.touch_of(fp.Fingertip(), body)
    skin_mm = touch.mesh.nodes_mm[touch.mesh.skin_nodes] - touch.placement.origin_mm
    sine, cosine = np.sin(np.deg2rad(tilt_deg)), np.cos(np.deg2rad(tilt_deg))
    expected = (skin_mm[:, 1] - skin_mm[:, 0] * sine / cosine).min()
    assert first_touch_mm(touch, Pose(tilt_deg=tilt_deg)) == pytest.approx(expected, abs=1e-8)


def test_a_wire_meets_the_skin_at_its_place() -> None:
    """Its gap is that of a plate: it was lifted to the highest place of the pad."""
    touch = fp.touch_of(fp.Fingertip(), fp.bodies.Line())
    assert [pose.meets_mm for pose in ReducedTraining(touch, ReducedRange(0.5)).poses()] == [0.0]


OWN = fp.OwnAfferent(
    lambda sed: fp.SpikeTrains.from_lists(
        [sed.times_ms[1:][np.diff(course) > 0.5] for course in sed.values.T]
    )
)


@pytest.mark.parametrize(
    "afferent",
    [
        *(fp.Afferent(), *afferent_types().values(), fp.Afferent(static_quantity="stored"), OWN),
        *(fp.Afferent(adapting_share=0.5, adapting_ms=20.0), fp.SAI(adapting_share=0.5, adapting_ms=20.0)),
        *(fp.Afferent(saturation_per_ma=2e5), fp.SAI(saturation_per_ma=2e5), fp.RA(saturation=0.5)),
    ],
    ids=lambda afferent: type(afferent).__name__,
)
def test_streamed_spikes_are_those_of_one_go(afferent: fp.Afferent) -> None:
    random = np.random.default_rng(3)
    times = np.cumsum(np.append(0.0, random.uniform(0.5, 2.0, 400)))
    sed = np.vstack([np.zeros(5), np.abs(np.cumsum(random.normal(0.0, 0.4, (400, 5)), axis=0))])
    quantities = afferent.dynamic_quantity, afferent.static_quantity
    other = None if quantities[0] == quantities[1] else sed[:, ::-1]
    dynamic = None if other is None else Traces(times, other, quantity=quantities[0])
    whole = afferent.spikes(Traces(times, sed, times[1:-1], quantity=quantities[1], dynamic=dynamic))
    stream = fp.AfferentStream(afferent, 5)
    rows = enumerate(times[1:].tolist(), start=1)
    parts = [stream.step(time, sed[row], None if other is None else other[row]) for row, time in rows]
    for site in range(5):
        streamed = np.concatenate([part[site] for part in parts])
        assert streamed.size > 10
        np.testing.assert_allclose(streamed, whole[site], rtol=0.0, atol=1e-9)


def test_a_stream_refuses_wrong_samples() -> None:
    stream = fp.AfferentStream(fp.Afferent.for_tissues("paper"), 2)
    with pytest.raises(fp.InputError, match="follows one quantity"):
        stream.step(1.0, [0.0, 0.0], [0.0, 0.0])
    stream.step(1.0, [0.0, 0.0])
    for path, sample in (("static", (2.0, [0.0, 0.0, 0.0])), ("time_ms", (1.0, [0.0, 0.0]))):
        with refused(path):
            stream.step(*sample)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("object: sphere\n", "range must be given"),
        ("object: sphere\nrange: {depth_mm: -1}\n", "range.depth_mm must be greater than 0"),
        ("object: sphere\nrange: {depth_mm: 1, x_mm: 3}\n", "range.x_mm must be a pair [mm]"),
        ("object: sphere\nrange: {depth_mm: 1, y_mm: [0, 1]}\n", "y_mm"),
        ("object: sphere\nrange: {depth_mm: 1}\nmotion: {depth_mm: 1}\n", "motion must be left out"),
        ("object: sphere\nrange: {depth_mm: 1, x_mm: [-30, 30]}\n", "finger"),
        ("object: sphere\nrange: [1]\n", "range must be a mapping"),
    ],
)
def test_a_wrong_file_is_one_sentence_before_a_press(
    run_program: Callable[..., tuple[int, str, str]], tmp_path: Path, content: str, said: str
) -> None:
    (tmp_path / "range.yaml").write_text(content, encoding="utf-8")
    status, _, errors = run_program(main, "fingerpad", "reduce", "range.yaml")
    assert status == 2
    assert said in errors
    assert errors.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["range.yaml"]


def test_the_command_presses_once_and_writes_the_same_file_again(
    run_program: Callable[..., tuple[int, str, str]],
    written: tuple[Path, str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    folder, printed = written
    assert f"1 poses, one place, up to {DEEPEST_MM:g} mm deep" in printed
    first = (folder / "ball.npz").read_bytes()
    monkeypatch.setattr("fingerpad.skin.store._compute", pytest.fail)
    monkeypatch.chdir(folder)
    assert run_program(main, "fingerpad", *WORDS)[0] == 0
    assert (folder / "ball.npz").read_bytes() == first
