"""`probdmp plot` and `probdmp report`."""

import json
import re
import shlex
import shutil
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest
from html_pages import check_page
from matplotlib.axes import Axes

from probdmp import write_demonstrations
from probdmp.cli.pictures import KINDS
from probdmp.cli.plot import FORMATS, VIEWERS
from probdmp.demonstrations import Demonstration
from probdmp.plotting.panels import FORMATS as DRAWN

ARGUMENTS = {
    "demonstrations": ("letters.npz",),
    "basis": ("c.probdmp",),
    "forcing": ("letters.probdmp", "--label", "l"),
    "rollout": ("letters.probdmp", "--label", "l", "--goal", "3,4", "--duration", 2),
    "path": ("c.probdmp", "--dof", "y,x"),
    "smoothing": ("c.probdmp", "unlabelled.npz", "--index", 2),
    "monitor": ("letters.probdmp", "blocked.npz", "--label", "l", "--index", 1, "--onset", 0.4),
    "operating": ("evaluation.json",),
    "onset": ("evaluation.json",),
}


@pytest.fixture(scope="module")
def place(folder, run):
    """The folder of files, with an evaluation too."""
    result = run("evaluate", folder / "letters.npz", "--train", 3, "--test", 3, "--fault", "hold,push", "--json")
    (folder / "evaluation.json").write_text(result.stdout)
    return folder


def in_place(place, arguments):
    return [place / a if re.search(r"\.(npz|probdmp|json)$", str(a)) else a for a in arguments]


@pytest.mark.parametrize("what", KINDS)
def test_every_picture(what, place, run, tmp_path):
    picture = tmp_path / "p.svg"
    result = run("plot", what, *in_place(place, ARGUMENTS[what]), "-o", picture)
    assert (result.exit_code, result.stderr, result.stdout) == (0, "", f"Wrote {picture}\n")
    assert ElementTree.parse(picture).getroot().tag.endswith("svg")


@pytest.mark.parametrize(("suffix", "begins"), [(".svg", b"<?xml"), (".png", b"\x89PNG"), (".pdf", b"%PDF")])
def test_every_format(suffix, begins, place, run_json, tmp_path):
    picture = tmp_path / f"p{suffix}"
    assert run_json("plot", "basis", place / "c.probdmp", "-o", picture) == {"written": str(picture)}
    assert picture.read_bytes().startswith(begins)
    assert FORMATS == DRAWN


@pytest.mark.parametrize("what", ["rollout", "smoothing", "monitor"])
@pytest.mark.parametrize(("suffix", "library", "magic"), [(".mcap", "foxglove", b"\x89MCAP0\r\n"), (".rrd", "rerun", b"RRF2")])
def test_what_is_over_time_goes_to_viewers_too(what, suffix, library, magic, place, run, tmp_path):
    pytest.importorskip(library, reason=f"needs the extra {library}: pip install 'probdmp[{library}]'")
    assert suffix in VIEWERS
    picture = tmp_path / f"p{suffix}"
    result = run("plot", what, *in_place(place, ARGUMENTS[what]), "-o", picture)
    assert (result.exit_code, result.stderr, result.stdout) == (0, "", f"Wrote {picture}\n")
    assert picture.read_bytes().startswith(magic)


def test_an_alarm_of_the_program_is_in_the_file_for_foxglove(place, run, tmp_path):
    pytest.importorskip("foxglove", reason="needs the extra foxglove: pip install 'probdmp[foxglove]'")
    decoder = pytest.importorskip("mcap_protobuf.decoder", reason="needs mcap-protobuf-support")
    from mcap.reader import make_reader

    arguments = ("letters.probdmp", "blocked.npz", "--label", "c", "--index", 1)
    assert run("plot", "monitor", *in_place(place, arguments), "-o", tmp_path / "p.mcap").exit_code == 0
    shown = run("monitor", place / "letters.probdmp", place / "blocked.npz", "--label", "c").stdout.splitlines()[1]
    with (tmp_path / "p.mcap").open("rb") as file:
        reader = make_reader(file, decoder_factories=[decoder.DecoderFactory()])
        (log,) = [decoded.decoded_message for decoded in reader.iter_decoded_messages(topics=["/log"])]
        (heading,) = [metadata.metadata["heading"] for metadata in reader.iter_metadata()]
    assert log.message == shown.split("  ", 1)[1]
    assert log.message.startswith("failed at")
    assert heading == f"c, recording 1: {log.message}"


