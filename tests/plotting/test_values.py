"""Pictures show the values they are given."""

import numpy as np
import pytest

from probdmp.dmp import task_for
from probdmp.dmp.basis import basis_features
from probdmp.dmp.forcing_term import forcing_term
from probdmp.dmp.phase import phases_at
from probdmp.execution import position_covariances, roll_out, smooth_recording, task_of_recording, track_recording
from probdmp.execution.trajectory import HALF_BAND
from probdmp.plotting.demonstrations import plot_demonstrated_paths, plot_demonstrations
from probdmp.plotting.executions import plot_filtered_and_smoothed, plot_uncertainties
from probdmp.plotting.forcing import plot_basis, plot_forcing, plot_phase
from probdmp.plotting.monitoring import Curve, plot_log_likelihoods, plot_monitored_position, plot_test_ratios
from probdmp.plotting.operating import plot_by_onset, plot_latencies, plot_operating_curve, plot_soon_enough
from probdmp.plotting.trajectories import QUANTITIES, ellipses, evenly_spaced, plot_path_tube, plot_rollout, tube_ellipses


def labelled(ax):
    return {line.get_label(): line for line in ax.lines}


def limits(collection, at):
    """Lowest and highest ordinate of a band at each of the abscissas, (2, T)."""
    vertices = collection.get_paths()[0].vertices
    at_each = [vertices[np.isclose(vertices[:, 0], x)][:, 1] for x in at]
    return np.array([[y.min() for y in at_each], [y.max() for y in at_each]])


@pytest.fixture(scope="module")
def planned(primitive):
    return roll_out(primitive, task_for(primitive), primitive.dt)


@pytest.mark.parametrize("quantity", QUANTITIES)
def test_a_rollout_is_its_mean_and_95_percent(ax, planned, quantity):
    assert plot_rollout(ax, planned, 1, quantity) is ax
    means, stds, per = QUANTITIES[quantity]
    mean, std = getattr(planned, means)[:, 1], getattr(planned, stds)[:, 1]
    np.testing.assert_array_equal(ax.lines[0].get_ydata(), mean)
    expected = [mean - HALF_BAND * std, mean + HALF_BAND * std]
    np.testing.assert_allclose(limits(ax.collections[0], planned.times), expected, atol=1e-9)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("Time [s]", f"y {quantity} [mm{per}]")


def test_data_without_a_unit_say_so(ax, letters):
    from dataclasses import replace

    plot_demonstrations(ax, [replace(letters[0], units="")], 0)
    assert ax.get_ylabel() == "x [data units]"


def test_demonstrations_are_drawn_as_recorded_with_gaps(ax, letters, blocked):
    from dataclasses import replace

    gap = blocked.positions.copy()
    gap[5:9] = np.nan
    plot_demonstrations(ax, [letters[0], replace(blocked, positions=gap)], 1)
    np.testing.assert_array_equal(ax.lines[0].get_ydata(), letters[0].positions[:, 1])
    np.testing.assert_array_equal(ax.lines[1].get_ydata(), gap[:, 1])
    np.testing.assert_array_equal(ax.lines[1].get_xdata(), blocked.times)


def test_paths_take_two_degrees_of_freedom_and_may_be_moved_to_one_start(ax, letters):
    plot_demonstrated_paths(ax, letters[:2], (1, 0))
    np.testing.assert_array_equal(ax.lines[0].get_xdata(), letters[0].positions[:, 1])
    plot_demonstrated_paths(ax, letters[:2], start=np.array([3.0, 4.0]))
    np.testing.assert_allclose([ax.lines[-1].get_xdata()[0], ax.lines[-1].get_ydata()[0]], [3, 4])


def test_phase_and_basis(ax, primitive):
    plot_phase(ax, 2.0)
    times = ax.lines[0].get_xdata()
    np.testing.assert_array_equal(ax.lines[0].get_ydata(), phases_at(times, 2.0))
    ax.clear()
    plot_basis(ax, 8, 2.0)
    *functions, total = ax.lines
    np.testing.assert_array_equal([f.get_ydata() for f in functions], basis_features(phases_at(times, 2.0), 8).T)
    np.testing.assert_allclose(np.sum([f.get_ydata() for f in functions], axis=0), total.get_ydata())


