"""Bad input through the public API: a typed error that says expected and got, or a finite result.

Never a silent NaN, never another exception. The properties run on a hundred examples each, and on thousands with `-m slow`.
"""

import dataclasses
import inspect
from decimal import Decimal

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from probdmp import (
    Demonstration,
    FailureDetector,
    OnlineExecution,
    PrimitiveLibrary,
    ProbabilisticDMP,
    ProbDMPError,
    Task,
    demonstration_from_times,
    synthetic_letters,
)
from probdmp.errors import InputError, NotFittedError
from probdmp.execution import ExecutionStep


def assert_finite(value):
    """No NaN and no infinity in what came back, but for marks of what was not measured."""
    if isinstance(value, np.ndarray):
        assert np.isfinite(value).all()
    elif isinstance(value, float | int):
        assert np.isfinite(value)
    elif isinstance(value, ProbabilisticDMP):
        assert_finite(value.primitive_)
        assert_finite(value.rollout())
    elif dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            if field.name not in ("innovations", "test_ratio") and not isinstance(value, Demonstration | Task):
                assert_finite(getattr(value, field.name))
    elif isinstance(value, ExecutionStep):
        for name in ("time", "phase", "position", "velocity", "acceleration", "covariance", "log_likelihood", "contributions"):
            assert_finite(getattr(value, name))
        assert_finite(list(value.channels.values()))
    elif isinstance(value, list | tuple):
        for item in value:
            assert_finite(item)


def refuses_or_works(call):
    """Run a call that may be wrong; what it returns, or the error it was refused with."""
    try:
        with np.errstate(all="ignore"):  # what overflows on the way may do so, if it is refused or finite in the end
            result = call()
    except ProbDMPError as error:
        result = error
    if isinstance(result, ProbDMPError):
        assert isinstance(result, ValueError | TypeError)
        assert result.expected
        assert result.got
        assert str(result).startswith(f"Expected {result.expected}, got {result.got}.")
        assert len(str(result)) < 1000
    else:
        with np.errstate(all="ignore"):
            assert_finite(result)
    return result


# --- what comes in ----------------------------------------------------------------------------------------------------

ODD = [
    None, True, np.True_, "1", b"1", "", 1j, [], [[]], [1.0], [[1.0], [2.0, 3.0]], {}, {"a": 1.0}, object(), np.nan, np.inf,
    -np.inf, 0, 0.0, -0.0, -1, 1e300, -1e300, 1e-300, 5e-324, 1e101, 1e100, 1e-100, 10**400, -(10**400), 2**63, Decimal("0.1"),
    np.float32(0.01), np.float16(0.01), np.longdouble(0.01), np.int8(1), np.array(0.01), np.array([0.01]), np.array("1"),
    np.datetime64(0, "s"), np.array(None), lambda: None, range(3), {1.0}, slice(3), ...,
]  # fmt: skip
odd = st.sampled_from(ODD) | st.floats() | st.integers() | st.text(max_size=3)
"""Nearly anything."""
pairs = odd | st.lists(st.floats() | st.sampled_from([None, "1", 1j, 0.0, 1.0]), max_size=3)
"""What may be given for two coordinates."""
durations = st.sampled_from([1e-300, 1e-160, 1e-100, 1e-40, 1e-6, 0.1, 1.0, 30.0, 1e6, 1e40, 1e100]) | odd
"""Seconds, or not."""


def mostly(good, bad):
    """One bad argument in four, so that most calls have one or two of them and some none."""
    return st.sampled_from([good, good, good, bad]).flatmap(lambda strategy: strategy)


