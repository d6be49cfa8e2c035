"""The paper's rule: the same verdict online and over recordings, in any units, and only for what it was fitted to."""

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from strategies import make_primitive, seeds

from probdmp import FailureDetector, PrimitiveLibrary, ProbabilisticDMP, Verdict
from probdmp.demonstrations import Demonstration, hold, synthetic_letters
from probdmp.detection.monitoring import LikelihoodMonitor, replay
from probdmp.detection.thresholds import PaperThreshold
from probdmp.dmp import task_for
from probdmp.errors import InputError, InputTypeError, NotFittedError
from probdmp.execution import Observed, OnlineExecution, SensorArray, sample_trajectories, task_of_recording

LIKELIHOODS = ("per_step", "cumulative")


@pytest.fixture(scope="module")
def letters():
    """Six repetitions of two letters each, by label."""
    demos = synthetic_letters(6, letters="sa", dt=0.02)
    return {letter: [d for d in demos if d.label == letter] for letter in "sa"}


@pytest.fixture(scope="module")
def learned(letters):
    return ProbabilisticDMP(10).fit(letters["s"][:4])


@pytest.fixture(scope="module")
def library(learned, letters):
    return PrimitiveLibrary({"s": learned, "a": ProbabilisticDMP(10).fit(letters["a"][:4])})


@pytest.fixture(scope="module", params=LIKELIHOODS)
def detector(request, learned, letters):
    return FailureDetector(rule="paper", likelihood=request.param).fit(learned, letters["s"][:4])


@pytest.fixture(scope="module")
def executions(letters):
    """Fine ones, blocked ones, and some with gaps."""
    fine = letters["s"]
    blocked = [replace(d, positions=hold(d.positions, 25, np.random.default_rng(k))) for k, d in enumerate(fine)]
    gaps = []
    for k, d in enumerate(blocked):
        positions = np.array(d.positions)
        positions[np.random.default_rng(k).random(positions.shape) < 0.2] = np.nan
        gaps.append(replace(d, positions=positions))
    return [*fine, *blocked, *gaps]


def same(one, other, rtol=1e-9):
    assert (one.failed, one.step, one.time, one.names) == (other.failed, other.step, other.time, other.names)
    assert one.phase == pytest.approx(other.phase, rel=1e-12)
    assert one.test_ratio == pytest.approx(other.test_ratio, rel=rtol, abs=1e-9)
    np.testing.assert_allclose(one.contributions, other.contributions, rtol=rtol, atol=1e-7)


# --- laws -------------------------------------------------------------------------------------------------------------


def test_training_demonstrations_are_fine(detector, letters):
    """The worst of them has fallen half as far as is allowed, or not at all if the minimum is positive."""
    np.testing.assert_array_equal(detector.predict(letters["s"][:4]), [1, 1, 1, 1])
    (threshold,) = detector.rule_.thresholds.values()
    worst = max(v.test_ratio for v in detector.verdicts(letters["s"][:4]))
    assert worst == pytest.approx(0.5 if threshold.minimum < 0 else 0.0, rel=1e-9)


def test_the_threshold_is_the_least_statistic_of_the_training_demonstrations(detector, learned, letters):
    values = []
    for d in letters["s"][:4]:
        tracked = learned.track(d, duration=learned.primitive_.duration)
        steps = (tracked.contributions + np.log(learned.primitive_.ranges)).sum(axis=1)
        values.append(steps if detector.likelihood == "per_step" else np.cumsum(steps))
    (threshold,) = detector.rule_.thresholds.values()
    assert threshold.minimum == pytest.approx(min(v.min() for v in values), rel=1e-9)