def test_the_page_on_viewers_runs_for_rerun_too(place, run, tmp_path, monkeypatch):
    """tests/test_docs.py runs what needs no rerun-sdk."""
    pytest.importorskip("rerun", reason="needs the extra rerun: pip install 'probdmp[rerun]'")
    page = (Path(__file__).parents[2] / "docs/how-to/viewers.md").read_text()
    (block,) = re.findall(r"^```console\n(.*?)^```$", page, flags=re.M | re.S)
    commands = [shlex.split(line) for line in block.splitlines() if line.startswith("probdmp ")]
    assert len(commands) == 3
    monkeypatch.chdir(tmp_path)
    for name in ("letters.probdmp", "blocked.npz", "letters.npz"):
        shutil.copy(place / name, "executions.npz" if name == "letters.npz" else name)
    for _, *arguments in commands:
        result = run(*["c" if word == "a" else word for word in arguments])
        assert (result.exit_code, result.stderr) == (0, "")


@pytest.mark.parametrize(("suffix", "module"), [(".mcap", "foxglove"), (".rrd", "rerun")])
def test_a_viewer_that_is_not_there_is_said_before_any_work(suffix, module, place, run, tmp_path, monkeypatch):
    monkeypatch.setattr(f"probdmp.plotting.{module}.find_spec", lambda name: None)
    monkeypatch.setattr("probdmp.plotting.style.find_spec", lambda name: pytest.fail("matplotlib is not needed"))
    result = run("plot", "rollout", place / "c.probdmp", "-o", tmp_path / f"p{suffix}")
    assert result.exit_code == 1
    assert f"pip install 'probdmp[{module}]'" in result.stderr
    assert not list(tmp_path.iterdir())