DAMAGES = {
    "none": lambda x, rng: x,
    "nan": lambda x, rng: np.where(rng.random(x.shape) < 0.2, np.nan, x),
    "all nan": lambda x, rng: x * np.nan,
    "nan column": lambda x, rng: np.where(np.arange(x.shape[-1]) == 0, np.nan, x) if x.ndim else x,
    "nan first": lambda x, rng: np.concatenate([x[:1] * np.nan, x[1:]]) if x.ndim else x,
    "inf": lambda x, rng: np.where(rng.random(x.shape) < 0.1, np.inf, x),
    "constant": lambda x, rng: x * 0 + 0.3,
    "zero": lambda x, rng: x * 0,
    "still column": lambda x, rng: np.where(np.arange(x.shape[-1]) == 0, 0.0, x) if x.ndim else x,
    "steps": lambda x, rng: np.round(x),
    "spike": lambda x, rng: np.where(rng.random(x.shape) < 0.05, 1e6, x),
    "1e300": lambda x, rng: x * 1e300,
    "1e-300": lambda x, rng: x * 1e-300,
    "subnormal": lambda x, rng: x * 1e-320,
    "1e60": lambda x, rng: x * 1e60,
    "1e-60": lambda x, rng: x * 1e-60,
    "1e30": lambda x, rng: x * 1e30,
    "1e-30": lambda x, rng: x * 1e-30,
    "mixed units": lambda x, rng: x * 10.0 ** rng.integers(-30, 30, x.shape[-1]) if x.ndim else x,
    "far away": lambda x, rng: x + 1e9,
    "loop": lambda x, rng: np.concatenate([x, x[::-1]]),
    "float32": lambda x, rng: x.astype(np.float32),
    "int": lambda x, rng: (x * 10).astype(np.int16),
    "big endian": lambda x, rng: x.astype(">f8"),
    "complex": lambda x, rng: x.astype(complex),
    "object": lambda x, rng: x.astype(object),
    "text": lambda x, rng: x.astype(str),
    "bool": lambda x, rng: x > 0,
    "masked": lambda x, rng: np.ma.masked_where(rng.random(x.shape) < 0.1, x),
    "list": lambda x, rng: x.tolist(),
    "ragged": lambda x, rng: [*x.tolist(), [1.0]],
    "transposed": lambda x, rng: x.T,
    "strided": lambda x, rng: np.repeat(x, 2, axis=0)[::2],
    "extra axis": lambda x, rng: x[None],
}


@st.composite
def arrays(draw, shapes, damages=tuple(DAMAGES)):
    """An array of some shape with one thing wrong with it, or nothing."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    x = rng.standard_normal(draw(shapes)).cumsum(axis=0)
    return DAMAGES[draw(st.sampled_from(damages))](x, rng)


tables = arrays(
    st.tuples(st.sampled_from([0, 1, 2, 3, 4, 5, 7, 12, 20]), st.sampled_from([2, 2, 2, 1, 3, 0]))
    | st.tuples(st.integers(0, 9))
    | st.tuples(st.integers(1, 2), st.integers(3, 9), st.just(2))
)
"""What may be given for a recording of two degrees of freedom."""


@pytest.fixture(scope="module")
def letters():
    return synthetic_letters(3, letters="v", dt=0.02)


@pytest.fixture(scope="module")
def models(letters):
    """The default configuration and the paper's."""
    return [p.fit(letters) for p in (ProbabilisticDMP(6), ProbabilisticDMP.as_published(6))]


@pytest.fixture(scope="module")
def detectors(models, letters):
    rules = ("calibrated", "paper")
    return [FailureDetector(rule=rule).fit(p, letters) for rule, p in zip(rules, models, strict=True)]


# --- properties -------------------------------------------------------------------------------------------------------


def demonstration(positions, dt, names, label):
    refuses_or_works(lambda: Demonstration(positions, dt, label, names))


def time_stamped_samples(times, positions, dt):
    refuses_or_works(lambda: demonstration_from_times(times, positions, dt))


def fit(recordings, dt, n_basis, published, smoothing):
    p = ProbabilisticDMP.as_published(n_basis) if published else ProbabilisticDMP(n_basis, smoothing=smoothing)
    refuses_or_works(lambda: p.fit(recordings, dt))


def constructor_arguments(letters, name, value):
    refuses_or_works(lambda: ProbabilisticDMP(**({"n_basis": 5} | {name: value})).fit(letters))


def task_arguments(models, which, start, goal, duration, ratio, velocity):
    """`ratio`: dt, or how many of them there are in the duration."""
    dt = duration / ratio if isinstance(duration, float) and type(ratio) is int and 0 < ratio < 10**12 else ratio
    refuses_or_works(lambda: models[which].rollout(start, goal, duration, dt, velocity))
    refuses_or_works(lambda: models[which].sample(1, start, goal, duration, dt, velocity, random_state=0))


def executions(models, which, observations, dt, start, goal, duration):
    for run in (models[which].track, models[which].smooth):
        refuses_or_works(lambda run=run: run(observations, dt, start, goal, duration))
    refuses_or_works(lambda: models[which].score_samples([observations], dt))


