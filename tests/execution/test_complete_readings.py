"""What deviations and sensors add to readings: the same tick by tick as all at once, and as by drawing."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from strategies import make_joint_primitive, seeds

from probdmp.dmp import stack_tasks, task_for
from probdmp.dmp.joint_model import joint_executions
from probdmp.execution import SensorArray
from probdmp.execution.complete_readings import complete_readings
from probdmp.execution.reading_noise import reading_noise

DT, TICKS = 0.02, 30


@settings(max_examples=20)
@given(seeds, st.integers(2, 40), st.floats(-8, 0))
def test_outputs_one_by_one_and_all_at_once_are_the_same(seed, n_ticks, log_noise):
    rng = np.random.default_rng(seed)
    primitive = make_joint_primitive(rng)
    executions = joint_executions(primitive, stack_tasks([task_for(primitive)]), np.array([DT]), n_ticks)
    system, sensors = executions.system, rng.standard_normal((2, 3)) * DT ** np.array([2, 1, 0])
    variances, noise = system.variances[0], np.diag(10.0**log_noise * rng.uniform(0.1, 1, 2))
    both = reading_noise(system, variances, np.eye(2)[:, :, None] * sensors[:, None], noise, n_ticks)
    each = [
        reading_noise(system, variances[i : i + 1], sensors[i][None, None], noise[i : i + 1, i : i + 1], n_ticks)
        for i in range(2)
    ]
    designs, residuals = rng.standard_normal((2, n_ticks, 5)), rng.standard_normal((4, 2, n_ticks))
    weighted = np.concatenate([own.weighted(designs[i]) for i, own in enumerate(each)])
    expected = both.weighted(designs.reshape(2 * n_ticks, 5))
    np.testing.assert_allclose(weighted, expected, rtol=1e-7, atol=1e-9 * np.abs(weighted).max())
    scores = np.sum([own.log_likelihoods(np.ascontiguousarray(residuals[:, i])) for i, own in enumerate(each)], axis=0)
    np.testing.assert_allclose(scores, both.log_likelihoods(residuals.reshape(4, -1)), rtol=1e-8)


def dense_scores(executions, array, readings):
    """The logarithm of one Gaussian density over all readings (N, T, O), by its whole covariance."""
    (means, factors, belief), rows, system = executions
    n_ticks, n_signals = len(rows), means.shape[1]
    looks = np.einsum("osc,tcn->tosn", array.dense_matrix.reshape(-1, n_signals, 3), rows[:, 0])
    designs = np.einsum("tosn,snr->tor", looks, factors[0]).reshape(readings[0].size, -1)
    covariance = designs @ belief.covariance[0] @ designs.T + np.kron(np.eye(n_ticks), array.covariance)
    for s in range(n_signals):
        impulses = np.zeros((n_ticks, n_ticks, 3))
        for start in range(n_ticks - 1):
            state = system.input_vector[0, 0]
            for t in range(start + 1, n_ticks):
                impulses[t, start], state = state, system.transition[0, 0] @ state
        seen = np.einsum("oc,tjc->toj", array.dense_matrix[:, 3 * s : 3 * s + 3], impulses).reshape(len(designs), -1)
        covariance += system.variances[0, s] * seen @ seen.T
    plans = np.einsum("tosn,bsn->bto", looks, means).reshape(len(means), -1) + belief.mean @ designs.T
    rest = readings.reshape(len(readings), -1) - plans
    squares = np.einsum("bi,bi->b", rest, np.linalg.solve(covariance, rest.T).T)
    return -0.5 * (squares + np.linalg.slogdet(covariance)[1] + rest.shape[1] * np.log(2 * np.pi))


@settings(max_examples=20)
@given(seeds, st.sampled_from([None, 1, 3]), st.booleans())
def test_they_are_one_draw_from_a_gaussian(seed, rank, is_goal_told):
    """However few directions there are in which executions differ, and whatever is told."""
    rng = np.random.default_rng(seed)
    primitive = make_joint_primitive(rng, channels=("force",), rank=rank)
    goals = [primitive.goal + 0.3 * rng.standard_normal(2) if is_goal_told else None for _ in range(5)]
    tasks = stack_tasks([task_for(primitive, primitive.start + rng.standard_normal(2), goal) for goal in goals])
    executions, array = joint_executions(primitive, tasks, np.array([DT]), TICKS), SensorArray(primitive)
    readings = rng.standard_normal((5, TICKS, 3))
    found = complete_readings(executions, array).log_likelihoods(readings, executions.model.means)
    np.testing.assert_allclose(found, dense_scores(executions, array, readings), rtol=1e-8)
