"""Files of other programs on the command line, from the recording to the result."""

import numpy as np
from ros_files import BEGIN, ROS_1, joint_state, pose_stamped, write_bag
from scipy.io import savemat

from probdmp import read_demonstrations, synthetic_arm_movements, synthetic_letters, write_demonstrations


def test_the_published_letters_run_the_experiment(run_json, tmp_path):
    """`mixoutALL_shifted.mat`, as the UCI Machine Learning Repository has it, with letters of our own."""
    letters = synthetic_letters(6, letters="cl")
    velocities, key = np.empty((1, len(letters)), dtype=object), np.empty((1, 2), dtype=object)
    for i, letter in enumerate(letters):
        signals = np.column_stack([letter.positions, np.sin(letter.times)])
        velocities[0, i] = np.pad(np.diff(signals, axis=0, prepend=np.zeros((1, 3))), ((4, 9), (0, 0))).T
    key[0, :] = ["c", "l"]
    labels = [1.0 + "cl".index(letter.label) for letter in letters]
    consts = {"charlabels": labels, "key": key, "dt": letters[0].dt}
    file = tmp_path / "mixoutALL_shifted.mat"
    savemat(file, {"mixout": velocities, "consts": consts})
    document = run_json("evaluate", file, "--train", 4, "--test", 2, "--detector", "paper")
    assert (document["classes"], document["false_alarms"]["n"]) == (2, 4)
    assert str(file) in document["command"]


def test_recordings_of_a_robot_teach_and_are_tracked(run, run_json, tmp_path):
    arm = [m.demonstration for m in synthetic_arm_movements(3, movements=("pour",))]
    for k, d in enumerate(arm):
        messages = []
        for time, positions in zip(d.times.tolist(), d.positions, strict=True):
            stamp = BEGIN + round(time * 1e9)
            messages.append(("/joint_states", stamp, joint_state(ROS_1, stamp, positions, d.names)))
            messages.append(("/tool", stamp, pose_stamped(ROS_1, stamp, positions[:3])))
        write_bag(tmp_path / f"pour_{k}.bag", messages, ROS_1)
    files = sorted(tmp_path.glob("*.bag"))
    refused = run("fit", *files, "-o", tmp_path / "m.probdmp")
    assert (refused.exit_code, "one topic with positions" in refused.stderr) == (3, True)
    document = run_json("fit", *files, "-o", tmp_path / "m.probdmp", "--topic", "/joint_states", "--n-basis", 8)
    assert [(p["label"], p["demonstrations"]) for p in document["primitives"]] == [("pour", 3)]
    converted = run_json("convert", files[0], tmp_path / "pour.mcap", "--topic", "/joint_states", "--label", "pour")
    assert converted["positions"] == list(arm[0].names)
    (read,) = read_demonstrations(tmp_path / "pour.mcap")
    np.testing.assert_array_equal(read.positions, arm[0].positions)
    tracked = run_json("track", tmp_path / "m.probdmp", tmp_path / "pour.mcap")
    assert tracked["label"] == "pour"
    write_demonstrations(tmp_path / "letter.mcap", synthetic_letters(1, letters="c"))
    wrong = run("track", tmp_path / "m.probdmp", tmp_path / "letter.mcap")
    assert wrong.exit_code == 3
    assert "'x', 'y'" in wrong.stderr
    assert "'q1', 'q2', 'q3'" in wrong.stderr
