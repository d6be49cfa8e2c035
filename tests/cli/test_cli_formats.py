"""Files of other programs on the command line, from the recording to the result."""

import numpy as np
from scipy.io import savemat

from probdmp import synthetic_letters


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
