"""Model files: what is written is read, bit for bit; what was changed in any way is refused."""

import dataclasses
import hashlib
import json
import os
import struct
import time
import tracemalloc

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from safetensors.numpy import load, save

from probdmp.dmp import ChannelVariation, Variation
from probdmp.errors import InputError, InputTypeError, ModelFileError
from probdmp.io import ModelContents, decode_model, encode_model, read_model, write_model

json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=8,
)
json_dicts = st.dictionaries(st.text(), json_values, max_size=3)


def metadata_of(payload):
    size = int.from_bytes(payload[:8], "little")
    return json.loads(json.loads(payload[8 : 8 + size])["__metadata__"]["probdmp"])


def sealed(metadata, tensors):
    """A file with any content and the digest that belongs to it, made as the format's description says."""

    def dump(value):
        return json.dumps(value, sort_keys=True, separators=(",", ":"))

    digest = hashlib.sha256(dump({**metadata, "digest": ""}).encode())
    for name in sorted(tensors):
        digest.update(dump([name, "F64", list(tensors[name].shape)]).encode() + tensors[name].astype("<f8").tobytes())
    return save(tensors, {"probdmp": dump({**metadata, "digest": digest.hexdigest()})})


def with_header(header, body=b""):
    text = header if isinstance(header, bytes) else json.dumps(header, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 8)
    return struct.pack("<Q", len(text)) + text + body


def assert_same_values(one, other):
    assert type(one) is type(other)
    for field in dataclasses.fields(other):
        wanted, got = getattr(other, field.name), getattr(one, field.name)
        if isinstance(wanted, np.ndarray):
            assert (got.dtype, got.shape, got.tobytes()) == (wanted.dtype, wanted.shape, wanted.tobytes())
            assert not got.flags.writeable
        elif isinstance(wanted, Variation | ChannelVariation):
            assert_same_values(got, wanted)
        else:
            assert got == wanted
            assert type(got) is type(wanted)


def assert_same(one, other):
    assert list(one.primitives) == sorted(other.primitives)
    for label, primitive in other.primitives.items():
        assert_same_values(one.primitives[label], primitive)
        assert one.primitives[label].identity == primitive.identity
    assert (one.settings, one.detector, one.provenance) == (other.settings, other.detector, other.provenance)


@given(
    labels=st.sets(st.text(), min_size=1, max_size=12),
    seed=st.integers(0, 2**32),
    n_dof=st.integers(1, 3),
    n_basis=st.integers(1, 4),
    n_channels=st.integers(0, 2),
    plain=st.tuples(json_dicts, st.none() | json_dicts, st.dictionaries(st.text(), st.text(), max_size=3)),
)
@settings(max_examples=60, deadline=None)
def test_round_trip_is_exact(make_primitive, labels, seed, n_dof, n_basis, n_channels, plain):
    rng = np.random.default_rng(seed)
    contents = ModelContents({label: make_primitive(rng, n_dof, n_basis, n_channels) for label in labels}, *plain)
    payload = encode_model(contents)
    restored = decode_model(payload, "m.probdmp")
    assert_same(restored, contents)
    assert encode_model(restored) == payload


def test_round_trip_through_a_file(small_model, tmp_path):
    write_model(tmp_path / "m.probdmp", small_model)
    assert_same(read_model(tmp_path / "m.probdmp"), small_model)
    assert os.listdir(tmp_path) == ["m.probdmp"]


def test_any_safetensors_reader_reads_the_arrays(small_model):
    tensors = load(encode_model(small_model))
    np.testing.assert_array_equal(tensors["1/weight_means"], small_model.primitives["β"].weight_means)
    np.testing.assert_array_equal(tensors["2/channels/means"], small_model.primitives["γ"].channels.means)


def test_channels_are_named_in_the_metadata(small_model):
    primitives = metadata_of(encode_model(small_model))["primitives"]
    assert {label: values["channels"] for label, values in primitives.items()} == {"a": [], "β": [], "γ": ['ünit/"[N]']}


