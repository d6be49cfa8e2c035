"""Learned channels and sensors on the command line: a planar arm with encoders, a camera, and a pen that feels."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from probdmp import PrimitiveLibrary, ProbabilisticDMP, load, load_detector, read_demonstrations, write_demonstrations
from probdmp.cli.sensor_file import read_sensor_file
from probdmp.demonstrations import Demonstration, hold
from probdmp.errors import DataFileError
from probdmp.execution import PlanarArm, SensorArray, planar_arm_sensor, sensors_as_plain, state_sensor

ARM = PlanarArm([0.4, 0.3])
SENSORS = """
[[sensor]]
name = "encoder"
measures = "position"
stds = 0.002
outputs = ["enc_1", "enc_2"]
gate = 5

[[sensor]]
name = "camera"
kind = "planar_arm"
link_lengths = [0.4, 0.3]
stds = [0.005, 0.005]
"""
OUTPUTS = ["enc_1", "enc_2", "camera_x", "camera_y", "pen_force"]


def reach(seed):
    """Two joints go their way in about 0.8 s; the further they go, the harder the pen presses."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(38, 44))
    s = np.linspace(0, 1, n)
    profile = 10 * s**3 - 15 * s**4 + 6 * s**5
    size = 1 + 0.1 * rng.standard_normal()
    q = [0.3, 0.5] + size * profile[:, None] * [0.8, -0.6] + 0.02 * rng.standard_normal() * np.sin(np.pi * s)[:, None]
    tool = ARM(q) + 0.005 * rng.standard_normal((n, 2))
    encoder = q + 0.002 * rng.standard_normal((n, 2))
    force = size * (1 + np.sin(np.pi * s)) + 0.02 * rng.standard_normal(n)
    channels = {"enc_1": encoder[:, 0], "enc_2": encoder[:, 1], "camera_x": tool[:, 0], "camera_y": tool[:, 1]}
    noisy = q + 0.002 * rng.standard_normal((n, 2))
    return Demonstration(noisy, 0.02, "reach", ("q1", "q2"), "rad", {**channels, "pen_force": force})


def with_channels(recording, **changes):
    return replace(recording, channels={**recording.channels, **changes})


@pytest.fixture(scope="module")
def reaches():
    return [reach(seed) for seed in range(6)]


@pytest.fixture(scope="module")
def arm(tmp_path_factory, reaches, run):
    """Files: reach.npz, sensors.toml; channel.probdmp (pen_force alone) and sensed.probdmp (both sensors too)."""
    place = tmp_path_factory.mktemp("arm")
    write_demonstrations(place / "reach.npz", reaches)
    (place / "sensors.toml").write_text(SENSORS)
    common = ("fit", place / "reach.npz", "--n-basis", 6, "--channels", "pen_force", "--false-alarm-rate", 0.2)
    assert run(*common, "-o", place / "channel.probdmp").exit_code == 0
    result = run(*common, "-o", place / "sensed.probdmp", "--sensors", place / "sensors.toml")
    assert (result.exit_code, result.stderr) == (0, "")
    return place


@pytest.fixture(scope="module")
def learned(arm):
    return PrimitiveLibrary.load(arm / "sensed.probdmp")["reach"]


@pytest.fixture(scope="module")
def sensors(learned):
    encoder = state_sensor(learned.primitive_, "encoder", "position", 0.002, ["enc_1", "enc_2"], 5)
    return [encoder, planar_arm_sensor("camera", [0.4, 0.3], 0.005)]


# --- learning ---------------------------------------------------------------------------------------------------------


def test_fit_learns_channels_as_the_library_does(arm, reaches, learned):
    expected = ProbabilisticDMP(6, channels=["pen_force"]).fit(reaches).primitive_
    assert learned.primitive_.identity == expected.identity
    assert learned.get_params()["channels"] == ("pen_force",)


def test_fit_takes_a_coupling(arm, run_json, tmp_path, reaches):
    arguments = ("fit", arm / "reach.npz", "-o", tmp_path / "m.probdmp", "--n-basis", 6, "--coupling", "none")
    document = run_json(*arguments, "--channels", "pen_force", "--rule", "paper")
    assert document["primitives"][0]["configuration"]["coupling"] == "none"
    expected = ProbabilisticDMP(6, channels=["pen_force"], coupling="none").fit(reaches).primitive_
    assert load(tmp_path / "m.probdmp").primitive_.identity == expected.identity


