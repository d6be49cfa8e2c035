"""The house: import direction, sizes, documentation."""

import ast
import importlib
from pathlib import Path
from statistics import median

import pytest

import probdmp

ROOT = Path(probdmp.__file__).parent
LAYERS = (
    *(
        "loading",
        "errors",
        "checks",
        "parameters",
        "kept",
        "gaussian",
        "demonstrations",
        "dmp",
        "io",
        "learning",
        "execution",
        "detection",
    ),
    *("evaluation", "estimator", "plotting", "fleet", "studio", "cli"),
)
"""From the bottom up: a module imports only from names before its own."""

MODULES = sorted(ROOT.rglob("*.py"))


def layer_of(path: Path) -> str:
    return path.relative_to(ROOT).with_suffix("").parts[0]


def probdmp_imports(path: Path) -> set[str]:
    """Layers that a module imports from, anywhere in it."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        names = []
        if isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative imports hide where a name comes from"
            names = [f"{node.module}.{alias.name}" if node.module == "probdmp" else str(node.module) for alias in node.names]
        elif isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        found |= {name.split(".")[1] for name in names if name.startswith("probdmp.")}
    return found


def test_every_module_is_in_a_known_layer() -> None:
    assert {layer_of(path) for path in MODULES} - {"__init__", "__main__"} == set(LAYERS)


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(ROOT)))
def test_imports_point_downward(path: Path) -> None:
    if layer_of(path) in ("__init__", "__main__"):
        return
    rank = LAYERS.index(layer_of(path))
    upward = {name for name in probdmp_imports(path) - {layer_of(path), "__version__"} if LAYERS.index(name) >= rank}
    assert not upward


def test_only_the_command_line_and_the_studio_import_the_estimator() -> None:
    assert {layer_of(p) for p in MODULES if "estimator" in probdmp_imports(p)} <= {"__init__", "estimator", "studio", "cli"}


@pytest.mark.parametrize("package", ["demonstrations", "estimator", "learning"])
def test_names_that_are_loaded_when_used_are_all_there_and_not_those_of_modules(package: str) -> None:
    module = importlib.import_module(f"probdmp.{package}")
    assert all(getattr(module, name) is not None for name in module.__all__)
    assert not set(module.__all__) & {path.stem for path in (ROOT / package).glob("*.py")}


def test_modules_are_small() -> None:
    lines = {path: len(path.read_text().splitlines()) for path in MODULES}
    assert median(lines.values()) <= 100
    assert max(lines.values()) <= 350, max(lines, key=lines.__getitem__)


def test_the_routes_of_the_studio_are_short() -> None:
    assert len((ROOT / "studio" / "routes.py").read_text().splitlines()) <= 150


def test_the_studio_computes_nothing_itself() -> None:
    """Numbers are the library's: of NumPy it takes what packs and seeds arrays."""
    allowed = {"array", "asarray", "stack", "concatenate", "column_stack", "empty", "isnan", "sqrt", "clip"}
    allowed |= {"nan", "float64", "random", "ndarray"}
    for path in (ROOT / "studio").glob("*.py"):
        nodes = [node for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.Attribute)]
        used = {node.attr for node in nodes if isinstance(node.value, ast.Name) and node.value.id == "np"}
        assert used <= allowed, f"{path.name}: {used - allowed}"


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(ROOT)))
def test_everything_public_is_documented(path: Path) -> None:
    tree = ast.parse(path.read_text())
    assert ast.get_docstring(tree), "module"
    for node in tree.body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("_"):
            assert ast.get_docstring(node), node.name


def test_no_module_is_named_for_nothing() -> None:
    assert not {path.stem for path in MODULES} & {"utils", "util", "helpers", "misc", "core", "common", "tools"}
