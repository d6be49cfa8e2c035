"""The program: its verbs, what they share, and where every error ends."""

import atexit
import gc
import io
import re
import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from inspect import cleandoc
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from probdmp import __version__
from probdmp.cli.convert import convert
from probdmp.cli.demo import demo
from probdmp.cli.evaluate import evaluate
from probdmp.cli.exit_codes import exit_code, message, stop_writing
from probdmp.cli.fit import fit
from probdmp.cli.inspect import inspect
from probdmp.cli.monitor import monitor
from probdmp.cli.perturb import perturb
from probdmp.cli.plot import plot
from probdmp.cli.report import report
from probdmp.cli.rollout import rollout
from probdmp.cli.score import score
from probdmp.cli.smooth import smooth
from probdmp.cli.studio import studio
from probdmp.cli.track import track
from probdmp.cli.verb import Verb

__all__ = ["app", "main"]

VERBS = (demo, fit, inspect, rollout, track, smooth, monitor, score, evaluate, plot, report, perturb, convert, studio)

EPILOG = (
    "Exit codes: 0 fine, 1 error, 2 usage, 3 bad input data or model file, 4 a failure was detected (monitor), 130 interrupted."
)

HELP = {"-h", "--help"}


class Program(TyperGroup):
    """The verbs as one command, whose errors are one line and an exit code."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Read what stands before the verb; its help is shown unread, since what checks values takes long to load."""
        with _errors_ended() if args else nullcontext():
            if args and args[0] in self.commands and not HELP.isdisjoint(args):
                verb = self.commands[args[0]]
                print(verb.get_help(verb.context_class(verb, info_name=args[0], parent=ctx)))
                raise typer.Exit
            return super().parse_args(ctx, args)

    def invoke(self, ctx: Any) -> Any:
        """Run a verb."""
        with _errors_ended(ctx.params["debug"]):
            try:
                return super().invoke(ctx)
            finally:
                sys.stdout.flush()  # so that a closed pipe shows here


@contextmanager
def _errors_ended(debug: bool = False) -> Iterator[None]:
    """Turn whatever goes wrong into a line and an exit code."""
    try:
        yield
    except typer.Exit:
        raise
    except BrokenPipeError as error:
        stop_writing()
        raise typer.Exit(exit_code(error)) from error
    except (Exception, KeyboardInterrupt) as error:
        if debug:
            traceback.print_exception(error)
        print(f"probdmp: {message(error)}", file=sys.stderr)
        raise typer.Exit(exit_code(error)) from error


app = typer.Typer(
    cls=Program,
    no_args_is_help=True,
    rich_markup_mode=None,
    epilog=EPILOG,
    context_settings={"help_option_names": sorted(HELP)},
)


def _show_version(asked: bool) -> None:
    if asked:
        print(f"probdmp {__version__}")
        raise typer.Exit


@app.callback()
def options(
    debug: Annotated[bool, typer.Option("--debug", help="Show where an error comes from.")] = False,
    version: Annotated[
        bool, typer.Option("--version", help="Show the version and exit.", is_eager=True, callback=_show_version)
    ] = False,
) -> None:
    """Probabilistic Dynamic Movement Primitives: learn a movement, execute it with feedback, know when it goes wrong.

    Times are in seconds, positions in the units of the data. Every verb takes --json.
    """


def _paragraphs(docstring: str | None) -> str:
    """A docstring whose paragraphs are single lines, which typer wraps to the terminal."""
    return re.sub(r"(?<!\n)\n(?!\n)", " ", cleandoc(docstring or ""))


for verb in VERBS:
    app.command(cls=Verb, help=_paragraphs(verb.__doc__))(verb)


def main() -> None:
    """The entry point: run the program and exit."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")  # a terminal without ± shows a question mark
    atexit.register(gc.freeze)  # a process that ends need not look for cycles in what it leaves behind
    app(prog_name="probdmp")
