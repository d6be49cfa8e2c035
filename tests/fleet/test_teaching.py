"""Demonstrations out of a file of many executions."""

import numpy as np
import pytest
from fleet_rows import dense_rows_of, rows_of
from io_strategies import assert_same_demonstrations

from probdmp.errors import DataFileError, InputError
from probdmp.fleet import teaching_executions
from probdmp.io import parquet_executions


@pytest.mark.parametrize("layout", [rows_of, dense_rows_of])
def test_with_few_executions_all_teach(fleet, write, layout):
    taught = teaching_executions(write("few", layout(fleet.executions)))
    assert taught.available == {"c": 5, "l": 5}
    assert not taught.left_out
    for label, demonstrations in taught.demonstrations.items():
        expected = [execution for execution in fleet.executions if execution.label == label]
        for one, other in zip(demonstrations, expected, strict=True):
            np.testing.assert_array_equal(one.positions, other.positions)
            assert (one.dt, one.label, one.names) == (other.dt, label, ("x", "y"))


def test_of_many_some_teach_from_all_over_the_file_whatever_the_pieces(fleet, write, monkeypatch):
    few = write("few", rows_of(fleet.executions))
    many = write("many", rows_of(fleet.executions * 20), row_group_size=300)
    whole = teaching_executions(many, most=10)
    assert whole.available == {"c": 100, "l": 100}
    assert {label: len(members) for label, members in whole.demonstrations.items()} == {"c": 10, "l": 10}
    monkeypatch.setattr(parquet_executions, "PIECE", 100)
    monkeypatch.setattr("probdmp.fleet.plan.PART_SAMPLES", 300)
    pieces = teaching_executions(many, most=10)
    first = teaching_executions(few).demonstrations
    for label in "cl":
        assert_same_demonstrations(pieces.demonstrations[label], whole.demonstrations[label])
        assert whole.demonstrations[label][0].fingerprint == first[label][0].fingerprint
        assert whole.demonstrations[label][-1].fingerprint == first[label][-1].fingerprint


def test_bad_ones_are_left_out_and_counted(fleet, write):
    columns = rows_of(fleet.executions)
    bad = columns["execution_id"] == "e2"
    taught = teaching_executions(write("bad", columns | {"x": np.where(bad, np.inf, columns["x"])}))
    assert len(taught.demonstrations["c"]) == 4
    (reason,) = taught.left_out
    assert "x finite" in reason
    only = columns["primitive"] == "c"
    with pytest.raises(DataFileError, match=r"executions of 'c'.*x finite"):
        teaching_executions(write("worse", columns | {"x": np.where(only, np.inf, columns["x"])}))


def test_any_column_may_say_what_is_executed(fleet, write):
    columns = rows_of(fleet.executions)
    columns["movement"] = columns.pop("primitive")
    path = write("named", columns)
    assert set(teaching_executions(path, "movement").demonstrations) == {"c", "l"}
    assert set(teaching_executions(path, "movement", label="l").demonstrations) == {"l"}
    with pytest.raises(InputError, match="'primitive'"):
        teaching_executions(path)
    with pytest.raises(InputError, match="label to be one of 'c', 'l'"):
        teaching_executions(path, "movement", label="z")
    with pytest.raises(InputError, match="positions to be different ones of x, y"):
        teaching_executions(path, "movement", columns=["x", "z"])
    assert teaching_executions(path, "movement", columns=["y", "x"]).demonstrations["c"][0].names == ("y", "x")