def test_format_is_the_one_described(small_model):
    payload = encode_model(small_model)
    assert sealed(metadata_of(payload), load(payload)) == payload
    assert metadata_of(payload)["schema"] == "probdmp.primitive/1"


def test_provenance_is_made_unless_given(make_primitive):
    provenance = ModelContents({"": make_primitive(np.random.default_rng(0), 1, 1)}, {}).provenance
    assert set(provenance) == {"probdmp", "created"}
    assert provenance["created"].endswith("+00:00")


@pytest.mark.parametrize(
    ("change", "error", "match"),
    [
        ({"primitives": {}}, InputError, "at least one primitive, got none"),
        ({"primitives": {"a": 3}}, InputTypeError, "'a' as Primitive, got int"),
        ({"primitives": None}, InputTypeError, "primitives as a mapping, got NoneType"),
        ({"settings": {"a": (1, 2)}}, InputTypeError, "settings as plain JSON.*lists"),
        ({"settings": {1: 2}}, InputTypeError, "settings as plain JSON.*text keys"),
        ({"settings": {"a": np.zeros(2)}}, InputTypeError, "settings as plain JSON, got.*ndarray"),
        ({"detector": {"a": float("nan")}}, InputTypeError, "detector as plain JSON.*finite"),
        ({"provenance": {"a": 1}}, InputTypeError, "'a' as str, got int"),
    ],
)
def test_contents_that_no_file_can_hold_are_refused(small_model, change, error, match):
    with pytest.raises(error, match=match):
        dataclasses.replace(small_model, **change)


def test_too_much_metadata_is_refused_at_saving(small_model):
    with pytest.raises(InputError, match=r"at most 4000000 bytes of metadata.*several models"):
        encode_model(dataclasses.replace(small_model, settings={"a": "x" * 4_000_000}))


# Damage


def test_truncation_anywhere_is_refused(small_model):
    payload = encode_model(small_model)
    for length in range(len(payload)):
        with pytest.raises(ModelFileError, match=r"in .*m\.probdmp.*(copy it|save the model) again"):
            decode_model(payload[:length], "m.probdmp")
    with pytest.raises(ModelFileError, match="bytes of tensors"):
        decode_model(payload + b"\0", "m.probdmp")


def assert_mutations_refused(payload, positions, rng):
    for position in positions:
        mutated = bytearray(payload)
        mutated[position] ^= rng.integers(1, 256)
        with pytest.raises(ModelFileError, match=r"m\.probdmp"):
            decode_model(bytes(mutated), "m.probdmp")


def test_mutations_are_refused(small_model):
    payload, rng = encode_model(small_model), np.random.default_rng(1)
    assert_mutations_refused(payload, rng.integers(0, len(payload), 3000), rng)


@pytest.mark.slow
def test_a_hundred_thousand_mutations_are_refused(small_model):
    payload, rng = encode_model(small_model), np.random.default_rng(2)
    assert_mutations_refused(payload, rng.integers(0, len(payload), 100_000), rng)


def test_every_bit_of_the_arrays_counts(small_model):
    payload = encode_model(small_model)
    for position in range(8 + int.from_bytes(payload[:8], "little"), len(payload)):
        mutated = bytearray(payload)
        mutated[position] ^= 1 << position % 8
        with pytest.raises(ModelFileError, match=r"the digest that belongs to the content in m\.probdmp, got another"):
            decode_model(bytes(mutated), "m.probdmp")


def test_arrays_cannot_change_places(small_model):
    payload = encode_model(small_model)
    swapped = payload.replace(b"0/goal", b"0/GOAL").replace(b"0/start", b"0/goal", 1).replace(b"0/GOAL", b"0/start", 1)
    with pytest.raises(ModelFileError, match="digest"):
        decode_model(swapped, "m.probdmp")


# Hostile files with the right digest


