"""What holds for every verb: help, exit codes, messages, what is written where. Some of it needs real processes."""

import ast
import json
import os
import pty
import re
import signal
import subprocess
import sys

import pytest
import typer

from probdmp import __version__, write_demonstrations
from probdmp.cli.exit_codes import UsageError, exit_code, message
from probdmp.cli.output import json_line, printable
from probdmp.cli.program import VERBS
from probdmp.demonstrations import Demonstration
from probdmp.errors import DataFileError, InputError, MissingExtraError, ModelFileError
from probdmp.io.plain_values import plain

PROGRAM = (sys.executable, "-m", "probdmp")


def environment(**changes):
    kept = {k: v for k, v in os.environ.items() if k not in ("COLUMNS", "NO_COLOR", "FORCE_COLOR", "TTY_COMPATIBLE")}
    return {**kept, "TERM": "xterm-256color", **changes}


def in_terminal(arguments, **env):
    """What a process writes to a terminal that is its standard output and error."""
    leader, follower = pty.openpty()
    process = subprocess.Popen([*PROGRAM, *map(str, arguments)], stdout=follower, stderr=follower, env=environment(**env))
    os.close(follower)
    written = b""
    try:
        while chunk := os.read(leader, 65536):
            written += chunk
    except OSError:  # the other end is closed
        pass
    os.close(leader)
    assert process.wait() == 0
    return written.decode()


# Help


@pytest.mark.parametrize("verb", [verb.__name__ for verb in VERBS])
@pytest.mark.parametrize("option", ["--help", "-h"])
def test_every_verb_has_help(verb, option, run):
    result = run(verb, option)
    assert result.exit_code == 0
    assert "--json" in result.stdout
    assert result.stdout.startswith(f"Usage: probdmp {verb} ")


def test_first_lines_of_help_are_not_cut_off(run):
    shown = run("--help").stdout
    assert "..." not in shown.partition("Commands:")[2]
    for verb in VERBS:
        assert f"  {verb.__name__} " in shown
    for code in ("0 fine", "2 usage", "3 bad input", "4 a", "130 interrupted"):
        assert code in shown


@pytest.fixture(scope="module")
def loaded_by_help():
    """Modules that a process has loaded after the help of the program and, one after the other, of each verb."""
    code = f"""
import sys
from probdmp.cli import app
for verb in {[None, *(verb.__name__ for verb in VERBS)]}:
    try:
        app([*([verb] if verb else []), "--help"])
    except SystemExit as end:
        assert end.code == 0
    print([verb, sorted(sys.modules)], file=sys.stderr)
"""
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return dict(map(ast.literal_eval, result.stderr.splitlines()))


@pytest.mark.parametrize("verb", [None, *(verb.__name__ for verb in VERBS)])
def test_help_loads_nothing_heavy(verb, loaded_by_help):
    loaded = loaded_by_help[verb]
    assert "typer" in loaded
    for module in ("numpy", "scipy", "matplotlib", "rich", "asyncio", "pydantic", "probdmp.estimator", "probdmp.io"):
        assert module not in loaded


def test_arguments_are_shown_as_they_are_called(run):
    assert run("monitor", "--help").stdout.startswith("Usage: probdmp monitor [OPTIONS] MODEL EXECUTION…|-\n")
    assert run("convert", "--help").stdout.startswith("Usage: probdmp convert [OPTIONS] IN… OUT\n")
    shown = run("inspect", "--help").stdout
    assert shown.startswith("Usage: probdmp inspect [OPTIONS] [MODEL]\n")
    assert "list[" not in shown + run("fit", "--help").stdout


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_shell_can_complete(shell):
    asked = environment(_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION="1")
    arguments = [*PROGRAM, "--show-completion", shell]
    script = subprocess.run(arguments, env=asked, capture_output=True, text=True, check=True)
    assert "_PROBDMP_COMPLETE" in script.stdout
    if shell == "bash":
        for words, found in (("probdmp per", "perturb"), ("probdmp fit --pub", "--published")):
            asked = environment(COMP_WORDS=words, COMP_CWORD=str(words.count(" ")), _PROBDMP_COMPLETE="complete_bash")
            assert subprocess.run(PROGRAM, env=asked, capture_output=True, text=True, check=True).stdout.split() == [found]


