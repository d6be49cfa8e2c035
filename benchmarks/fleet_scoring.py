"""How long a fleet's executions take to be scored, and how much memory.

    python benchmarks/fleet_scoring.py 1000000 --jobs 2
    python benchmarks/fleet_scoring.py 60000 --profile

Writes N executions of the built-in letters, 200 samples of two degrees of freedom each, drawn from primitives learned from
them, two in a hundred of them blocked half-way; and then runs `probdmp score` on them. Each execution has noise of its own, so
that nothing about the file is easier than it would be with a real one. With --profile it says instead where the time of one
thread goes.
"""

import argparse
import cProfile
import json
import os
import pstats
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from probdmp import FailureDetector, PrimitiveLibrary, synthetic_letters
from probdmp.checks import FloatArray
from probdmp.fleet.plan import parts_of
from probdmp.fleet.scorer import Scorer
from probdmp.io import ParquetExecutions

N_SAMPLES = 200
POOL = 128
"""Executions of each letter that are drawn; the others are these with other noise."""
BLOCKED = 0.02
ROWS = 2**20
"""Of a row group."""
EVERY = 0.05
"""Seconds between looks at the memory of processes."""
STAGES = {
    "reading": ("parquet_executions.py", "_read_samples"),
    "log-likelihood": ("scoring.py", "score_batch"),
    "ticks": ("recorded_ticks.py", "record_ticks"),
    "windows of the trajectory": ("trajectory_model.py", "evidence"),
    "when it was most surprising": ("judgement.py", "_moments"),
    "contributions": ("judgement.py", "_shares"),
    "reasons of those that failed": ("judgement.py", "_reasons"),
}
"""Functions that stand for a stage, by their file and name."""


def learned(path: Path) -> PrimitiveLibrary:
    """All letters, with a calibrated detector, in a model file."""
    demonstrations: dict[str, list[Any]] = {}
    for demonstration in synthetic_letters(10):
        demonstrations.setdefault(demonstration.label, []).append(demonstration)
    library = PrimitiveLibrary.fit(demonstrations)
    library.save(path, FailureDetector().fit(library, demonstrations))
    return library


def pool_of(library: PrimitiveLibrary, label: str) -> tuple[float, FloatArray, FloatArray]:
    """Seconds between samples, executions (POOL, T, 2) of a letter, and the standard deviations of its sensors."""
    primitive = library[label].primitive_
    dt = primitive.duration / (N_SAMPLES - 1)
    drawn = library[label].sample(POOL, dt=dt, random_state=0)
    return dt, np.stack([path[:N_SAMPLES] for path in drawn]), np.sqrt(primitive.observation_variances)


def write_executions(path: Path, library: PrimitiveLibrary, count: int, dense: bool, told: bool) -> None:
    """The file of executions."""
    rng, labels = np.random.default_rng(0), np.array(sorted(library))
    pools = [pool_of(library, label) for label in labels.tolist()]
    dts, drawn, stds = (np.stack([pool[i] for pool in pools]) for i in range(3))
    writer = None
    size = ROWS // N_SAMPLES
    for first in range(0, count, size):
        n = min(size, count - first)
        which = rng.integers(len(labels), size=n)
        positions = drawn[which, rng.integers(POOL, size=n)]
        blocked = rng.random(n) < BLOCKED
        onsets = rng.integers(int(0.3 * N_SAMPLES), int(0.7 * N_SAMPLES), size=n)
        held = blocked[:, None] & (np.arange(N_SAMPLES) > onsets[:, None])
        positions = np.where(held[..., None], positions[np.arange(n), onsets][:, None], positions)
        goals = drawn[which, 0, -1]
        positions = positions + stds[which][:, None] * rng.standard_normal(positions.shape)
        ids = np.arange(first, first + n)
        primitives = pa.array(labels).dictionary_encode().dictionary
        columns = {"execution_id": ids, "primitive": pa.DictionaryArray.from_arrays(which.astype(np.int32), primitives)}
        if told:
            columns |= {"goal_x": goals[:, 0], "goal_y": goals[:, 1], "duration": dts[which] * (N_SAMPLES - 1)}
        table = _dense(columns, dts[which], positions) if dense else _long(columns, dts[which], positions)
        writer = writer or pq.ParquetWriter(path, table.schema)
        writer.write_table(table, row_group_size=len(table))
    assert writer is not None, "there are executions"
    writer.close()


def _long(columns: dict[str, Any], dts: FloatArray, positions: FloatArray) -> Any:
    rows = np.repeat(np.arange(len(dts)), N_SAMPLES)
    spread = {name: pa.array(values).take(pa.array(rows)) for name, values in columns.items()}
    times = (dts[:, None] * np.arange(N_SAMPLES)).ravel()
    return pa.table(spread | {"t": times, "x": positions[..., 0].ravel(), "y": positions[..., 1].ravel()})