def test_online_is_offline(detector, learned, executions):
    for execution, verdict in zip(executions, detector.verdicts(executions), strict=True):
        online = learned.execute(execution.positions[0], dt=execution.dt, detector=detector)  # goal and duration as learned
        steps = [online.step(o) for o in execution.positions]
        same(online.verdict, verdict)
        assert online.failed == verdict.failed
        ratios = [s.test_ratio for s in steps]
        alarms = np.flatnonzero(np.array(ratios) > 1)
        if verdict.failed:
            assert verdict.step == alarms[0]
            assert verdict.test_ratio == pytest.approx(ratios[alarms[0]], rel=1e-9)
        else:
            assert not len(alarms)
            assert verdict.test_ratio == pytest.approx(max(ratios), rel=1e-9, abs=1e-12)


def test_without_tasks_a_detector_knows_what_execute_knows(detector, learned, letters, executions):
    """The own first row, the learned goal, the learned duration; not how long it took in the end."""
    primitive = learned.primitive_

    def told(recordings, **known):
        return [task_for(primitive, d.positions[0], **known) for d in recordings]

    training = letters["s"][:4]
    again = FailureDetector(rule="paper", likelihood=detector.likelihood).fit(learned, training, tasks=told(training))
    assert again.state() == detector.state()
    for one, other in zip(detector.verdicts(executions), again.verdicts(executions, tasks=told(executions)), strict=True):
        same(one, other)
    hindsight = detector.verdicts(executions, tasks=[task_of_recording(primitive, d) for d in executions])
    assert any(one.test_ratio != other.test_ratio for one, other in zip(detector.verdicts(executions), hindsight, strict=True))


def test_blocked_executions_are_not_all_fine(learned, letters, executions):
    """Else nothing here has been tested."""
    detector = FailureDetector(rule="paper").fit(learned, letters["s"][:4])
    assert {v.failed for v in detector.verdicts(executions)} == {True, False}


def test_a_verdict_does_not_depend_on_what_else_is_judged(detector, executions):
    together = detector.verdicts(executions)
    for k in (0, 7, 13):
        same(detector.verdicts([executions[k]])[0], together[k])
    np.testing.assert_array_equal(detector.predict(executions), [-1 if v.failed else 1 for v in together])
    assert detector.predict(executions).dtype == np.int64


@pytest.mark.parametrize("unit", [1e-6, 1e6])
def test_units_change_no_alarm(detector, letters, executions, unit):
    def scaled(demos):
        return [replace(d, positions=d.positions * unit) for d in demos]

    other = ProbabilisticDMP(10).fit(scaled(letters["s"][:4]))
    judge = FailureDetector(rule="paper", likelihood=detector.likelihood).fit(other, scaled(letters["s"][:4]))
    for one, two in zip(detector.verdicts(executions), judge.verdicts(scaled(executions)), strict=True):
        same(one, two, rtol=1e-3)


def test_permuted_degrees_of_freedom_change_no_alarm(detector, letters, executions):
    def permuted(demos):
        return [replace(d, positions=d.positions[:, ::-1], names=("y", "x")) for d in demos]

    other = ProbabilisticDMP(10).fit(permuted(letters["s"][:4]))
    judge = FailureDetector(rule="paper", likelihood=detector.likelihood).fit(other, permuted(letters["s"][:4]))
    for one, two in zip(detector.verdicts(executions), judge.verdicts(permuted(executions)), strict=True):
        same(replace(one, contributions=one.contributions[::-1], names=("y", "x")), two, rtol=1e-6)


def test_a_movement_at_another_time_is_judged_alike(detector, executions, learned):
    """Online, with a clock that counts from 1970."""
    execution = executions[7]
    verdicts = []
    for epoch in (0.0, 1.7e9):
        online = learned.execute(execution.positions[0], duration=execution.duration, dt=0.02, detector=detector)
        for k, o in enumerate(execution.positions):
            online.step(o, epoch + k * 0.02)
        verdicts.append(online.verdict)
    same(*verdicts)


def test_the_level_is_twice_the_minimum(detector, learned):
    threshold = detector.thresholds_[learned.primitive_.identity]
    assert set(detector.thresholds_) == {learned.primitive_.identity}
    assert threshold.level == threshold.minimum - abs(threshold.minimum)