def tampered(name, value, place=0):
    """Replace one array of the first primitive, or of another one."""

    def change(metadata, tensors):
        tensors[f"{place}/{name}"] = np.array(value, dtype=np.float64)

    return change


def rewritten(*path, value):
    """Replace one entry of the metadata."""

    def change(metadata, tensors):
        for key in path[:-1]:
            metadata = metadata[key]
        metadata[path[-1]] = value

    return change


def without(*path):
    def change(metadata, tensors):
        for key in path[:-1]:
            metadata = metadata[key]
        del metadata[path[-1]]

    return change


def one_tensor_less(metadata, tensors):
    del tensors["0/goal"]


def of_channels(name, value):
    """Replace one array of the channel, which is that of the last primitive."""
    return tampered(f"channels/{name}", value, place=2)


def named_channels(value):
    return rewritten("primitives", "γ", "channels", value=value)


def without_variation(metadata, tensors):
    metadata["primitives"]["γ"]["variation"] = False
    for name in [name for name in tensors if name.startswith("2/variation/")]:
        del tensors[name]


@pytest.mark.parametrize(
    ("change", "match"),
    [
        (tampered("goal", [np.nan]), r"goal finite in m\.probdmp, got nan at index \[0\]"),
        (tampered("weight_means", [[np.inf, 0]]), r"weight_means finite in m\.probdmp"),
        (tampered("observation_variances", [-1]), r"observation_variances > 0 in m\.probdmp, got -1"),
        (tampered("weight_covariances", [[[1, 0], [0, -1]]]), "weight_covariances symmetric and positive semi-definite"),
        (tampered("weight_covariances", [[[1, 0.5], [0, 1]]]), "weight_covariances symmetric"),
        (tampered("weight_means", [[1, 2, 3]]), r"weight_means of shape \(1, 2\) in m\.probdmp, got \(1, 3\)"),
        (tampered("goal", [1, 2]), r"goal of shape \(1,\)"),
        (tampered("goal", 1.0), r"goal of shape \(1,\)"),
        (tampered("goal", np.zeros((1, 1, 1, 1))), "at most 3 axes"),
        (tampered("goal", np.zeros((0,))), r"a shape of at most 3 axes.*'0/goal'"),
        (tampered("extra", [1.0]), "primitives with tensors"),
        (one_tensor_less, "primitives with tensors"),
        (rewritten("primitives", "a", "names", value="x"), "a list of names"),
        (rewritten("primitives", "a", "names", value=[]), "shape"),
        (rewritten("primitives", "a", "names", value=[1]), "names and units as text"),
        (rewritten("primitives", "a", "names", value=[{}]), "names and units as text"),
        (rewritten("primitives", "a", "dt", value=-1.0), r"dt > 0 in seconds in m\.probdmp, got -1"),
        (rewritten("primitives", "a", "dt", value=1e10), r"dt from 1e-09 to 1e\+09 seconds in m\.probdmp, got 10000000000"),
        (rewritten("primitives", "a", "dt", value=None), "dt > 0 in seconds, one number"),
        (rewritten("primitives", "a", "duration", value=10**400), r"duration > 0.* in m\.probdmp"),
        (rewritten("primitives", "a", "n_demonstrations", value=0.5), "n_demonstrations as a whole number"),
        (rewritten("primitives", "a", "configuration", value=[]), "a configuration"),
        (rewritten("primitives", "a", "configuration", "n_basis", value=10**9), "n_basis as a whole number from 1 to 1000"),
        (rewritten("primitives", "a", "configuration", "scaling", value="os.system"), "scaling to be one of"),
        (rewritten("primitives", "a", "configuration", "scaling", value={"__class__": "os"}), "scaling to be one of"),
        (without("primitives", "a", "configuration", "scaling"), "a configuration"),
        (without("primitives", "a", "units"), "primitive 'a' with"),
        (rewritten("primitives", "a", "more", value=1), "primitive 'a' with"),
        (rewritten("primitives", value=[]), "primitives with tensors"),
        (rewritten("primitives", "a", value=3), "primitive 'a' with"),
        (rewritten("settings", value=[]), "settings as a mapping"),
        (rewritten("detector", value="x"), "detector as a mapping"),
        (rewritten("provenance", value={"a": 1}), "'a' as str"),
        (without("settings"), "metadata with"),
        (rewritten("more", value=1), "metadata with"),
        (without("schema"), r"schema 'probdmp\.primitive/1' in m\.probdmp, got None"),
        (rewritten("schema", value="other/1"), r"schema 'probdmp\.primitive/1' in m\.probdmp, got 'other/1'"),
        (rewritten("schema", value="probdmp.primitive/2"), r"primitive/2'.*newer probdmp.*pip install --upgrade probdmp"),
        (rewritten("schema", value="probdmp.primitive/" + "9" * 5000), "newer probdmp"),
        (rewritten("schema", value=["probdmp.primitive/1"]), "schema"),
        (named_channels([]), "primitives with tensors"),
        (named_channels(None), "primitives with tensors"),
        (named_channels(True), "channels as a list of names"),
        (named_channels("f"), "primitives with tensors"),
        (named_channels({"f": 1}), "primitives with tensors"),
        (named_channels([1]), "names of channels as text"),
        (named_channels([{}]), "names of channels as text"),
        (named_channels([["f"]]), "names of channels as text"),
        (named_channels(["f", "f"]), r"at least one channel, all named differently in m\.probdmp"),
        (named_channels(["f", "g"]), r"channel means of shape \(2, N \+ 3\) in m\.probdmp, got \(1, 4\)"),
        (named_channels(["q0"]), "channels named otherwise than the degrees of freedom"),
        (rewritten("primitives", "a", "channels", value=["f"]), "primitives with tensors"),
        (without("primitives", "γ", "channels"), "primitives with tensors"),
        (
            rewritten("primitives", "γ", "configuration", "weight_uncertainty", value="independent"),
            "hierarchical.*with channels",
        ),
        (without_variation, "hierarchical.*with channels"),
        (of_channels("means", [[1, 2, np.nan, 4]]), r"channel means finite in m\.probdmp, got nan"),
        (of_channels("means", [[1, 2, 3]]), r"channel covariance of shape \(3, 3\)"),
        (of_channels("covariance", np.eye(3)), r"channel covariance of shape \(4, 4\) in m\.probdmp, got \(3, 3\)"),
        (of_channels("covariance", -np.eye(4)), "channels symmetric and positive semi-definite"),
        (of_channels("covariance", np.triu(np.ones((4, 4)))), "channels symmetric and positive semi-definite"),
        (of_channels("cross_covariance", np.ones((4, 4))), r"a cross covariance of shape \(4, 3\) in m\.probdmp, got \(4, 4\)"),
        (of_channels("cross_covariance", np.ones((3, 3))), r"channel cross_covariance of shape \(4, D \(N \+ 2\)\)"),
        (of_channels("cross_covariance", np.full((4, 3), 1e95)), "channels symmetric and positive semi-definite"),
        (of_channels("ranges", [0.0]), r"channel ranges > 0 in m\.probdmp, got 0"),
        (of_channels("observation_variances", [-1.0]), "channel observation_variances > 0"),
        (of_channels("forcing_precisions", [1.0, 2.0]), r"channel forcing_precisions of shape \(1,\)"),
        (of_channels("more", [1.0]), "primitives with tensors"),
    ],
)
def test_hostile_content_is_refused_whatever_its_digest(small_model, change, match):
    payload = encode_model(small_model)
    metadata, tensors = metadata_of(payload), load(payload)
    change(metadata, tensors)
    with pytest.raises(ModelFileError, match=match):
        decode_model(sealed(metadata, tensors), "m.probdmp")


