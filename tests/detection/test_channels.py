"""Sensor channels that were learned with the movement, judged with it: whatever is done to either, and only to that."""

import json
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from detection.verdicts import assert_same, run_online, task_of

from probdmp import FailureDetector, PrimitiveLibrary, ProbabilisticDMP, load_detector
from probdmp.demonstrations import fault_generator, fault_named, perturb_executions, synthetic_letters
from probdmp.detection.trajectory_model import MOVEMENT_CHANNELS
from probdmp.errors import InputError, InputTypeError

LETTERS, TRAINED, JUDGED = "sl", 12, 4
FAULTS = ("lift", "press:0.6", "wrong_channel", "hold", "slow", "push:0.5", "wrong_class", "dropout", "stuck_sensor", "spikes")
NAN = np.nan


def with_force(recording, seed):
    """The pen presses the more the larger the letter is, about; at first not at all, exactly."""
    rng, s = np.random.default_rng(seed), np.linspace(0, 1, recording.n_samples)
    gain = np.ptp(recording.positions[:, 1]) / 10 * np.exp(0.1 * rng.standard_normal())
    skewed = 0.7 if recording.label == "s" else -0.7
    force = 1 + 2 * gain * np.sin(np.pi * s) ** 2 * (1 + skewed * np.sin(2 * np.pi * s))
    noisy = force + 0.02 * rng.standard_normal(len(force))
    return replace(recording, channels={"force": np.where(s < 0.1, 1.0, noisy)})


@pytest.fixture(scope="module")
def repetitions():
    written = synthetic_letters(TRAINED + JUDGED, letters=LETTERS, dt=0.02)
    felt = [with_force(d, k) for k, d in enumerate(written)]
    return {letter: [d for d in felt if d.label == letter] for letter in LETTERS}


@pytest.fixture(scope="module")
def training(repetitions):
    return {letter: recordings[:TRAINED] for letter, recordings in repetitions.items()}


@pytest.fixture(scope="module")
def fresh(repetitions):
    return {letter: recordings[TRAINED:] for letter, recordings in repetitions.items()}


@pytest.fixture(scope="module")
def library(training):
    return PrimitiveLibrary.fit(training, n_basis=8, channels=["force"])


@pytest.fixture(scope="module")
def detector(library, training):
    return FailureDetector(0.05).fit(library, training)


@pytest.fixture(scope="module")
def executions(fresh):
    """Four of each letter by what happens to them."""
    faulty = {"fine": [d for own in fresh.values() for d in own]}
    for name in FAULTS:
        fault, faulty[name] = fault_named(name), []
        for letter, own in fresh.items():
            others = [d for other in LETTERS if other != letter for d in fresh[other]]
            faulty[name] += perturb_executions(fault, own, others, fault_generator(0, letter, fault))[0]
    return faulty


@pytest.fixture(scope="module")
def verdicts(detector, executions):
    return {name: detector.verdicts(chosen) for name, chosen in executions.items()}


def values_of(detector, learned, recording):
    """(T, C) values of all channels of one execution that is told its start."""
    task = task_of(learned.primitive_, recording, False)
    ((source, ticks),) = detector.rule_.family.replay(learned.primitive_, [task], [recording])
    return np.stack([values for observed in ticks for values in source.update(observed)])


# --- what is noticed, and what it is called ---------------------------------------------------------------------------


def test_positions_and_channels_are_judged_together(detector, library, training):
    """The calibration has a column for the channel, from what the other demonstrations teach."""
    assert detector.rule_.family.channels == (*MOVEMENT_CHANNELS, "force")
    for by_label in detector.rule_.calibrations.values():
        calibration = by_label[""]
        assert calibration.maxima.shape == (len(LETTERS) * TRAINED, len(MOVEMENT_CHANNELS) + 1)
        assert np.all(calibration.maxima[:, -1] > 0)
    for letter in LETTERS:
        execution = library[letter].execute(dt=0.02, detector=detector)
        assert execution.verdict.names == ("x", "y", "force")
        assert len(execution.verdict.contributions) == 3