# --- missing data -----------------------------------------------------------------------------------------------------


def test_without_any_data_there_is_no_alarm(detector, learned, letters):
    execution = letters["s"][4]
    nothing = replace(execution, positions=np.full(execution.positions.shape, np.nan))
    (verdict,) = detector.verdicts([nothing])
    assert not verdict.failed
    assert verdict.test_ratio == 0
    online = learned.execute(detector=detector)
    assert [online.step().test_ratio for _ in range(200)] == [0.0] * 200
    assert not online.failed


@settings(max_examples=20)
@given(seeds, st.floats(0, 1))
def test_a_tick_without_data_is_never_the_one_that_alarms(learned, letters, seed, fraction):
    detector = FailureDetector(rule="paper").fit(learned, letters["s"][:4])
    positions, missing = np.array(letters["s"][5].positions), np.random.default_rng(seed).random(len(letters["s"][5].positions))
    positions[missing < fraction] = np.nan
    positions[40:] += 3
    online = learned.execute(letters["s"][5].positions[0], dt=0.02, detector=detector)
    for o in positions:
        step = online.step(o)
        if np.isnan(o).all():
            assert step.test_ratio == 0
    if online.failed:
        assert not np.isnan(positions[online.verdict.step]).all()


@pytest.mark.parametrize("likelihood", LIKELIHOODS)
@pytest.mark.parametrize("lost", [0, 1])
def test_a_sensor_that_is_lost_is_no_alarm_by_itself(likelihood, lost):
    """Sensors differ in precision: without the precise one, the sum over the others is smaller for no fault of theirs."""
    rng = np.random.default_rng(0)
    primitive = make_primitive(rng, observation_variances=np.array([1.0, 1e-6]), forcing_precisions=np.array([1e-2, 10.0]))
    task = task_for(primitive)
    draws = sample_trajectories(primitive, task, 0.02, 40, rng, True)
    detector = FailureDetector(rule="paper", likelihood=likelihood)
    detector.fit(primitive, draws[:20], 0.02, [task] * 20)
    np.testing.assert_array_equal(detector.predict(draws[:20], 0.02, [task] * 20), 1)
    for draw in draws[:20]:
        draw[10:, lost] = np.nan
    np.testing.assert_array_equal(detector.predict(draws[:20], 0.02, [task] * 20), 1)


@pytest.mark.parametrize("n", [25, pytest.param(100, marks=pytest.mark.slow)])
@pytest.mark.parametrize("likelihood", LIKELIHOODS)
def test_few_dropouts_in_training_demonstrations_are_hardly_an_alarm(likelihood, n, learned, letters):
    """After a gap it has strayed further than in training: with 5 % of the samples lost, 1.8 % of the recordings alarm."""
    detector = FailureDetector(rule="paper", likelihood=likelihood).fit(learned, letters["s"][:4])
    rng, failed = np.random.default_rng(0), []
    for _ in range(n):
        gaps = [np.array(d.positions) for d in letters["s"][:4]]
        for positions in gaps:
            positions[1:][rng.random(len(positions) - 1) < 0.05] = np.nan
        demos = [replace(d, positions=g) for d, g in zip(letters["s"][:4], gaps, strict=True)]
        failed += [v.failed for v in detector.verdicts(demos)]
    assert np.mean(failed) <= (0.03 if likelihood == "per_step" else 0.01)


# --- the verdict ------------------------------------------------------------------------------------------------------


def ticks(values):
    """What a monitor is shown, of one degree of freedom whose standardised log-likelihoods are given."""
    for t, value in enumerate(values):
        seen = np.array([np.nan if value is None else 0.0])
        yield Observed(t, t * 0.1, 0.9**t, seen, np.array([0.0 if value is None else value]), seen, np.ones(1))


