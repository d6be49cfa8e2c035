"""The front door: constructor arguments only store, fit learns and returns self, every method says what its layer says."""

import inspect
from collections.abc import Mapping
from dataclasses import fields, replace

import numpy as np
import pytest
from strategies import PAPERS_WEIGHTS

from probdmp import (
    FailureDetector,
    GaussianTrajectory,
    OnlineExecution,
    Primitive,
    PrimitiveLibrary,
    ProbabilisticDMP,
    Task,
    TrackedTrajectory,
    load,
    load_detector,
    synthetic_letters,
)
from probdmp.dmp import task_for
from probdmp.errors import InputError, InputTypeError, ModelFileError, NotFittedError
from probdmp.execution import (
    SensorArray,
    roll_out,
    score_recordings,
    smooth_recording,
    state_sensor,
    task_of_recording,
    track_recording,
)
from probdmp.io import ModelContents, write_model

DEFAULTS = {
    "n_basis": 30, "weight_model": "hierarchical", "weight_uncertainty": "joint", "forcing_noise": "predictive",
    "discretization": "exact", "scaling": "none", "alpha_z": 25.0, "smoothing": 0.05,
    "goal_handling": "blend", "coupling": "full", "channels": (),
}  # fmt: skip


@pytest.fixture(scope="module")
def letters():
    demos = synthetic_letters(4, letters="sv", dt=0.02)
    return {letter: [d for d in demos if d.label == letter] for letter in "sv"}


@pytest.fixture(scope="module")
def learned(letters):
    return ProbabilisticDMP(10).fit(letters["s"])


@pytest.fixture(scope="module")
def library(letters):
    return PrimitiveLibrary.fit(letters, n_basis=8)


