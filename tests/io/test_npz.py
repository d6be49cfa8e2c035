"""Demonstration files: what is written is read; what is not such a file is refused, and cheaply."""

import os
import struct
import time
import tracemalloc
import zipfile

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from probdmp.demonstrations import Demonstration
from probdmp.errors import DataFileError, InputError, InputTypeError
from probdmp.io import Selection, read_demonstrations, read_npz, write_demonstrations, write_npz
from probdmp.io.archive import LARGEST_ARCHIVE

values = st.floats(-1e100, 1e100) | st.just(float("nan"))
texts = st.text().filter(lambda text: not text.endswith("\0"))


@st.composite
def recordings_of_one_file(draw):
    columns = draw(st.lists(st.sampled_from(["x", "y", "z", "q0", "q1"]) | texts, min_size=1, max_size=5, unique=True))
    n_dof = draw(st.integers(1, len(columns)))
    dt, units = draw(st.floats(1e-6, 1e3)), draw(texts)
    demonstrations = []
    for n_samples in draw(st.lists(st.integers(3, 6), min_size=1, max_size=3)):
        table = draw(arrays(np.float64, (n_samples, len(columns)), elements=values))
        channels = dict(zip(columns[n_dof:], table.T[n_dof:], strict=True))
        names = tuple(columns[:n_dof])
        demonstrations.append(Demonstration(table[:, :n_dof], dt, draw(texts), names, units, channels))
    return demonstrations


def assert_same(some, others):
    assert len(some) == len(others)
    for one, other in zip(some, others, strict=True):
        assert (one.dt, one.label, one.names, one.units) == (other.dt, other.label, other.names, other.units)
        assert one.positions.tobytes() == other.positions.tobytes()
        assert list(one.channels) == list(other.channels)
        for name, channel in one.channels.items():
            assert channel.tobytes() == other.channels[name].tobytes()


@given(recordings_of_one_file())
@settings(max_examples=60, deadline=None)
def test_round_trip_is_exact(folder, demonstrations):
    write_npz(folder / "round.npz", demonstrations)
    assert_same(read_npz(folder / "round.npz"), demonstrations)


@pytest.fixture
def small():
    """The arrays of a small file: two strokes a and one b, two positions and a force, single precision."""
    return {
        "data": np.random.default_rng(0).standard_normal((12, 3)).astype(np.float32),
        "offsets": np.array([0, 4, 8, 12]),
        "labels": np.array(["a", "b", "a"]),
        "dt": np.array(0.01),
        "columns": np.array(["x", "force", "y"]),
    }


@pytest.fixture
def write(tmp_path):
    """`write(arrays)` as a file, whatever they are; returns its path."""

    def write(contents):
        np.savez(tmp_path / "f.npz", allow_pickle=True, **contents)
        return tmp_path / "f.npz"

    return write


def test_columns_become_positions_and_channels(small, write):
    first, second, third = read_npz(write(small))
    assert (first.names, first.label, first.dt, first.units) == (("x", "y"), "a", 0.01, "")
    np.testing.assert_array_equal(second.positions, small["data"][4:8, [0, 2]])
    np.testing.assert_array_equal(third.channels["force"], small["data"][8:, 1])


def test_label_selects(small, write):
    path = write(small)
    assert_same(read_npz(path, Selection(label="a")), [read_npz(path)[i] for i in (0, 2)])
    with pytest.raises(InputError, match=r"label to be one of those in .*f\.npz: 'a' \(2\), 'b' \(1\), got 'c'"):
        read_npz(path, Selection(label="c"))


def test_columns_select_and_order(small, write):
    path = write(small)
    (first, *_) = read_npz(path, Selection(columns=["force", "x"]))
    assert first.names == ("force", "x")
    np.testing.assert_array_equal(first.positions, small["data"][:4, [1, 0]])
    assert list(first.channels) == ["y"]
    for wrong in (["x", "w"], ["x", "x"], []):
        with pytest.raises(InputError, match=r"columns to be different ones of 'x', 'force', 'y' in .*f\.npz, got \["):
            read_npz(path, Selection(columns=wrong))
    with pytest.raises(InputTypeError, match=r"columns as a list.*Write columns=\['x', 'y'\]"):
        read_npz(path, Selection(columns="x,y"))