def monitored(values, minimum=-1.0):
    monitor = LikelihoodMonitor(SensorArray(make_primitive(np.random.default_rng(0), 1)), "per_step", PaperThreshold(minimum))
    ratios = [monitor.update(observed) for observed in ticks(values)]
    return monitor.verdict, ratios


def test_the_first_alarm_is_latched():
    verdict, ratios = monitored([0.0, -1.5, -3.0, -9.0, 0.0])
    assert ratios == [0.0, 0.75, 1.5, 4.5, 0.0]
    assert (verdict.failed, verdict.step, verdict.time, verdict.test_ratio) == (True, 2, pytest.approx(0.2), 1.5)
    np.testing.assert_array_equal(verdict.contributions, [-3.0])
    assert verdict.phase == pytest.approx(0.81)


def test_without_an_alarm_the_worst_tick_is_told():
    verdict, _ = monitored([0.0, -1.2, -1.9, None, -1.5])
    assert (verdict.failed, verdict.step, verdict.test_ratio) == (False, 2, pytest.approx(0.95))


def test_exactly_at_the_threshold_is_no_alarm():
    verdict, _ = monitored([-2.0])
    assert (verdict.failed, verdict.test_ratio) == (False, 1.0)


def test_a_verdict_in_words():
    contributions, names = np.array([-1.0, -7.0]), ("x", "y")
    assert str(Verdict(True, 5, 0.25, 0.5, 2.345, contributions, names)) == (
        "failed at 0.250 s (phase 0.50): test ratio 2.35, mostly −y"
    )
    assert str(Verdict(False, 5, 0.25, 0.5, 0.123, contributions, names)).startswith("fine: largest test ratio 0.12")


def test_before_the_first_tick_nothing_is_known(detector, learned):
    online = learned.execute(detector=detector)
    assert not online.failed
    assert not online.verdict.failed
    assert online.verdict.test_ratio == 0


def test_reset_clears_the_alarm(learned, letters):
    detector = FailureDetector(rule="paper").fit(learned, letters["s"][:4])
    online = learned.execute(detector=detector)
    for _ in range(5):
        online.step([1e4, 1e4])
    assert online.failed
    online.reset()
    assert not online.failed


def test_a_monitor_serves_one_execution(learned, letters):
    """Two executions with one detector do not hear of each other."""
    detector = FailureDetector(rule="paper", likelihood="cumulative").fit(learned, letters["s"][:4])
    one, other = learned.execute(detector=detector), learned.execute(detector=detector)
    one.step([1e4, 1e4])
    assert one.failed
    assert not other.failed


def test_replay_shows_what_an_online_execution_shows(learned, letters):
    primitive, recordings = learned.primitive_, letters["s"][4:]
    tasks = [task_of_recording(primitive, r) for r in recordings]
    shown_of_each = replay(primitive, tasks, recordings, SensorArray(primitive))
    for task, recording, shown in zip(tasks, recordings, shown_of_each, strict=True):
        online = OnlineExecution(primitive, task, recording.dt)
        observed = list(shown)
        assert len(observed) == recording.n_samples
        for t, (o, position) in enumerate(zip(observed, recording.positions, strict=True)):
            step = online.step(position)
            assert (o.step, o.time) == (t, t * recording.dt)
            assert o.phase == pytest.approx(step.phase, rel=1e-12)
            np.testing.assert_array_equal(o.signals, position)
            np.testing.assert_allclose(o.innovations, step.innovations, atol=1e-9)


# --- libraries --------------------------------------------------------------------------------------------------------


def test_a_library_is_judged_by_label(library, letters):
    together = FailureDetector(rule="paper").fit(library, letters)
    mixed = [letters["s"][4], letters["a"][4], letters["s"][5], letters["a"][5]]
    verdicts = together.verdicts(mixed)
    for letter in "sa":
        alone = FailureDetector(rule="paper").fit(library[letter], letters[letter])
        own = [v for v, d in zip(verdicts, mixed, strict=True) if d.label == letter]
        for one, other in zip(own, alone.verdicts([d for d in mixed if d.label == letter]), strict=True):
            same(one, other)
    for letter in "sa":
        assert library[letter].execute(detector=together).step().test_ratio == 0


