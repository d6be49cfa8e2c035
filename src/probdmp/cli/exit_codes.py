"""From exceptions to exit codes and to the one line that is shown."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from probdmp.cli import INTERRUPTED
from probdmp.errors import (
    DataFileError,
    InputError,
    InputTypeError,
    ModelFileError,
    ProbDMPError,
    TooFewDemonstrationsError,
)

__all__ = ["FAILURE_DETECTED", "UsageError", "exit_code", "message", "stop_writing", "usage"]

ERROR = 1
"""Also what anything unforeseen gives: no rights, no space, a missing extra, a bug."""
USAGE = 2
BAD_INPUT = 3
FAILURE_DETECTED = 4


class UsageError(ProbDMPError):
    """Options that are wrong by themselves, or that do not fit the model or the file."""


EXIT_CODES: dict[type[BaseException], int] = {
    UsageError: USAGE,
    TooFewDemonstrationsError: USAGE,
    DataFileError: BAD_INPUT,
    ModelFileError: BAD_INPUT,
    InputError: BAD_INPUT,
    InputTypeError: BAD_INPUT,
    KeyboardInterrupt: INTERRUPTED,
}


@contextmanager
def usage() -> Iterator[None]:
    """Around what depends on options alone: whatever the library refuses there, the user asked for."""
    try:
        yield
    except (InputError, InputTypeError) as error:
        raise UsageError(error.expected, error.got, error.hint) from error


def exit_code(error: BaseException) -> int:
    """The exit code of the program that an exception ends; errors of the command line's parser bring their own."""
    for kind, code in EXIT_CODES.items():
        if isinstance(error, kind):
            return code
    return int(getattr(error, "exit_code", ERROR))


def message(error: BaseException) -> str:
    """One line that says what was expected, what came and what to do."""
    if isinstance(error, ProbDMPError):
        text = str(error)
    elif isinstance(error, KeyboardInterrupt):
        text = "interrupted"
    elif isinstance(error, OSError):
        reason = (error.strerror or str(error)).lower()
        text = f"expected to read and write {error.filename!r}, got {reason}. Check the path, its rights and the disk."
    elif hasattr(error, "format_message"):  # of the parser, whose classes typer keeps to itself
        place = getattr(getattr(error, "ctx", None), "command_path", "probdmp")
        text = f"{error.format_message().rstrip('.')}. Try: {place} --help"
    else:
        text = f"internal error, {type(error).__name__}: {error}. Please report it with what probdmp --debug … shows."
    text = " ".join(text.split())
    return text[:1].lower() + text[1:]


def stop_writing() -> None:
    """After the reader has gone: let what is still buffered go nowhere, or Python complains about it at exit."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
