"""Message by message: what a page says, and what it is told."""

import io
import struct
import zipfile

import numpy as np
import pytest
from studio_page import RunningStudio, points_of

from probdmp import FailureDetector, PrimitiveLibrary, ProbabilisticDMP, load, read_demonstrations, write_demonstrations
from probdmp.demonstrations import FAULTS, LETTERS, synthetic_letters
from probdmp.studio.jobs import Contents
from probdmp.studio.strokes import stroke_of


def rows_of(frame):
    """Header and (4, n) rows of a frame."""
    kind, flags, n, sequence, time, phase, log_likelihood, test_ratio = struct.unpack_from("<BBHIffff", frame)
    rows = np.frombuffer(frame, "<f4", offset=24).reshape(4, n)
    head = {"kind": kind, "flags": flags, "sequence": sequence, "time": time, "phase": phase}
    return head | {"log_likelihood": log_likelihood, "test_ratio": test_ratio}, rows


def as_taught(drawn, **parameters):
    strokes = [stroke_of(np.array(points_of(d), dtype=float), "c") for d in drawn]
    return ProbabilisticDMP(**parameters).fit(strokes), strokes


def test_hello_is_answered_by_the_state(page):
    state = page.state()
    assert (state["labels"], state["selected"], state["calibration"]) == ([], None, None)
    assert state["examples"] == list(LETTERS)
    assert state["faults"] == list(FAULTS)
    assert len(state["session"]) == 32
    assert state["settings"]["n_basis"] == 30
    assert set(state["choices"]["variant"]) == {"default", "as_published"}


def test_a_stroke_is_learned_and_comes_back_as_the_librarys_band(page, drawn):
    page.say("stroke", label="c", points=points_of(drawn[0]))
    state = page.hear("state")
    assert state["labels"][0]["name"] == "c"
    assert len(state["labels"][0]["strokes"][0]["points"]) == drawn[0].n_samples
    page.hear("learning")
    band = page.hear("band")
    learned, _ = as_taught(drawn[:1])
    planned = learned.rollout()
    np.testing.assert_allclose(band["times"], planned.times, rtol=1e-12)
    np.testing.assert_allclose(band["path"]["mean"], planned.positions, rtol=1e-9)
    np.testing.assert_allclose(band["velocity"]["std"], planned.velocity_stds, rtol=1e-9)
    np.testing.assert_allclose(band["acceleration"]["mean"], planned.accelerations, rtol=1e-9, atol=1e-9)
    assert band["change"] == ""
    page.say("stroke", label="c", points=points_of(drawn[1]))
    assert page.hear("band")["change"].startswith("the second demonstration moved the mean by")


def test_an_example_shows_everything_by_one_click(page):
    page.say("example", name="a")
    band = page.hear("band")
    assert band["label"] == "a"
    assert {"phase", "mean", "std"} <= set(band["forcing"])
    assert all(len(ellipse) == 5 for ellipse in band["tube"])
    assert np.min(band["path"]["mean"]) >= 0
    assert np.max(band["path"]["mean"]) <= 100
    state = page.hear("state", where=lambda state: state["calibration"]["n"])
    assert state["calibration"]["n"] == 10
    assert state["calibration"]["attainable"] == pytest.approx(1 / 11)
    assert len(state["labels"][0]["strokes"]) == 10


def test_labels_are_added_renamed_selected_deleted(page, drawn):
    page.ask("add_label", "state", label="<b>one</b>")
    page.ask("stroke", "state", label="two", points=points_of(drawn[0]))
    page.hear("band")
    assert page.ask("select", "state", label="<b>one</b>")["selected"] == "<b>one</b>"
    assert [known["name"] for known in page.ask("rename_label", "state", label="two", to="three")["labels"]][1] == "three"
    page.hear("band")
    state = page.ask("delete_stroke", "state", label="three", index=0)
    assert state["labels"][1]["strokes"] == []
    assert [known["name"] for known in page.ask("delete_label", "state", label="three")["labels"]] == ["<b>one</b>"]


