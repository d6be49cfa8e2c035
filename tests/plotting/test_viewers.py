"""Files for Foxglove and Rerun, read again by the libraries that read them."""

import json
from dataclasses import replace

import numpy as np
import pytest

from probdmp.dmp import task_for
from probdmp.errors import InputError, MissingExtraError
from probdmp.execution import roll_out, smooth_recording, task_of_recording, track_recording
from probdmp.plotting.foxglove import write_mcap
from probdmp.plotting.rerun import write_rrd
from probdmp.plotting.timelines import (
    Event,
    Timelines,
    Track,
    monitored_timelines,
    rollout_timelines,
    smoothing_timelines,
)

STRANGE = "arm/1 'x' µ."
"""A name that would have to be quoted anywhere."""


@pytest.fixture(scope="module")
def planned(primitive, blocked):
    return roll_out(primitive, task_for(primitive, start=blocked.positions[0]), blocked.dt)


@pytest.fixture(scope="module")
def timelines(planned, judged):
    return replace(monitored_timelines(planned, judged, onset=0.4), heading="a, blocked")


@pytest.fixture
def gappy():
    values = np.array([1.0, np.nan, np.inf, -2.0])
    tracks = (
        Track(f"measured/{STRANGE}", np.array([0.0, 0.1, 0.2, 0.3]), {"value": values, "level": np.ones(4)}, "x [m]"),
        Track("measured/nothing", np.array([0.0, 0.1]), {"value": np.full(2, np.nan)}, "nothing"),
    )
    return Timelines(tracks, (Event(0.3, "«off» the path\nby a lot", "error"),))


def told_of(judged):
    """(seconds, text, level) of what is to be told of an execution with a fault at 0.4 s, in the order of time."""
    verdict = judged.verdict
    assert verdict.failed or judged.level is not None, "the calibrated detector notices; the paper's may not"
    level = "error" if verdict.failed else "info"
    return sorted([(0.4, "onset of the fault", "warning"), (verdict.time, str(verdict), level)])


# --- what is shown ----------------------------------------------------------------------------------------------------


def by_name(timelines):
    return {track.name: track for track in timelines.tracks}


def test_monitoring_shows_what_its_picture_shows(timelines, planned, judged):
    tracks = by_name(timelines)
    assert list(tracks) == ["planned/x", "planned/y", "measured/x", "measured/y", "log_likelihood", "test_ratio"]
    for d, name in enumerate("xy"):
        columns = tracks[f"planned/{name}"].columns
        np.testing.assert_array_equal(columns["mean"], planned.positions[:, d])
        np.testing.assert_allclose(columns["upper"] - columns["mean"], 2 * planned.position_stds[:, d], atol=1e-12)
        np.testing.assert_allclose(columns["mean"] - columns["lower"], 2 * planned.position_stds[:, d], atol=1e-12)
        np.testing.assert_array_equal(tracks[f"measured/{name}"].columns["value"], judged.recording.positions[:, d])
        assert tracks[f"planned/{name}"].view == tracks[f"measured/{name}"].view == f"{name} position [mm]"
    np.testing.assert_array_equal(tracks["log_likelihood"].columns["value"], judged.statistic)
    assert ("level" in tracks["log_likelihood"].columns) == (judged.level is not None)
    np.testing.assert_array_equal(tracks["test_ratio"].columns["value"], judged.test_ratios)
    assert set(tracks["test_ratio"].columns["threshold"]) == {1.0}
    assert timelines.events == tuple(Event(*told) for told in told_of(judged))


def test_a_fine_execution_says_so(planned, judged):
    fine = replace(judged, verdict=replace(judged.verdict, failed=False))
    (event,) = monitored_timelines(planned, fine).events
    assert (event.level, event.text) == ("info", str(fine.verdict))


def test_rollouts_and_smoothed_executions_have_their_bands(primitive, blocked, planned):
    tracks = by_name(rollout_timelines(planned))
    assert list(tracks) == [f"{q}/{n}" for q in ("position", "velocity", "acceleration") for n in "xy"]
    np.testing.assert_array_equal(tracks["velocity/y"].columns["mean"], planned.velocities[:, 1])
    assert tracks["acceleration/x"].view == "x acceleration [mm/s²]"
    task = task_of_recording(primitive, blocked)
    filtered, smoothed = track_recording(primitive, task, blocked), smooth_recording(primitive, task, blocked)
    tracks = by_name(smoothing_timelines(blocked, filtered, smoothed))
    assert list(tracks) == [f"{p}/{n}" for p in ("measured", "filtered", "smoothed") for n in "xy"]
    np.testing.assert_array_equal(tracks["filtered/x"].columns["mean"], filtered.positions[:, 0])
    np.testing.assert_array_equal(tracks["smoothed/x"].columns["mean"], smoothed.positions[:, 0])


