"""The calibrated rule: one verdict online and over recordings, for every statistic, task and kind of failure."""

import numpy as np
import pytest
from detection.verdicts import assert_same, run_online, task_of

from probdmp import FailureDetector, ProbabilisticDMP
from probdmp.demonstrations import Demonstration
from probdmp.dmp import task_for
from probdmp.errors import InputError

KINDS = ("fine", "hold", "hold_release", "slow", "push", "dropout", "stuck_sensor", "spikes", "lost", "unseen_start")


def assert_online_is_offline(detector, primitives, recordings, told):
    tasks = [task_of(primitives[r.label].primitive_, r, told) for r in recordings]
    for recording, task, verdict in zip(recordings, tasks, detector.verdicts(recordings, tasks=tasks), strict=True):
        execution, _ = run_online(primitives[recording.label].primitive_, task, recording, detector)
        assert_same(execution.verdict, verdict)
        assert execution.failed == verdict.failed


@pytest.mark.parametrize(
    ("kind", "told"),
    [
        pytest.param(kind, told, id=f"{kind}-{name}", marks=[pytest.mark.slow] if (k + told) % 2 else [])
        for k, kind in enumerate(KINDS)
        for told, name in ((True, "known"), (False, "nominal"))
    ],
)
def test_online_is_offline(calibrated, varied, executions, kind, told):
    chosen = (KINDS.index(kind) + 3 * told) % 6
    assert_online_is_offline(calibrated, varied, executions[kind][chosen : chosen + 1], told)


@pytest.mark.parametrize("kind", ["fine", "hold", "dropout"])
@pytest.mark.parametrize("told", [True, False])
def test_online_is_offline_for_one_primitive(alone, varied, executions, kind, told):
    assert_online_is_offline(alone, varied, [d for d in executions[kind] if d.label == "s"][:1], told)


def test_online_is_offline_with_joint_weights(training, executions):
    """The trajectory is judged by what was measured, not by how it is filtered."""
    learned = ProbabilisticDMP(10, weight_model="hierarchical", weight_uncertainty="joint").fit(training["l"])
    detector = FailureDetector().fit(learned, training["l"])
    chosen = [d for kind in ("fine", "hold", "dropout") for d in executions[kind] if d.label == "l"]
    assert_online_is_offline(detector, {"l": learned}, chosen[:1] + chosen[2:3] + chosen[4:5], True)


@pytest.mark.parametrize(
    ("statistic", "weight_model"),
    [("nis", "pooled"), ("nis", "hierarchical"), ("cusum", "pooled"), ("log_likelihood", "pooled")],
)
def test_every_statistic_is_calibrated_and_the_same_online(training, executions, statistic, weight_model):
    learned = ProbabilisticDMP(8, weight_model=weight_model).fit(training["l"])
    detector = FailureDetector(0.1, statistic=statistic).fit(learned, training["l"])
    for by_label in detector.rule_.calibrations.values():
        assert by_label[""].n == len(training["l"])
        assert np.all(by_label[""].maxima >= 0)
    chosen = []
    for told in (True, False):
        chosen = [next(d for d in executions[kind] if d.label == "l") for kind in ("fine", "hold", "dropout")]
        assert_online_is_offline(detector, {"l": learned}, chosen, told)
    assert {v.channel for v in detector.verdicts(chosen)} <= {statistic, ""}


def test_a_verdict_does_not_depend_on_what_else_is_judged(calibrated, executions):
    everything = [d for kind in KINDS for d in executions[kind][::3]]
    together = calibrated.verdicts(everything)
    for k in (0, 3, 10, 11):
        assert_same(calibrated.verdicts([everything[k]])[0], together[k])
    np.testing.assert_array_equal(calibrated.predict(everything), [-1 if v.failed else 1 for v in together])


def test_what_goes_wrong_is_noticed_and_what_goes_well_is_not(calibrated, varied, executions):
    """Else the laws hold of nothing. What a failure is about is said with it."""

    def verdicts(kind):
        tasks = [task_of(varied[r.label].primitive_, r, kind == "fine") for r in executions[kind]]
        return calibrated.verdicts(executions[kind], tasks=tasks)

    assert sum(v.failed for v in verdicts("fine")) <= 1
    assert sum(v.failed for v in verdicts("dropout") if v.kind != "data missing") <= 1
    for kind, of in (("hold", "timing"), ("stuck_sensor", "sensor"), ("lost", "data missing")):
        found = verdicts(kind)
        assert sum(v.failed for v in found) >= 5, kind
        assert sum(v.kind == of for v in found) >= 4, kind
        assert all(v.has_sensor_fault == (v.kind == "sensor") for v in found)
    assert all(v.is_stale for v in found)