@pytest.mark.parametrize("name", ["x", "y", "z", "q", "q0", "q_7", "qx", "qω"])
def test_names_of_positions(small, write, name):
    (first, *_) = read_npz(write(small | {"columns": np.array(["force", name, "xx"])}))
    assert first.names == (name,)


def test_a_file_that_does_not_say_which_columns_are_positions(small, write):
    path = write(small | {"columns": np.array(["X", "xy", "pos_q"])})
    with pytest.raises(DataFileError, match=r"got 'X', 'xy', 'pos_q'\. Say which.*columns=\[\.\.\.\], or --columns"):
        read_npz(path)
    assert read_npz(path, Selection(columns=["X"]))[0].names == ("X",)


def test_names_that_do_not_say_positions_survive(tmp_path):
    for names, channels in (((), {}), (("x", "tilt"), {}), (("y", "x"), {"q0": np.zeros(5)})):
        demonstration = Demonstration(np.ones((5, 2)), 0.01, names=names, channels=channels)
        write_npz(tmp_path / "f.npz", [demonstration])
        assert_same(read_npz(tmp_path / "f.npz"), [demonstration])


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"dt": 0.02}, "the same dt in one file, 0.01, got 0.02 in demonstration 1"),
        ({"units": "mm"}, "in the same units 'm', got .* in 'mm' in demonstration 1"),
        ({"names": ("x", "z")}, "the same degrees of freedom.*in demonstration 1"),
        ({"channels": {}}, r"the same channels in one file, \['force'\], got \[\] in demonstration 1"),
    ],
)
def test_what_differs_within_a_file_is_refused(tmp_path, change, match):
    shared = {
        "positions": np.ones((5, 2)),
        "dt": 0.01,
        "names": ("x", "y"),
        "units": "m",
        "channels": {"force": np.ones(5)},
    }
    with pytest.raises(InputError, match=match):
        write_npz(tmp_path / "f.npz", [Demonstration(**shared), Demonstration(**shared | change)])
    assert os.listdir(tmp_path) == []


def test_what_the_format_cannot_hold_is_refused(tmp_path):
    positions = np.ones((5, 1))
    for demonstration, match in (
        (Demonstration(positions, 0.01, "a\0"), "does not end in NUL"),
        (Demonstration(np.ones((5, 1001)), 0.01), "at most .* 1000 columns"),
    ):
        with pytest.raises(InputError, match=match):
            write_npz(tmp_path / "f.npz", [demonstration])
    with pytest.raises(InputError, match="at least one demonstration"):
        write_npz(tmp_path / "f.npz", [])


def test_missing_samples_are_kept_and_infinities_refused(small, write):
    small["data"][5, 0] = np.nan
    assert np.isnan(read_npz(write(small))[1].positions[1, 0])
    small["data"][5, 0] = np.inf
    with pytest.raises(
        DataFileError, match=r"positions finite.* in demonstration 1 \('b'\) of .*f\.npz, got inf at index \[1, 0\]"
    ):
        read_npz(write(small))