def test_each_demonstration_is_judged_by_what_the_others_teach(detector, library, training):
    """Of itself it expects what it reads."""
    for letter in LETTERS:
        calibration = detector.rule_.calibrations[False][""]
        left_out = calibration.maxima[np.array(calibration.labels) == letter, -1]
        taught = [np.nanmax(values_of(detector, library[letter], d)[:, -1]) for d in training[letter]]
        assert np.mean(left_out) > np.mean(taught)
        assert np.all(left_out != taught)


@pytest.mark.parametrize("fault", ["lift", "press:0.6", "wrong_channel"])
def test_what_feels_wrong_is_called_by_the_channel(verdicts, fault):
    found = [v for v in verdicts[fault] if v.failed]
    assert len(found) == 8
    named = [v for v in found if v.kind == "channel"]
    assert len(named) >= 7
    for verdict in named:
        assert verdict.cause == "unexpected force"
        assert (verdict.channel, verdict.better) == ("force", "")
        assert verdict.contributions[:2].tolist() == [0, 0]
        assert verdict.blamed in ("+force", "−force")
        assert "[channel: unexpected force]" in str(verdict)
        assert f"mostly {verdict.blamed}" in str(verdict)


@pytest.mark.parametrize(("fault", "blamed"), [("lift", "−force"), ("press:0.6", "+force")])
def test_the_sign_says_whether_it_is_too_firm(verdicts, fault, blamed):
    assert sum(v.blamed == blamed for v in verdicts[fault]) >= 7


@pytest.mark.parametrize(
    ("fault", "kind", "cause", "least"),
    [
        ("hold", "timing", "held", 7),
        ("slow", "timing", "slow", 4),
        ("push:0.5", "motion", "off the path", 7),
        ("wrong_class", "motion", "off the path", 7),
        ("stuck_sensor", "sensor", "stuck", 8),
        ("spikes", "sensor", "spikes", 8),
    ],
)
def test_movement_faults_are_still_called_by_their_name(verdicts, fault, kind, cause, least):
    """The channels of what is held are held too, and so on; the movement explains them, unless the channel tells first."""
    named = Counter((v.kind, v.cause) for v in verdicts[fault] if v.failed)
    assert sum(named.values()) >= 7
    assert named[(kind, cause)] >= least, named
    assert named[("channel", "unexpected force")] <= 8 - least


def test_what_goes_well_is_fine(verdicts):
    assert sum(v.failed for v in verdicts["fine"]) <= 1
    assert sum(v.failed and v.kind != "data missing" for v in verdicts["dropout"]) <= 2
    assert {v.kind for v in verdicts["fine"] if not v.failed} == {""}


# --- the same however it is asked -------------------------------------------------------------------------------------


@pytest.mark.parametrize("told", [True, False], ids=["known", "nominal"])
@pytest.mark.parametrize("kind", ["fine", "lift", "press:0.6", "hold", "slow", "dropout", "spikes", "late", "slow channel"])
def test_online_is_offline(detector, library, executions, kind, told):
    chosen = [executions.get(kind, executions["press:0.6"])[5 if told else 1]]
    if kind == "late":  # the force is measured from some sample on
        chosen = [replace(d, channels={"force": np.where(d.times < 0.3, NAN, d.channels["force"])}) for d in chosen]
    if kind == "slow channel":
        chosen = [
            replace(d, channels={"force": np.where(np.arange(d.n_samples) % 3, NAN, d.channels["force"])}) for d in chosen
        ]
    tasks = [task_of(library[d.label].primitive_, d, told) for d in chosen]
    for recording, task, verdict in zip(chosen, tasks, detector.verdicts(chosen, tasks=tasks), strict=True):
        execution, _ = run_online(library[recording.label].primitive_, task, recording, detector)
        assert_same(execution.verdict, verdict)


def test_readings_come_by_name(detector, library, executions):
    """Of the force alone, of positions alone, in one array, or none: what was not given was not measured."""
    recording, learned = executions["press:0.6"][2], library["s"]
    (verdict,) = detector.verdicts([recording])
    execution = learned.execute(recording.positions[0], dt=0.02, detector=detector)
    for position, force in zip(recording.positions, recording.channels["force"], strict=True):
        execution.step({"position": position, "force": force})
    assert_same(execution.verdict, verdict)
    silent = learned.execute(recording.positions[0], dt=0.02, detector=detector)
    for position in recording.positions:
        silent.step(position)
    bare = replace(recording, channels={})
    assert_same(silent.verdict, detector.verdicts([bare])[0])


