"""What a detector may be fitted to, what it refuses, and that a file brings it back as it was."""

import json
import pickle
from dataclasses import replace

import numpy as np
import pytest
from detection.damage import JUNK, damaged, places, with_surplus
from detection.verdicts import assert_same, task_of
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from strategies import PAPERS_WEIGHTS

from probdmp import FailureDetector, PrimitiveLibrary, ProbabilisticDMP, load, load_detector
from probdmp.demonstrations import Demonstration
from probdmp.dmp import task_for
from probdmp.errors import InputError, InputTypeError, NotFittedError, TooFewDemonstrationsError


@pytest.fixture(scope="module")
def pooled_weights(training):
    return ProbabilisticDMP(8, **PAPERS_WEIGHTS).fit(training["l"])


@pytest.fixture(scope="module")
def chosen(executions):
    return [executions[kind][k] for k, kind in ((2, "fine"), (5, "hold"), (3, "spikes"), (4, "dropout"), (2, "lost"))]


# --- who taught -------------------------------------------------------------------------------------------------------


def test_leaving_out_what_was_never_in_is_refused(varied, training, fresh):
    others = [d for d in fresh if d.label == "s"]
    with pytest.raises(
        InputError, match=r'the demonstrations that taught the primitive, got 6 others\..*calibration="held_out"'
    ):
        FailureDetector().fit(varied["s"], others)
    with pytest.raises(InputError, match=r"got 1 others of 'l'"):
        FailureDetector().fit(varied, {**training, "l": [*training["l"], replace(others[0], label="l")]})


def test_holding_out_what_taught_is_refused(varied, training, fresh):
    others = [d for d in fresh if d.label == "s"]
    with pytest.raises(InputError, match=r'that did not teach the primitive, got 6 that did\..*calibration="leave_one_out"'):
        FailureDetector(calibration="held_out").fit(varied["s"], training["s"])
    with pytest.raises(InputError, match="got 1 that did"):
        FailureDetector(calibration="held_out").fit(varied["s"], [*others, training["s"][0]])


def test_others_can_be_held_out(varied, fresh):
    """The calibration is what the detector finds on them; in their order or another."""
    others = [d for d in fresh if d.label == "s"]
    detector = FailureDetector(0.2, calibration="held_out").fit(varied["s"], others)
    calibration = detector.rule_.calibrations[False][""]
    assert (calibration.n, calibration.method) == (6, "held_out")
    statistics = [v.test_ratio * calibration.threshold for v in detector.verdicts(others)]
    fine = [not v.failed for v in detector.verdicts(others)]
    np.testing.assert_allclose(np.array(statistics)[fine], calibration.statistics[fine], rtol=1e-9)
    again = FailureDetector(0.2, calibration="held_out").fit(varied["s"], others[::-1])
    assert again.rule_.calibrations[False][""].threshold == pytest.approx(calibration.threshold, rel=1e-9)


def test_a_bare_primitive_is_taken_at_its_word(alone, varied, training):
    """Nobody knows what taught it."""
    bare = FailureDetector(0.05).fit(varied["s"].primitive_, training["s"])
    assert bare.state() == alone.state()


@pytest.mark.parametrize("library", [True, False])
def test_pooled_weights_cannot_say_how_executions_vary(pooled_weights, training, library):
    learned, demos = ({"l": pooled_weights}, training) if library else (pooled_weights, training["l"])
    wanted = (
        r'primitives that know how executions vary, got .*weight_model="hierarchical", or use rule="paper" or statistic="nis"'
    )
    with pytest.raises(InputError, match=wanted):
        FailureDetector().fit(learned, demos)
    FailureDetector(rule="paper").fit(learned, demos)
    FailureDetector(statistic="nis").fit(learned, demos)


@pytest.mark.parametrize("statistic", ["trajectory", "nis"])
def test_one_demonstration_cannot_be_left_out(training, statistic):
    learned = ProbabilisticDMP(8, weight_model="hierarchical").fit(training["l"][:1])
    with pytest.raises(TooFewDemonstrationsError, match=r'two or more demonstrations to leave one out.*calibration="held_out"'):
        FailureDetector(statistic=statistic).fit(learned, training["l"][:1])


