"""Message by message: what a page says, and what it is told."""

import io
import json
import struct
import zipfile
from dataclasses import replace

import numpy as np
import pytest
from studio_page import RunningStudio, points_of

from probdmp import FailureDetector, PrimitiveLibrary, ProbabilisticDMP, load, read_demonstrations, write_demonstrations
from probdmp.demonstrations import FAULTS, LETTERS, synthetic_letters
from probdmp.dmp import task_for
from probdmp.estimator import load_detector
from probdmp.execution import planned_recording
from probdmp.plotting.trajectories import band_edges
from probdmp.studio.jobs import Contents
from probdmp.studio.limits import DT
from probdmp.studio.strokes import stroke_of

SHORTENED = 6e-5
"""Of numbers that a page is told with five digits, the relative error."""


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
    np.testing.assert_allclose(band["times"], planned.times, rtol=SHORTENED)
    np.testing.assert_allclose(band["path"]["mean"], planned.positions, rtol=SHORTENED)
    lower, upper = band_edges(planned.velocities, planned.velocity_stds)
    np.testing.assert_allclose(band["velocity"]["lower"], lower, rtol=SHORTENED)
    np.testing.assert_allclose(band["velocity"]["upper"], upper, rtol=SHORTENED)
    np.testing.assert_allclose(band["acceleration"]["mean"], planned.accelerations, rtol=SHORTENED, atol=1e-9)
    assert band["change"] == ""
    page.say("stroke", label="c", points=points_of(drawn[1]))
    assert page.hear("band")["change"].startswith("the second demonstration moved the mean by")


def test_an_example_shows_everything_by_one_click(page):
    page.say("example", name="a")
    band = page.hear("band")
    assert band["label"] == "a"
    assert {"phase", "mean", "lower", "upper"} == set(band["forcing"])
    assert all(len(ellipse) == 5 for ellipse in band["tube"])
    assert np.min(band["path"]["mean"]) >= 0
    assert np.max(band["path"]["mean"]) <= 100
    state = page.hear("state", where=lambda state: state["calibration"] and state["calibration"]["n"])
    assert state["calibration"]["n"] == 10
    assert state["calibration"]["attainable"] == pytest.approx(1 / 11, rel=SHORTENED)
    assert len(state["labels"][0]["strokes"]) == 10


def test_labels_are_added_renamed_selected_deleted(page, drawn):
    def becomes(selected, **strokes):
        """What the state says in the end; others may be under way."""
        known = {name.replace("one", "<b>one</b>"): count for name, count in strokes.items()}
        page.hear(
            "state",
            where=lambda state: (
                state["selected"] == selected and {one["name"]: len(one["strokes"]) for one in state["labels"]} == known
            ),
        )

    page.say("add_label", label="<b>one</b>")
    page.say("stroke", label="two", points=points_of(drawn[0]))
    becomes("two", one=0, two=1)
    page.hear("band")
    page.say("select", label="<b>one</b>")
    becomes("<b>one</b>", one=0, two=1)
    page.say("rename_label", label="two", to="three")
    becomes("<b>one</b>", one=0, three=1)
    assert page.hear("band")["label"] == "three"
    page.say("delete_stroke", label="three", index=0)
    becomes("<b>one</b>", one=0, three=0)
    page.say("delete_label", label="three")
    becomes("<b>one</b>", one=0)


def test_settings_change_what_is_learned(taught, drawn):
    state = taught.ask("settings", "state", n_basis=12, variant="as_published")
    assert state["settings"]["n_basis"] == 12
    band = taught.hear("band")
    strokes = as_taught(drawn)[1]
    published = ProbabilisticDMP.as_published(12).fit(strokes).rollout()
    np.testing.assert_allclose(band["path"]["mean"], published.positions, rtol=SHORTENED)


def test_alpha_alone_calibrates_without_learning(taught):
    taught.ask("settings", "state", alpha=0.2)
    taught.hear("state", where=lambda state: state["calibration"]["alpha"] == 0.2)


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


def test_playing_is_undisturbed_and_what_is_shown_is_what_the_library_says(taught, drawn, monkeypatch):
    monkeypatch.setattr("probdmp.studio.room.secrets.randbits", lambda bits: 7)
    playing = taught.ask("play", "playing", speed=0.6)
    assert playing["names"] == ["x", "y"]
    assert playing["threshold"] == 1.0
    assert taught.hear("played")["completed"]
    learned, strokes = as_taught(drawn)
    execution = learned.execute(detector=FailureDetector(0.01).fit({"c": learned}, {"c": strokes}))
    primitive = learned.primitive_
    read = planned_recording(primitive, task_for(primitive), DT, np.random.default_rng(7)).positions
    ticks = [(step.time, step.position.copy(), step.contributions.copy()) for step in map(execution.step, read)]
    shown = [rows_of(frame) for frame in taught.frames]
    assert shown
    sequence = [head["sequence"] for head, _ in shown]
    assert sequence == sorted(set(sequence))
    for head, rows in shown:  # all that came, however many were left out
        k = round((head["time"] - ticks[0][0]) / DT)
        time, position, contributions = ticks[k]
        assert (head["kind"], head["flags"] & 1) == (1, 0)
        assert head["time"] == pytest.approx(time, abs=1e-5)
        np.testing.assert_allclose(rows[0], read[k], rtol=1e-5)
        np.testing.assert_allclose(rows[1], position, rtol=1e-5)
        np.testing.assert_allclose(rows[3], contributions, atol=1e-3)


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
    x, y = rows_of(taught.watch(20)[-1])[1][0].tolist()
    taught.say("pointer", mode="hold", x=x, y=y)
    verdict = taught.hear("verdict")
    assert verdict["failed"]
    taught.ask("pointer", "verdict", "played", mode="none")


