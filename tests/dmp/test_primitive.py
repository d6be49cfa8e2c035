"""The learned movement as a value: what it refuses, how it is recognised, when it scales."""

from dataclasses import FrozenInstanceError, fields, replace

import numpy as np
import pytest
from strategies import make_primitive

from probdmp.dmp import PUBLISHED, Configuration, Primitive, task_for
from probdmp.errors import InputError, InputTypeError

ARRAYS = [f.name for f in fields(Primitive) if f.type == fields(Primitive)[1].type]
POSITIVE = ["weight_precisions", "forcing_precisions", "observation_variances", "ranges"]


@pytest.fixture(scope="module")
def primitive():
    return make_primitive(np.random.default_rng(0))


def test_the_arrays_of_a_primitive_are_known_to_these_tests(primitive):
    assert set(POSITIVE) < set(ARRAYS)
    assert all(isinstance(getattr(primitive, f.name), np.ndarray) == (f.name in ARRAYS) for f in fields(primitive))


@pytest.mark.parametrize("name", ARRAYS)
def test_arrays_are_read_only_copies(primitive, name):
    given = np.array(getattr(primitive, name))
    own = replace(primitive, **{name: given})
    given[...] = 7
    np.testing.assert_array_equal(getattr(own, name), getattr(primitive, name))
    with pytest.raises(ValueError, match="read-only"):
        getattr(own, name)[...] = 7
    with pytest.raises(FrozenInstanceError):
        own.dt = 1.0


@pytest.mark.parametrize("name", ARRAYS)
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_numbers_that_are_not_finite_are_refused_by_name(primitive, name, bad):
    values = np.array(getattr(primitive, name))
    values.flat[-1] = bad
    with pytest.raises(InputError, match=f"Expected {name} finite, got {bad}"):
        replace(primitive, **{name: values})


@pytest.mark.parametrize("name", ARRAYS)
def test_wrong_shapes_are_refused_by_name(primitive, name):
    for values in (getattr(primitive, name)[:-1], getattr(primitive, name)[..., None], np.array(1.0)):
        with pytest.raises(InputError, match=rf"Expected {name} of shape \(2,.*got \("):
            replace(primitive, **{name: values})


@pytest.mark.parametrize("name", ARRAYS)
@pytest.mark.parametrize("dtype", [complex, str, object, bool])
def test_wrong_kinds_are_refused_by_name(primitive, name, dtype):
    with pytest.raises(InputTypeError, match=f"Expected {name} as real numbers"):
        replace(primitive, **{name: getattr(primitive, name).astype(dtype)})


@pytest.mark.parametrize("name", POSITIVE)
@pytest.mark.parametrize("bad", [0.0, -1.0])
def test_what_must_be_positive(primitive, name, bad):
    values = np.array(getattr(primitive, name))
    values[1] = bad
    with pytest.raises(InputError, match=rf"Expected {name} > 0, got {bad:g}\."):
        replace(primitive, **{name: values})


@pytest.mark.parametrize("name", ["weight_covariances", "start_covariances"])
@pytest.mark.parametrize("damage", ["negative variance", "asymmetric"])
def test_what_is_not_a_covariance_is_refused(primitive, name, damage):
    values = np.array(getattr(primitive, name))
    if damage == "negative variance":
        values[1, 0, 0] = -values[1, 0, 0]
    else:
        values[1, 0, 1] += 0.1 * values[1, 0, 0]
    with pytest.raises(InputError, match=rf"Expected {name} symmetric and positive semi-definite.*edited by hand"):
        replace(primitive, **{name: values})


@pytest.mark.parametrize("name", ["weight_covariances", "start_covariances"])
def test_a_negative_variance_is_seen_beside_much_larger_ones(primitive, name):
    """Degrees of freedom may have very different sizes: metres beside encoder ticks."""
    values = np.array(getattr(primitive, name))
    values[0] *= -1e-12
    with pytest.raises(InputError, match=f"Expected {name} symmetric and positive semi-definite"):
        replace(primitive, **{name: values})


@pytest.mark.parametrize("name", ["duration", "dt", "phase_step"])
@pytest.mark.parametrize("bad", [0.0, -1.0, np.nan, np.inf])
def test_times_are_positive(primitive, name, bad):
    with pytest.raises(InputError, match=f"Expected {name} > 0"):
        replace(primitive, **{name: bad})


@pytest.mark.parametrize("name", ["duration", "dt"])
@pytest.mark.parametrize("bad", [0.9e-9, 1.1e9])
def test_times_are_those_of_a_movement(primitive, name, bad):
    with pytest.raises(InputError, match=rf"Expected {name} from 1e-09 to 1e\+09 seconds, got"):
        replace(primitive, **{name: bad})


@pytest.mark.parametrize(
    ("changes", "match"),
    [
        ({"n_demonstrations": 0}, "n_demonstrations as a whole number from 1 up, got 0"),
        ({"names": ("q0", "q0")}, r"at least one name, all different, got \('q0', 'q0'\)"),
        ({"names": ("q0", 3)}, "names and units as text"),
        ({"units": None}, "names and units as text"),
    ],
)
def test_other_fields(primitive, changes, match):
    with pytest.raises((InputError, InputTypeError), match=match):
        replace(primitive, **changes)