@pytest.mark.parametrize("noise", ["predictive", "posterior"])
def test_the_forcing_term_has_its_variance(ax, primitive, noise):
    from dataclasses import replace

    changed = replace(primitive, configuration=replace(primitive.configuration, forcing_noise=noise),
                      forcing_precisions=np.full(2, 1e-6))  # fmt: skip
    plot_forcing(ax, changed, 0)
    times = ax.lines[0].get_xdata()
    term = forcing_term(changed, phases_at(times, changed.duration))
    np.testing.assert_array_equal(ax.lines[0].get_ydata(), term.means[:, 0])
    half = HALF_BAND * np.sqrt(term.variances[:, 0])
    expected = [term.means[:, 0] - half, term.means[:, 0] + half]
    np.testing.assert_allclose(limits(ax.collections[0], times), expected, rtol=1e-6, atol=1e-6)
    assert len(ax.collections) == (2 if noise == "predictive" else 1)
    assert ax.get_ylabel() == "Forcing term of x [mm]"


def test_ellipses_of_a_tube_are_those_that_are_drawn():
    centers = np.array([[1.0, 2.0], [-3.0, 0.5]])
    covariances = np.array([[[4.0, 1.5], [1.5, 1.0]], [[0.0, 0.0], [0.0, 2.0]]])
    angles = np.linspace(0, 2 * np.pi, 32)
    for outline, (x, y, first, second, turn) in zip(
        ellipses(centers, covariances, 2.0), tube_ellipses(centers, covariances, 2.0), strict=True
    ):
        own = np.stack([first * np.cos(angles), second * np.sin(angles)])
        turned = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]) @ own
        distances = np.linalg.norm(outline[:, None] - (turned.T + np.array([x, y])), axis=2).min(axis=1)
        assert distances.max() < 0.25 * max(first, second)  # the next of 32 points
        np.testing.assert_allclose(np.ptp(outline, axis=0), np.ptp(turned, axis=1), atol=0.02 * max(first, second))


def test_samples_are_chosen_evenly_with_both_ends():
    assert evenly_spaced(5, 200).tolist() == [0, 1, 2, 3, 4]
    assert evenly_spaced(1000, 3).tolist() == [0, 500, 999]
    assert evenly_spaced(1, 10).tolist() == [0]


def test_ellipses_lie_at_their_distance():
    covariance = np.array([[4.0, 1.5], [1.5, 1.0]])
    outline = ellipses(np.array([[1.0, 2.0]]), covariance[None], 2.0)[0] - [1.0, 2.0]
    np.testing.assert_allclose(np.einsum("ni,ij,nj->n", outline, np.linalg.inv(covariance), outline), 4.0)


def test_the_tube_holds_every_ellipse_and_the_path(ax, primitive, planned):
    from matplotlib.path import Path

    covariances = position_covariances(primitive, task_for(primitive), primitive.dt)
    plot_path_tube(ax, planned, covariances, (1, 0))
    np.testing.assert_array_equal(labelled(ax)["mean"].get_xdata(), planned.positions[:, 1])
    hulls = [Path(p.vertices) for p in ax.collections[0].get_paths()]
    swapped = covariances[:, ::-1, ::-1]
    for k in (0, 20, len(planned.times) - 1):
        outline = ellipses(planned.positions[[k]][:, ::-1], swapped[[k]], 1.999)[0]
        assert all(any(hull.contains_point(point) for hull in hulls) for point in outline)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("y [mm]", "x [mm]")


def test_a_path_that_is_known_has_a_tube_too(ax, planned):
    plot_path_tube(ax, planned, np.zeros((len(planned.times), 2, 2)))
    assert ax.collections


def test_filtered_and_smoothed(ax, primitive, blocked):
    task = task_of_recording(primitive, blocked)
    tracked, smoothed = track_recording(primitive, task, blocked), smooth_recording(primitive, task, blocked)
    plot_filtered_and_smoothed(ax, tracked, smoothed, 0, "velocity")
    for line, collection, trajectory in zip(ax.lines, ax.collections, (tracked, smoothed), strict=True):
        mean, std = trajectory.velocities[:, 0], trajectory.velocity_stds[:, 0]
        np.testing.assert_array_equal(line.get_ydata(), mean)
        expected = [mean - HALF_BAND * std, mean + HALF_BAND * std]
        np.testing.assert_allclose(limits(collection, blocked.times), expected, atol=1e-9)
    ax.clear()
    plot_uncertainties(ax, tracked, smoothed, 1)
    filtered_stds, smoothed_stds = (line.get_ydata() for line in ax.lines)
    np.testing.assert_array_equal(smoothed_stds, smoothed.position_stds[:, 1])
    assert np.all(smoothed_stds <= filtered_stds + 1e-12)


