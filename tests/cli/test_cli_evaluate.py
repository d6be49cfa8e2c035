"""`probdmp evaluate` and `probdmp demo`."""

import json
import re
import sys
from html import unescape

import pytest
import typer

from probdmp import write_demonstrations
from probdmp.cli.evaluation_table import print_evaluation
from probdmp.cli.output import json_line
from probdmp.demonstrations import FAULTS, synthetic_letters
from probdmp.dmp import Configuration
from probdmp.evaluation import DETECTORS, READINGS, TASKS, Assessment, Evaluation, Experiment, Finding, Outcome
from probdmp.evaluation import evaluate as evaluate_directly

SMALL = ("--train", 3, "--test", 3)
PAPER = ("--detector", "paper")


def as_json(evaluation, command):
    return json.loads(json_line(evaluation.as_dict(command)))


def test_the_document_is_that_of_the_evaluation(folder, run_json, letters):
    document = run_json("evaluate", folder / "letters.npz", *SMALL, "--seed", 5, "--task", "nominal")
    expected = evaluate_directly(letters, Experiment(3, 3, 5, "calibrated", "nominal", traces=True))
    assert document == as_json(expected, document["command"])
    assert document["command"].endswith(
        "--seed 5 --seeds 1 --detector calibrated --task nominal --fault hold --false-alarm-rate 0.01"
    )
    assert (document["classes"], document["seed"], document["task"]) == (2, 5, "nominal")


def test_the_calibration_is_told(folder, run_json, run):
    arguments = ("evaluate", folder / "letters.npz", *SMALL, "--false-alarm-rate", 0.2, "--fault", "hold,slow")
    document = run_json(*arguments)
    (facts,) = document["calibrations"]
    assert document["false_alarm_rate"] == facts["false_alarm_rate"] == 0.2
    assert (facts["seed"], facts["task"], facts["n"], facts["source"]) == (0, "known", 6, "leave_one_out")
    assert facts["attainable_rate"] == pytest.approx(1 / 7)
    assert (facts["method"], facts["guarantee"]) == ("tail", "empirical")
    assert facts["threshold"] > 0
    assert set(facts["thresholds"]) == {"0.01", "0.02", "0.05", "0.1"}
    assert isinstance(facts["suspects"], dict)
    hold, slow = document["faults"]["hold"], document["faults"]["slow"]
    assert sum(hold["kinds"].values()) == hold["detected"]["count"] == hold["told_apart"]["n"]
    assert slow["told_apart"]["n"] == slow["detected"]["count"]
    shown = run(*arguments).stdout
    for words in (
        "20 % false alarms per execution asked for, 14.3 % attainable with n = 6",
        "hold called held",
        "slow not called",
    ):
        assert words in shown


def test_the_librarys_own_configuration(folder, run_json, letters):
    document = run_json("evaluate", folder / "letters.npz", *SMALL, *PAPER, "--configuration", "default")
    expected = evaluate_directly(letters, Experiment(3, 3, configuration=Configuration(), traces=True))
    assert document == as_json(expected, document["command"])


def test_the_table_has_the_papers_figures_and_every_reading(folder, run):
    result = run("evaluate", folder / "letters.npz", *SMALL, *PAPER, env={"COLUMNS": "80"})
    assert (result.exit_code, result.stderr) == (0, "")
    for words in ("2/220 0.9 %", "220/220 100.0 %", "98.3–100.0 %", "detected", "ever failed", "latency", "Fault: hold"):
        assert words in result.stdout
    for reading in READINGS:
        assert reading.likelihood.replace("_", " ") in result.stdout
    table = [line for line in result.stdout.splitlines() if "/220" in line or "/6 " in line]
    assert len(table) == 1 + len(READINGS)


def outcomes_with(faults):
    """999 executions, of which all but one raise every alarm late."""

    def outcome(label, alarm):
        findings = {name: Finding(alarm, "motion" if alarm else "") for name in ("undisturbed", *faults)}
        return Outcome(label, 1.0, dict.fromkeys(faults, 0.5), findings)

    return [outcome("a", 0.99)] * 998 + [outcome("b", None)]


