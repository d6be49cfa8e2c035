"""The manner of this project's docstrings, for mkdocstrings: `name : what it is`, with the type in the signature alone.

NumPy's manner has the type behind the colon and the description below. An extension of griffe moves the text there before
it is parsed, so that the types come from the annotations.
"""

import re
from typing import Any

from griffe import Attribute, Class, Extension, Function, Module

MOVED = ("Parameters", "Attributes", "Returns")
UNDERLINE = re.compile(r"-{3,}")


def in_numpy_manner(text: str) -> str:
    """A docstring as NumPy would write it, with asterisks that are no emphasis."""
    lines, section, converted = text.split("\n"), "", []
    for k, line in enumerate(lines):
        following = lines[k + 1] if k + 1 < len(lines) else ""
        if UNDERLINE.fullmatch(following):
            section = line
        if UNDERLINE.fullmatch(line) or UNDERLINE.fullmatch(following) or section not in MOVED:
            converted.append(line)
        elif section == "Returns":
            first = UNDERLINE.fullmatch(lines[k - 1])
            converted += ([":"] if first else []) + ([f"    {line}"] if line else [""])
        else:
            entry = re.fullmatch(r"([\w*, ]+?) : (.*)", line)
            converted += [entry[1], f"    {entry[2]}"] if entry else [line]
    return re.sub(r"(?<=[(, ])\*(?=[a-z])", r"\*", "\n".join(converted))


class OurManner(Extension):
    """Rewrites every docstring once it is loaded."""

    def on_instance(self, *, obj: Module | Class | Function | Attribute, **_: Any) -> None:
        if obj.docstring:
            obj.docstring.value = in_numpy_manner(obj.docstring.value)
