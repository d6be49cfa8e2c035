"""The experiment with sensor channels: learned and watched with the movement, and faults of the channels themselves."""

import json
from dataclasses import replace

import numpy as np
import pytest

from probdmp.cli.output import json_line
from probdmp.demonstrations import synthetic_contacts
from probdmp.dmp import Configuration
from probdmp.errors import DataFileError, InputError, InputTypeError
from probdmp.evaluation import UNDISTURBED, Experiment, draw_trials, evaluate, example_of, record_of

SMALL = Configuration(n_basis=8, weight_uncertainty="joint")
FAULTS = ("press", "press:0.8", "lift", "hold", "dropout")
TESTS = 5


@pytest.fixture(scope="module")
def demos():
    """Wiping a table, and the same faster and firmer, as another class."""
    wipes = [contact.demonstration for contact in synthetic_contacts(10 + TESTS, dt=0.04)]
    firm = [contact.demonstration for contact in synthetic_contacts(10 + TESTS, seed=1, dt=0.04)]
    return wipes + [replace(d, label="firm", channels={"force": 2 * d.channels["force"]}) for d in firm]


@pytest.fixture(scope="module")
def experiment():
    channels = ("force",)
    return Experiment(10, TESTS, 0, "calibrated", "known", FAULTS, SMALL, 0.05, channels=channels)


@pytest.fixture(scope="module")
def evaluation(demos, experiment):
    return evaluate(demos, experiment)


@pytest.fixture(scope="module")
def outcomes(evaluation):
    return evaluation.outcomes["calibrated"]


def test_what_feels_wrong_is_found_and_named(outcomes):
    for fault in ("press:0.8", "lift"):
        found = [o.findings[fault] for o in outcomes if o.alarms[fault] is not None]
        assert len(found) >= 8
        assert sum(f.kind == "channel" and f.cause == "unexpected force" for f in found) >= 7
    assert sum(o.alarms["press"] is not None for o in outcomes) >= 3  # firmness varies by as much as that
    held = [o.findings["hold"].cause for o in outcomes if o.alarms["hold"] is not None]
    assert held.count("held") >= 9
    assert sum(o.false_alarm is not None for o in outcomes) <= 2


def test_without_the_channel_nobody_notices(demos, experiment, outcomes):
    """The same executions and onsets; the movement is as it should be."""
    deaf = evaluate(demos, replace(experiment, channels=(), faults=("press", "hold"))).outcomes["calibrated"]
    for one, other in zip(outcomes, deaf, strict=True):
        assert one.onsets["press"] == other.onsets["press"]
        assert other.findings["press"] == other.findings[UNDISTURBED]
    assert sum(o.alarms["press"] is not None for o in deaf) <= 2
    assert sum(o.alarms["hold"] is not None for o in deaf) >= 9


def test_the_channels_are_counted_and_kept(evaluation):
    summary = evaluation.summaries()["calibrated"]
    assert set(summary.faults) == set(FAULTS)
    counts = [summary.faults[fault].detected.count for fault in ("press", "press:0.8")]
    assert 3 <= counts[0] <= counts[1]
    assert summary.faults["press"].detected.n == 2 * TESTS
    document = json.loads(json_line(evaluation.as_dict("probdmp evaluate …")))
    assert document["channels"] == ["force"]
    record = record_of(document)
    assert record.channels == ("force",)
    assert record == evaluation.record("probdmp evaluate …")


def test_records_from_before_there_were_channels_have_none(evaluation):
    document = json.loads(json_line(evaluation.as_dict()))
    del document["channels"]
    assert record_of(document).channels == ()
    for junk in ("force", [1], 3, None, {"force": 1}):
        with pytest.raises(DataFileError, match="Expected an evaluation"):
            record_of({**document, "channels": junk})


def test_an_example_shows_executions_with_their_channels(demos, evaluation):
    example = example_of(evaluation, demos, "press")
    assert (example.fault, example.primitive.channel_names) == ("press", ("force",))
    pressed, fine = (example.recordings[name] for name in ("press", UNDISTURBED))
    np.testing.assert_array_equal(pressed.positions, fine.positions)
    added = (pressed.channels["force"] - fine.channels["force"]) / np.ptp(fine.channels["force"])
    np.testing.assert_allclose(added[-1], 0.4, rtol=1e-9)
    np.testing.assert_array_equal(added[pressed.times < example.onset - 1e-9], 0)
    assert np.all(added[pressed.times > example.onset - 1e-9] > 0)


# --- what is refused --------------------------------------------------------------------------------------------------


def test_the_papers_detector_knows_positions_alone(experiment):
    with pytest.raises(InputError, match=r"channels with the calibrated detector only, got them with the paper's"):
        Experiment(channels=("force",))
    with pytest.raises(InputError, match="calibrated detector only"):
        replace(experiment, detector="paper")
    assert Experiment(channels=()).channels == ()
    assert Experiment(detector="calibrated", channels=["force"]).channels == ("force",)


@pytest.mark.parametrize(
    ("channels", "error", "match"),
    [
        ("force", InputTypeError, r"channels as a list of names, got 'force'\. Write channels=\['force'\]"),
        (["force", "force"], InputError, "different names in channels"),
        ([3], InputTypeError, "channels as a list of names"),
        (None, InputTypeError, "channels as a list of names"),
    ],
)
def test_channels_that_are_none(channels, error, match):
    with pytest.raises(error, match=match):
        Experiment(detector="calibrated", channels=channels)


def test_demonstrations_must_have_the_channels(demos, experiment):
    with pytest.raises(InputError, match=r"demonstrations with the channels 'heat', got one with 'force'"):
        evaluate(demos, replace(experiment, channels=("heat",), faults=("hold",)))
    bare = [replace(d, channels={}) for d in demos]
    with pytest.raises(InputError, match="executions with sensor channels for the fault 'press'"):
        draw_trials(bare, replace(experiment, channels=()))
