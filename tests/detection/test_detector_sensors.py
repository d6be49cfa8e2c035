"""Detectors of executions that other sensors observe than those of the positions, or others beside them."""

import json
from dataclasses import replace

import numpy as np
import pytest
from detection.damage import JUNK, damaged, places, with_surplus
from detection.verdicts import assert_same, run_online, task_of

from probdmp import FailureDetector, ProbabilisticDMP, load, load_detector
from probdmp.demonstrations import Demonstration, fault_named, written_letters
from probdmp.detection.sources import NIS_WINDOW
from probdmp.detection.trajectory_model import MOVEMENT_CHANNELS, MOVEMENT_FLOORS
from probdmp.errors import InputError, InputTypeError
from probdmp.execution import (
    LinearSensor,
    NonlinearSensor,
    PlanarArm,
    SensorArray,
    filter_recordings,
    planar_arm_sensor,
    recording_of_readings,
    state_sensor,
)

DT, TRAINED, JUDGED = 0.03, 10, 5
SPEED_STD, SLOW_STD, CAMERA_STD = 2.0, 0.05, 0.002
LINKS = np.array([0.5, 0.4])
NAN = np.nan


def generator(seed=0):
    return np.random.default_rng(seed)


# --- velocities beside positions --------------------------------------------------------------------------------------


def spoken(written, seed):
    """A letter with what a tachometer says of it, mm/s, and a slow sensor of the position, which measures every fifth time."""
    rng, d = generator(seed), written.demonstration
    speeds = written.velocities + SPEED_STD * rng.standard_normal(written.velocities.shape)
    slow = written.positions + SLOW_STD * rng.standard_normal(written.positions.shape)
    slow[np.arange(len(slow)) % 5 > 0] = NAN
    names = ("velocity_x", "velocity_y", "slow_x", "slow_y")
    return replace(d, channels=dict(zip(names, np.column_stack([speeds, slow]).T, strict=True)))


@pytest.fixture(scope="module")
def letters():
    return [spoken(written, k) for k, written in enumerate(written_letters(TRAINED + JUDGED, letters="s", dt=0.02))]


@pytest.fixture(scope="module")
def training(letters):
    return letters[:TRAINED]


@pytest.fixture(scope="module")
def fresh(letters):
    return letters[TRAINED:]


@pytest.fixture(scope="module")
def learned(training):
    return ProbabilisticDMP(8).fit(training)


def encoders(learned):
    return state_sensor(learned.primitive_, "encoders", "position", 0.05)


def tacho(learned, gate=None):
    return state_sensor(learned.primitive_, "tacho", "velocity", SPEED_STD, gate=gate)


def slow_encoders(learned):
    return state_sensor(learned.primitive_, "slow", "position", SLOW_STD, ["slow_x", "slow_y"])


@pytest.fixture(scope="module")
def both(learned, training):
    """Of executions whose positions and velocities are measured."""
    return FailureDetector(0.1).fit(learned, training, sensors=[encoders(learned), tacho(learned)])


@pytest.fixture(scope="module")
def fast(learned, training):
    """Of executions whose positions alone are measured, as if nobody asked."""
    return FailureDetector(0.1).fit(learned, training)


@pytest.fixture(scope="module")
def slow(learned, training):
    """Of executions whose positions are measured every fifth time."""
    return FailureDetector(0.1).fit(learned, training, sensors=[slow_encoders(learned)])