NOT_TEXT = np.array([1, 2, 3])


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"data": np.zeros(12)}, r"'data' of real numbers with 2 axes in .*f\.npz, got dtype float64 and shape \(12,\)"),
        ({"data": np.zeros((12, 3), complex)}, "'data' of real numbers.*complex128"),
        ({"data": np.zeros((12, 3), np.longdouble)}, "'data' of real numbers.*float128"),
        ({"data": np.full((12, 3), "1")}, "'data' of real numbers.*<U1"),
        ({"data": np.zeros((12, 3), "f8,f8")}, "'data' of real numbers"),
        (
            {"data": np.zeros((12, 3), object)},
            "'data.npy' in .* as numbers or text, got Python objects, which are never loaded",
        ),
        ({"data": np.zeros((12, 2))}, "one name for each of the 2 columns.*got 3 names"),
        ({"data": np.zeros((12, 1001)), "columns": np.arange(1001).astype(str)}, "at most 1000"),
        ({"data": np.zeros((0, 10**15))}, "offsets that increase from 0 to the 0 rows"),
        ({"data": np.zeros((12, 0)), "columns": np.array([], str)}, "columns named x, y, z or q"),
        ({"offsets": np.array([0.0, 4, 8, 12])}, "'offsets' of whole numbers"),
        ({"offsets": np.array([0, 8, 4, 12])}, r"offsets that increase from 0 to the 12 rows of data.*got \[ 0  8  4 12\]"),
        ({"offsets": np.array([0, 8, 4, 12], np.uint64)}, "offsets that increase"),
        ({"offsets": np.array([0, 4, 4, 12])}, "offsets that increase"),
        ({"offsets": np.array([0, 4, 8, 13])}, "offsets that increase from 0 to the 12 rows"),
        ({"offsets": np.array([-12, 4, 8, 12])}, "offsets that increase from 0"),
        ({"offsets": np.array([0, 4, 8, 2**63], np.uint64)}, "offsets that increase"),
        ({"offsets": np.array([0, 4, 12])}, "one offset more.*got 3 labels and 3 offsets"),
        ({"offsets": np.array([], int)}, "one offset more.*got 3 labels and 0 offsets"),
        ({"offsets": np.array([0, 1, 2, 12])}, r"positions with 3 to .* samples in demonstration 0 \('a'\) of"),
        ({"offsets": np.array([0]), "labels": np.array([], str)}, "1 to 100000 labels"),
        ({"labels": NOT_TEXT}, "'labels' of text.*int64"),
        ({"labels": np.array([b"a", b"b", b"a"])}, r"'labels' of text.*\|S1"),
        ({"labels": np.array(["a", "b", "a"], object)}, "'labels.npy' in .*Python objects"),
        ({"columns": NOT_TEXT}, "'columns' of text"),
        ({"columns": np.array(["x", "y", "x"])}, "different names of columns as 'columns'"),
        (
            {"columns": np.array([0x110000] * 3, np.uint32).view("U1")},
            r"'columns' of text in .*f\.npz, got a number that is no",
        ),
        ({"labels": np.array([0x7FFFFFFF] * 6, np.uint32).view("U2")}, "'labels' of text"),
        ({"positions": np.array(["x", "w"])}, "different names of columns as 'positions'.*got 'x', 'w'"),
        ({"positions": np.array(["x", "x"])}, "different names of columns as 'positions'"),
        ({"units": np.array(1.0)}, "'units' of text"),
        ({"dt": np.array(0.0)}, "dt > 0 in seconds in demonstration 0.*milliseconds"),
        ({"dt": np.array(-1)}, "dt > 0"),
        ({"dt": np.array(np.nan)}, "dt > 0"),
        ({"dt": np.array([0.01])}, r"'dt' of real numbers with 0 axes.*shape \(1,\)"),
        ({"dt": np.array("0.01")}, "'dt' of real numbers"),
    ],
)
def test_arrays_that_are_not_what_they_should_be(small, write, change, match):
    with pytest.raises(DataFileError, match=match):
        read_npz(write(small | change))


@pytest.mark.parametrize("missing", ["data", "offsets", "labels", "dt", "columns"])
def test_missing_arrays(small, write, missing):
    del small[missing]
    with pytest.raises(DataFileError, match=rf"array '{missing}' of .*f\.npz, got only the arrays .*Write it with"):
        read_npz(write(small))


# Damage


def test_truncation_anywhere_is_refused(small, write):
    path = write(small)
    payload = path.read_bytes()
    for length in range(len(payload)):
        path.write_bytes(payload[:length])
        with pytest.raises(DataFileError, match=r"f\.npz.*copy it again"):
            read_npz(path)


def test_mutations_are_refused_or_harmless(small, write):
    path, rng = write(small), np.random.default_rng(0)
    payload, original = path.read_bytes(), read_npz(path)
    for position in rng.integers(0, len(payload), 1000):
        mutated = bytearray(payload)
        mutated[position] ^= rng.integers(1, 256)
        path.write_bytes(mutated)
        try:
            demonstrations = read_npz(path)
        except DataFileError:
            continue
        assert_same(demonstrations, original)