def test_inspect_shows_channels_coupling_and_sensors(arm, run, run_json, learned, sensors):
    document = run_json("inspect", arm / "sensed.probdmp")
    (summary,) = document["primitives"]
    own = learned.primitive_.channels
    assert summary["channels"]["pen_force"] == {
        "sensor_noise_std": np.sqrt(own.observation_variances[0]),
        "residual_std": np.sqrt(own.residual_variances[0]),
        "range": own.ranges[0],
    }
    assert summary["settings"]["channels"] == ["pen_force"]
    assert document["detector"]["sensors"] == sensors_as_plain(sensors)
    shown = run("inspect", arm / "sensed.probdmp", env={"COLUMNS": "300"}).stdout
    for words in ("coupling full", "channel noise", "pen_force 0.0", "encoder (enc_1, enc_2), camera (camera_x, camera_y)."):
        assert words in shown
    bare = run_json("inspect", arm / "channel.probdmp")
    assert bare["detector"]["sensors"] is None
    assert "Sensors of executions" not in run("inspect", arm / "channel.probdmp").stdout


def test_models_without_channels_say_so(folder, run, run_json):
    assert {str(p["channels"]) for p in run_json("inspect", folder / "letters.probdmp")["primitives"]} == {"{}"}
    assert "channel noise" not in run("inspect", folder / "letters.probdmp").stdout


def test_the_detector_is_calibrated_with_the_sensors(arm, sensors):
    detector = load_detector(arm / "sensed.probdmp")
    assert sensors_as_plain(detector.sensors_) == sensors_as_plain(sensors)
    assert load_detector(arm / "channel.probdmp").sensors_ is None


@pytest.mark.parametrize(
    ("options", "code", "message"),
    [
        (("--channels", "grip"), 3, "expected demonstrations with the channels 'grip' for 'reach', got one with 'enc_1'"),
        (("--channels", "pen_force,pen_force"), 2, "different names in channels"),
        (("--channels", "pen_force", "--published"), 2, 'weight_model="hierarchical" with channels'),
        (
            ("--channels", "pen_force", "--weight-uncertainty", "independent", "--rule", "paper"),
            2,
            "--weight-uncertainty joint with --channels",
        ),
        (("--coupling", "half"), 2, "coupling to be one of 'auto', 'full', 'none', got 'half'"),
        (("--sensors", "nowhere.toml"), 3, "a readable file at 'nowhere.toml', got no such file"),
    ],
)
def test_what_cannot_be_learned(options, code, message, arm, run, tmp_path):
    result = run("fit", arm / "reach.npz", "-o", tmp_path / "m.probdmp", "--n-basis", 6, *options)
    assert (result.exit_code, result.stdout, result.stderr.count("\n")) == (code, "", 1)
    assert message in result.stderr
    assert not (tmp_path / "m.probdmp").exists()


def test_sensors_have_to_be_those_of_all_movements(run, tmp_path, reaches):
    write_demonstrations(tmp_path / "d.npz", [*reaches[:3], *(replace(d, label="back") for d in reaches[3:])])
    (tmp_path / "s.toml").write_text('[[sensor]]\nname = "pen_force"\ngate = 4\n' + SENSORS)
    arguments = ("fit", tmp_path / "d.npz", "-o", tmp_path / "m.probdmp", "--n-basis", 5, "--channels", "pen_force")
    result = run(*arguments, "--sensors", tmp_path / "s.toml", "--rule", "paper")
    assert result.exit_code == 3
    assert "the same sensors for all movements" in result.stderr
    assert "channels need stds of their own" in result.stderr
    (tmp_path / "s.toml").write_text('[[sensor]]\nname = "pen_force"\nstds = 0.02\n' + SENSORS)
    assert run(*arguments, "--sensors", tmp_path / "s.toml", "--rule", "paper").exit_code == 0


# --- trajectories -----------------------------------------------------------------------------------------------------


def assert_channels(document, trajectory):
    assert document["channels"].keys() == {"pen_force"}
    for key in ("means", "stds"):
        expected = getattr(trajectory.channels["pen_force"], key)
        np.testing.assert_array_equal(document["channels"]["pen_force"][key], expected)


def test_channels_are_planned(arm, run, run_json, learned, tmp_path):
    document = run_json("rollout", arm / "channel.probdmp", "-o", tmp_path / "r.npz")
    assert_channels(document, learned.rollout())
    with np.load(tmp_path / "r.npz") as saved:
        np.testing.assert_array_equal(saved["channels/pen_force/stds"], document["channels"]["pen_force"]["stds"])
    shown = run("rollout", arm / "channel.probdmp").stdout
    assert "pen_force" in shown
    assert shown.count("±") == 12 * 3 + 1


