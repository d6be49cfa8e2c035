"""Replacing a file so that whoever looks, whenever the power fails, finds the old file or the new one, whole.

The data reaches the disk before the name does, and the directory that holds the name afterwards. A process that is killed
meanwhile may leave its temporary file, `.<random>.tmp`. POSIX.
"""

import os
import secrets
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from probdmp.errors import InputError

__all__ = ["replacing", "write_atomically"]


def write_atomically(path: str | os.PathLike[str], payload: bytes) -> None:
    """Write or replace a file; an existing one passes its permissions on, a symbolic link is replaced, not followed.

    Raises
    ------
    InputError
        If something other than a regular file is in the way, such as a directory or a device.
    OSError
        If the disk refuses: no such directory, no rights, no space. Then nothing has changed.
    """
    with replacing(path) as file:
        file.write(payload)


@contextmanager
def replacing(path: str | os.PathLike[str]) -> Iterator[BinaryIO]:
    """A file to write piece by piece, which takes the place of another when all has been written; errors as above."""
    target = Path(path)
    mode = _mode(target)
    temporary = target.with_name(f".{secrets.token_hex(8)}.tmp")
    descriptor = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666)
    try:
        with os.fdopen(descriptor, "wb") as file:
            if mode is not None:
                os.fchmod(descriptor, mode)
            yield file
            file.flush()
            os.fsync(descriptor)
        os.replace(temporary, target)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise
    directory = os.open(target.parent, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(directory)
    finally:
        os.close(directory)


def _mode(target: Path) -> int | None:
    """Permissions of the file to be replaced; None for a new one, which gets what the umask leaves."""
    try:
        mode = target.stat().st_mode
    except FileNotFoundError:
        return None
    if not stat.S_ISREG(mode):
        raise InputError("the path of a file to write", f"{str(target)!r}, which is not a regular file", "Choose another name.")
    return stat.S_IMODE(mode)
