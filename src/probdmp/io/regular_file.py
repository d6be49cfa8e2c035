"""Opening a file that a stranger may have put there."""

import os
import stat
from typing import BinaryIO

from probdmp.errors import DataFileError, ModelFileError

__all__ = ["open_regular"]


def open_regular(
    path: str | os.PathLike[str], largest: int, error: type[DataFileError] | type[ModelFileError], follow_links: bool
) -> BinaryIO:
    """Open a regular file for reading; never wait for a pipe, never touch a device.

    Parameters
    ----------
    largest : bytes, the size beyond which the file is refused unread.
    error : what to raise.
    follow_links : whether a symbolic link may lead to the file.

    Raises
    ------
    DataFileError or ModelFileError
        If there is no such file, it cannot be opened, is not a regular file, or is too large.
    """
    expected = f"a readable file at {os.fspath(path)!r}"
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | (0 if follow_links else os.O_NOFOLLOW))
    except (OSError, ValueError) as cause:
        if not follow_links and os.path.islink(path):
            raise error(expected, "a symbolic link", "Give the path of the file itself.") from cause
        raise error(expected, getattr(cause, "strerror", str(cause)).lower(), "Check the path and its rights.") from cause
    status = os.fstat(descriptor)
    if stat.S_ISREG(status.st_mode) and status.st_size <= largest:
        return os.fdopen(descriptor, "rb")
    os.close(descriptor)
    if stat.S_ISDIR(status.st_mode):
        raise error(expected, "a directory", "Give the path of a file in it.")
    if not stat.S_ISREG(status.st_mode):
        raise error(expected, "a pipe, socket or device", "Copy its content to a file first.")
    raise error(f"{expected} of at most {largest} bytes", f"{status.st_size} bytes", "Split what it holds over several files.")