def test_no_primitives_are_refused(small_model):
    metadata = metadata_of(encode_model(small_model)) | {"primitives": {}}
    with pytest.raises(ModelFileError, match=r"at least one primitive in m\.probdmp"):
        decode_model(sealed(metadata, {}), "m.probdmp")


def test_single_precision_is_refused(small_model):
    payload = encode_model(small_model)
    tensors = {name: np.zeros(tensor.shape, np.float32) for name, tensor in load(payload).items()}
    with pytest.raises(ModelFileError, match=r'"dtype":"F64".*tensor .* of m\.probdmp, got .*"dtype":"F32"'):
        decode_model(sealed(metadata_of(payload), tensors), "m.probdmp")


def entry(shape, begin=0, end=8, dtype="F64"):
    return {"__metadata__": {"probdmp": "{}"}, "a": {"dtype": dtype, "shape": shape, "data_offsets": [begin, end]}}


@pytest.mark.parametrize(
    ("payload", "match"),
    [
        (b"", "a header of at most 4000000 bytes.*got 0 bytes in a file of 0"),
        (struct.pack("<Q", 2**63) + bytes(100), "a header of at most"),
        (struct.pack("<Q", 4_000_001) + bytes(4_100_000), "a header of at most 4000000 bytes.*got 4000001"),
        (struct.pack("<Q", 200) + bytes(100), "a header of at most.*got 200 bytes in a file of 108"),
        (with_header(b"\xff" * 8), "a JSON header"),
        (with_header(b"[" * 1_000_000), "a JSON header.*nested too deeply"),
        (with_header(b'{"a":' * 100_000), "a JSON header.*nested too deeply"),
        (with_header(b"9" * 1_000_000), "a JSON header"),
        (with_header(b"{}"), "metadata of probdmp in the header"),
        (with_header(b"[]"), "metadata of probdmp in the header"),
        (with_header({"__metadata__": {"probdmp": ["{}"]}}), "metadata of probdmp in the header"),
        (with_header({"__metadata__": {"probdmp": "{}", "more": ""}}), "metadata of probdmp in the header"),
        (with_header({"__metadata__": {"probdmp": "[" * 100_000}}), "metadata in JSON.*nested too deeply"),
        (with_header({"__metadata__": {"probdmp": '{"a":1,"a":1}'}}), "metadata in JSON.*not in canonical form"),
        (with_header({"__metadata__": {"probdmp": '{"b":1,"a":1}'}}), "metadata in JSON.*not in canonical form"),
        (with_header({"__metadata__": {"probdmp": '{"a":NaN}'}}), "metadata in JSON"),
        (with_header({"__metadata__": {"probdmp": "[]"}}), "schema"),
        (with_header(b'{"__metadata__":{"probdmp":"{}"},"__metadata__":{"probdmp":"{}"}}'), "not in canonical form"),
        (with_header(b'{"__metadata__": {"probdmp":"{}"}}'), "not in canonical form"),
        (with_header(b'{"__metadata__":{"probdmp":"{}"}}' + b" " * 15), "padded to a multiple of 8"),
        (with_header(entry([1.0]), bytes(8)), "a shape of at most 3 axes"),
        (with_header(entry([True]), bytes(8)), "a shape of at most 3 axes"),
        (with_header(entry("x"), bytes(8)), "a shape of at most 3 axes"),
        (with_header(entry([-1]), bytes(8)), "a shape of at most 3 axes"),
        (with_header(entry([10**30]), bytes(8)), "a shape of at most 3 axes"),
        (with_header(entry([8], 0, 64), bytes(8)), "64 bytes in tensor 'a' of m.probdmp, got 8"),
        (with_header(entry([1], 8, 16), bytes(16)), r'"data_offsets":\[0,8\]'),
        (with_header(entry([1], 0.0), bytes(8)), r'"data_offsets":\[0,8\]'),
        (with_header(entry([1]) | {"b": 3}, bytes(8)), "a shape"),
    ],
)
def test_hostile_bytes_are_refused_quickly_and_in_little_memory(payload, match):
    tracemalloc.start()
    begin = time.perf_counter()
    try:
        with pytest.raises(ModelFileError, match=match):
            decode_model(payload, "m.probdmp")
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert time.perf_counter() - begin < 2
    assert peak < 5e6 + 4 * len(payload)


