"""Every exception that probdmp raises on purpose.

    ProbDMPError
    ├── InputError (ValueError)          a value that cannot be used: shape, range, NaN, times
    │   ├── UnknownLabelError (KeyError)   no primitive has this label
    │   └── TooFewDemonstrationsError      an experiment asks for more than there are
    ├── InputTypeError (TypeError)       the wrong kind of thing: strings, objects, complex numbers
    ├── NotFittedError (AttributeError)  a model that has not been learned yet
    ├── DataFileError (ValueError)       a demonstration file that is damaged, hostile or not what it claims
    ├── ModelFileError (ValueError)      a model file that is damaged, hostile or not what it claims
    └── MissingExtraError (ImportError)  an optional dependency is not installed

Each says what was expected, what came, and what to do; the three parts are kept as attributes. And one warning,
`RecordingWarning` (UserWarning): a recording is used, but not as it stands in its file.
"""

from typing import Any

__all__ = [
    "DataFileError",
    "InputError",
    "InputTypeError",
    "MissingExtraError",
    "ModelFileError",
    "NotFittedError",
    "ProbDMPError",
    "RecordingWarning",
    "TooFewDemonstrationsError",
    "UnknownLabelError",
]


class ProbDMPError(Exception):
    """Base of all errors raised by probdmp.

    Parameters
    ----------
    expected : what would have been right, as a noun phrase: "dt > 0 in seconds".
    got : what came instead.
    hint : a sentence or two: what it probably means and what to do.
    """

    def __init__(self, expected: str, got: str, hint: str = "") -> None:
        super().__init__(f"Expected {expected}, got {got}." + (f" {hint}" if hint else ""))
        self.expected = expected
        self.got = got
        self.hint = hint

    def __str__(self) -> str:
        return str(self.args[0])

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.expected, self.got, self.hint)


class InputError(ProbDMPError, ValueError):
    """A value that cannot be used."""


class UnknownLabelError(InputError, KeyError):
    """No primitive has this label."""


class TooFewDemonstrationsError(InputError):
    """An experiment asks for more demonstrations than there are."""


class InputTypeError(ProbDMPError, TypeError):
    """The wrong kind of thing."""


class NotFittedError(ProbDMPError, AttributeError):
    """A model that has not been learned yet."""


class DataFileError(ProbDMPError, ValueError):
    """A demonstration file that cannot be trusted or understood."""


class ModelFileError(ProbDMPError, ValueError):
    """A model file that cannot be trusted or understood."""


class MissingExtraError(ProbDMPError, ImportError):
    """An optional dependency is not installed."""


class RecordingWarning(UserWarning):
    """A recording is used, but not as it stands in its file: resampled, or with rows put in."""
