"""Scoring a file: what the library says of each execution by itself, whatever the layout, the pieces and the processes."""

import json

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from fleet_rows import dense_rows_of, rows_of

from probdmp import Task, __version__
from probdmp.detection.library import own_tasks
from probdmp.errors import DataFileError, InputError, MissingExtraError, ModelFileError
from probdmp.execution import score_recordings
from probdmp.fleet import score_executions
from probdmp.fleet.plan import parts_of
from probdmp.io import ParquetExecutions, parquet_executions


def scored(model, executions, output=None, **options):
    output = executions.with_suffix(".scores.parquet") if output is None else output
    summary = score_executions(model, executions, output, **options)
    return pq.read_table(output), summary


def rows(table):
    """Values by execution, without dictionaries that differ."""
    return table.to_pylist()


def assert_alike(some, others):
    """The same but for rounding, which depends on what is computed side by side."""
    assert len(some) == len(others)
    for one, other in zip(some, others, strict=True):
        assert one == {name: pytest.approx(v, rel=1e-9) if isinstance(v, float) else v for name, v in other.items()}


def assert_as_each_by_itself(table, fleet, tasks_by_label):
    for label in "cl":
        members = [k for k, execution in enumerate(fleet.executions) if execution.label == label]
        recordings, primitive = [fleet.executions[k] for k in members], fleet.library[label].primitive_
        tasks = tasks_by_label(primitive, recordings)
        verdicts = fleet.detector.verdicts(recordings, tasks=tasks)
        likelihoods = score_recordings(primitive, tasks, recordings)
        for k, verdict, likelihood in zip(members, verdicts, likelihoods, strict=True):
            row = rows(table)[k]
            assert (row["execution_id"], row["primitive"], row["error"]) == (f"e{k}", label, None)
            assert row["verdict"] == ("failed" if verdict.failed else "fine")
            texts = [row[name] or "" for name in ("kind", "cause", "better")]
            assert texts == [verdict.kind, verdict.cause, verdict.better]
            assert row["alarm_time"] == (pytest.approx(verdict.time) if verdict.failed else None)
            assert row["alarm_phase"] == (pytest.approx(verdict.phase) if verdict.failed else None)
            assert row["blamed"] == (verdict.blamed if verdict.failed else None)
            assert row["test_ratio"] == pytest.approx(verdict.test_ratio, rel=1e-9)
            assert row["log_likelihood"] == pytest.approx(likelihood, rel=1e-9)
            assert row["n_samples"] == recordings[members.index(k)].n_samples


def test_scores_are_those_of_each_execution_told_nothing(fleet, write):
    table, summary = scored(fleet.model, write("long", rows_of(fleet.executions)))
    assert_as_each_by_itself(table, fleet, own_tasks)
    assert sum(row["verdict"] == "failed" for row in rows(table)) >= 2
    assert summary.verdicts["failed"] + summary.verdicts["fine"] == len(fleet.executions) == summary.n_scored


def test_scores_are_those_of_each_execution_told_its_goal_and_duration(fleet, write):
    lengths = [execution.n_samples for execution in fleet.executions]
    told = {
        f"{what}_{name}": np.repeat([execution.positions[row, i] for execution in fleet.executions], lengths)
        for what, row in (("start", 0), ("goal", -1))
        for i, name in enumerate("xy")
    }
    told["duration"] = np.repeat([execution.duration for execution in fleet.executions], lengths)
    table, _ = scored(fleet.model, write("told", rows_of(fleet.executions, **told)))

    def tasks(primitive, recordings):
        return [Task(r.positions[0], r.positions[-1], np.asarray(r.duration)) for r in recordings]

    assert_as_each_by_itself(table, fleet, tasks)


@pytest.fixture(scope="module")
def reference(fleet, tmp_path_factory):
    """Quick scores of all executions in one piece."""
    place = tmp_path_factory.mktemp("reference") / "long.parquet"
    pq.write_table(pa.table(rows_of(fleet.executions)), place)
    return rows(scored(fleet.quick, place)[0])


@pytest.mark.parametrize("group", [7, 100, 100_000])
@pytest.mark.parametrize("part", [1, 120, 2**21])
def test_neither_rows_nor_parts_nor_layouts_matter(fleet, write, monkeypatch, reference, group, part):
    monkeypatch.setattr(parquet_executions, "PIECE", 64)
    long = write("long", rows_of(fleet.executions), row_group_size=group)
    dense = write("dense", dense_rows_of(fleet.executions), row_group_size=group)
    for path in (long, dense):
        table, summary = scored(fleet.quick, path, part_samples=part)
        assert_alike(rows(table), reference)
        assert summary.parts == (len(fleet.executions) if part == 1 else summary.parts)
        assert not list(path.parent.glob(".*.parts"))