@pytest.mark.parametrize("statistic", ["trajectory", "nis", "cusum", "log_likelihood"])
def test_two_demonstrations_are_enough_to_begin_with(training, statistic):
    learned = ProbabilisticDMP(8, weight_model="hierarchical").fit(training["l"][:2])
    detector = FailureDetector(statistic=statistic).fit(learned, training["l"][:2])
    assert detector.rule_.calibrations[False][""].guarantee == "model-based, not guaranteed"
    assert all(np.isfinite(v.test_ratio) for v in detector.verdicts(training["l"]))


@pytest.mark.parametrize("statistic", ["trajectory", "nis"])
def test_what_was_never_measured_cannot_calibrate(varied, training, statistic):
    silent = [replace(d, positions=np.where([True, False], np.nan, d.positions)) for d in training["s"]]
    with pytest.raises(InputError, match=r"measured"):
        FailureDetector(calibration="held_out", statistic=statistic).fit(varied["s"], silent)


# --- bad input --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("rate", [0, 1, -0.1, 2, np.nan, np.inf, "0.01", None, True, [0.01], np.array([0.1, 0.2])], ids=repr)
def test_a_rate_that_is_none_is_refused(varied, training, rate):
    with pytest.raises((InputError, InputTypeError), match="Expected false_alarm_rate"):
        FailureDetector(rate).fit(varied["s"], training["s"])


@pytest.mark.parametrize("argument", ["rule", "statistic", "calibration"])
@pytest.mark.parametrize("name", ["guess", "", None, 3, ["nis"]], ids=repr)
def test_unknown_names_are_refused(varied, training, argument, name):
    with pytest.raises(InputError, match=f"{argument} to be one of .*, got"):
        FailureDetector(**{argument: name}).fit(varied["s"], training["s"])


@pytest.mark.parametrize("persistence", [0, -1, 1.5, 10_000, "3", None, True], ids=repr)
def test_a_persistence_that_is_none_is_refused(varied, training, persistence):
    with pytest.raises((InputError, InputTypeError), match="Expected persistence as a whole number from 1 to 100"):
        FailureDetector(persistence=persistence).fit(varied["s"], training["s"])


@pytest.mark.parametrize("pooled", [None, 1, "yes", [True], np.nan], ids=repr)
def test_pooled_is_yes_or_no(varied, training, pooled):
    with pytest.raises(InputTypeError, match="Expected pooled as True or False, got"):
        FailureDetector(pooled=pooled).fit(varied["s"], training["s"])


def test_recordings_of_the_wrong_shape_are_refused(alone, varied, training):
    for use in (alone.verdicts, alone.predict, lambda given: FailureDetector().fit(varied["s"].primitive_, given)):
        for wrong in ([np.zeros((20, 3))], [np.zeros(20)], [np.zeros((0, 2))], np.zeros((2, 20, 3)), "letters", [None], 3):
            with pytest.raises((InputError, InputTypeError)):
                use(wrong)


def test_tasks_of_the_wrong_number_are_refused(alone, varied, training):
    tasks = [task_for(varied["s"].primitive_)] * 2
    with pytest.raises(InputError):
        alone.verdicts(training["s"], tasks=tasks)
    with pytest.raises(InputError):
        FailureDetector().fit(varied["s"], training["s"], tasks=tasks)


def test_what_was_not_fitted_cannot_judge(varied, training):
    detector, primitive = FailureDetector(), varied["s"].primitive_
    for use in (
        lambda: detector.predict(training["s"]),
        lambda: detector.monitor(primitive, task_for(primitive), 0.02),
        lambda: varied["s"].execute(detector=detector),
        detector.state,
    ):
        with pytest.raises(NotFittedError, match="a fitted detector"):
            use()


def test_another_primitive_is_refused(alone, varied):
    with pytest.raises(InputError, match="a primitive that this detector was fitted to, got another one"):
        varied["a"].execute(detector=alone)


def test_a_fit_that_fails_leaves_the_detector_as_it_was(varied, training):
    detector = FailureDetector().fit(varied["s"], training["s"])
    before = detector.state()
    for learned, demos in ((varied["a"], training["a"][:1]), (varied["a"], training["s"]), (varied, {"s": training["s"]})):
        with pytest.raises(InputError):
            detector.fit(learned, demos)
    assert detector.state() == before
    assert set(detector.primitives_) == {""}
    assert dict(detector.thresholds_) == {}  # those are the paper's


