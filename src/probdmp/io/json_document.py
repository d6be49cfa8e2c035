"""JSON documents that a stranger may have written."""

import json
import os
from typing import Any

from probdmp.errors import DataFileError
from probdmp.io.regular_file import open_regular

__all__ = ["read_json"]

LARGEST_DOCUMENT = 50_000_000
"""Bytes."""


def read_json(path: str | os.PathLike[str]) -> Any:
    """The value in a JSON file; numbers are finite.

    Raises
    ------
    DataFileError
        If there is no such file, it is larger than 50 MB, or no JSON.
    """
    with open_regular(path, LARGEST_DOCUMENT, DataFileError, follow_links=True) as file:
        payload = file.read(LARGEST_DOCUMENT + 1)
    try:
        return json.loads(payload, parse_constant=_refuse)
    except (ValueError, RecursionError) as error:
        raise DataFileError(f"JSON in {os.fspath(path)!r}", f"something else ({error!s:.200})", "Was it cut off?") from error


def _refuse(constant: str) -> None:
    raise ValueError(f"{constant} is not JSON")
