"""Parquet files: what is written is read, both layouts say the same, and what cannot be used is refused by name."""

import importlib.util
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from io_strategies import assert_same_demonstrations

from probdmp.demonstrations import Demonstration
from probdmp.demonstrations.clock import grid_places
from probdmp.errors import DataFileError, InputError, MissingExtraError, RecordingWarning
from probdmp.io import (
    ParquetExecutions,
    Selection,
    Span,
    parquet_executions,
    read_csv,
    read_demonstrations,
    read_parquet,
    write_parquet,
)
from probdmp.io.parquet_clock import even_clocks

values = st.floats(-1e100, 1e100) | st.just(float("nan"))
texts = st.text(st.characters(exclude_categories=["Cs"]), max_size=8)
RESERVED = {"execution_id", "primitive", "t", "dt", "duration"}


@st.composite
def recordings_of_one_file(draw):
    names = draw(st.lists(st.sampled_from(["x", "y", "q0", "q_é", "pose.x", "höhe"]), min_size=1, max_size=3, unique=True))
    channels = draw(st.lists(texts.filter(lambda text: text and text not in {*RESERVED, *names}), max_size=2, unique=True))
    channels = [name for name in channels if not name.startswith(("start_", "goal_"))]
    dt, unit = draw(st.floats(1e-6, 1e3)), draw(texts)
    demonstrations = []
    for n in draw(st.lists(st.integers(3, 6), min_size=1, max_size=3)):
        table = draw(arrays(np.float64, (n, len(names) + len(channels)), elements=values))
        by_name = dict(zip(channels, table.T[len(names) :], strict=True))
        demonstrations.append(Demonstration(table[:, : len(names)], dt, draw(texts), tuple(names), unit, by_name))
    return demonstrations


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    return tmp_path_factory.mktemp("parquet")


@given(recordings_of_one_file())
@settings(max_examples=100, deadline=None)
def test_round_trip_is_exact(place, demonstrations):
    write_parquet(place / "round.parquet", demonstrations)
    assert_same_demonstrations(read_demonstrations(place / "round.parquet"), demonstrations)


def three(dt=0.01):
    """Recordings of 20, 33 and 20 samples, one of them with samples that are missing."""
    rng = np.random.default_rng(0)
    positions = [rng.standard_normal((n, 2)) for n in (20, 33, 20)]
    positions[1][4:6, 0] = np.nan
    forces = [rng.standard_normal(len(p)) for p in positions]
    labelled = zip(positions, forces, "aba", strict=True)
    return [Demonstration(p, dt, label, ("x", "y"), channels={"force": f}) for p, f, label in labelled]


def rows_of(demonstrations, ids=("one", "two", "three"), **more):
    """The long layout as columns."""
    lengths = [d.n_samples for d in demonstrations]
    columns = {
        "execution_id": np.repeat(np.array(ids), lengths),
        "primitive": np.repeat([d.label for d in demonstrations], lengths),
        "t": np.concatenate([d.times for d in demonstrations]),
        **{name: np.concatenate([d.positions[:, i] for d in demonstrations]) for i, name in enumerate("xy")},
        "force": np.concatenate([d.channels["force"] for d in demonstrations]),
    }
    return columns | more


def dense_rows_of(demonstrations, ids=("one", "two", "three")):
    return {
        "execution_id": list(ids),
        "primitive": [d.label for d in demonstrations],
        "dt": [d.dt for d in demonstrations],
        **{name: [d.positions[:, i].tolist() for d in demonstrations] for i, name in enumerate("xy")},
        "force": [d.channels["force"].tolist() for d in demonstrations],
    }


def written(path, columns, **options):
    pq.write_table(columns if isinstance(columns, pa.Table) else pa.table(columns), path, **options)
    return path


@pytest.mark.parametrize("group", [1, 7, 20, 1000])
def test_both_layouts_say_the_same_however_rows_are_grouped(tmp_path, monkeypatch, group):
    """Even where every piece that is read is shorter than an execution."""
    demonstrations = three()
    long = written(tmp_path / "long.parquet", rows_of(demonstrations), row_group_size=group)
    dense = written(tmp_path / "dense.parquet", dense_rows_of(demonstrations), row_group_size=group)
    for piece in (5, 2**20):
        monkeypatch.setattr(parquet_executions, "PIECE", piece)
        assert_same_demonstrations(read_parquet(long), demonstrations)
        assert_same_demonstrations(read_parquet(dense), demonstrations)


