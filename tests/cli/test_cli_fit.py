"""`probdmp fit` and `probdmp inspect`."""

import json
from dataclasses import asdict

import numpy as np
import pytest
from strategies import PAPERS_WEIGHTS

from probdmp import PrimitiveLibrary, ProbabilisticDMP, load, load_detector, write_demonstrations
from probdmp.demonstrations import Demonstration
from probdmp.dmp.configuration import FORCING_NOISES, SCALINGS
from probdmp.dmp.transformation_system import DISCRETIZATIONS


def test_fit_learns_what_the_library_learns(folder, run_json, tmp_path):
    model = tmp_path / "m.probdmp"
    document = run_json("fit", folder / "letters.npz", "-o", model, "--n-basis", 8)
    learned, reference = PrimitiveLibrary.load(model), PrimitiveLibrary.load(folder / "letters.probdmp")
    assert {k: v.primitive_.identity for k, v in learned.items()} == {k: v.primitive_.identity for k, v in reference.items()}
    assert load_detector(model).state() == load_detector(folder / "letters.probdmp").state()
    assert [p["label"] for p in document["primitives"]] == ["c", "l"]


def test_fit_reports_how_well(folder, run_json, tmp_path, letters):
    document = run_json("fit", folder / "letters.npz", "-o", tmp_path / "m.probdmp", "--label", "c", "--n-basis", 8)
    (summary,) = document["primitives"]
    fitted = ProbabilisticDMP(8, weight_model="hierarchical", weight_uncertainty="joint").fit(
        [d for d in letters if d.label == "c"]
    )
    errors = fitted.fit_report_.reproduction_errors
    assert summary["demonstrations"] == 6
    assert summary["units"] == "mm"
    assert summary["reproduction_error"] == pytest.approx(np.sqrt(np.mean(errors**2)))
    assert summary["sensor_noise_stds"]["y"] == pytest.approx(np.sqrt(fitted.primitive_.observation_variances[1]))
    assert (summary["em_converged"], summary["em_iterations"]) == (None, None)  # of the paper's weights only
    paper = ("--weight-model", "pooled", "--weight-uncertainty", "independent")
    model = tmp_path / "m.probdmp"
    document = run_json("fit", folder / "letters.npz", "-o", model, "--label", "c", "--n-basis", 8, *paper)
    (summary,) = document["primitives"]
    chosen = ProbabilisticDMP(8, **PAPERS_WEIGHTS).fit([d for d in letters if d.label == "c"])
    assert load(model).primitive_.identity == chosen.primitive_.identity
    assert summary["em_converged"] is chosen.fit_report_.observation_noise.converged


def test_recordings_without_labels_make_one_primitive(folder, run_json, run, tmp_path):
    model = tmp_path / "m.probdmp"
    assert len(run_json("fit", folder / "unlabelled.npz", "-o", model, "--n-basis", 8)["primitives"]) == 1
    assert load(model).primitive_.identity == load(folder / "c.probdmp").primitive_.identity
    assert "(no label)" in run("inspect", model).stdout


def test_several_files_are_learned_together(folder, run_json, tmp_path):
    files = folder / "letters.npz", folder / "blocked.npz"
    document = run_json("fit", *files, "-o", tmp_path / "m.probdmp", "--n-basis", 8)
    assert [p["demonstrations"] for p in document["primitives"]] == [8, 8]


def test_published_is_the_papers_configuration(folder, run, run_json, tmp_path):
    model = tmp_path / "m.probdmp"
    run_json("fit", folder / "letters.npz", "-o", model, "--published", "--n-basis", 8, "--forcing-noise", "posterior")
    published = ProbabilisticDMP.as_published(8, forcing_noise="posterior")
    assert load(model, "c").get_params() == published.get_params()
    clash = run("fit", folder / "letters.npz", "-o", model, "--published", "--scaling", "none")
    assert (clash.exit_code, "the paper's configuration decides" in clash.stderr.lower()) == (2, True)
    clash = run("fit", folder / "letters.npz", "-o", model, "--published", "--weight-model", "hierarchical")
    assert (clash.exit_code, "any of --discretization, --scaling, --weight-model" in clash.stderr) == (2, True)
    alone = run("fit", folder / "letters.npz", "-o", model, "--scaling", "paper")
    assert (alone.exit_code, 'Use weight_model="pooled"' in " ".join(alone.stderr.split())) == (2, True)