@pytest.mark.parametrize(("group", "sizes"), [(10, [10, 40, 40, 10]), (23, [10, 36, 46, 8]), (1000, [10, 40, 40, 10])])
def test_parts_end_with_row_groups_that_end_nearby(fleet, write, group, sizes):
    """So that those are read once; and else where they should. The first one is small."""
    executions = fleet.executions[:1] * 100
    length = executions[0].n_samples
    file = ParquetExecutions(write("many", rows_of(executions), row_group_size=group * length))
    parts = parts_of(file, file.executions(labels=False), 40 * length)
    assert [part.n_executions for part in parts] == sizes


def test_the_order_is_that_of_the_input_and_names_go_through(fleet, write, reference):
    order = np.random.default_rng(0).permutation(len(fleet.executions))
    numbers = [(1 << 60) + int(k) for k in order]
    shuffled = [fleet.executions[k] for k in order]
    ids = np.repeat(numbers, [execution.n_samples for execution in shuffled])
    table, _ = scored(fleet.quick, write("shuffled", rows_of(shuffled, execution_id=ids)))
    assert table["execution_id"].to_pylist() == numbers
    for k, row in zip(order, rows(table), strict=True):
        assert_alike([{**row, "execution_id": f"e{k}"}], [reference[k]])


def test_processes_score_the_same(fleet, write, reference):
    path = write("long", rows_of(fleet.executions), row_group_size=50)
    table, summary = scored(fleet.quick, path, workers=2, part_samples=100)
    assert_alike(rows(table), reference)
    assert summary.parts > 2


BAD = {
    "short": "3 to 100000 samples",
    "unknown": "one of 'c', 'l' as primitive",
    "uneven": "one rate",
    "back": "times that increase",
    "infinite": "x finite",
    "milliseconds": "milliseconds",
    "twice": "several places",
    "nameless": "execution_id, got none",
    "told": "the same goal_x",
    "brief": "duration from",
    "unlabelled": "as primitive",
}


def spoiled(fleet):
    """Columns with one execution of each kind of bad, between those that are good."""
    good, names, parts = fleet.executions, [], []
    for k, kind in enumerate(BAD):
        for name, execution in ((f"g{k}", good[k % len(good)]), (kind, good[0])):
            own = rows_of([execution], goal_x=np.full(execution.n_samples, np.nan), duration=np.full(execution.n_samples, 1.0))
            own = {key: np.array(value, dtype=object if value.dtype.kind == "U" else None) for key, value in own.items()}
            own["execution_id"][:] = name
            if name == kind:
                own = _spoil(kind, own)
            parts.append(own)
            names.append(name)
    parts.append(parts[names.index("twice")])
    names.append("twice")
    columns = {key: np.concatenate([part[key] for part in parts]).tolist() for key in parts[0]}
    return columns, names


def _spoil(kind, own):
    if kind == "short":
        return {key: value[:2] for key, value in own.items()}
    if kind in ("unknown", "unlabelled"):
        own["primitive"][:] = "z" if kind == "unknown" else None
    elif kind == "uneven":
        own["t"] = own["t"] ** 1.4
    elif kind == "back":
        own["t"][10] = own["t"][3]
    elif kind == "infinite":
        own["x"][4] = -np.inf
    elif kind == "milliseconds":
        own["t"] = own["t"] * 1000
    elif kind == "nameless":
        own["execution_id"][:] = None
    elif kind == "told":
        own["goal_x"][:] = np.arange(len(own["t"]))
    elif kind == "brief":
        own["duration"][:] = -1.0
    return own


@pytest.mark.parametrize("part", [50, 2**21])
def test_bad_executions_are_rows_with_a_reason_and_leave_the_others_alone(fleet, write, part):
    columns, names = spoiled(fleet)
    path = write("spoiled", columns, row_group_size=70)
    table, summary = scored(fleet.quick, path, part_samples=part)
    found = rows(table)
    assert [row["execution_id"] for row in found] == [None if name == "nameless" else name for name in names]
    good = {key: [] for key in columns}
    for i, name in enumerate(columns["execution_id"]):
        if name is not None and name.startswith("g"):
            for key in columns:
                good[key].append(columns[key][i])
    alone = {row["execution_id"]: row for row in rows(scored(fleet.quick, write("good", good))[0])}
    for name, row in zip(names, found, strict=True):
        if name in BAD:
            assert row["verdict"] == "error"
            assert BAD[name] in row["error"]
            assert row["log_likelihood"] is row["test_ratio"] is row["alarm_time"] is row["kind"] is None
        else:
            assert_alike([row], [alone[name]])
            assert row["verdict"] != "error"
    assert summary.verdicts["error"] == len(BAD) + 1