def test_channels_are_tracked_and_smoothed_without_being_asked_for(arm, run_json, learned, reaches):
    document = run_json("track", arm / "channel.probdmp", arm / "reach.npz", "--index", 2)
    assert_channels(document, learned.track(reaches[2]))
    assert document["outputs"] == ["q1", "q2", "pen_force"]
    assert document["sensors"].keys() == {"position", "pen_force"}
    assert_channels(run_json("smooth", arm / "channel.probdmp", arm / "reach.npz", "--index", 2), learned.smooth(reaches[2]))


def test_track_with_sensors_is_that_of_the_library(arm, run_json, learned, sensors, reaches, tmp_path):
    wild = with_channels(reaches[1], enc_1=np.where(np.arange(reaches[1].n_samples) == 9, 5.0, reaches[1].channels["enc_1"]))
    write_demonstrations(tmp_path / "wild.npz", [wild])
    arguments = (arm / "sensed.probdmp", tmp_path / "wild.npz", "--sensors", arm / "sensors.toml", "-o", tmp_path / "t.npz")
    document, tracked = run_json("track", *arguments), learned.track(wild, sensors=sensors)
    for name in ("positions", "position_stds", "log_likelihoods", "contributions", "innovations", "innovation_variances"):
        np.testing.assert_array_equal(np.array(document[name], dtype=float), getattr(tracked, name))
    assert document["outputs"] == OUTPUTS
    for name, track in tracked.sensors.items():
        told = document["sensors"][name]
        np.testing.assert_array_equal(np.array(told["test_ratios"], dtype=float), track.test_ratios)
        assert (told["fused"], told["rejected"]) == (track.fused.tolist(), track.rejected.tolist())
        counts = (told["n_fused"], told["n_rejected"], told["n_missing"])
        assert counts == (track.n_fused, track.n_rejected, track.n_missing)
    assert document["sensors"]["encoder"]["outputs"] == OUTPUTS[:2]
    assert document["sensors"]["encoder"]["n_rejected"] == 1
    assert document["sensors"]["encoder"]["test_ratios"][9] > 1
    with np.load(tmp_path / "t.npz") as saved:
        assert saved["outputs"].tolist() == OUTPUTS
        assert saved["sensors/encoder/rejected"].tolist() == document["sensors"]["encoder"]["rejected"]
        assert saved["sensors/camera/n_fused"] == wild.n_samples


def test_track_shows_what_became_of_readings_unless_positions_are_all(arm, folder, run):
    shown = run("track", arm / "sensed.probdmp", arm / "reach.npz", "--sensors", arm / "sensors.toml").stdout
    assert re.search(r"encoder\s+enc_1\s+\d+\s+0\s+0\s+\d\.\d\d", shown)
    assert "rejected" in shown
    assert "rejected" not in run("track", folder / "c.probdmp", folder / "letters.npz").stdout


def test_smooth_with_sensors_is_that_of_the_library(arm, run_json, learned, sensors, reaches):
    arguments = (arm / "sensed.probdmp", arm / "reach.npz", "--sensors", arm / "sensors.toml", "--index", 3)
    document = run_json("smooth", *arguments)
    np.testing.assert_array_equal(document["positions"], learned.smooth(reaches[3], sensors=sensors).positions)


@pytest.mark.parametrize("suffix", ["npz", "csv"])
def test_recordings_of_a_sensor_alone_need_no_positions(suffix, arm, run_json, learned, sensors, reaches, tmp_path):
    """What the camera sees tells where the joints are."""
    d = reaches[4]
    seen = Demonstration(
        np.column_stack([d.channels["camera_x"], d.channels["camera_y"]]), d.dt, "", ("camera_x", "camera_y"), "m"
    )
    write_demonstrations(tmp_path / f"seen.{suffix}", [seen])
    (tmp_path / "camera.toml").write_text(SENSORS[SENSORS.rindex("[[sensor]]") :])
    document = run_json(
        "track", arm / "sensed.probdmp", tmp_path / f"seen.{suffix}", "--sensors", tmp_path / "camera.toml"
    )  # fmt: skip
    positions = np.full((d.n_samples, 2), np.nan)
    alone = Demonstration(positions, d.dt, names=("q1", "q2"), channels={k: d.channels[k] for k in ("camera_x", "camera_y")})
    np.testing.assert_allclose(document["positions"], learned.track(alone, sensors=sensors[1:]).positions, atol=1e-9)
    np.testing.assert_allclose(document["positions"][-1], d.positions[-1], atol=0.1)
    assert document["sensors"]["pen_force"]["n_missing"] == d.n_samples


