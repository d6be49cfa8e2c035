"""CSV files: what is written is read, what others write is understood or refused with line and column, and cheaply."""

import time
import tracemalloc
import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from probdmp.demonstrations import Demonstration
from probdmp.errors import DataFileError, InputError, InputTypeError, RecordingWarning
from probdmp.io import Selection, read_csv, read_demonstrations, write_csv, write_demonstrations
from probdmp.io.csv_header import CUT, LABEL, TIME, split_unit
from probdmp.io.csv_lines import LARGEST_CSV, LONGEST_LINE

values = st.floats(-1e100, 1e100) | st.just(float("nan"))
texts = st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\n\r\0\ufffd"), max_size=8).filter(
    lambda text: text == text.strip()
)
names = texts.filter(lambda text: text and split_unit(text)[0].lower() not in (*TIME, *CUT, *LABEL))
units = texts.filter(lambda text: not set(text) & set("[]"))


def is_position(name):
    return name in ("x", "y", "z") or name.startswith(("q", "dof"))


@st.composite
def recordings_of_one_file(draw):
    n_samples = st.integers(3, 6)
    positions = draw(st.lists(st.sampled_from(["x", "y", "z", "q0", "q_é", "dof3"]), min_size=1, max_size=3, unique=True))
    channels = draw(st.lists(names.filter(lambda name: not is_position(name)), max_size=3, unique=True))
    dt, unit = draw(st.floats(1e-6, 1e3)), draw(units)
    demonstrations = []
    for n in draw(st.lists(n_samples, min_size=1, max_size=3)):
        table = draw(arrays(np.float64, (n, len(positions) + len(channels)), elements=values))
        by_name = dict(zip(channels, table.T[len(positions) :], strict=True))
        path = table[:, : len(positions)]
        demonstrations.append(Demonstration(path, dt, draw(texts), tuple(positions), unit, by_name))
    return demonstrations


def assert_same(some, others):
    assert len(some) == len(others)
    for one, other in zip(some, others, strict=True):
        assert (one.dt, one.label, one.names, one.units) == (other.dt, other.label, other.names, other.units)
        np.testing.assert_array_equal(one.positions, other.positions)
        assert list(one.channels) == list(other.channels)
        for name, channel in one.channels.items():
            np.testing.assert_array_equal(channel, other.channels[name])


@given(recordings_of_one_file())
@settings(max_examples=150, deadline=None)
def test_round_trip_is_exact(folder, demonstrations):
    write_csv(folder / "round.csv", demonstrations)
    assert_same(read_csv(folder / "round.csv"), demonstrations)


@given(st.integers(1, 10**6), st.integers(-6, 0), st.integers(3, 400))
@settings(max_examples=100, deadline=None)
def test_any_dt_of_a_few_digits_is_found_again(folder, digits, exponent, n_samples):
    dt = digits * 10.0**exponent
    write_csv(folder / "dt.csv", [Demonstration(np.zeros((n_samples, 1)), dt, names=("x",))])
    (demonstration,) = read_csv(folder / "dt.csv")
    assert (demonstration.dt, demonstration.n_samples) == (dt, n_samples)


@pytest.fixture
def write(tmp_path):
    """`write(text)` or bytes as f.csv; returns its path."""

    def write(contents):
        payload = contents if isinstance(contents, bytes) else contents.encode()
        (tmp_path / "f.csv").write_bytes(payload)
        return tmp_path / "f.csv"

    return write


SMALL = "time [s],x [mm],y [mm],force\n0,1,2,0\n0.1,1.5,,0.5\n0.2,2,nan,1\n"


def test_what_is_written_looks_as_one_would_type_it(tmp_path):
    path = np.array([[1.5, 2], [np.nan, 3], [2, -0.0]])
    demos = [Demonstration(path, 0.29, "a", ("x", "y"), "mm", {"force": np.arange(3.0)}), Demonstration(path, 0.29, "b")]
    demos[1] = Demonstration(path, 0.29, "b", ("x", "y"), "mm", {"force": np.arange(3.0)})
    write_demonstrations(tmp_path / "f.csv", demos)
    assert (tmp_path / "f.csv").read_text().splitlines()[:5] == [
        "demonstration,label,time [s],x [mm],y [mm],force",
        "0,a,0,1.5,2.0,0.0",
        "0,a,0.29,,3.0,1.0",
        "0,a,0.58,2.0,-0.0,2.0",
        "1,b,0,1.5,2.0,0.0",
    ]
    write_demonstrations(tmp_path / "f.csv", [Demonstration(path, 0.29, names=("x", "y"))])
    assert (tmp_path / "f.csv").read_text().startswith("time [s],x,y\n0,1.5,2.0\n")


