"""The path as a linear function of the parameters is the path of the scheme."""

import numpy as np
import pytest
from hypothesis import given, settings
from strategies import make_primitive, primitives

from probdmp.dmp import Configuration, Variation, linear_gaussian_model, path_distribution, task_for
from probdmp.dmp.goal_handling import REACH, conditioned_part
from probdmp.dmp.path_distribution import parameter_distribution, parameter_factor
from probdmp.dmp.responses import continue_responses, parameter_responses
from probdmp.errors import InputError
from probdmp.gaussian import filter_sequence


@settings(max_examples=30)
@given(primitives(scaling="none"))
def test_a_rollout_is_linear_in_the_parameters(primitive):
    """Acceleration, velocity and position, to rounding, beyond the end too."""
    steps, n_steps = 40, 60
    dt = primitive.duration / steps
    rolled = filter_sequence(linear_gaussian_model(primitive, task_for(primitive), dt, n_steps)).filtered.means
    rolled[..., 2] -= primitive.start
    theta = parameter_distribution(primitive)[0].reshape(primitive.n_dof, -1)
    responses = parameter_responses(primitive.configuration, dt / primitive.duration, n_steps)
    ours = np.einsum("tsn,dn->tds", responses, theta) / primitive.duration ** np.array([2, 1, 0])
    for k in range(3):
        np.testing.assert_allclose(ours[..., k], rolled[..., k], atol=1e-10 * np.abs(rolled[..., k]).max())


@pytest.mark.parametrize("scheme", ["exact", "semi_implicit_euler"])
def test_responses_can_be_continued(scheme):
    configuration = Configuration(n_basis=5, discretization=scheme)
    whole = parameter_responses(configuration, 0.02, 90)
    first = parameter_responses(configuration, 0.02, 30)
    np.testing.assert_array_equal(whole[:30], first)
    np.testing.assert_allclose(continue_responses(configuration, 0.02, 60, 29, first[-1]), whole[30:], atol=1e-14)
    assert not whole.flags.writeable


def test_the_goal_attracts():
    configuration = Configuration(n_basis=5)
    last = parameter_responses(configuration, 0.01, 301)[-1]
    np.testing.assert_allclose(last[2], [0, 1, *[0] * 5], atol=1e-4)


@settings(max_examples=20)
@given(primitives(scaling="none"))
def test_a_path_has_the_moments_of_its_parameters(primitive):
    mean, covariance = path_distribution(primitive, 30)
    d, factor = primitive.n_dof, parameter_factor(parameter_distribution(primitive)[1])
    responses = parameter_responses(primitive.configuration, 1 / 29, 30)[:, 2]
    design = np.kron(np.eye(d), responses) @ factor
    wanted = (design @ design.T).reshape(d, 30, d, 30).transpose(1, 0, 3, 2)
    np.testing.assert_allclose(covariance, wanted, atol=1e-9 * np.abs(wanted).max())
    np.testing.assert_array_equal(covariance[0], 0)  # the start is where it is
    assert mean.shape == (30, d)


# --- goals ------------------------------------------------------------------------------------------------------------


def test_what_is_conditioned_on():
    delta, covariance = np.array([3.0, -4.0]), np.diag([9.0, 16.0])  # one standard deviation each
    np.testing.assert_array_equal(conditioned_part(delta, covariance, "condition"), delta)
    np.testing.assert_array_equal(conditioned_part(delta, covariance, "attractor"), 0)
    np.testing.assert_allclose(conditioned_part(delta, covariance, "blend"), delta, rtol=0.01)
    np.testing.assert_allclose(conditioned_part(1e3 * delta, covariance, "blend"), REACH * delta, rtol=1e-4)
    lengths = [np.abs(conditioned_part(x * delta, covariance, "blend")[0]) for x in np.linspace(0, 20, 50)]
    assert np.all(np.diff(lengths) > 0)
    alone = conditioned_part(np.array([1e4, 0.0]), covariance, "blend")  # the other was not commanded
    np.testing.assert_allclose(alone, [REACH * 3, 0], rtol=1e-4)


@pytest.fixture
def make_varied():
    def make(seed, n_parameters=6):
        rng = np.random.default_rng(seed)
        variation = Variation(rng.standard_normal((2, n_parameters)), np.eye(2 * n_parameters), np.ones(2))
        return make_primitive(np.random.default_rng(5), 2, 4, variation=variation)

    return make


# --- variation --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"means": np.zeros(3)}, "means of shape"),
        ({"covariance": np.eye(5)}, r"covariance of shape \(6, 6\)"),
        ({"covariance": -np.eye(6)}, "covariance symmetric and positive semi-definite"),
        ({"residual_variances": np.zeros(2)}, "residual_variances > 0"),
        ({"means": np.full((2, 3), np.nan)}, "means finite"),
    ],
)
def test_what_is_no_variation(change, match):
    with pytest.raises(InputError, match=match):
        Variation(**{"means": np.zeros((2, 3)), "covariance": np.eye(6), "residual_variances": np.ones(2)} | change)


def test_the_variation_counts_in_the_identity(make_varied):
    p, q = make_varied(0), make_varied(1)
    assert p.identity == make_varied(0).identity != q.identity
    with pytest.raises(InputError, match=r"variation of shape \(2, 6\), got \(2, 5\)"):
        make_varied(0, n_parameters=5)