def assert_same_trajectory(one, other):
    for name in ("times", "means", "covariances"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


# --- constructor and fit ----------------------------------------------------------------------------------------------


def test_the_constructor_only_stores():
    """Even nonsense: it is fit that checks."""
    nonsense = dict.fromkeys(DEFAULTS, object())
    p = ProbabilisticDMP(**nonsense)
    for name, value in nonsense.items():
        assert getattr(p, name) is value
    assert p.get_params() == nonsense
    assert not hasattr(p, "primitive_")


def test_defaults():
    assert ProbabilisticDMP().get_params() == DEFAULTS
    assert list(inspect.signature(ProbabilisticDMP).parameters) == list(DEFAULTS)


def test_as_published_is_the_papers_configuration(letters):
    p = ProbabilisticDMP.as_published(12)
    choices = PAPERS_WEIGHTS | {"n_basis": 12, "discretization": "semi_implicit_euler", "scaling": "paper"}
    assert p.get_params() == DEFAULTS | choices
    assert ProbabilisticDMP.as_published(forcing_noise="posterior").forcing_noise == "posterior"
    configuration = p.fit(letters["s"]).primitive_.configuration
    assert (configuration.discretization, configuration.scaling, configuration.n_basis) == ("semi_implicit_euler", "paper", 12)


def test_fit_returns_self_and_learns(letters):
    p = ProbabilisticDMP(10)
    assert p.fit(letters["s"]) is p
    assert isinstance(p.primitive_, Primitive)
    assert p.fit_report_.reproduction_errors.shape == (4, 2)
    assert p.get_params() == DEFAULTS | {"n_basis": 10}


def test_fit_forgets_what_it_learned_before(letters, learned):
    p = ProbabilisticDMP(10).fit(letters["v"])
    assert p.fit(letters["s"]).primitive_.identity == learned.primitive_.identity


def test_a_fit_that_fails_leaves_what_was_learned(letters):
    p = ProbabilisticDMP(10).fit(letters["s"])
    identity = p.primitive_.identity
    with pytest.raises(InputError):
        p.fit([np.full((10, 2), np.inf)], dt=0.01)
    assert p.primitive_.identity == identity


def test_fit_takes_what_a_user_has(letters):
    positions = np.stack([d.positions[:40] for d in letters["s"]])
    by_array = ProbabilisticDMP(8).fit(positions, dt=0.02)
    by_list = ProbabilisticDMP(8).fit(list(positions), dt=0.02)
    by_demos = ProbabilisticDMP(8).fit([replace(d, positions=d.positions[:40], names=(), units="") for d in letters["s"]])
    assert by_array.primitive_.identity == by_list.primitive_.identity == by_demos.primitive_.identity
    ProbabilisticDMP(8).fit(letters["s"][0])  # a single demonstration needs no list


@pytest.mark.parametrize(
    ("argument", "value", "error"),
    [
        ("n_basis", 0, InputError), ("n_basis", 10.0, InputTypeError), ("n_basis", None, InputTypeError),
        ("n_basis", 10**6, InputError), ("weight_model", "mixture", InputError), ("weight_uncertainty", "none", InputError),
        ("forcing_noise", "", InputError), ("discretization", 3, InputError), ("scaling", "printed", InputError),
        ("alpha_z", -1.0, InputError), ("alpha_z", "25", InputTypeError), ("alpha_z", np.nan, InputError),
        ("smoothing", 0.7, InputError), ("smoothing", None, InputTypeError),
    ],
)  # fmt: skip
def test_fit_checks_the_arguments(letters, argument, value, error):
    with pytest.raises(error, match=f"Expected {argument}"):
        ProbabilisticDMP(**{argument: value}).fit(letters["s"])


@pytest.mark.parametrize("alpha_z", [0.9e-3, 1.1e4])
def test_springs_that_are_too_soft_or_too_stiff(letters, alpha_z):
    with pytest.raises(InputError, match=r"Expected alpha_z from 0\.001 to 10000"):
        ProbabilisticDMP(alpha_z=alpha_z).fit(letters["s"])


def test_parameters_by_name():
    p = ProbabilisticDMP(12)
    assert p.get_params(deep=False) == p.get_params(deep=True) == p.get_params()
    assert p.set_params(n_basis=7, scaling="paper") is p
    assert p.get_params() == DEFAULTS | {"n_basis": 7, "scaling": "paper"}
    assert p.set_params() is p
    with pytest.raises(InputError, match=r"Expected the name of a parameter to be one of 'n_basis'.*, got 'basis'"):
        p.set_params(basis=3)
    assert not hasattr(p, "basis")


def test_demonstrations_must_agree_in_names_and_units(letters):
    first, second, *_ = letters["s"]
    for change in ({"names": first.names[::-1]}, {"units": "furlong"}):
        with pytest.raises(InputError, match=r"the same degrees of freedom .* in the same units"):
            ProbabilisticDMP(5).fit([first, replace(second, **change)])


def test_repr_can_be_pasted():
    p = ProbabilisticDMP(12, scaling="paper")
    again = eval(repr(p))
    assert again.get_params() == p.get_params()


def test_not_fitted(letters, tmp_path):
    p = ProbabilisticDMP()
    for use in (
        p.rollout,
        p.execute,
        p.sample,
        lambda: p.track(letters["s"][0]),
        lambda: p.smooth(letters["s"][0]),
        lambda: p.score_samples(letters["s"]),
        lambda: p.save(tmp_path / "a.probdmp"),
        lambda: FailureDetector().fit(p, letters["s"]),
    ):
        with pytest.raises(NotFittedError, match=r"a learned primitive, got .*\. Call fit"):
            use()
    assert list(tmp_path.iterdir()) == []


# --- methods delegate -------------------------------------------------------------------------------------------------


def test_rollout(learned):
    r = learned.rollout()
    assert type(r) is GaussianTrajectory
    assert_same_trajectory(r, roll_out(learned.primitive_, task_for(learned.primitive_), 0.02))
    assert r.positions.shape == r.velocities.shape == r.acceleration_stds.shape == (len(r.times), 2)
    assert r.covariances.shape == (len(r.times), 2, 3, 3)
    args = ([1.0, 2.0], [3.0, 4.0], 2.0, 0.05, [5.0, 6.0])
    task = task_for(learned.primitive_, *args[:3], args[4])
    assert_same_trajectory(learned.rollout(*args), roll_out(learned.primitive_, task, 0.05))
    named = learned.rollout(start=args[0], goal=args[1], duration=args[2], dt=args[3], start_velocity=args[4])
    assert_same_trajectory(named, learned.rollout(*args))


def test_track_and_smooth(learned, letters):
    demo = letters["s"][1]
    k = learned.track(demo)
    assert type(k) is TrackedTrajectory
    assert_same_trajectory(k, track_recording(learned.primitive_, task_of_recording(learned.primitive_, demo), demo))
    n = demo.n_samples
    assert k.log_likelihoods.shape == (n,)
    assert k.innovations.shape == k.innovation_variances.shape == k.contributions.shape == (n, 2)
    assert_same_trajectory(learned.track(demo.positions), k)  # dt as learned
    assert_same_trajectory(learned.track(demo.positions.tolist(), dt=0.02), k)
    s = learned.smooth(demo)
    assert s.means.shape == k.means.shape
    np.testing.assert_allclose(s.means[-1], k.means[-1], rtol=1e-9)
    known = {"start": demo.positions[0], "goal": demo.positions[-1], "duration": demo.duration, "start_velocity": [0.0, 0.0]}
    assert np.any(learned.track(demo, **known).means != k.means)
    assert np.any(learned.smooth(demo, **known).means != s.means)


def test_execute(learned, letters):
    demo = letters["s"][0]
    e = learned.execute(start=demo.positions[0], duration=demo.duration)
    assert type(e) is OnlineExecution
    np.testing.assert_allclose(
        [e.step(o).log_likelihood for o in demo.positions], learned.track(demo).log_likelihoods, rtol=1e-9, atol=1e-9
    )
    assert (e.failed, e.verdict) == (False, None)


def test_execute_with_a_detector(learned, letters):
    detector = FailureDetector().fit(learned, letters["s"])
    e = learned.execute(detector=detector, on_alarm="hold")
    for _ in range(2 * letters["s"][0].n_samples):
        step = e.step(letters["s"][0].positions[0])
    assert e.failed
    assert e.verdict.cause == "held"
    assert e.verdict.test_ratio > 1
    np.testing.assert_array_equal(step.velocity, 0)


def test_execute_without_a_start_knows_what_the_demonstrations_knew(learned, letters):
    """Somewhere about their mean, which the first observation tells; a rollout is from the mean itself."""
    unknown = learned.execute()
    assert np.isnan(unknown.task.start).all()
    assert unknown.task.start_velocity is None
    np.testing.assert_array_equal(learned.rollout().position_stds[0], 0)
    seen = learned.primitive_.start + np.sqrt(learned.primitive_.start_covariances[:, 1, 1])
    known = learned.execute(learned.primitive_.start)
    assert unknown.step(seen).log_likelihood != known.step(seen).log_likelihood
    np.testing.assert_array_equal(known.task.start, learned.primitive_.start)
    partly = learned.execute([np.nan, 1.0])
    np.testing.assert_array_equal(partly.task.start, [np.nan, 1.0])


def test_a_step_has_the_verdict_so_far(learned, letters):
    detector = FailureDetector().fit(learned, letters["s"])
    e = learned.execute(detector=detector)
    assert (e.verdict.failed, e.verdict.test_ratio) == (False, 0.0)
    failed = [e.step([1e5 * t, 0.0]).verdict.failed for t in range(3)]
    assert failed[-1]
    assert e.step().verdict is e.verdict
    assert learned.execute().step().verdict is None


def test_what_is_frozen_hands_out_read_only_arrays(learned, letters):
    detector = FailureDetector().fit(learned, letters["s"])
    e = learned.execute(detector=detector)
    frozen = (
        *(learned.primitive_, learned.fit_report_, letters["s"][0], learned.rollout(), learned.track(letters["s"][0])),
        *(e.step(letters["s"][0].positions[0]).verdict, e.verdict, detector.verdicts(letters["s"])[0], e.task),
    )
    writeable = [
        f"{type(value).__name__}.{field.name}"
        for value in frozen
        for field in fields(value)
        if isinstance(array := getattr(value, field.name), np.ndarray) and array.flags.writeable
    ]
    assert writeable == []
    step = e.step(letters["s"][0].positions[1])
    shown = (
        "position",
        "velocity",
        "acceleration",
        "covariance",
        "contributions",
        "innovations",
        "innovation_covariance",
        "fused",
    )
    assert [name for name in shown if getattr(step, name).flags.writeable] == []


def test_other_sensors(learned, letters):
    other = learned.with_sensor_noise([0.5, 2.0])
    assert type(other) is ProbabilisticDMP
    assert other.get_params() == learned.get_params()
    np.testing.assert_array_equal(other.primitive_.observation_variances, [0.25, 4.0])
    assert other.fit_report_ is None
    assert_same_trajectory(other.rollout(), learned.rollout())  # the same movement
    assert np.any(other.track(letters["s"][0]).means != learned.track(letters["s"][0]).means)
    with pytest.raises(InputError, match="a primitive that this detector was fitted to"):
        other.execute(detector=FailureDetector().fit(learned, letters["s"]))


@pytest.mark.parametrize(
    ("stds", "error"),
    [
        ([0.1], InputError), (0.1, InputError), ([0.1, 0.0], InputError), ([0.1, -0.1], InputError),
        ([0.1, np.nan], InputError), ([0.1, np.inf], InputError), (["a", "b"], InputTypeError), (None, InputTypeError),
    ],
)  # fmt: skip
def test_sensors_that_cannot_be(learned, stds, error):
    with pytest.raises(error, match="Expected"):
        learned.with_sensor_noise(stds)


def test_score_samples_is_the_sum_of_the_tracks(learned, letters):
    scores = learned.score_samples(letters["s"])
    assert scores.shape == (4,)
    np.testing.assert_allclose(scores, [learned.track(d).log_likelihoods.sum() for d in letters["s"]], rtol=1e-10)
    tasks = [task_for(learned.primitive_, d.positions[0], d.positions[-1], d.duration) for d in letters["s"]]
    np.testing.assert_array_equal(
        learned.score_samples(letters["s"], tasks=tasks), score_recordings(learned.primitive_, tasks, letters["s"])
    )
    block = np.stack([d.positions[:40] for d in letters["s"]])
    np.testing.assert_allclose(
        learned.score_samples(block), [learned.track(x).log_likelihoods.sum() for x in block], rtol=1e-10
    )
    np.testing.assert_allclose(learned.score_samples(block), learned.score_samples(list(block), dt=0.02), rtol=1e-12)


def test_sample(learned):
    x = learned.sample(3, random_state=0)
    assert len(x) == 3
    assert x[0].shape == learned.rollout().positions.shape
    np.testing.assert_array_equal(x, learned.sample(3, random_state=0))
    assert np.any(x[0] != learned.sample(3, random_state=1)[0])
    rng = np.random.default_rng(0)
    assert np.any(learned.sample(random_state=rng)[0] != learned.sample(random_state=rng)[0])
    (clean,) = learned.sample(start=[1.0, 2.0], duration=1.0, dt=0.05, start_velocity=[0.0, 0.0], sensor_noise=False)
    assert clean.shape == (21, 2)
    np.testing.assert_array_equal(clean[0], [1.0, 2.0])


def test_what_is_learned_is_not_changed_by_use(letters):
    p = ProbabilisticDMP(8).fit(letters["v"])
    identity, params = p.primitive_.identity, p.get_params()
    p.rollout()
    p.track(letters["v"][0])
    p.execute().step()
    p.sample(2)
    assert (p.primitive_.identity, p.get_params()) == (identity, params)


# --- files ------------------------------------------------------------------------------------------------------------


def test_saved_and_loaded_it_scores_bit_for_bit_the_same(learned, letters, tmp_path):
    path = tmp_path / "s.probdmp"
    learned.save(path)
    again = load(path)
    assert type(again) is ProbabilisticDMP
    assert again.get_params() == learned.get_params()
    assert again.primitive_.identity == learned.primitive_.identity
    assert again.fit_report_ is None
    np.testing.assert_array_equal(again.score_samples(letters["s"]), learned.score_samples(letters["s"]))
    np.testing.assert_array_equal(again.score_samples(letters["v"]), learned.score_samples(letters["v"]))
    assert_same_trajectory(again.rollout(), learned.rollout())
    assert load_detector(path) is None


def test_arguments_given_as_numpy_numbers_can_be_saved(letters, tmp_path):
    p = ProbabilisticDMP(np.int64(8), alpha_z=np.float32(24.5), smoothing=np.float64(0.1)).fit(letters["s"])
    p.save(tmp_path / "s.probdmp")
    assert load(tmp_path / "s.probdmp").primitive_.identity == p.primitive_.identity


@pytest.mark.parametrize("likelihood", ["per_step", "cumulative"])
def test_a_saved_detector_gives_the_same_verdicts(learned, letters, tmp_path, likelihood):
    detector = FailureDetector(likelihood=likelihood).fit(learned, letters["s"][:2])
    learned.save(tmp_path / "s.probdmp", detector)
    again, judge = load(tmp_path / "s.probdmp"), load_detector(tmp_path / "s.probdmp")
    for one, other in zip(detector.verdicts(letters["s"]), judge.verdicts(letters["s"]), strict=True):
        assert (one.failed, one.step, one.test_ratio) == (other.failed, other.step, other.test_ratio)
    assert again.execute(detector=judge).step().test_ratio == 0


def test_a_library_keeps_its_labels_in_a_file(library, letters, tmp_path):
    path = tmp_path / "letters.probdmp"
    library.save(path, FailureDetector().fit(library, letters))
    again = PrimitiveLibrary.load(path)
    assert sorted(again) == ["s", "v"]
    for label in again:
        np.testing.assert_array_equal(again[label].score_samples(letters[label]), library[label].score_samples(letters[label]))
        assert load(path, label).primitive_.identity == library[label].primitive_.identity
    assert len(load_detector(path).verdicts([*letters["s"], *letters["v"]])) == 8
    with pytest.raises(InputError, match=r"a label of the file, one of \['s', 'v'\], got None"):
        load(path)
    with pytest.raises(InputError, match=r"a label of the file, one of \['s', 'v'\], got 'z'"):
        load(path, "z")


def test_a_detector_of_other_primitives_is_not_saved(learned, library, letters, tmp_path):
    foreign = FailureDetector().fit(library["s"], letters["s"])
    both = FailureDetector().fit(library, letters)
    for save in (
        lambda path: learned.save(path, foreign),
        lambda path: library.save(path, foreign),
        lambda path: library["s"].save(path, both),
    ):
        with pytest.raises(InputError, match="a detector fitted to these primitives, got one for others"):
            save(tmp_path / "s.probdmp")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "damage",
    [{"rule": "none"}, {"minima": {"": 1.0}}, {"minima": {}}, {"minima": None}, {"minima": []}, {"surplus": 1}, {"rule": 3}],
    ids=repr,
)
def test_a_damaged_detector_in_a_file(learned, letters, tmp_path, damage):
    state = FailureDetector().fit(learned, letters["s"]).state() | damage
    write_model(tmp_path / "s.probdmp", ModelContents({"": learned.primitive_}, {"": {"smoothing": 0.05}}, state))
    with pytest.raises(ModelFileError, match=r"Expected .* in .*s\.probdmp.* Fit the detector and save the model again"):
        load_detector(tmp_path / "s.probdmp")
    assert load(tmp_path / "s.probdmp").primitive_.identity == learned.primitive_.identity


