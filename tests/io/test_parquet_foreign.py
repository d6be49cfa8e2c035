"""Parquet files that others have written: columns are found by name, or chosen."""

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from io_strategies import assert_same_demonstrations

from probdmp import read_demonstrations
from probdmp.demonstrations import Demonstration
from probdmp.errors import DataFileError, InputError, RecordingWarning
from probdmp.io import Selection, read_parquet, write_parquet

PATH = np.cumsum(np.random.default_rng(0).standard_normal((60, 2)), axis=0)
TIMES = np.concatenate([0.01 * np.arange(25), 0.01 * np.arange(35)])


@pytest.fixture
def write(tmp_path):
    def write(columns, units=None):
        arrays = {name: pa.array(values) for name, values in columns.items()}
        fields = [pa.field(n, a.type, metadata={"unit": units[n]} if units and n in units else None) for n, a in arrays.items()]
        pq.write_table(pa.Table.from_arrays(list(arrays.values()), schema=pa.schema(fields)), tmp_path / "f.parquet")
        return tmp_path / "f.parquet"

    return write


def table(**more):
    return {
        "Trial": np.repeat([7, 9], [25, 35]),
        "Label": np.repeat(["a", "b"], [25, 35]),
        "time": TIMES,
        "tcp_x [mm]": PATH[:, 0],
        "tcp_y [mm]": PATH[:, 1],
        "force": PATH[:, 0] ** 2,
        "note": ["…"] * 60,
        "done": np.arange(60) == 59,
    } | more


def test_columns_are_named(write):
    demos = read_demonstrations(write(table()), columns=["tcp_x", "tcp_y"])
    assert [(d.n_samples, d.label, d.dt, d.units, list(d.channels)) for d in demos] == [
        (25, "a", 0.01, "mm", ["force"]), (35, "b", 0.01, "mm", ["force"]),
    ]  # fmt: skip
    np.testing.assert_array_equal(demos[1].positions, PATH[25:])
    with pytest.raises(DataFileError, match="columns named x, y, z or q"):
        read_demonstrations(write(table()))
    with pytest.raises(InputError, match="columns to be different ones of 'tcp_x'"):
        read_demonstrations(write(table()), columns=["note"])
    assert [d.label for d in read_demonstrations(write(table()), columns=["tcp_x"], label="b")] == ["b"]


def test_times_of_any_kind(write):
    moments = pa.array((1_700_000_000_000_000_000 + np.rint(1e9 * TIMES)).astype("int64")).cast(pa.timestamp("ns"))
    for name, values in (
        ("timestamp", moments),
        ("time [ms]", 1e3 * TIMES),
        ("t", TIMES.astype(np.float32)),
        ("Time [S]", TIMES),
    ):
        columns = {key: values for key, values in table().items() if key != "time"} | {name: values}
        demos = read_parquet(write(columns), Selection(columns=["tcp_x"]))
        assert [round(d.dt, 9) for d in demos] == [0.01, 0.01], name
    assert read_parquet(write(table()), Selection(columns=["tcp_x"], dt=0.02))[0].n_samples == 13
    with pytest.raises(DataFileError, match=r"times in seconds .* Name the column time \[ms\]"):
        read_parquet(write(table(time=1000 * TIMES)), Selection(columns=["tcp_x"]))
    with pytest.raises(DataFileError, match=r"times that increase .* in row 26"):
        read_parquet(write(table(time=np.where(np.arange(60) == 26, 0.0, TIMES))), Selection(columns=["tcp_x"]))
    with pytest.raises(DataFileError, match="numbers or timestamps"):
        read_parquet(write(table(time=["now"] * 60)), Selection(columns=["tcp_x"]))
    bare = {"q1": PATH[:, 0], "q2": PATH[:, 1]}
    with pytest.raises(InputError, match="or dt, got neither"):
        read_parquet(write(bare))
    (demo,) = read_parquet(write(bare), Selection(dt=0.5))
    assert (demo.dt, demo.names, demo.n_samples) == (0.5, ("q1", "q2"), 60)


def test_uneven_times_are_resampled(write):
    uneven = np.cumsum(np.random.default_rng(1).uniform(0.005, 0.015, 60))
    with pytest.warns(RecordingWarning, match="resampled along straight lines"):
        read_parquet(write({"t": uneven, "x": PATH[:, 0]}))
    own = {"execution_id": ["one"] * 60, "t": uneven, "x": PATH[:, 0], "goal_x": np.ones(60)}
    with pytest.raises(DataFileError, match="uneven times"):
        read_parquet(write(own))
    (demo,) = read_parquet(write(own), Selection(dt=0.01))
    assert (demo.dt, list(demo.channels)) == (0.01, [])


def test_lists_are_several_columns_and_units_those_of_the_field(write):
    joints = pa.array(PATH.tolist(), pa.list_(pa.float64(), 2))
    for column in (joints, joints.cast(pa.list_(pa.float32()))):
        (demo,) = read_parquet(
            write({"t": 0.01 * np.arange(60), "joints": column}, {"joints": "rad"}), Selection(columns=["joints"])
        )
        assert (demo.names, demo.units) == (("joints_0", "joints_1"), "rad")
    ragged = pa.array([[1.0, 2.0]] * 59 + [[1.0]])
    with pytest.raises(DataFileError, match="lists of one length"):
        read_parquet(write({"t": 0.01 * np.arange(60), "joints": ragged}), Selection(columns=["joints"]))


def test_what_cannot_be_told_apart_is_refused(write):
    with pytest.raises(DataFileError, match="each Trial in one piece"):
        read_parquet(write(table(Trial=np.repeat([7, 9, 7], 20), Label=["a"] * 60)), Selection(columns=["tcp_x"]))
    with pytest.raises(DataFileError, match="one column of the kind of time"):
        read_parquet(write(table(t=TIMES)), Selection(columns=["tcp_x"]))
    with pytest.raises(DataFileError, match="at least 3 samples"):
        read_parquet(write(table(Trial=np.arange(60))), Selection(columns=["tcp_x"]))
    with pytest.raises(DataFileError, match="finite"):
        read_parquet(write(table(force=np.full(60, np.inf))), Selection(columns=["tcp_x"]))
    with pytest.raises(DataFileError, match="1 to 100000 demonstrations"):
        read_parquet(write({name: values[:0] for name, values in table().items()}), Selection(columns=["tcp_x"]))


def test_a_file_of_our_own_says_what_are_positions_at_another_rate_too(tmp_path):
    demo = Demonstration(PATH, 0.01, "a", ("tcp", "lift"), "mm", {"force": PATH[:, 0]})
    write_parquet(tmp_path / "f.parquet", [demo])
    (read,) = read_parquet(tmp_path / "f.parquet", Selection(dt=0.01))
    assert_same_demonstrations([read], [demo])
