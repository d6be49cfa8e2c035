"""docs/paper.md names every test of this folder, and nothing else: whoever reads the one finds the other."""

import ast
import re
from pathlib import Path

FOLDER = Path(__file__).parent
DOCUMENT = FOLDER.parent.parent / "docs" / "paper.md"


def test_every_test_of_the_paper_is_in_its_document():
    """Read the other way in tests/test_docs.py: every test that the document names exists."""
    written = {
        f"{path.name}::{node.name}"
        for path in FOLDER.glob("test_*.py")
        for node in ast.parse(path.read_text()).body
        if isinstance(node, ast.FunctionDef) and node.name.startswith("test_")
    }
    named = set(re.findall(r"(test_\w+\.py::test_\w+)", DOCUMENT.read_text()))
    assert named == written