def lying(recording, factor=1.5, d=0):
    """The velocity of one degree of freedom is too large from the middle on, say of a sensor with a wrong gear."""
    name = ("velocity_x", "velocity_y")[d]
    speed = recording.channels[name]
    wrong = np.where(np.arange(len(speed)) < len(speed) // 3, speed, factor * speed)
    return replace(recording, channels={**recording.channels, name: wrong})


def held(recording):
    """Blocked from the middle on, by all that is measured."""
    onset, rng = recording.n_samples // 2, generator()
    fault = fault_named("hold")
    channels = {name: np.array(channel) for name, channel in recording.channels.items()}
    for d, axis in enumerate("xy"):
        channels[f"velocity_{axis}"][onset:] = SPEED_STD * rng.standard_normal(recording.n_samples - onset)
        seen = ~np.isnan(channels[f"slow_{axis}"])
        channels[f"slow_{axis}"][onset:] = np.where(
            seen[onset:], recording.positions[onset - 1, d] + SLOW_STD * rng.standard_normal(recording.n_samples - onset), NAN
        )
    return replace(recording, positions=fault(recording.positions, onset, rng), channels=channels)


def test_a_sensor_that_is_no_position_is_a_channel_of_its_own(both, learned):
    """Named as it is; positions are still judged as a trajectory, and the outputs of the sensor stand behind them."""
    assert both.rule_.family.channels == (*MOVEMENT_CHANNELS, "tacho")
    assert [sensor.name for sensor in both.sensors_] == ["encoders", "tacho"]
    for by_label in both.rule_.calibrations.values():
        assert by_label[""].maxima.shape == (TRAINED, len(MOVEMENT_CHANNELS) + 1)
        assert np.all(by_label[""].maxima > 0)
    execution = learned.execute(detector=both, dt=0.01)
    assert execution.verdict.names == ("x", "y", "velocity_x", "velocity_y")


def test_what_it_says_is_the_mean_square_of_its_innovations(both, learned, fresh):
    """Of both outputs over a twentieth of the duration, in standard deviations; at each tick the largest since the last, and
    between samples the latest."""
    recording, array = fresh[0], SensorArray(learned.primitive_, both.sensors_)
    task = task_of(learned.primitive_, recording, True)
    ((source, ticks),) = both.rule_.family.replay(learned.primitive_, [task], [recording])
    found = np.array([value[-1] for observed in ticks for value in source.update(observed)])
    forward = filter_recordings(learned.primitive_, [task], [recording], array)
    part = array.slices["tacho"]
    variances = np.diagonal(forward.innovation_covariances[:, 0], axis1=-2, axis2=-1)[:, part]
    squares = np.mean(forward.innovations[:, 0, part] ** 2 / variances, axis=1)
    length = round(NIS_WINDOW * recording.duration / recording.dt)
    means = np.array([squares[max(t - length + 1, 0) : t + 1].mean() for t in range(len(squares))])
    ticks_at = np.ceil(np.arange(101) * recording.duration / 100 / recording.dt - 1e-6).astype(int)  # when a tick is complete
    since = np.concatenate([[-1], ticks_at[:-1]])
    expected = [means[a + 1 : b + 1].max() if b > a else means[b] for a, b in zip(since, ticks_at, strict=True)]
    np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_what_goes_well_is_fine(both, fresh, learned):
    told = [task_of(learned.primitive_, d, True) for d in fresh]
    assert sum(v.failed for v in both.verdicts(fresh)) + sum(v.failed for v in both.verdicts(fresh, tasks=told)) <= 2


@pytest.mark.parametrize("d", [0, 1])
def test_a_velocity_that_lies_is_noticed_and_named(both, fresh, d):
    found = both.verdicts([lying(recording, 2.0, d) for recording in fresh])
    assert all(v.failed for v in found)
    named = [v for v in found if v.channel == "tacho"]
    assert len(named) >= JUDGED - 1
    for verdict in named:
        assert (verdict.kind, verdict.cause) == ("motion", "unexpected readings of tacho")
        assert verdict.blamed in (("+velocity_x", "−velocity_x"), ("+velocity_y", "−velocity_y"))[d]
        np.testing.assert_array_equal(verdict.contributions[:2], 0)


def test_a_larger_lie_is_told_sooner(both, fresh):
    small, large = (both.verdicts([lying(recording, factor) for recording in fresh]) for factor in (1.2, 2.0))
    assert np.mean([v.time for v in large]) < np.mean([v.time for v in small])
    assert sum(v.test_ratio for v in large) > sum(v.test_ratio for v in small)


def test_movement_faults_are_still_called_by_their_name(both, fresh):
    found = both.verdicts([held(recording) for recording in fresh])
    assert all(v.failed for v in found)
    assert sum((v.kind, v.cause) == ("timing", "held") for v in found) >= JUDGED - 1
    pushed = both.verdicts(
        [
            replace(d, positions=fault_named("push:0.5")(d.positions, d.n_samples // 2, generator(k)))
            for k, d in enumerate(fresh)
        ]
    )
    assert sum(v.kind == "motion" for v in pushed) == JUDGED


def test_a_sensor_that_measures_nothing_is_no_failure(both, learned, fresh):
    """The positions say how the movement goes, as they do without it."""
    nothing = np.full(fresh[0].n_samples, NAN)
    mute = replace(fresh[0], channels={**fresh[0].channels, "velocity_x": nothing, "velocity_y": nothing})
    (verdict,) = both.verdicts([mute])
    assert (verdict.failed, verdict.is_stale) == (False, False)
    (values, silent), task = ([], []), task_of(learned.primitive_, mute, False)
    for found, recording in ((values, fresh[0]), (silent, mute)):
        ((source, ticks),) = both.rule_.family.replay(learned.primitive_, [task], [recording])
        found += [value for observed in ticks for value in source.update(observed)]
    np.testing.assert_array_equal(np.stack(silent)[:, :-1], np.stack(values)[:, :-1])
    assert np.isnan(np.stack(silent)[:, -1]).all()


def test_the_columns_of_the_sensors_must_be_there(both, learned, training, fresh):
    bare = [replace(d, channels={}) for d in training]
    with pytest.raises(
        InputError, match=r"recordings with the columns velocity_x, velocity_y of sensor 'tacho', got one without"
    ):
        FailureDetector().fit(learned, bare, sensors=both.sensors_)
    with pytest.raises(InputError, match="of sensor 'tacho'"):
        both.verdicts([replace(fresh[0], channels={})])


# --- one verdict online and over recordings ---------------------------------------------------------------------------


@pytest.mark.parametrize("told", [True, False], ids=["known", "nominal"])
@pytest.mark.parametrize("what", ["fine", "lying", "held", "dropout"])
def test_online_is_offline(both, learned, fresh, what, told):
    recording = {"fine": fresh[0], "lying": lying(fresh[1]), "held": held(fresh[2]), "dropout": lossy(fresh[3])}[what]
    task = task_of(learned.primitive_, recording, told)
    (verdict,) = both.verdicts([recording], tasks=[task])
    execution, steps = run_online(learned.primitive_, task, recording, both)
    assert_same(execution.verdict, verdict)
    ratios = [step.test_ratio for step in steps]
    if verdict.failed and verdict.channel not in ("sensor", "silence"):
        assert ratios[verdict.step] == pytest.approx(verdict.test_ratio)


def lossy(recording):
    """A tenth of all numbers is missing."""
    rng = generator(1)
    channels = {name: np.where(rng.random(len(c)) < 0.1, NAN, c) for name, c in recording.channels.items()}
    positions = np.where(rng.random(recording.positions.shape) < 0.1, NAN, recording.positions)
    positions[0] = recording.positions[0]
    return replace(recording, positions=positions, channels=channels)


@pytest.mark.parametrize(
    "arguments",
    [
        {"statistic": "nis"},
        {"statistic": "log_likelihood", "persistence": 2},
        {"statistic": "cusum"},
        {"rule": "paper"},
        {"rule": "paper", "likelihood": "cumulative"},
    ],
    ids=str,
)
def test_innovations_are_of_all_outputs(learned, training, fresh, arguments):
    sensors = [encoders(learned), tacho(learned, gate=5.0)]
    judge = FailureDetector(0.1, **arguments).fit(learned, training[:3], sensors=sensors)
    chosen = [lying(fresh[1], 3.0), held(fresh[2])]
    for recording, verdict in zip(chosen, judge.verdicts(chosen), strict=True):
        assert verdict.names == ("x", "y", "velocity_x", "velocity_y")
        task = task_of(learned.primitive_, recording, False)
        assert_same(run_online(learned.primitive_, task, recording, judge)[0].verdict, verdict)


# --- what observes an execution ---------------------------------------------------------------------------------------


def test_an_execution_is_observed_by_what_the_detector_knows(both, learned, fresh):
    """Unless it is said otherwise; readings then come by name."""
    recording = lying(fresh[0], 2.0)
    execution = learned.execute(recording.positions[0], dt=recording.dt, detector=both)
    assert execution.array.names == ("encoders", "tacho")
    speeds = np.column_stack([recording.channels["velocity_x"], recording.channels["velocity_y"]])
    for position, speed in zip(recording.positions, speeds, strict=True):
        execution.step({"encoders": position, "tacho": speed})
    assert_same(execution.verdict, both.verdicts([recording])[0])
    again = learned.execute(recording.positions[0], dt=recording.dt, detector=both, sensors=both.sensors_)
    assert again.array.names == ("encoders", "tacho")


@pytest.mark.parametrize("order", ["fewer", "another order", "other outputs", "none were given"])
def test_an_execution_with_other_sensors_is_refused(both, learned, training, order):
    sensors = {
        "fewer": [encoders(learned)],
        "another order": [tacho(learned), encoders(learned)],
        "other outputs": [encoders(learned), state_sensor(learned.primitive_, "tacho", "velocity:x", 1.0)],
        "none were given": [encoders(learned), tacho(learned)],
    }[order]
    detector = FailureDetector(rule="paper").fit(learned, training) if order == "none were given" else both
    known = "x, y" if order == "none were given" else "x, y, velocity_x, velocity_y"
    got = ", ".join(output for sensor in sensors for output in sensor.outputs)
    hint = r"Give fit\(…, sensors=…\) those that observe executions"
    with pytest.raises(InputError, match=rf"an execution observed by {known}, as in calibration, got {got}\. {hint}"):
        learned.execute(detector=detector, sensors=sensors)


def held_out(learned, recordings, sensors=None, **arguments):
    """A detector that is fitted in no time."""
    return FailureDetector(0.1, calibration="held_out", **arguments).fit(learned.primitive_, recordings, sensors=sensors)


def test_the_order_of_sensors_does_not_matter(learned, training, fresh):
    """Nor their names, but for what they are called by."""
    judge = held_out(learned, training[:4], [encoders(learned), tacho(learned)])
    other = held_out(learned, training[:4], [replace(tacho(learned), name="speeds"), encoders(learned)])
    chosen = [fresh[0], lying(fresh[1])]
    for one, two in zip(judge.verdicts(chosen), other.verdicts(chosen), strict=True):
        names = {"tacho": "speeds", "unexpected readings of tacho": "unexpected readings of speeds"}
        renamed = replace(one, channel=names.get(one.channel, one.channel), cause=names.get(one.cause, one.cause))
        assert_same(renamed, two, 1e-5)


def test_positions_alone_are_judged_as_without_being_told(learned, training, fresh, fast):
    """The same sensors, said or not."""
    told = FailureDetector(0.1).fit(learned, training, sensors=SensorArray(learned.primitive_).sensors)
    chosen = [fresh[0], held(fresh[1])]
    for one, other in zip(told.verdicts(chosen), fast.verdicts(chosen), strict=True):
        assert_same(one, other)
    assert told.state()["sensors"] is not None
    assert fast.state()["sensors"] is None
    assert {**told.state(), "sensors": None} == fast.state()


def test_a_fit_that_fails_leaves_the_sensors_as_they_were(learned, training):
    detector = FailureDetector(rule="paper").fit(learned, training, sensors=[encoders(learned)])
    before = detector.state()
    for wrong in ([], [tacho(learned), tacho(learned)], ["tacho"], "tacho", [LinearSensor("far", np.ones((1, 9)), [1.0])]):
        with pytest.raises((InputError, InputTypeError), match="sensor"):
            detector.fit(learned, training, sensors=wrong)
    assert detector.state() == before


# --- sensors that measure now and then --------------------------------------------------------------------------------


def test_a_slow_sensor_is_not_silent(learned, fresh, slow, fast):
    """Every fifth sample, as in calibration: no staleness, no more false alarms, and failures are still found."""
    assert slow.rule_.family.channels == MOVEMENT_CHANNELS  # a position is a position
    fine = slow.verdicts(fresh)
    assert not any(v.is_stale or v.has_sensor_fault or v.kind == "data missing" for v in fine)
    assert sum(v.failed for v in fine) <= sum(v.failed for v in fast.verdicts(fresh)) + 1
    blocked = slow.verdicts([held(recording) for recording in fresh])
    assert sum(v.failed for v in blocked) == JUDGED
    assert sum((v.kind, v.cause) == ("timing", "held") for v in blocked) >= JUDGED - 2
    assert not any(v.is_stale for v in blocked)
    recording = held(fresh[0])
    task = task_of(learned.primitive_, recording, False)
    assert_same(run_online(learned.primitive_, task, recording, slow)[0].verdict, blocked[0])


def test_a_slow_sensor_that_is_lost_is_missed(slow, fresh):
    lost = {name: np.where(fresh[0].times > 0.4, NAN, c) for name, c in fresh[0].channels.items()}
    (verdict,) = slow.verdicts([replace(fresh[0], channels=lost)])
    assert (verdict.kind, verdict.is_stale) == ("data missing", True)


# --- the tool of an arm, and no positions at all ----------------------------------------------------------------------


def reach(seed):
    """An arm with two links reaches, bulging a little; a camera sees its tool, and nobody its joints."""
    rng, arm = generator([7, seed]), PlanarArm(LINKS)
    s = np.linspace(0, 1, 41 + int(rng.integers(-2, 3)))
    jerk, bump = 10 * s**3 - 15 * s**4 + 6 * s**5, np.sin(np.pi * s) ** 2
    start, step = np.array([0.3, 0.9]) + 0.02 * rng.standard_normal(2), np.array([0.9, 0.6]) + 0.05 * rng.standard_normal(2)
    angles = start + jerk[:, None] * step + bump[:, None] * 0.1 * rng.standard_normal(2)
    tool = arm(angles) + CAMERA_STD * rng.standard_normal(angles.shape)
    channels = dict(zip(("camera_x", "camera_y"), tool.T, strict=True))
    noisy = angles + 0.002 * rng.standard_normal(angles.shape)
    return Demonstration(noisy, DT, names=("q1", "q2"), units="rad", channels=channels)


@pytest.fixture(scope="module")
def reaches():
    return [reach(k) for k in range(TRAINED + JUDGED)]


@pytest.fixture(scope="module")
def arm(reaches):
    return ProbabilisticDMP(8).fit(reaches[:TRAINED])


@pytest.fixture(scope="module")
def camera():
    return planar_arm_sensor("camera", LINKS, CAMERA_STD)


@pytest.fixture(scope="module")
def watched(arm, camera, reaches):
    """By the camera alone."""
    return FailureDetector(0.02, persistence=3).fit(arm, reaches[:TRAINED], sensors=[camera])


def displaced(recording, distance=0.05):
    """The tool is aside from the middle on, metres."""
    x = recording.channels["camera_x"]
    aside = np.where(np.arange(len(x)) < len(x) // 2, x, x + distance)
    return replace(recording, channels={**recording.channels, "camera_x": aside})


def unseen(recording):
    """Without what nobody measures."""
    return replace(recording, positions=np.full(recording.positions.shape, NAN))


@pytest.mark.parametrize("told", [True, False], ids=["known", "nominal"])
def test_without_positions_the_tool_is_judged(watched, arm, reaches, told):
    """Nobody measures the positions, so nobody misses them."""
    assert watched.rule_.family.channels[-1] == "camera"
    for by_label in watched.rule_.calibrations.values():
        assert np.all(by_label[""].maxima[:, :-1] <= MOVEMENT_FLOORS)  # of what is not measured nothing is known
        assert np.all(by_label[""].maxima[:, -1] > 0)
    fresh = reaches[TRAINED:]
    tasks = [task_of(arm.primitive_, d, told) for d in fresh]
    fine, wrong = (watched.verdicts(given, tasks=tasks) for given in (fresh, [displaced(d) for d in fresh]))
    assert sum(v.failed for v in fine) <= 1
    assert not any(v.is_stale or v.kind == "data missing" for v in fine + wrong)
    assert all(v.failed for v in wrong)
    onsets = [recording.dt * (recording.n_samples // 2) for recording in fresh]
    noticed = [verdict for verdict, onset in zip(wrong, onsets, strict=True) if 0 <= verdict.time - onset <= 0.1]
    assert len(noticed) >= JUDGED - 1
    for verdict in noticed:
        assert (verdict.channel, verdict.kind, verdict.cause) == ("camera", "motion", "unexpected readings of camera")
        assert verdict.blamed == "+camera_x"
        assert verdict.names == ("q1", "q2", "camera_x", "camera_y")


@pytest.mark.parametrize("told", [True, False], ids=["known", "nominal"])
def test_online_is_offline_without_positions(watched, arm, reaches, told):
    for recording in (reaches[-1], displaced(reaches[-2])):
        task = task_of(arm.primitive_, recording, told)
        (verdict,) = watched.verdicts([recording], tasks=[task])
        assert_same(run_online(arm.primitive_, task, recording, watched)[0].verdict, verdict)


def test_positions_need_not_be_recorded_where_they_are_not_measured(watched, arm, camera, reaches):
    """Then nobody knows where demonstrations ended either: the detector is for executions that are not told their goal."""
    array = SensorArray(arm.primitive_, [camera])

    def of_camera(d):
        return recording_of_readings(array, {"camera": np.column_stack([d.channels["camera_x"], d.channels["camera_y"]])}, DT)

    fresh = reaches[TRAINED:]
    calm, aside = ([of_camera(d) for d in given] for given in (fresh, [displaced(d) for d in fresh]))
    detector = held_out(arm, calm, [camera], persistence=3)
    assert set(detector.rule_.calibrations) == {False}
    assert sum(v.failed for v in detector.verdicts(calm)) <= 1
    assert all(v.failed and v.channel == "camera" for v in detector.verdicts(aside))
    assert not any(v.kind == "data missing" for v in detector.verdicts(calm))
    with pytest.raises(InputError, match="a detector calibrated on executions that tell their goal"):
        detector.verdicts(calm[:1], tasks=[task_of(arm.primitive_, fresh[0], True)])
    for one, other in zip(watched.verdicts(calm), watched.verdicts([unseen(d) for d in fresh]), strict=True):
        assert_same(one, other)


def test_one_of_several_positions_may_be_unmeasured(arm, reaches):
    """An encoder of the first joint and a camera: the joint is judged as a trajectory, and nobody waits for the other one."""
    encoder = state_sensor(arm.primitive_, "encoder", ["position:q1"], 0.002)
    sensors = [encoder, planar_arm_sensor("camera", LINKS, CAMERA_STD)]
    detector = held_out(arm, reaches[:TRAINED], sensors, persistence=3)
    assert np.all(detector.rule_.calibrations[False][""].maxima[:, [0, 1, -1]] > 0)
    fresh = reaches[TRAINED:][:3]
    pushed = [replace(d, positions=fault_named("push:0.8")(d.positions, 20, generator(k))) for k, d in enumerate(fresh)]
    found = [detector.verdicts(given) for given in (fresh, [displaced(d) for d in fresh], pushed)]
    assert not any(v.kind in ("data missing", "sensor") or v.is_stale for verdicts in found for v in verdicts)
    assert all(v.failed for verdicts in found[1:] for v in verdicts)
    assert sum(v.blamed == "+camera_x" for v in found[1]) >= 2
    task = task_of(arm.primitive_, pushed[0], False)
    assert_same(run_online(arm.primitive_, task, pushed[0], detector)[0].verdict, found[2][0])


def test_a_camera_that_is_slower_than_the_ticks_is_heard_all_the_same(arm, camera, reaches):
    """What persists does so between its frames, however many moments in a row are asked for; not long after the last frame."""

    def rarely(recording, lost=np.inf):
        kept = (np.arange(recording.n_samples) % 2 == 0) & (recording.times < lost)
        return replace(recording, channels={name: np.where(kept, c, NAN) for name, c in recording.channels.items()})

    taught, fresh = ([rarely(d) for d in group] for group in (reaches[:TRAINED], reaches[TRAINED:]))
    times = []
    for persistence in (1, 2, 4):
        detector = held_out(arm, taught[:5], [camera], persistence=persistence)
        found = detector.verdicts([rarely(displaced(d)) for d in fresh[:3]])
        assert all(v.failed and v.channel == "camera" for v in found)
        times.append(np.median([v.time for v in found]))
    assert times[0] <= times[1] <= times[2] <= times[0] + 0.1  # a frame later
    ((source, ticks),) = detector.rule_.family.replay(
        arm.primitive_, [task_of(arm.primitive_, fresh[0], True)], [rarely(fresh[0], lost=0.6)]
    )
    values = np.array([value[-1] for observed in ticks for value in source.update(observed)])
    last = 100 * 18 * DT / fresh[0].duration  # tick of the last frame
    assert np.isfinite(values[: int(last)]).all()
    assert np.isnan(values[int(last + 100 * (NIS_WINDOW + DT / fresh[0].duration)) + 1 :]).all()


# --- files ------------------------------------------------------------------------------------------------------------


def test_linear_sensors_are_kept_with_the_detector(tmp_path, both, learned, fresh):
    learned.save(tmp_path / "s.probdmp", both)
    again, primitive = load_detector(tmp_path / "s.probdmp"), load(tmp_path / "s.probdmp")
    assert again.state() == both.state() == json.loads(json.dumps(both.state()))
    chosen = [fresh[0], lying(fresh[1]), held(fresh[2])]
    for one, other in zip(both.verdicts(chosen), again.verdicts(chosen), strict=True):
        assert_same(one, other, 1e-12)
    execution = primitive.execute(detector=again, dt=0.01)
    assert execution.array.names == ("encoders", "tacho")


def test_the_camera_of_an_arm_is_kept_with_the_detector(tmp_path, watched, arm, reaches):
    arm.save(tmp_path / "arm.probdmp", watched)
    again = load_detector(tmp_path / "arm.probdmp")
    chosen = [*reaches[-2:], displaced(reaches[-1])]
    for one, other in zip(watched.verdicts(chosen), again.verdicts(chosen), strict=True):
        assert_same(one, other, 1e-12)
    task = task_of(arm.primitive_, chosen[2], True)
    execution, _ = run_online(load(tmp_path / "arm.probdmp").primitive_, task, chosen[2], again)
    assert_same(execution.verdict, watched.verdicts(chosen[2:], tasks=[task])[0], 1e-6)


@pytest.mark.parametrize("arguments", [{"statistic": "nis"}, {"rule": "paper"}], ids=str)
def test_innovations_are_kept_with_their_sensors(tmp_path, arm, camera, reaches, arguments):
    judge = held_out(arm, reaches[:4], [camera], **arguments)
    arm.save(tmp_path / "arm.probdmp", judge)
    chosen = [reaches[-1], displaced(reaches[-1])]
    again = load_detector(tmp_path / "arm.probdmp")
    for one, other in zip(judge.verdicts(chosen), again.verdicts(chosen), strict=True):
        assert_same(one, other, 1e-12)


def test_a_function_of_ones_own_cannot_be_saved(tmp_path, arm, reaches):
    """The detector works; no file can hold it, and none is written."""
    function = NonlinearSensor("eye", lambda q: PlanarArm(LINKS)(q), [CAMERA_STD**2] * 2, outputs=("camera_x", "camera_y"))
    detector = held_out(arm, reaches[TRAINED:], [function], statistic="nis")
    assert detector.verdicts([displaced(reaches[0])])[0].failed
    match = r"sensors that a file can hold: .*, got 'eye', which has a function of its own.*without the detector"
    with pytest.raises(InputError, match=match):
        arm.save(tmp_path / "arm.probdmp", detector)
    with pytest.raises(InputError, match=match):
        detector.state()
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("of", ["linear", "camera"])
def test_damaged_sensors_are_refused_or_of_use(both, learned, fresh, watched, arm, reaches, of):
    """Whatever is missing, too much, or something else: never an error of another kind."""
    detector, primitive, recording = {
        "linear": (both, learned.primitive_, fresh[0]),
        "camera": (watched, arm.primitive_, reaches[-1]),
    }[of]
    state, n_refused = detector.state(), 0
    for path in places(state["sensors"]):
        changes = [with_surplus, *(lambda _, junk=junk: junk for junk in JUNK)]
        can_be_missing = not path or isinstance(path[-1], int)  # with fewer sensors, or outputs, there are just fewer
        for change in changes if can_be_missing else [None, *changes]:
            broken = damaged(state, ("sensors", *path), change)
            try:
                restored = FailureDetector.from_state(json.loads(json.dumps(broken, default=repr)), {"": primitive})
            except (InputError, InputTypeError):
                n_refused += 1
                continue
            assert change not in (None, with_surplus), path
            restored.state()
    assert n_refused > 100
    without = {name: value for name, value in state.items() if name != "sensors"}
    with pytest.raises(InputError):
        FailureDetector.from_state(without, {"": primitive})
    assert_same(
        FailureDetector.from_state(state, {"": primitive}).verdicts([recording])[0], detector.verdicts([recording])[0], 1e-12
    )
