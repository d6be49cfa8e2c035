"""Every message in docs/troubleshooting.md is one that probdmp says, word for word but for what stands for `…`."""

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from program import run_program
from ros_files import ROS_1, joint_state, pose_stamped, write_bag
from scipy.io import savemat

from probdmp import (
    Demonstration,
    FailureDetector,
    PrimitiveLibrary,
    ProbabilisticDMP,
    ProbDMPError,
    Task,
    demonstration_from_times,
    load,
    read_demonstrations,
    synthetic_letters,
    write_demonstrations,
)
from probdmp.execution import ChannelSensor, LinearSensor, NonlinearSensor, state_sensor
from probdmp.plotting.style import require_matplotlib

PAGE = Path(__file__).parent.parent / "docs/troubleshooting.md"
QUOTED = re.findall(r"^### `(.*)`$", PAGE.read_text(), flags=re.M)

PATH = np.linspace(0.0, 1.0, 60)[:, None] ** [1.0, 2.0]
ONE = Demonstration(PATH, 0.01)
GAP = np.where(np.arange(60)[:, None] < 10, np.nan, PATH)
LETTERS = synthetic_letters(4, letters="c", dt=0.02)
OTHERS = synthetic_letters(4, letters="c", dt=0.02, seed=1)


def dmp(**settings: Any) -> ProbabilisticDMP:
    return ProbabilisticDMP(8, **settings).fit(LETTERS)


def watched_by_a_function(learned: ProbabilisticDMP) -> FailureDetector:
    sensor = NonlinearSensor("squares", lambda q: q**2, [1.0, 1.0], outputs=("x", "y"))
    return FailureDetector(rule="paper").fit(learned, LETTERS, sensors=[sensor])


def both_topics() -> list[tuple[str, int, Any]]:
    states = [("/joint_states", i, joint_state(ROS_1, i, [1.0, 2.0])) for i in range(3)]
    return [*states, *(("/tool", i, pose_stamped(ROS_1, i, [1.0, 2.0, 3.0])) for i in range(3))]


def detector(learned: ProbabilisticDMP) -> FailureDetector:
    return FailureDetector(0.3).fit(learned, LETTERS)


PROVOKED: list[Callable[[], Any]] = [
    lambda: ProbabilisticDMP().fit(PATH, dt=0.01),
    lambda: ProbabilisticDMP().fit("letters.npz"),
    lambda: ProbabilisticDMP().fit([PATH]),
    lambda: Demonstration(PATH[:, 0], 0.01),
    lambda: Demonstration(PATH[:2], 0.01),
    lambda: Demonstration(np.where(PATH > 0.9, np.inf, PATH), 0.01),
    lambda: Demonstration([["1.0", "2.0"]] * 9, 0.01),
    lambda: Demonstration(PATH, -0.01),
    lambda: Demonstration(PATH, 0.01, names=("x", "x")),
    lambda: ProbabilisticDMP().fit([ONE, Demonstration(PATH, 0.01, names=("x", "y"))]),
    lambda: ProbabilisticDMP().fit([Demonstration(GAP, 0.01)]),
    lambda: ProbabilisticDMP().fit([Demonstration(1e-60 * PATH, 0.01)]),
    lambda: demonstration_from_times([0.0, 0.1, 0.1], PATH[:3]),
    lambda: ProbabilisticDMP(scaling="paper", weight_uncertainty="independent").fit([ONE]),
    lambda: ProbabilisticDMP(n_basis=0).fit([ONE]),
    lambda: ProbabilisticDMP(weight_model="bayes").fit([ONE]),
    lambda: dmp(channels=["force"]),
    lambda: dmp(channels=["force"], weight_uncertainty="independent"),
    lambda: ProbabilisticDMP().rollout(),
    lambda: dmp().rollout(goal=[1.0, 2.0, 3.0]),
    lambda: dmp().rollout(duration=1000, dt=0.001),
    lambda: dmp(discretization="semi_implicit_euler").rollout(dt=0.2),
    lambda: dmp().execute().step([1.0]),
    lambda: dmp().track(np.zeros((50, 3)), dt=0.01),
    lambda: dmp().track(Demonstration(PATH, 0.01, names=("x", "y"), units="m")),
    lambda: dmp(weight_uncertainty="independent").condition([(0.2, [0.0, 0.0], 0.1)]),
    lambda: dmp().condition([(20.0, [0.0, 0.0], 0.1)]),
    lambda: (p := dmp()).track(LETTERS[0], sensors=[state_sensor(p.primitive_, "gyro", "velocity", 0.1)]),
    lambda: dmp().execute().step({"x": 1.0}),
    lambda: dmp().execute(sensors=[ChannelSensor("force", np.array([1.0]))]),
    lambda: LinearSensor("mix", np.ones((2, 6)), np.array([[1.0, 2.0], [2.0, 1.0]])),
    lambda: (p := dmp()).execute(
        sensors=[state_sensor(p.primitive_, "gyro", "velocity", 0.1)], detector=FailureDetector(rule="paper").fit(p, LETTERS)
    ),
    lambda: (p := dmp()).save("squares.probdmp", watched_by_a_function(p)),
    lambda: FailureDetector(1.5).fit(dmp(), LETTERS),
    lambda: FailureDetector().predict(LETTERS),
    lambda: FailureDetector().fit(dmp(), OTHERS),
    lambda: FailureDetector(calibration="held_out").fit(dmp(), LETTERS),
    lambda: FailureDetector().fit(dmp(weight_model="pooled", weight_uncertainty="independent"), LETTERS),
    lambda: FailureDetector().fit(ProbabilisticDMP(8).fit(LETTERS[:1]), LETTERS[:1]),
    lambda: ProbabilisticDMP(8).fit(OTHERS).execute(detector=detector(dmp())),
    lambda: FailureDetector(0.3).fit(PrimitiveLibrary({"c": dmp()}), {"c": LETTERS}).predict(synthetic_letters(1, letters="o")),
    lambda: detector(dmp()).predict(LETTERS, tasks=[Task([0.0, 0.0], [1.0, 1.0], 1.0)]),
    lambda: PrimitiveLibrary({"c": dmp()})["d"],
    lambda: read_demonstrations("letters.txt"),
    lambda: read_demonstrations("letters.csv", topic="/joint_states"),
    lambda: (Path("new.mat").write_bytes(b"MATLAB 7.3 MAT-file"), read_demonstrations("new.mat")),
    lambda: (write_bag(Path("two.bag"), both_topics(), ROS_1), read_demonstrations("two.bag")),
    lambda: (savemat("bare.mat", {"pos": PATH}), read_demonstrations("bare.mat")),
    lambda: read_demonstrations("nowhere.npz"),
    lambda: (Path("broken.npz").write_text("x"), read_demonstrations("broken.npz")),
    lambda: (
        write_demonstrations("named.npz", [Demonstration(PATH, 0.01, names=("left", "right"))]),
        np.savez("named.npz", **{k: v for k, v in np.load("named.npz").items() if k != "positions"}),
        read_demonstrations("named.npz"),
    ),
    lambda: (write_demonstrations("letters.npz", LETTERS), read_demonstrations("letters.npz", label="q")),
    lambda: (Path("broken.probdmp").write_bytes(b"12345678" * 9), load("broken.probdmp")),
    lambda: (PrimitiveLibrary({"c": dmp(), "d": dmp()}).save("two.probdmp"), load("two.probdmp")),
    lambda: ProbabilisticDMP(8).fit(OTHERS).save("c.probdmp", detector(dmp())),
]