def test_version(run):
    assert run("--version").stdout == f"probdmp {__version__}\n"


# Exit codes and messages


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (["--bogus"], 2),
        (["bogus"], 2),
        (["fit"], 2),
        (["fit", "letters.npz", "-o", "m.probdmp", "--n-basis", "many"], 2),
        (["fit", "letters.npz", "-o", "m.probdmp", "--n-basis", "0"], 2),
        (["fit", "letters.npz", "-o", "m.probdmp", "--smoothing", "nan"], 2),
        (["fit", "letters.npz", "-o", "m.probdmp", "--discretization", "euler"], 2),
        (["fit", "letters.npz", "-o", "m.probdmp", "--label", "q"], 2),
        (["fit", "letters.npz", "-o", "none/m.probdmp"], 2),
        (["fit", "letters.npz", "-o", "m.npz"], 2),
        (["fit", "none.npz", "-o", "m.probdmp"], 3),
        (["fit", "c.probdmp", "-o", "m.probdmp"], 3),
        (["inspect", "none.probdmp"], 3),
        (["inspect", "letters.npz"], 3),
        (["rollout", "letters.probdmp"], 2),
        (["rollout", "letters.probdmp", "--label", "q"], 2),
        (["rollout", "c.probdmp", "--goal", "1"], 2),
        (["rollout", "c.probdmp", "--goal", "1,x"], 2),
        (["rollout", "c.probdmp", "--goal", "1,nan"], 2),
        (["rollout", "c.probdmp", "--duration", "-1"], 2),
        (["rollout", "c.probdmp", "--dt", "1e-9"], 2),
        (["rollout", "c.probdmp", "-o", "r.csv"], 2),
        (["track", "c.probdmp", "letters.npz", "--index", "12"], 2),
        (["track", "c.probdmp", "letters.npz", "--index", "-1"], 2),
        (["smooth", "letters.probdmp", "none.npz"], 3),
        (["monitor", "letters.npz", "letters.npz"], 3),
        (["evaluate", "none.npz"], 3),
    ],
)
def test_errors_are_one_line_and_an_exit_code(arguments, code, folder, run, monkeypatch):
    monkeypatch.chdir(folder)
    result = run(*arguments, "--json") if arguments[0] in {verb.__name__ for verb in VERBS} else run(*arguments)
    assert (result.exit_code, result.stdout) == (code, "")
    assert result.stderr.startswith("probdmp: ")
    assert result.stderr.count("\n") == 1
    assert not (folder / "m.probdmp").exists()


RECORDINGS = {
    "none.npz": "no such file",
    "none.csv": "no such file",
    "folder.csv": "a directory",
    "empty.npz": "or a part of one",
    "empty.csv": "an empty file",
    "table.xlsx": r"'.*table.xlsx'. Other programs",
    "secret.csv": "permission denied",
}
READERS = {
    "fit": ["{}", "-o", "m.probdmp"],
    "track": ["c.probdmp", "{}"],
    "smooth": ["c.probdmp", "{}"],
    "monitor": ["c.probdmp", "{}"],
    "evaluate": ["{}"],
    "perturb": ["{}", "-o", "m.csv"],
    "convert": ["{}", "m.csv"],
}