def test_recordings_without_the_columns_of_a_sensor_are_refused(arm, run, reaches, tmp_path):
    bare = replace(reaches[0], channels={"enc_1": reaches[0].channels["enc_1"]})
    write_demonstrations(tmp_path / "bare.npz", [bare])
    result = run("track", arm / "sensed.probdmp", tmp_path / "bare.npz", "--sensors", arm / "sensors.toml")
    assert result.exit_code == 3
    assert "recordings with the columns enc_1, enc_2 of sensor 'encoder', got one without enc_2" in result.stderr
    write_demonstrations(tmp_path / "other.npz", [Demonstration(reaches[0].positions, 0.02, names=("a", "b"))])
    result = run("track", arm / "sensed.probdmp", tmp_path / "other.npz", "--sensors", arm / "sensors.toml")
    assert result.exit_code == 3
    assert "columns to be different ones of 'a', 'b'" in result.stderr


def test_positions_that_a_sensor_measures_have_to_be_there(arm, run, reaches, tmp_path):
    """Or a joint whose column is misspelt would be watched no more, and nobody would know."""
    half = Demonstration(reaches[0].positions[:, :1], 0.02, names=("q1",), units="rad", channels=reaches[0].channels)
    write_demonstrations(tmp_path / "half.npz", [half])
    (tmp_path / "both.toml").write_text('[[sensor]]\nname = "position"\nmeasures = "position"\nstds = 0.002\n' + SENSORS)
    for verb, more in (("track", ("--sensors", tmp_path / "both.toml")), ("track", ()), ("monitor", ())):
        result = run(verb, arm / "channel.probdmp", tmp_path / "half.npz", *more)
        assert result.exit_code == 3
        assert "columns to be different ones of" in result.stderr
    assert run("track", arm / "channel.probdmp", tmp_path / "half.npz", "--sensors", arm / "sensors.toml").exit_code == 0