@pytest.mark.parametrize(
    ("changes", "match"),
    [
        ({"n_basis": 0}, "n_basis as a whole number from 1 to 1000, got 0"),
        ({"n_basis": 1001}, "n_basis as a whole number from 1 to 1000, got 1001"),
        ({"n_basis": 3.0}, "n_basis as a whole number"),
        ({"n_basis": True}, "n_basis as a whole number"),
        ({"alpha_z": 0.0}, "alpha_z > 0, got 0"),
        ({"alpha_z": np.nan}, "alpha_z > 0, got nan"),
        ({"alpha_z": 0.9e-3}, r"alpha_z from 0\.001 to 10000, got 0\.0009"),
        ({"alpha_z": 1.1e4}, r"alpha_z from 0\.001 to 10000, got 11000"),
        ({"alpha_z": "25"}, "alpha_z > 0, one number, got '25'"),
        ({"discretization": "euler"}, "discretization to be one of 'exact', 'semi_implicit_euler', got 'euler'"),
        ({"scaling": None}, "scaling to be one of 'none', 'paper', got None"),
        ({"forcing_noise": ["posterior"]}, "forcing_noise to be one of 'posterior', 'predictive'"),
    ],
)
def test_configuration_refuses(changes, match):
    with pytest.raises((InputError, InputTypeError), match=f"Expected {match}"):
        Configuration(**changes)


def test_the_published_configuration():
    assert Configuration(discretization="semi_implicit_euler", scaling="paper", alpha_z=25.0) == PUBLISHED


# --- identity ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ARRAYS)
def test_identity_changes_with_any_array(primitive, name):
    values = np.array(getattr(primitive, name))
    if values.ndim == 3:
        values += np.eye(values.shape[-1]) * 1e-13 * values.max()
    else:
        values.flat[0] = np.nextafter(values.flat[0], np.inf)
    assert replace(primitive, **{name: values}).identity != primitive.identity


@pytest.mark.parametrize(
    "changes",
    [
        {"configuration": Configuration(n_basis=8, alpha_z=24.0)},
        {"configuration": Configuration(n_basis=8, discretization="semi_implicit_euler")},
        {"configuration": Configuration(n_basis=8, scaling="paper")},
        {"configuration": Configuration(n_basis=8, forcing_noise="posterior")},
        {"duration": 1.23},
        {"dt": 0.02},
        {"phase_step": 0.02},
        {"n_demonstrations": 11},
        {"names": ("q0", "x")},
        {"units": "mm"},
    ],
    ids=repr,
)
def test_identity_changes_with_any_other_field(primitive, changes):
    assert replace(primitive, **changes).identity != primitive.identity


def test_identity_is_that_of_the_values(primitive):
    same = make_primitive(np.random.default_rng(0))
    assert same is not primitive
    assert same.identity == primitive.identity
    assert len(primitive.identity) == 64
    by_numpy = replace(
        primitive,
        duration=np.float64(primitive.duration),
        n_demonstrations=np.int64(10),
        configuration=Configuration(n_basis=np.int64(8), alpha_z=np.float64(25.0)),
    )
    assert by_numpy.identity == primitive.identity


# --- amplitude scaling ------------------------------------------------------------------------------------------------


def test_without_scaling_every_amplitude_is_one(primitive):
    assert primitive.scaled == (False, False)
    np.testing.assert_array_equal(primitive.amplitudes(task_for(primitive, goal=[9.0, 9.0])), [1.0, 1.0])


def test_paper_scaling_is_displacement_over_learned_displacement(primitive):
    scaled = replace(primitive, configuration=Configuration(n_basis=8, scaling="paper"), ranges=np.ones(2))
    task = task_for(scaled, [1.0, 2.0], [3.0, 1.0])
    np.testing.assert_allclose(scaled.amplitudes(task), [2.0, -1.0] / scaled.goal_displacements)
    np.testing.assert_allclose(scaled.amplitudes(task_for(scaled)), 1.0)
    unknown, mean = (task_for(scaled, [1.0, start], [3.0, 1.0]) for start in (np.nan, scaled.start[1]))
    np.testing.assert_array_equal(scaled.amplitudes(unknown), scaled.amplitudes(mean))


@pytest.mark.parametrize("sign", [-1, 1])
def test_a_degree_of_freedom_that_ends_near_its_start_is_not_scaled(primitive, sign):
    """The guard is 0.2 of the range; without it s would range over -68 .. 62 on handwriting."""
    configuration = Configuration(n_basis=8, scaling="paper")
    near = replace(
        primitive, configuration=configuration, ranges=np.array([1.0, 10.0]), goal_displacements=sign * np.array([0.19, 2.01])
    )
    assert near.scaled == (False, True)
    task = task_for(near, [0.0, 0.0], [5.0, 4.02])
    np.testing.assert_allclose(near.amplitudes(task), [1.0, sign * 2.0])
    nowhere = replace(near, goal_displacements=np.zeros(2))
    assert nowhere.scaled == (False, False)
    np.testing.assert_array_equal(nowhere.amplitudes(task), [1.0, 1.0])