@given(st.binary(max_size=300))
@settings(max_examples=200, deadline=None)
def test_noise_is_refused(noise):
    for payload in (noise, with_header(noise)):
        with pytest.raises(ModelFileError, match=r"m\.probdmp"):
            decode_model(payload, "m.probdmp")


# What is not a file


def test_missing_file(tmp_path):
    with pytest.raises(ModelFileError, match=r"a readable file at '.*m\.probdmp', got no such file.*Check the path"):
        read_model(tmp_path / "m.probdmp")
    with pytest.raises(ModelFileError, match="got embedded null byte"):
        read_model("m\0.probdmp")


def test_directory(tmp_path):
    with pytest.raises(ModelFileError, match=r"got a directory. Give the path of a file in it"):
        read_model(tmp_path)


def test_pipe_does_not_block(tmp_path):
    os.mkfifo(tmp_path / "m.probdmp")
    with pytest.raises(ModelFileError, match="got a pipe, socket or device"):
        read_model(tmp_path / "m.probdmp")


def test_symbolic_link(small_model, tmp_path):
    write_model(tmp_path / "m.probdmp", small_model)
    (tmp_path / "link.probdmp").symlink_to(tmp_path / "m.probdmp")
    with pytest.raises(ModelFileError, match=r"got a symbolic link\. Give the path of the file itself"):
        read_model(tmp_path / "link.probdmp")


