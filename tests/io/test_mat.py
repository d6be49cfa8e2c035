"""MATLAB files, written by SciPy: what people save is understood; what is damaged or hostile is refused, and cheaply."""

import struct
import time
import tracemalloc
import zlib
from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.io import savemat

from probdmp import read_demonstrations, synthetic_letters
from probdmp.errors import DataFileError, InputError, RecordingWarning
from probdmp.io import Selection, read_mat, read_npz
from probdmp.io.mat_elements import LARGEST_MAT

RNG = np.random.default_rng(0)
PATH = np.cumsum(RNG.standard_normal((50, 3)), axis=0)
TIMES = 0.01 * np.arange(50.0)


@pytest.fixture
def save(tmp_path):
    def save(variables, **options):
        savemat(tmp_path / "f.mat", variables, **options)
        return tmp_path / "f.mat"

    return save


def cell(items):
    """A 1 × N cell."""
    array = np.empty((1, len(items)), dtype=object)
    array[0, :] = items
    return array


def structs(records):
    """A 1 × N array of structs."""
    array = np.empty((1, len(records)), dtype=[(key, object) for key in records[0]])
    for i, record in enumerate(records):
        array[0, i] = tuple(record.values())
    return array


RECORDS = [
    {"pos": PATH[:n].T, "F": PATH[:n].T, "t": TIMES[:n], "label": label} for n, label in ((50, "a"), (40, "b"), (45, "a"))
]


@pytest.mark.parametrize("wrap", [structs, cell])
@pytest.mark.parametrize("compressed", [False, True])
def test_structs_are_demonstrations(save, wrap, compressed):
    demos = read_demonstrations(save({"demos": wrap(RECORDS)}, do_compression=compressed))
    assert [(d.label, d.n_samples, d.dt) for d in demos] == [("a", 50, 0.01), ("b", 40, 0.01), ("a", 45, 0.01)]
    assert (demos[0].names, list(demos[0].channels), demos[0].units) == (("x", "y", "z"), ["F_x", "F_y", "F_z"], "")
    np.testing.assert_array_equal(demos[1].positions, PATH[:40])
    np.testing.assert_array_equal(demos[1].channels["F_y"], PATH[:40, 1])
    assert [d.label for d in read_demonstrations(save({"demos": wrap(RECORDS)}), label="a")] == ["a", "a"]
    (first, *_) = read_demonstrations(save({"demos": wrap(RECORDS)}), columns=["F", "x"])
    assert first.names == ("F_x", "F_y", "F_z", "x")


def test_time_goes_along_rows_or_columns(save):
    variants = [PATH, PATH.T]
    for variant in variants:
        (demo,) = read_mat(save({"s": {"pos": variant, "time": TIMES[:, None]}}))
        np.testing.assert_array_equal(demo.positions, PATH)
    (short,) = read_mat(save({"s": {"q": PATH[:5, [0, 1, 2, 0, 1, 2, 0]], "t": TIMES[:5]}}))  # fewer samples than joints
    assert (short.n_samples, short.names[-1]) == (5, "q7")


def test_steps_may_be_told_in_place_of_times(save):
    (demo,) = read_mat(save({"demos": {"pos": PATH, "dt": 0.02}}))
    assert demo.dt == 0.02
    demos = read_mat(save({"demos": cell([{"pos": PATH}, {"pos": PATH}]), "dt": 0.02, "name": "Sine"}))
    assert [(d.dt, d.label) for d in demos] == [(0.02, "Sine")] * 2
    path = save({"demos": cell([{"pos": PATH}])})
    with pytest.raises(InputError, match=r"times in .*f\.mat, or dt, got neither"):
        read_mat(path)
    assert read_mat(path, Selection(dt=0.5))[0].dt == 0.5


def test_times_become_one_rate_as_those_of_any_file(save):
    (demo,) = read_mat(save({"pos": PATH, "t": TIMES}), Selection(dt=0.02))
    np.testing.assert_array_equal(demo.positions, PATH[::2])
    uneven = np.cumsum(RNG.uniform(0.005, 0.015, 50))
    with pytest.warns(RecordingWarning, match="resampled along straight lines"):
        read_mat(save({"pos": PATH, "t": uneven}))
    with pytest.raises(DataFileError, match=r"times that increase .* in demos 1 at sample 3"):
        read_mat(save({"demos": {"pos": PATH, "t": np.where(np.arange(50) == 2, 0.0, TIMES)}}))
    with pytest.raises(DataFileError, match="Times in milliseconds"):
        read_mat(save({"pos": PATH, "t": 1e3 * TIMES}))


def test_plain_variables(save):
    (demo,) = read_mat(save({"x": PATH[:, :1], "y": PATH[:, 1:2], "time": TIMES, "note": "by hand", "limits": [1.0, 2.0]}))
    assert (demo.names, demo.n_samples, demo.dt) == (("x", "y"), 50, 0.01)
    (demo,) = read_mat(save({"M": PATH.T}), Selection(dt=0.01))
    assert demo.names == ("M_1", "M_2", "M_3")
    np.testing.assert_array_equal(demo.positions, PATH)
    demos = read_mat(save({"all": cell([PATH, PATH[:40].T])}), Selection(dt=0.01))
    assert [d.n_samples for d in demos] == [50, 40]
    demos = read_mat(save({"reach": structs(RECORDS[:1]), "wave": structs(RECORDS[1:])}))
    assert [d.label for d in demos] == ["a", "b", "a"]
    bare = [{"pos": PATH, "dt": 0.01}]
    assert [d.label for d in read_mat(save({"reach": structs(bare), "wave": structs(bare)}))] == ["reach", "wave"]


