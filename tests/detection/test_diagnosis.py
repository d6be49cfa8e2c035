"""What an alarm says of its reason, and what else is remembered of an execution: only so much."""

import pickle
from dataclasses import replace

import numpy as np
import pytest
from detection.verdicts import task_of

from probdmp import FailureDetector, PrimitiveLibrary
from probdmp.demonstrations import WriterVariation, fault_named, synthetic_letters
from probdmp.demonstrations.smoothing import sampled_between
from probdmp.execution import OnlineExecution

DT = 0.01


@pytest.fixture(scope="module")
def writing():
    """A careful writer's letters, ten of each: eight to learn from, two more."""
    careful = WriterVariation(shape=0.01, size=0.02, aspect=0.02, slant=1.0, tempo=0.02, timing=0.005)
    demos = synthetic_letters(10, letters="se", dt=DT, variation=careful)
    return {letter: [d for d in demos if d.label == letter] for letter in "se"}


@pytest.fixture(scope="module")
def library(writing):
    training = {letter: demos[:8] for letter, demos in writing.items()}
    return PrimitiveLibrary.fit(training, n_basis=12, weight_model="hierarchical")


@pytest.fixture(scope="module")
def detector(writing, library):
    return FailureDetector(0.05).fit(library, {letter: demos[:8] for letter, demos in writing.items()})


@pytest.fixture(scope="module")
def fresh(writing):
    return [d for demos in writing.values() for d in demos[8:]]


def paced(recording, onset, speed):
    """The same path, at another speed from the onset on, up to its end; with noise that is measured anew."""
    last = len(recording.positions) - 1
    instants = np.concatenate([np.arange(onset), np.arange(onset, last, speed)])
    positions = sampled_between(recording.positions, instants)
    return replace(recording, positions=positions + 0.02 * np.random.default_rng(0).standard_normal(positions.shape))


def reasons(detector, library, originals, recordings):
    """Verdicts a little after the alarms of executions that were told to go as the originals: later it may look otherwise."""
    tasks = [task_of(library[d.label].primitive_, d, True) for d in originals]
    ends = [
        v.step + round(0.14 * len(d.positions))
        for v, d in zip(detector.verdicts(recordings, tasks=tasks), originals, strict=True)
    ]
    return detector.verdicts(
        [replace(r, positions=r.positions[:end]) for r, end in zip(recordings, ends, strict=True)], tasks=tasks
    )


def mostly(verdicts, kind, cause):
    assert sum(v.failed for v in verdicts) >= len(verdicts) - 1
    assert sum((v.kind, v.cause) == (kind, cause) for v in verdicts if v.failed) >= len(verdicts) - 1, [
        str(v) for v in verdicts
    ]


def test_held(detector, library, fresh):
    held = [replace(d, positions=fault_named("hold")(d.positions, 50, np.random.default_rng(k))) for k, d in enumerate(fresh)]
    mostly(reasons(detector, library, fresh, held), "timing", "held")


def test_slow(detector, library, fresh):
    mostly(reasons(detector, library, fresh, [paced(d, 40, 0.5) for d in fresh]), "timing", "slow")


def test_fast(detector, library, fresh):
    mostly(reasons(detector, library, fresh, [paced(d, 40, 2.0) for d in fresh]), "timing", "fast")


def test_off_the_path(detector, library, fresh):
    """Pushed aside, and not back."""
    astray = []
    for k, d in enumerate(fresh):
        aside = np.zeros(d.positions.shape)
        aside[40:] = 6.0 * np.minimum(np.arange(len(d.positions) - 40) / 15, 1)[:, None] * [(-1) ** k, 1]
        astray.append(replace(d, positions=d.positions + aside))
    verdicts = reasons(detector, library, fresh, astray)
    mostly(verdicts, "motion", "off the path")
    for v in verdicts:
        assert v.time > 40 * DT
        assert len(v.blamed) == 2


def test_another_movement_is_recognised(detector, library, fresh):
    """Moved to the start that was commanded, and said by name."""
    swapped = []
    for d in fresh:
        (*_, other) = (o for o in fresh if o.label != d.label)
        swapped.append(replace(other, positions=other.positions - other.positions[0] + d.positions[0], label=d.label))
    primitives = {label: item.primitive_ for label, item in library.items()}
    verdicts = detector.verdicts(swapped, tasks=[task_of(primitives[d.label], d, False) for d in fresh])
    assert all(v.failed for v in verdicts)
    for verdict, d in zip(verdicts, fresh, strict=True):
        if verdict.kind == "motion":
            assert verdict.better in ("", *({"s", "e"} - {d.label}))
    assert sum(v.better != "" for v in verdicts) >= 2, [str(v) for v in verdicts]


def test_a_fine_execution_has_no_reason(detector, library, fresh):
    for verdict in reasons(detector, library, fresh, fresh):
        if not verdict.failed:
            assert (verdict.kind, verdict.cause, verdict.better) == ("", "", "")


@pytest.mark.parametrize("fault", ["none", "hold"])
def test_memory_does_not_grow_with_time(detector, library, fresh, fault):
    """An execution that lasts ten times as long as it should, alarm or not: as large as after twice as long."""
    d = fresh[0]
    primitive = library[d.label].primitive_
    rng, n = np.random.default_rng(0), len(d.positions)
    rows = d.positions if fault == "none" else fault_named("hold")(d.positions, n // 2, rng)
    execution = OnlineExecution(primitive, task_of(primitive, d, True), d.dt, detector)
    monitor, sizes = execution._monitor, []
    expectation = monitor._source._expectation
    for t in range(10 * n):
        row = rows[t] if t < n else rows[-1] + 0.02 * rng.standard_normal(2)
        execution.step(row)
        if t in (3 * n, 10 * n - 1):
            monitor._source._expectation = None  # what is known of all executions is not this one's memory
            sizes.append(
                len(pickle.dumps(vars(monitor._source))) - len(pickle.dumps(vars(monitor._source)["_follower"]._trajectory))
            )
            monitor._source._expectation = expectation
    assert sizes[1] <= sizes[0] * 1.02 + 500
    assert execution.failed or fault == "none"
