"""Recordings on the command line: CSV files, several at once, `probdmp perturb`, `probdmp convert`, and the system."""

import json
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from probdmp import PrimitiveLibrary, read_demonstrations, write_demonstrations
from probdmp.cli.recordings import label_of_file
from probdmp.demonstrations import FAULTS, fault_generator, fault_named, perturb_executions


@pytest.fixture(scope="module")
def single_files(tmp_path_factory, letters):
    """One file without a label for each demonstration: c_0.csv … l_5.csv."""
    place = tmp_path_factory.mktemp("single")
    for k, d in enumerate(letters):
        write_demonstrations(place / f"{d.label}_{k % 6}.csv", [replace(d, label="")])
    return place


@pytest.mark.parametrize(
    ("file", "label"),
    [("reach_03.csv", "reach"), ("reach 3.csv", "reach"), ("reach (2).csv", "reach"), ("a-1.csv", "a"), ("a.csv", "a"),
     ("q7_pick.csv", "q7_pick"), ("007.csv", ""), ("pick.place-12.csv", "pick.place")],
)  # fmt: skip
def test_what_a_file_is_named_after(file, label, tmp_path):
    assert label_of_file(tmp_path / file) == label


def same_models(one, other):
    return {k: v.primitive_.identity for k, v in PrimitiveLibrary.load(one).items()} == {
        k: v.primitive_.identity for k, v in PrimitiveLibrary.load(other).items()
    }


def test_a_csv_file_is_as_good_as_an_npz_file(folder, run_json, tmp_path, letters):
    write_demonstrations(tmp_path / "letters.csv", letters)
    run_json("fit", tmp_path / "letters.csv", "-o", tmp_path / "m.probdmp", "--n-basis", 8)
    assert same_models(tmp_path / "m.probdmp", folder / "letters.probdmp")
    model = folder / "letters.probdmp"
    for verb in ("track", "smooth"):
        by_csv = run_json(verb, model, tmp_path / "letters.csv", "--index", 3)
        assert by_csv == run_json(verb, model, folder / "letters.npz", "--index", 3)
    by_csv, by_npz = (run_json("monitor", model, f) for f in (tmp_path / "letters.csv", folder / "letters.npz"))
    assert [e.pop("file") for e in by_csv["executions"] + by_npz["executions"]]
    assert by_csv == by_npz
    arguments = ("--train", 3, "--test", 2, "--detector", "paper")
    by_csv, by_npz = (run_json("evaluate", f, *arguments) for f in (tmp_path / "letters.csv", folder / "letters.npz"))
    assert "letters.csv" in by_csv.pop("command")
    assert "letters.npz" in by_npz.pop("command")
    assert by_csv == by_npz


def test_files_name_what_has_no_label(folder, run_json, tmp_path, single_files):
    files = sorted(single_files.glob("*.csv"))
    run_json("fit", *files, "-o", tmp_path / "m.probdmp", "--n-basis", 8)
    assert same_models(tmp_path / "m.probdmp", folder / "letters.probdmp")
    document = run_json("fit", *files, "-o", tmp_path / "m.probdmp", "--n-basis", 8, "--label", "c")
    assert [(p["label"], p["demonstrations"]) for p in document["primitives"]] == [("c", 6)]
    document = run_json("fit", *files[:6], "-o", tmp_path / "m.probdmp", "--n-basis", 8, "--label", "curve")
    assert [(p["label"], p["demonstrations"]) for p in document["primitives"]] == [("curve", 6)]
    document = run_json("fit", *files, "-o", tmp_path / "m.probdmp", "--n-basis", 8, "--label", "curve")
    assert [(p["label"], p["demonstrations"]) for p in document["primitives"]] == [("curve", 12)]


def test_executions_are_of_the_primitive_that_their_file_is_named_after(folder, run, run_json, single_files):
    files = single_files / "c_1.csv", single_files / "l_1.csv"
    document = run_json("monitor", folder / "letters.probdmp", *files)
    assert [(e["file"], e["label"], e["index"]) for e in document["executions"]] == [
        (str(files[0]), "c", 0),
        (str(files[1]), "l", 0),
    ]
    shown = run("monitor", folder / "letters.probdmp", *files).stdout.splitlines()
    assert [line.partition("  ")[0] for line in shown[:2]] == [f"{files[0]} c 0", f"{files[1]} l 0"]
    (only,) = run_json("monitor", folder / "letters.probdmp", files[0], "--label", "l", exit_code=4)["executions"]
    assert only["label"] == "l"
    assert run_json("track", folder / "letters.probdmp", files[1])["label"] == "l"
    (single_files / "run.csv").write_bytes(files[0].read_bytes())
    refused = run("monitor", folder / "letters.probdmp", single_files / "run.csv")
    assert (refused.exit_code, "--label to be one of those in the model" in refused.stderr) == (2, True)
    (single_files / "run.csv").unlink()


