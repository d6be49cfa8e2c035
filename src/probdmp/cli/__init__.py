"""The command `probdmp`: one verb per module."""

import sys
from typing import Any

__all__ = ["app", "main"]

INTERRUPTED = 130


def main() -> None:
    """The entry point: run the program and exit; also where it is interrupted while it loads."""
    try:
        from probdmp.cli.program import main as run

        run()
    except KeyboardInterrupt:
        print("probdmp: interrupted", file=sys.stderr)
        raise SystemExit(INTERRUPTED) from None


def __getattr__(name: str) -> Any:
    if name == "app":
        from probdmp.cli.program import app

        return app
    raise AttributeError(f"module 'probdmp.cli' has no attribute {name!r}")