def test_columns_names_units_and_channels(write):
    (demo,) = read_csv(write(SMALL))
    assert (demo.names, demo.units, demo.label, demo.dt) == (("x", "y"), "mm", "", 0.1)
    np.testing.assert_array_equal(demo.positions, [[1, 2], [1.5, np.nan], [2, np.nan]])
    np.testing.assert_array_equal(demo.channels["force"], [0, 0.5, 1])
    (demo,) = read_csv(write(SMALL), Selection(columns=["force"]))
    assert (demo.names, demo.units, list(demo.channels)) == (("force",), "", ["x", "y"])
    with pytest.raises(InputError, match=r"different ones of 'x', 'y', 'force' in .*f\.csv, got \['w'\]"):
        read_csv(write(SMALL), Selection(columns=["w"]))
    with pytest.raises(InputTypeError, match="columns as a list"):
        read_csv(write(SMALL), Selection(columns="x,y"))


ROWS = [("0", "1,5", "-2e-3"), ("0,01", "", "NaN"), ("0,02", "2,5", "1")]


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
@pytest.mark.parametrize("delimiter", [",", ";", "\t"])
@pytest.mark.parametrize("end", ["\n", "\r\n", "\r", "\r\r\n"])
@pytest.mark.parametrize("decimal_comma", [False, True])
def test_dialects(write, encoding, delimiter, end, decimal_comma):
    rows = ROWS if decimal_comma and delimiter != "," else [[cell.replace(",", ".") for cell in row] for row in ROWS]
    text = end.join([delimiter.join(["Time (s)", "x (µm)", '"y [µm]"']), *map(delimiter.join, rows), "", ""])
    (demo,) = read_csv(write(text.encode(encoding)))
    assert (demo.names, demo.units, demo.dt) == (("x", "y"), "µm", 0.01)
    np.testing.assert_array_equal(demo.positions, [[1.5, -2e-3], [np.nan, np.nan], [2.5, 1]])


def test_what_pandas_and_numpy_write(write, tmp_path):
    (demo,) = read_csv(write(",time,x\n0,0.0,1.0\n1,0.1,2.0\n2,0.2,3.0\n"))  # DataFrame.to_csv with its index
    assert (demo.names, dict(demo.channels)) == (("x",), {})
    table = np.column_stack([np.arange(5) / 8, np.arange(5), np.arange(5)])
    np.savetxt(tmp_path / "s.csv", table, delimiter=",", header="t,x,y")
    (demo,) = read_csv(tmp_path / "s.csv")
    assert demo.dt == 0.125
    np.testing.assert_array_equal(demo.positions, table[:, 1:])


def test_one_long_file(write):
    text = "Trial;label;t;x\n" + "".join(f"{k};{'ab'[k // 2]};{t / 10};{k}\n" for k in range(4) for t in range(3 + k))
    demos = read_csv(write(text))
    assert [(d.label, d.n_samples, d.positions[0, 0]) for d in demos] == [("a", 3, 0), ("a", 4, 1), ("b", 5, 2), ("b", 6, 3)]
    assert [d.n_samples for d in read_csv(write(text), Selection(label="b"))] == [5, 6]
    with pytest.raises(InputError, match=r"one of those in .*f\.csv: 'a' \(2\), 'b' \(2\), got 'q'"):
        read_csv(write(text), Selection(label="q"))


def test_without_a_number_a_new_label_begins_a_demonstration(write):
    text = "label,t,x\n" + "".join(f"{label},{t},0\n" for label in "aba" for t in (0, 0.1, 0.2))
    assert [d.label for d in read_csv(write(text))] == ["a", "b", "a"]


def test_a_file_without_labels_takes_the_one_asked_for(write):
    assert read_csv(write(SMALL), Selection(label="reach"))[0].label == "reach"


# Times


def test_a_file_without_times_needs_dt(write):
    text = "x,y\n1,2\n3,4\n5,6\n"
    (demo,) = read_csv(write(text), Selection(dt=0.01))
    assert (demo.dt, demo.n_samples) == (0.01, 3)
    with pytest.raises(InputError, match=r"a column named time or t in .*f\.csv, or dt, got neither\. Say.*--dt 0\.01"):
        read_csv(write(text))
    with pytest.raises(InputError, match="dt > 0 in seconds"):
        read_csv(write(text), Selection(dt=0.0))