@pytest.mark.parametrize(
    ("variables", "match"),
    [
        ({"note": "nothing"}, "recordings in"),
        ({"demos": structs([RECORDS[0], {**RECORDS[1], "pos": PATH[:2], "F": PATH[:2], "t": TIMES[:2]}])}, "at least 3"),
        ({"demos": {"pos": PATH, "t": TIMES[:30]}}, "'pos' with 30 samples in demos 1"),
        ({"demos": {"pos": PATH, "t": TIMES}, "pos": PATH}, "both: 'demos', 'pos'"),
        ({"all": cell([PATH, PATH[:, :2]])}, "recordings in"),
        ({"demos": {"pos": np.where(PATH[3, 0] == PATH, np.inf, PATH), "t": TIMES}}, "finite"),
        ({"demos": {"pos": PATH * 1j, "t": TIMES}}, "besides times"),
        ({"A": PATH, "B": PATH, "t": TIMES}, "Say which are positions"),
    ],
)  # fmt: skip
def test_what_cannot_be_used_is_refused_by_name(save, variables, match):
    with pytest.raises(DataFileError, match=match):
        read_mat(save(variables))


def test_columns_that_only_some_have_are_left_out_and_said(save):
    with pytest.warns(RecordingWarning, match="only some demonstrations have, left out: 'F_1', 'F_2'"):
        demos = read_mat(save({"demos": cell([{"pos": PATH, "t": TIMES}, {"pos": PATH, "t": TIMES, "F": PATH[:, :2]}])}))
    assert [list(d.channels) for d in demos] == [[], []]


def test_missing_samples_stay_missing(save):
    holes = np.where(np.arange(50)[:, None] == 7, np.nan, PATH)
    assert np.isnan(read_mat(save({"pos": holes, "t": TIMES}))[0].positions[7]).all()


# Character Trajectories


def as_published(demonstrations, force=lambda n: np.sin(np.arange(float(n)))):
    """What the authors of the data set did: velocities with zeros around them, labels by number."""
    letters = sorted({d.label for d in demonstrations})
    signals = [
        np.column_stack([d.positions, d.channels["pen_force"] if d.channels else force(d.n_samples)]) for d in demonstrations
    ]
    velocities = [np.diff(table, axis=0, prepend=np.zeros((1, 3))) for table in signals]
    padded = [np.pad(v, ((5 + i % 3, 7), (0, 0))).T for i, v in enumerate(velocities)]
    labels = [letters.index(d.label) + 1.0 for d in demonstrations]
    consts = {"charlabels": labels, "key": cell(letters), "dt": demonstrations[0].dt, "comments": "…"}
    return {"mixout": cell(padded), "consts": consts, "mixoutcomment": "shifted"}


def test_character_trajectories_are_integrated(save):
    letters = synthetic_letters(3, letters="abc")
    demos = read_demonstrations(save(as_published(letters), do_compression=True))
    assert [d.label for d in demos] == [d.label for d in letters]
    for read, written in zip(demos, letters, strict=True):
        assert (read.names, list(read.channels), read.dt) == (("x", "y"), ["pen_force"], written.dt)
        np.testing.assert_allclose(read.positions, written.positions, atol=1e-9)
    wrong = as_published(letters)
    wrong["consts"]["charlabels"][3] = 4.0
    with pytest.raises(DataFileError, match="to number the letters"):
        read_mat(save(wrong))


def test_published_letters_are_those_of_the_recordings(save, recordings):
    letters = read_npz(recordings / "uci_letters" / "letters.npz")
    demos = read_mat(save(as_published(letters)))
    assert [(d.label, d.n_samples, d.dt) for d in demos] == [(d.label, d.n_samples, d.dt) for d in letters]
    for read, written in zip(demos, letters, strict=True):
        np.testing.assert_allclose(read.positions, written.positions, atol=1e-9)
        np.testing.assert_allclose(read.channels["pen_force"], written.channels["pen_force"], atol=1e-9)


def test_a_real_robot(recordings):
    demos = read_demonstrations(recordings / "panda_pauses" / "symbol17_data.mat", label="symbol", dt=0.001)
    assert (len(demos), demos[0].names, demos[0].label) == (6, ("x", "y", "z"), "symbol")
    assert list(demos[0].channels) == ["vel_x", "vel_y", "vel_z", "F_x", "F_y", "F_z"]
    for demo in demos:  # columns are not mixed up: along x and y, positions change as velocities say
        for i, axis in enumerate("xy"):
            assert np.corrcoef(np.diff(demo.positions[:, i]), demo.channels[f"vel_{axis}"][1:])[0, 1] > 0.5


