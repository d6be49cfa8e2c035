"""The program `probdmp`, run in this process."""

import functools
from collections.abc import Sequence

import typer.testing
from typer.testing import CliRunner, Result

from probdmp.cli import app

# Verbs are built once, not for every run: 20 ms, half of what most of these tests take.
typer.testing._get_command = functools.cache(typer.testing._get_command)  # type: ignore[attr-defined]


def run_program(arguments: Sequence[str], text: str | None = None, env: dict[str, str] | None = None) -> Result:
    """What comes of a command without the word `probdmp`: exit_code, stdout, stderr; `text` is its standard input."""
    return CliRunner(env=env).invoke(app, arguments, input=text, prog_name="probdmp")
