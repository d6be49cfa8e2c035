"""A recorded movement as checked data: what is kept, what is refused, and in which words."""

import copy
import pickle
from dataclasses import FrozenInstanceError

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from probdmp.demonstrations import Demonstration, as_demonstrations, signals_of, stack_signals
from probdmp.errors import InputError, InputTypeError

POSITIONS = np.arange(10.0).reshape(5, 2)


@given(
    hnp.arrays(
        st.sampled_from([np.float64, np.float32, np.float16, np.int8, np.uint16, np.int64, ">f8", ">i4"]),
        st.tuples(st.integers(3, 20), st.integers(1, 5)),
        elements=st.integers(0, 100),
    ),
    st.floats(1e-6, 10),
)
def test_numbers_of_any_kind_are_kept(positions, dt):
    demo = Demonstration(positions, dt)
    assert demo.positions.dtype == np.float64
    np.testing.assert_array_equal(demo.positions, positions)
    assert (demo.n_samples, demo.n_dof) == positions.shape
    assert demo.duration == (demo.n_samples - 1) * dt
    np.testing.assert_allclose(demo.times, np.arange(demo.n_samples) * dt)
    assert demo.times[-1] == pytest.approx(demo.duration, rel=1e-15)


@pytest.mark.parametrize(
    "arrange",
    [
        lambda a: a,
        lambda a: a.tolist(),
        np.asfortranarray,
        lambda a: np.repeat(a, 2, axis=1)[:, ::2],
        lambda a: a[::-1][::-1],
        lambda a: np.broadcast_to(a, a.shape),
        np.ma.MaskedArray,
        np.asmatrix,
    ],
    ids=["array", "list", "fortran", "strided", "reversed", "read-only", "masked", "matrix"],
)
@pytest.mark.filterwarnings("ignore:the matrix subclass")
def test_arrays_of_any_layout_are_kept(arrange):
    demo = Demonstration(arrange(POSITIONS), 0.1)
    np.testing.assert_array_equal(demo.positions, POSITIONS)
    assert type(demo.positions) is np.ndarray


def test_masked_samples_are_missing_ones():
    for dtype in (float, int):
        masked = np.ma.masked_equal(POSITIONS.astype(dtype), 3)
        np.testing.assert_array_equal(Demonstration(masked, 0.1).positions, np.where(POSITIONS == 3, np.nan, POSITIONS))


def test_it_is_a_frozen_copy():
    given_positions, force = POSITIONS.copy(), np.ones(5)
    demo = Demonstration(given_positions, 0.1, channels={"force": force})
    given_positions[:], force[:] = 7, 7
    np.testing.assert_array_equal(demo.positions, POSITIONS)
    np.testing.assert_array_equal(demo.channels["force"], np.ones(5))
    for array in (demo.positions, demo.channels["force"]):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1
    with pytest.raises(TypeError, match="does not support item assignment"):
        demo.channels["other"] = force
    with pytest.raises(FrozenInstanceError):
        demo.dt = 1.0


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda d: pickle.loads(pickle.dumps(d))], ids=["deepcopy", "pickle"])
def test_it_can_be_copied_and_sent_to_another_process(copied):
    demo = Demonstration(POSITIONS, 0.1, "a", ("x", "y"), "mm", {"force": np.ones(5)})
    twin = copied(demo)
    np.testing.assert_array_equal(twin.positions, POSITIONS)
    np.testing.assert_array_equal(twin.channels["force"], np.ones(5))
    assert (twin.dt, twin.label, twin.names, twin.units) == (0.1, "a", ("x", "y"), "mm")


def test_missing_samples_are_allowed():
    positions = POSITIONS.copy()
    positions[1:3, 0] = np.nan
    np.testing.assert_array_equal(Demonstration(positions, 0.1).positions, positions)


def test_names_are_given_or_counted():
    assert Demonstration(POSITIONS, 0.1).names == ("dof0", "dof1")
    assert Demonstration(POSITIONS, 0.1, names=["x", "y"]).names == ("x", "y")


def test_repr_is_short_and_says_what_it_is():
    assert repr(Demonstration(POSITIONS, 0.1, "a")) == "<Demonstration 'a': 5 samples × 2 DoF, 0.4 s>"
    assert repr(Demonstration(POSITIONS, 0.1)) == "<Demonstration: 5 samples × 2 DoF, 0.4 s>"


