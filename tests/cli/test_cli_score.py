"""`probdmp score`, and `probdmp fit --by`."""

import json

import numpy as np
import pyarrow.parquet as pq
import pytest

from probdmp import PrimitiveLibrary, load_detector, read_demonstrations, write_demonstrations


@pytest.fixture
def executions(folder, tmp_path):
    write_demonstrations(tmp_path / "executions.parquet", read_demonstrations(folder / "blocked.npz"))
    return tmp_path / "executions.parquet"


def test_score_says_what_monitor_says(folder, executions, run_json, tmp_path):
    document = run_json("score", folder / "letters.probdmp", executions, "-o", tmp_path / "scores.parquet")
    judged = run_json("monitor", folder / "letters.probdmp", executions, exit_code=4)
    scores = pq.read_table(tmp_path / "scores.parquet").to_pylist()
    assert [row["verdict"] == "failed" for row in scores] == [one["failed"] for one in judged["executions"]]
    assert [row["primitive"] for row in scores] == [one["label"] for one in judged["executions"]]
    np.testing.assert_allclose([r["test_ratio"] for r in scores], [one["test_ratio"] for one in judged["executions"]])
    assert document["executions"] == len(scores) == 4
    assert document["verdicts"] == {"fine": 2, "failed": 2, "error": 0}
    assert set(document["primitives"]) == {"c", "l"}
    failed = document["primitives"]["c"]["failed"]
    assert (failed["count"], failed["n"], failed["rate"]) == (1, 2, 0.5)
    assert failed["low"] < 0.5 < failed["high"]


def test_score_prints_a_table_and_exits_with_0(folder, executions, run, tmp_path):
    result = run("score", folder / "paper.probdmp", executions, "-o", tmp_path / "scores.parquet")
    assert (result.exit_code, result.stderr) == (0, "")
    assert "4 executions:" in result.stdout
    assert "scores.parquet" in result.stdout


def test_score_refuses_what_it_cannot_do(folder, executions, run, tmp_path):
    output = tmp_path / "scores.parquet"

    def refused(code, text, *arguments):
        result = run("score", *arguments)
        assert result.exit_code == code, result.stderr
        assert text in result.stderr

    model = folder / "paper.probdmp"
    refused(2, "ends in .parquet", model, executions, "-o", tmp_path / "scores.csv")
    refused(2, "--jobs or --scheduler", model, executions, "-o", output, "--jobs", 2, "--scheduler", "tcp://127.0.0.1:1")
    refused(3, "a failure detector", folder / "bare.probdmp", executions, "-o", output)
    refused(3, "undamaged Parquet", model, folder / "letters.npz", "-o", output)
    refused(3, "readable file", model, tmp_path / "none.parquet", "-o", output)
    refused(3, "readable file", tmp_path / "none.probdmp", executions, "-o", output)
    assert run("score", model, executions, "-o", output).exit_code == 0
    refused(2, "--restart", model, executions, "-o", output)
    assert run("score", model, executions, "-o", output, "--restart").exit_code == 0


def test_fit_by_learns_what_fit_learns(folder, run_json, run, tmp_path):
    fleet = tmp_path / "letters.parquet"
    write_demonstrations(fleet, read_demonstrations(folder / "letters.npz"))
    for jobs in (1, 2):
        model = tmp_path / f"{jobs}.probdmp"
        document = run_json("fit", fleet, "--by", "primitive", "-o", model, "--n-basis", 8, "--jobs", jobs)
        learned, reference = PrimitiveLibrary.load(model), PrimitiveLibrary.load(folder / "letters.probdmp")
        assert {k: v.primitive_.identity for k, v in learned.items()} == {
            k: v.primitive_.identity for k, v in reference.items()
        }
        assert load_detector(model).state() == load_detector(folder / "letters.probdmp").state()
        assert [one["demonstrations"] for one in document["primitives"]] == [6, 6]
    few = tmp_path / "few.probdmp"
    options = ("--most", 3, "--rule", "paper", "--n-basis", 8)
    assert run("fit", fleet, "--by", "primitive", "-o", few, *options).exit_code == 0
    assert {learned.primitive_.n_demonstrations for learned in PrimitiveLibrary.load(few).values()} == {3}


def test_fit_by_refuses_what_it_cannot_do(folder, run, tmp_path):
    for arguments in (["--by", "primitive"], ["--most", 3]):
        result = run("fit", folder / "letters.npz", *arguments, "-o", tmp_path / "a.probdmp")
        assert result.exit_code == 2, result.stderr


def test_help_names_the_arguments(run):
    text = run("score", "--help").stdout
    assert "EXECUTIONS.parquet" in text
    assert "--scheduler" in text


def test_json_is_one_document(folder, executions, run, tmp_path):
    result = run("score", folder / "paper.probdmp", executions, "-o", tmp_path / "scores.parquet", "--json")
    document = json.loads(result.stdout)
    assert document["resumed"] == 0
    assert document["executions_per_second"] > 0