# --- monitoring -------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def executions(arm, reaches):
    """As recorded, blocked half-way with all its sensors, and with a pen that presses no more."""
    d = reaches[0]
    blocked = hold(np.column_stack([d.positions, *d.channels.values()]), d.n_samples // 2, np.random.default_rng(0))
    names = list(d.channels)
    blocked = replace(d, positions=blocked[:, :2], channels=dict(zip(names, blocked[:, 2:].T, strict=True)))
    late = np.arange(d.n_samples) > d.n_samples // 2
    noise = 0.02 * np.random.default_rng(1).standard_normal(d.n_samples)  # or the sensor would seem to be stuck
    loose = with_channels(d, pen_force=np.where(late, noise, d.channels["pen_force"]))
    write_demonstrations(arm / "executions.npz", [d, blocked, loose])
    return [d, blocked, loose]


@pytest.mark.parametrize("model", ["channel", "sensed"])
def test_verdicts_are_those_of_the_library(model, arm, run_json, executions):
    path = arm / f"{model}.probdmp"
    document = run_json("monitor", path, arm / "executions.npz", exit_code=4)
    verdicts = load_detector(path).verdicts(executions)
    assert [e["failed"] for e in document["executions"]] == [v.failed for v in verdicts] == [False, True, True]
    for told, verdict in zip(document["executions"], verdicts, strict=True):
        assert told["test_ratio"] == verdict.test_ratio
        assert told["contributions"] == dict(zip(verdict.names, verdict.contributions.tolist(), strict=True))
    assert document["executions"][2]["kind"] == "channel"


def stream_of(recording, readings):
    """JSON lines; `readings` gives the rest of each tick."""
    return "".join(json.dumps(readings(t)) + "\n" for t in range(recording.n_samples))


def tick_of(recording, t):
    c = {name: values[t] for name, values in recording.channels.items()}
    named = {"encoder": [c["enc_1"], c["enc_2"]], "camera": [c["camera_x"], c["camera_y"]], "pen_force": c["pen_force"]}
    return {"sensors": named}


@pytest.mark.parametrize("k", range(3))
def test_json_lines_with_sensors_are_the_execution_of_the_library(k, arm, run, executions, learned):
    d = executions[k]
    start = ("--start", ",".join(map(repr, d.positions[0].tolist())))
    result = run("monitor", arm / "sensed.probdmp", "-", "--dt", d.dt, *start, text=stream_of(d, lambda t: tick_of(d, t)))
    detector = load_detector(arm / "sensed.probdmp")
    execution = learned.execute(start=d.positions[0], dt=d.dt, detector=detector)
    for t, line in enumerate(result.stdout.splitlines()):
        answer, step = json.loads(line), execution.step(tick_of(d, t)["sensors"])
        assert answer["position"] == step.position.tolist()
        assert (answer["log_likelihood"], answer["failed"]) == (step.log_likelihood, execution.failed)
    assert result.exit_code == (4 if execution.failed else 0)
    assert execution.failed is detector.verdicts([d])[0].failed
    assert set(answer) == {
        *("time", "position", "velocity", "acceleration", "log_likelihood", "test_ratio", "failed"),
        *("kind", "cause", "better", "is_stale", "has_sensor_fault"),
    }


def test_positions_stand_beside_channels(arm, run, executions):
    """Wherever the position stands; what is measured under the name of a degree of freedom is where it starts."""
    d = executions[2]
    force = d.channels["pen_force"]

    def beside(t):
        return {"position": d.positions[t].tolist(), "sensors": {"pen_force": force[t]}}

    def within(t):
        return {"sensors": {"pen_force": [force[t]], "position": d.positions[t].tolist()}}

    one, other = (run("monitor", arm / "channel.probdmp", "-", text=stream_of(d, tick)) for tick in (beside, within))
    assert one.stdout == other.stdout
    assert one.exit_code == 4
    execution = load(arm / "channel.probdmp").execute(
        start=d.positions[0], detector=(detector := load_detector(arm / "channel.probdmp"))
    )
    for t, line in enumerate(one.stdout.splitlines()):
        answer = json.loads(line)
        assert answer["position"] == execution.step(within(t)["sensors"]).position.tolist()
    assert answer["failed"] is detector.verdicts([d])[0].failed
    alone = run("monitor", arm / "channel.probdmp", "-", text=stream_of(d, lambda t: {"position": d.positions[t].tolist()}))
    assert (alone.exit_code, json.loads(alone.stdout.splitlines()[-1])["failed"]) in ((0, False), (4, True))


def test_what_was_not_measured_is_null_or_left_out(arm, run):
    ticks = [
        {"sensors": {"encoder": [0.3, None]}},
        {"sensors": {"encoder": None}},
        {"sensors": {}},
        {"sensors": {"camera": None}},
    ]
    result = run("monitor", arm / "sensed.probdmp", "-", text="".join(json.dumps(tick) + "\n" for tick in ticks))
    assert [json.loads(line)["log_likelihood"] == 0 for line in result.stdout.splitlines()] == [False, True, True, True]


def test_feedback_says_what_modulates_the_command(arm, run, executions, learned):
    d, detector = executions[1], load_detector(arm / "sensed.probdmp")
    commands = {}
    for option, names in (("encoder,pen_force", ["encoder", "pen_force"]), ("none", []), (None, None)):
        given = () if option is None else ("--feedback", option)
        result = run("monitor", arm / "sensed.probdmp", "-", *given, text=stream_of(d, lambda t: tick_of(d, t)))
        execution = learned.execute(detector=detector, feedback=names)
        expected = [execution.step(tick_of(d, t)["sensors"]).position.tolist() for t in range(d.n_samples)]
        commands[option] = [json.loads(line)["position"] for line in result.stdout.splitlines()]
        assert commands[option] == expected
        assert result.exit_code == 4
    planned = learned.rollout(dt=learned.primitive_.dt).positions
    n = min(len(planned), d.n_samples)
    np.testing.assert_allclose(commands["none"][: n - 1], planned[1:n], atol=1e-8)
    assert commands["none"] != commands[None]


@pytest.mark.parametrize("option", ["gyro", "encoder,encoder", ""])
def test_feedback_of_no_sensor_is_a_usage_error(option, arm, run):
    result = run("monitor", arm / "sensed.probdmp", "-", "--feedback", option, text='{"sensors": {}}\n')
    assert (result.exit_code, result.stdout) == (2, "")
    assert "feedback" in result.stderr or "the name of a sensor that modulates the command" in result.stderr


def test_feedback_is_for_json_lines(arm, run, executions):
    result = run("monitor", arm / "sensed.probdmp", arm / "executions.npz", "--feedback", "encoder")
    assert result.exit_code == 2
    assert "--feedback with JSON lines only" in result.stderr


def test_monitor_takes_the_sensors_of_the_calibration_and_no_others(arm, run, run_json, executions, tmp_path):
    files = (arm / "sensed.probdmp", arm / "executions.npz")
    with_them = run_json("monitor", *files, "--sensors", arm / "sensors.toml", exit_code=4)
    assert with_them == run_json("monitor", *files, exit_code=4)
    for name, text in (("noise", SENSORS.replace("0.002", "0.02")), ("camera", SENSORS[: SENSORS.rindex("[[sensor]]")])):
        (tmp_path / f"{name}.toml").write_text(text)
        result = run("monitor", *files, "--sensors", tmp_path / f"{name}.toml")
        assert (result.exit_code, result.stdout) == (2, "")
        assert "expected the sensors that the detector was calibrated with, 'encoder' (enc_1, enc_2), 'camera'" in result.stderr
        assert "probdmp fit --sensors" in result.stderr
    other = run("monitor", arm / "channel.probdmp", arm / "executions.npz", "--sensors", arm / "sensors.toml")
    assert other.exit_code == 2
    assert "calibrated with, 'position' (q1, q2), 'pen_force' (pen_force), got 'encoder'" in other.stderr


GOOD = '{"sensors": {"encoder": [0.3, 0.5]}}'


@pytest.mark.parametrize(
    ("tick", "words"),
    [
        ('{"sensors": [1]}', '"sensors" as an object with a reading for each name'),
        ('{"sensors": null}', '"sensors" as an object'),
        ('{"sensors": {"gyro": 1}}', "readings of the sensors 'encoder', 'camera', 'pen_force' on line 2, got one of 'gyro'"),
        (
            '{"position": [0.3, 0.5]}',
            "readings of the sensors 'encoder', 'camera', 'pen_force' on line 2, got one of 'position'",
        ),
        ('{"sensors": {"position": [1, 2]}, "position": [1, 2]}', 'the reading of "position" once'),
        ('{"sensors": {"encoder": [1]}}', r"encoder of shape \(2,\) on line 2, got \(1,\)"),
        ('{"sensors": {"encoder": 1}}', "encoder as a list of numbers or null"),
        ('{"sensors": {"encoder": {"enc_1": 1}}}', "encoder as a list of numbers or null"),
        ('{"sensors": {"encoder": [1, true]}}', "encoder as a list of numbers or null"),
        ('{"sensors": {"encoder": [1, "2"]}}', "encoder as real numbers"),
        ('{"sensors": {"encoder": [1, [2]]}}', "encoder as"),
        ('{"sensors": {"encoder": [1, 1e400]}}', "encoder finite"),
        ('{"sensors": {"pen_force": true}}', "pen_force as a list of numbers or null"),
        ('{"sensors": {"pen_force": "hard"}}', "pen_force as real numbers"),
        ('{"sensors": {"pen_force": [1, 2]}}', r"pen_force of shape \(1,\)"),
        ('{"sensor": {"pen_force": 1}}', 'a tick with "position" or "sensors", and perhaps "time"'),
        ('{"time": 1}', 'a tick with "position" or "sensors"'),
        ('{"sensors": {}, "time": "now"}', "time"),
    ],
)
def test_malformed_readings_are_refused_with_their_line(tick, words, arm, run):
    result = run("monitor", arm / "sensed.probdmp", "-", text=f"{GOOD}\n{tick}\n")
    assert (result.exit_code, len(result.stdout.splitlines()), result.stderr.count("\n")) == (3, 1, 1)
    assert "on line 2, got" in result.stderr
    assert re.search(words, result.stderr)


# --- the file of sensors ----------------------------------------------------------------------------------------------


def read(text, primitive, tmp_path):
    path = tmp_path / "s.toml"
    path.write_text(text)
    return read_sensor_file(path).sensors_for(primitive)


def test_every_kind_of_sensor_is_read(learned, tmp_path):
    text = """
    [[sensor]]
    name = "gyro"
    measures = ["velocity:q2", "position:q1"]
    covariance = [[inf, 0], [0, 0.1]]
    [[sensor]]
    name = "all"
    measures = "acceleration"
    stds = [1, inf]
    [[sensor]]
    name = "mix"
    matrix = [[0, 0, 1, 0, 0, -1]]
    stds = 0.5
    gate = 3
    [[sensor]]
    name = "eye"
    link_lengths = [1, 2]
    covariance = [[2, 1], [1, 2]]
    outputs = ["u", "v"]
    linearization = "unscented"
    [[sensor]]
    name = "pen_force"
    gate = 4
    """
    gyro, every, mix, eye, force = read(text, learned.primitive_, tmp_path)
    assert (gyro.outputs, every.outputs) == (("velocity_q2", "q1"), ("acceleration_q1", "acceleration_q2"))
    np.testing.assert_array_equal(gyro.matrix, np.eye(6)[[4, 2]])
    np.testing.assert_array_equal(gyro.covariance, np.diag([np.inf, 0.1]))
    np.testing.assert_array_equal(every.covariance, np.diag([1, np.inf]))
    np.testing.assert_array_equal(mix.matrix, [[0, 0, 1, 0, 0, -1]])
    assert (mix.covariance.tolist(), mix.gate, mix.outputs) == ([[0.25]], 3.0, ("mix",))
    assert (eye.outputs, eye.linearization, eye.covariance.tolist()) == (("u", "v"), "unscented", [[2, 1], [1, 2]])
    assert (force.gate, force.covariance[0, 0]) == (4.0, learned.primitive_.channels.observation_variances[0])
    (given,) = read('[[sensor]]\nname = "pen_force"\nkind = "channel"\nstds = 0.5', learned.primitive_, tmp_path)
    assert given.covariance.tolist() == [[0.25]]


ENCODER = '[[sensor]]\nname = "encoder"\nmeasures = "position"\n'
EYE = '[[sensor]]\nname = "eye"\nlink_lengths = [1, 2]\n'


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "tables \\[\\[sensor\\]\\], in two brackets, and nothing else in .*s.toml, got nothing"),
        ("sensor = 1", "tables \\[\\[sensor\\]\\]"),
        ("sensor = []", "tables \\[\\[sensor\\]\\]"),
        ("sensor = [1]", "a name as text of sensor 1"),
        ('[sensor]\nname = "encoder"', "tables \\[\\[sensor\\]\\], in two brackets"),
        (ENCODER + "stds = 1\n[camera]", "tables \\[\\[sensor\\]\\].*got 'sensor', 'camera'"),
        ("[[sensor]\n", "TOML in .*s.toml, got something else"),
        ("x = " + "[" * 100_000, "TOML in .*s.toml, got something else"),
        ("x = " + "1" * 10_000, "TOML in .*s.toml, got something else"),
        ('[[sensor]]\nmeasures = "position"', "a name as text of sensor 1 in .*s.toml"),
        ("[[sensor]]\nname = 3", "a name as text of sensor 1 in .*s.toml"),
        ('[[sensor]]\nname = ""', "a name as text of sensor 1 in .*s.toml"),
        (
            '[[sensor]]\nname = "a"\nkind = "lidar"',
            "kind to be one of 'state', 'linear', .* in sensor 'a' of .*s.toml, got 'lidar'",
        ),
        ('[[sensor]]\nname = "a"\nkind = 3', "kind to be one of"),
        ('[[sensor]]\nname = "a"\nmeasure = "position"', "one of measures, matrix, link_lengths in sensor 'a'.*got 'measure'"),
        (
            ENCODER + "stds = 1\nlag = 2",
            "only name, kind, stds, covariance, gate, measures, outputs in sensor 'encoder'.*got 'lag'",
        ),
        ('[[sensor]]\nname = "a"\nkind = "state"\nstds = 1', "measures in sensor 'a' of .*s.toml, got 'name', 'kind', 'stds'"),
        ('[[sensor]]\nname = "a"\n"" = 1', "one of measures"),
        (ENCODER, "either stds or covariance in sensor 'encoder' of .*s.toml, got neither"),
        (
            ENCODER + "stds = 1\ncovariance = [[1, 0], [0, 1]]",
            "either stds or covariance in sensor 'encoder' of .*s.toml, got both",
        ),
        (ENCODER + "stds = 0", "stds of sensor 'encoder' > 0 in .*s.toml, got 0"),
        (ENCODER + "stds = nan", "stds of sensor 'encoder' finite"),
        (ENCODER + "stds = -inf", "stds of sensor 'encoder' finite"),
        (ENCODER + "stds = [1, 2, 3]", r"stds of sensor 'encoder' of shape \(2,\) in .*s.toml, got \(3,\)"),
        (ENCODER + 'stds = "1"', "stds of sensor 'encoder' as real numbers"),
        (ENCODER + "stds = true", "stds of sensor 'encoder' as real numbers"),
        (ENCODER + "stds = 1979-05-27", "stds of sensor 'encoder' as real numbers"),
        (ENCODER + "stds = [[1], [1, 2]]", "stds of sensor 'encoder' as a rectangular array"),
        (
            ENCODER + "covariance = [[1, 2], [2, 1]]",
            "covariance of sensor 'encoder' symmetric and positive definite in .*s.toml",
        ),
        (ENCODER + "covariance = [[1, 0]]", "covariance of sensor 'encoder' of shape"),
        (ENCODER + "covariance = {a = 1}", "covariance of sensor 'encoder' as real numbers"),
        (ENCODER + 'stds = 1\noutputs = "xy"', "outputs as a list of names in sensor 'encoder' of .*s.toml"),
        (ENCODER + 'stds = 1\noutputs = ["x"]', "2 different names for the outputs of sensor 'encoder' in .*s.toml"),
        (ENCODER + "stds = 1\ngate = 0", "gate of sensor 'encoder' > 0"),
        (ENCODER + 'stds = 1\ngate = "5"', "gate of sensor 'encoder' > 0"),
        (
            ENCODER.replace('"position"', '"pos"') + "stds = 1",
            "what sensor 'encoder' measures to be one of .* in .*s.toml, got 'pos'",
        ),
        (ENCODER.replace('"position"', '["position:x"]') + "stds = 1", "the degree of freedom after the colon"),
        (ENCODER.replace('"position"', "3") + "stds = 1", "measures as text or a list of texts in sensor 'encoder'"),
        (ENCODER.replace('"position"', "[3]") + "stds = 1", "measures as text or a list of texts in sensor 'encoder'"),
        (ENCODER.replace('"position"', "[]") + "stds = 1", "sensor 'encoder'"),
        ('[[sensor]]\nname = "a"\nmatrix = [[1, 2]]\nstds = 1', "matrix of sensor 'a' with 3 D columns in .*s.toml"),
        ('[[sensor]]\nname = "a"\nmatrix = [[1, 2, 3]]\nstds = 1', "matrix of sensor 'a' with 6 columns in .*s.toml, got 3"),
        ('[[sensor]]\nname = "a"\nmatrix = []\nstds = 1', "matrix of sensor 'a'"),
        ('[[sensor]]\nname = "a"\nmatrix = [[1], [1, 2]]\nstds = 1', "matrix of sensor 'a' as a rectangular array"),
        (EYE.replace("2]", "2, 3]") + "stds = 1", "link lengths of sensor 'eye', one for each of q1, q2 in .*s.toml, got 3"),
        (EYE.replace("2]", "-2]") + "stds = 1", "all of lengths > 0 in sensor 'eye'"),
        (EYE + 'stds = 1\nlinearization = "none"', "linearization to be one of .* in sensor 'eye'"),
        (
            '[[sensor]]\nname = "grip"',
            r"a channel that was learned, one of \('pen_force',\) in .*s.toml, got 'grip'\. Learn it",
        ),
        ('[[sensor]]\nname = "pen_force"\nstds = [1, 2]', r"stds of sensor 'pen_force' of shape \(1,\)"),
        ((ENCODER + "stds = 1\n") * 2, "sensors with different names in .*s.toml"),
        (
            ENCODER + 'stds = 1\n[[sensor]]\nname = "e"\nmeasures = "position"\nstds = 1',
            "sensors with different outputs in .*s.toml",
        ),
        ((ENCODER + "stds = 1\n") * 101, "tables \\[\\[sensor\\]\\]"),
    ],
)
def test_files_that_describe_no_sensors_are_refused_with_file_and_sensor(text, words, learned, tmp_path):
    with pytest.raises(DataFileError, match=words):
        read(text, learned.primitive_, tmp_path)