# Damaged and hostile


def refused_cheaply(path, match):
    tracemalloc.start()
    began = time.perf_counter()
    try:
        with pytest.raises(DataFileError, match=match):
            read_mat(path)
        assert tracemalloc.get_traced_memory()[1] < 60e6
    finally:
        tracemalloc.stop()
    assert time.perf_counter() - began < 2


def test_other_versions_are_refused_by_name(tmp_path, save):
    header = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM"
    (tmp_path / "new.mat").write_bytes(header.ljust(512, b"\0") + b"\x89HDF\r\n\x1a\n")
    refused_cheaply(tmp_path / "new.mat", r"version 7\.3, which is HDF5.*'-v7'")
    refused_cheaply(save({"pos": PATH}, format="4"), "version 4")
    (tmp_path / "empty.mat").write_bytes(b"")
    refused_cheaply(tmp_path / "empty.mat", "an empty file")
    (tmp_path / "none.mat").write_bytes(HEADER)
    refused_cheaply(tmp_path / "none.mat", "variables with numbers")
    with open(tmp_path / "large.mat", "wb") as file:
        file.truncate(LARGEST_MAT + 1)
    refused_cheaply(tmp_path / "large.mat", "of at most")


@pytest.mark.parametrize("compressed", [False, True])
def test_a_part_of_a_file_is_refused(save, compressed):
    path = save({"demos": structs(RECORDS)}, do_compression=compressed)
    whole = path.read_bytes()
    for n in (1, 100, 128, 129, 136, 200, len(whole) // 2, len(whole) - 1):
        path.write_bytes(whole[:n])
        with pytest.raises(DataFileError):
            read_mat(path)


@settings(max_examples=150, deadline=None)
@given(st.data())
def test_a_changed_byte_never_ends_in_another_error(folder, data):
    variables = {"demos": structs([{**r, "more": cell(["text", PATH[:3]])} for r in RECORDS[:2]]), "n": np.int8(3)}
    savemat(folder / "changed.mat", variables)
    payload = bytearray((folder / "changed.mat").read_bytes())
    for _ in range(data.draw(st.integers(1, 3))):
        payload[data.draw(st.integers(0, len(payload) - 1))] = data.draw(st.integers(0, 255))
    (folder / "changed.mat").write_bytes(payload)
    with suppress(DataFileError, InputError):
        read_mat(folder / "changed.mat", Selection(dt=0.01))


def element(kind, data):
    return struct.pack("<2I", kind, len(data)) + data.ljust(-(-len(data) // 8) * 8, b"\0")


def matrix(kind, shape, *parts, name=b"v"):
    flags = element(6, struct.pack("<2I", kind, 0))
    return element(14, flags + element(5, struct.pack(f"<{len(shape)}i", *shape)) + element(1, name) + b"".join(parts))


HEADER = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM"


def test_sizes_that_lie_are_refused(tmp_path):
    deep = matrix(6, (1, 1), element(9, struct.pack("<d", 1)))
    for _ in range(100):
        deep = matrix(1, (1, 1), deep)
    bomb = zlib.compress(matrix(6, (1, 2**27), element(9, bytes(2**20))) + bytes(2**29), 1)
    hostile = {
        "with other than": matrix(6, (2**20, 1), element(9, bytes(8))),
        "unpacked": matrix(6, (2**30, 2**30), element(9, bytes(8))),
        "arrays with 0": matrix(1, (2**20, 1)),
        "deep": deep,
        "other than": matrix(4, (1, 2**20), element(16, b"")),
        "a struct 'v' without fields": matrix(2, (1, 2**20), element(5, struct.pack("<i", 0)), element(1, b"")),
        "of shape": matrix(6, (-1, -1), element(9, b"")),
        "at most": struct.pack("<2I", 15, len(bomb)) + bomb,
    }  # fmt: skip
    for match, payload in hostile.items():
        (tmp_path / "hostile.mat").write_bytes(HEADER + payload)
        if match == "at most":
            with pytest.raises(DataFileError, match=match):
                read_mat(tmp_path / "hostile.mat")
        else:
            refused_cheaply(tmp_path / "hostile.mat", match)


def test_objects_are_left_out_unseen(tmp_path):
    numbers = matrix(6, (4, 2), element(9, np.arange(8.0).tobytes()), name=b"M")
    others = [matrix(kind, (1, 1), element(1, b"\xff" * 64), name=b"o") for kind in (3, 5, 16, 17)]
    nested = matrix(1, (1, 1), others[0], name=b"c")
    (tmp_path / "f.mat").write_bytes(HEADER + b"".join(others) + nested + numbers)
    with pytest.warns(RecordingWarning, match=r"'o', 'o', 'o', 'o', 'c' left out, which are objects"):
        (demo,) = read_mat(tmp_path / "f.mat", Selection(dt=1.0))
    np.testing.assert_array_equal(demo.positions, [[0, 4], [1, 5], [2, 6], [3, 7]])
    (tmp_path / "f.mat").write_bytes(HEADER + others[0])
    with pytest.raises(DataFileError, match="objects alone: o"):
        read_mat(tmp_path / "f.mat")