def test_tasks_go_with_their_executions(library, letters):
    detector = FailureDetector(rule="paper").fit(library, letters)
    mixed = [letters["s"][4], letters["a"][4], letters["s"][5]]
    tasks = [task_for(library[d.label].primitive_, d.positions[0], d.positions[-1], d.duration) for d in mixed]
    backwards = detector.verdicts(mixed[::-1], tasks=tasks[::-1])[::-1]
    for one, other in zip(detector.verdicts(mixed, tasks=tasks), backwards, strict=True):
        same(one, other)


def test_a_label_that_is_not_in_the_library(library, letters):
    detector = FailureDetector(rule="paper").fit(library, letters)
    with pytest.raises(InputError, match=r"executions labelled as one of \['a', 's'\], got 'z'"):
        detector.verdicts([replace(letters["s"][0], label="z")])
    with pytest.raises(InputError, match=r"executions labelled as one of \['a', 's'\], got ''"):
        detector.verdicts([letters["s"][0].positions], dt=0.02)


@pytest.mark.parametrize("given_demos", ["list", "other label"])
def test_a_library_needs_demonstrations_by_label(library, letters, given_demos):
    demos = letters["s"] if given_demos == "list" else {"s": letters["s"]}
    with pytest.raises(InputError, match=r"demonstrations by label for each of \['a', 's'\], got"):
        FailureDetector(rule="paper").fit(library, demos)


# --- what it was fitted to --------------------------------------------------------------------------------------------


def test_unfitted(learned, letters):
    detector = FailureDetector(rule="paper")
    for use in (
        lambda: detector.predict(letters["s"]),
        lambda: detector.verdicts(letters["s"]),
        lambda: detector.monitor(learned.primitive_, task_for(learned.primitive_), 0.02),
        lambda: detector.thresholds_,
        lambda: learned.execute(detector=detector),
        detector.state,
    ):
        with pytest.raises(NotFittedError, match=r"a fitted detector, got one without thresholds\. Call fit"):
            use()


def test_a_primitive_that_was_not_learned(letters):
    with pytest.raises(NotFittedError, match=r"a learned primitive.*Call fit"):
        FailureDetector(rule="paper").fit(ProbabilisticDMP(), letters["s"])


def test_a_foreign_primitive(learned, letters):
    detector = FailureDetector(rule="paper").fit(learned, letters["s"][:4])
    again = ProbabilisticDMP(10).fit(letters["s"][:5])
    with pytest.raises(InputError, match=r"a primitive that this detector was fitted to, got another one\. Learned anew\?"):
        again.execute(detector=detector)
    twin = ProbabilisticDMP(10).fit(letters["s"][:4])  # the same primitive, learned again: known by its identity
    assert twin.execute(detector=detector).step().test_ratio == 0


def test_a_fit_that_fails_leaves_the_detector_as_it_was(library, letters):
    detector = FailureDetector(rule="paper").fit(library["s"], letters["s"])
    before = detector.verdicts(letters["s"])
    with pytest.raises(InputError, match="recordings of 2 degrees of freedom"):
        detector.fit(library["a"], [np.zeros((20, 3))])
    for one, other in zip(before, detector.verdicts(letters["s"]), strict=True):
        same(one, other)


@pytest.mark.parametrize("argument", ["rule", "likelihood"])
def test_choices_are_checked_when_fitting(learned, letters, argument):
    detector = FailureDetector(**{"rule": "paper", argument: "guess"})
    with pytest.raises(InputError, match=f"{argument} to be one of .*, got 'guess'"):
        detector.fit(learned, letters["s"])


