"""A real robot that pauses while it traces a symbol: late, not lost."""

from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat

from probdmp import FailureDetector, ProbabilisticDMP
from probdmp.demonstrations import Demonstration

DT, EVERY = 0.01, 10
"""Seconds between the samples that are used, every tenth of about a thousand per second."""
SHORTEST_PAUSE = 20
"""Samples."""


def speeds(positions, window=9):
    velocities = np.gradient(positions, axis=0)
    smooth = [np.convolve(v, np.ones(window) / window, "same") for v in velocities.T]
    return np.linalg.norm(smooth, axis=0)


def pauses(positions):
    """(first, last) samples of every pause between the first movement and the last."""
    still = speeds(positions) < 0.1 * np.quantile(speeds(positions), 0.9)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], still, [0]]).astype(int)))
    return [(a, b) for a, b in zip(edges[::2], edges[1::2], strict=True) if b - a > SHORTEST_PAUSE]


def without_pauses(positions):
    keep = np.ones(len(positions), dtype=bool)
    for a, b in pauses(positions):
        keep[a:b] = False
    return Demonstration(positions[keep], DT, names=("x", "y", "z"), units="m")


@pytest.fixture(scope="module")
def traces(recordings: Path):
    """Six recordings, (T, 3) arrays, from the first movement to the last."""
    symbols = loadmat(recordings / "panda_pauses" / "symbol17_data.mat", squeeze_me=True, struct_as_record=False)
    found = []
    for symbol in symbols["symbol_data"]:
        positions = np.ascontiguousarray(symbol.pos.T)[::EVERY]
        moving = np.flatnonzero(speeds(positions) > 0.1 * np.quantile(speeds(positions), 0.9))
        found.append(positions[moving[0] : moving[-1] + 1])
    return found


@pytest.mark.parametrize(("k", "noticed_at_once"), [(1, True), (2, True), (5, False)])
def test_a_paused_robot_is_late_and_never_on_a_wrong_path(traces, k, noticed_at_once):
    """Taught by the other five without their pauses; told the time that the movement takes without them.

    The first pause of the last one is 6 % of its movement, which is too short to be sure of.
    """
    training = [without_pauses(t) for i, t in enumerate(traces) if i != k]
    learned = ProbabilisticDMP().fit(training)
    detector = FailureDetector().fit(learned, training)
    path, moving = traces[k], without_pauses(traces[k])
    execution = learned.execute(path[0], path[-1], moving.duration, DT, detector)
    first, kinds = pauses(path)[0][0], []
    for t, row in enumerate(path):
        execution.step(row)
        if execution.failed:
            assert t >= first
            kinds.append((execution.verdict.kind, execution.verdict.cause))
    assert kinds
    assert {kind for kind, _ in kinds} == {"timing"}
    assert {cause for _, cause in kinds} <= {"held", "slow", "paused"}
    if noticed_at_once:
        assert execution.verdict.time <= pauses(path)[0][1] * DT
