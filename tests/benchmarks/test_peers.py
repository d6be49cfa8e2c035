"""What other packages are told is the model that is filtered here; run with the packages of `make bench-env`."""

import warnings
from importlib import import_module
from types import ModuleType

import numpy as np
import pytest
from strategies import dmp_system

from peers.system import systems_of
from probdmp.gaussian import LinearGaussianModel, filter_sequence, sample_sequences
from speed.agreement import FILTERS, TOLERANCE, compared, expected_of, in_finer_units
from speed.workload import first_systems

STEPPERS = ("filterpy", "simdkalman")


def driver(name: str) -> ModuleType:
    with warnings.catch_warnings(action="ignore"):  # what packages say of one another
        pytest.importorskip(name)
        return import_module(f"peers.{name}")


def movement(n_dof: int, seed: int = 0) -> LinearGaussianModel:
    variances = np.linspace(1e-3, 1e-2, n_dof)
    return dmp_system(np.random.default_rng(seed), n_dof=n_dof, n_steps=25, observation_variances=variances)


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("name", FILTERS)
def test_all_compute_the_same(name: str, seed: int) -> None:
    expected = expected_of(movement(1, seed))
    finer = expected_of(in_finer_units(expected.model))
    found = compared(name, driver(name), expected, finer)
    if name != "dynamax":
        assert found.within
        return
    assert found.scores is not None
    assert found.scores <= TOLERANCE
    assert compared(name, driver(name), finer, finer).within  # what it adds to variances weighs nothing there


@pytest.mark.parametrize("name", FILTERS)
def test_another_model_is_noticed(name: str) -> None:
    expected = expected_of(movement(1))
    other = expected._replace(model=movement(1, seed=1))
    assert not compared(name, driver(name), other, other).within


@pytest.mark.parametrize("name", STEPPERS)
def test_steps_are_those_of_the_filter(name: str) -> None:
    model = movement(3)
    observations = sample_sequences(model, 1, np.random.default_rng(0))[1][0]
    stepper = driver(name).stepper(systems_of(model))
    found = [stepper.step(observation) for observation in observations[..., 0]]
    expected = filter_sequence(model, observations).log_likelihoods.sum(axis=1)
    np.testing.assert_allclose(found, expected, rtol=1e-9)


@pytest.mark.parametrize("name", ["movement_primitives", "pydmps"])
def test_movements_are_followed(name: str) -> None:
    phases = np.linspace(0, 1, 100)[:, None]
    positions = np.hstack([10 * phases**3 - 15 * phases**4 + 6 * phases**5, np.sin(3 * phases)])
    if name == "movement_primitives":
        pytest.importorskip("movement_primitives.dmp")
    path = driver(name).rollout_call(positions, 0.01, 30)()
    assert path.shape == positions.shape
    assert np.abs(path - positions).max() < 0.2


def test_the_first_systems_are_filtered_alike() -> None:
    model = movement(4)
    observations = sample_sequences(model, 1, np.random.default_rng(0))[1][0]
    some = filter_sequence(first_systems(model, 2), observations[:, :2]).log_likelihoods
    np.testing.assert_array_equal(some, filter_sequence(model, observations).log_likelihoods[:, :2])
