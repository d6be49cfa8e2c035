"""`probdmp monitor` over files and over JSON lines."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from probdmp import PrimitiveLibrary, load_detector, write_demonstrations
from probdmp.dmp import task_for


def stream_of(recording, **task):
    """A recording as JSON lines, NaN as null."""
    lines = [{"task": {"label": recording.label, "dt": recording.dt, **task}}]
    lines += [{"position": [None if np.isnan(p) else p for p in row]} for row in recording.positions.tolist()]
    return "".join(json.dumps(line) + "\n" for line in lines)


def answers(result):
    return [json.loads(line) for line in result.stdout.splitlines()]


def test_verdicts_are_those_of_the_library(folder, run_json, blocked):
    document = run_json("monitor", folder / "letters.probdmp", folder / "blocked.npz", exit_code=4)
    verdicts = load_detector(folder / "letters.probdmp").verdicts(blocked)
    assert document["failed"] == sum(v.failed for v in verdicts) == 2
    for index, (execution, verdict, recording) in enumerate(zip(document["executions"], verdicts, blocked, strict=True)):
        assert (execution["label"], execution["index"]) == (recording.label, index)
        assert execution["failed"] is verdict.failed
        assert execution["test_ratio"] == verdict.test_ratio
        assert (execution["time"], execution["step"], execution["phase"]) == (verdict.time, verdict.step, verdict.phase)
        assert execution["contributions"] == dict(zip("xy", verdict.contributions.tolist(), strict=True))
        assert (execution["kind"], execution["cause"]) == (verdict.kind or None, verdict.cause or None)
        assert (execution["channel"], execution["better"]) == (verdict.channel or None, verdict.better or None)
        assert execution["is_stale"] is execution["has_sensor_fault"] is False
        assert (execution["false_alarm_rate"], execution["guarantee"]) == (0.01, "model-based, not guaranteed")
    assert {e["kind"] for e in document["executions"] if e["failed"]} == {"timing"}
    assert document["detector"]["calibrations"][0]["n"] == 12


def test_the_papers_rule_gives_no_reasons(folder, run, run_json):
    document = json.loads(run("monitor", folder / "paper.probdmp", folder / "blocked.npz", "--json").stdout)
    for execution in document["executions"]:
        assert execution["kind"] is execution["guarantee"] is None
    assert document["detector"]["rule"] == "paper"


def test_fine_executions_give_exit_code_0(folder, run_json):
    document = run_json("monitor", folder / "letters.probdmp", folder / "letters.npz")
    assert document["failed"] == 0
    assert len(document["executions"]) == 12


def test_a_readable_line_for_each_recording(folder, run, blocked):
    result = run("monitor", folder / "letters.probdmp", folder / "blocked.npz")
    verdicts = load_detector(folder / "letters.probdmp").verdicts(blocked)
    expected = [f"{d.label} {i}  {v}" for i, (d, v) in enumerate(zip(blocked, verdicts, strict=True))]
    *lines, count, calibration = result.stdout.splitlines()
    assert (lines, count) == (expected, "2 of 4 executions failed.")
    assert calibration.startswith("With only the start told: 1 % false alarms per execution asked for")
    assert re.search(r"failed at \d\.\d+ s \(phase 0\.\d+\) \[timing: held\]: test ratio \d\.\d+, mostly [+−][xy]", lines[1])
    assert result.exit_code == 4


def test_the_label_chooses_recordings(folder, run_json):
    document = run_json("monitor", folder / "letters.probdmp", folder / "blocked.npz", "--label", "l", exit_code=4)
    assert [execution["label"] for execution in document["executions"]] == ["l", "l"]


def test_the_task_is_told(folder, run_json, blocked):
    document = run_json("monitor", folder / "letters.probdmp", folder / "blocked.npz", "--goal", "50,50", exit_code=4)
    library = PrimitiveLibrary.load(folder / "letters.probdmp")
    tasks = [task_for(library[d.label].primitive_, d.positions[0], [50, 50]) for d in blocked]  # in the learned time
    verdicts = load_detector(folder / "letters.probdmp").verdicts(blocked, tasks=tasks)
    assert [e["test_ratio"] for e in document["executions"]] == [v.test_ratio for v in verdicts]


def test_a_model_without_detector_is_refused_with_the_remedy(folder, run):
    result = run("monitor", folder / "bare.probdmp", folder / "letters.npz")
    assert result.exit_code == 3
    assert "expected a failure detector in" in result.stderr
    assert "probdmp fit" in result.stderr


@pytest.mark.parametrize("k", range(4))
def test_json_lines_give_the_verdict_of_the_file(k, folder, run, run_json, blocked):
    file = run_json("monitor", folder / "letters.probdmp", folder / "blocked.npz", exit_code=4)["executions"][k]
    result = run("monitor", folder / "letters.probdmp", "-", text=stream_of(blocked[k]))
    steps = answers(result)
    assert result.exit_code == (4 if file["failed"] else 0)
    assert [step["failed"] for step in steps] == [file["failed"] and t >= file["step"] for t in range(len(steps))]
    last = steps[-1]
    assert (last["kind"], last["cause"], last["better"]) == (file["kind"], file["cause"], file["better"])
    for step in steps:
        assert (step["kind"] is not None) == step["failed"]
        assert step["is_stale"] is step["has_sensor_fault"] is False
    if file["failed"]:  # of the first of several moments that one sample completes
        assert steps[file["step"]]["test_ratio"] > 1


def test_json_lines_without_a_task_give_the_verdict_of_the_file(folder, run, run_json, letters, tmp_path):
    """Neither is told anything: start as first seen, goal and duration as learned; also where the first row is missing."""
    for k, positions in enumerate((letters[0].positions, letters[1].positions[3:], letters[2].positions)):
        positions = np.array(positions)
        if k == 2:
            positions[0, 1] = np.nan
        recording = replace(letters[k], positions=positions)
        write_demonstrations(tmp_path / "one.npz", [recording])
        text = stream_of(recording).split("\n", 1)[1]
        steps = answers(run("monitor", folder / "c.probdmp", "-", text=text))
        (file,) = json.loads(run("monitor", folder / "c.probdmp", tmp_path / "one.npz", "--json").stdout)["executions"]
        assert steps[-1]["failed"] is file["failed"]
        ratios = [step["test_ratio"] for step in steps]
        if file["failed"]:  # of the first of several moments that one sample completes, of which a step tells the largest
            assert max(ratios[: file["step"]], default=0) <= 1 < file["test_ratio"] <= ratios[file["step"]] * (1 + 1e-9)
        else:
            assert file["test_ratio"] == pytest.approx(max(ratios), rel=1e-9, abs=1e-9)
            assert ratios[file["step"]] == pytest.approx(max(ratios), rel=1e-9, abs=1e-9)


def test_an_answer_per_tick_is_that_of_the_execution(folder, run, blocked):
    recording = blocked[1]
    result = run("monitor", folder / "letters.probdmp", "-", text=stream_of(recording, duration=recording.duration))
    library, detector = PrimitiveLibrary.load(folder / "letters.probdmp"), load_detector(folder / "letters.probdmp")
    execution = library["c"].execute(
        start=recording.positions[0], duration=recording.duration, dt=recording.dt, detector=detector
    )
    for answer, position in zip(answers(result), recording.positions, strict=True):
        step = execution.step(position)
        for name in ("time", "log_likelihood", "test_ratio"):
            assert answer[name] == getattr(step, name)
        for name in ("position", "velocity", "acceleration"):
            assert answer[name] == getattr(step, name).tolist()
        assert answer["failed"] is execution.failed


def test_options_stand_in_for_the_task(folder, run, blocked):
    recording = blocked[1]
    told = stream_of(recording, goal=[1, 2], duration=recording.duration)
    untold = told[told.index("\n") + 1 :]
    options = ("--label", "c", "--goal", "1,2", "--dt", recording.dt, "--duration", recording.duration)
    from_options = run("monitor", folder / "letters.probdmp", "-", *options, text=untold)
    assert from_options.stdout == run("monitor", folder / "letters.probdmp", "-", text=told).stdout


def test_hold_commands_rest_after_the_alarm(folder, run, blocked):
    result = run("monitor", folder / "letters.probdmp", "-", "--on-alarm", "hold", text=stream_of(blocked[1]))
    held = [step for step in answers(result) if step["failed"]]
    assert held
    assert all(step["velocity"] == [0, 0] and step["position"] == held[0]["position"] for step in held)


def test_missing_measurements_are_null(folder, run):
    lines = ['{"position": [null, 8]}', '{"position": null}', "", '{"position": [null, null], "time": 0.04}']
    result = run("monitor", folder / "c.probdmp", "-", text="\n".join(lines))
    assert result.exit_code in (0, 4)
    assert [a["log_likelihood"] == 0 for a in answers(result)] == [False, True, True]


def test_late_observations_are_used_at_their_time(folder, run, letters):
    first, fifth = letters[0].positions[[0, 5]].tolist()
    lines = [json.dumps({"position": first}), json.dumps({"position": fifth, "time": 0.1})]
    steps = answers(run("monitor", folder / "c.probdmp", "-", "--dt", "0.02", text="\n".join(lines)))
    assert [step["time"] for step in steps] == pytest.approx([0.02, 0.12])


GOOD = '{"position": [1, 2]}'


@pytest.mark.parametrize(
    ("lines", "line", "words"),
    [
        ([GOOD, "nonsense"], 2, "a JSON object"),
        ([GOOD, "[1, 2]"], 2, "a JSON object"),
        ([GOOD, '{"position": [1, NaN]}'], 2, "use null"),
        ([GOOD, "", '{"position": [1]}'], 3, r"shape \(2,\)"),
        ([GOOD, '{"position": [1, 1e400]}'], 2, "finite"),
        ([GOOD, '{"position": [1, "2"]}'], 2, "real numbers"),
        ([GOOD, '{"position": [1, true]}'], 2, "numbers or null"),
        ([GOOD, '{"position": 1}'], 2, "numbers or null"),
        ([GOOD, '{"pos": [1, 2]}'], 2, '"position"'),
        ([GOOD, '{"position": [1, 2], "time": "now"}'], 2, "time"),
        ([GOOD, '{"position": [1, 2], "time": 1' + "0" * 400 + "}"], 2, "time"),
        ([GOOD, '{"task": {}}'], 2, '"position"'),
        ([GOOD, '{"position": ' + "[" * 50_000], 2, "a JSON object"),
        ([GOOD, '{"position": [' + "1," * 100_000], 2, "bytes"),
        (['{"task": {"goal": [1]}}'], 1, "goal of shape"),
        (['{"task": {"goals": [1, 2]}}'], 1, "a task with some of"),
        (['{"task": {"label": "q"}}'], 1, "'c', 'l'"),
        (['{"task": {"label": ["c"]}}'], 1, "'c', 'l'"),
        (['{"task": {"dt": -1}}'], 1, "dt > 0"),
        (['{"task": 1}'], 1, "a task with some of"),
        (['{"position": [1]}'], 1, r"shape \(2,\)"),
    ],
)
def test_malformed_lines_are_refused_with_their_number(lines, line, words, folder, run):
    result = run("monitor", folder / "letters.probdmp", "-", "--label", "c", text="\n".join(lines) + "\n")
    assert result.exit_code == 3
    assert f"on line {line}, got" in result.stderr
    assert result.stderr.count("\n") == 1
    assert re.search(words, result.stderr)
    assert len(answers(result)) == sum(bool(text.strip()) for text in lines[: line - 1])


def test_nothing_on_standard_input_is_bad_input(folder, run):
    result = run("monitor", folder / "c.probdmp", "-", text="")
    assert (result.exit_code, result.stdout) == (3, "")
    assert "at least one tick" in result.stderr


@pytest.mark.parametrize(
    "arguments", [["-"], ["-", "--label", "q"], ["-", "--label", "c", "--dt", "0"], ["-", "--label", "c", "--goal", "1"]]
)
def test_options_that_do_not_fit_the_model_are_usage_errors(arguments, folder, run):
    assert run("monitor", folder / "letters.probdmp", *arguments, text=GOOD).exit_code == 2


@pytest.mark.parametrize("option", [("--on-alarm", "hold"), ("--feedback", "none"), ("-",)])
def test_options_for_json_lines_are_refused_with_a_file(option, folder, run):
    assert run("monitor", folder / "letters.probdmp", folder / "letters.npz", *option).exit_code == 2


def test_recordings_are_resampled_to_a_rate_that_is_asked_for(folder, run_json):
    by_rate = {dt: run_json("track", folder / "c.probdmp", folder / "letters.npz", "--dt", dt)["times"] for dt in (0.02, 0.04)}
    assert len(by_rate[0.02]) in (2 * len(by_rate[0.04]) - 1, 2 * len(by_rate[0.04]))


def test_an_unknown_reaction_is_a_usage_error(folder, run):
    assert run("monitor", folder / "c.probdmp", "-", "--on-alarm", "panic", text=GOOD).exit_code == 2
