"""What the documents say must be so."""

import re
import shlex
from glob import glob
from pathlib import Path

import pytest
from program import run_program

ROOT = Path(__file__).parent.parent
DOCUMENTS = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").rglob("*.md"))]


def name_of(path: Path) -> str:
    return str(path.relative_to(ROOT))


def code_blocks(path: Path) -> list[tuple[str, str]]:
    """Language and text of each block, in the order of the page; commands are shown without a language or as sh."""
    blocks = re.findall(r"^```(\w*)\n(.*?)^```$", path.read_text(), flags=re.M | re.S)
    return [(language, text) for language, text in blocks if language in ("python", "sh", "")]


def run_command(line: str) -> None:
    """A line of shell: a command of probdmp, perhaps with a file as its input and a comment; other commands are not run."""
    words = shlex.split(line, comments=True)
    if not words or words[0] != "probdmp" or any(word.isupper() for word in words):
        return
    given = Path(words[words.index("<") + 1]).read_text() if "<" in words else None
    arguments = words[1 : words.index("<")] if "<" in words else words[1:]
    # As a shell does: names for a pattern, or the word as it is.
    arguments = [name for word in arguments for name in (sorted(glob(word)) if "*" in word else []) or [word]]
    result = run_program(arguments, given)
    # 4: monitor has found a failure.
    assert result.exit_code in ((0, 4) if arguments[0] == "monitor" else (0,)), f"{line}: {result.stderr}"


def test_the_readme_has_code() -> None:
    assert {language for language, _ in code_blocks(ROOT / "README.md")} >= {"python", ""}


@pytest.mark.usefixtures("sketched_or_rendered")
@pytest.mark.parametrize("path", DOCUMENTS, ids=name_of)
def test_code_in_documents_runs(path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Blocks of a page run one after the other, in one folder and one namespace."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "Agg")
    namespace: dict[str, object] = {}
    for language, block in code_blocks(path):
        if language == "python":
            exec(compile(block, path.name, "exec"), namespace)
        else:
            for line in block.splitlines():
                run_command(line)


def test_every_document_is_in_the_site_and_every_picture_in_a_document() -> None:
    listed = set(re.findall(r"[\w/-]+\.md", (ROOT / "mkdocs.yml").read_text()))
    assert listed == {str(path.relative_to(ROOT / "docs")) for path in (ROOT / "docs").rglob("*.md")}
    shown = {
        (path.parent / target).resolve()
        for path in DOCUMENTS
        for target in re.findall(r"!\[[^\]]*\]\(([^)]+)\)", path.read_text())
    }
    assert shown == {path.resolve() for path in (ROOT / "docs/images").iterdir()}


def test_every_picture_is_made_by_a_command() -> None:
    """By `make figures`, `make n-basis`, `make bench` or `make bench-studio`; those of the gallery by `make gallery`."""
    scripts = ("docs/figures.py", "docs/n_basis.py", "benchmarks/speed_tables.py", "benchmarks/studio.py")
    makers = "".join((ROOT / name).read_text() for name in scripts)
    assert all(f'"{path.stem}' in makers or f"{path.stem}.png" in makers for path in (ROOT / "docs/images").iterdir())


@pytest.mark.parametrize("path", DOCUMENTS, ids=name_of)
def test_links_within_the_project_lead_somewhere(path: Path) -> None:
    targets = re.findall(r"\]\((?!https?:)([^)#]+)", path.read_text())
    missing = [target for target in targets if not (path.parent / target).exists()]
    assert not missing


@pytest.mark.parametrize("path", DOCUMENTS, ids=name_of)
def test_functions_named_with_their_module_exist(path: Path) -> None:
    """Names such as `dmp/state_space.py` and `tests/paper/test_x.py::test_y` point at something."""
    text = path.read_text()
    for module in re.findall(r"`((?:src/probdmp/)?\w+/\w+\.py)`", text):
        assert any((base / module).exists() for base in (ROOT, ROOT / "src/probdmp", ROOT / "tests")), module
    for file, test in re.findall(r"`?((?:tests/)?[\w/]+\.py)::(test_\w+)", text):
        found = next((base / file for base in (ROOT, ROOT / "tests", ROOT / "tests/paper") if (base / file).exists()), None)
        assert found is not None, file
        assert f"def {test}(" in found.read_text(), f"{file}::{test}"