@pytest.mark.parametrize("name", RECORDINGS)
@pytest.mark.parametrize("verb", READERS)
def test_recordings_that_cannot_be_read(verb, name, folder, run, monkeypatch, tmp_path):
    monkeypatch.chdir(folder)
    if name == "secret.csv" and os.geteuid() == 0:
        pytest.skip("root may read everything")
    (tmp_path / "folder.csv").mkdir()
    for empty in ("empty.npz", "empty.csv", "table.xlsx", "secret.csv"):
        (tmp_path / empty).touch()
    (tmp_path / "secret.csv").chmod(0)
    result = run(verb, *(str(tmp_path / name) if a == "{}" else a for a in READERS[verb]))
    assert (result.exit_code, result.stdout) == (3, "")
    assert re.fullmatch(rf"probdmp: expected .*{RECORDINGS[name]}.*\. .*\.?\n|probdmp: .*{RECORDINGS[name]}.*\n", result.stderr)
    assert not (folder / "m.csv").exists()


@pytest.mark.parametrize(
    ("error", "code", "line"),
    [
        (UsageError("a", "b", "Do c."), 2, "expected a, got b. Do c."),
        (DataFileError("a", "b"), 3, "expected a, got b."),
        (ModelFileError("a", "b"), 3, "expected a, got b."),
        (InputError("a", "two\nlines"), 3, "expected a, got two lines."),
        (MissingExtraError("a", "none", "Type: pip"), 1, "expected a, got none. Type: pip"),
        (typer.BadParameter("Bad."), 2, "invalid value: Bad. Try: probdmp --help"),
        (PermissionError(13, "Permission denied", "f"), 1, "expected to read and write 'f', got permission denied. Check"),
        (KeyboardInterrupt(), 130, "interrupted"),
        (ZeroDivisionError("x"), 1, "internal error, ZeroDivisionError: x. Please report it"),
    ],
)
def test_the_table_of_exceptions(error, code, line):
    assert exit_code(error) == code
    assert message(error).startswith(line)


def test_debug_shows_where_an_error_comes_from(folder, run):
    result = run("--debug", "inspect", folder / "letters.npz")
    assert result.exit_code == 3
    assert "Traceback" in result.stderr
    assert result.stderr.splitlines()[-1].startswith("probdmp: expected ")


def test_an_unforeseen_error_is_still_one_line(folder, run, monkeypatch):
    def fail(path):
        raise RuntimeError("out of luck")

    monkeypatch.setattr("probdmp.io.read_model", fail)
    result = run("inspect", folder / "c.probdmp")
    assert result.exit_code == 1
    assert result.stderr.startswith("probdmp: internal error, RuntimeError: out of luck.")


# Output


def test_json_has_null_for_what_is_not_a_number():
    assert plain({"a": [float("nan"), float("inf")], "b": (1, None, "x", True)}) == {
        "a": [None, None],
        "b": [1, None, "x", True],
    }
    assert json_line({"a": float("-inf")}) == '{"a": null}\n'


def test_labels_cannot_steer_the_terminal(run, tmp_path, letters):
    hostile = [Demonstration(d.positions, d.dt, "\x1b[31m[bold]:smile:\r", d.names) for d in letters[:3]]
    write_demonstrations(tmp_path / "h.npz", hostile)
    result = run("fit", tmp_path / "h.npz", "-o", tmp_path / "h.probdmp", "--n-basis", 5)
    shown = result.stdout + run("inspect", tmp_path / "h.probdmp").stdout
    shown += run("monitor", tmp_path / "h.probdmp", tmp_path / "h.npz").stdout
    assert "\x1b" not in shown
    assert "\r" not in shown
    assert "�[31m[bold]:smile:�" in shown
    assert printable("a\tb\nc\u202e") == "a�b\nc�"


@pytest.mark.parametrize("variables", [{"NO_COLOR": "1"}, {"TERM": "dumb"}])
def test_color_is_left_out_where_it_is_not_wanted(variables, folder):
    assert "\x1b" not in in_terminal(["inspect", folder / "c.probdmp"], **variables)


def test_color_in_a_terminal(folder):
    assert "\x1b[1m" in in_terminal(["inspect", folder / "c.probdmp"])