@pytest.mark.parametrize("faults", [("hold",), (*FAULTS, "wrong_goal:0.15")])
def test_the_table_fits_into_eighty_columns(monkeypatch, capsys, faults):
    monkeypatch.setenv("COLUMNS", "80")
    split = dict.fromkeys([reading.name for reading in READINGS], Assessment(outcomes_with(faults)))
    print_evaluation(Evaluation(Experiment(faults=faults), {0: split}))
    table, _, _ = capsys.readouterr().out.partition("Intervals: 95 %, exact")
    cells = 3 if faults == ("hold",) else 1 + 8 + 2  # false alarms, detected, ever; false alarms, eight failures, two benign
    assert table.count("998/999 99.9 %") == cells * len(READINGS)
    assert max(map(len, table.splitlines())) <= 80


def test_several_faults_have_a_row_each(folder, run):
    faults = ("hold", "push:0.4", "jitter", "spikes")
    result = run(
        "evaluate", folder / "letters.npz", *SMALL, *PAPER, "--seeds", 2, "--fault", ",".join(faults), env={"COLUMNS": "80"}
    )
    assert (result.exit_code, result.stderr) == (0, "")
    assert "seeds 0 to 1" in result.stdout
    assert "bootstrap over classes" in result.stdout
    for reading in READINGS:
        assert f"\n{reading.name}\nFalse alarms " in result.stdout
    for words in (*faults, "false alarms", "called sensor"):
        assert result.stdout.count(f" {words} ") == len(READINGS)


def test_all_faults_and_some_more(folder, run_json):
    document = run_json("evaluate", folder / "letters.npz", "--train", 2, "--test", 1, "--fault", "all, push:0.4,hold")
    assert list(document["faults"]) == [*FAULTS, "push:0.4"]


def test_another_movement_needs_another_class(folder, run, tmp_path, letters):
    write_demonstrations(tmp_path / "c.npz", [d for d in letters if d.label == "c"])
    result = run("evaluate", tmp_path / "c.npz", *SMALL, "--fault", "all")
    assert (result.exit_code, result.stdout) == (2, "")
    assert "executions of another class" in result.stderr
    assert "Leave wrong_class out" in result.stderr


def test_several_seeds(folder, run_json, letters):
    document = run_json("evaluate", folder / "letters.npz", *SMALL, "--seed", 5, "--seeds", 2)
    expected = evaluate_directly(letters, Experiment(3, 3, 5, "calibrated", seeds=2, traces=True))
    assert document == as_json(expected, document["command"])
    assert [one["seed"] for one in document["per_seed"]] == [5, 6]
    assert [facts["seed"] for facts in document["calibrations"]] == [5, 6]


@pytest.mark.usefixtures("sketched")
def test_a_report_of_an_evaluation(folder, run, tmp_path):
    page = tmp_path / "r.html"
    arguments = ("evaluate", folder / "letters.npz", *SMALL, "--fault", "hold,push,dropout,spikes", "--report", page)
    result = run(*arguments)
    assert (result.exit_code, result.stderr) == (0, "")
    assert f"Report: {page}" in result.stdout
    text = page.read_text()
    for words in ("push", "dropout", "Called a sensor fault", "Is the rate of false alarms kept?", "Operating curves"):
        assert words in text
    assert text.count("<svg") == 1 + 3 + 2 + 3 + 7  # realised; operating; when; one execution; what was learned
    assert "model-based, not guaranteed" in text
    command = re.search(r"<code>probdmp (evaluate .*?)</code>", text)[1]
    again = run(*unescape(command).split(), "--report", tmp_path / "again.html")
    assert again.stdout.partition("Report")[0] == result.stdout.partition("Report")[0]
    assert (tmp_path / "again.html").read_text() == text


@pytest.mark.usefixtures("sketched")
def test_a_report_of_the_papers_rule_has_no_calibration(folder, run, tmp_path):
    result = run("evaluate", folder / "letters.npz", *SMALL, *PAPER, "--report", tmp_path / "r.html")
    assert result.exit_code == 0
    text = (tmp_path / "r.html").read_text()
    assert "the paper&#x27;s rule: posterior, cumulative" in text
    assert "Is the rate" not in text