def test_the_cause_is_told_as_soon_as_it_is_known(taught):
    """It is looked into for some ticks after the alarm, while the pen is still held."""
    taught.ask("play", "playing", speed=0.5)
    x, y = rows_of(taught.watch(20)[-1])[1][0].tolist()
    taught.say("pointer", mode="hold", x=x, y=y)
    told = taught.hear("verdict", where=lambda verdict: verdict["cause"] == "held")
    assert "final" not in told
    taught.watch(20)  # each a tick or more: until then it is looked into
    taught.say("pointer", mode="none")
    final = taught.hear("verdict", where=lambda verdict: verdict.get("final"))
    assert (final["cause"], final["time"]) == ("held", told["time"])


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
    assert replayed["verdict"]["test_ratio"] == pytest.approx(verdict.test_ratio, rel=SHORTENED)
    assert replayed["verdict"]["text"] == str(verdict)
    assert len(replayed["times"]) == len(replayed["test_ratios"]) == strokes[3].n_samples
    compared = taught.ask("compare", "compared", "error", label="c", index=3)
    np.testing.assert_allclose(compared["smoothed"]["mean"], learned.smooth(strokes[3]).positions, rtol=SHORTENED)
    tracked = learned.track(strokes[3])
    _, upper = band_edges(tracked.positions, tracked.position_stds)
    np.testing.assert_allclose(compared["filtered"]["upper"], upper, rtol=SHORTENED)


def test_commands_do_the_same_again(taught, tmp_path, monkeypatch):
    commands = taught.ask("export_commands", "commands")
    assert "probdmp fit demonstrations.npz" in commands["shell"]
    with taught.studio.http() as http:
        (tmp_path / "demonstrations.npz").write_bytes(http.get(f"/download/{taught.session}/demonstrations.npz").content)
    monkeypatch.chdir(tmp_path)
    names = {}
    exec(commands["python"], names)  # what the page lets one copy
    np.testing.assert_allclose(
        names["planned"].positions, taught.ask("task", "band", start=None)["path"]["mean"], rtol=SHORTENED
    )


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
def of_a_robot():
    """Ten recordings in millimetres, far from the canvas, with names of their own."""
    letters = synthetic_letters(10, letters="c", dt=0.01)
    around = {"names": ("x", "y"), "units": "mm"}
    return [replace(d, positions=20 * d.positions + np.array([400.0, -150.0]), **around) for d in letters]


def test_what_comes_in_millimetres_is_saved_in_millimetres(page, of_a_robot, tmp_path):
    write_demonstrations(tmp_path / "robot.npz", of_a_robot)
    with page.studio.http() as http:
        reply = http.post(f"/upload/{page.session}?name=robot.npz", content=(tmp_path / "robot.npz").read_bytes())
        assert "to fit the canvas; kept and saved in its own unit" in reply.json()["imported"]["note"]
        state = page.hear("state", where=lambda state: state["calibration"] and state["calibration"]["n"])
        band = page.ask("select", "band", label="c")
        for name in ("demonstrations.csv", "model.probdmp"):
            (tmp_path / name).write_bytes(http.get(f"/download/{page.session}/{name}").content)
    saved = read_demonstrations(tmp_path / "demonstrations.csv")
    assert {(d.units, d.names) for d in saved} == {("mm", ("x", "y"))}
    np.testing.assert_allclose(saved[3].positions, of_a_robot[3].positions, rtol=1e-12)
    verdicts = load_detector(tmp_path / "model.probdmp").verdicts(of_a_robot)
    assert not any(verdict.failed for verdict in verdicts)
    (label,) = state["labels"]
    assert (band["units"], label["origin"]["units"]) == ("mm", "mm")
    shown = label["origin"]["scale"] * np.array(band["path"]["mean"]) + label["origin"]["shift"]
    assert np.all((shown > 0) & (shown < [100, 75]))


