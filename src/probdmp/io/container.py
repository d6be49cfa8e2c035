"""A text and named arrays in one safetensors file, byte for byte.

    8 bytes       length of the header, little-endian
    header        {"__metadata__": {"probdmp": text}, name: {"dtype", "shape", "data_offsets"}, …}, padded with spaces to 8
    tensors       float64, little-endian, back to back in the header's order

The library writes; reading is done here, since its reader gives no metadata for bytes in memory and takes any header that
means the same. This one takes a single spelling. Source: https://github.com/huggingface/safetensors#format
"""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from probdmp.checks import FloatArray
from probdmp.errors import InputError, ModelFileError
from probdmp.io.canonical_json import dump_json, parse_json

__all__ = ["LARGEST_HEADER", "LARGEST_MODEL", "Container", "damaged", "pack", "unpack"]

LARGEST_MODEL = 200_000_000
"""Bytes of a file."""
LARGEST_HEADER = 4_000_000
"""Bytes."""
MOST_AXES = 3
KEY = "probdmp"


class Container(NamedTuple):
    """What a file holds."""

    text: str
    tensors: dict[str, FloatArray]


def pack(text: str, tensors: Mapping[str, FloatArray]) -> bytes:
    """The bytes of a file.

    Parameters
    ----------
    text : ASCII.
    tensors : arrays by ASCII name.

    Raises
    ------
    InputError
        If `unpack` would refuse the result as too large.
    """
    from safetensors.numpy import save

    payload: bytes = save(dict(tensors), metadata={KEY: text})
    header_size = int.from_bytes(payload[:8], "little")
    if header_size > LARGEST_HEADER or len(payload) > LARGEST_MODEL:
        raise InputError(
            f"a model of at most {LARGEST_MODEL} bytes with at most {LARGEST_HEADER} bytes of metadata",
            f"{len(payload)} and {header_size}",
            "Save it as several models.",
        )
    return payload


def unpack(payload: bytes, name: str) -> Container:
    """The text and the arrays, which share the bytes of the payload.

    Parameters
    ----------
    name : of the file, for messages.

    Raises
    ------
    ModelFileError
        If the header differs in any byte from the one `pack` would write for what it says, or bytes are missing or left over.
    """
    size = int.from_bytes(payload[:8], "little")
    if len(payload) < 8 or size > min(LARGEST_HEADER, len(payload) - 8):
        raise damaged(name, f"a header of at most {LARGEST_HEADER} bytes", f"{size} bytes in a file of {len(payload)}")
    start = 8 + size
    try:
        padded = payload[8:start].decode("ascii")
        header = parse_json(padded.rstrip(" "), sort_keys=False)
    except ValueError as error:
        raise damaged(name, "a JSON header", str(error)) from error
    metadata = header.pop("__metadata__", None) if isinstance(header, dict) else None
    if not isinstance(metadata, dict) or metadata.keys() != {KEY} or not isinstance(metadata[KEY], str):
        raise damaged(name, "metadata of probdmp in the header", "none")
    if len(padded) % 8 != 0 or padded.endswith(" " * 8):
        raise damaged(name, "a header padded to a multiple of 8 bytes", f"{len(padded)} bytes")
    tensors: dict[str, FloatArray] = {}
    data, position = memoryview(payload)[start:], 0
    for key, entry in header.items():
        tensors[key] = _tensor(data, position, entry, f"tensor {key!r:.100} of {name}")
        position += tensors[key].nbytes
    if position != len(data):
        raise damaged(name, f"{position} bytes of tensors", f"{len(data)} bytes")
    return Container(metadata[KEY], tensors)


def damaged(place: str, expected: str, got: str) -> ModelFileError:
    """The error for a file that is not what was written."""
    hint = "It is damaged, edited or not a model of probdmp: copy it again, or save the model again."
    return ModelFileError(f"{expected} in {place}", f"{got:.200}", hint)


def _tensor(data: memoryview, position: int, entry: Any, place: str) -> FloatArray:
    shape = entry.get("shape") if isinstance(entry, dict) else None
    if not isinstance(shape, list) or len(shape) > MOST_AXES or not all(type(n) is int and 0 < n <= len(data) for n in shape):
        raise damaged(place, f"a shape of at most {MOST_AXES} axes", repr(shape))
    count = math.prod(shape)
    expected = {"dtype": "F64", "shape": shape, "data_offsets": [position, position + 8 * count]}
    # Compared as text: 8.0 and 8 are equal, and no spelling but one is taken.
    if dump_json(entry, sort_keys=False) != dump_json(expected, sort_keys=False):
        raise damaged(place, dump_json(expected), dump_json(entry))
    if position + 8 * count > len(data):
        raise damaged(place, f"{8 * count} bytes", f"{len(data) - position}")
    return np.frombuffer(data, "<f8", count, position).reshape(shape)
