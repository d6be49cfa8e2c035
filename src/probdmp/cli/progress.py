"""A progress bar on standard error, where somebody watches."""

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

__all__ = ["progress"]


@contextmanager
def progress(what: str, total: int | None) -> Iterator[Callable[..., None]]:
    """A bar with the time left while the block runs; silent when standard error is not a terminal.

    Parameters
    ----------
    total : parts; None where the work itself will say how many.

    Yields
    ------
    A function to call after each part, with a name and, where `total` does not say, the number of all parts.
    """
    if not sys.stderr.isatty():
        yield lambda name, total=None: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(bar_width=24),
        TextColumn("{task.fields[parts]}", markup=False),
        TimeElapsedColumn(),
        TextColumn("elapsed,", markup=False),
        TimeRemainingColumn(),
        TextColumn("left", markup=False),
    )
    console = Console(stderr=True, color_system=None if os.environ.get("NO_COLOR") else "auto")
    with Progress(*columns, console=console, transient=True) as bars:
        bar = bars.add_task(what, total=total, parts="" if total is None else f"0/{total}")

        def done(name: str, n_parts: int | None = None) -> None:
            known = n_parts or total
            bars.update(bar, advance=1, total=known)
            bars.update(bar, parts=f"{bars.tasks[bar].completed:.0f}/{known}")

        yield done
