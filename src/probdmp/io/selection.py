"""What is wanted of a file of recordings."""

from collections.abc import Sequence
from dataclasses import dataclass

from probdmp.checks import check_seconds
from probdmp.errors import InputTypeError

__all__ = ["EVERYTHING", "Selection"]


@dataclass(frozen=True, slots=True)
class Selection:
    """Which demonstrations of a file, and how its columns are to be understood; None: as the file says.

    Raises
    ------
    InputError, InputTypeError
        If columns are no list of names, or dt is not a time.
    """

    label: str | None = None
    """Only the demonstrations with this label; those without any get it."""
    columns: Sequence[str] | None = None
    """Names of the columns that are positions, in the order wanted."""
    dt: float | None = None
    """Seconds between samples: needed if the file has no times, otherwise what to resample to."""
    topic: str | None = None
    """Which topic, of files that have topics."""

    def __post_init__(self) -> None:
        if isinstance(self.columns, str):
            hint = f"Write columns={self.columns.split(',')!r}."
            raise InputTypeError("columns as a list of names", repr(self.columns), hint)
        if self.columns is not None:
            object.__setattr__(self, "columns", tuple(self.columns))
        if self.dt is not None:
            object.__setattr__(self, "dt", check_seconds(self.dt, "dt"))


EVERYTHING = Selection()
"""All that there is."""
