"""What reaches standard output: one JSON document, or lines and tables for people."""

import json
import os
import sys
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.console import Console

__all__ = ["json_line", "print_json", "print_line", "print_table", "printable"]

PIPE_WIDTH = 160
"""Columns where there is no terminal to ask: wide enough for tables not to be squeezed."""

NUMBER_STARTS = "0123456789-+−±–"
"""With one of these begins what is a number, or stands for one that is not there."""


def json_line(document: Any) -> str:
    """JSON on one line, with its end."""
    from probdmp.io.plain_values import plain

    return json.dumps(plain(document), allow_nan=False) + "\n"


def print_json(document: Any) -> None:
    """The one document of `--json`."""
    sys.stdout.write(json_line(document))


def print_line(text: str = "", style: str = "") -> None:
    """A line; a terminal that is too narrow gets it in several."""
    _console().print(printable(text), style=style or None, soft_wrap=not sys.stdout.isatty())


def print_table(columns: Sequence[str], rows: Iterable[Sequence[str]], title: str = "", second_lines: str = "") -> None:
    """A table: numbers to the right, the first column and other texts to the left.

    Parameters
    ----------
    columns : headings; without any, the table has none.
    rows : one text per column.
    second_lines : style of all but the first line of a cell.
    """
    from rich import box
    from rich.table import Table
    from rich.text import Text

    table = Table(
        title=Text(printable(title)) if title else None,
        title_justify="left",
        box=box.SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
        pad_edge=False,
        title_style="bold",
        show_header=any(columns),
    )
    cells = [[printable(cell) for cell in row] for row in rows]
    for i, column in enumerate(columns):
        numbers = i > 0 and all(row[i][:1] in NUMBER_STARTS for row in cells)
        table.add_column(Text(printable(column)), justify="right" if numbers else "left", vertical="top")
    for row in cells:
        heads_and_rests = [cell.partition("\n") for cell in row]
        table.add_row(*(Text.assemble(head, (line_end + rest, second_lines)) for head, line_end, rest in heads_and_rests))
    _console().print(table)


def printable(text: str) -> str:
    """Text from a file without what could steer a terminal."""
    return "".join(character if character.isprintable() or character == "\n" else "�" for character in text)


def _console() -> "Console":
    from rich.console import Console

    known = sys.stdout.isatty() or "COLUMNS" in os.environ
    return Console(
        highlight=False,
        markup=False,
        emoji=False,
        color_system=None if os.environ.get("NO_COLOR") else "auto",
        width=None if known else PIPE_WIDTH,
    )
