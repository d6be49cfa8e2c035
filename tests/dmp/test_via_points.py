"""Via-points: dense conditioning of the path, and what cannot be."""

from dataclasses import replace

import numpy as np
import pytest

from probdmp import ProbabilisticDMP, load, synthetic_letters
from probdmp.dmp import path_distribution
from probdmp.errors import InputError, InputTypeError

NAN = np.nan


@pytest.fixture(scope="module")
def learned():
    demos = synthetic_letters(6, letters="s", dt=0.02)
    p = ProbabilisticDMP(12, weight_model="hierarchical", weight_uncertainty="joint").fit(demos)
    steps = round(p.primitive_.duration / 0.02)  # so that times fall on steps
    p.primitive_ = replace(p.primitive_, duration=steps * 0.02, dt=0.02, phase_step=1 / steps)
    return p


def test_conditioning_is_that_of_the_dense_path(learned):
    p = learned.primitive_
    m = round(p.duration / p.dt) + 1
    mean, covariance = path_distribution(p, m)
    stds = np.sqrt(np.einsum("mdmd->md", covariance))
    points = [
        (10 * p.dt, [NAN, p.start[1] + mean[10, 1] + 2 * stds[10, 1]], 0.3),
        (30 * p.dt, p.start + mean[30] - stds[30], [0.1, 0.5]),
    ]
    rows = [(10, 1), (30, 0), (30, 1)]
    values = np.array([2 * stds[10, 1], -stds[30, 0], -stds[30, 1]])
    full = covariance.reshape(2 * m, 2 * m)
    flat = [2 * t + d for t, d in rows]
    S = full[np.ix_(flat, flat)] + np.diag([0.09, 0.01, 0.25])
    gain = full[:, flat] @ np.linalg.inv(S)
    got = path_distribution(learned.condition(points).primitive_, m)
    np.testing.assert_allclose(got.means, mean + (gain @ values).reshape(m, 2), atol=1e-6 * stds.max())
    np.testing.assert_allclose(got.covariance.reshape(2 * m, 2 * m), full - gain @ full[flat], atol=1e-6 * stds.max() ** 2)


def test_the_movement_passes_through_and_leaves_the_rest_alone(learned):
    p = learned.primitive_
    before = learned.rollout()
    target = before.positions[20] + 2 * before.position_stds[20]
    other = learned.condition([(before.times[20], target, 0.05)])
    after = other.rollout()
    assert type(other) is ProbabilisticDMP
    assert other.get_params() == learned.get_params()
    assert np.all(np.abs(after.positions[20] - target) < 0.05)
    assert np.all(after.position_stds[20] < 0.06)
    assert np.all(after.position_stds <= before.position_stds * (1 + 1e-6))
    assert (
        np.abs(after.positions[20] - before.positions[20]).max() > 10 * np.abs(after.positions[0] - before.positions[0]).max()
    )
    assert other.primitive_.identity != p.identity


def test_one_after_the_other_is_all_at_once_and_survives_a_file(learned, tmp_path):
    p = learned.primitive_
    points = [(0.3, p.start + 1.0, 0.5), (0.413, [NAN, p.start[1]], 0.5)]
    once, twice = learned.condition(points), learned.condition(points[:1]).condition(points[1:])
    for a, b in zip(path_distribution(once.primitive_, 30), path_distribution(twice.primitive_, 30), strict=True):
        np.testing.assert_allclose(a, b, atol=1e-6 * np.abs(a).max())
    once.save(tmp_path / "m.probdmp")
    again = load(tmp_path / "m.probdmp")
    assert again.primitive_.identity == once.primitive_.identity
    np.testing.assert_array_equal(again.rollout().means, once.rollout().means)


def test_nothing_is_no_condition(learned):
    for points in ([], [(0.3, [NAN, NAN], 1.0)]):
        same = learned.condition(points).primitive_
        np.testing.assert_allclose(
            path_distribution(same, 30).means, path_distribution(learned.primitive_, 30).means, atol=1e-9
        )


@pytest.mark.parametrize(
    ("points", "error", "match"),
    [
        ([(0.0, [0, 0], 1.0)], InputError, r"Expected 0 < time <= .* s of a via-point, got 0\. It counts from the start"),
        ([(99.0, [0, 0], 1.0)], InputError, "0 < time"),
        ([(NAN, [0, 0], 1.0)], InputError, "0 < time"),
        ([("x", [0, 0], 1.0)], InputTypeError, "time of a via-point"),
        ([(0.3, [0, 0, 0], 1.0)], InputError, "position of a via-point"),
        ([(0.3, [0, np.inf], 1.0)], InputError, "position of a via-point"),
        ([(0.3, [0, 0], 0.0)], InputError, "std > 0"),
        ([(0.3, [0, 0], [1, 1, 1])], InputError, "std of a via-point"),
        ([(0.3, [0, 0])], InputTypeError, r"a list of \(time, position, std\)"),
        (3, InputTypeError, r"a list of \(time, position, std\)"),
    ],
)
def test_points_that_are_none(learned, points, error, match):
    with pytest.raises(error, match=match):
        learned.condition(points)


def test_independent_weights_cannot_be_conditioned():
    p = ProbabilisticDMP(8, weight_model="pooled", weight_uncertainty="independent")
    p.fit(synthetic_letters(2, letters="s", dt=0.02))
    with pytest.raises(
        InputError, match=r'weight_uncertainty="joint" to condition a movement, got "independent"\. Learn it with'
    ):
        p.condition([(0.3, [0, 0], 1.0)])