def timed(times, unit=""):
    return f"time{unit},x\n" + "".join(f"{t!r},{k}\n" for k, t in enumerate(times))


@pytest.mark.parametrize(
    ("unit", "scale"), [("", 1), (" [s]", 1), ("(ms)", 1e3), (" [us]", 1e6), (" [µs]", 1e6), (" [ns]", 1e9), (" [Seconds]", 1)]
)
def test_units_of_time(write, unit, scale):
    (demo,) = read_csv(write(timed([0.0, 0.01 * scale, 0.02 * scale, 0.03 * scale], unit)))
    assert demo.dt == pytest.approx(0.01, rel=1e-12)


@pytest.mark.parametrize("epoch", [0.0, 12.34, 1.7e9])
@pytest.mark.parametrize("dt", [0.01, 1 / 120, 1 / 30, 0.005])
def test_jitter_and_rounding_of_an_even_clock_change_nothing(write, epoch, dt):
    rng = np.random.default_rng(0)
    times = [round(epoch + k * dt + dt * rng.uniform(-0.04, 0.04), 6) for k in range(300)]
    (demo,) = read_csv(write(timed(times)))
    assert demo.dt == pytest.approx(dt, rel=1e-4)
    if dt in (0.01, 0.005):
        assert demo.dt == dt  # the same for every file of this device
    np.testing.assert_array_equal(demo.positions[:, 0], np.arange(300))


def test_rows_that_are_left_out_are_missing_samples(write):
    with pytest.warns(RecordingWarning, match=r"f\.csv: 2 rows are left out of an even clock of 0\.01 s: taken as samples"):
        (demo,) = read_csv(write(timed([0, 0.01, 0.02, 0.05, 0.06])))
    np.testing.assert_array_equal(demo.positions[:, 0], [0, 1, 2, np.nan, np.nan, 3, 4])


def test_uneven_times_are_resampled_and_said_so(write):
    times = [0, 0.01, 0.017, 0.03, 0.044, 0.05]
    with pytest.warns(RecordingWarning, match=r"f\.csv: samples are 0\.006 to 0\.014 s apart: resampled .* every 0\.01 s"):
        (demo,) = read_csv(write(timed(times)))
    np.testing.assert_allclose(demo.positions[:, 0], np.interp(np.arange(6) * 0.01, times, np.arange(6)))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        (demo,) = read_csv(write(timed(times)), Selection(dt=0.025))  # asked for
    np.testing.assert_allclose(demo.positions[:, 0], np.interp([0, 0.025, 0.05], times, np.arange(6)))


def test_dt_resamples_an_even_file_too_and_gaps_stay_gaps(write):
    (demo,) = read_csv(write("t,x\n0,0\n0.1,\n0.2,2\n0.3,3\n0.4,4\n"), Selection(dt=0.05))
    np.testing.assert_allclose(demo.positions[:, 0], [0, np.nan, np.nan, np.nan, 2, 2.5, 3, 3.5, 4])