def test_a_file_brings_it_back(tmp_path, detector, library, executions, verdicts):
    library.save(tmp_path / "felt.probdmp", detector)
    again, primitives = load_detector(tmp_path / "felt.probdmp"), PrimitiveLibrary.load(tmp_path / "felt.probdmp")
    assert again.state() == detector.state() == json.loads(json.dumps(detector.state()))
    assert again.sensors_ is None
    for name in ("fine", "lift", "press:0.6", "hold"):
        for one, other in zip(verdicts[name], again.verdicts(executions[name]), strict=True):
            assert_same(one, other, 1e-12)
    recording = executions["lift"][2]
    task = task_of(primitives["s"].primitive_, recording, False)
    assert_same(run_online(primitives["s"].primitive_, task, recording, again)[0].verdict, verdicts["lift"][2])


@pytest.fixture(scope="module")
def alone(library, training):
    """For one letter."""
    return FailureDetector(0.05).fit(library["s"], training["s"])


def test_units_of_the_channel_do_not_matter(training, executions, alone):
    """Nor where its zero is: but for rounding, and that learning stops where little changes."""

    def other_units(recordings):
        return [replace(d, channels={"force": 1000 * (d.channels["force"] + 5)}) for d in recordings]

    scaled = other_units(training["s"])
    judge = FailureDetector(0.05).fit(ProbabilisticDMP(8, channels=["force"]).fit(scaled), scaled)
    chosen = [executions[name][1] for name in ("fine", "press:0.6", "hold", "lift")]
    for one, other in zip(alone.verdicts(chosen), judge.verdicts(other_units(chosen)), strict=True):
        assert_same(one, other, 2e-3)


# --- channels and movement do not hear of each other ------------------------------------------------------------------


@pytest.mark.parametrize("fault", ["lift", "press:0.6", "wrong_channel"])
def test_what_only_feels_wrong_moves_as_it_should(detector, library, executions, fault):
    for k in (0, JUDGED):
        recording, original = executions[fault][k], executions["fine"][k]
        values, before = (values_of(detector, library[d.label], d) for d in (recording, original))
        np.testing.assert_array_equal(values[:, : len(MOVEMENT_CHANNELS)], before[:, : len(MOVEMENT_CHANNELS)])
        assert np.nanmax(values[:, -1]) > 5 * np.nanmax(before[:, -1])


@pytest.fixture(scope="module")
def without(training):
    """The same letter learned without the force, and its detector."""
    learned = ProbabilisticDMP(8).fit(training["s"])
    return learned, FailureDetector(0.05).fit(learned, training["s"])


def test_the_movement_is_judged_as_without_channels(detector, library, without, executions):
    """Up to what is learned of it."""
    for name in ("fine", "push:0.5"):
        recording = executions[name][0]
        one, other = values_of(detector, library["s"], recording), values_of(without[1], without[0], recording)
        together, alone = (np.nanmax(values[:, :2], axis=0) for values in (one, other))
        np.testing.assert_allclose(together, alone, rtol=0.3)


# --- what the channel's own sensor may do -----------------------------------------------------------------------------


def test_a_constant_channel_is_no_stuck_sensor(detector, executions):
    """The force is exactly as at rest for long: that may be unexpected, but it is no number that is repeated by mistake."""
    still = [replace(d, channels={"force": np.full(d.n_samples, 1.0)}) for d in executions["fine"]]
    for verdict in detector.verdicts(still):
        assert verdict.failed
        assert verdict.kind != "sensor"
        assert not verdict.has_sensor_fault
    assert not any(v.has_sensor_fault for v in detector.verdicts(executions["fine"]))  # they are so at first