def test_settings_change_what_is_learned(taught, drawn):
    state = taught.ask("settings", "state", n_basis=12, variant="as_published")
    assert state["settings"]["n_basis"] == 12
    band = taught.hear("band")
    strokes = as_taught(drawn)[1]
    published = ProbabilisticDMP.as_published(12).fit(strokes).rollout()
    np.testing.assert_allclose(band["path"]["mean"], published.positions, rtol=1e-8)


def test_alpha_alone_calibrates_without_learning(taught):
    taught.ask("settings", "state", alpha=0.2)
    state = taught.hear("state", where=lambda state: state["calibration"]["n"])
    assert state["calibration"]["alpha"] == 0.2


def test_a_task_bends_the_path(taught):
    band = taught.ask("task", "band", "error", start=[20, 30], goal=[70, 40], via=[], duration=2.5)
    assert band["times"][-1] == pytest.approx(2.5, abs=0.01)
    np.testing.assert_allclose(band["path"]["mean"][0], [20, 30], atol=1e-9)
    np.testing.assert_allclose(band["path"]["mean"][-1], [70, 40], atol=0.5)
    there = taught.ask("task", "band", "error", start=None, goal=None, via=[[0.5, 60, 60]], duration=None)
    assert np.min(np.linalg.norm(np.array(there["path"]["mean"]) - [60, 60], axis=1)) < 1.5
    played = taught.ask("play", "playing", "error", speed=4)
    assert played["type"] == "playing"
    verdict = taught.hear("verdict", where=lambda verdict: verdict.get("final"))
    assert not verdict["failed"]
    assert "not watched" not in verdict["text"]


def test_playing_is_undisturbed_and_what_is_shown_is_what_the_library_says(taught, drawn):
    playing = taught.ask("play", "playing", speed=0.6)  # hence at most one tick in a frame
    assert playing["names"] == ["x", "y"]
    assert playing["threshold"] == 1.0
    assert taught.hear("played")["completed"]
    shown = [rows_of(frame) for frame in taught.frames]
    assert {head["kind"] for head, _ in shown} == {1}
    assert not any(head["flags"] & 1 for head, _ in shown)
    sequence = [head["sequence"] for head, _ in shown]
    assert sequence == sorted(set(sequence))
    learned, strokes = as_taught(drawn)
    detector = FailureDetector(0.01).fit({"c": learned}, {"c": strokes})
    execution = learned.execute(detector=detector)
    if sequence[-1] - sequence[0] + 1 == len(sequence) and len(shown) >= 0.99 * playing["duration"] / 0.01:
        for head, rows in shown:  # none was dropped: the same readings, in float32, step by step
            step = execution.step(rows[0].astype(float))
            np.testing.assert_allclose(rows[1], step.position, rtol=1e-4)
            np.testing.assert_allclose(rows[3], step.contributions, atol=0.02)
            assert head["time"] == pytest.approx(step.time, abs=1e-5)


def test_a_fault_is_caught_and_explained(taught):
    taught.ask("play", "playing", fault="hold", onset=0.4)
    verdict = taught.hear("verdict")
    assert verdict["failed"]
    assert verdict["kind"] in ("motion", "timing")
    assert set(verdict["contributions"]) == {"x", "y"}
    final = taught.hear("verdict", where=lambda message: message.get("final"))
    assert final["failed"]
    taught.hear("played")
    assert any(rows_of(frame)[0]["flags"] & 1 for frame in taught.frames)


def test_a_held_pen_is_caught(taught):
    taught.ask("play", "playing", speed=0.5)
    while len(taught.frames) < 20:
        frame = taught.socket.recv(timeout=5)
        assert isinstance(frame, bytes)
        taught.frames.append(frame)
    x, y = rows_of(taught.frames[-1])[1][0].tolist()
    taught.say("pointer", mode="hold", x=x, y=y)
    verdict = taught.hear("verdict")
    assert verdict["failed"]
    taught.ask("pointer", "verdict", "played", mode="none")