def verdicts(detectors, which, recordings, dt):
    refuses_or_works(lambda: detectors[which].verdicts(recordings, dt))
    refuses_or_works(lambda: detectors[which].predict(recordings, dt))


def calibration(models, which, recordings, dt):
    found = refuses_or_works(lambda: FailureDetector(rule="paper").fit(models[which], recordings, dt))
    if isinstance(found, FailureDetector):
        assert_finite(list(found.state()["minima"].values()))


def lists_of_tasks(models, letters, start, goal, duration, velocity, count):
    task = refuses_or_works(lambda: Task(start, goal, duration, velocity))
    if not isinstance(task, Task):
        return
    tasks = [task] * count
    refuses_or_works(lambda: models[0].score_samples(letters[:2], tasks=tasks))
    refuses_or_works(lambda: FailureDetector().fit(models[0], letters[:2], tasks=tasks))


def online(models, detectors, which, observations, times, dt, duration, on_alarm):
    model, detector = models[which], detectors[which]
    execution = refuses_or_works(lambda: model.execute(duration=duration, dt=dt, detector=detector, on_alarm=on_alarm))
    if isinstance(execution, OnlineExecution):
        for observation, time in zip(observations, times, strict=False):
            refuses_or_works(lambda observation=observation, time=time: execution.step(observation, time))
        refuses_or_works(execution.step)


LENGTHS = st.sampled_from([3, 4, 5, 7, 12, 20, 40])
POINTS = arrays(
    st.just((2,)), ("none", "none", "nan", "all nan", "inf", "int", "1e300", "1e30", "1e-300", "text", "masked", "list")
)
recording = arrays(st.tuples(LENGTHS, st.just(2)))
recordings = mostly(st.lists(recording, min_size=1, max_size=3), tables | st.lists(tables, max_size=3) | odd)
points = mostly(st.none() | POINTS, pairs)
seconds = mostly(st.just(0.02), st.none() | durations)
which = st.integers(0, 1)
FIELDS = ["n_basis", "weight_model", "weight_uncertainty", "forcing_noise", "discretization", "scaling", "alpha_z", "smoothing"]
PROPERTIES = {
    demonstration: {
        "positions": mostly(recording, tables | odd),
        "dt": mostly(st.just(0.01), durations),
        "names": mostly(st.just(()), st.lists(odd, max_size=3) | odd),
        "label": mostly(st.just("a"), odd),
    },
    time_stamped_samples: {
        "times": mostly(
            arrays(st.just((12,)), ("none",)).map(np.sort), arrays(st.tuples(st.sampled_from([0, 1, 3, 12]))) | odd
        ),
        "positions": mostly(arrays(st.just((12, 2))), arrays(st.tuples(st.just(12), st.integers(0, 2))) | tables | odd),
        "dt": mostly(st.none() | st.just(0.1), durations),
    },
    fit: {
        "recordings": recordings,
        "dt": mostly(st.just(0.01), durations),
        "n_basis": st.sampled_from([1, 5, 30]),
        "published": mostly(st.just(False), st.just(True)),
        "smoothing": st.sampled_from([0.0, 0.05, 0.5]),
    },
    constructor_arguments: {
        "name": st.sampled_from([*FIELDS, "alpha_z", "alpha_z", "smoothing", "n_basis"]),
        "value": st.sampled_from([1, 2, 25.0, 1e-5, 1e5, 1e30, 0.1, 0.5, "paper", "posterior"]) | odd,
    },
    task_arguments: {
        "which": which,
        "start": points,
        "goal": points,
        "duration": mostly(st.sampled_from([0.5, 1.0, 3.0]), st.none() | durations),
        "ratio": mostly(st.integers(20, 60), st.integers(1, 20) | durations),
        "velocity": points,
    },
    executions: {
        "which": which,
        "observations": mostly(recording, tables | odd),
        "dt": seconds,
        "start": points,
        "goal": points,
        "duration": mostly(st.none(), durations),
    },
    verdicts: {"which": which, "recordings": recordings, "dt": seconds},
    calibration: {"which": which, "recordings": recordings, "dt": seconds},
    lists_of_tasks: {
        "start": mostly(st.just(np.zeros(2)), POINTS | pairs),
        "goal": mostly(st.just(np.ones(2)), POINTS | pairs),
        "duration": mostly(st.just(np.array(1.0)), durations),
        "velocity": mostly(st.none(), POINTS | pairs),
        "count": mostly(st.just(2), st.integers(0, 3)),
    },
    online: {
        "which": which,
        "observations": st.lists(mostly(POINTS, pairs), max_size=8),
        "times": st.lists(mostly(st.none() | st.floats(0, 1), odd), min_size=8, max_size=8),
        "dt": seconds,
        "duration": mostly(st.just(1.0), durations),
        "on_alarm": mostly(st.sampled_from(["continue", "hold"]), odd),
    },
}