@given(st.binary(max_size=300))
@settings(max_examples=200, deadline=None)
def test_noise_is_refused(folder, noise):
    end = b"PK\5\6" + struct.pack("<HHHHIIH", 0, 0, 1, 1, len(noise), 0, 0)
    for payload in (noise, noise + end):
        (folder / "noise.npz").write_bytes(payload)
        with pytest.raises(DataFileError, match=r"noise\.npz"):
            read_npz(folder / "noise.npz")


# Hostile archives


def npy(header, data=b"", version=b"\1\0"):
    width = "<H" if version == b"\1\0" else "<I"
    return b"\x93NUMPY" + version + struct.pack(width, len(header)) + header + data


def zipped(path, members, compression=zipfile.ZIP_STORED):
    with zipfile.ZipFile(path, "w", compression) as archive:
        for name, payload in members:
            archive.writestr(name, payload)
    return path


def assert_refused_cheaply(path, match, most_bytes=3_000_000):
    tracemalloc.start()
    begin = time.process_time()  # what others do on the machine is no cost of reading
    try:
        with pytest.raises(DataFileError, match=match):
            read_npz(path)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert time.process_time() - begin < 1
    assert peak < most_bytes


FLOATS = b"{'descr': '<f8', 'fortran_order': False, 'shape': %s}\n"


@pytest.mark.parametrize(
    ("payload", "match"),
    [
        (b"", r"'data\.npy' in .*f\.npz as an \.npy array"),
        (b"hello", "as an .npy array"),
        (npy(FLOATS % b"(1000000000000, 3)", bytes(24)), "as an .npy array.*buffer is too small"),
        (npy(FLOATS % b"(9223372036854775807, 9223372036854775807)"), "as an .npy array"),
        (npy(FLOATS % b"(-1, 3)"), "as an .npy array"),
        (npy(FLOATS % b"('a',)"), "as an .npy array"),
        (npy(FLOATS % b"(1, 3)", bytes(32)), "with 24 bytes of data, got 32"),
        (npy(b"(" * 5000), "as an .npy array"),
        (npy(b"-" * 9000 + b"1"), "as an .npy array"),
        (npy(b"{'descr': __import__('os').abort(), 'fortran_order': False, 'shape': (1,)}"), "as an .npy array"),
        (npy(b"{'descr': '|O', 'fortran_order': False, 'shape': (1,)}", b"cos\nabort\n(tR."), "never loaded"),
        (npy(b"{'descr': [('a', '|O')], 'fortran_order': False, 'shape': (1,)}", bytes(8)), "never loaded"),
        (npy(b" " * 100_000, version=b"\2\0"), "as an .npy array"),
        (npy(FLOATS % b"(1,)", bytes(8), version=b"\3\0"), "as an .npy array"),
        (npy(FLOATS % b"(1,)", bytes(8), version=b"\xff\0"), "as an .npy array"),
    ],
)
def test_hostile_headers_of_arrays(tmp_path, payload, match):
    assert_refused_cheaply(zipped(tmp_path / "f.npz", [("data.npy", payload)]), match)


