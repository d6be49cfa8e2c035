"""What the documents say must be so."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
DOCUMENTS = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").rglob("*.md"))]


def code_blocks(path: Path) -> list[str]:
    return re.findall(r"^```python\n(.*?)^```", path.read_text(), flags=re.M | re.S)


def test_the_readme_has_code() -> None:
    assert code_blocks(ROOT / "README.md")


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: path.name)
def test_code_in_documents_runs(path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    namespace: dict[str, object] = {}
    for block in code_blocks(path):
        exec(compile(block, path.name, "exec"), namespace)


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: path.name)
def test_links_within_the_project_lead_somewhere(path: Path) -> None:
    targets = re.findall(r"\]\((?!https?:)([^)#]+)", path.read_text())
    missing = [target for target in targets if not (path.parent / target).exists()]
    assert not missing


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: path.name)
def test_functions_named_with_their_module_exist(path: Path) -> None:
    """Names such as `dmp/state_space.py` and `tests/paper/test_x.py::test_y` point at something."""
    text = path.read_text()
    for module in re.findall(r"`((?:src/probdmp/)?\w+/\w+\.py)`", text):
        assert any((base / module).exists() for base in (ROOT, ROOT / "src/probdmp", ROOT / "tests")), module
    for file, test in re.findall(r"`?((?:tests/)?[\w/]+\.py)::(test_\w+)", text):
        found = next((base / file for base in (ROOT, ROOT / "tests", ROOT / "tests/paper") if (base / file).exists()), None)
        assert found is not None, file
        assert f"def {test}(" in found.read_text(), f"{file}::{test}"