def test_degrees_of_freedom_left_out_of_scaling_are_named(run, run_json, tmp_path):
    loop = np.linspace(0, 2 * np.pi, 60)
    rng = np.random.default_rng(0)
    paths = [np.column_stack([loop, np.sin(loop)]) + 0.01 * rng.standard_normal((60, 2)) for _ in range(3)]
    data, model = tmp_path / "d.npz", tmp_path / "m.probdmp"
    write_demonstrations(data, [Demonstration(path, 0.02, names=("x", "y")) for path in paths])
    arguments = ("fit", data, "-o", model, "--scaling", "paper", "--n-basis", 8)
    arguments += ("--weight-model", "pooled", "--weight-uncertainty", "independent")
    assert run_json(*arguments)["primitives"][0]["not_scaled"] == ["y"]
    assert "scaled" in run(*arguments).stdout
    assert "scaling paper (not y)" in run("inspect", model).stdout


def test_columns_choose_the_positions(folder, run, run_json, tmp_path):
    arguments = ("fit", folder / "letters.npz", "-o", tmp_path / "m.probdmp", "--n-basis", 8)
    assert run_json(*arguments, "--columns", "y")["primitives"][0]["names"] == ["y"]
    assert run(*arguments, "--columns", "p,q").exit_code == 2


def test_a_table_tells_duration_error_noise_and_iterations(folder, run, tmp_path):
    output = run("fit", folder / "letters.npz", "-o", tmp_path / "m.probdmp", "--n-basis", 8).stdout
    for words in ("duration", "[% of range]", "std [mm]", "iterations", "failure detector"):
        assert words in output


def test_demonstrations_that_cannot_be_learned_are_named(run, tmp_path):
    gaps = np.zeros((20, 1))
    gaps[0] = np.nan
    write_demonstrations(tmp_path / "d.npz", [Demonstration(gaps, 0.02, "gappy", ("x",))])
    result = run("fit", tmp_path / "d.npz", "-o", tmp_path / "m.probdmp")
    assert result.exit_code == 3
    assert "'gappy'" in result.stderr
    assert not (tmp_path / "m.probdmp").exists()


def test_help_names_every_choice(run):
    shown = run("fit", "--help").stdout
    for choice in (*FORCING_NOISES, *SCALINGS, *DISCRETIZATIONS):
        assert choice in shown


def test_inspect_shows_everything(folder, run, run_json):
    document = run_json("inspect", folder / "letters.probdmp")
    reference = PrimitiveLibrary.load(folder / "letters.probdmp")
    detector = load_detector(folder / "letters.probdmp")
    assert document["schema"] == "probdmp.primitive/1"
    assert document["digest"] == "valid"
    assert document["provenance"]["probdmp"]
    for summary in document["primitives"]:
        primitive = reference[summary["label"]].primitive_
        assert summary["identity"] == primitive.identity
        assert summary["configuration"]["n_basis"] == 8
    told = document["detector"]
    assert (told["rule"], told["false_alarm_rate"], told["statistic"]) == ("calibrated", 0.01, "trajectory")
    assert told["calibrations"] == json.loads(json.dumps([asdict(facts) for facts in detector.calibrations_]))
    assert [facts["task"] for facts in told["calibrations"]] == ["known", "nominal"]
    output = run("inspect", folder / "letters.probdmp").stdout
    wide = run("inspect", folder / "letters.probdmp", env={"COLUMNS": "300"}).stdout
    for words in ("8 basis functions", "exact", "scaling none", "predictive", "rule “calibrated”", "digest valid", "[mm]"):
        assert words in output
    for words in ("1 % false alarms per execution", "nominal", "7.69 %", "tail", "model-based, not guaranteed"):
        assert words in wide


