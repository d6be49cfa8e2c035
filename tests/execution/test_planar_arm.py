"""An arm in the plane: kinematics and Jacobian against complex numbers and differences, the sensor against the plain arm."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import make_primitive, seeds

from probdmp.dmp import task_for
from probdmp.errors import InputError, InputTypeError
from probdmp.execution import OnlineExecution, PlanarArm, SensorArray, planar_arm_sensor
from probdmp.execution.planar_arm import check_planar_arm


def arm_and_angles(seed, n_links):
    rng = np.random.default_rng(seed)
    return PlanarArm(rng.uniform(0.1, 2, n_links)), rng.uniform(-np.pi, np.pi, n_links)


@given(seeds, st.integers(1, 7))
def test_the_tool_is_where_links_end_as_complex_numbers(seed, n_links):
    arm, q = arm_and_angles(seed, n_links)
    tool = sum(length * np.exp(1j * np.sum(q[: i + 1])) for i, length in enumerate(arm.lengths))
    np.testing.assert_allclose(arm(q), [tool.real, tool.imag], atol=1e-12)


@given(seeds, st.integers(1, 7))
def test_the_jacobian_is_that_of_differences(seed, n_links):
    arm, q = arm_and_angles(seed, n_links)
    steps = 1e-6 * np.eye(n_links)
    differences = (arm(q + steps) - arm(q - steps)) / 2e-6
    np.testing.assert_allclose(arm.jacobian(q), differences.T, atol=1e-8)


@given(seeds, st.integers(1, 7))
def test_turning_the_first_joint_turns_the_tool(seed, n_links):
    arm, q = arm_and_angles(seed, n_links)
    x, y = arm(q)
    np.testing.assert_allclose(arm(q + np.eye(n_links)[0] * np.pi / 2), [-y, x], atol=1e-12)
    np.testing.assert_allclose(arm.jacobian(q)[:, 0], [-y, x], atol=1e-12)


def test_a_path_at_once_is_one_posture_after_the_other():
    arm, rng = PlanarArm([0.4, 0.3, 0.1]), np.random.default_rng(0)
    path = rng.standard_normal((4, 5, 3))
    assert (arm(path).shape, arm.jacobian(path).shape) == ((4, 5, 2), (4, 5, 2, 3))
    np.testing.assert_array_equal(arm(path)[2, 3], arm(path[2, 3]))
    np.testing.assert_array_equal(arm.jacobian(path)[2, 3], arm.jacobian(path[2, 3]))


def test_a_stretched_arm_is_as_long_as_its_links():
    np.testing.assert_array_equal(PlanarArm([1, 2])([0, 0]), [3, 0])
    np.testing.assert_array_equal(PlanarArm([1, 2]).jacobian([0, 0]), [[0, 0], [3, 2]])


@pytest.mark.parametrize(
    ("lengths", "error", "match"),
    [
        ([], InputError, r"at least one link, all of lengths > 0, got \[\]"),
        ([1, 0], InputError, "at least one link"),
        ([1, -2], InputError, "at least one link"),
        ([np.inf], InputError, "link lengths finite"),
        (1.0, InputError, r"link lengths of shape \(L,\)"),
        ([[1.0]], InputError, r"link lengths of shape \(L,\)"),
        (["1"], InputTypeError, "link lengths as real numbers"),
        ([[1], [1, 2]], InputError, "link lengths as a rectangular array"),
    ],
)
def test_arms_that_are_none(lengths, error, match):
    with pytest.raises(error, match=match):
        PlanarArm(lengths)


@pytest.mark.parametrize("q", [0.5, [0.1], [0.1, 0.2, 0.3], [[0.1], [0.2]], [0.1, np.nan]])
def test_angles_that_do_not_fit(q):
    for function in (PlanarArm([1, 2]), PlanarArm([1, 2]).jacobian):
        with pytest.raises(InputError, match="joint angles"):
            function(q)


# --- the sensor -------------------------------------------------------------------------------------------------------


def test_the_sensor_has_the_exact_jacobian_and_names_of_its_own():
    sensor = planar_arm_sensor("camera", [0.4, 0.3], [0.01, 0.02], gate=4)
    assert isinstance(sensor.function, PlanarArm)
    np.testing.assert_array_equal(sensor.jacobian([0.1, 0.2]), sensor.function.jacobian([0.1, 0.2]))
    np.testing.assert_array_equal(sensor.covariance, np.diag([0.01**2, 0.02**2]))
    assert (sensor.outputs, sensor.gate, sensor.linearization) == (("camera_x", "camera_y"), 4.0, "extended")
    named = planar_arm_sensor("camera", [0.4, 0.3], 0.01, ["u", "v"], linearization="unscented")
    assert (named.outputs, named.linearization, named.gate) == (("u", "v"), "unscented", None)


def test_an_infinite_std_is_that_of_an_output_that_says_nothing():
    np.testing.assert_array_equal(planar_arm_sensor("camera", [1, 1], [1, np.inf]).covariance, [[1, 0], [0, np.inf]])


@pytest.mark.parametrize("linearization", ["extended", "unscented"])
def test_an_execution_that_the_camera_alone_sees_follows_the_arm(linearization):
    """Where the camera is precise, two joints and two coordinates leave nothing open."""
    primitive = make_primitive(
        np.random.default_rng(0), 2, weight_uncertainty="independent", forcing_noise="predictive", units="rad"
    )
    sensor = planar_arm_sensor("camera", [0.4, 0.3], 1e-6, linearization=linearization)
    execution = OnlineExecution(primitive, task_for(primitive), 0.01, sensors=SensorArray(primitive, [sensor]))
    q = np.array(primitive.start)
    for _ in range(20):
        q += [0.001, 0.002]
        step = execution.step({"camera": sensor.function(q)})
    assert np.isfinite(step.log_likelihood)
    np.testing.assert_allclose(step.position, q, atol=0.05)


@pytest.mark.parametrize(
    ("changes", "error", "match"),
    [
        ({"stds": 0}, InputError, r"stds of sensor 'camera' > 0, got 0"),
        ({"stds": [1, 2, 3]}, InputError, r"stds of sensor 'camera' of shape \(2,\), got \(3,\)"),
        ({"stds": "1"}, InputTypeError, "stds of sensor 'camera' as real numbers"),
        ({"stds": [[1], [1, 2]]}, InputError, "stds of sensor 'camera' as a rectangular array"),
        ({"outputs": ["u"]}, InputError, "2 different names for the outputs of sensor 'camera'"),
        ({"outputs": "uv"}, InputTypeError, r"outputs as a list of names.*outputs=\['uv'\]"),
        ({"gate": -1}, InputError, "gate of sensor 'camera' > 0"),
        ({"linearization": "none"}, InputError, "linearization to be one of 'extended', 'unscented'"),
        ({"link_lengths": [0.4, 0]}, InputError, "all of lengths > 0"),
        ({"link_lengths": None}, InputTypeError, "link lengths of sensor 'camera' as real numbers"),
    ],
)
def test_sensors_that_cannot_be_made(changes, error, match):
    with pytest.raises(error, match=match):
        planar_arm_sensor(**{"name": "camera", "link_lengths": [0.4, 0.3], "stds": 0.01, **changes})


def test_an_arm_has_a_joint_for_each_degree_of_freedom_in_radians():
    sensor, rng = planar_arm_sensor("camera", [0.4, 0.3], 0.01), np.random.default_rng(0)
    check_planar_arm(sensor, make_primitive(rng, 2, units=""))
    with pytest.raises(InputError, match="link lengths of sensor 'camera', one for each of q0, q1, q2, got 2"):
        check_planar_arm(sensor, make_primitive(rng, 3))
    with pytest.raises(InputError, match=r"a movement in radians for the arm of sensor 'camera', got deg\. Convert"):
        check_planar_arm(sensor, make_primitive(rng, 2, units="deg"))