@pytest.mark.parametrize(
    ("positions", "error", "match"),
    [
        (np.zeros(5), InputError, r"positions of shape \(T, D\), got \(5,\)\. Time goes first"),
        (np.zeros((2, 5, 2)), InputError, r"positions of shape \(T, D\), got \(2, 5, 2\)\. Time goes first"),
        (np.zeros((2, 2)), InputError, r"positions with 3 to 100000 samples, got \(2, 2\)\. Time goes first"),
        (np.zeros((0, 2)), InputError, r"positions with 3 to 100000 samples, got \(0, 2\)"),
        (np.zeros((100_001, 1)), InputError, r"positions with 3 to 100000 samples, got \(100001, 1\)"),
        (np.zeros((5, 0)), InputError, r"positions with at least one degree of freedom, got \(5, 0\)"),
        ([[1, 2], [3]], InputError, "positions as a rectangular array, got rows of different lengths"),
        ([], InputError, r"positions of shape \(T, D\), got \(0,\)"),
        (None, InputTypeError, "positions as real numbers, got dtype object"),
        ("positions.csv", InputTypeError, "positions as real numbers, got dtype <U13"),
        ([["1", "2"]] * 5, InputTypeError, r"positions as real numbers, got dtype <U1\. Convert"),
        (POSITIONS.astype(complex), InputTypeError, "positions as real numbers, got dtype complex128"),
        (POSITIONS.astype(object), InputTypeError, "positions as real numbers, got dtype object"),
        (POSITIONS > 3, InputTypeError, "positions as real numbers, got dtype bool"),
        (POSITIONS.astype("M8[s]"), InputTypeError, "positions as real numbers, got dtype datetime64"),
        (
            np.where(POSITIONS == 3, np.inf, POSITIONS),
            InputError,
            r"positions finite or NaN.*inf at index \[1, 1\] \(1 such",
        ),
        (np.where(POSITIONS == 3, -1e101, POSITIONS), InputError, r"positions of magnitude at most 1e\+100, got 1e\+101"),
    ],
)
def test_positions_that_cannot_be_used(positions, error, match):
    with pytest.raises(error, match=f"Expected {match}"):
        Demonstration(positions, 0.1)


@pytest.mark.parametrize(
    ("dt", "error"),
    [
        (0, InputError), (-0.1, InputError), (np.nan, InputError), (np.inf, InputError), (1e101, InputError),
        ("0.1", InputTypeError), (None, InputTypeError), ([0.1], InputTypeError), (0.1j, InputTypeError),
        (True, InputTypeError),
    ],
)  # fmt: skip
def test_dt_that_cannot_be_used(dt, error):
    with pytest.raises(error, match=r"Expected dt > 0 in seconds.*milliseconds\? Divide it by 1000"):
        Demonstration(POSITIONS, dt)


@pytest.mark.parametrize("dt", [[[1], [2, 3]], [[]], {}, object(), 10**400, -(10**400), np.zeros(2), np.array("1")])
def test_dt_that_is_no_number_at_all(dt):
    with pytest.raises((InputError, InputTypeError), match="Expected dt > 0 in seconds"):
        Demonstration(POSITIONS, dt)


@pytest.mark.parametrize(
    ("fields", "error", "match"),
    [
        ({"names": ("x",)}, InputError, r"2 different names, one per column, got \('x',\)"),
        ({"names": ("x", "x")}, InputError, "2 different names, one per column"),
        ({"names": ("x", 3)}, InputTypeError, "label, units and names as text"),
        ({"names": 5}, InputTypeError, "names"),
        ({"names": (["x"], "y")}, (InputError, InputTypeError), "names"),
        ({"label": 3}, InputTypeError, "label, units and names as text"),
        ({"units": None}, InputTypeError, "label, units and names as text"),
        ({"channels": {3: np.ones(5)}}, InputTypeError, "names as text"),
        ({"channels": {"f": np.ones(4)}}, InputError, r"channel 'f' of shape \(5,\), got \(4,\)"),
        ({"channels": {"f": ["a"] * 5}}, InputTypeError, "channel 'f' as real numbers"),
        ({"channels": {"x": np.ones(5)}, "names": ("x", "y")}, InputError, "channels named otherwise than the degrees"),
        ({"channels": [np.ones(5)]}, InputTypeError, "channel"),
        ({"channels": ["force"]}, InputTypeError, "channel"),
    ],
)
def test_descriptions_that_do_not_fit(fields, error, match):
    with pytest.raises(error, match=f"Expected .*{match}"):
        Demonstration(POSITIONS, 0.1, **fields)


# --- many of them -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "data",
    [
        [POSITIONS, POSITIONS],
        (POSITIONS, POSITIONS.tolist()),
        np.stack([POSITIONS, POSITIONS]),
        np.ma.MaskedArray(np.stack([POSITIONS, POSITIONS])),
        [Demonstration(POSITIONS, 0.1), POSITIONS],
    ],
    ids=["list", "tuple", "array", "masked", "mixed"],
)
def test_what_a_user_has_becomes_demonstrations(data):
    demos = as_demonstrations(data, 0.1)
    assert len(demos) == 2
    for demo in demos:
        assert demo.dt == 0.1
        np.testing.assert_array_equal(demo.positions, POSITIONS)