def test_inspect_shows_the_papers_thresholds(folder, run, run_json):
    document, detector = run_json("inspect", folder / "paper.probdmp"), load_detector(folder / "paper.probdmp")
    for summary in document["primitives"]:
        threshold = document["detector"]["thresholds"][summary["label"]]
        assert threshold["minimum"] == detector.thresholds_[summary["identity"]].minimum
    assert "rule “paper”, log-likelihood per step" in run("inspect", folder / "paper.probdmp").stdout


def test_fit_calibrates_the_detector_it_saves(folder, run, run_json, tmp_path):
    arguments = ("fit", folder / "letters.npz", "-o", tmp_path / "m.probdmp", "--n-basis", 8, "--false-alarm-rate", 0.1)
    told = run_json(*arguments)["detector"]
    saved = load_detector(tmp_path / "m.probdmp")
    assert (saved.rule, saved.false_alarm_rate) == (told["rule"], told["false_alarm_rate"]) == ("calibrated", 0.1)
    assert told["calibrations"] == json.loads(json.dumps([asdict(facts) for facts in saved.calibrations_]))
    output = run(*arguments).stdout
    assert "With goal and duration told: 10 % false alarms per execution asked for, 7.69 % attainable with n = 12" in output
    assert "With only the start told" in output
    assert "empirical" in output


def test_the_papers_rule_on_request(folder, run, tmp_path):
    result = run("fit", folder / "letters.npz", "-o", tmp_path / "m.probdmp", "--n-basis", 8, "--rule", "paper")
    assert (result.exit_code, load_detector(tmp_path / "m.probdmp").rule) == (0, "paper")
    assert "false alarms" not in result.stdout


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--rule", "magic"), "--rule to be one of 'calibrated', 'paper', got 'magic'"),
        (("--rule", "paper", "--false-alarm-rate", 0.1), "--false-alarm-rate with --rule calibrated"),
        (("--false-alarm-rate", 1), "false_alarm_rate between 0 and 1"),
        (("--published", "--rule", "calibrated"), "Use --rule paper"),
    ],
)
def test_detectors_that_cannot_be_made(options, message, folder, run, tmp_path):
    result = run("fit", folder / "letters.npz", "-o", tmp_path / "m.probdmp", *options)
    assert (result.exit_code, result.stdout) == (2, "")
    assert message in result.stderr
    assert not (tmp_path / "m.probdmp").exists()


def test_too_few_demonstrations_to_calibrate_name_the_remedy(folder, run, tmp_path, letters):
    write_demonstrations(tmp_path / "d.npz", [*letters[:1], *letters[-3:]])
    arguments = ("fit", tmp_path / "d.npz", "-o", tmp_path / "m.probdmp", "--n-basis", 8)
    result = run(*arguments)
    assert (result.exit_code, result.stdout) == (2, "")
    assert "expected two or more demonstrations of everything, got one of 'c'" in result.stderr
    assert "--rule paper" in result.stderr
    assert run(*arguments, "--rule", "paper").exit_code == 0


def test_inspect_of_a_model_without_detector(folder, run, run_json):
    assert run_json("inspect", folder / "bare.probdmp")["detector"] is None
    assert "No failure detector" in run("inspect", folder / "bare.probdmp").stdout


def test_inspect_refuses_a_damaged_file(folder, run, tmp_path):
    payload = bytearray((folder / "c.probdmp").read_bytes())
    payload[-5] ^= 1
    damaged = tmp_path / "damaged.probdmp"
    damaged.write_bytes(payload)
    result = run("inspect", damaged)
    assert result.exit_code == 3
    assert "digest" in result.stderr
