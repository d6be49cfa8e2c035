"""The command `probdmp`: one verb per module."""

from probdmp.cli.program import app, main

__all__ = ["app", "main"]