def test_learned_channels_come_along():
    from probdmp import FailureDetector, ProbabilisticDMP
    from probdmp.demonstrations import synthetic_contacts
    from probdmp.evaluation import judge_execution

    contacts = [contact.demonstration for contact in synthetic_contacts(5, dt=0.03)][:5]
    p = ProbabilisticDMP(5, channels=["force"]).fit(contacts[:4])
    detector = FailureDetector(rule="calibrated").fit(p, contacts[:4])
    judged = judge_execution(detector, p.primitive_, task_for(p.primitive_, start=contacts[4].positions[0]), contacts[4])
    tracks = by_name(monitored_timelines(p.rollout(dt=contacts[4].dt), judged))
    assert set(tracks["planned/force"].columns) == {"mean", "lower", "upper"}
    np.testing.assert_array_equal(tracks["measured/force"].columns["value"], contacts[4].channels["force"])


# --- Foxglove ---------------------------------------------------------------------------------------------------------


def read_mcap(path):
    """Summary, and (nanoseconds, message) of each topic: JSON as dicts, logs as their fields."""
    pytest.importorskip("mcap", reason="needs mcap to read MCAP files: pip install mcap mcap-protobuf-support")
    from mcap.reader import make_reader
    from mcap_protobuf.decoder import DecoderFactory

    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()], validate_crcs=True)
        summary, messages = reader.get_summary(), {}
        heading = [m.metadata["heading"] for m in reader.iter_metadata()]
        for schema, channel, message in reader.iter_messages():
            if channel.message_encoding == "json":
                schema_of = json.loads(schema.data)
                value = json.loads(message.data)
                assert set(value) <= set(schema_of["properties"])
                messages.setdefault(channel.topic, []).append((message.log_time, value))
        for decoded in reader.iter_decoded_messages(topics=["/log"]):
            messages.setdefault("/log", []).append((decoded.message.log_time, decoded.decoded_message))
    return summary, messages, heading


def test_an_mcap_file_holds_what_the_picture_shows(timelines, planned, judged, tmp_path):
    pytest.importorskip("foxglove", reason="needs foxglove-sdk: pip install 'probdmp[foxglove]'")
    path = tmp_path / "monitor.mcap"
    write_mcap(path, timelines)
    summary, messages, heading = read_mcap(path)
    assert heading == ["a, blocked"]
    assert set(messages) == {f"/{track.name}" for track in timelines.tracks} | {"/log"}
    assert summary.statistics.message_count == sum(map(len, messages.values()))
    assert {summary.schemas[c.schema_id].name for c in summary.channels.values() if c.topic == "/log"} == {"foxglove.Log"}
    views = {c.topic: c.metadata.get("view") for c in summary.channels.values()}
    assert (views["/planned/x"], views["/test_ratio"]) == ("x position [mm]", "Test ratio")
    times = np.array([t for t, _ in messages["/planned/y"]])
    np.testing.assert_allclose(times / 1e9, planned.times, atol=1e-9)
    for column in ("mean", "lower", "upper"):
        found = [m[column] for _, m in messages["/planned/y"]]
        np.testing.assert_array_equal(found, by_name(timelines)["planned/y"].columns[column])
    assert [m["value"] for _, m in messages["/measured/x"]] == judged.recording.positions[:, 0].tolist()
    assert {m["threshold"] for _, m in messages["/test_ratio"]} == {1.0}
    assert_values(messages["/log_likelihood"], judged.recording.times, judged.statistic)
    assert_values(messages["/test_ratio"], judged.recording.times, judged.test_ratios)
    levels = {"info": 2, "warning": 3, "error": 4}
    expected = [(round(time * 1e9), text, levels[level], "probdmp") for time, text, level in told_of(judged)]
    assert [(nanoseconds, log.message, log.level, log.name) for nanoseconds, log in messages["/log"]] == expected
    assert [log.timestamp.ToNanoseconds() for _, log in messages["/log"]] == [nanoseconds for nanoseconds, *_ in expected]


def assert_values(messages, times, values):
    known = np.isfinite(values)
    found = [(t, m["value"]) for t, m in messages if "value" in m]
    np.testing.assert_allclose([t / 1e9 for t, _ in found], times[known], atol=1e-9)
    np.testing.assert_array_equal([v for _, v in found], values[known])


def test_what_is_not_known_is_not_in_an_mcap_file(gappy, tmp_path):
    pytest.importorskip("foxglove", reason="needs foxglove-sdk: pip install 'probdmp[foxglove]'")
    write_mcap(tmp_path / "g.mcap", gappy)
    summary, messages, _ = read_mcap(tmp_path / "g.mcap")
    assert messages[f"/measured/{STRANGE}"] == [
        (0, {"value": 1.0, "level": 1.0}),
        (100_000_000, {"level": 1.0}),
        (200_000_000, {"level": 1.0}),
        (300_000_000, {"value": -2.0, "level": 1.0}),
    ]
    assert "/measured/nothing" not in messages
    ((_, log),) = messages["/log"]
    assert log.message == gappy.events[0].text
    assert summary.statistics.message_count == 5