def test_playing_can_be_stopped(taught):
    taught.ask("play", "playing", speed=0.1)
    assert taught.ask("stop", "played")["completed"] is False


def test_what_is_traced_is_scored_and_recognised(taught, drawn):
    taught.say("trace_begin", label="c")
    points = points_of(drawn[2])
    for k in range(0, len(points), 4):
        taught.say("trace", points=points[k : k + 4])
    taught.say("trace_end")
    verdict = taught.hear("verdict")
    assert verdict["final"]
    assert not verdict["failed"]
    recognised = taught.hear("recognised", where=lambda message: message["final"])
    assert recognised["label"] == "c"
    assert {rows_of(frame)[0]["kind"] for frame in taught.frames} == {2}
    learned, strokes = as_taught(drawn)
    execution = learned.execute(detector=FailureDetector(0.01).fit({"c": learned}, {"c": strokes}))
    steps = [execution.step(row) for row in drawn[2].positions]
    head, rows = rows_of(taught.frames[-1])
    np.testing.assert_allclose(rows[1], steps[-1].position, rtol=1e-5)
    assert head["log_likelihood"] == pytest.approx(steps[-1].log_likelihood, rel=1e-4)


def test_a_replay_is_what_the_detector_says(taught, drawn):
    replayed = taught.ask("replay", "replayed", "error", label="c", index=3)
    learned, strokes = as_taught(drawn)
    (verdict,) = FailureDetector(0.01).fit({"c": learned}, {"c": strokes}).verdicts([strokes[3]])
    assert replayed["verdict"]["test_ratio"] == pytest.approx(verdict.test_ratio, rel=1e-9)
    assert replayed["verdict"]["text"] == str(verdict)
    assert len(replayed["times"]) == len(replayed["test_ratios"]) == strokes[3].n_samples
    compared = taught.ask("compare", "compared", "error", label="c", index=3)
    np.testing.assert_allclose(compared["smoothed"]["mean"], learned.smooth(strokes[3]).positions, rtol=1e-8)
    np.testing.assert_allclose(compared["filtered"]["std"], learned.track(strokes[3]).position_stds, rtol=1e-6)


def test_commands_do_the_same_again(taught, tmp_path, monkeypatch):
    commands = taught.ask("export_commands", "commands")
    assert "probdmp fit demonstrations.npz" in commands["shell"]
    with taught.studio.http() as http:
        (tmp_path / "demonstrations.npz").write_bytes(http.get(f"/download/{taught.session}/demonstrations.npz").content)
    monkeypatch.chdir(tmp_path)
    names = {}
    exec(commands["python"], names)  # what the page lets one copy
    np.testing.assert_allclose(names["planned"].positions, taught.ask("task", "band", start=None)["path"]["mean"], rtol=1e-6)


def test_downloads_hold_what_was_taught(taught, drawn, tmp_path):
    with taught.studio.http() as http:
        for name in ("demonstrations.npz", "demonstrations.csv", "model.probdmp", "picture.svg", "session.zip"):
            reply = http.get(f"/download/{taught.session}/{name}")
            assert reply.status_code == 200, reply.text
            assert reply.headers["content-disposition"] == f'attachment; filename="{name}"'
            (tmp_path / name).write_bytes(reply.content)
    found = read_demonstrations(tmp_path / "demonstrations.npz")
    np.testing.assert_allclose(found[0].positions, drawn[0].positions, rtol=1e-12)
    assert len(read_demonstrations(tmp_path / "demonstrations.csv")) == len(drawn)
    np.testing.assert_allclose(load(tmp_path / "model.probdmp").rollout().positions, as_taught(drawn)[0].rollout().positions)
    inside = zipfile.ZipFile(io.BytesIO((tmp_path / "session.zip").read_bytes())).namelist()
    assert "commands.txt" in inside
    assert "picture.png" in inside