# Refused


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("", r"a table in .*f\.csv, got an empty file\. The first line names the columns, such as: demonstration,label"),
        ("\n\n", "got an empty file"),
        ("t,x\n", "rows of samples in .*, got a header alone"),
        ("0,1,2\n0.1,1,2\n", r"names of columns on line 1 of .*f\.csv, got numbers: '0', '1', '2'\. The first line"),
        ("t,x,x\n", r"different names of columns on line 1 of .*, got 'x' more than once"),
        ("t,time,x\n", "one column of the kind of time on line 1 of .*, got 't', 'time'"),
        ("time [h],x\n", r"time in s, ms, us or ns on line 1 of .*, got 'h'\. Convert"),
        ("t,x\n0,1\n1,2,3\n", r"2 cells on line 3 of .*f\.csv, as many as the header has, got 3: '1,2,3'\. .*semicolons"),
        ("t;x\n0;1\n1\n", r"2 cells on line 3 of .*, got 1: '1'\. Complete the row"),
        ("t,x\n0,1\n0.1,east\n", r"a number in column 'x' on line 3 of .*f\.csv, got 'east'\. Leave the cell empty"),
        ("t,x [mm]\n0,1\n0.1,1_000\n", r"a number in column 'x \[mm\]' on line 3"),
        ("t;x\n0;1\n0.1;1.234,5\n", "a number in column 'x' on line 3 .*'1.234,5'|a comma on line 3 and a point on line 3"),
        ("t;x\n0;1,5\n1;1.5\n", "decimal points or with decimal commas in .*, got a comma on line 2 and a point on line 3"),
        ("t,x\n0,1\n0.1,inf\n0.2,1\n", "a finite number in column 'x' on line 3 of"),
        ("t,x\n0,1\n0.1,1e300\n0.2,1\n", "magnitude at most"),
        ('t,x\n0,"1\n2",3\n', "cells with or without quotes on line 2 of"),
        ("t,x\n0,1\n,2\n0.2,3\n", "a time on line 3 of .*, got none"),
        (
            "t,x\n0,1\n0.2,2\n0.1,3\n",
            r"times that increase in .*, got 0\.2 followed by 0\.1 on line 4\. .*column demonstration",
        ),
        ("t,x\n0,1\n0.1,2\n", "at least 3 rows per demonstration in .*, got 2 on lines 2 to 3"),
        ("demo,t,x\n" + "a,0,0\na,1,1\na,2,2\nb,0,0\n", r"at least 3 rows .*got 1 on lines 5 to 5\. Does every row"),
        ("demo,t,x\na,0,1\nb,0,1\na,1,1\n", "a demonstration in one piece on line 4 of .*, got more of 'a' after another"),
        ("t,x\n0,1\n10,2\n20,3\n", r"times in seconds in .*, got 10 between samples\. Say the unit.*time \[ms\]"),
        ("t,x\n0,1\n0.001,2\n200,3\n", "at most 100000 samples per demonstration"),
        ("t,x\n0,1\n1e-300,2\n2e-300,3\n", "seconds"),
        ("t,x\n-1e308,1\n0,2\n1e308,3\n", r"times of at most 1e\+100 in .*, got -1e\+308 on line 2"),
        ("t,a,b\n0,1,2\n0.1,1,2\n0.2,1,2\n", r"columns named x, y, z or q… in .*, got 'a', 'b'\. Say which"),
        ("t\n0\n0.1\n0.2\n", "columns named x, y, z or q… in .*, got none of numbers"),
        ("t,x [mm],y [cm]\n" + "0,1,1\n0.1,1,1\n0.2,1,1\n", "positions in one unit in .*, got x in 'mm', y in 'cm'"),
        ("t,x\n0,\0\n", r"text in UTF-8, or UTF-16 with its mark, on line 2 of .*, got a NUL character after '0,'\. Save"),
        ("t,x °\n".encode("latin-1"), "on line 1 of .*, got bytes that are neither after 't,x '"),
        ("t,x\n0,1\n".encode("utf-16-le"), "a NUL character"),
        ("t,x\n0,1\n".encode("utf-16")[:-1], "bytes that are neither"),
    ],
)
def test_what_is_wrong_is_named(write, text, match):
    with pytest.raises((DataFileError, InputError), match=match) as caught:
        read_csv(write(text))
    assert "f.csv" in str(caught.value)
    assert caught.value.hint or "magnitude" in match


def test_blank_lines_are_passed_over_unless_they_may_be_samples(write):
    (demo,) = read_csv(write("\n\nt,x\n0,1\n\n0.1,2\n0.2,3\n\n"))
    assert demo.n_samples == 3
    with pytest.raises(DataFileError, match="no blank line before line 4"):
        read_csv(write("x\n1\n\n2\n3\n"), Selection(dt=0.1))
    assert read_csv(write("x\n1\nnan\n2\n\n"), Selection(dt=0.1))[0].n_samples == 3


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"names": ("x", "tilt")}, "names that say which columns are positions"),
        ({"names": ("a", "Time")}, "columns not named as time"),
        ({"names": ("a", "label")}, "columns not named as time"),
        ({"names": ("a", "")}, "empty names"),
        ({"label": "a\nb"}, "without line breaks"),
        ({"label": " a"}, "without line breaks"),
        ({"label": "\ud800"}, "without line breaks"),
        ({"units": "[mm]"}, "brackets in units"),
        ({"channels": {"x": np.zeros(5)}, "names": ("a", "b")}, "names that say which"),
    ],
)
def test_what_a_csv_file_cannot_hold_is_refused(tmp_path, change, match):
    demonstration = Demonstration(**{"positions": np.ones((5, 2)), "dt": 0.01, "names": ("x", "y"), **change})
    with pytest.raises(InputError, match=match):
        write_csv(tmp_path / "f.csv", [demonstration])
    assert not (tmp_path / "f.csv").exists()