def test_executions_of_other_degrees_of_freedom(detector):
    with pytest.raises(InputError, match=r"recordings of 2 degrees of freedom \(x, y\), got one with 3"):
        detector.verdicts([np.zeros((20, 3))])


def test_bare_arrays_take_the_learned_dt(detector, letters):
    bare = [d.positions for d in letters["s"]]
    for one, other in zip(detector.verdicts(bare), detector.verdicts(letters["s"]), strict=True):
        same(one, other)
    explicit = detector.verdicts(bare, dt=0.02)
    assert [v.time for v in explicit] == [v.time for v in detector.verdicts(letters["s"])]


# --- state ------------------------------------------------------------------------------------------------------------


def test_state_is_plain_and_restores_the_same_detector(detector, learned, executions):
    state = json.loads(json.dumps(detector.state()))
    assert state == detector.state()
    again = FailureDetector.from_state(state, {"": learned.primitive_})
    assert (again.rule, again.likelihood) == (detector.rule, detector.likelihood)
    for one, other in zip(detector.verdicts(executions), again.verdicts(executions), strict=True):
        assert (one.failed, one.step, one.test_ratio) == (other.failed, other.step, other.test_ratio)
        np.testing.assert_array_equal(one.contributions, other.contributions)


@pytest.mark.parametrize(
    ("damage", "match"),
    [
        ({"rule": "none"}, "rule to be one of 'calibrated', 'paper', got 'none'"),
        ({"rule": None}, "rule to be one of"),
        ({"rule": ["paper"]}, "rule to be one of"),
        ({"likelihood": 3}, "likelihood to be one of"),
        ({"minima": None}, "a detector with"),
        ({"minima": 3}, "a detector with"),
        ({"minima": {}}, "a minimum for each primitive"),
        ({"minima": {"": 1.0}}, "a minimum for each primitive"),
        ({"surplus": 1}, "a detector with"),
    ],
    ids=repr,
)
def test_a_damaged_state_is_refused(detector, learned, damage, match):
    with pytest.raises((InputError, InputTypeError), match=f"Expected {match}"):
        FailureDetector.from_state({**detector.state(), **damage}, {"": learned.primitive_})


@pytest.mark.parametrize("minimum", [np.nan, -np.inf, "low", [1.0], None, 1e101, {}], ids=repr)
def test_a_damaged_minimum_is_refused(detector, learned, minimum):
    state = detector.state()
    state["minima"] = dict.fromkeys(state["minima"], minimum)
    with pytest.raises((InputError, InputTypeError), match="Expected minimum"):
        FailureDetector.from_state(state, {"": learned.primitive_})


def test_minima_without_their_values_are_refused(detector, learned):
    state = detector.state()
    with pytest.raises((InputError, InputTypeError), match="Expected"):
        FailureDetector.from_state({**state, "minima": list(state["minima"])}, {"": learned.primitive_})


def test_an_empty_state_is_refused(learned):
    with pytest.raises(InputError, match="rule to be one of 'calibrated', 'paper', got None"):
        FailureDetector.from_state({}, {"": learned.primitive_})
    with pytest.raises(InputError, match="a detector with a likelihood and minima"):
        FailureDetector.from_state({"rule": "paper", "sensors": None}, {"": learned.primitive_})


def test_a_state_for_other_primitives_is_refused(detector, library):
    for primitives in ({"": library["a"].primitive_}, {label: p.primitive_ for label, p in library.items()}):
        with pytest.raises(InputError, match="a minimum for each primitive"):
            FailureDetector.from_state(detector.state(), primitives)


def test_demonstrations_that_were_never_measured_cannot_calibrate(learned):
    """No statistic, no threshold: an infinite one would never alarm and could not be saved."""
    with pytest.raises(InputError, match=r"Expected .*measured"):
        FailureDetector(rule="paper").fit(learned, [Demonstration(np.full((20, 2), np.nan), 0.02)])
