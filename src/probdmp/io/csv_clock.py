"""What is made of the times in a CSV file: `constant_rate` of them, with lines named in messages."""

from collections.abc import Sequence

from probdmp.checks import FloatArray
from probdmp.demonstrations.demonstration import SHORTEST_RECORDING
from probdmp.errors import DataFileError, InputError
from probdmp.io.constant_rate import TimedTable, at_constant_rate, check_times
from probdmp.io.csv_header import Header
from probdmp.io.csv_table import Block

__all__ = ["constant_rate"]

UNIT_HINT = "Say the unit in the header, such as time [ms], or time [s] if it is seconds."
ORDER_HINT = "Sort the rows and drop repeated ones. Another demonstration? Number them in a column demonstration."


def constant_rate(header: Header, blocks: Sequence[Block], dt: float | None, name: str) -> tuple[float, list[FloatArray]]:
    """Seconds between samples, and the tables (T, C) of the demonstrations without their times.

    Parameters
    ----------
    dt : seconds between samples: those of the rows in a file without times, those wanted in one with times.

    Raises
    ------
    DataFileError, InputError
        If a demonstration is too short or too long, times do not increase, or there are neither times nor a dt.
    """
    for block in blocks:
        _check_rows(block, name)
    if header.time is None:
        if dt is None:
            hint = "Say how far apart the samples are: dt=0.01 for 100 Hz, --dt 0.01 on the command line."
            raise InputError(f"a column named time or t in {name}, or dt", "neither", hint)
        return dt, [block.table for block in blocks]
    timed = [_timed(block, header, name) for block in blocks]
    return at_constant_rate(timed, dt, name, "" if header.time_unit else UNIT_HINT)


def _check_rows(block: Block, name: str) -> None:
    if len(block.lines) < SHORTEST_RECORDING:
        rows = f"{len(block.lines)} on {_span(block)}"
        hint = "Does every row begin another demonstration? Then leave that column out."
        raise DataFileError(f"at least {SHORTEST_RECORDING} rows per demonstration in {name}", rows, hint)


def _timed(block: Block, header: Header, name: str) -> TimedTable:
    times = block.table[:, 0]
    check_times(times, name, lambda i: f"on line {block.lines[i]}", ORDER_HINT)
    return TimedTable(times / header.per_second, block.table[:, 1:], f"on {_span(block)}")


def _span(block: Block) -> str:
    return f"lines {block.lines[0]} to {block.lines[-1]}"
