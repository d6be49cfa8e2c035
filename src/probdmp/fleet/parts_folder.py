"""Scores on their way: a hidden folder beside the output, with a file for each part that is done.

A run that was killed finds it and goes on. It holds a list of what belongs to it, by which another model, other executions or
another layout of scores are told, and is locked by the run that writes to it. POSIX.
"""

import fcntl
import json
import os
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from probdmp.errors import InputError
from probdmp.io import write_atomically

__all__ = ["PartsFolder", "is_begun"]

MANIFEST = "run.json"


def is_begun(output: Path) -> bool:
    """Whether a run has begun to write an output and has not ended."""
    return (_folder_of(output) / MANIFEST).exists()


def _folder_of(output: Path) -> Path:
    return output.with_name(f".{output.name}.parts")


class PartsFolder:
    """The folder of an output, made if there is none, and locked until it is closed.

    Parameters
    ----------
    identity : what scores depend on, plain values.
    samples : of a part, if there is no run to go on with.
    restart : whether to begin anew whatever is there.

    Raises
    ------
    InputError
        If it belongs to a run with other inputs, or another run is at it.
    """

    def __init__(self, output: Path, identity: dict[str, Any], samples: int, restart: bool) -> None:
        self.path = _folder_of(output)
        self.path.mkdir(exist_ok=True)
        self._lock = os.open(self.path, os.O_RDONLY | os.O_DIRECTORY)
        try:
            self._take(output)
            if restart:
                self._clear()
            self.samples = self._resumed(identity, samples)
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Let another run have it."""
        os.close(self._lock)

    def done(self) -> set[int]:
        """Indices of the parts that are done."""
        return {int(path.stem) for path in self.path.glob("[0-9]*.parquet")}

    def put(self, index: int, payload: bytes) -> None:
        """Keep the scores of a part."""
        write_atomically(self._part(index), payload)

    def tables(self, n_parts: int) -> Iterator[Any]:
        """Scores of all parts in order, as Arrow tables."""
        import pyarrow.parquet as pq

        for index in range(n_parts):
            yield pq.read_table(self._part(index))

    def remove(self) -> None:
        """When all is in the output."""
        shutil.rmtree(self.path)

    def _part(self, index: int) -> Path:
        return self.path / f"{index:06d}.parquet"

    def _take(self, output: Path) -> None:
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise InputError(f"one run that writes {output}", "another that is at it", "Wait for it, or end it.") from error

    def _clear(self) -> None:
        for path in self.path.iterdir():
            path.unlink()

    def _resumed(self, identity: dict[str, Any], samples: int) -> int:
        """Samples of a part, as the run began that this one goes on with, if there is one."""
        manifest = self.path / MANIFEST
        if manifest.exists():
            begun = json.loads(manifest.read_text())
            changed = [name for name, value in identity.items() if begun.get(name) != value]
            if changed:
                hint = "Use --restart (restart=True) to begin anew."
                expected = f"the {' and '.join(changed)} that {self.path} was begun with"
                raise InputError(expected, "another", hint)
            return int(begun["samples"])
        self._clear()
        write_atomically(manifest, json.dumps(identity | {"samples": samples}).encode())
        return samples
