"""The figures of an evaluation, kept as JSON and read again."""

import copy
import json

import numpy as np
import pytest

from probdmp.cli.output import json_line
from probdmp.demonstrations import synthetic_letters
from probdmp.dmp import Configuration
from probdmp.errors import DataFileError, InputError
from probdmp.evaluation import (
    UNDISTURBED,
    Experiment,
    OperatingCurves,
    at_level,
    evaluate,
    level_realizing,
    record_of,
    summarize,
)
from probdmp.evaluation.restoring import restored

SMALL = Configuration(n_basis=8, weight_uncertainty="joint")
FAULTS = ("hold", "wrong_class", "jitter", "spikes")


@pytest.fixture(scope="module", params=["calibrated", "paper"])
def evaluation(request):
    configuration = SMALL if request.param == "calibrated" else None
    experiment = Experiment(4, 3, 3, request.param, faults=FAULTS, configuration=configuration, seeds=2, traces=True)
    return evaluate(synthetic_letters(7, seed=1, letters="cl", dt=0.02), experiment)


@pytest.fixture(scope="module")
def document(evaluation):
    return json.loads(json_line(evaluation.as_dict("probdmp evaluate …")))


def test_a_record_survives_json(evaluation, document):
    record = record_of(document)
    assert record == evaluation.record("probdmp evaluate …")
    assert {judge.name: judge.summary for judge in record.judges} == evaluation.summaries()


def test_curves_are_those_of_thresholds_that_are_moved(evaluation):
    name, outcomes = next(iter(evaluation.outcomes.items()))
    curves = evaluation.record().judges[0].operating
    assert set(curves.detected) == {"hold", "wrong_class"}
    assert list(curves.false_alarms) == sorted(curves.false_alarms)
    for k, rate in enumerate(curves.false_alarms):
        moved = summarize(at_level(outcomes, level_realizing(outcomes, rate)))
        assert moved.false_alarms.rate == pytest.approx(rate)
        for fault, shares in curves.detected.items():
            assert moved.faults[fault].detected.rate == pytest.approx(shares[k])
    for one in curves.promptness:
        assert all(np.all(np.diff(shares) >= 0) for shares in one.detected.values())
    assert UNDISTURBED not in curves.detected
    assert name == evaluation.record().judges[0].name


def test_without_traces_there_are_no_curves():
    bare = evaluate(synthetic_letters(7, letters="c", dt=0.02), Experiment(4, 3, configuration=None))
    record = record_of(json.loads(json_line(bare.as_dict())))
    assert record.judges[0].operating is None
    assert record.command == ""


def spoilt(document, place, value):
    changed = copy.deepcopy(document)
    *parents, last = place
    inner = changed
    for key in parents:
        inner = inner[key]
    inner[last] = value
    return changed


@pytest.mark.parametrize(
    ("place", "value"),
    [
        (("classes",), "many"),
        (("classes",), True),
        (("readings",), []),
        (("readings",), 3),
        (("readings", 0, "faults"), {}),
        (("readings", 0, "faults", "hold", "bogus"), 1),
        (("readings", 0, "faults", "hold", "detected", "rate"), "x"),
        (("readings", 0, "name"), None),
        (("readings", 0, "operating", "false_alarms"), [0.1]),
        (("readings", 0, "operating", "detected", "hold"), "abc"),
        (("readings", 0, "calibrations"), [{}]),
        (("command",), ["rm"]),
    ],
)
def test_what_is_no_evaluation_is_refused(document, place, value):
    with pytest.raises(DataFileError, match="Expected an evaluation"):
        record_of(spoilt(document, place, value))


@pytest.mark.parametrize("other", [None, [], "x", {}, {"classes": 1}])
def test_other_documents_are_refused(other):
    with pytest.raises(DataFileError, match=r"Make it with: probdmp evaluate FILE --json"):
        record_of(other)


def test_curves_have_a_share_for_each_threshold():
    with pytest.raises(InputError, match="curves of 2 points"):
        OperatingCurves((0.0, 0.1), {"hold": (1.0,)}, (), ())


def test_values_come_back_as_their_annotations_say():
    assert np.isnan(restored(float, None))
    assert restored(tuple[float, ...], [1, 2.5]) == (1.0, 2.5)
    assert restored(int | None, None) is None
    with pytest.raises(TypeError, match="where str belongs"):
        restored(str, 3)
