"""What is killed half-way: nothing is lost, nothing is scored twice, and the scores are the same."""

import os
import signal
import subprocess
import sys
import time

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from fleet_rows import rows_of

from probdmp.errors import ProbDMPError
from probdmp.fleet import score_executions

PART = 50
"""Samples."""
PATIENCE = 60
"""Seconds, on a machine that is busy with other things."""


@pytest.fixture(scope="module")
def many(fleet, tmp_path_factory):
    """60 executions, in parts of one or two; and their scores in one process, of the same parts."""
    path = tmp_path_factory.mktemp("many") / "many.parquet"
    pq.write_table(pa.table(rows_of(fleet.executions * 6)), path, row_group_size=500)
    reference = path.with_name("reference.parquet")
    score_executions(fleet.quick, path, reference, part_samples=PART)
    return path, pq.read_table(reference)


def begun(fleet, path, output):
    """An output that a run with small parts has begun, and has been stopped at once."""

    def stop(*_):
        raise InterruptedError

    with pytest.raises(InterruptedError):
        score_executions(fleet.quick, path, output, part_samples=PART, on_part=stop)
    return output.with_name(f".{output.name}.parts")


def wait_until(condition):
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end, "nothing happened"
        time.sleep(0.001)


@pytest.mark.parametrize("jobs", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_a_process_that_is_killed_is_gone_on_with(fleet, many, tmp_path, jobs):
    path, reference = many
    output = tmp_path / "scores.parquet"
    folder = begun(fleet, path, output)
    command = [sys.executable, "-m", "probdmp", "score", str(fleet.quick), str(path), "-o", str(output), "--jobs", str(jobs)]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        wait_until(lambda: len(list(folder.glob("[0-9]*.parquet"))) >= 5 or process.poll() is not None)
    finally:
        process.send_signal(signal.SIGKILL)
    assert process.wait() == -signal.SIGKILL, "it was still at it"
    assert not output.exists()
    seen = []
    summary = score_executions(fleet.quick, path, output, on_part=lambda done, parts: seen.append(done))
    assert summary.resumed >= 5
    assert seen == list(range(summary.resumed, summary.parts + 1))
    assert pq.read_table(output).equals(reference)
    assert not folder.exists()


@pytest.mark.slow
def test_a_worker_process_that_is_killed_is_said_and_nothing_of_it_is_lost(fleet, many, tmp_path):
    path, reference = many
    output = tmp_path / "scores.parquet"

    def kill_one(done, _):
        if done == 5:
            children = subprocess.run(["pgrep", "-P", str(os.getpid()), "-f", "spawn_main"], capture_output=True, text=True)
            os.kill(int(children.stdout.split()[0]), signal.SIGKILL)

    with pytest.raises(ProbDMPError, match=r"one that was killed.*call it again|Call it again"):
        score_executions(fleet.quick, path, output, workers=2, part_samples=PART, on_part=kill_one)
    summary = score_executions(fleet.quick, path, output)
    assert summary.resumed >= 5
    assert pq.read_table(output).equals(reference)


def test_a_cluster_loses_a_worker_and_nothing_else(fleet, many, tmp_path):
    distributed = pytest.importorskip("distributed")
    path, reference = many
    output = tmp_path / "scores.parquet"
    kept = {"host": "127.0.0.1", "dashboard_address": "127.0.0.1:0", "processes": True, "local_directory": str(tmp_path)}
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, **kept) as cluster:
        processes = {name: nanny.pid for name, nanny in cluster.workers.items()}
        seen = []

        def kill_one(done, parts):
            seen.append(done)
            if done == parts // 2:
                os.kill(processes[0], signal.SIGKILL)

        summary = score_executions(
            fleet.quick, path, output, workers=cluster.scheduler_address, part_samples=PART, on_part=kill_one
        )
        wait_until(lambda: cluster.workers[0].pid not in (None, processes[0]))  # it was killed, and there is another
    assert seen == list(range(summary.parts + 1))
    assert summary.n_scored == len(reference)
    assert pq.read_table(output).equals(reference)


def test_a_cluster_that_does_not_answer_is_said(fleet, many, tmp_path, monkeypatch):
    monkeypatch.setattr("probdmp.fleet.cluster.PATIENCE", 1)
    with pytest.raises(ProbDMPError, match=r"a Dask scheduler at 'tcp://127.0.0.1:9'"):
        score_executions(fleet.quick, many[0], tmp_path / "scores.parquet", workers="tcp://127.0.0.1:9")
