"""Sensors as plain values: what comes back says the same of every observation; what a stranger wrote is refused."""

import json
from contextlib import suppress
from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import make_primitive, seeds

from probdmp.dmp import ChannelVariation, Variation
from probdmp.errors import InputError, InputTypeError
from probdmp.execution import (
    ChannelSensor,
    LinearSensor,
    NonlinearSensor,
    PlanarArm,
    default_sensors,
    planar_arm_sensor,
    sensors_as_plain,
    sensors_from_plain,
    state_sensor,
)


def primitive_with(*channels, n_dof=2):
    primitive = make_primitive(np.random.default_rng(0), n_dof, 3, weight_uncertainty="joint")
    variation = Variation(np.zeros((n_dof, 5)), np.eye(n_dof * 5), np.ones(n_dof))
    n, ones = len(channels) * 6, np.ones(len(channels))
    sensed = ChannelVariation(
        channels, np.zeros((len(channels), 6)), np.eye(n), np.zeros((n, n_dof * 5)), ones, ones, ones, ones
    )
    return replace(primitive, variation=variation, channels=sensed)


PRIMITIVE = primitive_with("force", "torque")
ARM = planar_arm_sensor("camera", [0.4, 0.3], [0.01, np.inf], ["u", "v"], 3.5, "unscented")
SENSORS = [
    state_sensor(PRIMITIVE, "encoder", "position", [0.1, np.inf], ["e0", "e1"], 5),
    state_sensor(PRIMITIVE, "gyro", ["velocity:q1"], 1 / 3),
    LinearSensor("mix", np.arange(12).reshape(2, 6) / 7, [[2, 0.1], [0.1, 1]]),
    ChannelSensor("force", 0.1, 2.5),
    ARM,
]


def through_json(sensors, primitive=PRIMITIVE):
    return sensors_from_plain(json.loads(json.dumps(sensors_as_plain(sensors), allow_nan=False)), primitive)


def assert_same(one, other):
    assert type(one) is type(other)
    for field in fields(one):
        value, wanted = getattr(one, field.name), getattr(other, field.name)
        if isinstance(wanted, np.ndarray):
            assert value.tobytes() == wanted.tobytes()
        elif isinstance(wanted, PlanarArm):
            assert value.lengths.tobytes() == wanted.lengths.tobytes()
        elif callable(wanted):
            assert value == one.function.jacobian
        else:
            assert value == wanted


def test_what_comes_back_is_the_same_bit_for_bit():
    again = through_json(SENSORS)
    assert isinstance(again, tuple)
    for one, other in zip(again, SENSORS, strict=True):
        assert_same(one, other)
    assert sensors_as_plain(again) == sensors_as_plain(SENSORS)


def test_the_sensors_that_are_there_by_default_survive():
    for one, other in zip(through_json(default_sensors(PRIMITIVE)), default_sensors(PRIMITIVE), strict=True):
        assert_same(one, other)


@given(seeds, st.integers(1, 3), st.integers(1, 3), st.floats(1e-300, 1e90))
def test_linear_sensors_survive(seed, n_dof, n_outputs, scale):
    rng = np.random.default_rng(seed)
    factor = rng.standard_normal((n_outputs, n_outputs))
    noise = factor @ factor.T * scale + np.eye(n_outputs) * scale
    noise = (noise + noise.T) / 2
    sensor = LinearSensor("ü", rng.standard_normal((n_outputs, 3 * n_dof)), noise, gate=float(rng.uniform(0.1, 9)))
    (again,) = through_json([sensor], make_primitive(rng, n_dof))
    assert_same(again, sensor)


def test_noise_that_was_learned_survives():
    learned = replace(ARM, covariance=np.array([[2e-4, 1e-5], [1e-5, 3e-4]]))
    assert_same(through_json([learned])[0], learned)


def test_infinite_variances_are_null():
    assert sensors_as_plain(SENSORS)[0] == {
        "kind": "linear", "name": "encoder", "outputs": ["e0", "e1"], "gate": 5.0,
        "matrix": [[0, 0, 1, 0, 0, 0], [0, 0, 0, 0, 0, 1]], "covariance": [[0.1**2, 0], [0, None]],
    }  # fmt: skip
    assert sensors_as_plain([ARM])[0]["covariance"] == [[0.01**2, 0], [0, None]]


@pytest.mark.parametrize(
    "sensor",
    [
        NonlinearSensor("own", lambda q: q[:1], [1.0]),
        NonlinearSensor("own", ARM.function, [1.0, 1.0]),  # whose Jacobian is by differences
        NonlinearSensor("own", ARM.function, [1.0, 1.0], ARM.function.jacobian, reads=("velocity",)),
        NonlinearSensor("own", ARM.function, [1.0, 1.0], ARM.function.jacobian, period=1.0),
        NonlinearSensor("own", ARM.function, [1.0, 1.0], PlanarArm([1, 2]).jacobian),
    ],
)
def test_functions_of_the_users_own_are_refused_with_the_remedy(sensor):
    with pytest.raises(InputError, match=r"got 'own', which has a function of its own\. Save the model without the detector"):
        sensors_as_plain([*SENSORS[:1], sensor])


# --- from a stranger --------------------------------------------------------------------------------------------------


def changed(place, **changes):
    plain = json.loads(json.dumps(sensors_as_plain(SENSORS)))
    plain[place] = {**plain[place], **changes}
    return plain


def without(place, key):
    plain = changed(place)
    del plain[place][key]
    return plain


