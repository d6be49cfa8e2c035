"""How long it takes until there is something to use."""

import subprocess
import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from speed.interleaving import clocked, interleaved
from speed.rows import Row, Settings, at_most, duration_text

__all__ = ["startup_rows"]

IMPORTS = {
    "numpy": "import numpy",
    "probdmp": "import probdmp",
    "class": "from probdmp import ProbabilisticDMP",
}


def startup_rows(settings: Settings) -> Iterator[Row]:
    """Processes of their own, with warm disk caches."""
    commands = {name: [sys.executable, "-c", statement] for name, statement in IMPORTS.items()}
    program = Path(sys.executable).with_name("probdmp")
    commands["help"] = [str(program), "--help"]
    contestants = {
        name: clocked(partial(subprocess.run, command, check=True, stdout=subprocess.DEVNULL))
        for name, command in commands.items()
    }
    times = interleaved(contestants, settings.rounds)
    numpy = f"`import numpy` alone {duration_text(times.typical('numpy'))} with the interpreter"
    for name in ("probdmp", "class"):
        more = times.typical(name) - times.typical("numpy")
        title = f"`{IMPORTS[name]}` over `import numpy`"
        lazily = "; loads nothing, not even NumPy, before a name is used" if name == "probdmp" and more < 0 else ""
        yield at_most(title, more, 0.06, f"{more * 1e3:+.0f} ms", "+60 ms", numpy + lazily)
    took = times.typical("help")
    yield at_most("`probdmp --help`", took, 0.3, duration_text(took), "0.3 s")