def test_a_report_is_refused_before_the_work(folder, run, tmp_path, monkeypatch):
    assert run("evaluate", folder / "letters.npz", *SMALL, "--report", tmp_path / "r.txt").exit_code == 2
    monkeypatch.setattr("probdmp.plotting.style.find_spec", lambda name: None)
    monkeypatch.setattr("probdmp.cli.evaluate.evaluation_of", None)
    result = run("evaluate", folder / "letters.npz", *SMALL, "--report", tmp_path / "r.html")
    assert (result.exit_code, result.stdout) == (1, "")
    assert "pip install 'probdmp[plot]'" in result.stderr


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--configuration", "default"), "--configuration with the other detector only, got it with --detector calibrated"),
        ((*PAPER, "--false-alarm-rate", 0.05), "--false-alarm-rate with the other detector only, got it with --detector paper"),
        (("--false-alarm-rate", 0), "false_alarm_rate between 0 and 1, got 0"),
    ],
)
def test_options_that_do_not_go_with_the_detector(arguments, message, folder, run):
    result = run("evaluate", folder / "letters.npz", *SMALL, *arguments)
    assert (result.exit_code, result.stdout) == (2, "")
    assert message in result.stderr


def test_too_few_demonstrations_are_a_usage_error_that_names_the_classes(folder, run):
    result = run("evaluate", folder / "letters.npz")
    assert (result.exit_code, result.stdout) == (2, "")
    assert "train + test = 20" in result.stderr
    assert "6 of 'c', 6 of 'l'" in result.stderr
    assert "train = 3, test = 3" in result.stderr


@pytest.mark.parametrize(
    "option",
    [
        *(("--task", "x"), ("--detector", "x"), (*PAPER, "--configuration", "x"), ("--train", 0), ("--seeds", 0)),
        *(("--fault", "x"), ("--fault", ""), ("--fault", "hold:0.3"), ("--fault", "push:big")),
    ],
)
def test_unknown_choices_are_usage_errors(option, folder, run):
    assert run("evaluate", folder / "letters.npz", *option).exit_code == 2


def test_help_names_every_choice(run):
    shown = run("evaluate", "--help").stdout
    for choice in (*DETECTORS, *TASKS, *FAULTS):
        assert choice in shown


DEMO = ("demo", "--letters", "l", "--train", 2, "--test", 2)


@pytest.mark.usefixtures("sketched")
def test_demo_writes_a_report(run, tmp_path):
    report = tmp_path / "r.html"
    result = run(*DEMO, "-o", report)
    assert (result.exit_code, result.stderr) == (0, "")
    assert f"Report: {report}" in result.stdout
    page = report.read_text()
    assert "<svg" in page
    assert "probdmp demo --letters l --train 2 --test 2 --seed 0" in page
    for name in ("the paper, as published", "calibrated", "the paper&#x27;s rule: predictive, per step"):
        assert name in page


def test_demo_without_matplotlib_says_what_to_install(run, monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    result = run(*DEMO, "-o", tmp_path / "r.html")
    assert result.exit_code == 0
    assert "2/220 0.9 %" in result.stdout
    assert "Report" not in result.stdout
    assert "pip install 'probdmp[plot]'" in result.stderr
    assert not (tmp_path / "r.html").exists()


def test_demo_without_matplotlib_says_so_before_the_work(run, monkeypatch, tmp_path):
    def interrupted(*_):
        raise typer.Exit(3)

    monkeypatch.setitem(sys.modules, "matplotlib", None)
    monkeypatch.setattr("probdmp.cli.demo.evaluation_of", interrupted)
    result = run(*DEMO, "-o", tmp_path / "r.html")
    assert result.exit_code == 3
    assert "no report" in result.stderr
    assert "pip install 'probdmp[plot]'" in result.stderr


def test_demo_prints_the_document_of_the_evaluation(run, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    result = run(*DEMO, "--seed", 3, "-o", tmp_path / "r.html", "--json")
    experiment, paper = Experiment(2, 2, 3, "calibrated", traces=True), READINGS[0].name
    judges = {**DETECTORS["calibrated"], paper: DETECTORS["paper"][paper]}
    expected = evaluate_directly(synthetic_letters(4, 3, "l"), experiment, judges)
    assert json.loads(result.stdout) == as_json(expected, "probdmp demo --letters l --train 2 --test 2 --seed 3 --fault hold")


def test_demo_puts_in_the_faults_that_it_is_asked_for(run, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    document = json.loads(run(*DEMO, "--fault", "push:0.4,jitter", "-o", tmp_path / "r.html", "--json").stdout)
    assert list(document["faults"]) == ["push:0.4", "jitter"]


def test_demo_refuses_before_it_works(run, tmp_path):
    assert run("demo", "--letters", "aa").exit_code == 2
    assert run("demo", "-o", tmp_path / "none" / "r.html").exit_code == 2
    assert run("demo", "-o", tmp_path / "r.txt").exit_code == 2
