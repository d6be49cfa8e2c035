"""The compiled kernels and their NumPy twins: the same numbers, whatever the systems, and the same refusals.

The twin is the plain statement of what is computed; where there is no extension these laws cannot be asked and are skipped.
"""

import os
import subprocess
import sys
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from probdmp.gaussian import LinearGaussianModel, _kernels_numpy, kernels, shared_gains

needs_extension = pytest.mark.skipif(not kernels.COMPILED, reason="probdmp.gaussian._kernels was not built, or is not wanted")

# What nobody decides in a hurry: times from none to 2000, systems from 1 to 30, noise over ten orders of magnitude.
seeds = st.integers(0, 2**32 - 1)
magnitudes = st.sampled_from([1e-10, 1e-6, 1e-2, 1.0, 1e2])


@dataclass
class Case:
    """M systems of n states over T times."""

    transition: np.ndarray
    input_vector: np.ndarray
    drifts: np.ndarray
    input_variances: np.ndarray
    sensor: np.ndarray
    noise: np.ndarray
    initial_mean: np.ndarray
    initial_covariance: np.ndarray
    observations: np.ndarray

    def arguments(self):
        return tuple(vars(self).values())


@st.composite
def cases(draw, longest=60):
    rng = np.random.default_rng(draw(seeds))
    t, m, n = draw(st.integers(1, longest)), draw(st.integers(1, 30)), draw(st.integers(1, kernels.MOST_STATES))
    q, r, missing = draw(magnitudes), draw(magnitudes), draw(st.sampled_from([0.0, 0.0, 0.1, 0.7, 1.0]))
    transition = rng.normal(size=(m, n, n))
    transition *= 0.95 / np.linalg.norm(transition, axis=(1, 2), keepdims=True)  # it must not explode in 2000 steps
    root = rng.normal(size=(m, n, n))
    observations = rng.normal(size=(t, m))
    observations[rng.random((t, m)) < missing] = np.nan
    return Case(
        transition,
        rng.normal(size=(m, n)),
        rng.normal(size=(t - 1, m, n)),
        q * rng.random((t - 1, m)),
        rng.normal(size=(m, n)),
        r * (0.5 + rng.random(m)),
        rng.normal(size=(m, n)),
        draw(st.sampled_from([0.0, 1.0])) * root @ root.mT,
        observations,
    )


def filtered(module, case):
    t, (m, n) = len(case.observations), case.sensor.shape
    found = [np.full(shape, -7.0) for shape in ((t, m, n), (t, m, n, n), (t, m), (t, m), (t, m), (t, m, n))]
    module.filter_systems(*case.arguments(), *found)
    return found


def assert_same(first, second, tolerance=1e-12):
    """To 1e-12 of how large the numbers are, NaN where NaN."""
    np.testing.assert_array_equal(np.isnan(first), np.isnan(second))
    size = max(1.0, float(np.nanmax(np.abs(second), initial=0.0)))
    np.testing.assert_allclose(first, second, rtol=tolerance, atol=tolerance * size)


def assert_filtered_alike(case):
    """An update by a sensor k times as precise as what is known before loses a factor of k to rounding, in whatever order."""
    compiled, plain = filtered(_compiled(), case), filtered(_kernels_numpy, case)
    k = float(np.max(plain[3] / case.noise))
    for ours, theirs in zip(compiled, plain, strict=True):
        assert_same(ours, theirs, max(1e-12, 1e-14 * k))


@needs_extension
@given(cases())
def test_systems_are_filtered_alike(case):
    assert_filtered_alike(case)


@needs_extension
@pytest.mark.slow
@given(cases(longest=2000))
@settings(max_examples=60, suppress_health_check=[HealthCheck.too_slow])
def test_long_systems_are_filtered_alike(case):
    assert_filtered_alike(case)


@needs_extension
@pytest.mark.parametrize("n_steps", [1, 2, 2000])
def test_shortest_and_longest_are_filtered_alike(n_steps):
    rng = np.random.default_rng(n_steps)
    case = Case(
        np.tile([[0.0, -25.0, -156.0], [0.0, 0.875, -0.78], [0.0, 0.0044, 0.9961]], (30, 1, 1)),
        np.tile([1.0, 0.005, 0.000025], (30, 1)),
        rng.normal(size=(n_steps - 1, 30, 3)),
        10.0 ** rng.uniform(-12, 2, (n_steps - 1, 30)),
        np.tile([0.0, 0.0, 1.0], (30, 1)),
        10.0 ** rng.uniform(-12, 2, 30),
        np.zeros((30, 3)),
        np.zeros((30, 3, 3)),
        np.where(rng.random((n_steps, 30)) < 0.05, np.nan, rng.normal(size=(n_steps, 30))),
    )
    assert_filtered_alike(case)