def test_the_default_name(place, run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert run("plot", "path", place / "c.probdmp").stdout == "Wrote c-path.svg\n"
    assert (tmp_path / "c-path.svg").exists()


def titles_drawn(monkeypatch):
    """What the panels are called that are drawn from now on."""
    titles = []
    monkeypatch.setattr(Axes, "set_title", lambda ax, title: titles.append(title))
    return titles


@pytest.mark.usefixtures("sketched")
def test_demonstrations_of_one_label_are_drawn_over_time(place, run, tmp_path, monkeypatch):
    titles = titles_drawn(monkeypatch)
    for arguments in (("--label", "c"), ()):
        assert run("plot", "demonstrations", place / "letters.npz", *arguments, "-o", tmp_path / "p.png").exit_code == 0
    assert titles == ["Path", "x over time", "y over time", "“c”, 6", "“l”, 6"]


@pytest.mark.usefixtures("sketched")
def test_a_verdict_stands_above_the_monitors_picture(place, run, tmp_path, monkeypatch):
    headings = []
    monkeypatch.setattr("matplotlib.figure.Figure.suptitle", lambda figure, text, **options: headings.append(text))
    for model in ("letters.probdmp", "paper.probdmp"):
        run("plot", "monitor", place / model, place / "blocked.npz", "--index", 1, "-o", tmp_path / "p.png")
    shown = run("monitor", place / "letters.probdmp", place / "blocked.npz", "--label", "c").stdout.splitlines()[1]
    assert headings[0] == "c, recording 1: " + shown.split("  ", 1)[1]
    assert headings[1].startswith("c, recording 1: f")


@pytest.mark.usefixtures("sketched")
def test_one_degree_of_freedom(run, tmp_path, letters):
    place = tmp_path
    write_demonstrations(place / "one.npz", [Demonstration(d.positions[:, :1], d.dt, "a", ("q1",)) for d in letters[:4]])
    assert run("fit", place / "one.npz", "-o", place / "one.probdmp", "--n-basis", 5).exit_code == 0
    for what in ("basis", "forcing", "rollout"):
        assert run("plot", what, place / "one.probdmp", "-o", place / "p.svg").exit_code == 0
    assert run("plot", "demonstrations", place / "one.npz", "-o", place / "p.svg").exit_code == 0
    result = run("plot", "path", place / "one.probdmp", "-o", place / "p.svg")
    assert result.exit_code == 2
    assert "two degrees of freedom" in result.stderr
    assert run("report", place / "one.probdmp", "-o", place / "r.html").exit_code == 0
    check_page((place / "r.html").read_text())


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (("bogus", "c.probdmp"), 2, "expected WHAT to be one of demonstrations, basis"),
        (("basis", "c.probdmp", "-o", "p.gif"), 2, "ends in .svg or .png or .pdf or .mcap or .rrd, got 'p.gif'"),
        (("basis", "c.probdmp", "-o", "p.mcap"), 2, "one of rollout, smoothing, monitor for a .mcap file, got basis"),
        (("operating", "evaluation.json", "-o", "p.rrd"), 2, "one of rollout, smoothing, monitor for a .rrd file"),
        (("basis", "c.probdmp", "-o", "none/p.svg"), 2, "a folder that exists"),
        (("basis", "letters.probdmp"), 2, "--label to be one of those in the model"),
        (("basis", "c.probdmp", "--goal", "1,2"), 2, "of basis only --label, got --goal"),
        (("operating", "evaluation.json", "--label", "c"), 2, "none of these options, got --label"),
        (("basis", "c.probdmp", "letters.npz"), 2, "one file: probdmp plot basis FILE"),
        (("smoothing", "c.probdmp"), 2, "recorded executions after the model"),
        (("path", "c.probdmp", "--dof", "x"), 2, "--dof as two of x, y, got x"),
        (("path", "c.probdmp", "--dof", "x,x"), 2, "--dof as two of x, y"),
        (("rollout", "c.probdmp", "--duration", "-1"), 2, "duration"),
        (("monitor", "bare.probdmp", "blocked.npz"), 3, "a failure detector in"),
        (("monitor", "c.probdmp", "unlabelled.npz", "--index", "9"), 2, "--index from 0 to 5"),
        (("operating", "letters.npz"), 3, "JSON in"),
        (("operating", "other.json"), 3, "an evaluation as JSON"),
        (("onset", "benign.json"), 3, "an evaluation of failures"),
        (("rollout", "none.probdmp"), 3, "none.probdmp"),
    ],
)
def test_what_cannot_be_drawn_is_said(arguments, code, message, place, run, monkeypatch):
    monkeypatch.chdir(place)
    (place / "other.json").write_text('{"classes": 1}')
    benign = json.loads((place / "evaluation.json").read_text())
    for judge in benign["readings"]:
        judge["faults"] = {"jitter": {**judge["faults"]["hold"], "nature": "benign"}}
    (place / "benign.json").write_text(json.dumps(benign))
    result = run("plot", *arguments)
    assert (result.exit_code, result.stdout) == (code, "")
    assert message in result.stderr


def test_without_matplotlib_the_command_is_said(place, run, monkeypatch, tmp_path):
    monkeypatch.setattr("probdmp.plotting.style.find_spec", lambda name: None)
    for arguments in (("plot", "basis", place / "c.probdmp", "-o", tmp_path / "p.svg"),
                      ("report", place / "c.probdmp", "-o", tmp_path / "r.html")):  # fmt: skip
        result = run(*arguments)
        assert (result.exit_code, result.stdout) == (1, "")
        assert "pip install 'probdmp[plot]'" in result.stderr


