"""Verdicts on many executions as arrays."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from probdmp.checks import BoolArray, FloatArray, IntArray
from probdmp.detection.judgement import Verdicts
from probdmp.detection.verdict import Verdict

__all__ = ["BatchJudgement"]


class BatchJudgement(NamedTuple):
    """What a detector says of N executions; see `probdmp.detection.verdict.Verdict` for each of these."""

    failed: BoolArray
    """(N,) array."""
    steps: IntArray
    """(N,) array."""
    times: FloatArray
    """(N,) array, seconds."""
    phases: FloatArray
    """(N,) array."""
    test_ratios: FloatArray
    """(N,) array."""
    kinds: NDArray[np.str_]
    """(N,) array of text; so are the following."""
    causes: NDArray[np.str_]
    channels: NDArray[np.str_]
    betters: NDArray[np.str_]
    blamed: NDArray[np.str_]
    is_stale: BoolArray
    """(N,) array."""
    has_sensor_fault: BoolArray
    """(N,) array."""

    @classmethod
    def of_judgement(cls, judgement: Verdicts, names: tuple[str, ...]) -> "BatchJudgement":
        """From verdicts side by side on executions of which what has these names is watched."""
        shares = judgement.contributions
        largest = np.argmax(np.abs(shares), axis=1)
        signs = np.sign(shares[np.arange(len(shares)), largest]).astype(np.int64)
        signed = np.array([[f"+{name}", f"−{name}", ""] for name in names])
        blamed = signed[largest, np.select([signs > 0, signs < 0], [0, 1], 2)]
        texts = (judgement.kinds, judgement.causes, judgement.channels, judgement.betters)
        kinds, causes, channels, betters = (np.asarray(text, dtype=np.str_) for text in texts)
        return cls(
            judgement.failed,
            judgement.steps,
            judgement.times,
            judgement.phases,
            judgement.test_ratios,
            kinds,
            causes,
            channels,
            betters,
            blamed,
            judgement.is_stale,
            judgement.has_sensor_fault,
        )

    @classmethod
    def of(cls, verdicts: list[Verdict]) -> "BatchJudgement":
        """From one verdict for each."""

        def texts(name: str) -> NDArray[np.str_]:
            return np.array([getattr(verdict, name) for verdict in verdicts], dtype=np.str_)

        return cls(
            np.array([v.failed for v in verdicts], dtype=np.bool_),
            np.array([v.step for v in verdicts], dtype=np.int64),
            np.array([v.time for v in verdicts], dtype=np.float64),
            np.array([v.phase for v in verdicts], dtype=np.float64),
            np.array([v.test_ratio for v in verdicts], dtype=np.float64),
            texts("kind"),
            texts("cause"),
            texts("channel"),
            texts("better"),
            texts("blamed"),
            np.array([v.is_stale for v in verdicts], dtype=np.bool_),
            np.array([v.has_sensor_fault for v in verdicts], dtype=np.bool_),
        )