def test_files_without_times_need_dt(run, run_json, tmp_path, letters):
    lines = ["x,y", *(f"{x},{y}" for x, y in letters[0].positions)]
    (tmp_path / "c.csv").write_text("\n".join(lines))
    refused = run("convert", tmp_path / "c.csv", tmp_path / "c.npz")
    assert (refused.exit_code, "--dt 0.01 on the command line" in refused.stderr) == (3, True)
    assert run_json("convert", tmp_path / "c.csv", tmp_path / "c.npz", "--dt", 0.02)["dt"] == 0.02
    (read,) = read_demonstrations(tmp_path / "c.npz")
    assert read.fingerprint == letters[0].fingerprint
    assert run_json("convert", tmp_path / "c.npz", tmp_path / "d.csv", "--dt", 0.04)["dt"] == 0.04
    (slow,) = read_demonstrations(tmp_path / "d.csv")
    np.testing.assert_array_equal(slow.positions, letters[0].positions[::2])
    wrong = run("convert", tmp_path / "c.npz", tmp_path / "e.csv", "--topic", "/joint_states")
    assert (wrong.exit_code, "no topic for" in wrong.stderr) == (2, True)


def test_still_ends_are_cut_when_asked_for(run_json, tmp_path, letters):
    held = [np.vstack([[d.positions[0]] * 40, d.positions, [d.positions[-1]] * 40]) for d in letters[:6]]
    write_demonstrations(tmp_path / "held.npz", [replace(d, positions=p) for d, p in zip(letters, held, strict=False)])
    (whole,) = run_json("convert", tmp_path / "held.npz", tmp_path / "whole.npz")["movements"]
    (cut,) = run_json("convert", tmp_path / "held.npz", tmp_path / "cut.npz", "--trim")["movements"]
    assert whole["longest"] == pytest.approx(cut["longest"] + 80 * letters[0].dt, abs=7 * letters[0].dt)
    (told,) = run_json("fit", tmp_path / "held.npz", "-o", tmp_path / "m.probdmp", "--n-basis", 8, "--trim")["primitives"]
    assert told["duration"] < whole["shortest"]


def test_help_names_the_formats_that_there_are():
    from probdmp.cli.options import READ, WRITTEN
    from probdmp.io.formats import FOLDERS, FORMATS

    assert READ.split(", or a folder with ") == [", ".join(FORMATS), *([" or ".join(FOLDERS)] if FOLDERS else [])]
    assert ", ".join(suffix for suffix, known in FORMATS.items() if known.write) == WRITTEN


def test_resampling_is_said_on_standard_error(run, tmp_path):
    times = [0, 0.01, 0.017, 0.03, 0.044, 0.05]
    (tmp_path / "u.csv").write_text("t,x\n" + "".join(f"{t},{t}\n" for t in times))
    result = run("convert", tmp_path / "u.csv", tmp_path / "u.npz", "--json")
    assert result.exit_code == 0
    assert result.stderr.count("\n") == 1
    assert result.stderr.startswith("probdmp: ")
    assert "resampled along straight lines every 0.01 s" in result.stderr
    assert json.loads(result.stdout)["dt"] == 0.01


# Convert


def test_there_and_back_again(folder, run, run_json, tmp_path):
    document = run_json("convert", folder / "letters.npz", tmp_path / "l.csv")
    assert [(m["label"], m["demonstrations"], m["missing"]) for m in document["movements"]] == [("c", 6, 0), ("l", 6, 0)]
    assert (document["positions"], document["units"], document["channels"]) == (["x", "y"], "mm", [])
    run_json("convert", tmp_path / "l.csv", tmp_path / "l.npz")
    assert (tmp_path / "l.npz").read_bytes() == (folder / "letters.npz").read_bytes()
    shown = run("convert", tmp_path / "l.csv", tmp_path / "m.csv", "--label", "c").stdout
    for words in ("Positions x [mm], y [mm]", "0.02 s between", "movement", "Wrote 6 demonstrations to"):
        assert words in shown


def test_nothing_is_replaced_unasked(folder, run, tmp_path):
    (tmp_path / "l.csv").write_text("mine")
    refused = run("convert", folder / "letters.npz", tmp_path / "l.csv")
    assert (refused.exit_code, (tmp_path / "l.csv").read_text(), "Use --force" in refused.stderr) == (2, "mine", True)
    assert run("convert", folder / "letters.npz", tmp_path / "l.csv", "--force").exit_code == 0
    assert len(read_demonstrations(tmp_path / "l.csv")) == 12


def test_several_files_become_one(run_json, tmp_path, single_files):
    document = run_json("convert", *sorted(single_files.glob("c_*.csv")), tmp_path / "c.npz")
    assert [(m["label"], m["demonstrations"]) for m in document["movements"]] == [("c", 6)]


# Perturb