SAID: list[tuple[str, ...]] = [
    ("fit", "letters.npz", "-o", "letters.txt"),
    ("fit", "single.npz", "-o", "single.probdmp"),
    ("rollout", "two.probdmp"),
    ("rollout", "two.probdmp", "--label", "c", "--goal", "1;2"),
    ("track", "two.probdmp", "letters.npz", "--label", "c", "--index", "9"),
    ("monitor", "two.probdmp", "letters.npz"),
    ("evaluate", "letters.npz"),
    ("monitor", "watched.probdmp", "-"),
    ("monitor", "watched.probdmp", "-", "--feedback", "camera"),
    ("monitor", "watched.probdmp", "letters.npz", "--sensors", "gyro.toml"),
    ("track", "watched.probdmp", "letters.npz", "--sensors", "noiseless.toml"),
    ("track", "watched.probdmp", "letters.npz", "--sensors", "single.toml"),
]
"""Commands that end in an error, after the files that they read were written."""


@pytest.fixture(scope="module")
def messages(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """What probdmp says when it is provoked."""
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path_factory.mktemp("trouble"))
        found = [_message(provoke) for provoke in PROVOKED]
        write_demonstrations("single.npz", LETTERS[:1])
        gyro = 'name = "gyro"\nmeasures = "velocity"\n'
        for name, text in (("gyro", "[[sensor]]\nstds = 1\n"), ("noiseless", "[[sensor]]\n"), ("single", "[sensor]\n")):
            Path(f"{name}.toml").write_text(text + gyro)
        learned = dmp()
        learned.save("watched.probdmp", detector(learned))
        ticks = json.dumps({"position": [1.0, 2.0]}) + "\n" + json.dumps({"positions": 3}) + "\n"
        found += [run_program(words, ticks).stderr.strip() for words in SAID]
        patch.setattr("probdmp.plotting.style.find_spec", lambda name: None)
        return [*found, _message(require_matplotlib)]


def _message(provoke: Callable[[], Any]) -> str:
    with pytest.raises(ProbDMPError) as caught:
        provoke()
    return str(caught.value)


def pattern(quoted: str) -> str:
    return ".*".join(re.escape(part) for part in quoted.split("…"))


@pytest.mark.parametrize("quoted", QUOTED)
def test_a_quoted_message_is_one_that_probdmp_says(quoted: str, messages: list[str]) -> None:
    assert any(re.fullmatch(pattern(quoted), message) for message in messages)


def test_what_probdmp_says_is_in_the_document(messages: list[str]) -> None:
    assert not [message for message in messages if not any(re.fullmatch(pattern(quoted), message) for quoted in QUOTED)]