def test_what_the_detector_refuses_is_a_row_too(fleet, write, monkeypatch, reference):
    """Any one of a block; those beside it get what they get anyway."""
    from probdmp.detection import FailureDetector

    judge = FailureDetector.judge
    poison = fleet.executions[3].positions[0, 0]

    def refuse(self, primitive, batch):
        if np.any(batch.observations[:, 0, 0] == poison):
            raise InputError("something else", "this")
        return judge(self, primitive, batch)

    monkeypatch.setattr(FailureDetector, "judge", refuse)
    found = rows(scored(fleet.quick, write("long", rows_of(fleet.executions)))[0])
    assert "something else" in found[3]["error"]
    assert_alike(found[:3] + found[4:], reference[:3] + reference[4:])


class Stopped(Exception):
    """In place of a power cut."""


def stop_after(parts):
    def on_part(done, _):
        if done == parts:
            raise Stopped

    return on_part


def test_a_run_that_was_stopped_goes_on_where_it_was(fleet, write, reference):
    path = write("long", rows_of(fleet.executions))
    with pytest.raises(Stopped):
        scored(fleet.quick, path, part_samples=60, on_part=stop_after(3))
    assert not path.with_suffix(".scores.parquet").exists()
    seen = []
    table, summary = scored(fleet.quick, path, on_part=lambda done, parts: seen.append((done, parts)))
    assert_alike(rows(table), reference)
    assert summary.resumed == 3
    assert seen[0] == (3, summary.parts)
    assert seen[-1] == (summary.parts, summary.parts)
    assert len(seen) == summary.parts - 2
    assert summary.n_scored < len(fleet.executions)


def test_another_model_or_file_does_not_go_on_but_may_begin_anew(fleet, write, reference):
    path = write("long", rows_of(fleet.executions))
    with pytest.raises(Stopped):
        scored(fleet.model, path, part_samples=60, on_part=stop_after(1))
    with pytest.raises(InputError, match=r"the model that .* --restart"):
        scored(fleet.quick, path)
    other = write("other", rows_of(fleet.executions[:4]))
    with pytest.raises(InputError, match="the model and executions that"):
        scored(fleet.quick, other, path.with_suffix(".scores.parquet"))
    assert_alike(rows(scored(fleet.quick, path, restart=True)[0]), reference)


def test_parts_that_were_cut_in_another_way_are_not_gone_on_with(fleet, write, monkeypatch):
    path = write("long", rows_of(fleet.executions))
    with pytest.raises(Stopped):
        scored(fleet.quick, path, part_samples=60, on_part=stop_after(1))
    monkeypatch.setattr("probdmp.fleet.scoring.PLAN", 0)
    with pytest.raises(InputError, match=r"the plan that .* --restart"):
        scored(fleet.quick, path)


def test_two_runs_do_not_write_to_the_same_output(fleet, write):
    path = write("long", rows_of(fleet.executions))

    def meddle(done, _):
        if done == 1:
            with pytest.raises(InputError, match="another that is at it"):
                scored(fleet.quick, path)
            raise Stopped

    with pytest.raises(Stopped):
        scored(fleet.quick, path, part_samples=60, on_part=meddle)


def test_an_output_is_replaced_only_when_asked_for(fleet, write, reference):
    path = write("long", rows_of(fleet.executions))
    scored(fleet.quick, path)
    with pytest.raises(InputError, match="does not exist yet"):
        scored(fleet.quick, path)
    assert_alike(rows(scored(fleet.quick, path, restart=True)[0]), reference)


def test_an_output_stays_until_it_is_replaced_by_a_run_that_goes_on(fleet, write, reference):
    path = write("long", rows_of(fleet.executions))
    output = path.with_suffix(".scores.parquet")
    output.write_bytes(b"old")
    with pytest.raises(Stopped):
        scored(fleet.quick, path, part_samples=60, on_part=stop_after(2), restart=True)
    assert output.read_bytes() == b"old"
    table, summary = scored(fleet.quick, path)
    assert summary.resumed == 2
    assert_alike(rows(table), reference)


def test_the_output_says_where_it_comes_from(fleet, write):
    path = write("long", rows_of(fleet.executions))
    table, summary = scored(fleet.quick, path)
    metadata = {key.decode(): value.decode() for key, value in table.schema.metadata.items() if key.startswith(b"probdmp")}
    assert metadata["probdmp.model"] == summary.model
    assert metadata["probdmp.version"] == __version__
    assert metadata["probdmp.schema"] == "probdmp.scores/1"