def test_zip_bomb_is_not_unpacked(tmp_path):
    with (
        zipfile.ZipFile(tmp_path / "f.npz", "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive,
        archive.open("data.npy", "w", force_zip64=True) as member,
    ):
        for _ in range(LARGEST_ARCHIVE // 2**24 + 1):
            member.write(bytes(2**24))
    assert (tmp_path / "f.npz").stat().st_size < 3_000_000
    assert_refused_cheaply(tmp_path / "f.npz", r"at most 536870912 bytes unpacked in .*f\.npz, got 553648128 bytes")


@pytest.mark.parametrize("compression", [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_compressions_that_cannot_be_bounded_are_refused(tmp_path, compression):
    path = zipped(tmp_path / "f.npz", [("data.npy", bytes(2**22))], compression)
    assert_refused_cheaply(path, r"'data\.npy' in .* stored or deflated, got compression")


def test_a_member_that_lies_about_its_size_stays_bounded(tmp_path):
    path = zipped(tmp_path / "f.npz", [("data.npy", bytes(2**24))], zipfile.ZIP_DEFLATED)
    path.write_bytes(path.read_bytes().replace(struct.pack("<I", 2**24), struct.pack("<I", 100)))
    assert_refused_cheaply(path, r"undamaged \.npz archive.*Bad CRC")


def test_many_members_are_not_listed(tmp_path):
    path = zipped(tmp_path / "f.npz", [(f"{i}.npy", b"") for i in range(500)])
    assert_refused_cheaply(path, "a list of members of at most 16384 bytes")


def test_a_zip64_record_cannot_hide_the_list_of_members(small, write):
    path = write(small)
    payload = path.read_bytes()
    path.write_bytes(payload[:-22] + b"PK\6\7" + bytes(16) + payload[-22:])
    assert_refused_cheaply(path, "an .npz archive in .*, got something else")


def test_encrypted_commented_and_repeated_members(tmp_path, small, write):
    path = write(small)
    payload = path.read_bytes()
    path.write_bytes(
        payload.replace(b"PK\3\4\x2d\0\0", b"PK\3\4\x2d\0\1").replace(b"PK\1\2\x2d\3\x2d\0\0", b"PK\1\2\x2d\3\x2d\0\1")
    )
    assert_refused_cheaply(path, "undamaged .npz archive.*encrypted")
    path.write_bytes(payload[:-2] + struct.pack("<H", 5) + b"hello")
    assert_refused_cheaply(path, "an .npz archive in .*, got something else")
    with pytest.warns(UserWarning, match="Duplicate name"):
        zipped(path, [("data.npy", b""), ("data.npy", b"")])
    assert_refused_cheaply(path, "every array once in")


# What is not a file


def test_missing_file_directory_and_pipe(tmp_path):
    os.mkfifo(tmp_path / "pipe.npz")
    with (tmp_path / "large.npz").open("wb") as file:
        file.truncate(2**40)
    for path, match in (
        (tmp_path / "none.npz", r"a readable file at '.*none\.npz', got no such file"),
        (tmp_path, "got a directory"),
        (tmp_path / "pipe.npz", "got a pipe, socket or device"),
        (tmp_path / "large.npz", "at most 536870912 bytes, got 1099511627776 bytes"),
    ):
        assert_refused_cheaply(path, match)


def test_links_are_followed(small, write, tmp_path):
    path = write(small)
    (tmp_path / "link.npz").symlink_to(path)
    assert_same(read_npz(tmp_path / "link.npz"), read_npz(path))


def test_suffix_chooses_the_format(small, write, tmp_path):
    path = write(small)
    demonstrations = read_demonstrations(path, label="a", columns=["y"])
    assert_same(demonstrations, read_npz(path, Selection("a", ["y"])))
    write_demonstrations(tmp_path / "copy.NPZ", demonstrations)
    assert_same(read_demonstrations(str(tmp_path / "copy.NPZ")), demonstrations)
    for name in ("f.txt", "f", "npz"):
        with pytest.raises(InputError, match=rf"a file name that ends in \.npz.*, got '{name}'"):
            read_demonstrations(name)
        with pytest.raises(InputError, match="a file name that ends in"):
            write_demonstrations(name, demonstrations)


# Real recordings


def test_real_handwriting(recordings):
    demonstrations = read_demonstrations(recordings / "uci_letters" / "letters.npz")
    assert len(demonstrations) == 600
    assert len({demonstration.label for demonstration in demonstrations}) == 20
    for demonstration in demonstrations:
        assert (demonstration.names, demonstration.dt) == (("x", "y"), 0.005)
        assert list(demonstration.channels) == ["pen_force"]
        assert 64 <= demonstration.n_samples <= 180


def test_real_reaching_survives_a_round_trip(recordings, tmp_path):
    demonstrations = read_demonstrations(recordings / "clmc_reach" / "reach.npz", label="reach")
    assert (len(demonstrations), demonstrations[0].names) == (97, ("x", "y", "z"))
    write_demonstrations(tmp_path / "f.npz", demonstrations)
    assert_same(read_demonstrations(tmp_path / "f.npz"), demonstrations)