# --- files ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "arguments", [{}, {"pooled": False, "persistence": 2}, {"statistic": "nis"}, {"rule": "paper"}], ids=str
)
def test_a_file_brings_the_detector_back(tmp_path, varied, training, chosen, arguments):
    """With the whole library or, where that would take long, one of it."""
    library = varied if arguments.get("rule") == "paper" else PrimitiveLibrary({"l": varied["l"]})
    chosen = [d for d in chosen if d.label in library]
    detector = FailureDetector(0.05, **arguments).fit(library, training)
    library.save(tmp_path / "letters.probdmp", detector)
    again, primitives = load_detector(tmp_path / "letters.probdmp"), PrimitiveLibrary.load(tmp_path / "letters.probdmp")
    assert again.state() == detector.state() == json.loads(json.dumps(detector.state()))
    for name in ("rule", "false_alarm_rate", "statistic", "calibration", "pooled", "persistence", "likelihood"):
        if arguments.get("rule") != "paper" or name in ("rule", "likelihood"):
            assert getattr(again, name) == getattr(detector, name)
    for told in (True, False):
        tasks = [task_of(primitives[d.label].primitive_, d, told) for d in chosen]
        for one, other in zip(detector.verdicts(chosen, tasks=tasks), again.verdicts(chosen, tasks=tasks), strict=True):
            assert_same(one, other, 1e-12)


def test_a_single_primitive_and_its_detector_in_one_file(tmp_path, varied, alone, executions):
    """The same verdicts online."""
    varied["s"].save(tmp_path / "s.probdmp", alone)
    learned, detector = load(tmp_path / "s.probdmp"), pickle.loads(pickle.dumps(load_detector(tmp_path / "s.probdmp")))
    held = next(d for d in executions["hold"] if d.label == "s")
    verdicts = []
    for primitive, judge in ((varied["s"], alone), (learned, detector)):
        execution = primitive.execute(held.positions[0], dt=held.dt, detector=judge)
        for row in held.positions:
            execution.step(row)
        verdicts.append(execution.verdict)
    assert_same(*verdicts, 1e-12)


# --- damage -----------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def states(alone, calibrated, varied, pooled_weights, training):
    """States of detectors, each with the primitives it is for."""
    one = {"": pooled_weights.primitive_}
    paper = FailureDetector(rule="paper").fit(pooled_weights, training["l"])
    nis = FailureDetector(statistic="nis").fit(pooled_weights, training["l"])
    single = FailureDetector(pooled=False).fit(varied["s"], training["s"])
    return [
        (alone.state(), alone.primitives_),
        (calibrated.state(), calibrated.primitives_),
        (single.state(), single.primitives_),
        (paper.state(), one),
        (nis.state(), one),
    ]


@settings(max_examples=150)
@given(
    st.integers(0, 4), st.integers(0, 10**6), st.sampled_from(["missing", "extra", "junk"]), st.sampled_from(range(len(JUNK)))
)
def test_a_damaged_state_is_refused_or_of_use(states, which, piece, kind, junk):
    """Never an error of another kind, then or later; what is missing is always noticed, and what is too much."""
    state, primitives = states[which]
    paths = [path for path in places(state) if path]
    path = paths[piece % len(paths)]
    assume(kind != "missing" or path[-1] not in ("known", "nominal"))  # a detector may be for executions of one kind
    if kind == "missing":
        broken = damaged(state, path, None)
    elif kind == "extra":
        broken = damaged(state, path, with_surplus)
    else:
        broken = damaged(state, path, lambda _: JUNK[junk])
    try:
        restored = FailureDetector.from_state(json.loads(json.dumps(broken, default=repr)), primitives)
    except (InputError, InputTypeError):
        return
    assert kind == "junk"
    (primitive, *_) = primitives.values()
    label = next(iter(primitives))
    recording = Demonstration(np.linspace(0, 1, 30)[:, None] * primitive.ranges, 0.02, label, primitive.names, primitive.units)
    (verdict,) = restored.verdicts([recording])
    assert np.isfinite(verdict.test_ratio)
    restored.state()


@pytest.mark.parametrize("state", JUNK, ids=repr)
def test_what_is_no_state_is_refused(alone, state):
    with pytest.raises((InputError, InputTypeError)):
        FailureDetector.from_state(state, alone.primitives_)


def test_a_state_for_other_primitives_is_refused(alone, calibrated):
    for state, primitives in ((alone.state(), calibrated.primitives_), (calibrated.state(), alone.primitives_)):
        with pytest.raises(InputError):
            FailureDetector.from_state(state, primitives)