def test_no_executions_are_no_scores(fleet, write):
    empty = {name: values[:0] for name, values in rows_of(fleet.executions).items()}
    table, summary = scored(fleet.quick, write("empty", empty))
    assert (len(table), summary.parts, dict(summary.verdicts)) == (0, 0, {})
    assert "verdict" in table.column_names


def test_files_that_cannot_be_scored_are_refused_at_once(fleet, write):
    columns = rows_of(fleet.executions)
    without = {name: values for name, values in columns.items() if name != "x"}
    with pytest.raises(DataFileError, match=r"columns x, y of numbers.*got y"):
        scored(fleet.quick, write("without", without))
    without = {name: values for name, values in columns.items() if name != "primitive"}
    with pytest.raises(DataFileError, match="a column 'primitive'"):
        scored(fleet.quick, write("unlabelled", without))
    metres = pa.field("x", pa.float64(), metadata={"unit": "m"})
    table = pa.table(columns)
    path = write("long", columns)
    pq.write_table(table.cast(pa.schema([metres if f.name == "x" else f for f in table.schema])), path)
    with pytest.raises(DataFileError, match=r"positions in mm, as learned.*got m"):
        scored(fleet.quick, path)
    with pytest.raises(ModelFileError, match="a failure detector"):
        scored(fleet.folder / "bare.probdmp", path)
    with pytest.raises(InputError, match="workers"):
        scored(fleet.quick, path, workers=0)


def test_one_primitive_needs_no_labels(fleet, write, tmp_path):
    alone = fleet.library["c"]
    from probdmp import FailureDetector

    taught = [execution for execution in fleet.executions if execution.label == "c"]
    alone.save(tmp_path / "c.probdmp", FailureDetector(rule="paper").fit(alone.primitive_, taught))
    columns = rows_of(taught)
    named = scored(tmp_path / "c.probdmp", write("named", columns))[0]
    columns.pop("primitive")
    bare = scored(tmp_path / "c.probdmp", write("bare", columns))[0]
    assert bare["log_likelihood"].to_pylist() == named["log_likelihood"].to_pylist()
    assert bare["verdict"].to_pylist() == named["verdict"].to_pylist()


def test_channels_are_scored_where_they_are_in_the_file(tmp_path, write):
    from dataclasses import replace

    from probdmp import FailureDetector, ProbabilisticDMP, synthetic_letters

    rng = np.random.default_rng(0)
    felt = [
        replace(d, channels={"force": 1 + 0.1 * d.positions[:, 1] + 0.02 * rng.standard_normal(d.n_samples)})
        for d in synthetic_letters(8, seed=1, letters="c", dt=0.02)
    ]
    learned = ProbabilisticDMP(n_basis=8, channels=("force",)).fit(felt)
    learned.save(tmp_path / "felt.probdmp", FailureDetector().fit(learned, felt))
    force = np.concatenate([d.channels["force"] for d in felt])
    with_force, _ = scored(tmp_path / "felt.probdmp", write("felt", rows_of(felt, force=force)))
    expected = score_recordings(learned.primitive_, own_tasks(learned.primitive_, felt), felt)
    np.testing.assert_allclose(with_force["log_likelihood"], expected, rtol=1e-9)
    without, _ = scored(tmp_path / "felt.probdmp", write("numb", rows_of(felt)))
    assert set(without["verdict"].to_pylist()) <= {"fine", "failed"}


def test_without_pyarrow_it_says_what_to_type(fleet, tmp_path, monkeypatch):
    monkeypatch.setattr("probdmp.io.parquet_layout.find_spec", lambda name: None)
    with pytest.raises(MissingExtraError, match=r"pip install 'probdmp\[fleet\]'"):
        score_executions(fleet.quick, tmp_path / "a.parquet", tmp_path / "b.parquet")
    monkeypatch.setattr("probdmp.fleet.cluster.find_spec", lambda name: None)
    with pytest.raises(MissingExtraError, match=r"pip install 'probdmp\[fleet\]'"):
        score_executions(fleet.quick, tmp_path / "a.parquet", tmp_path / "b.parquet", workers="tcp://127.0.0.1:1")


def test_the_manifest_is_plain_json(fleet, write):
    path = write("long", rows_of(fleet.executions))
    with pytest.raises(Stopped):
        scored(fleet.quick, path, part_samples=60, on_part=stop_after(1))
    folder = path.with_name(".long.scores.parquet.parts")
    assert set(json.loads((folder / "run.json").read_text())) == {"schema", "version", "model", "executions", "plan", "samples"}
