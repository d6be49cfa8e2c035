"""`probdmp rollout`, `track` and `smooth`."""

import numpy as np
import pytest

from probdmp import PrimitiveLibrary, read_demonstrations, write_demonstrations
from probdmp.demonstrations import Demonstration

ARRAYS = ("times", "positions", "velocities", "accelerations", "position_stds", "velocity_stds", "acceleration_stds")
TRACKED = ("log_likelihoods", "contributions", "innovations", "innovation_variances")


@pytest.fixture(scope="session")
def library(folder):
    return PrimitiveLibrary.load(folder / "letters.probdmp")


def assert_same(document, trajectory, names):
    for name in names:
        np.testing.assert_array_equal(np.array(document[name], dtype=float), getattr(trajectory, name))


def test_rollout_is_that_of_the_library(folder, library, run_json):
    document = run_json("rollout", folder / "letters.probdmp", "--label", "l")
    assert_same(document, library["l"].rollout(), ARRAYS)
    assert (document["label"], document["names"], document["units"]) == ("l", ["x", "y"], "mm")


def test_rollout_takes_a_task(folder, library, run_json):
    options = ("--start", "-1,2", "--goal", "3,-4.5", "--duration", "2", "--dt", "0.05", "--start-velocity", "0,-1")
    document = run_json("rollout", folder / "letters.probdmp", "--label", "c", *options)
    planned = library["c"].rollout([-1, 2], [3, -4.5], 2, 0.05, [0, -1])
    assert_same(document, planned, ARRAYS)


def test_the_file_holds_the_same_arrays(folder, run_json, tmp_path):
    document = run_json("rollout", folder / "c.probdmp", "-o", tmp_path / "r.npz")
    with np.load(tmp_path / "r.npz") as saved:
        assert set(saved) == {"label", "names", "units", *ARRAYS}
        assert saved["names"].tolist() == ["x", "y"]
        for name in ARRAYS:
            np.testing.assert_array_equal(saved[name], np.array(document[name]))


def test_track_is_that_of_the_library(folder, library, run_json, letters, tmp_path):
    document = run_json("track", folder / "letters.probdmp", folder / "letters.npz", "--index", 7, "-o", tmp_path / "t.npz")
    tracked = library["l"].track(letters[7])
    assert_same(document, tracked, ARRAYS + TRACKED)
    assert document["log_likelihood"] == pytest.approx(tracked.log_likelihoods.sum())
    assert (document["label"], document["index"]) == ("l", 7)
    with np.load(tmp_path / "t.npz") as saved:
        kept = {f"sensors/position/{name}" for name in document["sensors"]["position"]}
        assert set(saved) == {"label", "index", "names", "units", "outputs", *ARRAYS, *TRACKED, *kept}


def test_the_index_counts_recordings_with_the_label(folder, run_json):
    model, data = folder / "letters.probdmp", folder / "letters.npz"
    assert (
        run_json("track", model, data, "--index", 1, "--label", "l")["positions"]
        == (run_json("track", model, data, "--index", 7)["positions"])
    )


def test_track_takes_a_task(folder, library, run_json, letters):
    options = ("--start", "0,0", "--goal", "1,1", "--duration", "3")
    document = run_json("track", folder / "letters.probdmp", folder / "letters.npz", *options)
    assert_same(document, library["c"].track(letters[0], start=[0, 0], goal=[1, 1], duration=3), ARRAYS + TRACKED)


def test_smooth_is_that_of_the_library(folder, library, run_json, letters):
    document = run_json("smooth", folder / "letters.probdmp", folder / "letters.npz", "--index", 2)
    assert_same(document, library["c"].smooth(letters[2]), ARRAYS)
    assert "log_likelihoods" not in document


def test_missing_samples_are_null(folder, run, run_json, letters, tmp_path):
    positions = np.array(letters[0].positions)
    positions[5:9, 1] = np.nan
    write_demonstrations(tmp_path / "gaps.npz", [Demonstration(positions, letters[0].dt, "c", ("x", "y"), "mm")])
    document = run_json("track", folder / "letters.probdmp", tmp_path / "gaps.npz")
    assert [row[1] for row in document["innovations"][4:10]].count(None) == 4
    assert (
        f"{len(positions) - 4} of {len(positions)} samples" in run("track", folder / "c.probdmp", tmp_path / "gaps.npz").stdout
    )


def test_recordings_without_label_are_executions_of_the_label_asked_for(folder, run, run_json):
    arguments = ("track", folder / "letters.probdmp", folder / "unlabelled.npz")
    assert run_json(*arguments, "--label", "c")["label"] == "c"
    assert run(*arguments).exit_code == 2


@pytest.mark.parametrize("verb", ["track", "smooth"])
def test_tables_show_about_twelve_times(verb, folder, run):
    assert run(verb, folder / "c.probdmp", folder / "letters.npz").stdout.count("±") == 12 * 2 + 1


def test_a_table_is_as_wide_as_eighty_columns_with_many_joints(run, tmp_path):
    rng = np.random.default_rng(0)
    names = tuple(f"q{i}" for i in range(1, 8))
    paths = [np.cumsum(rng.standard_normal((40, 7)), axis=0) for _ in range(2)]
    write_demonstrations(tmp_path / "arm.npz", [Demonstration(path, 0.02, "", names, "rad") for path in paths])
    assert run("fit", tmp_path / "arm.npz", "-o", tmp_path / "arm.probdmp", "--n-basis", 5).exit_code == 0
    output = run("track", tmp_path / "arm.probdmp", tmp_path / "arm.npz", env={"COLUMNS": "80"}).stdout
    assert max(map(len, output.splitlines())) <= 80
    for name in names:
        assert f"{name} [rad]" in output


def test_positions_in_other_units_are_refused(folder, run, letters, tmp_path):
    other = [Demonstration(d.positions / 1000, d.dt, d.label, d.names, "m") for d in letters]
    write_demonstrations(tmp_path / "metres.npz", other)
    result = run("track", folder / "letters.probdmp", tmp_path / "metres.npz")
    assert result.exit_code == 3
    assert "expected positions in mm" in result.stderr


def test_columns_of_the_recordings_may_come_in_another_order(folder, run_json, letters, tmp_path):
    renamed = [Demonstration(d.positions[:, ::-1], d.dt, d.label, ("y", "x"), "mm") for d in letters]
    write_demonstrations(tmp_path / "yx.npz", renamed)
    assert read_demonstrations(tmp_path / "yx.npz")[0].names == ("y", "x")
    swapped = run_json("track", folder / "letters.probdmp", tmp_path / "yx.npz")
    assert swapped["positions"] == run_json("track", folder / "letters.probdmp", folder / "letters.npz")["positions"]
