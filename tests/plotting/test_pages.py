"""The pages: whole, self-contained, readable, and safe from what labels say."""

from dataclasses import replace

import pytest
from html_pages import check_page

from probdmp import FailureDetector, synthetic_letters
from probdmp.errors import MissingExtraError
from probdmp.evaluation import Evaluation, Experiment, evaluate, example_of
from probdmp.plotting.evaluation_report import evaluation_page
from probdmp.plotting.model_report import ModelReport, model_page
from probdmp.plotting.page import figure, page, table

HOSTILE = "<script>alert('$x_{')</script>&"


@pytest.fixture(scope="module")
def detector(primitive, letters):
    return FailureDetector(0.2).fit({HOSTILE: primitive}, {HOSTILE: letters[:6]})


def test_the_page_of_an_evaluation(evaluation):
    record = evaluation.record("probdmp evaluate 'a b.npz'")
    text = evaluation_page(record)
    check_page(text)
    hold = record.judges[0].summary.faults["hold"].detected
    for words in (
        f"{hold.count}/{hold.n}",
        "Operating curves",
        "How each number was made",
        "Clopper",
        "probdmp evaluate &#x27;a b.npz&#x27;",
    ):
        assert words in text
    assert "One execution" not in text
    assert "holds figures, no recordings" in text


@pytest.mark.usefixtures("sketched")
def test_with_an_example_it_shows_an_execution(evaluation):
    text = evaluation_page(evaluation.record(), example_of(evaluation, synthetic_letters(7, seed=2, letters="cl", dt=0.02)))
    check_page(text)
    for words in ("One execution", "What was learned: “c”", "The command was not kept"):
        assert words in text


@pytest.mark.usefixtures("sketched")
def test_an_evaluation_without_traces_has_no_curves(evaluation):
    outcomes = {
        name: replace(judged, outcomes=[
            replace(o, findings={fault: replace(f, trace=None) for fault, f in o.findings.items()}) for o in judged.outcomes
        ])
        for name, judged in evaluation.by_seed[0].items()
    }  # fmt: skip
    text = evaluation_page(Evaluation(replace(evaluation.experiment, traces=False), {0: outcomes}).record())
    check_page(text)
    assert "Operating curve" not in text
    assert "Realised" not in text


def test_labels_of_an_evaluation_are_text(letters):
    hostile = [replace(d, label=HOSTILE) for d in letters]
    result = evaluate(hostile, Experiment(4, 3, detector="paper", faults=("hold",)))
    text = evaluation_page(result.record(f"probdmp {HOSTILE}"), example_of(result, hostile))
    check_page(text)
    assert "&lt;script&gt;" in text
    assert "between, per step" in text


def test_the_page_of_a_model(primitive, detector):
    report = ModelReport(
        "m.probdmp", {HOSTILE: primitive}, (HOSTILE,), detector, {"probdmp": "1", "command": "probdmp fit x"}, "again"
    )
    done = []
    text = model_page(report, done.append)
    check_page(text)
    assert done == [HOSTILE]
    assert text.count("<svg") == 5
    assert "&lt;script&gt;alert" in text
    for words in (
        "6 demonstrations",
        "x, y",
        "in mm",
        "shared",
        "probdmp fit x\nagain",
        "can vouch for no less",
        "is attainable",
    ):
        assert words in text


def test_a_rate_that_is_not_vouched_for_is_called_so(primitive, letters):
    detector = FailureDetector(0.01).fit(primitive, letters[:6])
    text = model_page(ModelReport("m", {"": primitive}, (), detector))
    check_page(text)
    assert "not vouched for" in text
    assert "<svg" not in text
    assert "How the model was learned is not in the file" in text


def test_other_models(primitive, letters):
    paper = FailureDetector(rule="paper").fit(primitive, letters[:6])
    text = model_page(ModelReport("m", {"": primitive}, (), paper))
    assert "promises no rate of false alarms" in text
    level = next(iter(paper.thresholds_.values())).level
    assert f"{level:.2f}" in text
    assert "The file has no failure detector" in model_page(ModelReport("m", {"": primitive}, (), None))


def test_parts_of_a_page():
    assert figure([], "caption") == ""
    assert "<td>&lt;b&gt;<small>1 &amp; 2</small></td>" in table(["h"], [["<b>\n1 & 2"]])
    assert "<title>a &amp; {b}</title>" in page("a & {b}", ["{c}"])


def test_without_matplotlib_the_command_is_said(monkeypatch, evaluation, primitive):
    monkeypatch.setattr("probdmp.plotting.style.find_spec", lambda name: None)
    with pytest.raises(MissingExtraError, match=r"pip install 'probdmp\[plot\]'"):
        evaluation_page(evaluation.record())
    with pytest.raises(MissingExtraError, match=r"pip install 'probdmp\[plot\]'"):
        model_page(ModelReport("m", {"": primitive}, (), None))