def column_of(tables, name):
    """All samples, of one execution after the other."""
    return np.concatenate([table.execution(i)[name] for table in tables for i in range(len(table))])


@pytest.mark.parametrize("rows", [rows_of, dense_rows_of])
def test_executions_come_in_as_few_tables_as_memory_allows(tmp_path, monkeypatch, rows):
    """About equally large ones, with the same in them; labels are numbered anew in each."""
    demonstrations = [replace(one, label=label) for label in "cab" for one in three()]
    columns = rows(demonstrations, ids=[f"e{k}" for k in range(9)])
    file = ParquetExecutions(written(tmp_path / "nine.parquet", columns, row_group_size=2 if rows is dense_rows_of else 50))
    starts = file.executions(labels=False).starts
    span = Span(0, int(starts[-1]), None if file.layout.is_dense else np.diff(starts))
    monkeypatch.setattr(parquet_executions, "PIECE", 40)
    (whole,) = file.read(span, ["x", "y"])
    monkeypatch.setattr(parquet_executions, "TABLE", len(column_of([whole], "x")))
    tables = list(file.read(span, ["x", "y"]))
    assert max(map(len, tables)) < 9 == sum(map(len, tables))
    assert 2 <= len(tables) <= 4
    for name in ("x", "y"):
        np.testing.assert_array_equal(column_of(tables, name), column_of([whole], name))
    for table in (whole, *tables):
        names = [name.as_py() for name in table.ids]
        assert [table.labels[code] for code in table.codes] == ["cab"[int(name[1:]) // 3] for name in names]
        assert np.diff(table.offsets).tolist() == [three()[int(name[1:]) % 3].n_samples for name in names]


def as_lists_of_times(columns, demonstrations):
    return {name: values for name, values in columns.items() if name != "dt"} | {
        "t": [d.times.tolist() for d in demonstrations]
    }


def test_columns_may_have_other_types(tmp_path):
    """Whole numbers, dictionaries and large text as names; nulls for what is missing; timestamps; times in lists."""
    demonstrations = three()
    plain = rows_of(demonstrations)
    numbers = np.repeat([30, 10, 20], [20, 33, 20])
    masked = pa.array(plain["x"], mask=np.isnan(plain["x"]))
    nanoseconds = 1_700_000_000_000_000_000 + np.rint(plain["t"] * 1e9).astype(np.int64)
    for name, other in {
        "numbers": plain | {"execution_id": numbers},
        "large": plain | {"execution_id": pa.array(plain["execution_id"], pa.large_string())},
        "dictionary": plain | {"primitive": pa.array(plain["primitive"]).dictionary_encode()},
        "nulls": plain | {"x": masked},
        "moments": plain | {"t": pa.array(nanoseconds, pa.timestamp("ns", "UTC"))},
        "epoch": plain | {"t": plain["t"] + 1.7e9},
        "lists": as_lists_of_times(dense_rows_of(demonstrations), demonstrations),
    }.items():
        assert_same_demonstrations(read_parquet(written(tmp_path / f"{name}.parquet", other)), demonstrations)


def test_rows_left_out_are_samples_that_are_missing_as_in_a_csv_file(tmp_path):
    plain = rows_of(three())
    kept = np.ones(len(plain["t"]), dtype=bool)
    kept[[3, 4, 22, 40]] = False
    some = {name: values[kept] for name, values in plain.items()}
    lines = ["demonstration,label,time [s],x,y,force"]
    for row in zip(*some.values(), strict=True):
        lines.append(",".join("" if value != value else str(value) for value in row))
    (tmp_path / "gaps.csv").write_text("\n".join(lines))
    with pytest.warns(RecordingWarning, match="4 rows are left out"):
        read = read_parquet(written(tmp_path / "gaps.parquet", some))
    with pytest.warns(RecordingWarning, match="4 rows are left out"):
        assert_same_demonstrations(read, read_csv(tmp_path / "gaps.csv"))


def test_lists_of_different_lengths_are_refused_and_null_is_not_measured(tmp_path):
    columns = dense_rows_of(three())
    columns["force"][0] = None
    assert np.isnan(read_parquet(written(tmp_path / "null.parquet", columns))[0].channels["force"]).all()
    columns["y"][2] = columns["y"][2][:-1]
    with pytest.raises(DataFileError, match=r"lists of one length.*'three'"):
        read_parquet(written(tmp_path / "ragged.parquet", columns))


BAD_CLOCKS = {
    "uneven": (lambda t: t**1.3, "uneven times"),
    "back": (lambda t: np.where(t > 0.1, t - 0.05, t), "times that increase"),
    "repeated": (lambda t: np.repeat(t[::2], 2)[: len(t)], "times that increase"),
    "missing": (lambda t: np.where(t == 0.05, np.nan, t), "times that increase"),
    "endless": (lambda t: np.where(t > 0.18, 1e300, t), "uneven"),
}


@pytest.mark.parametrize("name", BAD_CLOCKS)
def test_clocks_that_are_not_even_are_refused_with_the_execution(tmp_path, name):
    change, reason = BAD_CLOCKS[name]
    columns = rows_of(three())
    columns["t"][-20:] = change(columns["t"][-20:])
    with pytest.raises(DataFileError, match=rf"{reason}.*'three'"):
        read_parquet(written(tmp_path / "bad.parquet", columns))


def test_executions_that_cannot_be_used_are_refused_with_a_reason(tmp_path):
    columns = rows_of(three())

    def refused(reason, **changed):
        with pytest.raises((DataFileError, InputError), match=reason):
            read_parquet(written(tmp_path / "bad.parquet", columns | changed))

    ids = columns["execution_id"]
    refused("in several places", execution_id=np.where(ids == "three", "one", ids))
    refused("3 to 100000 samples", execution_id=np.where(np.arange(len(ids)) < 2, "zero", ids))
    refused("one after the other", execution_id=np.arange(len(ids)))
    refused("x finite", x=np.where(np.arange(len(ids)) == 5, np.inf, columns["x"]))
    refused("several", primitive=np.where(np.arange(len(ids)) == 5, "other", columns["primitive"]))
    refused("no execution_id|none", execution_id=pa.array(ids, mask=ids == "two"))
    refused("one rate", t=np.where(ids == "two", 2.0, 1.0) * columns["t"])
    refused("column 't'", t=columns["execution_id"])
    refused("'execution_id' of text or whole numbers", execution_id=columns["t"])
    refused("'primitive' of text", primitive=columns["t"])
    written(tmp_path / "good.parquet", columns)
    with pytest.raises(InputError, match="label to be one of"):
        read_parquet(tmp_path / "good.parquet", Selection(label="z"))
    with pytest.raises(DataFileError, match="x, y, z or q"):
        read_parquet(written(tmp_path / "named.parquet", {k: v for k, v in columns.items() if k not in "xy"}))


def test_a_rate_that_is_asked_for_is_that_of_all_executions(tmp_path):
    columns = rows_of(three())
    read = read_parquet(written(tmp_path / "one.parquet", columns), Selection(dt=0.02))
    assert [(d.n_samples, d.dt) for d in read] == [(10, 0.02), (17, 0.02), (10, 0.02)]
    np.testing.assert_array_equal(read[0].positions, three()[0].positions[::2])
    columns["t"] = np.where(columns["execution_id"] == "two", 2.0, 1.0) * columns["t"]
    read = read_parquet(written(tmp_path / "two.parquet", columns), Selection(dt=0.02))
    assert [d.n_samples for d in read] == [10, 33, 10]
    np.testing.assert_array_equal(read[1].positions, three()[1].positions)


def test_too_long_an_execution_is_not_kept_in_memory(tmp_path, monkeypatch):
    """But known by its name, among others that are as they should be."""
    monkeypatch.setattr(parquet_executions, "PIECE", 10_000)
    lengths = np.array([50, 150_000, 40, 100_001, 30])
    ids = np.repeat(["a", "b", "c", "d", "e"], lengths)
    times = np.concatenate([0.01 * np.arange(n) for n in lengths])
    file = ParquetExecutions(written(tmp_path / "long.parquet", {"execution_id": ids, "t": times, "x": times}))
    found = file.executions()
    np.testing.assert_array_equal(np.diff(found.starts), lengths)
    tables = list(file.read(Span(0, int(lengths.sum()), lengths), ["x"]))
    assert [name.as_py() for table in tables for name in table.ids] == list("abcde")
    assert [bool(usable) for table in tables for usable in table.usable] == [True, False, True, False, True]
    assert len(column_of(tables, "x")) == 50 + 1 + 40 + 1 + 30


@pytest.mark.parametrize("share", [0.0, 0.01, 0.5, 0.99, 0.999])
def test_a_truncated_file_is_refused(tmp_path, share):
    write_parquet(tmp_path / "whole.parquet", three())
    payload = (tmp_path / "whole.parquet").read_bytes()
    (tmp_path / "part.parquet").write_bytes(payload[: int(share * len(payload))])
    with pytest.raises(DataFileError, match="undamaged Parquet file"):
        read_parquet(tmp_path / "part.parquet")


def test_what_is_no_file_is_refused(tmp_path):
    for path in (tmp_path, tmp_path / "none.parquet"):
        with pytest.raises(DataFileError):
            read_parquet(path)


def test_a_damaged_file_is_refused_or_read_but_nothing_else(tmp_path):
    write_parquet(tmp_path / "whole.parquet", three())
    payload = bytearray((tmp_path / "whole.parquet").read_bytes())
    rng = np.random.default_rng(0)
    for place in rng.integers(len(payload), size=150):
        damaged = bytearray(payload)
        damaged[place] ^= 1 << int(rng.integers(8))
        (tmp_path / "bad.parquet").write_bytes(damaged)
        try:
            read_parquet(tmp_path / "bad.parquet")
        except (DataFileError, InputError):
            continue


def test_without_pyarrow_it_says_what_to_type(tmp_path, monkeypatch):
    monkeypatch.setattr("probdmp.io.parquet_layout.find_spec", lambda name: None)
    for action in (lambda: read_parquet(tmp_path / "a.parquet"), lambda: write_parquet(tmp_path / "a.parquet", three())):
        with pytest.raises(MissingExtraError, match=r"pip install 'probdmp\[fleet\]'"):
            action()
    assert importlib.util.find_spec("pyarrow") is not None


clocks = st.builds(
    SimpleNamespace,
    step=st.sampled_from([0.01, 1 / 120, 0.0004, 3.0]),
    start=st.sampled_from([0.0, -5.0, 123.456]),
    places=st.lists(st.integers(1, 4), min_size=2, max_size=12),
    jitter=st.sampled_from([0.0, 1e-7, 0.04, 0.3]),
    seed=st.integers(0, 10),
)


@given(st.lists(clocks, min_size=1, max_size=6))
@settings(max_examples=200, deadline=None)
def test_many_clocks_at_once_are_as_each_by_itself(some):
    """Whatever step is found, the samples are at its multiples; and with most rows there and little jitter one is found."""
    times = []
    for clock in some:
        places = np.cumsum([0, *clock.places])
        jitter = clock.jitter * np.random.default_rng(clock.seed).uniform(-1, 1, len(places))
        times.append(clock.start + clock.step * (places + jitter))
    offsets = np.cumsum([0, *map(len, times)])
    together = even_clocks(np.concatenate(times), offsets)
    for i, (clock, own) in enumerate(zip(some, times, strict=True)):
        alone = even_clocks(own, np.array([0, len(own)]))
        np.testing.assert_array_equal(together.steps[i], alone.steps[0])
        step = together.steps[i]
        samples = slice(offsets[i], offsets[i + 1])
        found = np.arange(len(own)) if together.places is None else together.places[samples]
        if np.isnan(step):
            assert clock.jitter > 0.01 or np.mean(np.array(clock.places) == 1) <= 0.5 or not together.increase[i]
        else:
            np.testing.assert_array_equal(found, grid_places(own, step))
        assert together.increase[i] == bool((np.diff(own) > 0).all())