@pytest.mark.parametrize("n_examples", [100, pytest.param(5000, marks=pytest.mark.slow)])
@pytest.mark.parametrize("prop", PROPERTIES, ids=lambda prop: prop.__name__)
def test_a_typed_error_or_a_finite_result(prop, n_examples, request):
    wanted = set(inspect.signature(prop).parameters) - set(PROPERTIES[prop])
    fixtures = {name: request.getfixturevalue(name) for name in wanted}

    @settings(max_examples=n_examples, suppress_health_check=[HealthCheck.too_slow])
    @given(**PROPERTIES[prop])
    def run(**example):
        prop(**fixtures, **example)

    run()


# --- known cases ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("duration", [1e-300, 1e-200, 1e-100, 1e-90, 1e-80, 1e-50, 1e-10, 1e10, 1e50, 1e100])
def test_durations_of_absurd_size(models, letters, duration):
    for p in models:
        for n_steps in (1, 50):
            refuses_or_works(lambda p=p, dt=duration / n_steps: p.rollout(duration=duration, dt=dt))
            refuses_or_works(lambda p=p, dt=duration / n_steps: p.sample(duration=duration, dt=dt))
            refuses_or_works(lambda p=p, dt=duration / n_steps: p.execute(duration=duration, dt=dt).step())
        refuses_or_works(lambda p=p: p.track(letters[0], duration=duration))
        refuses_or_works(lambda p=p: p.smooth(letters[0], duration=duration))
        refuses_or_works(lambda p=p: p.score_samples([letters[0].positions], dt=duration))


@pytest.mark.parametrize("dt", [5e-324, 1e-320, 1e-300, 1e-90, 1e-50, 1e50, 1e90, 1e99, 1e100])
@pytest.mark.parametrize("smoothing", [0.0, 0.5])
def test_rates_of_absurd_size(letters, dt, smoothing):
    refuses_or_works(lambda: ProbabilisticDMP(5, smoothing=smoothing).fit([letters[0].positions], dt))


@pytest.mark.parametrize("alpha_z", [1e-300, 1e-100, 1e-30, 1e-5, 1.0, 1e3, 1e4, 1e5, 1e30, 1e100])
def test_springs_of_absurd_strength(letters, alpha_z):
    refuses_or_works(lambda: ProbabilisticDMP(5, alpha_z=alpha_z).fit(letters))


@pytest.mark.parametrize("observation", [1e20, 1e50, 1e100, -1e100])
def test_observations_of_absurd_size(models, observation):
    for p in models:
        execution = p.execute()
        for _ in range(5):
            refuses_or_works(lambda execution=execution: execution.step([observation, 0.0]))
        refuses_or_works(lambda p=p: p.track(np.full((40, 2), observation)))


@pytest.mark.parametrize("seed", [-1, "a", 1.5, [1, "b"], object()])
def test_seeds_that_cannot_be_used(models, seed):
    with pytest.raises(ProbDMPError, match=r"Expected random_state"):
        models[0].sample(random_state=seed)


@pytest.mark.parametrize("count", [0, -1, 1.5, None, True])
def test_numbers_of_samples_that_cannot_be_used(models, count):
    with pytest.raises(ProbDMPError, match=r"Expected n_samples as a whole number"):
        models[0].sample(count)


@pytest.mark.parametrize("detector", [3, "paper", object(), FailureDetector])
def test_what_is_no_detector(models, detector):
    with pytest.raises(ProbDMPError, match=r"Expected .*detector"):
        models[0].execute(detector=detector)


@pytest.mark.parametrize("learned", [3, None, "a.probdmp", ProbabilisticDMP()])
def test_what_cannot_be_judged(letters, learned):
    with pytest.raises(ProbDMPError, match=r"Expected .*learned"):
        FailureDetector().fit(learned, letters)


