"""What the parameters leave over is split into deviations of the movement and noise of the sensors."""

from dataclasses import replace

import numpy as np
import pytest
from strategies import make_primitive, random_covariance

from probdmp import ProbabilisticDMP, synthetic_letters
from probdmp.dmp import Task, Variation, task_for
from probdmp.dmp.deviations import lasting_variances
from probdmp.execution import sample_trajectories
from probdmp.learning.residual_noise import with_residual_noise

DT, STEPS, K = 0.01, 101, 12


@pytest.fixture(scope="module")
def letters_a():
    return synthetic_letters(10, letters="a")


def truth(deviation, sensor, n_dof=2, n_basis=8, seed=0):
    """A primitive whose deviations and sensors have the given standard deviations, in movements of about one unit."""
    rng = np.random.default_rng(seed)
    p = make_primitive(rng, n_dof, n_basis, weight_uncertainty="joint", duration=DT * (STEPS - 1), phase_step=0.01)
    scale = np.tile([0.3, 0.1, *[0.1 * p.configuration.stiffness] * n_basis], n_dof)
    covariance = random_covariance(rng, (), len(scale), len(scale)) * scale * scale[:, None]
    means = np.column_stack([p.start_velocities, p.goal - p.start, p.weight_means])
    unit = lasting_variances(replace(p, forcing_precisions=np.ones(n_dof)))
    return replace(
        p,
        variation=Variation(means, covariance, np.full(n_dof, deviation**2 + sensor**2)),
        forcing_precisions=unit / deviation**2,
        observation_variances=np.full(n_dof, sensor**2),
    )


def learned(p, seed=0, missing=0.0):
    paths = sample_trajectories(p, task_for(p, goal=p.goal), DT, K, np.random.default_rng(seed), True)
    observed = np.stack(paths, axis=1)
    observed[0] = p.start
    tasks = Task(observed[0], observed[-1], np.full(K, p.duration))
    observed[1:-1][np.random.default_rng(seed).random(observed[1:-1].shape) < missing] = np.nan
    guess = replace(p, forcing_precisions=np.ones(p.n_dof), observation_variances=p.variation.residual_variances)
    return with_residual_noise(guess, tasks, np.full(K, DT), observed)


@pytest.mark.parametrize(("deviation", "sensor"), [(0.02, 0.001), (0.02, 0.005), (0.005, 0.0002)])
def test_both_are_found(deviation, sensor):
    found = learned(truth(deviation, sensor))
    np.testing.assert_allclose(np.sqrt(found.observation_variances), sensor, rtol=0.25)
    np.testing.assert_allclose(np.sqrt(lasting_variances(found)), deviation, rtol=0.35)


def test_gaps_hardly_matter():
    p = truth(0.02, 0.002)
    whole, gappy = learned(p), learned(p, missing=0.2)
    for found in (whole, gappy):
        np.testing.assert_allclose(np.sqrt(found.observation_variances), 0.002, rtol=0.25)
        np.testing.assert_allclose(np.sqrt(lasting_variances(found)), 0.02, rtol=0.35)


def test_white_noise_is_left_to_the_sensors():
    found = learned(truth(1e-5, 0.01))
    np.testing.assert_allclose(np.sqrt(found.observation_variances), 0.01, rtol=0.1)
    assert np.all(lasting_variances(found) < 0.2 * found.observation_variances)


def test_neither_units_nor_the_order_of_demonstrations_matter(letters_a):
    joint = {"weight_model": "hierarchical", "weight_uncertainty": "joint"}
    one = ProbabilisticDMP(**joint).fit(letters_a).primitive_
    other = ProbabilisticDMP(**joint).fit([replace(d, positions=1000 * d.positions) for d in letters_a[::-1]]).primitive_
    np.testing.assert_allclose(other.observation_variances, 1e6 * one.observation_variances, rtol=0.05)
    np.testing.assert_allclose(other.forcing_precisions, 1e-6 * one.forcing_precisions, rtol=0.05)


def test_the_mean_movement_alone_has_no_deviations(letters_a):
    """`forcing_noise="posterior"`: R is all that the parameters leave over."""
    joint = {"weight_model": "hierarchical", "weight_uncertainty": "joint"}
    p = ProbabilisticDMP(**joint, forcing_noise="posterior").fit(letters_a).primitive_
    np.testing.assert_array_equal(p.observation_variances, p.variation.residual_variances)
    assert not lasting_variances(p).any()
    q = ProbabilisticDMP(**joint).fit(letters_a).primitive_
    np.testing.assert_allclose(np.sqrt(q.observation_variances), 0.03, rtol=0.15)  # of the synthetic pen
    np.testing.assert_array_equal(q.variation.covariance, p.variation.covariance)