def test_strokes_in_millimetres_are_taught_again_as_such(studio, page, of_a_robot, tmp_path):
    write_demonstrations(tmp_path / "robot.npz", of_a_robot)
    with page.studio.http() as http:
        http.post(f"/upload/{page.session}?name=robot.npz", content=(tmp_path / "robot.npz").read_bytes())
    (label,) = page.hear("state", where=lambda state: state["labels"])["labels"]
    with studio.page() as other:
        points = label["strokes"][0]["points"]
        band = other.ask("stroke", "band", "error", label="c", points=[[*row, None] for row in points], origin=label["origin"])
        assert band["units"] == "mm"
        assert other.state()["labels"][0]["origin"] == label["origin"]
        error = other.ask("stroke", label="c", points=points_of(of_a_robot[0]), origin=label["origin"] | {"units": "m"})
        assert (error["expected"], error["got"]) == ("recordings of 'c' as those that are there, x, y in mm", "x, y in m")
        assert "canvas" in other.ask("example", "error", name="c")["got"]
        for broken in ({}, label["origin"] | {"scale": 0}, label["origin"] | {"shift": [1e300, 0]}, {"names": [1, 2]}):
            other.ask("stroke", "error", label="d", points=points_of(of_a_robot[0]), origin=broken)


def test_a_file_whose_unit_is_another_than_the_letters_is_not_taken_in_part(page, drawn, of_a_robot, tmp_path):
    page.ask("stroke", "band", label="z", points=points_of(drawn[0]))
    write_demonstrations(tmp_path / "robot.npz", [of_a_robot[0], replace(of_a_robot[1], label="z")])
    with page.studio.http() as http:
        reply = http.post(f"/upload/{page.session}?name=robot.npz", content=(tmp_path / "robot.npz").read_bytes())
    assert reply.status_code == 400
    assert reply.json()["error"]["expected"] == "recordings of 'z' as those that are there, x, y in units of the canvas"
    assert [(one["name"], len(one["strokes"])) for one in page.state()["labels"]] == [("z", 1)]


def test_letters_of_several_units_are_saved_in_several_files(page, drawn, of_a_robot, tmp_path):
    page.ask("stroke", "band", label="drawn", points=points_of(drawn[0]))
    write_demonstrations(tmp_path / "robot.npz", of_a_robot)
    with page.studio.http() as http:
        http.post(f"/upload/{page.session}?name=robot.npz", content=(tmp_path / "robot.npz").read_bytes())
        refused = http.get(f"/download/{page.session}/demonstrations.npz")
        assert (refused.status_code, "session.zip" in refused.json()["error"]["hint"]) == (409, True)
        archive = zipfile.ZipFile(io.BytesIO(http.get(f"/download/{page.session}/session.zip").content))
    archive.extractall(tmp_path / "all")
    parts = [read_demonstrations(tmp_path / "all" / name) for name in ("demonstrations.npz", "demonstrations-2.npz")]
    assert [(len(part), part[0].units) for part in parts] == [(1, ""), (10, "mm")]


def test_without_matplotlib_a_session_is_saved_without_pictures(taught, monkeypatch):
    monkeypatch.setattr("probdmp.plotting.style.find_spec", lambda name: None)
    assert taught.state()["pictures_missing"] == "Type: pip install 'probdmp[plot]'"
    with taught.studio.http() as http:
        reply = http.get(f"/download/{taught.session}/session.zip")
    inside = set(zipfile.ZipFile(io.BytesIO(reply.content)).namelist())
    assert inside == {"demonstrations.npz", "demonstrations.csv", "model.probdmp", "commands.txt"}


def test_an_opened_model_is_shown_at_once(page, of_a_robot, tmp_path):
    learned = ProbabilisticDMP(n_basis=10).fit(of_a_robot)
    PrimitiveLibrary({"c": learned}).save(tmp_path / "m.probdmp", FailureDetector().fit({"c": learned}, {"c": of_a_robot}))
    with page.studio.http() as http:
        reply = http.post(f"/upload/{page.session}?name=m.probdmp", content=(tmp_path / "m.probdmp").read_bytes())
        assert reply.json()["imported"]["labels"] == {"c": 0}
    band = page.hear("band")
    assert (band["label"], band["units"]) == ("c", "mm")
    state = page.state()
    assert state["selected"] == "c"
    assert state["labels"][0]["origin"]["scale"] != 1


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


def test_what_is_shown_of_a_stroke_teaches_it_again(studio, page, drawn):
    page.say("stroke", label="c", points=points_of(drawn[0], pressure=0.5))
    ((shown,),) = [one["strokes"] for one in page.hear("state")["labels"]]
    with studio.page() as other:
        other.ask("stroke", "band", label="c", points=shown["points"])
        with studio.http() as http:
            bodies = [http.get(f"/download/{one.session}/demonstrations.csv").text for one in (page, other)]
    first, second = (np.genfromtxt(io.StringIO(body), delimiter=",", names=True) for body in bodies)
    assert "pressure" in first.dtype.names
    for name in ("x", "y", "pressure"):
        np.testing.assert_allclose(second[name], first[name], rtol=SHORTENED)


def test_messages_are_no_longer_than_a_picture_needs(page):
    page.say("example", name="a")
    longest = {"state": 0, "band": 0}
    while not (longest["band"] and longest["state"]):
        message = page.hear("state", "band")
        longest[message["type"]] = len(json.dumps(message, separators=(",", ":")))
    assert longest["band"] < 60_000
    assert longest["state"] < 40_000


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
