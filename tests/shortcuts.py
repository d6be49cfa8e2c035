"""What makes a test of a whole page or program quick: recordings sampled less often, pictures drawn but not rendered.

Tests that take these in the default run do without them with `-m slow`.
"""

import functools
import hashlib
import importlib
import inspect
from pathlib import Path

import numpy as np

COARSE = 0.03
"""Seconds between samples of built-in movements, which are 0.01 s apart unless told."""
GENERATORS = ("synthetic_letters", "written_letters", "synthetic_contacts", "synthetic_arm_movements")


def sample_less_often(monkeypatch):
    """Built-in movements that are asked for without a `dt` come with that of `COARSE`."""
    for name in GENERATORS:
        for module in map(importlib.import_module, ("probdmp", "probdmp.demonstrations")):
            if name in module.__all__:
                monkeypatch.setattr(module, name, _coarse(getattr(module, name)))


def _coarse(generate):
    @functools.wraps(generate)
    def coarse(*arguments, **named):
        bound = inspect.signature(generate).bind(*arguments, **named)
        bound.arguments.setdefault("dt", COARSE)
        return generate(*bound.args, **bound.kwargs)

    return coarse


def sketch_pictures(monkeypatch):
    """Axes are filled as ever, but a file says only what their lines are, not how they look: most of the time of a page."""
    monkeypatch.setattr("matplotlib.figure.Figure.savefig", _sketch)


def _sketch(figure, file, **options):
    digest = hashlib.sha256()
    for ax in figure.axes:
        digest.update("".join([ax.get_title(loc="left"), ax.get_xlabel(), ax.get_ylabel()]).encode())
        for line in ax.lines:
            digest.update(np.asarray(line.get_xydata(), dtype=np.float64).tobytes())
    svg = f"<?xml version='1.0'?>\n<svg><title>{digest.hexdigest()}</title></svg>".encode()
    if isinstance(file, str | Path):
        Path(file).write_bytes(svg)
    else:
        file.write(svg)