def test_files_that_are_not_there(tmp_path):
    for read in (load, load_detector, PrimitiveLibrary.load):
        with pytest.raises(ModelFileError, match="Expected a readable file"):
            read(tmp_path / "nothing.probdmp")


# --- libraries --------------------------------------------------------------------------------------------------------


def test_a_library_is_a_mapping(library):
    assert isinstance(library, Mapping)
    assert list(library) == list(library.keys()) == ["s", "v"]
    assert len(library) == 2
    assert "s" in library
    assert "z" not in library
    assert 3 not in library
    assert library.get("z") is None
    assert library.get("s") is library["s"]
    assert repr(library) == "<PrimitiveLibrary: 's', 'v'>"
    with pytest.raises(InputError, match=r"a label of the library, one of \['s', 'v'\], got 'z'"):
        library["z"]
    with pytest.raises(KeyError):
        library["z"]


def test_a_library_learns_each_label_by_itself(library, letters):
    for label, p in library.items():
        assert p.n_basis == 8
        assert p.primitive_.identity == ProbabilisticDMP(8).fit(letters[label]).primitive_.identity


def test_a_library_of_bare_arrays(letters):
    bare = {label: [d.positions for d in demos] for label, demos in letters.items()}
    assert PrimitiveLibrary.fit(bare, dt=0.02, n_basis=5)["s"].primitive_.dt == 0.02


