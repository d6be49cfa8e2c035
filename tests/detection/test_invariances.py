"""Units, place, pace and the order of degrees of freedom change no verdict."""

from dataclasses import replace

import numpy as np
import pytest
from detection.verdicts import assert_same, task_of, transformed

from probdmp import FailureDetector, ProbabilisticDMP

KINDS = ("fine", "hold", "push", "spikes", "dropout")


def judged(training, executions, told, rate=0.01):
    """Verdicts by a detector and a primitive that know nothing but the training."""
    learned = ProbabilisticDMP(8, weight_model="hierarchical").fit(training)
    detector = FailureDetector(rate).fit(learned, training)
    return detector.verdicts(executions, tasks=[task_of(learned.primitive_, d, told) for d in executions])


@pytest.fixture(scope="module")
def chosen(executions):
    """One execution of each kind of the letter l."""
    return [next(d for d in executions[kind] if d.label == "l") for kind in KINDS]


@pytest.fixture(scope="module")
def verdicts(training, chosen):
    """By whether goals are told."""
    found = {told: judged(training["l"], chosen, told) for told in (True, False)}
    assert any(v.failed for v in found[True])
    return found


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"factors": 1000.0}, False),
        ({"factors": np.array([1e3, -1e-2])}, True),
        ({"offsets": np.array([300.0, -500.0])}, True),
        ({"slower": 10.0}, False),
        ({"factors": 1e-3, "slower": 0.01}, True),
    ],
    ids=str,
)
def test_units_place_and_pace_change_no_verdict(training, chosen, verdicts, change, told):
    found = judged(transformed(training["l"], **change), transformed(chosen, **change), told)
    signs = np.sign(np.broadcast_to(change.get("factors", 1.0), 2))
    for one, other in zip(verdicts[told], found, strict=True):
        assert_same(replace(one, contributions=one.contributions * signs), other, 2e-3, change.get("slower", 1.0))


def test_the_order_of_degrees_of_freedom_is_that_of_the_contributions(training, chosen, verdicts):
    order = [1, 0]
    found = judged(transformed(training["l"], order=order), transformed(chosen, order=order), True)
    for one, other in zip(verdicts[True], found, strict=True):
        assert_same(replace(one, contributions=one.contributions[order], names=("y", "x")), other, 2e-3)
        assert one.blamed == other.blamed


def test_who_else_is_in_the_library_changes_no_value(calibrated, alone):
    """Only the threshold is shared."""
    for mode in (True, False):
        together, by_itself = calibrated.rule_.calibrations[mode][""], alone.rule_.calibrations[mode][""]
        own = [label == "s" for label in together.labels]
        np.testing.assert_allclose(together.maxima[own], by_itself.maxima, rtol=1e-9)


def test_the_order_of_demonstrations_does_not_matter(training, chosen, verdicts):
    for one, other in zip(verdicts[True], judged(training["l"][::-1], chosen, True), strict=True):
        assert_same(one, other, 1e-4)


def test_other_labels_and_units_written_down_do_not_matter(training, chosen, verdicts):
    found = judged(
        [replace(d, units="inch") for d in training["l"]], [replace(d, units="inch", label="") for d in chosen], True
    )
    for one, other in zip(verdicts[True], found, strict=True):
        assert_same(one, other, 1e-9)


def test_twice_the_sampling_rate_hardly_changes_a_verdict(calibrated, varied, executions):
    """Interpolated without new noise: ticks of the movement are judged, not samples."""
    fine = executions["fine"]
    finer = []
    for d in fine:
        at = np.arange(2 * len(d.positions) - 1) / 2
        positions = np.stack([np.interp(at, np.arange(len(d.positions)), column) for column in d.positions.T], axis=1)
        finer.append(replace(d, positions=positions, dt=d.dt / 2))
    one, other = (
        calibrated.verdicts(group, tasks=[task_of(varied[d.label].primitive_, d, True) for d in group])
        for group in (fine, finer)
    )
    for slow, fast in zip(one, other, strict=True):
        assert slow.failed == fast.failed
        assert fast.test_ratio == pytest.approx(slow.test_ratio, rel=1e-6, abs=1e-6)