def test_pipes_get_neither_color_nor_progress(folder):
    result = subprocess.run(
        [*PROGRAM, "fit", "letters.npz", "-o", "again.probdmp", "--n-basis", "5"],
        cwd=folder, env=environment(), capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert "\x1b" not in result.stdout
    assert result.stderr == ""


def test_progress_shows_in_a_terminal(folder):
    shown = in_terminal(["fit", folder / "letters.npz", "-o", folder / "again.probdmp", "--n-basis", "5"])
    assert "Learning" in shown
    assert re.search(r"Calibrating .*[1-9]/4.* elapsed, .* left", shown)  # two primitives, with and without their goals


@pytest.mark.parametrize("width", [80, pytest.param(120, marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    "words", ["inspect letters.probdmp", "rollout c.probdmp", "monitor c.probdmp unlabelled.npz", "inspect --system"]
)
def test_terminals_are_wide_enough(words, width, folder, monkeypatch):
    monkeypatch.chdir(folder)
    shown = in_terminal(words.split(), COLUMNS=str(width), NO_COLOR="1")
    assert max(map(len, shown.replace("\r\n", "\n").splitlines())) <= width
    assert "…" not in shown


def test_interrupted_work_says_so_and_writes_nothing(folder, tmp_path):
    model = tmp_path / "m.probdmp"
    leader, follower = pty.openpty()
    arguments = [*PROGRAM, "fit", folder / "letters.npz", "-o", model, "--n-basis", "60"]
    with subprocess.Popen(arguments, stderr=follower, stdout=subprocess.DEVNULL, env=environment()) as process:
        os.close(follower)
        shown = b""
        while b"Learning" not in shown:
            shown += os.read(leader, 65536)
        process.send_signal(signal.SIGINT)
        try:
            while chunk := os.read(leader, 65536):
                shown += chunk
        except OSError:  # the other end is closed
            pass
        os.close(leader)
    assert process.returncode == 130
    assert b"Traceback" not in shown
    assert shown.endswith(b"probdmp: interrupted\r\n")
    assert not model.exists()


def test_an_interrupt_while_loading_is_one_line():
    code = "import sys\nfrom probdmp.cli import main\nclass Stop:\n def find_spec(self, name, path=None, target=None):\n  "
    code += "if name == 'typer': raise KeyboardInterrupt\nsys.meta_path.insert(0, Stop())\nmain()"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (result.returncode, result.stderr) == (130, "probdmp: interrupted\n")


def test_a_reader_that_leaves_is_no_scandal(folder):
    arguments = [*PROGRAM, "rollout", folder / "c.probdmp", "--dt", "0.0005", "--json"]
    with subprocess.Popen(arguments, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=environment()) as process:
        process.stdout.close()
        assert process.stderr.read() == b""
    assert process.returncode == 1


def test_monitor_answers_at_once_and_can_be_interrupted(folder):
    arguments = [*PROGRAM, "monitor", folder / "c.probdmp", "-"]
    pipe = subprocess.PIPE
    with subprocess.Popen(arguments, stdin=pipe, stdout=pipe, stderr=pipe, text=True, env=environment()) as process:
        for _ in range(2):
            process.stdin.write('{"position": [8, 8]}\n')
            process.stdin.flush()
            assert json.loads(process.stdout.readline())["time"] > 0
        process.send_signal(signal.SIGINT)
        assert process.stderr.read() == "probdmp: interrupted\n"
    assert process.returncode == 130


def test_monitor_exit_code_of_a_process(folder):
    result = subprocess.run([*PROGRAM, "monitor", folder / "letters.probdmp", folder / "blocked.npz"], capture_output=True)
    assert result.returncode == 4


def test_a_terminal_without_the_letters_shows_question_marks(folder):
    result = subprocess.run(
        [*PROGRAM, "rollout", folder / "c.probdmp"], env=environment(PYTHONIOENCODING="ascii"), capture_output=True
    )
    assert (result.returncode, result.stderr) == (0, b"")
    assert result.stdout.isascii()