def test_a_library_of_given_primitives(learned):
    given_primitives = {"a": learned}
    library = PrimitiveLibrary(given_primitives)
    given_primitives.clear()
    assert library["a"] is learned


@pytest.mark.parametrize("empty", [PrimitiveLibrary, PrimitiveLibrary.fit])
def test_an_empty_library_is_refused(empty):
    with pytest.raises(InputError, match="at least one primitive, got an empty mapping"):
        empty({})


def test_the_task_of_a_user(learned, letters):
    """A Task made by hand, with lists and plain numbers."""
    demo = letters["s"][0]
    by_hand = Task(np.array(demo.positions[0]), np.array(demo.positions[-1]), np.array(demo.duration))
    own = task_for(learned.primitive_, demo.positions[0], demo.positions[-1], demo.duration)
    np.testing.assert_array_equal(learned.score_samples([demo], tasks=[by_hand]), learned.score_samples([demo], tasks=[own]))


# --- variation --------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def varied(letters):
    return ProbabilisticDMP(10, weight_model="hierarchical", weight_uncertainty="joint").fit(letters["s"])


def test_every_method_takes_joint_weights(varied, letters):
    demo = letters["s"][0]
    for trajectory in (varied.rollout(), varied.track(demo), varied.smooth(demo)):
        assert trajectory.covariances.shape == (len(trajectory.times), 2, 3, 3)
        assert np.isfinite(trajectory.means).all()
    assert varied.fit_report_.observation_noise is None
    rolled = varied.rollout(demo.positions[0], demo.positions[-1], demo.duration, demo.dt)
    errors = np.sqrt(np.mean((rolled.positions - demo.positions) ** 2, axis=0)) / varied.primitive_.ranges
    np.testing.assert_allclose(varied.fit_report_.reproduction_errors[0], errors, rtol=1e-6)
    np.testing.assert_allclose(varied.score_samples([demo])[0], varied.track(demo).log_likelihoods.sum(), rtol=1e-9)
    assert len(varied.sample(3, random_state=0)) == 3
    e = varied.execute(demo.positions[0], demo.positions[-1], demo.duration, demo.dt)
    errors = [np.abs(e.step(now).position - then).max() for now, then in zip(demo.positions, demo.positions[1:], strict=False)]
    assert np.median(errors[5:]) < 0.02 * varied.primitive_.ranges.max()