def test_test_ratios_have_their_threshold_at_one_and_leave_out_what_is_not_finite(ax):
    curve = Curve("execution", np.arange(4.0), np.array([0.2, np.inf, np.nan, 3.0]), is_faulty=True)
    plot_test_ratios(ax, [curve], onset=1.5)
    lines = labelled(ax)
    np.testing.assert_array_equal(lines["execution"].get_ydata(), [0.2, np.nan, np.nan, 3.0])
    assert list(lines["threshold"].get_ydata()) == [1, 1]
    assert list(lines["onset"].get_xdata()) == [1.5, 1.5]
    assert (lines["execution"].get_linestyle(), lines["threshold"].get_linestyle()) == ("--", ":")


def test_log_likelihoods_have_a_threshold_where_the_rule_goes_by_it(ax, judged):
    plot_log_likelihoods(ax, [Curve("execution", judged.recording.times, judged.statistic)], judged.level)
    lines = labelled(ax)
    np.testing.assert_array_equal(lines["execution"].get_ydata(), judged.statistic)
    assert ("threshold" in lines) == (judged.level is not None)
    if judged.level is not None:
        assert list(lines["threshold"].get_ydata()) == [judged.level] * 2
        assert judged.verdict.failed == bool(np.any(judged.statistic < judged.level))
    assert "onset" not in lines
    assert ax.get_ylabel() == "Log-likelihood per step [nats]"


def test_judged_executions_are_those_of_the_detector(judged):
    above = np.flatnonzero(judged.test_ratios > 1)
    assert judged.verdict.failed == bool(len(above))
    if len(above):
        assert judged.verdict.step == above[0]


def test_the_alarm_stands_on_the_execution(ax, planned, judged):
    plot_monitored_position(ax, planned, judged, 0, onset=0.3)
    lines = labelled(ax)
    np.testing.assert_array_equal(lines["execution"].get_ydata(), judged.recording.positions[:, 0])
    assert ("alarm" in lines) == judged.verdict.failed
    if judged.verdict.failed:
        assert list(lines["alarm"].get_xdata()) == [judged.verdict.time]
        assert list(lines["alarm"].get_ydata()) == [judged.recording.positions[judged.verdict.step, 0]]


def test_operating_curves(ax, evaluation):
    judge = evaluation.record().judges[0]
    plot_operating_curve(ax, judge.operating, judge.summary)
    lines = labelled(ax)
    for fault, shares in judge.operating.detected.items():
        np.testing.assert_allclose(lines[fault].get_xdata(), 100 * np.array(judge.operating.false_alarms))
        np.testing.assert_allclose(lines[fault].get_ydata(), 100 * np.array(shares))
    assert "jitter" not in lines
    crosses = [line for line in ax.lines if line.get_marker() == "X"]
    np.testing.assert_allclose([c.get_xdata()[0] for c in crosses], 100 * judge.summary.false_alarms.rate)
    ax.clear()
    plot_soon_enough(ax, judge.operating, "hold")
    assert list(labelled(ax)) == ["α = 1 %", "α = 2 %", "α = 5 %", "α = 10 %"]
    np.testing.assert_allclose(ax.lines[2].get_ydata(), 100 * np.array(judge.operating.promptness[2].detected["hold"]))


def test_detection_by_onset_and_latency(ax, evaluation):
    summary = evaluation.summaries()["calibrated"]
    plot_by_onset(ax, summary)
    bins = summary.faults["hold"].by_onset
    expected = [100 * one.detected / one.n if one.n else np.nan for one in bins]
    np.testing.assert_allclose(labelled(ax)["hold"].get_ydata(), expected)
    np.testing.assert_allclose(labelled(ax)["hold"].get_xdata(), [35, 45, 55, 65], atol=2)
    ax.clear()
    plot_latencies(ax, summary)
    assert next(text.get_text() for text in ax.get_yticklabels()) == "hold"
    assert 100 * summary.faults["hold"].latency_median in [line.get_xdata()[0] for line in ax.lines]
