"""What is said of each execution: the columns of a file of scores."""

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from probdmp.checks import FloatArray, IntArray
from probdmp.io import ExecutionTable
from probdmp.io.parquet_layout import ID, LABEL

if TYPE_CHECKING:
    from probdmp.detection.batch import BatchJudgement

__all__ = ["ENCODED", "ERROR", "FAILED", "FINE", "VERDICTS", "Scores", "score_schema"]

VERDICTS = FINE, FAILED, ERROR = ("fine", "failed", "error")
TEXTS = {"kind": "kinds", "cause": "causes", "blamed": "blamed", "better": "betters"}
"""By column: the texts of a `BatchJudgement`."""
FLAGS = ("is_stale", "has_sensor_fault")
ENCODED = [LABEL, "verdict", *TEXTS, "error"]
"""Columns of few different values, which a Parquet file numbers; of others it would try to, in vain."""


def score_schema(id_type: Any) -> Any:
    """The Arrow schema of scores.

    Parameters
    ----------
    id_type : of the column execution_id.
    """
    import pyarrow as pa

    text, number = pa.dictionary(pa.int32(), pa.string()), pa.float64()
    columns = {ID: id_type, LABEL: text, "verdict": text, "alarm_time": number, "alarm_phase": number, "test_ratio": number}
    columns |= dict.fromkeys(TEXTS, text) | dict.fromkeys(FLAGS, pa.bool_())
    columns |= {"log_likelihood": number, "n_samples": pa.int64(), "error": text}
    return pa.schema(list(columns.items()))


class Scores:
    """What is found of N executions, block by block, in any order."""

    def __init__(self, table: ExecutionTable) -> None:
        count = len(table)
        self._table = table
        self._scored, self._failed = np.zeros((2, count), dtype=bool)
        self._numbers = {name: np.full(count, np.nan) for name in ("time", "phase", "test_ratio", "log_likelihood")}
        self._texts: dict[str, NDArray[np.object_]] = {name: np.full(count, "", dtype=object) for name in TEXTS}
        self._flags = {name: np.zeros(count, dtype=bool) for name in FLAGS}

    def put(self, which: IntArray, judged: "BatchJudgement", log_likelihoods: FloatArray) -> None:
        """Note what was found of some of them."""
        self._scored[which], self._failed[which] = True, judged.failed
        found = {"time": judged.times, "phase": judged.phases, "test_ratio": judged.test_ratios}
        for name, values in (found | {"log_likelihood": log_likelihoods}).items():
            self._numbers[name][which] = values
        for name, source in TEXTS.items():
            self._texts[name][which] = getattr(judged, source)
        for name in FLAGS:
            self._flags[name][which] = getattr(judged, name)

    def as_table(self, labels: NDArray[np.object_]) -> Any:
        """The scores as an Arrow table, in the order of the executions.

        Parameters
        ----------
        labels : (N,) array of text, what primitive each was compared with; None where it is not known.
        """
        import pyarrow as pa

        table, scored, failed = self._table, self._scored, self._failed
        verdicts = np.array(VERDICTS, dtype=object)[np.where(scored, failed.astype(int), 2)]
        numbers = self._numbers
        arrays = {
            ID: table.ids,
            LABEL: _texts(labels, np.array([label is None for label in labels.tolist()], dtype=bool)),
            "verdict": _texts(verdicts, np.zeros(len(verdicts), dtype=bool)),
            "alarm_time": pa.array(numbers["time"], mask=~failed),
            "alarm_phase": pa.array(numbers["phase"], mask=~failed),
            "test_ratio": pa.array(numbers["test_ratio"], mask=~scored),
            **{name: _texts(values, ~failed | (values == "")) for name, values in self._texts.items()},
            **{name: pa.array(values, mask=~scored) for name, values in self._flags.items()},
            "log_likelihood": pa.array(numbers["log_likelihood"], mask=~scored),
            "n_samples": pa.array(table.counts),
            "error": _texts(table.problems, table.usable),
        }
        return pa.Table.from_arrays(list(arrays.values()), schema=score_schema(table.ids.type))


def _texts(values: NDArray[np.object_], missing: NDArray[np.bool_]) -> Any:
    import pyarrow as pa

    return pa.array(values, pa.string(), mask=missing).dictionary_encode()
