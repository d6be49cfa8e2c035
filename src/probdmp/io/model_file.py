"""Model files, `.probdmp`: a safetensors file with one text of metadata, canonical JSON.

    schema        "probdmp.primitive/1"
    primitives    {label: the fields of `Primitive` that are not arrays}
    settings, detector, provenance    as in `ModelContents`
    digest        SHA-256 in hexadecimal over the metadata with the digest blank, "", followed by each tensor in the order
                  of their names: its [name, "F64", shape] as canonical JSON, then its bytes

The arrays of a primitive are tensors named `<i>/<field>`, i the place of its label among the sorted labels; those of its
variation, if `"variation"` is true, `<i>/variation/<field>`; those of its channels, if `"channels"`, the list of their names,
is not empty, `<i>/channels/<field>`. Nothing is ever unpickled or imported by name.
"""

import hashlib
import os
import re
from collections.abc import Mapping
from dataclasses import asdict, fields
from typing import Any

import numpy as np

from probdmp.checks import FloatArray
from probdmp.dmp import ChannelVariation, Configuration, Primitive, Variation
from probdmp.errors import InputError, InputTypeError, ModelFileError
from probdmp.io.atomic import write_atomically
from probdmp.io.canonical_json import dump_json, parse_json
from probdmp.io.container import LARGEST_MODEL, damaged, pack, unpack
from probdmp.io.model_contents import ModelContents
from probdmp.io.regular_file import open_regular

__all__ = ["decode_model", "encode_model", "read_model", "write_model"]

SCHEMA = "probdmp.primitive/1"
KEYS = {"schema", "primitives", "settings", "detector", "provenance", "digest"}
ARRAYS = [field.name for field in fields(Primitive) if field.type is FloatArray]
VALUES = {field.name for field in fields(Primitive)} - set(ARRAYS)
PARTS = {
    "variation": [field.name for field in fields(Variation)],
    "channels": [field.name for field in fields(ChannelVariation) if field.type is FloatArray],
}
"""By field of a primitive that has arrays of its own: their names."""
CONFIGURATION = {field.name for field in fields(Configuration)}


def write_model(path: str | os.PathLike[str], contents: ModelContents) -> None:
    """Write a model file, replacing an older one in one step.

    Raises
    ------
    InputError
        If the model is too large, or something other than a file is in the way.
    """
    write_atomically(path, encode_model(contents))


def read_model(path: str | os.PathLike[str]) -> ModelContents:
    """Read a model file; arrays are those that were written, bit for bit.

    Raises
    ------
    ModelFileError
        If it is not a regular file, is larger than 200 MB, damaged in any byte, from a newer version, or no valid model.
    """
    with open_regular(path, LARGEST_MODEL, ModelFileError, follow_links=False) as file:
        payload = file.read(LARGEST_MODEL + 1)
    return decode_model(payload, os.fspath(path))


def encode_model(contents: ModelContents) -> bytes:
    """The bytes of a model file; the same contents give the same bytes.

    Raises
    ------
    InputError
        If the model is too large.
    """
    tensors = {
        f"{i}/{name}": array
        for i, (_, primitive) in enumerate(sorted(contents.primitives.items()))
        for name, array in _arrays(primitive).items()
    }
    metadata = {
        "schema": SCHEMA,
        "primitives": {label: _values(primitive) for label, primitive in contents.primitives.items()},
        "settings": dict(contents.settings),
        "detector": None if contents.detector is None else dict(contents.detector),
        "provenance": dict(contents.provenance),
    }
    return pack(dump_json(metadata | {"digest": _digest(metadata, tensors)}), tensors)


def decode_model(payload: bytes, name: str) -> ModelContents:
    """The contents of the bytes of a model file.

    Parameters
    ----------
    name : of the file, for messages.

    Raises
    ------
    ModelFileError
        See `read_model`.
    """
    text, tensors = unpack(payload, name)
    try:
        metadata = parse_json(text)
    except ValueError as error:
        raise damaged(name, "metadata in JSON", str(error)) from error
    _check_schema(metadata, name)
    if metadata.keys() != KEYS:
        raise damaged(name, f"metadata with {sorted(KEYS)}", str(sorted(metadata)))
    if metadata.pop("digest") != _digest(metadata, tensors):
        raise damaged(name, "the digest that belongs to the content", "another: the content has changed")
    try:
        return ModelContents(
            _primitives(metadata["primitives"], tensors), metadata["settings"], metadata["detector"], metadata["provenance"]
        )
    except (InputError, InputTypeError) as error:
        raise damaged(name, error.expected, error.got) from error