def test_files_are_opened(page, taught_model, tmp_path):
    write_demonstrations(tmp_path / "x.csv", synthetic_letters(3, letters="de", dt=0.01))
    with page.studio.http() as http:
        body = (tmp_path / "x.csv").read_bytes()
        reply = http.post(f"/upload/{page.session}?name=letters.csv", content=body)
        assert reply.json()["imported"]["labels"] == {"d": 3, "e": 3}
        page.hear("state", where=lambda state: len(state["labels"]) == 2)
        reply = http.post(f"/upload/{page.session}?name=letters.csv&as=execution", content=body)
        assert reply.status_code == 200
        state = page.hear("state", where=lambda state: state["imported"])
        assert [item["label"] for item in state["imported"]] == ["d"] * 3 + ["e"] * 3
        assert page.ask("replay", "replayed", "error", label="imported", index=4)["label"] == "e"
        reply = http.post(f"/upload/{page.session}?name=model.probdmp", content=taught_model)
        assert reply.json()["imported"]["labels"] == {"s": 0}, reply.text
    page.ask("select", "state", label="s")
    assert page.ask("play", "playing", "error", fault="hold")["type"] == "playing"
    assert page.hear("verdict", where=lambda verdict: verdict.get("final"))["failed"]


@pytest.fixture(scope="module")
def taught_model(tmp_path_factory):
    """A model file with its detector."""
    path = tmp_path_factory.mktemp("model") / "s.probdmp"
    letters = synthetic_letters(6, letters="s", dt=0.02)
    learned = ProbabilisticDMP(n_basis=10).fit(letters)
    library = PrimitiveLibrary({"s": learned})
    library.save(path, FailureDetector().fit(library, {"s": letters}))
    return path.read_bytes()


def test_pressure_is_learned_with_the_movement(page, drawn):
    for stroke in drawn[:3]:
        page.say("stroke", label="c", points=points_of(stroke, pressure=0.5))
    page.say("settings", use_pressure=True)
    band = page.hear("band", where=lambda band: "pressure" in band["channels"])
    np.testing.assert_allclose(band["channels"]["pressure"]["mean"], 0.5, atol=0.01)
    assert page.ask("play", "playing", "error", speed=4)["names"] == ["x", "y", "pressure"]
    page.hear("played")


def test_two_sessions_do_not_see_each_other(studio, page, drawn):
    with studio.page() as other:
        assert other.state()["session"] != page.session
        page.ask("stroke", "band", label="c", points=points_of(drawn[0]))
        assert other.state()["labels"] == []


def test_a_session_outlives_its_socket(studio, page, drawn):
    page.ask("stroke", "band", label="c", points=points_of(drawn[0]))
    page.socket.close()
    with studio.page(page.session) as again:
        state = again.state()
        assert state["session"] == page.session
        assert state["labels"][0]["name"] == "c"
        assert again.hear("band")["label"] == "c"


def test_a_second_socket_takes_a_session_over(studio, page):
    with studio.page(page.session) as again:
        assert again.state()["session"] == page.session
        assert page.closing_code() == 4001


def test_after_a_restart_the_page_is_told_that_its_session_is_fresh(drawn):
    with RunningStudio() as before:
        with before.page() as page:
            page.state()
            page.ask("stroke", "state", label="c", points=points_of(drawn[0]))
        port, session = before.port, page.session
    with RunningStudio(port=port) as after, after.page(session) as again:
        assert "no longer there" in again.hear("fresh")["text"]
        state = again.state()
        assert (state["labels"], state["session"] != session) == ([], True)


def test_files_of_the_command_line_are_there_when_the_page_opens(drawn):
    with RunningStudio(given={"mine": Contents(list(drawn), {}, None)}) as studio, studio.page() as page:
        (label,) = page.state()["labels"]
        assert (label["name"], len(label["strokes"])) == ("c", len(drawn))
