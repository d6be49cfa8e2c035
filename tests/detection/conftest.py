"""A library of three letters that was learned with its variation, and executions of it that go well or wrong."""

from dataclasses import replace

import numpy as np
import pytest

from probdmp import FailureDetector, PrimitiveLibrary
from probdmp.demonstrations import fault_named, synthetic_letters

DT = 0.02
LETTERS = "asl"
TRAINED = 6


@pytest.fixture(scope="session")
def repetitions():
    """Twelve of each letter by label, of which the first six teach."""
    demonstrations = synthetic_letters(12, letters=LETTERS, dt=DT)
    return {letter: [d for d in demonstrations if d.label == letter] for letter in LETTERS}


@pytest.fixture(scope="session")
def training(repetitions):
    return {letter: demonstrations[:TRAINED] for letter, demonstrations in repetitions.items()}


@pytest.fixture(scope="session")
def fresh(repetitions):
    """Six others of each letter, in one list."""
    return [d for demonstrations in repetitions.values() for d in demonstrations[TRAINED:]]


@pytest.fixture(scope="session")
def varied(training):
    """Primitives that know how executions vary, by label."""
    return PrimitiveLibrary.fit(training, n_basis=10, weight_model="hierarchical")


@pytest.fixture(scope="session")
def calibrated(varied, training):
    """A detector for the whole library."""
    return FailureDetector(0.02).fit(varied, training)


@pytest.fixture(scope="session")
def alone(varied, training):
    """A detector for one letter."""
    return FailureDetector(0.05).fit(varied["s"], training["s"])


def lose(positions, onset, rng):
    """Nothing measured any more."""
    lost = np.array(positions)
    lost[onset:] = np.nan
    return lost


def unseen_start(positions, onset, rng):
    """The first samples of one degree of freedom are missing."""
    late = np.array(positions)
    late[: len(late) // 12, 1] = np.nan
    return late


@pytest.fixture(scope="session")
def executions(fresh):
    """By what happens: two executions of each letter, faults from the middle on."""
    faults = {
        "fine": lambda positions, onset, rng: positions,
        "hold": fault_named("hold"),
        "hold_release": fault_named("hold_release"),
        "slow": fault_named("slow"),
        "push": fault_named("push:0.5"),
        "dropout": fault_named("dropout"),
        "stuck_sensor": fault_named("stuck_sensor"),
        "spikes": fault_named("spikes"),
        "lost": lose,
        "unseen_start": unseen_start,
    }
    chosen = [d for k, d in enumerate(fresh) if k % 6 < 2]
    return {
        name: [
            replace(d, positions=fault(d.positions, len(d.positions) // 2, np.random.default_rng(k)))
            for k, d in enumerate(chosen)
        ]
        for name, fault in faults.items()
    }
