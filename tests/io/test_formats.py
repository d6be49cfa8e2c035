"""One way in: the format is found by suffix or by what a folder holds, and the documentation lists what there is."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from lerobot_folders import write_v21
from ros_files import BEGIN, ROS_2, joint_state, write_bag

import probdmp
from probdmp import ProbabilisticDMP, read_demonstrations, synthetic_letters, write_demonstrations
from probdmp.detection import FailureDetector
from probdmp.errors import InputError
from probdmp.io import Selection
from probdmp.io.formats import FOLDERS, FORMATS

PAGE = Path(probdmp.__file__).parents[2] / "docs/how-to/formats.md"


def test_the_page_lists_what_there_is():
    rows = re.findall(
        r"^\| (\S[^|]*) \| `([^`|]+)` \| (?:`(\w+)` )?\| yes \| (yes|no) \| ([^|]+) \|$", PAGE.read_text(), flags=re.M
    )
    assert [(name, key, extra, written == "yes") for name, key, extra, written, _ in rows] == [
        (known.name, key, known.extra, known.write is not None) for key, known in {**FORMATS, **FOLDERS}.items()
    ]


def test_folders_are_known_by_what_is_in_them(tmp_path):
    messages = [("/joint_states", BEGIN + i * 10**7, joint_state(ROS_2, BEGIN + i * 10**7, [i, -i])) for i in range(5)]
    assert read_demonstrations(write_bag(tmp_path / "bag.npz", messages))[0].names == ("joint_a", "joint_b")
    assert len(read_demonstrations(write_v21(tmp_path / "set.csv"))) == 5
    for name in ("nothing", "nothing.txt"):
        (tmp_path / name).mkdir()
        with pytest.raises(InputError, match=r"or a folder with meta/info\.json, or a folder with metadata\.yaml"):
            read_demonstrations(tmp_path / name)


def test_topics_are_refused_where_there_are_none(tmp_path):
    for suffix in (suffix for suffix, known in FORMATS.items() if not known.has_topics):
        with pytest.raises(InputError, match=rf"no topic for f\{suffix}, .*Topics are in \.bag, \.db3, \.mcap, metadata\.yaml"):
            read_demonstrations(f"f{suffix}", topic="/pose")


def test_a_selection_is_checked_before_anything_is_read():
    for wrong in ({"dt": -1.0}, {"dt": float("nan")}):
        with pytest.raises(InputError, match="dt"):
            Selection(**wrong)
    assert Selection(columns=["x"]).columns == ("x",)


def test_a_model_refuses_recordings_of_other_joints_by_name(tmp_path):
    letters = synthetic_letters(4, letters="c", dt=0.02)
    taught = [replace(d, names=("shoulder", "elbow"), units="rad") for d in letters]
    learned = ProbabilisticDMP(8).fit(taught)
    detector = FailureDetector(rule="paper").fit(learned, taught)
    uses = (learned.track, learned.smooth, lambda d: learned.score_samples([d]), lambda d: detector.verdicts([d]))
    for names in (("shoulder", "wrist"), ("elbow", "shoulder")):
        write_demonstrations(tmp_path / "other.mcap", [replace(letters[0], names=names)])
        (other,) = read_demonstrations(tmp_path / "other.mcap")
        for use in uses:
            with pytest.raises(InputError, match=rf"\(shoulder, elbow\), got one with 2 \({', '.join(names)}\)"):
                use(other)
    (swapped,) = read_demonstrations(tmp_path / "other.mcap", columns=["shoulder", "elbow"])
    np.testing.assert_array_equal(swapped.positions, letters[0].positions[:, ::-1])
    write_demonstrations(tmp_path / "degrees.mcap", [replace(letters[0], names=("shoulder", "elbow"), units="deg")])
    for use in uses:
        with pytest.raises(InputError, match="recordings in rad, got one in deg"):
            use(read_demonstrations(tmp_path / "degrees.mcap")[0])