def test_a_constant_channel_that_was_taught_is_fine(training, executions):
    def still(recordings):
        return [replace(d, channels={"force": np.full(d.n_samples, 4.0)}) for d in recordings]

    learned = ProbabilisticDMP(8, channels=["force"]).fit(still(training["s"][:8]))
    judge = FailureDetector(0.05).fit(learned, still(training["s"][:8]))
    found = judge.verdicts(still(executions["fine"][:JUDGED]))
    assert sum(v.failed for v in found) <= 1
    assert not any(v.has_sensor_fault for v in found)
    risen = [replace(d, channels={"force": np.where(d.times < 0.4, 4.0, 7.0)}) for d in executions["fine"][:JUDGED]]
    found = judge.verdicts(risen)
    assert {(v.failed, v.channel, v.blamed) for v in found} == {(True, "force", "+force")}


@pytest.mark.parametrize("how", ["no such channel", "all missing", "lost"])
def test_without_readings_of_the_channel_it_cannot_be_judged(detector, library, executions, how):
    """It is called so after a tenth of its duration; the movement, which is measured, is not to blame."""
    original = executions["fine"][2]
    force = original.channels["force"]
    channels = {
        "no such channel": {},
        "all missing": {"force": np.full(original.n_samples, NAN)},
        "lost": {"force": np.where(original.times < 0.5, force, NAN)},
    }
    (verdict,) = detector.verdicts([replace(original, channels=channels[how])])
    assert (verdict.failed, verdict.kind, verdict.channel) == (True, "data missing", "silence")
    assert verdict.is_stale
    silent = 0.1 * library["s"].primitive_.duration
    assert verdict.time == pytest.approx((0.5 if how == "lost" else 0.0) + silent, abs=0.03)


def test_a_channel_that_is_measured_less_often_is_not_silent(training, executions):
    """As often as in the demonstrations: no staleness, and the channel is still heard."""

    def rarely(recordings):
        kept = [np.arange(d.n_samples) % 6 == 0 for d in recordings]
        felt = [{"force": np.where(k, d.channels["force"], NAN)} for d, k in zip(recordings, kept, strict=True)]
        return [replace(d, channels=channels) for d, channels in zip(recordings, felt, strict=True)]

    learned = ProbabilisticDMP(8, channels=["force"]).fit(rarely(training["s"]))
    judge = FailureDetector(0.05).fit(learned, rarely(training["s"]))
    fine, pressed = (judge.verdicts(rarely(executions[name][:JUDGED])) for name in ("fine", "press:0.6"))
    assert sum(v.failed for v in fine) <= 1
    assert not any(v.is_stale or v.kind == "data missing" for v in fine + pressed)
    assert all(v.failed for v in pressed)
    assert sum(v.kind == "channel" for v in pressed) >= JUDGED - 1


# --- what is refused --------------------------------------------------------------------------------------------------


def test_primitives_of_a_library_have_the_same_channels(library, without, training):
    with pytest.raises(InputError, match=r"primitives with the same channels, got \(\) and \('force',\).* a detector to each"):
        FailureDetector().fit({"s": without[0], "l": library["l"]}, training)


@pytest.mark.parametrize("statistic", ["trajectory", "nis"])
def test_demonstrations_must_have_the_channel(library, training, statistic):
    bare = [replace(d, channels={}) for d in training["s"]]
    with pytest.raises(InputError, match="force"):
        FailureDetector(statistic=statistic).fit(library["s"], bare)


def test_a_state_with_other_channels_is_refused(alone, library, without):
    for state, learned in ((alone.state(), without[0]), (without[1].state(), library["s"])):
        with pytest.raises((InputError, InputTypeError)):
            FailureDetector.from_state(state, {"": learned.primitive_})


@pytest.mark.parametrize("arguments", [{"statistic": "nis"}, {"rule": "paper"}], ids=str)
def test_innovations_are_of_all_signals(library, training, executions, arguments):
    """Other statistics hear of the channel as of any output of a sensor; online = offline."""
    judge = FailureDetector(0.1, **arguments).fit(library["s"], training["s"])
    chosen = [executions[name][2] for name in ("fine", "press:0.6", "hold")]
    for recording, verdict in zip(chosen, judge.verdicts(chosen), strict=True):
        assert verdict.names == ("x", "y", "force")
        task = task_of(library["s"].primitive_, recording, False)
        assert_same(run_online(library["s"].primitive_, task, recording, judge)[0].verdict, verdict)