def test_huge_file_is_not_read(tmp_path):
    with (tmp_path / "m.probdmp").open("wb") as file:
        file.truncate(2**40)
    with pytest.raises(ModelFileError, match=r"of at most 200000000 bytes, got 1099511627776 bytes"):
        read_model(tmp_path / "m.probdmp")


# --- variation --------------------------------------------------------------------------------------------------------


def varied_model(make_primitive):
    primitive = make_primitive(np.random.default_rng(0), 2, 3)
    factor = np.random.default_rng(0).standard_normal((10, 10))
    variation = Variation(factor[:2, :5], factor @ factor.T, np.array([0.1, 0.2]))
    return ModelContents({"a": dataclasses.replace(primitive, variation=variation), "b": primitive}, {"a": {}, "b": {}})


def test_the_variation_survives(make_primitive):
    model = varied_model(make_primitive)
    again = decode_model(encode_model(model), "m.probdmp").primitives
    for name, array in model.primitives["a"].variation.arrays().items():
        np.testing.assert_array_equal(getattr(again["a"].variation, name), array)
    assert again["b"].variation is None
    assert {label: p.identity for label, p in again.items()} == {label: p.identity for label, p in model.primitives.items()}


def lost(metadata, tensors):
    del tensors["0/variation/means"]


def denied(metadata, tensors):
    metadata["primitives"]["a"]["variation"] = False


def claimed(metadata, tensors):
    metadata["primitives"]["b"]["variation"] = True


def misspelt(metadata, tensors):
    metadata["primitives"]["b"]["variation"] = "no"


def negative(metadata, tensors):
    tensors["0/variation/covariance"] = -tensors["0/variation/covariance"]


@pytest.mark.parametrize(
    ("change", "match"),
    [
        (lost, "primitives with tensors"), (denied, "primitives with tensors"), (claimed, "primitives with tensors"),
        (misspelt, "variation as true or false"), (negative, "covariance symmetric and positive semi-definite"),
    ],
)  # fmt: skip
def test_a_variation_that_does_not_fit_is_refused(make_primitive, change, match):
    payload = encode_model(varied_model(make_primitive))
    metadata, tensors = metadata_of(payload), load(payload)
    change(metadata, tensors)
    with pytest.raises(ModelFileError, match=match):
        decode_model(sealed(metadata, tensors), "m.probdmp")
