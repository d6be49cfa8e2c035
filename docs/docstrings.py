"""The manner of this project's docstrings, for mkdocstrings: `name : what it is`, with the type in the signature alone.

NumPy's manner has the type behind the colon and the description below. An extension of griffe moves the text there before
it is parsed, so that the types come from the annotations. Prose under Returns is kept as prose.
"""

import re
from typing import Any

from griffe import Attribute, Class, Extension, Function, Module

ENTRIES = ("Parameters", "Attributes")


def in_numpy_manner(text: str) -> str:
    """A docstring as NumPy would write it, with asterisks that are no emphasis."""
    lines, section, converted = text.split("\n"), "", []
    for k, line in enumerate(lines):
        following = lines[k + 1] if k + 1 < len(lines) else ""
        if re.fullmatch(r"-{3,}", following):
            section = line
            if section == "Returns":
                converted.append("**Returns**\n")
                continue
        if section == "Returns" and re.fullmatch(r"-{3,}", line):
            continue
        entry = re.fullmatch(r"([\w*, ]+?) : (.*)", line) if section in ENTRIES else None
        converted += [entry[1], f"    {entry[2]}"] if entry else [line]
    return re.sub(r"(?<=[(, ])\*(?=[a-z])", r"\*", "\n".join(converted))


class OurManner(Extension):
    """Rewrites every docstring once it is loaded."""

    def on_instance(self, *, obj: Module | Class | Function | Attribute, **_: Any) -> None:
        if obj.docstring:
            obj.docstring.value = in_numpy_manner(obj.docstring.value)