# --- Rerun ------------------------------------------------------------------------------------------------------------


def read_rrd(path):
    """(nanoseconds, values) of each entity, and (nanoseconds, text, level) of the log."""
    from rerun.chunk import RrdReader

    reader, scalars, log = RrdReader(path), {}, []
    (recording,), (_blueprint,) = reader.recordings(), reader.blueprints()
    assert recording.application_id == "probdmp"
    for chunk in reader.stream(store=recording).to_chunks():
        if chunk.is_static:
            continue
        assert chunk.timeline_names == ["time"]
        batch = chunk.to_record_batch()
        nanoseconds = batch.column("time").cast("int64").to_pylist()
        if chunk.entity_path == "/log":
            columns = [[item for (item,) in batch.column(f"TextLog:{name}").to_pylist()] for name in ("text", "level")]
            log += zip(nanoseconds, *columns, strict=True)
        else:
            values = [item for (item,) in batch.column("Scalars:scalars").to_pylist()]
            old = scalars.get(chunk.entity_path, ([], []))
            scalars[chunk.entity_path] = (old[0] + nanoseconds, old[1] + values)
    return scalars, sorted(log)


def test_an_rrd_file_holds_what_the_picture_shows(timelines, judged, tmp_path):
    pytest.importorskip("rerun", reason="needs rerun-sdk: pip install 'probdmp[rerun]'")
    path = tmp_path / "monitor.rrd"
    write_rrd(path, timelines)
    scalars, log = read_rrd(path)
    assert set(scalars) == {f"/{track.name}/{column}" for track in timelines.tracks for column in track.columns}
    for track in timelines.tracks:
        for column, values in track.columns.items():
            nanoseconds, found = scalars[f"/{track.name}/{column}"]
            known = np.isfinite(values)
            np.testing.assert_allclose(np.array(nanoseconds) / 1e9, track.times[known], atol=1e-9)
            np.testing.assert_array_equal(found, values[known])
    levels = {"info": "INFO", "warning": "WARN", "error": "ERROR"}
    assert log == [(round(time * 1e9), text, levels[level]) for time, text, level in told_of(judged)]


def test_what_is_not_known_is_not_in_an_rrd_file(gappy, tmp_path):
    pytest.importorskip("rerun", reason="needs rerun-sdk: pip install 'probdmp[rerun]'")
    write_rrd(tmp_path / "g.rrd", gappy)
    scalars, log = read_rrd(tmp_path / "g.rrd")
    (value,) = [values for path, values in scalars.items() if path.endswith("/value")]
    assert value == ([0, 300_000_000], [1.0, -2.0])
    assert len(scalars) == 2
    assert log == [(300_000_000, gappy.events[0].text, "ERROR")]


def test_rerun_itself_finds_nothing_wrong(timelines, tmp_path):
    pytest.importorskip("rerun", reason="needs rerun-sdk: pip install 'probdmp[rerun]'")
    import subprocess
    import sys

    write_rrd(tmp_path / "m.rrd", timelines)
    command = [sys.executable, "-m", "rerun", "rrd", "verify", str(tmp_path / "m.rrd")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    assert "1 file verified without error" in done.stdout + done.stderr


def test_rerun_switched_off_is_an_error_not_an_empty_file(gappy, tmp_path, monkeypatch):
    rerun = pytest.importorskip("rerun", reason="needs rerun-sdk: pip install 'probdmp[rerun]'")
    monkeypatch.setattr(rerun, "is_enabled", lambda stream: False)
    with pytest.raises(InputError, match="Unset the variable RERUN"):
        write_rrd(tmp_path / "g.rrd", gappy)
    assert not list(tmp_path.iterdir())


# --- both -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("module", "extra", "write"), [("foxglove", "foxglove", write_mcap), ("rerun", "rerun", write_rrd)])
def test_without_the_library_it_says_what_to_type(module, extra, write, gappy, tmp_path, monkeypatch):
    monkeypatch.setattr(f"probdmp.plotting.{module}.find_spec", lambda name: None)
    with pytest.raises(MissingExtraError, match=rf"pip install 'probdmp\[{extra}\]'"):
        write(tmp_path / "p", gappy)


@pytest.mark.parametrize(("library", "write"), [("foxglove", write_mcap), ("rerun", write_rrd)])
def test_nothing_but_a_file_is_replaced_and_files_are_replaced_whole(library, write, gappy, tmp_path):
    pytest.importorskip(library, reason=f"needs the extra {library}: pip install 'probdmp[{library}]'")
    with pytest.raises(InputError, match="not a regular file"):
        write(tmp_path, gappy)
    path = tmp_path / "old"
    path.write_bytes(b"old" * 10**6)
    write(path, gappy)
    assert not path.read_bytes().startswith(b"old")
    assert [p.name for p in tmp_path.iterdir()] == ["old"]