@pytest.mark.parametrize("verb", ["track", "smooth", "monitor"])
def test_a_bad_file_of_sensors_is_bad_input_in_one_line(verb, arm, run, tmp_path):
    for name, payload in (("bad.toml", b"\xff\xfe"), ("missing.toml", None), ("encoder.toml", ENCODER.encode())):
        if payload is not None:
            (tmp_path / name).write_bytes(payload)
        result = run(verb, arm / "sensed.probdmp", arm / "reach.npz", "--sensors", tmp_path / name)
        assert (result.exit_code, result.stdout, result.stderr.count("\n")) == (3, "", 1)
        assert name in result.stderr


def test_the_example_in_the_module_is_one(learned, tmp_path):
    import probdmp.cli.sensor_file as module

    text = module.__doc__[module.__doc__.index("[[sensor]]") : module.__doc__.index("inf, which")]
    sensors = read(text, learned.primitive_, tmp_path)
    assert [sensor.name for sensor in sensors] == ["encoder", "mix", "camera", "pen_force"]
    assert SensorArray(learned.primitive_, sensors).outputs[:2] == ("enc_x", "enc_y")


def test_columns_of_a_file_are_channels(arm):
    assert set(read_demonstrations(arm / "reach.npz")[0].channels) == {*OUTPUTS}
