"""The built-in arm movements: through their via-points, from rest to rest, such as a real arm could make them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from probdmp import ProbabilisticDMP, synthetic_arm_movements
from probdmp.demonstrations import ARM_MOVEMENTS, ArmVariation
from probdmp.demonstrations.arm_plans import PLANS
from probdmp.demonstrations.minimum_jerk import minimum_jerk_spline
from probdmp.errors import InputError, InputTypeError

STILL = ArmVariation(0, 0, 0, 0, 0, 0)
PANDA = {
    "lowest": [-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973],
    "highest": [2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973],
    "velocity": [2.1750, 2.1750, 2.1750, 2.1750, 2.6100, 2.6100, 2.6100],
    "acceleration": [15, 7.5, 10, 12.5, 15, 20, 20],
}
"""Limits of the joints as the maker publishes them: rad, rad/s, rad/s²."""


@pytest.fixture(scope="module")
def movements():
    return synthetic_arm_movements(10)


def test_three_of_the_hand_and_three_of_the_joints(movements):
    spaces = {m.demonstration.label: (m.demonstration.names, m.demonstration.units) for m in movements}
    hand, joints = (("x", "y", "z"), "m"), (tuple(f"q{i}" for i in range(1, 8)), "rad")
    assert spaces == dict.fromkeys(("reach", "place", "wipe"), hand) | dict.fromkeys(("hand_over", "pour", "wave"), joints)


def test_the_truth_passes_through_its_via_points_at_its_times(movements):
    for m in movements:
        path = minimum_jerk_spline(m.via_times, m.via_points)
        np.testing.assert_allclose(path(m.via_times), m.via_points, atol=1e-9)
        for order, truth in enumerate((m.positions, m.velocities, m.accelerations)):
            np.testing.assert_allclose(truth, path(m.demonstration.times, order), atol=1e-7 * max(np.abs(truth).max(), 1))


def test_it_begins_and_ends_at_rest_in_start_and_goal(movements):
    for m in movements:
        np.testing.assert_allclose(m.positions[[0, -1]], m.via_points[[0, -1]], atol=1e-9)
        for slope in (m.velocities, m.accelerations):
            np.testing.assert_allclose(slope[[0, -1]], 0, atol=1e-7)
        assert m.via_times[0] == 0
        assert m.via_times[-1] == pytest.approx(m.demonstration.duration, rel=1e-12)
        assert (np.diff(m.via_times) > 0).all()


@pytest.mark.parametrize("name", ARM_MOVEMENTS)
def test_velocities_and_accelerations_are_slopes(name):
    (m,) = synthetic_arm_movements(1, movements=(name,), dt=1e-3)
    for values, slopes in ((m.positions, m.velocities), (m.velocities, m.accelerations)):
        np.testing.assert_allclose((values[2:] - values[:-2]) / 2e-3, slopes[1:-1], atol=2e-4 * np.abs(slopes).max())


@pytest.mark.parametrize("name", ARM_MOVEMENTS)
def test_recordings_are_the_truth_and_white_noise(name):
    executions = synthetic_arm_movements(10, movements=(name,))
    residuals = np.vstack([m.demonstration.positions - m.positions for m in executions])
    std = ArmVariation().sensor_noise * np.ptp(PLANS[name].points, axis=0).max()
    np.testing.assert_allclose(residuals.std(axis=0), std, rtol=5 / np.sqrt(2 * len(residuals)))


def test_a_panda_could_make_the_joint_movements(movements):
    for m in movements:
        if m.demonstration.n_dof == 7:
            assert (m.positions > PANDA["lowest"]).all()
            assert (m.positions < PANDA["highest"]).all()
            assert (np.abs(m.velocities) < PANDA["velocity"]).all()
            assert (np.abs(m.accelerations) < PANDA["acceleration"]).all()


def test_no_hand_goes_through_the_table(movements):
    for m in movements:
        if m.demonstration.n_dof == 3:
            assert (m.positions[:, 2] > 0).all()
            assert (np.linalg.norm(m.positions, axis=1) < 0.855).all()  # the reach of the same arm


def test_goals_and_tempo_vary_as_they_say():
    executions = synthetic_arm_movements(200, movements=("reach",), dt=0.1)
    extent = np.ptp(PLANS["reach"].points, axis=0).max()
    goals = np.array([m.via_points[-1] for m in executions])
    np.testing.assert_allclose(goals.std(axis=0), 0.05 * extent, rtol=0.25)
    starts = np.array([m.via_points[0] for m in executions])
    np.testing.assert_allclose(starts.std(axis=0), 0.02 * extent, rtol=0.25)
    fine = synthetic_arm_movements(200, movements=("reach",))
    assert np.log([m.demonstration.duration for m in fine]).std() == pytest.approx(0.07, rel=0.25)


def test_without_variation_executions_are_the_plan_itself():
    for name in ARM_MOVEMENTS:
        first, second = synthetic_arm_movements(2, movements=(name,), variation=STILL)
        np.testing.assert_array_equal(first.demonstration.positions, second.demonstration.positions)
        np.testing.assert_allclose(first.via_points, PLANS[name].points)
        np.testing.assert_allclose(first.via_times, PLANS[name].phases * PLANS[name].duration, atol=0.01)


@given(st.lists(st.sampled_from(ARM_MOVEMENTS), min_size=1, max_size=3, unique=True), st.integers(1, 3), st.integers(0, 2**64))
def test_an_execution_depends_on_its_seed_movement_and_number_alone(names, n, seed):
    together = [m.demonstration for m in synthetic_arm_movements(n + 1, seed, names, dt=0.05)]
    assert [d.label for d in together] == [name for name in names for _ in range(n + 1)]
    for name in names:
        alone = [m.demonstration.fingerprint for m in synthetic_arm_movements(n, seed, (name,), dt=0.05)]
        assert alone == [d.fingerprint for d in together if d.label == name][:n]
    assert len({d.fingerprint for d in together}) == len(together)


@pytest.mark.parametrize("name", ARM_MOVEMENTS)
def test_they_can_be_learned(name):
    """The mean of a primitive learned from noisy executions is near the truth of one that it has not seen."""
    executions = synthetic_arm_movements(9, movements=(name,), dt=0.02)
    p = ProbabilisticDMP(20).fit([m.demonstration for m in executions[:8]])
    m = executions[8]
    smoothed = p.smooth(m.demonstration)
    extent = np.ptp(PLANS[name].points, axis=0).max()
    assert np.sqrt(np.mean((smoothed.means[..., 2] - m.positions) ** 2)) < ArmVariation().sensor_noise * extent


@pytest.mark.parametrize(
    ("arguments", "error", "match"),
    [
        ({"movements": ()}, InputError, r"different names, at least one, got \(\)"),
        ({"movements": ("reach", "reach")}, InputError, "different names, at least one"),
        ({"movements": ("dance",)}, InputError, "each of movements to be one of 'reach', .*, got 'dance'"),
        ({"movements": "reach"}, InputTypeError, "movements as a sequence of names, got 'reach'.*One alone"),
        ({"movements": ([],)}, InputError, "each of movements"),
        ({"n_demonstrations": 0}, InputError, "n_demonstrations as a whole number from 1 up, got 0"),
        ({"seed": 1.5}, InputTypeError, "seed as a whole number"),
        ({"dt": 10}, InputError, "dt from 0.0001 to 0.1 seconds, got 10.*milliseconds"),
        ({"variation": 0.1}, InputTypeError, "variation as an ArmVariation, got float"),
    ],
)
def test_what_cannot_be_moved(arguments, error, match):
    with pytest.raises(error, match=match):
        synthetic_arm_movements(**arguments)


@pytest.mark.parametrize(("field", "value"), [("via", -1), ("tempo", 0.6), ("timing", 3), ("goal", np.inf)])
def test_what_is_no_variation(field, value):
    with pytest.raises(InputError, match=f"Expected {field}"):
        ArmVariation(**{field: value})
