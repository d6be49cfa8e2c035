"""Scoring a file of executions: parts are planned, scored wherever, kept as they get done, and put together."""

import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from probdmp import __version__
from probdmp.checks import check_count
from probdmp.errors import InputError, ModelFileError
from probdmp.fleet.cluster import require_distributed, score_on_cluster
from probdmp.fleet.parts_folder import PartsFolder, is_begun
from probdmp.fleet.plan import PART_SAMPLES, PLAN, Part, parts_of
from probdmp.fleet.scorer import Scorer
from probdmp.fleet.scores import ENCODED, score_schema
from probdmp.fleet.work import Assignment, score_here, score_in_processes
from probdmp.io import ParquetExecutions
from probdmp.io.atomic import replacing
from probdmp.io.container import LARGEST_MODEL
from probdmp.io.parquet_arrays import codes_of
from probdmp.io.parquet_layout import ID, LABEL
from probdmp.io.read_ahead import read_ahead
from probdmp.io.regular_file import open_regular

__all__ = ["FleetSummary", "score_executions"]

SCHEMA = "probdmp.scores/1"


@dataclass(frozen=True, slots=True)
class FleetSummary:
    """What came of scoring a file."""

    counts: dict[str, Counter[str]]
    """By primitive, how many executions got each verdict; those of no known primitive by what they said, perhaps ""."""
    seconds: float
    """That this run took."""
    n_scored: int
    """Executions that this run has scored."""
    parts: int
    """Of the whole file."""
    resumed: int
    """Parts that an earlier run had done."""
    model: str
    """SHA-256 of the model file."""

    @property
    def verdicts(self) -> Counter[str]:
        """How many executions got each verdict."""
        return sum(self.counts.values(), Counter())


def score_executions(
    model: str | Path,
    executions: str | Path,
    output: str | Path,
    *,
    workers: int | str = 1,
    restart: bool = False,
    on_part: Callable[[int, int], None] = lambda done, parts: None,
    part_samples: int = PART_SAMPLES,
) -> FleetSummary:
    """Score every execution of a Parquet file; a run that was killed is gone on with.

    Parameters
    ----------
    model : a model file with a detector.
    output : Parquet file to write, in the order of the executions.
    workers : processes on this machine, 1 is this one; or the address of a Dask scheduler, whose workers see the executions at
        the same path.
    restart : whether to begin anew rather than to go on, and to replace an output.
    on_part : called with how many parts are done, and how many there are: once at the beginning, and after each.
    part_samples : of a part, about: what is lost at most, per process, when a run is killed.

    Raises
    ------
    InputError
        If the output is there already and is not being replaced, or was begun with other inputs, or by a run that is at it.
    DataFileError, ModelFileError
        If a file cannot be used.
    MissingExtraError
        If pyarrow, or for a scheduler dask.distributed, is not installed.
    """
    began, target = time.perf_counter(), Path(output)
    check_count(part_samples, "part_samples")
    score_parts = _workplace(workers)
    if target.exists() and not restart and not is_begun(target):
        raise InputError(
            "an output file that does not exist yet", repr(str(target)), "Use --restart (restart=True) to replace it."
        )
    with open_regular(model, LARGEST_MODEL, ModelFileError, follow_links=False) as stream:
        payload = stream.read(LARGEST_MODEL + 1)
    file, scorer = ParquetExecutions(executions), Scorer(payload, str(model))
    scorer.columns(file.layout, file.path)
    identity = {"schema": SCHEMA, "version": __version__, "model": scorer.digest, "executions": file.fingerprint}
    folder = PartsFolder(target, identity | {"plan": PLAN}, part_samples, restart)
    try:
        parts = parts_of(file, file.executions(labels=False), folder.samples)
        done = folder.done()
        todo = [part for part in parts if part.number not in done]
        on_part(len(parts) - len(todo), len(parts))
        assignment = Assignment(payload, str(model), str(Path(executions).resolve()), file.fingerprint, __version__)
        for k, (index, scores) in enumerate(score_parts(assignment, todo)):
            folder.put(index, scores)
            on_part(len(parts) - len(todo) + k + 1, len(parts))
        counts = _put_together(target, folder, len(parts), score_schema(_plain_type(file)), identity)
        folder.remove()
    finally:
        folder.close()
    n_scored = sum(part.n_executions for part in todo)
    seconds = time.perf_counter() - began
    return FleetSummary(counts, seconds, n_scored, len(parts), len(parts) - len(todo), scorer.digest)


def _workplace(workers: int | str) -> Callable[[Assignment, Sequence[Part]], Iterator[tuple[int, bytes]]]:
    """What scores parts, as they get done."""
    if isinstance(workers, str):
        require_distributed()
        return partial(score_on_cluster, address=workers)
    return score_here if check_count(workers, "workers") == 1 else partial(score_in_processes, jobs=workers)


def _plain_type(file: ParquetExecutions) -> Any:
    import pyarrow as pa

    kind = file.schema.field(ID).type
    return kind.value_type if pa.types.is_dictionary(kind) else kind


def _put_together(
    target: Path, folder: PartsFolder, n_parts: int, schema: Any, identity: dict[str, str]
) -> dict[str, Counter[str]]:
    """Write the output from its parts; the numbers of verdicts by primitive."""
    import pyarrow.parquet as pq

    metadata = {f"probdmp.{name}": value for name, value in identity.items()}
    counts: dict[str, Counter[str]] = {}
    with replacing(target) as file, pq.ParquetWriter(file, schema.with_metadata(metadata), use_dictionary=ENCODED) as writer:
        for table in read_ahead(folder.tables(n_parts)):
            writer.write_table(table.cast(schema).replace_schema_metadata(metadata))
            for label, verdict, count in _counted(table):
                counts.setdefault(label, Counter())[verdict] += count
    return dict(sorted(counts.items()))


def _counted(table: Any) -> Iterator[tuple[str, str, int]]:
    (labels, names), (verdicts, kinds) = codes_of(table[LABEL]), codes_of(table["verdict"])
    pairs, counts = np.unique(labels.astype(np.int64) * len(kinds) + verdicts, return_counts=True)
    for pair, count in zip(pairs.tolist(), counts.tolist(), strict=True):
        label, verdict = divmod(pair, len(kinds))
        yield ("" if label < 0 else names[label]), kinds[verdict], count