@pytest.mark.parametrize("fault", [*FAULTS, "push:0.4"])
@pytest.mark.parametrize("suffix", [".npz", ".csv"])
def test_every_fault(fault, suffix, folder, run_json, tmp_path, letters):
    output = tmp_path / f"o{suffix}"
    document = run_json("perturb", folder / "letters.npz", "--fault", fault, "--seed", 3, "-o", output)
    chosen = fault_named(fault)
    assert (document["fault"], document["nature"], document["seed"]) == (fault, chosen.nature, 3)
    written = read_demonstrations(output)
    for label in "cl":
        members = [k for k, d in enumerate(letters) if d.label == label]
        others = [d for d in letters if d.label != label]
        rng = fault_generator(3, label, chosen)
        expected, onsets = perturb_executions(chosen, [letters[k] for k in members], others, rng)
        for k, faulty, onset in zip(members, expected, onsets, strict=True):
            np.testing.assert_array_equal(written[k].positions, faulty.positions)
            told = document["executions"][k]
            assert (told["index"], told["label"], told["onset_sample"]) == (k, label, onset)
            assert told["onset_time"] == pytest.approx(onset * 0.02)
            assert chosen.takes_others or 0.25 < told["onset"] < 0.72


def test_an_onset_for_all(folder, run, run_json, tmp_path, letters):
    arguments = ("perturb", folder / "letters.npz", "--fault", "hold", "--onset", 0.5, "--label", "l", "--force")
    arguments = (*arguments, "-o", tmp_path / "o.csv")
    document = run_json(*arguments)
    assert [e["index"] for e in document["executions"]] == list(range(6, 12))
    for e, d, faulty in zip(document["executions"], letters[6:], read_demonstrations(tmp_path / "o.csv"), strict=True):
        assert e["onset_sample"] == d.n_samples // 2
        np.testing.assert_array_equal(faulty.positions[: d.n_samples // 2], d.positions[: d.n_samples // 2])
    first = (tmp_path / "o.csv").read_bytes()
    shown = run(*arguments).stdout
    assert (tmp_path / "o.csv").read_bytes() == first
    for words in ("Fault hold (failure), seed 0", "% of duration", "Wrote 6 executions to"):
        assert words in shown
    run_json(*arguments, "--seed", 1)
    assert (tmp_path / "o.csv").read_bytes() != first


def test_recordings_are_not_replaced_unless_asked_for(folder, run, tmp_path):
    mine = tmp_path / "mine.npz"
    mine.write_bytes((folder / "letters.npz").read_bytes())
    result = run("perturb", mine, "-o", mine)
    assert result.exit_code == 2
    assert "--force" in result.stderr
    assert mine.read_bytes() == (folder / "letters.npz").read_bytes()
    assert run("perturb", mine, "-o", mine, "--force").exit_code == 0


def test_what_is_perturbed_is_noticed(folder, run_json, tmp_path):
    run_json("perturb", folder / "letters.npz", "--fault", "hold", "-o", tmp_path / "o.csv")
    document = run_json("monitor", folder / "letters.probdmp", tmp_path / "o.csv", exit_code=4)
    assert document["failed"] >= 10


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--fault", "nope"], "fault to be one of 'hold'"),
        (["--fault", "hold:3"], "without a size"),
        (["--onset", "1"], "--onset as a fraction between 0 and 1"),
        (["--onset", "nan"], "--onset as a fraction between 0 and 1"),
        (["--fault", "wrong_class", "--onset", "0.5"], "no --onset with wrong_class"),
        (["--label", "q"], "--label to be one of those in the files: 'c', 'l'"),
        (["--seed", "-1"], "--seed"),
    ],
)
def test_what_cannot_be_perturbed(options, words, folder, run, tmp_path):
    result = run("perturb", folder / "letters.npz", "-o", tmp_path / "o.csv", *options)
    assert (result.exit_code, words in result.stderr) == (2, True)
    assert not (tmp_path / "o.csv").exists()


def test_wrong_class_needs_another_class(run, tmp_path, single_files):
    result = run("perturb", single_files / "c_0.csv", "--fault", "wrong_class", "-o", tmp_path / "o.csv")
    assert (result.exit_code, "executions of another class" in result.stderr) == (2, True)


# System


def test_the_system(run, run_json, monkeypatch):
    document = run_json("inspect", "--system")
    assert document["packages"]["numpy"] == np.__version__
    assert document["processors"] >= document["processors_allowed"] >= 1
    monkeypatch.setenv("PROBDMP_RECORDINGS", "/nowhere")
    monkeypatch.setattr("probdmp.cli.system.EXTRAS", {"plot": ("no-such-package",)})
    shown = run("inspect", "--system").stdout
    assert "pip install 'probdmp[plot]'" in shown
    assert "/nowhere, which is no folder" in shown
    for words in ("numpy", "scipy", "BLAS", "processors", "python"):
        assert words in shown


def test_the_system_names_every_extra_that_brings_something_to_those_who_use_it():
    from probdmp.cli.system import EXTRAS

    for_developers = {"test", "docs", "dev"}
    text = (Path(__file__).parents[2] / "pyproject.toml").read_text(encoding="utf-8")
    extras = tomllib.loads(text)["project"]["optional-dependencies"]
    brought = {name: tuple(line.split(">=")[0] for line in lines) for name, lines in extras.items()}
    assert brought == EXTRAS | {name: brought[name] for name in for_developers}


def test_inspect_wants_one_thing(folder, run):
    assert run("inspect").exit_code == 2
    assert run("inspect", folder / "c.probdmp", "--system").exit_code == 2
