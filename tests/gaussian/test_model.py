"""The system as a value: its shapes, its derived arrays, and what it refuses to be given."""

from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given
from reference import system_at
from strategies import batch_indices, draw_observations, random_system, systems

from probdmp.errors import InputError, InputTypeError
from probdmp.gaussian import LinearGaussianModel, filter_sequence, sample_sequences, smooth_sequence


@pytest.fixture
def model():
    """Five steps of two systems with three states, one input and two sensors."""
    return random_system(np.random.default_rng(0), n_states=3, n_inputs=1, n_sensors=2, n_steps=5, batch=(2,))


def test_there_is_one_state_more_than_inputs(model):
    assert len(model.inputs) == 4
    assert model.n_steps == 5


def test_a_single_state_has_no_input(model):
    single = replace(model, inputs=np.empty((0, 2, 1)), input_covariances=np.empty((0, 2, 1, 1)))
    assert single.n_steps == 1
    means, covariances = filter_sequence(single).filtered
    np.testing.assert_array_equal(means, np.broadcast_to(model.initial_mean, (1, 2, 3)))
    np.testing.assert_array_equal(covariances, np.broadcast_to(model.initial_covariance, (1, 2, 3, 3)))


def test_batch_axes_broadcast():
    model = LinearGaussianModel(
        transition=np.zeros((4, 1, 3, 3)),
        input_matrix=np.zeros((3, 1)),
        inputs=np.zeros((9, 2, 1)),
        input_covariances=np.zeros((9, 1, 1, 1, 1)),
        observation_matrix=np.zeros((1, 3)),
        observation_covariance=np.ones((1, 1)),
        initial_mean=np.zeros((2, 3)),
        initial_covariance=np.zeros((3, 3)),
    )
    assert model.batch_shape == (4, 2)


TIMED = ("inputs", "input_covariances")
FIELDS = [field.name for field in fields(LinearGaussianModel)]


def batched(model, name, copies=2):
    """The same system several times, with batch axes on one array only."""
    return replace(model, **{name: np.stack([getattr(model, name)] * copies, axis=name in TIMED)})


@pytest.mark.parametrize("name", FIELDS)
def test_any_one_array_may_carry_the_batch(name):
    rng = np.random.default_rng(0)
    alone = random_system(rng, n_states=3, n_inputs=2, n_sensors=2, n_steps=6)
    observations = draw_observations(alone, rng, missing=0.2)
    model = batched(alone, name)
    assert model.batch_shape == (2,)
    for run in (lambda m, o: filter_sequence(m, o).filtered, smooth_sequence):
        expected, result = run(alone, observations), run(model, np.stack([observations] * 2, axis=1))
        for d in range(2):
            np.testing.assert_allclose(result.means[:, d], expected.means, rtol=1e-12, atol=1e-12)
            np.testing.assert_allclose(result.covariances[:, d], expected.covariances, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("name", FIELDS)
def test_any_one_array_may_carry_the_batch_of_draws(name):
    rng = np.random.default_rng(0)
    alone = random_system(rng, n_states=3, n_inputs=2, n_sensors=2, n_steps=6)
    states, observations = sample_sequences(batched(alone, name), 3, rng)
    assert states.shape == (3, 6, 2, 3)
    assert observations.shape == (3, 6, 2, 2)


def test_batch_is_not_mistaken_for_time():
    alone = random_system(np.random.default_rng(0), n_states=1, n_inputs=1, n_sensors=1, n_steps=3, known_start=True)
    alone = replace(alone, input_covariances=np.array([[[0.0]], [[1.0]]]))
    states, _ = sample_sequences(batched(alone, "transition"), 100, np.random.default_rng(0))
    spread = states[..., 0].std(axis=0)
    assert np.all(spread[:2] < 1e-12)
    assert np.all(spread[2] > 0)


@given(systems())
def test_drift_is_Bu_and_process_covariance_is_BUB(model):
    drifts, covariances = model.drifts(), model.process_covariances()
    for index in batch_indices(model):
        system = system_at(model, index)
        for t in range(model.n_steps - 1):
            at = (t, *index)
            # Where all that enters is shared, so are the products.
            drift = np.broadcast_to(drifts, (len(drifts), *model.batch_shape, *drifts.shape[-1:]))[at]
            covariance = np.broadcast_to(covariances, (len(drifts), *model.batch_shape, *covariances.shape[-2:]))[at]
            np.testing.assert_allclose(drift, system.B @ system.u[t], rtol=1e-13, atol=1e-13)
            np.testing.assert_allclose(covariance, system.B @ system.U[t] @ system.B.T, rtol=1e-13, atol=1e-13)


@pytest.mark.parametrize("run", [filter_sequence, smooth_sequence])
@pytest.mark.parametrize("shape", [(4, 2, 2), (5, 2), (5, 2, 3), (5, 3, 2), (2, 5, 2), ()])
def test_wrong_shape_is_refused_and_the_right_one_named(model, run, shape):
    message = r"Expected observations of shape \(5, 2, 2\), got \(.*\)\. T = 5 times first, then the batch, then 2 sensors\."
    with pytest.raises(InputError, match=message):
        run(model, np.zeros(shape))


@pytest.mark.parametrize("run", [filter_sequence, smooth_sequence])
def test_infinite_observation_is_refused_and_located(model, run):
    observations = np.zeros((5, 2, 2))
    observations[3, 1, 0] = np.inf
    with pytest.raises(InputError, match=r"observations finite or NaN.*got inf at index \[3, 1, 0\] \(1 such values\)"):
        run(model, observations)


@pytest.mark.parametrize("observations", [np.full((5, 2, 2), "1"), np.zeros((5, 2, 2), complex), np.full((5, 2, 2), None)])
def test_other_than_real_numbers_are_refused(model, observations):
    with pytest.raises(InputTypeError, match="Expected observations as real numbers, got dtype"):
        filter_sequence(model, observations)


@pytest.mark.parametrize(
    "covariance",
    [np.zeros((2, 2)), -np.eye(2), np.diag([1.0, 0.0]), [[1.0, 2.0], [2.0, 1.0]], np.stack([np.eye(2), np.diag([1, -1e-9])])],
    ids=["zero", "negative", "one exact sensor", "indefinite", "one of a batch"],
)
@pytest.mark.parametrize("run", [filter_sequence, smooth_sequence])
def test_observation_covariance_that_is_not_positive_definite_is_refused(model, run, covariance):
    bad = replace(model, observation_covariance=np.asarray(covariance))
    with pytest.raises(
        InputError, match=r"observation_covariance symmetric and positive definite, got one that is not.*variance above zero"
    ):
        run(bad, np.zeros((5, 2, 2)))