def _check_schema(metadata: Any, name: str) -> None:
    schema = metadata.get("schema") if isinstance(metadata, dict) else None
    if schema == SCHEMA:
        return
    if isinstance(schema, str) and re.fullmatch(r"probdmp\.primitive/[1-9]\d*", schema):
        hint = "A newer probdmp wrote this file. Update with: pip install --upgrade probdmp"
        raise ModelFileError(f"schema {SCHEMA!r} in {name}", f"{schema!r:.200}", hint)
    raise damaged(name, f"schema {SCHEMA!r}", repr(schema))


def _digest(metadata: Mapping[str, Any], tensors: Mapping[str, FloatArray]) -> str:
    digest = hashlib.sha256(dump_json({**metadata, "digest": ""}).encode("ascii"))
    for key, tensor in sorted(tensors.items()):
        digest.update(dump_json([key, "F64", list(tensor.shape)]).encode("ascii"))
        digest.update(np.ascontiguousarray(tensor, "<f8").data)
    return digest.hexdigest()


def _values(primitive: Primitive) -> dict[str, Any]:
    values = {name: getattr(primitive, name) for name in VALUES}
    return values | {
        "configuration": asdict(primitive.configuration),
        "names": list(primitive.names),
        "variation": primitive.variation is not None,
        "channels": list(primitive.channel_names),
    }


def _arrays(primitive: Primitive) -> dict[str, FloatArray]:
    arrays = {name: getattr(primitive, name) for name in ARRAYS}
    for part in PARTS:
        if (value := getattr(primitive, part)) is not None:
            arrays |= {f"{part}/{name}": array for name, array in value.arrays().items()}
    return arrays


def _primitives(given: Any, tensors: Mapping[str, FloatArray]) -> dict[str, Primitive]:
    if not isinstance(given, dict) or tensors.keys() != _tensor_names(given):
        raise InputError(f"primitives with tensors {', '.join(ARRAYS)} each", f"{sorted(tensors)}")
    primitives = {}
    for i, (label, values) in enumerate(sorted(given.items())):
        if not isinstance(values, dict) or values.keys() != VALUES:
            raise InputError(f"primitive {label!r:.100} with {sorted(VALUES)}", repr(values))
        primitives[label] = _primitive(values, {name: tensors[f"{i}/{name}"] for name in _array_names(values)})
    return primitives


def _primitive(values: dict[str, Any], arrays: Mapping[str, FloatArray]) -> Primitive:
    """From the values and arrays by which `_values` and `_arrays` say it."""
    configuration, names, channels = values["configuration"], values["names"], values["channels"]
    if not isinstance(configuration, dict) or configuration.keys() != CONFIGURATION or not isinstance(names, list):
        raise InputError(f"a configuration with {sorted(CONFIGURATION)} and a list of names", repr(values))
    if not isinstance(values["variation"], bool) or not isinstance(channels, list):
        raise InputError("variation as true or false, and channels as a list of names", repr(values))
    parts = {part: {name: arrays[f"{part}/{name}"] for name in PARTS[part]} for part in PARTS if values[part]}
    rest = {
        "configuration": Configuration(**configuration),
        "names": tuple(names),
        "variation": Variation(**parts["variation"]) if "variation" in parts else None,
        "channels": ChannelVariation(tuple(channels), **parts["channels"]) if "channels" in parts else None,
    }
    return Primitive(**values | rest | {name: arrays[name] for name in ARRAYS})


def _tensor_names(given: Mapping[str, Any]) -> set[str]:
    return {f"{i}/{name}" for i, (_, values) in enumerate(sorted(given.items())) for name in _array_names(values)}


def _array_names(values: Any) -> list[str]:
    """The arrays of a primitive with these values, which need not be well-formed."""
    present = {part: values.get(part) for part in PARTS} if isinstance(values, dict) else {}
    parts = [part for part, value in present.items() if value is True or (isinstance(value, list) and value)]
    return [*ARRAYS, *(f"{part}/{name}" for part in parts for name in PARTS[part])]