@pytest.mark.parametrize("primitives", ["abc", [1], {"a": 5}, {"a": ProbabilisticDMP}, {3: ProbabilisticDMP()}, None])
def test_what_is_no_library(primitives):
    with pytest.raises(ProbDMPError, match=r"Expected .*primitive|Expected .*label"):
        PrimitiveLibrary(primitives)


@pytest.mark.parametrize("demonstrations", ["abc", [1], None, {"a": 5}, {"a": []}])
def test_what_is_no_labelled_set_of_demonstrations(demonstrations):
    with pytest.raises(ProbDMPError, match=r"Expected .*demonstration"):
        PrimitiveLibrary.fit(demonstrations, dt=0.01)


@pytest.mark.parametrize("tasks", [3, "ab", [1, 2], [None, None]])
def test_what_are_no_tasks(models, letters, tasks):
    with pytest.raises(ProbDMPError, match=r"Expected .*[Tt]ask"):
        models[0].score_samples(letters[:2], tasks=tasks)


@pytest.mark.parametrize("n_tasks", [0, 1, 3])
def test_one_task_for_each_execution(models, detectors, letters, n_tasks):
    tasks = [Task(letters[0].positions[0], letters[0].positions[-1], np.array(1.0))] * n_tasks
    for run in (models[0].score_samples, detectors[0].verdicts, detectors[0].predict):
        with pytest.raises(InputError, match=r"Expected .*task"):
            run(letters[:2], tasks=tasks)
    with pytest.raises(InputError, match=r"Expected .*task"):
        FailureDetector().fit(models[0], letters[:2], tasks=tasks)


@pytest.mark.parametrize(
    ("name", "bad"),
    [("duration", np.nan), ("duration", np.inf), ("goal", np.inf), ("start", np.inf), ("start_velocity", np.inf)],
)
def test_tasks_made_by_hand_are_checked(name, bad):
    task = Task(np.zeros(2), np.ones(2), np.array(1.0))
    with pytest.raises(InputError, match=f"Expected .*{name}.*, got"):
        dataclasses.replace(task, **{name: np.full(() if name == "duration" else 2, bad)})


def test_tasks_of_other_degrees_of_freedom(models, letters):
    task = Task(np.zeros(3), np.ones(3), np.array(1.0))
    with pytest.raises(ProbDMPError, match=r"Expected .*"):
        models[0].score_samples(letters[:1], tasks=[task])


@pytest.mark.parametrize("start", [[np.nan, np.nan], [np.nan, 1.0]])
@pytest.mark.parametrize("velocity", [None, [np.nan, 0.0]])
def test_starts_that_are_not_known(models, letters, start, velocity):
    for p in models:
        task = Task(start, np.ones(2), np.array(1.0), velocity)
        assert_finite(p.score_samples(letters[:1], tasks=[task]))
        assert_finite(p.rollout(start, start_velocity=velocity))
        assert_finite(p.sample(2, start, start_velocity=velocity, random_state=0))
        assert_finite(p.execute(start, start_velocity=velocity).step())


@pytest.mark.parametrize("stiffness", [41.0, 900.0])
def test_steps_too_coarse_for_the_spring(letters, stiffness):
    """Numbers of the exact scheme are sound for alpha_z dt / duration up to 40."""
    p = ProbabilisticDMP(5, alpha_z=1e3).fit(letters)
    dt = p.primitive_.duration * stiffness / 1e3
    for run in (p.rollout, p.sample, p.execute):
        with pytest.raises(InputError, match=r"Expected alpha_z dt / duration <= 40"):
            run(dt=dt)
    assert_finite(p.rollout(dt=dt * 39 / stiffness))


def test_a_recording_beyond_the_size_limit(models):
    with pytest.raises(InputError, match=r"positions with 3 to 100000 samples, got \(100001, 2\)"):
        models[0].track(np.zeros((100_001, 2)))
    with pytest.raises(InputError, match="a duration of 1 to 100000 steps of dt"):
        models[0].rollout(dt=1e-9)


def test_error_messages_stay_short(models):
    """A large array is not printed into the message."""
    for call in (lambda: models[0].rollout(dt=np.zeros(10_000)), lambda: models[0].rollout(start=np.zeros(10_000))):
        with pytest.raises(ProbDMPError) as caught:
            call()
        assert len(str(caught.value)) < 1000


def test_a_model_that_was_not_fitted():
    with pytest.raises(NotFittedError, match="Call fit"):
        ProbabilisticDMP().rollout()