# Reports


def test_a_report_of_a_model(place, run, tmp_path):
    page = tmp_path / "r.html"
    result = run("report", place / "letters.probdmp", "-o", page)
    assert (result.exit_code, result.stderr, result.stdout) == (0, "", f"Report: {page}\n")
    text = page.read_text()
    check_page(text)
    assert text.count("<svg") == 2 * 5
    assert f"probdmp report {place / 'letters.probdmp'} -o {page}" in text


@pytest.mark.usefixtures("sketched")
def test_a_model_says_how_it_was_learned(place, run, run_json, tmp_path):
    model, page = tmp_path / "m.probdmp", tmp_path / "r.html"
    run("fit", place / "letters.npz", "-o", model, "--n-basis", 7, "--label", "c", "--rule", "paper", "--json")
    command = f"probdmp fit {place / 'letters.npz'} --output {model} --label c --n-basis 7 --rule paper"
    assert run_json("inspect", model)["provenance"]["command"] == command
    assert run_json("report", model, "-o", page) == {"written": str(page)}
    assert command in page.read_text()


@pytest.mark.usefixtures("sketched")
def test_only_one_primitive_is_drawn(place, run, tmp_path):
    page = tmp_path / "r.html"
    assert run("report", place / "letters.probdmp", "--label", "l", "-o", page).exit_code == 0
    assert page.read_text().count("<svg") == 5


@pytest.mark.usefixtures("sketched")
def test_a_report_of_an_evaluation_is_the_one_that_evaluate_writes_less_the_execution(place, run, tmp_path):
    kept, made = tmp_path / "kept.html", tmp_path / "made.html"
    assert run("report", place / "evaluation.json", "-o", kept).exit_code == 0
    run("evaluate", place / "letters.npz", "--train", 3, "--test", 3, "--fault", "hold,push", "--report", made)
    check_page(kept.read_text())
    check_page(made.read_text())
    tables = [re.findall(r"<table.*?</table>", page.read_text(), flags=re.S) for page in (kept, made)]
    assert tables[0] == tables[1]
    commands = [re.findall(r"<pre>.*?</pre>", page.read_text(), flags=re.S) for page in (kept, made)]
    assert commands[0] == commands[1]
    assert "One execution" in made.read_text()
    assert "One execution" not in kept.read_text()


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (("c.probdmp", "-o", "r.pdf"), 2),
        (("letters.probdmp", "--label", "q"), 2),
        (("evaluation.json", "--label", "c"), 2),
        (("letters.npz",), 3),
        (("none.json",), 3),
    ],
)
def test_reports_that_cannot_be_written(arguments, code, place, run, monkeypatch):
    monkeypatch.chdir(place)
    result = run("report", *arguments)
    assert (result.exit_code, result.stdout) == (code, "")
    assert result.stderr.startswith("probdmp: expected ")


def test_labels_in_reports_and_pictures_are_text(run, tmp_path, letters):
    label = "<script>alert(1)</script>$\\frac{"
    write_demonstrations(tmp_path / "h.npz", [Demonstration(d.positions, d.dt, label, d.names) for d in letters[:4]])
    assert run("fit", tmp_path / "h.npz", "-o", tmp_path / "h.probdmp", "--n-basis", 5).exit_code == 0
    assert run("report", tmp_path / "h.probdmp", "-o", tmp_path / "r.html").exit_code == 0
    check_page((tmp_path / "r.html").read_text())
    for what, file in (("demonstrations", "h.npz"), ("forcing", "h.probdmp"), ("path", "h.probdmp")):
        assert run("plot", what, tmp_path / file, "-o", tmp_path / "p.svg").exit_code == 0
        assert "<script>" not in (tmp_path / "p.svg").read_text()