@pytest.mark.parametrize("kind", ["hold", "slow", "push", "lost"])
def test_until_something_happens_all_is_as_if_nothing_did(calibrated, executions, kind):
    recordings, faulty_ones = executions["fine"][::2], executions[kind][::2]
    for recording, fine, faulty in zip(
        recordings, calibrated.verdicts(recordings), calibrated.verdicts(faulty_ones), strict=True
    ):
        if faulty.failed and not fine.failed:
            assert faulty.step >= len(recording.positions) // 2


def test_recordings_without_a_complete_tick(calibrated, training):
    """Nothing is known of them, and nothing is claimed."""
    nothing = Demonstration(np.full((3, 2), np.nan), 0.001, "s", ("x", "y"), "mm")
    for recordings in ([nothing], [nothing, training["s"][0]]):
        verdict = calibrated.verdicts(recordings)[0]
        assert not verdict.failed
        assert verdict.test_ratio == 0


def test_a_goal_that_was_not_calibrated_for_is_refused(varied, training):
    primitive = varied["s"].primitive_
    told = [task_of(primitive, d, True) for d in training["s"]]
    untold = [task_of(primitive, d, False) for d in training["s"]]
    for tasks, other, words in ((told, untold, "that do not tell their goal"), (untold, told, "that tell their goal")):
        detector = FailureDetector().fit(varied["s"], training["s"], tasks=tasks)
        assert len(detector.verdicts(training["s"], tasks=tasks)) == len(tasks)
        with pytest.raises(InputError, match=f"a detector calibrated on executions {words}"):
            detector.verdicts(training["s"], tasks=other)
        with pytest.raises(InputError, match=f"a detector calibrated on executions {words}"):
            detector.monitor(primitive, other[0], 0.02)
    with pytest.raises(InputError, match="tasks that all tell the goal, or that all do not"):
        FailureDetector().fit(varied["s"], training["s"], tasks=told[:3] + untold[3:])


def test_pooled_or_each_by_itself(calibrated, alone, varied, training, fresh):
    """The same values, together or apart."""
    single = FailureDetector(0.05, pooled=False).fit(varied, training)
    for mode in (True, False):
        assert set(calibrated.rule_.calibrations[mode]) == {""}
        assert set(single.rule_.calibrations[mode]) == set(varied)
        together = calibrated.rule_.calibrations[mode][""]
        for label, own in single.rule_.calibrations[mode].items():
            np.testing.assert_allclose(own.maxima, together.maxima[[name == label for name in together.labels]], rtol=1e-9)
        assert alone.rule_.calibrations[mode][""].threshold == pytest.approx(single.rule_.calibrations[mode]["s"].threshold)
    chosen = [d for d in fresh if d.label == "s"]
    for one, other in zip(single.verdicts(chosen), alone.verdicts(chosen), strict=True):
        assert_same(one, other)


def test_who_is_not_told_the_goal_is_judged_as_such(calibrated, varied, executions):
    """With independent weights too."""
    fine = executions["fine"]
    untold = [task_for(varied[d.label].primitive_, d.positions[0]) for d in fine]
    for task, d in zip(untold, fine, strict=True):
        calibration = calibrated.rule_.calibration(varied[d.label].primitive_, task)
        assert calibration is calibrated.rule_.calibrations[False][""]
    assert not any(v.failed for v in calibrated.verdicts(fine, tasks=untold))
    for one, other in zip(calibrated.verdicts(fine), calibrated.verdicts(fine, tasks=untold), strict=True):
        assert_same(one, other)


def test_leaving_one_out_is_learning_without_it(varied, training):
    """The channels of a demonstration as the others would have it, not as in training: larger on the whole."""
    detector = FailureDetector().fit(varied["s"], training["s"])
    family, calibration = detector.rule_.family, detector.rule_.calibrations[False][""]
    primitive = varied["s"].primitive_
    tasks = [task_for(primitive, d.positions[0]) for d in training["s"]]
    in_sample = []
    for source, ticks in family.replay(primitive, tasks, training["s"]):
        values = [value for observed in ticks for value in source.update(observed)]
        in_sample.append(np.nanmax(values, axis=0))
    assert np.mean(calibration.maxima[:, 0] >= np.array(in_sample)[:, 0]) >= 0.8