def test_demonstrations_keep_their_own_dt():
    demo = Demonstration(POSITIONS, 0.1)
    assert as_demonstrations(demo) == [demo]
    assert as_demonstrations([demo], 0.5) == [demo]


@pytest.mark.parametrize(
    ("data", "dt", "error", "match"),
    [
        ([], 0.1, InputError, "at least one demonstration, got none"),
        (np.zeros((0, 5, 2)), 0.1, InputError, "at least one demonstration, got none"),
        (
            POSITIONS,
            0.1,
            InputError,
            r"a list of \(T, D\) arrays or one \(K, T, D\) array, got .*\(5, 2\)\. One recording",
        ),
        (np.array(3.0), 0.1, InputError, r"one \(K, T, D\) array"),
        ([POSITIONS], None, InputError, r"dt in seconds with bare arrays, got none\. .*dt=0\.01 for 100 Hz"),
        ("letters.npz", 0.1, InputTypeError, "a list of Demonstration or arrays, got str. A file name.*read_demonstrations"),
        ({"a": POSITIONS}, 0.1, InputTypeError, "a list of Demonstration or arrays, got dict"),
        (iter([POSITIONS]), 0.1, InputTypeError, "a list of Demonstration or arrays, got list_iterator"),
        (None, 0.1, InputTypeError, "a list of Demonstration or arrays, got NoneType"),
        (
            [POSITIONS, POSITIONS[:, :1]],
            0.1,
            InputError,
            r"same degrees of freedom \('dof0', 'dof1'\).* in demonstration 1",
        ),
        (
            [Demonstration(POSITIONS, 0.1, names=("x", "y")), Demonstration(POSITIONS, 0.1, names=("y", "x"))],
            None,
            InputError,
            r"same degrees of freedom \('x', 'y'\).*, got \('y', 'x'\).* in demonstration 1",
        ),
        (
            [Demonstration(POSITIONS, 0.1, units="m"), Demonstration(POSITIONS, 0.1, units="mm")],
            None,
            InputError,
            r"in the same units 'm', got .* in 'mm' in demonstration 1",
        ),
        ([POSITIONS, POSITIONS[0]], 0.1, InputError, r"demonstration 1 of shape \(T, D\), got \(2,\)"),
        ([POSITIONS, "b"], 0.1, InputTypeError, "demonstration 1 as real numbers"),
    ],
)
def test_what_is_no_set_of_demonstrations(data, dt, error, match):
    with pytest.raises(error, match=f"Expected .*{match}"):
        as_demonstrations(data, dt)


def test_recordings_side_by_side_end_in_nan():
    short, long = Demonstration(POSITIONS[:3], 0.1), Demonstration(POSITIONS, 0.1)
    stacked = stack_signals([short, long])
    assert stacked.shape == (5, 2, 2)
    np.testing.assert_array_equal(stacked[:, 1], POSITIONS)
    np.testing.assert_array_equal(stacked[:3, 0], POSITIONS[:3])
    assert np.isnan(stacked[3:, 0]).all()


def test_signals_are_positions_then_channels_in_the_order_asked_for():
    felt = Demonstration(POSITIONS, 0.1, channels={"force": np.arange(5.0), "heat": np.ones(5)})
    np.testing.assert_array_equal(signals_of(felt), POSITIONS)
    np.testing.assert_array_equal(signals_of(felt, ["heat", "force"]), np.column_stack([POSITIONS, np.ones(5), np.arange(5.0)]))
    stacked = stack_signals([felt, Demonstration(POSITIONS[:3], 0.1, channels={"force": [1.0, np.nan, 3.0]})], ["force"])
    assert stacked.shape == (5, 2, 3)
    np.testing.assert_array_equal(stacked[:, 1, 2], [1, np.nan, 3, np.nan, np.nan])


def test_channels_that_are_not_there_or_say_nothing():
    felt = Demonstration(POSITIONS, 0.1, channels={"force": np.arange(5.0), "mute": np.full(5, np.nan)})
    with pytest.raises(InputError, match=r"demonstrations with the channels 'force', 'heat', got one with 'force', 'mute'"):
        signals_of(felt, ["force", "heat"])
    with pytest.raises(InputError, match=r"demonstrations with the channels 'heat', got one with none"):
        signals_of(Demonstration(POSITIONS, 0.1), ["heat"])
    with pytest.raises(InputError, match=r"channel 'mute' measured in every demonstration, got one without a single sample"):
        signals_of(felt, ["mute"])