@pytest.mark.parametrize(
    ("plain", "match"),
    [
        (None, "sensors as a list of dicts"),
        ({}, "sensors as a list of dicts"),
        ([1], "sensors as a list of dicts"),
        ([], "at least one sensor"),
        ([{}], "the kind of a sensor to be one of 'linear', 'channel', 'planar_arm', got None"),
        (changed(0, kind="os.system"), "the kind of a sensor to be one of"),
        (changed(0, kind=["linear"]), "the kind of a sensor to be one of"),
        (changed(0, kind="channel"), "a sensor with covariance, gate, kind, name, got"),
        (without(0, "gate"), "a sensor with covariance, gate, kind, matrix, name, outputs, got"),
        (changed(0, more=1), "a sensor with"),
        (changed(0, name=3), "the name of a sensor as text"),
        (changed(0, name=""), "the name of a sensor as text"),
        (changed(0, name="gyro"), "sensors with different names"),
        (changed(0, outputs=["e0", "velocity_q1"]), "sensors with different outputs"),
        (changed(0, outputs="xy"), "outputs of sensor 'encoder' as a list of names"),
        (changed(0, outputs=[["x"], {}]), "outputs of sensor 'encoder' as a list of names"),
        (changed(0, outputs=["x"]), "2 different names for the outputs"),
        (changed(0, outputs=["x", "x"]), "different names in outputs"),
        (changed(0, gate="5"), "gate of sensor 'encoder' > 0"),
        (changed(0, gate=-5), "gate of sensor 'encoder' > 0"),
        (changed(0, gate=True), "gate of sensor 'encoder' > 0"),
        (changed(0, gate=10**400), "gate of sensor 'encoder' > 0"),
        (changed(0, matrix=None), "matrix of sensor 'encoder' as real numbers"),
        (changed(0, matrix=[]), r"matrix of sensor 'encoder' of shape"),
        (changed(0, matrix=[[]]), "matrix of sensor 'encoder' with 3 D columns"),
        (changed(0, matrix=[[1], [1, 2]]), "matrix of sensor 'encoder' as a rectangular array"),
        (changed(0, matrix=[["1"] * 6] * 2), "matrix of sensor 'encoder' as real numbers"),
        (changed(0, matrix=[[10**400] * 6] * 2), "matrix of sensor 'encoder' as real numbers"),
        (changed(0, matrix=[[1e200] * 6] * 2), "matrix of sensor 'encoder' of magnitude"),
        (changed(0, matrix=[[None] * 6] * 2), "matrix of sensor 'encoder' as real numbers"),
        (changed(0, matrix=[[0.0] * 9] * 2), "matrix of sensor 'encoder' with 6 columns, got 9"),
        (changed(0, covariance=1.0), "covariance of sensor 'encoder' as a list of rows"),
        (changed(0, covariance=[1.0, 1.0]), "covariance of sensor 'encoder' as a list of rows"),
        (changed(0, covariance=[]), "covariance of sensor 'encoder' of shape"),
        (changed(0, covariance=[[1.0]]), r"covariance of sensor 'encoder' of shape \(2, 2\)"),
        (changed(0, covariance=[[1.0], [0.0, 1.0]]), "covariance of sensor 'encoder' as a rectangular array"),
        (changed(0, covariance=[["a", 0], [0, 1]]), "covariance of sensor 'encoder' as real numbers"),
        (changed(0, covariance=[[1, None], [None, 1]]), "covariance of sensor 'encoder' finite"),
        (changed(0, covariance=[[1, 2], [2, 1]]), "covariance of sensor 'encoder' symmetric and positive definite"),
        (changed(0, covariance=[[1, 0.5], [0, 1]]), "covariance of sensor 'encoder' symmetric"),
        (changed(0, covariance=[[0, 0], [0, 1]]), "covariance of sensor 'encoder' symmetric and positive definite"),
        (changed(3, name="noise"), "a channel that was learned"),
        (changed(3, covariance=[[1, 0], [0, 1]]), r"covariance of sensor 'force' of shape \(1, 1\)"),
        (changed(4, link_lengths=[0.4]), "link lengths of sensor 'camera', one for each of q0, q1, got 1"),
        (changed(4, link_lengths=[0.4, -1]), "all of lengths > 0"),
        (changed(4, link_lengths="long"), "link lengths of sensor 'camera' as real numbers"),
        (changed(4, link_lengths=[[1], [1, 2]]), "link lengths of sensor 'camera' as a rectangular array"),
        (changed(4, covariance=[[1.0]]), "1 different names for the outputs"),
        (changed(4, covariance=[[]]), "names for the outputs"),
        (changed(4, covariance=[]), "at least one output of sensor 'camera'"),
        (changed(4, linearization="eval"), "linearization to be one of"),
        (changed(4, linearization=None), "linearization to be one of"),
        (changed(4, function="os.system"), "a sensor with"),
    ],
)
def test_what_is_no_sensor_is_refused(plain, match):
    with pytest.raises((InputError, InputTypeError), match=match):
        sensors_from_plain(plain, PRIMITIVE)


json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=3),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=2), inner, max_size=2),
    max_leaves=6,
)


@given(st.integers(0, len(SENSORS) - 1), st.data(), json_values)
def test_whatever_stands_in_a_field_nothing_but_an_input_error_comes_of_it(place, data, value):
    key = data.draw(st.sampled_from(sorted(sensors_as_plain(SENSORS)[place])))
    with suppress(InputError, InputTypeError):
        sensors_from_plain(changed(place, **{key: value}), PRIMITIVE)


def test_sensors_of_another_primitive_are_refused():
    with pytest.raises(InputError, match="with 9 columns, got 6"):
        sensors_from_plain(sensors_as_plain(SENSORS[:1]), make_primitive(np.random.default_rng(0), 3))
    with pytest.raises(InputError, match="a channel that was learned"):
        sensors_from_plain(sensors_as_plain(SENSORS[3:4]), make_primitive(np.random.default_rng(0), 2))