def test_names_that_say_nothing_need_columns_when_read(tmp_path):
    demonstration = Demonstration(np.ones((5, 2)), 0.01, names=("a [b]", "tilt"), units="mm")
    write_csv(tmp_path / "f.csv", [demonstration])
    with pytest.raises(DataFileError, match="Say which are positions"):
        read_csv(tmp_path / "f.csv")
    assert_same(read_csv(tmp_path / "f.csv", Selection(columns=["a [b]", "tilt"])), [demonstration])


# Damage


def refused_or_demonstrations(path):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RecordingWarning)
        try:
            demonstrations = read_csv(path)
        except (DataFileError, InputError) as error:
            message = str(error)
        else:
            assert all(isinstance(demonstration, Demonstration) for demonstration in demonstrations)
            return
    assert path.name in message


LONG = 'demo;label;t;x [mm];y [mm];"pen;force"\n' + "".join(f"{k};a{k};{t / 10};{t};;0,5\n" for k in (0, 1) for t in range(4))
assert "." in LONG


def test_truncation_anywhere(write):
    for text in (SMALL, LONG):
        for encoding in ("utf-8", "utf-16"):
            payload = text.encode(encoding)
            for length in range(len(payload)):
                refused_or_demonstrations(write(payload[:length]))


def test_mutations(write):
    rng = np.random.default_rng(0)
    payload = SMALL.encode()
    for position in rng.integers(0, len(payload), 2000):
        mutated = bytearray(payload)
        mutated[position] = rng.choice([rng.integers(256), *b',;"\n0.eE-\t'])
        refused_or_demonstrations(write(bytes(mutated)))


@given(st.binary(max_size=200) | st.text(alphabet=',;\t"\n0123456789.e-txny[]# ', max_size=200).map(str.encode))
@settings(max_examples=300, deadline=None)
def test_noise(folder, noise):
    (folder / "noise.csv").write_bytes(noise)
    refused_or_demonstrations(folder / "noise.csv")


@given(
    st.lists(
        st.lists(st.sampled_from(["", "nan", "0", "1", "1e99", "-1e99", "5e-324", "1e-9", "7.5"]), min_size=3, max_size=3),
        max_size=8,
    )
)
@settings(max_examples=300, deadline=None)
def test_any_numbers(folder, rows):
    (folder / "numbers.csv").write_text("time [s],x,y\n" + "".join(",".join(row) + "\n" for row in rows))
    refused_or_demonstrations(folder / "numbers.csv")


# Hostile files


def assert_refused_cheaply(path, match, most_bytes=3_000_000):
    tracemalloc.start()
    begin = time.process_time()
    try:
        with pytest.raises(DataFileError, match=match):
            read_csv(path)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert time.process_time() - begin < 1
    assert peak < most_bytes


def test_huge_lines_and_tables(write, tmp_path):
    assert_refused_cheaply(write(",".join(["x"] * 10**6)), f"at most {LONGEST_LINE} characters on line 1")
    assert_refused_cheaply(write("t,x\n" + "0" * 10**7), f"at most {LONGEST_LINE} characters on line 2", 10**6)
    assert_refused_cheaply(write(",".join(f"a{i}" for i in range(1001))), "at most 1000 columns on line 1 of .*, got 1001")
    assert_refused_cheaply(write('t,x\n"' + "\n" * 10**6), "cells with or without quotes on line 2")
    with (tmp_path / "large.csv").open("wb") as file:
        file.truncate(2**40)
    assert_refused_cheaply(tmp_path / "large.csv", f"at most {LARGEST_CSV} bytes")


def test_memory_stays_a_small_multiple_of_the_file(write):
    path = write("t,x,y,z\n" + "".join(f"{t / 100:.2f},,,\n" for t in range(25_000)))
    tracemalloc.start()
    read_csv(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 20 * path.stat().st_size


def test_what_is_not_a_file(tmp_path):
    for path, match in ((tmp_path / "none.csv", "got no such file"), (tmp_path, "got a directory")):
        assert_refused_cheaply(path, match)


# Real recordings


def test_real_handwriting_survives(recordings, tmp_path):
    demonstrations = read_demonstrations(recordings / "uci_letters" / "letters.npz", label="a")
    write_demonstrations(tmp_path / "f.csv", demonstrations)
    assert_same(read_demonstrations(tmp_path / "f.csv"), demonstrations)
