"""`probdmp studio`: the web app."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from probdmp.cli.options import Json
from probdmp.cli.output import print_json, print_line

__all__ = ["studio"]


def studio(
    files: Annotated[
        list[Path] | None,
        typer.Argument(metavar="[FILES]", help="Demonstrations and models that are there when the page opens."),
    ] = None,
    host: Annotated[str, typer.Option(metavar="ADDRESS", help="Where to listen; beyond this machine a token is needed.")] = (
        "127.0.0.1"
    ),
    port: Annotated[int, typer.Option(metavar="N", min=0, max=65535, help="0: any that is free.")] = 0,
    token: Annotated[
        str | None, typer.Option(metavar="TEXT", help="What the page has to bring. Default: random, beyond this machine.")
    ] = None,
    no_browser: Annotated[bool, typer.Option("--no-browser", help="Do not open the page, only say where it is.")] = False,
    as_json: Json = False,
) -> None:
    """Teach, execute and disturb movements in the browser.

    Draw a letter a few times and see what is learned; play it, hold the pen, and see what is noticed, when and why. In JSON:
    the address of the page, once it is there.

    Everything runs on this machine; nothing is sent elsewhere. Ctrl-C ends it. Needs the extra: pip install 'probdmp[studio]'.
    """
    from probdmp.studio import StudioOptions, serve

    options = StudioOptions(host, port, token, not no_browser, tuple(files or ()))

    def announce(address: str) -> None:
        if as_json:
            print_json({"address": address})
        else:
            print_line(f"The studio is at {address} – Ctrl-C ends it.")
        sys.stdout.flush()

    serve(options, announce)