def _dense(columns: dict[str, Any], dts: FloatArray, positions: FloatArray) -> Any:
    offsets = pa.array(np.arange(len(dts) + 1, dtype=np.int32) * N_SAMPLES)
    lists = {name: pa.ListArray.from_arrays(offsets, positions[..., i].ravel()) for i, name in enumerate("xy")}
    return pa.table(columns | {"dt": dts} | lists)


def measured(command: list[str]) -> dict[str, Any]:
    """Run a command; what it printed, how long it took, and how much memory it and its children had at most."""
    began, peak = time.perf_counter(), 0
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    while process.poll() is None:
        peak = max(peak, sum(map(_resident, _tree(process.pid))))
        time.sleep(EVERY)
    seconds = time.perf_counter() - began
    assert process.stdout is not None, "it is a pipe"
    if process.returncode:
        raise SystemExit(process.returncode)
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    used = {"seconds": seconds, "cpu_seconds": usage.ru_utime + usage.ru_stime, "peak_rss": max(peak, usage.ru_maxrss * 1024)}
    return {**json.loads(process.stdout.read()), **used}


def profiled(model: Path, executions: Path) -> list[str]:
    """Where the time of one thread goes, by stage, after what is computed once; lines of text."""
    scorer, file = Scorer(model.read_bytes(), model.name), ParquetExecutions(str(executions))
    columns, parts = scorer.columns(file.layout, file.path), parts_of(file, file.executions(labels=False))
    if len(parts) < 2:
        raise SystemExit(f"Expected executions for two parts or more, got {len(parts)}: ask for more of them.")

    def score(part: Any) -> None:
        for table in file.read(part.span, columns):
            scorer.score(table)

    score(parts[0])
    profiler, began = cProfile.Profile(), time.perf_counter()
    for part in parts[1:]:
        profiler.runcall(score, part)
    each = (time.perf_counter() - began) / sum(part.n_executions for part in parts[1:])
    found = dict.fromkeys(STAGES, 0.0)
    total = 0.0
    for (path, _, function), (_, _, own, cumulative, _) in pstats.Stats(profiler).stats.items():  # type: ignore[attr-defined]
        total += own
        found |= {name: cumulative for name, stage in STAGES.items() if stage == (Path(path).name, function)}
    found["the rest"] = total - sum(found.values())
    lines = [f"  {name:<30} {100 * seconds / total:3.0f} %" for name, seconds in found.items()]
    return [f"one thread, {1e6 * each:.0f} µs per execution while being profiled, of which", *lines]


def _tree(root: int) -> list[int]:
    """A process and its descendants."""
    parents = {}
    for entry in os.listdir("/proc"):
        if entry.isdigit():
            try:
                parents[int(entry)] = int(Path(f"/proc/{entry}/stat").read_text().rpartition(")")[2].split()[1])
            except OSError:
                continue
    found = [root]
    for pid in found:
        found += [child for child, parent in parents.items() if parent == pid]
    return found


def _resident(pid: int) -> int:
    """Bytes."""
    try:
        return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * resource.getpagesize()
    except OSError:
        return 0


def main() -> None:
    """Read the command line, write, score and report."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("executions", type=int, nargs="?", default=1_000_000)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--dense", action="store_true", help="one row per execution")
    parser.add_argument("--told", action="store_true", help="executions are told their goal and duration")
    parser.add_argument("--profile", action="store_true", help="say where the time of one thread goes")
    parser.add_argument("--folder", type=Path, help="where files go and stay; what is there is used again")
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder = chosen.folder or Path(temporary)
        folder.mkdir(exist_ok=True)
        model, kind = folder / "letters.probdmp", f"{'dense' if chosen.dense else 'long'}{'_told' * chosen.told}"
        executions = folder / f"{kind}_{chosen.executions}.parquet"
        library = PrimitiveLibrary.load(model) if model.exists() else learned(model)
        if not executions.exists():
            write_executions(executions, library, chosen.executions, chosen.dense, chosen.told)
        if chosen.profile:
            print("\n".join(profiled(model, executions)))
            return
        scores = folder / "scores.parquet"
        command = [sys.executable, "-m", "probdmp", "score", str(model), str(executions), "-o", str(scores)]
        found = measured([*command, "--jobs", str(chosen.jobs), "--restart", "--json"])
    rate = chosen.executions / found["seconds"]
    print(f"{chosen.executions} executions x {N_SAMPLES} x 2, {kind}, {chosen.jobs} processes: {found['seconds']:.1f} s,")
    print(f"{found['cpu_seconds']:.1f} s of processors, {rate:.0f} executions per second, {found['peak_rss'] / 1e6:.0f} MB;")
    print(f"verdicts {found['verdicts']}")


if __name__ == "__main__":
    main()