def test_what_was_seen_tells_about_the_rest(varied, letters):
    """With joint weights the second half is known better after the first; with independent ones hardly."""
    demo = letters["s"][2]
    half = np.array(demo.positions)
    half[len(half) // 2 :] = np.nan
    alone, after = varied.rollout(demo.positions[0], duration=demo.duration, dt=demo.dt), varied.smooth(half, dt=demo.dt)
    later = slice(len(half) // 2 + 3, -3)
    assert np.median(after.position_stds[later] / alone.position_stds[later]) < 0.9


def test_joint_weights_survive_a_file(varied, letters, tmp_path):
    varied.save(tmp_path / "s.probdmp")
    again = load(tmp_path / "s.probdmp")
    assert again.get_params() == varied.get_params()
    assert again.primitive_.identity == varied.primitive_.identity
    assert_same_trajectory(again.rollout(), varied.rollout())
    assert_same_trajectory(again.track(letters["s"][0]), varied.track(letters["s"][0]))


def test_the_paper_stays_one_call_away(varied, letters):
    """Hierarchical weights can be redrawn at every step, pooled ones be joint; only joint ones of a hierarchy are the rest."""
    independent = ProbabilisticDMP(10, weight_model="hierarchical", weight_uncertainty="independent").fit(letters["s"])
    np.testing.assert_allclose(independent.rollout().positions, varied.rollout().positions, atol=1e-9)
    joint = ProbabilisticDMP(10, weight_model="pooled", weight_uncertainty="joint").fit(letters["s"])
    assert joint.primitive_.variation is None
    pooled = ProbabilisticDMP(10, weight_model="pooled", weight_uncertainty="independent").fit(letters["s"])
    np.testing.assert_allclose(joint.rollout().positions, pooled.rollout().positions, atol=1e-9)
    # The same sensors, whether the forcing term strays from pooled weights or is redrawn; without straying, R is all the rest.
    sensors = pooled.primitive_.observation_variances
    np.testing.assert_allclose(joint.primitive_.observation_variances, sensors, rtol=0.3)
    rest = ProbabilisticDMP(10, weight_model="pooled", weight_uncertainty="joint", forcing_noise="posterior").fit(letters["s"])
    assert np.all(rest.primitive_.observation_variances > 10 * sensors)


def test_goals_far_outside_stay_sensible(varied):
    """Three times as far as was shown: the movement leaves the learned one by about as much as its goal."""
    p = varied.primitive_
    learned, goal = varied.rollout(), p.start + 3 * (p.goal - p.start)
    far = varied.rollout(goal=goal)
    np.testing.assert_allclose(far.positions[-1], goal, atol=0.01 * p.ranges.max())
    assert np.abs(far.positions - learned.positions).max() < 1.5 * np.abs(goal - p.goal).max()


@pytest.mark.parametrize("handling", ["best", None])
def test_a_handling_of_goals_that_is_none(letters, handling):
    with pytest.raises(InputError, match="Expected goal_handling to be one of 'blend', 'condition', 'attractor'"):
        ProbabilisticDMP(goal_handling=handling).fit(letters["s"])


@pytest.mark.parametrize("setting", [{}, {"weight_model": "pooled"}, {"weight_uncertainty": "independent"}])
def test_the_papers_scaling_goes_with_the_papers_weights(letters, setting):
    with pytest.raises(InputError, match=r'Expected scaling="none" with weight.*ProbabilisticDMP.as_published\(\)'):
        ProbabilisticDMP(scaling="paper", **setting).fit(letters["s"])
    ProbabilisticDMP(scaling="paper", **PAPERS_WEIGHTS).fit(letters["s"])


# --- sensors and channels ---------------------------------------------------------------------------------------------


def sensors_of(learned, gate=None):
    p = learned.primitive_
    velocity = state_sensor(p, "gyro", "velocity", 0.5 * p.ranges / p.duration, gate=gate)
    return [state_sensor(p, "camera", "position", 0.02 * p.ranges, gate=gate), velocity]


@pytest.fixture(scope="module")
def watched(varied):
    """Executions as the sensors recorded them."""
    return varied.sample_recordings(3, sensors=sensors_of(varied), random_state=0)


def test_every_method_takes_sensors(varied, watched):
    sensors, recording = sensors_of(varied), watched[0]
    array = SensorArray(varied.primitive_, sensors)
    task = task_of_recording(varied.primitive_, recording)
    track = varied.track(recording, sensors=sensors)
    assert_same_trajectory(track, track_recording(varied.primitive_, task, recording, array))
    assert list(track.sensors) == ["camera", "gyro"]
    assert_same_trajectory(
        varied.smooth(recording, sensors=sensors), smooth_recording(varied.primitive_, task, recording, array)
    )
    scores = varied.score_samples(watched, sensors=sensors)
    np.testing.assert_allclose(scores[0], track.log_likelihoods.sum(), rtol=1e-9)
    execution = varied.execute(recording.positions[0], duration=recording.duration, dt=recording.dt, sensors=sensors)
    velocities = np.column_stack(list(recording.channels.values()))
    for position, velocity, wanted in zip(recording.positions, velocities, track.contributions, strict=True):
        step = execution.step({"camera": position, "gyro": velocity})
        np.testing.assert_allclose(step.contributions, wanted, rtol=1e-7, atol=1e-7)


def test_readings_by_name_are_a_recording(varied, watched):
    recording, sensors = watched[1], sensors_of(varied)
    by_name = {"gyro": np.column_stack(list(recording.channels.values())), "camera": recording.positions}
    for run in (varied.track, varied.smooth):
        assert_same_trajectory(run(by_name, dt=recording.dt, sensors=sensors), run(recording, sensors=sensors))
    alone = varied.track({"camera": recording.positions}, dt=recording.dt, sensors=sensors[:1])
    assert_same_trajectory(alone, varied.track(recording, sensors=sensors[:1]))  # other columns are of no interest


def test_unless_told_positions_are_measured_as_in_the_demonstrations(varied, letters):
    demo = letters["s"][0]
    p = varied.primitive_
    own = [replace(state_sensor(p, "position", "position", 1.0), covariance=p.observation_variances)]
    assert_same_trajectory(varied.track(demo), varied.track(demo, sensors=own))
    np.testing.assert_array_equal(varied.score_samples([demo]), varied.score_samples([demo], sensors=own))


def test_feedback_is_of_the_sensors_that_are_named(varied, watched):
    recording, sensors = watched[2], sensors_of(varied)
    start, plan = recording.positions[0], varied.rollout(recording.positions[0])
    blind = varied.execute(start, sensors=sensors, feedback=[])
    for position, wanted in zip(recording.positions[:-1], plan.positions[1:], strict=True):
        np.testing.assert_allclose(blind.step({"camera": position}).position, wanted, atol=1e-9 * np.abs(plan.positions).max())
    assert blind.sensor_counts["camera"].n_fused == len(recording.positions) - 1


def test_recordings_are_drawn_as_the_sensors_would_have_them(varied, watched):
    again = varied.sample_recordings(3, sensors=sensors_of(varied), random_state=0)
    for one, other in zip(watched, again, strict=True):
        np.testing.assert_array_equal(one.positions, other.positions)
        assert list(one.channels) == ["velocity_x", "velocity_y"]
        assert (one.names, one.dt) == (varied.primitive_.names, varied.primitive_.dt)
    bare = varied.sample_recordings(1, duration=1.0, dt=0.05, random_state=1)[0]
    assert (bare.n_samples, dict(bare.channels)) == (21, {})
    gyro = varied.sample_recordings(1, sensors=sensors_of(varied)[1:], random_state=1)[0]
    assert np.isnan(gyro.positions).all()  # which no sensor measures


def test_sensor_noise_is_learned_from_recordings(varied):
    sensors = sensors_of(varied, gate=4.0)
    recordings = varied.sample_recordings(20, sensors=sensors, dt=0.05, random_state=3)
    first = [replace(s, covariance=4 * s.covariance) for s in sensors]
    noise = varied.learn_sensor_noise(first, recordings)
    assert noise.converged
    for found, true in zip(noise.sensors, sensors, strict=True):
        np.testing.assert_allclose(np.diagonal(found.covariance), np.diagonal(true.covariance), rtol=0.25)
        assert found.gate == 4.0
    unknown = [task_for(varied.primitive_, [np.nan, np.nan], duration=r.duration) for r in recordings]
    told = varied.learn_sensor_noise(first, recordings, tasks=unknown)
    np.testing.assert_array_equal(told.sensors[0].covariance, noise.sensors[0].covariance)


def test_a_channel_is_learned_tracked_and_kept(letters, tmp_path):
    demos = [replace(d, channels={"force": 1 + d.positions[:, 0] - d.positions[0, 0]}) for d in letters["s"]]
    felt = ProbabilisticDMP(10, channels=["force"]).fit(demos)
    assert felt.primitive_.channel_names == ("force",)
    rolled = felt.rollout()
    wanted = 1 + rolled.positions[:, 0] - rolled.positions[0, 0]
    np.testing.assert_allclose(rolled.channels["force"].means, wanted, atol=0.05 * felt.primitive_.ranges[0])
    track = felt.track(demos[0])
    assert track.outputs == ("x", "y", "force")
    assert list(track.channels) == ["force"]
    execution = felt.execute(demos[0].positions[0])
    step = execution.step({"position": demos[0].positions[0], "force": 1.0})
    assert step.channels["force"].means.shape == (1,)
    felt.save(tmp_path / "felt.probdmp")
    again = load(tmp_path / "felt.probdmp")
    assert again.primitive_.identity == felt.primitive_.identity
    assert list(again.channels) == ["force"]
    assert_same_trajectory(again.track(demos[0]), track)
    other = again.fit(demos)  # with the settings of the file
    assert other.primitive_.identity == felt.primitive_.identity


def test_coupling_is_a_setting(letters):
    none = ProbabilisticDMP(8, coupling="none").fit(letters["s"]).primitive_
    n = none.variation.means.shape[1]
    assert not none.variation.covariance[:n, n:].any()
    assert ProbabilisticDMP(8).fit(letters["s"]).primitive_.variation.covariance[:n, n:].any()
    with pytest.raises(InputError, match="coupling to be one of 'auto', 'full', 'none', got 'some'"):
        ProbabilisticDMP(8, coupling="some").fit(letters["s"])