@st.composite
def ticks(draw):
    """System, inputs, observation and record of D degrees of freedom, as `PreparedSteps` takes them."""
    rng = np.random.default_rng(draw(seeds))
    d, n = draw(st.integers(1, 30)), draw(st.integers(1, kernels.MOST_STATES))
    width = -(-d // kernels.LANE) * kernels.LANE
    system, inputs = rng.normal(size=(n * n + 2 * n + 1, width)), rng.normal(size=(n + 1, width))
    system[-1], inputs[-1] = draw(magnitudes) * (1 + rng.random(width)), draw(magnitudes) * rng.random(width)
    before = rng.normal(size=(n + n * n + 3, width))
    root = rng.normal(size=(width, n, n))
    before[n : n + n * n] = (root @ root.mT).reshape(width, -1).T
    observation = rng.normal(size=d)
    observation[rng.random(d) < draw(st.sampled_from([0.0, 0.3, 1.0]))] = np.nan
    return system, inputs[None], observation, before


@needs_extension
@given(ticks())
def test_a_tick_is_the_same(arguments):
    system, inputs, observation, before = arguments
    d = len(observation)
    (*told, likelihood, after), (*expected, likelihood_expected, after_expected) = (
        module.PreparedSteps(system, inputs, d).take(observation, before.tobytes(), 0)
        for module in (_compiled(), _kernels_numpy)
    )
    assert told == expected == [int(np.sum(~np.isnan(observation))), d]
    assert_same(np.array(likelihood), np.array(likelihood_expected))
    records = [np.frombuffer(record).reshape(before.shape)[:, :d] for record in (after, after_expected)]
    for ours, plain in zip(*records, strict=True):
        assert_same(ours, plain)


@pytest.mark.parametrize("module", ["compiled", "plain"])
@pytest.mark.parametrize(
    "given",
    [
        *(np.array([0.0, value]) for value in (np.inf, -np.inf, 1e101)),
        np.zeros(3),
        np.zeros((2, 1)),
        np.zeros(2, dtype=np.float32),
        np.zeros(2, dtype=">f8"),
        np.zeros(2, dtype="datetime64[s]"),
        np.zeros(4)[::2],
        np.ma.masked_array([0.0, 1.0], [True, False]),
        [0.0, 0.0],
        b"0123456789abcdef",
        None,
    ],
)
def test_what_is_no_observation_is_not_taken(module, given):
    if module == "compiled" and not kernels.COMPILED:
        pytest.skip("probdmp.gaussian._kernels was not built, or is not wanted")
    chosen = _compiled() if module == "compiled" else _kernels_numpy
    n, width = 3, kernels.LANE
    prepared = chosen.PreparedSteps(np.ones((n * n + 2 * n + 1, width)), np.ones((2, n + 1, width)), 2)
    record = np.ones((n + n * n + 3, width)).tobytes()
    assert prepared.take(given, record, 1) is None
    assert prepared.take(np.zeros(2), record, 1) is not None


@needs_extension
def test_steps_that_were_not_prepared_are_refused():
    n, width = 3, kernels.LANE
    system, inputs = np.ones((n * n + 2 * n + 1, width)), np.ones((2, n + 1, width))
    record, reading = np.ones((n + n * n + 3, width)).tobytes(), np.zeros(2)
    made = _compiled().PreparedSteps
    for arguments in (
        (system, inputs, 0),
        (system, inputs, 9),
        (system[1:], inputs, 2),
        (inputs, system, 2),
        (system[:, :7], inputs, 2),
    ):
        with pytest.raises(ValueError, match=r"expected|contiguous"):
            made(*arguments)
    for arguments in ((), (system, inputs), (system, None, 2), (system, inputs, 2.5)):
        with pytest.raises(TypeError):
            made(*arguments)
    with pytest.raises(TypeError, match="without names"):
        made(system, inputs, 2, n=3)
    prepared = made(system, inputs, 2)
    for arguments in ((reading, record, 2), (reading, record, -1), (reading, record[:-8], 0), (reading, bytearray(record), 0)):
        with pytest.raises(ValueError, match="expected"):
            prepared.take(*arguments)
    for arguments in ((), (reading, record), (reading, record, "0")):
        with pytest.raises(TypeError):
            prepared.take(*arguments)


@st.composite
def series(draw):
    """Closed loop, feedback, sensor, precisions, observations and paths of N series, as the kernels take them."""
    rng = np.random.default_rng(draw(seeds))
    n_series, t = draw(st.integers(0, 20)), draw(st.integers(1, 80) | st.sampled_from([129, 2000]))
    d, n = draw(st.integers(1, 30)), draw(st.integers(1, kernels.MOST_STATES))
    closed = rng.normal(size=(t, d, n, n))
    closed *= 0.9 / np.linalg.norm(closed, axis=(2, 3), keepdims=True)
    observations = rng.normal(size=(n_series, t, d))
    if draw(st.booleans()):
        observations[rng.random((n_series, t, d)) < 0.01] = np.nan
    paths = rng.normal(size=(draw(st.sampled_from([1, n_series])) if n_series else 1, t, d))
    precisions = draw(magnitudes) * (1 + rng.random((t, d)))
    return closed, rng.normal(size=(t, d, n)), rng.normal(size=(d, n)), precisions, observations, paths


@needs_extension
@given(series())
def test_innovations_are_squared_alike(arguments):
    observations = arguments[4]
    ours, plain = np.empty((2, len(observations), observations.shape[2]))
    _compiled().squared_innovations(*arguments, ours)
    _kernels_numpy.squared_innovations(*arguments, plain)
    assert_same(ours, plain)


@needs_extension
@given(series(), seeds)
def test_series_are_smoothed_alike(arguments, seed):
    closed, observations = arguments[0], np.nan_to_num(arguments[4])
    arguments = (*arguments[:4], observations, arguments[5])
    t, d, n = closed.shape[:3]
    rng = np.random.default_rng(seed)
    covariances, states = rng.normal(size=(t, d, n, n)), rng.normal(size=(t, d, n))
    ours, plain = np.empty((2, len(observations), t, d, n))
    _compiled().smoothed_states(*arguments, covariances, states, ours)
    _kernels_numpy.smoothed_states(*arguments, covariances, states, plain)
    assert_same(ours, plain)


@needs_extension
@pytest.mark.parametrize("n_dof", [1, 7, 30])
@pytest.mark.parametrize("n_times", [1, 31, 32, 33, 65, 2000])
def test_shortest_and_longest_series_of_movements_are_alike(n_times, n_dof):
    """Sensors and motions from very precise to very coarse; nine series, one more than the compiled kernels take at once."""
    rng = np.random.default_rng(n_times)
    model = LinearGaussianModel(
        np.array([[0.0, -25.0, -156.0], [0.0, 0.875, -0.78], [0.0, 0.0044, 0.9961]]),
        np.array([[1.0], [0.005], [0.000025]]),
        rng.normal(size=(n_times - 1, n_dof, 1)),
        10.0 ** rng.uniform(-8, 4, (n_times - 1, n_dof, 1, 1)),
        np.array([[0.0, 0.0, 1.0]]),
        10.0 ** rng.uniform(-12, 2, (n_dof, 1, 1)),
        np.zeros((n_dof, 3)),
        np.zeros((n_dof, 3, 3)),
    )
    gains = shared_gains(model)
    observations = gains.path + rng.normal(size=(9, n_times, n_dof))
    observations[4, n_times // 2, 0] = np.nan
    squares = np.empty((2, 9, n_dof))
    for module, own in zip((_compiled(), _kernels_numpy), squares, strict=True):
        module.squared_innovations(*gains.recursion, observations, gains.path[None], own)
    assert np.isnan(squares[:, 4, 0]).all()
    np.testing.assert_allclose(*squares, rtol=1e-12)
    shared = gains.closed_loop, gains.feedback, gains.systems.sensor, gains.precisions
    complete, smoothed = np.nan_to_num(observations), np.empty((2, 9, n_times, n_dof, 3))
    for module, own in zip((_compiled(), _kernels_numpy), smoothed, strict=True):
        module.smoothed_states(*shared, complete, gains.path[None], gains.predicted_covariances, gains.path_states, own)
    k = np.max(1 / (gains.precisions * gains.systems.noise), axis=0)  # see assert_filtered_alike
    difference = np.abs(smoothed[0] - smoothed[1]).max(axis=(0, 1))
    assert np.all(difference <= np.maximum(1e-12, 1e-14 * k[:, None]) * np.abs(smoothed[1]).max(axis=(0, 1)))


@st.composite
def windows(draw):
    """Values, rows, maps, which, ends, reach and wanted, as the kernels take them."""
    rng = np.random.default_rng(draw(seeds))
    n, n_values, n_places, n_mapped, n_maps = (draw(st.integers(1, most)) for most in (40, 30, 12, 12, 20))
    n_outputs, n_accounts, n_inputs = (draw(st.integers(1, most)) for most in (9, 5, 12))
    ends = np.unique(rng.integers(1, n_outputs + 1, draw(st.integers(1, 4))))
    wanted = np.sort(rng.integers(0, n_places + 1, len(ends)))[::-1].copy()
    reach = np.maximum.accumulate(rng.integers(1, n_inputs + 1, n_outputs))
    maps = rng.normal(size=(n_maps, n_outputs, n_inputs)) * (np.arange(n_inputs) < reach[:, None])
    rows, which = rng.integers(0, n_values, (n_places, n_inputs)), rng.integers(0, n_maps, (n_mapped, n_accounts))
    return rng.normal(size=(n_values, n)), rows, maps, which, ends, reach, wanted


def leave_nan_behind():
    """In memory that is free then: what a kernel asks for to work in holds whatever was there before."""
    del [np.full(size, np.nan) for size in range(128, 1024, 64)][:]


def squares_one_by_one(values, rows, maps, which, ends, wanted):
    """(wanted, A, n) arrays, each window by itself."""
    mapped = [maps[which[min(place, len(which) - 1)]] for place in range(len(rows))]
    found = []
    for end, count in zip(ends, wanted, strict=True):
        some = [np.sum((mapped[place][:, :end] @ values[rows[place]]) ** 2, axis=1) for place in range(count)]
        found.append(np.array(some).reshape(count, which.shape[1], values.shape[1]))
    return found


@given(windows(), seeds)
def test_least_squares_of_windows_are_those_of_each_by_itself(arguments, seed):
    values, rows, maps, which, ends, _, wanted = arguments
    penalties = np.random.default_rng(seed).exponential(size=which.shape[1])
    squares = squares_one_by_one(values, rows, maps, which, ends, wanted)
    expected = np.concatenate([(some + penalties[:, None]).min(axis=1).ravel() for some in squares])
    for module in {_kernels_numpy, _compiled() if kernels.COMPILED else _kernels_numpy}:
        found = np.full(len(expected), -7.0)
        leave_nan_behind()
        module.least_squares(*arguments, penalties, found)
        assert_same(found, expected)


def mixtures_one_by_one(arguments, scales, n_halves):
    """J arrays (wanted, n): ln sum_a (scale_a (1 + square_a / 4))^-(n_halves / 2)."""
    values, rows, maps, which, ends, _, wanted = arguments
    mixtures = []
    for j, squares in enumerate(squares_one_by_one(values, rows, maps, which, ends, wanted)):
        own = scales[np.minimum(np.arange(len(squares)), len(scales) - 1), j]
        bases = np.log(own)[..., None] + np.log1p(squares / 4)
        mixtures.append(np.logaddexp.reduce(-n_halves[j] / 2 * bases, axis=1))
    return mixtures


def random_floors(rng, shape, *further):
    """Of some all is wanted, of others nothing, or what is larger than they are."""
    return rng.choice([-np.inf, 0.0, 1.0, np.inf, *further], shape)


def above_floors(found, floors, limit):
    """What of (places, n) is above floors (n,) that rise to it from place to place up to a limit, and what they are then."""
    left, risen = np.full_like(found, -np.inf), floors.copy()
    for place, execution in np.ndindex(*found.shape):
        if found[place, execution] > risen[execution]:
            left[place, execution] = found[place, execution]
            risen[execution] = max(risen[execution], min(found[place, execution], limit))
    return left, risen


@st.composite
def windows_of_points(draw):
    """The same, where windows are points of D numbers and have as many outputs; and D."""
    values, rows, maps, which, ends, reach, wanted = draw(windows())
    d, rng = draw(st.integers(1, 3)), np.random.default_rng(draw(seeds))
    if len(ends) < 3:
        ends, wanted = np.array([1, 2, 3]), np.append(np.resize(wanted, 2), wanted[-1])
        maps = np.resize(maps, (len(maps), max(maps.shape[1], 3), maps.shape[2]))
    n_outputs = maps.shape[1] * d
    n_inputs = n_outputs + draw(st.integers(0, 3))
    reach = np.maximum.accumulate(rng.integers(1, n_inputs + 1, n_outputs))
    maps = rng.normal(size=(len(maps), n_outputs, n_inputs)) * (np.arange(n_inputs) < reach[:, None])
    rows = rng.integers(0, len(values), (len(rows), n_inputs))
    return (values, rows, maps, which, ends * d, reach, wanted), d


@given(
    windows_of_points(), seeds, st.integers(1, 40), st.sampled_from([0.0, -30.0, 30.0, 3.0]), st.sampled_from([0.3, 3.0, 1e3])
)
def test_evidence_for_rest_is_a_difference_of_densities_where_it_is_above_its_floor(some, seed, most_halves, constant, std):
    arguments, d = some
    values, rows, _, which, ends, _, wanted = arguments
    rng, first = np.random.default_rng(seed), rows.shape[1] - arguments[2].shape[1]
    scales = np.exp(0.1 * rng.normal(size=(len(which), len(ends), which.shape[1])))
    n_halves, constants = rng.integers(1, most_halves + 1, len(ends)), constant + rng.normal(size=len(ends) - 2)
    stds, floors = std * (1 + rng.random(d)), random_floors(rng, (len(constants), values.shape[1]), constant)
    limits = random_floors(rng, len(constants), constant)
    _, here, *together = mixtures_one_by_one(arguments, scales, n_halves)
    expected, risen = [], []
    for mixed, c, floor, limit, end in zip(together, constants, floors, limits, ends[2:], strict=True):
        points = values[rows[: len(mixed), first + ends[1] - d : first + end]]
        points = points.reshape(len(mixed), 1 + (end - ends[1]) // d, d, values.shape[1])
        moved = (points[:, 1:] - points[:, :1]) / stds[:, None]
        inverse = np.linalg.inv(np.ones((moved.shape[1], moved.shape[1])) + np.eye(moved.shape[1]))
        squares = np.einsum("gpdn,pq,gqdn->gn", moved, inverse, moved)
        evidence = c - squares / 2 - mixed + here[: len(mixed)]
        left, raised = above_floors(evidence, floor, limit)
        expected.append(left.ravel())
        risen.append(raised)
    for module in {_kernels_numpy, _compiled() if kernels.COMPILED else _kernels_numpy}:
        found, central = np.full(int(wanted[2:].sum()) * values.shape[1], -7.0), int(rng.integers(which.shape[1]))
        own = floors.copy()
        leave_nan_behind()
        module.window_evidence(*arguments, scales, n_halves, stds, constants, own, limits, found, 4.0, central)
        np.testing.assert_allclose(found, np.concatenate(expected), rtol=1e-12, atol=1e-11)
        np.testing.assert_allclose(own, risen, rtol=1e-12, atol=1e-11)


@given(windows(), seeds, st.integers(1, 40), st.sampled_from([1.0, 1e6, 1e-6]))
def test_ratios_of_mixtures_are_those_of_sums_of_densities_where_they_are_above_their_floor(
    arguments, seed, most_halves, scale
):
    values, rows, maps, which, ends, reach, wanted = arguments
    rng, n_others = np.random.default_rng(seed), int(np.random.default_rng(seed).integers(1, 4))
    wanted = np.full_like(wanted, wanted[0])
    others = rng.normal(size=maps.shape) * (np.arange(maps.shape[2]) < reach[:, None])
    other_which = rng.integers(0, len(maps), (len(which), n_others))
    scales, other_scales = (scale * np.exp(rng.normal(size=(len(which), len(ends), k))) for k in (which.shape[1], n_others))
    n_halves, floors = rng.integers(1, most_halves + 1, len(ends)), random_floors(rng, values.shape[1], -3.0)
    limits = random_floors(rng, 1, -3.0)
    own, other = (values, rows, maps, which, ends, reach, wanted), (values, rows, others, other_which, ends, reach, wanted)
    ratios = mixtures_one_by_one(other, other_scales, n_halves)[-1] - mixtures_one_by_one(own, scales, n_halves)[-1]
    expected, risen = above_floors(ratios, floors, limits[0])
    contrary = (others, other_which, reach, other_scales)
    for module in {_kernels_numpy, _compiled() if kernels.COMPILED else _kernels_numpy}:
        found, central, raised = np.full(expected.size, -7.0), int(rng.integers(which.shape[1])), floors.copy()
        leave_nan_behind()
        module.window_ratios(*own, scales, n_halves, *contrary, raised, limits, found, 4.0, central)
        np.testing.assert_allclose(found, expected.ravel(), rtol=1e-12, atol=1e-11)
        np.testing.assert_allclose(raised, risen, rtol=1e-12, atol=1e-11)


@given(windows(), seeds)
def test_sums_of_one_window_are_those_of_its_outputs(arguments, seed):
    values, rows, maps, which, ends, reach, _ = arguments
    ends = np.append(np.random.default_rng(seed).integers(0, ends[0]), ends)
    window, reached = values[rows[0], 0], int(reach[ends[-1] - 1])
    squares = (maps[which[0]] @ window) ** 2
    expected = [squares[:, begin:end].sum(axis=1) for begin, end in pairwise(ends)]
    for module in {_kernels_numpy, _compiled() if kernels.COMPILED else _kernels_numpy}:
        sums = np.full((len(ends) - 1, which.shape[1]), -7.0)
        module.window_sums(maps, which[0], reach, window[:reached].copy(), ends, sums)
        assert_same(sums, np.array(expected))


@needs_extension
@pytest.mark.parametrize(
    ("position", "wrong"),
    [
        (1, np.array([0, 2])),
        (1, np.array([-1, 0])),
        (2, np.array([1, 3])),
        (2, np.array([-1, 2])),
        (2, np.array([1, 2, 2])),
        (3, np.ones(1)),
        (3, np.ones(3)),
        (4, np.array([0, 3])),
        (4, np.array([-1, 2])),
        (4, np.array([1, 1])),
        (4, np.zeros(0, dtype=np.int64)),
        (5, np.zeros((1, 3))),
        (5, np.zeros((2, 2))),
    ],
)
def test_windows_that_do_not_fit_their_maps_are_refused(position, wrong):
    arguments = [np.ones((2, 2, 2)), np.array([0, 1]), np.array([1, 2]), np.ones(2), np.array([0, 2]), np.zeros((1, 2))]
    _compiled().window_sums(*arguments)
    arguments[position] = wrong
    with pytest.raises(ValueError, match=r"expected|belong together"):
        _compiled().window_sums(*arguments)


@needs_extension
@pytest.mark.parametrize("central", [-1, 1])
def test_an_account_that_is_not_there_is_refused(central):
    one = np.ones(3, dtype=np.int64)
    rows, which = np.zeros((1, 3), dtype=np.int64), np.zeros((1, 1), dtype=np.int64)
    maps, scales, stds = np.ones((1, 3, 3)), np.ones((1, 3, 1)), np.ones(1)
    arguments = np.ones((1, 3)), rows, maps, which, np.array([1, 2, 3]), one, one, scales, one
    contrary, found = (maps, which, one, scales, np.zeros(3), stds), np.zeros(3)
    _compiled().window_evidence(*arguments, stds, stds, np.zeros((1, 3)), stds, found, 4.0, 0)
    _compiled().window_ratios(*arguments, *contrary, found, 4.0, 0)
    with pytest.raises(ValueError, match="one of 1 accounts"):
        _compiled().window_evidence(*arguments, stds, stds, np.zeros((1, 3)), stds, found, 4.0, central)
    with pytest.raises(ValueError, match="one of 1 accounts"):
        _compiled().window_ratios(*arguments, *contrary, found, 4.0, central)


@needs_extension
def test_ratios_are_written_where_they_are_wanted_and_nowhere_else():
    ends, wanted, one = np.array([1, 2]), np.array([6, 1]), np.ones(2, dtype=np.int64)
    rows, which, maps, scales = (
        np.zeros((6, 2), dtype=np.int64),
        np.zeros((1, 1), dtype=np.int64),
        np.ones((1, 2, 2)),
        np.ones((1, 2, 1)),
    )
    found = np.full(9, -7.0)
    arguments = np.ones((1, 3)), rows, maps, which, ends, one, wanted, scales, one
    _compiled().window_ratios(*arguments, maps, which, one, scales, np.full(3, -np.inf), np.ones(1), found[:3], 4.0, 0)
    assert np.all(found[:3] == 0)
    assert np.all(found[3:] == -7)
    nothing = np.zeros(0, dtype=np.int64)
    arguments = np.ones((1, 3)), rows, maps, which, nothing, one, nothing, np.ones((1, 0, 1)), nothing
    nowhere = maps, which, one, np.ones((1, 0, 1)), np.zeros(3), np.ones(1), np.zeros(0)
    with pytest.raises(ValueError, match="do not belong together"):
        _compiled().window_ratios(*arguments, *nowhere, 4.0, 0)


@needs_extension
def test_series_of_no_degree_of_freedom_are_refused():
    shapes = (5, 0, 2, 2), (5, 0, 2), (0, 2), (5, 0), (3, 5, 0), (1, 5, 0), (3, 0)
    with pytest.raises(ValueError, match="at least one degree of freedom"):
        _compiled().squared_innovations(*(np.ones(shape) for shape in shapes))


@needs_extension
@pytest.mark.parametrize("fault", ["stds", "no stds", "ends", "inputs", "constants", "floors", "limits"])
def test_rest_that_does_not_belong_to_windows_is_refused(fault):
    values, maps = np.ones((5, 3)), np.ones((2, 4, 5))
    rows, which, ends, reach, wanted = (
        np.zeros((6, 5), dtype=np.int64),
        np.array([[0], [1]]),
        np.array([1, 2, 4]),
        *np.ones((2, 4), int),
    )
    wanted, stds, constants, floors, limits = wanted[:3], np.ones(2), np.ones(1), np.zeros((1, 3)), np.ones(1)

    def weigh():
        scales, n_halves = np.ones((2, 3, 1)), np.ones(3, dtype=np.int64)
        arguments = values, rows, maps, which, ends, reach, wanted, scales, n_halves
        _compiled().window_evidence(*arguments, stds, constants, floors, limits, np.empty(3), 4.0, 0)

    weigh()
    match fault:
        case "stds":
            stds = np.ones(3)
        case "no stds":
            stds = np.ones(0)
        case "ends":
            ends = np.array([1, 2, 3])
        case "inputs":
            rows, maps = rows[:, :3].copy(), maps[..., :3].copy()
        case "constants":
            constants = np.ones(2)
        case "floors":
            floors = np.zeros((1, 2))
        case "limits":
            limits = np.ones(2)
    with pytest.raises(ValueError, match=r"stds|constants|floors|limits"):
        weigh()


def both_modules():
    return {_kernels_numpy, _compiled() if kernels.COMPILED else _kernels_numpy}


@given(st.integers(1, 40), st.integers(0, 19), seeds, st.sampled_from([1.0, 1e-9, 1e9]))
def test_residuals_of_small_gaussians_are_whitened_as_by_their_cholesky_factors(size, count, seed, scale):
    """Each of them a path of one point."""
    rng = np.random.default_rng(seed)
    factors = np.tril(rng.normal(size=(count, size, size)), -1) * 0.3 / np.sqrt(size) + np.eye(size)
    factors *= scale * np.exp(rng.normal(size=(count, size, 1)))
    white = rng.normal(size=(count, 1, 1, size))
    residuals = np.matmul(factors[:, None, None], white[..., None])[..., 0]
    nowhere, certain = np.zeros((count, 1, 1), dtype=np.int64), np.zeros((count, size))
    for module in both_modules():
        found, logarithms = np.full((2, count, 1, 1, size), -7.0)
        leave_nan_behind()
        assert module.whiten(
            np.matmul(factors, factors.mT), certain, nowhere, np.zeros((count, 1, 1)), residuals, found, logarithms
        )
        np.testing.assert_allclose(found, white, rtol=0, atol=1e-12 * (1 + np.abs(white).max(initial=0)))
        diagonals = np.diagonal(factors, axis1=1, axis2=2)
        np.testing.assert_allclose(np.exp(logarithms[:, 0, 0]), diagonals, rtol=1e-12)


@st.composite
def points_on_paths(draw):
    """Covariances, variances, phases, how far aside and residuals of P points of D numbers, by E accounts of K paths."""
    k, e, p, d, m = (draw(st.integers(low, high)) for low, high in ((0, 3), (0, 9), (0, 9), (1, 4), (1, 8)))
    rng, missing = np.random.default_rng(draw(seeds)), draw(st.sampled_from([0.0, 0.2, 1.0]))
    factors = rng.normal(size=(k, m * d, m * d)) / np.sqrt(m * d)
    residuals = rng.normal(size=(k, e, p, d))
    residuals[rng.random(residuals.shape) < missing] = np.nan
    aside = rng.normal(size=(k, e, p)) * draw(st.sampled_from([0.0, 1.0]))
    return np.matmul(factors, factors.mT), 0.1 + rng.random((k, d)), rng.integers(0, m, (k, e, p)), aside, residuals


@given(points_on_paths())
def test_points_of_paths_are_whitened_as_by_the_covariance_of_what_was_seen(case):
    """Points at one phase are measured each by itself; what pushes them aside does so in each direction by itself."""
    covariances, variances, phases, aside, residuals = case
    n_paths, n_accounts, n_points, dof = residuals.shape
    for module in both_modules():
        white, logarithms = np.full((2, *residuals.shape), -7.0)
        leave_nan_behind()
        assert module.whiten(*case, white, logarithms)
        for k, e in np.ndindex(n_paths, n_accounts):
            numbers = (phases[k, e, :, None] * dof + np.arange(dof)).ravel()
            covariance = covariances[k][np.ix_(numbers, numbers)] + np.diag(np.tile(variances[k], n_points))
            covariance += np.kron(np.outer(aside[k, e], aside[k, e]), np.eye(dof))
            seen = ~np.isnan(residuals[k, e].ravel())
            factor = np.linalg.cholesky(covariance[np.ix_(seen, seen)])
            own, heights = white[k, e].ravel(), logarithms[k, e].ravel()
            np.testing.assert_allclose(factor @ own[seen], residuals[k, e].ravel()[seen], rtol=0, atol=1e-11)
            np.testing.assert_allclose(heights[seen], np.log(np.diagonal(factor)), rtol=0, atol=1e-12)
            assert not own[~seen].any()
            assert not heights[~seen].any()


@given(points_on_paths())
def test_points_of_paths_are_whitened_alike_by_both(case):
    found = []
    for module in both_modules():
        white, logarithms = np.empty((2, *case[-1].shape))
        module.whiten(*case, white, logarithms)
        found.append((white, logarithms))
    np.testing.assert_allclose(found[0], found[-1], rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("entry", [0.0, -1.0, np.nan, np.inf])
@pytest.mark.parametrize("which", range(10))
def test_of_what_is_not_positive_definite_is_said_so(which, entry):
    """Unless that was not seen."""
    covariances = np.tile(np.eye(3), (10, 1, 1))
    covariances[which, 1, 1] = entry
    nowhere, aside, certain = np.zeros((10, 1, 1), dtype=np.int64), np.zeros((10, 1, 1)), np.zeros((10, 3))
    residuals = np.ones((10, 1, 1, 3))
    for module in both_modules():
        white, logarithms = np.empty((2, *residuals.shape))
        assert not module.whiten(covariances, certain, nowhere, aside, residuals, white, logarithms)
        unseen = residuals.copy()
        unseen[which, ..., 1] = np.nan
        assert module.whiten(covariances, certain, nowhere, aside, unseen, white, logarithms)


@needs_extension
@pytest.mark.parametrize("fault", range(7))
@pytest.mark.parametrize("axis", range(4))
def test_points_that_do_not_belong_to_paths_are_refused(fault, axis):
    """Two paths of six numbers, three accounts of each, four points of two numbers."""
    shapes = [(2, 6, 6), (2, 2), (2, 3, 4), (2, 3, 4), *[(2, 3, 4, 2)] * 3]
    if axis < len(shapes[fault]):
        shapes[fault] = (*shapes[fault][:axis], 5, *shapes[fault][axis + 1 :])
        arrays = [np.ones(shape, dtype=np.int64 if k == 2 else np.float64) for k, shape in enumerate(shapes)]
        with pytest.raises(ValueError, match="expected"):
            _compiled().whiten(*arrays)


@needs_extension
@pytest.mark.parametrize("phase", [-1, 3, 2**62, -(2**62)])
def test_points_beyond_a_path_are_refused(phase):
    phases, numbers = np.zeros((1, 1, 4), dtype=np.int64), np.ones((3, 1, 1, 4, 2))
    phases[0, 0, 2] = phase
    with pytest.raises(ValueError, match="phases: expected points of paths of 6 numbers"):
        _compiled().whiten(np.ones((1, 6, 6)), np.ones((1, 2)), phases, np.ones((1, 1, 4)), *numbers)


@needs_extension
@pytest.mark.parametrize("shape", [(0, 0, 0, 0), (2**40, 1, 0, 0), (0, 2**40, 1, 2), (1, 2**40, 0, 2)])
def test_of_nothing_nothing_is_whitened(shape):
    k, e, p, d = shape
    paths = np.empty((k, 3 * d, 3 * d)), np.empty((k, d)), np.zeros((k, e, p), dtype=np.int64), np.empty((k, e, p))
    assert _compiled().whiten(*paths, *np.empty((3, *shape)))


@needs_extension
def test_covariances_larger_than_memory_are_refused():
    paths = np.empty((0, 0, 0)), np.empty((0, 2**40)), np.empty((0, 1, 1), dtype=np.int64), np.empty((0, 1, 1))
    with pytest.raises(ValueError, match="residuals: expected few numbers"):
        _compiled().whiten(*paths, *np.empty((3, 0, 1, 1, 2**40)))


@needs_extension
@pytest.mark.parametrize("square", [0.0, 1e-300, 1e-30, 1.0, 2.0, 1e30, 1e280])
def test_logarithms_of_mixtures_are_those_of_the_library(square):
    """Of one account to the power 1: -ln (scale (1 + square / freedom)), over all magnitudes that there are."""
    values = np.full((1, 11), np.sqrt(square))
    one, zero = np.ones(1, dtype=np.int64), np.zeros((1, 1), dtype=np.int64)
    least = float(np.finfo(float).tiny)
    for scale in (least / 8, least, 1e-20, 0.5, 0.7071067811865475, 1.0, 1.4142135623730951, 1e20):
        found = np.empty(11)
        # Compared with one that is zero everywhere: all squares are zero, and the scale is one.
        arguments = values, zero, np.zeros((1, 1, 1)), zero, one, one, one, np.ones((1, 1, 1)), 2 * one
        everything = np.full(11, -np.inf)
        contrary = np.ones((1, 1, 1)), zero, one, np.full((1, 1, 1), scale)
        _compiled().window_ratios(*arguments, *contrary, everything, everything[:1], found, 4.0, 0)
        expected = -np.log(scale + scale / 4 * np.sqrt(square) ** 2)
        np.testing.assert_allclose(found, expected, rtol=1e-15, atol=1e-15)


@needs_extension
@pytest.mark.parametrize("fault", ["rows", "negative rows", "which", "ends", "reach", "falling reach", "wanted", "found"])
def test_windows_that_are_not_there_are_refused(fault):
    values, maps = np.ones((5, 3)), np.ones((2, 4, 2))
    rows, which = np.zeros((6, 2), dtype=np.int64), np.array([[0], [1], [1]])
    ends, reach, wanted = np.array([2, 4]), np.array([1, 1, 2, 2]), np.array([6, 3])
    found = np.empty(9 * 3)
    _compiled().least_squares(values, rows, maps, which, ends, reach, wanted, np.zeros(1), found)
    if fault == "rows":
        rows[3, 1] = 5
    elif fault == "negative rows":
        rows[3, 1] = -1
    elif fault == "which":
        which[1] = 2
    elif fault == "ends":
        ends[1] = 5
    elif fault == "reach":
        reach[3] = 3
    elif fault == "falling reach":
        reach[0] = 2
    elif fault == "wanted":
        wanted[0], found = 7, np.empty(10 * 3)
    else:
        found = np.empty(8 * 3)
    with pytest.raises(ValueError, match="do not belong together"):
        _compiled().least_squares(values, rows, maps, which, ends, reach, wanted, np.zeros(1), found)


@given(st.integers(0, 20), st.integers(1, 9), st.integers(1, 4), seeds)
def test_recordings_are_plain_if_nothing_repeats_or_leaps(n, n_times, n_signals, seed):
    rng = np.random.default_rng(seed)
    values = rng.normal(size=(n, n_times, n_signals)) + 3 * np.arange(n_times)[:, None]
    limits = rng.uniform(1.0, 8.0, n_signals)
    for recording in values[rng.random(n) < 0.5]:
        recording[rng.integers(n_times), rng.integers(n_signals)] = rng.choice([np.nan, np.inf, recording[0, 0], 0.0])
    expected = []
    for recording in values:
        with np.errstate(invalid="ignore"):
            steps = np.diff(recording, axis=0)
            jumps = np.abs(np.diff(steps, axis=0))
        expected.append(
            all(step != 0 for step in steps.ravel())
            and all(jump <= limits[i % n_signals] for i, jump in enumerate(jumps.ravel()))
        )
    for module in {_kernels_numpy, _compiled() if kernels.COMPILED else _kernels_numpy}:
        found = np.full(n, 7)
        module.plain_recordings(values, limits, found)
        assert found.tolist() == expected


@given(st.integers(0, 20), st.integers(1, 9), st.integers(1, 4), st.integers(0, 30), seeds)
def test_points_are_on_the_lines_between_samples(n, n_times, n_signals, n_points, seed):
    rng = np.random.default_rng(seed)
    values, starts, ranges = (
        rng.normal(size=(n, n_times, n_signals)),
        rng.normal(size=(n, n_signals)),
        rng.uniform(0.1, 9, n_signals),
    )
    after, beyond = rng.integers(0, n_times, n_points), rng.random(n_points)
    places = after - np.where(after > 0, beyond, 0)
    plain, points = np.empty((2, n_points, n_signals, n))
    _kernels_numpy.points_on_lines(values, after, beyond, starts, ranges, plain)
    for module in {_kernels_numpy, _compiled() if kernels.COMPILED else _kernels_numpy}:
        module.points_on_lines(values, after, beyond, starts, ranges, points)
        np.testing.assert_array_equal(points, plain)
        for i, recording in enumerate(values):
            for d, column in enumerate(recording.T):
                expected = (np.interp(places, np.arange(n_times), column) - starts[i, d]) / ranges[d]
                np.testing.assert_allclose(points[:, d, i], expected, rtol=0, atol=1e-12)


@needs_extension
@pytest.mark.parametrize("sample", [-1, 3])
def test_samples_that_are_not_there_are_refused(sample):
    arguments = np.ones((2, 3, 1)), np.array([0, sample, 1]), np.zeros(3), np.zeros((2, 1)), np.ones(1), np.empty((3, 1, 2))
    with pytest.raises(ValueError, match="after: expected samples below 3"):
        _compiled().points_on_lines(*arguments)


@needs_extension
@pytest.mark.parametrize("fault", ["dtype", "axes", "shape", "order", "count", "object", "read-only"])
def test_arrays_that_do_not_fit_are_refused(fault):
    t, d, n = 5, 2, 3
    arguments = [
        np.zeros((t, d, n, n)),
        np.zeros((t, d, n)),
        np.zeros((d, n)),
        np.zeros((t, d)),
        np.zeros((4, t, d)),
        np.zeros((1, t, d)),
        np.zeros((4, d)),
    ]
    _compiled().squared_innovations(*arguments)
    if fault == "dtype":
        arguments[4] = arguments[4].astype(np.float32)
    elif fault == "axes":
        arguments[4] = arguments[4][0]
    elif fault == "shape":
        arguments[1] = np.zeros((t + 1, d, n))
    elif fault == "order":
        arguments[4] = np.asfortranarray(arguments[4])
    elif fault == "count":
        arguments.pop()
    elif fault == "object":
        arguments[0] = None
    else:
        arguments[6].flags.writeable = False
    with pytest.raises((TypeError, ValueError, BufferError)):
        _compiled().squared_innovations(*arguments)


@dataclass
class Tick:
    """One tick of groups of states on top of a Gaussian that stands still, G groups of n states, S outputs and W of the z."""

    before: tuple[np.ndarray, ...]
    shape: tuple[int, ...]

    def after(self, module, with_gains=True):
        g, size, n, w, b = self.shape
        q, r = g * size, g * w
        shapes = ((r,), (r, r), (g, n), (g, n, w), (g, n, n), (g, n), (g * n // b, b, b), (q,), (q, q), (q,))
        found = [np.full(shape, -7.0) for shape in shapes]
        fused, gains = np.full(q, -7), [np.full((q if with_gains else 0, r), -7.0), np.full((g, n, size), -7.0)]
        module.augmented_step(*self.before, *found, fused, *gains)
        found[1] = np.tril(found[1])
        return [*found, fused, *gains]


@st.composite
def ticks(draw):
    rng, missing = np.random.default_rng(draw(seeds)), draw(st.sampled_from([0.0, 0.0, 0.3, 1.0]))
    g, size, blocks, b, w = (draw(st.integers(1, most)) for most in (7, 3, 3, 3, 19))
    n, r = blocks * b, g * w

    def covariance(*batch, size):
        root = rng.normal(size=(*batch, size, size)) / np.sqrt(size)
        return root @ root.mT

    observation = rng.normal(size=(g, size))
    observation[rng.random((g, size)) < missing] = np.nan
    believed = (rng.random((g, size)) >= draw(st.sampled_from([0.0, 0.3]))).astype(np.int64)
    known = covariance(size=r)
    known[np.triu_indices(r, 1)] = np.nan  # nobody looks there
    noise = draw(st.sampled_from([1e-2, 1.0])) * (covariance(g, size=size) + np.eye(size))
    looks = (rng.normal(size=shape) for shape in ((g, n), (g, n, w), (g, n), (g, n, w), (g, size, n)))
    moves = (rng.normal(size=(g, n, n)) / np.sqrt(n), covariance(g, size=n))
    before = (rng.normal(size=r), known, rng.normal(size=(g, n)), rng.normal(size=(g, n, w)), covariance(g, size=n))
    return Tick((observation, believed, *looks, noise, *moves, *before), (g, size, n, w, b))


@needs_extension
@given(ticks(), st.booleans())
def test_augmented_ticks_are_alike(tick, with_gains):
    for ours, theirs in zip(tick.after(_compiled(), with_gains), tick.after(_kernels_numpy, with_gains), strict=True):
        assert_same(ours, theirs)


@needs_extension
def test_a_tick_of_many_outputs_is_alike():
    """More outputs than of the z, and as many states as 30 degrees of freedom have."""
    rng = np.random.default_rng(0)
    g, size, n, w = 1, 40, 90, 7
    positive = np.eye(n) + 0.1 * np.ones((n, n))
    looks = [rng.normal(size=shape) for shape in ((g, n), (g, n, w), (g, n), (g, n, w), (g, size, n))]
    before = (rng.normal(size=w), np.eye(w), np.zeros((g, n)), rng.normal(size=(g, n, w)), positive[None])
    given_now = (rng.normal(size=(g, size)), np.ones((g, size), dtype=np.int64), *looks)
    tick = Tick((*given_now, np.eye(size)[None], 0.1 * positive[None], positive[None], *before), (g, size, n, w, 3))
    for ours, theirs in zip(tick.after(_compiled()), tick.after(_kernels_numpy), strict=True):
        assert_same(ours, theirs)


@pytest.mark.parametrize("module", [_kernels_numpy, pytest.param(kernels, marks=needs_extension)])
def test_a_tick_that_cannot_be_is_refused(module):
    ones, two = np.ones((1, 1, 1)), np.ones((1, 2))
    flat = ones[0]
    looks = (two, np.ones((1, 2), dtype=np.int64), flat, ones, flat, ones, two[..., None], -9 * np.eye(2)[None])
    with pytest.raises(ValueError, match=r"(?i)positive definite"):
        Tick((*looks, ones, ones, flat[0], flat, flat, ones, ones), (1, 2, 1, 1, 1)).after(module)


@needs_extension
def test_arrays_of_a_tick_must_fit():
    ones = np.ones((1, 1, 1))
    flat = ones[0]
    before = [flat, flat.astype(np.int64), flat, ones, flat, ones, ones, ones, ones, ones, flat[0], flat, flat, ones, ones]
    for i, array in enumerate(before):
        for wrong in (np.ones((*array.shape[:-1], 2), dtype=array.dtype), array.astype(np.float32), array[None]):
            with pytest.raises(ValueError, match="expected"):
                Tick((*before[:i], wrong, *before[i + 1 :]), (1, 1, 1, 1, 1)).after(_compiled())
    with pytest.raises(TypeError, match="28 arrays"):
        _compiled().augmented_step(*before)


@pytest.mark.parametrize("wanted", ["", "0", "1"])
def test_the_environment_chooses(wanted):
    code = "from probdmp.gaussian import kernels; print(kernels.COMPILED)"
    environment = {**os.environ, "PROBDMP_NO_EXTENSION": wanted}
    shown = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True).stdout
    assert shown.strip() == ("False" if wanted == "1" else str(_is_built()))


def _compiled():
    from probdmp.gaussian import _kernels

    return _kernels


def _is_built():
    try:
        _compiled()
    except ImportError:
        return False
    return True


@needs_extension
@given(cases())
def test_what_was_filtered_is_smoothed_alike(case):
    t, (m, n) = len(case.observations), case.sensor.shape
    means, covariances, innovations, variances, _, gains = filtered(_kernels_numpy, case)
    seen = ~np.isnan(innovations)[..., None]
    weighted = np.where(seen, case.sensor / variances[..., None], 0.0)
    informations = weighted[..., None] * case.sensor[:, None, :]
    told = (
        weighted * np.nan_to_num(innovations)[..., None],
        informations,
        np.eye(n) - gains[..., None] * case.sensor[:, None, :],
    )
    arguments = (case.transition, *told, means, covariances)
    ours, plain = ([np.empty((t, m, n)), np.empty((t, m, n, n))] for _ in range(2))
    _compiled().smooth_backwards(*arguments, *ours)
    _kernels_numpy.smooth_backwards(*arguments, *plain)
    size = 1 + max(float(np.max(np.abs(case.initial_mean), initial=0.0)), float(np.max(np.abs(covariances), initial=0.0)))
    for first, second in zip(ours, plain, strict=True):
        assert_same(first, second, 1e-12 * max(1.0, size / float(case.noise.min())))


@needs_extension
def test_filtered_states_that_do_not_belong_together_are_refused():
    vectors, matrices = np.zeros((5, 2, 3)), np.zeros((5, 2, 3, 3))
    arguments = [np.zeros((2, 3, 3)), vectors, matrices, matrices, vectors, matrices, vectors.copy(), matrices.copy()]
    _compiled().smooth_backwards(*arguments)
    for i in range(1, len(arguments)):
        with pytest.raises(ValueError, match="expected"):
            _compiled().smooth_backwards(*arguments[:i], arguments[i][:-1], *arguments[i + 1 :])
